//! Every text that can be said of robot files (of scenes: `scene/messages.rs`), one function per message.
//!
//! A message names the value, says what is wrong or what was assumed, and what to write instead. Its place is added with
//! [`Diagnostic::at`]. The tests in `tests/messages` hold the exact text of each; [`CODES`] is the list that they cover. It is one file,
//! however long: a message is looked for in one place.

use super::FORMATS;
use crate::diagnostic::wording::{cut, did_you_mean, list, six_digits};
use crate::diagnostic::Diagnostic;

/// The codes of all messages of this table.
pub const CODES: &[&str] = &[
    "not-utf8",
    "file-too-large",
    "unknown-format",
    "more-complaints",
    "xml-syntax",
    "toml-syntax",
    "too-complex",
    "not-a-robot",
    "sdf-version",
    "several-models",
    "frame-unknown",
    "frame-cycle",
    "default-inertial",
    "include-failed",
    "geom-size",
    "mesh-failed",
    "xacro-left",
    "urdf-loop",
    "missing-element",
    "missing-attribute",
    "repeated-element",
    "misspelt-element",
    "extension-left-out",
    "unknown-attribute",
    "empty-name",
    "not-a-number",
    "not-finite",
    "out-of-range",
    "wrong-count",
    "unknown-key",
    "missing-key",
    "wrong-type",
    "unknown-word",
    "written-twice",
    "not-symmetric",
    "not-supported-yet",
    "loop-within-body",
    "loop-open",
    "loop-locked",
    "loop-joint",
    "loop-joint-determined",
    "loop-assembly",
    "unused-axis",
    "loops-depend",
    "coupling-joint",
    "coupling-ratio-zero",
    "coupled-twice",
    "coupling-cycle",
    "elastic-follower",
    "joint-order-follower",
    "floating-joint",
    "several-coordinates",
    "oblique-plane",
    "negative-effect",
    "damped-base-stands",
    "no-oscillation",
    "gear-ratio-zero",
    "gear-ratio-alone",
    "no-links",
    "too-many-links",
    "nothing-moves",
    "duplicate-name",
    "unknown-link",
    "two-parents",
    "two-roots",
    "cycle",
    "negative-mass",
    "zero-axis",
    "axis-length",
    "limits-missing",
    "limits-reversed",
    "negative-limit",
    "point-mass",
    "inertia-without-mass",
    "negative-moment",
    "triangle-inequality",
    "zero-mass",
    "singular-joint",
    "near-right-angle",
    "floating-by-option",
    "joint-order-unknown",
    "joint-order-twice",
    "joint-order-missing",
    "bad-option",
    "specificity",
    "alpha-missing",
    "alpha-on-revolute",
    "e-next-on-last",
    "drive-number",
    "drive-joint",
    "drive-coupling",
    "actuator-shape",
    "actuator-inert",
    "unyielding-joints",
    "shaft-without-inertia",
    "elastic-number",
    "flexible-axis",
    "flexible-bending",
    "flexible-rigid",
    "flexible-mass",
    "support-rigid",
    "support-floats",
];

type D = Diagnostic;

// --- the file ---

/// Bytes that are not UTF-8.
pub fn not_utf8() -> D {
    D::error("not-utf8", "the file is not UTF-8 text")
        .help("save the file as UTF-8; is it TOML, URDF, SDF or MJCF at all?")
}

/// A file larger than the readers take.
pub fn file_too_large(bytes: usize, limit: usize) -> D {
    D::error("file-too-large", format!("the file is too large: {bytes} bytes"))
        .detail(format!("at most {limit} bytes are read"))
}

/// A text that is neither XML nor TOML of a robot.
pub fn unknown_format() -> D {
    let formats: Vec<String> = FORMATS.iter().map(|format| format!("{} ({})", format.name, format.signs)).collect();
    D::error("unknown-format", "this is no robot file").detail(format!("robot files are: {}", formats.join("; ")))
}

/// A run of complaints was cut.
pub fn more_complaints(code: &str, more: usize) -> D {
    D::note("more-complaints", format!("{more} more complaints `{code}` are not shown"))
}

/// XML that is not well-formed.
pub fn xml_syntax(what: &str) -> D {
    D::error("xml-syntax", format!("not well-formed XML: {}", cut(what)))
}

/// TOML that is none.
pub fn toml_syntax(what: &str) -> D {
    D::error("toml-syntax", format!("not valid TOML: {what}"))
}

/// More of something than any robot file has.
pub fn too_complex(what: &str, limit: usize) -> D {
    D::error("too-complex", format!("{what}: no file needs more than {limit}"))
}

/// XML, but not of a robot.
pub fn not_a_robot(root: &str) -> D {
    D::error("not-a-robot", format!("the root element is `<{}>`, not `<robot>`", cut(root)))
        .help("a URDF begins with `<robot name=\"...\">`")
}

/// XML in a file that is called SDF, and no SDF.
pub fn not_sdf(root: &str) -> D {
    D::error("not-a-robot", format!("the root element is `<{}>`, not `<sdf>`", cut(root)))
        .help("an SDF file begins with `<sdf version=\"1.9\">`")
}

