//! Two authors, one physics: the algorithms, in canonical joint frames, and the reference, in centres of mass and the
//! external frame, agree in double-double on random chains and trees.

use crate::support::compare::{compare_authors, Disagreement};
use crate::support::robots::{random_position, random_robot, written_robots, Random, RobotKind};
use crate::support::written::Style;
use nalgebra::{Matrix3, Vector3};
use straightline_core::algorithms;
use straightline_core::contact::{Contact, Coordinate, Object, ObjectMotion, Surface};
use straightline_core::coupling::Coupling;
use straightline_core::model::{self, Body, Frame, JointKind, Limits, Model};
use straightline_core::reference::{
    self, unit, CentreOfMassTree, Component, ContactFrames, ExtendedPosition, ReferenceJoint, SharedCoordinate,
};
use straightline_core::spatial::{Mat3, MotionVector, SpatialInertia, Sym3, Transform, Vec3};
use straightline_core::Dd;

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
fn canonical(random: &mut Random, tree: &CentreOfMassTree<Dd>) -> Model<Dd> {
    // of every link: axes of the canonical frame in frame j, and its origin from C_j, in frame j
    let frames: Vec<(Matrix3<Dd>, Vector3<Dd>)> = tree
        .links
        .iter()
        .map(|link| match link.joint {
            ReferenceJoint::Free | ReferenceJoint::Ball => (Matrix3::identity(), -link.r),
            ReferenceJoint::Revolute | ReferenceJoint::Linear => (canonical_axes(random, &link.e), -link.r),
        })
        .collect();
    let bodies = tree.links.iter().zip(&frames).map(|(link, (axes, origin))| {
        let kind = match link.joint {
            ReferenceJoint::Revolute => JointKind::Revolute,
            ReferenceJoint::Linear => JointKind::Prismatic,
            ReferenceJoint::Free => JointKind::Floating,
            ReferenceJoint::Ball => JointKind::Spherical,
        };
        let own = (link.iq, link.iv);
        let (iq, iv) = link.shared.map_or(own, |shared| (tree.nq() + shared.rank, tree.nv() + shared.rank));
        let placement = if link.joint == ReferenceJoint::Free {
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
            joint: model::Joint { name: link.name.clone(), kind, iq, iv, limits: Limits::default() },
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
    let frame = |frame: &reference::CentreOfMassFrame<Dd>| {
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
    let coupling = |(body, link): (usize, &reference::CentreOfMassLink<Dd>)| {
        let reference::SharedCoordinate { ratio, offset, .. } = link.shared?;
        let source = tree.links.iter().position(|other| other.shared.is_none() && other.iv == link.iv)?;
        Some(Coupling { body, source, ratio, offset })
    };
    Model {
        name: tree.name.clone(),
        bodies: bodies.collect(),
        gravity: vec3(&tree.gravity),
        couplings: tree.links.iter().enumerate().filter_map(coupling).collect(),
        closure: Default::default(),
        frames: tree.frames.iter().map(frame).collect(),
        drives: vec![],
        base_parameters: Default::default(),
    }
}

/// From link axes to the parent's at q = 0: by Figure 20.3, the projections of −r_{j−1,j} and r_{j,j} on the plane
/// perpendicular to the axis have the same direction; a linear joint is turned by α from there.
fn at_zero(link: &reference::CentreOfMassLink<Dd>) -> Matrix3<Dd> {
    let (r_star, r_parent_star, alpha) = match &link.extended {
        ExtendedPosition::Matrix(rotation) => return *rotation,
        ExtendedPosition::ByVectors { r_star, r_parent_star, alpha } => (r_star, r_parent_star, *alpha),
    };
    let across = |r: Vector3<Dd>, e: &Vector3<Dd>| unit(&(r - e * e.dot(&r)));
    let triad = |x: Vector3<Dd>, e: &Vector3<Dd>| Matrix3::from_columns(&[x, e.cross(&x), *e]);
    let here = triad(across(r_star.unwrap_or(link.r), &link.e), &link.e);
    let there = triad(across(-r_parent_star.unwrap_or(link.r_parent), &link.e_parent), &link.e_parent);
    let (sin, cos) = if link.joint == ReferenceJoint::Linear { alpha.sin_cos() } else { (Dd::ZERO, Dd::ONE) };
    let (o, l) = (Dd::ZERO, Dd::ONE);
    there * Matrix3::new(cos, -sin, o, sin, cos, o, o, o, l) * here.transpose()
}

/// The joints get places in q and q̇ in an order of their own.
fn shuffle_coordinates(random: &mut Random, tree: &mut CentreOfMassTree<Dd>) {
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

/// Some joints of one coordinate share those of others, before or behind them or on another branch, and the rest are numbered anew.
fn couple(random: &mut Random, tree: &mut CentreOfMassTree<Dd>) {
    let joints: Vec<usize> = (0..tree.links.len()).filter(|j| tree.links[*j].joint.nv() == 1).collect();
    let mut sources: Vec<usize> = joints.iter().copied().filter(|_| random.below(2) == 0).collect();
    if sources.is_empty() {
        sources.extend(joints.first());
    }
    let followers: Vec<usize> = joints.into_iter().filter(|j| !sources.contains(j)).collect();
    for (rank, j) in followers.into_iter().enumerate() {
        let source = sources[random.below(sources.len())];
        let [ratio, offset] = [2.0, 1.0].map(|size| random.list(1, size)[0]);
        tree.links[j].shared = Some(SharedCoordinate { ratio, offset, rank });
        tree.links[j].iv = source;
    }
    let (mut iq, mut iv) = (0, 0);
    let mut places = vec![(0, 0); tree.links.len()];
    for (j, link) in tree.links.iter().enumerate().filter(|(_, link)| link.shared.is_none()) {
        places[j] = (iq, iv);
        iq += link.joint.nq();
        iv += link.joint.nv();
    }
    for (j, link) in tree.links.iter_mut().enumerate() {
        let source = if link.shared.is_some() { link.iv } else { j };
        (link.iq, link.iv) = places[source];
    }
}

/// `count` random robots of a kind, up to `links` links.
fn compare_robots([branched, floating, balls]: [bool; 3], count: u64, links: usize) {
    let mut disagreement = Disagreement::default();
    for seed in 0..count {
        let mut random = Random(seed);
        let kind = RobotKind { links: 1 + random.below(links), branched, floating, balls };
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
    compare_robots([false, false, false], 100, 9);
}

#[test]
fn both_authors_agree_on_trees() {
    compare_robots([true, false, false], 100, 14);
}

#[test]
fn both_authors_agree_on_floating_chains() {
    compare_robots([false, true, false], 60, 8);
}

#[test]
fn both_authors_agree_on_floating_trees() {
    compare_robots([true, true, false], 60, 14);
}

#[test]
fn both_authors_agree_on_robots_with_ball_joints() {
    compare_robots([false, false, true], 60, 8);
    compare_robots([true, false, true], 60, 12);
    compare_robots([true, true, true], 60, 12);
}

#[test]
fn both_authors_agree_where_joints_follow_others() {
    let mut disagreement = Disagreement::default();
    let mut coupled = 0;
    for seed in 0..120 {
        let mut random = Random(seed);
        let kind = RobotKind {
            links: 2 + random.below(10),
            branched: seed % 2 == 0,
            floating: seed % 5 == 0,
            balls: seed % 4 == 3,
        };
        let mut tree = random_robot(&mut random, kind);
        couple(&mut random, &mut tree);
        let model = canonical(&mut random, &tree);
        coupled += model.couplings.len();
        assert_eq!((model.nv(), model.tree_nv()), (tree.nv(), tree.nv() + model.couplings.len()));
        compare_authors(&mut disagreement, &format!("{kind:?}, seed {seed}"), &tree, &model, &mut random);
    }
    assert!(coupled > 200, "{coupled} joints follow others");
    disagreement.judge();
}

/// Numbers as people and exporters write them: few digits, dust, masses of 1e-6 kg, ratios of 1e20, millimetres for metres.
fn compare_written(seeds: u64) {
    let mut disagreement = Disagreement { by_what_is_left: true, ..Disagreement::default() };
    for (k, (_, mut tree)) in written_robots(seeds).enumerate() {
        let mut random = Random(k as u64);
        if k % 3 == 0 {
            shuffle_coordinates(&mut random, &mut tree);
        }
        let model = canonical(&mut random, &tree);
        compare_authors(&mut disagreement, &tree.name, &tree, &model, &mut random);
    }
    disagreement.judge();
}

#[test]
fn both_authors_agree_on_robots_as_people_write_them() {
    compare_written(4);
}

#[test]
#[ignore = "a minute: thousands of them"]
fn both_authors_agree_on_thousands_of_robots_as_people_write_them() {
    compare_written(100);
}

fn dot(a: &[Dd], b: &[Dd]) -> Dd {
    a.iter().zip(b).fold(Dd::ZERO, |sum, (a, b)| sum + *a * *b)
}

/// A tip that meets an object on the way: coordinates, reactions and what an impact loses. Motions are judged by what they leave of the
/// second author's equations, as ratios of masses of 1e20 leave no digits to accelerations themselves.
#[test]
fn contacts_of_robots_as_people_write_them_fit_the_equations_of_the_second_author() {
    let mut compared = 0;
    for (k, (style, tree)) in written_robots(4).enumerate() {
        let mut random = Random(900 + k as u64);
        let model = canonical(&mut random, &tree);
        let tip = model.frames.last().expect("a frame on every link");
        let (q, n) = (random_position(&mut random, &tree), tree.nv());
        let (qd, tau) = (random.list(n, 2.0), random.list(n, 10.0));
        // an object that moves with a velocity and an acceleration
        let [origin, v, w, vd, wd] = [0; 5].map(|_| random.vector());
        let (object, axes) = (random.rotation(), random.rotation());
        let axis = |k: usize| axes.column(k).into_owned();
        let contact = Contact {
            name: "touch".into(),
            frame: tip.clone(),
            axis: vec3(&axis(0)),
            second_axis: vec3(&axis(1)),
            object: Object::Moving(ObjectMotion {
                pose: Transform { rotation: mat3(&object), translation: vec3(&origin) },
                velocity: MotionVector { angular: vec3(&w), linear: vec3(&v) },
                acceleration: MotionVector { angular: vec3(&wd), linear: vec3(&vd) },
            }),
            surface: Surface::Plane,
            constrained: vec![Coordinate::Pz],
            free: vec![],
            friction: None,
        };
        let frame = tree.frames.last().expect("a frame on every link").clone();
        let frames =
            ContactFrames { frame, axes: [axis(0), axis(1)], origin, object, motion: [v, w, vd, wd], radius: Dd::ONE };
        let expected = reference::functional_coordinate(&tree, &frames, &q, &qd, Component::Position(2));
        let found = algorithms::constrained_coordinates(&model, &contact, &q, &qd);
        let lengths = tree.links.iter().map(|l| l.r.dot(&l.r).sqrt().hi() + l.r_parent.dot(&l.r_parent).sqrt().hi());
        let size = lengths.sum::<f64>() + 10.0;
        let speed = 1.0 + qd.iter().map(|x| x.abs().hi()).sum::<f64>();
        let row: Vec<Dd> = expected.jacobian.iter().copied().collect();
        let errors = [
            (found.value[0] - expected.s).abs().hi() / size,
            (found.rate[0] - expected.sd).abs().hi() / (size * speed),
            (found.bias[0] - expected.adjoint).abs().hi() / (size * speed * speed),
            found.jacobian[0].iter().zip(&row).fold(0.0, |m: f64, (a, b)| m.max((*a - *b).abs().hi())) / size,
        ];
        assert!(errors.iter().all(|e| *e < 1e-28), "s, ṡ, A, J differ by {errors:?}: {}", tree.name);
        if row.iter().all(|x| x.abs().hi() < 1e-3 * size) {
            continue; // hardly any joint moves the tip across
        }
        compared += 1;
        let (h, bias) = (reference::mass_matrix(&tree, &q), reference::bias_force(&tree, &q, &qd));
        let factor = algorithms::Ltdl::factor(&model, &algorithms::mass_matrix(&model, &q));
        let ridge = Dd::from(1e-16);
        let drive: Vec<Dd> = tau.iter().zip(algorithms::bias_force(&model, &q, &qd)).map(|(t, h)| *t - h).collect();
        let supports = [algorithms::Support::Rigid(Dd::ZERO)];
        let motion = algorithms::constrained_forward_dynamics(&factor, &drive, &found, None, &supports, ridge);
        // H q̈ + h − τ − Jᵀ F and J q̈ + A, each against the sum of its terms
        for i in 0..n {
            let terms: Vec<Dd> = (0..n)
                .map(|j| h[(i, j)] * motion.qdd[j])
                .chain([bias[i], -tau[i], -row[i] * motion.force[0]])
                .collect();
            let (left, sizes) = terms.iter().fold((Dd::ZERO, 0.0), |(sum, m), x| (sum + *x, m + x.abs().hi()));
            assert!(left.abs().hi() <= 1e-24 * sizes, "joint {i}: {left:?} of {sizes:e}: {}", tree.name);
        }
        let terms: f64 = row.iter().zip(&motion.qdd).map(|(j, x)| (*j * *x).abs().hi()).sum();
        let left = (dot(&row, &motion.qdd) + expected.adjoint).abs().hi();
        // beside ratios of 1e40 the ridge is seen, and what it leaves is said
        let said = motion.violation[0].abs().hi();
        let scale = terms + expected.adjoint.abs().hi();
        assert!(left <= 1e-24 * scale + 1.01 * said, "J q̈ + A: {left:e} of {scale:e}, {said:e} is said: {}", tree.name);
        let is_ratio = style == Style::Ratios;
        assert!(is_ratio || said <= 1e-24 * scale, "{said:e} of {scale:e} is said: {}", tree.name);
        // what a fixed object takes out of it is the loss of kinetic energy
        let still = Contact {
            object: Object::Fixed(Transform { rotation: mat3(&object), translation: vec3(&origin) }),
            ..contact
        };
        let s = algorithms::constrained_coordinates(&model, &still, &q, &qd);
        for restitution in [0.0, 0.5] {
            let struck = [algorithms::Struck::Rigid];
            let blow = algorithms::impact(&factor, &qd, &s, None, &struck, Dd::from(restitution), ridge);
            let after: Vec<Dd> = qd.iter().zip(&blow.dqd).map(|(a, b)| *a + *b).collect();
            let energy = |qd: &[Dd]| reference::kinetic_energy(&tree, &q, qd);
            let (before, now) = (energy(&qd), energy(&after));
            let off = (before - now - blow.energy_loss).abs().hi();
            assert!(
                off <= 1e-24 * (before.hi() + now.hi()),
                "lost {:?}, off by {off:e}: {}",
                blow.energy_loss,
                tree.name
            );
            let turned = (s.rate[0] + blow.dsd[0] + Dd::from(restitution) * s.rate[0]).abs().hi();
            assert!(is_ratio || turned <= 1e-24 * size * speed, "ṡ'' = −e ṡ' is off by {turned:e}: {}", tree.name);
        }
    }
    assert!(compared > 50, "{compared} contacts");
}
