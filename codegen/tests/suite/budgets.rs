//! Budgets of derivatives: they hold at what a function takes and at what is certified, and fail just below, with advice that is worth what it says.

use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::emit::Generated;
use straightline_codegen::options::scene_file;
use straightline_codegen::report::FunctionReport;
use straightline_codegen::{compile, Function, Options};

const PLANAR: &str = include_str!("../../../robots/descriptions/planar_2r.toml");
const FUNCTIONS: [Function; 2] = [Function::InverseDynamicsDerivatives, Function::ForwardDynamicsDerivatives];
const RANGES: &str = "[numbers.ranges]\nqd = 0.5\nqdd = 1.0\ntau = 10.0\n";

/// The planar arm in a scene.
fn compiled(function: Function, scene: &str) -> Result<Generated, Diagnostics> {
    let text = format!("[outputs]\nfunctions = [\"{}\"]\n{scene}", function.name());
    let mut diagnostics = Diagnostics::new();
    let file = scene_file::read(&Source::new("scene.toml", text), &mut diagnostics);
    let options = file.unwrap_or_else(|| panic!("{diagnostics}")).into_options(Options::default());
    compile(&Source::new("planar_2r.toml", PLANAR), &options)
}

fn report(function: Function, scene: &str) -> FunctionReport {
    let generated = compiled(function, scene).unwrap_or_else(|errors| panic!("{scene}\n{errors}"));
    generated.report.function(function).expect("it was asked for").clone()
}

/// The budget of a function, a line per limit.
fn budget(function: Function, limits: &[(&str, usize)]) -> String {
    let lines: String = limits.iter().map(|(key, most)| format!("{key} = {most}\n")).collect();
    format!("[budget.{}]\n{lines}", function.name())
}

/// The codes of its complaints, and their text.
fn complaints(function: Function, scene: &str) -> (Vec<&'static str>, String) {
    let Err(errors) = compiled(function, scene) else { panic!("{} exceeds nothing:\n{scene}", function.name()) };
    (errors.iter().map(|error| error.code).collect(), errors.render())
}

#[test]
fn a_budget_of_derivatives_holds_at_what_they_take_and_fails_one_below() {
    for function in FUNCTIONS {
        let takes = report(function, "");
        let limits = [
            ("max_flops", takes.flops()),
            ("max_sincos", takes.sincos),
            ("max_live", takes.max_live),
            ("max_stack_bytes", takes.stack_bytes),
            ("max_code_bytes", takes.code_bytes),
        ];
        assert!(limits.iter().all(|(_, takes)| *takes > 0), "{limits:?}");
        assert_eq!(report(function, &budget(function, &limits)).flops(), takes.flops());
        let below = limits.map(|(key, takes)| (key, takes - 1));
        let (codes, text) = complaints(function, &budget(function, &below));
        assert_eq!(codes, ["over-budget"; 5], "{text}");
        for (key, takes) in limits {
            let said = text.split("error[").find(|one| one.contains(&format!("raise `{key}`")));
            let said = said.unwrap_or_else(|| panic!("nothing of {key}:\n{text}"));
            let (name, most) = (function.name(), takes - 1);
            assert!(said.contains(name) && said.contains(&format!(" {takes} ")), "{takes}: {said}");
            assert!(said.contains(&format!("the budget is {most}")), "{most}: {said}");
        }
    }
}

/// Of all advice the first.
#[test]
fn what_would_save_most_of_derivatives_saves_as_many_operations_as_is_said() {
    for function in FUNCTIONS {
        let takes = report(function, "").flops();
        let text = complaints(function, &budget(function, &[("max_flops", 1)])).1;
        let advice = text.split_once("what would save most: ").unwrap_or_else(|| panic!("{text}")).1;
        let (what, number) = advice.split_once(" (−").expect("what, and how much");
        let saved: usize = number.split_once(')').expect("a number").0.parse().expect("a number");
        let scene = match what.strip_prefix("joint ").and_then(|rest| rest.strip_suffix(" locked")) {
            Some(joint) => format!("[hold]\njoints = {{ {joint} = 0.0 }}\n"),
            None if what == "q̇ = 0" => "[zero]\nqd = true\n".to_string(),
            None if what == "q̈ = 0" => "[zero]\nqdd = true\n".to_string(),
            None => "[hold]\ngravity = \"zero\"\n".to_string(),
        };
        assert_eq!(report(function, &scene).flops(), takes - saved, "{}: {advice}", function.name());
    }
}

#[test]
fn a_bound_of_errors_of_derivatives_holds_block_by_block_where_it_is_certified_and_fails_below() {
    for function in FUNCTIONS {
        let free = format!("{RANGES}[budget.{}]\nmax_error = 1e6\n", function.name());
        let errors = report(function, &free).errors.expect("a bound was asked for");
        let greatest = errors.outputs.iter().map(|output| output.bounds.iter().copied().fold(0.0, f64::max));
        let blocks: Vec<(&str, f64)> = errors.outputs.iter().map(|output| &output.name[..]).zip(greatest).collect();
        assert_eq!(blocks.len(), 4);
        let with = |tight: Option<&str>| {
            let most = |(name, bound): &(&str, f64)| {
                let part = if tight == Some(*name) { 0.99 } else { 1.0 };
                format!("{name} = {:?}", part * bound)
            };
            let all: Vec<String> = blocks.iter().map(most).collect();
            format!("{RANGES}[budget.{}]\nmax_error = {{ {} }}\n", function.name(), all.join(", "))
        };
        let held = report(function, &with(None)).errors.expect("bounds");
        assert!(held.bounds().eq(errors.bounds()), "the demand changes no program");
        for (name, bound) in &blocks {
            let (codes, text) = complaints(function, &with(Some(name)));
            assert_eq!(codes, ["error-over-budget"], "{name} alone is too tight: {text}");
            let is_named = |block: &str| text.contains(&format!("`{block}["));
            assert!(blocks.iter().all(|(block, _)| is_named(block) == (block == name)), "{name}, {bound:e}: {text}");
        }
    }
}

/// In f32 with some operations in f64 they are within what f32 alone exceeds.
#[test]
fn derivatives_in_mixed_precision_meet_a_bound_that_f32_does_not() {
    let function = Function::InverseDynamicsDerivatives;
    let scene = |most: f64, mixed: bool| {
        let name = function.name();
        format!(
            "[numbers]\nscalar = \"f32\"\n{RANGES}[budget.{name}]\nmax_error = {most:?}\nmixed_precision = {mixed}\n"
        )
    };
    let single = report(function, &scene(1e3, false)).errors.expect("bounds");
    let most = 0.5 * single.bounds().fold(0.0, f64::max);
    assert_eq!(complaints(function, &scene(most, false)).0, ["error-over-budget"]);
    let mixed = compiled(function, &scene(most, true)).unwrap_or_else(|errors| panic!("{errors}"));
    let errors = mixed.report.function(function).and_then(|report| report.errors.clone()).expect("bounds");
    assert!(errors.bounds().all(|bound| bound <= most), "{errors:?}");
    assert!(mixed.text.contains("operations are in f64"), "nothing in f64");
}
