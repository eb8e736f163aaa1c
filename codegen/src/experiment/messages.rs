//! Every text that can be said of an experiment file and of samples, one function per message; what its TOML shares with robot
//! files stands in [`crate::description::messages`].

use crate::description::messages::{cut, did_you_mean, list};
use crate::diagnostic::Diagnostic;

type D = Diagnostic;

/// A file that is no table of numbers.
pub fn not_samples(why: &str) -> D {
    D::error("not-samples", format!("the samples cannot be read: {why}")).help(
        "CSV: a line of names, `t` and one per joint, then a line per instant; JSON: an array of numbers per name",
    )
}

/// A column that is needed and is not there.
pub fn column_missing(column: &str, known: &[&str]) -> D {
    let d = D::error("column-missing", format!("the samples have no column `{}`", cut(column)));
    match did_you_mean(column, known.iter().copied()) {
        Some(hint) => d.help(hint),
        None => d.help(format!("there are {}", list(known))),
    }
}

/// A column that belongs to nothing.
pub fn column_unknown(column: &str, known: &[&str]) -> D {
    let d = D::error("column-unknown", format!("the column `{}` belongs to no joint", cut(column)));
    match did_you_mean(column, known.iter().copied()) {
        Some(hint) => d.help(hint),
        None => d.help(format!("known: {}", list(known))),
    }
}

/// An entry that is no finite number.
pub fn not_a_number(column: &str, text: &str) -> D {
    D::error("not-a-number", format!("column `{}`: `{}` is not a finite number", cut(column), cut(text)))
}

/// A time that does not go on.
pub fn time_goes_back(time: f64, before: f64) -> D {
    D::error("time-goes-back", format!("the time {time:?} does not come after {before:?}"))
        .help("rows are in the order of time, each later than the one before")
}

/// A list of another length than that of the joints.
pub fn one_per_joint(what: &str, found: usize, joints: &[&str]) -> D {
    D::error("one-per-joint", format!("{what}: {found} numbers for {} joints", joints.len()))
        .help(format!("in the order {}", list(joints)))
}

/// A number outside of its range.
pub fn not_in_range(what: &str, value: f64, range: &str) -> D {
    D::error("not-in-range", format!("{what}: {value:?} is not {range}"))
}

/// A controller that follows nothing.
pub fn motion_missing() -> D {
    D::error("motion-missing", "the controller has no motion to follow").help("write a table [motion]")
}

/// Two things that drive one robot.
pub fn controller_and_torques() -> D {
    D::error("controller-and-torques", "a controller and torques beside it")
        .help("keep one of [controller] and [torques]")
}

/// Points that make no motion.
pub fn no_motion(why: &str) -> D {
    D::error("no-motion", format!("the points are no motion: {why}"))
}

/// A motion of a robot whose base floats.
pub fn base_floats(what: &str) -> D {
    D::error("base-floats", format!("{what} takes a robot on a fixed base"))
        .help("write `base = \"fixed\"` in [hold] of the scene")
}

/// A joint without the limits that a trapezoid takes.
pub fn no_limit(joint: &str, key: &str) -> D {
    D::error("no-limit", format!("joint `{}`: its greatest {key} is not known", cut(joint)))
        .help(format!("write `{key} = …` in [motion], one number, or one per joint"))
}

/// A parameter of a sweep that the robot file does not have.
pub fn unknown_parameter(path: &str, why: &str) -> D {
    D::error("unknown-parameter", format!("`{}`: {why}", cut(path))).help(
        "LINK.mass, or JOINT.damping, JOINT.friction, JOINT.rotor_inertia, JOINT.gear_ratio, JOINT.armature, \
         JOINT.spring_stiffness, JOINT.spring_rest where the robot file has a value",
    )
}

/// A contact that the scene does not have.
pub fn unknown_contact(contact: &str, known: &[&str]) -> D {
    let d = D::error("unknown-contact", format!("the scene has no contact `{}`", cut(contact)));
    match did_you_mean(contact, known.iter().copied()) {
        Some(hint) => d.help(hint),
        None if known.is_empty() => d.help("contacts stand in a scene: --scene FILE"),
        None => d.help(format!("there are {}", list(known))),
    }
}

/// A contact of which is said something twice.
pub fn contact_twice(contact: &str) -> D {
    D::error("contact-twice", format!("a second table of contact `{}`", cut(contact)))
}

/// What a scene leaves to the caller, and an experiment must say.
pub fn left_open(contact: &str, key: &str) -> D {
    D::error("left-open", format!("contact `{}`: the scene leaves its {key} open", cut(contact)))
        .help(format!("write `{key}` in the [[contact]] table with the name `{}`", cut(contact)))
}

/// What a scene says, and an experiment may not.
pub fn said_by_the_scene(contact: &str, key: &str) -> D {
    D::error("said-by-the-scene", format!("contact `{}`: the scene says what its {key} is", cut(contact)))
        .help(format!("leave `{key}` out here"))
}

/// A vector that gives no direction.
pub fn no_direction(what: &str, [x, y, z]: [f64; 3]) -> D {
    D::error("no-direction", format!("{what} gives no direction: [{x:?}, {y:?}, {z:?}]"))
}
