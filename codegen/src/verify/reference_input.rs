//! The robot file in the reference's terms: from a [`Description`] to centres of mass, joint axes and joint vectors.
//!
//! A second reading of the file, independent of `crate::model`, so that `verify` tests the way from the file to the
//! equations and not only the equations. Everything is in double-double; the numbers of the file count as the nearest
//! f64 of their text. The description is one that was checked: what cannot be a robot gives an error without a place.
//!
//! Frame j of the reference has the axes of the link frame and its origin in the centre of mass; links on fixed joints are lumped
//! into the link that carries them, their inertia combined about the common centre of mass. The file gives the joint frame at
//! q = 0, so A⁰ is given as a matrix, or vectors as in the chapter, which are taken as written.

use crate::description::{
    AnchoredJoint, Angle, AngleUnit, BaseKind, Description, JointVectors, Noted, Placement, PoseCoordinate, Rotation,
    WrittenInertial, WrittenJoint, WrittenPose, WrittenTurn,
};
use crate::diagnostic::Place;
use crate::model::{FrameOption, ModelOptions};
use nalgebra::{Matrix3, Vector3};
use std::collections::HashMap;
use straightline_core::reference::{
    unit, CentreOfMassFrame, CentreOfMassLink, CentreOfMassTree, ExtendedPosition, ReferenceJoint,
};
use straightline_core::spatial::Sym3;
use straightline_core::Dd;

mod elastic;
mod shared;

use elastic::{bend, stand, Elastic, Segments};
use shared::share_coordinates;

/// An angle of the file in radians; within the tolerance, a multiple of π/4 or π/6.
pub(super) fn radians(angle: &Angle, options: &ModelOptions) -> Dd {
    let value = Dd::from(angle.value);
    let literal = match angle.unit {
        AngleUnit::Radian => value,
        AngleUnit::Degree => value * Dd::PI / Dd::from(180.0),
        AngleUnit::QuarterTurn => value * Dd::FRAC_PI_2,
        AngleUnit::Turn => value * Dd::PI * Dd::from(2.0),
    };
    let near = |part: f64| {
        let step = Dd::PI / Dd::from(part);
        let special = step * Dd::from((literal / step).hi().round());
        (options.angle_tolerance > 0.0 && (literal - special).abs().hi() <= options.angle_tolerance).then_some(special)
    };
    near(4.0).or(near(6.0)).unwrap_or(literal)
}

/// The robot of a description, for [`straightline_core::reference`]. Links and coordinates are in depth-first order of
/// the file, frames are named as in the file: every link, named frames.
///
/// # Errors
/// If the description is no tree of links.
pub fn centre_of_mass_tree(description: &Description, options: &ModelOptions) -> Result<CentreOfMassTree<Dd>, String> {
    let stated = description.gravity.as_ref().map(|gravity| gravity.value);
    let gravity = options.gravity.or(stated).unwrap_or([0.0, 0.0, -9.81]);
    let mut tree = CentreOfMassTree {
        name: description.name.value.clone(),
        gravity: vector(&gravity),
        links: Vec::new(),
        frames: Vec::new(),
    };
    let stated = description.base.as_ref().is_some_and(|base| base.value == BaseKind::Floating);
    let floating = options.floating_base || stated;
    let joint_names = add_links(&mut tree, description, floating, (options, &Elastic::of(description, options)))?;
    share_coordinates(&mut tree, &joint_names, (description, options))?;
    number_coordinates(&mut tree, &joint_names, options);
    Ok(tree)
}

/// The rotation by roll, pitch and yaw \[rad\] of an option.
fn turned(rpy: &[f64; 3], options: &ModelOptions) -> Matrix3<Dd> {
    let angle = |i: usize| Angle { value: rpy[i], ..Angle::zero(Place::none()) };
    rotation(&Rotation::RollPitchYaw([angle(0), angle(1), angle(2)]), options)
}

