//! Columns of a run as plots: which belong together, what they are called and measured in, and which of them are arrows in the picture.

use serde::Serialize;
use straightline_core::joint::Measure;
use straightline_core::model::Model;

/// A plot: columns over time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct ViewChart {
    pub title: &'static str,
    pub unit: &'static str,
    /// Whether it is seen at once.
    pub open: bool,
    pub lines: Vec<ChartLine>,
}

/// A line of a plot.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct ChartLine {
    pub name: String,
    /// Index into the columns of the run.
    pub column: usize,
    /// Which colour: that of the joint, if it is the only line of one.
    pub colour: usize,
}

/// Arrows at a body.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct ViewArrow {
    /// What is switched on and off, and scaled, together.
    pub group: &'static str,
    pub body: usize,
    /// Whether it is a moment, which has two heads.
    pub moment: bool,
    /// Along z of the body's canonical frame: one column; three are in the axes of its link.
    pub columns: Vec<usize>,
}

/// How columns begin, what they are, and which of the units of a joint's coordinate they have (`JOINT_UNITS`), or their own.
struct ColumnKind {
    prefix: &'static str,
    title: &'static str,
    unit: ColumnUnit,
    open: bool,
}

impl ColumnKind {
    /// Forces that turn are torques.
    fn title_of(&self, measure: Measure) -> &'static str {
        match (self.prefix, measure) {
            ("tau" | "effort", Measure::Angle) => "Joint torques",
            ("residual", Measure::Angle) => "Residual torques",
            _ => self.title,
        }
    }
}

