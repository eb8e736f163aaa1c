//! What stands around the functions: constants, parameters, stages, modes, batches, and what is pasted.

use super::items::{Items, Sort, TextItem};
use super::run::KnownNames;
use super::tokens::{self as t, TokenKind, Words};
use super::ReadingStop;
use crate::choices::Lanes;
use crate::diagnostic::fnv_1a;
use crate::emit::Generated;
use crate::function::{base_parameter_lists, BaseParameterList, Function};
use crate::identifier::string_literals;
use crate::report::FunctionReport;
use rustc_hash::FxHashMap;
use straightline_core::coupling::Coupling;
use straightline_core::model::Limits;
use straightline_core::Dd;
use straightline_graph::expr::Port;
use straightline_graph::Scalar;

mod blocks;
mod parameters;
mod self_test;

/// The sources of what is pasted.
const TRIG: &str = straightline_core::sources::TRIG;
const SHORT_SINES: &str = straightline_core::sources::SHORT_SINES;
const BATCH: &str = straightline_core::sources::BATCH;

/// Checksums of what is the same in all files, in f64: what changes there has to be looked at, and written here again.
const FIXED: &[(Sort, u32, &[u64])] = &[
    (Sort::Struct, t::COST, &[0x1148_c8bd_9c9e_a6a9]),
    (Sort::Struct, t::FIGURES, &[0xc1da_69d8_b79b_bf5a]),
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

type BlockReading<X> = Result<X, ReadingStop>;

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
    pub fn read(mut self) -> BlockReading<FxHashMap<usize, KnownNames>> {
        self.constants()?;
        self.parameters()?;
        self.batches()?;
        self.stages()?;
        self.modes()?;
        self.self_test()?;
        self.fixed()?;
        self.uses()
    }

    fn scalar(&self) -> Scalar {
        self.generated.scalar
    }

    /// An item that has to be there.
    fn item(&mut self, module: usize, sort: Sort, name: &str) -> BlockReading<&TextItem> {
        let word = self.words.number(name);
        match self.items.find(module, sort, word) {
            Some(item) => Ok(item),
            None => Err(ReadingStop::at(self.items.text.len(), format!("`{name}` is missing"))),
        }
    }

    /// An item is this, word by word.
    fn is(&mut self, module: usize, sort: Sort, name: &str, expected: &str) -> BlockReading<()> {
        let (start, end) = {
            let item = self.item(module, sort, name)?;
            item.claimed.set(true);
            (item.start, item.end)
        };
        self.words_are(start, end, expected)
    }

    fn words_are(&mut self, start: usize, end: usize, expected: &str) -> BlockReading<()> {
        let tokens = t::tokens(expected, self.words).map_err(|(_, what)| ReadingStop::at(0, what))?;
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

    fn module(&mut self, parent: usize, name: &str) -> BlockReading<usize> {
        let word = self.words.number(name);
        self.items
            .inner(parent, word)
            .ok_or_else(|| ReadingStop::at(self.items.text.len(), format!("`{name}` is missing")))
    }

    /// Numbers of the robot, costs of the functions, bounds of their errors.
    fn constants(&mut self) -> BlockReading<()> {
        let generated = self.generated;
        let (model, drives) = (&generated.model, &generated.model.drives);
        let root = self.root;
        let joints = model.joints();
        let names = |names: Vec<&String>| {
            format!("[&str; {}] = [{}]", names.len(), string_literals(names.iter().map(|name| name.as_str())))
        };
        let mut plain = vec![
            ("NQ", format!("usize = {}", model.nq())),
            ("NV", format!("usize = {}", model.nv())),
            ("JOINT_NAMES", names(joints.iter().map(|j| &j.name).collect())),
            ("FRAME_NAMES", names(generated.frames.iter().collect())),
        ];
        if !model.closure.is_empty() {
            plain.push(("DEPENDENT_NAMES", names(model.dependent_joints().map(|joint| &joint.name).collect())));
        }
        let followers = model.followers();
        if !followers.is_empty() {
            let sources: Vec<usize> = followers.iter().map(|(_, c)| model.bodies[c.source].joint.iq).collect();
            plain.push(("FOLLOWER_NAMES", names(followers.iter().map(|(joint, _)| &joint.name).collect())));
            plain.push(("FOLLOWED", format!("[usize; {}] = {sources:?}", sources.len())));
        }
        if !drives.is_empty() {
            let states: Vec<usize> = drives.iter().map(straightline_core::drive::Drive::states).collect();
            plain.push(("NU", format!("usize = {}", drives.len())));
            plain.push(("NX", format!("usize = {}", states.iter().sum::<usize>())));
            plain.push(("DRIVE_NAMES", names(drives.iter().map(|d| &d.name).collect())));
            plain.push(("DRIVE_STATES", format!("[usize; {}] = {states:?}", states.len())));
        }
        let mut plain: Vec<(String, String)> =
            plain.into_iter().map(|(name, value)| (name.to_string(), value)).collect();
        let functions: Vec<Function> = generated.items.iter().map(|item| item.function).collect();
        let lists = base_parameter_lists(model, &functions);
        for list in &lists {
            let own = |name: &str| format!("{}_{name}", list.prefix);
            let of = |k: usize| list.places.iter().map(|place| place[k]).collect::<Vec<usize>>();
            let sizes = |x: Vec<usize>| format!("[usize; {}] = {x:?}", x.len());
            plain.push((own("PARAMETER_COUNT"), format!("usize = {}", list.names.len())));
            plain.push((own("PARAMETER_NAMES"), names(list.names.iter().collect())));
            plain.push((own("REGRESSOR_ROWS"), sizes(of(0))));
            plain.push((own("REGRESSOR_COLUMNS"), sizes(of(1))));
        }
        for (name, value) in plain {
            self.is(root, Sort::Constant, &name, &format!("pub const {name}: {value};"))?;
        }
        let single: Vec<&Limits> = joints.iter().filter(|j| j.kind.is_single()).map(|j| &j.limits).collect();
        let of = |number: fn(&Limits) -> f64| single.iter().map(|l| number(l)).collect::<Vec<f64>>();
        let scalar = self.scalar();
        let lines: [fn(&Coupling<Dd>) -> Dd; 2] = [|c| c.ratio, |c| c.offset];
        for (name, of) in
            ["FOLLOWER_RATIOS", "FOLLOWER_OFFSETS"].into_iter().zip(lines).filter(|_| !followers.is_empty())
        {
            let values: Vec<f64> = followers.iter().map(|(_, c)| of(c).to_f64()).collect();
            self.numbers(name, scalar, &[values.len()], &values, &|found, x| found == scalar.rounded(x))?;
        }
        let limits = [
            ("LOWER_LIMITS", of(|l| l.lower)),
            ("UPPER_LIMITS", of(|l| l.upper)),
            ("VELOCITY_LIMITS", of(|l| l.velocity)),
            ("EFFORT_LIMITS", of(|l| l.effort)),
        ];
        for (name, values) in limits {
            let of_scalar = |x: f64| scalar.rounded(x);
            self.numbers(name, scalar, &[values.len()], &values, &|found, x| found == of_scalar(x))?;
        }
        for BaseParameterList { prefix, values, .. } in &lists {
            let name = format!("{prefix}_PARAMETERS");
            self.numbers(&name, scalar, &[values.len()], values, &|found, x| found == scalar.rounded(x))?;
        }
        generated.report.functions.iter().try_for_each(|(function, figures)| self.figures(function, figures))
    }

    /// What a function takes, where its entries are, and how wrong it may be.
    fn figures(&mut self, function: &str, figures: &FunctionReport) -> BlockReading<()> {
        let root = self.root;
        let name = format!("{}_COST", function.to_uppercase());
        let cost = format!(
            "pub const {name}: Cost = Cost {{ mul: {}, add: {}, fma: {}, div: {}, sin_cos: {}, max_live: {} }};",
            figures.mul, figures.add, figures.fma, figures.div, figures.sincos, figures.max_live
        );
        self.is(root, Sort::Constant, &name, &cost)?;
        if let (Some(machine), true) = (&figures.machine, self.generated.rustc.is_some()) {
            let name = format!("{}_FIGURES", function.to_uppercase());
            let known = |figure: Result<u32, &str>| figure.map_or("None".to_string(), |n| format!("Some({n})"));
            let value = format!(
                "pub const {name}: Figures = Figures {{ instructions: {}, flash_bytes: {}, shared_flash_bytes: {}, stack_bytes: {}, model_cycles: {} }};",
                known(machine.instructions), machine.flash_bytes, machine.shared_flash_bytes, known(machine.stack_bytes), known(machine.model_cycles)
            );
            self.is(root, Sort::Constant, &name, &value)?;
        }
        for of in &figures.entries {
            let name = format!("{}_{}", function.to_uppercase(), of.output.to_uppercase());
            for (what, numbers) in [("ROW_STARTS", &of.row_starts), ("COLUMNS", &of.columns)] {
                let name = format!("{name}_{what}");
                let text = format!("pub const {name}: [usize; {}] = {numbers:?};", numbers.len());
                self.is(root, Sort::Constant, &name, &text)?;
            }
        }
        if let Some(errors) = &figures.errors {
            for output in &errors.outputs {
                let name = errors.constant_name(function, output);
                self.numbers(&name, Scalar::F64, &output.shape, &output.bounds, &is_rounded_up)?;
                if let Some(slopes) = output.slopes.as_ref().filter(|slopes| slopes.refused.is_none()) {
                    let [of_entries, of_norm] = output.lipschitz_names(function);
                    self.numbers(&of_entries, Scalar::F64, &output.shape, &slopes.entries, &is_rounded_up)?;
                    if let Some(norm) = slopes.norm {
                        self.numbers(&of_norm, Scalar::F64, &[], &[norm], &is_rounded_up)?;
                    }
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
    ) -> BlockReading<()> {
        let (start, end) = {
            let item = self.item(self.root, Sort::Constant, name)?;
            item.claimed.set(true);
            (item.start, item.end)
        };
        let items = self.items;
        let equals = (start..end).find(|at| items.kind(*at) == TokenKind::Mark(b'=')).unwrap_or(start);
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

    /// What is the same in all files.
    fn fixed(&mut self) -> BlockReading<()> {
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
        for (name, source) in [(t::TRIG, TRIG), (t::SHORT_SINES, SHORT_SINES), (t::BATCH, BATCH)] {
            let Some(item) = items.find(self.root, Sort::Given, name) else { continue };
            self.pasted(item, source)?;
            item.claimed.set(true);
        }
        Ok(())
    }

    /// Of an item, as if it were in f64.
    fn checksum(&self, item: &TextItem) -> u64 {
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
    fn pasted(&self, item: &TextItem, source: &str) -> BlockReading<()> {
        let items = self.items;
        let open = (item.start..item.end).find(|at| items.kind(*at) == TokenKind::Mark(b'{')).unwrap_or(item.start);
        let (from, to) = (items.tokens[open].end as usize, items.tokens[item.end - 1].start as usize);
        fn lines(text: &str) -> impl Iterator<Item = &str> {
            let is_code = |line: &&str| !line.is_empty() && !line.starts_with("//");
            let same = |line| if matches!(line, "#[inline(always)]" | "#[inline(never)]") { "#[inline]" } else { line };
            text.lines().map(str::trim).filter(is_code).map(same)
        }
        // what fused functions alone need may be left out
        let (always, fused) = source.split_once("// With fused multiply-add:").unwrap_or((source, ""));
        let mut expected = lines(always).chain(lines(fused).skip(usize::from(!fused.is_empty())));
        let mut taken = 0;
        for line in lines(&items.text[from..to]) {
            if expected.next() != Some(line) {
                let at = if line == "#[inline]" { from } else { line.as_ptr() as usize - items.text.as_ptr() as usize };
                return Err(ReadingStop::at(at, "a line of a pasted module is not that of its source"));
            }
            taken += 1;
        }
        match expected.next().is_none() || taken == lines(always).count() {
            true => Ok(()),
            false => items.stop(item.start, "a pasted module ends too early"),
        }
    }

    /// Imports; what they make known.
    fn uses(&mut self) -> BlockReading<FxHashMap<usize, KnownNames>> {
        let items = self.items;
        let root = self.root;
        let has = |name| items.find(root, Sort::Given, name).is_some();
        let (trig, short_sines, fused) = (has(t::TRIG), has(t::SHORT_SINES), has(t::FUSED_MODULE));
        let number = items.find(root, Sort::Function, t::NUMBER).is_some();
        let mut known: FxHashMap<usize, KnownNames> = FxHashMap::default();
        let of_root = KnownNames { trig, short_sines, fused: [fused, false, false], generic: false };
        known.insert(root, of_root);
        let mut globs = Vec::new();
        for item in items.all.iter().filter(|item| item.sort == Sort::Use) {
            let above = |n: usize| (0..n).fold(item.module, |m, _| items.modules[m].parent);
            let text: String = (item.start..item.end).map(|at| items.text_of(at)).collect::<Vec<_>>().join(" ");
            let at_root = item.module == root;
            let is_inner = !at_root && [above(1), above(2)].contains(&root);
            let of_a_mode = is_inner && above(2) == root && above(1) != root;
            let lanes = self.generated.lanes;
            let is_of_batches = |text: &str| match text {
                "use super : : super : : batch ;" => lanes.is_some() && of_a_mode,
                "pub use : : straightline : : batch ;" => lanes == Some(Lanes::Runtime) && at_root,
                _ => false,
            };
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
            } else if text == "use super : : super : : fused : : { self , fma , fma_if , FUSED } ;"
                && fused
                && of_a_mode
            {
                here.fused = [true; 3];
            } else if text == "use super : : super : : { number , Dd , Real } ;" && number && of_a_mode {
                here.generic = true;
            } else if is_of_batches(&text) {
            } else if text == "use super : : * ;" && !items.is_root(item.module) {
                globs.push(item);
                continue;
            } else if !is_inner || !self.is_of_parameters(item) {
                continue;
            }
            item.claimed.set(true);
        }
        // modules of parts come behind what is around them
        for item in globs {
            let around = known.get(&items.modules[item.module].parent).copied().unwrap_or_default();
            known.insert(item.module, around);
            item.claimed.set(true);
        }
        Ok(known)
    }

    /// `use super::{Tool, Workpiece};`, `use super::super::Tool;`
    fn is_of_parameters(&self, item: &TextItem) -> bool {
        let parameters = &self.generated.programs.parameters;
        (item.start + 1..item.end).all(|at| match self.items.kind(at) {
            TokenKind::Mark(mark) => matches!(mark, b':' | b',' | b'{' | b'}' | b';'),
            TokenKind::Word(t::SUPER) => true,
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
    each: &mut dyn FnMut(usize, f64) -> BlockReading<()>,
) -> BlockReading<()> {
    let Some((n, rest)) = shape.split_first() else {
        let start = *at;
        let negative = items.kind(*at) == TokenKind::Mark(b'-');
        *at += usize::from(negative);
        let x = match items.kind(*at) {
            TokenKind::Number => {
                *at += 1;
                let text = items.text_of(*at - 1);
                scalar.read(text).filter(|_| text.contains(['.', 'e']))
            }
            TokenKind::Word(t::F64 | t::F32) if items.text_of(*at) == scalar.name() => {
                *at += 1;
                items.these(at, ": : INFINITY")?;
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
