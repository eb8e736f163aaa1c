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
mod columns;
mod contact;
mod disagreement;
mod losses;
#[cfg(feature = "internals")]
#[path = "../../tests/internals/mutants.rs"]
pub(crate) mod mutants;
#[cfg(feature = "internals")]
pub(crate) mod sabotage;
mod states;

use crate::equations::bind::{constructed, BoundRobot};
use crate::equations::reduce::longest_lever;
use crate::equations::Robot;
use crate::function::{Forms, ForwardDynamicsMethod, Function, Judged, Quantity, Spec};
use crate::model::drives::entries;
use crate::options::{Optimisations, Options};
use crate::scene::free_drive::FreeDrive;
use straightline_core::magnitude::Magnitude;
use straightline_core::model::Model;
use straightline_core::spatial::{Sym3, Transform, Vec3};
use straightline_core::{Dd, Real};
use straightline_graph::expr::{evaluate, Binary, Grade, Graph, Op, Port};
use straightline_graph::pass::cut::Staged;
use straightline_graph::{element_of, EveryScalar};

pub(crate) use bounds::{of_acceleration_bound, of_bound};
pub(crate) use columns::{of_column_bound, of_column_system};
pub(crate) use contact::{of_contact, of_system};
pub use disagreement::{Disagreement, Plainer};
use losses::Losses;
use states::{StatePlace, States};

/// Results agree to so much of their natural scale; double-double has 5e-32.
const AGREE: f64 = 1e-24;
/// With exact rules constants are rounded to the scalar, one by one, as the generic runtime holds them: what is not that runtime bit for
/// bit (stages, contact modes, constructors of parameters) differs by so many roundings of them.
const ROUNDINGS: f64 = 1e4;
/// A point on an axis is off it by so much of the longest lever, for all that rounding says.
const POINT: f64 = 1e-3;
/// What is left so small a part of where nothing cancels, is rounding noise.
const NOISE: f64 = 1e-6;
/// A program may lose so many times what the plain equations lose in the same scalar.
const LOSSES: f64 = 8.0;
/// So many roundings of √(H_ii H_jj) any program may lose of H_ij: one for each body that it adds up, within bounds.
const OF_INERTIAS: [usize; 2] = [12, 30];
/// At so many random states.
const STATES: usize = 6;
/// Digits of H are looked at in so many more.
const MORE_STATES: usize = 18;
/// Results beyond this are of no robot that moves by forces of its size; forces and velocities then become such a part of what they were, so many times.
const FAR: f64 = 1e12;
const GENTLE: f64 = 1e-3;
const GENTLER: usize = 5;
/// Where the plain equations lose such a part of the greatest result to rounding, a state says nothing.
const REGULAR: f64 = 1e-2;

/// Up to which part of their natural scale results agree.
fn agreeing(options: &Options) -> f64 {
    match (options.grade, options.scalar) {
        (Grade::Algebraic, _) => AGREE,
        (Grade::Exact, scalar) => ROUNDINGS * scalar.epsilon(),
    }
}

/// A state: what stands for each input port, by name.
type PortState = crate::model::states::InputState<Dd>;

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
    let ports = options.scene.ports(function, &robot.model, frames);
    let plain = PlainEquations { robot, frames, function, options };
    let mut states = States::new(robot, options);
    if !optimisations.folding {
        return (0..STATES).try_for_each(|_| {
            let state = states.next(&ports);
            plain.has_same_bits(graph, &state)
        });
    }
    let check = Check { plain, graph };
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
            check.at(&states.placed(&ports, StatePlace::Beyond), (&mut losses, NOISE), false)?;
        }
        check.compare(losses)?;
    }
    check.compare(losses)?;
    // where users begin much is zero: that may hide what is lost elsewhere, and the other way round
    for place in [StatePlace::NearZero, StatePlace::Zero] {
        let state = states.placed(&ports, place);
        if check.is_regular(&state) {
            let mut losses = Losses::new(graph);
            check.at(&state, (&mut losses, NOISE), true)?;
            check.compare(losses)?;
        }
    }
    Ok(())
}

