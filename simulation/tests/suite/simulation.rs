//! Simulations and analyses against closed forms and balances.

use crate::common::{arm, body, cart};
use straightline_core::algorithms::forward_kinematics;
use straightline_core::model::{Coulomb, Joint, JointEffects, JointKind, Limits, Model};
use straightline_core::spatial::Transform;
use straightline_simulation::analysis::analyze;
use straightline_simulation::cartesian::{joint_motion, NoPath};
use straightline_simulation::command::{Command, Compensation, Controller, Samples};
use straightline_simulation::motion::Motion;
use straightline_simulation::optimize::{minimise, Objective};
use straightline_simulation::plant::Plant;
use straightline_simulation::simulate::{simulate, Method, Run, Settings};

const SETTINGS: Settings = Settings {
    duration: 1.0,
    interval: 0.02,
    tolerance: 1e-11,
    method: Method::Adaptive,
    stops_at_limits: true,
    most_steps: 1_000_000,
};

fn run(model: Model<f64>, command: &Command, q: &[f64], settings: &Settings) -> Run {
    let plant = Plant::new(model, 1e-3);
    simulate(&plant, command, (q, &vec![0.0; q.len()]), settings, &|_| ()).expect("the simulation goes through")
}

#[test]
fn a_damped_spring_swings_as_the_closed_form_says() {
    let mut model = cart();
    let (m, d, k) = (2.0, 0.8, 50.0);
    model.bodies[0].effects = JointEffects { damping: d, stiffness: k, ..JointEffects::none() };
    for method in [Method::Adaptive, Method::Stiff] {
        let run = run(model.clone(), &Command::Free, &[0.3], &Settings { method, ..SETTINGS });
        let (decay, omega) = (d / (2.0 * m), (k / m - (d / (2.0 * m)).powi(2)).sqrt());
        for row in &run.table.rows {
            let t = row[0];
            let q = 0.3 * (-decay * t).exp() * ((omega * t).cos() + decay / omega * (omega * t).sin());
            // tolerance 1e-11 per step, a hundred steps; the implicit one of order 5 asks its own error for 1e-11 of scale
            assert!((row[1] - q).abs() < 2e-9, "{method:?} t = {t}: {} is not {q}", row[1]);
        }
        assert!((run.table.rows.len(), run.table.rows[50][0]) == (51, 1.0));
        assert!(run.balance.relative() < 1e-9, "{:?}", run.balance);
    }
}

#[test]
fn a_driven_arm_with_every_effect_keeps_its_books_over_ten_seconds() {
    let rows = (0..=20).map(|k| [0.0, 1.0, 2.0].map(|j| 8.0 * (0.7 * f64::from(k) + j).sin()).to_vec());
    let times = (0..=20).map(|k| 0.5 * f64::from(k)).collect();
    let command = Command::Torques(Samples { times, rows: rows.collect() });
    let settings = Settings { duration: 10.0, interval: 0.05, ..SETTINGS };
    let all = run(arm(), &command, &[0.1, -0.4, 0.7], &settings);
    assert!(all.balance.relative() < 1e-9, "{:?}", all.balance);
    assert!(all.balance.losses > 1.0 && all.balance.work.abs() > 1.0);
    // each effect by itself
    let without: [fn(&mut JointEffects<f64>); 3] = [
        |e| *e = JointEffects { damping: e.damping, ..JointEffects::none() },
        |e| *e = JointEffects { coulomb: e.coulomb, ..JointEffects::none() },
        |e| *e = JointEffects { stiffness: e.stiffness, spring_rest: e.spring_rest, ..JointEffects::none() },
    ];
    for only in without {
        let mut model = arm();
        model.bodies.iter_mut().for_each(|b| only(&mut b.effects));
        let one = run(model, &command, &[0.1, -0.4, 0.7], &Settings { duration: 2.0, ..settings });
        assert!(one.balance.relative() < 1e-9, "{:?}", one.balance);
    }
}

#[test]
fn stiff_joints_take_sensible_steps() {
    let mut model = arm();
    for body in &mut model.bodies {
        body.effects.stiffness = 1e6;
        body.effects.damping = 1e4;
    }
    let settings = Settings { method: Method::Stiff, tolerance: 1e-7, ..SETTINGS };
    let run = run(model, &Command::Free, &[0.2, 0.3, 0.1], &settings);
    assert!(run.steps < 1000, "{} steps", run.steps);
    assert!(run.q.iter().all(|q| (q - 0.2).abs() < 1e-3), "{:?}", run.q);
}

