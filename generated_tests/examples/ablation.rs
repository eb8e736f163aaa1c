//! What each technique that lowers operation counts is worth: counts of the programs with all of them, and without each.
//!
//! `cargo run -p straightline-generated-tests --example ablation [FUNCTION…]`, some minutes; functions are `inverse_dynamics`,
//! `mass_matrix`, `forward_dynamics`.

use std::path::Path;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::options::{Optimisations, Options};
use straightline_codegen::program::optimised;
use straightline_codegen::Function;
use straightline_generated_tests::programs;

/// Robots, and whether they float.
const ROBOTS: [(&str, bool); 10] = [
    ("puma560_armstrong", false),
    ("stanford_paul", false),
    ("ur5", false),
    ("iiwa7", false),
    ("panda", false),
    ("puma560_general_inertia", false),
    ("stanford_general_inertia", false),
    ("general_6r", false),
    ("solo12", true),
    ("go1", true),
];

const FUNCTIONS: [Function; 3] = [Function::InverseDynamics, Function::MassMatrix, Function::ForwardDynamics];

type Switch = fn(&mut Optimisations);

const ROWS: [(&str, Switch); 14] = [
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
    ("values formed of others", |o| o.substitutes = false),
    ("the cheaper form of forward dynamics", |o| o.cheaper = false),
    ("algebraic rules", |o| o.algebraic = false),
];

fn main() {
    let asked: Vec<String> = std::env::args().skip(1).collect();
    let unknown = |name: &&String| FUNCTIONS.iter().all(|f| f.name() != name.as_str());
    if let Some(name) = asked.iter().find(unknown) {
        eprintln!("`{name}` is none of {}", FUNCTIONS.map(|f| f.name()).join(", "));
        std::process::exit(2);
    }
    for function in FUNCTIONS.into_iter().filter(|f| asked.is_empty() || asked.iter().any(|name| name == f.name())) {
        let heads: Vec<String> = ROBOTS.iter().map(|(name, _)| name.replace('_', " ")).collect();
        println!("\n{}\n\n| without | {} |", function.name(), heads.join(" | "));
        println!("|---|{}", "---|".repeat(ROBOTS.len()));
        for (what, switch) in ROWS {
            let cell = |(name, floating): &(&str, bool)| {
                let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("count_robots/{name}.urdf"));
                let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
                let options = ModelOptions { floating_base: *floating, ..ModelOptions::default() };
                let robot = programs::load(&Source::new(name, text), &options);
                let options = Options::default();
                let mut optimisations = options.optimisations();
                switch(&mut optimisations);
                let c = optimised(&robot, &[], function, &options, optimisations).counts();
                let divisions = if c.div > 0 { format!(" + {}", c.div) } else { String::new() };
                format!("{}/{} ({}) {}{divisions}", c.mul, c.add, c.fma, c.sin_cos)
            };
            println!("| {what} | {} |", ROBOTS.iter().map(cell).collect::<Vec<_>>().join(" | "));
        }
    }
}
