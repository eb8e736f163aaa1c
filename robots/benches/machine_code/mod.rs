//! What rustc made of a function: its size, and what goes through the stack.

use iced_x86::{Decoder, DecoderOptions, Instruction, InstructionInfoFactory, Mnemonic, OpAccess, OpKind, Register};
use object::{Architecture, Object, ObjectSection, ObjectSymbol, Symbol};

/// The machine code of a function and its parts.
pub struct MachineCode {
    /// How long it is.
    pub bytes: u64,
    /// Its traffic with the stack, where the instructions can be read.
    pub spills: Option<Spills>,
}

/// Values that do not fit into registers.
#[derive(Clone, Copy, Default)]
pub struct Spills {
    /// The most bytes of stack that one of the functions sets aside.
    pub frame: u64,
    /// Instructions that read from the stack, and that write to it; returns, and registers saved for the caller, not counted.
    pub reads: usize,
    pub writes: usize,
}

impl MachineCode {
    /// The code of a function of a module, in this program.
    pub fn of(program: &object::File, module: &str, function: &str) -> MachineCode {
        let is_of = |name: &str| {
            let begins =
                |function: &str| name.contains(&format!("{}{module}{}{function}", module.len(), function.len()));
            begins(function) || (1..100).any(|k| begins(&format!("{function}_part{k}")))
        };
        let symbols: Vec<Symbol> = program.symbols().filter(|s| s.name().is_ok_and(is_of)).collect();
        let bytes = symbols.iter().map(|s| s.size()).sum();
        let readable = program.architecture() == Architecture::X86_64 && !symbols.is_empty();
        let spills = readable.then(|| {
            let mut spills = Spills::default();
            symbols.iter().filter_map(|symbol| code(program, symbol)).for_each(|code| spills.add(code));
            spills
        });
        MachineCode { bytes, spills }
    }
}

/// The instructions of a function.
fn code<'a>(program: &object::File<'a>, symbol: &Symbol<'a, '_>) -> Option<&'a [u8]> {
    let section = program.section_by_index(symbol.section_index()?).ok()?;
    section.data_range(symbol.address(), symbol.size()).ok()?
}

impl Spills {
    fn add(&mut self, code: &[u8]) {
        let mut infos = InstructionInfoFactory::new();
        let mut frame = 0;
        for instruction in &mut Decoder::new(64, code, DecoderOptions::NONE) {
            if let Some(bytes) = set_aside(&instruction) {
                frame += bytes;
            }
            // registers of the caller
            if matches!(instruction.mnemonic(), Mnemonic::Push | Mnemonic::Pop | Mnemonic::Call | Mnemonic::Ret) {
                continue;
            }
            for memory in infos.info(&instruction).used_memory() {
                if memory.base() == Register::RSP {
                    let access = memory.access();
                    self.reads += usize::from(!matches!(access, OpAccess::Write | OpAccess::NoMemAccess));
                    self.writes += usize::from(!matches!(access, OpAccess::Read | OpAccess::NoMemAccess));
                }
            }
        }
        self.frame = self.frame.max(frame);
    }
}

/// The bytes by which `sub rsp, n` makes room.
fn set_aside(instruction: &Instruction) -> Option<u64> {
    let makes_room = instruction.mnemonic() == Mnemonic::Sub && instruction.op0_register() == Register::RSP;
    let immediate = matches!(instruction.op1_kind(), OpKind::Immediate8to64 | OpKind::Immediate32to64);
    (makes_room && immediate).then(|| instruction.immediate(1))
}
