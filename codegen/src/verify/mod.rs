//! The program against the second author, on random states.
//!
//! The program is run operation by operation in its own arithmetic, as rustc compiles it, or by whatever else runs programs ([`verify_by`]). The truth is the handbook
//! chapter's formulation in double-double, from a second reading of the same robot file: it shares with the program the
//! parsed file and nothing else.
//!
//! An error is divided by the natural scale of its output: how large the terms are that the truth is made of, which the truth says itself
//! ([`Magnitude`](straightline_core::magnitude::Magnitude)). So 1e-16 is a rounding, whatever cancels, and a wrong formula is anything up to 1.

use crate::diagnostic::Source;
use crate::emit::{fused, Generated};
use crate::equations::Robot;
use crate::function::truth::{Chapter, ClosedLoops, Effect};
use crate::function::{Function, Quantity};
use crate::model;
use crate::model::states::{drives::of_drives, of_port, InputState};
use crate::options::Options;
use crate::program::{program, TracedProgram};
use crate::scene::{Gravity, Parameter, Scene};
use std::collections::BTreeMap;
use straightline_core::model::Model;
use straightline_core::random::Random;
use straightline_core::reference::CentreOfMassTree;
use straightline_core::{trig, Dd};
use straightline_graph::expr::{evaluate, Graph, Port};
use straightline_graph::{element_of, Scalar};

mod loops;
mod oscillation;
mod reading;
pub mod reference_input;
mod whole;

pub use reading::SecondReading;
use reading::{motion, second_reading};
use whole::Coordinates;

/// Worst error of a function.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Worst {
    /// The error, divided by the natural scale.
    pub error: f64,
    /// In which state, from 0.
    pub state: u32,
    /// In which output, such as `tau[3]`.
    pub output: String,
    /// The inputs of that state.
    pub inputs: BTreeMap<String, Vec<f64>>,
}

/// What came out.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Verification {
    /// The robot's name.
    pub robot: String,
    /// The scalar type of the program.
    pub scalar: &'static str,
    /// Number of states.
    pub states: u32,
    /// The seed that they were made from.
    pub seed: u64,
    /// The greatest error that passes.
    pub bound: f64,
    /// The worst error of every function.
    pub functions: BTreeMap<&'static str, Worst>,
    /// Functions that the reference has no formulation of: tests of their own hold them to laws of physics.
    pub left_out: Vec<&'static str>,
}

impl Verification {
    /// Why it is no proof: nothing was compared, or an error exceeds the bound.
    pub fn failure(&self) -> Option<String> {
        if self.functions.is_empty() {
            return Some(match self.left_out.is_empty() {
                true => "no function was compared: the robot has none of those that are asked for".to_string(),
                false => {
                    let all = self.left_out.join(", ");
                    format!("no function was compared: the reference has no formulation of {all}")
                }
            });
        }
        self.excess()
    }

    /// What is said where an error exceeds the bound.
    pub fn excess(&self) -> Option<String> {
        let is_within = self.functions.values().all(|worst| worst.error <= self.bound);
        (!is_within).then(|| format!("an error exceeds the bound {:.1e}", self.bound))
    }

    /// Whether something was compared, and all errors are within the bound.
    pub fn passes(&self) -> bool {
        self.failure().is_none()
    }
}

/// The greatest scaled error that passes: 2^11 roundings. A few are usual; the smallest wrong term that matters is far above.
pub fn bound(scalar: Scalar) -> f64 {
    2048.0 * scalar.unit()
}

/// What gives the results of a program, one after the other, for the numbers that it takes, one after the other.
pub type ProgramRun<'p> = Box<dyn Fn(&[f64]) -> Vec<f64> + 'p>;

/// Compares the programs of a robot with the reference, which reads `source` on its own. `tick` is called after every
/// state.
///
/// # Errors
/// The reference does not understand the file as the compiler did.
pub fn verify(
    source: &Source,
    generated: &Generated,
    options: &Options,
    (states, seed): (u32, u64),
    tick: impl FnMut(),
) -> Result<Verification, String> {
    let robot = (&generated.model, &generated.frames[..]);
    verify_by(source, robot, options, (states, seed), &|program| interpreted(program, options), tick)
}

