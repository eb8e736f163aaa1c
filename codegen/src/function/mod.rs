//! The functions that can be generated: a table of names, signatures and documentation, and the algorithm behind each.

mod aliases;
mod contact;
mod drives;

pub use contact::ContactFunction;
pub use drives::{higher_rate, DriveFunction};

use straightline_core::model::Model;
use straightline_core::{algorithms as alg, Real};
use straightline_graph::expr::Port;

/// A function of the robot that can be generated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Function {
    /// Poses of the frames.
    #[doc(alias("FK"))]
    ForwardKinematics,
    /// Velocities of the frames.
    FrameVelocity,
    /// Accelerations of the frames.
    FrameAcceleration,
    /// Geometric Jacobians of the frames.
    Jacobian,
    /// J̇q̇ of the frames.
    JacobianBias,
    /// Motion to drives.
    #[doc(alias("RNEA", "Newton-Euler"))]
    InverseDynamics,
    /// The drives that hold the robot still.
    GravityForce,
    /// h of τ = H q̈ + h.
    #[doc(alias("Coriolis", "nonlinear effects"))]
    BiasForce,
    /// The part of h that velocities make.
    #[doc(alias("Coriolis", "centrifugal"))]
    VelocityForce,
    /// H of τ = H q̈ + h.
    #[doc(alias("CRBA", "inertia matrix"))]
    MassMatrix,
    /// Drives to motion.
    #[doc(alias("ABA", "articulated body"))]
    ForwardDynamics,
    /// What the joints carry.
    JointWrenches,
    /// Kinetic and potential energy.
    Energy,
    /// The mass centre of the whole robot.
    #[doc(alias("COM", "center of mass"))]
    CentreOfMass,
    /// Linear and angular momentum.
    #[doc(alias("centroidal momentum"))]
    Momentum,
    /// Poses and Jacobians of the frames.
    KinematicsAndJacobian,
    /// Of robots with drives.
    Drive(DriveFunction),
}

/// What a function's text is made from.
struct Entry {
    function: Function,
    name: &'static str,
    summary: &'static str,
    inputs: &'static [&'static str],
    /// Name and documentation of every block of results.
    outputs: &'static [(&'static str, &'static str)],
}

const TABLE: &[Entry] = &[
    Entry {
        function: Function::ForwardKinematics,
        name: "forward_kinematics",
        summary: "Poses of the frames in the world.",
        inputs: &["q"],
        outputs: &[("x", "per frame of [`FRAME_NAMES`]: position p \\[m\\] (3), then orientation R by rows (9); R's columns are the frame's axes")],
    },
    Entry {
        function: Function::FrameVelocity,
        name: "frame_velocity",
        summary: "Velocities of the frames.",
        inputs: &["q", "qd"],
        outputs: &[("v", "per frame: velocity of the origin \\[m/s\\] (3), angular velocity \\[rad/s\\] (3), world axes")],
    },
    Entry {
        function: Function::FrameAcceleration,
        name: "frame_acceleration",
        summary: "Accelerations of the frames, without gravity.",
        inputs: &["q", "qd", "qdd"],
        outputs: &[("a", "per frame: acceleration of the origin \\[m/s²\\] (3), angular acceleration \\[rad/s²\\] (3), world axes")],
    },
    Entry {
        function: Function::Jacobian,
        name: "jacobian",
        summary: "Geometric Jacobians J of the frames: J q̇ is the frame's velocity.",
        inputs: &["q"],
        outputs: &[("j", "per frame: 6 rows (3 linear at the frame's origin, 3 angular; world axes) of one column per velocity coordinate")],
    },
    Entry {
        function: Function::JacobianBias,
        name: "jacobian_bias",
        summary: "J̇ q̇ of the frames: their acceleration for q̈ = 0.",
        inputs: &["q", "qd"],
        outputs: &[("a", "per frame: linear \\[m/s²\\] (3), angular \\[rad/s²\\] (3), world axes")],
    },
    Entry {
        function: Function::InverseDynamics,
        name: "inverse_dynamics",
        summary: "Inverse dynamics τ = H(q) q̈ + h(q, q̇): the drives that a motion takes.",
        inputs: &["q", "qd", "qdd"],
        outputs: &[("tau", "generalized forces \\[N·m or N\\]")],
    },
    Entry {
        function: Function::GravityForce,
        name: "gravity_force",
        summary: "Gravity forces g(q): the drives that hold the robot still.",
        inputs: &["q"],
        outputs: &[("g", "generalized forces \\[N·m or N\\]")],
    },
    Entry {
        function: Function::BiasForce,
        name: "bias_force",
        summary: "Bias forces h(q, q̇): Coriolis, centrifugal and gravity forces.",
        inputs: &["q", "qd"],
        outputs: &[("h", "generalized forces \\[N·m or N\\]")],
    },
    Entry {
        function: Function::VelocityForce,
        name: "velocity_force",
        summary: "Velocity forces C(q, q̇) q̇: Coriolis and centrifugal forces, without gravity.",
        inputs: &["q", "qd"],
        outputs: &[("c", "generalized forces \\[N·m or N\\]")],
    },
    Entry {
        function: Function::MassMatrix,
        name: "mass_matrix",
        summary: "The mass matrix H(q), symmetric.",
        inputs: &["q"],
        outputs: &[("h", "rows of H, both triangles \\[kg·m², kg·m, kg\\]")],
    },
    Entry {
        function: Function::ForwardDynamics,
        name: "forward_dynamics",
        summary: "Forward dynamics q̈ = H(q)⁻¹ (τ − h(q, q̇)): the motion that drives make.",
        inputs: &["q", "qd", "tau"],
        outputs: &[("qdd", "accelerations \\[rad/s² or m/s²\\]")],
    },
    Entry {
        function: Function::JointWrenches,
        name: "joint_wrenches",
        summary: "Forces and moments that each joint carries, drive included.",
        inputs: &["q", "qd", "qdd"],
        outputs: &[("w", "per joint, in the order of qd: force \\[N\\] (3), moment about the joint's origin \\[N·m\\] (3), from parent to child, in the child link's axes")],
    },
    Entry {
        function: Function::Energy,
        name: "energy",
        summary: "Kinetic and potential energy of the moving bodies.",
        inputs: &["q", "qd"],
        outputs: &[("tv", "kinetic energy T, potential energy V = −Σ m g·p \\[J\\]")],
    },
    Entry {
        function: Function::CentreOfMass,
        name: "centre_of_mass",
        summary: "Mass centre of the moving bodies.",
        inputs: &["q"],
        outputs: &[("p", "its position in the world \\[m\\]")],
    },
    Entry {
        function: Function::Momentum,
        name: "momentum",
        summary: "Momentum of the moving bodies.",
        inputs: &["q", "qd"],
        outputs: &[("p", "linear \\[kg·m/s\\] (3), angular about the mass centre \\[kg·m²/s\\] (3), world axes")],
    },
];

