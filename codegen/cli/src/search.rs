//! Robots with other numbers than their files have: sweeps over one of them, and searches for the best ones.

use crate::motion::{built, built_in_full, complained, not_analysed, Analyze};
use crate::{print, CommandFailure};
use anstream::stdout;
use std::io::Write;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Mutex;
use straightline_cli::experiment::design::Design;
use straightline_cli::experiment::parameter;
use straightline_codegen::description::Description;
use straightline_codegen::diagnostic::{Diagnostic, Diagnostics, Severity};
use straightline_codegen::options::Options;
use straightline_core::model::{Body, Model};
use straightline_simulation::analysis::{self, Analysis};
use straightline_simulation::drives::further_derivatives;
use straightline_simulation::motion::Motion;
use straightline_simulation::optimize::{self, Optimum as Best, Sampled};
use straightline_simulation::simulate;

/// A search takes about a minute at so many instants.
const MOST_SEARCHED: usize = 50_000;

/// The generated programs of a robot with some of its numbers as run-time parameters.
fn design(description: &Description, options: &Options, paths: &[&str]) -> Result<Design, CommandFailure> {
    let build = |d: &Description| built_in_full(d, options, &mut Diagnostics::new());
    Design::new(description, &build, paths).map_err(complained)
}

/// Generated programs at these values of their parameters.
struct ProgramsAt<'a>(&'a Design, Vec<f64>);

/// The generated programs for parameters of which some are numbers of drives: torques of the joints do not depend on these.
struct MotionPrograms {
    design: Design,
    /// Which of all parameters the programs take.
    kept: Vec<usize>,
}

impl MotionPrograms {
    fn new(description: &Description, options: &Options, paths: &[&str]) -> Result<MotionPrograms, CommandFailure> {
        let is_kept = |k: &usize| !parameter::is_of_drive(description, &options.scene.drives, paths[*k]);
        let kept: Vec<usize> = (0..paths.len()).filter(is_kept).collect();
        let design = design(description, options, &kept.iter().map(|k| paths[*k]).collect::<Vec<_>>())?;
        Ok(MotionPrograms { design, kept })
    }

    /// The values that the programs take.
    fn kept(&self, values: &[f64]) -> Vec<f64> {
        self.kept.iter().map(|k| values[*k]).collect()
    }

    fn at(&self, values: &[f64]) -> ProgramsAt<'_> {
        ProgramsAt(&self.design, self.kept(values))
    }
}

/// A robot with other numbers in its file and in the drives of its scene.
fn changed(
    description: &Description,
    options: &Options,
    path: &str,
    value: f64,
) -> Result<(Description, Options), Box<Diagnostic>> {
    let (description, drives) = parameter::with_drives(description, &options.scene.drives, path, value)?;
    let mut options = options.clone();
    options.scene.drives = drives;
    Ok((description, options))
}

impl analysis::ForceSource for ProgramsAt<'_> {
    fn torques(&self, q: &[f64], qd: &[f64], qdd: &[f64]) -> Vec<f64> {
        self.0.torques(q, qd, qdd, &self.1)
    }

    fn wrenches(&self, q: &[f64], qd: &[f64], qdd: &[f64]) -> Vec<[f64; 6]> {
        self.0.wrenches(q, qd, qdd, &self.1)
    }
}

/// The robot file with these values of the parameters that are optimised; what is wrong is printed.
fn with(
    a: &Analyze,
    description: &Description,
    options: &Options,
    values: &[f64],
) -> Result<Model<f64>, CommandFailure> {
    let (mut description, mut options) = (description.clone(), options.clone());
    let mut diagnostics = Diagnostics::new();
    for (range, value) in a.optimize.iter().zip(values) {
        match changed(&description, &options, &range.path, *value) {
            Ok(changed) => (description, options) = changed,
            Err(complaint) => diagnostics.push(*complaint),
        }
    }
    let model = if diagnostics.has_errors() { None } else { built(&description, &options, &mut diagnostics) };
    model.ok_or_else(|| {
        print::diagnostics(&diagnostics, Severity::Error);
        CommandFailure::Input
    })
}

