//! Drives against the reference's own formulation in double-double, and against what physics says of any drive: rotors as
//! bodies of their own, power that goes nowhere else, motions that come back.

use nalgebra::{DMatrix, DVector};
use std::fmt::Write;
use std::process::Command;
use straightline_codegen::compile::compile;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::Graph;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::options::Options;
use straightline_codegen::program::program;
use straightline_codegen::verify::reference_input::centre_of_mass_tree;
use straightline_codegen::verify::verify;
use straightline_codegen::Function::{
    CompleteModel, DriveEnergy, DrivePower, DriveTorques, DrivenForwardDynamics, DrivenInverseDynamics, StateSpace,
};
use straightline_codegen::{description as read, Function, Scalar};
use straightline_core::model::Model;
use straightline_core::reference::drives::{before_elastic_stage, ActuatorModel, DcMotor, ElasticStage, UnitedModel};
use straightline_core::{algorithms as alg, reference, Dd, Real, Taylor};
use straightline_generated_tests::bounds::DRIVE_AUTHORS;
use straightline_generated_tests::drives::{blocks, Driven};
use straightline_generated_tests::random::Random;
use straightline_generated_tests::reference::description;

pub(super) fn source(robot: &str) -> Source {
    let path = description(robot);
    let text = std::fs::read_to_string(&path).expect("the robot file is there");
    Source::new(&path.file_name().expect("a file").to_string_lossy(), text)
}

pub(super) fn wide(x: &[f64]) -> Vec<Dd> {
    x.iter().map(|x| Dd::from(*x)).collect()
}

fn vector(x: &[Dd]) -> DVector<Dd> {
    DVector::from_column_slice(x)
}

/// A drive, for the file and for the reference.
pub(super) struct Both {
    pub(super) text: String,
    actuator: ActuatorModel<Dd>,
    eta: Option<(Dd, Dd)>,
    /// Row of ratios over the joints, of a rigid drive; of an elastic one that of its last stage.
    row: Vec<f64>,
    stages: Vec<ElasticStage<Dd>>,
    pub(super) state: Vec<f64>,
}

fn efficiency(random: &mut Random) -> ([f64; 2], Option<(Dd, Dd)>) {
    let eta = [random.between(0.5, 0.95), random.between(0.3, 0.9)];
    (eta, Some((Dd::from(eta[0]), Dd::from(eta[1]))))
}

/// A motor of either order or a linear actuator; rigid or elastic; on one joint.
pub(super) fn random_drive(random: &mut Random, k: usize, joints: &[String], is_lossy: bool) -> Both {
    let kind = random.below(5);
    let mut text = format!("[[drive]]\njoint = \"{}\"\n", joints[k]);
    let is_elastic = kind >= 3;
    let d = Dd::from;
    let (actuator, mut state) = if kind == 2 {
        let n = 4;
        let c: Vec<Vec<f64>> = (0..n).map(|_| random.list(n, 3.0)).collect();
        let (mut f, gain, t) = (random.list(n, 0.5), random.list(n, 2.0), random.list(n, 1.0));
        // T f < 0: a torque on the shaft slows it down
        let tf: f64 = t.iter().zip(&f).map(|(a, b)| a * b).sum();
        let scale = -random.between(2.0, 20.0) / tf;
        f.iter_mut().for_each(|x| *x *= scale);
        let _ = writeln!(text, "actuator = {{ C = {c:?}, f = {f:?}, d = {gain:?}, T = {t:?} }}");
        let model = ActuatorModel {
            c: DMatrix::from_row_slice(n, n, &wide(&c.concat())),
            f: vector(&wide(&f)),
            d: vector(&wide(&gain)),
            t: vector(&wide(&t)),
        };
        (model, random.list(n, 1.0))
    } else {
        let [j, c_m, c_e, b, r, l] = [(1e-5, 3e-4), (0.02, 0.3), (0.02, 0.3), (1e-6, 1e-4), (0.3, 3.0), (1e-4, 5e-3)]
            .map(|(low, high)| random.between(low, high));
        let third = random.below(2) == 0;
        let _ = write!(
            text,
            "motor = {{ rotor_inertia = {j:?}, torque_constant = {c_m:?}, emf_constant = {c_e:?}, friction = {b:?}, \
             resistance = {r:?}"
        );
        if third {
            let _ = write!(text, ", inductance = {l:?}");
        }
        text.push_str(" }\n");
        let motor = DcMotor { j: d(j), c_m: d(c_m), c_e: d(c_e), b: d(b), r: d(r), l: third.then(|| d(l)) };
        let n = if third { 3 } else { 2 };
        (motor.model(), random.list(n, 2.0))
    };
    let mut row = vec![0.0; joints.len()];
    let mut stages = Vec::new();
    let mut eta = None;
    if is_elastic {
        text.push_str("stages = [");
        for _ in 0..kind - 2 {
            let [n, i1, i2, c, damping] = [(2.0, 60.0), (1e-6, 1e-4), (1e-3, 1e-2), (50.0, 5e3), (0.1, 5.0)]
                .map(|(low, high)| random.between(low, high));
            let n = if random.below(3) == 0 { -n } else { n };
            let _ = write!(
                text,
                "{{ ratio = {n:?}, input_inertia = {i1:?}, output_inertia = {i2:?}, stiffness = {c:?}, damping = {damping:?}"
            );
            let mut lost = None;
            if is_lossy {
                let (written, both) = efficiency(random);
                let _ = write!(text, ", efficiency = {{ forward = {:?}, backward = {:?} }}", written[0], written[1]);
                lost = both;
            }
            text.push_str(" },\n");
            stages.push(ElasticStage { n: d(n), i1: d(i1), i2: d(i2), c: d(c), d: d(damping), eta: lost });
        }
        text.push_str("]\n");
        row[k] = 1.0;
        state.extend(random.list(2 * (stages.len() - 1), 2.0));
    } else {
        let n = random.between(5.0, 100.0);
        row[k] = if random.below(3) == 0 { -n } else { n };
        let _ = writeln!(text, "ratio = {:?}", row[k]);
        if is_lossy && kind != 2 {
            let (written, both) = efficiency(random);
            let _ = writeln!(text, "efficiency = {{ forward = {:?}, backward = {:?} }}", written[0], written[1]);
            eta = both;
        }
    }
    Both { text, actuator, eta, row, stages, state }
}

