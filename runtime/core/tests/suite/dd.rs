//! Double-double against arbitrary precision.
//!
//! `cargo test --release -p straightline-core --test suite dd:: -- --nocapture` prints the largest errors.

use crate::measure::{around_multiple, Random};
use dashu_float::round::mode::HalfEven;
use dashu_float::{DBig, FBig};
use std::str::FromStr;
use straightline_core::Dd;

type Big = FBig<HalfEven, 2>;

/// Enough for exact sums and products of what the tests multiply, and for angles next to multiples of π/2.
const BITS: usize = 600;

/// u² = 2^-106, the unit in which the literature bounds double-double.
const U2: f64 = 1.232_595_164_407_831e-32;

fn big(x: f64) -> Big {
    Big::try_from(x).expect("a finite number").with_precision(BITS).value()
}

fn exact(x: Dd) -> Big {
    big(x.hi()) + big(x.lo())
}

fn relative_error(computed: Dd, truth: &Big) -> f64 {
    if !computed.hi().is_finite() {
        return f64::INFINITY;
    }
    let error = ((exact(computed) - truth) / truth).to_f64().value().abs();
    assert!(computed.lo().abs() <= computed.hi().abs() * 2f64.powi(-53), "not normalised: {computed:?}");
    error
}

fn decimal(text: &str) -> Big {
    DBig::from_str(text)
        .expect("a decimal number")
        .with_rounding::<HalfEven>()
        .with_base_and_precision::<2>(BITS)
        .value()
}

/// Largest of `count` relative errors; prints it in u² under the name.
fn largest(name: &str, count: usize, mut error: impl FnMut(&mut Random) -> f64) -> f64 {
    let mut random = Random(name.len() as u64);
    let largest = (0..count).map(|_| error(&mut random)).fold(0.0, f64::max);
    println!("{name}: {:.2} u² = {largest:.2e}", largest / U2);
    largest
}

#[test]
fn sums_products_and_quotients_keep_the_bounds_of_the_literature() {
    // close exponents, so that additions cancel
    let pair = |r: &mut Random| (r.double_double(-3, 3), r.double_double(-3, 3));
    let sum = largest("a + b", 2_000, |r| {
        let (a, b) = pair(r);
        relative_error(a + b, &(exact(a) + exact(b)))
    });
    assert!(sum <= 3.0 * U2);
    let cancelled = largest("a - b, a near b", 2_000, |r| {
        let a = r.double_double(-3, 3);
        let b = a + a * Dd::from(r.uniform(-1.0, 1.0) * 2f64.powf(r.uniform(-100.0, 0.0)));
        let truth = exact(a) - exact(b);
        if truth == Big::ZERO {
            0.0
        } else {
            relative_error(a - b, &truth)
        }
    });
    assert!(cancelled <= 3.0 * U2);
    let product = largest("a b", 2_000, |r| {
        let (a, b) = (r.double_double(-400, 400), r.double_double(-400, 400));
        relative_error(a * b, &(exact(a) * exact(b)))
    });
    assert!(product <= 7.0 * U2);
    let quotient = largest("a / b", 2_000, |r| {
        let (a, b) = (r.double_double(-400, 400), r.double_double(-400, 400));
        relative_error(a / b, &(exact(a) / exact(b)))
    });
    assert!(quotient <= 15.0 * U2);
}

#[test]
fn products_and_quotients_work_next_to_overflow() {
    let error = largest("a b, a / b, a + a/2 up to 2^1022", 1_000, |r| {
        let (a, b) = (r.double_double(1000, 1020), r.double_double(0, 2));
        f64::max(
            relative_error(a * b, &(exact(a) * exact(b))),
            f64::max(
                relative_error(a / b, &(exact(a) / exact(b))),
                relative_error(a + a * Dd::HALF, &(exact(a) * big(1.5))),
            ),
        )
    });
    assert!(error <= 15.0 * U2);
}

#[test]
fn square_roots_are_within_1e_31() {
    let error = largest("sqrt", 2_000, |r| {
        let x = r.double_double(-960, 1023).abs();
        relative_error(x.sqrt(), &exact(x).sqrt())
    });
    assert!(error <= 1e-31);
    let two = Dd::from(2.0).sqrt();
    assert!((two - Dd::from_decimal("1.41421356237309504880168872420969807857").unwrap()).abs().to_f64() < 1e-31);
    assert_eq!(Dd::from(4.0).sqrt(), Dd::from(2.0));
    assert_eq!(Dd::ZERO.sqrt(), Dd::ZERO);
    assert_eq!(Dd::from(f64::INFINITY).sqrt().to_f64(), f64::INFINITY);
    assert!(Dd::from(-1e-300).sqrt().to_f64().is_nan() && Dd::from(f64::NAN).sqrt().to_f64().is_nan());
}

