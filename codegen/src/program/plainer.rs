//! The form of a program with the fewest operations that agrees with the plain equations.

use crate::options::optimisations::FOLDING;
use crate::options::{FormChoices, Optimisations};
use crate::program::equivalence::{Disagreement, Plainer};

impl Optimisations {
    /// Plainer and plainer, each with what was left out last.
    fn plainer(self) -> Vec<(&'static str, Optimisations)> {
        let mut now = self;
        let mut found = vec![("", now)];
        let mut step = |what, off: fn(&mut Optimisations)| {
            let before = now;
            off(&mut now);
            if now != before {
                found.push((what, now));
            }
        };
        step("identical limbs as lanes of one body", |o| o.limbs = false);
        step("columns that are solved for as lanes", |o| o.columns = false);
        step("values formed of others that are there", |o| o.substitutes = false);
        step("sums with all their terms at once", |o| o.sums = false);
        step("forms of the reduced robot", |o| {
            (o.chosen, o.forms, o.angle_sums) = (false, FormChoices::default(), false)
        });
        step("the reduced robot", |o| o.reduced = false);
        step("algebraic rules and the cheaper form of forward dynamics", |o| *o = o.plain());
        step(FOLDING, |o| o.folding = false);
        found
    }

    /// What `make` makes by the first of these that it is content with; all of them, then plainer ones.
    ///
    /// # Errors
    /// What was wrong at first, if it is content with none; or what the plainest loses to rounding.
    pub(crate) fn first_that_agrees<T>(
        self,
        mut make: impl FnMut(Optimisations) -> Result<T, Disagreement>,
    ) -> Result<(T, Option<Plainer>), Disagreement> {
        let (mut first, mut last) = (None, None);
        for (without, optimisations) in self.plainer() {
            // what is left is the generic runtime, which has no more digits
            if without == FOLDING && last.as_ref().is_some_and(Disagreement::is_of_the_robot) {
                break;
            }
            match make(optimisations) {
                Ok(made) => return Ok((made, first.map(|disagreement| Plainer { disagreement, without }))),
                Err(disagreement) => {
                    first.get_or_insert_with(|| disagreement.clone());
                    last = Some(disagreement);
                }
            }
        }
        // the plainest form against the plain equations in the same scalar: that says most of the robot
        let of_digits = last.filter(|disagreement| disagreement.plain.is_some());
        Err(of_digits.or(first).expect("all of them were tried"))
    }
}