/// The joints' places in q and q̇: in the order that is asked for, or else in that of the links. A floating root that
/// the order does not name comes first.
fn number_coordinates(tree: &mut CentreOfMassTree<Dd>, joint_names: &[String], options: &ModelOptions) {
    let is_own = |link: &usize| tree.links[*link].shared.is_none();
    let mut order: Vec<usize> = (0..tree.links.len()).filter(is_own).collect();
    if let Some(names) = &options.joint_order {
        order.sort_by_key(|&link| names.iter().position(|name| *name == joint_names[link]));
    }
    let (mut iq, mut iv) = (0, 0);
    for link in order {
        let link = &mut tree.links[link];
        (link.iq, link.iv) = (iq, iv);
        iq += link.joint.nq();
        iv += link.joint.nv();
    }
    let places: Vec<(usize, usize)> = tree.links.iter().map(|link| (link.iq, link.iv)).collect();
    for link in tree.links.iter_mut().filter(|link| link.shared.is_some()) {
        (link.iq, link.iv) = places[link.iv];
    }
}

fn vector(v: &[f64; 3]) -> Vector3<Dd> {
    Vector3::new(Dd::from(v[0]), Dd::from(v[1]), Dd::from(v[2]))
}

fn tensor(s: &Sym3<f64>) -> Matrix3<Dd> {
    Matrix3::new(s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz).map(Dd::from)
}

/// The matrix of a rotation as written.
fn rotation(rotation: &Rotation, options: &ModelOptions) -> Matrix3<Dd> {
    match rotation {
        Rotation::RollPitchYaw(rpy) => roll_pitch_yaw(rpy, options),
        Rotation::Turns(turns) => turns.iter().fold(Matrix3::identity(), |r, turn| r * one_turn(turn, options)),
    }
}

/// The matrix of one turn of several, by the formulas with vectors of length one.
fn one_turn(turn: &WrittenTurn, options: &ModelOptions) -> Matrix3<Dd> {
    // R v = (q₀² − q·q) v + 2 q (q·v) + 2 q₀ q × v
    let by_quaternion = |w: Dd, q: Vector3<Dd>| {
        Matrix3::identity() * (w * w - q.dot(&q)) + (q * q.transpose() + skew(&q) * w) * Dd::from(2.0)
    };
    match turn {
        WrittenTurn::About { axis, angle } => about(&unit(&vector(&axis.value)), radians(angle, options)),
        WrittenTurn::Quaternion(q) => {
            let [w, x, y, z] = q.value.map(Dd::from);
            let length = (w * w + x * x + y * y + z * z).sqrt();
            by_quaternion(w / length, Vector3::new(x, y, z).map(|x| x / length))
        }
        WrittenTurn::Axes(axes) => {
            let [x, y] = axes.value.map(|axis| vector(&axis));
            let x = unit(&x);
            let y = unit(&(y - x * x.dot(&y)));
            Matrix3::from_columns(&[x, y, x.cross(&y)])
        }
        WrittenTurn::ZTo(direction) => {
            let v = unit(&vector(&direction.value));
            if v.x == Dd::ZERO && v.y == Dd::ZERO {
                return Matrix3::from_diagonal(&Vector3::new(Dd::ONE, v.z, v.z));
            }
            // the quaternion of half the angle is along 1 + z·v, z × v
            let (w, q) = (Dd::ONE + v.z, Vector3::new(-v.y, v.x, Dd::ZERO));
            let length = (w * w + q.dot(&q)).sqrt();
            by_quaternion(w / length, q.map(|x| x / length))
        }
    }
}

/// The matrix of v ×.
fn skew(v: &Vector3<Dd>) -> Matrix3<Dd> {
    Matrix3::new(Dd::ZERO, -v.z, v.y, v.z, Dd::ZERO, -v.x, -v.y, v.x, Dd::ZERO)
}

/// The rotation about a unit vector: 1 + sin e× + (1 − cos) e× e×.
fn about(e: &Vector3<Dd>, angle: Dd) -> Matrix3<Dd> {
    let (sin, cos) = angle.sin_cos();
    let e = skew(e);
    Matrix3::identity() + e * sin + e * e * (Dd::ONE - cos)
}

/// R = Rz(yaw) Ry(pitch) Rx(roll).
fn roll_pitch_yaw(rpy: &[Angle; 3], options: &ModelOptions) -> Matrix3<Dd> {
    let [roll, pitch, yaw] = [0, 1, 2].map(|i| radians(&rpy[i], options).sin_cos());
    let (o, l) = (Dd::ZERO, Dd::ONE);
    let (s, c) = roll;
    let rx = Matrix3::new(l, o, o, o, c, -s, o, s, c);
    let (s, c) = pitch;
    let ry = Matrix3::new(c, o, s, o, l, o, -s, o, c);
    let (s, c) = yaw;
    let rz = Matrix3::new(c, -s, o, s, c, o, o, o, l);
    rz * ry * rx
}

