//! The elements of a file, of those that it includes, and of the models that it attaches.
//!
//! A file is named relative to the folder of the one that is read, or else of the one that includes it, and is included once. A model is read anew
//! wherever it is attached: names of bodies, joints, sites and tendons get the prefix in front there. Settings, default classes and meshes are
//! those of its own file: it is a scope of its own.

use crate::description::messages;
use crate::description::reader::{FileReader, LARGEST_FILE};
use crate::description::xml::{self, Span};
use crate::diagnostic::{Diagnostics, Place, Source};
use roxmltree::Document;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Files that are included, and models that are attached.
const MOST_FILES: usize = 200;

/// Elements whose names are looked up in their own scope, without a prefix.
const OF_ASSETS: &[&str] = &["mesh", "material", "texture", "hfield", "skin", "model", "default"];

/// Attributes that name something which may have a prefix.
const NAMING: &[&str] = &[
    "name",
    "joint",
    "joint1",
    "joint2",
    "jointinparent",
    "body",
    "body1",
    "body2",
    "site",
    "site1",
    "site2",
    "tendon",
    "tendon1",
    "tendon2",
];

/// An element.
pub(super) struct Element {
    /// Its name.
    pub name: String,
    /// The file that it stands in.
    pub file: usize,
    /// The model that it is of, among those that are read: 0 of the file itself.
    pub scope: usize,
    /// Its index among all.
    pub index: usize,
    /// The start of its tag.
    pub tag: Span,
    /// Its attributes.
    pub attributes: Vec<Attribute>,
    children: Vec<usize>,
    /// Of `attach`: the scope of what it attaches.
    attached: Option<usize>,
}

/// An attribute.
pub(super) struct Attribute {
    /// The file that it stands in.
    pub file: usize,
    /// The model that it is of.
    pub scope: usize,
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: String,
    /// Where the name stands.
    pub name_span: Span,
    /// Where the value stands.
    pub span: Span,
}

impl Element {
    /// The attribute of a name.
    pub fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|attribute| attribute.name == name)
    }
}

/// A model: that which is read, or one that is attached.
#[derive(Clone)]
pub(super) struct ModelScope {
    root: usize,
    /// What stands before its names.
    pub prefix: String,
}

/// The files that were read, and what is in them.
pub(super) struct Files {
    /// The files; the first one is that which is read.
    pub sources: Vec<Source>,
    /// All elements; the first one is the root of the first file.
    pub elements: Vec<Element>,
    /// The models; the first one is that which is read.
    pub scopes: Vec<ModelScope>,
}

impl Files {
    /// Reads a file and what it includes and attaches; `None` if it is no MJCF.
    pub fn load(source: &Source, diagnostics: &mut Diagnostics) -> Option<Files> {
        let scopes = vec![ModelScope { root: 0, prefix: String::new() }];
        let mut files = Files { sources: vec![source.clone()], elements: Vec::new(), scopes };
        files.add(0, 0, diagnostics)?;
        // models are named in files that may be included
        let (mut included, mut attached) = (0, 0);
        while attached < files.elements.len() {
            while included < files.elements.len() {
                if files.elements[included].name == "include" {
                    let root = files.include(included, diagnostics);
                    let children = root.map_or(Vec::new(), |root| files.elements[root].children.clone());
                    files.elements[included].children = children;
                }
                included += 1;
            }
            if files.elements[attached].name == "attach" {
                files.elements[attached].attached = files.attach(attached, diagnostics);
            }
            attached += 1;
        }
        Some(files)
    }

    /// The root of a model.
    pub fn root(&self, scope: usize) -> &Element {
        &self.elements[self.scopes[scope].root]
    }

    /// The sections of a name of a model.
    pub fn sections(&self, scope: usize, name: &str) -> Vec<&Element> {
        self.children(self.root(scope)).into_iter().filter(|section| section.name == name).collect()
    }

    /// What stands in the place of `attach`: all of the world of the other model, or the body that is named; `None` where nothing could be read.
    pub fn attached(&self, element: &Element) -> Option<Vec<&Element>> {
        let scope = element.attached?;
        let world: Vec<&Element> =
            self.sections(scope, "worldbody").into_iter().flat_map(|section| self.children(section)).collect();
        let Some(body) = element.attribute("body") else { return Some(world) };
        // the prefix of the element is that of its own scope
        let name = format!("{}{}", self.scopes[scope].prefix, self.without_prefix(body));
        let mut open: Vec<&Element> = world;
        while let Some(own) = open.pop() {
            if own.name == "body" && own.attribute("name").is_some_and(|own| own.value == name) {
                return Some(vec![own]);
            }
            open.extend(self.children(own));
        }
        None
    }

