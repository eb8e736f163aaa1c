//! Every instruction, as another program reads its bytes.

use iced_x86::{Decoder, DecoderOptions, Formatter, Instruction as Decoded, IntelFormatter, MemorySizeOptions};
use straightline_graph::expr::Binary;
use straightline_jit::allocation::{Instruction, Place, Source};
use straightline_jit::machine::x86::{function, Format, SIGNS};

const FORMATS: [(Format, &str); 4] = [
    (Format { bytes: 8, is_vector: true }, "pd"),
    (Format { bytes: 4, is_vector: true }, "ps"),
    (Format { bytes: 8, is_vector: false }, "sd"),
    (Format { bytes: 4, is_vector: false }, "ss"),
];

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
fn expected(instruction: Instruction, format: Format, suffix: &str) -> String {
    let width = if format.is_vector { "y" } else { "x" };
    let register = |k: u8| format!("{width}mm{k}");
    let memory = |place: Place| {
        let step = format.lanes() * format.bytes;
        let (base, at) = match place {
            Place::Cell(at) => ("rdi", at * step),
            Place::Constant(at) => ("rsi", (at + SIGNS) * step),
            Place::MinusZero => ("rsi", 0),
        };
        match at {
            0 => format!("[{base}]"),
            at => format!("[{base}+0x{at:X}]"),
        }
    };
    let source = |b: Source| match b {
        Source::Register(k) => register(k),
        Source::Memory(place) => memory(place),
    };
    let moves = if format.is_vector { "vmovu" } else { "vmov" };
    match instruction {
        Instruction::Load { to, from } => format!("{moves}{suffix} {}, {}", register(to), memory(from)),
        Instruction::Store { from, to } => format!("{moves}{suffix} {}, {}", memory(Place::Cell(to)), register(from)),
        Instruction::Binary { op, to, a, b } => {
            let name = match op {
                Binary::Add => "add",
                Binary::Sub => "sub",
                Binary::Mul => "mul",
                Binary::Div => "div",
            };
            format!("v{name}{suffix} {}, {}, {}", register(to), register(a), source(b))
        }
        Instruction::Root { to, of } if format.is_vector => format!("vsqrt{suffix} {}, {}", register(to), source(of)),
        Instruction::Root { to, of } => format!("vsqrt{suffix} {0}, {0}, {1}", register(to), source(of)),
        Instruction::Negation { to, of } => {
            let whole = if format.bytes == 8 { "pd" } else { "ps" };
            format!("vxor{whole} {}, {}, {}", register(to), register(of), memory(Place::MinusZero))
        }
    }
}

fn places() -> Vec<Place> {
    let cells = [0, 1, 3, 4, 15, 16, 31, 32, 1000, 100_000].map(Place::Cell);
    let constants = [0, 1, 27, 28, 5000].map(Place::Constant);
    cells.into_iter().chain(constants).collect()
}

/// All registers everywhere, and places near and far.
fn instructions() -> Vec<Instruction> {
    let registers = || 0..16_u8;
    let mut all = Vec::new();
    for place in places() {
        all.extend(registers().map(|to| Instruction::Load { to, from: place }));
        all.extend(registers().map(|to| Instruction::Root { to, of: Source::Memory(place) }));
        for op in Binary::ALL {
            let of = |to: u8| Instruction::Binary { op: *op, to, a: (to * 7 + 3) % 16, b: Source::Memory(place) };
            all.extend(registers().map(of));
        }
        if let Place::Cell(to) = place {
            all.extend(registers().map(|from| Instruction::Store { from, to }));
        }
    }
    for (to, a) in registers().flat_map(|to| registers().map(move |a| (to, a))) {
        all.push(Instruction::Negation { to, of: a });
        all.push(Instruction::Root { to, of: Source::Register(a) });
        for (op, b) in Binary::ALL.iter().flat_map(|op| registers().map(move |b| (*op, b))) {
            all.push(Instruction::Binary { op, to, a, b: Source::Register(b) });
        }
    }
    all
}

#[test]
fn every_instruction_is_read_as_what_it_is() {
    let all = instructions();
    for (format, suffix) in FORMATS {
        let read = read(&function(&all, format));
        let mut wanted: Vec<String> = all.iter().map(|one| expected(*one, format, suffix)).collect();
        if format.is_vector {
            wanted.push("vzeroupper".to_string());
        }
        wanted.push("ret".to_string());
        assert_eq!(read.len(), wanted.len(), "{format:?}");
        for (read, wanted) in read.iter().zip(&wanted) {
            assert_eq!(read, wanted, "{format:?}");
        }
    }
}
