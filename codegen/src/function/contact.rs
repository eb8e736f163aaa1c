//! The functions of a robot in contact: a row each ([`ContactSpec`]). Their equations stand in `program/contact`, as they need a mode of the scene.

use super::{Divisor, Extent, Function, Judged};

/// What an axis of an array of a contact mode counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactExtent {
    /// Something of the robot, without frames.
    Robot(Extent),
    /// The constrained coordinates of the mode.
    Constrained,
    /// Its free coordinates.
    Free,
    /// The masses that are struck.
    Masses,
}

/// How often a mode has an input or a block of results.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PerContact {
    /// Once.
    No,
    /// For each contact whose object has a coordinate of its own.
    WithOwnCoordinate,
    /// For each contact with a mass that is struck.
    WithMass,
}

/// An input that a function takes beside the robot's, or a block of results.
#[derive(Clone, Copy, Debug)]
pub struct ContactPort {
    /// Its name in generated code; `{}` stands for that of the contact.
    pub name: &'static str,
    /// What it is, with its unit.
    pub doc: &'static str,
    /// Its axes, the outermost first.
    pub axes: &'static [ContactExtent],
    /// How often a mode has it.
    pub per: PerContact,
}

impl ContactPort {
    const fn new(name: &'static str, axes: &'static [ContactExtent], doc: &'static str) -> ContactPort {
        ContactPort { name, doc, axes, per: PerContact::No }
    }

    const fn per(self, per: PerContact) -> ContactPort {
        ContactPort { per, ..self }
    }

    /// Its name for a contact.
    pub fn name_for(&self, contact: &str) -> String {
        self.name.replace("{}", contact)
    }
}

/// Which modes have a function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InModes {
    /// All.
    All,
    /// Those with free coordinates.
    WithFreeCoordinates,
    /// Those of robots with drives.
    OfDrivenRobots,
}

/// Everything about a function of contact modes but its equations.
#[derive(Clone, Copy, Debug)]
pub struct ContactSpec {
    /// Its name in generated code and in scene files.
    pub name: &'static str,
    /// What it computes, in sentences.
    pub summary: &'static str,
    /// The function of the robot whose inputs it has.
    pub base: Function,
    /// What it takes beside those and what contacts bring.
    pub inputs: &'static [ContactPort],
    /// Its results.
    pub outputs: &'static [ContactPort],
    /// Which modes have it.
    pub modes: InModes,
    /// Whether it is made for who names it only.
    pub is_by_name: bool,
    /// The function whose form of the robot serves it. With that of forward dynamics the contacts' frames move by the recursion of bias forces; with another one in
    /// world axes, where derivatives of motions stand.
    pub form: Function,
    /// What it divides by.
    pub divisor: Divisor,
    /// What bounds of its errors go by.
    pub judged: Judged,
}

use ContactExtent::{Constrained, Free, Masses, Robot};
use PerContact::{WithMass, WithOwnCoordinate};

const VELOCITIES: ContactExtent = Robot(Extent::Velocities);
const STATES: ContactExtent = Robot(Extent::DriveStates);
const INPUTS: ContactExtent = Robot(Extent::Drives);
const ONE: &[ContactExtent] = &[Robot(Extent::Of(1))];
const TWO: &[ContactExtent] = &[Robot(Extent::Of(2))];
const TWO_ROWS: &[ContactExtent] = &[Robot(Extent::Of(2)), VELOCITIES];
const SQUARE: &[ContactExtent] = &[VELOCITIES, VELOCITIES];
const ROWS: &[ContactExtent] = &[Constrained, VELOCITIES];

const QDD: ContactPort = ContactPort::new("qdd", &[VELOCITIES], "accelerations \\[rad/s² or m/s²\\]");
const FORCE: ContactPort =
    ContactPort::new("force", &[Constrained], "reactions F along s^c \\[N, or N·m of an axis\\]");
const SDD: ContactPort = ContactPort::new("sdd", &[Constrained], "s̈^c \\[m/s² or 1/s²\\]");
const VIOLATION: ContactPort =
    ContactPort::new("violation", &[Constrained], "s̈^c less what it should be; zero where the object gives way");