/// Several functions in one, for callers that need all of them at the same inputs: what they share is computed once.
const COMBINATIONS: &[(Entry, &[Function])] = &[(
    Entry {
        function: Function::KinematicsAndJacobian,
        name: "kinematics_and_jacobian",
        summary: "Poses and geometric Jacobians of the frames, at the cost of little more than one of them.",
        inputs: &["q"],
        outputs: &[
            ("x", "per frame of [`FRAME_NAMES`]: position p \\[m\\] (3), then orientation R by rows (9); R's columns are the frame's axes"),
            ("j", "per frame: 6 rows (3 linear at the frame's origin, 3 angular; world axes) of one column per velocity coordinate"),
        ],
    },
    &[Function::ForwardKinematics, Function::Jacobian],
)];

const INPUT_DOCS: &[(&str, &str)] = &[
    ("q", "configuration \\[rad or m\\]"),
    ("qd", "velocities \\[rad/s or m/s\\]"),
    ("qdd", "accelerations \\[rad/s² or m/s²\\]"),
    ("tau", "generalized forces \\[N·m or N\\]"),
    ("gravity", "acceleration due to gravity in the world \\[m/s²\\]"),
];

/// What the input of that name is; `None` of the parameters of a scene.
pub(crate) fn input_doc(name: &str) -> Option<String> {
    let known = INPUT_DOCS.iter().chain(drives::INPUT_DOCS).find(|(n, _)| *n == name);
    known.map(|(_, text)| text.to_string()).or_else(|| drives::rate_doc(name))
}

/// Number of scalars of an input.
fn length<T: Real>(input: &str, model: &Model<T>) -> usize {
    match input {
        "q" => model.nq(),
        "qd" | "qdd" | "tau" => model.nv(),
        "x" => alg::drive_states(model),
        "u" => model.drives.len(),
        _ => panic!("the input `{input}` has no length"),
    }
}

/// The rows of every family, in the order in which functions stand in generated files.
fn table() -> impl Iterator<Item = &'static Entry> {
    TABLE.iter().chain(COMBINATIONS.iter().map(|(entry, _)| entry)).chain(drives::TABLE)
}

impl Function {
    /// Those that every robot has, in the order in which they stand in generated files.
    pub fn all() -> impl Iterator<Item = Function> {
        TABLE.iter().map(|e| e.function)
    }

