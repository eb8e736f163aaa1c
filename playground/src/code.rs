//! The text of a robot's dynamics: the same bytes as the compiler's other fronts write.

use crate::complaints::{complaints, Complaint};
use crate::request::Files;
use serde::{Deserialize, Serialize};
use straightline_codegen::choices::OptimisationTier;
use straightline_codegen::compile::{compile as compiled, explain};
use straightline_codegen::options::Options;
use straightline_codegen::report::Report;
use straightline_codegen::Function;

/// What is to be compiled, and how.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct CodeRequest {
    /// The robot file and its scene.
    #[serde(flatten)]
    pub files: Files,
    /// Names of functions; none: those that the scene names, or all.
    pub functions: Vec<String>,
    /// Whether one form of the robot is enough.
    pub quick: bool,
    /// Whether the report says what each optimisation is worth.
    pub explained: bool,
}

/// What came of it.
#[derive(Debug, Default, Serialize)]
pub struct CodeAnswer {
    /// What is wrong or doubtful.
    pub complaints: Vec<Complaint>,
    /// The generated text; none after errors.
    pub text: Option<String>,
    /// Its figures.
    pub report: Option<Report>,
}

/// The options that a request asks for.
pub fn options(request: &CodeRequest) -> Options {
    let mut options = request.files.options("", Options::default());
    if !request.functions.is_empty() {
        options.functions =
            Function::known().filter(|f| request.functions.iter().any(|name| name == f.name())).collect();
    }
    if request.quick {
        options.optimise = OptimisationTier::Quick;
    }
    options
}

/// Compiles a robot.
pub fn compile(request: CodeRequest) -> CodeAnswer {
    let options = options(&request);
    let source = request.files.source();
    let made = if request.explained { explain(&source, &options) } else { compiled(&source, &options) };
    match made {
        Ok(generated) => CodeAnswer {
            complaints: complaints(&generated.warnings),
            text: Some(generated.text),
            report: Some(generated.report),
        },
        Err(wrong) => CodeAnswer { complaints: complaints(&wrong), ..CodeAnswer::default() },
    }
}
