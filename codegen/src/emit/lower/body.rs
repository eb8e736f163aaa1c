//! The statements of one part of a program.

use super::fused::{fusions, Fused};
use super::{first_read, nodes_of, port_of, read_inputs, zeros, Lowering, Names};
use crate::emit::module::{Expression, Statement, Stride};
use crate::emit::target::{Scope, Target};
use rustc_hash::FxHashMap;
use straightline_graph::expr::{Graph, NodeId, Op, Precision, Sines, Unary};
use straightline_graph::schedule::ProgramPart;
use straightline_graph::Scalar;

/// How long an expression may grow before it gets a name of its own.
const LINE: usize = 84;
/// How long a value with a sign may be to be written wherever it is used.
const TRIVIAL: usize = 24;

/// The statements of one part: expressions of single use are written where they are used.
pub(super) struct Statements<'a> {
    pub graph: &'a Graph,
    pub scope: Scope<'a>,
    pub target: &'a dyn Target,
    /// Sums that take a product in.
    fused: Vec<Option<Fused>>,
    /// What stands for each node: its name or its expression.
    pub values: Vec<Option<Expression>>,
    /// Sine-cosine pairs that are written already.
    paired: Vec<bool>,
    pub names: Names,
    /// Locals, with their types, and statements of the block being written.
    declared: Vec<(String, Scalar)>,
    pub statements: Vec<Statement>,
}

/// What is known of a part before its statements are written.
pub(super) struct Plan<'a> {
    pub part: &'a ProgramPart,
    pub uses: Vec<u32>,
    /// Results by their nodes, in the order of those.
    pub results_of: Vec<(NodeId, usize)>,
    /// What needs a name, because something else than a statement here uses it.
    pub crosses: Vec<bool>,
    /// Products that sums take in.
    pub absorbed: Vec<bool>,
    /// What keeps its place in the order: it is not written where it is used.
    pub stays: Vec<bool>,
    /// Of a loop over limbs where its values go, by their nodes, in the order of those.
    pub left: Vec<(NodeId, Left)>,
    /// Which values go into arrays for loops over columns as soon as they are there, and to which places.
    pub gathered: FxHashMap<NodeId, Vec<(String, usize)>>,
    /// These arrays, by what they hold.
    pub arrays: FxHashMap<Vec<NodeId>, String>,
}

/// Where a value of a loop over limbs goes.
#[derive(Clone)]
pub(super) enum Left {
    /// Into this array, at this index.
    InArray(String, String),
    /// To this output.
    PutOut(usize, Stride),
}

/// The statements of one part; over lanes, in a loop over them.
pub(super) fn body(graph: &Graph, part: &ProgramPart, scope: Scope<'_>, lowering: &Lowering<'_>) -> Vec<Statement> {
    let statements = statements(graph, part, scope, lowering);
    match scope.style.lanes {
        true => vec![Statement::Lanes(statements)],
        false => statements,
    }
}

fn statements(graph: &Graph, part: &ProgramPart, scope: Scope<'_>, lowering: &Lowering<'_>) -> Vec<Statement> {
    let ports = graph.inputs.iter().chain(&graph.outputs).map(|p| p.name.as_str());
    let names = Names::with_taken(ports.chain(lowering.target.reserved().iter().copied()));
    let (mut b, absorbed) = Statements::new(graph, part, scope, lowering.target, names);
    let mut uses = vec![0u32; graph.ops.len()];
    for id in &part.nodes {
        graph.op(*id).operands().for_each(|a| uses[a.index()] += 1);
    }
    let mut results_of: Vec<(NodeId, usize)> = part.results.iter().map(|r| (graph.results[*r], *r)).collect();
    results_of.sort_unstable();
    results_of.iter().for_each(|(id, _)| uses[id.index()] += 1);
    let mut crosses = vec![false; graph.ops.len()];
    part.stores.iter().for_each(|(id, _)| crosses[id.index()] = true);

    let mut out = Vec::new();
    if !part.loads.is_empty() {
        let named: Vec<(String, usize)> = part.loads.iter().map(|(id, slot)| (b.fresh_name(*id), *slot)).collect();
        for ((id, _), (name, _)) in part.loads.iter().zip(&named) {
            b.values[id.index()] = Some(Expression::Local(name.clone()));
        }
        out.push(Statement::Load(named));
    }
    let stays = keep_their_places(graph, part, &uses);
    let mut plan = Plan {
        part,
        uses,
        results_of,
        crosses,
        absorbed,
        stays,
        left: Vec::new(),
        gathered: FxHashMap::default(),
        arrays: FxHashMap::default(),
    };
    if scope.style.lanes || graph.alike.is_empty() {
        b.run(&part.nodes, &plan, lowering, &mut out);
    } else {
        b.with_loops(&mut plan, lowering, &mut out);
    }
    // results that are constants or inputs
    for (id, k) in &plan.results_of {
        if matches!(graph.op(*id), Op::Input(_) | Op::Constant(_)) {
            b.store_result(*id, *k);
        }
    }
    out.append(&mut b.statements);
    match scope.style.one_by_one && !scope.style.lanes {
        true => zeros::spread(out),
        false => out,
    }
}

