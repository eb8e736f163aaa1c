//! What can be wrong with a scene: by itself, beside the options, and with a robot.

use super::contact::ContactItem;
use super::messages::unphysical_moments;
use super::{
    check_contact, messages as say, CoulombForm, Gravity, InputRange, JointRanges, Parameter, Payload, ResultPart,
    Scene,
};
use crate::diagnostic::Diagnostics;
use crate::function::{Extent, Function, Output, Parts, SelectedRows};
use crate::identifier::UNNAMED;
use crate::model::geometry::principal_moments;
use crate::model::{is_gravity, GRAVITY};
use straightline_core::base_parameters::JointParameter;
use straightline_core::model::{BodyId, Model};
use straightline_core::spatial::Sym3;
use straightline_core::Dd;

/// A principal moment may exceed the sum of the others by so much, relatively: the digits of published tensors.
const MOMENT_DIGITS: f64 = 1e-6;

/// What is wrong with a scene, whatever the robot.
pub(crate) fn alone(scene: &Scene, diagnostics: &mut Diagnostics) {
    check_contact::alone(scene, diagnostics);
    outputs_alone(scene, diagnostics);
    ranges_alone(scene, diagnostics);
    held_alone(scene, diagnostics);
    if let CoulombForm::Smooth(speed) = scene.effects.coulomb {
        // its square must not vanish beside one
        if !(1e-9..=1e9).contains(&speed) {
            let complaint = say::not_in_range("coulomb_speed", speed, "between 1e-9 and 1e9");
            scene.places.complain("effects.coulomb_speed", complaint, diagnostics);
        }
    }
    for (i, payload) in scene.payloads.iter().enumerate() {
        let mut complain =
            |key: &str, complaint| scene.places.complain(&format!("payload.{i}.{key}"), complaint, diagnostics);
        if scene.payloads[..i].iter().any(|other| other.name == payload.name) {
            complain("name", say::payload_name_twice(&payload.name));
        }
        if let Some((key, why)) = unphysical(payload) {
            complain(key, say::unphysical_body(&payload.name, &why));
        }
    }
    parameters_alone(scene, diagnostics);
}

/// Selections that a function does not have.
fn outputs_alone(scene: &Scene, diagnostics: &mut Diagnostics) {
    for (&function, selection) in &scene.outputs {
        let name = function.name();
        let mut complain =
            |key: &str, complaint| scene.places.complain(&format!("outputs.{name}.{key}"), complaint, diagnostics);
        for (key, wanted, possible) in [
            ("joints", &selection.joints, by_joints as fn(Function) -> bool),
            ("frames", &selection.frames, Function::is_per_frame),
        ] {
            if !wanted.is_empty() && !possible(function) {
                let others: Vec<&str> = Function::known().filter(|f| possible(*f)).map(Function::name).collect();
                complain(key, say::not_a_selection(name, key, &others));
            }
        }
        let parts = parts_of(function);
        let results: Vec<&str> = function.spec().outputs.iter().map(|output| output.name).collect();
        for (i, result) in selection.results.iter().enumerate().filter(|(_, r)| !results.contains(&r.as_str())) {
            complain(&format!("results.{i}"), say::no_such_result(name, result, &results));
        }
        let is_known = match selection.part {
            ResultPart::Whole => true,
            ResultPart::Rows(_) => has_rows(function),
            part => parts.contains(&part),
        };
        if !is_known {
            let mut words: Vec<String> = parts.iter().map(|p| p.word()).collect();
            words.extend(has_rows(function).then(|| SelectedRows::WORDS.map(str::to_string)).into_iter().flatten());
            let words: Vec<&str> = words.iter().map(String::as_str).collect();
            complain("part", say::no_such_part(name, &selection.part.word(), &words));
        }
    }
}

/// Joints with two values, and values that none has.
fn held_alone(scene: &Scene, diagnostics: &mut Diagnostics) {
    let places = &scene.places;
    for (i, (joint, value)) in scene.locked.iter().enumerate() {
        let path = format!("hold.joints.{joint}");
        if scene.locked[..i].iter().any(|(other, _)| other == joint) {
            places.complain(&path, say::locked_twice(joint), diagnostics);
        }
        if !(-1e6..=1e6).contains(value) {
            let what = format!("the value of the locked joint `{joint}`");
            places.complain(&path, say::not_in_range(&what, *value, "between -1e6 and 1e6"), diagnostics);
        }
    }
    if let Gravity::Constant(gravity) = scene.gravity {
        if !is_gravity(&gravity) {
            let complaint = say::gravity_not_in_range(&format!("{gravity:?}"), GRAVITY);
            places.complain("hold.gravity", complaint, diagnostics);
        }
    }
}

