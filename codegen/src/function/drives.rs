//! The functions of a robot with drives: motors and other actuators, transmissions.

use super::{Entry, ForwardDynamicsMethod, Function};
use straightline_core::algorithms as alg;
use straightline_core::algorithms::{Links, MOST_DERIVATIVES};
use straightline_core::model::Model;
use straightline_core::reduced::ReducedModel;
use straightline_core::{Real, Taylor};
use straightline_graph::expr::Port;

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

use DriveFunction::*;

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

    /// Its value: all blocks, one after the other.
    pub(super) fn evaluate<T: Real>(
        self,
        rigid: &Rigid<T>,
        method: ForwardDynamicsMethod,
        inputs: &[Vec<T>],
    ) -> Vec<T> {
        let model = rigid.model;
        let arg = |i: usize| &inputs[i][..];
        let q = arg(0);
        if self == InverseDynamics {
            return inverse(rigid, inputs);
        }
        let bias = || rigid.bias(q, arg(1));
        let at = || (q, arg(1), arg(2), arg(3));
        let h: Vec<T>;
        let links = match method {
            ForwardDynamicsMethod::Factorisation => {
                h = if self.solves() { rigid.mass_matrix(q) } else { Vec::new() };
                Links::MassMatrix(&h)
            }
            _ if !self.solves() => Links::Articulated,
            _ if may_be_articulated(model) => Links::Articulated,
            _ => {
                h = rigid.mass_matrix(q);
                Links::MassMatrix(&h)
            }
        };
        match self {
            ForwardDynamics => {
                let motion = alg::driven_motion(model, at(), &bias(), &links);
                [motion.qdd, motion.xd].concat()
            }
            Torques => {
                let (tau, m) = alg::drive_torques(model, at(), &bias(), &links);
                [tau, m].concat()
            }
            CompleteModel => {
                let (h, bias, d) = alg::complete_model(model, (q, arg(1), arg(2)), &bias(), &rigid.mass_matrix(q));
                [h, bias, d].concat()
            }
            StateSpace => {
                let (c, d) = alg::state_space(model, (q, arg(1), arg(2)), &bias(), &rigid.mass_matrix(q));
                [c, d].concat()
            }
            Power => alg::drive_power(model, at(), &bias(), &links).to_vec(),
            Energy => alg::drive_energy(model, (q, arg(1), arg(2))).to_vec(),
            InverseDynamics => unreachable!("it has other inputs"),
        }
    }
}

/// Whether articulated bodies can solve for the motion: drives add to the diagonal of H, and nothing is lost.
pub(super) fn may_be_articulated<T: Real>(model: &Model<T>) -> bool {
    alg::drives_are_diagonal(&model.drives)
        && model.drives.iter().all(|d| d.efficiency.is_none() && d.held_joint().is_none())
}

/// The rigid bodies, by the plain or by the reduced form.
pub(super) struct Rigid<'a, T> {
    pub model: &'a Model<T>,
    /// For torques, and for the mass matrix.
    pub reduced: Option<(&'a ReducedModel<T>, &'a ReducedModel<T>)>,
}

impl<T: Real> Rigid<'_, T> {
    fn bias(&self, q: &[T], qd: &[T]) -> Vec<T> {
        match self.reduced {
            None => alg::bias_force(self.model, q, qd),
            Some((torques, _)) => {
                let rigid = alg::reduced_inverse_dynamics(torques, q, qd, &vec![T::zero(); qd.len()]);
                sum(rigid, alg::passive_force(self.model, q, qd))
            }
        }
    }

    fn mass_matrix(&self, q: &[T]) -> Vec<T> {
        let Some((_, composite)) = self.reduced else { return alg::mass_matrix(self.model, q) };
        let mut h = alg::reduced_mass_matrix(composite, q);
        let nv = self.model.nv();
        for (i, rotor) in alg::rotor_inertias(self.model).into_iter().enumerate() {
            h[i * nv + i] = h[i * nv + i] + rotor;
        }
        h
    }

    fn inverse_dynamics(&self, q: &[T], qd: &[T], qdd: &[T]) -> Vec<T> {
        let Some((torques, _)) = self.reduced else { return alg::inverse_dynamics(self.model, q, qd, qdd) };
        let rigid = alg::reduced_inverse_dynamics(torques, q, qd, qdd);
        let rotors = alg::rotor_inertias(self.model).into_iter().zip(qdd).map(|(i, qdd)| i * *qdd).collect();
        sum(rigid, sum(rotors, alg::passive_force(self.model, q, qd)))
    }
}

fn sum<T: Real>(a: Vec<T>, b: Vec<T>) -> Vec<T> {
    a.into_iter().zip(b).map(|(a, b)| a + b).collect()
}

/// The inverse problem over series of as many terms as it takes, rounded up; what is too much is never wanted.
fn inverse<T: Real>(rigid: &Rigid<T>, inputs: &[Vec<T>]) -> Vec<T> {
    match alg::inverse_orders(&rigid.model.drives).map_or(0, |o| o.of_torque) {
        0 => inverse_over::<T, 1>(rigid, inputs),
        1..=3 => inverse_over::<T, 4>(rigid, inputs),
        4..=7 => inverse_over::<T, 8>(rigid, inputs),
        8..=15 => inverse_over::<T, 16>(rigid, inputs),
        _ => inverse_over::<T, { MOST_DERIVATIVES + 1 }>(rigid, inputs),
    }
}

fn inverse_over<T: Real, const N: usize>(rigid: &Rigid<T>, inputs: &[Vec<T>]) -> Vec<T> {
    let reads_states = alg::reads_states(&rigid.model.drives);
    let (rates, x) = match reads_states {
        true => (&inputs[1..inputs.len() - 1], &inputs[inputs.len() - 1][..]),
        false => (&inputs[1..], &[][..]),
    };
    let rates: Vec<&[T]> = rates.iter().map(Vec::as_slice).collect();
    let (u, m) = alg::driven_inverse::<T, N>(rigid.model, &inputs[0], &rates, x, |model, q, qd, qdd| {
        let reduced = rigid.reduced.map(|(torques, h)| (torques.map(Taylor::fixed), h.map(Taylor::fixed)));
        Rigid { model, reduced: reduced.as_ref().map(|(a, b)| (a, b)) }.inverse_dynamics(q, qd, qdd)
    });
    [u, m].concat()
}
