//! Budgets: what a function may cost, and what could be done about it where it costs more.

use super::errors::ErrorReport;
use super::waterfall::robot_in;
use crate::diagnostic::Diagnostics;
use crate::function::{Function, Quantity};
use crate::machine_code::MachineFigures;
use crate::options::Options;
use crate::program::{checked, TracedProgram};
use crate::scene::{messages as say, Budget, CoulombForm, Effects, Gravity, MaxError, Misfit, Scene, Zero};
use rustc_hash::FxHashSet;
use std::collections::BTreeMap;
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_graph::expr::{NodeId, Op};
use straightline_graph::{element_of, Scalar};

/// Of the things that could be held, so many are named.
const REMEDIES: usize = 3;

/// What a program costs, in the terms of budgets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Measures {
    /// Multiplications, additions, divisions and square roots.
    pub flops: usize,
    /// Pairs of sine and cosine.
    pub sincos: usize,
    /// Most values alive at once.
    pub live: usize,
    /// Bytes of values on the stack: live values, and slots that carry values from part to part.
    pub stack_bytes: usize,
    /// Bytes of machine code, estimated for x86-64.
    pub code_bytes: usize,
}

impl Measures {
    /// Of a program in that scalar.
    pub fn of(program: &TracedProgram, scalar: Scalar) -> Measures {
        let (counts, schedule) = (program.graph.counts(), &program.schedule);
        Measures {
            flops: counts.flops(),
            sincos: counts.sin_cos,
            live: schedule.max_live,
            stack_bytes: (schedule.max_live + schedule.slots) * scalar.bytes(),
            code_bytes: code_bytes(program, scalar),
        }
    }
}

/// Bytes of machine code of a program on x86-64, as far as known before rustc: per operation, per sine-cosine pair that is computed alone, and
/// per block of pairs that are computed together ([`Scalar::code_bytes`]).
///
/// Least squares of relative errors over ten functions each, one to a file, of Panda, UR5, HyQ with a fixed and a floating base
/// and the simple humanoid (f64), of Panda, PUMA 560 and Solo 12 (f32), compiled by rustc 1.95.0 with `-C opt-level=3
/// -C codegen-units=1` for x86-64 without further target features; sizes by `nm -S`, the kernel included. Estimate over measured
/// size: 0.67 to 1.27, median 1.00, in f32 0.71 to 1.16. `opt-level = "s"`, fused operations and other processors give less.
fn code_bytes(program: &TracedProgram, scalar: Scalar) -> usize {
    let TracedProgram { graph, schedule, .. } = program;
    let [operation, alone, block] = scalar.code_bytes();
    // a row of a loop over limbs is there once
    let live = graph.live();
    let again = |row: &&Vec<NodeId>| if graph.op(row[0]).is_counted() { row.len() - 1 } else { 0 };
    let rows = graph.alike.iter().flat_map(|alike| &alike.rows).filter(|row| live[row[0].index()]);
    let again: usize = rows.map(|row| again(&row)).sum();
    let mut bytes = operation * (graph.counts().flops() - again) as f64;
    let section = |id: &NodeId| graph.notes[id.index()].section;
    let others: FxHashSet<NodeId> =
        graph.alike.iter().flat_map(|a| &a.rows).flat_map(|row| row[1..].iter().copied()).collect();
    let is_pair = |id: &&NodeId| matches!(graph.op(**id), Op::SinCos(_)) && !others.contains(*id);
    for run in schedule.parts.iter().flat_map(|part| part.nodes.chunk_by(|a, b| section(a) == section(b))) {
        bytes += match run.iter().filter(is_pair).count() {
            0 => 0.0,
            1 => alone,
            _ => block,
        };
    }
    bytes.round() as usize
}

