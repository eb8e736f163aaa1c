//! Loops over lanes that are short enough for compilers.
//!
//! LLVM tells so many places in memory apart in a loop ([`MOST`]) and no more: beyond, it takes any two of them to be the same, and a loop over lanes
//! stays scalar code. So longer loops become several, one behind the other, cut where few values are needed on both sides.

use super::{Alike, Graph, NodeId};
use rustc_hash::{FxHashMap, FxHashSet};

/// So many arrays a loop may read and write: LLVM's limit is 250 (`alias-set-saturation-threshold`), and a few are its own.
const MOST: usize = 240;
/// Of what fits, the last part in which the best place for a cut is looked for.
const WITHIN: usize = 3;
/// A loop that would be cut into shorter ones than so many rows stays as it is: it is arrays more than operations.
const SHORTEST: usize = 24;

/// The same program with longer loops cut.
#[must_use]
pub fn with_short_loops(graph: Graph) -> Graph {
    let mut used = vec![false; graph.ops.len()];
    let stretch = graph.stretches();
    graph.results.iter().for_each(|id| used[id.index()] = true);
    for (k, op) in graph.ops.iter().enumerate() {
        op.operands().filter(|a| stretch[a.index()] != stretch[k]).for_each(|a| used[a.index()] = true);
    }
    let alike =
        graph
            .alike
            .iter()
            .flat_map(|alike| if alike.is_rolled { vec![alike.clone()] } else { cut(&graph, alike, &used) });
    Graph { alike: alike.collect(), ..graph }
}

/// A loop as several. `used`: which nodes something outside of their loop uses.
fn cut(graph: &Graph, alike: &Alike, used: &[bool]) -> Vec<Alike> {
    let rows = &alike.rows;
    let row_of: FxHashMap<NodeId, usize> = rows.iter().enumerate().map(|(k, row)| (row[0], k)).collect();
    // of each row the rows that it uses, and the arrays from outside
    let (mut inner, mut outer) = (vec![Vec::new(); rows.len()], vec![Vec::new(); rows.len()]);
    let mut last_user: Vec<usize> = (0..rows.len()).collect();
    for (k, row) in rows.iter().enumerate() {
        let operands: Vec<Vec<NodeId>> = row.iter().map(|id| graph.op(*id).operands().collect()).collect();
        for a in 0..operands[0].len() {
            let of_lanes: Vec<NodeId> = operands.iter().map(|o| o[a]).collect();
            match row_of.get(&of_lanes[0]) {
                Some(other) => {
                    inner[k].push(*other);
                    last_user[*other] = k;
                }
                None if of_lanes.iter().any(|id| *id != of_lanes[0]) => outer[k].push(of_lanes),
                None => {}
            }
        }
    }
    for (k, row) in rows.iter().enumerate() {
        if row.iter().any(|id| used[id.index()]) {
            last_user[k] = usize::MAX;
        }
    }
    let mut parts = Vec::new();
    let mut start = 0;
    while start < rows.len() {
        let mut read: FxHashSet<&[NodeId]> = FxHashSet::default();
        let mut loaded: FxHashSet<usize> = FxHashSet::default();
        // how many values are needed behind each end that fits
        let mut crossing: Vec<usize> = Vec::new();
        for end in start + 1..=rows.len() {
            let row = end - 1;
            read.extend(outer[row].iter().map(Vec::as_slice));
            loaded.extend(inner[row].iter().filter(|other| **other < start));
            let left = (start..end).filter(|k| last_user[*k] >= end).count();
            if read.len() + loaded.len() + left > MOST && end > start + 1 {
                break;
            }
            crossing.push(left);
        }
        let fits = crossing.len();
        let end = match start + fits == rows.len() {
            true => rows.len(),
            false => {
                let from = fits - fits / WITHIN;
                let best = (from.saturating_sub(1)..fits).min_by_key(|k| crossing[*k]);
                start + 1 + best.unwrap_or(fits - 1)
            }
        };
        parts.push(Alike { rows: rows[start..end].to_vec(), ..alike.clone() });
        start = end;
    }
    let is_short = |part: &Alike| part.rows.len() < SHORTEST;
    match parts.split_last() {
        Some((_, others)) if others.iter().any(is_short) => vec![alike.clone()],
        _ => parts,
    }
}

#[cfg(test)]
mod tests {
    use super::{with_short_loops, MOST};
    use crate::expr::{verify, Alike, Graph, GraphBuilder, LoopLanes, NodeId, Op, Port, RuleSet};

    /// Four lanes of a chain of so many products, each with a number of its own; every tenth is a result.
    fn chain(length: usize) -> Graph {
        let lanes = 4;
        let mut b = GraphBuilder::new(RuleSet::all(), vec![Port::new("x", &[lanes * (length + 1)])]);
        let x: Vec<NodeId> = (0..lanes * (length + 1)).map(|k| b.insert(Op::Input(k as u32))).collect();
        let mut now: Vec<NodeId> = x[..lanes].to_vec();
        let (mut rows, mut results) = (Vec::new(), Vec::new());
        for k in 0..length {
            now = (0..lanes).map(|lane| b.insert(Op::mul(now[lane], x[lanes * (k + 1) + lane]))).collect();
            rows.push(now.clone());
            if k % 10 == 9 {
                results.extend(&now);
            }
        }
        let outputs = vec![Port::new("y", &[results.len()])];
        let graph = b.finish(outputs, results);
        Graph { alike: vec![Alike { lanes: LoopLanes::Columns(lanes), rows, is_rolled: false }], ..graph }
    }

    #[test]
    fn what_fits_stays_one_loop() {
        let graph = chain(200);
        assert_eq!(with_short_loops(graph.clone()), graph);
    }

    #[test]
    fn longer_loops_are_cut_and_lose_no_row() {
        let graph = chain(1000);
        let short = with_short_loops(graph.clone());
        verify(&short).expect("what a graph promises");
        assert!(short.alike.len() > 1000 / MOST && short.alike.len() < 3 * 1000 / MOST);
        let rows: Vec<Vec<NodeId>> = short.alike.iter().flat_map(|alike| alike.rows.clone()).collect();
        assert_eq!(rows, graph.alike[0].rows);
        // a row takes an array of its own and leaves one of ten; one value comes from the loop before, one goes on
        for alike in &short.alike {
            let of_results = alike.rows.iter().filter(|row| graph.results.contains(&row[0])).count();
            assert!(alike.rows.len() + of_results + 2 <= MOST);
        }
    }

    #[test]
    fn rolled_loops_stay() {
        let mut graph = chain(1000);
        graph.alike[0].is_rolled = true;
        assert_eq!(with_short_loops(graph.clone()), graph);
    }
}
