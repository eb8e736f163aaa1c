//! Every instruction of x86-64, as another program reads its bytes.

use iced_x86::{Decoder, DecoderOptions, Formatter, Instruction as Decoded, IntelFormatter, MemorySizeOptions};
use straightline_graph::expr::Binary;
use straightline_jit::allocation::{FusedForm, Instruction, MemoryPlace, ReadFrom};
use straightline_jit::machine::x86::function;
use straightline_jit::machine::{Format, HostInstructions, SIGNS};

const SETS: [HostInstructions; 3] = [HostInstructions::Sse2, HostInstructions::Avx, HostInstructions::Avx512];
const FORMATS: [(usize, bool, &str); 4] = [(8, true, "pd"), (4, true, "ps"), (8, false, "sd"), (4, false, "ss")];

/// What a function says, an instruction per line.
fn read(bytes: &[u8]) -> Vec<String> {
    let mut decoder = Decoder::with_ip(64, bytes, 0, DecoderOptions::NONE);
    let mut formatter = IntelFormatter::new();
    let options = formatter.options_mut();
    options.set_space_after_operand_separator(true);
    options.set_hex_prefix("0x");
    options.set_hex_suffix("");
    options.set_small_hex_numbers_in_decimal(false);
    options.set_memory_size_options(MemorySizeOptions::Never);
    let (mut all, mut decoded) = (Vec::new(), Decoded::default());
    while decoder.can_decode() {
        decoder.decode_out(&mut decoded);
        assert!(!decoded.is_invalid(), "no instruction at {}", decoded.ip());
        let mut line = String::new();
        formatter.format(&decoded, &mut line);
        all.push(line);
    }
    all
}

/// What an instruction has to say, put together from the manual's names.
struct Names {
    format: Format,
    suffix: &'static str,
}

impl Names {
    fn register(&self, k: u8) -> String {
        let width = match (self.format.is_vector, self.format.set) {
            (false, _) | (_, HostInstructions::Sse2) => "x",
            (_, HostInstructions::Avx) => "y",
            _ => "z",
        };
        format!("{width}mm{k}")
    }

    fn memory(&self, place: MemoryPlace) -> String {
        let step = self.format.lanes() * self.format.bytes;
        let (base, at) = match place {
            MemoryPlace::Cell(at) => ("rdi", at * step),
            MemoryPlace::Constant(at) => ("rsi", (at + SIGNS) * step),
            MemoryPlace::MinusZero => ("rsi", 0),
        };
        match at {
            0 => format!("[{base}]"),
            at => format!("[{base}+0x{at:X}]"),
        }
    }

    fn source(&self, b: ReadFrom) -> String {
        match b {
            ReadFrom::Register(k) => self.register(k),
            ReadFrom::Memory(place) => self.memory(place),
        }
    }

    fn name(op: Binary) -> &'static str {
        match op {
            Binary::Add => "add",
            Binary::Sub => "sub",
            Binary::Mul => "mul",
            Binary::Div => "div",
        }
    }

    /// One where the result has a register of its own.
    fn of_three(&self, instruction: Instruction) -> String {
        let Format { set, bytes, is_vector } = self.format;
        let suffix = self.suffix;
        let moves = if is_vector { "vmovu" } else { "vmov" };
        match instruction {
            Instruction::Load { to, from } => format!("{moves}{suffix} {}, {}", self.register(to), self.memory(from)),
            Instruction::Store { from, to } => {
                format!("{moves}{suffix} {}, {}", self.memory(MemoryPlace::Cell(to)), self.register(from))
            }
            Instruction::Binary { op, to, a, b } => {
                let [to, a] = [to, a].map(|k| self.register(k));
                format!("v{}{suffix} {to}, {a}, {}", Names::name(op), self.source(b))
            }
            Instruction::Root { to, of } if is_vector => {
                format!("vsqrt{suffix} {}, {}", self.register(to), self.source(of))
            }
            Instruction::Root { to, of } => format!("vsqrt{suffix} {0}, {0}, {1}", self.register(to), self.source(of)),
            Instruction::Copy { to, from } => format!("vmovaps {}, {}", self.register(to), self.register(from)),
            Instruction::Fused { form, to, a, b, negated, minus } => self.fused((form, to), (a, b), [negated, minus]),
            Instruction::Negation { to, of } => {
                let name = match (set, bytes) {
                    (HostInstructions::Avx512, 8) => "vpxorq",
                    (HostInstructions::Avx512, _) => "vpxord",
                    (_, 8) => "vxorpd",
                    _ => "vxorps",
                };
                format!("{name} {}, {}, {}", self.register(to), self.register(of), self.memory(MemoryPlace::MinusZero))
            }
        }
    }

    /// A product and a sum: the digits say in which order the three operands come, as the first, second and third of them.
    fn fused(&self, (form, to): (FusedForm, u8), (a, b): (u8, ReadFrom), [negated, minus]: [bool; 2]) -> String {
        let name = match (negated, minus) {
            (false, false) => "vfmadd",
            (false, true) => "vfmsub",
            (true, false) => "vfnmadd",
            (true, true) => "vfnmsub",
        };
        let order = if form == FusedForm::IntoTerm { "231" } else { "213" };
        let [to, a] = [to, a].map(|k| self.register(k));
        format!("{name}{order}{} {to}, {a}, {}", self.suffix, self.source(b))
    }

    /// One where the result takes the register of the first operand: it may take a copy before, by way of register 15.
    fn of_two(&self, instruction: Instruction) -> Vec<String> {
        let suffix = self.suffix;
        let whole = if self.format.bytes == 8 { "pd" } else { "ps" };
        let moves = if self.format.is_vector { "movu" } else { "mov" };
        let load = |to: u8, from: MemoryPlace, suffix: &str| {
            format!("{moves}{suffix} {}, {}", self.register(to), self.memory(from))
        };
        let copy =
            |to: u8, from: u8| (to != from).then(|| format!("movaps {}, {}", self.register(to), self.register(from)));
        let mut all = Vec::new();
        // vectors in memory are loaded first
        let read = |source: ReadFrom, all: &mut Vec<String>| match source {
            ReadFrom::Memory(place) if self.format.is_vector => {
                all.push(load(15, place, suffix));
                self.register(15)
            }
            other => self.source(other),
        };
        match instruction {
            Instruction::Load { to, from } => all.push(load(to, from, suffix)),
            Instruction::Store { from, to } => {
                all.push(format!("{moves}{suffix} {}, {}", self.memory(MemoryPlace::Cell(to)), self.register(from)));
            }
            Instruction::Binary { op, to, a, b } => {
                let b = match b {
                    ReadFrom::Register(b) if b == to && a != to => {
                        all.extend(copy(15, b));
                        self.register(15)
                    }
                    other => read(other, &mut all),
                };
                all.extend(copy(to, a));
                all.push(format!("{}{suffix} {}, {b}", Names::name(op), self.register(to)));
            }
            Instruction::Root { to, of } => {
                let of = read(of, &mut all);
                all.push(format!("sqrt{suffix} {}, {of}", self.register(to)));
            }
            Instruction::Copy { to, from } => all.extend(copy(to, from)),
            Instruction::Fused { .. } => unreachable!("it is not asked for"),
            Instruction::Negation { to, of } => {
                all.push(format!("movu{whole} {}, {}", self.register(15), self.memory(MemoryPlace::MinusZero)));
                all.extend(copy(to, of));
                all.push(format!("xor{whole} {}, {}", self.register(to), self.register(15)));
            }
        }
        all
    }
}

