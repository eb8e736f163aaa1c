//! Drives as written, on the joints of a model: rigid stages folded into the shafts beside them, names resolved, matrices of
//! ratios inverted.

use crate::description::drives::{TransmissionStage, WrittenActuator, WrittenDrive, WrittenRating, WrittenThermal};
use crate::description::{messages, Noted};
use crate::diagnostic::{Diagnostic, Diagnostics};
use std::collections::BTreeSet;
use straightline_core::drive::{Actuator, Drive, Efficiency, LinearActuator, Motor, Rating, Rotor, Stage, Thermal};
use straightline_core::model::{BodyId, JointKind, Model};
use straightline_core::spatial::Vec3;
use straightline_core::{Dd, Real};

/// So small beside its terms a sum counts as zero: far above the rounding of double-double, far below that of f64.
const ZERO: f64 = 1e-24;

/// Adds the drives to those of a model. Complaints go to `diagnostics`; a drive with errors is left out.
pub(crate) fn add(drives: &[WrittenDrive], model: &mut Model<Dd>, diagnostics: &mut Diagnostics) {
    for drive in drives {
        if model.drives.iter().any(|d| d.name == drive.name.value) {
            diagnostics.push(messages::duplicate_name("drive", &drive.name.value).at(&drive.name.place));
        } else if let Some(built) = build(drive, model, diagnostics) {
            model.drives.push(built);
        }
    }
    for (drive, complaint) in unyielding(&model.drives) {
        let written = drives.iter().find(|d| d.name.value == drive);
        diagnostics.push(written.map_or(complaint.clone(), |d| complaint.at(&d.name.place)));
    }
    for name in find_shares(&mut model.drives) {
        if let Some(drive) = drives.iter().find(|d| d.name.value == name) {
            let joints: Vec<&str> = drive.joints.iter().map(|(joint, _)| joint.value.as_str()).collect();
            diagnostics.push(messages::drive_coupling(&name, &joints).at(&drive.joints[0].0.place));
        }
    }
}

/// What is wrong with drives whose shafts do not give way, and with which: a rigid transmission from one of them says what its joint does,
/// so it has one joint, and the joint no other.
pub(crate) fn unyielding(drives: &[Drive<Dd>]) -> Vec<(String, Diagnostic)> {
    let holds = |d: &Drive<Dd>| matches!(&d.actuator, Actuator::Linear(a) if a.is_unyielding) && d.stages.is_empty();
    let mut wrong = Vec::new();
    for (k, drive) in drives.iter().enumerate().filter(|(_, d)| holds(d)) {
        let earlier = drives[..k].iter().filter(|d| holds(d) && d.joints.len() == 1);
        let twice = |other: &&Drive<Dd>| other.joints.iter().any(|(body, _)| drive.joints.iter().any(|j| j.0 == *body));
        if drive.joints.len() > 1 {
            wrong.push((drive.name.clone(), messages::unyielding_joints(&drive.name, drive.joints.len())));
        } else if let Some(other) = earlier.into_iter().find(twice) {
            wrong.push((drive.name.clone(), messages::unyielding_twice(&drive.name, &other.name)));
        }
    }
    wrong
}

