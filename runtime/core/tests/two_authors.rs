//! Two authors, one physics: the algorithms, in canonical joint frames, and the reference, in mass centres and the
//! external frame, agree in double-double on random chains and trees.

mod support;

use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;
use straightline_core::algorithms;
use straightline_core::model::{self, Body, Frame, JointKind, Limits, Model};
use straightline_core::reference::{self, unit, ExtendedPosition, Joint, MassCentreTree};
use straightline_core::spatial::{Mat3, SpatialInertia, Sym3, Transform, Vec3};
use straightline_core::Dd;
use support::robots::{random_position, random_robot, Random, RobotKind};

/// Against the scale of each quantity. Double-double has 1.2e-32, the worst seen is 3e-30 (`--nocapture` prints it).
const TOLERANCE: f64 = 2e-29;

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

/// Worst disagreement of every quantity, and where.
#[derive(Default)]
struct Disagreement {
    worst: BTreeMap<&'static str, (f64, String)>,
}

impl Disagreement {
    /// `scale`: of every component, or one for all. A scale can itself be rounding noise, as where a linear joint on the
    /// base moves uniformly and nothing else: it counts as a thousandth of the largest at least.
    fn compare(&mut self, what: &'static str, robot: &str, a: &[Dd], b: &[Dd], scale: &[Dd]) {
        assert_eq!(a.len(), b.len(), "{what} of {robot}");
        let least = 1e-3 * scale.iter().fold(0.0, |m: f64, x| m.max(x.abs().hi()));
        for i in 0..a.len() {
            let scale = scale[i % scale.len()].abs().hi().max(least);
            let error = (a[i] - b[i]).abs().hi();
            let relative = if error == 0.0 { 0.0 } else { error / scale };
            let worst = self.worst.entry(what).or_insert((0.0, String::new()));
            if relative > worst.0 || relative.is_nan() {
                *worst = (relative, robot.to_string());
            }
        }
    }

    /// The scale is the largest value, at least 1.
    fn compare_group(&mut self, what: &'static str, robot: &str, a: &[Dd], b: &[Dd]) {
        let largest = b.iter().fold(Dd::ONE, |m, x| if x.abs().hi() > m.hi() { x.abs() } else { m });
        self.compare(what, robot, a, b, &[largest]);
    }
}

fn array(v: &Vec3<Dd>) -> [Dd; 3] {
    [v.x, v.y, v.z]
}

fn columns(m: &Mat3<Dd>) -> Vec<Dd> {
    (0..3).flat_map(|k| array(&m.column(k))).collect()
}

