//! The steps: flatten, factor, share.

use super::pairs::Pairs;
use super::{SignedValue, SumTable, Term};
use rustc_hash::{FxHashMap, FxHasher};
use std::cmp::Reverse;
use std::hash::{Hash, Hasher};
use straightline_core::Dd;

impl SumTable {
    /// Sums without another user dissolve in the sum that uses them; constants of a sum become one, multiples of a value one, opposites go.
    pub(super) fn flatten(&mut self) {
        let found = self.uses();
        let (uses, order) = &*found;
        let mut flat: Vec<Term> = Vec::new();
        for v in order.iter().copied() {
            let SignedValue::Sum(terms) = &self.values[v] else { continue };
            flat.clear();
            for t in terms.iter().map(|t| self.resolved(*t)) {
                match &self.values[t.value()] {
                    // already flat itself: it stands before its user
                    SignedValue::Sum(inner) if uses[t.value()] == 1 => {
                        flat.extend(inner.iter().map(|u| self.resolved(*u).signed(t.is_negative())));
                    }
                    _ => flat.push(t),
                }
            }
            self.gather(&mut flat, uses);
            self.set_sum(v, &flat);
        }
        self.unite();
    }

    /// Makes `v` the sum of these terms.
    fn set_sum(&mut self, v: usize, terms: &[Term]) {
        let mut constant = Dd::ZERO;
        let mut kept: Vec<Term> = Vec::with_capacity(terms.len());
        for t in terms.iter().copied() {
            if let SignedValue::Constant(c) = self.values[t.value()] {
                constant = if t.is_negative() { constant - c.value() } else { constant + c.value() };
            } else if let Some(opposite) = kept.iter().position(|u| *u == t.signed(true)) {
                kept.remove(opposite);
            } else {
                kept.push(t);
            }
        }
        if constant != Dd::ZERO || kept.is_empty() {
            let c = self.constant(constant);
            kept.push(c);
        }
        let value = if kept.len() == 1 { SignedValue::Same(kept[0]) } else { SignedValue::Sum(kept) };
        self.set(v, value);
    }

    /// Equal products and equal sums become one: operands may have become equal.
    fn unite(&mut self) {
        let found = self.uses();
        self.products.clear();
        // sums by a hash of their terms; two that share one by chance stay apart
        let mut sums: FxHashMap<u64, (usize, bool)> = FxHashMap::default();
        let mut key: Vec<Term> = Vec::new();
        let mut other: Vec<Term> = Vec::new();
        for v in found.1.iter().copied() {
            match &self.values[v] {
                SignedValue::Product(..) => {
                    let [a, b] = self.factors(v);
                    let negative = a.is_negative() != b.is_negative();
                    let (a, b) = (a.value().min(b.value()), a.value().max(b.value()));
                    let value = match self.products.get(&(a, b)) {
                        Some(&value) => SignedValue::Same(Term::new(value, negative)),
                        None if negative => {
                            let value = self.push(SignedValue::Product(a, b), self.origin[v]);
                            self.products.insert((a, b), value.value());
                            SignedValue::Same(value.signed(true))
                        }
                        None => {
                            self.products.insert((a, b), v);
                            SignedValue::Product(a, b)
                        }
                    };
                    self.set(v, value);
                }
                SignedValue::Sum(_) => {
                    let negative = self.canonical(v, &mut key);
                    let mut hasher = FxHasher::default();
                    key.hash(&mut hasher);
                    let hash = hasher.finish();
                    match sums.get(&hash) {
                        Some(&(u, turned)) => {
                            self.canonical(u, &mut other);
                            if key == other {
                                self.set(v, SignedValue::Same(Term::new(u, turned != negative)));
                            }
                        }
                        None => {
                            sums.insert(hash, (v, negative));
                            let SignedValue::Sum(terms) = &self.values[v] else { unreachable!("seen above") };
                            if terms.iter().any(|t| self.resolved(*t) != *t) {
                                let terms = self.terms(v).collect();
                                self.set(v, SignedValue::Sum(terms));
                            }
                        }
                    }
                }
                _ => {}
            }
        }
    }

