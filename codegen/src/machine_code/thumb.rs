//! Thumb and Thumb-2 with the floating-point unit: Arm Architecture Reference Manuals of ARMv6-M, ARMv7-M (A5, A6, A7) and ARMv8-M.

use super::instruction::{field, half, signed, word, CodeFlow, InstructionClass, MachineInstruction};

/// The stack pointer, and the program counter.
const SP: u32 = 13;
const PC: u32 = 15;

/// The instructions of a function.
pub fn decoded(bytes: &[u8], is_data: &dyn Fn(usize) -> bool) -> Vec<MachineInstruction> {
    let (mut at, mut found) = (0, Vec::new());
    // constants that registers were loaded with, for frames that no instruction can hold
    let mut known: [Option<u32>; 16] = [None; 16];
    // instructions that an IT makes conditional; they take their time in any case
    let mut conditional = 0;
    while at + 1 < bytes.len() {
        if is_data(at) {
            at += 2;
            continue;
        }
        let first = half(bytes, at);
        // A5.1: 0b11101, 0b11110 and 0b11111 begin an instruction of two half words
        let mut instruction = match first >> 11 >= 0b11101 {
            false => short(first, at, bytes, &mut known),
            true => long(first, half(bytes, at + 2), at, bytes, &mut known),
        };
        if conditional > 0 {
            conditional -= 1;
            instruction.flow = match instruction.flow {
                CodeFlow::Return => CodeFlow::Branch(bytes.len() as i64),
                CodeFlow::Jump(there) => CodeFlow::Branch(there),
                flow => flow,
            };
        } else if first >> 8 == 0xbf && first & 0xf != 0 {
            conditional = 4 - (first & 0xf).trailing_zeros();
        }
        at += instruction.size;
        found.push(instruction);
    }
    found
}

/// The word of a literal pool that an instruction at a place loads.
fn literal(bytes: &[u8], at: usize, offset: i64) -> Option<u32> {
    let place = usize::try_from((at as i64 + 4) / 4 * 4 + offset).ok()?;
    (place + 4 <= bytes.len()).then(|| word(bytes, place))
}

/// An instruction of 16 bits.
fn short(code: u32, at: usize, bytes: &[u8], known: &mut [Option<u32>; 16]) -> MachineInstruction {
    let mut i = MachineInstruction::plain(at, 2);
    let from_here = |offset: i64| at as i64 + 4 + offset;
    let registers = field(code, 0, 8).count_ones();
    match code >> 8 {
        // LDR (literal)
        0x48..=0x4f => {
            i.class = InstructionClass::Transfer(1);
            known[field(code, 8, 3) as usize] = literal(bytes, at, 4 * i64::from(field(code, 0, 8)));
        }
        // ADD and MOV with high registers; BX, BLX
        0x44 => {
            let (to, from) = (field(code, 0, 3) | field(code, 7, 1) << 3, field(code, 3, 4) as usize);
            match to {
                SP => i.sets_aside = known[from].map(|n| (n as i32).min(0).unsigned_abs()),
                PC => i.flow = CodeFlow::Indirect,
                _ => known[to as usize] = None,
            }
        }
        0x46 => match field(code, 0, 3) | field(code, 7, 1) << 3 {
            // from the frame pointer: what was set aside is given back
            SP if field(code, 3, 4) == 7 => {}
            // right before a POP so is what was computed from it
            SP if matches!(half(bytes, at + 2) >> 8, 0xbc | 0xbd) => {}
            SP => i.sets_aside = None,
            PC => i.flow = CodeFlow::Indirect,
            to => known[to as usize] = None,
        },
        0x47 => {
            i.flow = match (field(code, 7, 1), field(code, 3, 4)) {
                (0, 14) => CodeFlow::Return,
                _ => CodeFlow::Indirect,
            }
        }
        // loads and stores of one register
        0x50..=0x9f => {
            i.class = InstructionClass::Transfer(1);
            known[field(code, if code >> 12 == 9 { 8 } else { 0 }, 3) as usize] = None;
        }
        // SUB (SP minus immediate); bit 7 tells it from ADD
        0xb0 if code & 0x80 != 0 => i.sets_aside = Some(4 * field(code, 0, 7)),
        0xb4 | 0xb5 => {
            let registers = registers + field(code, 8, 1);
            (i.class, i.sets_aside) = (InstructionClass::Transfer(registers), Some(4 * registers));
        }
        0xbc => i.class = InstructionClass::Transfer(registers),
        0xbd => (i.class, i.flow) = (InstructionClass::Transfer(registers + 1), CodeFlow::Return),
        // CBZ, CBNZ
        0xb1 | 0xb3 | 0xb9 | 0xbb => {
            let offset = field(code, 9, 1) << 6 | field(code, 3, 5) << 1;
            i.flow = CodeFlow::Branch(from_here(i64::from(offset)));
        }
        0xc0..=0xcf => i.class = InstructionClass::Transfer(registers),
        0xde => i.flow = CodeFlow::Return,
        0xdf => i.flow = CodeFlow::Indirect,
        0xd0..=0xdd => i.flow = CodeFlow::Branch(from_here(2 * signed(code, 8))),
        0xe0..=0xe7 => i.flow = CodeFlow::Jump(from_here(2 * signed(code, 11))),
        // MOV and ADD (immediate), and the rest of what writes a low register
        0x20..=0x27 => known[field(code, 8, 3) as usize] = Some(field(code, 0, 8)),
        0x00..=0x43 => {
            let to = if (0x30..=0x3f).contains(&(code >> 8)) { field(code, 8, 3) } else { field(code, 0, 3) };
            let before = known[to as usize];
            known[to as usize] = match (code >> 11, field(code, 6, 5) == 0b01001 && code >> 10 == 0x10) {
                // LSL (immediate) of itself
                (0, _) if field(code, 3, 3) == to => before.map(|n| n << field(code, 6, 5)),
                // RSB: the negative of itself
                (_, true) if field(code, 3, 3) == to => before.map(u32::wrapping_neg),
                (0b00110, _) => before.map(|n| n.wrapping_add(field(code, 0, 8))),
                (0b00111, _) => before.map(|n| n.wrapping_sub(field(code, 0, 8))),
                _ => None,
            };
        }
        _ => {}
    }
    i
}