fn build(drive: &WrittenDrive, model: &Model<Dd>, diagnostics: &mut Diagnostics) -> Option<Drive<Dd>> {
    let owner = format!("drive `{}`", drive.name.value);
    let actuator = actuator(drive, &owner, diagnostics);
    let joints: Vec<Option<(BodyId, Dd)>> = drive
        .joints
        .iter()
        .map(|(joint, ratio)| body(&owner, joint, model, diagnostics).map(|b| (b, Dd::from(*ratio))))
        .collect();
    let joints: Option<Vec<(BodyId, Dd)>> = joints.into_iter().collect();
    let is_elastic = drive.stages.iter().any(|s| s.stiffness.is_some());
    for (body, _) in joints.iter().flatten().filter(|_| is_elastic) {
        if model.coupling_of(*body).is_some_and(|coupling| coupling.offset != Dd::ZERO) {
            let joint = &model.bodies[*body].joint.name;
            diagnostics.push(messages::elastic_follower(&owner, joint).at(&drive.name.place));
            return None;
        }
    }
    let joints = joints.map(|joints| on_free_joints(&joints, model, |x| x));
    let rotor = match &drive.rotor {
        None => None,
        Some((link, axis, inertia)) => {
            let Some(frame) = model.frame(&link.value) else {
                let links = model.frames.iter().map(|f| f.name.as_str());
                diagnostics.push(messages::unknown_link(&owner, &link.value, links).at(&link.place));
                return None;
            };
            let [x, y, z] = axis.map(Dd::from);
            let axis = frame.placement.rotation * Vec3::new(x, y, z);
            let axis = axis.scale(Dd::ONE / axis.dot(axis).sqrt());
            // a rotor on the world does not turn in space
            frame.body.map(|body| Rotor { body, axis, inertia: Dd::from(*inertia) })
        }
    };
    let mut built = Drive {
        name: drive.name.value.clone(),
        actuator: actuator?,
        stages: Vec::new(),
        shaft_inertia: None,
        efficiency: None,
        joints: joints?,
        shares: None,
        input_limit: drive.input_limit.map(Dd::from),
        current_limit: drive.current_limit.map(Dd::from),
        soft_current: None,
        rotor,
        rating: rating(&drive.rating),
    };
    if let (true, Actuator::Linear(LinearActuator { position: None, .. })) = (is_elastic, &built.actuator) {
        let example = "position = [1, 0, 0]";
        diagnostics.push(messages::missing_key(&owner, "position", example).at(&drive.name.place));
        return None;
    }
    fold_stages(drive, &mut built, diagnostics).then_some(built)
}

/// Ratios to joints, those that follow others as ratios to the joints that they follow.
fn on_free_joints<T: Real>(joints: &[(BodyId, T)], model: &Model<Dd>, number: impl Fn(Dd) -> T) -> Vec<(BodyId, T)> {
    let mut found: Vec<(BodyId, T)> = Vec::new();
    for (body, n) in joints {
        let (body, n) = match model.coupling_of(*body) {
            Some(coupling) => (coupling.source, *n * number(coupling.ratio)),
            None => (*body, *n),
        };
        match found.iter_mut().find(|(known, _)| *known == body) {
            Some((_, sum)) => *sum = *sum + n,
            None => found.push((body, n)),
        }
    }
    found
}

fn rating(written: &WrittenRating) -> Rating<Dd> {
    let thermal = |t: &WrittenThermal| Thermal {
        winding_housing: Dd::from(t.winding_housing),
        housing_ambient: Dd::from(t.housing_ambient),
        winding_time: Dd::from(t.winding_time),
        housing_time: Dd::from(t.housing_time),
        ambient: Dd::from(t.ambient),
        limit: t.limit.map(Dd::from),
    };
    Rating {
        speed: written.speed.map(Dd::from),
        continuous_current: written.continuous_current.map(Dd::from),
        thermal: written.thermal.as_ref().map(thermal),
    }
}

fn body(owner: &str, joint: &Noted<String>, model: &Model<Dd>, diagnostics: &mut Diagnostics) -> Option<BodyId> {
    let is_it = |name: &str, kind: JointKind| name == joint.value && kind.is_single();
    let found = model.bodies.iter().position(|b| is_it(&b.joint.name, b.joint.kind));
    let several = model.bodies.iter().map(|b| &b.joint).find(|j| j.name == joint.value && !j.kind.is_single());
    if let Some(other) = several.filter(|other| !other.kind.is_base()) {
        let complaint =
            messages::several_coordinates(&joint.value, other.kind.row().name, &format!("a drive ({owner})"));
        diagnostics.push(complaint.at(&joint.place));
    } else if found.is_none() {
        let moving = model.bodies.iter().filter(|b| b.joint.kind.is_single());
        let names = moving.map(|b| b.joint.name.as_str());
        diagnostics.push(messages::drive_joint(owner, &joint.value, names).at(&joint.place));
    }
    found
}