/// In a part that keeps its order, the values that something else stands behind, before their one user.
fn keep_their_places(graph: &Graph, part: &ProgramPart, uses: &[u32]) -> Vec<bool> {
    let mut stays = vec![false; graph.ops.len()];
    if !part.keeps_order {
        return stays;
    }
    let mut last_user = vec![0; graph.ops.len()];
    for (p, id) in part.nodes.iter().enumerate() {
        graph.op(*id).operands().for_each(|a| last_user[a.index()] = p);
    }
    for (p, id) in part.nodes.iter().enumerate() {
        let user = last_user[id.index()];
        let is_for_user = |n: &NodeId| uses[n.index()] <= 1 && last_user[n.index()] <= user;
        stays[id.index()] = user > p && !part.nodes[p + 1..user].iter().all(is_for_user);
    }
    stays
}

impl<'a> Statements<'a> {
    /// Before its first statement, and which products sums take in.
    pub fn new(
        graph: &'a Graph,
        part: &ProgramPart,
        scope: Scope<'a>,
        target: &'a dyn Target,
        names: Names,
    ) -> (Statements<'a>, Vec<bool>) {
        let (fused, absorbed) = match scope.style.fused {
            true => fusions(graph, part),
            false => (vec![None; graph.ops.len()], vec![false; graph.ops.len()]),
        };
        let body = Statements {
            graph,
            scope,
            target,
            fused,
            values: vec![None; graph.ops.len()],
            paired: vec![false; graph.ops.len()],
            names,
            declared: Vec::new(),
            statements: Vec::new(),
        };
        (body, absorbed)
    }

    /// What an array of a part holds before its elements are computed.
    pub fn filler(&self, part: &ProgramPart) -> Expression {
        let (is_read, style) = (read_inputs(self.graph, nodes_of(self.graph, part)), self.scope.style);
        let has_live = !(part.loads.is_empty() || style.lanes || style.generic);
        let of_part = first_read(self.graph, &is_read, style).or_else(|| has_live.then_some(Expression::Slot(0)));
        of_part.unwrap_or(Expression::Zero)
    }

    /// The statements of these nodes of a part.
    pub fn run(&mut self, nodes: &[NodeId], plan: &Plan<'_>, lowering: &Lowering<'_>, out: &mut Vec<Statement>) {
        let mut section = None;
        for (k, id) in nodes.iter().enumerate() {
            let here = self.graph.notes[id.index()].section;
            if section != Some(here) {
                self.close_block(section, lowering, out);
                section = Some(here);
            }
            match self.graph.op(*id) {
                Op::AngleSum(..) | Op::Sin(_) | Op::Cos(_) => {}
                Op::SinCos(_) if self.paired[id.index()] => {}
                Op::SinCos(_) => {
                    let section_of = |n: &NodeId| self.graph.notes[n.index()].section;
                    let is_half = |n: &NodeId| matches!(self.graph.op(*n), Op::SinCos(_) | Op::Sin(_) | Op::Cos(_));
                    let count = match plan.part.keeps_order {
                        true => nodes[k..].iter().take_while(|n| is_half(n)).count(),
                        false => nodes[k..].iter().take_while(|n| section_of(n) == here).count(),
                    };
                    self.sin_cos(&nodes[k..k + count], plan);
                }
                _ if plan.absorbed[id.index()] => {}
                op => self.value(*id, op, plan),
            }
            self.hand_on(*id, plan);
        }
        self.close_block(section, lowering, out);
    }

