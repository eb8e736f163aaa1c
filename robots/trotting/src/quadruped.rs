//! The quadruped: generated functions, contact modes, and its configurations, which are no vectors.

use crate::{cross, dot};
use straightline::integrate::{self, Step};

/// The quadruped as the controller knows it: forces of gravity, its feet, and its three contact modes with their derivatives.
#[allow(clippy::all, clippy::pedantic)]
pub mod solo12 {
    include!(concat!(env!("OUT_DIR"), "/solo12.rs"));
}

/// The quadruped that is simulated: what its trunk carries is a parameter.
#[allow(clippy::all, clippy::pedantic)]
pub mod plant {
    include!(concat!(env!("OUT_DIR"), "/plant.rs"));
}

/// Coordinates: position and quaternion of the trunk, twelve angles.
pub const NQ: usize = solo12::NQ;
/// Velocities: of the trunk in its own axes, linear and angular, and of the joints.
pub const NV: usize = solo12::NV;
/// Joints, which are driven; the trunk is not.
pub const JOINTS: usize = NV - 6;
/// Feet: front left, front right, hind left, hind right.
pub const FEET: usize = 4;
/// Of a difference of states: increments of the pose in the trunk's axes and of the angles, and differences of velocities.
pub const NX: usize = 2 * NV;
/// What the drives can do \[N·m\]: 2.7 by its makers; the robot file has 1000.
pub const TORQUE: f64 = 2.7;

/// A configuration \[m, rad\] and its velocity \[m/s, rad/s\].
pub type State = integrate::State<f64, NQ, NV>;
/// A difference of two states.
pub type Difference = [f64; NX];
/// A number per velocity.
pub type Velocity = [f64; NV];
/// A number per joint.
pub type Torques = [f64; JOINTS];
/// A force or a place per foot, in the world.
pub type Feet = [[f64; 3]; FEET];

/// The robot as it stands: knees of the front legs to the back, of the hind legs to the front, the trunk above the feet's middle.
pub const STANDING: [f64; NQ] =
    [0.0, 0.0, 0.2229, 0.0, 0.0, 0.0, 1.0, 0.0, 0.8, -1.6, 0.0, 0.8, -1.6, 0.0, -0.8, 1.6, 0.0, -0.8, 1.6];

/// Which feet are on the ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// All of them.
    Four,
    /// Front left and hind right.
    FallingDiagonal,
    /// Front right and hind left.
    RisingDiagonal,
}

impl Mode {
    /// Whether a foot is on the ground.
    pub const fn stands(self, foot: usize) -> bool {
        match self {
            Mode::Four => true,
            Mode::FallingDiagonal => foot == 0 || foot == 3,
            Mode::RisingDiagonal => foot == 1 || foot == 2,
        }
    }
}

/// Motion and forces of the ground in a contact mode, with their slopes. Of a foot in the air all is zero.
#[derive(Clone, Copy, Debug)]
pub struct Slopes {
    /// q̈.
    pub qdd: Velocity,
    /// Forces on the feet, rows x, y, z of foot after foot \[N\].
    pub force: [f64; 3 * FEET],
    /// ∂q̈/∂q.
    pub dqdd_dq: [Velocity; NV],
    /// ∂q̈/∂q̇.
    pub dqdd_dqd: [Velocity; NV],
    /// ∂q̈/∂τ.
    pub dqdd_dtau: [Velocity; NV],
    /// ∂F/∂q.
    pub dforce_dq: [Velocity; 3 * FEET],
    /// ∂F/∂q̇.
    pub dforce_dqd: [Velocity; 3 * FEET],
    /// ∂F/∂τ.
    pub dforce_dtau: [Velocity; 3 * FEET],
}

impl Slopes {
    /// Of nothing.
    pub const ZERO: Slopes = Slopes {
        qdd: [0.0; NV],
        force: [0.0; 3 * FEET],
        dqdd_dq: [[0.0; NV]; NV],
        dqdd_dqd: [[0.0; NV]; NV],
        dqdd_dtau: [[0.0; NV]; NV],
        dforce_dq: [[0.0; NV]; 3 * FEET],
        dforce_dqd: [[0.0; NV]; 3 * FEET],
        dforce_dtau: [[0.0; NV]; 3 * FEET],
    };

