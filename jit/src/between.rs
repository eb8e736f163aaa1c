//! What is computed between two phases, on a frame: sines, cosines and signs.
//!
//! None of a phase's calls waits for another. Where there is one state, angles of several calls are the lanes of one.

use crate::allocation::{AllocatedProgram, MemoryPlace};
use crate::native::SineInstructions;
use crate::number::Number;
use crate::tape::{CallBetween, TapeOperand};

/// So many angles of one state are computed at once.
const ANGLES: usize = 8;
/// A sum of so many angles needs no memory from the heap.
pub(crate) const FEW: usize = 16;

/// The calls before a phase, by places in memory.
#[derive(Debug, Default)]
pub struct PlacedCalls {
    /// Of an angle.
    sines: Vec<(MemoryPlace, [usize; 2])>,
    /// Of sums of angles.
    sums: Vec<(Vec<MemoryPlace>, [usize; 2])>,
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
                    let angles: Vec<MemoryPlace> = angles.iter().map(|angle| allocated.place(*angle)).collect();
                    let values = values.map(cell);
                    match angles[..] {
                        [angle] => placed.sines.push((angle, values)),
                        _ => placed.sums.push((angles, values)),
                    }
                }
                CallBetween::Sign { of, value } => placed.signs.push((allocated.place(*of), cell(*value))),
            }
        }
        placed
    }

    /// Runs them on a frame of `N` lanes, from which `read` reads.
    pub fn run<T: Number, const N: usize>(
        &self,
        frame: &mut [T],
        read: impl Fn(&[T], MemoryPlace) -> [T; N],
        (by, fused): (SineInstructions, bool),
    ) {
        let put = |frame: &mut [T], cell: usize, value: &[T]| frame[cell * N..][..N].copy_from_slice(value);
        if N == 1 {
            for calls in self.sines.chunks(ANGLES) {
                let mut angles = [T::zero(); ANGLES];
                angles.iter_mut().zip(calls).for_each(|(angle, (place, _))| *angle = read(frame, *place)[0]);
                let (sines, cosines) = by.sin_cos(&[angles], fused);
                for (k, (_, [sine, cosine])) in calls.iter().enumerate() {
                    put(frame, *sine, &sines[k..=k]);
                    put(frame, *cosine, &cosines[k..=k]);
                }
            }
        } else {
            for (angle, [sine, cosine]) in &self.sines {
                let (sines, cosines) = by.sin_cos(&[read(frame, *angle)], fused);
                put(frame, *sine, &sines);
                put(frame, *cosine, &cosines);
            }
        }
        for (angles, [sine, cosine]) in &self.sums {
            let (mut few, many);
            let terms: &[[T; N]] = if angles.len() <= FEW {
                few = [[T::zero(); N]; FEW];
                few.iter_mut().zip(angles).for_each(|(term, angle)| *term = read(frame, *angle));
                &few[..angles.len()]
            } else {
                many = angles.iter().map(|angle| read(frame, *angle)).collect::<Vec<_>>();
                &many
            };
            let (sines, cosines) = by.sin_cos(terms, fused);
            put(frame, *sine, &sines);
            put(frame, *cosine, &cosines);
        }
        for (of, sign) in &self.signs {
            let signs = read(frame, *of).map(T::sign);
            put(frame, *sign, &signs);
        }
    }
}
