//! What gives way of a robot: flexible links as rigid groups with springs between them, and springs below the root link.

use super::{vector, Group, GroupJoint, Placed, RigidPart};
use crate::description::flexible::{BaseSupport, Bending, Flexible};
use crate::description::Description;
use crate::model::ModelOptions;
use nalgebra::{Matrix3, Vector3};
use straightline_core::reference::{unit, ReferenceJoint};
use straightline_core::Dd;

/// What gives way of a robot.
pub(super) struct Elastic<'a> {
    /// Links that are cut into segments.
    pub links: Vec<&'a Flexible>,
    /// Springs below the root link.
    pub support: Option<&'a BaseSupport>,
}

impl<'a> Elastic<'a> {
    pub fn of(description: &'a Description, options: &'a ModelOptions) -> Elastic<'a> {
        if options.rigid_links {
            return Elastic { links: Vec::new(), support: None };
        }
        let is_replaced = |f: &&Flexible| options.flexible.iter().any(|other| other.link.value == f.link.value);
        let of_file = description.flexible.iter().filter(|f| !is_replaced(f));
        Elastic { links: of_file.chain(&options.flexible).collect(), support: options.support.as_ref() }
    }
}

/// The groups that a link consists of, each from so far along the axis on, with the straight link's frame in the group's.
pub(super) struct Segments {
    begin: Vector3<Dd>,
    along: Vector3<Dd>,
    groups: Vec<(f64, usize, Placed)>,
}

impl Segments {
    pub fn rigid(group: usize, place: Placed) -> Segments {
        let groups = vec![(f64::NEG_INFINITY, group, place)];
        Segments { begin: Vector3::zeros(), along: Vector3::zeros(), groups }
    }

    pub fn at(&self, point: &Vector3<Dd>) -> (usize, Placed) {
        let s = self.along.dot(&(point - self.begin)).to_f64();
        let inside = self.groups.iter().rfind(|group| group.0 <= s);
        inside.map_or((0, Placed::here()), |(_, group, place)| (*group, *place))
    }
}

/// The bodies between the world and the root link `root` on springs: joint frames parallel with the world's in the support's
/// point, link frames in the same place at rest.
pub(super) fn stand(support: &BaseSupport, root: &str, groups: &mut Vec<Group>) -> (usize, Placed) {
    let given: Vec<usize> = (0..6).filter(|k| support.directions[*k].is_some()).collect();
    for (i, k) in given.iter().enumerate() {
        let position = if i == 0 { vector(&support.at) } else { Vector3::zeros() };
        let name = format!("support_{}", BaseSupport::DIRECTIONS[*k]);
        groups.push(Group {
            joint: Some(GroupJoint {
                parent: groups.len() - 1,
                place: Placed { rotation: Matrix3::identity(), position },
                child: if i + 1 == given.len() { root.to_string() } else { name.clone() },
                name,
                kind: if *k < 3 { ReferenceJoint::Linear } else { ReferenceJoint::Revolute },
                axis: Vector3::from_fn(|row, _| if row == k % 3 { Dd::ONE } else { Dd::ZERO }),
                vectors: None,
            }),
            parts: Vec::new(),
        });
    }
    (groups.len() - 1, Placed { rotation: Matrix3::identity(), position: -vector(&support.at) })
}

