//! Names of base parameters, as sums of the numbers of a robot file: they are their values, and what they do not name changes nothing.
//!
//! Robots are written as files whose links have their ten parameters about their own origins, so that a number of a name is one that can be changed.

use std::collections::BTreeMap;
use std::fmt::Write;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::equations::Robot;
use straightline_codegen::function::{base_parameter_lists, BaseParameterList};
use straightline_codegen::model::{self, ModelOptions};
use straightline_codegen::options::{scene_file, Options};
use straightline_codegen::Function;
use straightline_core::random::Random;

/// A joint with the link that it carries, which is counted from 1.
struct Hung {
    /// The parent's number; 0: what stands.
    parent: usize,
    kind: &'static str,
    axis: [f64; 3],
    xyz: [f64; 3],
    rpy_deg: [f64; 3],
}

const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];

const fn turn(parent: usize, axis: [f64; 3], xyz: [f64; 3]) -> Hung {
    Hung { parent, kind: "continuous", axis, xyz, rpy_deg: [0.0; 3] }
}

/// Two turns about axes that are parallel, behind one about the vertical.
const PARALLEL: &[Hung] = &[turn(0, Z, [0.0, 0.0, 0.3]), turn(1, Y, [0.05, 0.0, 0.1]), turn(2, Y, [0.31, 0.02, 0.0])];
/// Axes that are parallel to nothing, and one along which the tip slides.
const OBLIQUE: &[Hung] = &[
    Hung { rpy_deg: [10.0, -15.0, 25.0], ..turn(0, [0.2, 0.3, 1.0], [0.05, -0.1, 0.3]) },
    turn(1, [0.1, 1.0, -0.3], [0.05, 0.02, 0.4]),
    Hung { kind: "prismatic", rpy_deg: [0.0, 30.0, 0.0], ..turn(2, [1.0, 0.2, 0.0], [0.01, -0.02, 0.2]) },
];
/// On a body that floats, which is the first link: a leg of two parallel joints, and another one.
const LEGGED: &[Hung] =
    &[turn(1, Y, [0.2, 0.1, -0.05]), turn(2, Y, [0.0, 0.03, -0.25]), turn(1, [0.6, 0.0, 0.8], [-0.2, 0.1, 0.0])];

const SYMBOLS: [&str; 10] = ["m", "mx", "my", "mz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"];
/// Rotor, viscous and dry friction, spring of a joint.
const OF_JOINTS: [(&str, f64); 4] = [("J", 0.05), ("d", 0.7), ("f", 0.4), ("k", 3.0)];

/// A robot, and its numbers by their symbols in names.
struct Numbered {
    joints: &'static [Hung],
    floats: bool,
    numbers: BTreeMap<String, f64>,
}

impl Numbered {
    fn new(joints: &'static [Hung], floats: bool) -> Numbered {
        let (mut random, first) = (Random(5), usize::from(floats));
        let mut numbers = BTreeMap::new();
        for link in 1..=joints.len() + first {
            let middle = [1.5, 0.05, -0.04, 0.06, 0.09, 0.0, 0.0, 0.08, 0.0, 0.07];
            for (k, (symbol, x)) in SYMBOLS.iter().zip(middle).enumerate() {
                let by = [0.5, 0.04, 0.03, 0.05, 0.01, 0.004, 0.004, 0.01, 0.004, 0.01][k];
                numbers.insert(format!("{symbol}{link}"), x + random.symmetric(by));
            }
            let of_joint = OF_JOINTS.iter().filter(|_| link > first);
            numbers.extend(of_joint.map(|(symbol, x)| (format!("{symbol}{link}"), x * (1.0 + random.symmetric(0.5)))));
        }
        Numbered { joints, floats, numbers }
    }

