//! Robot in contact: functional coordinates, constrained motion, impact, environment, as the chapter has them.
//!
//! Sections 20.5.2 and 20.5.3, equations (20.83)–(20.97), solved as they are printed (where they were corrected, it says so):
//! one dense system of all unknowns, without eliminating any. Coordinates are products of vectors in the external frame, and
//! their derivatives are taken by the rule of Leibniz, the object's axes turning where it moves.

use super::{equations_of_motion, frame_jacobian, frame_jacobian_bias, frame_pose, frame_velocity};
use super::{CentreOfMassFrame, CentreOfMassTree, ReferenceReal};
use crate::dd::Dd;
use alloc::vec::Vec;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// One functional coordinate of the robot's frame against the object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    /// The frame's origin along X, Y or Z of the object: 0, 1, 2.
    Position(usize),
    /// The tool axis along X, Y or Z.
    Axis(usize),
    /// The second axis of the tool along X, Y or Z.
    SecondAxis(usize),
    /// Distance from a sphere about the object's origin.
    Sphere,
    /// Distance from a cylinder about the object's X axis.
    Cylinder,
}

/// A frame of the robot and an object that moves by a law.
#[derive(Clone, Debug)]
pub struct ContactFrames<T: ReferenceReal> {
    /// The frame of the robot.
    pub frame: CentreOfMassFrame<T>,
    /// Tool axis and second axis in the axes of that frame.
    pub axes: [Vector3<T>; 2],
    /// Origin of the object.
    pub origin: Vector3<T>,
    /// Its axes X, Y, Z, as columns.
    pub object: Matrix3<T>,
    /// Velocity of its origin, its angular velocity, acceleration of its origin, its angular acceleration.
    pub motion: [Vector3<T>; 4],
    /// Radius of a curved surface.
    pub radius: T,
}

/// A coordinate with what (20.84) needs of it.
#[derive(Clone, Debug)]
pub struct Derivatives<T: ReferenceReal> {
    /// s.
    pub s: T,
    /// ṡ.
    pub sd: T,
    /// J: ∂s/∂q.
    pub jacobian: DVector<T>,
    /// A: s̈ for q̈ = 0.
    pub adjoint: T,
}

/// s, ṡ, J and A of one coordinate.
pub fn functional_coordinate<T: ReferenceReal>(
    tree: &CentreOfMassTree<T>,
    contact: &ContactFrames<T>,
    q: &[T],
    qd: &[T],
    component: Component,
) -> Derivatives<T> {
    let frame = &contact.frame;
    let pose = frame_pose(tree, frame, q);
    let velocity = frame_velocity(tree, frame, q, qd);
    let bias = frame_jacobian_bias(tree, frame, q, qd);
    let jacobian = frame_jacobian(tree, frame, q);
    let (v, omega) = (velocity.fixed_rows::<3>(0).into_owned(), velocity.fixed_rows::<3>(3).into_owned());
    let (w, gamma) = (bias.fixed_rows::<3>(0).into_owned(), bias.fixed_rows::<3>(3).into_owned());
    let [v_object, omega_object, w_object, epsilon_object] = &contact.motion;
    // a vector that turns with ω: ȧ = ω × a,  ä = ε × a + ω × (ω × a)
    let turning = |a: Vector3<T>, omega: &Vector3<T>, epsilon: &Vector3<T>| {
        (a, omega.cross(&a), epsilon.cross(&a) + omega.cross(&omega.cross(&a)))
    };
    let of_object = |k: usize| turning(contact.object.column(k).into_owned(), omega_object, epsilon_object);
    // the vector of the frame, its derivatives, and what q̇_i = 1 does to it
    let position = || {
        let columns = (0..tree.nv()).map(|i| jacobian.fixed_view::<3, 1>(0, i).into_owned()).collect();
        (pose.position - contact.origin, v - v_object, w - w_object, columns)
    };
    let axis = |which: usize| {
        let (a, ad, add) = turning(pose.rotation * contact.axes[which], &omega, &gamma);
        let column = |i: usize| jacobian.fixed_view::<3, 1>(3, i).into_owned().cross(&a);
        (a, ad, add, (0..tree.nv()).map(column).collect::<Vec<Vector3<T>>>())
    };
    // s = a · X:  ṡ = ȧ · X + a · Ẋ,  s̈ = ä · X + 2 ȧ · Ẋ + a · Ẍ
    let product = |(a, ad, add, columns): (Vector3<T>, Vector3<T>, Vector3<T>, Vec<Vector3<T>>), k: usize| {
        let (x, xd, xdd) = of_object(k);
        let mixed = ad.dot(&xd);
        Derivatives {
            s: a.dot(&x),
            sd: ad.dot(&x) + a.dot(&xd),
            jacobian: DVector::from_iterator(columns.len(), columns.iter().map(|c| c.dot(&x))),
            adjoint: add.dot(&x) + mixed + mixed + a.dot(&xdd),
        }
    };
    // |d| − r of some components of the position in the object's frame
    let distance = |directions: &[usize]| {
        let parts: Vec<Derivatives<T>> = directions.iter().map(|k| product(position(), *k)).collect();
        let sum = |f: &dyn Fn(&Derivatives<T>) -> T| parts.iter().fold(nalgebra::zero::<T>(), |sum, p| sum + f(p));
        let length = sum(&|p| p.s * p.s).sqrt();
        // l l̇ = Σ s ṡ,  l̇² + l l̈ = Σ (ṡ² + s s̈)
        let rate = sum(&|p| p.s * p.sd) / length;
        let mut row = DVector::zeros(tree.nv());
        parts.iter().for_each(|p| row += &p.jacobian * (p.s / length));
        Derivatives {
            s: length - contact.radius,
            sd: rate,
            jacobian: row,
            adjoint: (sum(&|p| p.sd * p.sd + p.s * p.adjoint) - rate * rate) / length,
        }
    };
    match component {
        Component::Position(k) => product(position(), k),
        Component::Axis(k) => product(axis(0), k),
        Component::SecondAxis(k) => product(axis(1), k),
        Component::Sphere => distance(&[0, 1, 2]),
        Component::Cylinder => distance(&[1, 2]),
    }
}

