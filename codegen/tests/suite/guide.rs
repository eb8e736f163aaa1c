//! The guide's reference pages are printed from the tables: functions, joints, formats, messages.
//!
//! `UPDATE_EXPECTED=1 cargo test -p straightline-codegen --test suite guide::` rewrites them; read the difference.

use crate::options::compare_table;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use straightline_codegen::convert::{self, written_formats};
use straightline_codegen::description::composite::COMPOSITES;
use straightline_codegen::description::write::losses::Loss;
use straightline_codegen::description::write::FormatWriter;
use straightline_codegen::description::{self, FileFormat, FORMATS};
use straightline_codegen::function::{Extent, Family, Parts, Spec};
use straightline_codegen::scene;
use straightline_codegen::{compile, Function, Options, Source};
use straightline_core::joint::KINDS;

pub(crate) fn package() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Compares a page with what is printed, or rewrites it.
pub(crate) fn compare(page: &str, printed: &str) {
    compare_file(&format!("guide/src/{page}"), printed);
}

/// The same of any file that is printed.
fn compare_file(page: &str, printed: &str) {
    let path = package().join("..").join(page);
    if std::env::var_os("UPDATE_EXPECTED").is_some() {
        std::fs::write(&path, printed).expect("the guide can be written");
    }
    let written = std::fs::read_to_string(&path).unwrap_or_default();
    let differs = written.lines().zip(printed.lines()).position(|(a, b)| a != b);
    let line = differs.unwrap_or_else(|| written.lines().count().min(printed.lines().count()));
    assert!(
        written == printed,
        "{page}:{} is not what the tables say:\n  written: {:?}\n  printed: {:?}",
        line + 1,
        written.lines().nth(line),
        printed.lines().nth(line)
    );
}

/// As generated code names it.
fn axis(extent: Extent) -> String {
    match extent {
        Extent::Positions => "NQ".to_string(),
        Extent::BaseParameters => "BASE_PARAMETER_COUNT".to_string(),
        Extent::SupportParameters => "SUPPORT_PARAMETER_COUNT".to_string(),
        Extent::RegressorEntries => "entries".to_string(),
        Extent::LinkParameters => "10 per link".to_string(),
        Extent::SceneParameters => "10 per body".to_string(),
        Extent::Velocities => "NV".to_string(),
        Extent::State => "2 NV".to_string(),
        Extent::Joints => "joints".to_string(),
        Extent::Frames => "frames".to_string(),
        Extent::DriveStates => "NX".to_string(),
        Extent::Drives => "NU".to_string(),
        Extent::Dependents => "dependent".to_string(),
        Extent::LoopEquations => "equations".to_string(),
        Extent::Of(n) => n.to_string(),
    }
}

/// Documentation of an item as a cell of a table.
fn cell(doc: &str) -> String {
    doc.replace("[`", "`").replace("`]", "`").replace('|', "\\|")
}

fn functions() -> String {
    let mut page = "# Functions\n\nPrinted from the table of functions (`Function::spec`) by the test `guide::` of the compiler.\n\n\
Arguments stand in this order: inputs, then results, each an array by reference. NQ, NV, NX and NU count configuration coordinates, velocity\n\
coordinates, states and inputs of drives; `frames` counts those that are asked for (otherwise the tips). `part` is what a scene can ask of a result\n\
alone, of six rows also a list of them. Scenes add further arguments (gravity, run-time parameters) and leave arguments out.\n"
        .to_string();
    let families = [
        (Family::Robot, "Of every robot"),
        (Family::Loops, "Of robots with closed loops"),
        (Family::Combination, "Combinations, made for who names them"),
        (Family::Derivatives, "Derivatives, made for who names them"),
        (Family::Tasks, "Tasks of frames, made for who names them"),
        (Family::Drives, "Of robots with drives"),
        (Family::DriveDerivatives, "Derivatives of robots with drives, made for who names them"),
    ];
    for (family, title) in families {
        let _ = write!(page, "\n## {title}\n");
        for function in Function::known().filter(|f| f.spec().family == family) {
            let Spec { name, summary, aliases, inputs, outputs, inputs_depend, .. } = function.spec();
            let _ = write!(page, "\n### `{name}`\n\n{}\n", cell(summary));
            if !aliases.is_empty() {
                let _ = writeln!(page, "Also called: {}.", aliases.join(", "));
            }
            page += "\n| argument | shape | is |\n|---|---|---|\n";
            for quantity in *inputs {
                let _ = writeln!(
                    page,
                    "| `{}` | {} | {} |",
                    quantity.name(),
                    quantity.axes().iter().map(|extent| axis(*extent)).collect::<Vec<_>>().join(" × "),
                    cell(&quantity.doc())
                );
            }
            if *inputs_depend {
                page += "| … | | further inputs, as the robot's drives take them |\n";
            }
            for output in *outputs {
                let shape: Vec<String> = output.axes.iter().map(|extent| axis(*extent)).collect();
                let parts = match output.parts {
                    Parts::No => "",
                    Parts::LinearAngular => "; part `\"linear\"`, `\"angular\"`",
                    Parts::OfTask => "; part of the task `\"linear\"`, `\"angular\"`",
                    Parts::Diagonal => "; part `\"diagonal\"`",
                };
                let _ = writeln!(page, "| → `{}` | {} | {}{parts} |", output.name, shape.join(" × "), cell(output.doc));
            }
        }
    }
    page
}

