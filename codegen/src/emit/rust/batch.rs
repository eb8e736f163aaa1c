//! Lanes and batches beside a plain function: its body over lanes, and the functions over slices that run it.

use super::associated::{arguments, of_self, parameters};
use super::{array_type, doc, indented, pasted, routine, ALLOW};
use crate::choices::Lanes;
use crate::emit::doc::{lanes_doc, lanes_name};
use crate::emit::module::{Item, Routine};
use crate::emit::Style;
use crate::identifier::upper_camel_case;
use std::fmt::Write;
use straightline_graph::expr::Port;

/// The drivers' source, pasted as it is where generated code depends on `core` alone.
const BATCH: &str = straightline_core::sources::BATCH;

/// The function over lanes, and what runs it on batches.
pub(super) fn lanes<F>(item: &Item<F>, body: &Routine, drivers: Lanes) -> String {
    let text = routine(body) + &batches(item, body, drivers);
    if !body.style.fused {
        return text;
    }
    let public = public_lanes(item, body.style, "");
    let (doc, body) = (doc(&lanes_doc(item.name())), &body.name);
    let call = format!("{body}::<N, FUSED>({})", arguments(item));
    format!("{doc}{ALLOW}\n#[inline(always)]\n{public} {{\n    {call}\n}}\n\n{text}")
}

/// The head of the public function over lanes; `module` stands before types of the file.
fn public_lanes<F>(item: &Item<F>, style: Style, module: &str) -> String {
    format!("pub fn {}<const N: usize>({})", lanes_name(item.name()), parameters(item, style.lanes(), module))
}

/// The functions over slices that run `item` on many states, and the program that they run.
fn batches<F>(item: &Item<F>, body: &Routine, drivers: Lanes) -> String {
    let style = Style { lanes: false, ..body.style };
    let scalar = style.scalar.name();
    let program = format!("{}Program", upper_camel_case(item.name()));
    let (shared, inputs): (Vec<&Port>, Vec<&Port>) = item.inputs().iter().partition(|p| p.wrapper.is_some());
    let outputs: Vec<&Port> = item.outputs().iter().collect();
    let width = |ports: &[&Port]| ports.iter().map(|p| p.len()).sum::<usize>();
    let (width_in, width_out) = (width(&inputs), width(&outputs));
    let mut out = String::new();

    // the program: a struct of what all states share
    let (lifetime, any) = if shared.is_empty() { ("", "") } else { ("<'a>", "<'_>") };
    let fields: Vec<String> =
        shared.iter().map(|p| format!("    {}: &'a {},\n", p.name, array_type(p, style))).collect();
    let fields_text = if fields.is_empty() { ";".to_string() } else { format!(" {{\n{}}}", fields.concat()) };
    let arguments: Vec<String> = item
        .inputs()
        .iter()
        .map(|p| if p.wrapper.is_some() { format!("self.{}", p.name) } else { reshaped(p, false) })
        .chain(outputs.iter().map(|p| reshaped(p, true)))
        .collect();
    let _ = write!(
        out,
        "\n/// [`{}`] as the batches run it.\nstruct {program}{lifetime}{fields_text}\n\n\
         impl batch::Program<{scalar}, {width_in}, {width_out}> for {program}{any} {{\n    \
             #[inline(always)]\n    \
             fn run<const N: usize, const FUSED: bool>(&self, x: &[[{scalar}; N]; {width_in}], y: &mut [[{scalar}; N]; \
             {width_out}]) {{\n        \
                 let (mut x, mut y) = (x.as_slice(), y.as_mut_slice());\n        \
                 {}{}(\n            {},\n        );\n    }}\n}}\n",
        item.name(),
        body.name,
        if style.fused { "::<N, FUSED>" } else { "" },
        arguments.join(",\n            "),
    );

    let makes = match shared.as_slice() {
        [] => program.clone(),
        shared => {
            let fields: Vec<&str> = shared.iter().map(|p| p.name.as_str()).collect();
            format!("{program} {{ {} }}", fields.join(", "))
        }
    };
    for (is_parallel, batches) in Batch::all(item, style, drivers) {
        let items: String = batches.iter().map(|b| b.function(&makes)).collect();
        match is_parallel {
            true => {
                let _ = writeln!(out, "\n::straightline::with_threads! {{{}}}", indented(&items));
            }
            false => out.push_str(&items),
        }
    }
    out
}

/// Structure of arrays, or array of structures.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Layout {
    Soa,
    Aos,
}

impl Layout {
    fn word(self) -> &'static str {
        match self {
            Layout::Soa => "soa",
            Layout::Aos => "aos",
        }
    }
}

/// One function over slices.
struct Batch<'a, F> {
    item: &'a Item<F>,
    style: Style,
    layout: Layout,
    is_parallel: bool,
}

