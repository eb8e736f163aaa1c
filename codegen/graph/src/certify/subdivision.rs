//! Branch and bound: the box of a result is cut where the bound is greatest. The same number of boxes gives the same bound on
//! every machine; a time does not.
//!
//! The whole box is analysed once, and written on a [`Tape`] per result, which is played for the parts, [`LANES`] of them
//! at a time. Results are refined on as many threads as there are processors; each has its own tape, so that it does not matter
//! which thread takes which.
//!
//! Of an angle that turns more than once, one turn is cut: the bound of the rest is the same.
//!
//! A part is only ever replaced by two that cover it, and its bound holds for both. So the greatest bound of all parts is one for the box.

use super::analysis::{Broken, OfResult};
use super::tape::{Registers, Tape, LANES};
use super::{Effort, ErrorAnalysis, Interval, NoCertificate};
use crate::expr::NodeId;
use std::collections::BinaryHeap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;
use straightline_core::random::Random;

/// A part of the box, and the bound there.
struct BoxPart {
    ranges: Vec<Interval>,
    bound: f64,
    /// How often each input was halved.
    cuts: Vec<u32>,
}

impl Ord for BoxPart {
    fn cmp(&self, other: &BoxPart) -> std::cmp::Ordering {
        self.bound.total_cmp(&other.bound)
    }
}

impl PartialOrd for BoxPart {
    fn partial_cmp(&self, other: &BoxPart) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for BoxPart {
    fn eq(&self, other: &BoxPart) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for BoxPart {}

/// Node, error and magnitude of every distinct result; the magnitude is that in the whole box.
pub(super) fn bounds(
    analysis: &mut ErrorAnalysis,
    inputs: &[Interval],
    effort: Effort,
) -> Result<Vec<(NodeId, f64, f64)>, NoCertificate> {
    let errors = refined_bounds(analysis, inputs, effort, OfResult::Error)?;
    let of = |(node, error)| (node, error, analysis.range(node).mag());
    Ok(errors.into_iter().map(of).collect())
}

/// Node and magnitude of every distinct result.
pub(super) fn magnitudes(
    analysis: &mut ErrorAnalysis,
    inputs: &[Interval],
    effort: Effort,
) -> Result<Vec<(NodeId, f64)>, NoCertificate> {
    refined_bounds(analysis, inputs, effort, OfResult::Magnitude)
}

/// Node and bound of every distinct result.
fn refined_bounds(
    analysis: &mut ErrorAnalysis,
    inputs: &[Interval],
    effort: Effort,
    bounded: OfResult,
) -> Result<Vec<(NodeId, f64)>, NoCertificate> {
    let is_cut = effort.boxes > 1 && effort.time.is_none_or(|time| !time.is_zero());
    if is_cut {
        analysis.ranges_on_tape(inputs)?;
    } else {
        analysis.ranges(inputs)?;
    }
    let turn = if analysis.is_broken(Broken::HalfTurn) { 0.5 } else { 1.0 } * std::f64::consts::TAU;
    let inputs = &once_around(inputs, &analysis.turning_inputs(), turn)[..];
    let parts = samples(inputs);
    let samples: Vec<&[Interval]> = parts.iter().map(Vec::as_slice).collect();
    let mut all = Vec::new();
    let mut searches = Vec::new();
    for k in 0..analysis.results() {
        let node = analysis.result(k);
        let bound = match (is_cut, bounded) {
            (false, OfResult::Error) => analysis.error(k),
            (false, OfResult::Magnitude) => analysis.range(node).mag(),
            (true, _) => {
                let (whole, tape) = analysis.bound_and_tape(bounded, k, &samples);
                let depends =
                    analysis.inputs_of(k).into_iter().filter(|i| inputs[*i].width() > f64::MIN_POSITIVE).collect();
                let drops_a_part = analysis.is_broken(Broken::Part);
                searches.push((k, BoxSearch { tape, inputs, whole, depends, drops_a_part }));
                whole
            }
        };
        all.push((node, bound));
    }
    let until = effort.time.map(|time| Instant::now() + time);
    for (k, bound) in refined(&searches, effort.boxes, until) {
        all[k].1 = all[k].1.min(bound);
    }
    Ok(all)
}

/// The box with one turn of each angle that covers more.
///
/// A program takes the sine and cosine of these angles alone, and their errors have the same bound at every angle: what it computes from an angle
/// and errors in these bounds is the same function after a whole turn.
fn once_around(inputs: &[Interval], turning: &[usize], turn: f64) -> Vec<Interval> {
    let mut reduced = inputs.to_vec();
    for i in turning {
        let range = &mut reduced[*i];
        // a little more than a turn
        range.hi = range.hi.min((range.lo + turn.next_up()).next_up());
    }
    reduced
}

/// The box, and parts of it in halves and quarters of some of its inputs.
pub(super) fn samples(inputs: &[Interval]) -> Vec<Vec<Interval>> {
    let mut random = Random(1);
    let mut part = |r: &Interval| {
        let parts = 1 << random.below(3);
        let step = (r.hi - r.lo) / f64::from(parts);
        let lo = r.lo + step * random.below(parts as usize) as f64;
        Interval { lo, hi: (lo + step).min(r.hi).max(lo) }
    };
    let parts = (1..2 * LANES).map(|_| inputs.iter().map(&mut part).collect());
    std::iter::once(inputs.to_vec()).chain(parts.collect::<Vec<_>>()).collect()
}

/// The bounds of results, by their numbers.
fn refined(searches: &[(usize, BoxSearch)], boxes: usize, until: Option<Instant>) -> Vec<(usize, f64)> {
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(searches.len());
    let next = AtomicUsize::new(0);
    let work = || {
        let mut found = Vec::new();
        let mut registers = Registers::default();
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some((k, search)) = searches.get(at) else { return found };
            // what is left of the time in equal shares
            let share = |until: Instant| {
                let now = Instant::now();
                let part = threads as f64 / (searches.len() - at).max(threads) as f64;
                now + until.saturating_duration_since(now).mul_f64(part)
            };
            found.push((*k, search.refined(boxes, until.map(share), &mut registers)));
        }
    };
    std::thread::scope(|scope| {
        let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
        let mut all = work();
        others.into_iter().for_each(|t| all.extend(t.join().expect("no step of a search panics")));
        all
    })
}

/// One result in its box.
struct BoxSearch<'a> {
    tape: Tape,
    inputs: &'a [Interval],
    whole: f64,
    /// The inputs that it depends on and that have a width.
    depends: Vec<usize>,
    /// Wrong on purpose.
    drops_a_part: bool,
}

