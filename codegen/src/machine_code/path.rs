//! What a call costs: the longest path through a function and through all that it calls.

use super::instruction::{CodeFlow, InstructionClass, MachineInstruction};
use super::object_file::{ConstantPlace, FunctionCode, ObjectCode};
use super::MachineFigures;
use crate::choices::machine::{MachineRow, Memory};
use crate::choices::TargetMachine;
use std::collections::{BTreeMap, BTreeSet};

/// What names modules of kernels in symbols: functions share them.
const KERNELS: [&str; 2] = ["11short_sines", "4trig"];

const NOT_READ: &str = "machine code of this machine is not read";
const LOOP: &str = "it has a loop";
const BY_REGISTER: &str = "it jumps to where a register says";
const RECURSION: &str = "it calls itself";
const STACK_POINTER: &str = "its stack pointer is computed";
const LIBRARY: &str = "it calls functions of the compiler's library, whose instructions depend on the numbers";
const NO_MODEL: &str = "the machine's manual gives no cycles";

/// What is added along a path: instructions, bytes, or cycles.
struct PathCost<'a> {
    instruction: &'a dyn Fn(&MachineInstruction) -> f64,
    /// More where a jump is taken, a function called or left.
    taken: f64,
    /// Of a function as a whole.
    whole: &'a dyn Fn(&FunctionCode) -> f64,
    /// Of a function of the compiler's library.
    library: &'a dyn Fn(&str) -> Option<f64>,
}

type Cost = Result<f64, &'static str>;

impl ObjectCode {
    /// The figures of functions that have these symbols; none that the object does not have.
    pub fn figures(&self, symbols: &[String], machine: TargetMachine, memory: Memory) -> Option<Vec<MachineFigures>> {
        let row = machine.row();
        let reached: Option<Vec<ReachedCode>> = symbols.iter().map(|symbol| self.reached(symbol)).collect();
        let reached = reached?;
        let mut users: BTreeMap<ConstantPlace, usize> = BTreeMap::new();
        reached.iter().flat_map(|r| &r.constants).for_each(|constant| *users.entry(*constant).or_insert(0) += 1);
        let bytes = |constants: &BTreeSet<ConstantPlace>, is_shared: bool| -> u64 {
            constants.iter().filter(|constant| (users[constant] > 1) == is_shared).map(|constant| constant.size).sum()
        };
        let of = |(symbol, reached): (&String, &ReachedCode)| MachineFigures {
            instructions: self.instructions(symbol, row),
            flash_bytes: (reached.own + bytes(&reached.constants, false)) as u32,
            shared_flash_bytes: (reached.kernels + bytes(&reached.constants, true)) as u32,
            stack_bytes: match row.code {
                None => Err(NOT_READ),
                Some(_) => self.stack(symbol, &mut Vec::new()),
            },
            model_cycles: self.cycles(symbol, row, memory),
        };
        Some(symbols.iter().zip(&reached).map(of).collect())
    }

