//! Normal equations: the same bits in any order, close to a plain sum, and the robot's own parameters come out.

use crate::helpers::{plain, session};
use datafusion::arrow::array::{Array, AsArray, RecordBatch};
use datafusion::arrow::datatypes::{Float64Type, UInt64Type};
use straightline_codegen::choices::OptimisationTier;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::options::Options;
use straightline_codegen::Function;
use straightline_core::base_parameters::JointParameter;
use straightline_fleet_testing::log::{log, Log};
use straightline_fleet_testing::query::rows;
use straightline_fleet_testing::robot_text;
use straightline_jit::{BatchLayout, Robot};

const SQL: &str = "SELECT regressor_normal_equations('ur5.urdf', q, qd, qdd, effort) AS n FROM logs";

/// A log whose efforts are those of the robot.
fn of_the_robot(robot: &str, joints: usize, rows: usize) -> Log {
    let mut log = log(joints, rows);
    let [q, qd, qdd, _] = log.columns.each_ref().map(|column| &column[..]);
    log.columns[3] = plain(robot, Function::InverseDynamics, &[q, qd, qdd]).concat();
    log
}

fn numbers(table: &RecordBatch, field: &str) -> Vec<f64> {
    let found = table.column_by_name("n").expect("the result").as_struct();
    let column = found.column_by_name(field).expect("a field");
    match column.data_type() {
        datafusion::arrow::datatypes::DataType::Float64 => column.as_primitive::<Float64Type>().values().to_vec(),
        _ => column.as_list::<i32>().value(0).as_primitive::<Float64Type>().values().to_vec(),
    }
}

fn bits(table: &RecordBatch) -> Vec<u64> {
    ["gram", "moments", "square"].iter().flat_map(|field| numbers(table, field)).map(f64::to_bits).collect()
}

#[test]
fn sums_have_the_same_bits_for_any_partitions_and_any_order() {
    let table = of_the_robot("ur5.urdf", 6, 1501).table();
    let wanted = bits(&rows(&session(&table, 1, 8192), SQL).unwrap());
    for (partitions, batch) in [(1, 1), (2, 100), (7, 100), (7, 8192)] {
        let found = rows(&session(&table, partitions, batch), SQL).unwrap();
        assert_eq!(bits(&found), wanted, "{partitions} partitions of {batch}");
    }
    // in another order, and of groups that are added up
    let backwards = SQL.replace("FROM logs", "FROM (SELECT * FROM logs ORDER BY id DESC)");
    assert_eq!(bits(&rows(&session(&table, 2, 64), &backwards).unwrap()), wanted);
}

#[test]
fn sums_are_those_of_a_plain_loop_but_for_its_rounding() {
    let log = of_the_robot("ur5.urdf", 6, 400);
    let found = rows(&session(&log.table(), 3, 64), SQL).unwrap();
    let mut options =
        Options { functions: vec![Function::TorqueRegressor], optimise: OptimisationTier::Quick, ..Options::default() };
    options.scene.regressor = vec![JointParameter::Damping, JointParameter::Coulomb, JointParameter::Offset];
    let robot = Robot::<f64>::load(&Source::new("ur5.urdf", robot_text("ur5.urdf")), &options).unwrap();
    let regressor = robot.function("torque_regressor").unwrap();
    let entries = regressor.outputs()[0].len();
    let columns = entries / 6;
    let mut y = vec![0.0; 400 * entries];
    let inputs = [0, 1, 2].map(|k| (&log.columns[k][..], BatchLayout::states_of(6)));
    regressor.batch(400, &inputs, &mut [(&mut y, BatchLayout::states_of(entries))]).unwrap();
    let (mut gram, mut moments, mut square) = (Vec::new(), vec![0.0; columns], 0.0);
    for i in 0..columns {
        for k in i..columns {
            gram.push(y.chunks(columns).map(|row| row[i] * row[k]).sum::<f64>());
        }
        moments[i] = y.chunks(columns).zip(&log.columns[3]).map(|(row, tau)| row[i] * tau).sum();
    }
    log.columns[3].iter().for_each(|tau| square += tau * tau);
    let close = |found: &[f64], wanted: &[f64]| {
        assert_eq!(found.len(), wanted.len());
        let most = wanted.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        let is_close = |(x, y): (&f64, &f64)| (x - y).abs() <= 2400.0 * f64::EPSILON * most;
        assert!(found.iter().zip(wanted).all(is_close));
    };
    close(&numbers(&found, "gram"), &gram);
    close(&numbers(&found, "moments"), &moments);
    close(&numbers(&found, "square"), &[square]);
}

