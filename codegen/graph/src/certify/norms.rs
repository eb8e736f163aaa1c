//! Euclidean norms of groups of forms: what a rotation keeps.
//!
//! Interval arithmetic takes x cos q − y sin q for up to √2 max(|x|, |y|), and so much again at every rotation. Here a group of
//! forms g = (g₁ … g_k) has a bound of ‖g‖ = √(Σ g_i²), the least of what these rules give. All hold for perturbed values,
//! where the computed sine and cosine satisfy s² + c² ≤ T² with T a little above 1:
//!
//! * **ends**: ‖g‖² ≤ Σ sup |g_i|².
//! * **triangle**: g = a + b ⇒ ‖g‖ ≤ ‖a‖ + ‖b‖; rounding errors between an atom and its form are such a b.
//! * **turn**: the part of g_i with one angle is a_i c + b_i s. Two parts with a_j = b_i, b_j = −a_i (or the opposite signs)
//!   are T times a rotation of (a_i, b_i). One part alone is at most T ‖(a_i, b_i)‖ (Cauchy-Schwarz). Parts on different
//!   components add up in squares, beside components that do not turn (T ≥ 1): ‖g‖ ≤ T ‖(a_i, b_i, …, the others)‖. Any terms may be taken for
//!   the rest, by the triangle: small ones that turn with the angle, constants times other vectors.
//! * **matrix**: g = M x with constants M ⇒ ‖g‖ ≤ √‖MᵀM‖_∞ ‖x‖, as the greatest eigenvalue of MᵀM is at most any norm of it; M Mᵀ has the same.
//! * **columns**: terms k g_i of several members with one coefficient k are k times a vector: at most |k| ‖(g_i)‖.
//! * **scaling**: g = C a with values C before adjoints a of one vector ⇒ ‖g‖ ≤ ‖C‖_F ‖a‖; for C = (x, y; −y, x), the derivatives by cosine and
//!   sine of one turn, ‖C‖ = ‖(x, y)‖, as CᵀC = (x² + y²) 1. One form Σ x_k a_k is at most ‖x‖ ‖a‖.
//! * **products**: of a product a b of two values |a b| ≤ (a² + b²)/2 = ‖(a, b)‖²/2, since (|a| − |b|)² ≥ 0.
//!
//! The same rules serve adjoints, because the chain rule through a rotation is the rotation back.

use super::forms::{canonical, negated, Coefficient, Depth, Form, Forms, Slack, Term};
use super::forms::{simplified, Atom, Flat};
use rustc_hash::{FxBuildHasher, FxHashMap};
use std::collections::BTreeMap;
use std::hash::BuildHasher;
use std::sync::Arc;

/// Index of a group.
pub type GroupId = u32;

/// Which rules are tried on a group: what is left over by one is not worth all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Effort {
    /// All.
    All,
    /// All, of what another rule left over.
    Rest,
    /// `columns` only.
    Columns,
    /// None: its ends.
    Ends,
}

/// A group of forms, and what it can be led back to.
#[derive(Clone, Debug)]
pub struct Group {
    /// Where its members stand: the first, and behind the last.
    members: (u32, u32),
    /// Which rules may be tried.
    pub effort: Effort,
    /// Whether adjoints are in it, so that its norm is another for each result.
    pub of_adjoints: bool,
    /// The members with the groups of their parts, once they are wanted; none if no member has such parts.
    pub bounded: Option<Vec<Bounded>>,
    /// The ways, once they are wanted.
    pub ways: Option<Vec<Way>>,
    /// Another group of the same hash.
    next: Option<GroupId>,
}

/// What stands before the group that is left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Factor {
    /// T of a pair.
    Turn(u32),
    /// The norm of a matrix.
    Matrix(f64),
    /// The magnitude of a coefficient.
    Coefficient(Coefficient),
    /// The norm of a group of values.
    Values(GroupId),
}

/// ‖group‖ ≤ Σ factor · ‖inner‖ + ‖rest‖ + slack.
#[derive(Clone, Debug)]
pub struct Way {
    /// Factors, and the groups that are left.
    pub parts: Parts,
    /// What does not belong to them, one form per member.
    pub rest: GroupId,
    /// Errors between the members and their forms, for each member.
    pub slack: Arc<[Slack]>,
}

