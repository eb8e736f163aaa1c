//! For build scripts: a robot file beside the manifest becomes a Rust file in `OUT_DIR`.
//!
//! In `build.rs`:
//! ```no_run
//! use straightline_codegen::{Builder, Function};
//!
//! fn main() -> Result<(), straightline_codegen::fronts::builder::Error> {
//!     Builder::new("robots/panda.urdf")
//!         .functions([Function::InverseDynamics, Function::MassMatrix])
//!         .frames(["panda_hand_tcp"])
//!         .build()?;
//!     Ok(())
//! }
//! ```
//! and where the dynamics are wanted:
//! ```ignore
//! pub mod panda {
//!     include!(concat!(env!("OUT_DIR"), "/panda.rs"));
//! }
//! ```
//! The build runs again when the robot file changes. Complaints name the file, the line and the column: errors end the
//! build, warnings do not. Nothing is written outside `OUT_DIR`.

use crate::choices::{ColumnForm, Fusion, Lanes, LimbForm, Memory, OptimisationTier, TargetMachine};
use crate::compile::compile;
use crate::diagnostic::{Diagnostic, Diagnostics, Front, Reporting, Severity, Source};
use crate::emit::Generated;
use crate::function::{ForwardDynamicsMethod, Function};
use crate::identifier::prefix;
use crate::options::{scene_file, GivenOptions, OptionValue, Options, SceneFile};
use crate::output::write_file_apart;
use crate::scene::Scene;
use std::fmt;
use std::path::{Path, PathBuf};
use straightline_graph::certify::Effort;
use straightline_graph::expr::Grade;
use straightline_graph::Scalar;

/// Compiles a robot file as it is, with all functions, into `$OUT_DIR/<file stem>.rs`.
///
/// # Errors
/// See [`Builder::build`].
pub fn compile_robot(robot: impl Into<PathBuf>) -> Result<Generated, Error> {
    Builder::new(robot).build()
}

/// What to make of a robot file; see the [module](self).
#[derive(Clone, Debug)]
#[must_use = "nothing happens before `build`"]
pub struct Builder {
    robot: PathBuf,
    scene_file: Option<PathBuf>,
    module: Option<String>,
    out_dir: Option<PathBuf>,
    scene: Scene,
    settings: GivenOptions,
    wrong: Vec<Diagnostic>,
}

impl Builder {
    /// From a robot file, relative to the package's manifest; with all functions, in f64.
    pub fn new(robot: impl Into<PathBuf>) -> Self {
        Builder {
            robot: robot.into(),
            scene_file: None,
            module: None,
            out_dir: None,
            scene: Scene::default(),
            settings: GivenOptions::default(),
            wrong: Vec::new(),
        }
    }

    /// Any option by its name, as `guide/src/options.md` lists them. What is wrong with it is said by [`Builder::build`].
    pub fn option(mut self, name: &str, value: impl Into<OptionValue>) -> Self {
        let given = self.settings.set(name, value, Front::Builder);
        self.wrong.extend(given.err().unwrap_or_default());
        self
    }

    /// Several scalar types: the first as [`Builder::scalar`], for each of the others a module `single` or `double` with the
    /// same items.
    pub fn scalars(self, scalars: impl IntoIterator<Item = Scalar>) -> Self {
        self.option("scalar", OptionValue::of_choices(scalars))
    }

    /// Bounds the rounding errors of every function, as constants beside the functions: see [`certify`](straightline_graph::certify).
    pub fn certify(self, effort: Effort) -> Self {
        let certified = self.option("certify", true).option("certify_state", effort.companions);
        let timed = match effort.time {
            Some(time) => certified.option("certify_seconds", time.as_secs_f64()),
            None => certified,
        };
        timed.option("certify_boxes", effort.boxes)
    }

    /// A scene file (`SCENES.md`), relative to the package's manifest: what is wanted of the robot, and what is held. Options
    /// that this builder is given count before those of the file; the build runs again when it changes.
    pub fn scene_file(mut self, scene: impl Into<PathBuf>) -> Self {
        self.scene_file = Some(scene.into());
        self
    }

    /// A scene made in code; a scene file takes its place.
    pub fn scene(mut self, scene: Scene) -> Self {
        self.scene = scene;
        self
    }

    /// The name of the output, without `.rs`; otherwise the robot file's.
    pub fn module(mut self, name: impl Into<String>) -> Self {
        self.module = Some(name.into());
        self
    }

    /// Where to write; otherwise cargo's `OUT_DIR`.
    pub fn out_dir(mut self, directory: impl Into<PathBuf>) -> Self {
        self.out_dir = Some(directory.into());
        self
    }

