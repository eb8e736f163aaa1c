//! Regressors by the second author: a body that has a unit of one parameter is a few points with mass, some of it negative.
//!
//! Of a point P with unit mass, τ = Jᵀ (a − g), p = Jᵀ v, T = ½ v², V = −g · r, and the wrench on the support is a − g at r. With points at the origin, at ±ℓ on
//! the axes and at (±ℓ, ±ℓ) between two of them, first moments are half the difference of two points by ℓ, second moments the second differences by ℓ².

use super::super::regressors::{
    BaseParameters, BaseWrenchRegressor, EnergyRegressor, GravityRegressor, MomentumRegressor, ParameterDerivatives,
    SupportParameters, TorqueRegressor, TorqueRegressorEntries,
};
use super::forward_derivatives::MovingJoints;
use super::{Chapter, Truth};
use crate::function::by_rows;
use nalgebra::{DVector, Matrix3, Vector3};
use std::collections::BTreeMap;
use straightline_core::base_parameters::{BaseParameter, BaseParameterKind, JointParameter, PER_BODY};
use straightline_core::magnitude::Magnitude;
use straightline_core::model::{BodyId, Coulomb};
use straightline_core::reference::{self, CentreOfMassFrame};
use straightline_core::spatial::Vec3;
use straightline_core::{Dd, Real};

impl Truth for TorqueRegressor {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let force = |point: &Point, at: &Chapter<'_>| point.forces(at, &(point.acceleration(at) - at.tree.gravity));
        with_joints(at, columns(at, &at.robot?.base_parameters.of_forces, &force)?, &JointParameter::EVERY)
    }
}

impl Truth for TorqueRegressorEntries {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let (y, parameters) = (TorqueRegressor::truth(at)?, &at.robot?.base_parameters.of_forces);
        let whole = |row: &usize| at.moving.map_or(*row, |moving| moving[*row]);
        let entry = |(k, parameter): (usize, &BaseParameter)| {
            let rows = parameter.rows.iter().map(|row| y[whole(row) * parameters.len() + k]);
            rows.collect::<Vec<_>>()
        };
        Some(parameters.iter().enumerate().flat_map(entry).collect())
    }
}

impl Truth for GravityRegressor {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let weight = |point: &Point, at: &Chapter<'_>| point.forces(at, &-at.tree.gravity);
        with_joints(at, columns(at, &at.robot?.base_parameters.of_forces, &weight)?, &[])
    }
}

impl Truth for MomentumRegressor {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let momentum = |point: &Point, at: &Chapter<'_>| point.forces(at, &point.velocity(at));
        // rotors turn with q̇ in place of q̈
        let mut moved = at.clone();
        moved.state.insert(super::Quantity::Acceleration, at.qd().to_vec());
        let columns = columns(at, &at.robot?.base_parameters.of_forces, &momentum)?;
        with_joints(&moved, columns, &[JointParameter::RotorInertia])
    }
}

impl Truth for EnergyRegressor {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let half = Magnitude::constant(Dd::HALF);
        let energies = |point: &Point, at: &Chapter<'_>| {
            let v = point.velocity(at);
            vec![v.dot(&v) * half, -at.tree.gravity.dot(&point.position(at))]
        };
        let robot = at.robot?;
        let mut columns = columns(at, &robot.base_parameters.of_forces, &energies)?;
        for (column, parameter) in columns.iter_mut().zip(&robot.base_parameters.of_forces) {
            let BaseParameterKind::Joint(kind) = parameter.kind else { continue };
            let [q, qd, _] = joint_motion(at, parameter.body)?;
            let rest = Magnitude::new(robot.bodies[parameter.body].effects.spring_rest);
            let zero = Magnitude::zero();
            *column = match kind {
                JointParameter::RotorInertia => vec![qd * qd * half, zero],
                JointParameter::Stiffness => vec![zero, (q - rest) * (q - rest) * half],
                JointParameter::Damping | JointParameter::Coulomb | JointParameter::Offset => vec![zero, zero],
            };
        }
        Some(by_rows(&columns))
    }
}

