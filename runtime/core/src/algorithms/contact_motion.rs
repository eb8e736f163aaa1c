//! How everything about a contact changes where a coordinate or a rate of the robot does: its functional coordinates with ṡ and s̈, and the forces
//! Ĵᵀ F that given reactions make.
//!
//! The robot comes in by the frame that touches, and by the object where the robot carries it: ∂v/∂q, ∂a/∂q, ∂a/∂q̇ and J of
//! [`frame_derivatives`](fn@super::frame_derivatives) say how they move, in closed form. From there to the coordinates it is a short way of dual numbers, over surfaces of any form. Reactions
//! are a wrench (f, m) on the frame, and the opposite one on the object; with columns (l, w) of J
//!
//! ```text
//! ∂(Jᵀ W)_i/∂q_k = w_k · (l_i × f + w_i × m)     if joint k carries joint i: column i turns with it
//!                = w_i · (l_k × f)               if joint i carries joint k: the point of the force moves
//! ```
//!
//! and Jᵀ ∂W/∂q_k of a wrench that is not held in the world: of curved surfaces, axes, friction, and loops.

use super::constraint::friction_tilt;
use super::frame_derivatives::{tree_frame_derivatives, FrameDerivativeBlocks};
use super::functional::{between, FunctionalCoordinates, InWorld, PlaceOnSurface, RelativeMotion};
use super::kinematics::{forward_kinematics, frame_acceleration, frame_velocity, path_to};
use crate::contact::{Contact, Object};
use crate::dual::Dual;
use crate::model::{Frame, Model};
use crate::real::Real;
use crate::spatial::{ForceVector, Mat3, MotionVector, Transform, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// What moves alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moving {
    /// A coordinate: of a floating base an increment of its pose in its own axes.
    Position(usize),
    /// A rate.
    Velocity(usize),
}

/// A contact as it changes where something moves. It has no Jacobian.
#[derive(Clone, Debug)]
pub struct MovedContact<T> {
    /// Of the frame against the object.
    pub motion: RelativeMotion<Dual<T, 1>>,
    /// The constrained coordinates; for their bias s̈ at the accelerations of the sweep.
    pub coordinates: FunctionalCoordinates<Dual<T, 1>>,
    /// Wrenches on frame and object.
    wrenches: [ForceVector<Dual<T, 1>>; 2],
}

/// The frames of a contact that the robot carries, at a motion of it.
pub struct ContactSweep<T> {
    frame: SweptFrame<T>,
    object: Result<SweptFrame<T>, Object<T>>,
}

/// A frame of the robot, with the derivatives of its motion.
struct SweptFrame<T> {
    pose: Transform<T>,
    velocity: MotionVector<T>,
    acceleration: MotionVector<T>,
    blocks: FrameDerivativeBlocks<T>,
    /// The velocity coordinates that move it.
    path: Vec<usize>,
    /// The Jacobian by all coordinates of the tree, and those that move the frame.
    of_tree: (Vec<T>, Vec<usize>),
}

impl<T: Real> SweptFrame<T> {
    fn new(model: &Model<T>, frame: &Frame<T>, [q, qd, qdd]: [&[T]; 3]) -> Self {
        let bodies = path_to(model, frame.body);
        let coordinates = |first: usize, b: usize| first..first + model.bodies[b].joint.kind.nv();
        let mut path: Vec<usize> = Vec::new();
        for k in bodies.iter().flat_map(|b| coordinates(model.moved_by(*b).0, *b)) {
            if !path.contains(&k) {
                path.push(k);
            }
        }
        let tree_path = bodies.iter().flat_map(|b| coordinates(model.bodies[*b].joint.iv, *b)).collect();
        let pose = forward_kinematics(model, q, &[frame])[0];
        let velocity = frame_velocity(model, q, qd, frame);
        let acceleration = frame_acceleration(model, q, qd, qdd, frame);
        let [y, yd, ydd] = &model.tree_motion([q, qd, qdd]);
        let blocks = tree_frame_derivatives(model, [y, yd, ydd], frame);
        SweptFrame {
            pose,
            velocity,
            acceleration,
            of_tree: (blocks.jacobian.clone(), tree_path),
            blocks: blocks.of_free_joints(model, y),
            path,
        }
    }

