//! The functions of a robot with drives: motors and other actuators, transmissions.

use super::{Entry, Function};
use straightline_core::algorithms::MOST_DERIVATIVES;
use straightline_core::model::Model;
use straightline_core::{algorithms as alg, Real};
use straightline_graph::expr::Port;
use DriveFunction::*;

/// A function of a robot with drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum DriveFunction {
    /// Inputs of the drives to motion.
    ForwardDynamics,
    /// Motion to inputs of the drives.
    InverseDynamics,
    /// Inputs of the drives to torques.
    Torques,
    /// H*, h* and D.
    CompleteModel,
    /// Ĉ and D̂.
    StateSpace,
    /// Where the power goes.
    Power,
    /// Energy that is stored in the drives.
    Energy,
}

pub(super) const TABLE: &[Entry] = &[
    Entry {
        function: Function::Drive(ForwardDynamics),
        name: "driven_forward_dynamics",
        summary: "The motion that the inputs of the drives make: the complete model (20.72), (20.78) of robot and drives.",
        inputs: &["q", "qd", "x", "u"],
        outputs: &[
            ("qdd", "accelerations \\[rad/s² or m/s²\\]"),
            ("xd", "derivative of the drives' state, in the order of x"),
        ],
    },
    Entry {
        function: Function::Drive(InverseDynamics),
        name: "driven_inverse_dynamics",
        summary: "The inputs of the drives that a motion takes, whatever their limits.",
        inputs: &["q", "qd", "qdd"],
        outputs: &[("u", "inputs \\[V, or as in the robot file\\]"), ("m", "torques that the actuators put out \\[N·m\\]")],
    },
    Entry {
        function: Function::Drive(Torques),
        name: "drive_torques",
        summary: "The torques of the drives under their inputs.",
        inputs: &["q", "qd", "x", "u"],
        outputs: &[
            ("tau", "generalized forces on the joints \\[N·m or N\\]"),
            ("m", "torques that the actuators put out \\[N·m\\]"),
        ],
    },
    Entry {
        function: Function::Drive(CompleteModel),
        name: "complete_model",
        summary: "The complete model H* q̈ + h* = D u (20.72), (20.73), without losses and limits, at the currents and shaft states of x; \
                  of a shaft that does not give way, the row of its joint is its own equation n q̈ = T (C x + d u).",
        inputs: &["q", "qd", "x"],
        outputs: &[
            ("h_star", "rows of H*, symmetric but for such rows \\[kg·m², kg·m, kg\\]"),
            ("bias", "h* \\[N·m or N\\]"),
            ("d", "rows of D, one per velocity coordinate \\[N·m/V\\]"),
        ],
    },
    Entry {
        function: Function::Drive(StateSpace),
        name: "state_space",
        summary: "The drives' state equation ẋ = Ĉ(x) + D̂(x) u (20.81), without losses and limits.",
        inputs: &["q", "qd", "x"],
        outputs: &[("c_hat", "Ĉ, in the order of x"), ("d_hat", "rows of D̂, one per state, one column per drive")],
    },
    Entry {
        function: Function::Drive(Power),
        name: "drive_power",
        summary: "Where the power of the drives goes.",
        inputs: &["q", "qd", "x", "u"],
        outputs: &[(
            "p",
            "\\[W\\]: electrical input, Joule heat, friction in motors, losses of gears, dampers of elastic stages, friction in joints, and (C_E − C_M) i θ̇, which is zero for a consistent motor",
        )],
    },
    Entry {
        function: Function::Drive(Energy),
        name: "drive_energy",
        summary: "Energy stored in the drives, beside that of the bodies.",
        inputs: &["q", "qd", "x"],
        outputs: &[("e", "\\[J\\]: kinetic of rotors and gears, elastic of transmissions, magnetic of motors")],
    },
];

pub(super) const INPUT_DOCS: &[(&str, &str)] = &[
    (
        "x",
        "state of the drives, [`DRIVE_STATES`] of each: θ \\[rad\\], θ̇ \\[rad/s\\] and current \\[A\\] of a motor (without \
         inductance no current; θ and θ̇ are read behind elastic transmissions only), a linear actuator's own; then angle \
         and speed of shafts between elastic stages",
    ),
    ("u", "inputs of the drives, in the order of [`DRIVE_NAMES`] \\[V, or as in the robot file\\]"),
];

/// Which derivative of q an input is, of the third and further ones: 3 of `q3`.
pub fn higher_rate(input: &str) -> Option<usize> {
    let order = input.strip_prefix('q')?.parse().ok()?;
    (input == rate_name(order) && (3..=MOST_DERIVATIVES + 2).contains(&order)).then_some(order)
}

/// The name of the input that is so high a derivative of q.
fn rate_name(order: usize) -> String {
    format!("q{order}")
}

/// What the input is, if it is such a derivative.
pub(super) fn rate_doc(input: &str) -> Option<String> {
    const WORDS: [&str; 7] = ["third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth"];
    let order = higher_rate(input)?;
    let word = WORDS.get(order - 3).map_or_else(|| format!("{order}th"), |word| word.to_string());
    let digit = |d: char| d.to_digit(10).map_or(d, |d| ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][d as usize]);
    let power: String = order.to_string().chars().map(digit).collect();
    Some(format!("{word} derivatives \\[rad/s{power} or m/s{power}\\]"))
}

impl DriveFunction {
    /// Whether a robot has it.
    pub(super) fn is_of<T: Real>(self, model: &Model<T>) -> bool {
        let drives = &model.drives;
        !drives.is_empty() && (self != InverseDynamics || alg::inverse_orders(drives).is_some())
    }

    /// Whether accelerations are solved for.
    pub(crate) fn solves(self) -> bool {
        matches!(self, ForwardDynamics | Torques | Power)
    }

    /// Inputs beside those of its entry: derivatives that the motion must have, and the state where it is read.
    pub(super) fn further_inputs<T: Real>(self, model: &Model<T>) -> Vec<Port> {
        if self != InverseDynamics {
            return Vec::new();
        }
        let orders = alg::inverse_orders(&model.drives).map_or(0, |o| o.of_torque);
        let rates = (3..3 + orders).map(|order| Port::new(&rate_name(order), &[model.nv()]));
        let state = alg::reads_states(&model.drives).then(|| Port::new("x", &[alg::drive_states(model)]));
        rates.chain(state).collect()
    }

    pub(super) fn shapes<T: Real>(self, model: &Model<T>) -> Vec<Vec<usize>> {
        let (nv, nx, nu) = (model.nv(), alg::drive_states(model), model.drives.len());
        match self {
            ForwardDynamics => vec![vec![nv], vec![nx]],
            InverseDynamics => vec![vec![nu], vec![nu]],
            Torques => vec![vec![nv], vec![nu]],
            CompleteModel => vec![vec![nv, nv], vec![nv], vec![nv, nu]],
            StateSpace => vec![vec![nx], vec![nx, nu]],
            Power => vec![vec![7]],
            Energy => vec![vec![3]],
        }
    }
}
