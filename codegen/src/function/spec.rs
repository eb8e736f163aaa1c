//! The row of a function: what a user reads of it, the axes of its inputs and results, and what the compiler asks.

use super::{Forms, Function, Quantity};
use straightline_core::algorithms::drive_states;
use straightline_core::base_parameters::PER_BODY;
use straightline_core::magnitude::Magnitude;
use straightline_core::model::Model;
use straightline_core::Real;

/// What an axis of an array counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// Position coordinates.
    Positions,
    /// Velocity coordinates.
    Velocities,
    /// Joints, in the order of their velocity coordinates.
    Joints,
    /// Frames that are asked for.
    Frames,
    /// The state by its tangent: increments of q, then q̇.
    State,
    /// The states of all drives.
    DriveStates,
    /// Drives.
    Drives,
    /// Velocity coordinates that closed loops determine.
    Dependents,
    /// Equations of closed loops.
    LoopEquations,
    /// Base parameters: what generalized forces tell apart.
    BaseParameters,
    /// What the wrench on the support tells apart.
    SupportParameters,
    /// Entries of the regressor of generalized forces that are not zero everywhere, column by column.
    RegressorEntries,
    /// Ten parameters of the link behind every joint, then those of joints that a scene adds.
    LinkParameters,
    /// Ten parameters of every body that a scene makes an input.
    SceneParameters,
    /// So many, whatever the robot.
    Of(usize),
}

impl Extent {
    /// How many there are for a robot and so many frames.
    pub fn len<T: Real>(self, model: &Model<T>, frames: usize) -> usize {
        match self {
            Extent::Positions => model.nq(),
            Extent::Velocities => model.nv(),
            Extent::State => 2 * model.nv(),
            Extent::Joints => model.bodies.len(),
            Extent::Frames => frames,
            Extent::DriveStates => drive_states(model),
            Extent::Drives => model.drives.len(),
            Extent::Dependents => model.open_nv() - model.nv(),
            Extent::LoopEquations => model.closure.loops.iter().map(|of| of.equations()).sum(),
            Extent::BaseParameters => model.base_parameters.of_forces.len(),
            Extent::SupportParameters => model.base_parameters.of_support.len(),
            Extent::RegressorEntries => model.base_parameters.of_forces.iter().map(|p| p.rows.len()).sum(),
            Extent::LinkParameters => {
                let single = model.bodies.iter().filter(|body| body.joint.kind.is_single()).count();
                PER_BODY * model.bodies.len() + model.base_parameters.joint_parameters.len() * single
            }
            Extent::SceneParameters => model.base_parameters.of_scene.len(),
            Extent::Of(n) => n,
        }
    }

    /// Whether it counts base parameters, or what they are made of.
    pub fn is_of_base_parameters(self) -> bool {
        matches!(
            self,
            Extent::BaseParameters
                | Extent::SupportParameters
                | Extent::RegressorEntries
                | Extent::LinkParameters
                | Extent::SceneParameters
        )
    }
}

/// The parts that can be asked for of a block of results.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parts {
    /// None.
    No,
    /// Axes of fixed length have three linear entries, then angular ones.
    LinearAngular,
    /// None of its own: those of the task that it is made of.
    OfTask,
    /// The diagonal.
    Diagonal,
}

/// What a block of derivatives is the derivative of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SlopeOf {
    /// Of what, as it is written.
    pub of: &'static str,
    /// By which quantity.
    pub by: Quantity,
    /// Whether dry friction is in it, so that it jumps where a joint reverses.
    pub feels_friction: bool,
}

/// A block of results.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    /// Its name in generated code.
    pub name: &'static str,
    /// What it is, with its unit.
    pub doc: &'static str,
    /// Its axes, the outermost first.
    pub axes: &'static [Extent],
    /// What can be asked for of it.
    pub parts: Parts,
    /// Of derivatives: of what.
    pub slope: Option<SlopeOf>,
    /// Whether it is a symmetric matrix, on some robots at least: the program says on which.
    pub is_symmetric: bool,
}

impl Output {
    /// A block that is wanted as a whole.
    pub(super) const fn new(name: &'static str, axes: &'static [Extent], doc: &'static str) -> Output {
        Output { name, doc, axes, parts: Parts::No, slope: None, is_symmetric: false }
    }

