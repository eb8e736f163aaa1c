//! A scene as the reference sees it: the whole robot of the file, held where the scene holds it.
//!
//! The compiler merges bodies and leaves coordinates out. Here nothing is merged or left out: locked joints are coordinates
//! with constant values and without rates, payloads are lumped into links by Steiner's theorem, and of the whole robot's
//! results those of the scene are picked.

use super::reading::motion;
use crate::equations::Robot;
use crate::function::truth::Effect;
use crate::function::{Extent, Function, Quantity, Spec};
use crate::model::states::{body, InputState};
use crate::options::Options;
use crate::program::parameter::parameter_program;
use crate::scene::free_drive::FreeDrive;
use crate::scene::{Base, CoulombForm, Gravity, Parameter, Scene};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;
use straightline_core::model::{Joint, Model};
use straightline_core::random::Random;
use straightline_core::reference::{CentreOfMassTree, ExtendedPosition};
use straightline_core::Dd;
use straightline_graph::certify::search::computed_at;
use straightline_graph::expr::Graph;
use straightline_graph::Scalar;

/// How the coordinates of a scene sit among those of the whole robot.
pub(super) struct Coordinates {
    /// For each configuration coordinate of the scene, that of the whole robot.
    q: Vec<usize>,
    /// The same of velocity coordinates.
    pub v: Vec<usize>,
    /// For each joint of the scene, in the order of its coordinates, the rank of that joint in the whole robot.
    joints: Vec<usize>,
    /// The whole robot's configuration where the scene holds it.
    held: Vec<f64>,
    /// Number of velocity coordinates of the whole robot.
    nv: usize,
    /// Number of its joints.
    all_joints: usize,
    /// How many there are of what does not depend on which joints move.
    others: [(Extent, usize); 7],
}

impl Coordinates {
    pub fn new(scene: &Scene, model: &Model<Dd>, whole: &Model<Dd>) -> Result<Coordinates, String> {
        let (all, mut held) = (whole.tree_joints(), vec![0.0; whole.nq()]);
        let (mut q, mut v, mut joints) = (Vec::new(), Vec::new(), Vec::new());
        for joint in model.tree_joints() {
            let rank = all.iter().position(|j| j.name == joint.name);
            let rank = rank.ok_or_else(|| format!("the whole robot has no joint `{}`", joint.name))?;
            joints.push(rank);
            if joint.iv >= model.open_nv() {
                continue; // it follows another one
            }
            q.extend(all[rank].iq..all[rank].iq + joint.kind.nq());
            if joint.iv >= model.nv() {
                continue; // loops determine it
            }
            v.extend(all[rank].iv..all[rank].iv + joint.kind.nv());
        }
        for joint in whole.joints() {
            let neutral = joint.kind.row().neutral;
            held[joint.iq..joint.iq + neutral.len()].copy_from_slice(neutral);
            if let Some((_, value)) = scene.locked.iter().find(|(name, _)| *name == joint.name) {
                held[joint.iq] = *value;
            }
        }
        let of_base = [
            Extent::BaseParameters,
            Extent::SupportParameters,
            Extent::RegressorEntries,
            Extent::LinkParameters,
            Extent::SceneParameters,
            Extent::Dependents,
            Extent::LoopEquations,
        ];
        let others = of_base.map(|extent| (extent, extent.len(model, 0)));
        Ok(Coordinates { q, v, joints, held, nv: whole.nv(), all_joints: all.len(), others })
    }

    /// Whether the robot of the scene moves as the whole one.
    pub fn are_all(&self) -> bool {
        self.v.len() == self.nv
    }

    /// The whole robot's state.
    pub fn expand(&self, state: &InputState<f64>) -> BTreeMap<Quantity, Vec<Dd>> {
        let mut whole = BTreeMap::new();
        for quantity in motion() {
            let (mut all, places) = match quantity.axes() {
                [Extent::Positions] => (self.held.clone(), &self.q),
                [Extent::Velocities] => (vec![0.0; self.nv], &self.v),
                _ => {
                    whole.insert(quantity, state[&quantity.name()].clone());
                    continue;
                }
            };
            places.iter().zip(&state[&quantity.name()]).for_each(|(at, x)| all[*at] = *x);
            whole.insert(quantity, all);
        }
        for quantity in [Quantity::DriveState, Quantity::DriveInput].into_iter().chain(Quantity::of_tasks()) {
            whole.extend(state.get(&quantity.name()).map(|x| (quantity, x.clone())));
        }
        whole.into_iter().map(|(quantity, x)| (quantity, x.into_iter().map(Dd::from).collect())).collect()
    }

