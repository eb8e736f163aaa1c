//! The options: one row each, from which the fronts, their documentation and the hash come.
//!
//! A row says what an option is called, what it takes, where it can be given and what it does. The command line makes its arguments of the
//! rows, the macros their keys, the builder's methods set by them, scene files have them in `[options]`; `guide/src/options.md` and the other
//! tables of the documents are printed from them. Options are set in the order of the table, whatever the order in which they are given.

use super::value::{OptionValue, Vocabulary};
use super::Options;
use crate::choices::{
    ColumnForm, FixedProducts, Fusion, Lanes, LimbForm, Memory, OptimisationTier, TargetMachine, WrittenEntries,
};
use crate::diagnostic::Level;
use crate::function::{ForwardDynamicsMethod, Function};
use crate::scene::MaxError;
use std::time::Duration;
use straightline_graph::certify::Effort;
use straightline_graph::expr::Grade;
use straightline_graph::Scalar;
use Call::{As, Not};
use OptionGroup::{Front, Model};
use OptionKind::{Codes, Names, OfFront, Real, Vector, Whole, Word, Words};

/// What an option takes.
pub enum OptionKind {
    /// Yes or no; named alone: yes.
    Flag,
    /// One word; the second one is meant where the option is named alone, if that is possible.
    Word(Vocabulary, Option<&'static str>),
    /// Several words.
    Words(Vocabulary),
    /// Names of joints or frames. The command line parts them by commas, or else takes the option again for each.
    Names {
        /// Whether commas part them.
        commas: bool,
    },
    /// Codes of warnings, which get this level.
    Codes(Level),
    /// A number in a range: in words, and whether a number is in it.
    Real(&'static str, fn(f64) -> bool),
    /// A whole number in a range.
    Whole(&'static str, fn(f64) -> bool),
    /// Three numbers.
    Vector,
    /// What the front reads by itself: files and names.
    OfFront,
}

/// How a front calls an option.
#[derive(Clone, Copy)]
pub enum Call {
    /// By its name.
    Name,
    /// Otherwise.
    As(&'static str),
    /// Not at all, and why.
    Not(&'static str),
}

/// What an option is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OptionGroup {
    /// What is generated.
    Program,
    /// How the robot file is read.
    Model,
    /// What is said.
    Reporting,
    /// Where something is read or written, which each front sees to.
    Front,
}

/// An option.
pub struct OptionRow {
    /// Its name, as an identifier; on the command line with `-` for `_`.
    pub name: &'static str,
    /// What it takes.
    pub kind: OptionKind,
    /// What it is about.
    pub group: OptionGroup,
    /// What it does.
    pub doc: &'static str,
    /// What happens without it.
    pub default: &'static str,
    /// A value that is not the default.
    pub example: &'static [&'static str],
    /// Another option without which it is refused, and a value of it.
    pub needs: Option<(&'static str, &'static str)>,
    /// What stands for its value in the help of the command line.
    pub metavar: &'static str,
    /// On the command line.
    pub command_line: Call,
    /// In the macros.
    pub macros: Call,
    /// In build scripts.
    pub builder: Call,
    /// In scene files: a key of its table, or of the scene.
    pub scene: Call,
    /// Its table in scene files.
    pub table: &'static str,
    /// Another table that has it, too.
    pub also: &'static str,
    /// The names that it writes into the text that hashes are made of.
    pub hash: &'static [&'static str],
    /// Sets it.
    pub set: fn(&mut Options, &OptionValue),
}

impl OptionRow {
    /// In every front by its name.
    const DEFAULT: OptionRow = OptionRow {
        name: "",
        kind: OptionKind::Flag,
        group: OptionGroup::Program,
        doc: "",
        default: "off",
        example: &[],
        needs: None,
        metavar: "",
        command_line: Call::Name,
        macros: Call::Name,
        builder: Call::Name,
        scene: Call::Name,
        table: "options",
        also: "",
        hash: &[],
        set: |_, _| (),
    };
}

const OF: OptionRow = OptionRow::DEFAULT;
const LEVEL: OptionRow = OptionRow {
    group: OptionGroup::Reporting,
    default: "every warning is said",
    example: &["near-right-angle"],
    metavar: "CODE",
    table: "diagnostics",
    ..OptionRow::DEFAULT
};
const ELSEWHERE: Call = Not("where something is read or written is not the scene's business");

/// All options.
#[rustfmt::skip]
pub static TABLE: &[OptionRow] = &[
    OptionRow { name: "functions", kind: Words(Vocabulary::of::<Function>()), default: "all", metavar: "NAME", command_line: As("function"),
        doc: "The functions that are generated",
        table: "outputs", example: &["inverse_dynamics", "mass_matrix"], hash: &["functions"],
        set: |options, value| {
            options.functions = value.choices();
            options.functions.sort_unstable();
            options.functions.dedup();
        }, ..OF },
    OptionRow { name: "frames", kind: Names { commas: false }, default: "the robot's tips", metavar: "NAME", command_line: As("frame"),
        doc: "The frames (links) that poses, velocities and Jacobians are asked for",
        example: &["tool"], hash: &["frames"], set: |options, value| options.frames = value.names().to_vec(), ..OF },
    OptionRow { name: "scalar", kind: Words(Vocabulary::of::<Scalar>()), default: "f64", metavar: "SCALAR",
        doc: "The scalar type; of several each but the first has a module `single` or `double` with the same items",
        also: "numbers", example: &["f32"], hash: &["scalar"],
        set: |options, value| if let [first, others @ ..] = &value.choices()[..] {
            (options.scalar, options.also) = (*first, others.to_vec());
        }, ..OF },
    OptionRow { name: "lanes", kind: Word(Vocabulary::of::<Lanes>(), None), default: "one state at a time", metavar: "HOME",
        doc: "Beside every function the same over lanes of states and over batches, and where the drivers of batches come from",
        example: &["runtime"], hash: &["lanes"], set: |options, value| options.lanes = Some(value.choice()), ..OF },
    OptionRow { name: "fma", kind: Word(Vocabulary::of::<Fusion>(), Some("std")), default: "the same bits everywhere", metavar: "BY",
        doc: "Compute a·b + c in one rounding, and by what",
        example: &["caller"], hash: &["fma", "fma_by_caller"],
        set: |options, value| (options.fma, options.fma_by_caller) = (true, value.choice::<Fusion>() == Fusion::Caller), ..OF },
    OptionRow { name: "generic", default: "the scalar type alone",
        doc: "Functions take any scalar that is a `straightline::Real`; the output depends on the package `straightline`",
        hash: &["generic"], set: |options, value| options.generic = value.flag(), ..OF },
    OptionRow { name: "rules", kind: Word(Vocabulary::of::<Grade>(), None), default: "all", metavar: "RULES",
        doc: "Which rewrite rules may be used",
        example: &["exact"], hash: &["rules"], set: |options, value| options.grade = value.choice(), ..OF },
    OptionRow { name: "optimise", kind: Word(Vocabulary::of::<OptimisationTier>(), None), default: "full", metavar: "TIER",
        doc: "How much is tried for programs of few operations; another tier has other bits",
        example: &["quick"], hash: &["optimise"], set: |options, value| options.optimise = value.choice(), ..OF },
    OptionRow { name: "forward_dynamics", kind: Word(Vocabulary::of::<ForwardDynamicsMethod>(), None), default: "cheaper", metavar: "METHOD",
        doc: "How forward dynamics is computed",
        example: &["articulated-body"], hash: &["forward_dynamics"], set: |options, value| options.forward_dynamics = value.choice(), ..OF },
    OptionRow { name: "limbs", kind: Word(Vocabulary::of::<LimbForm>(), None), default: "apart", metavar: "FORM",
        doc: "How identical limbs are computed",
        also: "outputs", example: &["auto"], hash: &["limbs"], set: |options, value| options.limbs = value.choice(), ..OF },
    OptionRow { name: "columns", kind: Word(Vocabulary::of::<ColumnForm>(), None), default: "auto", metavar: "FORM",
        doc: "How columns that a function solves for are computed",
        also: "outputs", example: &["apart"], hash: &["columns"], set: |options, value| options.columns = value.choice(), ..OF },
    OptionRow { name: "entries", kind: Word(Vocabulary::of::<WrittenEntries>(), None), default: "all", metavar: "ENTRIES",
        doc: "Which entries of matrices functions write, and whether constants beside them say which can be non-zero",
        also: "outputs", example: &["nonzeros"], hash: &["entries"], set: |options, value| options.entries = value.choice(), ..OF },
    OptionRow { name: "target", kind: Word(Vocabulary::of::<TargetMachine>(), None), default: "any machine", metavar: "MACHINE",
        doc: "The machine that code is made for: short sines in f32 where it computes one angle at a time, and an order for its registers",
        example: &["cortex-m4f"], hash: &["target"], set: |options, value| options.target = Some(value.choice()), ..OF },
    OptionRow { name: "memory", kind: Word(Vocabulary::of::<Memory>(), None), default: "flash", metavar: "MEMORY",
        doc: "The memory that code runs from on the machine of `target`",
        example: &["tcm"], hash: &["memory"], set: |options, value| options.memory = value.choice(), ..OF },
    OptionRow { name: "figures",
        doc: "Beside every function a constant of its instructions, flash, stack and cycles on the machine of `target`, read off the machine code that rustc makes",
        needs: Some(("target", "x86-64-v3")), hash: &["figures"], set: |options, value| options.figures = value.flag(), ..OF },
    OptionRow { name: "self_test",
        doc: "Write `self_test()` beside the functions, which compares what a machine computes with what the compiler expects, to the bit",
        hash: &["self_test"], set: |options, value| options.self_test = value.flag(), ..OF },
    OptionRow { name: "max_part_operations", kind: Whole("a whole number from 100", |n| n >= 100.0), default: "12000", metavar: "N",
        doc: "Longer functions are cut into parts of at most so many operations",
        example: &["100"], hash: &["limits", "operations"], set: |options, value| options.limits.operations = value.count(), ..OF },
    OptionRow { name: "fixed", kind: Word(Vocabulary::of::<FixedProducts>(), Some("mulh")), default: "floating point alone", metavar: "PRODUCTS",
        doc: "A module `fixed` with the same functions over integers of 32 bits, for machines without floating point, and how these multiply",
        also: "numbers", example: &["muls"], hash: &["fixed"], set: |options, value| options.fixed = Some(value.choice()), ..OF },
    OptionRow { name: "fixed_error", kind: Real("above 0 and below 1", |x| x > 0.0 && x < 1.0), default: "1e-6", metavar: "PART",
        doc: "The greatest certified error of results in fixed point, as a part of the greatest magnitude of their array",
        also: "numbers", example: &["1e-4"], hash: &["fixed_error"], set: |options, value| options.fixed_error = value.number(), ..OF },
    OptionRow { name: "certify_seconds", kind: Real("above 0 and up to 86400 s", |s| s > 0.0 && s <= Effort::MOST_SECONDS), metavar: "SECONDS",
        doc: "Certify bounds of errors, tighter ones, for so long per function and scalar type [s]; bounds then depend on the machine",
        default: "as long as it takes", also: "numbers", example: &["0.5"], hash: &["certify"],
        set: |options, value| {
            let effort = options.certify.get_or_insert_default();
            (effort.boxes, effort.time) = (Effort::MOST_BOXES, Some(Duration::from_secs_f64(value.number())));
        }, ..OF },
    OptionRow { name: "certify_boxes", kind: Whole("between 1 and 100000", |n| n >= 1.0 && n <= Effort::MOST_BOXES as f64), metavar: "N",
        doc: "Certify bounds of errors, tighter ones: the ranges of each result are cut into so many boxes",
        default: "1, or as many as `certify_seconds` allows", also: "numbers", example: &["40"], hash: &["certify"],
        set: |options, value| options.certify.get_or_insert_default().boxes = value.count(), ..OF },
    OptionRow { name: "certify_state",
        doc: "Certify bounds of errors, and beside every function write `…_error_bound`, which bounds the errors at the state at hand",
        also: "numbers", hash: &["certify"],
        set: |options, value| if value.flag() { options.certify.get_or_insert_default().companions = true }, ..OF },
    OptionRow { name: "certify", // behind the others: `false` is none of them
        doc: "Certify a bound of the errors of every function, for the ranges of its inputs",
        also: "numbers", hash: &["certify"],
        set: |options, value| options.certify = value.flag().then(|| options.certify.unwrap_or_default()), ..OF },
    OptionRow { name: "mixed_precision", kind: Real("a number above 0", |x| x > 0.0), metavar: "MAX_ERROR",
        doc: "Of f32, compute in f64 what it takes for certified errors up to so much, in the results' units, and nothing else",
        example: &["1e-3"], hash: &["scene", "budget"],
        set: |options, value| for function in &options.functions {
            let budget = options.scene.budgets.entry(*function).or_default();
            (budget.max_error, budget.mixed_precision) = (Some(MaxError::All(value.number())), true);
        }, ..OF },
    OptionRow { name: "floating_base", group: Model, default: "as the robot file says",
        doc: "The root link moves freely: q begins with its position and quaternion (x y z qx qy qz qw)",
        scene: As("`base = \"floating\"` in [hold]"), hash: &["model", "floating_base"],
        set: |options, value| options.model.floating_base = value.flag(), ..OF },
    OptionRow { name: "joint_order", kind: Names { commas: true }, group: Model, default: "depth first, as in the file", metavar: "A,B,C",
        doc: "All joints in the order of their coordinates",
        example: &["elbow", "shoulder"], hash: &["model", "joint_order"],
        set: |options, value| options.model.joint_order = Some(value.names().to_vec()), ..OF },
    OptionRow { name: "angle_tolerance", kind: Real("between 0 and 0.1 rad", |x| (0.0..=0.1).contains(&x)), group: Model, metavar: "RAD",
        doc: "So near to a multiple of 30 or 45 degrees [rad] an angle is taken as that; 0: every angle as it is written",
        default: "1e-15, rounding only", also: "numbers", example: &["1e-6"], hash: &["model", "angle_tolerance"],
        set: |options, value| options.model.angle_tolerance = value.number(), ..OF },
    OptionRow { name: "gravity", kind: Vector, group: Model, default: "the robot file's, or 0, 0, -9.81", metavar: "X,Y,Z",
        doc: "Acceleration due to gravity in the world [m/s²]",
        scene: As("`gravity` in [hold]"), example: &["0", "0", "-1.62"], hash: &["model", "gravity"],
        set: |options, value| options.model.gravity = Some(value.vector()), ..OF },
    OptionRow { name: "allow", kind: Codes(Level::Allow),
        doc: "Say no warnings of this code (`warnings`: none); `straightline explain` lists the codes",
        set: |options, value| options.reporting.levels.set_all(value.names(), Level::Allow), ..LEVEL },
    OptionRow { name: "warn", kind: Codes(Level::Warn),
        doc: "Say warnings of this code, whatever the scene says",
        set: |options, value| options.reporting.levels.set_all(value.names(), Level::Warn), ..LEVEL },
    OptionRow { name: "deny", kind: Codes(Level::Deny),
        doc: "Warnings of this code are errors (`warnings`: all)",
        set: |options, value| options.reporting.levels.set_all(value.names(), Level::Deny), ..LEVEL },
    OptionRow { name: "scene", kind: OfFront, group: Front, default: "everything is wanted, nothing held", metavar: "FILE", builder: As("scene_file"),
        doc: "A scene: what is wanted of the robot, and what is held; everything else is skipped",
        example: &["scenes/still.toml"], scene: Not("the file is the scene"), ..OF },
    OptionRow { name: "module", kind: OfFront, group: Front, default: "none; in a build script the robot file's name",
        doc: "The name of the module that everything stands in (of the derive, beside the type; in a build script of its file)",
        example: &["arm_dynamics"], command_line: Not("`--output` names the file"), scene: ELSEWHERE, ..OF },
    OptionRow { name: "output", kind: OfFront, group: Front, default: "standard output; in a build script cargo's `OUT_DIR`", builder: As("out_dir"),
        doc: "Where to write",
        example: &["src/arm.rs"], macros: Not("a macro writes no file"), scene: ELSEWHERE, ..OF },
    OptionRow { name: "quiet", kind: OfFront, group: Front,
        doc: "Say no warnings, show no progress",
        macros: Not("there is no progress to show; `allow(\"warnings\")` says no warnings"),
        builder: Not("there is no progress to show; `.allow(\"warnings\")` says no warnings"),
        scene: Not("`allow = [\"warnings\"]` in [diagnostics] says no warnings"), ..OF },
];