fn compare_all(disagreement: &mut Disagreement, random: &mut Random, kind: RobotKind, seed: u64) {
    let mut tree = random_robot(random, kind);
    if random.below(3) == 0 {
        shuffle_coordinates(random, &mut tree);
    }
    let tree = tree;
    let model = canonical(random, &tree);
    let robot = format!("{kind:?}, seed {seed}");
    let n = tree.nv();
    let q = random_position(random, &tree);
    let (qd, qdd, tau) = (random.list(n, 2.0), random.list(n, 3.0), random.list(n, 10.0));
    let rest = vec![Dd::ZERO; n];
    let weightless = MassCentreTree { gravity: Vector3::zeros(), ..tree.clone() };
    let d = disagreement;

    let scale = reference::natural_scale(&tree, &q, &qd, &qdd);
    let expected = reference::inverse_dynamics(&tree, &q, &qd, &qdd);
    let computed = algorithms::inverse_dynamics(&model, &q, &qd, &qdd);
    d.compare("tau", &robot, &computed, expected.as_slice(), scale.as_slice());
    let expected = reference::dalembert_inverse_dynamics(&tree, &q, &qd, &qdd);
    d.compare("tau by D'Alembert", &robot, &computed, expected.as_slice(), scale.as_slice());
    let scale = reference::natural_scale(&tree, &q, &qd, &rest);
    let expected = reference::bias_force(&tree, &q, &qd);
    d.compare("h", &robot, &algorithms::bias_force(&model, &q, &qd), expected.as_slice(), scale.as_slice());
    let scale = reference::natural_scale(&tree, &q, &rest, &rest);
    let expected = reference::gravity_force(&tree, &q);
    d.compare("g", &robot, &algorithms::gravity_force(&model, &q), expected.as_slice(), scale.as_slice());
    let scale = reference::natural_scale(&weightless, &q, &qd, &rest);
    let expected = reference::velocity_force(&tree, &q, &qd);
    d.compare("C", &robot, &algorithms::velocity_force(&model, &q, &qd), expected.as_slice(), scale.as_slice());

    let expected = reference::mass_matrix(&tree, &q);
    let computed = algorithms::mass_matrix(&model, &q);
    d.compare_group("H", &robot, &computed, expected.as_slice());
    let scale = reference::forward_natural_scale(&tree, &q, &qd, &tau);
    let expected = reference::forward_dynamics(&tree, &q, &qd, &tau);
    let computed = algorithms::forward_dynamics_aba(&model, &q, &qd, &tau);
    d.compare("qdd (ABA)", &robot, &computed, expected.as_slice(), scale.as_slice());
    let computed = algorithms::forward_dynamics_ltdl(&model, &q, &qd, &tau);
    d.compare("qdd (LTDL)", &robot, &computed, expected.as_slice(), scale.as_slice());

    // one wrench per joint, in the order of the velocity coordinates
    let mut order: Vec<usize> = (0..tree.links.len()).collect();
    order.sort_by_key(|&j| tree.links[j].iv);
    let wrenches = reference::joint_wrenches(&tree, &q, &qd, &qdd);
    let expected: Vec<Dd> = order.iter().flat_map(|&j| wrenches[j]).collect();
    let computed: Vec<Dd> = algorithms::joint_wrenches(&model, &q, &qd, &qdd)
        .iter()
        .flat_map(|wrench| [array(&wrench.force), array(&wrench.moment)].concat())
        .collect();
    d.compare_group("wrench", &robot, &computed, &expected);

    let expected = [reference::kinetic_energy(&tree, &q, &qd), reference::potential_energy(&tree, &q)];
    let computed = [algorithms::kinetic_energy(&model, &q, &qd), algorithms::potential_energy(&model, &q)];
    d.compare_group("energy", &robot, &computed, &expected);

    let expected = reference::momentum(&tree, &q, &qd);
    let computed = algorithms::momentum(&model, &q, &qd);
    let com = reference::centre_of_mass(&tree, &q);
    d.compare_group("mass centre", &robot, &array(&computed.com), com.as_slice());
    d.compare_group("linear momentum", &robot, &array(&computed.linear), expected.linear.as_slice());
    let angular = expected.angular_about_mass_centre;
    d.compare_group("angular momentum", &robot, &array(&computed.angular), angular.as_slice());

    for (frame, same) in tree.frames.iter().zip(&model.frames) {
        let expected = reference::frame_pose(&tree, frame, &q);
        let computed = &algorithms::forward_kinematics(&model, &q, &[same])[0];
        d.compare_group("p", &robot, &array(&computed.translation), expected.position.as_slice());
        d.compare_group("R", &robot, &columns(&computed.rotation), expected.rotation.as_slice());
        let expected = reference::frame_jacobian(&tree, frame, &q).transpose();
        d.compare_group("J", &robot, &algorithms::jacobian(&model, &q, same), expected.as_slice());
        let expected = reference::frame_jacobian_bias(&tree, frame, &q, &qd);
        let computed = algorithms::jacobian_bias(&model, &q, &qd, same);
        let computed = [array(&computed.linear), array(&computed.angular)].concat();
        d.compare_group("Jdqd", &robot, &computed, expected.as_slice());
        let expected = reference::frame_velocity(&tree, frame, &q, &qd);
        let computed = algorithms::frame_velocity(&model, &q, &qd, same);
        let computed = [array(&computed.linear), array(&computed.angular)].concat();
        d.compare_group("frame velocity", &robot, &computed, expected.as_slice());
        let expected = reference::frame_acceleration(&tree, frame, &q, &qd, &qdd);
        let computed = algorithms::frame_acceleration(&model, &q, &qd, &qdd, same);
        let computed = [array(&computed.linear), array(&computed.angular)].concat();
        d.compare_group("frame acceleration", &robot, &computed, expected.as_slice());
    }
}

/// `count` random robots of a kind, up to `links` links.
fn compare_robots(branched: bool, floating: bool, count: u64, links: usize) {
    let mut disagreement = Disagreement::default();
    for seed in 0..count {
        let mut random = Random(seed);
        let kind = RobotKind { links: 1 + random.below(links), branched, floating };
        compare_all(&mut disagreement, &mut random, kind, seed);
    }
    for (what, (error, _)) in &disagreement.worst {
        println!("{what:20} {error:.1e}");
    }
    for (what, (error, robot)) in &disagreement.worst {
        assert!(*error <= TOLERANCE, "{what}: {error:e} of the scale, {robot}");
    }
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
