//! One program as one public function, or as a public function over private parts.

use super::fused::{fusions, Fused};
use super::{number, Names, Scalar, Style};
use crate::identifier::comment;
use std::fmt::Write;
use std::slice::from_ref;
use straightline_graph::expr::op::Text;
use straightline_graph::expr::{Constant, Graph, NodeId, Op, Port, Precision, Section, Unary};
use straightline_graph::schedule::{Part, Schedule};

/// How long an expression may grow before it gets a name of its own.
const LINE: usize = 84;
/// What makes sense in code that a person writes: no numbers near π/4, no locals declared before their values.
pub(super) const ALLOW: &str = "#[allow(clippy::all)]";
/// How many locals one declaration may hold.
const DECLARATION: usize = 64;

/// The source of a function.
#[derive(Clone, Debug)]
pub struct FunctionText {
    /// The items: the function, and its parts if it has any.
    pub text: String,
    /// Whether it calls the sine-cosine kernel.
    pub uses_sin_cos: bool,
    /// Whether it calls the square root.
    pub uses_sqrt: bool,
}

impl FunctionText {
    fn new() -> Self {
        FunctionText { text: String::new(), uses_sin_cos: false, uses_sqrt: false }
    }

    /// A comment in the place of a function.
    pub fn remark(text: &str) -> Self {
        FunctionText { text: format!("// {text}\n"), ..FunctionText::new() }
    }

    /// Whether it needs [`super::kernel`] as a module `trig`.
    pub fn calls_kernel(&self) -> bool {
        self.uses_sin_cos || self.uses_sqrt
    }
}

/// Writes `pub fn name(q: &[f64; 7], …, tau: &mut [f64; 7])`, or over lanes
/// `pub fn name<const N: usize>(q: &[[f64; N]; 7], …, tau: &mut [[f64; N]; 7])`.
///
/// `doc` stands above it, line by line; `title` words the comment above a section's block.
pub fn function(
    graph: &Graph,
    schedule: &Schedule,
    name: &str,
    doc: &str,
    style: Style,
    title: &dyn Fn(Section) -> String,
) -> FunctionText {
    let mut out = FunctionText::new();
    for line in doc.lines() {
        let _ = writeln!(out.text, "///{}{line}", if line.is_empty() { "" } else { " " });
    }
    let all_nodes = schedule.parts.iter().flat_map(|p| p.nodes.iter().copied()).chain(graph.results.iter().copied());
    let all_used = used_inputs(graph, all_nodes);
    let parameters = |f: &mut dyn FnMut(&Port, bool, bool) -> String| {
        let inputs = graph.inputs.iter().enumerate().map(|(i, p)| (p, all_used[i], false));
        let outputs = graph.outputs.iter().map(|p| (p, true, true));
        inputs.chain(outputs).map(|(p, used, out)| f(p, used, out)).collect::<Vec<_>>().join(", ")
    };
    let signature = parameters(&mut |p, used, out| {
        let (underscore, reference) = (if used { "" } else { "_" }, if out { "&mut " } else { "&" });
        format!("{underscore}{}: {reference}{}", p.name, style.array_type(p))
    });
    // a body over lanes becomes part of its caller, and takes the caller's vector instructions
    let (inline, part_inline) = match style.lanes {
        true => ("\n#[inline(always)]", "#[inline(always)]"),
        false => ("", "#[inline(never)]"),
    };
    let generics = style.generics();
    if let [part] = schedule.parts.as_slice() {
        let _ = writeln!(out.text, "{ALLOW}{inline}\npub fn {name}{generics}({signature}) {{");
        body(graph, part, style, title, &mut out);
        out.text.push_str("}\n");
        return out;
    }

    // in parts: the public function calls them one after the other
    let slots = schedule.slots;
    let _ = writeln!(out.text, "{ALLOW}{inline}\npub fn {name}{generics}({signature}) {{");
    let _ = writeln!(
        out.text,
        "    let mut live = [{}; {slots}];",
        first_used(graph, &all_used, style).unwrap_or(style.zero().into())
    );
    let mut parts = String::new();
    for (k, part) in schedule.parts.iter().enumerate() {
        let used = used_inputs(graph, nodes_of(graph, part));
        let mut writes = vec![false; graph.outputs.len()];
        part.results.iter().for_each(|r| writes[port_of(&graph.outputs, *r).0] = true);
        let mut arguments = Vec::new();
        let mut types = Vec::new();
        for (i, p) in graph.inputs.iter().enumerate().filter(|(i, _)| used[*i]) {
            let _ = i;
            arguments.push(p.name.to_string());
            types.push(format!("{}: &{}", p.name, style.array_type(p)));
        }
        if !(part.loads.is_empty() && part.stores.is_empty()) {
            let m = if part.stores.is_empty() { "" } else { "mut " };
            arguments.push(format!("&{m}live"));
            types.push(format!("live: &{m}[{}; {slots}]", style.element_type()));
        }
        for (i, p) in graph.outputs.iter().enumerate() {
            if writes[i] {
                arguments.push(p.name.to_string());
                types.push(format!("{}: &mut {}", p.name, style.array_type(p)));
            }
        }
        let called = if style.lanes && style.fused { "::<N, FUSED>" } else { "" };
        let _ = writeln!(out.text, "    {name}_part{}{called}({});", k + 1, arguments.join(", "));
        let mut text = FunctionText::new();
        body(graph, part, style, title, &mut text);
        let _ = writeln!(parts, "\n{ALLOW}\n{part_inline}\nfn {name}_part{}{generics}({}) {{", k + 1, types.join(", "));
        parts.push_str(&text.text);
        parts.push_str("}\n");
        out.uses_sin_cos |= text.uses_sin_cos;
        out.uses_sqrt |= text.uses_sqrt;
    }
    out.text.push_str("}\n");
    out.text.push_str(&parts);
    out
}

