//! Prescribed motions: q, q̇ and q̈ over time.

use std::fmt;

/// A motion of all joints of a robot on a fixed base.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Times of the knots \[s\], each later than the one before, the first one zero or later.
    pub times: Vec<f64>,
    /// Between knots k and k + 1 a polynomial per joint in t − times\[k\].
    pieces: Vec<Vec<Polynomial>>,
}

/// Σ c\[n\] xⁿ.
type Polynomial = [f64; 10];

/// With these first coefficients.
fn polynomial<const N: usize>(first: [f64; N]) -> Polynomial {
    std::array::from_fn(|n| first.get(n).copied().unwrap_or(0.0))
}

/// Why knots make no motion.
#[derive(Clone, Debug, PartialEq)]
pub enum NoMotion {
    /// Fewer than two points.
    TooFew,
    /// A time that is not after the one before it: index of the point.
    NotLater(usize),
    /// Another number of coordinates than the first point: index of the point.
    Coordinates(usize),
    /// A number that is not finite: index of the point.
    NotFinite(usize),
    /// A speed or acceleration that is not positive: index of the joint.
    NoSpeed(usize),
    /// Between this point and the next one numbers are beyond all measure: times too near, points too far, speeds too small or too great.
    BeyondMeasure(usize),
}

impl fmt::Display for NoMotion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NoMotion::TooFew => f.write_str("a motion takes two points at least"),
            NoMotion::NotLater(i) => write!(f, "point {}: its time is not after that of the point before", i + 1),
            NoMotion::Coordinates(i) => write!(f, "point {}: it has another number of coordinates", i + 1),
            NoMotion::NotFinite(i) => write!(f, "point {}: a number is not finite", i + 1),
            NoMotion::NoSpeed(i) => {
                write!(f, "joint {}: greatest speed and acceleration are to be positive and finite", i + 1)
            }
            NoMotion::BeyondMeasure(i) => {
                write!(f, "from point {} on: the times, ways or speeds there are beyond all measure", i + 1)
            }
        }
    }
}

impl Motion {
    /// From rest to rest through points at these times, with continuous velocity and acceleration: cubic splines.
    ///
    /// # Errors
    /// [`NoMotion`].
    pub fn cubic(times: &[f64], points: &[Vec<f64>]) -> Result<Motion, NoMotion> {
        check(times, points)?;
        let velocities = spline_velocities(times, points);
        let pieces = (0..times.len() - 1).map(|k| {
            let h = times[k + 1] - times[k];
            let joint = |j: usize| {
                let (q0, q1, v0, v1) = (points[k][j], points[k + 1][j], velocities[k][j], velocities[k + 1][j]);
                let slope = (q1 - q0) / h;
                polynomial([q0, v0, (3.0 * slope - 2.0 * v0 - v1) / h, (v0 + v1 - 2.0 * slope) / (h * h)])
            };
            (0..points[0].len()).map(joint).collect()
        });
        Motion { times: times.to_vec(), pieces: pieces.collect() }.checked()
    }

    /// From rest to rest through points at these times, q̈ zero at both ends and continuous, its rate continuous within pieces:
    /// quintic pieces with the velocities and accelerations of the cubic splines at the points between.
    ///
    /// # Errors
    /// [`NoMotion`].
    pub fn quintic(times: &[f64], points: &[Vec<f64>]) -> Result<Motion, NoMotion> {
        let cubic = Motion::cubic(times, points)?;
        let last = times.len() - 1;
        let knots: Vec<_> = (0..=last)
            .map(|k| {
                let (q, qd, mut qdd) = cubic.at(times[k]);
                if k == 0 || k == last {
                    qdd.fill(0.0);
                }
                (q, qd, qdd)
            })
            .collect();
        Motion::hermite(times, &knots).checked()
    }

    /// From rest to rest through points at these times, at rest in each, with four derivatives of q zero there: polynomials of degree 9,
    /// smooth enough for elastic transmissions and inductances.
    ///
    /// # Errors
    /// [`NoMotion`].
    pub fn smooth(times: &[f64], points: &[Vec<f64>]) -> Result<Motion, NoMotion> {
        check(times, points)?;
        // 126 x⁵ − 420 x⁶ + 540 x⁷ − 315 x⁸ + 70 x⁹ goes from 0 to 1
        const RISE: [f64; 5] = [126.0, -420.0, 540.0, -315.0, 70.0];
        let pieces = (0..times.len() - 1).map(|k| {
            let h = times[k + 1] - times[k];
            let joint = |j: usize| {
                let mut c = polynomial([points[k][j]]);
                let way = points[k + 1][j] - points[k][j];
                RISE.iter().enumerate().for_each(|(i, rise)| c[5 + i] = way * rise / h.powi(5 + i as i32));
                c
            };
            (0..points[0].len()).map(joint).collect()
        });
        Motion { times: times.to_vec(), pieces: pieces.collect() }.checked()
    }

