//! The same input gives the same bytes: again, and on another thread.

use straightline_codegen::compile::compile;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::options::Options;
use straightline_generated_tests::programs::{options, source};
use straightline_generated_tests::random::{Kind, Random, RandomRobot};
use straightline_generated_tests::reference::Robot;
use straightline_generated_tests::written::{Shape, Style};

fn generate(source: &Source, options: &Options) -> String {
    compile(source, options).unwrap_or_else(|d| panic!("{}", d.render())).text
}

/// What the build script wrote, in another process, is what comes out here, on two threads at the same time.
#[test]
fn the_same_robot_gives_the_same_bytes_on_any_thread() {
    gives_the_same_bytes(&[
        ("panda", include_str!(concat!(env!("OUT_DIR"), "/panda_f64.rs"))),
        ("chapter_oblique", include_str!(concat!(env!("OUT_DIR"), "/chapter_oblique_f64.rs"))),
    ]);
}

#[test]
#[ignore = "slow proof: a quadruped"]
fn slow_proof_that_a_quadruped_gives_the_same_bytes_on_any_thread() {
    gives_the_same_bytes(&[("solo12", include_str!(concat!(env!("OUT_DIR"), "/solo12_f64.rs")))]);
}

fn gives_the_same_bytes(robots: &[(&str, &str)]) {
    for (name, written) in robots {
        let robot = Robot::load(name);
        let (source, options) = (source(&robot), options(&robot));
        let threads = [(source.clone(), options.clone()), (source, options)]
            .map(|(source, options)| std::thread::spawn(move || generate(&source, &options)));
        for thread in threads {
            assert!(thread.join().expect("compilation does not panic") == *written, "{name}: a thread differs");
        }
    }
}

#[test]
fn what_was_compiled_before_leaves_no_trace() {
    use straightline_codegen::Function::{ForwardDynamics, InverseDynamics, MassMatrix};
    leave_no_trace(&Options { functions: vec![InverseDynamics, MassMatrix, ForwardDynamics], ..Options::default() });
}

#[test]
#[ignore = "slow proof: every function"]
fn slow_proof_that_what_was_compiled_before_leaves_no_trace() {
    leave_no_trace(&Options::default());
}

fn leave_no_trace(options: &Options) {
    let kind = Kind { joints: 9, branched: true, floating: false, welded: 3, right_angled: false };
    let file = |seed| Source::new("random.urdf", RandomRobot::new(&mut Random(seed), kind).urdf());
    leaves_no_trace(options, file(5), file(6));
    let shape = Shape { branched: true, fixed: 3, sliding: 4, ..Shape::arm(6) };
    let file = |seed| Source::new("random.urdf", RandomRobot::as_written(Style::Exported, shape, seed).urdf());
    leaves_no_trace(options, file(5), file(6));
}

fn leaves_no_trace(options: &Options, file: Source, before: Source) {
    let alone = std::thread::spawn({
        let (file, options) = (file.clone(), options.clone());
        move || generate(&file, &options)
    });
    generate(&before, options);
    assert!(generate(&file, options) == alone.join().expect("compilation does not panic"));
}
