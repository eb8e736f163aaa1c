//! Robots with closed loops, by the second author: all equations of every loop in world axes, solved by least squares in double-double, and forces by virtual
//! work.
//!
//! The tree that is left where loops are cut has the independent coordinates first. Points that coincide have the same velocity and acceleration, so that
//! (J₂ − J₁) ẋ = 0 and (J₂ − J₁) ẍ + (a₂ − a₁) = 0, a the accelerations at ẍ = 0; configurations are closed ones. So do angular velocities and
//! accelerations of a weld, and across the axis n of a hinge: n × (ω₂ − ω₁) = 0, n × (α₂ − α₁) + (ω₁ × n) × (ω₂ − ω₁) = 0.

use super::{list, Chapter, Truth};
use crate::function::Quantity;
use nalgebra::{DMatrix, DVector, Vector3};
use straightline_core::magnitude::Magnitude;
use straightline_core::reference::{self, CentreOfMassFrame, CentreOfMassTree, ReferenceReal};
use straightline_core::{Dd, Dual, Real};

/// Frames of the tree whose origins coincide.
#[derive(Clone, Debug)]
pub struct ClosedMeeting<T> {
    /// The frames.
    pub ends: [CentreOfMassFrame<T>; 2],
    /// How they turn against each other.
    pub turning: Turning<T>,
}

/// How two bodies turn against each other.
#[derive(Clone, Debug)]
pub enum Turning<T> {
    /// In any way.
    Free,
    /// About an axis of the first frame.
    About(Vector3<T>),
    /// Not at all.
    None,
}

/// The loops of a robot, and how many velocity coordinates are independent.
#[derive(Clone, Debug)]
pub struct ClosedLoops {
    /// Where each loop closes.
    pub meetings: Vec<ClosedMeeting<Dd>>,
    /// So many velocities stand before those that loops determine.
    pub independent: usize,
    /// So many equations programs have of them.
    pub equations: usize,
}

/// The motion of the tree that keeps loops closed, of a motion of the independent coordinates.
pub(super) struct TreeMotion<T> {
    /// ∂ẋ/∂q̇.
    pub map: DMatrix<T>,
    /// ẋ.
    pub rates: Vec<T>,
    /// ẍ.
    pub accelerations: Vec<T>,
    /// ẍ without accelerations of the independent coordinates.
    pub bias: Vec<T>,
}

/// The axis of a hinge, in the world.
fn axis_at<T: ClosingReal>(meeting: &ClosedMeeting<T>, tree: &CentreOfMassTree<T>, q: &[T]) -> Vector3<T> {
    match &meeting.turning {
        Turning::About(axis) => reference::frame_pose(tree, &meeting.ends[0], q).rotation * axis,
        Turning::Free | Turning::None => Vector3::from_element(<T as Real>::zero()),
    }
}

impl<T: ClosingReal> TreeMotion<T> {
    pub fn new(tree: &CentreOfMassTree<T>, loops: &ClosedLoops, [q, qd, qdd]: [&[T]; 3]) -> TreeMotion<T> {
        let (meetings, n, all) = (loops.meetings_over(), loops.independent, tree.nv());
        let zero = <T as Real>::zero();
        let (map, closing) = loops.independent_motion(tree, &meetings, q);
        let moved = |rates: &[T]| &map * DVector::from_column_slice(rates);
        let rates = moved(qd);
        let still = vec![zero; all];
        let mut drift = Vec::new();
        for meeting in &meetings {
            let of_ends = meeting.ends.each_ref();
            let [one, other] = of_ends.map(|end| reference::frame_acceleration(tree, end, q, rates.as_slice(), &still));
            drift.extend((one.fixed_rows::<3>(0) - other.fixed_rows::<3>(0)).iter().copied());
            let velocities = of_ends.map(|end| reference::frame_velocity(tree, end, q, rates.as_slice()));
            let [turn, other_turn] = velocities.map(|velocity| velocity.fixed_rows::<3>(3).into_owned());
            let turning = (other - one).fixed_rows::<3>(3).into_owned();
            let leaning = match meeting.turning {
                Turning::Free => continue,
                Turning::None => turning,
                Turning::About(_) => {
                    let axis = axis_at(meeting, tree, q);
                    axis.cross(&turning) + turn.cross(&axis).cross(&(other_turn - turn))
                }
            };
            drift.extend(leaning.iter().map(|x| -*x));
        }
        let drift = DVector::from_vec(drift);
        let mut bias = DVector::from_element(all, zero);
        bias.rows_mut(n, all - n).copy_from(&closing.solved(&drift));
        let accelerations = moved(qdd) + &bias;
        TreeMotion { rates: list(&rates), accelerations: list(&accelerations), bias: list(&bias), map }
    }
}

