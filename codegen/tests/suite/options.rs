//! The table of options: what the fronts and the documents make of it, and what each option writes into the hash.
//!
//! `UPDATE_EXPECTED=1 cargo test -p straightline-codegen --test suite options::` rewrites the tables in the documents; read the difference.

use crate::guide::{compare, package};
use std::collections::BTreeSet;
use std::fmt::Write;
use straightline_codegen::certify::Effort;
use straightline_codegen::diagnostic::{Diagnostics, Front, Source};
use straightline_codegen::options::table::{Call, OptionGroup, OptionKind, OptionRow, TABLE};
use straightline_codegen::options::{scene_file, GivenOptions};
use straightline_codegen::{compile, Builder, Options};

const ARM: &str = include_str!("../files/arm.toml");

fn settings(row: &'static OptionRow) -> GivenOptions {
    let mut settings = GivenOptions::default();
    let value = row.parse(row.example, Front::Builder).unwrap_or_else(|wrong| panic!("{}: {wrong:?}", row.name));
    settings.give(row, value, Front::Builder).unwrap();
    settings
}

fn options(settings: &GivenOptions) -> Options {
    let mut options = Options::default();
    settings.apply(&mut options);
    options
}

/// Names of the methods by which a builder is given something.
fn methods() -> BTreeSet<String> {
    let source = std::fs::read_to_string(package().join("src/fronts/builder.rs")).unwrap();
    // written out, or as a line of the table of methods
    let by_hand = |line: &str| line.contains("self, ") && !line.contains("&self");
    let method = |line: &str| match line.strip_prefix("    pub fn ") {
        Some(method) => by_hand(method).then(|| method.split(['(', '<']).next().unwrap().to_string()),
        None => line
            .strip_prefix("    ")
            .filter(|line| line.contains(") = "))
            .map(|line| line.split('(').next().unwrap().to_string()),
    };
    let names = source.lines().filter_map(method);
    names.filter(|name| !name.is_empty() && name.chars().all(|c| c.is_ascii_lowercase() || c == '_')).collect()
}

#[test]
fn a_row_writes_the_names_into_the_hash_that_it_says() {
    for row in TABLE.iter().filter(|row| row.group != OptionGroup::Front) {
        let text = options(&settings(row)).hashed();
        for name in row.hash {
            assert!(text.contains(&format!("{name}=")), "{}: no `{name}` in {text}", row.name);
        }
        assert_eq!(row.hash.is_empty(), text == "{}", "{}: {text}", row.name);
    }
}

#[test]
fn names_of_options_and_ranges_are_what_they_seem() {
    let names: BTreeSet<&str> = TABLE.iter().map(|row| row.name).collect();
    assert_eq!(names.len(), TABLE.len());
    let row = |name| OptionRow::find(name, |_| true).unwrap_or_else(|unknown| panic!("{unknown}"));
    let range = |name| match &row(name).kind {
        OptionKind::Real(range, _) | OptionKind::Whole(range, _) => *range,
        _ => panic!("{name} is no number"),
    };
    assert_eq!(range("certify_boxes"), format!("between 1 and {}", Effort::MOST_BOXES));
    assert_eq!(range("certify_seconds"), format!("above 0 and up to {} s", Effort::MOST_SECONDS));
    let limit = Options::default().limits.operations;
    assert_eq!(row("max_part_operations").default, limit.to_string());
}

/// Every front but the command line and the macros, whose packages ask the same.
#[test]
fn builders_and_scenes_set_what_the_rows_set() {
    let methods = methods();
    let own = ["option", "scene", "scene_file", "out_dir", "module", "scalars"];
    for method in methods.iter().filter(|method| !own.contains(&method.as_str())) {
        OptionRow::find(method, |row| row.is_value(Front::Builder))
            .unwrap_or_else(|_| panic!("`.{method}(..)` has no row"));
    }
    for row in TABLE {
        if row.group == OptionGroup::Front {
            let name = row.called(Front::Builder);
            assert!(name.is_none_or(|name| methods.contains(name)), "the builder has no `{}`", row.name);
            continue;
        }
        let wanted = settings(row);
        if !matches!(row.scene, Call::Name) {
            continue;
        }
        for table in [row.table, row.also].into_iter().filter(|table| !table.is_empty()) {
            let text = format!("[{table}]\n{}\n", row.written_in_scene());
            let mut complaints = Diagnostics::new();
            let file = scene_file::read(&Source::new("scene.toml", text), &mut complaints);
            assert_eq!(file.unwrap_or_else(|| panic!("{complaints}")).settings, wanted, "{} of [{table}]", row.name);
        }
    }
}

