//! Pieces of joint controllers around generated dynamics: no allocation, no library.
//!
//! With a reference motion r(t) and the measured state, e = r − q:
//!
//! | function | torque | handbook |
//! |---|---|---|
//! | [`feed_forward`] | τ(r, ṙ, r̈) + K e + D ė: the model runs on the reference, in a table or on line | Fig. 20.10a |
//! | [`computed_torque`] | τ(q, q̇, r̈ + D ė + K e): the model runs on the measured state, and errors die out like linear springs | Fig. 20.10b |
//! | [`gravity_compensation`] | g(q) + K e + D ė | |
//! | [`drive_feed_forward`] | voltages: u(r, ṙ, r̈, …) + G (K e + D ė), through motors and elastic transmissions | Fig. 20.10a |
//!
//! The model is a function over arrays, such as a generated `inverse_dynamics`; robots stand on a fixed base, one coordinate per
//! joint. [`TorqueLimits::apply`] keeps torques within what drives can do, [`MotorLimits::apply`] voltages within what a supply gives and a motor bears.
//!
//! ```
//! use straightline_core::control::{computed_torque, Gains, Measured, Outcome, Reference, TorqueLimits};
//! // a mass of 2 kg on a slide
//! let inverse_dynamics = |_q: &[f64; 1], _qd: &[f64; 1], qdd: &[f64; 1], tau: &mut [f64; 1]| tau[0] = 2.0 * qdd[0];
//! let wanted = Reference { q: [1.0], qd: [0.0], qdd: [3.0] };
//! let measured = Measured { q: [0.5], qd: [0.0] };
//! let mut tau = computed_torque(&wanted, &measured, &Gains { stiffness: [100.0], damping: [20.0] }, inverse_dynamics);
//! assert_eq!(tau, [2.0 * (3.0 + 100.0 * 0.5)]);
//! assert_eq!(TorqueLimits { greatest: [50.0] }.apply(&mut tau), Outcome::Saturated);
//! assert_eq!(tau, [50.0]);
//! ```

use crate::real::Real;
use core::array::from_fn;

/// What a motion wants at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference<T, const N: usize> {
    /// Coordinates r \[rad or m\].
    pub q: [T; N],
    /// Velocities ṙ \[rad/s or m/s\].
    pub qd: [T; N],
    /// Accelerations r̈ \[rad/s² or m/s²\].
    pub qdd: [T; N],
}

/// What the sensors say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured<T, const N: usize> {
    /// Coordinates q \[rad or m\].
    pub q: [T; N],
    /// Velocities q̇ \[rad/s or m/s\].
    pub qd: [T; N],
}

/// Gains per joint. Of torques for [`feed_forward`] and [`gravity_compensation`]: \[N·m/rad or N/m\], \[N·m·s/rad or N·s/m\]; of
/// accelerations for [`computed_torque`]: \[1/s²\], \[1/s\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains<T, const N: usize> {
    /// K.
    pub stiffness: [T; N],
    /// D.
    pub damping: [T; N],
}

impl<T: Real, const N: usize> Gains<T, N> {
    /// K e + D ė.
    pub fn answer(&self, wanted: &Reference<T, N>, measured: &Measured<T, N>) -> [T; N] {
        from_fn(|i| {
            self.stiffness[i] * (wanted.q[i] - measured.q[i]) + self.damping[i] * (wanted.qd[i] - measured.qd[i])
        })
    }
}

/// τ(r, ṙ, r̈) + K e + D ė \[N·m or N\]: what the motion takes by the model, on the reference, and what errors ask for.
pub fn feed_forward<T: Real, const N: usize>(
    wanted: &Reference<T, N>,
    measured: &Measured<T, N>,
    gains: &Gains<T, N>,
    inverse_dynamics: impl FnOnce(&[T; N], &[T; N], &[T; N], &mut [T; N]),
) -> [T; N] {
    let mut tau = [T::zero(); N];
    inverse_dynamics(&wanted.q, &wanted.qd, &wanted.qdd, &mut tau);
    added(&tau, &gains.answer(wanted, measured))
}

