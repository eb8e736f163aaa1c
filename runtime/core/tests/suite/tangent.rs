//! Displacements along the tangent and what carries tangents along: values with 25 digits, the second author, and identities, at angles of any size.

use crate::support::data::{inputs, numbers, reference_file};
use nalgebra::{Matrix3, Vector3};
use serde_json::Value;
use straightline_core::algorithms::{
    difference, difference_maps, displacement_rate, displacement_rate_maps, integrate, integrate_maps,
};
use straightline_core::joint::FLOATING_BASE;
use straightline_core::model::{Body, Joint, JointEffects, JointKind, Limits, Model};
use straightline_core::random::Random;
use straightline_core::reference::{self, CentreOfMassLink, CentreOfMassTree, ExtendedPosition, ReferenceJoint};
use straightline_core::spatial::{SpatialInertia, Sym3, Transform, Vec3};
use straightline_core::{Dd, Dual, Real};

/// A free body that carries so many joints, by both authors.
fn robot<T: Real>(joints: usize) -> Model<T> {
    let body = |k: usize| {
        let (kind, iq, iv) = match k {
            0 => (FLOATING_BASE, 0, 0),
            _ => (JointKind::Revolute, 6 + k, 5 + k),
        };
        Body {
            name: format!("body{k}"),
            parent: k.checked_sub(1),
            joint: Joint { name: format!("joint{k}"), kind, iq, iv, limits: Limits::default() },
            placement: Transform::identity(),
            inertia: SpatialInertia::new(T::one(), Vec3::zero(), Sym3::zero()),
            link_frame: Transform::identity(),
            dense: false,
            effects: JointEffects::none(),
            load: None,
        }
    };
    let bodies = (0..=joints).map(body).collect();
    Model {
        name: "free".into(),
        bodies,
        gravity: Vec3::zero(),
        couplings: vec![],
        closure: Default::default(),
        frames: vec![],
        drives: vec![],
        base_parameters: Default::default(),
    }
}

fn tree(joints: usize) -> CentreOfMassTree<Dd> {
    let free = CentreOfMassLink::free("body0".into(), Dd::ONE, Matrix3::identity(), Vector3::zeros());
    let link = |k: usize| CentreOfMassLink {
        name: format!("body{k}"),
        parent: Some(k - 1),
        joint: ReferenceJoint::Revolute,
        iq: 6 + k,
        iv: 5 + k,
        shared: None,
        mass: Dd::ONE,
        inertia: Matrix3::identity(),
        e: Vector3::z(),
        e_parent: Vector3::z(),
        r: Vector3::x(),
        r_parent: Vector3::zeros(),
        extended: ExtendedPosition::Matrix(Matrix3::identity()),
    };
    let links = [free].into_iter().chain((1..=joints).map(link)).collect();
    CentreOfMassTree { name: "free".into(), gravity: Vector3::zeros(), links, frames: vec![] }
}

fn cast<T: Real>(x: &[Dd]) -> Vec<T> {
    x.iter().map(|x| T::constant(*x)).collect()
}

/// The greatest difference over the greatest entry.
fn error<T: Copy + Into<Dd>>(found: &[T], expected: &[Dd]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let greatest = expected.iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
    let off = found.iter().zip(expected).map(|(a, b)| ((*a).into() - *b).to_f64().abs());
    let off = off.fold(0.0, |m: f64, x| if x <= m { m } else { x });
    match off {
        _ if off.is_nan() => f64::INFINITY,
        off if greatest > 0.0 => off / greatest,
        off => off,
    }
}

/// All blocks of a case of the data: what is found, by name.
fn blocks<T: Real>(case: &Value) -> Vec<(&'static str, Vec<T>)> {
    let [q, v, q1] = ["q", "v", "q1"].map(|name| cast::<T>(&inputs(&case[name])));
    let (model, nv) = (robot::<T>(v.len() - 6), v.len());
    let d = difference(&model, &q, &q1);
    let [dq, dv] = integrate_maps(&model, &v);
    let [dq0, dq1] = difference_maps(&model, &d);
    vec![
        ("q_plus_v", integrate(&model, &q, &v)),
        ("dintegrate_dq", dq.matrix(nv)),
        ("dintegrate_dv", dv.matrix(nv)),
        ("difference", d),
        ("ddifference_dq0", dq0.matrix(nv)),
        ("ddifference_dq1", dq1.matrix(nv)),
    ]
}

