//! The codes of all complaints: how bad each is by default, and what it is about, in a sentence.

use super::Severity::{self, Error, Note, Warning};

/// One kind of complaint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    /// The code, as it stands in `error[negative-mass]`.
    pub code: &'static str,
    /// How bad it is unless a level says otherwise.
    pub severity: Severity,
    /// What it is about, in a sentence.
    pub sentence: &'static str,
    /// Whether it is said whatever the levels are: it is no matter of the robot, but says that this program has failed.
    pub is_firm: bool,
}

/// The code of that name.
pub fn find(code: &str) -> Option<&'static Code> {
    ALL.iter().find(|c| c.code == code)
}

/// Whether a complaint of that code is said whatever the levels are.
pub fn is_firm(code: &str) -> bool {
    find(code).is_some_and(|c| c.is_firm)
}

/// All of them, in the order of the alphabet.
pub const ALL: &[Code] = &[
    code("actuator-inert", Error, "A linear actuator that moves nothing, or that nothing moves."),
    code("actuator-shape", Error, "A linear actuator whose matrices do not fit."),
    code("alpha-missing", Warning, "A linear joint without its constant angle."),
    code("alpha-on-revolute", Error, "A revolute joint with a constant angle."),
    code("angle-beyond-sines", Error, "An angle of an experiment that no sine answers for."),
    code("axis-length", Warning, "An axis far from unit length."),
    code("bad-option", Error, "An option with a value out of its range."),
    code("base-floats", Error, "A motion of a robot whose base floats."),
    code("base-locked", Error, "A lock on the joint of a floating base."),
    code("budget-alone", Error, "A budget for what is not generated."),
    code("cannot-stick", Error, "A contact that cannot stick in a mode."),
    code("column-missing", Error, "A column that is needed and is not there."),
    code("column-unknown", Error, "A column that belongs to nothing."),
    code("contact-name", Error, "A name of a contact, a loop or a mode that makes no identifier of its own."),
    code("contact-on-world", Error, "A contact of what does not move."),
    code("contact-twice", Error, "A contact of which is said something twice."),
    code("controller-and-torques", Error, "Two things that drive one robot."),
    code("coordinate-twice", Error, "A coordinate named twice, or as constrained and as free."),
    code("coulomb-speed-alone", Error, "A width of what is not smooth."),
    code("coulomb-speed-missing", Error, "Smooth friction without a width."),
    code("coupled-twice", Error, "A joint that follows two others."),
    code("coupling-cycle", Error, "Joints that follow each other in a circle."),
    code("damped-base-stands", Error, "A damping of a base that does not move."),
    code("loop-within-body", Error, "A loop whose points belong to one body."),
    code("loop-open", Error, "A loop that cannot be closed."),
    code("loop-locked", Error, "A loop that leaves none of its joints a motion."),
    code("loop-joint", Error, "A joint that is not on the loop that is to determine it."),
    code("loop-joint-determined", Error, "A joint that is to be determined by loops which leave it no freedom to follow them."),
    code("loop-assembly", Error, "An assembly by name of a loop that closes in steps."),
    code("loops-depend", Error, "Loops whose equations depend on each other."),
    code("no-oscillation", Error, "A time constant and a damping ratio with which nothing swings."),
    code("not-on-loops", Error, "Something of a scene that robots with closed loops do not take."),
    code("determined-joint", Error, "A joint that loops determine, where one with a velocity of its own is meant."),
    code("coupling-joint", Error, "A coupling of a joint that is not there, or has not one coordinate."),
    code("coupling-ratio-zero", Error, "A coupling with the ratio zero."),
    code("current-without-motor", Error, "A current for an actuator that is no motor."),
    code("cycle", Error, "Links that carry each other."),
    code("default-inertial", Warning, "A link that has the inertia that its format gives to all that say none."),
    code("determined-moving", Error, "A motion of a joint that loops determine."),
    code("drive-coupling", Error, "Drives whose ratios are dependent."),
    code("drive-given-twice", Error, "Two parameters for one drive."),
    code("drive-joint", Error, "A drive of a joint that is not there, or does not move."),
    code("drive-number", Error, "A number of a drive that no drive has."),
    code("drive-number-fixed", Error, "A number of a drive that is no parameter, as the equations have another form at its value in the file."),
    code("drive-number-twice", Error, "A number of a drive that is a parameter twice."),
    code("drive-states", Error, "A state of the drives of another length."),
    code("duplicate-name", Error, "A name that another one of the same kind has."),
    code("e-next-on-last", Warning, "An axis beyond the last link."),
    code("elastic-follower", Error, "An elastic drive of a joint that follows another one with an offset."),
    code("elastic-number", Error, "A number of a flexible link or a support that none has."),
    code("empty-mode", Error, "A mode in which nothing is closed."),
    code("empty-name", Error, "A name without characters."),
    code("empty-range", Error, "A range without a value."),
    code("error-budget-count", Error, "A budget of errors with too many numbers, or too few."),
    code("error-budget-output", Error, "A budget of errors for what is no output."),
    code("error-over-budget", Error, "Bounds of rounding errors that are greater than they may be."),
    code("error-unbounded", Error, "Rounding errors that have no bound, where one is demanded."),
    code("extension-left-out", Warning, "Dynamics in an extension of a robot file that is not read."),
    code("figure-unknown", Error, "A budget of what machine code does not say."),
    code("figures-elsewhere", Error, "Figures of machine code that needs more than `core`."),
    code("file-too-large", Error, "A file larger than the readers take."),
    code("flexible-axis", Error, "A flexible link without a proper axis."),
    code("flexible-bending", Error, "Bending about an axis that is not across."),
    code("flexible-mass", Warning, "A flexible link whose mass is elsewhere."),
    code("flexible-rigid", Error, "A flexible link that nothing can bend."),
    code("fixed-error", Error, "An error that fixed point does not keep to."),
    code("fixed-impossible", Error, "A function that has no form in fixed point."),
    code("fixed-range-missing", Error, "An input without a range, of a function in fixed point."),
    code("floating-by-option", Warning, "A floating base by option, a fixed one by file."),
    code("floating-joint", Error, "A floating joint."),
    code("following-joint", Error, "A joint that is asked for, and follows another one."),
    code("frame-cycle", Error, "Frames that stand in each other."),
    code("frame-unknown", Error, "A frame that a file of frames does not have."),
    code("function-not-of-robot", Error, "A function about something that the robot does not have."),
    code("function-not-of-scene", Error, "A function about bodies that are inputs, in a scene without one."),
    code("gear-ratio-alone", Warning, "A gear without a rotor."),
    code("gear-ratio-zero", Error, "A gear that stands still."),
    code("geom-size", Error, "A geom without a proper size, of which an inertia is made."),
    code("idle-drive", Error, "A parameter of a drive whose joints do not move."),
    code("include-failed", Error, "A file that is included and cannot be."),
    code("inertia-by-parameters", Warning, "What divides by what joints feel, of a robot with a joint that feels what run-time parameters bring and nothing else."),
    code("inertia-without-mass", Warning, "Inertia without mass."),
    code("inputs-do-not-follow", Error, "Drives whose inputs no motion gives."),
    code("internal-disagreement", Error, "No form of a program agrees with the plain one: a defect of the compiler."),
    code("internal-error", Error, "What was written is not what was meant: a defect of the compiler."),
    code("joint-order-follower", Error, "A joint order with a joint that follows another one."),
    code("joint-order-missing", Error, "A joint order with joints left out."),
    code("joint-order-twice", Error, "A joint order with a name that stands twice."),
    code("joint-order-unknown", Error, "A joint order with a name that no joint has."),
    code("left-open", Error, "What a scene leaves to the caller, and an experiment must say."),
    code("left-out", Warning, "Something of a robot that another format has no place for, and that was left out."),
    code("level-of-error", Error, "A level for a complaint that is an error whatever is said."),
    code("level-of-firm", Error, "A level that silences what is always said."),
    code("limbs-exact", Error, "Identical limbs as lanes where rules keep every bit."),
    code("limits-missing", Warning, "A revolute or prismatic joint without limits."),
    code("limits-reversed", Warning, "Lower limit above the upper one."),
    code("link-given-twice", Error, "Two parameters for one inertia."),
    code("locked-beyond-limits", Warning, "A value that the joint cannot reach."),
    code("locked-joint-wanted", Error, "A coordinate of a joint that has none in this scene."),
    code("locked-twice", Error, "A joint with two values."),
    code("loop-on-one-body", Error, "A loop between parts of one body."),
    code("mesh-failed", Error, "A mesh of which an inertia should be made, and cannot."),
    code("missing-attribute", Error, "An attribute that must be there."),
    code("missing-element", Error, "An element that must be there."),
    code("missing-key", Error, "A key that must be there."),
    code("misspelt-element", Warning, "An element that looks like a known one."),
    code("mixed-alone", Error, "Mixed precision for no demanded error."),
    code("mixed-elsewhere", Error, "Mixed precision where functions cannot have it."),
    code("more-complaints", Note, "A run of complaints was cut."),
    code("motion-missing", Error, "A controller that follows nothing."),
    code("moving-base-forward", Error, "Forward dynamics where the base's motion is given."),
    code("near-right-angle", Warning, "Angles that may be meant as right angles, and are taken as they are written."),
    code("negative-effect", Error, "Friction, an inertia or a stiffness below zero."),
    code("negative-limit", Warning, "A greatest speed or torque below zero."),
    code("negative-mass", Error, "A mass below zero."),
    code("negative-moment", Warning, "A tensor with a negative principal moment."),
    code("no-coordinate", Error, "A contact or a loop that holds nothing."),
    code("no-direction", Error, "A vector that gives no direction."),
    code("no-drives", Error, "A key for drives, of a robot without."),
    code("no-forward-dynamics", Error, "What divides by what joints feel, of a robot with a joint that feels no inertia. `asked`: in words, what is asked for."),
    code("no-free-number", Error, "A parameter of a drive without numbers."),
    code("no-identical-limbs", Error, "Identical limbs of a robot that has none."),
    code("no-limit", Error, "A joint without the limits that a trapezoid takes."),
    code("no-links", Error, "A robot without links."),
    code("no-machine-code", Error, "Figures of machine code that cannot be made."),
    code("no-mass", Error, "What divides by the mass of a robot that has none."),
    code("no-motion", Error, "Points that make no motion."),
    code("no-such-result", Error, "A result that a function does not have."),
    code("no-such-part", Error, "A part that the results of a function do not have."),
    code("no-surface", Error, "A quadric without a gradient."),
    code("not-a-number", Error, "Text where a number is wanted."),
    code("not-a-robot", Error, "XML, but not of a robot."),
    code("not-a-selection", Error, "Joints or frames of a function whose results are not by joints or frames."),
    code("not-as-read", Error, "A converted file that is not read as the same robot."),
    code("not-finite", Error, "NaN, or a number beyond f64."),
    code("not-in-format", Error, "Something that changes the motion of a robot, for which another format has no place."),
    code("not-in-range", Error, "A number out of its range."),
    code("not-samples", Error, "A file that is no table of numbers."),
    code("not-supported-yet", Error, "Something that changes the dynamics and is not part of the equations."),
    code("not-symmetric", Error, "An inertia matrix that is not symmetric."),
    code("not-utf8", Error, "Bytes that are not UTF-8."),
    code("not-written", Error, "A format in which no robot is written."),
    code("nothing-left", Error, "A robot that does not move any more."),
    code("nothing-moves", Error, "A robot that does not move."),
    code("nothing-slides", Error, "Friction without a surface to slide on."),
    code("nothing-yields", Error, "An environment without a distance."),
    code("number-beyond-scalar", Error, "A number of the robot that the scalar type cannot hold."),
    code("oblique-plane", Error, "A planar joint whose axis is none of its frame."),
    code("one-per-joint", Error, "A list of another length than that of the joints."),
    code("other-drives", Error, "A controller that knows other drives."),
    code("out-of-range", Error, "A finite number beyond anything a robot has."),
    code("over-budget", Error, "A function that costs more than it may."),
    code("parameter-name", Error, "A parameter whose name as an input is taken."),
    code("parameter-on-world", Error, "A parameter of what does not move."),
    code("payload-name-twice", Error, "A name for two payloads."),
    code("payload-on-world", Warning, "A payload that moves with nothing."),
    firm("plainer-form", Warning, "A program that did not agree with the plain one, for which a plainer form was taken."),
    code("point-mass", Warning, "Mass without inertia."),
    code("program-beyond-scalar", Error, "A constant of the generated code that the scalar type cannot hold."),
    code("range-alone", Error, "A range of what is no input."),
    code("regressor-of-several", Error, "Columns of regressors of what a joint of several coordinates adds."),
    code("regressor-unused", Error, "Columns of regressors where no regressor is made."),
    code("repeated-element", Error, "An element that may be there once."),
    code("said-by-the-scene", Error, "What a scene says, and an experiment may not."),
    code("said-otherwise", Note, "Something of a robot that another format says in another way."),
    code("said-twice", Error, "What the scene and an option beside it both say."),
    code("scalar-twice", Error, "A scalar type that is asked for twice."),
    code("sdf-version", Error, "A version of SDF whose elements may mean something else."),
    code("self-test-fused", Error, "A self-test of functions whose bits differ from machine to machine."),
    code("several-coordinates", Error, "What is of one coordinate, of a joint that has several."),
    code("several-locked", Error, "A lock on a joint that has several coordinates."),
    code("several-models", Error, "Models that move, each of which would be a robot."),
    code("several-moving", Error, "A motion of a joint that has several coordinates."),
    code("shaft-without-inertia", Error, "A shaft between two springs that has no inertia."),
    code("singular-joint", Warning, "A joint that feels no inertia."),
    code("specificity", Error, "A vector that is parallel with the joint axis and cannot define the zero of the coordinate."),
    code("support-floats", Error, "A support below a base that is not fixed."),
    code("support-rigid", Error, "A support that does not give way."),
    code("target-missing", Error, "Figures of machine code without a machine."),
    code("time-goes-back", Error, "A time that does not go on."),
    code("toml-syntax", Error, "Text that is not valid TOML."),
    code("too-complex", Error, "More of something than any robot file has."),
    code("too-many-links", Error, "A robot with more links than can be compiled."),
    code("triangle-inequality", Warning, "A tensor that violates the triangle inequality."),
    code("two-inputs", Error, "Two columns of one drive."),
    code("two-parents", Error, "A link that is the child of two joints."),
    code("two-roots", Error, "Several links without a parent."),
    code("unknown-attribute", Warning, "An attribute that the element does not have."),
    code("unknown-code", Error, "A level for a code that no complaint has."),
    code("unknown-contact", Error, "A mode with a contact that is not there."),
    code("unknown-contact-function", Error, "A function that contact modes do not have."),
    code("unknown-drive", Error, "A drive that is not there."),
    code("unknown-drive-number", Error, "A number that a drive does not have."),
    code("unknown-format", Error, "A text that is neither XML nor TOML of a robot."),
    code("unknown-frame", Error, "A frame that is asked for and not there."),
    code("unknown-joint", Error, "A joint that is not there, or does not move."),
    code("unknown-key", Error, "A key that the schema does not have."),
    code("unknown-link", Error, "A link that is not there."),
    code("unknown-moving-link", Error, "A link whose inertia cannot be an input by itself."),
    code("unknown-parameter", Error, "A parameter of a sweep that the robot file does not have."),
    code("unknown-scene-frame", Error, "A frame that is not there."),
    code("unknown-word", Error, "A word that is none of those known there."),
    code("unphysical-body", Error, "Mass and inertia that no body has."),
    code("unused-axis", Error, "An axis of a joint that turns about none alone."),
    code("unyielding-joints", Error, "A shaft that does not give way, geared to several joints."),
    code("urdf-loop", Error, "An element of a URDF that closes a loop or couples joints, of which there is no settled form."),
    code("written-twice", Error, "Two keys for the same thing."),
    code("wrong-count", Error, "Too many numbers in a list, or too few."),
    code("wrong-type", Error, "A value of another type."),
    code("xacro-left", Error, "Xacro that was not expanded."),
    code("xml-syntax", Error, "XML that is not well-formed."),
    code("zero-axis", Error, "An axis without direction."),
    code("zero-mass", Warning, "A moving link whose mass is written as zero."),
];