#[test]
fn a_joint_that_reaches_its_range_stops_the_run_at_that_instant() {
    let mut model = cart();
    model.bodies[0].joint.limits.upper = 0.5;
    let torques = Command::Torques(Samples { times: vec![0.0], rows: vec![vec![6.0]] });
    let stop = run(model.clone(), &torques, &[0.0], &SETTINGS).stop.expect("the slide is short");
    // ½ (F/m) t² = 0.5
    assert!((stop.time - (1.0f64 / 3.0).sqrt()).abs() < 1e-9, "{stop:?}");
    assert_eq!((stop.joint.as_str(), stop.limit), ("to_cart", 0.5));
    let free = run(model, &torques, &[0.0], &Settings { stops_at_limits: false, ..SETTINGS });
    assert!(free.stop.is_none() && (free.q[0] - 1.5).abs() < 1e-9);
}

#[test]
fn a_tumbling_base_keeps_energy_and_its_quaternion() {
    let mut model = arm();
    model.bodies.iter_mut().for_each(|b| b.effects = JointEffects::none());
    for body in &mut model.bodies {
        (body.joint.iq, body.joint.iv) = (body.joint.iq + 7, body.joint.iv + 6);
        body.parent = Some(body.parent.map_or(0, |p| p + 1));
    }
    let mut base = body("base", None, JointKind::Floating, 0, Transform::identity());
    base.joint = Joint { name: "root".into(), iq: 0, iv: 0, ..base.joint };
    model.bodies.insert(0, base);
    let mut q = vec![0.0; 10];
    (q[3], q[6], q[8]) = (0.6, 0.8, 0.7);
    let plant = Plant::new(model, 1e-3);
    let qd: Vec<f64> = (0..9).map(|i| f64::from(i).sin() + 0.3).collect();
    let run = simulate(&plant, &Command::Free, (&q, &qd), &SETTINGS, &|_| ()).expect("nothing is in the way");
    assert!(run.balance.relative() < 1e-9, "{:?}", run.balance);
    let length: f64 = run.q[3..7].iter().map(|x| x * x).sum();
    assert!((length - 1.0).abs() < 1e-14);
    // the whole falls: the base's own names, and free fall of the centre of mass is in the energy already
    assert!(run.table.names.contains(&"q.root.qw".to_string()) && run.table.names.contains(&"tau.to_fore".to_string()));
}

#[test]
fn computed_torque_with_the_right_model_leaves_the_error_of_a_linear_spring() {
    let mut model = arm();
    model.bodies.iter_mut().for_each(|b| b.effects.coulomb = Coulomb::Off);
    let motion = Motion::quintic(&[0.0, 1.0], &[vec![0.0, -0.5, 0.3], vec![1.0, 0.4, -0.6]]).unwrap();
    let controller = Controller {
        model: model.clone(),
        compensation: Compensation::ComputedTorque,
        motion,
        stiffness: vec![100.0; 3],
        damping: vec![20.0; 3],
        saturates: false,
        gives_currents: false,
        period: None,
        feedback: None,
        delay: 0,
    };
    // critically damped from an error of 0.1: e = 0.1 (1 + 10 t) exp(−10 t)
    let run = run(model, &Command::Controller(Box::new(controller)), &[-0.1, -0.6, 0.2], &SETTINGS);
    for (row, name) in run.table.rows.iter().flat_map(|r| ["error.to_column", "error.to_fore"].map(|n| (r, n))) {
        let column = run.table.names.iter().position(|n| n == name).expect("errors are among the results");
        let t = row[0];
        let expected = 0.1 * (1.0 + 10.0 * t) * (-10.0 * t).exp();
        // the method interpolates between steps with order 7
        assert!((row[column] - expected).abs() < 1e-8, "{name} t = {t}: {} is not {expected}", row[column]);
    }
}

