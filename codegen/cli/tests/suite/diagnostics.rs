//! What is said of doubtful files: one line where one is enough, in the words of the front, at the level that it was given.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use straightline_codegen::diagnostic::{codes, Diagnostics, Front, Level, Levels, Reporting, Severity, Source};
use straightline_codegen::fronts::expansion::expand;
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::options::GivenOptions;
use straightline_codegen::program::equivalence::{Disagreement, Plainer};
use straightline_codegen::{compile, Builder, Function, Options};

/// An arm of which two angles have six digits, and one eleven.
fn cut_angles() -> String {
    include_str!("../../../../runtime/examples/arm.toml").replacen(
        "rpy_quarter_turns = [1.0, 0.0, 0.0]",
        "rpy = [1.570796, 1.57079632679, -3.141592]",
        1,
    )
}

fn scratch(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("diagnostics").join(name);
    fs::create_dir_all(&path).unwrap();
    fs::write(path.join("arm.toml"), cut_angles()).unwrap();
    path
}

fn straightline(directory: &Path, arguments: &[&str]) -> (i32, String, String) {
    let run = Command::new(env!("CARGO_BIN_EXE_straightline")).current_dir(directory).args(arguments).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (run.status.code().unwrap(), text(run.stdout), text(run.stderr))
}

const LINE: &str = "arm.toml: 3 angles are right ones only to 6.5e-7 rad, taken as written; \
                    help: `--angle-tolerance 1e-6` takes them all as exact, `straightline check` lists them";

const GRAVITY: [&str; 4] = ["generate", "arm.toml", "--function", "gravity_force"];

#[test]
fn angles_near_right_ones_are_one_line_whose_tolerance_mends_all() {
    assert!(cut_angles().contains("1.57079632679"), "the arm has a pose to write angles into");
    let here = scratch("angles");
    let (code, _, said) = straightline(&here, &GRAVITY);
    assert_eq!((code, said.trim_end()), (0, format!("warning[near-right-angle]: {LINE}").as_str()));
    // as it says
    let (code, _, said) = straightline(&here, &[&GRAVITY[..], &["--angle-tolerance", "1e-6"]].concat());
    assert_eq!((code, said.as_str()), (0, ""));
    // in detail
    let (code, out, said) = straightline(&here, &["check", "arm.toml"]);
    assert_eq!((code, said.matches("near-right-angle").count()), (0, 1), "{said}");
    for angle in
        ["1.570796 is π/2 only to 3.3e-7 rad", "1.57079632679 is π/2 only to 4.9e-12 rad", "-3.141592 is -π only to"]
    {
        assert_eq!(out.matches(angle).count(), 1, "{out}");
    }
    assert!(out.contains("arm.toml:") && out.contains("--angle-tolerance 1e-6 takes all as exact"), "{out}");
    // taken literally on purpose
    let (_, _, said) = straightline(&here, &[&GRAVITY[..], &["--angle-tolerance", "0"]].concat());
    assert_eq!(said, "");
}

#[test]
fn every_front_names_its_own_option() {
    let here = scratch("fronts");
    let options = Options { functions: vec![Function::GravityForce], ..Options::default() };
    let derived = expand("arm.toml", None, &[&here], &GivenOptions::default()).warnings;
    assert!(derived.contains("`angle_tolerance = 1e-6` takes") && derived.lines().count() == 2, "{derived}");
    let built = Builder::new(here.join("arm.toml")).functions([Function::GravityForce]).out_dir(&here).build().unwrap();
    assert!(built.warnings.render().contains("`.angle_tolerance(1e-6)` takes"), "{}", built.warnings);
    let two_scalars = Options { also: vec![straightline_codegen::Scalar::F32], ..options };
    let twice = compile(&Source::new("arm.toml", cut_angles()), &two_scalars).unwrap();
    assert_eq!(twice.warnings.iter().count(), 1, "said once for two scalars");
}

