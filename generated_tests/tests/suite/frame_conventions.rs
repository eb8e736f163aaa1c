//! Derivatives of the twists of frames in their own axes and at the world's origin, against the 25 digits of the data.
//!
//! The data have the velocity and the classical acceleration of a frame's origin in world axes. What the other conventions are of them follows by the
//! rule of products, written down here for every column: the axes R turn with w, the origin p moves with l, where (l, w) is the column of J.

use super::mutants::escaping;
use straightline_codegen::options::Options;
use straightline_codegen::scene::Gravity;
use straightline_codegen::Function;
use straightline_core::spatial::{Mat3, MotionVector, Vec3};
use straightline_core::{Dd, Real};
use straightline_generated_tests::derivative_data::{DerivativeRobot, DerivativeState, ExpectedBlock, ARMS, LEGGED};
use straightline_generated_tests::programs::{self, cast};

const FUNCTIONS: [Function; 2] = [Function::FrameDerivativesInOwnAxes, Function::FrameDerivativesAtWorldOrigin];

/// Of the greatest entry of a block, in f64: at the world's origin a legged robot has its way from there in all entries. 1.3e-15 is found, of HyQ.
const BOUND: f64 = 2e-15;

/// The same in double-double. The data have 25 digits, and a block may be 100 times smaller than what it is made of: 2.6e-23 is found, of a planar arm.
const BOUND_DD: f64 = 1e-22;

const BLOCKS: [&str; 5] = ["dv_dq", "da_dq", "da_dqd", "j", "j_dot"];

/// Inputs of the motion, with a quaternion of length one in all digits, as in the data.
fn inputs<T: Real>(robot: &DerivativeRobot, state: &DerivativeState) -> Vec<Vec<T>> {
    let mut inputs = cast::<T>(&state.inputs(Function::FrameDerivatives));
    if robot.floating {
        let length = inputs[0][3..7].iter().fold(T::zero(), |sum, x| sum + *x * *x).sqrt();
        inputs[0][3..7].iter_mut().for_each(|x| *x = *x / length);
    }
    inputs
}

/// In the data angles count as they are written.
fn as_written(robot: &DerivativeRobot) -> Options {
    let mut options = robot.options();
    options.model.angle_tolerance = 0.0;
    options
}

/// A block by its columns.
fn columns(rows: &[Dd]) -> Vec<MotionVector<Dd>> {
    let nv = rows.len() / 6;
    let vector =
        |k: usize, row: usize| Vec3::new(rows[row * nv + k], rows[(row + 1) * nv + k], rows[(row + 2) * nv + k]);
    (0..nv).map(|k| MotionVector { linear: vector(k, 0), angular: vector(k, 3) }).collect()
}

fn rows(columns: &[MotionVector<Dd>]) -> Vec<Dd> {
    let entries = |row: usize| {
        columns.iter().map(move |c| [c.linear.to_array(), c.angular.to_array()].concat()[row]).collect::<Vec<_>>()
    };
    (0..6).flat_map(entries).collect()
}

/// J times these rates.
fn moved(columns: &[MotionVector<Dd>], rates: &[Dd]) -> MotionVector<Dd> {
    let part = |of: fn(&MotionVector<Dd>) -> Vec3<Dd>| {
        columns.iter().zip(rates).fold(Vec3::zero(), |sum, (column, rate)| sum + of(column).scale(*rate))
    };
    MotionVector { linear: part(|c| c.linear), angular: part(|c| c.angular) }
}

/// What the data say of the five blocks, by columns, with the pose, the velocity and the acceleration of the frame.
struct InWorldAxes {
    rotation: Mat3<Dd>,
    p: Vec3<Dd>,
    velocity: MotionVector<Dd>,
    acceleration: MotionVector<Dd>,
    blocks: [Vec<MotionVector<Dd>>; 5],
}

impl InWorldAxes {
    fn new(robot: &DerivativeRobot, state: &DerivativeState) -> InWorldAxes {
        let motion = inputs::<Dd>(robot, state);
        let nv = motion[1].len();
        let none = vec![Dd::ZERO; 5 * 6 * nv];
        let expected = state.blocks(Function::FrameDerivatives, &none);
        let blocks: Vec<_> = expected.into_iter().map(|(block, _)| columns(&block.values)).collect();
        let blocks: [Vec<_>; 5] = blocks.try_into().expect("five blocks");
        let [j, j_dot] = [&blocks[3], &blocks[4]];
        let (linear, bias) = (moved(j, &motion[2]), moved(j_dot, &motion[1]));
        let acceleration = MotionVector { linear: linear.linear + bias.linear, angular: linear.angular + bias.angular };
        let velocity = moved(j, &motion[1]);
        let pose = programs::run(&robot.program(Function::ForwardKinematics, &as_written(robot)), &motion[..1]);
        let row = |k: usize| [pose[k], pose[k + 1], pose[k + 2]];
        let rotation = Mat3 { rows: [row(3), row(6), row(9)] };
        InWorldAxes { rotation, p: Vec3::from(row(0)), velocity, acceleration, blocks }
    }

