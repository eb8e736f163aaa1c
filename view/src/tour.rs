//! What is shown of a robot without a run: each joint goes through its range, one after the other.

use crate::html::most_rows;
use crate::run::{coordinate_columns, ViewedRun};
use crate::solids::reach;
use straightline_core::algorithms::integrate;
use straightline_core::joint::Measure;
use straightline_core::model::{Joint, Model};

/// How far a coordinate without a limit turns to each side \[rad\].
const TURN: f64 = std::f64::consts::FRAC_PI_2;
/// Ranges are shown no further than this \[rad\]; some files write limits that are none.
const FARTHEST_TURN: f64 = std::f64::consts::TAU;
/// How far one slides to each side, as a part of the robot's reach.
const SLIDE: f64 = 0.15;
/// Time that a coordinate takes \[s\].
const DURATION: f64 = 2.0;
/// Rows that a coordinate takes: between these, so that a page shows all of them if it can. Multiples of
/// three, so that limits are among them.
const ROWS: [usize; 2] = [6, 42];

impl ViewedRun {
    /// A motion through the range of each joint in turn: from where it stands to its upper limit, to its lower one, and back; without limits a
    /// quarter turn, or some of the robot's reach, to each side. Bases stand still. Robots with loops move as far as these stay closed.
    pub fn tour(model: &Model<f64>) -> ViewedRun {
        let start = model.neutral();
        let mut run = ViewedRun { times: vec![0.0], configurations: vec![start.clone()], ..Default::default() };
        let size = reach(model, &start);
        let slide = SLIDE * size;
        let coordinates = model.nv().max(1);
        let rows = ((most_rows(model.bodies.len(), model.nq()) - 1) / coordinates).clamp(ROWS[0], ROWS[1]) / 3 * 3;
        for joint in model.independent_joints().filter(|joint| !joint.kind.is_base()) {
            for (k, measure) in joint.kind.row().measures.iter().enumerate() {
                let (free, most) = match measure {
                    Measure::Angle => (TURN, FARTHEST_TURN),
                    Measure::Length => (slide, size),
                };
                let range = range(joint, &start, free).map(|end| end.clamp(-most, most));
                through(model, &mut run, rows, (joint.iv + k, range));
            }
        }
        let joints = model.joints();
        let names = joints.iter().map(|joint| (joint.iq, coordinate_columns(joint)));
        for (first, names) in names {
            let column = |k: usize| run.configurations.iter().map(|q| q[first + k]).collect();
            run.columns.extend(names.into_iter().enumerate().map(|(k, name)| (name, column(k))));
        }
        let moved = match run.times.len() {
            1 => "No run was given, and the robot has no joint to move.",
            _ => "No run was given: each joint moves through its range in turn; without a limit, by a quarter turn or a little way.",
        };
        run.notes.push(moved.to_string());
        run
    }
}

/// How far the joint goes to both sides of where it stands; one of several coordinates knows no limits.
fn range(joint: &Joint, start: &[f64], free: f64) -> [f64; 2] {
    if !joint.kind.is_single() {
        return [-free, free];
    }
    let to = |limit: f64, free: f64| if limit.is_finite() { limit - start[joint.iq] } else { free };
    [to(joint.limits.lower, -free), to(joint.limits.upper, free)]
}

/// One velocity coordinate goes up, down and back, from where the run began.
fn through(model: &Model<f64>, run: &mut ViewedRun, rows: usize, (k, [lower, upper]): (usize, [f64; 2])) {
    let start = run.configurations[0].clone();
    let began = *run.times.last().expect("there is a first row");
    let corners = [0.0, upper, lower, 0.0];
    let mut before = start.clone();
    for row in 1..=rows {
        let way = 3.0 * row as f64 / rows as f64;
        let leg = (way as usize).min(2);
        let s = way - leg as f64;
        // rests at every corner: s² (3 − 2 s)
        let moved = corners[leg] + (corners[leg + 1] - corners[leg]) * s * s * (3.0 - 2.0 * s);
        let mut step = vec![0.0; model.nv()];
        step[k] = moved;
        let q = configuration(model, &start, &before, &step).unwrap_or_else(|| before.clone());
        before.clone_from(&q);
        run.times.push(began + DURATION * row as f64 / rows as f64);
        run.configurations.push(q);
    }
}

/// Where the robot stands after this step of its independent coordinates; `None` where loops do not close.
fn configuration(model: &Model<f64>, start: &[f64], before: &[f64], step: &[f64]) -> Option<Vec<f64>> {
    let q = integrate(model, start, step);
    if model.closure.is_empty() {
        return Some(q);
    }
    // another way of closing them is another robot
    model.closed_from(q, before).filter(|closed| closed.iter().zip(before).all(|(a, b)| (a - b).abs() < 1.0))
}