#[test]
fn sines_and_cosines_are_within_1e_31_of_their_size() {
    let sin_cos_error = |x: Dd| {
        let truth = exact(x).sin_cos();
        let (sin, cos) = x.sin_cos();
        f64::max(relative_error(sin, &truth.0), relative_error(cos, &truth.1))
    };
    for range in [1e-10, 0.8, 4.0, 1e3, 1e7] {
        let error = largest(&format!("sin and cos, |x| < {range:e}"), 150, |r| {
            let hi = r.uniform(-range, range);
            sin_cos_error(Dd::new(hi, hi * r.uniform(-1.0, 1.0) * 2f64.powi(-53)))
        });
        assert!(error <= 1e-31);
    }
    let error = largest("sin and cos, f64 next to multiples of π/2", 150, |r| {
        let largest_k = r.uniform(1.0, 22.0).exp2();
        let k = r.uniform(1.0, largest_k) as u32;
        around_multiple(k, 0).map(|x| sin_cos_error(Dd::from(x))).fold(0.0, f64::max)
    });
    assert!(error <= 1e-31);
    // the f64 below 1.6e6 that lies closest to a multiple of π/2, within 6.2e-19
    let error = largest("sin and cos, the hardest f64", 1, |_| {
        let hardest = (1..1 << 20).map(|k| around_multiple(k, 0).next().unwrap()).map(|x| {
            let (sin, cos) = Dd::from(x).sin_cos();
            (sin.abs().to_f64().min(cos.abs().to_f64()), x)
        });
        let (distance, x) = hardest.fold((1.0, 0.0), |a, b| if b.0 < a.0 { b } else { a });
        println!("{x:?} is {distance:.2e} from a multiple of π/2");
        sin_cos_error(Dd::from(x))
    });
    assert!(error <= 1e-31);
}

/// A double-double next to a multiple of π/2 is closer to it than any f64: the error stays below 1e-30 in absolute terms.
#[test]
fn sines_next_to_multiples_of_pi_are_within_1e_30() {
    let error = largest("sin and cos, absolute, Dd next to multiples of π/2", 150, |r| {
        let x = Dd::from(r.uniform(1.0, 6.3e6).floor()) * Dd::FRAC_PI_2;
        let (truth, (sin, cos)) = (exact(x).sin_cos(), x.sin_cos());
        let errors = [exact(sin) - truth.0, exact(cos) - truth.1].map(|e| e.to_f64().value().abs());
        errors[0].max(errors[1])
    });
    assert!(error <= 1e-30);
}

#[test]
fn angles_beyond_the_domain_give_nan() {
    for x in [1.4e7, -1e300, f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
        let (sin, cos) = Dd::from(x).sin_cos();
        assert!(sin.to_f64().is_nan() && cos.to_f64().is_nan(), "{x}");
    }
    assert_eq!(Dd::ZERO.sin_cos(), (Dd::ZERO, Dd::ONE));
}

#[test]
fn rounding_to_f32_happens_once() {
    let mut random = Random(4);
    for _ in 0..20_000 {
        let x = random.double_double(-125, 130);
        assert_eq!(x.to_f32(), exact(x).to_f32().value(), "{x:?}");
    }
    // a hair beside the middle of two f32 (subnormal ones too, and zero), which the nearest f64 hits exactly
    for _ in 0..20_000 {
        let bits = random.bits() as u32 % f32::MAX.to_bits();
        let low = f32::from_bits(if bits.is_multiple_of(3) { bits & 0xffff } else { bits });
        let middle = 0.5 * (f64::from(low) + f64::from(low.next_up()));
        let hair = middle * 1e-25;
        assert_eq!(Dd::new(middle, hair).to_f32(), low.next_up(), "{middle:e}");
        assert_eq!(Dd::new(middle, -hair).to_f32(), low, "{middle:e}");
        assert_eq!(Dd::new(-middle, -hair).to_f32(), -low.next_up(), "{middle:e}");
        assert_eq!(Dd::new(-middle, hair).to_f32(), -low, "{middle:e}");
        assert_eq!(Dd::from(middle).to_f32(), middle as f32, "{middle:e}");
    }
    assert_eq!(Dd::from(1e300).to_f32(), f32::INFINITY);
    assert_eq!(Dd::from(-0.0).to_f32().to_bits(), (-0.0f32).to_bits());
    assert!(Dd::from(f64::NAN).to_f32().is_nan());
}

#[test]
fn decimal_text_is_read_to_2_to_the_minus_100() {
    let error = largest("from_decimal", 2_000, |r| {
        let digits: String = (0..1 + r.bits() % 60).map(|_| char::from(b'0' + (r.bits() % 10) as u8)).collect();
        let point = r.bits() as usize % (digits.len() + 1);
        let sign = ["", "-", "+"][r.bits() as usize % 3];
        let exponent = r.uniform(-280.0, 240.0).floor();
        let text = format!("{sign}{}.{}e{exponent}", &digits[..point], &digits[point..]);
        let truth = decimal(&format!("{}{}e{exponent}", sign.replace('+', ""), with_point(&digits, point)));
        let value = Dd::from_decimal(&text).unwrap_or_else(|| panic!("{text}"));
        if truth == Big::ZERO {
            return value.abs().to_f64();
        }
        relative_error(value, &truth)
    });
    assert!(error <= 2f64.powi(-100));
}

