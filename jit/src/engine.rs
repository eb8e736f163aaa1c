//! A tape as it is executed on this machine: by machine code, or interpreted.

use crate::allocation::{AllocatedProgram, MemoryPlace};
use crate::between::PlacedCalls;
use crate::interpreter;
use crate::lines::LineNumbers;
use crate::machine::{Format, HostInstructions, SIGNS};
use crate::native::{NativeCode, NativeInstructions};
use crate::number::Number;
use crate::tape::{Phase, ProgramTape};
use std::{fmt, io};

/// How functions are executed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ExecutionMode {
    /// By these instructions.
    Native(HostInstructions),
    /// Step by step.
    Interpreted,
}

impl fmt::Display for ExecutionMode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            ExecutionMode::Native(set) => set.row().name,
            ExecutionMode::Interpreted => "interpreted",
        })
    }
}

impl ExecutionMode {
    /// All, the fastest first.
    pub const ALL: [ExecutionMode; 5] = {
        let [first, second, third, fourth] = HostInstructions::ALL;
        [
            ExecutionMode::Native(first),
            ExecutionMode::Native(second),
            ExecutionMode::Native(third),
            ExecutionMode::Native(fourth),
            ExecutionMode::Interpreted,
        ]
    };

    /// The fastest that this machine has.
    pub fn best() -> ExecutionMode {
        ExecutionMode::ALL.into_iter().find(|execution| execution.is_available()).unwrap_or(ExecutionMode::Interpreted)
    }

    /// Whether this machine has it.
    pub fn is_available(self) -> bool {
        match self {
            ExecutionMode::Native(set) => (set.row().is_here)(),
            ExecutionMode::Interpreted => true,
        }
    }
}

/// Where executable pages come from: as [`NativeCode::new`].
type Pages = fn(&[Vec<u8>], [usize; 2]) -> io::Result<NativeCode>;

/// A program that can be executed.
#[derive(Debug)]
pub struct Executable<T> {
    pub tape: ProgramTape<T>,
    /// For one state, and for as many as a vector holds; none: it is interpreted.
    code: Option<[MachineCode<T>; 2]>,
    execution: ExecutionMode,
}

impl<T: Number> Executable<T> {
    /// Interpreted, too, if the machine has no such instructions, or the system gives no memory that can be executed.
    pub fn new(tape: ProgramTape<T>, execution: ExecutionMode) -> Executable<T> {
        Executable::in_pages(tape, execution, NativeCode::new)
    }

    /// The same in pages that come from there.
    fn in_pages(tape: ProgramTape<T>, execution: ExecutionMode, pages: Pages) -> Executable<T> {
        let code = match execution {
            ExecutionMode::Native(set) if execution.is_available() && (!tape.fused || (set.row().fuses)()) => {
                let allocated = AllocatedProgram::new(&tape, set.row().registers);
                let format = |is_vector| Format { set, bytes: T::BYTES, is_vector };
                let code = |is_vector| MachineCode::new(&tape, &allocated, format(is_vector), pages).ok();
                code(false).zip(code(true)).map(|(one, several)| [one, several])
            }
            ExecutionMode::Native(_) | ExecutionMode::Interpreted => None,
        };
        let execution = if code.is_some() { execution } else { ExecutionMode::Interpreted };
        Executable { tape, code, execution }
    }

