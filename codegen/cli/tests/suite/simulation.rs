//! The commands `simulate` and `analyze` as a person uses them.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const ROBOTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots");

fn scratch(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("simulation").join(name);
    fs::create_dir_all(&path).unwrap();
    path
}

fn straightline(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_straightline")).args(arguments).output().unwrap()
}

fn succeeds(arguments: &[&str]) -> String {
    let output = straightline(arguments);
    assert!(output.status.success(), "{arguments:?}\n{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// What is said on standard error; the exit code says that the input is wrong.
fn fails(arguments: &[&str]) -> String {
    let output = straightline(arguments);
    assert_eq!(output.status.code(), Some(1), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

fn write(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    fs::write(&path, text).unwrap();
    path.display().to_string()
}

#[test]
fn every_example_runs() {
    let here = scratch("examples");
    let panda = format!("{ROBOTS}/descriptions/panda.urdf");
    let example = |name: &str| format!("{ROBOTS}/experiments/{name}");
    let (csv, svg) = (here.join("track.csv"), here.join("track.svg"));
    let (csv_path, svg_path) = (csv.display().to_string(), svg.display().to_string());
    let said = succeeds(&[
        "simulate",
        &panda,
        "--input",
        &example("panda_track.toml"),
        "--output",
        &csv_path,
        "--svg",
        &svg_path,
    ]);
    assert!(said.contains("1.5 s, ") && said.contains("missing "), "{said}");
    let rows = fs::read_to_string(&csv).unwrap();
    assert!(rows.starts_with("t,q.panda_joint1,") && rows.lines().count() == 152, "{}", rows.lines().count());
    let header: Vec<&str> = rows.lines().next().unwrap().split(',').collect();
    let errors: Vec<usize> = (0..header.len()).filter(|k| header[*k].starts_with("error.")).collect();
    // the model is exact; at 1 kHz forces are held for a millisecond
    for row in rows.lines().skip(1) {
        let row: Vec<f64> = row.split(',').map(|x| x.parse().unwrap()).collect();
        assert!(errors.iter().all(|k| row[*k].abs() < 2e-3), "{row:?}");
    }
    assert!(fs::read_to_string(svg).unwrap().contains("tracking errors"));

    let (html, json) = (here.join("reach.html"), here.join("reach.json"));
    let said = succeeds(&[
        "analyze",
        &panda,
        "--motion",
        &example("panda_reach.toml"),
        "--html",
        &html.display().to_string(),
        "--output",
        &json.display().to_string(),
        "--sweep",
        "panda_link7.mass=0.5:3:4",
        "--interval",
        "0.02",
    ]);
    assert!(said.contains("panda_joint2") && said.contains("within all limits"), "{said}");
    // 1.3333333333333335 and 2.166666666666667 would stand in the next column
    let is_row = |l: &&str| ["0.5 ", "1.33333 ", "2.16667 ", "3 "].iter().any(|value| l.starts_with(value));
    assert_eq!(said.lines().filter(is_row).count(), 4, "{said}");
    assert!(said.contains("  panda_joint1 [N·m]  panda_joint2 [N·m]"), "columns of a sweep have names: {said}");
    let page = fs::read_to_string(html).unwrap();
    assert!(page.contains("<svg") && page.contains("Peak torques over panda_link7.mass") && !page.contains("<script"));
    assert!(
        page.contains("<td class=\"l\">1.33333</td>")
            && page.contains("<th>peak panda_joint2 [N·m]</th>")
            && page.contains("prefers-color-scheme: dark")
    );
    roxmltree::Document::parse_with_options(&page, roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() })
        .expect("the page is well-formed XML");
    // a card per joint, and numbers with units and four significant digits
    assert_eq!(page.matches("<section class=\"card\">").count(), 7 + 1);
    let cells: Vec<&str> = page.split("<td>").skip(1).filter_map(|cell| cell.split("</td>").next()).collect();
    for cell in cells.iter().filter(|cell| cell.ends_with(" N·m") || cell.ends_with(" W")) {
        let digits = cell.split(['e', ' ']).next().unwrap().chars().filter(char::is_ascii_digit).collect::<String>();
        let significant = digits.trim_start_matches('0');
        assert!(significant.len() == 4 || digits == "0" || significant.len() > 4, "{cell}");
    }
    // the axis of time ends where the motion ends
    let duration = said.lines().find_map(|l| l.split(": ").nth(1)?.split(" s,").next()?.parse::<f64>().ok()).unwrap();
    let end = straightline_simulation::html::four_digits(duration);
    let end = end.trim_end_matches('0').trim_end_matches('.');
    assert!(page.contains(&format!(">{end} s</text>")), "{duration}");
    let columns: serde_json::Value = serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    assert_eq!(columns["t"].as_array().unwrap().len(), columns["moment.panda_joint7.z"].as_array().unwrap().len());
}

#[test]
fn what_a_simulation_writes_an_analysis_reads() {
    let here = scratch("round");
    let robot = format!("{ROBOTS}/descriptions/planar_2r.toml");
    let names: Vec<String> = {
        let json = here.join("free.json").display().to_string();
        let input = write(
            &here,
            "free.toml",
            "[start]\nq = [0.3, -0.2]\n[simulation]\nduration = 0.3\nstop_at_limits = false\n",
        );
        succeeds(&["simulate", &robot, "--input", &input, "--output", &json]);
        let table: serde_json::Value = serde_json::from_str(&fs::read_to_string(&json).unwrap()).unwrap();
        table.as_object().unwrap().keys().cloned().collect()
    };
    assert!(names.contains(&"t".to_string()) && names.contains(&"energy".to_string()));
    let csv = here.join("free.csv").display().to_string();
    let input = here.join("free.toml").display().to_string();
    succeeds(&["simulate", &robot, "--input", &input, "--output", &csv]);
    // nothing drove it, so that an analysis of the motion finds no torque, up to the splines between samples
    let said = succeeds(&["analyze", &robot, "--motion", &csv]);
    assert!(said.contains("0.3 s"), "{said}");
}

#[test]
fn drives_run_on_voltages_currents_and_a_controller() {
    let here = scratch("drives");
    let robot = format!("{ROBOTS}/descriptions/planar_2r.toml");
    let scene = |name: &str| format!("{ROBOTS}/scenes/planar_2r_{name}.toml");
    let csv = here.join("run.csv").display().to_string();
    let column = |name: &str| -> Vec<f64> {
        let text = fs::read_to_string(&csv).unwrap();
        let mut rows = text.lines();
        let k = rows.next().unwrap().split(',').position(|n| n == name).unwrap_or_else(|| panic!("{name}: {text}"));
        rows.map(|row| row.split(',').nth(k).unwrap().parse().unwrap()).collect()
    };
    let missing = |said: &str| -> f64 {
        let line = said.lines().find(|l| l.starts_with("missing ")).unwrap_or_else(|| panic!("{said}"));
        line.split_whitespace().nth(2).unwrap().parse().unwrap()
    };
    // the second drive follows a current; limits of the scene hold
    let samples = write(&here, "inputs.csv", "t,u.joint1,i.joint2\n0,0,0\n0.1,40,2\n0.3,-10,-2\n");
    let said = succeeds(&["simulate", &robot, "--scene", &scene("drives"), "--input", &samples, "--output", &csv]);
    assert!(said.contains("electrical input ") && missing(&said) < 1e-9, "{said}");
    assert!(column("u.joint1").iter().all(|u| u.abs() <= 24.0 + 1e-9) && column("i.joint1").iter().any(|i| *i > 5.9));
    assert!((column("i.joint2")[10] - 2.0).abs() < 1e-9, "{:?}", column("i.joint2"));
    for name in ["drives", "elastic"] {
        let example = format!("{ROBOTS}/experiments/planar_2r_drives.toml");
        let said = succeeds(&["simulate", &robot, "--scene", &scene(name), "--input", &example, "--output", &csv]);
        assert!(missing(&said) < 1e-6, "{said}");
        // the model is exact; dampers, which feed-forward leaves out, and gears near rest leave something
        let errors = ["error.joint1", "error.joint2"].map(&column);
        let worst = errors.iter().flatten().fold(0.0f64, |w, e| w.max(e.abs()));
        assert!(worst < 5e-3, "{name}: {worst}");
    }
    let (html, example) = (here.join("drives.html"), format!("{ROBOTS}/experiments/planar_2r_drives.toml"));
    let page = html.display().to_string();
    let motors = scene("drives");
    let said = succeeds(&[
        "analyze",
        &robot,
        "--scene",
        &motors,
        "--motion",
        &example,
        "--html",
        &page,
        "--output",
        &csv,
        "--interval",
        "0.01",
    ]);
    assert!(said.contains("settled [°C]") && said.contains("within all limits") && !said.contains("jumps"), "{said}");
    assert!(fs::read_to_string(&html).unwrap().contains("what voltage and current allow"));
    assert_eq!(column("electrical.joint2").len(), column("winding.joint1").len());
    let wrong = |text: &str| {
        fails(&["simulate", &robot, "--scene", &scene("drives"), "--input", &write(&here, "w.toml", text)])
    };
    assert!(wrong("[inputs]\nfile = \"none.csv\"\n").contains("w.toml:2:8"));
    assert!(wrong("[start]\nx = [0.0]\n").contains("1 numbers for the 6 states"));
    let samples = |text: &str| write(&here, "wrong.csv", text);
    for (text, words) in
        [("t,u.joint3\n0,1\n1,1\n", "no drive"), ("t,u.joint1,i.joint1\n0,1,1\n1,1,1\n", "two columns")]
    {
        let said = fails(&["simulate", &robot, "--scene", &scene("drives"), "--input", &samples(text)]);
        assert!(said.contains(words) && said.contains("wrong.csv:1"), "{said}");
    }
    let undriven = write(&here, "undriven.toml", "[inputs]\nfile = \"inputs.csv\"\n");
    assert!(fails(&["simulate", &robot, "--input", &undriven]).contains("the robot has none"));
}

#[test]
fn the_best_mass_of_a_counterweight_is_found() {
    let here = scratch("optimum");
    // a beam on a pivot, 2 kg at 0.3 m, and a weight at −0.2 m: at rest everywhere with 3 kg
    let robot = write(
        &here,
        "beam.toml",
        "[robot]\nname = \"beam\"\n[[link]]\nname = \"post\"\n[[link]]\nname = \"beam\"\nmass = 2.0\n\
         com = [0.3, 0.0, 0.0]\ninertia = [0.01, 0.02, 0.02]\n[[link]]\nname = \"weight\"\nmass = 1.0\n\
         com = [0.0, 0.0, 0.0]\ninertia = [0.001, 0.001, 0.001]\n[[joint]]\nname = \"pivot\"\nkind = \"continuous\"\n\
         parent = \"post\"\nchild = \"beam\"\naxis = \"y\"\n[[joint]]\nname = \"bolt\"\nkind = \"fixed\"\n\
         parent = \"beam\"\nchild = \"weight\"\norigin = { xyz = [-0.2, 0.0, 0.0] }\n",
    );
    // slowly, so that weight is all that counts
    let motion = write(&here, "slow.csv", "t,pivot\n0,-0.5\n500,0.5\n1000,-0.2\n");
    let said = succeeds(&[
        "analyze",
        &robot,
        "--motion",
        &motion,
        "--interval",
        "20",
        "--optimize",
        "weight.mass=0.5:6",
        "--minimize",
        "peak",
    ]);
    let line = said.lines().find(|l| l.contains("weight.mass = ")).unwrap_or_else(|| panic!("{said}"));
    let value: f64 = line.split_whitespace().nth(2).unwrap().parse().unwrap();
    assert!((value - 3.0).abs() < 1e-3, "{said}");
    // a smooth objective: along the gradient at once
    let rms = ["analyze", &robot, "--motion", &motion, "--interval", "20", "--optimize", "weight.mass=0.5:6"];
    let said = succeeds(&[&rms[..], &["--minimize", "rms"]].concat());
    let line = said.lines().find(|l| l.contains("weight.mass = ")).unwrap_or_else(|| panic!("{said}"));
    let value: f64 = line.split_whitespace().nth(2).unwrap().parse().unwrap();
    assert!((value - 3.0).abs() < 1e-3, "{said}");
    let words: Vec<&str> = said.lines().find(|l| l.starts_with("best values")).unwrap().split_whitespace().collect();
    assert!((3..1000).contains(&words[3].parse::<u32>().unwrap()), "{said}");
    let said = fails(&["analyze", &robot, "--motion", &motion, "--optimize", "weight.mas=0.5:6"]);
    assert!(said.contains("`weight.mas`"), "{said}");
    let said = fails(&["analyze", &robot, "--motion", &motion, "--optimize", "weight.mass=-1:6"]);
    assert!(said.contains("negative"), "{said}");
}

#[test]
fn everything_that_is_wrong_has_its_place() {
    let here = scratch("wrong");
    let robot = format!("{ROBOTS}/descriptions/planar_2r.toml");
    let solo = format!("{ROBOTS}/descriptions/solo12.urdf");
    let toml = |text: &str| write(&here, "wrong.toml", text);
    let two_points = "[[motion.point]]\nt = 0.0\nq = [0.0, 0.0]\n[[motion.point]]\nt = 1.0\nq = [1.0, 0.5]\n";
    for (text, place, words) in [
        ("[motions]\n", "wrong.toml:1:2", "motion"),
        ("[motion]\nkind = \"quintik\"\n", "wrong.toml:2:8", "did you mean `quintic`"),
        ("[motion]\nkind = \"cubic\"\n", "wrong.toml:1", "two points"),
        (&format!("[motion]\nkind = \"trapezoidal\"\n{two_points}"), "wrong.toml:4:1", "has no key `t`"),
        (&format!("[motion]\nkind = \"cubic\"\nframe = \"tipp\"\n{two_points}"), "wrong.toml:3:9", "tip"),
        (
            &format!("[motion]\nkind = \"cubic\"\n{}", two_points.replace("1.0\nq", "-1.0\nq")),
            "wrong.toml:1",
            "point 2",
        ),
        (
            &format!("[motion]\nkind = \"cubic\"\n{}", two_points.replace("[1.0, 0.5]", "[1.0]")),
            "wrong.toml:8:5",
            "1 numbers for 2",
        ),
        ("[controller]\nstiffness = 1\ndamping = 1\n", "wrong.toml:1", "[motion]"),
        ("[simulation]\nduration = -1.0\n", "wrong.toml:2:12", "-1.0"),
        ("[simulation]\nmethod = \"euler\"\n", "wrong.toml:2:10", "adaptive"),
        ("[torques]\nfile = \"none.csv\"\n", "wrong.toml:2:8", "none.csv"),
        ("[start]\nq = [0.0]\n", "wrong.toml:2:5", "1 numbers for 2"),
    ] {
        let said = fails(&["simulate", &robot, "--input", &toml(text)]);
        assert!(said.contains(place) && said.contains(words), "{text}\n{said}");
    }
    for (name, text, place, words) in [
        ("a.csv", "t,joint2\n0,1\n1,x\n", "a.csv:3", "`x`"),
        ("a.csv", "time,joint2\n0,1\n", "a.csv:1", "`t`"),
        ("a.csv", "t,joint2x\n0,1\n1,2\n", "a.csv:1", "joint2x"),
        ("a.csv", "t,joint2\n1,1\n0,2\n", "a.csv:3", "does not come after"),
        ("a.csv", "t,joint2\n0,1,2\n", "a.csv:2", "samples cannot be read"),
        ("a.json", "{\"t\": [0, 1], \"joint2\": [1]}", "a.json:1", "the first array 1"),
        ("a.json", "{\"t\": [0, 1],\n \"joint2\"}", "a.json:2", "samples cannot be read"),
    ] {
        let said = fails(&["simulate", &robot, "--input", &write(&here, name, text)]);
        assert!(said.contains(place) && said.contains(words), "{text}\n{said}");
    }
    let motion = toml(&format!("[motion]\nkind = \"cubic\"\n{two_points}"));
    let said = fails(&["analyze", &solo, "--floating-base", "--motion", &motion]);
    assert!(said.contains("fixed base") && said.contains("wrong.toml:1"), "{said}");
    let said = fails(&["analyze", &robot, "--motion", &motion, "--sweep", "forarm.mass=1,2"]);
    assert!(said.contains("no value `mass` of `forarm`"), "{said}");
    assert!(fails(&["analyze", &robot, "--motion", &toml("[start]\nq = [0.0, 0.0]\n")]).contains("no motion"));
}

/// An example of a UR5 in contact: what is printed, and the table.
fn ur5_in_contact(name: &str) -> (String, Vec<String>, Vec<Vec<f64>>) {
    let here = scratch("contact");
    let (csv, svg) = (here.join(format!("{name}.csv")), here.join(format!("{name}.svg")));
    let said = succeeds(&[
        "simulate",
        &format!("{ROBOTS}/descriptions/ur5.urdf"),
        "--scene",
        &format!("{ROBOTS}/scenes/ur5_contact_tasks.toml"),
        "--input",
        &format!("{ROBOTS}/experiments/ur5_{name}.toml"),
        "--output",
        &csv.display().to_string(),
        "--svg",
        &svg.display().to_string(),
    ]);
    let drawing = fs::read_to_string(svg).unwrap();
    assert!(["distance s", "reaction F", "energies"].iter().all(|title| drawing.contains(title)), "{name}");
    // 1e-9 per step is asked for
    let missing: f64 = said.rsplit_once("missing ").unwrap().1.split(',').next().unwrap().parse().unwrap();
    assert!(missing.abs() < 1e-8, "{said}");
    let rows = fs::read_to_string(csv).unwrap();
    let names = rows.lines().next().unwrap().split(',').map(str::to_string).collect();
    let numbers = |row: &str| row.split(',').map(|x| x.parse().unwrap()).collect();
    (said, names, rows.lines().skip(1).map(numbers).collect())
}

fn column(names: &[String], rows: &[Vec<f64>], name: &str) -> Vec<f64> {
    let k = names.iter().position(|n| n == name).unwrap_or_else(|| panic!("{name} in {names:?}"));
    rows.iter().map(|row| row[k]).collect()
}

#[test]
fn four_tasks_go_from_approach_to_lift_off() {
    let (said, names, rows) = ur5_in_contact("writing");
    assert!(said.contains("pen  touches") && said.contains("pen  lifts off"), "{said}");
    let (s, f, t) = (column(&names, &rows, "s.pen"), column(&names, &rows, "F.pen.pz"), column(&names, &rows, "t"));
    let friction = column(&names, &rows, "friction.pen");
    for k in 0..t.len() {
        let writes = t[k] > 0.4 && t[k] < 2.55;
        assert!(if writes { s[k].abs() < 1e-12 && f[k] > 1.0 } else { s[k] > -1e-12 || f[k] > 0.0 }, "{}", t[k]);
        // it slides: friction is all that μ = 0.2 allows, above its speed of 5 mm/s
        assert!(friction[k] <= 0.2 * f[k] + 1e-9, "{}", t[k]);
    }
    let (said, names, rows) = ur5_in_contact("peg_in_hole");
    assert!(said.contains("peg  touches") && said.contains("peg  lifts off"), "{said}");
    let depth = column(&names, &rows, "s.peg").into_iter().fold(0.0, f64::min);
    assert!((-0.05..-0.035).contains(&depth), "{depth}");
    let (said, names, rows) = ur5_in_contact("pressing");
    assert!(said.contains("wall  touches") && said.contains("wall  lifts off"), "{said}");
    // in the middle, where it hardly moves, the spring carries the reaction
    let (s, f, t) = (column(&names, &rows, "s.wall"), column(&names, &rows, "F.wall.pz"), column(&names, &rows, "t"));
    let k = t.iter().position(|t| *t >= 1.0).unwrap();
    assert!((f[k] + 2e4 * s[k]).abs() < 0.02 * f[k], "{} N at {} m", f[k], s[k]);
    let (said, ..) = ur5_in_contact("hammering");
    assert_eq!(said.matches("nail  touches, impulse 0.000e0").count(), 4, "a spring in front: no impact\n{said}");
}

#[test]
fn a_contact_that_an_experiment_says_wrongly_has_its_place() {
    let here = scratch("contact_wrong");
    let robot = format!("{ROBOTS}/descriptions/planar_2r.toml");
    let scene = write(
        &here,
        "scene.toml",
        "[[contact]]\nname = \"belt\"\nframe = \"tip\"\nobject = \"input\"\nconstrained = [\"pz\"]\n\
         environment = { kind = \"elastic\", parameters = \"input\" }\n",
    );
    let belt = "[[contact]]\nname = \"belt\"\nobject = { origin = [0.0, 0.0, -2.0], velocity = [0.1, 0.0, 0.0] }\n";
    let elastic = "environment = { stiffness = 1e3, damping = 2.0 }\n";
    for (text, place, words) in [
        ("[simulation]\nduration = 0.1\n".to_string(), "wrong.toml:1", "leaves its object open"),
        (belt.to_string(), "wrong.toml:1", "leaves its environment open"),
        (format!("{belt}{elastic}axis = [0, 0, 1]\n"), "wrong.toml:5", "leave `axis` out"),
        (format!("{belt}{elastic}restitution = 1.5\n"), "wrong.toml:5", "1.5"),
        (format!("{belt}{elastic}{belt}"), "wrong.toml:6", "second table"),
        (belt.replace("belt", "bell") + elastic, "wrong.toml:2", "did you mean `belt`"),
        (belt.replace("velocity", "speed") + elastic, "wrong.toml:3", "speed"),
        (format!("{belt}environment = {{ stiffness = 1e3 }}\n"), "wrong.toml:4", "damping"),
        (format!("[contacts]\nactive = [\"bolt\"]\n{belt}{elastic}"), "wrong.toml:2", "bolt"),
    ] {
        let said = fails(&["simulate", &robot, "--scene", &scene, "--input", &write(&here, "wrong.toml", &text)]);
        assert!(said.contains(place) && said.contains(words), "{text}\n{said}");
    }
    let right = write(&here, "right.toml", &format!("{belt}{elastic}[simulation]\nduration = 0.1\n"));
    succeeds(&["simulate", &robot, "--scene", &scene, "--input", &right]);
}

#[test]
fn a_flexible_arm_swings_and_its_energy_is_accounted_for() {
    let here = scratch("flexible");
    let robot = format!("{ROBOTS}/descriptions/flexible_arm.toml");
    let csv = here.join("swing.csv").display().to_string();
    let example = format!("{ROBOTS}/experiments/flexible_arm_swing.toml");
    let said = succeeds(&["simulate", &robot, "--input", &example, "--output", &csv]);
    let line = said.lines().find(|l| l.starts_with("missing ")).unwrap_or_else(|| panic!("{said}"));
    assert!(line.split_whitespace().nth(2).unwrap().parse::<f64>().unwrap() < 1e-6, "{said}");
    let text = fs::read_to_string(&csv).unwrap();
    let names: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let column = |name: &str| -> Vec<f64> {
        let k = names.iter().position(|n| *n == name).unwrap_or_else(|| panic!("{name}"));
        text.lines().skip(1).map(|row| row.split(',').nth(k).unwrap().parse().unwrap()).collect()
    };
    // nothing acts on elastic joints but their springs, and these bend
    assert!(column("tau.forearm_bend_y1").iter().all(|tau| *tau == 0.0));
    assert!(column("q.forearm_bend_y1").iter().any(|q| q.abs() > 1e-4));
    let (errors, free) = (column("error.elbow"), column("tau.elbow"));
    assert!(errors.iter().all(|e| e.abs() < 0.1) && free.iter().any(|tau| tau.abs() > 0.5), "{errors:?}");
    // an analysis says what the straight links would have to bear, without limits of theirs
    let said = succeeds(&["analyze", &robot, "--motion", &example]);
    assert!(said.contains("forearm_bend_y1") && said.contains("within all limits"), "{said}");
}

#[test]
fn a_joint_that_feels_no_inertia_cannot_be_simulated() {
    let here = scratch("no_inertia");
    let text = "[robot]\nname = \"arm\"\n[[link]]\nname = \"base\"\n[[link]]\nname = \"upper\"\nmass = 2.0\ncom = [0.1, 0.0, 0.2]\n\
                inertia = [0.02, 0.021, 0.004]\n[[link]]\nname = \"empty\"\n[[joint]]\nname = \"shoulder\"\nkind = \"continuous\"\n\
                parent = \"base\"\nchild = \"upper\"\naxis = \"y\"\n[[joint]]\nname = \"elbow\"\nkind = \"continuous\"\nparent = \"upper\"\n\
                child = \"empty\"\norigin = { xyz = [0.1, 0.0, 0.4] }\naxis = \"x\"\n";
    let input = write(&here, "fall.toml", "[start]\nq = [0.1, 0.2]\n[simulation]\nduration = 0.1\n");
    let said = fails(&["simulate", &write(&here, "arm.toml", text), "--input", &input]);
    assert!(said.contains("a simulation is asked for, and joint `elbow` feels no inertia"), "{said}");
    let sound = format!("{text}armature = 0.01\n");
    succeeds(&["simulate", &write(&here, "sound.toml", &sound), "--input", &input]);
}

/// Every number of an experiment is of every size: what comes is a result of finite numbers, or an error that says what is wrong; never a
/// panic, and all of it within a bounded number of steps.
#[test]
fn numbers_of_all_sizes_in_an_experiment_end_in_results_or_in_words() {
    let here = scratch("sizes");
    let robot = format!("{ROBOTS}/descriptions/planar_2r.toml");
    let csv = here.join("run.csv").display().to_string();
    // a motion, a controller and a simulation, a number of which is replaced
    let plain: [(&str, &str); 13] = [
        ("t", "0.2"),
        ("q", "0.4"),
        ("speed", "1.0"),
        ("acceleration", "4.0"),
        ("stiffness", "60.0"),
        ("damping", "6.0"),
        ("period", "0.01"),
        ("start", "0.1"),
        ("duration", "0.2"),
        ("interval", "0.05"),
        ("tolerance", "1e-6"),
        ("coulomb_speed", "1e-3"),
        ("max_steps", "2000"),
    ];
    let sizes = ["0.0", "-1.0", "nan", "inf", "1e300", "1e-300", "1e59", "1e-6"];
    let (mut results, mut errors) = (0, 0);
    for (key, _) in plain {
        for size in sizes {
            let of = |wanted: &str| {
                if key == wanted {
                    size
                } else {
                    plain.iter().find(|(key, _)| *key == wanted).unwrap().1
                }
            };
            let kind = if ["speed", "acceleration"].contains(&key) { "trapezoidal" } else { "quintic" };
            let time = |t: &str| if kind == "quintic" { format!("t = {t}\n") } else { String::new() };
            let speeds = match kind {
                "quintic" => String::new(),
                _ => format!("speed = {}\nacceleration = {}\n", of("speed"), of("acceleration")),
            };
            let text = format!(
                "[motion]\nkind = \"{kind}\"\n{speeds}[[motion.point]]\n{}q = [0.1, 0.1]\n[[motion.point]]\n{}q = [0.3, {}]\n\
                 [controller]\ncompensation = \"gravity\"\nstiffness = {}\ndamping = {}\nperiod = {}\n\
                 [start]\nq = [{}, 0.1]\n[simulation]\nduration = {}\ninterval = {}\ntolerance = {}\ncoulomb_speed = {}\n\
                 max_steps = {}\nstop_at_limits = false\n",
                time("0.0"),
                time(of("t")),
                of("q"),
                of("stiffness"),
                of("damping"),
                of("period"),
                of("start"),
                of("duration"),
                of("interval"),
                of("tolerance"),
                of("coulomb_speed"),
                of("max_steps"),
            );
            let input = write(&here, "sizes.toml", &text);
            let of_motion = ["t", "q", "speed", "acceleration"].contains(&key);
            for (command, input_of) in [("simulate", "--input"), ("analyze", "--motion")] {
                if command == "analyze" && !of_motion {
                    continue;
                }
                let output = straightline(&[command, &robot, input_of, &input, "--output", &csv]);
                let (said, wrong) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
                let table = fs::read_to_string(&csv).unwrap_or_default();
                match output.status.code() {
                    Some(0) => {
                        results += 1;
                        let numbers = table.lines().skip(1).flat_map(|l| l.split(','));
                        let bad = numbers.filter(|x| !x.parse::<f64>().is_ok_and(f64::is_finite)).count();
                        assert!(
                            bad == 0 && !said.contains("NaN") && !said.contains("inf"),
                            "{command}\n{text}\n{said}"
                        );
                    }
                    Some(1) => {
                        errors += 1;
                        assert!(wrong.contains("error"), "{command}\n{text}\n{wrong}");
                    }
                    code => panic!("{command} ends with {code:?}\n{text}\n{wrong}"),
                }
                let _ = fs::remove_file(&csv);
            }
        }
    }
    println!("{results} results, {errors} errors");
    assert!(results > 20 && errors > 40, "{results} results, {errors} errors");
}

#[test]
fn what_does_not_end_says_so_and_what_helps() {
    let here = scratch("endless");
    let robot = format!("{ROBOTS}/descriptions/planar_2r.toml");
    let simulated = |text: &str, more: &[&str]| {
        let input = write(&here, "endless.toml", text);
        fails(&[&["simulate", &robot, "--input", &input][..], more].concat())
    };
    let rows = simulated("[simulation]\nduration = 1e6\ninterval = 1e-6\n", &[]);
    assert!(rows.contains("1.0e12 rows") && rows.contains("interval of "), "{rows}");
    let stiff = "[motion]\nkind = \"quintic\"\n[[motion.point]]\nt = 0.0\nq = [0.1, 0.1]\n[[motion.point]]\nt = 9.0\nq = [0.3, 0.4]\n\
        [controller]\nstiffness = 1e12\ndamping = 1e3\n";
    let endless = simulated(stiff, &["--max-steps", "100000"]);
    assert!(endless.contains("method = \"stiff\"") && endless.contains("--max-steps"), "{endless}");
    let few = simulated("[simulation]\nduration = 2.0\nmax_steps = 300\n", &["--max-steps", "100"]);
    assert!(few.contains("2.0e2 rows") && few.contains("at most 100 rows"), "{few}");
    let far = simulated("[start]\nq = [1e8, 0.0]\n", &[]);
    assert!(far.contains("angle-beyond-sines") && far.contains("joint1"), "{far}");
    let slow = "[motion]\nkind = \"trapezoidal\"\nspeed = 2.0\nacceleration = [8.0, 1e-7]\n[[motion.point]]\nq = [0.2, -0.3]\n\
        [[motion.point]]\nq = [0.7, 0.3]\n";
    let motion = write(&here, "slow.toml", slow);
    let search = ["--optimize", "link2.mass=0.1:2", "--minimize", "peak", "--interval", "0.05"];
    let searched = fails(&[&["analyze", &robot, "--motion", &motion][..], &search].concat());
    assert!(searched.contains("97982 instants") && searched.contains("at most 50000"), "{searched}");
}

#[test]
fn numbers_of_drives_are_swept_and_searched() {
    let robot = format!("{ROBOTS}/descriptions/planar_2r.toml");
    let scene = format!("{ROBOTS}/scenes/planar_2r_drives.toml");
    let motion = format!("{ROBOTS}/experiments/planar_2r_drives.toml");
    let analysed = |more: &[&str]| {
        let arguments = ["analyze", &robot, "--scene", &scene, "--motion", &motion, "--interval", "0.02"];
        straightline(&[&arguments[..], more].concat())
    };
    let said = |more: &[&str]| {
        let output = analysed(more);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    // heat over the ratio, and how many limits are exceeded: light gears take current, heavy ones speed up the rotor
    let heat = |values: &str| -> Vec<(f64, f64)> {
        let path = format!("joint1.ratio={values}");
        let said = said(&["--sweep", &path]);
        let rows = said.lines().skip_while(|line| !line.starts_with("joint1.ratio")).skip(1);
        let number = |row: &str, k: usize| row.split_whitespace().nth(k).unwrap().parse().unwrap();
        rows.take(values.split(',').count()).map(|row| (number(row, 4), number(row, 5))).collect()
    };
    let swept = heat("20,156,1500");
    assert!(swept[0].0 > 1.5 * swept[1].0 && swept[2].0 > 0.0, "{swept:?}");
    let found = said(&["--optimize", "joint1.ratio=20:600", "--minimize", "heat"]);
    let best: f64 = {
        let line = found.lines().find(|line| line.trim_start().starts_with("joint1.ratio = ")).unwrap();
        line.split_whitespace().nth(2).unwrap().parse().unwrap()
    };
    let near = heat(&format!("{best},{},{}", 0.9 * best, (1.1 * best).min(600.0)));
    // what is beside it is hotter, or beyond a limit
    assert!(near[1..].iter().all(|(heat, exceeded)| *heat >= near[0].0 * (1.0 - 1e-6) || *exceeded > 0.0), "{near:?}");
    let taken = said(&["--optimize", "joint1.resistance=0.1:0.6", "--minimize", "electrical"]);
    assert!(taken.contains("joint1.resistance = 0.1"), "{taken}");
    let gear = said(&["--optimize", "joint2.efficiency_forward=0.5:0.9", "--minimize", "electrical"]);
    assert!(gear.contains("joint2.efficiency_forward = 0.9"), "{gear}");
    // what no equation of motion has
    let hotter = said(&["--sweep", "joint1.winding_housing=1,3"]);
    assert!(hotter.contains("joint1.winding_housing"), "{hotter}");
    // a number that the drive does not have, and one that it cannot have
    for (path, words) in [
        ("joint1.stiffness=1,2", "drive `joint1` has no value `stiffness`"),
        ("joint1.resistance=-1,2", "not positive"),
    ] {
        let output = analysed(&["--sweep", path]);
        let wrong = String::from_utf8_lossy(&output.stderr).to_string();
        assert!(output.status.code() == Some(1) && wrong.contains(words), "{wrong}");
    }
    let output =
        straightline(&["analyze", &robot, "--motion", &motion, "--optimize", "link1.mass=1:2", "--minimize", "heat"]);
    assert_eq!(output.status.code(), Some(1));
}

#[test]
fn an_analysis_says_what_would_keep_a_limit() {
    let here = scratch("advice");
    let robot = format!("{ROBOTS}/descriptions/planar_2r.toml");
    let scene = format!("{ROBOTS}/scenes/planar_2r_drives.toml");
    let of = |duration: f64| {
        let text = format!(
            "[motion]\nkind = \"smooth\"\n[[motion.point]]\nt = 0.0\nq = [0.0, 0.0]\n[[motion.point]]\nt = {duration}\nq = [1.6, -1.2]\n"
        );
        let motion = write(&here, "fast.toml", &text);
        succeeds(&["analyze", &robot, "--scene", &scene, "--motion", &motion])
    };
    let said = of(0.4);
    // of all that is exceeded, what asks for most time
    let of_line = |line: &str| -> Option<(f64, String)> {
        let times = line.split(" the motion ").nth(1)?.split_whitespace().next()?.parse().ok()?;
        let limit = line.split(" s: ").nth(1)?.split(" leaves").next()?;
        Some((times, format!("{limit} leaves")))
    };
    let advised = said.lines().filter(|line| line.contains("each by itself would keep it")).filter_map(of_line);
    let (times, limit) = advised.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_else(|| panic!("{said}"));
    assert!(times > 1.2 && !of(0.4 * times).contains(&limit), "{times} {limit}");
    assert!(of(0.4 * (1.0 + 0.9 * (times - 1.0))).contains(&limit), "{times} {limit}");
    // what is friction is said, and nothing else is called so
    assert!(said.contains("friction in the joints takes ") && !said.contains("the rest is friction"), "{said}");
}

/// What `analyze` proposes follows the motion, in its own trial and when the file that it writes drives a simulation.
#[test]
fn gains_that_an_analysis_proposes_drive_a_simulation() {
    let here = scratch("gains");
    let (robot, motion) = (format!("{ROBOTS}/descriptions/ur5.urdf"), format!("{ROBOTS}/experiments/ur5_gains.toml"));
    let (gains, html) = (here.join("gains.csv").display().to_string(), here.join("gains.html").display().to_string());
    let options = ["--angle-tolerance", "1e-11"];
    let said = succeeds(
        &[&["analyze", &robot, "--motion", &motion, "--gains", &gains, "--html", &html][..], &options].concat(),
    );
    assert!(said.contains("a delay of one period") && !said.contains("unstable"), "{said}");
    // errors: greatest and rms, of torques alone, of gains per joint, of LQR
    let errors = said.split("torques alone: most").nth(1).unwrap();
    for joint in ["shoulder_lift_joint", "elbow_joint", "wrist_3_joint"] {
        let line = errors.lines().find(|line| line.starts_with(joint)).unwrap();
        let numbers: Vec<f64> = line.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        let [alone, per_joint, lqr] = [1, 3, 5].map(|k| numbers[k]);
        assert!(per_joint < 0.5 * alone && lqr < 0.5 * alone, "{line}");
    }
    let page = fs::read_to_string(&html).unwrap();
    assert!(page.contains("Feedback gains") && page.contains("error, LQR"));
    let text = fs::read_to_string(&motion).unwrap();
    let follow = |controller: &str| {
        let head = text.split("[gains]").next().unwrap();
        let start = "[start]\nq = [0.05, -1.2, 1.4, -0.2, 1.2, 0.0]\n[simulation]\nduration = 1.5\n";
        let input = write(&here, "follow.toml", &format!("{head}\n{start}[controller]\n{controller}"));
        let output = here.join("follow.json").display().to_string();
        let run = [&["simulate", &robot, "--input", &input, "--output", &output][..], &options].concat();
        succeeds(&run);
        let columns: serde_json::Value = serde_json::from_str(&fs::read_to_string(&output).unwrap()).unwrap();
        columns["error.shoulder_pan_joint"].as_array().unwrap().last().unwrap().as_f64().unwrap().abs()
    };
    let law = "compensation = \"feed_forward\"\nperiod = 2e-3\ndelay = 1\n";
    assert!(follow(&format!("{law}gains = \"gains.csv\"\n")) < 1e-5);
    // the controller that is printed
    let pasted = said.split("[controller]\n").nth(1).unwrap().split("\n\n").next().unwrap();
    assert!(follow(pasted) < 1e-5);

    let complaint = |controller: &str| {
        let head = text.split("[gains]").next().unwrap();
        let input = write(&here, "wrong.toml", &format!("{head}\n[controller]\n{controller}"));
        fails(&[&["simulate", &robot, "--input", &input][..], &options].concat())
    };
    let both = complaint("gains = \"gains.csv\"\nstiffness = 3.0\nperiod = 1e-3\n");
    assert!(both.contains("controller-and-torques") && both.contains("`gains` and `stiffness`"), "{both}");
    let late = complaint("stiffness = 3.0\ndamping = 1.0\ndelay = 2\n");
    assert!(late.contains("no period") && late.contains("wrong.toml:"), "{late}");
    let half = complaint("stiffness = 3.0\ndamping = 1.0\nperiod = 1e-3\ndelay = 1.5\n");
    assert!(half.contains("whole number of periods"), "{half}");
    let other = write(&here, "other.csv", "t,K.elbow_joint.q.elbow\n0,1\n1,1\n");
    assert!(complaint(&format!("gains = {other:?}\nperiod = 1e-3\n")).contains("is no gain"));
    let gains = write(&here, "none.toml", &text.replace("bandwidth = 4.0", "bandwidth = -4.0"));
    let wrong = fails(&[&["analyze", &robot, "--motion", &gains][..], &options].concat());
    assert!(wrong.contains("bandwidth") && wrong.contains("-4.0"), "{wrong}");
}

/// A four-bar swings with its energy, its pins together; no motion is given to joints that loops determine.
#[test]
fn robots_with_closed_loops_swing_with_their_energy() {
    let here = scratch("closed");
    let text =
        include_str!("../../../tests/files/fourbar.toml").replace("damping = 0.02", "").replace("friction = 0.01", "");
    let robot = write(&here, "fourbar.toml", &text);
    let start = "[start]\nq = [0.4, -0.5, 0.05]\nqd = [3.0]\n[simulation]\nduration = 3.0\ntolerance = 1e-12\n";
    let (start, csv) = (write(&here, "start.toml", start), here.join("swing.csv"));
    succeeds(&["simulate", &robot, "--input", &start, "--output", &csv.display().to_string()]);
    let rows = fs::read_to_string(&csv).unwrap();
    assert!(rows.starts_with("t,q.crank,q.coupler,q.rocker,qd.crank,tau.crank,energy,"), "{rows}");
    let rows: Vec<Vec<f64>> =
        rows.lines().skip(1).map(|row| row.split(',').map(|x| x.parse().unwrap()).collect()).collect();
    let about_y = |angle: f64, [x, z]: [f64; 2]| [x * angle.cos() + z * angle.sin(), z * angle.cos() - x * angle.sin()];
    for row in &rows {
        assert!((row[6] - rows[0][6]).abs() < 1e-9, "{row:?}");
        let coupler = about_y(row[1] + row[2], [0.36, 0.27]);
        let [at_coupler, rocker] = [about_y(row[1], [0.09, 0.12]), about_y(row[3], [-0.05, 0.39])];
        let apart = |k: usize, pivot: f64| at_coupler[k] + coupler[k] - pivot - rocker[k];
        assert!(apart(0, 0.5).abs() < 1e-9 && apart(1, 0.0).abs() < 1e-9, "{row:?}");
    }
    assert!(rows.iter().any(|row| row[1] > 1.0), "it swings");
    let motion = write(&here, "motion.csv", "t,crank,coupler,rocker\n0,0,0,0\n0.5,0,0,0\n1,0,0,0\n");
    let said = fails(&["analyze", &robot, "--motion", &motion]);
    assert!(said.contains("error[determined-moving]") && said.contains("joint `coupler`"), "{said}");
}

/// A joint that begins beyond its range does not leave it; the others do, and end the simulation.
#[test]
fn each_joint_has_a_limit_of_its_own() {
    let folder = scratch("limits");
    let joint = |name: &str, parent: &str, child: &str| {
        format!(
            "[[link]]\nname = \"{child}\"\nmass = 1.0\ninertia = [0.1, 0.1, 0.1]\n[[joint]]\nname = \"{name}\"\nkind = \"revolute\"\n\
             parent = \"{parent}\"\nchild = \"{child}\"\naxis = \"z\"\nlimits = {{ lower = -2.0, upper = 2.0 }}\n"
        )
    };
    let text = format!(
        "[robot]\nname = \"arm\"\n[[link]]\nname = \"base\"\n{}{}",
        joint("j1", "base", "a"),
        joint("j2", "base", "b")
    );
    let robot = write(&folder, "arm.toml", &text);
    let start = "[simulation]\nduration = 2.0\n[start]\nq = [5.0, 1.9]\nqd = [0.0, 3.0]\n";
    let [experiment, output] = [write(&folder, "start.toml", start), folder.join("run.csv").display().to_string()];
    succeeds(&["simulate", &robot, "--input", &experiment, "-o", &output]);
    let run = fs::read_to_string(&output).unwrap();
    let last: Vec<f64> = run.lines().last().unwrap().split(',').map(|x| x.parse().unwrap()).collect();
    assert!((last[0] - 0.1 / 3.0).abs() < 1e-9 && (last[2] - 2.0).abs() < 1e-9, "{last:?}");
}

#[test]
fn rows_and_columns_of_samples_that_are_wrong_have_their_places() {
    let folder = scratch("samples");
    let robot = format!("{ROBOTS}/descriptions/planar_2r.toml");
    for (text, parts) in [
        ("t,joint1\n0,1\n0.2,1\n0.1,1\n", &["time-goes-back", "samples.csv:4:1"][..]),
        ("t,joint1,joint1\n0,1,2\n", &["two columns are called `joint1`"]),
    ] {
        let samples = write(&folder, "samples.csv", text);
        let said = fails(&["simulate", &robot, "--input", &samples]);
        assert!(parts.iter().all(|part| said.contains(part)), "{said}");
    }
}
