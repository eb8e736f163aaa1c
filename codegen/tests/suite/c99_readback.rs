//! Packages in C99 are read back as the programs that they were made of; a file with a word changed is not.

use crate::written::{Shape, Style, Written};
use std::ops::Range;
use std::path::Path;
use std::sync::LazyLock;
use straightline_codegen::certify::Effort;
use straightline_codegen::choices::{LimbForm, TargetMachine};
use straightline_codegen::compile::checked_package;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::emit::c99::C99_SOURCE;
use straightline_codegen::emit::Generated;
use straightline_codegen::options::scene_file;
use straightline_codegen::options::Options;
use straightline_codegen::readback::c99::CReader;
use straightline_codegen::readback::complaint;
use straightline_codegen::scene::{Budget, InputRange, JointRanges, MaxError};
use straightline_codegen::schedule::ScheduleLimits;
use straightline_codegen::{compile, Function, Scalar};
use straightline_core::random::Random;

const ARM: &str = include_str!("../files/arm.toml");

const SCENE: &str = "[outputs]\nfunctions = [\"gravity_force\"]\ncontact = [\"forward_dynamics\"]\n\
     [[parameter]]\nkind = \"payload\"\nname = \"tool\"\nframe = \"hand\"\n\
     [[contact]]\nname = \"pen\"\nframe = \"hand\"\nobject = { origin = [0.5, 0.0, 0.2], z = [0.0, 0.0, 1.0] }\nconstrained = [\"pz\"]\n\
     [[mode]]\nname = \"writing\"\ncontacts = [\"pen\"]\n";

fn robot(name: &str) -> Source {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots").join(name);
    Source::new(name, std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display())))
}

fn in_scene(scene: &Source, options: Options) -> Options {
    let mut diagnostics = Diagnostics::new();
    let file = scene_file::read(scene, &mut diagnostics);
    file.unwrap_or_else(|| panic!("{}", diagnostics.render())).into_options(options)
}

fn generated(robot: &Source, options: &Options) -> Generated {
    compile(robot, options).unwrap_or_else(|errors| panic!("{}", errors.render()))
}