/// |a − b| over the largest of both lists.
pub(super) fn distance(a: &[Dd], b: &[Dd]) -> f64 {
    assert_eq!(a.len(), b.len());
    let scale = a.iter().chain(b).map(|x| x.to_f64().abs()).fold(1e-300, f64::max);
    let errors = a.iter().zip(b).map(|(a, b)| (*a - *b).to_f64().abs() / scale);
    errors.fold(0.0, |worst, e| if e <= worst { worst } else { e })
}

fn agree_with_the_reference(robot: &str, seed: u64, is_lossy: bool) {
    let mut random = Random(seed);
    let source = source(robot);
    let file = read::read(&source, &mut Diagnostics::new()).expect("the file is sound");
    let tree = centre_of_mass_tree(&file, &ModelOptions::default()).expect("the reference understands it");
    let plain = Driven::new(&source, &ModelOptions::default(), "");
    let mut bodies: Vec<_> = plain.robot.model.free_joints().collect();
    bodies.sort_by_key(|j| j.iv);
    let joints: Vec<String> = bodies.iter().map(|j| j.name.clone()).collect();
    let n = joints.len();
    let drives: Vec<Both> = (0..n).map(|k| random_drive(&mut random, k, &joints, is_lossy)).collect();
    let text: String = drives.iter().map(|d| d.text.as_str()).collect();
    let driven = Driven::new(&source, &ModelOptions::default(), &text);
    let (q, qd, u) = (random.list(n, 2.5), random.list(n, 2.0), random.list(n, 20.0));
    let (wq, wqd, wu) = (wide(&q), wide(&qd), wide(&u));

    // the chapter: springs first, then the united model of what is rigid
    let h_matrix = reference::mass_matrix(&tree, &wq);
    let mut h = reference::bias_force(&tree, &wq, &wqd);
    let (mut tau_elastic, mut elastic) = (vec![Dd::ZERO; n], vec![None; n]);
    // θ and θ̇ of elastic drives near the joint's, as springs are stiff
    let mut x: Vec<Vec<Dd>> = drives.iter().map(|d| wide(&d.state)).collect();
    for (k, drive) in drives.iter().enumerate().filter(|(_, d)| !d.stages.is_empty()) {
        let mut shafts: Vec<(Dd, Dd)> = vec![(wq[k], wqd[k])];
        for stage in drive.stages.iter().rev() {
            let behind = *shafts.last().expect("the joint's");
            let slack = [random.between(-0.01, 0.01), random.between(-0.1, 0.1)].map(Dd::from);
            shafts.push(((behind.0 + slack[0]) * stage.n, (behind.1 + slack[1]) * stage.n));
        }
        shafts.reverse();
        let own = drive.actuator.f.len();
        (x[k][0], x[k][1]) = shafts[0];
        for (i, shaft) in shafts[1..drive.stages.len()].iter().enumerate() {
            (x[k][own + 2 * i], x[k][own + 2 * i + 1]) = *shaft;
        }
        let torques: Vec<Dd> =
            drive.stages.iter().enumerate().map(|(i, s)| s.torque(shafts[i], shafts[i + 1])).collect();
        let taken: Vec<Dd> = drive.stages.iter().enumerate().map(|(i, s)| s.taken(torques[i], shafts[i].1)).collect();
        let first = &drive.stages[0];
        let own_state = vector(&x[k][..own]);
        let (m, mut xd) = before_elastic_stage(&drive.actuator, &own_state, wu[k], first.inertia(), taken[0]);
        let mut rates: Vec<Dd> = xd.iter().copied().collect();
        for i in 1..drive.stages.len() {
            rates.push(shafts[i].1);
            rates.push((torques[i - 1] - taken[i]) / drive.stages[i].inertia());
        }
        xd = vector(&rates);
        tau_elastic[k] = torques[drive.stages.len() - 1];
        elastic[k] = Some((m, xd));
    }
    h -= vector(&tau_elastic);
    let rigid: Vec<usize> = (0..n).filter(|k| drives[*k].stages.is_empty()).collect();
    // a motor behind a rigid gear turns with the joint
    for k in &rigid {
        let is_motor = drives[*k].actuator.f.len() < 4;
        if is_motor {
            (x[*k][0], x[*k][1]) = (Dd::from(drives[*k].row[*k]) * wq[*k], Dd::from(drives[*k].row[*k]) * wqd[*k]);
        }
    }
    let ratios = DMatrix::from_fn(rigid.len(), n, |i, j| Dd::from(drives[rigid[i]].row[j]));
    let speeds: Vec<Dd> = rigid.iter().map(|k| Dd::from(drives[*k].row[*k]) * wqd[*k]).collect();
    let united = UnitedModel {
        h_matrix: h_matrix.clone(),
        h: h.clone(),
        actuators: rigid.iter().map(|k| drives[*k].actuator.clone()).collect(),
        ratios,
        losses: DVector::from_element(rigid.len(), Dd::ONE),
    };
    let x_rigid = vector(&rigid.iter().flat_map(|k| x[*k].clone()).collect::<Vec<_>>());
    let u_rigid = vector(&rigid.iter().map(|k| wu[*k]).collect::<Vec<_>>());
    let efficiencies: Vec<_> = rigid.iter().map(|k| drives[*k].eta).collect();
    let lossy = united.with_losses(&efficiencies, &speeds, &x_rigid, &u_rigid);
    let truth = lossy.solve(&x_rigid, &u_rigid);

    let all_x = x.concat();
    let at: &[(&str, &[Dd])] = &[("q", &wq), ("qd", &wqd), ("x", &all_x), ("u", &wu)];
    let motion = driven.run(DrivenForwardDynamics, at);
    let paste = format!("{robot}, seed {seed}, lossy {is_lossy}:\n{text}");
    let qdd: Vec<Dd> = truth.qdd.iter().copied().collect();
    assert!(DRIVE_AUTHORS.allows(distance(&motion[0], &qdd)), "q̈: {:e}\n{paste}", distance(&motion[0], &qdd));
    let (mut xd, mut first) = (Vec::new(), 0);
    for (k, drive) in drives.iter().enumerate() {
        match &elastic[k] {
            Some((_, rates)) => xd.extend(rates.iter().copied()),
            None => {
                xd.extend(truth.xd.rows(first, drive.actuator.f.len()).iter().copied());
                first += drive.actuator.f.len();
            }
        }
    }
    assert!(DRIVE_AUTHORS.allows(distance(&motion[1], &xd)), "ẋ: {:e}\n{paste}", distance(&motion[1], &xd));
    let torques = driven.run(DriveTorques, at);
    let tau: Vec<Dd> = (0..n).map(|k| truth.tau[k] + tau_elastic[k]).collect();
    assert!(DRIVE_AUTHORS.allows(distance(&torques[0], &tau)), "τ: {:e}\n{paste}", distance(&torques[0], &tau));
    let mut of_rigid = truth.torques.iter();
    let m: Vec<Dd> = elastic
        .iter()
        .map(|e| e.as_ref().map_or_else(|| *of_rigid.next().expect("a rigid one"), |(m, _)| *m))
        .collect();
    assert!(DRIVE_AUTHORS.allows(distance(&torques[1], &m)), "M: {:e}\n{paste}", distance(&torques[1], &m));
    if is_lossy || rigid.len() < n {
        return;
    }
    let printed: Vec<Dd> = united.printed_torques(&x_rigid, &u_rigid).iter().copied().collect();
    assert!(
        DRIVE_AUTHORS.allows(distance(&torques[0], &printed)),
        "(20.80): {:e}\n{paste}",
        distance(&torques[0], &printed)
    );
    let (drift, gain) = united.state_space(&x_rigid);
    let space = driven.run(StateSpace, &at[..3]);
    let drift: Vec<Dd> = drift.iter().copied().collect();
    assert!(DRIVE_AUTHORS.allows(distance(&space[0], &drift)), "Ĉ: {:e}\n{paste}", distance(&space[0], &drift));
    let gain: Vec<Dd> = gain.transpose().iter().copied().collect();
    assert!(DRIVE_AUTHORS.allows(distance(&space[1], &gain)), "D̂: {:e}\n{paste}", distance(&space[1], &gain));
}