/// An instruction of 32 bits, of two half words.
fn long(a: u32, b: u32, at: usize, bytes: &[u8], known: &mut [Option<u32>; 16]) -> MachineInstruction {
    let mut i = MachineInstruction::plain(at, 4);
    // 111.110.: the coprocessors 10 and 11 are the floating-point unit
    if a & 0xec00 == 0xec00 && field(b, 9, 3) == 0b101 {
        return floating(a, b, i);
    }
    let (n, t) = (field(a, 0, 4), field(b, 12, 4));
    match () {
        // branches (A5.3.4)
        () if a >> 11 == 0b11110 && b & 0x8000 != 0 => {
            i.flow = branching(a, b, at);
        }
        // LDM, STM, POP.W, PUSH.W (A5.3.5)
        () if a & 0xfe40 == 0xe800 => {
            let registers = b.count_ones();
            i.class = InstructionClass::Transfer(registers);
            // STMDB SP!
            if a & 0xffff == 0xe92d {
                i.sets_aside = Some(4 * registers);
            }
            if a & 0x10 != 0 && b & 0x8000 != 0 {
                i.flow = CodeFlow::Return;
            }
        }
        // LDRD, STRD, and table branches (A5.3.6)
        () if a & 0xfe40 == 0xe840 => {
            i.class = InstructionClass::Transfer(2);
            if a & 0xfff0 == 0xe8d0 && b & 0xffe0 == 0xf000 {
                i.flow = CodeFlow::Indirect;
            }
            // before the store the stack pointer goes down
            if a & 0x0130 == 0x0120 && n == SP && a & 0x80 == 0 {
                i.sets_aside = Some(4 * field(b, 0, 8));
            }
        }
        // one load or store (A5.3.7 to A5.3.10)
        () if a & 0xfe00 == 0xf800 => {
            i.class = InstructionClass::Transfer(1);
            let is_load = a & 0x10 != 0;
            match (is_load, n, t) {
                // LDR PC, [SP], #4 is a POP; of other places nobody knows
                (true, SP, PC) => i.flow = CodeFlow::Return,
                (true, _, PC) if a & 0x60 == 0x40 => i.flow = CodeFlow::Indirect,
                (true, PC, _) => {
                    let offset = i64::from(field(b, 0, 12));
                    known[t as usize] = literal(bytes, at, if a & 0x80 != 0 { offset } else { -offset });
                }
                (true, ..) => known[t as usize] = None,
                // STR with the address written back, downwards
                (false, SP, _) if field(b, 8, 4) == 0b1101 => i.sets_aside = Some(field(b, 0, 8)),
                (false, ..) => {}
            }
        }
        // SUB and ADD of a constant, SUBW, MOVW, MOVT (A5.3.1, A5.3.3)
        () if a >> 11 == 0b11110 => {
            return with_constant(a, b, i, known);
        }
        // with a register (A5.3.11): SUB SP, SP, r and ADD SP, SP, r
        () if a & 0xfe00 == 0xea00 => {
            return with_register(a, b, i, known);
        }
        () => {
            let to = field(b, 8, 4);
            match to {
                SP => i.sets_aside = None,
                _ => known[to as usize] = None,
            }
        }
    }
    i
}

