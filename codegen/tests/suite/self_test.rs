//! The self-test of generated text: compiled as others compile it, it passes; where a number is another one, it names the function.

use crate::cross;
use crate::standalone::{run, Folder};
use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use straightline_codegen::choices::TargetMachine;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::emit::Generated;
use straightline_codegen::options::{scene_file, Options};
use straightline_codegen::readback::checked;
use straightline_codegen::{compile, Function, Scalar};
use straightline_core::model::Limits;

const FUNCTIONS: [Function; 4] =
    [Function::InverseDynamics, Function::GravityForce, Function::MassMatrix, Function::Jacobian];

fn robot(name: &str) -> Source {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(name);
    Source::new(name, std::fs::read_to_string(path).expect("the robot is there"))
}

fn tested(functions: &[Function], scalar: Scalar) -> Options {
    Options { functions: functions.to_vec(), scalar, self_test: true, ..Options::default() }
}

fn with_scene(options: Options, text: &str) -> Options {
    let mut diagnostics = Diagnostics::new();
    let file = scene_file::read(&Source::new("scene.toml", text), &mut diagnostics);
    file.unwrap_or_else(|| panic!("{diagnostics}")).into_options(options)
}

fn generated(robot: &Source, options: &Options) -> Generated {
    compile(robot, options).unwrap_or_else(|errors| panic!("{errors}"))
}

const PAYLOAD: &str =
    "[outputs]\nstaged = true\n[[parameter]]\nkind = \"payload\"\nname = \"tool\"\nframe = \"panda_hand\"\n";

const CONTACT: &str = "[[contact]]\nname = \"pen\"\nframe = \"panda_hand\"\nconstrained = [\"pz\"]\n\
                       object = { origin = [0.5, 0.0, 0.2], z = [0.0, 0.0, 1.0] }\n[outputs]\ncontact = [\"forward_dynamics\", \"impact\", \
                       \"forward_dynamics_derivatives\"]\n";

/// Texts of robots with every kind of input: angles, quaternions, parameters, states of drives, and in contact, in both scalars.
fn texts() -> Vec<(&'static str, Generated)> {
    let torques = [Function::InverseDynamics, Function::GravityForce];
    let driven = [Function::InverseDynamics, Function::DrivenForwardDynamics];
    let m4 = Options { target: Some(TargetMachine::CORTEX_M4F), ..tested(&FUNCTIONS, Scalar::F32) };
    let both = Options { also: vec![Scalar::F32], ..tested(&[Function::ForwardDynamics], Scalar::F64) };
    let of = |name, options: Options| generated(&robot(name), &options);
    vec![
        ("panda", of("panda.urdf", tested(&FUNCTIONS, Scalar::F64))),
        ("panda_f32", of("panda.urdf", m4)),
        ("solo12", of("solo12.urdf", Options { model: floating(), ..both })),
        ("with_tool", of("panda.urdf", with_scene(tested(&torques, Scalar::F32), PAYLOAD))),
        ("in_contact", of("panda.urdf", with_scene(tested(&[Function::BiasForce], Scalar::F64), CONTACT))),
        ("driven", of("planar_2r.toml", with_scene(tested(&driven, Scalar::F64), DRIVES))),
    ]
}

const DRIVES: &str = include_str!("../../../robots/scenes/planar_2r_drives.toml");

fn floating() -> straightline_codegen::model::ModelOptions {
    straightline_codegen::model::ModelOptions { floating_base: true, ..Default::default() }
}

/// The text with the first constant of a function of another first digit behind the point.
fn with_another_constant(text: &str, function: &str) -> String {
    let start = text.find(&format!("pub fn {function}(")).expect("the function");
    let end = start + text[start..].find("\n}\n").expect("it ends");
    let is_digit = |c: char| c.is_ascii_digit();
    let at = text[start..end].match_indices('.').map(|(at, _)| start + at).find(|at| {
        let before = text[..*at].ends_with(is_digit);
        before && text[at + 1..].chars().take(4).all(is_digit)
    });
    let digit = at.expect("a constant of some digits") + 1;
    let other = if &text[digit..=digit] == "5" { "6" } else { "5" };
    [&text[..digit], other, &text[digit + 1..]].concat()
}

/// The text with one bit of the expected hash of a function changed, by its number.
fn with_another_hash(text: &str, function: usize) -> String {
    let expected = text.find("pub const EXPECTED").expect("the hashes");
    let (at, _) = text[expected..].match_indices("0x").nth(function).expect("the hash");
    let last = expected + at + 17;
    let digit = u8::from_str_radix(&text[last..=last], 16).expect("a digit") ^ 4;
    format!("{}{digit:x}{}", &text[..last], &text[last + 1..])
}

