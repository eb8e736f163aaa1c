//! The motion of the robot as a whole as a linear map of velocities: Jacobian of the centre of mass, centroidal momentum map A with h = A q̇ (Orin and
//! Goswami 2008), its rate and the derivatives of h.
//!
//! With y_j the velocity of a point per unit of velocity coordinate j, and r, c from one origin to points and to the centre of mass,
//!
//! ```text
//! A_j  = ( ∫ y_j dm,  ∫ (r − c) × y_j dm )
//! Ȧ_j  = ( ∫ ẏ_j dm,  ∫ (r − c) × ẏ_j + (ṙ − ċ) × y_j dm )
//! ∂h/∂q_j = ( ∫ ẏ_j dm,  ∫ (r − c) × ẏ_j − (ṙ − ċ) × y_j dm )        for a joint of one coordinate, as ∂ṙ/∂q_j = ẏ_j
//! ∂h/∂q_j = ( w × h_v,  w × h_ω )                                    for a coordinate of a floating base that turns the whole robot at w
//! ```
//!
//! An increment of a ball joint in the body's axes does not commute with its own rates: with [q̇, e_j] = Σ c_i e_i, ∂ṙ/∂q_j = ẏ_j − Σ c_i y_i, so that
//! Σ c_i A_i leaves ∂h/∂q_j, and Σ c_i ∂h/∂q_i the rate of ∂h/∂q_j.
//!
//! over the bodies behind joint j. Positions and velocities are those against the first root's joint: where the robot stands in the world and how fast
//! it moves as a whole is never added.

use super::coriolis::CoriolisSweep;
use super::crba::composites;
use super::frame_derivatives::set;
use super::kinematics::{world_poses, WorldPose};
use super::momentum::{first_moments_in_world, from_anchor, momentum};
use crate::dual::Dual;
use crate::joint::JointPose;
use crate::model::Model;
use crate::real::Real;
use crate::spatial::{MotionVector, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// ∂(centre of mass)/∂q = ∂(its velocity)/∂q̇, 3 × nv, row-major, in world axes, \[m/rad, m/m\]; of a floating base by its velocities in its own axes.
#[doc(alias("jacobianCenterOfMass", "COM Jacobian"))]
pub fn centre_of_mass_jacobian<T: Real>(model: &Model<T>, q: &[T]) -> Vec<T> {
    let (q, nv) = (&*model.tree_positions(q), model.tree_nv());
    let poses = JointPose::all(&model.bodies, q);
    let (composites, world) = (composites(model, &poses), world_poses(model, q));
    let (mass, _) = first_moments_in_world(model, &poses);
    let per_mass = T::one() / mass;
    let mut rows = vec![T::zero(); 3 * nv];
    for (b, body) in model.bodies.iter().enumerate() {
        T::section("centre of mass", Some(b));
        let joint = &body.joint;
        for k in 0..joint.kind.nv() {
            let twist = joint.kind.mechanics().column(k, joint.coordinates(q));
            let column = world[b].rotation * composites[b].wrench_of(&twist).force.scale(per_mass);
            column.to_array().into_iter().enumerate().for_each(|(row, x)| rows[row * nv + joint.iv + k] = x);
        }
    }
    model.free_columns(q, rows)
}

/// A with h = A q̇, 6 × nv, row-major: rows 0-2 linear momentum \[kg·m/s\], 3-5 angular momentum about the centre of mass \[kg·m²/s\], world axes.
#[doc(alias("computeCentroidalMap", "ccrba", "CMM"))]
pub fn centroidal_map<T: Real>(model: &Model<T>, q: &[T]) -> Vec<T> {
    let (q, nv) = (&*model.tree_positions(q), model.tree_nv());
    let poses = JointPose::all(&model.bodies, q);
    let (composites, world) = (composites(model, &poses), world_poses(model, q));
    let levers = levers_from_centre(model, &poses, &world);
    let mut rows = vec![T::zero(); 6 * nv];
    for (b, body) in model.bodies.iter().enumerate() {
        T::section("centroidal map", Some(b));
        let joint = &body.joint;
        for k in 0..joint.kind.nv() {
            let wrench = composites[b].wrench_of(&joint.kind.mechanics().column(k, joint.coordinates(q)));
            let linear = world[b].rotation * wrench.force;
            let angular = world[b].rotation * wrench.moment + levers[b].cross(linear);
            set(&mut rows, (joint.iv + k, nv), &MotionVector { angular, linear });
        }
    }
    model.free_columns(q, rows)
}

/// The centroidal map along a motion, each 6 × nv, row-major, rows 0-2 linear, 3-5 angular about the centre of mass, in world axes.
#[derive(Clone, Debug, PartialEq)]
pub struct CentroidalBlocks<T> {
    /// A with h = A q̇.
    pub map: Vec<T>,
    /// Ȧ.
    pub rate: Vec<T>,
    /// ∂h/∂q; of a floating base by increments of its pose in its own axes.
    pub by_position: Vec<T>,
}

/// A, Ȧ and ∂h/∂q at (q, q̇).
#[doc(alias("computeCentroidalMapTimeVariation", "dccrba"))]
pub fn centroidal_derivatives<T: Real>(model: &Model<T>, q: &[T], qd: &[T]) -> CentroidalBlocks<T> {
    let of_robot = (q, qd);
    let (q, nv) = (&*model.tree_positions(q), model.tree_nv());
    let qd = &*model.tree_rates(q, qd);
    let motion = CoriolisSweep::new(model, q, qd);
    let (spreads, world) = (motion.spreads(model), world_poses(model, q));
    let levers = levers_from_centre(model, &motion.poses, &world);
    let speeds = speeds_from_centre(model, &motion, &world);
    let none = || vec![T::zero(); 6 * nv];
    let mut all = CentroidalBlocks { map: none(), rate: none(), by_position: none() };
    for (b, body) in model.bodies.iter().enumerate() {
        T::section("centroidal map", Some(b));
        let (joint, rotation) = (&body.joint, world[b].rotation);
        for k in 0..joint.kind.nv() {
            let twist = joint.kind.mechanics().column(k, joint.coordinates(q));
            let column = motion.column(b, &twist, &spreads[b]);
            let place = (joint.iv + k, nv);
            let linear = rotation * column.momentum.force;
            let angular = rotation * column.momentum.moment + levers[b].cross(linear);
            set(&mut all.map, place, &MotionVector { angular, linear });
            let convected = rotation * column.convected + speeds[b].cross(linear);
            let rate = rotation * column.of_rate.force;
            let of_rate = rotation * column.of_rate.moment + levers[b].cross(rate);
            set(&mut all.rate, place, &MotionVector { angular: of_rate + convected, linear: rate });
            set(&mut all.by_position, place, &MotionVector { angular: of_rate - convected, linear: rate });
        }
    }
    subtract_brackets(model, qd, &all.map, &mut all.by_position);
    let six = momentum_of(model, of_robot.0, of_robot.1);
    turn_with_floating_bases(model, &world, &six, &mut all.by_position);
    let [map, rate, by_position] = [all.map, all.rate, all.by_position].map(|rows| model.free_columns(q, rows));
    CentroidalBlocks { map, rate, by_position }
}

/// Centroidal momentum h and its rate ḣ along a motion, each linear, then angular about the centre of mass, in world axes, without gravity, and their
/// derivatives, each 6 × nv, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct CentroidalDynamicsBlocks<T> {
    /// h.
    pub momentum: Vec<T>,
    /// ḣ = A q̈ + Ȧ q̇.
    pub momentum_rate: Vec<T>,
    /// ∂h/∂q; of a floating base by increments of its pose in its own axes.
    pub dh_dq: Vec<T>,
    /// ∂ḣ/∂q at constant q̇ and q̈.
    pub dhdot_dq: Vec<T>,
    /// ∂ḣ/∂q̇ = ∂h/∂q + Ȧ.
    pub dhdot_dqd: Vec<T>,
    /// A = ∂h/∂q̇ = ∂ḣ/∂q̈.
    pub map: Vec<T>,
}

