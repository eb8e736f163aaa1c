//! In which sums each pair of terms stands.

use super::Term;
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::hash_map::Entry;
use std::collections::BTreeSet;

/// Two values, the lower one first, and whether their signs differ, in one word: compared as the three would be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Pair(u64);

impl Pair {
    /// Up to a common sign.
    fn new(a: Term, b: Term) -> Pair {
        let (low, high) = (a.value().min(b.value()) as u64, a.value().max(b.value()) as u64);
        Pair(low << 33 | high << 1 | u64::from(a.is_negative() != b.is_negative()))
    }

    /// The lower value with a plus, and the other one.
    pub(super) fn terms(self) -> [Term; 2] {
        [Term::new((self.0 >> 33) as usize, false), Term::new((self.0 as u32 >> 1) as usize, self.0 & 1 == 1)]
    }
}

/// In which sums each pair of terms stands.
#[derive(Default)]
pub(super) struct Pairs {
    /// For look-ups only: most pairs stand in one sum.
    sums: FxHashMap<Pair, (usize, Vec<usize>)>,
    /// How often each pair stands that is there more than once: the most frequent last; of those, the one that was there
    /// first.
    ranks: BTreeSet<(usize, Reverse<Pair>)>,
    scratch: Vec<Pair>,
}

impl Pairs {
    pub(super) fn insert(&mut self, sum: usize, terms: &[Term]) {
        pairs_of(terms, &mut self.scratch);
        for p in &self.scratch {
            let p = *p;
            match self.sums.entry(p) {
                Entry::Vacant(place) => {
                    place.insert((sum, Vec::new()));
                }
                Entry::Occupied(mut place) => {
                    let more = &mut place.get_mut().1;
                    self.ranks.remove(&(more.len() + 1, Reverse(p)));
                    more.push(sum);
                    self.ranks.insert((more.len() + 1, Reverse(p)));
                }
            }
        }
    }

    pub(super) fn remove(&mut self, sum: usize, terms: &[Term]) {
        pairs_of(terms, &mut self.scratch);
        for p in &self.scratch {
            let p = *p;
            let Entry::Occupied(mut place) = self.sums.entry(p) else { unreachable!("a pair that was inserted") };
            let (first, more) = place.get_mut();
            if more.is_empty() {
                place.remove();
                continue;
            }
            self.ranks.remove(&(more.len() + 1, Reverse(p)));
            match more.iter().position(|s| *s == sum) {
                Some(at) => {
                    more.swap_remove(at);
                }
                None => *first = more.swap_remove(0),
            }
            if !more.is_empty() {
                self.ranks.insert((more.len() + 1, Reverse(p)));
            }
        }
    }

    pub(super) fn most_frequent(&self) -> Option<(Pair, Vec<usize>)> {
        let (_, Reverse(pair)) = self.ranks.last()?;
        let (first, more) = &self.sums[pair];
        let mut sums = more.clone();
        sums.push(*first);
        sums.sort_unstable();
        Some((*pair, sums))
    }
}

/// The pairs among some terms, each once.
fn pairs_of(terms: &[Term], pairs: &mut Vec<Pair>) {
    pairs.clear();
    for (i, a) in terms.iter().enumerate() {
        pairs.extend(terms[i + 1..].iter().map(|b| Pair::new(*a, *b)));
    }
    pairs.sort_unstable();
    pairs.dedup();
}
