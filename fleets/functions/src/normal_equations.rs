//! The normal equations of identification, as an aggregate: YᵀY, Yᵀτ and τᵀτ of the regressor Y(q, q̇, q̈) with the base parameters' columns.
//!
//! Products are rounded, sums exact ([`ExactSums`]): so the result has the same bits whatever the partitions, and parts of a fleet may be added in any order.

use crate::call::RobotCall;
use crate::exact::ExactSums;
use crate::failure;
use crate::robot::{FleetRobot, RegressorColumns, RobotUse};
use crate::states::{rows_with_all, States};
use crate::text::RobotFolder;
use datafusion::arrow::array::{
    Array, ArrayRef, AsArray, Float64Array, ListArray, StringArray, StructArray, UInt64Array,
};
use datafusion::arrow::buffer::OffsetBuffer;
use datafusion::arrow::datatypes::{DataType, Field, FieldRef, Fields, UInt64Type};
use datafusion::error::Result;
use datafusion::logical_expr::function::{AccumulatorArgs, AggregateFunctionSimplification, StateFieldsArgs};
use datafusion::logical_expr::{Accumulator, AggregateUDF, AggregateUDFImpl, Expr, Signature};
use datafusion::physical_expr::expressions::Literal;
use datafusion::scalar::ScalarValue;
use std::sync::Arc;
use straightline_jit::BatchLayout;

const NAME: &str = "regressor_normal_equations";
const INPUTS: [&str; 4] = ["q", "qd", "qdd", "effort"];
/// States whose regressors are held at once.
const CHUNK: usize = 256;

/// `regressor_normal_equations(robot, q, qd, qdd, effort)`.
#[derive(Debug, PartialEq, Eq, Hash)]
pub struct RegressorNormalEquations(RobotCall);

impl RegressorNormalEquations {
    /// Of robots from that folder.
    pub fn new(folder: &RobotFolder) -> RegressorNormalEquations {
        RegressorNormalEquations(RobotCall::new(NAME, &INPUTS, RobotUse::Regressor, folder))
    }
}

/// The fields of the result: rows that were added, their equations, one per joint; names of the base parameters and their values by the robot file; the upper
/// triangle of YᵀY by rows, Yᵀτ, τᵀτ.
pub fn fields() -> Fields {
    let list = |of| DataType::new_list(of, true);
    Fields::from(vec![
        Field::new("rows", DataType::UInt64, true),
        Field::new("equations", DataType::UInt64, true),
        Field::new("parameters", list(DataType::Utf8), true),
        Field::new("nominal", list(DataType::Float64), true),
        Field::new("gram", list(DataType::Float64), true),
        Field::new("moments", list(DataType::Float64), true),
        Field::new("square", DataType::Float64, true),
    ])
}

impl AggregateUDFImpl for RegressorNormalEquations {
    fn name(&self) -> &str {
        NAME
    }

    fn signature(&self) -> &Signature {
        &self.0.signature
    }

    fn coerce_types(&self, given: &[DataType]) -> Result<Vec<DataType>> {
        self.0.coerced(given)
    }

    fn return_type(&self, _: &[DataType]) -> Result<DataType> {
        Ok(DataType::Struct(fields()))
    }

    fn state_fields(&self, args: StateFieldsArgs<'_>) -> Result<Vec<FieldRef>> {
        let field = |what: &str, kind| Arc::new(Field::new(format!("{}[{what}]", args.name), kind, true));
        Ok(vec![field("rows", DataType::UInt64), field("sums", DataType::Binary)])
    }

    fn simplify(&self) -> Option<AggregateFunctionSimplification> {
        let own = self.0.clone();
        Some(Box::new(move |mut call, _| {
            if own.carrying(&mut call.params.args)? {
                call.func = Arc::new(AggregateUDF::from(RegressorNormalEquations(own.clone())));
            }
            Ok(Expr::AggregateFunction(call))
        }))
    }

    fn accumulator(&self, args: AccumulatorArgs<'_>) -> Result<Box<dyn Accumulator>> {
        let literal = args.exprs.first().and_then(|expr| expr.downcast_ref::<Literal>());
        let robot = self.0.robot(literal.map(Literal::value))?;
        match robot.refusal() {
            Some(why) => Err(failure::refused(NAME, &robot.name, &why)),
            None => Ok(Box::new(EquationSums::of(self.0.clone(), robot))),
        }
    }
}

/// What is summed up.
#[derive(Debug)]
struct EquationSums {
    call: RobotCall,
    robot: Arc<FleetRobot>,
    /// Per joint the columns of its row that are not zero everywhere, in their order.
    columns: Vec<Vec<usize>>,
    rows: u64,
    /// YᵀY, then Yᵀτ, then τᵀτ.
    sums: ExactSums,
}

/// Where the entries of a symmetric matrix are in its upper triangle, by rows.
pub fn in_triangle(columns: usize, row: usize, column: usize) -> usize {
    row * columns - row * (row + 1) / 2 + column
}

