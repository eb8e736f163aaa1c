//! Spoilt robot, scene and experiment files through every command of the command line: no panic, no abort, no long silence, every
//! refusal with words, no number that is none, and what is written compiles.
//!
//! Every case is a process of its own, so that one that aborts or does not end is a finding with its files. Cases depend on the seed
//! and their number alone. `cargo test -p straightline-cli --test suite fuzz:: -- --ignored --nocapture` runs 1e5 (`FUZZ_CASES`, `FUZZ_SEED`,
//! `FUZZ_FIRST`, `FUZZ_THREADS`; rustc sees one of `FUZZ_SAMPLE` programs; `FUZZ_ONLY=simulate,analyze` leaves the cases of other commands
//! out); what is found stands under `target/tmp/fuzz`, files, command and output together.

mod mutate;

use mutate::{many_links, spoilt, Random};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Processor time of one case without a word \[s\].
const MOST_SILENCE: f64 = 10.0;
/// Processor time of one case that says how far it is \[s\].
const MOST_SECONDS: f64 = 60.0;
/// Memory of one case \[kB\].
const MOST_MEMORY: u64 = 4_000_000;

/// A real file.
struct Seed {
    name: String,
    text: String,
}

/// Files that commands take together.
#[derive(Default)]
struct Corpus {
    robots: Vec<Seed>,
    /// How many of them are good robots; they come first.
    sound: usize,
    /// How many scenes are good ones; they come first.
    of_robots: usize,
    /// Of the robot of that name, or of any.
    scenes: Vec<(String, Seed)>,
    experiments: Vec<(String, Option<String>, Seed)>,
}

/// Robots of few joints.
const SMALL: usize = 2_000;
/// Robots whose programs take long: of them cheap functions alone.
const LARGE: usize = 5_000;

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn files(folder: &str, endings: &[&str]) -> Vec<Seed> {
    let folder = repository().join(folder);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut paths: Vec<PathBuf> = entries.map(|e| e.expect("an entry").path()).collect();
    paths.sort();
    let is_wanted = |p: &&PathBuf| endings.iter().any(|ending| p.extension().is_some_and(|e| e == *ending));
    let read = |p: &PathBuf| Seed {
        name: p.file_name().expect("a name").to_string_lossy().into_owned(),
        text: String::from_utf8_lossy(&std::fs::read(p).expect("it can be read")).into_owned(),
    };
    paths.iter().filter(is_wanted).map(read).collect()
}

impl Corpus {
    fn new() -> Corpus {
        let mut corpus = Corpus::default();
        for folder in [
            "robots/descriptions",
            "generated_tests/count_robots",
            "generated_tests/reference/joints/robots",
            "codegen/tests/files",
            "codegen/tests/messages",
        ] {
            if folder == "codegen/tests/messages" {
                corpus.sound = corpus.robots.len();
            }
            corpus
                .robots
                .extend(files(folder, &["urdf", "toml", "xml", "sdf"]).into_iter().filter(|f| f.text.len() < 100_000));
        }
        for (folder, robot) in [("robots/scenes", None), ("codegen/tests/scene_messages", Some("arm.toml"))] {
            if robot.is_some() {
                corpus.of_robots = corpus.scenes.len();
            }
            for file in files(folder, &["toml"]) {
                let stem = file.name.split('_').next().expect("a name").to_string();
                let robot = robot.map_or_else(
                    || match stem.as_str() {
                        "planar" => "planar_2r.toml".to_string(),
                        "quadruped" => "solo12.urdf".to_string(),
                        stem => format!("{stem}.urdf"),
                    },
                    str::to_string,
                );
                corpus.scenes.push((robot, file));
            }
        }
        for file in files("robots/experiments", &["toml"]) {
            let (robot, scene) = match file.name.as_str() {
                "planar_2r_drives.toml" => ("planar_2r.toml", Some("planar_2r_elastic.toml")),
                "planar_2r_pressing.toml" => ("planar_2r.toml", Some("planar_2r_pressing.toml")),
                "flexible_arm_swing.toml" => ("flexible_arm.toml", None),
                name if name.starts_with("ur5") => ("ur5.urdf", Some("ur5_contact_tasks.toml")),
                _ => ("panda.urdf", None),
            };
            corpus.experiments.push((robot.to_string(), scene.map(str::to_string), file));
        }
        for (name, text) in SMALL_EXPERIMENTS {
            let seed = Seed { name: name.to_string(), text: text.to_string() };
            corpus.experiments.push(("planar_2r.toml".to_string(), None, seed));
        }
        corpus
    }

