//! Ranges of forms and norms of their groups, by the rules of [`norms`](super::super::norms).

use super::super::forms::{Atom, FormTerm};
use super::super::norms::{Bounded, GroupFactor, GroupId, Way};
use super::super::tape::{Enclosure, Norm, UpperBound};
use super::state::BoxState;
use super::{Broken, ErrorAnalysis};

/// Ways to bound a norm stay if they come so near to the best one where they are first tried.
const WORTHWHILE: f64 = 1.5;

impl ErrorAnalysis<'_> {
    /// A form's range: parts of one angle by their norm where that is less.
    pub(super) fn enclosure(&mut self, form: &Bounded) -> Enclosure {
        let mut sum = Enclosure::ZERO;
        let mut start = 0;
        for (pair, end, group) in &form.turns {
            let mut part = self.part(&form.form[start..*end], Enclosure::ZERO);
            start = *end;
            if !part.x.is_zero() {
                let norm = self.norm(*group);
                let stretch = self.stretch(*pair);
                let stretch = if self.is_broken(Broken::Turn) { 0.4 * stretch } else { stretch };
                let pen = &mut self.state.pen;
                let stretch = pen.number(stretch);
                let most = pen.mul_up(stretch, norm);
                part = pen.clipped(part, most);
            }
            sum = self.state.pen.add(sum, part);
        }
        for (end, values, atoms) in &form.dots {
            let mut part = self.part(&form.form[start..*end], Enclosure::ZERO);
            start = *end;
            if !part.x.is_zero() {
                let (values, atoms) = (self.norm(*values), self.norm(*atoms));
                let most = self.state.pen.mul_up(values, atoms);
                part = self.state.pen.clipped(part, most);
            }
            sum = self.state.pen.add(sum, part);
        }
        self.part(&form.form[start..], sum)
    }

    /// A sum, and some terms.
    pub(super) fn part(&mut self, terms: &[FormTerm], mut sum: Enclosure) -> Enclosure {
        for t in terms {
            let term = self.state.term(self.graph, t);
            sum = self.state.pen.add(sum, term);
        }
        sum
    }

    /// T of a pair: s² + c² ≤ T² for the computed sine and cosine, each within an error of the exact one.
    pub(super) fn stretch(&self, _pair: u32) -> f64 {
        let e = self.format.trig_error(1.0);
        (1.0 + (1.5 * e).next_up()).next_up()
    }

    /// An upper bound of the norm of a group.
    pub(super) fn norm(&mut self, id: GroupId) -> UpperBound {
        let k = id as usize;
        if self.state.norm.len() <= k {
            self.state.norm.resize(self.groups.groups.len().max(k + 1), (0, UpperBound::ZERO));
        }
        // a round is either a box's or a result's, and asks for no group of the other kind
        let known = self.state.norm[k];
        if known.0 > 0 && (known.0 == self.state.result_round || known.0 == self.state.box_round) {
            return known.1;
        }
        let current = if self.groups.groups[k].of_adjoints { self.state.result_round } else { self.state.box_round };
        let mut ends = Norm::ZERO;
        for m in self.groups.members(id) {
            let mut sum = Enclosure::ZERO;
            for t in m {
                let term = self.state.term(self.graph, t);
                sum = self.state.pen.add(sum, term);
            }
            let magnitude = self.state.pen.mag(sum);
            self.state.pen.add_square(&mut ends, magnitude);
        }
        let mut best = self.state.pen.root(ends);
        // what is asked for on the way back to itself is answered by its ends
        self.state.norm[k] = (current, best);
        if best.x == 0.0 || self.groups.is_term(id) {
            return best;
        }
        self.groups.bound_members(id);
        let bounded = self.groups.groups[k].bounded.take().expect("made above");
        if !bounded.is_empty() {
            let mut ends = Norm::ZERO;
            for b in &bounded {
                let enclosure = self.enclosure(b);
                let magnitude = self.state.pen.mag(enclosure);
                self.state.pen.add_square(&mut ends, magnitude);
            }
            let clipped = self.state.pen.root(ends);
            best = self.state.pen.least(best, clipped);
            self.state.norm[k].1 = best;
        }
        self.groups.groups[k].bounded = Some(bounded);
        let is_first = self.groups.groups[k].ways.is_none();
        if is_first {
            let state = std::cell::RefCell::new(std::mem::take(&mut self.state));
            self.groups.find_ways(id, &self.forms, &|t| state.borrow_mut().size(self.graph, t));
            self.state = state.into_inner();
        }
        let mut ways = self.groups.groups[k].ways.take().expect("made above");
        let mut bounds = Vec::with_capacity(if is_first { ways.len() } else { 0 });
        for way in &ways {
            let (bound, is_whole) = self.by_way(way, best);
            if is_whole {
                best = self.state.pen.least(best, bound);
            }
            if is_first {
                bounds.push(bound.x);
            }
        }
        if is_first {
            // what is far off here will hardly be the best elsewhere, and all are sound
            let mut bounds = bounds.into_iter();
            ways.retain(|_| bounds.next().is_some_and(|b| b <= WORTHWHILE * best.x));
        }
        self.groups.groups[k].ways = Some(ways);
        self.state.norm[k] = (current, best);
        best
    }

    /// The bound of a way, and whether it is all of it: what is no better than the best one is not looked at further.
    fn by_way(&mut self, way: &Way, best: UpperBound) -> (UpperBound, bool) {
        let mut slack = Norm::ZERO;
        for s in way.slack.iter() {
            let BoxState { error, total_error, pen, .. } = &mut self.state;
            let rounding = s.nodes.iter().fold(UpperBound::ZERO, |s, n| pen.add_up(s, error[*n as usize]));
            let all = s.totals.iter().fold(rounding, |s, n| pen.add_up(s, total_error[*n as usize]));
            pen.add_square(&mut slack, all);
        }
        let mut bound = self.state.pen.root(slack);
        for (factor, inner) in way.parts.iter() {
            let factor = match factor {
                GroupFactor::Turn(pair) => {
                    let stretch = self.stretch(*pair);
                    self.state.pen.number(stretch)
                }
                GroupFactor::Matrix(x) => self.state.pen.number(*x),
                GroupFactor::Coefficient(c) => {
                    let alone = FormTerm { coefficient: *c, atom: Atom::One, negative: false };
                    let value = self.state.term(self.graph, &alone);
                    self.state.pen.mag(value)
                }
                GroupFactor::Values(group) => self.norm(*group),
            };
            let inner = self.norm(*inner);
            let part = self.state.pen.mul_up(factor, inner);
            bound = self.state.pen.add_up(bound, part);
            if bound.x >= best.x {
                return (bound, false);
            }
        }
        if bound.x >= best.x {
            return (bound, false);
        }
        let rest = self.norm(way.rest);
        (self.state.pen.add_up(bound, rest), true)
    }
}