/// What a way leads back to: a factor and a group, as a rule, which stands in its place.
#[derive(Clone, Debug, PartialEq)]
pub enum Parts {
    /// One.
    One([(Factor, GroupId); 1]),
    /// Several.
    Several(Vec<(Factor, GroupId)>),
}

impl std::ops::Deref for Parts {
    type Target = [(Factor, GroupId)];

    fn deref(&self) -> &Self::Target {
        match self {
            Parts::One(part) => part,
            Parts::Several(parts) => parts,
        }
    }
}

/// A form with the groups that bound its parts of one angle.
#[derive(Clone, Debug, Default)]
pub struct Bounded {
    /// The terms: those of the turns, those of the scalar products, the others.
    pub form: Box<[Term]>,
    /// Pair, where its terms end, and the group of their atoms.
    pub turns: Vec<(u32, usize, GroupId)>,
    /// Scalar products: where their terms end, and the groups of their coefficients and of their atoms.
    pub dots: Vec<(usize, GroupId, GroupId)>,
}

impl Bounded {
    /// Whether it is nothing but terms.
    pub fn is_plain(&self) -> bool {
        self.turns.is_empty() && self.dots.is_empty()
    }
}

/// Groups by their members.
#[derive(Clone, Debug, Default)]
pub struct Groups {
    /// All groups.
    pub groups: Vec<Group>,
    /// Terms of all members, one behind the other: there are many, most of one term.
    terms: Vec<Term>,
    /// Where each member ends.
    ends: Vec<u32>,
    /// The first group of each hash; for look-ups only.
    known: FxHashMap<u64, GroupId>,
    /// Adjoints of one vector: the team of a node.
    pub team: Arc<Vec<Option<u32>>>,
}

/// More members than these gain nothing.
const LARGEST: usize = 3;
/// More atoms than these under a matrix gain nothing.
const COLUMNS: usize = 4;

/// So many angles of a group are tried.
const ANGLES: usize = 2;

/// The pair of a turning term, and whether its coefficient is the sine.
fn turn(t: &Term) -> Option<(u32, bool)> {
    match t.coefficient {
        Coefficient::Sin(p) => Some((p, true)),
        Coefficient::Cos(p) => Some((p, false)),
        _ => None,
    }
}

fn bare(t: &Term) -> Term {
    Term { coefficient: Coefficient::One, ..*t }
}

impl Groups {
    /// The group of these forms; signs and order do not matter.
    pub fn group(&mut self, members: impl IntoIterator<Item = Form>) -> GroupId {
        self.group_with(members, Effort::All)
    }

    /// The same, with not all rules.
    fn group_with(&mut self, members: impl IntoIterator<Item = Form>, effort: Effort) -> GroupId {
        let mut members: Vec<Form> = members.into_iter().filter(|f| !f.is_empty()).map(canonical).collect();
        members.sort_unstable();
        let hash = FxBuildHasher.hash_one((&members, effort));
        let mut same_hash = self.known.get(&hash).copied();
        while let Some(id) = same_hash {
            let group = &self.groups[id as usize];
            if group.effort == effort && self.members(id).eq(members.iter().map(|m| &m[..])) {
                return id;
            }
            same_hash = group.next;
        }
        let id = self.groups.len() as GroupId;
        let next = self.known.insert(hash, id);
        let of_adjoints = members.iter().flatten().any(|t| matches!(t.atom, Atom::Adjoint(_) | Atom::Seed(_)));
        let first = self.ends.len() as u32;
        for m in members {
            self.terms.extend(m);
            self.ends.push(self.terms.len() as u32);
        }
        let members = (first, self.ends.len() as u32);
        self.groups.push(Group { members, effort, of_adjoints, bounded: None, ways: None, next });
        id
    }

    /// The members of a group, each with a first term of positive sign, sorted.
    pub fn members(&self, id: GroupId) -> impl ExactSizeIterator<Item = &[Term]> + Clone {
        let (first, end) = self.groups[id as usize].members;
        (first as usize..end as usize).map(|k| {
            let start = if k == 0 { 0 } else { self.ends[k - 1] as usize };
            &self.terms[start..self.ends[k] as usize]
        })
    }

