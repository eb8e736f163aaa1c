//! Whatever is compiled without an error compiles as Rust, whatever the robot file, the scene and the options are.
//!
//! Every case goes through the library and then through a small compiler's front of our own (`scope`): syntax by `syn`, names by
//! a table of what is in scope. Some go through rustc, many of them in the test that is ignored.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;
use straightline_codegen::choices::Lanes;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::options::scene_file;
use straightline_codegen::options::Options;
use straightline_codegen::{compile, identifier, Function, Grade, Scalar};

/// What robots, links, joints, frames, parameters, contacts and modes of a case are called.
#[derive(Clone, Debug)]
struct Case {
    robot: String,
    link: String,
    joint: String,
    payload: String,
    contact: String,
    mode: String,
    style: usize,
}

/// A text as TOML writes it.
fn quoted(text: &str) -> String {
    let escaped = |c: char| match c {
        '"' | '\\' => format!("\\{c}"),
        c if c.is_control() => format!("\\u{:04X}", u32::from(c)),
        c => c.to_string(),
    };
    format!("\"{}\"", text.chars().map(escaped).collect::<String>())
}

impl Case {
    fn plain() -> Case {
        let [robot, link, joint, payload, contact, mode] =
            ["arm", "forearm", "elbow", "tool", "pen", "writing"].map(String::from);
        Case { robot, link, joint, payload, contact, mode, style: 0 }
    }

    /// The same name for everything.
    fn all(name: &str, style: usize) -> Case {
        let [robot, link, joint, payload, contact, mode] = std::array::from_fn(|_| name.to_string());
        Case { robot, link, joint, payload: payload + "2", contact, mode, style }
    }

    fn robot_file(&self) -> String {
        format!(
            "[robot]\nname = {}\n[[link]]\nname = \"ground\"\n\
             [[link]]\nname = \"upper\"\nmass = 1.5\ncom = [0.1, 0.02, -0.4]\ninertia = [0.02, 0.03, 0.025]\n\
             [[link]]\nname = {1}\nmass = 0.7\ncom = [0.01, 0.2, -0.1]\ninertia = [0.01, 0.02, 0.015]\n\
             [[joint]]\nname = \"shoulder\"\nkind = \"continuous\"\nparent = \"ground\"\nchild = \"upper\"\naxis = \"y\"\n\
             [[joint]]\nname = {2}\nkind = \"prismatic\"\nparent = \"upper\"\nchild = {1}\naxis = \"x\"\n\
             limits = {{ lower = -1.0, upper = 1.0, velocity = 2.0, effort = 50.0 }}\n",
            quoted(&self.robot),
            quoted(&self.link),
            quoted(&self.joint)
        )
    }

    fn scene_file(&self) -> String {
        let [link, payload, contact, mode] =
            [&self.link, &self.payload, &self.contact, &self.mode].map(|name| quoted(name));
        let staged = if self.style % 2 == 1 { "staged = true\n" } else { "" };
        let parameters = format!(
            "[[parameter]]\nkind = \"payload\"\nname = {payload}\nframe = {link}\n\
             [[parameter]]\nkind = \"link\"\nlink = {link}\n"
        );
        let contact = format!(
            "[[contact]]\nname = {contact}\nframe = {link}\nobject = {{ origin = [0.5, 0.0, 0.2], z = [0.0, 0.0, 1.0] }}\n\
             constrained = [\"pz\"]\n[[mode]]\nname = {mode}\ncontacts = [{contact}]\n"
        );
        format!(
            "[outputs]\nfunctions = [\"gravity_force\", \"mass_matrix\"]\ncontact = [\"forward_dynamics\", \"impact\"]\n{staged}\
             mass_matrix = {{ joints = [{0}] }}\n{parameters}{contact}",
            quoted(&self.joint)
        )
    }

    fn options(&self) -> Options {
        // names are what counts here: no search for the cheapest form
        let base = Options { frames: vec![self.link.clone()], grade: Grade::Exact, ..Options::default() };
        match self.style % 6 {
            0 => base,
            1 => Options { scalar: Scalar::F32, also: vec![Scalar::F64], ..base },
            2 => Options { lanes: Some(Lanes::Standalone), fma: true, ..base },
            3 => Options { certify: Some(Default::default()), fma: true, ..base },
            4 => Options { lanes: Some(Lanes::Standalone), scalar: Scalar::F32, ..base },
            _ => Options { limits: straightline_codegen::schedule::ScheduleLimits { operations: 40 }, ..base },
        }
    }

