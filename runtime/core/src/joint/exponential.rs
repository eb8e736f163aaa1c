//! The exponential of rigid motions and its inverse, and what both do to tangents.
//!
//! A twist (ρ, w), linear and angular part in the axes of the body, moves it in unit time by (V(w) ρ, exp [w×]),
//! V(w) = Σ [w×]ᵏ/(k + 1)! = 1 + c₂ [w×] + c₃ [w×]², exp [w×] = 1 + c₁ [w×] + c₂ [w×]² with Stumpff's functions c_k of w·w
//! (Murray, Li, Sastry 1994, section 2.3). How that motion changes with the twist says the right Jacobian
//! J_r = Σ (−ad)ᵏ/(k + 1)! (Chirikjian 2011, section 10.7), the same series in 6 × 6 matrices. ad of a twist is [w×] of the dual vector w + e ρ, e² = 0
//! (Study's principle of transference), so that matrices of 6 × 6 are those of turns in dual numbers: [`TwistMap`].
//!
//! There is no comparison. Up to an angle of 2 everything is a series in w·w, so that small angles lose nothing and zero is no case of its own;
//! beyond it a closed form of the angle, in which nothing cancels there. A weight of 0 or 1 chooses. Logarithms come from half-angle cosines and one
//! series, without an arctangent.

use crate::dd::Dd;
use crate::dual::Dual;
use crate::real::Real;
use crate::spatial::{Mat3, Vec3};

fn constant<T: Real>(value: f64) -> T {
    T::constant(Dd::from(value))
}

/// Stumpff's functions c_k(x) = Σ (−x)ʲ/(k + 2j)!, k = 0 … 5, of the square x of an angle (Stiefel, Scheifele 1971, section 11):
/// c₀ = cos √x, c₁ = sin √x/√x, and c_k = 1/k! − x c_{k+2}.
struct Stumpff<T> {
    x: T,
    c: [T; 6],
}

/// So many terms of the series have the digits of double-double up to x = 1: the next one is 1e-34.
const TERMS: u32 = 13;

impl<T: Real> Stumpff<T> {
    /// By series, x at most 1.
    fn near(x: T) -> Self {
        let series = |first: u32| {
            let coefficient = |j: u32| {
                let factorial = (2..=first + 2 * j).fold(Dd::ONE, |product, k| product * Dd::from(f64::from(k)));
                T::constant(Dd::ONE / factorial)
            };
            (0..TERMS - 1).rev().fold(coefficient(TERMS - 1), |sum, j| coefficient(j) - x * sum)
        };
        let (c4, c5) = (series(4), series(5));
        let c3 = T::constant(Dd::ONE / Dd::from(6.0)) - x * c5;
        let c2 = T::constant(Dd::HALF) - x * c4;
        Stumpff { x, c: [T::one() - x * c2, T::one() - x * c3, c2, c3, c4, c5] }
    }

    /// Of twice the angle (Mikkola 1997, eq. 14): sums of positive terms up to a right angle.
    fn doubled(&self) -> Self {
        let [c0, c1, c2, c3, c4, c5] = self.c;
        let x = self.x * constant(4.0);
        let next2 = T::constant(Dd::HALF) * c1 * c1;
        let next3 = constant::<T>(0.25) * (c2 + c0 * c3);
        let next4 = constant::<T>(0.125) * (c3 + c3 * c1);
        let next5 = constant::<T>(0.0625) * (c5 + c4 + c3 * c2);
        Stumpff { x, c: [T::one() - x * next2, c0 * c1, next2, next3, next4, next5] }
    }
}

/// A number that depends on the square of an angle: its value and its derivative by that.
#[derive(Clone, Copy)]
struct OfSquare<T> {
    value: T,
    slope: T,
}

impl<T: Real> OfSquare<T> {
    fn fixed(value: T) -> Self {
        OfSquare { value, slope: T::zero() }
    }

    fn minus(self) -> Self {
        OfSquare { value: -self.value, slope: -self.slope }
    }
}

/// Beyond this square of an angle closed forms are taken.
const FAR: f64 = 4.0;

