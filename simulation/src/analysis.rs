//! What a prescribed motion asks of joints and drives: torques, power, energy, what joints carry, and where limits end.

use crate::drive_analysis::{self, DriveAnalysis, DriveFigures};
use crate::motion::Motion;
use crate::plant::{angle_beyond_sines, joint_friction};
use crate::quadrature::integral;
use crate::simulate::{Failure, MOST_NUMBERS};
use crate::table::DataTable;
use straightline_core::algorithms::{inverse_dynamics, joint_wrenches, kinetic_energy, potential_energy};
use straightline_core::model::{Joint, Model};
use straightline_core::spatial::ForceVector;

/// The figures of a motion.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// `t`, then per joint `q.`, `qd.`, `qdd.`, `tau.`, `power.`.
    pub table: DataTable,
    /// `t`, then per joint `force.` and `moment.` with `.x`, `.y`, `.z`: what the joint exerts on its link, in the link's axes, about
    /// the joint's origin.
    pub wrenches: DataTable,
    /// Per joint.
    pub joints: Vec<JointFigures>,
    /// Every limit that is exceeded, where it is first, the earliest first.
    pub violations: Vec<Violation>,
    /// What the motion asks of the drives, if the robot has drives whose inputs follow from a motion.
    pub drives: Option<DriveAnalysis>,
    /// Kinetic and potential energy at the end less that at the beginning \[J\].
    pub energy_change: f64,
    /// What friction in the joints turns into heat \[J\].
    pub friction: f64,
}

impl Analysis {
    /// Energy that the drives give less what they take \[J\].
    pub fn given(&self) -> f64 {
        self.joints.iter().map(|j| j.given - j.taken).sum()
    }

    /// Whether all numbers are finite: of tables, of what was integrated and squared, and of temperatures.
    ///
    /// # Errors
    /// The first one that is not, by name, with the time of its row.
    fn check(&self) -> Result<(), Failure> {
        let help = "are masses, lengths, the motion and its times of a size that the robot can have?";
        for table in [&self.table, &self.wrenches].into_iter().chain(self.drives.as_ref().map(|d| &d.table)) {
            table.check().map_err(|(t, why)| Failure::new(t, why).with_help(help))?;
        }
        let of_joints = self.joints.iter().flat_map(|j| {
            let JointFigures { name, peak, rms, speed, power, given, taken, carried, .. } = j;
            let figures = [
                ("peak", peak.0),
                ("rms", *rms),
                ("speed", *speed),
                ("power", *power),
                ("energy given", *given),
                ("energy taken", *taken),
                ("force", carried.0),
                ("moment", carried.1),
            ];
            figures.map(|(what, x)| (what, name.as_str(), x))
        });
        let of_drives = self.drives.iter().flat_map(|d| &d.drives).flat_map(DriveFigures::numbers);
        let of_all =
            [("energy change", self.energy_change), ("friction", self.friction), ("missing energy", self.missing())];
        let of_all = of_all.map(|(what, x)| (what, "all joints", x));
        match of_joints.chain(of_drives).chain(of_all).find(|(.., x)| !x.is_finite()) {
            None => Ok(()),
            Some((what, name, x)) => {
                let t = self.table.rows.last().map_or(0.0, |row| row[0]);
                Err(Failure::new(t, format!("`{what}` of {name} is {x}, not a finite number")).with_help(help))
            }
        }
    }

    /// By how much the books are open \[J\]: what drives give, less the change of energy, less friction. It is the error of the integrals
    /// over the instants, nothing else.
    pub fn missing(&self) -> f64 {
        self.given() - self.energy_change - self.friction
    }
}

