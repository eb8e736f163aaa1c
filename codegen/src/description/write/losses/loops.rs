//! What formats cannot say of closed loops.

use super::{Dynamics, Form, Loss};
use crate::description::{ClosingJoint, Description, LoopPoints, WrittenJoint, WrittenLoop};
use crate::diagnostic::Place;

/// Loops, which another program may hold only about.
pub static SOFT_LOOPS: Loss = Loss {
    what: "closed loops",
    weight: Form,
    then: "`equality/connect` or `equality/weld` is written, exact here and a soft constraint in MuJoCo itself, and motors at the independent joints",
    find: loops,
    remove: |_| (),
};

/// Assemblies of loops by name.
pub static ASSEMBLIES: Loss = Loss {
    what: "assemblies of closed loops by name",
    weight: Dynamics,
    then: "each loop closes in the assembly in which its joints stand",
    find: |robot| {
        let named = robot.loops.iter().filter_map(|own| Some((own, own.assembly.as_ref()?)));
        named.map(|(own, assembly)| (format!("loop `{}`", own.name.value), assembly.place.clone())).collect()
    },
    remove: |robot| robot.loops.iter_mut().for_each(|own| own.assembly = None),
};

/// Hinges that close loops in space.
pub static HINGED_LOOPS: Loss = Loss {
    what: "closed loops whose last joint is a hinge that does not lie across their plane",
    weight: Dynamics,
    then: "these loops are open",
    find: |robot| loops_that(robot, is_hinged),
    remove: |robot| robot.loops.retain(|own| !is_hinged(own)),
};

/// Loops that welds close.
pub static WELDED_LOOPS: Loss = Loss {
    what: "closed loops whose last joint is a weld",
    weight: Dynamics,
    then: "these loops are open",
    find: |robot| loops_that(robot, is_welded),
    remove: |robot| robot.loops.retain(|own| !is_welded(own)),
};

/// Loops that are open where all coordinates are zero.
pub static LOOPS_OPEN_AT_ZERO: Loss = Loss {
    what: "closed loops whose joints are not at zero where they close",
    weight: Dynamics,
    then: "these loops are open",
    find: |robot| loops_that(robot, is_open_at_zero),
    remove: |robot| robot.loops.retain(|own| !is_open_at_zero(own)),
};

/// Which joints loops determine.
pub static DETERMINED_JOINTS: Loss = Loss {
    what: "which joints closed loops determine",
    weight: Dynamics,
    then: "other joints of theirs are the independent ones",
    find: |robot| loops_that(robot, |own| !own.determines.is_empty()),
    remove: |robot| robot.loops.iter_mut().for_each(|own| own.determines.clear()),
};

/// Hinges that close loops of robots with ball joints, which SDF has as what closes loops.
pub static HINGED_LOOPS_BESIDE_BALLS: Loss = Loss {
    what: "closed loops whose last joint is a hinge, of robots with ball joints",
    weight: Dynamics,
    then: "these loops are open",
    find: |robot| if has_balls(robot) { loops_that(robot, is_hinged) } else { Vec::new() },
    remove: |robot| robot.loops.retain(|own| !is_hinged(own)),
};

/// Loops as joints.
pub static LOOPS_AS_JOINTS: Loss = Loss {
    what: "closed loops",
    weight: Form,
    then: "a joint whose child is also that of another joint is written for each, and it is the last one that closes",
    find: loops,
    remove: |_| (),
};

fn is_hinged(own: &WrittenLoop) -> bool {
    matches!(own.joint, ClosingJoint::Revolute(_))
}

fn is_welded(own: &WrittenLoop) -> bool {
    own.joint == ClosingJoint::Fixed
}

fn is_open_at_zero(own: &WrittenLoop) -> bool {
    matches!(own.points, LoopPoints::Frames(_))
}

fn has_balls(robot: &Description) -> bool {
    let is_ball = |joint: &WrittenJoint| joint.kind.value.between_links().is_some_and(|kind| !kind.is_single());
    robot.joints.iter().any(is_ball)
}

/// Loops.
pub static LOOPS: Loss = Loss {
    what: "closed loops",
    weight: Dynamics,
    then: "the robot is the tree that is left where they are cut",
    find: loops,
    remove: |robot| robot.loops.clear(),
};

fn loops(robot: &Description) -> Vec<(String, Place)> {
    loops_that(robot, |_| true)
}

fn loops_that(robot: &Description, is_meant: impl Fn(&WrittenLoop) -> bool) -> Vec<(String, Place)> {
    let meant = robot.loops.iter().filter(|own| is_meant(own));
    meant.map(|own| (format!("loop `{}`", own.name.value), own.name.place.clone())).collect()
}