/// A link cut at the middles of equal segments: n joints, n + 1 groups. Frames of the groups are parallel with the link's, with their
/// origins in the cuts. The mass is that of a rod with the link's inertia, each piece with its share of the inertia across.
pub(super) fn bend(
    flexible: &Flexible,
    (group, place): (usize, Placed),
    part: Option<RigidPart>,
    groups: &mut Vec<Group>,
) -> Result<Segments, String> {
    let (begin, end) = (vector(&flexible.from), vector(&flexible.to.value));
    let along = unit(&(end - begin));
    let count = flexible.segments.value;
    let step = (end - begin).dot(&along) / Dd::from(count as f64);
    let cuts: Vec<Dd> = (0..count).map(|i| step * Dd::from(i as f64) + step / Dd::from(2.0)).collect();
    let unit_axis = |k: usize| Vector3::from_fn(|row, _| if row == k { Dd::ONE } else { Dd::ZERO });
    let mut axes: Vec<(String, Vector3<Dd>)> = match &flexible.bending {
        Bending::None => Vec::new(),
        Bending::About(given) => {
            let about = (0..3).filter(|k| given[*k].is_some());
            about.map(|k| (format!("bend_{}", ["x", "y", "z"][k]), unit_axis(k))).collect()
        }
        Bending::Round(_) => match (0..3).position(|k| along[k].abs() == Dd::ONE) {
            Some(k) => {
                let across = (0..3).filter(|other| *other != k);
                across.map(|k| (format!("bend_{}", ["x", "y", "z"][k]), unit_axis(k))).collect()
            }
            None => return Err("the reference knows round flexible links along coordinate axes alone".to_string()),
        },
    };
    axes.extend(flexible.torsion.as_ref().map(|_| ("twist".to_string(), along)));
    let mut parts = match part {
        Some(part) => pieces(&part, &begin, &along, &cuts),
        None => Vec::new(),
    }
    .into_iter();
    let moved = |part: RigidPart, place: &Placed| RigidPart {
        mass: part.mass,
        centre: place.position + place.rotation * part.centre,
        inertia: place.rotation * part.inertia * place.rotation.transpose(),
    };
    groups[group].parts.extend(parts.next().map(|part| moved(part, &place)));
    let mut segments = Segments { begin, along, groups: vec![(f64::NEG_INFINITY, group, place)] };
    let (mut parent, mut parent_place) = (group, place);
    for (i, cut) in cuts.iter().enumerate() {
        let point = begin + along * *cut;
        for (k, (label, axis)) in axes.iter().enumerate() {
            let in_link = Placed { rotation: Matrix3::identity(), position: point };
            let link = &flexible.link.value;
            let name = format!("{link}_{label}{}", i + 1);
            let child = if k + 1 == axes.len() { format!("{link}_segment{}", i + 1) } else { name.clone() };
            let place = parent_place.then(&in_link);
            let joint =
                GroupJoint { parent, place, name, child, kind: ReferenceJoint::Revolute, axis: *axis, vectors: None };
            groups.push(Group { joint: Some(joint), parts: Vec::new() });
            (parent, parent_place) = (groups.len() - 1, Placed { rotation: Matrix3::identity(), position: -point });
        }
        groups[parent].parts.extend(parts.next().map(|part| moved(part, &parent_place)));
        segments.groups.push((cut.to_f64(), parent, parent_place));
    }
    Ok(segments)
}

/// The pieces of a rod with the mass, centre of mass and inertia of `part` between the cuts, in the same frame.
fn pieces(part: &RigidPart, begin: &Vector3<Dd>, along: &Vector3<Dd>, cuts: &[Dd]) -> Vec<RigidPart> {
    // ∫ (u·x)² dm = ½ tr J − uᵀ J u, and ∫ (u·x) x dm beside it
    let half_trace = part.inertia.trace() / Dd::from(2.0);
    let with_axis = along * half_trace - part.inertia * along;
    let size = along.dot(&with_axis);
    let centre = along.dot(&(part.centre - begin));
    let half = (size * Dd::from(3.0) / part.mass).sqrt();
    let slope = with_axis.map(|x| x / size);
    let of_line = Matrix3::identity() * slope.dot(&slope) - slope * slope.transpose();
    let across = part.inertia - of_line * size;
    let clamp = |s: Dd| match s.to_f64() {
        x if x <= (centre - half).to_f64() => centre - half,
        x if x >= (centre + half).to_f64() => centre + half,
        _ => s,
    };
    let ends: Vec<Dd> =
        [centre - half].into_iter().chain(cuts.iter().map(|s| clamp(*s))).chain([centre + half]).collect();
    let piece = |pair: &[Dd]| {
        let (length, middle) = (pair[1] - pair[0], (pair[0] + pair[1]) / Dd::from(2.0));
        let share = length / (half + half);
        let mass = part.mass * share;
        RigidPart {
            mass,
            centre: part.centre + slope * (middle - centre),
            inertia: across * share + of_line * (mass * length * length / Dd::from(12.0)),
        }
    };
    ends.windows(2).map(piece).collect()
}
