//! Every compilation checks itself: each final program, after all passes, against the plain equations of the same robot.
//!
//! The plain side is the generic runtime, run in double-double on the robot's own frames and inertial parameters: no reduced form, no rewrite
//! rule, no pass, no graph. The compiled side is the graph that text is written from, run in double-double, too. Where a pass
//! drops what it may not drop, or a form of the robot is not the robot, the two differ, and the next plainer form is taken.
//!
//! Differences are compared with the natural scale of the *result*: what its plain equations are made of
//! ([`Magnitude`]), each vector counted with its length. Accelerations are judged by what they leave of
//! the equations of motion, τ − H q̈ − h: that says the same for robots whose H is nearly singular.
//!
//! What is equal over the reals may still lose digits that the plain equations keep, or leave the range of f32. So both run in the scalar that
//! is generated, too, and the program may lose eight times what the plain equations lose.

mod bounds;
#[cfg(feature = "internals")]
pub(crate) mod mutants;

use crate::diagnostic::Diagnostic;
use crate::equations::bind::constructed;
use crate::equations::reduce::longest_lever;
use crate::equations::Robot;
use crate::function::{ContactFunction, ForwardDynamicsMethod, Function, Judged};
use crate::model::drives::entries;
use crate::model::singular::weakest_joint;
use crate::model::states::{of_port, settle};
use crate::options::{Optimisations, Options};
use crate::program::contact;
use crate::scene::free_drive::FreeDrive;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::fmt;
use straightline_core::algorithms::Ltdl;
use straightline_core::magnitude::Magnitude;
use straightline_core::model::{BodyId, Model};
use straightline_core::random::Random;
use straightline_core::spatial::{Sym3, Transform, Vec3};
use straightline_core::{Dd, Real};
use straightline_graph::expr::{evaluate, Binary, Grade, Graph, Op, Port};
use straightline_graph::pass::cut::Staged;
use straightline_graph::{element_of, Scalar};

pub(crate) use bounds::{of_acceleration_bound, of_bound};

/// Results agree to so much of their natural scale; double-double has 5e-32.
const AGREE: f64 = 1e-24;
/// With exact rules constants are rounded to the scalar, one by one, as the generic runtime holds them: what is not that runtime bit for
/// bit (stages, contact modes, constructors of parameters) differs by so many roundings of them.
const ROUNDINGS: f64 = 1e4;
/// What is solved for counts as so many times what it loses in f64, over the rounding of f64: another form may lose more.
const SOLVED: f64 = 1e3;
/// A point on an axis is off it by so much of the longest lever, for all that rounding says.
const POINT: f64 = 1e-3;
/// What is left so small a part of where nothing cancels, is rounding noise.
const NOISE: f64 = 1e-6;
/// So much [`nudge`] moves axes and, of the longest lever, origins.
const NUDGE: f64 = 1e-26;
/// A program may lose so many times what the plain equations lose in the same scalar.
const LOSSES: f64 = 8.0;
/// So many roundings of √(H_ii H_jj) any program may lose of H_ij.
const OF_INERTIAS: f64 = 12.0;
/// A difference of inertias that is so many roundings of them has hardly a digit.
const NO_DIGIT: f64 = 1e3;
/// At so many random states.
const STATES: usize = 6;
/// Digits of H are looked at in so many more.
const MORE_STATES: usize = 18;
/// Where the plain equations lose such a part of the greatest result to rounding, a state says nothing.
const REGULAR: f64 = 1e-2;
/// Near the zero configuration, where robots are tried first, coordinates and rates are within this.
const NEAR: f64 = 1e-3;
/// Where random numbers begin: another place than where states for choices come from.
const SEED: u64 = 0x6a09_e667_f3bc_c908;

/// Up to which part of their natural scale results agree.
fn agreeing(options: &Options) -> f64 {
    match (options.grade, options.scalar) {
        (Grade::Algebraic, _) => AGREE,
        (Grade::Exact, scalar) => ROUNDINGS * scalar.epsilon(),
    }
}

/// How a program differs from the plain equations of its robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Disagreement {
    /// The program's name.
    pub program: String,
    /// The result that differs most, such as `tau[2]`.
    pub result: String,
    /// By how much of its natural scale.
    pub difference: f64,
    /// What the plain equations lose to rounding in the same scalar, where that is what the program is compared with.
    pub plain: Option<f64>,
}

impl fmt::Display for Disagreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Disagreement { program, result, difference, plain } = self;
        if let Some(plain) = plain {
            return write!(
                f,
                "`{program}` loses digits that the plain equations of the robot keep: {result} is off by {difference:.1e}, theirs by {plain:.1e}"
            );
        }
        if !difference.is_finite() {
            return write!(f, "`{program}` differs from the plain equations of the robot: {result} is no number");
        }
        write!(f, "`{program}` differs from the plain equations of the robot: {result} by {difference:.1e} of its natural scale")
    }
}

/// A program in another form than it would have had, as that one did not agree.
#[derive(Clone, Debug, PartialEq)]
pub struct Plainer {
    /// What was wrong.
    pub disagreement: Disagreement,
    /// The optimisation without which it is right.
    pub without: &'static str,
}

