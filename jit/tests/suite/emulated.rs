//! Machine code of aarch64 has the bits of the interpreter, on whatever machine: emulated. Sines and signs between phases are computed here.

use super::allocation::random_tape;
use super::bits::{any, are_same, random_robot, TestFile, TestNumber, DYNAMICS, ENDS, ROBOTS};
use super::emulator::Emulator;
use straightline_codegen::compile::compile_programs;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::options::Options;
use straightline_codegen::Function;
use straightline_core::random::Random;
use straightline_graph::expr::Binary;
use straightline_jit::allocation::{AllocatedProgram, FusedForm, Instruction, MemoryPlace, ReadFrom};
use straightline_jit::interpreter::{self, LANES};
use straightline_jit::machine::aarch64::function;
use straightline_jit::machine::{Format, HostInstructions, SIGNS};
use straightline_jit::tape::{CallBetween, OperationStep, Phase, ProgramTape, TapeAction, TapeOperand};

fn format<T: TestNumber>(is_vector: bool) -> Format {
    Format { set: HostInstructions::Neon, bytes: T::BYTES, is_vector }
}

/// Sine and cosine of a sum of angles, as the interpreter has them.
fn sin_cos<T: TestNumber>(angles: &[T], fused: bool) -> [T; 2] {
    let ([sine], [cosine]) = match (angles, fused) {
        ([angle], false) => T::sin_cos_lanes([*angle]),
        (_, false) => T::sin_cos_lanes_of_pairs([T::sum_of_angles(angles)]),
        ([angle], true) => T::fused_sin_cos([[*angle, T::zero()]]),
        (_, true) => T::fused_sin_cos([T::sum_of_angles(angles)]),
    };
    [sine, cosine]
}

/// The results of these states, by machine code for so many registers.
fn by_machine_code<T: TestNumber>(
    emulator: &Emulator,
    tape: &ProgramTape<T>,
    (registers, is_vector): (usize, bool),
    states: &[Vec<T>],
) -> Vec<Vec<T>> {
    let (format, allocated) = (format::<T>(is_vector), AllocatedProgram::new(tape, registers));
    let (lanes, length) = (format.lanes(), allocated.cells * format.lanes());
    let all_lanes = |x: &T| vec![*x; lanes];
    let constants: Vec<T> = [T::minus_zero(); SIGNS].iter().chain(&tape.constants).flat_map(all_lanes).collect();
    // what nothing has written is no number
    let mut frames = vec![T::of(f64::NAN); states.len().div_ceil(lanes) * length];
    for (i, state) in states.iter().enumerate() {
        for (k, x) in state.iter().enumerate() {
            frames[i / lanes * length + k * lanes + i % lanes] = *x;
        }
    }
    let read = |frame: &[T], lane: usize, operand: TapeOperand| match allocated.place(operand) {
        MemoryPlace::Cell(cell) => frame[cell * lanes + lane],
        MemoryPlace::Constant(k) => tape.constants[k],
        MemoryPlace::MinusZero => unreachable!("no operand is there"),
    };
    let put = |frame: &mut [T], lane: usize, value: usize, x: T| match allocated.place(TapeOperand::Value(value)) {
        MemoryPlace::Cell(cell) => frame[cell * lanes + lane] = x,
        other => unreachable!("a value is in a cell: {other:?}"),
    };
    for (phase, instructions) in tape.phases.iter().zip(&allocated.phases) {
        for frame in frames.chunks_mut(length) {
            for (lane, call) in (0..lanes).flat_map(|lane| phase.calls.iter().map(move |call| (lane, call))) {
                let operands: Vec<T> = call.operands().iter().map(|operand| read(frame, lane, *operand)).collect();
                match call {
                    CallBetween::SinCos { values, .. } => {
                        let made = sin_cos(&operands, tape.fused);
                        values.iter().zip(made).for_each(|(value, x)| put(frame, lane, *value, x));
                    }
                    CallBetween::Sign { value, .. } => put(frame, lane, *value, operands[0].sign()),
                }
            }
        }
        if !instructions.is_empty() {
            frames = emulator.run(&function(instructions, format), &constants, &frames, length);
        }
    }
    let results = |i: usize| {
        let frame = &frames[i / lanes * length..][..length];
        tape.results.iter().map(|result| read(frame, i % lanes, *result)).collect()
    };
    (0..states.len()).map(results).collect()
}

fn by_interpreter<T: TestNumber>(tape: &ProgramTape<T>, state: &[T]) -> Vec<T> {
    let inputs: Vec<[T; LANES]> = state.iter().map(|x| [*x; LANES]).collect();
    let mut results = vec![[T::default(); LANES]; tape.results.len()];
    interpreter::run(tape, &inputs, &mut results);
    results.iter().map(|lanes| lanes[0]).collect()
}