impl Truth for BaseWrenchRegressor {
    /// On the world, or of a free root about its own point in its own axes.
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let robot = at.robot?;
        let base = robot.bodies.iter().position(|body| body.joint.kind.is_base());
        let root = match base {
            Some(base) => {
                let frame = at.tree.frame(&robot.bodies[base].name)?;
                Some(reference::frame_pose(&at.tree, frame, at.q()))
            }
            None => None,
        };
        let wrench = |point: &Point, at: &Chapter<'_>| {
            let (force, lever) = (point.acceleration(at) - at.tree.gravity, point.position(at));
            let (force, moment) = match &root {
                None => (force, lever.cross(&force)),
                Some(root) => {
                    let moment = (lever - root.position).cross(&force);
                    (root.rotation.transpose() * force, root.rotation.transpose() * moment)
                }
            };
            force.iter().chain(moment.iter()).copied().collect()
        };
        Some(by_rows(&columns(at, &robot.base_parameters.of_support, &wrench)?))
    }
}

impl Truth for BaseParameters {
    /// The chapter has no such parameters: that Y β are the forces of the links with those parameters is asked by tests.
    fn truth(_: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        None
    }
}

impl Truth for SupportParameters {
    fn truth(_: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        None
    }
}

impl Truth for ParameterDerivatives {
    /// Of the joints that move.
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let force = |point: &Point, at: &Chapter<'_>| point.forces(at, &(point.acceleration(at) - at.tree.gravity));
        let columns = columns(at, &at.robot?.base_parameters.of_scene, &force)?;
        let system = MovingJoints::new(at);
        let own = |column: &Vec<Magnitude>| system.of_moving(column);
        let solved = |column: &Vec<Magnitude>| {
            let right: Vec<Magnitude> = column.iter().map(|x| -*x).collect();
            system.of_moving(&system.solved(&right))
        };
        let [by_force, by_motion] =
            [columns.iter().map(own).collect::<Vec<_>>(), columns.iter().map(solved).collect::<Vec<_>>()];
        Some([by_rows(&by_force), by_rows(&by_motion)].concat())
    }
}

/// A point of a link, as a frame.
struct Point(CentreOfMassFrame<Magnitude>);

impl Point {
    fn position(&self, at: &Chapter<'_>) -> Vector3<Magnitude> {
        reference::frame_pose(&at.tree, &self.0, at.q()).position
    }

    fn velocity(&self, at: &Chapter<'_>) -> Vector3<Magnitude> {
        reference::frame_velocity(&at.tree, &self.0, at.q(), at.qd()).fixed_rows::<3>(0).into_owned()
    }

    fn acceleration(&self, at: &Chapter<'_>) -> Vector3<Magnitude> {
        reference::frame_acceleration(&at.tree, &self.0, at.q(), at.qd(), at.qdd()).fixed_rows::<3>(0).into_owned()
    }

    /// Jᵀ of this force on it.
    fn forces(&self, at: &Chapter<'_>, force: &Vector3<Magnitude>) -> Vec<Magnitude> {
        let jacobian = reference::frame_jacobian(&at.tree, &self.0, at.q());
        let forces: DVector<Magnitude> = jacobian.fixed_rows::<3>(0).transpose() * force;
        forces.iter().copied().collect()
    }
}