/// τ(q, q̇, r̈ + D ė + K e) \[N·m or N\]: with an exact model every error dies out like ë + D ė + K e = 0.
pub fn computed_torque<T: Real, const N: usize>(
    wanted: &Reference<T, N>,
    measured: &Measured<T, N>,
    gains: &Gains<T, N>,
    inverse_dynamics: impl FnOnce(&[T; N], &[T; N], &[T; N], &mut [T; N]),
) -> [T; N] {
    let mut tau = [T::zero(); N];
    let qdd = added(&wanted.qdd, &gains.answer(wanted, measured));
    inverse_dynamics(&measured.q, &measured.qd, &qdd, &mut tau);
    tau
}

/// g(q) + K e + D ė \[N·m or N\].
pub fn gravity_compensation<T: Real, const N: usize>(
    wanted: &Reference<T, N>,
    measured: &Measured<T, N>,
    gains: &Gains<T, N>,
    gravity_force: impl FnOnce(&[T; N], &mut [T; N]),
) -> [T; N] {
    let mut tau = [T::zero(); N];
    gravity_force(&measured.q, &mut tau);
    added(&tau, &gains.answer(wanted, measured))
}

/// u(r, ṙ, r̈, …) + G (K e + D ė) \[V\]: what the reference takes of N joints and M drives, elastic transmissions and inductances with them, and
/// what errors ask for. `driven_inverse` gives the former: a generated `driven_inverse_dynamics` at the reference, with as many of its
/// derivatives as it takes. `voltages` is G, volts of each drive per force of each joint: of a motor with the ratio N to one joint
/// R/(C_M N), whatever springs stand in between.
///
/// ```
/// use straightline_core::control::{drive_feed_forward, Gains, Measured, Reference};
/// // a motor with R = 2 Ω and C_M = C_E = 0.1 on a joint with 0.5 kg·m² by a gear of 50
/// let (wanted, measured) = (Reference { q: [1.0], qd: [0.2], qdd: [4.0] }, Measured { q: [0.9], qd: [0.2] });
/// let gains = Gains { stiffness: [30.0], damping: [3.0] };
/// let inverse = |u: &mut [f64; 1]| u[0] = 2.0 * (0.5 * wanted.qdd[0] / 50.0) / 0.1 + 0.1 * 50.0 * wanted.qd[0];
/// let u = drive_feed_forward(&wanted, &measured, &gains, &[[2.0 / (0.1 * 50.0)]], inverse);
/// assert!((u[0] - (0.8 + 1.0 + 0.4 * 30.0 * 0.1)).abs() < 1e-12);
/// ```
pub fn drive_feed_forward<T: Real, const N: usize, const M: usize>(
    wanted: &Reference<T, N>,
    measured: &Measured<T, N>,
    gains: &Gains<T, N>,
    voltages: &[[T; N]; M],
    driven_inverse: impl FnOnce(&mut [T; M]),
) -> [T; M] {
    let mut u = [T::zero(); M];
    driven_inverse(&mut u);
    let answer = gains.answer(wanted, measured);
    from_fn(|k| (0..N).fold(u[k], |sum, i| sum + voltages[k][i] * answer[i]))
}

/// The torques of a reference motion, computed off line at M instants, `period` apart, from time zero on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueTable<T, const N: usize, const M: usize> {
    /// Time from row to row \[s\], positive.
    pub period: T,
    /// A row per instant \[N·m or N\].
    pub rows: [[T; N]; M],
}

impl<T: Real + PartialOrd, const N: usize, const M: usize> TorqueTable<T, N, M> {
    /// The table of a motion, by its inverse dynamics at every instant.
    pub fn of(
        period: T,
        mut motion: impl FnMut(usize) -> Reference<T, N>,
        mut inverse_dynamics: impl FnMut(&[T; N], &[T; N], &[T; N], &mut [T; N]),
    ) -> Self {
        let rows = from_fn(|k| {
            let (at, mut tau) = (motion(k), [T::zero(); N]);
            inverse_dynamics(&at.q, &at.qd, &at.qdd, &mut tau);
            tau
        });
        TorqueTable { period, rows }
    }

