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

    /// Copies so many entries of `N` states from `first` on beside one another, those of the last of all states for lanes behind it. What stands behind
    /// the entries in `to` may be overwritten.
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
            for k in (0..entries).step_by(N) {
                let count = N.min(entries - k);
                let row = |lane: usize| &from[(first + lane) * self.by_state + k..];
                // what stands behind a row is read along with it where there is something
                let rows: [[T; N]; N] = match row(N - 1).len() >= N {
                    true => std::array::from_fn(|lane| *row(lane).first_chunk().expect("as long as the last")),
                    false => std::array::from_fn(|lane| padded(&row(lane)[..count])),
                };
                let columns = by.transposed(rows);
                match to[k..].first_chunk_mut() {
                    Some(to) => *to = columns,
                    None => to[k..k + count].copy_from_slice(&columns[..count]),
                }
            }
            return;
        }
        for (k, lanes) in to[..entries].iter_mut().enumerate() {
            *lanes =
                std::array::from_fn(|lane| from[k * self.by_entry + (first + lane).min(states - 1) * self.by_state]);
        }
    }

    /// Copies the lanes of so many entries back, but those behind the last state.
    #[inline(always)]
    pub(crate) fn scatter<'a, T: Number, const N: usize>(
        self,
        (entries, lanes): (usize, impl Fn(usize) -> &'a [T; N]),
        [first, states]: [usize; 2],
        to: &mut [T],
        by: NativeInstructions,
    ) {
        let is_whole = first + N <= states;
        if self.by_state == 1 && is_whole {
            for k in 0..entries {
                to[k * self.by_entry + first..][..N].copy_from_slice(lanes(k));
            }
            return;
        }
        if self.by_entry == 1 && is_whole {
            // a row of fewer than `N` is written with what belongs to the next one, which is written after it
            let last = entries.saturating_sub(N);
            let end = if self.by_state == entries { (first + N) * entries } else { 0 };
            for k in (0..entries).step_by(N).map(|k| k.min(last)) {
                let count = N.min(entries - k);
                let columns = std::array::from_fn(|j| if j < count { *lanes(k + j) } else { [T::default(); N] });
                for (lane, row) in by.transposed(columns).iter().enumerate() {
                    let at = (first + lane) * self.by_state + k;
                    let length = if count == N || at + N <= end { N } else { count };
                    match to[at..at + length].first_chunk_mut() {
                        Some(to) => *to = *row,
                        None => to[at..at + length].copy_from_slice(&row[..length]),
                    }
                }
            }
            return;
        }
        for k in 0..entries {
            let to = &mut to[k * self.by_entry + first * self.by_state..];
            for (lane, x) in lanes(k).iter().enumerate().take(states - first) {
                to[lane * self.by_state] = *x;
            }
        }
    }
}

/// A row with zeros behind it.
#[inline(always)]
fn padded<T: Number, const N: usize>(row: &[T]) -> [T; N] {
    std::array::from_fn(|k| row.get(k).copied().unwrap_or_default())
}
