//! Programs of every kind with one pass broken on purpose, and forms of the robot with one wrong number: what is written is right, or nothing
//! is. Right is what the generic runtime says at states of its own, and a bound is one that nothing exceeds there.

use super::{
    every_scalar, inputs, of_function, plainly_constructed, sabotage, Disagreement, PlainEquations, PortState, States,
    ROUNDINGS,
};
use crate::choices::LimbForm;
use crate::diagnostic::{Diagnostics, Source};
use crate::equations::Robot;
use crate::function::{ContactFunction, Function};
use crate::model::{load, ModelOptions};
use crate::options::optimisations::FOLDING;
use crate::options::Options;
use crate::program::companion::{bound, checked_companion, is_by_equations, wants_companions};
use crate::program::contact::{self, Mode};
use crate::program::input_box::input_box;
use crate::program::mixed::mix_precisions;
use crate::program::parameter::checked_parameter;
use crate::program::{checked, staged};
use crate::scene::{self, Budget, InputRange, JointRanges, MaxError};
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::rc::Rc;
use straightline_core::random::Random;
use straightline_core::Dd;
use straightline_graph::certify::companion::OF_ERROR;
use straightline_graph::certify::search::computed_at;
use straightline_graph::certify::{certify, Effort};
use straightline_graph::expr::{evaluate, verify, Binary, Constant, Graph, NodeId, Op, Port, Unary};
use straightline_graph::pass::cut::Staged;
use straightline_graph::{element_of, EveryScalar, Scalar};

/// Numbers as exporters write them: a right angle with fewer digits, dust, a fixed finger.
const ARM: &str = r#"<robot name="arm"><link name="base"/>
<link name="a"><inertial><origin xyz="0.02 1e-17 -0.1" rpy="0 0 0"/><mass value="2.5"/>
<inertia ixx="0.03" iyy="0.028" izz="0.01" ixy="1e-4" ixz="0" iyz="-2e-4"/></inertial></link>
<link name="b"><inertial><origin xyz="0.15 0.01 1e-12" rpy="0 0 0"/><mass value="1.2"/>
<inertia ixx="0.004" iyy="0.02" izz="0.019" ixy="0" ixz="3e-4" iyz="0"/></inertial></link>
<link name="c"><inertial><origin xyz="0 0.002 0.06" rpy="0 0 0"/><mass value="0.4"/>
<inertia ixx="0.001" iyy="0.0011" izz="0.0006" ixy="1e-19" ixz="0" iyz="0"/></inertial></link>
<link name="finger"><inertial><origin xyz="0 0.01 0.02" rpy="0 0 0"/><mass value="0.05"/>
<inertia ixx="2e-5" iyy="2e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="one" type="revolute"><parent link="base"/><child link="a"/><origin xyz="0 0 0.3" rpy="0 0 0"/><axis xyz="0 0 1"/>
<limit lower="-2.9" upper="2.9" effort="50" velocity="2"/></joint>
<joint name="two" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0.05 0 1e-16" rpy="1.5708 0 0"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" effort="50" velocity="2"/></joint>
<joint name="three" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0.3 0.02 0" rpy="0 1.5707963267949 0"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" effort="20" velocity="3"/></joint>
<joint name="fixed" type="fixed"><parent link="c"/><child link="finger"/><origin xyz="0 0.04 0.1" rpy="0 0 1.5707963267949"/></joint>
</robot>"#;

/// Two joints about axes that are parallel to nothing.
const OBLIQUE: &str = r#"<robot name="oblique"><link name="base"/>
<link name="a"><inertial><origin xyz="0.02 0.03 -0.1" rpy="0 0 0"/><mass value="2.5"/>
<inertia ixx="0.03" iyy="0.028" izz="0.01" ixy="1e-4" ixz="3e-4" iyz="-2e-4"/></inertial></link>
<link name="b"><inertial><origin xyz="0.15 0.01 0.02" rpy="0 0 0"/><mass value="1.2"/>
<inertia ixx="0.004" iyy="0.02" izz="0.019" ixy="2e-4" ixz="3e-4" iyz="1e-4"/></inertial></link>
<joint name="one" type="revolute"><parent link="base"/><child link="a"/><origin xyz="0 0.1 0.3" rpy="0.2 0.1 0"/><axis xyz="0 0 1"/>
<limit lower="-2.9" upper="2.9" effort="50" velocity="2"/></joint>
<joint name="two" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0.05 0.2 0.1" rpy="0.7 0.3 -0.2"/><axis xyz="0 0.6 0.8"/>
<limit lower="-2" upper="2" effort="50" velocity="2"/></joint>
</robot>"#;

