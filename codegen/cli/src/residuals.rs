//! The command `residuals`.

use crate::arguments::{robot_file, ModelArgs, EXIT_CODES};
use crate::files::{self, read};
use crate::{motion, options, print, residuals_page as page, CommandFailure};
use anstream::stdout;
use clap::Args;
use std::io::Write;
use std::path::{Path, PathBuf};
use straightline_cli::experiment::parquet;
use straightline_cli::residual::payload::{last_link, UnitPayloads, PAYLOAD_PARAMETERS};
use straightline_cli::residual::torques::TorqueModel;
use straightline_cli::residual::{
    explain, residual_torques, usual_cutoff, Explanation, PayloadFigure, ResidualTorques,
};
use straightline_codegen::diagnostic::{six_digits, Severity};
use straightline_jit::LoadError;
use straightline_logs::align::{align, AlignedLog, LogReport};
use straightline_logs::log::{from_columns, JointLog};
use straightline_logs::{csv, mcap, LogError};
use straightline_simulation::html::four_digits;
use straightline_simulation::table::DataTable;

/// What `residuals` is told.
#[derive(Debug, Args)]
pub struct Residuals {
    #[arg(help = robot_file())]
    pub robot: PathBuf,
    /// The log: MCAP with joint states of ROS 2, CSV, or Parquet
    pub log: PathBuf,
    /// The topic, where an MCAP file has several with joint states
    #[arg(long, value_name = "TOPIC")]
    pub topic: Option<String>,
    /// Cut-off of the low-pass that smoothes momentum and torques alike, where the log has no accelerations, and of the observer
    /// [default: 10 Hz, or a sixth of the sampling]
    #[arg(long, value_name = "HZ", value_parser = cutoff)]
    pub cutoff: Option<f64>,
    /// The frame at which a payload is looked for [default: the link of the last joint]
    #[arg(long, value_name = "FRAME")]
    pub payload: Option<String>,
    /// Where to write residuals over time, as CSV, JSON or Parquet, as its name ends
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Where to write a page with tables and plots
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    #[command(flatten)]
    pub model: ModelArgs,
}

/// What is said below its arguments.
pub fn help() -> String {
    format!(
        "\
The log is MCAP with sensor_msgs/msg/JointState of ROS 2, or CSV or Parquet with the columns t, q.JOINT, qd.JOINT,
tau.JOINT or effort.JOINT, and qdd.JOINT where accelerations are known. Gaps, jumps of the clock and whatever else is
odd are listed. Friction is what the model lacks; numbers have their standard errors.

Examples:
  straightline residuals panda.urdf run.mcap
  straightline residuals panda.urdf run.mcap --topic /joint_states -o residuals.csv --html run.html
  straightline residuals panda.urdf run.csv --cutoff 5 --payload panda_hand

{EXIT_CODES}"
    )
}

impl Residuals {
    /// How it reads the robot.
    pub fn model(&self) -> Option<&ModelArgs> {
        Some(&self.model)
    }
}

fn cutoff(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(x) if (1e-3..=1e5).contains(&x) => Ok(x),
        _ => Err("a frequency between 0.001 and 100000 Hz".to_string()),
    }
}

fn wrong(path: &Path, error: &LogError) -> CommandFailure {
    let help: Vec<&str> = Some(error.help.as_str()).filter(|help| !help.is_empty()).into_iter().collect();
    print::failure_with(format!("{}: {error}", path.display()), &help)
}

fn has_extension(path: &Path, wanted: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(wanted))
}

