//! From a URDF to a proven torque: the Panda's inverse dynamics, generated from `descriptions/panda.urdf` and compiled with
//! this crate, along a trajectory; every torque against the handbook chapter's formulation in double-double, which reads
//! the same file by another route. Prints a table and draws `target/panda_trajectory.svg`.
//!
//! ```text
//! cargo run --release -p straightline-robots --example panda_trajectory
//! ```

use plotters::prelude::*;
use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;
use straightline_codegen::description;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::model::ModelOptions;
use straightline_codegen::verify::reference_input::centre_of_mass_tree;
use straightline_core::reference::{inverse_dynamics, natural_scale, CentreOfMassTree};
use straightline_core::Dd;
use straightline_robots::panda;

const N: usize = panda::NV;
const FROM: [f64; N] = [-1.2, -0.9, 0.6, -2.6, -0.7, 1.1, 0.3];
const TO: [f64; N] = [1.1, 0.8, -0.5, -1.1, 0.9, 2.9, -1.6];
/// Seconds.
const DURATION: f64 = 1.6;
const SAMPLES: usize = 400;

/// What was computed at one time.
struct TrajectorySample {
    time: f64,
    /// Joint torques by generated code \[N·m\].
    tau: [f64; N],
    /// Errors of f64 and f32 against the reference \[N·m\], each at the inputs as it holds them.
    error: [[f64; N]; 2],
    /// The sum of the moduli of the terms of each torque \[N·m\]: against this a rounding error is judged.
    scale: [f64; N],
}

/// q, q̇, q̈ of a quintic from rest to rest: q = FROM + (TO − FROM) (10 x³ − 15 x⁴ + 6 x⁵), x = t / DURATION.
fn motion(t: f64) -> [[f64; N]; 3] {
    let x = t / DURATION;
    let s = x * x * x * (10.0 + x * (-15.0 + x * 6.0));
    let sd = x * x * (30.0 + x * (-60.0 + x * 30.0)) / DURATION;
    let sdd = x * (60.0 + x * (-180.0 + x * 120.0)) / (DURATION * DURATION);
    let way = |i: usize| TO[i] - FROM[i];
    [
        std::array::from_fn(|i| FROM[i] + way(i) * s),
        std::array::from_fn(|i| way(i) * sd),
        std::array::from_fn(|i| way(i) * sdd),
    ]
}

fn sample(reference: &CentreOfMassTree<Dd>, time: f64) -> TrajectorySample {
    let [q, qd, qdd] = motion(time);
    let mut tau = [0.0; N];
    panda::inverse_dynamics(&q, &qd, &qdd, &mut tau);
    let single = [q, qd, qdd].map(|v| v.map(|x| x as f32));
    let mut tau_single = [0.0; N];
    panda::single::inverse_dynamics(&single[0], &single[1], &single[2], &mut tau_single);

    let wide = |v: &[f64; N]| v.map(Dd::from);
    let error = |q: &[f64; N], qd: &[f64; N], qdd: &[f64; N], tau: &[f64; N]| {
        let truth = inverse_dynamics(reference, &wide(q), &wide(qd), &wide(qdd));
        std::array::from_fn(|i| (Dd::from(tau[i]) - truth[i]).abs().to_f64())
    };
    let [q1, qd1, qdd1] = single.map(|v| v.map(f64::from));
    let scale = natural_scale(reference, &wide(&q), &wide(&qd), &wide(&qdd));
    TrajectorySample {
        time,
        tau,
        error: [error(&q, &qd, &qdd, &tau), error(&q1, &qd1, &qdd1, &tau_single.map(f64::from))],
        scale: std::array::from_fn(|i| scale[i].to_f64()),
    }
}

/// The reference's reading of the URDF.
fn reference() -> Result<CentreOfMassTree<Dd>, Box<dyn Error>> {
    let source = Source::new("descriptions/panda.urdf", include_str!("../descriptions/panda.urdf"));
    let mut diagnostics = Diagnostics::new();
    let description = description::read(&source, &mut diagnostics).ok_or_else(|| diagnostics.to_string())?;
    Ok(centre_of_mass_tree(&description, &ModelOptions::default())?)
}

