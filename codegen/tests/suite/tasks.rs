//! Tasks of frames: identities of the operational space, and inverse kinematics that arrives.

use super::written::Random;
use nalgebra::{DMatrix, DVector, Matrix3};
use straightline_codegen::diagnostic::Source;
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::{evaluate, Graph};
use straightline_codegen::model::{self, ModelOptions};
use straightline_codegen::options::Options;
use straightline_codegen::program::program;
use straightline_codegen::scene::{ResultPart, Selection};
use straightline_codegen::{function::SelectedRows, Function};
use straightline_core::{Dd, Real};

/// Double-double keeps so much of identities between matrices of well-conditioned tasks.
const IDENTITY: f64 = 1e-20;

/// A robot of which programs are asked.
pub(super) struct Asked {
    pub(super) robot: Robot,
    options: Options,
    frame: Vec<String>,
    pub(super) name: String,
}

impl Asked {
    fn of_file(file: &str, frame: &str, floating_base: bool) -> Asked {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../robots/descriptions/").to_string() + file;
        Asked::new(&Source::new(file, std::fs::read_to_string(&path).expect("a robot file")), frame, floating_base)
    }

    fn new(source: &Source, frame: &str, floating_base: bool) -> Asked {
        let model = ModelOptions { floating_base, ..ModelOptions::default() };
        let (loaded, diagnostics) = model::load(source, &model);
        let loaded = loaded.unwrap_or_else(|| panic!("{diagnostics}"));
        let (options, name) = (Options { model, ..Options::default() }, loaded.name.clone());
        Asked { robot: Robot::new(loaded), options, frame: vec![frame.to_string()], name }
    }

    pub(super) fn nv(&self) -> usize {
        self.robot.model.nv()
    }

    pub(super) fn graph(&self, function: Function) -> Graph {
        program(&self.robot, &self.frame, function, &self.options).graph
    }

    /// With these rows of the task alone.
    fn with_rows(&self, function: Function, places: &[usize]) -> Graph {
        let mut options = self.options.clone();
        let part = ResultPart::Rows(SelectedRows::of(places.iter().copied()));
        options.scene.outputs.insert(function, Selection { part, ..Selection::default() });
        program(&self.robot, &self.frame, function, &options).graph
    }

    /// Anywhere within the limits, without those within ±2; a base somewhere.
    pub(super) fn configuration(&self, random: &mut Random) -> Vec<f64> {
        let mut q = vec![0.0; self.robot.model.nq()];
        for joint in self.robot.model.free_joints() {
            let own = &mut q[joint.iq..joint.iq + joint.kind.nq()];
            match joint.kind.is_single() {
                true => own[0] = random.between(joint.limits.lower.max(-2.0), joint.limits.upper.min(2.0)),
                false => own.copy_from_slice(&[0.3, -0.2, 0.5, 0.48, -0.36, 0.64, 0.48]),
            }
        }
        q
    }
}

/// A program at these inputs, one after the other as it has them.
pub(super) fn run<T: Real>(graph: &Graph, inputs: &[&[f64]]) -> Vec<T> {
    let lengths: Vec<usize> = graph.inputs.iter().map(|port| port.len()).collect();
    assert_eq!(lengths, inputs.iter().map(|x| x.len()).collect::<Vec<_>>());
    evaluate(graph, &inputs.concat().into_iter().map(|x| T::constant(Dd::from(x))).collect::<Vec<_>>())
}

/// The blocks of its results, by rows; of one frame.
pub(super) fn blocks<T: Real>(graph: &Graph, results: &[T]) -> Vec<Vec<T>> {
    let mut rest = results;
    let of_port = |len: usize| {
        let (own, others) = rest.split_at(len);
        rest = others;
        own.to_vec()
    };
    graph.outputs.iter().map(|port| port.len()).map(of_port).collect()
}

pub(super) fn matrix(rows: usize, x: &[Dd]) -> DMatrix<Dd> {
    DMatrix::from_row_slice(rows, x.len() / rows, x)
}

pub(super) fn vector(x: &[Dd]) -> DVector<Dd> {
    DVector::from_column_slice(x)
}