/// Packages of every kind of text: parts, loops over limbs, sums of angles, parameters of bodies and drives, contacts, bounds, mixed precision.
pub fn kinds() -> &'static [(&'static str, Generated)] {
    static KINDS: LazyLock<Vec<(&'static str, Generated)>> = LazyLock::new(every_kind);
    &KINDS
}

fn every_kind() -> Vec<(&'static str, Generated)> {
    let of = |functions: &[Function]| Options { functions: functions.to_vec(), ..Options::default() };
    let arm = Source::new("arm.toml", ARM);
    let scene = Source::new("scene.toml", SCENE);
    let certified = Options { certify: Some(Effort { companions: true, ..Effort::default() }), ..Options::default() };
    let parts = Options { limits: ScheduleLimits { operations: 60 }, ..of(&[Function::InverseDynamics]) };
    let mut limbs = Options { limbs: LimbForm::Lanes, scalar: Scalar::F32, ..of(&[Function::GravityForce]) };
    limbs.model.floating_base = true;
    let drives = robot("scenes/planar_2r_drives.toml");
    let mut mixed = Options { scalar: Scalar::F32, ..of(&[Function::InverseDynamics]) };
    mixed.scene.ranges.qd = JointRanges::All(InputRange::within(0.5));
    mixed.scene.ranges.qdd = JointRanges::All(InputRange::within(1.0));
    let mixed = (0..20).find_map(|k| {
        let budget = Budget {
            max_error: Some(MaxError::All(2e-5 * 1.2f64.powi(k))),
            mixed_precision: true,
            ..Budget::default()
        };
        mixed.scene.budgets.insert(Function::InverseDynamics, budget);
        compile(&robot("descriptions/ur5.urdf"), &mixed).ok()
    });
    let target = Some(TargetMachine::CORTEX_M4F);
    let short = Options { target, scalar: Scalar::F32, ..of(&[Function::GravityForce]) };
    vec![
        ("parts", generated(&robot("descriptions/ur5.urdf"), &parts)),
        ("limbs", generated(&robot("descriptions/hyq.urdf"), &limbs)),
        ("limbs, rolled", generated(&robot("descriptions/hyq.urdf"), &Options { limbs: LimbForm::Rolled, ..limbs })),
        ("scene", generated(&arm, &in_scene(&scene, Options { scalar: Scalar::F32, ..Options::default() }))),
        ("bounds", generated(&arm, &Options { functions: vec![Function::GravityForce], ..certified })),
        ("drives", generated(&robot("descriptions/planar_2r.toml"), &in_scene(&drives, Options::default()))),
        ("mixed", mixed.expect("a budget can be met")),
        ("short sines", generated(&robot("descriptions/ur5.urdf"), &short)),
    ]
}

#[test]
fn packages_of_robots_as_people_write_them_are_read_back() {
    let mut read = 0;
    for seed in 0..12u64 {
        let mut random = crate::written::Random(seed + 40);
        let shape = Shape::any(&mut random, 3);
        let written = Written::new(Style::all()[seed as usize % Style::all().len()], shape, seed);
        let options = Options {
            scalar: [Scalar::F64, Scalar::F32][seed as usize % 2],
            limits: ScheduleLimits { operations: [100, 12_000][seed as usize / 2 % 2] },
            ..Options::default()
        };
        let Ok(generated) = compile(&Source::new(written.file_name(), written.text()), &options) else { continue };
        checked_package(&C99_SOURCE, &generated, "Any_1").unwrap_or_else(|errors| panic!("{seed}: {errors}"));
        read += 1;
    }
    assert!(read > 8, "{read} of 12 robots are robots");
}

/// The words of a text, comments aside.
pub fn words(text: &str) -> Vec<Range<usize>> {
    let bytes = text.as_bytes();
    let is_word = |b: u8| b.is_ascii_alphanumeric() || b == b'_';
    let mut words = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let start = at;
        if bytes[at..].starts_with(b"/*") {
            at += text[at..].find("*/").expect("a comment ends") + 2;
            continue;
        } else if bytes[at..].starts_with(b"//") {
            at += text[at..].find('\n').expect("a comment ends");
            continue;
        } else if bytes[at].is_ascii_digit() {
            while is_word(bytes[at]) || bytes[at] == b'.' || bytes[at] == b'-' && bytes[at - 1] == b'e' {
                at += 1;
            }
        } else if is_word(bytes[at]) {
            while is_word(bytes[at]) {
                at += 1;
            }
        } else {
            at += 1;
            if bytes[start].is_ascii_whitespace() {
                continue;
            }
        }
        words.push(start..at);
    }
    words
}

/// A text with one word changed: into another of its kind, into none, or with its neighbour.
pub fn changed(text: &str, words: &[Range<usize>], random: &mut Random) -> Option<(String, String)> {
    let k = random.below(words.len() - 1);
    let (range, next) = (words[k].clone(), words[k + 1].clone());
    let word = &text[range.clone()];
    let with = |by: &str| [&text[..range.start], by, &text[range.end..]].concat();
    let of_kind = |kind: fn(&str) -> bool, random: &mut Random| {
        // a name from nearby means something there
        let (from, to) = (k.saturating_sub(60), (k + 60).min(words.len()));
        let others: Vec<&str> =
            words[from..to].iter().map(|w| &text[w.clone()]).filter(|w| kind(w) && *w != word).collect();
        (!others.is_empty()).then(|| others[random.below(others.len())].to_string())
    };
    let is_number = |w: &str| w.starts_with(|c: char| c.is_ascii_digit());
    let is_name = |w: &str| w.starts_with(|c: char| c.is_ascii_alphabetic());
    let new = match random.below(5) {
        0 => with(""),
        1 if is_number(word) => {
            let place = random.below(word.len());
            let digit = word.as_bytes()[place];
            let other = if digit.is_ascii_digit() { (digit - b'0' + 1) % 10 + b'0' } else { b'1' };
            with(&[&word[..place], &char::from(other).to_string(), &word[place + 1..]].concat())
        }
        2 if text[next.clone()] == *word => return None,
        2 => [&text[..range.start], &text[next.clone()], " ", word, &text[next.end..]].concat(),
        _ if is_name(word) => with(&of_kind(|w| w.starts_with(|c: char| c.is_ascii_alphabetic()), random)?),
        _ if is_number(word) => with(&of_kind(|w| w.starts_with(|c: char| c.is_ascii_digit()), random)?),
        _ => with(["+", "-", "*", "/", "(", ")", ";", ",", "[", "]", "{", "}"][random.below(12)]),
    };
    let line = text[..range.start].matches('\n').count();
    let shown = new.lines().nth(line).unwrap_or_default().trim().to_string();
    (new != text).then(|| (new, format!("`{word}` in line {}: {shown}", line + 1)))
}

