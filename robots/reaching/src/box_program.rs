//! min ½ uᵀ H u + gᵀ u, low ≤ u ≤ high, for seven unknowns: projected Newton steps (Bertsekas 1982; in differential dynamic programming
//! Tassa, Mansard and Todorov 2014).

use crate::{dot, Joints, Square, NV};
use straightline::Real;

/// The lower triangle L of H = L Lᵀ; rows and columns of what is held at a limit are those of the identity.
#[derive(Clone, Copy, Debug)]
pub struct Factor {
    l: Square,
    /// One over the diagonal.
    inverse: Joints,
    /// What is not held.
    pub is_free: [bool; NV],
}

impl Factor {
    /// Of the free part of a matrix; `None` if that is not positive definite.
    pub fn new(h: &Square, is_free: [bool; NV]) -> Option<Factor> {
        let (mut l, mut inverse) = ([[0.0; NV]; NV], [1.0; NV]);
        for i in 0..NV {
            for j in 0..=i {
                let (row, other) = (l[i], l[j]);
                let of = if is_free[i] && is_free[j] { h[i][j] } else { f64::from(u8::from(i == j)) };
                let rest = of - (0..j).map(|k| row[k] * other[k]).sum::<f64>();
                if i == j {
                    if rest.is_nan() || rest <= 0.0 {
                        return None;
                    }
                    l[i][i] = Real::sqrt(rest);
                    inverse[i] = 1.0 / l[i][i];
                } else {
                    l[i][j] = rest * inverse[j];
                }
            }
        }
        Some(Factor { l, inverse, is_free })
    }

    /// H⁻¹ b of what is free, zero of the others; of several right-hand sides at once, which stand in the rows of b.
    pub fn solved<const M: usize>(&self, mut b: [[f64; M]; NV]) -> [[f64; M]; NV] {
        for (row, is_free) in b.iter_mut().zip(self.is_free) {
            if !is_free {
                *row = [0.0; M];
            }
        }
        for i in 0..NV {
            for k in 0..i {
                let (l, above) = (self.l[i][k], b[k]);
                b[i].iter_mut().zip(above).for_each(|(x, y)| *x -= l * y);
            }
            b[i].iter_mut().for_each(|x| *x *= self.inverse[i]);
        }
        for i in (0..NV).rev() {
            for k in i + 1..NV {
                let (l, below) = (self.l[k][i], b[k]);
                b[i].iter_mut().zip(below).for_each(|(x, y)| *x -= l * y);
            }
            b[i].iter_mut().for_each(|x| *x *= self.inverse[i]);
        }
        b
    }
}

/// Steps at most: each changes which limits hold, or is the last one.
const STEPS: usize = 20;

/// The minimum from a start, and the factor of what is free there; `None` if H is not positive definite.
pub fn minimum(h: &Square, g: &Joints, low: &Joints, high: &Joints, start: &Joints) -> Option<(Joints, Factor)> {
    let clamped = |u: &Joints| -> Joints { core::array::from_fn(|i| u[i].max(low[i]).min(high[i])) };
    let value = |u: &Joints| dot(g, u) + 0.5 * (0..NV).map(|i| u[i] * dot(&h[i], u)).sum::<f64>();
    let mut u = clamped(start);
    let mut factor: Option<Factor> = None;
    for _ in 0..STEPS {
        let gradient: Joints = core::array::from_fn(|i| g[i] + dot(&h[i], &u));
        let is_free =
            core::array::from_fn(|i| !(u[i] <= low[i] && gradient[i] > 0.0 || u[i] >= high[i] && gradient[i] < 0.0));
        let current = match factor {
            Some(found) if found.is_free == is_free => found,
            _ => Factor::new(h, is_free)?,
        };
        factor = Some(current);
        let [step] = transposed(&current.solved(gradient.map(|x| [-x])));
        let slope = dot(&gradient, &step);
        // what is left is rounding
        let scale: f64 = (0..NV).filter(|i| is_free[*i]).map(|i| h[i][i] * u[i] * u[i]).sum();
        if -slope <= 1e-20 * scale || slope == 0.0 {
            break;
        }
        let (before, mut part) = (value(&u), 1.0);
        loop {
            let next = clamped(&core::array::from_fn(|i| u[i] + part * step[i]));
            let went: Joints = core::array::from_fn(|i| next[i] - u[i]);
            if value(&next) <= before + 0.1 * dot(&gradient, &went) || part < 1e-6 {
                u = next;
                break;
            }
            part *= 0.5;
        }
    }
    factor.map(|factor| (u, factor))
}

fn transposed(columns: &[[f64; 1]; NV]) -> [Joints; 1] {
    [columns.map(|[x]| x)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A matrix with off-diagonals of all sizes, positive definite by its diagonal.
    fn matrix() -> Square {
        core::array::from_fn(|i| {
            core::array::from_fn(|j| if i == j { 4.0 + i as f64 } else { 0.9 / (1.0 + (i as f64 - j as f64).abs()) })
        })
    }

    /// The conditions of Karush, Kuhn and Tucker: no gradient where nothing holds, and one that points outwards where a limit holds.
    #[test]
    fn at_the_minimum_the_gradient_points_out_of_the_box_or_is_zero() {
        let (h, g) = (matrix(), [3.0, -40.0, 0.5, 25.0, -1.0, 60.0, -0.1]);
        let (low, high) = ([-1.0; NV], [2.0; NV]);
        let (u, factor) = minimum(&h, &g, &low, &high, &[0.3; NV]).unwrap();
        let mut held = 0;
        for i in 0..NV {
            let gradient = g[i] + dot(&h[i], &u);
            assert!((low[i]..=high[i]).contains(&u[i]));
            match factor.is_free[i] {
                true => assert!(gradient.abs() < 1e-12, "{i}: {gradient}"),
                false => {
                    held += 1;
                    assert!(u[i] == low[i] && gradient > 0.0 || u[i] == high[i] && gradient < 0.0, "{i}: {u:?}");
                }
            }
        }
        assert_eq!(held, 3);
    }

    #[test]
    fn without_limits_it_is_the_solution_of_the_equations() {
        let (h, g) = (matrix(), [3.0, -40.0, 0.5, 25.0, -1.0, 60.0, -0.1]);
        let (u, _) = minimum(&h, &g, &[-1e9; NV], &[1e9; NV], &[0.0; NV]).unwrap();
        assert!((0..NV).all(|i| (g[i] + dot(&h[i], &u)).abs() < 1e-12));
        let mut indefinite = h;
        indefinite[3][3] = -1.0;
        assert!(minimum(&indefinite, &g, &[-1e9; NV], &[1e9; NV], &[0.0; NV]).is_none());
    }
}
