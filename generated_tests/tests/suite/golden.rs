//! Generated text, small enough to be read in review. `INSTA_UPDATE=always` rewrites the snapshots.

use straightline_codegen::compile::compile;
use straightline_codegen::options::Options;
use straightline_codegen::Function;
use straightline_generated_tests::programs::{options, source};
use straightline_generated_tests::reference::Robot;

fn assert_golden(name: &str, text: &str) {
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path("../../golden");
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    // the hash and the version change with every release
    let stable: Vec<_> =
        text.lines().map(|l| if l.starts_with("// Inputs' hash") { "// Inputs' hash: …" } else { l }).collect();
    settings.bind(|| insta::assert_snapshot!(name, stable.join("\n")));
}

/// The text of a robot's functions, without the sine-cosine kernel.
fn text(robot: &str, functions: &[Function]) -> String {
    let robot = Robot::load(robot);
    let options = Options { functions: functions.to_vec(), ..options(&robot) };
    let text = compile(&source(&robot), &options).unwrap_or_else(|d| panic!("{}", d.render())).text;
    let end = text.find("#[allow(dead_code").unwrap_or(text.len());
    text[..end].to_string()
}

#[test]
fn planar_2r_inverse_dynamics_reads_as_it_should() {
    let text = text("planar2r", &[Function::InverseDynamics]);
    let start = text.find("/// Inverse dynamics").expect("the function has its documentation");
    assert_golden("planar2r_inverse_dynamics", &text[start..]);
}

#[test]
fn planar_2r_mass_matrix_reads_as_it_should() {
    let text = text("planar2r", &[Function::MassMatrix]);
    let start = text.find("/// The mass matrix").expect("the function has its documentation");
    assert_golden("planar2r_mass_matrix", &text[start..]);
}

#[test]
fn a_files_header_says_what_it_is() {
    let text = text("chapter_stanford", &[Function::InverseDynamics, Function::MassMatrix, Function::ForwardDynamics]);
    let header: Vec<&str> = text.lines().take_while(|l| l.starts_with("//") && !l.starts_with("///")).collect();
    assert_golden("chapter_stanford_header", &header.join("\n"));
}
