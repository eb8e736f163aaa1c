//! What is said above every function.

use crate::choices::WrittenEntries;
use crate::function::{ContactFunction, ContactPort, Function, Output, PerContact, Quantity};
use crate::identifier;
use crate::options::Options;
use crate::program::contact::Mode;
use crate::program::nonzeros::NonzeroEntries;
use crate::scene::{Parameter, ResultPart, Scene};
use std::fmt::Write;
use straightline_graph::expr::{Graph, Port};

impl Function {
    /// Its documentation in generated code, for the inputs that a scene leaves it.
    pub fn doc(self, inputs: &[Port], scene: &Scene) -> String {
        let mut doc = format!("{}\n\n", self.summary());
        for port in inputs {
            let known = Quantity::of(port).map(Quantity::doc);
            let of_scene = || scene.parameters.iter().find(|p| p.input_name() == port.name).map(Parameter::in_words);
            let text = known.or_else(of_scene).unwrap_or_default();
            doc.push_str(&format!("* `{}`: {text}\n", port.name));
        }
        let is_wanted = |output: &&Output| scene.outputs.get(&self).is_none_or(|s| s.has(output.name));
        for output in self.spec().outputs.iter().filter(is_wanted) {
            doc.push_str(&format!("* `{}`: {}\n", output.name, output.doc));
        }
        if scene.by_columns && self.spec().outputs.iter().any(Output::is_by_columns) {
            doc.push_str("\nThe matrix is written column after column: its first index is the column's.\n");
        }
        if let Some(selection) = scene.outputs.get(&self) {
            for (what, names) in [("joints", &selection.joints), ("frames", &selection.frames)] {
                if !names.is_empty() {
                    let names: Vec<String> = names.iter().map(|name| identifier::doc(name)).collect();
                    doc.push_str(&format!("\nOnly for the {what} {}.\n", names.join(", ")));
                }
            }
            match selection.part {
                ResultPart::Whole => {}
                ResultPart::Linear => doc.push_str("\nOnly the linear part: positions, linear rows, forces.\n"),
                ResultPart::Angular => doc.push_str("\nOnly the angular part: orientations, angular rows, moments.\n"),
                ResultPart::Diagonal => doc.push_str("\nOnly the diagonal.\n"),
                ResultPart::Rows(rows) => doc.push_str(&format!("\nOnly the rows {}.\n", rows.words().join(", "))),
            }
        }
        doc
    }
}

/// What is said of the entries of matrices that can be non-zero.
pub(super) fn of_entries(function: Function, entries: &[NonzeroEntries], options: &Options) -> String {
    let mut doc = String::new();
    for of in entries {
        let [(starts, ..), (columns, ..)] = of.constants(function.name());
        let output = &of.output;
        let _ = match options.entries {
            WrittenEntries::Nonzeros => {
                let lower = if of.is_triangle { " of the lower triangle (the matrix is symmetric)" } else { "" };
                writeln!(
                    doc,
                    "\nOf `{output}` the entries{lower} that can be non-zero, row by row: [`{starts}`], [`{columns}`]."
                )
            }
            _ => writeln!(doc, "\nWhich entries of `{output}` can be non-zero: [`{starts}`], [`{columns}`]."),
        };
    }
    doc
}

/// A sentence behind others on what joints add to forces without a column in the regressor.
pub(super) fn of_no_column(left_out: &[(&str, Vec<String>)]) -> String {
    let of_joints = |(word, joints): &(&str, Vec<String>)| {
        let joints: Vec<String> = joints.iter().map(|joint| identifier::doc(joint)).collect();
        format!("`{word}` of {}", joints.join(", "))
    };
    match left_out {
        [] => String::new(),
        all => {
            let all = all.iter().map(of_joints).collect::<Vec<_>>().join("; ");
            format!(" Y β is without what has no column: {all}. `[regressor]` in a scene gives it columns.")
        }
    }
}

/// What is said above a function of a contact mode.
pub(super) fn of_contact(function: ContactFunction, (mode, scene): (&Mode, &Scene), ports: &Graph) -> String {
    let summary = function.summary();
    let of_scene = |name: &str| scene.parameters.iter().find(|p| p.input_name() == name).map(Parameter::in_words);
    let mut doc = format!("{summary}\n\nMode `{}`.\n\n", identifier::doc(&mode.name));
    for port in ports.inputs.iter().chain(&ports.outputs) {
        let name = port.name.as_str();
        let suffix = |s: &str| name.ends_with(s);
        let own = documented(function, mode, name);
        let text = match name {
            "q" => "configuration \\[rad or m\\]",
            "qd" => "velocities \\[rad/s or m/s\\]",
            "tau" => "generalized forces \\[N·m or N\\]",
            "x" => "state of the drives, as of `driven_forward_dynamics` of the robot",
            "u" => "inputs of the drives \\[V, or as in the robot file\\]",
            "gravity" => "acceleration due to gravity in the world \\[m/s²\\]",
            "qdd" => "accelerations \\[rad/s² or m/s²\\]",
            _ if own.is_some() => own.unwrap_or_default(),
            _ if suffix("_axes") => "tool axis and an axis across it, unit vectors in the frame",
            _ if suffix("_pose") => "the object in the world: origin \\[m\\], then its axes X, Y, Z",
            _ if suffix("_velocity") => "of the object's origin \\[m/s\\], then angular \\[rad/s\\], world axes",
            _ if suffix("_acceleration") => "of the object's origin \\[m/s²\\], then angular \\[rad/s²\\], world axes",
            _ if suffix("_environment") => "numbers of the environment, in the order of the scene's documentation",
            _ => &of_scene(name).unwrap_or_default(),
        };
        let _ = writeln!(doc, "* `{name}`: {text}");
    }
    doc
}

/// What the row of a function says of one of its inputs or results in a mode.
fn documented(function: ContactFunction, mode: &Mode, name: &str) -> Option<&'static str> {
    let contacts: Vec<String> = mode.contacts.iter().map(|c| c.item.identifier()).collect();
    let is_named = |port: &&ContactPort| match port.per {
        PerContact::No => port.name == name,
        _ => contacts.iter().any(|contact| port.name_for(contact) == name),
    };
    function.spec().inputs.iter().chain(function.spec().outputs).find(is_named).map(|port| port.doc)
}

/// The name of a function over lanes.
pub(super) fn lanes_name(name: &str) -> String {
    format!("{name}_lanes")
}

/// What stands above the function over lanes.
pub(super) fn lanes_doc(name: &str) -> String {
    format!(
        "[`{name}`] of `N` states at once: every number there is an array here, with a number per state.\n\n\
         Each state gets the bits that it gets alone. The body becomes part of its caller, compiled for the caller's\n\
         instructions; 8 lanes of f64 fill an AVX-512 register, 4 an AVX one."
    )
}

/// The same text with its links, ``[`FRAME_NAMES`]``, as they are called elsewhere.
pub(super) fn relinked(text: &str, link: &dyn Fn(&str) -> String) -> String {
    let mut parts = text.split("[`");
    let first = parts.next().unwrap_or_default().to_string();
    parts.fold(first, |out, part| match part.split_once("`]") {
        Some((name, rest)) => out + &link(name) + rest,
        None => out + "[`" + part,
    })
}
