//! The command `view` as a person uses it.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const ROBOTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots");

fn scratch(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("view").join(name);
    fs::create_dir_all(&path).unwrap();
    path
}

fn straightline(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_straightline")).args(arguments).output().unwrap()
}

fn succeeds(arguments: &[&str]) {
    let output = straightline(arguments);
    assert!(output.status.success(), "{arguments:?}\n{}", String::from_utf8_lossy(&output.stderr));
}

/// What is said on standard error; the exit code says that the input is wrong.
fn fails(arguments: &[&str]) -> String {
    let output = straightline(arguments);
    assert_eq!(output.status.code(), Some(1), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

fn page(path: &str) -> (String, serde_json::Value) {
    let page = fs::read_to_string(path).unwrap();
    let data = page.split("id=\"data\">").nth(1).unwrap().split("</script>").next().unwrap();
    let data = serde_json::from_str(data).unwrap();
    (page, data)
}

fn names<'a>(of: &'a serde_json::Value, key: &str) -> Vec<&'a str> {
    of.as_array().unwrap().iter().map(|one| one[key].as_str().unwrap()).collect()
}

#[test]
fn what_a_simulation_writes_is_drawn_whatever_its_format() {
    let here = scratch("formats");
    let panda = format!("{ROBOTS}/descriptions/panda.urdf");
    let mut pages = Vec::new();
    for format in ["csv", "json", "parquet"] {
        let run = here.join(format!("track.{format}")).display().to_string();
        let html = here.join(format!("{format}.html")).display().to_string();
        let input = format!("{ROBOTS}/experiments/panda_track.toml");
        succeeds(&["simulate", &panda, "--input", &input, "--output", &run, "--quiet"]);
        succeeds(&["view", &panda, &run, "-o", &html]);
        let (text, data) = page(&html);
        assert!(text.len() < 400_000, "{} bytes", text.len());
        assert_eq!((data["rows"].as_u64(), names(&data["bodies"], "joint").len()), (Some(151), 7));
        let titles = names(&data["charts"], "title");
        assert!(titles.starts_with(&["Coordinates", "Joint torques", "Errors of tracking"]), "{titles:?}");
        assert_eq!(names(&data["arrows"], "group"), ["joint torques"; 7]);
        pages.push(data);
    }
    let [csv, json, parquet] = &pages[..] else { panic!("three formats") };
    for key in ["poses", "times", "columns", "charts"] {
        assert_eq!(csv[key], parquet[key], "{key}");
    }
    // an object of JSON has its columns in another order, and its numbers are read to their last digit but one
    let titles = |page: &serde_json::Value| -> Vec<String> {
        names(&page["charts"], "title").iter().map(ToString::to_string).collect()
    };
    assert_eq!((titles(csv), &csv["ground"], &csv["rows"]), (titles(json), &json["ground"], &json["rows"]));
}

#[test]
fn a_prescribed_motion_is_analysed_and_its_figures_are_drawn_as_well() {
    let here = scratch("reach");
    let (panda, motion) =
        (format!("{ROBOTS}/descriptions/panda.urdf"), format!("{ROBOTS}/experiments/panda_reach.toml"));
    let [figures, one, other] =
        ["reach.csv", "one.html", "other.html"].map(|name| here.join(name).display().to_string());
    succeeds(&["view", &panda, &motion, "-o", &one]);
    // the same by way of a file, where knots of the motion have two rows of one time
    succeeds(&["analyze", &panda, "--motion", &motion, "--interval", "0.01", "--output", &figures]);
    succeeds(&["view", &panda, &figures, "-o", &other]);
    let [one, other] = [one, other].map(|path| page(&path).1);
    let groups = names(&one["arrows"], "group");
    for (group, count) in [("forces carried", 7), ("moments carried", 7), ("joint torques", 7)] {
        assert_eq!(groups.iter().filter(|g| **g == group).count(), count, "{group}");
    }
    for key in ["poses", "times", "columns", "charts"] {
        assert_eq!(one[key], other[key], "{key}");
    }
}

