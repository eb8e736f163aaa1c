//! Certified bounds of robots with closed loops: they widen as the loops come near a pose where the dependent joints cannot follow, and end there.

use straightline_codegen::certify::{certify, search, Effort, Interval};
use straightline_codegen::diagnostic::Source;
use straightline_codegen::equations::Robot;
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::options::Options;
use straightline_codegen::program::program;
use straightline_codegen::{Function, Scalar};
use straightline_core::model::Model;
use straightline_core::Dd;

const FOURBAR: &str = include_str!("../files/fourbar.toml");

fn four_bar(more: &str) -> Model<Dd> {
    let (model, said) = load(&Source::new("fourbar.toml", format!("{FOURBAR}{more}")), &ModelOptions::default());
    model.unwrap_or_else(|| panic!("{}", said.render()))
}

/// (crank, coupler, rocker) where the crank has turned so far from home.
fn turned(model: &Model<f64>, by: f64) -> [f64; 3] {
    let mut q = model.closure.home.clone();
    q[0] += by;
    let (q, gaps) = model.assemble_loops(&q, 0);
    assert!(gaps.iter().all(|gap| gap.abs() < 1e-14));
    [q[0], q[1], q[2]]
}

/// How far the crank turns from home to where the rocker turns back, which it then cannot lead.
fn to_the_dead_point(model: &Model<f64>) -> f64 {
    let rocker = |by: f64| model.embedding(&turned(model, by))[1][0];
    let steps = (0..63).map(|k| 0.1 * f64::from(k));
    let first = steps.clone().zip(steps.skip(1)).find(|(a, b)| rocker(*a) * rocker(*b) < 0.0);
    let (mut a, mut b) = first.expect("the rocker turns back");
    for _ in 0..60 {
        let middle = 0.5 * (a + b);
        if rocker(a) * rocker(middle) <= 0.0 {
            b = middle;
        } else {
            a = middle;
        }
    }
    a
}

#[test]
fn bounds_of_a_four_bar_widen_towards_its_dead_point_and_end_there() {
    let led = four_bar("").cast::<f64>();
    let dead = to_the_dead_point(&led);
    // the rocker leads: joints are rocker, crank, coupler
    let robot = Robot::new(four_bar("determines = [\"crank\", \"coupler\"]\n"));
    let options = Options::default();
    for function in [Function::InverseDynamics, Function::MassMatrix, Function::LoopJacobian] {
        let graph = program(&robot, &[], function, &options).graph;
        let inputs = graph.inputs.iter().map(|port| port.len()).sum();
        let mut bounds = Vec::new();
        for exponent in 1..=9 {
            let far = 10f64.powi(-exponent);
            let [crank, coupler, rocker] = turned(&led, dead + far);
            let near = |x: f64| Interval { lo: x - 1e-3 * far, hi: x + 1e-3 * far };
            let mut ranges = [rocker, crank, coupler].map(near).to_vec();
            ranges.resize(inputs, Interval { lo: -1.0, hi: 1.0 });
            let certified = certify(&graph, Scalar::F64, &ranges, Effort::default()).ok();
            if let Some(certificate) = &certified {
                let found = search::worst_found(&graph, Scalar::F64, &ranges, 300, 5);
                for (found, bound) in found.iter().zip(&certificate.errors) {
                    assert!(found.error <= *bound, "{function:?}, {far:e}: {:e} > {bound:e}", found.error);
                }
            }
            bounds.push(certified.map(|c| c.errors.iter().fold(0.0_f64, |most, x| most.max(*x))));
        }
        println!("{function:?}: {bounds:?}");
        let known: Vec<f64> = bounds.iter().map_while(|bound| *bound).collect();
        assert!(known.len() >= 5, "{function:?}: {bounds:?}");
        assert!(known.windows(2).all(|w| w[1] > 5.0 * w[0]), "{function:?}: {bounds:?}");
        // over the dead point itself
        let [crank, coupler, rocker] = turned(&led, dead);
        let over = |x: f64| Interval { lo: x - 1e-4, hi: x + 1e-4 };
        let mut ranges = [rocker, crank, coupler].map(over).to_vec();
        ranges.resize(inputs, Interval { lo: -1.0, hi: 1.0 });
        assert!(certify(&graph, Scalar::F64, &ranges, Effort::default()).is_err(), "{function:?}");
    }
}
