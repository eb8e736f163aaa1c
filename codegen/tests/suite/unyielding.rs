//! Shafts that do not give way (T f = 0): (20.80) allows them, as E − H T F stays regular, and the complete model has none of their inertia.
//! Against the second author, who solves the united system of chain and actuators as it is printed, in double-double.

use crate::chain::{arm, LAST_LINK};
use nalgebra::{DMatrix, DVector};
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::evaluate;
use straightline_codegen::model::{load, ModelOptions};
use straightline_codegen::program::optimised;
use straightline_codegen::verify::verify;
use straightline_codegen::{compile, Function, Options, Source};
use straightline_core::algorithms::{
    bias_force, drive_energy, drive_states, driven_contact_motion, driven_jump, impact, kinetic_energy, mass_matrix,
    ContactRows, FunctionalCoordinates, Struck, Support,
};
use straightline_core::drive::Actuator;
use straightline_core::model::Model;
use straightline_core::reference::drives::{ActuatorModel, UnitedModel};
use straightline_core::Dd;

/// A motor; a shaft that does not give way, whose third state feels its load; an actuator with an inertia of its own. Connected directly.
const DIRECT: &str = "
[[drive]]
joint = \"one\"
motor = { torque_constant = 0.8, resistance = 1.2, rotor_inertia = 0.04, inductance = 0.01, friction = 0.1 }
[[drive]]
joint = \"two\"
actuator = { C = [[0.0, 1.0, 0.0], [-3.0, -2.0, 0.7], [0.0, 0.4, -5.0]], f = [0.0, 0.0, 0.3], d = [0.0, 5.0, 1.0], T = [0.0, 1.0, 0.0] }
[[drive]]
joint = \"three\"
actuator = { C = [[0.0, 1.0], [-1.0, -2.0]], f = [0.1, -8.0], d = [0.0, 5.0], T = [0.0, 1.0] }
";

/// The same with gears, losses and springs.
const GEARED: &str = "
[[drive]]
joint = \"one\"
actuator = { C = [[0.0, 1.0, 0.0], [-3.0, -2.0, 0.7], [0.0, 0.4, -5.0]], f = [0.0, 0.0, 0.3], d = [0.0, 5.0, 1.0], T = [0.0, 1.0, 0.0], position = [1.0, 0.0, 0.0] }
stages = [{ ratio = 3.0, stiffness = 400.0, damping = 2.0, input_inertia = 1e-3 }]
[[drive]]
joint = \"two\"
ratio = -12.0
efficiency = { forward = 0.8, backward = 0.7 }
actuator = { C = [[0.0, 1.0, 0.0], [-3.0, -2.0, 0.7], [0.0, 0.4, -5.0]], f = [0.0, 0.0, 0.3], d = [0.0, 5.0, 1.0], T = [0.0, 1.0, 0.0] }
[[drive]]
joint = \"three\"
ratio = 20.0
efficiency = 0.9
motor = { torque_constant = 0.08, resistance = 1.2, rotor_inertia = 4e-5 }
";

fn robot(source: &Source) -> Robot {
    let (model, diagnostics) = load(source, &ModelOptions::default());
    Robot::new(model.unwrap_or_else(|| panic!("{diagnostics}")))
}

/// The results of a function of the drives in double-double, block by block.
fn run(robot: &Robot, function: Function, inputs: &[(&str, &[Dd])]) -> Vec<Vec<Dd>> {
    let options = Options::default();
    let graph = optimised(robot, &[], function, &options, options.optimisations());
    let named = |name: &str| inputs.iter().find(|i| i.0 == name).unwrap_or_else(|| panic!("no {name}")).1;
    let arguments: Vec<Dd> = graph.inputs.iter().flat_map(|p| named(&p.name).iter().copied()).collect();
    let mut results = evaluate(&graph, &arguments).into_iter();
    graph.outputs.iter().map(|port| results.by_ref().take(port.len()).collect()).collect()
}

fn wide(x: &[f64]) -> Vec<Dd> {
    x.iter().map(|x| Dd::from(*x)).collect()
}

