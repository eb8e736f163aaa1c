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
    entries: FxHashMap<u64, Vec<NewPair>>,
}

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
        let mut entries: FxHashMap<u64, Vec<NewPair>> = FxHashMap::default();
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
                        entries.entry(key(z)).or_default().push((i, j, form));
                    }
                }
            }
        }
        let mut known = Filter::new(8 * entries.len());
        entries.keys().for_each(|key| known.insert(*key));
        PairTable { known, entries }
    }

    pub(super) fn find(&self, x: f64) -> impl Iterator<Item = NewPair> + '_ {
        keys(x).filter(|k| self.known.may_have(*k)).filter_map(|k| self.entries.get(&k)).flatten().copied()
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
