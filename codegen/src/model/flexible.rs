//! What gives way: links cut into elastic segments, and the springs that a base stands on.
//!
//! **The lumped rule.** A beam of length L with bending stiffness EI and torsional stiffness GJ is divided into n equal segments of
//! length h = L/n. The flexibility of each is lumped into joints in its middle, with springs EI/h and GJ/h, and what lies between two
//! middles is rigid: n + 1 bodies, those at the ends half as long as the others (the rigid finite element method with its primary and
//! secondary division: E. Wittbrodt, I. Adamiec-Wójcik, S. Wojciech, Dynamics of Flexible Multibody Systems, Springer 2006, chapter
//! 2; lumped masses in section 20.5.1, problem 4 of the chapter). Under a force P on its tip a cantilever then gives way by
//!
//! Σ P (L − x_i)² h/EI = P L³/(3 EI) · (1 − 1/(4 n²)),   x_i = (i − ½) h,
//!
//! the midpoint rule of the integral, and its lowest frequency is off by a part of the order of 1/n². Damping is the material's:
//! Kelvin and Voigt, each damper its spring times a time constant.
//!
//! **The masses** of the bodies add up to the link's, as do their centres of mass and inertias: mass, centre of mass c and second moment
//! Σ = ½ tr(J) 1 − J of the link are those of a rod of equal density along the axis u, every slice of which has the same second moment
//! across. With d = Σ u/(uᵀ Σ u), the line of the slices' centres is c + (s − s_c) d, the rod reaches √(3 uᵀΣu/m) to both sides of
//! s_c = u · c, and a slice's moment across is Σ − (uᵀΣu) d dᵀ, which is positive semidefinite wherever Σ is. What of the rod lies
//! beyond the ends of the axis stays with the last bodies. Of a uniform beam all that is exact.

use super::geometry::{canonical_rotation, compose, magnitude, snap_tensor, snap_vector, unit, vector};
use super::merge::Part;
use crate::description::flexible::{judge_number, BaseSupport, Bending, Flexible, WrittenSpring};
use crate::description::{messages, Noted};
use crate::diagnostic::Diagnostics;
use straightline_core::algorithms::composing_pays;
use straightline_core::joint::Measure;
use straightline_core::model::{Body, BodyId, Joint, JointEffects, JointKind, Limits};
use straightline_core::spatial::{Mat3, SpatialInertia, Sym3, Transform, Vec3};
use straightline_core::Dd;

/// Segments of a link, at most.
const MOST_SEGMENTS: usize = 100;
/// An axis is across another if the cosine between them is smaller.
const ACROSS: f64 = 1e-9;
/// By so much of the axis the rod that stands for a link's mass may begin or end elsewhere without a warning.
const SPREAD: f64 = 1.0 / 3.0;

/// What carries the points of a link: one body, or of a flexible link its bodies along the axis.
#[derive(Clone)]
pub(super) struct Carrier {
    /// Where each begins along the axis \[m\], the body (`None`: the world), and the pose of the straight link's frame in it.
    pieces: Vec<(f64, Option<BodyId>, Transform<Dd>)>,
    /// Where the axis begins in the link frame, and its direction.
    axis: (Vec3<Dd>, Vec3<Dd>),
}

impl Carrier {
    /// A link that is rigid: its body, and the pose of its frame there.
    pub fn rigid(body: Option<BodyId>, x_body_link: Transform<Dd>) -> Carrier {
        Carrier { pieces: vec![(f64::NEG_INFINITY, body, x_body_link)], axis: (Vec3::zero(), Vec3::unit_z()) }
    }

    /// The body that a point of the straight link belongs to, and the pose of the link frame there.
    pub fn at(&self, point: Vec3<Dd>) -> (Option<BodyId>, Transform<Dd>) {
        let s = self.axis.1.dot(point - self.axis.0).to_f64();
        let piece = self.pieces.iter().rev().find(|piece| s >= piece.0).unwrap_or(&self.pieces[0]);
        (piece.1, piece.2)
    }

    /// The body that holds the joint of the link.
    pub fn first(&self) -> (Option<BodyId>, Transform<Dd>) {
        (self.pieces[0].1, self.pieces[0].2)
    }
}

/// A link that was cut.
pub(super) struct Cut {
    /// What stays with the body that the link hung on, in the link frame.
    pub first: Option<Part>,
    /// The bodies beyond it, each with its part of the link, in the body's canonical frame.
    pub bodies: Vec<(Body<Dd>, Option<Part>)>,
    /// What carries the link's points.
    pub carrier: Carrier,
}

