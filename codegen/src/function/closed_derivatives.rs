//! Derivatives of robots with closed loops, along the independent coordinates, in dual numbers: of what the loops do, or of the whole.
//!
//! With y, ẏ, ÿ of the tree, ẏ = G q̇ and ÿ = G q̈ + γ, forces are τ = Gᵀ τ_y. Derivatives of the tree's forces K, D and H are known, so that
//!
//! ```text
//! ∂τ/∂q = Gᵀ (K G + D ∂ẏ/∂q + H ∂ÿ/∂q) + (∂G/∂q)ᵀ τ_y      ∂τ/∂q̇ = Gᵀ (D G + H ∂γ/∂q̇)
//! ```

use super::derivatives::{along, unit, with_rates};
use super::steps::sum;
use super::Forms;
use crate::function::by_rows;
use straightline_core::algorithms::{self as alg, DerivativeBlocks, ForceOnFrame};
use straightline_core::closure::Closure;
use straightline_core::model::{Frame, Model};
use straightline_core::spatial::{MotionVector, Transform, Vec3};
use straightline_core::{Dual, Real};

/// Matrices by rows, with a column per increment of q and per velocity.
pub(super) struct EffectSlopes<T> {
    pub by_configuration: Vec<T>,
    pub by_velocity: Vec<T>,
}

/// A motion, from which derivatives are taken.
pub(super) struct ClosedSlopes<'a, T> {
    model: &'a Model<T>,
    /// The same over dual numbers.
    wide: Model<Dual<T, 1>>,
    motion: [&'a [T]; 3],
}

type Moving<T> = [Vec<Dual<T, 1>>; 3];

