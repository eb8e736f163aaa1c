//! Runs the scene of [`closed_loop::EXAMPLE`], prints what it took and what becomes of it by other means, and draws
//! `target/solo12_trotting.svg`.
//!
//! ```text
//! cargo run --release -p straightline-trotting-example
//! ```

mod picture;

use std::error::Error;
use std::hint::black_box;
use std::time::Instant;
use straightline_example_charts::{write, SweepTimes};
use straightline_trotting_example::closed_loop::{run, summary, Feedback, Push, Scenario, Summary, EXAMPLE};
use straightline_trotting_example::controller::Controller;
use straightline_trotting_example::gait::{Gait, STEP};
use straightline_trotting_example::quadruped::{
    generalized_forces, holding, Mode, Slopes, State, NV, STANDING, TORQUE,
};
use straightline_trotting_example::sweep::NODES;
use straightline_trotting_example::task::{Weights, FRICTION};

/// The least time of a call \[µs\].
fn time_of(mode: Mode) -> f64 {
    let tau = generalized_forces(&[0.0; 6], &holding(mode, &STANDING));
    let state = State { q: STANDING, qd: [0.0; NV] };
    let once = |_| {
        let began = Instant::now();
        black_box(Slopes::of(black_box(mode), black_box(&state), black_box(&tau)));
        began.elapsed().as_secs_f64() * 1e6
    };
    (0..2000).map(once).fold(f64::INFINITY, f64::min)
}

/// A row of a table.
fn print(name: &str, scenario: &Scenario, of: &Summary) {
    let millimetres = |x: [f64; 3]| x.map(|x| format!("{:5.1}", 1e3 * x)).join(" ");
    let end = if of.fell(scenario.duration) { format!("fell after {:.2} s", of.end) } else { millimetres(of.last) };
    println!(
        "{name:<34} {}   {}   {:4.0}   {:.2}   {:4.1} %  {:4.1} %  {:5.1}   {end}",
        millimetres(of.off()),
        millimetres(of.most),
        1e3 * of.lean,
        of.torque,
        100.0 * f64::from(of.outside) / f64::from(of.standing),
        100.0 * f64::from(of.slipping) / f64::from(of.standing),
        1e3 * of.slip,
    );
}

/// The same scene by other means, and other scenes.
fn compare() -> Result<(), Box<dyn Error>> {
    println!(
        "\n{:<34} {:<17}   {:<17}   lean   most   outside slipping  slip    in the end [mm]",
        "", "off [mm]: rms", "most"
    );
    let by = |feedback: Feedback| Scenario { feedback, ..EXAMPLE };
    let pushes = |newtons: f64| EXAMPLE.pushes.iter().map(|p| Push { force: [0.0, newtons, 0.0], ..*p }).collect();
    let (firm, hard, harder): (Vec<Push>, Vec<Push>, Vec<Push>) = (pushes(15.0), pushes(20.0), pushes(30.0));
    let no_cones = Weights { cone: 0.0, ..Weights::DEFAULT };
    let rows = [
        ("gains", EXAMPLE),
        ("torques alone between nodes", by(Feedback::Torques)),
        ("springs of joints, 3 N·m/rad", by(Feedback::Joints(3.0, 0.1))),
        ("springs of joints, 6 N·m/rad", by(Feedback::Joints(6.0, 0.2))),
        ("springs of joints, 12 N·m/rad", by(Feedback::Joints(12.0, 0.3))),
        ("gains, without costs of cones", Scenario { weights: no_cones, ..EXAMPLE }),
        ("gains, no load, no push", Scenario { load: 0.0, pushes: &[], ..EXAMPLE }),
        ("gains, pushed with 15 N", Scenario { pushes: &firm, ..EXAMPLE }),
        ("the same without costs of cones", Scenario { pushes: &firm, weights: no_cones, ..EXAMPLE }),
        ("gains, pushed with 20 N", Scenario { pushes: &hard, ..EXAMPLE }),
        ("gains, pushed with 30 N", Scenario { pushes: &harder, ..EXAMPLE }),
        ("gains, at 0.5 m/s", Scenario { gait: Gait { speed: [0.5, 0.0], ..EXAMPLE.gait }, ..EXAMPLE }),
        ("springs, 6 N·m/rad, with 30 N", Scenario { pushes: &harder, ..by(Feedback::Joints(6.0, 0.2)) }),
    ];
    for (name, scenario) in &rows {
        print(name, scenario, &summary(scenario).map_err(|why| why.to_string())?);
    }
    println!(
        "lean [mrad]; most: greatest torque of {TORQUE} [N·m]; outside, slipping: feet that stand, force outside the cone of {FRICTION}, of {} \
         that are real; slip: the most of a stance [mm]",
        EXAMPLE.friction
    );
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    println!(
        "derivatives of a contact mode [µs]: four feet {:.1}, a diagonal {:.1}",
        time_of(Mode::Four),
        time_of(Mode::FallingDiagonal)
    );
    let (mut samples, mut times) = (Vec::new(), SweepTimes::<3>(Vec::new()));
    let sweep = |controller: &mut Controller, state: &State| times.of(controller, |copy| copy.sweep(state));
    run(&EXAMPLE, sweep, |sample| samples.push(*sample)).map_err(|why| why.to_string())?;
    println!("time per sweep of {NODES} nodes [µs], {times}, {:.0} are asked for", 1.0 / STEP);
    compare()?;

    let mut blind = Vec::new();
    let springs = Scenario { feedback: Feedback::Joints(6.0, 0.2), ..EXAMPLE };
    run(&springs, |controller, state| controller.sweep(state), |sample| blind.push(*sample))
        .map_err(|why| why.to_string())?;
    write("solo12_trotting.svg", &picture::svg(&samples, &blind, &times.0))?;
    Ok(())
}