    /// The value of an operation: a local, or an expression where it is used.
    fn value(&mut self, id: NodeId, op: Op, plan: &Plan<'_>) {
        let value = match self.fused[id.index()] {
            Some(fused) => self.fma(fused),
            None => self.node(id, op),
        };
        let crosses = plan.crosses[id.index()];
        let alone = plan.uses[id.index()] <= 1 && !crosses;
        let is_named = self.graph.notes[id.index()].name.is_some();
        let is_result_only = || alone && plan.results_of.binary_search_by_key(&id, |(r, _)| *r).is_ok();
        let length = || self.target.expression(&value, self.scope).len();
        // a sign before a name is written wherever it is used; an operation is not
        let is_sign = matches!(op, Op::Unary(Unary::Neg, _)) && !crosses;
        let is_fused = || value.any(&mut |e| matches!(e, Expression::Fused { .. }));
        let is_inlined = (is_sign && length() < TRIVIAL && !is_fused())
            || is_result_only()
            || (alone && !is_named && !plan.stays[id.index()] && length() < LINE * 2 / 3);
        if is_inlined {
            self.values[id.index()] = Some(value);
            return;
        }
        let name = self.fresh_name(id);
        self.declared.push((name.clone(), self.scalar_of(id)));
        self.statements.push(Statement::Set(name.clone(), value));
        self.values[id.index()] = Some(Expression::Local(name));
    }

    /// Stores a value where something behind the block takes it.
    fn hand_on(&mut self, id: NodeId, plan: &Plan<'_>) {
        let first = plan.results_of.partition_point(|(r, _)| *r < id);
        for (_, k) in plan.results_of[first..].iter().take_while(|(r, _)| *r == id) {
            self.store_result(id, *k);
        }
        if let Ok(i) = plan.part.stores.binary_search_by_key(&id, |(s, _)| *s) {
            let (slot, value) = (plan.part.stores[i].1, self.operand(id));
            self.statements.push(Statement::Keep { slot, value });
        }
        self.gather(id, plan);
        if let Ok(i) = plan.left.binary_search_by_key(&id, |(n, _)| *n) {
            let value = self.operand(id);
            self.statements.push(match plan.left[i].1.clone() {
                Left::InArray(array, index) => Statement::Put { array, index, value },
                Left::PutOut(port, at) => Statement::StoreOfLimb { port, at, value },
            });
        }
    }

    /// Puts a value where loops over columns take it from.
    pub fn gather(&mut self, id: NodeId, plan: &Plan<'_>) {
        for (array, place) in plan.gathered.get(&id).into_iter().flatten() {
            let value = self.operand(id);
            self.statements.push(Statement::Put { array: array.clone(), index: place.to_string(), value });
        }
    }

    fn fresh_name(&mut self, id: NodeId) -> String {
        match self.graph.notes[id.index()].name {
            Some((quantity, index, component)) => self.names.named(quantity, index, component),
            None => self.names.temporary(),
        }
    }

    /// A node as an operand.
    pub fn operand(&self, id: NodeId) -> Expression {
        match (&self.values[id.index()], self.graph.op(id)) {
            (Some(value), _) => value.clone(),
            (None, Op::Input(k)) => {
                let (port, at) = port_of(&self.graph.inputs, k as usize);
                Expression::Input { port, at }
            }
            (None, Op::Constant(c)) => Expression::Constant(c, self.scalar_of(id)),
            _ => panic!("operands stand before their users"),
        }
    }

    /// The type of a node's value.
    fn scalar_of(&self, id: NodeId) -> Scalar {
        self.graph.precision(id, self.scope.style.scalar).held
    }

    /// A node as an operand of this type, to which others are widened where a program is in mixed precision.
    fn operand_in(&self, id: NodeId, scalar: Scalar) -> Expression {
        match self.scalar_of(id) == scalar {
            true => self.operand(id),
            false => Expression::Widened(scalar, Box::new(self.operand(id))),
        }
    }

    /// An operation; one in f64 that is used in f32 is rounded.
    fn node(&self, id: NodeId, op: Op) -> Expression {
        let Precision { computed, held } = self.graph.precision(id, self.scope.style.scalar);
        // functions are those of the style's scalar
        let operand = |a: NodeId| match op.row().is_some_and(|row| row.is_a_call()) {
            true => Box::new(self.operand(a)),
            false => Box::new(self.operand_in(a, computed)),
        };
        let value = match op {
            Op::Unary(unary, a) => Expression::Unary(unary, operand(a)),
            Op::Binary(binary, a, b) => Expression::Binary(binary, operand(a), operand(b)),
            _ => unreachable!("leaves and angles are written where they are used"),
        };
        match computed == held {
            true => value,
            false => Expression::Rounded(held, Box::new(value)),
        }
    }

