//! Constants of a robot: in the file, and associated with a type.

use super::{number, ALLOW};
use crate::choices::Choice;
use crate::emit::doc::of_no_column;
use crate::emit::Generated;
use crate::function::{base_parameter_lists, BaseParameterList, Function};
use crate::identifier::{comment, string_literals};
use crate::report::errors::{four_digits, ErrorReport, OutputErrors};
use crate::report::FunctionReport;
use std::fmt::Write;
use straightline_core::coupling::Coupling;
use straightline_core::drive::Drive;
use straightline_core::model::{Limits, Model};
use straightline_core::Dd;
use straightline_graph::Scalar;

/// A constant.
pub(super) struct AssociatedConstant {
    pub name: String,
    /// What stands above it, line by line.
    pub doc: String,
    kind: ConstantType,
    value: String,
}

/// The type of a constant.
enum ConstantType {
    Size,
    Sizes(usize),
    Names(usize),
    /// Numbers of a scalar type in an array of that shape.
    Numbers(Scalar, Vec<usize>),
    Cost,
    Figures,
}

impl AssociatedConstant {
    fn new(name: impl Into<String>, kind: ConstantType, value: String, doc: impl Into<String>) -> AssociatedConstant {
        AssociatedConstant { name: name.into(), doc: doc.into(), kind, value }
    }

    /// The type; `module` stands before types of the file.
    pub fn kind(&self, module: &str) -> String {
        match &self.kind {
            ConstantType::Size => "usize".to_string(),
            ConstantType::Sizes(n) => format!("[usize; {n}]"),
            // of a constant of a type the lifetime has to be said
            ConstantType::Names(n) if !module.is_empty() => format!("[&'static str; {n}]"),
            ConstantType::Names(n) => format!("[&str; {n}]"),
            ConstantType::Numbers(scalar, shape) => {
                shape.iter().rev().fold(scalar.name().to_string(), |inner, n| format!("[{inner}; {n}]"))
            }
            ConstantType::Cost => format!("{module}Cost"),
            ConstantType::Figures => format!("{module}Figures"),
        }
    }

    /// The constant in a file.
    pub fn text(&self) -> String {
        let allow = if matches!(self.kind, ConstantType::Numbers(..)) { format!("{ALLOW}\n") } else { String::new() };
        format!("{}{allow}pub const {}: {} = {};\n", super::doc(&self.doc), self.name, self.kind(""), self.value)
    }
}

/// Sizes, names and limits.
pub(super) fn of_robot(generated: &Generated) -> Vec<AssociatedConstant> {
    let Generated { model, frames, scalar, .. } = generated;
    let joints = model.joints();
    let single: Vec<_> = joints.iter().filter(|j| j.kind.is_single()).collect();
    let names = |names: &mut dyn Iterator<Item = &str>| format!("[{}]", string_literals(names));
    let size =
        |name: &str, value: usize, doc: &str| AssociatedConstant::new(name, ConstantType::Size, value.to_string(), doc);
    let joint_names = names(&mut joints.iter().map(|j| j.name.as_str()));
    let frame_names = names(&mut frames.iter().map(String::as_str));
    let mut constants = vec![
        size("NQ", model.nq(), "Number of configuration coordinates q."),
        size("NV", model.nv(), "Number of velocity coordinates qd, qdd, tau."),
        AssociatedConstant::new(
            "JOINT_NAMES",
            ConstantType::Names(joints.len()),
            joint_names,
            "Joints in the order of their coordinates.",
        ),
        AssociatedConstant::new(
            "FRAME_NAMES",
            ConstantType::Names(frames.len()),
            frame_names,
            "Frames of the functions that answer per frame.",
        ),
    ];
    constants.extend(of_loops(model));
    constants.extend(of_followers(model, *scalar));
    let list = |f: &dyn Fn(&Limits) -> f64| {
        let numbers: Vec<String> = single.iter().map(|j| number(f(&j.limits), *scalar)).collect();
        format!("[{}]", numbers.join(", "))
    };
    let floating = match joints.iter().filter(|j| !j.kind.is_single()).all(|j| j.kind.is_base()) {
        true if single.len() == joints.len() => "",
        true => " (the floating base is left out)",
        false => " (joints of several coordinates are left out)",
    };
    for (name, doc, values) in [
        ("LOWER_LIMITS", "Least coordinate of every joint \\[rad or m\\]", list(&|l| l.lower)),
        ("UPPER_LIMITS", "Greatest coordinate of every joint \\[rad or m\\]", list(&|l| l.upper)),
        ("VELOCITY_LIMITS", "Greatest speed of every joint \\[rad/s or m/s\\]", list(&|l| l.velocity)),
        ("EFFORT_LIMITS", "Greatest generalized force of every joint \\[N·m or N\\]", list(&|l| l.effort)),
    ] {
        let doc = format!("{doc}{floating}; infinite where the robot file says nothing.");
        constants.push(AssociatedConstant::new(name, ConstantType::Numbers(*scalar, vec![single.len()]), values, doc));
    }
    let n = model.drives.len();
    if n > 0 {
        let drive_names = names(&mut model.drives.iter().map(|d| d.name.as_str()));
        let states: Vec<usize> = model.drives.iter().map(Drive::states).collect();
        constants.extend([
            size("NU", n, "Number of inputs u of the drives."),
            size("NX", states.iter().sum(), "Number of states x of the drives."),
            AssociatedConstant::new("DRIVE_NAMES", ConstantType::Names(n), drive_names, "Drives in the order of u."),
            AssociatedConstant::new(
                "DRIVE_STATES",
                ConstantType::Sizes(n),
                format!("{states:?}"),
                "How many entries of x each drive has.",
            ),
        ]);
    }
    constants.extend(of_base_parameters(generated));
    constants
}

