//! Robots as people and exporters write them, all functions in f64 and f32: the program with all optimisations loses at most so
//! many times what the plain program of the same robot loses, against the second author in double-double.
//!
//! Nothing is compiled by rustc: programs are run operation by operation in their own arithmetic. More robots, or others:
//! `ROBOTS=500 SEED=7 STYLES=exported,digits4 cargo test --release -p straightline-codegen --test suite robots_as_written:: -- --ignored --nocapture`

use crate::as_written::{by_steps, in_words, is_of_part, judge, judge_all, survey, Case, File, Outcome, State};
use crate::standalone::Folder;
use crate::written::{Random, Shape, Style};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;
use straightline_codegen::compile::compile;
use straightline_codegen::emit::Generated;
use straightline_codegen::expr::{evaluate, Port};
use straightline_codegen::function::{Family, Quantity, Spec};
use straightline_codegen::options::Options;
use straightline_codegen::program::program;
use straightline_codegen::{Function, Robot, Scalar, Source};
use straightline_core::Dd;

/// Arms of two and three joints with numbers of 1 to 4 decimals.
fn small_arms(count: usize, seed: u64) -> Vec<Case> {
    let arm = |k: usize| {
        let mut random = Random(seed + k as u64);
        let shape = Shape { sliding: random.one_of(&[0, 4]), ..Shape::arm(2 + random.below(2)) };
        Case::new(Style::Digits(1 + k % 4), shape, seed + k as u64)
    };
    (0..count).map(arm).collect()
}

/// Robots of any shape whose numbers an exporter wrote.
fn exported(count: usize, seed: u64, joints: usize) -> Vec<Case> {
    any_shape(&[Style::Exported], count, seed, joints)
}

/// Robots of any shape, with so many joints at most, in these styles in turn.
fn any_shape(styles: &[Style], count: usize, seed: u64, joints: usize) -> Vec<Case> {
    let case = |k: usize| {
        let shape = Shape::any(&mut Random(seed + k as u64), joints);
        Case::new(styles[k % styles.len()], shape, seed + k as u64)
    };
    (0..count).map(case).collect()
}

/// A number from the environment.
fn asked(name: &str, otherwise: u64) -> u64 {
    std::env::var(name).map_or(otherwise, |text| text.parse().unwrap_or_else(|e| panic!("{name}={text}: {e}")))
}

/// Judges robots, each by a part of its functions in one format.
fn all_keep_their_digits(cases: Vec<Case>) {
    let tally = judge_all(&Case::in_turn(cases), |case, outcome| eprintln!("{case:?}: {outcome:?}"));
    let (refused, judged, failed) = (tally.refused, tally.judged, tally.failed.len());
    assert!(20 * refused <= judged, "{refused} robots refused, {judged} judged: these are to be robots");
    assert_eq!(failed, 0, "of {judged} robots; their files: `SHRINK=1 SEED=… cargo test … -- --ignored --nocapture`");
}

#[test]
fn arms_of_few_joints_with_numbers_of_few_decimals_keep_their_digits() {
    all_keep_their_digits(small_arms(84, 1));
}

#[test]
fn robots_as_exporters_write_them_keep_their_digits() {
    all_keep_their_digits(exported(42, 2, 4));
}

#[test]
fn robots_of_every_style_keep_their_digits() {
    all_keep_their_digits(any_shape(&Style::all(), 84, 3, 3));
}

