//! Functions in fixed point: found errors beside certified ones, compiled text beside the interpreter, and programs broken on purpose.

use super::readback::random_robot;
use crate::cross;
use crate::standalone::Folder;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use straightline_codegen::choices::FixedProducts;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::expr::evaluate;
use straightline_codegen::fixed::{FixedProgram, WordOp};
use straightline_codegen::options::scene_file;
use straightline_codegen::program::fixed::{check, FixedFunction};
use straightline_codegen::{compile, Function, Generated, Options};
use straightline_core::random::Random;
use straightline_core::Dd;

const SCENE: &str = "[numbers.ranges]\nqd = [-2.5, 2.5]\nqdd = [-10.0, 10.0]\n";
const PRODUCTS: [FixedProducts; 2] = [FixedProducts::Wide, FixedProducts::Halves];

fn options(functions: &[Function], products: FixedProducts, error: f64) -> Options {
    let mut diagnostics = Diagnostics::new();
    let file = scene_file::read(&Source::new("scene.toml", SCENE), &mut diagnostics);
    let base = Options { fixed: Some(products), fixed_error: error, ..Options::default() };
    let options = file.unwrap_or_else(|| panic!("{diagnostics}")).into_options(base);
    Options { functions: functions.to_vec(), ..options }
}

fn generated(robot: &Source, options: &Options) -> Generated {
    compile(robot, options).unwrap_or_else(|errors| panic!("{}: {errors}", robot.path()))
}

fn file(name: &str) -> Source {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(name);
    Source::new(name, std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display())))
}

/// A state in the box: anywhere, or with every input at an end of its range.
fn state(made: &FixedFunction, random: &mut Random, at_corners: bool) -> Vec<f64> {
    let mut place = |r: &straightline_codegen::certify::Interval| match at_corners {
        true => [r.lo, r.hi][random.below(2)],
        false => (r.lo + (r.hi - r.lo) * random.unit()).clamp(r.lo, r.hi),
    };
    made.inputs.iter().map(&mut place).collect()
}

/// The error of every result at a state, as a part of the certified one.
fn parts(made: &FixedFunction, x: &[f64]) -> Vec<f64> {
    let found = made.program.words.run(&made.program.words_of(x)).unwrap_or_else(|over| panic!("{over:?} at {x:?}"));
    let truth = evaluate::<Dd>(&made.graph, &x.iter().map(|x| Dd::from(*x)).collect::<Vec<_>>());
    let found = made.program.numbers_of(&found).into_iter().map(Dd::from);
    let errors = found.zip(truth).map(|(found, truth)| (found - truth).to_f64().abs());
    errors.zip(&made.program.errors).map(|(e, bound)| if e == 0.0 { 0.0 } else { e / bound }).collect()
}

/// The worst found by a search from many states: whichever move of an input makes the worst result worse is kept.
fn worst_found(made: &FixedFunction, states: usize, moves: usize) -> f64 {
    let mut random = Random(11);
    let worst_at = |x: &[f64]| parts(made, x).into_iter().fold(0.0, f64::max);
    let mut best = (0.0, Vec::new());
    for k in 0..states {
        let x = state(made, &mut random, k % 2 == 0);
        let part = worst_at(&x);
        if part > best.0 {
            best = (part, x);
        }
    }
    for _ in 0..moves {
        let mut x = best.1.clone();
        let k = random.below(x.len());
        let r = made.inputs[k];
        x[k] = (x[k] + (r.hi - r.lo) * random.symmetric(1.0) * 10f64.powf(-9.0 * random.unit())).clamp(r.lo, r.hi);
        let part = worst_at(&x);
        if part > best.0 {
            best = (part, x);
        }
    }
    best.0
}

/// Robots with all kinds of joints and axes.
fn robots() -> Vec<Source> {
    let random = (0..4).map(|seed| random_robot(100 + seed, 1 + seed as usize % 2, 2 + seed as usize % 3));
    [file("planar_2r.toml"), file("ur5.urdf")].into_iter().chain(random).collect()
}

#[test]
fn no_state_of_random_robots_overflows_or_goes_beyond_its_bound() {
    let functions = [Function::InverseDynamics, Function::MassMatrix, Function::GravityForce];
    for robot in robots() {
        for products in PRODUCTS {
            let error = if products == FixedProducts::Wide { 1e-6 } else { 1e-4 };
            let generated = generated(&robot, &options(&functions, products, error));
            assert_eq!(generated.fixed.len(), functions.len());
            for made in &generated.fixed {
                let name = format!("{} {} {products:?}", robot.path(), made.function.name());
                assert!(made.program.worst() <= error, "{name}");
                // gravity of what lies in a plane is zero
                if made.inputs.is_empty() || made.program.worst() == 0.0 {
                    continue;
                }
                let worst = worst_found(made, 150, 150);
                assert!(worst <= 1.0, "{name}: {worst} times what is certified");
                assert!(worst > 1.0 / 20.0, "{name}: no more than {worst} of what is certified");
            }
        }
    }
}