/// Those flexible links of a robot that count: a scene's stand in place of the file's. Complains of names that are unknown or come twice.
pub(super) fn chosen<'a>(
    of_file: &'a [Flexible],
    of_scene: &'a [Flexible],
    links: &[&str],
    diagnostics: &mut Diagnostics,
) -> Vec<&'a Flexible> {
    for (i, flexible) in of_scene.iter().enumerate() {
        let name = flexible.link.value.as_str();
        if !links.contains(&name) {
            let known = links.iter().copied();
            diagnostics.push(messages::unknown_link("flexible link", name, known).at(&flexible.link.place));
        }
        if of_scene[..i].iter().any(|other| other.link.value == name) {
            diagnostics.push(messages::duplicate_name("flexible link", name).at(&flexible.link.place));
        }
    }
    let is_new = |f: &&Flexible| !of_scene.iter().any(|other| other.link.value == f.link.value);
    of_file.iter().filter(is_new).chain(of_scene).collect()
}

/// Cuts a link that hangs on `carrier`. `joint` is where its joint holds it, `part` its mass, both in the link frame; bodies are numbered
/// from `next` on. `None` after a complaint.
pub(super) fn cut(
    flexible: &Flexible,
    carrier: (Option<BodyId>, Transform<Dd>),
    joint: Vec3<Dd>,
    part: Option<Part>,
    next: BodyId,
    diagnostics: &mut Diagnostics,
) -> Option<Cut> {
    let link = &flexible.link.value;
    let n = flexible.segments.value;
    if !(1..=MOST_SEGMENTS).contains(&n) {
        let be = format!("between 1 and {MOST_SEGMENTS}");
        let complaint =
            messages::elastic_number(&format!("segments of link `{link}`"), &n.to_string(), &be, "4 to 10 are usual");
        diagnostics.push(complaint.at(&flexible.segments.place));
        return None;
    }
    let (from, to) = (vector(flexible.from), vector(flexible.to.value));
    let Some(along) = unit(to - from) else {
        diagnostics.push(messages::flexible_axis(link, "it has no length").at(&flexible.to.place));
        return None;
    };
    let length = along.dot(to - from);
    let h = length / Dd::from(n as f64);
    let middles: Vec<Dd> = (0..n).map(|i| h * (Dd::from(i as f64) + Dd::HALF)).collect();
    if along.dot(joint - from).to_f64() >= middles[0].to_f64() {
        let why = "it begins on the other side of the link's joint";
        diagnostics.push(messages::flexible_axis(link, why).at(&flexible.to.place));
        return None;
    }
    let springs = springs(flexible, along, diagnostics)?;
    let damping = Dd::from(flexible.damping.value);

    if let Some((begins, ends)) = part.as_ref().map(|part| rod(part, from, along)) {
        let (begins, ends) = (begins.to_f64() / length.to_f64(), ends.to_f64() / length.to_f64());
        if begins.abs() > SPREAD || (ends - 1.0).abs() > SPREAD {
            diagnostics.push(messages::flexible_mass(link, begins, ends).at(&flexible.link.place));
        }
    }
    let mut parts = part.map(|part| spread(&part, from, along, &middles).into_iter());
    let mut next_part = || parts.as_mut().and_then(Iterator::next).filter(|part| part.mass != Dd::ZERO);
    let first = next_part();
    let mut pieces = vec![(f64::NEG_INFINITY, carrier.0, carrier.1)];
    let mut bodies: Vec<(Body<Dd>, Option<Part>)> = Vec::new();
    for (i, middle) in middles.iter().enumerate() {
        let (_, mut parent, mut x_parent_link) = pieces[i];
        let point = from + along.scale(*middle);
        for (d, (label, axis, stiffness)) in springs.iter().enumerate() {
            let joint = format!("{link}_{label}{}", i + 1);
            let name = if d + 1 == springs.len() { format!("{link}_segment{}", i + 1) } else { joint.clone() };
            let x_link_joint = Transform { rotation: canonical_rotation(*axis), translation: point };
            let spring = *stiffness / h;
            let effects = JointEffects { stiffness: spring, damping: spring * damping, ..JointEffects::none() };
            let body =
                elastic_body(name, parent, (joint, Measure::Angle.joint()), (&x_parent_link, &x_link_joint), effects);
            (parent, x_parent_link) = (Some(next + bodies.len()), body.link_frame);
            bodies.push((body, None));
        }
        let placed = |part: Part| Part::placed(part.mass, part.com, part.inertia_com, &x_parent_link);
        bodies.last_mut()?.1 = next_part().map(placed);
        pieces.push((middle.to_f64(), parent, x_parent_link));
    }
    Some(Cut { first, bodies, carrier: Carrier { pieces, axis: (from, along) } })
}

