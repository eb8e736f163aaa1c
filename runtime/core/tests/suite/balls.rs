//! Robots with ball joints, against values with 25 digits: a pendulum, a chain with two of them, and one afloat with three.

use crate::support::data::{inputs, numbers, reference_file};
use crate::support::mjcf;
use serde_json::Value;
use std::collections::BTreeMap;
use straightline_core::algorithms::*;
use straightline_core::model::Model;
use straightline_core::spatial::{Mat3, Vec3};
use straightline_core::{Dd, Dual, Real};

const ROBOTS: [&str; 3] = ["ball_pendulum", "ball_chain", "ball_float"];

fn json(path: &str) -> Value {
    let text = std::fs::read_to_string(reference_file(path)).expect("the data");
    serde_json::from_str(&text).expect("JSON")
}

fn robot(name: &str) -> Model<Dd> {
    let path = reference_file(&format!("joints/robots/{name}.xml"));
    mjcf::robot(&std::fs::read_to_string(path).expect("the data"))
}

fn columns<T: Real>(m: &Mat3<T>) -> Vec<T> {
    m.rows.concat()
}

/// ∂τ/∂q along the tangent and ∂τ/∂q̇, by rows, in dual numbers.
fn derivatives<T: Real>(model: &Model<T>, [q, qd, qdd]: [&[T]; 3]) -> [Vec<T>; 2] {
    let (wide, nv) = (model.map(Dual::<T, 1>::fixed), qd.len());
    let with = |x: &[T], rates: &[T]| -> Vec<Dual<T, 1>> {
        x.iter().zip(rates).map(|(x, rate)| Dual { value: *x, derivatives: [*rate] }).collect()
    };
    let none = |x: &[T]| vec![T::zero(); x.len()];
    let mut all = [vec![T::zero(); nv * nv], vec![T::zero(); nv * nv]];
    for k in 0..nv {
        let mut unit = none(qd);
        unit[k] = T::one();
        let fixed = with(qdd, &none(qdd));
        let by_q = inverse_dynamics(&wide, &with(q, &model.configuration_rate(q, &unit)), &with(qd, &none(qd)), &fixed);
        let by_qd = inverse_dynamics(&wide, &with(q, &none(q)), &with(qd, &unit), &fixed);
        for i in 0..nv {
            (all[0][i * nv + k], all[1][i * nv + k]) = (by_q[i].derivatives[0], by_qd[i].derivatives[0]);
        }
    }
    all
}

