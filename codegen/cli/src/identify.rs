//! The command `identify`.

use crate::arguments::{robot_file, ModelArgs, EXIT_CODES};
use crate::files::{self, read};
use crate::log_files::{aligned_log, cutoff, not_loaded, print_table, report_lines};
use crate::motion::write_table;
use crate::{options, print, CommandFailure};
use anstream::stdout;
use clap::Args;
use similar::TextDiff;
use std::io::Write;
use std::path::{Path, PathBuf};
use straightline_cli::identification::{
    designed, fitted, identified, new_inertial, together, DesignDemand, Identification, IdentifiedJoint, LinkMap,
    RegressorModel,
};
use straightline_cli::log_states::NamedRate;
use straightline_cli::residual::usual_cutoff;
use straightline_codegen::convert::renumber::renumbered;
use straightline_codegen::description;
use straightline_codegen::diagnostic::{Diagnostics, Severity, Source};
use straightline_core::base_parameters::{JointParameter, PER_BODY};
use straightline_logs::align::AlignedLog;
use straightline_logs::weighted::FitData;
use straightline_simulation::html::four_digits;
use straightline_simulation::table::DataTable;

/// So many standard errors to both sides are an interval of 95 %.
const NORMAL_95: f64 = 1.96;
/// Intervals wider than this part of the number say little of it.
const HARDLY: f64 = 0.5;

/// The cut-off, unless another is given \[Hz\]: noise of velocities that regressors have grows with its third power, and makes inertias too small.
const CUTOFF: f64 = 5.0;
/// Rows of a designed motion \[Hz\].
const RATE: f64 = 100.0;

/// What `identify` is told.
#[derive(Debug, Args)]
pub struct Identify {
    #[arg(help = robot_file())]
    pub robot: PathBuf,
    /// The logs: MCAP with joint states of ROS 2, CSV, Parquet, or folders of LeRobot
    #[arg(required_unless_present = "design", value_name = "LOG")]
    pub logs: Vec<PathBuf>,
    /// A log that is not fitted, and says how good the numbers are
    #[arg(long, value_name = "LOG")]
    pub validate: Vec<PathBuf>,
    /// The topic, where an MCAP file has several with joint states
    #[arg(long, value_name = "TOPIC")]
    pub topic: Option<String>,
    /// Cut-off of the low-pass that all terms of the equations of motion pass, where logs have no accelerations
    /// [default: 5 Hz, or a sixth of the sampling]
    #[arg(long, value_name = "HZ", value_parser = cutoff)]
    pub cutoff: Option<f64>,
    /// Where to write the robot file with the new numbers; all else in it stays as it is
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Write a motion that excites all parameters, within the limits of the joints, in place of all else: as CSV, JSON or Parquet, as its name ends
    #[arg(long, value_name = "FILE", conflicts_with_all = ["logs", "validate", "topic", "cutoff", "output"])]
    pub design: Option<PathBuf>,
    /// The period of that motion, in seconds
    #[arg(long, value_name = "S", default_value_t = 10.0, value_parser = duration, requires = "design")]
    pub duration: f64,
    /// Seed of the motions from which its search begins
    #[arg(long, value_name = "S", default_value_t = 1, requires = "design")]
    pub seed: u64,
    #[command(flatten)]
    pub model: ModelArgs,
}

fn duration(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(x) if (0.1..=1e4).contains(&x) => Ok(x),
        _ => Err("a time between 0.1 and 10000 s".to_string()),
    }
}

/// What is said below its arguments.
pub fn help() -> String {
    format!(
        "\
Logs are as those of `residuals`. Fitted are base parameters, the combinations that forces tell apart, of links, friction
and rotors. Links are written that can be: mass and inertia positive, nearest to data and file. What the logs cannot
tell stays as the file has it. Several logs are also fitted without each in turn, and held against it.

Examples:
  straightline identify panda.urdf run1.mcap run2.mcap -o identified.urdf
  straightline identify arm.toml run.csv --validate other.csv
  straightline identify panda.urdf --design excite.csv --duration 20

{EXIT_CODES}"
    )
}

impl Identify {
    /// How it reads the robot.
    pub fn model(&self) -> Option<&ModelArgs> {
        Some(&self.model)
    }
}

