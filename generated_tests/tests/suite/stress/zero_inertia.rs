//! Links without inertia: an error that demands a rotor, and finite results once there is one.

use super::outcome::{Outcome, Size};
use super::robots::{file, Link, AXES};
use straightline_codegen::{compile, expr, Function, Options, Robot};
use straightline_core::Dd;
use straightline_generated_tests::random::Random;

/// Chains that have no forward dynamics, each with the index of the link that needs a rotor.
fn faulty() -> Vec<(&'static str, Vec<Link>, Vec<usize>)> {
    let rod = |axis: usize| Link::rod(1.0).about(AXES[axis]);
    let nothing = |axis: usize| rod(axis).times(0.0);
    let point = |axis: usize, com| Link { com, moments: [0.0; 3], ..rod(axis) };
    let here = |link: Link| Link { offset: [0.0; 3], ..link };
    vec![
        ("massless tip", vec![rod(0), nothing(1)], vec![1]),
        ("point mass on the axis of the tip", vec![rod(1), point(0, [0.0, 0.0, 0.25])], vec![1]),
        ("massless link between coaxial joints", vec![rod(0), nothing(1), here(rod(1))], vec![1]),
        (
            "wrist about a point mass",
            vec![rod(0), nothing(1), here(nothing(2)), here(point(0, [0.0; 3]))],
            vec![1, 2, 3],
        ),
    ]
}

pub fn demands(size: Size) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    for (name, links, lacking) in faulty() {
        let options = Options { functions: vec![Function::ForwardDynamics], ..Options::default() };
        let errors = compile(&file(&links), &options).err();
        let refused = errors.iter().flat_map(|e| e.iter()).filter(|d| d.code == "no-forward-dynamics");
        let unsaid = lacking.len().abs_diff(refused.filter(|d| d.place.is_some() && !d.help.is_empty()).count());
        outcomes.push(Outcome::new(
            8,
            name,
            "joints without inertia that are not refused with place and remedy",
            unsaid as f64,
            0.0,
        ));

        let mut healed = links;
        lacking.iter().for_each(|i| healed[*i].joint = "armature = 0.001\n");
        let source = file(&healed);
        let generated = compile(&source, &options).unwrap_or_else(|d| panic!("{d}"));
        let robot = Robot::new(generated.model);
        let program = straightline_codegen::program::program(&robot, &[], Function::ForwardDynamics, &options);
        let (mut random, n) = (Random(8), healed.len());
        let mut worst = 0.0f64;
        for _ in 0..size.pick(10, 1000) {
            let inputs: Vec<f64> = random.list(3 * n, 2.0);
            let truth = expr::evaluate(&program.graph, &inputs.iter().map(|x| Dd::from(*x)).collect::<Vec<_>>());
            let greatest = truth.iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
            for (x, t) in expr::evaluate(&program.graph, &inputs).iter().zip(truth) {
                let error = (Dd::from(*x) - t).to_f64().abs() / greatest;
                worst = if error.is_finite() { worst.max(error) } else { f64::INFINITY };
            }
        }
        outcomes.push(Outcome::new(8, name, "with rotors: f64 forward dynamics, of q̈", worst, 1e-12));
    }
    outcomes
}