impl Plainer {
    /// What the user is told.
    pub fn warning(&self, model: &Model<Dd>) -> Diagnostic {
        let Plainer { disagreement, without } = self;
        Diagnostic::warning("plainer-form", format!("`{}` is written in a plainer form", disagreement.program))
            .detail(format!("{disagreement}; without “{without}” it agrees{}", suspect(model)))
            .help("the code is right, but takes more operations than it might: please report the robot file")
    }
}

impl Disagreement {
    /// Whether the plain equations themselves lose nearly all digits.
    pub(crate) fn is_of_the_robot(&self) -> bool {
        self.plain.is_some_and(|plain| LOSSES * plain >= 1.0)
    }

    /// Whether the plain equations themselves lose nearly all digits in this scalar, as inertias are too far apart: then no form is right.
    /// Which joint feels too little, and which part of what it moves.
    pub fn beyond_digits(&self, model: &Model<Dd>, scalar: Scalar) -> Option<(BodyId, f64)> {
        if !self.is_of_the_robot() {
            return None;
        }
        weakest_joint(model).filter(|(_, part)| *part <= NO_DIGIT * scalar.epsilon())
    }

    /// What the user is told where no form agrees.
    pub fn error(&self, model: &Model<Dd>) -> Diagnostic {
        Diagnostic::error(
            "internal-disagreement",
            format!("no form of `{}` is right: nothing is written", self.program),
        )
        .detail(format!("{self}{}", suspect(model)))
        .help("this is a fault of Straightline: please report it together with the robot file and the scene")
    }
}

/// The number that is probably behind it.
fn suspect(model: &Model<Dd>) -> String {
    let number = out_of_proportion(model);
    number.map_or(String::new(), |number| {
        format!("; of the robot's numbers the one most out of proportion is the {number}")
    })
}

/// A state: what stands for each input port, by name.
type State = BTreeMap<String, Vec<Dd>>;

/// Whether a function's program, made by these optimisations, says what its plain equations say.
///
/// # Errors
/// The first difference that was found.
pub(crate) fn of_function(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    optimisations: Optimisations,
    graph: &Graph,
) -> Result<(), Disagreement> {
    let ports = options.scene.ports(function, &robot.model);
    if !optimisations.folding {
        let mut states = States::new(robot, options);
        return (0..STATES).try_for_each(|_| {
            let state = states.next(&ports);
            in_scalar!(options.scalar, T => same_bits::<T>(robot, frames, function, options, graph, &state))
        });
    }
    let check = Check { robot, frames, function, options, graph };
    let mut states = States::new(robot, options);
    let mut losses = Losses::new(graph);
    for _ in 0..STATES {
        check.at(&states.next(&ports), (&mut losses, POINT), true)?;
    }
    if function.spec().judged == Judged::ByInertias {
        // of all results these lose most where the robot happens to stand so that an entry is small
        for _ in 0..MORE_STATES {
            check.at(&states.next(&ports), (&mut losses, POINT), false)?;
        }
        // where plain entries are almost rounding noise they hide what others lose: by themselves
        let mut losses = Losses::new(graph);
        for _ in 0..STATES {
            check.at(&states.placed(&ports, Place::Beyond), (&mut losses, NOISE), false)?;
        }
        check.compare(losses)?;
    }
    check.compare(losses)?;
    // where users begin much is zero: that may hide what is lost elsewhere, and the other way round
    for place in [Place::NearZero, Place::Zero] {
        let state = states.placed(&ports, place);
        if check.is_regular(&state) {
            let mut losses = Losses::new(graph);
            check.at(&state, (&mut losses, NOISE), true)?;
            check.compare(losses)?;
        }
    }
    Ok(())
}

/// The program of a function beside its plain equations.
struct Check<'a> {
    robot: &'a Robot,
    frames: &'a [String],
    function: Function,
    options: &'a Options,
    graph: &'a Graph,
}

