//! Sessions over logs, and what the plain loop over states says of them.

use datafusion::arrow::array::RecordBatch;
use datafusion::datasource::MemTable;
use datafusion::prelude::{SessionConfig, SessionContext};
use std::sync::Arc;
use straightline_codegen::choices::OptimisationTier;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::options::Options;
use straightline_codegen::Function;
use straightline_fleet_testing::{robot_text, robots};
use straightline_fleets::{register, RobotFolder};
use straightline_jit::{BatchLayout, ExecutionMode, Robot};

/// A session with the table `logs`, cut into so many partitions of batches of so many rows.
pub fn session(table: &RecordBatch, partitions: usize, batch: usize) -> SessionContext {
    let config = SessionConfig::new().with_target_partitions(partitions).with_batch_size(batch);
    let context = SessionContext::new_with_config(config);
    let mut parts = vec![Vec::new(); partitions];
    for (k, first) in (0..table.num_rows()).step_by(batch).enumerate() {
        parts[k % partitions].push(table.slice(first, batch.min(table.num_rows() - first)));
    }
    let logs = MemTable::try_new(table.schema(), parts).expect("batches of one schema");
    context.register_table("logs", Arc::new(logs)).expect("a new table");
    register(&context, &RobotFolder::at(robots()));
    context
}

/// The function of a robot in the states of a log, by the plain loop of machine code.
pub fn plain(robot: &str, function: Function, inputs: &[&[f64]]) -> Vec<Vec<f64>> {
    plain_by(ExecutionMode::best(), robot, function, inputs)
}

/// The same by other instructions.
pub fn plain_by(by: ExecutionMode, robot: &str, function: Function, inputs: &[&[f64]]) -> Vec<Vec<f64>> {
    let options = Options { functions: vec![function], optimise: OptimisationTier::Quick, ..Options::default() };
    let robot = Robot::<f64>::load_to_run(&Source::new(robot, robot_text(robot)), &options, by);
    let robot = robot.expect("a robot of the project");
    let function = robot.function(function.name()).expect("the function");
    let entries = function.outputs()[0].len();
    let rows = inputs[0].len() / function.inputs()[0].len();
    let mut found = vec![0.0; rows * entries];
    let inputs: Vec<_> = inputs
        .iter()
        .zip(function.inputs())
        .map(|(numbers, port)| (*numbers, BatchLayout::states_of(port.len())))
        .collect();
    function
        .batch(rows, &inputs, &mut [(&mut found, BatchLayout::states_of(entries))])
        .expect("numbers as many as joints");
    found.chunks(entries).map(<[f64]>::to_vec).collect()
}

pub fn to_bits(rows: &[Vec<f64>]) -> Vec<Vec<u64>> {
    rows.iter().map(|row| row.iter().map(|x| x.to_bits()).collect()).collect()
}