/// Whether a change is none: of the order of operands, of what nothing is done with, of a leading or trailing zero, of a space.
pub fn is_none(before: &str, after: &str) -> bool {
    let differing: Vec<(&str, &str)> = before.lines().zip(after.lines()).filter(|(a, b)| a != b).collect();
    let [(a, b)] = differing.as_slice() else { return false };
    let squeezed = |line: &str| line.split_whitespace().collect::<Vec<_>>().concat();
    let sorted = |line: &str| {
        let mut words: Vec<&str> = words(line).into_iter().map(|w| &line[w]).collect();
        words.sort_unstable();
        words.join(" ")
    };
    // b * a for a * b, x[9] for a turn of a name that is used once, (void)q for (void)qd
    let commutes = sorted(a) == sorted(b) && !a.contains(" - ") && !a.contains(" / ") && a.contains(['*', '+']);
    let numbers = |line: &str| -> Vec<String> {
        let number = |w: &str| w.trim_end_matches('F').parse::<f64>().map_or(w.to_string(), |x| format!("{x:?}"));
        words(line).into_iter().map(|w| number(&line[w])).collect()
    };
    squeezed(a) == squeezed(b)
        || commutes
        || a.trim().starts_with("(void)") && b.trim().starts_with("(void)")
        || numbers(a) == numbers(b)
}

/// How many files with a word changed there were, and which were not refused.
fn let_through(changes: usize) -> (usize, Vec<String>) {
    let (mut count, mut missed) = (0, Vec::new());
    for (k, (name, generated)) in kinds().iter().enumerate() {
        let mut random = Random(k as u64);
        let files = (C99_SOURCE.files)(generated, "robot");
        let mut reader = CReader::new(generated, "robot");
        reader.check(&files).unwrap_or_else(|mismatch| panic!("{name}: {mismatch}"));
        for (f, (file, text)) in files.iter().enumerate().filter(|(_, (file, _))| file != "README.md") {
            let own = words(text);
            for _ in 0..changes / if f == 0 { 1 } else { 4 } {
                let Some((new, what)) = changed(text, &own, &mut random) else { continue };
                let mut others = files.clone();
                others[f].1.clone_from(&new);
                count += 1;
                if reader.check(&others).is_ok() && !is_none(text, &new) {
                    missed.push(format!("{name}, {file}: {what}"));
                }
            }
        }
        reader.check(&files).unwrap_or_else(|mismatch| panic!("{name}: the reader kept something: {mismatch}"));
    }
    (count, missed)
}

#[test]
fn packages_with_a_word_changed_are_refused() {
    let (count, missed) = let_through(120);
    assert!(missed.is_empty(), "{} of {count} were let through:\n{}", missed.len(), missed.join("\n"));
    assert!(count > 600, "{count} changes are too few");
}

#[test]
#[ignore = "a minute or more: thousands of changes"]
fn long_proof_that_no_package_with_a_word_changed_is_let_through() {
    let (count, missed) = let_through(3000);
    assert!(missed.is_empty(), "{} of {count} were let through:\n{}", missed.len(), missed.join("\n"));
    assert!(count > 15_000, "{count} changes are too few");
}

