//! Regressors: what forces, momenta, energies and the wrench on the support are per unit of each of the robot's base parameters.
//!
//! All of them are linear in mass, first and second moment of the bodies about any origin. Of a body that has a unit of one base parameter
//! ([`BaseParameter`]) and nothing else, the wrench about its origin is vee(U Σ − (U Σ)ᵀ) + m c × a and m a + U m c, as in `rnea.rs`; it travels inwards, and each
//! joint on the way feels its component. What joints add themselves stands on their own coordinate.
//!
//! Matrices are by rows, with a column per base parameter.

use super::rnea::motions;
use crate::base_parameters::{BaseParameter, BaseParameterKind, JointParameter, PER_BODY};
use crate::dd::Dd;
use crate::model::{Body, BodyId, Load, Model};
use crate::real::Real;
use crate::spatial::{ForceVector, MotionVector, Transform, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// Y with Y β = tau of the motion: `nv` rows \[N·m or N per unit of each base parameter\].
#[doc(alias("computeJointTorqueRegressor", "identification"))]
pub fn torque_regressor<T: Real>(model: &Model<T>, motion: [&[T]; 3]) -> Vec<T> {
    let mut y = inertial_regressor(model, &model.base_parameters.of_forces, motion, model.gravity);
    put_joint_columns(model, motion, &JointParameter::EVERY, &mut y);
    y
}

/// Y with Y β = g(q), the gravity forces of the bodies.
pub fn gravity_regressor<T: Real>(model: &Model<T>, q: &[T]) -> Vec<T> {
    let rest = vec![T::zero(); model.nv()];
    inertial_regressor(model, &model.base_parameters.of_forces, [q, &rest, &rest], model.gravity)
}

/// Y with Y β = p = H(q) q̇, the generalized momentum \[kg·m²/s or kg·m/s per unit\], rotors included: the forces that accelerate the robot from rest to these
/// velocities in a unit of time.
pub fn momentum_regressor<T: Real>(model: &Model<T>, q: &[T], qd: &[T]) -> Vec<T> {
    let rest = vec![T::zero(); model.nv()];
    let mut y = inertial_regressor(model, &model.base_parameters.of_forces, [q, &rest, qd], Vec3::zero());
    put_joint_columns(model, [q, &rest, qd], &[JointParameter::RotorInertia], &mut y);
    y
}

/// The columns of what joints add on their own coordinates, of these kinds.
pub fn put_joint_columns<T: Real>(model: &Model<T>, [q, qd, qdd]: [&[T]; 3], kinds: &[JointParameter], y: &mut [T]) {
    let columns = &model.base_parameters.of_forces;
    let [q, qd, qdd] = &model.tree_motion([q, qd, qdd]);
    for (k, parameter) in columns.iter().enumerate() {
        let BaseParameterKind::Joint(kind) = parameter.kind else { continue };
        let Body { joint, effects, .. } = &model.bodies[parameter.body];
        if kinds.contains(&kind) {
            let force = kind.force(effects, [q[joint.iq], qd[joint.iv], qdd[joint.iv]]);
            let (row, ratio) = model.moved_by(parameter.body);
            y[row * columns.len() + k] = ratio.map_or(force, |ratio| ratio * force);
        }
    }
}

/// The columns of these parameters of bodies under this gravity; those of joints are zero.
pub fn inertial_regressor<T: Real>(
    model: &Model<T>,
    columns: &[BaseParameter],
    motion: [&[T]; 3],
    gravity: Vec3<T>,
) -> Vec<T> {
    let [q, qd, qdd] = &model.tree_motion(motion);
    let (motion, columns): ([&[T]; 3], _) = ([q, qd, qdd], &*model.of_tree(columns));
    let (poses, motions) = motions(model, motion, gravity);
    let mut y = vec![T::zero(); model.tree_nv() * columns.len()];
    for (k, parameter, unit) in units::<T>(columns) {
        T::section("regressor", Some(parameter.body));
        let mut wrench = motions[parameter.body].wrench_of(&unit);
        for b in path(model, parameter.body) {
            let (joint, mechanics) = (&model.bodies[b].joint, model.bodies[b].joint.kind.mechanics());
            for row in (0..joint.kind.nv()).filter(|row| parameter.rows.contains(&(joint.iv + row))) {
                y[(joint.iv + row) * columns.len() + k] = mechanics.along(row, joint.coordinates(motion[0]), &wrench);
            }
            wrench = poses[b].wrench_to_parent(&wrench);
        }
    }
    model.free_rows(motion[0], y, columns.len())
}

/// Y with Y β = the wrench on the robot's support, force \[N\] and moment \[N·m\] about the world's origin in its axes, that the moving bodies take; of a
/// floating base the wrench that moves it, about the root link's origin in its axes. Six rows.
pub fn base_wrench_regressor<T: Real>(model: &Model<T>, motion: [&[T]; 3]) -> Vec<T> {
    let columns = &model.base_parameters.of_support;
    let wrenches = support_wrenches(model, motion, columns);
    let mut y = vec![T::zero(); 6 * columns.len()];
    for (k, (parameter, wrench)) in columns.iter().zip(wrenches).enumerate() {
        let entries = wrench.force.to_array().into_iter().chain(wrench.moment.to_array()).enumerate();
        entries.filter(|(row, _)| parameter.rows.contains(row)).for_each(|(row, x)| y[row * columns.len() + k] = x);
    }
    y
}

/// The wrench on the support that units of these parameters take.
pub fn support_wrenches<T: Real>(
    model: &Model<T>,
    motion: [&[T]; 3],
    columns: &[BaseParameter],
) -> Vec<ForceVector<T>> {
    let [q, qd, qdd] = &model.tree_motion(motion);
    let (poses, motions) = motions(model, [q, qd, qdd], model.gravity);
    let of = |(_, parameter, unit): (usize, &BaseParameter, Load<T>)| {
        T::section("regressor", Some(parameter.body));
        let mut wrench = motions[parameter.body].wrench_of(&unit);
        for b in path(model, parameter.body).filter(|b| !model.bodies[*b].joint.kind.is_base()) {
            wrench = poses[b].wrench_to_parent(&wrench);
        }
        wrench
    };
    units(columns).map(of).collect()
}

/// Two rows, Y with Y β = T and Y β = V but for a constant, kinetic and potential energy \[J\] of bodies, rotors and springs: what a parameter that has no
/// effect on forces adds to V stays the same. The rate of T + V is the power of the joints, friction and constant forces left out.
pub fn energy_regressor<T: Real>(model: &Model<T>, q: &[T], qd: &[T]) -> Vec<T> {
    let columns = &model.base_parameters.of_forces;
    let energies = unit_energies(model, q, qd, false);
    let half = T::constant(Dd::HALF);
    let q = &*model.tree_positions(q);
    let qd = &*model.tree_rates(q, qd);
    let mut y = vec![T::zero(); 2 * columns.len()];
    for (k, parameter, unit) in units::<T>(columns) {
        let own = unit.to_array().into_iter().zip(energies[parameter.body]);
        let both = own.fold([T::zero(); 2], |sum, (x, energy)| [0, 1].map(|row| sum[row] + x * energy[row]));
        (y[k], y[columns.len() + k]) = (both[0], both[1]);
    }
    for (k, parameter) in columns.iter().enumerate() {
        let BaseParameterKind::Joint(kind) = parameter.kind else { continue };
        let Body { joint, effects, .. } = &model.bodies[parameter.body];
        let twice = kind.twice_energy(effects, [q[joint.iq], qd[joint.iv]]).filter(|_| kind != JointParameter::Offset);
        let row = usize::from(kind != JointParameter::RotorInertia);
        y[row * columns.len() + k] = twice.map_or(T::zero(), |twice| twice * half);
    }
    y
}

/// Kinetic and potential energy per unit of the ten inertial parameters of each body, about the origin and in the axes of its canonical frame; `welded`: as if its
/// own joint rested where its coordinates are neutral.
///
/// T = ½ m v² + (v × ω) · m c + ½ ∫ (ω × r)² dm,  V = −g · (m p + R m c).
pub fn unit_energies<T: Real>(model: &Model<T>, q: &[T], qd: &[T], welded: bool) -> Vec<[[T; 2]; PER_BODY]> {
    let (half, zero) = (T::constant(Dd::HALF), T::zero());
    let q = &*model.tree_positions(q);
    let placed = placed_motions(model, q, &model.tree_rates(q, qd), welded);
    let of = |PlacedMotion { pose, twist }: &PlacedMotion<T>| {
        let g = pose.rotation.transpose_mul(model.gravity);
        let (v, w) = (twist.linear, twist.angular);
        let mixed = v.cross(w);
        let [xx, yy, zz] = [w.x * w.x, w.y * w.y, w.z * w.z];
        [
            [v.dot(v) * half, -model.gravity.dot(pose.translation)],
            [mixed.x, -g.x],
            [mixed.y, -g.y],
            [mixed.z, -g.z],
            [(yy + zz) * half, zero],
            [-(w.x * w.y), zero],
            [-(w.x * w.z), zero],
            [(xx + zz) * half, zero],
            [-(w.y * w.z), zero],
            [(xx + yy) * half, zero],
        ]
    };
    placed.iter().map(of).collect()
}

/// Where a body is in the world, and how it moves there, in its own axes.
struct PlacedMotion<T> {
    pose: Transform<T>,
    twist: MotionVector<T>,
}

fn placed_motions<T: Real>(model: &Model<T>, q: &[T], qd: &[T], welded: bool) -> Vec<PlacedMotion<T>> {
    let mut all: Vec<PlacedMotion<T>> = Vec::new();
    let world = PlacedMotion {
        pose: Transform::identity(),
        twist: MotionVector { angular: Vec3::zero(), linear: Vec3::zero() },
    };
    let mut found = Vec::new();
    for (i, body) in model.bodies.iter().enumerate() {
        T::section("energy", Some(i));
        let parent = body.parent.map_or(&world, |p| &all[p]);
        let (joint, mechanics) = (&body.joint, body.joint.kind.mechanics());
        let moved = |q: &[T], qd: &[T]| {
            let pose = mechanics.pose(i, &body.placement, body.dense, q);
            let within = body.placement.compose(&mechanics.motion(q));
            let twist = mechanics.add_all(pose.motion_to_child(&parent.twist), q, qd);
            PlacedMotion { pose: parent.pose.compose(&within), twist }
        };
        let moving = moved(joint.coordinates(q), joint.rates(qd));
        if welded {
            let neutral: Vec<T> = joint.kind.row().neutral.iter().map(|x| T::constant(Dd::from(*x))).collect();
            found.push(moved(&neutral, &vec![T::zero(); joint.kind.nv()]));
        }
        all.push(moving);
    }
    match welded {
        true => found,
        false => all,
    }
}

/// The parameters of bodies among these, with their places and a body that has a unit of them.
fn units<T: Real>(columns: &[BaseParameter]) -> impl Iterator<Item = (usize, &BaseParameter, Load<T>)> {
    columns.iter().enumerate().filter_map(|(k, parameter)| match &parameter.kind {
        BaseParameterKind::Inertia { unit, .. } => Some((k, parameter, unit.map(T::constant))),
        BaseParameterKind::Joint(_) => None,
    })
}

/// A body and those that carry it, the nearest first.
fn path<T>(model: &Model<T>, body: BodyId) -> impl Iterator<Item = BodyId> + '_ {
    core::iter::successors(Some(body), |b| model.bodies[*b].parent)
}