    /// A product and a sum in one rounding; changes of sign are part of the instruction.
    fn fma(&self, Fused { negated, factors: (x, y), other: (c, subtracted) }: Fused) -> Expression {
        Expression::Fused {
            factors: [x, y].map(|id| Box::new(self.operand(id))),
            is_negated: negated,
            term: Box::new(self.operand(c)),
            is_subtracted: subtracted,
        }
    }

    /// `(sin_q3, cos_q3) = trig::sin_cos_f64(q[2]);` for one angle; the angles of a block that are known already go
    /// through one call in lanes, which the compiler turns into vector instructions.
    fn sin_cos(&mut self, block: &[NodeId], plan: &Plan<'_>) {
        let terms_of = |a: NodeId| -> Vec<Expression> {
            self.graph.angle_terms(a).into_iter().map(|term| self.operand(term)).collect()
        };
        let (pairs, angles): (Vec<NodeId>, Vec<Vec<Expression>>) = block
            .iter()
            .filter_map(|id| match self.graph.op(*id) {
                // those that a call before has are written
                Op::SinCos(a) if self.is_written(a) && !self.paired[id.index()] => Some((*id, terms_of(a))),
                _ => None,
            })
            .unzip();
        let (mut sines, mut cosines) = (Vec::new(), Vec::new());
        for pair in &pairs {
            self.paired[pair.index()] = true;
            sines.push(self.half(*pair, Op::Sin(*pair), plan));
            cosines.push(self.half(*pair, Op::Cos(*pair), plan));
        }
        // the loop around the body has the lanes; a call fills the widest vectors there are, more at once would not stay in registers
        let style = self.scope.style;
        let kernel = self.graph.sines;
        let most = match kernel {
            Sines::Short if plan.part.sines_by_two => 2,
            Sines::Precise if !style.lanes => 64 / style.scalar.bytes(),
            _ => 1,
        };
        for ((angles, sines), cosines) in angles.chunks(most).zip(sines.chunks(most)).zip(cosines.chunks(most)) {
            let (sines, cosines, angles) = (sines.to_vec(), cosines.to_vec(), angles.to_vec());
            self.statements.push(Statement::SinCos { kernel, sines, cosines, angles });
        }
    }

    /// The local of one half of a pair, if it is used.
    fn half(&mut self, pair: NodeId, half: Op, plan: &Plan<'_>) -> Option<String> {
        let id = (pair.0 + 1..pair.0 + 3).map(NodeId).find(|h| self.graph.ops.get(h.index()) == Some(&half));
        let is_left = |id: NodeId| plan.left.iter().any(|(n, _)| *n == id);
        let is_kept = |id: NodeId| plan.part.stores.iter().any(|(s, _)| *s == id) || is_left(id);
        let id = id.filter(|id| plan.uses[id.index()] > 0 || is_kept(*id))?;
        let name = self.fresh_name(id);
        self.values[id.index()] = Some(Expression::Local(name.clone()));
        Some(name)
    }

    /// Whether a node can be used as an operand by now.
    fn is_written(&self, id: NodeId) -> bool {
        matches!(self.graph.op(id), Op::Input(_) | Op::Constant(_) | Op::AngleSum(..))
            || self.values[id.index()].is_some()
    }

    pub fn store_result(&mut self, id: NodeId, k: usize) {
        let (port, at) = port_of(&self.graph.outputs, k);
        let value = self.operand(id);
        self.statements.push(Statement::Store { port, at, value });
    }

    /// Writes the block: its comment, its locals, its statements.
    fn close_block(&mut self, section: Option<u32>, lowering: &Lowering<'_>, out: &mut Vec<Statement>) {
        if self.statements.is_empty() {
            return;
        }
        let title = section.map(|s| (lowering.title)(self.graph.sections[s as usize])).unwrap_or_default();
        if !title.is_empty() {
            out.push(Statement::Comment(title));
        }
        if !self.declared.is_empty() {
            out.push(Statement::Declare(std::mem::take(&mut self.declared)));
        }
        out.append(&mut self.statements);
    }
}
