//! Machine code in memory that can be executed, and jobs that are compiled for the instructions of this machine: the one place with `unsafe`.
//!
//! What is called has been written by [`machine`](crate::machine) from instructions of [`allocation`](crate::allocation), which read and write cells of the frame and read
//! constants, whose numbers are known: [`NativeCode::run`] asserts that both are as long. Pages are written first and made executable then, and are
//! never both. A function returns to where it was called from, keeps no address and touches nothing else.

#[cfg(target_arch = "x86_64")]
mod transposition;

use crate::interpreter;
#[cfg(target_arch = "x86_64")]
use crate::machine::x86_has;
use crate::number::Number;
use memmap2::{Mmap, MmapMut};
use std::io;

/// What is written: see [`x86`](crate::machine::x86) and [`aarch64`](crate::machine::aarch64). Elsewhere there is none.
#[cfg(target_arch = "x86_64")]
type Function<T> = extern "sysv64" fn(*mut T, *const T);
#[cfg(not(target_arch = "x86_64"))]
type Function<T> = extern "C" fn(*mut T, *const T);

/// The functions of a tape, one per phase.
#[derive(Debug)]
pub struct NativeCode {
    pages: Mmap,
    /// Where each begins.
    starts: Vec<usize>,
    /// So many numbers a frame has to have, and constants there have to be.
    lengths: [usize; 2],
}

impl NativeCode {
    /// Executable code of these functions.
    ///
    /// # Errors
    /// If the system has no such memory to give.
    pub fn new(functions: &[Vec<u8>], lengths: [usize; 2]) -> io::Result<NativeCode> {
        // a page at least: none of no bytes can be had
        let length = functions.iter().map(Vec::len).sum::<usize>().max(1);
        let mut pages = MmapMut::map_anon(length)?;
        let (mut starts, mut at) = (Vec::new(), 0);
        for function in functions {
            starts.push(at);
            pages[at..at + function.len()].copy_from_slice(function);
            at += function.len();
        }
        let pages = pages.make_exec()?;
        publish(&pages);
        Ok(NativeCode { pages, starts, lengths })
    }

    /// How many bytes there are.
    pub fn len(&self) -> usize {
        self.pages.len()
    }

    /// Runs the function of a phase on a frame.
    ///
    /// # Panics
    /// If the frame or the constants are shorter than the code was made for.
    #[inline]
    pub fn run<T>(&self, phase: usize, frame: &mut [T], constants: &[T]) {
        assert!(frame.len() >= self.lengths[0] && constants.len() >= self.lengths[1], "as long as it was made for");
        let start = self.pages[self.starts[phase]..].as_ptr();
        // SAFETY: `start` is the beginning of a function that this machine's row of `machine` wrote for this ABI, in pages that live as long as `self`. It
        // touches `lengths` numbers of frame and constants at most, which are there, and changes those of the frame alone.
        unsafe {
            let function: Function<T> = std::mem::transmute(start);
            function(frame.as_mut_ptr(), constants.as_ptr());
        }
    }
}

/// What was written is what is fetched: machines see to that themselves, but for those of the function below.
#[cfg(not(target_arch = "aarch64"))]
fn publish(_: &[u8]) {}

/// What was written is what is fetched from now on: lines of the data cache go to where it meets that of instructions, which forgets those that it has (Arm
/// Architecture Reference Manual, "Caches and memory hierarchy": synchronization and coherency between data and instruction accesses).
#[cfg(target_arch = "aarch64")]
fn publish(code: &[u8]) {
    use std::arch::asm;
    let start = code.as_ptr() as usize;
    let lines = |length: usize| (start & !(length - 1)..start + code.len()).step_by(length);
    let types: usize;
    // SAFETY: what programs may do on this machine under the systems that `machine` calls it on; no memory is changed
    unsafe {
        asm!("mrs {}, ctr_el0", out(reg) types, options(nomem, nostack, preserves_flags));
        // the shortest lines, as powers of two of words
        let [of_instructions, of_data] = [0, 16].map(|field| 4 << (types >> field & 15));
        lines(of_data).for_each(|line| asm!("dc cvau, {}", in(reg) line, options(nostack, preserves_flags)));
        asm!("dsb ish", options(nostack, preserves_flags));
        lines(of_instructions).for_each(|line| asm!("ic ivau, {}", in(reg) line, options(nostack, preserves_flags)));
        asm!("dsb ish", "isb", options(nostack, preserves_flags));
    }
}

