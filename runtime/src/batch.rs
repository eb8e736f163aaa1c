//! Many states at once: what runs the batch functions of generated code.
//!
//! The feature `std` chooses the vector instructions of the machine at run time; without it they are those that the crate is
//! compiled for. The feature `rayon` adds the functions that end in `_parallel`.

#[cfg(feature = "rayon")]
use straightline_core::batch::Divisible;
pub use straightline_core::batch::{
    aos, check, rows, rows_mut, soa, take, take_mut, Aos, Job, Machine, Plain, Program, Soa, WrongLength,
};

#[cfg(feature = "std")]
pub use crate::dispatch::{run_f32, run_f64};
#[cfg(not(feature = "std"))]
pub use straightline_core::batch::{run_f32, run_f64};

/// Fewer states than this are not shared out: a few microseconds of work, as much as handing it to another thread takes.
#[cfg(feature = "rayon")]
const GRAIN: usize = 256;
/// A multiple of every number of lanes.
#[cfg(feature = "rayon")]
const BLOCK: usize = 16;

/// Runs a batch of f64 on rayon's threads, and with the instructions of this machine.
#[cfg(feature = "rayon")]
pub fn run_parallel_f64(job: impl Divisible + Send) {
    parallel(job, run_f64);
}

/// Runs a batch of f32 on rayon's threads, and with the instructions of this machine.
#[cfg(feature = "rayon")]
pub fn run_parallel_f32(job: impl Divisible + Send) {
    parallel(job, run_f32);
}

/// Halves the batch until its parts are small; the threads that have nothing to do take what the others have left.
#[cfg(feature = "rayon")]
fn parallel<J: Divisible + Send>(job: J, run: impl Fn(J) + Copy + Send + Sync) {
    let states = job.states();
    if states < 2 * GRAIN {
        return run(job);
    }
    // whole blocks to the first half
    let (first, second) = job.split(states / 2 / BLOCK * BLOCK);
    rayon::join(|| parallel(first, run), || parallel(second, run));
}

/// The items, if the feature `rayon` is on: generated code holds its functions on several threads in it.
#[cfg(feature = "rayon")]
#[macro_export]
#[doc(hidden)]
macro_rules! with_threads {
    ($($item:tt)*) => { $($item)* };
}

/// No items, as the feature `rayon` is off.
#[cfg(not(feature = "rayon"))]
#[macro_export]
#[doc(hidden)]
macro_rules! with_threads {
    ($($item:tt)*) => {};
}
