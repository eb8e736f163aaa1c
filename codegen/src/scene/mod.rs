//! What is wanted of a robot, and what is held constant: everything else is skipped.
//!
//! A scene changes no equation. It edits the robot before tracing ([`Scene::locked`], [`Scene::payloads`], effects), binds
//! inputs to constants ([`Scene::zero`], gravity), makes constants inputs ([`Scene::parameters`]), and selects results
//! ([`Scene::outputs`]); folding and dead code do the rest.

mod apply;
pub(crate) mod check;
mod check_contact;
pub mod contact;
pub mod free_drive;
pub mod messages;
pub mod parameter;
mod places;
mod ranges;

pub use apply::apply;
pub use contact::SceneContacts;
pub use parameter::Parameter;
pub use places::Places;
pub use ranges::{ranges_in_words, InputRange, JointRanges, Ranges};

use crate::description::drives::WrittenDrive;
use crate::description::flexible::{BaseSupport, Flexible};
use crate::description::WrittenCoupling;
use crate::diagnostic::Diagnostic;
use crate::function::{Function, SelectedRows};
use crate::model::ModelOptions;
use std::collections::BTreeMap;
use straightline_core::base_parameters::JointParameter;
use straightline_core::model::Model;
use straightline_graph::expr::Port;

/// A scene. The default asks for everything and holds nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// What of each function is wanted; a function that is not named is wanted whole.
    pub outputs: BTreeMap<Function, Selection>,
    /// Whether the mass matrix and Jacobians are written column after column instead of row after row.
    pub by_columns: bool,
    /// Gravity.
    pub gravity: Gravity,
    /// How the robot stands in the world.
    pub base: Base,
    /// Joints that do not move, with their coordinates \[rad or m\]: their bodies become one.
    pub locked: Vec<(String, f64)>,
    /// Bodies welded to links.
    pub payloads: Vec<Payload>,
    /// What drives the joints, beside the robot file's own drives.
    pub drives: Vec<WrittenDrive>,
    /// Joints that follow others, beside those of the robot file.
    pub couplings: Vec<WrittenCoupling>,
    /// Links that bend, in place of what the robot file says of them.
    pub flexible: Vec<Flexible>,
    /// Springs and dampers below the root link.
    pub support: Option<BaseSupport>,
    /// What is known to be zero.
    pub zero: Zero,
    /// Which effects beside rigid bodies are in.
    pub effects: Effects,
    /// What of joints has columns in regressors, beside the bodies.
    pub regressor: Vec<JointParameter>,
    /// What stays an input of the generated functions.
    pub parameters: Vec<Parameter>,
    /// What the robot touches.
    pub contacts: SceneContacts,
    /// Whether the staged form is generated beside the plain functions.
    pub staged: bool,
    /// What a function may cost at most.
    pub budgets: BTreeMap<Function, Budget>,
    /// The values that inputs can have.
    pub ranges: Ranges,
    /// Where its values stand in a scene file; empty for a scene made in code.
    pub places: Places,
}

impl Scene {
    /// Whether it asks for everything and holds nothing, so that it leaves every function as it is.
    pub fn is_empty(&self) -> bool {
        let (budgets, ranges, places) = (self.budgets.clone(), self.ranges.clone(), self.places.clone());
        let contacts = self.contacts.clone();
        *self == Scene { budgets, staged: self.staged, ranges, contacts, places, ..Scene::default() }
    }

    /// The options under which the robot file is read for this scene.
    pub fn model_options(&self, options: &ModelOptions) -> ModelOptions {
        let floats = matches!(self.base, Base::Floating | Base::Moving);
        // of options that hold them already as they are
        let own = if options.flexible == self.flexible { &[] } else { &self.flexible[..] };
        let own_couplings = if options.couplings == self.couplings { &[] } else { &self.couplings[..] };
        ModelOptions {
            floating_base: options.floating_base || floats,
            flexible: [&options.flexible[..], own].concat(),
            support: self.support.clone().or_else(|| options.support.clone()),
            rigid_links: options.rigid_links || !self.effects.elastic_links,
            couplings: [&options.couplings[..], own_couplings].concat(),
            uncoupled: options.uncoupled || !self.effects.couplings,
            open_loops: options.open_loops || !self.effects.loops,
            ..options.clone()
        }
    }

    /// The same scene with what it has to know of the robot file's drives: of those whose numbers are parameters, how they are written.
    #[must_use]
    pub fn knowing(&self, of_file: &[WrittenDrive]) -> Scene {
        let mut scene = self.clone();
        let all: Vec<&WrittenDrive> = of_file.iter().chain(&self.drives).collect();
        for parameter in &mut scene.parameters {
            let Parameter::Drive { drive, form, .. } = parameter else { continue };
            let written = all.iter().find(|d| d.name.value == *drive);
            *form = written
                .map(|d| Box::new(d.in_part(self.effects.elastic_transmissions, self.effects.transmission_losses)));
        }
        scene
    }

