//! Scene files: TOML, documented in `SCENES.md`. Every complaint has its place, and all come in one run.

mod reader;

use super::value::GivenOptions;
use super::Options;
use crate::description::messages;
use crate::description::reader::LARGEST_FILE;
use crate::description::table::{parse, TomlTable};
use crate::diagnostic::{Diagnostics, Source};
use crate::function::Function;
use crate::scene::{check, Base, Scene, SceneContacts};

/// Those of the tables of which there may be several: `[[payload]]`.
pub const LISTS: &[&str] = &["contact", "loop", "mode", "payload", "parameter", "drive", "coupling", "flexible"];

/// What a scene file says: the scene, and options of the compiler.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneFile {
    /// The scene.
    pub scene: Scene,
    /// The options.
    pub settings: GivenOptions,
}

impl SceneFile {
    /// These options with what the file says in their place, and with its scene. Levels of warnings that they have count before
    /// those of the file.
    pub fn into_options(self, options: Options) -> Options {
        self.with(&GivenOptions::default(), options)
    }

    /// The same, where `own` counts before what the file says. Where neither names functions, a base that moves as it is told has all but
    /// forward dynamics.
    pub fn with(mut self, own: &GivenOptions, mut options: Options) -> Options {
        self.settings.extend(own);
        let levels = std::mem::take(&mut options.reporting.levels);
        let is_moving = self.scene.base == Base::Moving;
        options.scene = self.scene;
        self.settings.apply(&mut options);
        if is_moving && !self.settings.has("functions") && options.functions.iter().copied().eq(Function::all()) {
            options.functions.retain(|f| !f.spec().solves);
        }
        options.reporting.levels.extend(&levels);
        options
    }
}

/// Reads a scene file. Complaints go to `diagnostics`; `None` after errors. Names are checked where the robot is known: by
/// [`apply`](crate::scene::apply).
///
/// ```
/// use straightline_codegen::diagnostic::{Diagnostics, Source};
/// use straightline_codegen::options::scene_file;
/// use straightline_codegen::scene::Gravity;
/// let text = "[hold]\ngravity = \"zero\"\njoints = { wrist = 0.5 }\n";
/// let mut diagnostics = Diagnostics::new();
/// let file = scene_file::read(&Source::new("free_fall.toml", text), &mut diagnostics).unwrap();
/// assert_eq!(file.scene.gravity, Gravity::Constant([0.0; 3]));
/// assert_eq!(file.scene.locked, [("wrist".to_string(), 0.5)]);
/// ```
pub fn read(source: &Source, diagnostics: &mut Diagnostics) -> Option<SceneFile> {
    let mut file = read_partly(source);
    let found = file.scene.places.take_complaints();
    let errors = found.has_errors();
    diagnostics.extend(found);
    (!errors).then_some(file)
}

/// What can be read of a scene file. Its complaints stay with the scene, and are said along with those of the robot, in one
/// run; if there are errors among them, whatever compiles the scene refuses it.
pub fn read_partly(source: &Source) -> SceneFile {
    let mut found = Diagnostics::new();
    found.add_source(source);
    let mut file = read_text(source, &mut found).unwrap_or_default();
    if found.has_errors() {
        // modes name contacts: those that could not be read would be missed
        file.scene.contacts = SceneContacts::default();
    }
    found.sort();
    file.scene.places.keep(found);
    file
}

fn read_text(source: &Source, diagnostics: &mut Diagnostics) -> Option<SceneFile> {
    if let Some(at) = source.invalid_utf8() {
        diagnostics.push(messages::not_utf8().at(&source.place(at..at)));
        return None;
    }
    if source.text().len() > LARGEST_FILE {
        let size = source.text().len();
        diagnostics.push(messages::file_too_large(size, LARGEST_FILE).at(&source.place(0..0)));
        return None;
    }
    let document = parse(source, diagnostics)?;
    let top = TomlTable { owner: "a scene".to_string(), table: document.get_ref(), span: 0..0 };
    let file = reader::read(source, &top, diagnostics);
    check::alone(&file.scene, diagnostics);
    Some(file)
}