const fn code(code: &'static str, severity: Severity, sentence: &'static str) -> Code {
    Code { code, severity, sentence, is_firm: false }
}

const fn firm(code: &'static str, severity: Severity, sentence: &'static str) -> Code {
    Code { code, severity, sentence, is_firm: true }
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;
    use std::path::Path;

    /// Every `D::error("code", …)` of the tables of messages, with its severity.
    fn said() -> Vec<(String, Severity)> {
        let mut found = Vec::new();
        for table in ["src/description", "src/convert", "src/scene", "src/diagnostic", "cli/src/experiment"] {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("{table}/messages.rs"));
            let text = std::fs::read_to_string(path).expect("the table is there");
            for (call, severity) in [("D::error(", Error), ("D::warning(", Warning), ("D::note(", Note)] {
                for rest in text.split(call).skip(1) {
                    let code = rest.trim_start().strip_prefix('"').and_then(|rest| rest.split('"').next());
                    found.push((code.expect("a code comes first").to_string(), severity));
                }
            }
        }
        found
    }

    pub fn every_code_that_is_said_is_listed_with_its_severity() {
        let unlisted: Vec<_> =
            said().into_iter().filter(|(code, s)| find(code).is_none_or(|c| c.severity != *s)).collect();
        assert!(unlisted.is_empty(), "add to ALL: {unlisted:?}");
    }

    pub fn every_code_has_a_sentence() {
        for Code { code, sentence, .. } in ALL {
            assert!(sentence.ends_with('.') && sentence.starts_with(char::is_uppercase), "{code}: {sentence}");
        }
    }
}
