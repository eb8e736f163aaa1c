//! The figures of an analysis as text.

use crate::search::Swept;
use crate::CommandFailure;
use anstream::stdout;
use std::io::Write;
use straightline_cli::experiment::parameter;
use straightline_codegen::diagnostic::six_digits;
use straightline_core::model::Model;
use straightline_simulation::advice::Advice;
use straightline_simulation::analysis::{self, Analysis};
use straightline_simulation::drive_analysis::{DriveAnalysis, DriveFigures, Heating};
use straightline_simulation::html::four_digits;
use straightline_simulation::motion::Motion;
const HEAD: &str = "joint|peak|at [s]|rms|speed|power [W]|given [J]|taken [J]|force [N]|moment [N·m]";

fn figures(found: &Analysis) -> Vec<Vec<String>> {
    let row = |j: &analysis::JointFigures| {
        let number = |x: f64| format!("{x:.4}");
        let unit = |x: f64| format!("{x:.4} {}", j.unit);
        let numbers = [j.speed, j.power, j.given, j.taken, j.carried.0, j.carried.1].map(number);
        [j.name.clone(), unit(j.peak.0), number(j.peak.1), unit(j.rms)].into_iter().chain(numbers).collect()
    };
    found.joints.iter().map(row).collect()
}

const DRIVE_HEAD: &str =
    "drive|input|current [A]|rms [A]|speed [1/s]|torque [N·m]|power [W]|taken [J]|given back|heat [J]|\
                          winding [°C]|settled [°C]";

fn drive_figures(drives: &DriveAnalysis) -> Vec<Vec<String>> {
    let row = |d: &DriveFigures| {
        let number = |x: f64| format!("{x:.4}");
        let of = |heat: fn(&Heating) -> f64| d.heating.as_ref().map_or("-".to_string(), |h| format!("{:.2}", heat(h)));
        let numbers =
            [d.input.0, d.current.0, d.rms_current, d.speed, d.torque, d.power, d.energy.0, d.energy.1, d.joule];
        let heats = [of(|h| h.peak), of(|h| h.settled.0)];
        std::iter::once(d.name.clone()).chain(numbers.map(number)).chain(heats).collect()
    };
    drives.drives.iter().map(row).collect()
}

/// What is to be said of drives beside their figures and limits.
pub fn drive_remarks(model: &Model<f64>, found: &Analysis) -> Vec<String> {
    let Some(drives) = &found.drives else {
        return match model.drives.is_empty() {
            true => Vec::new(),
            false => vec!["the inputs of the drives do not follow from a motion: figures of joints only".to_string()],
        };
    };
    let heats = |d: &DriveFigures| {
        let after = d.heating?.limit_after?;
        Some(format!("{}: the motion over and over again brings the winding to its limit after {after:.1} s", d.name))
    };
    let mut remarks: Vec<String> = drives.drives.iter().filter_map(heats).collect();
    if let Some(jump) = drives.jump {
        let (joint, order, time) = (&model.joints()[jump.coordinate].name, jump.order, jump.time);
        remarks.push(format!(
            "t = {time:.6} s: derivative {order} of {joint} jumps, and drives cannot follow: choose a motion of kind `smooth`"
        ));
    }
    remarks
}

/// Where the work of the drives went.
fn books(found: &Analysis) -> String {
    let (given, change, friction) = (found.given(), found.energy_change, found.friction);
    let turned: f64 = found.joints.iter().map(|j| j.given + j.taken).sum();
    let open = match found.missing() {
        missing if missing.abs() <= 1e-9 * turned => String::new(),
        missing => format!(" ({missing:.1e} J is left by the integrals over these instants: --interval)"),
    };
    format!(
        "drives give {given:.6} J: energy changes by {change:.6} J, friction in the joints takes {friction:.6} J{open}"
    )
}

/// Limits that are exceeded, and what would keep the first ones of each kind.
pub fn violations(found: &Analysis, advice: &[Vec<Advice>]) -> Vec<String> {
    let line = |(k, v): (usize, &analysis::Violation)| {
        let analysis::Violation { time, joint, what, limit, worst } = v;
        let line = format!("t = {time:.6} s: {what} of {joint} leaves {limit}, worst {worst:.6}");
        let remedies: Vec<String> = advice.get(k).into_iter().flatten().map(Advice::to_string).collect();
        match remedies.is_empty() {
            true => line,
            false => format!("{line}; each by itself would keep it: {}", remedies.join(", or ")),
        }
    };
    found.violations.iter().enumerate().map(line).collect()
}

