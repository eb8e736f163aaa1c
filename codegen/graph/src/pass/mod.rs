//! Passes: each takes a graph and returns a graph that computes the same results.
//!
//! They make other nodes. What is said of single nodes besides their [notes](crate::expr::Note), the formats of mixed precision, loops over
//! limbs and the kernel of sines, is therefore chosen after them, and a pass refuses a graph that has any.

pub mod cut;
mod dead_code;
mod order;
mod substitute;
mod sums;
mod unread_inputs;

pub use dead_code::dead_code;
pub use order::order;
pub use substitute::substitute;
pub use sums::{count_sums, sums};
pub use unread_inputs::unread_inputs;

#[cfg(test)]
mod tests {
    use crate::expr::{gradient, Alike, Graph, GraphBuilder, LoopLanes, Op, Port, Precision, RuleSet, Sines};
    use crate::number::Scalar;
    use std::panic::catch_unwind;

    type Pass = fn(&Graph);

    const PASSES: [(&str, Pass); 6] = [
        ("cut", |graph| drop(super::cut::cut(graph, &[0], &["all"], &[1]))),
        ("dead_code", |graph| drop(super::dead_code(graph))),
        ("order", |graph| drop(super::order(graph, &[]))),
        ("substitute", |graph| drop(super::substitute(graph, 3000, &|_| true))),
        ("sums", |graph| drop(super::sums(graph))),
        ("gradient", |graph| drop(gradient(graph, "x"))),
    ];

    #[test]
    fn no_pass_loses_formats_loops_or_sines_without_a_word() {
        let mut b = GraphBuilder::new(RuleSet::all(), vec![Port::new("x", &[1])]);
        let x = b.insert(Op::Input(0));
        let square = b.insert(Op::mul(x, x));
        let plain = b.finish(vec![Port::new("y", &[1])], vec![square]);
        let mixed = Graph { formats: vec![Precision::of(Scalar::F32); 2], ..plain.clone() };
        let looped = Graph {
            alike: vec![Alike { lanes: LoopLanes::Limbs(vec![0]), rows: vec![vec![square]], is_rolled: false }],
            ..plain.clone()
        };
        let short = Graph { sines: Sines::Short, ..plain.clone() };
        for (name, pass) in PASSES {
            pass(&plain);
            for (graph, lost) in [(&mixed, "formats"), (&looped, "loops"), (&short, "sines")] {
                let panic = catch_unwind(|| pass(graph)).expect_err(name);
                let message = panic.downcast_ref::<String>().expect("a promise in words");
                assert!(message.contains(name) && message.contains(lost), "{name}: {message}");
            }
        }
    }
}
