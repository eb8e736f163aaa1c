//! What the macros expand to, as text; `straightline-macros` is a shell over this.

use crate::compile;
use crate::diagnostic::{Diagnostic, Diagnostics, Front, Reporting, Severity, Source};
use crate::emit::rust::associated_items;
use crate::emit::Generated;
use crate::options::{scene_file, GivenOptions, Options, SceneFile};
use std::path::{Path, PathBuf};

/// What became of a robot file and its scene.
#[derive(Debug)]
pub struct Expansion {
    /// The files that were read: the expansion depends on them, right or wrong.
    pub files: Vec<PathBuf>,
    /// The dynamics, and what a type has of it; or what is wrong.
    pub result: Result<(Generated, String), Refusal>,
    /// What to tell the person besides.
    pub warnings: String,
    /// The text of the scene, right or wrong, if there is one.
    pub scene: Option<String>,
}

/// Why nothing was compiled.
#[derive(Debug, Default)]
pub struct Refusal {
    /// What to tell the person of files and options; empty if it is the scene in the macro alone that is wrong.
    pub message: String,
    /// Errors of a scene that stands in the macro.
    pub of_scene: Vec<Diagnostic>,
}

impl From<String> for Refusal {
    fn from(message: String) -> Self {
        Refusal { message, of_scene: Vec::new() }
    }
}

/// Where the scene of a macro stands.
#[derive(Clone, Debug)]
pub enum SceneOf {
    /// In the file of that name.
    File(String),
    /// In the macro, as the text of a scene file.
    Macro(Source),
}

/// Compiles the robot file that a macro names, in the scene that it names or holds; files are looked for in these
/// directories. What the macro says of options counts before what the scene says.
pub fn expand(robot: &str, scene: Option<&SceneOf>, directories: &[&Path], own: &GivenOptions) -> Expansion {
    let mut files = Vec::new();
    let opened = open(robot, scene, directories, &mut files);
    let text = scene_text(scene, &opened);
    match opened.map_err(|(refusal, _)| refusal).and_then(|opened| compiled(&opened, own, &mut files)) {
        Ok((warnings, generated, associated)) => {
            Expansion { files, result: Ok((generated, associated)), warnings, scene: text }
        }
        Err(refusal) => Expansion { files, result: Err(refusal), warnings: String::new(), scene: text },
    }
}

/// The same, where the options are wrong and nothing is to be made: what else is wrong, if anything is.
pub fn examine(
    robot: &str,
    scene: Option<&SceneOf>,
    directories: &[&Path],
    own: &GivenOptions,
) -> (Vec<PathBuf>, Option<Refusal>, Option<String>) {
    let mut files = Vec::new();
    let opened = open(robot, scene, directories, &mut files);
    let text = scene_text(scene, &opened);
    let refusal = match opened {
        Err((refusal, _)) => Some(refusal),
        Ok(opened) => {
            let found = compile::examine(&opened.robot, &opened.options(own));
            files.extend(files_of(&found));
            found.has_errors().then(|| refusal(&found, &opened))
        }
    };
    (files, refusal, text)
}

/// The files of a macro.
struct Opened {
    robot: Source,
    scene: Option<Source>,
    is_within: bool,
}

impl Opened {
    /// The options of the macro and of the scene.
    fn options(&self, own: &GivenOptions) -> Options {
        let reporting = Reporting { front: Front::Derive, ..Reporting::default() };
        let file = self.scene.as_ref().map_or_else(SceneFile::default, scene_file::read_partly);
        file.with(own, Options { reporting, ..Options::default() })
    }

    /// The path of the scene, if it stands in the macro.
    fn within(&self) -> Option<&str> {
        self.scene.as_ref().filter(|_| self.is_within).map(Source::path)
    }
}