/// The joints and links `two`, `b` of another robot behind them.
const WITH_A_TIP: &str = r#"<link name="c"><inertial><origin xyz="0.01 0.05 0.06" rpy="0 0 0"/><mass value="0.4"/>
<inertia ixx="0.001" iyy="0.0011" izz="0.0006" ixy="1e-5" ixz="0" iyz="2e-5"/></inertial></link>
<link name="pen"/><joint name="held" type="fixed"><parent link="c"/><child link="pen"/><origin xyz="0.1 0.05 0.2" rpy="0.3 0.2 0"/></joint>
<joint name="three" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0.3 0.02 0" rpy="0 0.4 0"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="20" velocity="3"/></joint>
</robot>"#;

/// A body with legs of two joints that differ in all numbers.
fn legged(legs: usize) -> String {
    let mut text = String::from(
        "<robot name=\"legged\"><link name=\"base\"><inertial><origin xyz=\"0.01 0.02 0.03\" rpy=\"0 0 0\"/><mass value=\"8\"/>\
         <inertia ixx=\"0.2\" iyy=\"0.15\" izz=\"0.1\" ixy=\"0.001\" ixz=\"0.002\" iyz=\"0.003\"/></inertial></link>",
    );
    for leg in 0..legs {
        let x = leg as f64;
        for (joint, parent) in [(0, "base".to_string()), (1, format!("leg{leg}_0"))] {
            let y = f64::from(joint);
            let _ = write!(
                text,
                "<link name=\"leg{leg}_{joint}\"><inertial><origin xyz=\"{} {} {}\" rpy=\"0 0 0\"/><mass value=\"{}\"/>\
                 <inertia ixx=\"0.021\" iyy=\"{}\" izz=\"0.018\" ixy=\"1e-4\" ixz=\"2e-4\" iyz=\"3e-4\"/></inertial></link>\
                 <joint name=\"leg{leg}_{joint}_joint\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"leg{leg}_{joint}\"/>\
                 <origin xyz=\"{} {} 0.1\" rpy=\"{} 0.3 {}\"/><axis xyz=\"0.1 {} 0.9\"/>\
                 <limit lower=\"-1\" upper=\"1\" velocity=\"2\" effort=\"50\"/></joint>",
                0.05 + 0.01 * x,
                0.02 * y - 0.01,
                0.03 - 0.004 * x,
                1.0 + 0.1 * x + 0.3 * y,
                0.02 + 0.001 * x,
                0.2 * x - 0.3,
                0.1 + 0.05 * y,
                0.1 + 0.2 * x,
                0.5 * y,
                0.2 + 0.1 * x
            );
        }
    }
    text + "</robot>"
}

/// Robot and drives as a user has them.
const PLANAR: &str = include_str!("../../../robots/descriptions/planar_2r.toml");
const DRIVES: &str = r#"
[[drive]]
joint = "joint1"
motor = { torque_constant = 0.0369, resistance = 0.608, inductance = 4.63e-4, rotor_inertia = 1.81e-5 }
stages = [{ ratio = 100.0, stiffness = 1.6e4, input_inertia = 9e-6, output_inertia = 2e-4 }]
limits = { input = 24.0 }
[[drive]]
joint = "joint2"
motor = { torque_constant = 0.0369, resistance = 0.608, rotor_inertia = 1.81e-5 }
stages = [{ ratio = 100.0, stiffness = 7e3, damping = 3.0, input_inertia = 3e-6, output_inertia = 6e-5, efficiency = 0.75 }]
limits = { input = 24.0 }
"#;
const TABLE: &str = r#"
[[contact]]
name = "table"
frame = "tip"
object = { origin = [0.8, 0.0, -0.05], z = [0.0, 0.0, 1.0] }
constrained = ["pz"]
"#;
const YIELDING: &str = "environment = { kind = \"mass\", mass = 0.5, stiffness = 5e3, damping = 40.0 }\n";
const PEN: &str = r#"
[[contact]]
name = "pen"
frame = "pen"
object = { origin = [0.5, 0.1, 0.2], z = [0.1, 0.2, 1.0] }
constrained = ["px", "pz"]
free = ["py"]
"#;
const RUBBING: &str = r#"
[[contact]]
name = "pen"
frame = "pen"
object = { origin = [0.5, 0.1, 0.2], z = [0.1, 0.2, 1.0] }
constrained = ["pz"]
friction = { coefficient = 0.3, speed = 0.125 }
environment = { kind = "two_masses", mass = 0.5, stiffness = 5e2, damping = 4.0, front_stiffness = 8e2, front_damping = 3.0, front_mass = 0.1 }
"#;
const BOOT: &str = "[[parameter]]\nkind = \"payload\"\nname = \"tool\"\nframe = \"b\"\n";

