//! The reference, the chapter's own formulation, against data with 25 digits, closed forms and the laws of mechanics.

use crate::support::chapter::chapter_robot;
use crate::support::data::{inputs, numbers, reference_file};
use crate::support::robots::{random_position, random_robot, written_robots, Random, RobotKind};
use nalgebra::{DVector, Matrix3, Vector3};
use serde_json::Value;
use std::fs;
use straightline_core::reference::{
    bias_force, centre_of_mass, dalembert_inverse_dynamics, equations_of_motion, extended_joint, forward_dynamics,
    forward_natural_scale, frame_jacobian, frame_jacobian_bias, frame_pose, frame_velocity, geometry, gravity_force,
    inverse_dynamics, joint_loads, joint_wrenches, kinetic_energy, linear_forms, mass_matrix, momentum, motion,
    natural_scale, potential_energy, rodrigues, skew, unit, velocity_force, CentreOfMassFrame, CentreOfMassLink,
    CentreOfMassTree, ExtendedPosition, LinkGeometry, LinkMotion, ReferenceJoint,
};
use straightline_core::Dd;

const CHAPTER_ROBOTS: [&str; 4] = ["chapter_cylindrical", "chapter_stanford", "chapter_6r", "chapter_oblique"];

/// The data have 25 digits: half a unit of the last is at most 5e-25 of the value.
const DIGITS: f64 = 5.0001e-25;
/// What double-double may lose against the sum of the moduli of the terms; its unit is 1.2e-32.
const ROUNDING: f64 = 2e-29;

/// One state of a robot, with the robot as it is in this state (a state may have its own gravity).
struct State {
    id: String,
    tree: CentreOfMassTree<Dd>,
    q: Vec<Dd>,
    qd: Vec<Dd>,
    qdd: Vec<Dd>,
    data: Value,
}

fn read(path: &str) -> String {
    fs::read_to_string(reference_file(path)).expect("a file of the reference data")
}

/// All states of a chapter robot.
fn states(robot: &str) -> Vec<State> {
    let tree = chapter_robot(&read(&format!("robots/{robot}.toml")));
    let file: Value = serde_json::from_str(&read(&format!("states/{robot}.json"))).expect("the states are JSON");
    let state = |data: &Value| {
        let mut tree = tree.clone();
        if let Some(gravity) = data.get("gravity") {
            tree.gravity = Vector3::from_column_slice(&inputs(gravity));
        }
        State {
            id: data["id"].as_str().expect("every state has a name").to_string(),
            tree,
            q: inputs(&data["q"]),
            qd: inputs(&data["qd"]),
            qdd: inputs(&data["qdd"]),
            data: data.clone(),
        }
    };
    file["states"].as_array().expect("a list of states").iter().map(state).collect()
}

fn all_states() -> impl Iterator<Item = State> {
    CHAPTER_ROBOTS.into_iter().flat_map(states)
}

fn largest(values: &[Dd]) -> Dd {
    values.iter().fold(Dd::ZERO, |m, x| if x.abs().hi() > m.hi() { x.abs() } else { m })
}

/// The largest error against the data, as a multiple of what their digits and double-double's rounding allow.
fn excess(computed: &[Dd], expected: &[Dd], scale: &[Dd]) -> f64 {
    assert_eq!(computed.len(), expected.len(), "as many values as in the data");
    let one = |i: usize| {
        let error = (computed[i] - expected[i]).abs().hi();
        let allowed = DIGITS * expected[i].abs().hi() + ROUNDING * scale[i % scale.len()].hi();
        if error == 0.0 {
            0.0
        } else {
            error / allowed
        }
    };
    (0..computed.len()).map(one).fold(0.0, |worst, x| if x <= worst { worst } else { x })
}

impl State {
    /// Compares with a field of the data; `scale`: of every component, or one for all.
    fn check(&self, what: &str, computed: &[Dd], expected: &Value, scale: &[Dd]) {
        let excess = excess(computed, &numbers(expected), scale);
        assert!(excess <= 1.0, "{what} of {}: {excess:.3} times the bound\nq = {:?}", self.id, self.data["q"]);
    }

    /// Compares with a field of the data, the largest value being the scale.
    fn check_group(&self, what: &str, computed: &[Dd], expected: &Value) {
        self.check(what, computed, expected, &[largest(&numbers(expected))]);
    }
}

fn concat<'a>(vectors: impl IntoIterator<Item = &'a Vector3<Dd>>) -> Vec<Dd> {
    vectors.into_iter().flat_map(|v| v.iter().copied()).collect()
}

fn by_rows(matrix: &Matrix3<Dd>) -> Vec<Dd> {
    matrix.transpose().iter().copied().collect()
}

#[test]
fn drives_and_their_parts_are_those_of_the_data() {
    for state in all_states() {
        let State { tree, q, qd, qdd, data, .. } = &state;
        let scale = |what: &str| numbers(&data["scale"][what]);
        let both = [inverse_dynamics(tree, q, qd, qdd), dalembert_inverse_dynamics(tree, q, qd, qdd)];
        for tau in &both {
            state.check("tau", tau.as_slice(), &data["tau"], &scale("tau"));
        }
        state.check("h", bias_force(tree, q, qd).as_slice(), &data["h"], &scale("h"));
        state.check("g", gravity_force(tree, q).as_slice(), &data["g"], &scale("g"));
        state.check("C", velocity_force(tree, q, qd).as_slice(), &data["C"], &scale("C"));
    }
}

