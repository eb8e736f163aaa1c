//! What a motion asks of the drives: voltages, currents, electrical power and energy, heating, and their limits.
//!
//! Inputs and currents are those of the inverse of robot and drives, dampers of elastic stages left out. A motor heats as two bodies, its
//! winding and its housing, one after the other between the copper and the air:
//!
//! R₁ C_w Ṫ_w = R₁ P − (T_w − T_h), C_h Ṫ_h = (T_w − T_h)/R₁ − (T_h − T_a)/R₂, C_w = τ_w/R₁, C_h = τ_h/R₂,
//!
//! with the Joule heat P = R i² of the winding at its rated temperature; resistances and time constants as data sheets give them.

use crate::analysis::{beginning, Violation};
use crate::drives::{demands, further_derivatives, slack_state, without_dampers, ForcesOnJoints};
use crate::motion::Motion;
use crate::quadrature::integral;
use crate::table::DataTable;
use straightline_core::algorithms::Demand;
use straightline_core::drive::{Actuator, Drive, Thermal};
use straightline_core::model::Model;

/// The figures of the drives over a motion.
#[derive(Clone, Debug)]
pub struct DriveAnalysis {
    /// `t`, then per drive `u.`, `i.`, `speed.` and `m.` of its actuator, `electrical.` \[W\], `joule.` \[W\] and `winding.` \[°C\].
    pub table: DataTable,
    /// Per drive.
    pub drives: Vec<DriveFigures>,
    /// Limits that are exceeded, where they are first.
    pub violations: Vec<Violation>,
    /// Where the motion is not smooth enough for the drives: they would have to jump.
    pub jump: Option<Jump>,
}

/// The figures of a drive.
#[derive(Clone, Debug, PartialEq)]
pub struct DriveFigures {
    /// Name of the drive.
    pub name: String,
    /// Greatest |u| \[V, or the input's unit\], and when \[s\].
    pub input: (f64, f64),
    /// Greatest |i| \[A\], and when \[s\].
    pub current: (f64, f64),
    /// Root of the mean square of i \[A\].
    pub rms_current: f64,
    /// Greatest speed of the actuator \[rad/s\].
    pub speed: f64,
    /// Greatest torque that it puts out \[N·m\].
    pub torque: f64,
    /// Greatest power that it takes \[W\].
    pub power: f64,
    /// Energy that it takes from its supply, and that it gives back \[J\].
    pub energy: (f64, f64),
    /// Joule heat \[J\].
    pub joule: f64,
    /// How it heats, of a motor with thermal data.
    pub heating: Option<Heating>,
}

impl DriveFigures {
    /// All figures: what it is, of which drive, its value.
    pub(crate) fn numbers(&self) -> Vec<(&'static str, &str, f64)> {
        let mut numbers = vec![
            ("input", self.input.0),
            ("current", self.current.0),
            ("rms current", self.rms_current),
            ("motor speed", self.speed),
            ("motor torque", self.torque),
            ("electrical power", self.power),
            ("energy taken", self.energy.0),
            ("energy given back", self.energy.1),
            ("Joule heat", self.joule),
        ];
        if let Some(heating) = &self.heating {
            let Heating { peak, settled: (winding, housing), limit_after } = heating;
            let after = limit_after.unwrap_or(0.0);
            numbers.extend([
                ("greatest temperature of the winding", *peak),
                ("settled temperature of the winding", *winding),
                ("settled temperature of the housing", *housing),
                ("time until the winding is too hot", after),
            ]);
        }
        numbers.into_iter().map(|(what, x)| (what, self.name.as_str(), x)).collect()
    }
}

/// Temperatures of a motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heating {
    /// Greatest temperature of the winding over the motion from cold on \[°C\].
    pub peak: f64,
    /// Winding and housing when the motion is repeated for ever \[°C\], mean over the motion.
    pub settled: (f64, f64),
    /// After how long of repetition the winding reaches its limit \[s\], if ever.
    pub limit_after: Option<f64>,
}

/// A derivative of a coordinate that jumps and that the drives would have to follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jump {
    /// When \[s\].
    pub time: f64,
    /// The coordinate.
    pub coordinate: usize,
    /// Which derivative.
    pub order: usize,
}

