//! The command `identify`: equations are exact, intervals hold, what is written can be and is the robot, and what logs cannot tell stays.

use crate::logged::{self, aligned, csv, logged, motion, straightline, Normal};
use std::fs;
use std::path::PathBuf;
use straightline_cli::identification::{
    designed, identified, lags, rounded, together, DesignDemand, LinkMap, RegressorModel,
};
use straightline_codegen::convert::renumber::{renumbered, NewEffects, NewInertial, NewNumbers};
use straightline_codegen::description::{self, Description};
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::options::Options;
use straightline_core::base_parameters::JointParameter;
use straightline_core::model::Model;
use straightline_graph::Scalar;
use straightline_logs::consistent::is_body;

const ROBOTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/descriptions");

fn scratch(name: &str) -> PathBuf {
    logged::scratch("identify", name)
}

fn source_of(robot: &str) -> Source {
    let path = format!("{ROBOTS}/{robot}");
    Source::new(&path, fs::read_to_string(&path).expect("the robot file"))
}

fn description_of(source: &Source) -> Description {
    description::read(source, &mut Diagnostics::new()).expect("a robot")
}

fn loaded(source: &Source) -> (RegressorModel, LinkMap) {
    let robot = RegressorModel::load(source, &Options::default()).expect("the robot can be loaded");
    let map = LinkMap::of(&robot, &description_of(source));
    (robot, map)
}

/// The robot as it is in truth: links heavier or lighter by up to 15 %, their centres of mass elsewhere by up to 5 mm, with friction in all joints.
fn in_truth(source: &Source, friction: impl Fn(usize) -> [f64; 2]) -> (Source, Model<f64>) {
    let robot = description_of(source);
    let mut random = Normal(77);
    let mut next = || 0.5 * random.next().clamp(-2.0, 2.0);
    let links = robot.links.iter().filter_map(|link| Some((link, link.inertial.as_ref()?)));
    let links = links
        .map(|(link, was)| {
            let scale = 1.0 + 0.15 * next();
            NewInertial {
                link: link.name.value.clone(),
                mass: rounded(was.mass.value * scale),
                com: was.com.value.map(|x| rounded(x + 5e-3 * next())),
                inertia: was.inertia.value.rotated(&was.turn()).map(|x| x * scale),
            }
        })
        .collect();
    let moving = robot.joints.iter().filter(|joint| joint.kind.value.kind.is_some()).enumerate();
    let joints = moving
        .map(|(k, joint)| {
            let [viscous, coulomb] = friction(k);
            NewEffects {
                joint: joint.name.value.clone(),
                damping: Some(viscous),
                friction: Some(coulomb),
                rotor_inertia: None,
            }
        })
        .collect();
    let mut said = Diagnostics::new();
    let text = renumbered(source, &NewNumbers { links, joints }, &mut said).unwrap_or_else(|| panic!("{said}"));
    let truth = Source::new("truth", text);
    let (model, said) = load(&truth, &ModelOptions::default());
    (truth, model.unwrap_or_else(|| panic!("{said}")).cast())
}

fn times(seconds: f64, rate: f64, from: f64) -> Vec<f64> {
    (0..(seconds * rate) as usize).map(|i| from + i as f64 / rate).collect()
}

/// Noise on torques \[N·m\] and velocities \[rad/s\], encoders of 1e-5 rad; without accelerations.
fn as_measured(columns: &mut Vec<(String, Vec<f64>)>, noise: &mut Normal, [tau, qd]: [f64; 2]) {
    columns.retain(|(name, _)| !name.starts_with("qdd."));
    for (name, column) in columns.iter_mut() {
        match name.split_once('.').map(|(kind, _)| kind) {
            Some("q") => column.iter_mut().for_each(|x| *x = (*x / 1e-5).round() * 1e-5),
            Some("qd") => column.iter_mut().for_each(|x| *x += qd * noise.next()),
            Some("tau") => column.iter_mut().for_each(|x| *x += tau * noise.next()),
            _ => {}
        }
    }
}