#[test]
fn mass_matrix_and_accelerations_are_those_of_the_data() {
    for state in all_states() {
        let State { tree, q, qd, data, .. } = &state;
        if let Some(expected) = data.get("H") {
            state.check_group("H", mass_matrix(tree, q).transpose().as_slice(), expected);
        }
        let qdd = forward_dynamics(tree, q, qd, &inputs(&data["fd_tau"]));
        state.check("fd_qdd", qdd.as_slice(), &data["fd_qdd"], &numbers(&data["scale"]["fd"]));
    }
}

#[test]
fn energies_are_those_of_the_data() {
    for state in all_states() {
        let State { tree, q, qd, data, .. } = &state;
        state.check_group("T", &[kinetic_energy(tree, q, qd)], &data["T"]);
        let potential = potential_energy(tree, q);
        // V sums terms of both signs: its scale is Σ m |g| |r_c|
        let scale = geometry(tree, q).iter().zip(&tree.links).fold(Dd::ZERO, |sum, (here, link)| {
            sum + link.mass * (tree.gravity.dot(&tree.gravity) * here.centre_of_mass.dot(&here.centre_of_mass)).sqrt()
        });
        state.check("V", &[potential], &data["V"], &[scale]);
    }
}

#[test]
fn joint_wrenches_are_those_of_the_data() {
    for state in all_states() {
        let State { tree, q, qd, qdd, data, .. } = &state;
        state.check_group("wrench", &joint_wrenches(tree, q, qd, qdd).concat(), &data["wrench"]);
    }
}

#[test]
fn tip_and_its_jacobian_are_those_of_the_data() {
    for state in all_states() {
        let State { tree, q, qd, data, .. } = &state;
        let Some(expected) = data.get("frames").map(|frames| &frames["tip"]) else { continue };
        let tip = tree.frame("tip").expect("chapter robots have a tip");
        let pose = frame_pose(tree, tip, q);
        state.check_group("p", pose.position.as_slice(), &expected["p"]);
        state.check_group("R", &by_rows(&pose.rotation), &expected["R"]);
        state.check_group("J", frame_jacobian(tree, tip, q).transpose().as_slice(), &expected["J"]);
        state.check_group("Jdqd", frame_jacobian_bias(tree, tip, q, qd).as_slice(), &expected["Jdqd"]);
    }
}

#[test]
fn the_chapters_quantities_are_those_of_the_data() {
    let mut count = 0;
    for state in all_states() {
        let State { tree, q, qd, qdd, data, .. } = &state;
        let Some(expected) = data.get("chapter") else { continue };
        count += 1;
        let position = geometry(tree, q);
        let motion = motion(tree, &position, qd, qdd);
        let loads = joint_loads(tree, q, qd, qdd);
        let rotations: Vec<Dd> = position.iter().flat_map(|link| by_rows(&link.rotation)).collect();
        state.check_group("A", &rotations, &expected["A"]);
        state.check_group("rc", &concat(position.iter().map(|link| &link.centre_of_mass)), &expected["rc"]);
        state.check_group("omega", &concat(motion.iter().map(|link| &link.omega)), &expected["omega"]);
        state.check_group("eps", &concat(motion.iter().map(|link| &link.epsilon)), &expected["eps"]);
        state.check_group("v", &concat(motion.iter().map(|link| &link.v)), &expected["v"]);
        state.check_group("w", &concat(motion.iter().map(|link| &link.w)), &expected["w"]);
        state.check_group("F_S", &concat(loads.iter().map(|load| &load.force)), &expected["F_S"]);
        state.check_group("M_S", &concat(loads.iter().map(|load| &load.moment)), &expected["M_S"]);
        state.check_group("F_R", &concat(loads.iter().map(|load| &load.reaction_force)), &expected["F_R"]);
        state.check_group("M_R", &concat(loads.iter().map(|load| &load.reaction_moment)), &expected["M_R"]);
        let tip = tree.frame("tip").expect("chapter robots have a tip");
        state.check_group("tip", frame_pose(tree, tip, q).position.as_slice(), &expected["tip"]);
    }
    assert!(count > 20, "{count} states have the chapter's quantities");
}

#[test]
fn natural_scale_is_that_of_the_data() {
    for state in all_states() {
        let State { tree, q, qd, qdd, data, .. } = &state;
        let rest = vec![Dd::ZERO; tree.nv()];
        let scale = &data["scale"];
        state.check_group("scale of tau", natural_scale(tree, q, qd, qdd).as_slice(), &scale["tau"]);
        state.check_group("scale of h", natural_scale(tree, q, qd, &rest).as_slice(), &scale["h"]);
        state.check_group("scale of g", natural_scale(tree, q, &rest, &rest).as_slice(), &scale["g"]);
        let forward = forward_natural_scale(tree, q, qd, &inputs(&data["fd_tau"]));
        state.check("scale of fd", forward.as_slice(), &scale["fd"], &numbers(&scale["fd"]));
        let weightless = CentreOfMassTree { gravity: Vector3::zeros(), ..tree.clone() };
        state.check_group("scale of C", natural_scale(&weightless, q, qd, &rest).as_slice(), &scale["C"]);
    }
}