    /// One that can be asked for in parts.
    pub(super) const fn of_parts(self, parts: Parts) -> Output {
        Output { parts, ..self }
    }

    /// The derivative of something by a quantity.
    pub(super) const fn slope(self, of: &'static str, by: Quantity) -> Output {
        Output { slope: Some(SlopeOf { of, by, feels_friction: false }), ..self }
    }

    /// The same of forces, or of accelerations, in which friction of joints is.
    pub(super) const fn slope_with_friction(self, of: &'static str, by: Quantity) -> Output {
        Output { slope: Some(SlopeOf { of, by, feels_friction: true }), ..self }
    }

    /// A symmetric matrix.
    pub(super) const fn symmetric(self) -> Output {
        Output { is_symmetric: true, ..self }
    }

    /// Whether it is a matrix whose columns belong to velocity coordinates.
    pub fn is_by_columns(&self) -> bool {
        self.axes.len() > 1 && matches!(self.axes.last(), Some(Extent::Velocities | Extent::State))
    }
}

/// Which robots have a function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// All.
    Robot,
    /// All, but it is made for who names it only: several functions in one, which share what they have in common.
    Combination,
    /// All, but it is made for who names it only: derivatives of other functions.
    Derivatives,
    /// All, but it is made for who names it only: what is asked of frames, and how the robot does it.
    Tasks,
    /// Those with drives.
    Drives,
    /// Those with drives, but it is made for who names it only: derivatives of their functions.
    DriveDerivatives,
    /// Those with closed loops.
    Loops,
}

impl Family {
    /// Whether it is made for who names it only.
    pub fn is_by_name(self) -> bool {
        match self {
            Family::Combination | Family::Derivatives | Family::Tasks | Family::DriveDerivatives => true,
            Family::Robot | Family::Drives | Family::Loops => false,
        }
    }

    /// Whether results are matrices, whose entries go together.
    pub fn is_of_blocks(self) -> bool {
        matches!(self, Family::Derivatives | Family::Tasks | Family::DriveDerivatives)
    }

    /// Whether it is about drives, which some robots have.
    pub fn is_of_drives(self) -> bool {
        matches!(self, Family::Drives | Family::DriveDerivatives)
    }
}

/// What the reduced robot is to a function, by what a search for the best form counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// It does not serve.
    Plain,
    /// The torques of inverse dynamics.
    InverseDynamics,
    /// Bias forces.
    BiasForce,
    /// The mass matrix.
    MassMatrix,
    /// The derivatives of inverse dynamics, in a form of their own.
    Derivatives,
    /// Regressors, in a form of their own, whose frames are those that base parameters are given in.
    Regressor,
    /// Bias forces and the mass matrix, each in its own form.
    Both,
    /// The motion that both make: whichever pair of forms takes the least.
    Motion,
}

/// Whether identical limbs can be lanes of one body: what they add to the body that carries them are sums, and between two limbs is nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InLanes {
    /// They cannot.
    Never,
    /// They can, and take as long either way (`generated_tests/record/2026-11-21-limbs.md`).
    WhereAsked,
    /// They can, and are faster where a body carries so many of them.
    WhereFaster(usize),
}

/// What a function divides by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Divisor {
    /// Nothing of the robot.
    Nothing,
    /// The mass of the moving bodies.
    Mass,
    /// The mass that each joint carries.
    MassOfEach,
    /// What joints feel of the links' inertia.
    Inertia,
    /// The same with that of drives.
    InertiaWithDrives,
}

/// What the error of results is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Judged {
    /// The natural scale of the result.
    ByScale,
    /// Of a mass matrix: the inertias of its row and column. Of forces behind it, their natural scale.
    ByInertias,
    /// Of derivatives: their natural scale, of which plain equations in dual numbers lose less than a rounding where they happen to be short.
    ByDerivatives,
    /// Of accelerations: what they leave of τ − H q̈ − h.
    ByResidual,
    /// Of derivatives of accelerations: what they leave of the equations that they solve, column by column.
    ByColumns,
}

impl Judged {
    /// Whether errors show in the equations that results solve.
    pub fn is_by_equations(self) -> bool {
        matches!(self, Judged::ByResidual | Judged::ByColumns)
    }

