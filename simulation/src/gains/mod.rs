//! Feedback gains for a motion, from the dynamics along it (20.4.1: synthesis of control parameters): gains per joint from the range of
//! inertia, and gains from everywhere to everywhere by linear quadratic regulation; both with their margins, and followed in simulations.
//!
//! Both answer deviations by torques beside those of the motion, τ(r, ṙ, r̈) + K (r − q) + D (ṙ − q̇), computed once per period and held.
//!
//! | gains | from |
//! |---|---|
//! | per joint | K = m ω², D = 2 ζ m ω, m the greatest H_jj along the motion: with less inertia the joint is faster and damped more; ω as wanted, or as the period allows with margins of 30 degrees and twice the gain |
//! | LQR | the discrete Riccati recursion backwards along the motion, from what holds its end for ever; errors and torques weigh as squares of parts of what is borne (Bryson's rule) |

pub(crate) mod linear;
pub(crate) mod margins;

pub use linear::Linear;
pub use margins::Margins;

use crate::command::{Command, Compensation, Controller, Samples};
use crate::failure::Failure;
use crate::motion::Motion;
use crate::plant::Plant;
use crate::simulate::{simulate, Settings};
use crate::table::DataTable;
use linear::without_dry_friction;
use margins::SampledLoop;
use nalgebra::{DMatrix, DVector};
use straightline_core::model::Model;
use straightline_core::spatial::SpatialInertia;

/// What is wanted of gains.
#[derive(Clone, Debug, PartialEq)]
pub struct GainDemand {
    /// Time from one computation to the next \[s\].
    pub period: f64,
    /// Periods from a measurement to the torques that follow from it.
    pub delay: usize,
    /// Natural frequency of each joint \[Hz\].
    pub bandwidth: Vec<f64>,
    /// Damping ratio of each joint.
    pub damping: Vec<f64>,
    /// Error of each joint that is borne \[rad or m\].
    pub position_error: Vec<f64>,
    /// Error of each velocity that is borne \[rad/s or m/s\]; `None`: what goes with the error of the position at the natural frequency.
    pub velocity_error: Option<Vec<f64>>,
    /// Torque or force that such errors are worth \[N·m or N\]; `None`: m (2π f)² times the error of the position,
    /// m the greatest inertia and f the bandwidth.
    pub torque: Option<Vec<f64>>,
    /// How much greater masses and inertias are in the simulations than the controller knows, as a part.
    pub mass_error: f64,
    /// By how much every joint is off at the beginning of the simulations \[rad or m\].
    pub start_error: Vec<f64>,
}

impl GainDemand {
    /// For so many joints: a millisecond, no delay, 5 Hz, critical damping, 0.01 rad or m.
    pub fn of(joints: usize) -> GainDemand {
        GainDemand {
            period: 1e-3,
            delay: 0,
            bandwidth: vec![5.0; joints],
            damping: vec![1.0; joints],
            position_error: vec![0.01; joints],
            velocity_error: None,
            torque: None,
            mass_error: 0.1,
            start_error: vec![0.01; joints],
        }
    }
}

/// Gains for a motion.
#[derive(Clone, Debug)]
pub struct GainProposal {
    /// What was wanted.
    pub demand: GainDemand,
    /// Per driven joint.
    pub joints: Vec<JointGains>,
    /// K of each joint \[N·m/rad or N/m\], of passive joints zero.
    pub stiffness: Vec<f64>,
    /// D of each joint.
    pub damping: Vec<f64>,
    /// The gains of LQR over time: (K, D) by rows, of all joints n rows of 2n.
    pub schedule: Samples,
    /// The greatest modulus of an eigenvalue of the closed loops at instants of the motion: per joint, LQR. Stable below one.
    pub spectral_radius: [f64; 2],
}

/// Gains of a driven joint and what they do.
#[derive(Clone, Debug, PartialEq)]
pub struct JointGains {
    /// Name of the joint.
    pub name: String,
    /// Index into the velocities.
    pub index: usize,
    /// The least and the greatest inertia along the motion \[kg·m² or kg\]: 1/(H⁻¹)_jj, all other joints free, and H_jj, all others held.
    pub inertia: (f64, f64),
    /// Natural frequency from the greatest to the least inertia \[Hz\].
    pub frequency: (f64, f64),
    /// Damping ratio from the greatest to the least inertia.
    pub ratio: (f64, f64),
    /// The least margins along the motion: of gains per joint, of LQR; `None` where that loop is not stable.
    pub margins: [Option<Margins>; 2],
}