/// A way of computing A⁰ and of rotating it: as corrected, or as printed.
struct Printing {
    extended: fn(&Vector, &Vector, &Vector, &Vector) -> Matrix3<Dd>,
    rotate: fn(&Vector, &Vector, Dd) -> Vector,
}

type Vector = Vector3<Dd>;

/// The robot with its joints frozen into their matrices at `q`, by a way of computing them, and what remains of `q`.
fn frozen(tree: &CentreOfMassTree<Dd>, q: &[Dd], printing: &Printing) -> (CentreOfMassTree<Dd>, Vec<Dd>) {
    let (mut tree, mut q) = (tree.clone(), q.to_vec());
    for link in &mut tree.links {
        let ExtendedPosition::ByVectors { r_star, r_parent_star, alpha } = &link.extended else { continue };
        let r_parent = r_parent_star.unwrap_or(link.r_parent);
        let a0 = (printing.extended)(&link.e_parent, &r_parent, &link.e, &r_star.unwrap_or(link.r));
        let angle = if link.joint == ReferenceJoint::Linear { *alpha } else { std::mem::take(&mut q[link.iq]) };
        let v = |k: usize| (printing.rotate)(&a0.column(k).into_owned(), &link.e_parent, angle);
        link.extended = ExtendedPosition::Matrix(Matrix3::from_columns(&[v(0), v(1), v(2)]));
    }
    (tree, q)
}

/// The largest excess of drives and centres of mass over the bound, over all states of a robot, when the robot and its
/// coordinates are changed.
fn excess_when_changed(
    robot: &str,
    mut change: impl FnMut(&CentreOfMassTree<Dd>, &[Dd]) -> (CentreOfMassTree<Dd>, Vec<Dd>),
) -> Option<f64> {
    let worst = |state: State| {
        let (tree, q) = change(&state.tree, &state.q);
        let tau = inverse_dynamics(&tree, &q, &state.qd, &state.qdd);
        excess(tau.as_slice(), &numbers(&state.data["tau"]), &numbers(&state.data["scale"]["tau"]))
    };
    states(robot).into_iter().map(worst).reduce(|a, b| if b <= a { a } else { b })
}

#[test]
fn printed_misprints_do_not_pass() {
    let printed_20_108 = |v: &Vector3<Dd>, e: &Vector3<Dd>, q: Dd| {
        let (sin, cos) = q.sin_cos();
        v * cos + e.cross(v).cross(e) * (Dd::ONE - cos) + e.cross(v) * sin
    };
    // as transcribed, the first formula mixes the projections of e_j on frames j − 1 and j
    let printed_20_101 = |e_parent: &Vector3<Dd>, r_parent: &Vector3<Dd>, e: &Vector3<Dd>, r: &Vector3<Dd>| {
        let a_parent = unit(&-e_parent.cross(&r_parent.cross(e)));
        let a = unit(&e.cross(&r.cross(e)));
        let parent = Matrix3::from_columns(&[*e_parent, a_parent, e_parent.cross(&a_parent)]);
        parent * Matrix3::from_columns(&[*e, a, e.cross(&a)]).transpose()
    };
    for robot in CHAPTER_ROBOTS {
        let corrected = Printing { extended: extended_joint, rotate: rodrigues };
        let Some(control) = excess_when_changed(robot, |tree, q| frozen(tree, q, &corrected)) else { return };
        assert!(control <= 1.0, "{robot}: the corrected formulas pass, {control}");
        let rodrigues_as_printed = Printing { extended: extended_joint, rotate: printed_20_108 };
        let error = excess_when_changed(robot, |tree, q| frozen(tree, q, &rodrigues_as_printed)).unwrap();
        assert!(error > 1e20, "{robot}: (20.108) as printed is found out, {error}");
    }
    // where the axis has other projections on its two frames
    let extended_as_printed = Printing { extended: printed_20_101, rotate: rodrigues };
    let error = excess_when_changed("chapter_oblique", |tree, q| frozen(tree, q, &extended_as_printed)).unwrap();
    assert!(error > 1e20, "(20.101) as printed is found out, {error}");
}