    /// Of a function's results for the whole robot, those of the robot of the scene, as indices. Accelerations depend on which joints
    /// move: they are solved for these.
    pub fn results(&self, function: Function, frames: usize) -> Option<Vec<usize>> {
        let Spec { family, solves, outputs, .. } = function.spec();
        if family.is_of_drives() || *solves || !function.is_by_joints() {
            return None;
        }
        let (mut results, mut first) = (Vec::new(), 0);
        for output in *outputs {
            let (mut block, mut len) = (vec![0], 1);
            for extent in output.axes {
                let (wanted, all): (Vec<usize>, usize) = match extent {
                    Extent::Velocities => (self.v.clone(), self.nv),
                    Extent::Joints => (self.joints.clone(), self.all_joints),
                    Extent::Frames => ((0..frames).collect(), frames),
                    Extent::Of(n) => ((0..*n).collect(), *n),
                    Extent::Positions => (self.q.clone(), self.held.len()),
                    Extent::State => {
                        let rates = self.v.iter().map(|k| self.nv + k);
                        (self.v.iter().copied().chain(rates).collect(), 2 * self.nv)
                    }
                    other => {
                        let known = self.others.iter().find(|(extent, _)| extent == other);
                        let n = known.expect("no function has other results").1;
                        ((0..n).collect(), n)
                    }
                };
                block = block.iter().flat_map(|at| wanted.iter().map(move |k| at * all + k)).collect();
                len *= all;
            }
            results.extend(block.into_iter().map(|k| first + k));
            first += len;
        }
        Some(results)
    }
}

/// Makes the whole robot what the scene holds constant. `model` is the robot of the file, `tree` its reference.
pub(super) fn hold(
    scene: &Scene,
    model: &Model<Dd>,
    tree: &mut CentreOfMassTree<Dd>,
    effects: &mut Vec<Effect>,
) -> Result<(), String> {
    let is_locked = |name: &str| scene.locked.iter().any(|(joint, _)| joint == name);
    let stands = |mut body: Option<usize>| {
        while let Some(id) = body {
            let joint = &model.bodies[model.coupling_of(id).map_or(id, |coupling| coupling.source)].joint;
            let is_held = is_locked(&joint.name) || joint.kind.is_base() && scene.base == Base::Fixed;
            if !is_held {
                return false;
            }
            body = model.bodies[id].parent;
        }
        true
    };
    for parameter in &scene.parameters {
        if let Parameter::Link { link } = parameter {
            let link = tree.links.iter_mut().find(|l| l.name == *link);
            let link = link.ok_or_else(|| format!("the reference has no link `{}`", parameter.name()))?;
            (link.mass, link.inertia) = (Dd::ZERO, Matrix3::zeros());
        }
    }
    for payload in &scene.payloads {
        let [xx, xy, xz, yy, yz, zz] = payload.inertia;
        let inertia = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        weld(tree, &payload.frame, payload.mass, payload.com, inertia)?;
    }
    // what stands still does not count as moving: without mass
    for (id, body) in model.bodies.iter().enumerate().filter(|(id, _)| stands(Some(*id))) {
        let link = tree.links.iter_mut().find(|link| link.name == body.name);
        let link = link.ok_or_else(|| format!("the reference has no link `{}`", model.bodies[id].name))?;
        (link.mass, link.inertia) = (Dd::ZERO, Matrix3::zeros());
    }
    if let Gravity::Constant(gravity) = scene.gravity {
        tree.gravity = Vector3::from(gravity.map(Dd::from));
    }
    let has = |joint: &Joint, iv: usize| (joint.iv..joint.iv + joint.kind.nv()).contains(&iv);
    let moves = |iv: usize| model.bodies.iter().any(|b| has(&b.joint, iv) && !is_locked(&b.joint.name));
    effects.retain(|effect| moves(effect.iv));
    for effect in effects {
        let wanted = |x: Dd, is_wanted: bool| if is_wanted { x } else { Dd::ZERO };
        effect.inertia = wanted(effect.inertia, scene.effects.rotor_inertia);
        effect.damping = wanted(effect.damping, scene.effects.damping);
        effect.friction = wanted(effect.friction, scene.effects.coulomb != CoulombForm::Off);
        effect.stiffness = wanted(effect.stiffness, scene.effects.springs);
        effect.smooth = match scene.effects.coulomb {
            CoulombForm::Smooth(speed) => Some(Dd::from(speed) / effect.ratio),
            CoulombForm::Off | CoulombForm::Sign => None,
        };
    }
    Ok(())
}

