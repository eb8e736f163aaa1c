//! Many robots in one query.

use crate::helpers::session;
use datafusion::arrow::array::AsArray;
use datafusion::arrow::datatypes::Float64Type;
use std::time::Instant;
use straightline_fleet_testing::log::log;
use straightline_fleet_testing::query::rows;
use straightline_fleet_testing::robot_text;
use straightline_fleets::{programs_kept, register, RobotFolder};

/// Pages of this process that are in memory, in MB; none where the system does not say so.
fn resident() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    line.split_whitespace().nth(1)?.parse::<f64>().ok().map(|kilobytes| kilobytes / 1024.0)
}

#[test]
fn a_thousand_robots_are_in_one_query() {
    let folder = tempfile::tempdir().unwrap();
    let text = robot_text("panda.urdf");
    // the hand of each is another: kg, to four decimals
    let mass = |k: usize| format!("{:.4}", 0.7 + 0.0005 * k as f64);
    for k in 0..1000 {
        let own = text.replacen("<mass value=\"0.735522\"/>", &format!("<mass value=\"{}\"/>", mass(k)), 1);
        assert_ne!(own, text);
        std::fs::write(folder.path().join(format!("panda{k:04}.urdf")), own).unwrap();
    }
    let context = session(&log(7, 2000).table(), 2, 1000);
    register(&context, &RobotFolder::at(folder.path()));
    let torque = |k: usize| format!("gravity_force('panda{k:04}.urdf', q)['panda_joint4'] AS g{k}");
    let sql = format!("SELECT {} FROM logs WHERE id < 10", (0..1000).map(torque).collect::<Vec<_>>().join(", "));
    let (start, before) = (Instant::now(), resident());
    let found = rows(&context, &sql).unwrap();
    let (first, after) = (start.elapsed(), resident());
    let start = Instant::now();
    let again = rows(&context, &sql).unwrap();
    println!(
        "1000 robots: {:.2} s, again {:.2} s; {:?} MB before, {:?} after, {:?} at the end; {} programs",
        first.as_secs_f64(),
        start.elapsed().as_secs_f64(),
        before,
        after,
        resident(),
        programs_kept()
    );
    assert_eq!(found, again);
    let numbers: Vec<f64> =
        found.columns().iter().map(|column| column.as_primitive::<Float64Type>().value(0)).collect();
    // a heavier hand takes the more to hold, in equal steps
    let steps: Vec<f64> = numbers.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(steps.iter().all(|step| (step / steps[0] - 1.0).abs() < 1e-6 && *step != 0.0), "{:?}", &steps[..3]);
    assert!(programs_kept() <= 2048);
}