    /// A column of six rows.
    fn column(&self, rows: &[T], k: usize) -> MotionVector<T> {
        let entry = |row: usize| rows[row * (rows.len() / 6) + k];
        MotionVector {
            linear: Vec3::new(entry(0), entry(1), entry(2)),
            angular: Vec3::new(entry(3), entry(4), entry(5)),
        }
    }

    fn moved(&self, moving: Option<Moving>) -> InWorld<Dual<T, 1>> {
        let none = MotionVector { angular: Vec3::zero(), linear: Vec3::zero() };
        let (turned, [velocity, acceleration]) = match moving {
            Some(Moving::Position(k)) => (
                self.column(&self.blocks.jacobian, k),
                [&self.blocks.dv_dq, &self.blocks.da_dq].map(|rows| self.column(rows, k)),
            ),
            Some(Moving::Velocity(k)) => {
                (none, [&self.blocks.jacobian, &self.blocks.da_dqd].map(|rows| self.column(rows, k)))
            }
            None => (none, [none; 2]),
        };
        let axes = [0, 1, 2].map(|k| {
            let axis = self.pose.rotation.column(k);
            dual(axis, turned.angular.cross(axis))
        });
        let both = |value: MotionVector<T>, rate: MotionVector<T>| MotionVector {
            angular: dual(value.angular, rate.angular),
            linear: dual(value.linear, rate.linear),
        };
        InWorld {
            pose: Transform {
                rotation: Mat3::from_columns(axes[0], axes[1], axes[2]),
                translation: dual(self.pose.translation, turned.linear),
            },
            velocity: both(self.velocity, velocity),
            acceleration: both(self.acceleration, acceleration),
            jacobian: None,
        }
    }

    /// Adds Jᵀ W to forces.
    fn add_forces(&self, wrench: &ForceVector<T>, forces: &mut [T]) {
        for &i in &self.path {
            let column = self.column(&self.blocks.jacobian, i);
            forces[i] = forces[i] + (column.linear.dot(wrench.force) + column.angular.dot(wrench.moment));
        }
    }
}

/// A vector that moves at a rate.
fn dual<T: Real>(value: Vec3<T>, rate: Vec3<T>) -> Vec3<Dual<T, 1>> {
    let of = |value: T, rate: T| Dual { value, derivatives: [rate] };
    Vec3::new(of(value.x, rate.x), of(value.y, rate.y), of(value.z, rate.z))
}

fn held<T: Real>(m: &MotionVector<T>) -> MotionVector<Dual<T, 1>> {
    MotionVector { angular: m.angular.map(Dual::fixed), linear: m.linear.map(Dual::fixed) }
}

impl<T: Real> ContactSweep<T> {
    /// At q, q̇ and q̈; of an object that moves by itself at the motion that it has.
    pub fn new(model: &Model<T>, contact: &Contact<T>, motion: [&[T]; 3]) -> Self {
        let object = match &contact.object {
            Object::OnRobot(frame) => Ok(SweptFrame::new(model, frame, motion)),
            other => Err(other.clone()),
        };
        ContactSweep { frame: SweptFrame::new(model, &contact.frame, motion), object }
    }

    /// Whether the contact feels a velocity coordinate.
    pub fn feels(&self, k: usize) -> bool {
        self.frame.path.contains(&k) || self.object.as_ref().is_ok_and(|object| object.path.contains(&k))
    }

