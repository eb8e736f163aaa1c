//! Forces: D'Alembert sums over the links that a joint carries, and the equations of motion τ = H q̈ + h.
//!
//! Sections 20.1.3, 20.2.2 and 20.2.3, equations (20.17)–(20.22) and (20.44)–(20.61). All vectors are in the external
//! frame unless a tilde says otherwise. A sum over k = j … n is here a sum over the links k that joint j carries.

use super::{
    geometry, linear_forms, motion, skew, solve_symmetric, CentreOfMassLink, CentreOfMassTree, LinearForms,
    LinkGeometry, LinkMotion, ReferenceJoint, ReferenceReal,
};
use crate::dd::Dd;
use alloc::vec;
use alloc::vec::Vec;
use nalgebra::{DMatrix, DVector, Matrix3xX, Vector3};

/// What a joint transmits from the parent to the link, in the external frame. Moments are about S_j, for a linear joint
/// about S'_j, for a free link about its root point.
#[derive(Clone, Debug, PartialEq)]
pub struct JointLoad<T> {
    /// F_S: total force, drive included \[N\]; (20.47).
    #[doc(alias = "F_S")]
    pub force: Vector3<T>,
    /// M_S: total moment, drive included \[N·m\]; (20.48).
    #[doc(alias = "M_S")]
    pub moment: Vector3<T>,
    /// F_R: reaction force, without the drive \[N\]; (20.19). Of a free link, that everything drives, null; of a ball joint the whole force.
    #[doc(alias = "F_R")]
    pub reaction_force: Vector3<T>,
    /// M_R: reaction moment, without the drive \[N·m\]; (20.19). Of a free link and of a ball joint null.
    #[doc(alias = "M_R")]
    pub reaction_moment: Vector3<T>,
}

/// r_k^{(j)} = S_j C_k: from joint j (S'_j of a linear one) to the centre of mass of link k, which j carries.
fn lever<T: ReferenceReal>(tree: &CentreOfMassTree<T>, position: &[LinkGeometry<T>], j: usize, k: usize) -> Vector3<T> {
    // r_k^{(j)} = Σ_{p=j}^{k−1} (r'_{p,p} − r_{p,p+1}) + r'_{k,k}                                               (20.49)
    let mut sum = position[k].r_dash;
    let mut next = k;
    while next != j {
        let p = tree.links[next].parent.expect("joint j carries link k, so the way down from k passes j");
        sum += position[p].r_dash - position[next].r_parent;
        next = p;
    }
    sum
}

/// The first of the three places of the angular velocity of a free link or a ball joint.
fn first_turn<T>(link: &CentreOfMassLink<T>) -> usize {
    link.iv + link.joint.nv() - 3
}

/// The links that joint j carries.
fn carried<T: ReferenceReal>(tree: &CentreOfMassTree<T>, j: usize) -> impl Iterator<Item = usize> + '_ {
    (j..tree.links.len()).filter(move |&k| tree.carries(j, k))
}

/// −F_{kI} − G_k = m_k (w_k − g): what has to be applied at C_k; (20.44), (20.46).
fn applied_force<T: ReferenceReal>(tree: &CentreOfMassTree<T>, k: usize, motion: &LinkMotion<T>) -> Vector3<T> {
    // F_{kI} = −m_k w_k                                                                                        (20.44)
    let inertial = -motion.w * tree.links[k].mass;
    // G_k = m_k g                                                                                              (20.46)
    let gravity = tree.gravity * tree.links[k].mass;
    -(gravity + inertial)
}

/// −M_{kI}: the couple that has to be applied to link k; (20.45).
fn applied_couple<T: ReferenceReal>(
    tree: &CentreOfMassTree<T>,
    k: usize,
    position: &LinkGeometry<T>,
    motion: &LinkMotion<T>,
) -> Vector3<T> {
    let inertia = &tree.links[k].inertia;
    // ã_k = A_k⁻¹ a_k = A_kᵀ a_k                                                                               (20.10)
    let omega = position.rotation.transpose() * motion.omega;
    let epsilon = position.rotation.transpose() * motion.epsilon;
    // M̃_{kI} = −(J̃_k ε̃_k + ω̃_k × (J̃_k ω̃_k)),    M_{kI} = A_k M̃_{kI}                                            (20.45)
    -(position.rotation * -(inertia * epsilon + omega.cross(&(inertia * omega))))
}

/// Forces and moments in all joints, in the order of the links.
#[doc(alias = "reactions")]
pub fn joint_loads<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T], qd: &[T], qdd: &[T]) -> Vec<JointLoad<T>> {
    let position = geometry(tree, q);
    let motion = motion(tree, &position, qd, qdd);
    (0..tree.links.len()).map(|j| joint_load(tree, &position, &motion, j)).collect()
}