/// What is looked for: the best values of the numbers that are to be optimised.
struct Search<'a> {
    asked: &'a Analyze,
    description: &'a Description,
    options: &'a Options,
    motion: &'a Motion,
    model: Model<f64>,
    programs: MotionPrograms,
    /// The instants of the motion with q, q̇ and q̈.
    states: Vec<(f64, [Vec<f64>; 3])>,
    /// Greatest forces of the joints, in the order of their coordinates.
    efforts: Vec<f64>,
    ranges: Vec<(f64, f64)>,
}

/// Looks for the best values and prints them beside those of the robot file.
pub fn optimized(
    asked: &Analyze,
    description: &Description,
    options: &Options,
    motion: &Motion,
) -> Result<(), CommandFailure> {
    let search = Search::new(asked, description, options, motion)?;
    let progress = print::spinner("optimising");
    let found = search.best();
    progress.finish_and_clear();
    let found = found.map_err(|why| print::failure(format!("no optimum was found: {why}")))?;
    search.print(found)
}

impl<'a> Search<'a> {
    fn new(
        asked: &'a Analyze,
        description: &'a Description,
        options: &'a Options,
        motion: &'a Motion,
    ) -> Result<Search<'a>, CommandFailure> {
        // both ends of all ranges must be robots, so that everything between them is one
        let ends = |end: fn(&(f64, f64)) -> f64| asked.optimize.iter().map(|r| end(&r.ends)).collect::<Vec<f64>>();
        with(asked, description, options, &ends(|e| e.0))?;
        with(asked, description, options, &ends(|e| e.1))?;
        let states = analysis::states(motion, asked.interval);
        if states.len() > MOST_SEARCHED {
            let count = states.len();
            let text = format!("a search runs through the motion hundreds of times, which has {count} instants");
            let help =
                format!("at most {MOST_SEARCHED} instants are searched: a greater --interval, or a shorter motion");
            return Err(print::failure_with(text, &[help]));
        }
        let paths: Vec<&str> = asked.optimize.iter().map(|range| range.path.as_str()).collect();
        let programs = MotionPrograms::new(description, options, &paths)?;
        let model = built(description, options, &mut Diagnostics::new()).ok_or(CommandFailure::Input)?;
        if asked.minimize.is_of_drives() && (model.drives.is_empty() || further_derivatives(&model).is_none()) {
            let text =
                "what drives take cannot be minimised: the robot has no drives whose inputs follow from its motion";
            let help = ["drives are tables [[drive]] of the robot file or of a scene: --scene"];
            return Err(print::failure_with(text, &help));
        }
        let mut bodies: Vec<_> = model.independently_jointed().collect();
        bodies.sort_by_key(|b| b.joint.iv);
        let effort = |b: &&Body<f64>| if b.is_passive() { f64::INFINITY } else { b.joint.limits.effort };
        let efforts = bodies.iter().map(effort).collect();
        let ranges = asked.optimize.iter().map(|r| r.ends).collect();
        Ok(Search { asked, description, options, motion, model, programs, states, efforts, ranges })
    }

    /// Downhill along the gradient, then around what was found there.
    fn best(&self) -> Result<(Best, Best), String> {
        let of_drives = self.asked.minimize.is_of_drives();
        let downhill = match of_drives || self.programs.kept.len() < self.ranges.len() {
            true => optimize::descend(|p| self.by_difference(p), &self.ranges),
            false => optimize::descend(|p| self.by_gradient(p), &self.ranges),
        }?;
        let best = optimize::minimise_from(|p| self.of_values(p), &self.ranges, &downhill.point, 0.02)?;
        Ok((downhill, best))
    }

    fn by_gradient(&self, p: &[f64]) -> (f64, Vec<f64>) {
        let Search { states, programs, .. } = self;
        let (of_design, design) = (programs.kept(p), &programs.design);
        let tau: Vec<Vec<f64>> =
            states.iter().map(|(_, [q, qd, qdd])| design.torques(q, qd, qdd, &of_design)).collect();
        let (times, qd): (Vec<f64>, Vec<Vec<f64>>) = states.iter().map(|(t, [_, qd, _])| (*t, qd.clone())).unzip();
        let sampled = Sampled { times: &times, qd: &qd, tau: &tau, efforts: &self.efforts };
        let (cost, slopes) = self.asked.minimize.with_slopes(sampled);
        let mut gradient = vec![0.0; p.len()];
        for ((_, [q, qd, qdd]), seed) in states.iter().zip(&slopes).filter(|(_, s)| s.iter().any(|x| *x != 0.0)) {
            let more = design.gradient(q, qd, qdd, &of_design, seed);
            programs.kept.iter().zip(more).for_each(|(k, x)| gradient[*k] += x);
        }
        (cost, gradient)
    }

    /// What drives take does not follow from torques alone: differences along each number.
    fn by_difference(&self, p: &[f64]) -> (f64, Vec<f64>) {
        let slope = |k: usize| {
            let (least, most) = self.ranges[k];
            let h = 1e-4 * (most - least);
            let ends = [(p[k] - h).max(least), (p[k] + h).min(most)];
            let [low, high] = ends.map(|x| self.of_values(&[&p[..k], &[x], &p[k + 1..]].concat()));
            (high - low) / (ends[1] - ends[0])
        };
        (self.of_values(p), (0..p.len()).map(slope).collect())
    }

    /// With limits; those of drives count, too, which takes the drives of each robot.
    fn of_values(&self, values: &[f64]) -> f64 {
        let at = self.programs.at(values);
        let found = match self.model.drives.is_empty() {
            true => analysis::analyze_by(&self.model, &at, self.motion, self.asked.interval),
            false => match with(self.asked, self.description, self.options, values) {
                Ok(model) => analysis::analyze_by(&model, &at, self.motion, self.asked.interval),
                Err(_) => return f64::INFINITY,
            },
        };
        found.map_or(f64::INFINITY, |found| self.asked.minimize.with_limits(&found, &self.efforts))
    }

    fn print(&self, (downhill, best): (Best, Best)) -> Result<(), CommandFailure> {
        let Analyze { optimize: asked, minimize, interval, .. } = self.asked;
        let as_written = analysis::analyze(&self.model, self.motion, *interval).map_err(|f| not_analysed(&f))?;
        let as_written = minimize.with_limits(&as_written, &self.efforts);
        if !as_written.is_finite() {
            let text = format!("what is to be least is {as_written} of the robot file itself, not a finite number");
            return Err(print::failure(text));
        }
        let mut out = stdout().lock();
        let (steps, analyses) = (downhill.evaluations, best.evaluations);
        writeln!(out, "\nbest values after {steps} evaluations along the gradient and {analyses} analyses:")?;
        for (range, value) in asked.iter().zip(&best.point) {
            writeln!(out, "  {} = {value:.6} (from {} to {})", range.path, range.ends.0, range.ends.1)?;
        }
        let word = optimize::Objective::WORDS.iter().find(|w| w.1 == *minimize).map_or("", |w| w.0);
        writeln!(out, "{word} {:.6}, as the robot file is {as_written:.6}", best.cost)?;
        Ok(())
    }
}