#[test]
fn quiet_says_no_warnings() {
    let here = scratch("quiet");
    let (code, out, said) = straightline(&here, &[&GRAVITY[..], &["-q"]].concat());
    assert!(code == 0 && said.is_empty() && out.contains("gravity_force"), "{said}");
    let (code, out, said) = straightline(&here, &["check", "arm.toml", "--quiet"]);
    assert_eq!((code, out.lines().count(), said.as_str()), (0, 1, ""));
    // errors are said
    let (code, _, said) = straightline(&here, &[&GRAVITY[..], &["-q", "--frame", "none"]].concat());
    assert!(code == 1 && said.contains("unknown-frame"), "{said}");
}

#[test]
fn levels_are_set_on_the_command_line_in_scenes_and_by_the_builder() {
    let here = scratch("levels");
    let with = |more: &[&str]| straightline(&here, &[&GRAVITY[..], more].concat());
    assert_eq!(with(&["--allow", "near-right-angle"]).2, "");
    assert_eq!(with(&["--allow", "warnings"]).2, "");
    let (code, out, said) = with(&["--deny", "near-right-angle"]);
    assert!(code == 1 && out.is_empty() && said.starts_with(&format!("error[near-right-angle]: {LINE}")), "{said}");
    assert_eq!(with(&["--deny", "warnings", "--allow", "near-right-angle"]).2, "");

    fs::write(here.join("strict.toml"), "[diagnostics]\ndeny = [\"near-right-angle\"]\n").unwrap();
    assert_eq!(with(&["--scene", "strict.toml"]).0, 1);
    assert_eq!(with(&["--scene", "strict.toml", "--allow", "near-right-angle"]).0, 0, "the command line counts");
    fs::write(here.join("calm.toml"), "[diagnostics]\nallow = [\"near-right-angle\"]\n").unwrap();
    assert_eq!(with(&["--scene", "calm.toml"]), with(&["--allow", "near-right-angle", "--scene", "calm.toml"]));
    fs::write(here.join("wrong.toml"), "[diagnostics]\nallow = [\"near-right-angel\", \"negative-mass\"]\ndney = []\n")
        .unwrap();
    let (code, _, said) = with(&["--scene", "wrong.toml"]);
    assert_eq!(code, 1);
    for part in
        ["did you mean `near-right-angle`?", "`negative-mass` is an error", "did you mean `deny`?", "wrong.toml:2:10"]
    {
        assert_eq!(said.matches(part).count(), 1, "{part}: {said}");
    }

    let builder = || Builder::new(here.join("arm.toml")).functions([Function::GravityForce]).out_dir(&here);
    assert!(builder().allow("near-right-angle").build().unwrap().warnings.is_empty());
    assert!(builder().deny("warnings").build().is_err());
    assert!(builder().allow("near-right-angel").build().is_err());
}

#[test]
fn all_that_is_wrong_is_said_in_one_run() {
    let here = scratch("all");
    let wrong = "[outputs]\nfunctions = [\"gravity_forces\"]\n[hold]\njoints = { elbw = 0.5 }\n[zreo]\nqd = true\n";
    fs::write(here.join("wrong.toml"), wrong).unwrap();
    let arguments = ["generate", "arm.toml", "--scene", "wrong.toml", "--frame", "forarm", "--frame", "colum"];
    let (code, _, said) = straightline(&here, &arguments);
    assert_eq!(code, 1);
    for part in ["`gravity_force`?", "`zero`?", "`forearm`?", "`column`?"] {
        assert_eq!(said.matches(part).count(), 1, "{part}: {said}");
    }
    let arguments = ["generate", "arm.toml", "--function", "gravity_forces", "--scaler", "f46", "--lanes=runtim"];
    let (code, _, said) = straightline(&here, &arguments);
    assert_eq!(code, 2);
    for part in ["'gravity_force'", "'--scalar'", "f64, f32", "'runtime'"] {
        assert!(
            said.contains(&format!("tip: a similar value exists: {part}")) || said.contains(part),
            "{part}: {said}"
        );
    }
    assert_eq!(said.matches("error:").count(), 4, "{said}");
}

