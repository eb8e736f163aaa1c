//! What stands in a scene file, table by table.

mod contact;
mod options;

use super::{SceneFile, LISTS};
use crate::description::reader::{FileReader, Range64};
use crate::description::table::TomlTable;
use crate::description::Noted;
use crate::diagnostic::{Diagnostics, Front, Source};
use crate::function::{Function, SelectedRows};
use crate::options::table::OptionRow;
use crate::options::value;
use crate::scene::{
    messages as say, Base, Budget, CoulombForm, Gravity, InputRange, JointRanges, MaxError, Parameter, Payload, Places,
    Ranges, ResultPart, Scene, Selection, Zero,
};
use options::options_of;
use std::ops::Range;
use straightline_core::base_parameters::JointParameter;
use toml::de::DeValue;

/// The tables of which there is one each, beside [`LISTS`].
const TABLES: &[&str] = &[
    "stabilisation",
    "outputs",
    "hold",
    "zero",
    "effects",
    "regressor",
    "support",
    "numbers",
    "budget",
    "options",
    "diagnostics",
];
const BUDGET: &[&str] = &[
    "max_flops",
    "max_sincos",
    "max_live",
    "max_stack_bytes",
    "max_code_bytes",
    "max_instructions",
    "max_flash_bytes",
    "max_error",
    "mixed_precision",
];
const BASES: [(&str, Base); 3] = [("fixed", Base::Fixed), ("floating", Base::Floating), ("moving", Base::Moving)];
/// A place in the list of effects: that its speed is still to be read.
const SMOOTH: CoulombForm = CoulombForm::Smooth(0.0);
const COULOMB: [(&str, CoulombForm); 3] = [("off", CoulombForm::Off), ("sign", CoulombForm::Sign), ("smooth", SMOOTH)];

/// What a `[[parameter]]` is of.
#[derive(Clone, Copy)]
enum Kinds {
    Payload,
    Link,
    Drive,
}

/// The keys of a table in the order of the file: they come sorted.
fn in_order(table: &TomlTable) -> Vec<(String, Range<usize>)> {
    let mut keys: Vec<_> = table.table.keys().map(|key| (key.get_ref().to_string(), key.span())).collect();
    keys.sort_by_key(|(_, span)| span.start);
    keys
}

/// Reads a scene file from its top.
pub fn read(source: &Source, top: &TomlTable, diagnostics: &mut Diagnostics) -> SceneFile {
    let mut scene = SceneReader {
        reader: FileReader::new(source, diagnostics),
        file: SceneFile { scene: Scene { places: Places::new(source), ..Scene::default() }, ..SceneFile::default() },
    };
    scene.read(top);
    scene.file
}

/// How a table is read.
type TableReading<'a> = fn(&mut SceneReader<'a>, &TomlTable);

/// A scene file that is being read.
struct SceneReader<'a> {
    reader: FileReader<'a>,
    file: SceneFile,
}

