//! Every text that can be said of a scene, one function per message; what its TOML shares with robot files stands in
//! [`crate::description::messages`]. The tests in `tests/messages/scene` hold the exact text of each. It is one file, however long, as that is.

use crate::diagnostic::wording::{cut, did_you_mean, list, six_digits};
use crate::diagnostic::Diagnostic;
use crate::function::Lacking;

/// The codes of all messages of this table.
pub const CODES: &[&str] = &[
    "unknown-joint",
    "following-joint",
    "not-on-loops",
    "determined-joint",
    "unknown-scene-frame",
    "unknown-moving-link",
    "not-a-selection",
    "no-such-part",
    "no-such-result",
    "locked-joint-wanted",
    "locked-twice",
    "base-locked",
    "several-locked",
    "locked-beyond-limits",
    "nothing-left",
    "not-in-range",
    "unphysical-body",
    "payload-name-twice",
    "payload-on-world",
    "parameter-on-world",
    "parameter-name",
    "link-given-twice",
    "unknown-drive",
    "no-free-number",
    "unknown-drive-number",
    "drive-number-twice",
    "drive-number-fixed",
    "drive-given-twice",
    "idle-drive",
    "coulomb-speed-missing",
    "coulomb-speed-alone",
    "budget-alone",
    "mixed-alone",
    "mixed-elsewhere",
    "limbs-exact",
    "self-test-fused",
    "no-identical-limbs",
    "error-budget-output",
    "error-budget-count",
    "over-budget",
    "target-missing",
    "figures-elsewhere",
    "figure-unknown",
    "no-machine-code",
    "error-over-budget",
    "fixed-range-missing",
    "fixed-impossible",
    "fixed-error",
    "error-unbounded",
    "moving-base-forward",
    "said-twice",
    "scalar-twice",
    "empty-range",
    "range-alone",
    "unknown-contact-function",
    "contact-name",
    "no-direction",
    "no-coordinate",
    "coordinate-twice",
    "no-surface",
    "nothing-slides",
    "nothing-yields",
    "unknown-contact",
    "cannot-stick",
    "empty-mode",
    "contact-on-world",
    "loop-on-one-body",
    "function-not-of-robot",
    "function-not-of-scene",
    "regressor-unused",
    "regressor-of-several",
    "number-beyond-scalar",
    "program-beyond-scalar",
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

/// A joint that has no coordinate, as it follows another one.
pub fn following_joint(owner: &str, joint: &str, source: &str) -> D {
    D::error("following-joint", format!("{owner}: joint `{}` follows `{}`", cut(joint), cut(source)))
        .help("name the joint that it follows, whose coordinate moves both")
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

/// A result that a function does not have.
pub fn no_such_result(function: &str, result: &str, results: &[&str]) -> D {
    let title = format!("`{function}` has no result `{}`", cut(result));
    let d = D::error("no-such-result", title);
    match results {
        [one] => d.help(format!("it has `{one}` alone")),
        _ => hinted(d, result, results.iter().copied()),
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

/// A lock on a joint that has several coordinates.
pub fn several_locked(joint: &str, kind: &str) -> D {
    D::error("several-locked", format!("joint `{joint}` is {kind}: one number does not hold it"))
        .help("make it a fixed joint of the robot file, whose `origin` has the rotation")
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

/// A gravity that is neither none nor one.
pub fn gravity_not_in_range(value: &str, range: &str) -> D {
    D::error("not-in-range", format!("gravity: {value} is not {range}")).help("write \"zero\" for none")
}

/// Mass and inertia that no body has.
pub fn unphysical_body(payload: &str, why: &str) -> D {
    D::error("unphysical-body", format!("payload `{}` cannot be a rigid body", cut(payload)))
        .detail(why)
        .help("moments are taken about the centre of mass, in the axes of the frame that carries it")
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

/// A drive that is not there.
pub fn unknown_drive<'a>(owner: &str, drive: &str, drives: impl IntoIterator<Item = &'a str>) -> D {
    let d = D::error("unknown-drive", format!("{owner}: the robot has no drive `{}`", cut(drive)));
    hinted(d, drive, drives)
}

/// A parameter of a drive without numbers.
pub fn no_free_number<'a>(owner: &str, numbers: impl IntoIterator<Item = &'a str>) -> D {
    let d = D::error("no-free-number", format!("{owner}: none of the drive's numbers is free"));
    hinted(d, "", numbers)
}

/// A number that a drive does not have.
pub fn unknown_drive_number<'a>(
    owner: &str,
    drive: &str,
    number: &str,
    numbers: impl IntoIterator<Item = &'a str>,
) -> D {
    let title = format!("{owner}: drive `{}` has no number `{}`", cut(drive), cut(number));
    let d = D::error("unknown-drive-number", title)
        .detail("what the robot file does not have, or the scene leaves out, is not in the equations");
    hinted(d, number, numbers)
}

/// Two names of one number.
pub fn drive_number_twice(owner: &str, number: &str, other: &str) -> D {
    let number = if number == other {
        format!("`{number}` is free twice")
    } else {
        format!("`{number}` and `{other}` are one number")
    };
    D::error("drive-number-twice", format!("{owner}: {number}")).help("keep one")
}

/// A number with which the equations have another form than with those that it may have at run time.
pub fn drive_number_fixed(owner: &str, number: &str, value: f64, be: &str) -> D {
    D::error("drive-number-fixed", format!("{owner}: `{number}` cannot be free: it is {value:?} in the robot file"))
        .detail(format!("at run time it must be {be}, which gives the equations another form"))
        .help("give it such a value in the robot file, or keep it constant")
}

/// Two parameters for one drive.
pub fn drive_given_twice(drive: &str) -> D {
    D::error("drive-given-twice", format!("the numbers of drive `{}` are a parameter twice", cut(drive)))
        .help("name all of its numbers in one")
}

/// A parameter of a drive whose joints do not move.
pub fn idle_drive(owner: &str, drive: &str) -> D {
    D::error("idle-drive", format!("{owner}: nothing depends on it"))
        .detail(format!("no joint of drive `{}` moves in this scene", cut(drive)))
        .help("remove the parameter")
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

/// Mixed precision for no demanded error.
pub fn mixed_alone() -> D {
    D::error("mixed-alone", "`mixed_precision` without `max_error`")
        .help("write the error that is demanded, such as `max_error = 1e-3`, or remove it")
}

/// Mixed precision where functions cannot have it.
pub fn mixed_elsewhere(with: &str) -> D {
    D::error("mixed-elsewhere", format!("`mixed_precision` together with {with}"))
        .detail("it computes parts of functions in f32 in f64, operation by operation")
        .help(format!("choose one of the two: remove `mixed_precision`, or {with}"))
}

/// Expected bits where machines have others.
pub fn self_test_fused() -> D {
    D::error("self-test-fused", "`self_test` together with `fma`".to_string())
        .detail(
            "whether a·b + c is rounded once or twice differs from machine to machine, and so do the bits to expect",
        )
        .help("choose one of the two: remove `self_test`, or `fma`")
}

/// Identical limbs in one loop where rules keep every bit.
pub fn limbs_exact(form: &str) -> D {
    D::error("limbs-exact", format!("`limbs = \"{form}\"` together with `rules = \"exact\"`"))
        .detail(
            "by exact rules the output is the generic runtime bit for bit, and that adds up limbs one after the other",
        )
        .help("choose one of the two: remove `limbs`, or `rules`")
}

/// Identical limbs of a robot that has none.
pub fn no_identical_limbs(form: &str) -> D {
    D::error("no-identical-limbs", format!("`limbs = \"{form}\"`, but no two limbs of the robot are alike"))
        .detail("limbs are alike that hang on the same link and have the same kinds of joints in the same order; numbers may differ")
        .help("remove `limbs`, or say `limbs = \"auto\"`: lanes where there are any")
}

/// A budget of errors for what is no output.
pub fn error_budget_output<'a>(output: &str, known: impl IntoIterator<Item = &'a str>) -> D {
    let d = D::error("error-budget-output", format!("`max_error` of `{output}`, which is no output of the function"));
    hinted(d, output, known)
}

/// A budget of errors with too many numbers, or too few.
pub fn error_budget_count(outputs: &[&str], found: usize, wanted: usize) -> D {
    let title = format!("`max_error` has {found} numbers, `{}` has {wanted}", outputs.join("`, `"));
    D::error("error-budget-count", title)
        .help("write one number for all, one per result, or `{ output = .. }` with either of them")
}

/// Bounds of rounding errors that are greater than they may be: each result, its bound, and its budget.
pub fn error_over_budget(function: &str, results: &[(String, f64, f64)]) -> D {
    let title = match results {
        [(result, bound, most)] => {
            format!(
                "the rounding error of `{result}` of `{function}` is bounded by {bound:.3e}, the budget is {most:e}"
            )
        }
        _ => format!(
            "the rounding errors of {} results of `{function}` are bounded by more than their budgets",
            results.len()
        ),
    };
    let line = |(result, bound, most): &(String, f64, f64)| format!("`{result}` {bound:.3e} > {most:e}");
    let lines: Vec<String> = results.iter().map(line).collect();
    let d = D::error("error-over-budget", title);
    let d = if lines.len() > 1 { d.detail(lines.join(", ")) } else { d };
    d.help(
        "what makes it less: narrower `[numbers.ranges]`, `scalar = \"f64\"`, more boxes (`certify_boxes` or \
               `certify_seconds` in [numbers])",
    )
}

/// Rounding errors that have no bound, where one is demanded.
pub fn error_unbounded(function: &str, why: &str) -> D {
    D::error("error-unbounded", format!("the rounding errors of `{function}` have no bound: {why}"))
        .help("narrower `[numbers.ranges]` may help; forward dynamics divides by inertias whose range has zero in it")
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

/// Figures of machine code without a machine.
pub fn target_missing(what: &str) -> D {
    D::error("target-missing", format!("`{what}` is read off machine code, and no machine is named"))
        .help("name it by the option `target`, as in `target = \"cortex-m4f\"`")
}

/// Figures of machine code that needs more than `core`.
pub fn figures_elsewhere(what: &str, with: &str) -> D {
    D::error("figures-elsewhere", format!("`{what}` beside {with}"))
        .detail(
            "figures are read off the machine code of a text that needs `core` alone, whose functions are of numbers",
        )
        .help("leave out one of them")
}

/// A budget of what machine code does not say.
pub fn figure_unknown(function: &str, key: &str, why: &str) -> D {
    D::error("figure-unknown", format!("`{key}` of `{function}` cannot be compared with its machine code: {why}"))
        .help(format!("leave out `{key}`"))
}

/// No machine code, and what to do.
pub fn no_machine_code(why: &str, remedy: String) -> D {
    D::error("no-machine-code", format!("figures are read off machine code, and there is none: {why}")).help(remedy)
}

/// Forward dynamics where the base's motion is given.
pub fn moving_base_forward() -> D {
    D::error("moving-base-forward", "forward dynamics of a robot whose base moves as it is told")
        .detail(
            "`forward_dynamics` would let the base fall: the generalized forces of its motion are not among the inputs",
        )
        .help("remove it from the outputs, or write `base = \"floating\"`")
}

/// The scene and an option of the front say the same thing.
pub fn said_twice(what: &str) -> D {
    D::error("said-twice", format!("{what} is given by the scene and by an option beside it")).help("keep one of them")
}

/// An option that stands in two tables of a scene.
pub fn written_twice(option: &str, other: &str) -> D {
    D::error("said-twice", format!("`{option}` stands in [{other}] and in [options]")).help("keep one of them")
}

/// A scalar type that is asked for twice.
pub fn scalar_twice(scalar: &str) -> D {
    D::error("scalar-twice", format!("the scalar type `{scalar}` is asked for twice")).help("name each once")
}

/// A number of the robot, or of a payload, that the scalar type cannot hold.
pub fn number_beyond_scalar(what: &str, value: f64, scalar: &str, is_too_great: bool) -> D {
    let d = D::error("number-beyond-scalar", format!("{what}: {scalar} cannot hold {value:?}"));
    let d = match is_too_great {
        true => d.detail(format!("the greatest {scalar} is 3.4e38")),
        false => d.detail(format!("below 1.2e-38 {scalar} loses digits, and then the number")),
    };
    d.help("generate in f64, and look whether the units are kg and m; what is no mass at all, or no effect, is 0")
}

/// A program whose constants or values leave the range of the scalar type.
pub fn program_beyond_scalar(function: &str, scalar: &str, why: &str) -> D {
    D::error("program-beyond-scalar", format!("`{function}` cannot be computed in {scalar}: {why}"))
        .detail("each number of the robot is in range, but not what is made of several of them")
        .help(match scalar {
            "f32" => "generate in f64, and look whether the units are kg and m",
            _ => "no scalar type holds that; look whether the units are kg and m",
        })
}

/// A function in fixed point whose input has no range.
pub fn fixed_range_missing(function: &str, port: &str, what: &str) -> D {
    D::error("fixed-range-missing", format!("`{function}` in fixed point: {what} has no range"))
        .detail("binary points follow from the ranges of all inputs, so that nothing overflows")
        .help(match port {
            "q" | "qd" | "tau" => format!("give the joint a limit, or write `{port} = ..` in [numbers.ranges]"),
            "qdd" | "gravity" => format!("write `{port} = ..` in [numbers.ranges]"),
            _ => "hold what it is of, or choose other functions".to_string(),
        })
}

/// A function that has no form in fixed point.
pub fn fixed_impossible(function: &str, why: &str, help: &str) -> D {
    D::error("fixed-impossible", format!("`{function}` has no form in fixed point: {why}")).help(help)
}

/// An error that fixed point does not keep to.
pub fn fixed_error(function: &str, demanded: f64, least: f64) -> D {
    D::error(
        "fixed-error",
        format!(
            "`{function}` in fixed point keeps to a part of {} of full scale, not to {demanded:?}",
            six_digits(least)
        ),
    )
    .help("ask for less with `fixed_error`, or narrow the ranges of its inputs")
}

/// Words that are not the program.
pub fn fixed_disagrees(function: &str, what: &str) -> D {
    D::error(
        "internal-error",
        format!("`{function}` in fixed point is not the program that was compiled; nothing is written"),
    )
    .detail(what)
    .help("this is an error of straightline, not of your files: please report it, with the robot file, the scene and the options")
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

/// A function that contact modes do not have.
pub fn unknown_contact_function(function: &str, known: &[&str]) -> D {
    let d = D::error("unknown-contact-function", format!("contact of [outputs]: no function `{}`", cut(function)));
    hinted(d, function, known.iter().copied())
}

/// A name of a contact, a loop or a mode that makes no identifier of its own.
pub fn contact_name(kind: &str, name: &str, identifier: &str, other: Option<&str>) -> D {
    let why = match other {
        Some(other) => format!("in generated code it would be `{identifier}`, as {kind} `{}`", cut(other)),
        None => "it has no letter or digit".to_string(),
    };
    D::error("contact-name", format!("{kind} `{}`: its name is not free", cut(name)))
        .detail(why)
        .help("give it another name")
}

/// A vector that gives no direction.
pub fn no_direction(what: &str, [x, y, z]: [f64; 3]) -> D {
    D::error("no-direction", format!("{what} gives no direction: [{x:?}, {y:?}, {z:?}]"))
        .help("write a vector that is not zero, and an x that is not parallel to z")
}

/// A contact or a loop that holds nothing.
pub fn no_coordinate(owner: &str) -> D {
    D::error("no-coordinate", format!("{owner} constrains no coordinate"))
        .help("name some of `px`, `py`, `pz`, `ax`, `ay`, `az`, as in `constrained = [\"pz\"]`")
}

/// A coordinate named twice, or as constrained and as free.
pub fn coordinate_twice(owner: &str, coordinate: &str) -> D {
    D::error("coordinate-twice", format!("`{}`: coordinate `{coordinate}` is named twice", cut(owner)))
        .detail("a coordinate is constrained or free")
        .help("keep one of them")
}

/// A quadric without a gradient.
pub fn no_surface(contact: &str) -> D {
    D::error("no-surface", format!("contact `{}`: the quadric depends on no coordinate", cut(contact)))
        .help("the surface is pᵀ A p + 2 b · p + c = 0 with `matrix` A, `linear` b and `constant` c; not all of A and b are zero")
}

/// Friction without a surface to slide on.
pub fn nothing_slides(contact: &str) -> D {
    D::error("nothing-slides", format!("contact `{}` has friction, but does not slide on a surface", cut(contact)))
        .detail("friction acts along X and Y against a reaction along `pz`")
        .help("constrain `pz`, but neither `px` nor `py`, or remove `friction`")
}

/// An environment without a distance.
pub fn nothing_yields(contact: &str) -> D {
    D::error("nothing-yields", format!("contact `{}` has an environment, but `pz` is not constrained", cut(contact)))
        .detail("an object gives way along its normal")
        .help("constrain `pz`, or remove `environment`")
}

/// A mode with a contact that is not there.
pub fn unknown_contact<'a>(mode: &str, contact: &str, contacts: impl IntoIterator<Item = &'a str>) -> D {
    let d = D::error("unknown-contact", format!("mode `{}`: no contact is named `{}`", cut(mode), cut(contact)));
    hinted(d, contact, contacts)
}

/// A contact that cannot stick in a mode.
pub fn cannot_stick(mode: &str, contact: &str) -> D {
    D::error("cannot-stick", format!("mode `{}`: contact `{}` cannot stick", cut(mode), cut(contact)))
        .detail("what sticks is one of the mode's contacts and has friction")
        .help("name it in `contacts`, and give it `friction = { coefficient = 0.3 }`")
}

/// A mode in which nothing is closed.
pub fn empty_mode(mode: &str) -> D {
    D::error("empty-mode", format!("mode `{}` has no contact", cut(mode)))
        .help("name one, as in `contacts = [\"pen\"]`; free motion needs no mode")
}

/// A contact of what does not move.
pub fn contact_on_world(owner: &str, frame: &str) -> D {
    D::error("contact-on-world", format!("{owner}: no joint that moves carries the frame `{}`", cut(frame)))
        .help("name a frame that the robot moves")
}

/// A loop between parts of one body.
pub fn loop_on_one_body(owner: &str) -> D {
    D::error("loop-on-one-body", format!("{owner}: both frames belong to the same body"))
        .detail("no joint between them can move")
        .help("name frames of two bodies")
}

/// A function of bodies that are inputs, where none is.
pub fn function_not_of_scene(function: &str) -> D {
    D::error("function-not-of-scene", format!("this scene has no function `{function}`"))
        .detail("it is about payloads and links whose inertia is an input, and there is none")
        .help("add one, as in `[[parameter]] kind = \"payload\" name = \"gripper\" frame = \"tool\"`")
}

/// Columns of regressors where none is made.
pub fn regressor_unused(functions: &[&str]) -> D {
    D::error("regressor-unused", "no function has these columns")
        .detail(format!("they belong to {}, which are made where they are named", list(functions)))
        .help("name one, as in `functions = [\"torque_regressor\"]` under `[outputs]`, or leave `[regressor]` out")
}

/// Columns of what a joint of several coordinates adds.
pub fn regressor_of_several(joint: &str, parameter: &str) -> D {
    D::error("regressor-of-several", format!("joint `{joint}` has {parameter}, and several coordinates"))
        .detail(
            "regressors have columns of what joints of one coordinate add: the forces of this joint would be left out",
        )
        .help(format!("leave `{parameter}` out of `[regressor]`, or leave it out of the robot"))
}

/// A function about something that the robot does not have.
pub fn function_not_of_robot(function: &str, lacking: Lacking) -> D {
    let d = D::error("function-not-of-robot", format!("this robot has no function `{function}`"));
    match lacking {
        Lacking::Loops => {
            d.detail("none of its loops is closed").help("write `[[loop]]` tables in the robot file, see SCHEMA.md")
        }
        Lacking::FormOnLoops => d
            .detail("the function has no form yet for robots with closed loops")
            .help("leave it out, or ask for the tree that is left where loops are cut: `[effects] loops = false`"),
        Lacking::Drives => {
            d.detail("no drive is given for any of its joints").help("write `[[drive]]` tables, see SCHEMA.md")
        }
        Lacking::FittingDrives => d
            .detail(
                "its drives do not fit its joints one to one, or a motion would be differentiated more than 33 times",
            )
            .help("leave the function out, or give every driven joint a drive of its own"),
    }
}

/// Something of a scene that robots with closed loops do not take.
pub fn not_on_loops(what: &str) -> D {
    D::error("not-on-loops", format!("{what}: not supported yet for a robot with closed loops"))
        .help("leave it out, or ask for the tree that is left where loops are cut: `[effects] loops = false`")
}

/// A joint that loops determine, where one with a velocity of its own is meant.
pub fn determined_joint(owner: &str, joint: &str) -> D {
    D::error("determined-joint", format!("{owner}: the loops determine joint `{}`", cut(joint)))
        .help("name an independent joint of the loop; `determines` of `[[loop]]` chooses which are")
}
