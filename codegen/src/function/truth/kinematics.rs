//! Frames, by the second author.

use super::super::kinematics::{
    ForwardKinematics, FrameAcceleration, FrameVelocity, Jacobian, JacobianBias, KinematicsAndJacobian,
};
use super::{list, Chapter, ClosedMotion, Truth};
use straightline_core::magnitude::Magnitude;
use straightline_core::reference;

impl Truth for ForwardKinematics {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        at.per_frame(|frame| {
            let pose = reference::frame_pose(&at.tree, frame, at.q());
            [list(&pose.position), list(&pose.rotation.transpose())].concat()
        })
    }

    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        Self::truth(&at.tree)
    }
}

impl Truth for FrameVelocity {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        at.per_frame(|frame| list(&reference::frame_velocity(&at.tree, frame, at.q(), at.qd())))
    }

    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        Self::truth(&at.tree)
    }
}

impl Truth for FrameAcceleration {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        at.per_frame(|frame| list(&reference::frame_acceleration(&at.tree, frame, at.q(), at.qd(), at.qdd())))
    }

    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        Self::truth(&at.tree)
    }
}

impl Truth for JacobianBias {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        at.per_frame(|frame| list(&reference::frame_jacobian_bias(&at.tree, frame, at.q(), at.qd())))
    }

    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        FrameAcceleration::truth(&at.unaccelerated)
    }
}

impl Truth for Jacobian {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        at.per_frame(|frame| list(&reference::frame_jacobian(&at.tree, frame, at.q()).transpose()))
    }

    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        at.columns(Self::truth(&at.tree))
    }
}

impl Truth for KinematicsAndJacobian {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        Some([ForwardKinematics::truth(at)?, Jacobian::truth(at)?].concat())
    }

    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        Some([ForwardKinematics::truth(&at.tree)?, Jacobian::truth_on_loops(at)?].concat())
    }
}