    /// The text, or what is wrong.
    fn text(&self) -> Result<String, Diagnostics> {
        let mut diagnostics = Diagnostics::new();
        let source = Source::new("scene.toml", self.scene_file());
        let Some(file) = scene_file::read(&source, &mut diagnostics) else { return Err(diagnostics) };
        let options = file.into_options(self.options());
        compile(&Source::new("robot.toml", self.robot_file()), &options).map(|generated| generated.text)
    }
}

/// Names that people would not choose, and some that they do.
const HOSTILE: [&str; 58] = [
    "loop",
    "static",
    "move",
    "in",
    "type",
    "box",
    "fn",
    "match",
    "self",
    "Self",
    "super",
    "crate",
    "g",
    "h",
    "result",
    "ok",
    "cost",
    "N",
    "T",
    "t1",
    "omega1_x",
    "sin_q1",
    "c1",
    "C1",
    "live",
    "lane",
    "inverse_dynamics",
    "gravity_force_part1",
    "gravity_force_lanes",
    "mass_matrix_parameters",
    "tool_parameters",
    "pen_pose",
    "pen_own_rate",
    "tau_error",
    "contact",
    "mode",
    "trig",
    "forward_dynamics",
    "Mode",
    "Configuration",
    "values",
    "(2R)",
    "[7dof]",
    "2nd",
    "_",
    "__",
    "r#loop",
    "r#type",
    "a b",
    "a-b",
    "a\tb",
    "a\nfn main() {}",
    "a\r",
    "*/ #error /*",
    "\"; panic!(); \"",
    "\\",
    "{}",
    "{0:?}",
];
const FOREIGN: [&str; 16] = [
    "\u{202e}abc",
    "abc\u{202c}\u{2066}",
    "\u{feff}",
    "\u{200b}",
    "a\u{0}b",
    "\u{440}\u{443}\u{43a}\u{430}",
    "\u{673a}\u{5668}\u{4eba}",
    "Fu\u{df}",
    "e\u{301}",
    "\u{e9}",
    "\u{1f916}",
    "\u{2028}x",
    "\u{85}",
    "`[Self]`",
    "\u{661}\u{662}",
    "\u{10ffff}",
];

/// Every name as each of the things that a case names, and as all of them.
fn cases() -> Vec<Case> {
    let long = "very_long_".repeat(50);
    let names: Vec<&str> = HOSTILE.into_iter().chain(FOREIGN).chain([long.as_str()]).collect();
    let mut cases: Vec<Case> = (0..6).map(|style| Case { style, ..Case::plain() }).collect();
    for (k, name) in names.iter().enumerate() {
        cases.push(Case::all(name, k));
        cases.push(Case { payload: name.to_string(), style: k + 1, ..Case::plain() });
    }
    for (k, pair) in names.chunks(2).enumerate() {
        let [link, mode] = [pair[0], pair[pair.len() - 1]].map(String::from);
        cases.push(Case { link, mode, style: k + 2, ..Case::plain() });
    }
    cases
}

/// The cases that are compiled, with their texts; the others have been refused for their names, or for what two names become.
fn compiled(cases: Vec<Case>) -> Vec<(Case, String)> {
    let mut compiled = Vec::new();
    for case in cases {
        match case.text() {
            Ok(text) => compiled.push((case, text)),
            Err(refusal) => {
                let of_names = ["parameter-name", "contact-name", "empty-name", "duplicate-name"];
                assert!(refusal.iter().any(|d| of_names.contains(&d.code)), "{case:?}\n{refusal}");
            }
        }
    }
    compiled
}

