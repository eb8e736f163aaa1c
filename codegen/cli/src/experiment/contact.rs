//! Contacts of a scene in an experiment: which of them can happen, what they hit with, and how objects move.

use super::messages as say;
use straightline_codegen::description::reader::{FileReader, Range64};
use straightline_codegen::description::table::{parse, TomlTable};
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::scene::contact::{
    tool_axes, ContactItem, EnvironmentItem, ObjectPose, SceneContacts as Items, SurfaceItem,
};
use straightline_core::algorithms::Environment;
use straightline_core::contact::{Contact, Coordinate, Object};
use straightline_core::model::Model;
use straightline_core::spatial::{Transform, Vec3};
use straightline_simulation::contact::{Contacts, Law, Touch};

/// A rebound slower than this is none \[m/s\], unless the file says so.
const REST_SPEED: f64 = 1e-3;

/// The keys of an experiment that stand here.
pub(super) const TABLES: [&str; 2] = ["contact", "contacts"];

/// The contacts of a scene as an experiment has them: all that `[contacts]` does not leave out, each with what its `[[contact]]`
/// says. Complaints go to `diagnostics`; `None` after errors.
pub fn read(source: &Source, model: &Model<f64>, items: &Items, diagnostics: &mut Diagnostics) -> Option<Contacts> {
    let mut found = Diagnostics::new();
    found.add_source(source);
    let contacts = match source.path().ends_with(".toml") {
        true => from_toml(source, model, items, &mut found),
        false => from_tables(FileReader::new(source, &mut found), None, model, items),
    };
    found.sort();
    let sound = !found.has_errors();
    diagnostics.extend(found);
    contacts.filter(|_| sound)
}

fn from_toml(source: &Source, model: &Model<f64>, items: &Items, found: &mut Diagnostics) -> Option<Contacts> {
    // what is no TOML has been said already
    let document = parse(source, &mut Diagnostics::new())?;
    let top = TomlTable { owner: "an experiment".to_string(), table: document.get_ref(), span: 0..0 };
    from_tables(FileReader::new(source, found), Some(&top), model, items)
}

fn from_tables(mut reader: FileReader, top: Option<&TomlTable>, model: &Model<f64>, items: &Items) -> Option<Contacts> {
    let r = &mut reader;
    let known: Vec<&str> = items.contacts.iter().map(|c| c.name.as_str()).collect();
    let mut contacts =
        Contacts { stabilisation: items.stabilisation, projects: true, rest_speed: REST_SPEED, ..Contacts::default() };
    let mut active: Vec<&ContactItem> = items.contacts.iter().collect();
    if let Some(table) = top.and_then(|top| r.table_at(top, "contacts", "[contacts]")) {
        r.check_keys(&table, &["active", "project", "rest_speed"]);
        if table.has("active") {
            let names = r.names_at(&table, "active", "contact");
            for name in names.iter().filter(|name| !known.contains(&name.value.as_str())) {
                r.diagnostics.push(say::unknown_contact(&name.value, &known).at(&name.place));
            }
            active.retain(|item| names.iter().any(|name| name.value == item.name));
        }
        contacts.projects = r.flag_at(&table, "project").is_none_or(|flag| flag.value);
        contacts.rest_speed = number(r, &table, "rest_speed", REST_SPEED, (0.0, 1e3));
    }
    let mut said: Vec<(String, TomlTable)> = Vec::new();
    for mut table in top.map_or_else(Vec::new, |top| r.tables_at(top, "contact")) {
        let keys = ["name", "restitution", "closed", "stays", "axis", "object", "environment"];
        r.check_keys(&table, &keys);
        r.require(&table, "name", "name = \"pen\"");
        let Some(name) = r.name_at(&table, "name", "contact") else { continue };
        table.owner = format!("contact `{}`", name.value);
        if !known.contains(&name.value.as_str()) {
            r.diagnostics.push(say::unknown_contact(&name.value, &known).at(&name.place));
        } else if said.iter().any(|(other, _)| *other == name.value) {
            r.diagnostics.push(say::contact_twice(&name.value).at(&name.place));
        } else {
            said.push((name.value, table));
        }
    }
    for item in active {
        let table = said.iter().find(|(name, _)| *name == item.name).map(|(_, table)| table);
        contacts.touches.extend(touch(r, item, table, model));
    }
    for item in &items.loops {
        let frame = |name: &str| model.frame(name).cloned();
        let (frame, with) = frame(&item.frame).zip(frame(&item.with))?;
        contacts.loops.push(item.over(frame, with));
    }
    Some(contacts)
}

/// A number within a range, or what stands for it.
fn number(r: &mut FileReader, table: &TomlTable, key: &str, default: f64, (low, high): (f64, f64)) -> f64 {
    let Some(found) = r.real_at(table, key, Range64::Finite) else { return default };
    if !(low..=high).contains(&found.value) {
        let complaint = say::not_in_range(&table.what(key), found.value, &format!("between {low:?} and {high:?}"));
        r.diagnostics.push(complaint.at(&found.place));
    }
    found.value
}