impl Check<'_> {
    /// At one more state: what it loses to rounding, where an inertia counts as such a part of what it is made of at least, and, if
    /// `by_equations`, whether it is right.
    fn at(&self, state: &State, (losses, least): (&mut Losses, f64), by_equations: bool) -> Result<(), Disagreement> {
        let Check { robot, frames, function, options, graph } = *self;
        let found = evaluate(graph, &inputs(graph, state));
        let off = differences(robot, frames, function, options, state, &found);
        if by_equations {
            compare(function.name(), &graph.outputs, &off, AGREE)?;
        }
        let sizes = self.sizes(state, &found, &off, least);
        let plain = ForwardDynamicsMethod::ArticulatedBody;
        in_scalar!(options.scalar, T => losses.add(graph, (state, &found), &sizes, |state| {
            plain_results::<T>(robot, frames, function, options, plain, state)
        }));
        Ok(())
    }

    /// Whether the plain equations have digits there: stretched, a chain of point masses may have a mass matrix without inverse.
    fn is_regular(&self, state: &State) -> bool {
        if !self.graph.ops.iter().any(|op| matches!(op, Op::Binary(Binary::Div, ..))) {
            return true;
        }
        let Check { robot, frames, function, options, .. } = *self;
        let method = ForwardDynamicsMethod::ArticulatedBody;
        let exact = plain_results::<Dd>(robot, frames, function, options, method, state);
        let short: Vec<f64> = in_scalar!(options.scalar, T => {
            let results = plain_results::<T>(robot, frames, function, options, method, state);
            results.into_iter().map(f64::from).collect()
        });
        let most = exact.iter().map(|x| x.hi().abs()).fold(0.0, f64::max);
        // written so that NaN is not regular
        exact.iter().zip(short).all(|(exact, short)| (exact.hi() - short).abs() <= REGULAR * most)
    }

    /// What losses are compared with.
    fn sizes(&self, state: &State, found: &[Dd], off: &[Magnitude], least: f64) -> Vec<f64> {
        let (nv, scene) = (self.robot.model.nv(), &self.options.scene);
        let is_whole = |all: usize| {
            let frames = scene.frames_of(self.function, self.frames).len();
            scene.select(self.function, &self.robot.model, frames).0.into_iter().eq(0..all)
        };
        match self.function.spec().judged {
            Judged::ByResidual if is_whole(nv) => sizes_of_accelerations(self.robot, self.options, state, off),
            // residuals have no scale of accelerations: all of them are judged by the greatest
            Judged::ByResidual => vec![found.iter().map(|x| x.hi().abs()).fold(0.0, f64::max); found.len()],
            Judged::ByInertias if is_whole(nv * nv) => sizes_of_inertias(nv, found, off, least),
            _ => off.iter().map(|x| x.size).collect(),
        }
    }

    fn compare(&self, mut losses: Losses) -> Result<(), Disagreement> {
        if self.function.spec().judged == Judged::ByResidual {
            let lost = Disagreement {
                program: self.function.name().to_string(),
                result: element_of(&self.graph.outputs, 0),
                difference: losses.of_greatest,
                plain: Some(losses.of_greatest),
            };
            if lost.beyond_digits(&self.robot.model, self.options.scalar).is_some() {
                return Err(lost);
            }
        }
        // a rounding of all that a result is made of is little; of a scale that is a result's own any program loses some
        let least = match self.function.spec().judged {
            Judged::ByResidual => {
                losses.plain = vec![losses.plain.iter().copied().fold(0.0, f64::max); losses.plain.len()];
                LOSSES / 2.0
            }
            Judged::ByInertias => OF_INERTIAS,
            Judged::ByScale => 1.0,
        };
        losses.compare(self.function.name(), self.graph, self.options.scalar, least)
    }
}

/// Natural scales of the entries of H: √(H_ii H_jj), where H_ii is not what is left of terms that cancel.
fn sizes_of_inertias(nv: usize, h: &[Dd], off: &[Magnitude], least: f64) -> Vec<f64> {
    let root = |i: usize| h[i * nv + i].hi().abs().max(least * off[i * nv + i].size).sqrt();
    (0..nv * nv).map(|k| root(k / nv) * root(k % nv)).collect()
}

/// Natural scales of accelerations: |H⁻¹| times those of the forces that make them, given with what the equations of motion are off by.
fn sizes_of_accelerations(robot: &Robot, options: &Options, state: &State, off: &[Magnitude]) -> Vec<f64> {
    let ports = options.scene.ports(Function::ForwardDynamics, &robot.model);
    let bound = options.scene.bind(Function::ForwardDynamics, robot, &of_ports(&ports, state, |x| x));
    let h = Function::MassMatrix.evaluate(&bound.model, &[], ForwardDynamicsMethod::ArticulatedBody, &bound.arguments);
    let factor = Ltdl::factor(&bound.model, &h);
    let mut sizes = vec![0.0; off.len()];
    for (j, force) in off.iter().enumerate() {
        let mut unit = vec![Dd::ZERO; off.len()];
        unit[j] = Dd::ONE;
        let column = factor.solve(&unit);
        sizes.iter_mut().zip(column).for_each(|(size, x)| *size += x.hi().abs() * force.size);
    }
    sizes
}

/// What a program and the plain equations lose to rounding: of each result the worst of some states, over its natural scale.
struct Losses {
    program: Vec<f64>,
    plain: Vec<f64>,
    /// What the plain equations lose of the greatest result at least.
    of_greatest: f64,
}

impl Losses {
    fn new(graph: &Graph) -> Self {
        let none = vec![0.0; graph.results.len()];
        Losses { program: none.clone(), plain: none, of_greatest: f64::INFINITY }
    }

