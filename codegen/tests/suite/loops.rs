//! Robots with closed loops: all functions beside the second author, forces beside multipliers, energy along closed motions, which joints depend on which loops.

use crate::data::reference_file;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::options::Options;
use straightline_codegen::verify::verify;
use straightline_codegen::{compile, Function};
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

fn model(source: &Source, options: &ModelOptions) -> Model<Dd> {
    let (model, said) = load(source, options);
    model.unwrap_or_else(|| panic!("{}", said.render()))
}

fn verified(source: &Source) {
    let of_robot = model(source, &ModelOptions::default());
    let options = Options { functions: Function::of(&of_robot).collect(), ..Options::default() };
    let generated = compile(source, &options).unwrap_or_else(|errors| panic!("{}", errors.render()));
    let verification = verify(source, &generated, &options, (5, 1), || ()).unwrap_or_else(|why| panic!("{why}"));
    assert!(verification.passes(), "{:?}", verification.functions);
    assert!(verification.functions.contains_key("close_loops") && verification.left_out.is_empty());
}

#[test]
fn all_functions_of_a_four_bar_are_the_second_authors() {
    verified(&Source::new("fourbar.toml", FOURBAR));
}

#[test]
#[ignore = "slow proof: all functions of five robots"]
fn slow_proof_that_all_functions_of_robots_with_loops_are_the_second_authors() {
    OF_REFERENCE.iter().for_each(|name| verified(&source(name)));
}

/// A closed configuration in double-double, velocities and accelerations.
fn state(model: &Model<Dd>, random: &mut Random) -> [Vec<Dd>; 3] {
    let home: Vec<f64> = model.closure.home.iter().map(|x| x.to_f64()).collect();
    let mut numbers = |n: usize, bound: f64| -> Vec<f64> { (0..n).map(|_| random.symmetric(bound)).collect() };
    let away = alg::integrate(&model.cast::<f64>(), &home, &numbers(model.nv(), 0.1));
    let wide = |x: Vec<f64>| -> Vec<Dd> { x.into_iter().map(Dd::from).collect() };
    let mut q = wide(away);
    for joint in model.free_joints() {
        joint.kind.normalise(&mut q[joint.iq..joint.iq + joint.kind.nq()]);
    }
    let q = model.close_loops(&q, 4).0;
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