/// The log of a file, whose kind its name says.
fn log(path: &Path, topic: Option<&str>) -> Result<JointLog, CommandFailure> {
    files::note(path);
    if topic.is_some() && !has_extension(path, "mcap") {
        let text = format!("{} has no topics", path.display());
        return Err(print::failure_with(text, &["`--topic` is for MCAP files: leave it out"]));
    }
    let found = if parquet::is_parquet(path) {
        let table = parquet::read(path).map_err(|why| print::failure(format!("{}: {why}", path.display())))?;
        let columns = table.names.iter().enumerate();
        from_columns(columns.map(|(k, name)| (name.clone(), table.rows.iter().map(|row| row[k]).collect())).collect())
    } else {
        let bytes =
            std::fs::read(path).map_err(|e| std::io::Error::new(e.kind(), format!("{}: {e}", path.display())))?;
        if has_extension(path, "mcap") {
            mcap::read(&bytes, topic)
        } else if has_extension(path, "csv") {
            csv::read(&bytes)
        } else {
            let help = ["logs end in .mcap, .csv or .parquet; `ros2 bag convert` makes MCAP of other bags"];
            return Err(print::failure_with(format!("{}: no log that is known", path.display()), &help));
        }
    };
    found.map_err(|error| wrong(path, &error))
}

/// A table with `t`, `q.`, `qd.` and `tau.` as MCAP.
pub fn mcap_bytes(table: &DataTable) -> Result<Vec<u8>, CommandFailure> {
    let columns = table.names.iter().enumerate();
    let columns = columns.map(|(k, name)| (name.clone(), table.rows.iter().map(|row| row[k]).collect())).collect();
    let bytes = from_columns(columns).and_then(|log| mcap::bytes(&log, mcap::TOPIC));
    bytes.map_err(|error| print::failure_with(format!("no log can be made of this: {error}"), &[error.help]))
}

/// The command.
pub fn residuals(a: &Residuals) -> Result<(), CommandFailure> {
    let options = options(None, &a.model)?;
    let source = read(&a.robot)?;
    let model = TorqueModel::load(&source, &options).map_err(|error| match error {
        LoadError::Wrong(diagnostics) => print::refused(&diagnostics),
        other @ LoadError::Option { .. } => print::failure(other.to_string()),
    })?;
    print::diagnostics(model.warnings(), Severity::Warning);
    if let Some(why) = model.refusal() {
        return Err(print::failure(format!("{}: the robot has no residuals by a log: {why}", a.robot.display())));
    }
    let frame = a.payload.clone().or_else(|| last_link(&model.model).map(str::to_string));
    let units = frame.as_ref().and_then(|frame| UnitPayloads::at(&model.model, frame));
    if let (Some(frame), None) = (&a.payload, &units) {
        let known: Vec<&str> =
            model.model.frames.iter().filter(|f| f.body.is_some()).map(|f| f.name.as_str()).collect();
        let help = format!("frames that move are {}", known.join(", "));
        return Err(print::failure_with(format!("no frame `{frame}` that moves"), &[help]));
    }
    let joints = model.joints();
    let aligned = align(&log(&a.log, a.topic.as_deref())?, &joints).map_err(|error| wrong(&a.log, &error))?;
    let cutoff = a.cutoff.unwrap_or_else(|| usual_cutoff(aligned.report.period));
    let residuals = residual_torques(&model, &aligned, cutoff);
    let explanation = explain(&aligned, &residuals, units.as_ref());
    let findings = Findings { model: &model, frame: frame.as_deref(), log: &aligned, residuals, explanation };
    if let Some(path) = &a.output {
        motion::write_table(path, &findings.table())?;
    }
    if let Some(path) = &a.html {
        files::write(path, &page::page(a, &findings))?;
    }
    findings.print(a)
}

/// All that is said of a log.
pub struct Findings<'a> {
    /// The robot.
    pub model: &'a TorqueModel,
    /// Where a payload was looked for.
    pub frame: Option<&'a str>,
    /// The log.
    pub log: &'a AlignedLog,
    /// Residuals.
    pub residuals: ResidualTorques,
    /// What explains them.
    pub explanation: Explanation,
}

/// A number and its standard error.
pub fn with_error((x, error): (f64, f64)) -> String {
    match error.is_finite() {
        true => format!("{} ± {error:.1e}", four_digits(x)),
        false => "not told".to_string(),
    }
}

