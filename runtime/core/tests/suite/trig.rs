//! sin, cos and square root: truth × arguments × bound.
//!
//! The truth is double-double for f64 (itself held against arbitrary precision in `dd.rs`), `std`'s f64 for f32, and
//! `std`'s square root. The largest errors are printed by
//! `cargo test --release -p straightline-core --test suite trig::table_of_errors -- --ignored --nocapture`, all f32 are tried by
//! `… --test suite trig::every_f32 -- --ignored --nocapture`.

use crate::measure::{around_multiple, worst_f32, worst_f64, Random, Worst};
use straightline_core::trig::{sin_cos_f32, sin_cos_f64, sin_cos_of_sum_f32, sin_cos_of_sum_f64};
use straightline_core::trig::{sin_cos_of_sum_fused_f32, sin_cos_of_sum_fused_f64};
use straightline_core::trig::{sqrt_f32, sqrt_f64, sum_of_angles_f32, sum_of_angles_f64, DOMAIN_F32, DOMAIN_F64};
use straightline_core::{Dd, Real};

/// The bound that follows from adding up the roundings (see the kernel in `trig.rs`).
const BOUND_F64: f64 = 0.797;
/// The largest error of all f32 in the domain, found by `every_f32_in_the_domain`.
const BOUND_F32: f64 = 0.771;
/// As [`BOUND_F64`], with fused multiply-add.
const BOUND_FUSED_F64: f64 = 0.74;
/// As [`BOUND_F32`], with fused multiply-add.
const BOUND_FUSED_F32: f64 = 0.718;

fn fused_f64(x: f64) -> (f64, f64) {
    sin_cos_of_sum_fused_f64([x, 0.0], f64::mul_add)
}

fn fused_f32(x: f32) -> (f32, f32) {
    sin_cos_of_sum_fused_f32([x, 0.0], f32::mul_add)
}

const RANGES: [f64; 6] = [std::f64::consts::FRAC_PI_4, std::f64::consts::PI, 100.0, 1e4, 1e6, DOMAIN_F64];

fn random_arguments(range: f64, count: usize) -> impl Iterator<Item = f64> {
    let mut random = Random(range.to_bits());
    (0..count).map(move |_| random.uniform(-range, range))
}

/// Magnitudes from the smallest subnormal to the end of the domain, evenly spread over the exponents.
fn arguments_of_all_sizes(count: u64) -> impl Iterator<Item = f64> {
    let step = DOMAIN_F64.to_bits() / count;
    (0..count).map(move |i| f64::from_bits(i * step + i % 7))
}

fn multiples_of_half_pi(stride: usize, reach: u64) -> impl Iterator<Item = f64> {
    (1..=1u32 << 23).step_by(stride).flat_map(move |k| around_multiple(k, reach)).filter(|x| *x <= DOMAIN_F64)
}

fn floats_in_the_domain(stride: usize) -> impl Iterator<Item = f32> {
    (0..=DOMAIN_F32.to_bits()).step_by(stride).map(f32::from_bits)
}

#[test]
fn f64_errors_stay_within_the_bound_of_the_roundings() {
    for range in RANGES {
        let worst = worst_f64(sin_cos_f64, random_arguments(range, 100_000));
        assert!(worst.max() <= BOUND_F64, "|x| < {range}: {worst:?}");
        let worst = worst_f64(fused_f64, random_arguments(range, 100_000));
        assert!(worst.max() <= BOUND_FUSED_F64, "|x| < {range}, fused: {worst:?}");
    }
    let worst = worst_f64(sin_cos_f64, arguments_of_all_sizes(100_000));
    assert!(worst.max() <= BOUND_F64, "all sizes: {worst:?}");
    let worst = worst_f64(fused_f64, arguments_of_all_sizes(100_000));
    assert!(worst.max() <= BOUND_FUSED_F64, "all sizes, fused: {worst:?}");
}