    /// At one more state, rounded to the scalar; `found`: the results there in double-double.
    fn add<T: Real + Into<f64>>(
        &mut self,
        graph: &Graph,
        (state, found): (&State, &[Dd]),
        sizes: &[f64],
        plain: impl Fn(&State) -> Vec<T>,
    ) {
        let rounded: State =
            state.iter().map(|(n, x)| (n.clone(), x.iter().map(|x| rounded::<T>(*x)).collect())).collect();
        let wide = inputs(graph, &rounded);
        let exact = match rounded == *state {
            true => found.to_vec(),
            false => evaluate(graph, &wide),
        };
        let found = evaluate(graph, &wide.into_iter().map(T::constant).collect::<Vec<T>>());
        let plain = plain(&rounded);
        let greatest = exact.iter().map(|x| x.hi().abs()).fold(0.0, f64::max);
        let mut lost: f64 = 0.0;
        for (plain, exact) in plain.iter().zip(&exact).filter(|_| greatest > 0.0) {
            let off = (Dd::from((*plain).into()) - *exact).hi().abs() / greatest;
            lost = if off.is_nan() { f64::INFINITY } else { lost.max(off) };
        }
        self.of_greatest = self.of_greatest.min(lost);
        for (k, exact) in exact.into_iter().enumerate().filter(|(k, _)| sizes[*k] > 0.0) {
            let lost = |x: T| {
                let off = (Dd::from(x.into()) - exact).hi().abs() / sizes[k];
                if off.is_nan() {
                    f64::INFINITY
                } else {
                    off
                }
            };
            self.program[k] = self.program[k].max(lost(found[k]));
            self.plain[k] = self.plain[k].max(lost(plain[k]));
        }
    }

    fn compare(self, program: &str, graph: &Graph, scalar: Scalar, least: f64) -> Result<(), Disagreement> {
        let least = match scalar {
            _ if !graph.formats.is_empty() => return Ok(()),
            scalar => least * scalar.epsilon(),
        };
        let is_worse = |k: &usize| self.program[*k] > (LOSSES * self.plain[*k]).max(least);
        match (0..self.program.len()).find(is_worse) {
            None => Ok(()),
            Some(k) => Err(Disagreement {
                program: program.to_string(),
                result: element_of(&graph.outputs, k),
                difference: self.program[k],
                plain: Some(self.plain[k]),
            }),
        }
    }
}

/// The nearest number of a scalar.
fn rounded<T: Real + Into<f64>>(x: Dd) -> Dd {
    Dd::from(T::constant(x).into())
}

/// The results that are wanted of a function, by the generic runtime in this scalar.
fn plain_results<T: Real>(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    method: ForwardDynamicsMethod,
    state: &State,
) -> Vec<T> {
    let scene = &options.scene;
    let frames = scene.frames_of(function, frames);
    let (wanted, _) = scene.select(function, &robot.model, frames.len());
    let bound = scene.bind(function, robot, &of_ports(&scene.ports(function, &robot.model), state, T::constant));
    let frames: Vec<_> =
        frames.iter().map(|f| bound.model.frame(f).expect("frames were checked against the model")).collect();
    let all = function.evaluate(&bound.model, &frames, method, &bound.arguments);
    wanted.iter().map(|k| all[*k]).collect()
}

/// Results that differ by more than a part of their sizes, if any.
fn compare(program: &str, outputs: &[Port], differences: &[Magnitude], agree: f64) -> Result<(), Disagreement> {
    let mut worst: Option<(f64, usize)> = None;
    for (k, x) in differences.iter().enumerate() {
        let off = x.value.hi().abs();
        // what is no number does not agree
        let agrees = off <= agree * x.size;
        let relative = if x.size > 0.0 { off / x.size } else { f64::INFINITY };
        if !agrees && worst.is_none_or(|(most, _)| relative > most || relative.is_nan()) {
            worst = Some((relative, k));
        }
    }
    match worst {
        None => Ok(()),
        Some((difference, k)) => {
            Err(Disagreement { program: program.to_string(), result: element_of(outputs, k), difference, plain: None })
        }
    }
}

/// What a program found, less what the plain equations say, with their natural scale.
fn differences(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    state: &State,
    found: &[Dd],
) -> Vec<Magnitude> {
    let scene = &options.scene;
    let frames = scene.frames_of(function, frames);
    let (wanted, _) = scene.select(function, &robot.model, frames.len());
    let given = of_ports(&scene.ports(function, &robot.model), state, Magnitude::new);
    let mut bound = scene.bind(function, robot, &given);
    with_sizes(&mut bound.model, longest_lever(&robot.model));
    let nv = robot.model.nv();
    if function.spec().judged == Judged::ByResidual && wanted.iter().copied().eq(0..nv) {
        let motion = [&bound.arguments[0], &bound.arguments[1], &found.iter().copied().map(Magnitude::new).collect()];
        let takes = Function::InverseDynamics.evaluate(
            &bound.model,
            &[],
            ForwardDynamicsMethod::ArticulatedBody,
            &motion.map(Vec::clone),
        );
        return takes.into_iter().zip(&bound.arguments[2]).map(|(takes, tau)| takes - *tau).collect();
    }
    let frames: Vec<_> =
        frames.iter().map(|f| bound.model.frame(f).expect("frames were checked against the model")).collect();
    let all = function.evaluate(&bound.model, &frames, ForwardDynamicsMethod::ArticulatedBody, &bound.arguments);
    wanted.iter().zip(found).map(|(k, found)| difference(*found, all[*k])).collect()
}

fn difference(found: Dd, plain: Magnitude) -> Magnitude {
    // where the plain equations divide by zero, so may the program
    let both = [found, plain.value].iter().all(|x| !x.hi().is_finite());
    Magnitude { value: if both { Dd::ZERO } else { found - plain.value }, size: plain.size }
}

