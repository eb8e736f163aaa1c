//! What a text is to compute: the programs that are written, by name.

use crate::description::drives::DriveNumber;
use crate::options::Options;
use crate::program::self_test::SelfTest;
use straightline_core::Dd;
use straightline_graph::expr::Graph;
use straightline_graph::Scalar;

/// A function that a text is to have.
#[derive(Clone, Debug)]
pub struct WrittenFunction {
    /// The identifier in the text.
    pub name: String,
    /// What it computes.
    pub graph: Graph,
    /// Its scalar type.
    pub scalar: Scalar,
    /// Whether it takes any scalar.
    pub generic: bool,
    /// Whether there is one over lanes beside it, in the file's scalar, and batches.
    pub lanes: bool,
    /// Whether it was asked for: it bounds no errors of another one, stores nothing for a stage, and makes no parameter.
    pub is_asked_for: bool,
}

impl WrittenFunction {
    /// A function in the forms that are asked for.
    pub(crate) fn asked_for(name: &str, graph: Graph, options: &Options) -> WrittenFunction {
        let (generic, lanes) = (options.generic, options.lanes.is_some());
        WrittenFunction { generic, lanes, is_asked_for: true, ..WrittenFunction::plain(name, graph, options.scalar) }
    }

    /// A function of one state and one scalar type, whatever is asked for.
    pub(crate) fn plain(name: &str, graph: Graph, scalar: Scalar) -> WrittenFunction {
        WrittenFunction { name: name.to_string(), graph, scalar, generic: false, lanes: false, is_asked_for: false }
    }
}

/// The type of a run-time parameter, and the program of its constructor.
#[derive(Clone, Debug)]
pub struct WrittenParameter {
    /// The name of the type.
    pub type_name: String,
    /// The private function.
    pub program: WrittenFunction,
    /// Of a drive, its free numbers.
    pub numbers: Option<DriveNumbers>,
}

/// The free numbers of a drive.
#[derive(Clone, Debug)]
pub struct DriveNumbers {
    /// What they are, with their values in the robot file.
    pub numbers: Vec<DriveNumber>,
    /// What functions take for the values of the robot file.
    pub nominal: Vec<Dd>,
}

/// A stage: a type around stored values.
#[derive(Clone, Debug)]
pub struct WrittenStage {
    /// The name of the type.
    pub type_name: String,
    /// The name of its values where others take them.
    pub values: String,
    /// What it stores.
    pub program: WrittenFunction,
}

/// The programs of a staged form.
#[derive(Clone, Debug)]
pub struct WrittenStages {
    /// The stages that store something, the rarest first.
    pub stages: Vec<WrittenStage>,
    /// The functions, each with the stage whose method it is.
    pub functions: Vec<(usize, WrittenFunction)>,
}

/// The programs of a contact mode.
#[derive(Clone, Debug)]
pub struct WrittenMode {
    /// Its module.
    pub identifier: String,
    /// Its constrained and its free coordinates.
    pub coordinates: [Vec<String>; 2],
    /// Its functions.
    pub functions: Vec<WrittenFunction>,
}

/// All programs that a text is to have.
#[derive(Clone, Debug, Default)]
pub struct AllWritten {
    /// The functions of the robot, and the bounds of their errors.
    pub functions: Vec<WrittenFunction>,
    /// Run-time parameters.
    pub parameters: Vec<WrittenParameter>,
    /// The staged form.
    pub staged: Option<WrittenStages>,
    /// Contact modes, in order.
    pub modes: Vec<WrittenMode>,
    /// What tests these functions on a machine, where that is asked for.
    pub self_test: Option<SelfTest>,
}

impl AllWritten {
    /// The functions of the robot, and of its contact modes with the mode's module, that were asked for.
    pub fn asked_for(&self) -> impl Iterator<Item = (Option<&str>, &WrittenFunction)> {
        let of_robot = self.functions.iter().map(|function| (None, function));
        let of_modes =
            self.modes.iter().flat_map(|mode| mode.functions.iter().map(|f| (Some(mode.identifier.as_str()), f)));
        of_robot.chain(of_modes).filter(|(_, function)| function.is_asked_for)
    }

    /// All of them.
    pub fn all(&self) -> impl Iterator<Item = &WrittenFunction> {
        let staged = self.staged.iter().flat_map(|staged| {
            let stages = staged.stages.iter().map(|stage| &stage.program);
            stages.chain(staged.functions.iter().map(|(_, program)| program))
        });
        let modes = self.modes.iter().flat_map(|mode| &mode.functions);
        self.functions.iter().chain(self.parameters.iter().map(|p| &p.program)).chain(staged).chain(modes)
    }
}
