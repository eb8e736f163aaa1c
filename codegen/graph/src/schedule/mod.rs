//! The order of the operations, and how a long program is cut into functions of bounded size.
//!
//! rustc and LLVM take more than linear time for one huge function. So a program of
//! more than [`ScheduleLimits::operations`] is cut into parts, each at the place with the fewest values alive within reach of
//! its size; values that cross a cut go through an array of reused slots. A program with loops over lanes stays in its own order, and no loop is
//! cut.

mod annealing;
mod few_alive;
mod machine;
mod steps;

pub use machine::{estimate, CycleModel, ProgramEstimate, ScheduleMachine};
use steps::calls_of_two;

use crate::expr::{Graph, NodeId, Op, Sines};

/// How long one function may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScheduleLimits {
    /// Operations (additions, multiplications, divisions, square roots; a sine-cosine pair counts as 40) in one part.
    pub operations: usize,
}

impl Default for ScheduleLimits {
    fn default() -> Self {
        // Straight-line code runs once through, in whatever parts, so a cut saves no cache; what crosses it goes through memory.
        // HyQ's forward dynamics (3 400 here) takes 455 ns in two parts and 403 in one, Talos' (9 500) 1 478 in four and 1 366 in
        // one. The bound is for compile time, which is about linear up to here.
        ScheduleLimits { operations: 12_000 }
    }
}

/// So many times as long parts of a program with loops over lanes may be: what loops take and leave would go to slots and from there to their
/// arrays. Derivatives of Talos' forward dynamics take 17 µs in one part and 21 in six, and as long to compile.
const WITH_LOOPS: usize = 4;

/// One function of a program.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ProgramPart {
    /// What it computes, in order; neither inputs nor constants.
    pub nodes: Vec<NodeId>,
    /// Values it takes from slots.
    pub loads: Vec<(NodeId, usize)>,
    /// Values it leaves in slots for later parts.
    pub stores: Vec<(NodeId, usize)>,
    /// Which results (indices into [`Graph::results`]) it puts out.
    pub results: Vec<usize>,
    /// Whether text keeps each operation where it stands here, as the order is made for the registers of a machine.
    pub keeps_order: bool,
    /// Whether sines that stand together come from one call, two of them: the first and the second, the third and the fourth, …
    pub sines_by_two: bool,
}

/// A program in its final order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Schedule {
    /// The functions, run one after the other.
    pub parts: Vec<ProgramPart>,
    /// How many slots carry values between them.
    pub slots: usize,
    /// Most values alive at once, inputs and constants not counted.
    pub max_live: usize,
    /// What it takes on the machine that the order is for, by the model that chose the order, where one did.
    pub estimate: Option<ProgramEstimate>,
}

/// How many zeros among the results follow each of the others, where zeros stand apart: a pair of them is stored at once.
pub fn zeros_together(zeros: usize, others: usize) -> usize {
    if others == 0 {
        return zeros;
    }
    zeros.div_ceil(others).next_multiple_of(2)
}

fn is_value(op: Op) -> bool {
    !matches!(op, Op::Input(_) | Op::Constant(_) | Op::AngleSum(..))
}

fn weight(op: Op) -> usize {
    match op {
        Op::SinCos(_) => 40,
        op => usize::from(op.is_counted()),
    }
}

/// Orders and cuts a graph. Operations keep the order in which the algorithm wrote them, unless many values would go through
/// memory; so do programs that are cut. Where the machine is known, the order is searched for its registers, if angles are computed one at a time.
pub fn schedule(graph: &Graph, limits: ScheduleLimits, machine: Option<&ScheduleMachine>) -> Schedule {
    let mut order: Vec<NodeId> = graph.ids().filter(|id| is_value(graph.op(*id))).collect();
    let (mut keeps_order, mut sines_by_two, mut made_for) = (false, false, None);
    if graph.alike.is_empty() && order.iter().map(|id| weight(graph.op(*id))).sum::<usize>() <= limits.operations {
        order = few_alive::improved(graph, order, machine.map(|machine| machine.registers));
        // calls of several angles stay together
        let machine = machine.filter(|_| graph.sines == Sines::Short);
        if let Some(better) = machine.and_then(|machine| annealing::annealed(graph, &order, machine)) {
            (order, keeps_order) = (better, true);
        }
        sines_by_two = keeps_order && machine.is_some_and(|machine| machine.sines_by_two);
        made_for = machine.map(|machine| estimate(graph, &order, &ScheduleMachine { sines_by_two, ..*machine }));
    }
    let limits = match graph.alike.is_empty() {
        true => limits,
        false => ScheduleLimits { operations: limits.operations.saturating_mul(WITH_LOOPS) },
    };
    let position = {
        let mut position = vec![usize::MAX; graph.ops.len()];
        order.iter().enumerate().for_each(|(p, id)| position[id.index()] = p);
        position
    };
    // last use of every value: by an operation, or as a result when it is computed
    let mut last_use: Vec<usize> = position.clone();
    for (p, id) in order.iter().enumerate() {
        for a in graph.op(*id).operands() {
            if position[a.index()] != usize::MAX {
                last_use[a.index()] = p;
            }
        }
    }
    let live_after = {
        let mut change = vec![0isize; order.len() + 1];
        for id in &order {
            change[position[id.index()]] += 1;
            change[last_use[id.index()]] -= 1;
        }
        let mut alive = 0;
        change
            .iter()
            .map(|c| {
                alive += c;
                alive as usize
            })
            .collect::<Vec<_>>()
    };
    let max_live = live_after.iter().copied().max().unwrap_or(0);

    let cuts = cuts(graph, &order, &live_after, limits);
    let part_of = |p: usize| cuts.partition_point(|c| *c <= p);
    let mut parts = vec![ProgramPart { keeps_order, sines_by_two, ..ProgramPart::default() }; cuts.len() + 1];
    for (p, id) in order.iter().enumerate() {
        parts[part_of(p)].nodes.push(*id);
    }
    for (k, r) in graph.results.iter().enumerate() {
        let p = position[r.index()];
        let part = if p == usize::MAX { 0 } else { part_of(p) };
        parts[part].results.push(k);
    }
    let slots = assign_slots(graph, &order, &position, &last_use, &part_of, &mut parts);
    Schedule { parts, slots, max_live, estimate: made_for }
}

