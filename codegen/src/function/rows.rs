//! The rows of a six-vector of a frame, such as its velocity, that are asked for.

/// Which of three linear and three angular rows are asked for, in this order, along world axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SelectedRows {
    wanted: [bool; 6],
}

impl SelectedRows {
    /// All.
    pub const ALL: SelectedRows = SelectedRows { wanted: [true; 6] };
    /// Those along the world's axes.
    pub const LINEAR: SelectedRows = SelectedRows { wanted: [true, true, true, false, false, false] };
    /// Those about the world's axes.
    pub const ANGULAR: SelectedRows = SelectedRows { wanted: [false, false, false, true, true, true] };
    /// Their words in scene files, in order.
    pub const WORDS: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

    /// These, by their places.
    pub fn of(places: impl IntoIterator<Item = usize>) -> SelectedRows {
        let mut rows = SelectedRows { wanted: [false; 6] };
        places.into_iter().for_each(|k| rows.wanted[k] = true);
        rows
    }

    /// Their places, in order.
    pub fn places(self) -> impl Iterator<Item = usize> {
        (0..6).filter(move |k| self.wanted[*k])
    }

    /// Their words, in order.
    pub fn words(self) -> Vec<&'static str> {
        self.places().map(|k| SelectedRows::WORDS[k]).collect()
    }
}