fn actuator(drive: &WrittenDrive, owner: &str, diagnostics: &mut Diagnostics) -> Option<Actuator<Dd>> {
    match &drive.actuator {
        WrittenActuator::Motor { torque_constant, emf_constant, resistance, inductance, rotor_inertia, friction } => {
            Some(Actuator::Motor(Motor {
                rotor_inertia: Dd::from(*rotor_inertia),
                torque_constant: Dd::from(*torque_constant),
                emf_constant: Dd::from(*emf_constant),
                friction: Dd::from(*friction),
                resistance: Dd::from(*resistance),
                inductance: inductance.map(Dd::from),
            }))
        }
        WrittenActuator::Linear { c, f, d, t, position } => {
            let wide = |x: &[f64]| x.iter().map(|x| Dd::from(*x)).collect::<Vec<Dd>>();
            let n = f.len();
            // whether T b is zero beside its terms
            let vanishes = |b: &[Dd]| {
                let terms = || t.iter().zip(b).map(|(t, b)| Dd::from(*t) * *b);
                let (sum, moduli) = terms().fold((Dd::ZERO, 0.0), |(s, m), x| (s + x, m + x.to_f64().abs()));
                sum.to_f64().abs() <= ZERO * moduli
            };
            let complain = |what: &str, help: &str, diagnostics: &mut Diagnostics| {
                diagnostics.push(messages::actuator_inert(owner, what, help).at(&c.place));
            };
            let mut column = wide(d);
            let mut relative_degree = None;
            for r in 0..n {
                if !vanishes(&column) {
                    relative_degree = Some(r);
                    break;
                }
                let entry = |row: &[f64]| row.iter().zip(&column).fold(Dd::ZERO, |sum, (a, b)| sum + Dd::from(*a) * *b);
                column = c.value.chunks(n).map(entry).collect();
            }
            let Some(relative_degree) = relative_degree else {
                complain("u never reaches its shaft: T Cʳ d = 0 for all r", "check d and the rows of C", diagnostics);
                return None;
            };
            Some(Actuator::Linear(LinearActuator {
                c: wide(&c.value),
                f: wide(f),
                d: wide(d),
                t: wide(t),
                position: position.as_ref().map(|p| wide(p)),
                relative_degree,
                is_unyielding: vanishes(&wide(f)),
            }))
        }
    }
}

/// Rigid stages become part of the shafts: what stands behind a rigid gear is described by the angle before it. What is zero in the file is
/// left out of the equations.
fn fold_stages(drive: &WrittenDrive, built: &mut Drive<Dd>, diagnostics: &mut Diagnostics) -> bool {
    let folded = folded(&drive.with::<Dd>(&[], &[]), drive);
    for (k, stage) in folded.stages.iter().enumerate().skip(1) {
        if stage.inertia.is_none() {
            let elastic: Vec<&TransmissionStage> = drive.stages.iter().filter(|s| s.stiffness.is_some()).collect();
            diagnostics.push(messages::shaft_without_inertia(&built.name).at(&elastic[k].ratio.place));
            return false;
        }
    }
    let zero = Dd::ZERO;
    built.stages = folded.stages.into_iter().map(|s| s.built(zero)).collect();
    built.joints = built.joints.iter().map(|(body, n)| (*body, *n * folded.ratio)).collect();
    built.shaft_inertia = folded.inertia;
    built.efficiency = folded.efficiency;
    true
}

/// The transmission of a drive with rigid stages folded into the shafts beside them.
struct Folded<T> {
    stages: Vec<FoldedStage<T>>,
    /// Of the last shaft: its speed after the last elastic stage over that which `ratio` or `joints` count from, gears on it, losses behind it.
    ratio: T,
    inertia: Option<T>,
    efficiency: Option<Efficiency<T>>,
}

struct FoldedStage<T> {
    ratio: T,
    stiffness: T,
    damping: Option<T>,
    inertia: Option<T>,
    efficiency: Option<Efficiency<T>>,
}

impl<T: Real> FoldedStage<T> {
    fn built(self, zero: T) -> Stage<T> {
        let FoldedStage { ratio, stiffness, damping, inertia, efficiency } = self;
        Stage { ratio, stiffness, damping, inertia: inertia.unwrap_or(zero), efficiency }
    }
}

