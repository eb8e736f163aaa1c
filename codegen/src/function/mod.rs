//! The functions that can be generated. Each stands in one file of this room, with its row ([`Spec`]) and its equations over any scalar
//! ([`RobotFunction`]); here is the list, in the order in which functions stand in generated files.

pub(crate) mod aliases;
mod base_parameters;
mod bias_derivatives;
mod closed_derivatives;
mod contact;
mod derivatives;
mod driven_derivatives;
mod drives;
mod dynamics;
mod forms;
mod forward_derivatives;
mod frame_forces;
mod kinematics;
mod loops;
mod motion_derivatives;
pub(crate) mod quantity;
mod regressors;
mod rows;
mod solution;
mod spec;
mod steps;
mod tangent;
mod tasks;
#[cfg(feature = "verify")]
pub mod truth;
mod whole;

pub use base_parameters::{base_parameter_lists, BaseParameterList};
pub use contact::{ContactExtent, ContactFunction, ContactPort, ContactSpec, InModes, PerContact};
pub(crate) use derivatives::{along, with_rates};
pub(crate) use drives::may_be_articulated;
pub use forms::{AlikeColumns, Forms, ForwardDynamicsMethod, LimbSums};
pub use quantity::Quantity;
pub use rows::SelectedRows;
pub(crate) use solution::by_rows;
pub use spec::{Divisor, Extent, Family, Form, InLanes, Judged, Lacking, Output, Parts, RobotFunction, SlopeOf, Spec};

use straightline_core::model::{Frame, Model};
use straightline_core::Real;
use straightline_graph::expr::Port;

