//! What `simulate` and `analyze` are told.

use crate::arguments::{robot_file, ModelArgs};
use clap::builder::TypedValueParser;
use clap::Args;
use std::path::PathBuf;
use straightline_cli::experiment::parameter::{self, ParameterRange, Sweep};
use straightline_simulation::optimize::Objective;

#[derive(Debug, Args)]
pub struct Simulate {
    #[arg(help = robot_file())]
    pub robot: PathBuf,
    /// The experiment: TOML, or samples of torques as CSV or JSON
    #[arg(short, long, value_name = "FILE")]
    pub input: PathBuf,
    /// Where to write the result, as CSV or, if it ends in .json, .parquet or .mcap, as JSON, Parquet or MCAP (joint states and poses of frames as messages of ROS 2)
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Where to draw coordinates, torques and, of a controller, errors
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// Where to draw it in motion, as `straightline view` does
    #[arg(long, value_name = "FILE")]
    pub view: Option<PathBuf>,
    /// Steps that the integration may take [default: max_steps of the experiment, or 1000000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..).map(|n| n as usize))]
    pub max_steps: Option<usize>,
    /// The robot as the controller knows it [default: ROBOT in its scene]
    #[arg(long, value_name = "FILE")]
    pub controller_robot: Option<PathBuf>,
    #[command(flatten)]
    pub model: ModelArgs,
}

#[derive(Debug, Args)]
pub struct Analyze {
    #[arg(help = robot_file())]
    pub robot: PathBuf,
    /// The motion: TOML, or samples of the joints as CSV or JSON
    #[arg(short, long, value_name = "FILE")]
    pub motion: PathBuf,
    /// Where to write torques, power, forces and moments over time, as CSV or, if it ends in .json, as JSON
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Where to write a page with tables and plots
    #[arg(long, value_name = "FILE")]
    pub html: Option<PathBuf>,
    /// Where to draw it in motion, as `straightline view` does
    #[arg(long, value_name = "FILE")]
    pub view: Option<PathBuf>,
    /// Propose feedback gains, as the table [gains] of the motion's file says or by default, and write those of LQR over time here: CSV,
    /// JSON or Parquet, as its name ends
    #[arg(long, value_name = "FILE")]
    pub gains: Option<PathBuf>,
    /// Time between instants, at most [s]
    #[arg(long, value_name = "S", default_value_t = 0.005, value_parser = interval)]
    pub interval: f64,
    /// Analyse again for each of these values of a number of the robot file: PATH=a,b,c or PATH=from:to:count
    #[arg(long, value_name = "PATH=VALUES", value_parser = parameter::parse)]
    pub sweep: Option<Sweep>,
    /// Look for the best value of a number of the robot file within this range; may be repeated
    #[arg(long, value_name = "PATH=FROM:TO", value_parser = parameter::parse_range)]
    pub optimize: Vec<ParameterRange>,
    /// What the best values make least, limits kept: energy given at the joints, rms or peak of their forces; of drives the electrical
    /// energy that they take, or their Joule heat
    #[arg(long, value_name = "WHAT", default_value = "rms", value_parser = objective, requires = "optimize")]
    pub minimize: Objective,
    #[command(flatten)]
    pub model: ModelArgs,
}

impl Simulate {
    /// How it reads the robot.
    pub fn model(&self) -> Option<&ModelArgs> {
        Some(&self.model)
    }
}

impl Analyze {
    /// How it reads the robot.
    pub fn model(&self) -> Option<&ModelArgs> {
        Some(&self.model)
    }
}

fn objective(text: &str) -> Result<Objective, String> {
    let word = Objective::WORDS.iter().find(|(word, _)| *word == text);
    word.map(|w| w.1).ok_or_else(|| "one of energy, rms, peak".to_string())
}

fn interval(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(x) if (1e-6..=1e3).contains(&x) => Ok(x),
        _ => Err("a time between 1e-6 and 1000 s".to_string()),
    }
}
