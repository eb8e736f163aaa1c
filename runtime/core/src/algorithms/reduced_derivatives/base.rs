//! Rows and columns of a floating base: coordinates v and ω in its axes, increments of its position and orientation likewise.

use super::column::Column;
use super::subtree::Subtree;
use super::{DerivativeBlocks, MotionSweep};
use crate::joint::quaternion::rotated_back;
use crate::joint::FLOATING_BASE;
use crate::model::BodyId;
use crate::real::Real;
use crate::spatial::{Composite, Vec3};

/// Gravity and the velocity of the origin in the base's axes, in the model's unit of length.
fn gravity_and_velocity<T: Real>(sweep: &MotionSweep<'_, T>, base: BodyId) -> [Vec3<T>; 2] {
    let (body, model) = (sweep.body(base), sweep.model);
    let [k, iv] = [body.iq + 3, body.iv];
    let (q, qd) = (sweep.q, sweep.qd);
    let gravity = rotated_back([q[k], q[k + 1], q[k + 2], q[k + 3]], model.gravity);
    [gravity, Vec3::new(qd[iv], qd[iv + 1], qd[iv + 2]).scale(model.per_unit)]
}

/// Of joint `i` with the base that carries it; its column stands about the base's origin.
///
/// The base's acceleration is v̇ + ω × v − g in its own axes, so that torques change with its orientation by −δθ × (−g) alone, with v by ω × δv, with ω by
/// δω × v and the field δω × r.
pub(super) fn rows_and_columns<T: Real>(
    sweep: &MotionSweep<'_, T>,
    (i, base): (BodyId, BodyId),
    column: &Column<T>,
    all: &mut DerivativeBlocks<T>,
) {
    let (nv, unit) = (sweep.model.nv(), sweep.model.per_unit);
    let (row, first) = (sweep.body(i).iv, sweep.body(base).iv);
    let omega = sweep.links[base].spin.omega;
    let [gravity, velocity] = gravity_and_velocity(sweep, base);
    let Column { momentum, convected, by_position, by_rate } = column;
    let by_orientation = gravity.cross(momentum.force).to_array();
    let by_velocity = momentum.force.cross(omega).scale(unit).to_array();
    let by_omega = (*convected + momentum.moment.cross(omega) + velocity.cross(momentum.force)).to_array();
    let in_metres = |v: Vec3<T>| v.scale(unit).to_array();
    let (p, of_position, of_rate) = (in_metres(momentum.force), in_metres(by_position.force), in_metres(by_rate.force));
    let moments = [momentum.moment, by_position.moment, by_rate.moment].map(Vec3::to_array);
    for k in 0..3 {
        let (linear, angular) = (first + k, first + 3 + k);
        let places = |column: usize| [row * nv + column, column * nv + row];
        let [at_linear, across_linear] = places(linear);
        let [at_angular, across_angular] = places(angular);
        (all.mass_matrix[at_linear], all.mass_matrix[across_linear]) = (p[k], p[k]);
        (all.mass_matrix[at_angular], all.mass_matrix[across_angular]) = (moments[0][k], moments[0][k]);
        all.dtau_dq[at_angular] = by_orientation[k];
        (all.dtau_dqd[at_linear], all.dtau_dqd[at_angular]) = (by_velocity[k], by_omega[k]);
        (all.dtau_dq[across_linear], all.dtau_dq[across_angular]) = (of_position[k], moments[1][k]);
        (all.dtau_dqd[across_linear], all.dtau_dqd[across_angular]) = (of_rate[k], moments[2][k]);
    }
}

/// Of the base with itself.
pub(super) fn own_block<T: Real>(
    sweep: &MotionSweep<'_, T>,
    base: BodyId,
    subtree: &Subtree<T>,
    all: &mut DerivativeBlocks<T>,
) {
    let (nv, unit, iv) = (sweep.model.nv(), sweep.model.per_unit, sweep.body(base).iv);
    let (m, h, s) = (subtree.composite.mass, subtree.composite.first_moment, subtree.composite.second_moment);
    let omega = sweep.links[base].spin.omega;
    let [gravity, velocity] = gravity_and_velocity(sweep, base);
    let inertia = s.second_moment_to_inertia();
    let (angular_momentum, swing) = (inertia * omega, omega.cross(h));
    let n = &subtree.spread.rows;
    let trace = n[0][0] + n[1][1] + n[2][2];
    let put = |to: &mut [T], column: usize, force: Vec3<T>, moment: Vec3<T>| {
        let both = force.scale(unit).to_array().into_iter().chain(moment.to_array());
        both.enumerate().for_each(|(k, x)| to[(iv + k) * nv + column] = x);
    };
    let metres = Composite { mass: m * unit * unit, first_moment: h.scale(unit), second_moment: s };
    let own = &sweep.q[sweep.body(base).iq..sweep.body(base).iq + FLOATING_BASE.nq()];
    FLOATING_BASE.mechanics().block(&metres, own, FLOATING_BASE.nv(), &mut |i, j, value| {
        all.mass_matrix[(iv + i) * nv + iv + j] = value;
        all.mass_matrix[(iv + j) * nv + iv + i] = value;
    });
    for k in 0..3 {
        let mut unit_vector = [T::zero(); 3];
        unit_vector[k] = T::one();
        let e = Vec3::from(unit_vector);
        let by_orientation = e.cross(gravity);
        put(&mut all.dtau_dq, iv + 3 + k, by_orientation.scale(m), h.cross(by_orientation));
        let by_velocity = omega.cross(e).scale(unit);
        put(&mut all.dtau_dqd, iv + k, by_velocity.scale(m), h.cross(by_velocity));
        // the field e × r, its change by ω, what moves against the base, and e × v at the origin
        let (at_origin, drift) = (e.cross(velocity), subtree.drift + subtree.drift);
        let force = e.cross(swing) + omega.cross(e.cross(h)) + e.cross(drift) + at_origin.scale(m);
        let relative = e.scale(trace) - Vec3::new(n[0][k], n[1][k], n[2][k]);
        let moment = omega.cross(inertia * e) + e.cross(angular_momentum) + (relative + relative) + h.cross(at_origin);
        put(&mut all.dtau_dqd, iv + 3 + k, force, moment);
    }
}