fn hold_data<T: Real + Into<Dd>>(most: f64) {
    let (mut cases, mut worst) = (0, vec![(0.0, String::new()); 6]);
    for name in ["hyq", "solo12"] {
        let file = std::fs::read_to_string(reference_file(&format!("derivatives/{name}.json"))).expect("the data");
        let file: Value = serde_json::from_str(&file).expect("JSON");
        for (i, case) in file["integrate"].as_array().expect("a list").iter().enumerate() {
            for (k, (block, found)) in blocks::<T>(case).into_iter().enumerate() {
                let error = error(&found, &numbers(&case[block]));
                if error >= worst[k].0 {
                    worst[k] = (error, format!("{block} of {name}/{i}, {}", case["kind"]));
                }
                cases += 1;
            }
        }
    }
    assert_eq!(cases, 2 * 16 * 6);
    worst.iter().for_each(|(error, place)| println!("{error:9.1e}  {place}"));
    assert!(worst.iter().all(|(error, _)| *error <= most), "beyond {most:e}: {worst:?}");
}

#[test]
fn displacements_and_their_derivatives_are_those_of_the_data() {
    // which have 25 digits
    hold_data::<Dd>(1e-24);
}

#[test]
fn displacements_in_f64_lose_a_few_roundings() {
    // nine units in the last place
    hold_data::<f64>(9.0 * f64::EPSILON);
}

/// Numbers of f32 in double-double.
#[derive(Clone, Copy)]
struct Short(f32);

impl From<Short> for Dd {
    fn from(x: Short) -> Dd {
        Dd::from(f64::from(x.0))
    }
}

/// Twists whose angle is about this.
fn twist(random: &mut Random, angle: f64) -> Vec<f64> {
    let w: Vec<f64> = (0..3).map(|_| random.symmetric(1.0)).collect();
    let length = w.iter().map(|x| x * x).sum::<f64>().sqrt();
    let linear = (0..3).map(|_| random.symmetric(1.0)).collect::<Vec<_>>();
    linear.into_iter().chain(w.into_iter().map(|x| x / length * angle)).collect()
}

fn pose(random: &mut Random) -> Vec<f64> {
    let quaternion: Vec<f64> = (0..4).map(|_| random.symmetric(1.0)).collect();
    let length = quaternion.iter().map(|x| x * x).sum::<f64>().sqrt();
    let position = (0..3).map(|_| random.symmetric(2.0)).collect::<Vec<_>>();
    position.into_iter().chain(quaternion.into_iter().map(|x| x / length)).collect()
}

const ANGLES: [f64; 19] = [
    0.0,
    1e-160,
    1e-30,
    1e-12,
    1e-8,
    1e-4,
    1e-2,
    0.1,
    0.5,
    1.0,
    1.5,
    1.99,
    2.0,
    2.01,
    2.5,
    3.0,
    std::f64::consts::PI - 1e-3,
    4.0,
    20.0,
];

fn wide(x: &[f64]) -> Vec<Dd> {
    x.iter().map(|x| Dd::from(*x)).collect()
}

/// All results at a displacement: q ⊕ v, both maps of it; the way back where it is less than half a turn, and its maps.
fn all<T: Real>(q: &[T], v: &[T], is_less_than_half_a_turn: bool) -> Vec<Vec<T>> {
    let model = robot::<T>(0);
    let [dq, dv] = integrate_maps(&model, v);
    let to = integrate(&model, q, v);
    let mut all = vec![to.clone(), dq.matrix(6), dv.matrix(6)];
    if is_less_than_half_a_turn {
        all.push(difference(&model, q, &to));
        all.extend(difference_maps(&model, v).map(|map| map.matrix(6)));
    }
    all
}

#[test]
fn angles_of_any_size_lose_a_few_roundings_in_every_format() {
    let mut random = Random(11);
    let mut worst = [0.0f64; 2];
    for angle in ANGLES {
        for _ in 0..20 {
            let (q, v) = (pose(&mut random), twist(&mut random, angle));
            let less = angle < 3.13;
            let exact = all::<Dd>(&wide(&q), &wide(&v), less);
            for (k, (found, exact)) in all::<f64>(&q, &v, less).iter().zip(&exact).enumerate() {
                let error = error(found, exact);
                worst[0] = worst[0].max(error);
                // what is left of an angle is off by as much of a turn as the angle is long
                assert!(
                    error < (12.0 + angle) * f64::EPSILON,
                    "result {k} at an angle of {angle}: {error:e} in f64 of {q:?}, {v:?}"
                );
            }
            let [q, v] = [q, v].map(|x| x.into_iter().map(|x| x as f32).collect::<Vec<f32>>());
            let [wide_q, wide_v] = [&q, &v].map(|x| x.iter().map(|x| Dd::from(f64::from(*x))).collect::<Vec<_>>());
            let exact = all::<Dd>(&wide_q, &wide_v, less);
            for (k, (found, exact)) in all::<f32>(&q, &v, less).iter().zip(&exact).enumerate() {
                let error = error(&found.iter().map(|x| Short(*x)).collect::<Vec<_>>(), exact);
                worst[1] = worst[1].max(error);
                assert!(
                    error < (12.0 + angle) * f64::from(f32::EPSILON),
                    "result {k} at an angle of {angle}: {error:e} in f32 of {q:?}, {v:?}"
                );
            }
        }
    }
    println!("worst: {:.1e} in f64, {:.1e} in f32", worst[0], worst[1]);
}

