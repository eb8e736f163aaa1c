//! What stands around the functions: constants, parameters, stages, modes, batches, and what is pasted.

use super::items::{Item, Items, Sort};
use super::run::Known;
use super::tokens::{self as t, Kind, Words};
use super::Stop;
use crate::choices::Lanes;
use crate::description::drives::{Must, Number};
use crate::emit::Generated;
use crate::identifier::string_literals;
use crate::options::stable::fnv_1a;
use crate::program::written::DriveNumbers;
use rustc_hash::FxHashMap;
use straightline_core::model::Limits;
use straightline_core::Dd;
use straightline_graph::expr::Port;
use straightline_graph::Scalar;

/// The sources of what is pasted.
const TRIG: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../runtime/core/src/trig.rs"));
const BATCH: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../runtime/core/src/batch.rs"));

/// Checksums of what is the same in all files, in f64: what changes there has to be looked at, and written here again.
const FIXED: &[(Sort, u32, &[u64])] = &[
    (Sort::Struct, t::COST, &[0x1148_c8bd_9c9e_a6a9]),
    (Sort::Enum, t::UNPHYSICAL, &[0x9c18_e7bc_b078_e440]),
    (Sort::ImplOf, t::UNPHYSICAL, &[0x516a_84d1_a60c_e6cc]),
    (Sort::Function, t::CHECK_INERTIA, &[0x0c81_c665_d150_516d]),
    (Sort::Struct, t::OUT_OF_RANGE, &[0x409f_cec0_afb1_97f5]),
    (Sort::ImplOf, t::OUT_OF_RANGE, &[0xc627_469e_e21a_a86b]),
    (Sort::Function, t::CHECK_NUMBER, &[0x7b12_b587_29f0_268c]),
    // in a file of f64, and of f32
    (Sort::Function, t::NUMBER, &[0xfaad_a6a9_71e5_37b2, 0x6ce6_7a96_9b86_e86e]),
    // by `std` without sines and with them, by the caller
    (
        Sort::Given,
        t::FUSED_MODULE,
        &[0xe0d0_0692_3bd3_0376, 0xa099_d5d1_962f_8eb5, 0x72ed_cfc4_692c_6ea9, 0x323c_9069_a7ae_e566],
    ),
];

type Read<X> = Result<X, Stop>;

/// A text, and what is to stand in it.
pub struct Around<'a, 't, 'g> {
    pub items: &'a Items<'t>,
    pub words: &'a mut Words,
    pub generated: &'g Generated,
    /// The module of this scalar.
    pub root: usize,
}

