//! Drives: the motion that their inputs make, and their torques, by the reference's united model of section 20.3 and its elastic stages.
//!
//! The numbers of the drives are those of the model, where rigid stages are folded into the shafts beside them; what is done with them is
//! the reference's own.

use super::{Random, State};
use crate::function::Function;
use nalgebra::{DMatrix, DVector};
use straightline_core::drive::{Actuator, Drive, Efficiency};
use straightline_core::model::Model;
use straightline_core::reference::drives::{
    before_elastic_stage, solve_general, ActuatorModel, DcMotor, ElasticStage, UnitedModel,
};
use straightline_core::reference::solve_symmetric;
use straightline_core::Dd;
use straightline_graph::Scalar;

/// Gears with losses of which the reference tries all directions, at most.
const MOST_LOSSY: usize = 10;

/// Whether the reference has a formulation of a function for these drives.
pub(super) fn has(function: Function, drives: &[Drive<Dd>]) -> bool {
    let is_known = |d: &Drive<Dd>| match d.stages.is_empty() {
        true => d.shaft_inertia.is_none() || matches!(d.actuator, Actuator::Motor(_)),
        false => d.efficiency.is_none(),
    };
    matches!(function, Function::DrivenForwardDynamics | Function::DriveTorques)
        && drives.iter().all(|d| d.rotor.is_none() && is_known(d))
        && drives.iter().filter(|d| d.efficiency.is_some()).count() <= MOST_LOSSY
}

/// States and inputs: shafts near where slack springs have them, currents within their limits.
pub(super) fn random_inputs(model: &Model<Dd>, scalar: Scalar, state: &mut State, random: &mut Random) {
    let narrow = |x: f64| scalar.rounded(x);
    let (mut x, mut u) = (Vec::new(), Vec::new());
    for drive in &model.drives {
        let last = last_shaft(model, drive, &wide(&state.q), &wide(&state.qd)).0;
        let mut shafts = vec![last.map(Dd::to_f64)];
        for stage in drive.stages.iter().rev() {
            let behind = shafts[shafts.len() - 1];
            let slack = [random.symmetric(0.01), random.symmetric(0.1)];
            shafts.push([0, 1].map(|i| (behind[i] + slack[i]) * stage.ratio.to_f64()));
        }
        shafts.reverse();
        match &drive.actuator {
            Actuator::Motor(motor) => {
                let greatest = drive.current_limit.map_or(3.0, |limit| limit.to_f64().min(3.0));
                x.extend(shafts[0]);
                x.extend(motor.inductance.map(|_| random.symmetric(0.9 * greatest)));
            }
            Actuator::Linear(a) => x.extend(a.f.iter().map(|_| random.symmetric(1.0))),
        }
        x.extend(shafts.iter().take(drive.stages.len()).skip(1).flatten());
        u.push(random.symmetric(drive.input_limit.map_or(20.0, |limit| 1.2 * limit.to_f64())));
    }
    for (name, values) in [("x", x), ("u", u)] {
        state.others.insert(name.to_string(), values.into_iter().map(narrow).collect());
    }
}

/// Numbers and their natural scales.
type Scaled = (Vec<Dd>, Vec<f64>);

/// A drive at a state.
struct At {
    model: ActuatorModel,
    x: DVector<Dd>,
    /// x with the sums of the moduli of the terms of angle and speed where these are sums.
    sizes: DVector<Dd>,
    u: Dd,
    speed: Dd,
    /// Ratios to the velocity coordinates.
    row: Vec<Dd>,
    /// Inertia of the actuator and the gears on its shaft; none of a shaft that does not give way.
    gives_way: Option<f64>,
    /// Of the gears on its shaft.
    gears: Dd,
    /// Sum of the moduli of the terms of its torque while it does not accelerate; of θ̈ of a shaft that does not give way.
    free: f64,
    efficiency: Option<(Dd, Dd)>,
}

