//! How well a Panda follows a fast motion, with and without its dynamics in the controller, when the controller does not know
//! the tool that it carries: a table, and a plot in `target/panda_tracking.svg`.
//!
//! ```text
//! cargo run --release -p straightline-robots --example panda_tracking
//! ```
//! Controllers run at 1 kHz on generated code, the arm between their steps by Runge-Kutta steps on generated forward dynamics.

use plotters::prelude::*;
use std::error::Error;
use straightline::control::{
    computed_torque, feed_forward, gravity_compensation, Gains, Measured, Reference, TorqueLimits,
};
use straightline::integrate::{State, Step};
use straightline_robots::panda;

straightline::dynamics! {
    /// The arm that is driven: tool and forearm are parameters.
    #[allow(clippy::all)]
    mod plant = "descriptions/panda.urdf", scene = "scenes/panda_plant.toml"
}

/// The motion: from rest to rest and back, each way in this time \[s\].
const WAY: f64 = 0.7;
const FROM: [f64; 7] = [0.0, -0.8, 0.0, -2.3, 0.0, 1.6, 0.8];
const TO: [f64; 7] = [0.9, 0.2, 0.4, -1.3, 0.3, 2.2, -0.2];
/// Milliseconds that are looked at.
const STEPS: u32 = 1600;
/// What the drives of a Panda can do \[N·m\]: <https://frankaemika.github.io/docs/control_parameters.html>.
const LIMITS: TorqueLimits<f64, 7> = TorqueLimits { greatest: [87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0] };
/// Of torques \[N·m/rad\], \[N·m·s/rad\]: at 1 kHz damping d is stable below
/// inertia / h, also for the light wrist and for the upper arm about its own axis, where joints 1 and 3 align.
const JOINT_GAINS: Gains<f64, 7> = Gains {
    stiffness: [600.0, 600.0, 600.0, 600.0, 60.0, 60.0, 6.0],
    damping: [20.0, 20.0, 20.0, 20.0, 1.0, 1.0, 0.1],
};
/// Of accelerations \[1/s²\], \[1/s\].
const ACCELERATION_GAINS: Gains<f64, 7> = Gains { stiffness: [2500.0; 7], damping: [100.0; 7] };

/// The reference at time `t` \[s\]: degree five, there and back.
fn reference(t: f64) -> Reference<f64, 7> {
    let (from, to, x) = if t < WAY { (FROM, TO, t / WAY) } else { (TO, FROM, (t / WAY - 1.0).min(1.0)) };
    let s = x * x * x * (10.0 + x * (6.0 * x - 15.0));
    let sd = 30.0 * x * x * (1.0 - x) * (1.0 - x) / WAY;
    let sdd = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / (WAY * WAY);
    Reference {
        q: std::array::from_fn(|i| from[i] + s * (to[i] - from[i])),
        qd: std::array::from_fn(|i| sd * (to[i] - from[i])),
        qdd: std::array::from_fn(|i| sdd * (to[i] - from[i])),
    }
}

type ControlLaw = fn(&Reference<f64, 7>, &Measured<f64, 7>) -> [f64; 7];

/// The controllers, by what they know of the dynamics.
const LAWS: [(&str, ControlLaw); 4] = [
    ("no compensation", |wanted, measured| JOINT_GAINS.answer(wanted, measured)),
    ("gravity", |wanted, measured| gravity_compensation(wanted, measured, &JOINT_GAINS, panda::gravity_force)),
    ("feed-forward", |wanted, measured| feed_forward(wanted, measured, &JOINT_GAINS, panda::inverse_dynamics)),
    ("computed torque", |wanted, measured| {
        computed_torque(wanted, measured, &ACCELERATION_GAINS, panda::inverse_dynamics)
    }),
];

/// What the driven arm is, and the controller does not know.
struct TrueArm {
    name: &'static str,
    /// Mass of the tool \[kg\].
    tool: f64,
    /// Forearm by the one of the robot file.
    forearm: f64,
}

const TRUTHS: [TrueArm; 3] = [
    TrueArm { name: "exact model", tool: 0.0, forearm: 1.0 },
    TrueArm { name: "1 kg tool unknown", tool: 1.0, forearm: 1.0 },
    TrueArm { name: "1 kg tool, forearm 20 % heavier", tool: 1.0, forearm: 1.2 },
];

/// Errors of all joints \[rad\] after every millisecond.
fn track(law: ControlLaw, truth: &TrueArm) -> Result<Vec<[f64; 7]>, plant::Unphysical> {
    let tool = plant::Tool::new(truth.tool, [0.0, 0.0, 0.05], [0.0; 6])?;
    // `panda_link5` of the robot file, times what it is heavier
    let inertia = [0.035549, -0.002117, -0.004037, 0.029474, 0.000229, 0.008627].map(|j| j * truth.forearm);
    let forearm = plant::PandaLink5::new(1.225946 * truth.forearm, [-0.011953, 0.041065, -0.038437], inertia)?;
    let mut state = State { q: FROM, qd: [0.0; 7] };
    let step = Step::of(2.5e-4);
    let mut errors = Vec::new();
    for millisecond in 0..STEPS {
        let t = f64::from(millisecond) * 1e-3;
        let mut tau = law(&reference(t), &Measured { q: state.q, qd: state.qd });
        LIMITS.apply(&mut tau);
        for _ in 0..4 {
            let acceleration = |_: f64, q: &[f64; 7], qd: &[f64; 7], qdd: &mut [f64; 7]| {
                plant::forward_dynamics(q, qd, &tau, &tool, &forearm, qdd);
            };
            let change = step.runge_kutta_4(0.0, &state, acceleration);
            state.add(&change, 0);
        }
        let now = reference(t + 1e-3);
        errors.push(std::array::from_fn(|i| now.q[i] - state.q[i]));
    }
    Ok(errors)
}

