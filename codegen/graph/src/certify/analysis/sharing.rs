//! Errors that share an adjoint, and adjoints that share a norm.

use super::super::forms::{Atom, AtomForms, Coefficient, FormTerm};
use super::super::norms::{GroupId, Groups};
use crate::expr::{Binary, Graph, Op};
use std::sync::Arc;

/// Which nodes have the same adjoint, and which adjoints belong to one vector.
pub(super) struct Sharing {
    /// The node that stands for all with its adjoint, up to the sign.
    pub(super) class: Vec<usize>,
    /// Products x cos q and y sin q with one adjoint, the pair, and the group of x and y.
    pub(super) products: Vec<(usize, usize, u32, GroupId)>,
    /// The team of a class.
    pub(super) team: Vec<Option<usize>>,
    /// Classes whose adjoints are bounded together, and their group.
    pub(super) teams: Vec<(Vec<usize>, GroupId)>,
    /// Whether a team is the sine and cosine of one angle, and their errors are no others.
    pub(super) halves: Vec<bool>,
}

impl Sharing {
    pub(super) fn new(graph: &Graph, live: &[bool], forms: &AtomForms, groups: &mut Groups) -> Self {
        let n = graph.ops.len();
        let class: Vec<usize> = forms.class.iter().map(|c| *c as usize).collect();
        let mut candidates: Vec<Vec<usize>> = Vec::new();
        // vectors by their names
        let mut named: std::collections::BTreeMap<(&str, usize), Vec<usize>> = std::collections::BTreeMap::new();
        for i in (0..n).filter(|i| live[*i]) {
            if let Some((name, index, component)) = graph.notes[i].name {
                if matches!(component, "x" | "y" | "z") {
                    named.entry((name, index)).or_default().push(class[i]);
                }
            }
        }
        candidates.extend(named.into_values());
        // pairs that turn together
        for i in (0..n).filter(|i| live[*i]) {
            let bounded = groups.bounded(forms.chain[i].clone());
            for (_, _, group) in &bounded.turns {
                let alone = groups.members(*group).map(|m| match m[..] {
                    [FormTerm { coefficient: Coefficient::One, atom: Atom::Adjoint(u), .. }] => Some(class[u as usize]),
                    _ => None,
                });
                if let Some(pair) = alone.collect::<Option<Vec<usize>>>() {
                    candidates.push(pair);
                }
            }
        }
        // sine and cosine of one angle
        for i in (0..n).filter(|i| live[*i] && matches!(graph.ops[*i], Op::SinCos(_))) {
            let halves = (i + 1..(i + 3).min(n)).filter(|h| graph.ops[*h].operands().any(|a| a.index() == i));
            candidates.push(halves.map(|h| class[h]).collect());
        }
        let mut team = vec![None; n];
        let mut teams = Vec::new();
        for mut classes in candidates {
            classes.sort_unstable();
            classes.dedup();
            classes.retain(|c| team[*c].is_none());
            if classes.len() < 2 {
                continue;
            }
            let adjoint = |c: &usize| {
                vec![FormTerm { coefficient: Coefficient::One, atom: Atom::Adjoint(*c as u32), negative: false }]
            };
            let group = groups.group(classes.iter().map(adjoint));
            classes.iter().for_each(|c| team[*c] = Some(teams.len()));
            let of_nodes = Arc::make_mut(&mut groups.team);
            of_nodes.resize(n, None);
            classes.iter().for_each(|c| of_nodes[*c] = Some(teams.len() as u32));
            teams.push((classes, group));
        }
        let products = turning_products(graph, live, forms, &class, groups);
        // errors at a half's adjoint are its own, unless another node shares that adjoint
        let mut alone = vec![0u32; n];
        (0..n).filter(|i| live[*i]).for_each(|i| alone[class[i]] += 1);
        let is_half = |c: &usize| matches!(graph.ops[*c], Op::Sin(_) | Op::Cos(_)) && alone[*c] == 1;
        let pair = |c: &usize| graph.ops[*c].operands().next();
        let halves = teams.iter().map(|(classes, _): &(Vec<usize>, GroupId)| {
            classes.len() == 2 && classes.iter().all(is_half) && pair(&classes[0]) == pair(&classes[1])
        });
        let halves = halves.collect();
        Sharing { class, products, team, teams, halves }
    }
}

/// Products x cos q and y sin q with one adjoint, the pair, and the group of x and y.
fn turning_products(
    graph: &Graph,
    live: &[bool],
    forms: &AtomForms,
    class: &[usize],
    groups: &mut Groups,
) -> Vec<(usize, usize, u32, GroupId)> {
    // by adjoint and pair, those with the sine and those with the cosine
    type Products = [Vec<(usize, FormTerm)>; 2];
    let mut turning: std::collections::BTreeMap<(usize, u32), Products> = std::collections::BTreeMap::new();
    for i in (0..live.len()).filter(|i| live[*i] && matches!(graph.ops[*i], Op::Binary(Binary::Mul, ..))) {
        if let ([t], _) = forms.flat(Atom::Value(i as u32)) {
            match t.coefficient {
                Coefficient::Sin(p) => turning.entry((class[i], p)).or_default()[0].push((i, *t)),
                Coefficient::Cos(p) => turning.entry((class[i], p)).or_default()[1].push((i, *t)),
                _ => {}
            }
        }
    }
    let mut products = Vec::new();
    for ((_, pair), [sines, cosines]) in turning {
        for ((a, x), (b, y)) in sines.iter().zip(&cosines) {
            let bare = |t: &FormTerm| vec![FormTerm { coefficient: Coefficient::One, ..*t }];
            products.push((*a, *b, pair, groups.group([bare(x), bare(y)])));
        }
    }
    products
}
