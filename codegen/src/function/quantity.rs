//! What functions take: one row per quantity, with its name in generated code, its length and what is said of it.

use super::spec::Extent;
use straightline_core::algorithms::MOST_DERIVATIVES;
use straightline_core::model::Model;
use straightline_core::Real;
use straightline_graph::expr::Port;

/// A quantity that functions take.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// The configuration q.
    Configuration,
    /// The velocities q̇.
    Velocity,
    /// The accelerations q̈.
    Acceleration,
    /// The generalized forces τ.
    Force,
    /// The state of the drives.
    DriveState,
    /// The inputs of the drives.
    DriveInput,
    /// The acceleration due to gravity, where a scene makes it an input.
    Gravity,
    /// A direction in which q moves, of its tangent.
    ConfigurationDirection,
    /// A direction of q̇.
    VelocityDirection,
    /// A direction of q̈.
    AccelerationDirection,
    /// A direction of τ.
    ForceDirection,
    /// Multipliers of generalized forces, or of accelerations.
    Multiplier,
    /// Forces and moments at frames.
    Wrench,
    /// How far frames are from where they shall be.
    PoseError,
    /// How much the rows of a task weigh.
    TaskWeight,
    /// The damping of a task.
    Damping,
    /// How strongly redundancy is spent on torques.
    TorqueGain,
    /// A displacement of q, of its tangent.
    Displacement,
    /// Another configuration.
    SecondConfiguration,
    /// The length of a step of time.
    TimeStep,
    /// The parameters of links and joints, as a robot file has them.
    LinkParameters,
    /// The third or a further derivative of q.
    HigherRate(usize),
}

use Quantity::*;

/// What is known of a quantity.
struct QuantityRow {
    of: Quantity,
    /// Its name in generated code.
    name: &'static str,
    /// Its axes, the outermost first.
    axes: &'static [Extent],
    /// What it is, with its unit.
    doc: &'static str,
    /// Within what it is taken to stay where nobody says: of bounds of errors alone.
    bound: Option<f64>,
    /// Within what programs are tried.
    tried: (f64, f64),
}

/// Programs are tried with weights as generalized forces; other quantities that are not said otherwise are drawn alike.
const TRIED: (f64, f64) = (-10.0, 10.0);

const fn row(
    of: Quantity,
    name: &'static str,
    axes: &'static [Extent],
    bound: Option<f64>,
    doc: &'static str,
) -> QuantityRow {
    QuantityRow { of, name, axes, doc, bound, tried: TRIED }
}

impl QuantityRow {
    const fn tried(self, least: f64, most: f64) -> QuantityRow {
        QuantityRow { tried: (least, most), ..self }
    }
}

const BY_VELOCITIES: &[Extent] = &[Extent::Velocities];
const PER_FRAME: &[Extent] = &[Extent::Frames, Extent::Of(6)];
const ONE: &[Extent] = &[Extent::Of(1)];

