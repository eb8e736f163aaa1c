//! Fixed-step integrators for generated dynamics: no allocation, no library, a fixed number of operations per step.
//!
//! A robot moves by q̈ = f(t, q, q̇), given as a function over arrays, such as generated forward dynamics with torques in it.
//! Every method gives the [`Change`] of one step, which is added to a [`State`], or to a [`Compensated`] one: at small steps
//! most of a change is lost to rounding otherwise, in f32 already at a kilohertz.
//!
//! | method | order | for |
//! |---|---|---|
//! | [`Step::semi_implicit_euler`] | 1 | many cheap steps; energy drifts where inertia changes with q |
//! | [`Step::implicit_euler`] | 1 | stiff dampers and springs of the joints: stable at any step |
//! | [`Step::runge_kutta_4`] | 4 | smooth motion, most accurate for its cost |
//! | [`Step::implicit_midpoint`] | 2 | long runs: no drift of energy |
//!
//! **Joints whose coordinates are not sums of their rates.** Where q has more entries than q̇, [`Step::joints`] says which joints have them and
//! where they stand; each moves as its kind does. Of a floating base seven are position and quaternion (x, y, z, w), and its velocity stands in q̇
//! in its own axes, as everywhere in Straightline; of a ball joint four are a quaternion. Euler and midpoint steps turn both by the Cayley map, q ∘ (1 + a)/|1 + a| squared with a = h ω/4, a
//! rational rotation that agrees with the exponential to h³; the Runge-Kutta method integrates q̇ = ½ q ∘ ω. After every step quaternions
//! are brought back to length one, by Newton's iteration, without a root.
//!
//! ```
//! use straightline_core::integrate::{State, Step};
//! // a mass on a spring, q̈ = −q, over a quarter of its period
//! let mut state = State { q: [1.0], qd: [0.0] };
//! let step = Step::of(core::f64::consts::FRAC_PI_2 / 100.0);
//! for _ in 0..100 {
//!     state.add(&step.runge_kutta_4(0.0, &state, |_t, q, _qd, qdd: &mut [f64; 1]| qdd[0] = -q[0]), 0);
//! }
//! assert!(state.q[0].abs() < 1e-9 && (state.qd[0] + 1.0).abs() < 1e-9);
//! ```

use crate::dd::Dd;
use crate::joint::quaternion::inverse_length;
use crate::joint::{Descriptor, JointKind, Mechanics, FLOATING_BASE};
use crate::real::Real;
use core::array::from_fn;
use core::ops::Range;

/// Configuration and velocity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<T, const NQ: usize, const NV: usize> {
    /// q \[rad or m\].
    pub q: [T; NQ],
    /// q̇ \[rad/s or m/s\].
    pub qd: [T; NV],
}

/// A joint with other coordinates than rates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Uneven {
    /// How it moves.
    pub kind: JointKind,
    /// First index of its coordinates in q.
    pub first: usize,
}

impl Uneven {
    /// A floating base whose coordinates begin there.
    pub const fn floating_base(first: usize) -> Self {
        Uneven { kind: FLOATING_BASE, first }
    }
}

/// What one step adds to a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Change<T, const NQ: usize, const NV: usize> {
    /// To q, entry by entry, also of a quaternion.
    pub q: [T; NQ],
    /// To q̇.
    pub qd: [T; NV],
}

impl<T: Real, const NQ: usize, const NV: usize> State<T, NQ, NV> {
    /// Adds a change; `base`: first index of a floating base, which is not read without one.
    pub fn add(&mut self, change: &Change<T, NQ, NV>, base: usize) {
        self.add_over(change, &[Uneven::floating_base(base)]);
    }

    /// Adds a change; `joints` as in [`Step::joints`].
    pub fn add_over(&mut self, change: &Change<T, NQ, NV>, joints: &[Uneven]) {
        self.q = sum(&self.q, &change.q);
        self.qd = sum(&self.qd, &change.qd);
        for range in quaternions::<NQ, NV>(joints) {
            let inverse = inverse_length(&self.q[range.clone()]);
            self.q[range].iter_mut().for_each(|x| *x = *x * inverse);
        }
    }
}

/// A state with what rounding has cost it so far, so that many small steps add up as in twice the precision (Neumaier's sum).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compensated<T, const NQ: usize, const NV: usize> {
    /// As near to the sum of all changes as its scalar is.
    pub state: State<T, NQ, NV>,
    lost: State<T, NQ, NV>,
}

impl<T: Real, const NQ: usize, const NV: usize> Compensated<T, NQ, NV> {
    /// From a state that is exact.
    pub fn new(state: State<T, NQ, NV>) -> Self {
        Compensated { state, lost: State { q: [T::zero(); NQ], qd: [T::zero(); NV] } }
    }

