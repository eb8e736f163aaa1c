//! What the functions of a robot take on this machine, by machine code that is made for it: no rustc is needed.

use crate::arguments::{robot_file, ModelArgs, ProgramArgs, EXIT_CODES};
use crate::table::FunctionTable;
use crate::{compiled, files, print, verified, CommandFailure};
use clap::Args;
use serde::Serialize;
use std::collections::BTreeMap;
use std::hint::black_box;
use std::path::PathBuf;
use std::time::Instant;
use straightline_codegen::choices::OptimisationTier;
use straightline_codegen::model::states::random_inputs;
use straightline_codegen::program::stored::{NoStore, ProgramStore};
use straightline_codegen::verify::Verification;
use straightline_codegen::{Options, Source};
use straightline_core::Dd;
use straightline_graph::in_scalar;
use straightline_jit::{BatchLayout, ExecutionMode, LoadError, LoadedFunction, Number, ProgramFolder, Robot};

/// States of a batch.
const STATES: usize = 4096;
/// A measurement takes so long \[s\], and is the best of so many.
const SECONDS: f64 = 0.02;
const REPEATS: usize = 5;

/// What stands below the help of the command.
pub fn help() -> String {
    format!(
        "\
Times are of machine code with the bits of generated Rust, in nanoseconds: of a call, and per state of a batch on one
thread. Errors are those of `verify`.

Examples:
  straightline bench panda.urdf
  straightline bench solo12.urdf --floating-base --scalar f32 --function inverse_dynamics --json

{EXIT_CODES}"
    )
}

#[derive(Debug, Args)]
pub struct Bench {
    #[arg(help = robot_file())]
    pub robot: PathBuf,
    /// Number of random states that errors are the worst of
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..))]
    pub states: u32,
    /// Seed of the random states
    #[arg(long, value_name = "S", default_value_t = 1)]
    pub seed: u64,
    /// As JSON: {"robot": …, "execution": …, "functions": {"inverse_dynamics": {"nanoseconds_per_call": …}}}
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub program: ProgramArgs,
    #[command(flatten)]
    pub model: ModelArgs,
}

/// What was found.
#[derive(Serialize)]
pub struct BenchReport {
    robot: String,
    scalar: &'static str,
    /// How the functions were executed.
    execution: String,
    /// From the text of the file to functions that can be called \[ms\].
    milliseconds_to_load: f64,
    /// The same, where programs were kept that are checked only \[ms\]; none of those that are made as quickly.
    milliseconds_to_load_kept: Option<f64>,
    /// The greatest error that passes.
    bound: f64,
    functions: BTreeMap<&'static str, FunctionTimes>,
}

/// Of a function.
#[derive(Serialize)]
struct FunctionTimes {
    operations: usize,
    sincos: usize,
    nanoseconds_per_call: f64,
    /// In a batch of 4096 states on one thread.
    nanoseconds_per_state: f64,
    code_bytes: usize,
    /// The worst error beside the second author, divided by its natural scale; none where the reference has no formulation.
    error: Option<f64>,
}

/// Prints what functions take.
pub fn bench(a: &Bench) -> Result<(), CommandFailure> {
    let compiled = compiled(&a.robot, &a.program, &a.model)?;
    let verification = verified(&a.robot, &compiled, (a.states, a.seed))?;
    let excess = verification.excess();
    let (source, (_, options)) = (files::read(&a.robot)?, compiled);
    let report = in_scalar!(options.scalar, T => {
        let (robot, times) = loaded::<T>(&source, &options)?;
        measured(&robot, verification, times)
    });
    if a.json { print::json(&report) } else { print_report(&report) }?;
    excess.map_or(Ok(()), |why| Err(print::failure(why)))
}

/// How long it takes to load a robot \[ms\]: made, and kept in a folder.
type LoadTimes = (f64, Option<f64>);

fn loaded<T: Number>(source: &Source, options: &Options) -> Result<(Robot<T>, LoadTimes), CommandFailure> {
    let load = |store: &dyn ProgramStore| {
        let start = Instant::now();
        let robot =
            Robot::<T>::load_by(source, options, ExecutionMode::best(), store).map_err(|wrong| match wrong {
                LoadError::Wrong(diagnostics) => print::refused(&diagnostics),
                LoadError::Option { name, remedy } => print::failure_with(
                    format!("`{name}` is for generated text, not for what is executed at once"),
                    &[remedy],
                ),
            })?;
        Ok::<_, CommandFailure>((robot, start.elapsed().as_secs_f64() * 1e3))
    };
    match (options.optimise, tempfile::tempdir()) {
        // the first start keeps what the second one finds
        (OptimisationTier::Full, Ok(folder)) => {
            let folder = ProgramFolder::new(folder.path());
            let (robot, made) = load(&folder)?;
            Ok((robot, (made, Some(load(&folder)?.1))))
        }
        _ => load(&NoStore).map(|(robot, made)| (robot, (made, None))),
    }
}