impl ClosedLoops {
    /// ∂ẋ/∂q̇.
    pub(super) fn map_at<T: ClosingReal>(&self, tree: &CentreOfMassTree<T>, q: &[T]) -> DMatrix<T> {
        self.independent_motion(tree, &self.meetings_over(), q).0
    }

    fn meetings_over<T: ClosingReal>(&self) -> Vec<ClosedMeeting<T>> {
        let over = |meeting: &ClosedMeeting<Dd>| ClosedMeeting {
            ends: meeting.ends.each_ref().map(|end| end.map(T::constant)),
            turning: match &meeting.turning {
                Turning::Free => Turning::Free,
                Turning::About(axis) => Turning::About(axis.map(T::constant)),
                Turning::None => Turning::None,
            },
        };
        self.meetings.iter().map(over).collect()
    }

    /// ∂ẋ/∂q̇, and what solves for dependent rates.
    fn independent_motion<T: ClosingReal>(
        &self,
        tree: &CentreOfMassTree<T>,
        meetings: &[ClosedMeeting<T>],
        q: &[T],
    ) -> (DMatrix<T>, Closing<T>) {
        let (n, all) = (self.independent, tree.nv());
        let mut by_loop = Vec::new();
        for meeting in meetings {
            let [one, other] = meeting.ends.each_ref().map(|end| reference::frame_jacobian(tree, end, q));
            let apart = other - one;
            by_loop.extend((0..3).map(|i| apart.row(i).into_owned()));
            match meeting.turning {
                Turning::Free => {}
                Turning::None => by_loop.extend((3..6).map(|i| apart.row(i).into_owned())),
                Turning::About(_) => {
                    let [x, y, z] = axis_at(meeting, tree, q).into();
                    let [a, b, c] = [3, 4, 5].map(|i| apart.row(i).into_owned());
                    by_loop.extend([&c * y - &b * z, &a * z - &c * x, &b * x - &a * y]);
                }
            }
        }
        let rows = DMatrix::from_rows(&by_loop);
        let closing = Closing::new(rows.columns(n, all - n).into_owned());
        let mut map = DMatrix::from_fn(all, n, |i, j| T::constant(if i == j { Dd::ONE } else { Dd::ZERO }));
        for j in 0..n {
            let opposite = rows.column(j).map(|x| -x);
            map.view_mut((n, j), (all - n, 1)).copy_from(&closing.solved(&opposite));
        }
        (map, closing)
    }
}

/// The tree of a robot with loops at a motion that keeps them closed.
pub struct ClosedMotion<'a> {
    /// The robot at the motion of its independent coordinates.
    pub robot: Chapter<'a>,
    /// The tree, moving.
    pub tree: Chapter<'a>,
    /// The same without accelerations of the independent coordinates.
    pub unaccelerated: Chapter<'a>,
    /// ∂ẋ/∂q̇.
    map: DMatrix<Magnitude>,
    /// Equations that are asked for, as many as programs have.
    pub equations: usize,
}