    fn robot(&self, name: &str) -> &Seed {
        self.robots.iter().find(|r| r.name == name).unwrap_or(&self.robots[0])
    }
}

/// Experiments that take little time, so that most of it goes into what is spoilt.
const SMALL_EXPERIMENTS: &[(&str, &str)] = &[
    (
        "cubic.toml",
        "[motion]\nkind = \"cubic\"\n[[motion.point]]\nt = 0.0\nq = [0.2, -0.3]\n[[motion.point]]\nt = 0.3\nq = [0.7, 0.3]\n\
         [controller]\ncompensation = \"gravity\"\nstiffness = [40.0, 20.0]\ndamping = 4.0\nperiod = 0.01\n[simulation]\nduration = 0.4\ninterval = 0.02\n",
    ),
    (
        "trapezoidal.toml",
        "[motion]\nkind = \"trapezoidal\"\nspeed = 2.0\nacceleration = [8.0, 9.0]\n[[motion.point]]\nq = [0.2, -0.3]\n[[motion.point]]\nq = [0.7, 0.3]\n\
         [controller]\ncompensation = \"computed_torque\"\nstiffness = 100.0\ndamping = 20.0\nsaturate = true\n[simulation]\ntolerance = 1e-6\nmethod = \"adaptive\"\n",
    ),
    (
        "free.toml",
        "[start]\nq = [0.1, 0.2]\nqd = [0.0, 0.5]\n[simulation]\nduration = 0.2\nmethod = \"stiff\"\ntolerance = 1e-5\nstop_at_limits = false\n",
    ),
    (
        "cartesian.toml",
        "[start]\nq = [0.3, 0.9]\n[motion]\nkind = \"quintic\"\nframe = \"forearm\"\n[[motion.point]]\nt = 0.0\nxyz = [0.3, 0.1, 0.0]\n[[motion.point]]\nt = 0.4\nxyz = [0.35, 0.1, 0.05]\n",
    ),
];

/// A case: its files, and what is done with them.
struct Case {
    files: Vec<(String, String)>,
    arguments: Vec<String>,
}

const FUNCTIONS: &[&str] = &[
    "forward_kinematics",
    "frame_velocity",
    "frame_acceleration",
    "jacobian",
    "jacobian_bias",
    "inverse_dynamics",
    "gravity_force",
    "bias_force",
    "velocity_force",
    "mass_matrix",
    "forward_dynamics",
    "joint_wrenches",
    "energy",
    "centre_of_mass",
    "momentum",
    "kinematics_and_jacobian",
    "driven_forward_dynamics",
    "driven_inverse_dynamics",
    "drive_torques",
    "complete_model",
    "state_space",
    "drive_power",
    "drive_energy",
];

const SWEEPS: &[&str] = &[
    "upper_arm.mass=0.5:3:3",
    "link2.mass=0.5:3:3",
    "forearm.mass=0,1",
    "elbow.damping=1e300,nan",
    "x.mass=1:2:3",
    "elbow.friction=0:1:2",
];

const RANGES: &[&str] = &[
    "upper_arm.mass=0.5:3",
    "forearm.mass=0:1e300",
    "elbow.damping=0:1",
    "link2.mass=1:1",
    "link2.mass=0.1:2",
    "x.mass=1:2",
];

