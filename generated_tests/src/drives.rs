//! Robots with drives for the tests: drives are written as `[[drive]]` tables of a scene, so that reading them is tested, too.

use crate::reference::{description, numbers};
use serde_json::Value;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::{evaluate, Graph};
use straightline_codegen::model::{self, ModelOptions};
use straightline_codegen::options::scene_file;
use straightline_codegen::options::{Optimisations, Options};
use straightline_codegen::program::optimised;
use straightline_codegen::scene::{self, Scene};
use straightline_codegen::Function;
use straightline_core::{Dd, Real};

/// A robot in a scene.
pub struct Driven {
    /// The robot with its drives.
    pub robot: Robot,
    /// The scene.
    pub scene: Scene,
    /// With the form of the reduced robot sought that takes the fewest operations; otherwise it is the plain one.
    pub is_chosen: bool,
}

impl Driven {
    /// A robot file under a scene in TOML.
    ///
    /// # Panics
    /// With the complaints, if there are any errors.
    pub fn new(robot: &Source, options: &ModelOptions, scene: &str) -> Driven {
        let mut diagnostics = Diagnostics::new();
        let file = scene_file::read(&Source::new("drives.toml", scene), &mut diagnostics);
        let (model, complaints) = model::load(robot, options);
        diagnostics.extend(complaints);
        let scene = file.unwrap_or_else(|| panic!("{}\n{scene}", diagnostics.render())).scene;
        let model = model.and_then(|model| scene::apply(model, &scene, &mut diagnostics));
        assert!(!diagnostics.has_errors(), "{}\n", diagnostics.render());
        Driven { robot: Robot::new(model.expect("a robot without errors")), scene, is_chosen: false }
    }

    /// A robot of the reference data with drives, under a gravity.
    ///
    /// # Panics
    /// With the complaints, if there are any errors.
    pub fn of_reference(name: &str, gravity: &Value, drives: &str) -> Driven {
        let path = description(name);
        let text = std::fs::read_to_string(&path).expect("the robot file is there");
        let source = Source::new(&path.file_name().expect("a file").to_string_lossy(), text);
        let gravity: Vec<f64> = numbers(gravity).into_iter().map(Dd::to_f64).collect();
        let options = ModelOptions { gravity: Some([gravity[0], gravity[1], gravity[2]]), ..ModelOptions::default() };
        Driven::new(&source, &options, drives)
    }

    /// The program of a function.
    pub fn program(&self, function: Function) -> Graph {
        assert!(function.is_of(&self.robot.model), "{} is not there", function.name());
        let options = Options { scene: self.scene.clone(), ..Options::default() };
        let optimisations = Optimisations { chosen: self.is_chosen, ..options.optimisations() };
        optimised(&self.robot, &[], function, &options, optimisations)
    }

    /// The results of a function of the drives, block by block, for inputs by name.
    ///
    /// # Panics
    /// If an input is missing.
    pub fn run<T: Real>(&self, function: Function, inputs: &[(&str, &[T])]) -> Vec<Vec<T>> {
        blocks(&self.program(function), inputs)
    }
}

/// The results of a program, block by block, for inputs by name.
///
/// # Panics
/// If an input is missing.
pub fn blocks<T: Real>(graph: &Graph, inputs: &[(&str, &[T])]) -> Vec<Vec<T>> {
    let named = |name: &str| inputs.iter().find(|(n, _)| *n == name).unwrap_or_else(|| panic!("no {name}")).1;
    let arguments: Vec<T> = graph.inputs.iter().flat_map(|p| named(&p.name).iter().copied()).collect();
    let mut results = evaluate(graph, &arguments).into_iter();
    graph.outputs.iter().map(|port| results.by_ref().take(port.len()).collect()).collect()
}
