//! Displacements of a configuration along its tangent (not in the chapter): those of most joints are added; a free link moves by the exponential of a
//! body twist, here of 4 × 4 matrices, by halving, the power series and squaring; a ball joint by its turn.

use super::scalar::ReferenceReal;
use super::tree::{CentreOfMassTree, ReferenceJoint};
use crate::dd::Dd;
use crate::real::Real;
use alloc::vec::Vec;
use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};

/// So many times a matrix is halved before its power series.
const HALVINGS: u32 = 8;
/// Terms of the series, which double-double needs of entries within a half.
const TERMS: u32 = 26;

/// exp A.
fn exponential<T: ReferenceReal>(a: &Matrix4<T>) -> Matrix4<T> {
    let constant = |x: f64| T::constant(Dd::from(x));
    let a = a * T::constant(Dd::ONE / Dd::from(f64::from(1u32 << HALVINGS)));
    // 1 + A (1 + A/2 (1 + A/3 (…)))
    let mut sum = Matrix4::identity();
    for k in (1..=TERMS).rev() {
        sum = Matrix4::identity() + a * sum / constant(f64::from(k));
    }
    (0..HALVINGS).fold(sum, |power, _| power * power)
}

fn of_vector<T: ReferenceReal>(w: &Vector3<T>) -> Matrix3<T> {
    let zero = <T as Real>::zero();
    Matrix3::new(zero, -w.z, w.y, w.z, zero, -w.x, -w.y, w.x, zero)
}

/// q ∘ x as a matrix times x = (x, y, z, w).
fn product_matrix<T: ReferenceReal>(q: &Vector4<T>) -> Matrix4<T> {
    let mut matrix = Matrix4::identity() * q.w;
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Matrix3::identity() * q.w + of_vector(&q.xyz())));
    matrix.fixed_view_mut::<3, 1>(0, 3).copy_from(&q.xyz());
    matrix.fixed_view_mut::<1, 3>(3, 0).copy_from(&(-q.xyz()).transpose());
    matrix
}

/// A unit quaternion of any quaternion.
fn normalised<T: ReferenceReal>(q: &[T]) -> Vector4<T> {
    let q = Vector4::from_column_slice(q);
    q / q.dot(&q).sqrt()
}

fn conjugate<T: ReferenceReal>(q: &Vector4<T>) -> Vector4<T> {
    Vector4::new(-q.x, -q.y, -q.z, q.w)
}

/// R of a unit quaternion: the vector part of q ∘ x ∘ q̄.
fn rotation<T: ReferenceReal>(q: &Vector4<T>) -> Matrix3<T> {
    let pure = |k: usize| {
        let mut unit = Vector4::zeros();
        unit[k] = <T as Real>::one();
        (product_matrix(&(product_matrix(q) * unit)) * conjugate(q)).xyz()
    };
    Matrix3::from_columns(&[pure(0), pure(1), pure(2)])
}

/// The unit quaternion of a rotation vector.
fn turned_by<T: ReferenceReal>(angular: &Vector3<T>) -> Vector4<T> {
    let half = angular * T::constant(Dd::HALF);
    exponential(&product_matrix(&half.push(<T as Real>::zero()))).column(3).into_owned()
}

/// The rotation vector, at most π long, of the turn from one unit quaternion to another, either of which may have the other sign.
fn turn_between<T: ReferenceReal>(own: &Vector4<T>, other: &Vector4<T>) -> Vector3<T> {
    let turn = product_matrix(&conjugate(own)) * other;
    let sign = if turn.w.sign() == -<T as Real>::one() { -<T as Real>::one() } else { <T as Real>::one() };
    rotation_vector(&(turn * sign))
}

/// The configuration that a displacement v of the tangent at q leads to; of a free link v is a body twist, (linear, angular).
pub fn displaced<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T], v: &[T]) -> Vec<T> {
    let mut to = q.to_vec();
    for link in tree.own() {
        if link.joint == ReferenceJoint::Ball {
            let turned = turned_by(&Vector3::from_column_slice(&v[link.iv..link.iv + 3]));
            let own = normalised(&q[link.iq..link.iq + 4]);
            to[link.iq..link.iq + 4].copy_from_slice((product_matrix(&own) * turned).as_slice());
            continue;
        }
        if link.joint != ReferenceJoint::Free {
            to[link.iq] = q[link.iq] + v[link.iv];
            continue;
        }
        let [linear, angular] = [0, 3].map(|k| Vector3::from_column_slice(&v[link.iv + k..link.iv + k + 3]));
        let mut twist = Matrix4::zeros();
        twist.fixed_view_mut::<3, 3>(0, 0).copy_from(&of_vector(&angular));
        twist.fixed_view_mut::<3, 1>(0, 3).copy_from(&linear);
        let moved = exponential(&twist).fixed_view::<3, 1>(0, 3).into_owned();
        let turned = turned_by(&angular);
        let own = normalised(&q[link.iq + 3..link.iq + 7]);
        let position = Vector3::from_column_slice(&q[link.iq..link.iq + 3]) + rotation(&own) * moved;
        to[link.iq..link.iq + 3].copy_from_slice(position.as_slice());
        to[link.iq + 3..link.iq + 7].copy_from_slice((product_matrix(&own) * turned).as_slice());
    }
    to
}

