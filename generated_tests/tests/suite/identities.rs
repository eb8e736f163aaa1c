//! Laws of mechanics that hold for every robot, on compiled code.

use nalgebra::{DMatrix, DVector};
use straightline_codegen::diagnostic::Source;
use straightline_codegen::equations::Robot as Loaded;
use straightline_codegen::options::Options;
use straightline_codegen::program::TracedProgram;
use straightline_codegen::Function;
use straightline_core::joint::Measure;
use straightline_core::reference::quaternion_rotation;
use straightline_core::Dd;
use straightline_generated_tests::bounds::{Bound, IDENTITY, MOVED, ORTHOGONAL, SOLVED_IDENTITY};
use straightline_generated_tests::compiled::{self, Compiled};
use straightline_generated_tests::inputs::ready_to_paste;
use straightline_generated_tests::programs::{self, cast, program};
use straightline_generated_tests::random::Random;
use straightline_generated_tests::reference::Robot;

/// Half a step of a central difference in double-double: its error is about 1e-20, its rounding 1e-22.
const STEP: f64 = 1e-10;

/// A compiled robot in a random state.
struct State {
    robot: Robot,
    compiled: &'static Compiled<f64>,
    loaded: Loaded,
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
}

/// Five states of each of the eleven robots.
fn for_all_states(check: impl Fn(&State)) {
    for compiled in compiled::all_rules() {
        let robot = Robot::load(compiled.robot);
        let loaded = programs::load(&programs::source(&robot), &programs::options(&robot).model);
        let mut random = Random(robot.nv as u64);
        let (q, qd, qdd) = (vec![], vec![], vec![]);
        let mut state = State { robot, compiled, loaded, q, qd, qdd };
        for _ in 0..5 {
            state.q = random.configuration(state.loaded.model.nq(), state.robot.floating);
            state.qd = random.list(state.robot.nv, 2.0);
            state.qdd = random.list(state.robot.nv, 3.0);
            check(&state);
        }
    }
}

impl State {
    fn call(&self, function: Function, inputs: &[&[f64]]) -> DVector<f64> {
        let inputs: Vec<Vec<f64>> = inputs.iter().map(|x| x.to_vec()).collect();
        self.compiled.call(function, &inputs).into()
    }

    fn mass_matrix(&self) -> DMatrix<f64> {
        DMatrix::from_row_slice(self.robot.nv, self.robot.nv, self.call(Function::MassMatrix, &[&self.q]).as_slice())
    }

    /// 6 rows per frame.
    fn jacobian(&self) -> DMatrix<f64> {
        let rows = 6 * self.robot.frames.len();
        DMatrix::from_row_slice(rows, self.robot.nv, self.call(Function::Jacobian, &[&self.q]).as_slice())
    }

    /// The program of a function, for derivatives in double-double.
    fn program(&self, function: Function) -> TracedProgram {
        program(&self.loaded, &self.robot.frames, function, &Options::default())
    }

    /// q after a short time t of moving with `rate`, to first order at least.
    fn moved(&self, rate: &[f64], t: f64) -> Vec<Dd> {
        let mut q: Vec<Dd> = self.q.iter().map(|x| Dd::from(*x)).collect();
        for joint in self.loaded.model.free_joints() {
            let v = |k: usize| Dd::from(rate[joint.iv + k]) * Dd::from(t);
            let i = joint.iq;
            if joint.kind.is_single() {
                q[i] += v(0);
                continue;
            }
            let [x, y, z, w] = [q[i + 3], q[i + 4], q[i + 5], q[i + 6]];
            // p' = R v
            let dp = quaternion_rotation([x, y, z, w]) * nalgebra::Vector3::new(v(0), v(1), v(2));
            (0..3).for_each(|k| q[i + k] += dp[k]);
            // quaternion' = ½ quaternion ∘ (ω, 0)
            let [a, b, c] = [v(3), v(4), v(5)].map(|x| x * Dd::HALF);
            let turned = [
                x + w * a + y * c - z * b,
                y + w * b + z * a - x * c,
                z + w * c + x * b - y * a,
                w - x * a - y * b - z * c,
            ];
            let norm = turned.iter().fold(Dd::ZERO, |sum, x| sum + *x * *x).sqrt();
            (0..4).for_each(|k| q[i + 3 + k] = turned[k] / norm);
        }
        q
    }