impl<'a, T: Real> ClosedSlopes<'a, T> {
    pub fn new(model: &'a Model<T>, motion: [&'a [T]; 3]) -> Self {
        ClosedSlopes { model, wide: model.map(Dual::fixed), motion }
    }

    fn held(&self) -> Moving<T> {
        self.motion.map(|x| x.iter().map(|x| Dual::fixed(*x)).collect())
    }

    /// q moves along its coordinate `k`.
    fn along_configuration(&self, k: usize) -> Moving<T> {
        let [_, qd, qdd] = self.held();
        [along(self.model, self.motion[0], k), qd, qdd]
    }

    /// q̇ changes by its coordinate `k`.
    fn along_velocity(&self, k: usize) -> Moving<T> {
        let [q, _, qdd] = self.held();
        [q, with_rates(self.motion[1], &unit(self.model.nv(), k)), qdd]
    }

    /// q moves with q̇, q̇ with q̈.
    fn along_motion(&self) -> Moving<T> {
        let [q, qd, qdd] = self.motion;
        let [.., held] = self.held();
        [with_rates(q, &self.model.configuration_rate(q, qd)), with_rates(qd, qdd), held]
    }

    fn columns(&self, moving: impl Fn(&Self, usize) -> Moving<T>, f: impl Fn(&Moving<T>) -> Vec<Dual<T, 1>>) -> Vec<T> {
        let column = |k: usize| f(&moving(self, k)).into_iter().map(|x| x.derivatives[0]).collect::<Vec<T>>();
        by_rows(&(0..self.model.nv()).map(column).collect::<Vec<_>>())
    }

    /// How what `f` says of the robot changes with q, by rows.
    pub fn by_configuration(&self, f: impl Fn(&Model<Dual<T, 1>>, &Moving<T>) -> Vec<Dual<T, 1>>) -> Vec<T> {
        self.columns(Self::along_configuration, |motion| f(&self.wide, motion))
    }

    /// How it changes with q̇.
    pub fn by_velocity(&self, f: impl Fn(&Model<Dual<T, 1>>, &Moving<T>) -> Vec<Dual<T, 1>>) -> Vec<T> {
        self.columns(Self::along_velocity, |motion| f(&self.wide, motion))
    }

    /// How fast it changes.
    pub fn rate(&self, f: impl FnOnce(&Model<Dual<T, 1>>, &Moving<T>) -> Vec<Dual<T, 1>>) -> Vec<T> {
        f(&self.wide, &self.along_motion()).into_iter().map(|x| x.derivatives[0]).collect()
    }

    /// Of what rotors, friction and springs of the joints take.
    pub fn effects(&self) -> EffectSlopes<T> {
        let forces = |model: &Model<Dual<T, 1>>, [q, qd, qdd]: &Moving<T>| {
            let passive = alg::passive_force(model, q, qd);
            let rotors = alg::rotor_forces(model, [q, qd, qdd]);
            passive.into_iter().zip(rotors).map(|(p, r)| p + r).collect()
        };
        EffectSlopes { by_configuration: self.by_configuration(forces), by_velocity: self.by_velocity(forces) }
    }

    /// Of the forces of the bodies, from those of the tree, which stands at y.
    pub fn of_forces(&self, y: &[T], of_tree: DerivativeBlocks<T>) -> DerivativeBlocks<T> {
        let (model, wide) = (self.model, &self.wide);
        let DerivativeBlocks { tau, mass_matrix, dtau_dq, dtau_dqd } = of_tree;
        let held: Vec<Dual<T, 1>> = tau.iter().map(|x| Dual::fixed(*x)).collect();
        let rates = |x: &[Dual<T, 1>]| x.iter().map(|x| x.derivatives[0]).collect::<Vec<T>>();
        let tree = |[q, qd, qdd]: &Moving<T>| wide.tree_motion([q, qd, qdd]).map(|x| x.into_owned());
        let column_of_q = |k: usize| {
            let [y_moving, yd, ydd] = tree(&self.along_configuration(k));
            let of_motion = sum(&times(&dtau_dqd, &rates(&yd)), &times(&mass_matrix, &rates(&ydd)));
            let turning = rates(&wide.free_forces(&y_moving, held.clone()));
            sum(&model.free_forces(y, of_motion), &turning)
        };
        let column_of_qd = |k: usize| {
            let [.., ydd] = tree(&self.along_velocity(k));
            model.free_forces(y, times(&mass_matrix, &rates(&ydd)))
        };
        let nv = model.nv();
        let mut all = DerivativeBlocks {
            tau: model.free_forces(y, tau),
            dtau_dq: model.free_square(y, dtau_dq),
            dtau_dqd: model.free_square(y, dtau_dqd.clone()),
            mass_matrix: model.free_symmetric(y, mass_matrix.clone()),
        };
        add(&mut all.dtau_dq, &by_rows(&(0..nv).map(column_of_q).collect::<Vec<_>>()));
        add(&mut all.dtau_dqd, &by_rows(&(0..nv).map(column_of_qd).collect::<Vec<_>>()));
        all
    }

    /// C = Gᵀ (C_y G + H_y Ġ), which is ∫ y_i · ẏ_j dm, too.
    pub fn coriolis_matrix(&self) -> Vec<T> {
        let (open, g, rate) = self.open_motion();
        let [q, qd, _] = self.motion;
        let nv = self.model.nv();
        let open_qd = times(&g.concat(), qd);
        let h = alg::mass_matrix(&open, q);
        let c = alg::coriolis_matrix(&open, q, &open_qd);
        let column = |k: usize| {
            let [own, moving] = [&g, &rate].map(|of| of.iter().map(|row| row[k]).collect::<Vec<T>>());
            transposed_times(&g, &sum(&times(&c, &own), &times(&h, &moving)))
        };
        by_rows(&(0..nv).map(column).collect::<Vec<_>>())
    }

    /// Cᵀ q̇ = Gᵀ C_yᵀ ẏ + Ġᵀ H_y ẏ.
    pub fn coriolis_transpose_force(&self) -> Vec<T> {
        let (open, g, rate) = self.open_motion();
        let [q, qd, _] = self.motion;
        let open_qd = times(&g.concat(), qd);
        let momentum = times(&alg::mass_matrix(&open, q), &open_qd);
        let of_tree = alg::coriolis_transpose_force(&open, q, &open_qd);
        sum(&transposed_times(&g, &of_tree), &transposed_times(&rate, &momentum))
    }

    /// The robot with its loops cut, and the rows of G and of Ġ of all its velocities.
    fn open_motion(&self) -> (Model<T>, Vec<Vec<T>>, Vec<Vec<T>>) {
        let open = Model { closure: Closure::default(), ..self.model.clone() };
        let nv = self.model.nv();
        let [q, ..] = self.along_motion();
        let dependent = self.wide.embedding(&self.wide.tree_positions(&q));
        let g = (0..nv).map(|i| unit(nv, i)).chain(dependent.iter().map(|row| row.iter().map(|x| x.value).collect()));
        let rate = (0..nv).map(|_| vec![T::zero(); nv]);
        let rate = rate.chain(dependent.iter().map(|row| row.iter().map(|x| x.derivatives[0]).collect()));
        (open, g.collect(), rate.collect())
    }

    /// Derivatives of the motion of a frame.
    pub fn of_frame<W: TwistNumbers>(&self, frame: &Frame<T>) -> alg::FrameDerivativeBlocks<T> {
        let wide_frame = frame.map(Dual::<T, 1>::fixed);
        let twice = frame.map(|x| Dual::<Dual<T, 1>, 1>::fixed(Dual::fixed(x)));
        let nv = self.model.nv();
        let rate = |model: &Model<Dual<T, 1>>, motion: &Moving<T>| {
            let motion = motion.each_ref().map(|x| &x[..]);
            ClosedSlopes::new(model, motion).rate(|model, [q, qd, _]| numbers::<W, _>(model, &twice, q, qd))
        };
        let column = |k: usize| numbers::<W, _>(self.model, frame, self.motion[0], &unit(nv, k));
        let moving_columns = |model: &Model<Dual<T, 1>>, [q, ..]: &Moving<T>| {
            by_rows(&(0..nv).map(|k| numbers::<W, _>(model, &wide_frame, q, &unit(nv, k))).collect::<Vec<_>>())
        };
        alg::FrameDerivativeBlocks {
            dv_dq: self.by_configuration(|model, [q, qd, _]| numbers::<W, _>(model, &wide_frame, q, qd)),
            da_dq: self.by_configuration(rate),
            da_dqd: self.by_velocity(rate),
            jacobian: by_rows(&(0..nv).map(column).collect::<Vec<_>>()),
            jacobian_rate: self.rate(moving_columns),
        }
    }

    /// Centroidal momentum and its map, with their rates and derivatives.
    pub fn centroidal(&self) -> alg::CentroidalDynamicsBlocks<T> {
        let [q, qd, _] = self.motion;
        let rate = |model: &Model<Dual<T, 1>>, motion: &Moving<T>| {
            ClosedSlopes::new(model, motion.each_ref().map(|x| &x[..])).rate(|model, [q, qd, _]| momentum(model, q, qd))
        };
        alg::CentroidalDynamicsBlocks {
            momentum: momentum(self.model, q, qd),
            momentum_rate: self.rate(|model, [q, qd, _]| momentum(model, q, qd)),
            dh_dq: self.by_configuration(|model, [q, qd, _]| momentum(model, q, qd)),
            dhdot_dq: self.by_configuration(rate),
            dhdot_dqd: self.by_velocity(rate),
            map: alg::centroidal_map(self.model, q),
        }
    }

    /// Ȧ of the centroidal momentum map.
    pub fn centroidal_map_rate(&self) -> Vec<T> {
        self.rate(|model, [q, ..]| alg::centroidal_map(model, q))
    }

    /// ∂(Jᵀ f)/∂q of forces on frames.
    pub fn of_frame_forces(&self, forces: &[ForceOnFrame<'_, T>]) -> Vec<T> {
        let fixed = |v: Vec3<T>| Vec3::new(Dual::fixed(v.x), Dual::fixed(v.y), Dual::fixed(v.z));
        let frames: Vec<_> = forces.iter().map(|f| f.frame.map(Dual::fixed)).collect();
        let loaded = || frames.iter().zip(forces);
        let wide: Vec<_> =
            loaded().map(|(frame, f)| ForceOnFrame { frame, force: fixed(f.force), moment: fixed(f.moment) }).collect();
        self.by_configuration(|model, [q, ..]| alg::jacobian_hessian_product(model, q, &wide)[0].clone())
    }
}

