//! Every byte that is generated: a hash of each module of this package, and of each scene of `robots` with its robot.
//!
//! What is meant to change no text is held to that here. What is meant to change some says so in its commit, with what moved:
//! `INSTA_UPDATE=always cargo test -p straightline-generated-tests --test suite bytes:: -- --include-ignored` writes the records anew.

use std::collections::BTreeMap;
use std::path::Path;
use straightline_codegen::compile::compile;
use straightline_codegen::diagnostic::fnv_1a;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::options::scene_file;
use straightline_codegen::options::Options;

/// By how a scene's file begins: the robot that it is of.
const ROBOTS: [(&str, &str); 4] =
    [("panda", "panda.urdf"), ("planar_2r", "planar_2r.toml"), ("quadruped", "solo12.urdf"), ("ur5", "ur5.urdf")];

/// FNV-1a of a text, and its length; without the line that changes with every version.
fn sum(text: &str) -> String {
    let lines = text.lines().filter(|line| !line.starts_with("// Inputs' hash"));
    let bytes = lines.flat_map(|line| line.bytes().chain([b'\n']));
    format!("{:016x} {:>8}", fnv_1a(bytes), text.len())
}

/// The files of a folder with this extension, by name.
fn files(folder: &Path, extension: &str) -> BTreeMap<String, String> {
    let entries =
        std::fs::read_dir(folder).expect("the folder can be read").map(|entry| entry.expect("an entry").path());
    let named = entries.filter(|path| path.extension().is_some_and(|e| e == extension)).map(|path| {
        let name = path.file_stem().expect("a file has a name").to_string_lossy().into_owned();
        (name, std::fs::read_to_string(&path).expect("a file can be read"))
    });
    named.collect()
}

fn assert_recorded(name: &str, sums: &[String]) {
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path("../../golden");
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.bind(|| insta::assert_snapshot!(name, sums.join("\n")));
}

#[test]
fn no_generated_byte_changes_unnoticed() {
    let modules = files(Path::new(env!("OUT_DIR")), "rs");
    let sums: Vec<String> = modules.iter().map(|(name, text)| format!("{} {name}", sum(text))).collect();
    assert_recorded("bytes", &sums);
}

#[test]
#[ignore = "slow proof: every scene is compiled"]
fn slow_proof_that_no_byte_of_a_scene_changes_unnoticed() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots");
    let of_scene = |(name, text): (String, String)| {
        let (_, robot) =
            ROBOTS.into_iter().find(|(start, _)| name.starts_with(start)).expect("a scene of a known robot");
        let source = std::fs::read_to_string(folder.join("descriptions").join(robot)).expect("a file can be read");
        let options =
            scene_file::read_partly(&Source::new(&format!("{name}.toml"), text)).into_options(Options::default());
        let generated = compile(&Source::new(robot, source), &options).unwrap_or_else(|d| panic!("{}", d.render()));
        format!("{} {robot} in {name}", sum(&generated.text))
    };
    let sums: Vec<String> = files(&folder.join("scenes"), "toml").into_iter().map(of_scene).collect();
    assert_recorded("bytes_of_scenes", &sums);
}
