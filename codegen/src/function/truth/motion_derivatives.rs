//! Derivatives of the motion of frames and of the robot as a whole, by the second author in dual numbers.

use super::super::motion_derivatives::{
    CentreOfMassJacobian, CentroidalDerivatives, CentroidalMap, CentroidalMapRate, FrameDerivatives,
    FrameDerivativesAtWorldOrigin, FrameDerivativesInOwnAxes, SubtreeCentresOfMass,
};
use super::closed::ClosingReal;
use super::derivatives::{moving, unit};
use super::{list, Chapter, Truth};
use crate::function::by_rows;
use nalgebra::Vector3;
use straightline_core::magnitude::Magnitude;
use straightline_core::reference::{self, CentreOfMassTree, ReferenceReal};
use straightline_core::{Dual, Real};

type Moving = Dual<Magnitude, 1>;

impl Truth for FrameDerivatives {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let tree = at.tree.map(Moving::fixed);
        let moved = |name: &str| tree.frame(name).expect("frames are those of the tree").clone();
        let block = |of: &dyn Fn(&reference::CentreOfMassFrame<Moving>) -> Vec<Magnitude>| {
            at.per_frame(|frame| of(&moved(&frame.name)))
        };
        let velocity = |[q, qd, _]: &[Vec<Moving>; 3], frame: &_| {
            list(&reference::frame_velocity(&tree, frame, q, &at.rates_on_tree(&tree, q, qd)))
        };
        let acceleration = |motion: &[Vec<Moving>; 3], frame: &_| {
            let [q, qd, qdd] = at.on_tree(&tree, motion.each_ref().map(|x| &x[..]));
            list(&reference::frame_acceleration(&tree, frame, &q, &qd, &qdd))
        };
        let (along, [q, _]) = at.along_motion();
        let rate = |frame: &_| list(&at.jacobian_on(&along, frame, &q).map(|x| x.derivatives[0]).transpose());
        let blocks = [
            block(&|frame| slopes(at, 0, |motion| velocity(motion, frame)))?,
            block(&|frame| slopes(at, 0, |motion| acceleration(motion, frame)))?,
            block(&|frame| slopes(at, 1, |motion| acceleration(motion, frame)))?,
            at.per_frame(|frame| list(&at.jacobian_on(&at.tree, frame, at.q()).transpose()))?,
            block(&|frame| rate(frame))?,
        ];
        Some(blocks.concat())
    }
}

impl Truth for FrameDerivativesInOwnAxes {
    /// Of Rᵀ v and Rᵀ ω.
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        twist_slopes::<AlongOwnAxes>(at)
    }
}

impl Truth for FrameDerivativesAtWorldOrigin {
    /// Of v − ω × p and ω.
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        twist_slopes::<AtWorldOrigin>(at)
    }
}

/// Six numbers by which the motion of a frame is told, of its pose and the velocity of its origin.
trait Twist {
    fn numbers<T: ReferenceReal>(pose: &reference::FramePose<T>, linear: Vector3<T>, angular: Vector3<T>) -> Vec<T>;
}

struct AlongOwnAxes;

impl Twist for AlongOwnAxes {
    fn numbers<T: ReferenceReal>(pose: &reference::FramePose<T>, linear: Vector3<T>, angular: Vector3<T>) -> Vec<T> {
        let axes = pose.rotation.transpose();
        [list(&(axes * linear)), list(&(axes * angular))].concat()
    }
}

struct AtWorldOrigin;

impl Twist for AtWorldOrigin {
    fn numbers<T: ReferenceReal>(pose: &reference::FramePose<T>, linear: Vector3<T>, angular: Vector3<T>) -> Vec<T> {
        [list(&(linear - angular.cross(&pose.position))), list(&angular)].concat()
    }
}

/// The twist of a frame.
fn twist<W: Twist, T: ClosingReal>(
    at: &Chapter<'_>,
    tree: &CentreOfMassTree<T>,
    frame: &str,
    q: &[T],
    qd: &[T],
) -> Vec<T> {
    let frame = tree.frame(frame).expect("frames are those of the tree");
    let velocity = reference::frame_velocity(tree, frame, q, &at.rates_on_tree(tree, q, qd));
    let [linear, angular] = [0, 3].map(|row| velocity.fixed_rows::<3>(row).into_owned());
    W::numbers(&reference::frame_pose(tree, frame, q), linear, angular)
}

/// Derivatives of the twist, and of what it changes by along the motion: no acceleration is asked of the second author.
fn twist_slopes<W: Twist>(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
    let nv = at.qd().len();
    let once = at.tree.map(Moving::fixed);
    let twice = once.map(Dual::<Moving, 1>::fixed);
    let rate = |[q, qd, qdd]: &[Vec<Moving>; 3], frame: &str| {
        let [q, qd, _] = moving(at, &once, [q, qd, qdd], &[qd.clone(), qdd.clone(), qdd.clone()]);
        twist::<W, _>(at, &twice, frame, &q, &qd).into_iter().map(|x| x.derivatives[0]).collect::<Vec<_>>()
    };
    let (along, [q, _]) = at.along_motion();
    let column = |frame: &str, k: usize| twist::<W, _>(at, &at.tree, frame, at.q(), &unit::<Magnitude>(nv, 1, k)[1]);
    let column_rate = |frame: &str, k: usize| {
        let numbers = twist::<W, _>(at, &along, frame, &q, &unit::<Moving>(nv, 1, k)[1]);
        numbers.into_iter().map(|x| x.derivatives[0]).collect::<Vec<_>>()
    };
    let columns = |of: &dyn Fn(usize) -> Vec<Magnitude>| by_rows(&(0..nv).map(of).collect::<Vec<_>>());
    let blocks = [
        at.per_frame(|f| slopes(at, 0, |[q, qd, _]| twist::<W, _>(at, &once, &f.name, q, qd)))?,
        at.per_frame(|f| slopes(at, 0, |motion| rate(motion, &f.name)))?,
        at.per_frame(|f| slopes(at, 1, |motion| rate(motion, &f.name)))?,
        at.per_frame(|f| columns(&|k| column(&f.name, k)))?,
        at.per_frame(|f| columns(&|k| column_rate(&f.name, k)))?,
    ];
    Some(blocks.concat())
}

