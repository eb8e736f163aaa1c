//! Regressors and base parameters: as many columns as there is rank, forces of links with any parameters whatever, and laws of mechanics, by the second
//! author.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::evaluate;
use straightline_codegen::function::{base_parameter_lists, Quantity};
use straightline_codegen::model::{self, ModelOptions};
use straightline_codegen::options::{scene_file, Options};
use straightline_codegen::program::checked;
use straightline_codegen::verify::reference_input::centre_of_mass_tree;
use straightline_codegen::verify::{verify, Verification};
use straightline_codegen::{compile, description, scene, Function};
use straightline_core::base_parameters::{BaseParameterKind, PER_BODY};
use straightline_core::model::Load;
use straightline_core::random::Random;
use straightline_core::reference::{self, CentreOfMassTree};
use straightline_core::spatial::Transform;
use straightline_core::{Dd, Real};

/// Beside what double-double loses.
pub(crate) const EXACT: f64 = 1e-22;

/// Robots with the number of their base parameters, where it is known: one of a first joint with a vertical axis, seven of any other turn, ten of a free
/// root; 43 of a Panda (Gaz et al. 2019).
const STANDING: [(&str, bool, Option<usize>); 8] = [
    ("planar2r.urdf", false, None),
    ("puma560.urdf", false, Some(36)),
    ("ur5.urdf", false, Some(36)),
    ("panda.urdf", false, Some(43)),
    ("chapter_cylindrical.toml", false, None),
    ("chapter_stanford.toml", false, None),
    ("chapter_oblique.toml", false, None),
    ("flexible_arm.toml", false, None),
];
const LEGGED: [(&str, bool, Option<usize>); 3] =
    [("solo12.urdf", true, Some(10 + 12 * 7)), ("solo12.urdf", false, None), ("hyq.urdf", true, Some(10 + 12 * 7))];