/// The plain equations of a function.
#[derive(Clone, Copy)]
struct PlainEquations<'a> {
    robot: &'a Robot,
    frames: &'a [String],
    function: Function,
    options: &'a Options,
}

/// The program of a function beside its plain equations.
struct Check<'a> {
    plain: PlainEquations<'a>,
    graph: &'a Graph,
}

impl Check<'_> {
    /// At one more state: what it loses to rounding, where an inertia counts as such a part of what it is made of at least, and, if
    /// `by_equations`, whether it is right.
    fn at(
        &self,
        state: &PortState,
        (losses, least): (&mut Losses, f64),
        by_equations: bool,
    ) -> Result<(), Disagreement> {
        let Check { plain, graph } = *self;
        let (state, found) = &self.moderate(state);
        let off = plain.differences(state, found);
        if by_equations {
            compare(plain.function.name(), &graph.outputs, &off, AGREE)?;
        }
        let sizes = self.sizes(state, found, &off, least);
        losses.add((graph, plain.options.scalar), state, &sizes, |state| plain.results(state));
        Ok(())
    }

    /// The state, and what the program finds there. Forces that throw a light robot beyond all angles are made smaller.
    fn moderate(&self, state: &PortState) -> (PortState, Vec<Dd>) {
        let (mut state, mut found) = (state.clone(), evaluate(self.graph, &inputs(self.graph, state)));
        for _ in 0..GENTLER {
            let is_regular = found.iter().all(|x| x.hi().is_finite());
            // where the plain equations have numbers of this world, so has the program
            if is_regular || self.plain.results(&state).iter().all(|x| x.wide.value.hi().abs() < FAR) {
                break;
            }
            for name in [Quantity::Force, Quantity::Velocity].map(Quantity::name) {
                state.get_mut(&name).into_iter().flatten().for_each(|x| *x *= Dd::from(GENTLE));
            }
            found = evaluate(self.graph, &inputs(self.graph, &state));
        }
        (state, found)
    }

    /// Whether the plain equations have digits there: stretched, a chain of point masses may have a mass matrix without inverse.
    fn is_regular(&self, state: &PortState) -> bool {
        if !self.graph.ops.iter().any(|op| matches!(op, Op::Binary(Binary::Div, ..))) {
            return true;
        }
        let plain = self.plain.results(state);
        let most = plain.iter().map(|x| x.wide.value.hi().abs()).fold(0.0, f64::max);
        // written so that NaN is not regular
        let lost = |x: EveryScalar| (x.wide.value.hi() - x.in_scalar(self.plain.options.scalar)).abs();
        plain.into_iter().all(|x| lost(x) <= REGULAR * most)
    }

    /// What losses are compared with.
    fn sizes(&self, state: &PortState, found: &[Dd], off: &[Magnitude], least: f64) -> Vec<f64> {
        let PlainEquations { robot, frames, function, options } = self.plain;
        let scene = &options.scene;
        let frames = scene.frames_of(function, frames).len();
        let all: usize = function.outputs(&robot.model, frames).iter().map(Port::len).sum();
        let is_whole = scene.select(function, &robot.model, frames).0.into_iter().eq(0..all);
        match function.spec().judged {
            judged if judged.is_by_equations() && is_whole => self.plain.sizes_of_solutions(state, off),
            // residuals have no scale of accelerations: all of them are judged by the greatest
            Judged::ByResidual => vec![found.iter().map(|x| x.hi().abs()).fold(0.0, f64::max); found.len()],
            judged @ Judged::ByInertias if is_whole => {
                let sized = |(value, off): (&Dd, &Magnitude)| Magnitude { value: *value, size: off.size };
                judged.scales(&found.iter().zip(off).map(sized).collect::<Vec<_>>(), least)
            }
            _ => off.iter().map(|x| x.size).collect(),
        }
    }

    fn compare(&self, mut losses: Losses) -> Result<(), Disagreement> {
        let PlainEquations { robot, function, options, .. } = self.plain;
        let Spec { solves, family, .. } = function.spec();
        if *solves && !family.is_of_drives() {
            let lost = Disagreement {
                program: function.name().to_string(),
                result: element_of(&self.graph.outputs, 0),
                difference: losses.of_greatest,
                plain: Some(losses.of_greatest),
            };
            if lost.beyond_digits(&robot.model, options.scalar).is_some() {
                return Err(lost);
            }
        }
        // two roundings of all that a result is made of are little; of a scale that is a result's own any program loses some
        let least = match function.spec().judged {
            Judged::ByResidual | Judged::ByColumns => {
                losses.plain = vec![losses.plain.iter().copied().fold(0.0, f64::max); losses.plain.len()];
                LOSSES / 2.0
            }
            Judged::ByInertias => robot.model.bodies.len().clamp(OF_INERTIAS[0], OF_INERTIAS[1]) as f64,
            Judged::ByDerivatives => LOSSES,
            Judged::ByScale => 2.0,
        };
        losses.compare(function.name(), self.graph, options.scalar, least)
    }
}

