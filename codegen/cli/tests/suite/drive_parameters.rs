//! Numbers of drives as run-time parameters: functions that take them compute what the functions of a robot file do in which these numbers
//! stand.

use crate::in_c::{succeeds, Library};
use std::path::Path;
use std::process::Command;
use straightline_cli::experiment::parameter;
use straightline_codegen::choices::Lanes;
use straightline_codegen::description::Description;
use straightline_codegen::diagnostic::Diagnostics;
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::{evaluate, Graph};
use straightline_codegen::options::scene_file;
use straightline_codegen::options::Optimisations;
use straightline_codegen::program::contact::{programs as contact_programs, Mode};
use straightline_codegen::program::parameter::parameter_program;
use straightline_codegen::program::{optimised, staged};
use straightline_codegen::scene::{self, Parameter};
use straightline_codegen::verify::verify;
use straightline_codegen::{compile, model, Builder, Function, Generated, Grade, Options, Scalar, Source};
use straightline_core::{Dd, Real};

fn arm(drives: &str) -> Source {
    crate::chain::arm(crate::chain::LAST_LINK, drives)
}

/// What a robot file says with these numbers in the places `$1`, `$2`, …
fn with(text: &str, numbers: &[f64]) -> String {
    numbers
        .iter()
        .enumerate()
        .rev()
        .fold(text.to_string(), |text, (k, x)| text.replace(&format!("${}", k + 1), &format!("{x:?}")))
}

/// Robots by their drives, the scene's parameters, the numbers of the robot file, and others, in the order of the parameters' numbers.
struct Case {
    drives: &'static str,
    parameters: &'static str,
    numbers: &'static [f64],
    others: &'static [f64],
}

