//! Drives and transmissions against the reference data of `reference/cases`: compiled programs, operation by operation in f64.

use serde_json::Value;
use std::fmt::Write;
use straightline_codegen::Function::{
    CompleteModel, DriveTorques, DrivenForwardDynamics, DrivenInverseDynamics, StateSpace,
};
use straightline_core::Dd;
use straightline_generated_tests::bounds::DRIVE;
use straightline_generated_tests::drives::Driven;
use straightline_generated_tests::reference::{folder, inputs, json, numbers};

fn cases(kind: &str) -> Vec<Value> {
    let file = json(&folder().join("cases").join(format!("{kind}.json")));
    file["cases"].as_array().expect("a list of cases").clone()
}

fn joints(robot: &str) -> Vec<String> {
    let file = json(&folder().join("states").join(format!("{robot}.json")));
    let joints = file["joints"].as_array().expect("a list").iter();
    joints.map(|j| j["name"].as_str().expect("a name").to_string()).collect()
}

/// The greatest |value − expected| over the largest expected, or over `least` if that is more.
fn error(values: &[f64], expected: &Value, least: f64) -> f64 {
    let expected = numbers(expected);
    assert_eq!(values.len(), expected.len());
    let scale = expected.iter().map(|x| x.to_f64().abs()).fold(least, f64::max);
    let errors = values.iter().zip(&expected).map(|(v, e)| (Dd::from(*v) - *e).to_f64().abs() / scale);
    errors.fold(0.0, |worst, e| if e <= worst { worst } else { e })
}

/// The worst error of every quantity, and where.
#[derive(Default)]
struct Worst(std::collections::BTreeMap<String, (f64, String)>);

impl Worst {
    fn note(&mut self, quantity: &str, case: &Value, error: f64) {
        let entry = self.0.entry(quantity.to_string()).or_default();
        if error.is_nan() || error > entry.0 {
            *entry = (error, case["id"].as_str().expect("an id").to_string());
        }
    }

    fn judge(&self) {
        let mut text = String::new();
        for (quantity, (error, case)) in &self.0 {
            let _ = writeln!(text, "{quantity:24} {error:9.2e}  {case}");
        }
        println!("{text}");
        assert!(self.0.len() > 1 && self.0.values().all(|(error, _)| DRIVE.allows(*error)), "\n{text}");
    }
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_str().expect("a number").parse().expect("a number")
}

fn flat(values: &[Vec<f64>]) -> Vec<f64> {
    values.concat()
}

/// The motors of a case as tables of a scene.
fn motors(case: &Value, has_inductance: bool, is_lossy: bool, friction: bool) -> String {
    let mut text = String::new();
    let names = joints(case["robot"].as_str().expect("a robot"));
    for (joint, m) in names.iter().zip(case["motors"].as_array().expect("motors")) {
        let n = |key: &str| number(m, key);
        let _ = write!(
            text,
            "[[drive]]\njoint = \"{joint}\"\nratio = {:?}\nmotor = {{ torque_constant = {:?}, emf_constant = {:?}, \
             resistance = {:?}, rotor_inertia = {:?}",
            n("N"),
            n("CM"),
            n("CE"),
            n("R"),
            n("J")
        );
        if friction {
            let _ = write!(text, ", friction = {:?}", n("B"));
        }
        if has_inductance {
            let _ = write!(text, ", inductance = {:?}", n("L"));
        }
        text.push_str(" }\n");
        if is_lossy {
            let _ = writeln!(text, "efficiency = {{ forward = {:?}, backward = {:?} }}", n("eta1"), n("eta2"));
        }
    }
    text
}