/// x of a x = b by elimination, rows in the order given: for the systems of this module, whose leading minors do not vanish
/// as H is positive definite and the rows of J are independent.
fn solve<T: ReferenceReal>(mut a: DMatrix<T>, mut b: DVector<T>) -> DVector<T> {
    let n = b.len();
    for k in 0..n {
        for i in k + 1..n {
            let factor = a[(i, k)] / a[(k, k)];
            for j in k..n {
                let above = a[(k, j)];
                a[(i, j)] -= factor * above;
            }
            let above = b[k];
            b[i] -= factor * above;
        }
    }
    for i in (0..n).rev() {
        for j in i + 1..n {
            let right = b[j];
            b[i] -= a[(i, j)] * right;
        }
        b[i] /= a[(i, i)];
    }
    b
}

fn rows<T: ReferenceReal>(coordinates: &[Derivatives<T>], n: usize) -> DMatrix<T> {
    DMatrix::from_fn(coordinates.len(), n, |i, j| coordinates[i].jacobian[j])
}

/// (H −Jᵀ; J 0).
fn constrained_matrix<T: ReferenceReal>(h: &DMatrix<T>, j: &DMatrix<T>) -> DMatrix<T> {
    let (n, m) = (h.nrows(), j.nrows());
    let mut a = DMatrix::zeros(n + m, n + m);
    a.view_mut((0, 0), (n, n)).copy_from(h);
    a.view_mut((0, n), (n, m)).copy_from(&-j.transpose());
    a.view_mut((n, 0), (m, n)).copy_from(j);
    a
}

/// q̈ and F of the constrained motion.
pub fn constrained_motion<T: ReferenceReal>(
    tree: &CentreOfMassTree<T>,
    coordinates: &[Derivatives<T>],
    q: &[T],
    qd: &[T],
    tau: &[T],
) -> (DVector<T>, DVector<T>) {
    let equations = equations_of_motion(tree, q, qd);
    let (n, m) = (tree.nv(), coordinates.len());
    let a = constrained_matrix(&equations.mass_matrix, &rows(coordinates, n));
    let mut b = DVector::zeros(n + m);
    // H q̈ + h = τ + J_cᵀ F                                                                                    (20.88)
    b.rows_mut(0, n).copy_from(&(DVector::from_column_slice(tau) - equations.bias_force));
    // J_c q̈ + A_c = 0                                                                                         (20.89)
    (0..m).for_each(|i| b[n + i] = -coordinates[i].adjoint);
    let x = solve(a, b);
    (x.rows(0, n).into_owned(), x.rows(n, m).into_owned())
}

