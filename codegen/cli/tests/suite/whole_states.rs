//! Logs of robots whose states are more than a number per joint: joints that follow others, balls, bases that float, closed loops.

use crate::logged::{self, aligned, csv, logged, straightline, Normal};
use std::fs;
use straightline_cli::base_motion::{add_base, unlogged_base};
use straightline_cli::identification::{identified, together, LinkMap, RegressorModel};
use straightline_cli::log_states::{log_demand, with_whole_states};
use straightline_cli::residual::torques::TorqueModel;
use straightline_cli::residual::{explain, residual_torques};
use straightline_codegen::convert::renumber::renumbered;
use straightline_codegen::description;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::model::ModelOptions;
use straightline_codegen::options::Options;
use straightline_core::base_parameters::JointParameter;
use straightline_core::model::{Coulomb, Frame, Model};
use straightline_core::spatial::{Mat3, Transform, Vec3};
use straightline_logs::align::align;
use straightline_logs::log::from_columns;
use straightline_logs::mcap::{self, LoggedFrames, LoggedPose};
use straightline_view::{frame_poses, ViewedPose};

const REPOSITORY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Robots of every kind, and whether their bases float by an option.
const ROBOTS: [(&str, bool); 8] = [
    ("generated_tests/reference/joints/robots/mimic_gripper.urdf", false),
    ("generated_tests/reference/joints/robots/mimic_chain.urdf", false),
    ("generated_tests/reference/joints/robots/mimic_float.urdf", true),
    ("generated_tests/reference/joints/robots/ball_chain.xml", false),
    ("generated_tests/reference/joints/robots/ball_float.xml", false),
    ("generated_tests/reference/joints/robots/loop_fourbar.xml", false),
    ("generated_tests/reference/joints/robots/loop_leg.xml", false),
    ("robots/descriptions/solo12.urdf", true),
];

fn source_of(file: &str) -> Source {
    let path = format!("{REPOSITORY}/{file}");
    Source::new(&path, fs::read_to_string(&path).expect("the robot file"))
}

fn options(floating_base: bool) -> Options {
    Options { model: ModelOptions { floating_base, ..ModelOptions::default() }, ..Options::default() }
}

fn times(seconds: f64, rate: f64) -> Vec<f64> {
    (0..(seconds * rate) as usize).map(|i| i as f64 / rate).collect()
}

fn torque_model((file, floats): (&str, bool)) -> TorqueModel {
    TorqueModel::load(&source_of(file), &options(floats)).expect("the robot can be loaded")
}

fn without(columns: &[(String, Vec<f64>)], prefixes: &[&str]) -> Vec<(String, Vec<f64>)> {
    columns.iter().filter(|(name, _)| !prefixes.iter().any(|prefix| name.starts_with(prefix))).cloned().collect()
}

fn greatest(column: &[f64]) -> f64 {
    column.iter().fold(0.0, |most: f64, x| most.max(x.abs()))
}

#[test]
fn nothing_is_left_of_exact_logs_of_all_kinds_of_robots() {
    for robot in ROBOTS {
        let model = torque_model(robot);
        let columns = logged(&model.model, &times(2.0, 500.0));
        let log = aligned(columns.clone(), &model.model);
        assert_eq!((log.q.len(), log.qd.len()), (model.model.nq(), model.model.nv()), "{robot:?}");
        let found = residual_torques(&model, &log, 10.0);
        for (rate, left) in found.rates.iter().zip(&found.direct) {
            assert!(greatest(left) < 1e-9, "{robot:?}: {}: {}", rate.effort, greatest(left));
        }
        // without accelerations, and far from ends: the slope of momentum by polynomials
        let log = aligned(without(&columns, &["qdd."]), &model.model);
        let found = residual_torques(&model, &log, 10.0);
        for (j, rate) in found.rates.iter().enumerate() {
            let (size, inside) = (1.0 + greatest(&log.tau[j]), 200..800);
            for left in [&found.direct[j][inside.clone()], &found.observed[j][inside]] {
                assert!(greatest(left) < 1e-5 * size, "{robot:?}: {}: {} of {size}", rate.effort, greatest(left));
            }
        }
    }
}

