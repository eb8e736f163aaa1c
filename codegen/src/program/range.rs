//! Numbers that the scalar of generated code cannot hold.
//!
//! Two questions, as a number may be lost before or after it is multiplied. Of the robot file and the scene: is every number in
//! the range of the scalar, and no mass so small that it would be zero? Of a finished program: are its constants numbers, and
//! do its values stay in range where the exact ones do, at some states near rest? What no limit, however large, has to do with:
//! limits beyond the range say "no limit" and are written so. A length that vanishes is dust, and vanishes.

use crate::description::drives::WrittenDrive;
use crate::description::{Description, JointDrive, WrittenOscillation};
use crate::diagnostic::{Diagnostic, Diagnostics, Place};
use crate::model::states;
use crate::scene::{messages as say, Parameter, Scene};
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_graph::certify::search::computed_at;
use straightline_graph::expr::{evaluate, Binary, Graph, Op};
use straightline_graph::Scalar;

/// States at which a program is tried.
const STATES: usize = 3;

/// Complains about the numbers of a robot file and of a scene's payloads that the scalar cannot hold.
pub fn of_robot(description: &Description, scene: &Scene, scalar: Scalar, diagnostics: &mut Diagnostics) {
    // the readers keep all numbers within 1e±60, or so small that f64 has them as zero
    if !scalar.is_short() {
        return;
    }
    let mut complain = |place: &Place, what: String, value: f64, is_needed: bool| {
        unheld(&what, value, is_needed, scalar).into_iter().for_each(|complaint| diagnostics.push(complaint.at(place)));
    };
    of_bodies(description, &mut complain);
    for number in description.drives.iter().chain(&scene.drives).flat_map(|drive| &drive.written.0) {
        complain(&number.value.place, number.what.clone(), number.value.value, number.is_needed);
    }
    for coupling in description.couplings.iter().chain(&scene.couplings) {
        let name = &coupling.joint.value;
        complain(&coupling.ratio.place, format!("ratio of joint `{name}`"), coupling.ratio.value, true);
        complain(&coupling.offset.place, format!("offset of joint `{name}`"), coupling.offset.value, false);
    }
    of_scene(scene, scalar, diagnostics);
}

/// Takes a number with its place, what it is, and whether it must not vanish.
type Number<'a> = &'a mut dyn FnMut(&Place, String, f64, bool);

/// The numbers of a joint besides its place.
fn of_joint(name: &str, drive: &JointDrive, number: Number) {
    for (what, value) in [
        ("damping", &drive.damping),
        ("friction", &drive.friction),
        ("rotor_inertia", &drive.rotor_inertia),
        ("gear_ratio", &drive.gear_ratio),
        ("armature", &drive.armature),
        ("spring_stiffness", &drive.spring_stiffness),
        ("spring_rest", &drive.spring_rest),
    ] {
        if let Some(value) = value {
            number(&value.place, format!("{what} of joint `{name}`"), value.value, false);
        }
    }
    if let Some(WrittenOscillation { time_constant, damping_ratio, place }) = &drive.oscillation {
        number(place, format!("time constant of joint `{name}`"), *time_constant, true);
        number(place, format!("damping ratio of joint `{name}`"), *damping_ratio, true);
    }
}

/// Gravity, and the numbers of links and joints.
fn of_bodies(description: &Description, complain: Number) {
    if let Some(gravity) = &description.gravity {
        gravity.value.iter().for_each(|x| complain(&gravity.place, "gravity".to_string(), *x, false));
    }
    if let Some(damping) = &description.base_damping {
        complain(&damping.place, "damping of the base".to_string(), damping.value, false);
    }
    for link in &description.links {
        let (name, Some(inertial)) = (&link.name.value, &link.inertial) else { continue };
        let j = inertial.inertia.value;
        complain(&inertial.mass.place, format!("mass of link `{name}`"), inertial.mass.value, true);
        for x in inertial.com.value {
            complain(&inertial.com.place, format!("centre of mass of link `{name}`"), x, false);
        }
        for x in [j.xx, j.xy, j.xz, j.yy, j.yz, j.zz] {
            complain(&inertial.inertia.place, format!("inertia of link `{name}`"), x, false);
        }
    }
    for joint in &description.joints {
        let name = &joint.name.value;
        for (what, length) in joint.placement.lengths() {
            for x in length.value {
                complain(&length.place, format!("{what} of joint `{name}`"), x, false);
            }
        }
        of_joint(name, &joint.drive, complain);
    }
}