    /// The terms of a sum, sorted, the first positive; and whether all signs were turned for that.
    fn canonical(&self, sum: usize, key: &mut Vec<Term>) -> bool {
        key.clear();
        key.extend(self.terms(sum));
        key.sort_unstable();
        let negative = key[0].is_negative();
        key.iter_mut().for_each(|t| *t = t.signed(negative));
        negative
    }

    /// Of the terms of one sum: c x ± d x ± x = (c ± d ± 1) x, where nothing else uses the products.
    fn gather(&mut self, terms: &mut Vec<Term>, uses: &[u32]) {
        let mut first = 0;
        while let Some(k) = (first..terms.len()).find(|k| self.multiple(terms[*k], uses).1.is_some()) {
            first = k + 1;
            let x = self.multiple(terms[k], uses).0.value();
            let is_met = |t: &Term| self.multiple(*t, uses).0.value() == x;
            if terms.iter().filter(|t| is_met(t)).count() < 2 {
                continue;
            }
            let mut sum = Dd::ZERO;
            for (x, factor) in terms.iter().filter(|t| is_met(t)).map(|t| self.multiple(*t, uses)) {
                let factor = factor.unwrap_or(Dd::ONE);
                sum = if x.is_negative() { sum - factor } else { sum + factor };
            }
            let rest: Vec<Term> = terms.iter().copied().filter(|t| !is_met(t)).collect();
            *terms = rest;
            first = 0;
            let x = Term::new(x, false);
            if sum == Dd::ONE || sum == -Dd::ONE {
                terms.push(x.signed(sum == -Dd::ONE));
            } else if sum != Dd::ZERO {
                let factor = self.constant(sum);
                let product = self.product(factor, x, None);
                terms.push(product);
            }
        }
    }

    /// What a term is a multiple of, and the factor, where it may be taken apart: a product with a constant.
    fn multiple(&self, t: Term, uses: &[u32]) -> (Term, Option<Dd>) {
        if self.is_product(t) && uses.get(t.value()) == Some(&1) {
            let [a, b] = self.factors(t.value());
            for (c, x) in [(a, b), (b, a)] {
                if let SignedValue::Constant(factor) = self.values[c.value()] {
                    let negative = c.is_negative() != x.is_negative();
                    return (Term::new(x.value(), t.is_negative() != negative), Some(factor.value()));
                }
            }
        }
        (t, None)
    }

    /// a b + a b = a (b + b), where nothing else uses the product: then it fuses. Twice the factor that more values use,
    /// as it may be wanted doubled elsewhere.
    pub(super) fn double(&mut self) {
        let found = self.uses();
        let (uses, order) = &*found;
        let used = |t: Term| uses.get(t.value()).copied().unwrap_or(0);
        let mut doubled = false;
        for v in order.iter().copied() {
            let SignedValue::Sum(terms) = &self.values[v] else { continue };
            let is_twice = |k: &usize| {
                let t = terms[*k];
                used(t) == 2 && self.is_product(t) && terms[*k + 1..].contains(&t)
            };
            let Some(at) = (0..terms.len()).find(is_twice) else { continue };
            let twice = terms[at];
            let mut terms: Vec<Term> = terms.iter().copied().filter(|t| *t != twice).collect();
            let [a, b] = self.factors(twice.value());
            let (once, twofold) = if used(a) > used(b) { (b, a) } else { (a, b) };
            let sum = self.push(SignedValue::Sum(vec![twofold, twofold]), None);
            let product = self.push(SignedValue::Product(once.value(), sum.value()), None);
            terms.push(product.signed(twice.is_negative() != once.is_negative()));
            self.set_sum(v, &terms);
            doubled = true;
        }
        if doubled {
            self.unite();
        }
    }