/// With exact rules a program is the generic runtime, bit for bit.
fn same_bits<T: Real + PartialEq + Into<f64>>(
    robot: &Robot,
    frames: &[String],
    function: Function,
    options: &Options,
    graph: &Graph,
    state: &State,
) -> Result<(), Disagreement> {
    let plain = plain_results::<T>(robot, frames, function, options, options.forward_dynamics, state);
    let rounded: Vec<T> = inputs(graph, state).into_iter().map(T::constant).collect();
    let found = evaluate(graph, &rounded);
    let off = |(found, plain): (T, T)| {
        let same = found == plain;
        let [a, b]: [f64; 2] = [found.into(), plain.into()];
        // neither is a number
        let value = if same || (a.is_nan() && b.is_nan()) { 0.0 } else { a - b };
        Magnitude { value: Dd::from(value), size: 0.0 }
    };
    compare(function.name(), &graph.outputs, &found.into_iter().zip(plain).map(off).collect::<Vec<_>>(), AGREE)
}

/// Whether the program of a contact function says what its plain equations say; `plain`: the same function traced by exact rules, for
/// surfaces that have a scalar of their own.
///
/// # Errors
/// As [`of_function`].
pub(crate) fn of_contact(
    robot: &Robot,
    options: &Options,
    mode: &contact::Mode,
    function: ContactFunction,
    graph: &Graph,
    plain: &dyn Fn() -> Graph,
) -> Result<(), Disagreement> {
    let mut states = States::new(robot, options);
    let ports = contact::ports(robot, options, mode, function);
    let (prepare, lever) = (falling(robot), longest_lever(&robot.model));
    for _ in 0..STATES {
        let state = states.next(&ports);
        let given = |port: &Port| state[&port.name].iter().copied().map(Magnitude::new).collect();
        let by_numbers = contact::evaluate(robot, options, mode, function, &given, &prepare);
        let short = |port: &Port| state[&port.name].iter().map(|x| x.to_f64()).collect();
        let in_f64 = contact::evaluate::<f64>(robot, options, mode, function, &short, &|_| None);
        let of_another = |port: &Port| state[&port.name].clone();
        let of_another = contact::evaluate::<Dd>(robot, options, mode, function, &of_another, &|model| {
            nudge(model, lever);
            None
        });
        let (truth, in_f64) = by_numbers.zip(in_f64).unwrap_or_else(|| {
            let plain = plain();
            let wide: Vec<Magnitude> = inputs(&plain, &state).into_iter().map(Magnitude::new).collect();
            let short: Vec<f64> = inputs(&plain, &state).into_iter().map(Dd::to_f64).collect();
            (evaluate(&plain, &wide), evaluate(&plain, &short))
        });
        let found = evaluate(graph, &inputs(graph, &state));
        let most = solved_size(&truth, &in_f64, of_another.as_deref());
        let off: Vec<Magnitude> = found.into_iter().zip(truth).map(|(found, plain)| difference(found, plain)).collect();
        let off: Vec<Magnitude> = off.into_iter().map(|x| Magnitude { size: x.size.min(most), ..x }).collect();
        let name = format!("{}::{}", mode.identifier, function.name());
        compare(&name, &graph.outputs, &off, agreeing(options))?;
    }
    Ok(())
}

/// How large results may count that are solved for. [`Magnitude`] takes the worst of every pivot, one after the other, and tells nothing where
/// there are many; what the same equations lose in f64, at inputs that are hardly rounded, is what they are made of, or what they change by for
/// `another` robot, as next to nothing that is not zero keeps its digits in f64. All results count together: some are zero by their equations.
fn solved_size(truth: &[Magnitude], in_f64: &[f64], another: Option<&[Dd]>) -> f64 {
    let size = |k: usize| {
        let off = |x: Dd, by: f64| (truth[k].value - x).hi().abs() / by;
        let changed = another.map_or(0.0, |another| off(another[k], NUDGE));
        truth[k].value.hi().abs() + off(Dd::from(in_f64[k]), f64::EPSILON) + changed
    };
    let sizes: Vec<f64> = (0..truth.len()).map(size).collect();
    match sizes.iter().all(|x| x.is_finite()) {
        true => SOLVED * sizes.into_iter().fold(0.0, f64::max),
        false => f64::INFINITY,
    }
}

/// Another robot, by far less than its numbers are known: axes and origins, of which forms of a robot keep so much.
fn nudge(model: &mut Model<Dd>, lever: f64) {
    let mut sign = 1.0;
    let mut nudged = |x: Dd, size: f64| {
        sign = -sign;
        x + Dd::from(sign * NUDGE * size)
    };
    let places =
        model.bodies.iter_mut().map(|b| &mut b.placement).chain(model.frames.iter_mut().map(|f| &mut f.placement));
    for place in places {
        place.rotation = place.rotation.map(|x| nudged(x, 1.0));
        place.translation = place.translation.map(|x| nudged(x, lever));
    }
}

/// Numbers of their natural sizes, and what is added to accelerations of contact points and taken away again.
fn falling(robot: &Robot) -> impl Fn(&mut Model<Magnitude>) -> Option<Magnitude> {
    let lever = longest_lever(&robot.model);
    move |model| {
        with_sizes(model, lever);
        // every component of a vector has its length as size
        Some(Magnitude::new(Dd::from(model.gravity.x.size)))
    }
}