impl Around<'_, '_, '_> {
    /// Reads all of it: which names each module makes known.
    pub fn read(mut self) -> Read<FxHashMap<usize, Known>> {
        self.constants()?;
        self.parameters()?;
        self.batches()?;
        self.stages()?;
        self.modes()?;
        self.fixed()?;
        self.uses()
    }

    fn scalar(&self) -> Scalar {
        self.generated.scalar
    }

    /// An item that has to be there.
    fn item(&mut self, module: usize, sort: Sort, name: &str) -> Read<&Item> {
        let word = self.words.number(name);
        match self.items.find(module, sort, word) {
            Some(item) => Ok(item),
            None => Err(Stop::at(self.items.text.len(), format!("`{name}` is missing"))),
        }
    }

    /// An item is this, word by word.
    fn is(&mut self, module: usize, sort: Sort, name: &str, expected: &str) -> Read<()> {
        let (start, end) = {
            let item = self.item(module, sort, name)?;
            item.claimed.set(true);
            (item.start, item.end)
        };
        self.words_are(start, end, expected)
    }

    fn words_are(&mut self, start: usize, end: usize, expected: &str) -> Read<()> {
        let tokens = t::tokens(expected, self.words).map_err(|(_, what)| Stop::at(0, what))?;
        let mut at = start;
        for token in &tokens[..tokens.len() - 1] {
            let text = &expected[token.start as usize..token.end as usize];
            if at >= end || self.items.text_of(at) != text {
                return self.items.stop(at.min(end - 1), format!("`{text}` is expected"));
            }
            at += 1;
        }
        match at == end {
            true => Ok(()),
            false => self.items.stop(at, "nothing more is expected"),
        }
    }

    fn module(&mut self, parent: usize, name: &str) -> Read<usize> {
        let word = self.words.number(name);
        self.items.inner(parent, word).ok_or_else(|| Stop::at(self.items.text.len(), format!("`{name}` is missing")))
    }

    /// Numbers of the robot, costs of the functions, bounds of their errors.
    fn constants(&mut self) -> Read<()> {
        let generated = self.generated;
        let (model, drives) = (&generated.model, &generated.model.drives);
        let root = self.root;
        let mut joints: Vec<_> = model.bodies.iter().map(|b| &b.joint).collect();
        joints.sort_by_key(|j| j.iv);
        let names = |names: Vec<&String>| {
            format!("[&str; {}] = [{}]", names.len(), string_literals(names.iter().map(|name| name.as_str())))
        };
        let mut plain = vec![
            ("NQ", format!("usize = {}", model.nq())),
            ("NV", format!("usize = {}", model.nv())),
            ("JOINT_NAMES", names(joints.iter().map(|j| &j.name).collect())),
            ("FRAME_NAMES", names(generated.frames.iter().collect())),
        ];
        if !drives.is_empty() {
            let states: Vec<usize> = drives.iter().map(straightline_core::drive::Drive::states).collect();
            plain.push(("NU", format!("usize = {}", drives.len())));
            plain.push(("NX", format!("usize = {}", states.iter().sum::<usize>())));
            plain.push(("DRIVE_NAMES", names(drives.iter().map(|d| &d.name).collect())));
            plain.push(("DRIVE_STATES", format!("[usize; {}] = {states:?}", states.len())));
        }
        for (name, value) in plain {
            self.is(root, Sort::Constant, name, &format!("pub const {name}: {value};"))?;
        }
        let single: Vec<&Limits> = joints.iter().filter(|j| j.kind.is_single()).map(|j| &j.limits).collect();
        let of = |number: fn(&Limits) -> f64| single.iter().map(|l| number(l)).collect::<Vec<f64>>();
        let limits = [
            ("LOWER_LIMITS", of(|l| l.lower)),
            ("UPPER_LIMITS", of(|l| l.upper)),
            ("VELOCITY_LIMITS", of(|l| l.velocity)),
            ("EFFORT_LIMITS", of(|l| l.effort)),
        ];
        let scalar = self.scalar();
        for (name, values) in limits {
            let of_scalar = |x: f64| scalar.rounded(x);
            self.numbers(name, scalar, &[values.len()], &values, &|found, x| found == of_scalar(x))?;
        }
        for (function, figures) in &generated.report.functions {
            let name = format!("{}_COST", function.to_uppercase());
            let cost = format!(
                "pub const {name}: Cost = Cost {{ mul: {}, add: {}, fma: {}, div: {}, sin_cos: {}, max_live: {} }};",
                figures.mul, figures.add, figures.fma, figures.div, figures.sincos, figures.max_live
            );
            self.is(root, Sort::Constant, &name, &cost)?;
            if let Some(errors) = &figures.errors {
                for output in &errors.outputs {
                    let name = errors.constant_name(function, output);
                    self.numbers(&name, Scalar::F64, &output.shape, &output.bounds, &is_rounded_up)?;
                }
            }
        }
        Ok(())
    }

    /// A constant array of these numbers.
    fn numbers(
        &mut self,
        name: &str,
        scalar: Scalar,
        shape: &[usize],
        values: &[f64],
        agrees: &dyn Fn(f64, f64) -> bool,
    ) -> Read<()> {
        let (start, end) = {
            let item = self.item(self.root, Sort::Constant, name)?;
            item.claimed.set(true);
            (item.start, item.end)
        };
        let items = self.items;
        let equals = (start..end).find(|at| items.kind(*at) == Kind::Mark(b'=')).unwrap_or(start);
        let array = shape.iter().rev().fold(scalar.name().to_string(), |inner, n| format!("[{inner}; {n}]"));
        self.words_are(start, equals, &format!("pub const {name}: {array}"))?;
        let mut at = equals + 1;
        let mut values = values.iter();
        nested(items, &mut at, shape, scalar, &mut |at, found| match values.next() {
            Some(x) if agrees(found, *x) => Ok(()),
            _ => items.stop(at, "another number is expected"),
        })?;
        self.words_are(at, end, ";")
    }

    /// Types of run-time parameters.
    fn parameters(&mut self) -> Read<()> {
        let (root, s) = (self.root, self.scalar().name());
        for parameter in &self.generated.programs.parameters {
            let (name, function) = (&parameter.type_name, &parameter.program.name);
            let n: usize = parameter.program.graph.outputs.iter().map(Port::len).sum();
            self.is(root, Sort::Struct, name, &format!("pub struct {name}([{s}; {n}]);"))?;
            if let Some(numbers) = &parameter.numbers {
                self.drive(name, function, numbers)?;
                continue;
            }
            let text = format!(
                "impl {name} {{
                    pub const NONE: {name} = {name}([0.0; {n}]);
                    pub fn new(mass: {s}, com: [{s}; 3], inertia: [{s}; 6]) -> Result<{name}, Unphysical> {{
                        check_inertia(mass, &com, &inertia)?;
                        let mut parameters = [mass; {n}];
                        {function}(&[mass], &com, &inertia, &mut parameters);
                        Ok({name}(parameters))
                    }}
                }}"
            );
            self.is(root, Sort::Impl, name, &text)?;
        }
        Ok(())
    }

    /// The types around the free numbers of a drive.
    fn drive(&mut self, name: &str, function: &str, numbers: &DriveNumbers) -> Read<()> {
        let (root, s, n) = (self.root, self.scalar().name(), numbers.nominal.len());
        let (all, of_numbers) = (&numbers.numbers, format!("{name}Numbers"));
        let first = &all[0].name;
        let written = |x: Dd| self.scalar().literal(self.scalar().nearest(x));
        let each = |text: &dyn Fn(&Number) -> String| all.iter().map(text).collect::<Vec<_>>();
        let fields: String = each(&|x| format!("pub {}: {s},", x.name)).concat();
        let values = each(&|x| format!("{}: {}", x.name, written(Dd::from(x.value)))).join(", ");
        let given = each(&|x| format!("numbers.{}", x.name)).join(", ");
        let nominal = numbers.nominal.iter().map(|x| written(*x)).collect::<Vec<_>>().join(", ");
        let checks: String = each(&|x| {
            let (name, must) = (&x.name, x.quantity.at_run_time);
            let of = format!("numbers.{name}");
            let (condition, be) = match must {
                Must::BePositive => (format!("{of} > 0.0"), "positive"),
                Must::NotBeNegative => (format!("{of} >= 0.0"), "zero or positive"),
                Must::NotBeZero => (format!("{of} != 0.0"), "not zero"),
                Must::BeAnEfficiency => (format!("{of} > 0.0 && {of} <= 1.0"), "above 0 and at most 1"),
            };
            format!("check_number(\"{name}\", {of}, {condition}, \"{be}\")?;")
        })
        .concat();
        let default =
            |name: &str| format!("impl Default for {name} {{ fn default() -> {name} {{ {name}::NOMINAL }} }}");
        let types = [
            (Sort::Struct, &of_numbers[..], format!("pub struct {of_numbers} {{ {fields} }}")),
            (
                Sort::Impl,
                &of_numbers,
                format!("impl {of_numbers} {{ pub const NOMINAL: {of_numbers} = {of_numbers} {{ {values} }}; }}"),
            ),
            (Sort::ImplOf, &of_numbers, default(&of_numbers)),
            (
                Sort::Impl,
                name,
                format!(
                    "impl {name} {{
                        pub const NOMINAL: {name} = {name}([{nominal}]);
                        pub fn new(numbers: {of_numbers}) -> Result<{name}, OutOfRange> {{
                            {checks}
                            let mut parameters = [numbers.{first}; {n}];
                            {function}(&[{given}], &mut parameters);
                            check_number(\"numbers\", 0.0, parameters.iter().all(|x| x.is_finite()),
                                \"of such sizes that what follows from them is finite\")?;
                            Ok({name}(parameters))
                        }}
                    }}"
                ),
            ),
            (Sort::ImplOf, name, default(name)),
        ];
        for (sort, name, text) in types {
            self.is(root, sort, name, &text)?;
        }
        Ok(())
    }

    /// What runs functions over lanes on slices.
    fn batches(&mut self) -> Read<()> {
        let Some(drivers) = self.generated.lanes else { return Ok(()) };
        let (root, s) = (self.root, self.scalar().name());
        let fused = self.generated.style.fused;
        for program in self.generated.programs.functions.iter().filter(|p| p.lanes) {
            let name = &program.name;
            let (inputs, outputs) = (&program.graph.inputs, &program.graph.outputs);
            let of_states: Vec<&Port> = inputs.iter().filter(|p| p.wrapper.is_none()).collect();
            let shared: Vec<(&str, &str)> =
                inputs.iter().filter_map(|p| Some((p.name.as_str(), p.wrapper.as_deref()?))).collect();
            let type_name: String = name
                .split('_')
                .map(|word| {
                    word.chars().take(1).map(|c| c.to_ascii_uppercase()).chain(word.chars().skip(1)).collect::<String>()
                })
                .chain(["Program".to_string()])
                .collect();
            let fields: String = shared.iter().map(|(name, of)| format!("{name}: &'a {of},")).collect();
            let (declared, any) = match shared.is_empty() {
                true => (format!("struct {type_name};"), ""),
                false => (format!("struct {type_name}<'a> {{ {fields} }}"), "<'_>"),
            };
            self.is(root, Sort::Struct, &type_name, &declared)?;
            let arguments: String = inputs
                .iter()
                .map(|p| if p.wrapper.is_some() { format!("self.{},", p.name) } else { taken(p, "", "x") + "," })
                .chain(outputs.iter().map(|p| taken(p, "_mut", "y") + ","))
                .collect();
            let count = |ports: &mut dyn Iterator<Item = &Port>| ports.map(Port::len).sum::<usize>();
            let (n, m) = (count(&mut of_states.iter().copied()), count(&mut outputs.iter()));
            let body = if fused { format!("{name}_in_lanes::<N, FUSED>") } else { format!("{name}_lanes") };
            let text = format!(
                "impl batch::Program<{s}, {n}, {m}> for {type_name}{any} {{
                    #[inline(always)]
                    fn run<const N: usize, const FUSED: bool>(&self, x: &[[{s}; N]; {n}], y: &mut [[{s}; N]; {m}]) {{
                        let (mut x, mut y) = (x.as_slice(), y.as_mut_slice());
                        {body}({arguments});
                    }}
                }}"
            );
            self.is(root, Sort::ImplOf, &type_name, &text)?;
            let parameters: String = inputs
                .iter()
                .map(|p| format!(", {}: &{}", p.name, p.wrapper.clone().unwrap_or(format!("[{s}]"))))
                .chain(outputs.iter().map(|p| format!(", {}: &mut [{s}]", p.name)))
                .collect();
            let checks: String = of_states
                .iter()
                .copied()
                .chain(outputs)
                .map(|p| format!("batch::check(\"{0}\", {0}, n, {1})?;", p.name, p.len()))
                .collect();
            let made = match shared.is_empty() {
                true => type_name.clone(),
                false => {
                    format!("{type_name} {{ {} }}", shared.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", "))
                }
            };
            for (layout, suffix) in [("soa", ""), ("aos", ""), ("soa", "_parallel"), ("aos", "_parallel")] {
                if !suffix.is_empty() && drivers == Lanes::Standalone {
                    continue;
                }
                let slices = |ports: &[&Port]| {
                    let of = |p: &&Port| match layout {
                        "soa" => p.name.clone(),
                        _ => format!("({}, {})", p.name, p.len()),
                    };
                    ports.iter().map(of).collect::<Vec<_>>().join(", ")
                };
                let (x, y) = (slices(&of_states), slices(&outputs.iter().collect::<Vec<_>>()));
                let function = format!("{name}_batch_{layout}{suffix}");
                let text = format!(
                    "pub fn {function}(n: usize{parameters}) -> Result<(), batch::WrongLength> {{
                        {checks}
                        batch::run{suffix}_{s}(batch::{layout}(&{made}, n, [{x}], [{y}]));
                        Ok(())
                    }}"
                );
                self.is(root, Sort::Function, &function, &text)?;
                let item = self.item(root, Sort::Function, &function)?;
                if item.threads == suffix.is_empty() {
                    return Err(Stop::at(self.items.text.len(), format!("`{function}` stands where it should not")));
                }
            }
        }
        Ok(())
    }

    /// Types of stages around their values, and the methods that they serve.
    fn stages(&mut self) -> Read<()> {
        let Some(staged) = &self.generated.programs.staged else { return Ok(()) };
        let (root, s) = (self.root, self.scalar().name());
        let module = self.module(root, "staged")?;
        let stages = &staged.stages;
        let is_stored = |p: &Port| stages.iter().any(|e| e.values == p.name);
        let array = |p: &Port| p.wrapper.clone().unwrap_or_else(|| shaped(p, s));
        let listed = |ports: &mut dyn Iterator<Item = &Port>, reference: &str| -> Vec<String> {
            ports.map(|p| format!("{}: {reference}{}", p.name, array(p))).collect()
        };
        for (k, stage) in stages.iter().enumerate() {
            let (name, graph) = (&stage.type_name, &stage.program.graph);
            let n: usize = graph.outputs.iter().map(Port::len).sum();
            // from a value of stage `last`, what an earlier stage stored
            let stored = |receiver: &str, last: usize, p: &Port| match stages.iter().position(|e| e.values == p.name) {
                Some(of) if of <= last => {
                    let path: String = (of..last).rev().map(|e| format!(".{}", stages[e].values)).collect();
                    format!("&{receiver}{path}.values")
                }
                _ => p.name.clone(),
            };
            let life = |k: usize| if k > 0 { "<'a>" } else { "" };
            let earlier = k.checked_sub(1).map(|e| (&stages[e], life(e)));
            let field = earlier.map_or(String::new(), |(e, life)| format!("{}: &'a {}{life},", e.values, e.type_name));
            let text = format!("pub struct {name}{0} {{ {field} values: [{s}; {n}], }}", life(k));
            self.is(module, Sort::Struct, name, &text)?;
            let own = listed(&mut graph.inputs.iter().filter(|p| !is_stored(p)), "&");
            let filler = first_of(graph.inputs.iter().filter(|p| !is_stored(p)));
            let before = earlier.map(|(e, life)| format!("{}: &'a {}{life}", e.values, e.type_name));
            let parameters: Vec<String> = before.into_iter().chain(own).collect();
            let receiver = earlier.map_or("", |(e, _)| &e.values);
            let arguments: String =
                graph.inputs.iter().map(|p| stored(receiver, k.saturating_sub(1), p) + ", ").collect();
            let mut text = format!(
                "impl{0} {name}{0} {{
                    #[must_use]
                    pub fn new({1}) -> {name}{0} {{
                        let mut values = [{filler}; {n}];
                        {2}({arguments}&mut values);
                        {name} {{ {3} values }}
                    }}",
                life(k),
                parameters.join(", "),
                stage.program.name,
                earlier.map_or(String::new(), |(e, _)| format!("{},", e.values)),
            );
            for (_, program) in staged.functions.iter().filter(|(of, _)| *of == k) {
                let graph = &program.graph;
                let own = listed(&mut graph.inputs.iter().filter(|p| !is_stored(p)), "&");
                let results = listed(&mut graph.outputs.iter(), "&mut ");
                let parameters: String = own.into_iter().chain(results).map(|p| format!(", {p}")).collect();
                let arguments: Vec<String> = graph
                    .inputs
                    .iter()
                    .map(|p| stored("self", k, p))
                    .chain(graph.outputs.iter().map(|p| p.name.clone()))
                    .collect();
                text.push_str(&format!(
                    "pub fn {0}(&self{parameters}) {{ {0}({1}); }}",
                    program.name,
                    arguments.join(", ")
                ));
            }
            self.is(module, Sort::Impl, name, &(text + "}"))?;
        }
        Ok(())
    }

    /// The modes of contact, and what calls one of them.
    fn modes(&mut self) -> Read<()> {
        let modes = &self.generated.programs.modes;
        if modes.is_empty() {
            return Ok(());
        }
        let (root, s) = (self.root, self.scalar().name());
        let contact = self.module(root, "contact")?;
        for mode in modes {
            let module = self.module(contact, &mode.identifier)?;
            for (name, names) in ["CONSTRAINED", "FREE"].iter().zip(&mode.coordinates) {
                let quoted = string_literals(names.iter().map(String::as_str));
                let text = format!("pub const {name}: [&str; {}] = [{quoted}];", names.len());
                self.is(module, Sort::Constant, name, &text)?;
            }
        }
        // variants stand in the order of the modes
        let variants: Vec<String> = {
            let item = self.item(contact, Sort::Enum, "Mode")?;
            (item.start + 4..item.end - 1).step_by(2).map(|at| self.items.text_of(at).to_string()).collect()
        };
        self.is(contact, Sort::Enum, "Mode", &format!("pub enum Mode {{ {}, }}", variants.join(", ")))?;
        let distinct = variants.iter().enumerate().all(|(k, v)| !variants[..k].contains(v));
        if variants.len() != modes.len() || !distinct {
            return Err(Stop::at(self.items.text.len(), "as many modes as the scene has are expected"));
        }
        let word = self.words.number("forward_dynamics");
        if self.items.find(contact, Sort::Function, word).is_none() {
            return Ok(());
        }
        let forward = |k: usize| modes[k].functions.iter().find(|p| p.name == "forward_dynamics");
        let programs: Option<Vec<_>> = (0..modes.len()).map(forward).collect();
        let Some(programs) = programs else {
            return Err(Stop::at(self.items.text.len(), "forward dynamics of a mode is missing"));
        };
        let most = modes.iter().map(|m| m.coordinates[0].len()).max().unwrap_or(0);
        self.is(contact, Sort::Constant, "MOST_CONSTRAINED", &format!("pub const MOST_CONSTRAINED: usize = {most};"))?;
        let inputs = &programs[0].graph.inputs;
        let parameters: String = inputs
            .iter()
            .map(|p| match &p.wrapper {
                Some(wrapper) => format!("{}: &super::{wrapper}, ", p.name),
                None => format!("{}: &{}, ", p.name, shaped(p, s)),
            })
            .collect();
        let filler = first_of(inputs.iter().filter(|p| p.wrapper.is_none()));
        let arms: String = variants
            .iter()
            .zip(modes)
            .zip(&programs)
            .map(|((variant, mode), program)| {
                let m = mode.coordinates[0].len();
                let forces = (0..most).map(|i| if i < m { format!("f[{i}]") } else { "0.0".to_string() });
                let arguments: Vec<&str> = program
                    .graph
                    .inputs
                    .iter()
                    .map(|p| p.name.as_str())
                    .chain(program.graph.outputs.iter().map(|p| match p.name.as_str() {
                        "force" => "&mut f",
                        "sdd" => "&mut sdd",
                        "violation" => "&mut violation",
                        "pivot" => "&mut pivot",
                        own => own,
                    }))
                    .collect();
                format!(
                    "Mode::{variant} => {{
                        let (mut f, mut sdd, mut violation) = ([{filler}; {m}], [{filler}; {m}], [{filler}; {m}]);
                        {}::forward_dynamics({});
                        *force = [{}];
                    }}",
                    mode.identifier,
                    arguments.join(", "),
                    forces.collect::<Vec<_>>().join(", ")
                )
            })
            .collect();
        let nv = self.generated.model.nv();
        let text = format!(
            "pub fn forward_dynamics(mode: Mode, {parameters}qdd: &mut [{s}; {nv}], force: &mut [{s}; {most}]) -> {s} {{
                let mut pivot = [0.0];
                match mode {{ {arms} }}
                pivot[0]
            }}"
        );
        self.is(contact, Sort::Function, "forward_dynamics", &text)
    }

    /// What is the same in all files.
    fn fixed(&mut self) -> Read<()> {
        let items = self.items;
        for (sort, name, sums) in FIXED {
            let Some(item) = items.find(self.root, *sort, *name) else { continue };
            let found = self.checksum(item);
            if !sums.contains(&found) {
                let what = format!("what is the same in all files is not (checksum {found:#018x})");
                return items.stop(item.start, what);
            }
            item.claimed.set(true);
        }
        for (name, source) in [(t::TRIG, TRIG), (t::BATCH, BATCH)] {
            let Some(item) = items.find(self.root, Sort::Given, name) else { continue };
            self.pasted(item, source)?;
            item.claimed.set(true);
        }
        Ok(())
    }

    /// Of an item, as if it were in f64.
    fn checksum(&self, item: &Item) -> u64 {
        let other = match self.scalar() {
            Scalar::F64 => "f32",
            Scalar::F32 => "f64",
        };
        fnv_1a((item.start..item.end).flat_map(|at| {
            let text = self.items.text_of(at);
            // a scalar that the file has not is no other's
            let text = if text.contains(other) { "?".to_string() } else { text.replace("f32", "f64") };
            text.into_bytes().into_iter().chain([0])
        }))
    }

    /// A module is its source, but for comments and how strongly it is inlined, or the source up to some item.
    fn pasted(&self, item: &Item, source: &str) -> Read<()> {
        let items = self.items;
        let open = (item.start..item.end).find(|at| items.kind(*at) == Kind::Mark(b'{')).unwrap_or(item.start);
        let (from, to) = (items.tokens[open].end as usize, items.tokens[item.end - 1].start as usize);
        fn lines(text: &str) -> impl Iterator<Item = &str> {
            let is_code = |line: &&str| !line.is_empty() && !line.starts_with("//");
            let same = |line| if line == "#[inline(always)]" { "#[inline]" } else { line };
            text.lines().map(str::trim).filter(is_code).map(same)
        }
        // what fused functions alone need may be left out
        let (always, fused) = source.split_once("// With fused multiply-add:").unwrap_or((source, ""));
        let mut expected = lines(always).chain(lines(fused).skip(usize::from(!fused.is_empty())));
        let mut taken = 0;
        for line in lines(&items.text[from..to]) {
            if expected.next() != Some(line) {
                let at = if line == "#[inline]" { from } else { line.as_ptr() as usize - items.text.as_ptr() as usize };
                return Err(Stop::at(at, "a line of a pasted module is not that of its source"));
            }
            taken += 1;
        }
        match expected.next().is_none() || taken == lines(always).count() {
            true => Ok(()),
            false => items.stop(item.start, "a pasted module ends too early"),
        }
    }

    /// Imports; what they make known.
    fn uses(&mut self) -> Read<FxHashMap<usize, Known>> {
        let items = self.items;
        let root = self.root;
        let has = |name| items.find(root, Sort::Given, name).is_some();
        let (trig, fused) = (has(t::TRIG), has(t::FUSED_MODULE));
        let number = items.find(root, Sort::Function, t::NUMBER).is_some();
        let mut known: FxHashMap<usize, Known> = FxHashMap::default();
        let of_root = Known { trig, fused: [fused, false, false], generic: false };
        known.insert(root, of_root);
        for item in items.all.iter().filter(|item| item.sort == Sort::Use) {
            let above = |n: usize| (0..n).fold(item.module, |m, _| items.modules[m].parent);
            let text: String = (item.start..item.end).map(|at| items.text_of(at)).collect::<Vec<_>>().join(" ");
            let at_root = item.module == root;
            let is_inner = !at_root && [above(1), above(2)].contains(&root);
            let (depth, trig_path) = match text.as_str() {
                "use super : : trig ;" => (1, true),
                "use super : : super : : trig ;" => (2, true),
                _ => (0, false),
            };
            let here = known.entry(item.module).or_default();
            if trig_path && above(depth) == root && trig && !at_root {
                here.trig = true;
            } else if at_root && text == "use : : straightline : : { Dd , Real } ;" && number {
                here.generic = true;
            } else if at_root && text == "use fused : : { fma , fma_if , FUSED } ;" && fused {
                here.fused = [true; 3];
            } else if text == "use super : : fused : : { self , fma } ;" && fused && above(1) == root && !at_root {
                here.fused = [true, true, false];
            } else if at_root
                && text == "pub use : : straightline : : batch ;"
                && self.generated.lanes == Some(Lanes::Runtime)
            {
            } else if !is_inner || !self.is_of_parameters(item) {
                continue;
            }
            item.claimed.set(true);
        }
        Ok(known)
    }

    /// `use super::{Tool, Workpiece};`, `use super::super::Tool;`
    fn is_of_parameters(&self, item: &Item) -> bool {
        let parameters = &self.generated.programs.parameters;
        (item.start + 1..item.end).all(|at| match self.items.kind(at) {
            Kind::Mark(mark) => matches!(mark, b':' | b',' | b'{' | b'}' | b';'),
            Kind::Word(t::SUPER) => true,
            _ => parameters.iter().any(|p| p.type_name == self.items.text_of(at)),
        })
    }
}

