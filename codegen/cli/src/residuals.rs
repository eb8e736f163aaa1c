//! The command `residuals`.

use crate::arguments::{robot_file, ModelArgs, EXIT_CODES};
use crate::files::{self, read};
use crate::log_files::{aligned_log, cutoff, not_loaded, print_table, report_lines};
use crate::{motion, options, print, residuals_page as page, view, CommandFailure};
use anstream::stdout;
use clap::Args;
use std::io::Write;
use std::path::PathBuf;
use straightline_cli::log_states::position_names;
use straightline_cli::residual::payload::{last_link, UnitPayloads, PAYLOAD_PARAMETERS};
use straightline_cli::residual::torques::TorqueModel;
use straightline_cli::residual::{
    explain, residual_torques, usual_cutoff, Explanation, PayloadFigure, ResidualTorques,
};
use straightline_codegen::diagnostic::Severity;
use straightline_logs::align::AlignedLog;
use straightline_simulation::html::four_digits;
use straightline_simulation::table::DataTable;

/// What `residuals` is told.
#[derive(Debug, Args)]
pub struct Residuals {
    #[arg(help = robot_file())]
    pub robot: PathBuf,
    /// The log: MCAP with joint states of ROS 2, CSV, Parquet, or a folder of LeRobot
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
    /// Where to draw the robot in motion with residual torques as arrows and plots that zoom, as `straightline view` does
    #[arg(long, value_name = "FILE")]
    pub view: Option<PathBuf>,
    #[command(flatten)]
    pub model: ModelArgs,
}

/// What is said below its arguments.
pub fn help() -> String {
    format!(
        "\
The log is MCAP with sensor_msgs/msg/JointState of ROS 2, or CSV or Parquet with the columns t, q.JOINT, qd.JOINT,
tau.JOINT or effort.JOINT, and qdd.JOINT where accelerations are known. A base that floats has columns q.BASE.qx, …, or
messages nav_msgs/msg/Odometry or tf2_msgs/msg/TFMessage; what pushes it need not be measured. Gaps, jumps of the clock and whatever else is
odd are listed. Friction is what the model lacks; numbers have their standard errors.

Examples:
  straightline residuals panda.urdf run.mcap
  straightline residuals panda.urdf run.mcap --topic /joint_states -o residuals.csv --html run.html
  straightline residuals panda.urdf run.mcap --view moving.html
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

/// The command.
pub fn residuals(a: &Residuals) -> Result<(), CommandFailure> {
    let options = options(None, &a.model)?;
    let source = read(&a.robot)?;
    let model = TorqueModel::load(&source, &options).map_err(not_loaded)?;
    print::diagnostics(model.warnings(), Severity::Warning);
    let frame = a.payload.clone().or_else(|| last_link(&model.model).map(str::to_string));
    let units = frame.as_ref().and_then(|frame| UnitPayloads::at(&model.model, frame));
    if let (Some(frame), None) = (&a.payload, &units) {
        let known: Vec<&str> =
            model.model.frames.iter().filter(|f| f.body.is_some()).map(|f| f.name.as_str()).collect();
        let help = format!("frames that move are {}", known.join(", "));
        return Err(print::failure_with(format!("no frame `{frame}` that moves"), &[help]));
    }
    let aligned = aligned_log(&a.log, a.topic.as_deref(), &model.model)?;
    // what pushes a base may weigh as much as any payload
    let units = units.filter(|_| aligned.is_measured.iter().all(|is_measured| *is_measured));
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
    if let Some(path) = &a.view {
        view::draw(path, &a.robot, &findings.model.model, (&a.log, &findings.table()))?;
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
    /// What the forces are called, with their units.
    pub fn efforts(&self) -> impl Iterator<Item = (&str, &'static str)> {
        self.residuals.rates.iter().map(|rate| (rate.effort.as_str(), rate.unit))
    }

    /// The head of the figures of joints, and their rows.
    pub fn joint_table(&self) -> (Vec<&'static str>, Vec<Vec<String>>) {
        let head =
            vec!["joint", "rms", "rms (observer)", "bias", "offset", "viscous", "Coulomb", "explained", "episodes"];
        let row = |((name, _), figure): ((&str, _), &straightline_cli::residual::JointFigure)| {
            let [offset, viscous, coulomb] =
                figure.fitted.map_or([const { String::new() }; 3], |fitted| fitted.map(with_error));
            let numbers = [figure.rms[0], figure.rms[1], figure.bias].map(four_digits);
            let rest = [
                offset,
                viscous,
                coulomb,
                match figure.explained > 0.0 {
                    true => format!("{:.1} %", 100.0 * figure.explained),
                    false => "nothing".to_string(),
                },
                figure.episodes.len().to_string(),
            ];
            std::iter::once(name.to_string()).chain(numbers).chain(rest).collect()
        };
        (head, self.efforts().zip(&self.explanation.joints).map(row).collect())
    }

    /// Motion and residuals over time.
    fn table(&self) -> DataTable {
        // with the motion, so that pages can draw it
        let rates = &self.residuals.rates;
        let forces: Vec<String> = rates.iter().map(|rate| rate.effort.clone()).collect();
        let kinds = [
            ("q", position_names(&self.model.model), &self.log.q),
            ("qd", rates.iter().map(|rate| rate.velocity.clone()).collect(), &self.log.qd),
            ("tau", forces.clone(), &self.log.tau),
            ("residual", forces.clone(), &self.residuals.direct),
            ("observer", forces.clone(), &self.residuals.observed),
            ("unexplained", forces, &self.explanation.left),
        ];
        let named = |(kind, names, _): &(&str, Vec<String>, &Vec<Vec<f64>>)| {
            names.iter().map(|name| format!("{kind}.{name}")).collect::<Vec<_>>()
        };
        let names = std::iter::once("t".to_string()).chain(kinds.iter().flat_map(named)).collect();
        let row = |i: usize| {
            let numbers = kinds.iter().flat_map(|(_, _, columns)| columns.iter().map(move |c| c[i]));
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
        let unmeasured = &self.log.report.without_effort;
        if !unmeasured.is_empty() {
            return vec![format!(
                "no payload is looked for, as the log does not say what pushes the base; columns {} would (0 where nothing does)",
                unmeasured.iter().map(|name| format!("tau.{name}")).collect::<Vec<_>>().join(", ")
            )];
        }
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
        let of = |(rate, what): &(Option<usize>, &str)| match rate {
            Some(rate) => format!("{what} of {}", self.residuals.rates[*rate].effort),
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
        let mut all: Vec<_> = self
            .efforts()
            .zip(&self.explanation.joints)
            .flat_map(|(effort, figure)| figure.episodes.iter().map(move |e| (effort, *e)))
            .collect();
        all.sort_by(|a, b| a.1.from.total_cmp(&b.1.from));
        let row = |((name, unit), e): &((&str, &str), straightline_logs::episodes::Episode)| {
            let times = [e.from, e.to].map(|t| format!("{t:.3} s"));
            let peak = format!("{} {}", four_digits(e.peak), unit);
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