/// A drive at an instant.
struct Instant {
    input: f64,
    current: f64,
    speed: f64,
    torque: f64,
    electrical: f64,
    joule: f64,
}

impl Instant {
    fn new(drive: &Drive<f64>, demand: &Demand<f64>) -> Instant {
        let current = demand.current.unwrap_or(0.0);
        let speed = demand.shafts[0][1];
        let (electrical, joule) = match &drive.actuator {
            Actuator::Motor(motor) => (demand.input * current, motor.resistance * current * current),
            Actuator::Linear(_) => (demand.torque * speed, 0.0),
        };
        Instant { input: demand.input, current, speed, torque: demand.torque, electrical, joule }
    }
}

/// Analyses the drives over a motion at these instants, each with the piece of the motion that it lies on; `None` if their inputs do not
/// follow from a motion, or there are none.
pub fn analyze(model: &Model<f64>, motion: &Motion, instants: &[(usize, f64)]) -> Option<DriveAnalysis> {
    if model.drives.is_empty() {
        return None;
    }
    let orders = further_derivatives(model)?;
    let undamped = without_dampers(model);
    let ask = |mut rates: Vec<Vec<f64>>| -> Vec<Instant> {
        let q = rates.remove(0);
        let x = slack_state(&undamped, &q, &rates[0]);
        let asked = demands(&undamped, &q, &rates, &x, ForcesOnJoints::Motion(&vec![0.0; model.nv()]));
        model.drives.iter().zip(&asked).map(|(drive, demand)| Instant::new(drive, demand)).collect()
    };
    let rows: Vec<Vec<Instant>> =
        instants.iter().map(|(piece, t)| ask(motion.derivatives_in_piece(*piece, *t))).collect();
    let times: Vec<f64> = instants.iter().map(|(_, t)| *t).collect();
    let n = model.drives.len();
    let windings: Vec<Vec<f64>> = (0..n)
        .map(|k| {
            let heat: Vec<f64> = rows.iter().map(|row| row[k].joule).collect();
            let thermal = &model.drives[k].rating.thermal;
            thermal.as_ref().map_or_else(|| vec![0.0; times.len()], |thermal| winding(thermal, &times, &heat))
        })
        .collect();
    let of_drives = |prefix: &str| model.drives.iter().map(|d| format!("{prefix}.{}", d.name)).collect::<Vec<_>>();
    let names = ["u", "i", "speed", "m", "electrical", "joule", "winding"].iter().flat_map(|p| of_drives(p));
    let names = std::iter::once("t".to_string()).chain(names).collect();
    let row = |(i, row): (usize, &Vec<Instant>)| -> Vec<f64> {
        let columns: [&dyn Fn(usize) -> f64; 7] = [
            &|k| row[k].input,
            &|k| row[k].current,
            &|k| row[k].speed,
            &|k| row[k].torque,
            &|k| row[k].electrical,
            &|k| row[k].joule,
            &|k| windings[k][i],
        ];
        std::iter::once(times[i]).chain(columns.iter().flat_map(|c| (0..n).map(c))).collect()
    };
    let table = DataTable { names, rows: rows.iter().enumerate().map(row).collect() };
    let drives = (0..n).map(|k| figures(&model.drives[k], &times, &rows, k, &windings[k])).collect();
    let at = |k: usize, t: f64| ask(motion.derivatives(t)).swap_remove(k);
    let mut violations: Vec<Violation> =
        (0..n).flat_map(|k| violations(&model.drives[k], &times, &rows, k, &windings[k], &at)).collect();
    violations.sort_by(|a, b| a.time.total_cmp(&b.time));
    Some(DriveAnalysis { table, drives, violations, jump: jump(motion, orders + 1) })
}

/// The first knot within the motion where a derivative up to `order` jumps by more than rounding, and at its ends those that are not zero
/// but should be for a motion from rest to rest: a drive that must know the next derivative meets an impulse there.
fn jump(motion: &Motion, order: usize) -> Option<Jump> {
    let pieces = motion.times.len() - 1;
    (1..pieces).find_map(|k| {
        let time = motion.times[k];
        let [before, after] = [k - 1, k].map(|piece| motion.derivatives_in_piece(piece, time));
        (1..=order).find_map(|order| {
            // what the derivative amounts to within the pieces beside it: the rounding of a knot is that of their greatest terms
            let reach = |c: usize| motion.greatest_terms(k - 1, order)[c].max(motion.greatest_terms(k, order)[c]);
            let jumps = |c: usize| (before[order][c] - after[order][c]).abs() > 1e-9 * reach(c);
            (0..motion.coordinates()).find(|c| jumps(*c)).map(|coordinate| Jump { time, coordinate, order })
        })
    })
}

