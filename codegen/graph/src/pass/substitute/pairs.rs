//! Values by what they are at the first point.

use super::search::WINDOW;
use super::values::AtPoints;
use super::{NewPair, PairForm};
use crate::expr::{Graph, Op};
use rustc_hash::FxHashMap;

/// A set of keys that may hold more than was put in: most of what is looked for is not there, and this fits into a cache.
pub(super) struct Filter(Vec<u64>);

impl Filter {
    pub(super) fn new(keys: usize) -> Filter {
        Filter(vec![0; (keys / 8).max(8).next_power_of_two()])
    }

    fn place(&self, key: u64) -> (usize, u64) {
        let hash = (key.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 20) as usize;
        ((hash / 64) & (self.0.len() - 1), 1 << (hash % 64))
    }

    pub(super) fn insert(&mut self, key: u64) {
        let (word, bit) = self.place(key);
        self.0[word] |= bit;
    }

    pub(super) fn may_have(&self, key: u64) -> bool {
        let (word, bit) = self.place(key);
        self.0[word] & bit != 0
    }
}

/// Values of pairs, found by what they are at the first point.
pub(super) struct PairTable {
    known: Filter,
    /// Each with the next one of its key: a list per key, without a place of its own for every one of many.
    entries: Vec<(NewPair, u32)>,
    /// The first and the last entry of a key.
    ends: FxHashMap<u64, [u32; 2]>,
}

/// After the last entry of a key.
const NONE: u32 = u32::MAX;

impl PairTable {
    /// Those that are wanted.
    pub(super) fn new(
        graph: &Graph,
        numbers: &[usize],
        free: &[bool],
        values: &[AtPoints],
        wanted: &Filter,
    ) -> PairTable {
        let is_constant = |i: usize| matches!(graph.ops[i], Op::Constant(_));
        let mut table = PairTable { known: Filter::new(0), entries: Vec::new(), ends: FxHashMap::default() };
        for (k, &i) in numbers.iter().enumerate() {
            for &j in &numbers[k..] {
                if !(free[i] || free[j] || j - i <= WINDOW) || (is_constant(i) && is_constant(j)) {
                    continue;
                }
                let (x, y) = (values[i][0].hi(), values[j][0].hi());
                let is_one_lost = is_one_lost(&values[i], &values[j]);
                for (form, z) in [(PairForm::Product, x * y), (PairForm::Sum, x + y), (PairForm::Difference, x - y)] {
                    if form != PairForm::Product && is_one_lost {
                        break;
                    }
                    if wanted.may_have(key(z)) && (i != j || form != PairForm::Difference) {
                        table.insert(key(z), (i, j, form));
                    }
                }
            }
        }
        table.known = Filter::new(8 * table.ends.len());
        table.ends.keys().for_each(|key| table.known.insert(*key));
        table
    }

    fn insert(&mut self, key: u64, pair: NewPair) {
        let at = self.entries.len() as u32;
        self.entries.push((pair, NONE));
        let ends = self.ends.entry(key).or_insert([at; 2]);
        if ends[1] != at {
            self.entries[ends[1] as usize].1 = at;
            ends[1] = at;
        }
    }

    pub(super) fn find(&self, x: f64) -> impl Iterator<Item = NewPair> + '_ {
        let firsts = keys(x).filter(|k| self.known.may_have(*k)).filter_map(|k| self.ends.get(&k));
        let entry = |at: u32| self.entries.get(at as usize);
        firsts
            .flat_map(move |[first, _]| std::iter::successors(entry(*first), move |(_, next)| entry(*next)))
            .map(|e| e.0)
    }
}

/// Whether one of two is too small for the key of their sum: that is the other's.
pub(super) fn is_one_lost(x: &AtPoints, y: &AtPoints) -> bool {
    let [x, y] = [x, y].map(|v| v[0].hi().abs());
    x.min(y) < 1e-9 * x.max(y)
}

/// Numbers that agree to some 1e-9 have the same key, whatever their sign, or neighbouring ones.
pub(super) fn key(x: f64) -> u64 {
    x.abs().to_bits() >> 22
}

/// The keys that a number may have that is about this one.
pub(super) fn keys(x: f64) -> impl Iterator<Item = u64> {
    let bits = x.abs().to_bits();
    let (low, high) = (bits.saturating_sub(1 << 14) >> 22, (bits + (1 << 14)) >> 22);
    [Some(low), (high != low).then_some(high)].into_iter().flatten()
}