/// Whether a symmetric matrix has positive pivots.
fn is_positive(mut a: DMatrix<Dd>) -> bool {
    (0..a.nrows()).all(|k| {
        for i in k + 1..a.nrows() {
            let factor = a[(i, k)] / a[(k, k)];
            (k..a.nrows()).for_each(|j| a[(i, j)] = a[(i, j)] - factor * a[(k, j)]);
        }
        a[(k, k)] > Dd::ZERO
    })
}

#[track_caller]
pub(super) fn hold(what: &str, found: &DMatrix<Dd>, expected: &DMatrix<Dd>) {
    let greatest = expected.iter().map(|x| x.to_f64().abs()).fold(1.0, f64::max);
    for (found, expected) in found.iter().zip(expected.iter()) {
        let off = (*found - *expected).to_f64().abs();
        assert!(off <= IDENTITY * greatest, "{what}: {off:e} of {greatest:e}");
    }
}

pub(super) fn robots() -> Vec<Asked> {
    vec![
        Asked::of_file("ur5.urdf", "tool0", false),
        Asked::of_file("panda.urdf", "panda_hand_tcp", false),
        Asked::of_file("hyq.urdf", "lf_foot", true),
        Asked::new(&redundant_arm(7), "link7", false),
    ]
}

/// Λ is symmetric and positive, J J̄ = 1, J N = 0, N² = N, J H⁻¹ Nᵀ = 0, and for any τ: Λ (J q̈ + J̇ q̇) + μ + p = J̄ᵀ τ.
#[test]
fn the_operational_space_obeys_its_identities_and_the_equations_of_motion() {
    for asked in robots() {
        let nv = asked.nv();
        let space = asked.graph(Function::OperationalSpaceDynamics);
        let [jacobian, bias, inertia, motion] =
            [Function::Jacobian, Function::JacobianBias, Function::MassMatrix, Function::ForwardDynamics]
                .map(|function| asked.graph(function));
        let mut random = Random(3);
        for _ in 0..3 {
            let q = asked.configuration(&mut random);
            let [qd, tau] = [2.0, 30.0].map(|most| (0..nv).map(|_| random.between(-most, most)).collect::<Vec<f64>>());
            let found = blocks(&space, &run::<Dd>(&space, &[&q, &qd, &[0.0]]));
            let (lambda, j_bar, n) = (matrix(6, &found[0]), matrix(nv, &found[3]), matrix(nv, &found[4]));
            let j = matrix(6, &run::<Dd>(&jacobian, &[&q]));
            let name = &asked.name;
            hold(&format!("{name}: Λ is symmetric"), &lambda, &lambda.transpose());
            assert!(is_positive(lambda.clone()), "{name}: Λ is positive");
            hold(&format!("{name}: J J̄ = 1"), &(&j * &j_bar), &DMatrix::identity(6, 6));
            hold(&format!("{name}: J N = 0"), &(&j * &n), &DMatrix::zeros(6, nv));
            hold(&format!("{name}: N² = N"), &(&n * &n), &n);
            // H N is symmetric, as Nᵀ H = H N
            let h = matrix(nv, &run::<Dd>(&inertia, &[&q]));
            hold(&format!("{name}: H N = Nᵀ H"), &(&h * &n), &(n.transpose() * &h));
            let qdd = vector(&run::<Dd>(&motion, &[&q, &qd, &tau]));
            let acceleration = &j * qdd + vector(&run::<Dd>(&bias, &[&q, &qd]));
            let left = lambda * acceleration + vector(&found[1]) + vector(&found[2]);
            let right = j_bar.transpose() * vector(&tau.iter().map(|x| Dd::from(*x)).collect::<Vec<_>>());
            let [left, right] = [left, right].map(|x| DMatrix::from_column_slice(6, 1, x.as_slice()));
            hold(&format!("{name}: Λ ẍ + μ + p = J̄ᵀ τ"), &left, &right);
        }
    }
}