const OF_FUNCTIONS: [&str; 6] = ["traced", "dead code", "unread inputs", "sums", "substitute", "order"];
const PLAIN: [&str; 4] = ["traced", "dead code", "unread inputs", "sums"];
const ORDERED: [&str; 5] = ["traced", "dead code", "unread inputs", "sums", "order"];
const OF_CONTACT: [&str; 4] = ["contact: traced", "contact: dead code", "contact: unread inputs", "contact: sums"];
const OF_SYSTEM: [&str; 4] = ["system: traced", "system: dead code", "system: unread inputs", "system: sums"];
const OF_BOUND: [&str; 2] = ["bound: traced", "bound: dead code"];
const OF_PARAMETER: [&str; 2] = ["parameter: traced", "parameter: dead code"];
const OF_STAGES: [&str; 4] = ["stages: traced", "stages: dead code", "stages: sums", "stages: cut"];
const OF_LIMBS: [&str; 6] = [
    "limbs: traced",
    "limbs: dead code",
    "limbs: sums",
    "limbs: folded constants",
    "limbs: written out",
    "limbs: unread inputs",
];
const MIXED: [&str; 1] = ["mixed precision"];

/// A kind of program, and the passes that it goes through.
struct Case {
    name: &'static str,
    robot: Robot,
    frames: Vec<String>,
    options: Options,
    passes: Vec<&'static str>,
    /// Whether forms of the robot are chosen for it.
    has_forms: bool,
}

/// What goes into the text.
enum Written {
    /// With what it may differ by: constants that are not folded are rounded one by one.
    Function(Function, Graph, f64),
    Mode(usize, ContactFunction, Graph),
    Stages(Vec<Function>, Staged),
    Parameter(usize, Graph),
    Bound {
        graph: Graph,
        bound: Graph,
    },
}