    /// Whether functions take inertial parameters of bodies, whose frames and unit have to be known where they are made.
    pub(crate) fn has_loads(&self) -> bool {
        self.parameters.iter().any(Parameter::is_load)
    }

    /// The same scene with its outputs spelled out for a robot: where the base moves as it is told, of forces over the
    /// joints those of the joints beside it.
    pub fn resolved<T>(&self, model: &Model<T>) -> Scene {
        let mut scene = self.clone();
        if self.base == Base::Moving {
            let joints = model.independent_joints().filter(|j| !j.kind.is_base());
            let joints: Vec<String> = joints.map(|j| j.name.clone()).collect();
            for function in Function::all().filter(|f| f.is_torque()) {
                let selection = scene.outputs.entry(function).or_default();
                if selection.joints.is_empty() {
                    selection.joints.clone_from(&joints);
                }
            }
        }
        scene
    }
}

/// The part of a function's results that is wanted. Names that are empty lists mean all.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// Components of a vector over the joints, or columns of the mass matrix, by joint name.
    pub joints: Vec<String>,
    /// Frames, by name.
    pub frames: Vec<String>,
    /// Which part of each result.
    pub part: ResultPart,
    /// Blocks of results, by name.
    pub results: Vec<String>,
}

impl Selection {
    /// Whether a block of results is wanted.
    pub fn has(&self, result: &str) -> bool {
        self.results.is_empty() || self.results.iter().any(|name| name == result)
    }
}

/// A part of a result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ResultPart {
    /// All of it.
    #[default]
    Whole,
    /// Of poses the positions, of velocities, accelerations and Jacobians the linear rows.
    Linear,
    /// Of poses the orientations, of velocities, accelerations and Jacobians the angular rows.
    Angular,
    /// Of the mass matrix the diagonal.
    Diagonal,
    /// Of what has six rows, linear ones first, these.
    Rows(SelectedRows),
}

impl ResultPart {
    /// Every part that has a word in scene files; rows have one each.
    pub const WORDS: [(&str, ResultPart); 4] = [
        ("whole", ResultPart::Whole),
        ("linear", ResultPart::Linear),
        ("angular", ResultPart::Angular),
        ("diagonal", ResultPart::Diagonal),
    ];

    /// Its word in scene files, or those of its rows.
    pub fn word(self) -> String {
        match self {
            ResultPart::Rows(rows) => rows.words().join(", "),
            _ => ResultPart::WORDS.iter().find(|w| w.1 == self).map_or("", |w| w.0).to_string(),
        }
    }
}

/// Gravity of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Gravity {
    /// As the robot file or the model options say.
    #[default]
    OfRobot,
    /// This vector in the world \[m/s²\]; zero for none.
    Constant([f64; 3]),
    /// An input `gravity` of every function that depends on it \[m/s²\].
    Input,
}

/// How the robot of a scene stands in the world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Base {
    /// As the robot file or the model options say.
    #[default]
    OfRobot,
    /// The root link is the world, also where the file lets it float.
    Fixed,
    /// The root link moves freely.
    Floating,
    /// The root link moves as q, q̇ and q̈ say, whatever drives it: a floating base of which only the joints' forces are
    /// wanted.
    Moving,
}

/// A body welded to a frame of the robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Payload {
    /// What the scene calls it; of a run-time parameter the input's name is made of it.
    pub name: String,
    /// The frame that carries it.
    pub frame: String,
    /// Mass \[kg\].
    pub mass: f64,
    /// Centre of mass in the frame \[m\].
    pub com: [f64; 3],
    /// Inertia about its centre of mass in the frame's axes: xx, xy, xz, yy, yz, zz \[kg·m²\].
    pub inertia: [f64; 6],
}

/// Inputs that are known to be zero.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Zero {
    /// q̇ = 0: the input is gone.
    pub qd: bool,
    /// q̈ = 0: the input is gone.
    pub qdd: bool,
    /// Joints with q̇ = q̈ = 0; their entries are not read.
    pub joints_at_rest: Vec<String>,
}