impl<'a> SceneReader<'a> {
    fn read(&mut self, top: &TomlTable) {
        self.reader.check_keys(top, &[LISTS, TABLES].concat());
        let tables: [(&str, TableReading<'a>); 9] = [
            ("outputs", Self::outputs),
            ("hold", Self::hold),
            ("zero", Self::zero),
            ("effects", Self::effects),
            ("regressor", Self::regressor),
            ("numbers", Self::numbers),
            ("budget", Self::budgets),
            ("diagnostics", Self::diagnostics),
            ("options", Self::own_options),
        ];
        for (name, read) in tables {
            if let Some(table) = self.reader.table_at(top, name, &format!("[{name}]")) {
                read(self, &table);
            }
        }
        for table in self.reader.tables_at(top, "payload") {
            self.payload(table);
        }
        for table in self.reader.tables_at(top, "parameter") {
            self.parameter(table);
        }
        self.file.scene.drives = self.reader.drives_at(top);
        self.file.scene.couplings = self.reader.couplings_at(top);
        self.file.scene.flexible = self.reader.flexible_links_at(top);
        self.file.scene.support = self.reader.support_at(top);
        self.contacts(top);
    }

    fn diagnostics(&mut self, table: &TomlTable) {
        self.reader.check_keys(table, &options_of("diagnostics"));
        self.options(table, "diagnostics");
    }

    /// Notes the place of bytes under a path.
    fn note(&mut self, path: &str, span: &Range<usize>) {
        let place = self.reader.place(span);
        self.file.scene.places.note(path, &place);
    }

    /// The value of a key in the table of that path, by a method of the reader; its place is noted.
    fn at<T>(
        &mut self,
        path: &str,
        table: &TomlTable,
        key: &str,
        read: impl FnOnce(&mut FileReader<'a>, &TomlTable, &str) -> Option<Noted<T>>,
    ) -> Option<T> {
        let value = read(&mut self.reader, table, key)?;
        self.file.scene.places.note(format!("{path}.{key}"), &value.place);
        Some(value.value)
    }

    fn real(&mut self, path: &str, table: &TomlTable, key: &str) -> Option<f64> {
        self.at(path, table, key, |reader, table, key| reader.real_at(table, key, Range64::Finite))
    }

    /// A name of something, in words; there has to be one.
    fn needed(&mut self, path: &str, table: &TomlTable, key: &str, what: &str) -> Option<String> {
        self.reader.require(table, key, &format!("{key} = \"...\""));
        self.at(path, table, key, |reader, table, key| reader.name_at(table, key, what))
    }

    /// Names in an array, their places noted under that path.
    fn names(&mut self, path: &str, table: &TomlTable, key: &str, what: &str) -> Vec<String> {
        let names = self.reader.names_at(table, key, what);
        table.get(key).iter().for_each(|(_, span)| self.note(path, span));
        let note = |(i, name): (usize, Noted<String>)| {
            self.file.scene.places.note(format!("{path}.{i}"), &name.place);
            name.value
        };
        names.into_iter().enumerate().map(note).collect()
    }

    fn outputs(&mut self, table: &TomlTable) {
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
        let mut functions: Vec<Function> = whole.iter().flat_map(value::OptionValue::choices).collect();
        for function in Function::known() {
            let name = function.name();
            let owner = format!("`{name}` of [outputs]");
            let Some(wanted) = self.reader.table_at(table, name, &owner) else { continue };
            self.reader.check_keys(&wanted, &["joints", "frames", "part", "results"]);
            let path = format!("outputs.{name}");
            self.note(&path, &wanted.span);
            let joints = self.names(&format!("{path}.joints"), &wanted, "joints", "joint");
            let frames = self.names(&format!("{path}.frames"), &wanted, "frames", "frame");
            let part = self.part(&path, &wanted);
            let results = self.names(&format!("{path}.results"), &wanted, "results", "result");
            self.file.scene.outputs.insert(function, Selection { joints, frames, part, results });
            functions.push(function);
        }
        if all_are_known && !functions.is_empty() {
            let row = OptionRow::find("functions", |_| true).expect("functions are an option");
            let value = value::OptionValue::of_choices(functions);
            self.file.settings.give(row, value, Front::CommandLine).expect("functions have names");
        }
    }

    /// A word, or a list of rows; no rows mean all.
    fn part(&mut self, path: &str, table: &TomlTable) -> ResultPart {
        if !matches!(table.get("part"), Some((DeValue::Array(_), _))) {
            let word = |reader: &mut FileReader<'a>, table: &TomlTable, key: &str| {
                reader.word_at(table, key, &ResultPart::WORDS)
            };
            return self.at(path, table, "part", word).unwrap_or_default();
        }
        let names = self.reader.names_at(table, "part", "row");
        table.get("part").iter().for_each(|(_, span)| self.note(&format!("{path}.part"), span));
        let words: Vec<(&str, usize)> =
            SelectedRows::WORDS.into_iter().enumerate().map(|(k, word)| (word, k)).collect();
        let rows: Vec<usize> =
            names.iter().filter_map(|name| self.reader.word(&table.what("part"), name, &words)).collect();
        match &rows[..] {
            [] => ResultPart::Whole,
            rows => ResultPart::Rows(SelectedRows::of(rows.iter().copied())),
        }
    }

    fn hold(&mut self, table: &TomlTable) {
        self.reader.check_keys(table, &["gravity", "base", "joints"]);
        if let Some((value, span)) = table.get("gravity") {
            self.note("hold.gravity", &span);
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
        let base = self.at("hold", table, "base", |reader, table, key| reader.word_at(table, key, &BASES));
        self.file.scene.base = base.unwrap_or_default();
        if let Some(joints) = self.reader.table_at(table, "joints", "joints of [hold]") {
            self.note("hold.joints", &joints.span);
            for (joint, span) in in_order(&joints) {
                if let Some(value) = self.reader.real_at(&joints, &joint, Range64::Finite) {
                    self.note(&format!("hold.joints.{joint}"), &span);
                    self.file.scene.locked.push((joint, value.value));
                }
            }
        }
    }

    fn payload(&mut self, mut table: TomlTable) {
        let path = format!("payload.{}", self.file.scene.payloads.len());
        let name = self.named_table(&path, "payload", &mut table);
        self.reader.check_keys(&table, &["name", "frame", "mass", "com", "inertia"]);
        let frame = self.needed(&path, &table, "frame", "frame");
        self.reader.require(&table, "mass", "mass = 1.0");
        let mass = self.real(&path, &table, "mass");
        let com = self.at(&path, &table, "com", FileReader::vector_at).unwrap_or_default();
        let inertia = self.at(&path, &table, "inertia", FileReader::tensor_at);
        let inertia = inertia.map_or([0.0; 6], |j| [j.xx, j.xy, j.xz, j.yy, j.yz, j.zz]);
        if let (Some(name), Some(frame), Some(mass)) = (name, frame, mass) {
            self.file.scene.payloads.push(Payload { name, frame, mass, com, inertia });
        }
    }

    fn zero(&mut self, table: &TomlTable) {
        self.reader.check_keys(table, &["qd", "qdd", "joints_at_rest"]);
        let mut flag = |key: &str| self.reader.flag_at(table, key).is_some_and(|flag| flag.value);
        let (qd, qdd) = (flag("qd"), flag("qdd"));
        let joints_at_rest = self.names("zero.joints_at_rest", table, "joints_at_rest", "joint");
        self.file.scene.zero = Zero { qd, qdd, joints_at_rest };
    }

    fn effects(&mut self, table: &TomlTable) {
        let own = ["rotor_inertia", "damping", "coulomb", "coulomb_speed", "springs"];
        self.reader.check_keys(
            table,
            &[&own[..], &["transmission_losses", "elastic_transmissions", "elastic_links", "couplings", "loops"]]
                .concat(),
        );
        let mut flag = |key: &str| self.reader.flag_at(table, key).is_none_or(|flag| flag.value);
        let (rotor_inertia, damping, springs) = (flag("rotor_inertia"), flag("damping"), flag("springs"));
        let (transmission_losses, elastic_transmissions) = (flag("transmission_losses"), flag("elastic_transmissions"));
        let (elastic_links, couplings, loops) = (flag("elastic_links"), flag("couplings"), flag("loops"));
        let form = self.reader.word_at(table, "coulomb", &COULOMB);
        let speed = self.reader.real_at(table, "coulomb_speed", Range64::Finite);
        let coulomb = match (form.as_ref().map(|f| f.value).unwrap_or_default(), &speed) {
            (CoulombForm::Smooth(_), Some(speed)) => CoulombForm::Smooth(speed.value),
            (CoulombForm::Smooth(_), None) => {
                // a speed that could not be read was complained of
                if let Some(form) = form.filter(|_| !table.has("coulomb_speed")) {
                    self.reader.diagnostics.push(say::coulomb_speed_missing().at(&form.place));
                }
                CoulombForm::Sign
            }
            (form, Some(speed)) => {
                self.reader.diagnostics.push(say::coulomb_speed_alone().at(&speed.place));
                form
            }
            (form, None) => form,
        };
        speed.iter().for_each(|speed| self.file.scene.places.note("effects.coulomb_speed", &speed.place));
        self.file.scene.effects = crate::scene::Effects {
            rotor_inertia,
            damping,
            coulomb,
            springs,
            transmission_losses,
            elastic_transmissions,
            elastic_links,
            couplings,
            loops,
        };
    }

    /// What of joints has columns, beside the bodies.
    fn regressor(&mut self, table: &TomlTable) {
        self.note("regressor", &table.span);
        self.reader.check_keys(table, &JointParameter::ALL.map(|(_, key, _)| key));
        for (parameter, key, _) in JointParameter::ALL {
            let is_wanted = self.reader.flag_at(table, key).is_some_and(|flag| flag.value);
            self.file.scene.regressor.extend(is_wanted.then_some(parameter));
        }
    }

    fn parameter(&mut self, table: TomlTable) {
        let path = format!("parameter.{}", self.file.scene.parameters.len());
        self.note(&path, &table.span);
        self.reader.require(&table, "kind", "kind = \"payload\"");
        let kinds = [("payload", Kinds::Payload), ("link", Kinds::Link), ("drive", Kinds::Drive)];
        let Some(kind) = self.reader.word_at(&table, "kind", &kinds) else { return };
        let parameter = match kind.value {
            Kinds::Payload => {
                self.reader.check_keys(&table, &["kind", "name", "frame"]);
                let name = self.needed(&path, &table, "name", "parameter");
                let frame = self.needed(&path, &table, "frame", "frame");
                name.zip(frame).map(|(name, frame)| Parameter::Payload { name, frame })
            }
            Kinds::Link => {
                self.reader.check_keys(&table, &["kind", "link"]);
                self.needed(&path, &table, "link", "link").map(|link| Parameter::Link { link })
            }
            Kinds::Drive => {
                self.reader.check_keys(&table, &["kind", "name", "drive", "numbers"]);
                self.reader.require(&table, "numbers", "numbers = [\"ratio\", \"rotor_inertia\"]");
                let name = self.at(&path, &table, "name", |reader, table, key| reader.name_at(table, key, "parameter"));
                let drive = self.needed(&path, &table, "drive", "drive");
                let numbers = self.names(&format!("{path}.numbers"), &table, "numbers", "number");
                drive.map(|drive| Parameter::Drive { name, drive, numbers, form: None })
            }
        };
        self.file.scene.parameters.extend(parameter);
    }

    fn numbers(&mut self, table: &TomlTable) {
        self.reader.check_keys(table, &[&options_of("numbers")[..], &["ranges"]].concat());
        self.options(table, "numbers");
        if let Some(ranges) = self.reader.table_at(table, "ranges", "[numbers.ranges]") {
            self.ranges(&ranges);
        }
    }

    fn ranges(&mut self, table: &TomlTable) {
        self.reader.check_keys(table, &["q", "qd", "qdd", "tau", "gravity"]);
        self.note("numbers.ranges", &table.span);
        let [q, qd, qdd, tau] = ["q", "qd", "qdd", "tau"].map(|input| self.joint_ranges(table, input));
        let gravity = self.range(table, "gravity", "numbers.ranges.gravity");
        self.file.scene.ranges = Ranges { q, qd, qdd, tau, gravity };
    }

    /// The range of an input: one for all joints, or a table by joint.
    fn joint_ranges(&mut self, table: &TomlTable, input: &str) -> JointRanges {
        let path = format!("numbers.ranges.{input}");
        let Some((DeValue::Table(_), span)) = table.get(input) else {
            return self.range(table, input, &path).map_or(JointRanges::Limits, JointRanges::All);
        };
        self.note(&path, &span);
        let owner = format!("the ranges of `{input}`");
        let Some(joints) = self.reader.table_at(table, input, &owner) else { return JointRanges::Limits };
        let mut named = Vec::new();
        for (joint, _) in in_order(&joints) {
            if let Some(range) = self.range(&joints, &joint, &format!("{path}.{joint}")) {
                named.push((joint, range));
            }
        }
        JointRanges::Joints(named)
    }

    /// `[lower, upper]`, one number for both sides of zero, or `"unlimited"`.
    fn range(&mut self, table: &TomlTable, key: &str, path: &str) -> Option<InputRange> {
        let (value, span) = table.get(key)?;
        self.note(path, &span);
        match value {
            DeValue::String(_) => {
                self.reader.word_at(table, key, &[("unlimited", InputRange::UNLIMITED)]).map(|word| word.value)
            }
            DeValue::Array(_) => {
                let [lower, upper] =
                    self.reader.reals_at(table, key, "two numbers, least and greatest", Range64::Limit)?;
                Some(InputRange { lower, upper })
            }
            DeValue::Integer(_) | DeValue::Float(_) => {
                self.reader.real_at(table, key, Range64::Limit).map(|bound| InputRange::within(bound.value))
            }
            _ => {
                let forms = "`[-1.0, 2.0]`, `2.0` for both sides of zero, or `\"unlimited\"`";
                self.reader.wrong_type(&table.what(key), forms, value, &span);
                None
            }
        }
    }

    /// A number for all results, an array with one for each, or, where they may be named, a table of such by output.
    fn max_error(&mut self, table: &TomlTable, key: &str, path: &str, named: bool) -> Option<MaxError> {
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
                let parts = in_order(&outputs).into_iter().filter_map(|(output, _)| {
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

    fn budgets(&mut self, table: &TomlTable) {
        let names: Vec<&str> = Function::known().map(Function::name).collect();
        self.reader.check_keys(table, &names);
        let wanted: Option<Vec<Function>> = self.file.settings.value("functions").map(value::OptionValue::choices);
        for function in Function::known() {
            let name = function.name();
            let Some(limits) = self.reader.table_at(table, name, &format!("[budget.{name}]")) else { continue };
            self.reader.check_keys(&limits, BUDGET);
            let path = format!("budget.{name}");
            self.note(&path, &limits.span);
            let mut limit = |key: &str| self.at(&path, &limits, key, FileReader::count_at);
            let budget = Budget {
                max_flops: limit("max_flops"),
                max_sincos: limit("max_sincos"),
                max_live: limit("max_live"),
                max_stack_bytes: limit("max_stack_bytes"),
                max_code_bytes: limit("max_code_bytes"),
                max_instructions: limit("max_instructions"),
                max_flash_bytes: limit("max_flash_bytes"),
                max_error: None,
                mixed_precision: false,
            };
            let max_error = self.max_error(&limits, "max_error", &format!("{path}.max_error"), true);
            let mixed = self.reader.flag_at(&limits, "mixed_precision").filter(|flag| flag.value);
            if let (Some(flag), None) = (&mixed, &max_error) {
                self.reader.diagnostics.push(say::mixed_alone().at(&flag.place));
            }
            mixed.iter().for_each(|flag| self.file.scene.places.note(format!("{path}.mixed_precision"), &flag.place));
            let mixed_precision = mixed.is_some();
            let budget = Budget { max_error, mixed_precision, ..budget };
            self.file.scene.budgets.insert(function, budget);
            if wanted.as_ref().is_some_and(|functions| !functions.contains(&function)) {
                self.reader.complain(&limits.span, say::budget_alone(name));
            }
        }
    }
}