#[test]
fn codes_are_explained_and_functions_found() {
    let here = scratch("explain");
    let (code, out, _) = straightline(&here, &["explain"]);
    assert_eq!((code, out.lines().count()), (0, codes::ALL.len()));
    let (code, out, _) = straightline(&here, &["explain", "near-right-angle"]);
    assert!(code == 0 && out.starts_with("near-right-angle") && out.contains("warning"), "{out}");
    let (code, _, said) = straightline(&here, &["explain", "near-right-angel"]);
    assert!(code == 1 && said.contains("did you mean `near-right-angle`?"), "{said}");
    let (code, out, _) = straightline(&here, &["functions", "rnea"]);
    assert!(code == 0 && out.starts_with("inverse_dynamics ") && out.lines().count() == 4, "{out}");
    // what is called so stands first, before what has the letters in another word
    for (word, function) in [
        ("CRBA", "mass_matrix "),
        ("ABA", "forward_dynamics "),
        ("Coriolis", "bias_force "),
        ("COM", "centre_of_mass "),
        ("com", "centre_of_mass "),
    ] {
        let (_, out, _) = straightline(&here, &["functions", word]);
        assert!(out.starts_with(function), "{word}: {out}");
    }
    let (_, out, _) = straightline(&here, &["functions"]);
    assert!(Function::known().all(|f| out.contains(f.name())), "{out}");
}

/// That a plainer form had to be taken is a failure of ours, which nothing silences.
#[test]
fn a_plainer_form_is_always_said() {
    let source = Source::new("arm.toml", cut_angles());
    let model = load(&source, &ModelOptions::default()).0.unwrap();
    let disagreement =
        Disagreement { program: "mass_matrix".into(), result: "h[0]".into(), difference: 0.1, plain: None };
    let warning = || Plainer { disagreement: disagreement.clone(), without: "reduced forms" }.warning(&model);
    let said = |level: Option<Level>| {
        let mut levels = Levels::default();
        level.into_iter().for_each(|level| levels.set("warnings", level));
        let mut diagnostics = Diagnostics::reporting(&Reporting { levels, front: Front::Builder });
        diagnostics.push(warning());
        // as `-q` says it
        let shown = diagnostics.at_least(Severity::Error);
        assert_eq!(shown.len(), 1);
        let found: Vec<_> = shown.iter().map(|d| (d.code, d.severity)).collect();
        found[0]
    };
    for level in [None, Some(Level::Allow), Some(Level::Warn)] {
        assert_eq!(said(level), ("plainer-form", Severity::Warning));
    }
    assert_eq!(said(Some(Level::Deny)), ("plainer-form", Severity::Error));

    let here = scratch("firm");
    let with = |more: &[&str]| straightline(&here, &[&GRAVITY[..], more].concat());
    let refused = "`plainer-form` is always said: it cannot be set to `allow`";
    let (code, out, said) = with(&["--allow", "plainer-form"]);
    assert!(code != 0 && out.is_empty() && said.contains(refused), "{said}");
    fs::write(here.join("calm.toml"), "[diagnostics]\nallow = [\"plainer-form\"]\n").unwrap();
    let (code, _, said) = with(&["--scene", "calm.toml"]);
    assert!(code == 1 && said.contains(refused) && said.contains("calm.toml:2:10"), "{said}");
    assert_eq!(with(&["--deny", "plainer-form"]).0, 0, "the arm needs no plainer form");
    let builder = || Builder::new(here.join("arm.toml")).functions([Function::GravityForce]).out_dir(&here);
    assert!(builder().allow("plainer-form").build().is_err());
    assert!(builder().deny("plainer-form").build().is_ok());
}

#[test]
fn a_level_of_an_unknown_code_is_an_error_of_the_library_too() {
    let mut levels = Levels::default();
    levels.set("nonsense", Level::Allow);
    let diagnostics = Diagnostics::reporting(&Reporting { levels, front: Front::Builder });
    assert_eq!(diagnostics.count(Severity::Error), 1);
}