    /// The robot file: masses and tensors there are about centres of mass.
    fn file(&self) -> String {
        let mut text = String::from("[robot]\nname = \"numbered\"\n");
        text += if self.floats { "base = \"floating\"\n" } else { "[[link]]\nname = \"l0\"\n" };
        let first = usize::from(self.floats);
        for link in 1..=self.joints.len() + first {
            let [m, mx, my, mz, xx, xy, xz, yy, yz, zz] =
                SYMBOLS.map(|symbol| self.numbers[&format!("{symbol}{link}")]);
            let [x, y, z] = [mx / m, my / m, mz / m];
            let _ = writeln!(text, "[[link]]\nname = \"l{link}\"\nmass = {m:?}\ncom = [{x:?}, {y:?}, {z:?}]");
            let moments = [xx - my * y - mz * z, yy - mx * x - mz * z, zz - mx * x - my * y];
            let [products, of_first] = [[xy, xz, yz], [mx * y, mx * z, my * z]];
            let products: Vec<f64> = products.iter().zip(of_first).map(|(product, own)| product + own).collect();
            let _ = writeln!(
                text,
                "inertia = {{ xx = {:?}, yy = {:?}, zz = {:?}, xy = {:?}, xz = {:?}, yz = {:?} }}",
                moments[0], moments[1], moments[2], products[0], products[1], products[2]
            );
        }
        for (k, Hung { parent, kind, axis, xyz, rpy_deg }) in self.joints.iter().enumerate() {
            let link = k + 1 + first;
            let [j, d, f, stiffness] = OF_JOINTS.map(|(symbol, _)| self.numbers[&format!("{symbol}{link}")]);
            let _ = writeln!(
                text,
                "[[joint]]\nname = \"j{link}\"\nkind = \"{kind}\"\nparent = \"l{parent}\"\nchild = \"l{link}\"\naxis = {axis:?}\n\
                 origin = {{ xyz = {xyz:?}, rpy_deg = {rpy_deg:?} }}\narmature = {j:?}\ndamping = {d:?}\nfriction = {f:?}\n\
                 spring = {{ stiffness = {stiffness:?} }}"
            );
        }
        text
    }

    /// Names and values of its base parameters, and of what its support feels.
    fn lists(&self, scene: &str) -> Vec<(Vec<String>, Vec<f64>)> {
        self.lists_with(scene).into_iter().map(|list| (list.names, list.values)).collect()
    }

    /// The same with all that is said of them.
    fn lists_with(&self, scene: &str) -> Vec<BaseParameterList> {
        let mut diagnostics = Diagnostics::new();
        let read = scene_file::read(&Source::new("scene.toml", scene), &mut diagnostics);
        let options = read.unwrap_or_else(|| panic!("{diagnostics}")).into_options(Options::default());
        let (model, diagnostics) = model::load(&Source::new("numbered.toml", self.file()), &ModelOptions::default());
        let model = model.and_then(|m| straightline_codegen::scene::apply(m, &options.scene, &mut Diagnostics::new()));
        let robot = Robot::new(model.unwrap_or_else(|| panic!("{diagnostics}")));
        let functions = [Function::TorqueRegressor, Function::BaseWrenchRegressor];
        let robot = robot.knowing_base_parameters(&functions, &options.scene);
        base_parameter_lists(&robot.model, &functions)
    }

    /// The same robot with one of its numbers greater.
    fn with_more(&self, symbol: &str, by: f64) -> Numbered {
        let mut numbers = self.numbers.clone();
        *numbers.get_mut(symbol).expect("it is one of its numbers") += by;
        Numbered { numbers, ..*self }
    }
}

/// What a name says: symbols with their factors.
type Group = BTreeMap<String, f64>;

fn group(name: &str) -> Group {
    let signed = name.replace(" - ", " + -");
    let term = |term: &str| match (term.split_once('*'), term.strip_prefix('-')) {
        (Some((factor, symbol)), _) => {
            (symbol.to_string(), factor.parse().unwrap_or_else(|_| panic!("{factor} in {name}")))
        }
        (None, Some(symbol)) => (symbol.to_string(), -1.0),
        (None, None) => (term.to_string(), 1.0),
    };
    signed.split(" + ").map(term).collect()
}