/// Of closed loops: the joints that they determine.
fn of_loops(model: &Model<Dd>) -> Option<AssociatedConstant> {
    let names: Vec<&str> = model.dependent_joints().map(|joint| joint.name.as_str()).collect();
    let doc =
        "Joints that loops determine: the last of [`JOINT_NAMES`], with coordinates in q and without velocities in qd.";
    let literals = format!("[{}]", string_literals(names.iter().copied()));
    let kind = ConstantType::Names(names.len());
    (!names.is_empty()).then(|| AssociatedConstant::new("DEPENDENT_NAMES", kind, literals, doc))
}

/// Of joints that follow others: names, whose coordinates they follow, and how.
fn of_followers(model: &Model<Dd>, scalar: Scalar) -> Vec<AssociatedConstant> {
    let followers = model.followers();
    let n = followers.len();
    if n == 0 {
        return Vec::new();
    }
    let names = string_literals(followers.iter().map(|(joint, _)| joint.name.as_str()));
    let sources: Vec<usize> = followers.iter().map(|(_, c)| model.bodies[c.source].joint.iq).collect();
    let numbers = |of: &dyn Fn(&Coupling<Dd>) -> Dd| {
        let all: Vec<String> = followers.iter().map(|(_, c)| number(of(c).to_f64(), scalar)).collect();
        format!("[{}]", all.join(", "))
    };
    let list = || ConstantType::Numbers(scalar, vec![n]);
    vec![
        AssociatedConstant::new(
            "FOLLOWER_NAMES",
            ConstantType::Names(n),
            format!("[{names}]"),
            "Joints that follow others and have no coordinates: each stands at its ratio times the q that it follows, plus its offset. Results \
             per joint have them behind those of [`JOINT_NAMES`].",
        ),
        AssociatedConstant::new("FOLLOWED", ConstantType::Sizes(n), format!("{sources:?}"), "Indices of the q that they follow."),
        AssociatedConstant::new(
            "FOLLOWER_RATIOS",
            list(),
            numbers(&|c| c.ratio),
            "Their ratios \\[1, m/rad or rad/m\\].",
        ),
        AssociatedConstant::new("FOLLOWER_OFFSETS", list(), numbers(&|c| c.offset), "Their offsets \\[rad or m\\]."),
    ]
}