/// Steps of the recursion, at most.
const MOST_STEPS: usize = 50_000;
/// Doublings until gains stand still at the end of the motion, at most.
const DOUBLINGS: usize = 60;
/// Instants along the motion at which inertia is looked at, and margins.
const INSTANTS: [usize; 2] = [200, 9];
/// Rows of gains over time, at most.
const ROWS: usize = 200;

/// Proposes gains for a motion.
///
/// # Errors
/// Robots with drives, more steps than there is room for, no inertia, or an end of the motion that nothing holds.
pub fn propose(model: &Model<f64>, motion: &Motion, demand: &GainDemand) -> Result<GainProposal, Failure> {
    if !model.drives.is_empty() {
        let why = "gains are proposed for joint torques, and the robot has drives".to_string();
        return Err(Failure::new(0.0, why)
            .with_help("leave the drives out: gains of voltages and currents follow from those of torques"));
    }
    let model = &without_dry_friction(model);
    let driven: Vec<usize> = model.independently_jointed().filter(|b| !b.is_passive()).map(|b| b.joint.iv).collect();
    let (first, last) = (motion.times[0], motion.duration());
    let steps = ((last - first) / demand.period).ceil();
    if !(steps.is_finite() && steps <= MOST_STEPS as f64) {
        let why = format!("{:?} s with a period of {:?} s are {steps:.1e} steps", last - first, demand.period);
        return Err(Failure::new(first, why)
            .with_help(&format!("at most {MOST_STEPS} are possible: a longer period, or a shorter motion")));
    }
    let at = |t: f64| {
        let (q, qd, qdd) = motion.at(t);
        let about = Linear::about(model, (&q, &qd, &qdd), &driven);
        about.ok_or_else(|| Failure::new(t, "the mass matrix has no inverse".to_string()))
    };
    let along = |count: usize| (0..count).map(move |k| first + (last - first) * k as f64 / (count - 1) as f64);

    let mut inertia = vec![(f64::INFINITY, 0.0f64); driven.len()];
    for t in along(INSTANTS[0]) {
        let here = at(t)?;
        for (of, j) in inertia.iter_mut().zip(&driven) {
            *of = (of.0.min(1.0 / here.h_inverse[(*j, *j)]), of.1.max(here.h[(*j, *j)]));
        }
    }
    let plants: Vec<(f64, Sampled)> =
        along(INSTANTS[1]).map(|t| Ok((t, at(t)?.sampled(demand.period)))).collect::<Result<_, Failure>>()?;
    let n = model.nv();
    let (stiffness, damping, of_joints) = per_joint(demand, (n, &driven, &inertia), &plants);
    let mut wanted = vec![0.0; n];
    for ((_, high), j) in inertia.iter().zip(&driven) {
        wanted[*j] = high * (std::f64::consts::TAU * demand.bandwidth[*j]).powi(2);
    }
    let schedule = regulator(demand, (n, &driven, &wanted), (first, steps as usize), &at)?;
    let of_lqr = judged(&plants, demand.delay, |t| {
        let row = schedule.at(t);
        DMatrix::from_fn(driven.len(), 2 * n, |k, i| row[driven[k] * 2 * n + i])
    });
    let spectral_radius = [of_joints.0, of_lqr.0];
    let margins: Vec<[Option<Margins>; 2]> = of_joints.1.into_iter().zip(of_lqr.1).map(|(a, b)| [a, b]).collect();
    let joints = model.joints();
    let of = |(k, j): (usize, &usize)| {
        let (low, high) = inertia[k];
        let omega = |m: f64| (stiffness[*j] / m).sqrt() / std::f64::consts::TAU;
        let ratio = |m: f64| damping[*j] / (2.0 * (stiffness[*j] * m).sqrt());
        JointGains {
            name: joints.iter().find(|joint| joint.iv == *j).map_or(String::new(), |joint| joint.name.clone()),
            index: *j,
            inertia: inertia[k],
            frequency: (omega(high), omega(low)),
            ratio: (ratio(high), ratio(low)),
            margins: margins[k],
        }
    };
    let joints = driven.iter().enumerate().map(of).collect();
    Ok(GainProposal { demand: demand.clone(), joints, stiffness, damping, schedule, spectral_radius })
}

/// Φ and Γ.
type Sampled = (DMatrix<f64>, DMatrix<f64>);

