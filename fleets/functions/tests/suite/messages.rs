//! What is wrong with a query, a robot or its file is said while planning, whole.

use crate::helpers::session;
use datafusion::arrow::datatypes::DataType;
use datafusion::prelude::SessionContext;
use straightline_fleet_testing::log::log;
use straightline_fleet_testing::query::runtime;
use straightline_fleet_testing::{robot_text, robots};
use straightline_fleets::{register, written_hash, RobotFolder};

/// What planning says, without a row being computed.
fn planned(context: &SessionContext, sql: &str) -> Result<(), String> {
    let plan = async { context.sql(sql).await?.create_physical_plan().await };
    runtime().block_on(plan).map(drop).map_err(|wrong| wrong.to_string())
}

fn complaint(sql: &str) -> String {
    let kind = DataType::new_fixed_size_list(DataType::Float64, 7, true);
    planned(&session(&log(7, 3).batch(&kind), 1, 8192), sql).unwrap_err()
}

#[test]
fn a_broken_file_is_refused_with_line_and_caret() {
    let folder = tempfile::tempdir().unwrap();
    let text = robot_text("planar2r.urdf");
    let mass = text.lines().find(|line| line.contains("<mass")).expect("a mass").to_string();
    let broken = text.replacen(&mass, "      <mass value=\"1.5 kg\"/>", 1);
    std::fs::write(folder.path().join("arm.urdf"), &broken).unwrap();
    let line = broken.lines().position(|line| line.contains("1.5 kg")).unwrap() + 1;
    for call in ["gravity_force('arm.urdf', q)", "regressor_normal_equations('arm.urdf', q, qd, qdd, effort)"] {
        let context = session(&log(2, 3).table(), 1, 8192);
        register(&context, &RobotFolder::at(folder.path()));
        let said = planned(&context, &format!("SELECT {call} FROM logs")).unwrap_err();
        let pad = " ".repeat(line.to_string().len());
        let shown = format!(
            "{pad}--> arm.urdf:{line}:20\n{pad} |\n{line} |       <mass value=\"1.5 kg\"/>\n{pad} |                    ^^^^^^"
        );
        assert!(said.contains(&shown), "{said}\n\nwanted:\n{shown}");
    }
}

#[test]
fn a_hash_says_which_file_is_meant() {
    let hash = written_hash(robot_text("panda.urdf").as_bytes());
    let context = session(&log(7, 3).table(), 1, 8192);
    planned(&context, &format!("SELECT gravity_force('panda.urdf#{hash}', q) FROM logs")).unwrap();
    planned(
        &context,
        &format!("SELECT gravity_force('panda.urdf#{}', q) FROM logs", hash.to_uppercase().replace("SHA256", "sha256")),
    )
    .unwrap();
    let other = written_hash(robot_text("ur5.urdf").as_bytes());
    assert_eq!(
        complaint(&format!("SELECT gravity_force('panda.urdf#{other}', q) FROM logs")),
        format!("Error during planning: `panda.urdf` is another file\n  wanted: {other}\n  found:  {hash}\nhelp: if the file is the right one, write its hash")
    );
    assert_eq!(
        complaint("SELECT gravity_force('panda.urdf#sha256:0815', q) FROM logs"),
        "Error during planning: the hash `0815` of `panda.urdf` has 4 characters\n\
         help: SHA-256 has 64 hexadecimal digits; leave `#sha256:` out if any file will do"
    );
}

#[test]
fn a_file_that_changes_is_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("arm.urdf");
    let context = session(&log(2, 3).table(), 1, 8192);
    register(&context, &RobotFolder::at(folder.path()));
    std::fs::write(&file, "<robot/>").unwrap();
    assert!(planned(&context, "SELECT gravity_force('arm.urdf', q) FROM logs").is_err());
    std::fs::write(&file, robot_text("planar2r.urdf")).unwrap();
    planned(&context, "SELECT gravity_force('arm.urdf', q) FROM logs").unwrap();
}

