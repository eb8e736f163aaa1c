//! Generates and compiles every function of every robot of the reference data, so that the tests run compiled code.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use straightline_codegen::choices::{Lanes, LimbForm};
use straightline_codegen::compile::compile;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::emit::Generated;
use straightline_codegen::expr::Grade;
use straightline_codegen::function::ContactFunction;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::options::Options;
use straightline_codegen::scene::contact::{ContactItem, EnvironmentItem, EnvironmentKind, SurfaceItem};
use straightline_codegen::scene::{Parameter, Scene, SceneContacts};
use straightline_codegen::schedule::ScheduleLimits;
use straightline_codegen::{Function, Scalar};
use straightline_core::contact::Coordinate;

/// Robot, its file, whether it floats, its frames; as in `reference/robots.json`.
const ROBOTS: [(&str, &str, bool, &[&str]); 11] = [
    ("planar2r", "planar2r.urdf", false, &["tip"]),
    ("chapter_cylindrical", "chapter_cylindrical.toml", false, &["tip"]),
    ("chapter_stanford", "chapter_stanford.toml", false, &["tip"]),
    ("chapter_6r", "chapter_6r.toml", false, &["tip"]),
    ("chapter_oblique", "chapter_oblique.toml", false, &["tip"]),
    ("puma560", "puma560.urdf", false, &["tool0"]),
    ("ur5", "ur5.urdf", false, &["tool0"]),
    ("panda", "panda.urdf", false, &["panda_hand_tcp"]),
    ("solo12", "solo12.urdf", true, &["FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"]),
    ("hyq", "hyq.urdf", true, &["lf_foot", "lh_foot", "rf_foot", "rh_foot"]),
    ("simple_humanoid", "simple_humanoid.urdf", true, &["r_ankle", "l_ankle", "r_wrist", "l_wrist"]),
];

/// The robots of `reference/joints`, which are compiled once each.
const JOINTS: [(&str, &str, bool, &[&str]); 15] = [
    ("mimic_gripper", "mimic_gripper.urdf", false, &["finger_right"]),
    ("mimic_chain", "mimic_chain.urdf", false, &["f_link"]),
    ("mimic_screw", "mimic_screw.urdf", false, &["tool_link", "screw_link"]),
    ("mimic_tree", "mimic_tree.urdf", false, &["l_wrist_link", "r_wrist_link"]),
    ("mimic_float", "mimic_float.urdf", true, &["l_ankle_link", "r_ankle_link"]),
    ("ball_pendulum", "ball_pendulum.xml", false, &["bob"]),
    ("ball_chain", "ball_chain.xml", false, &["e", "b"]),
    ("ball_float", "ball_float.xml", true, &["l_shin", "r_shin"]),
    ("multi_planar", "multi_planar.xml", false, &["cyl"]),
    ("multi_arm", "multi_arm.xml", false, &["c", "d"]),
    ("loop_fourbar", "loop_fourbar.xml", false, &["coupler"]),
    ("loop_palletiser", "loop_palletiser.xml", false, &["forearm", "tri"]),
    ("loop_ankle", "loop_ankle.xml", false, &["foot"]),
    ("loop_ankle_float", "loop_ankle_float.xml", true, &["foot", "rod_l"]),
    ("loop_leg", "loop_leg.xml", false, &["foot", "tarsus"]),
];

/// Robots that are compiled under the exact rules too, and in single precision.
const EXACT: [&str; 4] = ["chapter_stanford", "chapter_oblique", "panda", "solo12"];
const SINGLE: [&str; 4] = ["planar2r", "chapter_oblique", "panda", "solo12"];
/// Robots whose derivatives are compiled too.
const DERIVATIVES: [&str; 3] = ["planar2r", "panda", "solo12"];