/// Where the result is tiny all of its digits come from the tail of the reduction; the other one is ±1 and must be so.
#[test]
fn f64_keeps_every_digit_and_sign_next_to_multiples_of_half_pi() {
    for kernel in [sin_cos_f64, fused_f64] {
        let worst = worst_f64(kernel, multiples_of_half_pi(331, 2));
        assert!(worst.max() <= 0.501, "{worst:?}");
        for k in (1..1 << 23).step_by(331) {
            for x in around_multiple(k, 2) {
                let (sin, cos) = kernel(x);
                let truth = straightline_core::Dd::from(x).sin_cos();
                assert_eq!(sin.is_sign_negative(), truth.0.to_f64().is_sign_negative(), "sin {x:e}");
                assert_eq!(cos.is_sign_negative(), truth.1.to_f64().is_sign_negative(), "cos {x:e}");
            }
        }
    }
}

#[test]
#[ignore = "all multiples in the domain: 5 s in release"]
fn f64_keeps_every_digit_next_to_every_multiple_of_half_pi() {
    for kernel in [sin_cos_f64, fused_f64] {
        let worst = worst_f64(kernel, multiples_of_half_pi(1, 2));
        println!("{worst:?}");
        assert!(worst.max() <= 0.501, "{worst:?}");
    }
}

#[test]
fn f32_errors_stay_within_the_bound() {
    let worst = worst_f32(sin_cos_f32, floats_in_the_domain(257));
    assert!(worst.max() <= BOUND_F32, "{worst:?}");
    let worst = worst_f32(fused_f32, floats_in_the_domain(257));
    assert!(worst.max() <= BOUND_FUSED_F32, "fused: {worst:?}");
    let next_to_multiples = |k: u32| {
        let nearest = (f64::from(k) * std::f64::consts::FRAC_PI_2) as f32;
        (nearest.to_bits() - 2..=nearest.to_bits() + 2).map(f32::from_bits).filter(|x| *x <= DOMAIN_F32)
    };
    for kernel in [sin_cos_f32, fused_f32] {
        let worst = worst_f32(kernel, (1..=1u32 << 15).flat_map(next_to_multiples));
        assert!(worst.max() <= 0.501, "next to multiples of π/2: {worst:?}");
    }
}

#[test]
#[ignore = "1.2e9 numbers, twice: some minutes in release"]
fn every_f32_in_the_domain() {
    let count = DOMAIN_F32.to_bits() + 1;
    for (name, kernel, bound) in
        [("", sin_cos_f32 as fn(f32) -> (f32, f32), BOUND_F32), (", fused", fused_f32, BOUND_FUSED_F32)]
    {
        let start = std::time::Instant::now();
        let worst = worst_f32(kernel, floats_in_the_domain(1));
        let time = start.elapsed();
        println!(
            "{count} floats, 0 <= x <= {DOMAIN_F32}, and as many negative ones by symmetry{name}: {worst:?}, {time:?}"
        );
        assert!(worst.max() <= bound, "{worst:?}");
        for bits in 0..=DOMAIN_F32.to_bits() {
            let (sin, cos) = kernel(f32::from_bits(bits));
            let (minus_sin, same_cos) = kernel(-f32::from_bits(bits));
            assert!(sin.to_bits() ^ minus_sin.to_bits() == 1 << 31 && cos.to_bits() == same_cos.to_bits(), "{bits:#x}");
        }
    }
}