/// The figures of a joint over a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct JointFigures {
    /// Name of the joint.
    pub name: String,
    /// Unit of its forces.
    pub unit: &'static str,
    /// Greatest |τ| \[N·m or N\], and when \[s\].
    pub peak: (f64, f64),
    /// Root of the mean square of τ \[N·m or N\].
    pub rms: f64,
    /// Greatest |q̇| \[rad/s or m/s\].
    pub speed: f64,
    /// Greatest power of the drive \[W\].
    pub power: f64,
    /// Energy that the drive gives \[J\].
    pub given: f64,
    /// Energy that the drive takes \[J\].
    pub taken: f64,
    /// Greatest modulus of the force \[N\] and of the moment \[N·m\] in the joint.
    pub carried: (f64, f64),
}

/// A limit that is exceeded.
#[derive(Clone, Debug, PartialEq)]
pub struct Violation {
    /// When, for the first time \[s\].
    pub time: f64,
    /// The joint, or the drive.
    pub joint: String,
    /// Of what: `position`, `speed` or `effort` of a joint, `voltage`, `current`, `motor speed`, `rms current` or `winding temperature`
    /// of a drive.
    pub what: &'static str,
    /// The limit.
    pub limit: f64,
    /// The worst value over the motion.
    pub worst: f64,
}

/// Where the forces of a motion come from: the generic runtime of a model, or a generated program.
pub trait ForceSource {
    /// Joint torques or forces \[N·m or N\].
    fn torques(&self, q: &[f64], qd: &[f64], qdd: &[f64]) -> Vec<f64>;
    /// What every joint exerts on its link: force \[N\], then moment about the joint's origin \[N·m\], in the link's axes.
    fn wrenches(&self, q: &[f64], qd: &[f64], qdd: &[f64]) -> Vec<[f64; 6]>;
}

impl ForceSource for Model<f64> {
    fn torques(&self, q: &[f64], qd: &[f64], qdd: &[f64]) -> Vec<f64> {
        inverse_dynamics(self, q, qd, qdd)
    }

    fn wrenches(&self, q: &[f64], qd: &[f64], qdd: &[f64]) -> Vec<[f64; 6]> {
        let six = |w: &ForceVector<f64>| {
            let ([fx, fy, fz], [mx, my, mz]) = (w.force.to_array(), w.moment.to_array());
            [fx, fy, fz, mx, my, mz]
        };
        joint_wrenches(self, q, qd, qdd).iter().map(six).collect()
    }
}

/// The motion at the instants of an analysis: time, q, q̇, q̈; at a knot between two pieces twice.
pub fn states(motion: &Motion, interval: f64) -> Vec<(f64, [Vec<f64>; 3])> {
    let at = |(piece, t): (usize, f64)| {
        let (q, qd, qdd) = motion.in_piece(piece, t);
        (t, [q, qd, qdd])
    };
    instants(motion, interval).into_iter().map(at).collect()
}

/// Analyses a motion of all joints at instants at most `interval` \[s\] apart, limits by root finding between them.
///
/// # Errors
/// Too many instants, angles beyond those whose sine has digits, or a number that is not finite.
pub fn analyze(model: &Model<f64>, motion: &Motion, interval: f64) -> Result<Analysis, Failure> {
    analyze_by(model, model, motion, interval)
}