/// The instructions that jobs are performed by, found out once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NativeInstructions(NativeTarget);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum NativeTarget {
    Any,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl NativeInstructions {
    /// What every machine has.
    pub const ANY: NativeInstructions = NativeInstructions(NativeTarget::Any);

    /// The fastest that this machine has.
    pub fn best() -> NativeInstructions {
        #[cfg(target_arch = "x86_64")]
        if x86_has!("avx2" "fma") {
            let is_wide = x86_has!("avx512f" "avx512vl" "avx512dq");
            return NativeInstructions(if is_wide { NativeTarget::Avx512 } else { NativeTarget::Avx2 });
        }
        NativeInstructions::ANY
    }

    /// Does that by these instructions: with the same bits by all.
    #[inline(always)]
    pub fn perform<J: NativeJob>(self, job: J) -> J::Output {
        match self.0 {
            NativeTarget::Any => job.run(self),
            // SAFETY: only `best` makes these, and only where the machine has the instructions
            #[cfg(target_arch = "x86_64")]
            NativeTarget::Avx2 => unsafe { perform_by_avx2(job) },
            // SAFETY: as above
            #[cfg(target_arch = "x86_64")]
            NativeTarget::Avx512 => unsafe { perform_by_avx512(job) },
        }
    }

    /// Writes the columns of rows.
    #[inline(always)]
    pub fn transpose<T: Number, const N: usize>(self, rows: &[[T; N]; N], columns: &mut [[T; N]; N]) {
        match self.0 {
            // SAFETY: only `best` makes these, and only where the machine has the instructions
            #[cfg(target_arch = "x86_64")]
            NativeTarget::Avx512 => unsafe { transposition::transpose(rows, columns) },
            _ => transpose_numbers(rows, columns),
        }
    }

    /// Sines and cosines of sums of angles in two pieces, lane by lane.
    #[inline(always)]
    pub fn sin_cos<T: Number, const N: usize>(self, sums: [[T; 2]; N], fused: bool) -> ([T; N], [T; N]) {
        self.perform(SinesOfSums { sums, fused })
    }
}

/// What is compiled once for each set of instructions. All that it calls is `#[inline(always)]`, and so becomes part of functions for these instructions, or has
/// them itself: numbers that machine code reads as a vector are written as one, which the store buffer hands on at once, and as several it does not.
pub trait NativeJob {
    /// What comes of it.
    type Output;

    /// Does it, as part of what is compiled for these instructions.
    fn run(self, by: NativeInstructions) -> Self::Output;
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn perform_by_avx2<J: NativeJob>(job: J) -> J::Output {
    job.run(NativeInstructions(NativeTarget::Avx2))
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,avx512f,avx512vl,avx512dq")]
fn perform_by_avx512<J: NativeJob>(job: J) -> J::Output {
    job.run(NativeInstructions(NativeTarget::Avx512))
}

/// Writes the columns of rows, number by number.
#[inline(always)]
fn transpose_numbers<T: Copy, const N: usize>(rows: &[[T; N]; N], columns: &mut [[T; N]; N]) {
    for (k, column) in columns.iter_mut().enumerate() {
        *column = rows.map(|row| row[k]);
    }
}

struct SinesOfSums<T, const N: usize> {
    sums: [[T; 2]; N],
    fused: bool,
}

impl<T: Number, const N: usize> NativeJob for SinesOfSums<T, N> {
    type Output = ([T; N], [T; N]);

    #[inline(always)]
    fn run(self, _by: NativeInstructions) -> Self::Output {
        interpreter::sin_cos(self.sums, self.fused)
    }
}