/// Values and natural scales of a function that [`has`], from H, h and the scale of h.
pub(super) fn outputs(
    function: Function,
    model: &Model<Dd>,
    h: &[Dd],
    (bias, bias_scale): (&[Dd], &[f64]),
    state: &State,
) -> (Vec<Dd>, Vec<f64>) {
    let nv = model.nv();
    let (q, qd, x, u) = (wide(&state.q), wide(&state.qd), wide(state.get("x")), wide(state.get("u")));
    let rigid_bodies = DMatrix::from_column_slice(nv, nv, h);
    let (mut h_matrix, mut free) = (rigid_bodies.clone(), DVector::from_column_slice(bias));
    let mut forces = bias_scale.to_vec();
    let mut rigid: Vec<At> = Vec::new();
    // of every drive: M and ẋ with their scales, of rigid ones later
    let mut found: Vec<Option<[Scaled; 2]>> = Vec::new();
    let mut first = 0;
    for (drive, u) in model.drives.iter().zip(&u) {
        let own = &x[first..first + drive.states()];
        first += drive.states();
        let at = At::new(model, drive, (&q, &qd), own, *u);
        if drive.stages.is_empty() {
            let free = if at.gives_way.is_some() { at.free } else { 0.0 };
            let reflected = free * at.efficiency.map_or(1.0, |(_, backward)| 1.0 / backward.to_f64());
            forces.iter_mut().zip(&at.row).for_each(|(f, n)| *f += n.to_f64().abs() * reflected);
            found.push(None);
            rigid.push(at);
            continue;
        }
        let elastic = Elastic::new(model, drive, &at, (&q, &qd), own);
        if let Some(gears) = drive.shaft_inertia {
            let row = DVector::from_column_slice(&at.row);
            h_matrix += &row * row.transpose() * gears;
        }
        for (i, n) in at.row.iter().enumerate() {
            free[i] -= *n * elastic.torque;
            forces[i] += n.to_f64().abs() * elastic.torque_scale;
        }
        found.push(Some([(vec![elastic.actuator_torque.0], vec![elastic.actuator_torque.1]), elastic.rates]));
    }
    let united = (!rigid.is_empty()).then(|| {
        let united = UnitedModel {
            h_matrix: h_matrix.clone(),
            h: free.clone(),
            actuators: rigid.iter().map(|a| a.model.clone()).collect(),
            ratios: DMatrix::from_fn(rigid.len(), nv, |i, j| rigid[i].row[j]),
            losses: DVector::from_element(rigid.len(), Dd::ONE),
        };
        let stacked: Vec<Dd> = rigid.iter().flat_map(|a| a.x.iter().copied()).collect();
        let (x, u) = (DVector::from_vec(stacked), DVector::from_iterator(rigid.len(), rigid.iter().map(|a| a.u)));
        let efficiencies: Vec<_> = rigid.iter().map(|a| a.efficiency).collect();
        let speeds: Vec<Dd> = rigid.iter().map(|a| a.speed).collect();
        let lossy = united.with_losses(&efficiencies, &speeds, &x, &u);
        let motion = lossy.solve(&x, &u);
        (lossy.losses, motion)
    });
    let qdd = united.as_ref().map_or_else(|| solve_symmetric(&h_matrix, &-free.clone()), |(_, m)| m.qdd.clone());
    let of_links = h_matrix.clone();
    // |H*⁻¹| (scales of forces + |H*| |q̈|), H* with the rotors
    let mut complete = h_matrix.clone();
    if let Some((losses, _)) = &united {
        for (at, r) in rigid.iter().zip(losses.iter()) {
            let row = DVector::from_column_slice(&at.row);
            complete += &row * row.transpose() * (*r * Dd::from(at.gives_way.unwrap_or(0.0)));
        }
    }
    let moduli = |m: &DMatrix<Dd>, x: &[f64]| -> Vec<f64> {
        (0..nv).map(|i| (0..nv).map(|j| m[(i, j)].to_f64().abs() * x[j]).sum()).collect()
    };
    let sizes: Vec<f64> = qdd.iter().map(|x| x.to_f64().abs()).collect();
    let inertial = moduli(&complete, &sizes);
    let right: Vec<f64> = forces.iter().zip(&inertial).map(|(f, i)| f + i).collect();
    // where a shaft does not give way, the row of its joint says n q̈ = θ̈
    let mut right = right;
    for at in rigid.iter().filter(|at| at.gives_way.is_none()) {
        let joint = at.row.iter().position(|n| *n != Dd::ZERO).expect("it has a joint");
        complete.row_mut(joint).fill(Dd::ZERO);
        complete[(joint, joint)] = at.row[joint];
        right[joint] = at.free;
    }
    let mut inverse = DMatrix::from_element(nv, nv, Dd::ZERO);
    for j in 0..nv {
        let unit = DVector::from_fn(nv, |i, _| if i == j { Dd::ONE } else { Dd::ZERO });
        inverse.set_column(j, &solve_general(complete.clone(), unit));
    }
    let qdd_scale = moduli(&inverse, &right);
    let tau = &rigid_bodies * &qdd + DVector::from_column_slice(bias);
    let mut tau_scale: Vec<f64> =
        right.iter().zip(moduli(&complete, &qdd_scale)).map(|(force, motion)| force + motion).collect();
    let links = moduli(&of_links, &qdd_scale);
    for at in rigid.iter().filter(|at| at.gives_way.is_none()) {
        let joint = at.row.iter().position(|n| *n != Dd::ZERO).expect("it has a joint");
        tau_scale[joint] = forces[joint] + links[joint];
    }
    if let Some((_, motion)) = &united {
        let (mut first, mut k) = (0, 0);
        for slot in found.iter_mut().filter(|slot| slot.is_none()) {
            let (at, n) = (&rigid[k], rigid[k].x.len());
            let acceleration: f64 = at.row.iter().zip(&qdd_scale).map(|(n, a)| n.to_f64().abs() * a).sum();
            let torque = match at.gives_way {
                Some(inertia) => at.free + inertia * acceleration,
                // what its joint takes, losses in the gear
                None => {
                    let joint = at.row.iter().position(|n| *n != Dd::ZERO).expect("it has a joint");
                    let lossy = at.efficiency.map_or(1.0, |(forward, _)| 1.0 / forward.to_f64());
                    tau_scale[joint] / at.row[joint].to_f64().abs() * lossy
                }
            };
            let phi = at.row.iter().zip(qdd.iter()).fold(Dd::ZERO, |sum, (n, a)| sum + *n * *a);
            // gears on the shaft take their part of what the actuator puts out
            let own = motion.torques[k] + at.gears * phi;
            let rates: Vec<Dd> = motion.xd.rows(first, n).iter().copied().collect();
            *slot = Some([(vec![own], vec![torque]), (rates, at.rate_scales(torque, acceleration))]);
            (first, k) = (first + n, k + 1);
        }
    }
    let [mut torques, mut rates] = [(Vec::new(), Vec::new()), (Vec::new(), Vec::new())];
    for [torque, rate] in found.into_iter().flatten() {
        for (all, one) in [(&mut torques, torque), (&mut rates, rate)] {
            all.0.extend(one.0);
            all.1.extend(one.1);
        }
    }
    let qdd: Vec<Dd> = qdd.iter().copied().collect();
    let tau: Vec<Dd> = tau.iter().copied().collect();
    match function {
        Function::DriveTorques => ([tau, torques.0].concat(), [tau_scale, torques.1].concat()),
        _ => ([qdd, rates.0].concat(), [qdd_scale, rates.1].concat()),
    }
}

