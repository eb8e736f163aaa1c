//! Reads packages in PTX back: the instructions are run over the values of the programs. Blocks of the kernel are known by their source,
//! what stands around the instructions is written here a second time.
//!
//! A register is written once, before it is read, and only within what is declared. Whatever is not understood is refused.

use super::values::{TextFormat, TextValue, Values};
use super::wanted::{of_package, PackageFunction};
use super::ReadingStop;
use crate::emit::gpu::ptx::KERNEL;
use crate::emit::Generated;
use rustc_hash::FxHashMap;
use straightline_graph::expr::{Port, Sines};

type Reading<X> = Result<X, ReadingStop>;

/// Checks the text of a package; `place` is what of it is read.
pub(super) fn read(generated: &Generated, prefix: &str, text: &str, place: &mut String) -> Reading<()> {
    let file = place.clone();
    let mut lines = Lines::new(text)?;
    for expected in [".version 6.0", ".target sm_50", ".address_size 64"] {
        lines.these(expected)?;
    }
    let sections = sections();
    let mut values = Values::default();
    let wanted = of_package(generated, prefix, &mut values);
    for wanted in wanted.iter().filter(|wanted| !wanted.is_private) {
        place.clone_from(&wanted.name);
        values.forget();
        let fused = generated.style.fused && wanted.is_asked_for;
        PtxRun::new(wanted, fused, &sections, &mut values).entry(&mut lines)?;
    }
    *place = file;
    match lines.next() {
        None => Ok(()),
        Some((at, _)) => Err(ReadingStop::at(at, "something that nothing asked for")),
    }
}

/// The lines of a text that are no comments, with their places.
#[derive(Clone)]
struct Lines<'t> {
    all: Vec<(usize, &'t str)>,
    next: usize,
    end: usize,
}

impl<'t> Lines<'t> {
    fn new(text: &'t str) -> Reading<Lines<'t>> {
        let (mut all, mut at) = (Vec::new(), 0);
        for line in text.split_inclusive('\n') {
            let (start, code) = (at, line.trim());
            at += line.len();
            if code.is_empty() || code.starts_with("//") && !code.ends_with('\\') {
                continue;
            }
            if code.contains("/*") || code.contains("//") || code.contains(['\\', '#', '"']) {
                return Err(ReadingStop::at(start, "a line with something in it"));
            }
            all.push((start, code));
        }
        Ok(Lines { all, next: 0, end: text.len() })
    }

    fn next(&mut self) -> Option<(usize, &'t str)> {
        self.next += 1;
        self.all.get(self.next - 1).copied()
    }

    fn line(&mut self) -> Reading<(usize, &'t str)> {
        self.next().ok_or_else(|| ReadingStop::at(self.end, "the text ends here"))
    }

    fn these(&mut self, expected: &str) -> Reading<()> {
        match self.line()? {
            (_, found) if found == expected => Ok(()),
            (at, _) => Err(ReadingStop::at(at, format!("`{expected}` is expected here"))),
        }
    }
}

/// A section of the kernel: its name, and the lines of its block.
type KernelSection = (&'static str, Vec<&'static str>);

fn sections() -> Vec<KernelSection> {
    let of = |section: &'static str| {
        let (name, body) = section.split_once('\n')?;
        Some((name, body.lines().filter(|line| !line.is_empty() && !line.starts_with("//")).collect()))
    };
    KERNEL.split("//== ").skip(1).filter_map(of).collect()
}

/// What a register holds.
#[derive(Clone, Debug)]
enum RegisterContent {
    /// The address of a port, as it is given.
    Given(usize),
    /// The same, among all memory of the device.
    Global(usize),
    /// The address of this component for the state of the thread.
    Component(usize, usize),
    Number(TextValue),
    /// The sum of angles.
    Sum(Vec<TextValue>),
    /// What its rounding lost.
    Tail(Vec<TextValue>),
}