const PIVOT: ContactPort = ContactPort::new(
    "pivot",
    ONE,
    "least pivot against its diagonal entry: 1 for independent constraints, about 1e-12 for redundant ones",
);
const OWN: ContactPort =
    ContactPort::new("{}_own", TWO, "the object's own coordinate and its rate \\[m, m/s\\]").per(WithOwnCoordinate);
const OWN_RATE: ContactPort =
    ContactPort::new("{}_own_rate", TWO, "their rates \\[m/s, m/s²\\]").per(WithOwnCoordinate);
const STRUCK: ContactPort =
    ContactPort::new("{}_struck", ONE, "velocity of the struck mass along pz before \\[m/s\\]").per(WithMass);
const STRUCK_AFTER: ContactPort =
    ContactPort::new("{}_struck_after", ONE, "its velocity after \\[m/s\\]").per(WithMass);
const RESTITUTION: ContactPort =
    ContactPort::new("restitution", ONE, "coefficient of restitution: 0 plastic, 1 elastic");
const IMPULSE: ContactPort = ContactPort::new("impulse", &[Constrained], "impulses F Δt along s^c \\[N·s or N·m·s\\]");
const COORDINATES: [ContactPort; 2] = [
    ContactPort::new("s", &[Constrained], "coordinates \\[m, or cosine\\]"),
    ContactPort::new("sd", &[Constrained], "their rates \\[m/s or 1/s\\]"),
];
const XD: ContactPort = ContactPort::new("xd", &[STATES], "derivative of the drives' state, in the order of x");
const DQDD_DOWN: ContactPort = ContactPort::new(
    "dqdd_d{}_own",
    &[VELOCITIES, Robot(Extent::Of(2))],
    "rows of ∂q̈ by the object's own coordinate and its rate",
)
.per(WithOwnCoordinate);
const DFORCE_DOWN: ContactPort =
    ContactPort::new("dforce_d{}_own", &[Constrained, Robot(Extent::Of(2))], "rows of ∂F by them \\[N/m, N·s/m\\]")
        .per(WithOwnCoordinate);
const DOWN_RATE: [ContactPort; 3] = [
    ContactPort::new("d{}_own_rate_dq", TWO_ROWS, "rows of the derivatives of their rates by q").per(WithOwnCoordinate),
    ContactPort::new("d{}_own_rate_dqd", TWO_ROWS, "the same by q̇").per(WithOwnCoordinate),
    ContactPort::new(
        "d{}_own_rate_down",
        &[Robot(Extent::Of(2)), Robot(Extent::Of(2))],
        "the same by the coordinate and its rate themselves",
    )
    .per(WithOwnCoordinate),
];
const ADJOINT: &str = "adjoint vector A \\[m/s² or 1/s²\\]";
const JACOBIAN: &str = "Jacobian, a row per coordinate";

/// What most functions are, to be completed.
const DEFAULT: ContactSpec = ContactSpec {
    name: "",
    summary: "",
    base: Function::BiasForce,
    inputs: &[],
    outputs: &[],
    modes: InModes::All,
    is_by_name: false,
    form: Function::ForwardDynamics,
    divisor: Divisor::Nothing,
    judged: Judged::ByScale,
};