/// What a part computes, and the results that it stores.
fn nodes_of<'a>(graph: &'a Graph, part: &'a Part) -> impl Iterator<Item = NodeId> + 'a {
    part.nodes.iter().copied().chain(part.results.iter().map(|r| graph.results[*r]))
}

/// Which input ports these nodes read.
fn used_inputs(graph: &Graph, nodes: impl Iterator<Item = NodeId>) -> Vec<bool> {
    let mut used = vec![false; graph.inputs.len()];
    nodes.for_each(|id| {
        for a in graph.op(id).operands().flat_map(|a| graph.angle_terms(a)).chain([id]) {
            if let Op::Input(k) = graph.op(a) {
                used[port_of(&graph.inputs, k as usize).0] = true;
            }
        }
    });
    used
}

/// The first number of the inputs that are read anyway: [`emit::filler`](super::filler) of a body of one state.
fn first_used(graph: &Graph, used: &[bool], style: Style) -> Option<String> {
    let mut plain = graph.inputs.iter().zip(used).filter(|(p, used)| **used && p.wrapper.is_none()).map(|(p, _)| p);
    plain.next().filter(|_| !style.lanes && !style.generic).map(|port| style.element(port, 0))
}

/// The port that holds flat index `k`, and the index inside it.
fn port_of(ports: &[Port], mut k: usize) -> (usize, usize) {
    for (i, p) in ports.iter().enumerate() {
        if k < p.len() {
            return (i, k);
        }
        k -= p.len();
    }
    unreachable!("verified graphs have a port for every scalar")
}

/// How strongly an expression binds.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Binding {
    Sum,
    Product,
    Sign,
    Atom,
}