impl Case {
    fn new(name: &'static str, robot: &str, scene: &str, options: Options, passes: &[&[&'static str]]) -> Case {
        let file = if robot.starts_with('<') { "robot.urdf" } else { "robot.toml" };
        let source = Source::new(file, robot);
        let mut complaints = Diagnostics::new();
        let scene = crate::options::scene_file::read(&Source::new("scene.toml", scene), &mut complaints);
        let options = scene.unwrap_or_else(|| panic!("{name}: {complaints}")).into_options(options).knowing(&source);
        let model = load(&source, &options.scene.model_options(&options.model)).0;
        let model = model.and_then(|model| scene::apply(model, &options.scene, &mut complaints));
        let robot = Robot::new(model.unwrap_or_else(|| panic!("{name}: {complaints}")));
        let options = Options { scene: options.scene.resolved(&robot.model), ..options };
        let has_forms = name != "bounds in contact";
        Case { name, robot, frames: Vec::new(), options, passes: passes.concat(), has_forms }
    }

    fn all() -> Vec<Case> {
        use Function::{
            ForwardDynamics, ForwardDynamicsDerivatives, GravityForce, InverseDynamics, InverseDynamicsDerivatives,
            MassMatrix,
        };
        let of = |functions: &[Function]| Options { functions: functions.to_vec(), ..Options::default() };
        let companions = |o: Options| Options { certify: Some(Effort { companions: true, ..Effort::default() }), ..o };
        let with_tip = OBLIQUE.replace("</robot>", WITH_A_TIP);
        let stages = format!("[outputs]\nstaged = true\n{BOOT}");
        let held = format!("[hold]\njoints = {{ three = 0.3 }}\n[outputs]\n{BOOT}");
        let pressing = format!("[outputs]\nfunctions = [\"driven_forward_dynamics\", \"driven_inverse_dynamics\"]\ncontact = [\"driven_forward_dynamics\", \"impact\"]\n{TABLE}{YIELDING}{DRIVES}");
        let drawing = format!("[outputs]\nfunctions = [\"gravity_force\"]\ncontact = [\"constrained_coordinates\", \"forward_dynamics\", \"inverse_dynamics\", \"projection\"]\n{PEN}");
        let rubbing = format!("[outputs]\nfunctions = [\"gravity_force\"]\ncontact = [\"forward_dynamics_derivatives\", \"impact_derivatives\"]\n{RUBBING}");
        let sliding = format!("[outputs]\nfunctions = [\"gravity_force\"]\ncontact = [\"forward_dynamics\"]\n{TABLE}");
        let legs = [InverseDynamics, GravityForce, InverseDynamicsDerivatives];
        let limbs = Options { limbs: LimbForm::Lanes, ..of(&legs) };
        vec![
            Case::new("functions", OBLIQUE, "", of(&[InverseDynamics, MassMatrix, ForwardDynamics]), &[&OF_FUNCTIONS]),
            Case::new(
                "functions in f32",
                OBLIQUE,
                "",
                Options { scalar: Scalar::F32, ..of(&[InverseDynamics, ForwardDynamics]) },
                &[&OF_FUNCTIONS],
            ),
            Case::new(
                "derivatives",
                OBLIQUE,
                "",
                of(&[InverseDynamicsDerivatives, ForwardDynamicsDerivatives]),
                &[&OF_FUNCTIONS],
            ),
            // what parameters add is not known: sums stay in the order that they are in
            Case::new(
                "payload and a joint held",
                &with_tip,
                &held,
                of(&[InverseDynamics, MassMatrix]),
                &[&PLAIN, &["substitute"], &OF_PARAMETER],
            ),
            Case::new("contact", &with_tip, &drawing, Options::default(), &[&ORDERED, &OF_CONTACT]),
            Case::new("derivatives in contact", &with_tip, &rubbing, Options::default(), &[&ORDERED, &OF_CONTACT]),
            Case::new("drives", PLANAR, &pressing, Options::default(), &[&ORDERED, &OF_CONTACT]),
            Case::new(
                "stages",
                OBLIQUE,
                &stages,
                of(&[InverseDynamics, ForwardDynamics]),
                &[&PLAIN, &["substitute"], &OF_STAGES, &OF_PARAMETER],
            ),
            Case::new("three legs as lanes", &legged(3), "", limbs.clone(), &[&OF_LIMBS]),
            Case::new(
                "four legs as lanes, one to be seen",
                &legged(4),
                "[outputs]\ninverse_dynamics = { joints = [\"leg1_0_joint\", \"leg2_1_joint\"] }\n",
                Options { functions: vec![InverseDynamics], ..limbs },
                &[&OF_LIMBS],
            ),
            Case::mixed(),
            Case::new(
                "bounds",
                OBLIQUE,
                "",
                companions(of(&[InverseDynamics, MassMatrix, ForwardDynamics])),
                &[&OF_FUNCTIONS, &OF_SYSTEM, &OF_BOUND],
            ),
            Case::new(
                "bounds of derivatives",
                OBLIQUE,
                "",
                companions(of(&[ForwardDynamicsDerivatives])),
                &[&OF_FUNCTIONS, &OF_SYSTEM, &OF_BOUND],
            ),
            Case::new(
                "bounds in contact",
                PLANAR,
                &sliding,
                companions(Options::default()),
                &[&ORDERED, &OF_CONTACT, &OF_SYSTEM, &OF_BOUND],
            ),
        ]
    }

    /// Robots that take longer.
    fn more() -> Vec<Case> {
        use Function::{ForwardDynamics, GravityForce, InverseDynamics, JointWrenches, MassMatrix};
        let functions = [InverseDynamics, GravityForce, MassMatrix, ForwardDynamics, JointWrenches];
        let options = Options { functions: functions.to_vec(), ..Options::default() };
        vec![Case::new("functions of an arm", ARM, "", options, &[&OF_FUNCTIONS])]
    }

    /// In f32 where that will do, with bounds.
    fn mixed() -> Case {
        let function = Function::InverseDynamics;
        let options = Options { scalar: Scalar::F32, functions: vec![function], ..Options::default() };
        let mut case = Case::new("mixed precision", PLANAR, "", options, &[&ORDERED, &OF_BOUND, &MIXED]);
        case.options.scene.ranges.qd = JointRanges::All(InputRange::within(0.5));
        case.options.scene.ranges.qdd = JointRanges::All(InputRange::within(1.0));
        let single = checked(&case.robot, &[], function, &case.options).expect("it is right");
        let ranges = input_box(&single.graph.inputs, &case.options.scene, &case.robot.model).expect("there are ranges");
        let errors = certify(&single.graph, Scalar::F32, &ranges, Effort::default()).expect("no division").errors;
        // a tenth: nearly all is in f64, and what was evaluated in f32 alone would be beyond its bound
        let most = 0.1 * errors.into_iter().fold(0.0, f64::max);
        let budget = Budget { max_error: Some(MaxError::All(most)), mixed_precision: true, ..Budget::default() };
        case.options.scene.budgets.insert(function, budget);
        case.options.certify = Some(Effort { companions: true, ..Effort::default() });
        case
    }

    /// All that would go into the text, and whether something is plainer than it was to be.
    fn write(&self) -> Result<(Vec<Written>, bool), Disagreement> {
        let Case { robot, frames, options, .. } = self;
        let (mut written, mut plainer) = (Vec::new(), false);
        for function in options.functions.iter().copied().filter(|f| f.is_of(&robot.model) && !f.is_per_frame()) {
            let mut program = checked(robot, frames, function, options)?;
            mix_precisions(robot, frames, &mut program, options)?;
            plainer |= program.plainer.is_some();
            if wants_companions(options) {
                let (bound, of_system) = checked_companion(robot, function, &program.graph, options)?;
                plainer |= of_system.is_some();
                written.extend(bound.map(|bound| Written::Bound { graph: program.graph.clone(), bound }));
            }
            let rounded = program.plainer.as_ref().is_some_and(|plainer| plainer.without == FOLDING);
            let part = if rounded { ROUNDINGS * options.scalar.epsilon() } else { 1e-19 };
            written.push(Written::Function(function, program.graph, part));
        }
        for (k, mode) in Mode::all(&options.scene).iter().enumerate() {
            for program in contact::programs(robot, options, mode)? {
                plainer |= program.plainer.is_some();
                if wants_companions(options) {
                    let (bound, of_system) = bound(robot, options, mode, program.function, &program.graph)?;
                    plainer |= of_system.is_some();
                    written.extend(bound.map(|bound| Written::Bound { graph: program.graph.clone(), bound }));
                }
                written.push(Written::Mode(k, program.function, program.graph));
            }
        }
        if options.scene.staged {
            let (programs, of_stages) = staged::programs(robot, frames, options)?;
            plainer |= of_stages.is_some();
            written.push(Written::Stages(programs.functions, programs.staged));
        }
        for (k, parameter) in options.scene.parameters.iter().enumerate() {
            written.push(Written::Parameter(k, checked_parameter(robot, parameter, options)?));
        }
        Ok((written, plainer))
    }

    /// What is wrong with it, at states that the compiler did not look at.
    fn fault(&self, written: &Written) -> Option<String> {
        let Case { robot, frames, options, .. } = self;
        let mut states = States::new(robot, options);
        states.random = Random(77);
        let plain = |function: Function, state: &PortState| {
            wide(PlainEquations { robot, frames, function, options }.results(state))
        };
        for _ in 0..5 {
            let fault = match written {
                Written::Function(function, graph, part) => {
                    let state = states.next(&options.scene.ports(*function, &robot.model, frames));
                    differ(graph, &evaluate(graph, &inputs(graph, &state)), &plain(*function, &state), *part)
                }
                Written::Mode(k, function, graph) => {
                    let mode = &Mode::all(&options.scene)[*k];
                    let state = states.next(&contact::ports(robot, options, mode, *function));
                    let given = |p: &Port| every_scalar(&state[&p.name]);
                    let truth = contact::evaluate(robot, options, mode, *function, &given, &|_| None);
                    let truth = truth.expect("planes are over every scalar");
                    // what is solved for in contact may be hard to tell
                    differ(graph, &evaluate(graph, &inputs(graph, &state)), &wide(truth), 1e-15)
                }
                Written::Stages(functions, staged) => {
                    let ports: Vec<_> =
                        functions.iter().flat_map(|f| options.scene.ports(*f, &robot.model, frames)).collect();
                    let mut state = states.next(&ports);
                    for stage in &staged.stages {
                        let values = evaluate(stage, &inputs(stage, &state));
                        state.insert(stage.outputs[0].name.clone(), values);
                    }
                    functions.iter().zip(&staged.functions).find_map(|(function, (_, graph))| {
                        differ(graph, &evaluate(graph, &inputs(graph, &state)), &plain(*function, &state), 1e-19)
                    })
                }
                Written::Parameter(k, graph) => {
                    let parameter = &options.scene.parameters[*k];
                    let given = states.given(parameter);
                    let truth = wide(plainly_constructed(robot, parameter, &given));
                    differ(graph, &evaluate(graph, &given.concat()), &truth, 1e-19)
                }
                Written::Bound { graph, bound } => exceeded(options, graph, bound, &mut states),
            };
            if fault.is_some() {
                return fault;
            }
        }
        None
    }
}

