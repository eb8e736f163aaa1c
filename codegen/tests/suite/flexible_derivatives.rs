//! Derivatives of robots whose links bend and whose base stands on springs, in double-double: beside the second author's equations in dual numbers,
//! and what springs and dampers of the segments add to them.

use std::collections::BTreeMap;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::{evaluate, Graph};
use straightline_codegen::function::Quantity;
use straightline_codegen::model;
use straightline_codegen::options::{scene_file, Optimisations, Options};
use straightline_codegen::program::optimised;
use straightline_codegen::verify::SecondReading;
use straightline_codegen::{scene, Diagnostics, Function};
use straightline_core::random::Random;
use straightline_core::Dd;

const ARM: &str = include_str!("../../../robots/descriptions/flexible_arm.toml");
const FUNCTIONS: [Function; 4] = [
    Function::InverseDynamicsDerivatives,
    Function::ForwardDynamicsDerivatives,
    Function::ForwardDynamicsJvp,
    Function::ForwardDynamicsVjp,
];
/// Of the greatest entry of a block. Segments are as light as 1e-6 kg·m² beside 1 kg·m², which solutions lose.
const MOST: f64 = 1e-22;

/// The arm in fewer segments, of which the upper arm's also twists: 8 joints.
fn short() -> String {
    ARM.replace("segments = 3", "segments = 1").replace("segments = 4", "segments = 1")
}

/// A heavy foot that gives along z and about y, below a link that bends and twists in one segment, and one joint beyond it.
const TOWER: &str = r#"
[robot]
name = "tower"
[[link]]
name = "foot"
mass = 5.0
com = [0.02, -0.01, 0.1]
inertia = { xx = 0.1, yy = 0.12, zz = 0.05, xy = 0.004, xz = -0.003, yz = 0.002 }
[[link]]
name = "mast"
mass = 0.7
com = [0.01, 0.02, 0.3]
inertia = { xx = 0.021, yy = 0.022, zz = 0.004, xy = 0.001, xz = -0.0003, yz = 0.0006 }
flexible = { to = [0.0, 0.0, 0.6], segments = 1, bending = 40.0, torsion = 30.0, damping = 2e-3 }
[[link]]
name = "arm"
mass = 2.0
com = [0.03, 0.1, 0.3]
inertia = { xx = 0.05, yy = 0.04, zz = 0.01, yz = -0.002 }
[[joint]]
name = "bolt"
kind = "fixed"
parent = "foot"
child = "mast"
origin = { xyz = [0.0, 0.1, 0.2], rpy_deg = [10, 20, 30] }
[[joint]]
name = "hinge"
kind = "continuous"
parent = "mast"
child = "arm"
axis = [0.2, 1.0, 0.1]
origin = { xyz = [0.05, 0.02, 0.6], rpy_deg = [5, 10, -15] }
damping = 0.3
armature = 0.02
"#;
const SUPPORT: &str =
    "[support]\nat = [0.0, 0.1, -0.2]\nz = { stiffness = 4e4, damping = 90.0 }\nry = { stiffness = 2e3, damping = 4.0 }\n";

struct Flexible {
    robot: Robot,
    reading: SecondReading,
    options: Options,
    is_searched: bool,
}

impl Flexible {
    fn new(text: &str, scene: &str, is_searched: bool) -> Flexible {
        let (source, mut diagnostics) = (Source::new("flexible.toml", text), Diagnostics::new());
        let read = scene_file::read(&Source::new("scene.toml", scene), &mut diagnostics);
        let options = read.unwrap_or_else(|| panic!("{diagnostics}")).into_options(Options::default());
        let options = Options { model: options.scene.model_options(&options.model), ..options };
        let model = model::load(&source, &options.model).0;
        let model = model.and_then(|model| scene::apply(model, &options.scene, &mut diagnostics));
        let model = model.unwrap_or_else(|| panic!("{diagnostics}"));
        let reading = SecondReading::new(&source, &model, &options).unwrap_or_else(|why| panic!("{why}"));
        Flexible { robot: Robot::new(model), reading, options, is_searched }
    }

    /// Joints anywhere, segments as far as links bend, all at some speed and under some force.
    fn state(&self, random: &mut Random) -> BTreeMap<Quantity, Vec<Dd>> {
        let model = &self.robot.model;
        let any = |quantity: Quantity| {
            let x = (0..quantity.len(model, 0)).map(|_| Dd::from(random.symmetric(1.0)));
            (quantity, x.collect::<Vec<_>>())
        };
        let inputs = FUNCTIONS.iter().flat_map(|function| function.quantities(model));
        let mut state: BTreeMap<Quantity, Vec<Dd>> = inputs.map(any).collect();
        let q = state.get_mut(&Quantity::Configuration).expect("every function is of a configuration");
        let elastic = model.bodies.iter().filter(|body| body.joint.limits.effort == 0.0);
        elastic.for_each(|body| q[body.joint.iq] *= Dd::from(0.1));
        state
    }

