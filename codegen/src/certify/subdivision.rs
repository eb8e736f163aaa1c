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
        let start = Instant::now();
        let until = |share: f64| effort.time.map(|time| start + time.mul_f64(share));
        let whole: Vec<f64> = all.iter().map(|result| result.1).collect();
        if let Some(gains) = gains(analysis, inputs, &whole, until(1.0))? {
            // what is left of the time in equal shares
            let spent = effort.time.map_or(0.0, |time| start.elapsed().as_secs_f64() / time.as_secs_f64());
            for k in results {
                let until = until(spent + (1.0 - spent) * (k + 1) as f64 / whole.len() as f64);
                all[k].1 = all[k].1.min(refined(analysis, inputs, (k, whole[k]), &gains[k], (effort.boxes, until))?);
            }
        }
    }
    Ok(all)
}

/// The inputs that a result depends on, each with what is gained if it keeps to a quarter of its range.
type Gains = Vec<(usize, f64)>;

/// Those of every result; `None`: no time.
fn gains(
    analysis: &mut Analysis,
    inputs: &[Interval],
    whole: &[f64],
    until: Option<Instant>,
) -> Result<Option<Vec<Gains>>, Refusal> {
    let depends: Vec<Vec<usize>> = (0..whole.len()).map(|k| analysis.inputs_of(k)).collect();
    let mut gains = vec![Vec::new(); whole.len()];
    for (i, range) in inputs.iter().enumerate().filter(|(_, range)| range.width() > f64::MIN_POSITIVE) {
        if until.is_some_and(|until| Instant::now() >= until) {
            return Ok(None);
        }
        // halves of symmetric ranges have equal magnitudes
        let quarters = if range.lo == -range.hi { 2 } else { 4 };
        let concerned: Vec<usize> = (0..whole.len()).filter(|k| depends[*k].contains(&i)).collect();
        let mut worst = vec![0.0f64; whole.len()];
        for quarter in 0..quarters {
            let end = |q: i32| if q == 4 { range.hi } else { range.lo + (range.hi - range.lo) * 0.25 * f64::from(q) };
            let mut ranges = inputs.to_vec();
            ranges[i] = Interval { lo: end(quarter), hi: end(quarter + 1) };
            analysis.ranges(&ranges)?;
            for k in &concerned {
                worst[*k] = worst[*k].max(analysis.error(*k));
            }
        }
        for k in concerned {
            gains[k].push((i, whole[k] - worst[k]));
        }
    }
    Ok(Some(gains))
}

/// The bound of result k, which is `whole` in one box, from so many boxes, or from those that there was time for.
fn refined(
    analysis: &mut Analysis,
    inputs: &[Interval],
    (k, whole): (usize, f64),
    gains: &[(usize, f64)],
    (boxes, until): (usize, Option<Instant>),
) -> Result<f64, Refusal> {
    let is_late = || until.is_some_and(|until| Instant::now() >= until);
    let mut bound = |ranges: &[Interval]| -> Result<f64, Refusal> {
        analysis.ranges(ranges)?;
        Ok(analysis.error(k))
    };
    let mut parts = vec![Part { ranges: inputs.to_vec(), error: whole, cuts: vec![0; gains.len()] }];
    while parts.len() < boxes && !is_late() {
        // the worst part, cut along the input of the greatest gain; each cut in it halves what is left to gain
        let worst =
            (0..parts.len()).max_by(|a, b| parts[*a].error.total_cmp(&parts[*b].error)).expect("there is a part");
        let gain = |part: &Part, c: usize| gains[c].1 / f64::from(1u32 << part.cuts[c].min(31));
        let part = &parts[worst];
        let Some(c) = (0..gains.len()).max_by(|a, b| gain(part, *a).total_cmp(&gain(part, *b))) else { break };
        let i = gains[c].0;
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
