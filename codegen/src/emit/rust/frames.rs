//! Frames as constants of a type with dynamics, `Panda::PANDA_HAND`, and the pose of one. They are of types of the package
//! `straightline`, so they stand beside the generated code, which depends on `core` alone.

use crate::emit::Generated;
use crate::function::Function;
use crate::identifier::{doc, snake_case};
use crate::scene::Scene;
use std::collections::BTreeSet;
use std::fmt::Write;

/// A constant per frame, and `pose` where poses of all frames are computed; `taken` are the names of other constants.
pub(super) fn associated(generated: &Generated, scene: &Scene, mut taken: BTreeSet<String>) -> String {
    let mut out = String::new();
    for (index, frame) in generated.frames.iter().enumerate() {
        let mut name = constant(frame);
        while !taken.insert(name.clone()) {
            name.push_str("_FRAME");
        }
        let _ = writeln!(
            out,
            "/// The frame `{}`.\npub const {name}: ::straightline::FrameIndex<Self> = \
             ::straightline::FrameIndex::new({index});",
            doc(frame)
        );
    }
    let has_poses = generated.items.iter().any(|item| {
        let all = scene.frames_of(item.function, &generated.frames) == generated.frames;
        item.function == Function::ForwardKinematics && all && item.outputs()[0].shape == [generated.frames.len(), 12]
    });
    if has_poses {
        let _ = writeln!(
            out,
            "/// The pose of a frame, of the poses that [`Self::forward_kinematics`] gave.\n#[inline]\n\
             pub fn pose<__T: Copy>(x: &[[__T; 12]; {}], frame: ::straightline::FrameIndex<Self>) \
             -> ::straightline::Pose<__T> {{\n    ::straightline::Pose::from(x[frame])\n}}",
            generated.frames.len()
        );
    }
    out
}

/// The name of a frame's constant.
pub(super) fn constant(frame: &str) -> String {
    snake_case(frame).to_uppercase()
}
