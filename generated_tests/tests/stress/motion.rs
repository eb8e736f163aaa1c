//! A million steps: energy, momentum, dampers.
//!
//! Integrators of the tests' own, as plain as can be; with compensation (Kahan 1965) what an addition to the state rounds away is
//! kept and added with the next step.

use crate::outcome::{Outcome, Size};
use std::ops::{Add, Mul, Sub};
use straightline_codegen::compile::{program, Options};
use straightline_codegen::model::ModelOptions;
use straightline_codegen::{expr, Function, Robot, Source};
use straightline_core::Real;
use straightline_generated_tests::compiled::{self, Compiled};

/// A state that is summed up step by step.
struct Sum<T> {
    value: Vec<T>,
    lost: Option<Vec<T>>,
}

impl<T: Copy + Add<Output = T> + Sub<Output = T> + Default> Sum<T> {
    fn new(value: Vec<T>, compensated: bool) -> Self {
        Sum { lost: compensated.then(|| vec![T::default(); value.len()]), value }
    }

    fn add(&mut self, step: &[T]) {
        let lost = self.lost.as_deref_mut().unwrap_or_default();
        for (i, x) in self.value.iter_mut().enumerate() {
            let kept = lost.get(i).copied().unwrap_or_default();
            let y = step[i] - kept;
            let sum = *x + y;
            if let Some(lost) = lost.get_mut(i) {
                *lost = (sum - *x) - y;
            }
            *x = sum;
        }
    }
}

/// How the state is advanced.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Integrator {
    /// q̇ first, then q with the new q̇.
    SemiImplicitEuler,
    /// Runge and Kutta's classical one.
    RungeKutta4,
}

/// The step of a state under its rate.
fn step<T: Copy + Add<Output = T> + Mul<Output = T>>(
    integrator: Integrator,
    state: &[T],
    dt: T,
    [half, sixth, third]: [T; 3],
    rate: &dyn Fn(&[T]) -> Vec<T>,
) -> Vec<T> {
    let at = |k: &[T], h: T| -> Vec<T> { state.iter().zip(k).map(|(x, k)| *x + *k * h).collect() };
    let k1 = rate(state);
    match integrator {
        Integrator::SemiImplicitEuler => {
            let n = state.len() / 2;
            let speeds: Vec<T> = (n..2 * n).map(|i| k1[i] * dt).collect();
            (0..n).map(|i| (state[n + i] + speeds[i]) * dt).chain(speeds.iter().copied()).collect()
        }
        Integrator::RungeKutta4 => {
            let k2 = rate(&at(&k1, dt * half));
            let k3 = rate(&at(&k2, dt * half));
            let k4 = rate(&at(&k3, dt));
            (0..state.len()).map(|i| ((k1[i] + k4[i]) * sixth + (k2[i] + k3[i]) * third) * dt).collect()
        }
    }
}

/// The greatest |E − E₀| / |V| of a freely swinging planar arm.
fn energy_drift<T>(arm: &Compiled<T>, integrator: Integrator, steps: usize, dt: f64, compensated: bool) -> f64
where
    T: Real + Default + Into<f64> + 'static,
{
    let c = |x: f64| T::constant(straightline_core::Dd::from(x));
    let energy = |state: &[T]| -> [f64; 2] {
        let tv = arm.call(Function::Energy, &[state[..2].to_vec(), state[2..].to_vec()]);
        [tv[0].into() + tv[1].into(), tv[1].into()]
    };
    let rate = |state: &[T]| -> Vec<T> {
        let (q, qd) = (state[..2].to_vec(), state[2..].to_vec());
        let qdd = arm.call(Function::ForwardDynamics, &[q, qd.clone(), vec![T::zero(); 2]]);
        [qd, qdd].concat()
    };
    let mut state = Sum::new([1.0, 0.5, 0.0, 0.0].map(c).to_vec(), compensated);
    // horizontal or lower: the arm's whole weight as scale
    let first = energy(&state.value)[0];
    let (mut drift, mut scale) = (0.0f64, 0.0f64);
    for i in 0..steps {
        let change = step(integrator, &state.value, c(dt), [c(0.5), c(1.0) / c(6.0), c(1.0) / c(3.0)], &rate);
        state.add(&change);
        if i % 16 == 0 || i + 1 == steps {
            let [e, v] = energy(&state.value);
            scale = scale.max(v.abs());
            drift = if e.is_finite() { drift.max((e - first).abs()) } else { f64::INFINITY };
        }
    }
    drift / scale
}

