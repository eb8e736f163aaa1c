//! A scene where it edits the robot: joints locked, payloads welded on, gravity and effects as they are wanted.
//!
//! Everything is in double-double, and zeros and ones of rotations stay exact, so that a robot with a locked joint has the
//! same simple form as if its file had a fixed joint there.

use super::{check, Base, CoulombForm, Effects, Gravity, Parameter, Scene};
use crate::description::{Angle, AngleUnit};
use crate::diagnostic::{Diagnostics, Place};
use crate::model::geometry::{about, compose, point, turned, vector};
use crate::model::merge::{merge, Part};
use crate::model::{angle, drives};
use straightline_core::algorithms::composing_pays;
use straightline_core::base_parameters::JointParameter;
use straightline_core::closure::LoopEnd;
use straightline_core::coupling::Coupling;
use straightline_core::drive::{Drive, Rotor};
use straightline_core::model::{self, Body, BodyId, Frame, JointEffects, Model};
use straightline_core::spatial::{SpatialInertia, Sym3, Transform, Vec3};
use straightline_core::Dd;

/// The robot of a scene, from the robot of the file as [`Scene::model_options`] reads it. All names of the scene are
/// checked against it. Complaints go to `diagnostics`; `None` after errors.
///
/// What stays symbolic (parameters, gravity as an input) and what is selected or known to be zero is left to tracing.
pub fn apply(model: Model<Dd>, scene: &Scene, diagnostics: &mut Diagnostics) -> Option<Model<Dd>> {
    match scene.places.source() {
        // a scene from a file was checked by itself when it was read
        Some(source) => diagnostics.add_source(source),
        None => check::alone(scene, diagnostics),
    }
    let held: Vec<Option<Held>> = (0..model.bodies.len()).map(|body| held(&model, body, scene)).collect();
    check::against(&model, scene, &held.iter().map(Option::is_some).collect::<Vec<_>>(), diagnostics);
    if diagnostics.has_errors() {
        return None;
    }
    let mut model = without_parameters(model, scene);
    drives::add(&scene.drives, &mut model, diagnostics);
    check::drives(&model, scene, &held.iter().map(Option::is_some).collect::<Vec<_>>(), diagnostics);
    if diagnostics.has_errors() {
        return None;
    }
    let mut model = lock(model, &held);
    weld(&mut model, scene);
    if let Gravity::Constant(gravity) = scene.gravity {
        model.gravity = vector(gravity);
    }
    for body in &mut model.bodies {
        body.effects = wanted_effects(&body.effects, &scene.effects);
        // friction that is to be found has its form, too
        let finds_friction = scene.regressor.contains(&JointParameter::Coulomb);
        if let (true, model::Coulomb::Off, CoulombForm::Smooth(speed)) =
            (finds_friction, body.effects.coulomb, scene.effects.coulomb)
        {
            body.effects.coulomb = model::Coulomb::Smooth { force: Dd::ZERO, speed: Dd::from(speed) };
        }
    }
    model.base_parameters.joint_parameters.clone_from(&scene.regressor);
    for drive in &mut model.drives {
        if !scene.effects.elastic_transmissions {
            *drive = drives::stiffened(drive);
        }
        if !scene.effects.transmission_losses {
            drive.stages.iter_mut().for_each(|stage| stage.efficiency = None);
            drive.efficiency = None;
        }
    }
    for (_, complaint) in drives::unyielding(&model.drives) {
        scene.places.complain("effects.elastic_transmissions", complaint, diagnostics);
    }
    if diagnostics.has_errors() {
        return None;
    }
    // with joints locked, drives fit the joints that are left or do not; a dependent motion of all is one of a part, too
    drives::find_shares(&mut model.drives);
    Some(model)
}

/// The robot without the inertias that are inputs: each of a link with what is fixed to it in the file, not of what a lock or
/// a payload adds.
fn without_parameters(mut model: Model<Dd>, scene: &Scene) -> Model<Dd> {
    for parameter in &scene.parameters {
        if let Parameter::Link { link } = parameter {
            model.bodies.iter_mut().filter(|b| b.name == *link).for_each(|b| b.inertia = SpatialInertia::zero());
        }
    }
    model
}

/// Pose of a body whose joint does not move, in its joint frame of the parent.
type Held = Transform<Dd>;

