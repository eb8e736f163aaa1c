//! Robots with closed loops: all functions beside the second author, forces beside multipliers, energy along closed motions, which joints depend on which loops.

use crate::data::reference_file;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::{evaluate, Port, RuleSet};
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::options::Options;
use straightline_codegen::scene::Scene;
use straightline_codegen::trace::trace_all;
use straightline_codegen::verify::verify;
use straightline_codegen::{compile, ForwardDynamicsMethod, Function};
use straightline_core::algorithms as alg;
use straightline_core::model::Model;
use straightline_core::random::Random;
use straightline_core::Dd;

const FOURBAR: &str = include_str!("../files/fourbar.toml");
const OF_REFERENCE: [&str; 5] = ["loop_fourbar", "loop_palletiser", "loop_ankle", "loop_ankle_float", "loop_leg"];

fn source(name: &str) -> Source {
    let path = reference_file(&format!("joints/robots/{name}.xml"));
    Source::new(&format!("{name}.xml"), std::fs::read_to_string(path).expect("the data"))
}

pub fn model(source: &Source, options: &ModelOptions) -> Model<Dd> {
    let (model, said) = load(source, options);
    model.unwrap_or_else(|| panic!("{}", said.render()))
}

pub fn verified(source: &Source, is_wanted: impl Fn(Function) -> bool) {
    let of_robot = model(source, &ModelOptions::default());
    let functions: Vec<Function> = Function::known().filter(|f| f.is_of(&of_robot) && is_wanted(*f)).collect();
    let options = Options { functions: functions.clone(), ..Options::default() };
    let generated = compile(source, &options).unwrap_or_else(|errors| panic!("{}", errors.render()));
    let verification = verify(source, &generated, &options, (5, 1), || ()).unwrap_or_else(|why| panic!("{why}"));
    assert!(verification.passes(), "{:?}", verification.functions);
    assert!(verification.functions.len() == functions.len() && verification.left_out.is_empty());
}

fn is_by_name(f: Function) -> bool {
    f.spec().family.is_by_name()
}

#[test]
fn functions_of_a_four_bar_are_the_second_authors() {
    let derivatives = [Function::InverseDynamicsDerivatives, Function::ForwardDynamicsDerivatives];
    verified(&Source::new("fourbar.toml", FOURBAR), |f| !is_by_name(f) || derivatives.contains(&f));
}

#[test]
#[ignore = "slow proof: derivatives and tasks"]
fn slow_proof_that_derivatives_of_a_four_bar_are_the_second_authors() {
    verified(&source("loop_fourbar"), is_by_name);
}

#[test]
#[ignore = "slow proof: loops in space"]
fn slow_proof_that_functions_of_an_ankle_are_the_second_authors() {
    verified(&source("loop_ankle_float"), |f| !is_by_name(f));
}

#[test]
#[ignore = "takes minutes: all functions of five robots"]
fn functions_of_all_robots_with_loops_are_the_second_authors() {
    for name in OF_REFERENCE {
        verified(&source(name), |f| !is_by_name(f));
        verified(&source(name), is_by_name);
    }
}

/// A closed configuration in double-double, velocities and accelerations.
pub fn state(model: &Model<Dd>, random: &mut Random) -> [Vec<Dd>; 3] {
    let home: Vec<f64> = model.closure.home.iter().map(|x| x.to_f64()).collect();
    let mut numbers = |n: usize, bound: f64| -> Vec<f64> { (0..n).map(|_| random.symmetric(bound)).collect() };
    let away = alg::integrate(&model.cast::<f64>(), &home, &numbers(model.nv(), 0.1));
    let wide = |x: Vec<f64>| -> Vec<Dd> { x.into_iter().map(Dd::from).collect() };
    let mut q = wide(away);
    for joint in model.free_joints() {
        joint.kind.normalise(&mut q[joint.iq..joint.iq + joint.kind.nq()]);
    }
    let q = model.close_loops(&q, 8).0;
    [q, wide(numbers(model.nv(), 2.0)), wide(numbers(model.nv(), 10.0))]
}