/// For one state and for vectors, with so many registers.
fn same_bits<T: TestNumber>(
    emulator: &Emulator,
    tape: &ProgramTape<T>,
    states: &[Vec<T>],
    registers: &[usize],
    what: &str,
) {
    let wanted: Vec<Vec<T>> = states.iter().map(|state| by_interpreter(tape, state)).collect();
    for way in registers.iter().flat_map(|registers| [(*registers, false), (*registers, true)]) {
        let found = by_machine_code(emulator, tape, way, states);
        for (i, (found, wanted)) in found.iter().zip(&wanted).enumerate() {
            are_same(found, wanted, &format!("{what} in {:?}, {way:?}, fused {}, state {i}", T::SCALAR, tape.fused));
        }
    }
}

/// Some numbers, half of them at the ends of what there is.
fn extremes<T: TestNumber>(random: &mut Random, count: usize) -> Vec<T> {
    let one = |random: &mut Random| match random.below(2) {
        0 => T::of(ENDS[random.below(ENDS.len())]),
        _ => any(random),
    };
    (0..count).map(|_| one(random)).collect()
}

#[test]
fn random_programs_have_the_bits_of_the_interpreter_on_aarch64() {
    let Some(emulator) = Emulator::find() else { return };
    let mut random = Random(23);
    for case in 0..12 {
        let tape = random_tape(&mut random);
        let states: Vec<Vec<f64>> = (0..9).map(|_| extremes(&mut random, tape.inputs)).collect();
        let registers = [HostInstructions::Neon.row().registers, 4 + case % 6];
        same_bits(&emulator, &tape, &states, &registers, &format!("case {case}"));
        let ProgramTape { inputs, constants, values, phases, results, fused } = tape;
        let constants = constants.iter().map(|c| *c as f32).collect();
        let tape = ProgramTape { inputs, constants, values, phases, results, fused };
        let states: Vec<Vec<f32>> = (0..9).map(|_| extremes(&mut random, tape.inputs)).collect();
        same_bits(&emulator, &tape, &states, &registers, &format!("case {case}"));
    }
}

/// ±x·y ± z, by every form, in registers that are the same or not and from memory: the sign of zero, too, is that of one rounding.
fn fused_forms_are_exact<T: TestNumber>(emulator: &Emulator) {
    let numbers = ENDS.into_iter().chain([1.0, -1.0, 0.1, 3.0, -1e-320]).map(T::of).collect::<Vec<T>>();
    let count = numbers.len();
    let states: Vec<[T; 3]> = (0..count.pow(3)).map(|k| [0, 1, 2].map(|p| numbers[k / count.pow(p) % count])).collect();
    let mut cases = Vec::new();
    for (form, to, a) in [FusedForm::IntoTerm, FusedForm::IntoFactor]
        .into_iter()
        .flat_map(|form| (0..9).map(move |k: u8| (form, k / 3, k % 3)))
    {
        let sources = [0, 1, 2].map(ReadFrom::Register).into_iter().chain([ReadFrom::Memory(MemoryPlace::Cell(2))]);
        cases.extend(sources.flat_map(|b| (0..4).map(move |k| (form, to, a, b, [k & 1 != 0, k > 1]))));
    }
    let mut instructions = Vec::new();
    for (k, (form, to, a, b, [negated, minus])) in cases.iter().copied().enumerate() {
        instructions.extend([0, 1, 2].map(|k| Instruction::Load { to: k, from: MemoryPlace::Cell(k.into()) }));
        instructions.push(Instruction::Fused { form, to, a, b, negated, minus });
        instructions.push(Instruction::Store { from: to, to: 3 + k });
    }
    let cells = 3 + cases.len();
    for format in [false, true].map(format::<T>) {
        let lanes = format.lanes();
        let mut frames = Vec::new();
        for state in &states {
            frames.extend(state.iter().flat_map(|x| vec![*x; lanes]));
            frames.resize(frames.len() + cases.len() * lanes, T::zero());
        }
        let frames = emulator.run(&function(&instructions, format), &[], &frames, cells * lanes);
        for (state, frame) in states.iter().zip(frames.chunks(cells * lanes)) {
            for (case, found) in cases.iter().zip(frame[3 * lanes..].chunks(lanes)) {
                let (form, to, a, b, [negated, minus]) = *case;
                let register = |k: u8| state[usize::from(k)];
                let b = if let ReadFrom::Register(b) = b { register(b) } else { state[2] };
                let (factor, term) = if form == FusedForm::IntoTerm { (b, register(to)) } else { (register(to), b) };
                let sign = |x: T, changes: bool| if changes { -x } else { x };
                let wanted = T::fused(sign(register(a), negated), factor, sign(term, minus));
                let is_same = found.iter().all(|x| x.bits() == wanted.bits() || x.is_nan() && wanted.is_nan());
                assert!(is_same, "{case:?} of {state:?}, {format:?}: {found:?}, not {wanted:?}");
            }
        }
    }
}