/// Six numbers by which the motion of a frame is told.
pub(super) trait TwistNumbers {
    fn of<T: Real>(pose: &Transform<T>, velocity: &MotionVector<T>) -> [Vec3<T>; 2];
}

/// World axes, of the frame's origin.
pub(super) struct NumbersAtOrigin;

impl TwistNumbers for NumbersAtOrigin {
    fn of<T: Real>(_: &Transform<T>, velocity: &MotionVector<T>) -> [Vec3<T>; 2] {
        [velocity.linear, velocity.angular]
    }
}

/// The frame's own axes.
pub(super) struct NumbersInOwnAxes;

impl TwistNumbers for NumbersInOwnAxes {
    fn of<T: Real>(pose: &Transform<T>, velocity: &MotionVector<T>) -> [Vec3<T>; 2] {
        [velocity.linear, velocity.angular].map(|v| pose.rotation.transpose_mul(v))
    }
}

/// World axes, of what moves with the frame through the world's origin.
pub(super) struct NumbersAtWorldOrigin;

impl TwistNumbers for NumbersAtWorldOrigin {
    fn of<T: Real>(pose: &Transform<T>, velocity: &MotionVector<T>) -> [Vec3<T>; 2] {
        [velocity.linear - velocity.angular.cross(pose.translation), velocity.angular]
    }
}