/// A contact of the scene with what the experiment says of it.
fn touch(r: &mut FileReader, item: &ContactItem, table: Option<&TomlTable>, model: &Model<f64>) -> Option<Touch> {
    let surface = match &item.surface {
        SurfaceItem::Implicit(_) => None,
        other => other.over(),
    }?;
    let frame = model.frame(&item.frame)?.clone();
    let axis = given(r, item, table, "axis", item.axis.is_none()).then(|| r.vector_at(table?, "axis")).flatten();
    let axis = match (item.axis, axis) {
        (Some(axis), _) => axis,
        (None, Some(axis)) if direction(axis.value) => axis.value,
        (None, Some(axis)) => {
            r.diagnostics.push(say::no_direction("axis", axis.value).at(&axis.place));
            return None;
        }
        (None, None) => return None,
    };
    let (axis, second_axis) = tool_axes(axis);
    let moves = given(r, item, table, "object", item.object.is_none());
    let law = if moves { Some(law(r, table?)?) } else { None };
    let pose = item.object.map_or_else(Transform::identity, |object| object.over());
    let own = |e: &EnvironmentItem| e.values.is_none();
    let asks = item.environment.as_ref().is_some_and(own);
    let given_environment = given(r, item, table, "environment", asks);
    let environment = match &item.environment {
        None => None,
        Some(e) => Some(environment(r, e, table.filter(|_| given_environment))?),
    };
    let constrained: Vec<Coordinate> = item.constrained.clone();
    let contact = Contact {
        name: item.name.clone(),
        frame,
        axis,
        second_axis,
        object: Object::Fixed(pose),
        surface,
        constrained,
        free: Vec::new(),
        friction: item.friction_over(),
    };
    let flag = |r: &mut FileReader, key: &str| table.and_then(|t| r.flag_at(t, key)).is_some_and(|flag| flag.value);
    let (closed, stays) = (flag(r, "closed"), flag(r, "stays"));
    let restitution = table.map_or(0.0, |table| number(r, table, "restitution", 0.0, (0.0, 1.0)));
    Some(Touch { contact, environment, law, restitution, closed, stays })
}

/// Whether the experiment gives what the scene leaves open; it must, and what the scene has said it must not.
fn given(r: &mut FileReader, item: &ContactItem, table: Option<&TomlTable>, key: &str, is_open: bool) -> bool {
    let span = table.and_then(|table| table.get(key)).map(|(_, span)| span);
    match (is_open, span) {
        (true, None) => {
            let complaint = say::left_open(&item.name, key);
            match table {
                Some(table) => r.complain(&table.span.clone(), complaint),
                None => r.complain(&(0..0), complaint),
            }
            false
        }
        (false, Some(span)) => {
            r.complain(&span, say::said_by_the_scene(&item.name, key));
            false
        }
        (is_open, _) => is_open,
    }
}

fn direction(v: [f64; 3]) -> bool {
    v.iter().map(|x| x * x).sum::<f64>() > 1e-18
}

/// How an object moves.
fn law(r: &mut FileReader, table: &TomlTable) -> Option<Law> {
    let object = r.table_at(table, "object", &table.what("object"))?;
    r.check_keys(&object, &["origin", "z", "x", "velocity", "spin", "amplitude", "frequency"]);
    r.require(&object, "origin", "origin = [0.5, 0.0, 0.2]");
    let vector = |r: &mut FileReader, key: &str| r.vector_at(&object, key);
    let origin = vector(r, "origin").map_or([0.0; 3], |v| v.value);
    let z = vector(r, "z").map_or([0.0, 0.0, 1.0], |v| v.value);
    let least = (0..3).min_by(|i, j| z[*i].abs().total_cmp(&z[*j].abs())).unwrap_or(0);
    let x = vector(r, "x").map_or_else(|| [0, 1, 2].map(|i| f64::from(u8::from(i == least))), |v| v.value);
    let across = [z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]];
    if !direction(z) || !direction(across) {
        r.complain(&object.span, say::no_direction("z, or x beside it,", if direction(z) { x } else { z }));
        return None;
    }
    let mut of = |key: &str| Vec3::from(vector(r, key).map_or([0.0; 3], |v| v.value));
    let (velocity, spin, amplitude) = (of("velocity"), of("spin"), of("amplitude"));
    let frequency = number(r, &object, "frequency", 0.0, (0.0, 1e4));
    Some(Law { pose: ObjectPose { origin, z, x }.over(), velocity, spin, amplitude, frequency })
}

/// The model of an object that gives way, with the scene's numbers or the experiment's.
fn environment(r: &mut FileReader, item: &EnvironmentItem, table: Option<&TomlTable>) -> Option<Environment<f64>> {
    if let Some(values) = &item.values {
        return Some(item.over(values));
    }
    let table = table?;
    let numbers = r.table_at(table, "environment", &table.what("environment"))?;
    r.check_keys(&numbers, item.kind.keys());
    let mut values = Vec::new();
    for key in item.kind.keys() {
        r.require(&numbers, key, &format!("{key} = 1.0"));
        let least = if item.kind.positive().contains(key) { 1e-9 } else { 0.0 };
        values.push(number(r, &numbers, key, 1.0, (least, 1e15)));
    }
    Some(item.over(&values))
}
