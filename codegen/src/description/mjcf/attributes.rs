//! Words, numbers and poses of attributes, and complaints about them.

use super::classes::Defaulted;
use super::files::{Attribute, Element};
use super::Mjcf;
use crate::description::{angle, messages, xml, Angle, AngleUnit, Noted, Rotation, WrittenPose, WrittenTurn};
use crate::diagnostic::wording::closest;
use crate::diagnostic::{Diagnostic, Place};

impl<'s> Mjcf<'s> {
    /// Where the value of an attribute stands.
    pub fn place(&self, attribute: &Attribute) -> Place {
        self.files.sources[attribute.file].place(attribute.span.clone())
    }

    /// Says something about an attribute.
    pub fn complain(&mut self, attribute: &Attribute, diagnostic: Diagnostic) {
        let place = self.place(attribute);
        self.reader.say(&place, diagnostic);
    }

    /// Says something about an element.
    pub fn complain_at(&mut self, element: &Element, diagnostic: Diagnostic) {
        let place = self.tag(element);
        self.reader.say(&place, diagnostic);
    }

    /// Refuses an element that changes the dynamics.
    pub fn refuse(&mut self, element: &Element, owner: &str, why: &str, help: &str) {
        self.complain_at(element, messages::not_supported_yet(owner, &element.name, why, help));
    }

    /// Refuses an attribute that changes the dynamics.
    pub fn refuse_attribute(&mut self, element: &'s Element, name: &str, owner: &str, why: &str, help: &str) {
        if let Some(attribute) = element.attribute(name) {
            self.complain(attribute, messages::not_supported_yet(owner, name, why, help));
        }
    }

    /// Refuses an attribute that changes the dynamics, unless all its numbers are zero.
    pub fn refuse_number(&mut self, given: &Defaulted<'s>, name: &str, owner: &str, why: &str, help: &str) {
        let Some(attribute) = given.attribute(name) else { return };
        let numbers = self.numbers(&format!("{name} of {owner}"), attribute, 0, usize::MAX);
        if numbers.is_some_and(|numbers| numbers.iter().any(|x| *x != 0.0)) {
            self.complain(attribute, messages::not_supported_yet(owner, name, why, help));
        }
    }

    /// Remembers that an element was skipped.
    pub fn ignore(&mut self, element: &Element) {
        self.ignore_as(&element.name, element);
    }

    /// Remembers that an element was skipped, under another name.
    pub fn ignore_as(&mut self, what: &str, element: &Element) {
        self.reader.source = &self.files.sources[element.file];
        self.reader.ignore(what, &element.tag);
    }

    /// Skips an element; one that looks like one of `known` gets a warning.
    pub fn skip(&mut self, element: &Element, owner: &str, known: &[&str]) {
        match closest(&element.name, known.iter().copied()).filter(|known| known.len() > 3) {
            Some(known) => self.complain_at(element, messages::misspelt_element(owner, &element.name, known)),
            None => self.ignore(element),
        }
    }

    /// Complains of attributes that an element does not have; `known`: those that it has, with spaces between.
    pub fn check_attributes(&mut self, element: &Element, owner: &str, known: &str) {
        let known: Vec<&str> = known.split_whitespace().collect();
        for attribute in element.attributes.iter().filter(|a| !known.contains(&a.name.as_str())) {
            let place = self.files.sources[attribute.file].place(attribute.name_span.clone());
            let complaint = messages::unknown_attribute(owner, &element.name, &attribute.name, &known);
            self.reader.say(&place, complaint);
        }
    }