/// Whether what is left of the equations of a mode, by which accelerations and reactions are judged, is what the plain equations leave;
/// `plain` as in [`of_contact`].
///
/// # Errors
/// As [`of_function`].
pub(crate) fn of_system(
    robot: &Robot,
    options: &Options,
    mode: &contact::Mode,
    graph: &Graph,
    plain: &dyn Fn() -> Graph,
) -> Result<(), Disagreement> {
    let mut states = States::new(robot, options);
    let ports = contact::system_ports(robot, options, mode);
    let prepare = falling(robot);
    let name = match mode.identifier.is_empty() {
        true => "forward_dynamics_error_bound".to_string(),
        false => format!("{}::forward_dynamics_error_bound", mode.identifier),
    };
    for _ in 0..STATES {
        let state = states.next(&ports);
        let given = |port: &Port| state[&port.name].iter().copied().map(Magnitude::new).collect();
        let by_numbers = contact::evaluate_system(robot, options, mode, &given, &prepare);
        let truth = by_numbers.unwrap_or_else(|| {
            let plain = plain();
            let inputs: Vec<Magnitude> = inputs(&plain, &state).into_iter().map(Magnitude::new).collect();
            evaluate(&plain, &inputs)
        });
        let found = evaluate(graph, &inputs(graph, &state));
        let off: Vec<Magnitude> = found.into_iter().zip(truth).map(|(found, plain)| difference(found, plain)).collect();
        compare(&name, &graph.outputs, &off, agreeing(options))?;
    }
    Ok(())
}

/// Whether stages, one after the other, say what the plain equations of each function say.
///
/// # Errors
/// As [`of_function`].
pub(crate) fn of_stages(
    robot: &Robot,
    frames: &[String],
    functions: &[Function],
    options: &Options,
    staged: &Staged,
) -> Result<(), Disagreement> {
    let mut states = States::new(robot, options);
    let mut ports: Vec<Port> = Vec::new();
    for port in functions.iter().flat_map(|f| options.scene.ports(*f, &robot.model)) {
        if !ports.contains(&port) {
            ports.push(port);
        }
    }
    for _ in 0..STATES {
        let mut state = states.next(&ports);
        for stage in &staged.stages {
            let values = evaluate(stage, &inputs(stage, &state));
            let name = stage.outputs.first().map_or(String::new(), |port| port.name.clone());
            state.insert(name, values);
        }
        for (function, (_, graph)) in functions.iter().zip(&staged.functions) {
            let found = evaluate(graph, &inputs(graph, &state));
            let off = differences(robot, frames, *function, options, &state, &found);
            compare(&format!("staged::{}", function.name()), &graph.outputs, &off, agreeing(options))?;
        }
    }
    Ok(())
}

/// Whether the constructor of a run-time parameter makes what the functions take.
///
/// # Errors
/// As [`of_function`].
pub(crate) fn of_parameter(
    robot: &Robot,
    parameter: &crate::scene::Parameter,
    options: &Options,
    graph: &Graph,
) -> Result<(), Disagreement> {
    let mut states = States::new(robot, options);
    let drive = FreeDrive::new(parameter, &robot.model);
    for state in 0..STATES {
        let body = match &drive {
            // the first is the robot file's
            Some(drive) if state == 0 => vec![drive.nominal()],
            _ => states.given(parameter),
        };
        let wide: Vec<Vec<Magnitude>> = body.iter().map(|x| x.iter().copied().map(Magnitude::new).collect()).collect();
        let off = evaluate(graph, &body.concat()).into_iter().zip(constructed(robot, parameter, &wide));
        let off: Vec<Magnitude> = off.map(|(found, plain)| difference(found, plain)).collect();
        if let Some(drive) = &drive {
            compare(&parameter.input_name(), &graph.outputs, &off, agreeing(options))?;
            of_drive(parameter, drive, &body[0], (state == 0).then_some(&robot.model))?;
            continue;
        }
        // axes that hardly turn: what is left beside them is of the size of the whole
        let most = off.iter().map(|x| x.size).fold(0.0, f64::max);
        let off: Vec<Magnitude> = off.into_iter().map(|x| x.of_size(most)).collect();
        compare(&parameter.input_name(), &graph.outputs, &off, agreeing(options))?;
    }
    Ok(())
}

/// Whether functions run over the drive that these numbers make, all of it, and for those of the robot file over the robot's own.
fn of_drive(
    parameter: &crate::scene::Parameter,
    drive: &FreeDrive,
    numbers: &[Dd],
    of_file: Option<&Model<Dd>>,
) -> Result<(), Disagreement> {
    let bound = entries(&drive.bound(numbers));
    let own = of_file.and_then(|model| model.drives.iter().find(|d| d.name == drive.name())).map(entries);
    for expected in [Some(entries(&drive.derived(numbers))), own].into_iter().flatten() {
        let agree = |(found, plain): (&Dd, &Dd)| (*found - *plain).hi().abs() <= AGREE * plain.hi().abs();
        let differs = bound.len() != expected.len() || !bound.iter().zip(&expected).all(agree);
        if differs {
            let result = format!("a number of drive `{}`", drive.name());
            return Err(Disagreement { program: parameter.input_name(), result, difference: 1.0, plain: None });
        }
    }
    Ok(())
}