#[test]
fn drives_give_what_becomes_energy_and_heat() {
    let model = arm();
    let motion = Motion::quintic(&[0.0, 0.6, 1.5], &[vec![0.0, -0.5, 0.3], vec![1.0, 0.4, -0.6], vec![0.2, 0.9, 0.1]]);
    let motion = motion.unwrap();
    let found = analyze(&model, &motion, 1e-3).expect("it can be analysed");
    let plant = Plant::new(model, 1e-3);
    let times: Vec<f64> = found.table.rows.iter().map(|r| r[0]).collect();
    let loss = |t: f64| plant.losses(&motion.at(t).0, &motion.at(t).1);
    let losses: f64 = times.windows(2).map(|t| 0.5 * (t[1] - t[0]) * (loss(t[0]) + loss(t[1]))).sum();
    let given: f64 = found.joints.iter().map(|j| j.given - j.taken).sum();
    // trapezoidal rule: h² / 12 of the change of the power's slope
    assert!((given - found.energy_change - losses).abs() < 1e-4, "{given} {} {losses}", found.energy_change);
    assert!(found.violations.is_empty());
}

#[test]
fn the_first_violation_is_found_where_it_is() {
    let mut model = cart();
    model.bodies[0].joint.limits = Limits { lower: -1.0, upper: 0.9, velocity: 1.2, effort: 7.5 };
    // a = 4 m/s² up to 2 m/s, and back to rest: F = 8 N from the beginning on
    let motion = Motion::trapezoidal(&[vec![0.0], vec![2.0]], &[2.0], &[4.0]).unwrap();
    let found = analyze(&model, &motion, 0.013).expect("it can be analysed");
    let of = |what: &str| found.violations.iter().find(|v| v.what == what).unwrap_or_else(|| panic!("no {what}"));
    assert!((of("effort").time, of("effort").limit, of("effort").worst) == (0.0, 7.5, 8.0));
    assert!((of("speed").time - 0.3).abs() < 1e-9 && of("speed").worst == 2.0);
    // 0.5 m at 0.5 s, then 2 m/s
    assert!((of("position").time - 0.7).abs() < 1e-9);
    assert_eq!(found.violations[0].what, "effort");
    let cart = &found.joints[0];
    assert!((cart.peak.0, cart.unit, cart.power) == (8.0, "N", 16.0));
    // ½ m v² given, and taken back
    assert!((cart.given - 4.0).abs() < 1e-2 && (cart.taken - 4.0).abs() < 1e-2, "{cart:?}");
}

#[test]
fn joints_lead_a_frame_along_its_path() {
    let model = arm();
    let tip = model.frame("tip").unwrap();
    let start = [0.2, -0.4, 0.9];
    let p = forward_kinematics(&model, &start, &[tip])[0].translation.to_array();
    let to = vec![p[0] - 0.1, p[1] + 0.15, p[2] + 0.05];
    let path = Motion::quintic(&[0.0, 1.0], &[p.to_vec(), to.clone()]).unwrap();
    let motion = joint_motion(&model, tip, &path, &start, false, 0.01).unwrap();
    for k in 0..=97 {
        let t = f64::from(k) / 97.0;
        let (q, ..) = motion.at(t);
        let found = forward_kinematics(&model, &q, &[tip])[0].translation.to_array();
        for (found, wanted) in found.iter().zip(path.at(t).0) {
            // splines between samples 0.01 s apart: h⁴ of a smooth motion
            assert!((found - wanted).abs() < 1e-6, "t = {t}: {found} {wanted}");
        }
    }
    let far = Motion::quintic(&[0.0, 1.0], &[p.to_vec(), vec![3.0, 0.0, 0.0]]).unwrap();
    assert!(matches!(joint_motion(&model, tip, &far, &start, false, 0.01), Err(NoPath::OutOfReach { .. })));
}

