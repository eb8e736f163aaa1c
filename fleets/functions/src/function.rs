//! Functions whose results are a number per joint: a row of a table each.

use crate::call::RobotCall;
use crate::failure;
use crate::robot::{FleetRobot, RobotUse};
use crate::states::{columns, rows_with_all, States};
use crate::text::RobotFolder;
use datafusion::arrow::array::StructArray;
use datafusion::arrow::datatypes::{DataType, Field, FieldRef, Fields};
use datafusion::common::exec_err;
use datafusion::error::Result;
use datafusion::logical_expr::simplify::{ExprSimplifyResult, SimplifyContext};
use datafusion::logical_expr::{
    ColumnarValue, Expr, ReturnFieldArgs, ScalarFunctionArgs, ScalarUDF, ScalarUDFImpl, Signature,
};
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
    call: RobotCall,
}

impl DynamicsFunction {
    /// That row, of robots from that folder.
    pub fn new(row: &'static DynamicsRow, folder: &RobotFolder) -> DynamicsFunction {
        DynamicsFunction { row, call: RobotCall::new(row.name, row.inputs, RobotUse::Function(row.function), folder) }
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

/// A number per joint.
fn per_joint(robot: &FleetRobot) -> Fields {
    robot.joints.iter().map(|name| Field::new(name, DataType::Float64, true)).collect()
}

impl ScalarUDFImpl for DynamicsFunction {
    fn name(&self) -> &str {
        self.row.name
    }

    fn signature(&self) -> &Signature {
        &self.call.signature
    }

    fn coerce_types(&self, given: &[DataType]) -> Result<Vec<DataType>> {
        self.call.coerced(given)
    }

    fn return_type(&self, _: &[DataType]) -> Result<DataType> {
        exec_err!("the type of `{}` follows from its robot", self.row.name)
    }

    fn return_field_from_args(&self, args: ReturnFieldArgs<'_>) -> Result<FieldRef> {
        let robot = self.call.planned(&args, |robot| self.lengths(robot))?;
        Ok(Arc::new(Field::new(self.row.name, DataType::Struct(per_joint(&robot)), true)))
    }

    fn simplify(&self, args: Vec<Expr>, _: &SimplifyContext) -> Result<ExprSimplifyResult> {
        let function = || ScalarUDF::from(DynamicsFunction { row: self.row, call: self.call.clone() });
        self.call.simplified(args, function)
    }

    fn invoke_with_args(&self, args: ScalarFunctionArgs) -> Result<ColumnarValue> {
        let (robot, arrays) = self.call.executed(&args)?;
        let given = self.call.states(&arrays, &robot, &self.lengths(&robot))?;
        let (rows, nulls) = (args.number_rows, rows_with_all(&given));
        let columns = columns(self.columns(&robot, &given, rows)?, nulls.as_ref());
        let DataType::Struct(fields) = args.return_field.data_type() else {
            return exec_err!("`{}` gives a struct", self.row.name);
        };
        let found = StructArray::try_new_with_length(fields.clone(), columns, nulls, rows)?;
        Ok(ColumnarValue::Array(Arc::new(found)))
    }
}
