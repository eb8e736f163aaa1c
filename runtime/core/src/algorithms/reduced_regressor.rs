//! The columns of regressors that belong to bodies, on a [`ReducedModel`].
//!
//! The forces of joint i are y_i · w for the wrench w of a unit of a parameter of body j, with y_i = (z, b) the velocity of points per unit rate of the joint:
//! z × r + b. Both meet anywhere on the way between the two: wrenches travel inwards, one per parameter, and give the forces of joints on
//! their way as they pass; y_i travels outwards, and serves all parameters. Second moments make wrenches without force, which take half the
//! operations on their way, so they meet elsewhere than first moments ([`Meeting`](crate::reduced::Meeting)). Which places take the fewest operations depends on the robot.

use super::reduced_derivatives::MotionSweep;
use super::reduced_dynamics::motions;
use crate::base_parameters::{BaseParameter, BaseParameterKind};
use crate::model::{BodyId, Load};
use crate::real::Real;
use crate::reduced::{ReducedBody, ReducedJoint, ReducedModel};
use crate::spatial::{ForceVector, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// Rows and columns as those of [`torque_regressor`](super::torque_regressor), of the bodies' parameters: those of joints are zero. The unit of length has to be the
/// metre, and the frames those that the parameters were found in.
pub fn reduced_inertial_regressor<T: Real>(
    model: &ReducedModel<T>,
    columns: &[BaseParameter],
    [q, qd, qdd]: [&[T]; 3],
) -> Vec<T> {
    let (turns, links) = motions(model, q, qd, qdd);
    let sweep = MotionSweep { model, turns, links, q, qd };
    let mut y = vec![T::zero(); model.nv() * columns.len()];
    let mut fields = PointFields { known: Vec::new() };
    for (k, parameter) in columns.iter().enumerate() {
        let BaseParameterKind::Inertia { entry, .. } = parameter.kind else { continue };
        let path = sweep.path(parameter.body);
        let depth = if entry < 4 { model.meeting.upper } else { model.meeting.lower };
        let outermost = (path.len() - 1).saturating_sub(depth).max(model.meeting.mass_matrix);
        T::section("regressor", Some(parameter.body));
        let mut wrenches = vec![unit_wrench(&sweep, parameter.body, entry)];
        for (at, joint) in path.iter().enumerate() {
            let over = sweep.body(*joint);
            for row in (0..over.kind.nv()).filter(|row| parameter.rows.contains(&(over.iv + row))) {
                let place = outermost.min(at);
                while wrenches.len() <= place {
                    let next = sweep.wrench_to_parent(path[wrenches.len() - 1], &wrenches[wrenches.len() - 1]);
                    wrenches.push(next);
                }
                let field = fields.at(&sweep, (*joint, row), path[place]);
                y[(over.iv + row) * columns.len() + k] = field.power(&wrenches[place]);
            }
        }
    }
    y
}

/// The wrench about its origin that a body takes of which this entry of the ten parameters is one, and all others zero.
fn unit_wrench<T: Real>(sweep: &MotionSweep<'_, T>, body: BodyId, entry: usize) -> ForceVector<T> {
    let Load { mass, first_moment, second_moment } = Load::unit(entry);
    let unit = ReducedBody { mass, first_moment, second_moment, ..sweep.body(body).clone() };
    sweep.links[body].wrench(&unit, &sweep.turns[body])
}

/// The velocity that a unit rate of a coordinate gives to points: turn × r + shift.
#[derive(Clone)]
struct PointField<T> {
    turn: Vec3<T>,
    shift: Vec3<T>,
}

impl<T: Real> PointField<T> {
    /// Of coordinate `row` of a joint, about its body's origin.
    fn new(sweep: &MotionSweep<'_, T>, (joint, row): (BodyId, usize)) -> Self {
        let zero = Vec3::zero();
        let over = sweep.body(joint);
        match over.kind {
            ReducedJoint::Turn => PointField { turn: Vec3::unit_z(), shift: zero },
            ReducedJoint::Slide => PointField { turn: zero, shift: Vec3::unit_z() },
            ReducedJoint::Free | ReducedJoint::Ball => {
                let axis = Vec3::unit(row % 3);
                match over.kind == ReducedJoint::Free && row < 3 {
                    true => PointField { turn: zero, shift: axis },
                    false => PointField { turn: axis, shift: zero },
                }
            }
        }
    }

    fn power(&self, w: &ForceVector<T>) -> T {
        self.turn.dot(w.moment) + self.shift.dot(w.force)
    }
}

/// Of all coordinates about all origins behind them, made when they are asked for.
struct PointFields<T> {
    known: Vec<((BodyId, usize, BodyId), PointField<T>)>,
}

impl<T: Real> PointFields<T> {
    fn at(&mut self, sweep: &MotionSweep<'_, T>, joint: (BodyId, usize), body: BodyId) -> PointField<T> {
        let key = (joint.0, joint.1, body);
        if let Some((_, known)) = self.known.iter().find(|(k, _)| *k == key) {
            return known.clone();
        }
        let made = match sweep.body(body).parent.filter(|_| body != joint.0) {
            Some(parent) => {
                let PointField { turn, shift } = self.at(sweep, joint, parent);
                T::section("axes", Some(body));
                PointField {
                    turn: sweep.to_child(body, turn),
                    shift: sweep.to_child(body, shift + turn.cross(sweep.links[body].arm)),
                }
            }
            None => PointField::new(sweep, joint),
        };
        self.known.push((key, made.clone()));
        made
    }
}
