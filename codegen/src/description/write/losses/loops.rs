//! What formats cannot say of closed loops.

use super::{Dynamics, Form, Loss};
use crate::description::Description;
use crate::diagnostic::Place;

/// Loops, which another program may hold only about.
pub static SOFT_LOOPS: Loss = Loss {
    what: "closed loops",
    weight: Form,
    then: "`equality/connect` is written, exact here and a soft constraint in MuJoCo itself, and motors at the independent joints",
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

/// Loops.
pub static LOOPS: Loss = Loss {
    what: "closed loops",
    weight: Dynamics,
    then: "the robot is the tree that is left where they are cut",
    find: loops,
    remove: |robot| robot.loops.clear(),
};

fn loops(robot: &Description) -> Vec<(String, Place)> {
    robot.loops.iter().map(|own| (format!("loop `{}`", own.name.value), own.name.place.clone())).collect()
}
