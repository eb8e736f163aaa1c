//! Simulation: processor time per simulated second against the state's error and the energy's drift, swept over the step.
//!
//! A planar arm swings freely: the state is compared after one second, before chaos, with a trajectory in double-double; the
//! energy over twenty seconds. The integrators and the generated code are one binary, compiled for this processor.

use crate::chart::{self, Curve, Curves};
use crate::{record, write};
use serde_json::json;
use std::fmt::Write;
use straightline_codegen::{compile, expr, Function, Options, Scalar};
use straightline_core::Dd;
use straightline_generated_tests::programs;
use straightline_generated_tests::reference::Robot;
use straightline_generated_tests::standalone::{run as run_program, Folder};

const ROBOT: &str = "planar2r";
/// Where it starts, at rest.
const START: [f64; 2] = [1.0, 0.5];
/// The state is compared here \[s\], the energy is watched until there \[s\].
const COMPARED: f64 = 1.0;
const WATCHED: f64 = 20.0;

const PROGRAM: &str = r#"
use std::time::Instant;
trait Number: Copy + std::ops::Add<Output = Self> + std::ops::Sub<Output = Self> + std::ops::Mul<Output = Self> + Default {
    fn from(x: f64) -> Self;
    fn wide(self) -> f64;
    fn forward(q: &[Self; 2], qd: &[Self; 2], qdd: &mut [Self; 2]);
    fn energy(q: &[Self; 2], qd: &[Self; 2]) -> [f64; 2];
}
macro_rules! number {
    ($t:ty, $robot:ident) => {
        impl Number for $t {
            fn from(x: f64) -> Self { x as $t }
            fn wide(self) -> f64 { self as f64 }
            #[inline(always)]
            fn forward(q: &[Self; 2], qd: &[Self; 2], qdd: &mut [Self; 2]) { $robot::forward_dynamics(q, qd, &[0.0; 2], qdd) }
            fn energy(q: &[Self; 2], qd: &[Self; 2]) -> [f64; 2] { let mut tv = [0.0; 2]; $robot::energy(q, qd, &mut tv); tv.map(|x| x as f64) }
        }
    };
}
number!(f64, double);
number!(f32, single);

#[derive(Clone, Copy)]
struct Sum<T> { x: [T; 4], lost: [T; 4] }
impl<T: Number> Sum<T> {
    #[inline(always)]
    fn add(&mut self, step: [T; 4], compensated: bool) {
        for i in 0..4 {
            let y = if compensated { step[i] - self.lost[i] } else { step[i] };
            let sum = self.x[i] + y;
            if compensated { self.lost[i] = (sum - self.x[i]) - y; }
            self.x[i] = sum;
        }
    }
}
#[inline(always)]
fn rate<T: Number>(x: &[T; 4]) -> [T; 4] {
    let mut qdd = [T::default(); 2];
    T::forward(&[x[0], x[1]], &[x[2], x[3]], &mut qdd);
    [x[2], x[3], qdd[0], qdd[1]]
}
#[inline(always)]
fn at<T: Number>(x: &[T; 4], k: &[T; 4], h: T) -> [T; 4] { std::array::from_fn(|i| x[i] + k[i] * h) }

