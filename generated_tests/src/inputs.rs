//! Random inputs of generated functions.

use crate::random::Random;
use straightline_codegen::Function;
use straightline_core::model::Model;
use straightline_core::Dd;

/// Random inputs of a function, in the order of its ports; the quaternion of a floating base has length one.
pub fn random(random: &mut Random, model: &Model<Dd>, function: Function) -> Vec<Vec<f64>> {
    let floating = model.floats();
    function
        .inputs(model)
        .iter()
        .map(|port| match port.name.as_str() {
            "q" => random.configuration(port.len(), floating),
            _ => random.list(port.len(), 2.0),
        })
        .collect()
}

/// Inputs as Rust, ready to paste into a test.
pub fn ready_to_paste(inputs: &[Vec<f64>]) -> String {
    format!("let inputs = vec!{inputs:?};").replace("], [", "], vec![").replacen("[[", "[vec![", 1)
}