impl Case {
    fn new(corpus: &Corpus, seed: u64, number: u64) -> Case {
        let mut random = Random::new(seed, number);
        let r = &mut random;
        // most are read alone, which takes milliseconds
        let command = match r.below(200) {
            0..=159 => "check",
            160..=183 => "generate",
            184..=188 => "simulate",
            189..=193 => "analyze",
            194..=195 => "report",
            196..=197 => "export",
            _ => "verify",
        };
        let compiles = !matches!(command, "check" | "simulate" | "analyze");
        let moves = matches!(command, "simulate" | "analyze");
        let mut files = Vec::new();
        let mut arguments = vec![command.to_string()];
        let (robot, scene, experiment) = if moves {
            let (all, small) = (corpus.experiments.len(), SMALL_EXPERIMENTS.len());
            let which = if r.percent(85) { all - 1 - r.below(small) } else { r.below(all) };
            let (robot, scene, experiment) = &corpus.experiments[which];
            let scene = scene.as_ref().and_then(|s| corpus.scenes.iter().find(|f| f.1.name == *s)).map(|f| &f.1);
            (corpus.robot(robot), scene, Some(experiment))
        } else if r.percent(45) {
            let count = if r.percent(80) { corpus.of_robots } else { corpus.scenes.len() };
            let mut which = r.below(count);
            // what is compiled is small, as a rule
            while compiles && !corpus.scenes[which].0.starts_with("planar") && !r.percent(3) {
                which = r.below(count);
            }
            let (robot, scene) = &corpus.scenes[which];
            (corpus.robot(robot), Some(scene), None)
        } else {
            // of those that are wrong as they are, not too many
            let count = if r.percent(85) { corpus.sound } else { corpus.robots.len() };
            let mut which = r.below(count);
            while compiles && corpus.robots[which].text.len() > SMALL && !r.percent(3) {
                which = r.below(count);
            }
            (&corpus.robots[which], None, None)
        };
        // which of them is spoilt; now and then none, or all
        let all = r.percent(5);
        let which = r.below(10);
        let present = 1 + usize::from(scene.is_some()) + usize::from(experiment.is_some());
        let mut spoil = |index: usize, file: &Seed, r: &mut Random| {
            let chosen = match (present, which) {
                (1, _) => true,
                (2, 0..=3) => index == 0,
                (2, _) => index != 0,
                _ => index == [0, 0, 0, 1, 1, 2, 2, 2, 2, 2][which],
            };
            let text = if chosen || all { spoilt(&file.text, r) } else { file.text.clone() };
            let prefix = ["robot", "scene", "experiment"][index];
            let name = format!("{prefix}_{}", file.name);
            files.push((name.clone(), text));
            name
        };
        arguments.push(spoil(0, robot, r));
        if let Some(scene) = scene {
            arguments.extend(["--scene".to_string(), spoil(1, scene, r)]);
        }
        if let Some(experiment) = experiment {
            let option = if command == "simulate" { "--input" } else { "--motion" };
            arguments.extend([option.to_string(), spoil(2, experiment, r)]);
        }
        if command == "check" && r.percent(1) {
            files[0] = ("robot_many.urdf".to_string(), many_links(r));
            arguments[1].clone_from(&files[0].0);
        }
        Case::options(command, robot.text.len() > LARGE, &mut arguments, r);
        Case { files, arguments }
    }

    /// What belongs to a command, and options at random.
    fn options(command: &str, is_large: bool, arguments: &mut Vec<String>, r: &mut Random) {
        let mut add = |words: &[&str]| arguments.extend(words.iter().map(|w| w.to_string()));
        match command {
            "export" => {
                add(&["-o", "out_package"]);
                if r.percent(90) {
                    add(&["--c-abi"]);
                }
                if r.percent(20) {
                    add(&["--prefix", r.one(&["a", "_", "fn", "9", "a-b"])]);
                }
            }
            "simulate" => {
                add(&["--output", r.one(&["out.csv", "out.json", "out.parquet"])]);
                if r.percent(30) {
                    add(&["--svg", "out.svg"]);
                }
                // a million steps, which is the default, take minutes
                add(&["--max-steps", r.one(&["0", "1", "1000", "30000", "100000", "100000", "100000"])]);
            }
            "analyze" => {
                match r.percent(50) {
                    true => add(&["--html", "out.html"]),
                    false => add(&["--output", "out.csv"]),
                }
                if r.percent(15) {
                    add(&["--interval", r.one(&["0.001", "0.1", "1000", "1e-6", "nan"])]);
                }
                if r.percent(10) {
                    add(&["--sweep", r.one(SWEEPS)]);
                }
                if r.percent(5) {
                    add(&["--optimize", r.one(RANGES), "--minimize", r.one(&["rms", "energy", "peak", "heat"])]);
                }
            }
            "generate" => add(&["-o", "out.rs"]),
            "report" if r.percent(50) => add(&["--json"]),
            "report" => add(&["--html", "out.html"]),
            "verify" => add(&["--states", "3"]),
            _ => {}
        }
        if r.percent(12) {
            add(&["--floating-base"]);
        }
        if r.percent(8) {
            add(&["--angle-tolerance", r.one(&["0", "1e-4", "0.1", "-1", "x"])]);
        }
        if r.percent(5) {
            add(&["--gravity", r.one(&["0,0,0", "1,2,-3", "nan,0,0", "0,0,1e300", "1e-300,0,0", "1"])]);
        }
        if r.percent(2) {
            add(&["--joint-order", r.one(&["shoulder,elbow", "elbow,shoulder", "a", ","])]);
        }
        if matches!(command, "check" | "simulate" | "analyze") {
            return;
        }
        // few functions, and of large robots cheap ones
        for _ in 0..=r.below(2) {
            let function = if is_large {
                r.one(&["forward_kinematics", "energy", "jacobian", "gravity_force"])
            } else {
                r.one(FUNCTIONS)
            };
            add(&["--function", function]);
        }
        if r.percent(25) {
            add(&["--scalar", r.one(&["f32", "f32", "f64", "f16"])]);
        }
        if r.percent(6) {
            add(&["--rules", r.one(&["exact", "all"])]);
        }
        if r.percent(6) {
            add(&["--lanes", r.one(&["standalone", "runtime"])]);
        }
        if r.percent(4) {
            add(&["--fma"]);
        }
        if r.percent(4) {
            add(&["--generic"]);
        }
        if r.percent(4) && !is_large {
            add(&[r.one(&["--certify", "--certify-state"])]);
        }
        if r.percent(4) {
            add(&["--max-part-operations", r.one(&["100", "1000", "0", "99999999999"])]);
        }
        if r.percent(3) {
            add(&["--limbs", r.one(&["lanes", "apart", "auto", "rolled"])]);
        }
        if r.percent(3) {
            add(&["--frame", r.one(&["forearm", "tool0", "nowhere", ""])]);
        }
    }
}