#[test]
fn base_parameters_are_made_of_links_alone() {
    for robot in ["panda.urdf", "ur5.urdf", "planar2r.urdf", "planar_2r.toml"] {
        let source = source_of(robot);
        let (robot, map) = loaded(&source);
        assert_eq!(robot.refusal(), None);
        for ((rest, name), value) in map.rest.iter().zip(&robot.names).zip(&robot.nominal) {
            assert!(rest.abs() < 1e-13 * (1.0 + value.abs()), "{}: {name}: {rest}", source.path());
        }
    }
}

/// What else is generated of the robot does not count.
#[test]
fn a_scene_in_single_precision_is_identified_in_double() {
    let source = source_of("planar_2r.toml");
    let options = Options { scalar: Scalar::F32, ..Options::default() };
    let (single, double) =
        (RegressorModel::load(&source, &options), RegressorModel::load(&source, &Options::default()));
    let (single, double) = (single.expect("the robot can be loaded"), double.expect("the robot can be loaded"));
    let log = aligned(logged(&double.exact.cast(), &times(0.2, 500.0, 0.0)), &double.model);
    assert_eq!(single.equations(std::slice::from_ref(&log), 10.0), double.equations(&[log], 10.0));
}

#[test]
fn regressor_times_parameters_is_the_torque() {
    for file in ["panda.urdf", "ur5.urdf", "puma560.urdf", "planar_2r.toml"] {
        let source = source_of(file);
        let (robot, _) = loaded(&source);
        let model = robot.exact.cast::<f64>();
        let columns = logged(&model, &times(1.0, 500.0, 0.0));
        let log = aligned(columns.clone(), &robot.model);
        let data = together(&robot.equations(&[log], 10.0));
        let zero = vec![0.0; robot.nominal.len()];
        assert_eq!(data.instants(), 500);
        for (left, all) in data.rms(&robot.nominal).iter().zip(data.rms(&zero)) {
            assert!(*left < 1e-13 * (1.0 + all), "{file}: {left} of {all}");
        }
        // without accelerations the equations are as exact as a quartic's slope between samples
        let without = columns.into_iter().filter(|(name, _)| !name.starts_with("qdd.")).collect();
        let log = aligned(without, &robot.model);
        let data = together(&robot.equations(&[log], 10.0));
        for (left, all) in data.rms(&robot.nominal).iter().zip(data.rms(&zero)) {
            assert!(*left < 1e-6 * (1e-2 + all), "{file}: {left} of {all} without accelerations");
        }
    }
}

#[test]
fn numbers_of_a_noisy_panda_are_found_with_their_intervals() {
    let source = source_of("panda.urdf");
    let (robot, map) = loaded(&source);
    let (truth_source, truth) = in_truth(&source, |k| [1.0 - 0.1 * k as f64, 0.8 - 0.08 * k as f64]);
    let mut noise = Normal(3);
    let mut columns = logged(&truth, &times(60.0, 500.0, 0.0));
    as_measured(&mut columns, &mut noise, [0.1, 2e-3]);
    let data = together(&robot.equations(&[aligned(columns, &robot.model)], 5.0));
    let found = identified(&robot, &map, &data).expect("links can be");

    let (true_robot, _) = loaded(&truth_source);
    assert_eq!(true_robot.names, robot.names);
    let fitted = &found.fit.fitted;
    let told: Vec<usize> = (0..robot.names.len()).filter(|k| fitted.errors[*k].is_finite()).collect();
    let off = |k: &usize| (fitted.coefficients[*k] - true_robot.nominal[*k]).abs() / fitted.errors[*k];
    let inside = told.iter().filter(|k| off(k) < 1.96).count();
    assert!(told.len() > 50 && 100 * inside >= 88 * told.len(), "{inside} of {}", told.len());
    assert!(told.iter().all(|k| off(k) < 4.5), "{:?}", told.iter().map(off).collect::<Vec<_>>());
    // friction within 3 %
    for (k, parameter) in robot.parameters().iter().enumerate() {
        let is_friction = robot.names[k].starts_with(['d', 'f']);
        if is_friction {
            let wanted = true_robot.nominal[k];
            assert!((fitted.coefficients[k] / wanted - 1.0).abs() < 0.03, "{}: {:?}", robot.names[k], parameter);
        }
    }
    // all links can be, and the file with them predicts another motion to little more than noise
    assert!(found.bodies.iter().all(is_body));
    let mut said = Diagnostics::new();
    let text = renumbered(&source, &found.numbers(&map), &mut said).unwrap_or_else(|| panic!("{said}"));
    let (written, _) = loaded(&Source::new("written.urdf", text));
    for (a, b) in written.nominal.iter().zip(&found.written) {
        // offsets have no place in a file
        assert!((a - b).abs() < 1e-6 * (1.0 + b.abs()) || *a == 0.0, "{a} {b}");
    }
    let mut other = logged(&truth, &times(20.0, 500.0, 100.0));
    other.retain(|(name, _)| !name.starts_with("qdd."));
    let other = together(&robot.equations(&[aligned(other, &robot.model)], 5.0));
    let (by_file, by_written) = (other.rms(&robot.nominal), other.rms(&written.nominal));
    for (j, (file, written)) in by_file.iter().zip(&by_written).enumerate() {
        assert!(*written < 0.05 && 8.0 * written < *file, "joint {j}: {file} {written}");
    }
}

