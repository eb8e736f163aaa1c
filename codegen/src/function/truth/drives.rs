//! Drives: the motion that their inputs make, and their torques, by the reference's united model of section 20.3 and its elastic stages.
//!
//! The numbers of the drives are those of the model, where rigid stages are folded into the shafts beside them; what is done with them is
//! the reference's own.

use super::super::driven_derivatives::DrivenForwardDynamicsDerivatives;
use super::super::drives::{
    CompleteModel, DriveEnergy, DrivePower, DriveTorques, DrivenForwardDynamics, DrivenInverseDynamics, StateSpace,
};
use super::super::Quantity;
use super::{list, solved, Chapter, Truth};
use nalgebra::{DMatrix, DVector};
use straightline_core::drive::{Actuator, Drive, Efficiency};
use straightline_core::magnitude::Magnitude;
use straightline_core::model::Model;
use straightline_core::reference::drives::{
    before_elastic_stage, solve_general, ActuatorModel, DcMotor, ElasticStage, UnitedModel,
};
use straightline_core::reference::{self, solve_symmetric};
use straightline_core::{Dd, Real};

/// Gears with losses of which the reference tries all directions, at most.
const MOST_LOSSY: usize = 10;

impl Truth for DrivenForwardDynamics {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let motion = motion(at)?;
        Some([motion.qdd, motion.rates].concat())
    }
}

impl Truth for DriveTorques {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let motion = motion(at)?;
        Some([motion.tau, motion.torques].concat())
    }
}

macro_rules! without_a_formulation {
    ($($Name:ident)*) => {
        $(impl Truth for $Name {
            fn truth(_: &Chapter<'_>) -> Option<Vec<Magnitude>> {
                None
            }
        })*
    };
}

without_a_formulation!(DrivenInverseDynamics CompleteModel StateSpace DrivePower DriveEnergy DrivenForwardDynamicsDerivatives);

/// Whether the reference has a formulation for these drives.
fn is_formulated(drives: &[Drive<Dd>]) -> bool {
    let is_known = |d: &Drive<Dd>| match d.stages.is_empty() {
        true => d.shaft_inertia.is_none() || matches!(d.actuator, Actuator::Motor(_)),
        false => d.efficiency.is_none(),
    };
    drives.iter().all(|d| d.rotor.is_none() && is_known(d))
        && drives.iter().filter(|d| d.efficiency.is_some()).count() <= MOST_LOSSY
}

/// What the inputs make.
struct InputMotion {
    qdd: Vec<Magnitude>,
    /// Of the joints.
    tau: Vec<Magnitude>,
    /// Of the actuators.
    torques: Vec<Magnitude>,
    /// ẋ.
    rates: Vec<Magnitude>,
}

fn motion(at: &Chapter<'_>) -> Option<InputMotion> {
    let model = at.drives.filter(|model| is_formulated(&model.drives))?;
    let (x, u) = (at.get(Quantity::DriveState), at.get(Quantity::DriveInput));
    let bodies = at.with_rotors(reference::mass_matrix(&at.tree, at.q()));
    let bias = at.with_passive(reference::bias_force(&at.tree, at.q(), at.qd()));
    let (mut h_matrix, mut free) = (bodies.clone(), bias.clone());
    let (mut rigid, mut elastic, mut first) = (Vec::new(), Vec::new(), 0);
    for (drive, u) in model.drives.iter().zip(u) {
        let own = &x[first..first + drive.states()];
        first += drive.states();
        let shaft = Shaft::new(model, drive, (at.q(), at.qd()), own, *u);
        if drive.stages.is_empty() {
            rigid.push(shaft);
            continue;
        }
        let found = ElasticDriveState::new(drive, &shaft, own);
        if let Some(gears) = drive.shaft_inertia {
            h_matrix += &shaft.row * shaft.row.transpose() * Magnitude::new(gears);
        }
        free -= &shaft.row * found.torque;
        elastic.push(found);
    }
    let (qdd, of_rigid) = united_motion(h_matrix, free, &rigid);
    let tau = list(&(bodies * &qdd + bias));
    let (mut of_rigid, mut elastic) = (of_rigid.into_iter(), elastic.into_iter());
    let (mut torques, mut rates) = (Vec::new(), Vec::new());
    for drive in &model.drives {
        let (torque, own) = match drive.stages.is_empty() {
            true => of_rigid.next().expect("one per rigid drive"),
            false => elastic.next().map(|e| (e.actuator_torque, e.rates)).expect("one per elastic drive"),
        };
        torques.push(torque);
        rates.extend(own);
    }
    Some(InputMotion { qdd: list(&qdd), tau, torques, rates })
}