impl Findings<'_> {
    /// The unit of a joint's force.
    pub fn unit(&self, joint: usize) -> &'static str {
        self.model.model.joints()[joint].kind.units()[3]
    }

    /// The head of the figures of joints, and their rows.
    pub fn joint_table(&self) -> (Vec<&'static str>, Vec<Vec<String>>) {
        let head =
            vec!["joint", "rms", "rms (observer)", "bias", "offset", "viscous", "Coulomb", "explained", "episodes"];
        let row = |(name, figure): (&str, &straightline_cli::residual::JointFigure)| {
            let [offset, viscous, coulomb] = figure.fitted.map(with_error);
            let numbers = [figure.rms[0], figure.rms[1], figure.bias].map(four_digits);
            let rest = [
                offset,
                viscous,
                coulomb,
                format!("{:.1} %", 100.0 * figure.explained),
                figure.episodes.len().to_string(),
            ];
            std::iter::once(name.to_string()).chain(numbers).chain(rest).collect()
        };
        (head, self.model.joints().into_iter().zip(&self.explanation.joints).map(row).collect())
    }

    /// Residuals over time.
    fn table(&self) -> DataTable {
        let kinds: [(&str, &Vec<Vec<f64>>); 3] = [
            ("residual", &self.residuals.direct),
            ("observer", &self.residuals.observed),
            ("unexplained", &self.explanation.left),
        ];
        let joints = self.model.joints();
        let named = |(kind, _): &(&str, _)| joints.iter().map(|j| format!("{kind}.{j}")).collect::<Vec<_>>();
        let names = std::iter::once("t".to_string()).chain(kinds.iter().flat_map(named)).collect();
        let row = |i: usize| {
            let numbers = kinds.iter().flat_map(|(_, columns)| columns.iter().map(move |c| c[i]));
            std::iter::once(self.log.times[i]).chain(numbers).collect()
        };
        DataTable { names, rows: (0..self.log.times.len()).map(row).collect() }
    }

    /// How the residuals came about.
    pub fn ways(&self) -> String {
        let direct = match self.residuals.cutoff {
            None => "accelerations as the log has them".to_string(),
            Some(cutoff) => {
                format!("momentum and torques smoothed at {} Hz without phase", four_digits(cutoff))
            }
        };
        let (gain, n) = (four_digits(self.residuals.gain), self.explanation.rows);
        format!("Measured minus model: {direct}; observer of momentum with gain {gain} 1/s. Fitted over {n} rows.")
    }

    /// What is said of a payload.
    pub fn payload_lines(&self) -> Vec<String> {
        let (Some(frame), Some(payload)) = (self.frame, &self.explanation.payload) else { return Vec::new() };
        if !payload.is_found {
            return vec![format!("no payload at {frame} that is more than noise")];
        }
        let PayloadFigure { parameters, centre, .. } = payload;
        let centre = centre.map(with_error).join(", ");
        let mut lines = vec![
            format!("payload at {frame} beside the model: mass {} kg", with_error(parameters[0])),
            format!("its centre of mass in the frame: {centre} m"),
        ];
        let second = (4..10).map(|k| format!("{} {}", PAYLOAD_PARAMETERS[k], with_error(parameters[k])));
        lines.push(format!("its second moments [kg·m²]: {}", second.collect::<Vec<_>>().join(", ")));
        lines
    }

    /// What the data cannot tell.
    pub fn untold_lines(&self) -> Vec<String> {
        let joints = self.model.joints();
        let of = |(joint, what): &(Option<usize>, &str)| match joint {
            Some(joint) => format!("{what} of {}", joints[*joint]),
            None => format!("{what} of the payload"),
        };
        let untold: Vec<String> = self.explanation.untold.iter().map(of).collect();
        match untold.is_empty() {
            true => Vec::new(),
            false => vec![format!("the motion cannot tell from other parameters: {}", untold.join(", "))],
        }
    }

    /// Episodes of all joints, in the order of time.
    pub fn episode_rows(&self) -> Vec<Vec<String>> {
        let joints = self.model.joints();
        let mut all: Vec<_> = joints
            .iter()
            .enumerate()
            .zip(&self.explanation.joints)
            .flat_map(|((j, name), figure)| figure.episodes.iter().map(move |e| (j, *name, *e)))
            .collect();
        all.sort_by(|a, b| a.2.from.total_cmp(&b.2.from));
        let row = |(j, name, e): &(usize, &str, straightline_logs::episodes::Episode)| {
            let times = [e.from, e.to].map(|t| format!("{t:.3} s"));
            let peak = format!("{} {}", four_digits(e.peak), self.unit(*j));
            [vec![name.to_string()], times.to_vec(), vec![peak, format!("{:.0}", e.sigmas)]].concat()
        };
        all.iter().map(row).collect()
    }

    fn print(&self, a: &Residuals) -> Result<(), CommandFailure> {
        let mut out = stdout().lock();
        writeln!(out, "{}: {}", self.model.model.name, a.log.display())?;
        for line in report_lines(&self.log.report) {
            writeln!(out, "  {line}")?;
        }
        writeln!(out, "\n{}\n", self.ways())?;
        let (head, rows) = self.joint_table();
        print_table(&mut out, &head, &rows)?;
        writeln!(out)?;
        for line in self.payload_lines().iter().chain(&self.untold_lines()) {
            writeln!(out, "{line}")?;
        }
        let episodes = self.episode_rows();
        match episodes.is_empty() {
            true => writeln!(out, "no episodes in which the rest is more than noise")?,
            false => {
                writeln!(out, "episodes in which the rest is more than noise:")?;
                print_table(&mut out, &["joint", "from", "to", "peak", "sigmas"], &episodes)?;
            }
        }
        Ok(())
    }
}