fn apart(a: &[Dd], b: &[Dd]) -> f64 {
    assert_eq!(a.len(), b.len());
    let scale = b.iter().map(|x| x.to_f64().abs()).fold(1.0, f64::max);
    a.iter().zip(b).map(|(a, b)| (*a - *b).to_f64().abs() / scale).fold(0.0, |m, x| if x <= m { m } else { x })
}

/// q, q̇, x, u.
struct State([Vec<Dd>; 4]);

fn state(model: &Model<Dd>) -> State {
    let (q, qd) = (wide(&[0.3, -1.1, 0.7]), wide(&[0.9, -0.4, 1.3]));
    let x = (0..drive_states(model)).map(|i| Dd::from(0.3 * ((i * 7 % 5) as f64) - 0.45)).collect();
    State([q, qd, x, wide(&[4.0, -3.0, 2.0])])
}

/// The second author's model of drives that are connected directly, with θ and θ̇ of motors in x.
fn united(model: &Model<Dd>, State([q, qd, x, _]): &State) -> (UnitedModel<Dd>, DVector<Dd>) {
    let nv = model.nv();
    let mut x = x.clone();
    let (mut actuators, mut first) = (Vec::new(), 0);
    for drive in &model.drives {
        let joint = &model.bodies[drive.joints[0].0].joint;
        actuators.push(match &drive.actuator {
            Actuator::Motor(m) => {
                (x[first], x[first + 1]) = (q[joint.iq], qd[joint.iv]);
                straightline_core::reference::drives::DcMotor {
                    j: m.rotor_inertia,
                    c_m: m.torque_constant,
                    c_e: m.emf_constant,
                    b: m.friction,
                    r: m.resistance,
                    l: m.inductance,
                }
                .model()
            }
            Actuator::Linear(a) => ActuatorModel {
                c: DMatrix::from_row_slice(a.f.len(), a.f.len(), &a.c),
                f: DVector::from_column_slice(&a.f),
                d: DVector::from_column_slice(&a.d),
                t: DVector::from_column_slice(&a.t),
            },
        });
        first += drive.states();
    }
    let united = UnitedModel {
        h_matrix: DMatrix::from_row_slice(nv, nv, &mass_matrix(model, q)),
        h: DVector::from_vec(bias_force(model, q, qd)),
        actuators,
        ratios: DMatrix::from_diagonal_element(nv, nv, Dd::ONE),
        losses: DVector::from_element(nv, Dd::ONE),
    };
    (united, DVector::from_vec(x))
}

/// H H⁻¹ is left with 1e-32 of a condition of 1e3.
const EXACT: f64 = 1e-26;

#[test]
fn motion_and_torques_are_those_of_the_printed_equations() {
    // the last link without any inertia is driven by an actuator with an inertia of its own
    for last in [LAST_LINK, ""] {
        let robot = robot(&arm(last, DIRECT));
        let at = state(&robot.model);
        let (united, own) = united(&robot.model, &at);
        let State([q, qd, x, u]) = &at;
        let inputs = [("q", &q[..]), ("qd", qd), ("x", x), ("u", u)];
        let printed = united.printed_torques(&own, &DVector::from_column_slice(u));
        let solved = united.solve(&own, &DVector::from_column_slice(u));
        assert!(apart(printed.as_slice(), solved.tau.as_slice()) < EXACT);
        let torques = run(&robot, Function::DriveTorques, &inputs);
        assert!(apart(&torques[0], printed.as_slice()) < EXACT, "{last}: {torques:?} {printed:?}");
        assert!(apart(&torques[1], printed.as_slice()) < EXACT, "{last}: {torques:?} {printed:?}");
        let motion = run(&robot, Function::DrivenForwardDynamics, &inputs);
        assert!(apart(&motion[0], solved.qdd.as_slice()) < EXACT, "{last}: {motion:?} {solved:?}");
        assert!(apart(&motion[1], solved.xd.as_slice()) < EXACT, "{last}: {motion:?} {solved:?}");
        let (drift, gain) = united.state_space(&own);
        let space = run(&robot, Function::StateSpace, &inputs);
        assert!(apart(&space[0], drift.as_slice()) < EXACT, "{last}: {space:?} {drift:?}");
        assert!(apart(&space[1], gain.transpose().as_slice()) < EXACT, "{last}: {space:?} {gain:?}");
    }
}