/// Parameters whose names, or types, are taken.
fn parameters_alone(scene: &Scene, diagnostics: &mut Diagnostics) {
    let places = &scene.places;
    let of_contacts: Vec<String> = scene.contacts.contacts.iter().flat_map(ContactItem::port_names).collect();
    for (i, parameter) in scene.parameters.iter().enumerate() {
        let (name, input, path) = (parameter.name(), parameter.input_name(), format!("parameter.{i}"));
        let earlier = &scene.parameters[..i];
        let taken = match () {
            () if input == UNNAMED => Some("no name: it has no letter or digit"),
            () if earlier.iter().any(|other| other.type_name() == parameter.type_name()) => {
                Some("that of another parameter")
            }
            () if of_contacts.contains(&input) => Some("that of a contact"),
            // the type of the numbers of a drive has a name, too
            () if scene
                .parameters
                .iter()
                .any(|other| !other.is_load() && other.type_name() + "Numbers" == parameter.type_name()) =>
            {
                Some("that of a parameter's numbers")
            }
            () => None,
        };
        match (parameter, taken) {
            (Parameter::Link { link }, Some(_)) if earlier.contains(parameter) => {
                places.complain(&format!("{path}.link"), say::link_given_twice(link), diagnostics);
            }
            // that is said where the drive is looked up
            (Parameter::Drive { name: None, drive, .. }, Some(_)) if earlier.iter().any(|p| p.is_of_drive(drive)) => {}
            (_, Some(taken)) => {
                places.complain(&format!("{path}.name"), say::parameter_name(name, &input, taken), diagnostics);
            }
            (_, None) => {}
        }
    }
}

/// Ranges without a value, and of what is no input.
fn ranges_alone(scene: &Scene, diagnostics: &mut Diagnostics) {
    let places = &scene.places;
    let mut check = |path: String, what: String, range: InputRange| {
        if !range.is_sound() {
            places.complain(&path, say::empty_range(&what, range.lower, range.upper), diagnostics);
        }
    };
    for (input, ranges) in scene.ranges.over_joints().map(|(quantity, ranges)| (quantity.name(), ranges)) {
        let path = format!("numbers.ranges.{input}");
        match ranges {
            JointRanges::Limits => {}
            JointRanges::All(range) => check(path, format!("the range of `{input}`"), *range),
            JointRanges::Joints(named) => {
                for (joint, range) in named {
                    check(format!("{path}.{joint}"), format!("the range of `{input}` of joint `{joint}`"), *range);
                }
            }
        }
    }
    if let Some(range) = scene.ranges.gravity {
        check("numbers.ranges.gravity".to_string(), "the range of `gravity`".to_string(), range);
        if scene.gravity != Gravity::Input {
            places.complain("numbers.ranges.gravity", say::range_alone("gravity"), diagnostics);
        }
    }
}

/// What is wrong with a scene for a robot; `held` says which of its bodies do not move against their parents.
pub(super) fn against(model: &Model<Dd>, scene: &Scene, held: &[bool], diagnostics: &mut Diagnostics) {
    let places = &scene.places;
    let joint_names = || model.free_joints().map(|joint| joint.name.as_str());
    let find = |name: &str| model.free_bodies().find(|b| model.bodies[*b].joint.name == name);
    let unknown = |owner: &str, name: &str| match model.followers().iter().find(|(joint, _)| joint.name == name) {
        Some((_, coupling)) => say::following_joint(owner, name, &model.bodies[coupling.source].joint.name),
        None => say::unknown_joint(owner, name, joint_names()),
    };
    // joints that must have a coordinate
    let mut wanted: Vec<(String, String, &str)> = Vec::new();
    for (function, selection) in &scene.outputs {
        for (i, joint) in selection.joints.iter().enumerate() {
            let (owner, path) = (format!("outputs of `{}`", function.name()), function.name());
            wanted.push((owner, format!("outputs.{path}.joints.{i}"), joint));
        }
    }
    for (i, joint) in scene.zero.joints_at_rest.iter().enumerate() {
        wanted.push(("joints at rest".to_string(), format!("zero.joints_at_rest.{i}"), joint));
    }
    for (input, ranges) in scene.ranges.over_joints().map(|(quantity, ranges)| (quantity.name(), ranges)) {
        let JointRanges::Joints(named) = ranges else { continue };
        for (joint, _) in named {
            wanted.push((format!("ranges of `{input}`"), format!("numbers.ranges.{input}.{joint}"), joint));
        }
    }
    for (owner, path, joint) in wanted {
        let is_velocity = !path.starts_with("numbers.ranges.q.");
        match find(joint) {
            Some(body) if is_velocity && model.is_dependent(body) => {
                places.complain(&path, say::determined_joint(&owner, joint), diagnostics);
            }
            None => places.complain(&path, unknown(&owner, joint), diagnostics),
            Some(body) if held[body] => {
                places.complain(&path, say::locked_joint_wanted(&owner, joint), diagnostics);
            }
            Some(_) => {}
        }
    }
    for (joint, value) in &scene.locked {
        let path = format!("hold.joints.{joint}");
        let Some(body) = find(joint) else {
            places.complain(&path, unknown("locked joints", joint), diagnostics);
            continue;
        };
        let (kind, limits) = (model.bodies[body].joint.kind, model.bodies[body].joint.limits);
        if model.closure.loops.iter().any(|of| model.bodies_of_loop(of).contains(&body)) {
            places.complain(&path, say::not_on_loops(&format!("the lock of joint `{joint}`")), diagnostics);
        } else if kind.is_base() {
            places.complain(&path, say::base_locked(joint), diagnostics);
        } else if !kind.is_single() {
            places.complain(&path, say::several_locked(joint, kind.row().name), diagnostics);
        } else if *value < limits.lower || *value > limits.upper {
            let complaint = say::locked_beyond_limits(joint, *value, limits.lower, limits.upper);
            places.complain(&path, complaint, diagnostics);
        }
    }
    if !held.is_empty() && held.iter().all(|held| *held) {
        places.complain("hold.joints", say::nothing_left(&model.name), diagnostics);
    }
    of_one_coordinate(model, scene, diagnostics);
    frames(model, scene, held, diagnostics);
    if !model.closure.is_empty() && !scene.contacts.is_empty() {
        places.complain("contact", say::not_on_loops("contacts and loops of a scene"), diagnostics);
    }
    check_contact::against(model, scene, held, diagnostics);
}

