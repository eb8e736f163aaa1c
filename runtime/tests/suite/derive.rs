//! The macros as a user meets them. That the numbers are right is tested elsewhere, robot by robot.

#![deny(warnings, missing_docs, clippy::all)]
#![forbid(unsafe_code)]

use straightline::{Dynamics, FrameIndex, Pose};

/// All functions, in double precision.
#[derive(Dynamics, Clone, Copy, Debug)]
#[robot("examples/arm.toml")]
pub struct Arm;

/// Options of every kind; a type with fields of its own.
#[derive(Dynamics, Clone, Debug)]
#[robot(
    "examples/arm.toml",
    functions(gravity_force, forward_kinematics),
    frames("upper_arm", "forearm"),
    scalar = "f32",
    joint_order("elbow", "shoulder", "yaw"),
    gravity(0.0, -9.81, 0),
    rules = "exact",
    angle_tolerance = 1e-9,
    max_part_operations = 500,
    forward_dynamics = "factorisation"
)]
pub struct Controller<const N: usize> {
    /// What it remembers.
    pub last: [f32; N],
}

/// Floating in the world.
#[derive(Dynamics)]
#[robot("examples/arm.toml", floating_base, functions(mass_matrix))]
struct Satellite;

/// A scene with types of its own, which stand in a module that can be named.
#[derive(Dynamics)]
#[robot("examples/arm.toml", scene = "examples/payload_scene.toml", module = "loaded")]
pub struct Loaded;

/// A scene without a file: the yaw joint is braked, the arm at rest.
#[derive(Dynamics)]
#[robot(
    "examples/arm.toml",
    scene(
        outputs(functions = ["inverse_dynamics"], mass_matrix(part = "diagonal")),
        hold(gravity = [0.0, 0.0, -1.62], joints = { yaw = -0.25 }),
        zero(qd = true),
        payload(name = "lamp", frame = "forearm", mass = 0.25, com = [0.1, 0.0, 0.02]),
        budget(inverse_dynamics(max_flops = 100)),
    )
)]
pub struct OnTheMoon;

/// The same scene in a file.
#[derive(Dynamics)]
#[robot("examples/arm.toml", scene = "examples/moon_scene.toml")]
pub struct OnTheMoonByFile;

/// A motor whose numbers are parameters at run time.
#[derive(Dynamics)]
#[robot(
    "examples/arm.toml",
    module = "geared",
    scene(
        outputs(functions = ["driven_forward_dynamics"]),
        drive(
            joint = "yaw",
            motor = { torque_constant = 0.05, resistance = 1.2, rotor_inertia = 1e-5 },
            stages = [{ ratio = 100.0, input_inertia = 2e-6, efficiency = 0.8 }],
        ),
        parameter(kind = "drive", drive = "yaw", numbers = ["torque_constant", "ratio", "stage_1_efficiency"]),
    )
)]
pub struct Geared;

/// The same motor with other numbers.
#[derive(Dynamics)]
#[robot(
    "examples/arm.toml",
    scene(
        outputs(functions = ["driven_forward_dynamics"]),
        drive(
            joint = "yaw",
            motor = { torque_constant = 0.071, resistance = 1.2, rotor_inertia = 1e-5 },
            stages = [{ ratio = -63.0, input_inertia = 2e-6, efficiency = 0.66 }],
        ),
    )
)]
pub struct GearedOtherwise;

/// Many of them at once.
#[derive(Dynamics)]
#[robot("examples/arm.toml", functions(inverse_dynamics), lanes = "runtime")]
pub struct Arms;

/// Over any scalar.
#[derive(Dynamics)]
#[robot("examples/arm.toml", functions(gravity_force), generic)]
pub struct Any;

straightline::dynamics! {
    /// The arm as a module, found from this file.
    pub mod arm = "../../examples/arm.toml", scalar = "f32", functions(inverse_dynamics,),
}

/// The slope of gravity forces by a dual number, against a difference quotient, and the bits of the plain function.
#[test]
fn functions_take_any_scalar() {
    use straightline::Dual;
    let q = [0.3, -0.8, 1.1];
    let (mut plain, mut any) = ([0.0; Arm::NV], [0.0; Any::NV]);
    Arm::gravity_force(&q, &mut plain);
    Any::gravity_force(&q, &mut any);
    assert_eq!(plain, any);
    let mut seeded = q.map(Dual::<f64, 1>::fixed);
    seeded[1] = Dual::variable(q[1], 0);
    let mut dual = seeded;
    Any::gravity_force(&seeded, &mut dual);
    let mut further = [0.0; Any::NV];
    Any::gravity_force(&[q[0], q[1] + 1e-6, q[2]], &mut further);
    for ((dual, there), here) in dual.iter().zip(further).zip(plain) {
        assert_eq!(dual.value, here);
        // the quotient is off by half a step times the curvature, some tens of N·m
        assert!((dual.derivatives[0] - (there - here) / 1e-6).abs() < 1e-4, "{dual:?}");
    }
    assert!(dual[1].derivatives[0] != 0.0);
}

