//! The command `residuals`: what was hidden in a log is found, and nothing where nothing was.

use crate::logged::{self, csv, logged, motion, straightline, Normal};
use std::fs;
use std::path::PathBuf;
use straightline_cli::log_states::log_demand;
use straightline_cli::residual::payload::UnitPayloads;
use straightline_cli::residual::torques::TorqueModel;
use straightline_cli::residual::{explain, residual_torques};
use straightline_codegen::diagnostic::Source;
use straightline_codegen::options::Options;
use straightline_core::model::{Load, Model};
use straightline_core::spatial::{Mat3, Sym3, Vec3};
use straightline_logs::align::align;
use straightline_logs::log::from_columns;
use straightline_logs::mcap;

const ROBOTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots");

fn scratch(name: &str) -> PathBuf {
    logged::scratch("residuals", name)
}

fn succeeds(arguments: &[&str]) -> String {
    let output = straightline(arguments);
    assert!(output.status.success(), "{arguments:?}\n{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// What is said on standard error; the exit code says that the input is wrong.
fn fails(arguments: &[&str]) -> String {
    let output = straightline(arguments);
    assert_eq!(output.status.code(), Some(1), "{arguments:?}\n{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stderr).expect("text")
}

fn panda() -> (String, TorqueModel) {
    let path = format!("{ROBOTS}/descriptions/panda.urdf");
    let source = Source::new(&path, fs::read_to_string(&path).expect("the robot file"));
    (path, TorqueModel::load(&source, &Options::default()).expect("the robot can be loaded"))
}

#[test]
fn a_log_without_noise_leaves_nothing_in_both_ways() {
    let (robot, model) = panda();
    let times: Vec<f64> = (0..2000).map(|i| f64::from(i) * 1e-3).collect();
    let (input, output, page) = (scratch("exact.csv"), scratch("exact_residuals.csv"), scratch("exact.html"));
    fs::write(&input, csv(&logged(&model.model, &times))).expect("written");
    let [input, output, page] = [input, output, page].map(|p| p.display().to_string());
    let said = succeeds(&["residuals", &robot, &input, "-o", &output, "--html", &page]);
    assert!(
        said.contains("2000 of 2000 rows, 1000 Hz") && said.contains("accelerations as the log has them"),
        "{said}"
    );
    assert!(said.contains("no payload at ") && said.contains("no episodes"), "{said}");
    let text = fs::read_to_string(&output).expect("residuals");
    let names: Vec<&str> = text.lines().next().expect("a head").split(',').collect();
    assert_eq!(names.len(), 1 + 6 * 7);
    for (row, line) in text.lines().skip(1).enumerate() {
        for (name, x) in names.iter().zip(line.split(',')).skip(1 + 3 * 7) {
            let x: f64 = x.parse().expect("a number");
            assert!(x.abs() < 1e-9, "{name} in row {row}: {x}");
        }
    }
    let page = fs::read_to_string(&page).expect("a page");
    roxmltree::Document::parse_with_options(&page, roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() })
        .expect("the page is well-formed XML");
    assert_eq!(page.matches("<section class=\"card\">").count(), 7);
}

/// Half a kilogram at (0.02, −0.01, 0.06) m in the hand, with inertia, as the body that carries it has it.
fn with_half_a_kilogram(model: &Model<f64>) -> Model<f64> {
    let frame = model.frame("panda_hand").expect("the hand");
    let place = |x: f64, y: f64, z: f64| frame.placement.rotation * Vec3::from([x, y, z]) + frame.placement.translation;
    let mut loaded = model.clone();
    // as two points, so that it has a second moment of its own
    for (mass, r) in [(0.3, place(0.04, -0.01, 0.08)), (0.2, place(-0.01, -0.01, 0.03))] {
        let second = Sym3::from_matrix(&Mat3::outer(r, r.scale(mass)));
        loaded.bodies[frame.body.expect("it moves")].carry(Load {
            mass,
            first_moment: r.scale(mass),
            second_moment: second,
        });
    }
    loaded
}

/// Encoders of 1e-5 rad, velocities with noise of 2e-3 rad/s, torques with noise of 0.1 N·m, all of them standard deviations; 500 Hz, a minute.
#[test]
fn what_is_hidden_in_a_noisy_log_is_found() {
    let (_, model) = panda();
    let times: Vec<f64> = (0..30_000).map(|i| f64::from(i) * 2e-3).collect();
    let mut columns = logged(&with_half_a_kilogram(&model.model), &times);
    let (mut noise, friction) = (Normal(17), |k: usize| (1.1 - 0.1 * k as f64, 0.9 - 0.07 * k as f64));
    let push = |k: usize, t: f64| if k == 3 && (30.0..30.4).contains(&t) { 9.0 } else { 0.0 };
    for k in 0..7 {
        let (viscous, coulomb) = friction(k);
        for (i, t) in times.iter().enumerate() {
            let [q, qd, _] = motion(k, *t);
            columns[1 + k].1[i] = (q / 1e-5).round() * 1e-5;
            columns[8 + k].1[i] = qd + 2e-3 * noise.next();
            columns[22 + k].1[i] += viscous * qd + coulomb * qd.signum() + push(k, *t) + 0.1 * noise.next();
        }
    }
    columns.retain(|(name, _)| !name.starts_with("qdd."));
    // as it goes through a file
    let bytes = mcap::bytes(&from_columns(columns).expect("a log"), mcap::TOPIC).expect("it can be written");
    let log = mcap::read(&bytes, None).expect("it can be read");
    let log = align(&log, &log_demand(&model.model)).expect("all joints are there");
    let units = UnitPayloads::at(&model.model, "panda_hand").expect("the hand moves");
    let found = explain(&log, &residual_torques(&model, &log, 10.0), Some(&units));

    let payload = found.payload.as_ref().expect("one was looked for");
    let (mass, error) = payload.parameters[0];
    assert!(payload.is_found && (mass / 0.5 - 1.0).abs() < 0.02 && error < 0.01, "{payload:?}");
    for ((found, error), wanted) in payload.centre.iter().zip([0.02, -0.01, 0.06]) {
        assert!((found - wanted).abs() < 5e-3 && *error < 5e-3, "{payload:?}");
    }
    for (k, joint) in found.joints.iter().enumerate() {
        let (viscous, coulomb) = friction(k);
        let fitted = joint.fitted.expect("it has one coordinate");
        assert!((fitted[1].0 / viscous - 1.0).abs() < 0.03, "joint {k}: {joint:?}, {viscous}");
        assert!((fitted[2].0 / coulomb - 1.0).abs() < 0.03, "joint {k}: {joint:?}, {coulomb}");
        assert!(joint.explained > 0.9, "joint {k}: {joint:?}");
        // the push, and nothing else
        assert_eq!(joint.episodes.len(), usize::from(k == 3), "joint {k}: {joint:?}");
    }
    let push = found.joints[3].episodes[0];
    // smoothing at 10 Hz spreads its ends by a period
    assert!((push.from - 30.0).abs() < 0.1 && (push.to - 30.4).abs() < 0.1 && push.peak > 7.0, "{push:?}");
}

#[test]
fn a_simulation_written_as_mcap_goes_back_into_residuals() {
    let robot = format!("{ROBOTS}/descriptions/planar_2r.toml");
    let experiment = scratch("free.toml");
    fs::write(
        &experiment,
        "[start]\nq = [0.3, -0.2]\n[simulation]\nduration = 1.0\ninterval = 0.001\nstop_at_limits = false\n",
    )
    .expect("written");
    let [experiment, log, csv, table] =
        [experiment, scratch("run.mcap"), scratch("run.csv"), scratch("left.csv")].map(|p| p.display().to_string());
    for output in [&log, &csv] {
        succeeds(&["simulate", &robot, "--input", &experiment, "--output", output]);
    }
    let said = [&log, &csv].map(|log| {
        let said = succeeds(&["residuals", &robot, log, "--cutoff", "20", "-o", &table]);
        // whichever file they come from, nothing is left, but at ends, where smoothing has no neighbours
        let text = fs::read_to_string(&table).expect("residuals");
        let rows: Vec<Vec<f64>> =
            text.lines().skip(1).map(|line| line.split(',').map(|x| x.parse().expect("a number")).collect()).collect();
        assert_eq!(rows.len(), 1001);
        for row in rows.iter().filter(|row| (0.3..0.7).contains(&row[0])) {
            assert!(row[7..9].iter().all(|x| x.abs() < 1e-5) && row[9..11].iter().all(|x| x.abs() < 1e-8), "{row:?}");
        }
        said
    });
    assert!(said[0].contains("1001 of 1001 rows, 1000 Hz") && said[0].contains("no episodes"), "{}", said[0]);
    assert!(said[1].contains("not read: energy, work, losses"), "{}", said[1]);
    // frames stand where kinematics say, and pages draw the log, and the residuals
    let poses = mcap::frame_poses(&fs::read(&log).expect("the log")).expect("poses");
    let tip = poses.iter().find(|pose| pose.child == "tip").expect("the tip");
    let (a, b) = (0.3_f64, 0.3 - 0.2_f64);
    let wanted = [0.5 * a.cos() + 0.4 * b.cos(), 0.0, 0.5 * a.sin() + 0.4 * b.sin()];
    for (found, wanted) in tip.translation.iter().zip(wanted) {
        assert!((found - wanted).abs() < 1e-15, "{tip:?}");
    }
    let page = scratch("run.html").display().to_string();
    for run in [&log, &table] {
        succeeds(&["view", &robot, run, "-o", &page]);
        let page = fs::read_to_string(&page).expect("a page");
        assert_eq!(page.contains("Residual torques"), run == &table);
    }
}

#[test]
fn what_is_wrong_with_a_log_is_said_with_its_file_and_a_remedy() {
    let robot = format!("{ROBOTS}/descriptions/planar_2r.toml");
    for (name, bytes, parts) in [
        ("cut.mcap", &b"\x89MCAP0\r\n\x01\x20"[..], &["cut.mcap: byte 8: a record is cut off", "mcap doctor"][..]),
        (
            "other.csv",
            b"t,q.joint1,tau.joint1\n0,0,0\n",
            &["`joint2` is not in the log", "the log has the joints joint1"],
        ),
        ("bad.csv", b"t,q.joint1\n0,zero\n", &["bad.csv: line 2: `zero` in column `q.joint1`"]),
        ("run.bag", b"#ROSBAG V2.0\n", &["no log that is known", "ros2 bag convert"]),
    ] {
        let path = scratch(name);
        fs::write(&path, bytes).expect("written");
        let said = fails(&["residuals", &robot, &path.display().to_string()]);
        assert!(parts.iter().all(|part| said.contains(part)), "{name}: {said}");
    }
    let path = scratch("other.csv").display().to_string();
    assert!(fails(&["residuals", &robot, &path, "--payload", "hand"]).contains("no frame `hand` that moves"));
    assert!(fails(&["residuals", &robot, &path, "--topic", "/a"]).contains("has no topics"));
}

/// A log of a million rows: `cargo test -p straightline-cli --test suite residuals::a_million -- --ignored --nocapture` writes it and says how long it takes.
#[test]
#[ignore = "measures time: run it alone, in a build with optimisation"]
fn a_million_rows() {
    let (robot, model) = panda();
    let times: Vec<f64> = (0..1_000_000).map(|i| f64::from(i) * 1e-3).collect();
    let columns = logged(&model.model, &times);
    let without: Vec<_> = columns.iter().filter(|(name, _)| !name.starts_with("qdd.")).cloned().collect();
    let files = [scratch("million.mcap"), scratch("million.csv")];
    fs::write(&files[1], csv(&without)).expect("written");
    fs::write(&files[0], mcap::bytes(&from_columns(without).expect("a log"), mcap::TOPIC).expect("MCAP"))
        .expect("written");
    for file in files {
        let path = file.display().to_string();
        let start = std::time::Instant::now();
        let said = succeeds(&["residuals", &robot, &path]);
        println!("{path}: {:.2} s\n{said}", start.elapsed().as_secs_f64());
    }
}