fn figures(drive: &Drive<f64>, times: &[f64], rows: &[Vec<Instant>], k: usize, winding: &[f64]) -> DriveFigures {
    let greatest = |y: &dyn Fn(&Instant) -> f64| {
        let better = |(best, at): (f64, f64), i: usize| match y(&rows[i][k]) {
            value if value > best => (value, times[i]),
            _ => (best, at),
        };
        (0..rows.len()).fold((f64::NEG_INFINITY, 0.0), better)
    };
    let duration = times[times.len() - 1] - times[0];
    let sum = |y: &dyn Fn(&Instant) -> f64| integral(times, |i| y(&rows[i][k]));
    let joule = sum(&|d| d.joule);
    let heating = drive.rating.thermal.as_ref().map(|thermal| {
        let power = joule / duration;
        let housing = thermal.ambient + power * thermal.housing_ambient;
        let settled = housing + power * thermal.winding_housing;
        Heating {
            peak: winding.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            settled: (settled, housing),
            limit_after: limit_after(thermal, power),
        }
    });
    DriveFigures {
        name: drive.name.clone(),
        input: greatest(&|d| d.input.abs()),
        current: greatest(&|d| d.current.abs()),
        rms_current: (sum(&|d| d.current * d.current) / duration).sqrt(),
        speed: greatest(&|d| d.speed.abs()).0,
        torque: greatest(&|d| d.torque.abs()).0,
        power: greatest(&|d| d.electrical).0,
        energy: (sum(&|d| d.electrical.max(0.0)), sum(&|d| (-d.electrical).max(0.0))),
        joule,
        heating,
    }
}

/// Steps of T = (T_w, T_h) above the ambient: implicit midpoint, stable whatever the time constants.
fn step(thermal: &Thermal<f64>, [w, h]: [f64; 2], heat: f64, dt: f64) -> [f64; 2] {
    // Ẇ = R₁ P/τ_w − (W − H)/τ_w, Ḣ = (R₂/R₁ (W − H) − H)/τ_h
    let (a, b) = (1.0 / thermal.winding_time, 1.0 / thermal.housing_time);
    let r = thermal.housing_ambient / thermal.winding_housing;
    let rate = [a * (thermal.winding_housing * heat - (w - h)), b * (r * (w - h) - h)];
    // (E − dt/2 A) Δ = dt · rate, A = [−a, a; b r, −b (r + 1)]
    let s = 0.5 * dt;
    let [m00, m01, m10, m11] = [1.0 + s * a, -s * a, -s * b * r, 1.0 + s * b * (r + 1.0)];
    let determinant = m00 * m11 - m01 * m10;
    let (x, y) = (dt * rate[0], dt * rate[1]);
    [w + (m11 * x - m01 * y) / determinant, h + (m00 * y - m10 * x) / determinant]
}

/// Temperatures of the winding at all instants \[°C\], from ambient on.
fn winding(thermal: &Thermal<f64>, times: &[f64], heat: &[f64]) -> Vec<f64> {
    let mut state = [0.0; 2];
    let mut temperatures = vec![thermal.ambient];
    for i in 1..times.len() {
        state = step(thermal, state, 0.5 * (heat[i] + heat[i - 1]), times[i] - times[i - 1]);
        temperatures.push(thermal.ambient + state[0]);
    }
    temperatures
}