pub fn energy_and_momentum(size: Size) -> Vec<Outcome> {
    use Integrator::{RungeKutta4, SemiImplicitEuler};
    let (double, name) = (compiled::robot("planar2r"), "planar2r, free");
    let single = compiled::F32.iter().find(|c| !c.exact && c.robot == "planar2r").expect("it is compiled for f32");
    let steps = size.pick(1000, 1_000_000);
    let mut outcomes = Vec::new();
    let mut line = |what: &str, value: f64, bound: f64| {
        outcomes.push(Outcome::new(15, name, format!("{what}, {steps} steps of 0.25 ms, |ΔE| / |V|"), value, bound));
    };
    line("f64 Runge-Kutta 4", energy_drift(double, RungeKutta4, steps, 2.5e-4, false), 1e-6);
    line("f64 Runge-Kutta 4, compensated", energy_drift(double, RungeKutta4, steps, 2.5e-4, true), 1e-6);
    line("f32 Runge-Kutta 4", energy_drift(single, RungeKutta4, steps, 2.5e-4, false), 1e-2);
    line("f32 Runge-Kutta 4, compensated", energy_drift(single, RungeKutta4, steps, 2.5e-4, true), 1e-4);
    // not symplectic in (q, q̇): the error of its first order, growing
    line("f64 semi-implicit Euler", energy_drift(double, SemiImplicitEuler, steps, 2.5e-4, false), 2.0);
    outcomes.extend(momentum(size.pick(500, 1_000_000)));
    outcomes
}

/// A body with an arm, free and weightless.
const SATELLITE: &str = r#"<robot name="satellite">
  <link name="hull"><inertial><origin xyz="0.1 -0.05 0.02"/><mass value="3"/>
    <inertia ixx="0.3" iyy="0.2" izz="0.25" ixy="0.01" ixz="-0.02" iyz="0.015"/></inertial></link>
  <link name="arm"><inertial><origin xyz="0.3 0.02 0.01"/><mass value="0.7"/>
    <inertia ixx="0.002" iyy="0.02" izz="0.021" ixy="0.001" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="continuous"><parent link="hull"/><child link="arm"/>
    <origin xyz="0.4 0.1 0" rpy="0.2 0.1 0.3"/><axis xyz="0.3 0.5 1"/></joint></robot>"#;