#[test]
fn wrong_robots_do_not_pass() {
    type Mutation = fn(&mut CentreOfMassTree<Dd>);
    let mutants: [(&str, &str, Mutation); 8] = [
        ("chapter_6r", "a mass in its 20th digit", |t| t.links[5].mass = t.links[5].mass + Dd::from(1e-20)),
        ("chapter_6r", "a length in its 20th digit", |t| t.links[1].r.y = t.links[1].r.y + Dd::from(1e-21)),
        ("chapter_6r", "a product of inertia of the other sign", |t| {
            let tensor = &mut t.links[5].inertia;
            (tensor[(0, 1)], tensor[(1, 0)]) = (-tensor[(0, 1)], -tensor[(1, 0)]);
        }),
        ("chapter_oblique", "no lower specificity", |t| {
            let ExtendedPosition::ByVectors { r_star, .. } = &mut t.links[0].extended else { unreachable!() };
            *r_star = None;
        }),
        ("chapter_oblique", "α of the other sign", |t| {
            let ExtendedPosition::ByVectors { alpha, .. } = &mut t.links[1].extended else { unreachable!() };
            *alpha = -*alpha;
        }),
        ("chapter_stanford", "an axis of the other sign", |t| t.links[3].e = -t.links[3].e),
        ("chapter_stanford", "r* instead of r in (20.25)", |t| t.links[2].r = Vector3::y()),
        ("chapter_cylindrical", "r_{j,j+1} of the other direction", |t| {
            t.links[2].r_parent = -t.links[2].r_parent;
        }),
    ];
    for (robot, what, mutate) in mutants {
        let changed = excess_when_changed(robot, |tree, q| {
            let mut tree = tree.clone();
            mutate(&mut tree);
            (tree, q.to_vec())
        });
        let Some(error) = changed else { return };
        assert!(error.is_nan() || error > 100.0, "{robot} with {what} is found out: {error}");
    }
}

// Laws of mechanics and closed forms: need no data.

/// Ten random robots of every kind and one of every style of numbers as people write them, with a random state.
fn random_states() -> impl Iterator<Item = (CentreOfMassTree<Dd>, [Vec<Dd>; 3])> {
    let kinds = [(false, false), (false, true), (true, false), (true, true)];
    let oblique = (0..40).map(move |seed| {
        let (branched, floating) = kinds[seed % 4];
        let mut random = Random(seed as u64);
        let kind = RobotKind { links: 2 + random.below(7), branched, floating, balls: seed % 4 == 3 };
        let mut tree = random_robot(&mut random, kind);
        tree.name = format!("{kind:?}, seed {seed}");
        let q = random_position(&mut random, &tree);
        let (qd, qdd) = (random.list(tree.nv(), 2.0), random.list(tree.nv(), 2.0));
        (tree, [q, qd, qdd])
    });
    let written = written_robots(1).enumerate().map(|(k, (_, tree))| {
        let mut random = Random(400 + k as u64);
        let q = random_position(&mut random, &tree);
        let (qd, qdd) = (random.list(tree.nv(), 2.0), random.list(tree.nv(), 2.0));
        (tree, [q, qd, qdd])
    });
    oblique.chain(written)
}

fn assert_close(what: &str, tree: &CentreOfMassTree<Dd>, a: &[Dd], b: &[Dd], tolerance: f64) {
    assert_eq!(a.len(), b.len(), "{what}");
    let scale = largest(a).hi().max(largest(b).hi()).max(1.0);
    let error = a.iter().zip(b).map(|(a, b)| (*a - *b).abs().hi() / scale);
    let worst = error.fold(0.0, |worst, x| if x <= worst { worst } else { x });
    assert!(worst <= tolerance, "{what}: {worst:e} of the scale, {}", tree.name);
}

/// q after a short time at constant q̇ (first order, exact for joints of one coordinate).
fn advanced(tree: &CentreOfMassTree<Dd>, q: &[Dd], qd: &[Dd], time: Dd) -> Vec<Dd> {
    let mut q = q.to_vec();
    for link in &tree.links {
        if link.joint == ReferenceJoint::Free {
            // ṗ = R v, and the quaternion's derivative is half its product with (ω, 0)
            let rotation = geometry(tree, &q)[0].rotation;
            let v = rotation * Vector3::new(qd[link.iv], qd[link.iv + 1], qd[link.iv + 2]);
            let omega = Vector3::new(qd[link.iv + 3], qd[link.iv + 4], qd[link.iv + 5]);
            let i = link.iq;
            let (u, w) = (Vector3::new(q[i + 3], q[i + 4], q[i + 5]), q[i + 6]);
            let ud = (omega * w + u.cross(&omega)) * Dd::HALF;
            let wd = -u.dot(&omega) * Dd::HALF;
            for k in 0..3 {
                q[i + k] = q[i + k] + v[k] * time;
                q[i + 3 + k] = q[i + 3 + k] + ud[k] * time;
            }
            q[i + 6] = w + wd * time;
        } else if link.joint == ReferenceJoint::Ball {
            let omega = Vector3::new(qd[link.iv], qd[link.iv + 1], qd[link.iv + 2]);
            let i = link.iq;
            let (u, w) = (Vector3::new(q[i], q[i + 1], q[i + 2]), q[i + 3]);
            let ud = (omega * w + u.cross(&omega)) * Dd::HALF;
            (0..3).for_each(|k| q[i + k] = q[i + k] + ud[k] * time);
            q[i + 3] = w - u.dot(&omega) * Dd::HALF * time;
        } else {
            q[link.iq] = q[link.iq] + qd[link.iv] * time;
        }
    }
    q
}