    /// The time derivative of a program's results while the robot moves with `rate` and, where a program takes them, the
    /// velocities change by `acceleration`.
    fn derivative(&self, function: Function, rate: &[f64], acceleration: &[f64]) -> Vec<f64> {
        let program = self.program(function);
        let at = |t: f64| {
            let qd =
                (0..self.robot.nv).map(|i| Dd::from(self.qd[i]) + Dd::from(acceleration[i]) * Dd::from(t)).collect();
            let mut inputs = vec![self.moved(rate, t), qd];
            inputs.truncate(program.graph.inputs.len());
            programs::run(&program, &inputs)
        };
        let (after, before) = (at(STEP), at(-STEP));
        after.iter().zip(&before).map(|(a, b)| ((*a - *b) / Dd::from(2.0 * STEP)).to_f64()).collect()
    }

    /// Fails, with the state, if a and b differ by more of the scale than the bound allows.
    fn assert_close(&self, claim: &str, a: &DVector<f64>, b: &DVector<f64>, scale: f64, bound: &Bound) {
        let error = (a - b).amax();
        assert!(
            error == 0.0 || bound.allows(error / scale),
            "{claim}: {}: {error:e} of {scale:e}\n{a}{b}{}",
            self.robot.name,
            ready_to_paste(&[self.q.clone(), self.qd.clone(), self.qdd.clone()])
        );
    }

    /// Fails if a and b are not the same numbers.
    fn assert_same(&self, claim: &str, a: &DVector<f64>, b: &DVector<f64>) {
        assert_eq!(a, b, "{claim}: {}", self.robot.name);
    }

    fn rest(&self) -> Vec<f64> {
        vec![0.0; self.robot.nv]
    }
}

#[test]
fn the_mass_matrix_is_symmetric_and_positive_definite() {
    for_all_states(|s| {
        let h = s.mass_matrix();
        assert!(h == h.transpose(), "{}: {h}", s.robot.name);
        // Cholesky's pivots
        let (n, mut a) = (h.nrows(), h.clone());
        for k in 0..n {
            assert!(a[(k, k)] > 0.0, "{}: pivot {k} is {}\n{h}", s.robot.name, a[(k, k)]);
            for i in k + 1..n {
                let factor = a[(i, k)] / a[(k, k)];
                (k..n).for_each(|j| a[(i, j)] -= factor * a[(k, j)]);
            }
        }
    });
}

#[test]
fn drives_are_affine_in_the_accelerations() {
    for_all_states(|s| {
        let tau = s.call(Function::InverseDynamics, &[&s.q, &s.qd, &s.qdd]);
        let (h, bias) = (s.mass_matrix(), s.call(Function::BiasForce, &[&s.q, &s.qd]));
        let qdd = DVector::from_column_slice(&s.qdd);
        let scale = (h.abs() * qdd.abs()).amax() + bias.amax();
        s.assert_close("tau = H qdd + h", &tau, &(h * qdd + bias), scale, &IDENTITY);
    });
}

#[test]
fn the_bias_is_velocity_and_gravity_forces() {
    for_all_states(|s| {
        let bias = s.call(Function::BiasForce, &[&s.q, &s.qd]);
        let velocity = s.call(Function::VelocityForce, &[&s.q, &s.qd]);
        let gravity = s.call(Function::GravityForce, &[&s.q]);
        let scale = velocity.amax() + gravity.amax();
        s.assert_close("h = C qd + g", &bias, &(velocity + gravity), scale, &IDENTITY);
    });
}

#[test]
fn velocity_forces_are_even_and_quadratic_in_the_velocities() {
    for_all_states(|s| {
        let times = |k: f64| {
            let qd: Vec<f64> = s.qd.iter().map(|x| k * x).collect();
            s.call(Function::VelocityForce, &[&s.q, &qd])
        };
        // powers of two: not even the rounding differs
        s.assert_same("C(−2 qd)(−2 qd) = 4 C(qd) qd", &times(-2.0), &(times(1.0) * 4.0));
    });
}