/// How a case ended.
struct Ending {
    code: Option<i32>,
    stderr: String,
    seconds: f64,
    what: Option<&'static str>,
}

/// Processor time \[s\] and resident memory \[kB\] of a process, where the system tells.
fn used(pid: u32) -> Option<(f64, u64)> {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks: f64 = [11, 12].iter().filter_map(|i| fields.get(*i)?.parse::<f64>().ok()).sum();
    let pages: u64 = fields.get(21)?.parse().ok()?;
    Some((ticks / 100.0, pages * 4))
}

/// Runs a command in a folder until it ends or has taken too much.
fn run(binary: &Path, arguments: &[String], folder: &Path) -> Ending {
    let file = |name: &str| std::fs::File::create(folder.join(name)).expect("a file");
    // warnings are no news of what takes long
    let is_silent = || !std::fs::read_to_string(folder.join("stderr")).is_ok_and(|text| text.contains("s gone by"));
    let mut child = Command::new(binary)
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(file("stdout"))
        .stderr(file("stderr"))
        .spawn()
        .expect("the command starts");
    let start = Instant::now();
    let (mut seconds, mut what) = (0.0, None);
    let mut pause = Duration::from_micros(500);
    let code = loop {
        if let Some(status) = child.try_wait().expect("it can be waited for") {
            break status.code();
        }
        std::thread::sleep(pause);
        pause = (pause * 3 / 2).min(Duration::from_millis(50));
        if start.elapsed() > Duration::from_millis(200) {
            let (time, memory) = used(child.id()).unwrap_or((start.elapsed().as_secs_f64(), 0));
            seconds = time;
            what = if time > MOST_SILENCE && is_silent() {
                Some("takes long without a word")
            } else if time > MOST_SECONDS {
                Some("takes too long")
            } else if memory > MOST_MEMORY {
                Some("takes too much memory")
            } else {
                None
            };
        }
        if what.is_some() {
            // it may have ended by itself just now
            let _ = child.kill();
            break child.wait().expect("it has ended").code();
        }
    };
    let stderr = std::fs::read(folder.join("stderr")).unwrap_or_default();
    Ending { code, stderr: String::from_utf8_lossy(&stderr).into_owned(), seconds, what }
}

