//! Machine code in memory that can be executed: the one place with `unsafe`.
//!
//! What is called has been written by [`machine`](crate::machine) from instructions of [`allocation`](crate::allocation), which read and write cells of the frame and read
//! constants, whose numbers are known: [`NativeCode::run`] asserts that both are as long. Pages are written first and made executable then, and are
//! never both. A function returns to where it was called from, keeps no address and touches nothing else.

use memmap2::{Mmap, MmapMut};
use std::io;

/// What is written: see [`x86`](crate::machine::x86). Elsewhere there is none.
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
        Ok(NativeCode { pages: pages.make_exec()?, starts, lengths })
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
        // SAFETY: `start` is the beginning of a function that `machine::x86::function` wrote for this ABI, in pages that live as long as `self`. It
        // touches `lengths` numbers of frame and constants at most, which are there, and changes those of the frame alone.
        unsafe {
            let function: Function<T> = std::mem::transmute(start);
            function(frame.as_mut_ptr(), constants.as_ptr());
        }
    }
}