/// The one list: a variant with its documentation, and where the type of that name stands.
macro_rules! functions {
    ($($(#[$doc:meta])* $file:ident::$name:ident,)*) => {
        /// A function of the robot that can be generated.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Function {
            $($(#[$doc])* $name,)*
        }

        impl Function {
            /// All of them.
            const LIST: &'static [Function] = &[$(Function::$name),*];

            /// Everything about it but its equations.
            pub fn spec(self) -> &'static Spec {
                match self {
                    $(Function::$name => const { &<$file::$name as RobotFunction>::SPEC },)*
                }
            }

            /// Whether a robot has what the function is about.
            pub fn is_of<T: Real>(self, model: &Model<T>) -> bool {
                match self {
                    $(Function::$name => $file::$name::is_of(model),)*
                }
            }

            fn further_inputs<T: Real>(self, model: &Model<T>) -> Vec<Quantity> {
                match self {
                    $(Function::$name => $file::$name::further_inputs(model),)*
                }
            }

            /// Its value on these forms of a robot: the output scalars in order, for inputs in the order of [`Function::inputs`].
            pub fn evaluate_on<T: Real>(self, forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
                match self {
                    $(Function::$name => $file::$name::evaluate(forms, inputs),)*
                }
            }

            /// What results leave of the equations that they solve, one block after the other; empty of functions that solve none.
            pub fn residual<T: Real>(self, forms: &Forms<'_, T>, inputs: &[Vec<T>], found: &[T]) -> Vec<T> {
                match self {
                    $(Function::$name => $file::$name::residual(forms, inputs, found),)*
                }
            }

            /// What it should give, by the second author; `None` where the reference has no formulation of it.
            #[cfg(feature = "verify")]
            pub fn truth(self, at: &truth::Chapter<'_>) -> Option<Vec<straightline_core::magnitude::Magnitude>> {
                match self {
                    $(Function::$name => <$file::$name as truth::Truth>::truth_of(at),)*
                }
            }
        }
    };
}

functions! {
    /// Poses of the frames.
    #[doc(alias("FK"))]
    kinematics::ForwardKinematics,
    /// Velocities of the frames.
    kinematics::FrameVelocity,
    /// Accelerations of the frames.
    kinematics::FrameAcceleration,
    /// Geometric Jacobians of the frames.
    kinematics::Jacobian,
    /// J̇q̇ of the frames.
    kinematics::JacobianBias,
    /// Motion to generalized forces.
    #[doc(alias("RNEA", "Newton-Euler"))]
    dynamics::InverseDynamics,
    /// The generalized forces that hold the robot still.
    dynamics::GravityForce,
    /// h of τ = H q̈ + h.
    #[doc(alias("Coriolis", "nonlinear effects"))]
    dynamics::BiasForce,
    /// The part of h that velocities make.
    #[doc(alias("Coriolis", "centrifugal"))]
    dynamics::VelocityForce,
    /// H of τ = H q̈ + h.
    #[doc(alias("CRBA", "inertia matrix"))]
    dynamics::MassMatrix,
    /// Generalized forces to motion.
    #[doc(alias("ABA", "articulated body"))]
    dynamics::ForwardDynamics,
    /// What the joints carry.
    dynamics::JointWrenches,
    /// Kinetic and potential energy.
    whole::Energy,
    /// The centre of mass of the whole robot.
    #[doc(alias("COM", "center of mass"))]
    whole::CentreOfMass,
    /// Linear and angular momentum.
    #[doc(alias("centroidal momentum"))]
    whole::Momentum,
    /// Poses and Jacobians of the frames.
    kinematics::KinematicsAndJacobian,
    /// H and g.
    #[doc(alias("CRBA"))]
    dynamics::MassMatrixAndGravityForce,
    /// Inverse dynamics with its derivatives.
    #[doc(alias("RNEA derivatives", "linearisation"))]
    derivatives::InverseDynamicsDerivatives,
    /// Its derivative along a direction.
    #[doc(alias("JVP", "forward mode"))]
    derivatives::InverseDynamicsJvp,
    /// Multipliers times its derivatives.
    #[doc(alias("VJP", "reverse mode", "adjoint"))]
    derivatives::InverseDynamicsVjp,
    /// How multipliers times its derivatives change along a direction.
    #[doc(alias("HVP", "Hessian-vector product", "second order"))]
    derivatives::InverseDynamicsHvp,
    /// Forward dynamics with its derivatives.
    #[doc(alias("ABA derivatives", "linearisation", "inverse mass matrix"))]
    forward_derivatives::ForwardDynamicsDerivatives,
    /// Its derivatives where accelerations are known.
    forward_derivatives::ForwardDynamicsDerivativesAtMotion,
    /// Its derivative along a direction.
    #[doc(alias("JVP", "forward mode"))]
    forward_derivatives::ForwardDynamicsJvp,
    /// Multipliers times its derivatives.
    #[doc(alias("VJP", "reverse mode", "adjoint"))]
    forward_derivatives::ForwardDynamicsVjp,
    /// How multipliers times its derivatives change along a direction.
    #[doc(alias("HVP", "Hessian-vector product", "second order"))]
    forward_derivatives::ForwardDynamicsHvp,
    /// g with its derivative.
    #[doc(alias("gravity Hessian"))]
    bias_derivatives::GravityDerivative,
    /// h with its derivatives.
    bias_derivatives::BiasDerivatives,
    /// C of Ḣ = C + Cᵀ, and Ḣ.
    #[doc(alias("Coriolis", "Christoffel"))]
    bias_derivatives::CoriolisMatrix,
    /// Cᵀ q̇.
    #[doc(alias("momentum observer"))]
    bias_derivatives::CoriolisTransposeForce,
    /// Velocities and accelerations of the frames: their derivatives, and J̇.
    #[doc(alias("Jdot", "linearisation"))]
    motion_derivatives::FrameDerivatives,
    /// The same of the twists of the frames, along their own axes.
    #[doc(alias("LOCAL", "body Jacobian"))]
    motion_derivatives::FrameDerivativesInOwnAxes,
    /// The same of the twists of the frames, at the world's origin.
    #[doc(alias("WORLD", "spatial Jacobian"))]
    motion_derivatives::FrameDerivativesAtWorldOrigin,
    /// The Jacobian of the centre of mass.
    #[doc(alias("COM Jacobian"))]
    motion_derivatives::CentreOfMassJacobian,
    /// Masses and centres of mass behind each joint.
    #[doc(alias("subtree COM"))]
    motion_derivatives::SubtreeCentresOfMass,
    /// Jᵀ f with its derivative.
    #[doc(alias("kinematic Hessian", "geometric stiffness"))]
    frame_forces::JacobianHessianProduct,
    /// A of h = A q̇.
    #[doc(alias("centroidal momentum matrix", "CMM"))]
    motion_derivatives::CentroidalMap,
    /// A, and Ȧ of ḣ = A q̈ + Ȧ q̇.
    motion_derivatives::CentroidalMapRate,
    /// h, ḣ and their derivatives.
    motion_derivatives::CentroidalDerivatives,
    /// Λ, μ and p of the frames.
    #[doc(alias("Khatib", "task space"))]
    tasks::OperationalSpaceDynamics,
    /// A step towards poses of the frames.
    #[doc(alias("IK"))]
    tasks::InverseKinematicsStep,
    /// Where a displacement leads.
    #[doc(alias("retraction", "exponential map", "oplus"))]
    tangent::Integrate,
    /// The displacement between configurations.
    #[doc(alias("logarithm", "ominus"))]
    tangent::Difference,
    /// How where a displacement leads depends on both.
    tangent::IntegrateDerivatives,
    /// How the displacement between configurations depends on them.
    tangent::DifferenceDerivatives,
    /// Tangents carried along a displacement.
    #[doc(alias("parallel transport"))]
    tangent::IntegrateTransport,
    /// A step of time, by Euler's semi-implicit method.
    #[doc(alias("symplectic Euler"))]
    steps::SemiImplicitStep,
    /// A step of time, by Runge and Kutta's method.
    #[doc(alias("RK4"))]
    steps::RungeKuttaStep,
    /// Euler's semi-implicit step with its derivatives.
    #[doc(alias("linearisation", "discrete dynamics"))]
    steps::StepDerivatives,
    /// Runge and Kutta's step with its derivatives.
    #[doc(alias("linearisation", "RK4"))]
    steps::StepDerivativesRk4,
    /// Y of τ = Y β.
    #[doc(alias("identification", "dynamic parameters"))]
    regressors::TorqueRegressor,
    /// Its entries that are not zero.
    #[doc(alias("sparse regressor"))]
    regressors::TorqueRegressorEntries,
    /// Y of g = Y β.
    regressors::GravityRegressor,
    /// Y of H q̇ = Y β.
    regressors::MomentumRegressor,
    /// Y of T and V.
    regressors::EnergyRegressor,
    /// Y of the wrench on the support.
    regressors::BaseWrenchRegressor,
    /// β of the inertial parameters of the links.
    #[doc(alias("identifiable parameters"))]
    regressors::BaseParameters,
    /// The same of what the wrench on the support depends on.
    regressors::SupportParameters,
    /// Derivatives by payloads and links that are inputs.
    regressors::ParameterDerivatives,
    /// Inputs of the drives to motion.
    drives::DrivenForwardDynamics,
    /// Motion to inputs of the drives.
    drives::DrivenInverseDynamics,
    /// Inputs of the drives to torques.
    drives::DriveTorques,
    /// H*, h* and D.
    drives::CompleteModel,
    /// Ĉ and D̂.
    drives::StateSpace,
    /// Where the power goes.
    drives::DrivePower,
    /// Energy that is stored in the drives.
    drives::DriveEnergy,
    /// The motion that inputs of the drives make, with its derivatives.
    #[doc(alias("linearisation"))]
    driven_derivatives::DrivenForwardDynamicsDerivatives,
    /// The dependent coordinates of closed loops.
    #[doc(alias("constraint projection", "loop closure"))]
    loops::CloseLoops,
    /// How they move with the independent ones.
    #[doc(alias("constraint embedding"))]
    loops::LoopJacobian,
    /// Their velocities and accelerations.
    loops::LoopMotion,
}

impl Function {
    /// Those that every robot has, in the order in which they stand in generated files.
    pub fn all() -> impl Iterator<Item = Function> {
        Function::known().filter(|f| f.spec().family == Family::Robot)
    }

    /// All that there are, also those of robots and scenes with more than rigid bodies.
    pub fn known() -> impl Iterator<Item = Function> {
        Function::LIST.iter().copied()
    }

    /// What a robot lacks that does not have it.
    pub(crate) fn lacking<T: Real>(self, model: &Model<T>) -> Lacking {
        match self.spec().family {
            Family::Loops => Lacking::Loops,
            _ if !model.closure.is_empty() => Lacking::FormOnLoops,
            _ if model.drives.is_empty() => Lacking::Drives,
            _ => Lacking::FittingDrives,
        }
    }

    /// All that a robot has. Combinations are made for whoever names them.
    pub fn of<T: Real>(model: &Model<T>) -> impl Iterator<Item = Function> + '_ {
        Function::known().filter(|f| f.is_of(model) && !f.spec().family.is_by_name())
    }

    /// Those that are meant by a list: [`Function::all`] stands for all that the robot has.
    pub fn wanted<T: Real>(list: &[Function], model: &Model<T>) -> Vec<Function> {
        match list.iter().copied().eq(Function::all()) {
            true => Function::of(model).collect(),
            false => list.to_vec(),
        }
    }

    /// The function of that name.
    pub fn from_name(name: &str) -> Option<Function> {
        Function::known().find(|f| f.name() == name)
    }

    /// Its name in generated code and on the command line.
    pub fn name(self) -> &'static str {
        self.spec().name
    }

    /// What it computes, in a sentence.
    pub fn summary(self) -> &'static str {
        self.spec().summary
    }

    /// Whether its outputs, or what they are made of, are asked for per frame.
    pub fn is_per_frame(self) -> bool {
        let Spec { inputs, .. } = self.spec();
        self.has_axis(Extent::Frames) || inputs.iter().any(|quantity| quantity.axes().contains(&Extent::Frames))
    }

    /// Whether it is a generalized force of the bodies, one number per velocity coordinate.
    pub fn is_torque(self) -> bool {
        self.spec().family == Family::Robot && matches!(self.spec().form, Form::InverseDynamics | Form::BiasForce)
    }

    /// Whether results, or the columns of a matrix, belong to joints.
    pub(crate) fn is_by_joints(self) -> bool {
        [Extent::Velocities, Extent::Joints, Extent::Positions, Extent::State]
            .into_iter()
            .any(|axis| self.has_axis(axis))
    }

    /// Whether some results belong to such things.
    pub(crate) fn has_axis(self, extent: Extent) -> bool {
        self.spec().outputs.iter().any(|output| output.axes.contains(&extent))
    }

    /// Whether it is about bodies that a scene makes inputs.
    pub fn is_of_scene_parameters(self) -> bool {
        self.has_axis(Extent::SceneParameters)
    }

    /// Whether inputs or results belong to base parameters.
    pub fn is_of_base_parameters(self) -> bool {
        let Spec { inputs, outputs, .. } = self.spec();
        let mut extents = inputs.iter().flat_map(|q| q.axes()).chain(outputs.iter().flat_map(|o| o.axes)).copied();
        extents.any(Extent::is_of_base_parameters)
    }

    /// Number of its arguments in generated code without a scene, if that does not depend on the robot.
    pub(crate) fn arguments(self) -> Option<usize> {
        let Spec { inputs, outputs, inputs_depend, .. } = self.spec();
        (!inputs_depend).then_some(inputs.len() + outputs.len())
    }

    /// Its inputs for a robot.
    pub fn quantities<T: Real>(self, model: &Model<T>) -> Vec<Quantity> {
        self.spec().inputs.iter().copied().chain(self.further_inputs(model)).collect()
    }

    /// The same with names and shapes, for so many frames.
    pub fn inputs<T: Real>(self, model: &Model<T>, frames: usize) -> Vec<Port> {
        self.quantities(model).into_iter().map(|quantity| quantity.port(model, frames)).collect()
    }

    /// Its blocks of results for a robot and so many frames.
    pub fn outputs<T: Real>(self, model: &Model<T>, frames: usize) -> Vec<Port> {
        let shape = |axes: &[Extent]| axes.iter().map(|extent| extent.len(model, frames)).collect::<Vec<_>>();
        self.spec().outputs.iter().map(|output| Port::new(output.name, &shape(output.axes))).collect()
    }

    /// Its value on the generic runtime: the output scalars in order, for inputs in the order of [`Function::inputs`].
    pub fn evaluate<T: Real>(
        self,
        model: &Model<T>,
        frames: &[&Frame<T>],
        method: ForwardDynamicsMethod,
        inputs: &[Vec<T>],
    ) -> Vec<T> {
        self.evaluate_on(&Forms::plain(model, frames, method), inputs)
    }
}
