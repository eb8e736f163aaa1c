//! Identical limbs as turns of one loop: the bits of lanes, the second author's physics, and objects for microcontrollers that call nothing.

use crate::cross;
use crate::limbs::{agrees, crab, hand, limbs_on, link, options, robot, stool, table, Differ, Numbers, FORCES};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use straightline_codegen::choices::{LimbForm, TargetMachine};
use straightline_codegen::compile::compile;
use straightline_codegen::expr::evaluate;
use straightline_codegen::model::load;
use straightline_codegen::options::Options;
use straightline_codegen::program::{program, TracedProgram};
use straightline_codegen::readback::{checked, TextReader};
use straightline_codegen::{Function, Grade, Robot, Scalar, Source};

fn rolled(floating_base: bool) -> Options {
    Options { limbs: LimbForm::Rolled, ..options(floating_base) }
}

/// For a Cortex-M4F: short sines, in single precision.
fn on_a_microcontroller(options: Options) -> Options {
    Options { scalar: Scalar::F32, target: Some(TargetMachine::CORTEX_M4F), ..options }
}

/// A walking robot of so many legs, mirrored or different in all; in one leg numbers are zero that the others have.
fn walker(legs: usize, joints: usize, differ: Differ, seed: u64) -> Source {
    let base = link("base", &mut Numbers(seed), 1.0);
    let text = robot(&[base, limbs_on("base", "leg", legs, &vec!["revolute"; joints], differ, seed + 1)]);
    let with_zeros = |text: &str, before: &str, ends: &str| {
        let start = text.find(before).expect("the leg is there") + before.len();
        let end = start + text[start..].find(ends).expect("a number ends");
        format!("{}0{}", &text[..start], &text[end..])
    };
    let text = with_zeros(text.text(), "<link name=\"leg1_1\"><inertial><origin xyz=\"", " ");
    let start = text.find("<link name=\"leg0_0\">").expect("the leg is there");
    let (before, leg) = text.split_at(start);
    Source::new("robot.urdf", format!("{before}{}", with_zeros(leg, "ixy=\"", "\"")))
}

fn four_legs() -> Source {
    walker(4, 3, Differ::Mirrored, 100)
}

fn walkers() -> Vec<Source> {
    let shapes = [(4, 3, Differ::Mirrored), (6, 3, Differ::Mirrored), (4, 2, Differ::InAll), (6, 2, Differ::InAll)];
    (0..4).map(|k| walker(shapes[k].0, shapes[k].1, shapes[k].2, 100 + 7 * k as u64)).collect()
}

/// Legs with a tail between them: what they read and write is nowhere equally far apart.
fn with_a_tail() -> Source {
    let base = link("base", &mut Numbers(71), 1.0);
    let legs = |name: &str, count, seed| limbs_on("base", name, count, &["revolute"; 2], Differ::InAll, seed);
    let tail = limbs_on("base", "tail", 1, &["prismatic", "revolute", "revolute"], Differ::InAll, 83);
    robot(&[base, legs("front", 2, 73), tail, legs("rear", 2, 79)])
}

fn made(source: &Source, function: Function, options: &Options) -> TracedProgram {
    let robot = Robot::new(load(source, &options.model).0.unwrap_or_else(|| panic!("{}", source.text())));
    program(&robot, &[], function, options)
}

fn states(program: &TracedProgram, seed: u64) -> Vec<Vec<f64>> {
    let mut n = Numbers(seed);
    let inputs: usize = program.graph.inputs.iter().map(|port| port.len()).sum();
    (0..6).map(|_| (0..inputs).map(|_| 2.0 * n.next()).collect()).collect()
}

/// Up to the sign of zero.
fn bits(x: &[f64]) -> Vec<u64> {
    x.iter().map(|x| (x + 0.0).to_bits()).collect()
}

#[test]
fn rolled_programs_have_the_bits_of_lanes_and_the_values_of_the_generic_runtime() {
    for (k, source) in walkers().into_iter().chain([with_a_tail(), crab()]).enumerate() {
        for function in FORCES {
            let in_lanes = made(&source, function, &options(true));
            let in_turns = made(&source, function, &rolled(true));
            // by exact rules the program is the generic runtime, bit for bit
            let exact = Options { grade: Grade::Exact, limbs: LimbForm::Apart, ..options(true) };
            let exact = made(&source, function, &exact);
            assert!(in_turns.graph.alike.iter().all(|alike| alike.is_rolled) && !in_turns.graph.alike.is_empty());
            assert_ne!(in_turns.graph, in_lanes.graph, "sines stand in the loop");
            for state in states(&exact, k as u64) {
                let turns: Vec<f64> = evaluate(&in_turns.graph, &state);
                assert_eq!(bits(&turns), bits(&evaluate(&in_lanes.graph, &state)), "{k}, {}", function.name());
                let runtime: Vec<f64> = evaluate(&exact.graph, &state);
                let size = runtime.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
                let is_near = |(x, y): (&f64, &f64)| (x - y).abs() <= 1e-12 * size;
                assert!(turns.iter().zip(&runtime).all(is_near), "{k}, {}: {turns:?} {runtime:?}", function.name());
            }
        }
    }
}