    /// Adds a change; `base` as in [`State::add`].
    pub fn add(&mut self, change: &Change<T, NQ, NV>, base: usize) {
        self.add_over(change, &[Uneven::floating_base(base)]);
    }

    /// Adds a change; `joints` as in [`Step::joints`]. What brings a quaternion back to length one is a change like another: multiplied by
    /// it, its entries would be rounded at every step again.
    pub fn add_over(&mut self, change: &Change<T, NQ, NV>, joints: &[Uneven]) {
        for (x, (lost, dx)) in self.state.q.iter_mut().zip(self.lost.q.iter_mut().zip(change.q)) {
            (*x, *lost) = two_sum(*x, *lost + dx);
        }
        for (x, (lost, dx)) in self.state.qd.iter_mut().zip(self.lost.qd.iter_mut().zip(change.qd)) {
            (*x, *lost) = two_sum(*x, *lost + dx);
        }
        for range in quaternions::<NQ, NV>(joints) {
            let longer = inverse_length(&self.state.q[range.clone()]) - T::one();
            for (x, lost) in self.state.q[range.clone()].iter_mut().zip(&mut self.lost.q[range]) {
                (*x, *lost) = two_sum(*x, *lost + *x * longer);
            }
        }
    }
}

/// One step of a method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step<T> {
    /// Its length h \[s\].
    pub length: T,
    /// The joints with other coordinates than rates, in the order of their places: a floating base, which comes first unless the joints have an
    /// order of their own. Without any (as many entries in q as in q̇) it is not read; with some, they must lie within q.
    pub joints: &'static [Uneven],
}

impl<T: Real> Step<T> {
    /// A step of this length \[s\]; a floating base comes first.
    pub fn of(length: T) -> Self {
        const FIRST: &[Uneven] = &[Uneven::floating_base(0)];
        Step { length, joints: FIRST }
    }

    /// q̇' = q̇ + h f(t, q, q̇), then q' = q ⊕ h q̇': symplectic where H is constant, as then q̇ is the momentum but for a factor.
    pub fn semi_implicit_euler<const NQ: usize, const NV: usize>(
        &self,
        t: T,
        state: &State<T, NQ, NV>,
        mut acceleration: impl FnMut(T, &[T; NQ], &[T; NV], &mut [T; NV]),
    ) -> Change<T, NQ, NV> {
        let mut qdd = [T::zero(); NV];
        acceleration(t, &state.q, &state.qd, &mut qdd);
        let qd = scaled(&qdd, self.length);
        let q = self.displacement(&state.q, &sum(&state.qd, &qd), self.length);
        Change { q, qd }
    }

    /// Euler's method, implicit in viscous friction D and springs K of the joints, which are linear:
    /// (H + h D + h² K) q̈ = f − h K q̇, then as [`Step::semi_implicit_euler`].
    ///
    /// `mass_matrix` gives H(q) \[kg·m² or kg\], `force` τ − h(q, q̇) \[N·m or N\], with friction and springs in it as generated
    /// bias forces have them; `damping` \[N·m·s/rad or N·s/m\] and `stiffness` \[N·m/rad or N/m\] are the diagonals of D and K, not
    /// negative. The matrix is positive definite, so that its factor's divisors do not vanish.
    pub fn implicit_euler<const NQ: usize, const NV: usize>(
        &self,
        state: &State<T, NQ, NV>,
        damping: &[T; NV],
        stiffness: &[T; NV],
        mut mass_matrix: impl FnMut(&[T; NQ], &mut [[T; NV]; NV]),
        mut force: impl FnMut(&[T; NQ], &[T; NV], &mut [T; NV]),
    ) -> Change<T, NQ, NV> {
        let h = self.length;
        let (mut matrix, mut f) = ([[T::zero(); NV]; NV], [T::zero(); NV]);
        mass_matrix(&state.q, &mut matrix);
        force(&state.q, &state.qd, &mut f);
        for i in 0..NV {
            matrix[i][i] = matrix[i][i] + h * (damping[i] + h * stiffness[i]);
            f[i] = f[i] - h * stiffness[i] * state.qd[i];
        }
        let qd = scaled(&solved(matrix, f), h);
        let q = self.displacement(&state.q, &sum(&state.qd, &qd), h);
        Change { q, qd }
    }

