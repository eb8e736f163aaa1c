//! Where the entries of a plant's state stand, found once: the equations of motion are asked thousands of times per second simulated.

use straightline_core::algorithms::drive_states;
use straightline_core::model::{Coulomb, Model};

/// Of the state \[q | q̇ | x | energies\] how long its parts are, and what of them is simple.
#[derive(Clone, Debug)]
pub(crate) struct StateLayout {
    /// Entries of q.
    pub nq: usize,
    /// Entries of q̇.
    pub nv: usize,
    /// Entries of x, the states of the drives.
    pub drives: usize,
    /// Whether every q is as good as it stands: it has no quaternions, and no loop is to be closed.
    pub is_plain: bool,
    /// Whether friction in the joints turns energy into heat.
    pub loses: bool,
}

impl StateLayout {
    pub fn new(model: &Model<f64>) -> StateLayout {
        let has_quaternions = model.free_joints().any(|joint| joint.kind.row().quaternion.is_some());
        let loses = |coulomb: &Coulomb<f64>| match coulomb {
            Coulomb::Off => false,
            Coulomb::Sign(force) | Coulomb::Smooth { force, .. } => *force != 0.0,
        };
        StateLayout {
            nq: model.nq(),
            nv: model.nv(),
            drives: drive_states(model),
            is_plain: !has_quaternions && model.closure.is_empty(),
            loses: model.bodies.iter().any(|b| b.effects.damping != 0.0 || loses(&b.effects.coulomb)),
        }
    }
}
