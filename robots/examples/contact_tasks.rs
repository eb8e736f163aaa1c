//! Four contact tasks of a UR5, simulated through all their phases (approach, impact, contact, lift-off) with generated code:
//! writing with friction, a peg in a hole, pressing on an elastic wall, hammering. The scene is
//! `scenes/ur5_contact_tasks.toml`. Prints the events, draws `target/contact_tasks.svg`: distance, reaction, energy.
//!
//! ```text
//! cargo run --release -p straightline-robots --example contact_tasks
//! ```

use plotters::prelude::*;
use std::error::Error;
use std::path::Path;
use straightline_core::phases::{ContactTask, Simulation};
use straightline_robots::ur5_contact as ur5;
use ur5::contact::{nail, peg, pen, wall};

const N: usize = 6;
/// q, q̇, and an object's own coordinate with its rate.
const STATE: usize = 2 * N + 2;
/// Seconds.
const STEP: f64 = 2.5e-4;
const DURATION: f64 = 3.0;
/// Stiffness and damping of the controller along positions \[N/m, N·s/m\] and axes \[N·m, N·m·s\].
const GAINS: [(f64, f64); 2] = [(3000.0, 250.0), (90.0, 7.0)];
const INK: RGBColor = RGBColor(45, 45, 45);
const LINE: RGBColor = RGBColor(31, 119, 180);
const GRID: RGBColor = RGBColor(225, 225, 225);

/// The six coordinates of the tool against an object, in the order px, py, pz, ax, ay, az.
struct ToolCoordinates {
    s: [f64; 6],
    sd: [f64; 6],
    j: [[f64; N]; 6],
}

/// What a contact does with q̈ and F, and the rates of the object's own coordinate.
struct ContactMotion {
    qdd: [f64; N],
    /// Along pz, or where that is free, the largest.
    force: f64,
    own_rate: [f64; 2],
}

/// The generated functions of one mode, in one form for all modes.
trait ModeFunctions {
    const NAME: &'static str;
    /// Whether pz is constrained, and its reaction must push.
    const UNILATERAL: bool = true;
    fn coordinates(q: &[f64; N], qd: &[f64; N]) -> ToolCoordinates;
    fn motion(q: &[f64; N], qd: &[f64; N], tau: &[f64; N], own: &[f64; 2]) -> ContactMotion;
    /// Change of q̇ when the contact closes, and the energy that is lost.
    fn impact(q: &[f64; N], qd: &[f64; N]) -> ([f64; N], f64);
    /// Wanted position along px, py, pz \[m\] at a time \[s\], of a task that starts 5 cm above.
    fn wanted(time: f64) -> [f64; 3];
}

/// The place of `pen.pz` and the like among the six.
fn place(name: &str) -> usize {
    let known = ["px", "py", "pz", "ax", "ay", "az"];
    known.iter().position(|k| name.ends_with(k)).expect("a coordinate's name")
}

macro_rules! mode {
    ($type:ident, $mode:ident, $m:literal, |$q:ident, $qd:ident, $tau:ident, $own:ident| $motion:block,
     |$q2:ident, $qd2:ident| $impact:block, unilateral: $unilateral:literal, wanted: $wanted:expr) => {
        struct $type;
        impl ModeFunctions for $type {
            const NAME: &'static str = stringify!($mode);
            const UNILATERAL: bool = $unilateral;
            fn coordinates(q: &[f64; N], qd: &[f64; N]) -> ToolCoordinates {
                let mut all = ToolCoordinates { s: [0.0; 6], sd: [0.0; 6], j: [[0.0; N]; 6] };
                let (mut s, mut sd, mut j, mut a) = ([0.0; $m], [0.0; $m], [[0.0; N]; $m], [0.0; $m]);
                $mode::constrained_coordinates(q, qd, &mut s, &mut sd, &mut j, &mut a);
                for (i, name) in $mode::CONSTRAINED.iter().enumerate() {
                    let k = place(name);
                    (all.s[k], all.sd[k], all.j[k]) = (s[i], sd[i], j[i]);
                }
                const FREE: usize = 6 - $m;
                let (mut s, mut sd, mut j, mut a) = ([0.0; FREE], [0.0; FREE], [[0.0; N]; FREE], [0.0; FREE]);
                $mode::free_coordinates(q, qd, &mut s, &mut sd, &mut j, &mut a);
                for (i, name) in $mode::FREE.iter().enumerate() {
                    let k = place(name);
                    (all.s[k], all.sd[k], all.j[k]) = (s[i], sd[i], j[i]);
                }
                all
            }
            fn motion($q: &[f64; N], $qd: &[f64; N], $tau: &[f64; N], $own: &[f64; 2]) -> ContactMotion $motion
            fn impact($q2: &[f64; N], $qd2: &[f64; N]) -> ([f64; N], f64) $impact
            fn wanted(time: f64) -> [f64; 3] {
                ($wanted)(time)
            }
        }
    };
}