fn main() {
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions");
    println!("cargo:rerun-if-changed=build.rs");
    let mut modules = String::new();
    let mut tables = [(Scalar::F64, String::new()), (Scalar::F32, String::new())];
    for (robot, file, floating, frames) in ROBOTS {
        let path = folder.join(file);
        println!("cargo:rerun-if-changed={}", path.display());
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let source = Source::new(file, text);
        for (scalar, grade) in variants(robot) {
            let options = Options {
                frames: frames.iter().map(|f| f.to_string()).collect(),
                scalar,
                grade,
                model: ModelOptions { floating_base: floating, ..ModelOptions::default() },
                ..Options::default()
            };
            let exact = if grade == Grade::Exact { "_exact" } else { "" };
            let module = format!("{robot}_{}{exact}", scalar.name());
            // derivatives in a module of their own
            let functions: [(String, Vec<Function>); 2] = [
                (module.clone(), Function::all().collect()),
                (format!("{module}_derivatives"), vec![Function::InverseDynamicsDerivatives]),
            ];
            let mut calls = String::new();
            for (module, functions) in functions.into_iter().take(1 + usize::from(DERIVATIVES.contains(&robot))) {
                let options = Options { functions: functions.clone(), ..options.clone() };
                let generated = compile(&source, &options).unwrap_or_else(|d| panic!("{}", d.render()));
                std::fs::write(out.join(format!("{module}.rs")), &generated.text).expect("OUT_DIR can be written");
                let _ = writeln!(
                    modules,
                    "/// `{file}`, {}, {grade:?} rules.\n#[allow(clippy::all)]\npub mod {module} {{\n    \
                     include!(concat!(env!(\"OUT_DIR\"), \"/{module}.rs\"));\n}}",
                    scalar.name(),
                );
                calls.push_str(&calls_of(&module, &generated, &functions));
            }
            let table = &mut tables.iter_mut().find(|(s, _)| *s == scalar).expect("both scalars have a table").1;
            let _ = writeln!(
                table,
                "    Compiled {{\n        robot: {robot:?},\n        exact: {},\n        functions: &[\n{}        ],\n    }},",
                grade == Grade::Exact,
                calls
            );
        }
    }
    for (scalar, table) in tables {
        let (name, upper) = (scalar.name(), scalar.name().to_uppercase());
        let _ = writeln!(
            modules,
            "/// Everything compiled for `{name}`.\npub const {upper}: &[Compiled<{name}>] = &[\n{table}];"
        );
    }
    std::fs::write(out.join("compiled.rs"), modules).expect("OUT_DIR can be written");
    for (robot, kinds) in CONTACTS {
        let kinds = [&["surface", "elastic_base"], kinds].concat();
        let text = contacts(&folder, robot, &kinds, Options::default());
        std::fs::write(out.join(format!("contact_{robot}.rs")), text).expect("OUT_DIR can be written");
    }
    let generic = Options { generic: true, lanes: Some(Lanes::Runtime), ..Options::default() };
    let fused = Options { fma: true, lanes: Some(Lanes::Standalone), ..Options::default() };
    for (name, options) in [("generic", generic), ("fused", fused)] {
        let text = contacts(&folder, "planar2r", &["surface"], options);
        std::fs::write(out.join(format!("contact_planar2r_{name}.rs")), text).expect("OUT_DIR can be written");
    }
    lanes(&out, &folder);
    joints(&out);
}

/// All functions of the robots of `reference/joints`, in a file of their own.
fn joints(out: &Path) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("reference/joints/robots");
    let (mut modules, mut table) = (String::new(), String::new());
    for (robot, file, floating, frames) in JOINTS {
        let path = folder.join(file);
        println!("cargo:rerun-if-changed={}", path.display());
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let options = Options {
            frames: frames.iter().map(|f| f.to_string()).collect(),
            model: ModelOptions { floating_base: floating, ..ModelOptions::default() },
            ..Options::default()
        };
        let generated = compile(&Source::new(file, text), &options).unwrap_or_else(|d| panic!("{}", d.render()));
        std::fs::write(out.join(format!("{robot}.rs")), &generated.text).expect("OUT_DIR can be written");
        let _ = writeln!(
            modules,
            "/// `{file}`.\n#[allow(clippy::all)]\npub mod {robot} {{\n    include!(concat!(env!(\"OUT_DIR\"), \"/{robot}.rs\"));\n}}",
        );
        let calls = calls_of(robot, &generated, &Function::of(&generated.model).collect::<Vec<_>>());
        let _ = writeln!(
            table,
            "    Compiled {{\n        robot: {robot:?},\n        exact: false,\n        functions: &[\n{calls}        ],\n    }},"
        );
    }
    let table = format!("/// Robots with other joints.\npub const JOINTS: &[Compiled<f64>] = &[\n{table}];\n");
    std::fs::write(out.join("joints.rs"), modules + &table).expect("OUT_DIR can be written");
}