fn wide(x: Vec<EveryScalar>) -> Vec<Dd> {
    x.into_iter().map(|x| x.wide.value).collect()
}

/// Results that are not those of the generic runtime.
fn differ(graph: &Graph, found: &[Dd], truth: &[Dd], part: f64) -> Option<String> {
    assert_eq!(found.len(), truth.len(), "a result for every result");
    // some are zero by their equations: what reactions are to bring about
    let most = truth.iter().map(|x| x.hi().abs()).fold(0.0, f64::max);
    let is_wrong = |k: &usize| {
        let off = (found[*k] - truth[*k]).hi().abs();
        off.is_nan() || off > part * most
    };
    let wrong = (0..truth.len()).find(is_wrong)?;
    Some(format!("{} is {}, not {}, of {most:e}", element_of(&graph.outputs, wrong), found[wrong], truth[wrong]))
}

/// An error at a state, and of accelerations that are off, that is greater than its bound.
fn exceeded(options: &Options, graph: &Graph, bound: &Graph, states: &mut States) -> Option<String> {
    let state = states.next(&graph.inputs);
    let single = |x: Dd| Dd::from(options.scalar.nearest(x));
    let mut state: PortState = state.into_iter().map(|(n, x)| (n, x.into_iter().map(single).collect())).collect();
    let of_bound = graph.widest(options.scalar);
    let short =
        |graph: &Graph, state: &PortState| inputs(graph, state).iter().map(|x| x.to_f64()).collect::<Vec<f64>>();
    let exact = evaluate(graph, &inputs(graph, &state));
    let found = computed_at(graph, options.scalar, &short(graph, &state));
    for off in if is_by_equations(bound) { vec![0.0, 1e-9, 1e-3, 0.1] } else { vec![0.0] } {
        let found: Vec<f64> =
            found.iter().map(|x| single(Dd::from(x * (1.0 + off * states.random.symmetric(1.0)))).to_f64()).collect();
        let mut first = 0;
        for port in &graph.outputs {
            state.insert(port.name.clone(), found[first..first + port.len()].iter().map(|x| Dd::from(*x)).collect());
            first += port.len();
        }
        let bounds = computed_at(bound, of_bound, &short(bound, &state));
        let (mut of_graph, mut of_bounds) = (0, 0);
        for port in &bound.outputs {
            let bounds = &bounds[of_bounds..of_bounds + port.len()];
            of_bounds += port.len();
            of_graph = 0;
            for of in &graph.outputs {
                if port.name == format!("{}{OF_ERROR}", of.name) {
                    for (k, most) in bounds.iter().enumerate() {
                        let off = (Dd::from(found[of_graph + k]) - exact[of_graph + k]).hi().abs();
                        if off > *most {
                            return Some(format!("{}[{k}] is off by {off:e}, more than {most:e}", of.name));
                        }
                    }
                }
                of_graph += of.len();
            }
        }
        let _ = of_graph;
    }
    None
}