/// H ẍ + h = S τ + Jᵀ λ of the tree that is left where loops are cut, J ẍ = −J̇ ẋ: unknown τ and λ, all at once by elimination.
#[test]
fn forces_of_closed_robots_are_those_of_the_full_system_with_multipliers() {
    for name in OF_REFERENCE {
        let source = source(name);
        let closed = model(&source, &ModelOptions::default());
        let mut open = closed.clone();
        open.closure = Default::default();
        let mut random = Random(7);
        for _ in 0..3 {
            let [q, qd, qdd] = state(&closed, &mut random);
            let [y, yd, ydd] = closed.tree_motion([&q, &qd, &qdd]);
            let of_tree = alg::inverse_dynamics(&open, &q, &yd, &ydd);
            let rows: Vec<Vec<Dd>> = closed.closure.loops.iter().flat_map(|of| closed.gap_rows(of, &y)).collect();
            // rates close the loops
            for row in &rows {
                let rate = row.iter().zip(yd.iter()).fold(Dd::ZERO, |sum, (j, x)| sum + *j * *x);
                assert!(rate.abs().to_f64() < 1e-28, "{name}: {rate:?}");
            }
            let (n, all) = (closed.nv(), of_tree.len());
            let matrix = nalgebra::DMatrix::from_fn(all, all, |i, j| match j.checked_sub(n) {
                None => Dd::from(f64::from(i == j)),
                Some(k) => rows[k][i],
            });
            let right = nalgebra::DVector::from_vec(of_tree.clone());
            let found = straightline_core::reference::drives::solve_general(matrix, right);
            let forces = alg::inverse_dynamics(&closed, &q, &qd, &qdd);
            let size = of_tree.iter().fold(0.0_f64, |most, x| most.max(x.to_f64().abs()));
            for (i, force) in forces.iter().enumerate() {
                let error = (*force - found[i]).abs().to_f64();
                assert!(error < 1e-26 * size, "{name}, force {i}: {error:e} of {size}");
            }
            // and back
            let motion = alg::forward_dynamics_ltdl(&closed, &q, &qd, &forces);
            for (found, given) in motion.iter().zip(&qdd) {
                assert!((*found - *given).abs().to_f64() < 1e-24, "{name}: {found:?} {given:?}");
            }
        }
    }
}

/// Central differences of forces along closed motions, where q goes along each increment and the loops are closed again.
#[test]
fn derivatives_of_closed_robots_are_differences_along_closed_motions() {
    for name in OF_REFERENCE {
        let closed = model(&source(name), &ModelOptions::default());
        let mut random = Random(13);
        let [q, qd, qdd] = state(&closed, &mut random);
        let robot = Robot::new(closed.clone());
        let ports = [("q", closed.nq()), ("qd", closed.nv()), ("qdd", closed.nv())];
        let ports = ports.map(|(name, n)| Port::new(name, &[n])).to_vec();
        // by the structure of the tree's forces, and in dual numbers altogether
        let found = [true, false].map(|reduced| {
            let graph = trace_all(RuleSet::all(), ports.clone(), |inputs| {
                let (function, method) = (Function::InverseDynamicsDerivatives, ForwardDynamicsMethod::Factorisation);
                function.equations(&robot, &[], method, reduced, &Scene::default(), inputs)
            });
            evaluate::<Dd>(&graph, &[q.clone(), qd.clone(), qdd.clone()].concat())
        });
        let step = Dd::from(1e-9);
        let nv = closed.nv();
        let unit = |k: usize, size: Dd| (0..nv).map(|i| if i == k { size } else { Dd::ZERO }).collect::<Vec<Dd>>();
        let moved = |k: usize, size: Dd| closed.close_loops(&alg::integrate(&closed, &q, &unit(k, size)), 2).0;
        let changed = |k: usize, size: Dd| qd.iter().zip(unit(k, size)).map(|(x, more)| *x + more).collect::<Vec<Dd>>();
        let forces = |q: &[Dd], qd: &[Dd]| alg::inverse_dynamics(&closed, q, qd, &qdd);
        let size = found[0].iter().fold(0.0_f64, |most, x| most.max(x.to_f64().abs()));
        for k in 0..nv {
            let by_q = [forces(&moved(k, step), &qd), forces(&moved(k, -step), &qd)];
            let by_qd = [forces(&q, &changed(k, step)), forces(&q, &changed(k, -step))];
            for (block, [after, before]) in [by_q, by_qd].into_iter().enumerate() {
                for i in 0..nv {
                    let slope = (after[i] - before[i]) / (step + step);
                    for found in &found {
                        let error = (slope - found[block * nv * nv + i * nv + k]).abs().to_f64();
                        assert!(error < 1e-14 * size, "{name}, block {block}, ({i}, {k}): {error:e} of {size}");
                    }
                }
            }
        }
    }
}