/// Effects of the joints, with the numbers of the robot file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effects {
    /// Rotor inertia, reflected to the joint: `rotor_inertia` · `gear_ratio`².
    pub rotor_inertia: bool,
    /// Viscous friction and dampers.
    pub damping: bool,
    /// Coulomb friction.
    pub coulomb: CoulombForm,
    /// Joint springs.
    pub springs: bool,
    /// Losses of gears, by efficiencies.
    pub transmission_losses: bool,
    /// Elastic stages of transmissions; without them a stage is rigid.
    pub elastic_transmissions: bool,
    /// Flexible links and an elastic support; without them links and base are rigid.
    pub elastic_links: bool,
    /// Joints that follow others; without them every joint has a coordinate of its own.
    pub couplings: bool,
    /// Closed loops; without them the robot is the tree that is left where they are cut.
    pub loops: bool,
}

impl Default for Effects {
    fn default() -> Self {
        Effects {
            rotor_inertia: true,
            damping: true,
            coulomb: CoulombForm::Sign,
            springs: true,
            transmission_losses: true,
            elastic_transmissions: true,
            elastic_links: true,
            couplings: true,
            loops: true,
        }
    }
}

/// The form of Coulomb friction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum CoulombForm {
    /// Left out.
    Off,
    /// f sgn(q̇), zero at rest.
    #[default]
    Sign,
    /// f q̇ / √(q̇² + w²) with the speed w \[rad/s or m/s\] at which it has reached 71 %.
    Smooth(f64),
}

/// The greatest bounds that rounding errors of a function's results may have, in the results' units.
#[derive(Clone, Debug, PartialEq)]
pub enum MaxError {
    /// Of every result.
    All(f64),
    /// One per result, in their order.
    Each(Vec<f64>),
    /// By the outputs' names; what is left out is free.
    Outputs(Vec<(String, MaxError)>),
}

/// A bound of errors that does not fit the outputs of its function.
#[derive(Clone, Debug)]
pub struct Misfit {
    /// The output that it was given for, if it was for one.
    pub output: Option<String>,
    /// What is wrong.
    pub complaint: Diagnostic,
}

impl MaxError {
    /// The bound of each result of a function with these outputs; infinite of what is free.
    ///
    /// # Errors
    /// What does not fit the outputs.
    pub fn of_results(&self, outputs: &[Port]) -> Result<Vec<f64>, Box<Misfit>> {
        let count = outputs.iter().map(Port::len).sum();
        match self {
            MaxError::All(most) => Ok(vec![*most; count]),
            MaxError::Each(list) if list.len() == count => Ok(list.clone()),
            MaxError::Each(list) => {
                let names: Vec<&str> = outputs.iter().map(|p| p.name.as_str()).collect();
                let complaint = messages::error_budget_count(&names, list.len(), count);
                Err(Box::new(Misfit { output: None, complaint }))
            }
            MaxError::Outputs(named) => {
                let mut all = vec![f64::INFINITY; count];
                for (name, most) in named {
                    let of = |complaint| Box::new(Misfit { output: Some(name.clone()), complaint });
                    let Some(k) = outputs.iter().position(|p| p.name == *name) else {
                        let known = outputs.iter().map(|p| p.name.as_str());
                        return Err(of(messages::error_budget_output(name, known)));
                    };
                    let first: usize = outputs[..k].iter().map(Port::len).sum();
                    let part = most.of_results(&outputs[k..k + 1]).map_err(|misfit| of(misfit.complaint))?;
                    all[first..first + part.len()].copy_from_slice(&part);
                }
                Ok(all)
            }
        }
    }
}

/// What a function may cost; what is left out is free.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Budget {
    /// Multiplications, additions, divisions and square roots.
    pub max_flops: Option<usize>,
    /// Pairs of sine and cosine.
    pub max_sincos: Option<usize>,
    /// Values alive at once.
    pub max_live: Option<usize>,
    /// Bytes of stack: of the machine code where its machine is known, otherwise for values, as far as known before rustc: live values, and
    /// what is handed from part to part.
    pub max_stack_bytes: Option<usize>,
    /// Bytes of machine code, estimated.
    pub max_code_bytes: Option<usize>,
    /// Instructions per call on the machine that code is made for, read off its machine code.
    pub max_instructions: Option<usize>,
    /// Bytes of flash there.
    pub max_flash_bytes: Option<usize>,
    /// The greatest bounds of rounding errors.
    pub max_error: Option<MaxError>,
    /// Whether a function in f32 may compute in f64 what `max_error` takes.
    pub mixed_precision: bool,
}

impl Budget {
    /// The limit that means the stack of machine code where its machine is known.
    pub const STACK: &'static str = "max_stack_bytes";

    /// The limits that machine code is compared with, by their keys.
    pub fn of_machine_code(&self) -> [(&'static str, Option<usize>); 3] {
        [
            ("max_instructions", self.max_instructions),
            ("max_flash_bytes", self.max_flash_bytes),
            (Budget::STACK, self.max_stack_bytes),
        ]
    }
}
