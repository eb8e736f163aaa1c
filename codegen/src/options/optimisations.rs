//! What the compiler does beyond writing the equations down.

use straightline_graph::expr::{Folding, RuleSet};
use straightline_graph::Scalar;

/// What [`program`](crate::program) does beyond writing the equations down, one by one, so that each can be weighed. Without any of them a
/// program is the generic runtime unrolled: equal subexpressions once, no products with zero and one, nothing that no
/// result needs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Optimisations {
    /// Constants are folded in double-double, so that what is zero or one is exactly that.
    pub folding: bool,
    /// Rules that are equal over the reals only.
    pub algebraic: bool,
    /// The reduced robot where it serves: frames along common normals, inertial parameters regrouped.
    pub reduced: bool,
    /// Sums with all their terms at once: [`sums`](straightline_graph::pass::sums()).
    pub sums: bool,
    /// Of the forms that the reduced robot has, those with the fewest operations: [`choose`](crate::program::choose::choose()).
    pub chosen: bool,
    /// What is free in those forms.
    pub forms: FormChoices,
    /// Among those forms ones with sums of angles, whose rounding errors go into the reduction of the angle.
    pub angle_sums: bool,
    /// The cheaper of the two forms of forward dynamics.
    pub cheaper: bool,
    /// Identical limbs as lanes of one body, where the options have them so: [`limbs`](crate::program::limbs).
    pub limbs: bool,
    /// Columns that are solved for alike as lanes of one loop, where the options have them so.
    pub columns: bool,
    /// Values of the mass matrix, and of forward dynamics, formed of others that are there anyway: [`substitute`](straightline_graph::pass::substitute()).
    pub substitutes: bool,
}

/// What [`choose`](crate::program::choose::choose()) may choose, one by one, so that each can be weighed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FormChoices {
    /// Tips and chains of parallel joints are described in axes that do not turn.
    pub stays: bool,
    /// Origins are at either foot of the common normals.
    pub origins: bool,
    /// Tips are turned so that a parameter vanishes.
    pub tips: bool,
    /// Inertial parameters vanish here or at the parent, or are not moved.
    pub parameters: bool,
    /// The equations of a body's rotation have several forms.
    pub rotations: bool,
    /// The unit of length is one that makes a number one.
    pub unit: bool,
}

impl FormChoices {
    /// All of them.
    pub const ALL: FormChoices =
        FormChoices { stays: true, origins: true, tips: true, parameters: true, rotations: true, unit: true };
}

impl Optimisations {
    /// From none of them to these, one more at each step, with its words.
    pub fn steps(self) -> Vec<(&'static str, Optimisations)> {
        let mut now = Optimisations::default();
        let mut steps = Vec::new();
        let mut step = |what, on: bool, switch: fn(&mut Optimisations)| {
            if on {
                switch(&mut now);
                steps.push((what, now));
            }
        };
        step(FOLDING, self.folding, |o| o.folding = true);
        step("algebraic rules", self.algebraic, |o| o.algebraic = true);
        step("reduced robot: frames and inertial parameters", self.reduced, |o| o.reduced = true);
        step("sums with all their terms at once", self.sums, |o| o.sums = true);
        step("forms of the reduced robot chosen by counting", self.chosen, |o| {
            (o.chosen, o.forms) = (true, FormChoices::ALL)
        });
        step("angles of parallel joints added", self.chosen && self.angle_sums, |o| o.angle_sums = true);
        step("the cheaper form of forward dynamics", self.cheaper, |o| o.cheaper = true);
        step("identical limbs as lanes of one body", self.limbs, |o| o.limbs = true);
        step("columns that are solved for as lanes", self.columns, |o| o.columns = true);
        step("values formed of others that are there", self.substitutes, |o| o.substitutes = true);
        steps
    }

    /// Without any of them but exact folding: the equations as they are.
    pub(crate) fn plain(self) -> Optimisations {
        Optimisations { folding: self.folding, ..Optimisations::default() }
    }

    pub(crate) fn rules(self, scalar: Scalar) -> RuleSet {
        match (self.algebraic, self.folding, scalar) {
            (true, _, _) => RuleSet::all(),
            (false, true, _) => RuleSet::exact(Folding::DoubleDouble),
            (false, false, scalar) => RuleSet::exact(Folding::In(scalar)),
        }
    }
}

/// What even equations as they are have, unless rules are exact.
pub(crate) const FOLDING: &str = "constants folded in double-double";
