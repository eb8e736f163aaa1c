//! What one state in vector registers would take: operations of one kind that do not wait for each other, by twos in one instruction, with the instructions that
//! bring their operands beside one another. Counted, not built: `cargo test -p straightline-jit --test suite packing:: -- --ignored --nocapture` prints the counts.
//!
//! A pair of operands costs nothing where an instruction has made it, where both are constants, or inputs that stand beside one another; a load more for
//! each other input; one instruction where registers hold both, or one number is wanted twice. A number alone costs one where it is the second
//! of its pair. Operands in memory are part of the instruction.

use std::collections::{HashMap, HashSet};
use straightline_codegen::compile::compile_programs;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::options::Options;
use straightline_codegen::Function;
use straightline_graph::expr::{Graph, NodeId, Op};

/// Where a number is.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    /// In a register of its own, or the first of two.
    Ready,
    /// The second of two.
    Second,
    Input(u32),
    Constant,
}

/// A program on its way into pairs.
struct Pairing<'a> {
    graph: &'a Graph,
    users: &'a [Vec<NodeId>],
    places: HashMap<NodeId, Place>,
    /// Pairs of numbers beside one another.
    pairs: HashSet<[NodeId; 2]>,
    instructions: usize,
}

fn is_operation(op: Op) -> bool {
    matches!(op, Op::Unary(..) | Op::Binary(..))
}

/// Whether one instruction does both.
fn is_alike(a: Op, b: Op) -> bool {
    match (a, b) {
        (Op::Binary(a, ..), Op::Binary(b, ..)) => a == b,
        (Op::Unary(a, _), Op::Unary(b, _)) => a == b,
        _ => false,
    }
}

impl Pairing<'_> {
    /// The instructions that bring two numbers beside one another.
    fn cost(&self, pair: [NodeId; 2]) -> usize {
        let [a, b] = pair.map(|id| self.places[&id]);
        match (a, b) {
            _ if self.pairs.contains(&pair) => 0,
            (Place::Constant, Place::Constant) => 0,
            (Place::Input(a), Place::Input(b)) if b == a + 1 => 0,
            (Place::Input(_) | Place::Constant, Place::Input(_) | Place::Constant) if pair[0] != pair[1] => 2,
            _ => 1,
        }
    }

    /// Operands of two operations as pairs, with what they cost: in the order of either that costs less, where they may change places.
    fn operands(&self, a: NodeId, b: NodeId) -> (usize, Vec<[NodeId; 2]>) {
        let of = |id: NodeId| self.graph.op(id).operands().collect::<Vec<_>>();
        let (first, second) = (of(a), of(b));
        let pairs = |second: &[NodeId]| -> (usize, Vec<[NodeId; 2]>) {
            let pairs: Vec<[NodeId; 2]> = first.iter().zip(second).map(|(a, b)| [*a, *b]).collect();
            (pairs.iter().map(|pair| self.cost(*pair)).sum(), pairs)
        };
        let plain = pairs(&second);
        match self.graph.op(a) {
            Op::Binary(op, ..) if op.row().commutes => {
                let other = pairs(&[second[1], second[0]]);
                if other.0 < plain.0 {
                    other
                } else {
                    plain
                }
            }
            _ => plain,
        }
    }

    /// How many operations could take a pair as it is.
    fn hopes(&self, a: NodeId, b: NodeId) -> usize {
        let alike =
            |u: &NodeId| self.users[b.index()].iter().any(|v| v != u && is_alike(self.graph.op(*u), self.graph.op(*v)));
        self.users[a.index()].iter().filter(|u| alike(u)).count()
    }

    fn alone(&mut self, id: NodeId) {
        for operand in self.graph.op(id).operands() {
            if self.places[&operand] == Place::Second {
                self.instructions += 1;
                self.places.insert(operand, Place::Ready);
            }
        }
        self.instructions += 1;
        self.places.insert(id, Place::Ready);
    }

    fn together(&mut self, a: NodeId, b: NodeId) {
        let (cost, operands) = self.operands(a, b);
        self.instructions += cost + 1;
        self.pairs.extend(operands);
        self.pairs.insert([a, b]);
        self.places.insert(a, Place::Ready);
        self.places.insert(b, Place::Second);
    }
}

