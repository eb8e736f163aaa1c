//! The inputs for a motion through many elastic stages: as many derivatives as the transmission takes, against a closed form.

use straightline_codegen::equations::Robot;
use straightline_codegen::expr::evaluate;
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::program::optimised;
use straightline_codegen::{compile, Function, Options, Source};
use straightline_core::algorithms::inverse_orders;
use straightline_core::Dd;

/// Of every stage: ratio, stiffness, inertia before it.
const STAGES: [[f64; 3]; 8] = [
    [3.0, 4e3, 1e-4],
    [-2.0, 9e3, 3e-4],
    [1.5, 2e4, 2e-3],
    [4.0, 5e4, 1e-3],
    [1.0, 6e4, 4e-3],
    [2.5, 7e4, 2e-3],
    [-1.25, 3e4, 6e-3],
    [1.75, 8e4, 5e-3],
];
/// Inertia about the axis, of the rotor, C_M = C_E, R, L.
const INERTIA: f64 = 0.35;
const ROTOR: f64 = 2e-5;
const MOTOR: [f64; 3] = [0.08, 1.2, 0.003];

/// A fly wheel behind so many stages.
fn wheel(stages: usize) -> Source {
    let stage = |[n, c, i]: &[f64; 3]| format!("{{ ratio = {n:?}, stiffness = {c:?}, input_inertia = {i:?} }}");
    let stages: Vec<String> = STAGES[..stages].iter().map(stage).collect();
    let [constant, resistance, inductance] = MOTOR;
    let text = format!(
        "[robot]\nname = \"wheel\"\ngravity = [0.0, 0.0, 0.0]\n[[link]]\nname = \"base\"\n[[link]]\nname = \"wheel\"\nmass = 2.0\n\
         com = [0.0, 0.0, 0.0]\ninertia = [0.2, 0.2, {INERTIA:?}]\n[[joint]]\nname = \"axle\"\nkind = \"continuous\"\nparent = \"base\"\n\
         child = \"wheel\"\naxis = \"z\"\n[[drive]]\njoint = \"axle\"\nstages = [{}]\nmotor = {{ torque_constant = {constant:?}, \
         resistance = {resistance:?}, inductance = {inductance:?}, rotor_inertia = {ROTOR:?} }}\n",
        stages.join(", ")
    );
    Source::new("wheel.toml", text)
}

/// Under q = sin ωt everything swings with q: a shaft by a factor, its load by another. The voltage for q = s, q̇ = ω c.
fn voltage(stages: usize, omega: Dd, (s, c): (Dd, Dd)) -> Dd {
    let number = |x: f64| Dd::from(x);
    let minus_square = -(omega * omega);
    let (mut angle, mut load) = (Dd::ONE, number(INERTIA) * minus_square);
    for [n, stiffness, inertia] in STAGES[..stages].iter().rev().map(|stage| stage.map(number)) {
        angle = n * (angle + load / stiffness);
        load = load / n + inertia * minus_square * angle;
    }
    let [constant, resistance, inductance] = MOTOR.map(number);
    let current = (load + number(ROTOR) * minus_square * angle) / constant;
    resistance * current * s + (inductance * current + constant * angle) * omega * c
}

#[test]
fn voltages_for_a_swing_behind_four_and_eight_springs_and_an_inductance_are_those_of_the_closed_form() {
    for stages in [1, 3, 4, 8] {
        let (model, diagnostics) = load(&wheel(stages), &ModelOptions::default());
        let robot = Robot::new(model.unwrap_or_else(|| panic!("{diagnostics}")));
        assert_eq!(inverse_orders(&robot.model.drives).expect("it has an inverse").of_torque, 2 * stages + 1);
        let options = Options::default();
        let function = Function::DrivenInverseDynamics;
        let graph = optimised(&robot, &[], function, &options, options.optimisations());
        let omega = Dd::from(7.0);
        let (s, c) = Dd::from(0.6).sin_cos();
        // derivatives of sin ωt
        let mut rates = vec![s];
        for k in 1..=2 * stages + 3 {
            let power = (0..k).fold(Dd::ONE, |product, _| product * omega);
            rates.push(power * [s, c, -s, -c][k % 4]);
        }
        let names: Vec<&str> = graph.inputs.iter().map(|p| p.name.as_str()).collect();
        let higher: Vec<String> = (3..=2 * stages + 3).map(|k| format!("q{k}")).collect();
        let expected: Vec<&str> = ["q", "qd", "qdd"].into_iter().chain(higher.iter().map(String::as_str)).collect();
        assert!(
            names.iter().all(|name| expected.contains(name)) && names.contains(&expected[2 * stages + 3]),
            "{names:?}"
        );
        let order = |name: &str| expected.iter().position(|e| *e == name).expect("it is one of them");
        let arguments: Vec<Dd> = names.iter().map(|name| rates[order(name)]).collect();
        let found = evaluate(&graph, &arguments)[0];
        let right = voltage(stages, omega, (s, c));
        assert!((found - right).to_f64().abs() < 1e-26 * right.to_f64().abs(), "{stages}: {found:?} {right:?}");
    }
}

#[test]
fn the_text_says_what_the_higher_derivatives_are() {
    let functions = vec![Function::DrivenInverseDynamics];
    let generated = compile(&wheel(4), &Options { functions, ..Options::default() }).unwrap_or_else(|d| panic!("{d}"));
    for line in ["* `q9`: ninth derivatives \\[rad/s⁹ or m/s⁹\\]", "* `q11`: 11th derivatives \\[rad/s¹¹ or m/s¹¹\\]"]
    {
        assert!(generated.text.contains(line), "{line}\n{}", generated.text);
    }
}
