//! MCAP files with joint states of ROS 2.

use super::common::{recorded, Sent};
use mcap::Compression;
use straightline_logs::align::align;
use straightline_logs::cdr::CdrReader;
use straightline_logs::demand::LogDemand;
use straightline_logs::joint_state::JointState;
use straightline_logs::log::{from_columns, JointLog, LogQuantity};
use straightline_logs::mcap as file;
use straightline_logs::odometry::{self, Odometry};
use straightline_logs::transforms::StampedTransform;

const MS: i64 = 1_000_000;

#[test]
fn joints_are_joined_by_name_whatever_their_order() {
    let start = 1_700_000_000 * 1000 * MS;
    let messages = [
        Sent("/a", start, &["elbow", "wrist"], [&[0.25, -1.5], &[0.5, 0.75], &[3.0, 4.0]]),
        Sent("/a", start + 2 * MS, &["wrist", "gripper", "elbow"], [&[-1.25, 9.0, 0.5], &[], &[5.0, 0.0, 6.0]]),
        Sent("/a", start + 4 * MS, &["elbow", "wrist"], [&[0.75, -1.0], &[0.0, 0.125], &[7.0, 8.0]]),
    ];
    for compression in [None, Some(Compression::Zstd), Some(Compression::Lz4)] {
        let log = file::read(&recorded(&messages, compression), None).expect("it can be read");
        assert_eq!(log.joints, ["elbow", "wrist", "gripper"]);
        assert_eq!(log.times, [0.0, 0.002, 0.004]);
        assert_eq!((log.start, log.reordered), (start, 2));
        assert_eq!(log.column(LogQuantity::Position, 0), [0.25, 0.5, 0.75]);
        assert_eq!(log.column(LogQuantity::Effort, 1), [4.0, 5.0, 8.0]);
        let velocity = log.column(LogQuantity::Velocity, 1);
        assert!(velocity[0] == 0.75 && velocity[1].is_nan() && velocity[2] == 0.125, "{velocity:?}");
        assert_eq!(log.others.iter().map(|t| (t.name.as_str(), t.messages)).collect::<Vec<_>>(), [("/remarks", 3)]);
        let aligned = align(&log, &LogDemand::of_joints(&["wrist", "elbow"])).expect("two rows are complete");
        assert_eq!(aligned.q, [[-1.5, -1.0], [0.25, 0.75]]);
        assert_eq!((aligned.report.incomplete, &aligned.report.unknown[..]), (1, &["gripper".to_string()][..]));
    }
}

#[test]
fn several_topics_with_joint_states_are_listed_until_one_is_named() {
    let messages =
        [Sent("/left", 5 * MS, &["a"], [&[1.0], &[], &[0.5]]), Sent("/right", 5 * MS, &["b"], [&[2.0], &[], &[0.25]])];
    let bytes = recorded(&messages, None);
    let error = file::read(&bytes, None).expect_err("there are two");
    assert!(
        error.what.contains("2 topics") && error.help.contains("/left") && error.help.contains("/right"),
        "{error:?}"
    );
    assert_eq!(file::read(&bytes, Some("/right")).expect("it is there").joints, ["b"]);
    let error = file::read(&bytes, Some("/middle")).expect_err("it is not there");
    assert!(error.what.contains("/middle") && error.help.contains("/right (sensor_msgs"), "{error:?}");
    let error = file::read(&bytes, Some("/remarks")).expect_err("these are no joint states");
    assert!(error.what.contains("/remarks"), "{error:?}");
}

#[test]
fn effort_that_is_absent_is_said_with_the_joint() {
    let bytes = recorded(&[Sent("/a", 5, &["shoulder", "elbow"], [&[1.0, 2.0], &[0.0, 0.0], &[]])], None);
    let log = file::read(&bytes, None).expect("it can be read");
    let error =
        align(&log, &LogDemand::of_joints(&["shoulder", "wrist"])).expect_err("there is no effort, and no wrist");
    let said = error.to_string();
    assert!(said.contains("no effort of joint `shoulder`") && said.contains("`wrist` is not in the log"), "{said}");
    assert!(error.help.contains("shoulder, elbow"), "{error:?}");
}

#[test]
fn duplicates_gaps_and_jumps_of_the_clock_are_reported_and_cut() {
    let stamps = [0, 1, 2, 2, 3, 4, 14, 15, 16, 9, 10, 11].map(|ms| (100 + ms) * MS);
    let messages: Vec<Sent> =
        stamps.iter().map(|stamp| Sent("/a", *stamp, &["hinge"], [&[0.5], &[0.25], &[1.5]])).collect();
    let log = file::read(&recorded(&messages, None), None).expect("it can be read");
    let found = align(&log, &LogDemand::of_joints(&["hinge"])).expect("rows are complete");
    assert_eq!(found.report.duplicates, 1);
    assert_eq!(found.report.gaps, [(0.004, 0.014)]);
    assert_eq!(found.report.jumps.len(), 1);
    assert!((found.report.jumps[0].0 - 0.016).abs() < 1e-12 && (found.report.jumps[0].1 - 0.007).abs() < 1e-12);
    assert_eq!(found.segments, [0..5, 5..8, 8..11]);
    assert_eq!((found.report.rows, found.report.kept), (12, 11));
}