#[track_caller]
fn assert_is_rust(compiled: &[(Case, String)]) {
    let mut wrong = String::new();
    for (case, text) in compiled {
        let complaints = crate::scope::complaints(text);
        if !complaints.is_empty() {
            wrong += &format!("{case:?}\n  {}\n", complaints.join("\n  "));
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// Compiles texts, each as a module; what rustc denies by itself counts.
#[track_caller]
fn assert_rustc_takes(name: &str, texts: impl Iterator<Item = String>, arguments: &[&str]) {
    let modules = texts.enumerate().map(|(k, text)| format!("pub mod m{k} {{\n{text}\n}}\n"));
    let text = format!("#![no_std]\n#![forbid(unsafe_code)]\n#![allow(warnings)]\n{}", modules.collect::<String>());
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.rs"));
    std::fs::write(&file, text).unwrap();
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let output = Command::new(rustc)
        .args(["--edition=2021", "--crate-type=lib", "--crate-name=names", "--emit=metadata", "--out-dir"])
        .arg(env!("CARGO_TARGET_TMPDIR"))
        .args(arguments)
        .arg(&file)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}", said.chars().take(6000).collect::<String>());
}

#[test]
fn whatever_is_compiled_is_rust() {
    let compiled = compiled(cases());
    // most are, and none is refused for a reserved word
    assert!(compiled.len() > 150, "{}", compiled.len());
    assert_is_rust(&compiled);
    let sample = compiled.into_iter().step_by(9).map(|(_, text)| text);
    assert_rustc_takes("sample", sample, &[]);
}

#[test]
#[ignore = "minutes: every word of the generated files as a name, through rustc"]
fn every_word_of_the_generated_files_is_a_name_that_compiles() {
    let mut words: BTreeSet<String> = identifier::reserved().map(String::from).collect();
    for style in 0..6 {
        let text = Case { style, ..Case::plain() }.text().unwrap();
        let word = |w: &str| !w.is_empty() && !w.starts_with(|c: char| c.is_ascii_digit());
        let is_letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
        words.extend(text.split(|c| !is_letter(c)).filter(|w| word(w)).map(String::from));
    }
    let words: Vec<String> = words.into_iter().collect();
    let mut all = Vec::new();
    for (k, three) in words.chunks(3).enumerate() {
        let [link, payload, mode] = std::array::from_fn(|i| three[i.min(three.len() - 1)].clone());
        all.push(Case {
            link,
            payload: payload + if three.len() < 3 { "2" } else { "" },
            mode,
            style: k,
            ..Case::plain()
        });
    }
    let compiled = compiled(all);
    println!("{} words, {} of {} cases compiled", words.len(), compiled.len(), words.len().div_ceil(3));
    assert_is_rust(&compiled);
    assert_rustc_takes("words", compiled.into_iter().map(|(_, text)| text), &[]);
}

/// The arm with one of its numbers replaced.
fn with(number: &str, by: &str) -> String {
    let file = Case::plain().robot_file();
    assert!(file.contains(number), "{number}");
    file.replacen(number, by, 1)
}

fn in_scalar(robot: &str, scalar: Scalar) -> Result<String, Diagnostics> {
    let functions = vec![Function::InverseDynamics, Function::MassMatrix, Function::ForwardDynamics];
    let options = Options { functions, scalar, grade: Grade::Exact, ..Options::default() };
    compile(&Source::new("robot.toml", robot), &options).map(|generated| generated.text)
}

#[test]
fn a_limit_beyond_f32_is_no_limit() {
    for limit in ["1e40", "1.7976931348623157e308"] {
        let robot = with(
            "lower = -1.0, upper = 1.0, velocity = 2.0",
            &format!("lower = -{limit}, upper = {limit}, velocity = {limit}"),
        );
        let text = in_scalar(&robot, Scalar::F32).unwrap_or_else(|d| panic!("{d}"));
        assert!(text.contains("UPPER_LIMITS: [f32; 2] = [f32::INFINITY, f32::INFINITY]"), "{text}");
        assert!(text.contains("LOWER_LIMITS: [f32; 2] = [-f32::INFINITY, -f32::INFINITY]"), "{text}");
        assert_eq!(crate::scope::complaints(&text), [""; 0]);
        let wide = in_scalar(&robot, Scalar::F64).unwrap_or_else(|d| panic!("{d}"));
        assert_eq!(crate::scope::complaints(&wide), [""; 0]);
    }
}

#[test]
fn a_number_that_f32_cannot_hold_is_an_error_at_its_place_and_dust_is_not() {
    for (number, by, place) in [
        ("mass = 1.5", "mass = 1e40", "robot.toml:7:8"),
        ("mass = 1.5", "mass = 1e-45", "robot.toml:7:8"),
        ("com = [0.1,", "com = [1e45,", "robot.toml:8:7"),
        ("inertia = [0.02, 0.03, 0.025]", "inertia = [2e39, 3e39, 2.5e39]", "robot.toml:9:11"),
    ] {
        let robot = with(number, by);
        let refusal = in_scalar(&robot, Scalar::F32).expect_err(by);
        let found = refusal.iter().find(|d| d.code == "number-beyond-scalar").unwrap_or_else(|| panic!("{refusal}"));
        assert_eq!(found.place.as_ref().map(ToString::to_string).as_deref(), Some(place), "{refusal}");
        assert!(found.help.contains("f64"), "{refusal}");
        in_scalar(&robot, Scalar::F64).unwrap_or_else(|d| panic!("{by}: {d}"));
    }
    for by in ["com = [1e-50,", "com = [6.123e-17,", "com = [-4e-41,"] {
        let text = in_scalar(&with("com = [0.1,", by), Scalar::F32).unwrap_or_else(|d| panic!("{by}: {d}"));
        assert_eq!(crate::scope::complaints(&text), [""; 0]);
    }
}

#[test]
fn a_product_beyond_the_scalar_is_an_error_that_names_the_function() {
    // 1e30 kg at 1e5 m: 1e40 kg·m²
    let far = with("com = [0.1, 0.02, -0.4]", "com = [1e5, 0.02, -0.4]").replace("mass = 1.5", "mass = 1e30");
    let refusal = in_scalar(&far, Scalar::F32).expect_err("it is beyond f32");
    let of_program: Vec<_> = refusal.iter().filter(|d| d.code == "program-beyond-scalar").collect();
    assert!(!of_program.is_empty() && of_program.iter().all(|d| d.help.contains("f64")), "{refusal}");
    assert!(of_program[0].title.contains("_dynamics` cannot be computed in f32"), "{refusal}");
    in_scalar(&far, Scalar::F64).unwrap_or_else(|d| panic!("{d}"));
}

#[test]
fn whatever_the_numbers_are_what_is_compiled_is_rust() {
    let numbers = ["0.0", "1e-60", "1e-45", "1e-38", "1e-30", "1e-17", "1e17", "1e30", "1e38", "1e40", "1e60"];
    let mut texts = Vec::new();
    for x in numbers {
        for (number, by) in [
            ("mass = 1.5", format!("mass = {x}")),
            ("com = [0.1,", format!("com = [{x},")),
            ("inertia = [0.02, 0.03, 0.025]", format!("inertia = [{x}, {x}, {x}]")),
            ("effort = 50.0", format!("effort = {x}")),
        ] {
            for scalar in [Scalar::F32, Scalar::F64] {
                if let Ok(text) = in_scalar(&with(number, &by), scalar) {
                    assert_eq!(crate::scope::complaints(&text), [""; 0], "{by} in {}", scalar.name());
                    texts.push(text);
                }
            }
        }
    }
    assert!(texts.len() > 40, "{}", texts.len());
    assert_rustc_takes("numbers", texts.into_iter().step_by(5), &[]);
}

#[test]
fn what_rustc_refuses_is_seen() {
    for (text, complaint) in [
        ("fn f(a: f64, a: f64) {}", "two parameters `a`"),
        ("pub struct Result([f64; 2]);", "hides Rust's own"),
        ("fn g() {} fn f(g: f64) { g(); }", "`g` is called, and is a local"),
        ("mod loop {}", "no Rust"),
        ("mod f64 {}", "hides Rust's own"),
        ("// \u{202e}\nfn f() {}", "the text holds"),
        ("const A: f64 = inf;", "nothing is named `inf`"),
        ("fn f() -> f64 { let x = NaN; x }", "nothing is named `NaN`"),
        ("const N: usize = 1; fn f(N: f64) {}", "means a constant"),
        ("mod m { fn g() { super::h(); } }", "leads nowhere"),
        ("fn f() {} struct S; fn f() {}", "`f` is defined twice"),
        ("fn f(x: &Tool) {}", "no type is named `Tool`"),
    ] {
        let complaints = crate::scope::complaints(text).join("\n");
        assert!(complaints.contains(complaint), "{text}: {complaints}");
    }
}