    /// Through samples with their velocities and accelerations: quintic pieces, nothing is estimated.
    ///
    /// # Errors
    /// [`NoMotion`].
    pub fn sampled(times: &[f64], knots: &[(Vec<f64>, Vec<f64>, Vec<f64>)]) -> Result<Motion, NoMotion> {
        let rows: Vec<Vec<f64>> = knots.iter().map(|(q, qd, qdd)| [&q[..], qd, qdd].concat()).collect();
        check(times, &rows)?;
        Motion::hermite(times, knots).checked()
    }

    fn hermite(times: &[f64], knots: &[(Vec<f64>, Vec<f64>, Vec<f64>)]) -> Motion {
        let pieces = (0..times.len() - 1).map(|k| {
            let h = times[k + 1] - times[k];
            let ((q0, v0, a0), (q1, v1, a1)) = (&knots[k], &knots[k + 1]);
            (0..q0.len()).map(|j| quintic_piece(h, [q0[j], v0[j], a0[j]], [q1[j], v1[j], a1[j]])).collect()
        });
        Motion { times: times.to_vec(), pieces: pieces.collect() }
    }

    /// Straight from point to point, at rest in each: constant acceleration, constant speed, constant deceleration, as fast as
    /// the joint that needs longest can with its greatest speed \[rad/s or m/s\] and acceleration \[rad/s² or m/s²\].
    ///
    /// # Errors
    /// [`NoMotion`].
    pub fn trapezoidal(points: &[Vec<f64>], speed: &[f64], acceleration: &[f64]) -> Result<Motion, NoMotion> {
        let indices: Vec<f64> = (0..points.len()).map(|k| k as f64).collect();
        check(&indices, points)?;
        let n = points[0].len();
        let is_fit = |x: &f64| *x > 0.0 && x.is_finite();
        let fit = |j: usize| speed.get(j).is_some_and(is_fit) && acceleration.get(j).is_some_and(is_fit);
        if let Some(j) = (0..n).find(|j| !fit(*j)) {
            return Err(NoMotion::NoSpeed(j));
        }
        let mut motion = Motion { times: vec![0.0], pieces: Vec::new() };
        for (k, pair) in points.windows(2).enumerate() {
            let way: Vec<f64> = (0..n).map(|j| pair[1][j] - pair[0][j]).collect();
            // of the path from 0 to 1, the greatest speed and acceleration that no joint minds
            let least = |limits: &[f64]| {
                let of = way.iter().zip(limits).filter(|(d, _)| **d != 0.0).map(|(d, limit)| limit / d.abs());
                of.fold(f64::INFINITY, f64::min)
            };
            let (v, a) = (least(speed), least(acceleration));
            if v.is_infinite() {
                continue;
            }
            // s = ½ a t², then v t; without room for the cruise a triangle
            let ramp = (v / a).min((1.0 / a).sqrt());
            let (top, cruise) = (a * ramp, 1.0 / (a * ramp) - ramp);
            let phases = [(ramp, [0.0, 0.0, 0.5 * a]), (cruise, [0.5 * a * ramp * ramp, top, 0.0])];
            let brake = (ramp, [1.0 - 0.5 * a * ramp * ramp, top, -0.5 * a]);
            // a cruise that is rounding is none
            let whole = 2.0 * ramp + cruise;
            if !whole.is_normal() || motion.duration() + ramp <= motion.duration() {
                return Err(NoMotion::BeyondMeasure(k));
            }
            let before = motion.duration();
            let lasts = |time: f64| time > 1e-12 * whole && before + time > before;
            for (time, [s, sd, half_sdd]) in phases.into_iter().chain([brake]).filter(|(time, _)| lasts(*time)) {
                let joint = |j: usize| polynomial([pair[0][j] + s * way[j], sd * way[j], half_sdd * way[j]]);
                motion.pieces.push((0..n).map(joint).collect());
                motion.times.push(motion.duration() + time);
            }
        }
        if motion.pieces.is_empty() {
            // all points are the same
            motion.pieces.push(points[0].iter().map(|q| polynomial([*q])).collect());
            motion.times.push(1.0);
        }
        motion.checked()
    }

