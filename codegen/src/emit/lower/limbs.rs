//! What is alike for several limbs, or columns, as a loop over them.
//!
//! ```text
//! static C1: [f64; 4] = [0.0875, -0.0875, 0.0875, -0.0875];
//! let sin_qs2: [f64; 4] = [sin_q2, sin_q5, sin_q8, sin_q11];
//! let mut forces1_x = [0.0; 4];
//! for limb in 0..4 {
//!     …
//!     forces1_x[limb] = …;
//! }
//! ```
//!
//! What differs from limb to limb is an array over limbs, what does not a local from before the loop. LLVM's loop vectoriser makes
//! vector instructions of the body, as of functions over lanes. Rolled loops (`rolled.rs`) have a row of constants per limb instead. Of columns the
//! arrays stand at the beginning, and each number goes there as soon as it is computed.

use super::body::{Left, Plan, Statements};
use super::copies::{copies, CopiedResult};
use super::rolled::{is_short, Table};
use super::Lowering;
use crate::emit::module::{Expression, Index, Statement};
use rustc_hash::{FxHashMap, FxHashSet};
use straightline_graph::expr::{Alike, Graph, LoopLanes, NodeId, Op, Section};
use straightline_graph::schedule::ProgramPart;

impl Statements<'_> {
    /// The statements of a part, with loops over limbs.
    pub(super) fn with_loops(&mut self, plan: &mut Plan<'_>, lowering: &Lowering<'_>, out: &mut Vec<Statement>) {
        let graph = self.graph;
        let stretch = graph.stretches();
        let nodes = &plan.part.nodes;
        // what another stretch uses has a name
        let mut used_across = vec![false; graph.ops.len()];
        for id in nodes {
            for a in graph.op(*id).operands().filter(|a| stretch[a.index()] != stretch[id.index()]) {
                used_across[a.index()] = true;
            }
        }
        let stores = plan.part.stores.iter().filter(|(id, _)| stretch[id.index()].is_some());
        stores.for_each(|(id, _)| used_across[id.index()] = true);
        let is_operand = used_across.clone();
        plan.results_of.iter().for_each(|(id, _)| used_across[id.index()] |= stretch[id.index()].is_some());
        for id in nodes.iter().filter(|id| stretch[id.index()].is_none()) {
            plan.crosses[id.index()] |= used_across[id.index()];
        }
        self.gather_columns(plan, &used_across, out);
        let mut done = 0;
        while done < nodes.len() {
            let here = stretch[nodes[done].index()];
            let count = nodes[done..].iter().take_while(|id| stretch[id.index()] == here).count();
            match here {
                None => self.run(&nodes[done..done + count], plan, lowering, out),
                Some(k) => self.limb_loop(&graph.alike[k], plan, (&used_across, &is_operand), lowering, out),
            }
            done += count;
        }
    }

    /// Makes room for what loops over columns take: each number goes there as soon as it is computed, so that it waits in no register.
    fn gather_columns(&mut self, plan: &mut Plan<'_>, used_across: &[bool], out: &mut Vec<Statement>) {
        let filler = self.filler(plan.part);
        let here: FxHashSet<NodeId> = plan.part.nodes.iter().copied().collect();
        for alike in self.graph.alike.iter().filter(|alike| here.contains(&alike.rows[0][0])) {
            let LoopLanes::Columns(columns) = alike.lanes else { continue };
            for (_, of_columns) in Loop::new(self.graph, alike, used_across).outside {
                let are_constants = of_columns.iter().all(|id| matches!(self.graph.op(*id), Op::Constant(_)));
                if of_columns.len() < 2 || are_constants || plan.arrays.contains_key(&of_columns) {
                    continue;
                }
                let name = self.names.numbered("x");
                let count = padded(columns);
                out.push(Statement::Room { name: name.clone(), filler: filler.clone(), count });
                // columns that nobody reads are the last one again
                let last = of_columns.last().into_iter().cycle();
                for (column, id) in of_columns.iter().chain(last).take(count).enumerate() {
                    plan.gathered.entry(*id).or_default().push((name.clone(), column));
                    if self.graph.op(*id).is_leaf() || self.values[id.index()].is_some() {
                        let value = self.operand(*id);
                        out.push(Statement::Put { array: name.clone(), index: column.to_string(), value });
                    }
                }
                plan.arrays.insert(of_columns, name);
            }
        }
    }

    fn limb_loop(
        &mut self,
        alike: &Alike,
        plan: &Plan<'_>,
        (used_across, is_operand): (&[bool], &[bool]),
        lowering: &Lowering<'_>,
        out: &mut Vec<Statement>,
    ) {
        let lanes = alike.lanes.count();
        // an odd lane stands beside one that nobody reads, a pair beside two: half a vector would take longer, and a loop of two turns is
        // written out
        let (index, count) = match &alike.lanes {
            LoopLanes::Limbs(limbs) => {
                let title = |body: &usize| (lowering.title)(Section { phase: "limb", index: Some(*body) });
                out.extend(limbs.iter().map(|body| Statement::Comment(title(body))));
                let count = match lanes {
                    _ if alike.is_rolled => lanes,
                    2 => 4,
                    _ => lanes.next_multiple_of(2),
                };
                ("limb", count)
            }
            LoopLanes::Columns(columns) => {
                out.push(Statement::Comment(format!("{columns} columns")));
                ("column", padded(*columns))
            }
        };
        let index = self.names.free(index);
        let Loop { graph, part, outside, results } = Loop::new(self.graph, alike, used_across);

        let turns = Turns { index, count, is_rolled: alike.is_rolled };
        let values = self.taken_by_limbs(&outside, &turns, plan, out);
        let (left, names) = self.left_behind(&results, &turns, plan, is_operand, out);

        let own = std::mem::take(&mut self.names);
        let (mut inner, absorbed) = Statements::new(&graph, &part, self.scope, self.target, own);
        for (node, value) in values {
            inner.values[node.index()] = Some(value);
        }
        let mut uses = vec![0u32; graph.ops.len()];
        let mut crosses = vec![false; graph.ops.len()];
        for id in &part.nodes {
            graph.op(*id).operands().for_each(|a| uses[a.index()] += 1);
        }
        for (node, _) in &results {
            crosses[node.index()] = uses[node.index()] > 0;
        }
        let plan_of_loop = Plan {
            part: &part,
            uses,
            results_of: Vec::new(),
            crosses,
            absorbed,
            stays: vec![false; graph.ops.len()],
            left,
            gathered: FxHashMap::default(),
            arrays: FxHashMap::default(),
        };
        let mut body = Vec::new();
        inner.run(&part.nodes, &plan_of_loop, lowering, &mut body);
        self.names = std::mem::take(&mut inner.names);
        let is_hidden = alike.is_rolled && is_short(alike);
        out.push(Statement::Limbs { index: turns.index.clone(), count, is_hidden, body });
        self.hand_out(&results, names, plan, (alike, &turns.index), out);
    }

    /// What a loop left in arrays goes to where it is taken from.
    fn hand_out(
        &mut self,
        results: &[(NodeId, Vec<NodeId>)],
        names: Vec<Option<String>>,
        plan: &Plan<'_>,
        (alike, index): (&Alike, &str),
        out: &mut Vec<Statement>,
    ) {
        // of the columns of a matrix, loops copy what is put out
        let by_loops = matches!(alike.lanes, LoopLanes::Columns(_)) && !self.scope.style.one_by_one;
        let mut put_out = Vec::new();
        for ((_, row), name) in results.iter().zip(names).filter_map(|(result, name)| Some((result, name?))) {
            for (limb, id) in row.iter().enumerate() {
                self.values[id.index()] = Some(Expression::Element(name.clone(), Index::Number(limb)));
                self.gather(*id, plan);
                if let Ok(i) = plan.part.stores.binary_search_by_key(id, |(s, _)| *s) {
                    let (slot, value) = (plan.part.stores[i].1, self.operand(*id));
                    self.statements.push(Statement::Keep { slot, value });
                }
                let first = plan.results_of.partition_point(|(r, _)| r < id);
                for (_, k) in plan.results_of[first..].iter().take_while(|(r, _)| r == id) {
                    match by_loops {
                        true => put_out.push(CopiedResult { array: name.clone(), column: limb, result: *k }),
                        false => self.store_result(*id, *k),
                    }
                }
            }
        }
        out.append(&mut self.statements);
        out.extend(copies(&self.graph.outputs, put_out, index));
    }

    /// What stands in a loop for what limbs take from outside; arrays of it, and the table of constants, come before the loop.
    fn taken_by_limbs(
        &mut self,
        outside: &[(NodeId, Vec<NodeId>)],
        turns: &Turns,
        plan: &Plan<'_>,
        out: &mut Vec<Statement>,
    ) -> Vec<(NodeId, Expression)> {
        let table = turns.is_rolled.then(|| Table::new(self, outside));
        let mut values: Vec<(NodeId, Expression)> = Vec::new();
        for (node, of_limbs) in outside {
            let in_place = table.as_ref().and_then(|table| table.value(self, of_limbs, &turns.index));
            let value = match (in_place, of_limbs.as_slice()) {
                (Some(value), _) => value,
                (None, [same]) => self.operand(*same),
                (None, of_limbs) => {
                    let array = match plan.arrays.get(of_limbs).cloned().or_else(|| self.array_of_loop(of_limbs)) {
                        Some(array) => array,
                        None => self.array_over_limbs(of_limbs, turns.count, out),
                    };
                    Expression::Element(array, Index::Loop(turns.index.clone()))
                }
            };
            values.push((*node, value));
        }
        out.extend(table.and_then(Table::statement));
        values
    }

    /// Where what is used behind a loop goes, and of what goes into arrays their names; there is room for them before the loop.
    fn left_behind(
        &mut self,
        results: &[(NodeId, Vec<NodeId>)],
        turns: &Turns,
        plan: &Plan<'_>,
        is_operand: &[bool],
        out: &mut Vec<Statement>,
    ) -> (Vec<(NodeId, Left)>, Vec<Option<String>>) {
        let filler = self.filler(plan.part);
        let (mut left, mut names) = (Vec::new(), Vec::new());
        for (node, row) in results {
            let is_result_alone = turns.is_rolled && !row.iter().any(|id| is_operand[id.index()]);
            let place = self.put_out(row, plan, &turns.index).filter(|_| is_result_alone);
            if let Some((port, at)) = place {
                left.push((*node, Left::PutOut(port, at)));
                names.push(None);
                continue;
            }
            let name = match self.graph.notes[row[0].index()].name {
                Some((quantity, body, component)) => self.names.named(&format!("{quantity}s"), body, component),
                None => self.names.numbered("y"),
            };
            out.push(Statement::Room { name: name.clone(), filler: filler.clone(), count: turns.count });
            left.push((*node, Left::InArray(name.clone(), turns.index.clone())));
            names.push(Some(name));
        }
        (left, names)
    }

    /// The array in which a loop before this one left these values, one after the other.
    fn array_of_loop(&self, of_limbs: &[NodeId]) -> Option<String> {
        let Some(Expression::Element(array, Index::Number(0))) = &self.values[of_limbs[0].index()] else { return None };
        let is_next = |(limb, id): (usize, &NodeId)| matches!(&self.values[id.index()], Some(Expression::Element(other, Index::Number(k))) if other == array && *k == limb);
        of_limbs.iter().enumerate().all(is_next).then(|| array.clone())
    }

    /// The array of what limbs take from outside, one after the other; its name.
    fn array_over_limbs(&mut self, of_limbs: &[NodeId], count: usize, out: &mut Vec<Statement>) -> String {
        let last = of_limbs.last().into_iter().cycle();
        let values = of_limbs.iter().chain(last).take(count).map(|id| self.operand(*id)).collect();
        let are_constants = of_limbs.iter().all(|id| matches!(self.graph.op(*id), Op::Constant(_)));
        let is_constant = are_constants && !self.scope.style.generic;
        let name = match (is_constant, self.graph.notes[of_limbs[0].index()].name) {
            (true, _) => self.names.numbered("C"),
            (false, Some((quantity, body, component))) => self.names.named(&format!("{quantity}s"), body, component),
            (false, None) => self.names.numbered("x"),
        };
        out.push(Statement::Array { name: name.clone(), values, is_constant });
        name
    }
}