    /// Compiles, writes the file, and tells cargo what there is to tell.
    ///
    /// # Errors
    /// The robot file or the options are wrong (cargo shows each complaint with its place), or a file cannot be read
    /// or written.
    pub fn build(self) -> Result<Generated, Error> {
        let variable = |name: &'static str| std::env::var_os(name).map(PathBuf::from);
        // without cargo: relative to where we are
        let manifest = variable("CARGO_MANIFEST_DIR").unwrap_or_default();
        let out_dir = self.out_dir.clone().or_else(|| variable("OUT_DIR")).ok_or(Error::NoOutDir)?;
        let Messages { cargo, person, result } = self.run(&manifest, &out_dir);
        cargo.iter().for_each(|line| println!("{line}"));
        eprint!("{person}");
        result
    }

    /// What [`build`](Builder::build) does and says, without saying it.
    #[doc(hidden)]
    pub fn run(&self, manifest: &Path, out_dir: &Path) -> Messages {
        let robot = manifest.join(&self.robot);
        let scene = self.scene_file.as_ref().map(|scene| manifest.join(scene));
        let files: Vec<&PathBuf> = [&robot].into_iter().chain(&scene).collect();
        let mut messages = Messages {
            cargo: files.iter().map(|file| format!("cargo::rerun-if-changed={}", file.display())).collect(),
            person: String::new(),
            result: Err(Error::NoOutDir),
        };
        messages.result = self.compile(&robot, scene.as_deref(), out_dir, &mut messages);
        if let Err(error @ (Error::Read(..) | Error::Write(_))) = &messages.result {
            messages.cargo.push(format!("cargo::error={error}"));
        }
        messages
    }

    fn compile(
        &self,
        robot: &Path,
        scene: Option<&Path>,
        out_dir: &Path,
        messages: &mut Messages,
    ) -> Result<Generated, Error> {
        let read = |file: &Path, shown: &Path| {
            let bytes = std::fs::read(file).map_err(|e| Error::Read(file.to_path_buf(), e))?;
            Ok(Source::of_file(&shown.display().to_string(), bytes, file))
        };
        let source = read(robot, &self.robot)?;
        let file = match (scene, &self.scene_file) {
            (Some(file), Some(shown)) => scene_file::read_partly(&read(file, shown)?),
            _ => SceneFile { scene: self.scene.clone(), ..SceneFile::default() },
        };
        let reporting = Reporting { front: Front::Builder, ..Reporting::default() };
        let mut options = file.with(&self.settings, Options { reporting, ..Options::default() });
        options.scene.places.keep_further(self.wrong.iter().cloned());
        let compiled = compile(&source, &options);
        let said = compiled.as_ref().map_or_else(|diagnostics| diagnostics, |generated| &generated.warnings);
        let further: Vec<PathBuf> = said.named_files().map(|(file, _)| file.to_path_buf()).collect();
        messages.cargo.extend(further.iter().map(|file| format!("cargo::rerun-if-changed={}", file.display())));
        let generated = compiled.map_err(|diagnostics| {
            messages.tell(&diagnostics);
            let of_robot = diagnostics.iter().any(|d| d.place.as_ref().is_none_or(|p| *p.file == *source.path()));
            let path = self.scene_file.as_ref().filter(|_| !of_robot).unwrap_or(&self.robot).clone();
            Error::Robot { path, errors: diagnostics.count(Severity::Error) }
        })?;
        messages.tell(&generated.warnings);
        let stem = self.robot.file_stem().unwrap_or_default().to_string_lossy();
        let module = self.module.clone().unwrap_or_else(|| prefix(&stem));
        if Path::new(&module).file_name().is_none_or(|name| name != module.as_str()) {
            return Err(Error::Module(module));
        }
        let file = out_dir.join(format!("{module}.rs"));
        let inputs = [robot].into_iter().chain(scene).chain(further.iter().map(PathBuf::as_path));
        write_file_apart(&file, &generated.text, inputs).map_err(Error::Write)?;
        Ok(generated)
    }
}