#[test]
fn rolled_loops_are_what_the_second_author_says() {
    for (source, floating) in [(with_a_tail(), true), (hand(), false), (crab(), true), (table(), false)] {
        agrees(&source, &rolled(floating));
    }
    for source in walkers() {
        agrees(&source, &on_a_microcontroller(rolled(true)));
    }
    agrees(&crab(), &Options { fma: true, functions: vec![Function::InverseDynamics], ..rolled(true) });
    agrees(&stool(), &Options { generic: true, functions: vec![Function::InverseDynamics], ..rolled(true) });
}

/// What no limb shares with another stays as it is.
#[test]
fn functions_without_lanes_are_as_apart() {
    let functions = vec![Function::MassMatrix, Function::ForwardDynamics];
    let of = |limbs| {
        let options = Options { functions: functions.clone(), limbs, ..options(true) };
        let text = compile(&stool(), &options).unwrap_or_else(|errors| panic!("{errors}")).text;
        text.lines().filter(|line| !line.starts_with("// Inputs' hash")).collect::<Vec<_>>().join("\n")
    };
    assert_eq!(of(LimbForm::Rolled), of(LimbForm::Apart));
}

#[test]
fn coordinates_that_are_equally_far_apart_are_read_and_written_where_they_are() {
    let text = |source: &Source, function| {
        let options = Options { functions: vec![function], ..on_a_microcontroller(rolled(true)) };
        let text = compile(source, &options).unwrap_or_else(|errors| panic!("{errors}")).text;
        text.split("\nmod ").next().expect("text before the kernels").to_string()
    };
    let regular = text(&four_legs(), Function::InverseDynamics);
    for part in ["(q[7 + 3 * limb])", "qd[6 + 3 * limb]", "tau[8 + 3 * limb] = ", "C1[limb][0]", "for limb in 0..4 {"] {
        assert!(regular.contains(part), "{part}: {regular}");
    }
    assert!(!regular.contains("let x1: ") && !regular.contains("let mut moments4_z"), "{regular}");
    // sums are all that is left behind: six at most
    assert!(regular.matches("    let mut ").count() <= 6, "{regular}");
    let irregular = text(&with_a_tail(), Function::InverseDynamics);
    assert!(irregular.contains("let x1: ") && !irregular.contains(" * limb]"), "{irregular}");
    // what LLVM would write out hides how often it turns
    let short = text(&stool(), Function::GravityForce);
    assert!(short.contains("for limb in (0..3).take(core::hint::black_box(3)) {"), "{short}");
}

/// Constants stand once where all limbs have the same, and where two columns are the same.
#[test]
fn constants_of_all_limbs_stand_once() {
    let options = Options { functions: vec![Function::InverseDynamics], ..on_a_microcontroller(rolled(true)) };
    let generated = compile(&four_legs(), &options).unwrap_or_else(|errors| panic!("{errors}"));
    let start = generated.text.find("static C1: [[f32; ").expect("a table");
    let table = &generated.text[start..start + generated.text[start..].find("];\n    let").expect("its end")];
    let rows: Vec<Vec<&str>> = table
        .lines()
        .filter_map(|line| line.trim().strip_prefix('[')?.strip_suffix("],"))
        .map(|row| row.split(", ").collect())
        .collect();
    assert_eq!(rows.len(), 4, "{table}");
    let columns: Vec<Vec<&str>> = (0..rows[0].len()).map(|k| rows.iter().map(|row| row[k]).collect()).collect();
    for (k, column) in columns.iter().enumerate() {
        assert!(column.iter().any(|x| *x != column[0]), "column {k} of {table}");
        assert!(!columns[..k].contains(column), "column {k} of {table}");
    }
}