/// What runs find of a base parameter, in units of the errors that they state.
#[derive(Debug)]
struct Coverage {
    /// How often it lies within its interval of 95 %.
    rate: f64,
    /// What it is off by in the mean.
    bias: f64,
    /// The standard deviation about that.
    spread: f64,
}

/// So many runs of a planar arm.
fn coverage(runs: usize) -> Vec<Coverage> {
    let source = source_of("planar_2r.toml");
    let (robot, _) = loaded(&source);
    let (truth_source, truth) = in_truth(&source, |k| [0.3 + 0.1 * k as f64, 0.2]);
    let wanted = loaded(&truth_source).0.nominal;
    let exact = logged(&truth, &times(60.0, 200.0, 0.0));
    let mut off = vec![Vec::new(); wanted.len()];
    let mut noise = Normal(41);
    for _ in 0..runs {
        let mut columns = exact.clone();
        as_measured(&mut columns, &mut noise, [0.05, 1e-3]);
        let data = together(&robot.equations(&[aligned(columns, &robot.model)], 5.0));
        let fitted = data.fit(lags()).fitted;
        for (k, wanted) in wanted.iter().enumerate() {
            off[k].push((fitted.coefficients[k] - wanted) / fitted.errors[k]);
        }
    }
    let of_parameter = |off: Vec<f64>| {
        let mean = |f: &dyn Fn(f64) -> f64| off.iter().map(|x| f(*x)).sum::<f64>() / runs as f64;
        let bias = mean(&|x| x);
        let rate = mean(&|x| f64::from(u8::from(x.abs() < 1.96)));
        Coverage { rate, bias, spread: mean(&|x| (x - bias) * (x - bias)).sqrt() }
    };
    off.into_iter().map(of_parameter).collect()
}

#[test]
fn intervals_of_95_percent_hold_about_so_often() {
    let all = coverage(30);
    // 30 runs scatter by 4 % about the rate
    assert!(all.iter().all(|own| own.rate > 0.75), "{all:?}");
    let mean = all.iter().map(|own| own.rate).sum::<f64>() / all.len() as f64;
    assert!((0.88..0.985).contains(&mean), "{mean}: {all:?}");
}

/// `cargo test -p straightline-cli --test suite -- --ignored --nocapture identify::long_proof`
#[test]
#[ignore = "two minutes: a thousand identifications"]
fn long_proof_that_intervals_of_95_percent_hold_in_a_thousand_runs() {
    let all = coverage(std::env::var("RUNS").ok().and_then(|runs| runs.parse().ok()).unwrap_or(1000));
    all.iter().for_each(|own| println!("{own:?}"));
    // 1000 runs scatter by 0.7 %
    assert!(all.iter().all(|own| (0.93..0.975).contains(&own.rate)), "{all:?}");
    // noise of velocities, which regressors have, biases by less than half of the error
    assert!(all.iter().all(|own| own.bias.abs() < 0.45 && (0.9..1.1).contains(&own.spread)), "{all:?}");
}

