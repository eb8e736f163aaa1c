//! Random robots of all kinds: the optimised program against the second author.

use straightline_codegen::function::Quantity;
use straightline_codegen::options::Options;
use straightline_codegen::program::program;
use straightline_codegen::Function;
use straightline_core::Dd;
use straightline_generated_tests::bounds::{of_random_robot, RANDOM_ROBOT};
use straightline_generated_tests::inputs::{self, ready_to_paste};
use straightline_generated_tests::programs::{self, cast};
use straightline_generated_tests::random::{Kind, Random, RandomRobot};
use straightline_generated_tests::reference::Expected;
use straightline_generated_tests::written::{Shape, Style};

/// The inputs of a function in double-double, quaternions of length one in double-double: the functions take their length for granted.
fn exact(function: Function, inputs: &[Vec<f64>], kind: Kind) -> Vec<Vec<Dd>> {
    let mut wide = cast::<Dd>(inputs);
    let of_configuration = function.spec().inputs.iter().zip(&mut wide).filter(|(input, _)| input.is_configuration());
    for (_, q) in of_configuration.filter(|_| kind.floating) {
        let quaternion = &mut q[3..7];
        let norm = quaternion.iter().fold(Dd::ZERO, |sum, x| sum + *x * *x).sqrt();
        quaternion.iter_mut().for_each(|x| *x /= norm);
    }
    wide
}

/// Every function of the robot: its equations and its results in f64.
fn check(seed: u64, kind: Kind, states: usize) {
    let mut random = Random(seed);
    let robot = RandomRobot::new(&mut random, kind);
    check_robot(&robot, &format!("{seed}"), Function::all(), &mut random, states);
}

fn check_robot(
    robot: &RandomRobot,
    name: &str,
    functions: impl Iterator<Item = Function>,
    random: &mut Random,
    states: usize,
) {
    let kind = robot.kind;
    let (loaded, literal) = (robot.load(), robot.load_literally());
    let (tree, frames) = (robot.reference(), robot.frames());
    let options = Options::default();
    for function in functions {
        let equations = program(&literal, &frames, function, &options);
        let program = program(&loaded, &frames, function, &options);
        for _ in 0..states {
            let inputs = inputs::random_with_frames(random, &loaded.model, function, frames.len());
            let wide = exact(function, &inputs, kind);
            let expected = Expected::by_the_second_author(&tree, &frames, function, &wide);
            let (equations, i) = expected.worst(&programs::run(&equations, &wide));
            let (rounded, k) = expected.worst(&programs::run::<f64>(&program, &inputs));
            let about = || {
                format!(
                    "{} of random robot {name} {kind:?}\n{}\n{}",
                    function.name(),
                    ready_to_paste(&inputs),
                    robot.urdf()
                )
            };
            assert!(RANDOM_ROBOT.allows(equations), "component {i}: equations differ by {equations:.1e}: {}", about());
            assert!(rounded <= of_random_robot(kind.joints), "component {k}: scaled error {rounded:.1e}: {}", about());
        }
    }
}

fn kinds(joints: usize) -> impl Iterator<Item = Kind> {
    [(false, false), (false, true), (true, false), (true, true)].into_iter().flat_map(move |(branched, floating)| {
        [false, true].map(|right_angled| Kind { joints, branched, floating, welded: joints / 3, right_angled })
    })
}

/// All kinds of robots with so many joints.
fn robots_of(joints: usize) {
    for (k, kind) in kinds(joints).enumerate() {
        check(1000 * joints as u64 + k as u64, kind, 2);
    }
}

/// Every second kind: each of branches, a floating base and right angles with and without.
fn half_of_the_robots_of(joints: usize) {
    for (k, kind) in kinds(joints).enumerate().filter(|(k, _)| [0, 3, 5, 6].contains(k)) {
        check(1000 * joints as u64 + k as u64, kind, 1);
    }
}

#[test]
fn robots_of_one_to_five_joints_agree_with_the_second_author() {
    [1, 2, 3].into_iter().for_each(robots_of);
    half_of_the_robots_of(5);
}

/// Functions that a file has where it asks for them by name: derivatives, tasks, centroidal quantities and combinations. Those of base
/// parameters, of a scene's parameters and of drives have tests of their own, and so has what knows limits of joints.
fn by_name() -> impl Iterator<Item = Function> {
    let own = |f: &Function| {
        let of_parameters = f.is_of_base_parameters() || f.is_of_scene_parameters();
        of_parameters || f.spec().inputs.contains(&Quantity::LinkParameters) || *f == Function::InverseKinematicsStep
    };
    let is_meant = move |f: &Function| f.spec().family.is_by_name() && !f.spec().family.is_of_drives() && !own(f);
    Function::known().filter(is_meant)
}

/// Derivatives of robots with so many joints.
fn derivatives_of(joints: usize, kinds_of: impl Fn(usize) -> bool) {
    for (k, kind) in kinds(joints).enumerate().filter(|(k, _)| kinds_of(*k)) {
        let mut random = Random(5000 + 100 * joints as u64 + k as u64);
        let robot = RandomRobot::new(&mut random, kind);
        check_robot(&robot, &format!("{joints}, {k}"), by_name(), &mut random, 1);
    }
}

