//! Branch and bound: the box of a result is cut where the bound is greatest. The same number of boxes gives the same bound on
//! every machine; a time does not.

use super::{Analysis, Effort, Interval, Refusal};
use crate::expr::NodeId;
use std::time::Instant;

/// A part of the box, and the bound of the error there.
struct Part {
    ranges: Vec<Interval>,
    error: f64,
    /// How often each input was halved.
    cuts: Vec<u32>,
}

/// Node, error and magnitude of every distinct result.
pub(super) fn bounds(
    analysis: &mut Analysis,
    inputs: &[Interval],
    effort: Effort,
) -> Result<Vec<(NodeId, f64, f64)>, Refusal> {
    analysis.ranges(inputs)?;
    let results = 0..analysis.results();
    let mut all: Vec<(NodeId, f64, f64)> = results
        .clone()
        .map(|k| (analysis.result(k), analysis.error(k), analysis.range(analysis.result(k)).mag()))
        .collect();
    if effort.boxes > 1 {
        let (start, count) = (Instant::now(), results.len() as u32);
        for k in results {
            let until = effort.time.map(|time| start + time * (k as u32 + 1) / count);
            all[k].1 = all[k].1.min(refined(analysis, inputs, k, effort.boxes, until)?);
        }
    }
    Ok(all)
}

/// The bound of one result from so many boxes, or from those that there was time for.
fn refined(
    analysis: &mut Analysis,
    inputs: &[Interval],
    k: usize,
    boxes: usize,
    until: Option<Instant>,
) -> Result<f64, Refusal> {
    let is_late = || until.is_some_and(|until| Instant::now() >= until);
    let candidates: Vec<usize> =
        analysis.inputs_of(k).into_iter().filter(|i| inputs[*i].width() > f64::MIN_POSITIVE).collect();
    let mut bound = |ranges: &[Interval]| -> Result<f64, Refusal> {
        analysis.ranges(ranges)?;
        Ok(analysis.error(k))
    };
    let whole = bound(inputs)?;
    // what a quarter of each range gains: halves of symmetric ranges have equal magnitudes
    let mut gains = Vec::with_capacity(candidates.len());
    for &i in &candidates {
        if is_late() {
            return Ok(whole);
        }
        let mut worst = 0.0f64;
        for quarter in 0..4 {
            let mut ranges = inputs.to_vec();
            let (lo, width) = (inputs[i].lo, inputs[i].hi - inputs[i].lo);
            let end = |q: i32| if q == 4 { inputs[i].hi } else { lo + width * 0.25 * f64::from(q) };
            ranges[i] = Interval { lo: end(quarter), hi: end(quarter + 1) };
            worst = worst.max(bound(&ranges)?);
        }
        gains.push(whole - worst);
    }
    let mut parts = vec![Part { ranges: inputs.to_vec(), error: whole, cuts: vec![0; candidates.len()] }];
    while parts.len() < boxes && !is_late() {
        // the worst part, cut along the input of the greatest gain; each cut in it halves what is left to gain
        let worst =
            (0..parts.len()).max_by(|a, b| parts[*a].error.total_cmp(&parts[*b].error)).expect("there is a part");
        let gain = |part: &Part, c: usize| gains[c] / f64::from(1u32 << part.cuts[c].min(31));
        let part = &parts[worst];
        let Some(c) = (0..candidates.len()).max_by(|a, b| gain(part, *a).total_cmp(&gain(part, *b))) else { break };
        let i = candidates[c];
        let range = part.ranges[i];
        let middle = range.lo + 0.5 * (range.hi - range.lo);
        if !(range.lo < middle && middle < range.hi) {
            break;
        }
        let mut halves = Vec::with_capacity(2);
        for half in [Interval { lo: range.lo, hi: middle }, Interval { lo: middle, hi: range.hi }] {
            let mut ranges = part.ranges.clone();
            ranges[i] = half;
            let mut cuts = part.cuts.clone();
            cuts[c] += 1;
            // no part is worse than what it was cut from
            let error = bound(&ranges)?.min(part.error);
            halves.push(Part { ranges, error, cuts });
        }
        parts.swap_remove(worst);
        parts.extend(halves);
    }
    Ok(parts.iter().fold(0.0, |worst, part| worst.max(part.error)))
}
