//! A tape as it is executed on this machine: by machine code, or interpreted.

use crate::allocation::{AllocatedTape, Place};
use crate::interpreter;
use crate::machine::x86::{self, Format, REGISTERS, SIGNS};
use crate::native::NativeCode;
use crate::number::Number;
use crate::tape::{Call, Operand, Tape};

/// How functions are executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Execution {
    /// By instructions of x86-64 with AVX.
    Avx,
    /// Step by step.
    Interpreted,
}

impl Execution {
    /// The fastest that this machine has.
    pub fn best() -> Execution {
        match Execution::Avx.is_available() {
            true => Execution::Avx,
            false => Execution::Interpreted,
        }
    }

    /// Whether this machine has it.
    pub fn is_available(self) -> bool {
        match self {
            Execution::Interpreted => true,
            #[cfg(target_arch = "x86_64")]
            Execution::Avx => std::arch::is_x86_feature_detected!("avx"),
            #[cfg(not(target_arch = "x86_64"))]
            Execution::Avx => false,
        }
    }
}

/// A program that can be executed.
#[derive(Debug)]
pub struct Executable<T> {
    pub tape: Tape<T>,
    /// For one state, and for as many as a vector holds; none: it is interpreted.
    code: Option<[MachineCode<T>; 2]>,
}

impl<T: Number> Executable<T> {
    /// Interpreted, too, if the machine has no such instructions, or the system gives no memory that can be executed.
    pub fn new(tape: Tape<T>, execution: Execution) -> Executable<T> {
        let code = match execution {
            Execution::Avx if execution.is_available() => {
                let allocated = AllocatedTape::new(&tape, REGISTERS);
                let code = |is_vector| MachineCode::new(&tape, &allocated, is_vector).ok();
                code(false).zip(code(true)).map(|(one, several)| [one, several])
            }
            Execution::Avx | Execution::Interpreted => None,
        };
        Executable { tape, code }
    }

    pub fn execution(&self) -> Execution {
        match self.code {
            Some(_) => Execution::Avx,
            None => Execution::Interpreted,
        }
    }

    /// Bytes of machine code.
    pub fn code_bytes(&self) -> usize {
        self.code.iter().flatten().map(|code| code.native.len()).sum()
    }

    /// How many states a block of a batch has.
    pub fn lanes(&self, is_batch: bool) -> usize {
        match &self.code {
            Some(code) => code[usize::from(is_batch)].lanes,
            None => interpreter::LANES,
        }
    }

    /// Numbers of a frame: inputs stand first, lanes of one scalar beside one another.
    pub fn frame_length(&self, is_batch: bool) -> usize {
        match &self.code {
            Some(code) => code[usize::from(is_batch)].frame_length,
            None => (self.tape.inputs + self.tape.results.len()) * interpreter::LANES,
        }
    }

    /// Runs a block of states whose inputs are in the frame.
    pub fn run(&self, frame: &mut [T], is_batch: bool) {
        match &self.code {
            Some(code) => code[usize::from(is_batch)].run(frame),
            None => {
                let (inputs, results) = frame.split_at_mut(self.tape.inputs * interpreter::LANES);
                interpreter::run(&self.tape, inputs.as_chunks().0, results.as_chunks_mut().0);
            }
        }
    }

    /// The lanes of a result of a block that was run.
    pub fn result<'a>(&'a self, frame: &'a [T], k: usize, is_batch: bool) -> &'a [T] {
        match &self.code {
            Some(code) => code[usize::from(is_batch)].at(frame, code[usize::from(is_batch)].results[k]),
            None => {
                let at = (self.tape.inputs + k) * interpreter::LANES;
                &frame[at..at + interpreter::LANES]
            }
        }
    }
}

/// A call of a program, by places in memory.
#[derive(Debug)]
struct PlacedCall {
    operands: Vec<Place>,
    /// Cells of what it makes: a sine and a cosine, or a sign.
    values: Vec<usize>,
}