/// The change of the state in a step.
#[inline(always)]
fn step<T: Number>(method: usize, x: &[T; 4], dt: T, half: T) -> [T; 4] {
    let k1 = rate(x);
    match method {
        // semi-implicit Euler
        0 => { let v = [x[2] + k1[2] * dt, x[3] + k1[3] * dt]; [v[0] * dt, v[1] * dt, k1[2] * dt, k1[3] * dt] }
        // explicit midpoint
        1 => rate(&at(x, &k1, half)).map(|k| k * dt),
        // Runge and Kutta's classical one
        2 => {
            let k2 = rate(&at(x, &k1, half));
            let k3 = rate(&at(x, &k2, half));
            let k4 = rate(&at(x, &k3, dt));
            let (sixth, third) = (T::from(1.0 / 6.0), T::from(1.0 / 3.0));
            std::array::from_fn(|i| ((k1[i] + k4[i]) * sixth + (k2[i] + k3[i]) * third) * dt)
        }
        // implicit midpoint, six iterations
        _ => { let mut k = k1; for _ in 0..6 { k = rate(&at(x, &k, half)); } k.map(|k| k * dt) }
    }
}
fn simulate<T: Number>(method: usize, compensated: bool, dt: f64, until: f64) -> (f64, [f64; 4], f64) {
    let steps = (until / dt).round() as usize;
    let (dt, half) = (T::from(dt), T::from(dt * 0.5));
    let start = [T::from(Q0), T::from(Q1), T::default(), T::default()];
    let mut s = Sum { x: start, lost: [T::default(); 4] };
    let clock = Instant::now();
    for _ in 0..steps { let d = step(method, &s.x, dt, half); s.add(d, compensated); }
    let time = clock.elapsed().as_nanos() as f64 / until;
    std::hint::black_box(&s.x);
    let x = s.x.map(T::wide);
    // once more for the energy
    let mut s = Sum { x: start, lost: [T::default(); 4] };
    let e = |x: &[T; 4]| T::energy(&[x[0], x[1]], &[x[2], x[3]]);
    let first = { let [t, v] = e(&start); t + v };
    let (mut drift, mut scale) = (0.0f64, 0.0f64);
    for i in 0..steps {
        let d = step(method, &s.x, dt, half);
        s.add(d, compensated);
        if i % 8 == 0 || i + 1 == steps {
            let [t, v] = e(&s.x);
            scale = scale.max(v.abs());
            drift = if (t + v).is_finite() { drift.max((t + v - first).abs()) } else { f64::INFINITY };
        }
    }
    (time, x, drift / scale)
}
fn main() {
    for method in 0..4 {
        for kind in 0..4 {
            for k in 0..13 {
                let dt = 0.02 / f64::powi(2.0, k);
                let go = |until: f64| match kind {
                    0 => simulate::<f64>(method, false, dt, until),
                    1 => simulate::<f64>(method, true, dt, until),
                    2 => simulate::<f32>(method, false, dt, until),
                    _ => simulate::<f32>(method, true, dt, until),
                };
                // the state after one second, and the least time of some runs
                let (mut time, x, _) = go(COMPARED);
                for _ in 0..5 { time = time.min(go(COMPARED).0); }
                let drift = go(WATCHED).2;
                println!("{method} {kind} {dt:e} {time} {:e} {:e} {:e} {:e} {drift:e}", x[0], x[1], x[2], x[3]);
            }
        }
    }
}
"#;

const METHODS: [&str; 4] = ["semi-implicit Euler", "explicit midpoint", "Runge-Kutta 4", "implicit midpoint"];
const KINDS: [&str; 4] = ["f64", "f64, compensated", "f32", "f32, compensated"];

/// The state after a second in double-double: Runge and Kutta's method with so small a step that its error is 1e-20.
fn truth(robot: &Robot) -> [f64; 4] {
    let program = programs::of_robot(robot, Function::ForwardDynamics, &programs::options(robot));
    let rate = |x: &[Dd]| -> Vec<Dd> {
        let qdd = expr::evaluate(&program.graph, &[x, &[Dd::ZERO; 2]].concat());
        vec![x[2], x[3], qdd[0], qdd[1]]
    };
    let steps = 50_000;
    let dt = Dd::from(COMPARED) / Dd::from(f64::from(steps));
    let at = |x: &[Dd], k: &[Dd], h: Dd| -> Vec<Dd> { x.iter().zip(k).map(|(x, k)| *x + *k * h).collect() };
    let mut x = vec![Dd::from(START[0]), Dd::from(START[1]), Dd::ZERO, Dd::ZERO];
    for _ in 0..steps {
        let k1 = rate(&x);
        let k2 = rate(&at(&x, &k1, dt * Dd::HALF));
        let k3 = rate(&at(&x, &k2, dt * Dd::HALF));
        let k4 = rate(&at(&x, &k3, dt));
        for i in 0..4 {
            x[i] += (k1[i] + k4[i] + (k2[i] + k3[i]) * Dd::from(2.0)) * dt / Dd::from(6.0);
        }
    }
    [0, 1, 2, 3].map(|i| x[i].to_f64())
}

