//! The tests can fail: programs and robot files with one fault are caught by the reference states.
//!
//! A mutant of a program is caught if in some state of the data some result is off by more than the bound. Two sieves: the
//! one of `equations_have_all_digits_of_the_reference_values` (double-double, 1e-23), which must catch every mutant that
//! changes any result at all, and the one of `compiled_functions_give_the_reference_values` (f64, 20 times Pinocchio's
//! error or 1e-14), whose rate is printed: a constant changed by 1e-9 may disappear in its rounding.

use straightline_codegen::diagnostic::Source;
use straightline_codegen::expr::{self, Binary, Constant, Graph, NodeId, Op, Unary};
use straightline_codegen::program::TracedProgram;
use straightline_codegen::Function;
use straightline_core::Dd;
use straightline_generated_tests::bounds::DATA;
use straightline_generated_tests::inputs;
use straightline_generated_tests::programs::{self, cast, program};
use straightline_generated_tests::random::Random;
use straightline_generated_tests::reference::{Expected, Robot};

/// The graph with node `i` doing something else.
fn with(graph: &Graph, i: usize, op: Op) -> Graph {
    let mut mutant = graph.clone();
    mutant.ops[i] = op;
    mutant
}

/// The graph where everything that used node `i` uses `other` instead.
fn redirected(graph: &Graph, i: usize, other: NodeId) -> Graph {
    let mut mutant = graph.clone();
    let change = |x: NodeId| if x.index() == i { other } else { x };
    mutant.ops.iter_mut().skip(i + 1).for_each(|op| *op = op.map(change));
    mutant.results.iter_mut().for_each(|r| *r = change(*r));
    mutant
}

/// All faults that may sit in node `i`.
fn faults(graph: &Graph, i: usize) -> Vec<(&'static str, Graph)> {
    match graph.ops[i] {
        Op::Input(_) | Op::SinCos(_) => vec![],
        Op::Constant(c) => {
            let v = c.value();
            vec![
                ("constant off by 1e-9", with(graph, i, Op::Constant(Constant::new(v * Dd::from(1.0 + 1e-9))))),
                ("constant with the other sign", with(graph, i, Op::Constant(Constant::new(-v)))),
            ]
        }
        // its users must stay sums of angles or sines
        Op::AngleSum(a, b) => vec![
            ("first angle twice", with(graph, i, Op::AngleSum(a, a))),
            ("second angle twice", with(graph, i, Op::AngleSum(b, b))),
        ],
        Op::Unary(Unary::Neg, a) => vec![("sign lost", redirected(graph, i, a))],
        Op::Binary(Binary::Add, a, b) => vec![
            ("+ to −", with(graph, i, Op::sub(a, b))),
            ("first term dropped", redirected(graph, i, b)),
            ("second term dropped", redirected(graph, i, a)),
        ],
        Op::Binary(Binary::Sub, a, b) => vec![
            ("− to +", with(graph, i, Op::add(a, b))),
            ("operands swapped", with(graph, i, Op::sub(b, a))),
            ("subtrahend dropped", redirected(graph, i, a)),
        ],
        Op::Binary(Binary::Mul, a, b) => {
            vec![("wrong factor", with(graph, i, Op::mul(a, a))), ("factor dropped", redirected(graph, i, b))]
        }
        Op::Binary(Binary::Div, a, b) => vec![("operands swapped", with(graph, i, Op::div(b, a)))],
        Op::Unary(Unary::Sign, a) => vec![("sign function dropped", redirected(graph, i, a))],
        Op::Unary(Unary::Sqrt, a) => vec![("root dropped", redirected(graph, i, a))],
        Op::Sin(p) => vec![("sin to cos", with(graph, i, Op::Cos(p)))],
        Op::Cos(p) => vec![("cos to sin", with(graph, i, Op::Sin(p)))],
    }
}

/// The graph with every fault of every node, each with what was done where.
fn mutants(graph: &Graph) -> impl Iterator<Item = (String, Graph)> + '_ {
    let of_node = move |(i, op): (usize, &Op)| {
        let at = format!("in node {i} ({op:?})");
        faults(graph, i).into_iter().map(move |(fault, mutant)| (format!("{fault} {at}"), mutant))
    };
    graph.ops.iter().enumerate().flat_map(of_node)
}

