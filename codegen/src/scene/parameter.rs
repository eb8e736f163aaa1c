//! Run-time parameters.

use super::free_drive::FreeDrive;
use crate::description::drives::WrittenDrive;
use crate::identifier::{doc, identifier, upper_camel_case};
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_graph::expr::Port;

/// Scalars of a run-time load: its ten parameters in the canonical frame, then in the reduced robot's frame.
const LOAD_SCALARS: usize = 20;

/// Constants of the robot that stay inputs.
#[derive(Clone, Debug, PartialEq)]
pub enum Parameter {
    /// The ten inertial parameters of a payload in a frame.
    Payload {
        /// Name of the input.
        name: String,
        /// The frame that carries it.
        frame: String,
    },
    /// The ten inertial parameters of a link, in place of the file's.
    Link {
        /// The link.
        link: String,
    },
    /// Numbers of a drive, in place of the file's.
    Drive {
        /// Name of the input; the drive's where it has none.
        name: Option<String>,
        /// The drive.
        drive: String,
        /// Which numbers: names of [`WrittenDrive::numbers`].
        numbers: Vec<String>,
        /// The drive as written, with what the scene leaves of its effects; [`Scene::knowing`](crate::scene::Scene::knowing) finds it.
        form: Option<Box<WrittenDrive>>,
    },
}

impl Parameter {
    /// Whether it is of that drive.
    pub(crate) fn is_of_drive(&self, name: &str) -> bool {
        matches!(self, Parameter::Drive { drive, .. } if drive == name)
    }

    /// Whether it is the inertia of a body.
    pub(crate) fn is_load(&self) -> bool {
        !matches!(self, Parameter::Drive { .. })
    }

    /// Its name as it is given: that of the payload, of the link, or of the drive.
    pub fn name(&self) -> &str {
        match self {
            Parameter::Payload { name, .. } => name,
            Parameter::Link { link } => link,
            Parameter::Drive { name, drive, .. } => name.as_ref().unwrap_or(drive),
        }
    }

    /// Name of the input.
    pub fn input_name(&self) -> String {
        identifier(self.name(), "body")
    }

    /// Name of the input's type.
    pub fn type_name(&self) -> String {
        upper_camel_case(&self.input_name())
    }

    /// What functions take of it, in words.
    pub fn in_words(&self) -> String {
        match self {
            Parameter::Drive { drive, numbers, .. } => {
                format!("drive `{}` with its {}", doc(drive), numbers.join(", "))
            }
            _ => "inertial parameters of a body that the robot carries".to_string(),
        }
    }

    /// The frame in which inertial parameters are given; `None` of a drive.
    pub fn frame(&self) -> Option<&str> {
        match self {
            Parameter::Payload { frame, .. } => Some(frame),
            Parameter::Link { link } => Some(link),
            Parameter::Drive { .. } => None,
        }
    }

    /// The body that carries it; `None` if it stands on the world, or is none of a body.
    pub fn body(&self, model: &Model<Dd>) -> Option<usize> {
        model.frame(self.frame()?).and_then(|f| f.body)
    }

    /// Whether something of a robot depends on it.
    pub fn is_of(&self, model: &Model<Dd>) -> bool {
        match self {
            Parameter::Drive { drive, .. } => model.drives.iter().any(|d| d.name == *drive),
            _ => self.body(model).is_some(),
        }
    }

    /// How many scalars functions take.
    pub fn scalars(&self, model: &Model<Dd>) -> usize {
        match self {
            Parameter::Drive { .. } => FreeDrive::new(self, model).map_or(0, |drive| drive.scalars()),
            _ => LOAD_SCALARS,
        }
    }

    /// What its constructor takes.
    pub fn given(&self) -> Vec<Port> {
        match self {
            Parameter::Drive { numbers, .. } => vec![Port::new("numbers", &[numbers.len()])],
            _ => vec![Port::new("mass", &[1]), Port::new("com", &[3]), Port::new("inertia", &[6])],
        }
    }
}