#[test]
fn forward_dynamics_undoes_inverse_dynamics() {
    let (q, qd, qdd) = ([0.3, -0.8, 1.1], [0.5, -1.2, 0.7], [2.0, -3.0, 1.5]);
    let (mut tau, mut back) = ([0.0; Arm::NV], [0.0; Arm::NV]);
    Arm::inverse_dynamics(&q, &qd, &qdd, &mut tau);
    Arm::forward_dynamics(&q, &qd, &tau, &mut back);
    for (a, b) in qdd.iter().zip(back) {
        // a few roundings of numbers near 10, through a condition number near 10
        assert!((a - b).abs() < 1e-13, "{qdd:?} {back:?}");
    }
}

#[test]
fn constants_describe_the_robot() {
    assert_eq!((Arm::NQ, Arm::NV), (3, 3));
    assert_eq!(Arm::JOINT_NAMES, ["yaw", "shoulder", "elbow"]);
    assert_eq!(Arm::FRAME_NAMES, ["forearm"]);
    assert_eq!(Arm::UPPER_LIMITS, [f64::INFINITY, 2.0, 2.5]);
    assert_eq!(Arm::EFFORT_LIMITS[1..], [80.0, 40.0]);
    const BUDGET: () = assert!(Arm::INVERSE_DYNAMICS_COST.fma < 200);
    let () = BUDGET;
}

#[test]
fn options_reach_the_compiler() {
    type Two = Controller<2>;
    assert_eq!(Two::JOINT_NAMES, ["elbow", "shoulder", "yaw"]);
    assert_eq!(Two::FRAME_NAMES, ["upper_arm", "forearm"]);
    let (mut g, mut x) = ([0.0_f32; 3], [[0.0_f32; 12]; 2]);
    Two::gravity_force(&[0.0; 3], &mut g);
    // gravity along −y now loads the vertical axis, which comes last
    assert!(g[2].abs() > 0.5, "{g:?}");
    Two::forward_kinematics(&[0.0; 3], &mut x);
    assert_eq!(x[0][..3], [0.05, 0.1, 0.3]);
    const FOREARM: FrameIndex<Controller<2>> = Two::FOREARM;
    assert_eq!((Two::UPPER_ARM.get(), FOREARM.get()), (0, 1));
    assert_eq!((Two::FRAME_NAMES[FOREARM], x[FOREARM]), ("forearm", x[1]));
    let pose: Pose<f32> = Two::pose(&x, Two::UPPER_ARM);
    assert_eq!((pose.position, <[f32; 12]>::from(pose)), ([0.05, 0.1, 0.3], x[0]));
    assert_eq!((Satellite::NQ, Satellite::NV), (10, 9));
}

#[test]
fn the_module_holds_the_same_items() {
    let mut tau = [0.0_f32; arm::NV];
    arm::inverse_dynamics(&[0.3, -0.8, 1.1], &[0.5, -1.2, 0.7], &[2.0, -3.0, 1.5], &mut tau);
    let mut wide = [0.0; 3];
    Arm::inverse_dynamics(&[0.3, -0.8, 1.1], &[0.5, -1.2, 0.7], &[2.0, -3.0, 1.5], &mut wide);
    for (narrow, wide) in tau.iter().zip(wide) {
        // 2^-24 of torques near 10, a few roundings
        assert!((f64::from(*narrow) - wide).abs() < 1e-5, "{tau:?} {wide:?}");
    }
}

#[test]
fn types_of_parameters_and_stages_and_further_scalars_are_reached_through_the_module() {
    let (q, qd, qdd) = ([0.3, -0.8, 1.1], [0.5, -1.2, 0.7], [2.0, -3.0, 1.5]);
    let tool = loaded::Tool::new(0.6, [0.05, 0.01, -0.02], [1e-3, 0.0, 0.0, 2e-3, 0.0, 1.5e-3]).unwrap();
    assert_eq!(loaded::Tool::new(-0.6, [0.0; 3], [0.0; 6]), Err(loaded::Unphysical::NegativeMass));
    let (mut empty, mut tau, mut staged, mut single) = ([0.0; 3], [0.0; 3], [0.0; 3], [0.0_f32; 3]);
    Loaded::inverse_dynamics(&q, &qd, &qdd, &loaded::Tool::NONE, &mut empty);
    Arm::inverse_dynamics(&q, &qd, &qdd, &mut tau);
    let close = |a: &[f64; 3], b: &[f64; 3], bound: f64| a.iter().zip(b).all(|(a, b)| (a - b).abs() < bound);
    // a few roundings of torques near 10
    assert!(close(&empty, &tau, 1e-13), "{empty:?} {tau:?}");

    Loaded::inverse_dynamics(&q, &qd, &qdd, &tool, &mut tau);
    let parameters = loaded::staged::Parameters::new(&tool);
    let configuration = loaded::staged::Configuration::new(&parameters, &q);
    loaded::staged::Velocity::new(&configuration, &qd).inverse_dynamics(&qdd, &mut staged);
    assert!(close(&staged, &tau, 1e-13) && !close(&empty, &tau, 0.1), "{staged:?} {tau:?} {empty:?}");

    let narrow = |x: [f64; 3]| x.map(|x| x as f32);
    let tool = loaded::single::Tool::new(0.6, [0.05, 0.01, -0.02], [1e-3, 0.0, 0.0, 2e-3, 0.0, 1.5e-3]).unwrap();
    loaded::single::inverse_dynamics(&narrow(q), &narrow(qd), &narrow(qdd), &tool, &mut single);
    assert!(close(&single.map(f64::from), &tau, 1e-5), "{single:?} {tau:?}");
}

