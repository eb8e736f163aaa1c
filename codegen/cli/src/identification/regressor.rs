//! The equations of a log that are linear in the robot's parameters.

use crate::log_states::{named_rates, NamedRate};
use crate::residual::torques::{evaluated, of_the_robot, StateColumns};
use std::ops::Range;
use straightline_codegen::compile::compile_programs;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::function::base_parameter_lists;
use straightline_codegen::options::Options;
use straightline_codegen::Function;
use straightline_core::algorithms::{integrate, passive_force};
use straightline_core::base_parameters::{BaseParameter, JointParameter};
use straightline_core::model::{Coulomb, JointEffects, Model};
use straightline_core::Dd;
use straightline_graph::expr::Graph;
use straightline_jit::{ExecutionMode, LoadError, Robot};
use straightline_logs::align::AlignedLog;
use straightline_logs::smooth::LowPass;
use straightline_logs::weighted::{FitBlock, FitData};

/// Rows that are evaluated at once.
const WINDOW: usize = 8192;
/// So many periods of the cut-off are lost at the ends of a segment, where smoothing lacks neighbours.
const END: f64 = 5.0;
/// Instants that are fitted of all logs together, at most.
pub const MOST_INSTANTS: usize = 20_000;
/// Smoothed numbers are taken so many times per period of the cut-off.
const PER_PERIOD: f64 = 4.0;
/// So many periods apart, smoothed noise is independent.
const INDEPENDENT: f64 = 2.0;
/// How far states are moved for derivatives along the motion \[rad or m\].
const MOVED: f64 = 2e-3;

/// A robot with the regressors of its inverse dynamics and momentum.
#[derive(Debug)]
pub struct RegressorModel {
    robot: Robot<f64>,
    graph: Graph,
    /// The robot in its scene, with its base parameters.
    pub exact: Model<Dd>,
    /// What of joints is among the parameters.
    pub kinds: Vec<JointParameter>,
    /// Names of the base parameters.
    pub names: Vec<String>,
    /// Their values by the robot file.
    pub nominal: Vec<f64>,
    /// What its rates and forces are called.
    pub rates: Vec<NamedRate>,
    /// The robot in its scene in f64.
    pub model: Model<f64>,
    /// The same with nothing of joints that is among the parameters; `None` where nothing of joints is left.
    other_effects: Option<Model<f64>>,
}

impl RegressorModel {
    /// Reads a robot file and makes the regressors. Parameters of joints are an offset, Coulomb and viscous friction, and inertias of rotors where the
    /// file has some.
    ///
    /// # Errors
    /// What the compiler says of file and scene.
    pub fn load(source: &Source, options: &Options) -> Result<RegressorModel, LoadError> {
        let functions = vec![Function::TorqueRegressor, Function::MomentumRegressor];
        let mut options = of_the_robot(options, functions.clone());
        let mut kinds = vec![JointParameter::Damping, JointParameter::Coulomb, JointParameter::Offset];
        options.scene.regressor.clone_from(&kinds);
        let mut programs = compile_programs(source, &options).map_err(LoadError::Wrong)?;
        if programs.model.bodies.iter().any(|body| body.effects.rotor_inertia.is_some()) {
            kinds.insert(0, JointParameter::RotorInertia);
            options.scene.regressor.clone_from(&kinds);
            programs = compile_programs(source, &options).map_err(LoadError::Wrong)?;
        }
        let graph = programs.programs[0].graph.clone();
        let robot = Robot::from_programs(programs, options.fma, ExecutionMode::best())?;
        let exact = robot.model().clone();
        let list = base_parameter_lists(&exact, &functions).into_iter().next();
        let (names, nominal) = list.map_or_else(Default::default, |list| (list.names, list.values));
        let model: Model<f64> = exact.cast();
        let other_effects = Some(without(model.clone(), &kinds)).filter(has_effects);
        Ok(RegressorModel {
            robot,
            graph,
            rates: named_rates(&model),
            exact,
            kinds,
            names,
            nominal,
            model,
            other_effects,
        })
    }

    /// What the compiler has to say of the robot file.
    pub fn warnings(&self) -> &Diagnostics {
        self.robot.warnings()
    }

    /// Why the robot cannot be identified by logs, if so.
    pub fn refusal(&self) -> Option<String> {
        self.nominal.is_empty().then(|| "nothing of it moves".to_string())
    }

    /// The base parameters.
    pub fn parameters(&self) -> &[BaseParameter] {
        &self.exact.base_parameters.of_forces
    }

    /// The program of the regressor of inverse dynamics.
    pub(crate) fn torque_regressor(&self) -> &Graph {
        &self.graph
    }

