//! The module `contact` as text.

use super::file::{item_text, lanes_text, uses};
use super::{array_type, filler, indented, number_type, zero};
use crate::emit::module::{Item, ModeModule};
use crate::emit::Generated;
use crate::function::ContactFunction;
use crate::identifier::{comment, doc, string_literals, upper_camel_case};
use std::fmt::Write;
use straightline_graph::expr::Port;

/// The module of all modes; nothing for a scene without contacts.
pub(super) fn text(modes: &[ModeModule], generated: &Generated) -> String {
    if modes.is_empty() {
        return String::new();
    }
    let mut inner = String::new();
    enumeration(&mut inner, modes);
    for mode in modes {
        let mut text = String::new();
        constants(&mut text, mode);
        for item in &mode.items {
            text.push('\n');
            text.push_str(&item_text(item));
            text.push_str(&lanes_text(item, generated.lanes));
        }
        let _ = writeln!(inner, "\n/// Mode `{}`.\npub mod {} {{", doc(&mode.name), mode.identifier);
        let calls_kernel = mode.items.iter().any(Item::calls_kernel);
        inner.push_str(&indented(&uses("super::super", calls_kernel, generated)));
        let ports = mode.items.iter().flat_map(Item::inputs);
        let mut wrappers: Vec<&String> = ports.filter_map(|p| p.wrapper.as_ref()).collect();
        wrappers.sort();
        wrappers.dedup();
        for wrapper in wrappers {
            let _ = writeln!(inner, "    use super::super::{wrapper};");
        }
        inner.push_str(&indented(&text));
        inner.push_str("}\n");
    }
    dispatch(&mut inner, modes);
    let mut out = String::from(
        "\n/// The robot in contact: functions per contact mode.\n///\n\
         /// s are the functional coordinates of a contact, F the reactions along the constrained ones: positive pushes the robot\n\
         /// off. Which mode it is the caller decides: a contact closes when s reaches zero, and opens when F changes sign.\n\
         pub mod contact {\n",
    );
    out.push_str(&indented(&inner));
    out.push_str("}\n");
    out
}

fn enumeration(out: &mut String, modes: &[ModeModule]) {
    out.push_str("/// The contact modes.\n#[derive(Clone, Copy, Debug, PartialEq, Eq)]\npub enum Mode {\n");
    for mode in modes {
        let _ = writeln!(
            out,
            "    /// `{}`: {} constrained.\n    {},",
            doc(&mode.name),
            comment(&mode.constrained.join(", ")),
            upper_camel_case(&mode.identifier)
        );
    }
    out.push_str("}\n");
}

fn constants(out: &mut String, mode: &ModeModule) {
    for (name, doc, names) in [
        ("CONSTRAINED", "The constrained coordinates s^c, in order.", &mode.constrained),
        ("FREE", "The free coordinates s^f, in order.", &mode.free),
    ] {
        let _ = writeln!(
            out,
            "/// {doc}\npub const {name}: [&str; {}] = [{}];",
            names.len(),
            string_literals(names.iter().map(String::as_str))
        );
    }
}

/// Forward dynamics of any mode, where all take the same inputs and have results of the same kinds.
fn dispatch(out: &mut String, modes: &[ModeModule]) {
    let of = |m: &'_ ModeModule| m.items.iter().position(|i| i.function == ContactFunction::ForwardDynamics);
    let forward: Vec<&Item<_>> = modes.iter().filter_map(|m| Some(&m.items[of(m)?])).collect();
    let (Some(first), true) = (forward.first(), forward.len() == modes.len()) else { return };
    if forward.iter().any(|p| p.inputs() != first.inputs() || p.outputs().len() != 5) {
        return;
    }
    let most = modes.iter().map(|m| m.constrained.len()).max().unwrap_or(0);
    let style = first.routine.style;
    let (t, zero, generics) = (number_type(style), zero(style), if style.generic { "<T: super::Real>" } else { "" });
    let parameter = |p: &Port| {
        let module = if p.wrapper.is_some() { "super::" } else { "" };
        format!("{}: &{module}{}, ", p.name, array_type(p, style))
    };
    let parameters: String = first.inputs().iter().map(parameter).collect();
    let arguments: String = first.inputs().iter().map(|p| format!("{}, ", p.name)).collect();
    let qdd = array_type(&first.outputs()[0], style);
    let filler = filler(first.inputs().iter().filter(|p| p.wrapper.is_none()));
    let _ = write!(
        out,
        "\n/// The most constrained coordinates that a mode has.\npub const MOST_CONSTRAINED: usize = {most};\n\n\
         /// `forward_dynamics` of a mode; reactions stand in the order of the mode's `CONSTRAINED`, zeros after them. Gives the\n\
         /// least pivot.\npub fn forward_dynamics{generics}(mode: Mode, {parameters}qdd: &mut {qdd}, force: &mut [{t}; {most}]) -> {t} {{\n    \
         let mut pivot = [{zero}];\n    match mode {{\n"
    );
    for mode in modes {
        let (m, id) = (mode.constrained.len(), &mode.identifier);
        let forces = (0..most).map(|i| if i < m { format!("f[{i}]") } else { zero.to_string() });
        let _ = write!(
            out,
            "        Mode::{} => {{\n            let (mut f, mut sdd, mut violation) = ([{filler}; {m}], [{filler}; {m}], [{filler}; {m}]);\n            \
             {id}::forward_dynamics({arguments}qdd, &mut f, &mut sdd, &mut violation, &mut pivot);\n            \
             *force = [{}];\n        }}\n",
            upper_camel_case(id),
            forces.collect::<Vec<_>>().join(", ")
        );
    }
    out.push_str("    }\n    pivot[0]\n}\n");
}