    /// All that there are, also those of robots and scenes with more than rigid bodies.
    pub fn known() -> impl Iterator<Item = Function> {
        table().map(|e| e.function)
    }

    /// All that a robot has. Combinations are made for whoever names them.
    pub fn of<T: Real>(model: &Model<T>) -> impl Iterator<Item = Function> + '_ {
        Function::known().filter(|f| f.is_of(model) && f.members().is_empty())
    }

    /// Those that are meant by a list: [`Function::all`] stands for all that the robot has.
    pub fn wanted<T: Real>(list: &[Function], model: &Model<T>) -> Vec<Function> {
        match list.iter().copied().eq(Function::all()) {
            true => Function::of(model).collect(),
            false => list.to_vec(),
        }
    }

    /// Whether a robot has what the function is about.
    pub fn is_of<T: Real>(self, model: &Model<T>) -> bool {
        match self {
            Function::Drive(function) => function.is_of(model),
            _ => true,
        }
    }

    /// Whether it solves for accelerations.
    pub fn is_forward(self) -> bool {
        match self {
            Function::ForwardDynamics => true,
            Function::Drive(function) => function.solves(),
            _ => false,
        }
    }

    /// Whether the reduced robot serves it: torques, H and what is made of them.
    pub(crate) fn has_reduced_form(self) -> bool {
        use Function::*;
        matches!(self, InverseDynamics | GravityForce | BiasForce | VelocityForce | MassMatrix | ForwardDynamics)
    }

    /// The functions that it combines; none for a plain one.
    pub fn members(self) -> &'static [Function] {
        COMBINATIONS.iter().find(|(entry, _)| entry.function == self).map_or(&[], |(_, members)| members)
    }

    /// The function of that name.
    pub fn from_name(name: &str) -> Option<Function> {
        table().find(|e| e.name == name).map(|e| e.function)
    }

    /// Name and documentation of every block of results.
    pub(crate) fn output_docs(self) -> &'static [(&'static str, &'static str)] {
        self.entry().outputs
    }

    fn entry(self) -> &'static Entry {
        table().find(|e| e.function == self).expect("the table has every function")
    }

    /// Its name in generated code and on the command line.
    pub fn name(self) -> &'static str {
        self.entry().name
    }

    /// What it computes, in a sentence.
    pub fn summary(self) -> &'static str {
        self.entry().summary
    }

    /// Number of its arguments in generated code without a scene, if that does not depend on the robot.
    pub(crate) fn arguments(self) -> Option<usize> {
        let entry = self.entry();
        let depends = self == Function::Drive(DriveFunction::InverseDynamics);
        (!depends).then_some(entry.inputs.len() + entry.outputs.len())
    }

    /// Names of its blocks of results.
    pub(crate) fn output_names(self) -> impl Iterator<Item = &'static str> {
        self.entry().outputs.iter().map(|(name, _)| *name)
    }

    /// Whether its outputs are asked for per frame.
    pub fn is_per_frame(self) -> bool {
        use Function::*;
        matches!(self, ForwardKinematics | FrameVelocity | FrameAcceleration | Jacobian | JacobianBias)
            || self.members().iter().any(|f| f.is_per_frame())
    }

    /// Its inputs for a robot.
    pub fn inputs<T: Real>(self, model: &Model<T>) -> Vec<Port> {
        let own = self.entry().inputs.iter().map(|name| Port::new(name, &[length(name, model)]));
        match self {
            Function::Drive(function) => own.chain(function.further_inputs(model)).collect(),
            _ => own.collect(),
        }
    }

    /// Its blocks of results for a robot and so many frames.
    pub fn outputs<T: Real>(self, model: &Model<T>, frames: usize) -> Vec<Port> {
        use Function::*;
        let nv = model.nv();
        let shape: &[usize] = match self {
            ForwardKinematics => &[frames, 12],
            FrameVelocity | FrameAcceleration | JacobianBias => &[frames, 6],
            Jacobian => &[frames, 6, nv],
            InverseDynamics | GravityForce | BiasForce | VelocityForce | ForwardDynamics => &[nv],
            MassMatrix => &[nv, nv],
            JointWrenches => &[model.bodies.len(), 6],
            Energy => &[2],
            CentreOfMass => &[3],
            Momentum => &[6],
            KinematicsAndJacobian => {
                return self.members().iter().flat_map(|f| f.outputs(model, frames)).collect();
            }
            Drive(function) => {
                let names = self.entry().outputs.iter().map(|block| block.0);
                return names.zip(function.shapes(model)).map(|(name, shape)| Port::new(name, &shape)).collect();
            }
        };
        vec![Port::new(self.entry().outputs[0].0, shape)]
    }
}