    /// A motion whose numbers are all finite and whose times go on.
    fn checked(self) -> Result<Motion, NoMotion> {
        let fits = |k: usize| {
            let (start, end) = (self.times[k], self.times[k + 1]);
            let finite = |rates: Vec<Vec<f64>>| rates.iter().flatten().all(|x| x.is_finite());
            end.is_finite()
                && end > start
                && finite(self.derivatives_in_piece(k, end))
                && self.pieces[k].iter().flatten().all(|c| c.is_finite())
        };
        match (0..self.pieces.len()).find(|k| !fits(*k)) {
            None => Ok(self),
            Some(k) => Err(NoMotion::BeyondMeasure(k)),
        }
    }

    /// Per coordinate the sum of the moduli of all terms of a derivative at the end of the piece from knot `k` on.
    pub(crate) fn greatest_terms(&self, k: usize, order: usize) -> Vec<f64> {
        let absolute = |c: &Polynomial| c.map(f64::abs);
        let motion = Motion {
            times: vec![0.0, self.times[k + 1] - self.times[k]],
            pieces: vec![self.pieces[k].iter().map(absolute).collect()],
        };
        motion.derivatives_in_piece(0, motion.times[1]).swap_remove(order)
    }

    /// The same way in `factor` times the time.
    #[must_use]
    pub fn slowed(&self, factor: f64) -> Motion {
        // cₙ xⁿ = cₙ/factorⁿ (factor x)ⁿ
        let slower = |c: &Polynomial| std::array::from_fn(|n| c[n] / factor.powi(n as i32));
        Motion {
            times: self.times.iter().map(|t| t * factor).collect(),
            pieces: self.pieces.iter().map(|piece| piece.iter().map(slower).collect()).collect(),
        }
    }

    /// The time of its last knot \[s\].
    pub fn duration(&self) -> f64 {
        self.times.last().copied().unwrap_or(0.0)
    }

    /// Number of coordinates.
    pub fn coordinates(&self) -> usize {
        self.pieces.first().map_or(0, Vec::len)
    }

    /// Times at which q̈ may jump.
    pub fn corners(&self) -> Vec<f64> {
        self.times.clone()
    }

    /// q \[rad or m\], q̇ and q̈ at time `t` \[s\]; at rest in the first point before it, and in the last one after it.
    pub fn at(&self, t: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let (first, last) = (self.times.first().copied().unwrap_or(0.0), self.duration());
        let inside = t.clamp(first, last);
        let k = self.times.partition_point(|time| *time <= inside).saturating_sub(1).min(self.pieces.len() - 1);
        let (q, qd, qdd) = self.in_piece(k, inside);
        match t < first || t > last {
            true => (q, vec![0.0; qd.len()], vec![0.0; qdd.len()]),
            false => (q, qd, qdd),
        }
    }

    /// q and its derivatives up to the ninth at time `t` \[s\], as [`at`](Motion::at).
    pub fn derivatives(&self, t: f64) -> Vec<Vec<f64>> {
        let (first, last) = (self.times.first().copied().unwrap_or(0.0), self.duration());
        let inside = t.clamp(first, last);
        let k = self.times.partition_point(|time| *time <= inside).saturating_sub(1).min(self.pieces.len() - 1);
        let mut all = self.derivatives_in_piece(k, inside);
        if t < first || t > last {
            all[1..].iter_mut().for_each(|rates| rates.fill(0.0));
        }
        all
    }

    /// All derivatives by the polynomials of the piece from knot `k` on, also at its end.
    pub fn derivatives_in_piece(&self, k: usize, t: f64) -> Vec<Vec<f64>> {
        let x = t - self.times[k];
        let nth = |order: usize| -> Vec<f64> {
            // (n)(n − 1)…(n − order + 1)
            let factor = |n: usize| (n + 1 - order..=n).map(|i| i as f64).product::<f64>();
            let value = |c: &Polynomial| (order..c.len()).rev().fold(0.0, |sum, n| sum * x + factor(n) * c[n]);
            self.pieces[k].iter().map(value).collect()
        };
        (0..=9).map(nth).collect()
    }

