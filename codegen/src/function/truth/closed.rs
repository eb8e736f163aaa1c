//! Robots with closed loops, by the second author: all three equations of every loop in world axes, solved by least squares in double-double, and forces
//! by virtual work.
//!
//! The tree that is left where loops are cut has the independent coordinates first. Points that coincide have the same velocity and acceleration, so that
//! (J₂ − J₁) ẋ = 0 and (J₂ − J₁) ẍ + (a₂ − a₁) = 0, a the accelerations at ẍ = 0; configurations are closed ones.

use super::{list, Chapter, Truth};
use crate::function::Quantity;
use nalgebra::{DMatrix, DVector};
use straightline_core::magnitude::Magnitude;
use straightline_core::reference::{self, CentreOfMassFrame};
use straightline_core::{Dd, Real};

/// Frames of the tree whose origins coincide, and how many velocity coordinates are independent.
#[derive(Clone, Debug)]
pub struct ClosedLoops {
    /// The frames of each loop.
    pub ends: Vec<[CentreOfMassFrame<Dd>; 2]>,
    /// So many velocities stand before those that loops determine.
    pub independent: usize,
    /// So many equations programs have of them.
    pub equations: usize,
}

/// The tree of a robot with loops at a motion that keeps them closed.
pub struct ClosedMotion<'a> {
    /// The tree, moving.
    pub tree: Chapter<'a>,
    /// The same without accelerations of the independent coordinates.
    pub unaccelerated: Chapter<'a>,
    /// ∂ẋ/∂q̇.
    map: DMatrix<Magnitude>,
    /// Equations that are asked for, three or two of a loop.
    pub equations: usize,
}

impl<'a> ClosedMotion<'a> {
    pub(super) fn new(at: &Chapter<'a>, loops: &ClosedLoops) -> ClosedMotion<'a> {
        let (tree, q) = (&at.tree, at.q());
        let ends: Vec<[CentreOfMassFrame<Magnitude>; 2]> =
            loops.ends.iter().map(|ends| ends.each_ref().map(|end| end.map(Magnitude::new))).collect();
        let (n, all) = (loops.independent, tree.nv());
        let mut rows = DMatrix::from_element(3 * ends.len(), all, Magnitude::zero());
        for (k, [one, other]) in ends.iter().enumerate() {
            let [one, other] = [one, other].map(|end| reference::frame_jacobian(tree, end, q));
            rows.rows_mut(3 * k, 3).copy_from(&(other.rows(0, 3) - one.rows(0, 3)));
        }
        let closing = Closing::new(rows.columns(n, all - n).into_owned());
        let mut map = DMatrix::from_fn(all, n, |i, j| Magnitude::new(if i == j { Dd::ONE } else { Dd::ZERO }));
        for j in 0..n {
            let opposite = rows.column(j).map(|x| -x);
            map.view_mut((n, j), (all - n, 1)).copy_from(&closing.solved(&opposite));
        }
        let moved = |rates: &[Magnitude]| &map * DVector::from_column_slice(rates);
        let rates = moved(at.qd());
        let still = vec![Magnitude::zero(); all];
        let mut drift = DVector::from_element(3 * ends.len(), Magnitude::zero());
        for (k, [one, other]) in ends.iter().enumerate() {
            let [one, other] =
                [one, other].map(|end| reference::frame_acceleration(tree, end, q, rates.as_slice(), &still));
            drift.rows_mut(3 * k, 3).copy_from(&(one.rows(0, 3) - other.rows(0, 3)));
        }
        let mut bias = DVector::from_element(all, Magnitude::zero());
        bias.rows_mut(n, all - n).copy_from(&closing.solved(&drift));
        let accelerations = moved(at.qdd()) + &bias;
        let with = |accelerations: DVector<Magnitude>| {
            let mut tree = at.clone();
            tree.loops = None;
            tree.state.insert(Quantity::Velocity, list(&rates));
            tree.state.insert(Quantity::Acceleration, list(&accelerations));
            tree
        };
        ClosedMotion { tree: with(accelerations), unaccelerated: with(bias), map, equations: loops.equations }
    }

    /// Number of independent velocities.
    pub fn independent(&self) -> usize {
        self.map.ncols()
    }

    /// The rows of dependent velocities, by independent ones.
    pub fn dependent_rows(&self) -> Vec<Magnitude> {
        list(&self.map.rows(self.independent(), self.map.nrows() - self.independent()).transpose())
    }

    /// A length of the size of the robot \[m\].
    pub fn reach(&self) -> f64 {
        let of = |v: &nalgebra::Vector3<Magnitude>| v.iter().map(|x| x.size).fold(0.0, f64::max);
        self.tree.tree.links.iter().map(|link| of(&link.r).max(of(&link.r_parent))).fold(0.0, f64::max)
    }

    /// What forces of the tree do along the independent coordinates.
    pub fn forces(&self, of_tree: Option<Vec<Magnitude>>) -> Option<Vec<Magnitude>> {
        Some(list(&(self.map.transpose() * DVector::from_vec(of_tree?))))
    }

    /// A matrix by rows with a column for every velocity of the tree, by the independent ones.
    pub fn columns(&self, of_tree: Option<Vec<Magnitude>>) -> Option<Vec<Magnitude>> {
        let of_tree = of_tree?;
        let width = self.map.nrows();
        Some(list(&(DMatrix::from_row_slice(of_tree.len() / width, width, &of_tree) * &self.map).transpose()))
    }

    /// A symmetric matrix over the velocities of the tree, over the independent ones.
    pub fn square(&self, of_tree: DMatrix<Magnitude>) -> DMatrix<Magnitude> {
        self.map.transpose() * of_tree * &self.map
    }
}

/// Equations for dependent rates, more than there are rates and none against another.
struct Closing {
    rows: DMatrix<Magnitude>,
    /// (Jᵀ J)⁻¹ Jᵀ.
    inverse: DMatrix<Dd>,
}

impl Closing {
    fn new(rows: DMatrix<Magnitude>) -> Closing {
        let value = rows.map(|x| x.value);
        let normal = value.transpose() * &value;
        let mut inverse = value.transpose();
        for mut column in inverse.column_iter_mut() {
            let solved = reference::solve_symmetric(&normal, &column.clone_owned());
            column.copy_from(&solved);
        }
        Closing { rows, inverse }
    }

    /// x of J x = b. It moves by the inverse times δb − δJ x.
    fn solved(&self, b: &DVector<Magnitude>) -> DVector<Magnitude> {
        let x = &self.inverse * b.map(|x| x.value);
        let moved = |i: usize| {
            let by_rows = (0..x.len()).map(|j| self.rows[(i, j)].size * x[j].to_f64());
            by_rows.chain([b[i].size]).fold(0.0, f64::hypot)
        };
        let moved: Vec<f64> = (0..b.len()).map(moved).collect();
        let size = |i: usize| (0..b.len()).map(|k| self.inverse[(i, k)].to_f64() * moved[k]).fold(0.0, f64::hypot);
        DVector::from_fn(x.len(), |i, _| Magnitude::new(x[i]).of_size(size(i)))
    }
}

/// Truths of the tree where it moves, forces among them projected.
pub(super) fn forces<F: Truth>(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
    at.forces(F::truth(&at.tree))
}
