//! The reference data of `reference/derivatives/`: eight robots, eight states each, derivatives with 25 digits.
//!
//! An error is judged by the greatest entry of its block; of a block of zeros absolutely.

use crate::programs;
use crate::reference::{description, folder, inputs, json, numbers};
use serde_json::Value;
use std::path::PathBuf;
use straightline_codegen::options::Options;
use straightline_codegen::program::TracedProgram;
use straightline_codegen::{model, Function};
use straightline_core::Dd;

/// The robots of the data that stand on the ground.
pub const ARMS: &[&str] = &["planar2r", "chapter_cylindrical", "chapter_6r", "puma560", "ur5", "panda"];

/// Those whose root is free.
pub const LEGGED: &[&str] = &["solo12", "hyq"];

/// A robot with its states.
#[derive(Debug)]
pub struct DerivativeRobot {
    /// The stem of its files.
    pub name: String,
    /// Its description.
    pub file: PathBuf,
    /// Whether its root link is free.
    pub floating: bool,
    /// Its states.
    pub states: Vec<DerivativeState>,
    /// Displacements of a robot with a free root: of random length, small, tiny, none, near half a turn and beyond.
    pub displacements: Vec<DerivativeState>,
    /// That of the data on frames.
    frame: String,
    baseline: Value,
}

/// A state with all that is expected in it.
#[derive(Debug)]
pub struct DerivativeState {
    /// Such as `panda/7`.
    pub id: String,
    /// Such as `random` or `gravity_tilted`.
    pub kind: String,
    /// Acceleration due to gravity.
    pub gravity: [f64; 3],
    data: Value,
}

/// A block of results: its name in the data, and its values.
#[derive(Clone, Debug)]
pub struct ExpectedBlock {
    /// As in the data.
    pub name: &'static str,
    /// By rows.
    pub values: Vec<Dd>,
}

/// A function in the data: its group there, its inputs in order, its blocks in order with their names in Pinocchio's record.
struct DataOf {
    function: Function,
    group: &'static str,
    inputs: &'static [&'static str],
    blocks: &'static [(&'static str, &'static str)],
}

const HVP: &str = "hvp (f64 differences of analytic gradient)";

