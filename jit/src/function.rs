//! A function of a robot, for one state or for many.

use crate::batch::BatchLayout;
use crate::engine::{Executable, ExecutionMode};
use crate::lines::LineNumbers;
use crate::native::{NativeInstructions, NativeJob};
use crate::number::Number;
use crate::tape::ProgramTape;
use std::fmt;
use std::sync::Mutex;
use straightline_codegen::program::TracedProgram;
use straightline_graph::expr::{Counts, Graph, Port, Sines};
use straightline_graph::schedule::{schedule, Schedule, ScheduleLimits};

/// A function of a robot that can be called.
///
/// Inputs and results are those of the generated function of this name, in its order and units; matrices by rows.
#[derive(Debug)]
pub struct LoadedFunction<T> {
    name: &'static str,
    inputs: Vec<Port>,
    outputs: Vec<Port>,
    counts: Counts,
    executable: Executable<T>,
    /// The frame of a call of one state that has ended, for the next one; empty while it is in use.
    spare: Mutex<Vec<T>>,
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
    /// Of a program, as fast as this machine can execute it, with products and sums in one rounding where they are `fused`; none of a program
    /// that only texts have: in mixed precision, or with short sines.
    pub fn of_program(program: &TracedProgram, fused: bool) -> Option<LoadedFunction<T>> {
        let is_plain = program.graph.formats.is_empty() && program.graph.sines == Sines::Precise;
        is_plain.then(|| LoadedFunction::new(program, fused, ExecutionMode::best()))
    }

    pub(crate) fn new(program: &TracedProgram, fused: bool, execution: ExecutionMode) -> LoadedFunction<T> {
        LoadedFunction::of(program.function.name(), (&program.graph, &program.schedule), fused, execution)
    }

    /// Of a graph that is none of the compiler's functions, as fast as this machine can execute it. Products and sums are rounded one by one.
    ///
    /// # Panics
    /// If the graph is in mixed precision or has short sines.
    pub fn of_graph(name: &'static str, graph: &Graph) -> LoadedFunction<T> {
        assert!(graph.sines == Sines::Precise, "short sines are for microcontrollers");
        let schedule = schedule(graph, ScheduleLimits::default(), None);
        LoadedFunction::of(name, (graph, &schedule), false, ExecutionMode::best())
    }

    fn of(
        name: &'static str,
        (graph, schedule): (&Graph, &Schedule),
        fused: bool,
        execution: ExecutionMode,
    ) -> LoadedFunction<T> {
        LoadedFunction {
            name,
            inputs: graph.inputs.clone(),
            outputs: graph.outputs.clone(),
            counts: graph.counts(),
            executable: T::executable((graph, schedule), fused, execution),
            spare: Mutex::default(),
        }
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        self.name
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

    /// For one state. Whoever calls it often, and from several threads, takes a [`Runner`] each.
    ///
    /// # Errors
    /// If arrays are missing, or have not the lengths of the [inputs](Self::inputs) and [outputs](Self::outputs).
    pub fn call(&self, inputs: &[&[T]], results: &mut [&mut [T]]) -> Result<(), CallError> {
        self.runner().call(inputs, results)
    }

    /// For one state: all results, one behind the other, in memory of their own.
    ///
    /// # Errors
    /// As [`call`](Self::call).
    pub fn results(&self, inputs: &[&[T]]) -> Result<Vec<T>, CallError> {
        let mut found = vec![T::default(); self.outputs.iter().map(Port::len).sum()];
        let mut rest = &mut found[..];
        let mut results = Vec::with_capacity(self.outputs.len());
        for port in &self.outputs {
            let (own, others) = rest.split_at_mut(port.len());
            results.push(own);
            rest = others;
        }
        self.call(inputs, &mut results)?;
        Ok(found)
    }

    /// What calls it without asking for memory.
    pub fn runner(&self) -> Runner<'_, T> {
        // what a frame has from a call before is written anew before it is read; who comes second takes memory
        let spare = self.spare.try_lock().map(|mut spare| std::mem::take(&mut *spare)).unwrap_or_default();
        let length = self.executable.frame_length(false);
        let frame = if spare.len() == length { spare } else { vec![T::default(); length] };
        Runner { function: self, frame }
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
        self.expect_arrays(states, inputs, results)?;
        T::run_states(self, states, inputs, results);
        Ok(())
    }