/// The one list: a variant with its documentation and its row.
macro_rules! contact_functions {
    ($($(#[$doc:meta])* $name:ident: $spec:expr,)*) => {
        /// A function of a contact mode.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum ContactFunction {
            $($(#[$doc])* $name,)*
        }

        impl ContactFunction {
            /// All of them, in the order in which they stand in generated files.
            pub const ALL: &'static [ContactFunction] = &[$(ContactFunction::$name),*];

            /// Everything about it but its equations.
            pub fn spec(self) -> &'static ContactSpec {
                match self {
                    $(ContactFunction::$name => const { &$spec },)*
                }
            }
        }
    };
}

contact_functions! {
    /// s^c, its rate, its Jacobian and its adjoint vector.
    ConstrainedCoordinates: ContactSpec {
        name: "constrained_coordinates",
        summary: "The constrained coordinates s^c, with s̈ = J q̈ + A, (20.86).",
        outputs: &[
            COORDINATES[0],
            COORDINATES[1],
            ContactPort::new("j", ROWS, JACOBIAN),
            ContactPort::new("a", &[Constrained], ADJOINT),
        ],
        ..DEFAULT
    },
    /// The same of s^f.
    FreeCoordinates: ContactSpec {
        name: "free_coordinates",
        summary: "The free coordinates s^f, with s̈ = J q̈ + A, (20.85).",
        outputs: &[
            ContactPort { axes: &[Free], ..COORDINATES[0] },
            ContactPort { axes: &[Free], ..COORDINATES[1] },
            ContactPort::new("j", &[Free, VELOCITIES], JACOBIAN),
            ContactPort::new("a", &[Free], ADJOINT),
        ],
        modes: InModes::WithFreeCoordinates,
        ..DEFAULT
    },
    /// Accelerations and reactions of a tau.
    ForwardDynamics: ContactSpec {
        name: "forward_dynamics",
        summary: "Motion and reactions in contact: H q̈ + h = τ + Jᵀ F, s̈^c = J q̈ + A, (20.88)-(20.89).",
        base: Function::ForwardDynamics,
        inputs: &[OWN],
        outputs: &[QDD, FORCE, SDD, VIOLATION, PIVOT, OWN_RATE],
        divisor: Divisor::Inertia,
        judged: Judged::ByResidual,
        ..DEFAULT
    },
    /// The same under the inputs of the drives, of a robot that has drives.
    DrivenForwardDynamics: ContactSpec {
        name: "driven_forward_dynamics",
        summary: "Motion and reactions in contact under the inputs of the drives: H* q̈ + h* = D u + Jᵀ F, s̈^c = J q̈ + A, (20.72) with \
                  (20.88)-(20.89).",
        base: Function::DrivenForwardDynamics,
        inputs: &[OWN],
        outputs: &[
            QDD,
            XD,
            FORCE,
            SDD,
            VIOLATION,
            PIVOT,
            OWN_RATE,
        ],
        modes: InModes::OfDrivenRobots,
        divisor: Divisor::InertiaWithDrives,
        ..DEFAULT
    },
    /// tau of a motion along s^f and of reactions.
    InverseDynamics: ContactSpec {
        name: "inverse_dynamics",
        summary: "Generalized forces of a wanted motion along s^f and of wanted reactions: hybrid feed-forward. Of the motions that do it, the \
                  one nearest to `qdd` in kinetic energy is taken.",
        base: Function::InverseDynamics,
        inputs: &[ContactPort::new("sdd_free", &[Free], "wanted s̈^f \\[m/s² or 1/s²\\]"), FORCE],
        outputs: &[ContactPort::new("tau", &[VELOCITIES], "generalized forces \\[N·m or N\\]"), PIVOT],
        divisor: Divisor::Inertia,
        ..DEFAULT
    },
    /// Changes of velocity and impulses when the contacts of the mode close.
    Impact: ContactSpec {
        name: "impact",
        summary: "Impact when the contacts of the mode close, (20.90)-(20.91), (20.95)-(20.97).",
        inputs: &[STRUCK, RESTITUTION],
        outputs: &[
            ContactPort::new("dqd", &[VELOCITIES], "changes of the velocities \\[rad/s or m/s\\]"),
            IMPULSE,
            ContactPort::new("dsd", &[Constrained], "changes of ṡ^c \\[m/s or 1/s\\]"),
            ContactPort::new("energy_loss", ONE, "kinetic energy lost by robot, rotors and struck masses \\[J\\]"),
            PIVOT,
            STRUCK_AFTER,
        ],
        divisor: Divisor::InertiaWithDrives,
        ..DEFAULT
    },
    /// The correction that takes s^c away.
    Projection: ContactSpec {
        name: "projection",
        summary: "The correction of q, by velocity coordinate, that takes s^c away to first order and moves the least mass. Apply \
                  it, and then `impact` with restitution 0 to the velocities, against drift.",
        outputs: &[
            ContactPort::new("dq", &[VELOCITIES], "correction by velocity coordinate \\[rad or m\\]"),
            COORDINATES[0],
        ],
        divisor: Divisor::InertiaWithDrives,
        ..DEFAULT
    },
    /// Accelerations and reactions of a tau with their derivatives.
    #[doc(alias("contact dynamics derivatives", "linearisation"))]
    ForwardDynamicsDerivatives: ContactSpec {
        name: "forward_dynamics_derivatives",
        summary: "Motion and reactions in contact with their derivatives by q, q̇, τ and the objects' own coordinates: \
                  H ∂q̈ − Jᵀ ∂F and J ∂q̈ are what is left of (20.88)-(20.89) at the q̈ and F that were found.",
        base: Function::ForwardDynamics,
        inputs: &[OWN],
        outputs: &[
            QDD,
            FORCE,
            ContactPort::new(
                "dqdd_dq",
                SQUARE,
                "rows of ∂q̈/∂q at constant τ \\[1/s²; with sliding joints also 1/(m·s²), m/s²\\]; of a floating base by increments of its pose \
in its own axes",
            ),
            ContactPort::new(
                "dqdd_dqd",
                SQUARE,
                "rows of ∂q̈/∂q̇ at constant τ \\[1/s; with sliding joints also 1/(m·s), m/s\\]",
            ),
            ContactPort::new("dqdd_dtau", SQUARE, "rows of ∂q̈/∂τ \\[1/(kg·m²), 1/(kg·m), 1/kg\\]"),
            ContactPort::new("dforce_dq", ROWS, "rows of ∂F/∂q at constant τ, as those of ∂q̈/∂q \\[N/rad, N/m\\]"),
            ContactPort::new("dforce_dqd", ROWS, "rows of ∂F/∂q̇ at constant τ \\[N·s/rad, N·s/m\\]"),
            ContactPort::new("dforce_dtau", ROWS, "rows of ∂F/∂τ \\[1/m, 1\\]"),
            PIVOT,
            OWN_RATE,
            DQDD_DOWN,
            DFORCE_DOWN,
            DOWN_RATE[0],
            DOWN_RATE[1],
            DOWN_RATE[2],
        ],
        is_by_name: true,
        form: Function::ForwardDynamicsDerivatives,
        divisor: Divisor::Inertia,
        ..DEFAULT
    },
    /// Accelerations and reactions under the inputs of the drives, of a robot that has drives, with their derivatives.
    #[doc(alias("contact dynamics derivatives", "linearisation by voltages"))]
    DrivenForwardDynamicsDerivatives: ContactSpec {
        name: "driven_forward_dynamics_derivatives",
        summary: "Motion and reactions in contact under the inputs of the drives, and the rates of the drives' states, with their derivatives by \
                  q, q̇, x, u and the objects' own coordinates.",
        base: Function::DrivenForwardDynamics,
        inputs: &[OWN],
        outputs: &[
            QDD,
            XD,
            FORCE,
            ContactPort::new(
                "dqdd_dq",
                SQUARE,
                "rows of ∂q̈/∂q at constant x and u \\[1/s²; with sliding joints also 1/(m·s²), m/s²\\]; of a floating base by increments of its \
pose in its own axes",
            ),
            ContactPort::new("dqdd_dqd", SQUARE, "rows of ∂q̈/∂q̇ \\[1/s; with sliding joints also 1/(m·s), m/s\\]"),
            ContactPort::new("dqdd_dx", &[VELOCITIES, STATES], "rows of ∂q̈/∂x, one column per state"),
            ContactPort::new("dqdd_du", &[VELOCITIES, INPUTS], "rows of ∂q̈/∂u \\[rad/(s²·V), or as in the robot file\\]"),
            ContactPort::new("dxd_dq", &[STATES, VELOCITIES], "rows of ∂ẋ/∂q"),
            ContactPort::new("dxd_dqd", &[STATES, VELOCITIES], "rows of ∂ẋ/∂q̇"),
            ContactPort::new("dxd_dx", &[STATES, STATES], "rows of ∂ẋ/∂x"),
            ContactPort::new("dxd_du", &[STATES, INPUTS], "rows of ∂ẋ/∂u"),
            ContactPort::new("dforce_dq", ROWS, "rows of ∂F/∂q, as those of ∂q̈/∂q \\[N/rad, N/m\\]"),
            ContactPort::new("dforce_dqd", ROWS, "rows of ∂F/∂q̇ \\[N·s/rad, N·s/m\\]"),
            ContactPort::new("dforce_dx", &[Constrained, STATES], "rows of ∂F/∂x"),
            ContactPort::new("dforce_du", &[Constrained, INPUTS], "rows of ∂F/∂u \\[N/V, or as in the robot file\\]"),
            PIVOT,
            OWN_RATE,
            DQDD_DOWN,
            ContactPort::new("dxd_d{}_own", &[STATES, Robot(Extent::Of(2))], "rows of ∂ẋ by them").per(WithOwnCoordinate),
            DFORCE_DOWN,
            DOWN_RATE[0],
            DOWN_RATE[1],
            DOWN_RATE[2],
        ],
        modes: InModes::OfDrivenRobots,
        is_by_name: true,
        form: Function::ForwardDynamicsDerivatives,
        divisor: Divisor::InertiaWithDrives,
        ..DEFAULT
    },
    /// Velocities after an impact and impulses with their derivatives.
    #[doc(alias("saltation", "reset map"))]
    ImpactDerivatives: ContactSpec {
        name: "impact_derivatives",
        summary: "Velocities after an impact, when the contacts of the mode close, and impulses, with their derivatives by q, by q̇ before, and by \
                  the velocities of struck masses.",
        inputs: &[STRUCK, RESTITUTION],
        outputs: &[
            ContactPort::new("qd_after", &[VELOCITIES], "velocities after \\[rad/s or m/s\\]"),
            IMPULSE,
            ContactPort::new(
                "dqd_after_dq",
                SQUARE,
                "rows of ∂q̇''/∂q at constant q̇ \\[1/s; with sliding joints also 1/(m·s), m/s\\]; of a floating base by increments of its pose in \
its own axes",
            ),
            ContactPort::new("dqd_after_dqd", SQUARE, "rows of ∂q̇''/∂q̇ by velocities before \\[1; with sliding joints also 1/m, m\\]"),
            ContactPort::new("dimpulse_dq", ROWS, "rows of ∂I/∂q at constant q̇, as those of ∂q̇''/∂q \\[N·s/rad, N·s/m\\]"),
            ContactPort::new("dimpulse_dqd", ROWS, "rows of ∂I/∂q̇ \\[N·s²/rad, N·s²/m\\]"),
            PIVOT,
            STRUCK_AFTER,
            ContactPort::new("dqd_after_d{}_struck", &[VELOCITIES], "∂q̇'' by the velocity of the struck mass before \\[rad/m, 1\\]")
                .per(WithMass),
            ContactPort::new("dimpulse_d{}_struck", &[Constrained], "∂I by it \\[N·s²/m\\]").per(WithMass),
            ContactPort::new("d{}_struck_after_dq", &[VELOCITIES], "derivatives of its velocity after by q \\[m/s\\]").per(WithMass),
            ContactPort::new("d{}_struck_after_dqd", &[VELOCITIES], "the same by q̇ before \\[m\\]").per(WithMass),
            ContactPort::new("d{}_struck_after_dstruck", &[Masses], "the same by the velocities of all masses before, in the order of contacts")
                .per(WithMass),
        ],
        is_by_name: true,
        form: Function::ForwardDynamicsDerivatives,
        divisor: Divisor::InertiaWithDrives,
        ..DEFAULT
    },
}

impl ContactFunction {
    /// The function of that name.
    pub fn from_name(name: &str) -> Option<ContactFunction> {
        Self::ALL.iter().copied().find(|f| f.name() == name)
    }

    /// Its name in generated code.
    pub fn name(self) -> &'static str {
        self.spec().name
    }

    /// What it computes.
    pub fn summary(self) -> &'static str {
        self.spec().summary
    }

    /// What contacts are said to bring by the names of inputs and results that begin with theirs.
    pub fn ports() -> impl Iterator<Item = &'static ContactPort> {
        Self::ALL.iter().flat_map(|f| f.spec().inputs.iter().chain(f.spec().outputs))
    }
}