/// A version of SDF whose elements may mean something else.
pub fn sdf_version(version: &str, is_older: bool) -> D {
    let d = D::error("sdf-version", format!("SDF `{}` is not read: 1.6 to 1.12 are", cut(version)));
    match is_older {
        true => d.help("`gz sdf -p FILE` prints the file in the version that it has itself"),
        false => d.help("write the version whose elements the file has, as in `<sdf version=\"1.9\">`"),
    }
}

/// Models that move, each of which would be a robot.
pub fn several_models(models: &[&str]) -> D {
    D::error("several-models", format!("the file has {} models that move: {}", models.len(), list(models)))
        .detail("one of them is the robot, and what joins it to others is not said")
        .help("leave the others out, write `<static>true</static>` in them, or write all as models in one model")
}

/// A frame that a file of frames does not have.
pub fn frame_unknown<'a>(owner: &str, frame: &str, within: &str, frames: impl IntoIterator<Item = &'a str>) -> D {
    let d = D::error("frame-unknown", format!("{owner}: {within} has no frame `{}`", cut(frame)));
    match did_you_mean(frame, frames) {
        Some(hint) => d.help(hint),
        None => d.help("name a link, joint, frame or model of it; `a::b` is b in the model a"),
    }
}

/// Frames that stand in each other.
pub fn frame_cycle(frame: &str, what: &str) -> D {
    D::error("frame-cycle", format!("frame `{}` {what}", cut(frame)))
        .help("let one of them be given in a frame that does not depend on it")
}

/// A link that has the inertia that its format gives to all that say none.
pub fn default_inertial(owner: &str, missing: &str) -> D {
    let what = match missing {
        "mass" => "a mass of 1 kg",
        "inertia" => "moments of 1 kg·m²",
        _ => "a mass of 1 kg and moments of 1 kg·m²",
    };
    D::warning("default-inertial", format!("{owner} has no `<{missing}>`"))
        .detail(format!("taken as SDF has it: {what}"))
        .help("write what it has; a link without mass has `<mass>0</mass>` and moments of 0")
}

/// XML that an MJCF file includes, and no MJCF.
pub fn not_mjcf(root: &str) -> D {
    D::error("not-a-robot", format!("the root element is `<{}>`, not `<mujoco>`", cut(root)))
        .help("an MJCF file begins with `<mujoco>`, one that is included also with `<mujocoinclude>`")
}

/// A file that is included and cannot be.
pub fn include_failed(path: &str, why: &str) -> D {
    D::error("include-failed", format!("`{}` cannot be included: {why}", cut(path)))
        .help("file names count from the folder of the file that is read")
}

/// A mesh of which no inertia can be made.
pub fn mesh_failed(path: &str, why: &str) -> D {
    D::error("mesh-failed", format!("no inertia can be made of the mesh `{}`: {why}", cut(path)))
        .help("write `<inertial>` in the body, or `mass=\"0\"` in the geom to leave it out")
}

/// A geom without a proper size.
pub fn geom_size(owner: &str, why: &str) -> D {
    D::error("geom-size", format!("the size of {owner}: {why}"))
        .help("the inertia of its body is made of it; write `<inertial>` there, or `mass=\"0\"` to leave the geom out")
}

/// Xacro that was not expanded.
pub fn xacro_left(what: &str, more: usize) -> D {
    let d = D::error("xacro-left", format!("xacro is not expanded: `{}`", cut(what)));
    let d = if more > 0 { d.detail(format!("and {more} more of the kind")) } else { d };
    d.help("run `xacro FILE.xacro -o FILE.urdf` first and read what it writes")
}

/// What closes a loop or couples joints in a URDF.
pub fn urdf_loop(element: &str) -> D {
    let d = D::error("urdf-loop", format!("`<{element}>` changes the dynamics, and is no settled part of URDF"));
    match element {
        "coupling" => d.help("write `<mimic>` in the joint that follows, or `[[coupling]]` in a scene"),
        _ => d.help("leave it out, write the tree by `straightline convert FILE.urdf FILE.toml`, and close it there by `[[loop]]`"),
    }
}

/// An element that must be there.
pub fn missing_element(owner: &str, element: &str, example: &str) -> D {
    D::error("missing-element", format!("{owner} has no `<{element}>`")).help(format!("write `{example}`"))
}

/// An attribute that must be there.
pub fn missing_attribute(owner: &str, attribute: &str, example: &str) -> D {
    D::error("missing-attribute", format!("{owner} has no attribute `{attribute}`")).help(format!("write `{example}`"))
}

/// An element that may be there once.
pub fn repeated_element(owner: &str, element: &str) -> D {
    D::error("repeated-element", format!("{owner} has a second `<{element}>`")).help("keep one of them")
}

/// An element that looks like a known one.
pub fn misspelt_element(owner: &str, element: &str, known: &str) -> D {
    D::warning("misspelt-element", format!("unknown element `<{}>` in {owner}, ignored", cut(element)))
        .help(format!("did you mean `<{known}>`?"))
}

/// Dynamics in an extension that is not read.
pub fn extension_left_out(extension: &str, element: &str) -> D {
    let what = format!("`<{}>` of `<{}>` is not read", cut(element), cut(extension));
    D::warning("extension-left-out", what).detail("it may change the dynamics of the robot").help(
        "write what it means for the robot where the format has a place for it, or in TOML (`straightline convert`)",
    )
}