/// A run through an entry.
struct PtxRun<'a, 'g, 't> {
    wanted: &'a PackageFunction<'g>,
    fused: bool,
    sections: &'a [KernelSection],
    values: &'a mut Values,
    ports: Vec<&'g Port>,
    held: FxHashMap<&'t str, RegisterContent>,
    /// How many registers of each kind there are.
    declared: Vec<(&'t str, usize)>,
    /// What was put out.
    results: Vec<Vec<Option<TextValue>>>,
}

impl<'a, 'g, 't> PtxRun<'a, 'g, 't> {
    fn new(
        wanted: &'a PackageFunction<'g>,
        fused: bool,
        sections: &'a [KernelSection],
        values: &'a mut Values,
    ) -> Self {
        let results = wanted.outputs.iter().map(|port| vec![None; port.len()]).collect();
        let ports = wanted.inputs.iter().chain(wanted.outputs).collect();
        let (held, declared) = (FxHashMap::default(), Vec::new());
        PtxRun { wanted, fused, sections, values, ports, held, declared, results }
    }

    fn bytes(&self) -> usize {
        match self.wanted.format {
            TextFormat::F32 => 4,
            _ => 8,
        }
    }

    fn entry(&mut self, lines: &mut Lines<'t>) -> Reading<()> {
        let name = format!("{}_batch_soa", self.wanted.name);
        let start = lines.clone().line()?.0;
        lines.these(&format!(".visible .entry {name}("))?;
        let separator = |k: usize| if k == self.ports.len() { "" } else { "," };
        lines.these(&format!(".param .u32 {name}$$n{}", separator(0)))?;
        for (k, port) in self.ports.iter().enumerate() {
            lines.these(&format!(".param .u64 {name}${}{}", port.name, separator(k + 1)))?;
        }
        lines.these(")")?;
        lines.these("{")?;
        lines.these(".reg .pred %is_beyond;")?;
        lines.these(".reg .b32 %r<5>;")?;
        while let (at, Some(declared)) = {
            let (at, line) = lines.clone().line()?;
            (at, line.strip_prefix(".reg "))
        } {
            lines.line()?;
            self.declaration(declared).ok_or_else(|| ReadingStop::at(at, "registers of another kind"))?;
        }
        for expected in [
            "mov.u32 %r0, %ctaid.x;",
            "mov.u32 %r1, %ntid.x;",
            "mov.u32 %r2, %tid.x;",
            "mad.lo.u32 %r3, %r0, %r1, %r2;",
            &format!("ld.param.u32 %r4, [{name}$$n];"),
            "setp.ge.u32 %is_beyond, %r3, %r4;",
            "@%is_beyond ret;",
            &format!("mul.wide.u32 %a0, %r3, {};", self.bytes()),
        ] {
            lines.these(expected)?;
        }
        loop {
            match lines.line()? {
                (_, "ret;") => break,
                (at, "{") => self.block(at, lines)?,
                (at, line) => {
                    let words = line.strip_suffix(';').and_then(|line| line.split_once(' '));
                    let Some((operation, operands)) = words else {
                        return Err(ReadingStop::at(at, "an instruction is expected here"));
                    };
                    let operands: Vec<&str> = operands.split(", ").collect();
                    self.instruction(operation, &operands).map_err(|what| ReadingStop::at(at, what))?;
                }
            }
        }
        lines.these("}")?;
        self.compare(start)
    }

    /// `.f64 %f64_<12>;`, `.b64 %a<9>;`
    fn declaration(&mut self, text: &'t str) -> Option<()> {
        let (kind, rest) = text.split_once(' ')?;
        let (name, count) = rest.strip_suffix(">;")?.split_once('<')?;
        let expected = match name {
            "%a" => ".b64",
            "%f64_" => ".f64",
            "%f32_" => ".f32",
            _ => return None,
        };
        let is_first = self.declared.iter().all(|(other, _)| *other != name);
        (kind == expected && is_first).then(|| count.parse().ok().map(|count| self.declared.push((name, count))))?
    }

