//! The module `staged` as text.

use super::{array_type, filler, indented, routine};
use crate::emit::module::StagedModule;
use crate::emit::{Routine, Style};
use crate::function::Function;
use crate::program::staged::StageType;
use std::fmt::Write;
use std::iter::once;
use straightline_graph::expr::Port;

/// The module.
pub(super) fn text(module: &StagedModule, style: Style) -> String {
    let StagedModule { stages, values, functions } = module;
    let mut items = String::new();
    for (s, stored) in values.iter().enumerate() {
        let methods: String = functions
            .iter()
            // what the last stage makes is called on the stage before it
            .filter(|(_, own, _)| (*own).min(values.len() - 1) == s)
            .map(|(f, _, program)| method(*f, program, stages, s))
            .collect();
        items.push_str(&stage_type(stages, s, stored, &methods));
        items.push_str(&routine(stored));
    }
    for (_, _, program) in functions {
        items.push('\n');
        items.push_str(&routine(program));
    }
    let mut out = String::from(
        "\n/// The same functions in stages: what changes rarely is computed once.\n///\n\
         /// A later stage borrows the earlier one: a value of a stage that is out of date does not compile.\n\
         pub mod staged {\n",
    );
    if style.fused {
        out.push_str("    #[allow(unused_imports)]\n    use super::fused::{self, fma};\n");
    }
    if module.calls_kernel() {
        out.push_str("    use super::trig;\n");
    }
    let wrappers: Vec<&str> =
        values.iter().flat_map(|r| &r.ports.inputs).filter_map(|p| p.wrapper.as_deref()).collect();
    if !wrappers.is_empty() {
        let _ = writeln!(out, "    use super::{{{}}};", wrappers.join(", "));
    }
    out.push_str(&indented(&items));
    out.push_str("}\n");
    out
}

/// The struct of a stage, its constructor, and the methods that it serves.
fn stage_type(stages: &[StageType], s: usize, program: &Routine, methods: &str) -> String {
    let stage = &stages[s];
    let (inputs, style) = (&program.ports.inputs, program.style);
    let stored: usize = program.ports.outputs.iter().map(Port::len).sum();
    let (name, t) = (stage.type_name, style.scalar.name());
    let lifetime = if s > 0 { "<'a>" } else { "" };
    let earlier = (s > 0).then(|| &stages[s - 1]);
    let field = earlier.map_or(String::new(), |e| {
        let inner = if s > 1 { "<'a>" } else { "" };
        format!("    {}: &'a {}{inner},\n", e.values, e.type_name)
    });
    let own: Vec<&Port> = inputs.iter().filter(|p| !stages.iter().any(|e| e.values == p.name)).collect();
    let parameters: Vec<String> = own.iter().map(|p| format!("{}: &{}", p.name, array_type(p, style))).collect();
    let filler = filler(own.iter().copied());
    let mut out = format!(
        "\n/// {}\n#[derive(Clone, Debug)]\npub struct {name}{lifetime} {{\n{field}    values: [{t}; {stored}],\n}}\n",
        stage.doc
    );
    let make = |receiver: &str| {
        let reached = inputs.iter().map(|p| reach(stages, s, &p.name, receiver));
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
fn reach(stages: &[StageType], s: usize, name: &str, receiver: &str) -> String {
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
fn method(function: Function, program: &Routine, stages: &[StageType], s: usize) -> String {
    let (ports, style) = (&program.ports, program.style);
    let own = ports.inputs.iter().filter(|p| !stages.iter().any(|e| e.values == p.name));
    let parameters = own.map(|p| format!(", {}: &{}", p.name, array_type(p, style)));
    let results = ports.outputs.iter().map(|p| format!(", {}: &mut {}", p.name, array_type(p, style)));
    let parameters: String = parameters.chain(results).collect();
    let inputs = ports.inputs.iter().map(|p| reach(stages, s + 1, &p.name, "self"));
    let arguments: Vec<String> = inputs.chain(ports.outputs.iter().map(|p| p.name.clone())).collect();
    let (name, arguments) = (function.name(), arguments.join(", "));
    let summary = function.summary();
    format!("\n    /// {summary}\n    pub fn {name}(&self{parameters}) {{\n        {name}({arguments});\n    }}\n")
}