    /// The same as [`at`](Motion::at) on the piece from knot `k` on, also at its end, where q̈ may jump.
    pub fn in_piece(&self, k: usize, t: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let x = t - self.times[k];
        let sum = |from: usize, factor: fn(usize) -> usize| -> Vec<f64> {
            let value = |c: &Polynomial| (from..c.len()).rev().fold(0.0, |sum, n| sum * x + factor(n) as f64 * c[n]);
            self.pieces[k].iter().map(value).collect()
        };
        (sum(0, |_| 1), sum(1, |n| n), sum(2, |n| n * (n - 1)))
    }
}

fn check(times: &[f64], points: &[Vec<f64>]) -> Result<(), NoMotion> {
    if times.len() < 2 || times.len() != points.len() {
        return Err(NoMotion::TooFew);
    }
    for (i, point) in points.iter().enumerate() {
        if !times[i].is_finite() || !point.iter().all(|x| x.is_finite()) {
            return Err(NoMotion::NotFinite(i));
        }
        if i > 0 && times[i] <= times[i - 1] {
            return Err(NoMotion::NotLater(i));
        }
        if point.len() != points[0].len() {
            return Err(NoMotion::Coordinates(i));
        }
    }
    Ok(())
}

/// Velocities at the knots of the cubic splines with continuous acceleration and none of velocity at the ends: a tridiagonal
/// system with a dominant diagonal, so that elimination needs no pivots.
fn spline_velocities(times: &[f64], points: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let (n, joints) = (times.len(), points[0].len());
    let mut velocities = vec![vec![0.0; joints]; n];
    let h: Vec<f64> = times.windows(2).map(|t| t[1] - t[0]).collect();
    // h₁ v₀ + 2 (h₀ + h₁) v₁ + h₀ v₂ = 3 (h₁ Δ₀/h₀ + h₀ Δ₁/h₁)
    let mut factors = vec![0.0; n];
    for k in 1..n - 1 {
        let pivot = 2.0 * (h[k - 1] + h[k]) - h[k] * factors[k - 1];
        factors[k] = h[k - 1] / pivot;
        for j in 0..joints {
            let (before, after) = (points[k][j] - points[k - 1][j], points[k + 1][j] - points[k][j]);
            let right = 3.0 * (h[k] * before / h[k - 1] + h[k - 1] * after / h[k]);
            velocities[k][j] = (right - h[k] * velocities[k - 1][j]) / pivot;
        }
    }
    for k in (1..n - 1).rev() {
        let (earlier, later) = velocities.split_at_mut(k + 1);
        earlier[k].iter_mut().zip(&later[0]).for_each(|(v, next)| *v -= factors[k] * next);
    }
    velocities
}