    /// The names of the bodies of the model of `attach`, as its file has them.
    pub fn attached_bodies(&self, element: &Element) -> Option<Vec<String>> {
        let scope = element.attached?;
        let bodies = self.elements.iter().filter(|own| own.scope == scope && own.name == "body");
        let names = bodies.filter_map(|body| body.attribute("name"));
        Some(names.map(|name| self.without_prefix(name).to_string()).collect())
    }

    fn without_prefix<'a>(&self, attribute: &'a Attribute) -> &'a str {
        attribute.value.strip_prefix(&self.scopes[attribute.scope].prefix).unwrap_or(&attribute.value)
    }

    /// The elements in an element, those of included files in place of `include`.
    pub fn children(&self, element: &Element) -> Vec<&Element> {
        let mut children = Vec::new();
        let mut open: Vec<usize> = element.children.iter().rev().copied().collect();
        while let Some(child) = open.pop() {
            let child = &self.elements[child];
            match child.name.as_str() {
                "include" => open.extend(child.children.iter().rev()),
                _ => children.push(child),
            }
        }
        children
    }

    /// Where elements stand in the file, those that it includes and the models that it attaches, as one text.
    pub fn ranks(&self) -> Vec<usize> {
        let mut ranks = vec![0; self.elements.len()];
        let mut open = vec![self.root(0)];
        let mut rank = 0;
        while let Some(element) = open.pop() {
            ranks[element.index] = rank;
            rank += 1;
            open.extend(self.children(element).into_iter().rev());
            open.extend(self.attached(element).into_iter().flatten().rev());
        }
        ranks
    }

    /// Adds the elements of a file; the index of its root.
    fn add(&mut self, file: usize, scope: usize, diagnostics: &mut Diagnostics) -> Option<usize> {
        let Files { sources, elements, scopes } = self;
        let prefix = scopes[scope].prefix.as_str();
        xml::parse(FileReader::new(&sources[file], diagnostics), |mut reader, document| {
            let root = document.root_element();
            if !["mujoco", "mujocoinclude"].contains(&root.tag_name().name()) {
                reader.complain(&xml::tag(root), messages::not_mjcf(root.tag_name().name()));
                return None;
            }
            Some(add_elements(elements, (file, scope, prefix), document))
        })
    }

    /// Reads the file that an element includes; the index of its root.
    fn include(&mut self, element: usize, diagnostics: &mut Diagnostics) -> Option<usize> {
        let Element { file, scope, tag, .. } = &self.elements[element];
        let (place, scope) = (self.sources[*file].place(tag.clone()), *scope);
        if self.elements[element].attribute("file").is_none() {
            let example = "<include file=\"arm.xml\"/>";
            diagnostics.push(messages::missing_attribute("<include>", "file", example).at(&place));
            return None;
        }
        let named = self.path_in(element)?;
        let is_of_scope = |file: usize| self.elements.iter().any(|own| own.file == file && own.scope == scope);
        let problem = if self.sources.len() > MOST_FILES {
            Some(format!("no robot includes more than {MOST_FILES} files"))
        } else if self.known(&named.file).is_some_and(is_of_scope) {
            Some("it is included already, or includes itself".to_string())
        } else {
            None
        };
        let file = self.source(&named, problem, diagnostics)?;
        self.add(file, scope, diagnostics)
    }

    /// Reads the model that an element attaches; its scope.
    fn attach(&mut self, element: usize, diagnostics: &mut Diagnostics) -> Option<usize> {
        let own = &self.elements[element];
        let Some(named) = own.attribute("model") else {
            let example = "<attach model=\"arm\" prefix=\"left_\"/>";
            let place = self.sources[own.file].place(own.tag.clone());
            diagnostics.push(messages::missing_attribute("<attach>", "model", example).at(&place));
            return None;
        };
        let assets = self.sections(own.scope, "asset").into_iter().flat_map(|section| self.children(section));
        let models: Vec<(&str, &Element)> = assets
            .filter(|asset| asset.name == "model")
            .filter_map(|model| Some((model.attribute("name")?.value.as_str(), model)))
            .collect();
        let Some((_, model)) = models.iter().find(|(name, _)| *name == named.value) else {
            let names: Vec<&str> = models.iter().map(|(name, _)| *name).collect();
            let place = self.sources[named.file].place(named.span.clone());
            diagnostics.push(messages::unknown_word("model of <attach>", &named.value, &names).at(&place));
            return None;
        };
        let Some(of_model) = self.path_in(model.index) else {
            let place = self.sources[model.file].place(model.tag.clone());
            let example = "<model name=\"arm\" file=\"arm.xml\"/>";
            diagnostics.push(messages::missing_attribute("<model>", "file", example).at(&place));
            return None;
        };
        let own_prefix = own.attribute("prefix").map_or("", |prefix| prefix.value.as_str());
        let prefix = format!("{}{own_prefix}", self.scopes[own.scope].prefix);
        let problem = (self.scopes.len() > MOST_FILES)
            .then(|| format!("no robot attaches more than {MOST_FILES} models: does one attach itself?"));
        let file = self.source(&of_model, problem, diagnostics)?;
        self.scopes.push(ModelScope { root: 0, prefix });
        let scope = self.scopes.len() - 1;
        match self.add(file, scope, diagnostics) {
            Some(root) => {
                self.scopes[scope].root = root;
                Some(scope)
            }
            None => {
                self.scopes.pop();
                None
            }
        }
    }

    /// The file that an element names.
    fn path_in(&self, element: usize) -> Option<NamedFile> {
        let own = &self.elements[element];
        let named = own.attribute("file")?;
        let place = self.sources[own.file].place(named.span.clone());
        let name = named.value.trim().replace('\\', "/");
        let beside = |file: usize| {
            let source = &self.sources[file];
            let [file, shown] = [source.file(), Path::new(source.path())].map(|own| own.with_file_name(&name));
            NamedFile { file, shown, name: name.clone(), place: place.clone() }
        };
        let candidates = [beside(self.root(own.scope).file), beside(own.file)];
        let found = candidates.iter().find(|candidate| candidate.file.is_file()).unwrap_or(&candidates[0]);
        Some(found.clone())
    }

    /// The source that was read from a file.
    fn known(&self, path: &Path) -> Option<usize> {
        let same = |source: &Source| match (std::fs::canonicalize(source.file()), std::fs::canonicalize(path)) {
            (Ok(a), Ok(b)) => a == b,
            _ => false,
        };
        self.sources.iter().position(same)
    }

    /// The source of a file, which is read unless it was, or has a problem.
    fn source(&mut self, named: &NamedFile, problem: Option<String>, diagnostics: &mut Diagnostics) -> Option<usize> {
        let NamedFile { file, shown, name, place } = named;
        if let (None, Some(known)) = (&problem, self.known(file)) {
            return Some(known);
        }
        match problem.map_or_else(|| read_file(file), Err) {
            Err(why) => {
                diagnostics.push(messages::include_failed(name, &why).at(place));
                None
            }
            Ok(bytes) => {
                diagnostics.note_file(file, &bytes);
                let source = Source::of_file(&shown.to_string_lossy(), bytes, file);
                diagnostics.add_source(&source);
                self.sources.push(source);
                let file = self.sources.len() - 1;
                if let Some(at) = self.sources[file].invalid_utf8() {
                    diagnostics.push(messages::not_utf8().at(&self.sources[file].place(at..at)));
                    return None;
                }
                Some(file)
            }
        }
    }
}

