//! The rules by which a group is led back to others.

use super::super::forms::{
    negated, simplified, Atom, AtomForms, Coefficient, Depth, Flat, FormTerm, LinearForm, Slack,
};
use super::{bare, turn, value_of, GroupFactor, GroupId, Groups, RuleEffort, Way, WayParts};
use std::collections::BTreeMap;
use std::sync::Arc;

/// More members than these gain nothing.
const LARGEST: usize = 3;

/// More atoms than these under a matrix gain nothing.
const COLUMNS: usize = 4;

/// So many angles of a group are tried.
const ANGLES: usize = 2;

impl Groups {
    /// The ways of a group, found once.
    ///
    /// `size` says how large a term is in the first box; it only decides which of many ways are worth a try.
    pub fn find_ways(&mut self, id: GroupId, forms: &AtomForms, size: &dyn Fn(&FormTerm) -> f64) {
        if self.groups[id as usize].ways.is_none() {
            let ways = self.all_ways(id, forms, size);
            self.groups[id as usize].ways = Some(ways);
        }
    }

    fn all_ways(&mut self, id: GroupId, forms: &AtomForms, size: &dyn Fn(&FormTerm) -> f64) -> Vec<Way> {
        let effort = self.groups[id as usize].effort;
        if effort == RuleEffort::Ends || self.members(id).len() > LARGEST {
            return Vec::new();
        }
        let members = self.forms(id);
        if effort == RuleEffort::Columns {
            let members: Vec<&LinearForm> = members.iter().collect();
            return self.columns(id, &members, &Arc::from([])).into_iter().collect();
        }
        let mut ways = Vec::new();
        let mut tried: Vec<Vec<Flat>> = Vec::new();
        for depth in [Depth::Products, Depth::Names, Depth::Cancelled] {
            let flats: Vec<Flat> = members.iter().map(|m| forms.flattened(m, depth)).collect();
            let is_same = |others: &Vec<Flat>| others.iter().zip(&flats).all(|(a, b)| a.form == b.form);
            if !tried.iter().any(is_same) {
                ways.extend(self.ways_of_flat(id, &flats, forms, size));
                tried.push(flats);
            }
        }
        let mut distinct: Vec<Way> = Vec::with_capacity(ways.len());
        for way in ways {
            let same = |w: &Way| w.rest == way.rest && w.parts == way.parts && w.slack == way.slack;
            if !distinct.iter().any(same) {
                distinct.push(way);
            }
        }
        distinct
    }