    /// a b ± a c = a (b ± c), the factor of most terms first. Whether there was any.
    pub(super) fn factor(&mut self) -> bool {
        // the factors of a sum's products, and at which terms
        let mut members: Vec<(usize, usize)> = Vec::new();
        let mut any = false;
        loop {
            let found = self.uses();
            let (uses, order) = &*found;
            let mut factored = false;
            for v in order.iter().copied() {
                let SignedValue::Sum(terms) = &self.values[v] else { continue };
                members.clear();
                for (k, t) in terms.iter().enumerate() {
                    if uses.get(t.value()) == Some(&1) && self.is_product(*t) {
                        let [a, b] = self.factors(t.value());
                        members.push((a.value(), k));
                        if a.value() != b.value() {
                            members.push((b.value(), k));
                        }
                    }
                }
                members.sort_unstable();
                // the most terms; of those, the factor that was there first
                let groups = members.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() > 1);
                let Some(best) = groups.max_by_key(|group| (group.len(), Reverse(group[0].0))) else { continue };
                let factor = best[0].0;
                let other = |k: usize| {
                    let [a, b] = self.factors(terms[k].value());
                    // operands of a product carry signs only through what they were replaced by
                    let (own, other) = if a.value() == factor { (a, b) } else { (b, a) };
                    other.signed(terms[k].is_negative() != own.is_negative())
                };
                let others: Vec<Term> = best.iter().map(|(_, k)| other(*k)).collect();
                let is_rest = |k: &usize| best.iter().all(|(_, member)| member != k);
                let mut rest: Vec<Term> = (0..terms.len()).filter(is_rest).map(|k| terms[k]).collect();
                let inner = self.push(SignedValue::Sum(Vec::new()), None);
                self.set_sum(inner.value(), &others);
                rest.push(self.push(SignedValue::Product(factor, inner.value()), None));
                self.set_sum(v, &rest);
                factored = true;
            }
            if !factored {
                return any;
            }
            any = true;
            self.unite();
        }
    }

    /// The pair of terms, up to a common sign, that stands in most sums is added once.
    pub(super) fn share(&mut self) {
        let found = self.uses();
        let mut pairs = Pairs::default();
        let is_sum = |v: &usize| matches!(self.values[*v], SignedValue::Sum(_));
        let mut inserted: Vec<usize> = found.1.iter().copied().filter(is_sum).collect();
        for v in &inserted {
            pairs.insert(*v, &self.terms(*v).collect::<Vec<_>>());
        }
        while let Some((best, sums)) = pairs.most_frequent() {
            let [a, b] = best.terms();
            let exact = sums.iter().copied().find(|v| self.terms(*v).count() == 2);
            let shared = match exact {
                Some(v) => Term::new(v, !self.terms(v).any(|t| t == a)),
                None => self.push(SignedValue::Sum(vec![a, b]), None),
            };
            for v in sums.into_iter().filter(|v| *v != shared.value()) {
                let mut terms: Vec<Term> = self.terms(v).collect();
                pairs.remove(v, &terms);
                for negative in [false, true] {
                    let (a, b) = (a.signed(negative), b.signed(negative));
                    let at_a = terms.iter().position(|t| *t == a);
                    let at_b = terms.iter().enumerate().position(|(k, t)| *t == b && Some(k) != at_a);
                    if let (Some(i), Some(j)) = (at_a, at_b) {
                        terms.remove(i.max(j));
                        terms.remove(i.min(j));
                        terms.insert(i.min(j), shared.signed(negative));
                        break;
                    }
                }
                if terms.len() == 1 {
                    // the very pair once more: sums of it have another term from now on, and other pairs
                    let is_sum = |sum: &usize| matches!(self.values[*sum], SignedValue::Sum(_));
                    let has_it = |sum: &usize| is_sum(sum) && self.terms(*sum).any(|t| t.value() == v);
                    let users: Vec<usize> = inserted.iter().copied().filter(|sum| *sum != v && has_it(sum)).collect();
                    users.iter().for_each(|sum| pairs.remove(*sum, &self.terms(*sum).collect::<Vec<_>>()));
                    self.set(v, SignedValue::Same(terms[0]));
                    users.iter().for_each(|sum| pairs.insert(*sum, &self.terms(*sum).collect::<Vec<_>>()));
                } else {
                    pairs.insert(v, &terms);
                    self.set(v, SignedValue::Sum(terms));
                }
            }
            if exact.is_none() {
                pairs.insert(shared.value(), &[a, b]);
                inserted.push(shared.value());
            }
        }
    }
}
