//! A robot whose functions are executed at once.

use crate::engine::ExecutionMode;
use crate::function::LoadedFunction;
use crate::number::Number;
use std::fmt;
use straightline_codegen::choices::OptimisationTier;
use straightline_codegen::compile::{compile_programs_by, CheckedPrograms};
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::options::Options;
use straightline_codegen::program::stored::{NoStore, ProgramStore};
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_graph::expr::Sines;

/// A robot whose functions can be called.
#[derive(Debug)]
pub struct LoadedRobot<T> {
    functions: Vec<LoadedFunction<T>>,
    model: Model<Dd>,
    frames: Vec<String>,
    warnings: Diagnostics,
}

/// Why a robot is not loaded.
#[derive(Debug)]
pub enum LoadError {
    /// What is wrong with its file, its scene, or the options.
    Wrong(Diagnostics),
    /// An option that is for texts, not for what is executed at once.
    Option {
        /// Its name.
        name: &'static str,
        /// What to do instead.
        remedy: &'static str,
    },
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LoadError::Wrong(diagnostics) => f.write_str(diagnostics.render().trim_end()),
            LoadError::Option { name, remedy } => {
                write!(f, "the option `{name}` is not supported by machine code\nhelp: {remedy}")
            }
        }
    }
}

impl std::error::Error for LoadError {}

/// A function that the robot was not loaded with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownFunction {
    /// What was asked for.
    pub name: String,
    /// Those that there are.
    pub known: Vec<&'static str>,
}

impl fmt::Display for UnknownFunction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "there is no function `{}`\nhelp: the robot was loaded with {}", self.name, self.known.join(", "))
    }
}

impl std::error::Error for UnknownFunction {}

impl<T: Number> LoadedRobot<T> {
    /// Reads a robot file and makes the functions that the options name, in the format `T`, as fast as this machine can execute them.
    ///
    /// # Errors
    /// All that [`compile`](straightline_codegen::compile()) would say of the file and the options; and options that are for texts alone.
    pub fn load(source: &Source, options: &Options) -> Result<LoadedRobot<T>, LoadError> {
        Self::load_to_run(source, options, ExecutionMode::best())
    }

    /// The same, executed otherwise: interpreted, where this machine does not have what is asked for.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn load_to_run(
        source: &Source,
        options: &Options,
        execution: ExecutionMode,
    ) -> Result<LoadedRobot<T>, LoadError> {
        Self::load_by(source, options, execution, &NoStore)
    }

    /// The same, where programs that a store has are not made again, such as a [`ProgramFolder`](crate::ProgramFolder). Those that are quickly made
    /// (`optimise`) are neither looked up nor kept.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn load_by(
        source: &Source,
        options: &Options,
        execution: ExecutionMode,
        store: &dyn ProgramStore,
    ) -> Result<LoadedRobot<T>, LoadError> {
        let options = Options { scalar: T::SCALAR, also: Vec::new(), ..options.clone() };
        let store = match options.optimise {
            OptimisationTier::Full => store,
            OptimisationTier::Quick => &NoStore,
        };
        let programs = compile_programs_by(source, &options, store).map_err(LoadError::Wrong)?;
        LoadedRobot::from_programs(programs, options.fma, execution)
    }

    /// Of programs in the format `T`, with products and sums in one rounding where they are `fused`.
    ///
    /// # Errors
    /// Of programs that only texts have: in mixed precision, or with short sines.
    pub fn from_programs(
        checked: CheckedPrograms,
        fused: bool,
        execution: ExecutionMode,
    ) -> Result<LoadedRobot<T>, LoadError> {
        let CheckedPrograms { programs, model, frames, warnings } = checked;
        if programs.iter().any(|program| !program.graph.formats.is_empty()) {
            return Err(LoadError::Option {
                name: "mixed_precision",
                remedy: "leave it out: all values are in one format",
            });
        }
        if programs.iter().any(|program| program.graph.sines == Sines::Short) {
            return Err(LoadError::Option {
                name: "target",
                remedy: "leave it out: short sines are for microcontrollers",
            });
        }
        let functions = programs.iter().map(|program| LoadedFunction::new(program, fused, execution)).collect();
        Ok(LoadedRobot { functions, model, frames, warnings })
    }

    /// A function by its name.
    ///
    /// # Errors
    /// If the robot was not loaded with it.
    pub fn function(&self, name: &str) -> Result<&LoadedFunction<T>, UnknownFunction> {
        let known = || self.functions.iter().map(LoadedFunction::name).collect();
        let found = self.functions.iter().find(|function| function.name() == name);
        found.ok_or_else(|| UnknownFunction { name: name.to_string(), known: known() })
    }

    /// All functions.
    pub fn functions(&self) -> &[LoadedFunction<T>] {
        &self.functions
    }

    /// The robot in its scene.
    pub fn model(&self) -> &Model<Dd> {
        &self.model
    }

    /// The frames of functions that answer per frame.
    pub fn frames(&self) -> &[String] {
        &self.frames
    }

    /// What the compiler has to say of the robot file.
    pub fn warnings(&self) -> &Diagnostics {
        &self.warnings
    }
}
