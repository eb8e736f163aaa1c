//! Every instruction of aarch64, as another program reads its words.

use super::encoding::instructions;
use disarm64::decoder::decode;
use straightline_graph::expr::Binary;
use straightline_jit::allocation::{FusedForm, Instruction, MemoryPlace, ReadFrom};
use straightline_jit::machine::aarch64::function;
use straightline_jit::machine::{Format, HostInstructions, SIGNS};

/// What a word says.
pub fn read(word: u32) -> String {
    let text = decode(word).unwrap_or_else(|| panic!("{word:08x} is no instruction")).to_string();
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect()
}

/// The number of a register of steps: those that belong to who calls come last, and what memory goes by behind them.
fn number(k: u8) -> u8 {
    let of_whoever_is_called = (0..8).chain(16..31);
    of_whoever_is_called.chain(8..16).chain([31]).nth(usize::from(k)).expect("a register")
}

/// What instructions have to say, put together from the manual's names.
struct Names(Format);

impl Names {
    /// The letter of a register as it is loaded.
    fn letter(&self) -> char {
        match (self.0.is_vector, self.0.bytes) {
            (true, _) => 'q',
            (false, 8) => 'd',
            _ => 's',
        }
    }

    fn register(&self, k: u8) -> String {
        match (self.0.is_vector, self.0.bytes) {
            (true, 8) => format!("v{}.2d", number(k)),
            (true, _) => format!("v{}.4s", number(k)),
            _ => format!("{}{}", self.letter(), number(k)),
        }
    }

    fn of(&self, name: &str, registers: &[u8]) -> String {
        let registers: Vec<String> = registers.iter().map(|k| self.register(*k)).collect();
        format!("{name} {}", registers.join(", "))
    }

    fn access(&self, name: &str, k: u8, place: MemoryPlace) -> Vec<String> {
        let (base, at) = match place {
            MemoryPlace::Cell(at) => ("x0", at),
            MemoryPlace::Constant(at) => ("x1", at + SIGNS),
            MemoryPlace::MinusZero => ("x1", 0),
        };
        let length = self.0.lanes() * self.0.bytes;
        let register = format!("{}{}", self.letter(), number(k));
        match at {
            0 => vec![format!("{name} {register}, [{base}]")],
            1..4096 => vec![format!("{name} {register}, [{base}, #{:#x}]", at * length)],
            _ => {
                let high = format!("movk x9, #{:#x}, lsl #0x10", at >> 16);
                let low = format!("movz x9, #{:#x}, lsl #0x0", at & 0xFFFF);
                let access = format!("{name} {register}, [{base}, x9, lsl #{}]", length.ilog2());
                [Some(low), (at > 0xFFFF).then_some(high), Some(access)].into_iter().flatten().collect()
            }
        }
    }

    /// Where an operand is when it was loaded, if it was not there.
    fn source(&self, source: ReadFrom, all: &mut Vec<String>) -> u8 {
        match source {
            ReadFrom::Register(k) => k,
            ReadFrom::Memory(place) => {
                all.extend(self.access("ldr", 31, place));
                31
            }
        }
    }

    fn copy(&self, to: u8, from: u8) -> Option<String> {
        let bytes = || format!("orr v{0}.16b, v{1}.16b, v{1}.16b", number(to), number(from));
        (to != from).then(|| if self.0.is_vector { bytes() } else { self.of("fmov", &[to, from]) })
    }

    fn lines(&self, instruction: Instruction) -> Vec<String> {
        let mut all = Vec::new();
        match instruction {
            Instruction::Load { to, from } => all.extend(self.access("ldr", to, from)),
            Instruction::Store { from, to } => all.extend(self.access("str", from, MemoryPlace::Cell(to))),
            Instruction::Binary { op, to, a, b } => {
                let name = match op {
                    Binary::Add => "fadd",
                    Binary::Sub => "fsub",
                    Binary::Mul => "fmul",
                    Binary::Div => "fdiv",
                };
                let b = self.source(b, &mut all);
                all.push(self.of(name, &[to, a, b]));
            }
            Instruction::Root { to, of } => {
                let of = self.source(of, &mut all);
                all.push(self.of("fsqrt", &[to, of]));
            }
            Instruction::Negation { to, of } => all.push(self.of("fneg", &[to, of])),
            Instruction::Copy { to, from } => all.extend(self.copy(to, from)),
            Instruction::Fused { form, to, a, b, negated, minus } => {
                let b = self.source(b, &mut all);
                match self.0.is_vector {
                    true => self.fused_vectors((form, to), (a, b), [negated, minus], &mut all),
                    false => {
                        let (factor, term) = if form == FusedForm::IntoTerm { (b, to) } else { (to, b) };
                        all.push(self.of(Names::fused(negated, minus), &[to, a, factor, term]));
                    }
                }
            }
        }
        all
    }

