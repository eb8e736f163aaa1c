//! Whatever is chosen among the reduced forms of a robot, its torques and its mass matrix are those of the full robot.

use crate::written::{Shape, Style, Written};
use straightline_codegen::diagnostic::Source;
use straightline_codegen::equations::reduce::{lengths, longest_lever, reduce, FreeTerms};
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::{evaluate, Graph, DIVISION};
use straightline_codegen::function::ForwardDynamicsMethod;
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::options::{Optimisations, Options};
use straightline_codegen::program::optimised;
use straightline_codegen::Function;
use straightline_core::algorithms as alg;
use straightline_core::model::{Body, JointEffects, Model};
use straightline_core::reduced::{Meeting, ReducedModel};
use straightline_core::Dd;

/// Arms with parallel and right-angled joints, and a robot with a floating base and four legs.
const ROBOTS: [(&str, bool); 4] = [("ur5", false), ("panda", false), ("puma560", false), ("solo12", true)];

fn robot(name: &str, floating_base: bool) -> Model<Dd> {
    let path = format!("{}/../robots/descriptions/{name}.urdf", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    let options = ModelOptions { floating_base, ..ModelOptions::default() };
    load(&Source::new(name, text), &options).0.unwrap()
}

/// Numbers between −1.5 and 1.5 from a seed.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }

    fn numbers(&mut self, n: usize) -> Vec<Dd> {
        (0..n).map(|_| Dd::from(self.bits() as f64 / f64::from(1u32 << 31) * 3.0 - 1.5)).collect()
    }

    fn flags(&mut self, n: usize) -> Vec<bool> {
        (0..n).map(|_| self.bits().is_multiple_of(2)).collect()
    }

    /// Components of a vector, or none.
    fn components(&mut self, n: usize) -> Vec<Option<usize>> {
        (0..n).map(|_| Some((self.bits() % 4) as usize).filter(|k| *k < 3)).collect()
    }
}

#[track_caller]
fn assert_equal(got: &[Dd], expected: &[Dd], what: &str) {
    // what vanishes altogether (H and velocity forces of slides) is judged by units of the robot
    let scale = Some(expected.iter().map(|x| x.abs().hi()).fold(0.0, f64::max)).filter(|x| *x > 0.0).unwrap_or(1.0);
    for (i, (a, b)) in got.iter().zip(expected).enumerate() {
        let error = (*a - *b).abs().hi() / scale;
        // double-double has 31 digits; a hundred operations and parameters that cancel take a few
        assert!(error < 1e-27, "{what}, component {i}: {error:e} of scale");
    }
}

#[test]
fn every_choice_gives_the_torques_and_the_mass_matrix_of_the_full_robot() {
    for (name, floating) in ROBOTS {
        every_choice_is_the_robot(name, &robot(name, floating), 30);
    }
}

#[test]
fn every_choice_gives_them_of_robots_with_balls() {
    for (name, text) in crate::balls::ROBOTS {
        let model = crate::balls::robot(name, text).model;
        every_choice_is_the_robot(name, &model, 30);
    }
}

#[test]
fn every_choice_gives_them_of_robots_as_people_write_them() {
    for (k, style) in Style::all().into_iter().enumerate() {
        let shape = Shape {
            joints: 2 + k % 5,
            fixed: 3,
            branched: k % 3 == 1,
            floating: k % 4 == 2,
            sliding: if k % 2 == 0 { 3 } else { 0 },
        };
        let written = Written::new(style, shape, 3 + k as u64);
        let options = ModelOptions { floating_base: shape.floating, ..ModelOptions::default() };
        let (model, complaints) = load(&Source::new(written.file_name(), written.text()), &options);
        let model = model.unwrap_or_else(|| panic!("{complaints}"));
        every_choice_is_the_robot(&format!("{style:?}, {shape:?}"), &model, 10);
    }
}

