//! The numbers of drives that can be set by name, and which values they may have.

use super::{WrittenActuator, WrittenDrive};

/// What a number of drives is.
#[derive(Debug, PartialEq, Eq)]
pub struct NumberKind {
    /// Its name, of stages without the number of the stage.
    pub name: &'static str,
    /// What it means, with its unit.
    pub meaning: &'static str,
    /// Which values files and sweeps may give it.
    pub must: Must,
    /// Which values it may have at run time, where the equations keep their form.
    pub at_run_time: Must,
}

macro_rules! quantities {
    ($($constant:ident: $name:literal, $meaning:literal, $must:ident, $at_run_time:ident;)*) => {
        $(pub(super) const $constant: &NumberKind =
            &NumberKind { name: $name, meaning: $meaning, must: Must::$must, at_run_time: Must::$at_run_time };)*

        /// Everything that can be set by name.
        pub const QUANTITIES: &[&NumberKind] = &[$($constant),*];
    };
}

quantities! {
    RATIO: "ratio", "speed of the shaft over speed of the joint, or before the gear over behind it \\[1 or rad/m\\]", NotBeZero, NotBeZero;
    TORQUE_CONSTANT: "torque_constant", "C_M \\[N·m/A\\]", BePositive, BePositive;
    EMF_CONSTANT: "emf_constant", "C_E \\[V·s/rad\\]", NotBeNegative, NotBeNegative;
    RESISTANCE: "resistance", "R \\[Ω\\]", BePositive, BePositive;
    INDUCTANCE: "inductance", "L \\[H\\]", BePositive, BePositive;
    ROTOR_INERTIA: "rotor_inertia", "J of the motor about its axis \\[kg·m²\\]", BePositive, BePositive;
    MOTOR_FRICTION: "motor_friction", "B, viscous \\[N·m·s/rad\\]", NotBeNegative, NotBeNegative;
    STIFFNESS: "stiffness", "c of the spring behind the gear \\[N·m/rad\\]", BePositive, BePositive;
    STAGE_DAMPING: "damping", "d of the spring behind the gear \\[N·m·s/rad\\]", NotBeNegative, BePositive;
    INPUT_INERTIA: "input_inertia", "I′ of the gear \\[kg·m²\\]", NotBeNegative, BePositive;
    OUTPUT_INERTIA: "output_inertia", "I″ of the gear \\[kg·m²\\]", NotBeNegative, BePositive;
    EFFICIENCY: "efficiency", "η of the gear in both directions \\[1\\]", BeAnEfficiency, BeAnEfficiency;
    EFFICIENCY_FORWARD: "efficiency_forward", "η′ of the gear while it drives \\[1\\]", BeAnEfficiency, BeAnEfficiency;
    EFFICIENCY_BACKWARD: "efficiency_backward", "η″ of the gear while it is driven \\[1\\]", BeAnEfficiency, BeAnEfficiency;
    INPUT_LIMIT: "input_limit", "greatest \\|u\\| \\[V, or the unit of u\\]", BePositive, BePositive;
    CURRENT_LIMIT: "current_limit", "greatest current \\[A\\]", BePositive, BePositive;
}

/// A number of a drive that can be set by name.
#[derive(Clone, Debug, PartialEq)]
pub struct DriveNumber {
    /// Its name: `ratio`, `stage_2_stiffness`.
    pub name: String,
    /// What it is.
    pub quantity: &'static NumberKind,
    /// Its value.
    pub value: f64,
    /// Where it stands among the drive's numbers, then those that follow it unless they are set by a name of their own.
    pub(super) at: Vec<usize>,
}

impl DriveNumber {
    /// Whether it is a limit, which no equation has beside saturation.
    pub fn is_limit(&self) -> bool {
        [INPUT_LIMIT, CURRENT_LIMIT].contains(&self.quantity)
    }

    /// Whether it is another's, by whatever name.
    pub fn is(&self, other: &DriveNumber) -> bool {
        self.at[0] == other.at[0]
    }
}

