//! The program against the second author, on random states.
//!
//! The program is run operation by operation in its own arithmetic, as rustc compiles it. The truth is the handbook
//! chapter's formulation in double-double, from a second reading of the same robot file: it shares with the program the
//! parsed file and nothing else.
//!
//! An error is divided by the natural scale of its output: a bound on the sum of the moduli of the terms that the output
//! is made of. So 1e-16 is a rounding, whatever cancels, and a wrong formula is anything up to 1.

use crate::description::flexible::{Bending, Support};
use crate::description::{self, Description, JointDrive, Notation, Value};
use crate::diagnostic::{Diagnostics, Source};
use crate::emit::{fused, Generated};
use crate::equations::Robot;
use crate::function::{Family, Function};
use crate::model::states::NO_LIMIT;
use crate::model::{self, ModelOptions};
use crate::options::Options;
use crate::program::{program, Program};
use crate::scene::Scene;
use crate::verify::reference_input::mass_centre_tree;
use std::collections::BTreeMap;
use straightline_core::joint::Measure;
use straightline_core::model::Model;
use straightline_core::random::Random;
use straightline_core::reference::{self, MassCentreFrame, MassCentreTree};
use straightline_core::{trig, Dd};
use straightline_graph::expr::{evaluate, Graph};
use straightline_graph::schedule::Schedule;
use straightline_graph::{element_of, Scalar};

mod drives;
pub mod reference_input;
mod whole;

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
    /// Functions of drives that the reference has no formulation of: tests of their own hold them to laws of physics.
    pub left_out: Vec<&'static str>,
}

impl Verification {
    /// Whether all errors are within the bound.
    pub fn passes(&self) -> bool {
        self.functions.values().all(|worst| worst.error <= self.bound)
    }
}

/// The greatest scaled error that passes: 2^13 roundings. Trees of 40 bodies stay below a hundred; the smallest wrong
/// term that matters is far above.
pub fn bound(scalar: Scalar) -> f64 {
    8192.0 * scalar.unit()
}

/// A natural scale that is so small a part of what it would be if nothing cancelled, is rounding noise.
const NOISE: f64 = 1e-6;

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
    mut tick: impl FnMut(),
) -> Result<Verification, String> {
    let (model, frames) = (&generated.model, &generated.frames);
    let options = &options.knowing(source);
    let scene = &options.scene.resolved(model);
    let options = &Options { scene: scene.clone(), model: scene.model_options(&options.model), ..options.clone() };
    let whole = model::load(source, &options.model).0.ok_or("the file holds no robot")?;
    let coordinates = &Coordinates::new(scene, model, &whole)?;
    let (mut tree, mut added) = second_reading(source, &whole, options)?;
    whole::hold(scene, &whole, &mut tree, &mut added)?;
    let functions = Function::wanted(&options.functions, model);
    let is_left_out = |f: &&Function| {
        f.spec().family == Family::Drives && (whole.nv() != model.nv() || !drives::has(**f, &model.drives))
    };
    let left_out: Vec<&'static str> = functions.iter().filter(is_left_out).map(|f| f.name()).collect();
    let functions = functions.iter().filter(|f| !is_left_out(f));
    let functions = functions.filter(|f| !f.is_per_frame() || !options.scene.frames_of(**f, frames).is_empty());
    let robot = Robot::new(model.clone());
    let programs: Vec<Program> = functions.map(|f| program(&robot, frames, *f, options)).collect();
    let parameters = whole::parameter_programs(&robot, options);
    let mut random = Random(seed);
    let mut worst: BTreeMap<&'static str, Worst> = BTreeMap::new();
    for state in 0..states {
        let mut inputs = State::random(model, options.scalar, &mut random);
        inputs.set_zeros(scene, model);
        let model = &mut model.clone();
        whole::random_drives(&parameters, options.scalar, (&mut inputs, model), &mut random);
        drives::random_inputs(model, options.scalar, &mut inputs, &mut random);
        let tree = &mut tree.clone();
        whole::random_inputs(scene, &parameters, options.scalar, (&mut inputs, tree), &mut random)?;
        let (tree, whole_state) = (&*tree, &coordinates.expand(&inputs));
        for Program { function, graph, schedule, .. } in &programs {
            let values = run((graph, schedule), &inputs, options);
            let names = scene.frames_of(*function, frames);
            let frame = |name: &String| tree.frame(name).ok_or_else(|| format!("the reference has no frame `{name}`"));
            let frames: Vec<&MassCentreFrame<Dd>> = names.iter().map(frame).collect::<Result<_, _>>()?;
            let truth = Truth { tree, drives: &added, frames: &frames, state: whole_state, moving: &coordinates.v };
            let (mut expected, mut scales) = match function.spec().family {
                Family::Drives => {
                    let (h, (bias, scale)) =
                        (truth.outputs(Function::MassMatrix).0, truth.outputs(Function::BiasForce));
                    drives::outputs(*function, model, &h, (&bias, &scale), &inputs)
                }
                _ => truth.outputs(*function),
            };
            let wanted = scene.select(*function, model, frames.len()).0;
            for indices in coordinates.results(*function, frames.len()).into_iter().chain([wanted]) {
                expected = indices.iter().map(|k| expected[*k]).collect();
                scales = indices.iter().map(|k| scales[*k]).collect();
            }
            assert_eq!((values.len(), values.len()), (expected.len(), scales.len()), "{}", function.name());
            let (k, error) = values
                .iter()
                .zip(&expected)
                .zip(&scales)
                .map(|((v, e), s)| scaled(*v, *e, *s))
                .enumerate()
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .unwrap_or((0, 0.0));
            if worst.get(function.name()).is_none_or(|w| error > w.error) {
                let output = element_of(&graph.outputs, k);
                let inputs = graph.inputs.iter().map(|p| (p.name.clone(), inputs.get(&p.name).to_vec())).collect();
                worst.insert(function.name(), Worst { error, state, output, inputs });
            }
        }
        tick();
    }
    let (robot, scalar) = (model.name.clone(), options.scalar);
    Ok(Verification { robot, scalar: scalar.name(), states, seed, bound: bound(scalar), functions: worst, left_out })
}