/// Columns of regressors belong to joints of one coordinate: what others add, of which forces would be left out, has none.
fn of_one_coordinate(model: &Model<Dd>, scene: &Scene, diagnostics: &mut Diagnostics) {
    for parameter in &scene.regressor {
        let acts = match parameter {
            JointParameter::Damping => scene.effects.damping,
            JointParameter::RotorInertia => scene.effects.rotor_inertia,
            _ => false,
        };
        let several = model.bodies.iter().filter(|body| acts && !body.joint.kind.is_single());
        if let Some(body) = several.into_iter().find(|body| parameter.value(&body.effects) != Dd::ZERO) {
            let complaint = say::regressor_of_several(&body.joint.name, parameter.word());
            scene.places.complain("regressor", complaint, diagnostics);
        }
    }
}

/// The body that a frame moves with in this scene.
pub(super) fn carrier(model: &Model<Dd>, held: &[bool], frame: &str) -> Option<BodyId> {
    let mut body = model.frame(frame)?.body;
    while let Some(id) = body.filter(|id| held[*id]) {
        body = model.bodies[id].parent;
    }
    body
}

/// The names of frames and links.
fn frames(model: &Model<Dd>, scene: &Scene, held: &[bool], diagnostics: &mut Diagnostics) {
    let places = &scene.places;
    let unknown =
        |owner: &str, name: &str| say::unknown_frame(owner, name, model.frames.iter().map(|f| f.name.as_str()));
    let carrier = |name: &str| carrier(model, held, name);
    for (function, selection) in &scene.outputs {
        for (i, frame) in selection.frames.iter().enumerate().filter(|(_, f)| model.frame(f).is_none()) {
            let path = format!("outputs.{}.frames.{i}", function.name());
            places.complain(&path, unknown(&format!("outputs of `{}`", function.name()), frame), diagnostics);
        }
    }
    for (i, Payload { name, frame, .. }) in scene.payloads.iter().enumerate() {
        let path = format!("payload.{i}.frame");
        if model.frame(frame).is_none() {
            places.complain(&path, unknown(&format!("payload `{name}`"), frame), diagnostics);
        } else if carrier(frame).is_none() {
            places.complain(&path, say::payload_on_world(name, frame), diagnostics);
        }
    }
    for (i, parameter) in scene.parameters.iter().enumerate() {
        let owner = format!("parameter `{}`", parameter.name());
        let Some(name) = parameter.frame() else { continue };
        let moves_with = carrier(name);
        let is_known = model.frame(name).is_some();
        let complaint = match (parameter, moves_with) {
            (Parameter::Payload { .. }, _) if !is_known => unknown(&owner, name),
            (_, None) if is_known => say::parameter_on_world(&owner, name),
            (Parameter::Link { link }, _) if !is_link_of(model, held, link) => {
                let links = model.bodies.iter().zip(held).filter(|(_, held)| !**held).map(|(b, _)| b.name.as_str());
                let carrier = moves_with.map(|id| model.bodies[id].name.as_str());
                say::unknown_moving_link(&owner, link, carrier, links)
            }
            _ => continue,
        };
        let key = if matches!(parameter, Parameter::Link { .. }) { "link" } else { "frame" };
        places.complain(&format!("parameter.{i}.{key}"), complaint, diagnostics);
    }
}