    /// What a register that is declared is written with: this once.
    fn write(&mut self, register: &'t str, held: RegisterContent) -> Result<(), String> {
        let digits = register.len() - register.bytes().rev().take_while(u8::is_ascii_digit).count();
        let (kind, number) = register.split_at(digits);
        let declared = self.declared.iter().find(|(name, _)| *name == kind).map_or(0, |(_, count)| *count);
        // 01 is another register than 1
        let is_plain = number.parse::<usize>().is_ok_and(|k| k < declared && k.to_string() == number);
        let fits = match &held {
            RegisterContent::Given(_) | RegisterContent::Global(_) | RegisterContent::Component(..) => {
                kind == "%a" && number != "0"
            }
            RegisterContent::Number(value) => kind == self.kind(*value),
            RegisterContent::Sum(terms) | RegisterContent::Tail(terms) => kind == self.kind(terms[0]),
        };
        match is_plain && fits && self.held.insert(register, held).is_none() {
            true => Ok(()),
            false => Err("a register that cannot hold this, or holds something already".into()),
        }
    }

    /// What registers of the format of a value are called.
    fn kind(&self, value: TextValue) -> &'static str {
        match self.values.format(value) {
            TextFormat::F32 => "%f32_",
            _ => "%f64_",
        }
    }

    /// A number that stands as an operand of this format.
    fn number(&mut self, operand: &str, format: TextFormat) -> Result<TextValue, String> {
        let value = match operand.get(..2) {
            Some("0d") if operand.len() == 18 => {
                u64::from_str_radix(&operand[2..], 16).ok().map(|bits| (f64::from_bits(bits), TextFormat::F64))
            }
            Some("0f") if operand.len() == 10 => {
                u32::from_str_radix(&operand[2..], 16).ok().map(|bits| (f32::from_bits(bits).into(), TextFormat::F32))
            }
            _ => None,
        };
        let value = match (value, self.held.get(operand)) {
            (Some((x, of)), _) if f64::is_finite(x) => self.values.constant(x, of),
            (None, Some(RegisterContent::Number(value))) => *value,
            _ => return Err(format!("`{operand}` is no number")),
        };
        match self.values.format(value) == format {
            true => Ok(value),
            false => Err(format!("`{operand}` is a number of another format")),
        }
    }

    /// What the text computes, some program computes.
    fn demanded(&self, value: TextValue) -> Result<TextValue, String> {
        match self.values.is_wanted(value) {
            true => Ok(value),
            false => Err("no program computes this".into()),
        }
    }

    fn instruction(&mut self, operation: &str, operands: &[&'t str]) -> Result<(), String> {
        let (name, suffix) = operation.rsplit_once('.').ok_or("an instruction that is not known")?;
        let format = match suffix {
            "f64" => TextFormat::F64,
            "f32" => TextFormat::F32,
            _ => return self.of_addresses(operation, operands),
        };
        let value = match (name, operands) {
            ("ld.global", [_, address]) => self.input(address, format)?,
            ("st.global", [address, value]) => return self.result(address, value, format),
            ("fma.rn", [_, a, b, c]) if self.fused => {
                let [a, b, c] = [self.number(a, format)?, self.number(b, format)?, self.number(c, format)?];
                let product = self.values.mul(a, b);
                let product = self.demanded(product)?;
                self.values.add(product, c)
            }
            ("add.rn" | "sub.rn" | "mul.rn" | "div.rn", [_, a, b]) => {
                let [a, b] = [self.number(a, format)?, self.number(b, format)?];
                match name {
                    "add.rn" => self.values.add(a, b),
                    "sub.rn" => self.values.add(a, b.negated()),
                    "mul.rn" => self.values.mul(a, b),
                    _ => self.values.div(a, b),
                }
            }
            ("sqrt.rn", [_, a]) => {
                let a = self.number(a, format)?;
                self.values.sqrt(a)
            }
            ("neg", [_, a]) => self.number(a, format)?.negated(),
            ("cvt.f64", [_, a]) if format == TextFormat::F32 => {
                let a = self.number(a, format)?;
                self.values.widened(a)
            }
            ("cvt.rn.f32", [_, a]) if format == TextFormat::F64 => {
                let a = self.number(a, format)?;
                self.values.rounded(a)
            }
            _ => return Err("an instruction that is not known".into()),
        };
        let value = self.demanded(value)?;
        self.write(operands[0], RegisterContent::Number(value))
    }

    fn of_addresses(&mut self, operation: &str, operands: &[&'t str]) -> Result<(), String> {
        let held = |register: &str| self.held.get(register).cloned();
        let of = match (operation, operands) {
            ("ld.param.u64", [_, parameter]) => {
                let name = |port: &Port| format!("[{}_batch_soa${}]", self.wanted.name, port.name);
                RegisterContent::Given(
                    self.ports.iter().position(|port| name(port) == *parameter).ok_or("no parameter")?,
                )
            }
            ("cvta.to.global.u64", [_, a]) => match held(a) {
                Some(RegisterContent::Given(port)) => RegisterContent::Global(port),
                _ => return Err("an address as it is given is expected".into()),
            },
            ("add.s64", [_, a, "%a0"]) => match held(a) {
                Some(RegisterContent::Global(port)) if self.ports[port].wrapper.is_none() => {
                    RegisterContent::Component(port, 0)
                }
                _ => return Err("the address of numbers of all states is expected".into()),
            },
            ("mad.wide.u32", [_, "%r4", distance, a]) => match (held(a), distance.parse::<usize>()) {
                (Some(RegisterContent::Component(port, 0)), Ok(distance)) if distance.is_multiple_of(self.bytes()) => {
                    RegisterContent::Component(port, distance / self.bytes())
                }
                _ => return Err("the address of a component is expected".into()),
            },
            _ => return Err("an instruction that is not known".into()),
        };
        self.write(operands[0], of)
    }

    /// The port and component behind an address in brackets.
    fn place(&self, address: &str, format: TextFormat) -> Result<(usize, usize), String> {
        const WRONG: &str = "an address that is not known";
        let inner = address.strip_prefix('[').and_then(|a| a.strip_suffix(']')).ok_or(WRONG)?;
        let (register, offset) = inner.split_once('+').unwrap_or((inner, "0"));
        let offset: usize = offset.parse().map_err(|_| WRONG)?;
        let (port, component) = match self.held.get(register) {
            Some(RegisterContent::Component(port, component)) if offset == 0 => (*port, *component),
            Some(RegisterContent::Global(port))
                if self.ports[*port].wrapper.is_some() && offset.is_multiple_of(self.bytes()) =>
            {
                (*port, offset / self.bytes())
            }
            _ => return Err(WRONG.into()),
        };
        match component < self.ports[port].len() && format == self.wanted.format {
            true => Ok((port, component)),
            false => Err("a number behind the end of its array, or of another format".into()),
        }
    }

    fn input(&mut self, address: &str, format: TextFormat) -> Result<TextValue, String> {
        let (port, component) = self.place(address, format)?;
        if port >= self.wanted.inputs.len() {
            return Err("a result is read".into());
        }
        let before: usize = self.ports[..port].iter().map(|port| port.len()).sum();
        Ok(self.wanted.given[before + component])
    }

    fn result(&mut self, address: &str, value: &str, format: TextFormat) -> Result<(), String> {
        let (port, component) = self.place(address, format)?;
        let value = self.number(value, format)?;
        let port = port.checked_sub(self.wanted.inputs.len()).ok_or("an input is written")?;
        match self.results[port][component].replace(value) {
            None => Ok(()),
            Some(_) => Err("a result is written twice".into()),
        }
    }

    /// A block of the kernel: its registers are its own, its places are bound to operands.
    fn block(&mut self, start: usize, lines: &mut Lines<'t>) -> Reading<()> {
        let first = lines.next - 1;
        let known = self.sections.iter().find_map(|(name, body)| {
            let here = lines.all.get(first..first + body.len())?;
            let mut places = FxHashMap::default();
            here.iter().zip(body).all(|((_, line), wanted)| is_line(line, wanted, &mut places)).then_some((
                *name,
                body.len(),
                places,
            ))
        });
        let Some((name, length, places)) = known else {
            return Err(ReadingStop::at(start, "a block that is not in the kernel"));
        };
        lines.next = first + length;
        self.run_block(name, &places).map_err(|what| ReadingStop::at(start, what))
    }

    fn run_block(&mut self, name: &str, places: &FxHashMap<&'static str, &'t str>) -> Result<(), String> {
        let of = |place: &str| places.get(place).copied().ok_or("a block of another kind");
        let (kind, suffix) = name.rsplit_once('_').expect("a section has its format behind its name");
        let format = if suffix == "f32" { TextFormat::F32 } else { TextFormat::F64 };
        match kind {
            "next_angle" => {
                let mut terms = self.angle(of("before")?, of("lost")?, format)?;
                terms.push(self.number(of("term")?, format)?);
                self.write(of("sum")?, RegisterContent::Sum(terms.clone()))?;
                self.write(of("tail")?, RegisterContent::Tail(terms))
            }
            "sin_cos" | "sin_cos_fused" if (kind == "sin_cos_fused") == self.fused => {
                let terms = self.angle(of("sum")?, of("tail")?, format)?;
                let angle = self.values.angle(terms);
                let (sine, cosine) = self.values.sin_cos(angle, Sines::Precise);
                self.write(of("sine")?, RegisterContent::Number(sine))?;
                self.write(of("cosine")?, RegisterContent::Number(cosine))
            }
            "sign" => {
                let a = self.number(of("a")?, format)?;
                let sign = self.values.sign(a);
                let sign = self.demanded(sign)?;
                self.write(of("result")?, RegisterContent::Number(sign))
            }
            _ => Err("a block of another kind".into()),
        }
    }

    /// The terms of an angle in two numbers.
    fn angle(&mut self, sum: &str, tail: &str, format: TextFormat) -> Result<Vec<TextValue>, String> {
        if let (Some(RegisterContent::Sum(terms)), Some(RegisterContent::Tail(lost))) =
            (self.held.get(sum), self.held.get(tail))
        {
            let is_one = terms == lost && self.values.format(terms[0]) == format;
            return is_one.then(|| terms.clone()).ok_or_else(|| "the two parts of two angles".into());
        }
        let (angle, zero) = (self.number(sum, format)?, self.number(tail, format)?);
        match zero == self.values.constant(0.0, format) {
            true => Ok(vec![angle]),
            false => Err("an angle of another kind".into()),
        }
    }

    /// All results are there, and are those of the program.
    fn compare(&self, start: usize) -> Reading<()> {
        let found = self
            .results
            .iter()
            .zip(self.wanted.outputs)
            .flat_map(|(r, port)| r.iter().enumerate().map(move |x| (x, port)));
        for (((k, found), port), wanted) in found.zip(&self.wanted.results) {
            let what = match found {
                None => "is never put out",
                Some(value) if value != wanted => "is to be another value",
                Some(_) => continue,
            };
            return Err(ReadingStop::at(start, format!("result {k} of `{}` {what}", port.name)));
        }
        Ok(())
    }
}

/// Whether a line is one of the kernel, in which each place is one operand throughout.
fn is_line<'t>(line: &'t str, wanted: &'static str, places: &mut FxHashMap<&'static str, &'t str>) -> bool {
    const BETWEEN: [char; 3] = [' ', ',', ';'];
    let mut expected = wanted.to_string();
    for (here, there) in line.split(BETWEEN).zip(wanted.split(BETWEEN)) {
        if let Some(place) = there.strip_prefix('{').and_then(|name| name.strip_suffix('}')) {
            let operand = *places.entry(place).or_insert(here);
            // registers of a block have no sign before their names
            if !operand.starts_with(['%', '0']) {
                return false;
            }
            expected = expected.replace(there, operand);
        }
    }
    line == expected
}
