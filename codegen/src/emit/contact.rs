//! The module `contact` as text.

use crate::emit::error_bound::error_bound_text;
use crate::emit::{self, array_type, indented, Style};
use crate::equations::Robot;
use crate::function::ContactFunction;
use crate::identifier::{comment, doc, string_literals, upper_camel_case};
use crate::options::Options;
use crate::program::companion::{bound, wants_companions};
use crate::program::contact::{programs, Mode, ModeProgram};
use crate::program::equivalence::{Disagreement, Plainer};
use crate::program::written::{Written, WrittenMode};
use crate::report::ContactReport;
use crate::scene::{Parameter, Scene};
use std::fmt::Write;
use straightline_graph::expr::{Port, Section};
use straightline_graph::schedule::schedule;

/// The module of all modes.
pub struct ContactModule {
    /// Its text; empty for a scene without contacts.
    pub text: String,
    /// The figures of its functions.
    pub reports: Vec<ContactReport>,
    /// Functions that are computed more plainly than they were to be.
    pub plainer: Vec<Plainer>,
    /// What the text is to compute.
    pub programs: Vec<WrittenMode>,
}

/// The module of all modes; nothing for a scene without contacts.
///
/// # Errors
/// A function whose programs all differ from its plain equations.
pub fn module(
    robot: &Robot,
    options: &Options,
    title: &dyn Fn(Section) -> String,
) -> Result<ContactModule, Disagreement> {
    let modes = Mode::all(&options.scene);
    let mut written = Vec::new();
    if modes.is_empty() {
        return Ok(ContactModule { text: String::new(), reports: Vec::new(), plainer: Vec::new(), programs: written });
    }
    let mut inner = String::new();
    let mut reports = Vec::new();
    let mut plainer = Vec::new();
    enumeration(&mut inner, &modes);
    let mut signatures = Vec::new();
    for mode in &modes {
        let programs = programs(robot, options, mode)?;
        plainer.extend(programs.iter().filter_map(|p| p.plainer.clone()));
        let mut text = String::new();
        constants(&mut text, mode);
        let mut kernel = false;
        let mut wrappers: Vec<String> = Vec::new();
        let mut functions = Vec::new();
        for ModeProgram { function, graph, .. } in &programs {
            let counts = graph.counts();
            let doc = documentation(*function, (mode, &options.scene), &graph.inputs, &graph.outputs);
            let doc = format!(
                "{doc}\n{} mul, {} add, {} div, {} sqrt, {} pairs of sine and cosine.\n",
                counts.mul, counts.add, counts.div, counts.sqrt, counts.sin_cos
            );
            let schedule = schedule(graph, options.limits);
            let source = emit::function(graph, &schedule, function.name(), &doc, Style::plain(options.scalar), title);
            kernel |= source.calls_kernel();
            text.push('\n');
            text.push_str(&source.text);
            if wants_companions(options) {
                let by_residual = *function == ContactFunction::ForwardDynamics;
                let (bound, of_system) = bound(robot, options, mode, *function, graph)?;
                plainer.extend(of_system);
                let bound = error_bound_text(bound, (function.name(), by_residual), graph, options, &mut functions);
                kernel |= bound.calls_kernel();
                text.push('\n');
                text.push_str(&bound.text);
            }
            wrappers.extend(graph.inputs.iter().filter_map(|p| p.wrapper.clone()));
            reports.push(ContactReport::new(&mode.identifier, function.name(), counts));
            functions.push(Written {
                name: function.name().to_string(),
                graph: graph.clone(),
                scalar: options.scalar,
                generic: false,
                lanes: false,
            });
        }
        let coordinates = [mode.constrained_names(), mode.free_names()];
        written.push(WrittenMode { identifier: mode.identifier.clone(), coordinates, functions });
        signatures.push(programs);
        wrappers.sort();
        wrappers.dedup();
        let _ = writeln!(inner, "\n/// Mode `{}`.\npub mod {} {{", doc(&mode.name), mode.identifier);
        if kernel {
            inner.push_str("    use super::super::trig;\n");
        }
        for wrapper in wrappers {
            let _ = writeln!(inner, "    use super::super::{wrapper};");
        }
        inner.push_str(&indented(&text));
        inner.push_str("}\n");
    }
    dispatch(&mut inner, &modes, &signatures, options);
    let mut out = String::from(
        "\n/// The robot in contact: functions per contact mode.\n///\n\
         /// s are the functional coordinates of a contact, F the reactions along the constrained ones: positive pushes the robot\n\
         /// off. Which mode it is the caller decides: a contact closes when s reaches zero, and opens when F changes sign.\n\
         pub mod contact {\n",
    );
    out.push_str(&indented(&inner));
    out.push_str("}\n");
    Ok(ContactModule { text: out, reports, plainer, programs: written })
}

