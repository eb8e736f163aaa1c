//! A small plot as SVG that takes its colours from the page around it, light or dark.

use crate::html::{escape, four_digits};
use std::fmt::Write;

/// A plot of one quantity. Its axis ends where the lines end.
pub struct Panel<'a> {
    /// Above it.
    pub title: &'a str,
    /// Units along the axes.
    pub units: (&'a str, &'a str),
    /// Its lines: x and y.
    pub lines: Vec<Vec<(f64, f64)>>,
    /// Levels that are limits; those far beyond the lines are left out.
    pub levels: Vec<f64>,
}

/// Size of a panel [px], and its margins: left, right, above, below.
const SIZE: (f64, f64) = (264.0, 164.0);
const MARGINS: [f64; 4] = [46.0, 6.0, 26.0, 24.0];
/// Pieces of the axis of which a line shows the least and the greatest value: no panel has more pixels.
const PIECES: usize = 240;

impl Panel<'_> {
    /// The panel, of a size that the page can change.
    pub fn svg(&self) -> String {
        let (width, height) = SIZE;
        let [left, right, above, below] = MARGINS;
        let finite: Vec<Vec<(f64, f64)>> = self
            .lines
            .iter()
            .map(|line| line.iter().copied().filter(|(x, y)| x.is_finite() && y.is_finite()).collect())
            .collect();
        let (x0, x1) = range(finite.iter().flatten().map(|p| p.0));
        let (y0, y1) = range(finite.iter().flatten().map(|p| p.1));
        let reach = (y1 - y0).max(1e-12);
        let levels: Vec<f64> = self.levels.iter().copied().filter(|y| *y > y0 - reach && *y < y1 + reach).collect();
        let (y0, y1) = range([y0, y1].into_iter().chain(levels.iter().copied()));
        let margin = if y1 > y0 { 0.06 * (y1 - y0) } else { 0.06 * y0.abs().max(1.0) };
        let (y0, y1) = (y0 - margin, y1 + margin);
        let x1 = if x1 > x0 { x1 } else { x0 + 1.0 };
        let at_x = |x: f64| left + (x - x0) / (x1 - x0) * (width - left - right);
        let at_y = |y: f64| height - below - (y - y0) / (y1 - y0) * (height - above - below);
        let mut out = format!(
            "<svg class=\"panel\" viewBox=\"0 0 {width} {height}\" role=\"img\">\n\
             <text class=\"name\" x=\"{left}\" y=\"15\">{}</text>\n",
            escape(self.title)
        );
        let (bottom, end) = (height - below, width - right);
        let (step, marks) = ticks(y0, y1, 4);
        for y in marks {
            let (at, label) = (at_y(y), tick(y, step));
            let _ = writeln!(out, "<path class=\"grid\" d=\"M{left} {at:.1}H{end}\"/>");
            let _ =
                writeln!(out, "<text class=\"small end\" x=\"{}\" y=\"{:.1}\">{label}</text>", left - 6.0, at + 4.0);
        }
        let _ = writeln!(out, "<path class=\"axis\" d=\"M{left} {above}V{bottom}H{end}\"/>");
        // the end of the run has its number, whatever is round
        let last = format!("{} {}", without_zeros(four_digits(x1)), escape(self.units.0));
        let taken = 7.0 * last.chars().count() as f64 + 12.0;
        let (step, marks) = ticks(x0, x1, 4);
        for x in marks.into_iter().filter(|x| at_x(x1) - at_x(*x) > taken) {
            let at = at_x(x);
            let _ = writeln!(out, "<path class=\"axis\" d=\"M{at:.1} {bottom}v4\"/>");
            let _ = writeln!(
                out,
                "<text class=\"small middle\" x=\"{at:.1}\" y=\"{:.1}\">{}</text>",
                bottom + 16.0,
                tick(x, step)
            );
        }
        let _ = writeln!(out, "<path class=\"axis\" d=\"M{end} {bottom}v4\"/>");
        let _ = writeln!(out, "<text class=\"small end\" x=\"{end}\" y=\"{:.1}\">{last}</text>", bottom + 16.0);
        let _ = writeln!(out, "<text class=\"small end\" x=\"{end}\" y=\"15\">{}</text>", escape(self.units.1));
        for level in levels {
            let _ = writeln!(out, "<path class=\"limit\" d=\"M{left} {:.1}H{end}\"/>", at_y(level));
        }
        for (k, line) in finite.iter().enumerate().filter(|(_, line)| !line.is_empty()) {
            let mut path = String::new();
            for (i, (x, y)) in thinned(line, x0, x1).into_iter().enumerate() {
                let _ = write!(path, "{}{:.1} {:.1}", if i == 0 { "M" } else { "L" }, at_x(x), at_y(y));
            }
            let _ = writeln!(out, "<path class=\"line s{}\" d=\"{path}\"/>", k % 3);
        }
        out + "</svg>\n"
    }
}

/// The least and the greatest; (0, 1) of nothing.
fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    if low <= high {
        (low, high)
    } else {
        (0.0, 1.0)
    }
}