/// The command.
pub fn identify(a: &Identify) -> Result<(), CommandFailure> {
    let options = options(None, &a.model)?;
    let source = read(&a.robot)?;
    let robot = RegressorModel::load(&source, &options).map_err(not_loaded)?;
    print::diagnostics(robot.warnings(), Severity::Warning);
    if let Some(why) = robot.refusal() {
        return Err(print::failure(format!("{}: the robot cannot be identified by logs: {why}", a.robot.display())));
    }
    if let Some(path) = &a.design {
        return design(a, &robot, path);
    }
    let aligned = |paths: &[PathBuf]| -> Result<Vec<AlignedLog>, CommandFailure> {
        let all: Vec<Result<AlignedLog, CommandFailure>> =
            paths.iter().map(|path| log_of_forces(path, a.topic.as_deref(), &robot)).collect();
        all.into_iter().collect()
    };
    let (logs, others) = (aligned(&a.logs)?, aligned(&a.validate)?);
    let period = logs.iter().chain(&others).map(|log| log.report.period).fold(0.0, f64::max);
    let cutoff = a.cutoff.unwrap_or_else(|| usual_cutoff(period).min(CUTOFF));
    let progress = print::spinner("evaluating regressors");
    let (data, checks) = (robot.equations(&logs, cutoff), robot.equations(&others, cutoff));
    progress.finish_and_clear();
    for (path, data) in a.logs.iter().chain(&a.validate).zip(data.iter().chain(&checks)) {
        if data.instants() == 0 {
            let text =
                format!("{}: too short: ends of segments are lost, where smoothing lacks neighbours", path.display());
            return Err(print::failure_with(text, &["log a longer motion, or raise `--cutoff`"]));
        }
    }
    let map = description::read(&source, &mut Diagnostics::new()).map(|robot_file| LinkMap::of(&robot, &robot_file));
    let map = map.ok_or(CommandFailure::Input)?;
    let whole = together(&data);
    let Some(found) = identified(&robot, &map, &whole) else {
        return Err(print::failure(format!("{}: a link is no body that could move", a.robot.display())));
    };
    if found.fit.fitted.untold.len() == robot.names.len() {
        let text = format!("{}: the logs tell nothing of the robot", a.robot.display());
        return Err(print::failure_with(text, &["log a motion of all joints, with their efforts"]));
    }
    let text = written(&source, &map, &found)?;
    let findings = IdentifyFindings {
        a,
        robot: &robot,
        map: &map,
        logs: [&logs, &others],
        data: &data,
        checks: &checks,
        found: &found,
        cutoff,
    };
    findings.print()?;
    print_diff(&source, a.output.as_deref().unwrap_or(&a.robot), &text)?;
    if let Some(path) = &a.output {
        files::write(path, &text)?;
    }
    Ok(())
}

/// A log that says what pushes the robot.
fn log_of_forces(path: &Path, topic: Option<&str>, robot: &RegressorModel) -> Result<AlignedLog, CommandFailure> {
    let log = aligned_log(path, topic, &robot.model)?;
    let unmeasured: Vec<String> = log.report.without_effort.iter().map(|name| format!("tau.{name}")).collect();
    match unmeasured.is_empty() {
        true => Ok(log),
        false => {
            let text = format!("{}: the log does not say what pushes the base", path.display());
            let help = format!("give it columns {}: 0 where nothing does, as in flight", unmeasured.join(", "));
            Err(print::failure_with(text, &[&help]))
        }
    }
}

/// Writes a motion that excites all parameters.
fn design(a: &Identify, robot: &RegressorModel, path: &Path) -> Result<(), CommandFailure> {
    let progress = print::spinner("designing a motion");
    let found = designed(robot, DesignDemand { duration: a.duration, seed: a.seed });
    progress.finish_and_clear();
    let found = found.map_err(|why| print::failure(format!("{}: {why}", a.robot.display())))?;
    let (times, columns) = found.sampled(RATE);
    let named = |kind: &&str| robot.rates.iter().map(|rate| format!("{kind}.{}", rate.velocity)).collect::<Vec<_>>();
    let names = std::iter::once("t".to_string()).chain(["q", "qd", "qdd"].iter().flat_map(named)).collect();
    let row = |(i, t): (usize, &f64)| {
        std::iter::once(*t).chain(columns.iter().flat_map(|kind| kind.iter().map(move |column| column[i]))).collect()
    };
    write_table(path, &DataTable { names, rows: times.iter().enumerate().map(row).collect() })?;
    let mut out = stdout().lock();
    let (condition, random) = (four_digits(found.condition), four_digits(found.random));
    writeln!(
        out,
        "{}: a motion of {} s, from rest to rest, that can be repeated",
        path.display(),
        four_digits(a.duration)
    )?;
    writeln!(out, "condition number of the regressor of {} base parameters: {condition}", robot.names.len())?;
    writeln!(out, "median of random motions of the same form within the same limits: {random}")?;
    if !found.assumed.is_empty() {
        writeln!(out, "limits were assumed where the file has none: {}", found.assumed.join(", "))?;
    }
    Ok(())
}