/// Loops with another entry of the table, another leg's numbers, or another number of turns are not the program.
#[test]
fn loops_with_a_wrong_entry_or_index_are_refused() {
    let options = Options { functions: FORCES.to_vec(), ..on_a_microcontroller(rolled(true)) };
    let generated = compile(&four_legs(), &options).unwrap_or_else(|errors| panic!("{errors}"));
    let text = &generated.text;
    let mut reader = TextReader::new(&generated);
    assert_eq!(reader.check(text), Ok(()));
    let table = text.find("static C1: ").expect("a table");
    let row = table + text[table..].find("\n        [").expect("a row") + "\n        [".len();
    let entry = row + text[row..].find(',').expect("an entry ends");
    let number = &text[row..entry];
    let other_sign = number.strip_prefix('-').map_or(format!("-{number}"), str::to_string);
    let mut changed: Vec<String> = [other_sign, "0.0".to_string(), format!("1{}", number.trim_start_matches('-'))]
        .iter()
        .map(|other| format!("{}{other}{}", &text[..row], &text[entry..]))
        .filter(|other| other != text)
        .collect();
    for (from, to) in [
        ("C1[limb][0]", "C1[limb][1]"),
        ("C1[limb][0]", "C1[0][0]"),
        ("C1[limb][0]", "C1[limb + 0][0]"),
        ("qd[6 + 3 * limb]", "qd[7 + 3 * limb]"),
        ("qd[6 + 3 * limb]", "qd[6 + 2 * limb]"),
        ("qd[6 + 3 * limb]", "qd[6 + limb]"),
        ("qd[6 + 3 * limb]", "qd[6]"),
        ("qd[6 + 3 * limb]", "qd[6 + 30 * limb]"),
        ("qd[6 + 3 * limb]", "qd[6 + 18446744073709551615 * limb]"),
        ("(q[7 + 3 * limb])", "(q[10 + 3 * limb])"),
        ("tau[8 + 3 * limb] = ", "tau[7 + 3 * limb] = "),
        ("tau[8 + 3 * limb] = ", "tau[8] = "),
        ("for limb in 0..4 {", "for limb in 0..3 {"),
        ("for limb in 0..4 {", "for limb in 1..4 {"),
        ("take(core::hint::black_box(4))", "take(core::hint::black_box(3))"),
        ("take(core::hint::black_box(4))", "take(4)"),
        ("(0..4).take(core::hint::black_box(4))", "(0..3).take(core::hint::black_box(3))"),
        ("[[f32; ", "[[f64; "),
    ] {
        assert!(text.contains(from), "{from}: {text}");
        changed.push(text.replacen(from, to, 1));
    }
    for other in changed {
        let line = text.lines().zip(other.lines()).find(|(a, b)| a != b);
        assert!(reader.check(&other).is_err(), "{line:?}");
    }
    assert_eq!(reader.check(text), Ok(()), "the reader kept something");
    let mut wrong = generated.clone();
    wrong.text = text.replacen("qd[6 + 3 * limb]", "qd[7 + 3 * limb]", 1);
    assert!(checked(wrong).is_err(), "nothing is written");
}

#[test]
fn what_has_no_limbs_or_keeps_every_bit_is_refused() {
    let refused = |source: &Source, options: &Options| match compile(source, options) {
        Ok(_) => panic!("it is written"),
        Err(errors) => errors.render(),
    };
    let one =
        robot(&[link("base", &mut Numbers(1), 1.0), limbs_on("base", "leg", 1, &["revolute"; 2], Differ::InAll, 2)]);
    assert!(refused(&one, &rolled(true)).contains("`limbs = \"rolled\"`, but no two limbs of the robot are alike"));
    let exact = Options { grade: Grade::Exact, ..rolled(true) };
    assert!(refused(&stool(), &exact).contains("`limbs = \"rolled\"` together with `rules = \"exact\"`"));
}

fn folder() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("rolled");
    std::fs::create_dir_all(&folder).expect("a folder for programs");
    folder
}

