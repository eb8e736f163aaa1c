//! What scenes save, in operations of the Panda's inverse dynamics: every scene against the plain program, which the generic
//! recursion unrolls to, and against the one that all optimisations leave.
//!
//! The plain program is the measure of what a scene skips: both lose the same terms. Optimisations take away more of the full
//! program (745 to 518 operations) than of a small scene, in which less is left to be found twice, so that fractions of the
//! optimised program are greater, although every scene costs less than without optimisations.

use std::path::Path;
use straightline_codegen::compile::explain;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::emit::Generated;
use straightline_codegen::options::scene_file;
use straightline_codegen::options::Options;
use straightline_generated_tests::made::Made;

/// The Panda in a scene.
fn panda(text: &str) -> Generated {
    static MADE: Made<Generated> = Made::nothing();
    MADE.once(text.to_string(), || explained(text))
}

fn explained(text: &str) -> Generated {
    let mut diagnostics = Diagnostics::new();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("count_robots/panda.urdf");
    let robot = std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let file =
        scene_file::read(&Source::new("scene.toml", text), &mut diagnostics).unwrap_or_else(|| panic!("{diagnostics}"));
    let options = file.into_options(Options::default());
    explain(&Source::from_bytes("panda.urdf", robot), &options).unwrap_or_else(|d| panic!("{d}"))
}

/// Operations of the only function of a scene.
fn operations(text: &str) -> usize {
    let generated = panda(text);
    let functions = &generated.report.functions;
    assert_eq!(functions.len(), 1, "{:?}", functions.keys());
    functions.values().map(|f| f.flops()).sum()
}

const FULL: &str = "[outputs]\nfunctions = [\"inverse_dynamics\"]\n";
const TOOL: &str = "[[parameter]]\nkind = \"payload\"\nname = \"tool\"\nframe = \"link07\"\n";
const WRIST: &str = "[hold]\njoints = { joint05 = 0.0, joint06 = 1.5707963267948966, joint07 = 0.7853981633974483 }\n";

/// What a scene may take, in hundredths of the plain and of the optimised full program.
struct Scene {
    what: &'static str,
    text: String,
    plain: usize,
    optimised: usize,
}

#[test]
fn scenes_cost_a_fraction_of_the_full_program() {
    let scene = |what, text: String, plain, optimised| Scene { what, text, plain, optimised };
    let outputs = |what: &str| format!("[outputs]\n{what}\n");
    let scenes = [
        scene("gravity only", outputs("functions = [\"gravity_force\"]"), 15, 15),
        scene("at rest", FULL.to_string() + "[zero]\nqd = true\n", 54, 61),
        scene("last column of H", outputs("mass_matrix = { joints = [\"joint07\"] }"), 10, 13),
        scene("joints 5 to 7 locked", FULL.to_string() + WRIST, 44, 44),
        scene("last torque", outputs("inverse_dynamics = { joints = [\"joint07\"] }"), 27, 38),
    ];
    let full = panda(FULL).report.functions["inverse_dynamics"].clone();
    let (plain, optimised) = (full.waterfall.as_ref().expect("explained").plain.flops(), full.flops());
    println!("{:<21} {optimised:5} of {plain} plain, {optimised} optimised", "full");
    for Scene { what, text, plain: of_plain, optimised: of_optimised } in scenes {
        let takes = operations(&text);
        let fraction = |whole: usize| takes as f64 / whole as f64;
        println!("{what:<21} {takes:5}    {:.3}        {:.3}", fraction(plain), fraction(optimised));
        assert!(takes * 100 <= plain * of_plain, "{what}: {takes} of {plain}");
        assert!(takes * 100 <= optimised * of_optimised, "{what}: {takes} of {optimised}");
    }
}

#[test]
fn a_payload_at_run_time_costs_fifteen_percent_at_most() {
    let (without, with) = (operations(FULL), operations(&(FULL.to_string() + TOOL)));
    assert!(without < with && with * 100 <= without * 115, "{without}, with a payload {with}");
}

#[test]
fn a_second_call_costs_a_third_and_gravity_and_h_nothing() {
    let functions = ["gravity_force", "inverse_dynamics", "mass_matrix"];
    let generated = panda(&format!("[outputs]\nfunctions = {functions:?}\nstaged = true\n"));
    let staged = generated.report.staged.as_ref().expect("staged");
    let left = |name: &str| {
        let left = &staged.remaining[name];
        left.mul + left.add + left.div + left.sqrt
    };
    let full = generated.report.functions["inverse_dynamics"].flops();
    assert!(left("inverse_dynamics") * 100 <= full * 35, "{} of {full}", left("inverse_dynamics"));
    assert_eq!(left("gravity_force") + left("mass_matrix"), 0);
}