#[test]
fn a_log_that_stands_still_tells_little_and_changes_little() {
    let source = source_of("panda.urdf");
    let (robot, map) = loaded(&source);
    let (_, truth) = in_truth(&source, |_| [0.0, 0.0]);
    // one joint swings, the others stand
    let times = times(10.0, 200.0, 0.0);
    let mut columns = logged(&truth, &times);
    let joints = robot.rates.len();
    for (k, t) in times.iter().enumerate() {
        let states: Vec<[f64; 3]> =
            (0..joints).map(|j| if j == 3 { motion(j, *t) } else { [motion(j, 0.0)[0], 0.0, 0.0] }).collect();
        let [q, qd, qdd] = [0, 1, 2].map(|n| states.iter().map(|s| s[n]).collect::<Vec<f64>>());
        let tau = straightline_core::algorithms::inverse_dynamics(&truth, &q, &qd, &qdd);
        for (j, x) in [q, qd, qdd, tau].concat().into_iter().enumerate() {
            columns[1 + j].1[k] = x;
        }
    }
    let data = together(&robot.equations(&[aligned(columns, &robot.model)], 10.0));
    let found = identified(&robot, &map, &data).expect("links can be");
    assert!(found.fit.fitted.untold.len() > 20, "{:?}", found.fit.fitted.untold);
    assert!(found.bodies.iter().all(is_body));
    // torques are explained all the same
    let zero = vec![0.0; data.columns];
    for (left, all) in data.rms(&found.written).iter().zip(data.rms(&zero)) {
        assert!(*left < 1e-3 * (0.1 + all), "{left} of {all}");
    }
    // what nothing is known of stays: the first link turns about the vertical, and did not
    let first = map.links.iter().position(|link| link.name == "panda_link1").expect("the first link");
    for (was, new) in map.links[first].known.iter().zip(found.bodies[first]) {
        assert!((was - new).abs() < 1e-6 * (1e-3 + was.abs()), "{was} {new}");
    }
}

#[test]
fn the_command_writes_the_file_and_says_what_it_cannot_tell() {
    let source = source_of("planar_2r.toml");
    let (_, truth) = in_truth(&source, |_| [0.3, 0.2]);
    let mut noise = Normal(9);
    let [one, two, other, short] =
        ["one.csv", "two.csv", "other.csv", "short.csv"].map(|name| scratch(name).display().to_string());
    for (path, from, seconds) in [(&one, 0.0, 10.0), (&two, 30.0, 10.0), (&other, 60.0, 10.0), (&short, 0.0, 0.5)] {
        let mut columns = logged(&truth, &times(seconds, 250.0, from));
        as_measured(&mut columns, &mut noise, [0.02, 1e-3]);
        fs::write(path, csv(&columns)).expect("written");
    }
    let written = scratch("identified.toml").display().to_string();
    let _ = fs::remove_file(&written);
    let output = straightline(&["identify", source.path(), &one, &two, "--validate", &other, "-o", &written]);
    let said = String::from_utf8(output.stdout).expect("text");
    assert!(output.status.success(), "{said}\n{}", String::from_utf8_lossy(&output.stderr));
    for part in [
        "all terms of the equations pass a low-pass at 5.000 Hz",
        "numbers of links and joints make",
        "by a fit of the other logs:",
        "which was not fitted:",
        "\n-mass = 1.5\n",
        "\n+mass = ",
        "+friction = 0.",
        "± 95 %",
    ] {
        assert!(said.contains(part), "{part}: {said}");
    }
    let text = fs::read_to_string(&written).expect("the file");
    assert!(text.starts_with("# Planar 2R arm in a vertical plane"), "{text}");
    let checked = straightline(&["check", &written]);
    assert!(checked.status.success(), "{}", String::from_utf8_lossy(&checked.stderr));
    // friction is that of the truth
    let robot = description_of(&Source::new("identified.toml", text));
    for joint in &robot.joints {
        let [viscous, coulomb] =
            [&joint.drive.damping, &joint.drive.friction].map(|x| x.as_ref().expect("it is there").value);
        assert!((viscous / 0.3 - 1.0).abs() < 0.03 && (coulomb / 0.2 - 1.0).abs() < 0.03, "{joint:?}");
    }
    for (arguments, parts) in [
        (&["identify", source.path(), &short][..], &["short.csv: too short", "--cutoff"][..]),
        (&["identify", source.path(), &one, "--floating-base"], &["joint `root_joint.qx` is not in the log"]),
    ] {
        let output = straightline(arguments);
        let said = String::from_utf8(output.stderr).expect("text");
        assert!(output.status.code() == Some(1) && parts.iter().all(|part| said.contains(part)), "{said}");
    }
}