#[test]
#[ignore = "prints the table of the README: 20 s in release"]
fn table_of_errors() {
    let row = |name: &str, worst: Worst, bound: f64| {
        println!("| {name:<46} | {:.4} | {:.4} |", worst.sin.0, worst.cos.0);
        assert!(worst.max() <= bound, "{name}: {worst:?}");
    };
    println!("| largest error found [ulp]                      | sin    | cos    |");
    println!("|------------------------------------------------|--------|--------|");
    for range in RANGES {
        row(
            &format!("f64, |x| < {range:.3}, 5e6 random"),
            worst_f64(sin_cos_f64, random_arguments(range, 5_000_000)),
            BOUND_F64,
        );
        row(
            &format!("f64, fused, |x| < {range:.3}, 5e6 random"),
            worst_f64(fused_f64, random_arguments(range, 5_000_000)),
            BOUND_FUSED_F64,
        );
    }
    row("f64, 5 around each multiple of π/2", worst_f64(sin_cos_f64, multiples_of_half_pi(1, 2)), BOUND_F64);
    row("f64, fused, 5 around each multiple of π/2", worst_f64(fused_f64, multiples_of_half_pi(1, 2)), BOUND_FUSED_F64);
    let mut from = 0.0f32;
    for to in [std::f32::consts::FRAC_PI_4, std::f32::consts::PI, 100.0, 1e4, DOMAIN_F32] {
        let arguments = (from.to_bits()..=to.to_bits()).step_by(13).map(f32::from_bits);
        row(
            &format!("f32, {from:.3} <= x <= {to:.3}, every 13th"),
            worst_f32(sin_cos_f32, arguments.clone()),
            BOUND_F32,
        );
        row(
            &format!("f32, fused, {from:.3} <= x <= {to:.3}, every 13th"),
            worst_f32(fused_f32, arguments),
            BOUND_FUSED_F32,
        );
        from = to;
    }
}

/// The largest error of sin and cos \[ulp\] of sums of three angles, against the exact sum in double-double, above the 2^-85
/// to which the tail is added.
fn worst_of_sums(kernel: impl Fn([f64; 3]) -> (f64, f64), angles: impl Iterator<Item = [f64; 3]>) -> f64 {
    let ulp = |x: f64| x.abs().next_up() - x.abs();
    let error = |angles: [f64; 3]| {
        let exact = angles.iter().fold(Dd::ZERO, |sum, x| sum + Dd::from(*x)).sin_cos();
        let ours = kernel(angles);
        let of = |got: f64, truth: Dd| {
            let error = (Dd::from(got) - truth).abs().to_f64();
            (error - 2f64.powi(-85)).max(0.0) / ulp(truth.to_f64())
        };
        of(ours.0, exact.0).max(of(ours.1, exact.1))
    };
    angles.map(error).fold(0.0, f64::max)
}

/// A rounded sum of angles around 1e6 would be wrong in the tenth digit.
#[test]
fn sums_of_far_angles_keep_their_digits() {
    let plain = |angles: [f64; 3]| {
        let ours = sin_cos_of_sum_f64(sum_of_angles_f64(angles));
        assert_eq!(ours, Real::sin_cos_of_sum(&angles), "the trait's sum has the same bits");
        ours
    };
    let fused = |angles: [f64; 3]| sin_cos_of_sum_fused_f64(sum_of_angles_f64(angles), f64::mul_add);
    type Kernel<'a> = &'a dyn Fn([f64; 3]) -> (f64, f64);
    let kernels: [(Kernel, f64); 2] = [(&plain, BOUND_F64), (&fused, BOUND_FUSED_F64)];
    for (kernel, bound) in kernels {
        let mut random = Random(5);
        for range in [1.0, std::f64::consts::PI, 100.0, 1e4, 1e6, DOMAIN_F64 / 3.0] {
            let worst = worst_of_sums(kernel, (0..30_000).map(|_| [0; 3].map(|_| random.uniform(-range, range))));
            assert!(worst <= bound, "angles below {range}: {worst}");
        }
        // next to multiples of π/2 the result may be smaller than what the rounding of the sum lost
        let tiny = (1..1u32 << 21).step_by(97).flat_map(|k| around_multiple(k, 1)).map(|x| {
            let far = random.uniform(-1e6, 1e6);
            [x - far, far, random.uniform(-1e-9, 1e-9)]
        });
        let worst = worst_of_sums(kernel, tiny);
        assert!(worst <= 1.5, "next to multiples of π/2: {worst}");
    }
}

