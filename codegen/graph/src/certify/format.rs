//! What rounding to a number format can do: the standard model with the binade of the result.

use super::interval::{add_up, norm_up, Interval};
use crate::expr::{Graph, Sines};
use crate::number::{Scalar, ShortSines};
use straightline_core::Dd;

/// The bound of the cosine kernel, in both formats \[ulp\]: see `trig.rs`; of sums of far angles in f32 2^-32 more.
const COSINE_KERNEL_ULPS: f64 = 0.622;

/// A binary floating-point format, with the proven error of its sine and cosine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FloatFormat {
    /// The scalar type that has it.
    pub scalar: Scalar,
    /// Half the distance of 1 to the next number, u = 2^-p.
    pub u: f64,
    /// The smallest normal number: numbers below it may be rounded to zero, where the machine flushes them.
    pub tiny: f64,
    /// The largest finite number.
    pub largest: f64,
    /// Error of sine and cosine \[ulp\]: see `trig.rs`.
    pub trig_ulps: f64,
    /// Error of sine and cosine besides, whatever their size.
    pub trig_absolute: f64,
    /// Sine and cosine answer up to here.
    pub trig_domain: f64,
}

impl FloatFormat {
    /// The format of a scalar type.
    pub fn of(scalar: Scalar) -> Self {
        FloatFormat {
            scalar,
            u: scalar.unit(),
            tiny: scalar.tiny(),
            largest: scalar.largest(),
            trig_ulps: scalar.trig_ulps(),
            trig_absolute: 0.0,
            trig_domain: scalar.trig_domain(),
        }
    }

    /// The format of a scalar type, with the sines of this program.
    pub fn of_program(graph: &Graph, scalar: Scalar) -> Self {
        let short = scalar.short_sines().filter(|_| graph.sines == Sines::Short);
        match short {
            None => FloatFormat::of(scalar),
            Some(ShortSines { error, domain }) => {
                FloatFormat { trig_ulps: 0.0, trig_absolute: error, trig_domain: domain, ..FloatFormat::of(scalar) }
            }
        }
    }

    /// What of the error of a sine or cosine grows with its size \[u\], and what does not.
    pub fn trig_parts(&self) -> (f64, f64) {
        ((self.trig_ulps * self.u).next_up(), add_up(self.trig_absolute, self.tiny))
    }

    /// The least power of two that is at least x > 0.
    fn binade(x: f64) -> f64 {
        if x < f64::MIN_POSITIVE {
            return f64::MIN_POSITIVE;
        }
        let down = f64::from_bits(x.to_bits() & (0x7ff << 52));
        if down == x {
            x
        } else {
            2.0 * down
        }
    }

    /// |fl(x) − x| for |x| ≤ `magnitude`: half an ulp in the binade below the least power of two above it; a number that is
    /// that power itself is not rounded. `tiny` more, for results that underflow, gradually or flushed to zero.
    pub fn rounding(&self, magnitude: f64) -> f64 {
        if magnitude == 0.0 {
            return 0.0;
        }
        add_up(0.5 * self.u * FloatFormat::binade(magnitude), self.tiny)
    }

    /// Error of a sine or cosine whose exact value is at most `magnitude`.
    pub fn trig_error(&self, magnitude: f64) -> f64 {
        // an ulp in the binade below 2^e is 2 u 2^(e − 1)
        let (unit, absolute) = self.trig_parts();
        add_up(unit * FloatFormat::binade(magnitude.min(1.0)), absolute)
    }

    /// √(e_s² + e_c²) of the errors of sine and cosine of one angle: one is at most √½ and comes from the sine kernel or is
    /// at least √½ and comes from the cosine kernel; both lie below 1, where an ulp is at most 2u.
    pub fn pair_error(&self) -> f64 {
        if self.trig_absolute > 0.0 {
            let each = self.trig_error(1.0);
            return norm_up([each, each]);
        }
        let sine = (self.trig_ulps * self.u).next_up();
        let cosine = (COSINE_KERNEL_ULPS * self.u).next_up();
        add_up(norm_up([sine, cosine]), 2.0 * self.tiny)
    }

    /// The constant as this format holds it.
    pub fn round(&self, c: Dd) -> f64 {
        self.scalar.nearest(c)
    }

    /// All values between the constant and its rounding, and an upper bound of their distance.
    pub fn constant(&self, c: Dd) -> (Interval, f64) {
        let rounded = self.round(c);
        let difference = Dd::from(rounded) - c;
        // the leading part is within 2^-53 of the double-double; the difference has an error far below that
        let distance = if difference.hi() == 0.0 { 0.0 } else { difference.hi().abs().next_up().next_up() };
        let exact = if c.lo() == 0.0 {
            Interval::point(c.hi())
        } else {
            Interval { lo: c.hi().next_down(), hi: c.hi().next_up() }
        };
        let hull = exact.hull(Interval::point(rounded));
        if rounded != 0.0 && rounded.abs() < self.tiny {
            // may be read as zero
            return (hull.hull(Interval::ZERO), add_up(distance, rounded.abs()));
        }
        (hull, distance)
    }
}
