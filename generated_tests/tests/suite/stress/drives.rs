//! Robots with drives: motors whose figures are far apart, transmissions from soft to nearly rigid, a million steps of springs.

use super::outcome::{Outcome, Size};
use straightline_codegen::expr::{evaluate, Graph};
use straightline_codegen::model::ModelOptions;
use straightline_codegen::Function::{DriveEnergy, DrivenForwardDynamics, DrivenInverseDynamics};
use straightline_codegen::{Function, Source};
use straightline_core::integrate::{Compensated, State, Step};
use straightline_core::Dd;
use straightline_generated_tests::drives::{blocks, Driven};
use straightline_generated_tests::random::Random;
use straightline_generated_tests::reference::description;

const ARM: &str = "planar2r";
const U: f64 = f64::EPSILON / 2.0;

fn driven(scene: &str) -> Driven {
    let path = description(ARM);
    let text = std::fs::read_to_string(&path).expect("the robot file is there");
    Driven::new(&Source::new("planar2r.urdf", text), &ModelOptions::default(), scene)
}

/// A drive on both joints: keys of the motor besides what all have, and the transmission.
fn drives(motor: &str, transmission: &str) -> String {
    let of = |joint: &str| {
        format!(
            "[[drive]]\njoint = \"{joint}\"\nmotor = {{ torque_constant = 0.05, resistance = 1.2, rotor_inertia = 1e-5{motor} }}\n\
             {transmission}\n"
        )
    };
    of("joint1") + &of("joint2")
}

/// The greatest error of a block of results over its greatest entry, in u.
fn error(computed: &[f64], truth: &[Dd]) -> f64 {
    let greatest = truth.iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
    let off = computed.iter().zip(truth).map(|(c, t)| (Dd::from(*c) - *t).to_f64().abs());
    off.fold(0.0, |m: f64, e| if e.is_finite() { m.max(e) } else { f64::INFINITY }) / greatest / U
}

fn wide(x: &[f64]) -> Vec<Dd> {
    x.iter().map(|x| Dd::from(*x)).collect()
}

/// q̈ and ẋ under voltages against the same equations in double-double.
fn motion(driven: &Driven, states: usize, strain: f64, ratio: f64) -> [f64; 2] {
    let program = driven.program(DrivenForwardDynamics);
    let width = |name: &str| program.inputs.iter().find(|p| p.name == name).map_or(0, |p| p.len());
    let mut random = Random(2);
    let mut worst = [0.0f64; 2];
    for _ in 0..states {
        let (q, qd, u) = (random.list(2, 3.0), random.list(2, 3.0), random.list(2, 24.0));
        // the shaft follows the joint, but for what the spring is strained
        let mut x = random.list(width("x"), 5.0);
        let per_drive = x.len() / 2;
        if per_drive >= 2 {
            for k in 0..2 {
                x[k * per_drive] = ratio * (q[k] + strain * random.between(-1.0, 1.0));
                x[k * per_drive + 1] = ratio * qd[k];
            }
        }
        let at: [(&str, &[f64]); 4] = [("q", &q), ("qd", &qd), ("x", &x), ("u", &u)];
        let wide: Vec<(&str, Vec<Dd>)> = at.iter().map(|(name, x)| (*name, wide(x))).collect();
        let wide: Vec<(&str, &[Dd])> = wide.iter().map(|(name, x)| (*name, x.as_slice())).collect();
        let (computed, truth) = (blocks::<f64>(&program, &at), blocks::<Dd>(&program, &wide));
        for (worst, (c, t)) in worst.iter_mut().zip(computed.iter().zip(&truth)).filter(|(_, (c, _))| !c.is_empty()) {
            *worst = worst.max(error(c, t));
        }
    }
    worst
}

/// q̈ → voltages → q̈ of rigid drives, over the greatest q̈.
fn back(driven: &Driven, states: usize) -> f64 {
    let programs = [DrivenInverseDynamics, DrivenForwardDynamics].map(|f| driven.program(f));
    let width = programs[1].inputs.iter().find(|p| p.name == "x").map_or(0, |p| p.len());
    let mut random = Random(1);
    let mut worst = 0.0f64;
    for _ in 0..states {
        let [q, qd, qdd] = [random.list(2, 3.0), random.list(2, 3.0), random.list(2, 10.0)];
        let x = vec![0.0; width];
        let u = blocks::<f64>(&programs[0], &[("q", &q), ("qd", &qd), ("qdd", &qdd)]).swap_remove(0);
        let again = blocks::<f64>(&programs[1], &[("q", &q), ("qd", &qd), ("x", &x), ("u", &u)]).swap_remove(0);
        worst = worst.max(error(&again, &wide(&qdd)));
    }
    worst
}

