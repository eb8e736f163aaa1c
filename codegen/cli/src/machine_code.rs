//! Programs by machine code of this machine, which has the bits of generated Rust.

use straightline_codegen::program::TracedProgram;
use straightline_codegen::verify::{interpreted, ProgramRun};
use straightline_codegen::Options;
use straightline_core::Dd;
use straightline_graph::in_scalar;
use straightline_jit::{LoadedFunction, Number};

/// A program as it is executed here; operation by operation what texts alone have: mixed precision, short sines.
pub fn run<'p>(program: &'p TracedProgram, options: &Options) -> ProgramRun<'p> {
    in_scalar!(options.scalar, T => match LoadedFunction::<T>::of_program(program, options.fma) {
        Some(function) => executed(function),
        None => interpreted(program, options),
    })
}

fn executed<'p, T: Number + Into<f64>>(function: LoadedFunction<T>) -> ProgramRun<'p> {
    Box::new(move |given| {
        let given: Vec<T> = given.iter().map(|x| T::constant(Dd::from(*x))).collect();
        let mut rest = &given[..];
        let inputs: Vec<&[T]> =
            function.inputs().iter().map(|port| rest.split_off(..port.len()).expect("every number is given")).collect();
        let results = function.results(&inputs).expect("arrays are as long as their ports");
        results.into_iter().map(Into::into).collect()
    })
}