    /// Between rows `k` and `k + 1`, `fraction` (0 to 1) of the way; at and beyond the last row, that row.
    pub fn at(&self, k: usize, fraction: T) -> [T; N] {
        let last = M.saturating_sub(1);
        match (self.rows.get(k.min(last)), self.rows.get(k.saturating_add(1).min(last))) {
            (Some(a), Some(b)) => from_fn(|i| a[i] + fraction * (b[i] - a[i])),
            _ => [T::zero(); N],
        }
    }
}

/// The greatest moduli that drives can do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TorqueLimits<T, const N: usize> {
    /// Per joint \[N·m or N\].
    pub greatest: [T; N],
}

/// What became of torques at their limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// They were within.
    Within,
    /// At least one was beyond, and is at its limit.
    Saturated,
    /// At least one is not a number or not finite: all are zero, and the drives are to be stopped.
    NotFinite,
}

impl<T: Real + PartialOrd, const N: usize> TorqueLimits<T, N> {
    /// Brings torques within the limits.
    pub fn apply(&self, tau: &mut [T; N]) -> Outcome {
        // of NaN and of infinities the product with zero is NaN
        let is_finite = |x: &T| *x * T::zero() == T::zero();
        if !tau.iter().all(is_finite) {
            stop(tau);
            return Outcome::NotFinite;
        }
        let mut outcome = Outcome::Within;
        for (tau, greatest) in tau.iter_mut().zip(self.greatest) {
            if *tau > greatest {
                (*tau, outcome) = (greatest, Outcome::Saturated);
            } else if *tau < -greatest {
                (*tau, outcome) = (-greatest, Outcome::Saturated);
            }
        }
        outcome
    }
}

/// What supplies and motors allow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorLimits<T, const M: usize> {
    /// Greatest voltage \[V\].
    pub voltage: [T; M],
    /// Greatest current \[A\].
    pub current: [T; M],
    /// R \[Ω\].
    pub resistance: [T; M],
    /// C_E \[V·s/rad\].
    pub emf_constant: [T; M],
}

impl<T: Real + PartialOrd, const M: usize> MotorLimits<T, M> {
    /// Brings voltages within the limits, at these speeds of the motors \[rad/s\]: a current that does not change any more is
    /// (u − C_E θ̇)/R, so u stays within C_E θ̇ ± R i_max; then within the supply's, which counts more.
    ///
    /// ```
    /// use straightline_core::control::{MotorLimits, Outcome};
    /// let limits = MotorLimits { voltage: [24.0], current: [5.0], resistance: [2.0], emf_constant: [0.1] };
    /// let mut u = [20.0];
    /// assert_eq!(limits.apply(&mut u, &[30.0]), Outcome::Saturated);
    /// assert_eq!(u, [3.0 + 10.0]);
    /// assert_eq!(limits.apply(&mut u, &[30.0]), Outcome::Within);
    /// ```
    pub fn apply(&self, u: &mut [T; M], speeds: &[T; M]) -> Outcome {
        let emf: [T; M] = from_fn(|k| self.emf_constant[k] * speeds[k]);
        let mut driving = from_fn(|k| u[k] - emf[k]);
        let by_current = TorqueLimits { greatest: from_fn(|k| self.resistance[k] * self.current[k]) };
        let first = by_current.apply(&mut driving);
        if first == Outcome::NotFinite {
            stop(u);
            return first;
        }
        if first == Outcome::Saturated {
            *u = added(&driving, &emf);
        }
        let by_voltage = TorqueLimits { greatest: self.voltage };
        match by_voltage.apply(u) {
            Outcome::Within => first,
            second => second,
        }
    }
}

/// All torques or voltages zero, one after the other: a loop that does not become a call of `memset`, which firmware may not have.
pub fn stop<T: Real, const N: usize>(tau: &mut [T; N]) {
    tau.iter_mut().for_each(|tau| *tau = core::hint::black_box(T::zero()));
}

fn added<T: Real, const N: usize>(a: &[T; N], b: &[T; N]) -> [T; N] {
    from_fn(|i| a[i] + b[i])
}
