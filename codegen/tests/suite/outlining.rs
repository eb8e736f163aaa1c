//! Whether parts of long functions that repeat would be worth a function of their own on a Cortex-M4F. They would not: an expression that
//! occurs often is small, and what a call takes is about as much.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use straightline_codegen::choices::TargetMachine;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::options::Options;
use straightline_codegen::{compile, Function, Scalar};
use straightline_graph::expr::{Binary, Graph, NodeId, Op};

/// Bytes of an instruction of the floating-point unit, of a call, and of what stands around the body of a function.
const BYTES: [f64; 3] = [4.0, 4.0, 8.0];
/// How deep expressions are.
const DEEPEST: usize = 5;

/// An expression: its operations, and what it takes.
#[derive(Clone)]
struct RepeatedExpression {
    nodes: Vec<NodeId>,
    leaves: Vec<NodeId>,
    form: String,
}

/// The expression of a node whose other operations are of single use, down to a depth.
fn expression(graph: &Graph, uses: &[u32], root: NodeId, depth: usize) -> RepeatedExpression {
    fn visit(graph: &Graph, uses: &[u32], id: NodeId, depth: usize, is_root: bool, into: &mut RepeatedExpression) {
        match graph.op(id) {
            Op::Binary(binary, a, b) if is_root || (uses[id.index()] == 1 && depth > 0) => {
                into.nodes.push(id);
                into.form += &format!("({binary:?} ");
                visit(graph, uses, a, depth.saturating_sub(1), false, into);
                into.form.push(' ');
                visit(graph, uses, b, depth.saturating_sub(1), false, into);
                into.form.push(')');
            }
            _ => {
                let known = into.leaves.iter().position(|leaf| *leaf == id);
                into.form += &format!("x{}", known.unwrap_or(into.leaves.len()));
                if known.is_none() {
                    into.leaves.push(id);
                }
            }
        }
    }
    let mut found = RepeatedExpression { nodes: Vec::new(), leaves: Vec::new(), form: String::new() };
    visit(graph, uses, root, depth, true, &mut found);
    found
}

/// Expressions of at least three operations, and pairs of them over the same values, such as a turn of a vector, by their forms.
fn expressions(graph: &Graph) -> BTreeMap<String, Vec<RepeatedExpression>> {
    let uses = graph.uses();
    let mut found: BTreeMap<String, Vec<RepeatedExpression>> = BTreeMap::new();
    for depth in 1..=DEEPEST {
        let mut of_leaves: BTreeMap<Vec<NodeId>, Vec<RepeatedExpression>> = BTreeMap::new();
        for id in graph.ids().filter(|id| matches!(graph.op(*id), Op::Binary(..))) {
            let own = expression(graph, &uses, id, depth);
            if own.nodes.len() >= 3 {
                let mut leaves = own.leaves.clone();
                leaves.sort_unstable();
                of_leaves.entry(leaves).or_default().push(own.clone());
                found.entry(own.form.clone()).or_default().push(own);
            }
        }
        for (a, b) in of_leaves.values().flat_map(|group| group.iter().flat_map(|a| group.iter().map(move |b| (a, b))))
        {
            if a.nodes[0] < b.nodes[0] && !a.nodes.iter().any(|node| b.nodes.contains(node)) {
                let order = b.leaves.iter().map(|leaf| a.leaves.iter().position(|other| other == leaf));
                let form = format!("{} and {} of {:?}", a.form, b.form, order.collect::<Vec<_>>());
                let nodes = [a.nodes.clone(), b.nodes.clone()].concat();
                found.entry(form.clone()).or_default().push(RepeatedExpression {
                    nodes,
                    leaves: a.leaves.clone(),
                    form,
                });
            }
        }
    }
    found
}

/// Instructions of some operations, a product and a sum in one.
fn instructions(graph: &Graph, nodes: &[NodeId]) -> usize {
    let is_product = |id: &NodeId| nodes.contains(id) && matches!(graph.op(*id), Op::Binary(Binary::Mul, ..));
    let takes_one = |id: &NodeId| match graph.op(*id) {
        Op::Binary(Binary::Add | Binary::Sub, a, b) => is_product(&a) || is_product(&b),
        _ => false,
    };
    nodes.len() - nodes.iter().filter(|id| takes_one(id)).count()
}

/// Bytes that functions for repeated expressions would save at most, and how many functions, if such a part of the arguments is moved.
fn saved(graph: &Graph, moved: f64) -> (f64, usize) {
    let all = expressions(graph);
    let (mut taken, mut bytes, mut functions) = (BTreeSet::new(), 0.0, 0);
    loop {
        let mut best = (0.0, Vec::new());
        for of_form in all.values() {
            let (mut own, mut count) = (BTreeSet::new(), 0.0);
            for expression in of_form {
                if expression.nodes.iter().all(|node| !taken.contains(node) && !own.contains(node)) {
                    own.extend(expression.nodes.iter().copied());
                    count += 1.0;
                }
            }
            let body = BYTES[0] * instructions(graph, &of_form[0].nodes) as f64;
            let call = BYTES[1] + BYTES[0] * moved * of_form[0].leaves.len() as f64;
            let gain = count * (body - call) - body - BYTES[2];
            if gain > best.0 {
                best = (gain, own.into_iter().collect());
            }
        }
        if best.1.is_empty() {
            return (bytes, functions);
        }
        bytes += best.0;
        functions += 1;
        taken.extend(best.1);
    }
}

fn is_not_worth_it(robots: &[(&str, bool)]) {
    for (name, floats) in robots.iter().copied() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(name);
        let robot = Source::new(name, std::fs::read_to_string(path).expect("the robot is there"));
        let functions =
            vec![Function::InverseDynamics, Function::GravityForce, Function::MassMatrix, Function::ForwardDynamics];
        let target = Some(TargetMachine::CORTEX_M4F);
        let mut options = Options { scalar: Scalar::F32, target, functions, ..Options::default() };
        options.model.floating_base = floats;
        let generated = compile(&robot, &options).unwrap_or_else(|errors| panic!("{errors}"));
        for function in &generated.programs.functions {
            let estimate = generated.report.functions[function.name.as_str()].estimate.expect("a Cortex-M4F");
            let [(none, kinds), (half, _)] = [0.0, 0.5].map(|moved| saved(&function.graph, moved));
            println!(
                "{name} {}: {none} of {} bytes by {kinds} functions if no argument is moved, {half} if every other one is",
                function.name, estimate.flash_bytes
            );
            assert!(half <= 0.015 * estimate.flash_bytes as f64, "{name} {}: {half} bytes", function.name);
        }
    }
}

#[test]
fn repeated_expressions_of_arms_are_not_worth_functions_of_their_own() {
    is_not_worth_it(&[("ur5.urdf", false), ("puma560.urdf", false), ("panda.urdf", false)]);
}

#[test]
#[ignore = "slow proof: orders of a quadruped"]
fn slow_proof_that_those_of_a_quadruped_are_not_either() {
    is_not_worth_it(&[("solo12.urdf", true)]);
}