#[test]
fn dc_motors_are_those_of_the_reference() {
    let mut worst = Worst::default();
    for case in &cases("dc_motor") {
        let (robot, gravity) = (case["robot"].as_str().expect("a robot"), &case["gravity"]);
        let [q, qd, u, current] = ["q", "qd", "u", "current"].map(|key| inputs(&case[key]));
        for (key, has_inductance, is_lossy) in [
            ("three_state_ideal", true, false),
            ("three_state_eta", true, true),
            ("two_state_ideal", false, false),
            ("two_state_eta", false, true),
        ] {
            let driven = Driven::of_reference(robot, gravity, &motors(case, has_inductance, is_lossy, true));
            // θ and θ̇ of x are not read
            let x: Vec<f64> = match has_inductance {
                true => current.iter().flat_map(|i| [f64::NAN, f64::NAN, *i]).collect(),
                false => vec![f64::NAN; 2 * q.len()],
            };
            let at: &[(&str, &[f64])] = &[("q", &q), ("qd", &qd), ("x", &x), ("u", &u)];
            let expected = &case["expected"][key];
            let motion = driven.run(DrivenForwardDynamics, at);
            worst.note(&format!("{key} qdd"), case, error(&motion[0], &expected["qdd"], 0.0));
            worst.note(&format!("{key} xd"), case, error(&motion[1], &expected["xd"], 0.0));
            let torques = driven.run(DriveTorques, at);
            // a torque is what is left of the motor's and of what its rotor takes
            let of_motors = case["motors"].as_array().expect("motors").iter().enumerate().map(|(k, m)| {
                let n = |key: &str| number(m, key);
                let speed = n("N") * qd[k];
                let free =
                    if has_inductance { n("CM") * current[k] } else { n("CM") / n("R") * (u[k] - n("CE") * speed) };
                (n("N").abs(), (n("B") * speed).abs() + free.abs() + (n("J") * n("N") * motion[0][k]).abs())
            });
            let (least_tau, least_m) = of_motors.fold((0.0_f64, 0.0_f64), |(a, b), (n, m)| (a.max(n * m), b.max(m)));
            worst.note(&format!("{key} tau"), case, error(&torques[0], &expected["tau"], least_tau));
            worst.note(&format!("{key} M"), case, error(&torques[1], &expected["M"], least_m));
        }
        let driven = Driven::of_reference(robot, gravity, &motors(case, false, false, false));
        let star = &case["expected"]["star"];
        let x = vec![f64::NAN; 2 * q.len()];
        let model = driven.run(CompleteModel, &[("q", &q), ("qd", &qd), ("x", &x)]);
        worst.note("H*", case, error(&model[0], &star["H_star"], 0.0));
        worst.note("h*", case, error(&model[1], &star["h_star"], 0.0));
        let n = q.len();
        let diagonal: Vec<f64> = (0..n).map(|i| model[2][i * n + i]).collect();
        worst.note("D", case, error(&diagonal, &star["D"], 0.0));
        assert!((0..n * n).all(|k| k % (n + 1) == 0 || model[2][k] == 0.0), "D is diagonal");
        let qdd = inputs(&star["qdd_given"]);
        let u_given = driven.run(DrivenInverseDynamics, &[("q", &q), ("qd", &qd), ("qdd", &qdd)]);
        worst.note("u for a motion", case, error(&u_given[0], &star["u_for_qdd_given"], 0.0));
        let motion = driven.run(DrivenForwardDynamics, &[("q", &q), ("qd", &qd), ("x", &x), ("u", &u)]);
        worst.note("q̈ of (20.72)", case, error(&motion[0], &star["qdd"], 0.0));
    }
    worst.judge();
}