/// How many base parameters there are, their names and values, and where they stand in the regressor.
fn of_base_parameters(generated: &Generated) -> Vec<AssociatedConstant> {
    let functions: Vec<Function> = generated.items.iter().map(|item| item.function).collect();
    let mut constants = Vec::new();
    let lists = base_parameter_lists(&generated.model, &functions);
    for BaseParameterList { prefix, what, names, values, left_out, places } in lists {
        let n = names.len();
        let (count, all) = (format!("{prefix}_PARAMETER_COUNT"), format!("{prefix}_PARAMETER_NAMES"));
        let size = AssociatedConstant::new(
            count,
            ConstantType::Size,
            n.to_string(),
            format!("Number of the combinations of inertial parameters that {what} tells apart.")
                .replace("forces tells", "forces tell"),
        );
        let doc = "What each of them is: m, mx, my, mz (mass, first moment) and Ixx, Ixy, Ixz, Iyy, Iyz, Izz (inertia) about the link's origin, in the axes of the \
                   link; J, d, f, o, k (rotor inertia, damping, Coulomb friction, offset, stiffness) of the joint; each of the link and joint of that \
                   number, counted from 1 in the order of [`JOINT_NAMES`], the link with all that is fixed to it. Four digits of factors; \
                   the generated functions have all.";
        let literals = format!("[{}]", string_literals(names.iter().map(String::as_str)));
        let names = AssociatedConstant::new(all, ConstantType::Names(n), literals, doc);
        let numbers: Vec<String> = values.iter().map(|x| number(*x, generated.scalar)).collect();
        let values = AssociatedConstant::new(
            format!("{prefix}_PARAMETERS"),
            ConstantType::Numbers(generated.scalar, vec![n]),
            format!("[{}]", numbers.join(", ")),
            format!(
                "Their values \\[kg, kg·m, kg·m²; of joints as their parameters\\], without bodies that are inputs.{}",
                of_no_column(&left_out)
            ),
        );
        constants.extend([size, names, values]);
        for (k, word) in ["ROWS", "COLUMNS"].into_iter().enumerate() {
            let list: Vec<usize> = places.iter().map(|place| place[k]).collect();
            constants.push(AssociatedConstant::new(
                format!("{prefix}_REGRESSOR_{word}"),
                ConstantType::Sizes(list.len()),
                format!("{list:?}"),
                format!(
                    "{} of the entries of the regressor that are not zero everywhere, column by column.",
                    ["Rows", "Columns"][k]
                ),
            ));
        }
    }
    constants
}

/// The type of the costs.
pub(super) const COST: &str = "
/// Operations of a generated function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cost {
    /// Multiplications.
    pub mul: u32,
    /// Additions and subtractions.
    pub add: u32,
    /// Instructions for both when every a * b + c is one.
    pub fma: u32,
    /// Divisions.
    pub div: u32,
    /// Pairs of sine and cosine.
    pub sin_cos: u32,
    /// Most values alive at once, inputs and constants not counted.
    pub max_live: u32,
}
";

/// The cost of a function.
pub(super) fn cost(name: &str, f: &FunctionReport) -> AssociatedConstant {
    let value = format!(
        "Cost {{ mul: {}, add: {}, fma: {}, div: {}, sin_cos: {}, max_live: {} }}",
        f.mul, f.add, f.fma, f.div, f.sincos, f.max_live
    );
    AssociatedConstant::new(
        format!("{}_COST", name.to_uppercase()),
        ConstantType::Cost,
        value,
        format!("What [`{name}`] costs."),
    )
}

/// The type of the figures of machine code.
pub(super) const FIGURES: &str = "
/// What a generated function takes on the machine that it is made for, read off its machine code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Figures {
    /// Instructions per call on the longest path, callees included; of functions of the compiler's library averages.
    pub instructions: Option<u32>,
    /// Bytes of flash, without those that it shares.
    pub flash_bytes: u32,
    /// Bytes of flash that it shares with other functions: the kernel of sines, and constants.
    pub shared_flash_bytes: u32,
    /// Bytes of stack at its deepest, callees included but for functions of the compiler's library.
    pub stack_bytes: Option<u32>,
    /// Cycles per call by a model in which instructions wait for nothing but themselves and the memory that they are in.
    pub model_cycles: Option<u32>,
}
";

/// The figures of a function, where they are asked for.
pub(super) fn figures(name: &str, f: &FunctionReport, generated: &Generated) -> Option<AssociatedConstant> {
    let (figures, rustc, machine) = (f.machine.as_ref()?, generated.rustc.as_ref()?, generated.target?);
    let optional = |figure: Result<u32, &'static str>| figure.map_or("None".to_string(), |n| format!("Some({n})"));
    let value = format!(
        "Figures {{ instructions: {}, flash_bytes: {}, shared_flash_bytes: {}, stack_bytes: {}, model_cycles: {} }}",
        optional(figures.instructions),
        figures.flash_bytes,
        figures.shared_flash_bytes,
        optional(figures.stack_bytes),
        optional(figures.model_cycles)
    );
    let (machine, memory, rustc) = (machine.row().name, generated.memory.word(), comment(rustc));
    let mut doc = format!("What [`{name}`] takes on {machine}, code in {memory}, compiled by {rustc}.");
    let all =
        [("instructions", figures.instructions), ("stack", figures.stack_bytes), ("cycles", figures.model_cycles)];
    for (what, why) in all.iter().filter_map(|(what, figure)| Some((what, figure.err()?))) {
        let _ = write!(doc, "\n\nNothing is said of {what}: {why}.");
    }
    Some(AssociatedConstant::new(format!("{}_FIGURES", name.to_uppercase()), ConstantType::Figures, value, doc))
}

