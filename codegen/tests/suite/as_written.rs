//! The judge of robots as they are written: every function, in f64 and f32, beside its plain program.

use super::written::{Shape, Style, Written};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Mutex;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::{evaluate, Graph};
use straightline_codegen::function::Quantity::{
    self, Acceleration, Configuration, Force, SecondConfiguration, TimeStep, Velocity,
};
use straightline_codegen::function::{Divisor, Family};
use straightline_codegen::model::singular::{singular_joints, Inertia};
use straightline_codegen::model::{self, ModelOptions};
use straightline_codegen::options::{Optimisations, Options};
use straightline_codegen::program::{checked, optimised};
use straightline_codegen::verify::SecondReading;
use straightline_codegen::{Function, Scalar};
use straightline_core::model::{JointKind, Model};
use straightline_core::{Dd, Real};

use super::written::Random;

/// A program may lose so many times what the plain one loses.
const TIMES: f64 = 20.0;
/// The plain program loses an ulp of natural scale, even where the few states that are tried show less.
const ULP: f64 = 1.0;
/// So many frames robots have at most.
const MOST_FRAMES: usize = 32;
/// The same of the equations themselves, run in double-double.
const EQUATIONS: f64 = 1e-25;

/// A robot to be judged.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    pub style: Style,
    pub shape: Shape,
    pub seed: u64,
    /// In one format, and of the functions that share a search for forms in one group, by the number that this is of the
    /// list; otherwise all.
    pub part: Option<usize>,
}

impl Case {
    /// All functions in both formats.
    pub fn new(style: Style, shape: Shape, seed: u64) -> Case {
        Case { style, shape, seed, part: None }
    }

    /// Of each robot a part: what takes time are the searches for forms, three in each format, and many robots find more than many
    /// functions of a few.
    pub fn in_turn(cases: Vec<Case>) -> Vec<Case> {
        cases.into_iter().enumerate().map(|(k, case)| Case { part: Some(k), ..case }).collect()
    }

    fn wants(&self, scalar: Scalar, function: Function) -> bool {
        use Function::{BiasForce, ForwardDynamics, GravityForce, InverseDynamics, MassMatrix, VelocityForce};
        let derivative = function.spec().family.is_of_blocks();
        let group = match function {
            InverseDynamics => Some(0),
            MassMatrix => Some(1),
            BiasForce | GravityForce | VelocityForce => Some(2),
            // which takes two of the searches
            ForwardDynamics => Some(3),
            _ => derivative.then(|| if function.spec().solves { 3 } else { 1 }),
        };
        self.part.is_none_or(|k| {
            let in_turn = group.is_none_or(|group| [0, 1, 2, 0, 1, 2, 3][k / 2 % 7] == group);
            // derivatives are most functions by now, and take longest: a third of them at a time
            let is_due = !derivative || is_of_part(function, k / 14, 3);
            in_turn && is_due && scalar == [Scalar::F64, Scalar::F32][k & 1]
        })
    }

    fn judge(&self) -> Outcome {
        judge(&File::from(&self.robot()), &|scalar, function| self.wants(scalar, function))
    }

    pub fn robot(&self) -> Written {
        Written::new(self.style, self.shape, self.seed)
    }
}

/// A function that loses too much.
#[derive(Clone, Debug)]
pub struct Failure {
    pub scalar: Scalar,
    pub function: Function,
    /// Which result, and at which state.
    pub result: usize,
    pub state: Vec<Vec<f64>>,
    /// What it loses, what the plain program does, against natural scale; of the equations in double-double or of the program.
    pub error: f64,
    pub plain: f64,
    pub of_equations: bool,
}

/// What came of a robot.
pub enum Outcome {
    Refused(String),
    /// The failures, and how many functions the compiler refuses in a format that has no digit for them.
    Judged(Vec<Failure>, usize),
}

/// A state: the numbers of what functions of robots without drives take. Numbers that f32 holds, so that all formats are
/// asked the same; a quaternion is of length one.
pub struct State(BTreeMap<Quantity, Vec<Dd>>);

