//! Lanes and batches beside a plain function: its body over lanes, and the two functions over slices that run it.

use super::body::ALLOW;
use super::{function, indented, pasted, Item, Style};
use crate::choices::Lanes;
use crate::identifier::upper_camel_case;
use std::fmt::Write;
use straightline_graph::expr::{Graph, Port, Section};
use straightline_graph::schedule::Schedule;

/// The drivers' source, pasted as it is where generated code depends on `core` alone.
const BATCH: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../runtime/core/src/batch.rs"));

/// The function over lanes, and what runs it on batches.
pub fn lanes(
    item: &Item,
    (graph, schedule): (&Graph, &Schedule),
    style: Style,
    drivers: Lanes,
    title: &dyn Fn(Section) -> String,
) -> String {
    let name = item.function.name();
    let body = body_name(name, style);
    let lanes = style.lanes();
    if !style.fused {
        let text = function(graph, schedule, &body, &lanes_doc(name), lanes, title).text;
        return text + &batches(item, style, drivers);
    }
    let doc = format!("[`{}`], fused as the caller says.", lanes_name(name));
    let text = function(graph, schedule, &body, &doc, lanes, title).text.replacen("pub fn ", "fn ", 1);
    let inputs = item.inputs.iter().map(|p| format!("{}: &{}", p.name, lanes.array_type(p)));
    let outputs = item.outputs.iter().map(|p| format!("{}: &mut {}", p.name, lanes.array_type(p)));
    let signature: Vec<String> = inputs.chain(outputs).collect();
    let arguments: Vec<&str> = item.inputs.iter().chain(&item.outputs).map(|p| p.name.as_str()).collect();
    let doc: String = lanes_doc(name).lines().map(|l| format!("/// {l}\n").replace("/// \n", "///\n")).collect();
    format!(
        "{doc}{ALLOW}\n#[inline(always)]\npub fn {}<const N: usize>({}) {{\n    {body}::<N, FUSED>({})\n}}\n\n{text}{}",
        lanes_name(name),
        signature.join(", "),
        arguments.join(", "),
        batches(item, style, drivers)
    )
}

/// The name of the body over lanes: the public function, or one that is also told whether to fuse.
fn body_name(name: &str, style: Style) -> String {
    match style.fused {
        true => format!("{name}_in_lanes"),
        false => lanes_name(name),
    }
}

/// The name of a function over lanes.
fn lanes_name(name: &str) -> String {
    format!("{name}_lanes")
}

/// What stands above the function over lanes.
fn lanes_doc(name: &str) -> String {
    format!(
        "[`{name}`] of `N` states at once: every number there is an array here, with a number per state.\n\n\
         Each state gets the bits that it gets alone. The body becomes part of its caller, compiled for the caller's\n\
         instructions; 8 lanes of f64 fill an AVX-512 register, 4 an AVX one."
    )
}