/// As in f64, above the 2^-32 to which the tail is added. Sums of four angles that each had a sine before do have one.
#[test]
fn sums_of_far_angles_in_f32_keep_their_digits() {
    let ulp = |x: f64| f64::from((x as f32).abs().next_up() - (x as f32).abs());
    let plain = |angles: [f32; 4]| {
        let ours = sin_cos_of_sum_f32(sum_of_angles_f32(angles));
        assert_eq!(ours, Real::sin_cos_of_sum(&angles), "the trait's sum has the same bits");
        ours
    };
    let fused = |angles: [f32; 4]| sin_cos_of_sum_fused_f32(sum_of_angles_f32(angles), f32::mul_add);
    let kernels: [&dyn Fn([f32; 4]) -> (f32, f32); 2] = [&plain, &fused];
    for kernel in kernels {
        let mut random = Random(6);
        for range in [1.0, std::f64::consts::PI, 100.0, 1e3, 12_867.0] {
            for _ in 0..30_000 {
                let angles = [0; 4].map(|_| random.uniform(-range, range) as f32);
                // four f32 have an exact sum in f64, and a sine of it far below an ulp of f32
                let exact = angles.iter().map(|x| f64::from(*x)).sum::<f64>().sin_cos();
                let ours = kernel(angles);
                for (got, truth) in [(ours.0, exact.0), (ours.1, exact.1)] {
                    let error = ((f64::from(got) - truth).abs() - 2f64.powi(-32)).max(0.0) / ulp(truth);
                    assert!(error <= 0.801, "{angles:?}: {got:e}, not {truth:e}: {error} ulp");
                }
            }
        }
    }
}

#[test]
fn sin_is_odd_and_cos_is_even_to_the_bit() {
    for x in random_arguments(DOMAIN_F64, 20_000).chain(arguments_of_all_sizes(20_000)) {
        for kernel in [sin_cos_f64, fused_f64] {
            let ((sin, cos), (minus_sin, same_cos)) = (kernel(x), kernel(-x));
            assert_eq!((minus_sin.to_bits(), same_cos.to_bits()), ((-sin).to_bits(), cos.to_bits()), "{x:e}");
        }
    }
    for x in floats_in_the_domain(30_011) {
        for kernel in [sin_cos_f32, fused_f32] {
            let ((sin, cos), (minus_sin, same_cos)) = (kernel(x), kernel(-x));
            assert_eq!((minus_sin.to_bits(), same_cos.to_bits()), ((-sin).to_bits(), cos.to_bits()), "{x:e}");
        }
    }
}

#[test]
fn tiny_angles_are_their_own_sines() {
    for x in arguments_of_all_sizes(50_000).take_while(|x| *x < 1e-8).flat_map(|x| [x, -x]) {
        for (sin, cos) in [sin_cos_f64(x), fused_f64(x)] {
            assert_eq!((sin.to_bits(), cos), (x.to_bits(), 1.0), "{x:e}");
        }
    }
    for x in floats_in_the_domain(9_973).take_while(|x| *x < 2e-4).flat_map(|x| [x, -x]) {
        for (sin, cos) in [sin_cos_f32(x), fused_f32(x)] {
            assert_eq!((sin.to_bits(), cos), (x.to_bits(), 1.0), "{x:e}");
        }
    }
}

