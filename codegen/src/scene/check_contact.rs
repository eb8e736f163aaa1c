//! What can be wrong with the contacts of a scene: by themselves, and with a robot.

use super::check::carrier;
use super::contact::{ContactItem, EnvironmentKind, SceneContacts, SurfaceItem};
use super::{messages as say, Scene};
use crate::diagnostic::{Diagnostic, Diagnostics};
use crate::identifier::{identifier, module_name, upper_camel_case, UNNAMED};
use straightline_core::contact::Coordinate;
use straightline_core::model::Model;
use straightline_core::Dd;

/// A direction of this length or less is none.
const SHORT: f64 = 1e-9;

/// Takes a complaint with the path of what it is about.
type Complain<'a> = &'a mut dyn FnMut(String, Diagnostic);

fn cross([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    [b * z - c * y, c * x - a * z, a * y - b * x]
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn repeated(coordinates: &[Coordinate]) -> Option<Coordinate> {
    coordinates.iter().enumerate().find(|(i, c)| coordinates[..*i].contains(c)).map(|(_, c)| *c)
}

/// Whatever the robot.
pub(super) fn alone(scene: &Scene, diagnostics: &mut Diagnostics) {
    let (all, places) = (&scene.contacts, &scene.places);
    let mut complain = |path: String, complaint| places.complain(&path, complaint, diagnostics);
    names(all, &mut complain);
    for (i, item) in all.contacts.iter().enumerate() {
        contact(i, item, &mut complain);
        friction_and_environment(i, item, &mut complain);
    }
    for (i, a_loop) in all.loops.iter().enumerate() {
        let owner = format!("loop `{}`", a_loop.name);
        if a_loop.constrained.is_empty() {
            complain(format!("loop.{i}.constrained"), say::no_coordinate(&owner));
        }
        if let Some(coordinate) = repeated(&a_loop.constrained) {
            complain(format!("loop.{i}.constrained"), say::coordinate_twice(&a_loop.name, coordinate.name()));
        }
    }
    modes(all, &mut complain);
    if let Some((frequency, damping)) = all.stabilisation {
        for (key, value) in [("frequency", frequency), ("damping", damping)] {
            if !(1e-9..=1e6).contains(&value) {
                let complaint = say::not_in_range(&format!("{key} of [stabilisation]"), value, "between 1e-9 and 1e6");
                complain(format!("stabilisation.{key}"), complaint);
            }
        }
    }
}

/// Names that make no identifier of their own.
fn names(all: &SceneContacts, complain: Complain) {
    type Named = fn(&str, &str) -> String;
    let groups: [(&str, Named, Vec<&str>); 3] = [
        ("contact", identifier, all.contacts.iter().map(|c| c.name.as_str()).collect()),
        ("loop", identifier, all.loops.iter().map(|c| c.name.as_str()).collect()),
        ("mode", module_name, all.modes.iter().map(|c| c.name.as_str()).collect()),
    ];
    for (kind, named, names) in &groups {
        let identifiers: Vec<String> = names.iter().map(|n| named(n, kind)).collect();
        let types: Vec<String> = identifiers.iter().map(|i| upper_camel_case(i)).collect();
        for (i, name) in names.iter().enumerate() {
            let other = types[..i].iter().position(|t| *t == types[i]).map(|k| names[k]);
            if other.is_some() || identifiers[i] == UNNAMED {
                complain(format!("{kind}.{i}.name"), say::contact_name(kind, name, &identifiers[i], other));
            }
        }
    }
}

/// A contact without its environment.
fn contact(i: usize, contact: &ContactItem, complain: Complain) {
    let (path, name) = (format!("contact.{i}"), &contact.name);
    if let Some(axis) = contact.axis.filter(|a| length(*a) <= SHORT) {
        complain(format!("{path}.axis"), say::no_direction(&format!("axis of contact `{name}`"), axis));
    }
    if let Some(object) = contact.object {
        let what = |key: &str| format!("{key} of the object of contact `{name}`");
        if length(object.z) <= SHORT {
            complain(format!("{path}.object.z"), say::no_direction(&what("z"), object.z));
        } else if length(cross(object.z, object.x)) <= 1e-6 * length(object.z) * length(object.x) {
            complain(format!("{path}.object.x"), say::no_direction(&what("x, perpendicular to z,"), object.x));
        }
    }
    let (constrained, free) = (&contact.constrained, &contact.free);
    let both = constrained.iter().find(|c| free.contains(c)).copied();
    if constrained.is_empty() {
        complain(format!("{path}.constrained"), say::no_coordinate(&format!("contact `{name}`")));
    }
    for (key, wrong) in [("constrained", repeated(constrained)), ("free", repeated(free)), ("free", both)] {
        if let Some(coordinate) = wrong {
            complain(format!("{path}.{key}"), say::coordinate_twice(name, coordinate.name()));
        }
    }
    match &contact.surface {
        SurfaceItem::Sphere { radius, .. } | SurfaceItem::Cylinder { radius, .. } => {
            if !(1e-9..=1e9).contains(radius) {
                let what = format!("radius of contact `{name}`");
                let complaint = say::not_in_range(&what, *radius, "between 1e-9 and 1e9 m");
                complain(format!("{path}.surface.radius"), complaint);
            }
        }
        SurfaceItem::Quadric { matrix, linear, .. } => {
            if matrix.iter().chain(linear).all(|x| *x == 0.0) {
                complain(format!("{path}.surface"), say::no_surface(name));
            }
        }
        SurfaceItem::Plane | SurfaceItem::Implicit(_) => {}
    }
}

/// Modes with contacts that are not there, that cannot stick, or without any.
fn modes(all: &SceneContacts, complain: Complain) {
    for (i, mode) in all.modes.iter().enumerate() {
        let find = |name: &String| all.contacts.iter().find(|c| c.name == *name);
        let known = || all.contacts.iter().map(|c| c.name.as_str());
        for (k, name) in mode.contacts.iter().enumerate() {
            if find(name).is_none() {
                complain(format!("mode.{i}.contacts.{k}"), say::unknown_contact(&mode.name, name, known()));
            }
        }
        for (k, name) in mode.sticking.iter().enumerate() {
            let rubs = find(name).is_some_and(|c| c.friction.is_some());
            if !mode.contacts.contains(name) || !rubs {
                complain(format!("mode.{i}.sticking.{k}"), say::cannot_stick(&mode.name, name));
            }
        }
        if mode.contacts.is_empty() && all.loops.is_empty() {
            complain(format!("mode.{i}.contacts"), say::empty_mode(&mode.name));
        }
    }
}

fn friction_and_environment(i: usize, contact: &ContactItem, complain: Complain) {
    use Coordinate::{Px, Py, Pz};
    let (path, name) = (format!("contact.{i}"), &contact.name);
    let holds = |c: Coordinate| contact.constrained.contains(&c);
    if let Some((coefficient, speed)) = contact.friction {
        if !(0.0..=100.0).contains(&coefficient) {
            let complaint =
                say::not_in_range(&format!("friction of contact `{name}`"), coefficient, "between 0 and 100");
            complain(format!("{path}.friction.coefficient"), complaint);
        }
        if !(1e-9..=1e9).contains(&speed) {
            let what = format!("speed of the friction of contact `{name}`");
            let complaint = say::not_in_range(&what, speed, "between 1e-9 and 1e9 m/s");
            complain(format!("{path}.friction.speed"), complaint);
        }
        if !holds(Pz) || holds(Px) || holds(Py) {
            complain(format!("{path}.friction"), say::nothing_slides(name));
        }
    }
    let Some(environment) = &contact.environment else { return };
    if !holds(Pz) {
        complain(format!("{path}.environment"), say::nothing_yields(name));
    }
    let Some(values) = &environment.values else { return };
    for (key, value) in environment.kind.keys().iter().zip(values) {
        let least = if environment.kind.positive().contains(key) { 1e-9 } else { 0.0 };
        if !(least..=1e15).contains(value) {
            let what = format!("{key} of the environment of contact `{name}`");
            let range = if least > 0.0 { "between 1e-9 and 1e15" } else { "between 0 and 1e15" };
            complain(format!("{path}.environment.{key}"), say::not_in_range(&what, *value, range));
        }
    }
    debug_assert!(environment.kind != EnvironmentKind::BothSides || values.len() == 4);
}

/// With a robot; `held` says which of its bodies do not move against their parents.
pub(super) fn against(model: &Model<Dd>, scene: &Scene, held: &[bool], diagnostics: &mut Diagnostics) {
    let (all, places) = (&scene.contacts, &scene.places);
    let carrier = |name: &str| carrier(model, held, name);
    let mut check = |path: String, owner: &str, frame: &str, must_move: bool| {
        let complaint = match (model.frame(frame), carrier(frame)) {
            (None, _) => say::unknown_frame(owner, frame, model.frames.iter().map(|f| f.name.as_str())),
            (Some(_), None) if must_move => say::contact_on_world(owner, frame),
            _ => return true,
        };
        places.complain(&path, complaint, diagnostics);
        false
    };
    for (i, contact) in all.contacts.iter().enumerate() {
        check(format!("contact.{i}.frame"), &format!("contact `{}`", contact.name), &contact.frame, true);
    }
    let mut rigid = Vec::new();
    for (i, a_loop) in all.loops.iter().enumerate() {
        let owner = format!("loop `{}`", a_loop.name);
        let first = check(format!("loop.{i}.frame"), &owner, &a_loop.frame, true);
        let second = check(format!("loop.{i}.with"), &owner, &a_loop.with, false);
        if first && second && carrier(&a_loop.frame) == carrier(&a_loop.with) {
            rigid.push((format!("loop.{i}.with"), owner));
        }
    }
    for (path, owner) in rigid {
        places.complain(&path, say::loop_on_one_body(&owner), diagnostics);
    }
}