#[test]
fn random_motors_agree_with_the_chapter_in_double_double() {
    for (robot, seeds) in [("planar2r", 0..40), ("chapter_stanford", 40..52), ("chapter_cylindrical", 52..64)] {
        for seed in seeds {
            agree_with_the_reference(robot, seed, seed % 2 == 0);
        }
    }
}

/// Slow: more robots, many seeds. `cargo test --release -p straightline-generated-tests --test suite driven_physics:: --
/// --ignored`.
#[test]
#[ignore = "minutes"]
fn many_random_motors_agree_with_the_chapter_in_double_double() {
    for robot in
        ["planar2r", "chapter_stanford", "chapter_cylindrical", "chapter_6r", "chapter_oblique", "ur5", "panda"]
    {
        for seed in 1000..1200 {
            agree_with_the_reference(robot, seed, seed % 2 == 0);
        }
    }
}

/// Two arms with a rotor on the first: welded to it, or as a body of its own.
fn arm_with_rotor(joint: &str) -> String {
    format!(
        r#"
[robot]
name = "arm"
[[link]]
name = "base"
[[link]]
name = "upper"
mass = 2.5
com = [0.02, 0.01, 0.2]
inertia = {{ xx = 0.02, yy = 0.021, zz = 0.004, xy = 0.001 }}
[[link]]
name = "rotor"
mass = 0.4
com = [0.0, 0.0, 0.03]
inertia = [3e-4, 3e-4, 2e-4]
[[link]]
name = "lower"
mass = 1.5
com = [0.01, 0.02, 0.1]
inertia = {{ xx = 0.01, yy = 0.011, zz = 0.002, yz = 5e-4 }}
[[joint]]
name = "shoulder"
kind = "continuous"
parent = "base"
child = "upper"
axis = [0.3, 1.0, -0.2]
[[joint]]
name = "elbow"
kind = "continuous"
parent = "upper"
child = "lower"
origin = {{ xyz = [0.0, 0.1, 0.4], rpy_deg = [20, 35, -50] }}
axis = [1.0, 0.2, 0.4]
[[joint]]
name = "spin"
kind = "{joint}"
parent = "upper"
child = "rotor"
origin = {{ xyz = [0.05, -0.03, 0.1], rpy_deg = [-70, 15, 40] }}
axis = "z"
"#
    )
}

#[test]
fn a_rotor_on_a_moving_link_is_a_body_of_its_own_that_is_geared() {
    let ratio = 37.0;
    let drive = |rest: &str| {
        format!(
            "[[drive]]\njoint = \"elbow\"\nratio = {ratio:?}\nmotor = {{ torque_constant = 0.1, resistance = 1.5, \
             rotor_inertia = 2e-4 }}\n{rest}"
        )
    };
    let turning = "rotor = { link = \"rotor\", axis = [0, 0, 1] }\n";
    let options = ModelOptions::default();
    let welded = Source::new("welded.toml", arm_with_rotor("fixed").replace("axis = \"z\"\n", ""));
    let driven = Driven::new(&welded, &options, &drive(turning));
    let free = Driven::new(&Source::new("free.toml", arm_with_rotor("continuous")), &options, "");
    let order: Vec<&str> = free.robot.model.bodies.iter().map(|b| b.joint.name.as_str()).collect();
    let place = |name: &str| order.iter().position(|n| *n == name).expect("a joint");
    let mut random = Random(7);
    for _ in 0..20 {
        let (q, qd, theta) = (wide(&random.list(2, 3.0)), wide(&random.list(2, 3.0)), random.between(-3.0, 3.0));
        let n = Dd::from(ratio);
        let back_emf = n * n * Dd::from(0.1) * Dd::from(0.1) / Dd::from(1.5);
        let mut whole = [vec![Dd::ZERO; 3], vec![Dd::ZERO; 3]];
        for (values, (own, spin)) in whole.iter_mut().zip([(&q, Dd::from(theta)), (&qd, n * qd[1])]) {
            (values[place("shoulder")], values[place("elbow")], values[place("spin")]) = (own[0], own[1], spin);
        }
        let h = &blocks(&free.program(Function::MassMatrix), &[("q", &whole[0])])[0];
        let bias = &blocks(&free.program(Function::BiasForce), &[("q", &whole[0]), ("qd", &whole[1])])[0];
        // q = P (q1, q2), θ = N q2
        let mut p = DMatrix::from_element(3, 2, Dd::ZERO);
        (p[(place("shoulder"), 0)], p[(place("elbow"), 1)], p[(place("spin"), 1)]) = (Dd::ONE, Dd::ONE, n);
        let h_star = p.transpose() * DMatrix::from_row_slice(3, 3, h) * &p;
        let mut h_bias = p.transpose() * vector(bias);
        h_bias[1] += back_emf * qd[1];
        let x = vec![Dd::ZERO; 2];
        let model = driven.run(CompleteModel, &[("q", &q), ("qd", &qd), ("x", &x)]);
        assert!(distance(&model[0], h_star.transpose().as_slice()) < 1e-28, "{:?}\n{h_star:?}", model[0]);
        assert!(distance(&model[1], h_bias.as_slice()) < 1e-28, "{:?}\n{h_bias:?}", model[1]);
        // and it matters
        let without =
            Driven::new(&welded, &options, &drive("")).run(CompleteModel, &[("q", &q), ("qd", &qd), ("x", &x)]);
        assert!(distance(&model[0], &without[0]) > 1e-3);
        // the motion under a voltage comes back as that voltage
        let u = wide(&[random.between(-20.0, 20.0)]);
        let motion = driven.run(DrivenForwardDynamics, &[("q", &q), ("qd", &qd), ("x", &x), ("u", &u)]);
        let forces: Vec<Dd> = (0..2)
            .map(|i| (0..2).fold(model[1][i], |sum, j| sum + model[0][2 * i + j] * motion[0][j]) - model[2][i] * u[0])
            .collect();
        assert!(distance(&[Dd::ONE, forces[0] + Dd::ONE, forces[1] + Dd::ONE], &[Dd::ONE; 3]) < 1e-26);
    }
}

