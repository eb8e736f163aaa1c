//! What to generate, and how: what every front fills in.

mod check;
pub mod optimisations;
mod scene_file;
pub mod stable;

pub use check::check_options;
pub use optimisations::{Forms, Optimisations};

use crate::choices::{Lanes, LimbForm};
use crate::description;
use crate::description::drives::Drive;
use crate::diagnostic::{Diagnostics, Reporting, Source};
use crate::function::{ForwardDynamicsMethod, Function};
use crate::scene::Scene;
use straightline_graph::certify::Effort;
use straightline_graph::expr::{Grade, RuleSet};
use straightline_graph::schedule::Limits;
use straightline_graph::Scalar;

/// What to generate, and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// The functions, without repetition.
    pub functions: Vec<Function>,
    /// The frames of the functions that answer per frame; none: the tips of the robot.
    pub frames: Vec<String>,
    /// The scalar type.
    pub scalar: Scalar,
    /// Other scalar types: for each a module with the same items ([`Scalar::module`]).
    pub also: Vec<Scalar>,
    /// Whether functions over lanes and batches of states stand beside the plain ones.
    pub lanes: Option<Lanes>,
    /// Whether a·b + c is one operation, with one rounding, where the machine has it.
    pub fma: bool,
    /// Whether that operation comes from the crate around the output, as `crate::mul_add_f64` (of f32 `crate::mul_add_f32`): the
    /// output needs `core` alone then.
    pub fma_by_caller: bool,
    /// Whether plain functions take any scalar that is a `straightline::Real`; lanes, batches and stages keep `scalar`.
    pub generic: bool,
    /// The weakest rules allowed: with [`Grade::Exact`] the output is the generic runtime bit for bit.
    pub grade: Grade,
    /// How forward dynamics is computed.
    pub forward_dynamics: ForwardDynamicsMethod,
    /// How identical limbs are computed.
    pub limbs: LimbForm,
    /// How long one function may be.
    pub limits: Limits,
    /// How the robot file is read.
    pub model: crate::model::ModelOptions,
    /// What is wanted and what is held.
    pub scene: Scene,
    /// Whether rounding errors are bounded, and how much is spent on it; a budget of an error bounds them, too.
    pub certify: Option<Effort>,
    /// What becomes of warnings, and in whose words they are said: nothing of what is generated.
    pub reporting: Reporting,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            functions: Function::all().collect(),
            frames: Vec::new(),
            scalar: Scalar::F64,
            also: Vec::new(),
            lanes: None,
            fma: false,
            fma_by_caller: false,
            generic: false,
            grade: Grade::Algebraic,
            forward_dynamics: ForwardDynamicsMethod::default(),
            limbs: LimbForm::default(),
            limits: Limits::default(),
            model: crate::model::ModelOptions::default(),
            scene: Scene::default(),
            certify: None,
            reporting: Reporting::default(),
        }
    }
}

impl Options {
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
    pub(crate) fn knowing_drives(&self, drives: &[Drive]) -> Options {
        Options { scene: self.scene.knowing(drives), ..self.clone() }
    }

    /// The optimisations that these options allow.
    pub fn optimisations(&self) -> Optimisations {
        let algebraic = self.grade == Grade::Algebraic;
        // one method for all scenes of a robot, where bits count
        let cheaper = algebraic && self.forward_dynamics == ForwardDynamicsMethod::Cheaper;
        Optimisations {
            folding: algebraic,
            algebraic,
            reduced: algebraic,
            sums: algebraic,
            chosen: algebraic,
            forms: if algebraic { Forms::ALL } else { Forms::default() },
            angle_sums: algebraic,
            cheaper,
            limbs: algebraic && self.limbs != LimbForm::Apart,
            substitutes: algebraic,
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