/// Of a planar arm the task has two rows; with six Λ does not exist, and with damping λ no force answers more than 1/λ².
#[test]
fn a_task_of_two_rows_is_exact_and_one_of_six_is_damped() {
    let asked = Asked::of_file("planar2r.urdf", "tip", false);
    let two = asked.with_rows(Function::OperationalSpaceDynamics, &[0, 2]);
    let (q, qd) = ([0.4, 0.9], [0.3, -0.7]);
    let found = blocks(&two, &run::<Dd>(&two, &[&q, &qd, &[0.0]]));
    assert_eq!(
        two.outputs.iter().map(|p| p.shape.clone()).collect::<Vec<_>>(),
        [vec![1, 2, 2], vec![1, 2], vec![1, 2], vec![1, 2, 2], vec![1, 2, 2]]
    );
    let j = matrix(6, &run::<Dd>(&asked.graph(Function::Jacobian), &[&q])).select_rows(&[0, 2]);
    let h = matrix(2, &run::<Dd>(&asked.graph(Function::MassMatrix), &[&q]));
    // of a square Jacobian Λ = J⁻ᵀ H J⁻¹
    hold("Jᵀ Λ J = H", &(j.transpose() * matrix(2, &found[0]) * &j), &h);
    hold("N = 0", &matrix(2, &found[4]), &DMatrix::zeros(2, 2));
    let six = asked.graph(Function::OperationalSpaceDynamics);
    let undamped = run::<f64>(&six, &[&q, &qd, &[0.0]]);
    assert!(undamped[..36].iter().any(|x| !x.is_finite()), "{undamped:?}");
    let damped = run::<f64>(&six, &[&q, &qd, &[0.25]]);
    assert!(damped.iter().all(|x| x.is_finite()));
    let most = damped[..36].iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    assert!(most <= 16.0 * (1.0 + 1e-12), "{most}");
}

/// Along a motion Jᵀ f changes by J̇ᵀ f; without moments its derivative is symmetric; and forces on two frames add up.
#[test]
fn the_derivative_of_held_forces_is_that_of_the_jacobian_along_a_motion() {
    for asked in robots() {
        let nv = asked.nv();
        let product = asked.graph(Function::JacobianHessianProduct);
        let rates = asked.graph(Function::FrameDerivatives);
        let mut random = Random(8);
        let q = asked.configuration(&mut random);
        let mut numbers = |n: usize| (0..n).map(|_| random.between(-2.0, 2.0)).collect::<Vec<f64>>();
        let (qd, qdd, f) = (numbers(nv), numbers(nv), numbers(6));
        let found = blocks(&product, &run::<Dd>(&product, &[&q, &f]));
        let j_dot = blocks(&rates, &run::<Dd>(&rates, &[&q, &qd, &qdd])).remove(4);
        let wide = |x: &[f64]| DMatrix::from_iterator(x.len(), 1, x.iter().map(|x| Dd::from(*x)));
        let along = matrix(nv, &found[1]) * wide(&qd);
        hold(&asked.name, &along, &(matrix(6, &j_dot).transpose() * wide(&f)));
        if asked.robot.model.bodies.iter().all(|b| b.joint.kind.is_single()) {
            let force = [f[0], f[1], f[2], 0.0, 0.0, 0.0];
            let hessian = matrix(nv, &blocks(&product, &run::<Dd>(&product, &[&q, &force]))[1]);
            hold(&asked.name, &hessian, &hessian.transpose());
        }
    }
}

/// What the first joint of a robot carries is all of it.
#[test]
fn the_first_subtree_is_the_robot() {
    // a quaternion of f64 has length one to a rounding
    for asked in robots().into_iter().filter(|asked| asked.nv() == asked.robot.model.nq()) {
        let (nv, joints) = (asked.nv(), asked.robot.model.bodies.len());
        let [all, centre, jacobian] =
            [Function::SubtreeCentresOfMass, Function::CentreOfMass, Function::CentreOfMassJacobian]
                .map(|f| asked.graph(f));
        let q = asked.configuration(&mut Random(5));
        let found = blocks(&all, &run::<Dd>(&all, &[&q]));
        let mass: f64 = asked.robot.model.bodies.iter().map(|b| b.inertia.mass.to_f64()).sum();
        assert!((found[0][0].to_f64() - mass).abs() <= 1e-14 * mass);
        hold("centre", &matrix(3, &found[1][..3]), &matrix(3, &run::<Dd>(&centre, &[&q])));
        hold("Jacobian", &matrix(3, &found[2][..3 * nv]), &matrix(3, &run::<Dd>(&jacobian, &[&q])));
        assert_eq!(found[1].len(), 3 * joints);
    }
}