fn measured<T: Number>(
    robot: &Robot<T>,
    verification: Verification,
    (milliseconds_to_load, milliseconds_to_load_kept): LoadTimes,
) -> BenchReport {
    let Verification { robot: name, scalar, bound, functions: errors, .. } = verification;
    let execution = robot.functions().first().map_or_else(String::new, |f| f.execution().to_string());
    let functions = robot.functions().iter().map(|function| {
        let counts = function.counts();
        let [call, state] = times(robot, function);
        let times = FunctionTimes {
            operations: counts.flops(),
            sincos: counts.sin_cos,
            nanoseconds_per_call: call,
            nanoseconds_per_state: state,
            code_bytes: function.code_bytes(),
            error: errors.get(function.name()).map(|worst| worst.error),
        };
        (function.name(), times)
    });
    BenchReport {
        robot: name,
        scalar,
        execution,
        milliseconds_to_load,
        milliseconds_to_load_kept,
        bound,
        functions: functions.collect(),
    }
}

/// Nanoseconds of a call and of a state in a batch.
fn times<T: Number>(robot: &Robot<T>, function: &LoadedFunction<T>) -> [f64; 2] {
    let arrays = |count: usize| -> Vec<Vec<T>> {
        let inputs = random_inputs(robot.model(), function.inputs(), count);
        inputs.into_iter().map(|x| x.into_iter().map(|x| T::constant(Dd::from(x))).collect()).collect()
    };
    let mut results: Vec<Vec<T>> = function.outputs().iter().map(|p| vec![T::zero(); p.len() * STATES]).collect();
    let one = arrays(1);
    let one: Vec<&[T]> = one.iter().map(Vec::as_slice).collect();
    let mut runner = function.runner();
    let mut first: Vec<Vec<T>> = function.outputs().iter().map(|p| vec![T::zero(); p.len()]).collect();
    let mut first: Vec<&mut [T]> = first.iter_mut().map(Vec::as_mut_slice).collect();
    let call = nanoseconds(|| {
        runner.call(black_box(&one), &mut first).expect("arrays are as long as they have to be");
        black_box(&mut first);
    });
    let many = arrays(STATES);
    let many: Vec<(&[T], BatchLayout)> = many
        .iter()
        .zip(function.inputs())
        .map(|(x, port)| (x.as_slice(), BatchLayout::states_of(port.len())))
        .collect();
    let lengths = function.outputs().iter().map(|port| port.len());
    let mut all: Vec<(&mut [T], BatchLayout)> =
        results.iter_mut().zip(lengths).map(|(x, n)| (x.as_mut_slice(), BatchLayout::states_of(n))).collect();
    let batch = nanoseconds(|| {
        function.batch(STATES, black_box(&many), &mut all).expect("arrays are as long as they have to be");
        black_box(&mut all);
    });
    [call, batch / STATES as f64]
}

/// What one of these takes: the best of several measurements.
fn nanoseconds(mut run: impl FnMut()) -> f64 {
    let mut seconds = |count: u64| {
        let start = Instant::now();
        (0..count).for_each(|_| run());
        start.elapsed().as_secs_f64()
    };
    let mut count = 1;
    while seconds(count) < SECONDS / REPEATS as f64 {
        count *= 2;
    }
    (0..REPEATS).map(|_| seconds(count)).fold(f64::INFINITY, f64::min) / count as f64 * 1e9
}

fn print_report(report: &BenchReport) -> std::io::Result<()> {
    let BenchReport { robot, scalar, execution, bound, functions, .. } = report;
    let mut table = FunctionTable::new(&format!("{robot}: {scalar}, {execution}"), functions.keys())?;
    table.row("function", &["operations", "sincos", "ns/call", "ns/state", "bytes", "error"])?;
    for (name, f) in functions {
        let error = f.error.map_or("-".to_string(), |error| format!("{error:.1e}"));
        let times = [f.nanoseconds_per_call, f.nanoseconds_per_state].map(|x| format!("{x:.1}"));
        let [call, state] = times;
        table.row(
            name,
            &[f.operations.to_string(), f.sincos.to_string(), call, state, f.code_bytes.to_string(), error],
        )?;
    }
    let kept = report.milliseconds_to_load_kept.map(|kept| format!(", {kept:.1} ms where programs were kept"));
    let (made, kept) = (report.milliseconds_to_load, kept.unwrap_or_default());
    table.foot(&format!(
        "from the file's text to machine code: {made:.1} ms{kept}\n\
         ns/state: in a batch of {STATES} states, one thread; error: beside the second author, divided by natural scale, bound {bound:.1e}"
    ))
}