#[test]
fn arrays_longer_than_what_is_put_there_are_refused() {
    let mut count = 0;
    for (name, generated) in kinds() {
        let files = (C99_SOURCE.files)(generated, "robot");
        let mut reader = CReader::new(generated, "robot");
        let c = files.iter().position(|(file, _)| file.ends_with(".c")).expect("it is there");
        for line in files[c].1.lines() {
            let words: Vec<&str> = line.trim().trim_end_matches("];").split([' ', '[']).collect();
            let (&[type_word @ ("double" | "float"), array, length], true) = (&words[..], line.ends_with("];")) else {
                continue;
            };
            let length: usize = length.parse().expect("a length");
            let mut others = files.clone();
            let longer = format!("{type_word} {array}[{}];", length + 1);
            others[c].1 = others[c].1.replacen(line.trim(), &longer, 1);
            let mismatch = reader.check(&others).expect_err(&longer);
            let what = &mismatch.what;
            assert!(what.contains("never put there") || what.contains("another type"), "{name}, {longer}: {mismatch}");
            count += 1;
        }
    }
    assert!(count > 8, "{count} arrays are too few");
}

/// Changes that compilers would not see, or that mean something else in C than they seem to.
#[test]
fn what_c_takes_otherwise_is_refused() {
    let options = Options { functions: vec![Function::MassMatrix], ..Options::default() };
    let generated = generated(&robot("descriptions/ur5.urdf"), &options);
    let files = (C99_SOURCE.files)(&generated, "robot");
    let mut reader = CReader::new(&generated, "robot");
    let at = |name: &str| files.iter().position(|(file, _)| file.ends_with(name)).expect("it is there");
    let (c, h, hpp) = (at(".c"), at(".h"), at(".hpp"));
    let mut refused = |file: usize, from: &str, to: &str, why: &str| {
        let mut others = files.clone();
        others[file].1 = others[file].1.replacen(from, to, 1);
        assert_ne!(others[file].1, files[file].1, "{from}");
        let mismatch = reader.check(&others).expect_err(to);
        assert!(mismatch.what.contains(why), "{from} to {to}: {mismatch}");
        assert_eq!(complaint(&mismatch).code, "internal-error");
    };
    for (from, to, why) in [
        // a decrement, a number in single precision, an integer, octal, a comment that goes on
        ("    turn = ", "    --turn = ", "statement that is not known"),
        ("= turn.sine;", "= (float)turn.sine;", "no program computes"),
        ("[0] = ", "[00] = ", "whole number"),
        ("\nvoid robot_mass_matrix(", "\n/* a ??/\n*/ void robot_mass_matrix(", "comment"),
        ("\nvoid robot_mass_matrix(", "\n#define turn 1\nvoid robot_mass_matrix(", "`if` is expected"),
        ("\nvoid robot_mass_matrix(", "\nint extra(void) { return 1; }\nvoid robot_mass_matrix(", "prefix"),
        (
            "\nvoid robot_mass_matrix(",
            "\nint robot_extra(void) { return 1; }\nvoid robot_mass_matrix(",
            "nothing asked for",
        ),
        ("\nvoid robot_mass_matrix(", "\nstatic void robot_mass_matrix(", "can call"),
        ("#pragma STDC FP_CONTRACT OFF", "#pragma STDC FP_CONTRACT ON", "compilers are told"),
        ("9.920935791635221e-10", "9.920935791635222e-10", "kernel"),
        ("#include <stdint.h>", "#include <stdint.h> /* a */ int x; /* b */", "is expected here"),
        ("return 6;", "return 7;", "is expected here"),
        ("\"shoulder_pan_joint\"", "\"shoulder_pan_join\"", "name of a joint"),
    ] {
        refused(c, from, to, why);
    }
    refused(h, "const double q[6]", "const double q[7]", "otherwise");
    refused(h, "void robot_mass_matrix(const double q[6], double h[36]);", "", "not declared");
    refused(h, "#define ROBOT_NQ 6", "#define ROBOT_NQ 5", "is expected");
    refused(hpp, "q.data(), h.data()", "h.data(), q.data()", "otherwise");
    refused(hpp, "std::array<double, 36>", "std::array<double, 35>", "otherwise");
}
