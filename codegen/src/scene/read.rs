//! Scene files: TOML, documented in `SCENES.md`. Every complaint has its place, and all come in one run.

mod contact;

use super::{
    check, messages as say, Base, Budget, Contacts, Coulomb, Gravity, Interval, JointRanges, MaxError, Parameter, Part,
    Payload, Places, Ranges, Scene, Selection,
};
use crate::choices::{Choice, LimbForm};
use crate::description::reader::{Range64, Reader, LARGEST_FILE};
use crate::description::table::{parse, Table};
use crate::description::{messages, Value};
use crate::diagnostic::{Diagnostics, Level, Levels, Source};
use crate::function::Function;
use straightline_graph::certify::Effort;
use straightline_graph::Scalar;
use toml::de::DeValue;

const TOP: &[&str] = &[
    "contact",
    "loop",
    "mode",
    "stabilisation",
    "outputs",
    "hold",
    "payload",
    "zero",
    "effects",
    "parameter",
    "drive",
    "flexible",
    "support",
    "numbers",
    "budget",
    "diagnostics",
];
/// Those of the tables of which there may be several: `[[payload]]`.
pub const LISTS: &[&str] = &["contact", "loop", "mode", "payload", "parameter", "drive", "flexible"];
const BUDGET: &[&str] =
    &["max_flops", "max_sincos", "max_live", "max_stack_bytes", "max_code_bytes", "max_error", "mixed_precision"];
const BASES: [(&str, Base); 3] = [("fixed", Base::Fixed), ("floating", Base::Floating), ("moving", Base::Moving)];
/// A place in the list of effects: that its speed is still to be read.
const SMOOTH: Coulomb = Coulomb::Smooth(0.0);
const COULOMB: [(&str, Coulomb); 3] = [("off", Coulomb::Off), ("sign", Coulomb::Sign), ("smooth", SMOOTH)];

/// What a scene file says: the scene, and options of the compiler.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SceneFile {
    /// The scene.
    pub scene: Scene,
    /// The functions that are wanted; `None`: all.
    pub functions: Option<Vec<Function>>,
    /// The scalar types, the first one that of the file's own items; none: as the options say.
    pub scalars: Vec<Scalar>,
    /// So near to a special angle \[rad\] an angle of the robot file is taken as that.
    pub angle_tolerance: Option<f64>,
    /// How identical limbs are computed; none: as the options say.
    pub limbs: Option<LimbForm>,
    /// Whether rounding errors are bounded, and what is spent on it; none: as the options say.
    pub certify: Option<Effort>,
    /// What becomes of warnings, unless the options say otherwise.
    pub levels: Levels,
}

/// What a `[[parameter]]` is of.
#[derive(Clone, Copy)]
enum Kind {
    Payload,
    Link,
    Drive,
}

/// Reads a scene file. Complaints go to `diagnostics`; `None` after errors. Names are checked where the robot is known: by
/// [`apply`](super::apply).
///
/// ```
/// use straightline_codegen::diagnostic::{Diagnostics, Source};
/// use straightline_codegen::scene::{read, Gravity};
/// let text = "[hold]\ngravity = \"zero\"\njoints = { wrist = 0.5 }\n";
/// let mut diagnostics = Diagnostics::new();
/// let file = read(&Source::new("free_fall.toml", text), &mut diagnostics).unwrap();
/// assert_eq!(file.scene.gravity, Gravity::Constant([0.0; 3]));
/// assert_eq!(file.scene.locked, [("wrist".to_string(), 0.5)]);
/// ```
pub fn read(source: &Source, diagnostics: &mut Diagnostics) -> Option<SceneFile> {
    let mut file = read_partly(source);
    let found = file.scene.places.take_complaints();
    let errors = found.has_errors();
    diagnostics.extend(found);
    (!errors).then_some(file)
}

