//! What loops over columns leave for outputs, copied by loops, too.
//!
//! ```text
//! for column in 0..6 {
//!     dqdd_dq[6 + column][0] = y1[column];
//!     dqdd_dq[6 + column][1] = y2[column];
//!     …
//! }
//! ```
//!
//! One after the other such copies would be a twelfth of what a humanoid's derivatives of accelerations are in machine code.

use super::port_of;
use crate::emit::module::{Expression, Index, Statement, Stride};
use std::collections::BTreeMap;
use straightline_graph::expr::Port;

/// Loops of fewer turns are not worth their heads.
const FEWEST: usize = 3;

/// A result that a loop over columns leaves: which number of the array is which result.
pub(super) struct CopiedResult {
    pub array: String,
    pub column: usize,
    pub result: usize,
}

/// Which column goes to which place of its output, and which result that is.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct CopyPlace {
    column: usize,
    at: usize,
    result: usize,
}

/// Copies of one loop: which columns they begin with and how many there are, and how far apart their places are.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct CopyTurns {
    port: usize,
    first: usize,
    count: usize,
    step: usize,
}

/// The statements that copy all of these.
pub(super) fn copies(outputs: &[Port], copies: Vec<CopiedResult>, index: &str) -> Vec<Statement> {
    let mut loops: BTreeMap<CopyTurns, Vec<(usize, String)>> = BTreeMap::new();
    let mut left = copies;
    // neighbours along the outer axis of an output, then along its inner one
    for along_rows in [true, false] {
        let mut lines: BTreeMap<(String, usize, usize), Vec<CopyPlace>> = BTreeMap::new();
        for CopiedResult { array, column, result } in left.drain(..) {
            let (port, at) = port_of(outputs, result);
            let row = row_length(&outputs[port]);
            let line = if along_rows { at % row } else { at / row };
            lines.entry((array, port, line)).or_default().push(CopyPlace { column, at, result });
        }
        for ((array, port, _), mut line) in lines {
            line.sort_unstable();
            let step = if along_rows { row_length(&outputs[port]) } else { 1 };
            for run in line.chunk_by(|a, b| b.column == a.column + 1 && b.at == a.at + step) {
                if run.len() >= FEWEST {
                    let turns = CopyTurns { port, first: run[0].column, count: run.len(), step };
                    loops.entry(turns).or_default().push((run[0].at, array.clone()));
                } else {
                    let alone =
                        |p: &CopyPlace| CopiedResult { array: array.clone(), column: p.column, result: p.result };
                    left.extend(run.iter().map(alone));
                }
            }
        }
    }
    let mut out: Vec<Statement> = loops.into_iter().map(|(turns, list)| a_loop(turns, list, index)).collect();
    out.extend(left.into_iter().map(|CopiedResult { array, column, result }| {
        let (port, at) = port_of(outputs, result);
        Statement::Store { port, at, value: Expression::Element(array, Index::Number(column)) }
    }));
    out
}

/// How many numbers stand side by side before the outer index counts one up; in a list, one.
fn row_length(port: &Port) -> usize {
    match port.shape[..] {
        [_, n] => n,
        _ => 1,
    }
}

fn a_loop(CopyTurns { port, first, count, step }: CopyTurns, mut list: Vec<(usize, String)>, index: &str) -> Statement {
    list.sort_unstable();
    let stride = |first: usize, step: usize| Stride { first, step, index: index.to_string() };
    let copy = |(at, array): (usize, String)| {
        let value = Expression::Element(array, Index::Strided(stride(first, 1)));
        Statement::StoreOfLimb { port, at: stride(at, step), value }
    };
    let body = list.into_iter().map(copy).collect();
    Statement::Limbs { index: index.to_string(), count, is_hidden: false, body }
}
