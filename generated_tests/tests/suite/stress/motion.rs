//! A million steps: energy, momentum, dampers, by the integrators of `straightline::integrate`.

use super::outcome::{Outcome, Size};
use straightline_codegen::model::ModelOptions;
use straightline_codegen::options::Options;
use straightline_codegen::program::program;
use straightline_codegen::{expr, Function, Robot, Source};
use straightline_core::integrate::{Compensated, State, Step};
use straightline_core::{Dd, Real};
use straightline_generated_tests::compiled::{self, Compiled};

/// How the state is advanced.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Integrator {
    SemiImplicitEuler,
    RungeKutta4,
    /// With so many iterations.
    ImplicitMidpoint(usize),
}

/// The greatest |E − E₀| / |V| of a freely swinging planar arm.
fn energy_drift<T>(arm: &Compiled<T>, integrator: Integrator, steps: usize, dt: f64, compensated: bool) -> f64
where
    T: Real + Into<f64> + 'static,
{
    let c = |x: f64| T::constant(Dd::from(x));
    let energy = |s: &State<T, 2, 2>| -> [f64; 2] {
        let tv = arm.call(Function::Energy, &[s.q.to_vec(), s.qd.to_vec()]);
        [tv[0].into() + tv[1].into(), tv[1].into()]
    };
    let free = |_t: T, q: &[T; 2], qd: &[T; 2], qdd: &mut [T; 2]| {
        qdd.copy_from_slice(&arm.call(Function::ForwardDynamics, &[q.to_vec(), qd.to_vec(), vec![T::zero(); 2]]));
    };
    let start = State { q: [1.0, 0.5].map(c), qd: [T::zero(); 2] };
    let (mut plain, mut sum, step) = (start, Compensated::new(start), Step::of(c(dt)));
    // horizontal or lower: the arm's whole weight as scale
    let first = energy(&start)[0];
    let (mut drift, mut scale) = (0.0f64, 0.0f64);
    for i in 0..steps {
        let state = if compensated { sum.state } else { plain };
        let change = match integrator {
            Integrator::SemiImplicitEuler => step.semi_implicit_euler(T::zero(), &state, free),
            Integrator::RungeKutta4 => step.runge_kutta_4(T::zero(), &state, free),
            Integrator::ImplicitMidpoint(iterations) => step.implicit_midpoint(T::zero(), &state, iterations, free),
        };
        match compensated {
            true => sum.add(&change, 0),
            false => plain.add(&change, 0),
        }
        if i % 16 == 0 || i + 1 == steps {
            let [e, v] = energy(if compensated { &sum.state } else { &plain });
            scale = scale.max(v.abs());
            drift = if e.is_finite() { drift.max((e - first).abs()) } else { f64::INFINITY };
        }
    }
    drift / scale
}

pub fn energy_and_momentum(size: Size) -> Vec<Outcome> {
    use Integrator::{ImplicitMidpoint, RungeKutta4, SemiImplicitEuler};
    let (double, name) = (compiled::robot("planar2r"), "planar2r, free");
    let single = compiled::F32.iter().find(|c| !c.exact && c.robot == "planar2r").expect("it is compiled for f32");
    let steps = size.pick(1000, 1_000_000);
    let mut outcomes = Vec::new();
    let mut line = |what: &str, value: f64, bound: f64| {
        outcomes.push(Outcome::new(15, name, format!("{what}, {steps} steps of 0.25 ms, |ΔE| / |V|"), value, bound));
    };
    // the midpoint rule's own error at this step is of second order, and does not grow
    for (what, method, own) in [("Runge-Kutta 4", RungeKutta4, 1e-6), ("implicit midpoint", ImplicitMidpoint(4), 1e-4)]
    {
        for (suffix, compensated) in [("", false), (", compensated", true)] {
            let drift = energy_drift(double, method, steps, 2.5e-4, compensated);
            line(&format!("f64 {what}{suffix}"), drift, own);
        }
        line(&format!("f32 {what}"), energy_drift(single, method, steps, 2.5e-4, false), 5e-2);
        let drift = energy_drift(single, method, steps, 2.5e-4, true);
        line(&format!("f32 {what}, compensated"), drift, 5e-4);
    }
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
    let rate = |_t: f64, q: &[f64; 8], v: &[f64; 7], qdd: &mut [f64; 7]| {
        qdd.copy_from_slice(&expr::evaluate(&forward, &[&q[..], v, &[0.0; 7]].concat()));
    };
    let of = |s: &State<f64, 8, 7>| expr::evaluate(&momentum, &[&s.q[..], &s.qd].concat());
    let start = State { q: [0.1, 0.2, 0.3, 0.0, 0.6, 0.0, 0.8, 0.4], qd: [0.3, -0.2, 0.1, 0.5, -0.4, 0.8, -1.5] };
    let (mut sum, step) = (Compensated::new(start), Step::of(1e-3));
    let first = of(&start);
    let norm = |p: &[f64]| p.iter().map(|x| x * x).sum::<f64>().sqrt();
    let scales = [norm(&first[..3]), norm(&first[3..])];
    let (mut drift, mut length) = ([0.0f64; 2], 0.0f64);
    for i in 0..steps {
        let change = step.runge_kutta_4(0.0, &sum.state, rate);
        sum.add(&change, 0);
        if i % 64 == 0 || i + 1 == steps {
            let now = of(&sum.state);
            for (k, drift) in drift.iter_mut().enumerate() {
                let part: Vec<f64> = (3 * k..3 * k + 3).map(|j| now[j] - first[j]).collect();
                *drift = drift.max(norm(&part) / scales[k]);
            }
            length = length.max((norm(&sum.state.q[3..7]) - 1.0).abs());
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

/// Dampers d so stiff that an explicit step would explode, by the step that is implicit in them.
pub fn damping(size: Size) -> Vec<Outcome> {
    let arm = compiled::robot("planar2r");
    let mut outcomes = Vec::new();
    for stiffness in [1.0, 1e3, 1e6] {
        let (dt, steps) = (1e-2, size.pick(500, 20_000));
        let mut state = State { q: [1.0, -0.5], qd: [3.0, -6.0] };
        let kinetic = |s: &State<f64, 2, 2>| arm.call(Function::Energy, &[s.q.to_vec(), s.qd.to_vec()])[0];
        let (mut before, mut gain) = (kinetic(&state), 0.0f64);
        let first = before;
        for _ in 0..steps {
            let h = arm.call(Function::MassMatrix, &[state.q.to_vec()]);
            let d = stiffness * h[0];
            let matrix = |_q: &[f64; 2], m: &mut [[f64; 2]; 2]| *m = [[h[0], h[1]], [h[2], h[3]]];
            let force = |q: &[f64; 2], qd: &[f64; 2], f: &mut [f64; 2]| {
                let velocity = arm.call(Function::VelocityForce, &[q.to_vec(), qd.to_vec()]);
                *f = std::array::from_fn(|i| -velocity[i] - d * qd[i]);
            };
            let change = Step::of(dt).implicit_euler(&state, &[d; 2], &[0.0; 2], matrix, force);
            state.add(&change, 0);
            let now = kinetic(&state);
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