/// The shortest displacement of the tangent at q that leads to q₁.
pub fn displacement<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T], q1: &[T]) -> Vec<T> {
    let mut v = alloc::vec![<T as Real>::zero(); tree.nv()];
    for link in tree.own() {
        if link.joint == ReferenceJoint::Ball {
            let [own, other] = [q, q1].map(|q| normalised(&q[link.iq..link.iq + 4]));
            v[link.iv..link.iv + 3].copy_from_slice(turn_between(&own, &other).as_slice());
            continue;
        }
        if link.joint != ReferenceJoint::Free {
            v[link.iv] = q1[link.iq] - q[link.iq];
            continue;
        }
        let [own, other] = [q, q1].map(|q| normalised(&q[link.iq + 3..link.iq + 7]));
        let angular = turn_between(&own, &other);
        let [from, to] = [q, q1].map(|q| Vector3::from_column_slice(&q[link.iq..link.iq + 3]));
        let moved = rotation(&own).transpose() * (to - from);
        // V ρ = moved, with V column by column from the exponentials of unit twists
        let column = |k: usize| {
            let mut twist = Matrix4::zeros();
            twist.fixed_view_mut::<3, 3>(0, 0).copy_from(&of_vector(&angular));
            twist[(k, 3)] = <T as Real>::one();
            exponential(&twist).fixed_view::<3, 1>(0, 3).into_owned()
        };
        let [a, b, c] = [0, 1, 2].map(column);
        // Cramer's rule; |V| = (sin h/h)² of the half angle h is at least 4/π²
        let [bc, ca, ab] = [b.cross(&c), c.cross(&a), a.cross(&b)];
        let volume = a.dot(&bc);
        let linear = [bc, ca, ab].map(|x| x.dot(&moved) / volume);
        v[link.iv..link.iv + 3].copy_from_slice(&linear);
        v[link.iv + 3..link.iv + 6].copy_from_slice(angular.as_slice());
    }
    v
}

/// Steps towards the half angle, each of which leaves a sixth of the third power of what is missing.
const STEPS: usize = 8;

/// The rotation vector of a unit quaternion (sin h u, cos h) with 0 ≤ h ≤ π/2, by h ← h + sin(h* − h).
fn rotation_vector<T: ReferenceReal>(turn: &Vector4<T>) -> Vector3<T> {
    let (two, part) = (T::constant(Dd::from(2.0)), turn.xyz());
    let square = part.dot(&part);
    // where the quaternion hardly turns, its vector part is half the vector but for the series of the arc tangent
    let near = T::constant(Dd::from(1e-4));
    if (square - near).sign() == -<T as Real>::one() {
        let ratio = square / (turn.w * turn.w);
        let term = |k: usize| T::constant(Dd::ONE / Dd::from((2 * k + 1) as f64));
        let series = (0..10).rev().fold(<T as Real>::zero(), |sum, k| term(k) - ratio * sum);
        return part * (two * series / turn.w);
    }
    let sine = square.sqrt();
    let mut angle = T::constant(Dd::FRAC_PI_2) * T::constant(Dd::HALF);
    for _ in 0..STEPS {
        let (sin, cos) = angle.sin_cos();
        angle += sine * cos - turn.w * sin;
    }
    part * (two * angle / sine)
}

/// How a configuration changes, as an increment of the tangent there: of a free link that of its pose in its own axes, of a ball joint its turn, likewise.
pub fn increment<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T], rate: &[T]) -> Vec<T> {
    let mut v = alloc::vec![<T as Real>::zero(); tree.nv()];
    for link in tree.own() {
        let Some(first) = link.joint.quaternion() else {
            v[link.iv] = rate[link.iq];
            continue;
        };
        let quaternion = link.iq + first..link.iq + first + 4;
        let own = normalised(&q[quaternion.clone()]);
        let turned = product_matrix(&conjugate(&own)) * Vector4::from_column_slice(&rate[quaternion]);
        if link.joint == ReferenceJoint::Free {
            let moved = rotation(&own).transpose() * Vector3::from_column_slice(&rate[link.iq..link.iq + 3]);
            v[link.iv..link.iv + 3].copy_from_slice(moved.as_slice());
        }
        v[link.iv + first..link.iv + first + 3].copy_from_slice((turned.xyz() * T::constant(Dd::from(2.0))).as_slice());
    }
    v
}