/// The greatest modulus of an eigenvalue of loops along a motion, and the least margins of every driven joint, where all are stable.
type Judgement = (f64, Vec<Option<Margins>>);

fn judged(plants: &[(f64, Sampled)], delay: usize, gains: impl Fn(f64) -> DMatrix<f64>) -> Judgement {
    let joints = plants.first().map_or(0, |(_, (_, gamma))| gamma.ncols());
    let (mut worst, mut margins) = (0.0f64, vec![Some(Margins::INFINITE); joints]);
    for (t, (phi, gamma)) in plants {
        let gains = gains(*t);
        let closed = SampledLoop { phi, gamma, gains: &gains, delay };
        let radius = closed.spectral_radius();
        worst = worst.max(radius);
        let found = if radius < 1.0 { closed.margins() } else { Vec::new() };
        for (k, least) in margins.iter_mut().enumerate() {
            *least = least.zip(found.get(k).copied()).map(|(a, b)| a.worst(b));
        }
    }
    (worst, margins)
}

/// Margins that gains per joint keep: 30 degrees, and twice the gain.
pub const KEPT: (f64, f64) = (std::f64::consts::FRAC_PI_6, 2.0);
/// How often frequencies are lowered until margins are kept, each time by a fifth.
const LOWERINGS: usize = 15;

/// K and D of all joints, and what they are worth. Frequencies are those that are wanted, as far as the period allows: an answer D to the
/// velocity of a mass m, held for h and d periods late, is stable up to D h/m = 2 sin(π / (4 d + 2)), and m is the least inertia here,
/// that beside free joints. Where the joints take more from each other, those without margins are lowered; of all rounds the one with the best margins counts.
fn per_joint(
    demand: &GainDemand,
    (n, driven, inertia): (usize, &[usize], &[(f64, f64)]),
    plants: &[(f64, Sampled)],
) -> (Vec<f64>, Vec<f64>, Judgement) {
    let most = 2.0 * (std::f64::consts::PI / (4 * demand.delay + 2) as f64).sin() / KEPT.1;
    let allowed = |k: usize, j: usize| {
        let (low, high) = inertia[k];
        let by_period = most * low / (2.0 * demand.damping[j] * high * demand.period);
        by_period.min(std::f64::consts::TAU * demand.bandwidth[j])
    };
    let mut omega: Vec<f64> = driven.iter().enumerate().map(|(k, j)| allowed(k, *j)).collect();
    let mut left = LOWERINGS;
    let mut best: Option<(f64, Vec<f64>, Vec<f64>, Judgement)> = None;
    loop {
        let (mut stiffness, mut damping) = (vec![0.0; n], vec![0.0; n]);
        for (k, j) in driven.iter().enumerate() {
            stiffness[*j] = inertia[k].1 * omega[k] * omega[k];
            damping[*j] = 2.0 * demand.damping[*j] * inertia[k].1 * omega[k];
        }
        let gains = DMatrix::from_fn(driven.len(), 2 * n, |k, i| match driven[k] {
            j if i == j => stiffness[j],
            j if i == n + j => damping[j],
            _ => 0.0,
        });
        let found = judged(plants, demand.delay, |_| gains.clone());
        let keeps = |m: &Option<Margins>| m.is_some_and(|m| m.phase >= KEPT.0 && m.gain.1 >= KEPT.1);
        let is_done = found.1.iter().all(keeps);
        let part = |m: &Option<Margins>| m.map_or(0.0, |m| (m.phase / KEPT.0).min(m.gain.1 / KEPT.1));
        let worth = found.1.iter().map(part).fold(f64::INFINITY, f64::min);
        if best.as_ref().is_none_or(|(least, ..)| worth > *least) {
            best = Some((worth, stiffness, damping, found.clone()));
        }
        if left == 0 || is_done {
            let (_, stiffness, damping, found) = best.expect("a round was made");
            return (stiffness, damping, found);
        }
        left -= 1;
        // where a loop is not stable nobody knows whose fault it is: those that the period holds back come first
        let is_stable = found.0 < 1.0;
        let held_back = |k: usize| omega[k] < 0.999 * std::f64::consts::TAU * demand.bandwidth[driven[k]];
        let is_one = (0..driven.len()).any(held_back);
        let lowered: Vec<bool> =
            (0..driven.len()).map(|k| if is_stable { !keeps(&found.1[k]) } else { !is_one || held_back(k) }).collect();
        omega.iter_mut().zip(lowered).filter(|(_, is)| *is).for_each(|(omega, _)| *omega *= 0.8);
    }
}