#[test]
fn both_authors_displace_alike() {
    let (model, tree, mut random) = (robot::<Dd>(2), tree(2), Random(3));
    for angle in ANGLES {
        for _ in 0..5 {
            let joints = || [Dd::from(0.3), Dd::from(-2.0)];
            let mut q = wide(&pose(&mut random));
            let mut v = wide(&twist(&mut random, angle));
            q.extend(joints());
            v.extend(joints());
            let (to, other) = (integrate(&model, &q, &v), reference::displaced(&tree, &q, &v));
            assert!(error(&to, &other) < 1e-27, "at {angle}: {to:?}, {other:?}");
            // also more than half a turn away, and from the other quaternion of the same pose
            let opposite: Vec<Dd> =
                to.iter().enumerate().map(|(k, x)| if (3..7).contains(&k) { -*x } else { *x }).collect();
            for to in [to, opposite] {
                let (back, other) = (difference(&model, &q, &to), reference::displacement(&tree, &q, &to));
                assert!(error(&back, &other) < 1e-27, "back from {angle}: {back:?}, {other:?}");
            }
        }
    }
}

fn seeded(x: &[Dd], rates: &[Dd]) -> Vec<Dual<Dd, 1>> {
    x.iter().zip(rates).map(|(x, rate)| Dual { value: *x, derivatives: [*rate] }).collect()
}

/// The columns of a map of the tangent, from what it makes of unit vectors.
fn by_columns(nv: usize, column: impl Fn(&[Dd]) -> Vec<Dd>) -> Vec<Dd> {
    let unit = |k: usize| (0..nv).map(|i| if i == k { Dd::ONE } else { Dd::ZERO }).collect::<Vec<_>>();
    let columns: Vec<Vec<Dd>> = (0..nv).map(|k| column(&unit(k))).collect();
    (0..nv).flat_map(|i| columns.iter().map(move |column| column[i])).collect()
}

fn split(x: &[Dual<Dd, 1>]) -> [Vec<Dd>; 2] {
    [x.iter().map(|x| x.value).collect(), x.iter().map(|x| x.derivatives[0]).collect()]
}

/// By dual numbers through the second author's exponentials.
#[test]
fn derivatives_of_displacements_are_those_of_the_second_author() {
    let (model, tree, mut random) = (robot::<Dd>(1), tree(1), Random(5));
    let dual = tree.map(Dual::<Dd, 1>::fixed);
    for angle in ANGLES.into_iter().filter(|angle| *angle > 1e-20) {
        let (mut q, mut v) = (wide(&pose(&mut random)), wide(&twist(&mut random, angle)));
        FLOATING_BASE.normalise(&mut q);
        q.push(Dd::from(0.4));
        v.push(Dd::from(-1.3));
        let moved = |x: &[Dd], direction: &[Dd]| seeded(x, &model.configuration_rate(x, direction));
        let increment = |to: &[Dual<Dd, 1>]| {
            let [value, rate] = split(to);
            reference::increment(&tree, &value, &rate)
        };
        let held = |x: &[Dd]| seeded(x, &vec![Dd::ZERO; x.len()]);
        let to = integrate(&model, &q, &v);
        let [dq, dv] = integrate_maps(&model, &v).map(|map| map.matrix(7));
        let expected = [
            by_columns(7, |unit| increment(&reference::displaced(&dual, &moved(&q, unit), &held(&v)))),
            by_columns(7, |unit| increment(&reference::displaced(&dual, &held(&q), &seeded(&v, unit)))),
        ];
        for (found, expected) in [dq, dv].iter().zip(&expected) {
            assert!(error(found, expected) < 1e-26, "at {angle}: {found:?}, {expected:?}");
        }
        if angle > std::f64::consts::PI {
            continue;
        }
        let back = |q: &[Dual<Dd, 1>], to: &[Dual<Dd, 1>]| split(&reference::displacement(&dual, q, to))[1].clone();
        let [dq0, dq1] = difference_maps(&model, &v).map(|map| map.matrix(7));
        let expected = [
            by_columns(7, |unit| back(&moved(&q, unit), &held(&to))),
            by_columns(7, |unit| back(&held(&q), &moved(&to, unit))),
        ];
        for (found, expected) in [dq0, dq1].iter().zip(&expected) {
            assert!(error(found, expected) < 1e-26, "back at {angle}: {found:?}, {expected:?}");
        }
    }
}