    pub fn execution(&self) -> ExecutionMode {
        self.execution
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

    /// Runs one state whose inputs are in the frame.
    pub fn run(&self, frame: &mut [T]) {
        match &self.code {
            Some([code, _]) => code.run_lanes::<1>(frame, code.instructions),
            None => self.interpret(frame),
        }
    }

    /// Runs a block of a batch, likewise, as part of a [`NativeJob`](crate::native::NativeJob). `N` is what [`Self::lanes`] says.
    #[inline(always)]
    pub fn run_block<const N: usize>(&self, frame: &mut [T]) {
        match &self.code {
            Some([_, code]) => code.run_lanes::<N>(frame, NativeInstructions::ANY),
            None => self.interpret(frame),
        }
    }

    fn interpret(&self, frame: &mut [T]) {
        let (inputs, results) = frame.split_at_mut(self.tape.inputs * interpreter::LANES);
        let results = &mut results.as_chunks_mut().0[..self.tape.results.len()];
        interpreter::run(&self.tape, inputs.as_chunks().0, results);
    }

    /// The instructions that blocks of a batch are performed by.
    pub fn instructions(&self) -> NativeInstructions {
        self.code.as_ref().map_or(NativeInstructions::ANY, |[_, code]| code.instructions)
    }

    /// The first lanes of the results of one state that was run.
    pub fn first_lanes(&self, frame: &[T], results: &mut [&mut [T]]) {
        match &self.code {
            Some([code, _]) => {
                let mut places = code.results.iter();
                for array in results {
                    array.iter_mut().zip(places.by_ref()).for_each(|(x, place)| *x = code.at(frame, *place)[0]);
                }
            }
            None => {
                let entries = results.iter_mut().flat_map(|array| array.iter_mut());
                entries.enumerate().for_each(|(k, x)| *x = self.result(frame, k, false)[0]);
            }
        }
    }

    /// The lanes of a result of a block of a batch that was run, as many as [`Self::lanes`] says.
    #[inline(always)]
    pub fn lanes_of_result<'a, const N: usize>(&'a self, frame: &'a [T], k: usize) -> &'a [T; N] {
        self.result(frame, k, true).try_into().expect("as many numbers as lanes")
    }

    /// The lanes of a result of a block that was run.
    #[inline(always)]
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

/// A program in instructions.
#[derive(Debug)]
struct MachineCode<T> {
    native: NativeCode,
    lanes: usize,
    frame_length: usize,
    /// Signs, then each constant in all lanes.
    constants: LineNumbers<T>,
    /// Of each phase, the calls before it and whether it has instructions.
    phases: Vec<(PlacedCalls, bool)>,
    results: Vec<MemoryPlace>,
    /// What blocks of a batch, and the sines of one state, are performed by.
    instructions: NativeInstructions,
    is_fused: bool,
}

impl<T: Number> MachineCode<T> {
    fn new(tape: &ProgramTape<T>, allocated: &AllocatedProgram, format: Format, pages: Pages) -> io::Result<Self> {
        let lanes = format.lanes();
        let constants = std::iter::repeat_n(T::minus_zero(), SIGNS * lanes)
            .chain(tape.constants.iter().flat_map(|c| std::iter::repeat_n(*c, lanes)));
        let constants = LineNumbers::new(constants, (SIGNS + tape.constants.len()) * lanes);
        let function = format.set.row().function;
        let functions: Vec<Vec<u8>> = allocated.phases.iter().map(|phase| function(phase, format)).collect();
        let frame_length = allocated.cells * lanes;
        let placed = |phase: &Phase| (PlacedCalls::new(&phase.calls, allocated), !phase.steps.is_empty());
        let phases = tape.phases.iter().map(placed).collect();
        let results = tape.results.iter().map(|operand| allocated.place(*operand)).collect();
        let native = pages(&functions, [frame_length, constants.len()])?;
        let (instructions, is_fused) = (NativeInstructions::best(), tape.fused);
        Ok(MachineCode { native, lanes, frame_length, constants, phases, results, instructions, is_fused })
    }
}

impl<T: Number> MachineCode<T> {
    #[inline(always)]
    fn at<'a>(&'a self, frame: &'a [T], place: MemoryPlace) -> &'a [T] {
        let (memory, at) = match place {
            MemoryPlace::Cell(cell) => (frame, cell),
            MemoryPlace::Constant(k) => (&*self.constants, k + SIGNS),
            MemoryPlace::MinusZero => (&*self.constants, 0),
        };
        &memory[at * self.lanes..][..self.lanes]
    }

    #[inline(always)]
    fn run_lanes<const N: usize>(&self, frame: &mut [T], by: NativeInstructions) {
        let read = |frame: &[T], place: MemoryPlace| -> [T; N] {
            self.at(frame, place).try_into().expect("as many numbers as lanes")
        };
        for (k, (calls, has_instructions)) in self.phases.iter().enumerate() {
            calls.run(frame, read, (by, self.is_fused));
            if *has_instructions {
                self.native.run(k, frame, &self.constants);
            }
        }
    }
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;
    use crate::tape::{OperationStep, TapeAction, TapeOperand};
    use straightline_graph::expr::Binary;

    /// Where the system gives no pages that can be executed, as under SELinux without `execmem`, functions are interpreted.
    pub fn without_executable_pages_it_is_interpreted() {
        let (a, b) = (TapeOperand::Input(0), TapeOperand::Constant(0));
        let steps = vec![OperationStep { action: TapeAction::Binary(Binary::Mul, a, b), value: 0 }];
        let phases = vec![Phase { calls: Vec::new(), steps }];
        let results = vec![TapeOperand::Value(0)];
        let tape = ProgramTape { inputs: 1, constants: vec![0.1], values: 1, phases, results, fused: false };
        let refused: Pages = |_, _| Err(io::Error::from(io::ErrorKind::PermissionDenied));
        let run = |executable: &Executable<f64>| {
            let mut frame = vec![0.0; executable.frame_length(false)];
            frame[..executable.lanes(false)].fill(0.3);
            executable.run(&mut frame);
            executable.result(&frame, 0, false)[0]
        };
        for execution in ExecutionMode::ALL {
            let interpreted = Executable::in_pages(tape.clone(), execution, refused);
            assert_eq!((interpreted.execution(), interpreted.code_bytes()), (ExecutionMode::Interpreted, 0));
            let wanted = Executable::new(tape.clone(), execution);
            assert!(wanted.execution() == execution || !execution.is_available());
            assert_eq!([run(&interpreted), run(&wanted)], [0.3 * 0.1; 2]);
        }
    }
}
