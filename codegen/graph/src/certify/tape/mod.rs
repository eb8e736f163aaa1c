//! What an analysis computes from a box, as a list of steps that can be repeated for parts of the box.
//!
//! [`Analysis`](super::Analysis) finds out which of many bounds are the least in a box, and that takes far longer than computing these alone.
//! So a [`Pen`] writes down every operation on the way; [`Tape::new`] keeps those that the bound of one result needs, without minima
//! that hardly ever come from one of their operands, and [`Tape::bounds`] repeats them for [`LANES`] boxes at a time.
//!
//! **Why it holds.** Every step takes enclosures of numbers, or upper bounds, to one of another number, in whatever box: those of a
//! part of the box hold there. The analysis of the whole box has decided three things that steps no longer ask: that no value
//! overflows, no divisor vanishes and every sign is right, and what is zero or one there: true of all its points, and so in each of its parts;
//! which of several bounds are written down as the operands of a minimum: each of them alone is one.
//!
//! **Outward rounding** is x ± (|x| ε + m), m the smallest normal number: |x| ε is an ulp of x at least, so that the sum lies
//! beyond the next number, and m makes up for what is lost below the normal numbers. If anything became infinite
//! or no number in a box, its bound is infinite.

mod pen;
mod run;
mod step;

use super::interval::Interval;
use pen::Mark;
pub(super) use pen::{Norm, Pen};
use rustc_hash::FxHashMap;
use step::TapeStep;

/// An enclosure of a number, and the step that computes it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Enclosure {
    pub x: Interval,
    at: u32,
}

/// An upper bound of a number ≥ 0, and the step that computes it.
#[derive(Clone, Copy, Debug)]
pub(super) struct UpperBound {
    pub x: f64,
    at: u32,
}

impl Enclosure {
    pub const ZERO: Enclosure = Enclosure { x: Interval::ZERO, at: ZERO };
    pub const ONE: Enclosure = Enclosure { x: Interval::ONE, at: ONE };
}

impl UpperBound {
    pub const ZERO: UpperBound = UpperBound { x: 0.0, at: ZERO };

    /// Whether it was written down at that mark, or later.
    pub fn is_since(self, mark: Mark) -> bool {
        self.at as usize >= mark.0
    }
}

/// The first two steps of all.
const ZERO: u32 = 0;
const ONE: u32 = 1;

/// So many boxes at a time.
pub(super) const LANES: usize = 8;

/// One number per box.
pub(super) type BoxLanes = [f64; LANES];

/// The steps of one result's bound.
#[derive(Clone, Debug)]
pub(super) struct Tape {
    steps: Vec<TapeStep>,
    constants: Vec<Interval>,
}

/// What steps have computed: lower and upper ends.
#[derive(Clone, Debug, Default)]
pub(super) struct Registers {
    ends: Vec<(BoxLanes, BoxLanes)>,
}

impl Tape {
    /// The steps that a bound needs. `samples`: parts of the box. Of a minimum that is the same operand in all of them, the others go.
    pub fn new(pen: &Pen, bound: UpperBound, samples: &[&[Interval]]) -> Tape {
        let mut tape = Tape { steps: Vec::new(), constants: pen.constants.clone() };
        if !pen.writes {
            return tape;
        }
        let mut is_needed = vec![false; pen.steps.len()];
        is_needed[bound.at as usize] = true;
        for at in (0..pen.steps.len()).rev() {
            if is_needed[at] {
                pen.steps[at].operands().for_each(|a| is_needed[a as usize] = true);
            }
        }
        let needed = (0..pen.steps.len()).filter(|at| is_needed[*at]);
        tape.steps = compacted(needed.map(|at| (at as u32, pen.steps[at])), &tape.constants);
        tape.prune(samples);
        tape
    }