#[test]
fn a_massless_link_needs_no_inertia_where_its_shaft_does_not_give_way() {
    let drives = DIRECT.replace("f = [0.1, -8.0]", "f = [0.1, 0.0]");
    let source = arm("", &drives);
    let robot = robot(&source);
    let at = state(&robot.model);
    let (united, own) = united(&robot.model, &at);
    let State([q, qd, x, u]) = &at;
    let solved = united.solve(&own, &DVector::from_column_slice(u));
    let motion = run(&robot, Function::DrivenForwardDynamics, &[("q", &q[..]), ("qd", qd), ("x", x), ("u", u)]);
    assert!(apart(&motion[0], solved.qdd.as_slice()) < EXACT && apart(&motion[1], solved.xd.as_slice()) < EXACT);
    let functions = |list: &[Function]| Options { functions: list.to_vec(), ..Options::default() };
    let driven = Function::DrivenForwardDynamics;
    assert!(compile(&source, &functions(&[driven])).is_ok());
    // without the drive it does
    let errors = compile(&source, &functions(&[Function::ForwardDynamics, driven])).expect_err("H is singular");
    let said: Vec<&str> = errors.iter().filter(|d| d.code == "no-forward-dynamics").map(|d| d.title.as_str()).collect();
    assert_eq!(said, ["forward dynamics is asked for, and joint `three` feels no inertia"]);
}

#[test]
fn gears_losses_and_springs_behind_such_shafts_agree_with_the_second_author() {
    let source = arm(LAST_LINK, GEARED);
    let functions = [Function::DrivenForwardDynamics, Function::DriveTorques].to_vec();
    let options = Options { functions, ..Options::default() };
    let generated = compile(&source, &options).unwrap_or_else(|d| panic!("{d}"));
    let verified = verify(&source, &generated, &options, (40, 3), || ()).expect("the reference has them");
    assert!(verified.passes(), "{verified:?}");
    assert_eq!(verified.functions.len(), 2);
}

#[test]
fn the_rows_of_the_complete_model_hold_and_the_inputs_follow_from_the_motion() {
    for drives in
        [DIRECT, &GEARED.replace("efficiency = 0.9", "").replace("efficiency = { forward = 0.8, backward = 0.7 }", "")]
    {
        let robot = robot(&arm(LAST_LINK, drives));
        let State([q, qd, x, u]) = state(&robot.model);
        let inputs = [("q", &q[..]), ("qd", &qd), ("x", &x), ("u", &u)];
        let motion = run(&robot, Function::DrivenForwardDynamics, &inputs);
        let space = run(&robot, Function::StateSpace, &inputs);
        let affine = |i: usize| (0..3).fold(space[0][i], |sum, k| sum + space[1][3 * i + k] * u[k]);
        let rates: Vec<Dd> = (0..x.len()).map(affine).collect();
        assert!(apart(&rates, &motion[1]) < EXACT, "{drives}");
        let model = run(&robot, Function::CompleteModel, &inputs);
        let left = |i: usize| (0..3).fold(model[1][i], |sum, j| sum + model[0][3 * i + j] * motion[0][j]);
        let right = |i: usize| (0..3).fold(Dd::ZERO, |sum, k| sum + model[2][3 * i + k] * u[k]);
        let (left, right): (Vec<Dd>, Vec<Dd>) = (0..3).map(|i| (left(i), right(i))).unzip();
        assert!(apart(&left, &right) < EXACT, "{drives}");
        assert_eq!(model[0][3..6].iter().filter(|h| **h != Dd::ZERO).count(), 1, "the row of its joint is its own");
    }
    let robot = robot(&arm(LAST_LINK, &DIRECT.replace("inductance = 0.01, ", "")));
    let State([q, qd, x, u]) = state(&robot.model);
    let motion = run(&robot, Function::DrivenForwardDynamics, &[("q", &q[..]), ("qd", &qd), ("x", &x), ("u", &u)]);
    let back =
        run(&robot, Function::DrivenInverseDynamics, &[("q", &q[..]), ("qd", &qd), ("qdd", &motion[0]), ("x", &x)]);
    assert!(apart(&back[0], &u) < EXACT, "{back:?}");
}