fn wide(x: &[f64]) -> Vec<Dd> {
    x.iter().map(|x| Dd::from(*x)).collect()
}

fn both(efficiency: Option<Efficiency<Dd>>) -> Option<(Dd, Dd)> {
    efficiency.map(|e| (e.forward, e.backward))
}

/// Angle and speed of the last shaft, and the sums of the moduli of their terms.
fn last_shaft(model: &Model<Dd>, drive: &Drive<Dd>, q: &[Dd], qd: &[Dd]) -> ([Dd; 2], [f64; 2]) {
    let (mut values, mut scales) = ([Dd::ZERO; 2], [0.0; 2]);
    for (body, n) in &drive.joints {
        let joint = &model.bodies[*body].joint;
        for (i, x) in [q[joint.iq], qd[joint.iv]].into_iter().enumerate() {
            values[i] += *n * x;
            scales[i] += (*n * x).to_f64().abs();
        }
    }
    (values, scales)
}

fn clamped(x: Dd, limit: Option<Dd>) -> Dd {
    match limit {
        Some(limit) if x.to_f64() > limit.to_f64() => limit,
        Some(limit) if x.to_f64() < -limit.to_f64() => -limit,
        _ => x,
    }
}

impl At {
    fn new(model: &Model<Dd>, drive: &Drive<Dd>, (q, qd): (&[Dd], &[Dd]), x: &[Dd], u: Dd) -> At {
        let (shaft, shaft_sizes) = last_shaft(model, drive, q, qd);
        let is_rigid = drive.stages.is_empty();
        let mut row = vec![Dd::ZERO; model.nv()];
        drive.joints.iter().for_each(|(body, n)| row[model.bodies[*body].joint.iv] += *n);
        let mut own = x[..drive.actuator.states()].to_vec();
        let mut u = clamped(u, drive.input_limit);
        let gears = if is_rigid { drive.shaft_inertia.unwrap_or(Dd::ZERO) } else { Dd::ZERO };
        let actuator = match &drive.actuator {
            Actuator::Motor(m) => {
                if is_rigid {
                    own[..2].copy_from_slice(&shaft);
                }
                if m.inductance.is_none() {
                    // the voltage that the limited current leaves
                    let emf = m.emf_constant * own[1];
                    u = emf + m.resistance * clamped((u - emf) / m.resistance, drive.current_limit);
                }
                let (j, c_m, c_e) = (m.rotor_inertia + gears, m.torque_constant, m.emf_constant);
                DcMotor { j, c_m, c_e, b: m.friction, r: m.resistance, l: m.inductance }.model()
            }
            Actuator::Linear(a) => ActuatorModel {
                c: DMatrix::from_row_slice(a.f.len(), a.f.len(), &a.c),
                f: DVector::from_column_slice(&a.f),
                d: DVector::from_column_slice(&a.d),
                t: DVector::from_column_slice(&a.t),
            },
        };
        let own = DVector::from_vec(own);
        let mut sizes = own.clone();
        if let (true, Actuator::Motor(_)) = (is_rigid, &drive.actuator) {
            (sizes[0], sizes[1]) = (Dd::from(shaft_sizes[0]), Dd::from(shaft_sizes[1]));
        }
        let terms = moduli_of_rates(&actuator, &sizes, u);
        let driving: f64 = terms.iter().zip(actuator.t.iter()).map(|(x, t)| t.to_f64().abs() * x).sum();
        let is_unyielding = matches!(&drive.actuator, Actuator::Linear(a) if a.is_unyielding);
        let whole = if is_unyielding { 1.0 } else { 1.0 / actuator.t.dot(&actuator.f).to_f64().abs() };
        At {
            free: whole * driving,
            // the rotor's own, with the gears of its shaft
            gives_way: match &drive.actuator {
                Actuator::Motor(m) => Some((m.rotor_inertia + gears).to_f64()),
                Actuator::Linear(_) => (!is_unyielding).then_some(whole),
            },
            gears,
            x: own,
            sizes,
            u,
            speed: shaft[1],
            row,
            efficiency: both(drive.efficiency),
            model: actuator,
        }
    }

