//! Every option of the table gives the same bytes through every front that has it: library, command line, macro, build script, scene file.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use straightline_codegen::diagnostic::Front;
use straightline_codegen::fronts::expansion::{expand, SceneOf};
use straightline_codegen::options::table::{Call, OptionGroup, OptionRow, TABLE};
use straightline_codegen::options::{GivenOptions, OptionValue};
use straightline_codegen::{compile, Builder, Options, Source};

/// Two joints, and a tip of the name that the table's examples have.
const ARM: &str = r#"
[robot]
name = "arm"
[[link]]
name = "world"
[[link]]
name = "upper_arm"
mass = 1.5
com = [0.1, 0.02, -0.4]
inertia = [0.02, 0.03, 0.01]
[[link]]
name = "tool"
mass = 0.7
com = [0.02, -0.1, 0.3]
inertia = { xx = 0.01, yy = 0.02, zz = 0.015, xy = 0.001 }
[[joint]]
name = "shoulder"
kind = "revolute"
parent = "world"
child = "upper_arm"
axis = "y"
limits = { lower = -2.0, upper = 2.0, velocity = 2.0, effort = 50.0 }
[[joint]]
name = "elbow"
kind = "revolute"
parent = "upper_arm"
child = "tool"
axis = "x"
origin = { xyz = [0.1, 0.0, -0.6], rpy = [0.3, 0.0, 0.0] }
limits = { lower = -1.0, upper = 2.5, velocity = 2.0, effort = 30.0 }
"#;

const FUNCTION: &str = "gravity_force";

fn scratch() -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("options");
    fs::create_dir_all(&path).unwrap();
    fs::write(path.join("arm.toml"), ARM).unwrap();
    path
}

/// What is generated, or what is said of it; of bounds that depend on the machine the hash of the inputs alone.
fn bytes(row: &OptionRow, text: &str) -> String {
    let hash = |line: &&str| line.starts_with("// Inputs' hash");
    match row.name {
        "certify_seconds" => text.lines().find(hash).expect("a hash").to_string(),
        _ => text.to_string(),
    }
}

fn by_command_line(here: &Path, arguments: &[String]) -> String {
    let command = Command::new(env!("CARGO_BIN_EXE_straightline"))
        .current_dir(here)
        .args(["generate", "arm.toml", "-q"])
        .args(arguments)
        .output()
        .unwrap();
    assert!(command.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&command.stderr));
    String::from_utf8(command.stdout).unwrap()
}

fn settings(row: &'static OptionRow, front: Front) -> GivenOptions {
    let mut settings = GivenOptions::default();
    settings.set("functions", OptionValue::of_words([FUNCTION]), front).unwrap();
    if let Some((name, value)) = row.needs {
        settings.set(name, OptionValue::of_words([value]), front).unwrap();
    }
    settings.give(row, row.parse(row.example, front).unwrap(), front).unwrap();
    settings
}

#[test]
fn an_option_gives_the_same_bytes_through_every_front() {
    let here = scratch();
    let mut asked = 0;
    // machine code of the one machine that needs no other compiler than the tests' own
    let can_be_made =
        |row: &&OptionRow| row.name != "figures" || cfg!(all(target_arch = "x86_64", target_os = "linux"));
    for row in TABLE.iter().filter(|row| row.group != OptionGroup::Front).filter(can_be_made) {
        let mut options = Options::default();
        settings(row, Front::Derive).apply(&mut options);
        let wanted = compile(&Source::new("arm.toml", ARM), &options);
        let wanted = bytes(row, &wanted.unwrap_or_else(|e| panic!("{}: {}", row.name, e.render())).text);
        let mut check = |front: &str, text: &str| {
            assert_eq!(bytes(row, text), wanted, "`{}` of {front}", row.name);
            asked += 1;
        };
        let mut functions = match row.name {
            "functions" => Vec::new(),
            _ => vec![format!("--function={FUNCTION}")],
        };
        functions.extend(row.needs.map(|(name, value)| format!("--{name}={value}")));
        let written = row.written(Front::CommandLine);
        let flags = written.split(' ').map(ToString::to_string);
        check("the command line", &by_command_line(&here, &functions.iter().cloned().chain(flags).collect::<Vec<_>>()));

        let own = settings(row, Front::Derive);
        let expansion = expand("arm.toml", None, &[&here], &own);
        check("the macros", &expansion.result.unwrap_or_else(|refusal| panic!("{}", refusal.message)).0.text);

        let mut builder = Builder::new("arm.toml").option("functions", OptionValue::of_words([FUNCTION]));
        if let Some((name, value)) = row.needs {
            builder = builder.option(name, OptionValue::of_words([value]));
        }
        let built = builder.option(row.name, row.parse(row.example, Front::Builder).unwrap()).run(&here, &here);
        check("a build script", &built.result.unwrap_or_else(|error| panic!("{error}: {}", built.person)).text);

        if !matches!(row.scene, Call::Name) {
            continue;
        }
        fs::write(here.join("scene.toml"), format!("[{}]\n{}\n", row.table, row.written_in_scene())).unwrap();
        let scene = functions.iter().cloned().chain(["--scene=scene.toml".to_string()]);
        check("a scene file", &by_command_line(&here, &scene.collect::<Vec<_>>()));
        let mut others = GivenOptions::default();
        if row.name != "functions" {
            others.set("functions", OptionValue::of_words([FUNCTION]), Front::Derive).unwrap();
        }
        if let Some((name, value)) = row.needs {
            others.set(name, OptionValue::of_words([value]), Front::Derive).unwrap();
        }
        let scene = SceneOf::File("scene.toml".into());
        let expansion = expand("arm.toml", Some(&scene), &[&here], &others);
        check("a scene file beside a macro", &expansion.result.unwrap_or_else(|r| panic!("{}", r.message)).0.text);
    }
    assert!(asked > 4 * 20, "{asked}");
}

#[test]
fn the_command_line_has_every_row_or_the_row_says_why_not() {
    let help = Command::new(env!("CARGO_BIN_EXE_straightline")).args(["generate", "--help"]).output().unwrap();
    let help = String::from_utf8(help.stdout).unwrap();
    for row in TABLE {
        let flag = format!("--{}", row.called(Front::CommandLine).unwrap_or(row.name).replace('_', "-"));
        let is_there = help.split_whitespace().any(|word| word.split(['[', '=', ',']).next() == Some(&flag));
        assert_eq!(is_there, row.called(Front::CommandLine).is_some(), "{flag} in\n{help}");
    }
}