/// The robot in the reference's terms, its coordinates numbered as the model's, and what joints add to it.
fn second_reading(
    source: &Source,
    model: &Model<Dd>,
    options: &Options,
) -> Result<(MassCentreTree<Dd>, Vec<Drive>), String> {
    let description = description::read(source, &mut Diagnostics::new()).ok_or("the file holds no robot")?;
    let mut tree = mass_centre_tree(&description, &options.model)?;
    for link in &mut tree.links {
        let body = model.bodies.iter().find(|body| body.name == link.name);
        let joint = &body.ok_or_else(|| format!("the model has no body `{}`", link.name))?.joint;
        (link.iq, link.iv) = (joint.iq, joint.iv);
    }
    let joints = model.bodies.iter().map(|body| &body.joint).filter(|joint| joint.kind.is_single());
    let elastic = elastic_springs(&description, &options.model);
    let drives = joints.map(|joint| match elastic.iter().find(|(name, _)| *name == joint.name) {
        Some((_, [stiffness, damping, rest])) => {
            let none = Drive::read(&description, "", joint.iq, joint.iv);
            Drive { stiffness: *stiffness, damping: *damping, rest: *rest, ..none }
        }
        None => Drive::read(&description, &joint.name, joint.iq, joint.iv),
    });
    let drives = drives.collect();
    Ok((tree, drives))
}

/// Stiffness, damping and rest of the joints of flexible links and of a support, by name: EI n/L, GJ n/L.
fn elastic_springs(description: &Description, options: &ModelOptions) -> Vec<(String, [Dd; 3])> {
    let mut springs = Vec::new();
    if options.rigid_links {
        return springs;
    }
    for (k, elastic) in options.support.iter().flat_map(|support| support.directions.iter().enumerate()) {
        if let Some(e) = elastic {
            let numbers = [e.stiffness.value, e.damping.value, e.rest].map(Dd::from);
            springs.push((format!("support_{}", Support::DIRECTIONS[k]), numbers));
        }
    }
    for flexible in options.flexible.iter().chain(&description.flexible) {
        let (link, count) = (&flexible.link.value, flexible.segments.value);
        let squares = (0..3).fold(Dd::ZERO, |sum, k| {
            let d = Dd::from(flexible.to.value[k]) - Dd::from(flexible.from[k]);
            sum + d * d
        });
        let per_length = Dd::from(count as f64) / squares.sqrt();
        let mut about: Vec<(String, f64)> = Vec::new();
        match &flexible.bending {
            Bending::None => {}
            Bending::Round(x) => about.extend(["x", "y", "z"].map(|axis| (format!("bend_{axis}"), x.value))),
            Bending::About(given) => {
                let given = given.iter().zip(["x", "y", "z"]);
                about.extend(given.filter_map(|(x, axis)| Some((format!("bend_{axis}"), x.as_ref()?.value))));
            }
        }
        about.extend(flexible.torsion.as_ref().map(|x| ("twist".to_string(), x.value)));
        for (label, x) in about {
            let spring = Dd::from(x) * per_length;
            let numbers = [spring, spring * Dd::from(flexible.damping.value), Dd::ZERO];
            springs.extend((1..=count).map(|i| (format!("{link}_{label}{i}"), numbers)));
        }
    }
    springs
}