/// q̈ of H q̈ + h = Nᵀ r M, and M and ẋ of each rigid drive.
fn united_motion(
    h_matrix: DMatrix<Magnitude>,
    h: DVector<Magnitude>,
    rigid: &[Shaft],
) -> (DVector<Magnitude>, Vec<(Magnitude, Vec<Magnitude>)>) {
    if rigid.is_empty() {
        return (solved(&h_matrix, &-h, solve_symmetric), Vec::new());
    }
    let nv = h.len();
    let mut united = UnitedModel {
        h_matrix,
        h,
        actuators: rigid.iter().map(|shaft| shaft.actuator.clone()).collect(),
        ratios: DMatrix::from_fn(rigid.len(), nv, |i, j| rigid[i].row[j]),
        losses: DVector::from_element(rigid.len(), Magnitude::one()),
    };
    let x = DVector::from_vec(rigid.iter().flat_map(|shaft| shaft.x.iter().copied()).collect());
    let u = DVector::from_iterator(rigid.len(), rigid.iter().map(|shaft| shaft.u));
    let value = |x: Magnitude| x.value;
    let efficiencies: Vec<_> = rigid.iter().map(|shaft| shaft.efficiency).collect();
    let speeds: Vec<Dd> = rigid.iter().map(|shaft| shaft.speed.value).collect();
    let lossy = united.map(value).with_losses(&efficiencies, &speeds, &x.map(value), &u.map(value));
    united.losses = lossy.losses.map(Magnitude::new);
    let motion = united.solve_by(&x, &u, |a, b| solved(a, b, |a, b| solve_general(a.clone(), b.clone())));
    let mut first = 0;
    let of_each = rigid.iter().zip(motion.torques.iter()).map(|(shaft, torque)| {
        // gears on the shaft take their part of what the actuator puts out
        let own = *torque + shaft.gears * shaft.row.dot(&motion.qdd);
        let rates = list(&motion.xd.rows(first, shaft.x.len()));
        first += shaft.x.len();
        (own, rates)
    });
    let of_each = of_each.collect();
    (motion.qdd, of_each)
}

fn both(efficiency: Option<Efficiency<Dd>>) -> Option<(Dd, Dd)> {
    efficiency.map(|e| (e.forward, e.backward))
}

fn sized(x: &[Dd]) -> DVector<Magnitude> {
    DVector::from_iterator(x.len(), x.iter().copied().map(Magnitude::new))
}

fn clamped(x: Magnitude, limit: Option<Dd>) -> Magnitude {
    match limit {
        Some(limit) if x.value.to_f64() > limit.to_f64() => Magnitude::new(limit),
        Some(limit) if x.value.to_f64() < -limit.to_f64() => Magnitude::new(-limit),
        _ => x,
    }
}

/// An actuator and its shaft at a state.
struct Shaft {
    actuator: ActuatorModel<Magnitude>,
    x: DVector<Magnitude>,
    u: Magnitude,
    /// Angle and speed of the last shaft.
    last: [Magnitude; 2],
    speed: Magnitude,
    /// Ratios to the velocity coordinates.
    row: DVector<Magnitude>,
    /// Inertia of the gears on its shaft.
    gears: Magnitude,
    efficiency: Option<(Dd, Dd)>,
}

