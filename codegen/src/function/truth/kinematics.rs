//! Frames, by the second author.

use super::super::kinematics::{
    ForwardKinematics, FrameAcceleration, FrameVelocity, Jacobian, JacobianBias, KinematicsAndJacobian,
};
use super::{list, Chapter, Truth};
use straightline_core::magnitude::Magnitude;
use straightline_core::reference;

impl Truth for ForwardKinematics {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        at.per_frame(|frame| {
            let pose = reference::frame_pose(&at.tree, frame, at.q());
            [list(&pose.position), list(&pose.rotation.transpose())].concat()
        })
    }
}

impl Truth for FrameVelocity {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        at.per_frame(|frame| list(&reference::frame_velocity(&at.tree, frame, at.q(), at.qd())))
    }
}

impl Truth for FrameAcceleration {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        at.per_frame(|frame| list(&reference::frame_acceleration(&at.tree, frame, at.q(), at.qd(), at.qdd())))
    }
}

impl Truth for JacobianBias {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        at.per_frame(|frame| list(&reference::frame_jacobian_bias(&at.tree, frame, at.q(), at.qd())))
    }
}

impl Truth for Jacobian {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        at.per_frame(|frame| list(&reference::frame_jacobian(&at.tree, frame, at.q()).transpose()))
    }
}

impl Truth for KinematicsAndJacobian {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        Some([ForwardKinematics::truth(at)?, Jacobian::truth(at)?].concat())
    }
}
