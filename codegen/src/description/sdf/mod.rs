//! SDF, the format of Gazebo, 1.6 to 1.12: <http://sdformat.org/spec>.
//!
//! Read is what makes the equations of one model: links with their inertias, joints, frames, models in models, couplings by `mimic` and gears. What
//! changes the dynamics and is not read is an error; the rest is skipped and listed.
//!
//! SDF gives poses in any frame, and a joint anywhere in its links. The steps from one frame to the next become fixed joints with links without mass
//! between them ([`WrittenLink::is_carrier`]), so that no pose is computed here.
//!
//! [`WrittenLink::is_carrier`]: super::WrittenLink::is_carrier

mod axes;
mod chains;
mod closing;
mod couplings;
mod elements;
mod frames;
mod joints;
mod links;
mod poses;

use super::reader::{FileReader, FreeNames};
use super::xml::{self, children, tag, Span};
use super::{messages, BaseKind, Description, FileFormat, Noted};
use crate::diagnostic::{Diagnostics, Source};
use frames::{SdfFrame, SdfScope, WORLD};
use roxmltree::{Document, Node};
use std::collections::HashSet;
use straightline_core::joint::Dialect;

pub(super) const FORMAT: FileFormat = FileFormat {
    name: "SDF",
    extensions: &["sdf", "world"],
    signs: "XML whose root element is `<sdf>`",
    sniff: |text| xml::root_name(text) == "sdf",
    dialect: Dialect::Sdf,
    limits: "write `<limit>` with `<lower>` and `<upper>`",
    read,
    write: Some(&super::write::sdf::WRITER),
};

/// The versions 1.N that are read.
const VERSIONS: std::ops::RangeInclusive<u32> = 6..=12;
/// Models inside each other.
const DEEPEST: usize = 64;

/// A file that is being read.
struct Sdf<'s, 'd, 'i> {
    reader: FileReader<'s>,
    /// N of the version 1.N.
    version: u32,
    /// All that poses can be given in; the world first.
    frames: Vec<SdfFrame<'d, 'i>>,
    /// Where names are looked for.
    scopes: Vec<SdfScope>,
    /// The model that is the robot.
    model: usize,
    robot: Description,
    /// Names of links, joints and frames, written or made up.
    names: FreeNames,
    /// Where angles stand that a pose of the robot has already.
    angles: HashSet<usize>,
    /// Steps between frames that were made so far.
    steps: usize,
    /// Joints that turn or slide, as couplings need them.
    turning: Vec<couplings::TurningJoint>,
}

fn read(source: &Source, diagnostics: &mut Diagnostics) -> Option<Description> {
    xml::parse(FileReader::new(source, diagnostics), read_document)
}

fn read_document(mut reader: FileReader, document: &Document) -> Option<Description> {
    let root = document.root_element();
    if root.tag_name().name() != "sdf" {
        reader.complain(&tag(root), messages::not_sdf(root.tag_name().name()));
        return None;
    }
    if xml::has_xacro(&mut reader, root) {
        return None;
    }
    let version = version(&mut reader, root)?;
    // several frames can ask for one name
    reader.said = Some(HashSet::new());
    let name = reader.value("robot".to_string(), &tag(root));
    let mut sdf = Sdf {
        reader,
        version,
        frames: Vec::new(),
        scopes: Vec::new(),
        model: WORLD,
        robot: Description::new(&FORMAT, name),
        names: FreeNames::default(),
        angles: HashSet::new(),
        steps: 0,
        turning: Vec::new(),
    };
    sdf.read_root(root)?;
    let mut robot = sdf.robot;
    robot.ignored = sdf.reader.into_ignored();
    Some(robot)
}