/// How many turns a loop over so many columns takes, so that nothing but vectors of four is left.
fn padded(columns: usize) -> usize {
    columns.next_multiple_of(4)
}

/// How a loop over limbs turns.
struct Turns {
    index: String,
    count: usize,
    is_rolled: bool,
}

/// A loop over limbs as a program of its own: rows are nodes, and so is what they take from outside.
struct Loop {
    graph: Graph,
    part: ProgramPart,
    /// Of nodes from outside what stands for them: a node for all limbs, or one per limb.
    outside: Vec<(NodeId, Vec<NodeId>)>,
    /// What is used behind the loop, with its row.
    results: Vec<(NodeId, Vec<NodeId>)>,
}

impl Loop {
    fn new(graph: &Graph, alike: &Alike, used_across: &[bool]) -> Loop {
        let (sections, inputs) = (graph.sections.clone(), graph.inputs.clone());
        let mut inner = Graph { sections, inputs, sines: graph.sines, ..Graph::default() };
        let push = |inner: &mut Graph, op: Op, note| {
            inner.ops.push(op);
            inner.notes.push(note);
            NodeId(inner.ops.len() as u32 - 1)
        };
        let mut known: FxHashMap<Vec<NodeId>, NodeId> = FxHashMap::default();
        let (mut part, mut outside, mut results) = (ProgramPart::default(), Vec::new(), Vec::new());
        for row in &alike.rows {
            let operands: Vec<Vec<NodeId>> = row.iter().map(|id| graph.op(*id).operands().collect()).collect();
            let mut of_op = Vec::new();
            for k in 0..operands[0].len() {
                let mut of_limbs: Vec<NodeId> = operands.iter().map(|o| o[k]).collect();
                if of_limbs.iter().all(|a| *a == of_limbs[0]) {
                    of_limbs.truncate(1);
                }
                let first = of_limbs[0];
                let node = *known.entry(of_limbs.clone()).or_insert_with(|| {
                    let leaf = matches!(graph.op(first), Op::Input(_) | Op::Constant(_)) && of_limbs.len() == 1;
                    let op = if leaf { graph.op(first) } else { Op::Input(0) };
                    let node = push(&mut inner, op, graph.notes[first.index()]);
                    if !leaf {
                        outside.push((node, of_limbs.clone()));
                    }
                    node
                });
                of_op.push(node);
            }
            let mut of_op = of_op.into_iter();
            let op = graph.op(row[0]).map(|_| of_op.next().expect("as many operands"));
            let node = push(&mut inner, op, graph.notes[row[0].index()]);
            known.insert(row.clone(), node);
            part.nodes.push(node);
            if row.iter().any(|id| used_across[id.index()]) {
                results.push((node, row.clone()));
                inner.results.push(node);
            }
        }
        Loop { graph: inner, part, outside, results }
    }
}
