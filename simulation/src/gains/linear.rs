//! The robot about a motion: δẋ = A δx + B δτ of the state x = (q, q̇), and what a computer sees of it once per period.

use nalgebra::DMatrix;
use straightline_core::algorithms::inverse_dynamics;
use straightline_core::model::{Coulomb, Model};
use straightline_core::Dual;

/// The robot about an instant, continuous in time.
#[derive(Clone, Debug)]
pub struct Linear {
    /// A, 2n × 2n.
    pub a: DMatrix<f64>,
    /// B, a column per joint that is driven.
    pub b: DMatrix<f64>,
    /// H \[kg·m² or kg\].
    pub h: DMatrix<f64>,
    /// H⁻¹.
    pub h_inverse: DMatrix<f64>,
}

/// The robot without dry friction: that is no slope but a jump, and its smooth form near rest would pass for damping.
pub(super) fn without_dry_friction(model: &Model<f64>) -> Model<f64> {
    let mut model = model.clone();
    model.bodies.iter_mut().for_each(|body| body.effects.coulomb = Coulomb::Off);
    model
}

impl Linear {
    /// About (q, q̇, q̈), with torques on these joints: ∂q̈/∂x = −H⁻¹ ∂τ/∂x at the q̈ of the motion, ∂q̈/∂τ = H⁻¹; derivatives of τ by dual
    /// numbers. `None` if H has no inverse.
    pub fn about(model: &Model<f64>, (q, qd, qdd): (&[f64], &[f64], &[f64]), driven: &[usize]) -> Option<Linear> {
        let n = qd.len();
        let wide = model.map(Dual::<f64, 1>::fixed);
        // columns of ∂τ/∂q, ∂τ/∂q̇ and H: the variable is entry k of these three behind each other
        let column = |k: usize| {
            let seeded = |values: &[f64], first: usize| -> Vec<Dual<f64, 1>> {
                let seed = |(i, x): (usize, &f64)| match k == first + i {
                    true => Dual::variable(*x, 0),
                    false => Dual::fixed(*x),
                };
                values.iter().enumerate().map(seed).collect()
            };
            let tau = inverse_dynamics(&wide, &seeded(q, 0), &seeded(qd, n), &seeded(qdd, 2 * n));
            tau.into_iter().map(|t| t.derivatives[0]).collect::<Vec<f64>>()
        };
        let columns: Vec<f64> = (0..3 * n).flat_map(column).collect();
        let all = DMatrix::from_column_slice(n, 3 * n, &columns);
        let h = all.columns(2 * n, n).into_owned();
        let h_inverse = h.clone().cholesky()?.inverse();
        let slopes = -(&h_inverse * all.columns(0, 2 * n));
        let mut a = DMatrix::zeros(2 * n, 2 * n);
        a.view_mut((0, n), (n, n)).fill_with_identity();
        a.view_mut((n, 0), (n, 2 * n)).copy_from(&slopes);
        let mut b = DMatrix::zeros(2 * n, driven.len());
        for (k, joint) in driven.iter().enumerate() {
            b.view_mut((n, k), (n, 1)).copy_from(&h_inverse.column(*joint));
        }
        let is_finite = a.iter().chain(b.iter()).all(|x| x.is_finite());
        is_finite.then_some(Linear { a, b, h, h_inverse })
    }

    /// From one period to the next under torques that are held meanwhile: x⁺ = Φ x + Γ τ, exact: the exponential of ((A, B), (0, 0)) h.
    pub fn sampled(&self, period: f64) -> (DMatrix<f64>, DMatrix<f64>) {
        let (nx, nu) = (self.a.nrows(), self.b.ncols());
        let mut whole = DMatrix::zeros(nx + nu, nx + nu);
        whole.view_mut((0, 0), (nx, nx)).copy_from(&(&self.a * period));
        whole.view_mut((0, nx), (nx, nu)).copy_from(&(&self.b * period));
        let whole = exponential(&whole);
        (whole.view((0, 0), (nx, nx)).into_owned(), whole.view((0, nx), (nx, nu)).into_owned())
    }
}

/// e^M by scaling and squaring: of ‖M‖ ≤ ½ the series has a remainder below 1e-19 after 14 terms.
fn exponential(m: &DMatrix<f64>) -> DMatrix<f64> {
    let norm = m.row_iter().map(|row| row.iter().map(|x| x.abs()).sum::<f64>()).fold(0.0, f64::max);
    let halvings = (norm / 0.5).log2().ceil().clamp(0.0, 1000.0) as i32;
    let scaled = m * 0.5f64.powi(halvings);
    let mut sum = DMatrix::identity(m.nrows(), m.nrows());
    let mut term = sum.clone();
    for k in 1..=14 {
        term = &term * &scaled / f64::from(k);
        sum += &term;
    }
    (0..halvings).fold(sum, |power, _| &power * &power)
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    /// Of a rotation: cosine and sine.
    pub fn the_exponential_of_a_turn_is_a_rotation() {
        for angle in [0.1f64, 3.0, 40.0] {
            let found = exponential(&DMatrix::from_row_slice(2, 2, &[0.0, -angle, angle, 0.0]));
            assert!((found[(0, 0)] - angle.cos()).abs() < 1e-13 && (found[(1, 0)] - angle.sin()).abs() < 1e-13);
        }
    }
}
