//! The elements of a file and of those that it includes.
//!
//! A file is named relative to the folder of the one that is read, or else of the one that includes it, and is included once.

use crate::description::messages;
use crate::description::reader::{FileReader, LARGEST_FILE};
use crate::description::xml::{self, Span};
use crate::diagnostic::{Diagnostics, Source};
use roxmltree::Document;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Files that are included.
const MOST_FILES: usize = 200;

/// An element.
pub(super) struct Element {
    /// Its name.
    pub name: String,
    /// The file that it stands in.
    pub file: usize,
    /// Its index among all.
    pub index: usize,
    /// The start of its tag.
    pub tag: Span,
    /// Its attributes.
    pub attributes: Vec<Attribute>,
    children: Vec<usize>,
}

/// An attribute.
pub(super) struct Attribute {
    /// The file that it stands in.
    pub file: usize,
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

/// The files that were read, and what is in them.
pub(super) struct Files {
    /// The files; the first one is that which is read.
    pub sources: Vec<Source>,
    /// All elements; the first one is the root of the first file.
    pub elements: Vec<Element>,
}

impl Files {
    /// Reads a file and what it includes; `None` if it is no MJCF.
    pub fn load(source: &Source, diagnostics: &mut Diagnostics) -> Option<Files> {
        let mut files = Files { sources: vec![source.clone()], elements: Vec::new() };
        files.add(0, diagnostics)?;
        let mut next = 0;
        while next < files.elements.len() {
            if files.elements[next].name == "include" {
                let root = files.include(next, diagnostics);
                files.elements[next].children = root.map_or(Vec::new(), |root| files.elements[root].children.clone());
            }
            next += 1;
        }
        Some(files)
    }

    /// The root of the file that is read.
    pub fn root(&self) -> &Element {
        &self.elements[0]
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

    /// Where elements stand in the file and those that it includes, as one text.
    pub fn ranks(&self) -> Vec<usize> {
        let mut ranks = vec![0; self.elements.len()];
        let mut open = vec![self.root()];
        let mut rank = 0;
        while let Some(element) = open.pop() {
            ranks[element.index] = rank;
            rank += 1;
            open.extend(self.children(element).into_iter().rev());
        }
        ranks
    }

    /// Adds the elements of a file; the index of its root.
    fn add(&mut self, file: usize, diagnostics: &mut Diagnostics) -> Option<usize> {
        let Files { sources, elements } = self;
        xml::parse(FileReader::new(&sources[file], diagnostics), |mut reader, document| {
            let root = document.root_element();
            if !["mujoco", "mujocoinclude"].contains(&root.tag_name().name()) {
                reader.complain(&xml::tag(root), messages::not_mjcf(root.tag_name().name()));
                return None;
            }
            Some(add_elements(elements, file, document))
        })
    }

    /// Reads the file that an element includes; the index of its root.
    fn include(&mut self, element: usize, diagnostics: &mut Diagnostics) -> Option<usize> {
        let Element { file, tag, .. } = &self.elements[element];
        let (place, file) = (self.sources[*file].place(tag.clone()), *file);
        let Some(name) = self.elements[element].attribute("file") else {
            let example = "<include file=\"arm.xml\"/>";
            diagnostics.push(messages::missing_attribute("<include>", "file", example).at(&place));
            return None;
        };
        let place = self.sources[file].place(name.span.clone());
        let folder = |source: &Source| Path::new(source.path()).parent().map_or_else(PathBuf::new, Path::to_path_buf);
        let name = name.value.trim().replace('\\', "/");
        let candidates = [folder(&self.sources[0]).join(&name), folder(&self.sources[file]).join(&name)];
        let path = candidates.iter().find(|path| path.is_file()).unwrap_or(&candidates[0]);
        let shown = path.to_string_lossy().into_owned();
        let same = |source: &Source| match (std::fs::canonicalize(source.path()), std::fs::canonicalize(path)) {
            (Ok(a), Ok(b)) => a == b,
            _ => false,
        };
        let problem = if self.sources.len() > MOST_FILES {
            Some(format!("no robot includes more than {MOST_FILES} files"))
        } else if self.sources.iter().any(same) {
            Some("it is included already, or includes itself".to_string())
        } else {
            None
        };
        let read = match problem {
            Some(problem) => Err(problem),
            None => read_file(path),
        };
        match read {
            Err(why) => {
                diagnostics.push(messages::include_failed(&name, &why).at(&place));
                None
            }
            Ok(bytes) => {
                let source = Source::from_bytes(&shown, bytes);
                diagnostics.add_source(&source);
                self.sources.push(source);
                let file = self.sources.len() - 1;
                if let Some(at) = self.sources[file].invalid_utf8() {
                    diagnostics.push(messages::not_utf8().at(&self.sources[file].place(at..at)));
                    return None;
                }
                self.add(file, diagnostics)
            }
        }
    }
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
fn add_elements(elements: &mut Vec<Element>, file: usize, document: &Document) -> usize {
    let root = elements.len();
    let mut index = HashMap::new();
    for node in document.root_element().descendants().filter(|node| node.is_element()) {
        let own = elements.len();
        index.insert(node.id(), own);
        if let Some(parent) = node.parent_element().and_then(|parent| index.get(&parent.id())) {
            let parent: usize = *parent;
            elements[parent].children.push(own);
        }
        let attributes = node.attributes().map(|attribute| Attribute {
            file,
            name: attribute.name().to_string(),
            value: attribute.value().to_string(),
            name_span: attribute.range_qname(),
            span: attribute.range_value(),
        });
        elements.push(Element {
            name: node.tag_name().name().to_string(),
            file,
            index: own,
            tag: xml::tag(node),
            attributes: attributes.collect(),
            children: Vec::new(),
        });
    }
    root
}