const DATA: &[DataOf] = &[
    DataOf {
        function: Function::InverseDynamicsDerivatives,
        group: "inverse_dynamics_derivatives",
        inputs: &["q", "qd", "qdd"],
        blocks: &[("dtau_dq", "dtau_dq"), ("dtau_dqd", "dtau_dqd"), ("H", "H"), ("tau", "tau")],
    },
    DataOf {
        function: Function::InverseDynamicsJvp,
        group: "inverse_dynamics_products",
        inputs: &["q", "qd", "qdd", "direction_q", "direction_qd", "direction_qdd"],
        blocks: &[("jvp", "jvp")],
    },
    DataOf {
        function: Function::InverseDynamicsVjp,
        group: "inverse_dynamics_products",
        inputs: &["q", "qd", "qdd", "multiplier"],
        blocks: &[("vjp_q", "vjp"), ("vjp_qd", "vjp"), ("vjp_qdd", "vjp")],
    },
    DataOf {
        function: Function::InverseDynamicsHvp,
        group: "inverse_dynamics_products",
        inputs: &["q", "qd", "qdd", "direction_q", "direction_qd", "direction_qdd", "multiplier"],
        blocks: &[("hvp_q", HVP), ("hvp_qd", HVP), ("hvp_qdd", HVP)],
    },
    DataOf {
        function: Function::ForwardDynamicsDerivatives,
        group: "forward_dynamics_derivatives",
        inputs: &["q", "qd", "tau"],
        blocks: &[("qdd", "qdd"), ("dqdd_dq", "dqdd_dq"), ("dqdd_dqd", "dqdd_dqd"), ("h_inverse", "h_inverse")],
    },
    DataOf {
        function: Function::GravityDerivative,
        group: "gravity_derivative",
        inputs: &["q"],
        blocks: &[("dg_dq", "dg_dq"), ("g", "tau")],
    },
    DataOf {
        function: Function::BiasDerivatives,
        group: "bias_derivatives",
        inputs: &["q", "qd"],
        blocks: &[("dh_dq", "dh_dq"), ("dh_dqd", "dh_dqd"), ("h", "tau")],
    },
    DataOf {
        function: Function::CoriolisTransposeForce,
        group: "coriolis",
        inputs: &["q", "qd"],
        blocks: &[("coriolis_transpose_force", "C^T qd")],
    },
    DataOf {
        function: Function::FrameDerivatives,
        group: "frame_derivatives",
        inputs: &["q", "qd", "qdd"],
        blocks: &[("dv_dq", "dv_dq"), ("da_dq", "da_dq"), ("da_dqd", "da_dqd"), ("dv_dqd", "J"), ("Jdot", "Jdot")],
    },
    DataOf {
        function: Function::JacobianHessianProduct,
        group: "jacobian_hessian_product",
        inputs: &["q", "wrench"],
        blocks: &[("JT_f", "J"), ("dJTf_dq", "dJTf_dq")],
    },
    DataOf {
        function: Function::CentreOfMassJacobian,
        group: "centroidal",
        inputs: &["q"],
        blocks: &[("com_jacobian", "com_jacobian")],
    },
    DataOf {
        function: Function::StepDerivatives,
        group: "step_derivatives",
        inputs: &["q", "qd", "tau", "dt"],
        blocks: &[("q_next", "step x+"), ("qd_next", "step x+"), ("A", "step A"), ("B", "step B")],
    },
    DataOf { function: Function::CentroidalMap, group: "centroidal", inputs: &["q"], blocks: &[("A", "A")] },
    DataOf {
        function: Function::CentroidalMapRate,
        group: "centroidal",
        inputs: &["q", "qd"],
        blocks: &[("A", "A"), ("Adot", "Adot")],
    },
    DataOf {
        function: Function::CentroidalDerivatives,
        group: "centroidal",
        inputs: &["q", "qd", "qdd"],
        blocks: &[
            ("h", "h_G"),
            ("hdot", "hdot_G"),
            ("dh_dq", "dhG_dq"),
            ("dhdot_dq", "dhdotG_dq"),
            ("dhdot_dqd", "dhdotG_dqd"),
            ("A", "A"),
        ],
    },
];

/// Those of displacements, which have cases of their own.
const OF_DISPLACEMENTS: &[DataOf] = &[
    DataOf {
        function: Function::Integrate,
        group: "integrate",
        inputs: &["q", "v"],
        blocks: &[("q_plus_v", "integrate")],
    },
    DataOf {
        function: Function::Difference,
        group: "integrate",
        inputs: &["q", "q1"],
        blocks: &[("difference", "difference")],
    },
    DataOf {
        function: Function::IntegrateDerivatives,
        group: "integrate",
        inputs: &["q", "v"],
        blocks: &[("dintegrate_dq", "dintegrate_dq"), ("dintegrate_dv", "dintegrate_dv")],
    },
    DataOf {
        function: Function::DifferenceDerivatives,
        group: "integrate",
        inputs: &["q", "q1"],
        blocks: &[("ddifference_dq0", "ddifference_dq0"), ("ddifference_dq1", "ddifference_dq1")],
    },
];

fn data_of(function: Function) -> &'static DataOf {
    DATA.iter().chain(OF_DISPLACEMENTS).find(|data| data.function == function).expect("the data hold the function")
}

/// The functions of displacements.
pub fn of_displacements() -> impl Iterator<Item = Function> {
    OF_DISPLACEMENTS.iter().map(|data| data.function)
}

/// The functions that the data hold of every state.
pub fn functions() -> impl Iterator<Item = Function> {
    DATA.iter().map(|data| data.function)
}

