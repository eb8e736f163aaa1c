//! Texts, numbers and words of elements, and complaints about them.

use super::Sdf;
use crate::description::reader::Range64;
use crate::description::xml::{self, children, tag, Span};
use crate::description::{messages, Noted};
use crate::diagnostic::wording::closest;
use roxmltree::Node;

/// What shows a robot, senses or serves a simulator.
const HARMLESS: &[&str] = &[
    "visual",
    "collision",
    "sensor",
    "plugin",
    "gripper",
    "light",
    "self_collide",
    "allow_auto_disable",
    "enable_wind",
    "audio_sink",
    "audio_source",
    "battery",
    "projector",
    "particle_emitter",
    "physics",
    "actor",
    "scene",
    "state",
    "stiffness",
    "dissipation",
    "initial_position",
    "density",
    "auto_inertia_params",
];

impl<'d, 'i> Sdf<'_, 'd, 'i> {
    /// Skips an element; one that looks like one of `known` gets a warning.
    pub fn skip(&mut self, owner: &str, element: Node<'d, 'i>, known: &[&str]) {
        let name = element.tag_name().name();
        let is_known = HARMLESS.contains(&name) || element.tag_name().namespace().is_some();
        let near = closest(name, known.iter().copied()).filter(|known| known.len() > 3 && !is_known);
        match near {
            Some(near) => self.complain(&tag(element), messages::misspelt_element(owner, name, near)),
            None => self.reader.ignore(name, &tag(element)),
        }
    }

    /// The children with the names `names`, each at most once; others are skipped.
    pub fn pick<const N: usize>(
        &mut self,
        owner: &str,
        element: Node<'d, 'i>,
        names: [&str; N],
    ) -> [Option<Node<'d, 'i>>; N] {
        let mut found = [None; N];
        for child in children(element) {
            match names.iter().position(|name| *name == child.tag_name().name()) {
                Some(i) if found[i].is_some() => {
                    self.complain(&tag(child), messages::repeated_element(owner, names[i]));
                }
                Some(i) => found[i] = Some(child),
                None => self.skip(owner, child, &names),
            }
        }
        found
    }

    /// Refuses an element that changes the dynamics.
    pub fn refuse(&mut self, element: Node<'d, 'i>, owner: &str, why: &str, help: &str) {
        self.complain(&tag(element), messages::not_supported_yet(owner, element.tag_name().name(), why, help));
    }

    /// Complains of attributes that an element does not have.
    pub fn check_attributes(&mut self, owner: &str, element: Node<'d, 'i>, known: &[&str]) {
        for attribute in element.attributes().filter(|a| a.namespace().is_none() && !known.contains(&a.name())) {
            let complaint = messages::unknown_attribute(owner, element.tag_name().name(), attribute.name(), known);
            self.complain(&attribute.range_qname(), complaint);
        }
    }

    /// The text in an element, without blanks around it, and where it stands.
    pub fn text(&self, element: Node<'d, 'i>) -> (&'d str, Span) {
        let texts = || element.children().filter(|child| child.is_text());
        let node = texts().find(|child| !child.text().unwrap_or("").trim().is_empty());
        let Some(node) = node else { return ("", tag(element)) };
        let (whole, span) = (node.text().unwrap_or(""), node.range());
        let text = whole.trim();
        let offset = text.as_ptr() as usize - whole.as_ptr() as usize;
        let own = span.start + offset..span.start + offset + text.len();
        let is_raw = self.reader.source.text().get(own.clone()) == Some(text);
        (text, if is_raw { own } else { span })
    }

    /// The numbers in an element.
    pub fn numbers(
        &mut self,
        element: Node<'d, 'i>,
        what: &str,
        counts: (std::ops::RangeInclusive<usize>, &str),
    ) -> Option<Vec<(f64, &'d str, Span)>> {
        let text = self.text(element);
        xml::numbers(&mut self.reader, what, text, counts)
    }

    /// Three numbers in an element.
    pub fn vector(&mut self, element: Node<'d, 'i>, what: &str) -> Option<Noted<[f64; 3]>> {
        let span = self.text(element).1;
        let numbers = self.numbers(element, what, (3..=3, "three numbers"))?;
        let vector = [numbers[0].0, numbers[1].0, numbers[2].0];
        Some(self.reader.value(vector, &span))
    }

    /// The number in an element.
    pub fn number(&mut self, element: Node<'d, 'i>, what: &str, range: Range64) -> Option<Noted<f64>> {
        let (text, span) = self.text(element);
        let value = self.reader.number(what, text, &span, range)?;
        Some(self.reader.value(value, &span))
    }

    /// The number in a child of an element, if it has that child.
    pub fn number_in(&mut self, element: Option<Node<'d, 'i>>, owner: &str) -> Option<Noted<f64>> {
        let element = element?;
        self.number(element, &format!("{} of {owner}", element.tag_name().name()), Range64::Finite)
    }

    /// A word that stands for yes or no; no after a complaint.
    pub fn flag(&mut self, what: &str, text: &str, span: &Span) -> bool {
        match text.trim() {
            "true" | "True" | "TRUE" | "1" => true,
            "false" | "False" | "FALSE" | "0" => false,
            other => {
                self.complain(span, messages::unknown_word(what, other, &["true", "false"]));
                false
            }
        }
    }

    /// Whether an element says yes.
    pub fn is_set(&mut self, element: Node<'d, 'i>, owner: &str) -> bool {
        let (text, span) = self.text(element);
        self.flag(&format!("{} of {owner}", element.tag_name().name()), text, &span)
    }

    /// An attribute that is not empty, and where its value stands.
    pub fn attribute(&self, element: Node<'d, 'i>, name: &str) -> Option<(&'d str, Span)> {
        let attribute = element.attribute_node(name)?;
        // the value of the element, which lives as long as the document
        let value = element.attribute(name)?.trim();
        (!value.is_empty()).then(|| (value, attribute.range_value()))
    }
}