#[test]
fn gravity_force_is_the_gradient_of_potential_energy() {
    for_all_states(|s| {
        let gravity = s.call(Function::GravityForce, &[&s.q]);
        let gradient: Vec<f64> = (0..s.robot.nv)
            .map(|i| {
                let mut unit = s.rest();
                unit[i] = 1.0;
                s.derivative(Function::Energy, &unit, &s.rest())[1]
            })
            .collect();
        let gradient = DVector::from_vec(gradient);
        s.assert_close("g = dV/dq", &gravity, &gradient, gradient.amax(), &IDENTITY);
    });
}

#[test]
fn energy_grows_by_the_power_of_the_drives() {
    for_all_states(|s| {
        let tau = s.call(Function::InverseDynamics, &[&s.q, &s.qd, &s.qdd]);
        let rates = s.derivative(Function::Energy, &s.qd, &s.qdd);
        let qd = DVector::from_column_slice(&s.qd);
        let scale = tau.abs().dot(&qd.abs()) + rates[0].abs();
        let (power, rate) = (DVector::from_element(1, tau.dot(&qd)), DVector::from_element(1, rates[0] + rates[1]));
        s.assert_close("tau · qd = d(T + V)/dt", &power, &rate, scale, &IDENTITY);
    });
}

#[test]
fn kinetic_energy_is_half_of_the_velocities_through_the_mass_matrix() {
    for_all_states(|s| {
        let energy = s.call(Function::Energy, &[&s.q, &s.qd]);
        let (h, qd) = (s.mass_matrix(), DVector::from_column_slice(&s.qd));
        let scale = qd.abs().dot(&(h.abs() * qd.abs()));
        let half = DVector::from_element(1, 0.5 * qd.dot(&(h * &qd)));
        s.assert_close("T = ½ qd · H qd", &DVector::from_element(1, energy[0]), &half, scale, &IDENTITY);
    });
}

#[test]
fn forward_dynamics_undoes_inverse_dynamics() {
    for_all_states(|s| {
        let tau = s.call(Function::InverseDynamics, &[&s.q, &s.qd, &s.qdd]);
        let again = s.call(Function::ForwardDynamics, &[&s.q, &s.qd, tau.as_slice()]);
        // judged by the drives, so that a badly conditioned H is not held against either
        let h = s.mass_matrix();
        let qdd = DVector::from_column_slice(&s.qdd);
        let bias = s.call(Function::BiasForce, &[&s.q, &s.qd]);
        let scale = (h.abs() * qdd.abs()).amax() + bias.amax() + (h.abs() * again.abs()).amax();
        s.assert_close("H (FD(ID(qdd)) − qdd) = 0", &(&h * again), &(&h * qdd), scale, &SOLVED_IDENTITY);
    });
}

#[test]
fn the_jacobian_gives_velocity_and_acceleration_of_the_frames() {
    for_all_states(|s| {
        let (j, qd) = (s.jacobian(), DVector::from_column_slice(&s.qd));
        let velocity = s.call(Function::FrameVelocity, &[&s.q, &s.qd]);
        let scale = (j.abs() * qd.abs()).amax();
        s.assert_close("v = J qd", &velocity, &(&j * qd), scale, &IDENTITY);

        let qdd = DVector::from_column_slice(&s.qdd);
        let acceleration = s.call(Function::FrameAcceleration, &[&s.q, &s.qd, &s.qdd]);
        let bias = s.call(Function::JacobianBias, &[&s.q, &s.qd]);
        let scale = (j.abs() * qdd.abs()).amax() + bias.amax();
        s.assert_close("a = J qdd + J̇ qd", &acceleration, &(j * qdd + bias), scale, &IDENTITY);
    });
}

#[test]
fn the_jacobians_bias_is_the_rate_of_the_velocity_of_a_frame() {
    for_all_states(|s| {
        let bias = s.call(Function::JacobianBias, &[&s.q, &s.qd]);
        let rate = DVector::from_vec(s.derivative(Function::FrameVelocity, &s.qd, &s.rest()));
        s.assert_close("J̇ qd", &bias, &rate, rate.amax(), &IDENTITY);
    });
}

#[test]
fn the_velocity_of_a_frame_is_the_rate_of_its_position() {
    for_all_states(|s| {
        let velocity = s.call(Function::FrameVelocity, &[&s.q, &s.qd]);
        let rate = s.derivative(Function::ForwardKinematics, &s.qd, &s.rest());
        for frame in 0..s.robot.frames.len() {
            let (v, p) =
                (velocity.rows(6 * frame, 3).into_owned(), DVector::from_column_slice(&rate[12 * frame..][..3]));
            s.assert_close("v = dp/dt", &v, &p, velocity.amax(), &IDENTITY);
        }
    });
}