    /// The regressor of inverse dynamics in some states, entry after entry, of rows of coordinates with a column per base parameter.
    pub(crate) fn torque_rows(&self, [q, qd, qdd]: [&StateColumns; 3], count: usize) -> Vec<f64> {
        self.regressor(Function::TorqueRegressor, &[q, qd, qdd], count)
    }

    /// Y(q, q̇, q̈) of some states, entry after entry, of rows of coordinates with a column per base parameter.
    fn regressor(&self, function: Function, motion: &[&StateColumns], count: usize) -> Vec<f64> {
        let function = self.robot.function(function.name()).expect("the robot was loaded with it");
        evaluated(function, motion, 0..count)
    }

    /// The equations of logs: d/dt F\[Y_p\] + F\[Y(q, q̇, 0) − (∂Y_p/∂q) q̇\] times β is F\[τ\], where Y_p is the regressor of the generalized momentum and F the low-pass at
    /// the cut-off \[Hz\]. So all terms pass the same filter, none is that of a smoothed motion, and accelerations are not needed. Of logs that have them it
    /// is Y(q, q̇, q̈) β = τ.
    pub fn equations(&self, logs: &[AlignedLog], cutoff: f64) -> Vec<FitData> {
        let strides: Vec<usize> = logs.iter().map(|log| stride(log, cutoff)).collect();
        let total: usize = logs.iter().zip(&strides).map(|(log, stride)| log.times.len() / stride).sum();
        let thinned = total.div_ceil(MOST_INSTANTS).max(1);
        let of_log = |(log, stride): (&AlignedLog, usize)| {
            let blocks = log.segments.iter().map(|segment| self.of_segment(log, segment, cutoff, stride * thinned));
            let blocks = blocks.filter(|block| !block.values.is_empty()).collect();
            FitData { columns: self.nominal.len(), outputs: self.rates.len(), blocks }
        };
        logs.iter().zip(strides).map(of_log).collect()
    }

    fn of_segment(&self, log: &AlignedLog, segment: &Range<usize>, cutoff: f64, stride: usize) -> FitBlock {
        let period = log.report.period;
        let margin = match log.qdd.is_none() && period > 0.0 {
            true => (END / (cutoff * period)).ceil() as usize,
            false => 0,
        };
        let mut block = FitBlock::default();
        let core = segment.start + margin..segment.end.saturating_sub(margin);
        let size = WINDOW.max(4 * margin);
        for first in core.clone().step_by(size) {
            let last = (first + size).min(core.end);
            let picks: Vec<usize> = (first..last).filter(|i| (i - core.start).is_multiple_of(stride)).collect();
            if !picks.is_empty() {
                self.of_window(log, first - margin..(last + margin).min(segment.end), cutoff, &picks, &mut block);
            }
        }
        block
    }

    /// Appends the picked instants of a window that begins and ends as far from them as smoothing needs.
    fn of_window(&self, log: &AlignedLog, window: Range<usize>, cutoff: f64, picks: &[usize], block: &mut FitBlock) {
        let (n, start) = (window.len(), window.start);
        let cut =
            |columns: &StateColumns| -> StateColumns { columns.iter().map(|c| c[window.clone()].to_vec()).collect() };
        let (q, qd, times) = (cut(&log.q), cut(&log.qd), &log.times[window.clone()]);
        let (columns, outputs) = (self.nominal.len(), qd.len());
        let at = block.values.len();
        block.values.resize(at + picks.len() * outputs, 0.0);
        block.rows.resize((at + picks.len() * outputs) * columns, 0.0);
        let forces = self.known_forces(&q, &qd);
        let filter = LowPass { cutoff };
        let measured = |j: usize| -> Vec<f64> {
            log.tau[j][window.clone()].iter().zip(&forces[j]).map(|(tau, f)| tau - f).collect()
        };
        for j in 0..outputs {
            let values = match &log.qdd {
                Some(_) => measured(j),
                None => filter.apply(times, &measured(j)).values,
            };
            for (k, i) in picks.iter().enumerate() {
                block.values[at + k * outputs + j] = values[i - start];
            }
        }
        let places = self.parameters().iter().enumerate().flat_map(|(c, p)| p.rows.iter().map(move |row| (*row, c)));
        let mut put = |(row, c): (usize, usize), values: &[f64]| {
            for (k, i) in picks.iter().enumerate() {
                block.rows[(at + k * outputs + row) * columns + c] = values[i - start];
            }
        };
        let entry = |(row, c): (usize, usize)| (row * columns + c) * n..(row * columns + c + 1) * n;
        if let Some(qdd) = &log.qdd {
            let all = self.regressor(Function::TorqueRegressor, &[&q, &qd, &cut(qdd)], n);
            places.for_each(|place| put(place, &all[entry(place)]));
            return;
        }
        let zero = vec![vec![0.0; n]; outputs];
        let still = self.regressor(Function::TorqueRegressor, &[&q, &qd, &zero], n);
        let momentum = self.regressor(Function::MomentumRegressor, &[&q, &qd], n);
        let along = self.along_the_motion(&q, &qd);
        for place in places {
            let range = entry(place);
            let rest: Vec<f64> = still[range.clone()].iter().zip(&along[range.clone()]).map(|(a, b)| a - b).collect();
            let mut values = filter.apply(times, &rest).values;
            let rates = filter.apply(times, &momentum[range]).rates;
            values.iter_mut().zip(rates).for_each(|(x, rate)| *x += rate);
            put(place, &values);
        }
    }