fn worst(samples: &[TrajectorySample], value: impl Fn(&TrajectorySample) -> f64) -> f64 {
    samples.iter().map(value).fold(0.0, f64::max)
}

fn print_table(samples: &[TrajectorySample]) {
    println!("{:<15} {:>12}   {:>21}   {:>21}", "", "", "f64", "f32");
    println!(
        "{:<15} {:>12}   {:>11} {:>9}   {:>11} {:>9}",
        "joint", "max |τ| N·m", "error N·m", "scaled", "error N·m", "scaled"
    );
    for (i, joint) in panda::JOINT_NAMES.iter().enumerate() {
        let error = |k: usize| worst(samples, |s| s.error[k][i]);
        let scaled = |k: usize| worst(samples, |s| s.error[k][i] / s.scale[i]);
        println!(
            "{joint:<15} {:12.3}   {:11.1e} {:9.1e}   {:11.1e} {:9.1e}",
            worst(samples, |s| s.tau[i].abs()),
            error(0),
            scaled(0),
            error(1),
            scaled(1),
        );
    }
    println!("error: against the reference; scaled: divided by the sum of the moduli of the terms of the torque");
}

/// The best of some runs over the trajectory \[ns per call\].
fn nanoseconds() -> f64 {
    let motions: Vec<_> = (0..SAMPLES).map(|k| motion(k as f64 * DURATION / SAMPLES as f64)).collect();
    let run = |_| {
        let mut tau = [0.0; N];
        let start = Instant::now();
        for [q, qd, qdd] in &motions {
            panda::inverse_dynamics(black_box(q), qd, qdd, &mut tau);
            black_box(&tau);
        }
        start.elapsed().as_nanos() as f64 / motions.len() as f64
    };
    (0..200).map(run).fold(f64::INFINITY, f64::min)
}

const COLOURS: [RGBColor; N] = [
    RGBColor(0x1f, 0x5f, 0xa8),
    RGBColor(0xd9, 0x5f, 0x02),
    RGBColor(0x1b, 0x8a, 0x5a),
    RGBColor(0xb8, 0x2e, 0x45),
    RGBColor(0x6f, 0x4c, 0x9b),
    RGBColor(0x8a, 0x6d, 0x1f),
    RGBColor(0x3d, 0x9c, 0xb5),
];
const INK: RGBColor = RGBColor(0x22, 0x22, 0x22);
const GRID: RGBColor = RGBColor(0xe6, 0xe6, 0xe6);

