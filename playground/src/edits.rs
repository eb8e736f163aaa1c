//! Masses and lengths of a robot file, written over the numbers that stand there: the file stays as it is otherwise, and the compiler reads it as any
//! other. A number that cannot be written so, because it follows from others, has no slider.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use straightline_codegen::description::write::edits::{edited, TextEdit};
use straightline_codegen::description::{self, Description, Placement};
use straightline_codegen::diagnostic::{Diagnostics, Place, Source};

/// How many times as heavy links and as far from their parents joints are.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Factors {
    /// By the names of links.
    pub masses: BTreeMap<String, f64>,
    /// By the names of joints.
    pub lengths: BTreeMap<String, f64>,
}

/// A number of the file that can be changed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Editable {
    /// Of which link or joint.
    pub name: String,
    /// What stands there: a mass \[kg\], or a length \[m\].
    pub value: f64,
}

/// What can be changed in a file.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Editables {
    /// Masses of links, with their inertia.
    pub masses: Vec<Editable>,
    /// Distances from a link's origin to the joint that it carries.
    pub lengths: Vec<Editable>,
}

/// Ranges of the numbers of a text; words with digits in them are none.
fn numbers_in(text: &str) -> Vec<std::ops::Range<usize>> {
    let bytes = text.as_bytes();
    let is_part = |c: u8| c.is_ascii_alphanumeric() || matches!(c, b'+' | b'-' | b'.' | b'_');
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let end = (at..bytes.len()).find(|k| !is_part(bytes[*k])).unwrap_or(bytes.len());
        let word = text.get(at..end);
        if word.is_some_and(|word| !word.is_empty() && word.parse::<f64>().is_ok_and(f64::is_finite)) {
            found.push(at..end);
        }
        at = end.max(at) + 1;
    }
    found
}

/// Edits that multiply numbers at a place, the first `most` of them; of an element of XML, of which the place may be the name alone, those of its
/// attributes.
fn multiplied(text: &str, place: &Place, most: usize, factor: f64) -> Option<Vec<TextEdit>> {
    if !place.is_some() {
        return None;
    }
    let whole_tag = text.get(place.span.start..)?.find('>').map(|end| place.span.start..place.span.start + end);
    let spans = std::iter::once(place.span.clone()).chain(whole_tag);
    let (start, numbers) =
        spans.map(|span| (span.start, numbers_in(&text[span]))).find(|(_, found)| !found.is_empty())?;
    let edit = |range: std::ops::Range<usize>| {
        let span = start + range.start..start + range.end;
        let value: f64 = text[span.clone()].parse().ok()?;
        Some(TextEdit { span, text: format!("{:?}", value * factor) })
    };
    numbers.into_iter().take(most).map(edit).collect()
}

/// The edits that make a link so many times as heavy, and its inertia as great.
fn of_mass(text: &str, description: &Description, link: &str, factor: f64) -> Option<Vec<TextEdit>> {
    let inertial = description.link(link)?.inertial.as_ref()?;
    let mass = multiplied(text, &inertial.mass.place, 1, factor)?;
    Some([mass, multiplied(text, &inertial.inertia.place, usize::MAX, factor)?].concat())
}

/// The edits that put a joint so many times as far from its parent.
fn of_length(text: &str, description: &Description, joint: &str, factor: f64) -> Option<Vec<TextEdit>> {
    match &description.joint(joint)?.placement {
        Placement::Frames { origin, .. } => multiplied(text, &origin.xyz.place, 3, factor),
        _ => None,
    }
}

fn read(source: &Source) -> Option<Description> {
    description::read(source, &mut Diagnostics::new())
}

fn length(description: &Description, joint: &str) -> Option<f64> {
    match &description.joint(joint)?.placement {
        Placement::Frames { origin, .. } => Some(origin.xyz.value.iter().map(|x| x * x).sum::<f64>().sqrt()),
        _ => None,
    }
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * b.abs()
}

/// What can be changed: every edit is tried, and what the file says then is read.
pub fn editables(source: &Source) -> Editables {
    let Some(before) = read(source) else { return Editables::default() };
    let text = source.text();
    const TRIED: f64 = 1.25;
    let after = |edits: Option<Vec<TextEdit>>| read(&Source::new(source.path(), edited(text, edits?)));
    let mass_of = |of: &Description, link: &str| Some(of.link(link)?.inertial.as_ref()?.mass.value);
    let inertia_of = |of: &Description, link: &str| {
        let i = of.link(link)?.inertial.as_ref()?.inertia.value;
        Some([i.xx, i.yy, i.zz, i.xy, i.xz, i.yz])
    };
    let masses = before.links.iter().filter_map(|link| {
        let name = &link.name.value;
        let value = mass_of(&before, name).filter(|mass| *mass > 0.0)?;
        let after = after(of_mass(text, &before, name, TRIED))?;
        let [was, is] = [inertia_of(&before, name)?, inertia_of(&after, name)?];
        let is_right = close(mass_of(&after, name)?, TRIED * value) && (0..6).all(|k| close(is[k], TRIED * was[k]));
        is_right.then(|| Editable { name: name.clone(), value })
    });
    let lengths = before.joints.iter().filter_map(|joint| {
        let name = &joint.name.value;
        let value = length(&before, name).filter(|length| *length > 1e-3)?;
        let after = after(of_length(text, &before, name, TRIED))?;
        close(length(&after, name)?, TRIED * value).then(|| Editable { name: name.clone(), value })
    });
    Editables { masses: masses.collect(), lengths: lengths.collect() }
}

/// The file with these factors; those that cannot be written are left out.
pub fn with_factors(source: &Source, factors: &Factors) -> Source {
    let Some(description) = read(source) else { return source.clone() };
    let text = source.text();
    let changed = |factors: &BTreeMap<String, f64>| {
        let is_change = |(_, factor): &(String, f64)| *factor != 1.0 && *factor > 0.0 && factor.is_finite();
        factors.clone().into_iter().filter(is_change).collect::<Vec<_>>()
    };
    let masses = changed(&factors.masses).into_iter().filter_map(|(name, x)| of_mass(text, &description, &name, x));
    let lengths = changed(&factors.lengths).into_iter().filter_map(|(name, x)| of_length(text, &description, &name, x));
    let edits: Vec<TextEdit> = masses.chain(lengths).flatten().collect();
    match edits.is_empty() {
        true => source.clone(),
        false => Source::new(source.path(), edited(text, edits)),
    }
}
