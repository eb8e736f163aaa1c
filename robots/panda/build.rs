//! The reference of the example: torques in double-double, by the handbook chapter's formulation, which reads the same robot file by
//! another route than the compiler.

use std::error::Error;
use std::path::Path;
use straightline_codegen::description;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::model::ModelOptions;
use straightline_codegen::verify::reference_input::centre_of_mass_tree;
use straightline_core::reference::{inverse_dynamics, natural_scale};
use straightline_core::Dd;

#[path = "src/motion.rs"]
mod motion;

const ROBOT: &str = "../descriptions/panda.urdf";

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed={ROBOT}");
    println!("cargo::rerun-if-changed=src/motion.rs");
    let source = Source::from_bytes(ROBOT, std::fs::read(ROBOT)?);
    let mut diagnostics = Diagnostics::new();
    let description = description::read(&source, &mut diagnostics).ok_or_else(|| diagnostics.render())?;
    let tree = centre_of_mass_tree(&description, &ModelOptions::default())?;
    let rows = (0..motion::SAMPLES).map(|sample| {
        let [q, qd, qdd] = motion::motion(sample).1.map(|v| v.map(Dd::from));
        let torques = inverse_dynamics(&tree, &q, &qd, &qdd);
        let scales = natural_scale(&tree, &q, &qd, &qdd);
        let numbers = torques.iter().zip(scales.iter());
        // the torque in two halves: f64 alone would round it
        numbers.map(|(tau, scale)| [tau.hi(), tau.lo(), scale.hi()]).collect::<Vec<_>>()
    });
    let rows: Vec<_> = rows.collect();
    let text = format!("[[[f64; 3]; {}]; {}] = {rows:?};\n", motion::N, motion::SAMPLES);
    let text = format!(
        "/// Torque in two halves, and the sum of the moduli of its terms \\[N·m\\].\nstatic REFERENCE: {text}"
    );
    std::fs::write(Path::new(&std::env::var("OUT_DIR")?).join("reference.rs"), text)?;
    Ok(())
}
