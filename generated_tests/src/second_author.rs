//! What the chapter's formulation says a generated function should give, with the scale of every component.

use crate::reference::Expected;
use nalgebra::DMatrix;
use straightline_codegen::Function;
use straightline_core::reference as chapter;
use straightline_core::reference::{geometry, ExtendedPosition, MassCentreLink, MassCentreTree};
use straightline_core::Dd;

/// The value of a function, computed by the reference; scales as in [`crate::reference`].
///
/// # Panics
/// If the reference has no frame of a name asked for.
pub fn value(tree: &MassCentreTree<Dd>, frames: &[String], function: Function, inputs: &[Vec<Dd>]) -> Expected {
    use Function::*;
    let q = &inputs[0][..];
    let rest = vec![Dd::ZERO; tree.nv()];
    let arg = |i: usize| &inputs[i][..];
    let names = frames;
    let frames = || names.iter().map(|n| tree.frame(n).unwrap_or_else(|| panic!("the reference has no frame {n}")));
    let natural = |tree: &MassCentreTree<Dd>, qd: &[Dd], qdd: &[Dd]| -> Vec<f64> {
        chapter::natural_scale(tree, q, qd, qdd).iter().map(|x| x.to_f64()).collect()
    };
    let weightless = || MassCentreTree { gravity: nalgebra::zero(), ..tree.clone() };
    match function {
        InverseDynamics => Expected {
            values: list(&chapter::inverse_dynamics(tree, q, arg(1), arg(2))),
            scales: natural(tree, arg(1), arg(2)),
        },
        BiasForce => {
            Expected { values: list(&chapter::bias_force(tree, q, arg(1))), scales: natural(tree, arg(1), &rest) }
        }
        GravityForce => {
            Expected { values: list(&chapter::gravity_force(tree, q)), scales: natural(tree, &rest, &rest) }
        }
        VelocityForce => Expected {
            values: list(&chapter::velocity_force(tree, q, arg(1))),
            scales: natural(&weightless(), arg(1), &rest),
        },
        MassMatrix => {
            let h = chapter::mass_matrix(tree, q);
            let scale = |i: usize, j: usize| (h[(i, i)].to_f64() * h[(j, j)].to_f64()).sqrt();
            let scales = (0..h.nrows()).flat_map(|i| (0..h.ncols()).map(move |j| (i, j))).map(|(i, j)| scale(i, j));
            Expected { scales: scales.collect(), values: list(&h.transpose()) }
        }
        ForwardDynamics => {
            let scales = chapter::forward_natural_scale(tree, q, arg(1), arg(2)).iter().map(|x| x.to_f64()).collect();
            Expected { values: list(&chapter::forward_dynamics(tree, q, arg(1), arg(2))), scales }
        }
        JointWrenches => {
            let mut order: Vec<usize> = (0..tree.links.len()).collect();
            order.sort_by_key(|&i| tree.links[i].iv);
            let wrenches = chapter::joint_wrenches(tree, q, arg(1), arg(2));
            groups(0.0, order.into_iter().map(|i| wrenches[i].to_vec()))
        }
        Energy => {
            let (t, v) = (chapter::kinetic_energy(tree, q, arg(1)), chapter::potential_energy(tree, q));
            let norm = |v: &nalgebra::Vector3<Dd>| v.dot(v).sqrt().to_f64();
            let g = norm(&tree.gravity);
            let places = geometry(tree, q);
            let terms = places.iter().zip(&tree.links).map(|(x, l)| l.mass.to_f64() * g * norm(&x.mass_centre));
            Expected { scales: vec![t.to_f64(), terms.sum()], values: vec![t, v] }
        }
        CentreOfMass => groups(1.0, [list(&chapter::centre_of_mass(tree, q))]),
        Momentum => {
            let momentum = chapter::momentum(tree, q, arg(1));
            let places = geometry(tree, q);
            let norm = |v: &nalgebra::Vector3<Dd>| v.dot(v).sqrt().to_f64();
            // Σ m |v| and Σ (m |r| |v| + tr J |ω|): the sum is taken about a fixed point
            let (mut linear, mut angular) = (0.0, 0.0);
            for ((link, place), motion) in
                tree.links.iter().zip(&places).zip(chapter::motion(tree, &places, arg(1), &rest))
            {
                let p = link.mass.to_f64() * norm(&motion.v);
                linear += p;
                angular += norm(&place.mass_centre) * p + link.inertia.trace().to_f64() * norm(&motion.omega);
            }
            let values = [list(&momentum.linear), list(&momentum.angular_about_mass_centre)].concat();
            Expected { values, scales: [[linear; 3], [angular; 3]].concat() }
        }
        ForwardKinematics => groups(
            1.0,
            frames().flat_map(|f| {
                let pose = chapter::frame_pose(tree, f, q);
                [list(&pose.position), list(&pose.rotation.transpose())]
            }),
        ),
        FrameVelocity => groups(speed(arg(1)), frames().map(|f| list(&chapter::frame_velocity(tree, f, q, arg(1))))),
        FrameAcceleration => groups(
            speed(arg(1)).powi(2) + speed(arg(2)),
            frames().map(|f| list(&chapter::frame_acceleration(tree, f, q, arg(1), arg(2)))),
        ),
        Jacobian => groups(
            1.0,
            frames().map(|f| {
                let j = chapter::frame_jacobian(tree, f, q);
                list(&DMatrix::from_fn(j.ncols(), 6, |column, row| j[(row, column)]))
            }),
        ),
        KinematicsAndJacobian => {
            let mut both = value(tree, names, ForwardKinematics, inputs);
            let jacobian = value(tree, names, Jacobian, inputs);
            both.values.extend(jacobian.values);
            both.scales.extend(jacobian.scales);
            both
        }
        JacobianBias => {
            groups(speed(arg(1)).powi(2), frames().map(|f| list(&chapter::frame_jacobian_bias(tree, f, q, arg(1)))))
        }
        DrivenForwardDynamics
        | DrivenInverseDynamics
        | DriveTorques
        | CompleteModel
        | StateSpace
        | DrivePower
        | DriveEnergy => panic!("drives have their own test"),
    }
}

