//! Derivatives of the motion of frames in the three conventions: identities between the functions of a robot.

use super::tasks::{blocks, hold, matrix, robots, run, vector, Asked};
use super::written::Random;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use straightline_codegen::Function;
use straightline_core::Dd;

const CONVENTIONS: [Function; 3] =
    [Function::FrameDerivatives, Function::FrameDerivativesInOwnAxes, Function::FrameDerivativesAtWorldOrigin];

fn motion(asked: &Asked, random: &mut Random) -> [Vec<f64>; 3] {
    let q = asked.configuration(random);
    let mut numbers = || (0..asked.nv()).map(|_| random.between(-2.0, 2.0)).collect::<Vec<f64>>();
    [q, numbers(), numbers()]
}

/// Six numbers of a motion of a frame's origin.
fn in_convention(function: Function, pose: &[Dd], linear: Vector3<Dd>, angular: Vector3<Dd>) -> DMatrix<Dd> {
    let (p, axes) = (Vector3::from_column_slice(&pose[..3]), Matrix3::from_row_slice(&pose[3..]).transpose());
    let [linear, angular] = match function {
        Function::FrameDerivativesInOwnAxes => [axes * linear, axes * angular],
        Function::FrameDerivativesAtWorldOrigin => [linear - angular.cross(&p), angular],
        _ => [linear, angular],
    };
    DMatrix::from_iterator(6, 1, linear.iter().chain(angular.iter()).copied())
}

/// v = J q̇, a = J q̈ + J̇ q̇ and ∂a/∂q̇ = ∂v/∂q + J̇, where v and a are those of the frame's origin in each convention.
#[test]
fn jacobians_and_their_rates_make_velocities_and_accelerations() {
    for asked in robots() {
        let [velocity, acceleration, poses] =
            [Function::FrameVelocity, Function::FrameAcceleration, Function::ForwardKinematics]
                .map(|function| asked.graph(function));
        let [q, qd, qdd] = motion(&asked, &mut Random(4));
        // a quaternion of f64 has length one to a rounding
        if asked.nv() != asked.robot.model.nq() {
            continue;
        }
        let [v, a] = [run::<Dd>(&velocity, &[&q, &qd]), run::<Dd>(&acceleration, &[&q, &qd, &qdd])]
            .map(|x| [0, 3].map(|row| Vector3::from_column_slice(&x[row..row + 3])));
        let pose = run::<Dd>(&poses, &[&q]);
        for function in CONVENTIONS {
            let graph = asked.graph(function);
            let all = blocks(&graph, &run::<Dd>(&graph, &[&q, &qd, &qdd]));
            let [dv_dq, _, da_dqd, j, j_dot] = [0, 1, 2, 3, 4].map(|k| matrix(6, &all[k]));
            let name = format!("{} of {}", function.name(), asked.name);
            let [rates, accelerations] = [&qd, &qdd].map(|x| wide(x));
            let by_velocity = &j * &rates;
            hold(&format!("{name}: v = J q̇"), &column(&by_velocity), &in_convention(function, &pose, v[0], v[1]));
            // the rate of the numbers of v: of the origin that moves along it is its acceleration
            let linear = match function {
                Function::FrameDerivatives => a[0],
                _ => a[0] - v[1].cross(&v[0]),
            };
            let found = &j * &accelerations + &j_dot * &rates;
            hold(&format!("{name}: a"), &column(&found), &in_convention(function, &pose, linear, a[1]));
            hold(&format!("{name}: ∂a/∂q̇"), &da_dqd, &(dv_dq + j_dot));
        }
    }
}

fn wide(x: &[f64]) -> DVector<Dd> {
    vector(&x.iter().map(|x| Dd::from(*x)).collect::<Vec<_>>())
}

fn column(x: &DVector<Dd>) -> DMatrix<Dd> {
    DMatrix::from_column_slice(x.len(), 1, x.as_slice())
}

/// The last joint moves the frame always in the same way as seen from there, whatever the robot does.
#[test]
fn the_column_of_the_last_joint_has_no_rate_in_the_axes_of_the_frame() {
    for asked in robots().into_iter().filter(|asked| asked.nv() == asked.robot.model.nq()) {
        let [q, qd, qdd] = motion(&asked, &mut Random(6));
        let graph = asked.graph(Function::FrameDerivativesInOwnAxes);
        let j_dot = blocks(&graph, &run::<Dd>(&graph, &[&q, &qd, &qdd])).remove(4);
        let last = asked.nv() - 1;
        // fingers stand behind a hand
        let moving = (0..=last).rev().find(|k| {
            let j = blocks(&graph, &run::<Dd>(&graph, &[&q, &qd, &qdd])).remove(3);
            (0..6).any(|row| j[row * asked.nv() + k] != Dd::ZERO)
        });
        let k = moving.expect("a joint moves the frame");
        assert!((0..6).all(|row| j_dot[row * asked.nv() + k] == Dd::ZERO), "{}", asked.name);
    }
}

/// Seen from the frame, nobody knows how far the first joint has turned.
#[test]
fn twists_in_the_axes_of_the_frame_do_not_depend_on_the_first_joint() {
    for asked in robots().into_iter().filter(|asked| asked.nv() == asked.robot.model.nq()) {
        let [mut q, qd, qdd] = motion(&asked, &mut Random(7));
        let graph = asked.graph(Function::FrameDerivativesInOwnAxes);
        let first = run::<Dd>(&graph, &[&q, &qd, &qdd]);
        q[0] += 0.7;
        assert_eq!(first, run::<Dd>(&graph, &[&q, &qd, &qdd]), "{}", asked.name);
    }
}