/// An arm with everything that a joint can have, and an oblique third axis.
const ARM: &str = r#"
[robot]
name = "arm"
[[link]]
name = "base"
[[link]]
name = "upper"
mass = 2.5
com = [0.02, 0.01, 0.2]
inertia = { xx = 0.02, yy = 0.021, zz = 0.004, xy = 0.001 }
[[link]]
name = "lower"
mass = 1.5
com = [0.01, 0.02, 0.1]
inertia = { xx = 0.01, yy = 0.011, zz = 0.002, yz = 5e-4 }
[[link]]
name = "hand"
mass = 0.5
com = [0.01, 0.0, 0.05]
inertia = { xx = 0.002, yy = 0.003, zz = 0.002, xz = 2e-4 }
[[joint]]
name = "shoulder"
kind = "continuous"
parent = "base"
child = "upper"
axis = "y"
damping = 0.3
friction = 0.8
[[joint]]
name = "elbow"
kind = "continuous"
parent = "upper"
child = "lower"
origin = { xyz = [0.0, 0.1, 0.4], rpy_deg = [20, 35, -50] }
axis = "x"
spring = { stiffness = 3.0, rest = 0.2 }
[[joint]]
name = "wrist"
kind = "continuous"
parent = "lower"
child = "hand"
origin = { xyz = [0.0, 0.0, 0.3] }
axis = [1.0, 0.4, 0.2]
damping = 0.05
"#;

/// Rigid with losses, inductance and a rotor in space; elastic in two stages with losses; a differential between both.
const EVERYTHING: &str = r#"
[[drive]]
joint = "shoulder"
ratio = 80.0
motor = { torque_constant = 0.1, resistance = 1.1, inductance = 2e-3, rotor_inertia = 8e-5, friction = 1e-4 }
efficiency = { forward = 0.8, backward = 0.7 }
rotor = { link = "upper", axis = [1.0, 0.0, 2.0] }
[[drive]]
name = "left"
joints = { elbow = 40.0, wrist = 30.0 }
motor = { torque_constant = 0.05, resistance = 0.7, rotor_inertia = 3e-5, friction = 2e-5 }
efficiency = 0.85
[[drive]]
name = "right"
joints = { elbow = 1.1, wrist = -0.9 }
motor = { torque_constant = 0.06, resistance = 0.9, inductance = 1e-3, rotor_inertia = 2e-5 }
stages = [
    { ratio = 3.0, stiffness = 40.0, damping = 0.05, input_inertia = 1e-6, output_inertia = 2e-5, efficiency = 0.9 },
    { ratio = 20.0, stiffness = 900.0, input_inertia = 1e-5, efficiency = { forward = 0.8, backward = 0.6 } },
    { ratio = 1.5, input_inertia = 2e-3, output_inertia = 3e-3 },
]
"#;

/// At a state: q, q̇, x, u of the arm with everything.
fn state(random: &mut Random) -> [Vec<Dd>; 4] {
    let (q, qd) = (random.list(3, 2.0), random.list(3, 2.0));
    let mut x = random.list(3 + 2 + 3 + 2, 2.0);
    let last = 1.5 * (1.1 * q[1] - 0.9 * q[2]);
    (x[8], x[5]) = (20.0 * (last + random.between(-0.1, 0.1)), 60.0 * (last + random.between(-0.2, 0.2)));
    [wide(&q), wide(&qd), wide(&x), wide(&random.list(3, 24.0))]
}

#[test]
fn electrical_power_goes_into_heat_friction_gears_dampers_and_energy() {
    let source = Source::new("arm.toml", ARM);
    let only = |keys: [bool; 2]| {
        format!("[effects]\ntransmission_losses = {}\nelastic_transmissions = {}\n{EVERYTHING}", keys[0], keys[1])
    };
    let limited = EVERYTHING.replace("[[drive]]", "[[drive]]\nlimits = { input = 9.0, current = 6.0 }");
    for scene in [EVERYTHING.to_string(), limited, only([false, true]), only([true, false])] {
        let driven = Driven::new(&source, &ModelOptions::default(), &scene);
        let is_elastic = driven.robot.model.drives.iter().any(|d| !d.stages.is_empty());
        let (of_drives, of_bodies) = (driven.program(DriveEnergy), driven.program(Function::Energy));
        let mut random = Random(11);
        for _ in 0..50 {
            let [q, qd, mut x, u] = state(&mut random);
            if !is_elastic {
                x.truncate(8);
            }
            let at: &[(&str, &[Dd])] = &[("q", &q), ("qd", &qd), ("x", &x), ("u", &u)];
            let motion = driven.run(DrivenForwardDynamics, at);
            let power = &driven.run(DrivePower, at)[0];
            // energies along q + q̇ t, q̇ + q̈ t, x + ẋ t
            let along = |x: &[Dd], rate: &[Dd]| -> Vec<Taylor<Dd, 2>> {
                x.iter().zip(rate).map(|(x, r)| Taylor::from_derivatives([*x, *r])).collect()
            };
            let (q, qd, x) = (along(&q, &qd), along(&qd, &motion[0]), along(&x, &motion[1]));
            let inputs: &[(&str, &[Taylor<Dd, 2>])] = &[("q", &q), ("qd", &qd), ("x", &x)];
            let energies = [blocks(&of_drives, inputs).concat(), blocks(&of_bodies, inputs).concat()].concat();
            let rate = energies.iter().fold(Dd::ZERO, |sum, e| sum + e.coefficients[1]);
            let spent = power[1..].iter().fold(rate, |sum, p| sum + *p);
            let size: f64 = energies.iter().map(|e| e.coefficients[1].to_f64().abs()).sum();
            let size = size + power.iter().map(|p| p.to_f64().abs()).sum::<f64>();
            let error = (power[0] - spent).to_f64().abs() / size;
            assert!(error < 1e-24, "{error:e} of {size} W: {power:?}\n{scene}");
            assert!(power[1..6].iter().all(|p| p.to_f64() >= -1e-20), "losses are losses: {power:?}");
        }
    }
}