/// An attribute that the element does not have.
pub fn unknown_attribute(owner: &str, element: &str, attribute: &str, known: &[&str]) -> D {
    let d = D::warning(
        "unknown-attribute",
        format!("unknown attribute `{}` of `<{element}>` in {owner}, ignored", cut(attribute)),
    );
    match did_you_mean(attribute, known.iter().copied()) {
        Some(hint) => d.help(hint),
        None => d,
    }
}

/// A name without characters.
pub fn empty_name(what: &str) -> D {
    D::error("empty-name", format!("the name of a {what} is empty")).help("give it a name")
}

// --- numbers, keys, words ---

/// A number that is none.
pub fn not_a_number(what: &str, text: &str) -> D {
    let d = D::error("not-a-number", format!("{what}: `{}` is not a number", cut(text)));
    if text.contains(',') {
        d.help("numbers are separated by spaces and have a decimal point, as in `0.5 0 -1e-3`")
    } else {
        d.help("write a decimal number, as in `0.5` or `-1e-3`")
    }
}

/// NaN, or a number beyond f64.
pub fn not_finite(what: &str, text: &str) -> D {
    D::error("not-finite", format!("{what}: `{}` is not a finite number", cut(text)))
}

/// A finite number beyond anything a robot has.
pub fn out_of_range(what: &str, value: f64, limit: f64) -> D {
    D::error("out-of-range", format!("{what}: {value:e} is beyond any robot"))
        .detail(format!("magnitudes up to {limit:e} are computed with; all units are SI (m, kg, s, rad)"))
}

/// A triple that is none.
pub fn wrong_count(what: &str, expected: &str, found: usize) -> D {
    D::error("wrong-count", format!("{what}: {expected} expected, {found} found"))
}

/// A key that the schema does not have.
pub fn unknown_key(owner: &str, key: &str, known: &[&str]) -> D {
    let d = D::error("unknown-key", format!("{owner} has no key `{}`", cut(key)));
    match did_you_mean(key, known.iter().copied()) {
        Some(hint) => d.help(hint),
        None => d.help(format!("known keys: {}", known.join(", "))),
    }
}

/// A key that must be there.
pub fn missing_key(owner: &str, key: &str, example: &str) -> D {
    D::error("missing-key", format!("{owner} has no `{key}`")).help(format!("write `{example}`"))
}

/// A value of another type.
pub fn wrong_type(what: &str, expected: &str, found: &str) -> D {
    D::error("wrong-type", format!("{what}: {expected} expected, {found} found"))
}

/// A word that is none of those that are known.
pub fn unknown_word(what: &str, word: &str, known: &[&str]) -> D {
    let d = D::error("unknown-word", format!("{what}: `{}` is unknown", cut(word)));
    let known_words =
        if known.is_empty() { "there is none".to_string() } else { format!("known: {}", known.join(", ")) };
    match did_you_mean(word, known.iter().copied()) {
        Some(hint) => d.detail(known_words).help(hint),
        None => d.help(known_words),
    }
}

/// Two keys for the same thing.
pub fn written_twice(owner: &str, a: &str, b: &str) -> D {
    D::error("written-twice", format!("{owner} has both `{a}` and `{b}`")).help("keep one of them")
}

/// An inertia matrix that is not symmetric.
pub fn not_symmetric(owner: &str, row: usize, column: usize, a: f64, b: f64) -> D {
    D::error("not-symmetric", format!("the inertia matrix of {owner} is not symmetric"))
        .detail(format!("entry ({row}, {column}) is {a:?}, entry ({column}, {row}) is {b:?}"))
}

/// Something that changes the dynamics and is not part of the equations.
pub fn not_supported_yet(owner: &str, what: &str, why: &str, help: &str) -> D {
    D::error("not-supported-yet", format!("{owner}: `{what}` is not supported yet")).detail(why).help(help)
}

/// What is of one coordinate, of a joint that has several.
pub fn several_coordinates(joint: &str, kind: &str, what: &str) -> D {
    D::error("several-coordinates", format!("{kind} joint `{joint}` has {what}"))
        .detail("that belongs to one coordinate, and the joint has several")
        .help("leave it out, or write the joint as single joints, with links without inertia in between")
}

/// A joint across an axis that is none of its frame.
pub fn oblique_plane(owner: &str, kind: &str) -> D {
    D::error("oblique-plane", format!("{owner}: the axis of a {kind} joint is x, y or z of its frame, or against one"))
        .detail("the directions across it would be those that rounding makes")
        .help("turn the joint frame, and give the axis in it")
}

/// A coupling of a joint that is not there, does not move, or has several coordinates.
pub fn coupling_joint<'a>(follower: &str, joint: &str, joints: impl IntoIterator<Item = &'a str>) -> D {
    let what = format!("coupling of joint `{}`: no joint with one coordinate is named `{}`", cut(follower), cut(joint));
    let d = D::error("coupling-joint", what);
    match did_you_mean(joint, joints) {
        Some(hint) => d.help(hint),
        None => d.help("name a joint that turns or slides"),
    }
}