/// Ways in which a program can be wrong by one operation.
const KINDS: [&str; 12] = [
    "sum to difference",
    "difference turned round",
    "product to sum",
    "constant off by 1e-13",
    "negation to square",
    "product to square",
    "quotient turned round",
    "root to square",
    "sine and cosine exchanged",
    "results exchanged",
    "inputs exchanged",
    "constant to zero",
];
/// Of these kinds a program always has an operation, or nearly so.
const ORDINARY: [usize; 5] = [0, 2, 3, 5, 9];

/// Changes one operation of a program (for all limbs, where they share it) so that it computes something else; `None` where there is none of
/// the kind.
fn mutant(graph: &Graph, kind: usize, random: &mut Random) -> Option<Graph> {
    let mut broken = graph.clone();
    let pick = |count: usize, random: &mut Random| (count > 0).then(|| random.below(count));
    match KINDS[kind] {
        "results exchanged" => {
            let other = |a: usize| (0..graph.results.len()).find(|b| graph.results[*b] != graph.results[a]);
            let a = pick(graph.results.len(), random)?;
            broken.results.swap(a, other(a)?);
            return verify(&broken).ok().map(|()| broken);
        }
        "sine and cosine exchanged" => {
            let live = graph.live();
            let pairs = |i: &usize| {
                live[*i]
                    && matches!(graph.ops[*i], Op::Sin(_))
                    && matches!(graph.ops.get(i + 1), Some(Op::Cos(_)))
                    && live[i + 1]
            };
            let places: Vec<usize> = (0..graph.ops.len()).filter(pairs).collect();
            let at = places[pick(places.len(), random)?];
            broken.ops.swap(at, at + 1);
            return verify(&broken).ok().map(|()| broken);
        }
        _ => {}
    }
    let live = graph.live();
    let changed = |op: Op| -> Option<Op> {
        Some(match (KINDS[kind], op) {
            ("sum to difference", Op::Binary(Binary::Add, a, b)) => Op::sub(a, b),
            ("difference turned round", Op::Binary(Binary::Sub, a, b)) => Op::sub(b, a),
            ("product to sum", Op::Binary(Binary::Mul, a, b)) => Op::add(a, b),
            // as a constant has that is rounded too early
            ("constant off by 1e-13", Op::Constant(c)) if c.value().hi().abs() > 1e-9 => {
                Op::Constant(Constant::new(c.value() * Dd::new(1.0, 1e-13)))
            }
            // as far as the operand may be used here at all
            ("negation to square", Op::Unary(Unary::Neg, a)) => Op::mul(a, a),
            ("product to square", Op::Binary(Binary::Mul, a, b)) if a != b => Op::mul(a, a),
            ("quotient turned round", Op::Binary(Binary::Div, a, b)) => Op::div(b, a),
            ("root to square", Op::Unary(Unary::Sqrt, a)) => Op::mul(a, a),
            ("inputs exchanged", Op::Input(k)) => Op::Input(if k == 0 { 1 } else { k - 1 }),
            ("constant to zero", Op::Constant(c)) if c.value().hi().abs() > 1e-9 => {
                Op::Constant(Constant::new(Dd::ZERO))
            }
            _ => return None,
        })
    };
    let places: Vec<usize> = (0..graph.ops.len()).filter(|i| live[*i] && changed(graph.ops[*i]).is_some()).collect();
    let at = places[pick(places.len(), random)?];
    let row = graph.alike.iter().flat_map(|a| &a.rows).find(|row| row.contains(&NodeId(at as u32)));
    let row: Vec<usize> = row.map_or(vec![at], |row| row.iter().map(|id| id.index()).collect());
    for i in row {
        broken.ops[i] = changed(graph.ops[i])?;
    }
    verify(&broken).ok().map(|()| broken)
}

