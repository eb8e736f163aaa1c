//! The robot as a whole: energy, centre of mass, momentum.

use super::spec::Extent::Of;
use super::spec::{Divisor, Output, RobotFunction, Spec};
use super::{Forms, Quantity};
use straightline_core::algorithms as alg;
use straightline_core::spatial::Vec3;
use straightline_core::Real;

pub struct Energy;

impl RobotFunction for Energy {
    const SPEC: Spec = Spec {
        name: "energy",
        summary: "Kinetic and potential energy of the moving bodies.",
        aliases: &["kinetic energy", "potential energy"],
        inputs: &[Quantity::Configuration, Quantity::Velocity],
        outputs: &[Output::new("tv", &[Of(2)], "kinetic energy T, potential energy V = −Σ m g·p \\[J\\]")],
        on_loops: true,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let (q, qd) = (&inputs[0], &inputs[1]);
        vec![alg::kinetic_energy(forms.model, q, qd), alg::potential_energy(forms.model, q)]
    }
}

pub struct CentreOfMass;

impl RobotFunction for CentreOfMass {
    const SPEC: Spec = Spec {
        name: "centre_of_mass",
        summary: "Centre of mass of the moving bodies.",
        aliases: &["COM", "center of mass", "centroid"],
        inputs: &[Quantity::Configuration],
        outputs: &[Output::new("p", &[Of(3)], "its position in the world \\[m\\]")],
        divisor: Divisor::Mass,
        on_loops: true,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        alg::momentum(forms.model, &inputs[0], &forms.rest()).com.to_array().to_vec()
    }
}

pub struct Momentum;

impl RobotFunction for Momentum {
    const SPEC: Spec = Spec {
        name: "momentum",
        summary: "Momentum of the moving bodies.",
        aliases: &["centroidal momentum"],
        inputs: &[Quantity::Configuration, Quantity::Velocity],
        outputs: &[Output::new(
            "p",
            &[Of(6)],
            "linear \\[kg·m/s\\] (3), angular about the centre of mass \\[kg·m²/s\\] (3), world axes",
        )],
        divisor: Divisor::Mass,
        on_loops: true,
        ..Spec::DEFAULT
    };

    fn evaluate<T: Real>(forms: &Forms<'_, T>, inputs: &[Vec<T>]) -> Vec<T> {
        let m = alg::momentum(forms.model, &inputs[0], &inputs[1]);
        [m.linear, m.angular].into_iter().flat_map(Vec3::to_array).collect()
    }
}
