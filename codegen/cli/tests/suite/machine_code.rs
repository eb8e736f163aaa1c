//! What is simulated by machine code moves to the bit as by the generic runtime.

use std::path::{Path, PathBuf};
use straightline_cli::experiment::equations::by_machine_code;
use straightline_codegen::description;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::model::{self, ModelOptions};
use straightline_core::model::{Coulomb, Model};
use straightline_core::random::Random;
use straightline_simulation::plant::{Action, Plant};

/// Speeds of friction that is smooth.
const COULOMB_SPEED: f64 = 1e-2;
const STATES: usize = 8;

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(name)
}

fn robots() -> Vec<PathBuf> {
    let all = std::fs::read_dir(folder("robots/descriptions")).expect("the robots are there");
    let mut all: Vec<PathBuf> = all.map(|entry| entry.expect("it is there").path()).collect();
    all.sort();
    all
}

fn model(path: &Path, floating_base: bool) -> Option<Model<f64>> {
    let text = std::fs::read_to_string(path).expect("it can be read");
    let mut diagnostics = Diagnostics::new();
    let description = description::read(&Source::new(&path.to_string_lossy(), text), &mut diagnostics)?;
    let options = ModelOptions { floating_base, ..ModelOptions::default() };
    let model = model::build(&description, &options, &mut diagnostics)?;
    (!diagnostics.has_errors()).then(|| model.cast())
}

/// Rates of random states, to the bit; a NaN is any NaN.
fn rates(plant: &Plant, seed: u64) -> Vec<Option<u64>> {
    let mut random = Random(seed);
    let mut number = || random.symmetric(1.5);
    let mut all = Vec::new();
    for _ in 0..STATES {
        let state: Vec<f64> = (0..plant.states()).map(|_| number()).collect();
        let tau = (0..plant.model.nv()).map(|_| number()).collect();
        let u = plant.model.drives.iter().map(|_| number()).collect();
        let mut rate = vec![0.0; plant.states()];
        plant.rate(&state, &Action { tau, u }, &mut rate);
        all.extend(rate.into_iter().map(|x| (!x.is_nan()).then(|| x.to_bits())));
    }
    all
}

#[test]
fn motions_have_the_bits_of_the_generic_runtime() {
    let mut compared = 0;
    for path in robots() {
        for model in [false, true].into_iter().filter_map(|floating| model(&path, floating)) {
            let plain = Plant::new(model, COULOMB_SPEED);
            let fast = by_machine_code(plain.clone());
            let [plain, fast] = [&plain, &fast].map(|plant| rates(plant, 7));
            assert!(plain.iter().any(Option::is_some), "{}: nothing is a number", path.display());
            assert_eq!(plain, fast, "{}", path.display());
            compared += 1;
        }
    }
    assert!(compared >= 13, "{compared}");
}

/// Effects of joints stand in the equations of the plant, not in those of the file.
#[test]
fn friction_is_that_of_the_plant() {
    let mut model = model(&folder("robots/descriptions/ur5.urdf"), false).expect("it is a robot");
    let rough = Plant::new(model.clone(), COULOMB_SPEED);
    for body in &mut model.bodies {
        body.effects.coulomb = Coulomb::Sign(3.0);
        body.effects.damping = 0.5;
    }
    let damped = Plant::new(model, COULOMB_SPEED);
    assert_ne!(rates(&rough, 3), rates(&damped, 3));
    assert_eq!(rates(&by_machine_code(damped.clone()), 3), rates(&damped, 3));
}
