//! Sweeps over the numbers of robots as a table: `sweep(robot, experiment, ranges, samples, seed)`.
//!
//! Each sample is a robot whose numbers are drawn from ranges by chance, and what a motion asks of it. The table is a plan of plain parts, a range of samples per partition, so that any
//! engine that has the function of one sample distributes it.

mod failure;
mod prepared;
mod ranges;
mod sample;

use datafusion::catalog::{TableFunctionArgs, TableFunctionImpl, TableProvider};
use datafusion::common::Column;
use datafusion::datasource::ViewTable;
use datafusion::error::Result;
use datafusion::functions_nested::expr_fn::range;
use datafusion::logical_expr::{col, lit, Expr, LogicalPlan, LogicalPlanBuilder, ScalarUDF};
use datafusion::prelude::SessionContext;
use datafusion::scalar::ScalarValue;
use sample::SweepSample;
use std::ops::Range;
use std::sync::Arc;
use straightline_fleets::text::CarriedText;
use straightline_fleets::{robot_literal, RobotFolder};

/// Samples of a table, at most: their numbers stand in the plan.
const MOST_SAMPLES: i64 = 1_000_000;
/// Samples of a partition, at most: what it gives is in memory at once.
const MOST_OF_PART: i64 = 1 << 14;

/// The function of one sample, for engines that execute plans.
pub fn scalar_functions() -> Vec<ScalarUDF> {
    vec![ScalarUDF::from(SweepSample::default())]
}

/// Gives the table function to a session, with robots and experiments from that folder.
pub fn register(context: &SessionContext, folder: &RobotFolder) {
    scalar_functions().into_iter().for_each(|function| context.register_udf(function));
    context.register_udtf("sweep", Arc::new(SweepTable { folder: folder.clone() }));
}

/// The table function.
#[derive(Debug)]
struct SweepTable {
    folder: RobotFolder,
}

/// A literal's text.
fn text<'a>(name: &str, expr: &'a Expr) -> Result<&'a str> {
    let found = match expr {
        Expr::Literal(literal, _) => literal.try_as_str().flatten(),
        _ => None,
    };
    found.ok_or_else(|| failure::argument(name, expr, "a text"))
}

/// A literal's whole number.
fn whole(name: &str, expr: &Expr, least: i64, most: i64) -> Result<i64> {
    let found = match expr {
        Expr::Literal(ScalarValue::Int64(found), _) => *found,
        _ => None,
    };
    let is_sound = |x: &i64| (least..=most).contains(x);
    found
        .filter(is_sound)
        .ok_or_else(|| failure::argument(name, expr, &format!("a whole number from {least} to {most}")))
}

impl TableFunctionImpl for SweepTable {
    fn call_with_args(&self, args: TableFunctionArgs<'_, '_>) -> Result<Arc<dyn TableProvider>> {
        let [robot, experiment, ranges, samples, seed] = args.exprs() else {
            return Err(failure::arguments(args.exprs().len()));
        };
        let robot = robot_literal("sweep", text("robot", robot)?, &self.folder)?;
        let experiment = self.folder.read(text("experiment", experiment)?)?.literal();
        let ranges = text("ranges", ranges)?;
        let samples = whole("samples", samples, 1, MOST_SAMPLES)?;
        let seed = whole("seed", seed, i64::MIN, i64::MAX)? as u64;
        let carried = |literal| CarriedText::of(literal).expect("a text that was made just now");
        let sweep = sample::prepared(carried(&robot), carried(&experiment), ranges)?;
        let literals = [lit(robot), lit(experiment), lit(ranges), lit(seed)];
        let names: Vec<String> = sample::fields(&sweep).iter().map(|field| field.name().clone()).collect();
        let wanted = args.session().config().target_partitions() as i64;
        let parts = wanted.max((samples + MOST_OF_PART - 1) / MOST_OF_PART).min(samples);
        let part = |k: i64| part(&literals, &names, samples * k / parts..samples * (k + 1) / parts);
        let first = part(0)?;
        let plan = (1..parts).try_fold(LogicalPlanBuilder::from(first), |plan, k| plan.union(part(k)?))?;
        Ok(Arc::new(ViewTable::new(plan.build()?, None)))
    }
}

/// A range of samples.
fn part(literals: &[Expr], names: &[String], samples: Range<i64>) -> Result<LogicalPlan> {
    let function = Arc::new(ScalarUDF::from(SweepSample::default()));
    let args = literals.iter().cloned().chain([col("sample")]).collect();
    let fields = names.iter().map(|name| {
        let field = Column::new_unqualified(format!("figures.{name}"));
        Expr::Column(field).alias(name)
    });
    LogicalPlanBuilder::empty(true)
        .project([range(lit(samples.start), lit(samples.end), lit(1_i64)).alias("sample")])?
        .unnest_column("sample")?
        .project([col("sample"), function.call(args).alias("figures")])?
        .unnest_column("figures")?
        .project(std::iter::once(col("sample")).chain(fields).collect::<Vec<_>>())?
        .build()
}