impl Truth for CentreOfMassJacobian {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let tree = at.tree.map(Moving::fixed);
        Some(slopes(at, 0, |[q, ..]| list(&reference::centre_of_mass(&tree, q))))
    }
}

impl Truth for SubtreeCentresOfMass {
    /// Σ m r / Σ m of the links behind each joint.
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let order = at.tree.by_coordinates();
        let mass = |joint: usize| behind(&at.tree, joint).fold(Magnitude::zero(), |sum, k| sum + at.tree.links[k].mass);
        let moving = at.tree.map(Moving::fixed);
        let centres: Vec<_> = order.iter().flat_map(|joint| centre(&at.tree, *joint, at.q())).collect();
        let jacobians = order.iter().flat_map(|joint| slopes(at, 0, |[q, ..]| centre(&moving, *joint, q)));
        Some(order.iter().map(|joint| mass(*joint)).chain(centres).chain(jacobians).collect())
    }
}

/// The links that a joint moves, by the number of its own.
fn behind<T: ReferenceReal>(tree: &CentreOfMassTree<T>, joint: usize) -> impl Iterator<Item = usize> + '_ {
    let is_behind = move |link: usize| std::iter::successors(Some(link), |k| tree.links[*k].parent).any(|k| k == joint);
    (0..tree.links.len()).filter(move |link| is_behind(*link))
}

/// Their centre of mass.
fn centre<T: ReferenceReal>(tree: &CentreOfMassTree<T>, joint: usize, q: &[T]) -> Vec<T> {
    let links = reference::geometry(tree, q);
    let mass = behind(tree, joint).fold(<T as Real>::zero(), |sum, k| sum + tree.links[k].mass);
    let sum = |row: usize| {
        behind(tree, joint).fold(<T as Real>::zero(), |sum, k| sum + tree.links[k].mass * links[k].centre_of_mass[row])
    };
    (0..3).map(|row| sum(row) / mass).collect()
}

impl Truth for CentroidalMap {
    /// Column by column the momentum of a unit velocity.
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let nv = at.qd().len();
        let column = |k: usize| momentum(at, &at.tree, at.q(), &unit::<Magnitude>(nv, 1, k)[1]);
        Some(by_rows(&(0..nv).map(column).collect::<Vec<_>>()))
    }
}

impl Truth for CentroidalMapRate {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let nv = at.qd().len();
        let (tree, [q, _]) = at.along_motion();
        let column = |k: usize| {
            let rates = momentum(at, &tree, &q, &unit::<Moving>(nv, 1, k)[1]).into_iter();
            rates.map(|x| x.derivatives[0]).collect::<Vec<_>>()
        };
        Some([CentroidalMap::truth(at)?, by_rows(&(0..nv).map(column).collect::<Vec<_>>())].concat())
    }
}

impl Truth for CentroidalDerivatives {
    /// Momentum along the motion, which moves along a coordinate.
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let (tree, [q, qd]) = at.along_motion();
        let (h, h_dot): (Vec<_>, Vec<_>) =
            momentum(at, &tree, &q, &qd).into_iter().map(|x| (x.value, x.derivatives[0])).unzip();
        let once = at.tree.map(Moving::fixed);
        let dh_dq = slopes(at, 0, |[q, qd, _]| momentum(at, &once, q, qd));
        let twice = tree.map(Dual::<Moving, 1>::fixed);
        let rate = |[q, qd, qdd]: &[Vec<Moving>; 3]| {
            let motion = [&q[..], qd, qdd];
            let [q, qd, _] = moving(at, &once, motion, &[qd.clone(), qdd.clone(), qdd.clone()]);
            momentum(at, &twice, &q, &qd).into_iter().map(|x| x.derivatives[0]).collect::<Vec<_>>()
        };
        let [by_q, by_qd] = [0, 1].map(|block| slopes(at, block, rate));
        Some([h, h_dot, dh_dq, by_q, by_qd, CentroidalMap::truth(at)?].concat())
    }
}

/// Linear momentum and angular momentum about the centre of mass.
fn momentum<T: ClosingReal>(at: &Chapter<'_>, tree: &CentreOfMassTree<T>, q: &[T], qd: &[T]) -> Vec<T> {
    let momentum = reference::momentum(tree, q, &at.rates_on_tree(tree, q, qd));
    let parts = [momentum.linear, momentum.angular_about_centre_of_mass];
    parts.iter().flat_map(|part| part.iter().copied()).collect()
}

/// How what `f` says of a motion changes with each coordinate of q, or of q̇: by rows.
pub(super) fn slopes(at: &Chapter<'_>, block: usize, f: impl Fn(&[Vec<Moving>; 3]) -> Vec<Moving>) -> Vec<Magnitude> {
    let nv = at.qd().len();
    let column = |k: usize| {
        let motion = moving(at, &at.tree, [at.q(), at.qd(), at.qdd()], &unit(nv, block, k));
        f(&motion).into_iter().map(|x| x.derivatives[0]).collect::<Vec<_>>()
    };
    by_rows(&(0..nv).map(column).collect::<Vec<_>>())
}