#[test]
fn what_a_front_is_given_counts_before_the_scene() {
    let text = "[options]\nlimbs = \"lanes\"\nrules = \"exact\"\ncertify_boxes = 40\n[numbers]\nscalar = \"f32\"\n";
    let file = scene_file::read(&Source::new("scene.toml", text), &mut Diagnostics::new()).unwrap();
    let mut own = GivenOptions::default();
    for (name, word) in [("scalar", "f64"), ("limbs", "auto"), ("certify", "false")] {
        let row = OptionRow::find(name, |_| true).unwrap();
        own.give(row, row.parse(&[word], Front::Derive).unwrap(), Front::Derive).unwrap();
    }
    let options = file.with(&own, Options::default());
    assert_eq!(options.hashed(), "{rules=exact;limbs=auto;}");
}

#[test]
fn a_scene_says_where_an_option_stands_that_is_not_in_its_table() {
    let text = "[options]\ngravity = [0.0, 0.0, -1.62]\nlans = \"runtime\"\noutput = \"a.rs\"\nlimbs = \"auto\"\nlanes = \"runtim\"\n\
                [outputs]\nlimbs = \"apart\"\n[numbers]\nscaler = \"f32\"\n";
    let mut complaints = Diagnostics::new();
    assert!(scene_file::read(&Source::new("scene.toml", text), &mut complaints).is_none());
    let said = complaints.render();
    for part in [
        "help: write `gravity` in [hold]",
        "help: did you mean `lanes`?",
        "help: where something is read or written is not the scene's business",
        "`limbs` stands in [outputs] and in [options]",
        "lanes of [options]: `runtim` is unknown",
        "help: did you mean `scalar`?",
    ] {
        assert_eq!(said.matches(part).count(), 1, "{part}: {said}");
    }
}

#[test]
fn a_build_script_is_told_all_that_is_wrong_with_its_options() {
    let here = std::env::temp_dir().join(format!("straightline-options-{}", std::process::id()));
    std::fs::create_dir_all(&here).unwrap();
    std::fs::write(here.join("arm.toml"), ARM.replacen("mass = ", "maas = ", 1)).unwrap();
    let builder = Builder::new("arm.toml").option("lans", "runtime").option("lanes", "runtim").option("lanes", true);
    let run = builder.angle_tolerance(0.5).option("fma", "caller").run(&here, &here);
    let errors: Vec<&String> = run.cargo.iter().filter(|line| line.starts_with("cargo::error=")).collect();
    let said = run.person;
    for part in [
        "there is no option `lans`; did you mean `lanes`?",
        "there is no home of the batches `runtim`; did you mean `runtime`?",
        "`lanes` takes one of standalone, runtime",
        "angle_tolerance: 0.5 is not between 0 and 0.1 rad",
        "did you mean `mass`?",
    ] {
        assert_eq!(said.matches(part).count(), 1, "{part}: {said}");
    }
    assert!(errors.len() >= 5, "{errors:?}");
    let own = Builder::new("arm.toml").option("output", "x").run(&here, &here);
    assert!(own.person.contains("there is no option `output`"), "{}", own.person);
}

#[test]
fn certified_effort_of_a_builder_is_that_of_its_options() {
    let here = std::env::temp_dir().join(format!("straightline-effort-{}", std::process::id()));
    std::fs::create_dir_all(&here).unwrap();
    std::fs::write(here.join("arm.toml"), ARM).unwrap();
    let functions = || Builder::new("arm.toml").functions([straightline_codegen::Function::GravityForce]);
    let effort = Effort::new(Some(2), None, true);
    let by_method = functions().certify(effort).run(&here, &here).result.unwrap();
    let by_name =
        functions().option("certify_boxes", 2).option("certify_state", true).run(&here, &here).result.unwrap();
    let of_library = Options {
        certify: Some(effort),
        functions: vec![straightline_codegen::Function::GravityForce],
        ..Options::default()
    };
    let source = Source::new("arm.toml", ARM);
    assert_eq!(by_method.text, compile(&source, &of_library).unwrap().text);
    assert_eq!(by_method.text, by_name.text);
}

/// Text for a cell of a table of the guide.
fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace(" [", " \\[")
}

fn words(row: &OptionRow) -> Vec<(&'static str, &'static str)> {
    match &row.kind {
        OptionKind::Word(of, _) | OptionKind::Words(of) if !of.is_of_items => (of.words)(),
        _ => Vec::new(),
    }
}

/// What a row does, and the words that it takes.
fn explained(row: &OptionRow) -> String {
    let words: Vec<String> = words(row).iter().map(|(word, _)| format!("`\"{word}\"`")).collect();
    let words = if words.is_empty() { String::new() } else { format!(": {}", words.join(", ")) };
    cell(&format!("{}{words}", row.doc))
}

/// Without a value: what happens then.
fn default(row: &OptionRow) -> String {
    match words(row).iter().any(|(word, _)| *word == row.default) {
        true => format!("`\"{}\"`", row.default),
        false => cell(row.default),
    }
}