/// Where a frame is, in another one.
#[derive(Clone, Copy)]
struct Placed {
    rotation: Matrix3<Dd>,
    position: Vector3<Dd>,
}

impl Placed {
    fn here() -> Placed {
        Placed { rotation: Matrix3::identity(), position: Vector3::zeros() }
    }

    fn read(pose: &WrittenPose, options: &ModelOptions) -> Placed {
        Placed { rotation: rotation(&pose.rotation, options), position: vector(&pose.xyz.value) }
    }

    /// Where a frame is that is placed in this one.
    fn then(&self, inner: &Placed) -> Placed {
        Placed { rotation: self.rotation * inner.rotation, position: self.position + self.rotation * inner.position }
    }
}

/// A rigid part: mass, centre of mass, inertia about the centre of mass, in the axes of the link that carries it.
struct RigidPart {
    mass: Dd,
    centre: Vector3<Dd>,
    inertia: Matrix3<Dd>,
}

impl RigidPart {
    fn read(inertial: &WrittenInertial, link: &Placed, options: &ModelOptions) -> RigidPart {
        let axes = link.rotation * rotation(&inertial.rotation, options);
        RigidPart {
            mass: Dd::from(inertial.mass.value),
            centre: link.position + link.rotation * vector(&inertial.com.value),
            inertia: axes * tensor(&inertial.inertia.value) * axes.transpose(),
        }
    }

    /// The parts as one: Steiner's theorem about the common centre of mass. Without mass, that is the origin.
    fn lump(parts: &[RigidPart]) -> RigidPart {
        let mass = parts.iter().fold(Dd::ZERO, |sum, part| sum + part.mass);
        let moment = parts.iter().fold(Vector3::zeros(), |sum, part| sum + part.centre * part.mass);
        let centre = if mass == Dd::ZERO { Vector3::zeros() } else { moment.map(|x| x / mass) };
        let about_centre = |part: &RigidPart| {
            let d = part.centre - centre;
            part.inertia + (Matrix3::identity() * d.dot(&d) - d * d.transpose()) * part.mass
        };
        let inertia = parts.iter().fold(Matrix3::zeros(), |sum, part| sum + about_centre(part));
        RigidPart { mass, centre, inertia }
    }
}

/// The joint of a group.
struct GroupJoint {
    /// The group it moves against.
    parent: usize,
    /// The joint frame in the parent's link frame.
    place: Placed,
    name: String,
    /// The link that it moves.
    child: String,
    kind: ReferenceJoint,
    /// In the joint frame.
    axis: Vector3<Dd>,
    /// Of a joint that is given so.
    vectors: Option<JointVectors>,
}

/// A moving link of the file, or the world, while the tree is read.
struct Group {
    /// `None` for the root group.
    joint: Option<GroupJoint>,
    /// What is rigidly joined to it, in its link frame.
    parts: Vec<RigidPart>,
}

/// Frames fixed to a group: name, group, place in the group's link frame.
type Frames = Vec<(String, usize, Placed)>;