impl BoxSearch<'_> {
    /// What is gained by each input if it keeps to a quarter of its range; nothing where there is no time left.
    fn gains(&self, until: Option<Instant>, registers: &mut Registers) -> Option<Vec<f64>> {
        const QUARTERS: usize = 4;
        let mut gains = Vec::with_capacity(self.depends.len());
        for some in self.depends.chunks(LANES / QUARTERS) {
            if is_late(until) {
                return None;
            }
            let quarter = |i: usize, q: usize| {
                let range = self.inputs[i];
                let end = |q: usize| range.lo + (range.hi - range.lo) * 0.25 * q as f64;
                let mut ranges = self.inputs.to_vec();
                ranges[i] = Interval { lo: end(q), hi: if q + 1 == QUARTERS { range.hi } else { end(q + 1) } };
                ranges
            };
            let quarters = some.iter().flat_map(|i| (0..QUARTERS).map(move |q| quarter(*i, q)));
            let quarters: Vec<Vec<Interval>> = quarters.collect();
            let boxes: Vec<&[Interval]> = quarters.iter().map(Vec::as_slice).collect();
            let bounds = self.tape.bounds(&boxes, registers);
            gains.extend(bounds[..boxes.len()].chunks(QUARTERS).map(|of_quarters| {
                let worst = of_quarters.iter().fold(0.0f64, |worst, b| worst.max(*b));
                // inputs that gain something with others alone come last
                (self.whole - worst).max(1e-3 * self.whole)
            }));
        }
        Some(gains)
    }

    /// The input with the most to gain, each cut halving what is left of that, among those that can be cut.
    fn best_cut(&self, part: &BoxPart, gains: &[f64]) -> Option<usize> {
        let gain = |c: usize| gains[c] / f64::from(1u32 << part.cuts[c].min(31));
        let can = (0..gains.len()).filter(|c| middle(part, self.depends[*c]).is_some());
        can.max_by(|a, b| gain(*a).total_cmp(&gain(*b)))
    }

    /// The bound from so many boxes, or from those that there was time for.
    fn refined(&self, boxes: usize, until: Option<Instant>, registers: &mut Registers) -> f64 {
        let Some(gains) = self.gains(until, registers) else { return self.whole };
        let whole = BoxPart { ranges: self.inputs.to_vec(), bound: self.whole, cuts: vec![0; self.depends.len()] };
        let mut parts = BinaryHeap::from([whole]);
        while parts.len() < boxes && !is_late(until) {
            // the worst parts, as many as are played at a time
            let count = (LANES / 2).min(boxes - parts.len()).min(parts.len());
            let worst: Vec<BoxPart> = (0..count).map_while(|_| parts.pop()).collect();
            let (mut cut, points): (Vec<_>, Vec<_>) =
                worst.into_iter().map(|part| (self.best_cut(&part, &gains), part)).partition(|(c, _)| c.is_some());
            let halves: Vec<[Vec<Interval>; 2]> =
                cut.iter().map(|(c, part)| halves(part, self.depends[c.expect("they have one")])).collect();
            let flat: Vec<&[Interval]> = halves.iter().flatten().map(Vec::as_slice).collect();
            let is_at_points = !points.is_empty();
            parts.extend(points.into_iter().map(|(_, part)| part));
            if flat.is_empty() {
                break;
            }
            let bounds = self.tape.bounds(&flat, registers);
            for (n, ((c, part), both)) in cut.drain(..).zip(halves).enumerate() {
                let mut cuts = part.cuts;
                cuts[c.expect("they have one")] += 1;
                for (half, ranges) in both.into_iter().enumerate().skip(usize::from(self.drops_a_part)) {
                    // no part is worse than what it was cut from
                    let bound = bounds[2 * n + half].min(part.bound);
                    parts.push(BoxPart { ranges, bound, cuts: cuts.clone() });
                }
            }
            if is_at_points {
                break;
            }
        }
        parts.peek().map_or(0.0, |worst| worst.bound)
    }
}

fn is_late(until: Option<Instant>) -> bool {
    until.is_some_and(|until| Instant::now() >= until)
}

/// Where an input of a part is cut, unless it is as good as a point.
fn middle(part: &BoxPart, i: usize) -> Option<f64> {
    let range = part.ranges[i];
    let middle = range.lo + 0.5 * (range.hi - range.lo);
    (range.lo < middle && middle < range.hi).then_some(middle)
}

fn halves(part: &BoxPart, i: usize) -> [Vec<Interval>; 2] {
    let middle = middle(part, i).expect("only inputs that can be cut are");
    let range = part.ranges[i];
    [Interval { lo: range.lo, hi: middle }, Interval { lo: middle, hi: range.hi }].map(|half| {
        let mut ranges = part.ranges.clone();
        ranges[i] = half;
        ranges
    })
}
