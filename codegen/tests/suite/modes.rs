//! Three ways to the derivatives of a robot: by the structure of the equations, by forward and by reverse mode on the graph. All are traced over the
//! forms of the robot that were searched for, and give the same numbers. The structured way takes the fewest operations of every robot, but for
//! one, so it is what functions have, and no build has to trace the others. Products with one direction or multiplier are forward and reverse mode
//! themselves.
//!
//! `cargo test -p straightline-codegen --test suite modes:: -- --include-ignored --nocapture` prints what they take.

use std::path::Path;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::{evaluate, Graph, Port, RuleSet, DIVISION};
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::options::Options;
use straightline_codegen::pass::{count_sums, dead_code};
use straightline_codegen::program::choose::choose;
use straightline_codegen::scene::Scene;
use straightline_codegen::trace::{trace_all, Expr};
use straightline_codegen::{ForwardDynamicsMethod, Function};
use straightline_core::random::Random;
use straightline_core::{Dd, Real};

fn robot(file: &str) -> Robot {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(file);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let floating_base = ["solo12.urdf", "hyq.urdf"].contains(&file);
    let options = ModelOptions { floating_base, ..ModelOptions::default() };
    let (model, complaints) = load(&Source::new(file, text), &options);
    Robot::new(model.unwrap_or_else(|| panic!("{}", complaints.render())))
}

/// A function with all derivatives, and its products with a direction and with a multiplier.
struct Derived {
    all: Function,
    /// How many matrices it has, and whether the function's own results stand before them.
    matrices: usize,
    value: Function,
    value_first: bool,
    along: Function,
    weighed: Function,
}

const DERIVED: [Derived; 2] = [
    Derived {
        all: Function::InverseDynamicsDerivatives,
        matrices: 3,
        value: Function::InverseDynamics,
        value_first: false,
        along: Function::InverseDynamicsJvp,
        weighed: Function::InverseDynamicsVjp,
    },
    Derived {
        all: Function::ForwardDynamicsDerivatives,
        matrices: 3,
        value: Function::ForwardDynamics,
        value_first: true,
        along: Function::ForwardDynamicsJvp,
        weighed: Function::ForwardDynamicsVjp,
    },
];

impl Derived {
    /// The graph of an algorithm over configuration, velocities and accelerations or forces.
    fn graph(&self, robot: &Robot, algorithm: impl Fn(&[Vec<Expr>]) -> Vec<Expr>) -> Graph {
        let ports = [("q", robot.model.nq()), ("qd", robot.model.nv()), ("last", robot.model.nv())];
        let ports = ports.map(|(name, n)| Port::new(name, &[n])).to_vec();
        dead_code(&trace_all(RuleSet::all(), ports, |inputs| algorithm(inputs)))
    }

    fn equations(function: Function, robot: &Robot, inputs: &[Vec<Expr>]) -> Vec<Expr> {
        function.equations(robot, &[], ForwardDynamicsMethod::Factorisation, true, &Scene::default(), inputs)
    }

    /// The value and the matrices, in the order of the function.
    fn together(&self, value: Vec<Expr>, matrices: Vec<Expr>) -> Vec<Expr> {
        match self.value_first {
            true => [value, matrices].concat(),
            false => [matrices, value].concat(),
        }
    }

    fn structured(&self, robot: &Robot) -> Graph {
        self.graph(robot, |inputs| Self::equations(self.all, robot, inputs))
    }

    /// A column for each direction.
    fn forward(&self, robot: &Robot) -> Graph {
        let nv = robot.model.nv();
        self.graph(robot, |inputs| {
            let value = Self::equations(self.value, robot, inputs);
            let column = |block: usize, k: usize| {
                let direction = |b: usize| unit(nv, (b == block).then_some(k));
                let directions = (0..3).map(direction).collect::<Vec<_>>();
                Self::equations(self.along, robot, &[inputs, &directions[..]].concat())
            };
            let matrices = (0..self.matrices).flat_map(|block| {
                let columns: Vec<Vec<Expr>> = (0..nv).map(|k| column(block, k)).collect();
                (0..nv).flat_map(move |i| columns.iter().map(move |column| column[i]).collect::<Vec<_>>())
            });
            let matrices = matrices.collect();
            self.together(value, matrices)
        })
    }

