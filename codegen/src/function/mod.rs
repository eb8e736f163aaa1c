//! The functions that can be generated: a table of names, signatures and documentation, and the algorithm behind each.

mod aliases;
mod drives;

pub use drives::{higher_rate, DriveFunction};

use crate::choose::Found;
use crate::emit::Scalar;
use crate::forward_method::{self, MethodChoice};
use crate::identifier;
use crate::reduce::{reduce, Choice};
use crate::scene::{Bound, Parameter, Part, Scene};
use drives::Rigid;
use straightline_core::algorithms as alg;
use straightline_core::model::{Frame, Model};
use straightline_core::reduced::ReducedModel;
use straightline_core::spatial::{Transform, Vec3};
use straightline_core::{Dd, Real};
use straightline_graph::expr::{Graph, Port, RuleSet};
use straightline_graph::trace::{trace, Expr};

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

/// How forward dynamics is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ForwardDynamicsMethod {
    /// Whichever takes fewer operations for this robot, unless it loses digits that the other keeps.
    #[default]
    Cheaper,
    /// The bias force, then articulated bodies.
    ArticulatedBody,
    /// The bias force, the mass matrix, and its branch-sparse LᵀDL factor.
    Factorisation,
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

    /// Its documentation in generated code, for the inputs that a scene leaves it.
    pub fn doc(self, inputs: &[Port], scene: &Scene) -> String {
        let entry = self.entry();
        let mut doc = format!("{}\n\n", entry.summary);
        for port in inputs {
            let known = INPUT_DOCS.iter().chain(drives::INPUT_DOCS).find(|(name, _)| *name == port.name);
            let known = known.map(|(_, text)| text.to_string()).or_else(|| drives::rate_doc(&port.name));
            let of_scene = || scene.parameters.iter().find(|p| p.input_name() == port.name).map(Parameter::in_words);
            let text = known.or_else(of_scene).unwrap_or_default();
            doc.push_str(&format!("* `{}`: {text}\n", port.name));
        }
        for (name, text) in entry.outputs {
            doc.push_str(&format!("* `{name}`: {text}\n"));
        }
        let of_matrices = [Function::MassMatrix, Function::Jacobian, Function::KinematicsAndJacobian];
        if scene.by_columns && of_matrices.contains(&self) {
            doc.push_str("\nThe matrix is written column after column: its first index is the column's.\n");
        }
        if let Some(selection) = scene.outputs.get(&self) {
            for (what, names) in [("joints", &selection.joints), ("frames", &selection.frames)] {
                if !names.is_empty() {
                    let names: Vec<String> = names.iter().map(|name| identifier::doc(name)).collect();
                    doc.push_str(&format!("\nOnly for the {what} {}.\n", names.join(", ")));
                }
            }
            match selection.part {
                Part::Whole => {}
                Part::Linear => doc.push_str("\nOnly the linear part: positions, linear rows, forces.\n"),
                Part::Angular => doc.push_str("\nOnly the angular part: orientations, angular rows, moments.\n"),
                Part::Diagonal => doc.push_str("\nOnly the diagonal.\n"),
            }
        }
        doc
    }

    /// Its value on the generic runtime: the output scalars in order, for inputs in the order of [`Function::inputs`].
    pub fn evaluate<T: Real>(
        self,
        model: &Model<T>,
        frames: &[&Frame<T>],
        method: ForwardDynamicsMethod,
        inputs: &[Vec<T>],
    ) -> Vec<T> {
        use Function::*;
        let q = &inputs[0];
        let arg = |i: usize| &inputs[i][..];
        match self {
            ForwardKinematics => alg::forward_kinematics(model, q, frames).iter().flat_map(pose).collect(),
            FrameVelocity => frames.iter().flat_map(|f| motion(alg::frame_velocity(model, q, arg(1), f))).collect(),
            FrameAcceleration => {
                frames.iter().flat_map(|f| motion(alg::frame_acceleration(model, q, arg(1), arg(2), f))).collect()
            }
            Jacobian => frames.iter().flat_map(|f| alg::jacobian(model, q, f)).collect(),
            JacobianBias => frames.iter().flat_map(|f| motion(alg::jacobian_bias(model, q, arg(1), f))).collect(),
            InverseDynamics => alg::inverse_dynamics(model, q, arg(1), arg(2)),
            GravityForce => alg::gravity_force(model, q),
            BiasForce => alg::bias_force(model, q, arg(1)),
            VelocityForce => alg::velocity_force(model, q, arg(1)),
            MassMatrix => alg::mass_matrix(model, q),
            ForwardDynamics => match method {
                ForwardDynamicsMethod::Factorisation => alg::forward_dynamics_ltdl(model, q, arg(1), arg(2)),
                _ => alg::forward_dynamics_aba(model, q, arg(1), arg(2)),
            },
            JointWrenches => alg::joint_wrenches(model, q, arg(1), arg(2))
                .into_iter()
                .flat_map(|w| w.force.to_array().into_iter().chain(w.moment.to_array()))
                .collect(),
            Energy => vec![alg::kinetic_energy(model, q, arg(1)), alg::potential_energy(model, q)],
            CentreOfMass => alg::momentum(model, q, &rest(model)).com.to_array().to_vec(),
            Momentum => {
                let m = alg::momentum(model, q, arg(1));
                m.linear.to_array().into_iter().chain(m.angular.to_array()).collect()
            }
            KinematicsAndJacobian => {
                let of = |f: &Function| f.evaluate(model, frames, method, inputs);
                self.members().iter().flat_map(of).collect()
            }
            Drive(function) => function.evaluate(&Rigid { model, reduced: None }, method, inputs),
        }
    }

    /// The same over the reals with fewer operations, for the functions that have such a form.
    pub(crate) fn evaluate_reduced<T: Real>(
        self,
        model: &Model<T>,
        reduced: &ReducedModel<T>,
        composite: &ReducedModel<T>,
        method: ForwardDynamicsMethod,
        inputs: &[Vec<T>],
    ) -> Option<Vec<T>> {
        use Function::*;
        if !reduced.serves(model) {
            return None;
        }
        let q = &inputs[0];
        let bias = || {
            reduced_bias(
                model,
                reduced,
                q,
                &inputs[1],
                &mut Limbs { wrench: &mut |_, _| None, first_moment: &mut |_, _| None },
            )
        };
        let mass_matrix = || {
            let mut h = alg::reduced_mass_matrix(composite, q);
            let nv = model.nv();
            for (i, rotor) in alg::rotor_inertias(model).into_iter().enumerate() {
                h[i * nv + i] = h[i * nv + i] + rotor;
            }
            h
        };
        Some(match self {
            InverseDynamics | GravityForce | BiasForce | VelocityForce => self.reduced_forces(
                model,
                reduced,
                inputs,
                &mut Limbs { wrench: &mut |_, _| None, first_moment: &mut |_, _| None },
            )?,
            MassMatrix => mass_matrix(),
            ForwardDynamics => {
                let drive: Vec<T> = inputs[2].iter().zip(bias()).map(|(tau, h)| *tau - h).collect();
                match method {
                    ForwardDynamicsMethod::Factorisation => alg::Ltdl::factor(model, &mass_matrix()).solve(&drive),
                    _ => alg::solve_articulated(model, q, &drive),
                }
            }
            Drive(function) => function.evaluate(&Rigid { model, reduced: Some((reduced, composite)) }, method, inputs),
            _ => return None,
        })
    }

    /// The reduced form of the functions to which a limb adds a wrench on the body that carries it, and the forces on its own joints.
    pub(crate) fn reduced_forces<T: Real>(
        self,
        model: &Model<T>,
        reduced: &ReducedModel<T>,
        inputs: &[Vec<T>],
        limbs: &mut Limbs<'_, T>,
    ) -> Option<Vec<T>> {
        use Function::*;
        let q = &inputs[0];
        Some(match self {
            InverseDynamics => {
                let motion = [&q[..], &inputs[1], &inputs[2]];
                let rigid = alg::reduced_inverse_dynamics_with_limbs(reduced, motion, limbs.wrench);
                let passive = alg::passive_force(model, q, &inputs[1]);
                let rotors = alg::rotor_inertias(model).into_iter().zip(&inputs[2]).map(|(i, qdd)| i * *qdd);
                rigid.into_iter().zip(rotors.zip(passive)).map(|(f, (r, p))| f + (r + p)).collect()
            }
            GravityForce => alg::reduced_gravity_force_with_limbs(reduced, q, limbs.first_moment),
            BiasForce => reduced_bias(model, reduced, q, &inputs[1], limbs),
            VelocityForce => {
                let weightless = ReducedModel { gravity: Vec3::zero(), ..reduced.clone() };
                let motion = [&q[..], &inputs[1], &rest(model)];
                alg::reduced_inverse_dynamics_with_limbs(&weightless, motion, limbs.wrench)
            }
            _ => return None,
        })
    }

    /// All its results over expressions, in a scene; inside a trace. `reduced`: by the reduced robot, where it serves.
    pub fn equations(
        self,
        robot: &Robot,
        frames: &[String],
        method: ForwardDynamicsMethod,
        reduced: bool,
        scene: &Scene,
        inputs: &[Vec<Expr>],
    ) -> Vec<Expr> {
        let bound = scene.bind(self, robot, inputs);
        let Bound { model, reduced: for_torques, composite, arguments } = &bound;
        let by_reduced =
            reduced.then(|| self.evaluate_reduced(model, for_torques, composite, method, arguments)).flatten();
        by_reduced.unwrap_or_else(|| {
            let frame = |name: &String| model.frame(name).expect("frames were checked against the model");
            self.evaluate(model, &frames.iter().map(frame).collect::<Vec<_>>(), method, arguments)
        })
    }

    /// Its equations for a robot in a scene, and for [`ForwardDynamicsMethod::Cheaper`] which form of forward dynamics that
    /// is and why: see [`forward_method`]. `reduced`: the reduced robot serves the functions that it
    /// can, and rounding moves.
    #[allow(clippy::too_many_arguments)]
    pub fn trace(
        self,
        robot: &Robot,
        frames: &[String],
        method: ForwardDynamicsMethod,
        rules: RuleSet,
        scalar: Scalar,
        reduced: bool,
        scene: &Scene,
    ) -> (Graph, Option<MethodChoice>) {
        let frames = scene.frames_of(self, frames);
        let (wanted, outputs) = scene.select(self, &robot.model, frames.len());
        let trace_with = |method| {
            trace(rules, scene.ports(self, &robot.model), outputs.clone(), |inputs| {
                let results = self.equations(robot, frames, method, reduced, scene, inputs);
                wanted.iter().map(|k| results[*k]).collect()
            })
        };
        let has_two_forms = match self {
            Function::Drive(f) => f.solves() && drives::may_be_articulated(&robot.model),
            _ => self == Function::ForwardDynamics,
        };
        match method {
            ForwardDynamicsMethod::Cheaper if has_two_forms => {
                let articulated = trace_with(ForwardDynamicsMethod::ArticulatedBody);
                let factorised = (robot.model.nv() <= forward_method::MOST_FOR_FACTORISATION)
                    .then(|| trace_with(ForwardDynamicsMethod::Factorisation));
                let choice = forward_method::choose(&robot.model, scalar, &articulated, factorised.as_ref());
                let graph = match factorised {
                    Some(factorised) if !choice.articulated_bodies => factorised,
                    _ => articulated,
                };
                (graph, Some(choice))
            }
            _ => (trace_with(method), None),
        }
    }
}