/// Rotors' inertias are fitted where the file has some, and written where it has them.
#[test]
fn rotors_are_found_where_the_file_has_some() {
    let text = fs::read_to_string(format!("{ROBOTS}/planar_2r.toml")).expect("the robot file");
    let with = |inertia: &str| {
        text.replace("axis = \"z\"\n", &format!("axis = \"z\"\nrotor_inertia = {inertia}\ngear_ratio = 50\n"))
    };
    let (source, truth) = (Source::new("rotors.toml", with("1e-4")), Source::new("truth.toml", with("1.5e-4")));
    let (robot, map) = loaded(&source);
    assert!(robot.kinds.contains(&JointParameter::RotorInertia));
    let (model, _) = load(&truth, &ModelOptions::default());
    let columns = logged(&model.expect("a robot").cast(), &times(5.0, 250.0, 0.0));
    let data = together(&robot.equations(&[aligned(columns, &robot.model)], 10.0));
    let found = identified(&robot, &map, &data).expect("links can be");
    let mut said = Diagnostics::new();
    let written = renumbered(&source, &found.numbers(&map), &mut said).unwrap_or_else(|| panic!("{said}"));
    let robot = description_of(&Source::new("written.toml", written));
    // that of the second joint is told apart from the inertia of its link, that of the first is not
    let second = robot.joint("joint2").and_then(|joint| joint.drive.rotor_inertia.clone()).expect("it is there");
    assert!((second.value / 1.5e-4 - 1.0).abs() < 1e-3, "{second:?}");
}

/// A designed motion keeps all limits, begins and ends at rest, and has less than this part of the median condition number of random ones.
fn design_of(file: &str, part: f64) {
    let source = source_of(file);
    let (robot, _) = loaded(&source);
    let found = designed(&robot, DesignDemand { duration: 10.0, seed: 1 }).expect("a motion");
    println!("{file}: {} of {}", found.condition, found.random);
    assert!(found.condition < part * found.random, "{file}: {} and {}", found.condition, found.random);
    let (times, [q, qd, qdd]) = found.sampled(200.0);
    assert_eq!((times.len(), times[2000]), (2001, 10.0));
    for (j, joint) in robot.exact.joints().iter().enumerate() {
        let limits = joint.limits;
        assert!(q[j].iter().all(|x| (limits.lower..=limits.upper).contains(x)), "{file}: {}", joint.name);
        assert!(qd[j].iter().all(|x| x.abs() <= limits.velocity), "{file}: {}", joint.name);
        for i in [0, 2000] {
            assert!(qd[j][i].abs() < 1e-12 && qdd[j][i].abs() < 1e-12, "{file}: {}", joint.name);
        }
        // rates are those of what they are rates of
        for k in 1..2000 {
            let slope = (q[j][k + 1] - q[j][k - 1]) * 100.0;
            assert!((slope - qd[j][k]).abs() < 2e-3 * limits.velocity.min(10.0), "{file}: {slope} {}", qd[j][k]);
        }
    }
    let model = robot.exact.cast::<f64>();
    for i in 0..times.len() {
        let state = [&q, &qd, &qdd].map(|kind| kind.iter().map(|column| column[i]).collect::<Vec<f64>>());
        let tau = straightline_core::algorithms::inverse_dynamics(&model, &state[0], &state[1], &state[2]);
        for (tau, joint) in tau.iter().zip(robot.exact.joints()) {
            assert!(tau.abs() <= joint.limits.effort, "{file}: {tau} of {}", joint.name);
        }
    }
}

#[test]
fn a_designed_motion_of_two_joints_keeps_all_limits_and_has_half_the_condition_of_random_ones() {
    design_of("planar_2r.toml", 0.5);
}

