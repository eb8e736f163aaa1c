//! An order in which few values are alive at once, so that few go through memory.
//!
//! Greedy, as in instruction scheduling for few registers (Goodman and Hsu 1988): of the operations whose operands are there, the
//! one that ends most values comes first, and of equals the one that the algorithm wrote first. Sines and cosines stay at the
//! beginning, where calls take several angles.

use super::is_value;
use crate::expr::{Graph, NodeId, Op};

/// Registers that constants and inputs pass through.
const MOMENTS: usize = 2;
/// Registers of the machine that reloads are counted for; vectors of 512 bits have twice as many.
const REGISTERS: usize = 16;
/// Programs with fewer reloads keep the order in which a reader finds one section after the other.
const FEW: usize = 100;

/// The same operations in such an order, if that saves reloads in a program that has many.
pub(super) fn improved(graph: &Graph, written: Vec<NodeId>, registers: Option<usize>) -> Vec<NodeId> {
    let flow = Flow::new(graph, &written);
    // on a machine that is known every reload counts; constants and inputs take a register for a moment
    let (registers, few) = registers.map_or((REGISTERS, FEW), |n| (n - MOMENTS, 1));
    let before = flow.reloads(&written, registers);
    if before < few {
        return written;
    }
    let order = flow.greedy(graph, &written);
    if flow.reloads(&order, registers) < before {
        order
    } else {
        written
    }
}

/// Which operation takes which.
struct Flow {
    /// Of every node the operations whose values it takes, once each; a sum of angles passes on what it takes.
    operands: Vec<Vec<usize>>,
    /// Of every node the operations that take it.
    users: Vec<Vec<usize>>,
}

impl Flow {
    fn new(graph: &Graph, written: &[NodeId]) -> Flow {
        let mut flow = Flow { operands: vec![Vec::new(); graph.ops.len()], users: vec![Vec::new(); graph.ops.len()] };
        for id in written {
            let mut open: Vec<NodeId> = graph.op(*id).operands().collect();
            let operands = &mut flow.operands[id.index()];
            while let Some(a) = open.pop() {
                match graph.op(a) {
                    Op::AngleSum(..) => open.extend(graph.op(a).operands()),
                    op if is_value(op) => operands.push(a.index()),
                    _ => (),
                }
            }
            operands.sort_unstable();
            operands.dedup();
            for a in operands {
                flow.users[*a].push(id.index());
            }
        }
        flow
    }

    fn greedy(&self, graph: &Graph, written: &[NodeId]) -> Vec<NodeId> {
        let mut order = self.with_operands(graph, written);
        let mut placed = vec![false; graph.ops.len()];
        order.iter().for_each(|id| placed[id.index()] = true);
        // of every value the users that are left, of every operation the operands that are not there
        let left = |placed: &[bool], of: &[usize]| of.iter().filter(|i| !placed[**i]).count();
        let mut users_left: Vec<usize> = self.users.iter().map(|of| left(&placed, of)).collect();
        let mut missing: Vec<usize> = self.operands.iter().map(|of| left(&placed, of)).collect();
        // in the order in which they are written
        let mut ready: Vec<NodeId> =
            written.iter().copied().filter(|id| !placed[id.index()] && missing[id.index()] == 0).collect();
        while !ready.is_empty() {
            let gain = |id: &NodeId| {
                let ends = self.operands[id.index()].iter().filter(|a| users_left[**a] == 1).count();
                ends as isize - isize::from(!self.users[id.index()].is_empty())
            };
            let best = (0..ready.len()).max_by_key(|k| (gain(&ready[*k]), std::cmp::Reverse(ready[*k])));
            let id = ready.remove(best.expect("some are ready"));
            order.push(id);
            for a in &self.operands[id.index()] {
                users_left[*a] -= 1;
            }
            for user in &self.users[id.index()] {
                missing[*user] -= 1;
                if missing[*user] == 0 {
                    ready.push(NodeId(*user as u32));
                }
            }
        }
        order
    }