/// A program in instructions.
#[derive(Debug)]
struct MachineCode<T> {
    native: NativeCode,
    lanes: usize,
    frame_length: usize,
    /// Signs, then each constant in all lanes.
    constants: Vec<T>,
    /// Of each phase, its calls and whether it has instructions.
    phases: Vec<(Vec<PlacedCall>, bool)>,
    results: Vec<Place>,
}

impl<T: Number> MachineCode<T> {
    fn new(tape: &Tape<T>, allocated: &AllocatedTape, is_vector: bool) -> std::io::Result<Self> {
        let format = Format { bytes: T::BYTES, is_vector };
        let lanes = format.lanes();
        let constants: Vec<T> = std::iter::repeat_n(T::minus_zero(), SIGNS * lanes)
            .chain(tape.constants.iter().flat_map(|c| std::iter::repeat_n(*c, lanes)))
            .collect();
        let functions: Vec<Vec<u8>> = allocated.phases.iter().map(|phase| x86::function(phase, format)).collect();
        let frame_length = allocated.cells * lanes;
        let cell = |value: &usize| match allocated.place(Operand::Value(*value)) {
            Place::Cell(cell) => cell,
            other => unreachable!("a value is in a cell: {other:?}"),
        };
        let placed = |call: &Call| PlacedCall {
            operands: call.operands().iter().map(|operand| allocated.place(*operand)).collect(),
            values: call.values().iter().map(cell).collect(),
        };
        let phases = tape.phases.iter().map(|p| (p.calls.iter().map(placed).collect(), !p.steps.is_empty())).collect();
        let results = tape.results.iter().map(|operand| allocated.place(*operand)).collect();
        let native = NativeCode::new(&functions, [frame_length, constants.len()])?;
        Ok(MachineCode { native, lanes, frame_length, constants, phases, results })
    }
}

impl<T: Number> MachineCode<T> {
    fn at<'a>(&'a self, frame: &'a [T], place: Place) -> &'a [T] {
        let (memory, at) = match place {
            Place::Cell(cell) => (frame, cell),
            Place::Constant(k) => (&*self.constants, k + SIGNS),
            Place::MinusZero => (&*self.constants, 0),
        };
        &memory[at * self.lanes..][..self.lanes]
    }

    fn run(&self, frame: &mut [T]) {
        match self.lanes {
            1 => self.run_lanes::<1>(frame),
            4 => self.run_lanes::<4>(frame),
            8 => self.run_lanes::<8>(frame),
            lanes => unreachable!("no vector has {lanes} numbers"),
        }
    }

    fn run_lanes<const N: usize>(&self, frame: &mut [T]) {
        for (k, (calls, has_instructions)) in self.phases.iter().enumerate() {
            for call in calls {
                let term = |frame: &[T], place: Place| -> [T; N] {
                    self.at(frame, place).try_into().expect("as many numbers as lanes")
                };
                let put = |frame: &mut [T], cell: usize, value: [T; N]| {
                    frame[cell * N..][..N].copy_from_slice(&value);
                };
                match (&call.values[..], &call.operands[..]) {
                    (&[sine, cosine], &[angle]) => {
                        let (s, c) = T::sin_cos_lanes(term(frame, angle));
                        put(frame, sine, s);
                        put(frame, cosine, c);
                    }
                    (&[sine, cosine], angles) => {
                        let terms: Vec<[T; N]> = angles.iter().map(|angle| term(frame, *angle)).collect();
                        let (s, c) = interpreter::sin_cos(&terms);
                        put(frame, sine, s);
                        put(frame, cosine, c);
                    }
                    (&[sign], &[of]) => {
                        let signs = term(frame, of).map(T::sign);
                        put(frame, sign, signs);
                    }
                    (values, operands) => unreachable!("no call makes {} of {}", values.len(), operands.len()),
                }
            }
            if *has_instructions {
                self.native.run(k, frame, &self.constants);
            }
        }
    }
}