/// The step of no damping without limits in the way is J̄ e: of all that meet the task to first order it has the least kinetic energy.
#[test]
fn a_small_step_is_that_of_the_dynamically_consistent_inverse() {
    let asked = Asked::of_file("panda.urdf", "panda_hand_tcp", false);
    let [step, space] = [Function::InverseKinematicsStep, Function::OperationalSpaceDynamics].map(|f| asked.graph(f));
    let q = [0.3, 0.4, -0.6, -1.2, 0.8, 1.9, 0.5];
    let error = [1e-3, -2e-3, 5e-4, 1e-3, 2e-3, -1e-3];
    let found = run::<Dd>(&step, &[&q, &error, &[1.0; 6], &[0.0], &[0.0]]);
    let j_bar = matrix(7, &blocks(&space, &run::<Dd>(&space, &[&q, &[0.0; 7], &[0.0]]))[3]);
    let error = DMatrix::from_iterator(6, 1, error.iter().map(|x| Dd::from(*x)));
    hold("δq = J̄ e", &DMatrix::from_column_slice(7, 1, &found), &(j_bar * error));
}

/// An arm of so many joints with axes, offsets and masses of no symmetry, and narrow limits.
fn redundant_arm(joints: usize) -> Source {
    let mut random = Random(41);
    let mut any = |least: f64, most: f64| random.between(least, most);
    let mut text = "<robot name=\"redundant\">\n<link name=\"link0\"/>\n".to_string();
    for k in 1..=joints {
        let mass = any(0.5, 4.0) / k as f64;
        let [xx, yy, zz] = [0; 3].map(|_| mass * any(0.02, 0.03));
        let [x, y, z] = [any(-0.1, 0.1), any(-0.1, 0.1), any(0.05, 0.2)];
        let [roll, pitch, yaw] = [any(0.9, 1.7) * if k % 2 == 0 { 1.0 } else { -1.0 }, any(-0.3, 0.3), any(-1.0, 1.0)];
        text += &format!(
            "<link name=\"link{k}\"><inertial><origin xyz=\"{x} {y} {z}\"/><mass value=\"{mass}\"/><inertia ixx=\"{xx}\" iyy=\"{yy}\" \
             izz=\"{zz}\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\n<joint name=\"joint{k}\" type=\"revolute\"><parent \
             link=\"link{}\"/><child link=\"link{k}\"/><origin xyz=\"{} {} {}\" rpy=\"{roll} {pitch} {yaw}\"/><axis xyz=\"0 0 1\"/><limit \
             lower=\"{}\" upper=\"{}\" velocity=\"2\" effort=\"{}\"/></joint>\n",
            k - 1,
            any(-0.1, 0.1),
            any(-0.1, 0.1),
            any(0.15, 0.35),
            -any(1.9, 2.6),
            any(1.9, 2.6),
            100.0 / k as f64,
        );
    }
    Source::new("redundant.urdf", text + "</robot>\n")
}

/// From a pose to a pose: how far the origin has to go, and the rotation vector, world axes.
fn error(from: &[f64], to: &[f64]) -> [f64; 6] {
    let rotation = |x: &[f64]| Matrix3::from_row_slice(&x[3..12]);
    let r = rotation(to) * rotation(from).transpose();
    // sin θ and cos θ, each twice
    let axis = [r[(2, 1)] - r[(1, 2)], r[(0, 2)] - r[(2, 0)], r[(1, 0)] - r[(0, 1)]];
    let (sin, cos) = (axis.iter().map(|x| x * x).sum::<f64>().sqrt(), r[(0, 0)] + r[(1, 1)] + r[(2, 2)] - 1.0);
    let [x, y, z] = axis.map(|x| if sin > 0.0 { x / sin * sin.atan2(cos) } else { 0.0 });
    [to[0] - from[0], to[1] - from[1], to[2] - from[2], x, y, z]
}

/// What became of an iteration.
struct Iteration {
    q: Vec<f64>,
    /// Steps that it took; `None`: it did not arrive.
    steps: Option<usize>,
}

/// A step towards a pose is a part of the error at most this large \[m or rad\].
const REACH: f64 = 0.5;
/// Iterations that an attempt has.
const STEPS: usize = 200;