    /// Scales of ẋ, for those of M and θ̈.
    fn rate_scales(&self, torque: f64, acceleration: f64) -> Vec<f64> {
        let terms = moduli_of_rates(&self.model, &self.sizes, self.u);
        let with_torque = |(i, x): (usize, &f64)| {
            let turning = if self.model.f[i].to_f64() == 0.0 { 0.0 } else { acceleration };
            x + self.model.f[i].to_f64().abs() * torque + turning
        };
        terms.iter().enumerate().map(with_torque).collect()
    }
}

/// Σ |C_ij x_j| + |d_i u|.
fn moduli_of_rates(a: &ActuatorModel, x: &DVector<Dd>, u: Dd) -> Vec<f64> {
    let term = |i: usize| -> f64 {
        let state: f64 = (0..x.len()).map(|j| (a.c[(i, j)] * x[j]).to_f64().abs()).sum();
        state + (a.d[i] * u).to_f64().abs()
    };
    (0..x.len()).map(term).collect()
}

/// An elastic drive at a state.
struct Elastic {
    torque: Dd,
    torque_scale: f64,
    actuator_torque: (Dd, f64),
    rates: Scaled,
}

impl Elastic {
    fn new(model: &Model<Dd>, drive: &Drive<Dd>, at: &At, (q, qd): (&[Dd], &[Dd]), x: &[Dd]) -> Elastic {
        let (last, last_scale) = last_shaft(model, drive, q, qd);
        let own = drive.actuator.states();
        let start = match &drive.actuator {
            Actuator::Motor(_) => [x[0], x[1]],
            Actuator::Linear(a) => {
                let along = |row: &[Dd]| row.iter().zip(x).fold(Dd::ZERO, |sum, (a, x)| sum + *a * *x);
                [a.position.as_ref().map_or(Dd::ZERO, |p| along(p)), along(&a.t)]
            }
        };
        let between = x[own..].chunks(2).map(|shaft| [shaft[0], shaft[1]]);
        let shafts: Vec<[Dd; 2]> = std::iter::once(start).chain(between).chain([last]).collect();
        let size = |k: usize| match k + 1 == shafts.len() {
            true => last_scale,
            false => shafts[k].map(|x| x.to_f64().abs()),
        };
        let stages: Vec<ElasticStage> = drive
            .stages
            .iter()
            .map(|s| ElasticStage {
                n: s.ratio,
                i1: s.inertia,
                i2: Dd::ZERO,
                c: s.stiffness,
                d: s.damping.unwrap_or(Dd::ZERO),
                eta: both(s.efficiency),
            })
            .collect();
        let pair = |[a, b]: [Dd; 2]| (a, b);
        let (mut torques, mut taken) = (Vec::new(), Vec::new());
        for (k, stage) in stages.iter().enumerate() {
            let torque = stage.torque(pair(shafts[k]), pair(shafts[k + 1]));
            let n = stage.n.to_f64().abs();
            let stretch = [0, 1].map(|i| size(k)[i] / n + size(k + 1)[i]);
            let scale = stage.c.to_f64() * stretch[0] + stage.d.to_f64() * stretch[1];
            let lossy = stage.eta.map_or(1.0, |(forward, _)| 1.0 / forward.to_f64());
            torques.push((torque, scale));
            taken.push((stage.taken(torque, shafts[k][1]), scale / n * lossy));
        }
        let first = stages[0].inertia();
        let (m, own_rates) = before_elastic_stage(&at.model, &at.x, at.u, first, taken[0].0);
        let (acceleration, m_scale) = match at.gives_way {
            Some(inertia) => {
                let acceleration = (at.free + taken[0].1) / (inertia + first.to_f64());
                (acceleration, at.free + inertia * acceleration)
            }
            None => (at.free, taken[0].1 + first.to_f64() * at.free),
        };
        let mut rates: Vec<Dd> = own_rates.iter().copied().collect();
        let mut scales = at.rate_scales(m_scale, acceleration);
        for k in 1..stages.len() {
            let inertia = stages[k].inertia();
            rates.extend([shafts[k][1], (torques[k - 1].0 - taken[k].0) / inertia]);
            scales.extend([size(k)[1], (torques[k - 1].1 + taken[k].1) / inertia.to_f64()]);
        }
        let (torque, torque_scale) = torques[torques.len() - 1];
        Elastic { torque, torque_scale, actuator_torque: (m, m_scale), rates: (rates, scales) }
    }
}