/// Where a branch of 32 bits goes.
fn branching(a: u32, b: u32, at: usize) -> CodeFlow {
    let from_here = |offset: i64| at as i64 + 4 + offset;
    let s = field(a, 10, 1);
    let [j1, j2] = [13, 11].map(|bit| field(b, bit, 1));
    match (b & 0x4000 != 0, b & 0x1000 != 0) {
        (true, _) => CodeFlow::Call,
        (false, true) => {
            let [i1, i2] = [j1, j2].map(|j| 1 ^ j ^ s);
            let offset = s << 24 | i1 << 23 | i2 << 22 | field(a, 0, 10) << 12 | field(b, 0, 11) << 1;
            CodeFlow::Jump(from_here(signed(offset, 25)))
        }
        // what is no condition: barriers, hints, MSR, MRS
        (false, false) if field(a, 7, 3) == 0b111 => CodeFlow::Next,
        (false, false) => {
            let offset = s << 20 | j2 << 19 | j1 << 18 | field(a, 0, 6) << 12 | field(b, 0, 11) << 1;
            CodeFlow::Branch(from_here(signed(offset, 21)))
        }
    }
}

/// An instruction of integers and a constant in it.
fn with_constant(a: u32, b: u32, mut i: MachineInstruction, known: &mut [Option<u32>; 16]) -> MachineInstruction {
    let (n, to) = (field(a, 0, 4), field(b, 8, 4) as usize);
    let plain = field(a, 10, 1) << 11 | field(b, 12, 3) << 8 | field(b, 0, 8);
    let wide = n << 12 | plain;
    let operation = field(a, 5, 5);
    let below = |bytes: u32| match n {
        SP => Some(bytes),
        // back from the frame pointer
        7 | 11 => Some(0),
        _ => None,
    };
    if to as u32 == SP {
        i.sets_aside = match operation {
            // SUB, SUBW; ADD, ADDW
            0b01101 => below(expanded(plain)),
            0b10101 => below(plain),
            0b01000 | 0b10000 => below(0),
            _ => None,
        };
    }
    known[to] = match operation {
        // MOVW, MOVT; MOV of a constant is OR with nothing
        0b10010 => Some(wide),
        0b10110 => known[to].map(|low| low & 0xffff | wide << 16),
        0b00010 if n == PC => Some(expanded(plain)),
        _ => None,
    };
    i
}

/// An instruction of integers and a register.
fn with_register(a: u32, b: u32, mut i: MachineInstruction, known: &mut [Option<u32>; 16]) -> MachineInstruction {
    let (n, to, from) = (field(a, 0, 4), field(b, 8, 4), field(b, 0, 4) as usize);
    let is_unshifted = b & 0x70f0 == 0;
    if to == SP {
        i.sets_aside = match field(a, 5, 4) {
            0b1101 if n == SP && is_unshifted => known[from],
            0b1000 if n == SP && is_unshifted => known[from].map(|k| (k as i32).min(0).unsigned_abs()),
            _ => None,
        };
    } else {
        known[to as usize] = None;
    }
    i
}

/// An instruction of the floating-point unit (A6, A7).
fn floating(a: u32, b: u32, mut i: MachineInstruction) -> MachineInstruction {
    let is_double = b & 0x100 != 0;
    let words = if is_double { 2 } else { 1 };
    match () {
        // 111.1110: operations of the unit where bit 4 is clear, moves to and from registers where it is set
        () if a & 0x0f00 == 0x0e00 && b & 0x10 == 0 => {
            // opc1 without D, and bit 6 of the second half word
            i.class = match (a >> 4 & 0b1011, field(b, 6, 1)) {
                // the selections and roundings of ARMv8-M, which have the highest bit of the first half word's twelfth
                _ if a & 0x1000 != 0 => InstructionClass::Float,
                // VMLA, VMLS, VNMLA, VNMLS; VFMA, VFMS, VFNMA, VFNMS
                (0b0000 | 0b0001 | 0b1001 | 0b1010, _) => InstructionClass::MultiplyAccumulate,
                (0b1000, 0) => InstructionClass::Division,
                (0b1011, 1) if field(a, 0, 4) == 0b0001 && b & 0x80 != 0 => InstructionClass::SquareRoot,
                _ => InstructionClass::Float,
            };
        }
        () if a & 0x0f00 == 0x0e00 => {}
        // VMOV of two registers
        () if a & 0x0fe0 == 0x0c40 => {}
        // one register: VLDR, VSTR
        () if a & 0x0120 == 0x0100 => i.class = InstructionClass::Transfer(words),
        // several, which the immediate counts in words
        () => {
            let count = field(b, 0, 8);
            i.class = InstructionClass::Transfer(count);
            // VPUSH
            if a & 0x0fbf == 0x0d2d {
                i.sets_aside = Some(4 * count);
            }
        }
    }
    i
}

/// A constant of 12 bits in its full width (A5.3.2).
fn expanded(constant: u32) -> u32 {
    let low = field(constant, 0, 8);
    match field(constant, 8, 4) {
        0 => low,
        1 => low << 16 | low,
        2 => low << 24 | low << 8,
        3 => low << 24 | low << 16 | low << 8 | low,
        _ => (0x80 | field(constant, 0, 7)).rotate_right(field(constant, 7, 5)),
    }
}