/// A limit of a budget, on measures of a kind.
struct Limit<M> {
    key: &'static str,
    most: fn(&Budget) -> Option<usize>,
    /// Or why that is not known.
    takes: fn(&M) -> Result<usize, &'static str>,
    /// What comes before the number, after one, and after any other: `takes 567 operations`.
    words: (&'static str, &'static str, &'static str),
}

/// What programs are compared with.
const LIMITS: [Limit<Measures>; 5] = [
    Limit {
        key: "max_flops",
        most: |b| b.max_flops,
        takes: |m| Ok(m.flops),
        words: ("takes", "operation", "operations"),
    },
    Limit {
        key: "max_sincos",
        most: |b| b.max_sincos,
        takes: |m| Ok(m.sincos),
        words: ("takes", "sine-cosine pair", "sine-cosine pairs"),
    },
    Limit {
        key: "max_live",
        most: |b| b.max_live,
        takes: |m| Ok(m.live),
        words: ("keeps", "value alive at once", "values alive at once"),
    },
    Limit {
        key: Budget::STACK,
        most: |b| b.max_stack_bytes,
        takes: |m| Ok(m.stack_bytes),
        words: ("takes", "byte of stack for its values", "bytes of stack for its values"),
    },
    Limit {
        key: "max_code_bytes",
        most: |b| b.max_code_bytes,
        takes: |m| Ok(m.code_bytes),
        words: ("takes about", "byte of code", "bytes of code"),
    },
];

/// What machine code is compared with.
const MACHINE_LIMITS: [Limit<MachineFigures>; 3] = [
    Limit {
        key: "max_instructions",
        most: |b| b.max_instructions,
        takes: |m| m.instructions.map(|n| n as usize),
        words: ("takes", "instruction", "instructions"),
    },
    Limit {
        key: "max_flash_bytes",
        most: |b| b.max_flash_bytes,
        takes: |m| Ok(m.flash_bytes as usize),
        words: ("takes", "byte of flash", "bytes of flash"),
    },
    Limit {
        key: Budget::STACK,
        most: |b| b.max_stack_bytes,
        takes: |m| m.stack_bytes.map(|n| n as usize),
        words: ("takes", "byte of stack", "bytes of stack"),
    },
];

/// Complains of every budget of the scene that a program exceeds. `whole` is the robot as its file has it.
pub fn check(
    whole: &Model<Dd>,
    frames: &[String],
    programs: &[(Function, Measures)],
    options: &Options,
    diagnostics: &mut Diagnostics,
) {
    // where the machine is known its machine code says more
    let counts = |limit: &&Limit<Measures>| !options.measures_stack() || limit.key != Budget::STACK;
    let limits: Vec<&Limit<Measures>> = LIMITS.iter().filter(counts).collect();
    compare(&limits, programs, &|function| remedies(whole, frames, function, options), options, diagnostics);
}

/// Complains of every budget that machine code exceeds, or of which it says nothing. `remedies` are measured as it is.
pub fn check_machine_code(
    figures: &[(Function, MachineFigures)],
    remedies: &dyn Fn(Function) -> Vec<(String, MachineFigures)>,
    options: &Options,
    diagnostics: &mut Diagnostics,
) {
    let counts = |limit: &&Limit<MachineFigures>| options.measures_stack() || limit.key != Budget::STACK;
    let limits: Vec<&Limit<MachineFigures>> = MACHINE_LIMITS.iter().filter(counts).collect();
    compare(&limits, figures, remedies, options, diagnostics);
}

/// Complains of every limit that a function exceeds, with what would save most, or of which nothing is known.
fn compare<M>(
    limits: &[&Limit<M>],
    measured: &[(Function, M)],
    remedies: &dyn Fn(Function) -> Vec<(String, M)>,
    options: &Options,
    diagnostics: &mut Diagnostics,
) {
    for (function, measures) in measured {
        let (Some(budget), name) = (options.scene.budgets.get(function), function.name()) else { continue };
        let mut tried = None;
        for limit in limits {
            let message = match ((limit.most)(budget), (limit.takes)(measures)) {
                (Some(most), Ok(takes)) if takes > most => {
                    let remedies = tried.get_or_insert_with(|| remedies(*function));
                    let with = remedies.iter().filter_map(|(what, with)| Some(((limit.takes)(with).ok()?, &what[..])));
                    say::over_budget(name, limit.words, (takes, most), limit.key, &savings(takes, with))
                }
                (Some(_), Err(why)) => say::figure_unknown(name, limit.key, why),
                _ => continue,
            };
            options.scene.places.complain(&format!("budget.{name}.{}", limit.key), message, diagnostics);
        }
    }
}

/// What saves most, the greatest first, of equal ones as they come.
fn savings<'a>(takes: usize, with: impl Iterator<Item = (usize, &'a str)>) -> Vec<(usize, &'a str)> {
    let saved = with.map(|(with, what)| (takes.saturating_sub(with), what));
    let mut savings: Vec<(usize, &str)> = saved.filter(|(saved, _)| *saved > 0).collect();
    savings.sort_by_key(|(saved, _)| std::cmp::Reverse(*saved));
    savings.truncate(REMEDIES);
    savings
}

/// Of what the scene could hold, what saves the most operations: so much is worth a run of rustc.
pub fn promising(whole: &Model<Dd>, frames: &[String], function: Function, options: &Options) -> Vec<(String, Scene)> {
    let candidates = candidates(whole, function, options).into_iter();
    let mut counted: Vec<(usize, (String, Scene))> = candidates
        .filter_map(|(what, scene)| Some((in_scene(whole, frames, function, &scene, options)?.flops, (what, scene))))
        .collect();
    counted.sort_by_key(|(flops, _)| *flops);
    counted.truncate(REMEDIES);
    counted.into_iter().map(|(_, candidate)| candidate).collect()
}

