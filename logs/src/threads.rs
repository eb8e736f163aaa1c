//! Independent parts on all processors.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// What `part` makes of 0, 1, … in their order, by as many threads as there are processors.
///
/// # Panics
/// If a part does.
pub fn in_threads<T: Send>(count: usize, part: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let work = || {
        let own = std::iter::from_fn(|| Some(next.fetch_add(1, Ordering::Relaxed)).filter(|k| *k < count));
        own.map(|k| (k, part(k))).collect::<Vec<_>>()
    };
    let threads = processors().min(count);
    let mut found = thread::scope(|scope| {
        let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
        let mut found = work();
        others.into_iter().for_each(|other| found.extend(other.join().unwrap_or_else(|panic| resume_unwind(panic))));
        found
    });
    found.sort_unstable_by_key(|(k, _)| *k);
    found.into_iter().map(|(_, made)| made).collect()
}

/// How many threads run at once.
pub fn processors() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}