/// The robot's number that is most out of proportion to its others, in words: where something is lost on the way, it is mostly this.
fn out_of_proportion(model: &Model<Dd>) -> Option<String> {
    let lever = longest_lever(model);
    let mass = model.bodies.iter().map(|b| b.inertia.mass.hi()).fold(0.0, f64::max);
    let mut worst: Option<(f64, String)> = None;
    for body in &model.bodies {
        let (p, c, i) = (body.placement.translation, body.inertia.com, body.inertia.inertia_com);
        let rotation = body.placement.rotation.rows.concat();
        let groups = [
            ("origin of joint", body.joint.name.as_str(), "m", p.to_array().to_vec(), lever),
            ("axes of joint", body.joint.name.as_str(), "", rotation, 1.0),
            ("mass of link", body.name.as_str(), "kg", vec![body.inertia.mass], mass),
            ("centre of mass of link", body.name.as_str(), "m", c.to_array().to_vec(), lever),
            (
                "inertia of link",
                body.name.as_str(),
                "kg·m²",
                vec![i.xx, i.xy, i.xz, i.yy, i.yz, i.zz],
                mass * lever * lever,
            ),
        ];
        for (what, name, unit, numbers, scale) in groups {
            for x in numbers.into_iter().map(Dd::hi).filter(|x| *x != 0.0) {
                let off = (x.abs() / scale).log10().abs();
                if off.is_finite() && worst.as_ref().is_none_or(|(most, _)| off > *most) {
                    worst = Some((off, format!("{what} `{name}`: {x:e} {unit}").trim_end().to_string()));
                }
            }
        }
    }
    worst.map(|(_, words)| words)
}

fn inputs(graph: &Graph, state: &State) -> Vec<Dd> {
    graph.inputs.iter().flat_map(|p| state[&p.name].clone()).collect()
}

fn of_ports<T>(ports: &[Port], state: &State, number: fn(Dd) -> T) -> Vec<Vec<T>> {
    ports.iter().map(|p| state[&p.name].iter().copied().map(number).collect()).collect()
}

/// Gives every number of a robot the size of the vector, rotation or tensor that it is a part of: turned into other axes, it takes part in
/// all components. Origins count as [`POINT`] of the longest lever at least: other forms of the robot have them elsewhere.
fn with_sizes(model: &mut Model<Magnitude>, lever: f64) {
    let of_vector = |v: &mut Vec3<Magnitude>| {
        let size = v.to_array().iter().map(|x| x.size).fold(0.0, f64::hypot);
        *v = v.map(|x| x.of_size(size));
    };
    let of_tensor = |s: &mut Sym3<Magnitude>| {
        let size = [s.xx, s.xy, s.xz, s.yy, s.yz, s.zz].iter().map(|x| x.size).fold(0.0, f64::hypot);
        *s = s.map(|x| x.of_size(size));
    };
    let of_pose = |x: &mut Transform<Magnitude>| {
        x.rotation = x.rotation.map(|r| r.of_size(1.0));
        x.translation = x.translation.map(|r| r.of_size(POINT * lever));
        of_vector(&mut x.translation);
    };
    for body in &mut model.bodies {
        of_pose(&mut body.placement);
        of_pose(&mut body.link_frame);
        let i = &mut body.inertia;
        [&mut i.com, &mut i.first_moment, &mut i.anisotropy_com].into_iter().for_each(of_vector);
        [&mut i.inertia_com, &mut i.second_moment_com, &mut i.second_moment].into_iter().for_each(of_tensor);
        // differences of moments that cancel
        let size = i.inertia_com.xx.size;
        i.anisotropy_com = i.anisotropy_com.map(|x| x.of_size(size));
        if let Some(load) = &mut body.load {
            of_vector(&mut load.first_moment);
            of_tensor(&mut load.second_moment);
        }
    }
    model.frames.iter_mut().for_each(|f| of_pose(&mut f.placement));
    of_vector(&mut model.gravity);
}

/// Random states that the inputs allow, the same everywhere: every other one is fast.
struct States<'a> {
    robot: &'a Robot,
    options: &'a Options,
    random: Random,
    count: usize,
}

/// Where a robot stands.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    /// Within the limits of its joints.
    Anywhere,
    /// Whatever the limits.
    Beyond,
    NearZero,
    /// At rest, too.
    Zero,
}

impl Place {
    /// Coordinates or rates from anywhere, brought there.
    fn of(self, name: &str, values: Vec<f64>, random: &mut Random) -> Vec<f64> {
        let times = |factor: f64| values.iter().map(|x| factor * x).collect();
        match self {
            Place::Beyond if name == "q" => values.iter().map(|_| random.symmetric(PI)).collect(),
            Place::Anywhere | Place::Beyond => values,
            Place::NearZero => times(NEAR),
            Place::Zero => times(0.0),
        }
    }
}