    /// Sines and cosines and what they take, as written.
    fn with_operands(&self, graph: &Graph, written: &[NodeId]) -> Vec<NodeId> {
        let mut wanted = vec![false; graph.ops.len()];
        for id in written.iter().rev() {
            wanted[id.index()] |= matches!(graph.op(*id), Op::SinCos(_) | Op::Sin(_) | Op::Cos(_));
            if wanted[id.index()] {
                self.operands[id.index()].iter().for_each(|a| wanted[*a] = true);
            }
        }
        written.iter().copied().filter(|id| wanted[id.index()]).collect()
    }

    /// How many values are loaded again after they had to leave the registers, if always the one leaves that is needed last
    /// (Belady 1966).
    fn reloads(&self, order: &[NodeId], most: usize) -> usize {
        let mut position = vec![usize::MAX; self.users.len()];
        order.iter().enumerate().for_each(|(p, id)| position[id.index()] = p);
        let mut uses: Vec<Vec<usize>> = self.users.clone();
        for of in &mut uses {
            of.iter_mut().for_each(|user| *user = position[*user]);
            // the next one is the last of the list
            of.sort_unstable_by_key(|p| std::cmp::Reverse(*p));
        }
        let mut registers: Vec<usize> = Vec::new();
        let mut reloads = 0;
        for id in order {
            for a in &self.operands[id.index()] {
                uses[*a].pop();
                if !registers.contains(a) {
                    reloads += 1;
                    registers.push(*a);
                }
            }
            registers.push(id.index());
            registers.retain(|r| !uses[*r].is_empty());
            while registers.len() > most {
                let last = (0..registers.len()).max_by_key(|k| uses[registers[*k]].last().copied());
                registers.swap_remove(last.expect("there are registers"));
            }
        }
        reloads
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::{GraphBuilder, Port, RuleSet};

    /// n products with x₀ first, then their sum, times sin x₁ and cos x₁.
    fn products_first(n: usize) -> Graph {
        let mut b = GraphBuilder::new(RuleSet::all(), vec![Port::new("x", &[n + 2])]);
        let x: Vec<NodeId> = (0..n + 2).map(|k| b.insert(Op::Input(k as u32))).collect();
        let products: Vec<NodeId> = (0..n).map(|k| b.add(Op::mul(x[0], x[k + 2]))).collect();
        let mut sum = products[0];
        for product in &products[1..] {
            sum = b.add(Op::add(sum, *product));
        }
        let pair = b.add(Op::SinCos(x[1]));
        let (sine, cosine) = (b.add(Op::Sin(pair)), b.add(Op::Cos(pair)));
        let results = vec![b.add(Op::mul(sum, sine)), b.add(Op::mul(sum, cosine))];
        b.finish(vec![Port::new("y", &[2])], results)
    }

    fn written(graph: &Graph) -> Vec<NodeId> {
        graph.ids().filter(|id| is_value(graph.op(*id))).collect()
    }

    #[test]
    fn many_values_that_wait_are_computed_when_they_are_needed() {
        let graph = products_first(200);
        let before = written(&graph);
        let after = improved(&graph, before.clone(), None);
        let flow = Flow::new(&graph, &before);
        // all but those that the registers hold wait in memory
        assert!(flow.reloads(&before, REGISTERS) >= 200 - REGISTERS, "{}", flow.reloads(&before, REGISTERS));
        assert_eq!(flow.reloads(&after, REGISTERS), 0);
        let mut placed = vec![false; graph.ops.len()];
        for id in &after {
            assert!(flow.operands[id.index()].iter().all(|a| placed[*a]), "{id:?} comes before what it takes");
            assert!(!std::mem::replace(&mut placed[id.index()], true), "{id:?} comes twice");
        }
        assert_eq!(after.len(), before.len());
        assert!(matches!(graph.op(after[0]), Op::SinCos(_)), "sines stay at the beginning");
    }

    #[test]
    fn a_program_with_few_reloads_stays_as_it_is_written() {
        let graph = products_first(FEW);
        let before = written(&graph);
        assert!(Flow::new(&graph, &before).reloads(&before, REGISTERS) < FEW);
        assert_eq!(improved(&graph, before.clone(), None), before);
    }
}
