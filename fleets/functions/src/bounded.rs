//! A map that forgets what was not asked for longest, and makes each value once, whoever asks meanwhile.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// A value that is made, or will be.
type Slot<V> = Arc<OnceLock<V>>;

/// So many values at most.
#[derive(Debug)]
pub struct BoundedMap<K, V> {
    most: usize,
    inner: Mutex<Entries<K, V>>,
}

#[derive(Debug)]
struct Entries<K, V> {
    /// When each was asked for last.
    slots: HashMap<K, (u64, Slot<V>)>,
    clock: u64,
}

impl<K: Hash + Eq + Clone, V: Clone> BoundedMap<K, V> {
    /// An empty one.
    pub fn new(most: usize) -> BoundedMap<K, V> {
        BoundedMap { most, inner: Mutex::new(Entries { slots: HashMap::new(), clock: 0 }) }
    }

    /// The value, made if it is not there. Who asks for it while it is made waits; others do not.
    pub fn get_or_make(&self, key: K, make: impl FnOnce() -> V) -> V {
        self.slot(key).get_or_init(make).clone()
    }

    /// Without this value, if it is there.
    pub fn forget(&self, key: &K) {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner).slots.remove(key);
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner).slots.len()
    }

    fn slot(&self, key: K) -> Slot<V> {
        let mut inner = self.inner.lock().unwrap_or_else(PoisonError::into_inner);
        inner.clock += 1;
        let now = inner.clock;
        if let Some((asked, slot)) = inner.slots.get_mut(&key) {
            *asked = now;
            return slot.clone();
        }
        if inner.slots.len() >= self.most {
            let oldest = inner.slots.iter().min_by_key(|(_, (asked, _))| *asked).map(|(key, _)| key.clone());
            oldest.map(|key| inner.slots.remove(&key));
        }
        let slot = Slot::default();
        inner.slots.insert(key, (now, slot.clone()));
        slot
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_not_asked_for_longest_is_forgotten() {
        let map = BoundedMap::new(2);
        let mut made = Vec::new();
        for key in [1, 2, 1, 3, 1, 2] {
            map.get_or_make(key, || made.push(key));
        }
        assert_eq!(made, [1, 2, 3, 2]);
        assert_eq!(map.count(), 2);
        map.forget(&1);
        assert_eq!(map.count(), 1);
    }
}