const RIGID: Case = Case {
    drives: "
[[drive]]
joint = \"one\"
ratio = $1
motor = { torque_constant = $4, emf_constant = 0.045, resistance = $3, rotor_inertia = $2, friction = $5 }
efficiency = { forward = $6, backward = $7 }
limits = { input = $8, current = $9 }
[[drive]]
name = \"second motor\"
joint = \"two\"
motor = { torque_constant = $10, resistance = 0.8, inductance = $11, rotor_inertia = 2e-5 }
stages = [{ ratio = 2.5, input_inertia = 1e-6 }, { ratio = $12, input_inertia = $13, output_inertia = $14, efficiency = $15 }]
[[drive]]
joint = \"three\"
ratio = $16
actuator = { C = [[0.0, 1.0], [-1.0, -2.0]], f = [0.1, -8.0], d = [0.0, 5.0], T = [0.0, 1.0] }
",
    parameters: "
[[parameter]]
kind = \"drive\"
drive = \"one\"
numbers = [\"ratio\", \"rotor_inertia\", \"resistance\", \"torque_constant\", \"motor_friction\", \"efficiency_forward\", \"efficiency_backward\", \"input_limit\", \"current_limit\"]
[[parameter]]
kind = \"drive\"
name = \"middle\"
drive = \"second motor\"
numbers = [\"torque_constant\", \"inductance\", \"stage_2_ratio\", \"stage_2_input_inertia\", \"stage_2_output_inertia\", \"stage_2_efficiency\"]
[[parameter]]
kind = \"drive\"
drive = \"three\"
numbers = [\"ratio\"]
",
    numbers: &[
        100.0, 1e-5, 1.2, 0.05, 2e-5, 0.8, 0.65, 24.0, 6.0, 0.06, 5e-4, 40.0, 3e-6, 7e-6, 0.9, 1.5,
    ],
    others: &[
        -61.0, 2.3e-5, 0.7, 0.033, 4e-5, 0.71, 0.59, 18.0, 4.5, 0.081, 3e-4, 51.0, 1.7e-6, 9e-6, 0.77, -0.8,
    ],
};

const ELASTIC: Case = Case {
    drives: "
[[drive]]
joint = \"one\"
motor = { torque_constant = $1, resistance = 1.2, inductance = $2, rotor_inertia = $3 }
stages = [{ ratio = $4, stiffness = $5, input_inertia = 2e-6, output_inertia = $6 }]
[[drive]]
joint = \"two\"
motor = { torque_constant = 0.05, resistance = $7, rotor_inertia = 1e-5 }
stages = [
    { ratio = 2.5, stiffness = $8, damping = $9, input_inertia = 2e-6, output_inertia = 8e-6 },
    { ratio = $10, stiffness = 1.6e4, damping = 4.0, input_inertia = $11 },
]
",
    parameters: "
[[parameter]]
kind = \"drive\"
drive = \"one\"
numbers = [\"torque_constant\", \"inductance\", \"rotor_inertia\", \"ratio\", \"stiffness\", \"stage_1_output_inertia\"]
[[parameter]]
kind = \"drive\"
drive = \"two\"
numbers = [\"resistance\", \"stage_1_stiffness\", \"stage_damping\", \"stage_2_ratio\", \"stage_2_input_inertia\"]
",
    numbers: &[0.05, 5e-4, 1e-5, 80.0, 9e3, 5e-6, 1.2, 90.0, 0.01, 100.0, 1e-5],
    others: &[0.07, 2e-4, 3e-5, 121.0, 4e3, 9e-6, 0.4, 140.0, 0.03, -73.0, 2.5e-5],
};

/// Two motors that drive two joints together, one of them with a gear before both, and a rotor that turns in space.
const COUPLED: Case = Case {
    drives: "
[[drive]]
name = \"left\"
joints = { two = 30.0, three = 31.0 }
motor = { torque_constant = 0.05, resistance = 1.2, rotor_inertia = $1 }
stages = [{ ratio = $2, input_inertia = 1e-6 }]
[[drive]]
name = \"right\"
joints = { two = 28.0, three = -33.0 }
motor = { torque_constant = 0.05, resistance = $3, rotor_inertia = 1e-5 }
[[drive]]
joint = \"one\"
ratio = $5
motor = { torque_constant = 0.05, resistance = 1.2, rotor_inertia = $4 }
rotor = { link = \"a\", axis = [0.3, 0.1, 1.0] }
",
    parameters: "
[[parameter]]
kind = \"drive\"
drive = \"left\"
numbers = [\"rotor_inertia\", \"stage_1_ratio\"]
[[parameter]]
kind = \"drive\"
drive = \"right\"
numbers = [\"resistance\"]
[[parameter]]
kind = \"drive\"
drive = \"one\"
numbers = [\"rotor_inertia\", \"joint_ratio\"]
",
    numbers: &[1e-5, 2.0, 1.2, 2e-5, 50.0],
    others: &[3e-5, -3.5, 0.7, 5e-5, 90.0],
};

const CASES: [(&str, &Case); 3] = [("rigid", &RIGID), ("elastic", &ELASTIC), ("coupled", &COUPLED)];

const FUNCTIONS: [&str; 7] = [
    "driven_forward_dynamics",
    "driven_inverse_dynamics",
    "drive_torques",
    "complete_model",
    "state_space",
    "drive_power",
    "drive_energy",
];

fn options(scene_text: &str) -> Options {
    let names = FUNCTIONS.map(|name| format!("\"{name}\"")).join(", ");
    let text = format!("[outputs]\nfunctions = [{names}]\n{scene_text}");
    let mut complaints = Diagnostics::new();
    let file = scene_file::read(&Source::new("scene.toml", text), &mut complaints);
    file.unwrap_or_else(|| panic!("{complaints}")).into_options(Options::default())
}

fn compiled(source: &Source, options: &Options) -> Generated {
    compile(source, options).unwrap_or_else(|complaints| panic!("{complaints}"))
}

/// A robot in a scene that knows it.
struct InScene {
    robot: Robot,
    options: Options,
}

impl InScene {
    fn new(source: &Source, options: &Options) -> InScene {
        let options = options.knowing(source);
        let mut complaints = Diagnostics::new();
        let model = model::load(source, &options.scene.model_options(&options.model)).0;
        let model = model.and_then(|model| scene::apply(model, &options.scene, &mut complaints));
        let robot = Robot::new(model.unwrap_or_else(|| panic!("{complaints}")));
        let scene = options.scene.resolved(&robot.model);
        InScene { robot, options: Options { scene, ..options } }
    }

    fn functions(&self) -> Vec<Function> {
        self.options.functions.iter().copied().filter(|f| f.is_of(&self.robot.model)).collect()
    }

    /// All that a search finds for these functions is tried elsewhere.
    fn graph(&self, function: Function) -> Graph {
        let optimisations = Optimisations { chosen: false, substitutes: false, ..self.options.optimisations() };
        optimised(&self.robot, &[], function, &self.options, optimisations)
    }

    /// The values of the scene's parameters, from all their numbers in a row.
    fn made<T: Real>(&self, numbers: &[f64]) -> Vec<(String, Vec<T>)> {
        let mut rest = numbers;
        let parameters = self.options.scene.parameters.iter().map(|parameter| {
            let constructor = parameter_program(&self.robot, parameter, &self.options);
            let (own, others) = rest.split_at(constructor.inputs[0].len());
            rest = others;
            let own: Vec<T> = own.iter().map(|x| T::constant(Dd::from(*x))).collect();
            (parameter.input_name(), evaluate(&constructor, &own))
        });
        let parameters = parameters.collect();
        assert!(rest.is_empty(), "every number belongs to a parameter");
        parameters
    }
}

/// Numbers for an input, the same for every robot.
fn input(name: &str, len: usize) -> Vec<f64> {
    let seed = name.bytes().fold(7.0, |seed, byte| seed * 1.3 + f64::from(byte));
    let of = |k: usize| ((seed + k as f64 * 0.618_034) * 12.9898).sin() * if name == "u" { 15.0 } else { 1.1 };
    (0..len).map(of).collect()
}

/// A program at a state, `made` the values of its run-time parameters.
fn run<T: Real>(graph: &Graph, made: &[(String, Vec<T>)]) -> Vec<T> {
    let of = |port: &straightline_codegen::expr::Port| match made.iter().find(|(name, _)| *name == port.name) {
        Some((_, values)) => values.clone(),
        None => input(&port.name, port.len()).into_iter().map(|x| T::constant(Dd::from(x))).collect(),
    };
    evaluate(graph, &graph.inputs.iter().flat_map(of).collect::<Vec<T>>())
}

fn assert_near(what: &str, found: &[Dd], expected: &[Dd], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{what}");
    let scale = expected.iter().map(|x| x.hi().abs()).fold(0.0, f64::max);
    for (k, (a, b)) in found.iter().zip(expected).enumerate() {
        let off = (*a - *b).hi().abs();
        assert!(
            off <= tolerance * scale,
            "{what}: result {k} is {} for {}, off by {off:e} of {scale:e}",
            a.hi(),
            b.hi()
        );
    }
}

/// At these numbers all functions are those of the robot file in which the numbers stand.
fn agrees(name: &str, case: &Case, numbers: &[f64], scene_text: &str) {
    let free =
        InScene::new(&arm(&with(case.drives, case.numbers)), &options(&format!("{}{scene_text}", case.parameters)));
    let fixed = InScene::new(&arm(&with(case.drives, numbers)), &options(scene_text));
    assert!(free.functions().len() >= 6 && free.functions() == fixed.functions(), "{name}: {:?}", free.functions());
    let (exact, rounded) = (free.made::<Dd>(numbers), free.made::<f64>(numbers));
    let mut takes = 0;
    for function in free.functions() {
        let (a, b) = (free.graph(function), fixed.graph(function));
        takes += a.inputs.iter().filter(|p| p.wrapper.is_some()).count();
        let what = format!("{name}, {}", function.name());
        let truth = run::<Dd>(&b, &[]);
        assert_near(&what, &run::<Dd>(&a, &exact), &truth, 1e-24);
        let found: Vec<Dd> = run::<f64>(&a, &rounded).into_iter().map(Dd::from).collect();
        // constants of the file are rounded once, here every number is
        assert_near(&format!("{what} in f64"), &found, &truth, 3e-13);
    }
    assert!(takes >= 5, "{name}: functions take {takes} parameters");
}

#[test]
fn at_the_numbers_of_the_robot_file_functions_are_those_without_parameters() {
    for (name, case) in CASES {
        agrees(name, case, case.numbers, "");
    }
}

#[test]
fn at_other_numbers_functions_are_those_of_a_robot_file_with_these() {
    for (name, case) in CASES {
        agrees(name, case, case.others, "");
    }
}

#[test]
fn effects_that_a_scene_leaves_out_are_left_out_of_what_follows_from_the_numbers() {
    // no stiffness and no efficiency is there to be named then
    let elastic = Case {
        parameters: "
[[parameter]]
kind = \"drive\"
drive = \"one\"
numbers = [\"torque_constant\", \"inductance\", \"rotor_inertia\", \"ratio\", \"stage_1_output_inertia\"]
[[parameter]]
kind = \"drive\"
drive = \"two\"
numbers = [\"resistance\", \"stage_2_ratio\", \"stage_2_input_inertia\"]
",
        drives: ELASTIC.drives,
        numbers: ELASTIC.numbers,
        others: ELASTIC.others,
    };
    let text = "[effects]\nelastic_transmissions = false\ntransmission_losses = false\n";
    let free =
        InScene::new(&arm(&with(elastic.drives, elastic.numbers)), &options(&format!("{}{text}", elastic.parameters)));
    let fixed = InScene::new(&arm(&with(elastic.drives, elastic.others)), &options(text));
    let o = elastic.others;
    let exact = free.made::<Dd>(&[o[0], o[1], o[2], o[3], o[5], o[6], o[9], o[10]]);
    for function in free.functions() {
        let (a, b) = (free.graph(function), fixed.graph(function));
        assert_near(function.name(), &run::<Dd>(&a, &exact), &run::<Dd>(&b, &[]), 1e-24);
    }
}

#[test]
fn joints_that_a_scene_locks_leave_the_drives_of_the_others() {
    agrees("coupled, locked", &COUPLED_LOCKED, COUPLED_LOCKED.others, "[hold]\njoints = { three = 0.4 }\n");
}

/// Of a drive on two joints one is left.
const COUPLED_LOCKED: Case = Case {
    drives: "
[[drive]]
name = \"left\"
joints = { two = 30.0, three = 31.0 }
motor = { torque_constant = 0.05, resistance = $3, rotor_inertia = $1 }
stages = [{ ratio = $2, input_inertia = 1e-6 }]
",
    parameters: "
[[parameter]]
kind = \"drive\"
drive = \"left\"
numbers = [\"rotor_inertia\", \"stage_1_ratio\", \"resistance\"]
",
    numbers: &[1e-5, 2.0, 1.2],
    others: &[3e-5, -3.5, 0.7],
};

#[test]
fn constants_of_the_robot_file_are_in_the_text() {
    let source = arm(&with(ELASTIC.drives, ELASTIC.numbers));
    let options = Options { functions: only("drive_energy"), ..options(ELASTIC.parameters) };
    let text = compiled(&source, &options).text;
    for part in [
        "pub struct OneNumbers {",
        "    /// C_M \\[N·m/A\\].\n    pub torque_constant: f64,",
        "pub const NOMINAL: OneNumbers = OneNumbers { torque_constant: 0.05, inductance: 0.0005, rotor_inertia: 1e-5, ratio: 80.0, stiffness: 9000.0, stage_1_output_inertia: 5e-6 };",
        "impl Default for One {",
        "pub fn new(numbers: TwoNumbers) -> Result<Two, OutOfRange> {",
        "check_number(\"stage_2_ratio\", numbers.stage_2_ratio, numbers.stage_2_ratio != 0.0, \"not zero\")?;",
        "one: &One, two: &Two",
    ] {
        assert!(text.contains(part), "{part} is not in\n{}", &text[..9000]);
    }
}

/// What the constructor takes and refuses, as rustc compiles it.
#[test]
fn the_constructor_checks_what_it_is_given() {
    let source = arm(&with(ELASTIC.drives, ELASTIC.numbers));
    let options = Options { functions: only("drive_energy"), ..options(ELASTIC.parameters) };
    let text = compiled(&source, &options).text;
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("drive_parameters");
    std::fs::create_dir_all(&folder).expect("a folder for programs");
    let (file, program) = (folder.join("drive.rs"), folder.join("drive"));
    let main = "
fn main() {
    use arm::{One, OneNumbers};
    let said = |numbers: OneNumbers| One::new(numbers).unwrap_err().to_string();
    let of_file = OneNumbers::default();
    assert_eq!(said(OneNumbers { ratio: 0.0, ..of_file }), \"`ratio` must be not zero\");
    assert_eq!(said(OneNumbers { stiffness: -1.0, ..of_file }), \"`stiffness` must be positive\");
    assert_eq!(said(OneNumbers { inductance: f64::NAN, ..of_file }), \"`inductance` must be finite\");
    assert!(said(OneNumbers { ratio: 1e-200, ..of_file }).contains(\"what follows from them is finite\"));
    let energy = |one: &One| {
        let mut e = [0.0; 3];
        arm::drive_energy(&[0.1, 0.2, 0.3], &[1.0, 2.0, 3.0], &[0.7; 7], one, &arm::Two::NOMINAL, &mut e);
        e
    };
    let (a, b) = (energy(&One::NOMINAL), energy(&One::new(of_file).unwrap()));
    assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-14 * a.abs()), \"{a:?} {b:?}\");
    // L i²/2 of the only motor with an inductance, three times as much
    let more = energy(&One::new(OneNumbers { inductance: 3.0 * of_file.inductance, ..of_file }).unwrap());
    assert!((more[2] - 3.0 * a[2]).abs() <= 1e-14 * more[2]);
}
";
    std::fs::write(&file, format!("#[allow(dead_code)]\nmod arm {{\n{text}\n}}\n{main}")).expect("it can be written");
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_string());
    let built =
        Command::new(rustc).args(["--edition", "2021", "-o"]).args([&program, &file]).output().expect("rustc runs");
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let ran = Command::new(&program).output().expect("the program runs");
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
}

#[test]
fn in_stages_they_are_parameters() {
    let free = InScene::new(&arm(&with(RIGID.drives, RIGID.numbers)), &options(RIGID.parameters));
    let functions = vec![only("driven_forward_dynamics")[0], only("drive_power")[0]];
    let options = Options { functions, ..free.options.clone() };
    let programs = staged::programs(&free.robot, &[], &options).expect("they agree with their equations").0;
    let mut values: Vec<(String, Vec<Dd>)> = free.made(RIGID.others);
    assert_eq!(programs.staged.stages.len(), 3, "parameters, configuration, velocity");
    for stage in &programs.staged.stages {
        let stored = run::<Dd>(stage, &values);
        values.push((stage.outputs[0].name.clone(), stored));
    }
    for (function, (_, graph)) in programs.functions.iter().zip(&programs.staged.functions) {
        let plain = run::<Dd>(&free.graph(*function), &values);
        assert_near(function.name(), &run::<Dd>(graph, &values), &plain, 1e-24);
    }
}

#[test]
fn in_contact_too() {
    let contact = "[[contact]]\nname = \"floor\"\nframe = \"c\"\nobject = { origin = [0.0, 0.0, 0.0], z = [0.0, 0.0, 1.0], x = [1.0, 0.0, 0.0] }\nconstrained = [\"pz\"]\n";
    let graphs = |drives: &[f64], parameters: &str| {
        let robot = InScene::new(&arm(&with(RIGID.drives, drives)), &options(&format!("{parameters}{contact}")));
        let mode = Mode::all(&robot.options.scene).remove(0);
        let programs = contact_programs(&robot.robot, &robot.options, &mode).expect("they agree with their equations");
        let values = if parameters.is_empty() { Vec::new() } else { robot.made::<Dd>(RIGID.others) };
        (programs, values)
    };
    let (free, values) = graphs(RIGID.numbers, RIGID.parameters);
    let (fixed, _) = graphs(RIGID.others, "");
    let mut takes = 0;
    for (a, b) in free.iter().zip(&fixed) {
        takes += usize::from(a.graph.inputs.iter().any(|p| p.wrapper.is_some()));
        assert_near(a.function.name(), &run::<Dd>(&a.graph, &values), &run::<Dd>(&b.graph, &[]), 1e-24);
    }
    assert!(takes >= 2, "{takes}");
}

#[test]
fn the_second_author_agrees_in_every_scalar_and_style() {
    let source = arm(&with(RIGID.drives, RIGID.numbers));
    for (scalar, lanes, fma, generic) in [
        (Scalar::F64, true, false, false),
        (Scalar::F32, true, false, false),
        (Scalar::F64, true, true, false),
        (Scalar::F64, false, false, true),
    ] {
        let lanes = lanes.then_some(Lanes::Standalone);
        let functions = only("driven_forward_dynamics");
        let options = Options { scalar, lanes, fma, generic, functions, ..options(RIGID.parameters) };
        // the text is read back here
        let generated = compiled(&source, &options);
        let verification = verify(&source, &generated, &options, (3, 5), || {}).unwrap_or_else(|why| panic!("{why}"));
        let worst = &verification.functions["driven_forward_dynamics"];
        assert!(worst.error <= verification.bound, "{scalar:?}: {}", worst.error);
    }
}

fn only(name: &str) -> Vec<Function> {
    Function::known().filter(|f| f.name() == name).collect()
}

fn complaints(drives: &str, parameters: &str) -> String {
    match compile(&arm(drives), &options(parameters)) {
        Ok(generated) => panic!("compiled: {}", generated.text.len()),
        Err(complaints) => complaints.to_string(),
    }
}

#[test]
fn what_cannot_be_is_said_all_at_once() {
    let drives = with(ELASTIC.drives, ELASTIC.numbers);
    let said = complaints(
        &drives,
        "
[[parameter]]
kind = \"drive\"
drive = \"on\"
numbers = [\"ratio\"]
[[parameter]]
kind = \"drive\"
drive = \"one\"
numbers = [\"ratoi\", \"stage_1_ratio\", \"ratio\", \"efficiency\", \"stage_1_damping\"]
[[parameter]]
kind = \"drive\"
name = \"again\"
drive = \"one\"
numbers = [\"inductance\"]
[[parameter]]
kind = \"drive\"
drive = \"two\"
numbers = [\"inductance\", \"stage_2_output_inertia\", \"C\"]
",
    );
    for part in [
        "parameter `on`: the robot has no drive `on`",
        "did you mean `one`?",
        "parameter `one`: drive `one` has no number `ratoi`",
        "did you mean `ratio`?",
        "parameter `one`: `ratio` and `stage_1_ratio` are one number",
        "drive `one` has no number `efficiency`",
        "drive `one` has no number `stage_1_damping`",
        "the numbers of drive `one` are a parameter twice",
        "drive `two` has no number `inductance`",
        "`stage_2_output_inertia` cannot be free: it is 0.0 in the robot file",
        "drive `two` has no number `C`",
        "scene.toml:",
    ] {
        assert!(said.contains(part), "`{part}` is not in\n{said}");
    }
}

#[test]
fn numbers_of_what_does_not_move_are_an_error() {
    let said = complaints(
        &with(RIGID.drives, RIGID.numbers),
        "[hold]\njoints = { one = 0.3 }\n[[parameter]]\nkind = \"drive\"\ndrive = \"one\"\nnumbers = [\"ratio\"]\n",
    );
    assert!(said.contains("no joint of drive `one` moves in this scene"), "{said}");
}

#[test]
fn functions_without_drives_take_nothing() {
    let free = InScene::new(&arm(&with(RIGID.drives, RIGID.numbers)), &options(RIGID.parameters));
    assert!(free.graph(Function::InverseDynamics).inputs.iter().all(|p| p.wrapper.is_none()));
}

/// The lines of a program that make each parameter of these numbers, and its name and length.
fn made_in_c(robot: &InScene, numbers: &[f64]) -> (String, Vec<(String, usize)>) {
    let (mut rest, mut lines, mut all) = (numbers, String::new(), Vec::new());
    for parameter in &robot.options.scene.parameters {
        let constructor = parameter_program(&robot.robot, parameter, &robot.options);
        let (own, others) = rest.split_at(constructor.inputs[0].len());
        rest = others;
        let (name, length) = (parameter.input_name(), constructor.outputs[0].len());
        let own: Vec<String> = own.iter().map(|x| format!("{x:?}")).collect();
        lines.push_str(&format!("    double {name}[{length}] = {{0}};\n"));
        lines.push_str(&format!("    if (arm_{name}_new({}, {name}) != 0) return 1;\n", own.join(", ")));
        all.push((name, length));
    }
    (lines, all)
}

#[test]
fn c_makes_a_drive_of_its_numbers_and_is_told_which_of_them_cannot_be() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("drive_parameters_in_c");
    std::fs::create_dir_all(&folder).expect("a folder for programs");
    let functions = ["driven_forward_dynamics", "drive_torques", "drive_energy"];
    let names = functions.map(|name| format!("\"{name}\"")).join(", ");
    let text = format!("[outputs]\nfunctions = [{names}]\n{}", RIGID.parameters);
    let (robot, scene, package) = (folder.join("arm.toml"), folder.join("scene.toml"), folder.join("package"));
    std::fs::write(&robot, arm(&with(RIGID.drives, RIGID.numbers)).text()).expect("it can be written");
    std::fs::write(&scene, text).expect("it can be written");
    let mut command = Command::new(env!("CARGO_BIN_EXE_straightline"));
    succeeds(command.arg("export").arg(&robot).args(["--c-abi", "--scene"]).arg(&scene).arg("-o").arg(&package));
    let header = std::fs::read_to_string(package.join("include/arm_dynamics.h")).expect("there is a header");
    for part in [
        "ratio: speed of the shaft over speed of the joint",
        "rotor_inertia: J of the motor about its axis [kg·m²]; 1e-5 in the robot file",
        "Returns 0, or which of the numbers no drive has, counted from 1, or 10 where",
        "int arm_one_new(double ratio, double rotor_inertia, double resistance, double torque_constant, double motor_friction, ",
        "int arm_middle_new(double torque_constant, double inductance, double stage_2_ratio, ",
        "const double middle[",
    ] {
        assert!(header.contains(part), "`{part}` is not in\n{header}");
    }
    let free = InScene::new(&arm(&with(RIGID.drives, RIGID.numbers)), &options(RIGID.parameters));
    let fixed = InScene::new(&arm(&with(RIGID.drives, RIGID.others)), &options(""));
    let (makes, parameters) = made_in_c(&free, RIGID.others);
    let (mut arrays, mut calls, mut truth) = (Vec::new(), String::new(), Vec::new());
    for name in functions {
        let graph = free.graph(only(name)[0]);
        let arguments: Vec<&str> = graph.inputs.iter().map(|port| port.name.as_str()).collect();
        for port in graph.inputs.iter().filter(|port| !parameters.iter().any(|(name, _)| *name == port.name)) {
            let numbers: Vec<String> = input(&port.name, port.len()).iter().map(|x| format!("{x:?}")).collect();
            let array = format!("    static const double {}[] = {{{}}};\n", port.name, numbers.join(", "));
            if !arrays.contains(&array) {
                arrays.push(array);
            }
        }
        let outputs: Vec<String> = (0..graph.outputs.len()).map(|k| format!("{name}_{k}")).collect();
        for (output, port) in outputs.iter().zip(&graph.outputs) {
            calls.push_str(&format!("    double {output}[{}];\n", port.len()));
        }
        calls.push_str(&format!("    arm_{name}({}, {});\n", arguments.join(", "), outputs.join(", ")));
        for (output, port) in outputs.iter().zip(&graph.outputs) {
            calls.push_str(&format!("    show({output}, {});\n", port.len()));
        }
        truth.push(run::<Dd>(&fixed.graph(only(name)[0]), &[]));
    }
    let nominal: Vec<String> = RIGID.numbers[10..15].iter().map(|x| format!("{x:?}")).collect();
    let program = format!(
        r#"#include "arm_dynamics.h"
#include <stdio.h>
static void show(const double *x, int n) {{
    for (int k = 0; k < n; k++) printf("%.17g\n", x[k]);
}}
int main(void) {{
{makes}    double before = middle[0];
    if (arm_middle_new(-0.06, {numbers}, middle) != 1) return 2;
    if (arm_middle_new(0.06, 5e-4, 0.0, 3e-6, 7e-6, 0.9, middle) != 3) return 3;
    if (arm_middle_new(0.06, 5e-4, 40.0, 3e-6, 7e-6, 1.1, middle) != 6) return 4;
    if (arm_middle_new(0.0 / 0.0, {numbers}, middle) != 1) return 5;
    if (arm_middle_new(0.06, 5e-4, 1e-200, 3e-6, 7e-6, 0.9, middle) != 7) return 6;
    if (middle[0] != before) return 7;
{arrays}{calls}    return 0;
}}
"#,
        numbers = nominal.join(", "),
        arrays = arrays.concat(),
    );
    let Some(printed) = crate::in_c::printed(&package, "arm_dynamics", Library::StaticDebug, &program) else { return };
    let mut found = printed.lines().map(|line| Dd::from(line.parse::<f64>().expect("a number")));
    for (name, truth) in functions.iter().zip(&truth) {
        let values: Vec<Dd> = found.by_ref().take(truth.len()).collect();
        // as in f64 above
        assert_near(name, &values, truth, 3e-13);
    }
    assert_eq!(found.next(), None);
}

/// The builder of build scripts: what it writes compiles, and computes what the file with these numbers does.
#[test]
fn a_build_script_gets_them_too() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("drive_parameters_built");
    std::fs::create_dir_all(&folder).expect("a folder for programs");
    let text = format!("[outputs]\nfunctions = [\"driven_forward_dynamics\"]\n{}", COUPLED.parameters);
    std::fs::write(folder.join("scene.toml"), text).expect("it can be written");
    for (name, numbers) in [("free", COUPLED.numbers), ("fixed", COUPLED.others)] {
        std::fs::write(folder.join(format!("{name}.toml")), arm(&with(COUPLED.drives, numbers)).text())
            .expect("it can be written");
    }
    let build = |name: &str| Builder::new(folder.join(format!("{name}.toml"))).out_dir(&folder).module(name);
    build("free").scene_file(folder.join("scene.toml")).build().expect("it compiles");
    build("fixed").functions(only("driven_forward_dynamics")).build().expect("it compiles");
    let [left, right, one] = [&COUPLED.others[..2], &COUPLED.others[2..3], &COUPLED.others[3..]].map(|numbers| {
        let numbers: Vec<String> = numbers.iter().map(|x| format!("{x:?}")).collect();
        numbers
    });
    let main = format!(
        "#[allow(dead_code)] mod free {{ include!(\"free.rs\"); }}
#[allow(dead_code)] mod fixed {{ include!(\"fixed.rs\"); }}
fn main() {{
    let left = free::Left::new(free::LeftNumbers {{ rotor_inertia: {}, stage_1_ratio: {} }}).unwrap();
    let right = free::Right::new(free::RightNumbers {{ resistance: {} }}).unwrap();
    let one = free::One::new(free::OneNumbers {{ rotor_inertia: {}, joint_ratio: {} }}).unwrap();
    let (q, qd, x, u) = ([0.3, -0.8, 1.1], [0.5, -1.2, 0.7], [0.4; 6], [7.0, -3.0, 11.0]);
    let (mut a, mut b, mut xd) = ([0.0; 3], [0.0; 3], [0.0; 6]);
    free::driven_forward_dynamics(&q, &qd, &x, &u, &left, &right, &one, &mut a, &mut xd);
    fixed::driven_forward_dynamics(&q, &qd, &x, &u, &mut b, &mut xd);
    let size = b.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() <= 3e-13 * size), \"{{a:?}} {{b:?}}\");
    assert!(size > 0.1);
}}
",
        left[0], left[1], right[0], one[0], one[1]
    );
    std::fs::write(folder.join("main.rs"), main).expect("it can be written");
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_string());
    let program = folder.join("main");
    succeeds(
        Command::new(rustc).args(["--edition", "2021", "-Dwarnings", "-o"]).args([&program, &folder.join("main.rs")]),
    );
    succeeds(&mut Command::new(program));
}

/// With exact rules functions are those of the robot file to the bit of the generic runtime, and parameters agree.
#[test]
fn under_exact_rules_they_compile_and_agree() {
    for (name, case) in CASES {
        let source = arm(&with(case.drives, case.numbers));
        let exact = |options: Options| Options { grade: Grade::Exact, ..options };
        let free = InScene::new(&source, &exact(options(case.parameters)));
        let fixed = InScene::new(&arm(&with(case.drives, case.others)), &exact(options("")));
        // constructors are compared in a compilation
        let functions = only("driven_forward_dynamics");
        compiled(&source, &Options { functions, ..exact(options(case.parameters)) });
        let (exactly, rounded) = (free.made::<Dd>(case.others), free.made::<f64>(case.others));
        for function in free.functions() {
            let (a, b) = (free.graph(function), fixed.graph(function));
            let what = format!("{name}, {}", function.name());
            let truth = run::<Dd>(&b, &[]);
            // constants of the graph are rounded to f64 under exact rules
            assert_near(&what, &run::<Dd>(&a, &exactly), &truth, 1e-13);
            let found: Vec<Dd> = run::<f64>(&a, &rounded).into_iter().map(Dd::from).collect();
            assert_near(&format!("{what} in f64"), &found, &truth, 3e-13);
        }
    }
}

/// Every number of a drive, in the robot file or in the scene, free or not.
#[test]
fn numbers_that_f32_cannot_hold_are_errors_at_their_places() {
    let single = |drives: &str, scene_text: &str| {
        let options = Options { scalar: Scalar::F32, ..options(scene_text) };
        match compile(&arm(drives), &options) {
            Ok(generated) => Ok(generated.text),
            Err(complaints) => Err(complaints.to_string()),
        }
    };
    for case in [&RIGID, &ELASTIC] {
        let places = (1..=case.numbers.len()).filter(|k| {
            let before = &case.drives[..case.drives.find(&format!("${k}")).expect("it has a place")];
            // efficiencies are at most 1, and limits beyond f32 are none
            !["forward = ", "backward = ", "efficiency = ", "input = ", "current = "]
                .iter()
                .any(|key| before.ends_with(key))
        });
        let places: Vec<usize> = places.collect();
        for (value, cannot) in [(1e40, "f32 cannot hold 1e40"), (1e-46, "f32 cannot hold 1e-46")] {
            let mut numbers = case.numbers.to_vec();
            places.iter().for_each(|k| numbers[k - 1] = value);
            for parameters in ["", case.parameters] {
                let said = single(&with(case.drives, &numbers), parameters).expect_err("they are beyond f32");
                // inertias of gears and damping by friction may be zero
                let most = if value < 1.0 { places.len() - 5 } else { places.len() };
                let found = said.matches(cannot).count();
                assert!((most..=places.len()).contains(&found), "{found} of {} are in\n{said}", places.len());
                for part in ["ratio of ", "arm.toml:", "1e", "generate in f64"] {
                    assert!(said.contains(part), "`{part}` is not in\n{said}");
                }
            }
        }
    }
    let actuator = with(RIGID.drives, RIGID.numbers).replace("-8.0", "-8e39");
    let said = single(&actuator, "").expect_err("it is beyond f32");
    assert!(said.contains("f of actuator of drive `three`: f32 cannot hold -8e39"), "{said}");
    // in a scene, too
    let said = single("", "[[drive]]\njoint = \"one\"\nratio = 1e39\nmotor = { torque_constant = 0.05, resistance = 1.2, rotor_inertia = 1e-5 }\n");
    let said = said.expect_err("it is beyond f32");
    assert!(said.contains("scene.toml:5:9") && said.contains("ratio of drive `one`: f32 cannot hold 1e39"), "{said}");
    // a limit beyond f32 is none
    let mut numbers = RIGID.numbers.to_vec();
    (numbers[7], numbers[8]) = (1e39, 1e40);
    let text = single(&with(RIGID.drives, &numbers), "").unwrap_or_else(|why| panic!("{why}"));
    assert!(!text.contains("1e39") && !text.contains("1e40"));
}

fn described(drives: &str) -> Description {
    let mut complaints = Diagnostics::new();
    straightline_codegen::description::read(&arm(drives), &mut complaints).unwrap_or_else(|| panic!("{complaints}"))
}

/// A drive that has what the others lack.
const RATED: &str = "
[[drive]]
joint = \"one\"
ratio = 20.0
motor = { torque_constant = 0.05, resistance = 1.2, rotor_inertia = 1e-5, thermal = { winding_housing = 1.9, housing_ambient = 4.6, winding_time = 41.0, housing_time = 1120.0, ambient = 23.0, limit = 155.0 } }
limits = { speed = 1256.0, continuous_current = 3.5 }
[[drive]]
joint = \"two\"
actuator = { C = [[0.0, 1.0], [-1.5, -2.0]], f = [0.1, -8.0], d = [0.0, 5.0], T = [0.0, 1.0], position = [1.0, 0.0] }
";

/// Sweeps and searches change a drive as another number in the file does, whichever number that is.
#[test]
fn every_number_of_a_drive_can_be_swept_and_searched() {
    for (name, case) in CASES {
        let parameters = options(case.parameters).scene.parameters;
        let paths: Vec<String> = parameters
            .iter()
            .flat_map(|parameter| match parameter {
                Parameter::Drive { drive, numbers, .. } => numbers.iter().map(|n| format!("{drive}.{n}")).collect(),
                _ => Vec::new(),
            })
            .collect();
        assert_eq!(paths.len(), case.numbers.len(), "{name}");
        let of_file = described(&with(case.drives, case.numbers));
        for (k, path) in paths.iter().enumerate() {
            let mut numbers = case.numbers.to_vec();
            numbers[k] = case.others[k];
            let written = described(&with(case.drives, &numbers));
            let (set, _) = parameter::with_drives(&of_file, &[], path, numbers[k]).unwrap_or_else(|d| panic!("{d:?}"));
            assert_eq!(set.drives, written.drives, "{name}: {path}");
            assert_ne!(set.drives, of_file.drives, "{name}: {path}");
        }
    }
    let coupled = with(COUPLED.drives, COUPLED.numbers);
    for (text, path, from, to, value) in [
        (&coupled[..], "right.joint_ratio_three", "three = -33.0", "three = -37.5", -37.5),
        (RATED, "one.winding_housing", "winding_housing = 1.9", "winding_housing = 1.1", 1.1),
        (RATED, "one.housing_ambient", "housing_ambient = 4.6", "housing_ambient = 5.0", 5.0),
        (RATED, "one.winding_time", "winding_time = 41.0", "winding_time = 50.0", 50.0),
        (RATED, "one.housing_time", "housing_time = 1120.0", "housing_time = 900.0", 900.0),
        (RATED, "one.ambient", "ambient = 23.0", "ambient = -5.0", -5.0),
        (RATED, "one.temperature_limit", "limit = 155.0", "limit = 125.0", 125.0),
        (RATED, "one.speed_limit", "speed = 1256.0", "speed = 700.0", 700.0),
        (RATED, "one.continuous_current", "continuous_current = 3.5", "continuous_current = 2.0", 2.0),
        (RATED, "two.C_2_1", "[-1.5, -2.0]", "[-1.75, -2.0]", -1.75),
        (RATED, "two.f_2", "-8.0", "-9.0", -9.0),
        (RATED, "two.d_2", "5.0]", "7.0]", 7.0),
        (RATED, "two.T_2", "T = [0.0, 1.0]", "T = [0.0, 2.0]", 2.0),
        (RATED, "two.position_1", "position = [1.0", "position = [0.5", 0.5),
    ] {
        let (of_file, written) = (described(text), described(&text.replace(from, to)));
        let (set, _) = parameter::with_drives(&of_file, &[], path, value).unwrap_or_else(|d| panic!("{d:?}"));
        assert_eq!(set.drives, written.drives, "{path}");
        assert_ne!(set.drives, of_file.drives, "{path}");
    }
    for (path, value, words) in [
        ("one.winding_time", 0.0, "one.winding_time: 0.0 is not positive"),
        ("one.ambient", 200.0, "one.ambient: 200.0 is not below the limit of the winding"),
        ("one.temperature_limit", 20.0, "one.temperature_limit: 20.0 is not above the ambient temperature"),
        ("two.C_3_1", 1.0, "drive `two` has no value `C_3_1`"),
    ] {
        let complaint = parameter::with_drives(&described(RATED), &[], path, value).expect_err(path);
        assert!(complaint.line().contains(words), "{}", complaint.line());
    }
}