/// After how long the winding reaches its limit under this mean heat \[s\].
fn limit_after(thermal: &Thermal<f64>, heat: f64) -> Option<f64> {
    let rise = thermal.limit? - thermal.ambient;
    if heat * (thermal.winding_housing + thermal.housing_ambient) <= rise {
        return None;
    }
    if rise <= 0.0 {
        return Some(0.0);
    }
    // W(t) = W∞ − c₁ e^{−λ₁ t} − c₂ e^{−λ₂ t} from W(0) = 0, Ẇ(0) = a R₁ P; with λ₁ + λ₂ = a + b (r + 1), λ₁ λ₂ = a b both are real
    let (a, b) = (1.0 / thermal.winding_time, 1.0 / thermal.housing_time);
    let r = thermal.housing_ambient / thermal.winding_housing;
    let apart = (a - b * (r + 1.0)).hypot(2.0 * (a.sqrt() * b.sqrt() * r.sqrt()));
    let fast = 0.5 * (a + b * (r + 1.0) + apart);
    let slow = a * (b / fast);
    let settled = heat * (thermal.winding_housing + thermal.housing_ambient);
    // λ₁ = λ₂ without a resistance to the air only, where there is one body
    let of_fast = if apart > 0.0 { (a * thermal.winding_housing * heat - slow * settled) / apart } else { 0.0 };
    // W = Σ c (1 − e^{−λ t}): no difference of large numbers while little time has gone by
    let risen = |t: f64| -(of_fast * (-fast * t).exp_m1() + (settled - of_fast) * (-slow * t).exp_m1());
    // it rises all the time; in forty of the longer time constants it is there, or within rounding of it
    let (mut before, mut after) = (0.0, 40.0 / slow);
    if !(after.is_finite() && risen(after) >= rise) {
        return None;
    }
    // halved until the two are neighbours, which takes as often as there are bits and powers of two: some 1100 times at most
    loop {
        let middle = 0.5 * (before + after);
        if middle <= before || middle >= after {
            break;
        }
        match risen(middle) >= rise {
            true => after = middle,
            false => before = middle,
        }
    }
    Some(after)
}

/// The limits of a drive that the motion exceeds.
fn violations(
    drive: &Drive<f64>,
    times: &[f64],
    rows: &[Vec<Instant>],
    k: usize,
    winding: &[f64],
    at: &dyn Fn(usize, f64) -> Instant,
) -> Vec<Violation> {
    type Quantity = fn(&Instant) -> f64;
    let sides: [(&'static str, Option<f64>, Quantity); 3] = [
        ("voltage", drive.input_limit, |d| d.input.abs()),
        ("current", drive.current_limit, |d| d.current.abs()),
        ("motor speed", drive.rating.speed, |d| d.speed.abs()),
    ];
    let joint = || drive.name.clone();
    let violation = |time, what, limit, worst| Violation { time, joint: joint(), what, limit, worst };
    let mut found = Vec::new();
    for (what, limit, quantity) in sides {
        let Some(limit) = limit else { continue };
        let beyond = |y: f64| y - limit > 1e-12 * limit;
        let Some(first) = rows.iter().position(|row| beyond(quantity(&row[k]))) else { continue };
        let worst = rows.iter().map(|row| quantity(&row[k])).fold(0.0, f64::max);
        let within = times[first.saturating_sub(1)];
        let time = beginning(within, times[first], |t| beyond(quantity(&at(k, t))));
        found.push(violation(time, what, limit, worst));
    }
    if let Some(limit) = drive.rating.continuous_current {
        let mean = integral(times, |i| rows[i][k].current * rows[i][k].current) / (times[times.len() - 1] - times[0]);
        if mean.sqrt() > limit {
            found.push(violation(times[times.len() - 1], "rms current", limit, mean.sqrt()));
        }
    }
    if let Some(limit) = drive.rating.thermal.as_ref().and_then(|t| t.limit) {
        if let Some(first) = winding.iter().position(|t| *t > limit) {
            let worst = winding.iter().copied().fold(0.0, f64::max);
            found.push(violation(times[first], "winding temperature", limit, worst));
        }
    }
    found
}

/// The torque of a motor C_M i \[N·m\] that its limits allow at a speed \[rad/s\]: least and greatest; infinite without limits.
pub fn torque_limits(drive: &Drive<f64>, speed: f64) -> Option<(f64, f64)> {
    let Actuator::Motor(motor) = &drive.actuator else { return None };
    let by_voltage = |voltage: f64| motor.torque_constant * (voltage - motor.emf_constant * speed) / motor.resistance;
    let input = drive.input_limit.unwrap_or(f64::INFINITY);
    let by_current = motor.torque_constant * drive.current_limit.unwrap_or(f64::INFINITY);
    Some((by_voltage(-input).max(-by_current), by_voltage(input).min(by_current)))
}