/// Quaternions that are not of length one and jump to their opposites, a base of which only orientation and velocity are known, or only poses.
#[test]
fn states_are_made_whole() {
    let model = torque_model(("generated_tests/reference/joints/robots/ball_float.xml", false));
    let columns = logged(&model.model, &times(1.0, 500.0));
    let exact = aligned(columns.clone(), &model.model);
    let base = &model.model.joints()[0].name.clone();
    let mut turned = columns.clone();
    for (name, column) in turned.iter_mut().filter(|(name, _)| name.contains(".q") && !name.starts_with("qd")) {
        column.iter_mut().enumerate().for_each(|(i, x)| *x *= if i.is_multiple_of(3) { -1.5 } else { 0.5 });
        assert!(name.starts_with("q."), "{name}");
    }
    let found = aligned(turned, &model.model);
    for (column, wanted) in found.q.iter().zip(&exact.q) {
        let off = |sign: f64| column.iter().zip(wanted).map(|(x, y)| (sign * x - y).abs()).fold(0.0, f64::max);
        assert!(off(1.0).min(off(-1.0)) < 1e-15);
        assert!(column.windows(2).all(|pair| (pair[0] - pair[1]).abs() < 0.05), "it jumps");
    }
    // forces do not depend on where the base is
    let place = ["x", "y", "z"].map(|axis| format!("q.{base}.{axis}"));
    let nowhere = without(&columns, &place.each_ref().map(String::as_str));
    let log = aligned(nowhere.clone(), &model.model);
    assert_eq!(log.report.without_position, place.each_ref().map(|name| name[2..].to_string()));
    let found = residual_torques(&model, &log, 10.0);
    assert!(found.direct.iter().all(|left| greatest(left) < 1e-9));
    // velocities by differences of poses, of second order
    let log = aligned(without(&columns, &["qd.", "qdd."]), &model.model);
    for (found, wanted) in log.qd.iter().zip(&exact.qd) {
        let inside = found.iter().zip(wanted).skip(1).take(498);
        assert!(inside.map(|(x, y)| (x - y).abs()).fold(0.0, f64::max) < 1e-3);
    }
    let path = logged::scratch("whole_states", "nowhere.csv").display().to_string();
    fs::write(&path, csv(&without(&nowhere, &["qd.", "qdd."]))).expect("written");
    let robot = format!("{REPOSITORY}/generated_tests/reference/joints/robots/ball_float.xml");
    let output = straightline(&["residuals", &robot, &path]);
    let said = String::from_utf8(output.stderr).expect("text");
    assert!(
        output.status.code() == Some(1) && said.contains("neither the velocity of") && said.contains(".vx"),
        "{said}"
    );
}

