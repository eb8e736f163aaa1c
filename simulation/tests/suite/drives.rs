//! Robots with drives in simulations: closed forms, energy balances, stiffness, limits.

use crate::common::{arm, cart};
use straightline_core::drive::{Actuator, Drive, Efficiency, LinearActuator, Motor, Rating, Rotor, Stage, Thermal};
use straightline_core::model::{Coulomb, JointEffects, Model};
use straightline_core::spatial::Vec3;
use straightline_simulation::advice::{advise, Lever};
use straightline_simulation::analysis::analyze;
use straightline_simulation::command::{Command, Compensation, Controller, Samples};
use straightline_simulation::drives::Inputs;
use straightline_simulation::motion::Motion;
use straightline_simulation::plant::Plant;
use straightline_simulation::simulate::{simulate, Method, Run, Settings};

const MOTOR: Motor<f64> = Motor {
    rotor_inertia: 8e-5,
    torque_constant: 0.1,
    emf_constant: 0.1,
    friction: 1e-4,
    resistance: 1.1,
    inductance: Some(2e-3),
};

const SETTINGS: Settings = Settings {
    duration: 1.0,
    interval: 0.02,
    tolerance: 1e-12,
    method: Method::Adaptive,
    stops_at_limits: false,
    most_steps: 1_000_000,
};

/// With its share of the joint, if it drives one.
fn drive(name: &str, motor: Motor<f64>, joints: &[(usize, f64)]) -> Drive<f64> {
    let shares = match joints {
        [(body, n)] => Some(vec![(*body, 1.0 / n)]),
        _ => None,
    };
    Drive { shares, ..crate::common::drive(name, motor, joints) }
}

fn losses(forward: f64, backward: f64) -> Option<Efficiency<f64>> {
    Some(Efficiency { forward, backward, speed: None })
}

fn stage(ratio: f64, stiffness: f64, damping: Option<f64>) -> Stage<f64> {
    Stage { ratio, stiffness, damping, inertia: 2e-6, efficiency: None }
}

/// Inductance, losses and a rotor in space before the first joint; a differential of a rigid drive with losses and an elastic one of two
/// stages with losses, dampers and gear inertias; every input and every current is limited.
fn everything() -> Model<f64> {
    let mut model = arm();
    let mut shoulder = drive("shoulder", MOTOR, &[(0, 80.0)]);
    shoulder.efficiency = losses(0.8, 0.7);
    let axis = Vec3::new(1.0 / 5f64.sqrt(), 0.0, 2.0 / 5f64.sqrt());
    shoulder.rotor = Some(Rotor { body: 0, axis, inertia: 8e-5 });
    (shoulder.input_limit, shoulder.current_limit) = (Some(20.0), Some(8.0));
    let quick = Motor { inductance: None, ..MOTOR };
    let mut left = drive("left", quick, &[(1, 40.0), (2, 30.0)]);
    left.efficiency = losses(0.85, 0.85);
    (left.input_limit, left.current_limit) = (Some(20.0), Some(8.0));
    let mut right = drive("right", MOTOR, &[(1, 1.1), (2, -0.9)]);
    right.stages = vec![
        Stage { efficiency: losses(0.9, 0.9), ..stage(3.0, 40.0, Some(0.05)) },
        Stage { efficiency: losses(0.8, 0.6), ..stage(20.0, 900.0, None) },
    ];
    right.shaft_inertia = Some(5e-3);
    right.input_limit = Some(20.0);
    model.drives = vec![shoulder, left, right];
    model
}

/// One drive at every joint, of one kind.
fn each(change: impl Fn(&mut Drive<f64>)) -> Model<f64> {
    let mut model = arm();
    for body in &mut model.bodies {
        body.effects = JointEffects::none();
    }
    let plain = Motor { friction: 0.0, inductance: None, ..MOTOR };
    model.drives = [80.0, -60.0, 40.0].into_iter().enumerate().map(|(k, n)| drive("", plain, &[(k, n)])).collect();
    for (k, drive) in model.drives.iter_mut().enumerate() {
        drive.name = format!("drive{k}");
        change(drive);
    }
    model
}