/// A coupling that lets nothing move.
pub fn coupling_ratio_zero(joint: &str) -> D {
    D::error("coupling-ratio-zero", format!("joint `{}` follows another one with the ratio 0", cut(joint)))
        .help("a joint that stands still is a fixed one: write it so")
}

/// A joint that follows two others.
pub fn coupled_twice(joint: &str, first: &str, second: &str) -> D {
    let what = format!("joint `{}` follows both `{}` and `{}`", cut(joint), cut(first), cut(second));
    D::error("coupled-twice", what).help("keep one of the couplings")
}

/// Joints that follow each other in a circle.
pub fn coupling_cycle(joints: &[&str]) -> D {
    D::error("coupling-cycle", format!("joints follow each other in a circle: {}", list(joints)))
        .help("leave one of them without a coupling: its coordinate moves the others")
}

/// A loop whose points belong to one body.
pub fn loop_within_body(name: &str) -> D {
    D::error("loop-within-body", format!("loop `{}`: both points belong to the same body", cut(name)))
        .help("name points of bodies that move against each other")
}

/// A loop that cannot be closed.
pub fn loop_open(name: &str, gap: f64) -> D {
    D::error("loop-open", format!("loop `{}` is closed in no pose that was found", cut(name)))
        .detail(format!("its points come no nearer than {} m", six_digits(gap)))
        .help(match gap < OF_ROUNDED_NUMBERS {
            true => PARALLEL_AXES,
            false => "check the points, and the pose in which the file shows the robot: the search begins there",
        })
        .option("angle_tolerance", Some("1e-5".to_string()))
}

/// Gaps below this \[m\] are what rounded numbers leave open.
const OF_ROUNDED_NUMBERS: f64 = 1e-4;

const PARALLEL_AXES: &str =
    "write axes that are to be parallel as such, to all digits; `{option}` takes angles that are nearly right as exact";

/// A loop that leaves none of its joints a motion.
pub fn loop_locked<'a>(name: &str, joints: impl IntoIterator<Item = &'a str>) -> D {
    let joints: Vec<&str> = joints.into_iter().collect();
    D::error("loop-locked", format!("loop `{}` holds its joints still: {}", cut(name), list(&joints)))
        .detail("it has as many equations as its joints have coordinates: a ball joint has two of a plane where all axes are parallel, or three of space; a hinge that leans out of its plane three or five, a weld three or six")
        .help(PARALLEL_AXES)
        .option("angle_tolerance", Some("1e-5".to_string()))
}

/// A joint that is not on the loop that determines it.
pub fn loop_joint<'a>(name: &str, joint: &str, joints: impl IntoIterator<Item = &'a str>) -> D {
    let d = D::error("loop-joint", format!("loop `{}`: no joint named `{}` is on it", cut(name), cut(joint)));
    match did_you_mean(joint, joints) {
        Some(hint) => d.help(hint),
        None => d.help("name joints between the points that have coordinates of their own"),
    }
}

/// A joint that no loop is left to determine.
pub fn loop_joint_determined(joint: &str) -> D {
    let what = format!("the loops leave joint `{}` where it is once the joints before it are known", cut(joint));
    D::error("loop-joint-determined", what).help("leave it out of `determines`, or name another joint in its place")
}

/// An axis of a joint that has none.
pub fn unused_axis(owner: &str) -> D {
    D::error("unused-axis", format!("{owner} has an axis, and nothing turns about it alone"))
        .detail("a ball joint turns about all axes, a weld about none")
        .help("leave it out, or write `kind = \"revolute\"`")
}

/// An assembly of a loop that has no closed form.
pub fn loop_assembly(name: &str) -> D {
    let what = format!("loop `{}` closes in steps of Newton's method, from wherever its joints stand", cut(name));
    D::error("loop-assembly", what)
        .detail("loops have two assemblies by name where they determine one joint and a hinge, or two hinges whose axes meet")
        .help("leave `assembly` out, or let `determines` name such joints")
}

/// Loops whose equations depend on each other.
pub fn loops_depend(names: &[&str], equations: usize, determined: usize) -> D {
    let what = format!("loops have {equations} equations, and determine {determined} coordinates: {}", list(names));
    D::error("loops-depend", what)
        .detail("some equations follow from others, or hold in single poses alone")
        .help("join the bodies at fewer points, or by joints that leave them more freedom")
}

/// An elastic drive of a joint whose coordinate is shifted against the one that it follows.
pub fn elastic_follower(drive: &str, joint: &str) -> D {
    let what =
        format!("{drive}: joint `{}` follows another one with an offset, and the transmission is elastic", cut(joint));
    D::error("elastic-follower", what)
        .help("let the drive turn the joint that is followed, with the product of the ratios")
}

/// A joint order with a joint that has no coordinate.
pub fn joint_order_follower(name: &str) -> D {
    D::error(
        "joint-order-follower",
        format!("joint order: `{}` follows another joint and has no coordinate", cut(name)),
    )
    .help("leave it out")
}

/// A floating joint.
pub fn floating_joint(joint: &str) -> D {
    D::error("floating-joint", format!("joint `{joint}` is floating: only the root link can move freely"))
        .help("remove the joint and its parent, and ask for a floating base: `{option}`, or `base = \"floating\"` in TOML")
        .option("floating_base", None)
}