/// d(T + V)/dt = τ · q̇, by central differences along the closed motion.
#[test]
fn the_power_of_independent_joints_is_the_rate_of_energy() {
    for name in OF_REFERENCE {
        let closed = model(&source(name), &ModelOptions::default());
        let mut random = Random(11);
        let [q, qd, qdd] = state(&closed, &mut random);
        let energy = |t: f64| {
            let t = Dd::from(t);
            let moved: Vec<Dd> = qd.iter().zip(&qdd).map(|(v, a)| *v * t + *a * t * t * Dd::HALF).collect();
            let rates: Vec<Dd> = qd.iter().zip(&qdd).map(|(v, a)| *v + *a * t).collect();
            let at = closed.close_loops(&alg::integrate(&closed, &q, &moved), 3).0;
            alg::kinetic_energy(&closed, &at, &rates) + alg::potential_energy(&closed, &at)
        };
        let step = 1e-5;
        let rate = (energy(step) - energy(-step)).to_f64() / (2.0 * step);
        let forces = alg::inverse_dynamics(&closed, &q, &qd, &qdd);
        let power: f64 = forces.iter().zip(&qd).map(|(f, v)| (*f * *v).to_f64()).sum();
        // a floating base turns along an arc, whose third order is the error
        assert!((rate - power).abs() < 1e-6 * power.abs().max(1.0), "{name}: {rate} {power}");
    }
}

/// A four-bar that swings freely for ten seconds, by the classical method of Runge and Kutta; after every step its loop is closed again.
#[test]
#[ignore = "slow proof: a hundred thousand steps"]
fn slow_proof_that_a_free_four_bar_keeps_its_energy_over_a_hundred_thousand_steps() {
    let without_friction = FOURBAR.replace("damping = 0.02", "").replace("friction = 0.01", "");
    let source = Source::new("fourbar.toml", without_friction);
    let closed = model(&source, &ModelOptions::default()).cast::<f64>();
    let (steps, h) = (100_000, 1e-4);
    let energy = |q: &[f64], qd: &[f64]| alg::kinetic_energy(&closed, q, qd) + alg::potential_energy(&closed, q);
    let moved = |q: &[f64], by: f64| closed.close_loops(&alg::integrate(&closed, q, &[by]), 1).0;
    let rate = |q: &[f64], qd: f64| alg::forward_dynamics_ltdl(&closed, q, &[qd], &[0.0])[0];
    let (mut q, mut qd) = (closed.closure.home.clone(), 1.0);
    let begin = energy(&q, &[qd]);
    let (mut worst, mut kinetic) = (0.0_f64, 0.0_f64);
    for _ in 0..steps {
        let k1 = [qd, rate(&q, qd)];
        let k2 = [qd + 0.5 * h * k1[1], rate(&moved(&q, 0.5 * h * k1[0]), qd + 0.5 * h * k1[1])];
        let k3 = [qd + 0.5 * h * k2[1], rate(&moved(&q, 0.5 * h * k2[0]), qd + 0.5 * h * k2[1])];
        let k4 = [qd + h * k3[1], rate(&moved(&q, h * k3[0]), qd + h * k3[1])];
        let mean = |i: usize| h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        q = moved(&q, mean(0));
        qd += mean(1);
        worst = worst.max((energy(&q, &[qd]) - begin).abs());
        kinetic = kinetic.max(alg::kinetic_energy(&closed, &q, &[qd]));
    }
    println!("energy off by {worst:.1e} J, of {kinetic} J that swing");
    assert!(kinetic > 0.1 && worst < 1e-10 * kinetic, "{worst:e} of {kinetic}");
}