fn numbers<W: TwistNumbers, T: Real>(model: &Model<T>, frame: &Frame<T>, q: &[T], qd: &[T]) -> Vec<T> {
    let velocity = alg::frame_velocity(model, q, qd, frame);
    let pose = alg::forward_kinematics(model, q, &[frame])[0];
    W::of(&pose, &velocity).into_iter().flat_map(Vec3::to_array).collect()
}

fn momentum<T: Real>(model: &Model<T>, q: &[T], qd: &[T]) -> Vec<T> {
    let all = alg::momentum(model, q, qd);
    [all.linear, all.angular].into_iter().flat_map(Vec3::to_array).collect()
}

impl<T: Real> Forms<'_, T> {
    /// Where derivatives go along loops.
    pub(super) fn closed<'a>(&'a self, motion: [&'a [T]; 3]) -> Option<ClosedSlopes<'a, T>> {
        (!self.model.closure.is_empty()).then(|| ClosedSlopes::new(self.model, motion))
    }
}

/// Adds numbers.
pub(super) fn add<T: Real>(to: &mut [T], x: &[T]) {
    to.iter_mut().zip(x).for_each(|(to, x)| *to = *to + *x);
}

/// A matrix by rows times a vector.
fn times<T: Real>(matrix: &[T], x: &[T]) -> Vec<T> {
    let row = |row: &[T]| row.iter().zip(x).fold(T::zero(), |sum, (entry, x)| sum + *entry * *x);
    matrix.chunks(x.len()).map(row).collect()
}

/// Rows, transposed, times a vector.
fn transposed_times<T: Real>(rows: &[Vec<T>], x: &[T]) -> Vec<T> {
    let column = |k: usize| rows.iter().zip(x).fold(T::zero(), |sum, (row, x)| sum + row[k] * *x);
    (0..rows[0].len()).map(column).collect()
}
