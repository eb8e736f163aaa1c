//! A scene is the full program at its constants: to the bit under the exact rules, for every robot.

use straightline_codegen::equations::Robot as Loaded;
use straightline_codegen::expr::{evaluate, Grade};
use straightline_codegen::function::SelectedRows;
use straightline_codegen::model;
use straightline_codegen::options::Options;
use straightline_codegen::program::TracedProgram;
use straightline_codegen::scene::{apply, Gravity, ResultPart, Scene, Selection, Zero};
use straightline_codegen::{Diagnostics, Function};
use straightline_generated_tests::bounds::LOCKED;
use straightline_generated_tests::inputs::{self, ready_to_paste};
use straightline_generated_tests::programs::{self, program};
use straightline_generated_tests::random::Random;
use straightline_generated_tests::reference::{Robot, ROBOTS};

const STATES: usize = 8;

fn exact(scene: Scene, frames: &[String]) -> Options {
    Options { grade: Grade::Exact, scene, frames: frames.to_vec(), ..Options::default() }
}

/// The robot as a scene leaves it.
fn in_scene(robot: &Robot, scene: &Scene) -> Loaded {
    let options = programs::options(robot);
    let (model, mut diagnostics) = model::load(&programs::source(robot), &scene.model_options(&options.model));
    let model = model.and_then(|model| apply(model, scene, &mut diagnostics));
    Loaded::new(model.unwrap_or_else(|| panic!("{diagnostics}")))
}

/// The results of a program, its inputs by name.
fn run(program: &TracedProgram, inputs: &[(&str, Vec<f64>)]) -> Vec<f64> {
    let named = |name: &str| inputs.iter().find(|(n, _)| *n == name).unwrap_or_else(|| panic!("no {name}")).1.clone();
    evaluate(&program.graph, &program.graph.inputs.iter().flat_map(|p| named(&p.name)).collect::<Vec<f64>>())
}

fn named(function: Function, loaded: &Loaded, random: &mut Random) -> Vec<(&'static str, Vec<f64>)> {
    let names = function.inputs(&loaded.model, 0).into_iter().map(|p| match p.name.as_str() {
        "q" => "q",
        "qd" => "qd",
        "qdd" => "qdd",
        _ => "tau",
    });
    names.zip(inputs::random(random, &loaded.model, function)).collect()
}

fn assert_same_bits(claim: &str, inputs: &[(&str, Vec<f64>)], a: &[f64], b: &[f64]) {
    assert_eq!(a.len(), b.len(), "{claim}");
    if let Some(i) = (0..a.len()).find(|&i| a[i] != b[i]) {
        let values: Vec<Vec<f64>> = inputs.iter().map(|(_, v)| v.clone()).collect();
        panic!("{claim}: component {i} is {:e} and {:e}\n{}", a[i], b[i], ready_to_paste(&values));
    }
}