fn elastic(drive: &mut Drive<f64>, damping: Option<f64>) {
    drive.stages = vec![stage(drive.joints[0].1, 2e3, damping)];
    drive.joints[0].1 = 1.0;
    drive.shares = Some(vec![(drive.joints[0].0, 1.0)]);
}

fn motor(drive: &mut Drive<f64>) -> &mut Motor<f64> {
    match &mut drive.actuator {
        Actuator::Motor(motor) => motor,
        Actuator::Linear(_) => panic!("it has a motor"),
    }
}

/// Voltages that swing, sampled densely enough to have few corners.
fn voltages(duration: f64) -> Command {
    let times: Vec<f64> = (0..=(duration / 0.25).ceil() as usize).map(|k| 0.25 * k as f64).collect();
    let row = |t: &f64| vec![12.0 * (2.0 * t).sin(), 16.0 * (1.3 * t + 0.4).cos(), 25.0 * (1.7 * t).sin()];
    let rows = times.iter().map(row).collect();
    Command::Inputs(Inputs { samples: Samples { times, rows }, are_currents: vec![false; 3] }, None)
}

fn run(model: Model<f64>, command: &Command, q: &[f64], settings: &Settings) -> Run {
    let currents = command.current_inputs(model.drives.len());
    let plant = Plant::new(model, 0.05).with_current_inputs(&currents);
    simulate(&plant, command, (q, &vec![0.0; q.len()]), settings, &|_| ()).unwrap_or_else(|failure| panic!("{failure}"))
}

/// Every kind of effect by itself.
fn alone() -> Vec<(&'static str, Model<f64>)> {
    vec![
        ("Joule heat", each(|_| ())),
        ("motor friction", each(|d| motor(d).friction = 2e-4)),
        ("inductance", each(|d| motor(d).inductance = Some(2e-3))),
        ("conversion", each(|d| motor(d).emf_constant = 0.08)),
        ("gear losses", each(|d| d.efficiency = losses(0.8, 0.6))),
        ("gear inertia", each(|d| d.shaft_inertia = Some(1e-4))),
        ("springs", each(|d| elastic(d, None))),
        ("damped springs", each(|d| elastic(d, Some(2.0)))),
        ("voltage limits", each(|d| d.input_limit = Some(9.0))),
        ("current limits", each(|d| d.current_limit = Some(4.0))),
        (
            "current limits with inductance",
            each(|d| {
                motor(d).inductance = Some(2e-3);
                d.current_limit = Some(4.0);
            }),
        ),
        ("rotors in space", {
            let axis = Vec3::new(0.6, 0.0, 0.8);
            each(|d| d.rotor = Some(Rotor { body: d.joints[0].0, axis, inertia: 8e-5 }))
        }),
        ("friction in joints", {
            let mut model = each(|_| ());
            for body in &mut model.bodies {
                body.effects.damping = 0.3;
                body.effects.coulomb = Coulomb::Sign(0.4);
            }
            model
        }),
    ]
}

fn keeps_its_books(what: &str, model: Model<f64>, duration: f64) {
    let run = run(model, &voltages(duration), &[0.3, -0.4, 0.5], &Settings { duration, ..SETTINGS });
    let balance = run.balance;
    println!("{what}: {:.1e} of what was turned over, {} steps; {balance:?}", balance.relative(), run.steps);
    assert!(balance.relative() < 1e-9, "{what}: {:e}", balance.relative());
    assert!(balance.drives.electrical.abs() > 0.01 && balance.drives.joule > 0.01, "{what}");
}

#[test]
fn electrical_input_is_heat_friction_losses_and_energy() {
    keeps_its_books("everything", everything(), 1.0);
    for (what, model) in alone() {
        keeps_its_books(what, model, 0.5);
    }
}

/// `cargo test --release -p straightline-simulation --test suite ten_seconds -- --ignored --nocapture`.
#[test]
#[ignore = "minutes"]
fn electrical_input_is_heat_friction_losses_and_energy_over_ten_seconds() {
    keeps_its_books("everything", everything(), 10.0);
    for (what, model) in alone() {
        keeps_its_books(what, model, 10.0);
    }
}

