//! The robot's own functions, and what its motors do.

use super::support::{in_node, natively, robot, robots};
use serde_json::{json, Value};
use straightline_codegen::diagnostic::Source;
use straightline_codegen::model::{load, ModelOptions};
use straightline_core::algorithms::inverse_dynamics;
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_playground::base64;

fn numbers(of: &Value) -> Vec<f64> {
    base64::numbers(of.as_str().unwrap()).unwrap()
}

fn plain(of: &Value) -> Vec<f64> {
    of.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn model(name: &str, text: &str) -> Model<f64> {
    load(&Source::new(name, text), &ModelOptions::default()).0.unwrap().map(Dd::to_f64)
}

/// q, q̇ and q̈ of the motion, row by row.
fn rows(answer: &Value) -> Vec<[Vec<f64>; 3]> {
    let (nq, nv) = (answer["nq"].as_u64().unwrap() as usize, answer["nv"].as_u64().unwrap() as usize);
    let [q, qd, qdd] = ["q", "qd", "qdd"].map(|name| numbers(&answer[name]));
    let row = |k: usize| [q[k * nq..][..nq].to_vec(), qd[k * nv..][..nv].to_vec(), qdd[k * nv..][..nv].to_vec()];
    (0..q.len() / nq).map(row).collect()
}

#[test]
fn modules_have_the_interpreters_bits_and_torques_are_those_of_the_generic_runtime() {
    let Some(mut node) = in_node() else { return };
    for (name, text) in robots() {
        let (answer, milliseconds) = node.ask("bench", &json!({ "name": name, "text": text }));
        assert!(
            answer["failure"].is_null() && answer["why_not"].is_null(),
            "{name}: {} {}",
            answer["failure"],
            answer["why_not"]
        );
        let checked = answer["checked"].as_u64().unwrap();
        assert!(checked >= 4, "{name}: {checked} functions");
        let model = model(&name, &text);
        let tau = plain(&answer["tau"]);
        let mut most = 0.0f64;
        let scale = tau.iter().fold(1e-3f64, |most, x| most.max(x.abs()));
        for ([q, qd, qdd], own) in rows(&answer).iter().zip(tau.chunks(model.nv())) {
            for (expected, found) in inverse_dynamics(&model, q, qd, qdd).iter().zip(own) {
                most = most.max((expected - found).abs() / scale);
            }
        }
        println!(
            "{name}: {checked} functions, torques within {most:.1e} of the generic runtime's, {milliseconds:.0} ms"
        );
        // what a motion of radians per second leaves of sixteen digits
        assert!(most < 1e-10, "{name}: {most:e}");
    }
}

#[test]
fn a_period_ends_as_it_began_and_keeps_the_joints_ranges() {
    for (name, text) in robots() {
        let answer = natively("bench", &json!({ "name": name, "text": text, "period": 2.0 }));
        let rows = rows(&answer);
        let times = numbers(&answer["times"]);
        assert_eq!((times[0], times[times.len() - 1]), (0.0, 2.0));
        let (first, last) = (&rows[0], &rows[rows.len() - 1]);
        for k in 0..3 {
            for (a, b) in first[k].iter().zip(&last[k]) {
                assert!((a - b).abs() < 1e-12 * (1.0 + a.abs()), "{name}: {a} {b}");
            }
        }
        for joint in answer["joints"].as_array().unwrap() {
            let at = joint["iq"].as_u64().unwrap() as usize;
            for row in &rows {
                let [lower, upper] = ["lower", "upper"].map(|name| joint[name].as_f64());
                assert!(
                    lower.is_none_or(|lower| row[0][at] >= lower - 1e-12)
                        && upper.is_none_or(|upper| row[0][at] <= upper + 1e-12),
                    "{name}: {joint}"
                );
            }
        }
        // q̇ and q̈ are its derivatives: central differences of rows
        let h = times[1] - times[0];
        for window in rows.windows(3) {
            for joint in answer["joints"].as_array().unwrap() {
                let [iq, iv] = ["iq", "iv"].map(|name| joint[name].as_u64().unwrap() as usize);
                let speed = (window[2][0][iq] - window[0][0][iq]) / (2.0 * h);
                // third derivatives are at most 0.6 π³, and there are 60 rows at least
                assert!((speed - window[1][1][iv]).abs() < 0.6 * 31.1 * h * h / 6.0 * 1.01, "{name}");
            }
        }
    }
}

/// A motor's equations, written anew: M = τ/n + J n q̈ at the shaft, i = M/C_M, u = R i + C_M n q̇.
#[test]
fn currents_voltages_and_heat_are_those_of_the_motors_equations() {
    let request = json!({ "name": "planar_2r.toml", "text": robot("planar_2r.toml"), "period": 3.0 });
    let answer = natively("bench", &request);
    let rows = rows(&answer);
    let model = model("planar_2r.toml", &robot("planar_2r.toml"));
    let tau: Vec<f64> = rows.iter().flat_map(|[q, qd, qdd]| inverse_dynamics(&model, q, qd, qdd)).collect();
    let mut asked = request.clone();
    asked["tau"] = base64::of_numbers(&tau).into();
    let drives = natively("drives", &asked);
    assert!(drives["why_not"].is_null(), "{drives}");
    let motors = answer["motors"].as_array().unwrap();
    assert_eq!(motors.len(), 2);
    let [current, input, speed, joule] = ["current", "input", "speed", "joule"].map(|name| numbers(&drives[name]));
    for (k, motor) in motors.iter().enumerate() {
        let of = |name: &str| motor[name].as_f64().unwrap();
        let (n, torque_constant, resistance) = (of("ratio"), of("torque_constant"), of("resistance"));
        for (row, [_, qd, qdd]) in rows.iter().enumerate() {
            let i = (tau[2 * row + k] / n + of("rotor_inertia") * n * qdd[k]) / torque_constant;
            let u = resistance * i + torque_constant * n * qd[k];
            let at = k * rows.len() + row;
            let close = |found: f64, expected: f64, scale: f64| (found - expected).abs() <= 1e-12 * scale;
            assert!(close(current[at], i, 15.0) && close(input[at], u, 48.0), "{} {i}, {} {u}", current[at], input[at]);
            assert!(close(speed[at], n * qd[k], 1000.0) && close(joule[at], resistance * i * i, 100.0));
        }
    }
}

#[test]
fn motors_that_are_given_are_used_and_a_payload_is_carried() {
    let text = robot("planar_2r.toml");
    let bare = natively("bench", &json!({ "name": "planar_2r.toml", "text": text }));
    let mut motors = bare["motors"].clone();
    motors[0]["resistance"] = 0.25.into();
    let answer =
        natively("bench", &json!({ "name": "planar_2r.toml", "text": text, "motors": motors, "payload": 1.5 }));
    assert_eq!(answer["motors"], motors);
    let scene = answer["scene"].as_str().unwrap();
    assert!(
        scene.contains("resistance = 0.25") && scene.contains("mass = 1.5") && scene.contains("frame = \"tip\""),
        "{scene}"
    );
    // the scene that the page shows is one that the compiler takes
    let taken = natively("compile", &json!({ "name": "planar_2r.toml", "text": text, "scene": scene, "quick": true }));
    assert!(taken["text"].as_str().unwrap().contains("driven_inverse_dynamics"), "{}", taken["complaints"]);
}
