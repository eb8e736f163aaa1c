//! The values that inputs can have, as a scene file says them.

use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::expr::Port;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::options::scene_file;
use straightline_codegen::scene::{Gravity, InputRange, Scene};
use straightline_codegen::{compile, Function, Generated, Options};

const ARM: &str = include_str!("../files/arm.toml");

/// The arm in a scene with these lines, and the range of every input.
fn arm(scene: &str, floating: bool) -> (Generated, impl Fn(&str) -> Vec<InputRange>) {
    let mut diagnostics = Diagnostics::new();
    let file = scene_file::read(&Source::new("scene.toml", scene), &mut diagnostics);
    let mut options = file.unwrap_or_else(|| panic!("{diagnostics}")).into_options(Options::default());
    options.model.floating_base = floating;
    // the root link has no mass, so that afloat there is no forward dynamics
    options.functions = vec![Function::InverseDynamics];
    let generated = compile(&Source::new("arm.toml", ARM), &options).unwrap_or_else(|d| panic!("{d}"));
    let (scene, model) = (options.scene, generated.model.clone());
    let range = move |input: &str| {
        let n = if input == "q" { model.nq() } else { model.nv() };
        scene.input_ranges(&Port::new(input, &[if input == "gravity" { 3 } else { n }]), &model)
    };
    (generated, range)
}

fn between(lower: f64, upper: f64) -> InputRange {
    InputRange { lower, upper }
}

/// Less than 1e-30 m/s² is zero to every robot, and has no digits in double-double.
#[test]
fn gravity_is_zero_or_one_that_has_digits_whoever_says_it() {
    for (gravity, is_fit) in
        [([0.0, 0.0, 0.0], true), ([0.0, 1e-300, -9.81], true), ([1e-300, 0.0, 0.0], false), ([0.0, 2e6, 0.0], false)]
    {
        let written = ARM.replacen("gravity = [0.0, 0.0, -9.81]", &format!("gravity = {gravity:?}"), 1);
        let functions = vec![Function::GravityForce];
        let of_file = compile(&Source::new("arm.toml", written), &Options { functions, ..Options::default() });
        let model = ModelOptions { gravity: Some(gravity), ..ModelOptions::default() };
        let functions = vec![Function::GravityForce];
        let of_options = compile(&Source::new("arm.toml", ARM), &Options { functions, model, ..Options::default() });
        let held = Scene { gravity: Gravity::Constant(gravity), ..Scene::default() };
        let functions = vec![Function::GravityForce];
        let of_scene =
            compile(&Source::new("arm.toml", ARM), &Options { functions, scene: held, ..Options::default() });
        for (front, compiled) in [("file", of_file), ("options", of_options), ("scene", of_scene)] {
            match compiled {
                Ok(generated) => {
                    let is_plainer = generated.warnings.iter().any(|d| d.code == "plainer-form");
                    assert!(is_fit && !is_plainer, "{front}: {gravity:?}: {:?}", generated.warnings);
                }
                Err(said) => assert!(!is_fit && said.to_string().contains("from 1e-30 to 1e6 m/s²"), "{front}: {said}"),
            }
        }
    }
}

#[test]
fn without_a_word_they_are_the_limits_of_the_robot_file_and_what_has_none_is_unlimited() {
    let (generated, range) = arm("", false);
    assert_eq!(range("q"), [between(-2.0, 2.0), between(0.0, 0.5), InputRange::UNLIMITED]);
    assert_eq!(range("qd"), [InputRange::within(3.0), InputRange::UNLIMITED, InputRange::UNLIMITED]);
    assert_eq!(range("tau"), [InputRange::within(40.0), InputRange::UNLIMITED, InputRange::UNLIMITED]);
    assert_eq!(range("qdd"), [InputRange::UNLIMITED; 3]);
    assert_eq!(range("gravity"), [InputRange::UNLIMITED; 3]);
    assert!(!InputRange::UNLIMITED.is_bounded() && InputRange::within(3.0).is_bounded());
    assert!(!generated.text.contains("Ranges of the inputs"));
}

#[test]
fn a_scene_states_them_for_all_joints_or_by_name_and_the_generated_file_says_them() {
    let (generated, range) = arm(
        "[hold]\ngravity = \"input\"\n\
         [numbers.ranges]\nq = { roll = [-7, 7.0] }\nqd = 2\nqdd = [-30.0, 40.0]\ntau = \"unlimited\"\ngravity = 9.9\n",
        false,
    );
    assert_eq!(range("q"), [between(-2.0, 2.0), between(0.0, 0.5), InputRange::within(7.0)]);
    assert_eq!(range("qd"), [InputRange::within(2.0); 3]);
    assert_eq!(range("qdd"), [between(-30.0, 40.0); 3]);
    assert_eq!(range("tau"), [InputRange::UNLIMITED; 3]);
    assert_eq!(range("gravity"), [InputRange::within(9.9); 3]);
    for line in [
        "// Ranges of the inputs:\n//   q[0] shoulder: -2.0 to 2.0 rad\n//   q[1] lift: 0.0 to 0.5 m\n",
        "//   qd[1] lift: -2.0 to 2.0 m/s\n//   qd[2] roll: -2.0 to 2.0 rad/s\n",
        "//   tau[2] roll: unlimited\n//   gravity: -9.9 to 9.9 m/s²\n",
    ] {
        assert!(generated.text.contains(line), "{line}");
    }
}

#[test]
fn they_change_no_operation() {
    let functions = |scene: &str| arm(scene, false).0.items.into_iter().map(|i| i.routine).collect::<Vec<_>>();
    assert_eq!(functions("[numbers.ranges]\nqd = 1e-9\n"), functions(""));
}

#[test]
fn joints_at_rest_are_at_zero_and_a_quaternion_is_a_unit_quaternion() {
    let (_, range) = arm("[zero]\njoints_at_rest = [\"lift\"]\n[numbers.ranges]\nqd = 2.0\n", false);
    assert_eq!(range("qd"), [InputRange::within(2.0), InputRange::ZERO, InputRange::within(2.0)]);
    let (_, range) = arm("[numbers.ranges]\nq = { root_joint = 5.0 }\nqd = { root_joint = 4.0 }\n", true);
    let q = range("q");
    assert_eq!((&q[..3], &q[3..7]), (&[InputRange::within(5.0); 3][..], &[InputRange::within(1.0); 4][..]));
    assert_eq!(q[7], between(-2.0, 2.0));
    assert_eq!(range("qd")[..7], [[InputRange::within(4.0); 6].as_slice(), &[InputRange::within(3.0)]].concat());
}
