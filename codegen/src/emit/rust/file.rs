//! The generated file: header, constants of the robot, functions, and the sine-cosine kernel they call.

use super::constants::{cost, entries, error_bounds, figures, of_robot, AssociatedConstant, COST, FIGURES};
use super::routine::SHORT_SINES;
use super::{batch, bound, contact, fused, indented, parameter, pasted, self_test, staged};
use crate::choices::{Choice, Lanes, Memory};
use crate::emit::module::Item;
use crate::emit::Generated;
use crate::identifier::comment;
use crate::report::waterfall::signed;
use crate::report::Report;
use std::borrow::Cow;
use std::fmt::Write;
use straightline_core::model::Model;
use straightline_core::Dd;

/// The kernel's source, pasted as it is: generated code depends on `core` alone.
const TRIG: &str = straightline_core::sources::TRIG;

/// Writes the file: header and items, no inner attributes, so that it can be included anywhere.
pub fn file(generated: &Generated) -> String {
    header(generated) + &items(generated)
}

/// All items of the file.
fn items(generated: &Generated) -> String {
    let with_kernel = generated.calls_kernel();
    let mut out = preamble(generated);
    if generated.style.fused {
        out.push_str(&fused::module(generated.style, with_kernel));
    }
    for item in &generated.items {
        out.push('\n');
        out.push_str(&item.function.alias_attribute());
        out.push_str(&item_text(item));
        out.push_str(&lanes_text(item, generated.lanes));
    }
    out.extend(self_test::text(generated));
    if let Some(lanes) = generated.lanes {
        out.push_str(&batch::module(lanes));
    }
    if with_kernel {
        out.push_str("\n#[allow(dead_code, clippy::all, clippy::pedantic)]\nmod trig {\n");
        out.push_str(&pasted(&kernel(generated.lanes.is_some(), generated.style.fused)));
        out.push_str("}\n");
    }
    if generated.items.iter().any(Item::calls_short_sines) {
        let _ = write!(out, "\n#[allow(dead_code, clippy::all, clippy::pedantic)]\nmod {SHORT_SINES} {{\n");
        out.push_str(&pasted(&short_sines(generated.memory)));
        out.push_str("}\n");
    }
    out
}

/// The source of the short sines, as a module of its own.
pub fn short_sines(memory: Memory) -> String {
    let inlined = match memory {
        Memory::Flash => "#[inline(never)]",
        Memory::Tcm => "#[inline(always)]",
    };
    straightline_core::sources::SHORT_SINES.replace("#[inline]", inlined)
}

/// What functions in a module of their own use of the file, which is `above` them.
pub(super) fn uses(above: &str, calls_kernel: bool, generated: &Generated) -> String {
    const UNUSED: &str = "#[allow(unused_imports)]\n";
    let fused = generated.style.fused;
    let mut out = String::new();
    if calls_kernel {
        let _ = writeln!(out, "{}use {above}::trig;", if fused { UNUSED } else { "" });
    }
    if fused {
        let _ = writeln!(out, "{UNUSED}use {above}::fused::{{self, fma, fma_if, FUSED}};");
    }
    if generated.plain_style.generic {
        let _ = writeln!(out, "{UNUSED}use {above}::{{number, Dd, Real}};");
    }
    if generated.lanes.is_some() {
        let _ = writeln!(out, "use {above}::batch;");
    }
    out
}

/// A function, and what bounds its errors at a state.
pub(super) fn item_text<F>(item: &Item<F>) -> String {
    let of_state = item.bound.iter().map(|b| format!("\n{}", bound(b)));
    item.text.clone() + &of_state.collect::<String>()
}

/// The function over lanes, and its batches.
pub(super) fn lanes_text<F>(item: &Item<F>, drivers: Option<Lanes>) -> String {
    let lanes = drivers.zip(item.lanes.as_ref());
    lanes.map(|(drivers, body)| format!("\n{}", batch::lanes(item, body, drivers))).unwrap_or_default()
}