    /// A row for each multiplier.
    fn reverse(&self, robot: &Robot) -> Graph {
        let nv = robot.model.nv();
        self.graph(robot, |inputs| {
            let value = Self::equations(self.value, robot, inputs);
            let row = |i: usize| Self::equations(self.weighed, robot, &[inputs, &[unit(nv, Some(i))]].concat());
            let rows: Vec<Vec<Expr>> = (0..nv).map(row).collect();
            let matrices =
                (0..self.matrices).flat_map(|block| rows.iter().flat_map(move |row| &row[block * nv..][..nv]));
            let matrices = matrices.copied().collect();
            self.together(value, matrices)
        })
    }
}

fn unit(n: usize, one: Option<usize>) -> Vec<Expr> {
    (0..n).map(|k| Expr::constant(if Some(k) == one { Dd::ONE } else { Dd::ZERO })).collect()
}

/// Multiplications and additions, with what a division weighs.
fn operations(graph: &Graph) -> usize {
    let counts = count_sums(graph);
    counts.flops() + DIVISION * (counts.div + counts.sqrt)
}

/// What a way takes in the best of the forms that were searched for it and for its value.
fn least(derived: &Derived, robot: &Robot, way: impl Fn(&Derived, &Robot) -> Graph) -> (usize, Graph) {
    let options = Options::default();
    let form = |function: Function| choose(robot, &[], function, &options, options.optimisations());
    let graphs = [derived.all, derived.value].map(|function| way(derived, &form(function)));
    graphs.into_iter().map(|graph| (operations(&graph), graph)).min_by_key(|(n, _)| *n).expect("there are forms")
}

fn structure_is_cheapest(files: &[&str]) {
    let mut failures = Vec::new();
    for file in files {
        let robot = robot(file);
        for derived in &DERIVED {
            let ways = [
                least(derived, &robot, Derived::structured),
                least(derived, &robot, Derived::forward),
                least(derived, &robot, Derived::reverse),
            ];
            let mut random = Random(7);
            let count = ways[0].1.inputs.iter().map(Port::len).sum();
            let mut inputs: Vec<Dd> = (0..count).map(|_| Dd::from(random.symmetric(1.0))).collect();
            for joint in robot.model.free_joints() {
                joint.kind.normalise(&mut inputs[joint.iq..joint.iq + joint.kind.nq()]);
            }
            let [found, others @ ..] = ways.each_ref().map(|(_, graph)| evaluate::<Dd>(graph, &inputs));
            let greatest = found.iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
            for other in others {
                assert_eq!(other.len(), found.len());
                let worst = found.iter().zip(&other).map(|(a, b)| (*a - *b).to_f64().abs()).fold(0.0, f64::max);
                assert!(worst <= 1e-24 * greatest, "{file}, {}: {worst:e}", derived.all.name());
            }
            let [structured, forward, reverse] = ways.map(|(operations, _)| operations);
            println!("{file:<26} {:<28} {structured:>6} {forward:>7} {reverse:>7}", derived.all.name());
            // a planar arm of two joints takes one less by forward mode
            if structured > forward.min(reverse) + 1 {
                failures.push(format!("{file}, {}: {structured}, {forward}, {reverse}", derived.all.name()));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn the_structure_of_the_equations_takes_fewer_operations_than_forward_and_reverse_mode() {
    structure_is_cheapest(&["planar_2r.toml", "chapter_cylindrical.toml", "puma560.urdf"]);
}

#[test]
#[ignore = "slow proof: forward and reverse mode of long functions"]
fn slow_proof_that_the_structure_takes_the_fewest_operations_of_larger_robots() {
    structure_is_cheapest(&["ur5.urdf", "panda.urdf", "chapter_6r.toml", "solo12.urdf"]);
}