fn joints() -> String {
    let mut page = "# Joints\n\nPrinted from the table of joints (`straightline_core::joint::KINDS`) by the test `guide::` of the compiler.\n\n\
| kind | coordinates q, q̇ | unit of q, q̇, q̈, τ | at rest |"
        .to_string();
    FORMATS.iter().for_each(|format| page += &format!(" words in {} |", format.name));
    page += &format!("\n|---|---|---|---|{}\n", "---|".repeat(FORMATS.len()));
    for kind in KINDS {
        let row = kind.row();
        let words = |format: &&FileFormat| {
            let of = row.words.iter().filter(|word| word.dialects.contains(&format.dialect));
            of.map(|word| format!("`{}`", word.text)).collect::<Vec<_>>().join(", ")
        };
        let neutral: Vec<String> = row.neutral.iter().map(|x| x.to_string()).collect();
        let mut units: Vec<String> = Vec::new();
        for measure in row.measures {
            let these = measure.units().join(", ");
            if !units.contains(&these) {
                units.push(these);
            }
        }
        let _ = writeln!(
            page,
            "| {} | {}, {} | {} | {} | {} |",
            row.name,
            kind.nq(),
            kind.nv(),
            units.join("; "),
            neutral.join(", "),
            FORMATS.iter().map(words).collect::<Vec<_>>().join(" | ")
        );
    }
    for kind in KINDS.iter().filter(|kind| !kind.row().coordinates.is_empty()) {
        let _ = write!(page, "\nOf `{}`:\n\n```text\n{}\n```\n", kind.row().name, kind.row().coordinates.trim_end());
    }
    page += "\nJoints that are read as several, with links without mass in between (`description::composite`):\n\n\
| kind | does | joints | words in |\n|---|---|---|---|\n";
    for composite in COMPOSITES {
        let parts = composite.parts.iter().map(|part| match part.suffix {
            "" => format!("`NAME` \\[{}\\]", part.measure.units()[0]),
            suffix => format!("`NAME_{suffix}` \\[{}\\]", part.measure.units()[0]),
        });
        let files =
            FORMATS.iter().filter(|format| composite.dialects.contains(&format.dialect)).map(|format| format.name);
        let (parts, files) = (parts.collect::<Vec<_>>().join(", "), files.collect::<Vec<_>>().join(", "));
        let _ = writeln!(page, "| {} | {} | {parts} | {files} |", composite.word, composite.summary);
    }
    page += "\nA word with limits (`revolute`, `prismatic`) has a range that the file gives; fixed joints are merged away and have no row. A floating base is an\n\
option of the front or a key of the robot file, no joint between bodies: a joint of that word is an error that says so.\n";
    page
}

/// A file of a robot or a scene, and what is said of it.
fn message(folder: &Path, code: &str) -> String {
    let mut text = format!("\n### `{code}`\n");
    let file = |extension: &str| std::fs::read_to_string(folder.join(format!("{code}.{extension}"))).ok();
    match FORMATS.iter().flat_map(|format| format.extensions).find_map(|extension| file(extension)) {
        Some(robot) => {
            let language = if robot.starts_with('<') { "xml" } else { "toml" };
            text += &format!("\n```{language}\n{}\n```\n", robot.trim_end());
        }
        None => text += "\nNo file that can be printed: too large, not a text, or from code.\n",
    }
    let said = file("txt").unwrap_or_else(|| panic!("no text of {code}"));
    text + &format!("\n```text\n{}\n```\n", said.trim_end())
}

fn messages() -> String {
    let mut page = "# Every message\n\nEach message of robot files, scenes and conversions with the smallest file that causes it and all that is said of it. `straightline explain CODE` says what a code stands\n\
for. Printed from the files of the tests of messages by the test `guide::` of the compiler; some messages take an option beside the file, which the text then\n\
names.\n"
        .to_string();
    let tables = [
        ("Robot files", "tests/messages", description::messages::CODES),
        ("Scenes, for `codegen/tests/files/arm.toml`", "tests/scene_messages", scene::messages::CODES),
        ("Conversions", "tests/convert_messages", convert::messages::CODES),
    ];
    for (title, folder, codes) in tables {
        let _ = write!(page, "\n## {title}\n");
        for code in codes {
            page += &message(&package().join(folder), code);
        }
    }
    page
}

#[test]
fn functions_are_those_of_the_table() {
    compare("functions.md", &functions());
}

#[test]
fn joints_are_those_of_the_table() {
    compare("joints.md", &joints());
}

#[test]
fn formats_are_those_of_the_table() {
    let row = |format: &&FileFormat| {
        let extensions: Vec<String> = format.extensions.iter().map(|end| format!("`.{end}`")).collect();
        format!("| {} | {} | {} |", format.name, format.signs, extensions.join(", "))
    };
    let rows: Vec<String> = FORMATS.iter().map(row).collect();
    compare_table("codegen/SCHEMA.md", "", "| format | recognised by | or else by the name |", &rows);
}