    /// What errors of results are compared with. An inertia that is less than `least` of what it is made of counts as that: where all that a joint
    /// moves comes to lie on its axis, what is left is rounding noise.
    pub fn scales(self, results: &[Magnitude], least: f64) -> Vec<f64> {
        if self != Judged::ByInertias {
            return results.iter().map(|x| x.size).collect();
        }
        // √(H_ii H_jj), the Cauchy-Schwarz bound of the entry; n² of them, and fewer than 2 n + 1 others
        let n = results.len().isqrt();
        let of_row = |i: usize| results[i * n + i].value.hi().abs().max(least * results[i * n + i].size);
        let roots: Vec<f64> = (0..n).map(|i| of_row(i).sqrt()).collect();
        let of_entries = roots.iter().flat_map(|a| roots.iter().map(move |b| a * b));
        of_entries.chain(results[n * n..].iter().map(|x| x.size)).collect()
    }
}

/// Everything about a function but its equations.
#[derive(Clone, Copy, Debug)]
pub struct Spec {
    /// Its name in generated code and on the command line.
    pub name: &'static str,
    /// What it computes, in a sentence.
    pub summary: &'static str,
    /// Names in use elsewhere for what it computes, or for the algorithm behind it.
    pub aliases: &'static [&'static str],
    /// What every robot's takes, in order.
    pub inputs: &'static [Quantity],
    /// Its results.
    pub outputs: &'static [Output],
    /// Which robots have it.
    pub family: Family,
    /// Whether it takes more than `inputs`, by robot.
    pub inputs_depend: bool,
    /// Functions that it combines, which share what they have in common.
    pub members: &'static [Function],
    /// What the reduced robot is to it.
    pub form: Form,
    /// Whether accelerations are solved for: the method of forward dynamics matters.
    pub solves: bool,
    /// Limbs in lanes.
    pub in_lanes: InLanes,
    /// Values of the greatest program that gains by values formed of others that are there; torques gain an operation of two hundred.
    pub substituted_up_to: usize,
    /// Whether the order of its sums is left as it is: forward dynamics takes 6 to 9 % longer in another, and its digits go elsewhere.
    pub keeps_order: bool,
    /// What it divides by.
    pub divisor: Divisor,
    /// What its errors are compared with.
    pub judged: Judged,
    /// Whether robots with closed loops have it, too.
    pub on_loops: bool,
}

impl Spec {
    /// What most functions are, to be completed.
    pub const DEFAULT: Spec = Spec {
        name: "",
        summary: "",
        aliases: &[],
        inputs: &[],
        outputs: &[],
        family: Family::Robot,
        inputs_depend: false,
        members: &[],
        form: Form::Plain,
        solves: false,
        in_lanes: InLanes::Never,
        substituted_up_to: 0,
        keeps_order: false,
        divisor: Divisor::Nothing,
        judged: Judged::ByScale,
        on_loops: false,
    };

    /// What derivatives of forces are, to be completed.
    pub const DERIVED: Spec = Spec {
        family: Family::Derivatives,
        form: Form::Derivatives,
        substituted_up_to: 9000,
        judged: Judged::ByDerivatives,
        ..Spec::DEFAULT
    };
}

/// A function of the robot.
pub trait RobotFunction {
    /// Everything but its equations.
    const SPEC: Spec;

    /// Whether a robot has what it is about.
    fn is_of<T: Real>(model: &Model<T>) -> bool {
        let fits_loops = match model.closure.is_empty() {
            true => Self::SPEC.family != Family::Loops,
            false => Self::SPEC.on_loops,
        };
        fits_loops && (!Self::SPEC.family.is_of_drives() || !model.drives.is_empty())
    }

    /// What a robot's takes beside [`Spec::inputs`].
    fn further_inputs<T: Real>(_: &Model<T>) -> Vec<Quantity> {
        Vec::new()
    }

    /// Its results, one block after the other, for inputs in order.
    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T>;

    /// What results leave of the equations that they solve, one block after the other: forces. Of [`Judged::ByResidual`] and [`Judged::ByColumns`].
    fn residual<T: Real>(_: &Forms<'_, T>, _inputs: &[Vec<T>], _found: &[T]) -> Vec<T> {
        Vec::new()
    }
}

/// Why a robot does not have a function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lacking {
    /// It is about loops that the robot does not have.
    Loops,
    /// It has no form for robots with loops.
    FormOnLoops,
    /// It is about drives that the robot does not have.
    Drives,
    /// Its drives are others.
    FittingDrives,
}