/// Momentum and the quaternion's length of a free robot.
fn momentum(steps: usize) -> Vec<Outcome> {
    let model = ModelOptions { floating_base: true, gravity: Some([0.0; 3]), ..ModelOptions::default() };
    let options = Options { model, ..Options::default() };
    let source = Source::new("satellite.urdf", SATELLITE);
    let robot: Robot = straightline_generated_tests::programs::load(&source, &options.model);
    let forward = program(&robot, &[], Function::ForwardDynamics, &options).graph;
    let momentum = program(&robot, &[], Function::Momentum, &options).graph;
    const NQ: usize = 8;
    let rate = |state: &[f64]| -> Vec<f64> {
        let (q, v) = state.split_at(NQ);
        let qdd = expr::evaluate(&forward, &[q, v, &[0.0; 7]].concat());
        let [x, y, z, w] = [q[3], q[4], q[5], q[6]];
        // the rotation of a quaternion of any length near one, and ½ quaternion ∘ ω
        let turned = |u: [f64; 3]| {
            let t = [y * u[2] - z * u[1], z * u[0] - x * u[2], x * u[1] - y * u[0]].map(|c| 2.0 * c);
            let cross = [y * t[2] - z * t[1], z * t[0] - x * t[2], x * t[1] - y * t[0]];
            [0, 1, 2].map(|i| u[i] + w * t[i] + cross[i])
        };
        let position = turned([v[0], v[1], v[2]]);
        let [a, b, c] = [v[3], v[4], v[5]].map(|u| 0.5 * u);
        let quaternion = [w * a + y * c - z * b, w * b + z * a - x * c, w * c + x * b - y * a, -x * a - y * b - z * c];
        [&position[..], &quaternion, &[v[6]], &qdd].concat()
    };
    let of = |state: &[f64]| expr::evaluate(&momentum, state);
    let start = vec![0.1, 0.2, 0.3, 0.0, 0.6, 0.0, 0.8, 0.4, 0.3, -0.2, 0.1, 0.5, -0.4, 0.8, -1.5];
    let mut state = Sum::new(start, true);
    let first = of(&state.value);
    let norm = |p: &[f64]| p.iter().map(|x| x * x).sum::<f64>().sqrt();
    let scales = [norm(&first[..3]), norm(&first[3..])];
    let (mut drift, mut length) = ([0.0f64; 2], 0.0f64);
    for i in 0..steps {
        let change = step(Integrator::RungeKutta4, &state.value, 1e-3, [0.5, 1.0 / 6.0, 1.0 / 3.0], &rate);
        state.add(&change);
        if i % 64 == 0 || i + 1 == steps {
            let now = of(&state.value);
            for (k, drift) in drift.iter_mut().enumerate() {
                let part: Vec<f64> = (3 * k..3 * k + 3).map(|j| now[j] - first[j]).collect();
                *drift = drift.max(norm(&part) / scales[k]);
            }
            length = length.max((norm(&state.value[3..7]) - 1.0).abs());
        }
    }
    let line = |what: &str, value: f64| {
        Outcome::new(
            16,
            "free body with an arm",
            format!("f64 Runge-Kutta 4, {steps} steps of 1 ms, {what}"),
            value,
            1e-9,
        )
    };
    vec![
        line("linear momentum, relative", drift[0]),
        line("angular momentum, relative", drift[1]),
        line("quaternion's length less one", length),
    ]
}

/// (H + Δt D) Δq̇ = −Δt (h + D q̇), D = d 1: dampers so stiff that an explicit step would explode.
pub fn damping(size: Size) -> Vec<Outcome> {
    let arm = compiled::robot("planar2r");
    let mut outcomes = Vec::new();
    for stiffness in [1.0, 1e3, 1e6] {
        let (dt, steps) = (1e-2, size.pick(500, 20_000));
        let (mut q, mut qd) = (vec![1.0, -0.5], vec![3.0, -6.0]);
        let kinetic = |q: &[f64], qd: &[f64]| arm.call(Function::Energy, &[q.to_vec(), qd.to_vec()])[0];
        let (mut before, mut gain) = (kinetic(&q, &qd), 0.0f64);
        let first = before;
        for _ in 0..steps {
            let h = arm.call(Function::MassMatrix, std::slice::from_ref(&q));
            let velocity = arm.call(Function::VelocityForce, &[q.clone(), qd.clone()]);
            let d = stiffness * h[0];
            let right: Vec<f64> = (0..2).map(|i| -dt * (velocity[i] + d * qd[i])).collect();
            let [a, b, c] = [h[0] + dt * d, h[1], h[3] + dt * d];
            let determinant = a * c - b * b;
            qd[0] += (c * right[0] - b * right[1]) / determinant;
            qd[1] += (a * right[1] - b * right[0]) / determinant;
            (0..2).for_each(|i| q[i] += dt * qd[i]);
            let now = kinetic(&q, &qd);
            gain = gain.max((now - before) / first);
            before = now;
        }
        let what = format!("Δt d/m = {:.0e}, {steps} steps: greatest gain of energy, relative", dt * stiffness);
        outcomes.push(Outcome::new(17, "planar2r, weightless", what, gain, 1e-3));
        let what = format!("Δt d/m = {:.0e}: energy at the end, relative", dt * stiffness);
        outcomes.push(Outcome::new(17, "planar2r, weightless", what, before / first, 0.1));
    }
    outcomes
}