/// The second author's reading of a robot file without a scene, to be asked for the results of any function at any state.
pub struct SecondReading {
    tree: MassCentreTree<Dd>,
    drives: Vec<Drive>,
    moving: Vec<usize>,
}

impl SecondReading {
    /// Reads the file again; of `model`, the compiler's own reading, it takes the places of the coordinates alone.
    ///
    /// # Errors
    /// The reference does not understand the file.
    pub fn new(source: &Source, model: &Model<Dd>, options: &Options) -> Result<SecondReading, String> {
        let (tree, drives) = second_reading(source, model, options)?;
        Ok(SecondReading { tree, drives, moving: (0..model.nv()).collect() })
    }

    /// The results of a function and their natural scales at (q, q̇, q̈, τ), of which every function takes what it needs.
    ///
    /// # Errors
    /// The reference has no frame of that name.
    pub fn outputs(
        &self,
        function: Function,
        frames: &[String],
        at: [&[Dd]; 4],
    ) -> Result<(Vec<Dd>, Vec<f64>), String> {
        let frame = |name: &String| self.tree.frame(name).ok_or_else(|| format!("the reference has no frame `{name}`"));
        let frames: Vec<&MassCentreFrame<Dd>> = frames.iter().map(frame).collect::<Result<_, _>>()?;
        let [q, qd, qdd, tau] = at.map(|x| x.iter().map(|x| x.to_f64()).collect());
        let state = &State { q, qd, qdd, tau, others: BTreeMap::new() };
        let truth = Truth { tree: &self.tree, drives: &self.drives, frames: &frames, state, moving: &self.moving };
        Ok(truth.outputs_at(function, at))
    }
}

/// What a joint adds on its own coordinate, from the file: tau = … + I q̈ + d q̇ + f sgn(q̇) + k (q − q₀).
struct Drive {
    iq: usize,
    iv: usize,
    inertia: Dd,
    damping: Dd,
    friction: Dd,
    stiffness: Dd,
    rest: Dd,
    /// The speed w of f q̇ / √(q̇² + w²) in place of f sgn(q̇).
    smooth: Option<Dd>,
}

impl Drive {
    fn read(description: &Description, joint: &str, iq: usize, iv: usize) -> Drive {
        let none = JointDrive::default();
        let found = match &description.notation {
            Notation::JointFrames(bodies) => bodies.joints.iter().find(|j| j.name.value == joint).map(|j| &j.drive),
            Notation::MassCentres(chain) => {
                chain.links.iter().find(|l| l.joint_name.value == joint).map(|link| &link.drive)
            }
        };
        let drive = found.unwrap_or(&none);
        let number = |x: &Option<Value<f64>>| x.as_ref().map_or(0.0, |x| x.value);
        let gear = Dd::from(drive.gear_ratio.as_ref().map_or(1.0, |x| x.value));
        Drive {
            iq,
            iv,
            inertia: Dd::from(number(&drive.armature)) + gear * gear * Dd::from(number(&drive.rotor_inertia)),
            damping: Dd::from(number(&drive.damping)),
            friction: Dd::from(number(&drive.friction)),
            stiffness: Dd::from(number(&drive.spring_stiffness)),
            rest: Dd::from(number(&drive.spring_rest)),
            smooth: None,
        }
    }