fn joint_load<T: ReferenceReal>(
    tree: &CentreOfMassTree<T>,
    position: &[LinkGeometry<T>],
    motion: &[LinkMotion<T>],
    j: usize,
) -> JointLoad<T> {
    let mut force = Vector3::zeros();
    let mut moment = Vector3::zeros();
    for k in carried(tree, j) {
        let applied = applied_force(tree, k, &motion[k]);
        // F_{Sj} = −Σ_k (G_k + F_{kI})                                                                         (20.47)
        force += applied;
        // M_{Sj} = −Σ_k (M_{kI} + r_k^{(j)} × (G_k + F_{kI}))                                                  (20.48)
        moment += applied_couple(tree, k, &position[k], &motion[k]) + lever(tree, position, j, k).cross(&applied);
    }
    let link = &tree.links[j];
    let (reaction_force, reaction_moment) = match link.shares() {
        None if link.joint == ReferenceJoint::Ball => (force, Vector3::zeros()),
        None => (Vector3::zeros(), Vector3::zeros()),
        Some([turns, s]) => {
            let e = &position[j].e;
            // τ_j = F_{Sj} · e_j (20.50) or M_{Sj} · e_j (20.51)
            let tau = s * force.dot(e) + turns * moment.dot(e);
            // F_{Sj} = F_{Rj} + s_j τ_j e_j
            // M_{Sj} = M_{Rj} + (1 − s_j) τ_j e_j                                                              (20.19)
            // divided by 1 for these; of a joint that does both, so that reactions do no work
            let tau = tau / (s * s + turns * turns);
            (force - e * (s * tau), moment - e * (turns * tau))
        }
    };
    JointLoad { force, moment, reaction_force, reaction_moment }
}

/// Force \[N\] and moment \[N·m\] that the parent exerts on the link through each joint, drive included, in the order of
/// the links: about the joint point of the link (S''_j of a linear joint, the root point of a free link), in link axes.
pub fn joint_wrenches<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T], qd: &[T], qdd: &[T]) -> Vec<[T; 6]> {
    let position = geometry(tree, q);
    joint_loads(tree, q, qd, qdd)
        .iter()
        .zip(&position)
        .map(|(load, here)| {
            // S'_j S''_j = q_j e_j = r'_{j,j} − r_{j,j}                                                         (20.7)
            let moment = load.moment - (here.r_dash - here.r).cross(&load.force);
            let force = here.rotation.transpose() * load.force;
            let moment = here.rotation.transpose() * moment;
            [force.x, force.y, force.z, moment.x, moment.y, moment.z]
        })
        .collect()
}

/// The generalized forces τ of a motion, directly from D'Alembert's sums (20.50), (20.51), without H and h.
#[doc(alias = "direct dynamics")]
pub fn dalembert_inverse_dynamics<T: ReferenceReal>(
    tree: &CentreOfMassTree<T>,
    q: &[T],
    qd: &[T],
    qdd: &[T],
) -> DVector<T> {
    let position = geometry(tree, q);
    let motion = motion(tree, &position, qd, qdd);
    let mut tau = DVector::zeros(tree.nv());
    for (j, link) in tree.links.iter().enumerate() {
        let e = &position[j].e;
        match link.shares() {
            Some([turns, s]) => {
                for k in carried(tree, j) {
                    let LinkGeometry { rotation, .. } = &position[k];
                    let inertia = &tree.links[k].inertia;
                    let omega = rotation.transpose() * motion[k].omega;
                    let epsilon = rotation.transpose() * motion[k].epsilon;
                    let lever = lever(tree, &position, j, k);
                    let force = (motion[k].w - tree.gravity) * tree.links[k].mass;
                    // a linear joint: τ_j = Σ_k m_k (w_k − g) · e_j                                            (20.50)
                    tau[link.iv] += s * force.dot(e);
                    // corrected: J̃_k ε̃_k, printed J̃_k q̈~_k
                    // a revolute one:
                    // τ_j = Σ_k (A_k (J̃_k ε̃_k + ω̃_k × (J̃_k ω̃_k)) + r_k^{(j)} × m_k (w_k − g)) · e_j             (20.51)
                    let couple = rotation * (inertia * epsilon + omega.cross(&(inertia * omega)));
                    tau[link.iv] += turns * (couple + lever.cross(&force)).dot(e);
                }
            }
            None => {
                // τ = (F̃_S, M̃_S), all six components; of a ball joint the last three
                let load = joint_load(tree, &position, &motion, j);
                let rotation = position[j].rotation.transpose();
                if link.joint == ReferenceJoint::Free {
                    tau.fixed_rows_mut::<3>(link.iv).copy_from(&(rotation * load.force));
                }
                tau.fixed_rows_mut::<3>(first_turn(link)).copy_from(&(rotation * load.moment));
            }
        }
    }
    tau
}