/// Judges the files of `tests/files/as_written`, each the least robot that once lost digits, or a whole one that did: of derivatives those that a
/// file, by its place, is to be judged by.
fn files_keep_their_digits(is_due: impl Fn(usize, Function) -> bool) {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/files/as_written");
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(&folder).expect("the folder is there").map(|entry| entry.expect("an entry").path()).collect();
    files.sort();
    assert!(!files.is_empty());
    for (k, path) in files.into_iter().enumerate() {
        let name = path.file_name().expect("a file has a name").to_string_lossy().into_owned();
        let source = Source::new(&name, std::fs::read_to_string(&path).expect("a file can be read"));
        let file = File { source, floating: name.contains("floating"), frames: Vec::new() };
        // derivatives of motion take longest: in one format of each file
        let of_motion = [Scalar::F64, Scalar::F32][k & 1];
        let wanted = |scalar, function: Function| {
            let Spec { family, solves, .. } = function.spec();
            !family.is_of_blocks() || (is_due(k, function) && (!solves || scalar == of_motion))
        };
        match judge(&file, &wanted) {
            Outcome::Refused(why) => panic!("{name}: {why}"),
            Outcome::Judged(failures, refused) => {
                let is_of_motion = |f: &Function| {
                    let Spec { family, solves, .. } = f.spec();
                    *family == Family::Derivatives
                        && *solves
                        && !f.is_of_scene_parameters()
                        && *f != Function::StepDerivativesRk4
                        && is_due(k, *f)
                };
                let of_motion = Function::known().filter(is_of_motion).count();
                // a step may hide what accelerations lose behind velocities that it hardly changes
                let is_step = |f: &Function| is_of_motion(f) && f.spec().inputs.contains(&Quantity::TimeStep);
                let steps = Function::known().filter(is_step).count();
                let without_digits = match name.as_str() {
                    // 5.2 kg under a slide of 3.6e20 kg: the base has no acceleration with a digit, in f64 or f32
                    "floating_slide_that_hides_a_loss.toml" => 2 + of_motion - steps..=2 + of_motion,
                    // in a step the base turns by more than sines answer for
                    "floating_slide_of_great_inertia.urdf" => 0..=steps,
                    _ => 0..=0,
                };
                assert!(without_digits.contains(&refused), "{name}: {refused}, not {without_digits:?}");
                let words: Vec<String> = failures.iter().map(in_words).collect();
                assert!(words.is_empty(), "{name}: {}", words.join("; "));
            }
        }
    }
}

/// By all functions of forces and motions, and an eighth of the derivatives each.
#[test]
fn robots_that_once_lost_digits_keep_them() {
    files_keep_their_digits(|place, function| is_of_part(function, place, 8));
}

#[test]
#[ignore = "takes a quarter of an hour: all functions, derivatives too"]
fn robots_that_once_lost_digits_keep_those_of_every_function() {
    files_keep_their_digits(|_, _| true);
}

/// What each optimisation does to the digits of `FILE=…`, a robot file: of all functions, or of `FUNCTION=…`.
#[test]
#[ignore = "for one robot that is asked for"]
fn steps_of_a_file() {
    let Ok(path) = std::env::var("FILE") else { return };
    let source = Source::new(&path, std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}")));
    let file = File { source, floating: path.contains("floating"), frames: Vec::new() };
    let wanted = std::env::var("FUNCTION").ok();
    for function in Function::all().filter(|f| wanted.as_ref().is_none_or(|w| w == f.name())) {
        for scalar in [Scalar::F64, Scalar::F32] {
            println!("{} in {}\n{}", function.name(), scalar.name(), by_steps(&file, scalar, function));
        }
    }
}

/// A module's functions at the first state, one line of bits per function: what `main` of the program below does for it.
fn calls(module: &str, generated: &Generated, state: &State, scalar: Scalar) -> String {
    let mut text = String::new();
    for item in &generated.items {
        let literal = |x: &Dd| match scalar {
            Scalar::F64 => format!("f64::from_bits({})", x.to_f64().to_bits()),
            Scalar::F32 => format!("f32::from_bits({})", x.to_f32().to_bits()),
        };
        let array =
            |port: &Port| format!("&[{}]", state.group(&port.name).iter().map(literal).collect::<Vec<_>>().join(", "));
        let inputs: Vec<String> = item.inputs().iter().map(array).collect();
        let shape = &item.outputs()[0].shape;
        let zero = shape.iter().rev().fold("0.0".to_string(), |inner, n| format!("[{inner}; {n}]"));
        let (name, flat) = (item.function.name(), ".flatten()".repeat(shape.len() - 1));
        let _ = writeln!(
            text,
            "    let mut y = {zero};\n    {module}::{name}({}, &mut y);\n    print!(\"{module}_{name}\");\n    \
             y.iter(){flat}.for_each(|x| print!(\" {{}}\", x.to_bits()));\n    println!();",
            inputs.join(", ")
        );
    }
    text
}

