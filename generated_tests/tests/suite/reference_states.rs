//! Compiled code against values with 25 digits: all robots, all states, all functions.

use std::fmt::Write;
use straightline_codegen::Function;
use straightline_core::trig::DOMAIN_F32;
use straightline_core::Dd;
use straightline_generated_tests::bounds::DATA;
use straightline_generated_tests::compiled;
use straightline_generated_tests::programs::{self, cast};
use straightline_generated_tests::reference::{Robot, State, ROBOTS};

/// The worst error of every robot and function, as a table.
#[derive(Default)]
struct Table {
    rows: String,
    failures: String,
}

impl Table {
    /// Judges a function by its results in these states; `None` where the data hold nothing.
    fn row<'a, T: Into<Dd> + Copy>(
        &mut self,
        robot: &Robot,
        function: Function,
        bound: f64,
        states: impl Iterator<Item = &'a State>,
        results: impl Fn(&State) -> Vec<T>,
    ) {
        let (mut worst, mut checked) = ((0.0, ""), 0);
        for state in states {
            let Some(expected) = robot.expected(state, function) else { continue };
            let results = results(state);
            checked += 1;
            let (error, component) = expected.worst(&results);
            if error > worst.0 {
                worst = (error, &state.id);
            }
            if error > bound && self.failures.len() < 20_000 {
                let (got, want): (Dd, Dd) = (results[component].into(), expected.values[component]);
                let _ = writeln!(
                    self.failures,
                    "{} of {}: component {component} is {:e}, not {:e}: scaled error {error:.1e} > {bound:.1e}\n{}",
                    function.name(),
                    robot.name,
                    got.to_f64(),
                    want.to_f64(),
                    state.ready_to_paste()
                );
            }
        }
        let (error, state) = worst;
        if checked == 0 {
            return;
        }
        let _ = writeln!(
            self.rows,
            "{:<20} {:<20} {checked:6} {error:9.1e} {bound:9.1e} {:8.3}  {state}",
            robot.name,
            function.name(),
            error / bound
        );
    }

    fn finish(self, claim: &str) {
        let head = format!(
            "{:<20} {:<20} {:>6} {:>9} {:>9} {:>8}  {}",
            "robot", "function", "states", "error", "bound", "ratio", "worst in"
        );
        println!("{claim}\n{head}\n{}", self.rows);
        assert!(self.failures.is_empty(), "{claim}\n{}", self.failures);
    }
}

fn robots() -> impl Iterator<Item = Robot> {
    ROBOTS.into_iter().map(Robot::load)
}

/// Whether a function's results depend on gravity, so that a state with its own needs a program of its own.
fn feels_gravity(function: Function) -> bool {
    use Function::*;
    matches!(function, InverseDynamics | BiasForce | GravityForce | ForwardDynamics | JointWrenches | Energy)
}

#[test]
fn compiled_functions_give_the_reference_values() {
    let mut table = Table::default();
    for robot in robots() {
        let compiled = compiled::robot(&robot.name);
        for function in Function::all() {
            let states = robot.states.iter().filter(|s| s.gravity.is_none() || !feels_gravity(function));
            table
                .row(&robot, function, robot.bound(function), states, |s| compiled.call(function, &s.inputs(function)));
        }
    }
    table.finish("compiled f64, the robot's own gravity");
}

#[test]
#[ignore = "slow proof: compiles every robot for another gravity"]
fn slow_proof_that_programs_for_another_gravity_give_the_reference_values() {
    let mut table = Table::default();
    for robot in robots() {
        for function in Function::all().filter(|f| feels_gravity(*f)) {
            for state in robot.states.iter().filter(|s| s.gravity.is_some()) {
                let mut options = programs::options(&robot);
                options.model.gravity = state.gravity;
                let program = programs::of_robot(&robot, function, &options);
                let results = |s: &State| programs::run::<f64>(&program, &s.inputs(function));
                table.row(&robot, function, robot.bound(function), [state].into_iter(), results);
            }
        }
    }
    table.finish("interpreted f64, programs for the state's gravity");
}

/// The inputs in double-double; a quaternion has length one in all digits, as in the data.
fn exact(robot: &Robot, inputs: &[Vec<f64>]) -> Vec<Vec<Dd>> {
    let mut wide = cast::<Dd>(inputs);
    if robot.floating {
        let quaternion = &mut wide[0][3..7];
        let norm = quaternion.iter().fold(Dd::ZERO, |sum, x| sum + *x * *x).sqrt();
        quaternion.iter_mut().for_each(|x| *x /= norm);
    }
    wide
}

/// Rounding left aside: what the compiler takes for the equations of the robot is right to all digits of the data. The
/// file's angles count as they are written here, as in the data.
#[test]
fn equations_have_all_digits_of_the_reference_values() {
    let mut table = Table::default();
    for robot in robots() {
        let mut options = programs::options(&robot);
        options.model.angle_tolerance = 0.0;
        for function in Function::all() {
            let program = programs::of_robot(&robot, function, &options);
            let states = robot.states.iter().filter(|s| s.gravity.is_none() || !feels_gravity(function));
            let results = |s: &State| programs::run::<Dd>(&program, &exact(&robot, &s.inputs(function)));
            table.row(&robot, function, DATA.most, states, results);
        }
    }
    table.finish("programs evaluated in double-double, angles as written");
}

/// In single precision: against the program itself in double-double at the inputs as f32 holds them, as the rounding of
/// the inputs is not the program's. The same bounds in units of f32's rounding; states within the domain of f32's sine.
#[test]
fn single_precision_loses_no_more_than_its_own_rounding() {
    let unit = f64::from(f32::EPSILON) / f64::EPSILON;
    let mut table = Table::default();
    for compiled in compiled::F32.iter().filter(|c| !c.exact) {
        let robot = Robot::load(compiled.robot);
        let options = programs::options(&robot);
        for function in Function::all() {
            let program = programs::of_robot(&robot, function, &options);
            let (mut worst, mut worst_state, mut checked) = (0.0, String::new(), 0);
            let within = |s: &&State| s.q.iter().all(|q| q.abs() < f64::from(DOMAIN_F32));
            for state in robot.states.iter().filter(|s| s.gravity.is_none()).filter(within) {
                let Some(mut expected) = robot.expected(state, function) else { continue };
                let inputs: Vec<Vec<f32>> = cast(&state.inputs(function));
                let wide: Vec<Vec<f64>> = inputs.iter().map(|g| g.iter().map(|x| f64::from(*x)).collect()).collect();
                expected.values = programs::run::<Dd>(&program, &cast(&wide));
                let results: Vec<f64> = compiled.call(function, &inputs).into_iter().map(f64::from).collect();
                let (error, _) = expected.worst(&results);
                checked += 1;
                if error > worst {
                    (worst, worst_state) = (error, state.id.clone());
                }
            }
            let bound = robot.bound(function) * unit;
            let line = format!(
                "{:<20} {:<20} {checked:6} {worst:9.1e} {bound:9.1e} {:8.3}  {worst_state}\n",
                robot.name,
                function.name(),
                worst / bound
            );
            if worst > bound {
                table.failures.push_str(&line);
            }
            table.rows.push_str(&line);
        }
    }
    table.finish("compiled f32");
}
