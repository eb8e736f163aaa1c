//! Logs of motions that excite all joints, as tests make them, and the command that reads them.

use std::f64::consts::TAU;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use straightline_core::algorithms::inverse_dynamics;
use straightline_core::model::Model;

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

/// Columns of a table over time: t, and per joint q, qd, qdd, and the torques of a model.
pub fn logged(model: &Model<f64>, times: &[f64]) -> Vec<(String, Vec<f64>)> {
    let nv = model.nv();
    let mut columns = vec![Vec::with_capacity(times.len()); 4 * nv];
    for t in times {
        let states: Vec<[f64; 3]> = (0..nv).map(|k| motion(k, *t)).collect();
        let [q, qd, qdd] = [0, 1, 2].map(|n| states.iter().map(|s| s[n]).collect::<Vec<f64>>());
        let tau = inverse_dynamics(model, &q, &qd, &qdd);
        columns.iter_mut().zip([q, qd, qdd, tau].concat()).for_each(|(column, x)| column.push(x));
    }
    let joints: Vec<String> = model.joints().iter().map(|joint| joint.name.clone()).collect();
    let names = ["q", "qd", "qdd", "tau"].iter().flat_map(|p| joints.iter().map(move |j| format!("{p}.{j}")));
    std::iter::once(("t".to_string(), times.to_vec())).chain(names.zip(columns)).collect()
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
        let mut sum = -6.0;
        for _ in 0..12 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            sum += (self.0 >> 11) as f64 / (1u64 << 53) as f64;
        }
        sum
    }
}