impl Shaft {
    fn new(
        model: &Model<Dd>,
        drive: &Drive<Dd>,
        (q, qd): (&[Magnitude], &[Magnitude]),
        x: &[Magnitude],
        u: Magnitude,
    ) -> Shaft {
        let mut row = DVector::from_element(model.nv(), Magnitude::zero());
        let mut last = [Magnitude::zero(); 2];
        for (body, n) in &drive.joints {
            let (joint, n) = (&model.bodies[*body].joint, Magnitude::new(*n));
            row[joint.iv] += n;
            last = [last[0] + n * q[joint.iq], last[1] + n * qd[joint.iv]];
        }
        let is_rigid = drive.stages.is_empty();
        let mut own = x[..drive.actuator.states()].to_vec();
        let mut u = clamped(u, drive.input_limit);
        let gears = drive.shaft_inertia.filter(|_| is_rigid).map_or(Magnitude::zero(), Magnitude::new);
        let actuator = match &drive.actuator {
            Actuator::Motor(m) => {
                if is_rigid {
                    own[..2].copy_from_slice(&last);
                }
                let [j, c_m, c_e, b, r] =
                    [m.rotor_inertia, m.torque_constant, m.emf_constant, m.friction, m.resistance].map(Magnitude::new);
                if m.inductance.is_none() {
                    // the voltage that the limited current leaves
                    let emf = c_e * own[1];
                    u = emf + r * clamped((u - emf) / r, drive.current_limit);
                }
                DcMotor { j: j + gears, c_m, c_e, b, r, l: m.inductance.map(Magnitude::new) }.model()
            }
            Actuator::Linear(a) => ActuatorModel {
                c: DMatrix::from_row_slice(a.f.len(), a.f.len(), sized(&a.c).as_slice()),
                f: sized(&a.f),
                d: sized(&a.d),
                t: sized(&a.t),
            },
        };
        let (x, speed, efficiency) = (DVector::from_vec(own), last[1], both(drive.efficiency));
        Shaft { actuator, x, u, last, speed, row, gears, efficiency }
    }
}

/// An elastic drive at a state.
struct ElasticDriveState {
    /// What it exerts on its joints, over their ratios.
    torque: Magnitude,
    actuator_torque: Magnitude,
    rates: Vec<Magnitude>,
}

impl ElasticDriveState {
    fn new(drive: &Drive<Dd>, shaft: &Shaft, x: &[Magnitude]) -> ElasticDriveState {
        let own = drive.actuator.states();
        let start = match &drive.actuator {
            Actuator::Motor(_) => [x[0], x[1]],
            Actuator::Linear(a) => {
                let along = |row: &[Dd]| sized(row).dot(&shaft.x);
                [a.position.as_ref().map_or(Magnitude::zero(), |p| along(p)), along(&a.t)]
            }
        };
        let between = x[own..].chunks(2).map(|shaft| [shaft[0], shaft[1]]);
        let shafts: Vec<[Magnitude; 2]> = std::iter::once(start).chain(between).chain([shaft.last]).collect();
        let number = Magnitude::new;
        let stages = drive.stages.iter().map(|s| ElasticStage {
            n: number(s.ratio),
            i1: number(s.inertia),
            i2: Magnitude::zero(),
            c: number(s.stiffness),
            d: s.damping.map_or(Magnitude::zero(), number),
            eta: both(s.efficiency).map(|(forward, backward)| (number(forward), number(backward))),
        });
        let stages: Vec<ElasticStage<Magnitude>> = stages.collect();
        let pair = |[a, b]: [Magnitude; 2]| (a, b);
        let (mut torques, mut taken) = (Vec::new(), Vec::new());
        for (stage, ends) in stages.iter().zip(shafts.windows(2)) {
            let torque = stage.torque(pair(ends[0]), pair(ends[1]));
            torques.push(torque);
            taken.push(stage.taken(torque, ends[0][1]));
        }
        let first = stages[0].inertia();
        let (actuator_torque, own_rates) = before_elastic_stage(&shaft.actuator, &shaft.x, shaft.u, first, taken[0]);
        let mut rates = list(&own_rates);
        for k in 1..stages.len() {
            rates.extend([shafts[k][1], (torques[k - 1] - taken[k]) / stages[k].inertia()]);
        }
        ElasticDriveState { torque: torques[torques.len() - 1], actuator_torque, rates }
    }
}
