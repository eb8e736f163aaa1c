//! What calls of all functions of a robot have in common: the robot's literal is checked and read, its text put in place of its name, and the types of the
//! other arguments are chosen.

use crate::failure;
use crate::robot::{carried, robot, FleetRobot, RobotUse};
use crate::states::{check_type, states, taken_as, States};
use crate::text::{can_be_robot, RobotFolder};
use datafusion::arrow::array::ArrayRef;
use datafusion::arrow::datatypes::DataType;
use datafusion::error::Result;
use datafusion::logical_expr::simplify::ExprSimplifyResult;
use datafusion::logical_expr::{
    ColumnarValue, Expr, ReturnFieldArgs, ScalarFunctionArgs, ScalarUDF, Signature, Volatility,
};
use datafusion::scalar::ScalarValue;
use std::sync::Arc;

/// Calls of one function, of robots from one folder.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct RobotCall {
    /// The function's name in SQL.
    pub name: &'static str,
    /// What it is given, behind the robot.
    inputs: &'static [&'static str],
    /// What of the robot it takes.
    of: RobotUse,
    folder: RobotFolder,
    /// Any types: [`RobotCall::coerced`] chooses.
    pub signature: Signature,
}

impl RobotCall {
    /// Of that function.
    pub fn new(name: &'static str, inputs: &'static [&'static str], of: RobotUse, folder: &RobotFolder) -> RobotCall {
        let signature = Signature::user_defined(Volatility::Immutable);
        RobotCall { name, inputs, of, folder: folder.clone(), signature }
    }

    /// The types that arguments are taken in.
    ///
    /// # Errors
    /// Another number of arguments, or types that are no robot and no numbers.
    pub fn coerced(&self, given: &[DataType]) -> Result<Vec<DataType>> {
        let Some((robot, lists)) = given.split_first().filter(|(_, lists)| lists.len() == self.inputs.len()) else {
            return Err(failure::arguments(self.name, self.inputs, given.len()));
        };
        if !can_be_robot(robot) {
            return Err(failure::no_robot(self.name, &format!("of type {robot}")));
        }
        let taken =
            |(name, kind): (&&str, &DataType)| taken_as(kind).ok_or_else(|| failure::no_numbers(self.name, name, kind));
        let lists = self.inputs.iter().zip(lists).map(taken);
        std::iter::once(Ok(robot.clone())).chain(lists).collect()
    }

    /// The robot of a literal; `None` is what rows compute.
    ///
    /// # Errors
    /// No literal, or what is wrong with it or its robot.
    pub fn robot(&self, literal: Option<&ScalarValue>) -> Result<Arc<FleetRobot>> {
        let literal = literal.ok_or_else(|| failure::robot_of_rows(self.name))?;
        robot(self.name, literal, &self.folder, self.of)
    }

    /// The robot of a call that is planned, whose lists have as many numbers as `lengths` says, as far as their types tell.
    ///
    /// # Errors
    /// As [`RobotCall::robot`], or a list of another length.
    pub fn planned(
        &self,
        args: &ReturnFieldArgs<'_>,
        lengths: impl Fn(&FleetRobot) -> Vec<usize>,
    ) -> Result<Arc<FleetRobot>> {
        let robot = self.robot(args.scalar_arguments.first().copied().flatten())?;
        let lists = self.inputs.iter().zip(&args.arg_fields[1..]).zip(lengths(&robot));
        for ((name, field), length) in lists {
            check_type(name, field.data_type(), &robot, length)?;
        }
        Ok(robot)
    }

    /// The robot of a call that is executed, and its lists as arrays.
    ///
    /// # Errors
    /// As [`RobotCall::robot`].
    pub fn executed(&self, args: &ScalarFunctionArgs) -> Result<(Arc<FleetRobot>, Vec<ArrayRef>)> {
        let literal = match args.args.first() {
            Some(ColumnarValue::Scalar(literal)) => Some(literal),
            _ => None,
        };
        let arrays = args.args[1..].iter().map(|arg| arg.to_array(args.number_rows));
        Ok((self.robot(literal)?, arrays.collect::<Result<_>>()?))
    }

    /// The states in these arrays, of so many numbers each.
    ///
    /// # Errors
    /// A list of another length.
    pub fn states<'a>(&self, arrays: &'a [ArrayRef], robot: &FleetRobot, lengths: &[usize]) -> Result<Vec<States<'a>>> {
        let lists = self.inputs.iter().zip(arrays).zip(lengths);
        lists.map(|((name, array), length)| states(name, array, robot, *length)).collect()
    }

    /// The robot's text in place of its name, in the arguments of a call; whether it was the name.
    ///
    /// # Errors
    /// As [`RobotCall::robot`].
    pub fn carrying(&self, args: &mut [Expr]) -> Result<bool> {
        let Some(Expr::Literal(literal, _)) = args.first_mut() else { return Err(failure::robot_of_rows(self.name)) };
        let text = carried(self.name, literal, &self.folder, self.of)?;
        let is_other = text != *literal;
        *literal = text;
        Ok(is_other)
    }

    /// A call with the robot's text in it, of `function`.
    ///
    /// # Errors
    /// As [`RobotCall::robot`].
    pub fn simplified(&self, mut args: Vec<Expr>, function: impl Fn() -> ScalarUDF) -> Result<ExprSimplifyResult> {
        match self.carrying(&mut args)? {
            false => Ok(ExprSimplifyResult::Original(args)),
            true => Ok(ExprSimplifyResult::Simplified(function().call(args))),
        }
    }
}
