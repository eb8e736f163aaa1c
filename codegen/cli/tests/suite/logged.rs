//! Logs of motions that excite all joints, as tests make them, and the command that reads them.

use std::f64::consts::TAU;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use straightline_cli::log_states::{log_demand, named_rates, position_names, with_whole_states};
use straightline_core::algorithms::inverse_dynamics;
use straightline_core::model::{Joint, Model};
use straightline_core::random::Random;
use straightline_logs::align::{align, AlignedLog};
use straightline_logs::log::from_columns;

/// A file of these tests.
pub fn scratch(tests: &str, name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(tests);
    fs::create_dir_all(&folder).expect("a folder of the tests");
    folder.join(name)
}

/// The command with these arguments.
pub fn straightline(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_straightline")).args(arguments).output().expect("it starts")
}

/// A motion that excites all joints: position, velocity and acceleration of joint `k` at a time, three sines of its own.
pub fn motion(k: usize, t: f64) -> [f64; 3] {
    let middle = [0.1, -0.4, 0.2, -1.8, 0.1, 1.9, 0.6][k % 7];
    (0..3).fold([middle, 0.0, 0.0], |[q, qd, qdd], n| {
        let (size, w) = (0.42 / (n + 1) as f64, TAU * (0.11 + 0.07 * k as f64) * (0.6 + 0.55 * n as f64));
        let angle = w * t + (k * 3 + n) as f64;
        [q + size * angle.sin(), qd + size * w * angle.cos(), qdd - size * w * w * angle.sin()]
    })
}

/// The motion of a coordinate; where loops have to close a smaller one about where they did.
fn entry(model: &Model<f64>, k: usize, t: f64) -> [f64; 3] {
    let own = motion(k, t);
    match model.closure.is_empty() {
        true => own,
        false => {
            let joint = model.independent_joints().find(|joint| (joint.iv..joint.iv + joint.kind.nv()).contains(&k));
            let home = joint.filter(|joint| joint.kind.is_single()).map_or(0.0, |joint| model.neutral()[joint.iq]);
            [home + 0.2 * (own[0] - motion(k, 0.0)[0]), 0.2 * own[1], 0.2 * own[2]]
        }
    }
}

/// Coordinates and velocities of a joint at a time. One with several turns about its x, y and z axis one after the other, and moves along its parent's.
fn moved(model: &Model<f64>, joint: &Joint, t: f64) -> [Vec<f64>; 2] {
    let [of_q, of_qd] = [0, 1].map(|order| move |k: usize| entry(model, joint.iv + k, t)[order]);
    let count = joint.kind.nv();
    if joint.kind.is_single() {
        return [vec![of_q(0)], vec![of_qd(0)]];
    }
    let turns = [count - 3, count - 2, count - 1];
    let (angles, rates) = (turns.map(of_q), turns.map(of_qd));
    let [[sa, ca], [sb, cb], [sc, cc]] = angles.map(|x| [(x / 2.0).sin(), (x / 2.0).cos()]);
    let quaternion = [
        sa * cb * cc + ca * sb * sc,
        ca * sb * cc - sa * cb * sc,
        ca * cb * sc + sa * sb * cc,
        ca * cb * cc - sa * sb * sc,
    ];
    let [[_, _], [sb, cb], [sc, cc]] = angles.map(|x| [x.sin(), x.cos()]);
    let [a, b, c] = rates;
    let turning = [a * cb * cc + b * sc, -a * cb * sc + b * cc, a * sb + c];
    let place: Vec<f64> = (0..count - 3).map(of_q).collect();
    let along: Vec<f64> = (0..count - 3).map(of_qd).collect();
    // in its own axes: Rᵀ ṗ
    let [x, y, z, w] = quaternion;
    let inverse = [-x, -y, -z, w];
    let along = if along.is_empty() { along } else { turned(inverse, &along) };
    [[place, quaternion.to_vec()].concat(), [along, turning.to_vec()].concat()]
}

