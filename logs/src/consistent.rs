//! Inertial parameters that bodies can have, nearest to what data say and to what was known.
//!
//! A rigid body has mass everywhere positive where its pseudo-inertia P = [Σ h; hᵀ m] is positive definite, with the mass m, the first moment h and the second moment
//! Σ = ∫ r rᵀ dm (Wensing, Kim and Slotine 2018). The distance of a body from that which was known is the log-det divergence tr(P₀⁻¹ P) − log det(P₀⁻¹ P) − 4
//! (Lee, Wensing and Park 2020): it does not depend on axes or units, and keeps P positive definite. The sum of it and of half the squares of the data is convex;
//! Newton's steps are least squares themselves, by QR factorization.

use nalgebra::{DMatrix, DVector, Matrix4};

/// Parameters of a body.
const TEN: usize = 10;
/// Steps of Newton's method at one weight of the data; a few are usual.
const MOST_STEPS: usize = 100;
/// Weights of the data, ten times each.
const MOST_STAGES: i32 = 30;
/// Half the square of the step in the metric of the second derivatives, at which it ends.
const ENOUGH: f64 = 1e-14;
/// The same where data are to weigh more.
const NEARLY: f64 = 1e-2;

/// What is known of a number that is no body's before there are data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScalarPrior {
    /// It is positive, and about this.
    Positive(f64),
    /// It may be anything of this size about zero.
    Free(f64),
}

/// What is looked for.
#[derive(Clone, Debug)]
pub struct ConsistencyProblem<'a> {
    /// Data in units of noise: ‖T x − s‖² is to be small, for the coefficients x.
    pub triangle: &'a DMatrix<f64>,
    /// s.
    pub side: &'a DVector<f64>,
    /// What a square of the data weighs: less than one where noise is not white.
    pub weight: f64,
    /// How coefficients are made of parameters, a row for each: ten of each body, then the scalars.
    pub made_of: &'a [Vec<f64>],
    /// What is added to each of them.
    pub rest: &'a [f64],
    /// Bodies as they were known: m, m c, I about the origin (xx, xy, xz, yy, yz, zz), with positive definite pseudo-inertias.
    pub bodies: &'a [[f64; TEN]],
    /// The other parameters.
    pub scalars: &'a [ScalarPrior],
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct ConsistentParameters {
    /// The bodies: each is one that can be.
    pub bodies: Vec<[f64; TEN]>,
    /// The other parameters.
    pub scalars: Vec<f64>,
    /// Steps of Newton's method.
    pub steps: usize,
}

/// [Σ h; hᵀ m] of m, h and I about the origin.
pub fn pseudo_inertia(body: &[f64; TEN]) -> Matrix4<f64> {
    let [m, x, y, z, xx, xy, xz, yy, yz, zz] = *body;
    let half = 0.5 * (xx + yy + zz);
    Matrix4::new(half - xx, -xy, -xz, x, -xy, half - yy, -yz, y, -xz, -yz, half - zz, z, x, y, z, m)
}

/// Whether a body of these parameters can be, with mass in three dimensions.
pub fn is_body(body: &[f64; TEN]) -> bool {
    pseudo_inertia(body).cholesky().is_some()
}

/// The body with mass in three dimensions that is nearest to one whose inertia is none, or that of a point or a rod: moments about the centre of mass below
/// m r² become that. `None` without mass.
pub fn thickened(body: &[f64; TEN], radius: f64) -> Option<[f64; TEN]> {
    let m = body[0];
    if m.is_nan() || m <= 0.0 || !body.iter().all(|x| x.is_finite()) {
        return None;
    }
    let p = pseudo_inertia(body);
    let c = p.fixed_view::<3, 1>(0, 3) / m;
    let second = p.fixed_view::<3, 3>(0, 0) - c * c.transpose() * m;
    let mut eigen = second.symmetric_eigen();
    eigen.eigenvalues.apply(|x| *x = x.max(m * radius * radius));
    let about_origin = eigen.recompose() + c * c.transpose() * m;
    let trace = about_origin.trace();
    let s = |i: usize, k: usize| 0.5 * (about_origin[(i, k)] + about_origin[(k, i)]);
    let found =
        [m, body[1], body[2], body[3], trace - s(0, 0), -s(0, 1), -s(0, 2), trace - s(1, 1), -s(1, 2), trace - s(2, 2)];
    is_body(&found).then_some(found)
}

/// Derivatives of P by the ten parameters.
fn units() -> [Matrix4<f64>; TEN] {
    std::array::from_fn(|k| pseudo_inertia(&std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 })))
}

/// A divergence with its first and second derivatives.
struct Divergence {
    value: f64,
    slope: DVector<f64>,
    curvature: DMatrix<f64>,
}