/// The same robot in f64.
pub fn rounded(tree: &MassCentreTree<Dd>) -> MassCentreTree<f64> {
    let round = |x: Dd| x.to_f64();
    let links = tree.links.iter().map(|link| MassCentreLink {
        name: link.name.clone(),
        parent: link.parent,
        joint: link.joint,
        iq: link.iq,
        iv: link.iv,
        mass: round(link.mass),
        inertia: link.inertia.map(round),
        e: link.e.map(round),
        e_parent: link.e_parent.map(round),
        r: link.r.map(round),
        r_parent: link.r_parent.map(round),
        extended: match &link.extended {
            ExtendedPosition::Matrix(m) => ExtendedPosition::Matrix(m.map(round)),
            ExtendedPosition::ByVectors { r_star, r_parent_star, alpha } => ExtendedPosition::ByVectors {
                r_star: r_star.as_ref().map(|v| v.map(round)),
                r_parent_star: r_parent_star.as_ref().map(|v| v.map(round)),
                alpha: round(*alpha),
            },
        },
    });
    MassCentreTree {
        name: tree.name.clone(),
        gravity: tree.gravity.map(round),
        links: links.collect(),
        frames: Vec::new(),
    }
}

/// Column by column.
fn list<R: nalgebra::Dim, C: nalgebra::Dim, S: nalgebra::RawStorage<Dd, R, C>>(
    matrix: &nalgebra::Matrix<Dd, R, C, S>,
) -> Vec<Dd> {
    matrix.iter().copied().collect()
}

/// Groups of components, each with its largest as the scale, and at least `least`: what levers of one metre give, so that
/// a frame on a joint axis is not judged by the zeros that it should have.
fn groups(least: f64, groups: impl IntoIterator<Item = Vec<Dd>>) -> Expected {
    let mut expected = Expected { values: vec![], scales: vec![] };
    groups.into_iter().for_each(|g| expected.append_uniform(g));
    expected.scales.iter_mut().for_each(|s| *s = s.max(least));
    expected
}

/// The sum of the moduli of velocities or accelerations.
fn speed(rates: &[Dd]) -> f64 {
    rates.iter().map(|x| x.to_f64().abs()).sum()
}
