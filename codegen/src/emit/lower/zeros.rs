//! Zeros among the results, for machines that store one number after the other. LLVM makes one call of a function that fills memory
//! of more than eight of them together; between other results they are stores.

use crate::emit::module::{Expression, Statement};
use straightline_graph::schedule::zeros_together;

/// The statements with all stores of zeros between the other stores.
pub fn spread(statements: Vec<Statement>) -> Vec<Statement> {
    let (zeros, others): (Vec<Statement>, Vec<Statement>) = statements.into_iter().partition(is_zero);
    let stores = others.iter().filter(|s| matches!(s, Statement::Store { .. })).count();
    let together = zeros_together(zeros.len(), stores);
    let mut zeros = zeros.into_iter();
    let mut out = Vec::new();
    for statement in others {
        let is_store = matches!(statement, Statement::Store { .. });
        out.push(statement);
        if is_store {
            out.extend(zeros.by_ref().take(together));
        }
    }
    out.extend(zeros);
    out
}

fn is_zero(statement: &Statement) -> bool {
    matches!(statement, Statement::Store { value: Expression::Constant(c, _), .. } if c.is(0.0))
}