/// A contact along two directions of the joints, as rows.
fn rows(model: &Model<Dd>) -> FunctionalCoordinates<Dd> {
    let jacobian = vec![wide(&[0.4, 0.9, -0.3]), wide(&[-0.7, 0.2, 0.5])];
    let rate = jacobian.iter().map(|_| Dd::from(-0.3)).collect();
    assert_eq!(model.nv(), 3);
    FunctionalCoordinates { value: wide(&[0.0, 0.0]), rate, jacobian, bias: wide(&[0.6, -0.2]) }
}

#[test]
fn such_shafts_hold_their_joints_against_contacts_and_impacts() {
    let robot = robot(&arm(LAST_LINK, DIRECT));
    let model = &robot.model;
    let at = state(model);
    let (united, own) = united(model, &at);
    let State([q, qd, x, u]) = &at;
    let (h, bias) = (mass_matrix(model, q), bias_force(model, q, qd));
    let contact = ContactRows {
        coordinates: &rows(model),
        applied: None,
        supports: &[Support::Rigid(Dd::ZERO), Support::Rigid(Dd::ZERO)],
        ridge: Dd::from(1e-30),
    };
    let (motion, drives) = driven_contact_motion(model, (q, qd, x, u), &bias, &h, contact);
    let jacobian = rows(model).jacobian;
    // the second author under the reactions that were found
    let pushed = (0..3).map(|i| bias[i] - jacobian[0][i] * motion.force[0] - jacobian[1][i] * motion.force[1]);
    let under = UnitedModel { h: DVector::from_iterator(3, pushed), ..united };
    let solved = under.solve(&own, &DVector::from_column_slice(u));
    assert!(apart(&motion.qdd, solved.qdd.as_slice()) < 1e-24, "{motion:?} {solved:?}");
    assert!(apart(&drives.xd, solved.xd.as_slice()) < 1e-24, "{drives:?} {solved:?}");
    assert!(apart(&drives.tau, solved.tau.as_slice()) < 1e-24, "{drives:?} {solved:?}");
    assert!(motion.sdd.iter().all(|s| s.to_f64().abs() < 1e-24), "{motion:?}");
    // a blow: what is held does not jump, its state takes the impulse that holds it
    let factor = straightline_core::algorithms::driven_factor(model, q, &h);
    let struck = [Struck::Rigid, Struck::Rigid];
    let blow = impact(&factor, qd, &rows(model), None, &struck, Dd::ZERO, Dd::from(1e-30));
    assert_eq!(blow.dqd[1].to_f64(), 0.0);
    assert!(blow.dqd[0].to_f64().abs() > 1e-3);
    let impulses: Vec<Dd> = (0..3)
        .map(|i| {
            let inertial = (0..3).fold(Dd::ZERO, |sum, j| sum + h[3 * i + j] * blow.dqd[j]);
            inertial - jacobian[0][i] * blow.impulse[0] - jacobian[1][i] * blow.impulse[1]
        })
        .collect();
    let jump = driven_jump(model, q, &blow.dqd, &impulses);
    // x of the drive of joint two stands behind the three states of the motor
    let [_, of_speed, third] = [jump[3], jump[4], jump[5]];
    assert_eq!(of_speed.to_f64(), 0.0);
    assert!(apart(&[third], &[Dd::from(0.3) * impulses[1]]) < EXACT, "{jump:?} {impulses:?}");
}

/// Kinetic energy of links and rotors, by the generic runtime.
fn kinetic(model: &Model<Dd>, q: &[Dd], qd: &[Dd], x: &[Dd]) -> f64 {
    (kinetic_energy(model, q, qd) + drive_energy(model, (q, qd, x))[0]).to_f64()
}