/// A robot in the forms that are traced.
#[derive(Clone, Debug)]
pub struct Robot {
    /// As the robot file has it, in canonical frames.
    pub model: Model<Dd>,
    /// For joint torques alone.
    pub reduced: ReducedModel<Dd>,
    /// For the mass matrix alone.
    pub composite: ReducedModel<Dd>,
    /// Pose of each body's frame of the reduced forms in its canonical one.
    pub reduced_frames: Vec<Transform<Dd>>,
    /// The choices of reduced forms that were found for it.
    pub found: Found,
}

impl Robot {
    /// All forms of a robot, the reduced ones as any robot takes them.
    pub fn new(model: Model<Dd>) -> Self {
        let (reduced, reduced_frames) = reduce(&model, &Choice::plain(&model));
        Robot { model, composite: reduced.clone(), reduced, reduced_frames, found: Found::default() }
    }

    /// The same robot in other reduced forms, for torques and for the mass matrix.
    #[must_use]
    pub fn reduced_by(&self, torques: &Choice, mass_matrix: &Choice) -> Self {
        let (reduced, composite) = (reduce(&self.model, torques).0, reduce(&self.model, mass_matrix).0);
        Robot { reduced, composite, ..self.clone() }
    }
}

/// What the bodies that stand for several limbs each pass on to those that carry them, all limbs together: see
/// [`alg::reduced_inverse_dynamics_with_limbs`] and [`alg::reduced_gravity_force_with_limbs`].
pub(crate) struct Limbs<'a, T> {
    /// Force and moment.
    pub wrench: &'a mut alg::LimbWrenches<'a, T>,
    /// First moment and mass.
    pub first_moment: &'a mut alg::LimbMoments<'a, T>,
}

/// Bias forces by the reduced robot.
fn reduced_bias<T: Real>(
    model: &Model<T>,
    reduced: &ReducedModel<T>,
    q: &[T],
    qd: &[T],
    limbs: &mut Limbs<'_, T>,
) -> Vec<T> {
    let rigid = alg::reduced_inverse_dynamics_with_limbs(reduced, [q, qd, &rest(model)], limbs.wrench);
    let passive = alg::passive_force(model, q, qd);
    rigid.into_iter().zip(passive).map(|(f, p)| f + p).collect()
}

/// q̇ = 0 or q̈ = 0.
fn rest<T: Real>(model: &Model<T>) -> Vec<T> {
    vec![T::zero(); model.nv()]
}

fn pose<T: Real>(x: &Transform<T>) -> Vec<T> {
    x.translation.to_array().into_iter().chain(x.rotation.rows.into_iter().flatten()).collect()
}

/// Linear part first, as robot users expect it.
fn motion<T: Real>(m: straightline_core::spatial::MotionVector<T>) -> Vec<T> {
    let both: [Vec3<T>; 2] = [m.linear, m.angular];
    both.into_iter().flat_map(Vec3::to_array).collect()
}