#[test]
fn orientations_are_right_handed_and_orthogonal() {
    for_all_states(|s| {
        let x = s.call(Function::ForwardKinematics, &[&s.q]);
        for frame in x.as_slice().chunks(12) {
            let r = nalgebra::Matrix3::from_row_slice(&frame[3..]);
            let error = (r * r.transpose() - nalgebra::Matrix3::identity()).amax();
            // x × y is z, not −z
            let hand = (r.column(0).cross(&r.column(1)) - r.column(2)).amax();
            assert!(ORTHOGONAL.allows(error) && ORTHOGONAL.allows(hand), "{}: {r}", s.robot.name);
        }
    });
}

#[test]
fn linear_momentum_is_mass_times_the_velocity_of_the_centre_of_mass() {
    for_all_states(|s| {
        let mass: f64 = s.loaded.model.bodies.iter().map(|b| b.inertia.mass.to_f64()).sum();
        let momentum = s.call(Function::Momentum, &[&s.q, &s.qd]).rows(0, 3).into_owned();
        let velocity = DVector::from_vec(s.derivative(Function::CentreOfMass, &s.qd, &s.rest()));
        s.assert_close("p = m v_c", &momentum, &(velocity * mass), momentum.amax(), &IDENTITY);
    });
}

/// Newton for the whole robot: what the floating base is pushed with, and weight, make the momentum grow.
#[test]
fn the_force_on_a_floating_base_is_the_rate_of_momentum_less_weight() {
    for_all_states(|s| {
        if !s.robot.floating {
            return;
        }
        let tau = s.call(Function::InverseDynamics, &[&s.q, &s.qd, &s.qdd]);
        let r = quaternion_rotation([s.q[3], s.q[4], s.q[5], s.q[6]]);
        let force = r * nalgebra::Vector3::new(tau[0], tau[1], tau[2]);
        let rate = s.derivative(Function::Momentum, &s.qd, &s.qdd);
        let mass: f64 = s.loaded.model.bodies.iter().map(|b| b.inertia.mass.to_f64()).sum();
        let g = s.loaded.model.gravity.to_array().map(|x| x.to_f64());
        let expected = DVector::from_fn(3, |i, _| rate[i] - mass * g[i]);
        let scale = expected.amax();
        s.assert_close("F = dp/dt − m g", &DVector::from_column_slice(force.as_slice()), &expected, scale, &IDENTITY);
    });
}

#[test]
fn the_drive_is_the_part_of_the_joints_wrench_along_its_axis() {
    for_all_states(|s| {
        let tau = s.call(Function::InverseDynamics, &[&s.q, &s.qd, &s.qdd]);
        let wrenches = s.call(Function::JointWrenches, &[&s.q, &s.qd, &s.qdd]);
        let mut joints: Vec<_> = s.loaded.model.bodies.iter().collect();
        joints.sort_by_key(|b| b.joint.iv);
        for (body, w) in joints.iter().zip(wrenches.as_slice().chunks(6)) {
            // the joint axis, z of the canonical frame, in link axes
            let row = body.link_frame.rotation.rows[2].map(|x| x.to_f64());
            let along = |v: &[f64]| row[0] * v[0] + row[1] * v[1] + row[2] * v[2];
            let drive = match body.joint.kind.elementary() {
                Some(Measure::Angle) => along(&w[3..]),
                Some(Measure::Length) => along(&w[..3]),
                None => continue,
            };
            let scale = w.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
            let (a, b) = (DVector::from_element(1, tau[body.joint.iv]), DVector::from_element(1, drive));
            s.assert_close(&format!("drive of {}", body.joint.name), &a, &b, scale, &IDENTITY);
        }
    });
}

#[test]
fn a_quaternion_and_its_negative_are_the_same_orientation() {
    for_all_states(|s| {
        if !s.robot.floating {
            return;
        }
        let mut negative = s.q.clone();
        negative[3..7].iter_mut().for_each(|x| *x = -*x);
        let tau = |q: &[f64]| s.call(Function::InverseDynamics, &[q, &s.qd, &s.qdd]);
        s.assert_same("±quaternion", &tau(&s.q), &tau(&negative));
    });
}