/// Iterates steps as the guide says; every configuration on the way is within the limits.
fn iterate(asked: &Asked, [step, pose]: [&Graph; 2], target: &[f64], mut q: Vec<f64>, gain: f64) -> Iteration {
    let mut arrived = None;
    for k in 0..STEPS {
        let mut e = error(&run::<f64>(pose, &[&q]), target);
        let size = e.iter().map(|x| x * x).sum::<f64>().sqrt();
        if size < 1e-10 {
            arrived = arrived.or(Some(k));
            if gain == 0.0 {
                break;
            }
        }
        let part = (REACH / size).min(1.0);
        e.iter_mut().for_each(|x| *x *= part);
        let damping = 0.2 * size.min(1.0);
        let dq = run::<f64>(step, &[&q, &e, &[1.0; 6], &[damping.max(1e-5)], &[gain]]);
        q.iter_mut().zip(&dq).for_each(|(q, dq)| *q += dq);
        for joint in asked.robot.model.free_joints() {
            let (x, limits) = (q[joint.iq], joint.limits);
            let within = limits.lower - 1e-14 <= x && x <= limits.upper + 1e-14;
            assert!(within, "{}: {} is at {x}, beyond {limits:?}", asked.name, joint.name);
        }
    }
    Iteration { q, steps: arrived }
}

/// A redundant arm arrives from nearly every start; where limits or a fold of the arm stand in between another start does.
#[test]
fn inverse_kinematics_arrives_from_random_starts_within_the_limits() {
    for (asked, least) in [
        (Asked::of_file("panda.urdf", "panda_hand_tcp", false), 0.5),
        (Asked::of_file("ur5.urdf", "tool0", false), 0.5),
        (Asked::new(&redundant_arm(8), "link8", false), 0.5),
    ] {
        let [step, pose] = [Function::InverseKinematicsStep, Function::ForwardKinematics].map(|f| asked.graph(f));
        let (mut random, mut attempts, mut total) = (Random(17), Vec::new(), 0);
        for _ in 0..20 {
            let target = run::<f64>(&pose, &[&asked.configuration(&mut random)]);
            let found = (1..=12).find_map(|attempt| {
                let start = asked.configuration(&mut random);
                iterate(&asked, [&step, &pose], &target, start, 0.0).steps.map(|steps| (attempt, steps))
            });
            let (attempt, steps) = found.unwrap_or_else(|| panic!("{}: no start of twelve arrives", asked.name));
            attempts.push(attempt);
            total += steps;
        }
        let first = attempts.iter().filter(|attempt| **attempt == 1).count();
        println!(
            "{}: {first} of 20 from the first start, at most {:?} starts, {} steps on average",
            asked.name,
            attempts.iter().max(),
            total / 20
        );
        assert!(first as f64 >= least * 20.0, "{}: {attempts:?}", asked.name);
    }
}

/// With a gain the arm turns about its task to where holding it takes less.
#[test]
fn redundancy_is_spent_on_less_torque() {
    let asked = Asked::of_file("panda.urdf", "panda_hand_tcp", false);
    let [step, pose, gravity] =
        [Function::InverseKinematicsStep, Function::ForwardKinematics, Function::GravityForce].map(|f| asked.graph(f));
    let effort = |q: &[f64]| -> f64 {
        let torques = run::<f64>(&gravity, &[q]);
        let of = |(tau, body): (&f64, &straightline_core::model::Body<Dd>)| (tau / body.joint.limits.effort).powi(2);
        torques.iter().zip(&asked.robot.model.bodies).map(of).sum()
    };
    let target = run::<f64>(&pose, &[&[0.3, 0.4, -0.6, -1.2, 0.8, 1.9, 0.5]]);
    let start = vec![0.2, 0.5, -0.4, -1.4, 0.6, 2.0, 0.4];
    let [without, with, far] =
        [0.0, 10.0, 40.0].map(|gain| iterate(&asked, [&step, &pose], &target, start.clone(), gain));
    assert!(without.steps.is_some(), "it arrives without");
    let left = error(&run::<f64>(&pose, &[&with.q]), &target).iter().map(|x| x.abs()).fold(0.0, f64::max);
    let [without, with, far] = [without, with, far].map(|iteration| effort(&iteration.q));
    println!("holding effort {without:.6} without, {with:.6} with, off by {left:.1e}");
    assert!(left < 1e-8, "the task is met meanwhile: {left}");
    assert!(with < 0.9 * without, "{with} of {without}");
    // the least that the task leaves, whatever the gain
    assert!((with - far).abs() < 1e-6 * with, "{with} and {far}");
}
