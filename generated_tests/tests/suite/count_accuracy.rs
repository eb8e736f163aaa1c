//! Few operations are not bought with digits: the optimised inverse dynamics of the robots whose operations are counted,
//! in f32 and f64, against double-double.
//!
//! In f32 it may lose twice what base inertial parameters in frames along common normals lose, in plain recursion without any search,
//! on the same states: the worst error over 100 random states over the rms torque of that joint. What those lose depends on the
//! states: with speeds and accelerations as small as here a Panda's first joint has a tenth of the torque whose weights cancel in it.

use std::fmt::Write;
use std::path::Path;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::expr::{evaluate, Graph};
use straightline_codegen::function::ForwardDynamicsMethod;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::options::{Optimisations, Options};
use straightline_codegen::program::optimised;
use straightline_codegen::Function;
use straightline_codegen::Scalar;
use straightline_core::Dd;
use straightline_generated_tests::bounds::COUNTED;
use straightline_generated_tests::programs::{self, cast, program};
use straightline_generated_tests::random::Random;

const STATES: usize = 100;
/// How many times what base parameters alone lose.
const TIMES: f64 = 2.0;
/// Robot, and whether it floats.
const ROBOTS: [(&str, bool); 7] = [
    ("puma560_armstrong", false),
    ("stanford_paul", false),
    ("ur5", false),
    ("panda", false),
    ("iiwa7", false),
    ("solo12", true),
    ("go1", true),
];

#[test]
fn the_optimised_inverse_dynamics_keeps_the_digits_of_base_parameters() {
    let mut table = format!("{:<20} {:>9} {:>9} {:>9} {:>9}\n", "robot", "f64", "bound", "f32", "bound");
    let mut above = false;
    for (name, floating) in ROBOTS {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("count_robots/{name}.urdf"));
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let options = ModelOptions { floating_base: floating, ..ModelOptions::default() };
        let robot = programs::load(&Source::new(name, text), &options);
        let model = &robot.model;
        let mut random = Random(7);
        // numbers that are the same in f32 and f64
        let single = |x: Vec<f64>| x.into_iter().map(|x| f64::from(x as f32)).collect::<Vec<f64>>();
        let states: Vec<Vec<Vec<f64>>> = (0..STATES)
            .map(|_| {
                let mut q = single(random.configuration(model.nq(), floating));
                if floating {
                    // of length one exactly, in every format
                    q[3..7].iter_mut().for_each(|x| *x = if *x < 0.0 { -0.5 } else { 0.5 });
                }
                vec![q, single(random.list(model.nv(), 2.0)), single(random.list(model.nv(), 2.0))]
            })
            .collect();
        let truth: Vec<Vec<Dd>> = states
            .iter()
            .map(|x| {
                let method = ForwardDynamicsMethod::default();
                Function::InverseDynamics.evaluate(model, &[], method, &cast::<Dd>(x))
            })
            .collect();
        let rms = |k: usize| (truth.iter().map(|t| t[k].to_f64().powi(2)).sum::<f64>() / STATES as f64).sqrt();
        let scale: Vec<f64> = (0..model.nv()).map(rms).collect();
        let worst = |results: &dyn Fn(&[Vec<f64>]) -> Vec<f64>| {
            let mut worst: f64 = 0.0;
            for (x, truth) in states.iter().zip(&truth) {
                for (k, y) in results(x).into_iter().enumerate() {
                    worst = worst.max((Dd::from(y) - truth[k]).abs().to_f64() / scale[k]);
                }
            }
            worst
        };
        let compiled = |scalar| {
            let options = Options { scalar, ..Options::default() };
            program(&robot, &[], Function::InverseDynamics, &options).graph
        };
        let options = Options { scalar: Scalar::F32, ..Options::default() };
        let base = Optimisations { chosen: false, ..options.optimisations() };
        let base = optimised(&robot, &[], Function::InverseDynamics, &options, base);
        let (in_f64, in_f32) = (compiled(Scalar::F64), compiled(Scalar::F32));
        let double = worst(&|x| evaluate(&in_f64, &x.concat()));
        let in_single = |graph: &Graph, x: &[Vec<f64>]| -> Vec<f64> {
            evaluate::<f32>(graph, &cast(x).concat()).into_iter().map(f64::from).collect()
        };
        let (single, base) = (worst(&|x| in_single(&in_f32, x)), worst(&|x| in_single(&base, x)));
        let (bound, bound_f64) = (TIMES * base, COUNTED.most);
        let _ = writeln!(table, "{name:<20} {double:9.1e} {bound_f64:9.1e} {single:9.1e} {bound:9.1e}");
        above |= !COUNTED.allows(double) || single > bound;
    }
    println!("{table}");
    assert!(!above, "\n{table}");
}