impl State {
    /// Small or any angles, slow or fast.
    pub fn new(model: &Model<Dd>, random: &mut Random, kind: usize) -> State {
        let nv = model.nv();
        let (near, fast) = (kind & 1 == 0, kind & 2 != 0);
        let mut state: [Vec<f64>; 4] = [vec![0.0; model.nq()], vec![0.0; nv], vec![0.0; nv], vec![0.0; nv]];
        let mut quaternion = None;
        for joint in model.free_joints() {
            match joint.kind {
                JointKind::Floating => {
                    quaternion = Some(joint.iq + 3);
                    (0..3).for_each(|k| state[0][joint.iq + k] = random.between(-1.0, 1.0));
                    (3..7).for_each(|k| state[0][joint.iq + k] = random.sign() * random.between(0.2, 1.0));
                }
                _ if near => state[0][joint.iq] = random.between(-1e-3, 1e-3),
                _ => state[0][joint.iq] = random.between(-3.1, 3.1),
            }
            let most = joint.limits.velocity;
            let rate = if most.is_finite() { most.min(100.0) } else { 10.0 };
            let sizes = if fast { [rate, 10.0, 20.0] } else { [0.02, 0.1, 20.0] };
            for (of_kind, size) in state[1..].iter_mut().zip(sizes) {
                of_kind[joint.iv..joint.iv + joint.kind.nv()].fill_with(|| random.between(-size, size));
            }
        }
        if kind == 4 {
            // at rest in the zero configuration, as robots are first tried
            state[0].iter_mut().for_each(|x| *x = 0.0);
            state[1].fill(0.0);
            state[2].fill(0.0);
            if let Some(at) = quaternion {
                state[0][at + 3] = 1.0;
            }
        }
        let mut state = state.map(|x| x.into_iter().map(|x| Dd::from(f64::from(x as f32))).collect::<Vec<Dd>>());
        if let Some(at) = quaternion {
            // functions take its length for granted
            let norm = state[0][at..at + 4].iter().fold(Dd::ZERO, |sum, x| sum + *x * *x).sqrt();
            state[0][at..at + 4].iter_mut().for_each(|x| *x /= norm);
        }
        let [q, qd, qdd, tau] = state;
        let mut named = BTreeMap::from([(Configuration, q), (Velocity, qd), (Acceleration, qdd), (Force, tau)]);
        let mut own = Random(random.0);
        for further in Quantity::of_velocities() {
            let numbers = || (0..nv).map(|_| Dd::from(f64::from(own.between(-1.0, 1.0) as f32))).collect();
            named.entry(further).or_insert_with(numbers);
        }
        // of as many frames as a robot may be asked of
        for task in Quantity::of_tasks() {
            let numbers = (0..6 * MOST_FRAMES).map(|_| Dd::from(f64::from(own.between(0.1, 1.0) as f32)));
            named.insert(task, numbers.collect());
        }
        // a turn and a step from there
        let q1 =
            straightline_core::algorithms::integrate(model, &named[&Configuration], &named[&Quantity::Displacement]);
        // in all formats, but for a quaternion of length one
        let is_turn = |k: usize| quaternion.is_some_and(|at| (at..at + 4).contains(&k));
        let short = |(k, x): (usize, Dd)| if is_turn(k) { x } else { Dd::from(f64::from(x.to_f64() as f32)) };
        let q1 = q1.into_iter().enumerate().map(short).collect();
        named.insert(SecondConfiguration, q1);
        named.insert(TimeStep, vec![Dd::from(f64::from(own.between(1e-3, 1e-2) as f32))]);
        State(named)
    }

    /// The numbers of an input.
    pub fn group(&self, name: &str) -> &[Dd] {
        let quantity = Quantity::named(name).and_then(|quantity| self.0.get(&quantity));
        quantity.expect("functions of robots without drives take no other quantities")
    }

    /// The inputs of a program.
    pub fn inputs<T: Real>(&self, graph: &Graph) -> Vec<T> {
        graph.inputs.iter().flat_map(|port| &self.group(&port.name)[..port.len()]).map(|x| T::constant(*x)).collect()
    }
}

