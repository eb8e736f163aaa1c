//! The instructions that LLVM makes of straight-line text whose order it keeps, before registers are given.
//!
//! * A product of single use is computed with the sum that takes it, where the machine has an instruction for both: in the register of the other
//!   term, which is copied before if it is needed again.
//! * A constant is loaded where it is first needed, an input, too; a subtracted constant is an added one, which is another constant.
//! * Neighbours of an array that are loaded or stored within a few instructions come together (`ARMLoadStoreOptimizer.cpp`).
//! * Sines are calls, with arguments and results in the first registers, or stand in place.

use super::allocation::{CodeLine, LineKind};
use super::kernels::Kernel;
use super::ScheduleMachine;
use crate::expr::{Binary, Graph, NodeId, Op, Unary};
use crate::schedule::{calls_of_two, zeros_together};
use std::collections::BTreeMap;

/// What an instruction costs, apart from loads and stores of the allocator.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum LineClass {
    /// An operation of the floating-point unit.
    #[default]
    Float,
    /// A multiply-accumulate.
    Accumulate,
    Division,
    Root,
    /// Integers.
    Integer,
    /// A load of an input or a store of a result: the port, counted through inputs and outputs, and the place there.
    Load(usize, usize),
    Store(usize, usize),
    /// A constant, which an instruction holds or which is loaded.
    Held,
    Loaded,
    /// A call of a kernel.
    Call(Kernel),
    /// Copies, which may fall away.
    Copy,
}

/// Instructions of a program, with ranges for its values.
#[derive(Clone, Debug, Default)]
pub(super) struct LoweredCode {
    pub lines: Vec<CodeLine>,
    pub classes: Vec<LineClass>,
    /// Of a line that makes a constant its bits.
    pub bits: BTreeMap<usize, u32>,
    pub ranges: usize,
    /// How many results are zero, one behind the other.
    pub zeros: Vec<usize>,
}

/// How many instructions of an array come together, and how far apart they may be, each.
const TOGETHER: (usize, usize) = (8, 4);
/// More registers than these are looked at before they are moved.
const FEW: usize = 4;

/// The instructions of a program in an order.
pub(super) fn lowered(graph: &Graph, order: &[NodeId], machine: &ScheduleMachine) -> LoweredCode {
    let mut selection = InstructionSelection {
        graph,
        machine,
        code: LoweredCode::default(),
        range_of: vec![None; graph.ops.len()],
        constants: BTreeMap::new(),
        sums: BTreeMap::new(),
        left: graph.uses(),
        host: super::hosts(graph, order, machine.accumulates),
        results: Vec::new(),
        takes_next: if machine.sines_by_two { calls_of_two(graph, order) } else { vec![false; graph.ops.len()] },
        waiting: None,
    };
    selection.results = graph.results.iter().enumerate().map(|(k, id)| (*id, k)).collect();
    selection.results.sort_unstable();
    for id in order {
        selection.node(*id);
    }
    let mut zeros: Vec<usize> = Vec::new();
    for (id, k) in selection.results.clone() {
        if matches!(graph.op(id), Op::Constant(c) if c.is(0.0)) {
            zeros.push(k);
        } else if graph.op(id).is_leaf() {
            let value = selection.value(id);
            selection.store(value, k);
        }
    }
    let together = zeros_together(zeros.len(), selection.results.len() - zeros.len());
    let runs = zeros.chunk_by(|a, b| a + 1 == *b).flat_map(|run| run.chunks(together.max(1)));
    selection.code.zeros = runs.map(<[usize]>::len).collect();
    neighbours_together(selection.code)
}

struct InstructionSelection<'a> {
    graph: &'a Graph,
    machine: &'a ScheduleMachine,
    code: LoweredCode,
    range_of: Vec<Option<usize>>,
    /// The range of each constant.
    constants: BTreeMap<u32, usize>,
    /// The range of a sum of angles and of what it lost, by its terms.
    sums: BTreeMap<Vec<NodeId>, [usize; 2]>,
    /// How often each value is still needed.
    left: Vec<u32>,
    /// Of every product of single use the sum that takes it in.
    host: Vec<Option<NodeId>>,
    results: Vec<(NodeId, usize)>,
    /// Which calls of sines take the next angle along, and the pair that waits for the next.
    takes_next: Vec<bool>,
    waiting: Option<NodeId>,
}

