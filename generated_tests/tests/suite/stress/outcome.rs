//! What a stress test gave, against its bound, and how it is written down.

use std::fmt::Write;
use std::path::Path;

/// How much is tried.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Size {
    /// A few seconds in all, unoptimised.
    Small,
    /// Minutes in release.
    Full,
}

impl Size {
    /// One number or the other.
    pub fn pick<T>(self, small: T, full: T) -> T {
        match self {
            Size::Small => small,
            Size::Full => full,
        }
    }
}

/// One line of the table.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Its number in [`TESTS`].
    pub test: usize,
    /// The robot, or the family of robots.
    pub robot: String,
    /// What was measured, with its unit.
    pub what: String,
    /// What came out.
    pub value: f64,
    /// What is allowed.
    pub bound: f64,
}

impl Outcome {
    pub fn new(test: usize, robot: impl Into<String>, what: impl Into<String>, value: f64, bound: f64) -> Outcome {
        Outcome { test, robot: robot.into(), what: what.into(), value, bound }
    }
}

/// The list: what is tried, and the best that is known elsewhere.
const TESTS: [(&str, &str); 24] = [
    ("forward after inverse dynamics gives q̈ back", "libraries' unit tests: 1e-9 … 1e-12, absolute"),
    ("the same against truth, not only as a residual", "not published"),
    ("gravity compensation holds the robot still", "a public simulator's acceptance test: 1e-10 rad/s²"),
    ("uniform chains", "cond(H) grows as n⁴ at worst (Featherstone 2004); errors not published"),
    ("stretched and folded chains", "the factorisation loses, articulated bodies do not (Ascher, Pai, Cloutier 1997)"),
    ("light tips", "not published"),
    ("heavy tips", "not published; the digits are lost in the problem"),
    ("links without inertia", "Pinocchio, MuJoCo: the user must add armature"),
    ("nearly parallel axes", "not published"),
    ("large angles", "libm's f64 to 1e9 rad; SIMD libraries wrong beyond 1e5 … 1e6"),
    ("angles next to multiples of π/2", "`wide` 1.7: 1000 ulp"),
    ("huge and tiny speeds", "not published"),
    ("subnormal numbers, flushed to zero or not", "not published"),
    ("other scalars than f64", "RoboPrec, f32: bounds 10⁴ above what is seen"),
    ("energy over 10⁶ steps", "per engine, by the step (Erez, Tassa, Todorov 2015)"),
    ("momentum of a free robot over 10⁶ steps", "per engine, by the step (Erez, Tassa, Todorov 2015)"),
    ("stiff dampers, implicitly", "MuJoCo: implicit-in-velocity integrators"),
    ("redundant contacts", "no ridge: factorisations fail; engines iterate to a tolerance"),
    ("constraints next to singular", "not published"),
    ("closed loops over 10⁶ steps", "drift eliminated (Braun, Goldfarb 2009)"),
    ("impacts, stacks with mass ratios", "iterative contact solvers slow down with the ratio"),
    ("the same bits in other forms and on other instruction sets", "not published for dynamics"),
    ("derivatives", "RoboPrec, f32: certified bound 2.5e5 N·m/rad; errors not published"),
    ("adversarial search", "random samples: a half to a sixth of what a search finds"),
];

/// What further tests hold.
const REMARKS: [(usize, &str); 6] = [
    (15, "Compensated sums of `integrate`: `robots/tests/integrate.rs`; drives with losses: `simulation/tests/suite/drives.rs`"),
    (
        18,
        "Generated code of contacts: `codegen/tests/suite/contact_compiled.rs`, `generated_tests/tests/suite/contact_generated.rs`",
    ),
    (20, "A constraint on a plane over 10⁶ steps: `2026-11-21-contact-drift.md`"),
    (21, "Stick and slide against closed forms: `runtime/core/tests/suite/contact.rs`, `simulation/tests/suite/contact.rs`"),
    (23, "Identities of derivatives: `generated_tests/tests/suite/generic.rs`"),
    (24, "Errors against certificates: `codegen/tests/suite/certificates.rs`"),
];

/// Fails with all outcomes that exceed their bounds.
#[track_caller]
pub fn judge(outcomes: &[Outcome]) {
    let mut exceeded = String::new();
    for o in outcomes {
        println!("{:2} {:24} {:64} {:9.2e} of {:9.2e}", o.test, o.robot, o.what, o.value, o.bound);
        if o.value.is_nan() || o.value > o.bound {
            let _ = writeln!(exceeded, "test {}, {}: {}: {:e} > {:e}", o.test, o.robot, o.what, o.value, o.bound);
        }
    }
    assert!(!outcomes.is_empty(), "nothing was tried");
    assert!(exceeded.is_empty(), "{exceeded}");
}

/// Writes the table.
pub fn write_record(outcomes: &mut [Outcome]) {
    outcomes.sort_by_key(|o| o.test);
    let mut text = String::from(
        "# Stress tests\n\n`cargo test --release -p straightline-generated-tests --test suite stress::record -- --ignored --nocapture` on x86-64.\n\
         Errors are of results, not residuals, against the same equations in double-double at the same inputs. u = 2⁻⁵³ in\n\
         f64, 2⁻²⁴ in f32; natural scale: the sum of the moduli of the terms of a result; \"of q̈\": of the greatest |q̈| of the state.\n",
    );
    for (number, (title, elsewhere)) in (1..).zip(TESTS) {
        let further =
            REMARKS.iter().find(|a| a.0 == number).map_or(String::new(), |a| format!("\nSee also: {}.\n", a.1));
        let _ = writeln!(text, "\n## {number}. {}\n{further}", capitalised(title));
        text.push_str("| robot | what | found | bound | best known elsewhere |\n|---|---|---|---|---|\n");
        for o in outcomes.iter().filter(|o| o.test == number) {
            let (robot, what) = (o.robot.replace('|', "\\|"), o.what.replace('|', "\\|"));
            let _ = writeln!(text, "| {robot} | {what} | {} | {} | {elsewhere} |", figure(o.value), figure(o.bound));
        }
    }
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("record/2026-11-22-stress.md");
    std::fs::write(&path, text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    println!("{}", path.display());
}

fn figure(x: f64) -> String {
    match x.abs() {
        0.0 => "0".to_string(),
        0.01..1000.0 => format!("{}", (x * 100.0).round() / 100.0),
        _ => format!("{x:.1e}"),
    }
}

fn capitalised(title: &str) -> String {
    let mut rest = title.chars();
    rest.next().map_or(String::new(), |first| first.to_uppercase().chain(rest).collect())
}