impl ConsistencyProblem<'_> {
    /// The parameters at which half the weighed squares and the divergences have their least sum; `None` where a body that was known is none. From what was
    /// known on, data weigh more step by step, ten times each, so that Newton's method is always near.
    pub fn solve(&self) -> Option<ConsistentParameters> {
        let start = self.scalars.iter().map(|prior| match prior {
            ScalarPrior::Positive(x) => *x,
            ScalarPrior::Free(_) => 0.0,
        });
        let mut x = DVector::from_iterator(
            TEN * self.bodies.len() + self.scalars.len(),
            self.bodies.iter().flatten().copied().chain(start),
        );
        let made_of = DMatrix::from_fn(self.made_of.len(), x.len(), |i, k| self.made_of[i][k]);
        let slopes = self.triangle * made_of;
        let side = self.side - self.triangle * DVector::from_column_slice(self.rest);
        let far = 0.5 * self.weight * (&slopes * &x - &side).norm_squared();
        let stages = if far > 1.0 { far.log10().ceil() as i32 } else { 0 };
        let mut steps = 0;
        for stage in (0..=stages.min(MOST_STAGES)).rev() {
            let weight = (self.weight * 10_f64.powi(-stage)).sqrt();
            let enough = if stage == 0 { ENOUGH } else { NEARLY };
            steps += self.descend(&mut x, &(&slopes * weight), &(&side * weight), enough)?;
        }
        let bodies = (0..self.bodies.len()).map(|b| std::array::from_fn(|k| x[TEN * b + k])).collect();
        Some(ConsistentParameters { bodies, scalars: x.iter().skip(TEN * self.bodies.len()).copied().collect(), steps })
    }

    /// Newton's method from `x` on, with the number of its steps.
    fn descend(&self, x: &mut DVector<f64>, slopes: &DMatrix<f64>, side: &DVector<f64>, enough: f64) -> Option<usize> {
        let sum = |x: &DVector<f64>, prior: &[Divergence]| {
            0.5 * (slopes * x - side).norm_squared() + prior.iter().map(|d| d.value).sum::<f64>()
        };
        let mut prior = self.divergences(x)?;
        for steps in 0..MOST_STEPS {
            let left = side - slopes * &*x;
            let step = newton_step(slopes, &left, &prior)?;
            let of_prior = DVector::from_iterator(x.len(), prior.iter().flat_map(|d| d.slope.iter().copied()));
            let slope = of_prior.dot(&step) - left.dot(&(slopes * &step));
            if -0.5 * slope <= enough {
                return Some(steps);
            }
            let now = sum(x, &prior);
            // convex, and infinite outside: some part of the step leads down
            let parts = std::iter::successors(Some(1.0), |part| Some(0.5 * part)).take(40);
            let lower = parts.map(|part| (part, &*x + &step * part)).find_map(|(part, at)| {
                let found = self.divergences(&at)?;
                (sum(&at, &found) <= now + 1e-4 * part * slope).then_some((at, found))
            });
            // only rounding is left
            let Some((at, found)) = lower else { return Some(steps) };
            (*x, prior) = (at, found);
        }
        Some(MOST_STEPS)
    }

    /// Body by body, then scalar by scalar; `None` outside of what can be.
    fn divergences(&self, x: &DVector<f64>) -> Option<Vec<Divergence>> {
        let units = units();
        let of_body = |(b, known): (usize, &[f64; TEN])| {
            let own: [f64; TEN] = std::array::from_fn(|k| x[TEN * b + k]);
            of_bodies(known, &own, &units)
        };
        let of_scalar = |(k, prior): (usize, &ScalarPrior)| {
            let x = x[TEN * self.bodies.len() + k];
            let [value, slope, curvature] = match *prior {
                ScalarPrior::Positive(known) if x > 0.0 && known > 0.0 => {
                    [x / known - (x / known).ln() - 1.0, 1.0 / known - 1.0 / x, 1.0 / (x * x)]
                }
                ScalarPrior::Positive(_) => return None,
                ScalarPrior::Free(size) => [0.5 * (x / size).powi(2), x / (size * size), 1.0 / (size * size)],
            };
            Some(Divergence {
                value,
                slope: DVector::from_element(1, slope),
                curvature: DMatrix::from_element(1, 1, curvature),
            })
        };
        let bodies = self.bodies.iter().enumerate().map(of_body);
        bodies.chain(self.scalars.iter().enumerate().map(of_scalar)).collect()
    }
}

fn of_bodies(known: &[f64; TEN], own: &[f64; TEN], units: &[Matrix4<f64>; TEN]) -> Option<Divergence> {
    let (p0, p) = (pseudo_inertia(known).cholesky()?, pseudo_inertia(own).cholesky()?);
    let (inverse0, inverse) = (p0.inverse(), p.inverse());
    let ratio = inverse0 * pseudo_inertia(own);
    let value = ratio.trace() - (p.determinant().ln() - p0.determinant().ln()) - 4.0;
    let turned = units.map(|unit| inverse * unit);
    Some(Divergence {
        value,
        slope: DVector::from_fn(TEN, |k, _| ((inverse0 - inverse) * units[k]).trace()),
        curvature: DMatrix::from_fn(TEN, TEN, |k, l| (turned[k] * turned[l]).trace()),
    })
}

/// The least of ½‖J d − r‖² + g·d + ½ dᵀ H d: the least squares of J d = r beside Lᵀ d = −L⁻¹ g, with H = L Lᵀ.
fn newton_step(slopes: &DMatrix<f64>, left: &DVector<f64>, prior: &[Divergence]) -> Option<DVector<f64>> {
    let (rows, n) = slopes.shape();
    let mut matrix = DMatrix::zeros(rows + n, n);
    let mut side = DVector::zeros(rows + n);
    matrix.view_mut((0, 0), (rows, n)).copy_from(slopes);
    side.rows_mut(0, rows).copy_from(left);
    let mut at = 0;
    for divergence in prior {
        let size = divergence.slope.len();
        let lower = divergence.curvature.clone().cholesky()?.l();
        side.rows_mut(rows + at, size).copy_from(&-lower.solve_lower_triangular(&divergence.slope)?);
        matrix.view_mut((rows + at, at), (size, size)).copy_from(&lower.transpose());
        at += size;
    }
    let qr = matrix.qr();
    qr.q_tr_mul(&mut side);
    qr.r().solve_upper_triangular(&side.rows(0, n).into_owned())
}