#[test]
fn a_scene_in_the_attribute_is_that_of_a_file() {
    let (q, qdd) = ([0.4, -0.7], [1.5, -2.5]);
    let (mut tau, mut of_file, mut diagonal, mut of_file_too) = ([0.0; 2], [0.0; 2], [0.0; 2], [0.0; 2]);
    OnTheMoon::inverse_dynamics(&q, &qdd, &mut tau);
    OnTheMoonByFile::inverse_dynamics(&q, &qdd, &mut of_file);
    OnTheMoon::mass_matrix(&q, &mut diagonal);
    OnTheMoonByFile::mass_matrix(&q, &mut of_file_too);
    assert_eq!((tau, diagonal), (of_file, of_file_too));
    assert_eq!(OnTheMoon::JOINT_NAMES, ["shoulder", "elbow"]);
    // the lamp is 0.25 kg at r = (0.1, 0, 0.02) from the elbow's axis a = (0, 0.6, 0.8): m (r² − (a·r)²) = 0.002536
    let mut h = [[0.0; 3]; 3];
    Arm::mass_matrix(&[-0.25, q[0], q[1]], &mut h);
    assert!((diagonal[1] - h[2][2] - 0.002536).abs() < 1e-15, "{diagonal:?} {h:?}");
}

#[test]
fn numbers_of_a_drive_are_parameters() {
    let (q, qd, x, u) = ([0.3, -0.8, 1.1], [0.5, -1.2, 0.7], [0.0; 2], [11.0]);
    let mut xd = [0.0; 2];
    let numbers = geared::YawNumbers { torque_constant: 0.071, ratio: -63.0, stage_1_efficiency: 0.66 };
    let drive = geared::Yaw::new(numbers).unwrap();
    let (mut of_file, mut free, mut fixed) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    Geared::driven_forward_dynamics(&q, &qd, &x, &u, &geared::Yaw::NOMINAL, &mut of_file, &mut xd);
    Geared::driven_forward_dynamics(&q, &qd, &x, &u, &drive, &mut free, &mut xd);
    GearedOtherwise::driven_forward_dynamics(&q, &qd, &x, &u, &mut fixed, &mut xd);
    for (a, b) in free.iter().zip(fixed) {
        // roundings of accelerations near 10 through a condition number near 10
        assert!((a - b).abs() < 1e-12, "{free:?} {fixed:?}");
    }
    assert!((free[0] - of_file[0]).abs() > 0.1, "{free:?} {of_file:?}");
    let refused = geared::Yaw::new(geared::YawNumbers { ratio: 0.0, ..numbers });
    assert_eq!(refused.unwrap_err().to_string(), "`ratio` must be not zero");
}

#[test]
fn a_batch_is_many_single_calls() {
    const N: usize = 21;
    let numbers = |seed: usize| -> Vec<f64> { (0..3 * N).map(|i| ((i * 7 + seed) % 23) as f64 / 8.0 - 1.0).collect() };
    let (q, qd, qdd) = (numbers(1), numbers(5), numbers(11));
    let (mut rows, mut components) = (vec![0.0; 3 * N], vec![0.0; 3 * N]);
    Arms::inverse_dynamics_batch_aos(N, &q, &qd, &qdd, &mut rows).unwrap();
    let transposed = |x: &[f64]| -> Vec<f64> { (0..3 * N).map(|i| x[i % N * 3 + i / N]).collect() };
    Arms::inverse_dynamics_batch_soa(N, &transposed(&q), &transposed(&qd), &transposed(&qdd), &mut components).unwrap();
    assert_eq!(components, transposed(&rows));
    for s in 0..N {
        let state = |x: &[f64]| -> [f64; 3] { x[3 * s..3 * s + 3].try_into().unwrap() };
        let mut tau = [0.0; 3];
        Arms::inverse_dynamics(&state(&q), &state(&qd), &state(&qdd), &mut tau);
        assert_eq!(state(&rows), tau);
        let one = |x: [f64; 3]| x.map(|x| [x]);
        let mut lanes = [[0.0]; 3];
        Arms::inverse_dynamics_lanes(&one(state(&q)), &one(state(&qd)), &one(state(&qdd)), &mut lanes);
        assert_eq!(lanes, one(tau));
    }
    let wrong = Arms::inverse_dynamics_batch_aos(N, &q[1..], &qd, &qdd, &mut rows).unwrap_err();
    assert_eq!(wrong.to_string(), "`q` has 62 numbers: 21 states of 3 are wanted");
}