fn add_links(
    tree: &mut CentreOfMassTree<Dd>,
    description: &Description,
    floating: bool,
    (options, elastic): (&ModelOptions, &Elastic),
) -> Result<Vec<String>, String> {
    let mut joint_names = Vec::new();
    let (groups, frames) = rigid_groups(description, options, elastic)?;
    let lumped: Vec<RigidPart> = groups.iter().map(|group| RigidPart::lump(&group.parts)).collect();
    // the root group: the world, or the floating link
    let link_of = |group: usize| if floating { Some(group) } else { group.checked_sub(1) };
    // from the link frame's origin to C; frame 0 has its origin in the world's
    let centre_of = |group: usize| link_of(group).map_or_else(Vector3::zeros, |_| lumped[group].centre);
    for (group, part) in groups.iter().zip(&lumped) {
        let RigidPart { mass, centre, inertia } = part;
        let Some(GroupJoint { parent, place, name, child, kind, axis, vectors }) = &group.joint else {
            if floating {
                let root = root_link(description)?;
                joint_names.push(floating_root_joint(description));
                tree.links.push(CentreOfMassLink::free(root.to_string(), *mass, *inertia, *centre));
            }
            continue;
        };
        joint_names.push(name.clone());
        let e = if *kind == ReferenceJoint::Ball { Vector3::zeros() } else { unit(axis) };
        let (e_parent, r, extended) = match vectors {
            None => (place.rotation * e, *centre, ExtendedPosition::Matrix(place.rotation)),
            // the place is that of S_j, in the axes of the link below
            Some(given) => {
                let below = |v: &[f64; 3]| place.rotation * vector(v);
                let star = |star: &Option<Noted<[f64; 3]>>, r: &Noted<[f64; 3]>| star.as_ref().unwrap_or(r).value;
                let by_vectors = ExtendedPosition::ByVectors {
                    r_star: Some(vector(&star(&given.r_star, &given.r))),
                    r_parent_star: Some(below(&star(&given.r_parent_star, &given.r_parent))),
                    alpha: given.alpha.as_ref().map_or(Dd::ZERO, |alpha| radians(alpha, options)),
                };
                (unit(&below(&given.e_parent.value)), centre + vector(&given.r.value), by_vectors)
            }
        };
        tree.links.push(CentreOfMassLink {
            name: child.clone(),
            parent: link_of(*parent),
            joint: *kind,
            iq: 0,
            iv: 0,
            shared: None,
            mass: *mass,
            inertia: *inertia,
            e,
            e_parent,
            r,
            r_parent: centre_of(*parent) - place.position,
            extended,
        });
    }
    for (name, group, place) in frames {
        tree.frames.push(CentreOfMassFrame {
            name,
            link: link_of(group),
            position: place.position - centre_of(group),
            rotation: place.rotation,
        });
    }
    Ok(joint_names)
}

/// The name under which the joint of a floating root can be ordered: `root_joint`, with underscores before it where the
/// file uses that name.
fn floating_root_joint(description: &Description) -> String {
    let mut name = "root_joint".to_string();
    while description.joints.iter().any(|joint| joint.name.value == name) {
        name.insert(0, '_');
    }
    name
}

fn reference_joint(joint: &WrittenJoint) -> Result<ReferenceJoint, String> {
    ReferenceJoint::of_word(joint.kind.value.word, joint.kind.value.number)
        .ok_or_else(|| format!("joint `{}` is of no kind that the reference knows", joint.name.value))
}

/// The link that no joint moves.
fn root_link(description: &Description) -> Result<&str, String> {
    let is_child = |name: &str| description.joints.iter().any(|joint| joint.child.value == name);
    let mut roots = description.links.iter().map(|link| link.name.value.as_str()).filter(|name| !is_child(name));
    match (roots.next(), roots.next()) {
        (Some(root), None) => Ok(root),
        (None, _) => Err("no link is the root".to_string()),
        (Some(a), Some(b)) => Err(format!("`{a}` and `{b}` are both roots")),
    }
}

/// The rigid groups of links, depth first in the file's order, and the frames of links and named frames.
fn rigid_groups(
    description: &Description,
    options: &ModelOptions,
    elastic: &Elastic,
) -> Result<(Vec<Group>, Frames), String> {
    let links: HashMap<&str, usize> =
        description.links.iter().enumerate().map(|(i, link)| (link.name.value.as_str(), i)).collect();
    let mut joints_above: HashMap<&str, Vec<usize>> = HashMap::new();
    for (i, joint) in description.joints.iter().enumerate() {
        joints_above.entry(joint.parent.value.as_str()).or_default().push(i);
    }

    let mut groups = vec![Group { joint: None, parts: Vec::new() }];
    let mut places: HashMap<&str, Segments> = HashMap::new();
    let mut frames = Frames::new();
    // a link to visit: its name, and the joint that leads there
    let mut open = vec![(root_link(description)?, None)];
    while let Some((name, joint)) = open.pop() {
        let (group, place) = match joint {
            None => elastic.support.map_or((0, Placed::here()), |support| stand(support, name, &mut groups)),
            Some(i) => {
                let joint: &WrittenJoint = &description.joints[i];
                let above = places.get(joint.parent.value.as_str()).ok_or("a joint hangs on nothing")?;
                let (at, axis, vectors) = seat(joint, options);
                let (parent, parent_place) = above.at(&at.position);
                let place = parent_place.then(&at);
                if joint.kind.value.kind.is_some() {
                    groups.push(Group {
                        joint: Some(GroupJoint {
                            parent,
                            place,
                            name: joint.name.value.clone(),
                            child: joint.child.value.clone(),
                            kind: reference_joint(joint)?,
                            axis: vector(&axis.value),
                            vectors,
                        }),
                        parts: Vec::new(),
                    });
                    (groups.len() - 1, link_in_joint(joint))
                } else {
                    (parent, place)
                }
            }
        };
        let link = &description.links[*links.get(name).ok_or_else(|| format!("there is no link `{name}`"))?];
        if !link.is_carrier {
            frames.push((name.to_string(), group, place));
        }
        let inertial = link.inertial.as_ref();
        let segments = match elastic.links.iter().find(|flexible| flexible.link.value == name) {
            None => {
                groups[group].parts.extend(inertial.map(|inertial| RigidPart::read(inertial, &place, options)));
                Segments::rigid(group, place)
            }
            Some(flexible) => {
                let part = inertial.map(|inertial| RigidPart::read(inertial, &Placed::here(), options));
                bend(flexible, (group, place), part, &mut groups)?
            }
        };
        if places.insert(name, segments).is_some() {
            return Err(format!("link `{name}` is moved by two joints"));
        }
        // last in, first out: reversed, so that the first joint of the file is followed first
        for &i in joints_above.get(name).into_iter().flatten().rev() {
            open.push((description.joints[i].child.value.as_str(), Some(i)));
        }
    }
    if places.len() != description.links.len() {
        return Err("some links hang on no root".to_string());
    }
    frames.extend(named_frames(description, options, places)?);
    Ok((groups, frames))
}