/// The functions over slices that run `item` on many states, and the program that they run.
fn batches(item: &Item, style: Style, drivers: Lanes) -> String {
    let name = item.function.name();
    let scalar = style.scalar.name();
    let program = format!("{}Program", upper_camel_case(name));
    let (shared, inputs): (Vec<&Port>, Vec<&Port>) = item.inputs.iter().partition(|p| p.wrapper.is_some());
    let outputs: Vec<&Port> = item.outputs.iter().collect();
    let width = |ports: &[&Port]| ports.iter().map(|p| p.len()).sum::<usize>();
    let (width_in, width_out) = (width(&inputs), width(&outputs));
    let mut out = String::new();

    // the program: a struct of what all states share
    let (lifetime, any) = if shared.is_empty() { ("", "") } else { ("<'a>", "<'_>") };
    let fields: Vec<String> =
        shared.iter().map(|p| format!("    {}: &'a {},\n", p.name, style.array_type(p))).collect();
    let body = if fields.is_empty() { ";".to_string() } else { format!(" {{\n{}}}", fields.concat()) };
    let arguments: Vec<String> = item
        .inputs
        .iter()
        .map(|p| if p.wrapper.is_some() { format!("self.{}", p.name) } else { reshaped(p, false) })
        .chain(item.outputs.iter().map(|p| reshaped(p, true)))
        .collect();
    let _ = write!(
        out,
        "\n/// [`{name}`] as the batches run it.\nstruct {program}{lifetime}{body}\n\n\
         impl batch::Program<{scalar}, {width_in}, {width_out}> for {program}{any} {{\n    \
             #[inline(always)]\n    \
             fn run<const N: usize, const FUSED: bool>(&self, x: &[[{scalar}; N]; {width_in}], y: &mut [[{scalar}; N]; \
             {width_out}]) {{\n        \
                 let (mut x, mut y) = (x.as_slice(), y.as_mut_slice());\n        \
                 {}{}(\n            {},\n        );\n    }}\n}}\n",
        body_name(name, style),
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
    let parallel: &[bool] = if drivers == Lanes::Runtime { &[false, true] } else { &[false] };
    for &parallel in parallel {
        let mut items = String::new();
        for layout in [Layout::Soa, Layout::Aos] {
            items.push_str(&batch(item, style, layout, &makes, parallel));
        }
        match parallel {
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

/// One function over slices; its name and its parameters are those of [`batch_signature`].
fn batch(item: &Item, style: Style, layout: Layout, program: &str, parallel: bool) -> String {
    let scalar = style.scalar.name();
    let inputs: Vec<&Port> = item.inputs.iter().filter(|p| p.wrapper.is_none()).collect();
    let mut checks = String::new();
    for p in inputs.iter().copied().chain(&item.outputs) {
        let _ = writeln!(checks, "    batch::check(\"{0}\", {0}, n, {1})?;", p.name, p.len());
    }
    let list = |ports: &mut dyn Iterator<Item = &Port>| {
        let one = |p: &Port| match layout {
            Layout::Soa => p.name.clone(),
            Layout::Aos => format!("({}, {})", p.name, p.len()),
        };
        ports.map(one).collect::<Vec<_>>().join(", ")
    };
    let word = layout.word();
    let run = if parallel { "run_parallel" } else { "run" };
    format!(
        "\n{doc}pub fn {signature} {{\n{checks}    \
         batch::{run}_{scalar}(batch::{word}(&{program}, n, [{}], [{}]));\n    Ok(())\n}}\n",
        list(&mut inputs.iter().copied()),
        list(&mut item.outputs.iter()),
        doc = batch_doc(item, layout, parallel),
        signature = batch_signature(item, style, layout, parallel, ""),
    )
}

impl Layout {
    fn word(self) -> &'static str {
        match self {
            Layout::Soa => "soa",
            Layout::Aos => "aos",
        }
    }
}

fn batch_doc(item: &Item, layout: Layout, parallel: bool) -> String {
    let name = item.function.name();
    let place = match layout {
        Layout::Soa => "component `c` of state `s` at `[c * n + s]`",
        Layout::Aos => "component `c` of state `s`, of `w` components, at `[s * w + c]`",
    };
    let threads = if parallel { ", on the threads of rayon" } else { "" };
    let matrix = if item.outputs.iter().any(|p| p.shape.len() > 1) {
        "\n/// The components of a matrix follow one another row by row."
    } else {
        ""
    };
    format!(
        "/// [`{name}`] of `n` states{threads}: {place}.{matrix}\n///\n/// # Errors\n\
         /// A slice does not hold `n` states; nothing is written.\n"
    )
}

/// `name_batch_soa(n: usize, q: &[f64], …) -> Result<(), batch::WrongLength>`; `module` stands before types of the file.
fn batch_signature(item: &Item, style: Style, layout: Layout, parallel: bool, module: &str) -> String {
    let scalar = style.scalar.name();
    let inputs = item.inputs.iter().map(|p| match &p.wrapper {
        Some(wrapper) => format!("{}: &{module}{wrapper}", p.name),
        None => format!("{}: &[{scalar}]", p.name),
    });
    let outputs = item.outputs.iter().map(|p| format!("{}: &mut [{scalar}]", p.name));
    let parameters: Vec<String> = ["n: usize".to_string()].into_iter().chain(inputs).chain(outputs).collect();
    let parallel = if parallel { "_parallel" } else { "" };
    format!(
        "{}_batch_{}{parallel}({}) -> Result<(), {module}batch::WrongLength>",
        item.function.name(),
        layout.word(),
        parameters.join(", ")
    )
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
pub fn associated(item: &Item, style: Style, drivers: Lanes) -> String {
    let name = item.function.name();
    let mut out = String::new();
    let lanes = style.lanes();
    let module = |p: &Port| if p.wrapper.is_some() { "dynamics::" } else { "" };
    let inputs = item.inputs.iter().map(|p| format!("{}: &{}{}", p.name, module(p), lanes.array_type(p)));
    let outputs = item.outputs.iter().map(|p| format!("{}: &mut {}", p.name, lanes.array_type(p)));
    let signature: Vec<String> = inputs.chain(outputs).collect();
    let arguments: Vec<&str> = item.inputs.iter().chain(&item.outputs).map(|p| p.name.as_str()).collect();
    let arguments = arguments.join(", ");
    let of_self = |doc: &str| doc.replace(&format!("[`{name}`]"), &format!("[`Self::{name}`]"));
    for line in of_self(&lanes_doc(name)).lines() {
        let _ = writeln!(out, "/// {line}");
    }
    let _ = writeln!(
        out,
        "#[inline(always)]\npub fn {0}<const N: usize>({1}) {{\n    dynamics::{0}({arguments})\n}}",
        lanes_name(name),
        signature.join(", "),
    );
    let parallel: &[bool] = if drivers == Lanes::Runtime { &[false, true] } else { &[false] };
    for &parallel in parallel {
        let mut items = String::new();
        for layout in [Layout::Soa, Layout::Aos] {
            let signature = batch_signature(item, style, layout, parallel, "dynamics::");
            let function = &signature[..signature.find('(').unwrap_or_default()];
            let _ = writeln!(
                items,
                "{}pub fn {signature} {{\n    dynamics::{function}(n, {arguments})\n}}",
                of_self(&batch_doc(item, layout, parallel)),
            );
        }
        match parallel {
            true => {
                let _ = writeln!(out, "::straightline::with_threads! {{\n{items}}}");
            }
            false => out.push_str(&items),
        }
    }
    out
}

/// The module `batch` of a file.
pub fn module(drivers: Lanes) -> String {
    match drivers {
        Lanes::Runtime => "\npub use ::straightline::batch;\n".to_string(),
        Lanes::Standalone => {
            let mut out = String::from("\n/// Batches: programs in lanes over slices.\n#[allow(dead_code, clippy::all, clippy::pedantic)]\npub mod batch {\n");
            out.push_str(&pasted(BATCH));
            out + "}\n"
        }
    }
}

/// The source of the drivers, as a module of its own.
pub fn drivers() -> &'static str {
    BATCH
}