    /// v − (w × what stands in the axes) and so on, turned into the axes of the frame: of Rᵀ v, Rᵀ ω and of their rates Rᵀ (a − ω × v), Rᵀ ε.
    fn in_own_axes(&self, k: usize) -> [MotionVector<Dd>; 5] {
        let MotionVector { linear: v, angular: omega } = self.velocity;
        let MotionVector { linear: a, angular: alpha } = self.acceleration;
        let [dv, da, da_dqd, j, j_dot] = self.blocks.each_ref().map(|block| block[k]);
        let (l, w) = (j.linear, j.angular);
        let turned = |linear: Vec3<Dd>, angular: Vec3<Dd>| MotionVector {
            linear: self.rotation.transpose_mul(linear),
            angular: self.rotation.transpose_mul(angular),
        };
        [
            turned(dv.linear - w.cross(v), dv.angular - w.cross(omega)),
            turned(
                da.linear - dv.angular.cross(v) - omega.cross(dv.linear) - w.cross(a - omega.cross(v)),
                da.angular - w.cross(alpha),
            ),
            turned(da_dqd.linear - w.cross(v) - omega.cross(l), da_dqd.angular),
            turned(l, w),
            turned(j_dot.linear - omega.cross(l), j_dot.angular - omega.cross(w)),
        ]
    }

    /// Of v − ω × p, ω and of their rates a − ε × p − ω × v, ε.
    fn at_world_origin(&self, k: usize) -> [MotionVector<Dd>; 5] {
        let (p, MotionVector { linear: v, angular: omega }) = (self.p, self.velocity);
        let alpha = self.acceleration.angular;
        let [dv, da, da_dqd, j, j_dot] = self.blocks.each_ref().map(|block| block[k]);
        let (l, w) = (j.linear, j.angular);
        let motion = |linear: Vec3<Dd>, angular: Vec3<Dd>| MotionVector { linear, angular };
        [
            motion(dv.linear - dv.angular.cross(p) - omega.cross(l), dv.angular),
            motion(
                da.linear - da.angular.cross(p) - alpha.cross(l) - dv.angular.cross(v) - omega.cross(dv.linear),
                da.angular,
            ),
            motion(da_dqd.linear - da_dqd.angular.cross(p) - w.cross(v) - omega.cross(l), da_dqd.angular),
            motion(l - w.cross(p), w),
            motion(j_dot.linear - j_dot.angular.cross(p) - w.cross(v), j_dot.angular),
        ]
    }

    /// The blocks of a function.
    fn expected(&self, function: Function) -> Vec<ExpectedBlock> {
        let of = |k: usize| match function {
            Function::FrameDerivativesInOwnAxes => self.in_own_axes(k),
            _ => self.at_world_origin(k),
        };
        let all: Vec<_> = (0..self.blocks[0].len()).map(of).collect();
        let block = |(n, name): (usize, &&'static str)| {
            let columns: Vec<_> = all.iter().map(|blocks| blocks[n]).collect();
            ExpectedBlock { name, values: rows(&columns) }
        };
        BLOCKS.iter().enumerate().map(block).collect()
    }
}

/// The worst error of each block of a function's results.
fn errors<T: Copy + Into<Dd>>(expected: &[ExpectedBlock], results: &[T]) -> Vec<f64> {
    let length = results.len() / BLOCKS.len();
    expected.iter().zip(results.chunks(length)).map(|(block, own)| block.error(own)).collect()
}

fn hold<T: Real + Into<Dd>>(robots: &[&str], options: impl Fn(&DerivativeRobot) -> Options, most: f64) {
    let mut failures = Vec::new();
    for robot in robots.iter().map(|name| DerivativeRobot::load(name)) {
        for function in FUNCTIONS {
            let program = robot.program(function, &options(&robot));
            let mut worst = [0.0; 5];
            for state in &robot.states {
                let expected = InWorldAxes::new(&robot, state).expected(function);
                let found = programs::run::<T>(&program, &inputs(&robot, state));
                for ((error, name), worst) in errors(&expected, &found).into_iter().zip(BLOCKS).zip(&mut worst) {
                    *worst = f64::max(*worst, error);
                    if error > most {
                        failures.push(format!("{} {name} in {}: {error:e}", function.name(), state.id));
                    }
                }
            }
            let worst = worst.map(|error| format!("{error:.1e}")).join(" ");
            println!("{:<20} {:<34} {worst}", robot.name, function.name());
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn twists_of_frames_change_as_those_of_the_data_turned_and_moved() {
    hold::<Dd>(ARMS, as_written, BOUND_DD);
    hold::<Dd>(LEGGED, as_written, BOUND_DD);
}

#[test]
fn twists_of_frames_in_f64_lose_a_few_roundings() {
    hold::<f64>(ARMS, DerivativeRobot::options, BOUND);
    hold::<f64>(LEGGED, DerivativeRobot::options, BOUND);
}

/// Velocities and accelerations of frames know nothing of gravity.
#[test]
fn gravity_is_no_input_of_the_motion_of_frames() {
    let robot = DerivativeRobot::load("panda");
    let mut options = robot.options();
    options.scene.gravity = Gravity::Input;
    for function in FUNCTIONS {
        assert_eq!(robot.program(function, &options).graph.inputs.len(), 3);
    }
}

/// Every operation that is another one in a program, and changes a result, is seen in the data.
#[test]
fn a_wrong_sign_in_the_motion_of_a_frame_is_found() {
    let robot = DerivativeRobot::load("ur5");
    for function in FUNCTIONS {
        let graph = robot.program(function, &as_written(&robot)).graph;
        let of = |state: &DerivativeState| {
            (inputs::<Dd>(&robot, state).concat(), InWorldAxes::new(&robot, state).expected(function))
        };
        let (states, expected): (Vec<_>, Vec<_>) = robot.states.iter().map(of).unzip();
        let (all, escaped) =
            escaping(&graph, &states, |k, found| errors(&expected[k], found).iter().any(|error| *error > BOUND_DD));
        println!("{}: {all} mutants change a result, {} escape", function.name(), escaped.len());
        assert!(all > 500, "{all}");
        assert!(escaped.is_empty(), "{}: {}", function.name(), escaped.join("\n"));
    }
}
