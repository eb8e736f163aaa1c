//! The values that inputs can have: what bounds on rounding errors are computed for.
//!
//! Ranges change no equation. Where a scene says nothing they are the limits of the robot file; what neither limits is
//! unlimited, and says so ([`InputRange::is_bounded`]).

use super::Scene;
use crate::function::Quantity::{self, Acceleration, Configuration, Force, Gravity, Velocity};
use straightline_core::model::{Joint, JointKind, Limits, Model};
use straightline_core::Dd;
use straightline_graph::expr::Port;

/// From `lower` to `upper`, both in it; infinite where there is no limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InputRange {
    /// The least value.
    pub lower: f64,
    /// The greatest value.
    pub upper: f64,
}

impl InputRange {
    /// Every number.
    pub const UNLIMITED: InputRange = InputRange { lower: f64::NEG_INFINITY, upper: f64::INFINITY };
    /// Zero alone.
    pub const ZERO: InputRange = InputRange { lower: 0.0, upper: 0.0 };

    /// From −`bound` to `bound`.
    pub fn within(bound: f64) -> InputRange {
        InputRange { lower: -bound, upper: bound }
    }

    /// Whether both ends are finite.
    pub fn is_bounded(self) -> bool {
        self.lower.is_finite() && self.upper.is_finite()
    }

    /// Whether a number lies in it: no end is NaN, and the lower one is not above the other.
    pub fn is_sound(self) -> bool {
        self.lower <= self.upper && self.lower < f64::INFINITY && self.upper > f64::NEG_INFINITY
    }
}

/// The ranges of one input over the joints.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum JointRanges {
    /// Those of the robot file: q within the joint's limits, q̇ within its velocity, τ within its effort; q̈ unlimited.
    #[default]
    Limits,
    /// The same for all joints.
    All(InputRange),
    /// Of these joints, by name; of the others as [`JointRanges::Limits`].
    Joints(Vec<(String, InputRange)>),
}

/// The values that inputs can have. For a floating base the range of q is that of its position \[m\] (quaternions are unit
/// quaternions), and that of q̇, q̈ and τ holds for all six of its coordinates, or for all three of a ball joint.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Ranges {
    /// Configuration \[rad or m\].
    pub q: JointRanges,
    /// Velocity \[rad/s or m/s\].
    pub qd: JointRanges,
    /// Acceleration \[rad/s² or m/s²\].
    pub qdd: JointRanges,
    /// Generalized forces \[N·m or N\].
    pub tau: JointRanges,
    /// Each component of gravity where it is an input \[m/s²\].
    pub gravity: Option<InputRange>,
}

impl Ranges {
    /// The inputs over joints with their ranges.
    pub fn over_joints(&self) -> [(Quantity, &JointRanges); 4] {
        [(Configuration, &self.q), (Velocity, &self.qd), (Acceleration, &self.qdd), (Force, &self.tau)]
    }
}

