//! The robot as a whole, by the second author.

use super::super::whole::{CentreOfMass, Energy, Momentum};
use super::{list, Chapter, ClosedMotion, Truth};
use straightline_core::magnitude::Magnitude;
use straightline_core::reference;
use straightline_core::{Dd, Real};

impl Truth for Energy {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let mut kinetic = reference::kinetic_energy(&at.tree, at.q(), at.qd());
        let mut potential = reference::potential_energy(&at.tree, at.q());
        let half = Magnitude::constant(Dd::HALF);
        for effect in at.effects {
            let [inertia, stiffness, rest] = [effect.inertia, effect.stiffness, effect.rest].map(Magnitude::new);
            let (rate, stretch) = (at.qd()[effect.iv], at.q()[effect.iq] - rest);
            kinetic += inertia * rate * rate * half;
            potential += stiffness * stretch * stretch * half;
        }
        Some(vec![kinetic, potential])
    }

    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        Self::truth(&at.tree)
    }
}

impl Truth for CentreOfMass {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        Some(list(&reference::centre_of_mass(&at.tree, at.q())))
    }

    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        Self::truth(&at.tree)
    }
}

impl Truth for Momentum {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let momentum = reference::momentum(&at.tree, at.q(), at.qd());
        Some([list(&momentum.linear), list(&momentum.angular_about_centre_of_mass)].concat())
    }

    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        Self::truth(&at.tree)
    }
}
