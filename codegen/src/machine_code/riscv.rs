//! RISC-V of 32 bits with compressed instructions: The RISC-V Instruction Set Manual, volume I (RV32I, M, F, D, C).

use super::instruction::{field, half, signed, word, CodeFlow, InstructionClass, MachineInstruction};

/// The return address, and the stack pointer.
const RA: u32 = 1;
const SP: u32 = 2;

/// The instructions of a function.
pub fn decoded(bytes: &[u8], is_data: &dyn Fn(usize) -> bool) -> Vec<MachineInstruction> {
    let (mut at, mut found) = (0, Vec::new());
    // constants that registers were loaded with, for frames that no instruction can hold
    let mut known: [Option<u32>; 32] = [None; 32];
    known[0] = Some(0);
    while at + 1 < bytes.len() {
        if is_data(at) {
            at += 2;
            continue;
        }
        let first = half(bytes, at);
        let instruction = match first & 3 {
            3 => long(word(bytes, at), at, &mut known),
            _ => compressed(first, at, &mut known),
        };
        at += instruction.size;
        found.push(instruction);
    }
    found
}

/// An instruction of 32 bits.
fn long(code: u32, at: usize, known: &mut [Option<u32>; 32]) -> MachineInstruction {
    let mut i = MachineInstruction::plain(at, 4);
    let [rd, rs1, rs2] = [7, 15, 20].map(|from| field(code, from, 5));
    let immediate = signed(code >> 20, 12);
    let mut writes = None;
    match code & 0x7f {
        // loads and stores, also of the floating-point unit; of single precision one word
        0x03 | 0x23 => i.class = InstructionClass::Transfer(1),
        0x07 | 0x27 => i.class = InstructionClass::Transfer(if field(code, 12, 3) == 3 { 2 } else { 1 }),
        // FMADD, FMSUB, FNMSUB, FNMADD
        0x43 | 0x47 | 0x4b | 0x4f => i.class = InstructionClass::MultiplyAccumulate,
        0x53 => {
            i.class = match field(code, 27, 5) {
                0x03 => InstructionClass::Division,
                0x0b => InstructionClass::SquareRoot,
                _ => InstructionClass::Float,
            }
        }
        // ADDI
        0x13 if field(code, 12, 3) == 0 => match (rd, rs1) {
            (SP, SP) => i.sets_aside = Some((-immediate).max(0) as u32),
            // back from the frame pointer
            (SP, 8) => {}
            (SP, _) => i.sets_aside = None,
            _ => writes = known[rs1 as usize].map(|n| n.wrapping_add(immediate as u32)),
        },
        // LUI
        0x37 => writes = Some(code & 0xffff_f000),
        // ADD, SUB
        0x33 if field(code, 12, 3) == 0 && rd == SP => {
            let by = known[rs2 as usize].map(|n| n as i32).filter(|_| rs1 == SP);
            let is_subtraction = field(code, 25, 7) == 0x20;
            i.sets_aside = by.map(|n| if is_subtraction { n } else { -n }.max(0) as u32);
        }
        0x63 => {
            let offset =
                field(code, 31, 1) << 12 | field(code, 7, 1) << 11 | field(code, 25, 6) << 5 | field(code, 8, 4) << 1;
            i.flow = CodeFlow::Branch(at as i64 + signed(offset, 13));
        }
        0x6f => {
            let offset = field(code, 31, 1) << 20
                | field(code, 12, 8) << 12
                | field(code, 20, 1) << 11
                | field(code, 21, 10) << 1;
            i.flow = match rd {
                0 => CodeFlow::Jump(at as i64 + signed(offset, 21)),
                _ => CodeFlow::Call,
            };
        }
        0x67 => {
            i.flow = match (rd, rs1) {
                (0, RA) => CodeFlow::Return,
                // the second half of a call, whose first one names the function
                (RA, RA) => CodeFlow::Next,
                // of a call at the end, which does not come back (t1)
                (0, 6) => CodeFlow::Return,
                _ => CodeFlow::Indirect,
            }
        }
        _ if rd == SP => i.sets_aside = None,
        _ => {}
    }
    if !matches!(code & 0x7f, 0x23 | 0x27 | 0x63 | 0x07 | 0x53 | 0x43 | 0x47 | 0x4b | 0x4f) && rd != 0 {
        known[rd as usize] = writes;
    }
    i
}

