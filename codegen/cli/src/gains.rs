//! Gains that `analyze` proposes: as text, as sections of the page, as a file.

use crate::motion::{not_analysed, write_table};
use crate::motion_arguments::Analyze;
use crate::CommandFailure;
use anstream::stdout;
use std::io::Write;
use straightline_cli::experiment::Experiment;
use straightline_core::model::Model;
use straightline_simulation::command::{Command, Controller};
use straightline_simulation::gains::{propose, GainDemand, GainProposal, JointGains, Margins, Tracking, KEPT};
use straightline_simulation::html::{four_digits, Page};
use straightline_simulation::motion::Motion;
use straightline_simulation::panel::Panel;

/// Gains, and how controllers follow the motion with them: a name each.
pub struct Proposed {
    pub gains: GainProposal,
    pub tracked: Vec<(&'static str, Result<Tracking, String>)>,
    /// Unit of every driven joint's coordinate.
    units: Vec<&'static str>,
}

/// What an experiment, or the argument `--gains`, asks for; the gains of LQR go to the file of that argument.
pub fn proposed(
    a: &Analyze,
    model: &Model<f64>,
    motion: &Motion,
    experiment: &Experiment,
) -> Result<Option<Proposed>, CommandFailure> {
    let demand = match (&experiment.gains, &a.gains) {
        (Some(demand), _) => demand.clone(),
        (None, Some(_)) => GainDemand::of(model.nv()),
        (None, None) => return Ok(None),
    };
    let gains = propose(model, motion, &demand).map_err(|failure| not_analysed(&failure))?;
    if let Some(path) = &a.gains {
        write_table(path, &gains.table(model))?;
    }
    let per_joint = gains.controller(model, motion, false);
    let none = vec![0.0; model.nv()];
    let before = match &experiment.command {
        Command::Controller(controller) => ("as in the file", (**controller).clone()),
        _ => ("torques alone", Controller { stiffness: none.clone(), damping: none, ..per_joint.clone() }),
    };
    let [is_stable, lqr_is_stable] = gains.spectral_radius.map(|radius| radius < 1.0);
    let lqr = gains.controller(model, motion, true);
    let all = [(before, true), (("per joint", per_joint), is_stable), (("LQR", lqr), lqr_is_stable)];
    let tracked = all.map(|((name, controller), is_stable)| match is_stable {
        true => (name, gains.followed(model, controller).map_err(|f| f.to_string())),
        false => (name, Err("nothing to follow with, as the loop is not stable".to_string())),
    });
    let unit = |j: &JointGains| {
        let joint = model.free_joints().find(|joint| joint.iv == j.index);
        joint.map_or("", |joint| joint.kind.units()[0])
    };
    let units = gains.joints.iter().map(unit).collect();
    Ok(Some(Proposed { gains, tracked: tracked.into(), units }))
}

/// Below these margins a remark is made: 30 degrees, half as much again.
const LEAST: (f64, f64) = (std::f64::consts::FRAC_PI_6, 1.5);

impl Proposed {
    fn demand(&self) -> String {
        let GainDemand { period, delay, .. } = &self.gains.demand;
        let delay = match delay {
            0 => "no delay".to_string(),
            1 => "a delay of one period".to_string(),
            n => format!("a delay of {n} periods"),
        };
        format!("computed every {} s and held, {delay}", four_digits(*period))
    }

    /// Rows of a table: inertia, gains, what they make, and margins.
    fn rows(&self) -> Vec<Vec<String>> {
        let pair = |(a, b): (f64, f64)| match four_digits(a) == four_digits(b) {
            true => four_digits(a),
            false => format!("{} – {}", four_digits(a), four_digits(b)),
        };
        let margin = |m: &Option<Margins>| match m {
            None => "unstable".to_string(),
            Some(m) => {
                let falls = if m.gain.0 > 0.0 { format!(", ≥ {:.2}", m.gain.0) } else { String::new() };
                let grows = if m.gain.1.is_finite() { format!("{:.1}", m.gain.1) } else { "any".to_string() };
                format!("{:.0}°, × {grows}{falls}", m.phase.to_degrees())
            }
        };
        let row = |j: &JointGains| {
            let own =
                [pair(j.inertia), four_digits(self.gains.stiffness[j.index]), four_digits(self.gains.damping[j.index])];
            let does = [pair(j.frequency), pair(j.ratio), margin(&j.margins[0]), margin(&j.margins[1])];
            std::iter::once(j.name.clone()).chain(own).chain(does).collect()
        };
        self.gains.joints.iter().map(row).collect()
    }

    /// Rows of a table: the greatest error and the root of the mean square, per way to follow.
    fn tracking_rows(&self) -> Vec<Vec<String>> {
        let row = |(k, joint): (usize, &JointGains)| {
            let cell = |(_, tracked): &(&str, Result<Tracking, String>)| match tracked {
                Err(_) => ["–".to_string(), "–".to_string()],
                Ok(tracked) => {
                    let (most, rms) = tracked.figures(k);
                    [most, rms].map(|x| format!("{} {}", four_digits(x), self.units[k]))
                }
            };
            std::iter::once(joint.name.clone()).chain(self.tracked.iter().flat_map(cell)).collect()
        };
        self.gains.joints.iter().enumerate().map(row).collect()
    }

    fn tracking_head(&self) -> Vec<String> {
        let of = |(name, _): &(&str, _)| [format!("{name}: most"), "rms".to_string()];
        std::iter::once("joint".to_string()).chain(self.tracked.iter().flat_map(of)).collect()
    }

