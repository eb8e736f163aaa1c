//! The generated file: header, constants of the robot, functions, and the sine-cosine kernel they call.

use super::body::ALLOW;
use super::{batch, fused, indented, number, pasted, FunctionText, Scalar, Style};
use crate::choices::Lanes;
use crate::function::Function;
use crate::identifier::{comment, string_literals};
use crate::report::waterfall::signed;
use crate::report::{FunctionReport, Report};
use std::borrow::Cow;
use std::fmt::Write;
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_graph::expr::Port;

/// The kernel's source, pasted as it is: generated code depends on `core` alone.
const TRIG: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../runtime/core/src/trig.rs"));

/// One generated function in the file.
#[derive(Clone, Debug)]
pub struct Item {
    /// Which one.
    pub function: Function,
    /// What it takes.
    pub inputs: Vec<Port>,
    /// What it puts out.
    pub outputs: Vec<Port>,
    /// Its documentation.
    pub doc: String,
    /// Its source.
    pub text: FunctionText,
    /// The same over lanes and batches; empty if they were not asked for.
    pub lanes: String,
}

/// Where a file came from, for its header.
#[derive(Clone, Debug)]
pub struct Provenance {
    /// Path of the robot file, as the user wrote it.
    pub source: String,
    /// Hash of everything that the output depends on.
    pub hash: u64,
    /// What the reader of the file should know: special angles taken as exact, warnings.
    pub remarks: Vec<String>,
    /// The ranges of inputs that a scene states, a line each.
    pub ranges: Vec<String>,
}

/// Writes the file's items; no inner attributes, so that it can be included anywhere.
#[allow(clippy::too_many_arguments)]
pub fn file(
    model: &Model<Dd>,
    frames: &[String],
    items: &[Item],
    report: &Report,
    provenance: &Provenance,
    style: Style,
    types: &str,
    lanes: Option<Lanes>,
) -> String {
    let mut out = preamble(model, frames, report, provenance, style.scalar, types);
    let calls_kernel = |i: &Item| i.text.calls_kernel() || i.lanes.contains("trig::");
    let with_kernel =
        types.contains("trig::") || types.contains("use super::super::trig;") || items.iter().any(calls_kernel);
    if style.fused {
        out.push_str(&fused::module(style, with_kernel));
    }
    for item in items {
        out.push('\n');
        out.push_str(&item.function.alias_attribute());
        out.push_str(&item.text.text);
        if !item.lanes.is_empty() {
            out.push('\n');
            out.push_str(&item.lanes);
        }
    }
    if let Some(lanes) = lanes {
        out.push_str(&batch::module(lanes));
    }
    if with_kernel {
        out.push_str("\n#[allow(dead_code, clippy::all, clippy::pedantic)]\nmod trig {\n");
        out.push_str(&pasted(&kernel(lanes.is_some(), style.fused)));
        out.push_str("}\n");
    }
    out
}

/// All that stands before the functions: header, the robot's constants, the functions' costs, the types of parameters.
pub fn preamble(
    model: &Model<Dd>,
    frames: &[String],
    report: &Report,
    provenance: &Provenance,
    scalar: Scalar,
    types: &str,
) -> String {
    let mut out = String::new();
    header(&mut out, model, report, provenance);
    constants(&mut out, model, frames, scalar, !report.functions.is_empty());
    for (name, figures) in &report.functions {
        let _ = writeln!(out, "/// What [`{name}`] costs.");
        let _ = writeln!(out, "pub const {}_COST: Cost = {};", name.to_uppercase(), cost(figures));
        if let Some(errors) = &figures.errors {
            out.push_str(&errors.constants(name));
        }
    }
    out.push_str(types);
    out
}

/// The items of a file in another scalar, as a module of that file; the header stands there already.
pub fn scalar_module(scalar: Scalar, text: &str) -> String {
    let is_header = |line: &&str| line.starts_with("//") && !line.starts_with("///");
    let items = text.lines().skip_while(is_header).skip_while(|line| line.is_empty());
    let items = indented(&items.collect::<Vec<_>>().join("\n"));
    format!("\n/// The same in [`{}`].\npub mod {} {{\n{items}}}\n", scalar.name(), scalar.module())
}

