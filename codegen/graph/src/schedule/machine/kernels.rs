//! What calls of the kernels of sines take.

/// Bytes of stack of a kernel.
pub const STACK_OF_KERNEL: usize = 8;

/// Kernels of sines: of one angle or two, of which one is a sum or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kernel {
    One,
    Sum,
    Two,
    TwoSums,
}

impl Kernel {
    pub const ALL: [Kernel; 4] = [Kernel::One, Kernel::Sum, Kernel::Two, Kernel::TwoSums];

    /// That of a call for so many angles.
    pub fn of(angles: usize, has_sum: bool) -> Kernel {
        match (angles, has_sum) {
            (1, false) => Kernel::One,
            (1, true) => Kernel::Sum,
            (_, false) => Kernel::Two,
            (_, true) => Kernel::TwoSums,
        }
    }

    /// Instructions of a call, multiply-accumulates among them, words that it loads and stores, and bytes with its constants.
    pub fn figures(self) -> [usize; 4] {
        match self {
            Kernel::One => [41, 10, 15, 196],
            Kernel::Sum => [42, 9, 15, 200],
            Kernel::Two => [74, 20, 15, 324],
            Kernel::TwoSums => [77, 20, 15, 336],
        }
    }
}