impl PlainEquations<'_> {
    /// The results that are wanted, by the generic runtime.
    fn results(self, state: &PortState) -> Vec<EveryScalar> {
        self.results_by(ForwardDynamicsMethod::ArticulatedBody, state)
    }

    fn results_by(self, method: ForwardDynamicsMethod, state: &PortState) -> Vec<EveryScalar> {
        let (bound, wanted) = self.bound(state);
        self.all(&bound, method, &wanted)
    }

    /// The robot with what stands for its inputs, and which results are wanted.
    fn bound(self, state: &PortState) -> (BoundRobot<EveryScalar>, Vec<usize>) {
        let PlainEquations { robot, frames, function, options: Options { scene, .. } } = self;
        let (wanted, _) = scene.select(function, &robot.model, scene.frames_of(function, frames).len());
        let given = of_ports(&scene.ports(function, &robot.model, frames), state);
        (scene.bind(function, robot, &given), wanted)
    }

    fn all(self, bound: &BoundRobot<EveryScalar>, method: ForwardDynamicsMethod, wanted: &[usize]) -> Vec<EveryScalar> {
        let frames = self.options.scene.frames_of(self.function, self.frames).iter();
        let frames: Vec<_> =
            frames.map(|f| bound.model.frame(f).expect("frames were checked against the model")).collect();
        let rows = self.options.scene.rows_of(self.function);
        let forms = Forms { rows, ..Forms::plain(&bound.model, &frames, method) };
        let all = self.function.evaluate_on(&forms, &bound.arguments);
        wanted.iter().map(|k| all[*k]).collect()
    }

    /// What a program found, less what the plain equations say, with their natural scale.
    fn differences(self, state: &PortState, found: &[Dd]) -> Vec<Magnitude> {
        let (mut bound, wanted) = self.bound(state);
        with_sizes(&mut bound.model, longest_lever(&self.robot.model));
        let method = ForwardDynamicsMethod::ArticulatedBody;
        let is_solved = self.function.spec().judged.is_by_equations();
        let all: usize = self.function.outputs(&self.robot.model, 0).iter().map(Port::len).sum();
        if is_solved && wanted.iter().copied().eq(0..all) {
            let found: Vec<EveryScalar> = found.iter().copied().map(Real::constant).collect();
            let left = self.function.residual(&Forms::plain(&bound.model, &[], method), &bound.arguments, &found);
            return left.into_iter().map(|x| x.wide).collect();
        }
        let plain = self.all(&bound, method, &wanted);
        found.iter().zip(plain).map(|(found, plain)| difference(*found, plain.wide)).collect()
    }

    /// With exact rules a program is the generic runtime, bit for bit.
    fn has_same_bits(self, graph: &Graph, state: &PortState) -> Result<(), Disagreement> {
        let plain = self.results_by(self.options.forward_dynamics, state);
        let given: Vec<EveryScalar> = inputs(graph, state).into_iter().map(Real::constant).collect();
        let off = |(found, plain): (EveryScalar, EveryScalar)| {
            let [found, plain] = [found, plain].map(|x| x.in_scalar(self.options.scalar));
            // neither is a number
            let value = if found == plain || (found.is_nan() && plain.is_nan()) { 0.0 } else { found - plain };
            Magnitude { value: Dd::from(value), size: found.abs().max(plain.abs()) }
        };
        let off: Vec<Magnitude> = evaluate(graph, &given).into_iter().zip(plain).map(off).collect();
        compare(self.function.name(), &graph.outputs, &off, AGREE)
    }
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