#[test]
fn the_linear_forms_give_the_recursive_motion() {
    for (tree, [q, qd, qdd]) in random_states() {
        let position = geometry(&tree, &q);
        let motion = motion(&tree, &position, &qd, &qdd);
        let (qd_matrix, qdd_matrix) = (DVector::from_column_slice(&qd), DVector::from_column_slice(&qdd));
        for (motion, forms) in motion.iter().zip(linear_forms(&tree, &position, &qd)) {
            let LinkMotion { omega, epsilon, v, w } = motion;
            let close = |what: &str, a: &Vector3<Dd>, b: Vector3<Dd>| {
                assert_close(what, &tree, a.as_slice(), b.as_slice(), 1e-29);
            };
            close("ω = Λ q̇ (20.32)", omega, &forms.lambda * &qd_matrix);
            close("v = Ξ q̇ (20.33)", v, &forms.xi * &qd_matrix);
            close("ε = Λ q̈ + Γ (20.34)", epsilon, &forms.lambda * &qdd_matrix + forms.gamma);
            close("w = Ξ q̈ + Δ (20.35)", w, &forms.xi * &qdd_matrix + forms.delta);
        }
    }
}

#[test]
fn both_ways_to_the_drives_agree_and_forward_dynamics_goes_back() {
    for (tree, [q, qd, qdd]) in random_states() {
        let tau = inverse_dynamics(&tree, &q, &qd, &qdd);
        let direct = dalembert_inverse_dynamics(&tree, &q, &qd, &qdd);
        assert_close("τ", &tree, tau.as_slice(), direct.as_slice(), 1e-29);
        let back = forward_dynamics(&tree, &q, &qd, tau.as_slice());
        assert_close("q̈", &tree, back.as_slice(), &qdd, 1e-24); // times the condition number, up to about 1e6
        let equations = equations_of_motion(&tree, &q, &qd);
        let transposed = equations.mass_matrix.transpose();
        assert_close("H = Hᵀ", &tree, equations.mass_matrix.as_slice(), transposed.as_slice(), 1e-29);
        let rest = vec![Dd::ZERO; tree.nv()];
        let parts = velocity_force(&tree, &q, &qd) + gravity_force(&tree, &q);
        assert_close("h = C + g", &tree, equations.bias_force.as_slice(), parts.as_slice(), 1e-29);
        let h = inverse_dynamics(&tree, &q, &qd, &rest);
        assert_close("h", &tree, h.as_slice(), equations.bias_force.as_slice(), 1e-29);
        let scale = natural_scale(&tree, &q, &qd, &qdd);
        assert!(tau.iter().zip(&scale).all(|(tau, scale)| tau.abs().hi() <= scale.hi() * 1.000_001), "{}", tree.name);
    }
}

#[test]
fn every_link_is_in_equilibrium() {
    for (tree, [q, qd, qdd]) in random_states() {
        let position = geometry(&tree, &q);
        let motion = motion(&tree, &position, &qd, &qdd);
        let loads = joint_loads(&tree, &q, &qd, &qdd);
        for (j, link) in tree.links.iter().enumerate() {
            let LinkGeometry { rotation, r_dash, .. } = &position[j];
            let above: Vec<usize> = (0..tree.links.len()).filter(|&k| tree.links[k].parent == Some(j)).collect();
            // m_j w_j = m_j g + F_{Sj} − F_{Sj+1}                                                              (20.13)
            let mut force = tree.gravity * link.mass + loads[j].force;
            // J̃_j ε̃_j + ω̃_j × (J̃_j ω̃_j) = M̃_{Sj} − M_{Sj+1} − r̃'_{j,j} × F̃_{Sj} + r̃_{j,j+1} × F_{Sj+1}           (20.14)
            let mut moment = loads[j].moment - r_dash.cross(&loads[j].force);
            for &k in &above {
                force -= loads[k].force;
                moment += -loads[k].moment + position[k].r_parent.cross(&loads[k].force);
            }
            // against the sum of the terms, as far as they are more than one
            let norm = |v: &Vector3<Dd>| v.dot(v).sqrt().hi();
            let turned = |r: &Vector3<Dd>, k: usize| norm(&loads[k].moment) + norm(r) * norm(&loads[k].force);
            let carried = |f: &dyn Fn(usize) -> f64| above.iter().map(|k| f(*k)).sum::<f64>();
            let forces = 1.0 + norm(&loads[j].force) + carried(&|k| norm(&loads[k].force));
            let moments = 1.0 + turned(r_dash, j) + carried(&|k| turned(&position[k].r_parent, k));
            let close = |what: &str, a: Vector3<Dd>, b: Vector3<Dd>, scale: f64| {
                let error = norm(&(a - b)) / scale;
                assert!(error <= 1e-28, "{what}: {error:e} of the scale, {}", tree.name);
            };
            close("Newton's law", motion[j].w * link.mass, force, forces);
            let omega = rotation.transpose() * motion[j].omega;
            let epsilon = rotation.transpose() * motion[j].epsilon;
            let inertial = link.inertia * epsilon + omega.cross(&(link.inertia * omega));
            close("Euler's equations", inertial, rotation.transpose() * moment, moments);
            // reactions do no work: F_R ⟂ e (linear), M_R ⟂ e (revolute), with (20.19)
            let e = &position[j].e;
            match link.joint.shares::<Dd>() {
                Some([turns, slides]) => {
                    let work = slides * loads[j].reaction_force.dot(e) + turns * loads[j].reaction_moment.dot(e);
                    assert!(work.abs().hi() < 1e-28 * (slides.abs().hi() * forces + turns.abs().hi() * moments));
                }
                None if link.joint == ReferenceJoint::Ball => assert_eq!(loads[j].reaction_moment, Vector3::zeros()),
                None => assert_eq!(loads[j].reaction_force, Vector3::zeros()),
            }
        }
    }
}

