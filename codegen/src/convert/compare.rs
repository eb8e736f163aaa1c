//! Whether a text that was written is the robot that was to be written.

use crate::description::write::FormatWriter;
use crate::description::{self, Description, FileFormat};
use crate::diagnostic::{Diagnostics, Severity, Source};
use crate::model::{self, ModelOptions};
use std::collections::HashSet;
use straightline_core::closure::{ClosedLoop, Closure};
use straightline_core::coupling::Coupling;
use straightline_core::model::{Body, Frame, Model};
use straightline_core::spatial::{SpatialInertia, Transform};
use straightline_core::Dd;

/// How far numbers may be off that were computed anew: entries of rotations, lengths over the longest of the robot, masses, and
/// tensors over their greatest entry. A rotation as three angles, or as four numbers of a quaternion, is off by 1.2e-15 at most.
pub const ROUNDING: f64 = 4e-15;

/// In what the text differs from the robot; `None`: in nothing.
pub fn difference(robot: &Description, text: &str, format: &FileFormat, writer: &FormatWriter) -> Option<String> {
    let mut said = Diagnostics::new();
    let source = Source::new(&format!("written.{}", writer.extensions[0]), text);
    let read = description::read(&source, &mut said);
    if let Some(read) = read.as_ref().filter(|read| read.format != format) {
        return Some(format!("it is read as {}", read.format.name));
    }
    let options = ModelOptions { floating_base: robot.floats() && writer.floats_by_option, ..ModelOptions::default() };
    let model = read.as_ref().and_then(|read| model::build(read, &options, &mut said));
    let (Some(read), Some(model)) = (read, model) else {
        let error = said.iter().find(|complaint| complaint.severity == Severity::Error);
        return Some(error.map_or_else(|| "it is not read".to_string(), |error| error.line()));
    };
    let Some(wanted) = model::build(robot, &ModelOptions::default(), &mut Diagnostics::new()) else {
        return Some("without what is left out it is no robot".to_string());
    };
    if read.drives != robot.drives || read.flexible != robot.flexible {
        return Some("drives or links that bend are others".to_string());
    }
    of_models(&wanted, &model)
}

/// In what two robots differ, of which the second may have further frames; `None`: in nothing.
pub fn of_models(wanted: &Model<Dd>, found: &Model<Dd>) -> Option<String> {
    if wanted.name != found.name {
        return Some(format!("the robot is called `{}`", found.name));
    }
    if wanted.gravity != found.gravity {
        return Some("gravity is another one".to_string());
    }
    if wanted.bodies.len() != found.bodies.len() {
        return Some(format!("{} bodies move instead of {}", found.bodies.len(), wanted.bodies.len()));
    }
    let lengths = wanted.bodies.iter().map(|body| magnitude(&body.placement).max(arm(&body.inertia)));
    let frames = wanted.frames.iter().map(|frame| magnitude(&frame.placement));
    let longest = lengths.chain(frames).fold(0.0, f64::max);
    let bodies = wanted.bodies.iter().zip(&found.bodies);
    let bodies =
        bodies.filter_map(|(a, b)| of_bodies(a, b, longest).map(|what| format!("joint `{}`: {what}", a.joint.name)));
    let frames = wanted.frames.iter().filter_map(|frame| of_frames(frame, &found.frames, longest));
    let couplings =
        (of_bodies_in_order(wanted) != of_bodies_in_order(found)).then(|| "couplings are others".to_string());
    let loops = (!are_loops(wanted, found, longest)).then(|| "loops are others".to_string());
    let drives = (wanted.drives != found.drives).then(|| "drives are others".to_string());
    bodies.chain(frames).chain(couplings).chain(loops).chain(drives).next()
}

/// Couplings in the order of the joints that follow, whatever that of the files is.
fn of_bodies_in_order(model: &Model<Dd>) -> Vec<Coupling<Dd>> {
    let mut couplings = model.couplings.clone();
    couplings.sort_by_key(|coupling| coupling.body);
    couplings
}

