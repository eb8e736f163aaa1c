//! The complete model of robot and actuators, sections 20.3 and 20.5.4: dense, as printed.
//!
//! The state equations of actuators are C_j, f_j, d_j (20.65), (20.67 corrected), (20.74); they are united with the chain by
//! (20.78)-(20.82) with corrected (20.82), with a matrix of ratios N between shafts and joints, θ = N q, in place of the direct
//! connection. The matrices are inverted as they stand, without looking for symmetry. Elastic transmissions follow
//! (20.98), (20.99), stage after stage; efficiencies are found by trying all combinations of directions.

use super::ReferenceReal;
use crate::dd::Dd;
use alloc::vec::Vec;
use nalgebra::{DMatrix, DVector};

/// ẋ = C x + f M + d u with θ̈ = T ẋ (20.74).
#[derive(Clone, Debug)]
pub struct ActuatorModel<T: ReferenceReal> {
    /// C.
    pub c: DMatrix<T>,
    /// f.
    pub f: DVector<T>,
    /// d.
    pub d: DVector<T>,
    /// T, as a column.
    pub t: DVector<T>,
}

/// A permanent-magnet DC motor, (20.62), (20.63).
#[derive(Clone, Copy, Debug)]
pub struct DcMotor<T: ReferenceReal> {
    /// J \[kg·m²\].
    pub j: T,
    /// C_M \[N·m/A\].
    pub c_m: T,
    /// C_E \[V·s/rad\].
    pub c_e: T,
    /// B \[N·m·s/rad\].
    pub b: T,
    /// R \[Ω\].
    pub r: T,
    /// L \[H\]; `None`: neglected (20.66).
    pub l: Option<T>,
}

impl<T: ReferenceReal> DcMotor<T> {
    /// (20.65), or (20.67): its c_j is printed without the corrected entry −C_M C_E/(R J) − B/J in the second row.
    pub fn model(&self) -> ActuatorModel<T> {
        let DcMotor { j, c_m, c_e, b, r, l } = *self;
        let (o, one): (T, T) = (nalgebra::zero(), nalgebra::one());
        match l {
            Some(l) => ActuatorModel {
                c: DMatrix::from_row_slice(3, 3, &[o, one, o, o, -b / j, c_m / j, o, -c_e / l, -r / l]),
                f: DVector::from_column_slice(&[o, -one / j, o]),
                d: DVector::from_column_slice(&[o, o, one / l]),
                t: DVector::from_column_slice(&[o, one, o]),
            },
            None => ActuatorModel {
                c: DMatrix::from_row_slice(2, 2, &[o, one, o, -(c_m * c_e) / (r * j) - b / j]),
                f: DVector::from_column_slice(&[o, -one / j]),
                d: DVector::from_column_slice(&[o, c_m / (r * j)]),
                t: DVector::from_column_slice(&[o, one]),
            },
        }
    }
}

/// The chain and its rigid drives in a state.
#[derive(Clone, Debug)]
pub struct UnitedModel<T: ReferenceReal> {
    /// H.
    pub h_matrix: DMatrix<T>,
    /// h, less what acts on the joints besides.
    pub h: DVector<T>,
    /// The actuators.
    pub actuators: Vec<ActuatorModel<T>>,
    /// N: θ = N q.
    pub ratios: DMatrix<T>,
    /// r: torque behind a gear over torque without losses, τ = Nᵀ r M.
    pub losses: DVector<T>,
}

/// What comes out of [`UnitedModel::solve`].
#[derive(Clone, Debug)]
pub struct UnitedMotion<T: ReferenceReal> {
    /// M of the actuators.
    pub torques: DVector<T>,
    /// τ of the joints.
    pub tau: DVector<T>,
    /// q̈.
    pub qdd: DVector<T>,
    /// ẋ, actuator after actuator.
    pub xd: DVector<T>,
}

impl<T: ReferenceReal> UnitedModel<T> {
    /// C = diag C_j, F = diag f_j, D = diag d_j (20.78), T = diag T_j (20.79).
    pub fn stacked(&self) -> [DMatrix<T>; 4] {
        let (m, n) = (self.actuators.len(), self.actuators.iter().map(|a| a.f.len()).sum());
        let zero = |rows, columns| DMatrix::<T>::zeros(rows, columns);
        let [mut c, mut f, mut d, mut t] = [zero(n, n), zero(n, m), zero(n, m), zero(m, n)];
        let mut first = 0;
        for (k, a) in self.actuators.iter().enumerate() {
            for i in 0..a.f.len() {
                for j in 0..a.f.len() {
                    c[(first + i, first + j)] = a.c[(i, j)];
                }
                (f[(first + i, k)], d[(first + i, k)], t[(k, first + i)]) = (a.f[i], a.d[i], a.t[i]);
            }
            first += a.f.len();
        }
        [c, f, d, t]
    }