    /// In the manual's words the product is that of `n`, and both terms of `nm`, with another sign than their names say: fnmsub is a·b − c.
    fn fused(negated: bool, minus: bool) -> &'static str {
        match (negated, minus) {
            (false, false) => "fmadd",
            (true, false) => "fmsub",
            (true, true) => "fnmadd",
            (false, true) => "fnmsub",
        }
    }

    fn fused_vectors(
        &self,
        (form, to): (FusedForm, u8),
        (a, b): (u8, u8),
        [negated, minus]: [bool; 2],
        all: &mut Vec<String>,
    ) {
        let name = |negated: bool| if negated { "fmls" } else { "fmla" };
        match form {
            FusedForm::IntoTerm if minus => {
                all.push(self.of("fneg", &[to, to]));
                // −to·b = to·(−b)
                let is_changed = (a == to) != (b == to);
                all.push(self.of(name(negated != is_changed), &[to, a, b]));
            }
            FusedForm::IntoTerm => all.push(self.of(name(negated), &[to, a, b])),
            FusedForm::IntoFactor => {
                all.extend(if minus { Some(self.of("fneg", &[31, b])) } else { self.copy(31, b) });
                all.push(self.of(name(negated), &[31, a, to]));
                all.extend(self.copy(to, 31));
            }
        }
    }
}

const FORMATS: [(usize, bool); 4] = [(8, true), (4, true), (8, false), (4, false)];
const SAVED: [&str; 4] =
    ["stp d8, d9, [sp, #-64]!", "stp d10, d11, [sp, #16]", "stp d12, d13, [sp, #32]", "stp d14, d15, [sp, #48]"];
const RESTORED: [&str; 4] =
    ["ldp d10, d11, [sp, #16]", "ldp d12, d13, [sp, #32]", "ldp d14, d15, [sp, #48]", "ldp d8, d9, [sp], #64"];

fn assert_read(instructions: &[Instruction], format: Format, wanted: &[String]) {
    let read: Vec<String> = words(&function(instructions, format)).into_iter().map(read).collect();
    for (read, wanted) in read.iter().zip(wanted) {
        assert_eq!(read, wanted, "{format:?}");
    }
    assert_eq!(read.len(), wanted.len(), "{format:?}");
}

#[test]
fn every_instruction_of_aarch64_is_read_as_what_it_is() {
    let all = instructions(HostInstructions::Neon);
    for (bytes, is_vector) in FORMATS {
        let format = Format { set: HostInstructions::Neon, bytes, is_vector };
        let mut wanted: Vec<String> = SAVED.map(str::to_string).into();
        wanted.extend(all.iter().flat_map(|one| Names(format).lines(*one)));
        wanted.extend(RESTORED.map(str::to_string));
        wanted.push("ret x30".to_string());
        assert_read(&all, format, &wanted);
    }
}

/// Who calls keeps something in the lower halves of v8 to v15 (AAPCS64): a function that writes none of them keeps none.
#[test]
fn registers_that_are_not_written_are_not_saved() {
    let format = Format { set: HostInstructions::Neon, bytes: 8, is_vector: true };
    let load = |to| Instruction::Load { to, from: MemoryPlace::Cell(0) };
    assert_read(&[load(22)], format, &["ldr q30, [x0]", "ret x30"].map(str::to_string));
    let saves = [&SAVED[..], &["ldr q8, [x0]"], &RESTORED[..], &["ret x30"]].concat();
    assert_read(&[load(23)], format, &saves.into_iter().map(str::to_string).collect::<Vec<_>>());
}
