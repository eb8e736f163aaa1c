//! Robot dynamics as functions of DataFusion.
//!
//! A robot is data: a literal in the query, the path of a robot file, with its hash behind it or not. Whoever plans the query reads the file, and finds what is wrong with it; the plan carries the text;
//! whoever executes the plan compiles it once, to machine code ([`straightline_jit`]). Results have the same bits for any partitions, any number of executors and any machine.
//!
//! ```
//! use datafusion::prelude::SessionContext;
//! use straightline_fleets::{register, RobotFolder};
//!
//! # tokio::runtime::Builder::new_current_thread().build().unwrap().block_on(async {
//! let context = SessionContext::new();
//! register(&context, &RobotFolder::at("../../robots/descriptions"));
//! let sql = "SELECT inverse_dynamics('planar2r.urdf', make_array(0.3, 0.5), make_array(0.0, 0.0), make_array(1.0, 0.0)) AS tau";
//! let rows = context.sql(sql).await.unwrap().collect().await.unwrap();
//! assert_eq!(rows[0].num_rows(), 1);
//! # });
//! ```

pub mod bounded;
mod call;
mod exact;
mod failure;
mod function;
mod identified;
mod limits;
mod normal_equations;
mod robot;
mod states;
pub mod text;

pub use robot::{programs_kept, robot_literal, written_hash};
pub use text::RobotFolder;

use datafusion::logical_expr::{AggregateUDF, ScalarUDF};
use datafusion::prelude::SessionContext;
use function::{DynamicsFunction, DYNAMICS};
use identified::IdentifiedParameters;
use limits::LimitsExceeded;
use normal_equations::RegressorNormalEquations;

/// The functions of rows, of robots from that folder.
pub fn scalar_functions(folder: &RobotFolder) -> Vec<ScalarUDF> {
    let dynamics = DYNAMICS.iter().map(|row| ScalarUDF::from(DynamicsFunction::new(row, folder)));
    let others = [ScalarUDF::from(LimitsExceeded::new(folder)), ScalarUDF::from(IdentifiedParameters::default())];
    dynamics.chain(others).collect()
}

/// The aggregates, of robots from that folder.
pub fn aggregate_functions(folder: &RobotFolder) -> Vec<AggregateUDF> {
    vec![AggregateUDF::from(RegressorNormalEquations::new(folder))]
}

/// Gives all of them to a session.
pub fn register(context: &SessionContext, folder: &RobotFolder) {
    scalar_functions(folder).into_iter().for_each(|function| context.register_udf(function));
    aggregate_functions(folder).into_iter().for_each(|function| context.register_udaf(function));
}
