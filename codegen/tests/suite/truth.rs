//! Truths of functions, and the natural scales that they say themselves.

use std::collections::BTreeMap;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::equations::Robot;
use straightline_codegen::function::truth::Chapter;
use straightline_codegen::function::{Family, Quantity};
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::scene::Scene;
use straightline_codegen::verify::reference_input::centre_of_mass_tree;
use straightline_codegen::{description, Function};
use straightline_core::random::Random;
use straightline_core::reference::{natural_scale, CentreOfMassTree, ReferenceJoint};
use straightline_core::Dd;

/// A robot of `robots/descriptions` in the second author's terms.
fn tree(file: &str, floating_base: bool) -> CentreOfMassTree<Dd> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../robots/descriptions/").to_string() + file;
    let text = std::fs::read_to_string(&path).expect("a robot file");
    let description = description::read(&Source::new(file, text), &mut Diagnostics::new()).expect("a robot");
    centre_of_mass_tree(&description, &ModelOptions { floating_base, ..ModelOptions::default() }).expect("a tree")
}

/// A random state, a quaternion of which is a turn about x.
fn state(tree: &CentreOfMassTree<Dd>, random: &mut Random) -> BTreeMap<Quantity, Vec<Dd>> {
    let mut any = |n: usize| -> Vec<Dd> { (0..n).map(|_| Dd::from(random.symmetric(2.0))).collect() };
    let mut q = any(tree.nq());
    for link in tree.links.iter().filter(|link| link.joint == ReferenceJoint::Free) {
        q[link.iq + 3..link.iq + 7].copy_from_slice(&[0.6, 0.0, 0.0, 0.8].map(Dd::from));
    }
    let rates = Quantity::of_velocities().map(|rate| (rate, any(tree.nv()))).collect::<Vec<_>>();
    let tasks = Quantity::of_tasks().map(|task| (task, any(6))).collect::<Vec<_>>();
    rates.into_iter().chain(tasks).chain([(Quantity::Configuration, q)]).collect()
}

#[test]
fn every_function_of_every_robot_has_a_truth() {
    let tree = tree("panda.urdf", false);
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../robots/descriptions/panda.urdf");
    let source = Source::new("panda.urdf", std::fs::read_to_string(path).expect("a robot file"));
    let robot = Robot::new(load(&source, &ModelOptions::default()).0.expect("a robot"));
    let robot = robot.knowing_base_parameters(&[Function::TorqueRegressor], &Scene::default());
    let at = Chapter::new(&tree, &[], state(&tree, &mut Random(1))).with_base_parameters(&robot.model);
    let at = at.with_frames(&[tree.frames[3].name.clone()]).expect("a frame of its own");
    // what the forces are of the links' parameters is a law, which `regressors::` asks; robots with loops have theirs in `loops::`
    let has_truth = |f: &Function| {
        let family = f.spec().family;
        !family.is_of_drives() && family != Family::Loops && !f.spec().inputs.contains(&Quantity::LinkParameters)
    };
    for function in Function::known().filter(has_truth) {
        let truth = function.truth(&at).unwrap_or_else(|| panic!("{} has none", function.name()));
        let scales = function.scales(&truth);
        for (k, (x, scale)) in truth.iter().zip(&scales).enumerate() {
            assert!(x.value.to_f64().abs() <= *scale * (1.0 + 1e-12), "{}[{k}]: {x:?}", function.name());
        }
    }
}

/// By the moduli of the links' terms, each with its lever and its length: what the scales of the reference data are, to a factor. Terms within a
/// link's acceleration and its lever count, too, where they cancel, so that scales are greater rather than less.
#[test]
fn natural_scales_are_those_of_the_data_to_a_factor() {
    let mut all = Vec::new();
    for (file, floating) in [
        ("planar2r.urdf", false),
        ("chapter_oblique.toml", false),
        ("puma560.urdf", false),
        ("ur5.urdf", false),
        ("panda.urdf", false),
        ("hyq.urdf", true),
        ("simple_humanoid.urdf", true),
    ] {
        let (tree, mut random) = (tree(file, floating), Random(5));
        let mut factors = Vec::new();
        for _ in 0..10 {
            let state = state(&tree, &mut random);
            let [q, qd, qdd] =
                [Quantity::Configuration, Quantity::Velocity, Quantity::Acceleration].map(|x| state[&x].clone());
            let truth = Function::InverseDynamics.truth(&Chapter::new(&tree, &[], state)).expect("it has one");
            let by_terms = natural_scale(&tree, &q, &qd, &qdd);
            factors.extend(truth.iter().zip(by_terms.iter()).map(|(x, terms)| x.size / terms.to_f64()));
        }
        factors.sort_by(f64::total_cmp);
        println!(
            "{file}: {:.2} to {:.2}, median {:.2}",
            factors[0],
            factors[factors.len() - 1],
            factors[factors.len() / 2]
        );
        all.push((file, factors));
    }
    for (file, factors) in all {
        assert!(factors[0] > 0.25, "{file}: {factors:?}");
        assert!(factors[factors.len() / 2] < 30.0, "{file}: {factors:?}");
    }
}

/// Straight up, the weight of a pendulum has no moment: what rounding leaves of it is of the size of the weight with its lever.
#[test]
fn a_result_that_is_zero_by_cancellation_has_the_scale_of_its_terms() {
    let tree = tree("planar2r.urdf", false);
    let upright = (0..tree.nq()).map(|k| if k == 0 { Dd::FRAC_PI_2 } else { Dd::ZERO }).collect();
    let at = Chapter::new(&tree, &[], BTreeMap::from([(Quantity::Configuration, upright)]));
    let weight: f64 = tree.links.iter().map(|link| link.mass.to_f64() * 9.81).sum();
    for force in Function::GravityForce.truth(&at).expect("it has one") {
        let (value, size) = (force.value.to_f64().abs(), force.size);
        assert!(value < 1e-28 * size || size > 0.1 * value, "{force:?}");
        assert!(size > 0.01 * weight && size < 100.0 * weight, "{force:?} of {weight} N");
    }
    // at rest nothing moves, and the scale of nothing is nothing
    let forces = Function::VelocityForce.truth(&at).expect("it has one");
    assert!(forces.iter().all(|force| (force.value, force.size) == (Dd::ZERO, 0.0)), "{forces:?}");
}