pub fn print_analysis(
    model: &Model<f64>,
    motion: &Motion,
    found: &Analysis,
    advice: &[Vec<Advice>],
) -> Result<(), CommandFailure> {
    let mut out = stdout().lock();
    writeln!(out, "{}: {} s, {} instants\n", model.name, motion.duration(), found.table.rows.len())?;
    let names = model.bodies.iter().map(|b| &b.joint.name).chain(model.drives.iter().map(|d| &d.name));
    let width = names.map(|name| name.chars().count()).max().unwrap_or(5).max(5);
    let line = |row: &mut dyn Iterator<Item = &str>| -> String {
        let cell = |(k, cell): (usize, &str)| if k == 0 { format!("{cell:<width$}") } else { format!("{cell:>14}") };
        row.enumerate().map(cell).collect()
    };
    writeln!(out, "{}", line(&mut HEAD.split('|')))?;
    for row in figures(found) {
        writeln!(out, "{}", line(&mut row.iter().map(String::as_str)))?;
    }
    if let Some(drives) = &found.drives {
        writeln!(out, "\n{}", line(&mut DRIVE_HEAD.split('|')))?;
        for row in drive_figures(drives) {
            writeln!(out, "{}", line(&mut row.iter().map(String::as_str)))?;
        }
    }
    for remark in drive_remarks(model, found) {
        writeln!(out, "{remark}")?;
    }
    writeln!(out, "\n{}", books(found))?;
    match found.violations.is_empty() {
        true => writeln!(out, "within all limits")?,
        false => writeln!(out, "limits exceeded, the first one first:\n  {}", violations(found, advice).join("\n  "))?,
    }
    Ok(())
}

pub fn print_sweep(sweep: &parameter::Sweep, swept: &[Swept]) -> Result<(), CommandFailure> {
    let mut out = stdout().lock();
    let has_drives = swept.iter().any(|(_, found)| found.drives.is_some());
    let of_drives = if has_drives { format!("{:>16}{:>12}", "electrical [J]", "heat [J]") } else { String::new() };
    let gap = if has_drives { " ".repeat(28) } else { String::new() };
    // every joint's peak under its name
    let names: Vec<String> = swept
        .first()
        .map_or_else(Vec::new, |(_, found)| found.joints.iter().map(|j| format!("{} [{}]", j.name, j.unit)).collect());
    let heads: String = names.iter().map(|name| format!("  {name:>12}")).collect();
    let width = sweep.path.chars().count().max(14);
    writeln!(out, "\n{:<width$}{:>14}{:>14}{gap}{:>12}  peaks:", "", "", "", "")?;
    writeln!(out, "{:<width$}{:>14}{:>14}{of_drives}{:>12}{heads}", sweep.path, "given [J]", "taken [J]", "exceeded")?;
    for (value, found) in swept {
        let sum = |f: fn(&analysis::JointFigures) -> f64| found.joints.iter().map(f).sum::<f64>();
        let peak = |(name, j): (&String, &analysis::JointFigures)| {
            format!("  {:>1$}", four_digits(j.peak.0), name.chars().count().max(12))
        };
        let peaks: String = names.iter().zip(&found.joints).map(peak).collect();
        let (given, taken) = (sum(|j| j.given), sum(|j| j.taken));
        let exceeded = found.violations.len();
        let of_drives = found.drives.as_ref().map_or(String::new(), |drives| {
            let sum = |f: fn(&DriveFigures) -> f64| drives.drives.iter().map(f).sum::<f64>();
            format!("{:>16.4}{:>12.4}", sum(|d| d.energy.0), sum(|d| d.joule))
        });
        // one between two ends has as many digits as f64 has
        let value = six_digits(*value);
        writeln!(out, "{value:<width$}{given:>14.4}{taken:>14.4}{of_drives}{exceeded:>12}{peaks}")?;
    }
    Ok(())
}
