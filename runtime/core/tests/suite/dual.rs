//! Dual numbers against closed forms.

use straightline_core::{Dd, Dual, Real};

type D = Dual<f64, 2>;

/// A few roundings of numbers near one.
fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 8.0 * f64::EPSILON * b.abs().max(1.0)
}

#[test]
fn every_operation_has_its_derivative() {
    let (a, b) = (0.7, 1.9);
    let (x, y) = (D::variable(a, 0), D::variable(b, 1));
    let cases: [(D, f64, [f64; 2]); 8] = [
        (x + y, a + b, [1.0, 1.0]),
        (x - y, a - b, [1.0, -1.0]),
        (x * y, a * b, [b, a]),
        (x / y, a / b, [1.0 / b, -a / (b * b)]),
        (-x, -a, [-1.0, 0.0]),
        ((x * y).sqrt(), (a * b).sqrt(), [0.5 * (b / a).sqrt(), 0.5 * (a / b).sqrt()]),
        ((x * y).sin_cos().0, (a * b).sin(), [b * (a * b).cos(), a * (a * b).cos()]),
        ((x * x / y).sin_cos().1, (a * a / b).cos(), {
            let slope = -(a * a / b).sin();
            [slope * 2.0 * a / b, -slope * a * a / (b * b)]
        }),
    ];
    for (i, (found, value, derivatives)) in cases.into_iter().enumerate() {
        assert!(close(found.value, value), "case {i}: {found:?}");
        assert!(found.derivatives.iter().zip(derivatives).all(|(d, e)| close(*d, e)), "case {i}: {found:?}");
    }
    assert_eq!((-x * y).sign(), D::fixed(-1.0));
    assert_eq!(D::constant(Dd::from(2.5)), D::fixed(2.5));
}

#[test]
fn nested_once_more_they_have_second_derivatives() {
    type Second = Dual<Dual<f64, 1>, 1>;
    let a = 0.4;
    let x: Second = Dual::variable(Dual::variable(a, 0), 0);
    // (x sin x)'' = 2 cos x − x sin x
    let f = x * x.sin_cos().0;
    assert!(close(f.derivatives[0].derivatives[0], 2.0 * a.cos() - a * a.sin()), "{f:?}");
}

/// A rounded sum would be 1e-11 off.
#[test]
fn sums_of_far_angles_keep_value_and_derivatives() {
    let (a, b) = (100_000.125, -0.7);
    let angles = [D::variable(a, 0), D::variable(b, 1)];
    let (sin, cos) = Real::sin_cos_of_sum(&angles);
    let (s, c) = Real::sin_cos_of_sum(&[a, b]);
    assert_eq!((sin, cos), (D { value: s, derivatives: [c, c] }, D { value: c, derivatives: [-s, -s] }));
    let ([sin], [cos]) = D::sin_cos_lanes_of_pairs([D::sum_of_angles(&angles[..1])]);
    assert_eq!((sin, cos), angles[0].sin_cos());
}