/// What became of mutants.
#[derive(Default, Debug)]
struct Tally {
    /// So many programs or forms were broken.
    mutants: usize,
    /// A plainer form was taken.
    plainer: usize,
    /// Nothing was written.
    refused: usize,
    /// A pass noticed and stopped.
    stopped: usize,
    /// What was broken is written, and right: it computes the same.
    same: usize,
    /// What was broken is written, and wrong.
    wrong: Vec<String>,
}

impl Tally {
    fn add(&mut self, other: Tally) {
        self.mutants += other.mutants;
        self.plainer += other.plainer;
        self.refused += other.refused;
        self.stopped += other.stopped;
        self.same += other.same;
        self.wrong.extend(other.wrong);
    }

    /// One compilation of a case that was broken so often.
    fn of(
        case: &Case,
        what: &str,
        count: &Rc<RefCell<usize>>,
        write: impl FnOnce() -> Result<(Vec<Written>, bool), Disagreement>,
    ) -> Tally {
        let outcome = catch_unwind(AssertUnwindSafe(write));
        let mut tally = Tally::default();
        if *count.borrow() == 0 {
            return tally;
        }
        tally.mutants = 1;
        match outcome {
            Err(_) => tally.stopped = 1,
            Ok(Err(_)) => tally.refused = 1,
            Ok(Ok((written, plainer))) => {
                let fault = written.iter().find_map(|w| case.fault(w));
                tally.wrong.extend(fault.map(|fault| format!("{}, {what}: {fault}", case.name)));
                let is_same = tally.wrong.is_empty() && !plainer;
                (tally.plainer, tally.same) = (usize::from(plainer), usize::from(is_same));
            }
        }
        tally
    }
}

/// A pass broken in one way: in the first form that is tried, or in all of them until the plain one is as well.
fn with_a_broken_pass(case: &Case, pass: &'static str, kind: usize, seed: u64, always: bool) -> Tally {
    let count = Rc::new(RefCell::new(0));
    let (broken, mut random) = (count.clone(), Random(seed));
    // of many programs that go through the pass another one each time
    let mut skipped = random.below(3);
    let broken = move |name: &str, graph: Graph| {
        if name != pass || (!always && *broken.borrow() > 0) {
            return graph;
        }
        if skipped > 0 && !always {
            skipped -= 1;
            return graph;
        }
        match mutant(&graph, kind, &mut random) {
            Some(mutant) => {
                *broken.borrow_mut() += 1;
                mutant
            }
            None => graph,
        }
    };
    let what = format!("`{pass}`, {}, seed {seed}, {}", KINDS[kind], if always { "in all forms" } else { "once" });
    Tally::of(case, &what, &count, || sabotage::with(broken, || case.write()))
}

/// One number of a chosen form is off by a part in 1e13.
fn with_a_wrong_form(case: &Case, seed: u64) -> Tally {
    let count = Rc::new(RefCell::new(0));
    let (wrong, mut random) = (count.clone(), Random(seed));
    let broken = move |mut robot: Robot| {
        let mut left = {
            let mut numbers = 0;
            let _ = robot.reduced.map(|x| {
                numbers += usize::from(x.hi().abs() > 1e-9);
                x
            });
            random.below(numbers.max(1))
        };
        let changed = |left: &mut usize, x: Dd| {
            if x.hi().abs() <= 1e-9 {
                return x;
            }
            let is_it = *left == 0;
            *left = left.wrapping_sub(1);
            if is_it {
                x * Dd::new(1.0, 1e-13)
            } else {
                x
            }
        };
        let mut same = left;
        robot.reduced = robot.reduced.map(|x| changed(&mut left, x));
        robot.composite = robot.composite.map(|x| changed(&mut same, x));
        *wrong.borrow_mut() += 1;
        robot
    };
    Tally::of(case, &format!("form, seed {seed}"), &count, || sabotage::with_form(broken, || case.write()))
}

/// All passes that a case goes through, and what is wrong with what comes out although none is broken.
fn seen(case: &Case) -> (BTreeSet<String>, Vec<String>) {
    let seen = Rc::new(RefCell::new(BTreeSet::new()));
    let of = seen.clone();
    let look = move |name: &str, graph: Graph| {
        of.borrow_mut().insert(name.to_string());
        graph
    };
    let mut faults = Vec::new();
    match sabotage::with(look, || case.write()) {
        Err(wrong) => faults.push(wrong.to_string()),
        Ok((_, true)) => faults.push("a program that is right is taken for wrong".to_string()),
        Ok((written, false)) => faults.extend(written.iter().filter_map(|w| case.fault(w))),
    }
    (seen.take(), faults)
}

