//! What closed loops determine: the coordinates, velocities and accelerations of dependent joints.

use super::spec::Extent::{Dependents, LoopEquations, Positions, Velocities};
use super::spec::{Family, Output, RobotFunction, Spec};
use super::{Forms, Quantity};
use straightline_core::Real;

/// So many steps of Newton's method close loops without a closed form: from 0.1 rad away the fourth leaves rounding, and the fifth is for those that begin
/// further away.
const NEWTON_STEPS: usize = 5;

const OF_LOOPS: Spec = Spec { family: Family::Loops, on_loops: true, ..Spec::DEFAULT };

pub struct CloseLoops;

impl RobotFunction for CloseLoops {
    const SPEC: Spec = Spec {
        name: "close_loops",
        summary: "Closes the loops: moves the dependent joints of q in the assembly in which they stand, in closed form or in five steps of Newton's method, and says how far the loops stay open.",
        aliases: &["loop closure", "constraint projection", "assembly"],
        inputs: &[Quantity::Configuration],
        outputs: &[
            Output::new("q_closed", &[Positions], "q with the independent joints where they were \\[rad or m\\]"),
            Output::new("gap", &[LoopEquations], "how far the points of each loop are apart, along its directions \\[m\\], and how far hinges and welds lean \\[1\\]"),
        ],
        ..OF_LOOPS
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let (q, gap) = forms.model.assemble_loops(&inputs[0], NEWTON_STEPS);
        [q, gap].concat()
    }
}

pub struct LoopJacobian;

impl RobotFunction for LoopJacobian {
    const SPEC: Spec = Spec {
        name: "loop_jacobian",
        summary: "How fast the dependent joints move with the independent ones: G of q̇_d = G q̇.",
        aliases: &["constraint embedding", "loop closure Jacobian", "influence coefficients"],
        inputs: &[Quantity::Configuration],
        outputs: &[Output::new(
            "g",
            &[Dependents, Velocities],
            "rows of G, by dependent velocity \\[1, m/rad or rad/m\\]",
        )],
        ..OF_LOOPS
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        forms.model.embedding(&forms.model.tree_positions(&inputs[0])).concat()
    }
}

pub struct LoopMotion;

impl RobotFunction for LoopMotion {
    const SPEC: Spec = Spec {
        name: "loop_motion",
        summary: "Velocities and accelerations of the dependent joints: G q̇ and G q̈ + Ġ q̇.",
        aliases: &["loop closure velocities", "loop closure accelerations"],
        inputs: &[Quantity::Configuration, Quantity::Velocity, Quantity::Acceleration],
        outputs: &[
            Output::new("qd_dependent", &[Dependents], "velocities \\[rad/s or m/s\\]"),
            Output::new("qdd_dependent", &[Dependents], "accelerations \\[rad/s² or m/s²\\]"),
        ],
        ..OF_LOOPS
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let model = forms.model;
        let [_, yd, ydd] = model.tree_motion([&inputs[0], &inputs[1], &inputs[2]]);
        let dependent = model.nv()..model.open_nv();
        [&yd[dependent.clone()], &ydd[dependent]].concat()
    }
}
