//! One robot in two notations is one robot.

use straightline_codegen::diagnostic::Source;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::options::Options;
use straightline_codegen::program::program;
use straightline_codegen::Function;
use straightline_generated_tests::programs;
use straightline_generated_tests::reference::Robot;

#[test]
fn the_planar_arm_in_toml_and_in_urdf_is_the_same_program() {
    let urdf = Robot::load("planar2r");
    let path = urdf.file.with_file_name("planar_2r.toml");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let from_toml = programs::load(&Source::new("planar_2r.toml", text), &ModelOptions::default());
    let from_urdf = programs::load(&programs::source(&urdf), &ModelOptions::default());
    for function in Function::all() {
        let of = |robot| program(robot, &urdf.frames, function, &Options::default()).graph;
        let (a, b) = (of(&from_toml), of(&from_urdf));
        assert!(a.ops == b.ops && a.results == b.results, "{}", function.name());
    }
}
