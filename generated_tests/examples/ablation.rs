//! What each technique that lowers operation counts is worth: counts of the programs with all of them, and without each.
//!
//! `cargo run -p straightline-generated-tests --example ablation`

use std::path::Path;
use straightline_codegen::compile::{optimised, Optimisations, Options};
use straightline_codegen::diagnostic::Source;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::Function;
use straightline_generated_tests::programs;

const COLUMNS: [(&str, bool, Function); 10] = [
    ("puma560_armstrong", false, Function::InverseDynamics),
    ("stanford_paul", false, Function::InverseDynamics),
    ("ur5", false, Function::InverseDynamics),
    ("iiwa7", false, Function::InverseDynamics),
    ("panda", false, Function::InverseDynamics),
    ("solo12", true, Function::InverseDynamics),
    ("ur5", false, Function::MassMatrix),
    ("panda", false, Function::MassMatrix),
    ("ur5", false, Function::ForwardDynamics),
    ("panda", false, Function::ForwardDynamics),
];

type Switch = fn(&mut Optimisations);

const ROWS: [(&str, Switch); 12] = [
    ("all", |_| {}),
    ("reduced robot (frames, base parameters, U z, Σ)", |o| o.reduced = false),
    ("sums (factor, share, order)", |o| o.sums = false),
    ("forms chosen by counting, all", |o| o.chosen = false),
    ("… frames that do not turn", |o| o.forms.stays = false),
    ("… origins at either foot", |o| o.forms.origins = false),
    ("… tips turned", |o| o.forms.tips = false),
    ("… which parameters vanish", |o| o.forms.parameters = false),
    ("… forms of a body's rotation", |o| o.forms.rotations = false),
    ("… unit of length", |o| o.forms.unit = false),
    ("angles added", |o| o.angle_sums = false),
    ("algebraic rules", |o| o.algebraic = false),
];

fn main() {
    let short = |name: &str| name.split('_').next().unwrap_or(name).to_string();
    let words = |f: Function| match f {
        Function::MassMatrix => " H",
        Function::ForwardDynamics => " FD",
        _ => "",
    };
    let heads: Vec<String> = COLUMNS.iter().map(|(name, _, f)| short(name) + words(*f)).collect();
    println!("| without | {} |", heads.join(" | "));
    println!("|---|{}", "---|".repeat(COLUMNS.len()));
    for (what, switch) in ROWS {
        let cell = |(name, floating, function): &(&str, bool, Function)| {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("count_robots/{name}.urdf"));
            let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
            let options = ModelOptions { floating_base: *floating, ..ModelOptions::default() };
            let robot = programs::load(&Source::new(name, text), &options);
            let options = Options::default();
            let mut optimisations = options.optimisations();
            switch(&mut optimisations);
            let c = optimised(&robot, &[], *function, &options, optimisations).counts();
            format!("{}/{} ({})", c.mul, c.add, c.fma)
        };
        println!("| {what} | {} |", COLUMNS.iter().map(cell).collect::<Vec<_>>().join(" | "));
    }
}