pub fn run() {
    let robot = Robot::load(ROBOT);
    let mut source = String::from("#![allow(warnings)]\n");
    for (module, scalar) in [("double", Scalar::F64), ("single", Scalar::F32)] {
        let functions = vec![Function::ForwardDynamics, Function::Energy];
        let options = Options { functions, scalar, ..programs::options(&robot) };
        let generated = compile(&programs::source(&robot), &options).unwrap_or_else(|d| panic!("{d}"));
        let _ = writeln!(source, "mod {module} {{\n{}\n}}", generated.text);
    }
    let _ = writeln!(
        source,
        "const Q0: f64 = {:?};\nconst Q1: f64 = {:?};\nconst COMPARED: f64 = {COMPARED:?};\nconst WATCHED: f64 = {WATCHED:?};",
        START[0], START[1]
    );
    source += PROGRAM;
    let folder = Folder::new("simulation");
    let program = folder.build("simulation", &source, &["-Ctarget-cpu=native"]).unwrap_or_else(|e| panic!("{e}"));
    let output = run_program(&program, &[]).unwrap_or_else(|e| panic!("{e}"));
    let truth = truth(&robot);
    let size = truth.iter().map(|x| x.abs()).fold(0.0, f64::max);

    let mut state = Vec::new();
    let mut energy = Vec::new();
    let mut rows = Vec::new();
    let mut text = format!(
        "# Simulation: time against error\n\n`cargo bench -p straightline-generated-tests --bench time_error -- simulation`\n\n\
         {ROBOT} swings freely from ({}, {}) rad. Error of the state after {COMPARED} s over its greatest component ({size:.2}), against a\n\
         double-double trajectory; energy: the greatest change in {WATCHED} s over the greatest |V|.\n\n\
         | integrator | numbers | step, s | µs of processor per simulated second | error of the state | energy |\n|---|---|---|---|---|---|\n",
        START[0], START[1]
    );
    for line in output.lines() {
        let f: Vec<f64> = line.split(' ').map(|x| x.parse().expect("a number")).collect();
        let (method, kind, dt, time, drift) = (f[0] as usize, f[1] as usize, f[2], f[3], f[8]);
        let error =
            (0..4)
                .map(|i| (f[4 + i] - truth[i]).abs())
                .fold(0.0, |m: f64, e| if e.is_finite() { m.max(e) } else { f64::INFINITY })
                / size;
        let name = format!("{}, {}", METHODS[method], KINDS[kind]);
        rows.push(
            json!({"integrator": METHODS[method], "numbers": KINDS[kind], "step": dt, "ns_per_simulated_second": time,
                         "state_error": error, "energy_drift": drift}),
        );
        let _ = writeln!(
            text,
            "| {} | {} | {dt:.1e} | {:.1} | {error:.1e} | {drift:.1e} |",
            METHODS[method],
            KINDS[kind],
            time / 1e3
        );
        // compensation of f64 shows at the smallest steps only: in the table
        if kind == 1 {
            continue;
        }
        for (curves, y) in [(&mut state, error), (&mut energy, drift)] {
            let curves: &mut Vec<Curve> = curves;
            if !curves.iter().any(|c| c.name == name) {
                curves.push(Curve { name: name.clone(), colour: method, dashed: kind != 0, points: Vec::new() });
            }
            let curve = curves.iter_mut().find(|c| c.name == name).expect("it is there");
            if y.is_finite() && y < 10.0 {
                curve.points.push((time, y));
            }
        }
    }
    // of the f32 curves those that differ: of Runge and Kutta's, with and without compensation
    for curves in [&mut state, &mut energy] {
        curves.retain(|c| !c.name.contains("f32") || c.name.starts_with("Runge"));
        for c in curves.iter_mut().filter(|c| c.name.contains("f32")) {
            c.colour = if c.name.contains("compensated") { 5 } else { 4 };
        }
    }
    let (x, format) = ("processor time per simulated second (smaller steps to the right)", &chart::time);
    let charts = [
        Curves {
            title: "Simulation of a planar arm: error of the state after 1 s",
            x,
            x_base: 10.0,
            y: "error over the greatest component",
            x_format: format,
            y_format: &chart::power,
            curves: &state,
        },
        Curves {
            title: "The same: change of energy in 20 s",
            x,
            x_base: 10.0,
            y: "greatest |ΔE| / |V|",
            x_format: format,
            y_format: &chart::power,
            curves: &energy,
        },
    ];
    chart::curves(&charts, &record("2026-11-22-time-error-simulation.svg"));
    write("2026-11-22-time-error-simulation.md", &text);
    write("2026-11-22-time-error-simulation.json", &(serde_json::to_string(&rows).expect("plain values") + "\n"));
}