#[test]
fn at_zero_power_a_gear_loses_nothing() {
    let drive =
        "[[drive]]\njoint = \"elbow\"\nratio = 50.0\nmotor = { torque_constant = 0.1, resistance = 1.0, rotor_inertia \
                 = 1e-5 }\n";
    let options = ModelOptions::default();
    let source = Source::new("arm.toml", ARM);
    let (ideal, lossy) = (
        Driven::new(&source, &options, drive),
        Driven::new(&source, &options, &format!("{drive}efficiency = {{ forward = 0.7, backward = 0.4 }}\n")),
    );
    let (q, u) = ([0.3, -0.4, 0.5], [6.0]);
    let at = |qd: &[f64; 3], driven: &Driven| {
        driven.run::<f64>(DriveTorques, &[("q", &q), ("qd", qd), ("x", &[0.0; 2]), ("u", &u)])[0][1]
    };
    let rest = [0.5, 0.0, 0.1];
    assert_eq!(at(&rest, &ideal), at(&rest, &lossy));
    for speed in [1e-3, -1e-3] {
        let qd = [0.5, speed, 0.1];
        assert!((at(&qd, &ideal) - at(&qd, &lossy)).abs() > 1.0);
    }
}

/// A path of the arm's joints as series.
fn path<const N: usize>(random: &mut Random) -> Vec<Taylor<Dd, N>> {
    (0..3).map(|_| Taylor::new(std::array::from_fn(|_| Dd::from(random.between(-1.0, 1.0))))).collect()
}

#[test]
fn voltages_for_a_motion_make_that_motion() {
    // an inductance behind a gear with losses; an undamped stage with inductance; two stages, one damped
    let drives = r#"
[[drive]]
joint = "shoulder"
ratio = 80.0
motor = { torque_constant = 0.1, resistance = 1.1, inductance = 2e-3, rotor_inertia = 8e-5, friction = 1e-4 }
efficiency = { forward = 0.8, backward = 0.7 }
rotor = { link = "upper", axis = [1.0, 0.0, 2.0] }
[[drive]]
joint = "elbow"
motor = { torque_constant = 0.05, resistance = 0.7, inductance = 1e-3, rotor_inertia = 3e-5, friction = 2e-5 }
stages = [{ ratio = 50.0, stiffness = 800.0, input_inertia = 1e-6, output_inertia = 2e-3, efficiency = 0.85 }]
[[drive]]
joint = "wrist"
motor = { torque_constant = 0.05, resistance = 0.7, rotor_inertia = 3e-5 }
stages = [{ ratio = -30.0, stiffness = 500.0, damping = 2.0, input_inertia = 1e-6, output_inertia = 2e-3 }]
"#;
    let source = Source::new("arm.toml", ARM);
    let driven = Driven::new(&source, &ModelOptions::default(), drives);
    let inverse = driven.program(DrivenInverseDynamics);
    let forces = driven.program(Function::InverseDynamics);
    let names: Vec<&str> = inverse.inputs.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["q", "qd", "qdd", "q3", "q4", "q5", "x"]);
    let mut random = Random(23);
    for _ in 0..20 {
        let q = path::<8>(&mut random);
        let rates: Vec<Vec<Taylor<Dd, 8>>> =
            std::iter::successors(Some(q), |q| Some(q.iter().map(Taylor::derivative).collect::<Vec<_>>()))
                .take(6)
                .collect();
        let tau = &blocks(&forces, &[("q", &rates[0]), ("qd", &rates[1]), ("qdd", &rates[2])])[0];
        // the elbow's motor by hand: θ = n (q + τ/c), M = τ/(n η) or τ η/n, i from (20.62), u from (20.63)
        let constant = |x: f64| Taylor::<Dd, 8>::constant(Dd::from(x));
        let theta = constant(50.0) * (rates[0][1] + tau[1] / constant(800.0));
        let theta_dot = theta.derivative();
        let drives_ahead = (tau[1] * theta_dot).coefficients[0].to_f64() > 0.0;
        let eta = constant(0.85);
        let taken = if drives_ahead { tau[1] / constant(50.0) / eta } else { tau[1] / constant(50.0) * eta };
        let gears = constant(1e-6) + constant(2e-3) / (constant(50.0) * constant(50.0));
        let current =
            (taken + (constant(3e-5) + gears) * theta_dot.derivative() + constant(2e-5) * theta_dot) / constant(0.05);
        let u_elbow = constant(0.7) * current + constant(1e-3) * current.derivative() + constant(0.05) * theta_dot;
        // the wrist's stretch is free
        let now = |x: &Taylor<Dd, 8>| x.coefficients[0];
        let theta_wrist = (now(&rates[0][2]) + Dd::from(0.003)) * Dd::from(-30.0);
        let mut x = vec![Dd::ZERO; 8];
        (x[3], x[6]) = (now(&theta), theta_wrist);
        let derivatives: Vec<Vec<Dd>> = rates.iter().map(|r| r.iter().map(now).collect()).collect();
        let mut inputs: Vec<(&str, &[Dd])> =
            ["q", "qd", "qdd", "q3", "q4", "q5"].into_iter().zip(derivatives.iter().map(Vec::as_slice)).collect();
        let given = x.clone();
        inputs.push(("x", &given));
        let answer = blocks(&inverse, &inputs);
        let error = ((answer[0][1] - now(&u_elbow)) / now(&u_elbow)).to_f64().abs();
        assert!(error < 1e-25, "{error:e}");
        // the state of the motion: i of the shoulder from its M, θ̇ of the wrist from its spring
        let n = Dd::from(80.0);
        let (speed, acceleration) = (n * derivatives[1][0], n * derivatives[2][0]);
        x[2] = (answer[1][0] + Dd::from(8e-5) * acceleration + Dd::from(1e-4) * speed) / Dd::from(0.1);
        (x[4], x[5]) = (now(&theta_dot), now(&current));
        let stretch = theta_wrist / Dd::from(-30.0) - derivatives[0][2];
        x[7] = Dd::from(-30.0) * (derivatives[1][2] + (now(&tau[2]) - Dd::from(500.0) * stretch) / Dd::from(2.0));
        let motion = driven.run(
            DrivenForwardDynamics,
            &[("q", &derivatives[0]), ("qd", &derivatives[1]), ("x", &x), ("u", &answer[0])],
        );
        assert!(distance(&motion[0], &derivatives[2]) < 1e-23, "{:?} {:?}", motion[0], derivatives[2]);
        let expected = [now(&theta_dot.derivative()), now(&current.derivative())];
        assert!(distance(&motion[1][4..6], &expected) < 1e-22, "{:?} {expected:?}", &motion[1][4..6]);
    }
}