fn every_choice_is_the_robot(name: &str, model: &Model<Dd>, trials: usize) {
    let mut random = Random(11);
    let (n, nv) = (model.bodies.len(), model.nv());
    for trial in 0..trials {
        let (plain, _) = reduce(model, &FreeTerms::plain(model));
        let units = lengths(&plain, longest_lever(model));
        let choice = FreeTerms {
            stays: random.flags(n),
            by_axis_acceleration: random.flags(n),
            by_accelerations: [random.flags(n), random.flags(n)],
            regrouped: random.flags(n),
            doubled: [random.flags(n), random.flags(n)],
            vanish_at_parent: [0; 3].map(|_| random.components(n)),
            axial_balances: [0; 2].map(|_| random.flags(n)),
            other_acceleration: random.flags(n),
            turns_sums: random.flags(n),
            turned_tips: [0; 3].map(|_| random.flags(n)),
            shifted_tips: [0; 2].map(|_| random.flags(n)),
            origin_at_parent: random.flags(n),
            adds_angles: trial % 3 > 0,
            adds_offsets: trial % 2 == 0,
            // a robot may have no lengths
            unit: if trial % 2 == 0 || units.is_empty() { Dd::ONE } else { units[trial % units.len()] },
            meeting: Meeting { mass_matrix: trial % 3, lower: trial % 4, upper: trial % 5 },
        };
        let (reduced, _) = reduce(model, &choice);
        let mut q = random.numbers(model.nq());
        for joint in model.bodies.iter().map(|body| &body.joint) {
            joint.kind.normalise(&mut q[joint.iq..joint.iq + joint.kind.nq()]);
        }
        let (qd, qdd) = (random.numbers(nv), random.numbers(nv));
        let what = format!("{name}, {choice:?}");
        // rotors are no part of the reduced robot
        let rotors = alg::rotor_inertias(model);
        let passive = alg::passive_force(model, &q, &qd);
        let full = alg::inverse_dynamics(model, &q, &qd, &qdd);
        let rigid: Vec<Dd> = (0..nv).map(|i| full[i] - rotors[i] * qdd[i] - passive[i]).collect();
        assert_equal(&alg::reduced_inverse_dynamics(&reduced, &q, &qd, &qdd), &rigid, &what);
        assert_equal(&alg::reduced_gravity_force(&reduced, &q), &alg::gravity_force(model, &q), &what);
        let h = alg::reduced_mass_matrix(&reduced, &q).into_iter().enumerate();
        let h: Vec<Dd> = h.map(|(k, x)| if k % (nv + 1) == 0 { x + rotors[k / nv] } else { x }).collect();
        assert_equal(&h, &alg::mass_matrix(model, &q), &what);
        if reduced.has_columns() {
            derivatives_are_those_of_the_robot(model, &reduced, [&q, &qd, &qdd], &what);
        }
    }
}

/// Of the rigid bodies, beside dual numbers through the full robot.
fn derivatives_are_those_of_the_robot(model: &Model<Dd>, reduced: &ReducedModel<Dd>, motion: [&[Dd]; 3], what: &str) {
    let nv = model.nv();
    let rigid = Model {
        bodies: model.bodies.iter().map(|b| Body { effects: JointEffects::none(), ..b.clone() }).collect(),
        ..model.clone()
    };
    let method = ForwardDynamicsMethod::ArticulatedBody;
    let plain = Function::InverseDynamicsDerivatives.evaluate(&rigid, &[], method, &motion.map(<[Dd]>::to_vec));
    let (by_q, by_qd) = plain[..2 * nv * nv].split_at(nv * nv);
    let found = alg::reduced_inverse_dynamics_derivatives(reduced, motion);
    let [q, qd, qdd] = motion;
    assert_equal(&found.tau, &alg::reduced_inverse_dynamics(reduced, q, qd, qdd), &format!("tau, {what}"));
    assert_equal(&found.mass_matrix, &alg::reduced_mass_matrix(reduced, q), &format!("H, {what}"));
    assert_equal(&found.dtau_dqd, by_qd, &format!("by qd, {what}"));
    assert_equal(&found.dtau_dq, by_q, &format!("by q, {what}"));
}

#[test]
fn the_length_that_is_the_unit_is_exactly_one() {
    let model = robot("ur5", false);
    let (plain, _) = reduce(&model, &FreeTerms::plain(&model));
    let unit = lengths(&plain, longest_lever(&model))[0];
    let (reduced, _) = reduce(&model, &FreeTerms { unit, ..FreeTerms::plain(&model) });
    assert!(reduced.bodies.iter().any(|b| b.translation.to_array().iter().any(|x| x.abs() == Dd::ONE)));
}

#[test]
fn only_what_turns_and_carries_parallel_joints_may_stay() {
    let model = robot("ur5", false);
    let (plain, _) = reduce(&model, &FreeTerms::plain(&model));
    let may: Vec<bool> = (0..6).map(|i| plain.may_stay(i)).collect();
    // shoulder lift and elbow carry parallel joints, the last wrist carries nothing
    assert_eq!(may, [false, true, true, false, false, true]);
}

/// A chain in URDF: kinds, origins and axes of its joints from a seed, every inertial parameter of every link.
fn chain(seed: u64, joints: &[(&str, [f64; 3])]) -> Model<Dd> {
    let mut random = Random(seed);
    let mut text = String::from("<robot name=\"chain\">\n<link name=\"link0\"/>\n");
    let words = |x: &[Dd]| x.iter().map(|x| format!("{} ", 0.2 * x.to_f64())).collect::<String>();
    for (i, (kind, rpy)) in joints.iter().enumerate() {
        let (xyz, com, axis) = (words(&random.numbers(3)), words(&random.numbers(3)), words(&random.numbers(3)));
        let axis = if random.bits().is_multiple_of(2) { axis } else { "0 0 1".to_string() };
        let [roll, pitch, yaw] = rpy;
        text += &format!(
            "<link name=\"link{child}\"><inertial><origin xyz=\"{com}\"/><mass value=\"{mass}\"/>\
             <inertia ixx=\"0.02\" ixy=\"0.001\" ixz=\"-0.002\" iyy=\"0.03\" iyz=\"0.003\" izz=\"0.025\"/></inertial></link>\n\
             <joint name=\"joint{i}\" type=\"{kind}\"><parent link=\"link{i}\"/><child link=\"link{child}\"/>\
             <origin xyz=\"{xyz}\" rpy=\"{roll} {pitch} {yaw}\"/><axis xyz=\"{axis}\"/>\
             <limit lower=\"-2\" upper=\"2\" effort=\"10\" velocity=\"2\"/></joint>\n",
            child = i + 1,
            mass = 2.0 / (i + 1) as f64
        );
    }
    let (model, complaints) = load(&Source::new("chain.urdf", text + "</robot>\n"), &ModelOptions::default());
    model.unwrap_or_else(|| panic!("{complaints}"))
}

