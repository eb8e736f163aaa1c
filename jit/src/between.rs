//! What is computed between two phases, on a frame: sines, cosines and signs.
//!
//! None of a phase's calls waits for another. Where there is one state, angles of several calls are the lanes of one.

use crate::allocation::{AllocatedProgram, MemoryPlace};
use crate::interpreter::sum_of_angles;
use crate::native::NativeInstructions;
use crate::number::Number;
use crate::tape::{CallBetween, TapeOperand};

/// So many angles of one state are computed at once.
const ANGLES: usize = 8;

/// The calls before a phase, by places in memory.
#[derive(Debug, Default)]
pub struct PlacedCalls {
    /// Of the sums of these angles.
    sines: Vec<(Box<[MemoryPlace]>, [usize; 2])>,
    signs: Vec<(MemoryPlace, usize)>,
}

impl PlacedCalls {
    pub fn new(calls: &[CallBetween], allocated: &AllocatedProgram) -> PlacedCalls {
        let cell = |value: usize| match allocated.place(TapeOperand::Value(value)) {
            MemoryPlace::Cell(cell) => cell,
            other => unreachable!("a value is in a cell: {other:?}"),
        };
        let mut placed = PlacedCalls::default();
        for call in calls {
            match call {
                CallBetween::SinCos { angles, values } => {
                    let angles = angles.iter().map(|angle| allocated.place(*angle)).collect();
                    placed.sines.push((angles, values.map(cell)));
                }
                CallBetween::Sign { of, value } => placed.signs.push((allocated.place(*of), cell(*value))),
            }
        }
        placed
    }

    /// Runs them on a frame of `N` lanes, from which `read` reads.
    #[inline(always)]
    pub fn run<T: Number, const N: usize>(
        &self,
        frame: &mut [T],
        read: impl Fn(&[T], MemoryPlace) -> [T; N],
        (by, fused): (NativeInstructions, bool),
    ) {
        let put = |frame: &mut [T], cell: usize, value: [T; N]| frame.as_chunks_mut().0[cell] = value;
        let sum = |frame: &[T], angles: &[MemoryPlace]| sum_of_angles(angles.iter().map(|angle| read(frame, *angle)));
        if N == 1 {
            for calls in self.sines.chunks(ANGLES) {
                let mut sums = [[T::zero(); 2]; ANGLES];
                sums.iter_mut().zip(calls).for_each(|(of, (angles, _))| *of = sum(frame, angles)[0]);
                let (sines, cosines) = by.sin_cos(sums, fused);
                for (k, (_, [sine, cosine])) in calls.iter().enumerate() {
                    put(frame, *sine, [sines[k]; N]);
                    put(frame, *cosine, [cosines[k]; N]);
                }
            }
        } else {
            for (angles, [sine, cosine]) in &self.sines {
                let (sines, cosines) = by.sin_cos(sum(frame, angles), fused);
                put(frame, *sine, sines);
                put(frame, *cosine, cosines);
            }
        }
        for (of, sign) in &self.signs {
            let signs = read(frame, *of).map(T::sign);
            put(frame, *sign, signs);
        }
    }
}
