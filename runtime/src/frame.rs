//! Which frame of which robot.

use core::fmt;
use core::marker::PhantomData;
use core::ops::{Index, IndexMut};

/// A frame of the robot `R`: the derive gives every frame a constant of this type, as `Panda::PANDA_HAND` for the link
/// `panda_hand`. It indexes the results of functions that answer per frame, and those of no other robot's `pose`:
/// ```
/// use straightline::Dynamics;
///
/// #[derive(Dynamics)]
/// #[robot("examples/arm.toml", functions(jacobian), frames("upper_arm", "forearm"))]
/// struct Arm;
///
/// let mut jacobians = [[[0.0; Arm::NV]; 6]; Arm::FRAME_NAMES.len()];
/// Arm::jacobian(&[0.1, 0.2, 0.3], &mut jacobians);
/// let of_the_forearm = jacobians[Arm::FOREARM];
/// assert_eq!(of_the_forearm[5][0], 1.0); // the yaw joint turns it about the world's z
/// assert_eq!(Arm::FRAME_NAMES[Arm::FOREARM], "forearm");
/// ```
/// Where a scene gives one function frames of its own, that function's results are in their order.
pub struct FrameIndex<R: ?Sized> {
    index: usize,
    robot: PhantomData<fn(&R)>,
}

impl<R: ?Sized> FrameIndex<R> {
    /// The frame at that place among the robot's `FRAME_NAMES`.
    pub const fn new(index: usize) -> Self {
        FrameIndex { index, robot: PhantomData }
    }

    /// Its place among the robot's `FRAME_NAMES`.
    pub const fn get(self) -> usize {
        self.index
    }
}

// by hand, as derived ones would ask the same of `R`
impl<R: ?Sized> Clone for FrameIndex<R> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<R: ?Sized> Copy for FrameIndex<R> {}

impl<R: ?Sized> PartialEq for FrameIndex<R> {
    fn eq(&self, other: &Self) -> bool {
        self.index == other.index
    }
}

impl<R: ?Sized> Eq for FrameIndex<R> {}

impl<R: ?Sized> fmt::Debug for FrameIndex<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("FrameIndex").field(&self.index).finish()
    }
}

impl<T, R: ?Sized> Index<FrameIndex<R>> for [T] {
    type Output = T;

    fn index(&self, frame: FrameIndex<R>) -> &T {
        &self[frame.index]
    }
}

impl<T, R: ?Sized> IndexMut<FrameIndex<R>> for [T] {
    fn index_mut(&mut self, frame: FrameIndex<R>) -> &mut T {
        &mut self[frame.index]
    }
}