/// The certified bounds of a function's errors.
pub(super) fn error_bounds(name: &str, figures: &FunctionReport) -> Vec<AssociatedConstant> {
    let bounds = figures.errors.iter().flat_map(|errors| errors.outputs.iter().map(move |output| (errors, output)));
    bounds
        .flat_map(|(errors, output)| {
            let mut doc = format!(
                "Certified bound of the errors of [`{name}`]: how far `{}` can be from the exact dynamics of the robot file.\n\n\
                 Numbers of the file are the nearest f64; angles that were taken as exact are exact.\n\n\
                 It holds for all inputs in these ranges:\n",
                output.name
            );
            for line in &errors.ranges {
                let _ = writeln!(doc, "* {}", line.replace('[', "\\[").replace(']', "\\]"));
            }
            let value = nested(&output.shape, &mut output.bounds.iter());
            let kind = ConstantType::Numbers(Scalar::F64, output.shape.clone());
            let bound = AssociatedConstant::new(errors.constant_name(name, output), kind, value, doc);
            std::iter::once(bound).chain(lipschitz(name, errors, output))
        })
        .collect()
}

/// Which entries of a function's matrix results can be non-zero.
pub(super) fn entries(name: &str, figures: &FunctionReport) -> Vec<AssociatedConstant> {
    let constants = figures.entries.iter().flat_map(|of| of.constants(name));
    let constant = |(name, numbers, doc): (String, &[usize], String)| {
        AssociatedConstant::new(name, ConstantType::Sizes(numbers.len()), format!("{numbers:?}"), doc)
    };
    constants.map(constant).collect()
}

/// Certified Lipschitz constants of what an output is the derivative of.
fn lipschitz(name: &str, errors: &ErrorReport, output: &OutputErrors) -> Vec<AssociatedConstant> {
    let Some(slopes) = output.slopes.as_ref().filter(|slopes| slopes.refused.is_none()) else { return Vec::new() };
    let (of, by) = (slopes.of, &slopes.by);
    let mut ranges = String::from("\n\nIt holds for all inputs in these ranges:\n");
    for line in &errors.ranges {
        let _ = writeln!(ranges, "* {}", line.replace('[', "\\[").replace(']', "\\]"));
    }
    let [of_entries, of_norm] = output.lipschitz_names(name);
    let doc = format!(
        "Certified bound of how fast {of} can change with `{by}`: no entry of `{}` of [`{name}`] is greater in size. \
         Of a floating base by increments of its pose.{ranges}",
        output.name
    );
    let numbers = |shape: &[usize]| ConstantType::Numbers(Scalar::F64, shape.to_vec());
    let value = nested(&output.shape, &mut slopes.entries.iter());
    let mut constants = vec![AssociatedConstant::new(of_entries, numbers(&output.shape), value, doc)];
    if let Some(norm) = slopes.norm {
        let doc = format!(
            "Certified Lipschitz constant of {of} by `{by}` in Euclidean norms, coordinates in their units: \
             ‖Δ{of}‖ ≤ this · ‖Δ`{by}`‖, all else held. No matrix whose entries keep to [`{}`] has a greater singular value.{ranges}",
            constants[0].name
        );
        constants.push(AssociatedConstant::new(of_norm, numbers(&[]), nested(&[], &mut [norm].iter()), doc));
    }
    constants
}

fn nested<'a>(shape: &[usize], numbers: &mut impl Iterator<Item = &'a f64>) -> String {
    match shape.split_first() {
        None => numbers.next().map_or(String::new(), |x| number(four_digits(*x), Scalar::F64)),
        Some((n, rest)) => {
            let parts: Vec<String> = (0..*n).map(|_| nested(rest, numbers)).collect();
            format!("[{}]", parts.join(", "))
        }
    }
}
