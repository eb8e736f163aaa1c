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

mod ways;

use super::forms::{canonical, simplified, Atom, Coefficient, FormTerm, LinearForm, Slack};
use rustc_hash::{FxBuildHasher, FxHashMap};
use std::hash::BuildHasher;
use std::sync::Arc;

/// Index of a group.
pub type GroupId = u32;

/// Which rules are tried on a group: what is left over by one is not worth all of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RuleEffort {
    /// All rules.
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
pub struct FormGroup {
    /// Where its members stand: the first, and behind the last.
    members: (u32, u32),
    /// Which rules may be tried.
    pub effort: RuleEffort,
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
pub enum GroupFactor {
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
    pub parts: WayParts,
    /// What does not belong to them, one form per member.
    pub rest: GroupId,
    /// Errors between the members and their forms, for each member.
    pub slack: Arc<[Slack]>,
}

/// What a way leads back to: a factor and a group, as a rule, which stands in its place.
#[derive(Clone, Debug, PartialEq)]
pub enum WayParts {
    /// One factor and group: the rule, without an allocation.
    One([(GroupFactor, GroupId); 1]),
    /// More than one, one after the other.
    Several(Vec<(GroupFactor, GroupId)>),
}

impl std::ops::Deref for WayParts {
    type Target = [(GroupFactor, GroupId)];

    fn deref(&self) -> &Self::Target {
        match self {
            WayParts::One(part) => part,
            WayParts::Several(parts) => parts,
        }
    }
}

/// A form with the groups that bound its parts of one angle.
#[derive(Clone, Debug, Default)]
pub struct Bounded {
    /// The terms: those of the turns, those of the scalar products, the others.
    pub form: Box<[FormTerm]>,
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
    pub groups: Vec<FormGroup>,
    /// Terms of all members, one behind the other: there are many, most of one term.
    terms: Vec<FormTerm>,
    /// Where each member ends.
    ends: Vec<u32>,
    /// The first group of each hash; for look-ups only.
    known: FxHashMap<u64, GroupId>,
    /// Adjoints of one vector: the team of a node.
    pub team: Arc<Vec<Option<u32>>>,
}

/// The pair of a turning term, and whether its coefficient is the sine.
fn turn(t: &FormTerm) -> Option<(u32, bool)> {
    match t.coefficient {
        Coefficient::Sin(p) => Some((p, true)),
        Coefficient::Cos(p) => Some((p, false)),
        _ => None,
    }
}

fn bare(t: &FormTerm) -> FormTerm {
    FormTerm { coefficient: Coefficient::One, ..*t }
}

impl Groups {
    /// The group of these forms; signs and order do not matter.
    pub fn group(&mut self, members: impl IntoIterator<Item = LinearForm>) -> GroupId {
        self.group_with(members, RuleEffort::All)
    }

    /// The group of these forms on which this effort is spent.
    fn group_with(&mut self, members: impl IntoIterator<Item = LinearForm>, effort: RuleEffort) -> GroupId {
        let mut members: Vec<LinearForm> = members.into_iter().filter(|f| !f.is_empty()).map(canonical).collect();
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
        self.groups.push(FormGroup { members, effort, of_adjoints, bounded: None, ways: None, next });
        id
    }

    /// The members of a group, each with a first term of positive sign, sorted.
    pub fn members(&self, id: GroupId) -> impl ExactSizeIterator<Item = &[FormTerm]> + Clone {
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
    fn forms(&self, id: GroupId) -> Vec<LinearForm> {
        self.members(id).map(<[FormTerm]>::to_vec).collect()
    }

    /// A form with the groups of its angles.
    pub fn bounded(&mut self, form: LinearForm) -> Bounded {
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
            let part = |sine: bool| -> LinearForm {
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
    fn weighted(&self, t: &FormTerm) -> Option<u32> {
        match (t.coefficient, t.atom) {
            (Coefficient::Node(_) | Coefficient::One, Atom::Adjoint(a)) => self.team.get(a as usize).copied()?,
            _ => None,
        }
    }

    /// The team, the node of the value, and the adjoint of a term of value and adjoint.
    fn scaled(&self, t: &FormTerm) -> Option<(u32, u32, Atom)> {
        match (t.coefficient, t.atom) {
            (Coefficient::Node(v), Atom::Adjoint(a)) => Some((self.team.get(a as usize).copied()??, v, t.atom)),
            _ => None,
        }
    }

    /// The members with the groups of their parts, found once.
    pub fn bound_members(&mut self, id: GroupId) {
        if self.groups[id as usize].bounded.is_none() {
            let has_two = |m: &[FormTerm], of: &dyn Fn(&FormTerm) -> bool| m.iter().filter(|t| of(t)).count() > 1;
            let may_have_parts =
                |m: &[FormTerm]| has_two(m, &|t| turn(t).is_some()) || has_two(m, &|t| self.weighted(t).is_some());
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
}

fn value_of(coefficient: Coefficient) -> FormTerm {
    let atom = match coefficient {
        Coefficient::Node(v) => Atom::Value(v),
        Coefficient::One => Atom::One,
        _ => unreachable!("made for values"),
    };
    FormTerm { coefficient: Coefficient::One, atom, negative: false }
}
