//! Dual numbers against closed forms.

use straightline_core::reverse::{Recorded, Recording};
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

/// By the rate of its angle a turn changes as by the slopes of sine and cosine: forwards, backwards, and once more.
#[test]
fn a_turn_changes_by_a_quarter_turn_of_its_result() {
    /// Both components of a turn by the sum of two angles, one of them the other way.
    fn turned<T: Real>([x, y, a, b]: [T; 4], knows: bool) -> [T; 2] {
        let turning =
            knows.then(|| [a, -b].into_iter().filter_map(T::turning).reduce(|sum, term| sum + term)).flatten();
        T::turned_about([x, y], Real::sin_cos_of_sum(&[a, -b]), turning)
    }
    fn agree(found: &[f64], expected: &[f64]) {
        assert!(found.iter().zip(expected).all(|(f, e)| close(*f, *e)), "{found:?} is not {expected:?}");
    }
    let at = [0.7, -1.9, 0.4, 2.3];
    let forwards = |knows: bool| {
        let numbers: [Dual<f64, 4>; 4] = std::array::from_fn(|k| Dual::variable(at[k], k));
        turned(numbers, knows).map(|x| [&[x.value][..], &x.derivatives].concat()).concat()
    };
    agree(&forwards(true), &forwards(false));
    fn backwards<T: Real>(at: [T; 4], knows: bool) -> [T; 4] {
        let recording = Recording::new();
        let numbers: [Recorded<'_, T>; 4] = at.map(|x| recording.variable(x));
        let [x, y] = turned(numbers, knows);
        let slopes = recording.gradient(&[(x, T::constant(Dd::from(1.5))), (y, T::constant(Dd::from(-0.25)))]);
        numbers.map(|x| slopes.by(x))
    }
    agree(&backwards(at, true), &backwards(at, false));
    let second = |knows: bool| {
        let numbers: [Dual<f64, 4>; 4] = std::array::from_fn(|k| Dual::variable(at[k], k));
        backwards(numbers, knows).map(|slope| slope.derivatives).concat()
    };
    agree(&second(true), &second(false));
    // one number alone knows nothing
    assert_eq!(turned(at, true), turned(at, false));
}
