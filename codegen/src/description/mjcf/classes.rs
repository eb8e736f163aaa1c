//! Default classes: what an element has that does not say it.
//!
//! A class holds at most one set of attributes per kind of element and has those of the class around it, too. An element is of the class that
//! it names, or else of the `childclass` of the next body or frame around it, or else of the outermost.

use super::files::{Attribute, Element};
use super::Mjcf;
use crate::description::messages;

/// The classes of a file.
#[derive(Default)]
pub(super) struct DefaultClasses<'s> {
    all: Vec<Class<'s>>,
    /// The outermost class of each model.
    pub outermost: Vec<usize>,
}

/// A class.
struct Class<'s> {
    name: String,
    /// The model that it is of.
    scope: usize,
    parent: Option<usize>,
    /// Kinds of elements with what they have.
    elements: Vec<(&'static str, &'s Element)>,
}

/// An element with the defaults that are behind it, the nearest first.
#[derive(Clone)]
pub(super) struct Defaulted<'s> {
    /// The element.
    pub element: &'s Element,
    defaults: Vec<&'s Element>,
}

impl<'s> Defaulted<'s> {
    /// An element without defaults.
    pub fn alone(element: &'s Element) -> Defaulted<'s> {
        Defaulted { element, defaults: Vec::new() }
    }

    /// The attribute of a name, of the element or by default.
    pub fn attribute(&self, name: &str) -> Option<&'s Attribute> {
        self.layers().find_map(|element| element.attribute(name))
    }

    /// All attributes of a name, that which counts first: of a list of numbers each gives the first ones.
    pub fn layers_of(&self, name: &str) -> Vec<&'s Attribute> {
        self.layers().filter_map(|element| element.attribute(name)).collect()
    }

    fn layers(&self) -> impl Iterator<Item = &'s Element> + '_ {
        std::iter::once(self.element).chain(self.defaults.iter().copied())
    }
}

/// The kind that shares its defaults with an element: all actuators do.
fn kind_of(name: &str) -> Option<&'static str> {
    const ACTUATORS: &[&str] = &[
        "general",
        "motor",
        "position",
        "velocity",
        "intvelocity",
        "orientation",
        "pid",
        "damper",
        "cylinder",
        "muscle",
        "adhesion",
        "dcmotor",
        "plugin",
    ];
    match name {
        name if ACTUATORS.contains(&name) => Some("actuator"),
        _ => ["joint", "geom", "site", "mesh", "equality", "tendon"].into_iter().find(|kind| *kind == name),
    }
}

impl<'s> Mjcf<'s> {
    /// Reads the sections of defaults.
    pub fn read_classes(&mut self) {
        for scope in 0..self.files.scopes.len() {
            self.read_classes_of(scope);
        }
    }

    fn read_classes_of(&mut self, scope: usize) {
        let sections = self.files.sections(scope, "default");
        let outermost = self.classes.all.len();
        self.classes.outermost.push(outermost);
        self.classes.all.push(Class { name: "main".to_string(), scope, parent: None, elements: Vec::new() });
        let mut open: Vec<(&'s Element, Option<usize>)> =
            sections.iter().rev().map(|section| (*section, None)).collect();
        while let Some((element, parent)) = open.pop() {
            let class = match (parent, element.attribute("class")) {
                (None, _) => outermost, // whatever the outermost is called, it is the same
                (Some(_), None) => {
                    let example = "<default class=\"...\">";
                    self.complain_at(element, messages::missing_attribute("<default>", "class", example));
                    continue;
                }
                (Some(parent), Some(name)) => {
                    if self.classes.all.iter().any(|class| class.scope == scope && class.name == name.value) {
                        self.complain(name, messages::duplicate_name("class of defaults", &name.value));
                    }
                    self.classes.all.push(Class {
                        name: name.value.clone(),
                        scope,
                        parent: Some(parent),
                        elements: Vec::new(),
                    });
                    self.classes.all.len() - 1
                }
            };
            if let (None, Some(name)) = (parent, element.attribute("class")) {
                self.classes.all[outermost].name = name.value.clone();
            }
            for child in self.files.children(element) {
                match (child.name.as_str(), kind_of(&child.name)) {
                    ("default", _) => open.push((child, Some(class))),
                    // the last one of a kind counts
                    (_, Some(kind)) => self.classes.all[class].elements.insert(0, (kind, child)),
                    _ => {}
                }
            }
        }
    }

    /// The class that an attribute names, or a complaint.
    pub fn class(&mut self, attribute: &'s Attribute) -> Option<usize> {
        let name = attribute.value.as_str();
        let scope = attribute.scope;
        let is_named = |class: &Class| class.scope == scope && class.name == name;
        let main = (name == "main").then(|| self.classes.outermost[scope]);
        let found = self.classes.all.iter().position(is_named).or(main);
        if found.is_none() {
            let of_scope = self.classes.all.iter().filter(|class| class.scope == scope);
            let names: Vec<String> = of_scope.map(|class| class.name.clone()).collect();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            self.complain(attribute, messages::unknown_word("class", name, &names));
        }
        found
    }

    /// An element with its defaults, that stands in nothing with a class.
    pub fn given_outermost(&mut self, element: &'s Element, kind: &str) -> Defaulted<'s> {
        self.given(element, kind, self.classes.outermost[element.scope])
    }

    /// An element with its defaults; `around`: the class of what it stands in.
    pub fn given(&mut self, element: &'s Element, kind: &str, around: usize) -> Defaulted<'s> {
        let own = element.attribute("class").and_then(|attribute| self.class(attribute));
        let mut defaults = Vec::new();
        let mut next = Some(own.unwrap_or(around));
        while let Some(class) = next.and_then(|class| self.classes.all.get(class)) {
            defaults.extend(class.elements.iter().filter(|(of, _)| *of == kind).map(|(_, element)| *element));
            next = class.parent;
        }
        Defaulted { element, defaults }
    }
}