#[test]
fn energy_grows_by_the_power_of_the_drives() {
    let step = Dd::from(1e-9);
    for (tree, [q, qd, qdd]) in random_states() {
        let energy = |time: Dd| {
            let q = advanced(&tree, &q, &qd, time);
            let qd: Vec<Dd> = qd.iter().zip(&qdd).map(|(&v, &a)| v + a * time).collect();
            kinetic_energy(&tree, &q, &qd) + potential_energy(&tree, &q)
        };
        // along this line the motion departs from the true one by O(t²), which the central difference cancels
        let rate = (energy(step) - energy(-step)) / (step + step);
        let tau = inverse_dynamics(&tree, &q, &qd, &qdd);
        let power = tau.iter().zip(&qd).fold(Dd::ZERO, |sum, (&f, &v)| sum + f * v);
        assert_close("power", &tree, &[rate], &[power], 1e-15);
    }
}

#[test]
fn momentum_changes_by_gravity_and_the_root_force() {
    let step = Dd::from(1e-9);
    for (tree, [q, qd, qdd]) in random_states() {
        let at = |time: Dd| {
            let qd: Vec<Dd> = qd.iter().zip(&qdd).map(|(&v, &a)| v + a * time).collect();
            momentum(&tree, &advanced(&tree, &q, &qd, time), &qd)
        };
        let (after, before) = (at(step), at(-step));
        let rate = |a: Vector3<Dd>, b: Vector3<Dd>| (a - b).map(|x| x / (step + step));
        let loads = joint_loads(&tree, &q, &qd, &qdd);
        let position = geometry(&tree, &q);
        let mass = tree.links.iter().fold(Dd::ZERO, |sum, link| sum + link.mass);
        let weight = tree.gravity * mass;
        let (mut force, mut moment) = (weight, centre_of_mass(&tree, &q).cross(&weight));
        for (j, load) in loads.iter().enumerate().filter(|&(j, _)| tree.links[j].parent.is_none()) {
            let joint = position[j].centre_of_mass - position[j].r_dash;
            force += load.force;
            moment += load.moment + joint.cross(&load.force);
        }
        let linear = rate(after.linear, before.linear);
        assert_close("linear momentum", &tree, linear.as_slice(), force.as_slice(), 1e-15);
        let angular = rate(after.angular_about_origin, before.angular_about_origin);
        assert_close("angular momentum", &tree, angular.as_slice(), moment.as_slice(), 1e-15);
        let now = at(Dd::ZERO);
        let moved = now.angular_about_centre_of_mass + centre_of_mass(&tree, &q).cross(&now.linear);
        assert_close("two points", &tree, moved.as_slice(), now.angular_about_origin.as_slice(), 1e-29);
    }
}

#[test]
fn jacobians_are_derivatives_of_poses() {
    let step = Dd::from(1e-10);
    for (tree, [q, qd, _]) in random_states() {
        for frame in &tree.frames {
            let at = |time: Dd| advanced(&tree, &q, &qd, time);
            let (after, before) = (frame_pose(&tree, frame, &at(step)), frame_pose(&tree, frame, &at(-step)));
            let velocity = frame_velocity(&tree, frame, &q, &qd);
            let linear = (after.position - before.position).map(|x| x / (step + step));
            assert_close("velocity", &tree, linear.as_slice(), &velocity.as_slice()[..3], 1e-16);
            // Ṙ = ω̲ R
            let rate = (after.rotation - before.rotation).map(|x| x / (step + step));
            let expected = skew(&velocity.fixed_rows::<3>(3).into_owned()) * frame_pose(&tree, frame, &q).rotation;
            assert_close("angular velocity", &tree, rate.as_slice(), expected.as_slice(), 1e-16);
            let velocity_at = |time: Dd| frame_velocity(&tree, frame, &at(time), &qd);
            let bias = (velocity_at(step) - velocity_at(-step)).map(|x| x / (step + step));
            let expected = frame_jacobian_bias(&tree, frame, &q, &qd);
            assert_close("J̇ q̇", &tree, bias.as_slice(), expected.as_slice(), 1e-16);
        }
    }
}

