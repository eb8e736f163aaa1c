//! The table `sweep`: the same rows for any partitions, those of the robot file with other numbers, and what is wrong with its arguments.

use datafusion::arrow::array::{Array, AsArray, RecordBatch};
use datafusion::arrow::datatypes::{Float64Type, Int64Type};
use datafusion::prelude::{SessionConfig, SessionContext};
use std::path::Path;
use straightline_cli::experiment;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::options::Options;
use straightline_codegen::{description, model};
use straightline_fleet_testing::{project, query, robot_text};
use straightline_fleets::RobotFolder;
use straightline_simulation::analysis::{analyze, Analysis};
use straightline_sweeps::register;

/// The rows of a query over files of that folder.
fn rows_in(folder: &Path, partitions: usize, sql: &str) -> Result<RecordBatch, String> {
    let context = SessionContext::new_with_config(SessionConfig::new().with_target_partitions(partitions));
    register(&context, &RobotFolder::at(folder));
    query::rows(&context, sql)
}

fn rows(partitions: usize, sql: &str) -> Result<RecordBatch, String> {
    rows_in(&project(), partitions, sql)
}

const SWEEP: &str = "sweep('descriptions/panda.urdf', 'experiments/panda_reach.toml', 'panda_link7.mass=0.5:3, panda_link6.mass=1:2', 40, 7)";

#[test]
fn rows_are_the_same_for_any_partitions_and_any_part() {
    let sql = format!("SELECT * FROM {SWEEP} ORDER BY sample");
    let wanted = rows(1, &sql).unwrap();
    assert_eq!(wanted.num_rows(), 40);
    let names: Vec<String> = wanted.schema().fields().iter().map(|field| field.name().clone()).collect();
    let figures = ["given", "taken", "exceeded", "peak", "rms", "why"];
    assert_eq!(names, [&["sample", "panda_link7.mass", "panda_link6.mass"][..], &figures].concat());
    for partitions in [2, 7, 64] {
        assert_eq!(rows(partitions, &sql).unwrap(), wanted, "{partitions} partitions");
    }
    let part = rows(3, &format!("SELECT * FROM {SWEEP} WHERE sample >= 30 ORDER BY sample")).unwrap();
    assert_eq!(part, wanted.slice(30, 10));
    let drawn = wanted.column(1).as_primitive::<Float64Type>();
    assert!(drawn.values().iter().all(|mass| (0.5..3.0).contains(mass)));
    let other = rows(1, &sql.replace("40, 7)", "40, 8)")).unwrap();
    assert_ne!(other.column(1), wanted.column(1));
}

/// The figures of the Panda whose link 7 has another mass in its file, and an inertia in proportion.
fn with_mass(mass: f64) -> Analysis {
    let text = robot_text("panda.urdf");
    let at = text.find("<link name=\"panda_link7\">").unwrap();
    let end = at + text[at..].find("</link>").unwrap();
    let mut link = text[at..end].to_string();
    for name in ["mass value", "ixx", "ixy", "ixz", "iyy", "iyz", "izz"] {
        let from = link.find(&format!("{name}=\"")).unwrap() + name.len() + 2;
        let to = from + link[from..].find('"').unwrap();
        let number: f64 = link[from..to].parse().unwrap();
        link.replace_range(from..to, &format!("{:?}", number * mass / 0.735522));
    }
    let text = format!("{}{link}{}", &text[..at], &text[end..]);
    let mut said = Diagnostics::new();
    let described = description::read(&Source::new("panda.urdf", text), &mut said).expect("a robot");
    let options = Options::default();
    let model =
        model::build(&described, &options.scene.model_options(&options.model), &mut said).expect("a robot").cast();
    let path = project().join("experiments/panda_reach.toml");
    let source = Source::new("panda_reach.toml", std::fs::read_to_string(path).unwrap());
    let found = experiment::read(&source, &model, &model, false, &|_| Err(String::new()), &mut said);
    analyze(&model, &found.and_then(|found| found.motion).expect("a motion"), 0.005).expect("figures")
}

#[test]
fn figures_are_those_of_the_file_with_other_numbers() {
    let sql =
        format!("SELECT * FROM {} ORDER BY sample", SWEEP.replace(", panda_link6.mass=1:2", "").replace("40", "3"));
    let found = rows(2, &sql).unwrap();
    let number = |name: &str, row: usize| found.column_by_name(name).unwrap().as_primitive::<Float64Type>().value(row);
    for row in 0..3 {
        let wanted = with_mass(number("panda_link7.mass", row));
        let close = |x: f64, y: f64| assert!((x - y).abs() < 1e-9 * (1.0 + y.abs()), "{x} and {y}");
        close(number("given", row), wanted.joints.iter().map(|joint| joint.given).sum());
        let exceeded = found.column_by_name("exceeded").unwrap().as_primitive::<Int64Type>().value(row);
        assert_eq!(exceeded as usize, wanted.violations.len());
        for (k, joint) in wanted.joints.iter().enumerate() {
            let of = |what: &str| {
                found.column_by_name(what).unwrap().as_struct().column(k).as_primitive::<Float64Type>().value(row)
            };
            close(of("peak"), joint.peak.0);
            close(of("rms"), joint.rms);
        }
        assert!(found.column_by_name("why").unwrap().is_null(row));
    }
}