#[test]
fn products_and_sums_have_one_rounding_on_aarch64() {
    let Some(emulator) = Emulator::find() else { return };
    fused_forms_are_exact::<f64>(&emulator);
    fused_forms_are_exact::<f32>(&emulator);
}

/// Inputs so many that the last ones have no place in an instruction, nor in sixteen bits.
#[test]
fn far_places_are_reached_on_aarch64() {
    let Some(emulator) = Emulator::find() else { return };
    let inputs = 70_000;
    let ends = [0, 1, 4095, 4096, 65_535, 65_536, inputs - 1];
    let steps: Vec<OperationStep> = (1..ends.len())
        .map(|k| {
            let action = TapeAction::Binary(Binary::Sub, TapeOperand::Input(ends[k]), TapeOperand::Input(ends[k - 1]));
            OperationStep { action, value: k - 1 }
        })
        .collect();
    let (values, results) = (steps.len(), (0..steps.len()).map(TapeOperand::Value).collect());
    let phases = vec![Phase { calls: Vec::new(), steps }];
    let tape = ProgramTape { inputs, constants: Vec::new(), values, phases, results, fused: false };
    let state = |scale: f64| (0..inputs).map(|k| (k as f64 * 0.7).sin() * scale).collect();
    same_bits(&emulator, &tape, &[state(1.0), state(3.0), state(-2.0)], &[4], "far places");
}

/// These functions of a robot, plain and fused.
fn robots_have_the_same_bits<T: TestNumber>(
    emulator: &Emulator,
    (name, text, floating_base): TestFile<'_>,
    functions: &[Function],
    states: usize,
) {
    let model = ModelOptions { floating_base, ..ModelOptions::default() };
    let options = Options { model, functions: functions.to_vec(), scalar: T::SCALAR, ..Options::default() };
    let compiled = compile_programs(&Source::new(name, text), &options);
    let compiled = compiled.unwrap_or_else(|e| panic!("{}", e.render()));
    let (mut random, registers) = (Random(29), [HostInstructions::Neon.row().registers]);
    for (program, fused) in compiled.programs.iter().flat_map(|program| [(program, false), (program, true)]) {
        let tape = ProgramTape::<T>::new(&program.graph, &program.schedule, fused);
        let states: Vec<Vec<T>> = (0..states).map(|_| (0..tape.inputs).map(|_| any(&mut random)).collect()).collect();
        same_bits(emulator, &tape, &states, &registers, &format!("{name}, {}", program.function.name()));
    }
}

#[test]
fn dynamics_have_the_bits_of_the_interpreter_on_aarch64() {
    let Some(emulator) = Emulator::find() else { return };
    let [ur5, solo, fourbar, balls] = ROBOTS;
    robots_have_the_same_bits::<f64>(&emulator, ur5, &DYNAMICS, 21);
    robots_have_the_same_bits::<f32>(&emulator, ur5, &DYNAMICS[..2], 21);
    robots_have_the_same_bits::<f64>(&emulator, solo, &DYNAMICS[..1], 21);
    robots_have_the_same_bits::<f32>(&emulator, solo, &DYNAMICS[..1], 21);
    robots_have_the_same_bits::<f64>(&emulator, fourbar, &DYNAMICS[..2], 21);
    robots_have_the_same_bits::<f32>(&emulator, balls, &DYNAMICS[..2], 21);
}

#[test]
fn phases_with_calls_in_between_have_the_bits_of_the_interpreter_on_aarch64() {
    let Some(emulator) = Emulator::find() else { return };
    let named = |name: &str| Function::known().find(|f| f.name() == name).expect("there is such a function");
    let [ur5, _, fourbar, balls] = ROBOTS;
    robots_have_the_same_bits::<f64>(&emulator, fourbar, &[named("close_loops")], 13);
    robots_have_the_same_bits::<f64>(&emulator, balls, &[named("semi_implicit_step")], 13);
    let rubbing = ur5.1.replacen("</joint>", "<dynamics friction=\"0.3\" damping=\"0.1\"/></joint>", 3);
    robots_have_the_same_bits::<f64>(&emulator, ("rubbing.urdf", &rubbing, false), &DYNAMICS[..1], 13);
}

#[test]
fn random_robots_have_the_bits_of_the_interpreter_on_aarch64() {
    let Some(emulator) = Emulator::find() else { return };
    let mut random = Random(31);
    for _ in 0..2 {
        let (text, floats) = (random_robot(&mut random), random.unit() < 0.3);
        let robot = ("random.urdf", &text[..], floats);
        robots_have_the_same_bits::<f64>(&emulator, robot, &[Function::InverseDynamics, Function::ForwardDynamics], 9);
        robots_have_the_same_bits::<f32>(&emulator, robot, &[Function::MassMatrix], 9);
    }
}