#[derive(Clone, Copy)]
enum ColumnUnit {
    /// The n-th of coordinate, rate, acceleration, force.
    OfJoint(usize),
    Own(&'static str),
}

const fn kind(prefix: &'static str, title: &'static str, unit: ColumnUnit, open: bool) -> ColumnKind {
    ColumnKind { prefix, title, unit, open }
}

/// Columns that `simulate`, `analyze` and `residuals` write, in the order in which they are plotted.
const KINDS: [ColumnKind; 19] = [
    kind("q", "Coordinates", ColumnUnit::OfJoint(0), true),
    kind("tau", "Joint forces", ColumnUnit::OfJoint(3), true),
    kind("effort", "Joint forces", ColumnUnit::OfJoint(3), true),
    kind("residual", "Residual forces", ColumnUnit::OfJoint(3), true),
    kind("unexplained", "Unexplained residuals", ColumnUnit::OfJoint(3), true),
    kind("observer", "Residuals by the observer", ColumnUnit::OfJoint(3), false),
    kind("error", "Errors of tracking", ColumnUnit::OfJoint(0), true),
    kind("F", "Reactions", ColumnUnit::Own("N or N·m"), true),
    kind("s", "Distances", ColumnUnit::Own("m"), false),
    kind("qd", "Velocities", ColumnUnit::OfJoint(1), false),
    kind("qdd", "Accelerations", ColumnUnit::OfJoint(2), false),
    kind("power", "Powers", ColumnUnit::Own("W"), false),
    kind("force", "Forces that joints carry", ColumnUnit::Own("N"), false),
    kind("moment", "Moments that joints carry", ColumnUnit::Own("N·m"), false),
    kind("friction", "Friction", ColumnUnit::Own("N"), false),
    kind("u", "Inputs of drives", ColumnUnit::Own("V"), false),
    kind("i", "Currents", ColumnUnit::Own("A"), false),
    kind("speed", "Speeds of motors", ColumnUnit::Own("rad/s"), false),
    kind("m", "Torques of motors", ColumnUnit::Own("N·m"), false),
];

/// Columns without a prefix that are energies since the beginning \[J\].
const ENERGIES: [&str; 12] = [
    "energy",
    "kinetic",
    "potential",
    "objects",
    "work",
    "losses",
    "electrical",
    "joule",
    "motor_friction",
    "gear_losses",
    "damper_losses",
    "conversion",
];

/// The joint of a column and the measure of its entry: `elbow`, or `base.px`. With a column of no prefix the whole is its name.
fn joint_of(model: &Model<f64>, rest: &str, kind: usize) -> Option<(usize, Option<Measure>)> {
    let joints = model.tree_joints();
    if let Some(k) = joints.iter().position(|joint| joint.name == rest) {
        return Some((k, joints[k].kind.row().measures.first().copied()));
    }
    // names of joints may have points, names of entries have none
    let (name, entry) = rest.rsplit_once('.')?;
    let k = joints.iter().position(|joint| joint.name == name)?;
    let row = joints[k].kind.row();
    let entries = row.entries[kind.min(2)];
    let at = entries.iter().position(|e| *e == entry);
    let measured = at.filter(|at| kind != 0 || row.quaternion.is_none_or(|first| *at < first));
    Some((k, measured.and_then(|at| row.measures.get(at).copied())))
}

/// Where a column belongs.
struct ColumnPlace {
    title: &'static str,
    unit: &'static str,
    /// Of the plot among the others.
    order: usize,
    open: bool,
    /// Of the line.
    name: String,
    joint: Option<usize>,
}

fn place(model: &Model<f64>, name: &str) -> ColumnPlace {
    let (prefix, rest) = name.split_once('.').unwrap_or(("", name));
    if let Some(order) = KINDS.iter().position(|kind| kind.prefix == prefix) {
        return known_place(model, order, rest);
    }
    let after = KINDS.len();
    let at = |title, unit, order, open, joint| ColumnPlace { title, unit, order, open, name: name.to_string(), joint };
    if ENERGIES.contains(&name) {
        return at("Energies", "J", after, false, None);
    }
    match joint_of(model, name, 0) {
        // a joint's name alone is its coordinate
        Some((k, Some(measure))) => at(KINDS[0].title, measure.units()[0], 0, true, Some(k)),
        _ => at("Other columns", "", after + 1, false, None),
    }
}

/// Of a column with the prefix of this row.
fn known_place(model: &Model<f64>, order: usize, rest: &str) -> ColumnPlace {
    let kind = &KINDS[order];
    // entries are named as those of q, of rates, of forces
    let entries = match kind.unit {
        ColumnUnit::OfJoint(n) => [0, 1, 1, 2][n],
        ColumnUnit::Own(_) => 0,
    };
    let joint = joint_of(model, rest, entries);
    let (title, unit, open) = match (kind.unit, joint) {
        (ColumnUnit::OfJoint(n), Some((_, Some(measure)))) => (kind.title_of(measure), measure.units()[n], kind.open),
        (ColumnUnit::OfJoint(0), Some((_, None))) => ("Orientations, as quaternions", "", false),
        (ColumnUnit::OfJoint(_), _) => (kind.title, "", kind.open),
        (ColumnUnit::Own(unit), _) => (kind.title, unit, kind.open),
    };
    // several lines of one joint need several colours
    let joint = joint.map(|(k, _)| k).filter(|k| model.tree_joints()[*k].kind.is_single());
    ColumnPlace { title, unit, order, open, name: rest.to_string(), joint }
}

/// The plots of these columns, in a fixed order. Every column is in one.
pub(crate) fn charts(model: &Model<f64>, columns: &[(String, Vec<f64>)]) -> Vec<ViewChart> {
    let mut found: Vec<(usize, ViewChart)> = Vec::new();
    for (column, (name, _)) in columns.iter().enumerate() {
        let ColumnPlace { title, unit, order, open, name, joint } = place(model, name);
        let k = found.iter().position(|(_, c)| c.title == title && c.unit == unit).unwrap_or_else(|| {
            found.push((order, ViewChart { title, unit, open, lines: Vec::new() }));
            found.len() - 1
        });
        let lines = &mut found[k].1.lines;
        let colour = joint.unwrap_or(lines.len());
        lines.push(ChartLine { name, column, colour });
    }
    found.sort_by_key(|(order, _)| *order);
    found.into_iter().map(|(_, chart)| chart).collect()
}

/// The arrows of these columns: forces and moments that joints carry, torques of joints, residuals.
pub(crate) fn arrows(model: &Model<f64>, columns: &[(String, Vec<f64>)]) -> Vec<ViewArrow> {
    let find = |name: String| columns.iter().position(|(n, _)| *n == name);
    let mut found = Vec::new();
    for (body, joint) in model.bodies.iter().enumerate().map(|(k, body)| (k, &body.joint)) {
        let name = &joint.name;
        for (group, prefix, moment) in [("forces carried", "force", false), ("moments carried", "moment", true)] {
            let axes = ["x", "y", "z"].map(|axis| find(format!("{prefix}.{name}.{axis}")));
            if let [Some(x), Some(y), Some(z)] = axes {
                found.push(ViewArrow { group, body, moment, columns: vec![x, y, z] });
            }
        }
        let Some(measure) = joint.kind.elementary() else { continue };
        let moment = measure == Measure::Angle;
        for (prefix, groups) in [
            ("tau", ["joint torques", "joint forces"]),
            ("effort", ["joint torques", "joint forces"]),
            ("residual", ["residual torques", "residual forces"]),
        ] {
            if let Some(column) = find(format!("{prefix}.{name}")) {
                found.push(ViewArrow { group: groups[usize::from(!moment)], body, moment, columns: vec![column] });
            }
        }
    }
    found
}
