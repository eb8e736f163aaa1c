//! The worst case by search: hill climbing in a box.
//!
//! Random states find a quarter of the worst rounding error of a program at best; the rest hides in a few states. A climb starts
//! anywhere and moves some coordinates at a time, by steps from the width of the box down to neighbouring floats, because
//! rounding errors are as rugged as that. What is found is a lower bound of the worst case, never more.

use crate::random::Random;

/// Least and greatest value of each coordinate.
#[derive(Clone, Debug)]
pub struct Ranges(pub Vec<(f64, f64)>);

/// The worst that was found.
#[derive(Clone, Debug)]
pub struct Found {
    /// The objective there.
    pub value: f64,
    /// Where.
    pub at: Vec<f64>,
    /// The mean square root of the objective's squares over the starts: what a random state gives.
    pub rms: f64,
    /// How often the objective was evaluated.
    pub evaluations: usize,
}

/// Steps without gain after which a climb starts anew.
pub const PATIENCE: usize = 400;

impl Ranges {
    /// A place anywhere in the box.
    pub fn anywhere(&self, random: &mut Random) -> Vec<f64> {
        self.0.iter().map(|(low, high)| random.between(*low, *high)).collect()
    }

    /// A place near `x`: one to three coordinates moved, by up to the width of the box or by a few neighbouring floats.
    fn near(&self, x: &[f64], random: &mut Random) -> Vec<f64> {
        let mut near = x.to_vec();
        for _ in 0..1 + random.below(3) {
            let i = random.below(x.len());
            let (low, high) = self.0[i];
            near[i] = match random.below(8) {
                0 => random.between(low, high),
                1 => [low, high, 0.0][random.below(3)],
                2 => x[i] + x[i] * f64::EPSILON * (random.below(17) as f64 - 8.0),
                step => x[i] + (high - low) * 10f64.powi(-(step as i32 - 2) * 2) * random.between(-1.0, 1.0),
            }
            .clamp(low, high);
        }
        near
    }

    /// Climbs until the objective has been evaluated so often. Values that are no number count as infinite.
    pub fn climb(&self, random: &mut Random, evaluations: usize, objective: impl FnMut(&[f64]) -> f64) -> Found {
        self.climb_with(PATIENCE, random, evaluations, objective)
    }

    /// The same with another patience; 0 tries random places only.
    pub fn climb_with(
        &self,
        patience: usize,
        random: &mut Random,
        evaluations: usize,
        mut objective: impl FnMut(&[f64]) -> f64,
    ) -> Found {
        let mut judge = |x: &[f64]| match objective(x) {
            value if value.is_nan() => f64::INFINITY,
            value => value,
        };
        let (mut best, mut squares, mut starts) = ((-1.0, Vec::new()), 0.0, 0);
        let mut spent = 0;
        while spent < evaluations {
            let mut here = self.anywhere(random);
            let mut value = judge(&here);
            (spent, starts, squares) = (spent + 1, starts + 1, squares + value * value);
            let mut idle = 0;
            while idle < patience && spent < evaluations {
                let there = self.near(&here, random);
                let new = judge(&there);
                spent += 1;
                idle += 1;
                if new >= value {
                    idle = if new > value { 0 } else { idle };
                    (here, value) = (there, new);
                }
            }
            if value > best.0 {
                best = (value, here);
            }
        }
        Found { value: best.0, at: best.1, rms: (squares / f64::from(starts)).sqrt(), evaluations: spent }
    }
}