/// The drives whose numbers are free, once the model has all of them; `held` as above.
pub(super) fn drives(model: &Model<Dd>, scene: &Scene, held: &[bool], diagnostics: &mut Diagnostics) {
    let mut complain = |path: String, complaint| scene.places.complain(&path, complaint, diagnostics);
    for (i, parameter) in scene.parameters.iter().enumerate() {
        let Parameter::Drive { drive, numbers, form, .. } = parameter else { continue };
        let owner = format!("parameter `{}`", parameter.name());
        let path = format!("parameter.{i}");
        let Some(built) = model.drives.iter().find(|d| d.name == *drive) else {
            let drives = model.drives.iter().map(|d| d.name.as_str());
            complain(format!("{path}.drive"), say::unknown_drive(&owner, drive, drives));
            continue;
        };
        if scene.parameters[..i].iter().any(|earlier| earlier.is_of_drive(drive)) {
            complain(format!("{path}.drive"), say::drive_given_twice(drive));
        }
        if built.joints.iter().all(|(body, _)| held[*body]) {
            complain(format!("{path}.drive"), say::idle_drive(&owner, drive));
            continue;
        }
        let Some(form) = form else { continue };
        let all = form.numbers();
        let names = || all.iter().map(|n| n.name.as_str());
        if numbers.is_empty() {
            complain(format!("{path}.numbers"), say::no_free_number(&owner, names()));
        }
        for (k, name) in numbers.iter().enumerate() {
            let path = format!("{path}.numbers.{k}");
            let Some(number) = all.iter().find(|n| n.name == *name) else {
                complain(path, say::unknown_drive_number(&owner, drive, name, names()));
                continue;
            };
            let is_same = |other: &&String| all.iter().any(|n| n.name == **other && n.is(number));
            if let Some(other) = numbers[..k].iter().find(is_same) {
                complain(path, say::drive_number_twice(&owner, name, other));
            } else if !number.quantity.at_run_time.holds(number.value) {
                let be = number.quantity.at_run_time.words().0;
                complain(path, say::drive_number_fixed(&owner, name, number.value, be));
            }
        }
    }
}

/// Whether a joint that moves carries the link of that name.
fn is_link_of(model: &Model<Dd>, held: &[bool], link: &str) -> bool {
    model.bodies.iter().zip(held).any(|(body, held)| body.name == link && !held)
}

/// Why a payload is no rigid body, with the key that says so.
fn unphysical(payload: &Payload) -> Option<(&'static str, String)> {
    let Payload { mass, com, inertia, .. } = payload;
    let is_fit = |x: &f64| x.abs() <= 1e60;
    if !is_fit(mass) || !com.iter().all(is_fit) || !inertia.iter().all(is_fit) {
        return Some(("mass", "a number is not finite".to_string()));
    }
    if *mass < 0.0 {
        return Some(("mass", format!("its mass is negative: {mass:?} kg")));
    }
    if *mass == 0.0 && inertia.iter().any(|x| *x != 0.0) {
        return Some(("mass", "it has inertia and no mass".to_string()));
    }
    let [xx, xy, xz, yy, yz, zz] = *inertia;
    let moments = principal_moments(Sym3 { xx, xy, xz, yy, yz, zz });
    let slack = MOMENT_DIGITS * moments[2].abs().max(moments[0].abs());
    unphysical_moments(moments, slack).map(|why| ("inertia", why))
}

/// Whether the results of a function, or its columns, belong to joints.
fn by_joints(function: Function) -> bool {
    function.is_by_joints() && !function.spec().family.is_of_drives()
}

/// The parts that the results of a function have.
fn parts_of(function: Function) -> &'static [ResultPart] {
    match function.spec().outputs.first().map_or(Parts::No, |output| output.parts) {
        Parts::No => &[],
        Parts::Diagonal => &[ResultPart::Diagonal],
        Parts::LinearAngular | Parts::OfTask => &[ResultPart::Linear, ResultPart::Angular],
    }
}

/// Whether the rows of its six-vectors can be asked for one by one.
fn has_rows(function: Function) -> bool {
    let is_of_rows = |output: &Output| match output.parts {
        Parts::No | Parts::OfTask => true,
        Parts::Diagonal => false,
        Parts::LinearAngular => output.axes.iter().all(|extent| !matches!(extent, Extent::Of(n) if *n != 6)),
    };
    let outputs = function.spec().outputs;
    outputs.first().is_some_and(|output| output.parts != Parts::No) && outputs.iter().all(is_of_rows)
}