    /// The motion under u. The acceleration of the shafts is θ̈ = T (C x + F M + D u) and N q̈, with H q̈ + h = Nᵀ r M: one
    /// linear system for q̈ and M, which is regular where H T F of (20.80) may vanish, and H itself.
    pub fn solve_by(
        &self,
        x: &DVector<T>,
        u: &DVector<T>,
        solve: impl Fn(&DMatrix<T>, &DVector<T>) -> DVector<T>,
    ) -> UnitedMotion<T> {
        let [c, f, d, t] = self.stacked();
        let n = &self.ratios;
        let (m, nv) = (n.nrows(), n.ncols());
        let to_joints = n.transpose() * DMatrix::from_diagonal(&self.losses);
        let free = &c * x + &d * u;
        let mut matrix = DMatrix::zeros(nv + m, nv + m);
        matrix.view_mut((0, 0), (nv, nv)).copy_from(&self.h_matrix);
        matrix.view_mut((0, nv), (nv, m)).copy_from(&-&to_joints);
        matrix.view_mut((nv, 0), (m, nv)).copy_from(n);
        matrix.view_mut((nv, nv), (m, m)).copy_from(&-(&t * &f));
        let mut right = DVector::zeros(nv + m);
        right.rows_mut(0, nv).copy_from(&-&self.h);
        right.rows_mut(nv, m).copy_from(&(&t * &free));
        let solution = solve(&matrix, &right);
        let (qdd, torques) = (solution.rows(0, nv).clone_owned(), solution.rows(nv, m).clone_owned());
        let tau = to_joints * &torques;
        UnitedMotion { xd: free + f * &torques, torques, tau, qdd }
    }

    /// The same in other numbers.
    pub fn map<U: ReferenceReal>(&self, f: impl Fn(T) -> U + Copy) -> UnitedModel<U> {
        UnitedModel {
            h_matrix: self.h_matrix.map(f),
            h: self.h.map(f),
            actuators: self.actuators.iter().map(|a| a.map(f)).collect(),
            ratios: self.ratios.map(f),
            losses: self.losses.map(f),
        }
    }
}

impl<T: ReferenceReal> ActuatorModel<T> {
    fn map<U: ReferenceReal>(&self, f: impl Fn(T) -> U + Copy) -> ActuatorModel<U> {
        ActuatorModel { c: self.c.map(f), f: self.f.map(f), d: self.d.map(f), t: self.t.map(f) }
    }
}

impl UnitedModel<Dd> {
    /// [`UnitedModel::solve_by`] elimination with pivots.
    pub fn solve(&self, x: &DVector<Dd>, u: &DVector<Dd>) -> UnitedMotion<Dd> {
        self.solve_by(x, u, |a, b| solve_general(a.clone(), b.clone()))
    }

    /// τ by (20.80), for as many drives as joints: with q̈ = N⁻¹ T ẋ and M = r⁻¹ N⁻ᵀ τ in place of T and F.
    pub fn printed_torques(&self, x: &DVector<Dd>, u: &DVector<Dd>) -> DVector<Dd> {
        let [c, f, d, t] = self.stacked();
        let (ht, f) = self.direct(&t, &f);
        let e = DMatrix::from_diagonal_element(self.h.len(), self.h.len(), Dd::ONE);
        solve_general(e - &ht * f, ht * (c * x + d * u) + &self.h)
    }

    /// Ĉ and D̂ of (20.82), the latter corrected: D + F (E − H T F)⁻¹ H T D.
    pub fn state_space(&self, x: &DVector<Dd>) -> (DVector<Dd>, DMatrix<Dd>) {
        let [c, f, d, t] = self.stacked();
        let (ht, f) = self.direct(&t, &f);
        let e = DMatrix::from_diagonal_element(self.h.len(), self.h.len(), Dd::ONE);
        let matrix = e - &ht * &f;
        let drift = &c * x + &f * solve_general(matrix.clone(), &ht * &c * x + &self.h);
        let mut gain = d.clone();
        let driving = &ht * &d;
        for (k, mut column) in gain.column_iter_mut().enumerate() {
            let solved = solve_general(matrix.clone(), driving.column(k).clone_owned());
            column += &f * solved;
        }
        (drift, gain)
    }

    /// H N⁻¹ T and F r⁻¹ N⁻ᵀ.
    fn direct(&self, t: &DMatrix<Dd>, f: &DMatrix<Dd>) -> (DMatrix<Dd>, DMatrix<Dd>) {
        let n = self.ratios.nrows();
        assert_eq!(n, self.ratios.ncols(), "as many drives as joints");
        let mut inverse = DMatrix::from_diagonal_element(n, n, Dd::ONE);
        for mut column in inverse.column_iter_mut() {
            let solved = solve_general(self.ratios.clone(), column.clone_owned());
            column.copy_from(&solved);
        }
        let losses = DMatrix::from_diagonal(&self.losses.map(|r| Dd::ONE / r));
        (&self.h_matrix * &inverse * t, f * losses * inverse.transpose())
    }