/// From 0 to 1 between two instants, smoothly.
fn ramp(time: f64, from: f64, to: f64) -> f64 {
    let x = ((time - from) / (to - from)).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

mode!(Writing, pen, 1,
    |q, qd, tau, _own| {
        let (mut qdd, mut f, mut sdd, mut v, mut p) = ([0.0; N], [0.0], [0.0], [0.0], [0.0]);
        pen::forward_dynamics(q, qd, tau, &mut qdd, &mut f, &mut sdd, &mut v, &mut p);
        ContactMotion { qdd, force: f[0], own_rate: [0.0; 2] }
    },
    |q, qd| {
        let (mut dqd, mut i, mut d, mut loss, mut p) = ([0.0; N], [0.0], [0.0], [0.0], [0.0]);
        pen::impact(q, qd, &[0.0], &mut dqd, &mut i, &mut d, &mut loss, &mut p);
        (dqd, loss[0])
    },
    unilateral: true,
    // down, an eight on the table under 15 N, up again
    wanted: |t: f64| {
        let turn = std::f64::consts::TAU * ramp(t, 0.7, 2.3);
        let depth = 0.055 * ramp(t, 0.0, 0.5) - 0.055 * ramp(t, 2.4, 2.9);
        [0.05 * turn.sin(), 0.025 * (2.0 * turn).sin(), 0.05 - depth]
    }
);
mode!(Assembly, peg, 4,
    |q, qd, tau, _own| {
        let (mut qdd, mut f, mut sdd, mut v, mut p) = ([0.0; N], [0.0; 4], [0.0; 4], [0.0; 4], [0.0]);
        peg::forward_dynamics(q, qd, tau, &mut qdd, &mut f, &mut sdd, &mut v, &mut p);
        let force = (f[0] * f[0] + f[1] * f[1]).sqrt();
        ContactMotion { qdd, force, own_rate: [0.0; 2] }
    },
    |q, qd| {
        let (mut dqd, mut i, mut d, mut loss, mut p) = ([0.0; N], [0.0; 4], [0.0; 4], [0.0], [0.0]);
        peg::impact(q, qd, &[0.0], &mut dqd, &mut i, &mut d, &mut loss, &mut p);
        (dqd, loss[0])
    },
    unilateral: false,
    // into the hole, 40 mm deep, there 2 mm off its axis against the wall, and out
    wanted: |t: f64| {
        let aside = ramp(t, 0.8, 1.2) - ramp(t, 1.6, 2.0);
        [0.002 * aside, -0.001 * aside, 0.05 - 0.09 * ramp(t, 0.0, 1.2) + 0.09 * ramp(t, 1.6, 2.8)]
    }
);
mode!(Pressing, wall, 1,
    |q, qd, tau, _own| {
        let (mut qdd, mut f, mut sdd, mut v, mut p) = ([0.0; N], [0.0], [0.0], [0.0], [0.0]);
        wall::forward_dynamics(q, qd, tau, &mut qdd, &mut f, &mut sdd, &mut v, &mut p);
        ContactMotion { qdd, force: f[0], own_rate: [0.0; 2] }
    },
    |q, qd| {
        let (mut dqd, mut i, mut d) = ([0.0; N], [0.0], [0.0]);
        let (mut loss, mut p, mut after) = ([0.0], [0.0], [0.0]);
        wall::impact(q, qd, &[0.0], &[0.0], &mut dqd, &mut i, &mut d, &mut loss, &mut p, &mut after);
        (dqd, loss[0])
    },
    unilateral: true,
    wanted: |t: f64| [0.0, 0.0, 0.05 - 0.07 * ramp(t, 0.0, 0.6) + 0.07 * ramp(t, 1.8, 2.4)]
);
mode!(Hammering, nail, 1,
    |q, qd, tau, own| {
        let (mut qdd, mut f, mut sdd, mut v, mut p, mut e) = ([0.0; N], [0.0], [0.0], [0.0], [0.0], [0.0; 2]);
        nail::forward_dynamics(q, qd, tau, own, &mut qdd, &mut f, &mut sdd, &mut v, &mut p, &mut e);
        ContactMotion { qdd, force: f[0], own_rate: e }
    },
    // a spring in front: no impact
    |_q, _qd| { ([0.0; N], 0.0) },
    unilateral: true,
    // blows from 5 cm, two a second
    wanted: |t: f64| [0.0, 0.0, 0.05 - 0.065 * (std::f64::consts::PI * 2.0 * t).sin().powi(2)]
);

/// Whether the contact is closed.
#[derive(Clone, Copy, PartialEq)]
enum Phase {
    Free,
    Contact,
}

/// A task under an impedance controller: gravity and velocity forces compensated, springs and dampers along the six
/// coordinates.
struct Task<M> {
    /// The coordinates of axes that are held.
    axes: [f64; 3],
    events: Vec<(f64, &'static str, f64)>,
    mode: std::marker::PhantomData<M>,
}

fn split(x: &[f64; STATE]) -> ([f64; N], [f64; N], [f64; 2]) {
    (std::array::from_fn(|i| x[i]), std::array::from_fn(|i| x[N + i]), [x[2 * N], x[2 * N + 1]])
}

impl<M: ModeFunctions> Task<M> {
    fn tau(&self, time: f64, q: &[f64; N], qd: &[f64; N], c: &ToolCoordinates) -> [f64; N] {
        let mut tau = [0.0; N];
        ur5::bias_force(q, qd, &mut tau);
        let [x, y, z] = M::wanted(time);
        let wanted = [x, y, z, self.axes[0], self.axes[1], self.axes[2]];
        for k in 0..6 {
            let (stiffness, damping) = GAINS[k / 3];
            let pull = stiffness * (wanted[k] - c.s[k]) - damping * c.sd[k];
            (0..N).for_each(|i| tau[i] += c.j[k][i] * pull);
        }
        tau
    }

    fn motion(&self, phase: Phase, time: f64, x: &[f64; STATE]) -> (ContactMotion, ToolCoordinates) {
        let (q, qd, own) = split(x);
        let c = M::coordinates(&q, &qd);
        let tau = self.tau(time, &q, &qd, &c);
        let motion = match phase {
            Phase::Contact => M::motion(&q, &qd, &tau, &own),
            Phase::Free => {
                let mut qdd = [0.0; N];
                ur5::forward_dynamics(&q, &qd, &tau, &mut qdd);
                ContactMotion { qdd, force: 0.0, own_rate: [0.0; 2] }
            }
        };
        (motion, c)
    }
}

impl<M: ModeFunctions> ContactTask<STATE, 2> for Task<M> {
    type Mode = Phase;

    fn rate(&mut self, phase: Phase, time: f64, x: &[f64; STATE]) -> [f64; STATE] {
        let (motion, _) = self.motion(phase, time, x);
        std::array::from_fn(|i| match i {
            i if i < N => x[N + i],
            i if i < 2 * N => motion.qdd[i - N],
            i => motion.own_rate[i - 2 * N],
        })
    }

    /// The distance while free; the reaction, or of a peg its depth, in contact.
    fn guards(&mut self, phase: Phase, time: f64, x: &[f64; STATE]) -> [f64; 2] {
        let (motion, c) = self.motion(phase, time, x);
        match phase {
            Phase::Free => [c.s[2], f64::INFINITY],
            Phase::Contact if M::UNILATERAL => [f64::INFINITY, motion.force],
            Phase::Contact => [f64::INFINITY, -c.s[2]],
        }
    }

    fn event(&mut self, phase: Phase, _guard: usize, time: f64, x: &mut [f64; STATE]) -> Phase {
        let (q, qd, _) = split(x);
        match phase {
            Phase::Free => {
                let (dqd, loss) = M::impact(&q, &qd);
                (0..N).for_each(|i| x[N + i] += dqd[i]);
                (x[2 * N], x[2 * N + 1]) = (0.0, 0.0);
                self.events.push((time, "touches", loss));
                Phase::Contact
            }
            Phase::Contact => {
                self.events.push((time, "lifts off", 0.0));
                Phase::Free
            }
        }
    }
}

/// What is drawn at one time: distance \[m\], reaction \[N\], kinetic energy \[J\].
type ContactSample = (f64, [f64; 3]);

/// q with the tool on the axis of the object, 5 cm above it, by Newton's method from a guess.
fn start<M: ModeFunctions>(guess: [f64; N], axes: &mut [f64; 3]) -> Result<[f64; N], String> {
    let mut q = guess;
    // of the turn about the normal what the guess has
    axes[2] = M::coordinates(&q, &[0.0; N]).s[5].clamp(-0.7, 0.7);
    let [x, y, z] = M::wanted(0.0);
    for _ in 0..60 {
        let c = M::coordinates(&q, &[0.0; N]);
        let wanted = [x, y, z, axes[0], axes[1], axes[2]];
        let left: [f64; 6] = std::array::from_fn(|k| wanted[k] - c.s[k]);
        if left.iter().all(|l| l.abs() < 1e-12) {
            return Ok(q);
        }
        let dq = solve(c.j, left);
        let most = dq.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        (0..N).for_each(|i| q[i] += dq[i] * (0.3 / most).min(1.0));
    }
    Err(format!("{}: no posture above the object was found", M::NAME))
}

/// Gauss with exchange of rows.
fn solve(mut a: [[f64; 6]; 6], mut b: [f64; 6]) -> [f64; 6] {
    for k in 0..6 {
        let pivot = (k..6).max_by(|i, j| a[*i][k].abs().total_cmp(&a[*j][k].abs())).unwrap_or(k);
        a.swap(k, pivot);
        b.swap(k, pivot);
        for i in k + 1..6 {
            let f = a[i][k] / a[k][k];
            (k..6).for_each(|j| a[i][j] -= f * a[k][j]);
            b[i] -= f * b[k];
        }
    }
    for k in (0..6).rev() {
        let rest: f64 = (k + 1..6).map(|j| a[k][j] * b[j]).sum();
        b[k] = (b[k] - rest) / a[k][k];
    }
    b
}

fn simulate<M: ModeFunctions>(guess: [f64; N]) -> Result<Vec<ContactSample>, Box<dyn Error>> {
    let mut task = Task::<M> { axes: [0.0; 3], events: vec![], mode: std::marker::PhantomData };
    let q = start::<M>(guess, &mut task.axes)?;
    let state = std::array::from_fn(|i| if i < N { q[i] } else { 0.0 });
    let mut simulation = Simulation { time: 0.0, mode: Phase::Free, state };
    let mut samples = Vec::new();
    let steps = (DURATION / STEP) as usize;
    for k in 0..steps {
        if k % 8 == 0 {
            let (motion, c) = task.motion(simulation.mode, simulation.time, &simulation.state);
            let (q, qd, _) = split(&simulation.state);
            let mut energy = [0.0; 2];
            ur5::energy(&q, &qd, &mut energy);
            samples.push((simulation.time, [c.s[2], motion.force, energy[0]]));
        }
        simulation.step(&mut task, STEP).map_err(|e| format!("{} at {} s: {e}", M::NAME, simulation.time))?;
    }
    println!("{}:", M::NAME);
    for (time, what, loss) in task.events.iter().take(8) {
        println!("  {time:.6} s  {what}{}", if *loss > 0.0 { format!(", {loss:.2e} J lost") } else { String::new() });
    }
    if task.events.len() > 8 {
        println!("  and {} more", task.events.len() - 8);
    }
    Ok(samples)
}

fn draw(tasks: &[(&str, Vec<ContactSample>)], path: &Path) -> Result<(), Box<dyn Error>> {
    let root = SVGBackend::new(path, (1200, 1000)).into_drawing_area();
    root.fill(&WHITE)?;
    let label = ("sans-serif", 13).into_font().color(&INK);
    let rows = root.split_evenly((tasks.len(), 3));
    let quantities = [("distance [mm]", 1000.0), ("reaction [N]", 1.0), ("kinetic energy [J]", 1.0)];
    for (i, (name, samples)) in tasks.iter().enumerate() {
        for (k, (quantity, unit)) in quantities.into_iter().enumerate() {
            let values = || samples.iter().map(move |(_, v)| v[k] * unit);
            let (low, high) = values().fold((0.0f64, 1e-9f64), |(l, h), x| (l.min(x), h.max(x)));
            let margin = 0.06 * (high - low);
            let mut chart = ChartBuilder::on(&rows[3 * i + k])
                .caption(format!("{name}: {quantity}"), ("sans-serif", 15).into_font().color(&INK))
                .margin(8)
                .x_label_area_size(28)
                .y_label_area_size(48)
                .build_cartesian_2d(0.0..DURATION, low - margin..high + margin)?;
            chart
                .configure_mesh()
                .x_labels(7)
                .y_labels(5)
                .label_style(label.clone())
                .light_line_style(WHITE)
                .bold_line_style(GRID)
                .draw()?;
            let line = samples.iter().zip(values()).map(|((t, _), v)| (*t, v));
            chart.draw_series(LineSeries::new(line, LINE.stroke_width(1)))?;
        }
    }
    root.present()?;
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let down = [0.1, -1.2, 1.8, -2.2, -1.57, 0.3];
    let forward = [0.1, -1.3, 1.9, -0.6, -1.47, 0.3];
    let tasks = [
        ("writing", simulate::<Writing>(down)?),
        ("peg in a hole", simulate::<Assembly>(down)?),
        ("elastic wall", simulate::<Pressing>(forward)?),
        ("hammering", simulate::<Hammering>(down)?),
    ];
    let target = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target");
    std::fs::create_dir_all(&target)?;
    draw(&tasks, &target.join("contact_tasks.svg"))?;
    println!("drawn: target/contact_tasks.svg");
    Ok(())
}