/// The scaled errors of a program: the worst one, and of which result.
fn worst<T: Real>(
    graph: &Graph,
    state: &State,
    (values, scales): &(Vec<Dd>, Vec<f64>),
    wide: fn(T) -> Dd,
) -> (f64, usize) {
    let results = evaluate::<T>(graph, &state.inputs(graph));
    assert_eq!(results.len(), values.len());
    let mut worst = (0.0, 0);
    for (k, ((x, truth), scale)) in results.into_iter().zip(values).zip(scales).enumerate() {
        let error = (wide(x) - *truth).to_f64().abs();
        let scaled = if error == 0.0 { 0.0 } else { error / scale };
        let scaled = if scaled.is_nan() { f64::INFINITY } else { scaled };
        if scaled > worst.0 {
            worst = (scaled, k);
        }
    }
    worst
}

/// The worst error of a program at a state, and of which result.
type Judge = dyn Fn(&Graph, &State, &(Vec<Dd>, Vec<f64>)) -> (f64, usize);

/// The worst scaled error of a program over some states, in double-double and in the scalar that it is made for.
fn losses(graph: &Graph, scalar: Scalar, states: &[State], truths: &[(Vec<Dd>, Vec<f64>)]) -> [f64; 2] {
    let most = |error: &Judge| states.iter().zip(truths).map(|(s, t)| error(graph, s, t).0).fold(0.0, f64::max);
    let in_scalar = match scalar {
        Scalar::F64 => most(&|g, s, t| worst::<f64>(g, s, t, Dd::from)),
        Scalar::F32 => most(&|g, s, t| worst::<f32>(g, s, t, |x| Dd::from(f64::from(x)))),
    };
    [most(&|g, s, t| worst::<Dd>(g, s, t, |x| x)), in_scalar]
}

/// What a function loses with one optimisation more at each step, in words, a line each.
pub fn by_steps(file: &File, scalar: Scalar, function: Function) -> String {
    let options = Options { scalar, ..file.options() };
    let Some(model) = model::load(&file.source, &options.model).0 else { return String::new() };
    let Ok(second) = SecondReading::new(&file.source, &model, &options) else { return String::new() };
    let mut random = Random(99);
    let states: Vec<State> = (0..6).map(|kind| State::new(&model, &mut random, kind)).collect();
    let of_state = |s: &State| second.outputs(function, &file.frames, s.0.clone());
    let Ok(truths) = states.iter().map(of_state).collect::<Result<Vec<_>, _>>() else { return String::new() };
    let loaded = Robot::new(model);
    let mut steps = vec![("the equations as they are", Optimisations::default())];
    steps.extend(options.optimisations().steps());
    let mut text = String::new();
    for (step, optimisations) in steps {
        let graph = optimised(&loaded, &file.frames, function, &options, optimisations);
        let [equations, program] = losses(&graph, scalar, &states, &truths);
        let _ = writeln!(text, "  {step}: equations {equations:.1e}, {} {program:.1e}", scalar.name());
    }
    text
}

/// A robot file, and how it is read.
pub struct File {
    pub source: Source,
    pub floating: bool,
    /// Of functions that answer per frame.
    pub frames: Vec<String>,
}

impl From<&Written> for File {
    fn from(robot: &Written) -> File {
        let source = Source::new(robot.file_name(), robot.text());
        File { source, floating: robot.floating, frames: robot.tips() }
    }
}

impl File {
    /// How the compiler reads it.
    pub fn options(&self) -> Options {
        Options {
            model: ModelOptions { floating_base: self.floating, ..ModelOptions::default() },
            ..Options::default()
        }
    }
}

/// Whether a function is of the part whose turn it is, of so many parts of all functions.
pub fn is_of_part(function: Function, turn: usize, parts: usize) -> bool {
    let place = Function::known().position(|f| f == function);
    place.is_some_and(|place| place % parts == turn % parts)
}

