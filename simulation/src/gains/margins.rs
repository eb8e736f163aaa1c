//! How far a sampled loop is from instability: stability itself, and margins of gain and phase at the torque of every joint, the loops of all
//! other joints closed.
//!
//! With P(z) = (z I − Φ)⁻¹ Γ z^−d and S = (I + K P)⁻¹, the loop that is cut at joint j has L_j = 1/S_jj − 1.

use nalgebra::{Complex, DMatrix};

/// A loop: x⁺ = Φ x + Γ u, u = −K x of so many periods before.
#[derive(Clone, Copy)]
pub(super) struct SampledLoop<'a> {
    pub phi: &'a DMatrix<f64>,
    pub gamma: &'a DMatrix<f64>,
    pub gains: &'a DMatrix<f64>,
    pub delay: usize,
}

/// Margins of one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// By which factors the loop's gain can fall and grow before it is unstable; 0 and infinity where it never is.
    pub gain: (f64, f64),
    /// By how much its phase can fall or grow \[rad\]; π where it can by any.
    pub phase: f64,
}

impl Margins {
    /// Of what nothing can make unstable.
    pub const INFINITE: Margins = Margins { gain: (0.0, f64::INFINITY), phase: std::f64::consts::PI };

    /// The lesser ones of two.
    pub fn worst(self, other: Margins) -> Margins {
        Margins {
            gain: (self.gain.0.max(other.gain.0), self.gain.1.min(other.gain.1)),
            phase: self.phase.min(other.phase),
        }
    }
}

/// Frequencies at which a loop is looked at, from a hundred-thousandth of the sampling frequency to half of it.
const FREQUENCIES: usize = 500;

