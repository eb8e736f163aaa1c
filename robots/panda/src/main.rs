//! The main example: the Panda's joint torques along a motion, by code that the derive makes of its URDF, each beside the torque of a
//! second, independent formulation in double-double (`build.rs`).
//!
//! ```text
//! cargo run --release -p straightline-panda-example
//! ```

mod motion;

use motion::{motion, N, SAMPLES};
use straightline::Dynamics;

#[derive(Dynamics)]
#[robot("../descriptions/panda.urdf", functions(inverse_dynamics, forward_kinematics), frames("panda_hand_tcp"))]
struct Panda;

include!(concat!(env!("OUT_DIR"), "/reference.rs"));

/// Torques at an instant, and how far each is from its reference \[N·m\].
fn compared(sample: usize) -> ([f64; N], [f64; N]) {
    let (_, [q, qd, qdd]) = motion(sample);
    let mut tau = [0.0; N];
    Panda::inverse_dynamics(&q, &qd, &qdd, &mut tau);
    let error = |i: usize| {
        let [high, low, _] = REFERENCE[sample][i];
        // both are near each other, so that this difference is exact
        (tau[i] - high) - low
    };
    (tau, std::array::from_fn(error))
}

/// The worst error of a joint, of the sum of the moduli of the torque's terms.
fn worst(joint: usize) -> f64 {
    (0..SAMPLES).map(|k| compared(k).1[joint].abs() / REFERENCE[k][joint][2]).fold(0.0, f64::max)
}

fn main() {
    let sample = SAMPLES / 3;
    let (time, [q, ..]) = motion(sample);
    let mut poses = [[0.0; 12]; 1];
    Panda::forward_kinematics(&q, &mut poses);
    let [x, y, z] = Panda::pose(&poses, Panda::PANDA_HAND_TCP).position;
    println!("The Panda after {time:.2} s of its motion, its hand at ({x:.3}, {y:.3}, {z:.3}) m:\n");
    println!("joint            torque [N·m]            reference              difference   worst of {SAMPLES}, scaled");
    let (tau, error) = compared(sample);
    for (i, joint) in Panda::JOINT_NAMES.iter().enumerate() {
        let reference = REFERENCE[sample][i][0];
        println!("{joint:<15} {:>21.16}  {reference:>21.16}  {:>12.1e}   {:>10.1e}", tau[i], error[i], worst(i));
    }
    let cost = Panda::INVERSE_DYNAMICS_COST;
    println!(
        "\n{} multiplications, {} additions; scaled: of the sum of the moduli of the torque's terms",
        cost.mul, cost.add
    );
}

/// An error of 1e-15 is five roundings of f64.
#[test]
fn torques_are_those_of_the_second_author() {
    for (i, joint) in Panda::JOINT_NAMES.iter().enumerate() {
        assert!(worst(i) < 1e-15, "{joint}: {:.1e}", worst(i));
    }
}