/// The joints in the middle of a segment: their labels, unit axes in the link frame, and EI or GJ.
fn springs(flexible: &Flexible, along: Vec3<Dd>, diagnostics: &mut Diagnostics) -> Option<Vec<(String, Vec3<Dd>, Dd)>> {
    let link = &flexible.link.value;
    let coordinate = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(vector);
    let names = ["x", "y", "z"];
    let is_across = |axis: Vec3<Dd>| axis.dot(along).to_f64().abs() <= ACROSS;
    let mut is_sound = true;
    let mut found = Vec::new();
    let mut add = |what: String, label: String, axis: Vec3<Dd>, stiffness: &Noted<f64>| {
        let good = judge_number(format!("{what} of link `{link}`"), stiffness, false, &mut |d| diagnostics.push(d));
        found.push((label, axis, Dd::from(stiffness.value)));
        good
    };
    match &flexible.bending {
        Bending::None => {}
        Bending::Round(stiffness) => {
            let across: Vec<usize> = (0..3).filter(|k| coordinate[*k].dot(along) == Dd::ZERO).collect();
            let axes = match across[..] {
                [i, j] => [(names[i], coordinate[i]), (names[j], coordinate[j])],
                _ => {
                    let r = canonical_rotation(along);
                    [("a", r.column(0)), ("b", r.column(1))]
                }
            };
            // of one number one complaint
            is_sound &= add("bending".to_string(), format!("bend_{}", axes[0].0), axes[0].1, stiffness);
            if is_sound {
                add("bending".to_string(), format!("bend_{}", axes[1].0), axes[1].1, stiffness);
            }
        }
        Bending::About(stiffnesses) => {
            for (k, stiffness) in stiffnesses.iter().enumerate() {
                let Some(stiffness) = stiffness else { continue };
                is_sound &=
                    add(format!("bending about {}", names[k]), format!("bend_{}", names[k]), coordinate[k], stiffness);
            }
        }
    }
    if let Some(stiffness) = &flexible.torsion {
        is_sound &= add("torsion".to_string(), "twist".to_string(), along, stiffness);
    }
    let mut complain = |d| diagnostics.push(d);
    is_sound &= judge_number(format!("damping of link `{link}`"), &flexible.damping, true, &mut complain);
    if let Bending::About(stiffnesses) = &flexible.bending {
        for (k, stiffness) in stiffnesses.iter().enumerate().filter(|(k, _)| !is_across(coordinate[*k])) {
            if let Some(stiffness) = stiffness {
                complain(messages::flexible_bending(link, names[k]).at(&stiffness.place));
                is_sound = false;
            }
        }
    }
    if found.is_empty() {
        complain(messages::flexible_rigid(link).at(&flexible.link.place));
        is_sound = false;
    }
    is_sound.then_some(found)
}

/// A body on a passive joint: poses of the carrying frame in the parent, and of the joint in that frame.
fn elastic_body(
    name: String,
    parent: Option<BodyId>,
    (joint, kind): (String, JointKind),
    (x_parent_frame, x_frame_joint): (&Transform<Dd>, &Transform<Dd>),
    effects: JointEffects<Dd>,
) -> Body<Dd> {
    let placement = compose(x_parent_frame, x_frame_joint);
    let back = x_frame_joint.inverse();
    let scale = magnitude(back.translation);
    let limits = Limits { effort: 0.0, ..Limits::default() };
    Body {
        name,
        parent,
        joint: Joint { name: joint, kind, iq: 0, iv: 0, limits },
        placement,
        inertia: SpatialInertia::zero(),
        link_frame: Transform { translation: snap_vector(back.translation, scale), ..back },
        dense: composing_pays(parent, &placement.rotation),
        effects,
        load: None,
    }
}

/// Second moment Σ about the centre of mass, and Σ u.
fn moments(part: &Part, along: Vec3<Dd>) -> (Sym3<Dd>, Dd, Vec3<Dd>) {
    let sigma = part.inertia_com.inertia_to_second_moment();
    let of_axis = sigma * along;
    let size = along.dot(of_axis);
    // a body without extent along the axis is a point on it
    let trace = (sigma.xx + sigma.yy + sigma.zz).to_f64();
    match size.to_f64() > 1e-24 * trace && part.mass != Dd::ZERO {
        true => (sigma, size, of_axis.map(|x| x / size)),
        false => (sigma, Dd::ZERO, along),
    }
}