/// S and K = (R + Γᵀ S Γ)⁻¹ Γᵀ S Φ one step before S: S⁻ = Q + Φᵀ S (Φ − Γ K).
fn riccati(
    s: &DMatrix<f64>,
    (phi, gamma): &Sampled,
    (q, r): (&DMatrix<f64>, &DMatrix<f64>),
) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    let ahead = gamma.transpose() * s;
    let gains = (r + &ahead * gamma).cholesky()?.solve(&(&ahead * phi));
    let next = q + phi.transpose() * s * (phi - gamma * &gains);
    // what rounding leaves unsymmetric grows
    Some(((&next + next.transpose()) * 0.5, gains))
}

/// Where the recursion comes to rest, by doubling: after k steps as far as 2ᵏ of the recursion (Chu, Fan, Lin and Wang 2004).
fn steady((phi, gamma): &Sampled, (q, r): (&DMatrix<f64>, &DMatrix<f64>)) -> Option<DMatrix<f64>> {
    let n = phi.nrows();
    let (mut a, mut h) = (phi.clone(), q.clone());
    let mut g = gamma * r.clone().cholesky()?.solve(&gamma.transpose());
    for _ in 0..DOUBLINGS {
        // W = I + G H; A⁺ = A W⁻¹ A, G⁺ = G + A W⁻¹ G Aᵀ, H⁺ = H + Aᵀ H W⁻¹ A
        let w = (DMatrix::identity(n, n) + &g * &h).lu();
        let (wa, wg) = (w.solve(&a)?, w.solve(&g)?);
        let next = &h + a.transpose() * &h * &wa;
        g += &a * wg * a.transpose();
        a = &a * wa;
        let change = (&next - &h).norm();
        h = (&next + next.transpose()) * 0.5;
        if !h.iter().all(|x| x.is_finite()) {
            return None;
        }
        if change <= 1e-12 * h.norm() {
            return Some(h);
        }
    }
    None
}

/// The gains of LQR along the motion, at most [`ROWS`] of them, the last one holding its end.
fn regulator(
    demand: &GainDemand,
    (n, driven, stiffness): (usize, &[usize], &[f64]),
    (first, steps): (f64, usize),
    at: &dyn Fn(f64) -> Result<Linear, Failure>,
) -> Result<Samples, Failure> {
    // Bryson's rule: one over the squares of what is borne
    let inverse_square = |x: f64| 1.0 / (x * x);
    let errors = &demand.position_error;
    let velocity = |j: usize| match &demand.velocity_error {
        Some(errors) => errors[j],
        None => errors[j] * std::f64::consts::TAU * demand.bandwidth[j],
    };
    let torque = |j: usize| demand.torque.as_ref().map_or(stiffness[j] * errors[j], |torque| torque[j]);
    let weights = (0..n).map(|j| inverse_square(errors[j])).chain((0..n).map(|j| inverse_square(velocity(j))));
    let q = DMatrix::from_diagonal(&DVector::from_iterator(2 * n, weights));
    let r = DMatrix::from_diagonal(&DVector::from_iterator(
        driven.len(),
        driven.iter().map(|j| inverse_square(torque(*j))),
    ));
    let indefinite = |t: f64| {
        Failure::new(t, "the Riccati recursion has no solution".to_string())
            .with_help("are errors and torques that are borne of a size that the robot can have?")
    };

    let time = |k: usize| first + demand.period * k as f64;
    let end = at(time(steps))?.sampled(demand.period);
    let nothing_holds = || {
        let why = "no gains hold the end of the motion: the recursion does not come to rest".to_string();
        Failure::new(time(steps), why)
            .with_help("joints that nothing drives have to be held by springs, or moved by the others")
    };
    let mut s = steady(&end, (&q, &r)).ok_or_else(nothing_holds)?;
    let (_, gains_at_end) = riccati(&s, &end, (&q, &r)).ok_or_else(|| indefinite(time(steps)))?;
    let row = |gains: &DMatrix<f64>| {
        let mut row = vec![0.0; 2 * n * n];
        for (k, j) in driven.iter().enumerate() {
            (0..2 * n).for_each(|i| row[j * 2 * n + i] = gains[(k, i)]);
        }
        row
    };
    let every = steps.div_ceil(ROWS).max(1);
    let (mut times, mut rows) = (vec![time(steps)], vec![row(&gains_at_end)]);
    for k in (0..steps).rev() {
        let (next, gains) =
            riccati(&s, &at(time(k))?.sampled(demand.period), (&q, &r)).ok_or_else(|| indefinite(time(k)))?;
        s = next;
        if k % every == 0 {
            times.push(time(k));
            rows.push(row(&gains));
        }
    }
    times.reverse();
    rows.reverse();
    Ok(Samples { times, rows })
}

