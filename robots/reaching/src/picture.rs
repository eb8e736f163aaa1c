//! The picture: the arm from above and from the side, and what happens over time.

use std::fmt::Write;
use straightline_example_charts::{line, Axis, Chart};
use straightline_reaching_example::arm::{Points, HAND, RADII, TORQUE};
use straightline_reaching_example::closed_loop::{Sample, EXAMPLE};

/// Size of the picture [px].
const SIZE: (f64, f64) = (1000.0, 1130.0);
/// Pixels of a metre in the views.
const SCALE: f64 = 430.0;
/// The arm is drawn so often [s].
const EVERY: f64 = 0.2;
const COLOURS: [&str; 3] = ["#1f5fa8", "#d95f02", "#1b8a5a"];

/// What a view shows: which coordinates go right and up, and where the origin of the world is [px].
struct View {
    title: &'static str,
    right: usize,
    up: usize,
    origin: (f64, f64),
}

const VIEWS: [View; 2] = [
    View { title: "from above: x right, y up", right: 0, up: 1, origin: (90.0, 330.0) },
    View { title: "from the side: x right, z up", right: 0, up: 2, origin: (590.0, 520.0) },
];

impl View {
    fn at(&self, point: &[f64; 3]) -> (f64, f64) {
        (self.origin.0 + SCALE * point[self.right], self.origin.1 - SCALE * point[self.up])
    }

    fn arm(&self, points: &Points, colour: &str, opacity: f64) -> String {
        let mut out = String::new();
        for (k, radius) in RADII.iter().enumerate() {
            let ((x1, y1), (x2, y2)) = (self.at(&points[k]), self.at(&points[k + 1]));
            let width = 2.0 * SCALE * radius;
            let _ = writeln!(
                out,
                "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{colour}\" stroke-opacity=\"{opacity}\" \
                 stroke-width=\"{width:.1}\" stroke-linecap=\"round\"/>"
            );
        }
        out
    }

    fn draw(&self, samples: &[Sample]) -> String {
        let mut out = format!("<text x=\"{}\" y=\"28\" class=\"title\">{}</text>\n", self.origin.0 - 50.0, self.title);
        let every = (EVERY / (samples[1].time - samples[0].time)).round() as usize;
        for sample in samples.iter().step_by(every) {
            out += &self.arm(&sample.points, colour(sample.time), 0.05);
        }
        for sample in samples.iter().step_by(every) {
            let path: Vec<(f64, f64)> = sample.points.iter().map(|p| self.at(p)).collect();
            out += &line(&path, colour(sample.time), 0.7);
        }
        for sphere in EXAMPLE.spheres {
            let (x, y) = self.at(&sphere.centre);
            let _ = writeln!(
                out,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{:.1}\" class=\"sphere\"/>",
                SCALE * sphere.radius
            );
        }
        for (k, goal) in EXAMPLE.goals.iter().enumerate() {
            let until = EXAMPLE.goals.get(k + 1).map_or(f64::INFINITY, |next| next.from);
            let mine = samples.iter().filter(|s| (goal.from..until).contains(&s.time)).step_by(5);
            let path: Vec<(f64, f64)> = mine.map(|s| self.at(&s.points[HAND])).collect();
            out += &line(&path, COLOURS[k % 3], 2.5);
            let (x, y) = self.at(&goal.hand);
            let _ = writeln!(out, "<path d=\"M{:.1} {y:.1}h14M{x:.1} {:.1}v14\" class=\"goal\"/>", x - 7.0, y - 7.0);
            let _ = writeln!(out, "<text x=\"{:.1}\" y=\"{:.1}\" class=\"small\">{}</text>", x + 8.0, y - 6.0, k + 1);
        }
        out
    }
}

/// Of the goal at a time.
fn colour(time: f64) -> &'static str {
    let k = EXAMPLE.goals.iter().filter(|goal| goal.from <= time).count().saturating_sub(1);
    COLOURS[k % 3]
}

/// The picture of a run, and of the time of its sweeps [µs].
pub fn svg(samples: &[Sample], sweeps: &[f64]) -> String {
    let (width, height) = SIZE;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" font-family=\"sans-serif\">\n\
         <style>.title{{font-size:14px;fill:#222}}.small{{font-size:11px}}.end{{text-anchor:end}}.middle{{text-anchor:middle}}\
         .grid{{stroke:#ddd}}.sphere{{fill:#b82e45;fill-opacity:0.45;stroke:#b82e45}}.goal{{stroke:#222;stroke-width:2}}\
         .push{{fill:#b82e45;fill-opacity:0.3}}</style>\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    for view in &VIEWS {
        out += &view.draw(samples);
    }
    let times: Vec<f64> = samples.iter().map(|s| s.time).collect();
    let away = |s: &Sample| (0..3).map(|i| (s.points[HAND][i] - s.goal[i]).powi(2)).sum::<f64>().sqrt();
    let part = |s: &Sample| s.tau.iter().zip(TORQUE).map(|(tau, most)| tau.abs() / most).fold(0.0, f64::max);
    // the greatest of each piece, so that no peak is left out
    let peaks = |values: &[f64]| -> Vec<(f64, f64)> {
        let step = values.len().div_ceil(1500);
        let greatest = |v: &[f64]| v.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        times.chunks(step).zip(values.chunks(step)).map(|(t, v)| (t[0], greatest(v))).collect()
    };
    let of = |value: &dyn Fn(&Sample) -> f64| peaks(&samples.iter().map(value).collect::<Vec<f64>>());
    let charts = [
        Chart {
            title: "hand to goal, arm to the nearest sphere [m]",
            lines: vec![("hand to goal", of(&away)), ("clearance", of(&|s| s.clearance))],
            range: (0.0, 0.6),
            marks: &[0.0, 0.2, 0.4, 0.6],
        },
        Chart {
            title: "greatest torque, as a part of its limit; shaded: the push",
            lines: vec![("torque", of(&part))],
            range: (0.0, 1.0),
            marks: &[0.0, 0.5, 1.0],
        },
        Chart {
            title: "time per sweep [µs], the greatest of each 4 ms: the period is 1000",
            lines: vec![("time", peaks(sweeps))],
            range: (0.0, 1000.0),
            marks: &[0.0, 250.0, 500.0, 750.0, 1000.0],
        },
    ];
    let axis = Axis {
        width,
        end: EXAMPLE.duration,
        colours: &COLOURS,
        names_apart: 160.0,
        instants: &EXAMPLE.goals.iter().map(|goal| goal.from).collect::<Vec<_>>(),
        shaded: &EXAMPLE.pushes.iter().map(|push| (push.from, push.until)).collect::<Vec<_>>(),
    };
    for (k, chart) in charts.iter().enumerate() {
        out += &chart.draw(&axis, 590.0 + 180.0 * k as f64);
    }
    out + "</svg>\n"
}