/// What programs print that have these texts as modules, compiled with these flags: of each its self-test, and a hash of many states.
fn printed(texts: &[(String, String)], flags: &[&str]) -> Vec<String> {
    let mut source = String::from("#![allow(warnings)]\n#![forbid(unsafe_code)]\n");
    for (name, text) in texts {
        let _ = writeln!(source, "mod {name} {{\n{text}\n}}");
    }
    source.push_str("fn main() {\n");
    for (name, _) in texts {
        let name = name.replace("__", "::");
        let _ =
            writeln!(source, "    println!(\"{{:?}} {{:x?}}\", {name}::self_test(), {name}::self_test_hashes(300));");
    }
    source.push_str("}\n");
    let folder = Folder::new(&format!("self-test-{}", flags.concat().replace(['=', '-'], "")));
    let program = folder.build("main", &source, flags).unwrap_or_else(|e| panic!("{e}"));
    run(&program, &[]).unwrap_or_else(|e| panic!("{e}")).lines().map(str::to_string).collect()
}

/// What is to be printed of a text that is right.
fn expected(generated: &Generated) -> String {
    let test = generated.programs.self_test.as_ref().expect("it was asked for");
    let functions = generated.programs.asked_for().zip(&test.functions);
    let hashes: Vec<(String, u64)> =
        functions.map(|((_, f), t)| (t.path(), test.hash(&f.graph, t, generated.scalar, 300))).collect();
    format!("Ok(()) {hashes:x?}")
}

#[test]
fn a_machine_that_computes_what_was_generated_passes_and_others_are_told_the_function() {
    let good = texts();
    let mut all: Vec<(String, String)> = good.iter().map(|(name, g)| (name.to_string(), g.text.clone())).collect();
    for (k, function) in FUNCTIONS.iter().enumerate() {
        for of in [0, 1] {
            let (name, text) = &all[of];
            let (name, text) = (format!("{name}_{}", function.name()), text);
            let changed = [with_another_constant(text, function.name()), with_another_hash(text, k)];
            let [constant, hash] = changed;
            all.push((format!("{name}_constant"), constant));
            all.push((format!("{name}_hash"), hash));
        }
    }
    let flags: [&[&str]; 2] = [&["-Copt-level=0"], &["-Copt-level=3"]];
    for flags in flags {
        let printed = printed(&all, flags);
        for ((name, generated), line) in good.iter().zip(&printed) {
            assert_eq!(*line, expected(generated), "{name} {flags:?}");
        }
        for ((name, _), line) in all.iter().zip(&printed).skip(good.len()) {
            // the order of functions in the text is that of the list of all
            let function = FUNCTIONS.iter().find(|f| name.contains(f.name())).expect("its function");
            assert!(line.starts_with(&format!("Err({:?})", function.name())), "{name} {flags:?}: {line}");
        }
    }
}

#[test]
fn other_scalars_have_a_test_of_their_own() {
    let (_, generated) = &texts()[2];
    assert_eq!(generated.text.matches("pub fn self_test()").count(), 2);
    let module = generated.text.find("pub mod single {").expect("the module of f32");
    assert!(generated.text[module..].contains("fn draw(random: &mut u32, ranges: &[[f32; 2]]"));
    let printed = printed(&[("solo12".to_string(), generated.text.clone())], &["-Copt-level=1"]);
    assert_eq!(printed, [expected(generated)]);
    let single = generated.text.replacen("pub mod single {", "pub use single::self_test;\npub mod single {", 1);
    let single = single.replacen("pub fn self_test()", "pub fn self_test_of_double()", 1);
    let passes = self::printed(&[("solo12".to_string(), single)], &["-Copt-level=1"]);
    assert!(passes[0].starts_with("Ok(())"), "{passes:?}");
}

/// Ranges that states are drawn in, and a hash per function: what a device keeps, code aside.
#[test]
fn data_of_all_functions_are_a_few_hundred_bytes() {
    for (name, most) in [("panda.urdf", 240), ("solo12.urdf", 480), ("simple_humanoid.urdf", 800)] {
        let mut options = tested(&Options::default().functions, Scalar::F32);
        options.model.floating_base = name != "panda.urdf";
        let generated = generated(&robot(name), &options);
        let test = generated.programs.self_test.as_ref().expect("it was asked for");
        let ranges: usize = test.ranges.iter().map(|ranges| 8 * ranges.pairs.len()).sum();
        let bytes = 8 * test.functions.len() + ranges;
        println!("{name}: {} functions, {bytes} B", test.functions.len());
        assert!(test.functions.len() > 10 && bytes <= most, "{name}: {bytes} B");
    }
}