    /// The ways of a group whose members have these forms.
    fn ways_of_flat(
        &mut self,
        id: GroupId,
        flats: &[Flat],
        forms: &AtomForms,
        size: &dyn Fn(&FormTerm) -> f64,
    ) -> Vec<Way> {
        let slack: Arc<[Slack]> = flats.iter().map(|f| &f.slack).filter(|s| !s.is_empty()).cloned().collect();
        let mut angles: Vec<(usize, u32)> = Vec::new();
        for flat in flats {
            let mut seen: Vec<u32> = flat.form.iter().filter_map(|t| turn(t).map(|(p, _)| p)).collect();
            seen.sort_unstable();
            seen.dedup();
            for pair in seen {
                match angles.iter_mut().find(|(_, p)| *p == pair) {
                    Some((count, _)) => *count += 1,
                    None => angles.push((1, pair)),
                }
            }
        }
        // the angle of most members first, of those the latest
        angles.sort_unstable();
        let mut ways = Vec::new();
        for &(_, pair) in angles.iter().rev().take(ANGLES) {
            for kept in 0..3 {
                let is_kept_by = |kept: usize, t: &FormTerm| {
                    turn(t).is_some()
                        || (kept == 1 && t.coefficient == Coefficient::One)
                        || (kept == 2 && is_linear(t, forms))
                };
                let keeps = |t: &FormTerm| is_kept_by(kept, t);
                let is_as_before = |earlier: usize| {
                    let mut terms = flats.iter().flat_map(|f| &f.form);
                    terms.all(|t| is_kept_by(earlier, t) == keeps(t))
                };
                if (0..kept).any(is_as_before) {
                    continue;
                }
                // a member whose other terms are larger is kept for them
                let is_small = |flat: &Flat| {
                    let largest = |own: bool| {
                        let is_own = |t: &&FormTerm| turn(t).is_some_and(|(p, _)| p == pair);
                        let terms = flat.form.iter().filter(|t| is_own(t) == own && keeps(t));
                        terms.fold(0.0f64, |most, t| most.max(size(t)))
                    };
                    largest(true) < largest(false)
                };
                let small: Vec<bool> = flats.iter().map(is_small).collect();
                ways.extend(self.turning(id, pair, flats, &slack, &keeps, &[]));
                if small.contains(&true) {
                    ways.extend(self.turning(id, pair, flats, &slack, &keeps, &small));
                }
                let has_constants = |f: &Flat| f.form.iter().any(|t| is_linear(t, forms));
                if !flats.iter().any(has_constants) {
                    break;
                }
            }
        }
        let any = |_: &FormTerm| true;
        ways.extend(self.matrix(id, flats, &slack, forms, &any, RuleEffort::Columns));
        if self.groups[id as usize].effort == RuleEffort::All {
            // one vector of adjoints after the other
            let linear = flats.iter().flat_map(|f| &f.form).filter(|t| is_linear(t, forms));
            let mut teams: Vec<u32> = linear.filter_map(|t| self.weighted(t)).collect();
            teams.sort_unstable();
            teams.dedup();
            for team in teams {
                let of_adjoints = Arc::clone(&self.team);
                let in_team = move |t: &FormTerm| match t.atom {
                    Atom::Adjoint(a) => of_adjoints.get(a as usize) == Some(&Some(team)),
                    _ => false,
                };
                ways.extend(self.matrix(id, flats, &slack, forms, &in_team, RuleEffort::Rest));
            }
        }
        ways.extend(self.scaling(flats));
        let flat_members: Vec<&LinearForm> = flats.iter().map(|f| &f.form).collect();
        ways.extend(self.columns(id, &flat_members, &slack));
        ways
    }

    /// The rule `turn` for one angle.
    fn turning(
        &mut self,
        id: GroupId,
        pair: u32,
        flats: &[Flat],
        slack: &Arc<[Slack]>,
        keeps: &dyn Fn(&FormTerm) -> bool,
        small: &[bool],
    ) -> Option<Way> {
        let mut inner: Vec<LinearForm> = Vec::new();
        let mut rests: Vec<LinearForm> = Vec::new();
        let mut turned: Vec<(LinearForm, LinearForm)> = Vec::new();
        for (k, flat) in flats.iter().enumerate() {
            let part = |sine: bool| -> LinearForm {
                simplified(flat.form.iter().filter(|t| turn(t) == Some((pair, sine))).map(bare).collect())
            };
            let (a, b) = (part(false), part(true));
            if (a.is_empty() && b.is_empty()) || small.get(k) == Some(&true) {
                let kept = |t: &&FormTerm| keeps(t) && turn(t).is_none_or(|(p, _)| p != pair);
                let (main, rest): (Vec<&FormTerm>, Vec<&FormTerm>) = flat.form.iter().partition(kept);
                inner.push(main.into_iter().copied().collect());
                rests.push(rest.into_iter().copied().collect());
            } else {
                turned.push((a, b));
                rests.push(flat.form.iter().filter(|t| turn(t).map(|(p, _)| p) != Some(pair)).copied().collect());
            }
        }
        let mut done = vec![false; turned.len()];
        for i in 0..turned.len() {
            if done[i] {
                continue;
            }
            let (a, b) = turned[i].clone();
            let minus = |f: &LinearForm| simplified(negated(f));
            let mates =
                |(c, d): &(LinearForm, LinearForm)| (*c == b && *d == minus(&a)) || (*c == minus(&b) && *d == a);
            if let Some(j) = (i + 1..turned.len()).find(|j| !done[*j] && mates(&turned[*j])) {
                done[j] = true;
            }
            inner.extend([a, b]);
        }
        self.way(id, GroupFactor::Turn(pair), inner, rests, slack, RuleEffort::Columns)
    }