fn draw(samples: &[TrajectorySample], path: &Path) -> Result<(), Box<dyn Error>> {
    let root = SVGBackend::new(path, (960, 760)).into_drawing_area();
    root.fill(&WHITE)?;
    let (torques, errors) = root.split_vertically(450);
    let label = ("sans-serif", 15).into_font().color(&INK);
    let title = ("sans-serif", 20).into_font().color(&INK);

    let top = 1.08 * worst(samples, |s| s.tau.iter().copied().fold(0.0, f64::max));
    let bottom = -1.08 * worst(samples, |s| s.tau.iter().map(|t| -t).fold(0.0, f64::max));
    let mut chart = ChartBuilder::on(&torques)
        .caption("Panda: joint torques along a trajectory, by generated code", title.clone())
        .margin(12)
        .margin_right(130)
        .x_label_area_size(42)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..DURATION, bottom..top)?;
    chart
        .configure_mesh()
        .x_desc("time [s]")
        .y_desc("torque [N·m]")
        .x_labels(9)
        .x_label_formatter(&|t| format!("{t:.1}"))
        .y_label_formatter(&|t| format!("{t:.0}"))
        .label_style(label.clone())
        .axis_desc_style(label.clone())
        .light_line_style(WHITE)
        .bold_line_style(GRID)
        .draw()?;
    for (i, colour) in COLOURS.iter().enumerate() {
        let line = samples.iter().map(|s| (s.time, s.tau[i]));
        chart.draw_series(LineSeries::new(line, colour.stroke_width(2)))?;
    }
    legend(
        &torques,
        &COLOURS.map(|c| c.to_rgba()),
        &panda::JOINT_NAMES.map(|n| n.trim_start_matches("panda_").into()),
    )?;

    // judged joint by joint against the scale of the torque; the worst joint is drawn
    let scaled = |s: &TrajectorySample, k: usize| (0..N).map(|i| s.error[k][i] / s.scale[i]).fold(0.0, f64::max);
    let mut chart = ChartBuilder::on(&errors)
        .caption("Worst joint's error against the reference, scaled by the moduli of the torque's terms", title)
        .margin(12)
        .margin_right(130)
        .x_label_area_size(42)
        .y_label_area_size(64)
        .build_cartesian_2d(0.0..DURATION, (1e-18..1e-5).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("time [s]")
        .y_desc("scaled error")
        .x_labels(9)
        .y_labels(7)
        .x_label_formatter(&|t| format!("{t:.1}"))
        .y_label_formatter(&|e| format!("{e:.0e}"))
        .label_style(label.clone())
        .axis_desc_style(label)
        .light_line_style(WHITE)
        .bold_line_style(GRID)
        .draw()?;
    for (k, unit) in [f64::EPSILON / 2.0, f64::from(f32::EPSILON) / 2.0].into_iter().enumerate() {
        let colour = COLOURS[k];
        let line = samples.iter().map(|s| (s.time, scaled(s, k).max(1e-18)));
        chart.draw_series(LineSeries::new(line, colour.stroke_width(1)))?;
        chart.draw_series(DashedLineSeries::new([(0.0, unit), (DURATION, unit)], 6, 4, INK.stroke_width(1)))?;
    }
    let names = ["f32", "f64", "half an ulp"].map(String::from);
    legend(&errors, &[COLOURS[1], COLOURS[0], INK].map(|c| c.to_rgba()), &names)?;
    root.present()?;
    Ok(())
}

/// Lines and names in the right margin.
fn legend<B: DrawingBackend>(
    area: &DrawingArea<B, plotters::coord::Shift>,
    colours: &[RGBAColor],
    names: &[String],
) -> Result<(), Box<dyn Error>>
where
    B::ErrorType: 'static,
{
    let x = area.dim_in_pixel().0 as i32 - 118;
    for (i, (colour, name)) in colours.iter().zip(names).enumerate() {
        let y = 60 + 24 * i as i32;
        area.draw(&PathElement::new([(x, y), (x + 22, y)], colour.stroke_width(3)))?;
        area.draw(&Text::new(name.clone(), (x + 29, y - 8), ("sans-serif", 15).into_font().color(&INK)))?;
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let reference = reference()?;
    let samples: Vec<TrajectorySample> =
        (0..=SAMPLES).map(|k| sample(&reference, k as f64 * DURATION / SAMPLES as f64)).collect();
    println!(
        "Panda, quintic of {DURATION} s from rest to rest, {} samples: generated code against the reference\n",
        samples.len()
    );
    print_table(&samples);
    let cost = panda::INVERSE_DYNAMICS_COST;
    println!(
        "\ninverse dynamics takes {} multiplications, {} additions ({} instructions with fma), {} pairs of sine and cosine;\n\
         {:.0} ns per call here, scaled error at most {:.1e}",
        cost.mul,
        cost.add,
        cost.fma,
        cost.sin_cos,
        nanoseconds(),
        worst(&samples, |s| (0..N).map(|i| s.error[0][i] / s.scale[i]).fold(0.0, f64::max)),
    );
    let target = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target");
    std::fs::create_dir_all(&target)?;
    draw(&samples, &target.join("panda_trajectory.svg"))?;
    println!("drawn: target/panda_trajectory.svg");

    let bound = 1e-14;
    if worst(&samples, |s| (0..N).map(|i| s.error[0][i] / s.scale[i]).fold(0.0, f64::max)) > bound {
        return Err(format!("a torque is off by more than {bound:e} of its scale").into());
    }
    Ok(())
}