/// `form`: the same drive as it is in the file, which says what there is.
fn folded<T: Real>(drive: &WrittenDrive<T>, form: &WrittenDrive) -> Folded<T> {
    let sum = |a: Option<T>, b: Option<T>| match (a, b) {
        (Some(a), Some(b)) => Some(a + b),
        (a, b) => a.or(b),
    };
    // of the shaft that the present stage begins on: angle of the shaft over that before the stage, inertia, losses
    let mut stages = Vec::new();
    let (mut ratio, mut inertia, mut losses) = (T::one(), None, None);
    for (stage, form) in drive.stages.iter().zip(&form.stages) {
        let n = stage.ratio.value;
        let before = (form.input_inertia != 0.0).then_some(stage.input_inertia);
        let behind = (form.output_inertia != 0.0).then(|| stage.output_inertia / (n * n));
        let gears = sum(before, behind).map(|gears| gears / (ratio * ratio));
        losses = both(losses, stage.efficiency.map(efficiency));
        (ratio, inertia) = (ratio * n, sum(inertia, gears));
        let Some(stiffness) = stage.stiffness else { continue };
        stages.push(FoldedStage { ratio, stiffness, damping: stage.damping, inertia, efficiency: losses });
        (ratio, inertia, losses) = (T::one(), None, None);
    }
    Folded { stages, ratio, inertia, efficiency: both(losses, drive.efficiency.map(efficiency)) }
}

fn efficiency<T>([forward, backward]: [T; 2]) -> Efficiency<T> {
    Efficiency { forward, backward, speed: None }
}

/// Two gears one after the other.
fn both<T: Real>(a: Option<Efficiency<T>>, b: Option<Efficiency<T>>) -> Option<Efficiency<T>> {
    match (a, b) {
        (Some(a), Some(b)) => {
            Some(Efficiency { forward: a.forward * b.forward, backward: a.backward * b.backward, speed: None })
        }
        (a, b) => a.or(b),
    }
}

/// The same drive with a rigid transmission of the same ratios and inertias.
pub(crate) fn stiffened(drive: &Drive<Dd>) -> Drive<Dd> {
    let (mut ratio, mut inertia, mut losses) = (Dd::ONE, Dd::ZERO, None);
    for stage in &drive.stages {
        (ratio, inertia) = (ratio * stage.ratio, inertia + stage.inertia / (ratio * ratio));
        losses = both(losses, stage.efficiency);
    }
    let inertia = inertia + drive.shaft_inertia.unwrap_or(Dd::ZERO) / (ratio * ratio);
    Drive {
        stages: Vec::new(),
        shaft_inertia: (inertia != Dd::ZERO).then_some(inertia),
        efficiency: both(losses, drive.efficiency),
        joints: drive.joints.iter().map(|(b, n)| (*b, *n * ratio)).collect(),
        ..drive.clone()
    }
}

/// A drive of a model with other numbers. `form`: as the model has it, which says what there is; `built`: what the model made of that.
///
/// What has no name stays as it is: actuators other than motors, ratios of several joints to each other. So ratios change by one factor, and
/// the shares of the joints' forces by its inverse, whatever other drives these joints have.
pub(crate) fn derived<T: Real>(
    drive: &WrittenDrive<T>,
    form: &WrittenDrive,
    (built, model): (&Drive<Dd>, &Model<Dd>),
) -> Drive<T> {
    let (folded, built) = (folded(drive, form), built.map(T::constant));
    let body_of = |name: &str| model.bodies.iter().position(|body| body.joint.name == name);
    let known = drive.joints.iter().filter_map(|(name, n)| Some((body_of(&name.value)?, *n * folded.ratio)));
    let known = on_free_joints(&known.collect::<Vec<_>>(), model, T::constant);
    let ratio = |body: BodyId| known.iter().find(|(joint, _)| *joint == body).map(|(_, n)| *n);
    let joints: Vec<(BodyId, T)> = built.joints.iter().map(|(body, n)| (*body, ratio(*body).unwrap_or(*n))).collect();
    let less = built.joints[0].1 / joints[0].1;
    let actuator = match &drive.actuator {
        WrittenActuator::Motor { torque_constant, emf_constant, resistance, inductance, rotor_inertia, friction } => {
            Actuator::Motor(Motor {
                rotor_inertia: *rotor_inertia,
                torque_constant: *torque_constant,
                emf_constant: *emf_constant,
                friction: *friction,
                resistance: *resistance,
                inductance: *inductance,
            })
        }
        WrittenActuator::Linear { .. } => built.actuator.clone(),
    };
    let inertia = drive.rotor.as_ref().map(|(_, _, inertia)| *inertia);
    Drive {
        actuator,
        stages: folded.stages.into_iter().map(|s| s.built(T::zero())).collect(),
        shaft_inertia: folded.inertia,
        efficiency: folded.efficiency,
        shares: built.shares.as_ref().map(|row| row.iter().map(|(body, share)| (*body, *share * less)).collect()),
        joints,
        input_limit: drive.input_limit,
        current_limit: drive.current_limit,
        rotor: built.rotor.zip(inertia).map(|(rotor, inertia)| Rotor { inertia, ..rotor }),
        ..built
    }
}