/// A link that turns about z of the world or of its parent, with centre of mass and next joint on its x axis.
fn planar_link(
    parent: Option<usize>,
    mass: f64,
    moment: f64,
    to_centre: f64,
    parent_rest: f64,
) -> CentreOfMassLink<Dd> {
    CentreOfMassLink {
        name: String::new(),
        parent,
        joint: ReferenceJoint::Revolute,
        iq: 0,
        iv: 0,
        shared: None,
        mass: Dd::from(mass),
        inertia: Matrix3::from_diagonal(&Vector3::new(0.1, 0.2, moment)).map(Dd::from),
        e: Vector3::z(),
        e_parent: Vector3::z(),
        r: Vector3::new(to_centre, 0.0, 0.0).map(Dd::from),
        r_parent: Vector3::new(-parent_rest, 0.0, 0.0).map(Dd::from),
        extended: ExtendedPosition::Matrix(Matrix3::identity()),
    }
}

#[test]
fn pendulum_has_its_closed_form() {
    let (mass, moment, length) = (2.0, 0.3, 0.7);
    let tree = CentreOfMassTree {
        name: "pendulum".to_string(),
        gravity: Vector3::new(0.0, -9.75, 0.0).map(Dd::from),
        links: vec![planar_link(None, mass, moment, length, 0.0)],
        frames: vec![],
    };
    let (q, qd, qdd) = (Dd::from(0.6), Dd::from(-1.25), Dd::from(3.5));
    let d = Dd::from;
    let (_, cos) = q.sin_cos();
    // τ = (I + m l²) q̈ + m g l cos q
    let tau = (d(moment) + d(mass) * d(length) * d(length)) * qdd + d(mass) * d(9.75) * d(length) * cos;
    let computed = inverse_dynamics(&tree, &[q], &[qd], &[qdd]);
    assert_close("τ", &tree, computed.as_slice(), &[tau], 1e-30);
    // along the rod, the joint holds the weight's part and the centripetal force: F_x = m g sin q − m l q̇²
    let wrench = joint_wrenches(&tree, &[q], &[qd], &[qdd])[0];
    let (sin, _) = q.sin_cos();
    let pull = d(mass) * (d(9.75) * sin - d(length) * qd * qd);
    assert_close("pull", &tree, &wrench[..1], &[pull], 1e-30);
}

#[test]
fn planar_arm_has_its_closed_form() {
    let d = Dd::from;
    let (m1, i1, l1, c1) = (3.0, 0.11, 0.8, 0.3);
    let (m2, i2, c2) = (1.5, 0.07, 0.45);
    let tree = CentreOfMassTree {
        name: "planar 2R".to_string(),
        gravity: Vector3::new(0.0, -9.75, 0.0).map(d),
        links: vec![planar_link(None, m1, i1, c1, 0.0), planar_link(Some(0), m2, i2, c2, l1 - c1)],
        frames: vec![],
    };
    let mut tree = tree;
    tree.number_coordinates();
    let (q1, q2) = (d(0.4), d(-1.1));
    let (v1, v2) = (d(1.3), d(-0.6));
    let (a1, a2) = (d(-2.1), d(0.9));
    let (m1, i1, l1, c1) = (d(m1), d(i1), d(l1 - c1) + d(c1), d(c1));
    let (m2, i2, c2, g) = (d(m2), d(i2), d(c2), d(9.75));
    let (sin2, cos2) = q2.sin_cos();
    let (cos1, cos12) = (q1.sin_cos().1, (q1 + q2).sin_cos().1);
    let two = d(2.0);
    let h11 = i1 + i2 + m1 * c1 * c1 + m2 * (l1 * l1 + c2 * c2 + two * l1 * c2 * cos2);
    let h12 = i2 + m2 * (c2 * c2 + l1 * c2 * cos2);
    let h22 = i2 + m2 * c2 * c2;
    let b = m2 * l1 * c2 * sin2;
    let g2 = m2 * g * c2 * cos12;
    let g1 = (m1 * c1 + m2 * l1) * g * cos1 + g2;
    let tau1 = h11 * a1 + h12 * a2 - b * (two * v1 * v2 + v2 * v2) + g1;
    let tau2 = h12 * a1 + h22 * a2 + b * v1 * v1 + g2;
    let computed = inverse_dynamics(&tree, &[q1, q2], &[v1, v2], &[a1, a2]);
    assert_close("τ", &tree, computed.as_slice(), &[tau1, tau2], 1e-30);
    assert_close("H", &tree, mass_matrix(&tree, &[q1, q2]).as_slice(), &[h11, h12, h12, h22], 1e-30);
}

#[test]
fn free_body_obeys_newton_and_euler_in_its_own_axes() {
    let mut random = Random(7);
    let mut tree = random_robot(&mut random, RobotKind { links: 1, branched: false, floating: true, balls: false });
    tree.links[0].r = Vector3::zeros();
    let (mass, inertia) = (tree.links[0].mass, tree.links[0].inertia);
    let q = random_position(&mut random, &tree);
    let (qd, qdd) = (random.list(6, 2.0), random.list(6, 2.0));
    let (v, omega) = (Vector3::new(qd[0], qd[1], qd[2]), Vector3::new(qd[3], qd[4], qd[5]));
    let (a, epsilon) = (Vector3::new(qdd[0], qdd[1], qdd[2]), Vector3::new(qdd[3], qdd[4], qdd[5]));
    let gravity = geometry(&tree, &q)[0].rotation.transpose() * tree.gravity;
    let force = (a + omega.cross(&v) - gravity) * mass;
    let moment = inertia * epsilon + omega.cross(&(inertia * omega));
    let tau = inverse_dynamics(&tree, &q, &qd, &qdd);
    assert_close("τ", &tree, tau.as_slice(), &concat([&force, &moment]), 1e-30);
    // without force its centre of mass falls
    let rest = vec![Dd::ZERO; 6];
    let fall = forward_dynamics(&tree, &q, &rest, &rest);
    assert_close("fall", &tree, &fall.as_slice()[..3], gravity.as_slice(), 1e-30);
}