/// How a scene holds a body against its parent; `None` if its joint moves.
fn held(model: &Model<Dd>, id: BodyId, scene: &Scene) -> Option<Held> {
    let body = &model.bodies[id];
    if body.joint.kind.is_base() {
        return (scene.base == Base::Fixed).then(Transform::identity);
    }
    let coupling = model.coupling_of(id);
    let joint = &model.bodies[coupling.map_or(id, |coupling| coupling.source)].joint;
    let (_, q) = scene.locked.iter().find(|(name, _)| *name == joint.name)?;
    let q = coupling.map_or(Dd::from(*q), |coupling| coupling.ratio * Dd::from(*q) + coupling.offset);
    // one number does not hold others, and is complained of
    if !body.joint.kind.is_single() {
        return Some(Transform::identity());
    }
    Some(match body.joint.kind.turns() {
        false => body.joint.kind.motion(&[q]),
        true => {
            // as in robot files: 1.5707963267948966 is a right angle
            let angle = Angle { value: q.to_f64(), unit: AngleUnit::Radian, text: String::new(), place: Place::none() };
            match (angle::read(&angle, angle::ROUNDING), coupling) {
                (read, Some(_)) if read.special.is_none() => body.joint.kind.motion(&[q]),
                (read, _) => turned(about(Vec3::unit_z(), read.sin_cos)),
            }
        }
    })
}

/// The robot with bodies merged whose joints do not move: the inertia of each goes to the nearest body below it that moves,
/// or to the world, and so do its frames and the bodies that it carries. The other coordinates keep their order.
fn lock(model: Model<Dd>, held: &[Option<Held>]) -> Model<Dd> {
    if held.iter().all(Option::is_none) {
        return model;
    }
    let partings: Vec<Option<BodyId>> = model.closure.loops.iter().map(|of| model.parting(of)).collect();
    let home_of: Vec<Vec<Dd>> = match model.closure.is_empty() {
        true => Vec::new(),
        false => model.bodies.iter().map(|body| body.joint.coordinates(&model.closure.home).to_vec()).collect(),
    };
    // for every old body, the new one that it is part of, and its pose there
    let mut carriers: Vec<(Option<BodyId>, Transform<Dd>)> = Vec::new();
    let mut parts: Vec<Vec<Part>> = Vec::new();
    let mut bodies: Vec<Body<Dd>> = Vec::new();
    for (body, held) in model.bodies.into_iter().zip(held) {
        let (parent, x_carrier_parent) = body.parent.map_or((None, Transform::identity()), |p| carriers[p]);
        let placement = compose(&x_carrier_parent, &body.placement);
        match held {
            Some(x_joint_body) => {
                let x_carrier_body = compose(&placement, x_joint_body);
                if let Some(parent) = parent {
                    let i = &body.inertia;
                    parts[parent].push(Part::placed(i.mass, i.com, i.inertia_com, &x_carrier_body));
                }
                carriers.push((parent, x_carrier_body));
            }
            None => {
                carriers.push((Some(bodies.len()), Transform::identity()));
                parts.push(vec![Part::of(&body.inertia)]);
                let dense = composing_pays(parent, &placement.rotation);
                bodies.push(Body { parent, placement, dense, ..body });
            }
        }
    }
    for (body, parts) in bodies.iter_mut().zip(&parts) {
        if parts.len() > 1 {
            body.inertia = merge(parts);
        }
    }
    renumber(&mut bodies);
    let moved_coupling = |coupling: &Coupling<Dd>| {
        let [body, source] = [coupling.body, coupling.source].map(|b| carriers[b].0.filter(|_| held[b].is_none()));
        Some(Coupling { body: body?, source: source?, ..*coupling })
    };
    let couplings = model.couplings.iter().filter_map(moved_coupling).collect();
    let at = |body: Option<BodyId>| body.map_or((None, Transform::identity()), |body| carriers[body]);
    let mut closure = model.closure;
    for (own, parting) in closure.loops.iter_mut().zip(partings) {
        for (k, end) in own.ends.iter_mut().enumerate() {
            let (body, x_carrier_body) = at(end.body);
            *end = LoopEnd { body, point: point(&x_carrier_body, end.point) };
            own.alignments.iter_mut().for_each(|pair| pair[k] = x_carrier_body.rotation * pair[k]);
        }
        let turned = at(parting).1.rotation;
        own.directions.iter_mut().for_each(|direction| *direction = turned * *direction);
    }
    for body in closure.groups.iter_mut().flat_map(|group| &mut group.dependents) {
        *body = carriers[*body].0.expect("joints that loops determine are not locked");
    }
    if !closure.is_empty() {
        let mut home = vec![Dd::ZERO; bodies.iter().map(|body| body.joint.kind.nq()).sum()];
        for old in (0..held.len()).filter(|old| held[*old].is_none()) {
            let joint = &bodies[carriers[old].0.expect("it moves")].joint;
            home[joint.iq..joint.iq + joint.kind.nq()].copy_from_slice(&home_of[old]);
        }
        closure.home = home;
    }
    let frames = model.frames.into_iter().map(|frame| match frame.body {
        Some(old) => {
            let (body, x_carrier_body) = &carriers[old];
            Frame { body: *body, placement: compose(x_carrier_body, &frame.placement), ..frame }
        }
        None => frame,
    });
    let carried = |body: BodyId| carriers[body];
    let drives = model.drives.into_iter().filter_map(|drive| moved(drive, held, &carried));
    Model { frames: frames.collect(), drives: drives.collect(), bodies, couplings, closure, ..model }
}