/// Methods that give the option of their name a value.
macro_rules! options {
    ($($(#[$doc:meta])* $name:ident($value:ident: $type:ty) = $given:expr;)*) => {
        impl Builder {$(
            $(#[$doc])*
            pub fn $name(self, $value: $type) -> Self {
                self.option(stringify!($name), $given)
            }
        )*}
    };
}

options! {
    /// These functions only.
    functions(functions: impl IntoIterator<Item = Function>) = OptionValue::of_choices(functions);
    /// The frames (links) of the functions that answer per frame; otherwise the tips of the robot.
    frames(frames: impl IntoIterator<Item = impl Into<String>>) = OptionValue::of_words(frames);
    /// The scalar type; otherwise f64.
    scalar(scalar: Scalar) = scalar;
    /// Beside every function the same over lanes of states and over batches.
    lanes(lanes: Lanes) = lanes;
    /// Whether plain functions take any scalar that is a `straightline::Real`: f32, f64, double-double, dual numbers, types of
    /// your own. The code depends on the package `straightline`. Lanes, batches and stages keep [`Builder::scalar`].
    generic(generic: bool) = generic;
    /// a·b + c in one rounding: by `std`, where the machine has it, so that last bits are other ones there than elsewhere; or by the crate
    /// around the code.
    fma(by: Fusion) = by;
    /// The weakest rewrite rules allowed; with [`Grade::Exact`] the code is the generic runtime, bit for bit.
    rules(grade: Grade) = grade;
    /// Of f32, computes in f64 what it takes for certified errors up to so much, in the results' units, and nothing else.
    mixed_precision(max_error: f64) = max_error;
    /// How identical limbs are computed; otherwise each by itself.
    limbs(form: LimbForm) = form;
    /// How columns that a function solves for are computed; otherwise as lanes of loops where that takes hardly more operations.
    columns(form: ColumnForm) = form;
    /// How much is tried for programs of few operations; otherwise everything.
    optimise(tier: OptimisationTier) = tier;
    /// How forward dynamics is computed; otherwise the cheaper way for this robot.
    forward_dynamics(method: ForwardDynamicsMethod) = method;
    /// The machine that the code is made for; otherwise any.
    target(machine: TargetMachine) = machine;
    /// The memory that it runs from there; otherwise flash.
    memory(memory: Memory) = memory;
    /// Whether constants say what each function takes on that machine, read off the machine code that rustc makes.
    figures(figures: bool) = figures;
    /// Functions of more operations are cut into parts.
    max_part_operations(operations: usize) = operations;
    /// Whether the root link moves freely in the world.
    floating_base(floating: bool) = floating;
    /// The joints in the order of their coordinates, all of them; otherwise depth first, as in the file.
    joint_order(joints: impl IntoIterator<Item = impl Into<String>>) = OptionValue::of_words(joints);
    /// So near to a multiple of 30 or 45 degrees \[rad\] an angle is taken as that; 0: every angle as it is written.
    angle_tolerance(tolerance: f64) = tolerance;
    /// Acceleration due to gravity in the world \[m/s²\]; otherwise the file's, or (0, 0, −9.81).
    gravity(gravity: [f64; 3]) = gravity;
    /// Warnings of this code are not said; `"warnings"`: none.
    allow(code: impl Into<String>) = OptionValue::of_words([code]);
    /// Warnings of this code are said, whatever a scene or an earlier call says.
    warn(code: impl Into<String>) = OptionValue::of_words([code]);
    /// Warnings of this code are errors; `"warnings"`: all.
    deny(code: impl Into<String>) = OptionValue::of_words([code]);
}

/// What goes where.
#[derive(Debug)]
#[doc(hidden)]
pub struct Messages {
    /// Lines on standard output, which cargo reads.
    pub cargo: Vec<String>,
    /// Text on standard error, which cargo shows when the build fails.
    pub person: String,
    /// What was made.
    pub result: Result<Generated, Error>,
}

impl Messages {
    fn tell(&mut self, diagnostics: &Diagnostics) {
        for diagnostic in diagnostics.iter() {
            let kind = match diagnostic.severity {
                Severity::Error => "error",
                Severity::Warning => "warning",
                Severity::Note => continue,
            };
            self.cargo.push(format!("cargo::{kind}={}", diagnostic.line()));
        }
        // cargo shows warnings from its own lines, whether the build fails or not
        self.person.push_str(&diagnostics.at_least(Severity::Error).render());
    }
}

/// Why there is no output. Complaints about the robot file or the scene have been printed already.
pub enum Error {
    /// The robot file, the scene, or what was asked of them, is wrong.
    Robot {
        /// The file, as it was given.
        path: PathBuf,
        /// Number of errors.
        errors: usize,
    },
    /// The robot file or the scene cannot be read.
    Read(PathBuf, std::io::Error),
    /// The output cannot be written.
    Write(std::io::Error),
    /// What [`Builder::module`] was told is no name of a file.
    Module(String),
    /// Neither cargo's `OUT_DIR` nor [`Builder::out_dir`] says where to write.
    NoOutDir,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Robot { path, errors: 1 } => write!(f, "{}: 1 error", path.display()),
            Error::Robot { path, errors } => write!(f, "{}: {errors} errors", path.display()),
            Error::Read(path, error) => write!(f, "{}: {error}", path.display()),
            Error::Write(error) => write!(f, "{error}"),
            Error::Module(name) => {
                write!(f, "`{}` is no name of a module: it becomes that of a file", name.escape_default())
            }
            Error::NoOutDir => f.write_str("OUT_DIR is not set: outside of a build script, say where with `out_dir`"),
        }
    }
}

/// As [`fmt::Display`]: this is what a build script prints whose `main` returns it.
impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Error::Read(_, error) | Error::Write(error) => Some(error),
            Error::Robot { .. } | Error::Module(_) | Error::NoOutDir => None,
        }
    }
}
