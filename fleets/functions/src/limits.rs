//! Which joints' efforts exceed what their drives can do.

use crate::failure;
use crate::function::{carrying, coerced};
use crate::robot::{robot, RobotUse};
use crate::states::{check_type, states};
use crate::text::RobotFolder;
use datafusion::arrow::array::{ListBuilder, StringBuilder};
use datafusion::arrow::datatypes::{DataType, Field, FieldRef};
use datafusion::common::exec_err;
use datafusion::error::Result;
use datafusion::logical_expr::simplify::{ExprSimplifyResult, SimplifyContext};
use datafusion::logical_expr::{
    ColumnarValue, Expr, ReturnFieldArgs, ScalarFunctionArgs, ScalarUDF, ScalarUDFImpl, Signature, Volatility,
};
use std::sync::Arc;

const NAME: &str = "torque_limits_exceeded";
const INPUTS: [&str; 1] = ["tau"];

/// `torque_limits_exceeded(robot, tau)`: the names of the joints with |τ| greater than the limit of the robot file, in the order of the joints. A joint without a
/// limit, or with the limit 0, exceeds none; an effort that is no number exceeds every one.
#[derive(Debug, PartialEq, Eq, Hash)]
pub struct LimitsExceeded {
    folder: RobotFolder,
    signature: Signature,
}

impl LimitsExceeded {
    /// Of robots from that folder.
    pub fn new(folder: RobotFolder) -> LimitsExceeded {
        LimitsExceeded { folder, signature: Signature::user_defined(Volatility::Immutable) }
    }
}

impl ScalarUDFImpl for LimitsExceeded {
    fn name(&self) -> &str {
        NAME
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn coerce_types(&self, given: &[DataType]) -> Result<Vec<DataType>> {
        coerced(NAME, &INPUTS, given)
    }

    fn return_type(&self, _: &[DataType]) -> Result<DataType> {
        exec_err!("the type of `{NAME}` follows from its robot")
    }

    fn return_field_from_args(&self, args: ReturnFieldArgs<'_>) -> Result<FieldRef> {
        let Some(literal) = args.scalar_arguments.first().copied().flatten() else {
            return Err(failure::robot_of_rows(NAME));
        };
        let robot = robot(NAME, literal, &self.folder, RobotUse::Joints)?;
        check_type(INPUTS[0], args.arg_fields[1].data_type(), &robot, robot.joints.len())?;
        Ok(Arc::new(Field::new(NAME, DataType::new_list(DataType::Utf8, true), true)))
    }

    fn simplify(&self, mut args: Vec<Expr>, _: &SimplifyContext) -> Result<ExprSimplifyResult> {
        match carrying(NAME, &mut args, &self.folder, RobotUse::Joints)? {
            false => Ok(ExprSimplifyResult::Original(args)),
            true => {
                let function = ScalarUDF::from(LimitsExceeded::new(self.folder.clone()));
                Ok(ExprSimplifyResult::Simplified(function.call(args)))
            }
        }
    }

    fn invoke_with_args(&self, args: ScalarFunctionArgs) -> Result<ColumnarValue> {
        let Some(ColumnarValue::Scalar(literal)) = args.args.first() else {
            return Err(failure::robot_of_rows(NAME));
        };
        let robot = robot(NAME, literal, &self.folder, RobotUse::Joints)?;
        let tau = args.args[1].to_array(args.number_rows)?;
        let tau = states(INPUTS[0], &tau, &robot, robot.joints.len())?;
        let mut lists = ListBuilder::new(StringBuilder::new());
        for row in 0..args.number_rows {
            let is_there = tau.nulls.as_ref().is_none_or(|nulls| nulls.is_valid(row));
            for (joint, name) in robot.joints.iter().enumerate().filter(|_| is_there) {
                let (size, most) = (tau.at(row, joint).abs(), robot.efforts[joint]);
                // what is no number is within no limit
                if size > most || (size.is_nan() && most.is_finite()) {
                    lists.values().append_value(name);
                }
            }
            lists.append(is_there);
        }
        Ok(ColumnarValue::Array(Arc::new(lists.finish())))
    }
}
