//! Single precision, and what compiled functions lose: against their own equations in double-double.

use super::outcome::{Outcome, Size};
use super::robots::Judged;
use straightline_codegen::program::TracedProgram;
use straightline_codegen::Function;
use straightline_core::reference::{geometry, motion, natural_scale, CentreOfMassTree, ReferenceJoint};
use straightline_core::Dd;
use straightline_generated_tests::compiled;
use straightline_generated_tests::programs::{self, cast};
use straightline_generated_tests::random::Random;
use straightline_generated_tests::reference::Expected;

/// The equations of a function of a robot, to be run in double-double.
pub fn equations(judged: &Judged, function: Function) -> TracedProgram {
    programs::of_robot(&judged.robot, function, &programs::options(&judged.robot))
}

/// The worst error of computed torques in units of `unit` times the natural scales of [`scales`].
pub fn torque_error(judged: &Judged, inputs: &[Vec<f64>], computed: &[f64], truth: &[Dd], unit: f64) -> f64 {
    torque_error_of(&judged.tree, inputs, computed, truth, unit)
}

/// The same for any tree.
pub fn torque_error_of(
    tree: &CentreOfMassTree<f64>,
    inputs: &[Vec<f64>],
    computed: &[f64],
    truth: &[Dd],
    unit: f64,
) -> f64 {
    scaled(&scales(tree, &inputs[0], &inputs[1], &inputs[2]), computed, truth, unit)
}

/// The same against the scale of the reference data, in which an acceleration is one term.
pub fn torque_error_after_cancellation(
    judged: &Judged,
    inputs: &[Vec<f64>],
    computed: &[f64],
    truth: &[Dd],
    unit: f64,
) -> f64 {
    let scales = natural_scale(&judged.tree, &inputs[0], &inputs[1], &inputs[2]);
    // a joint that bears nothing in a state, such as one along gravity, has no scale there
    let greatest = scales.max();
    let scales: Vec<f64> = scales.iter().map(|s| s.max(1e-6 * greatest)).collect();
    scaled(&scales, computed, truth, unit)
}

fn scaled(scales: &[f64], computed: &[f64], truth: &[Dd], unit: f64) -> f64 {
    let error = |i: usize| (Dd::from(computed[i]) - truth[i]).to_f64().abs() / scales[i] / unit;
    (0..computed.len()).map(error).fold(0.0, |m, e| if e.is_finite() { m.max(e) } else { f64::INFINITY })
}

/// The sum of the moduli of the terms of every torque: lengths of links · m · |terms of the acceleration| + |terms of the
/// couple| over the links that a joint carries.
///
/// The scale of the reference data takes a lever, and the acceleration of a centre of mass, as one term. Where ten joints turn at
/// 100 rad/s accelerations of 1e5 m/s² can cancel to nothing at a wrist, and a search finds that; here their terms count, as
/// everything that is added does: A_k = A_parent + (E + ω²) |r| …, E_k = E_parent + |q̈| + |q̇| |ω|.
fn scales(tree: &CentreOfMassTree<f64>, q: &[f64], qd: &[f64], qdd: &[f64]) -> Vec<f64> {
    let places = geometry(tree, q);
    let motion = motion(tree, &places, qd, qdd);
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let turning = |omega: f64, epsilon: f64| epsilon + omega * omega;
    // per link the terms of its acceleration, gravity's included, and of its angular acceleration
    let mut terms: Vec<[f64; 2]> = Vec::new();
    for (k, link) in tree.links.iter().enumerate() {
        let omega = norm(motion[k].omega.as_slice());
        let (parent_omega, [mut a, mut e]) = match link.parent {
            Some(p) => (norm(motion[p].omega.as_slice()), terms[p]),
            None => (0.0, [norm(tree.gravity.as_slice()), 0.0]),
        };
        a += turning(parent_omega, e) * norm(places[k].r_parent.as_slice());
        match link.joint {
            ReferenceJoint::Revolute => e += qdd[link.iv].abs() + qd[link.iv].abs() * parent_omega,
            ReferenceJoint::Linear => a += qdd[link.iv].abs() + 2.0 * parent_omega * qd[link.iv].abs(),
            ReferenceJoint::Free => {
                let (rates, v) = (&qdd[link.iv..link.iv + 6], &qd[link.iv..link.iv + 3]);
                a += norm(&rates[..3]) + omega * norm(v);
                e += norm(&rates[3..]);
            }
            ReferenceJoint::Ball => {
                let own = link.iv..link.iv + 3;
                e += norm(&qdd[own.clone()]) + norm(&qd[own]) * parent_omega;
            }
        }
        a += turning(omega, e) * norm(places[k].r_dash.as_slice());
        terms.push([a, e]);
    }
    let mut scale = vec![0.0; tree.nv()];
    for (k, link) in tree.links.iter().enumerate() {
        let [a, e] = terms[k];
        let (force, couple) = (link.mass * a, link.inertia.trace() * turning(norm(motion[k].omega.as_slice()), e));
        // a moment is handed from joint to joint: levers are the ways along the links
        let (mut lever, mut next) = (0.0, Some(k));
        while let Some(j) = next {
            let joint = &tree.links[j];
            lever += norm(places[j].r_dash.as_slice());
            let moment = lever * force + couple;
            let of_coordinate = |i: usize| match joint.joint {
                ReferenceJoint::Linear => force,
                ReferenceJoint::Revolute | ReferenceJoint::Ball => moment,
                ReferenceJoint::Free => [force, moment][i / 3],
            };
            (0..joint.joint.nv()).for_each(|i| scale[joint.iv + i] += of_coordinate(i));
            lever += norm(places[j].r_parent.as_slice());
            next = joint.parent;
        }
    }
    scale
}

/// As f32 holds them.
pub fn in_single(inputs: &[Vec<f64>]) -> Vec<Vec<f64>> {
    inputs.iter().map(|group| group.iter().map(|x| f64::from(*x as f32)).collect()).collect()
}

/// Per function, the worst error over the greatest component of the output, in u of f32.
pub fn single_against_double(size: Size) -> Vec<Outcome> {
    let unit = f64::from(f32::EPSILON) / 2.0;
    let mut outcomes = Vec::new();
    for compiled in compiled::F32.iter().filter(|c| !c.exact) {
        let judged = Judged::new(compiled.robot);
        for function in Function::all() {
            let program = equations(&judged, function);
            let mut random = Random(14);
            let mut worst = 0.0f64;
            for _ in 0..size.pick(3, 500) {
                let inputs = in_single(&judged.state(function, &mut random));
                let truth: Vec<Dd> = programs::run(&program, &cast(&inputs));
                let computed: Vec<f64> =
                    compiled.call(function, &cast::<f32>(&inputs)).into_iter().map(f64::from).collect();
                let mut expected = Expected { values: Vec::new(), scales: Vec::new() };
                expected.append_uniform(truth);
                worst = worst.max(expected.worst(&computed).0 / unit);
            }
            // forward dynamics amplifies by the condition of H; the sums of the others are short
            let bound = match function {
                Function::ForwardDynamics => 3000.0,
                _ => 100.0,
            };
            outcomes.push(Outcome::new(
                14,
                &judged.robot.name,
                format!("f32 {}, u of the greatest component", function.name()),
                worst,
                bound,
            ));
        }
    }
    outcomes
}
