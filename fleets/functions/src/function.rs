//! Functions whose results are a number per joint: a row of a table each.

use crate::failure;
use crate::robot::{carried, robot, FleetRobot, RobotUse};
use crate::states::{check_type, columns, rows_with_all, states, taken_as, States};
use crate::text::{can_be_robot, RobotFolder};
use datafusion::arrow::array::{ArrayRef, StructArray};
use datafusion::arrow::datatypes::{DataType, Field, FieldRef, Fields};
use datafusion::common::exec_err;
use datafusion::error::Result;
use datafusion::logical_expr::simplify::{ExprSimplifyResult, SimplifyContext};
use datafusion::logical_expr::{
    ColumnarValue, Expr, ReturnFieldArgs, ScalarFunctionArgs, ScalarUDFImpl, Signature, Volatility,
};
use datafusion::scalar::ScalarValue;
use std::sync::Arc;
use straightline_codegen::Function;
use straightline_jit::BatchLayout;

/// States that are computed at once: their results stay in cache.
const BLOCK: usize = 1024;

/// A function of a robot and its states.
#[derive(Debug, PartialEq, Eq, Hash)]
pub struct DynamicsRow {
    /// Its name in SQL.
    pub name: &'static str,
    /// What is computed.
    pub function: Function,
    /// What it is given, behind the robot.
    pub inputs: &'static [&'static str],
    /// Whether the last argument is measured, and the result what the model leaves of it.
    pub is_residual: bool,
}

/// All of them.
pub static DYNAMICS: [DynamicsRow; 5] = [
    DynamicsRow {
        name: "inverse_dynamics",
        function: Function::InverseDynamics,
        inputs: &["q", "qd", "qdd"],
        is_residual: false,
    },
    DynamicsRow { name: "gravity_force", function: Function::GravityForce, inputs: &["q"], is_residual: false },
    DynamicsRow { name: "bias_force", function: Function::BiasForce, inputs: &["q", "qd"], is_residual: false },
    DynamicsRow {
        name: "forward_dynamics",
        function: Function::ForwardDynamics,
        inputs: &["q", "qd", "tau"],
        is_residual: false,
    },
    // measured minus model, as `straightline residuals`
    DynamicsRow {
        name: "residual",
        function: Function::InverseDynamics,
        inputs: &["q", "qd", "qdd", "effort"],
        is_residual: true,
    },
];

/// One of them in a session.
#[derive(Debug, PartialEq, Eq, Hash)]
pub struct DynamicsFunction {
    row: &'static DynamicsRow,
    folder: RobotFolder,
    signature: Signature,
}

impl DynamicsFunction {
    /// That row, of robots from that folder.
    pub fn new(row: &'static DynamicsRow, folder: RobotFolder) -> DynamicsFunction {
        DynamicsFunction { row, folder, signature: Signature::user_defined(Volatility::Immutable) }
    }

    fn robot(&self, literal: &ScalarValue) -> Result<Arc<FleetRobot>> {
        robot(self.row.name, literal, &self.folder, RobotUse::Function(self.row.function))
    }