#[test]
fn a_motor_under_a_step_of_voltage_runs_up_as_the_closed_form_says() {
    // a cart of 2 kg on a spindle: (m + J N²) v̇ = N C_M i, L i̇ = u − R i − C_E N v
    let (n, u) = (200.0, 6.0);
    let mut model = cart();
    let mut spindle = drive("spindle", Motor { friction: 0.0, ..MOTOR }, &[(0, n)]);
    motor(&mut spindle).inductance = Some(2e-3);
    model.drives = vec![spindle];
    let samples = Samples { times: vec![0.0], rows: vec![vec![u]] };
    let command = Command::Inputs(Inputs { samples, are_currents: vec![false] }, None);
    for method in [Method::Adaptive, Method::Stiff] {
        let run = run(model.clone(), &command, &[0.0], &Settings { method, tolerance: 1e-10, ..SETTINGS });
        let (m, k) = (2.0 + MOTOR.rotor_inertia * n * n, MOTOR.torque_constant * n);
        let (r, l) = (MOTOR.resistance, 2e-3);
        // i̇ and v of the two exponentials: s² L m + s R m + k² = 0
        let root = (r * r * m * m - 4.0 * l * m * k * k).sqrt();
        let (s1, s2) = ((-r * m + root) / (2.0 * l * m), (-r * m - root) / (2.0 * l * m));
        // v = u/k + a e^{s1 t} + b e^{s2 t} with v(0) = 0 and v̇(0) = 0
        let (a, b) = (u / k * s2 / (s1 - s2), -u / k * s1 / (s1 - s2));
        let column = |name: &str| run.table.column(name).expect("a column");
        for ((t, v), i) in column("t").iter().zip(column("qd.to_cart")).zip(column("i.spindle")) {
            let (e1, e2) = (a * (s1 * t).exp(), b * (s2 * t).exp());
            // rows within steps are interpolated, the last one is not
            let bound = if *t == SETTINGS.duration { 1e-9 } else { 5e-5 };
            assert!((v - (u / k + e1 + e2)).abs() < bound, "{method:?} {t}: {v}");
            assert!((i - m / k * (s1 * e1 + s2 * e2)).abs() < 100.0 * bound, "{method:?} {t}: {i}");
        }
    }
}

#[test]
fn a_current_amplifier_keeps_its_current_as_far_as_the_voltage_allows() {
    let n = 200.0;
    let mut model = cart();
    let mut spindle = drive("spindle", Motor { friction: 0.0, ..MOTOR }, &[(0, n)]);
    spindle.input_limit = Some(10.0);
    model.drives = vec![spindle];
    let samples = Samples { times: vec![0.0], rows: vec![vec![2.0]] };
    let command = Command::Inputs(Inputs { samples, are_currents: vec![true] }, None);
    let run = run(model, &command, &[0.0], &SETTINGS);
    let column = |name: &str| run.table.column(name).expect("a column");
    let acceleration = MOTOR.torque_constant * n * 2.0 / (2.0 + MOTOR.rotor_inertia * n * n);
    // until R i + C_E N v = 10 V
    let until = (10.0 - MOTOR.resistance * 2.0) / (MOTOR.emf_constant * n * acceleration);
    let mut at_limit = 0;
    for (((t, v), i), u) in
        column("t").iter().zip(column("qd.to_cart")).zip(column("i.spindle")).zip(column("u.spindle"))
    {
        if *t < until {
            assert!((v - acceleration * t).abs() < 1e-9 && (i - 2.0).abs() < 1e-12, "{t}: {v} {i}");
        } else {
            assert!((u - 10.0).abs() < 1e-9 && i < 2.0, "{t}: {u} {i}");
            at_limit += 1;
        }
    }
    assert!(at_limit > 3 && run.balance.relative() < 1e-9, "{at_limit} {:?}", run.balance);
}