    /// In a mode, under τ: a wrench on the trunk in its axes \[N, N·m\], and torques of the joints \[N·m\].
    pub fn of(mode: Mode, state: &State, tau: &Velocity) -> Slopes {
        let State { q, qd } = state;
        let mut out = Slopes::ZERO;
        let Slopes { qdd, force, dqdd_dq, dqdd_dqd, dqdd_dtau, dforce_dq, dforce_dqd, dforce_dtau } = &mut out;
        let pair = match mode {
            Mode::Four => {
                solo12::contact::four::forward_dynamics_derivatives(
                    q,
                    qd,
                    tau,
                    qdd,
                    force,
                    dqdd_dq,
                    dqdd_dqd,
                    dqdd_dtau,
                    dforce_dq,
                    dforce_dqd,
                    dforce_dtau,
                    &mut [0.0],
                );
                return out;
            }
            Mode::FallingDiagonal => solo12::contact::falling_diagonal::forward_dynamics_derivatives,
            Mode::RisingDiagonal => solo12::contact::rising_diagonal::forward_dynamics_derivatives,
        };
        let (mut f, [mut by_q, mut by_qd, mut by_tau]) = ([0.0; 6], [[[0.0; NV]; 6]; 3]);
        pair(q, qd, tau, qdd, &mut f, dqdd_dq, dqdd_dqd, dqdd_dtau, &mut by_q, &mut by_qd, &mut by_tau, &mut [0.0]);
        let standing = (0..FEET).filter(|foot| mode.stands(*foot));
        for (row, to) in standing.flat_map(|foot| 3 * foot..3 * foot + 3).enumerate() {
            (force[to], dforce_dq[to], dforce_dqd[to], dforce_dtau[to]) = (f[row], by_q[row], by_qd[row], by_tau[row]);
        }
        out
    }
}

/// The state a time h \[s\] later at constant q̈: q̇⁺ = q̇ + h q̈, q⁺ = q ⊕ h q̇⁺.
pub fn after(state: &State, qdd: &Velocity, h: f64) -> State {
    let mut next = *state;
    let change = Step::of(h).semi_implicit_euler(0.0, state, |_, _, _, out: &mut Velocity| *out = *qdd);
    next.add(&change, 0);
    next
}

/// The columns of R, the trunk's axes in the world.
pub fn axes(q: &[f64; NQ]) -> [[f64; 3]; 3] {
    let (v, w) = ([q[3], q[4], q[5]], q[6]);
    // R e = e + 2 v × (v × e + w e)
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|e| {
        let inner = cross(&v, &e);
        let turned = cross(&v, &core::array::from_fn(|i| inner[i] + w * e[i]));
        core::array::from_fn(|i| e[i] + 2.0 * turned[i])
    })
}

/// Rᵀ v: a vector of the world in the trunk's axes.
pub fn in_trunk(q: &[f64; NQ], v: &[f64; 3]) -> [f64; 3] {
    axes(q).map(|axis| dot(&axis, v))
}

/// a ⊖ b: increments of b's pose in its own axes, position and twice the vector of the turn between them, and differences of all else.
pub fn difference(a: &State, b: &State) -> Difference {
    let way = in_trunk(&b.q, &core::array::from_fn(|i| a.q[i] - b.q[i]));
    let ([u, v], [s, w]) = ([&b.q, &a.q].map(|q| [q[3], q[4], q[5]]), [b.q[6], a.q[6]]);
    // b⁻¹ ∘ a = (s v − w u − u × v, s w + u · v), of which the sign is that of a turn of less than a half
    let (across, side) = (cross(&u, &v), if s * w + dot(&u, &v) < 0.0 { -2.0 } else { 2.0 });
    core::array::from_fn(|i| match i {
        0..3 => way[i],
        3..6 => side * (s * v[i - 3] - w * u[i - 3] - across[i - 3]),
        6..NV => a.q[i + 1] - b.q[i + 1],
        _ => a.qd[i - NV] - b.qd[i - NV],
    })
}

/// τ of a wrench on the trunk in its axes \[N, N·m\] and torques of the joints \[N·m\].
pub fn generalized_forces(wrench: &[f64; 6], torques: &Torques) -> Velocity {
    core::array::from_fn(|i| if i < 6 { wrench[i] } else { torques[i - 6] })
}

/// Where the feet are \[m\].
pub fn feet(q: &[f64; NQ]) -> Feet {
    let mut places = [[0.0; 3]; FEET];
    solo12::forward_kinematics(q, &mut places);
    places
}

/// ∂/∂q of that: rows x, y, z of the world, columns as in [`Velocity`].
pub fn feet_slopes(q: &[f64; NQ]) -> [[Velocity; 3]; FEET] {
    let mut slopes = [[[0.0; NV]; 3]; FEET];
    solo12::jacobian(q, &mut slopes);
    slopes
}

/// Torques under which the robot nearly stands in a mode: the ground carries its weight with the same force on every foot that is down, straight up.
pub fn holding(mode: Mode, q: &[f64; NQ]) -> Torques {
    let mut g = [0.0; NV];
    solo12::gravity_force(q, &mut g);
    let weight = dot(&core::array::from_fn(|i| axes(q)[i][2]), &[g[0], g[1], g[2]]);
    let down = (0..FEET).filter(|foot| mode.stands(*foot)).count();
    let slopes = feet_slopes(q);
    core::array::from_fn(|i| {
        let carried: f64 = (0..FEET).filter(|foot| mode.stands(*foot)).map(|foot| slopes[foot][2][6 + i]).sum();
        g[6 + i] - carried * weight / down as f64
    })
}