    /// A word of an attribute, or a complaint that it is none of `known`.
    pub fn word(&mut self, given: &Defaulted<'s>, name: &str, known: &[&'static str]) -> Option<&'static str> {
        let attribute = given.attribute(name)?;
        let found = known.iter().copied().find(|word| *word == attribute.value.trim());
        if found.is_none() {
            let what = format!("`{name}` of `<{}>`", given.element.name);
            self.complain(attribute, messages::unknown_word(&what, attribute.value.trim(), known));
        }
        found
    }

    /// `true` or `false`.
    pub fn flag(&mut self, given: &Defaulted<'s>, name: &str) -> Option<bool> {
        self.word(given, name, &["true", "false"]).map(|word| word == "true")
    }

    /// The numbers of an attribute, from `least` to `most`, or a complaint.
    pub fn numbers(&mut self, what: &str, attribute: &Attribute, least: usize, most: usize) -> Option<Vec<f64>> {
        self.reader.source = &self.files.sources[attribute.file];
        let expected = match (least, most) {
            (1, 1) => "one number".to_string(),
            (a, b) if a == b => format!("{a} numbers"),
            (a, b) => format!("{a} to {b} numbers"),
        };
        let text = (attribute.value.as_str(), attribute.span.clone());
        let numbers = xml::numbers(&mut self.reader, what, text, (least..=most, &expected))?;
        Some(numbers.into_iter().map(|(x, ..)| x).collect())
    }

    /// So many numbers of an attribute.
    pub fn some_numbers<const N: usize>(&mut self, given: &Defaulted<'s>, name: &str, owner: &str) -> Option<[f64; N]> {
        let attribute = given.attribute(name)?;
        let numbers = self.numbers(&format!("{name} of {owner}"), attribute, N, N)?;
        numbers.try_into().ok()
    }

    /// One number with its place.
    pub fn number(&mut self, given: &Defaulted<'s>, name: &str, owner: &str) -> Option<Noted<f64>> {
        let [x] = self.some_numbers(given, name, owner)?;
        Some(Noted::new(x, self.place(given.attribute(name)?)))
    }

    /// Three numbers with their place, or those that stand for an attribute that is left out.
    pub fn vector(&mut self, given: &Defaulted<'s>, name: &str, owner: &str, otherwise: [f64; 3]) -> Noted<[f64; 3]> {
        let place = given.attribute(name).map_or_else(|| self.tag(given.element), |attribute| self.place(attribute));
        Noted::new(self.some_numbers(given, name, owner).unwrap_or(otherwise), place)
    }

    /// `pos` and an orientation in any of its forms.
    pub fn pose(&mut self, given: &Defaulted<'s>, owner: &str) -> WrittenPose {
        WrittenPose { xyz: self.vector(given, "pos", owner, [0.0; 3]), rotation: self.orientation(given, owner) }
    }

    /// An orientation in any of its forms.
    fn orientation(&mut self, given: &Defaulted<'s>, owner: &str) -> Rotation {
        const FORMS: [&str; 5] = ["quat", "axisangle", "xyaxes", "zaxis", "euler"];
        let is_own = |name: &&&str| given.element.attribute(name).is_some();
        let mut forms: Vec<&str> = FORMS.iter().filter(is_own).copied().collect();
        if forms.is_empty() {
            forms = FORMS.iter().filter(|name| given.attribute(name).is_some()).copied().collect();
        }
        if let ([first, second, ..], Some(attribute)) =
            (&forms[..], forms.get(1).and_then(|name| given.attribute(name)))
        {
            self.complain(attribute, messages::written_twice(owner, first, second));
        }
        let turns = forms.first().and_then(|form| {
            let attribute = given.attribute(form)?;
            let count = match *form {
                "quat" | "axisangle" => 4,
                "xyaxes" => 6,
                _ => 3,
            };
            let numbers = self.numbers(&format!("{form} of {owner}"), attribute, count, count)?;
            Some(self.turns(form, &numbers, attribute, owner))
        });
        Rotation::Turns(turns.unwrap_or_default())
    }

    /// The turns that the numbers of a form mean.
    pub fn turns(&mut self, form: &str, numbers: &[f64], attribute: &'s Attribute, owner: &str) -> Vec<WrittenTurn> {
        let place = self.place(attribute);
        let first = [0, 1, 2].map(|i| numbers[i]);
        let what = format!("{form} of {owner}");
        match form {
            "quat" => {
                let q = [0, 1, 2, 3].map(|i| numbers[i]);
                if !self.has_direction(&q, &what, attribute) {
                    return Vec::new();
                }
                vec![WrittenTurn::Quaternion(Noted::new(q, place))]
            }
            "axisangle" => {
                if !self.has_direction(&first, &what, attribute) {
                    return Vec::new();
                }
                let angle = self.angle(numbers[3], attribute);
                vec![WrittenTurn::About { axis: Noted::new(first, place), angle }]
            }
            "xyaxes" => {
                let second = [3, 4, 5].map(|i| numbers[i]);
                if !self.has_direction(&first, &what, attribute)
                    || !self.has_direction(&cross(first, second), &what, attribute)
                {
                    return Vec::new();
                }
                vec![WrittenTurn::Axes(Noted::new([first, second], place))]
            }
            "zaxis" => {
                if !self.has_direction(&first, &what, attribute) {
                    return Vec::new();
                }
                vec![WrittenTurn::ZTo(Noted::new(first, place))]
            }
            _ => {
                let mut turns = Vec::new();
                for (axis, value) in self.settings[attribute.scope].euler.into_iter().zip(first) {
                    let unit = ['x', 'y', 'z'].map(|own| f64::from(u8::from(own == axis.to_ascii_lowercase())));
                    let turn = WrittenTurn::About {
                        axis: Noted::new(unit, place.clone()),
                        angle: self.angle(value, attribute),
                    };
                    // about an axis that turns: after those before it; about one that stands: before them
                    let at = if axis.is_ascii_lowercase() { turns.len() } else { 0 };
                    turns.insert(at, turn);
                }
                turns
            }
        }
    }

    /// Whether a vector is not zero, or a complaint.
    fn has_direction(&mut self, vector: &[f64], what: &str, attribute: &'s Attribute) -> bool {
        let has = vector.iter().any(|x| x.abs() >= 1e-100);
        if !has {
            self.complain(attribute, messages::zero_axis(what));
        }
        has
    }

    /// An angle in the unit of the file.
    pub fn angle(&self, value: f64, attribute: &Attribute) -> Angle {
        let unit = self.settings[attribute.scope].angle;
        Angle { value, unit, text: format!("{value:?}"), place: self.place(attribute) }
    }

    /// An angle of the file in radians, rounded once.
    pub fn radians(&self, value: f64, attribute: &Attribute) -> f64 {
        match self.settings[attribute.scope].angle {
            AngleUnit::Degree if value.is_finite() => {
                let angle = Angle { value, unit: AngleUnit::Degree, text: String::new(), place: Place::none() };
                angle::in_radians(&angle, 0.0).to_f64()
            }
            _ => value,
        }
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
