//! Constants and functions of a module as associated items of a type.

use super::constants::{cost, entries, error_bounds, figures, of_robot};
use super::{array_type, batch, doc, frames, self_test};
use crate::emit::doc::relinked;
use crate::emit::module::Item;
use crate::emit::{Generated, Style};
use crate::scene::Scene;
use std::collections::BTreeSet;
use std::fmt::Write;
use straightline_graph::expr::Port;

/// Constants and functions of the module `dynamics` as associated items of a type.
pub fn associated_items(generated: &Generated, scene: &Scene) -> String {
    let (mut out, mut taken) = (String::new(), BTreeSet::new());
    let of_functions = generated.report.functions.iter().flat_map(|(name, found)| {
        let bounds = error_bounds(name, found);
        let entries = entries(name, found);
        [cost(name, found)].into_iter().chain(figures(name, found, generated)).chain(entries).chain(bounds)
    });
    for constant in of_robot(generated).into_iter().chain(of_functions) {
        let (name, kind) = (&constant.name, constant.kind("dynamics::"));
        let _ = writeln!(out, "{}pub const {name}: {kind} = dynamics::{name};", doc(&of_self(&constant.doc)));
        taken.insert(constant.name);
    }
    for item in &generated.items {
        let (name, style) = (item.name(), generated.plain_style);
        let generic = if style.generic { "<T: ::straightline::Real>" } else { "" };
        let _ = writeln!(
            out,
            "{}{}#[inline]\npub fn {name}{generic}({}) {{\n    dynamics::{name}({})\n}}",
            doc(&of_self(&item.routine.doc)),
            item.function.alias_attribute(),
            parameters(item, style, "dynamics::"),
            arguments(item)
        );
        if let Some(lanes) = generated.lanes {
            out.push_str(&batch::associated(item, generated.style, lanes));
        }
    }
    out.extend(self_test::associated(generated));
    out + &frames::associated(generated, scene, taken)
}

/// A text about the module's items as one about the type's.
pub(super) fn of_self(text: &str) -> String {
    relinked(text, &|name| format!("[`Self::{name}`]"))
}

/// The parameters of a function, `q: &[f64; 7], tau: &mut [f64; 7]`; `module` stands before types of the file.
pub(super) fn parameters<F>(item: &Item<F>, style: Style, module: &str) -> String {
    let array = |p: &Port| format!("{}{}", if p.wrapper.is_some() { module } else { "" }, array_type(p, style));
    let inputs = item.inputs().iter().map(|p| format!("{}: &{}", p.name, array(p)));
    let outputs = item.outputs().iter().map(|p| format!("{}: &mut {}", p.name, array(p)));
    inputs.chain(outputs).collect::<Vec<_>>().join(", ")
}

/// What is handed on to a function by one of the same parameters.
pub(super) fn arguments<F>(item: &Item<F>) -> String {
    let ports = item.inputs().iter().chain(item.outputs());
    ports.map(|p| p.name.as_str()).collect::<Vec<_>>().join(", ")
}