/// One value of a sweep, with what it leads to.
pub type Swept = (f64, Analysis);

/// The motion of robots with other numbers, in parallel.
pub fn swept(
    description: &Description,
    options: &Options,
    sweep: &parameter::Sweep,
    motion: &Motion,
    interval: f64,
) -> Result<Vec<Swept>, CommandFailure> {
    let mut models = Vec::new();
    for &value in &sweep.values {
        let (changed, in_scene) = changed(description, options, &sweep.path, value).map_err(complained)?;
        let mut diagnostics = Diagnostics::new();
        let Some(model) = built(&changed, &in_scene, &mut diagnostics) else {
            print::error(&format!("{} = {value}:", sweep.path));
            print::diagnostics(&diagnostics, Severity::Error);
            return Err(CommandFailure::Input);
        };
        models.push((value, model));
    }
    let programs = MotionPrograms::new(description, options, &[&sweep.path])?;
    let bar = print::bar("sweeping", models.len() as u64);
    let (next, results) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let workers = std::thread::available_parallelism().map_or(1, usize::from).min(models.len());
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let Some((value, model)) = models.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let found = analysis::analyze_by(model, &programs.at(&[*value]), motion, interval);
                    results.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push((*value, found));
                    bar.inc(1);
                }
            });
        }
    });
    bar.finish_and_clear();
    let mut results = results.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    let place = |value: f64| sweep.values.iter().position(|v| *v == value);
    results.sort_by_key(|(value, _)| place(*value));
    let sound = |(value, found): (f64, Result<Analysis, simulate::Failure>)| {
        found.map(|found| (value, found)).map_err(|failure| {
            print::error(&format!("{} = {value}:", sweep.path));
            not_analysed(&failure)
        })
    };
    results.into_iter().map(sound).collect()
}