#[test]
fn the_way_back_is_the_way_there_and_carrying_tangents_composes() {
    let (model, mut random) = (robot::<Dd>(0), Random(8));
    for angle in ANGLES.into_iter().filter(|angle| *angle < 3.13) {
        let q = wide(&pose(&mut random));
        let [v, further] = [angle, 0.7].map(|angle| wide(&twist(&mut random, angle)));
        let to = integrate(&model, &q, &v);
        let back = difference(&model, &q, &to);
        assert!(error(&back, &v) < 1e-29, "{angle}: {back:?}, {v:?}");
        // there and on is one displacement, and tangents are carried along it as along both
        let end = integrate(&model, &to, &further);
        let [whole, _] = integrate_maps(&model, &difference(&model, &q, &end));
        let [first, _] = integrate_maps(&model, &v);
        let [second, _] = integrate_maps(&model, &further);
        let both = second.times(&first.matrix(6), 6);
        assert!(error(&whole.matrix(6), &both) < 1e-28, "{angle}");
        // the derivatives of the way back are the inverses of those of the way there
        let ([dq, dv], [dq0, dq1]) = (integrate_maps(&model, &v), difference_maps(&model, &v));
        let unit = by_columns(6, |unit| unit.to_vec());
        assert!(error(&dq1.times(&dv.matrix(6), 6), &unit) < 1e-29, "{angle}");
        let minus: Vec<Dd> = dq1.times(&dq.matrix(6), 6).into_iter().map(|x| -x).collect();
        assert!(error(&dq0.matrix(6), &minus) < 1e-29, "{angle}");
    }
}

/// A turning joint between two ball joints, on the world, by both authors.
fn robot_with_balls<T: Real>() -> Model<T> {
    let mut model = robot::<T>(2);
    for (body, (kind, iq, iv)) in model.bodies.iter_mut().zip([
        (JointKind::Spherical, 0, 0),
        (JointKind::Revolute, 4, 3),
        (JointKind::Spherical, 5, 4),
    ]) {
        body.joint = Joint { kind, iq, iv, ..body.joint.clone() };
    }
    model
}

fn tree_with_balls() -> CentreOfMassTree<Dd> {
    let mut tree = tree(2);
    let turning = tree.links[1].clone();
    tree.links[0] = CentreOfMassLink { parent: None, ..turning.clone() };
    for link in [0, 2] {
        tree.links[link].joint = ReferenceJoint::Ball;
    }
    tree.number_coordinates();
    tree
}

/// A configuration of that robot, and a displacement whose turns are through about this angle.
fn turned_balls(random: &mut Random, angle: f64) -> [Vec<Dd>; 2] {
    let [a, b] = [0; 2].map(|_| pose(random)[3..].to_vec());
    let [u, v] = [0; 2].map(|_| twist(random, angle)[3..].to_vec());
    let mut q = wide(&[a, vec![0.4], b].concat());
    let model = robot_with_balls::<Dd>();
    for joint in model.bodies.iter().map(|body| &body.joint) {
        joint.kind.normalise(&mut q[joint.iq..joint.iq + joint.kind.nq()]);
    }
    [q, wide(&[u, vec![-1.3], v].concat())]
}