    fn instructions(&self, symbol: &str, row: &MachineRow) -> Result<u32, &'static str> {
        let library = |name: &str| row.library.iter().find(|(known, _)| *known == name).map(|(_, count)| *count);
        let cost = PathCost { instruction: &|_| 1.0, taken: 0.0, whole: &|_| 0.0, library: &library };
        self.path(symbol, row, &cost)
    }

    /// Cycles of the instructions, or of fetching them and their constants if that takes longer.
    fn cycles(&self, symbol: &str, row: &MachineRow, memory: Memory) -> Result<u32, &'static str> {
        let Some(model) = &row.cycles else { return Err(NO_MODEL) };
        let of_class = |i: &MachineInstruction| match i.class {
            InstructionClass::Plain => 1.0,
            InstructionClass::Float => model.float,
            InstructionClass::MultiplyAccumulate => model.multiply_accumulate,
            InstructionClass::Division => model.division,
            InstructionClass::SquareRoot => model.square_root,
            InstructionClass::Transfer(words) => 1.0 + f64::from(words),
        };
        let none = |_: &str| None;
        let own = PathCost { instruction: &of_class, taken: model.taken, whole: &|_| 0.0, library: &none };
        let own = self.path(symbol, row, &own)?;
        let bytes = PathCost {
            instruction: &|i| i.size as f64,
            taken: 0.0,
            whole: &|function| function.data as f64,
            library: &none,
        };
        let bytes = self.path(symbol, row, &bytes)?;
        Ok(match memory {
            Memory::Flash => own.max((f64::from(bytes) / model.flash_bytes_per_cycle).round() as u32),
            Memory::Tcm => own,
        })
    }

    fn path(&self, symbol: &str, row: &MachineRow, cost: &PathCost<'_>) -> Result<u32, &'static str> {
        match row.code {
            None => Err(NOT_READ),
            Some(_) => Ok(self.longest(symbol, cost, &mut BTreeMap::new())?.round() as u32),
        }
    }

    /// The most that a call can cost. Functions on the way, which are not known yet, are `None`.
    fn longest(&self, symbol: &str, cost: &PathCost<'_>, known: &mut BTreeMap<String, Option<Cost>>) -> Cost {
        if let Some(known) = known.get(symbol) {
            return known.unwrap_or(Err(RECURSION));
        }
        let Some(function) = self.functions.get(symbol) else { return (cost.library)(symbol).ok_or(LIBRARY) };
        known.insert(symbol.to_string(), None);
        let instructions = &function.instructions;
        let number: BTreeMap<usize, usize> = instructions.iter().enumerate().map(|(k, i)| (i.at, k)).collect();
        // from an instruction to the end: what lies behind is known first, but for jumps backwards, which a further pass finds known
        let mut rest: Vec<Option<Cost>> = vec![None; instructions.len() + 1];
        rest[instructions.len()] = Some(Ok(0.0));
        loop {
            let mut is_new = false;
            for (k, i) in instructions.iter().enumerate().rev().filter(|(k, _)| rest[*k].is_none()).collect::<Vec<_>>()
            {
                let to = |there: i64| match usize::try_from(there).ok().map(|there| (there, number.get(&there))) {
                    Some((_, Some(to))) => rest[*to],
                    Some((there, None)) if there == function.size => Some(Ok(0.0)),
                    _ => Some(Err(BY_REGISTER)),
                };
                let plus = |cost: Option<Cost>, more: f64| cost.map(|cost| cost.map(|cost| cost + more));
                let after = match (i.flow, function.calls.get(&i.at)) {
                    (CodeFlow::Next | CodeFlow::Call, Some(callee)) => match self.longest(callee, cost, known) {
                        Ok(of) => plus(rest[k + 1], of + cost.taken),
                        Err(why) => Some(Err(why)),
                    },
                    (CodeFlow::Jump(_), Some(callee)) => plus(Some(self.longest(callee, cost, known)), cost.taken),
                    (CodeFlow::Next, None) => rest[k + 1],
                    (CodeFlow::Jump(there), None) => plus(to(there), cost.taken),
                    (CodeFlow::Branch(there), None) => match (plus(to(there), cost.taken), rest[k + 1]) {
                        (Some(taken), Some(next)) => Some(taken.and_then(|taken| Ok(taken.max(next?)))),
                        _ => None,
                    },
                    (CodeFlow::Return, _) => Some(Ok(cost.taken)),
                    (CodeFlow::Call | CodeFlow::Indirect | CodeFlow::Branch(_), _) => Some(Err(BY_REGISTER)),
                };
                rest[k] = plus(after, (cost.instruction)(i));
                is_new |= rest[k].is_some();
            }
            if !is_new {
                break;
            }
        }
        let first = rest[0].unwrap_or(Err(LOOP));
        let found = first.map(|path| path + (cost.whole)(function));
        known.insert(symbol.to_string(), Some(found));
        found
    }

    /// Bytes of stack at its deepest.
    fn stack(&self, symbol: &str, above: &mut Vec<String>) -> Result<u32, &'static str> {
        let Some(function) = self.functions.get(symbol) else { return Ok(0) };
        if above.iter().any(|name| name == symbol) {
            return Err(RECURSION);
        }
        above.push(symbol.to_string());
        let mut own = 0;
        for i in &function.instructions {
            own += i.sets_aside.ok_or(STACK_POINTER)?;
        }
        let mut deepest = 0;
        for callee in function.calls.values().collect::<BTreeSet<_>>() {
            deepest = deepest.max(self.stack(callee, above)?);
        }
        above.pop();
        Ok(own + deepest)
    }

    /// All that is reached from a function.
    fn reached(&self, symbol: &str) -> Option<ReachedCode> {
        let mut reached = ReachedCode::default();
        let (mut open, mut seen) = (vec![symbol], BTreeSet::new());
        self.functions.get(symbol)?;
        while let Some(name) = open.pop() {
            let Some(function) = self.functions.get(name).filter(|_| seen.insert(name)) else { continue };
            let is_kernel = KERNELS.iter().any(|kernel| name.contains(kernel));
            *(if is_kernel { &mut reached.kernels } else { &mut reached.own }) += function.size as u64;
            reached.constants.extend(&function.constants);
            open.extend(function.calls.values().map(String::as_str));
        }
        Some(reached)
    }
}

/// What is reached from a function.
#[derive(Default)]
struct ReachedCode {
    /// Bytes of the function and of its parts.
    own: u64,
    /// Bytes of kernels.
    kernels: u64,
    constants: BTreeSet<ConstantPlace>,
}
