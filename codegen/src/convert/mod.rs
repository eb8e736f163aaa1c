//! From one format of robot files to another: the same robot, or a list of what the other format cannot say.
//!
//! ```text
//! file → Description → without what the format has no place for → joints as the format has them → text
//!                              |                                                                   |
//!                            Model  ← compared, number by number →  Model  ←  read back ← ─────────┘
//! ```
//!
//! A text that is returned was read back by the format's own reader, and is the same robot: the same joints in the same order, the same
//! limits, effects, couplings and drives, every frame, and masses and poses to [`compare::ROUNDING`].

pub mod compare;
pub mod forms;
mod loops;
pub mod messages;
pub mod renumber;
mod springs;

use crate::description::write::losses::{Loss, LossWeight};
use crate::description::write::FormatWriter;
use crate::description::{self, BaseKind, Description, FileFormat, Noted, FORMATS};
use crate::diagnostic::{Diagnostics, Source};
use crate::model::{self, ModelOptions};

/// What is asked for beside the format.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ConvertOptions {
    /// The root link moves freely, whatever the file says.
    pub floating_base: bool,
    /// What changes the motion and cannot be said is left out, with a warning, instead of being an error.
    pub lossy: bool,
}

/// The formats that are written, with their writers.
pub fn written_formats() -> impl Iterator<Item = (&'static FileFormat, &'static FormatWriter)> {
    FORMATS.iter().filter_map(|format| Some((*format, format.write?)))
}

/// The format that a word of the command line means.
pub fn format_of_word(word: &str) -> Option<&'static FileFormat> {
    written_formats().find(|(_, writer)| writer.word == word).map(|(format, _)| format)
}

/// The format that a file is to have by its name.
pub fn format_of_path(path: &str) -> Option<&'static FileFormat> {
    let extension = path.rsplit_once('.')?.1.to_ascii_lowercase();
    written_formats().find(|(_, writer)| writer.extensions.contains(&extension.as_str())).map(|(format, _)| format)
}

/// A robot file as text of another format. What is lost, or said in another way, is added to the diagnostics; `None` after an error.
///
/// ```
/// use straightline_codegen::convert::{convert, format_of_word, ConvertOptions};
/// use straightline_codegen::diagnostic::{Diagnostics, Source};
/// let arm = r#"<robot name="arm"><link name="base"/><link name="upper"><inertial><mass value="2"/>
///     <inertia ixx="0.1" iyy="0.2" izz="0.15"/></inertial></link><joint name="shoulder" type="continuous">
///     <parent link="base"/><child link="upper"/><origin xyz="0 0 0.1" rpy="1.5707963267948966 0 0"/></joint></robot>"#;
/// let mut said = Diagnostics::new();
/// let mjcf = format_of_word("mjcf").unwrap();
/// let text = convert(&Source::new("arm.urdf", arm), mjcf, ConvertOptions::default(), &mut said).unwrap();
/// assert!(text.contains(r#"<body name="upper" pos="0 0 0.1" euler="1.5707963267948966 0 0">"#), "{text}");
/// assert!(said.is_empty(), "{said}");
/// ```
pub fn convert(
    source: &Source,
    format: &'static FileFormat,
    options: ConvertOptions,
    diagnostics: &mut Diagnostics,
) -> Option<String> {
    let robot = description::read(source, diagnostics)?;
    written(robot, format, options, diagnostics)
}

/// The text of a robot in a format.
fn written(
    mut robot: Description,
    format: &'static FileFormat,
    options: ConvertOptions,
    diagnostics: &mut Diagnostics,
) -> Option<String> {
    // what is wrong with the robot is said before what the format cannot say
    let model_options = ModelOptions { floating_base: options.floating_base, ..ModelOptions::default() };
    let model = model::build(&robot, &model_options, diagnostics)?;
    if options.floating_base {
        robot.base = Some(Noted::assumed(BaseKind::Floating));
    }
    let Some(writer) = format.write else {
        diagnostics.push(messages::not_written(format.name));
        return None;
    };
    by_magnitudes(&mut robot);
    springs::by_numbers(&mut robot, &model);
    loops::by_frames(&mut robot, &model, writer.loops);
    for loss in writer.losses {
        lose(loss, format, options.lossy, &mut robot, diagnostics);
    }
    if diagnostics.has_errors() {
        return None;
    }
    let (text, difference) = text_of(&robot, format, writer);
    match difference {
        None => Some(text),
        Some(difference) => {
            diagnostics.push(messages::not_as_read(format.name, &difference).at(&robot.name.place));
            None
        }
    }
}

/// Of limits that are negative the magnitude was read, with a warning.
fn by_magnitudes(robot: &mut Description) {
    let limits = robot.joints.iter_mut().map(|joint| &mut joint.limits);
    for limit in limits.flat_map(|limits| [&mut limits.velocity, &mut limits.effort]).flatten() {
        limit.value = limit.value.abs();
    }
}

/// Says what is lost, and takes it away.
fn lose(loss: &Loss, format: &FileFormat, lossy: bool, robot: &mut Description, diagnostics: &mut Diagnostics) {
    let found = (loss.find)(robot);
    let Some((_, first)) = found.first() else { return };
    let says = match loss.weight {
        LossWeight::Dynamics if !lossy => messages::not_in_format,
        LossWeight::Dynamics | LossWeight::Data => messages::left_out,
        LossWeight::Form => messages::said_otherwise,
    };
    diagnostics.push(says(format.name, loss, &found).at(first));
    (loss.remove)(robot);
}

/// The text of a robot, and in what it differs when it is read again.
fn text_of(robot: &Description, format: &FileFormat, writer: &FormatWriter) -> (String, Option<String>) {
    let formed = match forms::formed(robot, writer) {
        Some(formed) => formed,
        None => return (String::new(), Some("a joint stands nowhere".to_string())),
    };
    let text = (writer.text)(&formed);
    let difference = compare::difference(robot, &text, format, writer);
    (text, difference)
}
