//! Tables as logs.

use straightline_logs::align::align;
use straightline_logs::csv::read;
use straightline_logs::log::LogQuantity;

#[test]
fn a_table_with_missing_numbers_is_a_log_that_says_so() {
    let text = "# a remark\nt, q.a, qd.a, effort.a, qdd.a, current\n0.5,1,2,3,4,9\n0.6,1.5,,3.5,,9\n0.7,2,2.5,nan,4,9\n0.8,2,2,3,4,9\n";
    let log = read(text.as_bytes()).expect("a log");
    assert_eq!((&log.joints[..], log.others[0].name.as_str()), (&["a".to_string()][..], "current"));
    let found = align(&log, &["a"]).expect("two rows are complete");
    assert_eq!((found.report.incomplete, &found.times[..]), (2, &[0.5, 0.8][..]));
    assert_eq!(found.qdd.expect("it has accelerations"), [[4.0, 4.0]]);
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
    let found = align(&log, &["a"]).expect("a log");
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