    fn prune(&mut self, samples: &[&[Interval]]) {
        // per step: which of its operands made a difference
        let mut matters = vec![[false; 2]; self.steps.len()];
        let mut registers = Registers::default();
        for boxes in samples.chunks(LANES) {
            self.run(boxes, &mut registers);
            let ends = &registers.ends;
            for (i, step) in self.steps.iter().enumerate() {
                for l in 0..boxes.len() {
                    let at = |k: u32| (ends[k as usize].0[l], ends[k as usize].1[l]);
                    match *step {
                        TapeStep::Least(a, b) => {
                            matters[i][0] |= at(a).1 < at(b).1;
                            matters[i][1] |= at(b).1 < at(a).1;
                        }
                        TapeStep::Clipped(a, _) => matters[i][1] |= at(i as u32) != at(a),
                        TapeStep::Intersection(a, b) => {
                            matters[i][0] |= at(i as u32) != at(b);
                            matters[i][1] |= at(i as u32) != at(a);
                        }
                        _ => matters[i] = [true; 2],
                    }
                }
            }
        }
        let mut same: Vec<u32> = (0..self.steps.len() as u32).collect();
        for (i, step) in self.steps.iter().enumerate() {
            match (*step, matters[i]) {
                (TapeStep::Least(_, b) | TapeStep::Intersection(_, b), [false, true]) => same[i] = same[b as usize],
                (TapeStep::Least(a, _) | TapeStep::Intersection(a, _) | TapeStep::Clipped(a, _), [_, false]) => {
                    same[i] = same[a as usize];
                }
                _ => {}
            }
        }
        let Some(result) = same.last() else { return };
        let steps: Vec<TapeStep> = self.steps.iter().map(|s| s.map(|a| same[a as usize])).collect();
        let mut is_needed = vec![false; steps.len()];
        is_needed[*result as usize] = true;
        for i in (0..=*result as usize).rev() {
            if is_needed[i] {
                steps[i].operands().for_each(|a| is_needed[a as usize] = true);
            }
        }
        let kept = steps.iter().enumerate().filter(|(i, _)| is_needed[*i]).map(|(i, s)| (i as u32, *s));
        self.steps = compacted(kept.collect::<Vec<_>>().into_iter(), &self.constants);
    }

    /// The bounds in these boxes; infinite where nothing is known.
    pub fn bounds(&self, boxes: &[&[Interval]], registers: &mut Registers) -> BoxLanes {
        self.run(boxes, registers);
        let Some(last) = registers.ends[..self.steps.len()].last() else { return [f64::INFINITY; LANES] };
        let mut bounds = last.1;
        // 0 as long as all is finite
        let mut odd = [0.0; LANES];
        for (lo, hi) in &registers.ends[..self.steps.len()] {
            for l in 0..LANES {
                odd[l] += lo[l] * 0.0 + hi[l] * 0.0;
            }
        }
        for l in 0..LANES {
            if odd[l] != 0.0 {
                bounds[l] = f64::INFINITY;
            }
        }
        bounds
    }
}

/// Steps with their former indices, in order, with one for equal ones; operands by the indices among them.
fn compacted(steps: impl Iterator<Item = (u32, TapeStep)>, constants: &[Interval]) -> Vec<TapeStep> {
    let mut kept: Vec<TapeStep> = Vec::new();
    let mut places: Vec<u32> = Vec::new();
    let mut known: FxHashMap<TapeStep, u32> = FxHashMap::default();
    let mut numbers: FxHashMap<(u64, u64), u32> = FxHashMap::default();
    for (at, step) in steps {
        let mut step = step.map(|a| places[a as usize]);
        // equal constants by the first of them
        if let TapeStep::Constant(k) = &mut step {
            let x = constants[*k as usize];
            *k = *numbers.entry((x.lo.to_bits(), x.hi.to_bits())).or_insert(*k);
        }
        let place = *known.entry(step).or_insert_with(|| {
            kept.push(step);
            kept.len() as u32 - 1
        });
        places.resize(at as usize, u32::MAX);
        places.push(place);
    }
    kept
}