/// The same of a robot in its scene with its frames, where something else runs its programs.
///
/// # Errors
/// As [`verify`].
pub fn verify_by(
    source: &Source,
    (model, frames): (&Model<Dd>, &[String]),
    options: &Options,
    (states, seed): (u32, u64),
    runner: &dyn for<'p> Fn(&'p TracedProgram) -> ProgramRun<'p>,
    mut tick: impl FnMut(),
) -> Result<Verification, String> {
    let options = &options.knowing(source);
    let scene = &options.scene.resolved(model);
    let options = &Options { scene: scene.clone(), model: scene.model_options(&options.model), ..options.clone() };
    let case = Case::new(source, model, frames, options)?;
    let mut random = Random(seed);
    let wanted: Vec<Function> = Function::wanted(&options.functions, model)
        .into_iter()
        .filter(|f| !f.is_per_frame() || !scene.frames_of(*f, frames).is_empty())
        .collect();
    // any state tells of which functions there is a truth
    let any = case.at(false, &mut Random(seed))?;
    let (mut programs, mut left_out) = (Vec::new(), Vec::new());
    for function in wanted {
        match any.truth(&case, function)? {
            Some(_) => programs.push(program(&case.robot, frames, function, options)),
            None => left_out.push(function.name()),
        }
    }
    let mut worst: BTreeMap<&'static str, Worst> = BTreeMap::new();
    let runs: Vec<ProgramRun<'_>> = programs.iter().map(runner).collect();
    for state in 0..states {
        let at = case.at(state % 2 == 1, &mut random)?;
        for (TracedProgram { function, graph, .. }, run) in programs.iter().zip(&runs) {
            let given: Vec<f64> = graph.inputs.iter().flat_map(|port| &at.inputs[&port.name]).copied().collect();
            let values = run(&given);
            let truth = at.truth(&case, *function)?.expect("whether there is a truth does not depend on the state");
            assert_eq!(values.len(), truth.len(), "{}", function.name());
            let errors = values.iter().zip(&truth).map(|(v, (e, s))| scaled(*v, *e, *s)).enumerate();
            let (k, error) = errors.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0));
            if worst.get(function.name()).is_none_or(|w| error > w.error) {
                let output = element_of(&graph.outputs, k);
                let inputs = graph.inputs.iter().map(|p| (p.name.clone(), at.inputs[&p.name].clone())).collect();
                worst.insert(function.name(), Worst { error, state, output, inputs });
            }
        }
        tick();
    }
    let (robot, scalar) = (model.name.clone(), options.scalar);
    Ok(Verification { robot, scalar: scalar.name(), states, seed, bound: bound(scalar), functions: worst, left_out })
}

/// A robot in a scene, and the whole robot as the reference sees it.
struct Case<'a> {
    model: &'a Model<Dd>,
    frames: &'a [String],
    options: &'a Options,
    robot: Robot,
    coordinates: Coordinates,
    tree: CentreOfMassTree<Dd>,
    effects: Vec<Effect>,
    loops: Option<ClosedLoops>,
    parameters: Vec<(Parameter, Graph)>,
}

/// It at a state.
struct At<'a> {
    /// As programs take it.
    inputs: InputState<f64>,
    /// With the numbers that drives have there.
    model: Model<Dd>,
    chapter: Chapter<'a>,
}

impl<'a> Case<'a> {
    fn new(
        source: &Source,
        model: &'a Model<Dd>,
        frames: &'a [String],
        options: &'a Options,
    ) -> Result<Case<'a>, String> {
        let scene = &options.scene;
        let whole = model::load(source, &options.model).0.ok_or("the file holds no robot")?;
        let coordinates = Coordinates::new(scene, model, &whole)?;
        let (mut tree, mut effects, loops) = second_reading(source, &whole, options)?;
        whole::hold(scene, &whole, &mut tree, &mut effects)?;
        let robot = Robot::new(model.clone());
        let parameters = whole::parameter_programs(&robot, options);
        Ok(Case { model, frames, options, robot, coordinates, tree, effects, loops, parameters })
    }

    /// What is asked of frames by the functions that are asked for.
    fn tasks(&self) -> Vec<Port> {
        let mut ports: Vec<Port> = Vec::new();
        for function in &self.options.functions {
            let frames = self.options.scene.frames_of(*function, self.frames).len();
            let asked = Quantity::of_tasks().filter(|task| function.spec().inputs.contains(task));
            for port in asked.map(|task| task.port(self.model, frames)) {
                if ports.iter().all(|other| other.name != port.name) {
                    ports.push(port);
                }
            }
        }
        ports
    }

    /// At a random state: at about rest, or fast.
    fn at(&self, fast: bool, random: &mut Random) -> Result<At<'_>, String> {
        let (options, scene) = (self.options, &self.options.scene);
        let (mut model, mut tree) = (self.model.clone(), self.tree.clone());
        let mut inputs = InputState::new();
        let gravity = (scene.gravity == Gravity::Input).then_some(Quantity::Gravity);
        let ports = motion().chain(gravity).map(|quantity| quantity.port(&model, 0));
        for port in ports.chain(self.tasks()).collect::<Vec<_>>() {
            let values = of_port(&model, &port, fast, random);
            inputs.insert(port.name, values);
        }
        set_zeros(scene, &model, &mut inputs);
        whole::random_drives(&self.parameters, options.scalar, (&mut inputs, &mut model), random);
        let [q, qd] = [Quantity::Configuration, Quantity::Velocity].map(|x| &inputs[&x.name()]);
        let drives = [Quantity::DriveState, Quantity::DriveInput].into_iter().zip(of_drives(&model, q, qd, random));
        inputs.extend(drives.map(|(quantity, x)| (quantity.name(), x)).collect::<Vec<_>>());
        for x in inputs.values_mut().flatten() {
            *x = options.scalar.rounded(*x);
        }
        whole::random_inputs(scene, &self.parameters, options.scalar, (&mut inputs, &mut tree), random)?;
        let chapter = Chapter::new(&tree, &self.effects, self.coordinates.expand(&inputs));
        let chapter = chapter.with_moving(&self.coordinates.v).with_loops(self.loops.as_ref());
        Ok(At { inputs, model, chapter })
    }
}