/// H and h of τ = H q̈ + h.
#[derive(Clone, Debug, PartialEq)]
pub struct EquationsOfMotion<T: ReferenceReal> {
    /// H: inertial matrix, n × n.
    #[doc(alias = "inertial matrix")]
    pub mass_matrix: DMatrix<T>,
    /// h: gravity, centrifugal and Coriolis terms, n.
    pub bias_force: DVector<T>,
}

/// What one link contributes to the rows of H and h of every joint that carries it.
struct LinkTerms<T: ReferenceReal> {
    /// m_k Ξ^k
    force_matrix: Matrix3xX<T>,
    /// m_k (Δ^k − g)
    force: Vector3<T>,
    /// A_k J̃_k A_k⁻¹ Λ^k
    couple_matrix: Matrix3xX<T>,
    /// A_k J̃_k A_k⁻¹ Γ^k + A_k ω̲̃_k J̃_k ω̃_k
    couple: Vector3<T>,
}

fn link_terms<T: ReferenceReal>(
    tree: &CentreOfMassTree<T>,
    k: usize,
    position: &LinkGeometry<T>,
    forms: &LinearForms<T>,
) -> LinkTerms<T> {
    let a = &position.rotation;
    let inertia = &tree.links[k].inertia;
    let omega = a.transpose() * forms.omega;
    let external_inertia = a * inertia * a.transpose();
    LinkTerms {
        force_matrix: &forms.xi * tree.links[k].mass,
        force: (forms.delta - tree.gravity) * tree.links[k].mass,
        couple_matrix: external_inertia * &forms.lambda,
        couple: external_inertia * forms.gamma + a * (skew(&omega) * (inertia * omega)),
    }
}

/// H and h at a state, by the linear forms.
pub fn equations_of_motion<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T], qd: &[T]) -> EquationsOfMotion<T> {
    let n = tree.nv();
    let position = geometry(tree, q);
    let forms = linear_forms(tree, &position, qd);
    let terms: Vec<_> = (0..tree.links.len()).map(|k| link_terms(tree, k, &position[k], &forms[k])).collect();
    let mut mass_matrix = DMatrix::zeros(n, n);
    let mut bias_force = DVector::zeros(n);
    for (j, link) in tree.links.iter().enumerate() {
        let e = &position[j].e;
        for k in carried(tree, j) {
            let LinkTerms { force_matrix, force, couple_matrix, couple } = &terms[k];
            let lever = skew(&lever(tree, &position, j, k));
            match link.shares() {
                Some([turns, s]) => {
                    // H'_j = Σ_k e_jᵀ m_k Ξ^k,    h'_j = Σ_k e_jᵀ m_k (Δ^k − g)                                 (20.54)
                    // H''_j = Σ_k e_jᵀ (A_k J̃_k A_k⁻¹ Λ^k + r̲_k^{(j)} m_k Ξ^k)
                    // h''_j = Σ_k e_jᵀ (A_k J̃_k A_k⁻¹ Γ^k + A_k ω̲̃_k J̃_k ω̃_k + r̲_k^{(j)} m_k (Δ^k − g))           (20.58)
                    let along = e.transpose() * force_matrix;
                    let about = e.transpose() * couple_matrix + (e.transpose() * lever) * force_matrix;
                    let mut row = mass_matrix.row_mut(link.iv);
                    row += along * s + about * turns;
                    bias_force[link.iv] += s * e.dot(force) + turns * e.dot(&(couple + lever * force));
                }
                None => {
                    // the columns of A_j instead of e_j: of a free link first as in (20.54), then, as of a ball joint, as in (20.58)
                    let axes = position[j].rotation.transpose();
                    if link.joint == ReferenceJoint::Free {
                        let mut rows = mass_matrix.fixed_rows_mut::<3>(link.iv);
                        rows += axes * force_matrix;
                        let mut rows = bias_force.fixed_rows_mut::<3>(link.iv);
                        rows += axes * force;
                    }
                    let mut rows = mass_matrix.fixed_rows_mut::<3>(first_turn(link));
                    rows += axes * (couple_matrix + lever * force_matrix);
                    let mut rows = bias_force.fixed_rows_mut::<3>(first_turn(link));
                    rows += axes * (couple + lever * force);
                }
            }
        }
    }
    EquationsOfMotion { mass_matrix, bias_force }
}

fn rest<T: ReferenceReal>(tree: &CentreOfMassTree<T>) -> Vec<T> {
    vec![T::constant(Dd::ZERO); tree.nv()]
}

