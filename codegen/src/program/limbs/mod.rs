//! Identical limbs (legs of a quadruped, fingers of a hand) as lanes of one body.
//!
//! Limbs of one kind hang on the same body and have the same joints in the same order. They take the same operations on other
//! numbers, and what they add to the rest of the robot is one wrench on the body that carries them. So one limb is traced for all
//! of them (`template.rs`): where their numbers differ it has inputs, a number per limb, and where the wrench reaches the body stands
//! an input for the sum. Derivatives add the moments of points and of their velocities to the wrench; their entries between two limbs are zero. What comes out is optimised like any program. Then it is written out, once per limb
//! (`expand.rs`), into one program of plain operations, so that bounds of errors, counts and tests see what
//! is executed, with a note which of them are the same for all limbs ([`Alike`](straightline_graph::expr::Alike)): those become a loop over
//! limbs, which compilers turn into vector instructions.
//!
//! Rolled, the loop takes one limb a turn and holds the sines of its angles too; else the same operations, bit for bit.
//!
//! Mirrored limbs need nothing more: their numbers differ by signs, and a sign is part of a number.

mod constants;
mod expand;
mod template;

use crate::choices::LimbForm;
use crate::equations::bind::is_optional;
use crate::equations::Robot;
use crate::function::{Function, InLanes};
use crate::model::limbs::{limbs, Limbs};
use crate::options::{Optimisations, Options};
use crate::program::choose::choose;
use crate::program::passed;
use straightline_core::model::Model;
use straightline_graph::expr::{with_short_loops, Graph};
use straightline_graph::pass::{dead_code, sums, unread_inputs};

/// Limbs of one joint have too few operations to make up for what goes into lanes and comes out of them.
const JOINTS_PAY: usize = 2;

impl LimbForm {
    /// Which limbs of a robot are lanes in a function. [`LimbForm::Auto`]: where a body carries enough of at least two joints: three, of derivatives
    /// two; except for gravity forces, which have few operations and take as long either way
    /// (`generated_tests/record/2026-11-21-limbs.md`).
    pub fn of<T>(self, model: &Model<T>, function: Function) -> Vec<Limbs> {
        let in_lanes = function.spec().in_lanes;
        let mut found = if in_lanes == InLanes::Never { Vec::new() } else { limbs(model) };
        match (self, in_lanes) {
            (LimbForm::Lanes | LimbForm::Rolled, _) => {}
            (LimbForm::Auto, InLanes::WhereFaster(fewest)) => {
                found.retain(|l| l.bodies.len() >= fewest && l.bodies[0].len() >= JOINTS_PAY);
            }
            (LimbForm::Apart | LimbForm::Auto, _) => found.clear(),
        }
        found
    }
}

/// The program of a function with limbs as lanes; `None` where no limbs are to be.
pub(crate) fn program(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    optimisations: Optimisations,
) -> Option<Graph> {
    let limbs = options.limbs.of(&robot.model, function);
    // `lanes` was refused with it
    let mixed = options.scene.budgets.get(&function).is_some_and(|budget| budget.mixed_precision);
    if limbs.is_empty() || mixed || !optimisations.reduced {
        return None;
    }
    let apart = Optimisations { limbs: false, ..optimisations };
    let chosen = match optimisations.chosen {
        true => choose(robot, frames, function, options, Optimisations { chosen: false, ..apart }),
        false => robot.clone(),
    };
    let check = |pass, graph| passed(pass, function.name(), graph);
    let rules = || apart.rules(options.scalar);
    let mut template = template::template(&chosen, function, &options.scene, &limbs, rules());
    let wanted = options.scene.select(function, &chosen.model, 0).0;
    template.keep(&wanted);
    template.graph = check("limbs: dead code", dead_code(&check("limbs: traced", template.graph)));
    template = constants::folded(template, rules());
    if optimisations.sums {
        template.graph = check("limbs: dead code", dead_code(&check("limbs: sums", sums(&template.graph))));
        // a sum of products with one factor in common is a product with a sum, which may be one of constants
        template = constants::folded(template, rules());
    }
    template.drop_unread(&wanted);
    let folded = check("limbs: folded constants", template.graph.clone());
    let is_rolled = options.limbs == LimbForm::Rolled;
    let graph = expand::written_out(&folded, &template, &chosen.model, &options.scene, (function, is_rolled));
    let graph = unread_inputs(check("limbs: written out", with_short_loops(graph)), is_optional);
    Some(check("limbs: unread inputs", graph))
}