/// The limits of drives that a parameter makes free, and the payloads.
fn of_scene(scene: &Scene, scalar: Scalar, diagnostics: &mut Diagnostics) {
    for (i, parameter) in scene.parameters.iter().enumerate() {
        let Parameter::Drive { drive, numbers, form: Some(form), .. } = parameter else { continue };
        // the others stand in the file
        for number in form.numbers().iter().filter(|number| number.is_limit() && numbers.contains(&number.name)) {
            if let Some(complaint) = unheld(&format!("{} of drive `{drive}`", number.name), number.value, false, scalar)
            {
                scene.places.complain(&format!("parameter.{i}.numbers"), complaint, diagnostics);
            }
        }
    }
    for (i, payload) in scene.payloads.iter().enumerate() {
        let numbers = [("mass", &[payload.mass][..]), ("com", &payload.com), ("inertia", &payload.inertia)];
        for (key, values) in numbers {
            for x in values {
                let what = format!("{key} of payload `{}`", payload.name);
                if let Some(complaint) = unheld(&what, *x, key == "mass", scalar) {
                    scene.places.complain(&format!("payload.{i}.{key}"), complaint, diagnostics);
                }
            }
        }
    }
}

/// Takes limits of drives that the scalar cannot hold for what they are there: none. Those that a parameter makes free stay, to be complained
/// about.
pub fn leave_out_lost_limits(drives: &mut [WrittenDrive], parameters: &[Parameter], scalar: Scalar) {
    if !scalar.is_short() {
        return;
    }
    for drive in drives {
        let name = &drive.name.value;
        let is_free = |number: &str| {
            let frees = |p: &Parameter| matches!(p, Parameter::Drive { drive, numbers, .. } if drive == name && numbers.iter().any(|n| n == number));
            parameters.iter().any(frees)
        };
        let (input, current) = (is_free("input_limit"), is_free("current_limit"));
        drive.input_limit = drive.input_limit.filter(|x| input || scalar.rounded(*x).is_finite());
        drive.current_limit = drive.current_limit.filter(|x| current || scalar.rounded(*x).is_finite());
    }
}

/// What is wrong with a number in this scalar: it is too great, or it vanishes where it must not: a mass, a ratio, a resistance.
fn unheld(what: &str, value: f64, is_needed: bool, scalar: Scalar) -> Option<Diagnostic> {
    let is_lost = is_needed && value != 0.0 && value.abs() < scalar.tiny();
    let is_too_great = scalar.rounded(value).is_infinite();
    (is_lost || is_too_great).then(|| say::number_beyond_scalar(what, value, scalar.name(), is_too_great))
}

/// Why a program cannot be computed in its scalar, if that is so: a constant that is no number there, or a value that leaves the
/// range at an ordinary state.
pub fn of_program(model: &Model<Dd>, graph: &Graph, scalar: Scalar) -> Option<String> {
    if let Some(why) = of_constants(graph, scalar) {
        return Some(why);
    }
    // mixed precision is f64 where it has to be
    if !graph.formats.is_empty() || !scalar.is_short() {
        return None;
    }
    let all = Graph { results: graph.ids().collect(), ..graph.clone() };
    let states = states::states(model, &graph.inputs, STATES, false)?;
    states.iter().find_map(|x| leaves(&all, scalar, x))
}

/// The first value of a program that leaves the range of its scalar at these inputs, and not that of f64.
fn leaves(graph: &Graph, scalar: Scalar, inputs: &[f64]) -> Option<String> {
    let exact: Vec<f64> = evaluate(graph, inputs);
    let single = computed_at(graph, scalar, inputs);
    let is_lost = |x: f64| x != 0.0 && x.abs() < scalar.tiny();
    for (k, (exact_value, value)) in exact.iter().zip(&single).enumerate() {
        if value.is_finite() || !exact_value.is_finite() {
            continue;
        }
        return match graph.ops[k] {
            // a divisor that cancellation has made zero is another matter
            Op::Binary(Binary::Div, _, b) if single[b.index()] == 0.0 && !is_lost(exact[b.index()]) => None,
            Op::Binary(Binary::Div, _, b) if single[b.index()] == 0.0 => {
                Some(format!("it divides by {:.3e}", exact[b.index()]))
            }
            _ if exact_value.abs() > scalar.largest() => Some(format!("a value on the way is {exact_value:.3e}")),
            _ => None,
        };
    }
    None
}

/// Why a program cannot be written in its scalar, if a constant is no number there.
pub fn of_constants(graph: &Graph, scalar: Scalar) -> Option<String> {
    graph.ids().find_map(|id| {
        let Op::Constant(c) = graph.op(id) else { return None };
        let exact = c.value().to_f64();
        let held = graph.precision(id, scalar).held.nearest(c.value());
        match (exact.is_finite(), held.is_finite()) {
            (false, _) => Some("a product of constants is beyond f64".to_string()),
            (_, false) => Some(format!("a product of constants is {exact:.3e}")),
            _ => None,
        }
    })
}