/// H(q), the inertial matrix \[kg·m², kg·m, kg\].
#[doc(alias = "inertial matrix")]
pub fn mass_matrix<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T]) -> DMatrix<T> {
    equations_of_motion(tree, q, &rest(tree)).mass_matrix
}

/// h(q, q̇) = C(q, q̇) q̇ + g(q) \[N·m or N\].
pub fn bias_force<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T], qd: &[T]) -> DVector<T> {
    equations_of_motion(tree, q, qd).bias_force
}

/// g(q): h at rest \[N·m or N\].
pub fn gravity_force<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T]) -> DVector<T> {
    equations_of_motion(tree, q, &rest(tree)).bias_force
}

/// C(q, q̇) q̇: h without gravity \[N·m or N\].
#[doc(alias = "centrifugal")]
#[doc(alias = "Coriolis")]
pub fn velocity_force<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T], qd: &[T]) -> DVector<T> {
    let weightless = CentreOfMassTree { gravity: Vector3::zeros(), ..tree.clone() };
    equations_of_motion(&weightless, q, qd).bias_force
}

/// The generalized forces τ of a motion \[N·m or N\].
#[doc(alias = "direct dynamics")]
pub fn inverse_dynamics<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T], qd: &[T], qdd: &[T]) -> DVector<T> {
    let EquationsOfMotion { mass_matrix, bias_force } = equations_of_motion(tree, q, qd);
    // τ = H q̈ + h                                                                                              (20.59)
    mass_matrix * DVector::from_column_slice(qdd) + bias_force
}

/// The accelerations q̈ that the generalized forces τ cause.
#[doc(alias = "inverse dynamics of the chapter")]
pub fn forward_dynamics<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T], qd: &[T], tau: &[T]) -> DVector<T> {
    let EquationsOfMotion { mass_matrix, bias_force } = equations_of_motion(tree, q, qd);
    // q̈ = H⁻¹(q) (τ − h(q, q̇))                                                                                 (20.61)
    solve_symmetric(&mass_matrix, &(DVector::from_column_slice(tau) - bias_force))
}

/// For every component of τ the sum of the moduli of the terms it is made of: against this an error is judged.
///
/// |r_k^{(j)}| m_k |w_k − g| + |J̃_k ε̃_k + ω̃_k × J̃_k ω̃_k| over the links k that a rotation moves, m_k |w_k − g| over
/// those that a translation moves.
pub fn natural_scale<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T], qd: &[T], qdd: &[T]) -> DVector<T> {
    let position = geometry(tree, q);
    let motion = motion(tree, &position, qd, qdd);
    let norm = |v: &Vector3<T>| v.dot(v).sqrt();
    let norm_of = |x: T| (x * x).sqrt();
    let mut scale = DVector::zeros(tree.nv());
    for (j, link) in tree.links.iter().enumerate() {
        for k in carried(tree, j) {
            let force = norm(&applied_force(tree, k, &motion[k]));
            let moment =
                norm(&lever(tree, &position, j, k)) * force + norm(&applied_couple(tree, k, &position[k], &motion[k]));
            match link.shares() {
                Some([turns, s]) => scale[link.iv] += force * norm_of(s) + moment * norm_of(turns),
                None => {
                    for i in 0..3 {
                        if link.joint == ReferenceJoint::Free {
                            scale[link.iv + i] += force;
                        }
                        scale[first_turn(link) + i] += moment;
                    }
                }
            }
        }
    }
    scale
}

/// For every component of q̈ = H⁻¹(τ − h) what rounding is judged against: |H⁻¹| (|τ| + scale of h + |H| |q̈|), with the
/// moduli of all entries.
pub fn forward_natural_scale<T: ReferenceReal>(tree: &CentreOfMassTree<T>, q: &[T], qd: &[T], tau: &[T]) -> DVector<T> {
    let n = tree.nv();
    let modulus = |x: T| (x * x).sqrt();
    let mass_matrix = mass_matrix(tree, q);
    let qdd = forward_dynamics(tree, q, qd, tau).map(modulus);
    let tau = DVector::from_column_slice(tau).map(modulus);
    let sum = tau + natural_scale(tree, q, qd, &rest(tree)) + mass_matrix.map(modulus) * qdd;
    // column k of H⁻¹ solves H x = unit vector k
    let unit_vector = |k: usize| DVector::from_fn(n, |i, _| T::constant(if i == k { Dd::ONE } else { Dd::ZERO }));
    (0..n).fold(DVector::zeros(n), |scale, k| {
        scale + solve_symmetric(&mass_matrix, &unit_vector(k)).map(modulus) * sum[k]
    })
}