    /// The losses that agree with the directions of power that they lead to: all combinations of η′ and 1/η″ are tried for the
    /// drives that have efficiencies and turn. `speeds` is θ̇.
    pub fn with_losses(
        &self,
        efficiencies: &[Option<(Dd, Dd)>],
        speeds: &[Dd],
        x: &DVector<Dd>,
        u: &DVector<Dd>,
    ) -> Self {
        let open: Vec<usize> =
            (0..efficiencies.len()).filter(|k| efficiencies[*k].is_some() && speeds[*k].to_f64() != 0.0).collect();
        for choice in 0..1_u32 << open.len() {
            let mut model = self.clone();
            for (bit, k) in open.iter().enumerate() {
                let (forward, backward) = efficiencies[*k].expect("those with efficiencies");
                model.losses[*k] = if choice >> bit & 1 == 0 { forward } else { Dd::ONE / backward };
            }
            let torques = model.solve(x, u).torques;
            let agrees = |(bit, k): (usize, &usize)| {
                let power = (torques[*k] * speeds[*k]).to_f64();
                if choice >> bit & 1 == 0 {
                    power >= 0.0
                } else {
                    power <= 0.0
                }
            };
            if open.iter().enumerate().all(agrees) {
                return model;
            }
        }
        panic!("no combination of directions agrees with itself");
    }
}

/// A stage of an elastic transmission, Figure 20.17.
#[derive(Clone, Copy, Debug)]
pub struct ElasticStage<T: ReferenceReal> {
    /// N.
    pub n: T,
    /// I′ \[kg·m²\].
    pub i1: T,
    /// I″ \[kg·m²\].
    pub i2: T,
    /// c \[N·m/rad\].
    pub c: T,
    /// d \[N·m·s/rad\].
    pub d: T,
    /// η′ and η″ of its gear.
    pub eta: Option<(T, T)>,
}

impl<T: ReferenceReal> ElasticStage<T> {
    /// τ by (20.99), from angle and speed before and behind the stage.
    pub fn torque(&self, theta: (T, T), q: (T, T)) -> T {
        self.c * (theta.0 / self.n - q.0) + self.d * (theta.1 / self.n - q.1)
    }

    /// What it takes from the shaft before it: τ/N of (20.98), over η′ in the direction of the drive and times η″ against it.
    pub fn taken(&self, tau: T, speed: T) -> T {
        let direction = (tau / self.n * speed).sign();
        match self.eta {
            Some((forward, _)) if direction == nalgebra::one() => tau / self.n / forward,
            Some((_, backward)) if direction == -nalgebra::one::<T>() => tau / self.n * backward,
            _ => tau / self.n,
        }
    }

    /// I′ + I″/N² (20.98).
    pub fn inertia(&self) -> T {
        self.i1 + self.i2 / (self.n * self.n)
    }
}

/// M and ẋ of an actuator before an elastic stage that takes `taken`: (I′ + I″/N²) θ̈ = M − taken (20.98) with θ̈ = T ẋ.
pub fn before_elastic_stage<T: ReferenceReal>(
    actuator: &ActuatorModel<T>,
    x: &DVector<T>,
    u: T,
    inertia: T,
    taken: T,
) -> (T, DVector<T>) {
    let free = &actuator.c * x + &actuator.d * u;
    let (t_free, t_f) = (actuator.t.dot(&free), actuator.t.dot(&actuator.f));
    let torque = (inertia * t_free + taken) / (nalgebra::one::<T>() - inertia * t_f);
    (torque, free + &actuator.f * torque)
}

/// x of A x = b, by elimination with pivots.
pub fn solve_general(mut a: DMatrix<Dd>, mut b: DVector<Dd>) -> DVector<Dd> {
    let n = b.len();
    assert_eq!(a.shape(), (n, n), "a square matrix of the order of the right-hand side");
    for k in 0..n {
        let size = |i: usize| a[(i, k)].to_f64().abs();
        let pivot = (k..n).max_by(|i, j| size(*i).total_cmp(&size(*j))).expect("rows are left");
        a.swap_rows(k, pivot);
        b.swap_rows(k, pivot);
        for i in k + 1..n {
            let factor = a[(i, k)] / a[(k, k)];
            for j in k..n {
                let x = a[(k, j)];
                a[(i, j)] -= factor * x;
            }
            let x = b[k];
            b[i] -= factor * x;
        }
    }
    for k in (0..n).rev() {
        for j in k + 1..n {
            let x = a[(k, j)] * b[j];
            b[k] -= x;
        }
        b[k] = b[k] / a[(k, k)];
    }
    b
}