/// A turn by a rotation vector w of any length.
pub(super) struct FreeTurn<T> {
    /// sin(|w|/2)/|w|.
    half_sine: T,
    /// cos(|w|/2).
    half_cosine: T,
    c2: T,
    c3: T,
    c4: T,
    c5: T,
}

impl<T: Real> FreeTurn<T> {
    fn new(w: Vec3<T>) -> Self {
        let (one, half, far) = (T::one(), T::constant(Dd::HALF), constant::<T>(FAR));
        let square = w.dot(w);
        // 1 up to the limit, 0 beyond it
        let is_near = (one + (far - square).sign()).sign();
        let is_far = one - is_near;
        let near_square = is_near * square;
        let half_angle = Stumpff::near(near_square * constant(0.25));
        let near = half_angle.doubled();
        // the square itself where it is far, else the limit: no divisor is less
        let far_square = is_far * square + is_near * far;
        let angle = far_square.sqrt();
        let (sin, cos) = (angle * half).sin_cos();
        let half_sine = sin / angle;
        let inverse = one / far_square;
        // c₂ of the sine itself, whose square the root of the angle has no part in
        let c2 = (sin + sin) * sin * inverse;
        // c_{k+2} = (1/k! − c_k)/x
        let c3 = (one - (half_sine + half_sine) * cos) * inverse;
        let c4 = (half - c2) * inverse;
        let c5 = (T::constant(Dd::ONE / Dd::from(6.0)) - c3) * inverse;
        let either = |near: T, far: T| is_near * near + is_far * far;
        FreeTurn {
            half_sine: either(half * half_angle.c[1], half_sine),
            half_cosine: either(half_angle.c[0], cos),
            c2: either(near.c[2], c2),
            c3: either(near.c[3], c3),
            c4: either(near.c[4], c4),
            c5: either(near.c[5], c5),
        }
    }

    /// c₁, with the derivative ½ (c₃ − c₂); likewise c₂, c₄ − ½ c₃, and c₃, ½ (3 c₅ − c₄).
    fn coefficients(&self) -> [OfSquare<T>; 3] {
        let half = T::constant(Dd::HALF);
        let c2 = self.c2;
        let c1 = (self.half_sine + self.half_sine) * self.half_cosine;
        [
            OfSquare { value: c1, slope: half * (self.c3 - c2) },
            OfSquare { value: c2, slope: self.c4 - half * self.c3 },
            OfSquare { value: self.c3, slope: half * (constant::<T>(3.0) * self.c5 - self.c4) },
        ]
    }
}

/// exp of a twist: where it moves a body in unit time, as position and unit quaternion (x, y, z, w).
pub(super) fn exponential<T: Real>([rho, w]: [Vec3<T>; 2]) -> (Vec3<T>, [T; 4]) {
    let turn = FreeTurn::new(w);
    let [_, c2, c3] = turn.coefficients();
    let across = w.cross(rho);
    let position = rho + across.scale(c2.value) + w.cross(across).scale(c3.value);
    let u = w.scale(turn.half_sine);
    (position, [u.x, u.y, u.z, turn.half_cosine])
}

/// Terms of the series of φ/sin φ in s = sin²(φ/2), Σ s^k Π 2j/(2j + 1), up to φ = π/16: the next one is 1e-33.
const LOGARITHM_TERMS: u32 = 16;

/// The rotation vector, at most π long, of a unit quaternion with a scalar part c ≥ 0: 2 h u/sin h with cos h = c. Of h = 8 φ the halves have
/// cos² = (1 + cos)/2, and sin 8φ = 8 sin φ cos φ cos 2φ cos 4φ.
fn rotation_vector<T: Real>(u: Vec3<T>, c: T) -> Vec3<T> {
    let (one, half) = (T::one(), T::constant(Dd::HALF));
    let halved = |cos: T| (half + half * cos).sqrt();
    let cos4 = halved(c);
    let cos2 = halved(cos4);
    let cos1 = halved(cos2);
    let s = half * (one - cos1);
    let coefficient = |k: u32| {
        let factor = |j: u32| Dd::from(f64::from(2 * j)) / Dd::from(f64::from(2 * j + 1));
        T::constant((1..=k).fold(Dd::ONE, |product, j| product * factor(j)))
    };
    let last = LOGARITHM_TERMS - 1;
    let series = (0..last).rev().fold(coefficient(last), |sum, k| coefficient(k) + s * sum);
    let ratio = series / (cos1 * cos2 * cos4);
    u.scale(ratio + ratio)
}

