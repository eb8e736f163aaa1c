//! Instructions of few registers compute what the tape says.

use straightline_core::random::Random;
use straightline_graph::expr::Binary;
use straightline_jit::allocation::{AllocatedTape, Instruction, Place, Source};
use straightline_jit::tape::{Action, Operand, Phase, Tape, TapeStep};

/// A tape of sums, products, roots and signs in two phases, with operands near and far.
fn random_tape(random: &mut Random) -> Tape<f64> {
    let mut below = |n: usize| ((random.unit() * n as f64) as usize).min(n - 1);
    let (inputs, constants, steps) = (1 + below(5), 1 + below(4), 4 + below(120));
    let mut phases = vec![Phase::default(), Phase::default()];
    let second_from = below(steps);
    for value in 0..steps {
        let mut operand = || match below(8) {
            0 => Operand::Input(below(inputs)),
            1 => Operand::Constant(below(constants)),
            k if value > 0 && k < 6 => Operand::Value(value - 1 - below(value.min(6))),
            _ if value > 0 => Operand::Value(below(value)),
            _ => Operand::Input(0),
        };
        let (a, b) = (operand(), operand());
        let action = match below(12) {
            0 => Action::Root(a),
            1 => Action::Negation(a),
            k => Action::Binary(Binary::ALL[k % Binary::ALL.len()], a, b),
        };
        phases[usize::from(value >= second_from)].steps.push(TapeStep { action, value });
    }
    let results = (0..4).map(|_| Operand::Value(below(steps)));
    let results = results.chain([Operand::Input(0), Operand::Constant(0)]).collect();
    let constants = (0..constants).map(|k| 0.7 + k as f64).collect();
    Tape { inputs, constants, values: steps, phases, results }
}

/// What the tape says.
fn by_steps(tape: &Tape<f64>, inputs: &[f64]) -> Vec<f64> {
    let mut values = vec![f64::NAN; tape.values];
    let read = |values: &[f64], operand: Operand| match operand {
        Operand::Input(k) => inputs[k],
        Operand::Constant(k) => tape.constants[k],
        Operand::Value(k) => values[k],
    };
    for step in tape.phases.iter().flat_map(|phase| &phase.steps) {
        values[step.value] = match step.action {
            Action::Binary(op, a, b) => op.value(read(&values, a), read(&values, b)),
            Action::Root(a) => read(&values, a).sqrt(),
            Action::Negation(a) => -read(&values, a),
        };
    }
    tape.results.iter().map(|result| read(&values, *result)).collect()
}

/// What the instructions say; registers begin each phase with nothing in them.
fn by_instructions(tape: &Tape<f64>, allocated: &AllocatedTape, registers: usize, inputs: &[f64]) -> Vec<f64> {
    let mut frame = vec![f64::NAN; allocated.cells];
    frame[..inputs.len()].copy_from_slice(inputs);
    let memory = |frame: &[f64], place: Place| match place {
        Place::Cell(k) => frame[k],
        Place::Constant(k) => tape.constants[k],
        Place::MinusZero => -0.0,
    };
    for phase in &allocated.phases {
        let mut held = vec![f64::NAN; registers];
        let source = |held: &[f64], frame: &[f64], source: Source| match source {
            Source::Register(k) => held[usize::from(k)],
            Source::Memory(place) => memory(frame, place),
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
            }
        }
    }
    tape.results.iter().map(|result| memory(&frame, allocated.place(*result))).collect()
}

fn kept(tape: &Tape<f64>) -> usize {
    tape.is_kept().into_iter().filter(|kept| *kept).count()
}

#[test]
fn spilt_values_come_back() {
    let mut random = Random(3);
    let mut spilt = 0;
    for case in 0..3000 {
        let tape = random_tape(&mut random);
        let registers = 3 + case % 14;
        let allocated = AllocatedTape::new(&tape, registers);
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
        assert_eq!(AllocatedTape::new(&tape, 200).cells, tape.inputs + kept(&tape));
    }
}