#[test]
#[ignore = "slow proof: the search for a motion of six joints"]
fn slow_proof_that_a_designed_motion_of_six_joints_has_half_the_condition_of_random_ones() {
    design_of("ur5.urdf", 0.5);
}

#[test]
fn the_command_writes_a_motion_that_can_be_analysed() {
    let source = source_of("planar_2r.toml");
    let path = scratch("excite.csv").display().to_string();
    let output = straightline(&["identify", source.path(), "--design", &path, "--duration", "8"]);
    let said = String::from_utf8(output.stdout).expect("text");
    assert!(output.status.success(), "{said}\n{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("median of random motions"), "{said}");
    let analysed = straightline(&["analyze", source.path(), "--motion", &path]);
    assert!(analysed.status.success(), "{}", String::from_utf8_lossy(&analysed.stderr));
    assert_eq!(straightline(&["identify", source.path()]).status.code(), Some(2));
}

/// Weight and a rotor that slides up and down cannot be told from an offset: they are what a file has a place for.
#[test]
fn weight_is_no_offset() {
    let text = "[robot]\nname = \"lift\"\n[[link]]\nname = \"base\"\n[[link]]\nname = \"car\"\nmass = 2.0\ninertia = [0.01, 0.01, 0.01]\n\
                [[joint]]\nname = \"z\"\nkind = \"prismatic\"\nparent = \"base\"\nchild = \"car\"\naxis = \"z\"\narmature = 0.5\n";
    let (robot, map) = loaded(&Source::new("lift.toml", text));
    for (mass, rotor) in [(2.0, 0.9), (3.0, 0.5), (2.5, 0.7)] {
        let (model, _) = load(
            &Source::new(
                "truth.toml",
                text.replace("2.0", &format!("{mass:?}")).replace("armature = 0.5", &format!("armature = {rotor:?}")),
            ),
            &ModelOptions::default(),
        );
        let columns = logged(&model.expect("a robot").cast(), &times(5.0, 100.0, 0.0));
        let data = together(&robot.equations(&[aligned(columns, &robot.model)], 5.0));
        let found = identified(&robot, &map, &data).expect("links can be");
        let sizes = data.rms(&vec![0.0; data.columns]);
        for (left, size) in data.rms(&found.written).iter().zip(sizes) {
            assert!(
                *left < 0.02 * size,
                "mass {mass}, rotor {rotor}: {left} of {size} are left by what is written: {:?} {:?}",
                found.bodies,
                found.joints
            );
        }
    }
}

/// A joint without a drive, whose effort is zero all the time, tells as much as the others.
#[test]
fn a_joint_without_force_hides_nothing() {
    let source = source_of("planar2r.urdf");
    let (robot, map) = loaded(&source);
    let (_, truth) = in_truth(&source, |_| [0.0, 0.0]);
    // by forward dynamics, with a force on the first joint alone
    let (mut q, mut qd, h) = (vec![0.4, -0.2], vec![0.0, 0.0], 1e-3);
    let mut columns = logged(&truth, &times(4.0, 1000.0, 0.0));
    for i in 0..4000 {
        let tau = [3.0 * (5e-3 * i as f64).sin(), 0.0];
        let qdd = straightline_core::algorithms::forward_dynamics_aba(&truth, &q, &qd, &tau);
        for (k, x) in [&q[..], &qd, &qdd, &tau].concat().into_iter().enumerate() {
            columns[1 + k].1[i] = x;
        }
        for k in 0..2 {
            qd[k] += h * qdd[k];
            q[k] += h * qd[k];
        }
    }
    let data = together(&robot.equations(&[aligned(columns, &robot.model)], 5.0));
    let found = identified(&robot, &map, &data).expect("links can be");
    assert!(found.fit.fitted.errors.iter().filter(|error| error.is_finite()).count() > 4, "{:?}", found.fit.fitted);
    for (left, by_file) in data.rms(&found.written).iter().zip(data.rms(&robot.nominal)) {
        assert!(*left < 1e-2 * by_file + 1e-6, "{left}, {by_file} by the file");
    }
}