/// Functions over lanes and batches for `tests/suite/lanes.rs`: in one part and in several, with every shape of output, with a
/// parameter that all states share, in both scalars, with both homes of the drivers.
fn lanes(out: &Path, folder: &Path) {
    use Function::{ForwardDynamics, InverseDynamics, Jacobian, MassMatrix};
    let robot = |file: &str, options: Options| {
        let text = std::fs::read_to_string(folder.join(file)).expect("the files are there");
        compile(&Source::new(file, text), &options).unwrap_or_else(|d| panic!("{}", d.render())).text
    };
    let payload = Scene {
        parameters: vec![Parameter::Payload { name: "load".to_string(), frame: "panda_hand".to_string() }],
        ..Scene::default()
    };
    let modules = [
        (
            "lanes_solo12",
            robot(
                "solo12.urdf",
                Options {
                    functions: vec![InverseDynamics, MassMatrix, ForwardDynamics, Jacobian],
                    frames: vec!["FL_FOOT".to_string(), "HR_FOOT".to_string()],
                    limits: ScheduleLimits { operations: 900 },
                    model: ModelOptions { floating_base: true, ..ModelOptions::default() },
                    lanes: Some(Lanes::Runtime),
                    ..Options::default()
                },
            ),
        ),
        (
            "lanes_panda",
            robot(
                "panda.urdf",
                Options {
                    functions: vec![InverseDynamics, Function::InverseDynamicsDerivatives],
                    scalar: Scalar::F32,
                    lanes: Some(Lanes::Standalone),
                    ..Options::default()
                },
            ),
        ),
        (
            "lanes_payload",
            robot(
                "panda.urdf",
                Options {
                    functions: vec![InverseDynamics],
                    scene: payload,
                    lanes: Some(Lanes::Standalone),
                    ..Options::default()
                },
            ),
        ),
    ];
    let fused = Options {
        functions: vec![InverseDynamics, ForwardDynamics],
        limits: ScheduleLimits { operations: 900 },
        model: ModelOptions { floating_base: true, ..ModelOptions::default() },
        lanes: Some(Lanes::Runtime),
        fma: true,
        ..Options::default()
    };
    let generic = Options {
        functions: vec![InverseDynamics, Function::GravityForce, MassMatrix, Function::InverseDynamicsVjp],
        limits: ScheduleLimits { operations: 250 },
        lanes: Some(Lanes::Runtime),
        generic: true,
        ..Options::default()
    };
    let limbs = |functions: &[Function], generic| Options {
        functions: functions.to_vec(),
        model: ModelOptions { floating_base: true, ..ModelOptions::default() },
        limbs: LimbForm::Lanes,
        generic,
        ..Options::default()
    };
    let forces = [InverseDynamics, Function::GravityForce, Function::BiasForce, Function::VelocityForce];
    let sums = Options { functions: vec![InverseDynamics, ForwardDynamics], generic: true, ..Options::default() };
    let modules = modules.into_iter().chain([
        ("fused_solo12", robot("solo12.urdf", fused)),
        ("generic_panda", robot("panda.urdf", generic)),
        ("generic_ur5", robot("ur5.urdf", sums)),
        ("limbs_hyq", robot("hyq.urdf", limbs(&forces, false))),
        ("limbs_humanoid", robot("simple_humanoid.urdf", limbs(&forces, false))),
        ("limbs_generic", robot("solo12.urdf", limbs(&[InverseDynamics], true))),
    ]);
    for (name, text) in modules {
        std::fs::write(out.join(format!("{name}.rs")), text).expect("OUT_DIR can be written");
    }
}