impl<'a, F> Batch<'a, F> {
    /// Those of an item: on one thread, and on several where there are any.
    fn all(item: &'a Item<F>, style: Style, drivers: Lanes) -> Vec<(bool, [Batch<'a, F>; 2])> {
        let parallel: &[bool] = if drivers == Lanes::Runtime { &[false, true] } else { &[false] };
        let batch = |layout, is_parallel| Batch { item, style, layout, is_parallel };
        parallel.iter().map(|&p| (p, [Layout::Soa, Layout::Aos].map(|layout| batch(layout, p)))).collect()
    }

    fn name(&self) -> String {
        let parallel = if self.is_parallel { "_parallel" } else { "" };
        format!("{}_batch_{}{parallel}", self.item.name(), self.layout.word())
    }

    fn doc(&self) -> String {
        let place = match self.layout {
            Layout::Soa => "component `c` of state `s` at `[c * n + s]`",
            Layout::Aos => "component `c` of state `s`, of `w` components, at `[s * w + c]`",
        };
        let threads = if self.is_parallel { ", on the threads of rayon" } else { "" };
        let is_matrix = self.item.outputs().iter().any(|p| p.shape.len() > 1);
        let matrix = if is_matrix { "\nThe components of a matrix follow one another row by row." } else { "" };
        let name = self.item.name();
        format!(
            "[`{name}`] of `n` states{threads}: {place}.{matrix}\n\n# Errors\n\
             A slice does not hold `n` states; nothing is written."
        )
    }

    /// `pub fn name_batch_soa(n: usize, q: &[f64], …) -> Result<(), batch::WrongLength>`; `module` stands before types of the file.
    fn head(&self, module: &str) -> String {
        let scalar = self.style.scalar.name();
        let inputs = self.item.inputs().iter().map(|p| match &p.wrapper {
            Some(wrapper) => format!("{}: &{module}{wrapper}", p.name),
            None => format!("{}: &[{scalar}]", p.name),
        });
        let outputs = self.item.outputs().iter().map(|p| format!("{}: &mut [{scalar}]", p.name));
        let parameters: Vec<String> = ["n: usize".to_string()].into_iter().chain(inputs).chain(outputs).collect();
        let (name, parameters) = (self.name(), parameters.join(", "));
        format!("pub fn {name}({parameters}) -> Result<(), {module}batch::WrongLength>")
    }

    /// The function; `program` makes what it runs.
    fn function(&self, program: &str) -> String {
        let inputs = || self.item.inputs().iter().filter(|p| p.wrapper.is_none());
        let outputs = self.item.outputs();
        let mut checks = String::new();
        for p in inputs().chain(outputs) {
            let _ = writeln!(checks, "    batch::check(\"{0}\", {0}, n, {1})?;", p.name, p.len());
        }
        let list = |ports: &mut dyn Iterator<Item = &Port>| {
            let one = |p: &Port| match self.layout {
                Layout::Soa => p.name.clone(),
                Layout::Aos => format!("({}, {})", p.name, p.len()),
            };
            ports.map(one).collect::<Vec<_>>().join(", ")
        };
        let (word, scalar) = (self.layout.word(), self.style.scalar.name());
        let run = if self.is_parallel { "run_parallel" } else { "run" };
        format!(
            "\n{}{} {{\n{checks}    batch::{run}_{scalar}(batch::{word}(&{program}, n, [{}], [{}]));\n    Ok(())\n}}\n",
            doc(&self.doc()),
            self.head(""),
            list(&mut inputs()),
            list(&mut outputs.iter()),
        )
    }
}

/// A port taken off the flat components, in its shape.
fn reshaped(port: &Port, is_output: bool) -> String {
    let (mut_, of) = if is_output { ("_mut", "y") } else { ("", "x") };
    let mut text = format!("batch::take{mut_}(&mut {of})");
    // the innermost extent first: [30] becomes [[5]; 6], then [[[5]; 3]; 2]
    let mut outer = port.len();
    for extent in port.shape[1..].iter().rev() {
        let rows = outer / extent;
        text = format!("batch::rows{mut_}::<_, {outer}, {rows}, {extent}>({text})");
        outer = rows;
    }
    text
}

/// Functions of the module `dynamics` as associated functions: lanes and batches of one item.
pub(super) fn associated<F>(item: &Item<F>, style: Style, drivers: Lanes) -> String {
    let arguments = arguments(item);
    let mut out = doc(&of_self(&lanes_doc(item.name())));
    let (head, name) = (public_lanes(item, style, "dynamics::"), lanes_name(item.name()));
    let _ = writeln!(out, "#[inline(always)]\n{head} {{\n    dynamics::{name}({arguments})\n}}");
    for (is_parallel, batches) in Batch::all(item, style, drivers) {
        let mut items = String::new();
        for batch in batches {
            let (doc, head, name) = (doc(&of_self(&batch.doc())), batch.head("dynamics::"), batch.name());
            let _ = writeln!(items, "{doc}{head} {{\n    dynamics::{name}(n, {arguments})\n}}");
        }
        match is_parallel {
            true => {
                let _ = writeln!(out, "::straightline::with_threads! {{\n{items}}}");
            }
            false => out.push_str(&items),
        }
    }
    out
}

/// The module `batch` of a file.
pub(super) fn module(drivers: Lanes) -> String {
    match drivers {
        Lanes::Runtime => "\npub use ::straightline::batch;\n".to_string(),
        Lanes::Standalone => format!(
            "\n/// Batches: programs in lanes over slices.\n#[allow(dead_code, clippy::all, clippy::pedantic)]\npub mod batch {{\n{}}}\n",
            pasted(BATCH)
        ),
    }
}

/// The source of the drivers, as a module of its own.
pub(super) fn drivers() -> &'static str {
    BATCH
}
