//! What several tests compile is compiled once.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// What was made, by key.
#[derive(Debug)]
pub struct Made<T>(Mutex<BTreeMap<String, Arc<OnceLock<T>>>>);

impl<T: Clone> Made<T> {
    /// Nothing yet.
    pub const fn nothing() -> Made<T> {
        Made(Mutex::new(BTreeMap::new()))
    }

    /// What has this key. Who asks first makes it; who asks meanwhile waits.
    pub fn once(&self, key: String, make: impl FnOnce() -> T) -> T {
        let place = self.0.lock().unwrap_or_else(PoisonError::into_inner).entry(key).or_default().clone();
        place.get_or_init(make).clone()
    }
}
