//! What is written, before it is text: functions of statements and expressions, which any language can write, and what stands around them.

use super::Style;
use crate::function::{ContactFunction, Function};
use crate::program::staged::StageType;
use crate::program::written::DriveNumbers;
use straightline_graph::expr::{Binary, Constant, Port, Sines, Unary};
use straightline_graph::Scalar;

/// A function of straight-line code, and the private ones that it calls one after the other where it is long.
#[derive(Clone, Debug, PartialEq)]
pub struct Routine {
    /// The identifier that callers use.
    pub name: String,
    /// What stands above it, line by line.
    pub doc: String,
    /// Who can call it.
    pub access: Access,
    /// Over what, and in which operations.
    pub style: Style,
    /// The inputs and outputs of its program, of which it may have some only.
    pub ports: Ports,
    /// What it takes, in order.
    pub parameters: Vec<RoutineParameter>,
    /// What it does.
    pub body: Vec<Statement>,
    /// What it calls ([`Statement::Part`]).
    pub parts: Vec<Routine>,
}

/// Who can call a function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Whoever has the output.
    Public,
    /// The output itself.
    Private,
    /// The function that it is a part of.
    Part,
}

/// The inputs and outputs of a program.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ports {
    /// What it reads.
    pub inputs: Vec<Port>,
    /// What it writes.
    pub outputs: Vec<Port>,
}

/// A parameter of a function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RoutineParameter {
    /// An input of the program, by its place among them.
    Input {
        /// The place.
        port: usize,
        /// Whether anything of it is read.
        is_read: bool,
    },
    /// The values that parts hand on to each other.
    Live {
        /// How many.
        slots: usize,
        /// Whether this part hands on any.
        is_written: bool,
    },
    /// An output of the program, by its place among them.
    Output {
        /// The place.
        port: usize,
    },
}

/// A statement.
#[derive(Clone, Debug, PartialEq)]
pub enum Statement {
    /// What the statements after it do.
    Comment(String),
    /// Locals whose values follow.
    Declare(Vec<(String, Scalar)>),
    /// The value of a declared local.
    Set(String, Expression),
    /// A result: number `at` of output `port`.
    Store {
        /// The output.
        port: usize,
        /// The number, counted through its array.
        at: usize,
        /// Its value.
        value: Expression,
    },
    /// The array of values that parts hand on, filled with something.
    Live {
        /// How many.
        slots: usize,
        /// What it holds before.
        filler: Expression,
    },
    /// A call of a part, by its place among them.
    Part(usize),
    /// Locals from what parts hand on.
    Load(Vec<(String, usize)>),
    /// A value that is handed on to other parts.
    Keep {
        /// Where.
        slot: usize,
        /// The value.
        value: Expression,
    },
    /// Sines and cosines of angles, each a sum of terms, by one call of a kernel; locals for those that are used. Short ones are of one angle.
    SinCos {
        /// The kernel.
        kernel: Sines,
        /// Locals of the sines.
        sines: Vec<Option<String>>,
        /// Locals of the cosines.
        cosines: Vec<Option<String>>,
        /// The terms of every angle.
        angles: Vec<Vec<Expression>>,
    },
    /// An array of these values.
    Array {
        /// The identifier of the array.
        name: String,
        /// Its values; of constants it needs no code.
        values: Vec<Expression>,
        /// Whether they are constants.
        is_constant: bool,
    },
    /// An array that a loop fills.
    Room {
        /// The identifier of the array.
        name: String,
        /// What it holds before.
        filler: Expression,
        /// How many.
        count: usize,
    },
    /// A value of such an array in the loop.
    Put {
        /// The array.
        array: String,
        /// The loop's index.
        index: String,
        /// The value.
        value: Expression,
    },
    /// An array of as many rows as a loop over limbs has turns.
    Table {
        /// The identifier of the array.
        name: String,
        /// The rows, one per limb; of constants they need no code.
        rows: Vec<Vec<Expression>>,
        /// Whether they are constants.
        is_constant: bool,
    },
    /// A result in a loop over limbs.
    StoreOfLimb {
        /// The output.
        port: usize,
        /// The number.
        at: Stride,
        /// Its value.
        value: Expression,
    },
    /// The same for every lane.
    Lanes(Vec<Statement>),
    /// The same for every limb.
    Limbs {
        /// The loop's index.
        index: String,
        /// How many.
        count: usize,
        /// Whether compilers are kept from writing it out, as they would.
        is_hidden: bool,
        /// What is done.
        body: Vec<Statement>,
    },
}

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub enum Expression {
    /// 0.
    Zero,
    /// A constant in a scalar type.
    Constant(Constant, Scalar),
    /// A local.
    Local(String),
    /// Number `at` of input `port`.
    Input {
        /// The input.
        port: usize,
        /// The number, counted through its array.
        at: usize,
    },
    /// In a loop over limbs a number of input `port`.
    InputOfLimb {
        /// The input.
        port: usize,
        /// The number.
        at: Stride,
    },
    /// A value that parts hand on.
    Slot(usize),
    /// A number of an array over limbs.
    Element(String, Index),
    /// An operation on one number.
    Unary(Unary, Box<Expression>),
    /// An operation on two numbers.
    Binary(Binary, Box<Expression>, Box<Expression>),
    /// ±a·b ± c in one rounding.
    Fused {
        /// a and b.
        factors: [Box<Expression>; 2],
        /// Whether the product is subtracted.
        is_negated: bool,
        /// c.
        term: Box<Expression>,
        /// Whether c is subtracted.
        is_subtracted: bool,
    },
    /// The same number in a wider scalar type.
    Widened(Scalar, Box<Expression>),
    /// The nearest number of a narrower scalar type.
    Rounded(Scalar, Box<Expression>),
}

