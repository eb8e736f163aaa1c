//! The tables `[[contact]]`, `[[loop]]`, `[[mode]]` and `[stabilisation]`.

use super::SceneReader;
use crate::description::reader::FileReader;
use crate::description::table::TomlTable;
use crate::description::Noted;
use crate::function::ContactFunction;
use crate::scene::contact::{
    ContactItem, EnvironmentItem, EnvironmentKind, LoopItem, ModeItem, ObjectPose, SurfaceItem,
};
use crate::scene::messages as say;
use straightline_core::contact::Coordinate;
use toml::de::DeValue;

/// The forms that a surface can have.
#[derive(Clone, Copy)]
enum SurfaceForm {
    Plane,
    Sphere,
    Cylinder,
    Quadric,
}

const FORMS: [(&str, SurfaceForm); 4] = [
    ("plane", SurfaceForm::Plane),
    ("sphere", SurfaceForm::Sphere),
    ("cylinder", SurfaceForm::Cylinder),
    ("quadric", SurfaceForm::Quadric),
];

/// Whether a key says `"input"`.
fn is_input(table: &TomlTable, key: &str) -> bool {
    matches!(table.get(key), Some((DeValue::String(text), _)) if text.as_ref() == "input")
}

impl SceneReader<'_> {
    pub(super) fn contacts(&mut self, top: &TomlTable) {
        for table in self.reader.tables_at(top, "contact") {
            self.contact(table);
        }
        for table in self.reader.tables_at(top, "loop") {
            self.a_loop(table);
        }
        for table in self.reader.tables_at(top, "mode") {
            self.mode(table);
        }
        if let Some(table) = self.reader.table_at(top, "stabilisation", "[stabilisation]") {
            self.reader.check_keys(&table, &["frequency", "damping"]);
            self.reader.require(&table, "frequency", "frequency = 50.0");
            let frequency = self.real("stabilisation", &table, "frequency");
            let damping = self.real("stabilisation", &table, "damping").unwrap_or(1.0);
            self.file.scene.contacts.stabilisation = frequency.map(|f| (f, damping));
        }
    }

    fn coordinates(&mut self, path: &str, table: &TomlTable, key: &str) -> Vec<Coordinate> {
        let known: Vec<&str> = Coordinate::ALL.iter().map(|c| c.name()).collect();
        table.get(key).iter().for_each(|(_, span)| self.note(path, span));
        let mut found = Vec::new();
        for name in self.reader.names_at(table, key, "coordinate") {
            match Coordinate::ALL.into_iter().find(|c| c.name() == name.value) {
                Some(coordinate) => found.push(coordinate),
                None => {
                    let complaint = crate::description::messages::unknown_word(&table.what(key), &name.value, &known);
                    self.reader.diagnostics.push(complaint.at(&name.place));
                }
            }
        }
        found
    }

    /// Name, its place noted, and the table under it.
    pub(super) fn named_table(&mut self, path: &str, kind: &str, table: &mut TomlTable) -> Option<String> {
        let name = self.needed(path, table, "name", kind);
        name.iter().for_each(|name| table.owner = format!("{kind} `{name}`"));
        self.note(path, &table.span);
        name
    }

    fn contact(&mut self, mut table: TomlTable) {
        let path = format!("contact.{}", self.file.scene.contacts.contacts.len());
        let name = self.named_table(&path, "contact", &mut table);
        const KEYS: &[&str] =
            &["name", "frame", "axis", "object", "surface", "constrained", "free", "friction", "environment"];
        self.reader.check_keys(&table, KEYS);
        for (key, example) in [
            ("object", "object = { origin = [0.5, 0.0, 0.2], z = [0.0, 0.0, 1.0] }"),
            ("constrained", "constrained = [\"pz\"]"),
        ] {
            self.reader.require(&table, key, example);
        }
        let frame = self.needed(&path, &table, "frame", "frame");
        let axis = match is_input(&table, "axis") {
            true => None,
            false => Some(self.at(&path, &table, "axis", FileReader::vector_at).unwrap_or([0.0, 0.0, 1.0])),
        };
        let object = match is_input(&table, "object") {
            true => None,
            false => self.object(&path, &table),
        };
        let surface = self.surface(&path, &table);
        let constrained = self.coordinates(&format!("{path}.constrained"), &table, "constrained");
        let free = match table.has("free") {
            true => self.coordinates(&format!("{path}.free"), &table, "free"),
            false => Coordinate::ALL.into_iter().filter(|c| !constrained.contains(c)).collect(),
        };
        let friction = self.reader.table_at(&table, "friction", &table.what("friction")).and_then(|friction| {
            self.reader.check_keys(&friction, &["coefficient", "speed"]);
            self.reader.require(&friction, "coefficient", "coefficient = 0.3");
            let path = format!("{path}.friction");
            let coefficient = self.real(&path, &friction, "coefficient");
            let speed = self.real(&path, &friction, "speed").unwrap_or(1e-3);
            self.note(&path, &friction.span);
            coefficient.map(|c| (c, speed))
        });
        let environment = self.environment(&path, &table);
        if let (Some(name), Some(frame)) = (name, frame) {
            let item = ContactItem { name, frame, axis, object, surface, constrained, free, friction, environment };
            self.file.scene.contacts.contacts.push(item);
        }
    }

    fn object(&mut self, path: &str, table: &TomlTable) -> Option<ObjectPose> {
        let object = match table.get("object") {
            Some((value @ DeValue::String(_), span)) => {
                let forms = "`{ origin = [0.5, 0.0, 0.2], z = [0.0, 0.0, 1.0], x = [1.0, 0.0, 0.0] }` or `\"input\"`";
                self.reader.wrong_type(&table.what("object"), forms, value, &span);
                return None;
            }
            _ => self.reader.table_at(table, "object", &table.what("object"))?,
        };
        self.reader.check_keys(&object, &["origin", "z", "x"]);
        let path = format!("{path}.object");
        self.note(&path, &object.span);
        let mut vector = |key: &str| self.at(&path, &object, key, FileReader::vector_at);
        let (origin, z, x) = (vector("origin"), vector("z"), vector("x"));
        let z = z.unwrap_or([0.0, 0.0, 1.0]);
        // of the world's axes the one that is farthest from Z
        let least = (0..3).min_by(|i, j| z[*i].abs().total_cmp(&z[*j].abs())).unwrap_or(0);
        let mut farthest = [0.0; 3];
        farthest[least] = 1.0;
        Some(ObjectPose { origin: origin.unwrap_or_default(), z, x: x.unwrap_or(farthest) })
    }

    fn surface(&mut self, path: &str, table: &TomlTable) -> SurfaceItem {
        let Some(surface) = self.reader.table_at(table, "surface", &table.what("surface")) else {
            return SurfaceItem::Plane;
        };
        self.reader.require(&surface, "kind", "kind = \"sphere\"");
        let Some(Noted { value: form, .. }) = self.reader.word_at(&surface, "kind", &FORMS) else {
            return SurfaceItem::Plane;
        };
        let keys: &[&str] = match form {
            SurfaceForm::Plane => &["kind"],
            SurfaceForm::Sphere | SurfaceForm::Cylinder => &["kind", "radius", "hollow"],
            SurfaceForm::Quadric => &["kind", "matrix", "linear", "constant"],
        };
        self.reader.check_keys(&surface, keys);
        let path = format!("{path}.surface");
        self.note(&path, &surface.span);
        match form {
            SurfaceForm::Plane => SurfaceItem::Plane,
            SurfaceForm::Sphere | SurfaceForm::Cylinder => {
                self.reader.require(&surface, "radius", "radius = 0.2");
                let radius = self.real(&path, &surface, "radius").unwrap_or(1.0);
                let hollow = self.reader.flag_at(&surface, "hollow").is_some_and(|f| f.value);
                match form {
                    SurfaceForm::Sphere => SurfaceItem::Sphere { radius, hollow },
                    _ => SurfaceItem::Cylinder { radius, hollow },
                }
            }
            SurfaceForm::Quadric => {
                self.reader.require(&surface, "matrix", "matrix = { xx = 1.0, yy = 1.0, zz = 4.0 }");
                let matrix = self.at(&path, &surface, "matrix", FileReader::tensor_at);
                let matrix = matrix.map_or([0.0; 6], |m| [m.xx, m.xy, m.xz, m.yy, m.yz, m.zz]);
                let linear = self.at(&path, &surface, "linear", FileReader::vector_at).unwrap_or_default();
                let constant = self.real(&path, &surface, "constant").unwrap_or_default();
                SurfaceItem::Quadric { matrix, linear, constant }
            }
        }
    }

    fn environment(&mut self, path: &str, table: &TomlTable) -> Option<EnvironmentItem> {
        let environment = self.reader.table_at(table, "environment", &table.what("environment"))?;
        let path = format!("{path}.environment");
        self.note(&path, &environment.span);
        self.reader.require(&environment, "kind", "kind = \"mass\"");
        let kind = self.reader.word_at(&environment, "kind", &EnvironmentKind::WORDS)?.value;
        if environment.has("parameters") {
            self.reader.check_keys(&environment, &["kind", "parameters"]);
            self.reader.word_at(&environment, "parameters", &[("input", ())])?;
            return Some(EnvironmentItem { kind, values: None });
        }
        self.reader.check_keys(&environment, &[&["kind", "parameters"], kind.keys()].concat());
        let mut values = Vec::new();
        for key in kind.keys() {
            self.reader.require(&environment, key, &format!("{key} = 1.0"));
            values.push(self.real(&path, &environment, key).unwrap_or(1.0));
        }
        Some(EnvironmentItem { kind, values: Some(values) })
    }

    fn a_loop(&mut self, mut table: TomlTable) {
        let path = format!("loop.{}", self.file.scene.contacts.loops.len());
        let name = self.named_table(&path, "loop", &mut table);
        self.reader.check_keys(&table, &["name", "frame", "with", "constrained"]);
        let mut frame = |key: &str| self.needed(&path, &table, key, "frame");
        let (frame, with) = (frame("frame"), frame("with"));
        let constrained = match table.has("constrained") {
            true => self.coordinates(&format!("{path}.constrained"), &table, "constrained"),
            false => Coordinate::ALL.to_vec(),
        };
        if let (Some(name), Some(frame), Some(with)) = (name, frame, with) {
            self.file.scene.contacts.loops.push(LoopItem { name, frame, with, constrained });
        }
    }

    fn mode(&mut self, mut table: TomlTable) {
        let path = format!("mode.{}", self.file.scene.contacts.modes.len());
        let name = self.named_table(&path, "mode", &mut table);
        self.reader.check_keys(&table, &["name", "contacts", "sticking"]);
        let contacts = self.names(&format!("{path}.contacts"), &table, "contacts", "contact");
        let sticking = self.names(&format!("{path}.sticking"), &table, "sticking", "contact");
        if let Some(name) = name {
            self.file.scene.contacts.modes.push(ModeItem { name, contacts, sticking });
        }
    }

    /// `contact` of `[outputs]`: functions of every mode.
    pub(super) fn contact_functions(&mut self, table: &TomlTable) {
        if !table.has("contact") {
            return;
        }
        let mut wanted = Vec::new();
        for name in self.reader.names_at(table, "contact", "function") {
            match ContactFunction::from_name(&name.value) {
                Some(function) => {
                    self.file.scene.places.note(format!("outputs.contact.{}", name.value), &name.place);
                    wanted.push(function);
                }
                None => {
                    let known: Vec<&str> = ContactFunction::ALL.iter().map(|f| f.name()).collect();
                    let complaint = say::unknown_contact_function(&name.value, &known);
                    self.reader.diagnostics.push(complaint.at(&name.place));
                }
            }
        }
        self.file.scene.contacts.functions = Some(wanted);
    }
}
