//! What a rolled loop over limbs takes from outside and puts out.
//!
//! ```text
//! static C1: [[f32; 2]; 4] = [
//!     [0.0875, 1.25],
//!     [-0.0875, 1.25],
//!     …
//! ];
//! for limb in 0..4 {
//!     let (sin_q2, cos_q2) = short_sines::sin_cos_f32(q[7 + 3 * limb]);
//!     …
//!     tau[6 + 3 * limb] = … * C1[limb][0];
//! }
//! ```
//!
//! Constants stand in a row per limb, in the order of their use, so that a processor without vectors reads them from one address. Coordinates
//! are read and results written where they are, if they are equally far apart; what else differs is an array over limbs.

use super::body::{Plan, Statements};
use super::port_of;
use crate::emit::module::{Expression, Index, Statement, Stride};
use straightline_core::Dd;
use straightline_graph::expr::{Alike, Constant, NodeId, Op, Port};

/// Loops of so many operations, all limbs together, stay loops: LLVM writes out up to 300 instructions, a few times as many where constants
/// make them fewer. Solo 12's torques have 1020, its gravity forces 172.
const WRITTEN_OUT: usize = 600;

/// Whether compilers would write a loop out.
pub(super) fn is_short(alike: &Alike) -> bool {
    alike.rows.iter().map(Vec::len).sum::<usize>() < WRITTEN_OUT
}

/// The constants of limbs, a row each.
pub(super) struct Table {
    name: String,
    /// Column by column, in the order of their use.
    columns: Vec<Vec<Expression>>,
    /// How many there will be.
    length: usize,
    is_constant: bool,
}

impl Table {
    /// For these values from outside.
    pub fn new(body: &mut Statements<'_>, outside: &[(NodeId, Vec<NodeId>)]) -> Table {
        let mut columns: Vec<Vec<Expression>> = Vec::new();
        for column in outside.iter().filter_map(|(_, of_limbs)| body.column(of_limbs)) {
            if !is_one(&column) && !columns.contains(&column) {
                columns.push(column);
            }
        }
        let (length, is_constant) = (columns.len(), !body.scope.style.generic);
        let prefix = if is_constant { "C" } else { "c" };
        let name = if columns.is_empty() { String::new() } else { body.names.numbered(prefix) };
        Table { name, columns, length, is_constant }
    }

    /// What stands for these values of the limbs in the loop, if it needs no array over limbs.
    pub fn value(&self, body: &Statements<'_>, of_limbs: &[NodeId], index: &str) -> Option<Expression> {
        if let Some(column) = body.column(of_limbs) {
            if is_one(&column) {
                return column.into_iter().next();
            }
            let entry =
                self.columns.iter().position(|other| *other == column).expect("every column stands in the table");
            let row = Index::Row { index: index.to_string(), length: self.length, entry };
            return Some(Expression::Element(self.name.clone(), row));
        }
        let inputs: Option<Vec<usize>> = of_limbs
            .iter()
            .map(|id| match body.graph.op(*id) {
                Op::Input(k) => Some(k as usize),
                _ => None,
            })
            .collect();
        let (port, at) = stride(&body.graph.inputs, &inputs?, index)?;
        Some(Expression::InputOfLimb { port, at })
    }

    /// The table; nothing where no constant differs.
    pub fn statement(self) -> Option<Statement> {
        let limbs = self.columns.first()?.len();
        let row = |limb: usize| self.columns.iter().map(|column| column[limb].clone()).collect();
        let rows = (0..limbs).map(row).collect();
        Some(Statement::Table { name: self.name, rows, is_constant: self.is_constant })
    }
}

/// Whether all limbs have the same number once it is rounded.
fn is_one(column: &[Expression]) -> bool {
    column.iter().all(|x| *x == column[0])
}

impl Statements<'_> {
    /// These values, if each is a constant of its limb: rounded, as they are written, where it is known to what.
    fn column(&self, of_limbs: &[NodeId]) -> Option<Vec<Expression>> {
        let number = |id: &NodeId| match self.operand(*id) {
            Expression::Constant(c, scalar) if !self.scope.style.generic => {
                let rounded = Constant::new(Dd::from(scalar.nearest(c.value())));
                Some(Expression::Constant(rounded, scalar))
            }
            constant @ Expression::Constant(..) => Some(constant),
            _ => None,
        };
        of_limbs.iter().map(number).collect::<Option<Vec<_>>>().filter(|column| column.len() > 1)
    }

    /// The places of results that limbs may write where they are, one of each.
    pub fn put_out(&self, row: &[NodeId], plan: &Plan<'_>, index: &str) -> Option<(usize, Stride)> {
        let result = |id: &NodeId| {
            let first = plan.results_of.partition_point(|(r, _)| r < id);
            match plan.results_of[first..].iter().take_while(|(r, _)| r == id).collect::<Vec<_>>()[..] {
                [(_, k)] => Some(*k),
                _ => None,
            }
        };
        let places: Option<Vec<usize>> = row.iter().map(result).collect();
        stride(&self.graph.outputs, &places?, index)
    }
}

/// Numbers of one port that are equally far apart, by the turns of a loop.
fn stride(ports: &[Port], numbers: &[usize], index: &str) -> Option<(usize, Stride)> {
    let places: Vec<(usize, usize)> = numbers.iter().map(|k| port_of(ports, *k)).collect();
    let [(port, first), (_, second), ..] = places[..] else { return None };
    let step = second.checked_sub(first).filter(|step| *step > 0)?;
    let is_plain = ports[port].wrapper.is_none() && ports[port].shape.len() == 1;
    let is_regular = places.iter().enumerate().all(|(turn, place)| *place == (port, first + step * turn));
    (is_plain && is_regular).then(|| (port, Stride { first, step, index: index.to_string() }))
}
