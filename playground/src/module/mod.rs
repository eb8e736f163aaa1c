//! A robot's own functions as a module of WebAssembly: of the checked programs, operation by operation, with the sines that generated code has. So
//! its bits are those of the generated code; the page compares them with the programs run by the interpreter before it shows anything.

mod encoder;
mod sines;

use encoder::{module, FunctionBody, Simple};
use straightline_codegen::program::TracedProgram;
use straightline_core::Dd;
use straightline_graph::expr::{Binary, Graph, NodeId, Op, Sines, Unary};

/// Browsers take functions of 50 000 locals.
const MOST_LOCALS: usize = 49_000;

/// A module, and where its numbers stand.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotModule {
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// The place of the first result in the memory, counted in numbers; inputs stand from 0 on.
    pub results_at: usize,
}

/// The module of some programs, each under the name of its function.
///
/// # Errors
/// In words, why there is none.
pub fn of_programs(programs: &[TracedProgram]) -> Result<RobotModule, String> {
    let inputs = |graph: &Graph| graph.inputs.iter().map(|port| port.len()).sum::<usize>();
    let results_at = programs.iter().map(|p| inputs(&p.graph)).max().unwrap_or(0);
    let results = programs.iter().map(|p| p.graph.results.len()).max().unwrap_or(0);
    let mut functions = Vec::new();
    for program in programs {
        let name = program.function.name();
        let graph = &program.graph;
        if !graph.formats.is_empty() || graph.sines != Sines::Precise {
            return Err(format!("{name} is not in double precision"));
        }
        if graph.ops.len() > MOST_LOCALS {
            return Err(format!(
                "{name} takes {} operations, browsers take {MOST_LOCALS} in one function",
                graph.ops.len()
            ));
        }
        functions.push((name, ProgramWriter::new(graph, results_at as u32).written()));
    }
    Ok(RobotModule { bytes: module(&sines::sines(), &functions, results_at + results), results_at })
}

/// Writes the operations of a graph, a local for each value.
struct ProgramWriter<'a> {
    graph: &'a Graph,
    results_at: u32,
    body: FunctionBody,
    /// The local of each node that has one.
    locals: Vec<u32>,
}

/// Locals for a sum of angles: the sum, its tail, the next sum, what was added.
const SUM: u32 = 0;
const TAIL: u32 = 1;
const NEXT: u32 = 2;
const ADDED: u32 = 3;

impl<'a> ProgramWriter<'a> {
    fn new(graph: &'a Graph, results_at: u32) -> Self {
        let (mut locals, mut count) = (Vec::with_capacity(graph.ops.len()), ADDED + 1);
        for op in &graph.ops {
            locals.push(count);
            count += match op {
                Op::Input(_) | Op::Constant(_) | Op::AngleSum(..) | Op::Sin(_) | Op::Cos(_) => 0,
                // a cosine stands behind its sine
                Op::SinCos(_) => 2,
                _ => 1,
            };
        }
        ProgramWriter { graph, results_at, body: FunctionBody::new(0, count, 0), locals }
    }

    fn written(mut self) -> FunctionBody {
        for id in self.graph.ids() {
            self.write(id);
        }
        for (k, id) in self.graph.results.iter().enumerate() {
            let place = self.results_at + k as u32;
            let (graph, locals) = (self.graph, &self.locals);
            self.body.store(place, |body| operand(graph, locals, body, *id));
        }
        self.body
    }

    fn operand(&mut self, id: NodeId) {
        operand(self.graph, &self.locals, &mut self.body, id);
    }

    fn write(&mut self, id: NodeId) {
        let local = self.locals[id.index()];
        match self.graph.op(id) {
            Op::Input(_) | Op::Constant(_) | Op::AngleSum(..) | Op::Sin(_) | Op::Cos(_) => {}
            Op::Unary(op, a) => {
                self.operand(a);
                match op {
                    Unary::Neg => drop(self.body.op(Simple::Negate)),
                    Unary::Sqrt => drop(self.body.op(Simple::Root)),
                    Unary::Sign => self.sign(),
                }
                self.body.set(local);
            }
            Op::Binary(op, a, b) => {
                self.operand(a);
                self.operand(b);
                let op = match op {
                    Binary::Add => Simple::Add,
                    Binary::Sub => Simple::Subtract,
                    Binary::Mul => Simple::Multiply,
                    Binary::Div => Simple::Divide,
                };
                self.body.op(op).set(local);
            }
            Op::SinCos(angle) => {
                self.angle(&self.graph.angle_terms(angle));
                self.body.op(Simple::Call0).set(local + 1).set(local);
            }
        }
    }

    /// −1, 0 or 1 of the number on the stack; NaN of NaN.
    fn sign(&mut self) {
        let body = self.body.set(SUM);
        body.get(SUM);
        body.get(SUM).number(0.0).op(Simple::F64Greater).get(SUM).number(0.0).op(Simple::F64Less).op(Simple::I32Sub);
        body.op(Simple::OfI32);
        body.get(SUM).get(SUM).op(Simple::F64Differs).op(Simple::Select);
    }

    /// A sum of angles and its tail: TwoSum, term by term, as `Real::sum_of_angles`.
    fn angle(&mut self, terms: &[NodeId]) {
        self.operand(terms[0]);
        if terms.len() == 1 {
            self.body.number(0.0);
            return;
        }
        self.body.set(SUM).number(0.0).set(TAIL);
        for term in &terms[1..] {
            // next = sum + angle, added = next − sum
            self.body.get(SUM);
            self.operand(*term);
            self.body.op(Simple::Add).set(NEXT).get(NEXT).get(SUM).op(Simple::Subtract).set(ADDED);
            // tail + ((sum − (next − added)) + (angle − added))
            self.body.get(TAIL).get(SUM).get(NEXT).get(ADDED).op(Simple::Subtract).op(Simple::Subtract);
            self.operand(*term);
            self.body.get(ADDED).op(Simple::Subtract).op(Simple::Add).op(Simple::Add).set(TAIL);
            self.body.get(NEXT).set(SUM);
        }
        self.body.get(SUM).get(TAIL);
    }
}

/// The value of a node.
fn operand(graph: &Graph, locals: &[u32], body: &mut FunctionBody, id: NodeId) {
    match graph.op(id) {
        Op::Input(k) => body.load(k),
        Op::Constant(c) => body.number(Dd::to_f64(c.value())),
        Op::Sin(pair) => body.get(locals[pair.index()]),
        Op::Cos(pair) => body.get(locals[pair.index()] + 1),
        _ => body.get(locals[id.index()]),
    };
}
