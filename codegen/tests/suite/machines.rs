//! Programs for machines: which kernel their sines are by, what is proven of them, and that their text is read back.

use std::path::Path;
use straightline_codegen::certify::search::worst_found;
use straightline_codegen::certify::{certify, Effort};
use straightline_codegen::choices::{Lanes, Memory, TargetMachine};
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::emit::Generated;
use straightline_codegen::expr::Sines;
use straightline_codegen::options::{scene_file, Options};
use straightline_codegen::program::input_box::input_box;
use straightline_codegen::readback::checked;
use straightline_codegen::{compile, Function, Scalar};

fn robot(name: &str) -> Source {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(name);
    Source::new(name, std::fs::read_to_string(path).expect("the robot is there"))
}

fn on(machine: TargetMachine) -> Options {
    let functions = vec![Function::InverseDynamics, Function::GravityForce, Function::MassMatrix];
    Options { functions, scalar: Scalar::F32, target: Some(machine), ..Options::default() }
}

fn generated(robot: &Source, options: &Options) -> Generated {
    compile(robot, options).unwrap_or_else(|errors| panic!("{errors}"))
}

fn kernels(generated: &Generated) -> Vec<Sines> {
    generated.programs.functions.iter().map(|f| f.graph.sines).collect()
}

fn with_scene(options: &Options, text: &str) -> Options {
    let mut diagnostics = Diagnostics::new();
    let file = scene_file::read(&Source::new("scene.toml", text), &mut diagnostics);
    file.unwrap_or_else(|| panic!("{diagnostics}")).into_options(options.clone())
}

#[test]
fn sines_are_short_where_angles_are_known_to_be_small() {
    let m4 = on(TargetMachine::CORTEX_M4F);
    assert_eq!(kernels(&generated(&robot("panda.urdf"), &m4)), [Sines::Short; 3]);
    // without limits nothing is known, until a scene says it
    let text = robot("panda.urdf").text().replace("<limit lower=\"-2.8973\" upper=\"2.8973\"", "<limit");
    let unlimited = Source::new("panda.urdf", text.replace("type=\"revolute\"", "type=\"continuous\""));
    assert_eq!(kernels(&generated(&unlimited, &m4)), [Sines::Precise; 3]);
    let ranges = |q: f64| with_scene(&m4, &format!("[numbers.ranges]\nq = [-{q:?}, {q:?}]\n"));
    assert_eq!(kernels(&generated(&unlimited, &ranges(402.0))), [Sines::Short; 3]);
    assert_eq!(kernels(&generated(&unlimited, &ranges(402.1))), [Sines::Precise; 3]);
}

#[test]
fn sines_are_short_on_machines_of_one_angle_at_a_time_and_in_single_precision() {
    let panda = robot("panda.urdf");
    for machine in TargetMachine::ALL {
        let expected = if machine.row().is_scalar { Sines::Short } else { Sines::Precise };
        assert_eq!(kernels(&generated(&panda, &on(*machine))), [expected; 3], "{machine:?}");
    }
    let m4 = on(TargetMachine::CORTEX_M4F);
    for options in [
        Options { scalar: Scalar::F64, ..m4.clone() },
        Options { lanes: Some(Lanes::Standalone), ..m4.clone() },
        Options { generic: true, ..m4.clone() },
        Options { fma: true, ..m4.clone() },
        Options { grade: straightline_codegen::Grade::Exact, ..m4.clone() },
        Options { target: None, ..m4.clone() },
    ] {
        assert_eq!(kernels(&generated(&panda, &options)), [Sines::Precise; 3]);
    }
}

#[test]
fn certified_errors_hold_with_short_sines_and_are_not_idle() {
    for name in ["panda.urdf", "puma560.urdf", "solo12.urdf"] {
        let generated = generated(&robot(name), &on(TargetMachine::CORTEX_M4F));
        for function in &generated.programs.functions {
            let scene = with_scene(&Options::default(), "").scene;
            let ranges = input_box(&function.graph.inputs, &scene, &generated.model).expect("inputs have ranges");
            let bound = certify(&function.graph, Scalar::F32, &ranges, Effort::default()).expect("it has bounds");
            let found = worst_found(&function.graph, Scalar::F32, &ranges, 4000, 1);
            let share = bound.errors.iter().zip(&found).map(|(bound, found)| found.error / bound).fold(0.0, f64::max);
            assert!(share <= 1.0, "{name} {}: {share}", function.name);
            assert!(share > 0.01, "{name} {}: {share}", function.name);
        }
    }
}

#[test]
fn a_text_with_short_sines_is_read_back() {
    let panda = robot("panda.urdf");
    for memory in [Memory::Flash, Memory::Tcm] {
        let generated = generated(&panda, &Options { memory, ..on(TargetMachine::CORTEX_M4F) });
        let inlined = if memory == Memory::Flash {
            "#[inline(never)]\n    #[must_use]"
        } else {
            "#[inline(always)]\n    #[must_use]"
        };
        let multiply_accumulate = generated.text.contains("-C target-feature=-slowfpvmlx\n");
        assert_eq!(multiply_accumulate, memory == Memory::Flash, "the head says what rustc is to be told");
        assert!(generated.text.contains(inlined) && !generated.text.contains("mod trig"), "{memory:?}");
        // from flash two angles have one call
        let [call, of_others, precise] = match memory {
            Memory::Flash => [
                "short_sines::sin_cos_lanes_f32([q[1], q[2]])",
                "short_sines::sin_cos_lanes_f32([q[2], q[1]])",
                "trig::sin_cos_lanes_f32([q[1], q[2]])",
            ],
            Memory::Tcm => {
                ["short_sines::sin_cos_f32(q[1])", "short_sines::sin_cos_f32(q[2])", "trig::sin_cos_f32(q[1])"]
            }
        };
        for (word, other) in [
            (call, of_others),
            (call, precise),
            ("const P1: f32 = 0.0004838268", "const P1: f32 = 0.0004838269"),
            ("(cos, -sin)", "(cos, sin)"),
        ] {
            let text = generated.text.replacen(word, other, 1);
            assert_ne!(text, generated.text, "{word}");
            assert!(checked(Generated { text, ..generated.clone() }).is_err(), "{word} -> {other}");
        }
    }
}