#[test]
fn stiff_drives_take_sensible_steps() {
    // c = 1e6 N·m/rad, L/R = 1e-5 s
    let mut model = everything();
    for drive in &mut model.drives {
        motor(drive).resistance = 1.0;
        motor(drive).inductance = Some(1e-5);
        for stage in &mut drive.stages {
            (stage.stiffness, stage.damping) = (1e6, Some(50.0));
        }
    }
    let settings = Settings { method: Method::Stiff, tolerance: 1e-6, duration: 1.0, ..SETTINGS };
    let stiff = run(model.clone(), &voltages(1.0), &[0.3, -0.4, 0.5], &settings);
    println!("{} steps, {} evaluations; {:?}", stiff.steps, stiff.evaluations, stiff.balance);
    assert!(stiff.table.rows.iter().flatten().all(|x| x.is_finite()));
    // explicit steps would have to be shorter than L/R
    assert!(stiff.steps < 20_000, "{} steps", stiff.steps);
    // without the limits of the currents, which implicit steps meet gradually: as without inductances, gone after 1e-5 s
    for drive in &mut model.drives {
        drive.current_limit = None;
    }
    let stiff = run(model.clone(), &voltages(1.0), &[0.3, -0.4, 0.5], &settings);
    let moved = (0..3).map(|j| (stiff.q[j] - [0.3, -0.4, 0.5][j]).abs()).fold(0.0, f64::max);
    assert!(moved > 0.05, "{:?}", stiff.q);
    let mut quick = model;
    for drive in &mut quick.drives {
        motor(drive).inductance = None;
    }
    let quick = run(quick, &voltages(1.0), &[0.3, -0.4, 0.5], &settings);
    let apart = (0..3).map(|j| (stiff.q[j] - quick.q[j]).abs()).fold(0.0, f64::max);
    println!("{:?} {:?}", stiff.q, quick.q);
    assert!(apart < 1e-2 * moved, "{apart}");
    assert!(stiff.balance.relative() < 1e-5, "{:e}", stiff.balance.relative());
}

#[test]
fn a_linear_actuator_that_is_a_motor_moves_as_the_motor() {
    let m = Motor { friction: 2e-5, ..MOTOR };
    let (j, l) = (m.rotor_inertia, 2e-3);
    let with_motor = each(|d| *motor(d) = m);
    // x = (θ, θ̇, i)
    let actuator = LinearActuator {
        c: vec![
            0.0,
            1.0,
            0.0,
            0.0,
            -m.friction / j,
            m.torque_constant / j,
            0.0,
            -m.emf_constant / l,
            -m.resistance / l,
        ],
        f: vec![0.0, -1.0 / j, 0.0],
        d: vec![0.0, 0.0, 1.0 / l],
        t: vec![0.0, 1.0, 0.0],
        position: None,
        relative_degree: 1,
        is_unyielding: false,
    };
    let with_actuator = each(|d| d.actuator = Actuator::Linear(actuator.clone()));
    let settings = Settings { duration: 0.5, ..SETTINGS };
    let [a, b] = [with_motor, with_actuator].map(|model| run(model, &voltages(0.5), &[0.3, -0.4, 0.5], &settings));
    assert!((0..3).all(|j| (a.q[j] - b.q[j]).abs() < 1e-9), "{:?} {:?}", a.q, b.q);
    assert!(b.balance.relative() < 1e-9 || b.balance.drives.electrical.abs() > 0.0);
}

