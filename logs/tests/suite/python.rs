//! MCAP of ours beside a reader that is not: `mcap` and `mcap-ros2-support` of PyPI, where `python/environment` has put them.

use std::path::{Path, PathBuf};
use std::process::Command;
use straightline_logs::log::{from_columns, LogQuantity};
use straightline_logs::mcap::{self as file, LoggedFrames};

const READER: &str = r#"
import struct, sys
from mcap_ros2.reader import read_ros2_messages
for found in read_ros2_messages(sys.argv[1]):
    m = found.ros_msg
    if found.channel.topic == "/tf":
        for t in m.transforms:
            x, r, at = t.transform.translation, t.transform.rotation, t.header.stamp
            numbers = [x.x, x.y, x.z, r.x, r.y, r.z, r.w]
            print("/tf", at.sec * 10**9 + at.nanosec, t.header.frame_id, t.child_frame_id, *[struct.pack(">d", x).hex() for x in numbers])
        continue
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
    let frames = LoggedFrames {
        parent: "world".to_string(),
        children: vec!["tool 0".to_string(), "elbow".to_string()],
        poses: t.iter().map(|t| vec![([*t, 0.1 / t, -2.0], [0.0, t.sin(), 0.0, t.cos()]); 2]).collect(),
    };
    let bytes = file::bytes_with(&log, "/arm/joint_states", &frames).expect("written");
    std::fs::write(&path, &bytes).expect("written");
    // our own reader finds them, too
    let own = file::frame_poses(&bytes).expect("read");
    assert_eq!((own.len(), &own[3].child[..], own[3].translation[0]), (400, "elbow", t[1]));
    let output = Command::new(python).args(["-c", READER]).arg(&path).output().expect("it starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8(output.stdout).expect("text");
    let (poses, states): (Vec<&str>, Vec<&str>) = said.lines().partition(|line| line.starts_with("/tf "));
    assert_eq!((states.len(), poses.len()), (t.len(), 2 * t.len()));
    for (k, line) in poses.iter().enumerate() {
        let (translation, rotation) = frames.poses[k / 2][k % 2];
        let numbers: Vec<String> =
            translation.iter().chain(&rotation).map(|x| format!("{:016x}", x.to_bits())).collect();
        let stamp = 3_000_000_000 + 2_000_000 * (k / 2) as i64;
        assert_eq!(*line, format!("/tf {stamp} world {} {}", frames.children[k % 2], numbers.join(" ")));
    }
    for (i, line) in states.into_iter().enumerate() {
        let stamp = 3_000_000_000 + 2_000_000 * i as i64;
        let numbers = [LogQuantity::Position, LogQuantity::Velocity, LogQuantity::Effort]
            .into_iter()
            .flat_map(|quantity| [0, 1].map(|joint| log.column(quantity, joint)[i]));
        let numbers: Vec<String> = numbers.map(|x| format!("{:016x}", x.to_bits())).collect();
        assert_eq!(line, format!("/arm/joint_states {stamp} {stamp} hip joint,knee {}", numbers.join(" ")));
    }
}
