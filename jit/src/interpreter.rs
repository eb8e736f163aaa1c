//! Runs a tape step by step, over blocks of lanes: with the bits of machine code, wherever there is none.

use crate::number::Number;
use crate::tape::{Action, Call, Operand, Tape};

/// So many states are run at once.
pub const LANES: usize = 8;

/// States of one scalar.
pub type Block<T> = [T; LANES];

/// The results of these inputs, of all lanes: a block per scalar.
///
/// # Panics
/// If the numbers of blocks are not those of inputs and results.
pub fn run<T: Number>(tape: &Tape<T>, inputs: &[Block<T>], results: &mut [Block<T>]) {
    assert_eq!((inputs.len(), results.len()), (tape.inputs, tape.results.len()), "a block per scalar");
    let mut values = vec![[T::default(); LANES]; tape.values];
    let read = |values: &[Block<T>], operand: Operand| match operand {
        Operand::Input(k) => inputs[k],
        Operand::Constant(k) => [tape.constants[k]; LANES],
        Operand::Value(k) => values[k],
    };
    for phase in &tape.phases {
        for call in &phase.calls {
            match call {
                Call::SinCos { angles, values: [sine, cosine] } => {
                    let terms: Vec<Block<T>> = angles.iter().map(|a| read(&values, *a)).collect();
                    (values[*sine], values[*cosine]) = sin_cos(&terms);
                }
                Call::Sign { of, value } => values[*value] = read(&values, *of).map(T::sign),
            }
        }
        for step in &phase.steps {
            values[step.value] = match step.action {
                Action::Root(a) => read(&values, a).map(T::sqrt),
                Action::Negation(a) => read(&values, a).map(|x| -x),
                Action::Binary(op, a, b) => {
                    let (a, b) = (read(&values, a), read(&values, b));
                    std::array::from_fn(|k| op.value(a[k], b[k]))
                }
            };
        }
    }
    for (result, operand) in results.iter_mut().zip(&tape.results) {
        *result = read(&values, *operand);
    }
}

/// Sines and cosines of sums of angles, lane by lane.
pub(crate) fn sin_cos<T: Number, const N: usize>(terms: &[[T; N]]) -> ([T; N], [T; N]) {
    if let [angles] = terms {
        return T::sin_cos_lanes(*angles);
    }
    let sum_of_lane = |k: usize| {
        let angles: Vec<T> = terms.iter().map(|term| term[k]).collect();
        T::sum_of_angles(&angles)
    };
    T::sin_cos_lanes_of_pairs(std::array::from_fn(sum_of_lane))
}