/// What can be read of a scene file. Its complaints stay with the scene, and are said along with those of the robot, in one
/// run; if there are errors among them, whatever compiles the scene refuses it.
pub fn read_partly(source: &Source) -> SceneFile {
    let mut found = Diagnostics::new();
    found.add_source(source);
    let mut file = read_text(source, &mut found).unwrap_or_default();
    if found.has_errors() {
        // modes name contacts: those that could not be read would be missed
        file.scene.contacts = Contacts::default();
    }
    found.sort();
    file.scene.places.keep(found);
    file
}

fn read_text(source: &Source, diagnostics: &mut Diagnostics) -> Option<SceneFile> {
    if let Some(at) = source.invalid_utf8() {
        diagnostics.push(messages::not_utf8().at(&source.place(at..at)));
        return None;
    }
    if source.text().len() > LARGEST_FILE {
        let size = source.text().len();
        diagnostics.push(messages::file_too_large(size, LARGEST_FILE).at(&source.place(0..0)));
        return None;
    }
    let document = parse(source, diagnostics)?;
    let top = Table { owner: "a scene".to_string(), table: document.get_ref(), span: 0..0 };
    let mut scene = SceneReader {
        reader: Reader::new(source, diagnostics),
        file: SceneFile { scene: Scene { places: Places::new(source), ..Scene::default() }, ..SceneFile::default() },
    };
    scene.read(&top);
    let file = scene.file;
    check::alone(&file.scene, diagnostics);
    Some(file)
}

/// A scene file that is being read.
struct SceneReader<'a> {
    reader: Reader<'a>,
    file: SceneFile,
}

