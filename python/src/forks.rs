//! No process is forked while functions are compiled: the child would have the lock of a thread that it does not have, and wait for ever.
//!
//! `os.fork` calls [`before_fork`] and [`after_fork`] (`_robot.py` registers them). Nothing here can be left locked in a child: who waits looks
//! again and again.

use pyo3::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::sleep;
use std::time::Duration;

/// Threads that compile, or wait for one that does.
static COMPILING: AtomicUsize = AtomicUsize::new(0);
/// Whether a thread is about to fork.
static FORKING: AtomicBool = AtomicBool::new(false);

const PAUSE: Duration = Duration::from_micros(100);

/// As long as it lives, forks wait.
pub struct WithoutForks(());

impl WithoutForks {
    /// Begins; waits for a fork that has begun. The interpreter must not be held, and no other of this thread may live.
    pub fn begin() -> WithoutForks {
        loop {
            COMPILING.fetch_add(1, Ordering::SeqCst);
            if !FORKING.load(Ordering::SeqCst) {
                return WithoutForks(());
            }
            COMPILING.fetch_sub(1, Ordering::SeqCst);
            sleep(PAUSE);
        }
    }
}

impl Drop for WithoutForks {
    fn drop(&mut self) {
        COMPILING.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Waits until nothing is compiled; from then on whoever wants to compile waits.
#[pyfunction]
pub fn before_fork(py: Python<'_>) {
    py.detach(|| {
        while FORKING.swap(true, Ordering::SeqCst) {
            sleep(PAUSE);
        }
        while COMPILING.load(Ordering::SeqCst) > 0 {
            sleep(PAUSE);
        }
    });
}

/// In both processes: functions can be compiled again. Threads of the parent that wait to compile are not in the child.
#[pyfunction]
pub fn after_fork(is_child: bool) {
    if is_child {
        COMPILING.store(0, Ordering::SeqCst);
    }
    FORKING.store(false, Ordering::SeqCst);
}