/// The statements of one part: expressions of single use are written where they are used.
pub(super) struct Body<'a> {
    pub graph: &'a Graph,
    pub style: Style,
    /// Sums that take a product in.
    fused: Vec<Option<Fused>>,
    /// What stands for each node: its name, its literal, or its expression.
    pub text: Vec<Option<(String, Binding)>>,
    /// Sine-cosine pairs that are written already.
    paired: Vec<bool>,
    pub names: Names,
    /// Locals, with their types, and statements of the block being written.
    declared: Vec<(String, Scalar)>,
    pub statements: String,
}

/// The statements of one part; over lanes, in a loop over them.
fn body(graph: &Graph, part: &Part, style: Style, title: &dyn Fn(Section) -> String, out: &mut FunctionText) {
    if !style.lanes {
        return statements(graph, part, style, title, out);
    }
    let mut inner = FunctionText::new();
    statements(graph, part, style, title, &mut inner);
    out.text.push_str("    for lane in 0..N {\n");
    for line in inner.text.lines() {
        let _ = writeln!(out.text, "    {line}");
    }
    out.text.push_str("    }\n");
    out.uses_sin_cos |= inner.uses_sin_cos;
    out.uses_sqrt |= inner.uses_sqrt;
}

fn statements(graph: &Graph, part: &Part, style: Style, title: &dyn Fn(Section) -> String, out: &mut FunctionText) {
    let taken = graph
        .inputs
        .iter()
        .chain(&graph.outputs)
        .map(|p| p.name.as_str())
        .chain(["live", "trig", "lane", "fma", "fma_if", "fused", "number"]);
    let (mut b, absorbed) = Body::new(graph, part, style, Names::with_taken(taken));
    let mut uses = vec![0u32; graph.ops.len()];
    for id in &part.nodes {
        graph.op(*id).operands().for_each(|a| uses[a.index()] += 1);
    }
    let mut results_of: Vec<(NodeId, usize)> = part.results.iter().map(|r| (graph.results[*r], *r)).collect();
    results_of.sort_unstable();
    results_of.iter().for_each(|(id, _)| uses[id.index()] += 1);
    let mut crosses = vec![false; graph.ops.len()];
    part.stores.iter().for_each(|(id, _)| crosses[id.index()] = true);

    if !part.loads.is_empty() {
        for chunk in part.loads.chunks(DECLARATION) {
            let names: Vec<String> = chunk.iter().map(|(id, _)| b.fresh_name(*id)).collect();
            let slots: Vec<String> = chunk.iter().map(|(_, s)| format!("live[{s}]{}", style.lane())).collect();
            out.text.push_str(&wrapped(
                "    let [",
                &names,
                &format!("]: [{}; {}] =", style.scalar_name(), names.len()),
            ));
            out.text.push_str(&wrapped("        [", &slots, "];"));
            for ((id, _), name) in chunk.iter().zip(names) {
                b.text[id.index()] = Some((name, Binding::Atom));
            }
        }
    }
    let mut plan = Plan { part, uses, results_of, crosses, absorbed, arrays: Vec::new() };
    if style.lanes || graph.alike.is_empty() {
        b.run(&part.nodes, &plan, title, out);
    } else {
        b.with_loops(&mut plan, title, out);
    }
    // results that are constants or inputs
    let mut plain = String::new();
    for (id, k) in &plan.results_of {
        if matches!(graph.op(*id), Op::Input(_) | Op::Constant(_)) {
            b.store_result(*id, *k);
        }
    }
    std::mem::swap(&mut plain, &mut b.statements);
    out.text.push_str(&plain);
}

/// What is known of a part before its statements are written.
pub(super) struct Plan<'a> {
    pub part: &'a Part,
    pub uses: Vec<u32>,
    /// Results by their nodes, in the order of those.
    pub results_of: Vec<(NodeId, usize)>,
    /// What needs a name, because something else than a statement here uses it.
    pub crosses: Vec<bool>,
    pub absorbed: Vec<bool>,
    /// Of a loop over limbs what goes into arrays, by its nodes, in the order of those, and the places there.
    pub arrays: Vec<(NodeId, String)>,
}