impl InstructionSelection<'_> {
    fn push(&mut self, class: LineClass, reads: Vec<usize>, kind: LineKind) -> usize {
        let range = self.code.ranges;
        self.code.ranges += 1;
        self.line(class, CodeLine { reads, writes: Some(range), kind });
        range
    }

    fn line(&mut self, class: LineClass, line: CodeLine) {
        self.code.lines.push(line);
        self.code.classes.push(class);
    }

    fn float(&mut self, reads: Vec<usize>) -> usize {
        self.push(LineClass::Float, reads, LineKind::Other)
    }

    fn constant(&mut self, value: f32) -> usize {
        if let Some(range) = self.constants.get(&value.to_bits()) {
            return *range;
        }
        let class = if is_held(value) { LineClass::Held } else { LineClass::Loaded };
        self.code.bits.insert(self.code.lines.len(), value.to_bits());
        let range = self.push(class, Vec::new(), LineKind::Constant);
        self.constants.insert(value.to_bits(), range);
        range
    }

    fn number(&self, id: NodeId) -> Option<f32> {
        match self.graph.op(id) {
            Op::Constant(c) => Some(c.value().hi() as f32),
            _ => None,
        }
    }

    /// The range that holds a value; it is loaded if it is not there yet.
    fn value(&mut self, id: NodeId) -> usize {
        if let Some(range) = self.range_of[id.index()] {
            return range;
        }
        let range = match self.graph.op(id) {
            Op::Input(k) => {
                let (mut port, mut at) = (0, k as usize);
                while at >= self.graph.inputs[port].len() {
                    at -= self.graph.inputs[port].len();
                    port += 1;
                }
                self.push(LineClass::Load(port, at), Vec::new(), LineKind::Other)
            }
            Op::Constant(c) => return self.constant(c.value().hi() as f32),
            _ => unreachable!("operands stand before their users"),
        };
        self.range_of[id.index()] = Some(range);
        range
    }

    /// The operands of a node, each of which has one user less.
    fn operands(&mut self, ids: &[NodeId]) -> Vec<usize> {
        ids.iter().for_each(|id| self.left[id.index()] = self.left[id.index()].saturating_sub(1));
        ids.iter().map(|id| self.value(*id)).collect()
    }

    fn node(&mut self, id: NodeId) {
        if self.host[id.index()].is_some() {
            return;
        }
        let range = match self.graph.op(id) {
            Op::Input(_) | Op::Constant(_) | Op::AngleSum(..) | Op::Sin(_) | Op::Cos(_) => return,
            Op::SinCos(_) if self.takes_next[id.index()] => {
                self.waiting = Some(id);
                return;
            }
            Op::SinCos(_) => {
                let first = self.waiting.take();
                return self.sines(&first.into_iter().chain([id]).collect::<Vec<_>>());
            }
            Op::Unary(Unary::Neg, a) => {
                let range = self.operands(&[a])[0];
                // a sign before a product or a sum is part of it
                let is_result = self.results.binary_search_by_key(&id, |(r, _)| *r).is_ok();
                if is_result {
                    self.float(vec![range])
                } else {
                    range
                }
            }
            Op::Unary(unary, a) => {
                let reads = self.operands(&[a]);
                let class = if unary == Unary::Sqrt { LineClass::Root } else { LineClass::Float };
                self.push(class, reads, LineKind::Other)
            }
            Op::Binary(Binary::Div, a, b) => {
                let reads = self.operands(&[a, b]);
                self.push(LineClass::Division, reads, LineKind::Other)
            }
            Op::Binary(binary, a, b) => self.sum_or_product(id, binary, [a, b]),
        };
        self.range_of[id.index()] = Some(range);
        let first = self.results.partition_point(|(r, _)| *r < id);
        let own: Vec<usize> = self.results[first..].iter().take_while(|(r, _)| *r == id).map(|(_, k)| *k).collect();
        for k in own {
            self.left[id.index()] = self.left[id.index()].saturating_sub(1);
            self.store(range, k);
        }
    }

    fn sum_or_product(&mut self, id: NodeId, binary: Binary, [a, b]: [NodeId; 2]) -> usize {
        let product = [b, a].into_iter().find(|term| self.host[term.index()] == Some(id));
        if let Some(product) = product {
            let term = if product == b { a } else { b };
            let Op::Binary(_, x, y) = self.graph.op(product) else { unreachable!("it is a product") };
            let factors = self.operands(&[x, y]);
            let is_lasting = self.left[term.index()] > 1 && self.number(term).is_none();
            let mut own = self.operands(&[term])[0];
            if self.number(term).is_some() {
                // the register of a constant is taken; who needs it again loads it again
                self.constants.retain(|_, range| *range != own);
            }
            if is_lasting {
                own = self.push(LineClass::Copy, vec![own], LineKind::Copy);
            }
            let reads = [vec![own], factors].concat();
            self.line(LineClass::Accumulate, CodeLine { reads, writes: Some(own), kind: LineKind::Other });
            return own;
        }
        let reads = match (binary, self.number(b)) {
            // x − c is x + (−c)
            (Binary::Sub, Some(c)) => {
                let range = self.operands(&[a])[0];
                vec![range, self.constant(-c)]
            }
            _ => self.operands(&[a, b]),
        };
        self.float(reads)
    }

    fn store(&mut self, range: usize, k: usize) {
        let (mut port, mut at) = (0, k);
        while at >= self.graph.outputs[port].len() {
            at -= self.graph.outputs[port].len();
            port += 1;
        }
        let class = LineClass::Store(self.graph.inputs.len() + port, at);
        self.line(class, CodeLine { reads: vec![range], writes: None, kind: LineKind::Other });
    }

    /// The angle, and what the rounding of a sum lost (TwoSum).
    fn angle(&mut self, terms: &[NodeId]) -> (usize, Option<usize>) {
        let [before @ .., last] = terms else { unreachable!("an angle has a term") };
        if before.is_empty() {
            return (self.value(*last), None);
        }
        if let Some([sum, tail]) = self.sums.get(terms) {
            return (*sum, Some(*tail));
        }
        let (sum, tail) = self.angle(before);
        let angle = self.value(*last);
        let next = self.float(vec![sum, angle]);
        let added = self.float(vec![next, sum]);
        let kept = self.float(vec![next, added]);
        let lost = self.float(vec![sum, kept]);
        let of_angle = self.float(vec![angle, added]);
        let mut own = self.float(vec![of_angle, lost]);
        if let Some(tail) = tail {
            own = self.float(vec![tail, own]);
        }
        self.sums.insert(terms.to_vec(), [next, own]);
        (next, Some(own))
    }

    /// The sines of a pair, or of two by one call.
    fn sines(&mut self, pairs: &[NodeId]) {
        let mut angles = Vec::new();
        for pair in pairs {
            let Op::SinCos(angle) = self.graph.op(*pair) else { unreachable!("it is a pair") };
            let terms = self.graph.angle_terms(angle);
            terms.iter().for_each(|term| self.left[term.index()] = self.left[term.index()].saturating_sub(1));
            angles.push(self.angle(&terms));
        }
        let halves: Vec<Option<NodeId>> = pairs
            .iter()
            .flat_map(|pair| [Op::Sin(*pair), Op::Cos(*pair)].map(|half| self.needed_half(*pair, half)))
            .collect();
        let answers = match self.machine.is_in_flash {
            false => angles.into_iter().flat_map(|(angle, tail)| self.kernel(angle, tail)).collect(),
            true => self.call(&angles, &halves),
        };
        for (half, range) in halves.into_iter().zip(answers) {
            if let Some(half) = half {
                self.range_of[half.index()] = Some(range);
                let first = self.results.partition_point(|(r, _)| *r < half);
                let own: Vec<usize> =
                    self.results[first..].iter().take_while(|(r, _)| *r == half).map(|(_, k)| *k).collect();
                own.into_iter().for_each(|k| self.store(range, k));
            }
        }
    }

    fn needed_half(&self, pair: NodeId, half: Op) -> Option<NodeId> {
        let mut ids = (pair.0 + 1..pair.0 + 3).map(NodeId).filter(|id| self.graph.ops.get(id.index()) == Some(&half));
        ids.find(|id| self.left[id.index()] > 0)
    }

    /// A call of the kernel of these angles, each with what its rounding lost: the ranges of the halves that are needed.
    fn call(&mut self, angles: &[(usize, Option<usize>)], halves: &[Option<NodeId>]) -> Vec<usize> {
        let has_sum = angles.iter().any(|(_, tail)| tail.is_some());
        let kernel = Kernel::of(angles.len(), has_sum);
        let mut arguments = Vec::new();
        for (angle, tail) in angles {
            arguments.push(*angle);
            if has_sum {
                arguments.push(tail.unwrap_or_else(|| self.constant(0.0)));
            }
        }
        for (n, range) in arguments.iter().enumerate() {
            let kind = LineKind::Argument(n as u8);
            self.line(LineClass::Copy, CodeLine { reads: vec![*range], writes: None, kind });
        }
        let kind = LineKind::Call(arguments.len() as u8);
        self.line(LineClass::Call(kernel), CodeLine { kind, ..CodeLine::default() });
        let answer = |(n, half): (usize, &Option<NodeId>)| {
            half.map_or(usize::MAX, |_| self.push(LineClass::Copy, Vec::new(), LineKind::Answer(n as u8)))
        };
        halves.iter().enumerate().map(answer).collect()
    }

    /// a + b c, by one instruction or two, in the register of a that nobody needs any more.
    fn accumulated(&mut self, a: usize, b: usize, c: usize) -> usize {
        match self.machine.accumulates {
            true => {
                self.line(
                    LineClass::Accumulate,
                    CodeLine { reads: vec![a, b, c], writes: Some(a), kind: LineKind::Other },
                );
                a
            }
            false => {
                let product = self.float(vec![b, c]);
                self.float(vec![a, product])
            }
        }
    }

    fn fresh(&mut self, value: f32) -> usize {
        let range = self.constant(value);
        if self.machine.accumulates {
            self.constants.remove(&value.to_bits());
        }
        range
    }

    /// The kernel of short sines (`straightline_core::short_sines`).
    fn kernel(&mut self, x: usize, tail: Option<usize>) -> [usize; 2] {
        let turns = self.constant(core::f32::consts::FRAC_2_PI);
        let round = self.fresh(12_582_912.0);
        let shifted = self.accumulated(round, x, turns);
        let back = self.constant(-12_582_912.0);
        let k = self.float(vec![shifted, back]);
        self.line(LineClass::Integer, CodeLine { reads: vec![shifted], ..CodeLine::default() });
        let parts = [1.570_312_5, 0.000_483_826_8].map(|part| self.constant(part));
        let first = self.float(vec![k, parts[0]]);
        let first = self.float(vec![x, first]);
        let second = self.float(vec![k, parts[1]]);
        let second = tail.map_or(second, |tail| self.float(vec![second, tail]));
        let y = self.float(vec![first, second]);
        let z = self.float(vec![y, y]);
        let yz = self.float(vec![y, z]);
        let horner = |code: &mut Self, coefficients: &[f32]| {
            let mut sum = code.constant(coefficients[0]);
            for c in &coefficients[1..] {
                let c = code.fresh(*c);
                sum = code.accumulated(c, z, sum);
            }
            sum
        };
        let sine = horner(self, &[-0.000_194_945_4, 0.008_331_97, -0.166_666_51]);
        let sine = self.accumulated(y, yz, sine);
        let cosine = horner(self, &[2.443_729_7e-5, -0.001_388_735_8, 0.041_666_646, -0.5, 1.0]);
        // exchanged and with other signs by conditional moves
        (0..4).for_each(|_| self.line(LineClass::Integer, CodeLine::default()));
        let minus = self.float(vec![sine]);
        let mut moved = |to: usize, from: usize| {
            let line = CodeLine { reads: vec![to, from], writes: Some(to), kind: LineKind::Other };
            self.line(LineClass::Float, line);
            to
        };
        let (second, first) = (moved(minus, cosine), moved(cosine, sine));
        let negative = [first, second].map(|half| self.float(vec![half]));
        for (to, from) in negative.into_iter().zip([first, second]) {
            self.line(LineClass::Float, CodeLine { reads: vec![to, from], writes: Some(to), kind: LineKind::Other });
        }
        negative
    }
}

