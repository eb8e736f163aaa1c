//! The docstring of a function: what it computes, its inputs and results with shapes and units, from the compiler's tables.

use std::fmt::Write;
use straightline_codegen::function::Quantity;
use straightline_codegen::scene::Scene;
use straightline_codegen::Function;
use straightline_graph::expr::Port;

/// Inputs and results of a function, as its program has them.
pub struct FunctionPorts<'a> {
    /// What goes in.
    pub inputs: &'a [Port],
    /// What comes out.
    pub outputs: &'a [Port],
}

/// In the form of NumPy's docstrings.
pub fn of_function(function: Function, ports: &FunctionPorts<'_>, scene: &Scene) -> String {
    let spec = function.spec();
    let mut text = format!("{}\n", plain(spec.summary));
    if !spec.aliases.is_empty() {
        let _ = write!(text, "\nElsewhere: {}.\n", spec.aliases.join(", "));
    }
    text.push_str("\nParameters\n----------\n");
    for port in ports.inputs {
        let known = Quantity::of(port).map(Quantity::doc);
        let of_scene =
            || scene.parameters.iter().find(|p| p.input_name() == port.name).map(|parameter| parameter.in_words());
        section(&mut text, port, &known.or_else(of_scene).unwrap_or_default());
    }
    text.push_str(
        "out : array or tuple of arrays, optional\n    Where results are written.\n\
         threads : int, optional\n    Threads that share the states of a batch.\n\nReturns\n-------\n",
    );
    for port in ports.outputs {
        let output = spec.outputs.iter().find(|output| output.name == port.name);
        section(&mut text, port, output.map_or("", |output| output.doc));
    }
    text
}

fn section(text: &mut String, port: &Port, doc: &str) {
    let _ = writeln!(text, "{} : {}\n    {}", port.name, shape(port), plain(doc));
}

/// The shape for one state or many: `(..., 7)`.
pub fn shape(port: &Port) -> String {
    let axes: Vec<String> = port.shape.iter().map(|length| format!(", {length}")).collect();
    format!("(...{})", axes.concat())
}

/// Documentation without its marks; what generated code calls `FRAME_NAMES` and `JOINT_NAMES` are attributes here.
fn plain(doc: &str) -> String {
    let mut text = doc.replace("\\[", "[").replace("\\]", "]");
    while let Some((before, rest)) = text.split_once("[`") {
        let Some((name, behind)) = rest.split_once("`]") else { break };
        let name = if name == "FRAME_NAMES" { "frames".to_string() } else { name.to_lowercase() };
        text = format!("{before}`{name}`{behind}");
    }
    text
}
