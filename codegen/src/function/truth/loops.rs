//! What closed loops determine, by the second author.

use super::super::loops::{CloseLoops, LoopJacobian, LoopMotion};
use super::{Chapter, ClosedMotion, Truth};
use straightline_core::magnitude::Magnitude;
use straightline_core::Dd;

impl Truth for CloseLoops {
    fn truth(_: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        None
    }

    /// A closed configuration stays as it is.
    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        let closed = Magnitude::new(Dd::ZERO).of_size(at.reach());
        // a coordinate near zero is known as well as points of the robot are
        let known = at.reach().min(1.0);
        let stays = at.tree.q().iter().map(|q| q.of_size(q.size.hypot(known)));
        Some(stays.chain((0..at.equations).map(|_| closed)).collect())
    }
}

impl Truth for LoopJacobian {
    fn truth(_: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        None
    }

    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        Some(at.dependent_rows())
    }
}

impl Truth for LoopMotion {
    fn truth(_: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        None
    }

    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        Some([at.tree.qd(), at.tree.qdd()].map(|rates| &rates[at.independent()..]).concat())
    }
}
