//! From the path of a frame to the motion of the joints.

use crate::motion::{Motion, NoMotion};
use std::fmt;
use straightline_core::algorithms::{forward_kinematics, jacobian};
use straightline_core::model::{Frame, Model};

/// Iterations per point, at most.
const ITERATIONS: usize = 100;
/// So near \[m, rad\] a point counts as reached.
const REACHED: f64 = 1e-10;
/// Instants of a path, at most.
const MOST_POINTS: usize = 200_000;
/// Damping of the least squares \[m or rad\]: keeps steps finite near singular poses, and is small beside any reach.
const DAMPING: f64 = 1e-6;

/// Why a path has no motion of the joints.
#[derive(Clone, Debug, PartialEq)]
pub enum NoPath {
    /// The frame cannot be brought there: when \[s\], and how far it stays away \[m, rad\].
    OutOfReach {
        /// Time \[s\].
        time: f64,
        /// Distance \[m, rad\].
        distance: f64,
    },
    /// The points are no motion.
    Points(NoMotion),
    /// It lasts too long \[s\].
    TooLong(f64),
}

impl fmt::Display for NoPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NoPath::OutOfReach { time, distance } => {
                write!(f, "the frame does not reach its place at t = {time} s: it stays {distance:.3e} (m or rad) away")
            }
            NoPath::Points(why) => why.fmt(f),
            NoPath::TooLong(time) => {
                write!(f, "{time} s are too long for a path of a frame: the joints are solved for at {MOST_POINTS} instants at most")
            }
        }
    }
}

/// The motion of the joints that leads a frame along a path of positions \[m\] in the world from the configuration `start`, with
/// the orientation that it has there if `keeps_orientation`. Of a robot with joints to spare the smallest movement from
/// instant to instant. Every `interval` \[s\] the joints are solved for, by damped least squares, cubic splines lie between.
///
/// # Errors
/// [`NoPath`].
pub fn joint_motion(
    model: &Model<f64>,
    frame: &Frame<f64>,
    path: &Motion,
    start: &[f64],
    keeps_orientation: bool,
    interval: f64,
) -> Result<Motion, NoPath> {
    let steps = (path.duration() / interval).ceil().max(4.0) as usize;
    if steps > MOST_POINTS {
        return Err(NoPath::TooLong(path.duration()));
    }
    let orientation = forward_kinematics(model, start, &[frame])[0].rotation;
    let mut q = start.to_vec();
    let (mut times, mut points) = (Vec::new(), Vec::new());
    for k in 0..=steps {
        let time = path.duration() * k as f64 / steps as f64;
        let (wanted, ..) = path.at(time);
        let mut distance = f64::INFINITY;
        for _ in 0..ITERATIONS {
            let pose = forward_kinematics(model, &q, &[frame])[0];
            let p = pose.translation.to_array();
            let mut error: Vec<f64> = (0..3).map(|i| wanted[i] - p[i]).collect();
            if keeps_orientation {
                // ½ Σ columns × wanted columns: sin(angle) along the axis of the turn that is left
                let crosses = (0..3).map(|c| pose.rotation.column(c).cross(orientation.column(c)).to_array());
                let sum = crosses.fold([0.0; 3], |s, x| [s[0] + x[0], s[1] + x[1], s[2] + x[2]]);
                error.extend(sum.map(|x| 0.5 * x));
            }
            distance = error.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            if distance < REACHED {
                break;
            }
            let j = jacobian(model, &q, frame);
            let (nv, rows) = (q.len(), error.len());
            let mut square = vec![vec![0.0; rows]; rows];
            for (a, row) in square.iter_mut().enumerate() {
                for (b, x) in row.iter_mut().enumerate() {
                    *x = (0..nv).map(|i| j[a * nv + i] * j[b * nv + i]).sum();
                }
                row[a] += DAMPING * DAMPING;
            }
            let weights = solved(square, error);
            for (i, q) in q.iter_mut().enumerate() {
                let step: f64 = (0..rows).map(|a| j[a * nv + i] * weights[a]).sum();
                // a turn of half a radian is as far as the linear equations can be trusted
                *q += step.clamp(-0.5, 0.5);
            }
        }
        if distance.is_nan() || distance >= REACHED {
            return Err(NoPath::OutOfReach { time, distance });
        }
        times.push(time);
        points.push(q.clone());
    }
    Motion::cubic(&times, &points).map_err(NoPath::Points)
}

/// x of A x = b, A symmetric and positive definite, by elimination.
fn solved(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for k in 0..n {
        for i in k + 1..n {
            let factor = a[i][k] / a[k][k];
            let (above, below) = a.split_at_mut(i);
            below[0][k..].iter_mut().zip(&above[k][k..]).for_each(|(x, y)| *x -= factor * y);
            b[i] -= factor * b[k];
        }
    }
    for i in (0..n).rev() {
        for j in i + 1..n {
            b[i] -= a[i][j] * b[j];
        }
        b[i] /= a[i][i];
    }
    b
}