/// The polynomial with these values, first and second derivatives at 0 and at h.
fn quintic_piece(h: f64, [q0, v0, a0]: [f64; 3], [q1, v1, a1]: [f64; 3]) -> Polynomial {
    // what the start's parabola leaves to be done, in units of h
    let d = q1 - (q0 + v0 * h + 0.5 * a0 * h * h);
    let e = (v1 - (v0 + a0 * h)) * h;
    let f = (a1 - a0) * h * h;
    let c3 = 10.0 * d - 4.0 * e + 0.5 * f;
    let c4 = -15.0 * d + 7.0 * e - f;
    let c5 = 6.0 * d - 3.0 * e + 0.5 * f;
    polynomial([q0, v0, 0.5 * a0, c3 / h.powi(3), c4 / h.powi(4), c5 / h.powi(5)])
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    const TIMES: [f64; 4] = [0.0, 0.5, 1.3, 2.0];

    fn points() -> Vec<Vec<f64>> {
        vec![vec![0.1, -0.4], vec![0.9, 0.3], vec![-0.5, 0.2], vec![0.4, 1.1]]
    }

    #[track_caller]
    fn close(a: &[f64], b: &[f64], bound: f64) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < bound), "{a:?} {b:?}");
    }

    pub fn splines_go_through_their_points_and_are_smooth() {
        for (motion, smooth_ends) in
            [(Motion::cubic(&TIMES, &points()).unwrap(), false), (Motion::quintic(&TIMES, &points()).unwrap(), true)]
        {
            for (t, point) in TIMES.iter().zip(points()) {
                close(&motion.at(*t).0, &point, 1e-14);
            }
            for t in [0.5, 1.3] {
                let (before, after) = (motion.at(t - 1e-9), motion.at(t + 1e-9));
                close(&before.1, &after.1, 1e-6);
                close(&before.2, &after.2, 1e-5);
            }
            for t in [0.0, 2.0] {
                close(&motion.at(t).1, &[0.0; 2], 1e-12);
                assert_eq!(motion.at(t).2.iter().all(|a| a.abs() < 1e-10), smooth_ends);
            }
        }
    }

    pub fn velocities_and_accelerations_are_derivatives() {
        let knots: Vec<_> = points().iter().map(|p| (p.clone(), vec![p[1], 0.3], vec![-p[0], 0.7])).collect();
        let trapezoidal = Motion::trapezoidal(&points(), &[1.0, 2.0], &[3.0, 4.0]).unwrap();
        for motion in [
            Motion::cubic(&TIMES, &points()).unwrap(),
            Motion::quintic(&TIMES, &points()).unwrap(),
            Motion::sampled(&TIMES, &knots).unwrap(),
            trapezoidal,
        ] {
            let h = 1e-6;
            for t in [0.2, 0.77, 1.1, 1.83] {
                let (before, now, after) = (motion.at(t - h), motion.at(t), motion.at(t + h));
                for j in 0..2 {
                    // differences: truncation h², rounding 1e-16/h
                    assert!(((after.0[j] - before.0[j]) / (2.0 * h) - now.1[j]).abs() < 1e-8);
                    assert!(((after.1[j] - before.1[j]) / (2.0 * h) - now.2[j]).abs() < 1e-7);
                }
            }
        }
    }

    pub fn a_trapezoid_is_as_fast_as_its_slowest_joint_and_no_faster() {
        let motion = Motion::trapezoidal(&points(), &[1.0, 2.0], &[3.0, 40.0]).unwrap();
        close(&motion.at(motion.duration()).0, &points()[3], 1e-14);
        let (mut speed, mut acceleration) = (0.0f64, 0.0f64);
        for k in 0..=10_000 {
            let (_, qd, qdd) = motion.at(motion.duration() * f64::from(k) / 10_000.0);
            assert!(qd[0].abs() < 1.0 + 1e-12 && qd[1].abs() < 2.0 && qdd[0].abs() < 3.0 + 1e-12);
            (speed, acceleration) = (speed.max(qd[0].abs()), acceleration.max(qdd[0].abs()));
        }
        assert!((speed - 1.0).abs() < 1e-12 && (acceleration - 3.0).abs() < 1e-12);
        // the first way: 0.8 rad at 1 rad/s and 3 rad/s², 0.8/1 + 1/3 s
        close(&motion.at(0.8 + 1.0 / 3.0).0, &points()[1], 1e-14);
        assert_eq!(Motion::trapezoidal(&points(), &[1.0, f64::INFINITY], &[3.0, 4.0]), Err(NoMotion::NoSpeed(1)));
    }

    pub fn what_is_beyond_measure_is_no_motion() {
        let points = [vec![0.0], vec![1.0]];
        for times in [[0.0, 1e-300], [-1e308, 1e308]] {
            for motion in [Motion::cubic, Motion::quintic, Motion::smooth] {
                assert_eq!(motion(&times, &points), Err(NoMotion::BeyondMeasure(0)), "{times:?}");
            }
        }
        for [speed, acceleration] in [[1e-300, 1e-300], [1e-300, 1e300], [1e300, 1e300], [1e-200, 1.0]] {
            let found = Motion::trapezoidal(&points, &[speed], &[acceleration]);
            assert!(
                found.as_ref().map_or_else(|e| *e == NoMotion::BeyondMeasure(0), |m| m.duration().is_normal()),
                "{found:?}"
            );
        }
        // fast is not the same as standing still
        let fast = Motion::trapezoidal(&points, &[1e8], &[1e26]).expect("a motion");
        close(&fast.at(fast.duration()).0, &[1.0], 1e-12);
        assert!(fast.duration() < 1e-7);
        assert_eq!(Motion::cubic(&[0.0, 1.0], &[vec![1e308], vec![-1e308]]), Err(NoMotion::BeyondMeasure(0)));
    }

    pub fn what_is_no_motion_is_said() {
        assert_eq!(Motion::cubic(&[0.0], &[vec![1.0]]), Err(NoMotion::TooFew));
        assert_eq!(Motion::cubic(&[0.0, 0.0], &[vec![1.0], vec![2.0]]), Err(NoMotion::NotLater(1)));
        assert_eq!(Motion::cubic(&[0.0, 1.0], &[vec![1.0], vec![2.0, 1.0]]), Err(NoMotion::Coordinates(1)));
        assert_eq!(Motion::cubic(&[0.0, 1.0], &[vec![1.0], vec![f64::NAN]]), Err(NoMotion::NotFinite(1)));
    }
}