/// `simulate`, `analyze`, `residuals` and `report` draw what `view` makes of the files that they write.
#[test]
fn other_commands_draw_what_view_draws_of_what_they_write() {
    let here = scratch("others");
    let panda = format!("{ROBOTS}/descriptions/panda.urdf");
    let experiment = |name: &str| format!("{ROBOTS}/experiments/{name}.toml");
    let file = |name: &str| here.join(name).display().to_string();
    let (track, reach) = (experiment("panda_track"), experiment("panda_reach"));
    let run = file("simulate.csv");
    let commands: [&[&str]; 3] = [
        &["simulate", &panda, "--input", &track],
        &["analyze", &panda, "--motion", &reach, "--interval", "0.01"],
        &["residuals", &panda, &run],
    ];
    for arguments in commands {
        let name = arguments[0];
        let [table, drawn, viewed] = ["csv", "html", "view.html"].map(|end| file(&format!("{name}.{end}")));
        succeeds(&[arguments, &["--output", &table, "--view", &drawn]].concat());
        succeeds(&["view", &panda, &table, "-o", &viewed]);
        let [drawn, viewed] = [drawn, viewed].map(|path| page(&path).1);
        for key in ["poses", "times", "columns", "charts", "arrows", "notes"] {
            assert_eq!(drawn[key], viewed[key], "{name}: {key}");
        }
        assert!(drawn["rows"].as_u64() > Some(100), "{name}");
    }
    let [drawn, viewed] = [file("report.html"), file("tour.html")];
    succeeds(&["report", &panda, "--function", "gravity_force", "--view", &drawn]);
    succeeds(&["view", &panda, "-o", &viewed]);
    assert_eq!(fs::read_to_string(drawn).unwrap(), fs::read_to_string(viewed).unwrap());
}

#[test]
fn without_a_run_joints_move_in_turn_and_a_base_may_float() {
    let here = scratch("tour");
    let html = here.join("solo12.html").display().to_string();
    succeeds(&["view", &format!("{ROBOTS}/descriptions/solo12.urdf"), "--floating-base", "-o", &html]);
    let (text, data) = page(&html);
    assert!(
        text.len() < 400_000 && data["base"] == 0 && data["notes"][0].as_str().unwrap().starts_with("No run was given")
    );
    assert!(data["facts"].to_string().contains("solo12.urdf"), "{}", data["facts"]);
    // the text does not depend on where it is written
    let again = here.join("again.html").display().to_string();
    succeeds(&["view", &format!("{ROBOTS}/descriptions/solo12.urdf"), "--floating-base", "-o", &again]);
    assert_eq!(text, fs::read_to_string(again).unwrap());
}

#[test]
fn a_run_of_another_robot_is_refused_with_all_that_is_missing() {
    let here = scratch("refused");
    let robot = format!("{ROBOTS}/descriptions/planar2r.urdf");
    let run = here.join("run.csv");
    fs::write(&run, "t,q.elbow_joint,q.wrist\n0,0.1,0.2\n0.5,0.3,0.4\n").unwrap();
    let html = here.join("page.html").display().to_string();
    let said = fails(&["view", &robot, &run.display().to_string(), "-o", &html]);
    assert_eq!(said.matches("there is no column `q.").count(), 1, "all of them at once: {said}");
    assert!(said.contains("run.csv: ") && said.contains("the columns are `t`, "), "{said}");
    assert!(!Path::new(&html).exists(), "nothing is written");
    fs::write(&run, "t,q.a\n0,0.1\n0.5,x\n").unwrap();
    let said = fails(&["view", &robot, &run.display().to_string(), "-o", &html]);
    assert!(said.contains("run.csv:3") && said.contains('x'), "{said}");
}

#[test]
fn what_loops_determine_is_solved_for_where_the_run_leaves_it_out() {
    let here = scratch("loops");
    let robot = format!("{}/../tests/files/fourbar.toml", env!("CARGO_MANIFEST_DIR"));
    let run = write(&here, "t,q.crank\n0,0\n0.2,0.4\n0.4,0.9\n0.6,1.3\n");
    let html = here.join("page.html").display().to_string();
    succeeds(&["view", &robot, &run, "-o", &html, "--quiet"]);
    let solved = page(&html).1;
    assert_eq!(solved["notes"][0], "What loops determine is not in the run: it was solved for.");
    // a crank that goes too far in one row cannot take the others along
    let run = write(&here, "t,q.crank\n0,0\n0.2,1e300\n");
    let said = fails(&["view", &robot, &run, "-o", &html, "--quiet"]);
    assert!(said.contains("at t = 0.2 s the loops of fourbar cannot be closed"), "{said}");
}

fn write(folder: &Path, text: &str) -> String {
    let path = folder.join("run.csv");
    fs::write(&path, text).unwrap();
    path.display().to_string()
}