fn difference(found: Dd, plain: Magnitude) -> Magnitude {
    // where the plain equations divide by zero, or turn by more than sines answer for, so may the program
    if [found, plain.value].iter().all(|x| !x.hi().is_finite()) {
        return Magnitude::new(Dd::ZERO);
    }
    Magnitude { value: found - plain.value, size: plain.size }
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
    for port in functions.iter().flat_map(|f| options.scene.ports(*f, &robot.model, frames)) {
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
            let off = PlainEquations { robot, frames, function: *function, options }.differences(&state, &found);
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
        let off = evaluate(graph, &body.concat()).into_iter().zip(plainly_constructed(robot, parameter, &body));
        let off: Vec<Magnitude> = off.map(|(found, plain)| difference(found, plain.wide)).collect();
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

fn inputs(graph: &Graph, state: &PortState) -> Vec<Dd> {
    graph.inputs.iter().flat_map(|p| state[&p.name].clone()).collect()
}

fn of_ports(ports: &[Port], state: &PortState) -> Vec<Vec<EveryScalar>> {
    ports.iter().map(|p| every_scalar(&state[&p.name])).collect()
}

/// What the constructor of a run-time parameter makes of these, by the plain equations.
fn plainly_constructed(robot: &Robot, parameter: &crate::scene::Parameter, given: &[Vec<Dd>]) -> Vec<EveryScalar> {
    let given: Vec<Vec<EveryScalar>> = given.iter().map(|x| every_scalar(x)).collect();
    constructed(robot, parameter, &given)
}

/// The plain equations are compiled over this scalar alone: it has what they say in double-double and in the scalar that is generated.
fn every_scalar(x: &[Dd]) -> Vec<EveryScalar> {
    x.iter().copied().map(Real::constant).collect()
}

/// Gives every number of a robot the size of the vector, rotation or tensor that it is a part of: turned into other axes, it takes part in
/// all components. Origins count as [`POINT`] of the longest lever at least: other forms of the robot have them elsewhere.
fn with_sizes(model: &mut Model<EveryScalar>, lever: f64) {
    let of_vector = |v: &mut Vec3<EveryScalar>| {
        let size = v.to_array().iter().map(|x| x.wide.size).fold(0.0, f64::hypot);
        *v = v.map(|x| x.of_size(size));
    };
    let of_tensor = |s: &mut Sym3<EveryScalar>| {
        let size = [s.xx, s.xy, s.xz, s.yy, s.yz, s.zz].iter().map(|x| x.wide.size).fold(0.0, f64::hypot);
        *s = s.map(|x| x.of_size(size));
    };
    let of_pose = |x: &mut Transform<EveryScalar>| {
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
        let size = i.inertia_com.xx.wide.size;
        i.anisotropy_com = i.anisotropy_com.map(|x| x.of_size(size));
        if let Some(load) = &mut body.load {
            of_vector(&mut load.first_moment);
            of_tensor(&mut load.second_moment);
        }
    }
    model.frames.iter_mut().for_each(|f| of_pose(&mut f.placement));
    of_vector(&mut model.gravity);
}
