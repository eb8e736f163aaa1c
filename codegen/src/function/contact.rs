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
}