/// With a digit on either side of the point, which is all that everybody reads.
fn with_point(digits: &str, point: usize) -> String {
    format!("0{}.{}0", &digits[..point], &digits[point..])
}

#[test]
fn decimal_text_agrees_with_the_f64_parser() {
    let mut random = Random(5);
    for _ in 0..20_000 {
        let x = f64::from_bits(random.bits());
        if x.is_finite() && x.abs() > 1e-290 {
            assert_eq!(Dd::from_decimal(&format!("{x:e}")).map(Dd::to_f64), Some(x));
        }
    }
    for (text, value) in [
        ("0", 0.0),
        ("-0.0e9", -0.0),
        (".5", 0.5),
        ("5.", 5.0),
        ("+12.25E+2", 1225.0),
        ("000000000000000000000000000000000000000000000000000001e0", 1.0),
        ("1e400", f64::INFINITY),
        ("-1e99999999999999999999999", f64::NEG_INFINITY),
        ("1e-99999999999999999999999", 0.0),
    ] {
        assert_eq!(Dd::from_decimal(text).map(|x| x.to_f64().to_bits()), Some(value.to_bits()), "{text}");
    }
    let integer = Dd::from_decimal("1234567890123456789012345678901").unwrap();
    assert_eq!(exact(integer), decimal("1234567890123456789012345678901"));
    let long = format!("0.{}1e{}", "0".repeat(5000), 5001);
    assert_eq!(Dd::from_decimal(&long), Some(Dd::ONE));
}

#[test]
fn what_is_not_a_decimal_number_is_refused() {
    for text in [
        "", "-", ".", "+.", "e5", "1e", "1e+", "1e5.0", "1.2.3", "1,5", " 1", "1 ", "0x10", "1_000", "inf", "NaN",
        "--1", "π",
    ] {
        assert_eq!(Dd::from_decimal(text), None, "{text:?}");
    }
}

#[test]
fn text_has_thirty_correct_digits() {
    let error = largest("Display", 1_000, |r| {
        let x = r.double_double(-960, 1022);
        let (text, truth) = (x.to_string(), exact(x));
        ((decimal(&text) - &truth) / &truth).to_f64().value().abs()
    });
    assert!(error <= 1e-30);
    let error = largest("text and back", 1_000, |r| {
        let x = r.double_double(-900, 900);
        let back = Dd::from_decimal(&x.to_string()).expect("our own text");
        relative_error(back, &exact(x))
    });
    assert!(error <= 1e-30);
}

#[test]
fn text_is_short_and_formatted_where_asked() {
    let third = Dd::ONE / Dd::from(3.0);
    for (text, expected) in [
        (Dd::PI.to_string(), "3.14159265358979323846264338328e0"),
        (third.to_string(), "3.333333333333333333333333333333e-1"),
        (Dd::from(-1250.0).to_string(), "-1.25e3"),
        (Dd::ZERO.to_string(), "0"),
        (Dd::from(1e300).to_string(), "1.000000000000000052504760255204e300"),
        (Dd::from(5e-324).to_string(), "4.940656458412465441765687928682e-324"),
        (Dd::from(f64::INFINITY).to_string(), "inf"),
        (Dd::from(f64::NAN).to_string(), "NaN"),
        (format!("{:.4}", Dd::from(9.99994)), "9.9999e0"),
        (format!("{:.4}", Dd::from(9.99996)), "1.0000e1"),
        (format!("{:.0}", Dd::from(0.5)), "5e-1"),
        (format!("{:>9.1}|{:<+8.1}|", Dd::from(-2.0), Dd::from(2.0)), "   -2.0e0|+2.0e0  |"),
    ] {
        assert_eq!(text, expected);
    }
}

#[test]
fn order_is_the_order_of_the_values() {
    let small = Dd::new(1.0, 1e-20);
    assert!(Dd::ONE < small && Dd::new(1.0, -1e-20) < Dd::ONE && small < Dd::from(2.0) && -small < -Dd::ONE);
    assert!(Dd::from(f64::NEG_INFINITY) < Dd::ZERO && Dd::ZERO < Dd::from(f64::INFINITY));
    assert_eq!(Dd::from(f64::NAN).partial_cmp(&Dd::ONE), None);
    assert_eq!((-small).abs(), small);
}

#[test]
fn infinities_and_nan_behave_as_in_f64() {
    let values = [f64::INFINITY, f64::NEG_INFINITY, f64::NAN, 0.0, -0.0, 3.0, -3.0, 1e300];
    for a in values {
        for b in values {
            let (x, y) = (Dd::from(a), Dd::from(b));
            for (ours, theirs) in [(x + y, a + b), (x - y, a - b), (x * y, a * b), (x / y, a / b)] {
                assert!(
                    ours.to_f64() == theirs || (ours.to_f64().is_nan() && theirs.is_nan()),
                    "{a} and {b}: {ours:?} for {theirs}"
                );
            }
        }
    }
}