/// The source of the sine-cosine kernel, as a module of its own. For functions over lanes it becomes part of its callers, so
/// that a loop over lanes is free of calls.
pub fn kernel(for_lanes: bool, fused: bool) -> Cow<'static, str> {
    let text = match TRIG.find("// With fused multiply-add:") {
        Some(end) if !fused => TRIG[..end].trim_end(),
        _ => TRIG,
    };
    match for_lanes {
        true => text.replace("#[inline]", "#[inline(always)]").into(),
        false => text.into(),
    }
}

/// What a file of generic functions uses.
pub const GENERIC: &str = "
use ::straightline::{Dd, Real};

/// A constant to 32 digits, as the sum of two numbers; rounded once to the scalar's format.
#[inline(always)]
fn number<T: Real>(high: f64, low: f64) -> T {
    T::constant(Dd::new(high, low))
}
";

fn header(out: &mut String, model: &Model<Dd>, report: &Report, provenance: &Provenance) {
    let floating = model.floats();
    let _ = writeln!(out, "// Dynamics of `{}` as straight-line code.", comment(&model.name));
    let _ = writeln!(
        out,
        "// Generated by straightline {} from {}; do not edit.",
        crate::VERSION,
        comment(&provenance.source)
    );
    let _ = writeln!(out, "// Inputs' hash: {:016x}", provenance.hash);
    let _ = writeln!(out, "//");
    let base = if floating { "floating base" } else { "fixed base" };
    let _ = writeln!(
        out,
        "// {} moving bodies, {base}, {} coordinates, {} velocities:",
        model.bodies.len(),
        report.nq,
        report.nv
    );
    for (i, b) in model.bodies.iter().enumerate() {
        let kind = b.joint.kind.row().name;
        let parent = b.parent.map_or("world".to_string(), |p| format!("body {}", p + 1));
        let _ = writeln!(
            out,
            "//   body {:<3} {} on {parent} by {kind} joint {}, qd[{}]",
            i + 1,
            comment(&b.name),
            comment(&b.joint.name),
            b.joint.iv
        );
    }
    let _ = writeln!(out, "//");
    let _ = writeln!(
        out,
        "// {:<22} {:>6} {:>6} {:>6} {:>4} {:>6} {:>5}",
        "function", "mul", "add", "fma", "div", "sincos", "live"
    );
    for (name, f) in &report.functions {
        let _ = writeln!(
            out,
            "// {name:<22} {:>6} {:>6} {:>6} {:>4} {:>6} {:>5}",
            f.mul, f.add, f.fma, f.div, f.sincos, f.max_live
        );
    }
    let _ = writeln!(out, "// fma: instructions for mul and add when every a * b + c is one.");
    skipped(out, report);
    if !provenance.ranges.is_empty() {
        let _ = writeln!(out, "//\n// Ranges of the inputs:");
        for line in provenance.ranges.iter().map(|r| comment(r)) {
            let _ = writeln!(out, "//   {line}");
        }
    }
    if !provenance.remarks.is_empty() {
        let _ = writeln!(out, "//");
        for line in provenance.remarks.iter().map(|r| comment(r)) {
            let _ = writeln!(out, "// {line}");
        }
    }
    out.push('\n');
}

/// What the scene skips of the full program, and what each item saves.
fn skipped(out: &mut String, report: &Report) {
    let explained: Vec<_> =
        report.functions.iter().filter_map(|(name, f)| Some((name, f, f.waterfall.as_ref()?))).collect();
    if explained.is_empty() {
        return;
    }
    let _ = writeln!(out, "//");
    let _ = writeln!(
        out,
        "// What this scene skips, in operations (mul, add, div, sqrt) of the full program and of this one:"
    );
    for (name, f, waterfall) in explained {
        let (full, here) = (waterfall.full.flops(), f.flops());
        let _ = writeln!(out, "//   {name}: {full} in full, {here} here");
        for saving in waterfall.of_scene() {
            let pairs = match saving.sincos {
                0 => String::new(),
                n => format!(", sincos {}", signed(n)),
            };
            let _ = writeln!(out, "//     {:>6}  {}{pairs}", signed(saving.operations), comment(&saving.what));
        }
    }
}