    /// What friction and spring take, and the sum of the moduli of its terms.
    fn passive(&self, q: &[Dd], qd: &[Dd]) -> (Dd, f64) {
        let (q, qd) = (q[self.iq], qd[self.iv]);
        let dry = match (self.smooth, qd.to_f64()) {
            (Some(speed), _) => self.friction * (qd / (qd * qd + speed * speed).sqrt()),
            (None, v) if v > 0.0 => self.friction,
            (None, v) if v < 0.0 => -self.friction,
            _ => Dd::ZERO,
        };
        let (viscous, spring) = (self.damping * qd, self.stiffness * (q - self.rest));
        let moduli = (self.stiffness * q).abs() + (self.stiffness * self.rest).abs() + viscous.abs() + dry.abs();
        (viscous + dry + spring, moduli.to_f64())
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

/// The program's outputs in its own arithmetic; of one that fuses, as on a machine with the instruction.
fn run((graph, schedule): (&Graph, &Schedule), state: &State, options: &Options) -> Vec<f64> {
    let inputs = graph.inputs.iter().flat_map(|port| state.get(&port.name)).copied();
    let program = (graph, schedule);
    match (options.scalar, options.fma) {
        (Scalar::F64, false) => evaluate::<f64>(graph, &inputs.collect::<Vec<_>>()),
        (Scalar::F64, true) => {
            let sin_cos = |x| trig::sin_cos_of_sum_fused_f64(x, f64::mul_add);
            fused::evaluate(program, &inputs.collect::<Vec<_>>(), f64::mul_add, sin_cos)
        }
        (Scalar::F32, fma) => {
            let inputs: Vec<f32> = inputs.map(|x| x as f32).collect();
            let sin_cos = |x| trig::sin_cos_of_sum_fused_f32(x, f32::mul_add);
            let results = match fma {
                false => evaluate(graph, &inputs),
                true => fused::evaluate(program, &inputs, f32::mul_add, sin_cos),
            };
            results.into_iter().map(f64::from).collect()
        }
    }
}

/// Inputs of all functions.
#[derive(Clone, Default)]
struct State {
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
    tau: Vec<f64>,
    /// Inputs that a scene adds.
    others: BTreeMap<String, Vec<f64>>,
}

impl State {
    fn get(&self, name: &str) -> &[f64] {
        match name {
            "q" => &self.q,
            "qd" => &self.qd,
            "qdd" => &self.qdd,
            "tau" => &self.tau,
            _ => self.others.get(name).expect("every input that a scene adds has a value"),
        }
    }

    /// Zeros where the scene knows of them.
    fn set_zeros(&mut self, scene: &Scene, model: &Model<Dd>) {
        for (rates, is_zero) in [(&mut self.qd, scene.zero.qd), (&mut self.qdd, scene.zero.qdd)] {
            if is_zero {
                rates.fill(0.0);
            }
            for joint in model.bodies.iter().map(|b| &b.joint) {
                if scene.zero.joints_at_rest.contains(&joint.name) {
                    rates[joint.iv..joint.iv + joint.kind.nv()].fill(0.0);
                }
            }
        }
    }

    /// Inside the limits; without them, angles within a turn, slides within a metre, moderate speeds and forces.
    fn random(model: &Model<Dd>, scalar: Scalar, random: &mut Random) -> State {
        let nv = model.nv();
        let (mut q, mut qd) = (vec![0.0; model.nq()], vec![0.0; nv]);
        let (mut qdd, mut tau) = (vec![0.0; nv], vec![0.0; nv]);
        for joint in model.bodies.iter().map(|b| &b.joint) {
            let limits = joint.limits;
            let finite = |x: f64, otherwise: f64| if x.abs() <= NO_LIMIT { x } else { otherwise };
            for (q, measure) in q[joint.iq..].iter_mut().zip(joint.kind.measures()) {
                let wide = match measure {
                    _ if joint.kind.is_base() => 2.0,
                    Measure::Angle => std::f64::consts::PI,
                    Measure::Length => 1.0,
                };
                let lower = finite(limits.lower, finite(limits.upper, wide) - 2.0 * wide);
                let upper = finite(limits.upper, lower + 2.0 * wide);
                *q = lower + (upper - lower) * random.unit();
            }
            if let Some(first) = joint.kind.row().quaternion {
                q[joint.iq + first..joint.iq + first + 4].copy_from_slice(&quaternion(random));
            }
            for i in joint.iv..joint.iv + joint.kind.nv() {
                qd[i] = random.symmetric(finite(limits.velocity, 2.0).min(10.0));
                qdd[i] = random.symmetric(5.0);
                tau[i] = random.symmetric(finite(limits.effort, 20.0).min(100.0));
            }
        }
        for x in q.iter_mut().chain(&mut qd).chain(&mut qdd).chain(&mut tau) {
            *x = scalar.rounded(*x);
        }
        State { q, qd, qdd, tau, others: BTreeMap::new() }
    }
}

/// A unit quaternion: a point of the ball, not too near its centre, divided by its length.
fn quaternion(random: &mut Random) -> [f64; 4] {
    loop {
        let x: [f64; 4] = std::array::from_fn(|_| random.symmetric(1.0));
        let square: f64 = x.iter().map(|x| x * x).sum();
        if (0.01..=1.0).contains(&square) {
            return x.map(|x| x / square.sqrt());
        }
    }
}

/// The reference at a state.
struct Truth<'a> {
    tree: &'a MassCentreTree<Dd>,
    drives: &'a [Drive],
    frames: &'a [&'a MassCentreFrame<Dd>],
    state: &'a State,
    /// The velocity coordinates that move.
    moving: &'a [usize],
}