/// Which number of an array.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Index {
    /// This one.
    Number(usize),
    /// That of the loop with this index.
    Loop(String),
    /// As far apart as this, by the turns of a loop.
    Strided(Stride),
    /// In the row of the loop with this index, of rows of so many numbers, this one.
    Row {
        /// The loop's index.
        index: String,
        /// How many numbers a row has.
        length: usize,
        /// Which one.
        entry: usize,
    },
}

/// In an array the place of each turn of a loop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stride {
    /// Of the first turn.
    pub first: usize,
    /// From one turn to the next.
    pub step: usize,
    /// The loop's index.
    pub index: String,
}

impl Expression {
    /// Whether it, or anything in it, is so.
    pub fn any(&self, is_so: &mut dyn FnMut(&Expression) -> bool) -> bool {
        let inner: &[&Expression] = match self {
            Expression::Unary(_, a) | Expression::Widened(_, a) | Expression::Rounded(_, a) => &[a],
            Expression::Binary(_, a, b) => &[a, b],
            Expression::Fused { factors: [a, b], term, .. } => &[a, b, term],
            _ => &[],
        };
        is_so(self) || inner.iter().any(|e| e.any(is_so))
    }
}

impl Statement {
    /// Whether an expression in it is so, or it is a statement that is so.
    fn any(&self, is_so: &mut dyn FnMut(&Statement) -> bool, of: &mut dyn FnMut(&Expression) -> bool) -> bool {
        is_so(self)
            || match self {
                Statement::Set(_, value) | Statement::Store { value, .. } | Statement::Keep { value, .. } => {
                    value.any(of)
                }
                Statement::Put { value, .. } | Statement::StoreOfLimb { value, .. } => value.any(of),
                Statement::Table { rows, .. } => rows.iter().flatten().any(|value| value.any(of)),
                Statement::SinCos { angles, .. } => angles.iter().flatten().any(|term| term.any(of)),
                Statement::Array { values, .. } => values.iter().any(|value| value.any(of)),
                Statement::Lanes(body) | Statement::Limbs { body, .. } => body.iter().any(|s| s.any(is_so, of)),
                _ => false,
            }
    }
}