/// Whether the same points coincide, and determine the same joints in the same assemblies.
fn are_loops(wanted: &Model<Dd>, found: &Model<Dd>, longest: f64) -> bool {
    let (a, b) = (&wanted.closure, &found.closure);
    let bodies = |model: &Model<Dd>| model.closure.dependents().collect::<HashSet<_>>();
    let ends = |(a, b): (&ClosedLoop<Dd>, &ClosedLoop<Dd>)| {
        let mut ends = a.ends.iter().zip(&b.ends);
        ends.all(|(a, b)| a.body == b.body && all_near(&a.point.to_array(), &b.point.to_array(), longest))
    };
    let ways = |closure: &Closure<Dd>| closure.groups.iter().map(|group| group.dyad.clone()).collect::<Vec<_>>();
    a.loops.len() == b.loops.len()
        && bodies(wanted) == bodies(found)
        && ways(a) == ways(b)
        && a.loops.iter().zip(&b.loops).all(|loops| ends(loops) && are_turned_alike(loops))
}

/// Whether hinges and welds hold bodies the same way.
fn are_turned_alike((a, b): (&ClosedLoop<Dd>, &ClosedLoop<Dd>)) -> bool {
    let pairs = a.alignments.iter().flatten().zip(b.alignments.iter().flatten());
    a.alignments.len() == b.alignments.len()
        && pairs.into_iter().all(|(a, b)| all_near(&a.to_array(), &b.to_array(), 1.0))
}

fn magnitude(pose: &Transform<Dd>) -> f64 {
    pose.translation.to_array().iter().fold(0.0, |most, x| most.max(x.abs().to_f64()))
}

fn arm(inertia: &SpatialInertia<Dd>) -> f64 {
    inertia.com.to_array().iter().fold(0.0, |most, x| most.max(x.abs().to_f64()))
}

fn of_bodies(a: &Body<Dd>, b: &Body<Dd>, longest: f64) -> Option<&'static str> {
    let inertia = |e: &SpatialInertia<Dd>| {
        let j = e.inertia_com;
        [j.xx, j.yy, j.zz, j.xy, j.xz, j.yz]
    };
    let effects_but_rotors = |body: &Body<Dd>| {
        let mut effects = body.effects;
        effects.rotor_inertia = effects.rotor_inertia.map(|_| Dd::ONE);
        // no spring is slack anywhere
        if effects.stiffness == Dd::ZERO {
            effects.spring_rest = Dd::ZERO;
        }
        effects
    };
    let rotor = |body: &Body<Dd>| body.effects.rotor_inertia.unwrap_or(Dd::ZERO);
    // what has no mass has it nowhere
    let has_no_mass = a.inertia.mass == Dd::ZERO && b.inertia.mass == Dd::ZERO;
    let coms = [a, b].map(|body| body.inertia.com.to_array());
    let greatest = inertia(&a.inertia).iter().fold(0.0, |most: f64, x| most.max(x.abs().to_f64()));
    let checks = [
        (a.joint == b.joint, "name, kind, coordinates or limits are others"),
        (a.parent == b.parent, "another link carries it"),
        (are_near(&a.placement, &b.placement, longest), "it stands elsewhere"),
        (is_near(a.inertia.mass, b.inertia.mass, a.inertia.mass.to_f64()), "the mass is another one"),
        (has_no_mass || all_near(&coms[0], &coms[1], longest), "the centre of mass is another one"),
        (all_near(&inertia(&a.inertia), &inertia(&b.inertia), greatest), "the inertia is another one"),
        (effects_but_rotors(a) == effects_but_rotors(b), "friction or spring are others"),
        (is_near(rotor(a), rotor(b), rotor(a).to_f64()), "the rotor's inertia is another one"),
    ];
    checks.into_iter().find(|(holds, _)| !holds).map(|(_, what)| what)
}

fn of_frames(wanted: &Frame<Dd>, found: &[Frame<Dd>], longest: f64) -> Option<String> {
    let Some(found) = found.iter().find(|found| found.name == wanted.name) else {
        return Some(format!("there is no frame `{}`", wanted.name));
    };
    let is_same = found.body == wanted.body && are_near(&found.placement, &wanted.placement, longest);
    (!is_same).then(|| format!("frame `{}` stands elsewhere", wanted.name))
}

fn is_near(a: Dd, b: Dd, scale: f64) -> bool {
    a == b || (a - b).abs().to_f64() <= ROUNDING * scale.abs()
}

fn all_near(a: &[Dd], b: &[Dd], scale: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| is_near(*a, *b, scale))
}

fn are_near(a: &Transform<Dd>, b: &Transform<Dd>, longest: f64) -> bool {
    let rotations = a.rotation.rows.iter().zip(&b.rotation.rows).all(|(a, b)| all_near(a, b, 1.0));
    rotations && all_near(&a.translation.to_array(), &b.translation.to_array(), longest)
}