impl GainProposal {
    /// The gains of LQR as a table: `t`, then per driven joint `K.JOINT.q.OTHER` and `K.JOINT.qd.OTHER` of all joints.
    pub fn table(&self, model: &Model<f64>) -> DataTable {
        let mut all: Vec<(usize, &str)> = model.joints().iter().map(|j| (j.iv, j.name.as_str())).collect();
        all.sort_unstable();
        let n = all.len();
        let of = |joint: &JointGains| {
            let name = joint.name.clone();
            let others = ["q", "qd"].into_iter().flat_map(|p| all.iter().map(move |(_, other)| (p, *other)));
            others.map(move |(p, other)| format!("K.{name}.{p}.{other}")).collect::<Vec<_>>()
        };
        let names = std::iter::once("t".to_string()).chain(self.joints.iter().flat_map(of)).collect();
        let row = |(t, row): (&f64, &Vec<f64>)| {
            let own = self.joints.iter().flat_map(|j| row[j.index * 2 * n..(j.index + 1) * 2 * n].to_vec());
            std::iter::once(*t).chain(own).collect()
        };
        DataTable { names, rows: self.schedule.times.iter().zip(&self.schedule.rows).map(row).collect() }
    }

    /// A controller of the motion's torques and these gains: per joint, or of LQR.
    pub fn controller(&self, model: &Model<f64>, motion: &Motion, is_lqr: bool) -> Controller {
        let none = vec![0.0; model.nv()];
        Controller {
            model: model.clone(),
            compensation: Compensation::FeedForward,
            motion: motion.clone(),
            stiffness: if is_lqr { none.clone() } else { self.stiffness.clone() },
            damping: if is_lqr { none } else { self.damping.clone() },
            feedback: is_lqr.then(|| self.schedule.clone()),
            saturates: true,
            gives_currents: false,
            period: Some(self.demand.period),
            delay: self.demand.delay,
        }
    }

    /// What a controller makes of the motion where the robot is heavier than it knows, and off at the beginning, as the demand says:
    /// errors over time, a column per driven joint.
    ///
    /// # Errors
    /// The simulation does not go through.
    pub fn followed(&self, model: &Model<f64>, controller: Controller) -> Result<Tracking, Failure> {
        let mut heavier = model.clone();
        let part = 1.0 + self.demand.mass_error;
        for body in &mut heavier.bodies {
            let inertia = &body.inertia;
            let scaled = inertia.inertia_com.map(|j| part * j);
            body.inertia = SpatialInertia::new(part * inertia.mass, inertia.com, scaled);
        }
        let motion = controller.motion.clone();
        let (mut q, qd, _) = motion.at(motion.times[0]);
        self.joints.iter().for_each(|j| q[j.index] += self.demand.start_error[j.index]);
        let settings = Settings { stops_at_limits: false, tolerance: 1e-7, ..Settings::lasting(motion.duration()) };
        let command = Command::Controller(Box::new(controller));
        let run = simulate(&Plant::new(heavier, COULOMB_SPEED), &command, (&q, &qd), &settings, &|_| ())?;
        let column = |j: &JointGains| run.table.column(&format!("error.{}", j.name)).unwrap_or_default();
        Ok(Tracking {
            times: run.table.column("t").unwrap_or_default(),
            errors: self.joints.iter().map(column).collect(),
        })
    }
}

/// Speed at which Coulomb friction of the simulated robot has reached 71 % \[rad/s or m/s\].
const COULOMB_SPEED: f64 = 1e-3;

/// How a motion was followed.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracking {
    /// Times \[s\].
    pub times: Vec<f64>,
    /// Per driven joint the error at these times, reference less measured \[rad or m\].
    pub errors: Vec<Vec<f64>>,
}

impl Tracking {
    /// The greatest error of a driven joint and the root of the mean square \[rad or m\].
    pub fn figures(&self, k: usize) -> (f64, f64) {
        let errors = &self.errors[k];
        let square = errors.iter().map(|e| e * e).sum::<f64>() / errors.len().max(1) as f64;
        (errors.iter().fold(0.0, |m, e| m.max(e.abs())), square.sqrt())
    }
}