#[test]
fn linear_actuators_are_those_of_the_reference() {
    let mut worst = Worst::default();
    for case in &cases("actuators") {
        let robot = case["robot"].as_str().expect("a robot");
        let mut text = String::new();
        let row = |value: &Value| format!("{:?}", inputs(value));
        for (joint, a) in joints(robot).iter().zip(case["actuators"].as_array().expect("actuators")) {
            let rows: Vec<String> = a["C"].as_array().expect("rows").iter().map(row).collect();
            let _ = writeln!(
                text,
                "[[drive]]\njoint = \"{joint}\"\nactuator = {{ C = [{}], f = {}, d = {}, T = {} }}",
                rows.join(", "),
                row(&a["f"]),
                row(&a["d"]),
                row(&a["T"])
            );
        }
        let driven = Driven::of_reference(robot, &case["gravity"], &text);
        let [q, qd, u] = ["q", "qd", "u"].map(|key| inputs(&case[key]));
        let x: Vec<f64> = flat(&case["x"].as_array().expect("states").iter().map(inputs).collect::<Vec<_>>());
        let at: &[(&str, &[f64])] = &[("q", &q), ("qd", &qd), ("x", &x), ("u", &u)];
        let expected = match &case["expected"] {
            Value::Null => case,
            expected => expected,
        };
        let motion = driven.run(DrivenForwardDynamics, at);
        worst.note("xd", case, error(&motion[1], &expected["xd"], 0.0));
        let torques = driven.run(DriveTorques, at);
        worst.note("tau", case, error(&torques[0], &expected["tau"], 0.0));
        let space = driven.run(StateSpace, at);
        worst.note("Ĉ", case, error(&space[0], &expected["C_hat"], 0.0));
        worst.note("D̂", case, error(&space[1], &expected["D_hat"], 0.0));
    }
    worst.judge();
}

#[test]
fn elastic_transmissions_are_those_of_the_reference() {
    let mut worst = Worst::default();
    for case in &cases("elastic") {
        let robot = case["robot"].as_str().expect("a robot");
        let mut text = String::new();
        for (joint, p) in joints(robot).iter().zip(case["params"].as_array().expect("parameters")) {
            let n = |key: &str| number(p, key);
            let _ = writeln!(
                text,
                "[[drive]]\njoint = \"{joint}\"\nmotor = {{ torque_constant = {:?}, emf_constant = {:?}, resistance = {:?}, \
                 rotor_inertia = {:?} }}\nstages = [{{ ratio = {:?}, stiffness = {:?}, damping = {:?}, input_inertia = {:?}, \
                 output_inertia = {:?} }}]",
                n("CM"),
                n("CE"),
                n("R"),
                n("J"),
                n("N"),
                n("c"),
                n("d"),
                n("I1"),
                n("I2")
            );
        }
        let driven = Driven::of_reference(robot, &case["gravity"], &text);
        let [q, qd, u, theta, thetad] = ["q", "qd", "u", "theta", "thetad"].map(|key| inputs(&case[key]));
        let x: Vec<f64> = theta.iter().zip(&thetad).flat_map(|(a, b)| [*a, *b]).collect();
        let at: &[(&str, &[f64])] = &[("q", &q), ("qd", &qd), ("x", &x), ("u", &u)];
        let expected = match &case["expected"] {
            Value::Null => case,
            expected => expected,
        };
        // τ is a difference of θ/N and q: a rounding of these, times the stiffness, is its scale's
        let of_joint = |k: usize| {
            let p = &case["params"][k];
            let (n, c, d) = (number(p, "N"), number(p, "c"), number(p, "d"));
            c * ((theta[k] / n).abs() + q[k].abs()) + d * ((thetad[k] / n).abs() + qd[k].abs())
        };
        let tau_scale = (0..q.len()).map(of_joint).fold(0.0, f64::max);
        let largest = numbers(&expected["tau"]).iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
        let least = |key: &str| {
            tau_scale / largest * numbers(&expected[key]).iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max)
        };
        let motion = driven.run(DrivenForwardDynamics, at);
        worst.note("qdd", case, error(&motion[0], &expected["qdd"], least("qdd")));
        let thetadd: Vec<f64> = motion[1].chunks(2).map(|x| x[1]).collect();
        worst.note("thetadd", case, error(&thetadd, &expected["thetadd"], least("thetadd")));
        let torques = driven.run(DriveTorques, at);
        worst.note("tau", case, error(&torques[0], &expected["tau"], tau_scale));
        worst.note("M", case, error(&torques[1], &expected["M"], least("M")));
    }
    worst.judge();
}

#[test]
fn a_robot_without_drives_has_no_function_of_drives() {
    let driven = Driven::of_reference("planar2r", &serde_json::json!(["0", "0", "-9.81"]), "");
    use straightline_codegen::Function;
    assert!(Function::of(&driven.robot.model).eq(Function::all()));
    assert!(Function::known().any(|f| f == Function::DriveEnergy));
}
