//! What to generate, and how: what every front fills in.

mod check;
pub mod optimisations;
pub mod scene_file;
pub mod stable;
pub mod table;
pub mod value;

pub use check::check_options;
pub use optimisations::{FormChoices, Optimisations};
pub use scene_file::SceneFile;
pub use value::{GivenOptions, OptionValue};

use crate::choices::{
    ColumnForm, FixedProducts, Lanes, LimbForm, Memory, OptimisationTier, TargetMachine, WrittenEntries,
};
use crate::description;
use crate::description::drives::WrittenDrive;
use crate::diagnostic::{Diagnostics, Reporting, Source};
use crate::function::{ForwardDynamicsMethod, Function};
use crate::scene::{Budget, Scene};
use std::ffi::OsString;
use straightline_graph::certify::Effort;
use straightline_graph::expr::{Grade, RuleSet};
use straightline_graph::schedule::{ScheduleLimits, ScheduleMachine};
use straightline_graph::Scalar;

/// Fields with the names that they have in the text that hashes are made of, and their defaults; behind `..` what is not of the output.
macro_rules! options {
    ($($(#[$doc:meta])* $field:ident $name:literal: $type:ty = $default:expr,)*
        .. $($(#[$silent_doc:meta])* $silent:ident: $silent_type:ty),+) => {
        /// What to generate, and how.
        #[derive(Clone, Debug)]
        pub struct Options {
            $($(#[$doc])* pub $field: $type,)*
            $($(#[$silent_doc])* pub $silent: $silent_type,)+
        }

        impl Default for Options {
            fn default() -> Self {
                Options { $($field: $default,)* $($silent: Default::default(),)+ }
            }
        }

        stable::fields! {
            Options = { $($name: $field,)* .. $($silent),+ }
        }
    };
}

options! {
    /// The functions, without repetition.
    functions "functions": Vec<Function> = Function::all().collect(),
    /// The frames of the functions that answer per frame; none: the tips of the robot.
    frames "frames": Vec<String> = Vec::new(),
    /// The scalar type.
    scalar "scalar": Scalar = Scalar::F64,
    /// Other scalar types: for each a module with the same items ([`Scalar::module`]).
    also "also": Vec<Scalar> = Vec::new(),
    /// Whether functions over lanes and batches of states stand beside the plain ones.
    lanes "lanes": Option<Lanes> = None,
    /// Whether a·b + c is one operation, with one rounding, where the machine has it.
    fma "fma": bool = false,
    /// Whether that operation comes from the crate around the output, as `crate::mul_add_f64` (of f32 `crate::mul_add_f32`): the
    /// output needs `core` alone then.
    fma_by_caller "fma_by_caller": bool = false,
    /// Whether plain functions take any scalar that is a `straightline::Real`; lanes, batches and stages keep `scalar`.
    generic "generic": bool = false,
    /// The weakest rules allowed: with [`Grade::Exact`] the output is the generic runtime bit for bit.
    grade "rules": Grade = Grade::Algebraic,
    /// How much is tried for programs of few operations.
    optimise "optimise": OptimisationTier = OptimisationTier::default(),
    /// How forward dynamics is computed.
    forward_dynamics "forward_dynamics": ForwardDynamicsMethod = ForwardDynamicsMethod::default(),
    /// How identical limbs are computed.
    limbs "limbs": LimbForm = LimbForm::default(),
    /// How columns that a function solves for are computed.
    columns "columns": ColumnForm = ColumnForm::default(),
    /// Which entries of matrices are written.
    entries "entries": WrittenEntries = WrittenEntries::default(),
    /// The machine that code is made for; none: any.
    target "target": Option<TargetMachine> = None,
    /// The memory that it runs from there.
    memory "memory": Memory = Memory::default(),
    /// Whether constants beside every function say what it takes there, read off the machine code that rustc makes.
    figures "figures": bool = false,
    /// Whether `self_test` stands beside the functions.
    self_test "self_test": bool = false,
    /// How long one function may be.
    limits "limits": ScheduleLimits = ScheduleLimits::default(),
    /// How the robot file is read.
    model "model": crate::model::ModelOptions = crate::model::ModelOptions::default(),
    /// What is wanted and what is held.
    scene "scene": Scene = Scene::default(),
    /// Whether rounding errors are bounded, and how much is spent on it; a budget of an error bounds them, too.
    certify "certify": Option<Effort> = None,
    /// Whether a module `fixed` has the same functions over integers, and how these multiply.
    fixed "fixed": Option<FixedProducts> = None,
    /// The greatest error of a result there, as a part of the greatest magnitude in its port.
    fixed_error "fixed_error": f64 = 1e-6,
    ..
    /// What becomes of warnings, and in whose words they are said: nothing of what is generated.
    reporting: Reporting,
    /// The rustc that figures of machine code are measured with; none: the one that the environment variable `RUSTC` names, or else `rustc`.
    rustc: Option<OsString>
}

impl Options {
    /// The text that hashes of generated files are made of: names and values of what is not at its default.
    pub fn hashed(&self) -> String {
        stable::Stable::stable_text(self)
    }

    /// The same options, whose scene knows the drives of a robot file as far as it names them. What is wrong with the file is said elsewhere.
    #[must_use]
    pub fn knowing(&self, source: &Source) -> Options {
        if !self.scene.parameters.iter().any(|p| !p.is_load()) {
            return self.clone();
        }
        let description = description::read(source, &mut Diagnostics::new());
        self.knowing_drives(description.as_ref().map_or(&[], |d| &d.drives))
    }

    /// The same with the drives as they were read.
    pub(crate) fn knowing_drives(&self, drives: &[WrittenDrive]) -> Options {
        Options { scene: self.scene.knowing(drives), ..self.clone() }
    }

    /// Whether the sines of a function are short ones, if its angles are small: a machine that computes one angle at a time, and numbers of one
    /// format without fused operations, so that one kernel serves all forms of the function.
    pub fn wants_short_sines(&self, function: Function) -> bool {
        let is_mixed = self.scene.budgets.get(&function).is_some_and(|budget| budget.mixed_precision);
        let is_plain = !(self.fma || self.generic || self.lanes.is_some() || is_mixed);
        self.target.is_some_and(|machine| machine.row().is_scalar) && is_plain && self.grade == Grade::Algebraic
    }

    /// The functions whose machine code is asked for: by `figures`, or by budgets that count on it.
    pub fn measured(&self) -> impl Iterator<Item = Function> + '_ {
        let counts = |key: &str| key != Budget::STACK || self.measures_stack();
        let by_budget = move |b: &Budget| b.of_machine_code().iter().any(|(key, most)| most.is_some() && counts(key));
        let is_measured = move |f: &&Function| self.figures || self.scene.budgets.get(f).is_some_and(by_budget);
        self.functions.iter().filter(move |f| self.target.is_some() && is_measured(f)).copied()
    }

    /// Whether `max_stack_bytes` means the stack of machine code: where the machine is known and its code is read.
    pub fn measures_stack(&self) -> bool {
        self.target.is_some_and(|machine| machine.row().code.is_some())
    }

    /// What orders of operations are chosen for, if the machine is known and has registers for numbers.
    pub fn schedule_machine(&self) -> Option<ScheduleMachine> {
        self.target.and_then(|machine| machine.for_schedules(self.memory))
    }

    /// The optimisations that these options allow.
    pub fn optimisations(&self) -> Optimisations {
        let algebraic = self.grade == Grade::Algebraic;
        let searches = algebraic && self.optimise == OptimisationTier::Full;
        // one method for all scenes of a robot, where bits count
        let cheaper = searches && self.forward_dynamics == ForwardDynamicsMethod::Cheaper;
        Optimisations {
            folding: algebraic,
            algebraic,
            reduced: algebraic,
            sums: algebraic,
            chosen: searches,
            forms: if searches { FormChoices::ALL } else { FormChoices::default() },
            angle_sums: searches,
            cheaper,
            limbs: algebraic && self.limbs != LimbForm::Apart,
            columns: algebraic && self.columns != ColumnForm::Apart,
            substitutes: searches,
        }
    }

    /// The rewrite rules that these options allow.
    pub fn rules(&self) -> RuleSet {
        self.rules_of(self.optimisations())
    }

    pub(crate) fn rules_of(&self, optimisations: Optimisations) -> RuleSet {
        optimisations.rules(self.scalar).with_short_angles(self.generic || self.scalar.is_short())
    }
}