/// A drive on the joints that are left; `None` if there is none. `carried` gives the new body that an old one is part of, and
/// its pose there.
fn moved(
    drive: Drive<Dd>,
    held: &[Option<Held>],
    carried: &dyn Fn(BodyId) -> (Option<BodyId>, Transform<Dd>),
) -> Option<Drive<Dd>> {
    let joints = drive.joints.iter().filter(|(body, _)| held[*body].is_none());
    let joints: Vec<(BodyId, Dd)> = joints.filter_map(|(body, n)| Some((carried(*body).0?, *n))).collect();
    // on the world a rotor does not turn in space
    let rotor = drive.rotor.and_then(|rotor| {
        let (body, pose) = carried(rotor.body);
        Some(Rotor { body: body?, axis: pose.rotation * rotor.axis, ..rotor })
    });
    (!joints.is_empty()).then_some(Drive { joints, rotor, ..drive })
}

/// Gives the joints that are left their places in the coordinate vectors, in the order that they have.
fn renumber(bodies: &mut [Body<Dd>]) {
    let mut order: Vec<BodyId> = (0..bodies.len()).collect();
    order.sort_by_key(|&id| bodies[id].joint.iv);
    let (mut iq, mut iv) = (0, 0);
    for id in order {
        let joint = &mut bodies[id].joint;
        (joint.iq, joint.iv) = (iq, iv);
        iq += joint.kind.nq();
        iv += joint.kind.nv();
    }
}

/// Adds the payloads to the bodies that carry them.
fn weld(model: &mut Model<Dd>, scene: &Scene) {
    let mut parts: Vec<Vec<Part>> = model.bodies.iter().map(|body| vec![Part::of(&body.inertia)]).collect();
    for payload in &scene.payloads {
        let frame = model.frame(&payload.frame).expect("the frames of payloads were checked");
        let Some(body) = frame.body else { continue };
        let [xx, xy, xz, yy, yz, zz] = payload.inertia.map(Dd::from);
        let inertia = Sym3 { xx, xy, xz, yy, yz, zz };
        parts[body].push(Part::placed(Dd::from(payload.mass), vector(payload.com), inertia, &frame.placement));
    }
    for (body, parts) in model.bodies.iter_mut().zip(&parts) {
        if parts.len() > 1 {
            body.inertia = merge(parts);
        }
    }
}

/// Those of a joint's effects that the scene wants.
fn wanted_effects(of_robot: &JointEffects<Dd>, wanted: &Effects) -> JointEffects<Dd> {
    let force = match of_robot.coulomb {
        model::Coulomb::Off => None,
        model::Coulomb::Sign(force) | model::Coulomb::Smooth { force, .. } => Some(force),
    };
    JointEffects {
        rotor_inertia: of_robot.rotor_inertia.filter(|_| wanted.rotor_inertia),
        damping: if wanted.damping { of_robot.damping } else { Dd::ZERO },
        coulomb: match (force, wanted.coulomb) {
            (None, _) | (_, CoulombForm::Off) => model::Coulomb::Off,
            (Some(force), CoulombForm::Sign) => model::Coulomb::Sign(force),
            (Some(force), CoulombForm::Smooth(speed)) => model::Coulomb::Smooth { force, speed: Dd::from(speed) },
        },
        stiffness: if wanted.springs { of_robot.stiffness } else { Dd::ZERO },
        spring_rest: if wanted.springs { of_robot.spring_rest } else { Dd::ZERO },
    }
}
