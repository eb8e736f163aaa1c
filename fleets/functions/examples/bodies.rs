//! What a function costs beside the plain loop over states, both over a batch that lies in cache.
//!
//! `cargo run --release --example bodies`, on a machine that does nothing else. Each figure is the best of several, as others disturb in one direction alone.

use datafusion::arrow::array::{Array, ArrayRef, AsArray, RecordBatch};
use datafusion::arrow::datatypes::{Field, Float64Type, Schema};
use datafusion::error::Result;
use datafusion::logical_expr::{col, lit, ColumnarValue, Expr, ReturnFieldArgs, ScalarFunctionArgs};
use datafusion::prelude::SessionContext;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;
use straightline_codegen::choices::OptimisationTier;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::options::Options;
use straightline_codegen::Function;
use straightline_fleet_testing::log::log_at;
use straightline_fleet_testing::{robot_text, robots};
use straightline_fleets::{scalar_functions, RobotFolder};
use straightline_jit::{BatchLayout, Robot};

const JOINTS: usize = 7;
/// Rows of a batch.
const BATCH: usize = 8192;
/// Calls of a measurement.
const CALLS: usize = 20;
/// Each figure is the best of so many.
const TRIES: usize = 15;

/// The least time of several \[s\].
fn best(mut work: impl FnMut()) -> f64 {
    let mut one = || {
        let start = Instant::now();
        (0..CALLS).for_each(|_| work());
        start.elapsed().as_secs_f64()
    };
    (0..TRIES).map(|_| one()).fold(f64::INFINITY, f64::min)
}

/// The plain loop.
fn plain(function: Function, numbers: &[&[f64]]) -> f64 {
    let options = Options { functions: vec![function], optimise: OptimisationTier::Quick, ..Options::default() };
    let robot = Robot::<f64>::load(&Source::new("panda.urdf", robot_text("panda.urdf")), &options)
        .expect("a robot of the project");
    let loaded = robot.function(function.name()).expect("the function");
    let inputs: Vec<_> = numbers.iter().map(|x| (*x, BatchLayout::states_of(JOINTS))).collect();
    let mut found = vec![0.0; BATCH * JOINTS];
    best(|| {
        loaded.batch(BATCH, &inputs, &mut [(&mut found, BatchLayout::states_of(JOINTS))]).expect("states");
        black_box(&mut found);
    })
}

/// The body of the function of that name.
fn body(name: &str, lists: &[ArrayRef]) -> Result<f64> {
    let udf = scalar_functions(&RobotFolder::at(robots())).into_iter().find(|function| function.name() == name);
    let udf = udf.expect("a function");
    let fields: Vec<Arc<Field>> =
        (0..lists.len()).map(|k| Arc::new(Field::new(format!("x{k}"), lists[k].data_type().clone(), true))).collect();
    let schema = Schema::new(fields);
    let columns = (0..lists.len()).map(|k| col(format!("x{k}")));
    let call = udf.call(std::iter::once(lit("panda.urdf")).chain(columns).collect());
    // as planning leaves it, with the text of the robot
    let context = SessionContext::new();
    let table = context.read_batch(RecordBatch::try_new(Arc::new(schema), lists.to_vec())?)?;
    let plan = context.state().optimize(table.select([call])?.logical_plan())?;
    let mut literal = None;
    plan.expressions().into_iter().for_each(|expr| {
        if let Expr::ScalarFunction(call) = expr.unalias() {
            literal = call.args.into_iter().next();
        }
    });
    let Some(Expr::Literal(literal, _)) = literal else { panic!("a call of a literal: {plan}") };
    let arrays = lists.iter().map(|array| ColumnarValue::Array(array.clone()));
    let args: Vec<ColumnarValue> = std::iter::once(ColumnarValue::Scalar(literal.clone())).chain(arrays).collect();
    let arg_fields: Vec<_> = args.iter().map(|arg| Arc::new(Field::new("", arg.data_type(), true))).collect();
    let scalar_arguments: Vec<_> = std::iter::once(Some(&literal)).chain(lists.iter().map(|_| None)).collect();
    let of = ReturnFieldArgs { arg_fields: &arg_fields, scalar_arguments: &scalar_arguments };
    let return_field = udf.return_field_from_args(of)?;
    let given =
        ScalarFunctionArgs { args, arg_fields, number_rows: BATCH, return_field, config_options: Arc::default() };
    Ok(best(|| {
        black_box(udf.invoke_with_args(given.clone()).expect("states"));
    }))
}

fn main() -> Result<()> {
    println!("| function | plain loop, states/s | function, states/s | ratio |\n|---|---|---|---|");
    let table = log_at(1000.0, JOINTS, 0..BATCH).table();
    // q, q̇ and q̈
    let lists = [1, 2, 3].map(|k| table.column(k).clone());
    let numbers = lists.each_ref().map(|list| list.as_list::<i32>().values().as_primitive::<Float64Type>().values());
    let numbers = numbers.each_ref().map(|values| &values[..]);
    for (name, function, inputs) in [
        ("inverse_dynamics", Function::InverseDynamics, 3),
        ("forward_dynamics", Function::ForwardDynamics, 3),
        ("gravity_force", Function::GravityForce, 1),
    ] {
        let (plain, body) = (plain(function, &numbers[..inputs]), body(name, &lists[..inputs])?);
        let rate = |time: f64| (CALLS * BATCH) as f64 / time;
        println!("| {name} | {:.3e} | {:.3e} | {:.2} |", rate(plain), rate(body), plain / body);
    }
    Ok(())
}
