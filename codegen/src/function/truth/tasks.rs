//! Tasks of frames, by the second author: dense matrices of the chapter, and least squares in their primal form.

use super::super::dynamics::{GravityForce, VelocityForce};
use super::super::kinematics::JacobianBias;
use super::super::tasks::{InverseKinematicsStep, OperationalSpaceDynamics};
use super::super::Quantity;
use super::derivatives::weighed_slopes;
use super::forward_derivatives::MovingJoints;
use super::{solved, Chapter, Effect, Truth};
use nalgebra::{DMatrix, DVector};
use straightline_core::magnitude::Magnitude;
use straightline_core::reference::{self, CentreOfMassFrame};
use straightline_core::{Dd, Real};

impl Truth for OperationalSpaceDynamics {
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let joints = MovingJoints::new(at);
        let velocity = DVector::from_vec(VelocityForce::truth_of(at)?) + at.passive(at.qd());
        let gravity = DVector::from_vec(GravityForce::truth_of(at)?);
        let biases = JacobianBias::truth_of(at)?;
        let mut blocks: [Vec<Magnitude>; 5] = Default::default();
        for (frame, bias) in at.frames.iter().zip(biases.chunks(6)) {
            let (jacobian, rows) = rows_of(at, frame, &joints.moving);
            let (m, n) = jacobian.shape();
            // H⁻¹ Jᵀ
            let response: Vec<DVector<Magnitude>> =
                (0..m).map(|k| joints.response(&jacobian.row(k).transpose())).collect();
            let damping = at.get(Quantity::Damping)[0];
            let mut feels = DMatrix::from_fn(m, m, |i, j| jacobian.row(i).transpose().dot(&response[j]));
            (0..m).for_each(|k| feels[(k, k)] += damping * damping);
            let times_inertia = |x: DVector<Magnitude>| solved(&feels, &x, reference::solve_symmetric);
            let unit = |k: usize| DVector::from_fn(m, |i, _| if i == k { Magnitude::one() } else { Magnitude::zero() });
            let inertia: Vec<_> = (0..m).map(|k| times_inertia(unit(k))).collect();
            let force = |forces: &DVector<Magnitude>, bias: &dyn Fn(usize) -> Magnitude| {
                let own = forces.select_rows(&joints.moving);
                times_inertia(DVector::from_fn(m, |k, _| response[k].dot(&own) - bias(rows[k])))
            };
            let inverse: Vec<_> = (0..n).map(|i| times_inertia(DVector::from_fn(m, |k, _| response[k][i]))).collect();
            let six = |x: &dyn Fn(usize) -> Magnitude| -> Vec<Magnitude> {
                let mut all = vec![Magnitude::zero(); 6];
                rows.iter().enumerate().for_each(|(k, row)| all[*row] = x(k));
                all
            };
            for row in 0..6 {
                let of_row = rows.iter().position(|r| *r == row);
                blocks[0].extend(six(&|k| of_row.map_or(Magnitude::zero(), |row| inertia[k][row])));
            }
            let (mu, p) = (force(&velocity, &|row| bias[row]), force(&gravity, &|_| Magnitude::zero()));
            blocks[1].extend(six(&|k| mu[k]));
            blocks[2].extend(six(&|k| p[k]));
            for (i, row) in inverse.iter().enumerate() {
                blocks[3].extend(six(&|k| row[k]));
                let unit = |j: usize| if i == j { Magnitude::one() } else { Magnitude::zero() };
                blocks[4].extend((0..n).map(|j| unit(j) - row.dot(&jacobian.column(j))));
            }
        }
        Some(blocks.concat())
    }
}

impl Truth for InverseKinematicsStep {
    /// The least of (δq − b)ᵀ H (δq − b) + Σ w² (e − J δq)²/λ², twice: joints that go beyond their limits are held there. The sizes of what a step is
    /// made of are those of the second time.
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        let joints = MovingJoints::new(at);
        let n = joints.moving.len();
        let (mut jacobian, mut error, mut weight) = (Vec::new(), Vec::new(), Vec::new());
        for (f, frame) in at.frames.iter().enumerate() {
            let (own, rows) = rows_of(at, frame, &joints.moving);
            jacobian.extend((0..rows.len()).map(|k| own.row(k).transpose()));
            error.extend(rows.iter().map(|row| at.get(Quantity::PoseError)[6 * f + row]));
            weight.extend(rows.iter().map(|row| at.get(Quantity::TaskWeight)[6 * f + row]));
        }
        let descent = descent(at, &joints);
        let mut step: Vec<Magnitude> = descent.iter().copied().collect();
        let mut held: Vec<Option<Magnitude>> = vec![None; n];
        for _ in 0..2 {
            let base = DVector::from_fn(n, |i, _| held[i].unwrap_or(descent[i]));
            let free: Vec<usize> = (0..n).filter(|i| held[*i].is_none()).collect();
            let left = jacobian.iter().zip(&error).map(|(row, e)| *e - row.dot(&base));
            let more = least_squares(at, &joints.h, &jacobian, (&left.collect::<Vec<_>>(), &weight), &free);
            step = base.iter().copied().collect();
            free.iter().zip(more.iter()).for_each(|(i, more)| step[*i] += *more);
            for (i, held) in held.iter_mut().enumerate() {
                if let Some(end) = end_beyond(at, joints.moving[i], step[i]) {
                    (*held, step[i]) = (Some(end), end.of_size(step[i].size));
                }
            }
        }
        Some(step)
    }
}