/// Tensors that belong to no rigid body are taken as written, with a warning: their products count where numbers are held against the robot's.
#[test]
fn an_inertia_of_products_alone_is_in_proportion_to_itself() {
    let path = format!("{}/../robots/descriptions/ur5.urdf", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    for products in [
        "ixx=\"0.0\" ixy=\"0.0\" ixz=\"0.0\" iyy=\"0.0\" iyz=\"1e6\"",
        "ixx=\"1e6\" ixy=\"0.0\" ixz=\"0.0\" iyy=\"-1e6\" iyz=\"0.0\"",
    ] {
        let none = "ixx=\"0.0\" ixy=\"0.0\" ixz=\"0.0\" iyy=\"0.0\" iyz=\"0.0\"";
        let (before, after) = text.rsplit_once(none).expect("a body without inertia");
        let (model, complaints) =
            load(&Source::new("ur5.urdf", format!("{before}{products}{after}")), &ModelOptions::default());
        assert!(complaints.to_string().contains("negative-moment"), "{complaints}");
        let robot = Robot::new(model.unwrap());
        let options = Options::default();
        optimised(&robot, &[], Function::GravityForce, &options, options.optimisations());
    }
}

/// Oblique and nearly parallel axes and slides in every place: where the reduced robot has more terms than the bodies, it is not used.
#[test]
fn no_robot_takes_more_operations_than_by_its_bodies_own_parameters_nor_loses_digits() {
    const OBLIQUE: [f64; 3] = [0.4, -0.3, 1.1];
    const QUARTER: [f64; 3] = [std::f64::consts::FRAC_PI_2, 0.0, 0.0];
    const HARDLY: [f64; 3] = [2e-4, 0.0, 0.0];
    const HERE: [f64; 3] = [0.0; 3];
    let robots = [
        chain(1, &[("revolute", OBLIQUE)]),
        chain(2, &[("prismatic", OBLIQUE)]),
        chain(3, &[("prismatic", HERE), ("revolute", OBLIQUE), ("prismatic", HARDLY)]),
        chain(4, &[("revolute", QUARTER), ("prismatic", OBLIQUE), ("prismatic", QUARTER), ("revolute", HERE)]),
        chain(5, &[("revolute", HERE), ("revolute", HARDLY), ("revolute", QUARTER), ("revolute", HARDLY)]),
        chain(6, &[("revolute", OBLIQUE), ("revolute", OBLIQUE), ("prismatic", HERE), ("revolute", QUARTER)]),
    ];
    let options = Options::default();
    let all = options.optimisations();
    for (k, model) in robots.into_iter().enumerate() {
        let robot = Robot::new(model);
        for function in
            [Function::InverseDynamics, Function::GravityForce, Function::MassMatrix, Function::ForwardDynamics]
        {
            let of_bodies = Optimisations { reduced: false, ..all };
            let [chosen, of_bodies] = [all, of_bodies].map(|o| optimised(&robot, &[], function, &options, o));
            let cost = |graph: &Graph| {
                let c = graph.counts();
                c.flops() + c.fma + c.tail + 2 * DIVISION * (c.sin_cos + c.div)
            };
            let what = format!("chain {}, {}", k + 1, function.name());
            assert!(cost(&chosen) <= cost(&of_bodies), "{what}: {:?}, {:?}", chosen.counts(), of_bodies.counts());
            let mut random = Random(17);
            for _ in 0..10 {
                let inputs: Vec<Dd> = random
                    .numbers(chosen.inputs.iter().map(|p| p.len()).sum())
                    .iter()
                    .map(|x| Dd::from(x.to_f64()))
                    .collect();
                let exact = evaluate(&of_bodies, &inputs);
                let got: Vec<f64> = evaluate(&chosen, &inputs.iter().map(|x| x.to_f64()).collect::<Vec<f64>>());
                let scale = exact.iter().map(|x| x.abs().hi()).fold(0.0, f64::max);
                // forward dynamics divides by pivots that can be small
                let bound = if function == Function::ForwardDynamics { 2e-13 } else { 5e-15 };
                for (x, y) in got.iter().zip(&exact) {
                    let error = (Dd::from(*x) - *y).abs().hi() / scale;
                    assert!(error < bound, "{what}: {error:e} of scale at {inputs:?}");
                }
            }
        }
    }
}