    /// The rule `matrix`: all terms with constant coefficients, of some atoms.
    fn matrix(
        &mut self,
        id: GroupId,
        flats: &[Flat],
        slack: &Arc<[Slack]>,
        forms: &AtomForms,
        is_column: &dyn Fn(&FormTerm) -> bool,
        effort: RuleEffort,
    ) -> Option<Way> {
        let is_column = |t: &FormTerm| is_linear(t, forms) && is_column(t);
        let mut atoms: Vec<Atom> = Vec::new();
        for t in flats.iter().flat_map(|f| &f.form).filter(|t| is_column(t)) {
            if !atoms.contains(&t.atom) {
                atoms.push(t.atom);
            }
        }
        if atoms.is_empty() || atoms.len() > COLUMNS {
            return None;
        }
        let mut rests = Vec::new();
        let mut rows = Vec::new();
        for flat in flats {
            let (linear, rest): (Vec<&FormTerm>, Vec<&FormTerm>) = flat.form.iter().partition(|t| is_column(t));
            rests.push(rest.into_iter().copied().collect());
            let mut row = vec![(0.0f64, 0.0f64); atoms.len()];
            for t in linear {
                let k = atoms.iter().position(|a| *a == t.atom).expect("every atom of a linear term was collected");
                let (value, error) = match t.coefficient {
                    Coefficient::Node(c) => forms.constant(c).expect("linear terms have constant coefficients"),
                    _ => (1.0, 0.0),
                };
                let value = if t.negative { -value } else { value };
                // the sum of two coefficients of one atom is rounded
                row[k] = (row[k].0 + value, row[k].1 + error + f64::EPSILON * (row[k].0.abs() + value.abs()));
            }
            rows.push(row);
        }
        let inner =
            atoms.into_iter().map(|atom| vec![FormTerm { coefficient: Coefficient::One, atom, negative: false }]);
        let inner = inner.collect();
        self.way(id, GroupFactor::Matrix(spectral_norm(&rows)), inner, rests, slack, effort)
    }

    /// The rule `columns`: terms of several members with one coefficient are that coefficient times a vector.
    fn columns(&mut self, id: GroupId, members: &[&LinearForm], slack: &Arc<[Slack]>) -> Option<Way> {
        let mut columns: BTreeMap<Coefficient, Vec<(usize, FormTerm)>> = BTreeMap::new();
        for (m, member) in members.iter().enumerate() {
            for t in *member {
                if let Coefficient::Node(_) = t.coefficient {
                    columns.entry(t.coefficient).or_default().push((m, *t));
                }
            }
        }
        // terms are in the order of their members
        columns.retain(|_, terms| terms.first().map(|t| t.0) != terms.last().map(|t| t.0));
        if columns.is_empty() {
            return None;
        }
        let mut rests: Vec<LinearForm> = members.iter().map(|m| (*m).clone()).collect();
        let mut parts = Vec::new();
        for (coefficient, terms) in columns {
            let mut forms = vec![LinearForm::new(); members.len()];
            for (m, t) in &terms {
                forms[*m].push(bare(t));
                rests[*m].retain(|u| u != t);
            }
            let group = self.group(forms.into_iter().map(simplified));
            parts.push((GroupFactor::Coefficient(coefficient), group));
        }
        if parts.iter().any(|(_, group)| *group == id) {
            return None;
        }
        let rest = self.group_with(rests, RuleEffort::Ends);
        Some(Way { parts: WayParts::Several(parts), rest, slack: Arc::clone(slack) })
    }

    fn way(
        &mut self,
        id: GroupId,
        factor: GroupFactor,
        inner: Vec<LinearForm>,
        rests: Vec<LinearForm>,
        slack: &Arc<[Slack]>,
        effort: RuleEffort,
    ) -> Option<Way> {
        let inner = self.group(inner);
        if inner == id || self.members(inner).len() == 0 {
            return None;
        }
        let rest = self.group_with(rests, effort);
        if rest == id {
            return None;
        }
        Some(Way { parts: WayParts::One([(factor, inner)]), rest, slack: Arc::clone(slack) })
    }