    /// The classical Runge-Kutta method of order four.
    pub fn runge_kutta_4<const NQ: usize, const NV: usize>(
        &self,
        t: T,
        state: &State<T, NQ, NV>,
        mut acceleration: impl FnMut(T, &[T; NQ], &[T; NV], &mut [T; NV]),
    ) -> Change<T, NQ, NV> {
        let h = self.length;
        let half = h * T::constant(Dd::HALF);
        let mut slope = |t: T, at: &State<T, NQ, NV>| {
            let mut qd = [T::zero(); NV];
            acceleration(t, &at.q, &at.qd, &mut qd);
            Change { q: self.rate(&at.q, &at.qd), qd }
        };
        let moved = |k: &Change<T, NQ, NV>, h: T| State {
            q: sum(&state.q, &scaled(&k.q, h)),
            qd: sum(&state.qd, &scaled(&k.qd, h)),
        };
        let k1 = slope(t, state);
        let k2 = slope(t + half, &moved(&k1, half));
        let k3 = slope(t + half, &moved(&k2, half));
        let k4 = slope(t + h, &moved(&k3, h));
        let sixth = h / T::constant(Dd::from(6.0));
        let mean = |a: T, b: T, c: T, d: T| sixth * ((a + d) + (b + b) + (c + c));
        Change {
            q: from_fn(|i| mean(k1.q[i], k2.q[i], k3.q[i], k4.q[i])),
            qd: from_fn(|i| mean(k1.qd[i], k2.qd[i], k3.qd[i], k4.qd[i])),
        }
    }

    /// The implicit midpoint rule, by so many fixed-point iterations: q̇ₘ = q̇ + ½h f(t + ½h, q ⊕ ½h q̇ₘ, q̇ₘ), then
    /// q̇' = 2 q̇ₘ − q̇ and q' = q ⊕ h q̇ₘ. Symmetric and, up to what the iterations leave, symplectic. Each iteration gains the factor
    /// h times the rate at which q̈ changes with q̇ (or h² times that with q); 3 to 6 are usual.
    pub fn implicit_midpoint<const NQ: usize, const NV: usize>(
        &self,
        t: T,
        state: &State<T, NQ, NV>,
        iterations: usize,
        mut acceleration: impl FnMut(T, &[T; NQ], &[T; NV], &mut [T; NV]),
    ) -> Change<T, NQ, NV> {
        let half = self.length * T::constant(Dd::HALF);
        let (mut qdd, mut middle) = ([T::zero(); NV], state.qd);
        for _ in 0..iterations {
            let q = sum(&state.q, &self.displacement(&state.q, &middle, half));
            acceleration(t + half, &q, &middle, &mut qdd);
            middle = sum(&state.qd, &scaled(&qdd, half));
        }
        Change { q: self.displacement(&state.q, &middle, self.length), qd: scaled(&qdd, self.length) }
    }

    /// The change of q in the time `h` at constant q̇, of a base at constant velocity in its own axes.
    pub fn displacement<const NQ: usize, const NV: usize>(&self, q: &[T; NQ], qd: &[T; NV], h: T) -> [T; NQ] {
        over_joints(
            (q, qd),
            uneven::<_, NQ, NV>(self.joints),
            |rate| rate * h,
            |joint, q, qd, change| {
                joint.displacement(q, qd, h, change);
            },
        )
    }

    /// dq/dt: q̇ itself of most joints, of a base R v and ½ q ∘ ω.
    fn rate<const NQ: usize, const NV: usize>(&self, q: &[T; NQ], qd: &[T; NV]) -> [T; NQ] {
        over_joints(
            (q, qd),
            uneven::<_, NQ, NV>(self.joints),
            |rate| rate,
            |joint, q, qd, rate| {
                joint.configuration_rate(q, qd, rate);
            },
        )
    }
}

/// The mechanics of a joint, and where its coordinates stand.
struct JointPlace<'a, T> {
    first: usize,
    row: &'static Descriptor,
    mechanics: &'a dyn Mechanics<T>,
}

/// The joints of a robot with so many coordinates; none where there are as many as rates.
fn uneven<'a, T: Real + 'a, const NQ: usize, const NV: usize>(
    joints: &'a [Uneven],
) -> impl Iterator<Item = JointPlace<'a, T>> {
    let joints = if NQ == NV { &[] } else { joints };
    joints.iter().map(|Uneven { kind, first }| JointPlace {
        first: *first,
        row: kind.row(),
        mechanics: kind.mechanics(),
    })
}

/// What becomes of each rate at the entry of q that it belongs to, and of the rates of each of these joints at its own.
fn over_joints<'a, T: Real + 'a, const NQ: usize, const NV: usize>(
    (q, qd): (&[T; NQ], &[T; NV]),
    joints: impl Iterator<Item = JointPlace<'a, T>>,
    of_rate: impl Fn(T) -> T,
    of_joint: impl Fn(&dyn Mechanics<T>, &[T], &[T], &mut [T]),
) -> [T; NQ] {
    let mut all = [T::zero(); NQ];
    let (mut iq, mut iv) = (0, 0);
    for JointPlace { first, row, mechanics } in joints {
        while iq < first {
            all[iq] = of_rate(qd[iv]);
            (iq, iv) = (iq + 1, iv + 1);
        }
        let (after, beyond) = (iq + row.neutral.len(), iv + row.measures.len());
        of_joint(mechanics, &q[iq..after], &qd[iv..beyond], &mut all[iq..after]);
        (iq, iv) = (after, beyond);
    }
    for (entry, rate) in all[iq..].iter_mut().zip(&qd[iv..]) {
        *entry = of_rate(*rate);
    }
    all
}

