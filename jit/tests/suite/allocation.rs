//! Instructions of few registers compute what the tape says.

use straightline_core::random::Random;
use straightline_graph::expr::Binary;
use straightline_jit::allocation::{AllocatedProgram, FusedForm, Instruction, MemoryPlace, ReadFrom};
use straightline_jit::tape::{OperationStep, Phase, ProgramTape, TapeAction, TapeOperand};

/// A tape of sums, products, roots and signs in two phases, with operands near and far.
pub fn random_tape(random: &mut Random) -> ProgramTape<f64> {
    let mut below = |n: usize| ((random.unit() * n as f64) as usize).min(n - 1);
    let (inputs, constants, steps) = (1 + below(5), 1 + below(4), 4 + below(120));
    let mut phases = vec![Phase::default(), Phase::default()];
    let second_from = below(steps);
    for value in 0..steps {
        let mut operand = || match below(8) {
            0 => TapeOperand::Input(below(inputs)),
            1 => TapeOperand::Constant(below(constants)),
            k if value > 0 && k < 6 => TapeOperand::Value(value - 1 - below(value.min(6))),
            _ if value > 0 => TapeOperand::Value(below(value)),
            _ => TapeOperand::Input(0),
        };
        let (a, b, other) = (operand(), operand(), operand());
        let action = match below(16) {
            0 => TapeAction::Root(a),
            1 => TapeAction::Negation(a),
            k @ 2..6 => TapeAction::Fused { factors: [a, b], negated: k % 2 == 0, other, minus: k > 3 },
            k => TapeAction::Binary(Binary::ALL[k % Binary::ALL.len()], a, b),
        };
        phases[usize::from(value >= second_from)].steps.push(OperationStep { action, value });
    }
    let results = (0..4).map(|_| TapeOperand::Value(below(steps)));
    let results = results.chain([TapeOperand::Input(0), TapeOperand::Constant(0)]).collect();
    let constants = (0..constants).map(|k| 0.7 + k as f64).collect();
    ProgramTape { inputs, constants, values: steps, phases, results, fused: true }
}

fn signed(x: f64, negated: bool) -> f64 {
    if negated {
        -x
    } else {
        x
    }
}

/// What the tape says.
fn by_steps(tape: &ProgramTape<f64>, inputs: &[f64]) -> Vec<f64> {
    let mut values = vec![f64::NAN; tape.values];
    let read = |values: &[f64], operand: TapeOperand| match operand {
        TapeOperand::Input(k) => inputs[k],
        TapeOperand::Constant(k) => tape.constants[k],
        TapeOperand::Value(k) => values[k],
    };
    for step in tape.phases.iter().flat_map(|phase| &phase.steps) {
        values[step.value] = match step.action {
            TapeAction::Binary(op, a, b) => op.value(read(&values, a), read(&values, b)),
            TapeAction::Root(a) => read(&values, a).sqrt(),
            TapeAction::Negation(a) => -read(&values, a),
            TapeAction::Fused { factors: [x, y], negated, other, minus } => {
                signed(read(&values, x), negated).mul_add(read(&values, y), signed(read(&values, other), minus))
            }
        };
    }
    tape.results.iter().map(|result| read(&values, *result)).collect()
}

/// What the instructions say; registers begin each phase with nothing in them.
fn by_instructions(
    tape: &ProgramTape<f64>,
    allocated: &AllocatedProgram,
    registers: usize,
    inputs: &[f64],
) -> Vec<f64> {
    let mut frame = vec![f64::NAN; allocated.cells];
    frame[..inputs.len()].copy_from_slice(inputs);
    let memory = |frame: &[f64], place: MemoryPlace| match place {
        MemoryPlace::Cell(k) => frame[k],
        MemoryPlace::Constant(k) => tape.constants[k],
        MemoryPlace::MinusZero => -0.0,
    };
    for phase in &allocated.phases {
        let mut held = vec![f64::NAN; registers];
        let source = |held: &[f64], frame: &[f64], source: ReadFrom| match source {
            ReadFrom::Register(k) => held[usize::from(k)],
            ReadFrom::Memory(place) => memory(frame, place),
        };
        for instruction in phase {
            match *instruction {
                Instruction::Load { to, from } => held[usize::from(to)] = memory(&frame, from),
                Instruction::Store { from, to } => frame[to] = held[usize::from(from)],
                Instruction::Binary { op, to, a, b } => {
                    held[usize::from(to)] = op.value(held[usize::from(a)], source(&held, &frame, b));
                }
                Instruction::Root { to, of } => held[usize::from(to)] = source(&held, &frame, of).sqrt(),
                Instruction::Negation { to, of } => held[usize::from(to)] = -held[usize::from(of)],
                Instruction::Copy { to, from } => held[usize::from(to)] = held[usize::from(from)],
                Instruction::Fused { form, to, a, b, negated, minus } => {
                    let (own, a, b) = (held[usize::from(to)], held[usize::from(a)], source(&held, &frame, b));
                    let (factor, term) = if form == FusedForm::IntoTerm { (b, own) } else { (own, b) };
                    held[usize::from(to)] = signed(a, negated).mul_add(factor, signed(term, minus));
                }
            }
        }
    }
    tape.results.iter().map(|result| memory(&frame, allocated.place(*result))).collect()
}

fn kept(tape: &ProgramTape<f64>) -> usize {
    tape.is_kept().into_iter().filter(|kept| *kept).count()
}

#[test]
fn spilt_values_come_back() {
    let mut random = Random(3);
    let mut spilt = 0;
    for case in 0..3000 {
        let tape = random_tape(&mut random);
        let registers = 4 + case % 14;
        let allocated = AllocatedProgram::new(&tape, registers);
        let inputs: Vec<f64> = (0..tape.inputs).map(|_| random.symmetric(2.0)).collect();
        let (wanted, found) = (by_steps(&tape, &inputs), by_instructions(&tape, &allocated, registers, &inputs));
        for (wanted, found) in wanted.iter().zip(&found) {
            assert!(wanted.to_bits() == found.to_bits() || wanted.is_nan() && found.is_nan(), "case {case}: {tape:?}");
        }
        let stores = allocated.phases.iter().flatten().filter(|i| matches!(i, Instruction::Store { .. })).count();
        spilt += stores - kept(&tape);
    }
    assert!(spilt > 1000, "values were spilt {spilt} times");
}

#[test]
fn nothing_is_written_that_fits() {
    let mut random = Random(5);
    for _ in 0..300 {
        let tape = random_tape(&mut random);
        assert_eq!(AllocatedProgram::new(&tape, 200).cells, tape.inputs + kept(&tape));
    }
}
