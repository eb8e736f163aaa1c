//! Forces and motion, by the second author.

use super::super::dynamics::{
    BiasForce, ForwardDynamics, GravityForce, InverseDynamics, JointWrenches, MassMatrix, MassMatrixAndGravityForce,
    VelocityForce,
};
use super::super::Quantity;
use super::closed::forces;
use super::{list, solved, Chapter, ClosedMotion, Truth};
use nalgebra::{DMatrix, DVector};
use straightline_core::magnitude::Magnitude;
use straightline_core::reference;

impl Truth for InverseDynamics {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let mut forces = at.with_passive(reference::inverse_dynamics(&at.tree, at.q(), at.qd(), at.qdd()));
        for effect in at.effects {
            forces[effect.iv] += Magnitude::new(effect.inertia) * at.qdd()[effect.iv];
        }
        Some(list(&forces))
    }

    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        forces::<Self>(at)
    }
}

impl Truth for GravityForce {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        Some(list(&reference::gravity_force(&at.tree, at.q())))
    }

    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        forces::<Self>(at)
    }
}

impl Truth for BiasForce {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        Some(list(&at.with_passive(reference::bias_force(&at.tree, at.q(), at.qd()))))
    }

    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        at.forces(InverseDynamics::truth(&at.unaccelerated))
    }
}

impl Truth for VelocityForce {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        Some(list(&reference::velocity_force(&at.tree, at.q(), at.qd())))
    }

    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        // C ẋ + H γ
        let of_tree = DVector::from_vec(Self::truth(&at.tree)?);
        let bias = DVector::from_column_slice(at.unaccelerated.qdd());
        at.forces(Some(list(&(of_tree + of_tree_inertia(&at.tree) * bias))))
    }
}

impl Truth for MassMatrix {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        Some(list(&at.with_rotors(reference::mass_matrix(&at.tree, at.q())).transpose()))
    }

    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        Some(list(&at.square(of_tree_inertia(&at.tree)).transpose()))
    }
}

impl Truth for MassMatrixAndGravityForce {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        Some([MassMatrix::truth(at)?, GravityForce::truth(at)?].concat())
    }

    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        Some([MassMatrix::truth_on_loops(at)?, GravityForce::truth_on_loops(at)?].concat())
    }
}

impl Truth for ForwardDynamics {
    /// Of the joints that move.
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let h = at.with_rotors(reference::mass_matrix(&at.tree, at.q()));
        let bias = at.with_passive(reference::bias_force(&at.tree, at.q(), at.qd()));
        let net = DVector::from_column_slice(at.get(Quantity::Force)) - bias;
        let all: Vec<usize> = (0..net.len()).collect();
        let moving = at.moving.unwrap_or(&all);
        let (h, net) = (h.select_rows(moving).select_columns(moving), net.select_rows(moving));
        Some(list(&solved(&h, &net, reference::solve_symmetric)))
    }

    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        let h = at.square(of_tree_inertia(&at.tree));
        let bias = DVector::from_vec(BiasForce::truth_on_loops(at)?);
        let net = DVector::from_column_slice(at.tree.get(Quantity::Force)) - bias;
        Some(list(&solved(&h, &net, reference::solve_symmetric)))
    }
}

impl Truth for JointWrenches {
    /// In the order of the velocity coordinates.
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let wrenches = reference::joint_wrenches(&at.tree, at.q(), at.qd(), at.qdd());
        let order = at.tree.by_coordinates();
        Some(order.into_iter().flat_map(|link| wrenches[link]).collect())
    }
}

/// H of the tree, rotors included.
fn of_tree_inertia(tree: &Chapter<'_>) -> DMatrix<Magnitude> {
    tree.with_rotors(reference::mass_matrix(&tree.tree, tree.q()))
}
