//! Every text that can be said of a scene, one function per message; what its TOML shares with robot files stands in
//! [`crate::description::messages`]. The tests in `tests/messages/scene` hold the exact text of each.

use crate::description::messages::{cut, did_you_mean, list, six_digits};
use crate::diagnostic::Diagnostic;

/// The codes of all messages of this table.
pub const CODES: &[&str] = &[
    "unknown-joint",
    "unknown-scene-frame",
    "unknown-moving-link",
    "not-a-selection",
    "no-such-part",
    "locked-joint-wanted",
    "locked-twice",
    "base-locked",
    "locked-beyond-limits",
    "nothing-left",
    "not-in-range",
    "unphysical-body",
    "payload-name-twice",
    "payload-on-world",
    "parameter-on-world",
    "parameter-name",
    "link-given-twice",
    "coulomb-speed-missing",
    "coulomb-speed-alone",
    "budget-alone",
    "over-budget",
    "moving-base-forward",
    "said-twice",
    "scalar-twice",
    "empty-range",
    "range-alone",
];

type D = Diagnostic;

fn hinted<'a>(d: D, word: &str, known: impl IntoIterator<Item = &'a str>) -> D {
    let known: Vec<&str> = known.into_iter().collect();
    match did_you_mean(word, known.iter().copied()) {
        Some(hint) => d.help(hint),
        None if known.is_empty() => d,
        None => d.help(format!("there are {}", list(&known))),
    }
}

/// A joint that is not there, or does not move.
pub fn unknown_joint<'a>(owner: &str, joint: &str, joints: impl IntoIterator<Item = &'a str>) -> D {
    let d = D::error("unknown-joint", format!("{owner}: no moving joint is named `{}`", cut(joint)));
    hinted(d, joint, joints)
}

/// A frame that is not there.
pub fn unknown_frame<'a>(owner: &str, frame: &str, frames: impl IntoIterator<Item = &'a str>) -> D {
    let d = D::error("unknown-scene-frame", format!("{owner}: the robot has no frame `{}`", cut(frame)));
    hinted(d, frame, frames)
}

/// A link whose inertia cannot be an input by itself.
pub fn unknown_moving_link<'a>(
    owner: &str,
    link: &str,
    carrier: Option<&str>,
    links: impl IntoIterator<Item = &'a str>,
) -> D {
    let title = format!("{owner}: `{}` is no link that a joint moves", cut(link));
    let d = D::error("unknown-moving-link", title);
    match carrier {
        Some(carrier) => d
            .detail(format!("it is fixed to `{carrier}`, and their inertias are one"))
            .help(format!("write `link = \"{carrier}\"` for both together, or a payload in the frame `{}`", cut(link))),
        None => hinted(d, link, links),
    }
}

/// Joints or frames of a function whose results are not by joints or frames.
pub fn not_a_selection(function: &str, what: &str, others: &[&str]) -> D {
    D::error("not-a-selection", format!("the results of `{function}` are not by {what}"))
        .help(format!("remove `{what}`; it is for {}", list(others)))
}

/// A part that the results of a function do not have.
pub fn no_such_part(function: &str, part: &str, parts: &[&str]) -> D {
    let d = D::error("no-such-part", format!("the results of `{function}` have no part `{part}`"));
    match parts {
        [] => d.help("remove `part`: they come whole"),
        _ => d.help(format!("it has {}", list(parts))),
    }
}

/// A coordinate of a joint that has none in this scene.
pub fn locked_joint_wanted(owner: &str, joint: &str) -> D {
    D::error("locked-joint-wanted", format!("{owner}: joint `{joint}` is locked"))
        .detail("a locked joint has no coordinate, no speed and no torque")
        .help("leave it out here, or do not lock it")
}

/// A joint with two values.
pub fn locked_twice(joint: &str) -> D {
    D::error("locked-twice", format!("joint `{}` is locked twice", cut(joint))).help("keep one value")
}

/// A lock on the joint of a floating base.
pub fn base_locked(joint: &str) -> D {
    D::error("base-locked", format!("joint `{joint}` is the floating base: one number does not hold it"))
        .help("write `base = \"fixed\"` in [hold]: the root link is the world then")
}

/// A value that the joint cannot reach.
pub fn locked_beyond_limits(joint: &str, value: f64, lower: f64, upper: f64) -> D {
    D::warning("locked-beyond-limits", format!("joint `{joint}` is locked at {value:?}, beyond its limits"))
        .detail(format!("they are {lower:?} and {upper:?}; the value is taken as written"))
        .help("angles are in radians")
}

/// A robot that does not move any more.
pub fn nothing_left(robot: &str) -> D {
    D::error("nothing-left", format!("all joints of robot `{}` are locked", cut(robot)))
        .help("leave one that moves, or let the base float")
}

/// A number that cannot be meant.
pub fn not_in_range(what: &str, value: f64, range: &str) -> D {
    D::error("not-in-range", format!("{what}: {value:?} is not {range}"))
}