/// Friction, an inertia or a stiffness below zero.
pub fn negative_effect(joint: &str, what: &str, value: f64) -> D {
    D::error("negative-effect", format!("{what} of joint `{joint}` is negative: {value:?}"))
        .detail("it would drive the motion instead of resisting it")
        .help("write its magnitude: tau = I qdd + d qd + f sign(qd) + k (q - rest)")
}

/// Friction of a base that would drive it.
pub fn negative_base_damping(value: f64) -> D {
    D::error("negative-effect", format!("the damping of the base is negative: {value:?}"))
        .detail("it would drive the motion instead of resisting it")
        .help("write its magnitude: the base feels -d v and -d ω")
}

/// Friction of a base that does not move.
pub fn damped_base_stands(value: f64) -> D {
    D::error("damped-base-stands", format!("the base has a damping of {value:?}, and does not move"))
        .detail("the damping acts on the velocities of a base that floats")
        .help("leave it out, or write `base = \"floating\"`")
}

/// A time constant and a damping ratio with which nothing swings.
pub fn no_oscillation(owner: &str, [time_constant, damping_ratio]: [f64; 2]) -> D {
    D::error("no-oscillation", format!("springdamper of {owner}: {time_constant:?} s and {damping_ratio:?}"))
        .detail("a time constant and a damping ratio are positive")
        .help("write both above zero, or `stiffness` and `damping` in their place")
}

/// A spring and a damper that no joint has.
pub fn no_spring_of_oscillation(joint: &str, [stiffness, damping]: [f64; 2]) -> D {
    D::error("no-oscillation", format!("joint `{joint}` cannot swing as its `springdamper` says"))
        .detail(format!(
            "of the inertia that it feels a stiffness {stiffness:e} and a damping {damping:e} would be made"
        ))
        .help("give what it moves mass and inertia, or write `stiffness` and `damping` in its place")
}

/// A gear that stands still.
pub fn gear_ratio_zero(joint: &str) -> D {
    D::error("gear-ratio-zero", format!("the gear ratio of joint `{joint}` is zero"))
        .help("write rotor speed over joint speed, such as 100.0")
}

/// A gear without a rotor.
pub fn gear_ratio_alone(joint: &str) -> D {
    D::warning("gear-ratio-alone", format!("joint `{joint}` has a `gear_ratio` and no `rotor_inertia`"))
        .detail("taken as a rotor without inertia: the gear ratio changes nothing")
}

// --- the tree ---

/// A robot without links.
pub fn no_links(robot: &str) -> D {
    D::error("no-links", format!("robot `{}` has no links", cut(robot)))
}

/// A robot with more links than can be compiled.
pub fn too_many_links(links: usize, limit: usize) -> D {
    D::error("too-many-links", format!("the robot has {links} links; at most {limit} are compiled"))
}

/// A robot that does not move.
pub fn nothing_moves(robot: &str) -> D {
    D::error("nothing-moves", format!("robot `{}` has no joint that moves, and its base is fixed", cut(robot)))
        .help("ask for a floating base if the robot is one free body: `{option}`, or `base = \"floating\"` in TOML")
        .option("floating_base", None)
}

/// A name that is in use.
pub fn duplicate_name(what: &str, name: &str) -> D {
    D::error("duplicate-name", format!("a second {what} is named `{}`", cut(name))).help("give each its own name")
}

/// A link that is not there.
pub fn unknown_link<'a>(owner: &str, link: &str, links: impl IntoIterator<Item = &'a str>) -> D {
    let d = D::error("unknown-link", format!("{owner}: there is no link `{}`", cut(link)));
    match did_you_mean(link, links) {
        Some(hint) => d.help(hint),
        None => d,
    }
}

/// A frame that is asked for and not there.
pub fn unknown_frame<'a>(frame: &str, frames: impl IntoIterator<Item = &'a str>) -> D {
    let d = D::error("unknown-frame", format!("the robot has no frame `{}`", cut(frame)));
    match did_you_mean(frame, frames) {
        Some(hint) => d.help(hint),
        None => d,
    }
}

/// A link that is the child of two joints.
pub fn two_parents(link: &str, first: &str, second: &str) -> D {
    D::error("two-parents", format!("link `{link}` is the child of joint `{second}` and of joint `{first}`"))
        .detail("the links of a robot form a tree, and what closes a loop is said apart: `[[loop]]` in TOML, `equality` in MJCF, in SDF a ball joint, a hinge or a fixed joint")
}

/// Several links without a parent.
pub fn two_roots(roots: &[&str]) -> D {
    D::error("two-roots", format!("the robot has {} root links: {}", roots.len(), list(roots)))
        .detail("exactly one link is the child of no joint")
        .help("connect the others with joints (`fixed` if they do not move), or remove them")
}

/// Links that carry each other.
pub fn cycle(joints: &[&str]) -> D {
    D::error("cycle", format!("joints form a cycle: {}", list(joints)))
        .detail("the links of a robot form a tree with one root")
}

// --- masses, inertias, axes, limits, angles ---

/// A mass below zero.
pub fn negative_mass(link: &str, mass: f64) -> D {
    D::error("negative-mass", format!("the mass of link `{link}` is negative: {mass:?} kg"))
}