/// Name, value by the file, identified value.
fn parameters(table: &RecordBatch) -> Vec<(String, f64, Option<f64>, f64)> {
    let list = table.column_by_name("p").expect("the result").as_list::<i32>().value(0);
    let found = list.as_struct();
    let numbers = |k: usize| found.column(k).as_primitive::<Float64Type>();
    let names = found.column(0).as_string::<i32>();
    let one = |k: usize| {
        let value = numbers(2).is_valid(k).then(|| numbers(2).value(k));
        (names.value(k).to_string(), numbers(1).value(k), value, numbers(3).value(k))
    };
    (0..found.len()).map(one).collect()
}

#[test]
fn the_robots_own_base_parameters_come_out() {
    for (robot, joints) in [("ur5.urdf", 6), ("panda.urdf", 7), ("puma560.urdf", 6)] {
        let log = of_the_robot(robot, joints, 4000);
        let sql = format!(
            "SELECT identified_parameters(regressor_normal_equations('{robot}', q, qd, qdd, effort)) AS p FROM logs"
        );
        let found = parameters(&rows(&session(&log.table(), 2, 1000), &sql).unwrap());
        let greatest = found.iter().fold(0.0, |most: f64, (_, nominal, ..)| most.max(nominal.abs()));
        let mut told = 0;
        let mut worst: f64 = 0.0;
        for (name, nominal, value, _) in &found {
            let Some(value) = value else { continue };
            told += 1;
            worst = worst.max((value - nominal).abs() / greatest);
            assert!((value - nominal).abs() < 1e-7 * greatest, "{robot} {name}: {value}, by the file {nominal}");
        }
        println!("{robot}: {told} of {} parameters, off by {worst:.1e} of the greatest", found.len());
        assert!(told * 10 >= found.len() * 9, "{robot}: {told} of {}", found.len());
    }
}

#[test]
fn a_fleet_is_identified_by_one_query() {
    let table = of_the_robot("ur5.urdf", 6, 3000).table();
    let sql = "SELECT id % 3 AS robot, regressor_normal_equations('ur5.urdf', q, qd, qdd, effort) AS n FROM logs GROUP BY id % 3 ORDER BY robot";
    let found = rows(&session(&table, 2, 100), sql).unwrap();
    let counts = found.column(1).as_struct().column(0).as_primitive::<UInt64Type>().values().to_vec();
    assert_eq!(counts, [1000, 1000, 1000]);
}

#[test]
fn what_a_log_does_not_tell_has_no_value() {
    let mut log = of_the_robot("planar2r.urdf", 2, 200);
    // the second joint rests
    for column in &mut log.columns[..3] {
        column.chunks_mut(2).for_each(|row| row[1] = 0.0);
    }
    let [q, qd, qdd, _] = log.columns.each_ref().map(|column| &column[..]);
    log.columns[3] = plain("planar2r.urdf", Function::InverseDynamics, &[q, qd, qdd]).concat();
    let sql =
        "SELECT identified_parameters(regressor_normal_equations('planar2r.urdf', q, qd, qdd, effort)) AS p FROM logs";
    let found = parameters(&rows(&session(&log.table(), 1, 100), sql).unwrap());
    let untold: Vec<&str> =
        found.iter().filter(|(.., value, _)| value.is_none()).map(|(name, ..)| name.as_str()).collect();
    // friction of a joint at rest
    assert!(untold.iter().any(|name| name.starts_with("d2")), "{untold:?}");
    assert!(untold.len() < found.len(), "{untold:?}");
}

#[test]
fn rows_that_no_sum_holds_are_told() {
    let table = log(6, 4).table();
    let sql = "SELECT regressor_normal_equations('ur5.urdf', q, qd, qdd, make_array(1, 2, 3, 'NaN'::double, 5, 6)) AS n FROM logs";
    let said = rows(&session(&table, 1, 8192), sql).unwrap_err();
    let wanted = "a product of regressor and efforts is NaN, which exact sums do not hold\n\
                  help: are all numbers of `effort` and of the motion finite, and in SI units?";
    assert!(said.contains(wanted), "{said}");
}