/// All numbers of a drive, in the order of [`Drive::map`].
pub(crate) fn entries<T: Real>(drive: &Drive<T>) -> Vec<T> {
    let mut all = Vec::new();
    drive.map(|x| {
        all.push(x);
        x
    });
    all
}

/// The torque of each drive's last shaft per force of each joint, where drives and joints fit one to one: rows of the
/// inverse transposed matrix of ratios of those that hang together. Names a drive of every singular matrix.
pub(crate) fn find_shares(drives: &mut [Drive<Dd>]) -> Vec<String> {
    let mut singular = Vec::new();
    let mut is_done = vec![false; drives.len()];
    for first in 0..drives.len() {
        if is_done[first] {
            continue;
        }
        let (mut group, mut joints) = (vec![first], BTreeSet::new());
        is_done[first] = true;
        let mut next = 0;
        while let Some(k) = group.get(next).copied() {
            joints.extend(drives[k].joints.iter().map(|j| j.0));
            for other in 0..drives.len() {
                if !is_done[other] && drives[other].joints.iter().any(|j| joints.contains(&j.0)) {
                    is_done[other] = true;
                    group.push(other);
                }
            }
            next += 1;
        }
        let joints: Vec<BodyId> = joints.into_iter().collect();
        for k in &group {
            drives[*k].shares = None;
        }
        if group.len() != joints.len() {
            continue;
        }
        let ratio = |k: usize, body: BodyId| -> Dd {
            drives[k].joints.iter().filter(|j| j.0 == body).fold(Dd::ZERO, |sum, j| sum + j.1)
        };
        let matrix: Vec<Vec<Dd>> = group.iter().map(|k| joints.iter().map(|j| ratio(*k, *j)).collect()).collect();
        match inverse(matrix) {
            // entry (joint, drive) of the inverse is entry (drive, joint) of its transpose
            Some(inverse) => {
                for (column, k) in group.iter().enumerate() {
                    let row = joints.iter().enumerate().map(|(i, body)| (*body, inverse[i][column]));
                    drives[*k].shares = Some(row.filter(|(_, share)| *share != Dd::ZERO).collect());
                }
            }
            None => singular.push(drives[first].name.clone()),
        }
    }
    singular
}

/// Gauss and Jordan with pivots; `None` if the matrix is singular to rounding.
fn inverse(mut a: Vec<Vec<Dd>>) -> Option<Vec<Vec<Dd>>> {
    let n = a.len();
    for (i, row) in a.iter_mut().enumerate() {
        let scale = row.iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
        if scale == 0.0 {
            return None;
        }
        row.extend((0..n).map(|j| if i == j { Dd::ONE } else { Dd::ZERO }));
    }
    let mut size: Vec<f64> =
        a.iter().map(|row| row[..n].iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max)).collect();
    for k in 0..n {
        let better = |i: &usize| a[*i][k].to_f64().abs() / size[*i];
        let pivot = (k..n).max_by(|i, j| better(i).total_cmp(&better(j)))?;
        if better(&pivot) <= 1e-12 {
            return None;
        }
        a.swap(k, pivot);
        size.swap(k, pivot);
        let inverse_pivot = Dd::ONE / a[k][k];
        let row: Vec<Dd> = a[k].iter().map(|x| *x * inverse_pivot).collect();
        for (_, other) in a.iter_mut().enumerate().filter(|(i, _)| *i != k) {
            let factor = other[k];
            *other = other.iter().zip(&row).map(|(x, r)| *x - factor * *r).collect();
        }
        a[k] = row;
    }
    Some(a.into_iter().map(|row| row[n..].to_vec()).collect())
}