#[test]
fn the_best_spring_is_the_one_that_swings_by_itself() {
    // q = 0.3 sin(5 t): F = (k − m ω²) q, and none with k = m ω² = 50 N/m, the spring at rest at zero
    let knots: Vec<_> = (0..=200)
        .map(|i| {
            let (s, c) = (5.0 * 0.01 * f64::from(i)).sin_cos();
            (vec![0.3 * s], vec![1.5 * c], vec![-7.5 * s])
        })
        .collect();
    let times: Vec<f64> = (0..=200).map(|i| 0.01 * f64::from(i)).collect();
    let motion = Motion::sampled(&times, &knots).unwrap();
    let cost = |objective: Objective, x: &[f64], limit: f64| {
        let mut model = cart();
        model.bodies[0].effects = JointEffects { stiffness: x[0], spring_rest: x[1], ..JointEffects::none() };
        model.bodies[0].joint.limits.effort = limit;
        objective.with_limits(&analyze(&model, &motion, 0.01).expect("it can be analysed"), &[limit])
    };
    let ranges = [(0.0, 200.0), (-0.5, 0.7)];
    for objective in [Objective::Rms, Objective::Peak, Objective::Energy] {
        let best = minimise(|x| cost(objective, x, f64::INFINITY), &ranges).unwrap();
        assert!((best.point[0] - 50.0).abs() < 0.1 && best.point[1].abs() < 1e-3, "{objective:?}: {best:?}");
    }
    // at the end of a range, and with a limit that costs more than any gain
    let best = minimise(|x| cost(Objective::Rms, &[x[0], 0.0], f64::INFINITY), &[(80.0, 200.0)]).unwrap();
    assert!((best.point[0] - 80.0).abs() < 1e-6, "{best:?}");
    assert!(cost(Objective::Rms, &[0.0, 0.0], 1.0) > 1e3);
}

#[test]
fn the_books_of_an_analysis_are_open_by_the_error_of_its_integrals_alone() {
    let points = [vec![0.0, -0.5, 0.3], vec![1.0, 0.4, -0.6], vec![0.2, 0.1, 0.9]];
    for motion in [
        Motion::quintic(&[0.0, 0.7, 1.5], &points).expect("a motion"),
        Motion::trapezoidal(&points, &[2.0; 3], &[9.0; 3]).expect("a motion"),
    ] {
        let mut rough = arm();
        rough.bodies.iter_mut().for_each(|b| b.effects.coulomb = Coulomb::Off);
        let mut smooth = rough.clone();
        smooth.bodies.iter_mut().for_each(|b| b.effects.damping = 0.0);
        for (model, has_friction) in [(rough, true), (smooth, false)] {
            let open = |interval: f64| analyze(&model, &motion, interval).expect("it can be analysed").missing();
            let found = analyze(&model, &motion, 0.005).expect("it can be analysed");
            assert_eq!(found.friction > 0.1, has_friction, "{}", found.friction);
            assert_eq!(found.friction != 0.0, has_friction);
            let turned: f64 = found.joints.iter().map(|j| j.given + j.taken).sum();
            // Simpson's rule: order 4, where the trapezoidal rule left 1e-5 of it
            assert!(found.missing().abs() < 1e-7 * turned, "{:e} of {turned}", found.missing());
            assert!(open(0.04).abs() > 8.0 * open(0.02).abs(), "{:e} {:e}", open(0.04), open(0.02));
        }
    }
}

#[test]
fn an_analysis_that_cannot_be_is_refused() {
    let model = arm();
    let of = |points: &[Vec<f64>], times: &[f64], interval: f64| {
        let motion = Motion::quintic(times, points).expect("a motion");
        analyze(&model, &motion, interval).err().map(|failure| failure.to_string())
    };
    let points = [vec![0.0; 3], vec![0.5; 3]];
    let long = of(&points, &[0.0, 1e59], 0.005).expect("there is no room");
    assert!(long.contains("rows"), "{long}");
    let far = of(&[vec![0.0; 3], vec![0.0, 1e9, 0.0]], &[0.0, 1.0], 0.01).expect("no sine answers");
    assert!(far.contains("to_upper") && far.contains("sine"), "{far}");
    // torques of 1e320
    let fast = of(&[vec![0.0; 3], vec![1.0; 3]], &[0.0, 1e-30], 0.01);
    assert!(fast.is_none_or(|why| why.contains("finite")));
    let mut heavy = arm();
    heavy.bodies[2].inertia.mass = 1e308;
    let motion = Motion::quintic(&[0.0, 1.0], &[vec![0.0; 3], vec![90.0; 3]]).expect("a motion");
    let why = analyze(&heavy, &motion, 0.01).expect_err("torques are beyond all numbers").to_string();
    assert!(why.contains("tau.") && why.contains("finite"), "{why}");
    assert_eq!(of(&points, &[0.0, 1.0], 0.005), None);
}