/// What a point of unit mass gives, entry by entry.
type OfPoint<'a> = &'a dyn Fn(&Point, &Chapter<'_>) -> Vec<Magnitude>;

/// A column per parameter; those of joints are empty.
fn columns(at: &Chapter<'_>, parameters: &[BaseParameter], of_point: OfPoint<'_>) -> Option<Vec<Vec<Magnitude>>> {
    let mut known: BTreeMap<BodyId, Vec<Vec<Magnitude>>> = BTreeMap::new();
    let mut columns = Vec::new();
    for parameter in parameters {
        let BaseParameterKind::Inertia { unit, .. } = &parameter.kind else {
            columns.push(Vec::new());
            continue;
        };
        if let std::collections::btree_map::Entry::Vacant(entry) = known.entry(parameter.body) {
            entry.insert(of_body(at, parameter.body, of_point)?);
        }
        let units = unit.to_array().map(Magnitude::new);
        let all = units.iter().zip(&known[&parameter.body]).filter(|(unit, _)| unit.value != Dd::ZERO);
        let sum = all.fold(None, |sum: Option<Vec<Magnitude>>, (unit, column)| {
            let scaled = column.iter().map(|x| *x * *unit);
            Some(match sum {
                None => scaled.collect(),
                Some(sum) => sum.into_iter().zip(scaled).map(|(a, b)| a + b).collect(),
            })
        });
        columns.push(sum?);
    }
    Some(columns)
}

/// A column per unit of the ten parameters of a body, about the origin and in the axes of its canonical frame.
fn of_body(at: &Chapter<'_>, body: BodyId, of_point: OfPoint<'_>) -> Option<Vec<Vec<Magnitude>>> {
    let model = at.robot?;
    let body = &model.bodies[body];
    let frame = at.tree.frame(&body.name)?;
    let to_link = body.link_frame.inverse();
    let rotation = Matrix3::from_fn(|i, j| Magnitude::new(to_link.rotation.rows[i][j]));
    let vector = |v: Vec3<Dd>| Vector3::from(v.to_array().map(Magnitude::new));
    let at_point = |x: [f64; 3]| {
        let own = rotation * vector(Vec3::from(x.map(Dd::from))) + vector(to_link.translation);
        let position = frame.position + frame.rotation * own;
        of_point(&Point(CentreOfMassFrame { position, ..frame.clone() }), at)
    };
    let sum = |terms: &[(f64, &Vec<Magnitude>)]| -> Vec<Magnitude> {
        (0..terms[0].1.len())
            .map(|k| {
                let mut all = terms.iter().map(|(weight, x)| Magnitude::constant(Dd::from(*weight)) * x[k]);
                let first = all.next().expect("there are terms");
                all.fold(first, |sum, x| sum + x)
            })
            .collect()
    };
    let axis = |k: usize, sign: f64| core::array::from_fn(|i| if i == k { sign } else { 0.0 });
    let origin = at_point([0.0; 3]);
    let ends: Vec<[Vec<Magnitude>; 2]> = (0..3).map(|k| [1.0, -1.0].map(|sign| at_point(axis(k, sign)))).collect();
    let mut units = vec![origin.clone()];
    units.extend(ends.iter().map(|[plus, minus]| sum(&[(0.5, plus), (-0.5, minus)])));
    for (i, j) in (0..3).flat_map(|i| (i..3).map(move |j| (i, j))) {
        if i == j {
            units.push(sum(&[(0.5, &ends[i][0]), (0.5, &ends[i][1]), (-1.0, &origin)]));
            continue;
        }
        let corner = |a: f64, b: f64| {
            let (along, across): ([f64; 3], [f64; 3]) = (axis(i, a), axis(j, b));
            at_point(core::array::from_fn(|k| along[k] + across[k]))
        };
        let [pp, mm, pm, mp] = [corner(1.0, 1.0), corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0)];
        units.push(sum(&[(0.25, &pp), (0.25, &mm), (-0.25, &pm), (-0.25, &mp)]));
    }
    assert_eq!(units.len(), PER_BODY);
    Some(units)
}

/// q, q̇ and q̈ of a joint of one coordinate.
fn joint_motion(at: &Chapter<'_>, body: BodyId) -> Option<[Magnitude; 3]> {
    let link = at.tree.frame(&at.robot?.bodies[body].name)?.link?;
    let link = &at.tree.links[link];
    let [q, qd, qdd] = [at.q()[link.iq], at.qd()[link.iv], at.qdd()[link.iv]];
    Some(
        link.shared
            .map_or([q, qd, qdd], |shared| [shared.ratio * q + shared.offset, shared.ratio * qd, shared.ratio * qdd]),
    )
}

/// By rows, with what joints of these kinds add.
fn with_joints(at: &Chapter<'_>, mut columns: Vec<Vec<Magnitude>>, kinds: &[JointParameter]) -> Option<Vec<Magnitude>> {
    let robot = at.robot?;
    for (column, parameter) in columns.iter_mut().zip(&robot.base_parameters.of_forces) {
        let BaseParameterKind::Joint(kind) = parameter.kind else { continue };
        *column = vec![Magnitude::zero(); at.qd().len()];
        let body = &robot.bodies[parameter.body];
        let link = at.tree.frame(&body.name)?.link?;
        let [q, qd, qdd] = joint_motion(at, parameter.body)?;
        let force = match (kind, body.effects.coulomb) {
            (JointParameter::RotorInertia, _) => qdd,
            (JointParameter::Damping, _) => qd,
            (JointParameter::Coulomb, Coulomb::Smooth { speed, .. }) => {
                let speed = Magnitude::new(speed);
                qd / Real::sqrt(qd * qd + speed * speed)
            }
            (JointParameter::Coulomb, _) => qd.sign(),
            (JointParameter::Offset, _) => Magnitude::constant(Dd::ONE),
            (JointParameter::Stiffness, _) => q - Magnitude::new(body.effects.spring_rest),
        };
        if kinds.contains(&kind) {
            let link = &at.tree.links[link];
            column[link.iv] = link.shared.map_or(force, |shared| shared.ratio * force);
        }
    }
    Some(by_rows(&columns))
}
