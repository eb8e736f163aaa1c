//! The functions of an object file: their instructions, whom they call, and what constants they use.

use super::instruction::{decoded, MachineInstruction};
use crate::choices::machine::InstructionSet;
use object::read::elf::ElfFile;
use object::read::{Object as _, ObjectSection as _, ObjectSymbol as _, RelocationTarget};
use object::{elf::FileHeader32, elf::FileHeader64, Endianness, FileKind, SectionKind, SymbolKind};
use std::collections::{BTreeMap, BTreeSet};

/// A function.
#[derive(Clone, Debug, Default)]
pub(super) struct FunctionCode {
    /// Bytes, with the constants among its instructions.
    pub size: usize,
    /// Bytes of constants among its instructions.
    pub data: usize,
    /// In their order; none of an instruction set that is not read.
    pub instructions: Vec<MachineInstruction>,
    /// Whom the instruction at a place calls or jumps to.
    pub calls: BTreeMap<usize, String>,
    /// Constants that lie elsewhere.
    pub constants: BTreeSet<ConstantPlace>,
}

/// A constant: its section, its place there, its bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct ConstantPlace {
    section: usize,
    at: u64,
    pub size: u64,
}

/// The functions of an object file by their symbols.
#[derive(Clone, Debug, Default)]
pub struct ObjectCode {
    pub(super) functions: BTreeMap<String, FunctionCode>,
}

impl ObjectCode {
    /// Reads an object file.
    ///
    /// # Errors
    /// What cannot be read.
    pub fn read(bytes: &[u8], set: Option<InstructionSet>) -> Result<ObjectCode, String> {
        let kind = FileKind::parse(bytes).map_err(|e| e.to_string())?;
        match kind {
            FileKind::Elf32 => {
                of_elf(&ElfFile::<FileHeader32<Endianness>>::parse(bytes).map_err(|e| e.to_string())?, set)
            }
            FileKind::Elf64 => {
                of_elf(&ElfFile::<FileHeader64<Endianness>>::parse(bytes).map_err(|e| e.to_string())?, set)
            }
            other => Err(format!("{other:?} is no ELF")),
        }
    }

    /// How often the instructions of a function call each other function, by symbols.
    pub fn calls(&self, function: &str) -> BTreeMap<&str, usize> {
        let mut calls = BTreeMap::new();
        for callee in self.functions.get(function).iter().flat_map(|code| code.calls.values()) {
            *calls.entry(callee.as_str()).or_insert(0) += 1;
        }
        calls
    }
}

fn of_elf<'d, H>(file: &ElfFile<'d, H>, set: Option<InstructionSet>) -> Result<ObjectCode, String>
where
    H: object::read::elf::FileHeader<Endian = Endianness>,
{
    // on Arm the lowest bit of a function's address says that it is Thumb
    let place = |address: u64| if set == Some(InstructionSet::Thumb) { address & !1 } else { address };
    // where constants and where instructions begin, per section
    let mut marks: BTreeMap<usize, BTreeMap<u64, bool>> = BTreeMap::new();
    for symbol in file.symbols() {
        let (Ok(name), Some(section)) = (symbol.name(), symbol.section_index()) else { continue };
        let is_data = match name.split('.').next() {
            Some("$d") => true,
            Some("$t" | "$x" | "$a") => false,
            _ => continue,
        };
        marks.entry(section.0).or_default().insert(place(symbol.address()), is_data);
    }
    let mut functions = BTreeMap::new();
    for symbol in file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text && symbol.size() > 0) {
        let (Ok(name), Some(index)) = (symbol.name(), symbol.section_index()) else { continue };
        let section = file.section_by_index(index).map_err(|e| e.to_string())?;
        let (start, size) = (place(symbol.address()), symbol.size() as usize);
        let text = section.data().map_err(|e| e.to_string())?;
        let bytes = usize::try_from(start).ok().and_then(|start| text.get(start..start.checked_add(size)?));
        let bytes = bytes.ok_or_else(|| format!("`{name}` ends behind its section"))?;
        let own = marks.get(&index.0);
        let is_data = |at: usize| {
            own.and_then(|marks| marks.range(..=start + at as u64).next_back()).is_some_and(|(_, is_data)| *is_data)
        };
        let mut code = FunctionCode {
            size,
            data: (0..size).filter(|at| is_data(*at)).count(),
            instructions: set.map_or(Vec::new(), |set| decoded(set, bytes, &is_data)),
            ..FunctionCode::default()
        };
        for (at, relocation) in section.relocations() {
            let Some(at) = at.checked_sub(start).filter(|at| *at < size as u64) else { continue };
            let RelocationTarget::Symbol(target) = relocation.target() else { continue };
            let target = file.symbol_by_index(target).map_err(|e| e.to_string())?;
            let of = target.section_index().and_then(|index| file.section_by_index(index).ok());
            match of {
                Some(of) if of.kind() != SectionKind::Text => {
                    let implicit = if relocation.has_implicit_addend() { implicit_addend(bytes, at) } else { 0 };
                    let within = target.address().wrapping_add((relocation.addend() + implicit) as u64);
                    // entries of what is merged have their size in the section's name
                    let entry = of.name().ok().and_then(|name| name.rsplit_once(".cst")?.1.parse().ok());
                    let (at, size) = match (target.size(), entry) {
                        (0, Some(entry)) => (within, entry),
                        (0, None) => (0, of.size()),
                        (size, _) => (target.address(), size),
                    };
                    code.constants.insert(ConstantPlace { section: of.index().0, at, size });
                }
                _ if target.kind() != SymbolKind::Text && !target.is_undefined() => {}
                _ => {
                    code.calls.insert(at as usize, target.name().unwrap_or_default().to_string());
                }
            }
        }
        functions.insert(name.to_string(), code);
    }
    Ok(ObjectCode { functions })
}

/// What an address of 32 bits in the text counts from its symbol.
fn implicit_addend(bytes: &[u8], at: u64) -> i64 {
    i64::from(super::instruction::word(bytes, at as usize) as i32)
}