/// The base's motion in messages of their own, of a frame that the base carries.
#[test]
fn a_base_is_found_in_messages_of_poses() {
    let mut model = torque_model(("robots/descriptions/solo12.urdf", true)).model;
    let base = model.joints()[0].clone();
    let placement = Transform {
        rotation: Mat3 { rows: [[0.0, -1.0, 0.0], [0.6, 0.0, 0.8], [-0.8, 0.0, 0.6]] },
        translation: Vec3::from([0.1, -0.2, 0.3]),
    };
    let base_link = model.frames.iter().find(|frame| frame.body == Some(0)).expect("a link").name.clone();
    model.frames.push(Frame { name: "imu".to_string(), body: Some(0), placement });
    let columns = logged(&model, &times(0.4, 500.0));
    let exact = aligned(columns.clone(), &model);
    let pose = |i: usize, with_twist: bool| {
        let q: Vec<f64> = exact.q[..7].iter().map(|column| column[i]).collect();
        let ViewedPose { position, turn } = ViewedPose::from(&base.kind.motion(&q).compose(&placement));
        let [v, w] = [0, 3].map(|first| Vec3::from([0, 1, 2].map(|k| exact.qd[first + k][i])));
        let along = placement.rotation.transpose_mul(v + w.cross(placement.translation)).to_array();
        let turning = placement.rotation.transpose_mul(w).to_array();
        let twist = std::array::from_fn(|k| if k < 3 { along[k] } else { turning[k - 3] });
        LoggedPose {
            topic: if with_twist { "/odom" } else { "/tf" }.to_string(),
            stamp: (exact.times[i] * 1e9).round() as i64,
            parent: "odom".to_string(),
            child: "imu".to_string(),
            translation: position,
            rotation: if i.is_multiple_of(2) { turn } else { turn.map(|x| -x) },
            twist: with_twist.then_some(twist),
        }
    };
    let prefixes =
        [format!("q.{}.", base.name), format!("qd.{}.", base.name), "qdd.".to_string(), format!("tau.{}.", base.name)];
    let joints_alone = from_columns(without(&columns, &prefixes.each_ref().map(String::as_str))).expect("a log");
    assert_eq!(unlogged_base(&model, &joints_alone), Some(&base));
    // every third message is lost, and those of a tenth of a second
    let kept = |i: &usize| i % 3 != 1 && !(80..130).contains(i);
    for with_twist in [true, false] {
        let mut log = joints_alone.clone();
        let of_odometry = (0..200).filter(kept).map(|i| pose(i, true)).filter(|_| with_twist);
        // frames have other links of the base, too, some of them in the base
        let within = |i: usize| LoggedPose { parent: base_link.clone(), child: "imu".to_string(), ..pose(i, false) };
        let frames = (0..200).filter(kept).flat_map(|i| [pose(i, false), within(i)]);
        let poses: Vec<LoggedPose> = frames.chain(of_odometry).collect();
        assert!(add_base(&mut log, &base, &model, &poses).expect("one topic has it"), "the base is there");
        assert_eq!(unlogged_base(&model, &log), None);
        let found = align(&log, &log_demand(&model)).expect("a log");
        let found = with_whole_states(&model, found).expect("states are whole");
        assert!((51..=54).contains(&found.report.incomplete) && found.segments.len() == 2, "{:?}", found.report);
        for (i, t) in found.times.iter().enumerate() {
            let row = exact.times.iter().position(|time| (time - t).abs() < 1e-9).expect("a row of the log");
            // straight lines between messages 4 ms apart
            let bound = if kept(&row) { 1e-12 } else { 1e-4 };
            for (found, wanted) in found.q[..7].iter().zip(&exact.q) {
                let off = (found[i] - wanted[row]).abs().min((found[i] + wanted[row]).abs());
                assert!(off < bound, "row {row}: {off}");
            }
            let bound = if with_twist { bound } else { 1.0 };
            for (found, wanted) in found.qd[..6].iter().zip(&exact.qd) {
                assert!((found[i] - wanted[row]).abs() < bound, "row {row}: {} {}", found[i], wanted[row]);
            }
        }
    }
    let mut log = joints_alone.clone();
    assert!(!add_base(&mut log, &base, &model, &[]).expect("nothing is wrong"), "nothing says it");
    let other = LoggedPose { topic: "/other".to_string(), ..pose(0, true) };
    let error = add_base(&mut log, &base, &model, &[pose(0, true), other]).expect_err("two say it");
    assert!(error.what.contains("/odom (in odom), /other (in odom)"), "{error}");
}

/// What pushes a base need not be measured: then it is what is left, and says nothing of payloads.
#[test]
fn what_pushes_a_base_is_left_where_it_is_not_measured() {
    let robot = ("robots/descriptions/solo12.urdf", true);
    let model = torque_model(robot);
    let columns = logged(&model.model, &times(2.0, 500.0));
    let base = model.model.joints()[0].name.clone();
    let log = aligned(without(&columns, &[&format!("tau.{base}.")]), &model.model);
    assert_eq!(log.is_measured[..7], [false, false, false, false, false, false, true]);
    let (found, exact) = (residual_torques(&model, &log, 10.0), aligned(columns.clone(), &model.model));
    for (left, wrench) in found.direct.iter().zip(&exact.tau).take(6) {
        assert!(left.iter().zip(wrench).all(|(left, wrench)| (left + wrench).abs() < 1e-9));
    }
    let explained = explain(&log, &found, None);
    assert!(explained.joints[..6].iter().all(|figure| figure.fitted.is_none() && figure.episodes.is_empty()));
    assert!(explained.joints[6..].iter().all(|figure| figure.fitted.is_some() && figure.rms[0] < 1e-9));
    let path = logged::scratch("whole_states", "solo.csv").display().to_string();
    fs::write(&path, csv(&without(&columns, &[&format!("tau.{base}.")]))).expect("written");
    let file = format!("{REPOSITORY}/{}", robot.0);
    let output = straightline(&["residuals", &file, &path, "--floating-base"]);
    let said = String::from_utf8(output.stdout).expect("text");
    assert!(output.status.success() && said.contains("does not say what pushes the base"), "{said}");
    let output = straightline(&["identify", &file, &path, "--floating-base"]);
    let said = String::from_utf8(output.stderr).expect("text");
    let wanted = ["does not say what pushes the base", &format!("tau.{base}.fx"), "0 where nothing does"];
    assert!(output.status.code() == Some(1) && wanted.iter().all(|part| said.contains(part)), "{said}");
}