#[test]
fn what_is_no_robot_is_refused() {
    let said = complaint("SELECT gravity_force('pandas.urdf', q) FROM logs");
    let file = robots().join("pandas.urdf");
    let head = format!("Error during planning: `pandas.urdf` cannot be read: {}: ", file.display());
    assert!(said.starts_with(&head) && said.ends_with("\nhelp: names count from the folder of robots"), "{said}");
    for (sql, wanted) in [
        (
            "SELECT gravity_force('s3://fleet/panda.urdf', q) FROM logs",
            "`s3://fleet/panda.urdf` is not read by `s3`: robots are files, or have an address of `http` or `https`\n\
             help: copy it into the folder of robots; the hash behind `#sha256:` says that it is the same",
        ),
        (
            "SELECT gravity_force(concat('panda', id, '.urdf'), q) FROM logs",
            "the robot of `gravity_force` is computed row by row\n\
             help: write it as a literal, such as 'panda.urdf'; rows of different robots are told apart by WHERE or CASE",
        ),
        (
            "SELECT gravity_force(12, q) FROM logs",
            "the robot of `gravity_force` is of type Int64\nhelp: write the path of a robot file, such as 'panda.urdf'",
        ),
    ] {
        let said = complaint(sql);
        assert!(said.contains(wanted), "{said}\n\nwanted:\n{wanted}");
    }
}

#[test]
fn arguments_that_do_not_fit_are_refused() {
    for (sql, wanted) in [
        (
            "SELECT inverse_dynamics('panda.urdf', q, qd) FROM logs",
            "`inverse_dynamics` has 4 arguments, not 3: inverse_dynamics(robot, q, qd, qdd)",
        ),
        (
            "SELECT gravity_force('panda.urdf', id) FROM logs",
            "`q` of `gravity_force` is of type UInt32\n\
             help: it is a list of numbers, or a struct with a number per joint; make_array(a, b) makes a list of columns",
        ),
        ("SELECT gravity_force('ur5.urdf', q) FROM logs", "`q` has 7 numbers in every row, `ur5.urdf` takes 6"),
        (
            "SELECT identified_parameters(q) FROM logs",
            "`identified_parameters` takes what `regressor_normal_equations` gives, not FixedSizeList",
        ),
    ] {
        let said = complaint(sql);
        assert!(said.contains(wanted), "{said}\n\nwanted:\n{wanted}");
    }
}

#[test]
fn a_robot_that_efforts_of_joints_do_not_tell_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let text = robot_text("planar2r.urdf").replacen("type=\"revolute\"", "type=\"floating\"", 1);
    std::fs::write(folder.path().join("free.urdf"), text).unwrap();
    let context = session(&log(2, 3).table(), 1, 8192);
    register(&context, &RobotFolder::at(folder.path()));
    let said =
        planned(&context, "SELECT regressor_normal_equations('free.urdf', q, qd, qdd, effort) FROM logs").unwrap_err();
    assert!(said.contains("free.urdf"), "{said}");
}

#[test]
fn a_robot_that_takes_other_files_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let links = "<mujoco><worldbody><body><joint name=\"hinge\" axis=\"0 1 0\"/><geom type=\"sphere\" size=\"0.1\" pos=\"0 0 0.3\" mass=\"2\"/></body></worldbody></mujoco>";
    std::fs::write(folder.path().join("links.xml"), links).unwrap();
    std::fs::write(folder.path().join("arm.xml"), "<mujoco><include file=\"links.xml\"/></mujoco>").unwrap();
    let context = session(&log(1, 3).table(), 1, 8192);
    register(&context, &RobotFolder::at(folder.path()));
    planned(&context, "SELECT gravity_force('links.xml', q) FROM logs").unwrap();
    let said = planned(&context, "SELECT gravity_force('arm.xml', q) FROM logs").unwrap_err();
    let wanted = format!("`arm.xml` takes other files: {}", folder.path().join("links.xml").display());
    assert!(said.contains(&wanted) && said.contains("help: executors get its text alone"), "{said}");
}
