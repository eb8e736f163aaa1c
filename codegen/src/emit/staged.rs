//! The module `staged` as text.

use crate::emit::{self, array_type, indented};
use crate::equations::Robot;
use crate::function::Function;
use crate::options::Options;
use crate::program::equivalence::{Disagreement, Plainer};
use crate::program::staged::{programs, report, Programs, Stage, StagedReport};
use crate::program::written::WrittenStages;
use std::fmt::Write;
use std::iter::once;
use straightline_graph::expr::{Graph, Port, Section};
use straightline_graph::pass::cut::Staged;
use straightline_graph::schedule::schedule;
use straightline_graph::Scalar;

/// The module `staged` as text, its figures, what is plainer, and its programs.
///
/// # Errors
/// As [`programs`].
pub fn staged(
    robot: &Robot,
    frames: &[String],
    options: &Options,
    title: &dyn Fn(Section) -> String,
) -> Result<(String, StagedReport, Option<Plainer>, WrittenStages), Disagreement> {
    let (programs, plainer) = programs(robot, frames, options)?;
    let Programs { functions, staged, stages, .. } = &programs;
    let (text, report) = (text(functions, staged, stages, options, title), report(&programs));
    Ok((text, report, plainer, programs.written(options.scalar)))
}

fn text(
    functions: &[Function],
    staged: &Staged,
    stages: &[Stage],
    options: &Options,
    title: &dyn Fn(Section) -> String,
) -> String {
    let scalar = options.scalar;
    let mut items = String::new();
    let mut kernel = false;
    let mut private = |graph: &Graph, name: &str, doc: &str| {
        let text = emit::function(graph, &schedule(graph, options.limits), name, doc, options.style(), title);
        kernel |= text.calls_kernel();
        text.text.replacen("pub fn ", "fn ", 1)
    };
    let storing = stages.len() - 1;
    for (s, stage) in stages[..storing].iter().enumerate() {
        let graph = &staged.stages[s];
        let methods: String = functions
            .iter()
            .zip(&staged.functions)
            // what the last stage makes is called on the stage before it
            .filter(|(_, (own, _))| (*own).min(storing - 1) == s)
            .map(|(f, (_, g))| method(*f, g, stages, s, scalar))
            .collect();
        items.push_str(&stage_type(stages, s, graph, &methods, scalar));
        items.push_str(&private(
            graph,
            &format!("{}_values", stage.values),
            &format!("The values of a [`{}`].", stage.type_name),
        ));
    }
    for (f, (_, graph)) in functions.iter().zip(&staged.functions) {
        items.push('\n');
        items.push_str(&private(graph, f.name(), f.summary()));
    }
    let mut out = String::from(
        "\n/// The same functions in stages: what changes rarely is computed once.\n///\n\
         /// A later stage borrows the earlier one: a value of a stage that is out of date does not compile.\n\
         pub mod staged {\n",
    );
    if options.fma {
        out.push_str("    #[allow(unused_imports)]\n    use super::fused::{self, fma};\n");
    }
    let imports = if kernel { "    use super::trig;\n" } else { "" };
    out.push_str(imports);
    let wrappers: Vec<String> =
        staged.stages.iter().flat_map(|g| &g.inputs).filter_map(|p| p.wrapper.clone()).collect();
    if !wrappers.is_empty() {
        let _ = writeln!(out, "    use super::{{{}}};", wrappers.join(", "));
    }
    out.push_str(&indented(&items));
    out.push_str("}\n");
    out
}

/// The struct of a stage, its constructor, and the methods that it serves.
fn stage_type(stages: &[Stage], s: usize, graph: &Graph, methods: &str, scalar: Scalar) -> String {
    let stage = &stages[s];
    let (name, t, stored) = (stage.type_name, scalar.name(), graph.results.len());
    let lifetime = if s > 0 { "<'a>" } else { "" };
    let earlier = (s > 0).then(|| &stages[s - 1]);
    let field = earlier.map_or(String::new(), |e| {
        let inner = if s > 1 { "<'a>" } else { "" };
        format!("    {}: &'a {}{inner},\n", e.values, e.type_name)
    });
    let own: Vec<&Port> = graph.inputs.iter().filter(|p| !stages.iter().any(|e| e.values == p.name)).collect();
    let parameters: Vec<String> = own.iter().map(|p| format!("{}: &{}", p.name, array_type(p, scalar))).collect();
    let filler = emit::filler(own.iter().copied());
    let mut out = format!(
        "\n/// {}\n#[derive(Clone, Debug)]\npub struct {name}{lifetime} {{\n{field}    values: [{t}; {stored}],\n}}\n",
        stage.doc
    );
    let make = |receiver: &str| {
        let reached = graph.inputs.iter().map(|p| reach(stages, s, &p.name, receiver));
        let arguments: String = reached.map(|a| format!("{a}, ")).collect();
        format!("{}_values({arguments}&mut values);", stage.values)
    };
    let _ = write!(out, "\nimpl{lifetime} {name}{lifetime} {{\n");
    match earlier {
        None => {
            let _ = write!(
                out,
                "    /// Computes the stage.\n    #[must_use]\n    pub fn new({}) -> {name} {{\n        let mut values = [{filler}; {stored}];\n        {}\n        {name} {{ values }}\n    }}\n",
                parameters.join(", "),
                make("")
            );
        }
        Some(e) => {
            let inner = if s > 1 { "<'a>" } else { "" };
            let before = format!("{}: &'a {}{inner}", e.values, e.type_name);
            let parameters: Vec<String> = once(before).chain(parameters).collect();
            let _ = write!(
                out,
                "    /// Computes the stage on top of an earlier one.\n    #[must_use]\n    pub fn new({2}) -> {name}<'a> {{\n        let mut values = [{filler}; {stored}];\n        {1}\n        {name} {{ {0}, values }}\n    }}\n",
                e.values,
                make(e.values),
                parameters.join(", "),
            );
        }
    }
    out.push_str(methods);
    out.push_str("}\n\n");
    out
}

/// How stage `s`, as `receiver`, reaches the stored values or the input of that name. While stage `s` is being made its
/// receiver is the stage before it.
fn reach(stages: &[Stage], s: usize, name: &str, receiver: &str) -> String {
    match stages.iter().position(|stage| stage.values == name && !name.is_empty()) {
        // from the stage before `s` down to stage `k`
        Some(k) => {
            let path: String = (k..s - 1).rev().map(|i| format!(".{}", stages[i].values)).collect();
            format!("&{receiver}{path}.values")
        }
        None => name.to_string(),
    }
}

/// A method of stage `s` that calls the function's private program.
fn method(function: Function, graph: &Graph, stages: &[Stage], s: usize, scalar: Scalar) -> String {
    let own: Vec<&Port> = graph.inputs.iter().filter(|p| !stages.iter().any(|e| e.values == p.name)).collect();
    let parameters: String = own.iter().map(|p| format!(", {}: &{}", p.name, array_type(p, scalar))).collect();
    let results: String =
        graph.outputs.iter().map(|p| format!(", {}: &mut {}", p.name, array_type(p, scalar))).collect();
    let arguments: Vec<String> = graph.inputs.iter().map(|p| reach(stages, s + 1, &p.name, "self")).collect();
    let arguments: Vec<&str> =
        arguments.iter().map(String::as_str).chain(graph.outputs.iter().map(|p| p.name.as_str())).collect();
    format!(
        "\n    /// {}\n    pub fn {name}(&self{parameters}{results}) {{\n        {name}({});\n    }}\n",
        function.summary(),
        arguments.join(", "),
        name = function.name(),
    )
}