/// The Panda's torques with 1e-7 of full scale certified, and also a tenth of a thousandth without long products.
#[test]
fn the_torques_of_an_arm_are_certified_to_1e_minus_7_of_full_scale() {
    for (products, error) in [(FixedProducts::Wide, 1e-7), (FixedProducts::Halves, 1e-4), (FixedProducts::Halves, 1e-7)]
    {
        let generated = generated(&file("panda.urdf"), &options(&[Function::InverseDynamics], products, error));
        let [made] = &generated.fixed[..] else { panic!("one function") };
        assert!(made.program.worst() <= error);
        let worst = worst_found(made, 300, 300);
        assert!(worst > 1.0 / 20.0 && worst <= 1.0, "{products:?}: found {worst} of what is certified");
        let [products, sums, shifts, sines] = made.program.words.counts();
        assert!(products <= 265 && sums <= 259 && sines == 6, "{products} products, {sums} sums, {sines} sines");
        assert!(shifts < 200, "{shifts} shifts");
    }
}

/// The same program with one word changed: a shift or a constant that is off by a bit, another operation or operand.
fn broken(program: &FixedProgram, at: usize, how: usize) -> Option<FixedProgram> {
    let mut broken = program.clone();
    let word = &mut broken.words.words[at];
    *word = match (*word, how) {
        (WordOp::Left(a, k), 0) => WordOp::Left(a, k + 1),
        (WordOp::Left(a, k), _) => WordOp::Left(a, k - 1),
        (WordOp::Right(a, k), 0) => WordOp::Right(a, k + 1),
        (WordOp::Right(a, k), _) => WordOp::Right(a, k - 1),
        // a point off by one
        (WordOp::Constant(c), 0) if c.unsigned_abs() > 1000 => WordOp::Constant(c / 2),
        (WordOp::Constant(c), 1) if c.unsigned_abs() > 1000 => WordOp::Constant(c.checked_mul(2)?),
        (WordOp::Add(a, b), 0) => WordOp::Sub(a, b),
        (WordOp::Add(a, _), 1) => WordOp::Add(a, a),
        (WordOp::Sub(a, b), 0) => WordOp::Sub(b, a),
        (WordOp::Sub(a, b), 1) => WordOp::Add(a, b),
        (WordOp::SinCos(a, bits, turns), 0) if bits > 24 => WordOp::SinCos(a, bits - 1, turns),
        (WordOp::Sin(pair), 0) => WordOp::Cos(pair),
        (WordOp::Cos(pair), 0) => WordOp::Sin(pair),
        _ => return None,
    };
    (broken != *program).then_some(broken)
}

#[test]
fn programs_broken_on_purpose_do_not_pass_the_check() {
    let (mut all, mut passed) = (0, Vec::new());
    for (robot, products) in [("planar_2r.toml", FixedProducts::Wide), ("puma560.urdf", FixedProducts::Halves)] {
        let generated = generated(&file(robot), &options(&[Function::InverseDynamics], products, 1e-5));
        let made = &generated.fixed[0];
        check(made).unwrap_or_else(|what| panic!("{robot}: {what}"));
        for at in 0..made.program.words.words.len() {
            for how in 0..2 {
                let Some(program) = broken(&made.program, at, how) else { continue };
                all += 1;
                let made = FixedFunction { program, ..made.clone() };
                if check(&made).is_ok() {
                    passed.push((robot, at, how, made.program.words.words[at]));
                }
            }
        }
        // points of inputs and results off by one, bounds that are too small
        for how in 0..4 {
            let mut program = made.program.clone();
            match how {
                0 => program.input_bits[0] -= 1,
                1 => program.output_bits[0] += 1,
                2 => program.input_bits[2] -= 1,
                _ => program.errors.iter_mut().for_each(|e| *e /= 60.0),
            }
            let made = FixedFunction { program, ..made.clone() };
            assert!(check(&made).is_err(), "{robot}: broken {how} passes");
        }
    }
    // what is below the bound of the error is none
    assert!(passed.len() * 20 < all, "{} of {all} pass: {passed:?}", passed.len());
}

/// Ranges that are half as wide as the inputs: words overflow.
#[test]
fn a_box_that_is_too_small_by_two_is_found_at_the_corners() {
    let generated = generated(&file("planar_2r.toml"), &options(&[Function::InverseDynamics], PRODUCTS[0], 1e-6));
    let made = &generated.fixed[0];
    let wider = made.inputs.iter().map(|r| straightline_codegen::certify::Interval { lo: 2.0 * r.lo, hi: 2.0 * r.hi });
    let wider = FixedFunction { inputs: wider.collect(), ..made.clone() };
    let what = check(&wider).expect_err("words that are too large pass");
    assert!(what.contains("overflows") || what.contains("is off by"), "{what}");
}

fn scratch() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fixed");
    std::fs::create_dir_all(&folder).expect("a folder for programs");
    folder
}

