//! What is said above every function.

use crate::function::{Function, Output, Quantity};
use crate::identifier;
use crate::scene::{Parameter, Part, Scene};
use straightline_graph::expr::Port;

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
        for output in self.spec().outputs {
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
                Part::Whole => {}
                Part::Linear => doc.push_str("\nOnly the linear part: positions, linear rows, forces.\n"),
                Part::Angular => doc.push_str("\nOnly the angular part: orientations, angular rows, moments.\n"),
                Part::Diagonal => doc.push_str("\nOnly the diagonal.\n"),
            }
        }
        doc
    }
}