/// Messages of joints with the base's coordinates among them, with the base in frames alone, and without it.
#[test]
fn commands_take_a_base_from_messages() {
    let robot = ("robots/descriptions/solo12.urdf", true);
    let model = torque_model(robot);
    let columns = logged(&model.model, &times(1.0, 500.0));
    let (base, exact) = (model.model.joints()[0].name.clone(), aligned(columns.clone(), &model.model));
    let file = format!("{REPOSITORY}/{}", robot.0);
    let log = logged::scratch("whole_states", "solo.mcap").display().to_string();
    let bytes = mcap::bytes(&from_columns(columns.clone()).expect("a log"), mcap::TOPIC).expect("it can be written");
    fs::write(&log, bytes).expect("written");
    let page = logged::scratch("whole_states", "solo.html").display().to_string();
    for arguments in
        [&["view", &file, &log, "-o", &page, "--floating-base"][..], &["residuals", &file, &log, "--floating-base"]]
    {
        let output = straightline(arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    // and with the base in frames alone, or nowhere
    let prefixes = [format!("q.{base}."), format!("qd.{base}."), "qdd.".to_string(), format!("tau.{base}.")];
    let joints_alone = from_columns(without(&columns, &prefixes.each_ref().map(String::as_str))).expect("a log");
    let pose = |i: usize| {
        let q: Vec<f64> = exact.q.iter().map(|column| column[i]).collect();
        frame_poses(&model.model, &q).iter().map(|pose| (pose.position, pose.turn)).collect()
    };
    let frames = LoggedFrames {
        parent: "odom".to_string(),
        children: model.model.frames.iter().map(|frame| frame.name.clone()).collect(),
        poses: (0..joints_alone.times.len()).map(pose).collect(),
    };
    fs::write(&log, mcap::bytes_with(&joints_alone, mcap::TOPIC, &frames).expect("it can be written"))
        .expect("written");
    for arguments in
        [&["view", &file, &log, "-o", &page, "--floating-base"][..], &["residuals", &file, &log, "--floating-base"]]
    {
        let output = straightline(arguments);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    assert!(!fs::read_to_string(&page).expect("a page").contains("says nothing of the base"));
    fs::write(&log, mcap::bytes(&joints_alone, mcap::TOPIC).expect("it can be written")).expect("written");
    let output = straightline(&["residuals", &file, &log, "--floating-base"]);
    let said = String::from_utf8(output.stderr).expect("text");
    assert!(output.status.code() == Some(1) && said.contains("nav_msgs/msg/Odometry"), "{said}");
}

#[test]
fn regressors_of_all_kinds_of_robots_give_their_forces() {
    for (file, floats) in ROBOTS.into_iter().filter(|(file, _)| !file.contains("loop")) {
        let source = source_of(file);
        let robot = RegressorModel::load(&source, &options(floats)).expect("the robot can be loaded");
        assert_eq!(robot.refusal(), None);
        let description = description::read(&source, &mut Diagnostics::new()).expect("a robot");
        let map = LinkMap::of(&robot, &description);
        for ((rest, name), value) in map.rest.iter().zip(&robot.names).zip(&robot.nominal) {
            assert!(rest.abs() < 1e-12 * (1.0 + value.abs()), "{file}: {name}: {rest}");
        }
        let columns = logged(&robot.model, &times(1.0, 500.0));
        let zero = vec![0.0; robot.nominal.len()];
        for (prefix, bound) in [("nothing", 1e-12), ("qdd.", 1e-5)] {
            let log = aligned(without(&columns, &[prefix]), &robot.model);
            let data = together(&robot.equations(&[log], 10.0));
            for (left, all) in data.rms(&robot.nominal).iter().zip(data.rms(&zero)) {
                assert!(*left < bound * (1.0 + all), "{file}: {left} of {all} without {prefix}");
            }
        }
    }
}

/// The robot with other masses, and friction in all joints of one coordinate, those that follow others among them.
fn in_truth(model: &Model<f64>) -> Model<f64> {
    let mut truth = model.clone();
    for (k, body) in truth.bodies.iter_mut().enumerate() {
        let more = 1.0 + 0.05 * ((3 * k) % 7) as f64;
        let mut load = body.total_about_origin();
        load.mass *= more - 1.0;
        load.first_moment = load.first_moment.scale(more - 1.0);
        load.second_moment = load.second_moment.map(|x| x * (more - 1.0));
        body.carry(load);
        if body.joint.kind.is_single() {
            body.effects.damping = 0.3 + 0.02 * k as f64;
            body.effects.coulomb = Coulomb::Sign(0.2 + 0.01 * k as f64);
        }
    }
    truth
}

/// Fitted to one noisy log, what is written predicts another motion; friction of a joint and of those that follow it is shared out.
#[test]
fn robots_with_followers_balls_and_bases_are_identified() {
    for (file, floats) in [ROBOTS[0], ROBOTS[1], ROBOTS[2], ROBOTS[4]] {
        let source = source_of(file);
        let robot = RegressorModel::load(&source, &options(floats)).expect("the robot can be loaded");
        let description = description::read(&source, &mut Diagnostics::new()).expect("a robot");
        let (map, truth) = (LinkMap::of(&robot, &description), in_truth(&robot.model));
        let mut noise = Normal(3);
        let mut log = logged(&truth, &times(20.0, 250.0));
        log.iter_mut().filter(|(name, _)| name.starts_with("tau.")).for_each(|(_, column)| {
            column.iter_mut().for_each(|x| *x += 0.01 * noise.next());
        });
        let data = together(&robot.equations(&[aligned(log, &robot.model)], 5.0));
        let found = identified(&robot, &map, &data).expect("links can be");
        let other: Vec<f64> = times(5.0, 250.0).iter().map(|t| 40.0 + t).collect();
        let check = together(&robot.equations(&[aligned(logged(&truth, &other), &robot.model)], 5.0));
        for (j, (written, by_file)) in check.rms(&found.written).iter().zip(check.rms(&robot.nominal)).enumerate() {
            assert!(
                *written < 0.1 * by_file + 5e-3,
                "{file}: {}: {written}, {by_file} by the file",
                robot.rates[j].effort
            );
        }
        // the sum over a joint and its followers, in the coordinate of the first
        for (joint, wanted) in friction_by_rate(&truth) {
            let of = |kind: JointParameter| -> f64 {
                let own = map.joints.iter().zip(&found.joints).filter(|(own, _)| own.row == joint && own.kind == kind);
                own.map(|(own, x)| x * share(&truth, &own.name, kind)).sum()
            };
            let found = [of(JointParameter::Damping), of(JointParameter::Coulomb)];
            for (found, wanted) in found.iter().zip(wanted) {
                assert!((found / wanted - 1.0).abs() < 0.05, "{file}: rate {joint}: {found}, {wanted}");
            }
        }
        let mut said = Diagnostics::new();
        let text = renumbered(&source, &found.numbers(&map), &mut said).unwrap_or_else(|| panic!("{file}: {said}"));
        let again = RegressorModel::load(&Source::new(file, text), &options(floats)).expect("it can be read");
        for ((left, wanted), by_file) in
            check.rms(&again.nominal).iter().zip(check.rms(&found.written)).zip(check.rms(&robot.nominal))
        {
            assert!((left - wanted).abs() < 1e-3 * by_file, "{file}: {left} {wanted}");
        }
    }
}

/// By how much friction of a joint counts in the coordinate which it moves by.
fn share(model: &Model<f64>, joint: &str, kind: JointParameter) -> f64 {
    let coupling = model.couplings.iter().find(|c| model.bodies[c.body].joint.name == joint);
    match (coupling, kind) {
        (None, _) => 1.0,
        (Some(coupling), JointParameter::Damping) => coupling.ratio * coupling.ratio,
        (Some(coupling), _) => coupling.ratio.abs(),
    }
}

fn friction_by_rate(model: &Model<f64>) -> Vec<(usize, [f64; 2])> {
    let singles = || model.bodies.iter().enumerate().filter(|(_, body)| body.joint.kind.is_single());
    let row = |b: usize| model.bodies[model.coupling_of(b).map_or(b, |c| c.source)].joint.iv;
    let of = |rate: usize| {
        singles().filter(|(b, _)| row(*b) == rate).fold([0.0; 2], |[viscous, coulomb], (_, body)| {
            let Coulomb::Sign(force) = body.effects.coulomb else { panic!("all have friction") };
            let [d, f] = [JointParameter::Damping, JointParameter::Coulomb].map(|k| share(model, &body.joint.name, k));
            [viscous + d * body.effects.damping, coulomb + f * force]
        })
    };
    let mut rates: Vec<usize> = singles().map(|(b, _)| row(b)).collect();
    rates.sort_unstable();
    rates.dedup();
    rates.into_iter().map(|rate| (rate, of(rate))).collect()
}
