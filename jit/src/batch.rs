//! Where the numbers of many states are.

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

    /// Copies the entries of `N` states from `first` on beside one another, those of the last of all states for lanes behind it.
    #[inline(always)]
    pub(crate) fn gather<T: Copy, const N: usize>(self, from: &[T], [first, states]: [usize; 2], to: &mut [[T; N]]) {
        let is_whole = first + N <= states;
        if self.by_state == 1 && is_whole {
            for (k, lanes) in to.iter_mut().enumerate() {
                lanes.copy_from_slice(&from[k * self.by_entry + first..][..N]);
            }
            return;
        }
        if self.by_entry == 1 && is_whole {
            let entries = to.len();
            let rows: [&[T]; N] = std::array::from_fn(|lane| &from[(first + lane) * self.by_state..][..entries]);
            for (k, lanes) in to.iter_mut().enumerate() {
                *lanes = rows.map(|row| row[k]);
            }
            return;
        }
        for (k, lanes) in to.iter_mut().enumerate() {
            *lanes =
                std::array::from_fn(|lane| from[k * self.by_entry + (first + lane).min(states - 1) * self.by_state]);
        }
    }

    /// Copies the lanes of entry `k` back, but those behind the last state.
    #[inline(always)]
    pub(crate) fn scatter<T: Copy, const N: usize>(
        self,
        lanes: &[T; N],
        [first, states]: [usize; 2],
        k: usize,
        to: &mut [T],
    ) {
        let to = &mut to[k * self.by_entry + first * self.by_state..];
        if self.by_state == 1 && first + N <= states {
            to[..N].copy_from_slice(lanes);
            return;
        }
        for (lane, x) in lanes.iter().enumerate().take(states - first) {
            to[lane * self.by_state] = *x;
        }
    }
}
