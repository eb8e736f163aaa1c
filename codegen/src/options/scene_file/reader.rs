//! What stands in a scene file, table by table.

mod contact;

use super::{SceneFile, LISTS};
use crate::description::reader::{Range64, Reader};
use crate::description::table::Table;
use crate::description::{messages, Value};
use crate::diagnostic::{Diagnostics, Front, Source};
use crate::function::Function;
use crate::options::table::{Kind, Place, Row, TABLE};
use crate::options::value;
use crate::scene::{
    messages as say, Base, Budget, Coulomb, Gravity, Interval, JointRanges, MaxError, Parameter, Part, Payload, Places,
    Ranges, Scene, Selection, Zero,
};
use std::ops::Range;
use toml::de::DeValue;

/// The tables of which there is one each, beside [`LISTS`].
const TABLES: &[&str] =
    &["stabilisation", "outputs", "hold", "zero", "effects", "support", "numbers", "budget", "options", "diagnostics"];
const BUDGET: &[&str] =
    &["max_flops", "max_sincos", "max_live", "max_stack_bytes", "max_code_bytes", "max_error", "mixed_precision"];
const BASES: [(&str, Base); 3] = [("fixed", Base::Fixed), ("floating", Base::Floating), ("moving", Base::Moving)];
/// A place in the list of effects: that its speed is still to be read.
const SMOOTH: Coulomb = Coulomb::Smooth(0.0);
const COULOMB: [(&str, Coulomb); 3] = [("off", Coulomb::Off), ("sign", Coulomb::Sign), ("smooth", SMOOTH)];

/// What a `[[parameter]]` is of.
#[derive(Clone, Copy)]
enum Kinds {
    Payload,
    Link,
    Drive,
}

/// The names of the options that stand in a table.
fn options_of(table: &str) -> Vec<&'static str> {
    TABLE.iter().filter(|row| row.stands_in(table)).map(|row| row.name).collect()
}

/// Reads a scene file from its top.
pub fn read(source: &Source, top: &Table, diagnostics: &mut Diagnostics) -> SceneFile {
    let mut scene = SceneReader {
        reader: Reader::new(source, diagnostics),
        file: SceneFile { scene: Scene { places: Places::new(source), ..Scene::default() }, ..SceneFile::default() },
    };
    scene.read(top);
    scene.file
}

/// A scene file that is being read.
struct SceneReader<'a> {
    reader: Reader<'a>,
    file: SceneFile,
}