/// k of J_r⁻¹ = 1 + ½ [w×] + k [w×]² for |w| ≤ π: k = (1 − h cot h)/(4 h²), h = |w|/2, which is (c₂ − c₃)/(4 c₁) of h².
fn cotangent_part<T: Real>(w: Vec3<T>) -> OfSquare<T> {
    let [_, c1, c2, c3, c4, c5] = Stumpff::near(w.dot(w) * constant(0.0625)).doubled().c;
    let inverse = T::one() / c1;
    let k = (c2 - c3) * inverse;
    // its derivative by h², of c₁' = ½ (c₃ − c₂), c₂' = c₄ − ½ c₃, c₃' = ½ (3 c₅ − c₄)
    let slope = (constant::<T>(3.0) * (c4 - c5) - c3) * inverse + k * k;
    OfSquare { value: constant::<T>(0.25) * k, slope: constant::<T>(0.03125) * slope }
}

/// log: the twist, with an angle of at most π, that moves a body from one pose to another. Quaternions may have any length but zero, and
/// either sign.
pub(super) fn logarithm<T: Real>((p0, q0): (Vec3<T>, [T; 4]), (p1, q1): (Vec3<T>, [T; 4])) -> [Vec3<T>; 2] {
    let dot = |a: &[T; 4], b: &[T; 4]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    let [square0, square1] = [&q0, &q1].map(|q| dot(q, q));
    let [inverse0, inverse1] = [square0, square1].map(|square| T::one() / square.sqrt());
    let cosine = dot(&q0, &q1);
    // 1, also of half a turn, or −1 where −q₁ is the nearer one
    let sign = (cosine.sign() + T::constant(Dd::HALF)).sign();
    // the vector part of q̄₀ q₁ is that of q̄₀ (q₁ − q₀): what is alike in both goes before anything is rounded
    let [x, y, z, w]: [T; 4] = core::array::from_fn(|k| sign * q1[k] - q0[k]);
    let (own, other) = (Vec3::new(q0[0], q0[1], q0[2]), Vec3::new(x, y, z));
    let vector = other.scale(q0[3]) - own.scale(w) - own.cross(other);
    let both = inverse0 * inverse1;
    let w = rotation_vector(vector.scale(both), sign * cosine * both);
    // Rᵀ d = d + (2/|q|²) ((d × s) × s + (d × s) w) of q = (s, w)
    let apart = p1 - p0;
    let turned = apart.cross(own);
    let turned = turned.cross(own) + turned.scale(q0[3]);
    let displacement = apart + turned.scale(T::constant(Dd::from(2.0)) / square0);
    // V⁻¹ = 1 − ½ [w×] + k [w×]²
    let across = w.cross(displacement);
    let k = cotangent_part(w).value;
    [displacement - across.scale(T::constant(Dd::HALF)) + w.cross(across).scale(k), w]
}

/// A linear map of twists (linear, angular): [[M, N], [0, M]], the matrix M + e N over dual numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TwistMap<T> {
    same: Mat3<T>,
    coupling: Mat3<T>,
}

impl<T: Real> TwistMap<T> {
    /// a + b [w×] + c [w×]² of the dual vector w + e ρ.
    fn new([rho, w]: [Vec3<T>; 2], a: T, b: OfSquare<T>, c: OfSquare<T>) -> Self {
        let along = w.dot(rho);
        let rate = along + along;
        let of_square = |x: OfSquare<T>| Dual { value: x.value, derivatives: [x.slope * rate] };
        let (b, c) = (of_square(b), of_square(c));
        let [x, y, z]: [Dual<T, 1>; 3] =
            [(w.x, rho.x), (w.y, rho.y), (w.z, rho.z)].map(|(value, rate)| Dual { value, derivatives: [rate] });
        let [xx, yy, zz] = [x, y, z].map(|x| c * (x * x));
        let [xy, xz, yz] = [x * y, x * z, y * z].map(|product| c * product);
        let [bx, by, bz] = [x, y, z].map(|x| b * x);
        let a = Dual::fixed(a);
        // [w×]² = w wᵀ − w·w
        let dual =
            [[a - (yy + zz), xy - bz, xz + by], [xy + bz, a - (xx + zz), yz - bx], [xz - by, yz + bx, a - (xx + yy)]];
        TwistMap {
            same: Mat3 { rows: dual.map(|row| row.map(|x| x.value)) },
            coupling: Mat3 { rows: dual.map(|row| row.map(|x| x.derivatives[0])) },
        }
    }