impl<'a> Body<'a> {
    /// Before its first statement, and which products sums take in.
    pub fn new(graph: &'a Graph, part: &Part, style: Style, names: Names) -> (Body<'a>, Vec<bool>) {
        let (fused, absorbed) = match style.fused {
            true => fusions(graph, part),
            false => (vec![None; graph.ops.len()], vec![false; graph.ops.len()]),
        };
        let body = Body {
            graph,
            style,
            fused,
            text: vec![None; graph.ops.len()],
            paired: vec![false; graph.ops.len()],
            names,
            declared: Vec::new(),
            statements: String::new(),
        };
        (body, absorbed)
    }

    /// What an array of a part holds before its elements are computed.
    pub fn filler(&self, part: &Part) -> String {
        let used = used_inputs(self.graph, nodes_of(self.graph, part));
        let has_live = !(part.loads.is_empty() || self.style.lanes || self.style.generic);
        let of_part = first_used(self.graph, &used, self.style).or_else(|| has_live.then(|| "live[0]".to_string()));
        of_part.unwrap_or_else(|| self.style.zero().to_string())
    }

    /// The statements of these nodes of a part.
    pub fn run(
        &mut self,
        nodes: &[NodeId],
        plan: &Plan<'_>,
        title: &dyn Fn(Section) -> String,
        out: &mut FunctionText,
    ) {
        let (graph, style, part) = (self.graph, self.style, plan.part);
        let (uses, results_of, crosses) = (&plan.uses, &plan.results_of, &plan.crosses);
        let b = self;
        let mut section = None;
        for (k, id) in nodes.iter().enumerate() {
            let op = graph.op(*id);
            let here = graph.notes[id.index()].section;
            if section != Some(here) {
                b.close_block(out, section, title);
                section = Some(here);
            }
            match op {
                Op::AngleSum(..) => {}
                Op::SinCos(_) => {
                    out.uses_sin_cos |= !style.generic;
                    if !b.paired[id.index()] {
                        let section_of = |n: &NodeId| graph.notes[n.index()].section;
                        let block = nodes[k..].iter().take_while(|n| section_of(n) == here);
                        b.sin_cos(block, uses, part);
                    }
                }
                Op::Sin(_) | Op::Cos(_) => {}
                _ if plan.absorbed[id.index()] => {}
                _ => {
                    out.uses_sqrt |= op.row().is_some_and(|row| matches!(row.text, Text::Call(_))) && !style.generic;
                    let (text, binding) = match b.fused[id.index()] {
                        Some(fused) => (b.fma(fused), Binding::Atom),
                        None => b.node(*id),
                    };
                    let named = graph.notes[id.index()].name.is_some();
                    // a sign before a name is written wherever it is used; an operation is not
                    let trivial = matches!(op, Op::Unary(Unary::Neg, _)) && text.len() < 24 && !text.contains("fma");
                    let alone = uses[id.index()] <= 1 && !crosses[id.index()];
                    let result_only = alone && results_of.binary_search_by_key(id, |(r, _)| *r).is_ok();
                    if (trivial && !crosses[id.index()])
                        || result_only
                        || (alone && !named && text.len() < LINE * 2 / 3)
                    {
                        b.text[id.index()] = Some((text, binding));
                    } else {
                        let name = b.fresh_name(*id);
                        let _ = writeln!(b.statements, "    {name} = {text};");
                        b.declared.push((name.clone(), b.scalar_of(*id)));
                        b.text[id.index()] = Some((name, Binding::Atom));
                    }
                }
            }
            let first = results_of.partition_point(|(r, _)| r < id);
            for (_, k) in results_of[first..].iter().take_while(|(r, _)| r == id) {
                b.store_result(*id, *k);
            }
            if let Ok(i) = part.stores.binary_search_by_key(id, |(s, _)| *s) {
                let text = b.operand(*id).0;
                let _ = writeln!(b.statements, "    live[{}]{} = {text};", part.stores[i].1, style.lane());
            }
            if let Ok(i) = plan.arrays.binary_search_by_key(id, |(n, _)| *n) {
                let text = b.operand(*id).0;
                let _ = writeln!(b.statements, "    {} = {text};", plan.arrays[i].1);
            }
        }
        b.close_block(out, section, title);
    }
}