#[test]
fn joints_that_something_drives_are_independent() {
    let names = |source: &Source| -> Vec<String> {
        let model = model(source, &ModelOptions::default());
        model.independent_joints().map(|joint| joint.name.clone()).collect()
    };
    assert_eq!(names(&source("loop_ankle")), ["knee", "crank_l", "crank_r"]);
    assert_eq!(names(&source("loop_ankle_float")), ["root_joint", "ankle_pitch", "ankle_roll"]);
    assert_eq!(names(&source("loop_leg")), ["hip_roll", "hip_yaw", "hip_pitch", "knee", "shin", "foot_crank"]);
    // nothing drives it: the last joints of the file depend on the first
    assert_eq!(names(&Source::new("fourbar.toml", FOURBAR)), ["crank"]);
    let asked = format!("{FOURBAR}determines = [\"crank\", \"coupler\"]\n");
    assert_eq!(names(&Source::new("fourbar.toml", asked)), ["rocker"]);
}

#[test]
fn loops_are_solved_one_after_the_other_where_they_can_be() {
    let groups = |name: &str| -> Vec<(usize, usize)> {
        let model = model(&source(name), &ModelOptions::default());
        model.closure.groups.iter().map(|group| (group.loops.len(), group.dependents.len())).collect()
    };
    assert_eq!(groups("loop_fourbar"), [(1, 2)]);
    assert_eq!(groups("loop_palletiser"), [(1, 2), (1, 2)]);
    // both rods turn the ankle
    assert_eq!(groups("loop_ankle"), [(2, 6)]);
    assert_eq!(groups("loop_ankle_float"), [(1, 3), (1, 3)]);
    assert_eq!(groups("loop_leg"), [(1, 3), (1, 2)]);
}

#[test]
fn newtons_method_closes_loops_from_near_by() {
    for name in OF_REFERENCE {
        let closed = model(&source(name), &ModelOptions::default());
        let mut random = Random(3);
        for _ in 0..20 {
            let [q, ..] = state(&closed, &mut random);
            let q: Vec<f64> = q.iter().map(|x| x.to_f64()).collect();
            let mut from = q.clone();
            for joint in closed.dependent_joints() {
                from[joint.iq] += random.symmetric(0.05);
            }
            let (found, gap) = closed.cast::<f64>().close_loops(&from, 5);
            assert!(gap.iter().all(|gap| gap.abs() < 1e-14), "{name}: {gap:?}");
            assert!(found.iter().zip(&q).all(|(a, b)| (a - b).abs() < 1e-12), "{name}");
        }
    }
}

/// Held open, the robot is its tree.
#[test]
fn loops_can_be_left_open() {
    let open = ModelOptions { open_loops: true, ..ModelOptions::default() };
    let tree = model(&Source::new("fourbar.toml", FOURBAR), &open);
    let without = FOURBAR.split("[[loop]]").next().expect("there is a text before it");
    let plain = model(&Source::new("fourbar.toml", without), &ModelOptions::default());
    assert_eq!(tree, plain);
}
