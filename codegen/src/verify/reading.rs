//! The second author's reading of a robot file: links from their centres of mass, and what joints add to them.

use super::loops::closed_loops;
use super::oscillation;
use super::reference_input::centre_of_mass_tree;
use crate::description::flexible::{BaseSupport, Bending};
use crate::description::{self, Description, Noted};
use crate::diagnostic::{Diagnostics, Source};
use crate::equations::Robot;
use crate::function::truth::{Chapter, ClosedLoops, Effect};
use crate::function::{Function, Quantity};
use crate::model::ModelOptions;
use crate::options::Options;
use std::collections::BTreeMap;
use straightline_core::model::{Joint, Model};
use straightline_core::reference::CentreOfMassTree;
use straightline_core::Dd;

/// What says how a robot moves, and by what.
pub(super) fn motion() -> impl Iterator<Item = Quantity> {
    let others = [Quantity::SecondConfiguration, Quantity::TimeStep];
    [Quantity::Configuration].into_iter().chain(Quantity::of_velocities()).chain(others)
}

/// A robot, what its joints add to it, and its loops.
type RobotInReference = (CentreOfMassTree<Dd>, Vec<Effect>, Option<ClosedLoops>);

/// The robot in the reference's terms, its coordinates numbered as the model's, and what joints add to it.
pub(super) fn second_reading(
    source: &Source,
    model: &Model<Dd>,
    options: &Options,
) -> Result<RobotInReference, String> {
    let description = description::read(source, &mut Diagnostics::new()).ok_or("the file holds no robot")?;
    let mut tree = centre_of_mass_tree(&description, &options.model)?;
    let mut renumbered = BTreeMap::new();
    for link in &mut tree.links {
        let body = model.bodies.iter().find(|body| body.name == link.name);
        let joint = &body.ok_or_else(|| format!("the model has no body `{}`", link.name))?.joint;
        renumbered.extend(link.shared.is_none().then_some((link.iv, (joint.iq, joint.iv))));
        if let Some(shared) = &mut link.shared {
            shared.rank = joint.iv - model.open_nv();
        }
    }
    for link in &mut tree.links {
        (link.iq, link.iv) = *renumbered.get(&link.iv).ok_or_else(|| format!("`{}` follows nothing", link.name))?;
    }
    let elastic = elastic_springs(&description, &options.model);
    let swinging = oscillation::springs(&description, &options.model)?;
    let effect = |joint: &Joint| {
        let own = elastic.iter().find(|(name, _)| *name == joint.name);
        own.map_or_else(|| written(&description, &joint.name, &swinging), |own| own.1)
    };
    // of a joint with several rates the same on each; a spring, the one thing that asks for q, it has not
    let of_base = description.base_damping.as_ref().map_or(Dd::ZERO, |damping| Dd::from(damping.value));
    let effect = |joint: &Joint| match joint.kind.is_base() {
        true => Effect { damping: of_base, ..NONE },
        false => effect(joint),
    };
    let own = model.free_joints().flat_map(|joint| {
        let all = (0..joint.kind.nv()).map(|k| (joint.iq + k, joint.iv + k));
        all.map(|(iq, iv)| Effect { iq, iv, ..effect(joint) })
    });
    let following = model.bodies.iter().filter_map(|body| {
        let link = tree.links.iter().find(|link| link.name == body.name)?;
        let shared = link.shared?;
        let effect = effect(&body.joint).on_source([shared.ratio, shared.offset]);
        Some(Effect { iq: link.iq, iv: link.iv, ..effect })
    });
    let effects = own.chain(following).collect();
    let loops = closed_loops(&description, &options.model, &tree, model)?;
    Ok((tree, effects, loops))
}

/// A joint to which nothing is added.
const NONE: Effect = Effect {
    iq: 0,
    iv: 0,
    inertia: Dd::ZERO,
    damping: Dd::ZERO,
    friction: Dd::ZERO,
    smooth: None,
    stiffness: Dd::ZERO,
    rest: Dd::ZERO,
    range: [None; 2],
    effort: None,
    ratio: Dd::ONE,
};

