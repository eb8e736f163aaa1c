//! A function of a robot, for one state or for many.

use crate::batch::BatchLayout;
use crate::engine::{Executable, ExecutionMode};
use crate::number::Number;
use crate::tape::ProgramTape;
use std::fmt;
use straightline_codegen::program::TracedProgram;
use straightline_codegen::Function;
use straightline_graph::expr::{Counts, Port};

/// A function of a robot that can be called.
///
/// Inputs and results are those of the generated function of this name, in its order and units; matrices by rows.
#[derive(Debug)]
pub struct LoadedFunction<T> {
    function: Function,
    inputs: Vec<Port>,
    outputs: Vec<Port>,
    counts: Counts,
    executable: Executable<T>,
}

/// What is wrong with a call.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CallError {
    /// There are other inputs, or results, than the function has.
    Arrays {
        /// `inputs` or `results`.
        what: &'static str,
        /// As many as it has.
        expected: usize,
        /// As many as were given.
        found: usize,
    },
    /// An array is too short, or too long where there is one state.
    Length {
        /// The input or result.
        name: String,
        /// How long it has to be.
        expected: usize,
        /// How long it is.
        found: usize,
    },
    /// Results of different states or entries would be in one place.
    Overlap {
        /// The result.
        name: String,
        /// Its layout.
        layout: BatchLayout,
    },
}

impl fmt::Display for CallError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            CallError::Arrays { what, expected, found } => {
                write!(f, "{found} {what} are given, the function has {expected}")
            }
            CallError::Length { name, expected, found } => {
                write!(f, "`{name}` has {found} numbers, the function takes {expected}")
            }
            CallError::Overlap { name, layout: BatchLayout { by_state, by_entry } } => {
                write!(
                    f,
                    "results `{name}` would overlap: {by_state} from state to state, {by_entry} from entry to entry"
                )
            }
        }
    }
}

impl std::error::Error for CallError {}

impl<T: Number> LoadedFunction<T> {
    pub(crate) fn new(program: &TracedProgram, fused: bool, execution: ExecutionMode) -> LoadedFunction<T> {
        let graph = &program.graph;
        LoadedFunction {
            function: program.function,
            inputs: graph.inputs.clone(),
            outputs: graph.outputs.clone(),
            counts: graph.counts(),
            executable: Executable::new(ProgramTape::new(graph, &program.schedule, fused), execution),
        }
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        self.function.name()
    }

    /// What goes in, with shapes.
    pub fn inputs(&self) -> &[Port] {
        &self.inputs
    }

    /// What comes out, with shapes.
    pub fn outputs(&self) -> &[Port] {
        &self.outputs
    }

    /// The operations that it takes.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// How it is executed.
    pub fn execution(&self) -> ExecutionMode {
        self.executable.execution()
    }

    /// Bytes of machine code, for one state and for a vector of them; none where it is interpreted.
    pub fn code_bytes(&self) -> usize {
        self.executable.code_bytes()
    }

    /// For one state. Whoever calls it often takes a [`Runner`].
    ///
    /// # Errors
    /// If arrays are missing, or have not the lengths of the [inputs](Self::inputs) and [outputs](Self::outputs).
    pub fn call(&self, inputs: &[&[T]], results: &mut [&mut [T]]) -> Result<(), CallError> {
        self.runner().call(inputs, results)
    }

    /// What calls it without asking for memory.
    pub fn runner(&self) -> Runner<'_, T> {
        Runner { function: self, frame: vec![T::default(); self.executable.frame_length(false)] }
    }

    /// For many states, each array with its layout. Results have the bits of one call per state.
    ///
    /// # Errors
    /// As [`call`](Self::call), where arrays have to be as long as their layout asks; and if results would overlap.
    pub fn batch(
        &self,
        states: usize,
        inputs: &[(&[T], BatchLayout)],
        results: &mut [(&mut [T], BatchLayout)],
    ) -> Result<(), CallError> {
        expect_as_many("inputs", &self.inputs, inputs.len())?;
        expect_as_many("results", &self.outputs, results.len())?;
        for (port, (array, layout)) in self.inputs.iter().zip(inputs) {
            expect_length(port, *layout, states, array.len())?;
        }
        for (port, (array, layout)) in self.outputs.iter().zip(&*results) {
            if !layout.is_apart(states, port.len()) {
                return Err(CallError::Overlap { name: port.name.clone(), layout: *layout });
            }
            expect_length(port, *layout, states, array.len())?;
        }
        let lanes = self.executable.lanes(true);
        let mut frame = vec![T::default(); self.executable.frame_length(true)];
        for first in (0..states).step_by(lanes) {
            let mut at = 0;
            for (port, (array, layout)) in self.inputs.iter().zip(inputs) {
                let length = port.len() * lanes;
                layout.gather(array, [first, states], lanes, &mut frame[at..at + length]);
                at += length;
            }
            self.executable.run(&mut frame, true);
            let mut k = 0;
            for (port, (array, layout)) in self.outputs.iter().zip(&mut *results) {
                for entry in 0..port.len() {
                    layout.scatter(self.executable.result(&frame, k, true), [first, states], entry, array);
                    k += 1;
                }
            }
        }
        Ok(())
    }
}

/// Calls a function with memory of its own.
#[derive(Debug)]
pub struct Runner<'a, T> {
    function: &'a LoadedFunction<T>,
    frame: Vec<T>,
}

impl<T: Number> Runner<'_, T> {
    /// For one state.
    ///
    /// # Errors
    /// As [`LoadedFunction::call`].
    pub fn call(&mut self, inputs: &[&[T]], results: &mut [&mut [T]]) -> Result<(), CallError> {
        let LoadedFunction { inputs: taken, outputs, executable, .. } = self.function;
        expect_as_many("inputs", taken, inputs.len())?;
        expect_as_many("results", outputs, results.len())?;
        let lengths = taken.iter().zip(inputs.iter().map(|array| array.len()));
        for (port, found) in lengths.chain(outputs.iter().zip(results.iter().map(|array| array.len()))) {
            if found != port.len() {
                return Err(CallError::Length { name: port.name.clone(), expected: port.len(), found });
            }
        }
        let lanes = executable.lanes(false);
        let scalars = inputs.iter().flat_map(|array| array.iter());
        for (block, x) in self.frame.chunks_exact_mut(lanes).zip(scalars) {
            block.fill(*x);
        }
        executable.run(&mut self.frame, false);
        for (k, result) in results.iter_mut().flat_map(|array| array.iter_mut()).enumerate() {
            *result = executable.result(&self.frame, k, false)[0];
        }
        Ok(())
    }
}

fn expect_as_many(what: &'static str, ports: &[Port], found: usize) -> Result<(), CallError> {
    match found == ports.len() {
        true => Ok(()),
        false => Err(CallError::Arrays { what, expected: ports.len(), found }),
    }
}

fn expect_length(port: &Port, layout: BatchLayout, states: usize, found: usize) -> Result<(), CallError> {
    match layout.length(states, port.len()) {
        Some(expected) if expected <= found => Ok(()),
        expected => Err(CallError::Length { name: port.name.clone(), expected: expected.unwrap_or(usize::MAX), found }),
    }
}