    /// Whether a group is a term alone.
    pub fn is_term(&self, id: GroupId) -> bool {
        let mut members = self.members(id);
        members.len() == 1 && members.all(|m| m.len() == 1)
    }

    /// Copies of the members, while groups are added.
    fn forms(&self, id: GroupId) -> Vec<Form> {
        self.members(id).map(<[Term]>::to_vec).collect()
    }

    /// A form with the groups of its angles.
    pub fn bounded(&mut self, form: Form) -> Bounded {
        let mut turns: Vec<(u32, Vec<usize>)> = Vec::new();
        for (k, t) in form.iter().enumerate() {
            if let Some((pair, _)) = turn(t) {
                match turns.iter_mut().find(|(p, _)| *p == pair) {
                    Some((_, terms)) => terms.push(k),
                    None => turns.push((pair, vec![k])),
                }
            }
        }
        let turns = turns.into_iter().filter(|(_, terms)| terms.len() > 1).map(|(pair, terms)| {
            let part = |sine: bool| -> Form {
                let wanted = terms.iter().map(|k| &form[*k]).filter(|t| turn(t) == Some((pair, sine)));
                simplified(wanted.map(bare).collect())
            };
            let group = self.group([part(true), part(false)]);
            (pair, terms, group)
        });
        let turns: Vec<(u32, Vec<usize>, GroupId)> = turns.collect();
        // terms with values before adjoints of one vector, each adjoint once
        let mut lists: Vec<(u32, Vec<usize>)> = Vec::new();
        for (k, t) in form.iter().enumerate() {
            let (Some(team), atom) = (self.weighted(t), t.atom) else { continue };
            let fits = |(other, terms): &&mut (u32, Vec<usize>)| {
                *other == team && terms.iter().all(|j: &usize| form[*j].atom != atom)
            };
            match lists.iter_mut().find(fits) {
                Some((_, terms)) => terms.push(k),
                None => lists.push((team, vec![k])),
            }
        }
        let dots = lists.into_iter().filter(|(_, terms)| terms.len() > 1).map(|(_, terms)| {
            let values = terms.iter().map(|k| vec![value_of(form[*k].coefficient)]);
            let values = self.group(values.collect::<Vec<_>>());
            let atoms = self.group(terms.iter().map(|k| vec![bare(&form[*k])]).collect::<Vec<_>>());
            (terms, values, atoms)
        });
        let dots: Vec<(Vec<usize>, GroupId, GroupId)> = dots.collect();
        let mut is_placed = vec![false; form.len()];
        let mut terms = Vec::with_capacity(form.len());
        let mut place = |part: &[usize]| {
            terms.extend(part.iter().map(|k| form[*k]));
            part.iter().for_each(|k| is_placed[*k] = true);
            terms.len()
        };
        let turns = turns.into_iter().map(|(pair, part, group)| (pair, place(&part), group)).collect();
        let dots = dots.into_iter().map(|(part, values, atoms)| (place(&part), values, atoms)).collect();
        terms.extend(form.iter().zip(is_placed).filter(|(_, is_placed)| !is_placed).map(|(t, _)| *t));
        Bounded { form: terms.into(), turns, dots }
    }

    /// The team of the adjoint of a term that has a value before it, or nothing.
    fn weighted(&self, t: &Term) -> Option<u32> {
        match (t.coefficient, t.atom) {
            (Coefficient::Node(_) | Coefficient::One, Atom::Adjoint(a)) => self.team.get(a as usize).copied()?,
            _ => None,
        }
    }

    /// The team, the node of the value, and the adjoint of a term of value and adjoint.
    fn scaled(&self, t: &Term) -> Option<(u32, u32, Atom)> {
        match (t.coefficient, t.atom) {
            (Coefficient::Node(v), Atom::Adjoint(a)) => Some((self.team.get(a as usize).copied()??, v, t.atom)),
            _ => None,
        }
    }