impl Routine {
    /// Whether it calls the kernel of precise sines, of cosines and roots.
    pub fn calls_kernel(&self) -> bool {
        let mut is_pair = |s: &Statement| matches!(s, Statement::SinCos { kernel: Sines::Precise, .. });
        let mut is_call = |e: &Expression| match e {
            Expression::Unary(op, _) => op.row().is_a_call(),
            Expression::Binary(op, ..) => op.row().is_a_call(),
            _ => false,
        };
        let here = !self.style.generic && self.body.iter().any(|s| s.any(&mut is_pair, &mut is_call));
        here || self.parts.iter().any(Routine::calls_kernel)
    }

    /// Whether it calls the kernel of short sines.
    pub fn calls_short_sines(&self) -> bool {
        let mut is_pair = |s: &Statement| matches!(s, Statement::SinCos { kernel: Sines::Short, .. });
        self.body.iter().any(|s| s.any(&mut is_pair, &mut |_| false))
            || self.parts.iter().any(Routine::calls_short_sines)
    }

    /// The same for its own output alone.
    #[must_use]
    pub fn private(self) -> Routine {
        Routine { access: Access::Private, ..self }
    }
}

/// A function of the robot, or of the robot in contact, in all its forms.
#[derive(Clone, Debug)]
pub struct Item<F = Function> {
    /// Which one.
    pub function: F,
    /// It.
    pub routine: Routine,
    /// It, as it is written.
    pub text: String,
    /// What bounds its errors at a state, where that is asked for.
    pub bound: Option<StateCertificate>,
    /// Its body over lanes, where that is asked for.
    pub lanes: Option<Routine>,
}

/// What bounds errors at a state, or why there is none.
pub type StateCertificate = Result<Routine, String>;

impl<F> Item<F> {
    /// The identifier of the function of one state; its other forms begin with it.
    pub fn name(&self) -> &str {
        &self.routine.name
    }

    /// What it takes.
    pub fn inputs(&self) -> &[Port] {
        &self.routine.ports.inputs
    }

    /// What it puts out.
    pub fn outputs(&self) -> &[Port] {
        &self.routine.ports.outputs
    }

    /// Whether one of its forms calls the kernel of precise sines, of cosines and roots.
    pub fn calls_kernel(&self) -> bool {
        self.forms().any(Routine::calls_kernel)
    }

    /// Whether one of its forms calls the kernel of short sines.
    pub fn calls_short_sines(&self) -> bool {
        self.forms().any(Routine::calls_short_sines)
    }

    fn forms(&self) -> impl Iterator<Item = &Routine> {
        [&self.routine].into_iter().chain(self.bound.iter().flatten()).chain(&self.lanes)
    }
}

/// The type of a run-time parameter.
#[derive(Clone, Debug)]
pub struct ParameterType {
    /// The identifier of the type.
    pub name: String,
    /// What functions call the input.
    pub input: String,
    /// How many numbers it holds.
    pub scalars: usize,
    /// What makes these of the numbers that people give.
    pub constructor: Routine,
    /// What it is.
    pub of: ParameterOf,
}

/// What a run-time parameter is.
#[derive(Clone, Debug)]
pub enum ParameterOf {
    /// A body on this frame.
    Body(String),
    /// This drive, with its free numbers.
    Drive(String, DriveNumbers),
}

/// The functions of the robot in stages.
#[derive(Clone, Debug)]
pub struct StagedModule {
    /// The stages, the last of which stores nothing.
    pub stages: Vec<StageType>,
    /// What computes the values of the others.
    pub values: Vec<Routine>,
    /// The functions, each with the stage whose method it is.
    pub functions: Vec<(Function, usize, Routine)>,
}

/// The functions of a contact mode.
#[derive(Clone, Debug)]
pub struct ModeModule {
    /// Its name in generated code.
    pub identifier: String,
    /// Its name in the scene.
    pub name: String,
    /// Its constrained coordinates.
    pub constrained: Vec<String>,
    /// Its free coordinates.
    pub free: Vec<String>,
    /// Its functions.
    pub items: Vec<Item<ContactFunction>>,
}