#[test]
fn the_domain_ends_where_it_says_and_beyond_is_nan() {
    for kernel in [sin_cos_f64, fused_f64] {
        for x in [DOMAIN_F64, -DOMAIN_F64] {
            assert!(kernel(x).0.is_finite() && kernel(x).1.is_finite());
        }
        let mut random = Random(1);
        let outside = (0..100_000).map(|_| f64::from_bits(random.bits())).filter(|x| x.abs() > DOMAIN_F64);
        for x in outside.chain([DOMAIN_F64.next_up(), f64::MAX, f64::INFINITY, f64::NAN]).flat_map(|x| [x, -x]) {
            assert!(kernel(x).0.is_nan() && kernel(x).1.is_nan(), "{x:e}");
        }
    }
    for kernel in [sin_cos_f32, fused_f32] {
        for x in [DOMAIN_F32, -DOMAIN_F32] {
            assert!(kernel(x).0.is_finite() && kernel(x).1.is_finite());
        }
        let outside = (DOMAIN_F32.to_bits() + 1..0x8000_0000).step_by(9_973).map(f32::from_bits);
        for x in outside.chain([DOMAIN_F32.next_up(), f32::MAX, f32::INFINITY, f32::NAN]).flat_map(|x| [x, -x]) {
            assert!(kernel(x).0.is_nan() && kernel(x).1.is_nan(), "{x:e}");
        }
    }
}

/// A fingerprint (FNV-1a) of results on one machine; that it is the same on every other is what the test claims.
#[test]
fn the_bits_are_the_same_on_every_target() {
    let mut fingerprint = 0xcbf2_9ce4_8422_2325_u64;
    let mut take = |bits: u64| fingerprint = (fingerprint ^ bits).wrapping_mul(0x0100_0000_01b3);
    for x in random_arguments(1e6, 10_000).chain(random_arguments(3.0, 10_000)) {
        let (sin, cos) = sin_cos_f64(x);
        take(sin.to_bits());
        take(cos.to_bits());
        take(sqrt_f64(x.abs()).to_bits());
    }
    for x in floats_in_the_domain(100_003) {
        let (sin, cos) = sin_cos_f32(x);
        take(u64::from(sin.to_bits()));
        take(u64::from(cos.to_bits()));
        take(u64::from(sqrt_f32(x).to_bits()));
    }
    assert_eq!(fingerprint, FINGERPRINT, "{fingerprint:#x}");
}

const FINGERPRINT: u64 = 0x0177_2c64_ec68_ad09;

/// What the compiler makes of a loop over lanes may use other instructions; it may not give other bits.
#[test]
fn a_loop_over_lanes_gives_the_same_bits() {
    let mut random = Random(2);
    for _ in 0..10_000 {
        let x: [f64; 8] = std::array::from_fn(|_| random.uniform(-1e3, 1e3));
        let y = x.map(|x| x as f32);
        let (mut wide, mut narrow) = ([(0.0, 0.0); 8], [(0.0, 0.0); 8]);
        for lane in 0..8 {
            wide[lane] = sin_cos_f64(x[lane]);
            narrow[lane] = sin_cos_f32(y[lane]);
        }
        for lane in 0..8 {
            assert_eq!(wide[lane], sin_cos_f64(std::hint::black_box(x[lane])));
            assert_eq!(narrow[lane], sin_cos_f32(std::hint::black_box(y[lane])));
        }
    }
}

/// Each of these wrong functions must exceed the bound that the right one keeps: the tests above can fail.
#[test]
fn the_tests_notice_wrong_functions() {
    let random = |f: &dyn Fn(f64) -> (f64, f64)| worst_f64(f, random_arguments(100.0, 20_000)).max();
    let multiples = |f: &dyn Fn(f64) -> (f64, f64)| worst_f64(f, multiples_of_half_pi(41, 2)).max();

    assert!(random(&|x| (sin_cos_f64(x).0.next_up(), sin_cos_f64(x).1)) > BOUND_F64, "sin one ulp up");
    assert!(random(&|x| (sin_cos_f64(x).0, sin_cos_f64(x).1.next_down())) > BOUND_F64, "cos one ulp down");
    let now_and_then = |x: f64| {
        let (sin, cos) = sin_cos_f64(x);
        (if x.to_bits().is_multiple_of(1000) { sin.next_up() } else { sin }, cos)
    };
    assert!(random(&now_and_then) > BOUND_F64, "sin one ulp up for one argument in a thousand");
    let wrong_coefficient = |x: f64| {
        let (sin, cos) = sin_cos_f64(x);
        (sin, cos + 4e-12 * sin.powi(2) * cos.powi(2) * 1e-4)
    };
    assert!(random(&wrong_coefficient) > BOUND_F64, "a coefficient wrong in the tenth digit");
    // π/2 without its last part, 8.5e-32
    let short_pi = |x: f64| {
        let (sin, cos) = sin_cos_f64(x);
        let shift = (x * std::f64::consts::FRAC_2_PI).round() * 8.478e-32;
        (sin + cos * shift, cos - sin * shift)
    };
    assert!(multiples(&short_pi) > 0.501, "reduction by a π/2 of 99 bits");
    assert!(random(&short_pi) <= BOUND_F64, "which random arguments do not notice");

    let f32_up = |x: f32| (sin_cos_f32(x).0, sin_cos_f32(x).1.next_up());
    assert!(worst_f32(f32_up, floats_in_the_domain(65_537)).max() > BOUND_F32, "f32 cos one ulp up");
}

