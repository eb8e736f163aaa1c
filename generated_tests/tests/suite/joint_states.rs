//! Robots whose joints follow others, are balls, stand several in a body, or close loops, against values with 25 digits.

use straightline_codegen::function::Family;
use straightline_codegen::Function;
use straightline_core::Dd;
use straightline_generated_tests::bounds::DATA;
use straightline_generated_tests::compiled;
use straightline_generated_tests::programs::{self, cast};
use straightline_generated_tests::reference::{Robot, State, JOINTS};

/// Functions whose results depend on gravity.
fn feels_gravity(function: Function) -> bool {
    use Function::*;
    matches!(function, InverseDynamics | BiasForce | GravityForce | ForwardDynamics | JointWrenches | Energy)
}

/// Judges what `results` gives of every function in the states with the robot's own gravity; a line for each function, and how many states there were.
fn judge(
    robot: &Robot,
    bound: impl Fn(Function) -> f64,
    results: impl Fn(Function, &State) -> Vec<Dd>,
) -> (usize, String) {
    let (mut checked, mut failures) = (0, String::new());
    // of loops alone, of robots without, the data hold nothing
    for function in Function::known().filter(|f| matches!(f.spec().family, Family::Robot | Family::Loops)) {
        let (mut worst, mut at, mut states) = (0.0, "", 0);
        for state in robot.states.iter().filter(|s| s.gravity.is_none() || !feels_gravity(function)) {
            let Some(expected) = robot.expected(state, function) else { continue };
            states += 1;
            let (error, _) = expected.worst(&results(function, state));
            if error > worst {
                (worst, at) = (error, &state.id);
            }
        }
        if states == 0 {
            continue;
        }
        checked += states;
        let bound = bound(function);
        println!("{:<14} {:<20} {worst:9.1e} {bound:9.1e} {:8.3}  {at}", robot.name, function.name(), worst / bound);
        if worst > bound {
            failures += &format!("{} of {}: {worst:.1e} > {bound:.1e} in {at}\n", function.name(), robot.name);
        }
    }
    (checked, failures)
}

#[test]
fn compiled_functions_of_other_joints_give_the_reference_values() {
    let (mut checked, mut failures) = (0, String::new());
    for (name, _) in JOINTS {
        let robot = Robot::with_joints(name);
        let compiled = compiled::JOINTS.iter().find(|c| c.robot == name).expect("every robot is compiled");
        let of_compiled = |function: Function, state: &State| {
            let results = compiled.call(function, &state.inputs(function));
            results.into_iter().map(Dd::from).collect()
        };
        let (states, wrong) = judge(&robot, |function| robot.bound(function), of_compiled);
        (checked, failures) = (checked + states, failures + &wrong);
    }
    assert!(failures.is_empty(), "{failures}");
    assert!(checked > 1500, "{checked} results");
}

/// ∂τ/∂q and ∂τ/∂q̇, each of the scale of its greatest entry: of balls by increments R exp(dθ). Far angles of followers lose digits in y = ratio · q, as in τ.
#[test]
fn derivatives_of_other_joints_are_those_of_the_data() {
    let mut checked = 0;
    for (name, _) in JOINTS {
        let (robot, function) = (Robot::with_joints(name), Function::InverseDynamicsDerivatives);
        let program = programs::of_robot(&robot, function, &programs::options(&robot));
        for state in robot.states.iter().filter(|state| state.gravity.is_none()) {
            let Some(expected) = robot.expected(state, function) else { continue };
            // behind them H and τ
            let results: Vec<f64> = programs::run(&program, &state.inputs(function));
            let (error, component) = expected.worst(&results[..expected.values.len()]);
            let is_far = state.kind.starts_with("far_angle");
            let most = if is_far { robot.bound(Function::InverseDynamics) } else { 1e-14 };
            assert!(error <= most, "{}, component {component}: {error:.1e}", state.id);
            checked += 1;
        }
    }
    assert!(checked >= 30, "{checked} states");
}

/// The inputs in double-double; quaternions have length one in all digits, as in the data.
fn exact(quaternions: &[usize], inputs: &[Vec<f64>]) -> Vec<Vec<Dd>> {
    let mut wide = cast::<Dd>(inputs);
    for first in quaternions {
        let quaternion = &mut wide[0][*first..first + 4];
        let norm = quaternion.iter().fold(Dd::ZERO, |sum, x| sum + *x * *x).sqrt();
        quaternion.iter_mut().for_each(|x| *x /= norm);
    }
    wide
}

/// Rounding left aside, angles as they are written.
#[test]
fn equations_of_other_joints_have_all_digits_of_the_reference_values() {
    let mut failures = String::new();
    for (name, _) in JOINTS {
        let robot = Robot::with_joints(name);
        let mut options = programs::options(&robot);
        options.model.angle_tolerance = 0.0;
        let loaded = programs::load(&programs::source(&robot), &options.model);
        let quaternions: Vec<usize> =
            loaded.model.free_joints().filter_map(|joint| Some(joint.iq + joint.kind.row().quaternion?)).collect();
        let of_program = |function: Function, state: &State| {
            let program = programs::of_robot(&robot, function, &options);
            let mut inputs = exact(&quaternions, &state.inputs(function));
            match function {
                // a base stays where it is, its quaternion as it is written
                Function::CloseLoops => inputs = cast::<Dd>(&state.inputs(function)),
                // what was rounded is closed again
                _ => inputs[0] = loaded.model.close_loops(&inputs[0], 3).0,
            }
            let results = programs::run::<Dd>(&program, &inputs);
            if function != Function::CloseLoops {
                return results;
            }
            // its steps are those that f64 needs
            programs::run::<Dd>(&program, &[results[..inputs[0].len()].to_vec()])
        };
        failures += &judge(&robot, |_| DATA.most, of_program).1;
    }
    assert!(failures.is_empty(), "{failures}");
}
