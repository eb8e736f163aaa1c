//! Two authors, one physics: the algorithms, in canonical joint frames, and the reference, in mass centres and the
//! external frame, agree in double-double on random chains and trees.

mod support;

use nalgebra::{Matrix3, Vector3};
use straightline_core::algorithms;
use straightline_core::model::{self, Body, Frame, JointKind, Limits, Model};
use straightline_core::reference::{self, unit, ExtendedPosition, Joint, MassCentreTree};
use straightline_core::spatial::{Mat3, SpatialInertia, Sym3, Transform, Vec3};
use straightline_core::Dd;
use support::compare::{compare_authors, Disagreement};
use support::robots::{random_robot, Random, RobotKind};

fn vec3(v: &Vector3<Dd>) -> Vec3<Dd> {
    Vec3::new(v.x, v.y, v.z)
}

fn mat3(m: &Matrix3<Dd>) -> Mat3<Dd> {
    let column = |k: usize| vec3(&m.column(k).into_owned());
    Mat3::from_columns(column(0), column(1), column(2))
}

fn sym3(m: &Matrix3<Dd>) -> Sym3<Dd> {
    Sym3::from_matrix(&mat3(m))
}

/// Axes of a canonical frame in the link frame: z along the joint axis, x perpendicular to it and otherwise at random.
fn canonical_axes(random: &mut Random, e: &Vector3<Dd>) -> Matrix3<Dd> {
    let x = unit(&e.cross(&random.direction()));
    Matrix3::from_columns(&[x, e.cross(&x), *e])
}

/// The same robot in canonical joint frames, from its geometry: the frame of link j has its origin in S_j and its z axis
/// along e_j, and at q = 0 it is where the joint frame on the parent is.
fn canonical(random: &mut Random, tree: &MassCentreTree<Dd>) -> Model<Dd> {
    // of every link: axes of the canonical frame in frame j, and its origin from C_j, in frame j
    let frames: Vec<(Matrix3<Dd>, Vector3<Dd>)> = tree
        .links
        .iter()
        .map(|link| match link.joint {
            Joint::Free => (Matrix3::identity(), -link.r),
            Joint::Revolute | Joint::Linear => (canonical_axes(random, &link.e), -link.r),
        })
        .collect();
    let bodies = tree.links.iter().zip(&frames).map(|(link, (axes, origin))| {
        let kind = match link.joint {
            Joint::Revolute => JointKind::Revolute,
            Joint::Linear => JointKind::Prismatic,
            Joint::Free => JointKind::Floating,
        };
        let placement = if link.joint == Joint::Free {
            Transform::identity()
        } else {
            let (parent_axes, parent_origin) =
                link.parent.map_or_else(|| (Matrix3::identity(), Vector3::zeros()), |p| frames[p]);
            let joint = parent_axes.transpose() * (-link.r_parent - parent_origin);
            let rotation = parent_axes.transpose() * at_zero(link) * axes;
            Transform { rotation: mat3(&rotation), translation: vec3(&joint) }
        };
        Body {
            name: link.name.clone(),
            parent: link.parent,
            joint: model::Joint { name: link.name.clone(), kind, iq: link.iq, iv: link.iv, limits: Limits::default() },
            dense: algorithms::composing_pays(link.parent, &placement.rotation),
            effects: model::JointEffects::none(),
            load: None,
            placement,
            inertia: SpatialInertia::new(
                link.mass,
                vec3(&(axes.transpose() * -origin)),
                sym3(&(axes.transpose() * link.inertia * axes)),
            ),
            link_frame: Transform { rotation: mat3(&axes.transpose()), translation: Vec3::zero() },
        }
    });
    let frame = |frame: &reference::MassCentreFrame<Dd>| {
        let (axes, origin) = frame.link.map_or_else(|| (Matrix3::identity(), Vector3::zeros()), |j| frames[j]);
        Frame {
            name: frame.name.clone(),
            body: frame.link,
            placement: Transform {
                rotation: mat3(&(axes.transpose() * frame.rotation)),
                translation: vec3(&(axes.transpose() * (frame.position - origin))),
            },
        }
    };
    Model {
        name: tree.name.clone(),
        bodies: bodies.collect(),
        gravity: vec3(&tree.gravity),
        frames: tree.frames.iter().map(frame).collect(),
        drives: vec![],
    }
}

/// From link axes to the parent's at q = 0: by Figure 20.3, the projections of −r_{j−1,j} and r_{j,j} on the plane
/// perpendicular to the axis have the same direction; a linear joint is turned by α from there.
fn at_zero(link: &reference::MassCentreLink<Dd>) -> Matrix3<Dd> {
    let (r_star, r_parent_star, alpha) = match &link.extended {
        ExtendedPosition::Matrix(rotation) => return *rotation,
        ExtendedPosition::ByVectors { r_star, r_parent_star, alpha } => (r_star, r_parent_star, *alpha),
    };
    let across = |r: Vector3<Dd>, e: &Vector3<Dd>| unit(&(r - e * e.dot(&r)));
    let triad = |x: Vector3<Dd>, e: &Vector3<Dd>| Matrix3::from_columns(&[x, e.cross(&x), *e]);
    let here = triad(across(r_star.unwrap_or(link.r), &link.e), &link.e);
    let there = triad(across(-r_parent_star.unwrap_or(link.r_parent), &link.e_parent), &link.e_parent);
    let (sin, cos) = if link.joint == Joint::Linear { alpha.sin_cos() } else { (Dd::ZERO, Dd::ONE) };
    let (o, l) = (Dd::ZERO, Dd::ONE);
    there * Matrix3::new(cos, -sin, o, sin, cos, o, o, o, l) * here.transpose()
}

/// The joints get places in q and q̇ in an order of their own.
fn shuffle_coordinates(random: &mut Random, tree: &mut MassCentreTree<Dd>) {
    let mut order: Vec<usize> = (0..tree.links.len()).collect();
    for i in (1..order.len()).rev() {
        order.swap(i, random.below(i + 1));
    }
    let (mut iq, mut iv) = (0, 0);
    for j in order {
        (tree.links[j].iq, tree.links[j].iv) = (iq, iv);
        iq += tree.links[j].joint.nq();
        iv += tree.links[j].joint.nv();
    }
}

/// `count` random robots of a kind, up to `links` links.
fn compare_robots(branched: bool, floating: bool, count: u64, links: usize) {
    let mut disagreement = Disagreement::default();
    for seed in 0..count {
        let mut random = Random(seed);
        let kind = RobotKind { links: 1 + random.below(links), branched, floating };
        let mut tree = random_robot(&mut random, kind);
        if random.below(3) == 0 {
            shuffle_coordinates(&mut random, &mut tree);
        }
        let model = canonical(&mut random, &tree);
        compare_authors(&mut disagreement, &format!("{kind:?}, seed {seed}"), &tree, &model, &mut random);
    }
    disagreement.judge();
}

#[test]
fn both_authors_agree_on_chains() {
    compare_robots(false, false, 100, 9);
}

#[test]
fn both_authors_agree_on_trees() {
    compare_robots(true, false, 100, 14);
}

#[test]
fn both_authors_agree_on_floating_chains() {
    compare_robots(false, true, 60, 8);
}

#[test]
fn both_authors_agree_on_floating_trees() {
    compare_robots(true, true, 60, 14);
}