    /// The same by so many threads at most. Results have the same bits.
    ///
    /// # Errors
    /// As [`batch`](Self::batch).
    pub fn batch_in_threads(
        &self,
        threads: usize,
        states: usize,
        inputs: &[(&[T], BatchLayout)],
        results: &mut [(&mut [T], BatchLayout)],
    ) -> Result<(), CallError> {
        self.expect_arrays(states, inputs, results)?;
        let lanes = self.executable.lanes(true);
        let each = states.div_ceil(threads.max(1)).next_multiple_of(lanes);
        if threads <= 1 || each >= states {
            T::run_states(self, states, inputs, results);
            return Ok(());
        }
        let mut parts = self.parts(each, states, inputs, results);
        std::thread::scope(|scope| {
            for part in &mut parts {
                scope.spawn(|| {
                    let mut results: Vec<_> = part.results.iter_mut().map(ThreadResult::array).collect();
                    T::run_states(self, part.states, &part.inputs, &mut results);
                });
            }
        });
        let own: Vec<_> = parts.into_iter().flat_map(StatesOfThread::own_results).collect();
        for (first, k, own, entries) in own {
            let (array, BatchLayout { by_state, by_entry }) = &mut results[k];
            for (i, x) in own.into_iter().enumerate() {
                array[(first + i / entries) * *by_state + i % entries * *by_entry] = x;
            }
        }
        Ok(())
    }

    /// What threads do that take so many states each.
    fn parts<'a>(
        &self,
        each: usize,
        states: usize,
        inputs: &[(&'a [T], BatchLayout)],
        results: &'a mut [(&mut [T], BatchLayout)],
    ) -> Vec<StatesOfThread<'a, T>> {
        let mut parts: Vec<StatesOfThread<'a, T>> = Vec::new();
        for first in (0..states).step_by(each) {
            let from = |(array, layout): &(&'a [T], BatchLayout)| (first * layout.by_state).min(array.len());
            let inputs = inputs.iter().map(|input| (&input.0[from(input)..], input.1)).collect();
            parts.push(StatesOfThread { first, states: each.min(states - first), inputs, results: Vec::new() });
        }
        for ((array, layout), port) in results.iter_mut().zip(&self.outputs) {
            let (layout, entries) = (*layout, port.len());
            // states that lie one behind the other are written where they belong; others are copied there
            let is_by_state = layout.length(1, entries).is_some_and(|length| length <= layout.by_state);
            let mut rest: &mut [T] = array;
            for part in &mut parts {
                part.results.push(match is_by_state {
                    true => {
                        let (mine, others) = rest.split_at_mut((part.states * layout.by_state).min(rest.len()));
                        rest = others;
                        ThreadResult::InPlace(mine, layout)
                    }
                    false => ThreadResult::Own(vec![T::default(); part.states * entries], entries),
                });
            }
        }
        parts
    }

    fn expect_arrays(
        &self,
        states: usize,
        inputs: &[(&[T], BatchLayout)],
        results: &[(&mut [T], BatchLayout)],
    ) -> Result<(), CallError> {
        expect_as_many("inputs", &self.inputs, inputs.len())?;
        expect_as_many("results", &self.outputs, results.len())?;
        for (port, (array, layout)) in self.inputs.iter().zip(inputs) {
            expect_length(port, *layout, states, array.len())?;
        }
        for (port, (array, layout)) in self.outputs.iter().zip(results) {
            if !layout.is_apart(states, port.len()) {
                return Err(CallError::Overlap { name: port.name.clone(), layout: *layout });
            }
            expect_length(port, *layout, states, array.len())?;
        }
        Ok(())
    }
}

/// What a thread computes of a batch.
struct StatesOfThread<'a, T> {
    first: usize,
    states: usize,
    inputs: Vec<(&'a [T], BatchLayout)>,
    results: Vec<ThreadResult<'a, T>>,
}

impl<T> StatesOfThread<'_, T> {
    /// The results that are still to be copied: from which state on, which, and how many entries of a state.
    fn own_results(self) -> impl Iterator<Item = (usize, usize, Vec<T>, usize)> {
        let own = |(k, result)| match result {
            ThreadResult::Own(own, entries) => Some((k, own, entries)),
            ThreadResult::InPlace(..) => None,
        };
        let own: Vec<_> = self.results.into_iter().enumerate().filter_map(own).collect();
        own.into_iter().map(move |(k, own, entries)| (self.first, k, own, entries))
    }
}

/// Where a thread writes a result.
enum ThreadResult<'a, T> {
    /// Into its part of the array.
    InPlace(&'a mut [T], BatchLayout),
    /// Into memory of its own, so many entries of each state.
    Own(Vec<T>, usize),
}

impl<T> ThreadResult<'_, T> {
    fn array(&mut self) -> (&mut [T], BatchLayout) {
        match self {
            ThreadResult::InPlace(array, layout) => (array, *layout),
            ThreadResult::Own(own, entries) => (own, BatchLayout::states_of(*entries)),
        }
    }
}

/// Calls a function with memory of its own.
#[derive(Debug)]
pub struct Runner<'a, T> {
    function: &'a LoadedFunction<T>,
    frame: Vec<T>,
}

/// Leaves its memory to the next one.
impl<T> Drop for Runner<'_, T> {
    fn drop(&mut self) {
        if let Ok(mut spare) = self.function.spare.try_lock() {
            *spare = std::mem::take(&mut self.frame);
        }
    }
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
        T::run_state(executable, &mut self.frame, inputs, results);
        Ok(())
    }
}