/// What the file says of a joint, with the springs and dampers \[k, d\] of joints that are to swing.
fn written(description: &Description, joint: &str, swinging: &BTreeMap<String, [Dd; 2]>) -> Effect {
    let drive = description.joint(joint).map(|joint| joint.drive.clone()).unwrap_or_default();
    let [stiffness, damping] = swinging.get(joint).copied().unwrap_or_else(|| {
        [&drive.spring_stiffness, &drive.damping].map(|x| Dd::from(x.as_ref().map_or(0.0, |x| x.value)))
    });
    let number = |x: &Option<Noted<f64>>| Dd::from(x.as_ref().map_or(0.0, |x| x.value));
    let joint = description.joint(joint);
    let limits = joint.map(|joint| joint.limits.clone()).unwrap_or_default();
    let limit = |x: &Option<Noted<f64>>| x.as_ref().map(|x| x.value).filter(|x| x.is_finite()).map(Dd::from);
    let has_range = joint.is_some_and(|joint| joint.kind.value.has_range);
    let gear = Dd::from(drive.gear_ratio.as_ref().map_or(1.0, |x| x.value));
    Effect {
        inertia: number(&drive.armature) + gear * gear * number(&drive.rotor_inertia),
        damping,
        friction: number(&drive.friction),
        stiffness,
        rest: number(&drive.spring_rest),
        range: [&limits.lower, &limits.upper].map(|x| limit(x).filter(|_| has_range)),
        effort: limit(&limits.effort).map(|x| x.abs()).filter(|x| *x > Dd::ZERO),
        ..NONE
    }
}

/// The springs of the joints of flexible links and of a support, by name: EI n/L, GJ n/L.
fn elastic_springs(description: &Description, options: &ModelOptions) -> Vec<(String, Effect)> {
    let mut springs = Vec::new();
    if options.rigid_links {
        return springs;
    }
    for (k, elastic) in options.support.iter().flat_map(|support| support.directions.iter().enumerate()) {
        if let Some(e) = elastic {
            let [stiffness, damping, rest] = [e.stiffness.value, e.damping.value, e.rest].map(Dd::from);
            let name = format!("support_{}", BaseSupport::DIRECTIONS[k]);
            springs.push((name, Effect { stiffness, damping, rest, ..NONE }));
        }
    }
    for flexible in options.flexible.iter().chain(&description.flexible) {
        let (link, count) = (&flexible.link.value, flexible.segments.value);
        let squares = (0..3).fold(Dd::ZERO, |sum, k| {
            let d = Dd::from(flexible.to.value[k]) - Dd::from(flexible.from[k]);
            sum + d * d
        });
        let per_length = Dd::from(count as f64) / squares.sqrt();
        let mut about: Vec<(String, f64)> = Vec::new();
        match &flexible.bending {
            Bending::None => {}
            Bending::Round(x) => about.extend(["x", "y", "z"].map(|axis| (format!("bend_{axis}"), x.value))),
            Bending::About(given) => {
                let given = given.iter().zip(["x", "y", "z"]);
                about.extend(given.filter_map(|(x, axis)| Some((format!("bend_{axis}"), x.as_ref()?.value))));
            }
        }
        about.extend(flexible.torsion.as_ref().map(|x| ("twist".to_string(), x.value)));
        for (label, x) in about {
            let stiffness = Dd::from(x) * per_length;
            let spring = Effect { stiffness, damping: stiffness * Dd::from(flexible.damping.value), ..NONE };
            springs.extend((1..=count).map(|i| (format!("{link}_{label}{i}"), spring)));
        }
    }
    springs
}

/// The second author's reading of a robot file without a scene, to be asked for the results of any function at any state.
pub struct SecondReading {
    /// The compiler's own reading, for the directions that base parameters are.
    model: Model<Dd>,
    tree: CentreOfMassTree<Dd>,
    effects: Vec<Effect>,
    loops: Option<ClosedLoops>,
}

impl SecondReading {
    /// Reads the file again; of `model`, the compiler's own reading, it takes the places of the coordinates, and what base parameters are.
    ///
    /// # Errors
    /// The reference does not understand the file.
    pub fn new(source: &Source, model: &Model<Dd>, options: &Options) -> Result<SecondReading, String> {
        let (tree, effects, loops) = second_reading(source, model, options)?;
        let robot = Robot::new(model.clone()).knowing_base_parameters(&[Function::TorqueRegressor], &options.scene);
        Ok(SecondReading { model: robot.model, tree, effects, loops })
    }

    /// The results of a function and their natural scales at a state; rates, forces and directions that are not given are zero.
    ///
    /// # Errors
    /// The reference has no frame of that name, or no formulation of the function.
    pub fn outputs(
        &self,
        function: Function,
        frames: &[String],
        state: BTreeMap<Quantity, Vec<Dd>>,
    ) -> Result<(Vec<Dd>, Vec<f64>), String> {
        let chapter = Chapter::new(&self.tree, &self.effects, state).with_frames(frames)?;
        let chapter = chapter.with_base_parameters(&self.model).with_loops(self.loops.as_ref());
        let results = function.truth(&chapter).ok_or("the reference has no formulation of it")?;
        let scales = function.scales(&results);
        Ok((results.iter().map(|x| x.value).collect(), scales))
    }
}
