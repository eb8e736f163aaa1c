//! Fixed point on machines without floating point: instructions of the Panda's inverse dynamics, certified to 1e-7 of full scale.

use super::{Bench, Figures, FEW_STATES, MACHINES};
use std::fmt::Write;
use std::path::Path;
use straightline_codegen::choices::{FixedProducts, TargetMachine};
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::options::{scene_file, Options};
use straightline_codegen::Function;

const ROBOT: &str = "panda";
const ERROR: f64 = 1e-7;
const RANGES: &str = "[numbers.ranges]\nqd = [-2.5, 2.5]\nqdd = [-10.0, 10.0]\n";
/// The products that the machines have.
const PRODUCTS: [(TargetMachine, FixedProducts); 2] =
    [(TargetMachine::CORTEX_M0PLUS, FixedProducts::Halves), (TargetMachine::RV32IMAC, FixedProducts::Wide)];

impl Bench<'_> {
    /// The figures, by machine and name; whether the bits are the host's.
    pub(super) fn fixed(&self, plugin: &Path) -> (Vec<(String, Figures)>, bool) {
        let mut agree = true;
        let mut rows = Vec::new();
        for (machine, products) in PRODUCTS {
            let (_, memory, emulator) = MACHINES.into_iter().find(|(of, ..)| *of == machine).expect("it is emulated");
            let source = self.fixed_source(machine, products);
            let program = self.linked(machine, memory, emulator, &format!("#![no_std]\n#![no_main]\n{source}"), &[]);
            let name = format!("{ROBOT}::fixed::inverse_dynamics");
            let function = [(name.clone(), format!("{}{ROBOT}5fixed16inverse_dynamics", ROBOT.len()))];
            let (found, counts) = self.run(&program, emulator, plugin, &function);
            let expected = self.on_the_host(&source);
            if found != expected {
                println!("fixed point on {machine:?}: other bits than the host's\n{found}\n{expected}");
                agree = false;
            }
            let own = self.figures_of(&program, &function).get(&name).copied().unwrap_or_default();
            let figures = Figures { instructions: counts[0].1 / FEW_STATES, ..own };
            rows.push((format!("{}\tflash\t{name}, certified to {ERROR:e}", machine.row().name), figures));
        }
        (rows, agree)
    }

    fn fixed_source(&self, machine: TargetMachine, products: FixedProducts) -> String {
        let scene = scene_file::read(&Source::new("ranges.toml", RANGES), &mut Diagnostics::new());
        let options = Options {
            functions: vec![Function::InverseDynamics],
            scene: scene.expect("the ranges are sound").scene,
            fixed: Some(products),
            fixed_error: ERROR,
            ..self.options(ROBOT, machine, straightline_codegen::choices::Memory::Flash)
        };
        let generated = self.of_options(ROBOT, &options);
        let mut text = "#![allow(warnings)]\n#[path = \"STARTUP\"]\nmod startup;\n".to_string();
        writeln!(text, "pub mod {ROBOT} {{\n{}}}", generated.text).expect("a string takes text");
        text + &RUN.replace("ROBOT", ROBOT).replace("STATES", &FEW_STATES.to_string())
    }
}

/// Runs the function at random states of the ranges, and says a hash of its results.
const RUN: &str = "
#[inline(never)]
fn harness() {
    use ROBOT::fixed;
    let mut random = 7u64;
    let mut next = |least: f64, greatest: f64, bits: i32| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let unit = (random >> 40) as f64 / 16_777_216.0;
        fixed::to_fixed(least + (greatest - least) * unit, bits)
    };
    let mut hash = 0x811c_9dc5u32;
    for _ in 0..STATES {
        let (mut q, mut qd, mut qdd) = ([0; ROBOT::NQ], [0; ROBOT::NV], [0; ROBOT::NV]);
        for (i, q) in q.iter_mut().enumerate() {
            let (least, greatest) = (f64::from(ROBOT::LOWER_LIMITS[i]), f64::from(ROBOT::UPPER_LIMITS[i]));
            *q = next(least, greatest, fixed::INVERSE_DYNAMICS_Q_BITS);
        }
        qd.iter_mut().for_each(|x| *x = next(-2.5, 2.5, fixed::INVERSE_DYNAMICS_QD_BITS));
        qdd.iter_mut().for_each(|x| *x = next(-10.0, 10.0, fixed::INVERSE_DYNAMICS_QDD_BITS));
        let mut tau = [0; ROBOT::NV];
        core::hint::black_box::<fn(&_, &_, &_, &mut _)>(fixed::inverse_dynamics)(&q, &qd, &qdd, &mut tau);
        for byte in tau.iter().flat_map(|x: &i32| x.to_le_bytes()) {
            hash = (hash ^ u32::from(byte)).wrapping_mul(16_777_619);
        }
    }
    startup::say(\"ROBOT\", hash);
}
fn run() {
    harness();
}
";
