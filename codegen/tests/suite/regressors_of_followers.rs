//! Regressors and base parameters of robots whose joints follow others: as many columns as the rank of Gᵀ Y_tree by the second author, and the forces of links
//! with any parameters.

use crate::regressors::{
    hold, hold_energies, hold_entries, hold_forces, hold_rank, hold_values, rank, tau, times, Expected, Robots, EXACT,
};
use crate::robots::Random;
use std::fmt::Write;
use straightline_codegen::Function;
use straightline_core::base_parameters::PER_BODY;
use straightline_core::Dd;

/// Of the data with 25 digits: mimics of mimics, across branches, on a floating base, of slides by turns, and a gripper.
const FOLLOWING: [Expected; 5] = [
    ("../../generated_tests/reference/joints/robots/mimic_chain.urdf", false, None),
    ("../../generated_tests/reference/joints/robots/mimic_tree.urdf", false, None),
    ("../../generated_tests/reference/joints/robots/mimic_gripper.urdf", false, None),
    ("../../generated_tests/reference/joints/robots/mimic_screw.urdf", false, None),
    ("../../generated_tests/reference/joints/robots/mimic_float.urdf", true, None),
];

#[test]
fn robots_with_followers_have_the_forces_of_any_links() {
    hold_forces(&FOLLOWING);
    hold_energies(&FOLLOWING);
    hold_values(&FOLLOWING);
    hold_entries(&FOLLOWING);
}

#[test]
fn robots_with_followers_have_as_many_columns_as_the_rank() {
    hold_rank(&FOLLOWING);
    Robots::all(&FOLLOWING).for_each(|(mut robot, _)| hold_whole_rank(&mut robot));
}

/// No column is missing: the forces of all parameters of all links have the same rank.
fn hold_whole_rank(robot: &mut Robots) {
    let (columns, nv) = (robot.columns(), robot.robot.model.nv());
    let plain = robot.parameters();
    let all = PER_BODY * robot.robot.model.bodies.len();
    let base = robot.with(&plain);
    let with_one_more: Vec<_> = (0..all)
        .map(|k| {
            let mut parameters = plain.clone();
            parameters[k] += Dd::ONE;
            robot.with(&parameters)
        })
        .collect();
    let mut rows = Vec::new();
    for _ in 0..columns.div_ceil(nv) + 6 {
        let state = robot.state();
        let before = tau(&base, &state);
        let greatest = before.iter().map(|x| x.abs().to_f64()).fold(1.0, f64::max);
        // what rounding leaves of a parameter without effect is nothing
        let change = |x: Dd, y: Dd| if (x - y).abs().to_f64() < 1e-26 * greatest { Dd::ZERO } else { x - y };
        let changed: Vec<Vec<Dd>> = with_one_more.iter().map(|tree| tau(tree, &state)).collect();
        rows.extend((0..nv).map(|row| changed.iter().map(|own| change(own[row], before[row])).collect::<Vec<Dd>>()));
    }
    assert_eq!(rank(&rows), columns, "{}", robot.name);
}

/// A tree of six joints, two or three of which follow others, by ratios and offsets of any sign.
fn random_robot(seed: u64) -> String {
    let mut random = Random(seed);
    let mut text = "[robot]\nname = \"random\"\n[[link]]\nname = \"l0\"\n".to_string();
    let mut number = |size: f64| random.number().to_f64() * size;
    let mut below = |n: usize| (number(0.5).abs() * 2.0 * n as f64) as usize % n;
    let axes = ["x", "y", "z", "[0.36, -0.48, 0.8]"];
    for k in 1..=6 {
        let (kind, axis, parent) = (["continuous", "prismatic"][below(3) / 2], axes[below(4)], below(k));
        let turn = ["", ", rpy_deg = [90, 0, -90]", ", rpy = [0.3, -0.7, 1.1]"][below(3)];
        let [x, y, z] = [0; 3].map(|_| below(7) as f64 * 0.1 - 0.3);
        _ = write!(
            text,
            "[[link]]\nname = \"l{k}\"\nmass = 1.0\ninertia = [0.1, 0.1, 0.1]\n[[joint]]\nname = \"j{k}\"\nkind = \"{kind}\"\n\
             parent = \"l{parent}\"\nchild = \"l{k}\"\naxis = {}\norigin = {{ xyz = [{x:?}, {y:?}, {z:?}]{turn} }}\n",
            if axis.len() == 1 { format!("\"{axis}\"") } else { axis.to_string() },
        );
    }
    for k in [3, 5, 6].into_iter().skip(below(2)) {
        let (source, ratio, offset) = (1 + below(k - 1), [1.0, -1.0, 0.5, -2.3][below(4)], [0.0, 0.4][below(2)]);
        _ = write!(
            text,
            "[[coupling]]\njoint = \"j{k}\"\nfollows = \"j{source}\"\nratio = {ratio:?}\noffset = {offset:?}\n"
        );
    }
    text
}

#[test]
fn random_robots_with_followers_have_the_rank_and_the_forces() {
    for seed in 0..10 {
        let text = random_robot(seed);
        let mut robot = Robots::of("random.toml", &text, false, "");
        println!("seed {seed}: {} base parameters", robot.columns());
        let (state, parameters) = (robot.state(), robot.parameters());
        let y = robot.run(Function::TorqueRegressor, &[&state[0], &state[1], &state[2]]);
        let beta = robot.run(Function::BaseParameters, &[&parameters]);
        hold(&text, &times(&y, &beta), &tau(&robot.with(&parameters), &state), EXACT);
        hold_whole_rank(&mut robot);
    }
}

/// Two fingers on one coordinate are told apart by nothing: of their masses one parameter is left, and of what their joints add, too.
#[test]
fn what_moves_together_is_one_parameter() {
    let finger = |side: &str, axis: &str, y: f64| {
        format!(
            "[[link]]\nname = \"{side}\"\nmass = 0.2\ninertia = [1e-3, 1e-3, 1e-3]\n[[joint]]\nname = \"{side}_slide\"\nkind = \"prismatic\"\n\
             limits = [0.0, 0.04]\nparent = \"palm\"\nchild = \"{side}\"\naxis = \"{axis}\"\norigin = {{ xyz = [0.0, {y:?}, 0.1] }}\ndamping = 0.5\n"
        )
    };
    let text = format!(
        "[robot]\nname = \"gripper\"\n[[link]]\nname = \"palm\"\n{}{}[[coupling]]\njoint = \"right_slide\"\nfollows = \"left_slide\"\n",
        finger("left", "y", 0.01),
        finger("right", "-y", -0.01),
    );
    let robot = Robots::of("gripper.toml", &text, false, "[regressor]\ndamping = true\n");
    let of_forces = &robot.robot.model.base_parameters.of_forces;
    let of_links = robot.robot.model.link_parameters();
    let values: Vec<f64> = of_forces.iter().map(|parameter| parameter.value(&of_links).to_f64()).collect();
    assert_eq!(values, [0.4, 1.0], "{of_forces:?}");
}