impl SceneReader<'_> {
    fn read(&mut self, top: &Table) {
        self.reader.check_keys(top, TOP);
        if let Some(table) = self.reader.table_at(top, "outputs", "[outputs]") {
            self.outputs(&table);
        }
        if let Some(table) = self.reader.table_at(top, "hold", "[hold]") {
            self.hold(&table);
        }
        for table in self.reader.tables_at(top, "payload") {
            self.payload(table);
        }
        if let Some(table) = self.reader.table_at(top, "zero", "[zero]") {
            self.zero(&table);
        }
        if let Some(table) = self.reader.table_at(top, "effects", "[effects]") {
            self.effects(&table);
        }
        for table in self.reader.tables_at(top, "parameter") {
            self.parameter(table);
        }
        self.file.scene.drives = self.reader.drives_at(top);
        self.file.scene.flexible = self.reader.flexible_links_at(top);
        self.file.scene.support = self.reader.support_at(top);
        if let Some(table) = self.reader.table_at(top, "numbers", "[numbers]") {
            self.numbers(&table);
        }
        if let Some(table) = self.reader.table_at(top, "budget", "[budget]") {
            self.budgets(&table);
        }
        if let Some(table) = self.reader.table_at(top, "diagnostics", "[diagnostics]") {
            self.levels(&table);
        }
        self.contacts(top);
    }

    /// What becomes of warnings.
    fn levels(&mut self, table: &Table) {
        self.reader.check_keys(table, &Level::ALL.map(Level::word));
        for level in Level::ALL {
            for code in self.reader.names_at(table, level.word(), "code") {
                match Levels::complaint(&code.value, level) {
                    Some(complaint) => self.reader.diagnostics.push(complaint.at(&code.place)),
                    None => self.file.levels.set(code.value, level),
                }
            }
        }
    }

    /// The value, its place noted under that path.
    fn noted<T>(&mut self, path: &str, value: Option<Value<T>>) -> Option<T> {
        let value = value?;
        self.file.scene.places.note(path, &value.place);
        Some(value.value)
    }

    /// Names in an array, their places noted under that path.
    fn names(&mut self, path: &str, table: &Table, key: &str, what: &str) -> Vec<String> {
        let names = self.reader.names_at(table, key, what);
        if let Some((_, span)) = table.get(key) {
            let place = self.reader.place(&span);
            self.file.scene.places.note(path, &place);
        }
        let note = |(i, name): (usize, Value<String>)| {
            self.file.scene.places.note(format!("{path}.{i}"), &name.place);
            name.value
        };
        names.into_iter().enumerate().map(note).collect()
    }

    fn outputs(&mut self, table: &Table) {
        let names: Vec<&str> = Function::known().map(Function::name).collect();
        self.reader.check_keys(table, &[&["functions", "staged", "limbs", "matrices", "contact"], &names[..]].concat());
        self.file.scene.staged = self.reader.flag_at(table, "staged").is_some_and(|flag| flag.value);
        let forms: Vec<(&str, LimbForm)> = LimbForm::words().into_iter().map(|(word, _, form)| (word, form)).collect();
        if let Some(form) = self.reader.word_at(table, "limbs", &forms) {
            self.file.scene.places.note("outputs.limbs", &form.place);
            self.file.limbs = Some(form.value);
        }
        let orders = [("by rows", false), ("by columns", true)];
        self.file.scene.by_columns = self.reader.word_at(table, "matrices", &orders).is_some_and(|order| order.value);
        self.contact_functions(table);
        if let Some((_, span)) = table.get("functions") {
            let place = self.reader.place(&span);
            self.file.scene.places.note("outputs.functions", &place);
        }
        let mut functions: Vec<Function> = Vec::new();
        let mut all_are_known = true;
        for name in self.reader.names_at(table, "functions", "function") {
            match Function::from_name(&name.value) {
                Some(function) => functions.push(function),
                None => {
                    let complaint = messages::unknown_word("functions of [outputs]", &name.value, &names);
                    self.reader.diagnostics.push(complaint.at(&name.place));
                    all_are_known = false;
                }
            }
        }
        for function in Function::known() {
            let name = function.name();
            let owner = format!("`{name}` of [outputs]");
            let Some(wanted) = self.reader.table_at(table, name, &owner) else { continue };
            self.reader.check_keys(&wanted, &["joints", "frames", "part"]);
            let path = format!("outputs.{name}");
            let place = self.reader.place(&wanted.span);
            self.file.scene.places.note(&*path, &place);
            let joints = self.names(&format!("{path}.joints"), &wanted, "joints", "joint");
            let frames = self.names(&format!("{path}.frames"), &wanted, "frames", "frame");
            let part = self.reader.word_at(&wanted, "part", &Part::WORDS);
            let part = self.noted(&format!("{path}.part"), part).unwrap_or_default();
            self.file.scene.outputs.insert(function, Selection { joints, frames, part });
            functions.push(function);
        }
        functions.sort_unstable();
        functions.dedup();
        if all_are_known && (table.has("functions") || !functions.is_empty()) {
            self.file.functions = Some(functions);
        }
    }

    fn hold(&mut self, table: &Table) {
        self.reader.check_keys(table, &["gravity", "base", "joints"]);
        if let Some((value, span)) = table.get("gravity") {
            let place = self.reader.place(&span);
            self.file.scene.places.note("hold.gravity", &place);
            let gravity = match value {
                DeValue::String(_) => {
                    let words = [("zero", Gravity::Constant([0.0; 3])), ("input", Gravity::Input)];
                    self.reader.word_at(table, "gravity", &words).map(|g| g.value)
                }
                DeValue::Array(_) => self.reader.vector_at(table, "gravity").map(|g| Gravity::Constant(g.value)),
                _ => {
                    let forms = "`[0.0, 0.0, -9.81]`, `\"zero\"` or `\"input\"`";
                    self.reader.wrong_type(&table.what("gravity"), forms, value, &span);
                    None
                }
            };
            self.file.scene.gravity = gravity.unwrap_or_default();
        }
        let base = self.reader.word_at(table, "base", &BASES);
        self.file.scene.base = self.noted("hold.base", base).unwrap_or_default();
        if let Some(joints) = self.reader.table_at(table, "joints", "joints of [hold]") {
            let place = self.reader.place(&joints.span);
            self.file.scene.places.note("hold.joints", &place);
            // in the order of the file: keys of a table come sorted
            let mut keys: Vec<_> = joints.table.keys().collect();
            keys.sort_by_key(|key| key.span().start);
            for key in keys {
                let (joint, place) = (key.get_ref().to_string(), self.reader.place(&key.span()));
                if let Some(value) = self.reader.real_at(&joints, &joint, Range64::Finite) {
                    self.file.scene.places.note(format!("hold.joints.{joint}"), &place);
                    self.file.scene.locked.push((joint, value.value));
                }
            }
        }
    }

    fn payload(&mut self, mut table: Table) {
        let i = self.file.scene.payloads.len();
        let reader = &mut self.reader;
        reader.require(&table, "name", "name = \"...\"");
        let name = reader.name_at(&table, "name", "payload");
        if let Some(name) = &name {
            table.owner = format!("payload `{}`", name.value);
        }
        reader.check_keys(&table, &["name", "frame", "mass", "com", "inertia"]);
        reader.require(&table, "frame", "frame = \"...\"");
        let frame = reader.name_at(&table, "frame", "frame");
        reader.require(&table, "mass", "mass = 1.0");
        let mass = reader.real_at(&table, "mass", Range64::Finite);
        let com = reader.vector_at(&table, "com");
        let inertia = reader.tensor_at(&table, "inertia");
        let place = reader.place(&table.span);
        self.file.scene.places.note(format!("payload.{i}"), &place);
        let name = self.noted(&format!("payload.{i}.name"), name);
        let frame = self.noted(&format!("payload.{i}.frame"), frame);
        let mass = self.noted(&format!("payload.{i}.mass"), mass);
        let com = self.noted(&format!("payload.{i}.com"), com).unwrap_or_default();
        let inertia = self.noted(&format!("payload.{i}.inertia"), inertia);
        let inertia = inertia.map_or([0.0; 6], |j| [j.xx, j.xy, j.xz, j.yy, j.yz, j.zz]);
        if let (Some(name), Some(frame), Some(mass)) = (name, frame, mass) {
            self.file.scene.payloads.push(Payload { name, frame, mass, com, inertia });
        }
    }

    fn zero(&mut self, table: &Table) {
        self.reader.check_keys(table, &["qd", "qdd", "joints_at_rest"]);
        let mut flag = |key: &str| self.reader.flag_at(table, key).is_some_and(|flag| flag.value);
        let (qd, qdd) = (flag("qd"), flag("qdd"));
        let joints_at_rest = self.names("zero.joints_at_rest", table, "joints_at_rest", "joint");
        self.file.scene.zero = super::Zero { qd, qdd, joints_at_rest };
    }

    fn effects(&mut self, table: &Table) {
        let own = ["rotor_inertia", "damping", "coulomb", "coulomb_speed", "springs"];
        self.reader.check_keys(
            table,
            &[&own[..], &["transmission_losses", "elastic_transmissions", "elastic_links"]].concat(),
        );
        let mut flag = |key: &str| self.reader.flag_at(table, key).is_none_or(|flag| flag.value);
        let (rotor_inertia, damping, springs) = (flag("rotor_inertia"), flag("damping"), flag("springs"));
        let (transmission_losses, elastic_transmissions) = (flag("transmission_losses"), flag("elastic_transmissions"));
        let elastic_links = flag("elastic_links");
        let form = self.reader.word_at(table, "coulomb", &COULOMB);
        let speed = self.reader.real_at(table, "coulomb_speed", Range64::Finite);
        let speed_place = speed.as_ref().map(|s| s.place.clone());
        let form_place = form.as_ref().map(|f| f.place.clone());
        let speed = self.noted("effects.coulomb_speed", speed);
        let coulomb = match (form.map(|f| f.value).unwrap_or_default(), speed) {
            (Coulomb::Smooth(_), Some(speed)) => Coulomb::Smooth(speed),
            (Coulomb::Smooth(_), None) => {
                // a speed that could not be read was complained of
                if let Some(place) = form_place.filter(|_| !table.has("coulomb_speed")) {
                    self.reader.diagnostics.push(say::coulomb_speed_missing().at(&place));
                }
                Coulomb::Sign
            }
            (form, Some(_)) => {
                if let Some(place) = speed_place {
                    self.reader.diagnostics.push(say::coulomb_speed_alone().at(&place));
                }
                form
            }
            (form, None) => form,
        };
        self.file.scene.effects = super::Effects {
            rotor_inertia,
            damping,
            coulomb,
            springs,
            transmission_losses,
            elastic_transmissions,
            elastic_links,
        };
    }

    fn parameter(&mut self, table: Table) {
        let i = self.file.scene.parameters.len();
        let reader = &mut self.reader;
        let place = reader.place(&table.span);
        self.file.scene.places.note(format!("parameter.{i}"), &place);
        reader.require(&table, "kind", "kind = \"payload\"");
        let kinds = [("payload", Kind::Payload), ("link", Kind::Link), ("drive", Kind::Drive)];
        let Some(kind) = reader.word_at(&table, "kind", &kinds) else { return };
        let parameter = match kind.value {
            Kind::Payload => {
                reader.check_keys(&table, &["kind", "name", "frame"]);
                reader.require(&table, "name", "name = \"payload\"");
                reader.require(&table, "frame", "frame = \"...\"");
                let (name, frame) =
                    (reader.name_at(&table, "name", "parameter"), reader.name_at(&table, "frame", "frame"));
                let name = self.noted(&format!("parameter.{i}.name"), name);
                let frame = self.noted(&format!("parameter.{i}.frame"), frame);
                name.zip(frame).map(|(name, frame)| Parameter::Payload { name, frame })
            }
            Kind::Link => {
                reader.check_keys(&table, &["kind", "link"]);
                reader.require(&table, "link", "link = \"...\"");
                let link = reader.name_at(&table, "link", "link");
                self.noted(&format!("parameter.{i}.link"), link).map(|link| Parameter::Link { link })
            }
            Kind::Drive => {
                reader.check_keys(&table, &["kind", "name", "drive", "numbers"]);
                reader.require(&table, "drive", "drive = \"...\"");
                reader.require(&table, "numbers", "numbers = [\"ratio\", \"rotor_inertia\"]");
                let (name, drive) =
                    (reader.name_at(&table, "name", "parameter"), reader.name_at(&table, "drive", "drive"));
                let name = self.noted(&format!("parameter.{i}.name"), name);
                let drive = self.noted(&format!("parameter.{i}.drive"), drive);
                let numbers = self.names(&format!("parameter.{i}.numbers"), &table, "numbers", "number");
                drive.map(|drive| Parameter::Drive { name, drive, numbers, form: None })
            }
        };
        self.file.scene.parameters.extend(parameter);
    }

    fn numbers(&mut self, table: &Table) {
        let certify = ["certify", "certify_boxes", "certify_seconds", "certify_state"];
        self.reader.check_keys(table, &[&["scalar", "angle_tolerance", "ranges"], &certify[..]].concat());
        self.certify(table);
        let scalars: Vec<(&str, Scalar)> = Scalar::words().into_iter().map(|(word, _, s)| (word, s)).collect();
        self.file.scalars = match table.get("scalar") {
            Some((DeValue::Array(_), span)) => {
                let place = self.reader.place(&span);
                self.file.scene.places.note("numbers.scalar", &place);
                let words = self.reader.names_at(table, "scalar", "scalar type");
                words.iter().filter_map(|word| self.reader.word("scalar types", word, &scalars)).collect()
            }
            _ => {
                let word = self.reader.word_at(table, "scalar", &scalars);
                word.iter().for_each(|word| self.file.scene.places.note("numbers.scalar", &word.place));
                word.map(|word| word.value).into_iter().collect()
            }
        };
        let tolerance = self.reader.real_at(table, "angle_tolerance", Range64::Finite);
        if let Some(value) = tolerance.as_ref().filter(|t| !(0.0..=0.1).contains(&t.value)) {
            let complaint = say::not_in_range("angle_tolerance", value.value, "between 0 and 0.1 rad");
            self.reader.diagnostics.push(complaint.at(&value.place));
        }
        self.file.angle_tolerance = tolerance.map(|t| t.value);
        if let Some(ranges) = self.reader.table_at(table, "ranges", "[numbers.ranges]") {
            self.ranges(&ranges);
        }
    }

    fn certify(&mut self, table: &Table) {
        let certify = self.reader.flag_at(table, "certify").is_some_and(|flag| flag.value);
        let companions = self.reader.flag_at(table, "certify_state").is_some_and(|flag| flag.value);
        let boxes = self.reader.count_at(table, "certify_boxes");
        let seconds = self.reader.real_at(table, "certify_seconds", Range64::Finite);
        let (most_boxes, most_seconds) = (Effort::MOST_BOXES, Effort::MOST_SECONDS);
        if let Some(n) = boxes.as_ref().filter(|n| !(1..=most_boxes).contains(&n.value)) {
            let range = format!("between 1 and {most_boxes}");
            let complaint = say::not_in_range("certify_boxes", n.value as f64, &range);
            self.reader.diagnostics.push(complaint.at(&n.place));
        }
        let is_sound = |x: f64| x > 0.0 && x <= most_seconds;
        if let Some(s) = seconds.as_ref().filter(|s| !is_sound(s.value)) {
            let complaint =
                say::not_in_range("certify_seconds", s.value, &format!("above 0 and up to {most_seconds} s"));
            self.reader.diagnostics.push(complaint.at(&s.place));
        }
        if certify || companions || boxes.is_some() || seconds.is_some() {
            let seconds = seconds.map(|s| s.value).filter(|s| is_sound(*s));
            self.file.certify = Some(Effort::new(boxes.map(|n| n.value), seconds, companions));
        }
    }

    fn ranges(&mut self, table: &Table) {
        self.reader.check_keys(table, &["q", "qd", "qdd", "tau", "gravity"]);
        let place = self.reader.place(&table.span);
        self.file.scene.places.note("numbers.ranges", &place);
        let [q, qd, qdd, tau] = ["q", "qd", "qdd", "tau"].map(|input| self.joint_ranges(table, input));
        let gravity = self.range(table, "gravity", "numbers.ranges.gravity");
        self.file.scene.ranges = Ranges { q, qd, qdd, tau, gravity };
    }

    /// The range of an input: one for all joints, or a table by joint.
    fn joint_ranges(&mut self, table: &Table, input: &str) -> JointRanges {
        let path = format!("numbers.ranges.{input}");
        let Some((DeValue::Table(_), span)) = table.get(input) else {
            return self.range(table, input, &path).map_or(JointRanges::Limits, JointRanges::All);
        };
        let place = self.reader.place(&span);
        self.file.scene.places.note(&*path, &place);
        let owner = format!("the ranges of `{input}`");
        let Some(joints) = self.reader.table_at(table, input, &owner) else { return JointRanges::Limits };
        // in the order of the file: keys of a table come sorted
        let mut keys: Vec<_> = joints.table.keys().collect();
        keys.sort_by_key(|key| key.span().start);
        let mut named = Vec::new();
        for joint in keys.into_iter().map(|key| key.get_ref().to_string()) {
            if let Some(range) = self.range(&joints, &joint, &format!("{path}.{joint}")) {
                named.push((joint, range));
            }
        }
        JointRanges::Joints(named)
    }

    /// `[lower, upper]`, one number for both sides of zero, or `"unlimited"`.
    fn range(&mut self, table: &Table, key: &str, path: &str) -> Option<Interval> {
        let (value, span) = table.get(key)?;
        let place = self.reader.place(&span);
        self.file.scene.places.note(path, &place);
        match value {
            DeValue::String(_) => {
                self.reader.word_at(table, key, &[("unlimited", Interval::UNLIMITED)]).map(|word| word.value)
            }
            DeValue::Array(_) => {
                let [lower, upper] =
                    self.reader.reals_at(table, key, "two numbers, least and greatest", Range64::Limit)?;
                Some(Interval { lower, upper })
            }
            DeValue::Integer(_) | DeValue::Float(_) => {
                self.reader.real_at(table, key, Range64::Limit).map(|bound| Interval::within(bound.value))
            }
            _ => {
                let forms = "`[-1.0, 2.0]`, `2.0` for both sides of zero, or `\"unlimited\"`";
                self.reader.wrong_type(&table.what(key), forms, value, &span);
                None
            }
        }
    }

    /// A number for all results, an array with one for each, or, where they may be named, a table of such by output.
    fn max_error(&mut self, table: &Table, key: &str, path: &str, named: bool) -> Option<MaxError> {
        let (value, span) = table.get(key)?;
        let place = self.reader.place(&span);
        self.file.scene.places.note(path, &place);
        let found = match value {
            DeValue::Integer(_) | DeValue::Float(_) => {
                MaxError::All(self.reader.real_at(table, key, Range64::Finite)?.value)
            }
            DeValue::Array(array) => {
                let what = table.what(key);
                let numbers: Vec<Option<f64>> = array
                    .iter()
                    .map(|item| self.reader.real(&what, item.get_ref(), &item.span(), Range64::Finite))
                    .collect();
                MaxError::Each(numbers.into_iter().collect::<Option<Vec<f64>>>()?)
            }
            DeValue::Table(_) if named => {
                let outputs = self.reader.table_at(table, key, &table.what(key))?;
                let mut keys: Vec<_> = outputs.table.keys().collect();
                keys.sort_by_key(|key| key.span().start);
                let keys: Vec<String> = keys.into_iter().map(|key| key.get_ref().to_string()).collect();
                let parts = keys.into_iter().filter_map(|output| {
                    let most = self.max_error(&outputs, &output, &format!("{path}.{output}"), false)?;
                    Some((output, most))
                });
                MaxError::Outputs(parts.collect())
            }
            _ => {
                let forms = match named {
                    true => "a number, an array of numbers, or `{ output = number or array }`",
                    false => "a number, or an array of numbers",
                };
                self.reader.wrong_type(&table.what(key), forms, value, &span);
                return None;
            }
        };
        let numbers = match &found {
            MaxError::All(x) => std::slice::from_ref(x),
            MaxError::Each(list) => &list[..],
            MaxError::Outputs(_) => &[],
        };
        if let Some(x) = numbers.iter().find(|x| **x <= 0.0) {
            self.reader.diagnostics.push(say::not_in_range("max_error", *x, "above zero").at(&place));
            return None;
        }
        Some(found)
    }

    fn budgets(&mut self, table: &Table) {
        let names: Vec<&str> = Function::known().map(Function::name).collect();
        self.reader.check_keys(table, &names);
        for function in Function::known() {
            let name = function.name();
            let Some(limits) = self.reader.table_at(table, name, &format!("[budget.{name}]")) else { continue };
            self.reader.check_keys(&limits, BUDGET);
            let place = self.reader.place(&limits.span);
            self.file.scene.places.note(format!("budget.{name}"), &place);
            let mut limit = |key: &str| {
                let count = self.reader.count_at(&limits, key)?;
                self.file.scene.places.note(format!("budget.{name}.{key}"), &count.place);
                Some(count.value)
            };
            let budget = Budget {
                max_flops: limit("max_flops"),
                max_sincos: limit("max_sincos"),
                max_live: limit("max_live"),
                max_stack_bytes: limit("max_stack_bytes"),
                max_code_bytes: limit("max_code_bytes"),
                max_error: None,
                mixed_precision: false,
            };
            let max_error = self.max_error(&limits, "max_error", &format!("budget.{name}.max_error"), true);
            let mixed = self.reader.flag_at(&limits, "mixed_precision").filter(|flag| flag.value);
            if let (Some(flag), None) = (&mixed, &max_error) {
                self.reader.diagnostics.push(say::mixed_alone().at(&flag.place));
            }
            let mixed_precision = self.noted(&format!("budget.{name}.mixed_precision"), mixed).is_some();
            let budget = Budget { max_error, mixed_precision, ..budget };
            self.file.scene.budgets.insert(function, budget);
            if self.file.functions.as_ref().is_some_and(|functions| !functions.contains(&function)) {
                self.reader.complain(&limits.span, say::budget_alone(name));
            }
        }
    }
}