/// A robot with its number of base parameters.
pub(crate) type Expected = (&'static str, bool, Option<usize>);

pub(crate) struct Robots {
    pub name: &'static str,
    pub robot: Robot,
    tree: CentreOfMassTree<Dd>,
    options: Options,
    random: Random,
}

impl Robots {
    fn new(file: &'static str, floating_base: bool, scene: &str) -> Robots {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../robots/descriptions/").to_string() + file;
        Robots::of(file, &std::fs::read_to_string(&path).expect("a robot file"), floating_base, scene)
    }

    /// A robot by its text.
    pub fn of(file: &'static str, text: &str, floating_base: bool, scene: &str) -> Robots {
        let source = Source::new(file, text);
        let mut diagnostics = Diagnostics::new();
        let read = scene_file::read(&Source::new("scene.toml", scene), &mut diagnostics);
        let options = read.unwrap_or_else(|| panic!("{}", diagnostics.render())).into_options(Options::default());
        let model = ModelOptions { floating_base, rigid_links: true, ..ModelOptions::default() };
        let options = Options { model, ..options };
        let (model, _) = model::load(&source, &options.model);
        let model = scene::apply(model.expect("a robot"), &options.scene, &mut diagnostics);
        let robot = Robot::new(model.unwrap_or_else(|| panic!("{}", diagnostics.render())));
        let robot = robot.knowing_base_parameters(&[Function::TorqueRegressor], &options.scene);
        let description = description::read(&source, &mut Diagnostics::new()).expect("a robot");
        let mut tree = centre_of_mass_tree(&description, &options.model).expect("a tree");
        // joints that follow others have the coordinates of these
        let place_of = |link: &str| {
            let body = robot.model.bodies.iter().position(|body| body.name == link).expect("the same links");
            let source = robot.model.coupling_of(body).map_or(body, |coupling| coupling.source);
            (robot.model.bodies[source].joint.iq, robot.model.bodies[source].joint.iv)
        };
        tree.links.iter_mut().for_each(|link| (link.iq, link.iv) = place_of(&link.name));
        Robots { name: file, robot, tree, options, random: Random(3) }
    }

    pub fn all(list: &'static [Expected]) -> impl Iterator<Item = (Robots, Option<usize>)> {
        list.iter().map(|(file, floating, count)| (Robots::new(file, *floating, ""), *count))
    }

    pub fn columns(&self) -> usize {
        self.robot.model.base_parameters.of_forces.len()
    }

    /// q, q̇, q̈.
    pub fn state(&mut self) -> [Vec<Dd>; 3] {
        let model = &self.robot.model;
        let mut state = [model.nq(), model.nv(), model.nv()]
            .map(|n| (0..n).map(|_| Dd::from(self.random.symmetric(2.0))).collect());
        let state: &mut [Vec<Dd>; 3] = &mut state;
        for joint in model.free_joints() {
            joint.kind.normalise(&mut state[0][joint.iq..joint.iq + joint.kind.nq()]);
        }
        state.clone()
    }

    /// Any parameters of the links, such as no bodies may have.
    pub fn parameters(&mut self) -> Vec<Dd> {
        let n = Quantity::LinkParameters.len(&self.robot.model, 0);
        // masses are divided by
        (0..n).map(|k| Dd::from(self.random.symmetric(1.0) + if k % 10 == 0 { 2.0 } else { 0.0 })).collect()
    }

    /// The results of a program, in double-double.
    pub fn run(&self, function: Function, inputs: &[&[Dd]]) -> Vec<Dd> {
        let program = checked(&self.robot, &[], function, &self.options).unwrap_or_else(|wrong| panic!("{wrong}"));
        evaluate(&program.graph, &inputs.concat())
    }

    /// Parameters in the data's frame of a link, about its own: in the data, links in the chapter's notation have their origins in their joints.
    fn of_link(&self, rank: usize, x: Vec<Dd>) -> [Dd; PER_BODY] {
        let mut own: [Dd; PER_BODY] = x.try_into().expect("ten numbers");
        if self.name.starts_with("chapter_") {
            let body =
                self.robot.model.bodies.iter().find(|body| body.joint.iv == rank).expect("joints of one coordinate");
            let translation = body.link_frame.inverse().translation;
            let load = Load::from_array(own);
            let load = Load { second_moment: load.second_moment.inertia_to_second_moment(), ..load };
            let load = load.seen_from(&Transform { translation, ..Transform::identity() });
            own = Load { second_moment: load.second_moment.second_moment_to_inertia(), ..load }.to_array();
        }
        own
    }

    /// The second author's robot with these parameters of its links.
    pub fn with(&self, parameters: &[Dd]) -> CentreOfMassTree<Dd> {
        let mut tree = self.tree.clone();
        let joints = self.robot.model.tree_joints();
        for (own, joint) in parameters.chunks(10).zip(joints) {
            let body = self.robot.model.bodies.iter().find(|body| body.joint.name == joint.name).expect("its body");
            let frame = self.tree.frame(&body.name).expect("a frame per link").clone();
            let j = frame.link.expect("links that move");
            let c = Vector3::new(own[1] / own[0], own[2] / own[0], own[3] / own[0]);
            let about_origin = Matrix3::new(own[4], own[5], own[6], own[5], own[7], own[8], own[6], own[8], own[9]);
            let steiner = Matrix3::from_diagonal_element(c.dot(&c)) - c * c.transpose();
            // from where the mass centre was
            let moved = frame.position + frame.rotation * c;
            let link = &mut tree.links[j];
            link.mass = own[0];
            link.inertia = frame.rotation * (about_origin - steiner * own[0]) * frame.rotation.transpose();
            link.r += moved;
            tree.links.iter_mut().filter(|link| link.parent == Some(j)).for_each(|link| link.r_parent += moved);
            tree.frames.iter_mut().filter(|frame| frame.link == Some(j)).for_each(|frame| frame.position -= moved);
        }
        tree
    }
}

pub(crate) fn times(y: &[Dd], beta: &[Dd]) -> Vec<Dd> {
    y.chunks(beta.len()).map(|row| row.iter().zip(beta).fold(Dd::ZERO, |sum, (y, b)| sum + *y * *b)).collect()
}

pub(crate) fn hold(what: &str, found: &[Dd], expected: &[Dd], bound: f64) {
    assert_eq!(found.len(), expected.len(), "{what}");
    let scale = expected.iter().map(|x| x.to_f64().abs()).fold(1e-3, f64::max);
    for (k, (x, y)) in found.iter().zip(expected).enumerate() {
        let off = (*x - *y).to_f64().abs();
        assert!(off <= bound * scale, "{what}: result {k} is {x:?}, not {y:?}");
    }
}

pub(crate) fn tau(tree: &CentreOfMassTree<Dd>, [q, qd, qdd]: &[Vec<Dd>; 3]) -> Vec<Dd> {
    reference::inverse_dynamics(tree, q, qd, qdd).iter().copied().collect()
}

/// Of the robots without joints' effects, whatever their links weigh: Y (M π) = τ.
#[test]
fn base_parameters_of_any_links_give_their_forces() {
    hold_forces(&STANDING);
}

pub(crate) fn hold_forces(list: &'static [Expected]) {
    for (mut robot, _) in Robots::all(list) {
        for _ in 0..3 {
            let (state, parameters) = (robot.state(), robot.parameters());
            let y = robot.run(Function::TorqueRegressor, &[&state[0], &state[1], &state[2]]);
            let beta = robot.run(Function::BaseParameters, &[&parameters]);
            hold(robot.name, &times(&y, &beta), &tau(&robot.with(&parameters), &state), EXACT);
            let g = robot.run(Function::GravityRegressor, &[&state[0]]);
            let weight = reference::gravity_force(&robot.with(&parameters), &state[0]);
            hold(robot.name, &times(&g, &beta), weight.as_slice(), EXACT);
        }
    }
}

/// The rank of some rows, by orthogonalisation in double-double.
pub(crate) fn rank(rows: &[Vec<Dd>]) -> usize {
    let columns = rows[0].len();
    let mut basis: Vec<Vec<Dd>> = Vec::new();
    let dot = |a: &[Dd], b: &[Dd]| a.iter().zip(b).fold(Dd::ZERO, |sum, (a, b)| sum + *a * *b);
    for k in 0..columns {
        let column: Vec<Dd> = rows.iter().map(|row| row[k]).collect();
        let whole = dot(&column, &column).sqrt();
        let mut left = column;
        for _ in 0..2 {
            for direction in &basis {
                let along = dot(&left, direction);
                left.iter_mut().zip(direction).for_each(|(x, d)| *x -= along * *d);
            }
        }
        let length = dot(&left, &left).sqrt();
        if length.to_f64() > 1e-18 * whole.to_f64() {
            basis.push(left.into_iter().map(|x| x / length).collect());
        }
    }
    basis.len()
}

/// No column depends on others over random states, and the number is that of the literature.
#[test]
fn columns_are_as_many_as_the_rank() {
    hold_rank(&STANDING);
}

pub(crate) fn hold_rank(list: &'static [Expected]) {
    for (mut robot, expected) in Robots::all(list) {
        let (columns, nv) = (robot.columns(), robot.robot.model.nv());
        let program = checked(&robot.robot, &[], Function::TorqueRegressor, &robot.options);
        let program = program.unwrap_or_else(|wrong| panic!("{wrong}"));
        let mut rows = Vec::new();
        for _ in 0..columns.div_ceil(nv) + 12 {
            let y: Vec<Dd> = evaluate(&program.graph, &robot.state().concat());
            rows.extend(y.chunks(columns).map(<[Dd]>::to_vec));
        }
        assert_eq!(rank(&rows), columns, "{}", robot.name);
        assert!(expected.is_none_or(|expected| expected == columns), "{}: {columns} columns", robot.name);
        println!("{:<24} {columns} base parameters", robot.name);
    }
}

#[test]
#[ignore = "slow proof: programs of some thousand operations are searched"]
fn slow_proof_of_all_that_for_legged_robots() {
    hold_forces(&LEGGED);
    hold_rank(&LEGGED);
    hold_energies(&LEGGED);
    hold_values(&LEGGED);
    hold_entries(&LEGGED);
    hold_data(&[("solo12.urdf", true), ("hyq.urdf", true)]);
}

/// T and V but for a constant, H q̇, and the wrench on the support, each of links with any parameters.
#[test]
fn energies_momenta_and_the_wrench_on_the_support_are_those_of_any_links() {
    hold_energies(&STANDING);
}

pub(crate) fn hold_energies(list: &'static [Expected]) {
    for (mut robot, _) in Robots::all(list) {
        let (first, second, parameters) = (robot.state(), robot.state(), robot.parameters());
        let tree = robot.with(&parameters);
        let beta = robot.run(Function::BaseParameters, &[&parameters]);
        let [at_first, at_second] = [&first, &second].map(|state| {
            let energies = times(&robot.run(Function::EnergyRegressor, &[&state[0], &state[1]]), &beta);
            hold(robot.name, &energies[..1], &[reference::kinetic_energy(&tree, &state[0], &state[1])], EXACT);
            let momenta = times(&robot.run(Function::MomentumRegressor, &[&state[0], &state[1]]), &beta);
            let h: DMatrix<Dd> = reference::mass_matrix(&tree, &state[0]);
            hold(robot.name, &momenta, (h * DVector::from_vec(state[1].clone())).as_slice(), EXACT);
            energies[1] - reference::potential_energy(&tree, &state[0])
        });
        hold(robot.name, &[at_first], &[at_second], EXACT);
        let y = robot.run(Function::BaseWrenchRegressor, &[&first[0], &first[1], &first[2]]);
        let of_support = robot.run(Function::SupportParameters, &[&parameters]);
        hold(robot.name, &times(&y, &of_support), &support_wrench(&robot, &tree, &first), EXACT);
    }
}

/// D'Alembert's sums about the world's origin, or about the point of a free root in its axes.
fn support_wrench(robot: &Robots, tree: &CentreOfMassTree<Dd>, state: &[Vec<Dd>; 3]) -> Vec<Dd> {
    if robot.robot.model.floats() {
        return tau(tree, state)[..6].to_vec();
    }
    let places = reference::geometry(tree, &state[0]);
    let motions = reference::motion(tree, &places, &state[1], &state[2]);
    let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
    for (link, (place, moves)) in tree.links.iter().zip(places.iter().zip(&motions)) {
        let own = (moves.w - tree.gravity) * link.mass;
        let [omega, epsilon] = [moves.omega, moves.epsilon].map(|v| place.rotation.transpose() * v);
        let turning = place.rotation * (link.inertia * epsilon + omega.cross(&(link.inertia * omega)));
        force += own;
        moment += turning + place.centre_of_mass.cross(&own);
    }
    force.iter().chain(moment.iter()).copied().collect()
}

/// The values that files state are those of the links, and every name is one parameter's.
#[test]
fn values_and_names_are_those_of_the_robot() {
    hold_values(&STANDING);
}

pub(crate) fn hold_values(list: &'static [Expected]) {
    for (robot, _) in Robots::all(list) {
        let model = &robot.robot.model;
        let lists = base_parameter_lists(model, &[Function::TorqueRegressor, Function::BaseWrenchRegressor]);
        assert_eq!(lists.len(), 2);
        let of_links = model.link_parameters();
        for (list, function) in lists.iter().zip([Function::BaseParameters, Function::SupportParameters]) {
            let beta = robot.run(function, &[&of_links]);
            let values: Vec<Dd> = list.values.iter().copied().map(Dd::from).collect();
            hold(robot.name, &values, &beta, 1e-15);
            let mut names = list.names.clone();
            names.sort();
            names.dedup();
            assert_eq!(names.len(), values.len(), "{}: {names:?}", robot.name);
        }
    }
}

/// A parameter of which the second joint's axis tells nothing goes to the first link: m2 l² and the like.
#[test]
fn names_say_the_group() {
    let robot = Robots::new("planar2r.urdf", false, "");
    let list = &base_parameter_lists(&robot.robot.model, &[Function::TorqueRegressor])[0];
    println!("{:#?}", list.names);
    assert!(list.names.iter().any(|name| name.contains("Izz1") && name.contains("*m2")), "{:?}", list.names);
}

/// The entries that are listed are those of the matrix, and all others are zero.
#[test]
fn entries_and_their_places_make_the_matrix() {
    hold_entries(&STANDING);
}

pub(crate) fn hold_entries(list: &'static [Expected]) {
    for (mut robot, _) in Robots::all(list) {
        let state = robot.state();
        let inputs = [&state[0][..], &state[1], &state[2]];
        let (y, entries) =
            (robot.run(Function::TorqueRegressor, &inputs), robot.run(Function::TorqueRegressorEntries, &inputs));
        let list = &base_parameter_lists(&robot.robot.model, &[Function::TorqueRegressor])[0];
        let mut whole = vec![Dd::ZERO; y.len()];
        for ([row, column], entry) in list.places.iter().zip(&entries) {
            whole[row * robot.columns() + column] = *entry;
        }
        hold(robot.name, &y, &whole, EXACT);
        println!("{:<24} {} of {} entries", robot.name, entries.len(), y.len());
        assert!(entries.len() < y.len());
    }
}

/// What joints add has columns where a scene says so: with all of them Y β is inverse dynamics with friction, springs and rotors. A rotor that
/// turns as a link does is a part of its inertia.
#[test]
fn joints_have_columns_where_a_scene_wants_them() {
    let all = "[regressor]\nrotor_inertia = true\ndamping = true\ncoulomb = true\noffset = true\nstiffness = true\n";
    for (file, floating) in [("panda.urdf", false), ("chapter_cylindrical.toml", false), ("solo12.urdf", true)] {
        let (plain, mut robot) = (Robots::new(file, floating, ""), Robots::new(file, floating, all));
        let single = robot.robot.model.bodies.iter().filter(|body| body.joint.kind.is_single()).count();
        let added = robot.columns() - plain.columns();
        // rotors of the first two joints of an arm turn as the links do
        assert!((4 * single..5 * single + 1).contains(&added), "{file}: {added} columns for {single} joints");
        let (state, parameters) = (robot.state(), robot.parameters());
        let y = robot.run(Function::TorqueRegressor, &[&state[0], &state[1], &state[2]]);
        let beta = robot.run(Function::BaseParameters, &[&parameters]);
        let mut expected = tau(&robot.with(&parameters), &state);
        let of_joints = &parameters[10 * robot.robot.model.bodies.len()..];
        let model = &robot.robot.model;
        let joints: Vec<_> = model.joints().into_iter().filter(|joint| joint.kind.is_single()).collect();
        for (k, joint) in joints.iter().enumerate() {
            let [q, qd, qdd] = [state[0][joint.iq], state[1][joint.iv], state[2][joint.iv]];
            let body = model.bodies.iter().find(|body| body.joint.name == joint.name).expect("its body");
            let columns = [qdd, qd, qd.sign(), Dd::ONE, q - body.effects.spring_rest];
            for (kind, column) in columns.into_iter().enumerate() {
                expected[joint.iv] += column * of_joints[kind * single + k];
            }
        }
        hold(file, &times(&y, &beta), &expected, EXACT);
        let rotors = robot.robot.model.base_parameters.of_forces.iter();
        let rotors =
            rotors.filter(|p| matches!(p.kind, BaseParameterKind::Joint(kind) if kind.word() == "rotor_inertia"));
        println!("{file}: {} rotors of {single} have columns of their own", rotors.count());
    }
}

/// Data with 25 digits: the change of τ by a change of links' parameters.
#[test]
fn changes_of_links_change_forces_as_in_the_data() {
    let arms =
        ["planar2r.urdf", "chapter_cylindrical.toml", "chapter_6r.toml", "puma560.urdf", "ur5.urdf", "panda.urdf"];
    hold_data(&arms.map(|file| (file, false)));
}

fn hold_data(robots: &[(&'static str, bool)]) {
    for (file, floating) in robots.iter().copied() {
        let name = file.split('.').next().expect("a name");
        let path = format!("{}/../generated_tests/reference/derivatives/{name}.json", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
        let data: serde_json::Value = serde_json::from_str(&text).expect("json");
        let robot = Robots::new(file, floating, "");
        let list = |value: &serde_json::Value| -> Vec<Dd> {
            let entries = value.as_array().expect("a list").iter();
            entries.map(|x| Dd::from_decimal(x.as_str().expect("a number")).expect("a number")).collect()
        };
        let (y_of, map) = [Function::TorqueRegressor, Function::BaseParameters]
            .map(|function| {
                checked(&robot.robot, &[], function, &robot.options).unwrap_or_else(|wrong| panic!("{wrong}")).graph
            })
            .into();
        let mut worst = 0.0_f64;
        for state in data["states"].as_array().expect("states") {
            if state["kind"] == "gravity_tilted" {
                continue;
            }
            let mut inputs = ["q", "qd", "qdd"].map(|key| list(&state[key]));
            for joint in robot.robot.model.free_joints() {
                joint.kind.normalise(&mut inputs[0][joint.iq..joint.iq + joint.kind.nq()]);
            }
            let in_f64 = |x: &[Dd]| x.iter().map(|x| x.to_f64()).collect::<Vec<f64>>();
            let y: Vec<f64> = evaluate(&y_of, &in_f64(&inputs.concat()));
            for case in state["torque_regressor"].as_array().expect("cases") {
                let change = case["dpi"].as_array().expect("links").iter().map(&list);
                let change: Vec<Dd> = change.enumerate().flat_map(|(k, x)| robot.of_link(k, x)).collect();
                let beta: Vec<Dd> = evaluate(&map, &change);
                let exact: Vec<Dd> = y.iter().copied().map(Dd::from).collect();
                let (found, expected) = (times(&exact, &beta), list(&case["dtau"]));
                let greatest = expected.iter().map(|x| x.to_f64().abs()).fold(1e-30, f64::max);
                for (x, y) in found.iter().zip(&expected) {
                    worst = worst.max((*x - *y).to_f64().abs() / greatest);
                }
            }
        }
        println!("{name:<20} {worst:.1e} of the greatest change of forces");
        assert!(worst < 1e-15, "{name}: {worst:e}");
    }
}

/// Every function of a scene, beside the second author, in its own arithmetic.
fn verified(file: &str, scene: &str) -> Verification {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../robots/descriptions/").to_string() + file;
    let source = Source::new(file, std::fs::read_to_string(&path).expect("a robot file"));
    let mut diagnostics = Diagnostics::new();
    let read = scene_file::read(&Source::new("scene.toml", scene), &mut diagnostics);
    let options = read.unwrap_or_else(|| panic!("{}", diagnostics.render())).into_options(Options::default());
    let generated = compile(&source, &options).unwrap_or_else(|errors| panic!("{}", errors.render()));
    verify(&source, &generated, &options, (4, 1), || ()).unwrap_or_else(|why| panic!("{why}"))
}

const OTHERS: &str =
    "\"torque_regressor_entries\", \"gravity_regressor\", \"momentum_regressor\", \"energy_regressor\", \
                      \"base_wrench_regressor\", \"base_parameters\", \"support_parameters\"";

/// Also with joints locked, rows selected, gravity an input, and in f32.
#[test]
#[ignore = "slow proof: what scenes skip is compiled step by step"]
fn slow_proof_that_regressors_in_scenes_are_the_second_authors() {
    let whole = format!("functions = [\"torque_regressor\", {OTHERS}]");
    let of_rows = "torque_regressor = { joints = [\"panda_joint2\", \"panda_joint5\"] }";
    let scenes = [
        format!("[outputs]\n{whole}\n"),
        format!("[outputs]\n{whole}\n[hold]\njoints = {{ panda_joint3 = 0.3 }}\n[regressor]\nrotor_inertia = true\ncoulomb = true\n"),
        format!("[outputs]\nfunctions = [{OTHERS}]\n{of_rows}\n[hold]\ngravity = \"input\"\n[numbers]\nscalar = \"f32\"\n"),
    ];
    for scene in scenes {
        let verification = verified("panda.urdf", &scene);
        assert!(verification.passes(), "{scene}: {:?}", verification.functions);
        assert_eq!(verification.functions.len(), 6, "{scene}");
        assert_eq!(verification.left_out, ["base_parameters", "support_parameters"]);
    }
}

/// Of what is not zero there are columns of joints, too.
#[test]
fn entries_alone_may_have_columns_of_joints() {
    let scene = "[outputs]\nfunctions = [\"torque_regressor_entries\"]\n[regressor]\ncoulomb = true\n";
    let verification = verified("planar2r.urdf", scene);
    assert!(verification.passes() && verification.functions.len() == 1, "{:?}", verification.functions);
}

/// Forces are linear in the parameters, so that their derivative is a difference; and H ∂q̈/∂π = −∂τ/∂π.
#[test]
fn derivatives_by_a_payload_are_those_of_the_second_author() {
    let scene = "[outputs]\nfunctions = [\"parameter_derivatives\"]\n[[parameter]]\nkind = \"payload\"\nname = \"tool\"\nframe = \"panda_hand\"\n";
    let verification = verified("panda.urdf", scene);
    assert!(verification.passes(), "{:?}", verification.functions);
    assert_eq!(verification.functions.len(), 1);
}

/// What bodies weigh on purpose, and gravity along no axis: more is told apart.
#[test]
fn gravity_as_an_input_tells_more_apart() {
    let upright = Robots::new("panda.urdf", false, "").columns();
    let any = Robots::new("panda.urdf", false, "[hold]\ngravity = \"input\"\n").columns();
    assert_eq!((upright, any), (43, 45));
}