/// Tracking errors at the end of a motion and on the way, under a controller of drives.
fn tracked(model: &Model<f64>, compensation: Compensation, gives_currents: bool) -> f64 {
    let points = [vec![0.1, -0.6, 0.2], vec![0.9, 0.2, -0.5]];
    let rest = |q: &Vec<f64>| (q.clone(), vec![0.0; 3], vec![0.0; 3]);
    let motion = Motion::smooth(&[0.0, 1.0], &points).expect("a motion");
    assert_eq!(motion.at(0.0), rest(&points[0]));
    let controller = Controller {
        model: model.clone(),
        compensation,
        motion: motion.clone(),
        stiffness: vec![if compensation == Compensation::ComputedTorque { 100.0 } else { 60.0 }; 3],
        damping: vec![if compensation == Compensation::ComputedTorque { 20.0 } else { 6.0 }; 3],
        saturates: false,
        gives_currents,
        period: None,
        feedback: None,
        delay: 0,
    };
    let command = Command::Controller(Box::new(controller));
    let plant = Plant::new(model.clone(), 0.05).with_current_inputs(&command.current_inputs(3));
    let state = straightline_simulation::drives::state_of_motion(&plant.model, &motion, 0.0).expect("it follows");
    let start = plant.state_with(&points[0], &[0.0; 3], &state);
    let settings = Settings { tolerance: 1e-9, ..SETTINGS };
    let run = straightline_simulation::simulate::simulate_from(&plant, &command, start, &settings, &|_| ())
        .unwrap_or_else(|failure| panic!("{failure}"));
    let error = |row: &Vec<f64>| {
        let (r, ..) = motion.at(row[0]);
        (0..3).map(|j| (r[j] - row[1 + j]).abs()).fold(0.0, f64::max)
    };
    run.table.rows.iter().map(error).fold(0.0, f64::max)
}

#[test]
fn feed_forward_of_elastic_drives_follows_a_smooth_motion() {
    let rigid = each(|d| motor(d).inductance = Some(2e-4));
    let springs = each(|d| {
        motor(d).inductance = Some(2e-4);
        elastic(d, None);
    });
    let damped = each(|d| elastic(d, Some(2.0)));
    for (what, model, bound) in [("rigid", rigid, 1e-6), ("springs", springs, 1e-6), ("damped", damped, 2e-3)] {
        let plain = tracked(&model, Compensation::None, false);
        let exact = tracked(&model, Compensation::FeedForward, false);
        println!("{what}: {plain:.1e} rad without, {exact:.1e} rad with feed-forward");
        assert!(exact < bound && exact < 0.02 * plain, "{what}: {plain:e} {exact:e}");
    }
    let rigid = each(|_| ());
    assert!(tracked(&rigid, Compensation::ComputedTorque, true) < 1e-6);
    assert!(tracked(&rigid, Compensation::ComputedTorque, false) < 1e-6);
}

#[test]
fn an_analysis_asks_of_a_spindle_what_the_closed_form_says() {
    // a cart of 2 kg on a spindle: u = R i + L i̇ + C_E N v, C_M N i = (m + J N²) v̇
    let n = 200.0;
    let mut model = cart();
    let mut spindle = drive("spindle", Motor { friction: 0.0, ..MOTOR }, &[(0, n)]);
    spindle.input_limit = Some(7.0);
    spindle.rating = Rating {
        speed: Some(1e4),
        continuous_current: Some(1.0),
        thermal: Some(Thermal {
            winding_housing: 2.0,
            housing_ambient: 5.0,
            winding_time: 40.0,
            housing_time: 1000.0,
            ambient: 20.0,
            limit: Some(30.0),
        }),
    };
    model.drives = vec![spindle];
    let motion = Motion::smooth(&[0.0, 1.0], &[vec![0.0], vec![0.25]]).expect("a motion");
    let found = analyze(&model, &motion, 1e-3).expect("it can be analysed");
    let drives = found.drives.expect("its inputs follow from the motion");
    let mass = 2.0 + MOTOR.rotor_inertia * n * n;
    let voltage = |t: f64| {
        let rates = motion.derivatives(t);
        let (i, rate) = (mass * rates[2][0] / (0.1 * n), mass * rates[3][0] / (0.1 * n));
        (MOTOR.resistance * i + 2e-3 * rate + 0.1 * n * rates[1][0], i)
    };
    let (mut given, mut joule, mut squares) = (0.0, 0.0, 0.0);
    for row in &drives.table.rows {
        let (u, i) = voltage(row[0]);
        assert!((row[1] - u).abs() < 1e-12 * 20.0 && (row[2] - i).abs() < 1e-12 * 10.0, "{row:?} {u} {i}");
        given += 1e-3 * (u * i).max(0.0);
        joule += 1e-3 * MOTOR.resistance * i * i;
        squares += 1e-3 * i * i;
    }
    let figures = &drives.drives[0];
    assert!((figures.energy.0 - given).abs() < 1e-3 * given && (figures.joule - joule).abs() < 1e-3 * joule);
    assert!((figures.rms_current - f64::sqrt(squares)).abs() < 1e-3 * figures.rms_current);
    // at rest before and after: what came in is heat, losses are Joule's alone
    assert!((figures.energy.0 - figures.energy.1 - figures.joule).abs() < 1e-6 * figures.joule);
    // the voltage passes its limit where the closed form does
    let first = found.violations.iter().find(|v| v.what == "voltage").expect("7 V are not enough");
    assert!((voltage(first.time).0 - 7.0).abs() < 1e-9 && first.joint == "spindle", "{first:?}");
    assert!(found.violations.iter().any(|v| v.what == "rms current") == (f64::sqrt(squares) > 1.0));
    // mean heat through both resistances, and the time to the limit of both exponentials
    let heating = figures.heating.expect("there are thermal data");
    assert!((heating.settled.0 - (20.0 + 7.0 * figures.joule)).abs() < 1e-9);
    assert!(heating.peak > 20.0 && heating.peak < 20.0 + figures.joule * 2.0);
    assert_eq!(heating.limit_after.is_some(), heating.settled.0 > 30.0);
    assert!(drives.jump.is_none());
    let trapezoid = Motion::trapezoidal(&[vec![0.0], vec![0.25]], &[1.0], &[2.0]).expect("a motion");
    let rough = analyze(&model, &trapezoid, 1e-2)
        .expect("it can be analysed")
        .drives
        .expect("drives")
        .jump
        .expect("its acceleration jumps");
    assert!(rough.order == 2 && rough.coordinate == 0 && rough.time > 0.0);
}