/// Where a joint is, its axis there, and its vectors where it is given by them.
fn seat<'a>(joint: &'a WrittenJoint, options: &ModelOptions) -> (Placed, &'a Noted<[f64; 3]>, Option<JointVectors>) {
    match &joint.placement {
        Placement::Frames { origin, axis } => (Placed::read(origin, options), axis, None),
        Placement::Anchored(given) => (anchored(given, options), &given.axis, None),
        Placement::Vectors(given) => {
            // S_j = C_{j−1} − r_{j−1,j}
            let position = -vector(&given.r_parent.value);
            (Placed { rotation: Matrix3::identity(), position }, &given.e, Some(given.clone()))
        }
    }
}

/// Where an anchored joint is at q = 0: with the axes of its link, which the coordinate of the file's pose has turned or shifted back.
fn anchored(joint: &AnchoredJoint, options: &ModelOptions) -> Placed {
    let AnchoredJoint { origin, anchor, axis, reference } = joint;
    let e = unit(&vector(&axis.value));
    let back = match reference {
        None => Placed::here(),
        Some(PoseCoordinate::Angle(angle)) => {
            Placed { rotation: about(&e, -radians(angle, options)), ..Placed::here() }
        }
        Some(PoseCoordinate::Length(length)) => Placed { position: -e * Dd::from(length.value), ..Placed::here() },
    };
    let there = Placed { position: vector(&anchor.value), ..Placed::here() };
    Placed::read(origin, options).then(&there).then(&back)
}

/// Where the link frame is in the joint frame.
fn link_in_joint(joint: &WrittenJoint) -> Placed {
    match &joint.placement {
        Placement::Anchored(AnchoredJoint { anchor, .. }) => {
            Placed { position: -vector(&anchor.value), ..Placed::here() }
        }
        _ => Placed::here(),
    }
}

/// Frames that the file or the caller names.
fn named_frames<'a>(
    description: &'a Description,
    options: &ModelOptions,
    mut places: HashMap<&'a str, Segments>,
) -> Result<Frames, String> {
    let mut frames = Frames::new();
    for frame in &description.frames {
        let link = frame.link.value.as_str();
        let carrier = places.get(link).ok_or_else(|| format!("there is no link `{link}`"))?;
        let (group, place) = carrier.at(&vector(&frame.pose.xyz.value));
        let place = place.then(&Placed::read(&frame.pose, options));
        places.insert(&frame.name.value, Segments::rigid(group, place));
        frames.push((frame.name.value.clone(), group, place));
    }
    for FrameOption { name, link, xyz, rpy } in &options.frames {
        let carrier = places.get(link.as_str()).ok_or_else(|| format!("there is no link `{link}`"))?;
        let (group, place) = carrier.at(&vector(xyz));
        let in_link = Placed { rotation: turned(rpy, options), position: vector(xyz) };
        frames.push((name.clone(), group, place.then(&in_link)));
    }
    Ok(frames)
}