/// Operations of two functions.
fn flops(driven: &Driven, function: Function) -> usize {
    driven.program(function).counts().flops()
}

#[test]
fn drives_cost_little_beside_forward_dynamics() {
    for robot in ["puma560", "panda"] {
        let source = source(robot);
        let plain = Driven { is_chosen: true, ..Driven::new(&source, &ModelOptions::default(), "") };
        let joints: Vec<&str> = plain.robot.model.bodies.iter().map(|b| b.joint.name.as_str()).collect();
        let all = |rest: &str| -> String {
            let drive = |joint: &&str| {
                format!(
                    "[[drive]]\njoint = \"{joint}\"\nmotor = {{ torque_constant = 0.06, resistance = 0.9, rotor_inertia = 2e-5, \
                     friction = 1e-5 }}\n{rest}\n"
                )
            };
            joints.iter().map(drive).collect()
        };
        let elastic = "stages = [{ ratio = 100.0, stiffness = 1e4, damping = 3.0, input_inertia = 1e-6 }]";
        let alone = flops(&plain, Function::ForwardDynamics);
        for (what, scene, most) in [("rigid", all("ratio = 100.0"), 115), ("elastic", all(elastic), 125)] {
            let driven = Driven { is_chosen: true, ..Driven::new(&source, &ModelOptions::default(), &scene) };
            let with = flops(&driven, DrivenForwardDynamics);
            println!("{robot}, {what}: {alone} -> {with}, {:+.1} %", 100.0 * (with as f64 / alone as f64 - 1.0));
            assert!(with * 100 <= alone * most, "{robot}, {what}: {alone} -> {with}");
        }
    }
}

/// The state (q, q̇, x) of a robot and its rate, with the powers, by generated programs in f64.
struct Simulated {
    forward: Graph,
    power: Graph,
    energies: [Graph; 2],
    n: usize,
}

impl Simulated {
    fn new(driven: &Driven) -> Simulated {
        Simulated {
            forward: driven.program(DrivenForwardDynamics),
            power: driven.program(DrivePower),
            energies: [driven.program(DriveEnergy), driven.program(Function::Energy)],
            n: driven.robot.model.nv(),
        }
    }

    fn split<'a>(&self, y: &'a [f64]) -> [(&'static str, &'a [f64]); 3] {
        let (q, rest) = y.split_at(self.n);
        let (qd, x) = rest.split_at(self.n);
        [("q", q), ("qd", qd), ("x", x)]
    }

    fn rate(&self, y: &[f64], u: &[f64]) -> Vec<f64> {
        let [q, qd, x] = self.split(y);
        let motion = blocks(&self.forward, &[q, qd, x, ("u", u)]);
        [qd.1, &motion[0], &motion[1]].concat()
    }

    fn powers(&self, y: &[f64], u: &[f64]) -> Vec<f64> {
        let [q, qd, x] = self.split(y);
        blocks(&self.power, &[q, qd, x, ("u", u)]).concat()
    }

    fn energy(&self, y: &[f64]) -> f64 {
        let at = self.split(y);
        self.energies.iter().flat_map(|graph| blocks(graph, &at).concat()).sum()
    }

    /// Runge and Kutta's fourth order; the powers are integrated by the same stages. What the input brought, and what is not
    /// accounted for.
    fn balance(&self, mut y: Vec<f64>, voltage: impl Fn(f64) -> Vec<f64>, (steps, h): (usize, f64)) -> (f64, f64) {
        let plus = |y: &[f64], k: &[f64], h: f64| y.iter().zip(k).map(|(y, k)| y + h * k).collect::<Vec<f64>>();
        let (before, mut work, mut traffic) = (self.energy(&y), vec![0.0; 7], 0.0);
        for i in 0..steps {
            let t = i as f64 * h;
            let (mut stage, mut total, mut powers) = (y.clone(), vec![0.0; y.len()], vec![0.0; 7]);
            for (part, next, weight) in [(0.0, 0.5, 1.0), (0.5, 0.5, 2.0), (0.5, 1.0, 2.0), (1.0, 0.0, 1.0)] {
                let u = voltage(t + part * h);
                let k = self.rate(&stage, &u);
                powers = plus(&powers, &self.powers(&stage, &u), weight / 6.0);
                total = plus(&total, &k, weight / 6.0);
                stage = plus(&y, &k, next * h);
            }
            y = plus(&y, &total, h);
            work = plus(&work, &powers, h);
            traffic += powers[0].abs() * h;
        }
        let rest = work[0] - work[1..].iter().sum::<f64>() - (self.energy(&y) - before);
        assert!(rest.is_finite());
        (traffic, rest)
    }
}

/// Rigid and elastic drives without what switches, so that the order of the integrator holds.
const SMOOTH: &str = "[effects]\ncoulomb = \"smooth\"\ncoulomb_speed = 0.5\ntransmission_losses = false\n";