/// Compiled text gives the interpreter's bits, with overflow checks on.
#[test]
fn compiled_text_has_the_bits_of_the_interpreter() {
    for products in PRODUCTS {
        let functions = [Function::InverseDynamics, Function::MassMatrix];
        let generated = generated(&random_robot(7, 2, 2), &options(&functions, products, 1e-5));
        let mut source = format!("{}\nfn main() {{\n", generated.text);
        let mut expected = String::new();
        let mut random = Random(21);
        for k in 0..40 {
            let made = &generated.fixed[k % 2];
            let words = made.program.words_of(&state(made, &mut random, k % 3 == 0));
            let results = made.program.words.run(&words).unwrap_or_else(|over| panic!("{over:?}"));
            let _ = writeln!(expected, "{results:?}");
            let (mut first, mut given) = (0, Vec::new());
            for port in &made.program.words.inputs {
                given.push(format!("&{:?}", &words[first..first + port.len()]));
                first += port.len();
            }
            let (nv, name) = (generated.model.nv(), made.function.name());
            let zero = if k % 2 == 0 { format!("[0; {nv}]") } else { format!("[[0; {nv}]; {nv}]") };
            let flat = if k % 2 == 0 { "out.to_vec()" } else { "out.concat()" };
            let _ = writeln!(
                source,
                "{{ let mut out = {zero}; fixed::{name}({}, &mut out); println!(\"{{:?}}\", {flat}); }}",
                given.join(", ")
            );
        }
        source.push_str("}\n");
        let name = format!("bits_{products:?}");
        let (file, program) = (scratch().join(format!("{name}.rs")), scratch().join(&name));
        std::fs::write(&file, source).expect("the program can be written");
        let built = Command::new(cross::rustc())
            .args(["--edition", "2021", "-C", "opt-level=1", "-C", "overflow-checks=on", "-A", "warnings", "-o"])
            .args([&program, &file])
            .output()
            .expect("rustc runs");
        assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
        let output = Command::new(&program).output().expect("the program runs");
        assert_eq!(String::from_utf8_lossy(&output.stdout), expected, "{products:?}");
    }
}

/// The object of the module alone, where there is `core` and nothing else.
///
/// # Errors
/// What rustc says.
fn object_of_module(folder: &Folder, generated: &Generated, target: &str, cpu: &str) -> Result<PathBuf, String> {
    let module = generated.text.find("pub mod fixed {").expect("there is a module");
    let source = format!("#![no_std]\n#![forbid(unsafe_code)]\n{}", &generated.text[module..]);
    let cpu = format!("-Ctarget-cpu={cpu}");
    let flags = ["--crate-type=lib", "--emit=obj", "-Cpanic=abort", "--cap-lints=allow", "--target", target, &cpu];
    // the crate's name
    folder.build_by(&cross::rustc(), &target.replace('.', "_"), &source, &flags)
}

/// No call that is not its own, so no panic either.
#[test]
fn objects_for_small_machines_call_nothing() {
    let folder = Folder::new("fixed-objects");
    for (products, target, cpu) in [
        (FixedProducts::Halves, "thumbv6m-none-eabi", "cortex-m0plus"),
        (FixedProducts::Wide, "thumbv7m-none-eabi", "cortex-m3"),
        (FixedProducts::Wide, "riscv32imac-unknown-none-elf", "generic-rv32"),
    ] {
        let generated = generated(&file("planar_2r.toml"), &options(&[Function::InverseDynamics], products, 1e-5));
        let object = match object_of_module(&folder, &generated, target, cpu) {
            Ok(object) => object,
            Err(error) if error.contains("can't find crate for `core`") => {
                eprintln!("skipped: no `core` for {target}");
                continue;
            }
            Err(error) => panic!("{error}"),
        };
        match Command::new("nm").arg("-u").arg(&object).output() {
            Ok(symbols) => assert_eq!(String::from_utf8_lossy(&symbols.stdout).trim(), "", "{target}"),
            Err(_) => eprintln!("skipped: no `nm`"),
        }
    }
}

/// Products of which the upper half is kept are one instruction where a machine has instructions for signals, with the sum behind it too.
#[test]
fn machines_with_instructions_for_signals_use_them() {
    let Some(objdump) = cross::program("arm-none-eabi-objdump") else { return };
    let folder = Folder::new("fixed-signals");
    let functions = [Function::InverseDynamics];
    let generated = generated(&file("puma560.urdf"), &options(&functions, FixedProducts::Wide, 1e-6));
    for (target, cpu, wanted) in [
        ("thumbv7em-none-eabihf", "cortex-m4", ["smmul", "smmla"]),
        ("thumbv8m.main-none-eabihf", "cortex-m33", ["smmul", "smmla"]),
        ("thumbv7m-none-eabi", "cortex-m3", ["smull", "smull"]),
    ] {
        let object = object_of_module(&folder, &generated, target, cpu).unwrap_or_else(|error| panic!("{error}"));
        let listing = Command::new(&objdump).arg("-d").arg(&object).output().expect("objdump runs");
        let listing = String::from_utf8_lossy(&listing.stdout).into_owned();
        let count = |name: &str| listing.lines().filter(|line| line.contains(&format!("\t{name}"))).count();
        println!("{cpu}: {}", wanted.map(|name| format!("{} {name}", count(name))).join(", "));
        assert!(wanted.iter().all(|name| count(name) > 30), "{cpu}");
    }
}