fn constants(out: &mut String, model: &Model<Dd>, frames: &[String], scalar: Scalar, with_costs: bool) {
    let (nq, nv) = (model.nq(), model.nv());
    let t = scalar.name();
    let _ = writeln!(out, "/// Number of configuration coordinates q.\npub const NQ: usize = {nq};");
    let _ = writeln!(out, "/// Number of velocity coordinates qd, qdd, tau.\npub const NV: usize = {nv};");
    let mut joints: Vec<_> = model.bodies.iter().map(|b| &b.joint).collect();
    joints.sort_by_key(|j| j.iv);
    let _ = writeln!(out, "/// Joints in the order of their coordinates.");
    let _ = writeln!(
        out,
        "pub const JOINT_NAMES: [&str; {}] = [{}];",
        joints.len(),
        string_literals(joints.iter().map(|j| j.name.as_str()))
    );
    let _ = writeln!(out, "/// Frames of the functions that answer per frame.");
    let names = string_literals(frames.iter().map(String::as_str));
    let _ = writeln!(out, "pub const FRAME_NAMES: [&str; {}] = [{names}];", frames.len());
    let single: Vec<_> = joints.iter().filter(|j| j.kind.is_single()).collect();
    let list = |f: &dyn Fn(&straightline_core::model::Limits) -> f64| {
        single.iter().map(|j| number(f(&j.limits), scalar)).collect::<Vec<_>>().join(", ")
    };
    let n = single.len();
    let floating = if n < joints.len() { " (the floating base is left out)" } else { "" };
    for (name, doc, values) in [
        ("LOWER_LIMITS", "Least coordinate of every joint \\[rad or m\\]", list(&|l| l.lower)),
        ("UPPER_LIMITS", "Greatest coordinate of every joint \\[rad or m\\]", list(&|l| l.upper)),
        ("VELOCITY_LIMITS", "Greatest speed of every joint \\[rad/s or m/s\\]", list(&|l| l.velocity)),
        ("EFFORT_LIMITS", "Greatest drive of every joint \\[N·m or N\\]", list(&|l| l.effort)),
    ] {
        let _ = writeln!(out, "/// {doc}{floating}; infinite where the robot file says nothing.");
        let _ = writeln!(out, "{ALLOW}\npub const {name}: [{t}; {n}] = [{values}];");
    }
    drive_constants(out, model);
    if !with_costs {
        return;
    }
    out.push_str(
        "\n/// Operations of a generated function.\n\
         #[derive(Clone, Copy, Debug, PartialEq, Eq)]\n\
         pub struct Cost {\n    \
             /// Multiplications.\n    pub mul: u32,\n    \
             /// Additions and subtractions.\n    pub add: u32,\n    \
             /// Instructions for both when every a * b + c is one.\n    pub fma: u32,\n    \
             /// Divisions.\n    pub div: u32,\n    \
             /// Pairs of sine and cosine.\n    pub sin_cos: u32,\n    \
             /// Most values alive at once, inputs and constants not counted.\n    pub max_live: u32,\n\
         }\n",
    );
}

/// Numbers and names of the drives, if there are any.
fn drive_constants(out: &mut String, model: &Model<Dd>) {
    let drives = &model.drives;
    if drives.is_empty() {
        return;
    }
    let n = drives.len();
    let names = string_literals(drives.iter().map(|d| d.name.as_str()));
    let states: Vec<usize> = drives.iter().map(straightline_core::drive::Drive::states).collect();
    let total: usize = states.iter().sum();
    let _ = writeln!(out, "/// Number of inputs u of the drives.\npub const NU: usize = {n};");
    let _ = writeln!(out, "/// Number of states x of the drives.\npub const NX: usize = {total};");
    let _ = writeln!(out, "/// Drives in the order of u.\npub const DRIVE_NAMES: [&str; {n}] = [{names}];");
    let _ =
        writeln!(out, "/// How many entries of x each drive has.\npub const DRIVE_STATES: [usize; {n}] = {states:?};");
}

fn cost(f: &FunctionReport) -> String {
    format!(
        "Cost {{ mul: {}, add: {}, fma: {}, div: {}, sin_cos: {}, max_live: {} }}",
        f.mul, f.add, f.fma, f.div, f.sincos, f.max_live
    )
}