impl SampledLoop<'_> {
    /// The greatest modulus of the closed loop's eigenvalues, by squaring: below one it is stable.
    pub fn spectral_radius(&self) -> f64 {
        let (nx, nu, d) = (self.phi.nrows(), self.gamma.ncols(), self.delay);
        let n = nx + nu * d;
        // torques wait behind the state: the oldest first
        let mut m = DMatrix::zeros(n, n);
        m.view_mut((0, 0), (nx, nx)).copy_from(self.phi);
        let asked = -self.gains;
        if d == 0 {
            let closed = self.phi + self.gamma * &asked;
            m.copy_from(&closed);
        } else {
            m.view_mut((0, nx), (nx, nu)).copy_from(self.gamma);
            for k in 1..d {
                m.view_mut((nx + nu * (k - 1), nx + nu * k), (nu, nu)).fill_with_identity();
            }
            m.view_mut((nx + nu * (d - 1), 0), (nu, nx)).copy_from(&asked);
        }
        // ‖M^(2^k)‖^(1/2^k), in logarithms
        let mut log = 0.0;
        const SQUARINGS: i32 = 16;
        for k in 0..SQUARINGS {
            let norm = m.norm();
            if norm == 0.0 {
                return 0.0;
            }
            m /= norm;
            log += norm.ln() / 2f64.powi(k);
            m = &m * &m;
        }
        (log + m.norm().max(f64::MIN_POSITIVE).ln() / 2f64.powi(SQUARINGS)).exp()
    }

    /// The loops cut at each joint, at the angle ω h up to π; `None` where the frequency is a pole.
    fn cut(&self, angle: f64) -> Option<Vec<Complex<f64>>> {
        let (nx, nu) = (self.phi.nrows(), self.gamma.ncols());
        let z = Complex::from_polar(1.0, angle);
        let complex = |m: &DMatrix<f64>| m.map(|x| Complex::new(x, 0.0));
        let resolvent = DMatrix::from_diagonal_element(nx, nx, z) - complex(self.phi);
        let plant = resolvent.lu().solve(&complex(self.gamma))?;
        let back = complex(self.gains) * plant * Complex::from_polar(1.0, -angle * self.delay as f64);
        let sensitivity = (DMatrix::identity(nu, nu) + back).try_inverse()?;
        Some((0..nu).map(|j| sensitivity[(j, j)].inv() - 1.0).collect())
    }

    /// Margins of every driven joint of a stable loop. Crossings are found between neighbouring frequencies, linearly.
    pub fn margins(&self) -> Vec<Margins> {
        let angle = |k: usize| std::f64::consts::PI * 10f64.powf(-5.0 + 5.0 * k as f64 / FREQUENCIES as f64);
        let loops: Vec<Vec<Complex<f64>>> = (0..=FREQUENCIES).filter_map(|k| self.cut(angle(k))).collect();
        let rest = self.cut(0.0);
        let of = |j: usize| {
            let mut found = Margins::INFINITE;
            for pair in loops.windows(2) {
                let (a, b) = (pair[0][j], pair[1][j]);
                // through the unit circle: how far from −1
                let (low, high) = (a.norm() - 1.0, b.norm() - 1.0);
                if low * high <= 0.0 && low != high {
                    let at = a + (b - a) * (low / (low - high));
                    found.phase = found.phase.min((-at).arg().abs());
                }
                // through the negative real axis: how many times as long as 1
                if a.im * b.im <= 0.0 && a.im != b.im {
                    let at = (a + (b - a) * (a.im / (a.im - b.im))).re;
                    if at < 0.0 {
                        let factor = -1.0 / at;
                        match factor >= 1.0 {
                            true => found.gain.1 = found.gain.1.min(factor),
                            false => found.gain.0 = found.gain.0.max(factor),
                        }
                    }
                }
            }
            // loops are real at half the sampling frequency, the last one, and at rest, where a stiffness pulls away
            if let Some(rest) = rest.as_ref().map(|all| all[j]).filter(|x| x.re < -1.0 && x.is_finite()) {
                found.gain.0 = found.gain.0.max(-1.0 / rest.re);
            }
            if let Some(last) = loops.last().map(|all| all[j]).filter(|x| x.re < 0.0 && x.re > -1.0) {
                found.gain.1 = found.gain.1.min(-1.0 / last.re);
            }
            found
        };
        (0..self.gamma.ncols()).map(of).collect()
    }
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    /// Three joints that feel each other, with friction and a stiffness that pulls away, sampled every 2 ms.
    fn joints() -> [DMatrix<f64>; 3] {
        let h = DMatrix::from_row_slice(3, 3, &[2.0, 0.5, 0.1, 0.5, 0.8, 0.15, 0.1, 0.15, 0.1]);
        let inverse = h.try_inverse().unwrap();
        let mut a = DMatrix::zeros(6, 6);
        a.view_mut((0, 3), (3, 3)).fill_with_identity();
        let stiffness = DMatrix::from_diagonal(&nalgebra::DVector::from_vec(vec![4.0, -6.0, 0.3]));
        a.view_mut((3, 0), (3, 3)).copy_from(&-(&inverse * stiffness));
        a.view_mut((3, 3), (3, 3)).copy_from(&-(&inverse * 0.05));
        let mut b = DMatrix::zeros(6, 3);
        b.view_mut((3, 0), (3, 3)).copy_from(&inverse);
        let linear = super::super::Linear { a, b, h: DMatrix::identity(3, 3), h_inverse: inverse };
        let (phi, gamma) = linear.sampled(2e-3);
        let gains = DMatrix::from_row_slice(
            3,
            6,
            &[900.0, 20.0, 0.0, 70.0, 2.0, 0.0, 10.0, 300.0, 0.0, 0.0, 25.0, 1.0, 0.0, -5.0, 40.0, 0.5, 0.0, 2.5],
        );
        [phi, gamma, gains]
    }

    /// A margin says where the closed loop of all joints becomes unstable, which its eigenvalues know by themselves.
    pub fn at_its_margin_of_gain_a_loop_of_many_joints_has_an_eigenvalue_of_one() {
        let [phi, gamma, gains] = joints();
        let mut falls = 0;
        for delay in [0, 1, 3] {
            let closed = SampledLoop { phi: &phi, gamma: &gamma, gains: &gains, delay };
            assert!(closed.spectral_radius() < 1.0, "{delay}: {}", closed.spectral_radius());
            for (j, margins) in closed.margins().into_iter().enumerate() {
                let radius = |factor: f64| {
                    let mut gains = gains.clone();
                    gains.row_mut(j).iter_mut().for_each(|k| *k *= factor);
                    SampledLoop { gains: &gains, ..closed }.spectral_radius()
                };
                let (low, high) = margins.gain;
                assert!(high > 1.05 && high < 1e3, "{delay} {j}: {high}");
                assert!(radius(0.995 * high) < 1.0 && radius(1.005 * high) > 1.0, "{delay} {j}: {high}");
                if low > 0.0 {
                    falls += 1;
                    assert!(radius(1.02 * low) < 1.0 && radius(0.98 * low) > 1.0, "{delay} {j}: {low}");
                }
            }
        }
        // the stiffness that pulls away takes a gain that holds against it
        assert!(falls > 0);
    }

    pub fn the_spectral_radius_is_the_greatest_modulus_of_the_eigenvalues() {
        let [phi, gamma, gains] = joints();
        let closed = SampledLoop { phi: &phi, gamma: &gamma, gains: &gains, delay: 0 };
        let eigenvalues = (&phi - &gamma * &gains).complex_eigenvalues();
        let greatest = eigenvalues.iter().map(|x| x.norm()).fold(0.0, f64::max);
        let found = closed.spectral_radius();
        assert!((found - greatest).abs() < 1e-2 * (1.0 - greatest), "{found} {greatest}");
    }
}
