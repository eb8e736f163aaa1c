//! Where the numbers of many states are.

use crate::native::NativeInstructions;
use crate::number::Number;

/// How the entries of an input or a result lie in memory: entry k of state i at `i * by_state + k * by_entry`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BatchLayout {
    /// From a state to the next.
    pub by_state: usize,
    /// From an entry to the next.
    pub by_entry: usize,
}

impl BatchLayout {
    /// State after state, each with its entries together: an array of structures, or a matrix with a row per state.
    pub fn states_of(entries: usize) -> BatchLayout {
        BatchLayout { by_state: entries, by_entry: 1 }
    }

    /// Entry after entry, each with those of all states together: a structure of arrays.
    pub fn entries_of(states: usize) -> BatchLayout {
        BatchLayout { by_state: 1, by_entry: states }
    }

    /// How long an array has to be; none where two results would be in one place, or the length is no number.
    pub(crate) fn length(self, states: usize, entries: usize) -> Option<usize> {
        let last = |count: usize, by: usize| count.checked_sub(1)?.checked_mul(by);
        if states == 0 || entries == 0 {
            return Some(0);
        }
        last(states, self.by_state)?.checked_add(last(entries, self.by_entry)?)?.checked_add(1)
    }

    /// Whether different entries are in different places; where there are none, they are.
    pub(crate) fn is_apart(self, states: usize, entries: usize) -> bool {
        let (n, m) = (states, entries);
        let (a, b) = (self.by_state, self.by_entry);
        if n == 0 || m == 0 {
            return true;
        }
        // one runs within the steps of the other
        let within = |n: usize, a: usize, b: usize| (n - 1).checked_mul(a).is_some_and(|length| length < b);
        (n == 1 || a > 0) && (m == 1 || b > 0) && (n == 1 || m == 1 || within(n, a, b) || within(m, b, a))
    }

    /// Copies so many entries of `N` states from `first` on beside one another, those of the last of all states for lanes behind it. `to` has `N` more
    /// than entries, which may be overwritten.
    #[inline(always)]
    pub(crate) fn gather<T: Number, const N: usize>(
        self,
        from: &[T],
        [first, states]: [usize; 2],
        (entries, to): (usize, &mut [[T; N]]),
        by: NativeInstructions,
    ) {
        let is_whole = first + N <= states;
        if self.by_state == 1 && is_whole {
            for (k, lanes) in to[..entries].iter_mut().enumerate() {
                lanes.copy_from_slice(&from[k * self.by_entry + first..][..N]);
            }
            return;
        }
        if self.by_entry == 1 && is_whole {
            let mut rows = [[T::default(); N]; N];
            for k in (0..entries).step_by(N) {
                let from = &from[first * self.by_state + k..];
                if from.len() >= (N - 1) * self.by_state + N {
                    // what stands behind a row is read along with it
                    for (lane, row) in rows.iter_mut().enumerate() {
                        *row = *from[lane * self.by_state..].first_chunk().expect("as long as all");
                    }
                } else {
                    for (lane, row) in rows.iter_mut().enumerate() {
                        row.iter_mut().zip(&from[lane * self.by_state..]).for_each(|(x, from)| *x = *from);
                    }
                }
                by.transpose(&rows, to[k..].first_chunk_mut().expect("there are more than entries"));
            }
            return;
        }
        for (k, lanes) in to[..entries].iter_mut().enumerate() {
            *lanes =
                std::array::from_fn(|lane| from[k * self.by_entry + (first + lane).min(states - 1) * self.by_state]);
        }
    }

    /// Copies the lanes of so many entries back, but those behind the last state. There are `N` more of them than entries.
    #[inline(always)]
    pub(crate) fn scatter<T: Number, const N: usize>(
        self,
        (entries, lanes): (usize, &[[T; N]]),
        [first, states]: [usize; 2],
        to: &mut [T],
        by: NativeInstructions,
    ) {
        let is_whole = first + N <= states;
        if self.by_state == 1 && is_whole {
            for (k, lanes) in lanes[..entries].iter().enumerate() {
                to[k * self.by_entry + first..][..N].copy_from_slice(lanes);
            }
            return;
        }
        if self.by_entry == 1 && is_whole {
            // a row of fewer than `N` is written along with what belongs to the next ones, which are written after it, where they follow without a gap
            let wide = match entries {
                1.. if entries < N && self.by_state == entries => N + 1 - N.div_ceil(entries),
                _ if entries < N => 0,
                _ => N,
            };
            let last = entries.saturating_sub(N);
            let mut rows = [[T::default(); N]; N];
            for k in (0..entries).step_by(N).map(|k| k.min(last)) {
                by.transpose(lanes[k..].first_chunk().expect("there are more than entries"), &mut rows);
                let to = &mut to[first * self.by_state + k..];
                for (lane, row) in rows[..wide].iter().enumerate() {
                    *to[lane * self.by_state..].first_chunk_mut().expect("as long as all") = *row;
                }
                for (lane, row) in rows.iter().enumerate().skip(wide) {
                    to[lane * self.by_state..][..entries].copy_from_slice(&row[..entries]);
                }
            }
            return;
        }
        for (k, lanes) in lanes[..entries].iter().enumerate() {
            let to = &mut to[k * self.by_entry + first * self.by_state..];
            for (lane, x) in lanes.iter().enumerate().take(states - first) {
                to[lane * self.by_state] = *x;
            }
        }
    }
}
