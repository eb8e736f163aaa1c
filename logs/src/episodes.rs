//! Intervals in which residuals are far from what noise makes of them: contact, collisions, somebody's hand.

/// An interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Episode {
    /// When it begins \[s\].
    pub from: f64,
    /// When it ends \[s\].
    pub to: f64,
    /// The residual furthest from the median in it \[N·m or N\].
    pub peak: f64,
    /// Its distance from the median in robust standard deviations.
    pub sigmas: f64,
}

/// What counts as an episode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EpisodeDemand {
    /// Distance from the median, in robust standard deviations.
    pub sigmas: f64,
    /// For how long \[s\], at least.
    pub duration: f64,
    /// What separates episodes \[s\], at least.
    pub apart: f64,
}

impl Default for EpisodeDemand {
    fn default() -> Self {
        EpisodeDemand { sigmas: 6.0, duration: 0.02, apart: 0.1 }
    }
}

/// Numbers that the median is taken of, at most.
const MOST_NUMBERS: usize = 200_000;

/// Median and robust standard deviation, 1.4826 times the median distance from the median: what a tenth of the samples does, it does not see.
pub fn robust_spread(values: &[f64]) -> (f64, f64) {
    let step = values.len().div_ceil(MOST_NUMBERS).max(1);
    let mut some: Vec<f64> = values.iter().copied().step_by(step).filter(|x| x.is_finite()).collect();
    let median = |some: &mut [f64]| match some.len() {
        0 => 0.0,
        n => *some.select_nth_unstable_by(n / 2, f64::total_cmp).1,
    };
    let middle = median(&mut some);
    some.iter_mut().for_each(|x| *x = (*x - middle).abs());
    (middle, 1.4826 * median(&mut some))
}

/// The episodes of a residual over stamps, within one segment. `spread` is its median and robust standard deviation, `least` the least distance that
/// counts \[N·m or N\], so that rounding is no contact.
pub fn episodes(
    times: &[f64],
    residual: &[f64],
    spread: (f64, f64),
    least: f64,
    demand: EpisodeDemand,
) -> Vec<Episode> {
    let (middle, sigma) = spread;
    let threshold = (demand.sigmas * sigma).max(least);
    let mut found: Vec<Episode> = Vec::new();
    for (t, r) in times.iter().zip(residual) {
        let distance = (r - middle).abs();
        if !distance.is_finite() || distance <= threshold {
            continue;
        }
        let sigmas = distance / sigma.max(f64::MIN_POSITIVE);
        match found.last_mut() {
            Some(last) if t - last.to <= demand.apart => {
                last.to = *t;
                if sigmas > last.sigmas {
                    (last.peak, last.sigmas) = (*r, sigmas);
                }
            }
            _ => found.push(Episode { from: *t, to: *t, peak: *r, sigmas }),
        }
    }
    found.retain(|episode| episode.to - episode.from >= demand.duration);
    found
}