/// Judges a robot, of the functions and formats that are wanted.
pub fn judge(file: &File, wanted: &dyn Fn(Scalar, Function) -> bool) -> Outcome {
    let (File { source, frames, .. }, options) = (file, file.options());
    let (model, diagnostics) = model::load(source, &options.model);
    let Some(model) = model.filter(|_| !diagnostics.has_errors()) else {
        return Outcome::Refused(diagnostics.render());
    };
    let second = SecondReading::new(source, &model, &options);
    let second = second.unwrap_or_else(|why| panic!("what the compiler takes the second author refuses: {why}"));
    // without a scene no body is an input, and what forces are of the links' parameters is a law, which `regressors::` asks
    let of_bodies = |f: &Function| {
        let of_scene = f.is_of_scene_parameters() || f.spec().inputs.contains(&Quantity::LinkParameters);
        // nor is anything asked of no frames
        let of_no_frames = frames.is_empty() && f.spec().family == Family::Tasks;
        f.is_of(&model) && !f.spec().family.is_of_drives() && !of_scene && !of_no_frames
    };
    // that is four times the derivatives of forward dynamics, which are judged, in one program
    let is_repeated = |f: &Function| *f == Function::StepDerivativesRk4;
    let mut functions: Vec<Function> = Function::known().filter(|f| of_bodies(f) && !is_repeated(f)).collect();
    if !singular_joints(&model, Inertia::OfLinks).is_empty() {
        functions.retain(|f| !f.spec().solves && f.spec().divisor != Divisor::MassOfEach);
    }
    let mut random = Random(99);
    let states: Vec<State> = (0..6).map(|kind| State::new(&model, &mut random, kind)).collect();
    let loaded = Robot::new(model);
    let (mut failures, mut refused) = (Vec::new(), 0);
    for function in functions {
        let scalars: Vec<Scalar> =
            [Scalar::F64, Scalar::F32].into_iter().filter(|scalar| wanted(*scalar, function)).collect();
        if scalars.is_empty() {
            continue;
        }
        let truths: Vec<(Vec<Dd>, Vec<f64>)> = states
            .iter()
            .map(|s| second.outputs(function, frames, s.0.clone()).expect("a reading has its tips"))
            .collect();
        for scalar in scalars {
            let options = Options { scalar, ..options.clone() };
            let full = match checked(&loaded, frames, function, &options) {
                Ok(program) => program.graph,
                Err(wrong) if wrong.beyond_digits(&loaded.model, scalar).is_some() => {
                    refused += 1;
                    continue;
                }
                Err(wrong) => panic!("{} in {}: {wrong}", source.path(), scalar.name()),
            };
            let unfolded = Optimisations::default();
            let plain = optimised(&loaded, frames, function, &options, unfolded);
            // constants in double-double, too
            let exact = optimised(&loaded, frames, function, &options, Optimisations { folding: true, ..unfolded });
            let mut fail = |plain: &Graph, of_equations: bool, least: f64, error: &Judge| {
                let all = |graph: &Graph| -> Vec<(f64, usize)> {
                    states.iter().zip(&truths).map(|(s, t)| error(graph, s, t)).collect()
                };
                let plain = all(plain).into_iter().fold(0.0, |m: f64, (e, _)| m.max(e));
                let errors = all(&full);
                let worst = (0..errors.len()).max_by(|a, b| errors[*a].0.total_cmp(&errors[*b].0));
                let at = worst.expect("there are states");
                let (error, result) = errors[at];
                if error > TIMES * plain.max(least) {
                    let state = states[at].0.values().map(|x| x.iter().map(|x| x.to_f64()).collect()).collect();
                    failures.push(Failure { scalar, function, result, state, error, plain, of_equations });
                }
            };
            fail(&exact, true, EQUATIONS, &|g, s, t| worst::<Dd>(g, s, t, |x| x));
            match scalar {
                Scalar::F64 => fail(&plain, false, ULP * f64::EPSILON, &|g, s, t| worst::<f64>(g, s, t, Dd::from)),
                Scalar::F32 => fail(&plain, false, ULP * f64::from(f32::EPSILON), &|g, s, t| {
                    worst::<f32>(g, s, t, |x| Dd::from(f64::from(x)))
                }),
            }
        }
    }
    Outcome::Judged(failures, refused)
}

/// What happened to a list of robots.
#[derive(Default)]
pub struct Tally {
    pub refused: usize,
    pub judged: usize,
    /// Functions of those that were judged.
    pub refused_functions: usize,
    /// Those that failed, with all that they failed by, or with the words of a panic.
    pub failed: Vec<(Case, Result<Vec<Failure>, String>)>,
}

