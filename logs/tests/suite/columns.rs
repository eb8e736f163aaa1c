//! Tables as logs.

use straightline_logs::align::align;
use straightline_logs::csv::read;
use straightline_logs::demand::LogDemand;
use straightline_logs::log::LogQuantity;
use straightline_logs::threads::in_threads;

#[test]
fn a_table_with_missing_numbers_is_a_log_that_says_so() {
    let text = "# a remark\nt, q.a, qd.a, effort.a, qdd.a, current\n0.5,1,2,3,4,9\n0.6,1.5,,3.5,,9\n0.7,2,2.5,nan,4,9\n0.8,2,2,3,4,9\n";
    let log = read(text.as_bytes()).expect("a log");
    assert_eq!((&log.joints[..], log.others[0].name.as_str()), (&["a".to_string()][..], "current"));
    let found = align(&log, &LogDemand::of_joints(&["a"])).expect("two rows are complete");
    assert_eq!((found.report.incomplete, &found.times[..]), (2, &[0.5, 0.8][..]));
    assert_eq!(found.qdd.expect("it has accelerations"), [[4.0, 4.0]]);
}

/// As spreadsheets and people write them.
#[test]
fn spaces_and_quotation_marks_about_numbers_are_none_of_them() {
    let log = read(b" t , q.a\n\t0.5 ,\"1\" \n0.6,\"2.5 \"\r\n 0.7 ,\t\n").expect("a log");
    assert_eq!((&log.times[..], &log.joints[..]), (&[0.5, 0.6, 0.7][..], &["a".to_string()][..]));
    let q = log.column(LogQuantity::Position, 0);
    assert!(q[..2] == [1.0, 2.5] && q[2].is_nan(), "{q:?}");
}

#[test]
fn seconds_since_the_epoch_keep_their_nanoseconds() {
    let log = read(b"t,q.a,tau.a\n1700000000.999999999,0,0\n1700000001.000000001,0,0\n").expect("a log");
    assert!((log.times[1] - log.times[0] - 2e-9).abs() < 1e-15, "{:?}", log.times);
    assert_eq!(log.start, 1_700_000_000 * 1_000_000_000);
}

#[test]
fn velocities_that_are_missing_are_differences_of_positions() {
    let rows: String = (0..20).map(|i| format!("{},{},0\n", 0.1 * f64::from(i), 0.01 * f64::from(i * i))).collect();
    let log = read(format!("t,q.a,tau.a\n{rows}").as_bytes()).expect("a log");
    let found = align(&log, &LogDemand::of_joints(&["a"])).expect("a log");
    assert_eq!(found.report.without_velocity, ["a"]);
    // of a parabola q = t² they are exact
    assert!(found.times.iter().zip(&found.qd[0]).all(|(t, qd)| (qd - 2.0 * t).abs() < 1e-12), "{:?}", found.qd);
    assert!(log.column(LogQuantity::Velocity, 0).is_empty());
}

#[test]
fn all_fields_that_are_no_numbers_are_told_with_their_lines() {
    let error = read(b"t,q.a\n0,1\n0.1,x\n0.2,1;5\n").expect_err("two are none");
    assert!(error.what.contains("line 3: `x` in column `q.a`") && error.what.contains("line 4: `1;5`"), "{error}");
    for (text, words) in [
        ("t,q.a\n0,1,2\n", "line 2"),
        ("time,q.a\n0,1\n", "no column `t`; there are time, q.a"),
        ("t,x\n0,1\n", "no column of a joint"),
        ("t,tau.a,effort.a\n0,1,2\n", "two columns of the effort of joint `a`"),
        ("t,q.a,q.a\n0,1,2\n", "two columns `q.a`"),
    ] {
        let error = read(text.as_bytes()).expect_err("it is no log");
        assert!(error.to_string().contains(words) && !error.help.is_empty(), "{error:?}");
    }
}

/// Of megabytes each processor reads a part: the numbers are those of the lines, and complaints have their lines.
#[test]
fn parts_of_a_long_file_are_read_as_its_lines() {
    let row =
        |i: u32| format!("{}.{:03},{:?}, {:?}\r\n", 1_700_000_000 + i / 1000, i % 1000, f64::from(i) / 7.0, -1e-3);
    let rows: Vec<String> = (0..200_000).map(row).collect();
    let text = |rows: &[String]| format!("# recorded in the lab\nt,q.a,tau.a\n{}", rows.concat());
    assert!(text(&rows).len() > 6 << 20);
    let log = read(text(&rows).as_bytes()).expect("a log");
    assert_eq!((log.start, log.times.len()), (1_700_000_000_000_000_000, rows.len()));
    for (i, (t, q)) in log.times.iter().zip(log.column(LogQuantity::Position, 0)).enumerate() {
        assert!((t - i as f64 * 1e-3).abs() < 1e-9 && *q == i as f64 / 7.0, "{i}: {t} {q}");
    }
    let mut wrong = rows.clone();
    wrong[150_000] = "1700000150.0,0.5,much\n# a remark\n".to_string();
    wrong[199_999] = "1700000199.999,,0,\"1\"".to_string();
    let said = |rows: &[String]| read(text(rows).as_bytes()).expect_err("it is wrong").to_string();
    assert!(said(&wrong).contains("line 200003: 4 fields, and the header has 3"), "{}", said(&wrong));
    wrong[199_999] = "1700000199.999,,\"0\"\n".to_string();
    let quoted = said(&wrong);
    wrong[199_999] = "1700000199.999,,0\n".to_string();
    assert!(quoted.contains("line 150003: `much` in column `tau.a`"), "{quoted}");
    assert_eq!(said(&wrong), quoted, "a quotation mark makes it one part");
    wrong[3..].iter_mut().for_each(|row| *row = "1,x,y\n".to_string());
    let said = said(&wrong);
    assert!(said.matches("is no number").count() == 10 && said.contains("line 6: `x`"), "{said}");
}

#[test]
fn what_threads_make_comes_in_order_and_their_panics_come_through() {
    let squares = in_threads(1000, |k| k * k);
    assert!(squares.len() == 1000 && squares.iter().enumerate().all(|(k, x)| *x == k * k));
    assert!(in_threads(0, |k| k).is_empty());
    let panics = std::panic::catch_unwind(|| in_threads(8, |k| assert!(k < 5, "part {k}")));
    assert!(panics.is_err());
}

#[test]
fn what_no_robot_measures_is_left_out_and_what_is_empty_is_said() {
    let with = |rows: &str| read(format!("t,q.a,tau.a,effort.b\n{rows}").as_bytes());
    let log = with("0,0.1,1,nan\n1,1e308,1,nan\n2,0.3,-1e60,nan\n3,0.4,2,nan\n").expect("a log");
    let found = align(&log, &LogDemand::of_joints(&["a"])).expect("two rows are complete");
    assert_eq!((found.report.incomplete, &found.q[0][..]), (2, &[0.1, 0.4][..]));
    // a column without a number is none
    let error = align(&log, &LogDemand::of_joints(&["b"])).expect_err("nothing is known of it");
    assert!(
        error.what.contains("no position of joint `b`") && error.what.contains("no effort of joint `b`"),
        "{error}"
    );
    assert_eq!(with("").expect_err("it has no rows").what, "the log has no rows");
    assert_eq!(read(b"").expect_err("it is empty").what, "the file is empty");
}