/// Analyses a motion with torques and joint forces by equations of its caller, such as generated ones.
///
/// # Errors
/// As [`analyze`].
pub fn analyze_by(
    model: &Model<f64>,
    equations: &dyn ForceSource,
    motion: &Motion,
    interval: f64,
) -> Result<Analysis, Failure> {
    let joints = model.joints();
    check(motion, interval, 1 + 11 * joints.len() + 7 * model.drives.len())?;
    let instants = instants(motion, interval);
    let names = |prefixes: &[&str], ends: &[&str]| -> Vec<String> {
        let of = |p: &&str| joints.iter().flat_map(|j| ends.iter().map(|e| format!("{p}.{}{e}", j.name))).collect();
        let lists: Vec<Vec<String>> = prefixes.iter().map(of).collect();
        std::iter::once("t".to_string()).chain(lists.into_iter().flatten()).collect()
    };
    let mut table = DataTable { names: names(&["q", "qd", "qdd", "tau", "power"], &[""]), rows: Vec::new() };
    let mut wrenches = DataTable { names: names(&["force", "moment"], &[".x", ".y", ".z"]), rows: Vec::new() };
    for &(piece, t) in &instants {
        let (q, qd, qdd) = motion.in_piece(piece, t);
        if let Some((joint, q)) = angle_beyond_sines(model, &q) {
            let why = format!("joint `{joint}` is at {q} rad, where a sine has no digits left");
            return Err(Failure::new(t, why));
        }
        let tau = equations.torques(&q, &qd, &qdd);
        let power: Vec<f64> = tau.iter().zip(&qd).map(|(tau, qd)| tau * qd).collect();
        table.rows.push([&[t], &q[..], &qd, &qdd, &tau, &power].concat());
        // joints that follow others come last, and are no joints of the table
        let carried = equations.wrenches(&q, &qd, &qdd);
        let carried = &carried[..joints.len()];
        let forces = carried.iter().flat_map(|w| w[..3].to_vec());
        let moments = carried.iter().flat_map(|w| w[3..].to_vec());
        wrenches.rows.push(std::iter::once(t).chain(forces).chain(moments).collect());
    }
    let n = joints.len();
    let figures = (0..n).map(|j| figures(joints[j], j, n, &table, &wrenches)).collect();
    let mut violations: Vec<Violation> = joints
        .iter()
        .enumerate()
        .flat_map(|(j, joint)| violations((model, equations), motion, joint, (j, n), &table))
        .collect();
    let drives = drive_analysis::analyze(model, motion, &instants);
    violations.extend(drives.iter().flat_map(|d| d.violations.iter().cloned()));
    violations.sort_by(|a, b| a.time.total_cmp(&b.time));
    let energy = |t: f64| {
        let (q, qd, _) = motion.at(t);
        kinetic_energy(model, &q, &qd) + potential_energy(model, &q)
    };
    let energy_change = energy(motion.duration()) - energy(motion.times[0]);
    let times: Vec<f64> = table.rows.iter().map(|row| row[0]).collect();
    let friction = integral(&times, |k| joint_friction(model, &table.rows[k][1..=n], &table.rows[k][1 + n..=2 * n]));
    let found = Analysis { table, wrenches, joints: figures, violations, drives, energy_change, friction };
    found.check()?;
    Ok(found)
}

/// # Errors
/// A motion that takes more instants than there is room for.
fn check(motion: &Motion, interval: f64, columns: usize) -> Result<(), Failure> {
    if !(interval.is_finite() && interval > 0.0) {
        return Err(Failure::new(0.0, format!("the interval is {interval}, no positive number")));
    }
    let rows = (motion.duration() - motion.times[0]) / interval + 3.0 * motion.times.len() as f64;
    let most = (MOST_NUMBERS / columns) as f64;
    if rows > most {
        let duration = motion.duration();
        let why =
            format!("{duration:?} s with an instant every {interval:?} s are {rows:.1e} rows of {columns} numbers");
        let help = format!("at most {most:.0} rows are possible: a greater --interval, or a shorter motion");
        return Err(Failure::new(0.0, why).with_help(&help));
    }
    Ok(())
}

/// Instants from knot to knot with the piece that they lie on, equally spaced, odd in number; a knot between two pieces is in both.
fn instants(motion: &Motion, interval: f64) -> Vec<(usize, f64)> {
    let piece = |(k, pair): (usize, &[f64])| {
        let (start, end) = (pair[0], pair[1]);
        let steps = 2 * (0.5 * (end - start) / interval).ceil().max(1.0) as usize;
        let at = move |i: usize| if i == steps { end } else { start + (end - start) * i as f64 / steps as f64 };
        (0..=steps).map(move |i| (k, at(i))).collect::<Vec<_>>()
    };
    motion.times.windows(2).enumerate().flat_map(piece).collect()
}