    /// The rule `scaling`: adjoints of one vector with values before them, as the derivatives by sine and cosine have them.
    fn scaling(&mut self, flats: &[Flat]) -> Option<Way> {
        // team: (member, value, adjoint, sign)
        let mut teams: BTreeMap<u32, Vec<(usize, u32, Atom, bool)>> = BTreeMap::new();
        let mut rests: Vec<LinearForm> = vec![LinearForm::new(); flats.len()];
        for (m, flat) in flats.iter().enumerate() {
            for t in &flat.form {
                match self.scaled(t) {
                    Some((team, value, atom)) => teams.entry(team).or_default().push((m, value, atom, t.negative)),
                    None => rests[m].push(*t),
                }
            }
        }
        if teams.is_empty() {
            return None;
        }
        let plain = |v: u32| vec![value_of(Coefficient::Node(v))];
        let mut parts = Vec::new();
        for terms in teams.into_values() {
            let mut atoms: Vec<Atom> = terms.iter().map(|t| t.2).collect();
            atoms.sort_unstable();
            atoms.dedup();
            // entries of the matrix before the adjoints
            let values: Vec<LinearForm> = match (&terms[..], &atoms[..]) {
                // m₁ = x u + y v, m₂ = ±(x v − y u): ‖(x, y)‖ ‖(u, v)‖
                ([a, b, c, d], [_, _]) if is_complex_product([a, b, c, d]) => vec![plain(a.1), plain(b.1)],
                _ => terms.iter().map(|t| plain(t.1)).collect(),
            };
            let atoms =
                atoms.into_iter().map(|atom| vec![FormTerm { coefficient: Coefficient::One, atom, negative: false }]);
            let (values, atoms) = (self.group(values), self.group(atoms.collect::<Vec<_>>()));
            parts.push((GroupFactor::Values(values), atoms));
        }
        let rest = self.group_with(rests, RuleEffort::Columns);
        Some(Way { parts: WayParts::Several(parts), rest, slack: Arc::from([]) })
    }
}

/// Whether two members of two terms each are x u + y v and ±(x v − y u).
fn is_complex_product([a, b, c, d]: [&(usize, u32, Atom, bool); 4]) -> bool {
    if a.0 != b.0 || c.0 != d.0 || a.0 == c.0 || a.2 == b.2 || c.2 == d.2 {
        return false;
    }
    // the terms of the second member in the order of the adjoints of the first
    let (c, d) = if c.2 == a.2 { (c, d) } else { (d, c) };
    let turned_back = c.1 == b.1 && d.1 == a.1;
    // (x u + y v)² + (±y u ± x v)²: the mixed terms cancel if an odd number of signs is minus
    turned_back && (a.3 != b.3) != (c.3 != d.3)
}

/// Whether the coefficient is a constant, and the atom can be taken apart.
fn is_linear(t: &FormTerm, forms: &AtomForms) -> bool {
    let constant = match t.coefficient {
        Coefficient::One => true,
        Coefficient::Node(c) => forms.constant(c).is_some(),
        _ => false,
    };
    constant && !forms.is_leaf(t.atom)
}

/// An upper bound of the spectral norm of a matrix of values with errors: √ of the lesser of ‖MᵀM‖_∞ and ‖MMᵀ‖_∞, + ‖errors‖_F.
fn spectral_norm(rows: &[Vec<(f64, f64)>]) -> f64 {
    let columns = rows.first().map_or(0, Vec::len);
    let gram = |count: usize, others: usize, at: &dyn Fn(usize, usize) -> f64| {
        let mut largest = 0.0f64;
        for i in 0..count {
            let mut sum = 0.0;
            for j in 0..count {
                let (mut entry, mut size) = (0.0, 0.0);
                for k in 0..others {
                    entry += at(i, k) * at(j, k);
                    size += (at(i, k) * at(j, k)).abs();
                }
                // at most 2 · `others` roundings of numbers up to `size`
                sum += entry.abs() + 16.0 * f64::EPSILON * size;
            }
            largest = largest.max(sum * (1.0 + 16.0 * f64::EPSILON));
        }
        largest
    };
    let largest = gram(columns, rows.len(), &|i, k| rows[k][i].0).min(gram(rows.len(), columns, &|i, k| rows[i][k].0));
    let errors: f64 = rows.iter().flatten().map(|(_, e)| e * e).sum();
    (largest.sqrt() + errors.sqrt()) * (1.0 + 16.0 * f64::EPSILON)
}