impl SceneReader<'_> {
    fn read(&mut self, top: &Table) {
        self.reader.check_keys(top, &[LISTS, TABLES].concat());
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
            self.reader.check_keys(&table, &options_of("diagnostics"));
            self.options(&table, "diagnostics");
        }
        if let Some(table) = self.reader.table_at(top, "options", "[options]") {
            self.own_options(&table);
        }
        self.contacts(top);
    }

    /// `[options]`: a key that stands elsewhere is told where.
    fn own_options(&mut self, table: &Table) {
        let known = options_of("options");
        for key in table.table.keys().filter(|key| !known.contains(&key.get_ref().as_ref())) {
            let complaint = messages::unknown_key(&table.owner, key.get_ref(), &known);
            let elsewhere = TABLE.iter().find(|row| row.name == key.get_ref().as_ref()).map(|row| match row.scene {
                Place::In(other) => format!("it stands in [{other}]"),
                Place::Key(other) => format!("write {other}"),
                Place::Not(why) => why.to_string(),
                Place::Options | Place::Also(_) => unreachable!("a key of [options] is known"),
            });
            let complaint = elsewhere.into_iter().fold(complaint, |complaint, help| complaint.help(help));
            self.reader.complain(&key.span(), complaint);
        }
        self.options(table, "options");
    }

    /// The options that stand in a table of that name.
    fn options(&mut self, table: &Table, name: &str) {
        for row in TABLE.iter().filter(|row| row.stands_in(name)) {
            let Some((_, span)) = table.get(row.name) else { continue };
            let place = self.reader.place(&span);
            if self.file.settings.has(row.name) {
                let Place::Also(other) = row.scene else { continue };
                self.reader.diagnostics.push(say::written_twice(row.name, other).at(&place));
            }
            let Some(value) = self.option(table, row, &span) else { continue };
            self.file.scene.places.note(format!("options.{}", row.name), &place);
            self.file.settings.give(row, value, Front::CommandLine).expect("it was checked word by word");
        }
    }

    /// The value of an option; `None` after a complaint that leaves nothing of it.
    fn option(&mut self, table: &Table, row: &'static Row, span: &Range<usize>) -> Option<value::Value> {
        let (reader, key) = (&mut self.reader, row.name);
        let number = match &row.kind {
            Kind::Flag => return reader.flag_at(table, key).map(|flag| flag.value.into()),
            Kind::Vector => return reader.vector_at(table, key).map(|vector| vector.value.into()),
            Kind::Real(..) => reader.real_at(table, key, Range64::Finite)?.value,
            Kind::Whole(..) => reader.count_at(table, key)?.value as f64,
            _ => return self.words(table, row),
        };
        match row.wrong_number(number) {
            None => Some(number.into()),
            Some(wrong) => {
                reader.complain(span, wrong);
                None
            }
        }
    }

    /// The words of an option: one as a text, several in an array. Of codes those count that are right.
    fn words(&mut self, table: &Table, row: &'static Row) -> Option<value::Value> {
        let (reader, key) = (&mut self.reader, row.name);
        let is_codes = matches!(row.kind, Kind::Codes(_));
        let (words, count) = match (table.get(key)?.0, &row.kind) {
            (DeValue::Array(array), Kind::Words(_) | Kind::Names { .. } | Kind::Codes(_)) => {
                (reader.names_at(table, key, if is_codes { "code" } else { key.trim_end_matches('s') }), array.len())
            }
            (DeValue::String(_), Kind::Words(of)) if !of.is_of_items => (vec![reader.string_at(table, key)?], 1),
            (_, Kind::Word(..)) => (vec![reader.string_at(table, key)?], 1),
            _ => (reader.names_at(table, key, ""), 1),
        };
        let mut right = Vec::new();
        for word in words {
            let known = |of: &value::Vocabulary| (of.words)().iter().map(|(word, _)| *word).collect::<Vec<&str>>();
            let wrong = row.wrong_word(&word.value).map(|wrong| match &row.kind {
                Kind::Word(of, _) | Kind::Words(of) => {
                    messages::unknown_word(&table.what(key), &word.value, &known(of))
                }
                _ => wrong,
            });
            match wrong {
                Some(wrong) => reader.diagnostics.push(wrong.at(&word.place)),
                None => right.push(word.value),
            }
        }
        (is_codes || right.len() == count).then_some(value::Value::Words(right))
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
        self.reader
            .check_keys(table, &[&options_of("outputs")[..], &["staged", "matrices", "contact"], &names[..]].concat());
        self.options(table, "outputs");
        self.file.scene.staged = self.reader.flag_at(table, "staged").is_some_and(|flag| flag.value);
        let orders = [("by rows", false), ("by columns", true)];
        self.file.scene.by_columns = self.reader.word_at(table, "matrices", &orders).is_some_and(|order| order.value);
        self.contact_functions(table);
        let whole = self.file.settings.value("functions").cloned();
        let all_are_known = whole.is_some() || !table.has("functions");
        let mut functions: Vec<Function> = whole.iter().flat_map(value::Value::choices).collect();
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
        if all_are_known && !functions.is_empty() {
            let row = Row::find("functions", |_| true).expect("functions are an option");
            let value = value::Value::of_choices(functions);
            self.file.settings.give(row, value, Front::CommandLine).expect("functions have names");
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
        self.file.scene.zero = Zero { qd, qdd, joints_at_rest };
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
        self.file.scene.effects = crate::scene::Effects {
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
        let kinds = [("payload", Kinds::Payload), ("link", Kinds::Link), ("drive", Kinds::Drive)];
        let Some(kind) = reader.word_at(&table, "kind", &kinds) else { return };
        let parameter = match kind.value {
            Kinds::Payload => {
                reader.check_keys(&table, &["kind", "name", "frame"]);
                reader.require(&table, "name", "name = \"payload\"");
                reader.require(&table, "frame", "frame = \"...\"");
                let (name, frame) =
                    (reader.name_at(&table, "name", "parameter"), reader.name_at(&table, "frame", "frame"));
                let name = self.noted(&format!("parameter.{i}.name"), name);
                let frame = self.noted(&format!("parameter.{i}.frame"), frame);
                name.zip(frame).map(|(name, frame)| Parameter::Payload { name, frame })
            }
            Kinds::Link => {
                reader.check_keys(&table, &["kind", "link"]);
                reader.require(&table, "link", "link = \"...\"");
                let link = reader.name_at(&table, "link", "link");
                self.noted(&format!("parameter.{i}.link"), link).map(|link| Parameter::Link { link })
            }
            Kinds::Drive => {
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
        self.reader.check_keys(table, &[&options_of("numbers")[..], &["ranges"]].concat());
        self.options(table, "numbers");
        if let Some(ranges) = self.reader.table_at(table, "ranges", "[numbers.ranges]") {
            self.ranges(&ranges);
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
        let wanted: Option<Vec<Function>> = self.file.settings.value("functions").map(value::Value::choices);
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
            if wanted.as_ref().is_some_and(|functions| !functions.contains(&function)) {
                self.reader.complain(&limits.span, say::budget_alone(name));
            }
        }
    }
}