/// The rows of a frame's Jacobian that are asked for, of the joints that move, and their places among six.
fn rows_of(
    at: &Chapter<'_>,
    frame: &CentreOfMassFrame<Magnitude>,
    moving: &[usize],
) -> (DMatrix<Magnitude>, Vec<usize>) {
    let rows: Vec<usize> = at.rows.places().collect();
    let whole = at.jacobian_on(&at.tree, frame, at.q());
    (DMatrix::from_fn(rows.len(), moving.len(), |i, j| whole[(rows[i], moving[j])]), rows)
}

/// y of (λ² H + Jᵀ W² J) y = Jᵀ W² r over the coordinates that are free.
fn least_squares(
    at: &Chapter<'_>,
    h: &DMatrix<Magnitude>,
    jacobian: &[DVector<Magnitude>],
    (left, weight): (&[Magnitude], &[Magnitude]),
    free: &[usize],
) -> DVector<Magnitude> {
    let damping = at.get(Quantity::Damping)[0];
    let rows: Vec<_> = jacobian.iter().zip(weight).map(|(row, w)| row.select_rows(free) * *w).collect();
    let normal = DMatrix::from_fn(free.len(), free.len(), |i, j| {
        rows.iter().fold(damping * damping * h[(free[i], free[j])], |sum, row| sum + row[i] * row[j])
    });
    let right = DVector::from_fn(free.len(), |i, _| {
        rows.iter().zip(left.iter().zip(weight)).fold(Magnitude::zero(), |sum, (row, (r, w))| sum + row[i] * *w * *r)
    });
    solved(&normal, &right, reference::solve_symmetric)
}

/// Down the slope of ½ Σ (τ/τ_max)² of the torques that hold the robot still, in the metric of H.
fn descent(at: &Chapter<'_>, joints: &MovingJoints<'_, '_>) -> DVector<Magnitude> {
    let rest = vec![Magnitude::zero(); at.qd().len()];
    let torques = at.forces_on(&at.tree, [at.q(), &rest, &rest]);
    let moves = |iv: usize| joints.moving.contains(&iv);
    let efforts: Vec<&Effect> =
        at.effects.iter().filter(|effect| moves(effect.iv) && effect.effort.is_some()).collect();
    let mut weighed = rest.clone();
    for link in at.tree.links.iter().filter(|link| link.joint.nv() == 1 && moves(link.iv)) {
        let own = efforts.iter().find(|effect| effect.iv == link.iv).and_then(|effect| effect.effort);
        let weight = match own {
            Some(effort) => Dd::ONE / (effort * effort),
            None if efforts.is_empty() => Dd::ONE,
            None => Dd::ZERO,
        };
        weighed[link.iv] = torques[link.iv] * Magnitude::new(weight);
    }
    let slopes = weighed_slopes(at, &at.tree, [at.q(), &rest, &rest], &weighed);
    let gain = at.get(Quantity::TorqueGain)[0];
    let own = DVector::from_iterator(joints.moving.len(), joints.moving.iter().map(|i| -(slopes[*i] * gain)));
    solved(&joints.h, &own, reference::solve_symmetric)
}

/// Where a step of a coordinate has to end, if it goes beyond.
fn end_beyond(at: &Chapter<'_>, iv: usize, step: Magnitude) -> Option<Magnitude> {
    let effect = at.effects.iter().find(|effect| effect.iv == iv)?;
    let to = |limit: Dd| Magnitude::new(limit) - at.q()[effect.iq];
    let [lower, upper] = effect.range.map(|limit| limit.map(to));
    let is_below = |end: &Magnitude| step.value < end.value;
    let is_above = |end: &Magnitude| step.value > end.value;
    lower.filter(is_below).or(upper.filter(is_above))
}
