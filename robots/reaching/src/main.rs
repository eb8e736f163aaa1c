//! Runs the scene of [`closed_loop::EXAMPLE`], prints what it took, and draws `target/panda_reaching.svg`.
//!
//! ```text
//! cargo run --release -p straightline-reaching-example
//! ```

mod picture;

use std::error::Error;
use std::time::Instant;
use straightline_example_charts::{write, SweepTimes};
use straightline_reaching_example::arm::{HAND, TORQUE};
use straightline_reaching_example::closed_loop::{converged, run, Sample, EXAMPLE, PERIOD};
use straightline_reaching_example::ilqr::{Solver, NODES, STEP};
use straightline_reaching_example::task::{State, Task, Weights};
use straightline_reaching_example::NV;

/// From the hand to its goal \[m\].
fn way(sample: &Sample) -> f64 {
    (0..3).map(|i| (sample.points[HAND][i] - sample.goal[i]).powi(2)).sum::<f64>().sqrt()
}

fn main() -> Result<(), Box<dyn Error>> {
    let task = Task {
        goal: EXAMPLE.goals[0].hand,
        spheres: EXAMPLE.spheres,
        disturbance: [0.0; NV],
        weights: Weights::DEFAULT,
    };
    let began = Instant::now();
    let (solver, count) = converged(&task, &EXAMPLE.start, 1e-6);
    let took = began.elapsed().as_secs_f64();
    println!(
        "from rest, {NODES} nodes of {STEP} s: {count} sweeps to a cost of {:.4} that falls by less than a millionth, {:.0} µs each\n",
        solver.motion.cost,
        took / f64::from(count) * 1e6
    );
    let (mut samples, mut times) = (Vec::new(), SweepTimes::<5>(Vec::new()));
    let sweep = |solver: &mut Solver, task: &Task, x: &State| times.of(solver, |copy| copy.sweep(task, x));
    run(&EXAMPLE, sweep, |sample| samples.push(*sample)).map_err(|why| why.to_string())?;

    println!("closed loop, a sweep every {:.0} ms for {} s:", PERIOD * 1e3, EXAMPLE.duration);
    println!("time per sweep [µs], {times}");
    let trials: u32 = samples.iter().map(|s| s.sweep.trials).sum();
    let idle = samples.iter().filter(|s| s.sweep.part == 0.0).count();
    let held = samples.iter().filter(|s| s.sweep.at_limits > 0).count();
    println!(
        "rollouts per search {:.2}; {idle} of {} sweeps found nothing better, {held} had torques at limits",
        f64::from(trials) / samples.len() as f64,
        samples.len()
    );
    for (k, goal) in EXAMPLE.goals.iter().enumerate() {
        let until = EXAMPLE.goals.get(k + 1).map_or(EXAMPLE.duration, |next| next.from);
        let mine = samples.iter().filter(|s| (goal.from..until).contains(&s.time));
        let there = mine.clone().find(|s| way(s) < 0.01).map_or(f64::NAN, |s| s.time - goal.from);
        let mut mine = mine;
        let last = mine.next_back().map_or(f64::NAN, way);
        println!("goal {}: within 1 cm after {there:.2} s, {:.2} mm away in the end", k + 1, last * 1e3);
    }
    let clear = samples.iter().map(|s| s.clearance).fold(f64::INFINITY, f64::min);
    let part = |s: &Sample| s.tau.iter().zip(TORQUE).map(|(tau, most)| tau.abs() / most).fold(0.0, f64::max);
    println!(
        "nearest to a sphere {:.1} mm, greatest torque {:.0} % of its limit",
        clear * 1e3,
        100.0 * samples.iter().map(part).fold(0.0, f64::max)
    );
    write("panda_reaching.svg", &picture::svg(&samples, &times.0))?;
    Ok(())
}