/// So that no pass is listed that is never reached, and none is reached that is not listed.
pub fn every_kind_of_program_goes_through_the_passes_that_are_broken() {
    let mut wrong = Vec::new();
    for case in Case::all() {
        let listed: BTreeSet<String> = case.passes.iter().map(ToString::to_string).collect();
        let (seen, faults) = seen(&case);
        wrong.extend(faults.into_iter().map(|fault| format!("{}: {fault}", case.name)));
        let differ: Vec<&String> = listed.symmetric_difference(&seen).collect();
        wrong.extend((!differ.is_empty()).then(|| format!("{}: listed or seen, not both: {differ:?}", case.name)));
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// What once reached the text, of so many: a bound that is too large by a wrong part of what is left of the equations, and too small where
/// the two are nearly the same.
const ONCE: [(&str, &str, usize, u64, bool); 2] =
    [("bounds", "bound: traced", 1, 1016, true), ("bounds", "bound: dead code", 1, 1016, true)];

/// Every pass of every kind of program broken: what comes out is right, or nothing does.
pub fn a_broken_pass_never_reaches_the_text() {
    let mut all = Tally::default();
    for case in Case::all() {
        let mut tally = Tally::default();
        for (k, pass) in case.passes.iter().enumerate() {
            let mut broken = 0;
            // until one way of them was there to be broken
            for (n, kind) in ORDINARY.into_iter().cycle().skip(k).take(2 * ORDINARY.len()).enumerate() {
                let of = with_a_broken_pass(&case, pass, kind, n as u64, n % 2 == 0);
                broken += of.mutants;
                tally.add(of);
                if broken > 0 {
                    break;
                }
            }
            let never = format!("{}: `{pass}` was never broken", case.name);
            tally.wrong.extend((broken == 0).then_some(never));
        }
        for (_, pass, kind, seed, always) in ONCE.iter().filter(|once| once.0 == case.name) {
            tally.add(with_a_broken_pass(&case, pass, *kind, *seed, *always));
        }
        if case.has_forms {
            tally.add(with_a_wrong_form(&case, 1));
        }
        println!("{}: {tally:?}", case.name);
        all.add(tally);
    }
    println!("{all:?}");
    assert!(all.wrong.is_empty(), "{:#?}", all.wrong);
    assert!(all.same * 10 < all.mutants, "hardly any mutant computes the same: {all:?}");
}

/// Every pass broken in every way, so many times each. `CASE` and `PASS`: of these cases and passes alone, by parts of their names.
pub fn broken_passes_never_reach_the_text(count: u64) {
    let only = |variable: &str| std::env::var(variable).unwrap_or_default();
    let (only_case, only_pass) = (only("CASE"), only("PASS"));
    let mut all = Tally::default();
    for case in Case::all().into_iter().chain(Case::more()).filter(|c| c.name.contains(&only_case)) {
        let mut tally = Tally::default();
        for pass in case.passes.iter().filter(|pass| pass.contains(&only_pass)) {
            for kind in 0..KINDS.len() {
                for seed in 0..count {
                    let seed = seed + 1000 * kind as u64;
                    tally.add(with_a_broken_pass(&case, pass, kind, seed, seed.is_multiple_of(2)));
                }
            }
        }
        let mut forms = Tally::default();
        for seed in 0..if only_pass.is_empty() { 10 * count } else { 0 } {
            forms.add(with_a_wrong_form(&case, seed));
        }
        println!("{}: {tally:?}; forms: {forms:?}", case.name);
        all.add(tally);
        all.add(forms);
    }
    println!("{all:?}");
    assert!(all.wrong.is_empty(), "{:#?}", all.wrong);
}

fn robot(text: &str) -> Robot {
    let (model, complaints) = load(&Source::new("arm.urdf", text), &ModelOptions::default());
    Robot::new(model.unwrap_or_else(|| panic!("{complaints:?}")))
}

const FUNCTIONS: [Function; 5] = [
    Function::InverseDynamics,
    Function::GravityForce,
    Function::MassMatrix,
    Function::ForwardDynamics,
    Function::JointWrenches,
];

/// Nothing gives way where nothing is wrong.
pub fn robots_as_people_write_them_keep_their_cheapest_form() {
    let robot = robot(ARM);
    for function in FUNCTIONS {
        let program = checked(&robot, &[], function, &Options::default()).unwrap_or_else(|wrong| panic!("{wrong}"));
        assert_eq!(program.plainer, None);
    }
}

/// A form of the robot that is not the robot.
pub fn a_wrong_form_of_the_robot_gives_way_to_a_plainer_one() {
    let mut robot = robot(ARM);
    robot.reduced.bodies[2].first_moment.x *= Dd::new(1.0, 1e-15);
    let options = Options::default();
    let optimisations = crate::options::Optimisations { chosen: false, ..options.optimisations() };
    let graph = crate::program::optimised(&robot, &[], Function::InverseDynamics, &options, optimisations);
    let wrong = of_function(&robot, &[], Function::InverseDynamics, &options, optimisations, &graph)
        .expect_err("it is another robot");
    assert!(wrong.result.starts_with("tau[") && wrong.difference > 1e-20, "{wrong}");
    let message = wrong.error(&robot.model);
    assert!(message.detail.contains("link `c`: 1e-19") || message.detail.contains("1e-1"), "{}", message.detail);
}