/// v + 2 r × (r × v + w v) of a quaternion with the vector r.
fn turned([x, y, z, w]: [f64; 4], v: &[f64]) -> Vec<f64> {
    let cross = |a: [f64; 3], b: [f64; 3]| {
        std::array::from_fn(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
    };
    let (r, v) = ([x, y, z], [v[0], v[1], v[2]]);
    let once: [f64; 3] = cross(r, v);
    let twice: [f64; 3] = cross(r, std::array::from_fn(|k| once[k] + w * v[k]));
    (0..3).map(|k| v[k] + 2.0 * twice[k]).collect()
}

/// Configuration and velocities at a time.
fn state(model: &Model<f64>, t: f64) -> [Vec<f64>; 2] {
    let (mut q, mut qd) = (model.neutral(), vec![0.0; model.nv()]);
    for joint in model.independent_joints() {
        let [own, rates] = moved(model, joint, t);
        q[joint.iq..][..own.len()].copy_from_slice(&own);
        qd[joint.iv..][..rates.len()].copy_from_slice(&rates);
    }
    match model.closure.is_empty() {
        true => [q, qd],
        false => [model.closed_from(q.clone(), &model.assembled(&q)).expect("loops close"), qd],
    }
}

/// The acceleration at a time, of velocities at eight times around it.
fn acceleration(model: &Model<f64>, t: f64) -> Vec<f64> {
    let h = 5e-3;
    let weights = [4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0];
    let mut sum = vec![0.0; model.nv()];
    for (k, weight) in weights.iter().enumerate() {
        let step = (k + 1) as f64 * h;
        let ends = [t + step, t - step]
            .map(|t| model.independent_joints().map(|j| moved(model, j, t)[1].clone()).collect::<Vec<_>>());
        for (joint, (after, before)) in model.independent_joints().zip(ends[0].iter().zip(&ends[1])) {
            for (n, (a, b)) in after.iter().zip(before).enumerate() {
                sum[joint.iv + n] += weight * (a - b) / h;
            }
        }
    }
    for joint in model.independent_joints().filter(|joint| joint.kind.is_single()) {
        sum[joint.iv] = entry(model, joint.iv, t)[2];
    }
    sum
}

/// Columns of a table over time: t, and per joint q, qd, qdd, and the torques of a model.
pub fn logged(model: &Model<f64>, times: &[f64]) -> Vec<(String, Vec<f64>)> {
    let mut columns = vec![Vec::with_capacity(times.len()); model.nq() + 3 * model.nv()];
    for t in times {
        let ([q, qd], qdd) = (state(model, *t), acceleration(model, *t));
        let tau = inverse_dynamics(model, &q, &qd, &qdd);
        columns.iter_mut().zip([q, qd, qdd, tau].concat()).for_each(|(column, x)| column.push(x));
    }
    let rates = named_rates(model);
    let velocities = || rates.iter().map(|rate| rate.velocity.clone());
    let named = |prefix: &str, names: &mut dyn Iterator<Item = String>| -> Vec<String> {
        names.map(|name| format!("{prefix}.{name}")).collect()
    };
    let names = [
        named("q", &mut position_names(model).into_iter()),
        named("qd", &mut velocities()),
        named("qdd", &mut velocities()),
        named("tau", &mut rates.iter().map(|rate| rate.effort.clone())),
    ];
    std::iter::once(("t".to_string(), times.to_vec())).chain(names.concat().into_iter().zip(columns)).collect()
}

/// The log of a table for a robot.
pub fn aligned(columns: Vec<(String, Vec<f64>)>, model: &Model<f64>) -> AlignedLog {
    let log = align(&from_columns(columns).expect("a log"), &log_demand(model)).expect("all joints are there");
    with_whole_states(model, log).expect("states are whole")
}

pub fn csv(columns: &[(String, Vec<f64>)]) -> String {
    let head = columns.iter().map(|c| c.0.clone()).collect::<Vec<_>>().join(",");
    let row = |i: usize| columns.iter().map(|c| format!("{:?}", c.1[i])).collect::<Vec<_>>().join(",");
    let rows: Vec<String> = (0..columns[0].1.len()).map(row).collect();
    format!("{head}\n{}\n", rows.join("\n"))
}

/// Normal numbers, by twelve uniform ones.
pub struct Normal(pub u64);

impl Normal {
    pub fn next(&mut self) -> f64 {
        let mut random = Random(self.0);
        let normal = (0..12).fold(-6.0, |sum, _| sum + random.unit());
        self.0 = random.0;
        normal
    }
}