/// What planning says of the sweep with something else in its arguments.
fn refusal(from: &str, to: &str) -> String {
    rows(1, &format!("SELECT * FROM {}", SWEEP.replace(from, to))).unwrap_err()
}

#[test]
fn arguments_that_do_not_fit_are_refused_with_a_remedy() {
    for (from, to, wanted) in [
        (", 7)", ")", "`sweep` has 5 arguments, not 4: sweep(robot, experiment, ranges, samples, seed)"),
        ("40, 7)", "0, 7)", "`samples` of `sweep` is Int64(0)\nhelp: it is a whole number from 1 to 1000000"),
        ("7)", "7.5)", "`seed` of `sweep` is Float64(7.5)\nhelp: it is a whole number"),
        ("panda_reach.toml", "panda_reech.toml", "`experiments/panda_reech.toml` cannot be read"),
        ("panda.urdf", "pandas.urdf", "`descriptions/pandas.urdf` cannot be read"),
        ("panda_reach.toml", "flexible_arm_swing.toml", "experiments/flexible_arm_swing.toml"),
    ] {
        let said = refusal(from, to);
        assert!(said.contains(wanted), "{said}\n\nwanted:\n{wanted}");
    }
}

#[test]
fn what_is_wrong_with_a_range_has_a_caret_under_it() {
    let first = "panda_link7.mass=0.5:3";
    for (other, title) in [
        ("panda_link7.mass=3:0.5", "this is no range"),
        ("panda_link7.mass", "this is no range"),
        ("panda_link9.mass=0.5:3", "`panda_link9.mass`: the robot file has no value `mass` of `panda_link9`"),
        ("panda_link6.mass=0.5:3", "`panda_link6.mass` has two ranges"),
        ("panda_link7.mass=-1:3", "`panda_link7.mass` = -1 makes no robot: "),
        (
            "panda_joint4.friction=0:1",
            "`panda_joint4.friction`: the robot file has no value `friction` of `panda_joint4`",
        ),
    ] {
        let said = refusal(first, other);
        // the second range is the one that is there twice
        let place = if title.ends_with("two ranges") { other.len() + 2 } else { 0 };
        let (text, second) = (other, "panda_link6.mass=1:2");
        let marked = if place == 0 { text.len() } else { second.len() };
        let shown = format!("1 | {text}, {second}\n  | {}{}", " ".repeat(place), "^".repeat(marked));
        assert!(said.contains(title) && said.contains(&shown), "{said}\n\nwanted:\n{title}\n{shown}");
        assert!(said.contains("= help: "), "{said}");
    }
}

#[test]
fn a_broken_robot_or_experiment_is_refused_with_line_and_caret() {
    let experiment = std::fs::read_to_string(project().join("experiments/panda_reach.toml")).unwrap();
    let urdf = robot_text("panda.urdf");
    let swept = "SELECT * FROM sweep('arm.urdf', 'reach.toml', 'panda_link7.mass=0.5:3', 4, 7)";
    let said = |robot: &str, experiment: &str| {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("arm.urdf"), robot).unwrap();
        std::fs::write(folder.path().join("reach.toml"), experiment).unwrap();
        rows_in(folder.path(), 2, swept).map(|rows| rows.num_rows())
    };
    assert_eq!(said(&urdf, &experiment), Ok(4));
    let of = |mutated: &str, from: &str| mutated.lines().position(|line| line.contains(from)).unwrap() + 1;
    let heavy = urdf.replacen("<mass value=\"0.735522\"/>", "<mass value=\"1.5 kg\"/>", 1);
    let wrong = said(&heavy, &experiment).unwrap_err();
    assert!(wrong.contains(&format!("--> arm.urdf:{}:", of(&heavy, "1.5 kg"))) && wrong.contains("^^^^^^"), "{wrong}");
    for (from, to, caret) in [
        ("kind = \"quintic\"", "kind = \"sextic\"", "^^^^^^^^"),
        ("frame = \"panda_hand\"", "frame = \"panda_hook\"", "^^^^^^^^^^^^"),
        ("t = 0.8", "t = \"late\"", "^^^^^^"),
    ] {
        let mutated = experiment.replacen(from, to, 1);
        let wrong = said(&urdf, &mutated).unwrap_err();
        let place = format!("--> reach.toml:{}:", of(&mutated, to));
        assert!(wrong.contains(&place) && wrong.contains(caret), "{wrong}\n\nwanted:\n{place}");
    }
    let still = said(&urdf, "[start]\nq = [0.0, -0.8, 0.0, -2.3, 0.0, 1.6, 0.8]\n").unwrap_err();
    assert!(still.contains("reach.toml"), "{still}");
}