    /// The contact, over dual numbers, as something moves, or nothing; with the wrenches of reactions that are held.
    pub fn moved(&self, contact: &Contact<Dual<T, 1>>, force: &[T], moving: Option<Moving>) -> MovedContact<T> {
        let robot = self.frame.moved(moving);
        let object = match &self.object {
            Ok(frame) => Ok(frame.moved(moving)),
            Err(Object::Moving(law)) => Ok(InWorld {
                pose: law.pose.map(Dual::fixed),
                velocity: held(&law.velocity),
                acceleration: held(&law.acceleration),
                jacobian: None,
            }),
            Err(Object::Fixed(pose)) => Err(pose.map(Dual::fixed)),
            Err(Object::OnRobot(_)) => unreachable!("the robot's frames are swept"),
        };
        let motion = between(&robot, &object);
        let place = PlaceOnSurface::new(contact, &motion);
        let tilt = friction_tilt(contact, &motion);
        let mut coordinates = FunctionalCoordinates::default();
        let mut weights = [Dual::<T, 1>::zero(); 6];
        for (i, coordinate) in contact.constrained.iter().enumerate() {
            let mut s = place.coordinate(*coordinate);
            coordinates.value.push(s.value);
            coordinates.rate.push(s.rate);
            coordinates.bias.push(s.second);
            coordinates.jacobian.push(vec![]);
            if let Some((_, tilt)) = tilt.filter(|(row, _)| *row == i) {
                s.weights.iter_mut().zip(tilt).for_each(|(weight, tilt)| *weight = *weight - tilt);
            }
            let reaction = Dual::fixed(force[i]);
            weights.iter_mut().zip(s.weights).for_each(|(sum, weight)| *sum = *sum + weight * reaction);
        }
        // from the axes of the object into the world, and its opposite about the object's origin
        let pose = object.as_ref().map_or_else(|pose| *pose, |object| object.pose);
        let [x, y, z, u, v, w] = weights;
        let (force, moment) = (pose.rotation * Vec3::new(x, y, z), pose.rotation * Vec3::new(u, v, w));
        let lever = robot.pose.translation - pose.translation;
        let opposite = ForceVector { force: -force, moment: -(moment + lever.cross(force)) };
        MovedContact { motion, coordinates, wrenches: [ForceVector { moment, force }, opposite] }
    }

    /// Adds Jᵀ of how the wrenches of a moved contact change to forces.
    pub fn add_changes(&self, moved: &MovedContact<T>, forces: &mut [T]) {
        let change = |wrench: &ForceVector<Dual<T, 1>>| ForceVector {
            moment: wrench.moment.map(|x| x.derivatives[0]),
            force: wrench.force.map(|x| x.derivatives[0]),
        };
        self.frame.add_forces(&change(&moved.wrenches[0]), forces);
        if let Ok(object) = &self.object {
            object.add_forces(&change(&moved.wrenches[1]), forces);
        }
    }
}

/// ∂(Jᵀ W)/∂q of wrenches that are held in the world, of all contacts together: joints that carry several turn them together.
pub struct HeldWrenches<T> {
    /// w_k.
    turns: Vec<Vec3<T>>,
    /// Σ l_i × f + w_i × m.
    carried: Vec<Vec3<T>>,
    /// Σ l_k × f.
    shifted: Vec<Vec3<T>>,
}

impl<T: Real> HeldWrenches<T> {
    /// None.
    pub fn none(model: &Model<T>) -> Self {
        let none = || vec![Vec3::zero(); model.tree_nv()];
        HeldWrenches { turns: none(), carried: none(), shifted: none() }
    }

    /// With those of a contact where nothing moves.
    pub fn add(&mut self, sweep: &ContactSweep<T>, at_rest: &MovedContact<T>) {
        let frames = [Some(&sweep.frame), sweep.object.as_ref().ok()];
        for (frame, wrench) in frames.into_iter().zip(&at_rest.wrenches) {
            let Some(frame) = frame else { continue };
            let (force, moment) = (wrench.force.map(|x| x.value), wrench.moment.map(|x| x.value));
            let (jacobian, path) = &frame.of_tree;
            for &i in path {
                let column = frame.column(jacobian, i);
                let shifted = column.linear.cross(force);
                self.turns[i] = column.angular;
                self.carried[i] = self.carried[i] + (shifted + column.angular.cross(moment));
                self.shifted[i] = self.shifted[i] + shifted;
            }
        }
    }

    /// ∂(Jᵀ W)/∂q, nv × nv, row-major.
    pub fn slopes(&self, model: &Model<T>, y: &[T]) -> Vec<T> {
        let nv = self.turns.len();
        let mut slopes = vec![T::zero(); nv * nv];
        for (outer, body) in model.bodies.iter().enumerate() {
            let own = body.joint.iv..body.joint.iv + body.joint.kind.nv();
            for inner in path_to(model, Some(outer)) {
                let over = &model.bodies[inner].joint;
                for (i, k) in own.clone().flat_map(|i| (over.iv..over.iv + over.kind.nv()).map(move |k| (i, k))) {
                    slopes[i * nv + k] = self.turns[k].dot(self.carried[i]);
                    if inner != outer {
                        slopes[k * nv + i] = self.turns[k].dot(self.shifted[i]);
                    }
                }
            }
        }
        model.free_square(y, slopes)
    }
}