    /// The members with the groups of their parts, found once.
    pub fn bound_members(&mut self, id: GroupId) {
        if self.groups[id as usize].bounded.is_none() {
            let has_two = |m: &[Term], of: &dyn Fn(&Term) -> bool| m.iter().filter(|t| of(t)).count() > 1;
            let may_have_parts =
                |m: &[Term]| has_two(m, &|t| turn(t).is_some()) || has_two(m, &|t| self.weighted(t).is_some());
            let mut bounded = Vec::new();
            if self.members(id).any(may_have_parts) {
                bounded.extend(self.forms(id).into_iter().map(|m| self.bounded(m)));
            }
            if bounded.iter().all(Bounded::is_plain) {
                bounded = Vec::new();
            }
            self.groups[id as usize].bounded = Some(bounded);
        }
    }

    /// The ways of a group, found once.
    ///
    /// `size` says how large a term is in the first box; it only decides which of many ways are worth a try.
    pub fn find_ways(&mut self, id: GroupId, forms: &Forms, size: &dyn Fn(&Term) -> f64) {
        if self.groups[id as usize].ways.is_none() {
            let ways = self.all_ways(id, forms, size);
            self.groups[id as usize].ways = Some(ways);
        }
    }

    fn all_ways(&mut self, id: GroupId, forms: &Forms, size: &dyn Fn(&Term) -> f64) -> Vec<Way> {
        let effort = self.groups[id as usize].effort;
        if effort == Effort::Ends || self.members(id).len() > LARGEST {
            return Vec::new();
        }
        let members = self.forms(id);
        if effort == Effort::Columns {
            let members: Vec<&Form> = members.iter().collect();
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
    fn ways_of_flat(&mut self, id: GroupId, flats: &[Flat], forms: &Forms, size: &dyn Fn(&Term) -> f64) -> Vec<Way> {
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
                let is_kept_by = |kept: usize, t: &Term| {
                    turn(t).is_some()
                        || (kept == 1 && t.coefficient == Coefficient::One)
                        || (kept == 2 && is_linear(t, forms))
                };
                let keeps = |t: &Term| is_kept_by(kept, t);
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
                        let is_own = |t: &&Term| turn(t).is_some_and(|(p, _)| p == pair);
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
        let any = |_: &Term| true;
        ways.extend(self.matrix(id, flats, &slack, forms, &any, Effort::Columns));
        if self.groups[id as usize].effort == Effort::All {
            // one vector of adjoints after the other
            let linear = flats.iter().flat_map(|f| &f.form).filter(|t| is_linear(t, forms));
            let mut teams: Vec<u32> = linear.filter_map(|t| self.weighted(t)).collect();
            teams.sort_unstable();
            teams.dedup();
            for team in teams {
                let of_adjoints = Arc::clone(&self.team);
                let in_team = move |t: &Term| match t.atom {
                    Atom::Adjoint(a) => of_adjoints.get(a as usize) == Some(&Some(team)),
                    _ => false,
                };
                ways.extend(self.matrix(id, flats, &slack, forms, &in_team, Effort::Rest));
            }
        }
        ways.extend(self.scaling(flats));
        let flat_members: Vec<&Form> = flats.iter().map(|f| &f.form).collect();
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
        keeps: &dyn Fn(&Term) -> bool,
        small: &[bool],
    ) -> Option<Way> {
        let mut inner: Vec<Form> = Vec::new();
        let mut rests: Vec<Form> = Vec::new();
        let mut turned: Vec<(Form, Form)> = Vec::new();
        for (k, flat) in flats.iter().enumerate() {
            let part = |sine: bool| -> Form {
                simplified(flat.form.iter().filter(|t| turn(t) == Some((pair, sine))).map(bare).collect())
            };
            let (a, b) = (part(false), part(true));
            if (a.is_empty() && b.is_empty()) || small.get(k) == Some(&true) {
                let kept = |t: &&Term| keeps(t) && turn(t).is_none_or(|(p, _)| p != pair);
                let (main, rest): (Vec<&Term>, Vec<&Term>) = flat.form.iter().partition(kept);
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
            let minus = |f: &Form| simplified(negated(f));
            let mates = |(c, d): &(Form, Form)| (*c == b && *d == minus(&a)) || (*c == minus(&b) && *d == a);
            if let Some(j) = (i + 1..turned.len()).find(|j| !done[*j] && mates(&turned[*j])) {
                done[j] = true;
            }
            inner.extend([a, b]);
        }
        self.way(id, Factor::Turn(pair), inner, rests, slack, Effort::Columns)
    }

    /// The rule `matrix`: all terms with constant coefficients, of some atoms.
    fn matrix(
        &mut self,
        id: GroupId,
        flats: &[Flat],
        slack: &Arc<[Slack]>,
        forms: &Forms,
        is_column: &dyn Fn(&Term) -> bool,
        effort: Effort,
    ) -> Option<Way> {
        let is_column = |t: &Term| is_linear(t, forms) && is_column(t);
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
            let (linear, rest): (Vec<&Term>, Vec<&Term>) = flat.form.iter().partition(|t| is_column(t));
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
        let inner = atoms.into_iter().map(|atom| vec![Term { coefficient: Coefficient::One, atom, negative: false }]);
        let inner = inner.collect();
        self.way(id, Factor::Matrix(spectral_norm(&rows)), inner, rests, slack, effort)
    }

    /// The rule `columns`: terms of several members with one coefficient are that coefficient times a vector.
    fn columns(&mut self, id: GroupId, members: &[&Form], slack: &Arc<[Slack]>) -> Option<Way> {
        let mut columns: BTreeMap<Coefficient, Vec<(usize, Term)>> = BTreeMap::new();
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
        let mut rests: Vec<Form> = members.iter().map(|m| (*m).clone()).collect();
        let mut parts = Vec::new();
        for (coefficient, terms) in columns {
            let mut forms = vec![Form::new(); members.len()];
            for (m, t) in &terms {
                forms[*m].push(bare(t));
                rests[*m].retain(|u| u != t);
            }
            let group = self.group(forms.into_iter().map(simplified));
            parts.push((Factor::Coefficient(coefficient), group));
        }
        if parts.iter().any(|(_, group)| *group == id) {
            return None;
        }
        let rest = self.group_with(rests, Effort::Ends);
        Some(Way { parts: Parts::Several(parts), rest, slack: Arc::clone(slack) })
    }

    fn way(
        &mut self,
        id: GroupId,
        factor: Factor,
        inner: Vec<Form>,
        rests: Vec<Form>,
        slack: &Arc<[Slack]>,
        effort: Effort,
    ) -> Option<Way> {
        let inner = self.group(inner);
        if inner == id || self.members(inner).len() == 0 {
            return None;
        }
        let rest = self.group_with(rests, effort);
        if rest == id {
            return None;
        }
        Some(Way { parts: Parts::One([(factor, inner)]), rest, slack: Arc::clone(slack) })
    }

    /// The rule `scaling`: adjoints of one vector with values before them, as the derivatives by sine and cosine have them.
    fn scaling(&mut self, flats: &[Flat]) -> Option<Way> {
        // team: (member, value, adjoint, sign)
        let mut teams: BTreeMap<u32, Vec<(usize, u32, Atom, bool)>> = BTreeMap::new();
        let mut rests: Vec<Form> = vec![Form::new(); flats.len()];
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
            let values: Vec<Form> = match (&terms[..], &atoms[..]) {
                // m₁ = x u + y v, m₂ = ±(x v − y u): ‖(x, y)‖ ‖(u, v)‖
                ([a, b, c, d], [_, _]) if is_complex_product([a, b, c, d]) => vec![plain(a.1), plain(b.1)],
                _ => terms.iter().map(|t| plain(t.1)).collect(),
            };
            let atoms =
                atoms.into_iter().map(|atom| vec![Term { coefficient: Coefficient::One, atom, negative: false }]);
            let (values, atoms) = (self.group(values), self.group(atoms.collect::<Vec<_>>()));
            parts.push((Factor::Values(values), atoms));
        }
        let rest = self.group_with(rests, Effort::Columns);
        Some(Way { parts: Parts::Several(parts), rest, slack: Arc::from([]) })
    }
}

fn value_of(coefficient: Coefficient) -> Term {
    let atom = match coefficient {
        Coefficient::Node(v) => Atom::Value(v),
        Coefficient::One => Atom::One,
        _ => unreachable!("made for values"),
    };
    Term { coefficient: Coefficient::One, atom, negative: false }
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
fn is_linear(t: &Term, forms: &Forms) -> bool {
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
