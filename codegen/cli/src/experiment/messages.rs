//! Every text that can be said of an experiment file and of samples, one function per message; what its TOML shares with robot
//! files stands in [`straightline_codegen::description::messages`].

use straightline_codegen::diagnostic::wording::{cut, did_you_mean, list};
use straightline_codegen::diagnostic::Diagnostic;
use straightline_core::trig::DOMAIN_F64;

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

/// A column that is no gain.
pub fn column_of_no_gain(column: &str, known: &[&str]) -> D {
    D::error("column-unknown", format!("the column `{}` is no gain", cut(column)))
        .help(format!("gains are called `K.JOINT.q.OTHER` and `K.JOINT.qd.OTHER`; joints: {}", list(known)))
}

/// Gains in a file, and beside them others, or a law that has no torques for them.
pub fn gains_and(key: &str) -> D {
    D::error("controller-and-torques", format!("`gains` and `{key}` in one controller"))
        .help("gains of a file are of torques, and stand for stiffness and damping: with compensation \"none\", \"gravity\" or \"feed_forward\"")
}

/// Periods that nobody counts.
pub fn delay_without_period() -> D {
    D::error("missing-key", "a delay of periods, and the controller has no period").help("write `period = 1e-3`")
}

/// A column of no drive.
pub fn column_of_no_drive(column: &str, known: &[&str]) -> D {
    let d = D::error("column-unknown", format!("the column `{}` belongs to no drive", cut(column)));
    let name = column.strip_prefix("i.").or(column.strip_prefix("u.")).unwrap_or(column);
    match did_you_mean(name, known.iter().copied()) {
        Some(hint) => d.help(hint),
        None => d.help(format!("drives: {}; voltages begin with `u.`, currents with `i.`", list(known))),
    }
}

/// A current for an actuator that is no motor.
pub fn current_without_motor(drive: &str) -> D {
    D::error("current-without-motor", format!("drive `{}` is no motor and takes no current", cut(drive)))
        .help(format!("name its input `u.{}`", cut(drive)))
}

/// Two columns of one drive.
pub fn two_inputs(drive: &str) -> D {
    D::error("two-inputs", format!("drive `{}` has two columns", cut(drive)))
        .help("a drive follows a voltage or a current, not both")
}

/// A key for drives, of a robot without.
pub fn no_drives(key: &str) -> D {
    D::error("no-drives", format!("`{key}` is for drives, and the robot has none"))
        .help("drives are tables [[drive]] of the robot file or of a scene: --scene")
}

/// A state of the drives of another length.
pub fn drive_states(found: usize, wanted: usize, states: &[String]) -> D {
    D::error("drive-states", format!("{found} numbers for the {wanted} states of the drives"))
        .help(format!("in the order {}", states.join(", ")))
}

/// A controller that knows other drives.
pub fn other_drives(known: usize, there: usize) -> D {
    D::error("other-drives", format!("the controller's robot has {known} drives, the driven one {there}"))
        .help("give both the same [[drive]] tables")
}

/// Drives whose inputs no motion gives.
pub fn inputs_do_not_follow() -> D {
    D::error("inputs-do-not-follow", "the inputs of these drives do not follow from a motion")
        .help("as many drives as joints that they move are needed, and rotors in space on rigid transmissions alone")
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

/// A list of another length than that of the joints, or of the entries of those with several coordinates.
pub fn one_per_joint(what: &str, found: usize, entries: &[String]) -> D {
    let entries: Vec<&str> = entries.iter().map(String::as_str).collect();
    D::error("one-per-joint", format!("{what}: {found} numbers for {} coordinates", entries.len()))
        .help(format!("in the order {}", list(&entries)))
}

/// A number outside of its range.
pub fn not_in_range(what: &str, value: f64, range: &str) -> D {
    D::error("not-in-range", format!("{what}: {value:?} is not {range}"))
}

/// An angle that no sine answers for.
pub fn angle_beyond_sines(joint: &str, angle: f64) -> D {
    D::error(
        "angle-beyond-sines",
        format!("joint `{}`: {angle:?} rad are beyond those whose sine has digits", cut(joint)),
    )
    .help(format!("angles stay within ±{DOMAIN_F64} rad, two million turns; leave whole turns out"))
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

/// A motion of a joint that has several coordinates.
pub fn several_moving(what: &str, joint: &str, kind: &str) -> D {
    D::error("several-moving", format!("{what} takes joints of one coordinate, and joint `{}` is {kind}", cut(joint)))
        .help("make it a fixed joint of the robot file, or simulate torques")
}

/// A motion of a joint that loops determine.
pub fn determined_moving(what: &str, joint: &str) -> D {
    D::error(
        "determined-moving",
        format!("{what} takes joints that move by themselves, and loops determine joint `{}`", cut(joint)),
    )
    .help("simulate torques, or open the loops: `loops = false` in [effects] of the scene")
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
         JOINT.spring_stiffness, JOINT.spring_rest, or DRIVE.ratio, DRIVE.torque_constant and other numbers of drives, \
         where the robot file or the scene has a value",
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