/// The states of the data, as a sieve for one function.
struct Sieve {
    states: Vec<(Vec<Dd>, Vec<f64>, Expected)>,
    bound: f64,
}

impl Sieve {
    fn new(robot: &Robot, function: Function) -> Sieve {
        let mut states: Vec<_> = robot
            .states
            .iter()
            .filter(|s| s.gravity.is_none())
            .map(|s| {
                let inputs = s.inputs(function);
                let expected = robot.expected(s, function).expect("mutated functions are in the data");
                (cast::<Dd>(&inputs).concat(), inputs.concat(), expected)
            })
            .collect();
        // resting states see least
        states.rotate_left(1);
        Sieve { states, bound: robot.bound(function) }
    }

    fn equations_catch(&self, graph: &Graph) -> bool {
        self.states.iter().any(|(x, _, expected)| expected.worst(&expr::evaluate(graph, x)).0 > DATA.most)
    }

    fn rounding_catches(&self, graph: &Graph) -> bool {
        self.states.iter().any(|(_, x, expected)| expected.worst(&expr::evaluate(graph, x)).0 > self.bound)
    }
}

/// Whether the mutant gives anything else than the program, in random states.
fn changes_a_value(program: &TracedProgram, mutant: &Graph, states: &[Vec<Dd>]) -> bool {
    states.iter().any(|x| is_changed(&expr::evaluate(&program.graph, x), &expr::evaluate(mutant, x)))
}

/// Whether results are others: less than this, such as 1e-9 of the cosine 6e-17 of an almost right angle, is beyond the data's 25 digits;
/// what is no number is a change.
fn is_changed(right: &[Dd], found: &[Dd]) -> bool {
    let size = right.iter().fold(0.0, |m: f64, v| m.max(v.to_f64().abs()));
    !right.iter().zip(found).all(|(a, b)| (*a - *b).abs().to_f64() <= 1e-21 * size)
}

/// How many faults of single nodes change a result in these states, and which of them are not caught in any: `catches` has the number of the
/// state and the results there.
pub fn escaping(graph: &Graph, states: &[Vec<Dd>], catches: impl Fn(usize, &[Dd]) -> bool) -> (usize, Vec<String>) {
    let right: Vec<Vec<Dd>> = states.iter().map(|x| expr::evaluate(graph, x)).collect();
    assert!(right.iter().enumerate().all(|(k, found)| !catches(k, found)), "the program is right");
    let (mut all, mut escaped) = (0, Vec::new());
    for (fault, mutant) in mutants(graph) {
        let (mut changes, mut caught) = (false, false);
        for (k, (x, right)) in states.iter().zip(&right).enumerate() {
            let found = expr::evaluate(&mutant, x);
            changes |= is_changed(right, &found);
            caught = changes && catches(k, &found);
            if caught {
                break;
            }
        }
        all += usize::from(changes);
        if changes && !caught {
            escaped.push(fault);
        }
    }
    (all, escaped)
}

fn every_fault_is_caught(robot: &str, function: Function) {
    let robot = Robot::load(robot);
    let mut options = programs::options(&robot);
    options.model.angle_tolerance = 0.0;
    let loaded = programs::load(&programs::source(&robot), &options.model);
    let program = program(&loaded, &robot.frames, function, &options);
    let sieve = Sieve::new(&robot, function);
    assert!(!sieve.equations_catch(&program.graph) && !sieve.rounding_catches(&program.graph), "the program is right");
    let mut random = Random(9);
    let states: Vec<Vec<Dd>> =
        (0..3).map(|_| cast::<Dd>(&inputs::random(&mut random, &loaded.model, function)).concat()).collect();

    let (mut all, mut caught_in_f64) = (0, 0);
    let mut escaped = Vec::new();
    for (fault, mutant) in mutants(&program.graph).filter(|(_, mutant)| changes_a_value(&program, mutant, &states)) {
        all += 1;
        caught_in_f64 += usize::from(sieve.rounding_catches(&mutant));
        if !sieve.equations_catch(&mutant) {
            escaped.push(fault);
        }
    }
    println!(
        "{} of {}: {all} mutants change a result; caught: {} by the equations, {caught_in_f64} in f64",
        function.name(),
        robot.name,
        all - escaped.len()
    );
    assert!(all > 50, "there is something to mutate");
    assert!(
        escaped.is_empty(),
        "{} of {}: {} mutants escaped\n{}",
        function.name(),
        robot.name,
        escaped.len(),
        escaped.join("\n")
    );
}