impl<'a> ClosedMotion<'a> {
    pub(super) fn new(at: &Chapter<'a>, loops: &ClosedLoops) -> ClosedMotion<'a> {
        let TreeMotion { map, rates, accelerations, bias } =
            TreeMotion::new(&at.tree, loops, [at.q(), at.qd(), at.qdd()]);
        let with = |accelerations: Vec<Magnitude>| {
            let mut tree = at.clone();
            tree.loops = None;
            tree.state.insert(Quantity::Velocity, rates.clone());
            tree.state.insert(Quantity::Acceleration, accelerations);
            tree
        };
        let (tree, unaccelerated) = (with(accelerations), with(bias));
        ClosedMotion { robot: at.clone(), tree, unaccelerated, map, equations: loops.equations }
    }

    /// Number of independent velocities.
    pub fn independent(&self) -> usize {
        self.map.ncols()
    }

    /// The rows of dependent velocities, by independent ones.
    pub fn dependent_rows(&self) -> Vec<Magnitude> {
        list(&self.map.rows(self.independent(), self.map.nrows() - self.independent()).transpose())
    }

    /// A length of the size of the robot \[m\].
    pub fn reach(&self) -> f64 {
        let of = |v: &nalgebra::Vector3<Magnitude>| v.iter().map(|x| x.size).fold(0.0, f64::max);
        self.tree.tree.links.iter().map(|link| of(&link.r).max(of(&link.r_parent))).fold(0.0, f64::max)
    }

    /// What forces of the tree do along the independent coordinates.
    pub fn forces(&self, of_tree: Option<Vec<Magnitude>>) -> Option<Vec<Magnitude>> {
        Some(list(&(self.map.transpose() * DVector::from_vec(of_tree?))))
    }

    /// A matrix by rows with a column for every velocity of the tree, by the independent ones.
    pub fn columns(&self, of_tree: Option<Vec<Magnitude>>) -> Option<Vec<Magnitude>> {
        let of_tree = of_tree?;
        let width = self.map.nrows();
        Some(list(&(DMatrix::from_row_slice(of_tree.len() / width, width, &of_tree) * &self.map).transpose()))
    }

    /// A symmetric matrix over the velocities of the tree, over the independent ones.
    pub fn square(&self, of_tree: DMatrix<Magnitude>) -> DMatrix<Magnitude> {
        self.map.transpose() * of_tree * &self.map
    }
}

/// Numbers of the second author that equations of loops can be solved in: those that know their size, and duals of such.
pub(super) trait ClosingReal: ReferenceReal {
    /// What it is.
    fn number(&self) -> Dd;

    /// x of J x = b by (Jᵀ J)⁻¹ Jᵀ.
    fn closing(rows: &DMatrix<Self>, inverse: &DMatrix<Dd>, b: &DVector<Self>) -> DVector<Self>;
}

impl ClosingReal for Magnitude {
    fn number(&self) -> Dd {
        self.value
    }

    /// It moves by the inverse times δb − δJ x.
    fn closing(rows: &DMatrix<Self>, inverse: &DMatrix<Dd>, b: &DVector<Self>) -> DVector<Self> {
        let x = inverse * b.map(|x| x.value);
        let moved = |i: usize| {
            let by_rows = (0..x.len()).map(|j| rows[(i, j)].size * x[j].to_f64());
            by_rows.chain([b[i].size]).fold(0.0, f64::hypot)
        };
        let moved: Vec<f64> = (0..b.len()).map(moved).collect();
        let size = |i: usize| (0..b.len()).map(|k| inverse[(i, k)].to_f64() * moved[k]).fold(0.0, f64::hypot);
        DVector::from_fn(x.len(), |i, _| Magnitude::new(x[i]).of_size(size(i)))
    }
}

impl<T: ClosingReal> ClosingReal for Dual<T, 1> {
    fn number(&self) -> Dd {
        self.value.number()
    }

    /// J x' = b' − J' x.
    fn closing(rows: &DMatrix<Self>, inverse: &DMatrix<Dd>, b: &DVector<Self>) -> DVector<Self> {
        let (now, rate) = (rows.map(|x| x.value), rows.map(|x| x.derivatives[0]));
        let x = T::closing(&now, inverse, &b.map(|x| x.value));
        let rates = T::closing(&now, inverse, &(b.map(|x| x.derivatives[0]) - rate * &x));
        x.zip_map(&rates, |value, rate| Dual { value, derivatives: [rate] })
    }
}

/// Equations for dependent rates, more than there are rates and none against another.
struct Closing<T> {
    rows: DMatrix<T>,
    /// (Jᵀ J)⁻¹ Jᵀ.
    inverse: DMatrix<Dd>,
}

impl<T: ClosingReal> Closing<T> {
    fn new(rows: DMatrix<T>) -> Closing<T> {
        let value = rows.map(|x| x.number());
        let normal = value.transpose() * &value;
        let mut inverse = value.transpose();
        for mut column in inverse.column_iter_mut() {
            let solved = reference::solve_symmetric(&normal, &column.clone_owned());
            column.copy_from(&solved);
        }
        Closing { rows, inverse }
    }

    fn solved(&self, b: &DVector<T>) -> DVector<T> {
        T::closing(&self.rows, &self.inverse, b)
    }
}

/// Truths of the tree where it moves, forces among them projected.
pub(super) fn forces<F: Truth>(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
    at.forces(F::truth(&at.tree))
}