const TABLE: &[QuantityRow] = &[
    row(Configuration, "q", &[Extent::Positions], None, "configuration \\[rad or m\\]"),
    row(Velocity, "qd", BY_VELOCITIES, Some(10.0), "velocities \\[rad/s or m/s\\]").tried(-1.0, 1.0),
    row(Acceleration, "qdd", BY_VELOCITIES, Some(100.0), "accelerations \\[rad/s² or m/s²\\]"),
    row(Force, "tau", BY_VELOCITIES, Some(1000.0), "generalized forces \\[N·m or N\\]"),
    row(
        DriveState,
        "x",
        &[Extent::DriveStates],
        None,
        "state of the drives, [`DRIVE_STATES`] of each: θ \\[rad\\], θ̇ \\[rad/s\\] and current \\[A\\] of a motor (without \
         inductance no current; θ and θ̇ are read behind elastic transmissions only), a linear actuator's own; then angle \
         and speed of shafts between elastic stages",
    ),
    row(
        DriveInput,
        "u",
        &[Extent::Drives],
        None,
        "inputs of the drives, in the order of [`DRIVE_NAMES`] \\[V, or as in the robot file\\]",
    ),
    row(
        ConfigurationDirection,
        "direction_q",
        BY_VELOCITIES,
        Some(1.0),
        "direction of q, along its tangent \\[rad or m\\]",
    ),
    row(VelocityDirection, "direction_qd", BY_VELOCITIES, Some(1.0), "direction of q̇ \\[rad/s or m/s\\]"),
    row(AccelerationDirection, "direction_qdd", BY_VELOCITIES, Some(1.0), "direction of q̈ \\[rad/s² or m/s²\\]"),
    row(ForceDirection, "direction_tau", BY_VELOCITIES, Some(1.0), "direction of τ \\[N·m or N\\]"),
    row(Multiplier, "multiplier", BY_VELOCITIES, Some(1.0), "λ: multipliers of the generalized forces or accelerations"),
    row(Gravity, "gravity", &[Extent::Of(3)], Some(10.0), "acceleration due to gravity in the world \\[m/s²\\]"),
    row(
        Wrench,
        "wrench",
        PER_FRAME,
        Some(100.0),
        "per frame: force at its origin \\[N\\] (3), moment \\[N·m\\] (3), world axes",
    ),
    row(
        PoseError,
        "pose_error",
        PER_FRAME,
        Some(1.0),
        "per frame: from where it is to where it shall be, of the origin \\[m\\] (3), and the rotation vector \\[rad\\] (3), world axes",
    )
    .tried(-0.3, 0.3),
    row(
        TaskWeight,
        "row_weight",
        PER_FRAME,
        Some(1.0),
        "per frame: how much each row of the error weighs; a row with 0 is left to itself",
    )
    .tried(0.5, 1.0),
    row(
        Damping,
        "task_damping",
        ONE,
        Some(1.0),
        "λ: λ² is added to the diagonal of J H⁻¹ Jᵀ \\[1/kg; 1/(kg·m²)\\]; 0: none",
    )
    .tried(0.1, 0.2),
    row(
        TorqueGain,
        "torque_gain",
        ONE,
        Some(1.0),
        "how far the step follows the descent of holding torques where the task leaves freedom; 0: not at all",
    )
    .tried(0.5, 1.0),
    row(
        Displacement,
        "v",
        BY_VELOCITIES,
        Some(1.0),
        "displacement of q, of its tangent \\[rad or m\\]; of a floating base a body twist, linear and angular",
    ),
    row(SecondConfiguration, "q1", &[Extent::Positions], None, "another configuration \\[rad or m\\]"),
    row(TimeStep, "dt", ONE, Some(0.01), "length of the step \\[s\\]").tried(-0.01, 0.01),
    row(
        LinkParameters,
        "link_parameters",
        &[Extent::LinkParameters],
        Some(10.0),
        "m \\[kg\\], m c (3) \\[kg·m\\], I about the link's origin (xx, xy, xz, yy, yz, zz) \\[kg·m²\\] of the link behind every joint with what is \
         fixed to it, in the axes of the link and the order of [`JOINT_NAMES`]; then what a scene adds of joints, kind by kind",
    ),
];

impl Quantity {
    /// The quantity of that name; `None` of a scene's parameters, of contacts and of the stored values of stages.
    pub fn named(name: &str) -> Option<Quantity> {
        let rate = || {
            let order = name.strip_prefix('q')?.parse().ok()?;
            let rate = HigherRate(order);
            (name == rate.name() && (3..=MOST_DERIVATIVES + 2).contains(&order)).then_some(rate)
        };
        TABLE.iter().find(|row| row.name == name).map(|row| row.of).or_else(rate)
    }

    /// Those that have an entry per velocity coordinate, but for higher rates.
    pub fn of_velocities() -> impl Iterator<Item = Quantity> {
        TABLE.iter().filter(|row| row.axes == BY_VELOCITIES).map(|row| row.of)
    }