/// What rustc makes of the loops, hidden ones too, has the bits of what it makes of lanes.
#[test]
fn compiled_loops_have_the_bits_of_lanes() {
    let (mut modules, mut calls) = (String::new(), String::new());
    for (k, source) in walkers().into_iter().chain([with_a_tail()]).enumerate() {
        let mut sizes = (0, 0);
        for (name, limbs) in [("lanes", LimbForm::Lanes), ("rolled", LimbForm::Rolled)] {
            let functions = vec![Function::InverseDynamics, Function::GravityForce];
            let options = Options { limbs, functions, ..on_a_microcontroller(options(true)) };
            let generated = compile(&source, &options).unwrap_or_else(|errors| panic!("{errors}"));
            sizes = (generated.model.nq(), generated.model.nv());
            write!(modules, "mod {name}{k} {{\n{}\n}}\n", generated.text).expect("a string takes text");
        }
        let (nq, nv) = sizes;
        write!(
            calls,
            "    for _ in 0..50 {{\n        let q: [f32; {nq}] = core::array::from_fn(|_| next());\n        \
             let qd: [f32; {nv}] = core::array::from_fn(|_| next());\n        let qdd: [f32; {nv}] = core::array::from_fn(|_| next());\n        \
             let mut y = [[0.0f32; {nv}]; 4];\n        \
             lanes{k}::inverse_dynamics(&q, &qd, &qdd, &mut y[0]);\n        rolled{k}::inverse_dynamics(&q, &qd, &qdd, &mut y[1]);\n        \
             lanes{k}::gravity_force(&q, &mut y[2]);\n        rolled{k}::gravity_force(&q, &mut y[3]);\n        \
             let bits = y.map(|y| y.map(|x| (x + 0.0).to_bits()));\n        \
             assert!(bits[0] == bits[1] && bits[2] == bits[3] && y[0].iter().all(|x| x.is_finite() && *x != 0.0), \"{k}\");\n    }}\n"
        )
        .expect("a string takes text");
    }
    let main = format!(
        "#![allow(warnings)]\n{modules}\nfn main() {{\n    let mut n = 7u64;\n    let mut next = || {{\n        \
         n = n.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);\n        \
         ((n >> 40) as f32 / 8388608.0 - 1.0) * 2.0\n    }};\n{calls}}}\n"
    );
    let (file, binary) = (folder().join("bits.rs"), folder().join("bits"));
    std::fs::write(&file, main).expect("the program can be written");
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_string());
    let built = Command::new(rustc).args(["--edition=2021", "-Copt-level=2", "-o"]).args([&binary, &file]).output();
    let built = built.expect("rustc runs");
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let output = Command::new(&binary).output().expect("the program runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Neither a panic nor `memset` is asked for, and no loop is written out: calls stand as often as in the text.
#[test]
fn objects_for_microcontrollers_call_nothing_and_keep_their_loops() {
    let (Some(rustc), Some(nm), Some(objdump)) =
        (cross::program("rustc"), cross::program("arm-none-eabi-nm"), cross::program("arm-none-eabi-objdump"))
    else {
        return;
    };
    let solo12 = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions/solo12.urdf");
    let solo12 = Source::new("solo12.urdf", std::fs::read_to_string(solo12).expect("the file is there"));
    // odd numbers of limbs, and arrays over limbs, too
    let sources = [solo12, with_a_tail(), crab(), walkers().remove(1)];
    let object = folder().join("rolled.o");
    let symbols = |text: &str, level: &str| {
        let file = folder().join("rolled.rs");
        // functions that are small would not be in the object
        let text = text.replace("pub fn ", "#[inline(never)]\npub fn ");
        std::fs::write(&file, format!("#![no_std]\n#![forbid(unsafe_code)]\n#![allow(warnings)]\n{text}"))
            .expect("a file");
        let built = Command::new(&rustc)
            .args(["--edition=2021", "--crate-type=lib", "--crate-name=rolled", "--target=thumbv7em-none-eabihf"])
            .args(["-Cpanic=abort", "-Ccodegen-units=1", "-Ctarget-cpu=cortex-m4", "--emit=obj"])
            .args([format!("-Copt-level={level}"), "-o".to_string()])
            .args([&object, &file])
            .output()
            .expect("the compiler runs");
        assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
        let wanted = Command::new(&nm).arg("-u").arg(&object).output().expect("nm runs");
        String::from_utf8_lossy(&wanted.stdout).into_owned()
    };
    for (k, source) in sources.iter().enumerate() {
        let options = Options { functions: FORCES.to_vec(), ..on_a_microcontroller(rolled(true)) };
        let text = compile(source, &options).unwrap_or_else(|errors| panic!("{errors}")).text;
        for level in ["2", "3"] {
            assert_eq!(symbols(&text, level), "", "robot {k}, opt-level {level}");
        }
        let calls = || {
            let output = Command::new(&objdump).arg("-d").arg(&object).output().expect("objdump runs");
            String::from_utf8_lossy(&output.stdout).lines().filter(|line| line.contains("\tbl\t")).count()
        };
        let in_text = text.matches("short_sines::").count() + text.matches("trig::").count();
        let found = calls();
        assert!(found > 0 && found <= in_text, "robot {k}: {found} calls of {in_text}");
        if k == 0 {
            let known = text.replace("(0..4).take(core::hint::black_box(4))", "0..4");
            assert_ne!(known, text, "gravity forces are short");
            symbols(&known, "3");
            assert!(calls() > in_text, "a loop of known length is written out: {} calls", calls());
        }
        // the scan sees what it looks for
        let bad = text.replace("[limb]", "[limb + 1]");
        assert!(symbols(&bad, "3").contains("panic_bounds_check"), "robot {k}");
    }
}