/// What is wrong with an ending, in words by which alike ones are counted together.
fn judged(ending: &Ending, case: &Case, folder: &Path) -> Option<String> {
    let command = &case.arguments[0];
    if let Some(what) = ending.what {
        return Some(format!("{command} {what}"));
    }
    if let Some(at) = ending.stderr.find("panicked at") {
        let place: String = ending.stderr[at..].lines().next().unwrap_or("").chars().take(120).collect();
        return Some(format!("{command} {place}"));
    }
    if ending.stderr.contains("internal error") {
        return Some(format!("{command}: an internal error"));
    }
    match ending.code {
        None => return Some(format!("{command} ends by a signal: {}", ending.stderr.lines().last().unwrap_or(""))),
        Some(0) => {}
        Some(1..=3) if ending.stderr.trim().is_empty() => return Some(format!("{command} fails without a word")),
        Some(1..=3) => return None,
        Some(code) => return Some(format!("{command} ends with {code}")),
    }
    let files: &[&str] = match command.as_str() {
        "simulate" | "analyze" => &["stdout", "out.csv", "out.json", "out.svg", "out.html"],
        "report" => &["stdout", "out.html"],
        "verify" => &["stdout"],
        _ => &[],
    };
    let has_none = |name: &&&str| {
        let bytes = std::fs::read(folder.join(name)).unwrap_or_default();
        String::from_utf8_lossy(&bytes).split(|c: char| !c.is_alphanumeric() && c != '_').any(|word| {
            // JSON has no other word for it; of a table every number is one
            matches!(word, "NaN" | "inf") || word == "null" && **name == "out.json"
        })
    };
    files.iter().find(has_none).map(|name| format!("{command} writes a number that is none: {name}"))
}

/// Whether rustc takes what a case has written; none: it has written nothing that stands alone.
fn compiles(case: &Case, folder: &Path) -> Option<Result<(), String>> {
    let depends = ["--generic", "--lanes"].iter().any(|word| case.arguments.iter().any(|a| a == word));
    let source = match case.arguments[0].as_str() {
        "generate" if !depends => folder.join("out.rs"),
        "export" => folder.join("out_package/src/lib.rs"),
        _ => return None,
    };
    if !source.exists() {
        return None;
    }
    if case.arguments[0] == "export" {
        let manifest = folder.join("out_package/Cargo.toml");
        let read =
            Command::new(env!("CARGO")).args(["read-manifest", "--manifest-path"]).arg(&manifest).output().ok()?;
        if !read.status.success() {
            return Some(Err(String::from_utf8_lossy(&read.stderr).into_owned()));
        }
    }
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_string());
    let arguments = [
        "--crate-type=lib",
        "--crate-name=out",
        "--edition=2021",
        "--emit=metadata",
        "--cap-lints=allow",
        "-o",
        "out.rmeta",
    ];
    let output = Command::new(rustc).args(arguments).arg(&source).current_dir(folder).output().ok()?;
    Some(match output.status.success() {
        true => Ok(()),
        false => Err(String::from_utf8_lossy(&output.stderr).into_owned()),
    })
}

/// What came out of many cases.
#[derive(Default)]
struct Tally {
    cases: u64,
    done: u64,
    compiled: u64,
    slowest: (f64, u64),
    /// Per command: cases, those that were done, and those that took more than [`MOST_SILENCE`].
    commands: BTreeMap<String, [u64; 3]>,
    findings: BTreeMap<String, Vec<u64>>,
}

