//! What the ellipsoids are.

use super::robots::{arm, body};
use straightline_core::model::{JointKind, Load};
use straightline_core::spatial::{SpatialInertia, Sym3, Transform, Vec3};
use straightline_view::ellipsoid::inertia_ellipsoid;

fn numbers(of: &SpatialInertia<f64>) -> [f64; 9] {
    let (c, j) = (of.com, of.inertia_com);
    [c.x, c.y, c.z, j.xx, j.xy, j.xz, j.yy, j.yz, j.zz]
}

fn assert_same(found: &SpatialInertia<f64>, expected: &SpatialInertia<f64>) {
    let pairs = numbers(found).into_iter().zip(numbers(expected));
    // eigenvalues are to a few roundings of the greatest
    pairs.into_iter().for_each(|(a, b)| assert!((a - b).abs() < 1e-14, "{found:?}\n{expected:?}"));
}

#[test]
fn an_ellipsoid_of_uniform_density_has_the_inertia_of_its_body() {
    for body in &arm().bodies {
        let ellipsoid = inertia_ellipsoid(body).expect("it has mass");
        assert_same(&ellipsoid.inertia(body.inertia.mass), &body.inertia);
        let length: f64 = ellipsoid.turn.iter().map(|x| x * x).sum();
        assert!((length - 1.0).abs() < 1e-14);
    }
}

#[test]
fn the_semi_axes_of_a_principal_inertia_are_those_of_the_formula() {
    let mut body = body("bob", None, JointKind::Revolute, (0, 0), Transform::identity());
    let (i1, i2, i3, m) = (0.03, 0.05, 0.04, 3.0);
    let diagonal = Sym3 { xx: i1, xy: 0.0, xz: 0.0, yy: i2, yz: 0.0, zz: i3 };
    body.inertia = SpatialInertia::new(m, Vec3::new(0.1, 0.2, 0.3), diagonal);
    let mut found = inertia_ellipsoid(&body).unwrap().semi_axes;
    let mut expected = [i2 + i3 - i1, i3 + i1 - i2, i1 + i2 - i3].map(|x: f64| (5.0 / (2.0 * m) * x).sqrt());
    found.sort_by(f64::total_cmp);
    expected.sort_by(f64::total_cmp);
    found.iter().zip(expected).for_each(|(a, b)| assert!((a - b).abs() < 1e-15, "{found:?} {expected:?}"));
}

#[test]
fn a_payload_belongs_to_the_ellipsoid() {
    let mut body = body("bob", None, JointKind::Revolute, (0, 0), Transform::identity());
    let payload = SpatialInertia::new(
        0.7,
        Vec3::new(-0.1, 0.3, 0.2),
        Sym3 { xx: 0.002, xy: 0.0005, xz: 0.0, yy: 0.003, yz: -0.0002, zz: 0.0025 },
    );
    body.carry(Load { mass: payload.mass, first_moment: payload.first_moment, second_moment: payload.second_moment });
    let found = inertia_ellipsoid(&body).unwrap().inertia(2.7);
    // two bodies as one: m c and Σ about the origin add up
    let (one, two) = (&body.inertia, &payload);
    let first = one.first_moment + two.first_moment;
    assert!(numbers(&found)[..3].iter().zip(first.scale(1.0 / 2.7).to_array()).all(|(a, b)| (a - b).abs() < 1e-15));
    let second = one.second_moment + two.second_moment;
    let rows = [
        (found.second_moment.xx, second.xx),
        (found.second_moment.xy, second.xy),
        (found.second_moment.yz, second.yz),
        (found.second_moment.zz, second.zz),
    ];
    rows.iter().for_each(|(a, b)| assert!((a - b).abs() < 1e-14, "{found:?} {second:?}"));
}

#[test]
fn what_has_no_mass_has_no_ellipsoid_and_a_point_mass_has_a_point() {
    let mut body = body("bob", None, JointKind::Revolute, (0, 0), Transform::identity());
    body.inertia = SpatialInertia::zero();
    assert_eq!(inertia_ellipsoid(&body), None);
    body.inertia = SpatialInertia::new(0.5, Vec3::new(0.0, 0.25, 0.0), Sym3::zero());
    let point = inertia_ellipsoid(&body).unwrap();
    assert_eq!((point.center, point.semi_axes), ([0.0, 0.25, 0.0], [0.0; 3]));
    // what no rigid body can have: I₃ > I₁ + I₂
    body.inertia =
        SpatialInertia::new(0.5, Vec3::zero(), Sym3 { xx: 0.01, xy: 0.0, xz: 0.0, yy: 0.02, yz: 0.0, zz: 0.05 });
    assert!(inertia_ellipsoid(&body).unwrap().semi_axes.contains(&0.0));
}
