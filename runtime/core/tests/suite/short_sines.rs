//! Short sines and cosines: truth × arguments × bound. The truth is `std`'s f64.

use crate::measure::Random;
use straightline_core::short_sines::{
    sin_cos_f32, sin_cos_lanes_f32, sin_cos_lanes_of_sums_f32, sin_cos_of_sum_f32, sum_of_angles_f32, DOMAIN_F32,
    ERROR_F32,
};
use straightline_core::Real;

/// Further than this from zero no y comes out of the reduction: π/4, and 256 quarter turns off by half an ulp of 256.
const REDUCED: f32 = 0.785_45;

/// Half an ulp of y, and what else the reduction may be off by (the head of `short_sines.rs`).
fn reduction(y: f64) -> f64 {
    let binade = f64::from_bits(y.abs().to_bits() & (0x7ff << 52));
    binade * f64::from(f32::EPSILON) / 2.0 + 2f64.powi(-29) + 2f64.powi(-28) + 2f64.powi(-33)
}

/// The greatest of the bounds that follow for all angles whose reduction ends in one of these y, of sine and cosine.
fn proven(stride: usize) -> f64 {
    let mut worst = 0.0f64;
    for y in (0..=REDUCED.to_bits()).step_by(stride).map(f32::from_bits) {
        // no quarter turn, so that the kernel gets y itself; what lies beyond π/4 is reached by a tail
        let near = y.min(0.75);
        let (sin, cos) = sin_cos_of_sum_f32([near, y - near]);
        let (exact_sin, exact_cos) = f64::from(y).sin_cos();
        let off = reduction(f64::from(y));
        worst = worst.max((f64::from(sin) - exact_sin).abs() + off * exact_cos);
        worst = worst.max((f64::from(cos) - exact_cos).abs() + off * exact_sin);
    }
    worst
}

/// The greatest error of sine and cosine, of these angles.
fn found(angles: impl Iterator<Item = f32>) -> f64 {
    let error = |x: f32| {
        let ((sin, cos), (exact_sin, exact_cos)) = (sin_cos_f32(x), f64::from(x).sin_cos());
        (f64::from(sin) - exact_sin).abs().max((f64::from(cos) - exact_cos).abs())
    };
    angles.map(error).fold(0.0, f64::max)
}

fn angles(stride: usize) -> impl Iterator<Item = f32> {
    (0..=DOMAIN_F32.to_bits()).step_by(stride).map(f32::from_bits)
}

#[test]
fn errors_stay_within_what_is_proven() {
    let (proven, found) = (proven(977), found(angles(491)));
    assert!(found <= proven && proven <= ERROR_F32, "{found:e} {proven:e}");
    // the bound is not idle
    assert!(found > 0.8 * ERROR_F32, "{found:e}");
}

#[test]
#[ignore = "2e9 numbers: two minutes, 20 s in release"]
fn every_short_sine_is_within_its_bound() {
    let proven = proven(1);
    println!("proven {proven:e}, found {:e}", found(angles(1)));
    assert!(proven <= ERROR_F32, "{proven:e}");
    assert!(found(angles(1)) <= ERROR_F32);
}

#[test]
fn sums_of_angles_keep_what_their_rounding_loses() {
    let mut random = Random(5);
    for size in [0.1, 3.0, 30.0, 130.0] {
        let mut without = 0.0f64;
        for _ in 0..50_000 {
            let angles: [f32; 3] = std::array::from_fn(|_| random.uniform(-size, size) as f32);
            let (sin, cos) = sin_cos_of_sum_f32(sum_of_angles_f32(angles));
            assert_eq!((sin, cos), f32::short_sin_cos_of_sum(&angles));
            let (exact_sin, exact_cos) = angles.iter().map(|x| f64::from(*x)).sum::<f64>().sin_cos();
            let worst = (f64::from(sin) - exact_sin).abs().max((f64::from(cos) - exact_cos).abs());
            assert!(worst <= ERROR_F32, "{angles:?}: {worst:e}");
            let (rounded, _) = sin_cos_f32(angles.iter().sum());
            without = without.max((f64::from(rounded) - exact_sin).abs());
        }
        // a rounded sum does not
        assert!(size < 3.0 || without > 2.0 * ERROR_F32, "{size}: {without:e}");
    }
}

#[test]
fn special_angles_and_what_is_no_angle() {
    assert_eq!(sin_cos_f32(0.0), (0.0, 1.0));
    let symmetric = |x: f32| {
        let ((sin, cos), (minus_sin, same_cos)) = (sin_cos_f32(x), sin_cos_f32(-x));
        sin == -minus_sin && cos == same_cos
    };
    assert!(angles(10_007).all(symmetric));
    for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert!(sin_cos_f32(x).0.is_nan() && sin_cos_f32(x).1.is_nan(), "{x}");
    }
}

#[test]
fn sums_of_angles_have_the_bits_of_a_loop_that_begins_with_nothing_lost() {
    fn of_loop<const N: usize>(angles: [f32; N]) -> [f32; 2] {
        let (mut sum, mut tail) = (angles[0], 0.0);
        for angle in &angles[1..] {
            let next = sum + angle;
            let added = next - sum;
            tail += (sum - (next - added)) + (angle - added);
            sum = next;
        }
        [sum, tail]
    }
    fn agree<const N: usize>(angles: [f32; N]) {
        let [own, other] = [sum_of_angles_f32(angles), of_loop(angles)].map(|sum| sum.map(f32::to_bits));
        assert_eq!(own, other, "{angles:?}");
    }
    let mut random = Random(9);
    for _ in 0..20_000 {
        // zeros of both signs among them, and what cancels
        let mut angle = || match random.uniform(0.0, 6.0) as u32 {
            0 => 0.0f32,
            1 => -0.0,
            2 => 1.5,
            3 => -1.5,
            _ => random.uniform(-9.0, 9.0) as f32,
        };
        let angles: [f32; 5] = std::array::from_fn(|_| angle());
        let [a, b, c, d, _] = angles;
        agree([a]);
        agree([a, b]);
        agree([a, b, c]);
        agree([a, b, c, d]);
        agree(angles);
    }
}

#[test]
fn two_angles_by_one_call_have_the_bits_of_each_alone() {
    let bits = |x: (f32, f32)| (x.0.to_bits(), x.1.to_bits());
    let apart = |([a, b], [c, d]): ([f32; 2], [f32; 2])| [bits((a, c)), bits((b, d))];
    let mut random = Random(11);
    for _ in 0..20_000 {
        let [x, y, z] = std::array::from_fn(|_| random.uniform(-130.0, 130.0) as f32);
        assert_eq!(apart(sin_cos_lanes_f32([x, y])), [x, y].map(|x| bits(sin_cos_f32(x))), "{x} {y}");
        let sums = [sum_of_angles_f32([x, y]), sum_of_angles_f32([x, y, z])];
        assert_eq!(apart(sin_cos_lanes_of_sums_f32(sums)), sums.map(|x| bits(sin_cos_of_sum_f32(x))), "{x} {y} {z}");
        // an angle that is no sum lost nothing
        assert_eq!(apart(sin_cos_lanes_of_sums_f32([[x, 0.0], sums[1]]))[0], bits(sin_cos_f32(x)), "{x}");
    }
}
