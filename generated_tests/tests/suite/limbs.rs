//! Identical limbs as lanes of one body, as rustc compiles them: values with 25 digits, and the bits of the program.

use straightline::Real;
use straightline_codegen::choices::LimbForm;
use straightline_codegen::{Function, Options};
use straightline_generated_tests::compiled::limbs_generic as solo12;
use straightline_generated_tests::compiled::limbs_humanoid as humanoid;
use straightline_generated_tests::compiled::limbs_hyq as hyq;
use straightline_generated_tests::programs::{self, cast};
use straightline_generated_tests::reference::Robot;

type Call = fn(&[Vec<f64>]) -> Vec<f64>;

macro_rules! call {
    ($robot:ident::$function:ident($($k:literal),*)) => {
        (|x: &[Vec<f64>]| {
            let mut y = [0.0; $robot::NV];
            $robot::$function($(x[$k].as_slice().try_into().expect("a number per coordinate"),)* &mut y);
            y.to_vec()
        }) as Call
    };
}

fn solo12_torques<T: Real>(x: &[Vec<T>]) -> Vec<T> {
    let mut y = [T::zero(); solo12::NV];
    let array = |k: usize| x[k].as_slice().try_into().expect("a number per velocity");
    solo12::inverse_dynamics(x[0].as_slice().try_into().expect("a number per coordinate"), array(1), array(2), &mut y);
    y.to_vec()
}

fn options(robot: &Robot) -> Options {
    Options { limbs: LimbForm::Lanes, ..programs::options(robot) }
}

#[test]
fn compiled_lanes_give_the_reference_values_and_the_bits_of_their_program() {
    use Function::{BiasForce, GravityForce, InverseDynamics, VelocityForce};
    let calls = [
        ("hyq", InverseDynamics, call!(hyq::inverse_dynamics(0, 1, 2))),
        ("hyq", GravityForce, call!(hyq::gravity_force(0))),
        ("hyq", BiasForce, call!(hyq::bias_force(0, 1))),
        ("hyq", VelocityForce, call!(hyq::velocity_force(0, 1))),
        ("simple_humanoid", InverseDynamics, call!(humanoid::inverse_dynamics(0, 1, 2))),
        ("simple_humanoid", GravityForce, call!(humanoid::gravity_force(0))),
        ("simple_humanoid", BiasForce, call!(humanoid::bias_force(0, 1))),
        ("simple_humanoid", VelocityForce, call!(humanoid::velocity_force(0, 1))),
        ("solo12", InverseDynamics, solo12_torques::<f64> as Call),
    ];
    for (name, function, call) in calls {
        let robot = Robot::load(name);
        let program = programs::of_robot(&robot, function, &options(&robot));
        assert!(!program.graph.alike.is_empty(), "{name} has limbs that are alike");
        let (mut worst, mut checked) = (0.0f64, 0);
        for state in robot.states.iter().filter(|s| s.gravity.is_none()) {
            let inputs = state.inputs(function);
            let computed = call(&inputs);
            let interpreted = programs::run::<f64>(&program, &inputs);
            let bits = |x: &[f64]| x.iter().map(|x| (x + 0.0).to_bits()).collect::<Vec<_>>();
            assert_eq!(
                bits(&computed),
                bits(&interpreted),
                "{} of {name}\n{}",
                function.name(),
                state.ready_to_paste()
            );
            let Some(expected) = robot.expected(state, function) else { continue };
            worst = worst.max(expected.worst(&computed).0);
            checked += 1;
        }
        println!("{name} {}: {worst:.1e}, bound {:.1e}", function.name(), robot.bound(function));
        // the bar of limbs apart
        assert!(checked >= 30 && worst <= robot.bound(function), "{} of {name}: {worst:e}", function.name());
    }
}

#[test]
fn lanes_of_any_scalar_have_its_bits() {
    let robot = Robot::load("solo12");
    let program = programs::of_robot(&robot, Function::InverseDynamics, &options(&robot));
    for state in robot.states.iter().filter(|s| s.gravity.is_none()) {
        let inputs = cast::<f32>(&state.inputs(Function::InverseDynamics));
        let bits = |x: Vec<f32>| x.iter().map(|x| (x + 0.0).to_bits()).collect::<Vec<_>>();
        let interpreted = programs::run::<f32>(&program, &inputs);
        assert_eq!(bits(solo12_torques(&inputs)), bits(interpreted), "{}", state.ready_to_paste());
    }
}