    /// The configurations.
    pub fn of_positions() -> impl Iterator<Item = Quantity> {
        TABLE.iter().filter(|row| row.axes == [Extent::Positions]).map(|row| row.of)
    }

    /// Whether it is a configuration.
    pub fn is_configuration(self) -> bool {
        self.axes() == [Extent::Positions]
    }

    /// That of an input.
    pub fn of(port: &Port) -> Option<Quantity> {
        Quantity::named(&port.name)
    }

    fn row(self) -> Option<&'static QuantityRow> {
        TABLE.iter().find(|row| row.of == self)
    }

    /// Its name in generated code: `q`, `qd`, …, `q3` of the third derivative.
    pub fn name(self) -> String {
        match self {
            HigherRate(order) => format!("q{order}"),
            _ => self.row().expect("the table has every other quantity").name.to_string(),
        }
    }

    /// What it is, with its unit.
    pub fn doc(self) -> String {
        const WORDS: [&str; 7] = ["third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth"];
        let HigherRate(order) = self else {
            return self.row().expect("the table has every other quantity").doc.to_string();
        };
        let word = WORDS.get(order - 3).map_or_else(|| format!("{order}th"), |word| word.to_string());
        let digit =
            |d: char| d.to_digit(10).map_or(d, |d| ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][d as usize]);
        let power: String = order.to_string().chars().map(digit).collect();
        format!("{word} derivatives \\[rad/s{power} or m/s{power}\\]")
    }

    /// Those that say what is asked of frames.
    pub fn of_tasks() -> impl Iterator<Item = Quantity> {
        TABLE.iter().filter(|row| row.axes == PER_FRAME || matches!(row.of, Damping | TorqueGain)).map(|row| row.of)
    }

    /// Its axes, the outermost first.
    pub fn axes(self) -> &'static [Extent] {
        self.row().map_or(BY_VELOCITIES, |row| row.axes)
    }

    /// Within what bounds of errors take it to stay where neither a scene nor the robot file says; none: they have to.
    pub fn default_bound(self) -> Option<f64> {
        self.row().and_then(|row| row.bound)
    }

    /// Within what programs are tried, unless the robot says more.
    pub fn tried(self) -> (f64, f64) {
        self.row().map_or(TRIED, |row| row.tried)
    }

    /// How many scalars it has, for so many frames.
    pub fn len<T: Real>(self, model: &Model<T>, frames: usize) -> usize {
        self.axes().iter().map(|extent| extent.len(model, frames)).product()
    }

    /// As an input, for so many frames.
    pub fn port<T: Real>(self, model: &Model<T>, frames: usize) -> Port {
        let shape: Vec<usize> = self.axes().iter().map(|extent| extent.len(model, frames)).collect();
        Port::new(&self.name(), &shape)
    }

    /// Whether many of it are asked about at one motion: directions and multipliers.
    pub fn is_of_call(self) -> bool {
        matches!(self, ConfigurationDirection | VelocityDirection | AccelerationDirection | ForceDirection | Multiplier)
    }

    /// Which derivative of q it is; `None` if it is none, or q itself.
    pub fn rate(self) -> Option<usize> {
        match self {
            Velocity => Some(1),
            Acceleration => Some(2),
            HigherRate(order) => Some(order),
            _ => None,
        }
    }
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    pub fn every_quantity_is_found_by_its_name() {
        for quantity in TABLE.iter().map(|row| row.of).chain([HigherRate(3), HigherRate(MOST_DERIVATIVES + 2)]) {
            assert_eq!(Quantity::named(&quantity.name()), Some(quantity));
        }
        for name in ["q2", "q03", "q", "payload", "", &format!("q{}", MOST_DERIVATIVES + 3)] {
            assert!(Quantity::named(name).is_none_or(|q| q == Configuration), "{name}");
        }
        assert_eq!(HigherRate(12).doc(), "12th derivatives \\[rad/s¹² or m/s¹²\\]");
    }
}