fn print_table(out: &mut impl Write, head: &[&str], rows: &[Vec<String>]) -> std::io::Result<()> {
    let width =
        |k: usize| rows.iter().map(|r| r[k].chars().count()).chain([head[k].chars().count()]).max().unwrap_or(0);
    let widths: Vec<usize> = (0..head.len()).map(width).collect();
    let mut line = |cells: &mut dyn Iterator<Item = &str>| -> std::io::Result<()> {
        for (k, (cell, width)) in cells.zip(&widths).enumerate() {
            match k {
                0 => write!(out, "{cell:<width$}")?,
                _ => write!(out, "  {cell:>width$}")?,
            }
        }
        writeln!(out)
    };
    line(&mut head.iter().copied())?;
    rows.iter().try_for_each(|row| line(&mut row.iter().map(String::as_str)))
}

/// So many places are named one by one.
const MOST_PLACES: usize = 5;

/// What was met in a log.
pub fn report_lines(report: &LogReport) -> Vec<String> {
    let LogReport { rows, kept, period, .. } = report;
    let rate = if *period > 0.0 { four_digits(1.0 / period) } else { "0".to_string() };
    let mut lines = vec![format!("{kept} of {rows} rows, {rate} Hz; longest step {} s", six_digits(report.longest))];
    let mut count = |n: usize, what: &str| {
        if n > 0 {
            lines.push(format!("{n} {what}"));
        }
    };
    count(report.incomplete, "rows left out that lack a number, or have one that is not finite");
    count(report.duplicates, "rows left out with the time stamp of the row before");
    count(report.reordered, "messages with joints in another order, or other joints, than the message before");
    count(report.unstamped, "messages without a time stamp of their own, taken at the time at which they were logged");
    let listed = |all: &[(f64, f64)], shown: &dyn Fn(&(f64, f64)) -> String| {
        let rest = if all.len() > MOST_PLACES { ", …" } else { "" };
        all.iter().take(MOST_PLACES).map(shown).collect::<Vec<_>>().join(", ") + rest
    };
    if !report.gaps.is_empty() {
        let gaps = listed(&report.gaps, &|(from, to)| format!("{from:.4} to {to:.4} s"));
        lines.push(format!("{} gaps: {gaps}", report.gaps.len()));
    }
    if !report.jumps.is_empty() {
        let jumps = listed(&report.jumps, &|(at, by)| format!("by {by:.4} s at {at:.4} s"));
        lines.push(format!("the clock jumps back {} times: {jumps}", report.jumps.len()));
    }
    for (what, names) in [
        ("joints of the log that the robot does not have", &report.unknown),
        ("joints without velocity, whose positions are differentiated", &report.without_velocity),
        ("not read", &report.others),
    ] {
        if !names.is_empty() {
            lines.push(format!("{what}: {}", names.join(", ")));
        }
    }
    lines
}