    /// (∂Y_p/∂q) q̇: how the regressor of the momentum changes along the motion while velocities stay, by central differences of order four.
    fn along_the_motion(&self, q: &StateColumns, qd: &StateColumns) -> Vec<f64> {
        let n = q.first().map_or(0, Vec::len);
        let step: Vec<f64> =
            (0..n).map(|i| MOVED / qd.iter().fold(1e-3, |most: f64, c| most.max(c[i].abs()))).collect();
        let mut sum = Vec::new();
        for (moved, weight) in [(-2.0, 1.0), (-1.0, -8.0), (1.0, 8.0), (2.0, -1.0)] {
            let lengths: Vec<f64> = step.iter().map(|step| moved * step).collect();
            let at = self.moved(q, qd, &lengths);
            let found = self.regressor(Function::MomentumRegressor, &[&at, qd], n);
            sum.resize(found.len(), 0.0);
            for (sum, found) in sum.chunks_exact_mut(n).zip(found.chunks_exact(n)) {
                for i in 0..n {
                    sum[i] += weight / (12.0 * step[i]) * found[i];
                }
            }
        }
        sum
    }

    /// Configurations along velocities, each by a time of its own.
    fn moved(&self, q: &StateColumns, qd: &StateColumns, times: &[f64]) -> StateColumns {
        if q.len() == qd.len() {
            let along = |(q, qd): (&Vec<f64>, &Vec<f64>)| {
                q.iter().zip(qd.iter().zip(times)).map(|(q, (qd, time))| q + time * qd).collect()
            };
            return q.iter().zip(qd).map(along).collect();
        }
        let mut at = vec![Vec::with_capacity(times.len()); q.len()];
        for (i, time) in times.iter().enumerate() {
            let of = |columns: &StateColumns, by: f64| columns.iter().map(|c| by * c[i]).collect::<Vec<f64>>();
            let next = integrate(&self.model, &of(q, 1.0), &of(qd, *time));
            at.iter_mut().zip(next).for_each(|(column, x)| column.push(x));
        }
        at
    }

    /// What joints add without a column: springs.
    fn known_forces(&self, q: &StateColumns, qd: &StateColumns) -> StateColumns {
        let count = qd.first().map_or(0, Vec::len);
        let Some(model) = &self.other_effects else { return vec![vec![0.0; count]; qd.len()] };
        let mut forces = vec![Vec::with_capacity(count); qd.len()];
        for i in 0..count {
            let at = |columns: &StateColumns| columns.iter().map(|c| c[i]).collect::<Vec<f64>>();
            let found = passive_force(model, &at(q), &at(qd));
            forces.iter_mut().zip(found).for_each(|(column, x)| column.push(x));
        }
        forces
    }
}

/// The robot whose joints lack what these parameters stand for. Damping of joints with several coordinates is no parameter.
fn without(mut model: Model<f64>, kinds: &[JointParameter]) -> Model<f64> {
    for body in model.bodies.iter_mut().filter(|body| body.joint.kind.is_single()) {
        body.effects = kinds.iter().fold(body.effects, |effects, kind| effects.without(*kind));
    }
    model
}

/// Whether joints have friction or springs.
fn has_effects(model: &Model<f64>) -> bool {
    let has = |effects: &JointEffects<f64>| {
        effects.damping != 0.0 || effects.stiffness != 0.0 || effects.coulomb != Coulomb::Off
    };
    model.bodies.iter().any(|body| has(&body.effects))
}

/// Every so many rows are fitted.
fn stride(log: &AlignedLog, cutoff: f64) -> usize {
    match log.qdd.is_none() && log.report.period > 0.0 {
        true => ((1.0 / (PER_PERIOD * cutoff * log.report.period)) as usize).max(1),
        false => 1,
    }
}

/// Instants whose noise depends on each other.
pub fn lags() -> usize {
    (INDEPENDENT * PER_PERIOD) as usize
}
