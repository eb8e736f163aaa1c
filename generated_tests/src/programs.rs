//! Programs as the compiler makes them, before they become text: for the interpreter. Each is made once, whichever test asks first.

use crate::made::Made;
use crate::reference::Robot;
use std::path::Path;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::equations::Robot as Loaded;
use straightline_codegen::model::{self, ModelOptions};
use straightline_codegen::options::Options;
use straightline_codegen::program::{self, TracedProgram};
use straightline_codegen::{expr, Function};
use straightline_core::{Dd, Real};

/// The file of a robot of the reference data.
pub fn source(robot: &Robot) -> Source {
    file(&robot.file)
}

/// A robot file, by its name without folders.
pub fn file(path: &Path) -> Source {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    Source::new(&path.file_name().expect("a file has a name").to_string_lossy(), text)
}

/// How a robot of the reference data is compiled.
pub fn options(robot: &Robot) -> Options {
    Options {
        frames: robot.frames.clone(),
        model: ModelOptions { floating_base: robot.floating, ..ModelOptions::default() },
        ..Options::default()
    }
}

/// The robot of a file, as the compiler traces it.
///
/// # Panics
/// With the complaints about the file, if it has errors.
pub fn load(source: &Source, options: &ModelOptions) -> Loaded {
    static LOADED: Made<Loaded> = Made::nothing();
    LOADED.once(format!("{source:?} {options:?}"), || {
        let (model, diagnostics) = model::load(source, options);
        assert!(!diagnostics.has_errors(), "{}", diagnostics.render());
        Loaded::new(model.expect("a file without errors has a model"))
    })
}

/// The program of a function of a robot in no other form than [`load`] gives it.
pub fn program(robot: &Loaded, frames: &[String], function: Function, options: &Options) -> TracedProgram {
    static MADE: Made<TracedProgram> = Made::nothing();
    let key = format!("{function:?} {frames:?} {options:?} {:?}", robot.model);
    MADE.once(key, || program::program(robot, frames, function, options))
}

/// The program of a function of a robot of the reference data.
pub fn of_robot(robot: &Robot, function: Function, options: &Options) -> TracedProgram {
    program(&load(&source(robot), &options.model), &options.frames, function, options)
}

/// The results of a program for groups of inputs.
pub fn run<T: Real>(program: &TracedProgram, inputs: &[Vec<T>]) -> Vec<T> {
    expr::evaluate(&program.graph, &inputs.concat())
}

/// The same numbers over another scalar.
pub fn cast<T: Real>(inputs: &[Vec<f64>]) -> Vec<Vec<T>> {
    inputs.iter().map(|group| group.iter().map(|x| T::constant(Dd::from(*x))).collect()).collect()
}