/// How far and how fast a point of the robot can be said to be, when nothing cancels.
#[derive(Clone, Copy, Default)]
struct Reach {
    /// Sum of the distances from the joint nearest the base to the point \[m\].
    length: f64,
    /// The same from the world's origin.
    position: f64,
    /// Sum of the angular speeds below it \[rad/s\].
    turning: f64,
    /// Sum of the linear speeds that they give it \[m/s\].
    moving: f64,
    /// The same of the accelerations in the joints \[rad/s², m/s²\].
    turning_rate: f64,
    moving_rate: f64,
}

impl Truth<'_> {
    /// The outputs of a function and their natural scales.
    fn outputs(&self, function: Function) -> (Vec<Dd>, Vec<f64>) {
        let state = [&self.state.q, &self.state.qd, &self.state.qdd, &self.state.tau];
        let [q, qd, qdd, tau] = state.map(|x| x.iter().map(|x| Dd::from(*x)).collect::<Vec<Dd>>());
        self.outputs_at(function, [&q, &qd, &qdd, &tau])
    }

    /// The same with the state in more digits than it is kept in, for values; scales take what is kept.
    fn outputs_at(&self, function: Function, [q, qd, qdd, tau]: [&[Dd]; 4]) -> (Vec<Dd>, Vec<f64>) {
        use Function::*;
        let tree = self.tree;
        let rest = &vec![Dd::ZERO; qd.len()];
        let narrow = |x: &[Dd]| x.iter().map(|x| x.to_f64().abs()).collect::<Vec<f64>>();
        let force_scale = |qd: &[Dd], qdd: &[Dd]| {
            let mut scales = narrow(reference::natural_scale(tree, q, qd, qdd).as_slice());
            let (moves, drives) = (qd.iter().any(|x| *x != Dd::ZERO), qdd.iter().any(|x| *x != Dd::ZERO));
            self.raise(&mut scales, length(tree.gravity.as_slice()), (moves, drives));
            scales
        };
        let per_frame = |values: &dyn Fn(&MassCentreFrame<Dd>) -> Vec<Dd>, scales: &dyn Fn(Reach) -> Vec<f64>| {
            let reach = |f: &MassCentreFrame<Dd>| self.reach(f.link, length(f.position.as_slice()));
            (
                self.frames.iter().flat_map(|f| values(f)).collect(),
                self.frames.iter().flat_map(|f| scales(reach(f))).collect(),
            )
        };
        let motion = |linear: f64, angular: f64| [[linear; 3], [angular; 3]].concat();
        match function {
            ForwardKinematics => per_frame(
                &|f| {
                    let pose = reference::frame_pose(tree, f, q);
                    [pose.position.as_slice(), pose.rotation.transpose().as_slice()].concat()
                },
                &|r| [&[r.position; 3][..], &[1.0; 9]].concat(),
            ),
            FrameVelocity => per_frame(&|f| reference::frame_velocity(tree, f, q, qd).as_slice().to_vec(), &|r| {
                motion(r.moving, r.turning)
            }),
            FrameAcceleration => {
                per_frame(&|f| reference::frame_acceleration(tree, f, q, qd, qdd).as_slice().to_vec(), &|r| {
                    motion(r.moving_rate + 2.0 * r.turning * r.moving, r.turning_rate + r.turning * r.turning)
                })
            }
            JacobianBias => per_frame(&|f| reference::frame_jacobian_bias(tree, f, q, qd).as_slice().to_vec(), &|r| {
                motion(2.0 * r.turning * r.moving, r.turning * r.turning)
            }),
            Jacobian => per_frame(&|f| reference::frame_jacobian(tree, f, q).transpose().as_slice().to_vec(), &|r| {
                [vec![r.length.max(1.0); 3 * qd.len()], vec![1.0; 3 * qd.len()]].concat()
            }),
            KinematicsAndJacobian => {
                let (mut values, mut scales) = self.outputs_at(ForwardKinematics, [q, qd, qdd, tau]);
                let jacobian = self.outputs_at(Jacobian, [q, qd, qdd, tau]);
                values.extend(jacobian.0);
                scales.extend(jacobian.1);
                (values, scales)
            }
            InverseDynamics => {
                let mut forces = reference::inverse_dynamics(tree, q, qd, qdd).as_slice().to_vec();
                let mut scales = force_scale(qd, qdd);
                self.add_passive(q, qd, &mut forces, &mut scales);
                for drive in self.drives {
                    let force = drive.inertia * qdd[drive.iv];
                    forces[drive.iv] += force;
                    scales[drive.iv] += force.to_f64().abs();
                }
                (forces, scales)
            }
            GravityForce => (reference::gravity_force(tree, q).as_slice().to_vec(), force_scale(rest, rest)),
            BiasForce => {
                let mut forces = reference::bias_force(tree, q, qd).as_slice().to_vec();
                let mut scales = force_scale(qd, rest);
                self.add_passive(q, qd, &mut forces, &mut scales);
                (forces, scales)
            }
            VelocityForce => {
                let mut weightless = tree.clone();
                weightless.gravity.fill(Dd::ZERO);
                let mut scales = narrow(reference::natural_scale(&weightless, q, qd, rest).as_slice());
                self.raise(&mut scales, 0.0, (true, false));
                (reference::velocity_force(tree, q, qd).as_slice().to_vec(), scales)
            }
            MassMatrix => {
                let mut h = reference::mass_matrix(tree, q);
                self.drives.iter().for_each(|drive| h[(drive.iv, drive.iv)] += drive.inertia);
                let uncancelled = self.uncancelled_inertias();
                let root: Vec<f64> =
                    (0..h.nrows()).map(|i| h[(i, i)].to_f64().max(NOISE * uncancelled[i]).sqrt()).collect();
                (h.as_slice().to_vec(), root.iter().flat_map(|a| root.iter().map(move |b| a * b)).collect())
            }
            ForwardDynamics => {
                let mut h = reference::mass_matrix(tree, q);
                self.drives.iter().for_each(|drive| h[(drive.iv, drive.iv)] += drive.inertia);
                let mut value = reference::bias_force(tree, q, qd);
                let mut bias = force_scale(qd, rest);
                self.add_passive(q, qd, value.as_mut_slice(), &mut bias);
                value.iter_mut().zip(tau).for_each(|(force, tau)| *force = *tau - *force);
                // of the joints that move
                let h = h.select_rows(self.moving).select_columns(self.moving);
                let value = reference::solve_symmetric(&h, &value.select_rows(self.moving));
                let pick = |x: &[f64]| self.moving.iter().map(|i| x[*i]).collect::<Vec<f64>>();
                let (bias, tau) = (pick(&bias), pick(&self.state.tau));
                // |H⁻¹| (|τ| + scale of h + |H| |q̈|)
                let n = h.nrows();
                let forces: Vec<f64> = (0..n)
                    .map(|i| {
                        let inertial: f64 = (0..n).map(|j| (h[(i, j)] * value[j]).to_f64().abs()).sum();
                        tau[i].abs() + bias[i] + inertial
                    })
                    .collect();
                let mut scale = vec![0.0; n];
                for (j, force) in forces.iter().enumerate() {
                    let mut column = value.clone();
                    column.fill(Dd::ZERO);
                    column[j] = Dd::ONE;
                    let column = reference::solve_symmetric(&h, &column);
                    scale.iter_mut().zip(narrow(column.as_slice())).for_each(|(s, c)| *s += c * force);
                }
                (value.as_slice().to_vec(), scale)
            }
            JointWrenches => {
                let wrenches = reference::joint_wrenches(tree, q, qd, qdd);
                let scales = self.wrench_scales(q, qd, qdd);
                let mut order: Vec<usize> = (0..tree.links.len()).collect();
                order.sort_by_key(|j| tree.links[*j].iv);
                (
                    order.iter().flat_map(|j| wrenches[*j]).collect(),
                    order.iter().flat_map(|j| motion(scales[*j].0, scales[*j].1)).collect(),
                )
            }
            Energy => {
                let mut values = vec![reference::kinetic_energy(tree, q, qd), reference::potential_energy(tree, q)];
                let g = length(tree.gravity.as_slice());
                let mut scales = self.over_links(|m, inertia, r| {
                    [(m * r.moving * r.moving + inertia * r.turning * r.turning) / 2.0, m * g * r.position]
                });
                for drive in self.drives {
                    let (rate, stretch) = (qd[drive.iv], q[drive.iq] - drive.rest);
                    let energies =
                        [drive.inertia * rate * rate * Dd::HALF, drive.stiffness * stretch * stretch * Dd::HALF];
                    for (k, energy) in energies.into_iter().enumerate() {
                        values[k] += energy;
                        scales[k] += energy.to_f64();
                    }
                }
                (values, scales.to_vec())
            }
            CentreOfMass => {
                let [mass, moment] = self.over_links(|m, _, r| [m, m * r.position]);
                (reference::centre_of_mass(tree, q).as_slice().to_vec(), vec![moment / mass; 3])
            }
            Momentum => {
                let momentum = reference::momentum(tree, q, qd);
                let values = [momentum.linear.as_slice(), momentum.angular_about_mass_centre.as_slice()].concat();
                let [linear, angular] = self
                    .over_links(|m, inertia, r| [m * r.moving, 2.0 * m * r.length * r.moving + inertia * r.turning]);
                (values, motion(linear, angular))
            }
            DrivenForwardDynamics
            | DrivenInverseDynamics
            | DriveTorques
            | CompleteModel
            | StateSpace
            | DrivePower
            | DriveEnergy => unreachable!("functions of drives are left out"),
        }
    }

    /// Adds friction and springs to forces and to their scales.
    fn add_passive(&self, q: &[Dd], qd: &[Dd], forces: &mut [Dd], scales: &mut [f64]) {
        for drive in self.drives {
            let (force, scale) = drive.passive(q, qd);
            forces[drive.iv] += force;
            scales[drive.iv] += scale;
        }
    }

    /// Raises natural scales of forces that are rounding noise themselves: where a mass centre lies on the axis that turns it, its
    /// acceleration cancels, and nothing is left to judge by.
    fn raise(&self, scales: &mut [f64], weight: f64, (moves, drives): (bool, bool)) {
        let mut uncancelled = vec![0.0; scales.len()];
        for (k, link) in self.tree.links.iter().enumerate() {
            let reach = self.reach(Some(k), 0.0);
            let part = |on: bool, x: f64| if on { x } else { 0.0 };
            let acceleration =
                weight + part(moves, 2.0 * reach.turning * reach.moving) + part(drives, reach.moving_rate);
            let spin = part(moves, reach.turning * reach.turning) + part(drives, reach.turning_rate);
            let force = link.mass.to_f64().abs() * acceleration;
            let moment = force * reach.length + length(link.inertia.as_slice()) * spin;
            let mut at = Some(k);
            while let Some(j) = at {
                let joint = &self.tree.links[j];
                let of_joint: &mut [f64] = &mut uncancelled[joint.iv..joint.iv + joint.joint.nv()];
                let terms = match shares(joint) {
                    Some([turns, slides]) => vec![turns * moment + slides * force],
                    None => [[force; 3], [moment; 3]].concat(),
                };
                of_joint.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
                at = joint.parent;
            }
        }
        scales.iter_mut().zip(uncancelled).for_each(|(scale, most)| *scale = scale.max(NOISE * most));
    }

    /// What the diagonal of the mass matrix would be if every mass centre stood off every axis as far as it can. Where all that a joint
    /// moves comes to lie on its axis, the entry itself is rounding noise, and nothing is left to judge by.
    fn uncancelled_inertias(&self) -> Vec<f64> {
        let tree = self.tree;
        let mut sums = vec![0.0; tree.nv()];
        for link in &tree.links {
            let (mass, inertia) = (link.mass.to_f64().abs(), length(link.inertia.as_slice()));
            let mut lever = 0.0;
            let mut carrier = Some(link);
            while let Some(joint) = carrier {
                lever += length(joint.r.as_slice());
                let moment = mass * lever * lever + inertia;
                let terms = match shares(joint) {
                    Some([turns, slides]) => vec![turns * turns * moment + slides * slides * mass],
                    None => [[mass; 3], [moment; 3]].concat(),
                };
                sums[joint.iv..].iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
                lever += shares(joint).map_or(0.0, |[_, slides]| slides * self.state.q[joint.iq].abs());
                lever += length(joint.r_parent.as_slice());
                carrier = joint.parent.map(|parent| &tree.links[parent]);
            }
        }
        sums
    }

    /// The reach of a point of a link, `beyond` its mass centre.
    fn reach(&self, link: Option<usize>, beyond: f64) -> Reach {
        let mut r = Reach { length: beyond, ..Reach::default() };
        let mut at = link;
        let mut base = 0.0;
        while let Some(k) = at {
            let link = &self.tree.links[k];
            let (q, v) = (&self.state.q[link.iq..], link.iv);
            r.length += length(link.r.as_slice());
            let joint = |rates: &[f64], turning: &mut f64, moving: &mut f64| match shares(link) {
                Some([turns, slides]) => {
                    *turning += turns * rates[v].abs();
                    *moving += rates[v].abs() * (turns * r.length + slides);
                }
                None => {
                    let angular = norm(&rates[v + 3..v + 6]);
                    *turning += angular;
                    *moving += norm(&rates[v..v + 3]) + angular * r.length;
                }
            };
            joint(&self.state.qd, &mut r.turning, &mut r.moving);
            joint(&self.state.qdd, &mut r.turning_rate, &mut r.moving_rate);
            match shares(link) {
                Some([_, slides]) => r.length += slides * q[0].abs(),
                None => base = norm(&q[..3]),
            }
            r.length += length(link.r_parent.as_slice());
            at = link.parent;
        }
        r.position = r.length + base;
        r
    }

    /// Sums over the links of what `f` makes of mass, inertia and reach.
    fn over_links<const N: usize>(&self, f: impl Fn(f64, f64, Reach) -> [f64; N]) -> [f64; N] {
        let mut sum = [0.0; N];
        for (k, link) in self.tree.links.iter().enumerate() {
            let terms = f(link.mass.to_f64().abs(), length(link.inertia.as_slice()), self.reach(Some(k), 0.0));
            sum.iter_mut().zip(terms).for_each(|(s, t)| *s += t);
        }
        sum
    }

    /// Force and moment scales of every joint: m |w − g| of the links that it carries, with their levers, and their
    /// couples.
    fn wrench_scales(&self, q: &[Dd], qd: &[Dd], qdd: &[Dd]) -> Vec<(f64, f64)> {
        let tree = self.tree;
        let geometry = reference::geometry(tree, q);
        let motions = reference::motion(tree, &geometry, qd, qdd);
        let mut scales = vec![(0.0, 0.0); tree.links.len()];
        for (k, link) in tree.links.iter().enumerate() {
            let force = link.mass.to_f64() * length((motions[k].w - tree.gravity).as_slice());
            let inertia = length(link.inertia.as_slice());
            let (omega, epsilon) = (length(motions[k].omega.as_slice()), length(motions[k].epsilon.as_slice()));
            let couple = inertia * (epsilon + omega * omega);
            let mut lever = 0.0;
            let mut at = Some(k);
            while let Some(j) = at {
                let joint = &tree.links[j];
                lever += length(joint.r.as_slice());
                scales[j].0 += force;
                scales[j].1 += force * lever + couple;
                lever += shares(joint).map_or(0.0, |[_, slides]| slides * self.state.q[joint.iq].abs());
                lever += length(joint.r_parent.as_slice());
                at = joint.parent;
            }
        }
        scales
    }
}

/// How much the joint of a link turns and slides per unit of its coordinate; `None`: it moves freely.
fn shares(link: &reference::MassCentreLink<Dd>) -> Option<[f64; 2]> {
    link.joint.shares::<Dd>().map(|shares| shares.map(|share| share.to_f64().abs()))
}

fn length(v: &[Dd]) -> f64 {
    norm(&v.iter().map(|x| x.to_f64()).collect::<Vec<_>>())
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}
