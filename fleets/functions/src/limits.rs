//! Which joints' efforts exceed what their drives can do.

use crate::call::RobotCall;
use crate::robot::RobotUse;
use crate::text::RobotFolder;
use datafusion::arrow::array::{ListBuilder, StringBuilder};
use datafusion::arrow::datatypes::{DataType, Field, FieldRef};
use datafusion::common::exec_err;
use datafusion::error::Result;
use datafusion::logical_expr::simplify::{ExprSimplifyResult, SimplifyContext};
use datafusion::logical_expr::{
    ColumnarValue, Expr, ReturnFieldArgs, ScalarFunctionArgs, ScalarUDF, ScalarUDFImpl, Signature,
};
use std::sync::Arc;

const NAME: &str = "torque_limits_exceeded";

/// `torque_limits_exceeded(robot, tau)`: the names of the joints with |τ| greater than the limit of the robot file, in the order of the joints. A joint without a
/// limit, or with the limit 0, exceeds none; an effort that is no number exceeds every one.
#[derive(Debug, PartialEq, Eq, Hash)]
pub struct LimitsExceeded(RobotCall);

impl LimitsExceeded {
    /// Of robots from that folder.
    pub fn new(folder: &RobotFolder) -> LimitsExceeded {
        LimitsExceeded(RobotCall::new(NAME, &["tau"], RobotUse::Joints, folder))
    }
}

impl ScalarUDFImpl for LimitsExceeded {
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
        exec_err!("the type of `{NAME}` follows from its robot")
    }

    fn return_field_from_args(&self, args: ReturnFieldArgs<'_>) -> Result<FieldRef> {
        self.0.planned(&args, |robot| vec![robot.joints.len()])?;
        Ok(Arc::new(Field::new(NAME, DataType::new_list(DataType::Utf8, true), true)))
    }

    fn simplify(&self, args: Vec<Expr>, _: &SimplifyContext) -> Result<ExprSimplifyResult> {
        self.0.simplified(args, || ScalarUDF::from(LimitsExceeded(self.0.clone())))
    }

    fn invoke_with_args(&self, args: ScalarFunctionArgs) -> Result<ColumnarValue> {
        let (robot, arrays) = self.0.executed(&args)?;
        let given = self.0.states(&arrays, &robot, &[robot.joints.len()])?;
        let tau = &given[0];
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
