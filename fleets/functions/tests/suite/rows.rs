//! Rows have the bits of the plain loop over states.

use crate::helpers::{plain, plain_by, session, to_bits};
use datafusion::arrow::array::{AsArray, Float64Array};
use straightline_codegen::Function;
use straightline_fleet_testing::log::log;
use straightline_fleet_testing::query::{bits, rows};
use straightline_fleets::{register, RobotFolder};
use straightline_jit::ExecutionMode;

#[test]
fn bits_are_those_of_the_plain_loop_for_any_partitions_and_batches() {
    let log = log(7, 20_011);
    let [q, qd, qdd, effort] = log.columns.each_ref().map(|column| &column[..]);
    let torques = plain("panda.urdf", Function::InverseDynamics, &[q, qd, qdd]);
    let accelerations = plain("panda.urdf", Function::ForwardDynamics, &[q, qd, effort]);
    let left = |(row, model): (&[f64], &Vec<f64>)| row.iter().zip(model).map(|(x, y)| x - y).collect::<Vec<f64>>();
    let residuals: Vec<Vec<f64>> = effort.chunks(7).zip(&torques).map(left).collect();
    let table = log.table();
    let sql = "SELECT id, inverse_dynamics('panda.urdf', q, qd, qdd) AS tau, residual('panda.urdf', q, qd, qdd, effort) AS r, \
               forward_dynamics('panda.urdf', q, qd, effort) AS a FROM logs ORDER BY id";
    for partitions in [1, 2, 7] {
        for batch in [1, 100, 8192] {
            // a batch of one row costs a plan's overhead per row
            let table = if batch == 1 { table.slice(0, 1500) } else { table.clone() };
            let found = rows(&session(&table, partitions, batch), sql).unwrap();
            let count = found.num_rows();
            assert_eq!(count, table.num_rows());
            assert_eq!(bits(&found, "tau"), to_bits(&torques[..count]), "{partitions} partitions of {batch}");
            assert_eq!(bits(&found, "r"), to_bits(&residuals[..count]), "{partitions} partitions of {batch}");
            assert_eq!(bits(&found, "a"), to_bits(&accelerations[..count]), "{partitions} partitions of {batch}");
        }
    }
}

#[test]
fn bits_are_those_of_every_set_of_instructions() {
    let log = log(7, 1003);
    let [q, qd, qdd, _] = log.columns.each_ref().map(|column| &column[..]);
    let sql = "SELECT id, inverse_dynamics('panda.urdf', q, qd, qdd) AS tau FROM logs ORDER BY id";
    let found = bits(&rows(&session(&log.table(), 2, 100), sql).unwrap(), "tau");
    // what the machine lacks is interpreted
    for by in ExecutionMode::ALL {
        let wanted = plain_by(by, "panda.urdf", Function::InverseDynamics, &[q, qd, qdd]);
        assert_eq!(found, to_bits(&wanted), "{by}");
    }
}

#[test]
fn results_are_structs_of_the_joints() {
    let context = session(&log(6, 3).table(), 1, 8192);
    let sql = "SELECT gravity_force('ur5.urdf', q)['elbow_joint'] AS elbow, bias_force('ur5.urdf', q, qd) AS h FROM logs ORDER BY id";
    let found = rows(&context, sql).unwrap();
    let states = log(6, 3);
    let gravity = plain("ur5.urdf", Function::GravityForce, &[&states.columns[0]]);
    let elbow: Vec<f64> = gravity.iter().map(|row| row[2]).collect();
    let column = found.column_by_name("elbow").expect("the column");
    assert_eq!(**column, Float64Array::from(elbow));
    assert_eq!(
        bits(&found, "h"),
        to_bits(&plain("ur5.urdf", Function::BiasForce, &[&states.columns[0], &states.columns[1]]))
    );
}

#[test]
fn a_joint_of_several_coordinates_has_them_by_number() {
    let folder = tempfile::tempdir().unwrap();
    // a flying body with a wheel
    let text = "<mujoco><worldbody><body name=\"drone\"><freejoint name=\"base\"/><geom type=\"box\" size=\"0.2 0.1 0.05\" mass=\"1.5\"/>\
                <body name=\"wheel\" pos=\"0 0 0.1\"><joint name=\"axle\" axis=\"0 0 1\"/><geom type=\"cylinder\" size=\"0.05 0.01\" mass=\"0.2\"/></body>\
                </body></worldbody></mujoco>";
    std::fs::write(folder.path().join("drone.xml"), text).unwrap();
    let context = session(&log(2, 1).table(), 1, 8192);
    register(&context, &RobotFolder::at(folder.path()));
    let sql = "SELECT gravity_force('drone.xml', make_array(0, 0, 1.2, 0, 0, 0, 1, 0.3)) AS g";
    let found = rows(&context, sql).unwrap();
    let forces = found.column(0).as_struct();
    assert_eq!(
        forces.column_names(),
        ["root_joint.0", "root_joint.1", "root_joint.2", "root_joint.3", "root_joint.4", "root_joint.5", "axle"]
    );
    let up: &Float64Array = forces.column(2).as_primitive();
    assert!((up.value(0) - 9.81 * 1.7).abs() < 0.01, "{}", up.value(0));
}

#[test]
fn efforts_beyond_the_limits_of_the_file_are_named() {
    let context = session(&log(7, 1).table(), 1, 8192);
    let sql = "SELECT torque_limits_exceeded('panda.urdf', make_array(1000.0, -1000.1, 0, 0, 2e3, 0, 12)) AS joints";
    let found = rows(&context, sql).unwrap();
    let text = datafusion::arrow::util::pretty::pretty_format_batches(&[found]).unwrap().to_string();
    assert!(text.contains("[panda_joint2, panda_joint5]"), "{text}");
    // a struct of joints, as other functions give it
    let sql = "SELECT count(*) AS n FROM logs WHERE cardinality(torque_limits_exceeded('panda.urdf', inverse_dynamics('panda.urdf', q, qd, qdd))) > 0";
    let found = rows(&context, sql).unwrap();
    let count = found.column(0).as_primitive::<datafusion::arrow::datatypes::Int64Type>().value(0);
    assert_eq!(count, 0);
    let none = "SELECT torque_limits_exceeded('panda.urdf', make_array('NaN'::double, 0, NULL, 0, 0, 0, 0)) AS a, \
                torque_limits_exceeded('panda.urdf', make_array('NaN'::double, 0, 0, 0, 0, 0, 0)) AS b";
    let text =
        datafusion::arrow::util::pretty::pretty_format_batches(&[rows(&context, none).unwrap()]).unwrap().to_string();
    assert!(text.contains("|   | [panda_joint1] |"), "{text}");
}
