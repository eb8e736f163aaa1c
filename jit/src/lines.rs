//! Numbers that begin where a line of memory does: vectors as long as a line would reach over two of them otherwise, each of which takes its time.

use crate::number::Number;
use std::ops::{Deref, DerefMut};

/// Bytes of a line of memory, and of the longest vector.
const LINE: usize = 64;

/// Numbers, the first of which begins a line of memory.
#[derive(Debug)]
pub struct LineNumbers<T> {
    numbers: Vec<T>,
    first: usize,
}

impl<T: Number> LineNumbers<T> {
    /// So many zeros.
    pub fn zeros(length: usize) -> LineNumbers<T> {
        LineNumbers::new(std::iter::repeat_n(T::default(), length), length)
    }

    /// These numbers, of which there are so many.
    pub fn new(list: impl Iterator<Item = T>, length: usize) -> LineNumbers<T> {
        let most = LINE / T::BYTES;
        let mut numbers: Vec<T> = Vec::with_capacity(length + most);
        // room for all is there, so that they stay where they are
        let first = numbers.as_ptr().align_offset(LINE).min(most);
        numbers.resize(first, T::default());
        numbers.extend(list.take(length));
        LineNumbers { numbers, first }
    }
}

impl<T> Deref for LineNumbers<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.numbers[self.first..]
    }
}

impl<T> DerefMut for LineNumbers<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.numbers[self.first..]
    }
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    /// Of any length they begin a line, before and after they are moved.
    pub fn numbers_begin_a_line() {
        for length in 0..40 {
            let (zeros, list) =
                (LineNumbers::<f64>::zeros(length), LineNumbers::new((0..length).map(|k| k as f32), length));
            assert_eq!((zeros.len(), list.len()), (length, length));
            assert!(list.iter().enumerate().all(|(k, x)| *x == k as f32) && zeros.iter().all(|x| *x == 0.0));
            let moved = Box::new((zeros, list));
            assert_eq!([moved.0.as_ptr() as usize % LINE, moved.1.as_ptr() as usize % LINE], [0; 2]);
        }
    }
}