/// Takes numbers in nested brackets.
fn nested(
    items: &Items,
    at: &mut usize,
    shape: &[usize],
    scalar: Scalar,
    each: &mut dyn FnMut(usize, f64) -> Read<()>,
) -> Read<()> {
    let Some((n, rest)) = shape.split_first() else {
        let start = *at;
        let negative = items.kind(*at) == Kind::Mark(b'-');
        *at += usize::from(negative);
        let x = match items.kind(*at) {
            Kind::Number => {
                *at += 1;
                let text = items.text_of(*at - 1);
                scalar.read(text).filter(|_| text.contains(['.', 'e']))
            }
            Kind::Word(t::F64 | t::F32) if items.text_of(*at) == scalar.name() => {
                *at += 1;
                items.mark(at, b':')?;
                items.mark(at, b':')?;
                items.keyword(at, t::INFINITY)?;
                Some(f64::INFINITY)
            }
            _ => None,
        };
        return match x {
            Some(x) => each(start, if negative { -x } else { x }),
            None => items.stop(start, "a number is expected here"),
        };
    };
    items.mark(at, b'[')?;
    for k in 0..*n {
        if k > 0 {
            items.mark(at, b',')?;
        }
        nested(items, at, rest, scalar, each)?;
    }
    items.mark(at, b']')
}