/// Instructions with pairs, where a user that could take a pair is worth so much.
fn with_pairs(graph: &Graph, hope: f64) -> usize {
    let mut users = vec![Vec::new(); graph.ops.len()];
    let mut waits = vec![0; graph.ops.len()];
    let mut places = HashMap::new();
    let mut ready = Vec::new();
    let (mut sines, mut cosines) = (0, 0);
    for id in graph.ids() {
        let op = graph.op(id);
        if is_operation(op) {
            let of: Vec<NodeId> = op.operands().filter(|a| is_operation(graph.op(*a))).collect();
            waits[id.index()] = of.len();
            op.operands().for_each(|a| users[a.index()].push(id));
            if of.is_empty() {
                ready.push(id);
            }
        } else {
            let place = match op {
                Op::Input(k) => Place::Input(k),
                Op::Constant(_) => Place::Constant,
                // sines stand in memory as inputs do, and so do cosines
                Op::Sin(_) => {
                    sines += 1;
                    Place::Input(1 << 20 | sines)
                }
                Op::Cos(_) => {
                    cosines += 1;
                    Place::Input(1 << 21 | cosines)
                }
                Op::SinCos(_) | Op::AngleSum(..) | Op::Unary(..) | Op::Binary(..) => continue,
            };
            places.insert(id, place);
        }
    }
    let mut all = Pairing { graph, users: &users, places, pairs: HashSet::new(), instructions: 0 };
    while !ready.is_empty() {
        let mut best: Option<(f64, usize, usize)> = None;
        for (i, a) in ready.iter().enumerate() {
            let alike = |(j, b): &(usize, &NodeId)| *j != i && is_alike(graph.op(*a), graph.op(**b));
            for (j, b) in ready.iter().enumerate().filter(alike) {
                let gain = 1.0 - all.operands(*a, *b).0 as f64 + hope * all.hopes(*a, *b) as f64;
                if gain > 0.0 && best.is_none_or(|(most, ..)| gain > most) {
                    best = Some((gain, i, j));
                }
            }
        }
        let done = match best {
            Some((_, i, j)) => {
                let pair = [ready[i], ready[j]];
                all.together(pair[0], pair[1]);
                pair.to_vec()
            }
            // what most others wait for first
            None => {
                let next = *ready.iter().max_by_key(|id| users[id.index()].len()).expect("one is ready");
                all.alone(next);
                vec![next]
            }
        };
        ready.retain(|id| !done.contains(id));
        for id in done {
            for user in &users[id.index()] {
                waits[user.index()] -= 1;
                if waits[user.index()] == 0 {
                    ready.push(*user);
                }
            }
        }
    }
    all.instructions
}

#[test]
#[ignore = "a count: for who wants to build it"]
fn one_state_in_vector_registers_would_save_no_tenth_of_the_instructions() {
    println!("| robot, function | operations | instructions with pairs | of these |");
    println!("|---|---|---|---|");
    for (file, text, floats) in super::bits::ROBOTS.into_iter().chain([(
        "panda.urdf",
        include_str!("../../../robots/descriptions/panda.urdf"),
        false,
    )]) {
        for function in [Function::InverseDynamics, Function::MassMatrix, Function::ForwardDynamics] {
            let mut options = Options { functions: vec![function], ..Options::default() };
            options.model.floating_base = floats;
            let Ok(programs) = compile_programs(&Source::new(file, text), &options) else { continue };
            for program in &programs.programs {
                let graph = &program.graph;
                let operations = graph.ids().filter(|id| is_operation(graph.op(*id))).count();
                let packed = [0.0, 0.2, 0.5, 1.0].map(|hope| with_pairs(graph, hope)).into_iter().min().expect("some");
                let share = packed as f64 / operations as f64;
                println!("| {file}, {} | {operations} | {packed} | {share:.2} |", function.name());
                assert!(share > 0.9, "it would pay: {file}, {}", function.name());
            }
        }
    }
}
