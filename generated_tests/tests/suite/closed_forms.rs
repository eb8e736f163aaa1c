//! Robots whose equations of motion are known from textbooks, against the formulas.

use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};
use straightline_codegen::diagnostic::Source;
use straightline_codegen::model::ModelOptions;
use straightline_codegen::options::Options;
use straightline_codegen::program::program;
use straightline_codegen::Function;
use straightline_core::reference::quaternion_rotation;
use straightline_generated_tests::bounds::CLOSED_FORM;
use straightline_generated_tests::random::Random;
use straightline_generated_tests::{compiled, programs};

#[track_caller]
fn assert_close(a: f64, b: f64, scale: f64) {
    assert!(a == b || CLOSED_FORM.allows((a - b).abs() / scale), "{a:e} is not {b:e} (scale {scale:e})");
}

/// tau = (J + m l²) qdd + m g l sin q
#[test]
fn a_pendulum_swings_as_in_the_textbook() {
    let urdf = r#"<robot name="pendulum"><link name="world"/><link name="bob"><inertial><origin xyz="0 0 -0.4"/>
        <mass value="1.5"/><inertia ixx="0.03" iyy="0.02" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="pivot" type="continuous"><parent link="world"/><child link="bob"/><axis xyz="0 3 0"/></joint></robot>"#;
    let robot = programs::load(&Source::new("pendulum.urdf", urdf), &ModelOptions::default());
    let program = |f| program(&robot, &[], f, &Options::default());
    let (inverse, forward) = (program(Function::InverseDynamics), program(Function::ForwardDynamics));
    let (inertia, weight) = (0.02 + 1.5 * 0.4 * 0.4, 1.5 * 9.81 * 0.4);
    let mut random = Random(1);
    for _ in 0..50 {
        let [q, qd, qdd] = random.three(3.0);
        let tau = inertia * qdd + weight * q.sin();
        let scale = inertia * qdd.abs() + weight;
        assert_close(programs::run(&inverse, &[vec![q], vec![qd], vec![qdd]])[0], tau, scale);
        assert_close(programs::run(&forward, &[vec![q], vec![qd], vec![tau]])[0], qdd, scale / inertia);
    }
}

/// Two links in a vertical plane: every book's first example.
#[test]
fn the_planar_2r_arm_is_the_textbooks() {
    let [(m1, l1, c1, i1), (m2, _, c2, i2)] = [(1.5, 0.5, 0.25, 0.0335), (0.75, 0.4, 0.2, 0.011)];
    let g = 9.81;
    let robot = compiled::robot("planar2r");
    let mut random = Random(2);
    for _ in 0..50 {
        let (q, qd, qdd) = (random.list(2, 3.0), random.list(2, 2.0), random.list(2, 3.0));
        let (s, c) = q[1].sin_cos();
        let h11 = i1 + i2 + m1 * c1 * c1 + m2 * (l1 * l1 + c2 * c2 + 2.0 * l1 * c2 * c);
        let h12 = i2 + m2 * (c2 * c2 + l1 * c2 * c);
        let h22 = i2 + m2 * c2 * c2;
        let k = m2 * l1 * c2 * s;
        let (g1, g2) = (
            (m1 * c1 + m2 * l1) * g * q[0].cos() + m2 * c2 * g * (q[0] + q[1]).cos(),
            m2 * c2 * g * (q[0] + q[1]).cos(),
        );
        let velocity = [-k * (2.0 * qd[0] * qd[1] + qd[1] * qd[1]), k * qd[0] * qd[0]];
        let tau = [h11 * qdd[0] + h12 * qdd[1] + velocity[0] + g1, h12 * qdd[0] + h22 * qdd[1] + velocity[1] + g2];
        let x = vec![q, qd, qdd];
        for (a, b) in robot.call(Function::InverseDynamics, &x).iter().zip(tau) {
            assert_close(*a, b, 30.0);
        }
        for (a, b) in robot.call(Function::MassMatrix, &x[..1]).iter().zip([h11, h12, h12, h22]) {
            assert_close(*a, b, 1.0);
        }
        for (a, b) in robot.call(Function::GravityForce, &x[..1]).iter().zip([g1, g2]) {
            assert_close(*a, b, 10.0);
        }
        for (a, b) in robot.call(Function::VelocityForce, &x[..2]).iter().zip(velocity) {
            assert_close(*a, b, 10.0);
        }
    }
}