/// `scene` on every robot and function, against the full program whose inputs `hold` sets and whose results `pick` picks.
fn scene_is_full_program(
    what: &str,
    scene_of: impl Fn(&Loaded) -> Scene,
    hold: impl Fn(&Loaded, &mut Vec<(&'static str, Vec<f64>)>),
) {
    let mut compared = 0;
    for robot in ROBOTS.map(Robot::load) {
        let full = in_scene(&robot, &Scene::default());
        let scene = scene_of(&full);
        let loaded = in_scene(&robot, &scene);
        let mut random = Random(3);
        for function in Function::all() {
            let partial = program(&loaded, &robot.frames, function, &exact(scene.clone(), &robot.frames));
            let whole = program(&full, &robot.frames, function, &exact(Scene::default(), &robot.frames));
            let (wanted, _) = scene.select(function, &full.model, robot.frames.len());
            for _ in 0..STATES {
                let mut inputs = named(function, &full, &mut random);
                hold(&full, &mut inputs);
                let all = run(&whole, &inputs);
                let expected: Vec<f64> = wanted.iter().map(|k| all[*k]).collect();
                let claim = format!("{what}: {} of {}", function.name(), robot.name);
                assert_same_bits(&claim, &inputs, &run(&partial, &inputs), &expected);
                compared += expected.len();
            }
        }
    }
    assert!(compared > 1000, "{compared} results were compared");
}

#[test]
fn without_velocities_or_accelerations_a_scene_is_the_program_at_zero() {
    let scene = |_: &Loaded| Scene { zero: Zero { qd: true, qdd: true, ..Zero::default() }, ..Scene::default() };
    scene_is_full_program("q̇ = q̈ = 0", scene, |_, inputs| {
        inputs.iter_mut().filter(|(name, _)| *name == "qd" || *name == "qdd").for_each(|(_, v)| v.fill(0.0));
    });
}

#[test]
fn joints_at_rest_are_the_program_with_their_rates_at_zero() {
    let resting = |loaded: &Loaded| -> Vec<usize> {
        let turning = loaded.model.free_joints().filter(|j| j.kind.is_single());
        turning.step_by(2).map(|j| j.iv).collect()
    };
    let scene = |loaded: &Loaded| {
        let at_rest = resting(loaded);
        let joints = loaded.model.free_joints();
        let joints_at_rest = joints.filter(|j| at_rest.contains(&j.iv)).map(|j| j.name.clone()).collect();
        Scene { zero: Zero { joints_at_rest, ..Zero::default() }, ..Scene::default() }
    };
    scene_is_full_program("joints at rest", scene, |loaded, inputs| {
        for (_, values) in inputs.iter_mut().filter(|(name, _)| *name == "qd" || *name == "qdd") {
            resting(loaded).into_iter().for_each(|iv| values[iv] = 0.0);
        }
    });
}

#[test]
fn selected_results_are_those_of_the_full_program() {
    let selected = |part: ResultPart| {
        move |loaded: &Loaded| {
            let last = loaded.model.bodies.last().expect("a robot has bodies").joint.name.clone();
            use Function::*;
            let selection = |f: Function| {
                // what a function's results can be chosen by
                let by_joint = matches!(f, Jacobian | JointWrenches | MassMatrix)
                    || matches!(f, InverseDynamics | GravityForce | BiasForce | VelocityForce | ForwardDynamics);
                let has_part = match part {
                    ResultPart::Whole => true,
                    ResultPart::Diagonal => f == MassMatrix,
                    ResultPart::Linear | ResultPart::Angular => f.is_per_frame() || f == JointWrenches,
                    ResultPart::Rows(_) => matches!(f, Jacobian | FrameVelocity),
                };
                Selection {
                    joints: if by_joint { vec![last.clone()] } else { Vec::new() },
                    part: if has_part { part } else { ResultPart::Whole },
                    ..Selection::default()
                }
            };
            Scene { outputs: Function::all().map(|f| (f, selection(f))).collect(), ..Scene::default() }
        }
    };
    let rows = ResultPart::Rows(SelectedRows::of([0, 5]));
    for part in [ResultPart::Whole, ResultPart::Linear, ResultPart::Angular, ResultPart::Diagonal, rows] {
        scene_is_full_program(&format!("selected, {part:?}"), selected(part), |_, _| {});
    }
}

#[test]
fn gravity_as_an_input_is_gravity_as_a_constant() {
    for robot in ROBOTS.map(Robot::load) {
        for gravity in [[0.0; 3], [1.62, 0.0, 0.0], [0.7, -3.1, -9.2]] {
            let constant = Scene { gravity: Gravity::Constant(gravity), ..Scene::default() };
            let input = Scene { gravity: Gravity::Input, ..Scene::default() };
            let (fixed, open) = (in_scene(&robot, &constant), in_scene(&robot, &input));
            let mut random = Random(5);
            for function in Function::all() {
                let a = program(&fixed, &robot.frames, function, &exact(constant.clone(), &robot.frames));
                let b = program(&open, &robot.frames, function, &exact(input.clone(), &robot.frames));
                for _ in 0..STATES {
                    let mut inputs = named(function, &fixed, &mut random);
                    inputs.push(("gravity", gravity.to_vec()));
                    let claim = format!("gravity {gravity:?}: {} of {}", function.name(), robot.name);
                    assert_same_bits(&claim, &inputs, &run(&a, &inputs), &run(&b, &inputs));
                }
            }
        }
    }
}

/// Merged bodies are summed in another order: a few ulp of the natural scale, which for torques is that of the full robot.
#[test]
fn locked_joints_are_the_full_robot_with_them_held() {
    for robot in ROBOTS.map(Robot::load) {
        let full = in_scene(&robot, &Scene::default());
        let joints: Vec<_> = full.model.bodies.iter().map(|b| b.joint.clone()).collect();
        let single: Vec<_> = joints.iter().filter(|j| j.kind.is_single()).collect();
        // the last two joints of the file, at awkward values
        let held: Vec<(String, f64)> = single
            .iter()
            .rev()
            .take(2.min(single.len() - 1))
            .zip([0.4, -0.7])
            .map(|(j, q)| (j.name.clone(), q))
            .collect();
        let scene = Scene { locked: held.clone(), ..Scene::default() };
        let loaded = in_scene(&robot, &scene);
        let options = Options { scene: scene.clone(), frames: robot.frames.clone(), ..Options::default() };
        let whole_options = Options { frames: robot.frames.clone(), ..Options::default() };
        let (partial, whole) = (
            program(&loaded, &robot.frames, Function::InverseDynamics, &options),
            program(&full, &robot.frames, Function::InverseDynamics, &whole_options),
        );
        let mut random = Random(9);
        for _ in 0..STATES {
            let mut inputs = named(Function::InverseDynamics, &full, &mut random);
            for (name, value) in &held {
                let joint = joints.iter().find(|j| j.name == *name).expect("it is one of them");
                inputs[0].1[joint.iq] = *value;
                inputs[1].1[joint.iv] = 0.0;
                inputs[2].1[joint.iv] = 0.0;
            }
            let kept = |values: &[f64], velocity: bool| -> Vec<f64> {
                let free = joints.iter().filter(|j| held.iter().all(|(name, _)| *name != j.name));
                let mut free: Vec<_> = free.collect();
                free.sort_by_key(|j| j.iv);
                let range = |j: &&straightline_core::model::Joint| match velocity {
                    true => j.iv..j.iv + j.kind.nv(),
                    false => j.iq..j.iq + j.kind.nq(),
                };
                free.iter().flat_map(|j| values[range(j)].to_vec()).collect()
            };
            let all = run(&whole, &inputs);
            let expected = kept(&all, true);
            let fewer: Vec<(&str, Vec<f64>)> =
                inputs.iter().map(|(name, values)| (*name, kept(values, *name != "q"))).collect();
            let size = all.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            for (a, b) in run(&partial, &fewer).iter().zip(&expected) {
                let error = (a - b).abs() / size;
                assert!(LOCKED.allows(error), "{}: {a:e} for {b:e}, {error:e} of the largest", robot.name);
            }
        }
    }
}

#[test]
fn a_complaint_about_a_scene_is_no_panic() {
    let robot = Robot::load(ROBOTS[0]);
    let (model, mut diagnostics) = model::load(&programs::source(&robot), &programs::options(&robot).model);
    let scene = Scene { locked: vec![("no such joint".into(), 0.0)], ..Scene::default() };
    assert!(model.and_then(|m| apply(m, &scene, &mut diagnostics)).is_none());
    let complaints: &Diagnostics = &diagnostics;
    assert!(complaints.has_errors());
}
