//! The functions of a robot in contact.

/// A function of a contact mode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ContactFunction {
    /// s^c, its rate, its Jacobian and its adjoint vector.
    ConstrainedCoordinates,
    /// The same of s^f.
    FreeCoordinates,
    /// Accelerations and reactions of a tau.
    ForwardDynamics,
    /// The same under the inputs of the drives, of a robot that has drives.
    DrivenForwardDynamics,
    /// tau of a motion along s^f and of reactions.
    InverseDynamics,
    /// Changes of velocity and impulses when the contacts of the mode close.
    Impact,
    /// The correction that takes s^c away.
    Projection,
}

impl ContactFunction {
    /// All of them, with their names in generated code.
    pub const WORDS: [(&'static str, ContactFunction); 7] = [
        ("constrained_coordinates", ContactFunction::ConstrainedCoordinates),
        ("free_coordinates", ContactFunction::FreeCoordinates),
        ("forward_dynamics", ContactFunction::ForwardDynamics),
        ("driven_forward_dynamics", ContactFunction::DrivenForwardDynamics),
        ("inverse_dynamics", ContactFunction::InverseDynamics),
        ("impact", ContactFunction::Impact),
        ("projection", ContactFunction::Projection),
    ];

    /// Its name in generated code.
    pub fn name(self) -> &'static str {
        Self::WORDS.iter().find(|w| w.1 == self).expect("every function has a name").0
    }

    /// What it computes.
    pub fn summary(self) -> &'static str {
        match self {
            ContactFunction::ConstrainedCoordinates => "The constrained coordinates s^c, with s̈ = J q̈ + A, (20.86).",
            ContactFunction::FreeCoordinates => "The free coordinates s^f, with s̈ = J q̈ + A, (20.85).",
            ContactFunction::ForwardDynamics => {
                "Motion and reactions in contact: H q̈ + h = τ + Jᵀ F, s̈^c = J q̈ + A, (20.88)-(20.89)."
            }
            ContactFunction::DrivenForwardDynamics => {
                "Motion and reactions in contact under the inputs of the drives: H* q̈ + h* = D u + Jᵀ F, s̈^c = J q̈ + A, (20.72) with \
                 (20.88)-(20.89)."
            }
            ContactFunction::InverseDynamics => {
                "Generalized forces of a wanted motion along s^f and of wanted reactions: hybrid feed-forward. Of the motions that do it, the \
                 one nearest to `qdd` in kinetic energy is taken."
            }
            ContactFunction::Impact => "Impact when the contacts of the mode close, (20.90)-(20.91), (20.95)-(20.97).",
            ContactFunction::Projection => {
                "The correction of q, by velocity coordinate, that takes s^c away to first order and moves the least mass. Apply \
                 it, and then `impact` with restitution 0 to the velocities, against drift."
            }
        }
    }
}