/// Round numbers between two others, about so many, and the step between them.
fn ticks(low: f64, high: f64, about: usize) -> (f64, Vec<f64>) {
    let raw = (high - low) / about as f64;
    let power = 10f64.powf(raw.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|step| *step >= raw).unwrap_or(raw);
    if !(step.is_finite() && step > 0.0) {
        return (1.0, Vec::new());
    }
    let first = (low / step).ceil();
    (step, (0..=2 * about).map(|k| (first + k as f64) * step).take_while(|x| *x <= high).collect())
}

/// A multiple of a step, with the decimals that tell it from the next one.
fn tick(x: f64, step: f64) -> String {
    match (1e-6..1e6).contains(&step) && x.abs() < 1e6 {
        true => without_zeros(format!("{:.*}", (-step.log10().floor()).max(0.0) as usize, x)),
        false => four_digits(x),
    }
}

/// Without zeros behind the point, and without the sign of zero.
fn without_zeros(text: String) -> String {
    if !text.contains('.') || text.contains('e') {
        return text;
    }
    match text.trim_end_matches('0').trim_end_matches('.') {
        "-0" => "0".to_string(),
        rest => rest.to_string(),
    }
}

/// The points of a line; of a long one over time the first, least, greatest and last of every piece of the axis.
fn thinned(line: &[(f64, f64)], x0: f64, x1: f64) -> Vec<(f64, f64)> {
    let goes_on = line.windows(2).all(|pair| pair[0].0 <= pair[1].0);
    if line.len() <= 2 * PIECES {
        return line.to_vec();
    }
    if !goes_on {
        let step = line.len().div_ceil(4 * PIECES);
        return line.iter().copied().step_by(step).chain(line.last().copied()).collect();
    }
    let piece = |x: f64| (((x - x0) / (x1 - x0) * PIECES as f64) as usize).min(PIECES - 1);
    let mut kept = Vec::new();
    for points in line.chunk_by(|a, b| piece(a.0) == piece(b.0)) {
        let by_height = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let (low, high) = (points.iter().min_by(by_height), points.iter().max_by(by_height));
        let mut shown: Vec<(f64, f64)> =
            [points.first(), low, high, points.last()].into_iter().flatten().copied().collect();
        shown.sort_by(|a, b| a.0.total_cmp(&b.0));
        shown.dedup();
        kept.extend(shown);
    }
    kept
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    fn panel(points: Vec<(f64, f64)>, levels: Vec<f64>) -> String {
        Panel { title: "torque <1>", units: ("s", "N·m"), lines: vec![points], levels }.svg()
    }

    pub fn the_axis_ends_where_the_run_ends_and_says_where() {
        let svg = panel((0..=137).map(|k| (f64::from(k) / 100.0, f64::from(k).sin())).collect(), Vec::new());
        let end = SIZE.0 - MARGINS[1];
        let line = svg.lines().find(|l| l.contains("class=\"line")).unwrap();
        let last: f64 = line.rsplit('L').next().unwrap().split(' ').next().unwrap().parse().unwrap();
        assert_eq!(last, end);
        assert!(svg.contains(&format!("H{end}")) && svg.contains(">1.37 s</text>"), "{svg}");
        assert!(svg.contains("torque &lt;1&gt;") && svg.contains(">N·m</text>"), "{svg}");
    }

    pub fn marks_next_to_each_other_have_different_numbers() {
        for (low, high) in [(25.0, 25.012), (-0.3, 0.3), (0.0, 1.0), (1e-9, 4e-9), (-2e7, 5e7), (1999.0, 2001.0)] {
            let (step, marks) = ticks(low, high, 4);
            let labels: Vec<String> = marks.iter().map(|x| tick(*x, step)).collect();
            assert!(labels.len() >= 2 && labels.windows(2).all(|pair| pair[0] != pair[1]), "{labels:?}");
        }
    }

    pub fn a_peak_of_one_sample_among_many_is_seen() {
        let mut points: Vec<(f64, f64)> = (0..100_000).map(|k| (f64::from(k), 0.0)).collect();
        points[54_321].1 = 7.0;
        let kept = thinned(&points, 0.0, 99_999.0);
        assert!(kept.len() <= 4 * PIECES && kept.contains(&(54_321.0, 7.0)));
    }

    pub fn limits_far_beyond_the_lines_do_not_flatten_them() {
        let points = vec![(0.0, 0.0), (1.0, 1.0)];
        assert_eq!(panel(points.clone(), vec![-1e3, 1e3]).matches("class=\"limit\"").count(), 0);
        assert_eq!(panel(points, vec![1.5]).matches("class=\"limit\"").count(), 1);
    }

    pub fn nothing_and_constants_can_be_drawn() {
        for points in [Vec::new(), vec![(0.0, f64::NAN)], vec![(1.0, 2.0)], vec![(0.0, 5.0), (1.0, 5.0)]] {
            let svg = panel(points, Vec::new());
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }
}