/// Positions before which a new part begins.
fn cuts(graph: &Graph, order: &[NodeId], live_after: &[usize], limits: ScheduleLimits) -> Vec<usize> {
    // a row of a loop stands in the text once
    let stretch = graph.stretches();
    let rows = graph.alike.iter().flat_map(|alike| &alike.rows);
    let mut again = vec![false; graph.ops.len()];
    rows.flat_map(|row| &row[1..]).for_each(|id| again[id.index()] = true);
    let weigh = |id: &NodeId| if again[id.index()] { 0 } else { weight(graph.op(*id)) };
    let weights: Vec<usize> = order.iter().map(weigh).collect();
    let in_loop = |p: usize| {
        let of = |p: usize| order.get(p).and_then(|id| stretch[id.index()]);
        of(p).is_some() && of(p) == of(p + 1)
    };
    let mut left: usize = weights.iter().sum();
    let mut cuts = Vec::new();
    let mut start = 0;
    while left > limits.operations {
        // as many parts as needed, of about equal size, cut where the fewest values cross
        let parts = left.div_ceil(limits.operations);
        let aim = left / parts;
        let (low, high) = (aim - aim / 4, limits.operations.min(aim + aim / 4));
        let mut size = 0;
        let mut best = None;
        for p in start..order.len() {
            size += weights[p];
            if size > high {
                break;
            }
            let halves_follow = matches!(graph.op(order[p]), Op::SinCos(_))
                || order.get(p + 1).is_some_and(|n| matches!(graph.op(*n), Op::Sin(_) | Op::Cos(_)));
            if size >= low && !halves_follow && !in_loop(p) && best.is_none_or(|(live, _, _)| live_after[p] < live) {
                best = Some((live_after[p], p + 1, size));
            }
        }
        let Some((_, cut, size)) = best else { break };
        if cut >= order.len() {
            break;
        }
        cuts.push(cut);
        start = cut;
        left -= size;
    }
    cuts
}

/// Gives every value that crosses a cut a slot, free again after the last part that reads it.
fn assign_slots(
    graph: &Graph,
    order: &[NodeId],
    position: &[usize],
    last_use: &[usize],
    part_of: &impl Fn(usize) -> usize,
    parts: &mut [ProgramPart],
) -> usize {
    let mut slot_of = vec![usize::MAX; graph.ops.len()];
    let mut free: Vec<usize> = Vec::new();
    let mut slots = 0;
    let mut busy_until: Vec<(usize, usize)> = Vec::new(); // (last part, slot)
    for (k, part) in parts.iter_mut().enumerate() {
        busy_until.retain(|(last, slot)| {
            let done = *last < k;
            if done {
                free.push(*slot);
            }
            !done
        });
        let mut loaded: Vec<NodeId> = Vec::new();
        for id in &part.nodes {
            for a in graph.op(*id).operands() {
                let p = position[a.index()];
                if p != usize::MAX && part_of(p) < k {
                    loaded.push(a);
                }
            }
        }
        loaded.sort_unstable();
        loaded.dedup();
        part.loads = loaded.into_iter().map(|id| (id, slot_of[id.index()])).collect();
        for id in &part.nodes {
            let last = part_of(last_use[id.index()]);
            // a pair itself is never alive: its halves are
            if last > k && !matches!(graph.op(*id), Op::SinCos(_)) {
                let slot = free.pop().unwrap_or_else(|| {
                    slots += 1;
                    slots - 1
                });
                slot_of[id.index()] = slot;
                busy_until.push((last, slot));
                part.stores.push((*id, slot));
            }
        }
    }
    debug_assert!(order.iter().all(|id| position[id.index()] != usize::MAX));
    slots
}