    /// The program without the search for its cheapest form, which takes long.
    fn graph(&self, function: Function) -> Graph {
        let all = self.options.optimisations();
        let plain = Optimisations { chosen: false, substitutes: false, ..all };
        optimised(&self.robot, &[], function, &self.options, if self.is_searched { all } else { plain })
    }

    fn results(&self, function: Function, state: &BTreeMap<Quantity, Vec<Dd>>) -> Vec<(String, Vec<Dd>)> {
        let graph = self.graph(function);
        let given =
            |name: &str| state.iter().find(|(quantity, _)| quantity.name() == name).expect("it is in the state").1;
        let inputs: Vec<Dd> = graph.inputs.iter().flat_map(|port| given(&port.name)).copied().collect();
        let mut found = evaluate(&graph, &inputs).into_iter();
        graph.outputs.iter().map(|port| (port.name.clone(), found.by_ref().take(port.len()).collect())).collect()
    }

    fn hold_derivatives(&self, coordinates: usize) {
        assert_eq!(self.robot.model.nv(), coordinates);
        let state = self.state(&mut Random(4));
        for function in FUNCTIONS {
            let (expected, _) =
                self.reading.outputs(function, &[], state.clone()).unwrap_or_else(|why| panic!("{why}"));
            let mut rest = &expected[..];
            for (name, found) in self.results(function, &state) {
                let (expected, others) = rest.split_at(found.len());
                rest = others;
                let greatest = expected.iter().map(|x| x.to_f64().abs()).fold(1e-3, f64::max);
                let off =
                    found.iter().zip(expected).map(|(x, y)| (*x - *y).to_f64().abs() / greatest).fold(0.0, f64::max);
                println!("{}, {coordinates} coordinates, {name}: {off:.1e}", function.name());
                assert!(off <= MOST, "{} of {}: {off:e}", name, function.name());
            }
            assert!(rest.is_empty(), "{}", function.name());
        }
    }
}

#[test]
fn derivatives_of_an_arm_whose_links_bend_are_those_of_the_second_author_in_dual_numbers() {
    Flexible::new(&short(), "", false).hold_derivatives(8);
}

#[test]
fn derivatives_of_a_robot_on_springs_with_a_link_that_bends_are_those_of_the_second_author_in_dual_numbers() {
    Flexible::new(TOWER, SUPPORT, false).hold_derivatives(6);
}

#[test]
#[ignore = "a minute or more: seventeen joints, whose programs are searched"]
fn long_proof_that_derivatives_of_an_arm_in_many_segments_are_those_of_the_second_author() {
    Flexible::new(&short(), "", true).hold_derivatives(8);
    Flexible::new(TOWER, SUPPORT, true).hold_derivatives(6);
    Flexible::new(ARM, "", true).hold_derivatives(3 + 3 * 3 + 4 * 2);
}

/// K and D of the segments alone: n EI/L and its time constant on the diagonal, and nothing beside it.
#[test]
fn springs_and_dampers_of_segments_stand_on_the_diagonals_of_the_derivatives() {
    let with = Flexible::new(&short(), "", false);
    let without = Flexible::new(&short(), "[effects]\nsprings = false\ndamping = false\n", false);
    let (state, nv) = (with.state(&mut Random(6)), with.robot.model.nv());
    let blocks = [&with, &without].map(|arm| arm.results(Function::InverseDynamicsDerivatives, &state));
    let elastic =
        |iv: usize| with.robot.model.bodies.iter().find(|body| body.joint.iv == iv).expect("its body").effects;
    assert!((0..nv).filter(|iv| elastic(*iv).stiffness != Dd::ZERO).count() == 5, "five of eight are segments");
    for (block, of) in [(0, "dtau_dq"), (1, "dtau_dqd")] {
        assert_eq!(blocks[0][block].0, of);
        for (at, (x, y)) in blocks[0][block].1.iter().zip(&blocks[1][block].1).enumerate() {
            let (i, j) = (at / nv, at % nv);
            let own = if block == 0 { elastic(i).stiffness } else { elastic(i).damping };
            let expected = if i == j { own } else { Dd::ZERO };
            let off = (*x - *y - expected).to_f64().abs();
            assert!(off <= 1e-26 * (1.0 + own.to_f64()), "{of}[{i}][{j}]: {off:e}");
        }
    }
}
