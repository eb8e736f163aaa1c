//! The expression graph: a hash-consed DAG of scalar operations. It knows nothing of what is computed.
//!
//! A [`Graph`] is a value: operations in an order in which operands stand before their users, grouped inputs, grouped
//! outputs. What an operation is stands in the tables of [`op`]. A [`GraphBuilder`] is the only way to make one: it looks every operation up before adding it, so that equal
//! operations are one node, and applies the [rules] on the way in.

mod builder;
mod counts;
mod gradient;
mod graph;
mod interpret;
pub mod op;
pub mod port_text;
pub mod rules;
mod short_loops;
mod verify;

pub use builder::GraphBuilder;
pub use counts::{Counts, DIVISION, TAIL};
pub use gradient::gradient;
pub use graph::{Alike, Constant, Graph, LoopLanes, NodeId, Note, Op, Port, Precision, Section, Sines};
pub(crate) use interpret::of_rounded_sum;
pub use interpret::{evaluate, evaluate_by, values, values_by};
pub use op::{Binary, Unary};
pub use rules::{Folding, Grade, Rule, RuleSet};
pub use short_loops::with_short_loops;
pub use verify::verify;