/// The robot file with the new numbers.
fn written(source: &Source, map: &LinkMap, found: &Identification) -> Result<String, CommandFailure> {
    let mut said = Diagnostics::new();
    let text = renumbered(source, &found.numbers(map), &mut said);
    // what else there is to say of the file was said when it was read
    match text {
        Some(text) => Ok(text),
        None => Err(print::refused(&said)),
    }
}

fn print_diff(source: &Source, path: &Path, text: &str) -> Result<(), CommandFailure> {
    let diff = TextDiff::from_lines(source.text(), text);
    let mut out = stdout().lock();
    let shown = diff.unified_diff().context_radius(1).header(source.path(), &path.display().to_string()).to_string();
    Ok(write!(out, "\n{shown}")?)
}

/// All that is said of an identification.
struct IdentifyFindings<'a> {
    a: &'a Identify,
    robot: &'a RegressorModel,
    map: &'a LinkMap,
    logs: [&'a [AlignedLog]; 2],
    data: &'a [FitData],
    checks: &'a [FitData],
    found: &'a Identification,
    cutoff: f64,
}

impl IdentifyFindings<'_> {
    fn print(&self) -> Result<(), CommandFailure> {
        let mut out = stdout().lock();
        writeln!(
            out,
            "{}: {} base parameters of {} joints",
            self.robot.exact.name,
            self.robot.names.len(),
            self.robot.model.joints().len()
        )?;
        let [fitted, others] = self.logs;
        for (path, log) in self.a.logs.iter().chain(&self.a.validate).zip(fitted.iter().chain(others)) {
            writeln!(out, "  {}", path.display())?;
            report_lines(&log.report).iter().try_for_each(|line| writeln!(out, "    {line}"))?;
        }
        writeln!(out, "\n{}\n", self.ways())?;
        print_table(&mut out, &["base parameter (SI units)", "file", "identified", "± 95 %"], &self.parameter_rows())?;
        writeln!(out)?;
        self.untold_lines().iter().try_for_each(|line| writeln!(out, "{line}"))?;
        writeln!(out)?;
        print_table(&mut out, &["link", "mass of the file", "mass [kg]", "centre of mass [m]"], &self.link_rows())?;
        writeln!(out)?;
        let head = ["joint", "parameter", "file", "written"];
        print_table(&mut out, &head, &self.joint_rows())?;
        self.print_errors(&mut out)
    }

    fn ways(&self) -> String {
        let fit = &self.found.fit;
        let smoothed = match self.logs[0].iter().all(|log| log.qdd.is_some()) {
            true => "accelerations as the logs have them".to_string(),
            false => format!("all terms of the equations pass a low-pass at {} Hz", four_digits(self.cutoff)),
        };
        let far = match fit.far {
            0 => String::new(),
            n => format!(", without {n} that are far from all else, as contact is"),
        };
        format!("Fitted over {} instants{far}; {smoothed}.", fit.instants)
    }

    fn parameter_rows(&self) -> Vec<Vec<String>> {
        let fitted = &self.found.fit.fitted;
        let row = |k: usize| {
            let (x, error) = (fitted.coefficients[k], fitted.errors[k]);
            let (value, interval) = match () {
                () if self.found.held.contains(&k) => ("0".to_string(), "held: negative".to_string()),
                () if error.is_finite() => (four_digits(x), format!("{:.1e}", NORMAL_95 * error)),
                () => ("not told".to_string(), String::new()),
            };
            vec![self.robot.names[k].clone(), four_digits(self.robot.nominal[k]), value, interval]
        };
        (0..self.robot.names.len()).map(row).collect()
    }

    fn untold_lines(&self) -> Vec<String> {
        let fitted = &self.found.fit.fitted;
        let named = |all: &[usize]| all.iter().map(|k| self.robot.names[*k].as_str()).collect::<Vec<_>>().join(", ");
        let numbers = PER_BODY * self.map.links.len() + self.map.joints.len();
        let mut lines = vec![format!(
            "{numbers} numbers of links and joints make {} that forces tell apart; where these leave a choice, it is the file's.",
            self.robot.names.len()
        )];
        if !fitted.untold.is_empty() {
            lines.push(format!("The motion cannot tell from others: {}.", named(&fitted.untold)));
        }
        let hardly: Vec<usize> = (0..fitted.errors.len())
            .filter(|k| fitted.errors[*k].is_finite() && !self.found.held.contains(k))
            .filter(|k| {
                NORMAL_95 * fitted.errors[*k] > HARDLY * fitted.coefficients[*k].abs().max(self.robot.nominal[*k].abs())
            })
            .collect();
        if !hardly.is_empty() {
            lines.push(format!(
                "It hardly tells, to worse than {} %: {}.",
                four_digits(100.0 * HARDLY),
                named(&hardly)
            ));
        }
        lines
    }

    fn link_rows(&self) -> Vec<Vec<String>> {
        let row = |(link, body): (&straightline_cli::identification::IdentifiedLink, &[f64; PER_BODY])| {
            let centre = new_inertial(&link.name, body).com.map(four_digits).join(", ");
            vec![link.name.clone(), four_digits(link.written[0]), four_digits(body[0]), centre]
        };
        self.map.links.iter().zip(&self.found.bodies).map(row).collect()
    }

    fn joint_rows(&self) -> Vec<Vec<String>> {
        let row = |(joint, x): (&IdentifiedJoint, &f64)| {
            let (file, word) = match joint.kind {
                JointParameter::Offset => ("no place for it".to_string(), "offset"),
                other => (four_digits(joint.by_file), other.word()),
            };
            vec![joint.name.clone(), word.to_string(), file, four_digits(*x)]
        };
        let all = || self.map.joints.iter().zip(&self.found.joints);
        // joint by joint
        let each = self.map.joints.iter().filter(|joint| joint.kind == JointParameter::Damping);
        each.flat_map(|joint| all().filter(|(own, _)| own.name == joint.name).map(row)).collect()
    }

    /// Errors of the file, of the fit and of what is written, on logs that were fitted, on each by a fit of the others, and on others.
    fn print_errors(&self, out: &mut impl Write) -> Result<(), CommandFailure> {
        let zero = vec![0.0; self.robot.names.len()];
        let mut table = |title: &str, data: &FitData, models: &[(&str, &[f64])]| -> Result<(), CommandFailure> {
            writeln!(out, "\n{title}")?;
            let head: Vec<&str> =
                ["joint", "torques"].into_iter().chain(models.iter().map(|(name, _)| *name)).collect();
            let columns: Vec<Vec<f64>> = std::iter::once(&zero[..])
                .chain(models.iter().map(|(_, beta)| *beta))
                .map(|beta| data.rms(beta))
                .collect();
            let row = |(j, rate): (usize, &NamedRate)| {
                std::iter::once(rate.effort.clone()).chain(columns.iter().map(|c| four_digits(c[j]))).collect()
            };
            let rows: Vec<Vec<String>> = self.robot.rates.iter().enumerate().map(row).collect();
            Ok(print_table(&mut *out, &head, &rows)?)
        };
        let found = self.found;
        let models: [(&str, &[f64]); 3] =
            [("file", &self.robot.nominal), ("fit", &found.fit.fitted.coefficients), ("written", &found.written)];
        table(
            "rms of torques, and of what models leave of them, in the logs that were fitted:",
            &together(self.data),
            &models,
        )?;
        if self.data.len() > 1 {
            for (k, (path, own)) in self.a.logs.iter().zip(self.data).enumerate() {
                let rest: Vec<FitData> =
                    self.data.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, data)| data.clone()).collect();
                let (fit, _) = fitted(self.robot, &together(&rest));
                let title = format!("the same in {}, by a fit of the other logs:", path.display());
                table(&title, own, &[("file", &self.robot.nominal), ("fit", &fit.fitted.coefficients)])?;
            }
        }
        for (path, data) in self.a.validate.iter().zip(self.checks) {
            table(&format!("the same in {}, which was not fitted:", path.display()), data, &models)?;
        }
        Ok(())
    }
}