/// An axis without direction.
pub fn zero_axis(what: &str) -> D {
    D::error("zero-axis", format!("{what} is zero: it has no direction"))
        .help("write a vector along the axis, as in `0 0 1`")
}

/// An axis far from unit length.
pub fn axis_length(what: &str, length: f64) -> D {
    D::warning("axis-length", format!("{what} has length {length:.6}, not 1"))
        .detail("taken as a direction: it is normalised, coordinate and limits are not scaled")
}

/// A revolute or prismatic joint without limits.
pub fn limits_missing(joint: &str, kind: &str, help: &str) -> D {
    D::warning("limits-missing", format!("{kind} joint `{joint}` has no limits"))
        .detail("taken as unlimited")
        .help(help)
}

/// Lower limit above the upper one.
pub fn limits_reversed(joint: &str, lower: f64, upper: f64) -> D {
    D::warning("limits-reversed", format!("the lower limit of joint `{joint}` is above the upper one"))
        .detail(format!("{lower:?} > {upper:?}; both are kept as they are"))
}

/// A greatest speed or torque below zero.
pub fn negative_limit(joint: &str, what: &str, value: f64) -> D {
    D::warning("negative-limit", format!("the {what} limit of joint `{joint}` is negative: {value:?}"))
        .detail("its magnitude is taken")
}

/// Mass without inertia.
pub fn point_mass(link: &str) -> D {
    D::warning("point-mass", format!("link `{link}` has a mass and no inertia"))
        .detail("taken as a point mass in its centre of mass")
}

/// Inertia without mass.
pub fn inertia_without_mass(link: &str) -> D {
    D::warning("inertia-without-mass", format!("link `{link}` has an inertia and no mass"))
        .detail("taken as written: mass 0; no body is like that, some published models are")
}

/// A tensor with a negative principal moment.
pub fn negative_moment(link: &str, moments: [f64; 3]) -> D {
    let [a, b, c] = moments.map(six_digits);
    D::warning("negative-moment", format!("the inertia of link `{link}` cannot belong to a rigid body"))
        .detail(format!("its principal moments are {a}, {b}, {c}: one is negative; taken as written"))
        .help("the mass matrix may become indefinite; check signs and order of the six numbers")
}

/// A tensor that violates the triangle inequality.
pub fn triangle_inequality(link: &str, moments: [f64; 3]) -> D {
    let [a, b, c] = moments.map(six_digits);
    D::warning("triangle-inequality", format!("the inertia of link `{link}` cannot belong to a rigid body"))
        .detail(format!("{c} > {a} + {b}: a principal moment exceeds the sum of the other two; taken as written"))
        .help("moments are taken about the centre of mass; is this one about the joint, or does it hold a rotor's?")
}

/// A moving link whose mass is written as zero.
pub fn zero_mass(link: &str) -> D {
    D::warning("zero-mass", format!("the mass of link `{link}` is zero, and it moves")).detail("taken as written")
}

/// A joint that feels no inertia.
pub fn singular_joint(joint: &str, what: &str) -> D {
    D::warning("singular-joint", format!("joint `{joint}` moves no {what}"))
        .detail("the mass matrix is singular: there is no forward dynamics; inverse dynamics is not affected")
        .help(
            "give the links that it moves their mass and inertia or the joint a rotor inertia, or make the joint fixed",
        )
}

/// What divides by what joints feel, of a robot with a joint that feels no inertia. `asked`: in words, what is asked for.
pub fn no_forward_dynamics(asked: &str, joint: &str) -> D {
    D::error("no-forward-dynamics", format!("{asked} asked for, and joint `{joint}` feels no inertia"))
        .detail("with the joints beyond it free nothing resists its motion: the equations would divide by zero")
        .help(
            "give the joint a rotor inertia (TOML: `rotor_inertia` or `armature`) or its links their mass and inertia, make it \
             fixed, or name the functions that are wanted without `forward_dynamics`",
        )
}

/// What divides by what a joint feels, where that is lost in what the joint moves: `part` of it.
pub fn inertia_beyond_digits(function: &str, scalar: &str, joint: &str, part: f64) -> D {
    D::error(
        "no-forward-dynamics",
        format!("`{function}` cannot be computed in {scalar}: joint `{joint}` feels {part:.0e} of the inertia that it moves"),
    )
    .detail(format!(
        "with the joints beyond it free that is all that resists its motion, a difference of inertias of which {scalar} keeps no digit"
    ))
    .help(
        "look whether all masses are in kg and all lengths in m; make the joint fixed, or name the functions that are wanted without \
         `forward_dynamics`",
    )
}

/// What divides by the mass of a robot that has none. `asked`: in words, what is asked for.
pub fn no_mass(asked: &str) -> D {
    D::error("no-mass", format!("{asked} asked for, and nothing that moves has mass"))
        .detail("the centre of mass of no mass is nowhere: the equations would divide by zero")
        .help("give the links their mass (URDF: `<inertial>`), or name the functions that are wanted without these")
}