/// Rates of joints commute with increments of each other and of a floating base: ∂ḣ/∂q_j is the rate of ∂h/∂q_j along the motion, in dual numbers, less
/// Σ c_i ∂h/∂q_i of a ball joint. Of a coordinate of a floating base it is what turns with it, w × ḣ.
#[doc(alias("computeCentroidalDynamicsBlocks"))]
pub fn centroidal_dynamics_derivatives<T: Real>(
    model: &Model<T>,
    [q, qd, qdd]: [&[T]; 3],
) -> CentroidalDynamicsBlocks<T> {
    let moving = |x: &[T], rates: &[T]| -> Vec<Dual<T, 1>> {
        x.iter().zip(rates).map(|(x, rate)| Dual { value: *x, derivatives: [*rate] }).collect()
    };
    let (q_moving, qd_moving) = (moving(q, &model.configuration_rate(q, qd)), moving(qd, qdd));
    let all = centroidal_derivatives(&model.map(Dual::fixed), &q_moving, &qd_moving);
    let values = |rows: &[Dual<T, 1>]| rows.iter().map(|x| x.value).collect::<Vec<T>>();
    let rates = |rows: &[Dual<T, 1>]| rows.iter().map(|x| x.derivatives[0]).collect::<Vec<T>>();
    let momentum_rate = rate_of_momentum([&all.map, &all.rate].map(|rows| values(rows)), qd, qdd);
    let mut dhdot_dq = rates(&all.by_position);
    subtract_brackets(model, qd, &values(&all.by_position), &mut dhdot_dq);
    turn_with_floating_bases(model, &world_poses(model, &model.tree_positions(q)), &momentum_rate, &mut dhdot_dq);
    CentroidalDynamicsBlocks {
        momentum: momentum_of(model, q, qd),
        momentum_rate,
        dh_dq: values(&all.by_position),
        dhdot_dq,
        dhdot_dqd: all.by_position.iter().zip(&all.rate).map(|(by_q, rate)| by_q.value + rate.value).collect(),
        map: values(&all.map),
    }
}