/// As of a floating base, whose angles they are; forth and back, from either quaternion of a pose, and derivatives by dual numbers.
#[test]
fn both_authors_displace_ball_joints_alike() {
    let (model, tree, mut random) = (robot_with_balls::<Dd>(), tree_with_balls(), Random(14));
    let dual = tree.map(Dual::<Dd, 1>::fixed);
    for angle in ANGLES.into_iter().filter(|angle| *angle > 1e-20) {
        let [q, v] = turned_balls(&mut random, angle);
        let (to, other) = (integrate(&model, &q, &v), reference::displaced(&tree, &q, &v));
        assert!(error(&to, &other) < 1e-27, "at {angle}: {to:?}, {other:?}");
        let opposite: Vec<Dd> = to.iter().enumerate().map(|(k, x)| if k < 4 { -*x } else { *x }).collect();
        for to in [&to, &opposite] {
            let (back, other) = (difference(&model, &q, to), reference::displacement(&tree, &q, to));
            assert!(error(&back, &other) < 1e-27, "back from {angle}: {back:?}, {other:?}");
        }
        let moved = |x: &[Dd], direction: &[Dd]| seeded(x, &model.configuration_rate(x, direction));
        let increment = |to: &[Dual<Dd, 1>]| {
            let [value, rate] = split(to);
            reference::increment(&tree, &value, &rate)
        };
        let held = |x: &[Dd]| seeded(x, &vec![Dd::ZERO; x.len()]);
        let expected = [
            by_columns(7, |unit| increment(&reference::displaced(&dual, &moved(&q, unit), &held(&v)))),
            by_columns(7, |unit| increment(&reference::displaced(&dual, &held(&q), &seeded(&v, unit)))),
        ];
        for (found, expected) in integrate_maps(&model, &v).iter().zip(&expected) {
            assert!(error(&found.matrix(7), expected) < 1e-26, "at {angle}");
        }
        if angle < std::f64::consts::PI {
            let back = |q: &[Dual<Dd, 1>], to: &[Dual<Dd, 1>]| split(&reference::displacement(&dual, q, to))[1].clone();
            let expected = [
                by_columns(7, |unit| back(&moved(&q, unit), &held(&to))),
                by_columns(7, |unit| back(&held(&q), &moved(&to, unit))),
            ];
            for (found, expected) in difference_maps(&model, &v).iter().zip(&expected) {
                assert!(error(&found.matrix(7), expected) < 1e-26, "back at {angle}");
            }
        }
    }
}

/// J_r⁻¹(u) q̇, of which ad⁴/720 is left out, and its derivatives by dual numbers.
#[test]
fn rates_of_displacements_are_those_of_the_logarithm_to_the_fourth_power() {
    let (model, mut random) = (robot::<Dd>(0), Random(21));
    let [u, qd] = [0.01, 1.0].map(|angle| wide(&twist(&mut random, angle)));
    let u: Vec<Dd> = u.iter().enumerate().map(|(k, x)| if k < 3 { *x * Dd::from(0.01) } else { *x }).collect();
    let rate = displacement_rate(&model, &u, &qd);
    let [_, exact] = difference_maps(&model, &u);
    let off = error(&rate, &exact.times(&qd, 1));
    assert!(off < 1e-8 / 720.0 * 4.0 && off > 1e-13, "{off:e}");
    let dual = robot::<Dual<Dd, 1>>(0);
    let [by_qd, by_u] = displacement_rate_maps(&model, &u, &qd).map(|map| map.matrix(6));
    let none = vec![Dd::ZERO; 6];
    let slope = |du: &[Dd], dqd: &[Dd]| split(&displacement_rate(&dual, &seeded(&u, du), &seeded(&qd, dqd)))[1].clone();
    assert!(error(&by_qd, &by_columns(6, |unit| slope(&none, unit))) < 1e-30);
    assert!(error(&by_u, &by_columns(6, |unit| slope(unit, &none))) < 1e-30);
}

/// A quaternion that is not of length one counts as the one that is.
#[test]
fn quaternions_count_as_of_length_one() {
    let (model, mut random) = (robot::<f64>(0), Random(2));
    let (q, v) = (pose(&mut random), twist(&mut random, 1.2));
    let stretched =
        |q: &[f64], k: f64| -> Vec<f64> { q.iter().enumerate().map(|(i, x)| if i > 2 { k * x } else { *x }).collect() };
    let (to, other) = (integrate(&model, &q, &v), integrate(&model, &stretched(&q, 3.0), &v));
    assert!(error(&other, &wide(&to)) < 1e-15);
    let (d, other) = (difference(&model, &q, &to), difference(&model, &stretched(&q, 0.3), &stretched(&to, -7.0)));
    assert!(error(&other, &wide(&d)) < 2e-15);
    let length = to[3..].iter().map(|x| x * x).sum::<f64>();
    assert!((length - 1.0).abs() < 1e-15, "{length}");
}

#[test]
fn no_displacement_is_exactly_none() {
    let model = robot::<f64>(1);
    let q = [0.5, -1.0, 2.0, 0.0, 0.6, 0.0, 0.8, 0.3];
    assert_eq!(integrate(&model, &q, &[0.0; 7]), q);
    assert_eq!(difference(&model, &q, &q), [0.0; 7]);
}
