//! Instructions per call, counted by valgrind's callgrind: the same on a busy machine, so that a change of code shows.
//!
//! `cargo bench -p straightline-robots --bench instructions` compares with
//! `instructions.tsv` and fails if a function takes over 2 % more; `INSTRUCTIONS_UPDATE=1` writes that file anew. Without
//! valgrind it says so and succeeds. Instructions depend on the compiler: the file says of which one its figures are.
//!
//! Functions generic over the scalar stand beside the plain ones: at `f64` they must take no more instructions.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

/// Calls of each function in a run.
const CALLS: u64 = 4;
/// More than that is worse, not another choice of registers.
const TOLERANCE: f64 = 0.02;

/// The robots again, their functions over any scalar.
mod generic {
    straightline::dynamics! {
        pub mod puma560 = "descriptions/puma560.urdf", generic,
            functions(inverse_dynamics, gravity_force, forward_dynamics, mass_matrix)
    }
    straightline::dynamics! {
        pub mod ur5 = "descriptions/ur5.urdf", generic, angle_tolerance = 1e-11,
            functions(inverse_dynamics, gravity_force, forward_dynamics, mass_matrix)
    }
    straightline::dynamics! {
        pub mod panda = "descriptions/panda.urdf", generic,
            functions(inverse_dynamics, gravity_force, forward_dynamics, mass_matrix)
    }
    straightline::dynamics! {
        pub mod solo12 = "descriptions/solo12.urdf", generic, floating_base,
            functions(inverse_dynamics, gravity_force, forward_dynamics, mass_matrix)
    }
}

macro_rules! calls {
    ($library:ident: $($module:ident),*) => {$({
        use $library::$module as robot;
        let (q, v, a) = ([0.3; robot::NQ], [0.2; robot::NV], [0.1; robot::NV]);
        for _ in 0..CALLS {
            let (mut y, mut h) = ([0.0; robot::NV], [[0.0; robot::NV]; robot::NV]);
            // through pointers, so that nothing is inlined
            black_box::<fn(&_, &_, &_, &mut _)>(robot::inverse_dynamics)(&q, &v, &a, &mut y);
            black_box(&y);
            black_box::<fn(&_, &mut _)>(robot::gravity_force)(&q, &mut y);
            black_box(&y);
            black_box::<fn(&_, &_, &_, &mut _)>(robot::forward_dynamics)(&q, &v, &a, &mut y);
            black_box(&y);
            black_box::<fn(&_, &mut _)>(robot::mass_matrix)(&q, &mut h);
            black_box(&h);
        }
    })*};
}

const ROBOTS: [&str; 4] = ["puma560", "ur5", "panda", "solo12"];
const FUNCTIONS: [&str; 4] = ["inverse_dynamics", "gravity_force", "forward_dynamics", "mass_matrix"];