impl Scene {
    /// The range of every scalar of an input port, in its order; [`InputRange::UNLIMITED`] where nothing limits it.
    ///
    /// ```
    /// use straightline_codegen::expr::Port;
    /// use straightline_codegen::scene::{InputRange, JointRanges, Scene};
    /// use straightline_core::model::Model;
    /// # use straightline_codegen::{compile, diagnostic::Source, Options};
    /// # let text = "[robot]\nname = \"a\"\n[[link]]\nname = \"w\"\n[[link]]\nname = \"b\"\nmass = 1.0\n\
    /// #     inertia = [1.0, 1.0, 1.0]\n[[joint]]\nname = \"j\"\nkind = \"revolute\"\nparent = \"w\"\nchild = \"b\"\n\
    /// #     axis = \"z\"\nlimits = { lower = -1.0, upper = 2.0, velocity = 3.0, effort = 4.0 }\n";
    /// # let model = compile(&Source::new("a.toml", text), &Options::default()).unwrap().model;
    /// let mut scene = Scene::default();
    /// scene.ranges.qdd = JointRanges::All(InputRange::within(50.0));
    /// assert_eq!(scene.input_ranges(&Port::new("q", &[1]), &model), [InputRange { lower: -1.0, upper: 2.0 }]);
    /// assert_eq!(scene.input_ranges(&Port::new("qdd", &[1]), &model), [InputRange::within(50.0)]);
    /// ```
    pub fn input_ranges<T>(&self, port: &Port, model: &Model<T>) -> Vec<InputRange> {
        let mut all = vec![InputRange::UNLIMITED; port.len()];
        // any configuration is in the ranges of q
        let named = |quantity: Quantity| if quantity.is_configuration() { Configuration } else { quantity };
        let quantity = Quantity::of(port).map(named);
        if quantity == Some(Gravity) {
            all.fill(self.ranges.gravity.unwrap_or(InputRange::UNLIMITED));
        }
        let over_joints = self.ranges.over_joints();
        let found = over_joints.into_iter().find(|(over_joints, _)| Some(*over_joints) == quantity);
        let Some((quantity, ranges)) = found else { return all };
        for joint in joints_of(quantity, model) {
            let rests = matches!(quantity, Velocity | Acceleration) && self.zero.joints_at_rest.contains(&joint.name);
            let range = if rests { InputRange::ZERO } else { range(quantity, ranges, joint) };
            let (first, count) = match quantity {
                Configuration => (joint.iq, joint.kind.nq()),
                _ => (joint.iv, joint.kind.nv()),
            };
            all[first..first + count].fill(range);
            if let Some(quaternion) = joint.kind.row().quaternion.filter(|_| quantity == Configuration) {
                all[first + quaternion..first + count].fill(InputRange::within(1.0));
            }
        }
        all
    }
}

/// The joints with entries in a quantity over joints: loops determine some of q.
fn joints_of<T>(quantity: Quantity, model: &Model<T>) -> impl Iterator<Item = &Joint> {
    model.free_joints().filter(move |joint| quantity.is_configuration() || joint.iv < model.independent_nv())
}

/// The ranges of a scene in words, a line per joint and input; nothing where it says none.
pub fn ranges_in_words(scene: &Scene, model: &Model<Dd>) -> Vec<String> {
    let said = scene.ranges.over_joints().into_iter().filter(|(_, ranges)| **ranges != JointRanges::Limits);
    let mut lines = Vec::new();
    for (quantity, ranges) in said {
        let mut joints: Vec<&Joint> = joints_of(quantity, model).collect();
        joints.sort_by_key(|joint| joint.iv);
        for joint in joints {
            // a quaternion is in no range but its own
            if quantity == Configuration && joint.kind.measures().next().is_none() {
                continue;
            }
            let at = if quantity == Configuration { joint.iq } else { joint.iv };
            let words = in_words(range(quantity, ranges, joint), unit(quantity, joint.kind));
            lines.push(format!("{}[{at}] {}: {words}", quantity.name(), joint.name));
        }
    }
    let gravity = scene.ranges.gravity.map(|range| format!("gravity: {}", in_words(range, "m/s²")));
    lines.extend(gravity);
    lines
}

fn in_words(range: InputRange, unit: &str) -> String {
    match range {
        InputRange::UNLIMITED => "unlimited".to_string(),
        InputRange { lower, upper } => format!("{lower:?} to {upper:?} {unit}"),
    }
}

/// The unit of an input; of the base's velocity and force, which have two, that of the linear part.
fn unit(quantity: Quantity, kind: JointKind) -> &'static str {
    let index = [Configuration, Velocity, Acceleration].iter().position(|input| *input == quantity);
    kind.units()[index.unwrap_or(3)]
}

/// The range of a joint's coordinate of an input.
fn range(quantity: Quantity, ranges: &JointRanges, joint: &Joint) -> InputRange {
    let Limits { lower, upper, velocity, effort } = joint.limits;
    let of_file = match quantity {
        Configuration => InputRange { lower, upper },
        Velocity => InputRange::within(velocity),
        Force => InputRange::within(effort),
        _ => InputRange::UNLIMITED,
    };
    match ranges {
        JointRanges::Limits => of_file,
        JointRanges::All(range) => *range,
        JointRanges::Joints(named) => named.iter().find(|(n, _)| *n == joint.name).map_or(of_file, |(_, range)| *range),
    }
}