fn enumeration(out: &mut String, modes: &[Mode]) {
    out.push_str("/// The contact modes.\n#[derive(Clone, Copy, Debug, PartialEq, Eq)]\npub enum Mode {\n");
    for mode in modes {
        let _ = writeln!(
            out,
            "    /// `{}`: {} constrained.\n    {},",
            doc(&mode.name),
            comment(&mode.constrained_names().join(", ")),
            upper_camel_case(&mode.identifier)
        );
    }
    out.push_str("}\n");
}

fn constants(out: &mut String, mode: &Mode) {
    for (name, doc, names) in [
        ("CONSTRAINED", "The constrained coordinates s^c, in order.", mode.constrained_names()),
        ("FREE", "The free coordinates s^f, in order.", mode.free_names()),
    ] {
        let _ = writeln!(
            out,
            "/// {doc}\npub const {name}: [&str; {}] = [{}];",
            names.len(),
            string_literals(names.iter().map(String::as_str))
        );
    }
}

/// Forward dynamics of any mode, where all take the same inputs and have results of the same kinds.
fn dispatch(out: &mut String, modes: &[Mode], programs: &[Vec<ModeProgram>], options: &Options) {
    let forward: Vec<&ModeProgram> =
        programs.iter().filter_map(|p| p.iter().find(|p| p.function == ContactFunction::ForwardDynamics)).collect();
    let (Some(first), true) = (forward.first(), forward.len() == modes.len()) else { return };
    let same = forward.iter().all(|p| p.graph.inputs == first.graph.inputs && p.graph.outputs.len() == 5);
    if !same {
        return;
    }
    let most = modes.iter().map(|m| m.constrained_names().len()).max().unwrap_or(0);
    let t = options.scalar.name();
    let inputs = &first.graph.inputs;
    let parameters: String = inputs.iter().map(|p| format!("{}: &{}, ", p.name, parameter_type(p, options))).collect();
    let arguments: String = inputs.iter().map(|p| format!("{}, ", p.name)).collect();
    let qdd = array_type(&first.graph.outputs[0], options.scalar);
    let filler = emit::filler(inputs.iter().filter(|p| p.wrapper.is_none()));
    let _ = write!(
        out,
        "\n/// The most constrained coordinates that a mode has.\npub const MOST_CONSTRAINED: usize = {most};\n\n\
         /// `forward_dynamics` of a mode; reactions stand in the order of the mode's `CONSTRAINED`, zeros after them. Gives the\n\
         /// least pivot.\npub fn forward_dynamics(mode: Mode, {parameters}qdd: &mut {qdd}, force: &mut [{t}; {most}]) -> {t} {{\n    \
         let mut pivot = [0.0];\n    match mode {{\n"
    );
    for mode in modes {
        let (m, id) = (mode.constrained_names().len(), &mode.identifier);
        let forces = (0..most).map(|i| if i < m { format!("f[{i}]") } else { "0.0".to_string() });
        let _ = write!(
            out,
            "        Mode::{} => {{\n            let (mut f, mut sdd, mut violation) = ([{filler}; {m}], [{filler}; {m}], [{filler}; {m}]);\n            \
             {id}::forward_dynamics({arguments}qdd, &mut f, &mut sdd, &mut violation, &mut pivot);\n            \
             *force = [{}];\n        }}\n",
            upper_camel_case(id),
            forces.collect::<Vec<_>>().join(", ")
        );
    }
    out.push_str("    }\n    pivot[0]\n}\n");
}

fn parameter_type(port: &Port, options: &Options) -> String {
    match &port.wrapper {
        Some(wrapper) => format!("super::{wrapper}"),
        None => array_type(port, options.scalar),
    }
}