impl At<'_> {
    /// What a function should give in the scene, with natural scales; `None` where the reference does not know.
    fn truth(&self, case: &Case, function: Function) -> Result<Option<Vec<(Dd, f64)>>, String> {
        let (scene, model) = (&case.options.scene, &self.model);
        let names = scene.frames_of(function, case.frames);
        let chapter = self.chapter.clone().with_frames(names)?.with_rows(scene.rows_of(function));
        let mut chapter = chapter.with_base_parameters(model);
        if case.coordinates.are_all() {
            chapter = chapter.with_drives(model);
        }
        let Some(results) = function.truth(&chapter) else { return Ok(None) };
        let scales = function.scales(&results);
        let mut results: Vec<(Dd, f64)> = results.iter().map(|x| x.value).zip(scales).collect();
        let wanted = scene.select(function, model, names.len()).0;
        for indices in case.coordinates.results(function, names.len()).into_iter().chain([wanted]) {
            results = indices.iter().map(|k| results[*k]).collect();
        }
        Ok(Some(results))
    }
}

/// Zeros where the scene knows of them.
fn set_zeros(scene: &Scene, model: &Model<Dd>, inputs: &mut InputState<f64>) {
    for (quantity, is_zero) in [(Quantity::Velocity, scene.zero.qd), (Quantity::Acceleration, scene.zero.qdd)] {
        let rates = inputs.get_mut(&quantity.name()).expect("every state has rates");
        if is_zero {
            rates.fill(0.0);
        }
        for joint in model.independent_joints() {
            if scene.zero.joints_at_rest.contains(&joint.name) {
                rates[joint.iv..joint.iv + joint.kind.nv()].fill(0.0);
            }
        }
    }
}

/// |value − expected| / scale; infinite where there is no sensible answer.
fn scaled(value: f64, expected: Dd, scale: f64) -> f64 {
    let error = (Dd::from(value) - expected).to_f64().abs();
    if error == 0.0 {
        return 0.0;
    }
    let scaled = error / scale;
    if scaled.is_nan() {
        f64::INFINITY
    } else {
        scaled
    }
}

/// A program in its own arithmetic, operation by operation; one that fuses, as on a machine with the instruction.
pub fn interpreted<'p>(program: &'p TracedProgram, options: &Options) -> ProgramRun<'p> {
    let TracedProgram { graph, schedule, .. } = program;
    match (options.scalar, options.fma) {
        (Scalar::F64, false) => Box::new(|inputs| evaluate::<f64>(graph, inputs)),
        (Scalar::F64, true) => Box::new(|inputs| {
            let sin_cos = |x| trig::sin_cos_of_sum_fused_f64(x, f64::mul_add);
            fused::evaluate((graph, schedule), inputs, f64::mul_add, sin_cos)
        }),
        (Scalar::F32, fma) => Box::new(move |inputs| {
            let inputs: Vec<f32> = inputs.iter().map(|x| *x as f32).collect();
            let sin_cos = |x| trig::sin_cos_of_sum_fused_f32(x, f32::mul_add);
            let results = match fma {
                false => evaluate(graph, &inputs),
                true => fused::evaluate((graph, schedule), &inputs, f32::mul_add, sin_cos),
            };
            results.into_iter().map(f64::from).collect()
        }),
    }
}