/// Whether an instruction can hold a constant: ± (16 + n)/16 · 2^e with n < 16 and −3 ≤ e ≤ 4 (VMOV, A7-6).
fn is_held(value: f32) -> bool {
    let bits = value.to_bits();
    let exponent = (bits >> 23 & 0xff) as i32 - 127;
    bits & 0x7_ffff == 0 && (-3..=4).contains(&exponent)
}

/// Loads and stores of neighbours of an array, in stretches without calls: loads where the first one stands, stores where the last one does.
fn neighbours_together(mut code: LoweredCode) -> LoweredCode {
    let mut start = 0;
    while start < code.lines.len() {
        // a stretch ends behind a call, and before an element that was met already
        let (mut end, mut met) = (start, BTreeMap::<(bool, usize), Vec<(usize, usize)>>::new());
        while end < code.lines.len() {
            let (is_load, port, at) = match code.classes[end] {
                LineClass::Call(_) => {
                    end += 1;
                    break;
                }
                LineClass::Load(port, at) => (true, port, at),
                LineClass::Store(port, at) => (false, port, at),
                _ => {
                    end += 1;
                    continue;
                }
            };
            met.entry((is_load, port)).or_default().push((at, end));
            end += 1;
        }
        for ((is_load, _), elements) in met {
            moved_together(&mut code, is_load, elements);
        }
        start = end;
    }
    code
}