fn figures(joint: &Joint, j: usize, n: usize, table: &DataTable, wrenches: &DataTable) -> JointFigures {
    let rows = &table.rows;
    let times: Vec<f64> = rows.iter().map(|row| row[0]).collect();
    let (qd, tau, power) =
        (|k: usize| rows[k][1 + n + j], |k: usize| rows[k][1 + 3 * n + j], |k: usize| rows[k][1 + 4 * n + j]);
    let greatest = |y: &dyn Fn(usize) -> f64| {
        let better = |(best, at): (f64, usize), k: usize| if y(k) > best { (y(k), k) } else { (best, at) };
        (0..rows.len()).fold((f64::NEG_INFINITY, 0), better)
    };
    let (peak, at) = greatest(&|k| tau(k).abs());
    let modulus = |first: usize| {
        let of = |k: usize| wrenches.rows[k][first..first + 3].iter().map(|x| x * x).sum::<f64>().sqrt();
        greatest(&of).0
    };
    let time = times.last().unwrap_or(&0.0) - times[0];
    JointFigures {
        name: joint.name.clone(),
        unit: joint.kind.units()[3],
        peak: (peak, times[at]),
        rms: (integral(&times, |k| tau(k) * tau(k)) / time).sqrt(),
        speed: greatest(&|k| qd(k).abs()).0,
        power: greatest(&power).0,
        given: integral(&times, |k| power(k).max(0.0)),
        taken: integral(&times, |k| (-power(k)).max(0.0)),
        carried: (modulus(1 + 3 * j), modulus(1 + 3 * n + 3 * j)),
    }
}

/// Where something begins that is not so `before` and is so `after`: bisection.
pub(crate) fn beginning(mut before: f64, mut after: f64, is_so: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..if before < after { 50 } else { 0 } {
        let middle = 0.5 * (before + after);
        match is_so(middle) {
            true => after = middle,
            false => before = middle,
        }
    }
    after
}

/// The limits of a joint that the motion exceeds.
fn violations(
    (model, equations): (&Model<f64>, &dyn ForceSource),
    motion: &Motion,
    joint: &Joint,
    (j, n): (usize, usize),
    table: &DataTable,
) -> Vec<Violation> {
    let limits = joint.limits;
    let value = |what: &str, t: f64| {
        let (q, qd, qdd) = motion.at(t);
        match what {
            "position" => q[j],
            "speed" => qd[j],
            _ => equations.torques(&q, &qd, &qdd)[j],
        }
    };
    // of a passive joint the effort is what its motion would take beside its spring
    let effort = if model.bodies.iter().any(|b| b.joint.iv == joint.iv && b.is_passive()) {
        f64::INFINITY
    } else {
        limits.effort
    };
    let sides = [
        ("position", j, limits.upper, 1.0),
        ("position", j, limits.lower, -1.0),
        ("speed", n + j, limits.velocity, 1.0),
        ("speed", n + j, -limits.velocity, -1.0),
        ("effort", 3 * n + j, effort, 1.0),
        ("effort", 3 * n + j, -effort, -1.0),
    ];
    let found = sides.into_iter().filter_map(|(what, column, limit, sign)| {
        let beyond = |y: f64| sign * (y - limit) > 1e-12 * limit.abs();
        let rows = &table.rows;
        let first = rows.iter().position(|row| beyond(row[1 + column]))?;
        let worst = rows.iter().map(|row| row[1 + column]).max_by(|a, b| (sign * a).total_cmp(&(sign * b)))?;
        let within = rows[first.saturating_sub(1)][0];
        let time = beginning(within, rows[first][0], |t| beyond(value(what, t)));
        Some(Violation { time, joint: joint.name.clone(), what, limit, worst })
    });
    found.collect()
}
