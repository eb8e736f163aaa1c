//! The equations of motion of a simulated robot, by machine code with the bits of the generic runtime.

use std::sync::{Arc, OnceLock};
use straightline_codegen::equations::Robot;
use straightline_codegen::options::Options;
use straightline_codegen::program::checked;
use straightline_codegen::{ForwardDynamicsMethod, Function};
use straightline_core::model::Model;
use straightline_core::Dd;
use straightline_graph::expr::Grade;
use straightline_jit::LoadedFunction;
use straightline_simulation::plant::{MotionEquations, Plant};

/// Machine code of the equations of a model, each made when it is first asked for.
#[derive(Debug)]
struct CompiledEquations {
    model: Model<f64>,
    forward_dynamics: OnceLock<Option<LoadedFunction<f64>>>,
    bias_force: OnceLock<Option<LoadedFunction<f64>>>,
    mass_matrix: OnceLock<Option<LoadedFunction<f64>>>,
}

/// The same plant, whose motion machine code computes: the same bits, but for the payloads of NaN.
#[must_use]
pub fn by_machine_code(plant: Plant) -> Plant {
    let equations = CompiledEquations {
        model: plant.model.clone(),
        forward_dynamics: OnceLock::new(),
        bias_force: OnceLock::new(),
        mass_matrix: OnceLock::new(),
    };
    plant.moved_by(Arc::new(equations))
}

impl CompiledEquations {
    /// The function with exact rules; none where the compiler finds no program with the bits of the generic runtime.
    fn made(&self, function: Function) -> Option<LoadedFunction<f64>> {
        let model: Model<Dd> = self.model.map(Dd::from);
        if !function.is_of(&model) {
            return None;
        }
        let options = Options {
            functions: vec![function],
            grade: Grade::Exact,
            forward_dynamics: ForwardDynamicsMethod::ArticulatedBody,
            ..Options::default()
        };
        let program = checked(&Robot::new(model), &[], function, &options).ok()?;
        Some(LoadedFunction::of_graph(function.name(), &program.graph))
    }

    fn results(
        &self,
        (function, made): (Function, &OnceLock<Option<LoadedFunction<f64>>>),
        inputs: &[&[f64]],
    ) -> Option<Vec<f64>> {
        made.get_or_init(|| self.made(function)).as_ref()?.results(inputs).ok()
    }
}

impl MotionEquations for CompiledEquations {
    fn forward_dynamics(&self, q: &[f64], qd: &[f64], tau: &[f64]) -> Vec<f64> {
        let function = (Function::ForwardDynamics, &self.forward_dynamics);
        self.results(function, &[q, qd, tau]).unwrap_or_else(|| self.model.forward_dynamics(q, qd, tau))
    }

    fn bias_force(&self, q: &[f64], qd: &[f64]) -> Vec<f64> {
        let function = (Function::BiasForce, &self.bias_force);
        self.results(function, &[q, qd]).unwrap_or_else(|| MotionEquations::bias_force(&self.model, q, qd))
    }

    fn mass_matrix(&self, q: &[f64]) -> Vec<f64> {
        let function = (Function::MassMatrix, &self.mass_matrix);
        self.results(function, &[q]).unwrap_or_else(|| MotionEquations::mass_matrix(&self.model, q))
    }
}
