//! A sweep that can be sampled: a robot file, a motion, and the programs of the robot with the swept numbers as inputs.
//!
//! A sample is what `straightline analyze --sweep` finds of the same value: the same robot, the same programs, the same instants.

use crate::failure;
use crate::ranges::SweptRanges;
use datafusion::error::Result;
use straightline_cli::experiment::design::Design;
use straightline_cli::experiment::parameter;
use straightline_cli::experiment::{self, Experiment};
use straightline_codegen::description::{self, Description};
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::options::Options;
use straightline_codegen::{model, scene};
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_fleets::text::CarriedText;
use straightline_simulation::analysis::{self, ForceSource};
use straightline_simulation::motion::Motion;

/// Greatest distance of instants, as `straightline analyze` has it \[s\].
const INTERVAL: f64 = 0.005;

/// A sweep, ready to be sampled.
#[derive(Debug)]
pub struct PreparedSweep {
    /// The numbers that are drawn.
    pub ranges: SweptRanges,
    /// The robot's joints.
    pub joints: Vec<String>,
    description: Description,
    options: Options,
    motion: Motion,
    /// The programs, and which of the numbers they take: torques of the joints do not depend on those of drives.
    design: Design,
    taken: Vec<usize>,
}

/// What a sample comes to.
#[derive(Clone, Debug, PartialEq)]
pub struct SampleFigures {
    /// Energy that the drives give, and that they take \[J\].
    pub energy: [f64; 2],
    /// Limits that are exceeded.
    pub exceeded: usize,
    /// Per joint the greatest |τ| and the root of the mean square \[N·m or N\].
    pub efforts: Vec<[f64; 2]>,
}

/// Programs at these values.
struct AtValues<'a>(&'a Design, Vec<f64>);

impl ForceSource for AtValues<'_> {
    fn torques(&self, q: &[f64], qd: &[f64], qdd: &[f64]) -> Vec<f64> {
        self.0.torques(q, qd, qdd, &self.1)
    }

    fn wrenches(&self, q: &[f64], qd: &[f64], qdd: &[f64]) -> Vec<[f64; 6]> {
        self.0.wrenches(q, qd, qdd, &self.1)
    }
}

/// The robot of a description; what is wrong with it is said.
fn built(description: &Description, options: &Options) -> std::result::Result<Model<Dd>, Diagnostics> {
    let mut diagnostics = Diagnostics::new();
    let model = model::build(description, &options.scene.model_options(&options.model), &mut diagnostics);
    let model =
        model.and_then(|model| scene::apply(model, &options.scene.knowing(&description.drives), &mut diagnostics));
    model.filter(|_| !diagnostics.has_errors()).ok_or(diagnostics)
}

impl PreparedSweep {
    /// Reads robot and experiment, and makes the programs. Each end of a range is a robot.
    ///
    /// # Errors
    /// What is wrong with them.
    pub fn new(robot: CarriedText<'_>, experiment: CarriedText<'_>, ranges: &str) -> Result<PreparedSweep> {
        let ranges = SweptRanges::read(ranges)?;
        let options = Options::default();
        let mut diagnostics = Diagnostics::new();
        let source = Source::from_bytes(robot.name, robot.bytes);
        let found = description::read(&source, &mut diagnostics).filter(|_| !diagnostics.has_errors());
        let Some(description) = found else { return Err(failure::said(&diagnostics)) };
        let model = built(&description, &options).map_err(|mut wrong| {
            wrong.add_source(&source);
            failure::said(&wrong)
        })?;
        let motion = motion(experiment, &model.cast())?;
        check(&ranges, &description, &options)?;
        let is_taken = |k: &usize| !parameter::is_of_drive(&description, &[], &ranges.list[*k].path);
        let taken: Vec<usize> = (0..ranges.list.len()).filter(is_taken).collect();
        let paths: Vec<&str> = taken.iter().map(|k| ranges.list[*k].path.as_str()).collect();
        let build = |description: &Description| built(description, &options).ok();
        let design = Design::new(&description, &build, &paths).map_err(|wrong| ranges.complaint(0, *wrong))?;
        let joints = model.joints().iter().map(|joint| joint.name.clone()).collect();
        Ok(PreparedSweep { ranges, joints, description, options, motion, design, taken })
    }

    /// The robot with these numbers.
    fn robot(&self, values: &[f64]) -> std::result::Result<Model<f64>, String> {
        let mut description = self.description.clone();
        for (range, value) in self.ranges.list.iter().zip(values) {
            let changed = parameter::with_drives(&description, &[], &range.path, *value);
            description = changed.map_err(|wrong| wrong.line())?.0;
        }
        built(&description, &self.options).map(|model| model.cast()).map_err(|wrong| lines(&wrong))
    }

    /// What the motion asks of the robot with these numbers.
    ///
    /// # Errors
    /// Why there is no such robot, or its figures are none.
    pub fn figures(&self, values: &[f64]) -> std::result::Result<SampleFigures, String> {
        let model = self.robot(values)?;
        let taken = self.taken.iter().map(|k| values[*k]).collect();
        let found = analysis::analyze_by(&model, &AtValues(&self.design, taken), &self.motion, INTERVAL);
        let found = found.map_err(|wrong| wrong.to_string())?;
        let sum = |of: fn(&analysis::JointFigures) -> f64| found.joints.iter().map(of).sum();
        Ok(SampleFigures {
            energy: [sum(|joint| joint.given), sum(|joint| joint.taken)],
            exceeded: found.violations.len(),
            efforts: found.joints.iter().map(|joint| [joint.peak.0, joint.rms]).collect(),
        })
    }
}

/// What is wrong, in one line.
fn lines(wrong: &Diagnostics) -> String {
    wrong.iter().map(|diagnostic| diagnostic.line()).collect::<Vec<_>>().join("; ")
}

/// Each end of each range is a number that the robot can have, so that not every sample has to find out.
fn check(ranges: &SweptRanges, description: &Description, options: &Options) -> Result<()> {
    for (k, range) in ranges.list.iter().enumerate() {
        for end in [range.ends.0, range.ends.1] {
            let changed = parameter::with_drives(description, &[], &range.path, end);
            let (changed, _) = changed.map_err(|wrong| ranges.complaint(k, *wrong))?;
            let no_robot = |wrong| ranges.complaint(k, failure::no_robot_at(range, end, &lines(&wrong)));
            built(&changed, options).map_err(no_robot)?;
        }
    }
    Ok(())
}

/// The motion of an experiment that names no other files.
fn motion(experiment: CarriedText<'_>, model: &Model<f64>) -> Result<Motion> {
    let source = Source::from_bytes(experiment.name, experiment.bytes);
    let no_file = |name: &str| Err(format!("{name}: an experiment of a sweep has its numbers in its own text"));
    let mut diagnostics = Diagnostics::new();
    match experiment::read(&source, model, model, false, &no_file, &mut diagnostics) {
        Some(Experiment { motion: Some(motion), .. }) => Ok(motion),
        Some(_) => Err(failure::no_motion(experiment.name)),
        None => Err(failure::said(&diagnostics)),
    }
}