    /// The results, a column per joint, block by block: what a block gives is copied to its columns while it is in cache, so that these need not be filled with
    /// zeros first.
    fn columns(&self, robot: &FleetRobot, given: &[States<'_>], rows: usize) -> Result<Vec<Vec<f64>>> {
        let mut columns = vec![Vec::with_capacity(rows); robot.joints.len()];
        let mut found = vec![0.0; robot.joints.len() * BLOCK.min(rows)];
        for first in (0..rows).step_by(BLOCK) {
            let count = BLOCK.min(rows - first);
            let taken = &given[..robot.function().inputs().len()];
            let inputs: Vec<_> = taken.iter().map(|column| column.batch_from(first)).collect();
            let results = &mut [(&mut found[..], BatchLayout::entries_of(count))];
            let batch = robot.function().batch(count, &inputs, results);
            batch.map_err(|wrong| failure::refused(self.row.name, &robot.name, &wrong.to_string()))?;
            for (joint, (column, model)) in columns.iter_mut().zip(found.chunks_exact(count)).enumerate() {
                match given.last().filter(|_| self.row.is_residual) {
                    Some(measured) => {
                        column.extend(model.iter().enumerate().map(|(row, x)| measured.at(first + row, joint) - x));
                    }
                    None => column.extend_from_slice(model),
                }
            }
        }
        Ok(columns)
    }

    /// Numbers that each input has per row.
    fn lengths(&self, robot: &FleetRobot) -> Vec<usize> {
        let taken = robot.function().inputs().iter().map(|port| port.len());
        taken.chain(self.row.is_residual.then_some(robot.joints.len())).collect()
    }
}

/// The types that arguments are taken in.
pub fn coerced(function: &str, inputs: &[&str], given: &[DataType]) -> Result<Vec<DataType>> {
    let Some((robot, lists)) = given.split_first().filter(|(_, lists)| lists.len() == inputs.len()) else {
        return Err(failure::arguments(function, inputs, given.len()));
    };
    if !can_be_robot(robot) {
        return Err(failure::no_robot(function, &format!("of type {robot}")));
    }
    let taken =
        |(name, kind): (&&str, &DataType)| taken_as(kind).ok_or_else(|| failure::no_numbers(function, name, kind));
    let lists = inputs.iter().zip(lists).map(taken);
    std::iter::once(Ok(robot.clone())).chain(lists).collect()
}

/// A number per joint.
fn per_joint(robot: &FleetRobot) -> Fields {
    robot.joints.iter().map(|name| Field::new(name, DataType::Float64, true)).collect()
}

/// The robot's text in place of its name, in the arguments of a function.
pub fn carrying(function: &str, args: &mut [Expr], folder: &RobotFolder, of: RobotUse) -> Result<bool> {
    let Some(Expr::Literal(literal, _)) = args.first_mut() else { return Err(failure::robot_of_rows(function)) };
    let text = carried(function, literal, folder, of)?;
    let is_other = text != *literal;
    *literal = text;
    Ok(is_other)
}

impl ScalarUDFImpl for DynamicsFunction {
    fn name(&self) -> &str {
        self.row.name
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn coerce_types(&self, given: &[DataType]) -> Result<Vec<DataType>> {
        coerced(self.row.name, self.row.inputs, given)
    }

    fn return_type(&self, _: &[DataType]) -> Result<DataType> {
        exec_err!("the type of `{}` follows from its robot", self.row.name)
    }

    fn return_field_from_args(&self, args: ReturnFieldArgs<'_>) -> Result<FieldRef> {
        let Some(literal) = args.scalar_arguments.first().copied().flatten() else {
            return Err(failure::robot_of_rows(self.row.name));
        };
        let robot = self.robot(literal)?;
        let lists = self.row.inputs.iter().zip(&args.arg_fields[1..]).zip(self.lengths(&robot));
        for ((name, field), length) in lists {
            check_type(name, field.data_type(), &robot, length)?;
        }
        Ok(Arc::new(Field::new(self.row.name, DataType::Struct(per_joint(&robot)), true)))
    }

    fn simplify(&self, mut args: Vec<Expr>, _: &SimplifyContext) -> Result<ExprSimplifyResult> {
        match carrying(self.row.name, &mut args, &self.folder, RobotUse::Function(self.row.function))? {
            false => Ok(ExprSimplifyResult::Original(args)),
            true => {
                let function = DynamicsFunction::new(self.row, self.folder.clone());
                let function = Arc::new(datafusion::logical_expr::ScalarUDF::from(function));
                Ok(ExprSimplifyResult::Simplified(function.call(args)))
            }
        }
    }

    fn invoke_with_args(&self, args: ScalarFunctionArgs) -> Result<ColumnarValue> {
        let Some(ColumnarValue::Scalar(literal)) = args.args.first() else {
            return Err(failure::robot_of_rows(self.row.name));
        };
        let robot = self.robot(literal)?;
        let rows = args.number_rows;
        let arrays: Vec<ArrayRef> = args.args[1..].iter().map(|arg| arg.to_array(rows)).collect::<Result<_>>()?;
        let lists = self.row.inputs.iter().zip(&arrays).zip(self.lengths(&robot));
        let given: Vec<States<'_>> =
            lists.map(|((name, array), length)| states(name, array, &robot, length)).collect::<Result<_>>()?;
        let nulls = rows_with_all(&given);
        let columns = columns(self.columns(&robot, &given, rows)?, nulls.as_ref());
        let DataType::Struct(fields) = args.return_field.data_type() else {
            return exec_err!("`{}` gives a struct", self.row.name);
        };
        let found = StructArray::try_new_with_length(fields.clone(), columns, nulls, rows)?;
        Ok(ColumnarValue::Array(Arc::new(found)))
    }
}