/// Newton and Euler for one body, about a point that is not its centre of mass.
#[test]
fn a_free_body_obeys_newton_and_euler() {
    let urdf = r#"<robot name="body"><link name="body"><inertial><origin xyz="0.1 -0.2 0.3"/><mass value="2.5"/>
        <inertia ixx="0.3" iyy="0.25" izz="0.2" ixy="0.01" ixz="-0.02" iyz="0.03"/></inertial></link></robot>"#;
    let options = ModelOptions { floating_base: true, ..ModelOptions::default() };
    let robot = programs::load(&Source::new("body.urdf", urdf), &options);
    let program = |f| program(&robot, &[], f, &Options::default());
    let (inverse, forward) = (program(Function::InverseDynamics), program(Function::ForwardDynamics));
    let (m, c) = (2.5, Vector3::new(0.1, -0.2, 0.3));
    let j = Matrix3::new(0.3, 0.01, -0.02, 0.01, 0.25, 0.03, -0.02, 0.03, 0.2);
    let mut random = Random(3);
    for _ in 0..50 {
        let (q, qd, qdd) = (random.configuration(7, true), random.list(6, 2.0), random.list(6, 3.0));
        let [v, w] = [0, 3].map(|k| Vector3::from_column_slice(&qd[k..k + 3]));
        let [vd, wd] = [0, 3].map(|k| Vector3::from_column_slice(&qdd[k..k + 3]));
        let g = quaternion_rotation([q[3], q[4], q[5], q[6]]).transpose() * Vector3::new(0.0, 0.0, -9.81);
        // acceleration of the centre of mass in body axes
        let a = vd + w.cross(&v) + wd.cross(&c) + w.cross(&w.cross(&c));
        let force = (a - g) * m;
        let moment = j * wd + w.cross(&(j * w)) + c.cross(&force);
        let tau: Vec<f64> = force.iter().chain(moment.iter()).copied().collect();
        for (a, b) in programs::run(&inverse, &[q.clone(), qd.clone(), qdd.clone()]).iter().zip(&tau) {
            assert_close(*a, *b, 60.0);
        }
        for (a, b) in programs::run(&forward, &[q.clone(), qd.clone(), tau]).iter().zip(&qdd) {
            assert_close(*a, *b, 200.0);
        }
    }
}

/// A column that turns, a carriage that climbs it, an arm that slides out of it, a hand that rolls.
#[test]
fn the_cylindrical_arms_mass_matrix_and_gravity_are_those_found_by_hand() {
    let [m2, m3, m4] = [7.5, 4.0, 0.8];
    let j4 = Matrix3::new(0.002, 0.0001, 0.0, 0.0001, 0.003, -0.0002, 0.0, -0.0002, 0.0025);
    let robot = compiled::robot("chapter_cylindrical");
    let mut random = Random(4);
    for _ in 0..50 {
        let q = random.list(4, 1.5);
        let (s, c) = q[3].sin_cos();
        // centres of mass in axes that turn with the column, x along the arm
        let (x2, x3, x4) = (0.05, 0.05 + 0.12 + q[2] + 0.3, 0.05 + 0.12 + q[2] + 0.3 + 0.35 + 0.06);
        let (y4, dy4, dz4) = (0.01 * c, -0.01 * s, 0.01 * c);
        let roll = Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c);
        let j = roll * j4 * roll.transpose();
        let h11 = 0.12 + (0.09 + m2 * x2 * x2) + (0.07 + m3 * x3 * x3) + j[(2, 2)] + m4 * (x4 * x4 + y4 * y4);
        let (h13, h14) = (-m4 * y4, j[(2, 0)] + m4 * x4 * dy4);
        let (h22, h24, h33) = (m2 + m3 + m4, m4 * dz4, m3 + m4);
        let h44 = j[(0, 0)] + m4 * (dy4 * dy4 + dz4 * dz4);
        #[rustfmt::skip]
        let h = Matrix4::new(
            h11, 0.0, h13, h14,
            0.0, h22, 0.0, h24,
            h13, 0.0, h33, 0.0,
            h14, h24, 0.0, h44,
        );
        let g = Vector4::new(0.0, (m2 + m3 + m4) * 9.81, 0.0, m4 * 9.81 * dz4);
        for (a, b) in robot.call(Function::MassMatrix, std::slice::from_ref(&q)).iter().zip(h.iter()) {
            assert_close(*a, *b, 20.0);
        }
        for (a, b) in robot.call(Function::GravityForce, &[q]).iter().zip(g.iter()) {
            assert_close(*a, *b, 200.0);
        }
    }
}