fn page() -> String {
    let mut page = "# Options\n\nPrinted from the table of options (`straightline_codegen::options::table`) by the test `options::` of the compiler.\n\n\
A word means the same in every front, and what a front cannot have it says here. What a front is given itself counts before the scene file, key by key. An option that is yes or no can be switched\n\
off again: `--generic=false`, `generic = false`, `.generic(false)`. `.option(\"NAME\", value)` of a builder takes each of them by its name. Keys and words that do not exist are answered with the nearest that do, all of\n\
a run at once.\n\n\
| option | command line | macros | build script | scene file |\n|---|---|---|---|---|\n"
        .to_string();
    let methods = methods();
    let mut whys: Vec<&str> = Vec::new();
    let mut not = |why| {
        let at = whys.iter().position(|w| *w == why).unwrap_or_else(|| {
            whys.push(why);
            whys.len() - 1
        });
        format!("– ({})", at + 1)
    };
    for row in TABLE {
        let mut written = |front, call| match call {
            Call::Not(why) => not(why),
            _ if front == Front::Builder && row.called(front).is_some_and(|name| methods.contains(name)) => {
                format!("`.{}(..)`", row.called(front).unwrap_or_default())
            }
            _ => format!("`{}`", row.written(front)),
        };
        let command_line = written(Front::CommandLine, row.command_line);
        let (macros, builder) = (written(Front::Derive, row.macros), written(Front::Builder, row.builder));
        let scene = match row.scene {
            Call::As(key) => key.replace("[hold]", "`[hold]`"),
            Call::Not(why) => not(why),
            Call::Name if row.table != "options" => format!("`{}` in `[{}]`", row.written_in_scene(), row.table),
            Call::Name if row.also.is_empty() => format!("`{}`", row.written_in_scene()),
            Call::Name => format!("`{}`, also in `[{}]`", row.written_in_scene(), row.also),
        };
        let _ = writeln!(page, "| `{}` | {command_line} | {macros} | {builder} | {scene} |", row.name);
    }
    page += "\n";
    whys.iter().enumerate().for_each(|(i, why)| page += &format!("{}. {why}\n", i + 1));
    for (group, title) in [
        (OptionGroup::Program, "What is generated"),
        (OptionGroup::Model, "How the robot file is read"),
        (OptionGroup::Reporting, "What is said"),
        (OptionGroup::Front, "Where something is read and written"),
    ] {
        let _ = write!(page, "\n## {title}\n\n| option | is | without it |\n|---|---|---|\n");
        for row in TABLE.iter().filter(|row| row.group == group) {
            let _ = writeln!(page, "| `{}` | {} | {} |", row.name, cell(row.doc), default(row));
            for (word, meaning) in words(row) {
                let _ = writeln!(page, "| | `\"{word}\"`: {} | |", cell(meaning));
            }
        }
    }
    page
}

/// Compares the lines behind a table's head with what is printed, or rewrites them; `margin` stands before each line.
pub(crate) fn compare_table(file: &str, margin: &str, head: &str, printed: &[String]) {
    let path = package().join("..").join(file);
    let text = std::fs::read_to_string(&path).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let at = lines
        .iter()
        .position(|line| *line == format!("{margin}{head}"))
        .unwrap_or_else(|| panic!("{file} has no {head}"));
    let first = at + 2;
    let count = lines[first..].iter().take_while(|line| line.starts_with(&format!("{margin}|"))).count();
    let printed: Vec<String> = printed.iter().map(|line| format!("{margin}{line}")).collect();
    if std::env::var_os("UPDATE_EXPECTED").is_some() {
        let all = lines[..first].iter().map(ToString::to_string).chain(printed);
        let all: Vec<String> = all.chain(lines[first + count..].iter().map(ToString::to_string)).collect();
        std::fs::write(&path, all.join("\n") + "\n").unwrap();
        return;
    }
    assert_eq!(lines[first..first + count], printed, "{file}:{} is not what the table says", first + 1);
}

#[test]
fn documents_have_the_options_of_the_table() {
    compare("options.md", &page());
    let of_macros: Vec<String> = TABLE
        .iter()
        .filter(|row| row.called(Front::Derive).is_some())
        .map(|row| format!("| `{}`: {} | {} |", row.written(Front::Derive), explained(row), default(row)))
        .collect();
    compare_table("runtime/src/lib.rs", "//! ", "| option | without it |", &of_macros);
    let of_scenes: Vec<String> = TABLE
        .iter()
        .filter(|row| row.stands_in("options"))
        .map(|row| {
            let or = if row.also.is_empty() { String::new() } else { format!("`[{}]`", row.also) };
            format!("| `{}` | {or} | {} | {} |", row.written_in_scene(), explained(row), default(row))
        })
        .collect();
    compare_table("codegen/SCENES.md", "", "| key of `[options]` | or in | is | default |", &of_scenes);
}