/// What is judged above are programs run operation by operation: rustc's are the same bits.
#[test]
fn compiled_code_gives_the_bits_that_were_judged() {
    let styles = [Style::Digits(2), Style::Exported, Style::Round, Style::Tiny, Style::Ratios, Style::Units];
    let (mut source, mut main, mut expected) = (String::new(), String::new(), BTreeMap::new());
    for (k, style) in styles.into_iter().enumerate() {
        let shape = Shape { fixed: 2, sliding: 3, floating: k == 2, ..Shape::arm(2 + k % 2) };
        let file = File::from(&Case::new(style, shape, 50 + k as u64).robot());
        for scalar in [Scalar::F64, Scalar::F32] {
            let options = Options { scalar, frames: file.frames.clone(), ..file.options() };
            let generated = compile(&file.source, &options).unwrap_or_else(|d| panic!("{}", d.render()));
            let state = State::new(&generated.model, &mut Random(5), 3);
            let module = format!("robot{k}_{}", scalar.name());
            let _ = writeln!(source, "#[allow(dead_code)]\nmod {module} {{\n{}\n}}", generated.text);
            main += &calls(&module, &generated, &state, scalar);
            let robot = Robot::new(generated.model.clone());
            for item in &generated.items {
                let graph = program(&robot, &file.frames, item.function, &options).graph;
                let bits: Vec<u64> = match scalar {
                    Scalar::F64 => evaluate(&graph, &state.inputs::<f64>(&graph)).iter().map(|x| x.to_bits()).collect(),
                    Scalar::F32 => {
                        evaluate(&graph, &state.inputs::<f32>(&graph)).iter().map(|x| x.to_bits().into()).collect()
                    }
                };
                expected.insert(format!("{module}_{}", item.function.name()), bits);
            }
        }
    }
    assert!(expected.len() >= 11 * Function::all().count(), "{} functions", expected.len());
    let _ = writeln!(source, "fn main() {{\n{main}}}");
    let folder = Folder::new("as-written");
    let program = folder.build("robots", &source, &["-C", "opt-level=0"]).unwrap_or_else(|e| panic!("{e}"));
    let printed = crate::standalone::run(&program, &[]).unwrap_or_else(|e| panic!("{e}"));
    let computed: BTreeMap<String, Vec<u64>> = printed
        .lines()
        .map(|line| {
            let (name, bits) = line.split_once(' ').expect("a name and its numbers");
            (name.to_string(), bits.split(' ').map(|b| b.parse().expect("bits")).collect())
        })
        .collect();
    assert_eq!(computed, expected);
}

#[test]
#[ignore = "2000 robots, an hour"]
fn thousands_of_robots() {
    let (count, seed) = (asked("ROBOTS", 2000) as usize, 1_000_000 * asked("SEED", 1));
    let joints = asked("JOINTS", 9) as usize;
    let cases = match std::env::var("STYLES") {
        Ok(names) => {
            let named = |name: &str| {
                let found = Style::all().into_iter().find(|style| style.name() == name);
                found.unwrap_or_else(|| panic!("STYLES={names}: no style `{name}`"))
            };
            any_shape(&names.split(',').map(named).collect::<Vec<_>>(), count, seed, joints)
        }
        Err(_) => [
            small_arms(count * 2 / 5, seed),
            exported(count * 3 / 10, seed, joints),
            any_shape(&Style::all(), count * 3 / 10, seed, joints),
        ]
        .concat(),
    };
    let cases = match asked("ONLY", 0) {
        0 => cases,
        seed => cases.into_iter().filter(|case| case.seed == seed).collect(),
    };
    let in_turn = std::env::var_os("IN_TURN").is_some();
    survey(if in_turn { Case::in_turn(cases) } else { cases });
}
