//! Logs of robots as tables, and what the plain loop over states says of them.

use datafusion::arrow::array::{
    ArrayRef, AsArray, Float64Array, ListBuilder, PrimitiveBuilder, RecordBatch, UInt32Array,
};
use datafusion::arrow::compute::{cast, concat_batches};
use datafusion::arrow::datatypes::{DataType, Field, Float64Type, Schema};
use datafusion::datasource::MemTable;
use datafusion::prelude::{SessionConfig, SessionContext};
use std::path::PathBuf;
use std::sync::Arc;
use straightline_codegen::choices::OptimisationTier;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::options::Options;
use straightline_codegen::Function;
use straightline_fleets::{register, RobotFolder};
use straightline_jit::{BatchLayout, ExecutionMode, Robot};

/// Robots of the project.
pub fn robots() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../robots/descriptions")
}

/// The text of one of them.
pub fn robot_text(name: &str) -> String {
    std::fs::read_to_string(robots().join(name)).expect("a robot of the project")
}

/// A log: per row q, q̇, q̈ and efforts of each joint, to four decimals, as loggers write them.
#[derive(Clone)]
pub struct Log {
    pub joints: usize,
    pub columns: [Vec<f64>; 4],
}

/// So many rows at 100 Hz of joints that swing at different rates.
pub fn log(joints: usize, rows: usize) -> Log {
    let four_decimals = |x: f64| (x * 1e4).round() / 1e4;
    let of = |order: usize| {
        let number = |row: usize, joint: usize| {
            let (t, w) = (row as f64 / 100.0, 0.7 + 0.45 * joint as f64);
            let (sine, cosine) = (w * t + joint as f64).sin_cos();
            let slow = (0.31 * w * t).cos();
            four_decimals(match order {
                0 => 0.8 * sine + 0.4 * slow - 0.2,
                1 => 0.8 * w * cosine - 0.4 * 0.31 * w * (0.31 * w * t).sin(),
                2 => -0.8 * w * w * sine - 0.4 * (0.31 * w).powi(2) * slow,
                _ => 20.0 * sine - 7.5 * slow + 3.0 * joint as f64,
            })
        };
        (0..rows).flat_map(|row| (0..joints).map(move |joint| (row, joint))).map(|(r, j)| number(r, j)).collect()
    };
    Log { joints, columns: [0, 1, 2, 3].map(of) }
}

impl Log {
    pub fn rows(&self) -> usize {
        self.columns[0].len() / self.joints
    }

    /// A table with the columns `id`, `q`, `qd`, `qdd`, `effort`, whose lists are of that kind.
    pub fn batch(&self, kind: &DataType) -> RecordBatch {
        let lists = self.columns.iter().map(|numbers| {
            let mut list = ListBuilder::new(PrimitiveBuilder::<Float64Type>::new());
            numbers.chunks(self.joints).for_each(|row| list.append_value(row.iter().copied().map(Some)));
            cast(&(Arc::new(list.finish()) as ArrayRef), kind).expect("a list of another kind")
        });
        let id = Arc::new(UInt32Array::from_iter_values(0..self.rows() as u32)) as ArrayRef;
        let columns: Vec<ArrayRef> = std::iter::once(id).chain(lists).collect();
        let names = ["id", "q", "qd", "qdd", "effort"];
        let fields: Vec<Field> = names
            .iter()
            .zip(&columns)
            .map(|(name, column)| Field::new(*name, column.data_type().clone(), true))
            .collect();
        RecordBatch::try_new(Arc::new(Schema::new(fields)), columns).expect("columns of one length")
    }
}

/// The lists of most tests.
pub fn lists() -> DataType {
    DataType::new_list(DataType::Float64, true)
}

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

/// The rows of a query, or what is wrong with it.
pub fn rows(context: &SessionContext, sql: &str) -> Result<RecordBatch, String> {
    let run = async {
        let frame = context.sql(sql).await?;
        let schema = Arc::new(frame.schema().as_arrow().clone());
        let batches = frame.collect().await?;
        let schema = batches.first().map_or(schema, RecordBatch::schema);
        Ok(concat_batches(&schema, &batches)?)
    };
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).build().expect("threads");
    runtime.block_on(run).map_err(|wrong: datafusion::error::DataFusionError| wrong.to_string())
}

/// Bits of the numbers of a column of structs, row by row.
pub fn bits(table: &RecordBatch, column: &str) -> Vec<Vec<u64>> {
    let found = table.column_by_name(column).expect("a column").as_struct();
    let of = |k: usize| -> &Float64Array { found.column(k).as_primitive() };
    (0..table.num_rows()).map(|row| (0..found.num_columns()).map(|k| of(k).value(row).to_bits()).collect()).collect()
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