/// Whether `found` is the least number of four digits that is not below `bound`, or `bound` itself.
fn is_rounded_up(found: f64, bound: f64) -> bool {
    let text = format!("{found:.3e}");
    let before = text.split_once('e').and_then(|(digits, exponent)| {
        let (digits, exponent) = (digits.replace('.', "").parse::<i64>().ok()?, exponent.parse::<i64>().ok()?);
        // below 1000 stands 9999 of the next smaller decade
        let (digits, exponent) = if digits == 1000 { (9999, exponent - 4) } else { (digits - 1, exponent - 3) };
        format!("{digits}e{exponent}").parse::<f64>().ok()
    });
    found == bound || found > bound && text.parse() == Ok(found) && before.is_some_and(|before| before < bound)
}

/// The first number of what is given, which arrays begin with.
fn first_of<'a>(mut given: impl Iterator<Item = &'a Port>) -> String {
    given.find(|p| !p.is_empty()).map_or("0.0".to_string(), |p| straightline_graph::element(p, 0))
}

/// `[[f64; 7]; 6]`
fn shaped(port: &Port, scalar: &str) -> String {
    port.shape.iter().rev().fold(scalar.to_string(), |inner, n| format!("[{inner}; {n}]"))
}

/// What takes a port off flat components: extents are cut off from the innermost one.
fn taken(port: &Port, suffix: &str, from: &str) -> String {
    let rows = |text: String, k: usize| {
        let (outer, inner): (usize, usize) = (port.shape[..k].iter().product(), port.shape[k]);
        format!("batch::rows{suffix}::<_, {}, {outer}, {inner}>({text})", outer * inner)
    };
    (1..port.shape.len()).rev().fold(format!("batch::take{suffix}(&mut {from})"), rows)
}