impl DerivativeRobot {
    /// The robot of that name with all its states.
    ///
    /// # Panics
    /// If the data are not what they are said to be.
    pub fn load(name: &str) -> DerivativeRobot {
        let folder = folder().join("derivatives");
        let file = json(&folder.join(format!("{name}.json")));
        let displacements = file["integrate"].as_array().into_iter().flatten().enumerate().map(|(k, case)| {
            let kind = case["kind"].as_str().expect("a string").to_string();
            DerivativeState {
                id: format!("{name}/displacement {k}"),
                kind,
                gravity: [0.0; 3],
                data: serde_json::json!({ "integrate": case }),
            }
        });
        let displacements = displacements.collect();
        let states = file["states"].as_array().expect("a list").iter().map(|data| {
            let text = |key: &str| data[key].as_str().expect("a string").to_string();
            let gravity = inputs(&data["gravity"]).try_into().expect("three numbers");
            DerivativeState { id: text("id"), kind: text("kind"), gravity, data: data.clone() }
        });
        DerivativeRobot {
            name: name.to_string(),
            file: description(name),
            floating: file["floating"].as_bool().expect("true or false"),
            states: states.collect(),
            displacements,
            frame: file["frame"].as_str().expect("a name").to_string(),
            baseline: json(&folder.join("baseline_pinocchio_derivatives.json"))["robots"][name].clone(),
        }
    }

    /// The program of a function.
    pub fn program(&self, function: Function, options: &Options) -> TracedProgram {
        let frames = if function.is_per_frame() { vec![self.frame.clone()] } else { Vec::new() };
        programs::program(&programs::load(&programs::file(&self.file), &options.model), &frames, function, options)
    }

    /// How it is compiled.
    pub fn options(&self) -> Options {
        let model = model::ModelOptions { floating_base: self.floating, ..model::ModelOptions::default() };
        Options { model, ..Options::default() }
    }

    /// What Pinocchio 4.1 loses of each block of a function, at most over these states.
    pub fn baseline(&self, function: Function) -> Vec<f64> {
        let of = |name: &str| self.baseline[name].as_f64().expect("the record has every block");
        data_of(function).blocks.iter().map(|(_, name)| of(name)).collect()
    }
}

impl DerivativeState {
    /// The inputs of a function.
    pub fn inputs(&self, function: Function) -> Vec<Vec<f64>> {
        let DataOf { inputs: names, group, .. } = data_of(function);
        let of = |name: &&str| self.data.get(*name).unwrap_or_else(|| &self.data[*group][*name]);
        names.iter().map(|name| inputs(of(name))).collect()
    }

    /// What the data have of the Coriolis matrix: C q̇, and Ḣ by rows.
    pub fn coriolis(&self) -> [ExpectedBlock; 2] {
        ["C_qd", "Hdot"].map(|name| ExpectedBlock { name, values: numbers(&self.data["coriolis"][name]) })
    }

    /// Its blocks, each with the results of a function that belong to it.
    ///
    /// # Panics
    /// If there are not as many results.
    pub fn blocks<'r, T>(&self, function: Function, mut results: &'r [T]) -> Vec<(ExpectedBlock, &'r [T])> {
        let DataOf { group, blocks, .. } = data_of(function);
        let mut all = Vec::new();
        for (name, _) in *blocks {
            let expected = ExpectedBlock { name, values: numbers(&self.data[*group][*name]) };
            let (own, others) = results.split_at(expected.values.len());
            results = others;
            all.push((expected, own));
        }
        assert!(results.is_empty(), "{}: more results than the data have", function.name());
        all
    }
}

impl ExpectedBlock {
    /// The greatest error over the greatest entry.
    pub fn error<T: Copy + Into<Dd>>(&self, results: &[T]) -> f64 {
        assert_eq!(results.len(), self.values.len(), "{}", self.name);
        let greatest = self.values.iter().map(|x| x.to_f64().abs()).fold(0.0, f64::max);
        let off = |(a, b): (&T, &Dd)| ((*a).into() - *b).to_f64().abs();
        // what is no number is as wrong as can be
        let worst = results.iter().zip(&self.values).map(off).fold(0.0, |m: f64, x| if x <= m { m } else { x });
        let worst = if worst.is_nan() { f64::INFINITY } else { worst };
        if greatest > 0.0 {
            worst / greatest
        } else {
            worst
        }
    }
}