/// All that stands between the header and the functions: the robot's constants, the functions' costs and bounds, types of parameters,
/// stages and contact modes.
pub(super) fn preamble(generated: &Generated) -> String {
    let mut out: String = of_robot(generated).iter().map(AssociatedConstant::text).collect();
    let functions = &generated.report.functions;
    if !functions.is_empty() {
        out.push_str(COST);
    }
    if generated.rustc.is_some() {
        out.push_str(FIGURES);
    }
    for (name, found) in functions {
        out.push_str(&cost(name, found).text());
        out.extend(figures(name, found, generated).iter().map(AssociatedConstant::text));
        out.extend(entries(name, found).iter().map(AssociatedConstant::text));
        if let Some(refused) = found.errors.as_ref().and_then(|errors| errors.refused) {
            let _ = writeln!(out, "// No certified bound of the errors of {name}: {refused}.");
        }
        for slopes in found.errors.iter().flat_map(|errors| &errors.outputs).filter_map(|output| output.slopes.as_ref())
        {
            if let Some(refused) = slopes.refused {
                let _ = writeln!(out, "// No Lipschitz constant of {} by {}: {refused}.", slopes.of, slopes.by);
            }
        }
        out.extend(error_bounds(name, found).iter().map(AssociatedConstant::text));
    }
    if generated.plain_style.generic {
        out.push_str(GENERIC);
    }
    out.push_str(&types(generated));
    out
}

/// Types of parameters, stages and contact modes, with the functions that they have.
fn types(generated: &Generated) -> String {
    let staged = generated.staged.iter().map(|module| staged::text(module, generated.style));
    parameter::types(&generated.parameters, generated.style)
        + &staged.collect::<String>()
        + &contact::text(&generated.contact, generated)
}

/// The items of a file in another scalar, as a module of a file that has the header already.
pub fn scalar_module(generated: &Generated) -> String {
    let scalar = generated.scalar;
    let items = indented(items(generated).trim_start_matches('\n'));
    format!("\n/// The same in [`{}`].\npub mod {} {{\n{items}}}\n", scalar.name(), scalar.module())
}

/// What symbols of functions begin with in [`measurable`] crates.
const SYMBOL: &str = "straightline_";

/// The symbol of a function there.
pub fn symbol(function: &str) -> String {
    format!("{SYMBOL}{function}")
}

/// A crate of a file, whose functions of these names have symbols that can be found in its machine code.
pub fn measurable(text: &str, functions: &[&str]) -> String {
    let mut out = String::from("#![no_std]\n");
    for line in text.lines() {
        let name = line.strip_prefix("pub fn ").and_then(|rest| rest.split_once('(')).map(|(name, _)| name);
        if let Some(name) = name.filter(|name| functions.contains(name)) {
            let _ = writeln!(out, "#[export_name = \"{}\"]", symbol(name));
        }
        out.push_str(line);
        out.push('\n');
    }
    out
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
const GENERIC: &str = "
use ::straightline::{Dd, Real};

/// A constant to 32 digits, as the sum of two numbers; rounded once to the scalar's format.
#[inline(always)]
fn number<T: Real>(high: f64, low: f64) -> T {
    T::constant(Dd::new(high, low))
}
";

/// Where the file comes from, and what it costs.
pub(super) fn header(generated: &Generated) -> String {
    let Generated { model, report, provenance, .. } = generated;
    let floating = model.floats();
    let mut out = String::new();
    let _ = writeln!(out, "// Dynamics of `{}` as straight-line code.", comment(&model.name));
    let _ = writeln!(
        out,
        "// Generated by straightline {} from {}; do not edit.",
        crate::VERSION,
        comment(&provenance.source)
    );
    let _ = writeln!(out, "// Inputs' hash: {:016x}", provenance.hash);
    if let Some(machine) = generated.target {
        let (name, memory) = (machine.row().name, generated.memory.word());
        let flags = machine.flags(generated.memory).join(" ");
        let _ = writeln!(out, "// For {name}, code in {memory}: rustc with --target {} {flags}", machine.row().triple);
    }
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
            "//   body {:<3} {} on {parent} by {kind} joint {}, {}",
            i + 1,
            comment(&b.name),
            comment(&b.joint.name),
            moved_by(model, i)
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
    skipped(&mut out, report);
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
    out
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

/// What moves the joint of a body: a coordinate of its own, or that of another joint.
fn moved_by(model: &Model<Dd>, body: usize) -> String {
    match model.coupling_of(body) {
        Some(coupling) => format!("that follows {}", coupling.in_words(model)),
        None if model.is_dependent(body) => format!("q[{}] that loops determine", model.bodies[body].joint.iq),
        None => format!("qd[{}]", model.bodies[body].joint.iv),
    }
}