fn moved_together(code: &mut LoweredCode, is_load: bool, mut elements: Vec<(usize, usize)>) {
    elements.sort_unstable();
    let mut next = 0;
    while next < elements.len() {
        let run =
            (next + 1..elements.len().min(next + TOGETHER.0)).take_while(|k| elements[*k].0 == elements[k - 1].0 + 1);
        let count = 1 + run.count();
        let lines = || elements[next..next + count].iter().map(|(_, line)| *line);
        let (first, last) = (lines().min().expect("one"), lines().max().expect("one"));
        if count > 1 && last - first <= TOGETHER.1 * count && is_bearable(code, first, last, count) {
            let chosen: Vec<usize> = elements[next..next + count].iter().map(|(_, line)| *line).collect();
            let map = rearranged(code, is_load, first, last, &chosen);
            elements.iter_mut().for_each(|(_, line)| {
                if (first..=last).contains(line) {
                    *line = map[*line - first];
                }
            });
        }
        next += count;
    }
}

/// Whether moving more than a few keeps registers within bounds.
fn is_bearable(code: &LoweredCode, first: usize, last: usize, count: usize) -> bool {
    if count <= FEW {
        return true;
    }
    let mut others: Vec<usize> = Vec::new();
    for line in &code.lines[first..=last] {
        others.extend(line.reads.iter().copied().chain(line.writes));
    }
    others.sort_unstable();
    others.dedup();
    others.len().saturating_sub(count) <= 2 * count
}

/// Puts these lines together at the first of them, or at the last; where each line of the stretch is then.
fn rearranged(code: &mut LoweredCode, is_load: bool, first: usize, last: usize, chosen: &[usize]) -> Vec<usize> {
    let others = (first..=last).filter(|line| !chosen.contains(line));
    let order: Vec<usize> = match is_load {
        true => chosen.iter().copied().chain(others).collect(),
        false => others.chain(chosen.iter().copied()).collect(),
    };
    let mut map = vec![0; last + 1 - first];
    order.iter().enumerate().for_each(|(n, line)| map[line - first] = first + n);
    let lines: Vec<CodeLine> = order.iter().map(|line| code.lines[*line].clone()).collect();
    let classes: Vec<LineClass> = order.iter().map(|line| code.classes[*line]).collect();
    let bits: Vec<(usize, u32)> =
        (first..=last).filter_map(|line| code.bits.remove(&line).map(|bits| (map[line - first], bits))).collect();
    code.bits.extend(bits);
    code.lines[first..=last].clone_from_slice(&lines);
    code.classes[first..=last].copy_from_slice(&classes);
    map
}
