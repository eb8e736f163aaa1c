//! The picture: the ways of trunk and feet from the side, and what happens over time.

use std::fmt::Write;
use straightline_example_charts::{line, Axis, Chart};
use straightline_trotting_example::closed_loop::{Sample, EXAMPLE};
use straightline_trotting_example::gait::PLACES;
use straightline_trotting_example::quadruped::{feet, FEET, TORQUE};

/// Size of the picture [px].
const SIZE: (f64, f64) = (1000.0, 1320.0);
/// Pixels of a metre in the view from the side.
const SCALE: f64 = 600.0;
/// Where the view has the origin of the world [px].
const ORIGIN: (f64, f64) = (220.0, 215.0);
/// Between pictures of the trunk \[ms\].
const EVERY: usize = 1600;
const COLOURS: [&str; FEET] = ["#1f5fa8", "#d95f02", "#1b8a5a", "#8e44ad"];
const FOOT_NAMES: [&str; FEET] = ["front left", "front right", "hind left", "hind right"];

/// From the side: x right, z up.
fn view(samples: &[Sample]) -> String {
    let at = |p: &[f64]| (ORIGIN.0 + SCALE * p[0], ORIGIN.1 - SCALE * p[2]);
    let mut out = String::from("<text x=\"40\" y=\"28\" class=\"title\">from the side: trunk and feet</text>\n");
    let _ = writeln!(out, "<path d=\"M40 {}H960\" class=\"ground\"/>", ORIGIN.1);
    for sample in samples.iter().step_by(EVERY) {
        let (x, y) = at(&sample.state.q);
        // to first order in the pitch, which is small
        let tilt = (2.0 * sample.state.q[4]).to_degrees();
        let _ = writeln!(
            out,
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"12\" class=\"trunk\" transform=\"rotate({tilt:.2} {x:.1} {y:.1})\"/>",
            x - PLACES[0][0] * SCALE,
            y - 6.0,
            2.0 * PLACES[0][0] * SCALE
        );
    }
    let trunk: Vec<(f64, f64)> = samples.iter().step_by(10).map(|s| at(&s.state.q)).collect();
    out += &line(&trunk, "#222", 1.5);
    for (foot, colour) in COLOURS.iter().enumerate() {
        let path: Vec<(f64, f64)> = samples.iter().step_by(8).map(|s| at(&feet(&s.state.q)[foot])).collect();
        out += &line(&path, colour, 1.2);
    }
    out
}

/// The picture of a run by gains, of the same with springs of the joints, and of the time of sweeps [µs].
pub fn svg(samples: &[Sample], springs: &[Sample], sweeps: &[f64]) -> String {
    let (width, height) = SIZE;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" font-family=\"sans-serif\">\n\
         <style>.title{{font-size:14px;fill:#222}}.small{{font-size:11px}}.end{{text-anchor:end}}.middle{{text-anchor:middle}}\
         .grid{{stroke:#ddd}}.ground{{stroke:#222;stroke-width:1.5}}.trunk{{fill:#222;fill-opacity:0.15;stroke:#222}}\
         .push{{fill:#b82e45;fill-opacity:0.25}}</style>\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    out += &view(samples);
    /// A thousand of these values at most, from the beginning to the end of the scene.
    fn over_time(values: &[f64]) -> Vec<(f64, f64)> {
        let last = values.len().max(2) - 1;
        let at = |(i, v): (usize, &f64)| (i as f64 / last as f64 * EXAMPLE.duration, *v);
        values.iter().enumerate().step_by((values.len() / 1000).max(1)).map(at).collect()
    }
    fn of(samples: &[Sample], value: impl Fn(&Sample) -> f64) -> Vec<(f64, f64)> {
        over_time(&samples.iter().map(value).collect::<Vec<f64>>())
    }
    let off = |i: usize| move |s: &Sample| 1e3 * (s.state.q[i] - s.wanted[i]);
    let part = |s: &Sample| s.torques.iter().fold(0.0f64, |most, tau| most.max(tau.abs())) / TORQUE;
    let charts = [
        Chart {
            title: "trunk off its way [mm], by gains; shaded: pushes to the left, 8 N and 10 N",
            lines: vec![
                ("ahead", of(samples, off(0))),
                ("to the left", of(samples, off(1))),
                ("up", of(samples, off(2))),
            ],
            range: (-60.0, 60.0),
            marks: &[-60.0, -30.0, 0.0, 30.0, 60.0],
        },
        Chart {
            title: "the same by springs of the joints, 6 N·m/rad, about the same motion [mm]",
            lines: vec![
                ("ahead", of(springs, off(0))),
                ("to the left", of(springs, off(1))),
                ("up", of(springs, off(2))),
            ],
            range: (-60.0, 60.0),
            marks: &[-60.0, -30.0, 0.0, 30.0, 60.0],
        },
        Chart {
            title: "lean of the trunk [mrad]",
            lines: vec![("by gains", of(samples, |s| 1e3 * s.lean)), ("by springs", of(springs, |s| 1e3 * s.lean))],
            range: (0.0, 120.0),
            marks: &[0.0, 40.0, 80.0, 120.0],
        },
        Chart {
            title: "forces of the ground, upwards [N]",
            lines: (0..FEET).map(|foot| (FOOT_NAMES[foot], of(samples, |s| s.forces[foot][2]))).collect(),
            range: (0.0, 30.0),
            marks: &[0.0, 10.0, 20.0, 30.0],
        },
        Chart {
            title: "greatest torque, as a part of its limit",
            lines: vec![("torque", of(samples, part))],
            range: (0.0, 1.0),
            marks: &[0.0, 0.5, 1.0],
        },
        Chart {
            title: "time per sweep [ms]: one every 10 ms",
            lines: vec![("time", over_time(&sweeps.iter().map(|t| 1e-3 * t).collect::<Vec<f64>>()))],
            range: (0.0, 10.0),
            marks: &[0.0, 5.0, 10.0],
        },
    ];
    let axis = Axis {
        width,
        end: EXAMPLE.duration,
        colours: &COLOURS,
        names_apart: 130.0,
        instants: &[],
        shaded: &EXAMPLE.pushes.iter().map(|push| (push.from, push.until)).collect::<Vec<_>>(),
    };
    for (k, chart) in charts.iter().enumerate() {
        out += &chart.draw(&axis, 245.0 + 178.0 * k as f64);
    }
    out + "</svg>\n"
}