    /// What is to be said beside the figures.
    fn remarks(&self) -> Vec<String> {
        let mut out = Vec::new();
        for (kind, name, remedy) in [
            (0, "gains per joint", "a lower `bandwidth`, a shorter `period`"),
            (1, "gains of LQR", "less `torque` for these errors, a shorter `period`"),
        ] {
            let radius = self.gains.spectral_radius[kind];
            if radius >= 1.0 {
                out.push(format!("{name} are not stable when sampled so (an eigenvalue of {radius:.4}): {remedy}"));
                continue;
            }
            let is_low = |j: &&JointGains| j.margins[kind].is_some_and(|m| m.phase < LEAST.0 || m.gain.1 < LEAST.1);
            let low: Vec<&str> = self.gains.joints.iter().filter(is_low).map(|j| j.name.as_str()).collect();
            if !low.is_empty() {
                out.push(format!(
                    "{name} have margins below {:.0}° or × {:.1} at {}: {remedy}",
                    LEAST.0.to_degrees(),
                    LEAST.1,
                    low.join(", ")
                ));
            }
        }
        for joint in &self.gains.joints {
            let wanted = self.gains.demand.bandwidth[joint.index];
            if joint.frequency.0 < 0.999 * wanted {
                out.push(format!(
                    "{}: the period and the range of inertia allow {} Hz of the {} Hz that are wanted, with margins of {:.0}° and × {}",
                    joint.name,
                    four_digits(joint.frequency.0),
                    four_digits(wanted),
                    KEPT.0.to_degrees(),
                    KEPT.1
                ));
            }
        }
        for (name, tracked) in &self.tracked {
            if let Err(why) = tracked {
                out.push(format!("{name}: {why}"));
            }
        }
        out
    }

    fn trial(&self) -> String {
        let GainDemand { mass_error, .. } = self.gains.demand;
        format!(
            "Followed by a robot whose links are {:+.0} % heavier than the controller knows, and off at the beginning by what the file says.",
            100.0 * mass_error
        )
    }

    /// The table that a controller has these gains by.
    fn controller(&self) -> String {
        // those of passive joints may be left out
        let numbers = |all: &[f64]| {
            let mut driven: Vec<usize> = self.gains.joints.iter().map(|j| j.index).collect();
            driven.sort_unstable();
            driven.iter().map(|j| four_digits(all[*j])).collect::<Vec<_>>().join(", ")
        };
        let delay = match self.gains.demand.delay {
            0 => String::new(),
            n => format!("delay = {n}\n"),
        };
        format!(
            "[controller]\ncompensation = \"feed_forward\"\nstiffness = [{}]\ndamping = [{}]\nperiod = {:?}\n{delay}saturate = true\n",
            numbers(&self.gains.stiffness),
            numbers(&self.gains.damping),
            self.gains.demand.period
        )
    }
}

const HEAD: [&str; 8] =
    ["joint", "inertia", "stiffness", "damping", "frequency [Hz]", "ratio", "margins per joint", "margins of LQR"];

/// Gains, margins and errors as text.
pub fn print(proposed: &Proposed, a: &Analyze) -> Result<(), CommandFailure> {
    let mut out = stdout().lock();
    writeln!(out, "\nfeedback gains, {}; margins of phase and gain, the least along the motion:\n", proposed.demand())?;
    table(&mut out, &HEAD.map(str::to_string), &proposed.rows())?;
    writeln!(out, "\n{}\n", proposed.trial())?;
    table(&mut out, &proposed.tracking_head(), &proposed.tracking_rows())?;
    for remark in proposed.remarks() {
        writeln!(out, "{remark}")?;
    }
    writeln!(out, "\n{}", proposed.controller())?;
    match &a.gains {
        Some(path) => writeln!(
            out,
            "gains of LQR over time: `gains = {:?}` in place of stiffness and damping",
            path.display().to_string()
        )?,
        None => writeln!(out, "--gains FILE writes the gains of LQR over time")?,
    }
    Ok(())
}

fn table(out: &mut dyn Write, head: &[String], rows: &[Vec<String>]) -> std::io::Result<()> {
    let length = |k: usize| rows.iter().chain([&head.to_vec()]).map(|row| row[k].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..head.len()).map(length).collect();
    for row in std::iter::once(&head.to_vec()).chain(rows) {
        let cell = |(k, text): (usize, &String)| match k {
            0 => format!("{text:<0$}", widths[0]),
            _ => format!("  {text:>0$}", widths[k]),
        };
        writeln!(out, "{}", row.iter().enumerate().map(cell).collect::<String>())?;
    }
    Ok(())
}

/// The same in the page.
pub fn section(page: &mut Page, proposed: &Proposed) {
    let lead = format!(
        "Torques beside those of the motion, {}. Margins of phase and gain: the least along the motion, at each joint with all other loops closed.",
        proposed.demand()
    );
    page.heading("Feedback gains", &lead);
    page.table(&HEAD, &proposed.rows());
    page.remarks(&proposed.remarks(), true);
    page.heading("Followed with these gains", &proposed.trial());
    let head = proposed.tracking_head();
    page.table(&head.iter().map(String::as_str).collect::<Vec<_>>(), &proposed.tracking_rows());
    let card = |(k, joint): (usize, &JointGains)| {
        let panel = |(name, tracked): &(&'static str, Result<Tracking, String>)| {
            let tracked = tracked.as_ref().ok()?;
            let points = tracked.times.iter().copied().zip(tracked.errors[k].iter().copied()).collect();
            let title = format!("error, {name}");
            Some(
                Panel { title: &title, units: ("s", proposed.units[k]), lines: vec![points], levels: Vec::new() }.svg(),
            )
        };
        (joint.name.clone(), proposed.tracked.iter().filter_map(panel).collect())
    };
    page.cards(&proposed.gains.joints.iter().enumerate().map(card).collect::<Vec<(String, Vec<String>)>>());
}