/// Runs cases by a few threads; one of `sample` that wrote a program is compiled, all whose text looks odd are.
fn fuzz(binary: &Path, seed: u64, (first, count): (u64, u64), sample: u64, folder: &Path) -> Tally {
    let corpus = Corpus::new();
    let next = AtomicU64::new(first);
    let tally = Mutex::new(Tally::default());
    let only = &std::env::var("FUZZ_ONLY").ok();
    let _ = std::fs::remove_dir_all(folder);
    std::thread::scope(|scope| {
        for worker in 0..number_of("FUZZ_THREADS", 2) {
            let (corpus, next, tally) = (&corpus, &next, &tally);
            let own = folder.join(format!("worker{worker}"));
            scope.spawn(move || loop {
                let number = next.fetch_add(1, Ordering::Relaxed);
                if number >= first + count {
                    break;
                }
                let case = Case::new(corpus, seed, number);
                if only.as_ref().is_some_and(|only| !only.split(',').any(|command| command == case.arguments[0])) {
                    continue;
                }
                let _ = std::fs::remove_dir_all(&own);
                std::fs::create_dir_all(&own).expect("a folder");
                case.files.iter().for_each(|(name, text)| std::fs::write(own.join(name), text).expect("a file"));
                let ending = run(binary, &case.arguments, &own);
                let mut finding = judged(&ending, &case, &own);
                let mut compiled = 0;
                if finding.is_none() && ending.code == Some(0) && (number % sample == 0 || looks_odd(&case, &own)) {
                    if let Some(result) = compiles(&case, &own) {
                        compiled = 1;
                        if let Err(errors) = result {
                            let first = errors.lines().find(|l| l.starts_with("error")).unwrap_or("").to_string();
                            std::fs::write(own.join("rustc"), errors).expect("a file");
                            finding = Some(format!("{} writes what does not compile: {first}", case.arguments[0]));
                        }
                    }
                }
                let mut tally = tally.lock().expect("no thread panics");
                tally.cases += 1;
                tally.compiled += compiled;
                let counts = tally.commands.entry(case.arguments[0].clone()).or_default();
                counts[0] += 1;
                counts[1] += u64::from(ending.code == Some(0));
                counts[2] += u64::from(ending.seconds > MOST_SILENCE);
                tally.done += u64::from(ending.code == Some(0));
                if ending.seconds > tally.slowest.0 {
                    tally.slowest = (ending.seconds, number);
                }
                if let Some(finding) = finding {
                    let alike = tally.findings.entry(finding.clone()).or_default();
                    alike.push(number);
                    if alike.len() <= 3 {
                        std::fs::write(own.join("command"), case.arguments.join("\n")).expect("a file");
                        std::fs::write(own.join("finding"), &finding).expect("a file");
                        let kept = folder.join(format!("case{number}"));
                        let _ = std::fs::remove_dir_all(&kept);
                        std::fs::rename(&own, kept).expect("the folder can be kept");
                    }
                }
                if tally.cases % 1000 == 0 {
                    println!("{} cases, {} done, {} findings", tally.cases, tally.done, tally.findings.len());
                }
            });
        }
    });
    tally.into_inner().expect("no thread panics")
}

/// Whether a program may well not compile: names from the file, numbers at the ends of the range.
fn looks_odd(case: &Case, folder: &Path) -> bool {
    if case.arguments[0] != "generate" {
        return false;
    }
    let text = std::fs::read_to_string(folder.join("out.rs")).unwrap_or_default();
    let is_odd = |word: &str| matches!(word, "inf" | "NaN" | "nan");
    let code = text.lines().filter(|line| !line.trim_start().starts_with("//"));
    code.into_iter().any(|line| line.split(|c: char| !c.is_alphanumeric() && c != '_').any(is_odd))
}

fn shown(tally: &Tally, folder: &Path) -> String {
    let mut text = format!(
        "{} cases, {} done, {} compiled by rustc, slowest {:.1} s (case {})\n",
        tally.cases, tally.done, tally.compiled, tally.slowest.0, tally.slowest.1
    );
    for (command, [all, done, long]) in &tally.commands {
        text += &format!("  {command}: {all}, {done} of them done, {long} over {MOST_SILENCE} s\n");
    }
    for (finding, cases) in &tally.findings {
        text += &format!("{} times, such as case {}: {finding}\n", cases.len(), cases[0]);
    }
    if !tally.findings.is_empty() {
        text += &format!("their files and commands stand in {}\n", folder.display());
    }
    text
}

fn number_of(variable: &str, default: u64) -> u64 {
    std::env::var(variable).ok().and_then(|text| text.parse().ok()).unwrap_or(default)
}

fn binary() -> PathBuf {
    std::env::var_os("FUZZ_BINARY").map_or_else(|| PathBuf::from(env!("CARGO_BIN_EXE_straightline")), PathBuf::from)
}

#[test]
fn spoilt_files_end_with_a_result_or_a_message() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fuzz_few");
    let tally = fuzz(&binary(), 1, (0, 300), 30, &folder);
    assert!(tally.findings.is_empty(), "{}", shown(&tally, &folder));
    // files are spoilt so little that enough of them still pass
    assert!(tally.done > 40 && tally.done < 250, "{}", shown(&tally, &folder));
}

#[test]
#[ignore = "a quarter of an hour"]
fn very_many_spoilt_files_end_with_a_result_or_a_message() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("fuzz{}", number_of("FUZZ_FIRST", 0)));
    let (seed, first, count) =
        (number_of("FUZZ_SEED", 2), number_of("FUZZ_FIRST", 0), number_of("FUZZ_CASES", 100_000));
    let tally = fuzz(&binary(), seed, (first, count), number_of("FUZZ_SAMPLE", 20), &folder);
    println!("{}", shown(&tally, &folder));
    assert!(tally.findings.is_empty(), "{}", shown(&tally, &folder));
}