impl<'a> States<'a> {
    fn new(robot: &'a Robot, options: &'a Options) -> Self {
        States { robot, options, random: Random(SEED), count: 0 }
    }

    fn next(&mut self, ports: &[Port]) -> State {
        self.placed(ports, Place::Anywhere)
    }

    fn placed(&mut self, ports: &[Port], place: Place) -> State {
        let (robot, model) = (self.robot, &self.robot.model);
        self.count += 1;
        let fast = self.count.is_multiple_of(2);
        let mut state = State::new();
        let mut plain: Vec<(&str, Vec<f64>)> = Vec::new();
        for port in ports {
            let name = port.name.as_str();
            if port.wrapper.is_some() {
                let parameter = self.options.scene.parameters.iter().find(|p| p.input_name() == name);
                let parameter = parameter.expect("a parameter per input with a type of its own");
                let given = self.given(parameter);
                let values = match parameter.is_of(model) {
                    true => constructed(robot, parameter, &given),
                    false => vec![Dd::ZERO; port.len()],
                };
                state.insert(name.to_string(), values);
                continue;
            }
            let is_positive = ["_environment", "_struck", "restitution"].iter().any(|end| name.ends_with(end));
            let in_contact =
                ["_axes", "_pose", "_velocity", "_acceleration", "_own"].iter().any(|end| name.ends_with(end));
            let values = match (is_positive, in_contact) {
                (true, _) => (0..port.len()).map(|_| 0.5 + self.random.unit()).collect(),
                (_, true) => (0..port.len()).map(|_| self.random.symmetric(1.0)).collect(),
                _ => of_port(model, port, fast, &mut self.random),
            };
            let values = match name {
                "q" | "qd" => place.of(name, values, &mut self.random),
                _ => values,
            };
            plain.push((name, values));
        }
        settle(model, &mut plain, &mut self.random);
        // numbers that all scalars hold
        let short = |x: f64| Dd::from(f64::from(x as f32));
        state.extend(plain.into_iter().map(|(n, x)| (n.to_string(), x.into_iter().map(short).collect())));
        // of length one in double-double, too
        for joint in model.bodies.iter().map(|b| &b.joint).filter(|j| !j.kind.is_single()) {
            if let Some(q) = state.get_mut("q") {
                let own = &mut q[joint.iq..joint.iq + joint.kind.nq()];
                if place == Place::Zero {
                    own.iter_mut().zip(joint.kind.row().neutral).for_each(|(q, neutral)| *q = Dd::from(*neutral));
                }
                joint.kind.normalise(own);
            }
        }
        state
    }

    /// What the constructor of a parameter may be given.
    fn given(&mut self, parameter: &crate::scene::Parameter) -> Vec<Vec<Dd>> {
        match FreeDrive::new(parameter, &self.robot.model) {
            Some(drive) => vec![drive.random(|| self.random.unit()).into_iter().map(Dd::from).collect()],
            None => self.body(),
        }
    }

    /// Mass, centre of mass and inertia of a body that may be.
    fn body(&mut self) -> Vec<Vec<Dd>> {
        let mut any = |least: f64, most: f64| Dd::from(least + (most - least) * self.random.unit());
        let mass = any(0.1, 3.0);
        let com = (0..3).map(|_| any(-0.2, 0.2)).collect();
        let [xx, yy, zz] = [0; 3].map(|_| any(0.02, 0.03));
        let [xy, xz, yz] = [0; 3].map(|_| any(-0.004, 0.004));
        vec![vec![mass], com, vec![xx, xy, xz, yy, yz, zz]]
    }
}

#[cfg(feature = "internals")]
pub(crate) mod sabotage {
    //! Passes that are broken on purpose.

    use crate::equations::Robot;
    use std::cell::RefCell;
    use straightline_graph::expr::Graph;

    type Break = Box<dyn FnMut(&str, Graph) -> Graph>;
    type Form = Box<dyn FnMut(Robot) -> Robot>;

    thread_local! {
        static BREAK: RefCell<Option<Break>> = const { RefCell::new(None) };
        static FORM: RefCell<Option<Form>> = const { RefCell::new(None) };
    }

    /// Runs `work` while every chosen form of the robot goes through `broken`.
    pub fn with_form<R>(broken: impl FnMut(Robot) -> Robot + 'static, work: impl FnOnce() -> R) -> R {
        FORM.set(Some(Box::new(broken)));
        let done = work();
        FORM.set(None);
        done
    }

    pub fn formed(robot: Robot) -> Robot {
        FORM.with_borrow_mut(|b| match b {
            Some(broken) => broken(robot),
            None => robot,
        })
    }

    /// Runs `work` while what every pass makes goes through `broken`, which is told the name of the pass.
    pub fn with<R>(broken: impl FnMut(&str, Graph) -> Graph + 'static, work: impl FnOnce() -> R) -> R {
        BREAK.set(Some(Box::new(broken)));
        let done = work();
        BREAK.set(None);
        done
    }

    pub fn applied(pass: &str, graph: Graph) -> Graph {
        BREAK.with_borrow_mut(|b| match b {
            Some(broken) => broken(pass, graph),
            None => graph,
        })
    }
}