impl<T> WrittenDrive<T> {
    /// All numbers in their order, each with the stage that it is of.
    pub(super) fn flat(&mut self) -> Vec<(&'static NumberKind, Option<usize>, &mut T)> {
        let mut all: Vec<(&'static NumberKind, Option<usize>, &mut T)> = Vec::new();
        if let WrittenActuator::Motor {
            torque_constant,
            emf_constant,
            resistance,
            inductance,
            rotor_inertia,
            friction,
        } = &mut self.actuator
        {
            all.extend([
                (TORQUE_CONSTANT, None, torque_constant),
                (EMF_CONSTANT, None, emf_constant),
                (RESISTANCE, None, resistance),
                (ROTOR_INERTIA, None, rotor_inertia),
                (MOTOR_FRICTION, None, friction),
            ]);
            all.extend(inductance.as_mut().map(|x| (INDUCTANCE, None, x)));
        }
        for (k, stage) in self.stages.iter_mut().enumerate() {
            let of = Some(k);
            all.push((RATIO, of, &mut stage.ratio.value));
            all.extend(stage.stiffness.as_mut().map(|x| (STIFFNESS, of, x)));
            all.extend(stage.damping.as_mut().map(|x| (STAGE_DAMPING, of, x)));
            all.push((INPUT_INERTIA, of, &mut stage.input_inertia));
            all.push((OUTPUT_INERTIA, of, &mut stage.output_inertia));
            for [forward, backward] in stage.efficiency.iter_mut().map(|both| both.each_mut()) {
                all.extend([(EFFICIENCY_FORWARD, of, forward), (EFFICIENCY_BACKWARD, of, backward)]);
            }
        }
        for [forward, backward] in self.efficiency.iter_mut().map(|both| both.each_mut()) {
            all.extend([(EFFICIENCY_FORWARD, None, forward), (EFFICIENCY_BACKWARD, None, backward)]);
        }
        all.extend(self.input_limit.as_mut().map(|x| (INPUT_LIMIT, None, x)));
        all.extend(self.current_limit.as_mut().map(|x| (CURRENT_LIMIT, None, x)));
        // what has no name of its own, or not always
        all.extend(self.rotor.as_mut().map(|(_, _, inertia)| (ROTOR_INERTIA, None, inertia)));
        all.extend(self.joints.iter_mut().map(|(_, ratio)| (RATIO, None, ratio)));
        all
    }
}

/// Which numbers a key takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Must {
    /// Above zero.
    BePositive,
    /// Zero or above.
    NotBeNegative,
    /// Not zero.
    NotBeZero,
    /// Above zero, at most one.
    BeAnEfficiency,
}

impl Must {
    /// Whether a number is of them.
    pub fn holds(self, x: f64) -> bool {
        match self {
            Must::BePositive => x > 0.0,
            Must::NotBeNegative => x >= 0.0,
            Must::NotBeZero => x != 0.0,
            Must::BeAnEfficiency => x > 0.0 && x <= 1.0,
        }
    }

    /// The same as comparisons of a number that is finite, all of which must hold: how, and with what.
    pub fn comparisons(self) -> &'static [(&'static str, f64)] {
        match self {
            Must::BePositive => &[(">", 0.0)],
            Must::NotBeNegative => &[(">=", 0.0)],
            Must::NotBeZero => &[("!=", 0.0)],
            Must::BeAnEfficiency => &[(">", 0.0), ("<=", 1.0)],
        }
    }

    /// What a number must be, and what to write otherwise.
    pub fn words(self) -> (&'static str, &'static str) {
        match self {
            Must::BePositive => ("positive", "leave the key out where the effect is to be neglected, if it may be"),
            Must::NotBeNegative => ("zero or positive", "write its modulus"),
            Must::NotBeZero => ("not zero", "a direct connection has the ratio 1; a reversing one a negative ratio"),
            Must::BeAnEfficiency => ("above 0 and at most 1", "write 80 % as `0.8`; 1 is a gear without losses"),
        }
    }
}