fn main() -> ExitCode {
    if std::env::args().any(|a| a == "--calls") {
        calls!(straightline_robots: puma560, ur5, panda, solo12);
        calls!(generic: puma560, ur5, panda, solo12);
        return ExitCode::SUCCESS;
    }
    let found = Command::new("valgrind").arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    if !found.is_ok_and(|status| status.success()) {
        println!("skipped: there is no valgrind");
        return ExitCode::SUCCESS;
    }
    let (counted, generic) = count();
    let record = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/instructions.tsv");
    let compiler = compiler();
    if std::env::var_os("INSTRUCTIONS_UPDATE").is_some() {
        let mut text = format!("# instructions per call, {compiler}, release profile\n");
        counted.iter().for_each(|(name, n)| writeln!(text, "{name}\t{n}").expect("a string takes text"));
        std::fs::write(&record, text).expect("the record can be written");
        return ExitCode::SUCCESS;
    }
    let text = std::fs::read_to_string(&record).expect("the record stands beside this file");
    if !text.lines().next().is_some_and(|line| line.contains(&compiler)) {
        println!("the record is of another compiler than {compiler}: figures only");
        counted.iter().for_each(|(name, n)| println!("{name}\t{n}"));
        return ExitCode::SUCCESS;
    }
    let recorded: BTreeMap<&str, u64> = text
        .lines()
        .filter_map(|line| line.split_once('\t'))
        .map(|(name, n)| (name, n.parse().expect("a number of instructions")))
        .collect();
    let mut worse = false;
    println!("| function | recorded | now | | over any scalar, at f64 | |\n|---|---|---|---|---|---|");
    for (name, now) in &counted {
        let before = recorded.get(name.as_str()).copied();
        let more = before.map_or(0.0, |before| *now as f64 / before as f64 - 1.0);
        let any = generic[name];
        let dearer = any as f64 / *now as f64 - 1.0;
        worse |= more > TOLERANCE || dearer > TOLERANCE;
        let before = before.map_or("-".to_string(), |n| n.to_string());
        println!("| {name} | {before} | {now} | {:+.1} % | {any} | {:+.1} % |", 100.0 * more, 100.0 * dearer);
    }
    if worse {
        println!(
            "over {} % more instructions than recorded or than plain functions: if it pays elsewhere, record it by INSTRUCTIONS_UPDATE=1",
            100.0 * TOLERANCE
        );
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}

fn compiler() -> String {
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_string());
    let output = Command::new(rustc).arg("--version").output().expect("rustc can be run");
    let version = String::from_utf8_lossy(&output.stdout).trim().to_string();
    format!("{version}, {}", std::env::consts::ARCH)
}

/// Instructions per call of each function, by `robot::function`; of the plain ones and of those over any scalar.
fn count() -> (BTreeMap<String, u64>, BTreeMap<String, u64>) {
    let file: PathBuf = std::env::temp_dir().join(format!("straightline-callgrind-{}", std::process::id()));
    let done = Command::new("valgrind")
        .args(["--tool=callgrind", "--error-exitcode=1"])
        .arg(format!("--callgrind-out-file={}", file.display()))
        .arg(std::env::current_exe().expect("a program has a path"))
        .arg("--calls")
        .stderr(Stdio::null())
        .status()
        .expect("valgrind was found");
    assert!(done.success(), "valgrind runs the calls");
    let profile = std::fs::read_to_string(&file).expect("callgrind wrote a profile");
    std::fs::remove_file(&file).expect("the profile can be removed");
    let counted = inclusive(&profile);
    let of = |library: &str| {
        let names = ROBOTS.iter().flat_map(|r| FUNCTIONS.iter().map(move |f| format!("{r}::{f}")));
        let calls = |name: String| {
            let n = counted.get(&format!("{library}::{name}")).unwrap_or_else(|| panic!("{name} was not called"));
            (name, n / CALLS)
        };
        names.map(calls).collect()
    };
    (of("straightline_robots"), of("instructions::generic"))
}

/// Instructions of the calls of each function by its path, callees included.
///
/// Callgrind writes `cfn=(id) name` (the name at its first mention), `calls=COUNT PLACE`, and a line `PLACE INSTRUCTIONS`.
fn inclusive(profile: &str) -> BTreeMap<String, u64> {
    let mut names: BTreeMap<&str, &str> = BTreeMap::new();
    let mut counted = BTreeMap::new();
    let mut callee = "";
    let mut lines = profile.lines();
    while let Some(line) = lines.next() {
        let Some((key, rest)) = line.split_once('=') else { continue };
        if key == "fn" || key == "cfn" {
            let (id, name) = rest.split_once(' ').unwrap_or((rest, ""));
            if !name.is_empty() {
                names.insert(id, name);
            }
            if key == "cfn" {
                callee = names.get(id).copied().unwrap_or("");
            }
        } else if key == "calls" {
            let cost = lines.next().and_then(|line| line.split_whitespace().nth(1)).and_then(|n| n.parse().ok());
            let cost: u64 = cost.expect("a call is followed by its cost");
            *counted.entry(callee.to_string()).or_insert(0) += cost;
        }
    }
    counted
}
