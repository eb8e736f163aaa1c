//! MJCF, the XML of MuJoCo: <https://mujoco.readthedocs.io/en/stable/XMLreference.html>.
//!
//! Read is what makes the equations of a tree of bodies: `compiler`, `option gravity`, `default`, `include`, `attach`, bodies with their joints,
//! inertials, sites and frames, inertias from geoms, couplings by `equality/joint`, and greatest forces of actuators. What changes the
//! dynamics and is not read is an error; the rest is skipped and listed.
//!
//! A body with several joints becomes as many links, all but the last without mass ([`WrittenLink::is_carrier`]). Numbers count as the
//! nearest f64; inertias that are made of geoms are computed in double-double and rounded once.
//!
//! [`WrittenLink::is_carrier`]: super::WrittenLink::is_carrier

mod actuators;
mod attributes;
mod bodies;
mod classes;
mod constraints;
mod files;
mod geoms;
mod inertia;
mod joints;
mod mesh;
mod settings;
mod vocabulary;
mod welds;

use super::reader::{FileReader, FreeNames};
use super::{xml, Description, FileFormat, Noted, WrittenJoint};
use crate::diagnostic::{Diagnostics, Place, Source};
use classes::DefaultClasses;
use files::{Element, Files};
use settings::CompilerSettings;
use std::collections::HashSet;
use straightline_core::joint::Dialect;

pub(super) const FORMAT: FileFormat = FileFormat {
    name: "MJCF",
    extensions: &["mjcf"],
    signs: "XML whose root element is `<mujoco>`",
    sniff: |text| ["mujoco", "mujocoinclude"].contains(&xml::root_name(text)),
    dialect: Dialect::Mjcf,
    limits: "write `range=\"...\"`, or `limited=\"false\"`",
    read,
    write: Some(&super::write::mjcf::WRITER),
};

/// A file that is being read, with what it includes.
struct Mjcf<'s> {
    reader: FileReader<'s>,
    files: &'s Files,
    /// Of each model.
    settings: Vec<CompilerSettings<'s>>,
    classes: DefaultClasses<'s>,
    /// Names of links, joints and frames, written or made up.
    names: FreeNames,
    /// Names of bodies and frames.
    links: HashSet<String>,
    robot: Description,
    /// The body of the world that would move freely, and is welded to the world.
    held: Option<String>,
    /// Of each joint of it, the element that says it.
    joints: Vec<&'s Element>,
}

fn read(source: &Source, diagnostics: &mut Diagnostics) -> Option<Description> {
    let files = Files::load(source, diagnostics)?;
    let mut reader = FileReader::new(&files.sources[0], diagnostics);
    // a default counts for many elements
    reader.said = Some(HashSet::new());
    let root = files.root(0);
    let name = match root.attribute("model") {
        Some(model) if !model.value.trim().is_empty() => reader.value(model.value.clone(), &model.span),
        _ => reader.value("robot".to_string(), &root.tag),
    };
    let mut mjcf = Mjcf {
        reader,
        files: &files,
        settings: Vec::new(),
        classes: DefaultClasses::default(),
        names: FreeNames::default(),
        links: HashSet::new(),
        robot: Description::new(&FORMAT, name),
        held: None,
        joints: Vec::new(),
    };
    mjcf.collect_names();
    mjcf.read_sections();
    let mut robot = mjcf.robot;
    robot.ignored = mjcf.reader.into_ignored();
    Some(robot)
}

impl<'s> Mjcf<'s> {
    /// Reads the sections, those first that say how others are meant.
    fn read_sections(&mut self) {
        self.read_settings();
        self.read_classes();
        self.read_world();
        self.order_joints();
        self.scale_masses();
        self.read_constraints();
        self.read_actuators();
        for scope in 0..self.files.scopes.len() {
            for section in self.files.children(self.files.root(scope)) {
                self.skip_section(section);
            }
        }
    }

    /// What stands in the sections of a name, of all models.
    fn within(&self, name: &str) -> Vec<&'s Element> {
        let files = self.files;
        let sections = (0..files.scopes.len()).flat_map(|scope| files.sections(scope, name));
        sections.flat_map(|section| files.children(section)).collect()
    }

    /// Lists a section that is not read, or what is not in one that is.
    fn skip_section(&mut self, section: &'s Element) {
        match section.name.as_str() {
            "compiler" | "option" | "default" | "worldbody" | "equality" | "tendon" | "actuator" => {}
            "deformable" => {
                for element in self.files.children(section).into_iter().filter(|e| e.name == "flex") {
                    self.refuse(element, "the robot", "it deforms", "remove it: bodies are rigid");
                }
            }
            "asset" => {
                let others = self.files.children(section).into_iter();
                for element in others.filter(|e| !["mesh", "model"].contains(&e.name.as_str())) {
                    self.ignore(element);
                }
            }
            "extension" | "visual" | "statistic" | "size" | "contact" | "sensor" | "keyframe" | "custom" => {
                self.ignore(section);
            }
            _ => {
                self.skip(section, "the robot", &["worldbody", "compiler", "default", "equality", "actuator", "tendon"])
            }
        }
    }

    /// Adds a joint that an element says.
    fn add_joint(&mut self, joint: WrittenJoint, element: &'s Element) {
        self.robot.joints.push(joint);
        self.joints.push(element);
    }

    /// Brings the joints in the order of the file: those of frames were made when they were needed.
    fn order_joints(&mut self) {
        let ranks = self.files.ranks();
        let joints = std::mem::take(&mut self.robot.joints);
        let mut ranked: Vec<_> = joints.into_iter().zip(&self.joints).collect();
        ranked.sort_by_key(|(_, element)| ranks[element.index]);
        self.robot.joints = ranked.into_iter().map(|(joint, _)| joint).collect();
    }

    /// Remembers the names that the file gives, so that no made-up name is one of them.
    fn collect_names(&mut self) {
        for element in &self.files.elements {
            if ["body", "frame"].contains(&element.name.as_str()) {
                self.links.extend(element.attribute("name").map(|name| name.value.clone()));
            }
            if ["body", "joint", "freejoint", "site", "frame"].contains(&element.name.as_str()) {
                self.names.take(element.attribute("name").map(|name| name.value.clone()));
            }
        }
    }

    /// The name of an element, or else a made-up one.
    fn name_of(&mut self, element: &'s Element, otherwise: &str) -> Noted<String> {
        match element.attribute("name").filter(|name| !name.value.trim().is_empty()) {
            Some(name) => Noted::new(name.value.clone(), self.place(name)),
            None => Noted::new(self.names.made_up(otherwise), self.tag(element)),
        }
    }

    /// Where an element begins.
    fn tag(&self, element: &Element) -> Place {
        self.files.sources[element.file].place(element.tag.clone())
    }
}