fn voltages(t: f64) -> Vec<f64> {
    vec![8.0 * (2.0 * t).sin(), 4.0 * (3.0 * t).cos(), 5.0 * (1.3 * t).sin()]
}

/// A start without stretched springs.
fn at_ease(q: [f64; 3]) -> Vec<f64> {
    let last = 1.5 * (1.1 * q[1] - 0.9 * q[2]);
    let mut y = q.to_vec();
    y.extend([0.0; 3]);
    y.extend([0.0; 5]);
    y.extend([60.0 * last, 0.0, 0.0, 20.0 * last, 0.0]);
    y
}

/// The energy balance of the arm with every effect, in so many steps of so many seconds.
fn balance_closes(steps: (usize, f64)) {
    let source = Source::new("arm.toml", ARM);
    let driven = Driven::new(&source, &ModelOptions::default(), &format!("{SMOOTH}{EVERYTHING}"));
    let (brought, rest) = Simulated::new(&driven).balance(at_ease([0.3, -0.4, 0.5]), voltages, steps);
    println!("{brought:.3} J, not accounted for {rest:.2e} J");
    assert!(rest.abs() <= 1e-9 * brought, "{rest:e} of {brought}");
}

#[test]
fn the_energy_balance_closes_over_a_simulation() {
    balance_closes((2500, 2e-4));
}

/// Ten seconds; with losses, whose switching takes an integrator that sees it, in the simulation's own tests: `cargo test --release -p
/// straightline-generated-tests --test suite ten_seconds -- --ignored --nocapture`.
#[test]
#[ignore = "half a minute"]
fn the_energy_balance_closes_over_ten_seconds() {
    balance_closes((100_000, 1e-4));
}

#[test]
fn stiff_drives_integrate_in_sensible_steps() {
    // c = 1e6 N·m/rad; L/R = 1e-5 s
    let drives = r#"
[[drive]]
joint = "shoulder"
ratio = 100.0
motor = { torque_constant = 0.1, resistance = 1.0, inductance = 1e-5, rotor_inertia = 8e-5 }
efficiency = { forward = 0.8, backward = 0.7 }
[[drive]]
joint = "elbow"
motor = { torque_constant = 0.1, resistance = 1.0, inductance = 1e-5, rotor_inertia = 8e-5 }
stages = [{ ratio = 80.0, stiffness = 1e6, damping = 50.0, input_inertia = 1e-6 }]
[[drive]]
joint = "wrist"
motor = { torque_constant = 0.1, resistance = 1.0, rotor_inertia = 8e-5 }
stages = [{ ratio = 60.0, stiffness = 1e6, input_inertia = 1e-6 }]
"#;
    let source = Source::new("arm.toml", ARM);
    let driven = Driven::new(&source, &ModelOptions::default(), drives);
    let robot = Simulated::new(&driven);
    let q = [0.3, -0.4, 0.5];
    let start = [&q[..], &[0.0; 3], &[0.0; 3], &[80.0 * q[1], 0.0, 0.0], &[60.0 * q[2], 0.0]].concat();
    // implicit Euler, Newton's method with differences: (1 − h J) Δ = y₀ + h f(y) − y
    let arrive = |steps: usize| -> Vec<f64> {
        let (h, mut y) = (0.1 / steps as f64, start.clone());
        for i in 0..steps {
            let u = voltages((i + 1) as f64 * h);
            let before = y.clone();
            for _ in 0..6 {
                let f = robot.rate(&y, &u);
                let column = |j: usize| {
                    let mut near = y.clone();
                    let d = 1e-7 * y[j].abs().max(1e-3);
                    near[j] += d;
                    robot.rate(&near, &u).into_iter().zip(&f).map(|(a, b)| (a - b) / d).collect::<Vec<f64>>()
                };
                let columns: Vec<Vec<f64>> = (0..y.len()).map(column).collect();
                let matrix = DMatrix::from_fn(y.len(), y.len(), |i, j| f64::from(i == j) - h * columns[j][i]);
                let right = DVector::from_fn(y.len(), |i, _| before[i] + h * f[i] - y[i]);
                let step = matrix.lu().solve(&right).expect("a regular matrix");
                y.iter_mut().zip(step.iter()).for_each(|(y, s)| *y += s);
            }
            assert!(y.iter().all(|y| y.is_finite()), "step {i}: {y:?}");
        }
        y
    };
    let (coarse, fine) = (arrive(100), arrive(400));
    let moved = (0..3).map(|i| (fine[i] - q[i]).abs()).fold(0.0, f64::max);
    let apart = (0..3).map(|i| (fine[i] - coarse[i]).abs()).fold(0.0, f64::max);
    println!("moved {moved:.4} rad in 0.1 s; steps of 1 ms and 0.25 ms are {apart:.1e} rad apart");
    assert!(moved > 0.01 && apart < 0.1 * moved);
}

/// The functions of the drives as a program of its own: bits of the results for bits of the inputs, one line per function.
fn program_of(text: &str, functions: &[(Function, Graph)], inputs: &[(&str, &[f64])], scalar: Scalar) -> String {
    let (real, word) = match scalar {
        Scalar::F64 => ("f64", "u64"),
        Scalar::F32 => ("f32", "u32"),
    };
    let bits = |x: f64| match scalar {
        Scalar::F64 => x.to_bits().to_string(),
        Scalar::F32 => (x as f32).to_bits().to_string(),
    };
    let mut calls = String::new();
    for (function, graph) in functions {
        let named = |name: &str| inputs.iter().find(|(n, _)| *n == name).expect("an input").1;
        let arrays = graph.inputs.iter().map(|port| {
            let numbers: Vec<String> = named(&port.name).iter().map(|x| bits(*x)).collect();
            format!("&[{}].map({real}::from_bits)", numbers.join(", "))
        });
        let results = (0..graph.outputs.len()).map(|k| format!("&mut y{k}"));
        let arguments: Vec<String> = arrays.chain(results).collect();
        for (k, port) in graph.outputs.iter().enumerate() {
            let zero = port.shape.iter().rev().fold("0.0".to_string(), |inner, n| format!("[{inner}; {n}]"));
            let _ = writeln!(calls, "    let mut y{k} = {zero};");
        }
        let _ = writeln!(calls, "    robot::{}({});", function.name(), arguments.join(", "));
        let shown: String = (0..graph.outputs.len()).map(|k| format!("y{k}.show(); ")).collect();
        let _ = writeln!(calls, "    {shown}println!();");
    }
    format!(
        "mod robot {{\n{text}\n}}\ntrait Show {{ fn show(&self); }}\nimpl Show for {real} {{ fn show(&self) {{ \
         print!(\"{{}} \", self.to_bits() as {word}) }} }}\nimpl<T: Show, const N: usize> Show for [T; N] {{ fn show(&self) {{ \
         self.iter().for_each(Show::show) }} }}\nfn main() {{\n{calls}}}\n"
    )
}