fn documentation(
    function: ContactFunction,
    (mode, scene): (&Mode, &Scene),
    inputs: &[Port],
    outputs: &[Port],
) -> String {
    let summary = match function {
        ContactFunction::ConstrainedCoordinates => "The constrained coordinates s^c, with s̈ = J q̈ + A, (20.86).",
        ContactFunction::FreeCoordinates => "The free coordinates s^f, with s̈ = J q̈ + A, (20.85).",
        ContactFunction::ForwardDynamics => {
            "Motion and reactions in contact: H q̈ + h = τ + Jᵀ F, s̈^c = J q̈ + A, (20.88)-(20.89)."
        }
        ContactFunction::DrivenForwardDynamics => {
            "Motion and reactions in contact under the inputs of the drives: H* q̈ + h* = D u + Jᵀ F, s̈^c = J q̈ + A, (20.72) with \
             (20.88)-(20.89)."
        }
        ContactFunction::InverseDynamics => {
            "Drives of a wanted motion along s^f and of wanted reactions: hybrid feed-forward. Of the motions that do it, the \
             one nearest to `qdd` in kinetic energy is taken."
        }
        ContactFunction::Impact => "Impact when the contacts of the mode close, (20.90)-(20.91), (20.95)-(20.97).",
        ContactFunction::Projection => {
            "The correction of q, by velocity coordinate, that takes s^c away to first order and moves the least mass. Apply \
             it, and then `impact` with restitution 0 to the velocities, against drift."
        }
    };
    let of_scene = |name: &str| scene.parameters.iter().find(|p| p.input_name() == name).map(Parameter::in_words);
    let mut doc = format!("{summary}\n\nMode `{}`.\n\n", doc(&mode.name));
    for port in inputs.iter().chain(outputs) {
        let name = port.name.as_str();
        let suffix = |s: &str| name.ends_with(s);
        let text = match name {
            "q" => "configuration \\[rad or m\\]",
            "qd" => "velocities \\[rad/s or m/s\\]",
            "tau" => "generalized forces \\[N·m or N\\]",
            "x" => "state of the drives, as of `driven_forward_dynamics` of the robot",
            "u" => "inputs of the drives \\[V, or as in the robot file\\]",
            "xd" => "derivative of the drives' state, in the order of x",
            "gravity" => "acceleration due to gravity in the world \\[m/s²\\]",
            "qdd" => "accelerations \\[rad/s² or m/s²\\]",
            "force" => "reactions F along s^c \\[N, or N·m of an axis\\]",
            "sdd" => "s̈^c \\[m/s² or 1/s²\\]",
            "sdd_free" => "wanted s̈^f \\[m/s² or 1/s²\\]",
            "violation" => "s̈^c less what it should be; zero where the object gives way",
            "pivot" => {
                "least pivot against its diagonal entry: 1 for independent constraints, about 1e-12 for redundant ones"
            }
            "s" => "coordinates \\[m, or cosine\\]",
            "sd" => "their rates \\[m/s or 1/s\\]",
            "j" => "Jacobian, a row per coordinate",
            "a" => "adjoint vector A \\[m/s² or 1/s²\\]",
            "dqd" => "changes of the velocities \\[rad/s or m/s\\]",
            "impulse" => "impulses F Δt along s^c \\[N·s or N·m·s\\]",
            "dsd" => "changes of ṡ^c \\[m/s or 1/s\\]",
            "energy_loss" => "kinetic energy lost by robot, rotors and struck masses \\[J\\]",
            "restitution" => "coefficient of restitution: 0 plastic, 1 elastic",
            "dq" => "correction by velocity coordinate \\[rad or m\\]",
            _ if suffix("_axes") => "tool axis and an axis across it, unit vectors in the frame",
            _ if suffix("_pose") => "the object in the world: origin \\[m\\], then its axes X, Y, Z",
            _ if suffix("_velocity") => "of the object's origin \\[m/s\\], then angular \\[rad/s\\], world axes",
            _ if suffix("_acceleration") => "of the object's origin \\[m/s²\\], then angular \\[rad/s²\\], world axes",
            _ if suffix("_environment") => "numbers of the environment, in the order of the scene's documentation",
            _ if suffix("_own") => "the object's own coordinate and its rate \\[m, m/s\\]",
            _ if suffix("_own_rate") => "their rates \\[m/s, m/s²\\]",
            _ if suffix("_struck") => "velocity of the struck mass along pz before \\[m/s\\]",
            _ if suffix("_struck_after") => "its velocity after \\[m/s\\]",
            _ => &of_scene(name).unwrap_or_default(),
        };
        let _ = writeln!(doc, "* `{name}`: {text}");
    }
    doc
}