#[test]
fn a_winding_heats_as_the_closed_form_of_one_body_says() {
    // with a housing that takes all heat: T_w = R₁ P (1 − e^{−t/τ})
    let mut model = cart();
    model.gravity = Vec3::new(-9.81, 0.0, 0.0);
    let mut spindle = drive("spindle", Motor { friction: 0.0, inductance: None, ..MOTOR }, &[(0, 200.0)]);
    let thermal = Thermal {
        winding_housing: 2.0,
        housing_ambient: 1e-9,
        winding_time: 40.0,
        housing_time: 1e-3,
        ambient: 20.0,
        limit: Some(20.5),
    };
    spindle.rating.thermal = Some(thermal.clone());
    model.drives = vec![spindle];
    let still = Motion::cubic(&[0.0, 100.0], &[vec![0.1], vec![0.1]]).expect("a motion");
    let drives = analyze(&model, &still, 0.1).expect("it can be analysed").drives.expect("drives");
    let current = 2.0 * 9.81 / (0.1 * 200.0);
    let rise = 2.0 * MOTOR.resistance * current * current;
    let column = drives.table.column("winding.spindle").expect("a column");
    for (row, winding) in drives.table.rows.iter().zip(column) {
        let expected = 20.0 + rise * (1.0 - (-row[0] / 40.0).exp());
        assert!((winding - expected).abs() < 1e-4 * rise, "{} {winding} {expected}", row[0]);
    }
    let after = drives.drives[0].heating.and_then(|h| h.limit_after).expect("it gets too hot");
    assert!((after - -40.0 * (1.0 - 0.5 / rise).ln()).abs() < 1e-6, "{after}");
    // a winding of no mass follows a slow housing, in as little time however far apart the two are: R₁ P + R₂ P (1 − e^{−t/τ_h})
    let slow = Thermal {
        housing_ambient: 1.0,
        winding_time: 1e-9,
        housing_time: 1e9,
        limit: Some(20.0 + 1.2 * rise),
        ..thermal
    };
    model.drives[0].rating.thermal = Some(slow);
    let drives = analyze(&model, &still, 0.1).expect("it can be analysed").drives.expect("drives");
    let after = drives.drives[0].heating.and_then(|h| h.limit_after).expect("it gets too hot");
    let expected = -1e9 * (1.0f64 - 0.2 / 0.5).ln();
    assert!((after - expected).abs() < 1e-6 * expected, "{after} {expected}");
}