#[test]
fn messages_without_a_stamp_have_the_time_of_the_log() {
    let messages = [0, 1].map(|_| Sent("/a", 0, &["hinge"], [&[0.5], &[], &[1.0]]));
    let log = file::read(&recorded(&messages, None), None).expect("it can be read");
    assert_eq!((log.unstamped, log.start), (2, 7_000));
    assert_eq!(log.times, [0.0, 1e-9]);
}

#[test]
fn big_ends_first_is_the_same_message() {
    // stamp 3 s and 4 ns, frame "", names [hinge], position [0.5], no velocity, effort [-2]
    let little = joint_state_bytes(u32::to_le_bytes, f64::to_le_bytes, [0, 1, 0, 0]);
    let big = joint_state_bytes(u32::to_be_bytes, f64::to_be_bytes, [0, 0, 0, 0]);
    for bytes in [little, big] {
        let mut message = JointState::default();
        message.read(&bytes).expect("a message");
        assert_eq!((message.stamp, &message.names[..]), (3_000_000_004, &["hinge"][..]));
        assert_eq!(
            (&message.position[..], &message.velocity[..], &message.effort[..]),
            (&[0.5][..], &[][..], &[-2.0][..])
        );
    }
}

/// The message of the test, written by hand from the rules of CDR.
fn joint_state_bytes(int: fn(u32) -> [u8; 4], double: fn(f64) -> [u8; 8], head: [u8; 4]) -> Vec<u8> {
    let mut bytes = head.to_vec();
    bytes.extend([3, 4, 1].map(int).concat()); // stamp; length of the frame's name
    bytes.extend([0, 0, 0, 0]); // its end, and what aligns
    bytes.extend([1, 6].map(int).concat());
    bytes.extend(b"hinge\0\0\0");
    bytes.extend(int(1)); // ends at 36 behind the head
    bytes.extend([0; 4]); // to a multiple of 8
    bytes.extend(double(0.5));
    bytes.extend([0, 1].map(int).concat());
    bytes.extend(double(-2.0));
    bytes
}

#[test]
fn lengths_beyond_the_message_are_errors_that_name_the_byte() {
    let mut bytes = joint_state_bytes(u32::to_le_bytes, f64::to_le_bytes, [0, 1, 0, 0]);
    bytes[36..40].copy_from_slice(&u32::MAX.to_le_bytes());
    let error = JointState::default().read(&bytes).expect_err("that many are not there");
    assert!(error.contains("at byte 44 of the message"), "{error}");
    assert!(CdrReader::new(&[0, 9, 0, 0]).expect_err("no plain CDR").contains("0x09"));
}

#[test]
fn what_was_written_is_read_to_the_last_bit() {
    let t: Vec<f64> = (0..300).map(|i| f64::from(i) * 0.004).collect();
    let column = |k: f64| t.iter().map(|t| (k * t + 0.1).sin() * 1e3_f64.powf(k - 2.0)).collect::<Vec<f64>>();
    let names = ["q.a", "q.b", "qd.a", "qd.b", "tau.a", "tau.b", "energy"];
    let mut columns = vec![("t".to_string(), t.clone())];
    columns.extend(names.iter().enumerate().map(|(k, name)| (name.to_string(), column(k as f64))));
    let log = from_columns(columns).expect("a log");
    let found = file::read(&file::bytes(&log, "/robot/joint_states").expect("it can be written"), None).expect("read");
    assert_eq!(log.others[0].name, "energy");
    assert!(found.times.iter().zip(&t).all(|(a, b)| (a - b).abs() < 1e-15), "stamps are of whole ns");
    assert_eq!(found, JointLog { times: found.times.clone(), others: Vec::new(), ..log });
}

#[test]
fn odometry_is_read_with_its_twist() {
    let (translation, rotation) = ([1.0, -2.0, 0.5], [0.0, 0.6, 0.0, 0.8]);
    let pose = StampedTransform { stamp: 1_500_000_000, parent: "odom", child: "base_link", translation, rotation };
    let message = Odometry { pose, twist: [0.1, 0.2, 0.3, -0.4, 0.5, -0.6] };
    let bytes = odometry::bytes(&message).expect("it has room");
    // header, child, pose, twist and two covariances: 4 + 8 + (4 + 5) + 3 + (4 + 10) + 6 + 8·(7 + 36 + 6 + 36)
    assert_eq!(bytes.len(), 4 + 8 + 9 + 3 + 14 + 6 + 8 * 85);
    assert_eq!(odometry::read(&bytes).expect("it is one"), message);
    for cut in [0, 3, 10, 40, bytes.len() - 1] {
        assert!(odometry::read(&bytes[..cut]).is_err(), "{cut} bytes");
    }
}
