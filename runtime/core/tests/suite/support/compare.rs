//! Compares everything that both authors compute of one robot.
#![allow(dead_code)] // every test file uses a part of it

use super::robots::{random_position, Random};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use straightline_core::algorithms;
use straightline_core::model::Model;
use straightline_core::reference::{self, CentreOfMassTree};
use straightline_core::spatial::{Mat3, Vec3};
use straightline_core::Dd;

/// Against the scale of each quantity. Double-double has 1.2e-32, the worst seen is 3e-30 (`--nocapture` prints it).
pub const TOLERANCE: f64 = 2e-29;
/// The same of what is solved for: of micrograms beside kilograms, eliminations leave up to 2e-28 of a torque.
const SOLVED: f64 = 5e-28;

/// Worst disagreement of every quantity, and where.
#[derive(Default)]
pub struct Disagreement {
    pub worst: BTreeMap<&'static str, (f64, String)>,
    /// Accelerations may also be judged by what they leave of the second author's equations, as ratios of masses leave no digits to them.
    pub by_what_is_left: bool,
}

impl Disagreement {
    /// `scale`: of every component, or one for all. A scale can itself be rounding noise, as where a linear joint on the
    /// base moves uniformly and nothing else: it counts as a thousandth of the largest at least.
    fn compare(&mut self, what: &'static str, robot: &str, a: &[Dd], b: &[Dd], scale: &[Dd]) {
        assert_eq!(a.len(), b.len(), "{what} of {robot}");
        let least = 1e-3 * scale.iter().fold(0.0, |m: f64, x| m.max(x.abs().hi()));
        for i in 0..a.len() {
            let scale = scale[i % scale.len()].abs().hi().max(least);
            let error = (a[i] - b[i]).abs().hi();
            let relative = if error == 0.0 { 0.0 } else { error / scale };
            let worst = self.worst.entry(what).or_insert((0.0, String::new()));
            if relative > worst.0 || relative.is_nan() {
                *worst = (relative, robot.to_string());
            }
        }
    }

    /// The scale is the largest value, at least 1.
    fn compare_group(&mut self, what: &'static str, robot: &str, a: &[Dd], b: &[Dd]) {
        let largest = b.iter().fold(Dd::ONE, |m, x| if x.abs().hi() > m.hi() { x.abs() } else { m });
        self.compare(what, robot, a, b, &[largest]);
    }
}

impl Disagreement {
    /// Prints all quantities.
    ///
    /// # Panics
    /// If one disagrees beyond the tolerance.
    pub fn judge(&self) {
        for (what, (error, _)) in &self.worst {
            println!("{what:20} {error:.1e}");
        }
        for (what, (error, robot)) in &self.worst {
            let most = if self.by_what_is_left && what.starts_with("qdd") { SOLVED } else { TOLERANCE };
            assert!(*error <= most, "{what}: {error:e} of the scale, {robot}");
        }
    }
}

fn array(v: &Vec3<Dd>) -> [Dd; 3] {
    [v.x, v.y, v.z]
}

fn columns(m: &Mat3<Dd>) -> Vec<Dd> {
    (0..3).flat_map(|k| array(&m.column(k))).collect()
}