/// Complains of every bound of rounding errors that is greater than the scene allows, and of demanded bounds that do not exist.
pub fn check_errors<'a>(
    bounds: impl Iterator<Item = (&'a TracedProgram, &'a Option<ErrorReport>)>,
    options: &Options,
    diagnostics: &mut Diagnostics,
) {
    for (program, errors) in bounds {
        let (budget, name) = (options.scene.budgets.get(&program.function), program.function.name());
        let (Some(most), Some(errors)) = (budget.and_then(|b| b.max_error.as_ref()), errors) else { continue };
        let path = format!("budget.{name}.max_error");
        let outputs = &program.graph.outputs;
        let demand = match most.of_results(outputs) {
            Ok(demand) => demand,
            Err(misfit) => {
                let Misfit { output, complaint } = *misfit;
                let path = output.map_or(path.clone(), |output| format!("{path}.{output}"));
                options.scene.places.complain(&path, complaint, diagnostics);
                continue;
            }
        };
        let beyond = errors.bounds().zip(&demand).enumerate().filter(|(_, (bound, most))| bound > *most);
        let mut beyond: Vec<(String, f64, f64)> =
            beyond.map(|(k, (bound, most))| (element_of(outputs, k), bound, *most)).collect();
        if *most == MaxError::All(demand.first().copied().unwrap_or_default()) {
            // the worst of all
            let worst = beyond.iter().max_by(|a, b| a.1.total_cmp(&b.1)).cloned();
            beyond = worst.into_iter().collect();
        }
        let complaint = match errors.refused {
            Some(why) => say::error_unbounded(name, why),
            None if !beyond.is_empty() => say::error_over_budget(name, &beyond),
            None => continue,
        };
        options.scene.places.complain(&path, complaint, diagnostics);
    }
}

/// What the scene could hold besides, with what a function would cost then.
fn remedies(whole: &Model<Dd>, frames: &[String], function: Function, options: &Options) -> Vec<(String, Measures)> {
    let candidates = candidates(whole, function, options).into_iter();
    let with = |(what, scene)| Some((what, in_scene(whole, frames, function, &scene, options)?));
    candidates.filter_map(with).collect()
}

/// What a function would cost in a scene.
fn in_scene(
    whole: &Model<Dd>,
    frames: &[String],
    function: Function,
    scene: &Scene,
    options: &Options,
) -> Option<Measures> {
    let (robot, scene) = robot_in(whole, &Scene { budgets: BTreeMap::new(), ..scene.clone() })?;
    let options = Options { scene, ..options.clone() };
    // what has no right form in that scene is no advice
    let program = checked(&robot, frames, function, &options).ok()?;
    Some(Measures::of(&program, options.scalar))
}

/// What the scene could hold besides.
fn candidates(whole: &Model<Dd>, function: Function, options: &Options) -> Vec<(String, Scene)> {
    let scene = &options.scene;
    let mut candidates: Vec<(String, Scene)> = Vec::new();
    let inputs = function.quantities(whole);
    let with = |zero: Zero| Scene { zero, ..scene.clone() };
    if inputs.contains(&Quantity::Velocity) && !scene.zero.qd {
        candidates.push(("q̇ = 0".to_string(), with(Zero { qd: true, ..scene.zero.clone() })));
    }
    if inputs.contains(&Quantity::Acceleration) && !scene.zero.qdd {
        candidates.push(("q̈ = 0".to_string(), with(Zero { qdd: true, ..scene.zero.clone() })));
    }
    if scene.gravity != Gravity::Constant([0.0; 3]) {
        candidates.push(("no gravity".to_string(), Scene { gravity: Gravity::Constant([0.0; 3]), ..scene.clone() }));
    }
    let off =
        Effects { rotor_inertia: false, damping: false, coulomb: CoulombForm::Off, springs: false, ..scene.effects };
    if scene.effects != off {
        candidates
            .push(("no friction, rotor inertia and springs".to_string(), Scene { effects: off, ..scene.clone() }));
    }
    let is_free = |name: &str| {
        let rest = scene.outputs.values().flat_map(|s| &s.joints).chain(&scene.zero.joints_at_rest);
        !scene.locked.iter().any(|(locked, _)| locked == name) && !rest.into_iter().any(|n| n == name)
    };
    // a joint of a loop cannot be held while the loop moves
    let lockable = whole.independent_joints().filter(|j| whole.closure.is_empty() && j.kind.is_single());
    for joint in lockable.filter(|j| is_free(&j.name)) {
        let locked = scene.locked.iter().cloned().chain([(joint.name.clone(), 0.0)]).collect();
        candidates.push((format!("joint {} locked", joint.name), Scene { locked, ..scene.clone() }));
    }
    candidates
}