#[test]
fn the_point_where_a_free_body_is_taken_hold_of_does_not_matter() {
    let mut random = Random(8);
    let tree = random_robot(&mut random, RobotKind { links: 5, branched: true, floating: true, balls: true });
    let q = random_position(&mut random, &tree);
    let (qd, qdd) = (random.list(tree.nv(), 2.0), random.list(tree.nv(), 2.0));
    // the same robot with its root point in another place p of the root link
    let p = random.vector();
    let mut other = tree.clone();
    other.links[0].r -= p;
    let rotation = geometry(&tree, &q)[0].rotation;
    let mut q2 = q.clone();
    let (v, omega) = (Vector3::new(qd[0], qd[1], qd[2]), Vector3::new(qd[3], qd[4], qd[5]));
    let epsilon = Vector3::new(qdd[3], qdd[4], qdd[5]);
    let (mut qd2, mut qdd2) = (qd.clone(), qdd.clone());
    for k in 0..3 {
        q2[k] = q[k] + (rotation * p)[k];
        qd2[k] = (v + omega.cross(&p))[k];
        qdd2[k] = qdd[k] + epsilon.cross(&p)[k];
    }
    let (tau, tau2) = (inverse_dynamics(&tree, &q, &qd, &qdd), inverse_dynamics(&other, &q2, &qd2, &qdd2));
    let force = Vector3::new(tau[0], tau[1], tau[2]);
    let mut expected = tau.clone();
    let moment = Vector3::new(tau[3], tau[4], tau[5]) - p.cross(&force);
    expected.fixed_rows_mut::<3>(3).copy_from(&moment);
    assert_close("τ", &tree, tau2.as_slice(), expected.as_slice(), 1e-29);
    let energies = [kinetic_energy(&tree, &q, &qd), potential_energy(&tree, &q)];
    let energies2 = [kinetic_energy(&other, &q2, &qd2), potential_energy(&other, &q2)];
    assert_close("energies", &tree, &energies, &energies2, 1e-29);
}

#[test]
fn f64_agrees_with_double_double() {
    for (tree, [q, qd, qdd]) in random_states() {
        let coarse = |x: &[Dd]| x.iter().map(|x| x.to_f64()).collect::<Vec<f64>>();
        let tree64 = rounded(&tree);
        let tau = dalembert_inverse_dynamics(&tree64, &coarse(&q), &coarse(&qd), &coarse(&qdd));
        let exact = inverse_dynamics(&tree, &q, &qd, &qdd);
        let scale = natural_scale(&tree, &q, &qd, &qdd);
        for i in 0..tau.len() {
            let error = (tau[i] - exact[i].to_f64()).abs() / scale[i].to_f64();
            assert!(error < 1e-13, "{error:e} of the scale, {}", tree.name); // inputs rounded to f64, condition of the pose
        }
    }
}

/// The robot in f64.
fn rounded(tree: &CentreOfMassTree<Dd>) -> CentreOfMassTree<f64> {
    let v = |v: &Vector3<Dd>| v.map(Dd::to_f64);
    let m = |m: &Matrix3<Dd>| m.map(Dd::to_f64);
    let link = |link: &CentreOfMassLink<Dd>| CentreOfMassLink {
        name: link.name.clone(),
        parent: link.parent,
        joint: link.joint,
        iq: link.iq,
        iv: link.iv,
        shared: None,
        mass: link.mass.to_f64(),
        inertia: m(&link.inertia),
        e: v(&link.e),
        e_parent: v(&link.e_parent),
        r: v(&link.r),
        r_parent: v(&link.r_parent),
        extended: match &link.extended {
            ExtendedPosition::Matrix(extended) => ExtendedPosition::Matrix(m(extended)),
            ExtendedPosition::ByVectors { r_star, r_parent_star, alpha } => ExtendedPosition::ByVectors {
                r_star: r_star.as_ref().map(v),
                r_parent_star: r_parent_star.as_ref().map(v),
                alpha: alpha.to_f64(),
            },
        },
    };
    let frame = |frame: &CentreOfMassFrame<Dd>| CentreOfMassFrame {
        name: frame.name.clone(),
        link: frame.link,
        position: v(&frame.position),
        rotation: m(&frame.rotation),
    };
    CentreOfMassTree {
        name: tree.name.clone(),
        gravity: v(&tree.gravity),
        links: tree.links.iter().map(link).collect(),
        frames: tree.frames.iter().map(frame).collect(),
    }
}