    /// Of a linear and an angular part.
    pub(crate) fn apply(&self, [linear, angular]: [Vec3<T>; 2]) -> [Vec3<T>; 2] {
        [self.same * linear + self.coupling * angular, self.same * angular]
    }

    /// Of a turn alone, about the origin.
    pub(crate) fn apply_to_turn(&self, angular: Vec3<T>) -> Vec3<T> {
        self.same * angular
    }

    /// How exp of a twist, in its own axes, moves with the pose before it, Ad(exp(−v)), and with the twist, J_r(v).
    pub(super) fn of_exponential(v: [Vec3<T>; 2]) -> [Self; 2] {
        let [c1, c2, c3] = FreeTurn::new(v[1]).coefficients();
        [TwistMap::new(v, T::one(), c1.minus(), c2), TwistMap::new(v, T::one(), c2.minus(), c3)]
    }

    /// How log of the way between two poses moves with the one, −J_r⁻¹(v) Ad(exp(−v)) = −J_r⁻¹(−v), and with the other, J_r⁻¹(v).
    pub(super) fn of_logarithm(v: [Vec3<T>; 2]) -> [Self; 2] {
        let (k, half) = (cotangent_part(v[1]), OfSquare::fixed(T::constant(Dd::HALF)));
        [TwistMap::new(v, -T::one(), half, k.minus()), TwistMap::new(v, T::one(), half, k)]
    }

    /// 1 + ½ ad + 1/12 ad² of a twist: J_r⁻¹ but for ad⁴/720.
    pub(super) fn rate_of_logarithm(v: [Vec3<T>; 2]) -> Self {
        let [half, twelfth] = [Dd::HALF, Dd::ONE / Dd::from(12.0)].map(|x| OfSquare::fixed(T::constant(x)));
        TwistMap::new(v, T::one(), half, twelfth)
    }

    /// How that, of a twist u, changes with u where it acts on v: −½ ad_v − 1/12 (ad_{ad_u v} + ad_u ad_v).
    pub(super) fn slope_of_rate(u: [Vec3<T>; 2], v: [Vec3<T>; 2]) -> Self {
        let (zero, one) = (OfSquare::fixed(T::zero()), OfSquare::fixed(T::one()));
        let ad = |v: [Vec3<T>; 2]| TwistMap::new(v, T::zero(), one, zero);
        let (ad_u, ad_v) = (ad(u), ad(v));
        let twice = ad_u.times(&ad_v).plus(&ad(ad_u.apply(v)));
        let twelfth = twice.scaled(T::constant(Dd::ONE / Dd::from(12.0)));
        ad_v.scaled(T::constant(Dd::HALF)).plus(&twelfth).scaled(-T::one())
    }

    fn times(&self, other: &Self) -> Self {
        let product =
            |a: &Mat3<T>, b: &Mat3<T>| Mat3::from_columns(*a * b.column(0), *a * b.column(1), *a * b.column(2));
        let coupling = [product(&self.same, &other.coupling), product(&self.coupling, &other.same)];
        TwistMap { same: product(&self.same, &other.same), coupling: sum(&coupling[0], &coupling[1]) }
    }

    fn plus(&self, other: &Self) -> Self {
        TwistMap { same: sum(&self.same, &other.same), coupling: sum(&self.coupling, &other.coupling) }
    }

    fn scaled(&self, k: T) -> Self {
        TwistMap { same: self.same.map(|x| x * k), coupling: self.coupling.map(|x| x * k) }
    }
}

fn sum<T: Real>(a: &Mat3<T>, b: &Mat3<T>) -> Mat3<T> {
    Mat3 { rows: core::array::from_fn(|i| core::array::from_fn(|j| a.rows[i][j] + b.rows[i][j])) }
}