pub fn motors_and_transmissions(size: Size) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    let states = size.pick(5, 2000);
    for &ratio in size.pick(&[100.0][..], &[1.0, 100.0, 1e4][..]) {
        let name = format!("planar2r, motors behind 1:{ratio}");
        let rigid = driven(&drives("", &format!("ratio = {ratio:?}")));
        let what = "f64 q̈ → voltages → q̈, u of q̈";
        // the back EMF, N² C² q̇ / R beside H q̈, is what cancels
        outcomes.push(Outcome::new(1, &name, what, back(&rigid, states), 1e4));
        for inductance in [1e-2, 1e-7] {
            let motors = driven(&drives(&format!(", inductance = {inductance:?}"), &format!("ratio = {ratio:?}")));
            let [qdd, xd] = motion(&motors, states, 0.0, ratio);
            let line = |what: &str, value: f64| {
                let what = format!("f64 with inductance {inductance:.0e} H, {what}, u of the greatest");
                Outcome::new(2, &name, what, value, 200.0)
            };
            outcomes.extend([line("q̈", qdd), line("rates of currents", xd)]);
        }
    }
    for &stiffness in size.pick(&[1e4][..], &[1e1, 1e4, 1e7, 1e10][..]) {
        let stages =
            format!("stages = [{{ ratio = 100.0, stiffness = {stiffness:?}, damping = 1.0, input_inertia = 1e-5 }}]");
        let elastic = driven(&drives("", &stages));
        // 100 N·m in the spring: the angles that it is a difference of are rounded, and that is the problem's
        let [qdd, xd] = motion(&elastic, states, 100.0 / stiffness, 100.0);
        let amplified = 1.0 + stiffness / 100.0;
        let line = |what: &str, value: f64| {
            let what = format!("f64, {what}, u of the greatest × (1 + c/100)");
            Outcome::new(2, format!("planar2r, springs of {stiffness:.0e} N·m/rad"), what, value / amplified, 200.0)
        };
        outcomes.extend([line("q̈", qdd), line("rates of shafts", xd)]);
    }
    outcomes.extend(swinging(size.pick(300, 1_000_000)));
    outcomes
}

/// The arm swings on its springs, its motors all but unwound: no current, so that nothing is lost.
fn swinging(steps: usize) -> Vec<Outcome> {
    let scene = drives("", "stages = [{ ratio = 100.0, stiffness = 100.0, input_inertia = 9e-5 }]")
        .replace("torque_constant = 0.05", "torque_constant = 1e-12");
    let driven = driven(&scene);
    let [forward, of_drives] = [DrivenForwardDynamics, DriveEnergy].map(|f| driven.program(f));
    let of_bodies = driven.program(Function::Energy);
    // coordinates: joints, then shafts; x holds a shaft's angle and speed per drive
    let x_of = |q: &[f64; 4], qd: &[f64; 4]| [q[2], qd[2], q[3], qd[3]];
    let run = |graph: &Graph, q: &[f64; 4], qd: &[f64; 4]| -> Vec<f64> {
        let x = x_of(q, qd);
        let named = |name: &str| -> &[f64] {
            match name {
                "q" => &q[..2],
                "qd" => &qd[..2],
                "x" => &x,
                "u" => &[0.0; 2],
                other => panic!("an input {other}"),
            }
        };
        evaluate(graph, &graph.inputs.iter().flat_map(|p| named(&p.name).iter().copied()).collect::<Vec<_>>())
    };
    let energy =
        |s: &State<f64, 4, 4>| -> f64 { [&of_bodies, &of_drives].into_iter().flat_map(|g| run(g, &s.q, &s.qd)).sum() };
    let start = State { q: [0.3, 0.4, 30.0, 38.0], qd: [0.0; 4] };
    let mut state = Compensated::new(start);
    let (first, step) = (energy(&start), Step::of(2.5e-4));
    let (mut drift, mut swing) = (0.0f64, 0.0f64);
    let potential = |s: &State<f64, 4, 4>| run(&of_bodies, &s.q, &s.qd)[1];
    for i in 0..steps {
        let change = step.runge_kutta_4(0.0, &state.state, |_t, q, qd, qdd| {
            let rates = run(&forward, q, qd);
            // q̈ of two joints, then per drive θ̇ and θ̈
            *qdd = [rates[0], rates[1], rates[3], rates[5]];
        });
        state.add(&change, 0);
        if i % 16 == 0 || i + 1 == steps {
            let off = (energy(&state.state) - first).abs();
            drift = if off.is_finite() { drift.max(off) } else { f64::INFINITY };
            swing = swing.max((potential(&state.state) - potential(&start)).abs());
        }
    }
    let what = format!("f64 Runge-Kutta 4, compensated, {steps} steps of 0.25 ms, |ΔE| / greatest change of V");
    vec![Outcome::new(15, "planar2r on elastic transmissions", what, drift / swing, 1e-6)]
}