/// All numbers of results at the states are numbers, in their ranges, and differ from state to state.
#[test]
fn what_is_compared_are_numbers_within_the_ranges_of_the_inputs() {
    for name in ["panda.urdf", "solo12.urdf", "simple_humanoid.urdf", "hyq.urdf", "planar_2r.toml", "chapter_6r.toml"] {
        for scalar in [Scalar::F32, Scalar::F64] {
            let functions: Vec<Function> = Function::all().collect();
            let generated = generated(&robot(name), &tested(&functions, scalar));
            let test = generated.programs.self_test.as_ref().expect("it was asked for");
            assert_eq!(test.functions.len(), generated.items.len(), "{name}");
            for ((_, function), tested) in generated.programs.asked_for().zip(&test.functions) {
                let states = test.states(tested, scalar, 50);
                let mut all: Vec<Vec<u64>> = Vec::new();
                for inputs in states {
                    let results = straightline_codegen::certify::search::computed_at(&function.graph, scalar, &inputs);
                    assert!(results.iter().all(|x| x.is_finite()), "{name} {} at {inputs:?}", function.name);
                    all.push(inputs.iter().map(|x| x.to_bits()).collect());
                    if function.graph.inputs.first().is_some_and(|port| port.name == "q") {
                        let joints = generated.model.free_joints();
                        for joint in joints.clone().filter(|joint| joint.kind.is_single()) {
                            let q = inputs[joint.iq];
                            let Limits { lower, upper, .. } = joint.limits;
                            assert!(lower.max(-10.0) - 1e-6 <= q && q <= upper.min(10.0) + 1e-6, "{name}: {q}");
                        }
                        for first in joints.filter_map(|joint| Some(joint.iq + joint.kind.row().quaternion?)) {
                            let norm: f64 = inputs[first..first + 4].iter().map(|x| x * x).sum();
                            assert!((norm - 1.0).abs() < 8.0 * scalar.epsilon(), "{name}: {norm}");
                        }
                    }
                }
                all.sort();
                all.dedup();
                assert_eq!(all.len(), 50, "{name} {}: states are not all others", function.name);
            }
        }
    }
}

#[test]
fn a_text_with_a_self_test_is_read_back() {
    for (name, generated) in texts() {
        let mut refused = 0;
        for (word, other) in [
            ("self_test_hashes(8)", "self_test_hashes(0)"),
            ("hash != expected", "hash == expected"),
            ("0x", "0x1"),
            (">> 8", ">> 9"),
            ("super::", "self::"),
            ("hash = hashed(", "let _ = hashed("),
            ("2463534242", "2463534243"),
            ("const Q: [[f32; 2]; 7] = [[", "const Q: [[f32; 2]; 7] = [[1"),
            ("super::Tool([", "super::Tool([1"),
            ("quaternion(q[3], q[4], q[5])", "quaternion(q[3], q[4], q[3])"),
        ] {
            let at = generated.text.find("pub fn self_test()").expect("the functions");
            let text = [&generated.text[..at], &generated.text[at..].replacen(word, other, 1)].concat();
            if text != generated.text {
                assert!(checked(Generated { text, ..generated.clone() }).is_err(), "{name}: {word} -> {other}");
                refused += 1;
            }
        }
        assert!(refused >= 7, "{name}");
        let wrong = Generated { text: with_another_hash(&generated.text, 0), ..generated.clone() };
        assert!(checked(wrong).is_err(), "{name}");
        let unasked = without(generated);
        assert!(checked(unasked).is_err(), "{name}: a self-test that nobody asked for");
    }
}

fn without(mut generated: Generated) -> Generated {
    generated.programs.self_test = None;
    generated
}

#[test]
fn fused_functions_have_no_self_test() {
    let options = Options { fma: true, ..tested(&FUNCTIONS, Scalar::F64) };
    let refusal = compile(&robot("panda.urdf"), &options).expect_err("bits differ").render();
    assert!(refusal.contains("self-test-fused") && refusal.contains("remove `self_test`, or `fma`"), "{refusal}");
}

/// With functions that may not become part of others, as they would in an object of their own.
#[test]
fn an_object_for_a_cortex_m4_needs_nothing() {
    let folder = Folder::new("self-test-thumb");
    // constructors of parameters and stages hand on arrays by a call where code is to be small, with a self-test or without
    let is_small = |g: &Generated| g.scalar == Scalar::F32 && g.programs.parameters.is_empty();
    for (name, generated) in texts().into_iter().filter(|(_, generated)| is_small(generated)) {
        for level in ["-Copt-level=z", "-Copt-level=s", "-Copt-level=3"] {
            let source = format!("#![no_std]\n#![allow(warnings)]\n{}", generated.text);
            let flags = ["--crate-type=rlib", "--target=thumbv7em-none-eabihf", "--emit=obj", "-Cpanic=abort", level];
            let object = match folder.build_by(&cross::rustc(), name, &source, &flags) {
                Ok(object) => object,
                Err(error) if error.contains("can't find crate for `core`") => {
                    eprintln!(
                        "skipped: rustc has no target thumbv7em-none-eabihf (rustup target add thumbv7em-none-eabihf)"
                    );
                    return;
                }
                Err(error) => panic!("{error}"),
            };
            let Ok(output) = Command::new("nm").arg(&object).output() else {
                eprintln!("skipped: there is no nm");
                return;
            };
            let symbols = String::from_utf8_lossy(&output.stdout).into_owned();
            assert!(symbols.contains("self_test_hashes"), "{symbols}");
            let wanted = symbols.lines().filter(|line| line.contains(" U ") && !line.contains("4core3fmt"));
            assert_eq!(wanted.collect::<Vec<_>>(), [""; 0], "{name} {level}");
        }
    }
}