/// Where in q the quaternions of joints stand.
fn quaternions<const NQ: usize, const NV: usize>(joints: &[Uneven]) -> impl Iterator<Item = Range<usize>> + '_ {
    let joints = if NQ == NV { &[] } else { joints };
    joints.iter().filter_map(|joint| {
        let first = joint.first + joint.kind.row().quaternion?;
        Some(first..first + 4)
    })
}

fn sum<T: Real, const N: usize>(a: &[T; N], b: &[T; N]) -> [T; N] {
    from_fn(|i| a[i] + b[i])
}

fn scaled<T: Real, const N: usize>(a: &[T; N], k: T) -> [T; N] {
    from_fn(|i| a[i] * k)
}

/// a + b and what its rounding loses, exactly (Knuth).
fn two_sum<T: Real>(a: T, b: T) -> (T, T) {
    let s = a + b;
    let from_b = s - a;
    (s, (a - (s - from_b)) + (b - from_b))
}

/// x of A x = b with A symmetric and positive definite, by its LDLᵀ factor.
fn solved<T: Real, const N: usize>(mut a: [[T; N]; N], mut b: [T; N]) -> [T; N] {
    for j in 0..N {
        for k in 0..j {
            let weight = a[j][k] * a[k][k];
            a[j..].iter_mut().for_each(|row| row[j] = row[j] - row[k] * weight);
        }
        let inverse = T::one() / a[j][j];
        a[j + 1..].iter_mut().for_each(|row| row[j] = row[j] * inverse);
    }
    for i in 0..N {
        for k in 0..i {
            b[i] = b[i] - a[i][k] * b[k];
        }
    }
    b = from_fn(|i| b[i] / a[i][i]);
    for i in (0..N).rev() {
        for k in i + 1..N {
            b[i] = b[i] - a[k][i] * b[k];
        }
    }
    b
}

#[cfg(test)]
mod tests {
    use super::*;
    /// Two ball joints between joints of one coordinate: (1, 4, 1, 4, 1) coordinates, (1, 3, 1, 3, 1) rates.
    #[test]
    fn joints_with_other_coordinates_than_rates_move_as_their_kind_does_wherever_they_stand() {
        const fn ball(first: usize) -> Uneven {
            Uneven { kind: JointKind::Spherical, first }
        }
        const BALLS: &[Uneven] = &[ball(1), ball(6)];
        let mut q = [0.0f64; 11];
        q[1..5].fill(0.5);
        q[9] = 1.0;
        let qd = [1.0, 0.0, 0.0, 2.0, 3.0, 4.0, 0.0, 0.0, 5.0];
        let step = Step { length: 0.1, joints: BALLS };
        let rate = step.rate(&q, &qd);
        assert_eq!(rate, [1.0, 0.5, -0.5, 0.5, -0.5, 3.0, 2.0, 0.0, 0.0, 0.0, 5.0]);
        // a Cayley turn through 2 atan(h ω/4) twice: what is missing to the rate is of the order of (h ω)²
        let change = step.displacement(&q, &qd, 0.1);
        assert!(change.iter().zip(rate).all(|(change, rate)| (change - 0.1 * rate).abs() < 0.02), "{change:?}");
        let mut state = State { q, qd };
        state.add_over(&Change { q: change, qd: [0.0; 9] }, BALLS);
        let angle = |of: &[f64], from: &[f64]| 2.0 * of.iter().zip(from).map(|(a, b)| a * b).sum::<f64>().acos();
        assert!((angle(&state.q[1..5], &q[1..5]) - 4.0 * (0.05f64).atan()).abs() < 1e-7);
        assert!((angle(&state.q[6..10], &q[6..10]) - 4.0 * (0.1f64).atan()).abs() < 1e-7);
    }

    /// As many coordinates as rates: what is said of such joints is not read.
    #[test]
    fn a_robot_without_such_joints_moves_by_its_rates() {
        let step = Step { length: 0.5, joints: &[Uneven { kind: FLOATING_BASE, first: 9 }] };
        assert_eq!(step.displacement(&[0.0; 2], &[1.0, 2.0], 0.5), [0.5, 1.0]);
        let mut state = State { q: [0.0; 2], qd: [1.0, 2.0] };
        state.add(&Change { q: [1.0, 1.0], qd: [0.0; 2] }, 9);
        assert_eq!(state.q, [1.0, 1.0]);
    }
}