/// N of the version 1.N, or a complaint that it is not read.
fn version(reader: &mut FileReader, root: Node) -> Option<u32> {
    let Some(attribute) = root.attribute_node("version") else {
        reader.complain(&tag(root), messages::missing_attribute("<sdf>", "version", "<sdf version=\"1.9\">"));
        return None;
    };
    let text = attribute.value().trim();
    let minor = text.strip_prefix("1.").and_then(|minor| minor.parse().ok()).filter(|minor| VERSIONS.contains(minor));
    if minor.is_none() {
        let is_older = text.strip_prefix("1.").and_then(|minor| minor.parse().ok()).is_some_and(|minor: u32| minor < 6);
        reader.complain(&attribute.range_value(), messages::sdf_version(text, is_older));
    }
    minor
}

impl<'d, 'i> Sdf<'_, 'd, 'i> {
    /// Reads the one world or model of a file.
    fn read_root(&mut self, root: Node<'d, 'i>) -> Option<()> {
        let mut world = None;
        for element in children(root).filter(|element| element.tag_name().name() == "world") {
            match world {
                None => world = Some(element),
                Some(_) => {
                    self.reader.complain(&tag(element), messages::repeated_element("the file", "world"));
                    return None;
                }
            }
        }
        let around = world.unwrap_or(root);
        if world.is_some() {
            self.read_gravity(around);
            for element in children(root).filter(|element| element.tag_name().name() != "world") {
                self.skip("the file", element, &["world"]);
            }
        }
        self.collect_frames(around)?;
        self.choose_model(around)?;
        self.name_frames();
        self.place_frames();
        self.attach_frames();
        self.read_links();
        let joints = self.read_joints();
        let has_world = self.add_joints(joints);
        let place = self.frames[self.model].name.place.clone();
        let base = if has_world { BaseKind::Fixed } else { BaseKind::Floating };
        self.robot.base = Some(Noted::new(base, place));
        self.add_frames(has_world);
        Some(())
    }

    /// Gravity of a world: where the file leaves it out, that of the format.
    fn read_gravity(&mut self, world: Node<'d, 'i>) {
        let element = children(world).find(|element| element.tag_name().name() == "gravity");
        let gravity = match element {
            Some(element) => self.vector(element, "gravity of the world"),
            None => Some(self.reader.value([0.0, 0.0, -9.8], &tag(world))),
        };
        self.robot.gravity = gravity;
    }

    /// Finds the one model that moves.
    fn choose_model(&mut self, around: Node<'d, 'i>) -> Option<()> {
        let top: Vec<usize> =
            self.scopes[0].frames.iter().copied().filter(|frame| self.frames[*frame].is_model()).collect();
        let moving: Vec<usize> = top.iter().copied().filter(|model| !self.frames[*model].is_static).collect();
        match moving[..] {
            [model] => {
                self.model = model;
                self.robot.name = self.frames[model].name.clone();
                for model in top.into_iter().filter(|other| *other != model) {
                    self.reader.ignore("static model", &tag(self.frames[model].element));
                }
                Some(())
            }
            [] if self.robot.has_holes => None,
            [] => {
                match top.first() {
                    Some(model) => {
                        let SdfFrame { name, element, .. } = &self.frames[*model];
                        let owner = format!("model `{}`", name.value);
                        let complaint = messages::not_supported_yet(
                            &owner,
                            "static",
                            "nothing of it moves",
                            "remove `<static>`; what is fixed to the world is so by a joint whose parent is `world`",
                        );
                        self.reader.complain(&tag(*element), complaint);
                    }
                    None => {
                        let owner = format!("<{}>", around.tag_name().name());
                        let example = "<model name=\"...\">";
                        self.reader.complain(&tag(around), messages::missing_element(&owner, "model", example));
                    }
                }
                None
            }
            [_, second, ..] => {
                let names: Vec<&str> = moving.iter().map(|model| self.frames[*model].name.value.as_str()).collect();
                let complaint = messages::several_models(&names);
                self.reader.complain(&tag(self.frames[second].element), complaint);
                None
            }
        }
    }

    /// Says something about bytes of the file.
    fn complain(&mut self, span: &Span, complaint: crate::diagnostic::Diagnostic) {
        self.reader.complain(span, complaint);
    }
}