#[test]
fn rustc_makes_of_drives_what_the_interpreter_and_the_runtime_say() {
    let source = Source::new("arm.toml", ARM);
    let limited = EVERYTHING.replace("[[drive]]", "[[drive]]\nlimits = { input = 9.0, current = 6.0 }");
    let model = Driven::new(&source, &ModelOptions::default(), &limited);
    let functions = [
        DrivenForwardDynamics,
        DrivenInverseDynamics,
        DriveTorques,
        CompleteModel,
        StateSpace,
        DrivePower,
        DriveEnergy,
    ];
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("driven");
    std::fs::create_dir_all(&folder).expect("a folder of the tests");
    for scalar in [Scalar::F64, Scalar::F32] {
        let options =
            Options { functions: functions.to_vec(), scene: model.scene.clone(), scalar, ..Options::default() };
        let generated = compile(&source, &options).unwrap_or_else(|d| panic!("{}", d.render()));
        let robot = Robot::new(generated.model.clone());
        let graphs = functions.map(|f| (f, program(&robot, &[], f, &options).graph));
        let mut random = Random(31);
        let rounded = |x: &[Dd]| x.iter().map(|x| f64::from(x.to_f64() as f32)).collect::<Vec<f64>>();
        let [q, qd, x, u] = state(&mut random).map(|x| rounded(&x));
        let rates: Vec<Vec<f64>> = (0..8).map(|_| rounded(&wide(&random.list(3, 2.0)))).collect();
        let names = ["qdd", "q3", "q4", "q5", "q6", "q7", "q8", "q9"];
        let mut inputs: Vec<(&str, &[f64])> = vec![("q", &q), ("qd", &qd), ("x", &x), ("u", &u)];
        inputs.extend(names.into_iter().zip(rates.iter().map(Vec::as_slice)));
        let (text, binary) = (folder.join(format!("{scalar:?}.rs")), folder.join(format!("{scalar:?}")));
        std::fs::write(&text, program_of(&generated.text, &graphs, &inputs, scalar)).expect("a file of the tests");
        let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_string());
        let flags = ["--edition", "2021", "-C", "opt-level=2", "-A", "warnings", "-o"];
        let built = Command::new(rustc).args(flags).args([&binary, &text]).output().expect("rustc runs");
        assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
        let said = Command::new(&binary).output().expect("the program runs");
        let said = String::from_utf8_lossy(&said.stdout).into_owned();
        assert_eq!(said.lines().count(), functions.len(), "{said}");
        for ((function, graph), line) in graphs.iter().zip(said.lines()) {
            let compiled: Vec<f64> = line
                .split_whitespace()
                .map(|bits| match scalar {
                    Scalar::F64 => f64::from_bits(bits.parse().expect("bits")),
                    Scalar::F32 => f64::from(f32::from_bits(bits.parse().expect("bits"))),
                })
                .collect();
            let interpreted: Vec<f64> = match scalar {
                Scalar::F64 => blocks::<f64>(graph, &inputs).concat(),
                Scalar::F32 => {
                    let single: Vec<(&str, Vec<f32>)> =
                        inputs.iter().map(|(n, x)| (*n, x.iter().map(|x| *x as f32).collect())).collect();
                    let single: Vec<(&str, &[f32])> = single.iter().map(|(n, x)| (*n, x.as_slice())).collect();
                    blocks::<f32>(graph, &single).concat().into_iter().map(f64::from).collect()
                }
            };
            assert_eq!(compiled, interpreted, "{function:?}, {scalar:?}");
            if *function != DrivenForwardDynamics {
                continue;
            }
            // the generic runtime, which knows nothing of reduced forms
            let plain: Model<f64> = generated.model.cast();
            let (h, bias) = (alg::mass_matrix(&plain, &q), alg::bias_force(&plain, &q, &qd));
            let motion = alg::driven_motion(&plain, (&q, &qd, &x, &u), &bias, &alg::Links::MassMatrix(&h));
            let bound = if scalar == Scalar::F64 { 1e-12 } else { 1e-3 };
            for (values, expected) in [(&compiled[..3], &motion.qdd), (&compiled[3..], &motion.xd)] {
                let size = expected.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                let error = values.iter().zip(expected).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
                assert!(error <= bound * size, "{scalar:?}: {error:e} of {size}");
            }
        }
    }
}

#[test]
fn verification_knows_drives() {
    verifies_drives([(false, Scalar::F64), (true, Scalar::F32)]);
}

#[test]
#[ignore = "slow proof: the same in the other numbers"]
fn slow_proof_that_verification_knows_drives() {
    verifies_drives([(false, Scalar::F32), (true, Scalar::F64)]);
}

/// With drives that have limits or none.
fn verifies_drives(cases: [(bool, Scalar); 2]) {
    let source = Source::new("arm.toml", ARM);
    // no rotor in space, for which the chapter has no equation
    let drives = EVERYTHING.replace("rotor = { link = \"upper\", axis = [1.0, 0.0, 2.0] }\n", "");
    let limited = drives.replace("[[drive]]", "[[drive]]\nlimits = { input = 9.0, current = 6.0 }");
    let options = |scene: &str, scalar: Scalar| Options {
        scene: Driven::new(&source, &ModelOptions::default(), scene).scene,
        scalar,
        ..Options::default()
    };
    for (has_limits, scalar) in cases {
        let options = options(if has_limits { &limited } else { &drives }, scalar);
        let generated = compile(&source, &options).unwrap_or_else(|d| panic!("{}", d.render()));
        let found = verify(&source, &generated, &options, (60, 5), || ()).expect("the reference reads the file");
        for name in ["driven_forward_dynamics", "drive_torques"] {
            println!("{scalar:?} {name}: {:e} in {}", found.functions[name].error, found.functions[name].output);
        }
        assert!(found.passes(), "{:?}", found.functions);
        assert_eq!(found.left_out.len(), 5, "{:?}", found.left_out);
    }
}