/// Opens robot file and scene and notes the files; what is missing, with the scene's source if that is there.
fn open(
    robot: &str,
    scene: Option<&SceneOf>,
    directories: &[&Path],
    files: &mut Vec<PathBuf>,
) -> Result<Opened, (Refusal, Option<Source>)> {
    let robot = found("robot", robot, directories, files);
    let (scene, is_within) = match scene {
        None => (Ok(None), false),
        Some(SceneOf::File(name)) => (found("scene", name, directories, files).map(Some), false),
        Some(SceneOf::Macro(source)) => (Ok(Some(source.clone())), true),
    };
    match (robot, scene) {
        (Ok(robot), Ok(scene)) => Ok(Opened { robot, scene, is_within }),
        (Err(a), Err(b)) => Err((format!("{a}\n{b}").into(), None)),
        (Err(message), Ok(scene)) => Err((message.into(), scene)),
        (Ok(_), Err(message)) => Err((message.into(), None)),
    }
}

/// The text of the scene; empty if its file cannot be read.
fn scene_text(scene: Option<&SceneOf>, opened: &Result<Opened, (Refusal, Option<Source>)>) -> Option<String> {
    let source = match opened {
        Ok(opened) => opened.scene.as_ref(),
        Err((_, source)) => source.as_ref(),
    };
    scene.map(|_| source.map_or_else(String::new, |source| source.text().to_string()))
}

/// Warnings, dynamics and associated items, or what is wrong.
fn compiled(
    opened: &Opened,
    own: &GivenOptions,
    files: &mut Vec<PathBuf>,
) -> Result<(String, Generated, String), Refusal> {
    let (robot, options) = (&opened.robot, opened.options(own));
    let compiled = compile::compile(robot, &options);
    let said = compiled.as_ref().map_or_else(|diagnostics| diagnostics, |generated| &generated.warnings);
    files.extend(files_of(said));
    let generated = compiled.map_err(|diagnostics| refusal(&diagnostics, opened))?;
    let associated = associated_items(&generated, &options.scene);
    Ok((generated.warnings.at_least(Severity::Warning).render(), generated, associated))
}

/// What is wrong with the robot file and its scene, which stands in the macro or in another file.
fn refusal(diagnostics: &Diagnostics, opened: &Opened) -> Refusal {
    let within = opened.within();
    let scene = opened.scene.as_ref().map(Source::path);
    let file = |d: &Diagnostic| d.place.as_ref().map(|place| place.file.clone());
    let is_within = |d: &Diagnostic| within.is_some() && file(d).as_deref() == within;
    let errors = || diagnostics.iter().filter(|d| d.severity == Severity::Error);
    let of_scene: Vec<Diagnostic> = errors().filter(|d| is_within(d)).cloned().collect();
    if errors().all(is_within) && !of_scene.is_empty() {
        return Refusal { message: String::new(), of_scene };
    }
    let is_of_scene = |d: &Diagnostic| file(d).is_some_and(|file| scene == Some(&*file));
    let what = if errors().all(is_of_scene) && diagnostics.has_errors() { "scene" } else { "robot file" };
    let rest = diagnostics.at_least(Severity::Warning).without(is_within);
    Refusal { message: format!("the {what} is wrong\n{}", rest.render().trim_end()), of_scene }
}

/// The file of that name in the first directory that has it.
fn found(what: &str, name: &str, directories: &[&Path], files: &mut Vec<PathBuf>) -> Result<Source, String> {
    let tried: Vec<PathBuf> = directories.iter().map(|d| d.join(name)).collect();
    let Some(file) = tried.iter().find_map(|path| path.canonicalize().ok()) else {
        let mut message = format!("there is no {what} file `{}`; tried:", name.escape_default());
        tried.iter().for_each(|path| message.push_str(&format!("\n  {}", path.display())));
        message.push_str("\nhelp: the path counts from the package's manifest, or else from the source file");
        return Err(message);
    };
    let bytes = std::fs::read(&file).map_err(|error| format!("{}: {error}", file.display()))?;
    let source = Source::of_file(name, bytes, &file);
    files.push(file);
    Ok(source)
}

/// The files that were read on the way, each by its path from the root.
fn files_of(said: &Diagnostics) -> impl Iterator<Item = PathBuf> + '_ {
    said.named_files().filter_map(|(file, _)| file.canonicalize().ok())
}