#[test]
fn conversions_are_those_of_the_tables() {
    let ends = |ends: &[&str]| ends.iter().map(|end| format!("`.{end}`")).collect::<Vec<_>>().join(", ");
    let format = |format: &FileFormat, writer: &FormatWriter| {
        format!("| {} | `{}` | {} | {} |", format.name, writer.word, ends(writer.extensions), writer.rotations)
    };
    let rows: Vec<String> = written_formats().map(|(row, writer)| format(row, writer)).collect();
    compare_table("codegen/CONVERT.md", "", "| format | `--to` | by the name | rotations |", &rows);
    let loss = |format: &FileFormat, loss: &Loss| {
        format!("| {} | {} | `{}` | {} |", format.name, loss.what, loss.weight.code(), loss.then)
    };
    let of = |(format, writer): (&'static FileFormat, &FormatWriter)| {
        writer.losses.iter().map(|row| loss(format, row)).collect::<Vec<_>>()
    };
    let rows: Vec<String> = written_formats().flat_map(of).collect();
    compare_table("codegen/CONVERT.md", "", "| format | has no place or word for | code | what becomes of it |", &rows);
}

#[test]
fn every_message_stands_in_the_guide() {
    compare("messages.md", &messages());
}

#[test]
fn every_page_is_in_the_summary() {
    let folder = package().join("../guide/src");
    let summary = std::fs::read_to_string(folder.join("SUMMARY.md")).expect("the guide has a summary");
    let mut pages: Vec<String> = std::fs::read_dir(&folder)
        .expect("the guide is there")
        .filter_map(|entry| entry.expect("the folder can be read").file_name().into_string().ok())
        .filter(|name| name.ends_with(".md") && name != "SUMMARY.md")
        .collect();
    pages.sort();
    for page in &pages {
        assert!(summary.contains(&format!("({page})")), "{page} is not in the summary");
    }
    let linked = summary.matches(".md)").count();
    assert_eq!(linked, pages.len(), "the summary names pages that are not there");
}

#[test]
fn links_of_the_guide_lead_somewhere() {
    let root = package().join("..");
    let folder = root.join("guide/src");
    let mut pages: Vec<PathBuf> =
        std::fs::read_dir(&folder).expect("the guide is there").map(|e| e.expect("it can be read").path()).collect();
    pages.retain(|path| path.extension().is_some_and(|e| e == "md"));
    pages.push(root.join("README.md"));
    for page in pages {
        let text = std::fs::read_to_string(&page).expect("the page is a text");
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let target = link.split('#').next().unwrap_or("");
            let is_file = !target.contains("://") && (target.ends_with(".md") || target.ends_with(".svg"));
            let there = page.parent().expect("a page is in a folder").join(target);
            assert!(!is_file || there.exists(), "{} links to {link}", page.display());
            // the book has no files of the repository
            let leaves_the_book = page.starts_with(&folder) && target.starts_with("..");
            assert!(!leaves_the_book, "{} links out of the book to {link}", page.display());
        }
    }
}

/// What the documentation of the package `straightline` shows beside the derive.
#[test]
fn the_module_that_the_documentation_shows_is_what_the_compiler_writes() {
    let robot = std::fs::read_to_string(package().join("../runtime/examples/arm.toml")).expect("the robot is there");
    let functions = ["inverse_dynamics", "forward_kinematics", "mass_matrix"];
    let functions = functions.map(|name| Function::from_name(name).expect("it is a function")).to_vec();
    let generated = compile(&Source::new("arm.toml", robot), &Options { functions, ..Options::default() });
    let head = "//! What `straightline generate examples/arm.toml` writes of three functions, as it is: shown by the documentation alone.\n\n";
    compare_file("runtime/src/example.rs", &format!("{head}{}", generated.expect("the robot is right").text));
}

/// A package that is published has no files of the repository around it.
#[test]
fn sources_include_nothing_from_outside_their_packages() {
    let mut folders: Vec<PathBuf> = [
        "src",
        "graph/src",
        "macros/src",
        "cli/src",
        "../runtime/src",
        "../runtime/core/src",
        "../simulation/src",
        "../view/src",
        "../logs/src",
    ]
    .map(|folder| package().join(folder))
    .to_vec();
    let folder_of_tests = package().join("src/program/equivalence/mutants.rs");
    while let Some(folder) = folders.pop() {
        for path in std::fs::read_dir(&folder).expect("it is a folder").map(|e| e.expect("it can be read").path()) {
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let text = std::fs::read_to_string(&path).expect("sources are texts");
            let leaves = |line: &&str| line.contains("include_str!(") && line.contains("../");
            let is_documentation = |line: &&str| line.starts_with("#[doc = ");
            let wrong: Vec<&str> = text.lines().filter(leaves).filter(|line| !is_documentation(line)).collect();
            assert!(wrong.is_empty() || path == folder_of_tests, "{}: {wrong:?}", path.display());
        }
    }
}
