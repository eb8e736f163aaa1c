//! Random inputs of generated functions.

use crate::random::Random;
use straightline_codegen::function::{Function, Quantity};
use straightline_core::model::Model;
use straightline_core::Dd;

/// Random inputs of a function, in the order of its ports; quaternions have length one.
pub fn random(random: &mut Random, model: &Model<Dd>, function: Function) -> Vec<Vec<f64>> {
    random_with_frames(random, model, function, 0)
}

/// The same of a function that has so many frames.
pub fn random_with_frames(random: &mut Random, model: &Model<Dd>, function: Function, frames: usize) -> Vec<Vec<f64>> {
    let of_port = |quantity: Quantity| match quantity {
        quantity if quantity.is_configuration() => configuration(random, model),
        // so short that no base turns far
        Quantity::TimeStep => vec![random.between(0.0, 0.02)],
        quantity => random.list(quantity.len(model, frames), 2.0),
    };
    function.quantities(model).into_iter().map(of_port).collect()
}

fn configuration(random: &mut Random, model: &Model<Dd>) -> Vec<f64> {
    let mut q = random.list(model.nq(), 3.0);
    for joint in model.free_joints() {
        let Some(first) = joint.kind.row().quaternion else { continue };
        let quaternion = &mut q[joint.iq + first..][..4];
        let norm = quaternion.iter().map(|x| x * x).sum::<f64>().sqrt();
        quaternion.iter_mut().for_each(|x| *x /= norm);
    }
    q
}

/// Inputs as Rust, ready to paste into a test.
pub fn ready_to_paste(inputs: &[Vec<f64>]) -> String {
    format!("let inputs = vec!{inputs:?};").replace("], [", "], vec![").replacen("[[", "[vec![", 1)
}