fn places() -> Vec<MemoryPlace> {
    let cells = [0, 1, 3, 4, 15, 16, 31, 32, 1000, 4095, 4096, 65_535, 65_536, 100_000].map(MemoryPlace::Cell);
    let constants = [0, 1, 27, 28, 4091, 4092, 5000].map(MemoryPlace::Constant);
    cells.into_iter().chain(constants).chain([MemoryPlace::MinusZero]).collect()
}

/// All registers everywhere, and places near and far.
pub fn instructions(set: HostInstructions) -> Vec<Instruction> {
    let registers = || 0..set.row().registers as u8;
    let count = registers().end;
    let mut all = Vec::new();
    for place in places() {
        all.extend(registers().map(|to| Instruction::Load { to, from: place }));
        all.extend(registers().map(|to| Instruction::Root { to, of: ReadFrom::Memory(place) }));
        for op in Binary::ALL {
            let of = |to: u8| Instruction::Binary { op: *op, to, a: (to * 7 + 3) % count, b: ReadFrom::Memory(place) };
            all.extend(registers().map(of));
        }
        if let MemoryPlace::Cell(to) = place {
            all.extend(registers().map(|from| Instruction::Store { from, to }));
        }
    }
    for (to, a) in registers().flat_map(|to| registers().map(move |a| (to, a))) {
        all.push(Instruction::Negation { to, of: a });
        all.extend((to != a).then_some(Instruction::Copy { to, from: a }));
        all.push(Instruction::Root { to, of: ReadFrom::Register(a) });
        for (op, b) in Binary::ALL.iter().flat_map(|op| registers().map(move |b| (*op, b))) {
            all.push(Instruction::Binary { op, to, a, b: ReadFrom::Register(b) });
        }
    }
    for (form, negated, minus) in [FusedForm::IntoTerm, FusedForm::IntoFactor]
        .into_iter()
        .flat_map(|form| [false, true].map(|negated| (form, negated)))
        .flat_map(|(form, negated)| [false, true].map(|minus| (form, negated, minus)))
        .filter(|_| set != HostInstructions::Sse2)
    {
        let fused = |to: u8, a: u8, b: ReadFrom| Instruction::Fused { form, to, a, b, negated, minus };
        all.extend(
            places()
                .into_iter()
                .flat_map(|place| registers().map(move |to| fused(to, (to * 5 + 2) % count, ReadFrom::Memory(place)))),
        );
        all.extend(
            registers().flat_map(|to| registers().map(move |b| fused(to, (b * 3 + 1) % count, ReadFrom::Register(b)))),
        );
    }
    all
}

#[test]
fn every_instruction_is_read_as_what_it_is() {
    for (set, (bytes, is_vector, suffix)) in SETS.iter().flat_map(|set| FORMATS.map(|format| (*set, format))) {
        let all = instructions(set);
        let format = Format { set, bytes, is_vector };
        let names = Names { format, suffix };
        let read = read(&function(&all, format));
        let mut wanted: Vec<String> = match set {
            HostInstructions::Sse2 => all.iter().flat_map(|one| names.of_two(*one)).collect(),
            _ => all.iter().map(|one| names.of_three(*one)).collect(),
        };
        if set != HostInstructions::Sse2 {
            wanted.push("vzeroupper".to_string());
        }
        wanted.push("ret".to_string());
        for (read, wanted) in read.iter().zip(&wanted) {
            assert_eq!(read, wanted, "{format:?}");
        }
        assert_eq!(read.len(), wanted.len(), "{format:?}");
    }
}
