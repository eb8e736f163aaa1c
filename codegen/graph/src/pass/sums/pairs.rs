//! In which sums each pair of terms stands.

use super::Term;
use rustc_hash::FxHashMap;
use std::cmp::Reverse;
use std::collections::hash_map::Entry;
use std::collections::BTreeSet;

/// Two values, and whether their signs differ.
type Pair = (usize, usize, bool);

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
        pairs.extend(terms[i + 1..].iter().map(|b| pair(*a, *b)));
    }
    pairs.sort_unstable();
    pairs.dedup();
}

/// The unordered pair up to a common sign: whether the signs differ.
pub(super) fn pair(a: Term, b: Term) -> Pair {
    (a.value().min(b.value()), a.value().max(b.value()), a.is_negative() != b.is_negative())
}