/// Judges robots, two at a time; `tell` is called with each failure.
pub fn judge_all(cases: &[Case], tell: impl Fn(&Case, &Result<Vec<Failure>, String>) + Sync) -> Tally {
    let (next, tally) = (AtomicUsize::new(0), Mutex::new(Tally::default()));
    let work = || {
        while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
            let outcome = catch_unwind(AssertUnwindSafe(|| case.judge()));
            let words = |panic: Box<dyn std::any::Any + Send>| {
                let text = panic.downcast_ref::<String>().cloned();
                text.or(panic.downcast_ref::<&str>().map(|s| s.to_string())).unwrap_or_default()
            };
            let outcome = match outcome {
                Ok(Outcome::Refused(why)) => {
                    if std::env::var_os("REFUSED").is_some() {
                        println!("REFUSED {case:?}\n{why}");
                    }
                    None
                }
                Ok(Outcome::Judged(failures, refused)) => Some(Ok((failures, refused))),
                Err(panic) => Some(Err(words(panic))),
            };
            let mut tally = tally.lock().expect("no thread panics with the tally");
            match outcome {
                None => tally.refused += 1,
                Some(outcome) => {
                    tally.judged += 1;
                    let outcome = outcome.map(|(failures, refused)| {
                        tally.refused_functions += refused;
                        failures
                    });
                    if !matches!(&outcome, Ok(failures) if failures.is_empty()) {
                        tell(case, &outcome);
                        tally.failed.push((*case, outcome));
                    }
                }
            }
        }
    };
    std::thread::scope(|scope| {
        scope.spawn(work);
        scope.spawn(work);
    });
    tally.into_inner().expect("no thread panics with the tally")
}

/// A failure in a few words.
pub fn in_words(failure: &Failure) -> String {
    let Failure { scalar, function, result, error, plain, of_equations, .. } = failure;
    let of = if *of_equations { " equations" } else { "" };
    format!("{}{of} {}[{result}] {error:.1e} plain {plain:.1e}", scalar.name(), function.name())
}

/// Judges robots and prints those that fail, the first of each kind of failure shrunk.
///
/// # Panics
/// If any fails.
pub fn survey(cases: Vec<Case>) {
    let shrinks = std::env::var("SHRINK").map_or(0, |n| n.parse().expect("SHRINK is a number"));
    let tally = judge_all(&cases, |case, outcome| match outcome {
        Ok(failures) => {
            let words: Vec<String> = failures.iter().map(in_words).collect();
            println!("FAIL {} {:?}: {}", case.style.name(), case, words.join("; "));
        }
        Err(panic) => println!("PANIC {} {:?}: {panic}", case.style.name(), case),
    });
    for (case, outcome) in tally.failed.iter().take(shrinks) {
        println!("{}", shrunk(case, outcome));
    }
    let worst = |(_, outcome): &&(Case, Result<Vec<Failure>, String>)| outcome.is_err();
    println!(
        "{} robots: {} refused, {} judged ({} functions of them refused), {} failed, {} of them by a panic",
        cases.len(),
        tally.refused,
        tally.judged,
        tally.refused_functions,
        tally.failed.len(),
        tally.failed.iter().filter(worst).count()
    );
    assert!(tally.failed.is_empty(), "{} robots of {} lose digits", tally.failed.len(), cases.len());
}

/// The least robot that fails by the same function in the same format, as a file.
pub fn shrunk(case: &Case, outcome: &Result<Vec<Failure>, String>) -> String {
    let robot = case.robot();
    let (least, what) = match outcome {
        Err(panic) => {
            let least =
                robot.shrunk(|r| catch_unwind(AssertUnwindSafe(|| judge(&File::from(r), &|_, _| true))).is_err());
            (least, format!("panic: {panic}"))
        }
        Ok(failures) => {
            let Failure { scalar, function, of_equations, .. } = failures[0].clone();
            let fails = |r: &Written| {
                let outcome =
                    catch_unwind(AssertUnwindSafe(|| judge(&File::from(r), &|s, f| (s, f) == (scalar, function))));
                match outcome {
                    Ok(Outcome::Judged(failures, _)) => failures.into_iter().find(|f| f.of_equations == of_equations),
                    _ => None,
                }
            };
            let least = robot.shrunk(|r| fails(r).is_some());
            let failure = fails(&least).unwrap_or(failures[0].clone());
            (least, format!("{} at {:?}", in_words(&failure), failure.state))
        }
    };
    let steps = match outcome {
        Ok(failures) => by_steps(&File::from(&least), failures[0].scalar, failures[0].function),
        Err(_) => String::new(),
    };
    format!("SHRUNK {case:?}\n{what}\nfloating: {}\n{steps}{}", least.floating, least.text())
}