#[test]
fn every_fault_in_inverse_dynamics_is_caught() {
    for robot in ["planar2r", "chapter_stanford", "chapter_oblique", "panda"] {
        every_fault_is_caught(robot, Function::InverseDynamics);
    }
}

#[test]
fn every_fault_in_the_other_functions_is_caught() {
    use Function::*;
    for function in [MassMatrix, ForwardDynamics, JointWrenches, Energy, ForwardKinematics, Jacobian, JacobianBias] {
        every_fault_is_caught("chapter_oblique", function);
    }
}

/// Robot, what is written, what is written instead, and which function must notice.
const FILE_FAULTS: &[(&str, &str, &str, Function)] = &[
    // a product of inertia, a moment, a mass, a centre of mass
    ("panda", "ixy=\"-0.004761\"", "ixy=\"0.004761\"", Function::InverseDynamics),
    ("panda", "iyz=\"0.000229\"", "iyz=\"-0.000229\"", Function::InverseDynamics),
    ("panda", "izz=\"0.0017\"", "izz=\"0.0017000000001\"", Function::MassMatrix),
    ("panda", "<mass value=\"0.73\"/>", "<mass value=\"0.7300000000001\"/>", Function::GravityForce),
    ("panda", "0.060149 -0.014117 -0.010517", "0.060149 0.014117 -0.010517", Function::GravityForce),
    ("solo12", "iyz=\"4.671e-05\"", "iyz=\"-4.671e-05\"", Function::InverseDynamics),
    // an origin, a swapped axis, an angle of the wrong sign
    ("panda", "0.0 0.0 0.1034", "0.0 0.0 0.1035", Function::ForwardKinematics),
    ("panda", "0.0 0.0 0.107", "0.0 0.0 0.1070000000001", Function::Jacobian),
    (
        "panda",
        "<origin xyz=\"0.0825 0.0 0.0\" rpy=\"1.5707963267948966 0.0 0.0\"/>\n    <axis xyz=\"0.0 0.0 1.0\"/>",
        "<origin xyz=\"0.0825 0.0 0.0\" rpy=\"1.5707963267948966 0.0 0.0\"/>\n    <axis xyz=\"0.0 1.0 0.0\"/>",
        Function::MassMatrix,
    ),
    (
        "panda",
        "xyz=\"0.0825 0.0 0.0\" rpy=\"1.5707963267948966 0.0 0.0\"",
        "xyz=\"0.0825 0.0 0.0\" rpy=\"-1.5707963267948966 0.0 0.0\"",
        Function::GravityForce,
    ),
    ("panda", "rpy=\"0.0 0.0 -0.7853981633974483\"", "rpy=\"0.0 0.0 -0.78539816339\"", Function::MassMatrix),
    ("solo12", "<axis xyz=\"1.0 0.0 0.0\"/>", "<axis xyz=\"-1.0 0.0 0.0\"/>", Function::BiasForce),
    ("solo12", "0.0 -0.008 -0.16", "0.0 0.008 -0.16", Function::ForwardKinematics),
    // the chapter's vectors
    ("chapter_oblique", "alpha = -1.1200791968128136", "alpha = 1.1200791968128136", Function::MassMatrix),
    ("chapter_oblique", "-0.012376192022585032", "0.012376192022585032", Function::VelocityForce),
    ("chapter_oblique", "-0.10838435234161796", "0.10838435234161796", Function::InverseDynamics),
    ("chapter_oblique", "[0.33482845573772313,", "[-0.33482845573772313,", Function::ForwardDynamics),
    ("chapter_oblique", "e = [-0.14956580991374402,", "e = [0.14956580991374402,", Function::JacobianBias),
];

#[test]
fn every_fault_in_a_robot_file_is_caught() {
    for &(name, written, instead, function) in FILE_FAULTS {
        let robot = Robot::load(name);
        let options = programs::options(&robot);
        let text = programs::source(&robot).text().to_string();
        assert!(text.contains(written), "{name} has no {written}");
        let file = Source::new("mutant", text.replace(written, instead));
        let mutant = program(&programs::load(&file, &options.model), &robot.frames, function, &options);
        let sieve = Sieve::new(&robot, function);
        assert!(sieve.rounding_catches(&mutant.graph), "{name}: {written} → {instead} went unnoticed");
    }
}
