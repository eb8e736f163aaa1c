//! What the larger examples share beside their robots: charts over time, and the times of sweeps.
#![forbid(unsafe_code)]

use std::fmt::{self, Write};
use std::path::Path;
use std::time::Instant;

/// A polyline \[px\].
pub fn line(path: &[(f64, f64)], colour: &str, width: f64) -> String {
    let points: String = path.iter().map(|(x, y)| format!("{x:.1},{y:.1} ")).collect();
    format!("<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\"/>\n", points.trim_end())
}

/// What the charts of a picture have in common.
pub struct Axis<'a> {
    /// Width of the picture \[px\].
    pub width: f64,
    /// When time ends \[s\].
    pub end: f64,
    /// Colours of lines, by turns.
    pub colours: &'a [&'a str],
    /// From name to name \[px\].
    pub names_apart: f64,
    /// Instants that are marked \[s\].
    pub instants: &'a [f64],
    /// Times that are shaded, from and until \[s\].
    pub shaded: &'a [(f64, f64)],
}

/// A chart over time, of classes `title`, `small`, `end`, `middle`, `grid` and `push`.
pub struct Chart<'a> {
    /// Its title.
    pub title: &'a str,
    /// Names of its lines, and their points: time \[s\] and value.
    pub lines: Vec<(&'a str, Vec<(f64, f64)>)>,
    /// Where its axis begins and ends.
    pub range: (f64, f64),
    /// Where it is marked.
    pub marks: &'a [f64],
}

impl Chart<'_> {
    /// The chart with its upper edge there \[px\].
    pub fn draw(&self, axis: &Axis<'_>, top: f64) -> String {
        let (left, right, height) = (90.0, axis.width - 40.0, 120.0);
        let (low, high) = self.range;
        let (edge, bottom) = (top + 24.0, top + 24.0 + height);
        let x = |t: f64| left + t / axis.end * (right - left);
        let y = |v: f64| edge + height * (1.0 - (v.clamp(low, high) - low) / (high - low));
        let mut out = format!("<text x=\"40\" y=\"{}\" class=\"title\">{}</text>\n", top + 12.0, self.title);
        for (from, until) in axis.shaded {
            let (from, width) = (x(*from), x(*until) - x(*from));
            let _ = writeln!(
                out,
                "<rect x=\"{from:.1}\" y=\"{edge}\" width=\"{width:.1}\" height=\"{height}\" class=\"push\"/>"
            );
        }
        for mark in self.marks {
            let at = y(*mark);
            let _ = writeln!(out, "<path d=\"M{left} {at:.1}H{right}\" class=\"grid\"/>");
            let _ = writeln!(out, "<text x=\"{}\" y=\"{:.1}\" class=\"small end\">{mark}</text>", left - 6.0, at + 4.0);
        }
        for second in 0..=axis.end as u32 {
            let (at, y) = (x(f64::from(second)), bottom + 15.0);
            let _ = writeln!(out, "<text x=\"{at:.1}\" y=\"{y}\" class=\"small middle\">{second} s</text>");
        }
        for instant in axis.instants {
            let _ = writeln!(out, "<path d=\"M{:.1} {edge}v{height}\" class=\"grid\"/>", x(*instant));
        }
        for (k, (name, points)) in self.lines.iter().enumerate() {
            let colour = axis.colours[k % axis.colours.len()];
            let path: Vec<(f64, f64)> = points.iter().map(|(t, v)| (x(*t), y(*v))).collect();
            out += &line(&path, colour, 1.2);
            let (at, y) = (right - axis.names_apart * (self.lines.len() - k) as f64 + 10.0, top + 12.0);
            let _ = writeln!(out, "<text x=\"{at}\" y=\"{y}\" class=\"small\" fill=\"{colour}\">{name}</text>");
        }
        out
    }
}

/// Writes a picture to `target/NAME` of the workspace.
///
/// # Errors
/// Where the file cannot be written.
pub fn write(name: &str, svg: &str) -> std::io::Result<()> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target").join(name);
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    std::fs::write(&path, svg)?;
    println!("\ndrawn: target/{name}");
    Ok(())
}

/// How long sweeps took.
pub struct SweepTimes<const REPEATS: usize>(
    /// \[µs\]
    pub Vec<f64>,
);

impl<const REPEATS: usize> SweepTimes<REPEATS> {
    /// A sweep that changes a solver, timed: it is made so often on copies, and the least time is taken, as what else a machine does is none of it.
    pub fn of<S: Clone, R>(&mut self, solver: &mut S, sweep: impl Fn(&mut S) -> R) -> R {
        let runs = [(); REPEATS].map(|()| {
            let mut copy = solver.clone();
            let began = Instant::now();
            let found = sweep(&mut copy);
            (began.elapsed().as_secs_f64() * 1e6, found, copy)
        });
        self.0.push(runs.iter().map(|run| run.0).fold(f64::INFINITY, f64::min));
        let (_, found, copy) = runs.into_iter().next().expect("a sweep is made once at least");
        *solver = copy;
        found
    }
}

impl<const REPEATS: usize> fmt::Display for SweepTimes<REPEATS> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut sorted = self.0.clone();
        sorted.sort_by(f64::total_cmp);
        // the number that this part of all is not above
        let quantile = |part: f64| sorted[((sorted.len() - 1) as f64 * part).round() as usize];
        write!(
            f,
            "the least of {REPEATS}: median {:.0}, 99 % within {:.0}, longest {:.0}; {:.0} sweeps per second on one core",
            quantile(0.5),
            quantile(0.99),
            quantile(1.0),
            1e6 * sorted.len() as f64 / sorted.iter().sum::<f64>()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_has_its_ends_at_its_edges_and_stays_between_them() {
        let axis = Axis {
            width: 1000.0,
            end: 2.0,
            colours: &["red"],
            names_apart: 100.0,
            instants: &[1.0],
            shaded: &[(0.5, 1.0)],
        };
        let points = vec![(0.0, -1.0), (1.0, 0.5), (2.0, 3.0)];
        let chart = Chart { title: "t", lines: vec![("a", points)], range: (0.0, 1.0), marks: &[0.0, 1.0] };
        let svg = chart.draw(&axis, 0.0);
        assert!(svg.contains("points=\"90.0,144.0 525.0,84.0 960.0,24.0\""), "{svg}");
        assert!(svg.contains("<rect x=\"307.5\" y=\"24\" width=\"217.5\"") && svg.contains("M525.0 24v120"), "{svg}");
    }

    #[test]
    fn a_sweep_changes_the_solver_once_and_its_times_are_counted() {
        let (mut times, mut solver) = (SweepTimes::<3>(Vec::new()), 1);
        let found = times.of(&mut solver, |solver| {
            *solver += 1;
            *solver
        });
        assert_eq!((found, solver, times.0.len()), (2, 2, 1));
        let times = SweepTimes::<5>((1..=100).map(f64::from).collect()).to_string();
        assert_eq!(
            times,
            "the least of 5: median 51, 99 % within 99, longest 100; 19802 sweeps per second on one core"
        );
    }
}