#[test]
fn square_roots_are_correctly_rounded() {
    let mut random = Random(3);
    for _ in 0..300_000 {
        let x = f64::from_bits(random.bits() >> 1);
        if !x.is_nan() {
            assert_eq!(sqrt_f64(x).to_bits(), x.sqrt().to_bits(), "{x:e}");
        }
    }
    // next to squares, where roundings are close calls; and at the ends of the binades and of the subnormals
    for _ in 0..20_000 {
        let root = f64::from_bits(random.bits() >> 2) * 0.5;
        for square in [root * root, f64::from_bits(root.to_bits() & !0x7ff_ffff).powi(2), root] {
            let bits = square.to_bits().clamp(2, f64::INFINITY.to_bits() - 2);
            for x in (bits - 2..=bits + 2).map(f64::from_bits) {
                assert_eq!(sqrt_f64(x).to_bits(), x.sqrt().to_bits(), "{x:e}");
            }
        }
    }
    for exponent in 0..2047u64 {
        for x in [exponent << 52, (exponent << 52) + 1, (exponent << 52) + (1 << 52) - 1].map(f64::from_bits) {
            assert_eq!(sqrt_f64(x).to_bits(), x.sqrt().to_bits(), "{x:e}");
        }
    }
    for x in (0..f32::INFINITY.to_bits()).step_by(1_009).map(f32::from_bits) {
        assert_eq!(sqrt_f32(x).to_bits(), x.sqrt().to_bits(), "{x:e}");
    }
}

#[test]
#[ignore = "2.1e9 numbers: about a minute in release"]
fn every_f32_square_root_is_correctly_rounded() {
    for x in (0..=f32::INFINITY.to_bits()).map(f32::from_bits) {
        assert_eq!(sqrt_f32(x).to_bits(), x.sqrt().to_bits(), "{x:e}");
    }
}

#[test]
fn square_roots_of_special_values() {
    assert_eq!(sqrt_f64(0.0).to_bits(), 0.0f64.to_bits());
    assert_eq!(sqrt_f64(-0.0).to_bits(), (-0.0f64).to_bits());
    assert_eq!(sqrt_f64(f64::INFINITY), f64::INFINITY);
    for x in [-f64::from_bits(1), -1.0, -f64::MAX, f64::NEG_INFINITY, f64::NAN, -f64::NAN] {
        assert!(sqrt_f64(x).is_nan(), "{x:e}");
    }
    assert_eq!(sqrt_f32(0.0).to_bits(), 0.0f32.to_bits());
    assert_eq!(sqrt_f32(-0.0).to_bits(), (-0.0f32).to_bits());
    assert_eq!(sqrt_f32(f32::INFINITY), f32::INFINITY);
    for x in [-f32::from_bits(1), -1.0, -f32::MAX, f32::NEG_INFINITY, f32::NAN, -f32::NAN] {
        assert!(sqrt_f32(x).is_nan(), "{x:e}");
    }
}