/// The centre of mass of what a joint moves, where that has none.
pub fn no_mass_behind(function: &str, joint: &str) -> D {
    D::error("no-mass", format!("`{function}` is asked for, and nothing that joint `{joint}` moves has mass"))
        .detail("the centre of mass of no mass is nowhere: the equations would divide by zero")
        .help("give the links behind the joint their mass (URDF: `<inertial>`), or lock the joint (`[hold] joints`)")
}

/// What divides by what joints feel, of a robot with a joint that feels what run-time parameters bring and nothing else.
pub fn inertia_by_parameters(asked: &str, joint: &str, parameters: &str) -> D {
    D::warning("inertia-by-parameters", format!("joint `{joint}` feels no inertia but that of {parameters}"))
        .detail(format!(
            "{asked} asked for, which divides by it: of a parameter without inertia what comes out is not finite"
        ))
        .help("give the links themselves some inertia, or make sure that what is passed has mass")
}

/// So many angles that may be meant as right angles; the one farthest from it is off by `deviation` \[rad\].
pub fn near_right_angle(count: usize, deviation: f64) -> D {
    let (angles, all, them) = match count {
        1 => ("an angle is a right one".to_string(), "it", "it"),
        n => (format!("{n} angles are right ones"), "them all", "them"),
    };
    D::warning("near-right-angle", format!("{angles} only to {:.1e} rad, taken as written", deviation.abs()))
        .help(format!("`{{option}}` takes {all} as exact, `straightline check` lists {them}"))
        .option("angle_tolerance", Some(format!("{:e}", tolerance_above(deviation))))
        .brief()
}

/// The least power of ten above |x|.
pub(crate) fn tolerance_above(x: f64) -> f64 {
    let powers =
        ["1e-16", "1e-15", "1e-14", "1e-13", "1e-12", "1e-11", "1e-10", "1e-9", "1e-8", "1e-7", "1e-6", "1e-5"];
    let powers = powers.into_iter().chain(["1e-4", "1e-3", "1e-2", "0.1"]).map(|text| text.parse().expect("a number"));
    powers.into_iter().find(|power| x.abs() < *power).unwrap_or(1.0)
}

/// A floating base by option, a fixed one by file.
pub fn floating_by_option() -> D {
    D::warning("floating-by-option", "the file says that the base is fixed, an option that it floats")
        .detail("the option was taken")
}

// --- options ---

/// A joint order with a name that is none.
pub fn joint_order_unknown<'a>(name: &str, joints: impl IntoIterator<Item = &'a str>) -> D {
    let d = D::error("joint-order-unknown", format!("joint order: no moving joint is named `{}`", cut(name)));
    match did_you_mean(name, joints) {
        Some(hint) => d.help(hint),
        None => d,
    }
}

/// A joint order with a name that stands twice.
pub fn joint_order_twice(name: &str) -> D {
    D::error("joint-order-twice", format!("joint order: `{}` stands twice", cut(name)))
}

/// A joint order with joints left out.
pub fn joint_order_missing(names: &[&str]) -> D {
    D::error("joint-order-missing", format!("joint order: {} left out", list(names)))
        .help("name every joint that moves once")
}

/// An option with a value that cannot be.
pub fn bad_option(option: &str, value: &str, expected: &str) -> D {
    D::error("bad-option", format!("{option}: `{}` is not {expected}", cut(value)))
}

/// A gravity that is neither none nor one.
pub fn gravity_out_of_range(value: &str, expected: &str) -> D {
    D::error("out-of-range", format!("gravity: {value} is not {expected}")).help("write [0.0, 0.0, 0.0] for none")
}

// --- the chapter's notation ---

/// A vector that is parallel with the joint axis and cannot define the zero of the coordinate.
pub fn specificity(owner: &str, vector: &str, axis: &str, star: &str, has_star: bool) -> D {
    let which = if has_star { star } else { vector };
    let d = D::error("specificity", format!("{owner}: `{which}` is parallel with `{axis}`"))
        .detail("it defines where the coordinate is zero, (20.101), and must have a part across the axis");
    if has_star {
        d.help(format!("choose `{star}` across the axis, best perpendicular to it"))
    } else {
        d.help(format!("this is a specificity: add `{star}`, a unit vector perpendicular to `{axis}`"))
    }
}

/// A linear joint without its constant angle.
pub fn alpha_missing(joint: &str) -> D {
    D::warning("alpha-missing", format!("linear joint `{joint}` has no `alpha`"))
        .detail("taken as 0: the link stands as in the extended position")
        .help("write `alpha = 0.0`, or the angle by which the link is turned about the axis")
}

/// A revolute joint with a constant angle.
pub fn alpha_on_revolute(joint: &str) -> D {
    D::error("alpha-on-revolute", format!("revolute joint `{joint}` has an `alpha`"))
        .detail("alpha is the constant angle of a linear joint; a revolute joint has q there")
        .help("remove it, or write `type = \"linear\"`")
}

/// An axis beyond the last link.
pub fn e_next_on_last(link: &str, key: &str) -> D {
    D::warning("e-next-on-last", format!("`{key}` of the last link `{link}` is ignored"))
        .detail("there is no further joint")
}

/// A number of a drive that cannot be.
pub fn drive_number(what: &str, value: f64, be: &str, help: &str) -> D {
    D::error("drive-number", format!("{what} is {value:?}; it must be {be}")).help(help)
}

