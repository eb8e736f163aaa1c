//! Arm of 64 bits: Arm Architecture Reference Manual for A-profile, chapter C4.

use super::instruction::{field, signed, word, CodeFlow, InstructionClass, MachineInstruction};

/// The stack pointer.
const SP: u32 = 31;

/// The instructions of a function.
pub fn decoded(bytes: &[u8], is_data: &dyn Fn(usize) -> bool) -> Vec<MachineInstruction> {
    (0..bytes.len() / 4).map(|k| 4 * k).filter(|at| !is_data(*at)).map(|at| instruction(word(bytes, at), at)).collect()
}

fn instruction(code: u32, at: usize) -> MachineInstruction {
    let mut i = MachineInstruction::plain(at, 4);
    let there = |bits: u32, from: u32| at as i64 + 4 * signed(field(code, from, bits), bits);
    let (rd, rn) = (field(code, 0, 5), field(code, 5, 5));
    match () {
        // B, BL
        () if code >> 26 == 0b00_0101 => i.flow = CodeFlow::Jump(there(26, 0)),
        () if code >> 26 == 0b10_0101 => i.flow = CodeFlow::Call,
        // B.cond, CBZ and CBNZ, TBZ and TBNZ
        () if code >> 24 == 0x54 || code >> 24 & 0x7e == 0x34 => i.flow = CodeFlow::Branch(there(19, 5)),
        () if code >> 24 & 0x7e == 0x36 => i.flow = CodeFlow::Branch(there(14, 5)),
        // RET; BR, BLR and others by registers
        () if code & 0xffff_fc1f == 0xd65f_0000 => i.flow = CodeFlow::Return,
        () if code >> 25 == 0b110_1011 => i.flow = CodeFlow::Indirect,
        // SUB and ADD of a constant
        () if code >> 23 & 0x3f == 0x22 && code >> 31 == 1 && rd == SP => {
            let constant = field(code, 10, 12) << (12 * field(code, 22, 1));
            i.sets_aside = match (field(code, 29, 2), rn) {
                (0b10, SP) => Some(constant),
                // back from the frame pointer
                (0b00 | 0b10, SP | 29) => Some(0),
                // comparisons write no register
                (0b01 | 0b11, _) => Some(0),
                _ => None,
            };
        }
        // loads and stores of pairs, with the address written back before
        () if field(code, 27, 3) == 0b101 && field(code, 25, 1) == 0 => {
            let words = pair_words(code);
            i.class = InstructionClass::Transfer(2 * words);
            if field(code, 23, 3) == 0b011 && rn == SP {
                let offset = signed(field(code, 15, 7), 7) * 4 * i64::from(words);
                i.sets_aside = Some((-offset).max(0) as u32);
            }
        }
        // loads and stores of one register
        () if field(code, 27, 3) == 0b111 && field(code, 25, 1) == 0 => {
            i.class = InstructionClass::Transfer(1);
            let is_before = field(code, 24, 2) == 0 && field(code, 21, 1) == 0 && field(code, 10, 2) == 0b11;
            if is_before && rn == SP {
                i.sets_aside = Some((-signed(field(code, 12, 9), 9)).max(0) as u32);
            }
        }
        () => {}
    }
    i
}

/// Words of each register of a pair.
fn pair_words(code: u32) -> u32 {
    match (field(code, 26, 1), field(code, 30, 2)) {
        (1, size) => 1 << size,
        (_, 0b10) => 2,
        _ => 1,
    }
}