/// What is compiled with this crate, optimised as it is, and not once more with whoever uses it.
pub trait CompiledHere: Sized {
    /// A program that can be executed.
    fn executable(program: (&Graph, &Schedule), fused: bool, execution: ExecutionMode) -> Executable<Self>;

    /// One state, of arrays that are as long as they should be.
    fn run_state(executable: &Executable<Self>, frame: &mut [Self], inputs: &[&[Self]], results: &mut [&mut [Self]]);

    /// Many, likewise.
    fn run_states(
        function: &LoadedFunction<Self>,
        states: usize,
        inputs: &[(&[Self], BatchLayout)],
        results: &mut [(&mut [Self], BatchLayout)],
    );
}

/// By functions of these names that take any number.
macro_rules! compiled_here {
    ($($number:ty),*) => {$(
        impl CompiledHere for $number {
            fn executable((graph, schedule): (&Graph, &Schedule), fused: bool, execution: ExecutionMode) -> Executable<$number> {
                Executable::new(ProgramTape::new(graph, schedule, fused), execution)
            }

            fn run_state(
                executable: &Executable<$number>,
                frame: &mut [$number],
                inputs: &[&[$number]],
                results: &mut [&mut [$number]],
            ) {
                run_state(executable, frame, inputs, results);
            }

            fn run_states(
                function: &LoadedFunction<$number>,
                states: usize,
                inputs: &[(&[$number], BatchLayout)],
                results: &mut [(&mut [$number], BatchLayout)],
            ) {
                run_states(function, states, inputs, results);
            }
        }
    )*};
}

compiled_here!(f64, f32);

fn run_state<T: Number>(executable: &Executable<T>, frame: &mut [T], inputs: &[&[T]], results: &mut [&mut [T]]) {
    match executable.lanes(false) {
        1 => {
            let mut rest = &mut frame[..];
            for array in inputs {
                let (own, others) = rest.split_at_mut(array.len());
                own.copy_from_slice(array);
                rest = others;
            }
        }
        lanes => {
            let scalars = inputs.iter().flat_map(|array| array.iter());
            frame.chunks_exact_mut(lanes).zip(scalars).for_each(|(block, x)| block.fill(*x));
        }
    }
    executable.run(frame);
    executable.first_lanes(frame, results);
}

fn run_states<T: Number>(
    function: &LoadedFunction<T>,
    states: usize,
    inputs: &[(&[T], BatchLayout)],
    results: &mut [(&mut [T], BatchLayout)],
) {
    let by = function.executable.instructions();
    match function.executable.lanes(true) {
        1 => by.perform(Blocks::<T, 1> { function, states, inputs, results }),
        2 => by.perform(Blocks::<T, 2> { function, states, inputs, results }),
        4 => by.perform(Blocks::<T, 4> { function, states, inputs, results }),
        8 => by.perform(Blocks::<T, 8> { function, states, inputs, results }),
        16 => by.perform(Blocks::<T, 16> { function, states, inputs, results }),
        lanes => unreachable!("no vector has {lanes} numbers"),
    }
}

/// A batch in blocks of as many states as a vector has lanes.
struct Blocks<'a, 'b, 'r, T, const N: usize> {
    function: &'a LoadedFunction<T>,
    states: usize,
    inputs: &'a [(&'b [T], BatchLayout)],
    results: &'a mut [(&'r mut [T], BatchLayout)],
}

impl<T: Number, const N: usize> NativeJob for Blocks<'_, '_, '_, T, N> {
    type Output = ();

    #[inline(always)]
    fn run(self, by: NativeInstructions) {
        let Blocks { function, states, inputs, results } = self;
        let LoadedFunction { inputs: taken, outputs, executable, .. } = function;
        let [taken, outputs] = [taken, outputs].map(|ports| ports.iter().map(Port::len).collect::<Vec<usize>>());
        let entries: usize = outputs.iter().sum();
        // `N` entries more are written and read along with those of a block
        let mut frame = LineNumbers::<T>::zeros(executable.frame_length(true) + N * N);
        let mut found = LineNumbers::<T>::zeros((entries + N) * N);
        let found = found.as_chunks_mut::<N>().0;
        for first in (0..states).step_by(N) {
            // inputs stand first in a frame, one behind the other; what is behind them is written before it is read
            let mut rest = frame.as_chunks_mut::<N>().0;
            for (entries, (array, layout)) in taken.iter().zip(inputs) {
                layout.gather(array, [first, states], (*entries, rest), by);
                rest = &mut rest[*entries..];
            }
            executable.run_block::<N>(&mut frame);
            for (k, lanes) in found[..entries].iter_mut().enumerate() {
                *lanes = *executable.lanes_of_result(&frame, k);
            }
            let mut rest = &found[..];
            for (entries, (array, layout)) in outputs.iter().zip(&mut *results) {
                layout.scatter((*entries, rest), [first, states], array, by);
                rest = &rest[*entries..];
            }
        }
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