/// Factors are written to four digits.
const DIGITS: f64 = 5e-4;
/// What a number that has no part in a value changes of it, per unit: what rounding leaves.
const NOTHING: f64 = 1e-11;

/// Every name says its value, and by how much each number of the robot changes it.
fn names_say_the_groups(robot: &Numbered, scene: &str) {
    const STEP: f64 = 1e-3;
    let before = robot.lists(scene);
    let of_list = |(names, _): &(Vec<String>, Vec<f64>)| names.iter().map(|name| group(name)).collect();
    let groups: Vec<Vec<Group>> = before.iter().map(of_list).collect();
    for ((names, values), groups) in before.iter().zip(&groups) {
        for ((name, value), group) in names.iter().zip(values).zip(groups) {
            let terms: Vec<f64> = group.iter().map(|(symbol, x)| x * robot.numbers[symbol]).collect();
            let [sum, size] = [terms.iter().sum::<f64>(), terms.iter().map(|x| x.abs()).sum()];
            println!("{value:10.6} {name}");
            assert!((sum - value).abs() <= DIGITS * size, "{name}: {sum} by its name, {value}");
        }
    }
    for symbol in robot.numbers.keys() {
        let after = robot.with_more(symbol, STEP).lists(scene);
        for ((before, after), groups) in before.iter().zip(after).zip(&groups) {
            assert_eq!(before.0, after.0, "names are about no numbers of links");
            for (k, group) in groups.iter().enumerate() {
                let slope = (after.1[k] - before.1[k]) / STEP;
                let factor = group.get(symbol).copied().unwrap_or(0.0);
                let off = (slope - factor).abs();
                assert!(off <= DIGITS * factor.abs() + NOTHING, "{}: {slope} by {symbol}", before.0[k]);
            }
        }
    }
}

#[test]
fn names_of_an_arm_with_parallel_axes_say_the_groups() {
    names_say_the_groups(&Numbered::new(PARALLEL, false), "");
}

#[test]
fn names_of_an_arm_with_axes_that_are_parallel_to_nothing_say_the_groups() {
    names_say_the_groups(&Numbered::new(OBLIQUE, false), "[hold]\ngravity = [0.3, -0.5, -9.7]\n");
}

#[test]
fn names_of_a_robot_with_a_floating_base_say_the_groups() {
    names_say_the_groups(&Numbered::new(LEGGED, true), "");
}

#[test]
fn names_say_which_rotors_frictions_and_springs_have_columns() {
    let scene = "[regressor]\nrotor_inertia = true\ndamping = true\ncoulomb = true\nstiffness = true\n";
    names_say_the_groups(&Numbered::new(PARALLEL, false), scene);
    names_say_the_groups(&Numbered::new(LEGGED, true), scene);
}

#[test]
fn a_name_is_read_as_the_sum_that_it_is() {
    let expected = [("Izz2", 1.0), ("m3", -0.0961), ("mx3", 0.31), ("my2", -1.0)];
    let expected: Group = expected.map(|(symbol, x)| (symbol.to_string(), x)).into();
    assert_eq!(group("-my2 + Izz2 + 0.31*mx3 - 0.0961*m3"), expected);
}

/// What joints add is in no column where the scene names none: the list says of which joints.
#[test]
fn what_has_no_column_is_named() {
    let robot = Numbered::new(PARALLEL, false);
    let left_out = |scene: &str| robot.lists_with(scene).remove(0).left_out;
    let joints = ["j1", "j2", "j3"].map(str::to_string).to_vec();
    let all = ["rotor_inertia", "damping", "coulomb", "stiffness"];
    assert_eq!(left_out(""), all.map(|word| (word, joints.clone())));
    let some = left_out("[regressor]\nrotor_inertia = true\nstiffness = true\n");
    assert_eq!(some, ["damping", "coulomb"].map(|word| (word, joints.clone())));
    let every: String = all.iter().map(|word| format!("{word} = true\n")).collect();
    assert_eq!(left_out(&format!("[regressor]\n{every}")), []);
}