/// Where the rod of equal density begins and ends along the axis that has a link's mass, centre of mass and second moment.
fn rod(part: &Part, from: Vec3<Dd>, along: Vec3<Dd>) -> (Dd, Dd) {
    let (_, size, _) = moments(part, along);
    let middle = along.dot(part.com - from);
    let half = if size == Dd::ZERO { Dd::ZERO } else { (Dd::from(3.0) * size / part.mass).sqrt() };
    (middle - half, middle + half)
}

/// The parts of a link between the cuts, in the link frame: one more than there are cuts.
fn spread(part: &Part, from: Vec3<Dd>, along: Vec3<Dd>, cuts: &[Dd]) -> Vec<Part> {
    let (sigma, size, d) = moments(part, along);
    let (begins, ends) = rod(part, from, along);
    let (length, middle) = (ends - begins, (begins + ends) * Dd::HALF);
    let outer =
        |v: Vec3<Dd>| Sym3 { xx: v.x * v.x, xy: v.x * v.y, xz: v.x * v.z, yy: v.y * v.y, yz: v.y * v.z, zz: v.z * v.z };
    let line = outer(d);
    let across = sigma - line.map(|x| x * size);
    // the part that a mass without length falls into
    let taken = cuts.iter().filter(|cut| cut.to_f64() <= middle.to_f64()).count();
    let (mut below, mut parts) = (begins, Vec::new());
    for i in 0..=cuts.len() {
        let cut = cuts.get(i).copied().filter(|cut| cut.to_f64() < ends.to_f64()).unwrap_or(ends);
        let above = if cut.to_f64() < below.to_f64() { below } else { cut };
        let reach = above - below;
        let share = match length == Dd::ZERO {
            true if i == taken => Dd::ONE,
            true => Dd::ZERO,
            false => reach / length,
        };
        let own = part.mass * share * reach * reach / Dd::from(12.0);
        let second = line.map(|x| x * own) + across.map(|x| x * share);
        let offset = d.scale((below + above) * Dd::HALF - middle);
        let scale = magnitude(part.com).max(magnitude(offset));
        parts.push(Part {
            mass: part.mass * share,
            com: snap_vector(part.com + offset, scale),
            inertia_com: snap_tensor(second.second_moment_to_inertia()),
        });
        below = above;
    }
    parts
}

/// The bodies between the world and a base on springs, each massless; the last one takes the base. The pose of the world's frame at rest
/// in each is its `link_frame`. `None` after a complaint.
pub(super) fn support(support: &BaseSupport, root: &str, diagnostics: &mut Diagnostics) -> Option<Vec<Body<Dd>>> {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(vector);
    let mut bodies: Vec<Body<Dd>> = Vec::new();
    let mut is_sound = true;
    let given = || support.directions.iter().enumerate().filter_map(|(k, elastic)| Some((k, elastic.as_ref()?)));
    let count = given().count();
    if count == 0 {
        diagnostics.push(messages::support_rigid().at(&support.place.place));
        return None;
    }
    for (k, WrittenSpring { stiffness, damping, rest }) in given() {
        let label = BaseSupport::DIRECTIONS[k];
        let mut complain = |d| diagnostics.push(d);
        is_sound &= judge_number(format!("stiffness of `{label}` of [support]"), stiffness, false, &mut complain);
        is_sound &= judge_number(format!("damping of `{label}` of [support]"), damping, true, &mut complain);
        let kind = if k < 3 { Measure::Length.joint() } else { Measure::Angle.joint() };
        let joint = format!("support_{label}");
        let name = if bodies.len() + 1 == count { root.to_string() } else { joint.clone() };
        let x_world_joint = Transform { rotation: canonical_rotation(axes[k % 3]), translation: vector(support.at) };
        let (parent, x_parent_world) = match bodies.last() {
            None => (None, Transform { rotation: Mat3::identity(), translation: Vec3::zero() }),
            Some(body) => (Some(bodies.len() - 1), body.link_frame),
        };
        let effects = JointEffects {
            stiffness: Dd::from(stiffness.value),
            damping: Dd::from(damping.value),
            spring_rest: Dd::from(*rest),
            ..JointEffects::none()
        };
        bodies.push(elastic_body(name, parent, (joint, kind), (&x_parent_world, &x_world_joint), effects));
    }
    is_sound.then_some(bodies)
}