/// Greatest modulus of all joints and times \[rad\], and the root of the mean square.
fn figures(errors: &[[f64; 7]]) -> (f64, f64) {
    let all = || errors.iter().flatten();
    let square: f64 = all().map(|e| e * e).sum();
    (all().fold(0.0, |m, e| m.max(e.abs())), (square / (errors.len() * 7) as f64).sqrt())
}

fn main() -> Result<(), Box<dyn Error>> {
    println!("Tracking errors of a Panda, there and back in {:.1} s, controllers at 1 kHz\n", 2.0 * WAY);
    println!("{:<34}{:<18}{:>14}{:>14}", "the arm", "controller", "greatest", "rms [mrad]");
    let mut curves = Vec::new();
    for truth in &TRUTHS {
        for (name, law) in LAWS {
            let errors = track(law, truth).map_err(|why| why.to_string())?;
            let (greatest, rms) = figures(&errors);
            println!("{:<34}{name:<18}{:>14.3}{:>14.3}", truth.name, greatest * 1e3, rms * 1e3);
            let worst = |e: &[f64; 7]| e.iter().fold(0.0f64, |m, e| m.max(e.abs())) * 1e3;
            curves.push((truth.name, name, errors.iter().map(worst).collect::<Vec<f64>>()));
        }
    }
    let path = std::path::Path::new("target/panda_tracking.svg");
    std::fs::create_dir_all("target")?;
    draw(path, &curves)?;
    println!("\nplot: {}", path.display());
    Ok(())
}

/// A panel per arm, a line per controller: the greatest error of all joints over time, on a logarithmic axis.
fn draw(path: &std::path::Path, curves: &[(&str, &str, Vec<f64>)]) -> Result<(), Box<dyn Error>> {
    let area = SVGBackend::new(path, (900, 900)).into_drawing_area();
    area.fill(&WHITE)?;
    let end = f64::from(STEPS) * 1e-3;
    for (panel, truth) in area.split_evenly((TRUTHS.len(), 1)).iter().zip(&TRUTHS) {
        let mut chart = ChartBuilder::on(panel)
            .caption(truth.name, ("sans-serif", 16))
            .margin(10)
            .x_label_area_size(32)
            .y_label_area_size(60)
            .build_cartesian_2d(0.0..end * 1.2, (1e-3..1e3).log_scale())?;
        let mut mesh = chart.configure_mesh();
        let exponent = |y: &f64| format!("{y:.0e}");
        mesh.light_line_style(WHITE)
            .y_label_formatter(&exponent)
            .x_desc("t [s]")
            .y_desc("greatest error [mrad]")
            .draw()?;
        for (k, (_, name, errors)) in curves.iter().filter(|(arm, ..)| *arm == truth.name).enumerate() {
            let colour = Palette99::pick(k).to_rgba();
            let points = errors.iter().enumerate().map(|(i, e)| (i as f64 * 1e-3, e.max(1e-3)));
            chart
                .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
                .label(*name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], colour.stroke_width(2)));
        }
        chart.configure_series_labels().border_style(RGBColor(200, 200, 200)).background_style(WHITE).draw()?;
    }
    area.present()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The greatest errors of the controllers \[rad\].
    fn greatest(truth: &TrueArm) -> [f64; 4] {
        LAWS.map(|(_, law)| figures(&track(law, truth).unwrap()).0)
    }

    #[test]
    fn whoever_knows_more_of_the_dynamics_follows_better() {
        let [none, gravity, feed_forward, computed_torque] = greatest(&TRUTHS[0]);
        assert!(none > 1.5 * gravity && gravity > 10.0 * feed_forward, "{none} {gravity} {feed_forward}");
        // with the model exact what is left is the millisecond for which torques are held
        assert!(feed_forward < 1e-3 && computed_torque < 1e-3, "{feed_forward} {computed_torque}");
    }

    #[test]
    fn a_wrong_model_is_better_than_none() {
        for truth in &TRUTHS[1..] {
            let [none, gravity, feed_forward, computed_torque] = greatest(truth);
            assert!(gravity < none && feed_forward < gravity, "{}: {none} {gravity} {feed_forward}", truth.name);
            assert!(computed_torque < feed_forward, "{}: {feed_forward} {computed_torque}", truth.name);
            // and worse than the right one
            assert!(feed_forward > 2.0 * greatest(&TRUTHS[0])[2]);
        }
    }
}