/// What is found, what is expected and against what errors are judged, by the name of the baseline.
type Outputs<T> = Vec<(&'static str, Vec<T>, Vec<Dd>, Vec<f64>)>;

fn outputs<T: Real>(model: &Model<T>, state: &Value, frames: &[String], most_potential: f64) -> Outputs<T> {
    let of = |name: &str| -> Vec<T> { inputs(&state[name]).into_iter().map(T::constant).collect() };
    let [mut q, qd, qdd, fd_tau] = ["q", "qd", "qdd", "fd_tau"].map(of);
    let mut model = model.clone();
    if let Some(gravity) = state.get("gravity").filter(|g| !g.is_null()) {
        let [x, y, z] = inputs(gravity).try_into().expect("three components");
        model.gravity = Vec3::new(x, y, z).map(T::constant);
    }
    // attitudes of the data are those of the quaternions of length one
    for joint in model.bodies.iter().map(|body| &body.joint) {
        joint.kind.normalise(&mut q[joint.iq..joint.iq + joint.kind.nq()]);
    }
    let (m, q) = (&model, &q[..]);
    let size = |x: &[Dd]| x.iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
    let scale = |of: &str| numbers(&state["scale"][of]).iter().map(|x| x.to_f64()).collect::<Vec<f64>>();
    let whole = |x: &[Dd]| vec![size(x); x.len()];
    let mut all: Outputs<T> = Vec::new();
    let mut scaled = |name, found, field: &str, of: &str| all.push((name, found, numbers(&state[field]), scale(of)));
    scaled("inverse_dynamics", inverse_dynamics(m, q, &qd, &qdd), "tau", "tau");
    scaled("bias_force", bias_force(m, q, &qd), "h", "h");
    scaled("gravity_force", gravity_force(m, q), "g", "g");
    scaled("velocity_force", velocity_force(m, q, &qd), "C", "C");
    scaled("forward_dynamics", forward_dynamics_aba(m, q, &qd, &fd_tau), "fd_qdd", "fd");
    scaled("forward_dynamics", forward_dynamics_ltdl(m, q, &qd, &fd_tau), "fd_qdd", "fd");
    let (h, n) = (numbers(&state["H"]), qd.len());
    let bounds = (0..n * n).map(|k| (h[k / n * (n + 1)].to_f64() * h[k % n * (n + 1)].to_f64()).sqrt()).collect();
    all.push(("mass_matrix", mass_matrix(m, q), h, bounds));
    // C q̇ of the Coriolis matrix
    let c = coriolis_matrix(m, q, &qd);
    let c_qd = c.chunks(n).map(|row| row.iter().zip(&qd).fold(T::zero(), |sum, (c, x)| sum + *c * *x)).collect();
    all.push(("coriolis", c_qd, numbers(&state["C"]), scale("C")));
    let energies = [numbers(&state["T"])[0], numbers(&state["V"])[0]];
    let found = vec![kinetic_energy(m, q, &qd), potential_energy(m, q)];
    all.push(("energy", found, energies.to_vec(), vec![energies[0].to_f64(), most_potential]));
    for (wrench, expected) in joint_wrenches(m, q, &qd, &qdd).iter().zip(state["wrench"].as_array().expect("a list")) {
        let expected = numbers(expected);
        let found = [wrench.force.to_array(), wrench.moment.to_array()].concat();
        all.push(("wrench", found, expected.clone(), whole(&expected)));
    }
    for name in frames {
        let (frame, expected) = (m.frame(name).expect("a frame per body"), &state["frames"][name]);
        let pose = &forward_kinematics(m, q, &[frame])[0];
        let bias = jacobian_bias(m, q, &qd, frame);
        for (of, found, field) in [
            ("frame_position", pose.translation.to_array().to_vec(), "p"),
            ("frame_rotation", columns(&pose.rotation), "R"),
            ("frame_jacobian", jacobian(m, q, frame), "J"),
            ("frame_jdqd", [bias.linear.to_array(), bias.angular.to_array()].concat(), "Jdqd"),
        ] {
            let expected = numbers(&expected[field]);
            all.push((of, found, expected.clone(), whole(&expected)));
        }
    }
    if let Some(dtau_dq) = state.get("dtau_dq") {
        let expected = [numbers(dtau_dq), numbers(&state["dtau_dqd"])];
        for (found, expected) in derivatives(m, [q, &qd, &qdd]).into_iter().zip(expected) {
            all.push(("derivatives", found, expected.clone(), whole(&expected)));
        }
    }
    all
}

/// The worst errors, by robot and output, and how often each was compared.
fn worst<T: Real + Into<Dd>>() -> BTreeMap<(&'static str, &'static str), (f64, String)> {
    let mut worst: BTreeMap<_, (f64, String)> = BTreeMap::new();
    for name in ROBOTS {
        let (model, file) = (robot(name).map(T::constant), json(&format!("joints/states/{name}.json")));
        let frames: Vec<String> =
            file["frames"].as_array().expect("a list").iter().map(|x| x.as_str().expect("a name").into()).collect();
        let states = file["states"].as_array().expect("a list");
        assert_eq!(states.len(), 19);
        let potentials = states.iter().map(|state| numbers(&state["V"])[0].to_f64().abs());
        let most = potentials.fold(0.0, f64::max);
        for state in states {
            for (output, found, expected, scales) in outputs(&model, state, &frames, most) {
                assert_eq!(found.len(), expected.len(), "{output} of {name}");
                for ((found, expected), scale) in found.iter().zip(&expected).zip(&scales) {
                    let error = ((*found).into() - *expected).abs().to_f64();
                    let error = if error == 0.0 { 0.0 } else { error / scale };
                    let entry = worst.entry((name, output)).or_default();
                    if error.is_nan() || error > entry.0 {
                        *entry = (error, format!("{} {}", state["id"], state["kind"]));
                    }
                }
            }
        }
    }
    for ((robot, output), (error, state)) in &worst {
        println!("{robot:14} {output:18} {error:8.1e}  {state}");
    }
    worst
}

/// The data have 25 digits.
#[test]
fn double_double_has_the_digits_of_the_data() {
    for (of, (error, state)) in worst::<Dd>() {
        assert!(error <= 2e-24, "{of:?}: {error:e} of the scale in {state}");
    }
}

/// Twenty times what a straightforward evaluation loses, or 1e-14 of the scale.
#[test]
fn f64_loses_a_few_roundings() {
    let baseline = json("joints/baseline_float.json");
    for ((robot, output), (error, state)) in worst::<f64>() {
        let of_baseline = &baseline["robots"][robot][output]["scaled"];
        let most = (20.0 * of_baseline.as_f64().unwrap_or(0.0)).max(1e-14);
        assert!(error <= most, "{output} of {robot}: {error:e} of the scale in {state}");
    }
}