/// Compares both authors' results at a random state of a robot; `robot` says which it is.
pub fn compare_authors(
    disagreement: &mut Disagreement,
    robot: &str,
    tree: &CentreOfMassTree<Dd>,
    model: &Model<Dd>,
    random: &mut Random,
) {
    let n = tree.nv();
    let q = random_position(random, tree);
    let (qd, qdd, tau) = (random.list(n, 2.0), random.list(n, 3.0), random.list(n, 10.0));
    let rest = vec![Dd::ZERO; n];
    let weightless = CentreOfMassTree { gravity: Vector3::zeros(), ..tree.clone() };
    let d = disagreement;

    let scale = reference::natural_scale(tree, &q, &qd, &qdd);
    let expected = reference::inverse_dynamics(tree, &q, &qd, &qdd);
    let computed = algorithms::inverse_dynamics(model, &q, &qd, &qdd);
    d.compare("tau", robot, &computed, expected.as_slice(), scale.as_slice());
    let expected = reference::dalembert_inverse_dynamics(tree, &q, &qd, &qdd);
    d.compare("tau by D'Alembert", robot, &computed, expected.as_slice(), scale.as_slice());
    // what lies on its axis needs no force, and its scale may be rounding noise: as centripetal terms below
    let energy = reference::kinetic_energy(tree, &q, &qd);
    let scale = reference::natural_scale(tree, &q, &qd, &rest).add_scalar(energy * Dd::from(1e-3));
    let expected = reference::bias_force(tree, &q, &qd);
    d.compare("h", robot, &algorithms::bias_force(model, &q, &qd), expected.as_slice(), scale.as_slice());
    let scale = reference::natural_scale(tree, &q, &rest, &rest);
    let expected = reference::gravity_force(tree, &q);
    d.compare("g", robot, &algorithms::gravity_force(model, &q), expected.as_slice(), scale.as_slice());
    // centripetal terms may cancel before they reach the scale: they are of the order of the kinetic energy, per metre
    let scale = reference::natural_scale(&weightless, &q, &qd, &rest).add_scalar(energy);
    let expected = reference::velocity_force(tree, &q, &qd);
    d.compare("C", robot, &algorithms::velocity_force(model, &q, &qd), expected.as_slice(), scale.as_slice());

    let expected = reference::mass_matrix(tree, &q);
    let computed = algorithms::mass_matrix(model, &q);
    d.compare_group("H", robot, &computed, expected.as_slice());
    let found = [
        ("qdd (ABA)", algorithms::forward_dynamics_aba(model, &q, &qd, &tau)),
        ("qdd (LTDL)", algorithms::forward_dynamics_ltdl(model, &q, &qd, &tau)),
    ];
    let scale = reference::forward_natural_scale(tree, &q, &qd, &tau);
    let expected = reference::forward_dynamics(tree, &q, &qd, &tau);
    for (what, computed) in found {
        let mut own = Disagreement::default();
        own.compare(what, robot, &computed, expected.as_slice(), scale.as_slice());
        if d.by_what_is_left {
            let needed = reference::inverse_dynamics(tree, &q, &qd, &computed);
            let terms = reference::natural_scale(tree, &q, &qd, &computed);
            let mut left = Disagreement::default();
            left.compare(what, robot, needed.as_slice(), &tau, terms.as_slice());
            if left.worst[what].0 < own.worst[what].0 {
                own = left;
            }
        }
        let (found, at) = own.worst[what].clone();
        let worst = d.worst.entry(what).or_insert((0.0, String::new()));
        if found > worst.0 || found.is_nan() {
            *worst = (found, at);
        }
    }

    // one wrench per joint, in the order of the velocity coordinates
    let order = tree.by_coordinates();
    let wrenches = reference::joint_wrenches(tree, &q, &qd, &qdd);
    let expected: Vec<Dd> = order.iter().flat_map(|&j| wrenches[j]).collect();
    let computed: Vec<Dd> = algorithms::joint_wrenches(model, &q, &qd, &qdd)
        .iter()
        .flat_map(|wrench| [array(&wrench.force), array(&wrench.moment)].concat())
        .collect();
    d.compare_group("wrench", robot, &computed, &expected);

    let expected = [reference::kinetic_energy(tree, &q, &qd), reference::potential_energy(tree, &q)];
    let computed = [algorithms::kinetic_energy(model, &q, &qd), algorithms::potential_energy(model, &q)];
    d.compare_group("energy", robot, &computed, &expected);

    let expected = reference::momentum(tree, &q, &qd);
    let computed = algorithms::momentum(model, &q, &qd);
    let com = reference::centre_of_mass(tree, &q);
    d.compare_group("centre of mass", robot, &array(&computed.com), com.as_slice());
    d.compare_group("linear momentum", robot, &array(&computed.linear), expected.linear.as_slice());
    let angular = expected.angular_about_centre_of_mass;
    // a difference: of that about the origin and of the mass in its centre
    let least = (com.dot(&com) * expected.linear.dot(&expected.linear)).sqrt();
    let scale = angular.iter().fold(least + Dd::ONE, |sum, x| sum + x.abs());
    d.compare("angular momentum", robot, &array(&computed.angular), angular.as_slice(), &[scale]);

    for same in &model.frames {
        let frame = tree.frame(&same.name).expect("both authors know the same frames");
        let expected = reference::frame_pose(tree, frame, &q);
        let computed = &algorithms::forward_kinematics(model, &q, &[same])[0];
        d.compare_group("p", robot, &array(&computed.translation), expected.position.as_slice());
        d.compare_group("R", robot, &columns(&computed.rotation), expected.rotation.as_slice());
        let expected = reference::frame_jacobian(tree, frame, &q).transpose();
        d.compare_group("J", robot, &algorithms::jacobian(model, &q, same), expected.as_slice());
        let expected = reference::frame_jacobian_bias(tree, frame, &q, &qd);
        let computed = algorithms::jacobian_bias(model, &q, &qd, same);
        let computed = [array(&computed.linear), array(&computed.angular)].concat();
        d.compare_group("Jdqd", robot, &computed, expected.as_slice());
        let expected = reference::frame_velocity(tree, frame, &q, &qd);
        let computed = algorithms::frame_velocity(model, &q, &qd, same);
        let computed = [array(&computed.linear), array(&computed.angular)].concat();
        d.compare_group("frame velocity", robot, &computed, expected.as_slice());
        let expected = reference::frame_acceleration(tree, frame, &q, &qd, &qdd);
        let computed = algorithms::frame_acceleration(model, &q, &qd, &qdd, same);
        let computed = [array(&computed.linear), array(&computed.angular)].concat();
        d.compare_group("frame acceleration", robot, &computed, expected.as_slice());
    }
}