/// ḣ = A q̈ + Ȧ q̇.
fn rate_of_momentum<T: Real>([map, rate]: [Vec<T>; 2], qd: &[T], qdd: &[T]) -> Vec<T> {
    let row = |(map, rate): (&[T], &[T])| {
        let sum = |rows: &[T], x: &[T]| rows.iter().zip(x).fold(T::zero(), |sum, (a, x)| sum + *a * *x);
        sum(map, qdd) + sum(rate, qd)
    };
    map.chunks(qd.len()).zip(rate.chunks(qd.len())).map(row).collect()
}

/// h body by body, which keeps more digits than A q̇.
fn momentum_of<T: Real>(model: &Model<T>, q: &[T], qd: &[T]) -> Vec<T> {
    let all = momentum(model, q, qd);
    [all.linear, all.angular].into_iter().flat_map(Vec3::to_array).collect()
}

/// Of the columns of joints whose increments do not commute with their rates, Σ c_i times the columns `of`.
fn subtract_brackets<T: Real>(model: &Model<T>, qd: &[T], of: &[T], rows: &mut [T]) {
    let nv = rows.len() / 6;
    for joint in model.free_joints() {
        for k in 0..joint.kind.nv() {
            let Some(bracket) = joint.kind.mechanics().bracket(k, joint.rates(qd)) else { continue };
            for (row, of) in rows.chunks_mut(nv).zip(of.chunks(nv)) {
                let entry = &mut row[joint.iv + k];
                *entry = bracket.iter().zip(joint.rates(of)).fold(*entry, |rest, (c, x)| rest - *c * *x);
            }
        }
    }
}

/// The columns of the coordinates of floating bases: all that they carry turns, with it these six numbers.
fn turn_with_floating_bases<T: Real>(model: &Model<T>, world: &[WorldPose<T>], six: &[T], rows: &mut [T]) {
    let [linear, angular] = [0, 3].map(|k| Vec3::new(six[k], six[k + 1], six[k + 2]));
    for (body, pose) in model.bodies.iter().zip(world).filter(|(body, _)| body.joint.kind.is_base()) {
        let joint = &body.joint;
        for k in 0..joint.kind.nv() {
            let w = pose.rotation * joint.kind.mechanics().column(k, &[]).angular;
            let column = MotionVector { angular: w.cross(angular), linear: w.cross(linear) };
            set(rows, (joint.iv + k, rows.len() / 6), &column);
        }
    }
}

/// From the centre of mass to the origin of each body \[m\], in world axes.
fn levers_from_centre<T: Real>(model: &Model<T>, poses: &[JointPose<T>], world: &[WorldPose<T>]) -> Vec<Vec3<T>> {
    T::section("centre of mass", None);
    let (mass, first_moment) = first_moments_in_world(model, poses);
    let centre = first_moment.scale(T::one() / mass);
    let mut levers: Vec<Vec3<T>> = Vec::with_capacity(world.len());
    for (b, (body, pose)) in model.bodies.iter().zip(world).enumerate() {
        T::section("centre of mass", Some(b));
        levers.push(match body.parent {
            Some(parent) => levers[parent] + pose.lever,
            None => {
                let joint = from_anchor(poses, b) - centre;
                poses[b].slide.map_or(joint, |slide| joint + pose.rotation.column(2).scale(slide))
            }
        });
    }
    levers
}

/// The velocity of the origin of each body against the centre of mass \[m/s\], in world axes.
fn speeds_from_centre<T: Real>(model: &Model<T>, motion: &CoriolisSweep<T>, world: &[WorldPose<T>]) -> Vec<Vec3<T>> {
    let roots = || (0..model.bodies.len()).filter(|b| model.bodies[*b].parent.is_none());
    let of_root = |b: usize| world[b].rotation * motion.velocities[b].linear;
    // of the others against the first: a robot but a forest has one
    let against_first = |b: usize| if b == 0 { Vec3::zero() } else { of_root(b) - of_root(0) };
    let (mut mass, mut momentum) = (T::zero(), Vec3::zero());
    for b in roots() {
        let own = motion.composites[b].mass;
        mass = mass + own;
        momentum = momentum + world[b].rotation * motion.drift(b) + against_first(b).scale(own);
    }
    let centre = momentum.scale(T::one() / mass);
    let mut speeds: Vec<Vec3<T>> = Vec::with_capacity(world.len());
    for (b, body) in model.bodies.iter().enumerate() {
        T::section("speed", Some(b));
        speeds.push(match body.parent {
            Some(parent) => speeds[parent] + world[parent].rotation * motion.origin_rate((b, parent)),
            None => against_first(b) - centre,
        });
    }
    speeds
}
