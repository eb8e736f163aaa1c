//! Derivatives of gravity and bias forces and the Coriolis matrix, by the second author in dual numbers.

use super::super::bias_derivatives::{BiasDerivatives, CoriolisMatrix, CoriolisTransposeForce, GravityDerivative};
use super::super::dynamics::{BiasForce, GravityForce, VelocityForce};
use super::derivatives::{moving, slopes, unit};
use super::{list, Chapter, Truth};
use crate::function::by_rows;
use nalgebra::{DMatrix, DVector, Matrix3};
use straightline_core::magnitude::Magnitude;
use straightline_core::reference::{self, CentreOfMassFrame};
use straightline_core::{Dd, Dual, Real};

impl Truth for GravityDerivative {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let nv = at.qd().len();
        let tree = at.tree.map(Dual::<Magnitude, 1>::fixed);
        let column = |k: usize| {
            let [q, ..] = moving(at, &at.tree, [at.q(), at.qd(), at.qdd()], &unit(nv, 0, k));
            let forces = at.along_independent(&tree, &q, reference::gravity_force(&tree, &q));
            list(&forces.map(|force| force.derivatives[0]))
        };
        let columns: Vec<_> = (0..nv).map(column).collect();
        let (mut slopes, forces) = (by_rows(&columns), GravityForce::truth_of(at)?);
        // a force that does not depend on a coordinate, but goes through turns by it, has the rounding of the force
        for (row, force) in slopes.chunks_mut(nv).zip(&forces) {
            row.iter_mut().filter(|x| x.size == 0.0).for_each(|x| *x = x.of_size(force.size));
        }
        Some([slopes, forces].concat())
    }
}

impl Truth for BiasDerivatives {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let nv = at.qd().len();
        let held = vec![Magnitude::zero(); nv];
        let block = |block: usize| {
            let column = |k| slopes(at, &at.tree, [at.q(), at.qd(), &held], &unit(nv, block, k));
            by_rows(&(0..nv).map(column).collect::<Vec<_>>())
        };
        Some([block(0), block(1), BiasForce::truth_of(at)?].concat())
    }
}

impl Truth for CoriolisMatrix {
    /// C of the definition: of each link ∫ y_i · ẏ_j dm, y by the Jacobian of its centre of mass and their rates in dual numbers.
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let nv = at.qd().len();
        let mut c = DMatrix::from_element(nv, nv, Magnitude::zero());
        let (tree, [q, _]) = at.along_motion();
        for (k, link) in at.tree.links.iter().enumerate() {
            let centre = CentreOfMassFrame {
                name: String::new(),
                link: Some(k),
                position: nalgebra::Vector3::from_element(Dual::fixed(Magnitude::zero())),
                rotation: Matrix3::identity(),
            };
            let jacobian = at.jacobian_on(&tree, &centre, &q);
            let [now, rate] = [jacobian.map(|x| x.value), jacobian.map(|x| x.derivatives[0])]
                .map(|j| (j.rows(0, 3).into_owned(), j.rows(3, 3).into_owned()));
            let rotation = reference::frame_pose(&tree, &centre, &q).rotation.map(|x| x.value);
            let theta = rotation * link.inertia * rotation.transpose();
            let half = Magnitude::new(Dd::HALF);
            let second_moment = Matrix3::identity() * (theta.trace() * half) - theta;
            let omega = &now.1 * DVector::from_column_slice(at.qd());
            // of points that turn with the link: ∫ (r·ṙ − ṙ rᵀ) dm, the first of which is none
            let omega = nalgebra::Vector3::new(omega[0], omega[1], omega[2]);
            let turning = -(reference::skew(&omega) * second_moment);
            let own =
                now.0.transpose() * &rate.0 * link.mass + now.1.transpose() * (theta * &rate.1 + turning * &now.1);
            c += own;
        }
        // rotors of dependent joints, whose speeds are not in proportion to one coordinate
        if let Some(loops) = at.loops {
            let map = loops.map_at(&tree, &q);
            let [now, rate] = [map.map(|x| x.value), map.map(|x| x.derivatives[0])];
            for effect in at.effects {
                c += now.row(effect.iv).transpose() * rate.row(effect.iv) * Magnitude::new(effect.inertia);
            }
        }
        let h_dot = mass_matrix_rate(at);
        Some([list(&c.transpose()), list(&h_dot)].concat())
    }
}

impl Truth for CoriolisTransposeForce {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let qd = DVector::from_column_slice(at.qd());
        Some(list(&(mass_matrix_rate(at) * qd - DVector::from_vec(VelocityForce::truth_of(at)?))))
    }
}

fn mass_matrix_rate(at: &Chapter<'_>) -> DMatrix<Magnitude> {
    let (tree, [q, _]) = at.along_motion();
    // rotors move with dependent joints, too
    let mut of_tree = reference::mass_matrix(&tree, &q);
    for effect in at.effects.iter().filter(|_| at.loops.is_some()) {
        of_tree[(effect.iv, effect.iv)] += Dual::constant(effect.inertia);
    }
    at.over_independent(&tree, &q, of_tree).map(|x| x.derivatives[0])
}