impl EquationSums {
    fn of(call: RobotCall, robot: Arc<FleetRobot>) -> EquationSums {
        let mut of_joint = vec![Vec::new(); robot.joints.len()];
        let found = columns(&robot);
        found.places.iter().for_each(|[row, column]| of_joint[*row].push(*column));
        let n = found.names.len();
        EquationSums { call, columns: of_joint, rows: 0, sums: ExactSums::zero(n * (n + 1) / 2 + n + 1), robot }
    }

    /// Adds the products of one joint's equation: its row of the regressor, and what it is to add up to.
    fn add(&mut self, joint: usize, y: &[f64], effort: f64) -> Result<()> {
        let n = columns(&self.robot).names.len();
        let moments = n * (n + 1) / 2;
        let own = &self.columns[joint];
        for (at, column) in own.iter().enumerate() {
            for with in &own[at..] {
                self.sums.add(in_triangle(n, *column, *with), y[*column] * y[*with], INPUTS[0])?;
            }
            self.sums.add(moments + column, y[*column] * effort, INPUTS[3])?;
        }
        self.sums.add(moments + n, effort * effort, INPUTS[3])
    }

    fn add_rows(&mut self, given: &[States<'_>], rows: usize) -> Result<()> {
        let robot = self.robot.clone();
        let nulls = rows_with_all(given);
        let n = columns(&robot).names.len();
        let entries = n * robot.joints.len();
        let mut found = vec![0.0; CHUNK.min(rows) * entries];
        for first in (0..rows).step_by(CHUNK) {
            let count = CHUNK.min(rows - first);
            let inputs: Vec<_> = given[..3].iter().map(|column| column.batch_from(first)).collect();
            let results = &mut [(&mut found[..], BatchLayout::states_of(entries))];
            let batch = robot.function().batch(count, &inputs, results);
            batch.map_err(|wrong| failure::refused(NAME, &robot.name, &wrong.to_string()))?;
            let is_there = |row: &usize| nulls.as_ref().is_none_or(|nulls| nulls.is_valid(*row));
            for row in (first..first + count).filter(is_there) {
                let y = &found[(row - first) * entries..][..entries];
                for joint in 0..robot.joints.len() {
                    let known = columns(&robot).known_force(joint, given[0].at(row, joint), given[1].at(row, joint));
                    self.add(joint, &y[joint * n..][..n], given[3].at(row, joint) - known)?;
                }
                self.rows += 1;
            }
        }
        Ok(())
    }
}

fn columns(robot: &FleetRobot) -> &RegressorColumns {
    robot.regressor.as_ref().expect("the robot was loaded for its regressor")
}

/// A list of one row.
fn list<A: Array + 'static>(values: A) -> ArrayRef {
    let field = Arc::new(Field::new_list_field(values.data_type().clone(), true));
    Arc::new(ListArray::new(field, OffsetBuffer::from_lengths([values.len()]), Arc::new(values), None))
}

impl Accumulator for EquationSums {
    fn update_batch(&mut self, values: &[ArrayRef]) -> Result<()> {
        let robot = self.robot.clone();
        let given = self.call.states(&values[1..], &robot, &[robot.joints.len(); INPUTS.len()])?;
        let rows = values[0].len();
        self.add_rows(&given, rows)
    }

    fn merge_batch(&mut self, states: &[ArrayRef]) -> Result<()> {
        let (rows, sums) = (states[0].as_primitive::<UInt64Type>(), states[1].as_binary::<i32>());
        for (rows, sums) in rows.iter().flatten().zip(sums.iter().flatten()) {
            self.rows += rows;
            self.sums.merge(&ExactSums::from_bytes(sums)?)?;
        }
        Ok(())
    }

    fn state(&mut self) -> Result<Vec<ScalarValue>> {
        Ok(vec![ScalarValue::UInt64(Some(self.rows)), ScalarValue::Binary(Some(self.sums.to_bytes()))])
    }

    fn evaluate(&mut self) -> Result<ScalarValue> {
        let columns = columns(&self.robot);
        let n = columns.names.len();
        let moments = n * (n + 1) / 2;
        let numbers = |range: std::ops::Range<usize>| -> Float64Array { range.map(|k| self.sums.rounded(k)).collect() };
        let arrays: Vec<ArrayRef> = vec![
            Arc::new(UInt64Array::from(vec![self.rows])),
            Arc::new(UInt64Array::from(vec![self.rows * self.robot.joints.len() as u64])),
            list(columns.names.iter().map(Some).collect::<StringArray>()),
            list(Float64Array::from(columns.nominal.clone())),
            list(numbers(0..moments)),
            list(numbers(moments..moments + n)),
            Arc::new(numbers(moments + n..moments + n + 1)),
        ];
        Ok(ScalarValue::Struct(Arc::new(StructArray::new(fields(), arrays, None))))
    }

    fn size(&self) -> usize {
        size_of_val(self) + self.sums.len() * size_of::<i128>()
    }
}
