//! MCAP of ours beside a reader that is not: `mcap` and `mcap-ros2-support` of PyPI, where `python/environment` has put them.

use std::path::{Path, PathBuf};
use std::process::Command;
use straightline_logs::log::{from_columns, LogQuantity};
use straightline_logs::mcap as file;

const READER: &str = r#"
import struct, sys
from mcap_ros2.reader import read_ros2_messages
for found in read_ros2_messages(sys.argv[1]):
    m = found.ros_msg
    stamp = m.header.stamp.sec * 10**9 + m.header.stamp.nanosec
    numbers = [*m.position, *m.velocity, *m.effort]
    print(found.channel.topic, found.log_time_ns, stamp, ",".join(m.name), *[struct.pack(">d", x).hex() for x in numbers])
"#;

/// A Python with the reader.
fn python() -> Option<PathBuf> {
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent()?;
    let given = std::env::var_os("PYTHON").map(PathBuf::from);
    let candidates = [given, Some(target.join("python/bin/python")), Some(PathBuf::from("python3"))];
    let has_it = |python: &PathBuf| {
        Command::new(python).args(["-c", "import mcap_ros2.reader"]).output().is_ok_and(|o| o.status.success())
    };
    candidates.into_iter().flatten().find(has_it)
}

#[test]
fn another_reader_finds_the_same_numbers() {
    let Some(python) = python() else {
        println!("skipped: no Python with mcap-ros2-support (python/environment)");
        return;
    };
    let t: Vec<f64> = (0..200).map(|i| 3.0 + f64::from(i) * 0.002).collect();
    let column = |k: f64| t.iter().map(|t| (k * t + 0.3).cos() / (k + 0.1)).collect::<Vec<f64>>();
    let names = ["q.hip joint", "q.knee", "qd.hip joint", "qd.knee", "tau.hip joint", "tau.knee"];
    let mut columns = vec![("t".to_string(), t.clone())];
    columns.extend(names.iter().enumerate().map(|(k, name)| (name.to_string(), column(k as f64))));
    let log = from_columns(columns).expect("a log");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    std::fs::write(&path, file::bytes(&log, "/arm/joint_states").expect("written")).expect("written");
    let output = Command::new(python).args(["-c", READER]).arg(&path).output().expect("it starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8(output.stdout).expect("text");
    assert_eq!(said.lines().count(), t.len());
    for (i, line) in said.lines().enumerate() {
        let stamp = 3_000_000_000 + 2_000_000 * i as i64;
        let numbers = [LogQuantity::Position, LogQuantity::Velocity, LogQuantity::Effort]
            .into_iter()
            .flat_map(|quantity| [0, 1].map(|joint| log.column(quantity, joint)[i]));
        let numbers: Vec<String> = numbers.map(|x| format!("{:016x}", x.to_bits())).collect();
        assert_eq!(line, format!("/arm/joint_states {stamp} {stamp} hip joint,knee {}", numbers.join(" ")));
    }
}