/// A drive of a joint that is not there, or does not move.
pub fn drive_joint<'a>(owner: &str, joint: &str, joints: impl IntoIterator<Item = &'a str>) -> D {
    let joints: Vec<&str> = joints.into_iter().collect();
    let d = D::error("drive-joint", format!("{owner}: no moving joint is named `{}`", cut(joint)));
    match did_you_mean(joint, joints.iter().copied()) {
        Some(hint) => d.help(hint),
        None => d.help(format!("there are {}", list(&joints))),
    }
}

/// Drives whose ratios are dependent.
pub fn drive_coupling(name: &str, joints: &[&str]) -> D {
    D::error(
        "drive-coupling",
        format!("the ratios of drive `{}` and of those coupled with it are dependent", cut(name)),
    )
    .detail(format!("their matrix is singular: they turn together, whatever {} do", list(joints)))
    .help("check signs and factors of `joints`, or leave a drive out")
}

/// A linear actuator whose matrices do not fit.
pub fn actuator_shape(owner: &str, n: usize) -> D {
    D::error("actuator-shape", format!("the matrices of the {owner} do not fit each other"))
        .detail(format!(
            "f has {n} entries: C must have as many rows and columns, and d, T and `position` as many entries"
        ))
        .help("one entry per state of the actuator")
}

/// A linear actuator that moves nothing, or that nothing moves.
pub fn actuator_inert(owner: &str, what: &str, help: &str) -> D {
    D::error("actuator-inert", format!("the actuator of {owner}: {what}")).help(help)
}

/// A shaft that does not give way, geared to several joints.
pub fn unyielding_joints(name: &str, joints: usize) -> D {
    D::error(
        "unyielding-joints",
        format!("drive `{}` turns {joints} joints, and T f = 0: its shaft does not give way", cut(name)),
    )
    .detail("the shaft's motion does not say what each of the joints does")
    .help("give each joint a drive of its own, an elastic stage between, or in f −1/J in the row of the shaft's speed")
}

/// Two shafts that do not give way on one joint.
pub fn unyielding_twice(name: &str, other: &str) -> D {
    D::error(
        "unyielding-joints",
        format!("drives `{}` and `{}` turn one joint, and T f = 0 in both", cut(other), cut(name)),
    )
    .detail("neither shaft gives way: two motions are asked of one joint")
    .help("leave one out, put an elastic stage between, or give one in f −1/J in the row of the shaft's speed")
}

/// A shaft between two springs that has no inertia.
pub fn shaft_without_inertia(name: &str) -> D {
    D::error(
        "shaft-without-inertia",
        format!("drive `{}`: the shaft before this elastic stage has no inertia", cut(name)),
    )
    .detail("its acceleration would be torque over zero")
    .help("give `input_inertia` or `output_inertia`, or join both springs: 1/c = 1/c₁ + 1/c₂")
}

// --- what gives way ---

/// A number of a flexible link or a support that cannot be.
pub fn elastic_number(what: &str, value: &str, be: &str, help: &str) -> D {
    D::error("elastic-number", format!("{what} is {value}; it must be {be}")).help(help)
}

/// A flexible link without a proper axis.
pub fn flexible_axis(link: &str, why: &str) -> D {
    D::error("flexible-axis", format!("the axis of the flexible link `{}`: {why}", cut(link)))
        .help("`from` is the end at the joint that carries the link, `to` the other end, in the link frame in m")
}

/// Bending about an axis that is not across.
pub fn flexible_bending(link: &str, axis: &str) -> D {
    D::error("flexible-bending", format!("link `{}` cannot bend about its {axis} axis", cut(link)))
        .detail("that axis is not perpendicular to the one from `from` to `to`")
        .help("write one number for a cross-section that is round, or lay the link frame along the beam; `torsion` is about its axis")
}

/// A flexible link that nothing can bend.
pub fn flexible_rigid(link: &str) -> D {
    D::error("flexible-rigid", format!("the flexible link `{}` has no stiffness", cut(link)))
        .help("give `bending` (EI in N·m²), `torsion` (GJ in N·m²), or both; without `flexible` a link is rigid")
}

/// A flexible link whose mass is elsewhere.
pub fn flexible_mass(link: &str, begins: f64, ends: f64) -> D {
    let (begins, ends) = (six_digits(begins), six_digits(ends));
    D::warning("flexible-mass", format!("the mass of the flexible link `{}` is not spread over its axis", cut(link)))
        .detail(format!("as that of a uniform rod it lies between {begins} and {ends} of the way from `from` to `to`"))
        .help("write what sits at its ends as links of their own, on fixed joints; a uniform rod has m L²/12 about its middle")
}

/// A support that does not give way.
pub fn support_rigid() -> D {
    D::error("support-rigid", "the support does not give way in any direction")
        .help("write `z = { stiffness = 1e5, damping = 200.0 }`, or another of x, y, z, rx, ry, rz; without [support] the base is rigid")
}

/// A support below a base that is not fixed.
pub fn support_floats() -> D {
    D::error("support-floats", "a base that moves freely, or as it is told, stands on no support")
        .help("remove [support], or leave the base fixed")
}