/// An instruction of 16 bits.
fn compressed(code: u32, at: usize, known: &mut [Option<u32>; 32]) -> MachineInstruction {
    let mut i = MachineInstruction::plain(at, 2);
    let rd = field(code, 7, 5);
    let six = signed(field(code, 12, 1) << 5 | field(code, 2, 5), 6);
    match (code & 3, code >> 13) {
        // C.ADDI4SPN
        (0, 0) => known[8 + field(code, 2, 3) as usize] = None,
        // C.FLD, C.FSD
        (0, 1 | 5) => i.class = InstructionClass::Transfer(2),
        // C.LW, C.FLW, C.SW, C.FSW
        (0, number) => {
            i.class = InstructionClass::Transfer(1);
            if number == 2 {
                known[8 + field(code, 2, 3) as usize] = None;
            }
        }
        // C.ADDI
        (1, 0) if rd == SP => i.sets_aside = Some((-six).max(0) as u32),
        (1, 0) => known[rd as usize] = known[rd as usize].map(|n| n.wrapping_add(six as u32)),
        // C.JAL
        (1, 1) => i.flow = CodeFlow::Call,
        // C.LI
        (1, 2) => known[rd as usize] = Some(six as u32),
        // C.ADDI16SP
        (1, 3) if rd == SP => {
            let by = field(code, 12, 1) << 9
                | field(code, 3, 2) << 7
                | field(code, 5, 1) << 6
                | field(code, 2, 1) << 5
                | field(code, 6, 1) << 4;
            i.sets_aside = Some((-signed(by, 10)).max(0) as u32);
        }
        // C.LUI
        (1, 3) => known[rd as usize] = Some((six << 12) as u32),
        (1, 4) => known[8 + field(code, 7, 3) as usize] = None,
        // C.J
        (1, 5) => i.flow = CodeFlow::Jump(at as i64 + jump(code)),
        // C.BEQZ, C.BNEZ
        (1, _) => {
            let offset = field(code, 12, 1) << 8
                | field(code, 5, 2) << 6
                | field(code, 2, 1) << 5
                | field(code, 10, 2) << 3
                | field(code, 3, 2) << 1;
            i.flow = CodeFlow::Branch(at as i64 + signed(offset, 9));
        }
        // C.FLDSP, C.FSDSP
        (2, 1 | 5) => i.class = InstructionClass::Transfer(2),
        // C.LWSP, C.FLWSP, C.SWSP, C.FSWSP
        (2, 2 | 3 | 6 | 7) => {
            i.class = InstructionClass::Transfer(1);
            if code >> 13 == 2 {
                known[rd as usize] = None;
            }
        }
        // C.JR, C.JALR, C.MV, C.ADD, C.EBREAK
        (2, 4) => match (field(code, 12, 1), field(code, 2, 5), rd) {
            (0, 0, RA) => i.flow = CodeFlow::Return,
            (_, 0, _) => i.flow = CodeFlow::Indirect,
            // back from the frame pointer
            (0, 8, SP) => {}
            (1, from, SP) => i.sets_aside = known[from as usize].map(|n| (n as i32).min(0).unsigned_abs()),
            (_, _, SP) => i.sets_aside = None,
            (0, from, _) => known[rd as usize] = known[from as usize],
            (_, from, _) => {
                let sum = known[rd as usize].zip(known[from as usize]).map(|(a, b)| a.wrapping_add(b));
                known[rd as usize] = sum;
            }
        },
        // C.SLLI
        _ => known[rd as usize] = known[rd as usize].map(|n| n.wrapping_shl(field(code, 2, 5))),
    }
    i
}

/// The offset of C.J and C.JAL.
fn jump(code: u32) -> i64 {
    let offset = field(code, 12, 1) << 11
        | field(code, 8, 1) << 10
        | field(code, 9, 2) << 8
        | field(code, 6, 1) << 7
        | field(code, 7, 1) << 6
        | field(code, 2, 1) << 5
        | field(code, 11, 1) << 4
        | field(code, 3, 3) << 1;
    signed(offset, 12)
}