/// A file that an element names.
#[derive(Clone)]
struct NamedFile {
    /// Where it is.
    file: PathBuf,
    /// By which path complaints name it.
    shown: PathBuf,
    /// How the element names it.
    name: String,
    /// Where it does.
    place: Place,
}

/// The bytes of a file, or why there are none.
pub(super) fn read_file(path: &Path) -> Result<Vec<u8>, String> {
    let size = std::fs::metadata(path).map_err(|_| "there is no such file".to_string())?.len();
    if size > LARGEST_FILE as u64 {
        return Err(format!("it has {size} bytes; at most {LARGEST_FILE} are read"));
    }
    std::fs::read(path).map_err(|_| "it cannot be read".to_string())
}

/// Adds all elements of a document; the index of its root.
fn add_elements(
    elements: &mut Vec<Element>,
    (file, scope, prefix): (usize, usize, &str),
    document: &Document,
) -> usize {
    let root = elements.len();
    let mut index = HashMap::new();
    for node in document.root_element().descendants().filter(|node| node.is_element()) {
        let own = elements.len();
        index.insert(node.id(), own);
        if let Some(parent) = node.parent_element().and_then(|parent| index.get(&parent.id())) {
            let parent: usize = *parent;
            elements[parent].children.push(own);
        }
        let element = node.tag_name().name();
        let has_prefix = |name: &str, value: &str| {
            NAMING.contains(&name) && !value.trim().is_empty() && value != "world" && !OF_ASSETS.contains(&element)
        };
        let attributes = node.attributes().map(|attribute| Attribute {
            file,
            scope,
            name: attribute.name().to_string(),
            value: match has_prefix(attribute.name(), attribute.value()) {
                true => format!("{prefix}{}", attribute.value()),
                false => attribute.value().to_string(),
            },
            name_span: attribute.range_qname(),
            span: attribute.range_value(),
        });
        elements.push(Element {
            name: element.to_string(),
            file,
            scope,
            index: own,
            tag: xml::tag(node),
            attributes: attributes.collect(),
            children: Vec::new(),
            attached: None,
        });
    }
    root
}