#[test]
fn figures_beyond_the_numbers_are_named() {
    let mut model = cart();
    let motion = Motion::cubic(&[0.0, 1.0], &[vec![0.1], vec![0.4]]).expect("a motion");
    analyze(&model, &motion, 0.1).expect("figures");
    // forces are numbers, their squares are none
    model.bodies[0].inertia.mass = 1e200;
    let failure = analyze(&model, &motion, 0.1).expect_err("no figures");
    assert!(failure.why.contains("`rms` of") && failure.help.is_some(), "{failure}");
}

#[test]
fn a_smooth_motion_through_a_point_does_not_jump() {
    let model = each(|d| elastic(d, None));
    let points = [vec![0.1, -0.6, 0.2], vec![0.45, 0.2, 0.25], vec![0.9, -0.2, -0.5]];
    for times in [[0.0, 0.5, 1.0], [0.0, 0.37, 1.31], [0.0, 1e-2, 30.0]] {
        let jump = |motion: Motion| analyze(&model, &motion, 0.1).expect("figures").drives.expect("drives").jump;
        assert_eq!(jump(Motion::smooth(&times, &points).expect("a motion")), None, "{times:?}");
        // of quintic splines the third derivative jumps, which springs would have to follow
        let found = jump(Motion::quintic(&times, &points).expect("a motion")).expect("it jumps");
        assert_eq!((found.order, found.time), (3, times[1]), "{times:?}");
    }
}

/// Advice that is followed keeps the limit, and a little less of it does not.
#[test]
fn advice_that_is_followed_keeps_the_limit() {
    let mut model = each(|d| {
        d.input_limit = Some(14.0);
        d.current_limit = Some(1.2);
        d.rating = Rating {
            speed: Some(90.0),
            continuous_current: Some(0.8),
            thermal: Some(Thermal {
                winding_housing: 2.0,
                housing_ambient: 5.0,
                winding_time: 4.0,
                housing_time: 100.0,
                ambient: 20.0,
                limit: Some(20.3),
            }),
        };
    });
    model.bodies[1].joint.limits.effort = 25.0;
    model.bodies[2].joint.limits.velocity = 0.8;
    let points = [vec![0.1, -1.2, 0.2], vec![1.2, 0.2, -0.9]];
    let (motion, interval) = (Motion::quintic(&[0.0, 1.0], &points).expect("a motion"), 0.01);
    let found = analyze(&model, &motion, interval).expect("figures");
    let (mut kinds, mut levers) = (Vec::new(), Vec::new());
    for violation in &found.violations {
        let all = advise(&model, &motion, interval, violation);
        kinds.push(violation.what);
        for advice in &all {
            println!("{} of {}: {advice}", violation.what, violation.joint);
            let is_kept = |factor: f64| {
                let (model, motion) = advice.lever.apply(factor, &model, &motion);
                let found = analyze(&model, &motion, interval).expect("figures");
                !found.violations.iter().any(|v| v.joint == violation.joint && v.what == violation.what)
            };
            assert!(is_kept(advice.factor), "{violation:?}: {advice}");
            // three digits, and half a percent for the instants
            let less = 1.0 + 0.97 * (advice.factor - 1.0);
            assert!(!is_kept(less), "{violation:?}: {advice}: less would do");
            let kind = match advice.lever {
                Lever::Time => "time",
                Lever::GearRatio(_) => "ratio",
                Lever::MotorConstant(_) => "constant",
                Lever::Mass(_) => "mass",
            };
            levers.push(kind);
        }
    }
    for kind in ["effort", "speed", "voltage", "current", "motor speed", "rms current", "winding temperature"] {
        assert!(kinds.contains(&kind), "no {kind} in {kinds:?}");
    }
    for lever in ["time", "ratio", "constant", "mass"] {
        assert!(levers.contains(&lever), "no {lever} in {levers:?}");
    }
}