/// Mass and inertia that no body has.
pub fn unphysical_body(payload: &str, why: &str) -> D {
    D::error("unphysical-body", format!("payload `{}` cannot be a rigid body", cut(payload)))
        .detail(why)
        .help("moments are taken about the mass centre, in the axes of the frame that carries it")
}

/// Why a tensor with these principal moments belongs to no body; `None` if it may.
pub fn unphysical_moments([a, b, c]: [f64; 3], slack: f64) -> Option<String> {
    if a < -slack {
        let [a, b, c] = [a, b, c].map(six_digits);
        Some(format!("its principal moments are {a}, {b}, {c}: one is negative"))
    } else if c > a + b + slack {
        let [a, b, c] = [a, b, c].map(six_digits);
        Some(format!("{c} > {a} + {b}: a principal moment exceeds the sum of the other two"))
    } else {
        None
    }
}

/// A name for two payloads.
pub fn payload_name_twice(name: &str) -> D {
    D::error("payload-name-twice", format!("a second payload is named `{}`", cut(name))).help("give each its own name")
}

/// A payload that moves with nothing.
pub fn payload_on_world(payload: &str, frame: &str) -> D {
    D::warning("payload-on-world", format!("payload `{payload}` changes nothing"))
        .detail(format!("no joint that moves carries the frame `{frame}`"))
}

/// A parameter of what does not move.
pub fn parameter_on_world(owner: &str, frame: &str) -> D {
    D::error("parameter-on-world", format!("{owner}: nothing depends on it"))
        .detail(format!("no joint that moves carries `{frame}`"))
        .help("remove the parameter")
}

/// A parameter whose name as an input is taken.
pub fn parameter_name(name: &str, input: &str, taken: &str) -> D {
    D::error("parameter-name", format!("parameter `{}`: the input `{input}` is {taken}", cut(name)))
        .help("give it another name")
}

/// Two parameters for one inertia.
pub fn link_given_twice(link: &str) -> D {
    D::error("link-given-twice", format!("the inertia of link `{}` is a parameter twice", cut(link)))
        .help("keep one; a payload in its frame adds to it")
}

/// Smooth friction without a width.
pub fn coulomb_speed_missing() -> D {
    D::error("coulomb-speed-missing", "smooth Coulomb friction has no `coulomb_speed`")
        .detail("the force is f qd / sqrt(qd² + w²)")
        .help("write the speed w at which it has reached 71 %, as in `coulomb_speed = 0.01`")
}

/// A width of what is not smooth.
pub fn coulomb_speed_alone() -> D {
    D::error("coulomb-speed-alone", "`coulomb_speed` without smooth Coulomb friction")
        .help("write `coulomb = \"smooth\"` beside it, or remove it")
}

/// A budget for what is not generated.
pub fn budget_alone(function: &str) -> D {
    D::error("budget-alone", format!("a budget for `{function}`, which is not among the outputs"))
        .help(format!("add `{function}` to `functions` in [outputs], or remove its budget"))
}

/// A function that costs more than it may. `words` stand before the number, after one, and after any other; `savings` are what
/// could be held, the greatest first.
pub fn over_budget(
    function: &str,
    words: (&str, &str, &str),
    (takes, most): (usize, usize),
    key: &str,
    savings: &[(usize, &str)],
) -> D {
    let (verb, one, many) = words;
    let unit = if takes == 1 { one } else { many };
    let d = D::error("over-budget", format!("`{function}` {verb} {takes} {unit}, the budget is {most}"));
    let savings: Vec<String> = savings.iter().map(|(saved, what)| format!("{what} (−{saved})")).collect();
    match savings.is_empty() {
        true => d.help(format!("nothing that the scene could hold saves any; raise `{key}`")),
        false => d.help(format!("what would save most: {}; or raise `{key}`", savings.join(", "))),
    }
}

/// Forward dynamics where the base's motion is given.
pub fn moving_base_forward() -> D {
    D::error("moving-base-forward", "forward dynamics of a robot whose base moves as it is told")
        .detail("`forward_dynamics` would let the base fall: the drives of its motion are not among the inputs")
        .help("remove it from the outputs, or write `base = \"floating\"`")
}

/// The scene and an option of the front say the same thing.
pub fn said_twice(what: &str) -> D {
    D::error("said-twice", format!("{what} is given by the scene and by an option beside it")).help("keep one of them")
}

/// A scalar type that is asked for twice.
pub fn scalar_twice(scalar: &str) -> D {
    D::error("scalar-twice", format!("the scalar type `{scalar}` is asked for twice")).help("name each once")
}

/// A range without a value.
pub fn empty_range(what: &str, lower: f64, upper: f64) -> D {
    let d = D::error("empty-range", format!("{what}: nothing lies between {lower:?} and {upper:?}"));
    match lower > upper {
        true => d.help(format!("write the smaller number first: [{upper:?}, {lower:?}]")),
        false => d.help("write two numbers, the smaller first"),
    }
}

/// A range of what is no input.
pub fn range_alone(input: &str) -> D {
    D::error("range-alone", format!("a range for `{input}`, which is no input in this scene"))
        .help("remove it; gravity is one with `gravity = \"input\"` in [hold]")
}