/// Adds a body, given in a frame, to the link that carries the frame. Steiner's theorem about the common centre of mass; the
/// vectors that start or end in the centre of mass follow it, and what they said of the zero of joints stays said.
fn weld(
    tree: &mut CentreOfMassTree<Dd>,
    frame: &str,
    mass: f64,
    com: [f64; 3],
    inertia: Matrix3<f64>,
) -> Result<(), String> {
    let frame = tree.frame(frame).ok_or_else(|| format!("the reference has no frame `{frame}`"))?.clone();
    let Some(carrier) = frame.link else { return Ok(()) };
    let (mass, com) = (Dd::from(mass), frame.position + frame.rotation * Vector3::from(com.map(Dd::from)));
    let inertia = frame.rotation * inertia.map(Dd::from) * frame.rotation.transpose();
    let link = &mut tree.links[carrier];
    let total = link.mass + mass;
    if total == Dd::ZERO {
        return Ok(());
    }
    let shift = com.map(|x| x * mass / total);
    let steiner = |mass: Dd, d: Vector3<Dd>| (Matrix3::identity() * d.dot(&d) - d * d.transpose()) * mass;
    link.inertia = link.inertia + steiner(link.mass, shift) + inertia + steiner(mass, com - shift);
    link.mass = total;
    if let ExtendedPosition::ByVectors { r_star, .. } = &mut link.extended {
        r_star.get_or_insert(link.r);
    }
    link.r += shift;
    for child in tree.links.iter_mut().filter(|link| link.parent == Some(carrier)) {
        if let ExtendedPosition::ByVectors { r_parent_star, .. } = &mut child.extended {
            r_parent_star.get_or_insert(child.r_parent);
        }
        child.r_parent += shift;
    }
    tree.frames.iter_mut().filter(|f| f.link == Some(carrier)).for_each(|f| f.position -= shift);
    Ok(())
}

/// Programs that make a scene's parameters from the numbers of a body.
pub(super) fn parameter_programs(robot: &Robot, options: &Options) -> Vec<(Parameter, Graph)> {
    let parameters = options.scene.parameters.iter();
    parameters.map(|p| (p.clone(), parameter_program(robot, p, options))).collect()
}

/// What the scene has as inputs besides coordinates, into the tree as it is meant; random bodies of parameters also into the state, as the
/// program takes them.
pub(super) fn random_inputs(
    scene: &Scene,
    parameters: &[(Parameter, Graph)],
    scalar: Scalar,
    (state, tree): (&mut InputState<f64>, &mut CentreOfMassTree<Dd>),
    random: &mut Random,
) -> Result<(), String> {
    let rounded = |x: f64| scalar.rounded(x);
    if scene.gravity == Gravity::Input {
        tree.gravity = Vector3::from_iterator(state[&Quantity::Gravity.name()].iter().copied().map(Dd::from));
    }
    for (parameter, program) in parameters {
        let Some(frame) = parameter.frame() else { continue };
        let inputs: Vec<f64> = body(random).concat().into_iter().map(rounded).collect();
        let [mass, x, y, z, xx, xy, xz, yy, yz, zz] = inputs[..] else { unreachable!("a body has ten numbers") };
        let (com, j) = ([x, y, z], Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz));
        state.insert(parameter.input_name(), computed_at(program, scalar, &inputs));
        weld(tree, frame, mass, com, j)?;
    }
    Ok(())
}

/// Random values of the free numbers of drives: into the state as the program takes them, into the model as they are meant.
pub(super) fn random_drives(
    parameters: &[(Parameter, Graph)],
    scalar: Scalar,
    (state, model): (&mut InputState<f64>, &mut Model<Dd>),
    random: &mut Random,
) {
    let of_file = model.clone();
    for (parameter, program) in parameters {
        let Some(drive) = FreeDrive::new(parameter, &of_file) else { continue };
        let rounded = |x: f64| scalar.rounded(x);
        let numbers: Vec<f64> = drive.random(|| 0.5 + random.symmetric(0.5)).into_iter().map(rounded).collect();
        state.insert(parameter.input_name(), computed_at(program, scalar, &numbers));
        let derived = drive.derived(&numbers.iter().map(|x| Dd::from(*x)).collect::<Vec<_>>());
        model.drives.iter_mut().filter(|d| d.name == derived.name).for_each(|d| *d = derived.clone());
    }
}
