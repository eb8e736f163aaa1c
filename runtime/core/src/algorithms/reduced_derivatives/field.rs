//! The motion that a joint gives to points, linear in the point: y = z × r + b, its rate, and what its second rate is to a column.

use super::column::Column;
use super::MotionSweep;
use crate::model::BodyId;
use crate::real::Real;
use crate::reduced::ReducedJoint;
use crate::spatial::{ForceVector, Vec3};
use alloc::vec;
use alloc::vec::Vec;

/// About an origin on the way outwards, in the axes of its body.
#[derive(Clone)]
pub(super) struct Field<T> {
    /// z and b.
    turn: Vec3<T>,
    shift: Vec3<T>,
    /// ż and ḃ: ẏ = ż × r + z × ṙ + ḃ.
    turn_rate: Vec3<T>,
    shift_rate: Vec3<T>,
    /// z̈, and b̈ less what z × a takes away: ∫ y_i · ÿ + (z × y_i) · a dm = z̈ · ∫ r × y_i dm + 2 ż · ∫ ṙ × y_i dm + β · ∫ y_i dm.
    turn_second: Vec3<T>,
    shift_second: Vec3<T>,
}

impl<T: Real> Field<T> {
    /// At the joint's own origin.
    fn new(sweep: &MotionSweep<'_, T>, j: BodyId) -> Self {
        let link = &sweep.links[j];
        let (w, a, o) = (link.spin.omega, link.accel, Vec3::zero());
        // ω × z and U z
        let (rate, second) = (Vec3::new(w.y, -w.x, T::zero()), link.spin.u.column(2));
        match sweep.body(j).kind {
            ReducedJoint::Turn => Field {
                turn: Vec3::unit_z(),
                shift: o,
                turn_rate: rate,
                shift_rate: o,
                turn_second: second,
                // −z × A
                shift_second: Vec3::new(a.y, -a.x, T::zero()),
            },
            ReducedJoint::Slide => Field {
                turn: o,
                shift: Vec3::unit_z(),
                turn_rate: o,
                shift_rate: rate,
                turn_second: o,
                shift_second: second,
            },
            ReducedJoint::Free => unreachable!("a floating base has columns of its own"),
            ReducedJoint::Ball => unreachable!("robots with ball joints have no structured columns"),
        }
    }

    /// About the origin of a body, from that of its parent.
    fn to_child(&self, sweep: &MotionSweep<'_, T>, child: BodyId) -> Self {
        let (arm, arm_rate) = (sweep.links[child].arm, sweep.arm_rate(child));
        let turned = |v| sweep.to_child(child, v);
        let twice = self.turn_rate + self.turn_rate;
        Field {
            turn: turned(self.turn),
            shift: turned(self.shift + self.turn.cross(arm)),
            turn_rate: turned(self.turn_rate),
            shift_rate: turned(self.shift_rate + self.turn_rate.cross(arm) + self.turn.cross(arm_rate)),
            turn_second: turned(self.turn_second),
            shift_second: turned(self.shift_second + self.turn_second.cross(arm) + twice.cross(arm_rate)),
        }
    }

    /// ∫ y · (what the wrench is made of).
    pub fn power(&self, w: &ForceVector<T>) -> T {
        self.turn.dot(w.moment) + self.shift.dot(w.force)
    }

    /// 2 ∫ y_i · ẏ dm.
    pub fn by_rate(&self, column: &Column<T>) -> T {
        let (turn, shift) = (self.turn_rate + self.turn_rate, self.shift_rate + self.shift_rate);
        turn.dot(column.momentum.moment) + self.turn.dot(column.convected) + shift.dot(column.momentum.force)
    }

    /// ∫ y_i · ÿ + (z × y_i) · a dm.
    pub fn by_position(&self, column: &Column<T>) -> T {
        self.turn_second.dot(column.momentum.moment)
            + self.turn_rate.dot(column.convected)
            + self.shift_second.dot(column.momentum.force)
    }
}

/// Fields of all joints about all origins behind them, made when they are asked for.
pub(super) struct Fields<T> {
    known: Vec<Vec<Option<Field<T>>>>,
}

impl<T: Real> Fields<T> {
    pub fn new(sweep: &MotionSweep<'_, T>) -> Self {
        let count = sweep.model.bodies.len();
        Fields { known: vec![vec![None; count]; count] }
    }

    /// The field of joint `j` about the origin of a body that it carries.
    pub fn at(&mut self, sweep: &MotionSweep<'_, T>, j: BodyId, body: BodyId) -> Field<T> {
        if let Some(known) = &self.known[j][body] {
            return known.clone();
        }
        let made = match sweep.body(body).parent.filter(|_| body != j) {
            Some(parent) => self.at(sweep, j, parent).to_child(sweep, body),
            None => Field::new(sweep, j),
        };
        self.known[j][body] = Some(made.clone());
        made
    }
}
