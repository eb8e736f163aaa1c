//! Runs a tape step by step, over blocks of lanes: with the bits of machine code, wherever there is none.

use crate::number::Number;
use crate::tape::{CallBetween, ProgramTape, TapeAction, TapeOperand};

/// So many states are run at once.
pub const LANES: usize = 8;

/// States of one scalar.
pub type Block<T> = [T; LANES];

/// The results of these inputs, of all lanes: a block per scalar.
///
/// # Panics
/// If the numbers of blocks are not those of inputs and results.
pub fn run<T: Number>(tape: &ProgramTape<T>, inputs: &[Block<T>], results: &mut [Block<T>]) {
    assert_eq!((inputs.len(), results.len()), (tape.inputs, tape.results.len()), "a block per scalar");
    let mut values = vec![[T::default(); LANES]; tape.values];
    let read = |values: &[Block<T>], operand: TapeOperand| match operand {
        TapeOperand::Input(k) => inputs[k],
        TapeOperand::Constant(k) => [tape.constants[k]; LANES],
        TapeOperand::Value(k) => values[k],
    };
    for phase in &tape.phases {
        for call in &phase.calls {
            match call {
                CallBetween::SinCos { angles, values: [sine, cosine] } => {
                    let angle = sum_of_angles(angles.iter().map(|a| read(&values, *a)));
                    (values[*sine], values[*cosine]) = sin_cos(angle, tape.fused);
                }
                CallBetween::Sign { of, value } => values[*value] = read(&values, *of).map(T::sign),
            }
        }
        for step in &phase.steps {
            values[step.value] = match step.action {
                TapeAction::Root(a) => read(&values, a).map(T::sqrt),
                TapeAction::Negation(a) => read(&values, a).map(|x| -x),
                TapeAction::Fused { factors, negated, other, minus } => {
                    let ([x, y], c) = (factors.map(|x| read(&values, x)), read(&values, other));
                    let sign = |x: T, negated: bool| if negated { -x } else { x };
                    std::array::from_fn(|k| T::fused(sign(x[k], negated), y[k], sign(c[k], minus)))
                }
                TapeAction::Binary(op, a, b) => {
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

/// Sines and cosines of sums of angles in two pieces, lane by lane. Part of its caller, so that it is compiled for the caller's instructions.
#[inline(always)]
pub(crate) fn sin_cos<T: Number, const N: usize>(sums: [[T; 2]; N], fused: bool) -> ([T; N], [T; N]) {
    match fused {
        false => T::sin_cos_lanes_of_pairs(sums),
        true => T::fused_sin_cos(sums),
    }
}

/// The sum of these angles and what its rounding lost, lane by lane: as [`Real::sum_of_angles`](straightline_core::Real::sum_of_angles). Of one angle nothing is lost.
#[inline(always)]
pub(crate) fn sum_of_angles<T: Number, const N: usize>(mut terms: impl Iterator<Item = [T; N]>) -> [[T; 2]; N] {
    let mut sums = terms.next().expect("an angle has a term").map(|angle| [angle, T::zero()]);
    for term in terms {
        for ([sum, tail], angle) in sums.iter_mut().zip(term) {
            let next = *sum + angle;
            let added = next - *sum;
            *tail = *tail + ((*sum - (next - added)) + (angle - added));
            *sum = next;
        }
    }
    sums
}