#[test]
fn derivatives_of_robots_of_one_and_two_joints_agree_with_the_second_author() {
    assert!(by_name().count() > 20);
    derivatives_of(1, |k| k == 6);
    derivatives_of(2, |k| k == 1);
}

#[test]
#[ignore = "minutes: robots of two and three joints"]
fn long_proof_that_derivatives_of_robots_of_two_and_three_joints_agree_with_the_second_author() {
    derivatives_of(2, |k| [3, 5].contains(&k));
    derivatives_of(3, |k| k == 3);
}

#[test]
#[ignore = "minutes: every kind of robot of one to four joints"]
fn derivatives_of_robots_of_one_to_four_joints_agree_with_the_second_author() {
    [1, 2, 3, 4].into_iter().for_each(|joints| derivatives_of(joints, |_| true));
}

#[test]
fn robots_as_written_agree_with_the_second_author() {
    // few: codegen/tests/suite/robots_as_written.rs has many, beside their plain programs
    for (k, style) in Style::all().into_iter().step_by(4).chain([Style::Exported, Style::Units]).enumerate() {
        let (branched, floating) = (k % 3 == 1, k % 5 == 2);
        let shape = Shape { joints: 1 + k % 3, fixed: 3, branched, floating, sliding: 4 };
        let robot = RandomRobot::as_written(style, shape, k as u64);
        check_robot(&robot, &format!("{style:?}, {k}"), Function::all(), &mut Random(k as u64), 2);
    }
}

#[test]
#[ignore = "slow proof: compiles large robots"]
fn slow_proof_that_robots_of_seven_joints_agree_with_the_second_author() {
    half_of_the_robots_of(7);
}

#[test]
#[ignore = "minutes: every kind of robot of five to nine joints"]
fn long_proof_that_robots_of_five_to_nine_joints_agree_with_the_second_author() {
    [5, 7, 9].into_iter().for_each(robots_of);
}

#[test]
#[ignore = "a minute: every kind of robot of twelve joints"]
fn robots_of_twelve_joints_agree_with_the_second_author() {
    robots_of(12);
}

#[test]
#[ignore = "slow proof: a large robot"]
fn slow_proof_that_a_tree_of_forty_joints_agrees_with_the_second_author() {
    check(40, Kind { joints: 40, branched: true, floating: true, welded: 8, right_angled: false }, 1);
}

#[test]
fn a_chain_of_a_hundred_links_agrees_with_the_second_author() {
    let kind = Kind { joints: 100, branched: false, floating: false, welded: 0, right_angled: false };
    let mut random = Random(100);
    let robot = RandomRobot::new(&mut random, kind);
    let (loaded, tree) = (robot.load(), robot.reference());
    for function in [Function::InverseDynamics, Function::BiasForce, Function::GravityForce, Function::Energy] {
        let program = program(&loaded, &[], function, &Options::default());
        let inputs = inputs::random(&mut random, &loaded.model, function);
        let wide = exact(function, &inputs, kind);
        let expected = Expected::by_the_second_author(&tree, &[], function, &wide);
        let (equations, _) = expected.worst(&programs::run(&program, &wide));
        let (rounded, _) = expected.worst(&programs::run::<f64>(&program, &inputs));
        assert!(RANDOM_ROBOT.allows(equations), "{}: {equations:.1e}", function.name());
        assert!(rounded <= of_random_robot(kind.joints), "{}: {rounded:.1e}", function.name());
    }
}

/// The cost of a recursion grows with the number of links: five times as many take about five times the operations.
#[test]
fn operations_grow_linearly_with_the_number_of_links() {
    operations_grow_linearly(20);
}

#[test]
#[ignore = "minutes: chains of 150 links"]
fn long_proof_that_operations_grow_linearly_with_the_number_of_links() {
    operations_grow_linearly(30);
}

fn operations_grow_linearly(links: usize) {
    let operations = |joints: usize, function: Function| {
        let kind = Kind { joints, branched: false, floating: false, welded: 0, right_angled: false };
        let robot = RandomRobot::new(&mut Random(7), kind);
        program(&robot.load(), &[robot.frames().pop().expect("the tip is a frame")], function, &Options::default())
            .graph
            .counts()
            .flops() as f64
    };
    use Function::{Energy, ForwardDynamics, InverseDynamics, JacobianBias};
    for function in [InverseDynamics, ForwardDynamics, Energy, JacobianBias] {
        let (few, many) = (operations(links, function), operations(5 * links, function));
        // the first links are cheaper, so a little more than five
        assert!(many < 5.5 * few, "{}: {few} operations for {links} links, {many} for {}", function.name(), 5 * links);
    }
}

/// A floating base, branches, joints in any order in the file: all coordinates have their own place, in depth-first order.
#[test]
fn joints_take_their_places_in_the_files_depth_first_order() {
    for seed in 0..20 {
        let kind = Kind { joints: 9, branched: true, floating: seed % 2 == 0, welded: 3, right_angled: false };
        let robot = RandomRobot::new(&mut Random(seed), kind);
        let (loaded, tree) = (robot.load(), robot.reference());
        for link in &tree.links {
            let body =
                loaded.model.bodies.iter().find(|b| b.name == link.name).expect("the reference has the same links");
            assert_eq!((body.joint.iq, body.joint.iv), (link.iq, link.iv), "{} of\n{}", link.name, robot.urdf());
        }
    }
}
