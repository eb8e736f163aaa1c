//! What the model says of many states, by machine code.

use std::ops::Range;
use straightline_codegen::choices::OptimisationTier;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::options::Options;
use straightline_codegen::scene::Zero;
use straightline_codegen::Function;
use straightline_core::model::Model;
use straightline_graph::Scalar;
use straightline_jit::{BatchLayout, LoadError, LoadedFunction, Robot};
use straightline_logs::threads::processors;

/// Columns of numbers: one per coordinate, with a number per state.
pub type StateColumns = Vec<Vec<f64>>;

/// States that are computed at once.
const CHUNK: usize = 4096;

/// The functions of a robot that residuals take.
#[derive(Debug)]
pub struct TorqueModel {
    robot: Robot<f64>,
    /// The robot in its scene.
    pub model: Model<f64>,
}

/// What the observer of momentum takes beside inverse dynamics.
const OF_OBSERVER: [Function; 4] =
    [Function::BiasForce, Function::VelocityForce, Function::CoriolisTransposeForce, Function::MassMatrix];

impl TorqueModel {
    /// Reads a robot file, and makes the functions in a scene: of it count what the robot is and carries, not what is left out of functions.
    ///
    /// # Errors
    /// What the compiler says of file and scene.
    pub fn load(source: &Source, options: &Options) -> Result<TorqueModel, LoadError> {
        let functions = [&[Function::InverseDynamics], &OF_OBSERVER[..]].concat();
        let robot = Robot::load(source, &of_the_robot(options, functions))?;
        let model = robot.model().cast();
        Ok(TorqueModel { robot, model })
    }

    /// What the compiler has to say of the robot file.
    pub fn warnings(&self) -> &Diagnostics {
        self.robot.warnings()
    }

    /// Torques of a motion \[N·m or N\]: H q̈ + h.
    pub fn inverse_dynamics(&self, motion: [&StateColumns; 3]) -> StateColumns {
        self.over_states("inverse_dynamics", &motion, |_, found| found.to_vec())
    }

    /// The generalized momentum p = H q̇.
    pub fn momentum(&self, q: &StateColumns, qd: &StateColumns) -> StateColumns {
        let nv = self.model.nv();
        self.over_states("mass_matrix", &[q], |states, found| {
            let count = states.len();
            let mut p = vec![0.0; nv * count];
            for (i, p) in p.chunks_exact_mut(count).enumerate() {
                for (k, qd) in qd.iter().enumerate() {
                    let h = &found[(i * nv + k) * count..][..count];
                    p.iter_mut().zip(h.iter().zip(&qd[states.clone()])).for_each(|(p, (h, qd))| *p += h * qd);
                }
            }
            p
        })
    }

    /// f of ṗ = τ + f: Cᵀ q̇ − g − friction and springs.
    pub fn force_on_momentum(&self, q: &StateColumns, qd: &StateColumns) -> StateColumns {
        let of = |name: &str| self.over_states(name, &[q, qd], |_, found| found.to_vec());
        // h has C q̇, which Ḣ q̇ = C q̇ + Cᵀ q̇ takes away
        let (mut sum, velocity, bias) = (of("coriolis_transpose_force"), of("velocity_force"), of("bias_force"));
        for ((sum, velocity), bias) in sum.iter_mut().zip(&velocity).zip(&bias) {
            sum.iter_mut().zip(velocity.iter().zip(bias)).for_each(|(s, (v, b))| *s += v - b);
        }
        sum
    }

    /// Evaluates a function for all states by as many threads as there are processors; `shaped` makes columns of `nv` numbers per state, entry after
    /// entry, of what it finds for some states.
    fn over_states(
        &self,
        name: &str,
        inputs: &[&StateColumns],
        shaped: impl Fn(Range<usize>, &[f64]) -> Vec<f64> + Sync,
    ) -> StateColumns {
        let function = self.robot.function(name).expect("the robot was loaded with it");
        let states = inputs.first().and_then(|columns| columns.first()).map_or(0, Vec::len);
        let threads = processors();
        let each = states.div_ceil(threads).max(CHUNK);
        let part = |first: usize| {
            let mut columns = vec![Vec::with_capacity(each.min(states - first)); self.model.nv()];
            for start in (first..(first + each).min(states)).step_by(CHUNK) {
                let range = start..(start + CHUNK).min(first + each).min(states);
                let found = shaped(range.clone(), &evaluated(function, inputs, range.clone()));
                columns.iter_mut().zip(found.chunks_exact(range.len())).for_each(|(c, more)| c.extend_from_slice(more));
            }
            columns
        };
        let parts: Vec<StateColumns> = std::thread::scope(|scope| {
            let running: Vec<_> = (0..states).step_by(each).map(|first| scope.spawn(move || part(first))).collect();
            running.into_iter().map(|thread| thread.join().expect("threads of functions do not panic")).collect()
        });
        let mut columns = vec![Vec::with_capacity(states); self.model.nv()];
        for part in parts {
            columns.iter_mut().zip(part).for_each(|(column, more)| column.extend(more));
        }
        columns
    }
}

/// Options for functions of the whole robot: of a scene count what the robot is and carries, not what is left out of functions.
pub(crate) fn of_the_robot(options: &Options, functions: Vec<Function>) -> Options {
    let mut options = Options {
        optimise: OptimisationTier::Quick,
        functions,
        scalar: Scalar::F64,
        also: Vec::new(),
        fixed: None,
        ..options.clone()
    };
    options.scene.outputs.clear();
    options.scene.parameters.clear();
    options.scene.budgets.clear();
    options.scene.zero = Zero::default();
    options.scene.staged = false;
    options
}

/// The results of a function for some states, entry after entry.
pub(crate) fn evaluated(function: &LoadedFunction<f64>, inputs: &[&StateColumns], range: Range<usize>) -> Vec<f64> {
    let (count, layout) = (range.len(), BatchLayout::entries_of(range.len()));
    let gathered: Vec<Vec<f64>> = inputs
        .iter()
        .map(|columns| columns.iter().flat_map(|column| &column[range.clone()]).copied().collect())
        .collect();
    let inputs: Vec<(&[f64], BatchLayout)> = gathered.iter().map(|numbers| (&numbers[..], layout)).collect();
    let mut found = vec![0.0; count * function.outputs().iter().map(|port| port.len()).sum::<usize>()];
    function.batch(count, &inputs, &mut [(&mut found, layout)]).expect("as many coordinates as the robot has");
    found
}