/// Robots of the contact cases, and the contacts that they make there beside a surface, a plane one and one that gives way.
const CONTACTS: [(&str, &[&str]); 7] = [
    ("planar2r", &[]),
    ("chapter_cylindrical", &["two_surfaces", "point"]),
    ("chapter_stanford", &["two_surfaces", "point", "peg_in_hole", "fixed_direction"]),
    ("chapter_6r", &["two_surfaces", "point", "peg_in_hole", "fixed_direction"]),
    ("puma560", &["two_surfaces", "point", "peg_in_hole", "fixed_direction"]),
    ("ur5", &["two_surfaces", "point", "peg_in_hole", "fixed_direction"]),
    ("panda", &["two_surfaces", "point", "peg_in_hole", "fixed_direction"]),
];

/// The module of a robot in contact: objects, tool axes and environments are inputs, so that one module serves all cases.
fn contacts(folder: &Path, robot: &str, kinds: &[&str], options: Options) -> String {
    use Coordinate::{Ax, Ay, Px, Py, Pz};
    let (_, file, _, frames) = ROBOTS.into_iter().find(|r| r.0 == robot).expect("a robot of the data");
    let contact = |kind: &str| ContactItem {
        name: kind.to_string(),
        frame: frames[0].to_string(),
        axis: None,
        object: None,
        surface: SurfaceItem::Plane,
        constrained: match kind {
            "two_surfaces" => vec![Px, Py],
            "point" => vec![Px, Py, Pz],
            "peg_in_hole" => vec![Px, Py, Ax, Ay],
            "fixed_direction" => vec![Ax, Ay],
            _ => vec![Pz],
        },
        free: vec![],
        friction: None,
        environment: (kind == "elastic_base").then_some(EnvironmentItem { kind: EnvironmentKind::Mass, values: None }),
    };
    let functions =
        vec![ContactFunction::ConstrainedCoordinates, ContactFunction::ForwardDynamics, ContactFunction::Impact];
    let contacts = SceneContacts {
        contacts: kinds.iter().copied().map(contact).collect(),
        functions: Some(functions),
        ..SceneContacts::default()
    };
    let text = std::fs::read_to_string(folder.join(file)).expect("a robot file can be read");
    let scene = Scene { contacts, ..Scene::default() };
    let options = Options { functions: vec![], scene, ..options };
    compile(&Source::new(file, text), &options).unwrap_or_else(|d| panic!("{}", d.render())).text
}

fn variants(robot: &str) -> Vec<(Scalar, Grade)> {
    let mut variants = vec![(Scalar::F64, Grade::Algebraic)];
    if EXACT.contains(&robot) {
        variants.push((Scalar::F64, Grade::Exact));
    }
    if SINGLE.contains(&robot) {
        variants.push((Scalar::F32, Grade::Algebraic));
    }
    if SINGLE.contains(&robot) && EXACT.contains(&robot) {
        variants.push((Scalar::F32, Grade::Exact));
    }
    variants
}

/// Table entries that call the functions of a module with inputs and outputs of any length.
fn calls_of(module: &str, generated: &Generated, functions: &[Function]) -> String {
    let mut text = String::new();
    for function in functions {
        let arguments = function.inputs(&generated.model, generated.frames.len()).len();
        let mut arguments: Vec<String> = (0..arguments).map(|i| format!("array(&x[{i}])")).collect();
        let name = function.name();
        let _ = writeln!(text, "            ({name:?}, |x| {{");
        let outputs = function.outputs(&generated.model, generated.frames.len());
        for (i, output) in outputs.iter().enumerate() {
            let zero = output.shape.iter().rev().fold("0.0".to_string(), |inner, n| format!("[{inner}; {n}]"));
            let _ = writeln!(text, "                let mut y{i} = {zero};");
            arguments.push(format!("&mut y{i}"));
        }
        let all: Vec<String> = (0..outputs.len()).map(|i| format!("Flatten::flatten(&y{i})")).collect();
        let (arguments, all) = (arguments.join(", "), all.join(", "));
        let _ = writeln!(
            text,
            "                {module}::{name}({arguments});\n                [{all}].concat()\n            }}),"
        );
    }
    text
}