/// The robot of a changed file, in double-double, against the unchanged one: the drives.
fn drives_differ_by(robot: &Robot, changed: &str, gravity: Option<[f64; 3]>) -> f64 {
    let options = programs::options(robot);
    let mut turned = options.clone();
    turned.model.gravity = gravity;
    let file = Source::new("changed.urdf", changed);
    let function = Function::InverseDynamics;
    let a = program(&programs::load(&programs::source(robot), &options.model), &[], function, &options);
    let b = program(&programs::load(&file, &turned.model), &[], function, &options);
    robot.states.iter().filter(|s| s.gravity.is_none() && !s.kind.starts_with("far")).fold(0.0, |worst: f64, state| {
        let inputs = cast::<Dd>(&state.inputs(function));
        let mut expected = robot.expected(state, function).expect("every state has drives");
        expected.values = programs::run(&a, &inputs);
        worst.max(expected.worst(&programs::run(&b, &inputs)).0)
    })
}

fn text(robot: &Robot) -> String {
    programs::source(robot).text().to_string()
}

#[test]
fn turning_and_moving_the_whole_scene_changes_nothing() {
    let robot = Robot::load("panda");
    let turned = text(&robot).replace(
        "</robot>",
        "<link name=\"turned\"/><joint name=\"turn\" type=\"fixed\"><parent link=\"turned\"/><child link=\"panda_link0\"/>\
         <origin xyz=\"0.3 -2.5 1.75\" rpy=\"0.7 -0.4 2.1\"/></joint></robot>",
    );
    // the same turn of gravity, rounded to f64: R (0, 0, −9.81) with R = Rz(2.1) Ry(−0.4) Rx(0.7)
    let [(sr, cr), (sp, cp), (sy, cy)] = [0.7f64, -0.4, 2.1].map(f64::sin_cos);
    let gravity = [cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr].map(|x| -9.81 * x);
    let difference = drives_differ_by(&robot, &turned, Some(gravity));
    assert!(MOVED.allows(difference), "{difference:e}");
}

#[test]
fn a_tool_without_mass_changes_nothing() {
    let robot = Robot::load("panda");
    let tool = text(&robot).replace(
        "</robot>",
        "<link name=\"massless\"/><joint name=\"grip\" type=\"fixed\"><parent link=\"panda_hand_tcp\"/><child link=\"massless\"/>\
         <origin xyz=\"0.3 0.2 0.1\" rpy=\"1 2 3\"/></joint></robot>",
    );
    assert_eq!(drives_differ_by(&robot, &tool, None), 0.0);
}

/// A link sawn in two and welded together again is the same link.
#[test]
fn a_welded_cut_changes_nothing() {
    let robot = Robot::load("planar2r");
    let whole = "<mass value=\"0.75\"/>\n      <inertia ixx=\"0.001\" ixy=\"0.0\" ixz=\"0.0\" iyy=\"0.0105\" iyz=\"0.0\" izz=\"0.011\"/>";
    let half = "<mass value=\"0.375\"/>\n      <inertia ixx=\"0.0005\" ixy=\"0.0\" ixz=\"0.0\" iyy=\"0.00525\" iyz=\"0.0\" izz=\"0.0055\"/>";
    let file = text(&robot);
    assert!(file.contains(whole));
    let cut = file.replace(whole, half).replace(
        "</robot>",
        &format!(
            "<link name=\"other\"><inertial><origin xyz=\"-0.1 0.25 0.5\" rpy=\"0 0 0\"/>{half}</inertial></link>\
             <joint name=\"weld\" type=\"fixed\"><parent link=\"link2\"/><child link=\"other\"/>\
             <origin xyz=\"0.45 0.1 -0.5\" rpy=\"0 0 1.5707963267948966\"/></joint></robot>"
        ),
    );
    // The other half: its axes are turned a quarter about z, so its tensor is given in the turned axes.
    let cut = cut.replace(
        "<origin xyz=\"-0.1 0.25 0.5\" rpy=\"0 0 0\"/>",
        "<origin xyz=\"-0.1 0.25 0.5\" rpy=\"0 0 -1.5707963267948966\"/>",
    );
    let difference = drives_differ_by(&robot, &cut, None);
    assert!(MOVED.allows(difference), "{difference:e}");
}