/// Rotors, gears before and behind springs, a rotor that turns in space, and joints that shafts hold in their motion.
#[test]
fn an_impact_loses_the_kinetic_energy_of_all_that_moves() {
    let motors = "
[[drive]]
joint = \"one\"
motor = { torque_constant = 0.8, resistance = 1.2, rotor_inertia = 1e-4 }
stages = [{ ratio = 20.0, stiffness = 400.0, input_inertia = 1e-5 }, { ratio = 3.0, output_inertia = 2e-3 }]
rotor = { link = \"a\", axis = [0.3, 0.1, 1.0] }
[[drive]]
name = \"both\"
joints = { two = -12.0, three = 5.0 }
motor = { torque_constant = 0.08, resistance = 1.2, rotor_inertia = 4e-4 }
rotor = { link = \"b\", axis = [0.3, 0.7, 1.0] }
[[drive]]
joint = \"three\"
motor = { torque_constant = 0.08, resistance = 1.2, rotor_inertia = 4e-4 }
";
    for (drives, holds) in [(GEARED, true), (motors, false)] {
        let robot = robot(&arm(LAST_LINK, drives));
        let model = &robot.model;
        let State([q, qd, x, _]) = &state(model);
        let h = mass_matrix(model, q);
        let factor = straightline_core::algorithms::driven_factor(model, q, &h);
        let rows = rows(model);
        let rate = rows.jacobian.iter().map(|row| dot(row, qd)).collect();
        let rows = FunctionalCoordinates { rate, ..rows };
        // reactions that act along the rows, or are tilted by friction
        let tilted = [wide(&[0.41, 0.85, -0.33]), wide(&[-0.7, 0.25, 0.48])];
        let masses = [Struck::Mass { mass: Dd::from(0.4), velocity: Dd::from(-0.2) }, Struck::Rigid];
        for (applied, struck) in [(None, [Struck::Rigid; 2]), (Some(&tilted[..]), [Struck::Rigid; 2]), (None, masses)] {
            for restitution in [0.0, 0.3] {
                let blow = impact(&factor, qd, &rows, applied, &struck, Dd::from(restitution), Dd::from(1e-30));
                let directions = applied.unwrap_or(&rows.jacobian);
                let held: Vec<Dd> = (0..3)
                    .map(|i| {
                        let inertial = (0..3).fold(Dd::ZERO, |sum, j| sum + h[3 * i + j] * blow.dqd[j]);
                        inertial - directions[0][i] * blow.impulse[0] - directions[1][i] * blow.impulse[1]
                    })
                    .collect();
                let sum = |a: &[Dd], b: &[Dd]| -> Vec<Dd> { a.iter().zip(b).map(|(a, b)| *a + *b).collect() };
                let jump = driven_jump(model, q, &blow.dqd, &held);
                let mut lost = kinetic(model, q, qd, x) - kinetic(model, q, &sum(qd, &blow.dqd), &sum(x, &jump));
                for (struck, after) in struck.iter().zip(&blow.struck_velocity) {
                    if let Struck::Mass { mass, velocity } = *struck {
                        lost += (Dd::HALF * mass * (velocity * velocity - *after * *after)).to_f64();
                    }
                }
                let said = blow.energy_loss.to_f64();
                let size = kinetic(model, q, qd, x).max(lost.abs());
                assert!((said - lost).abs() < 1e-14 * size, "restitution {restitution}: {said} for {lost} of {size}");
                // the contact's own part is another where a shaft works
                let mean = |row: &[Dd]| dot(row, qd) + Dd::HALF * dot(row, &blow.dqd);
                let contact = directions.iter().zip(&blow.impulse).fold(Dd::ZERO, |sum, (row, i)| sum - *i * mean(row));
                let is_rigid = struck.iter().all(|s| *s == Struck::Rigid);
                assert!(!is_rigid || ((contact.to_f64() - lost).abs() > 1e-3 * size) == holds, "{contact:?} {lost}");
            }
        }
    }
}

fn dot(a: &[Dd], b: &[Dd]) -> Dd {
    a.iter().zip(b).fold(Dd::ZERO, |sum, (a, b)| sum + *a * *b)
}