impl Body<'_> {
    fn fresh_name(&mut self, id: NodeId) -> String {
        match self.graph.notes[id.index()].name {
            Some((quantity, index, component)) => self.names.named(quantity, index, component),
            None => self.names.temporary(),
        }
    }

    /// The text of a node as an operand.
    pub fn operand(&self, id: NodeId) -> (String, Binding) {
        match self.graph.op(id) {
            // what a loop takes from outside
            _ if self.text[id.index()].is_some() => self.text[id.index()].clone().expect("it is there"),
            Op::Input(k) => {
                let (port, k) = port_of(&self.graph.inputs, k as usize);
                (self.style.element(&self.graph.inputs[port], k), Binding::Atom)
            }
            Op::Constant(c) => {
                let sign = c.is_negative() && !self.style.generic;
                let held = self.scalar_of(id);
                let style = if held == self.style.scalar { self.style } else { Style::plain(held) };
                (literal(c, style), if sign { Binding::Sign } else { Binding::Atom })
            }
            _ => panic!("operands stand before their users"),
        }
    }

    /// The type of a node's text.
    fn scalar_of(&self, id: NodeId) -> Scalar {
        self.graph.precision(id, self.style.scalar).held
    }

    /// The text of a node as an operand of this type, to which others are widened where a program is in mixed precision.
    fn operand_in(&self, id: NodeId, scalar: Scalar) -> (String, Binding) {
        if self.scalar_of(id) == scalar {
            return self.operand(id);
        }
        (format!("{}::from({})", scalar.name(), self.typed(id)), Binding::Atom)
    }

    /// The text of a node that says its type: what `f64::from` takes.
    fn typed(&self, id: NodeId) -> String {
        let text = self.operand(id).0;
        match self.graph.op(id) {
            Op::Constant(_) => format!("{text}_{}", self.scalar_of(id).name()),
            _ => text,
        }
    }

    /// The text of an operation; one in f64 that is used in f32 is rounded.
    fn node(&self, id: NodeId) -> (String, Binding) {
        let op = self.graph.op(id);
        let Precision { computed, held } = self.graph.precision(id, self.style.scalar);
        match computed == held {
            true => self.expression(op, computed),
            false => (format!("(({}) as {})", self.expression(op, computed).0, held.name()), Binding::Atom),
        }
    }

    /// The text of a node, in parentheses if it binds less than `at_least`.
    fn bound(&self, id: NodeId, at_least: Binding) -> String {
        self.bound_in(id, at_least, self.style.scalar)
    }

    fn bound_in(&self, id: NodeId, at_least: Binding, scalar: Scalar) -> String {
        let (text, binding) = self.operand_in(id, scalar);
        if binding < at_least {
            format!("({text})")
        } else {
            text
        }
    }

    /// `fma(a, b, c)`; changes of sign are part of the instruction.
    fn fma(&self, Fused { negated, factors: (x, y), other: (c, subtracted) }: Fused) -> String {
        let signed = |id, minus: bool| match minus {
            true => format!("-{}", self.bound(id, Binding::Atom)),
            false => self.operand(id).0,
        };
        let function = if self.style.lanes { "fma_if::<FUSED>" } else { "fma" };
        format!("{function}({}, {}, {})", signed(x, negated), self.operand(y).0, signed(c, subtracted))
    }

    fn expression(&self, op: Op, scalar: Scalar) -> (String, Binding) {
        use Binding::{Atom, Product, Sign, Sum};
        let row = op.row().expect("leaves and angles are written where they are used");
        let bound = |id: NodeId, at_least: Binding| self.bound_in(id, at_least, scalar);
        match (row.text, op) {
            (Text::Sum(sign), Op::Binary(_, a, b)) => (format!("{} {sign} {}", bound(a, Sum), bound(b, Product)), Sum),
            (Text::Product(sign), Op::Binary(_, a, b)) => {
                (format!("{} {sign} {}", bound(a, Product), bound(b, Sign)), Product)
            }
            (Text::Sign(sign), Op::Unary(_, a)) => (format!("{sign}{}", bound(a, Atom)), Sign),
            (Text::Call(function), _) => {
                let operands: Vec<String> = op.operands().map(|a| self.operand(a).0).collect();
                (format!("{}({})", self.style.kernel(function), operands.join(", ")), Atom)
            }
            _ => unreachable!("sums and products have two operands, signs one"),
        }
    }

    /// `(sin_q3, cos_q3) = trig::sin_cos_f64(q[2]);` for one angle; the angles of a block that are known already go
    /// through one call in lanes, which the compiler turns into vector instructions.
    fn sin_cos<'n>(&mut self, block: impl Iterator<Item = &'n NodeId>, uses: &[u32], part: &Part) {
        let terms_of = |a: NodeId| -> Vec<String> {
            self.graph.angle_terms(a).into_iter().map(|term| self.operand(term).0).collect()
        };
        let angles: Vec<(NodeId, Vec<String>)> = block
            .filter_map(|id| match self.graph.op(*id) {
                Op::SinCos(a) if self.is_written(a) => Some((*id, terms_of(a))),
                _ => None,
            })
            .collect();
        let mut halves = [Vec::new(), Vec::new()];
        for (pair, _) in &angles {
            self.paired[pair.index()] = true;
            for (half, names) in [Op::Sin(*pair), Op::Cos(*pair)].into_iter().zip(&mut halves) {
                let id = (pair.0 + 1..pair.0 + 3).map(NodeId).find(|h| self.graph.ops.get(h.index()) == Some(&half));
                let wanted = id.filter(|id| uses[id.index()] > 0 || part.stores.iter().any(|(s, _)| s == id));
                names.push(match wanted {
                    Some(id) => {
                        let name = self.fresh_name(id);
                        self.text[id.index()] = Some((name.clone(), Binding::Atom));
                        name
                    }
                    None => "_".to_string(),
                });
            }
        }
        let [sines, cosines] = halves;
        if self.style.lanes {
            // the loop around the body has the lanes
            for ((s, c), (_, angle)) in sines.iter().zip(&cosines).zip(&angles) {
                self.sin_cos_call(from_ref(s), from_ref(c), &[angle]);
            }
            return;
        }
        // a call fills the widest vectors there are; more at once would not stay in registers
        let most = 64 / self.style.scalar.bytes();
        for ((angles, sines), cosines) in angles.chunks(most).zip(sines.chunks(most)).zip(cosines.chunks(most)) {
            let angles: Vec<&Vec<String>> = angles.iter().map(|(_, terms)| terms).collect();
            self.sin_cos_call(sines, cosines, &angles);
        }
    }

    /// Sines and cosines of some angles, each a sum of terms, by one call of the kernel.
    fn sin_cos_call(&mut self, sines: &[String], cosines: &[String], angles: &[&Vec<String>]) {
        // a sum goes through with what its rounding lost
        let sums = angles.iter().any(|terms| terms.len() > 1);
        let argument = |terms: &&Vec<String>| match (sums, terms.as_slice()) {
            (false, terms) => terms[0].clone(),
            (true, [angle]) if self.style.generic => format!("[{angle}, T::zero()]"),
            (true, [angle]) => format!("[{angle}, 0.0]"),
            (true, terms) if self.style.generic => format!("T::sum_of_angles(&[{}])", terms.join(", ")),
            (true, terms) => format!("{}([{}])", self.style.kernel("sum_of_angles"), terms.join(", ")),
        };
        let arguments: Vec<String> = angles.iter().map(argument).collect();
        let (single, several) = match (sums, self.style.generic) {
            (false, _) => ("sin_cos", "sin_cos_lanes"),
            (true, false) => ("sin_cos_of_sum", "sin_cos_lanes_of_sums"),
            (true, true) => ("sin_cos_of_pair", "sin_cos_lanes_of_pairs"),
        };
        if let ([s], [c], [angle]) = (sines, cosines, arguments.as_slice()) {
            let single = self.style.sin_cos(single);
            let _ = writeln!(self.statements, "    let ({s}, {c}) = {single}({angle});");
        } else {
            let several = self.style.sin_cos(several);
            self.statements.push_str(&wrapped("    let ([", sines, "],"));
            self.statements.push_str(&wrapped("        [", cosines, "]) ="));
            self.statements.push_str(&wrapped(&format!("        {several}(["), &arguments, "]);"));
        }
    }

    /// Whether a node can be used as an operand by now.
    fn is_written(&self, id: NodeId) -> bool {
        matches!(self.graph.op(id), Op::Input(_) | Op::Constant(_) | Op::AngleSum(..))
            || self.text[id.index()].is_some()
    }

    pub fn store_result(&mut self, id: NodeId, k: usize) {
        let (port, inner) = port_of(&self.graph.outputs, k);
        let place = self.style.element(&self.graph.outputs[port], inner);
        let _ = writeln!(self.statements, "    {place} = {};", self.operand(id).0);
    }

    /// Writes the block: its comment, its locals, its statements.
    fn close_block(&mut self, out: &mut FunctionText, section: Option<u32>, title: &dyn Fn(Section) -> String) {
        if self.statements.is_empty() {
            return;
        }
        if let Some(s) = section {
            let title = title(self.graph.sections[s as usize]);
            if !title.is_empty() {
                let _ = writeln!(out.text, "    // {}", comment(&title));
            }
        }
        for scalar in [Scalar::F32, Scalar::F64] {
            let own = scalar == self.style.scalar;
            let scalar_name = if own { self.style.scalar_name() } else { scalar.name() };
            let names = self.declared.iter().filter(|(_, s)| *s == scalar).map(|(name, _)| name.clone());
            for names in names.collect::<Vec<String>>().chunks(DECLARATION) {
                if let [name] = names {
                    let _ = writeln!(out.text, "    let {name}: {scalar_name};");
                } else {
                    let end = format!("]: [{scalar_name}; {}];", names.len());
                    out.text.push_str(&wrapped("    let [", names, &end));
                }
            }
        }
        self.declared.clear();
        out.text.push_str(&std::mem::take(&mut self.statements));
    }
}

/// `start`, the items with commas, `end`; lines of bounded length.
pub(super) fn wrapped(start: &str, items: &[String], end: &str) -> String {
    let mut text = String::from(start);
    let mut column = start.len();
    for (i, item) in items.iter().enumerate() {
        if i > 0 {
            text.push(',');
            if column + item.len() + 3 > 110 {
                text.push_str("\n        ");
                column = 8;
            } else {
                text.push(' ');
                column += 2;
            }
        }
        text.push_str(item);
        column += item.len();
    }
    text.push_str(end);
    text.push('\n');
    text
}

/// The constant, rounded once to the scalar's format, as the shortest literal that reads back to it; for any scalar in two
/// parts.
fn literal(c: Constant, style: Style) -> String {
    match (style.generic, style.scalar) {
        (true, _) => format!("number::<T>({:?}, {:?})", c.value().hi(), c.value().lo()),
        (false, scalar) => number(scalar.nearest(c.value()), scalar),
    }
}
