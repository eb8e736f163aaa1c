//! What is wrong with calls and options is said, and batches lie in memory however they like.

use crate::bits::TestNumber;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::options::Options;
use straightline_codegen::scene::{Budget, InputRange, JointRanges, MaxError, Scene};
use straightline_codegen::{Function, Scalar};
use straightline_jit::{BatchLayout, CallError, ExecutionMode, LoadError, Number, Robot};

const PLANAR: &str = include_str!("../../../robots/descriptions/planar_2r.toml");

fn planar(execution: ExecutionMode) -> Robot<f64> {
    let functions = vec![Function::InverseDynamics, Function::MassMatrix];
    let options = Options { functions, ..Options::default() };
    Robot::load_to_run(&Source::new("planar2r.toml", PLANAR), &options, execution).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn arrays_of_other_lengths_are_refused() {
    let robot = planar(ExecutionMode::best());
    let function = robot.function("inverse_dynamics").expect("it was asked for");
    let (q, mut tau) = ([0.1, 0.2], [0.0; 2]);
    let missing = function.call(&[&q, &q], &mut [&mut tau]);
    assert_eq!(missing, Err(CallError::Arrays { what: "inputs", expected: 3, found: 2 }));
    let missing = function.call(&[&q, &q, &q], &mut []);
    assert_eq!(missing, Err(CallError::Arrays { what: "results", expected: 1, found: 0 }));
    let short = function.call(&[&q, &q[..1], &q], &mut [&mut tau]).expect_err("it is too short");
    assert_eq!(short.to_string(), "`qd` has 1 numbers, the function takes 2");
    let long = function.call(&[&q, &q, &q], &mut [&mut [0.0; 3]]).expect_err("it is too long");
    assert_eq!(long.to_string(), "`tau` has 3 numbers, the function takes 2");
    let rows = BatchLayout::states_of(2);
    let inputs: [(&[f64], BatchLayout); 3] = [(&[0.0; 20], rows), (&[0.0; 20], rows), (&[0.0; 19], rows)];
    let short = function.batch(10, &inputs, &mut [(&mut [0.0; 20], rows)]).expect_err("it is too short");
    assert_eq!(short, CallError::Length { name: "qdd".to_string(), expected: 20, found: 19 });
    let all: [(&[f64], BatchLayout); 3] = [(&[0.0; 20], rows); 3];
    let over = BatchLayout { by_state: 1, by_entry: 1 };
    let overlap = function.batch(10, &all, &mut [(&mut [0.0; 20], over)]).expect_err("results overlap");
    assert!(matches!(overlap, CallError::Overlap { .. }), "{overlap}");
    let huge = BatchLayout { by_state: usize::MAX, by_entry: 2 };
    assert!(matches!(function.batch(10, &all, &mut [(&mut [0.0; 20], huge)]), Err(CallError::Length { .. })));
}

#[test]
fn an_unknown_function_is_told_with_those_that_there_are() {
    let robot = planar(ExecutionMode::best());
    let unknown = robot.function("forward_dynamics").expect_err("it was not asked for");
    assert_eq!(
        unknown.to_string(),
        "there is no function `forward_dynamics`\nhelp: the robot was loaded with inverse_dynamics, mass_matrix"
    );
}

#[test]
fn wrong_robots_and_options_for_texts_are_refused() {
    let wrong = Robot::<f64>::load(&Source::new("r.toml", "[robot]\nname = 3\n"), &Options::default());
    let Err(LoadError::Wrong(said)) = wrong else { panic!("it is no robot") };
    assert!(said.has_errors());
    let mut scene = Scene::default();
    scene.ranges.qd = JointRanges::All(InputRange::within(0.5));
    scene.ranges.qdd = JointRanges::All(InputRange::within(1.0));
    let budget = Budget { max_error: Some(MaxError::All(1e-6)), mixed_precision: true, ..Budget::default() };
    scene.budgets.insert(Function::InverseDynamics, budget);
    let functions = vec![Function::InverseDynamics];
    let mixed = Options { functions, scalar: Scalar::F32, scene, ..Options::default() };
    let refused = Robot::<f32>::load(&Source::new("planar2r.toml", PLANAR), &mixed).expect_err("it is in two formats");
    let why = "the option `mixed_precision` is not supported by machine code\nhelp: ";
    assert!(refused.to_string().starts_with(why), "{refused}");
}

/// Joints that slide beside one another, so many.
fn star<T: Number>(joints: usize, execution: ExecutionMode) -> Robot<T> {
    let mut text = "[robot]\nname = \"star\"\n[[link]]\nname = \"base\"\n".to_string();
    for k in 0..joints {
        text += &format!(
            "[[link]]\nname = \"l{k}\"\nmass = {}\ncom = [0.1, 0.0, 0.0]\ninertia = [0.1, 0.1, 0.1]\n\
             [[joint]]\nname = \"j{k}\"\nkind = \"prismatic\"\nparent = \"base\"\nchild = \"l{k}\"\naxis = [0.0, 0.6, 0.8]\n",
            0.3 * (k + 1) as f64
        );
    }
    let options = Options { functions: vec![Function::InverseDynamics], ..Options::default() };
    Robot::load_to_run(&Source::new("star.toml", text), &options, execution).unwrap_or_else(|e| panic!("{e}"))
}

/// Rows one behind the other and with gaps, columns, and numbers between others.
fn layouts(states: usize, entries: usize) -> [BatchLayout; 4] {
    [
        BatchLayout::states_of(entries),
        BatchLayout { by_state: entries + 3, by_entry: 1 },
        BatchLayout::entries_of(states),
        BatchLayout { by_state: entries * 3 + 1, by_entry: 2 },
    ]
}

fn batches_have_the_bits_of_single_calls<T: TestNumber>(joints: usize, execution: ExecutionMode) {
    let robot = star::<T>(joints, execution);
    let function = robot.function("inverse_dynamics").expect("it was asked for");
    for states in [0, 1, 2, 3, 4, 5, 7, 8, 9, 33] {
        let layouts = layouts(states, joints);
        // arrays as long as they have to be, and longer
        let most = states * (joints * 3 + 1) + 1;
        for (k, to) in layouts.into_iter().enumerate() {
            let from: [BatchLayout; 3] = std::array::from_fn(|input| layouts[(k + input) % 4]);
            let length = |layout: BatchLayout| match states {
                0 => 0,
                _ => (states - 1) * layout.by_state + (joints - 1) * layout.by_entry + 1,
            };
            let x: Vec<T> = (0..most).map(|k| T::of((k as f64 * 0.37).sin() * 3.0)).collect();
            let inputs = from.map(|layout| (&x[..length(layout)], layout));
            let mut tau = vec![T::of(f64::NAN); most];
            function.batch(states, &inputs, &mut [(&mut tau, to)]).unwrap_or_else(|e| panic!("{e}"));
            let mut exact = vec![T::of(f64::NAN); length(to)];
            function.batch(states, &inputs, &mut [(&mut exact, to)]).unwrap_or_else(|e| panic!("{e}"));
            assert!(exact.iter().zip(&tau).all(|(a, b)| a.bits() == b.bits()), "an array without room behind it");
            let mut written = vec![false; most];
            for i in 0..states {
                let at = |layout: &BatchLayout, k: usize| i * layout.by_state + k * layout.by_entry;
                let own = from.map(|layout| (0..joints).map(|k| x[at(&layout, k)]).collect::<Vec<T>>());
                let mut one = vec![T::of(0.0); joints];
                let call = function.call(&[&own[0], &own[1], &own[2]], &mut [&mut one]);
                call.unwrap_or_else(|e| panic!("{e}"));
                for (k, wanted) in one.iter().enumerate() {
                    let found = tau[at(&to, k)];
                    assert_eq!(
                        found.bits(),
                        wanted.bits(),
                        "{execution:?}, {joints}, {states} states, {from:?}, {to:?}"
                    );
                    written[at(&to, k)] = true;
                }
            }
            let is_left = |(x, written): (&T, &bool)| *written || x.is_nan();
            assert!(tau.iter().zip(&written).all(is_left), "nothing else is written");
        }
    }
}

/// As many states as fill vectors and as do not, none; states of fewer entries than a vector has, as many, and more.
#[test]
fn batches_have_the_bits_of_single_calls_in_every_layout() {
    for execution in ExecutionMode::ALL {
        for joints in [1, 2, 3, 5, 8, 11, 16, 19] {
            batches_have_the_bits_of_single_calls::<f64>(joints, execution);
            batches_have_the_bits_of_single_calls::<f32>(joints, execution);
        }
    }
}

/// Of as many threads as there are, more than there are, and more than there are states.
#[test]
fn threads_have_the_bits_of_one() {
    let robot = planar(ExecutionMode::best());
    let function = robot.function("mass_matrix").expect("it was asked for");
    for (states, threads) in [(0, 2), (1, 2), (3, 2), (64, 2), (65, 3), (1000, 2), (1001, 7), (33, 100), (50, 0)] {
        let layouts = |entries: usize| layouts(states, entries);
        let q: Vec<f64> = (0..states * 7 + 7).map(|k| (k as f64 * 0.37).sin() * 3.0).collect();
        for (from, to) in layouts(2).into_iter().flat_map(|from| layouts(4).map(|to| (from, to))) {
            let mut h = [vec![f64::NAN; states * 13 + 7], vec![f64::NAN; states * 13 + 7]];
            function.batch(states, &[(&q, from)], &mut [(&mut h[0], to)]).unwrap_or_else(|e| panic!("{e}"));
            let found = function.batch_in_threads(threads, states, &[(&q, from)], &mut [(&mut h[1], to)]);
            found.unwrap_or_else(|e| panic!("{e}"));
            let [one, several] = h.map(|h| h.into_iter().map(f64::to_bits).collect::<Vec<u64>>());
            assert_eq!(one, several, "{states} states, {threads} threads, {from:?}, {to:?}");
        }
    }
    let short = function.batch_in_threads(
        2,
        10,
        &[(&[0.0; 19], BatchLayout::states_of(2))],
        &mut [(&mut [0.0; 40], BatchLayout::states_of(4))],
    );
    assert_eq!(short, Err(CallError::Length { name: "q".to_string(), expected: 20, found: 19 }));
}