/// Δq̇ and F Δt of an impact on rigid constraints; `restitution` 0 is the chapter's.
pub fn rigid_impact<T: ReferenceReal>(
    tree: &CentreOfMassTree<T>,
    coordinates: &[Derivatives<T>],
    q: &[T],
    qd: &[T],
    restitution: T,
) -> (DVector<T>, DVector<T>) {
    let equations = equations_of_motion(tree, q, qd);
    let (n, m) = (tree.nv(), coordinates.len());
    // H Δq̇ = J_cᵀ F Δt                                                                                        (20.90)
    let a = constrained_matrix(&equations.mass_matrix, &rows(coordinates, n));
    // J_c Δq̇ = −(1 + e) ṡ'; e = 0:                                                                            (20.91)
    let one: T = nalgebra::one();
    let mut b = DVector::zeros(n + m);
    (0..m).for_each(|i| b[n + i] = -((one + restitution) * coordinates[i].sd));
    let x = solve(a, b);
    (x.rows(0, n).into_owned(), x.rows(n, m).into_owned())
}

/// (H 0 −Jᵀ; −J 1 0; 0 m_e 1) for the unknowns of q, s_6 and F.
fn environment_matrix<T: ReferenceReal>(h: &DMatrix<T>, coordinate: &Derivatives<T>, me: T) -> DMatrix<T> {
    let n = h.nrows();
    let one: T = nalgebra::one();
    let mut a = DMatrix::zeros(n + 2, n + 2);
    a.view_mut((0, 0), (n, n)).copy_from(h);
    for i in 0..n {
        a[(i, n + 1)] = -coordinate.jacobian[i];
        a[(n, i)] = -coordinate.jacobian[i];
    }
    a[(n, n)] = one;
    a[(n + 1, n)] = me;
    a[(n + 1, n + 1)] = one;
    a
}

/// q̈, s̈_6 and F of a robot that presses on a mass with a spring and a damper.
pub fn environment_motion<T: ReferenceReal>(
    tree: &CentreOfMassTree<T>,
    coordinate: &Derivatives<T>,
    [me, k, b]: [T; 3],
    q: &[T],
    qd: &[T],
    tau: &[T],
) -> (DVector<T>, T, T) {
    let equations = equations_of_motion(tree, q, qd);
    let n = tree.nv();
    let a = environment_matrix(&equations.mass_matrix, coordinate, me);
    let mut right = DVector::zeros(n + 2);
    // corrected: H q̈ + h, printed H q̈ − h
    // H q̈ + h = τ + J_6ᵀ F                                                                                    (20.92)
    right.rows_mut(0, n).copy_from(&(DVector::from_column_slice(tau) - equations.bias_force));
    // s̈_6 = J_6 q̈ + A_6                                                                                       (20.93)
    right[n] = coordinate.adjoint;
    // m_e s̈_6 = −F − k s_6 − b ṡ_6                                                                            (20.94)
    right[n + 1] = -(k * coordinate.s + b * coordinate.sd);
    let x = solve(a, right);
    (x.rows(0, n).into_owned(), x[n], x[n + 1])
}

/// Δq̇, Δṡ_6, F Δt and the velocity after a plastic impact on a mass that moves with `before`.
pub fn environment_impact<T: ReferenceReal>(
    tree: &CentreOfMassTree<T>,
    coordinate: &Derivatives<T>,
    me: T,
    before: T,
    q: &[T],
    qd: &[T],
) -> (DVector<T>, T, T, T) {
    let n = tree.nv();
    // H Δq̇ = J_6ᵀ F Δt (20.95),  Δṡ_6 = J_6 Δq̇ (20.96)
    let a = environment_matrix(&equations_of_motion(tree, q, qd).mass_matrix, coordinate, me);
    let mut right = DVector::zeros(n + 2);
    // corrected: the mass goes from its own velocity ṡ_e' to that of the contact after the impact; printed m_e Δṡ_6
    // m_e (ṡ_6' + Δṡ_6 − ṡ_e') = −F Δt                                                                        (20.97)
    right[n + 1] = -(me * (coordinate.sd - before));
    let x = solve(a, right);
    (x.rows(0, n).into_owned(), x[n], x[n + 1], coordinate.sd + x[n])
}

/// A frame that is at rest: what an immobile object has for its motion.
pub fn at_rest<T: ReferenceReal>() -> [Vector3<T>; 4] {
    [Vector3::from_element(T::constant(Dd::ZERO)); 4]
}
