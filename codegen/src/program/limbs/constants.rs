//! What follows from constants of the limbs alone is a constant of each limb.
//!
//! Before: a template as it is traced. After: the same over the reals, without operations on constants alone. Names and
//! sections stay.

use super::template::{same, LaneValue, Template};
use straightline_core::Dd;
use straightline_graph::expr::{GraphBuilder, NodeId, Op, RuleSet};

/// The template with such constants formed, and known ones where they are the same for all limbs.
pub(super) fn folded(template: Template, rules: RuleSet) -> Template {
    let Template { graph, mut lanes, first_lane, .. } = template;
    let mut builder = GraphBuilder::new(rules, graph.inputs.clone());
    // of nodes that are constants of the limbs of a kind those
    let mut known: Vec<Option<(usize, Vec<Dd>)>> = Vec::with_capacity(graph.ops.len());
    let mut node: Vec<NodeId> = Vec::with_capacity(graph.ops.len());
    for id in graph.ids() {
        let note = graph.notes[id.index()];
        builder.section(graph.sections[note.section as usize]);
        let op = graph.op(id);
        let constants = match op {
            Op::Input(k) if k as usize >= first_lane => match &lanes[k as usize - first_lane] {
                (kind, LaneValue::Constants(values)) => Some((*kind, values.clone())),
                (_, LaneValue::Results(_)) => None,
            },
            _ => combined(op, &|a| known[a.index()].as_ref(), &|a| {
                builder.as_constant(node[a.index()]).map(|c| c.value())
            }),
        };
        let new = match &constants {
            Some((kind, values)) => constant(&mut builder, &mut lanes, first_lane, *kind, values),
            None => builder.add(op.map(|a| node[a.index()])),
        };
        if let Some(name) = note.name {
            builder.name(new, name);
        }
        known.push(constants);
        node.push(new);
    }
    let results = graph.results.iter().map(|r| node[r.index()]).collect();
    let mut graph = builder.finish(graph.outputs, results);
    graph.inputs.last_mut().expect("the port of lanes").shape = vec![lanes.len()];
    Template { graph: straightline_graph::pass::dead_code(&graph), lanes, ..template }
}

/// The constants of the limbs that an operation makes of such constants and of those that all limbs share; `None` where
/// something else goes in, or nothing of a limb.
fn combined<'a>(
    op: Op,
    known: &dyn Fn(NodeId) -> Option<&'a (usize, Vec<Dd>)>,
    shared: &dyn Fn(NodeId) -> Option<Dd>,
) -> Option<(usize, Vec<Dd>)> {
    let (kind, some) = op.operands().find_map(known)?;
    let of = |a: NodeId, limb: usize| known(a).map(|(_, values)| values[limb]).or_else(|| shared(a));
    let value = |limb: usize| {
        Some(match op {
            Op::Unary(op, a) => op.value(of(a, limb)?),
            // a divisor that is a constant of the robot was checked when it was read; what is not finite stays an operation
            Op::Binary(op, a, b) => op.value(of(a, limb)?, of(b, limb)?),
            _ => return None,
        })
    };
    let values: Vec<Dd> = (0..some.len()).map(value).collect::<Option<_>>()?;
    values.iter().all(|x| x.hi().is_finite()).then_some((*kind, values))
}

/// The node of constants of the limbs of a kind.
fn constant(
    builder: &mut GraphBuilder,
    lanes: &mut Vec<(usize, LaneValue)>,
    first_lane: usize,
    kind: usize,
    values: &[Dd],
) -> NodeId {
    if values.iter().all(|x| same(values[0], *x)) {
        return builder.constant(values[0]);
    }
    let find = |sign: Dd| {
        lanes.iter().position(|(other, value)| match value {
            LaneValue::Constants(of) => *other == kind && of.iter().zip(values).all(|(a, b)| same(*a * sign, *b)),
            LaneValue::Results(_) => false,
        })
    };
    let (position, opposite) = match (find(Dd::ONE), find(-Dd::ONE)) {
        (Some(k), _) => (k, false),
        (None, Some(k)) => (k, true),
        (None, None) => {
            lanes.push((kind, LaneValue::Constants(values.to_vec())));
            (lanes.len() - 1, false)
        }
    };
    let input = builder.insert(Op::Input((first_lane + position) as u32));
    if opposite {
        builder.add(Op::neg(input))
    } else {
        input
    }
}
