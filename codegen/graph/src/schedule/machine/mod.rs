//! What a program takes on a machine of which LLVM's ways are known, before any compiler is run: instructions, bytes, cycles.
//!
//! [`estimate`] makes the instructions of an order ([`lowering`]), gives them registers as LLVM does ([`allocation`]), and counts. Orders are chosen by
//! it; `codegen/tests/suite/estimates.rs` compares it with rustc's objects.

mod allocation;
mod kernels;
mod lowering;

use crate::expr::{Binary, Graph, NodeId, Op};
use allocation::{AllocatedCode, RegisterAllocation};
use kernels::{Kernel, STACK_OF_KERNEL};
use lowering::{lowered, LineClass, LoweredCode};
use std::collections::BTreeSet;

/// What a schedule has to know of a machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScheduleMachine {
    /// How many numbers its registers hold.
    pub registers: usize,
    /// Whether a product and a sum are one instruction, which rounds both.
    pub accumulates: bool,
    /// Whether code runs from flash: then sines are called, and fetching takes time; otherwise they stand in place.
    pub is_in_flash: bool,
    /// Whether angles that stand together, two of them, have their sines by one call.
    pub sines_by_two: bool,
    /// A model of its cycles; none where its manual gives no times of instructions.
    pub cycles: Option<CycleModel>,
}

/// Cycles per instruction. It is a model: instructions wait for nothing but themselves.
///
/// Integers take one cycle, a load or store of n words 1 + n.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CycleModel {
    /// Of an operation of the floating-point unit.
    pub float: f64,
    /// Of a multiply-accumulate.
    pub multiply_accumulate: f64,
    /// Of a division.
    pub division: f64,
    /// Of a square root.
    pub square_root: f64,
    /// More of a jump that is taken, a call, a return.
    pub taken: f64,
    /// Bytes that flash gives in a cycle, to code that is not in its cache.
    pub flash_bytes_per_cycle: f64,
}

/// What a program takes, by a model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct ProgramEstimate {
    /// Instructions of a call, those of the kernel of sines included.
    pub instructions: usize,
    /// Bytes of the function with its constants, without the kernel.
    pub flash_bytes: usize,
    /// Bytes of stack, those of the kernel included.
    pub stack_bytes: usize,
    /// Loads and stores of the function itself.
    pub transfers: usize,
    /// Those among them that values and constants take which have to leave their registers.
    pub waiting: usize,
    /// Cycles; instructions where no manual gives cycles.
    pub cycles: usize,
}

/// Zeros that a function of the compiler's library fills in if there are more together, and the instructions of its call and in it on average (of
/// arrays of 36 to 48 bytes).
const ZEROS: (usize, usize, usize) = (8, 4, 37);
/// How far behind an instruction a constant may lie, in bytes, with what is jumped over.
const REACH: usize = 1040;
/// Words of the stack that a load or store reaches.
const NEAR_WORDS: usize = 256;

/// Of every product of single use the sum that takes it in: of two products of a sum the last one.
pub(in crate::schedule) fn hosts(graph: &Graph, written: &[NodeId], accumulates: bool) -> Vec<Option<NodeId>> {
    let uses = graph.uses();
    let mut host = vec![None; graph.ops.len()];
    for id in written.iter().filter(|_| accumulates) {
        if let Op::Binary(Binary::Add | Binary::Sub, a, b) = graph.op(*id) {
            let is_taken =
                |term: &NodeId| uses[term.index()] == 1 && matches!(graph.op(*term), Op::Binary(Binary::Mul, ..));
            if let Some(product) = [b, a].into_iter().find(is_taken) {
                host[product.index()] = Some(*id);
            }
        }
    }
    host
}

/// What a program takes in an order.
pub fn estimate(graph: &Graph, order: &[NodeId], machine: &ScheduleMachine) -> ProgramEstimate {
    let code = lowered(graph, order, machine);
    let found = RegisterAllocation::of(&code.lines, code.ranges, machine.registers);
    counted(graph, &code, &found, machine)
}

fn counted(graph: &Graph, code: &LoweredCode, found: &AllocatedCode, machine: &ScheduleMachine) -> ProgramEstimate {
    let count = |wanted: &dyn Fn(LineClass) -> bool| code.classes.iter().filter(|class| wanted(**class)).count();
    let floats = count(&|class| class == LineClass::Float) + found.copies;
    let accumulates = count(&|class| class == LineClass::Accumulate);
    let (divisions, roots) = (count(&|class| class == LineClass::Division), count(&|class| class == LineClass::Root));
    let integers = count(&|class| class == LineClass::Integer);
    let elements = count(&|class| matches!(class, LineClass::Load(..) | LineClass::Store(..)));
    let calls = Kernel::ALL.map(|kernel| count(&|class| class == LineClass::Call(kernel)));
    let all_calls: usize = calls.iter().sum();
    let held = count(&|class| class == LineClass::Held).min(found.constants);
    let loaded = found.constants - held;
    let frame = StackFrame::of(graph, code, found);
    // an integer that is zero is stored, two of them at a time
    let filled = code.zeros.iter().filter(|count| **count > ZEROS.0).count();
    let zeros = code.zeros.iter().filter(|count| **count <= ZEROS.0).map(|count| count.div_ceil(2)).sum::<usize>();
    let zeros = zeros + usize::from(zeros > 0) + ZEROS.1 * filled;
    let memory = elements + loaded + found.reloads + found.stores;
    let wide = floats + accumulates + divisions + roots + held + memory;
    let inner = wide + zeros + integers + all_calls + frame.moves;
    let mut bytes = 4 * (wide + zeros + all_calls) + 2 * (integers + frame.moves) + frame.bytes;
    let jumps = bytes / REACH;
    bytes += 4 * jumps + 4 * constants_of(code, bytes / (jumps + 1));
    let of_kernels = |column: usize| {
        calls.iter().zip(Kernel::ALL).map(|(calls, kernel)| calls * kernel.figures()[column]).sum::<usize>()
    };
    let has_calls = all_calls > 0;
    let instructions = inner + frame.instructions + jumps + of_kernels(0) + ZEROS.2 * filled;
    let transfers = memory + frame.transfers;
    let cycles = machine.cycles.map_or(instructions as f64, |model| {
        let all = instructions as f64
            + (accumulates + of_kernels(1)) as f64 * (model.multiply_accumulate - 1.0)
            + floats as f64 * (model.float - 1.0)
            + divisions as f64 * (model.division - 1.0)
            + roots as f64 * (model.square_root - 1.0)
            + (memory + of_kernels(2) + 2 * frame.words) as f64
            + (2 * all_calls + 1 + jumps) as f64 * model.taken;
        match machine.is_in_flash {
            true => all.max((bytes + of_kernels(3)) as f64 / model.flash_bytes_per_cycle),
            false => all,
        }
    });
    ProgramEstimate {
        instructions,
        flash_bytes: bytes,
        stack_bytes: 4 * frame.words + 4 * found.slots + if has_calls { STACK_OF_KERNEL } else { 0 },
        transfers,
        waiting: found.reloads
            + found.stores
            + found.constants.saturating_sub(held + count(&|class| class == LineClass::Loaded)),
        cycles: cycles.round() as usize,
    }
}

/// Constants that lie behind the instructions, those that stand in several places as often.
fn constants_of(code: &LoweredCode, stretch: usize) -> usize {
    let mut found: BTreeSet<(usize, u32)> = BTreeSet::new();
    let mut bits_of = vec![None; code.ranges];
    for (line, bits) in &code.bits {
        if code.classes[*line] == LineClass::Loaded {
            bits_of[code.lines[*line].writes.expect("a constant is written")] = Some(*bits);
        }
    }
    for (k, line) in code.lines.iter().enumerate() {
        let own = line.reads.iter().chain(&line.writes).filter_map(|range| bits_of[*range]);
        found.extend(own.map(|bits| (4 * k / stretch.max(1), bits)));
    }
    found.len()
}

/// What stands before and behind the operations.
#[derive(Default)]
struct StackFrame {
    instructions: usize,
    bytes: usize,
    transfers: usize,
    /// Words that are saved.
    words: usize,
    /// Pointers that are kept across calls.
    moves: usize,
}

impl StackFrame {
    fn of(graph: &Graph, code: &LoweredCode, found: &AllocatedCode) -> StackFrame {
        let first_call = code.classes.iter().position(|class| matches!(class, LineClass::Call(_)));
        let ports = graph.inputs.len() + graph.outputs.len();
        let mut is_kept = vec![false; ports];
        for class in &code.classes[first_call.unwrap_or(code.classes.len())..] {
            if let LineClass::Load(port, _) | LineClass::Store(port, _) = class {
                is_kept[*port] = true;
            }
        }
        let kept = is_kept.iter().filter(|is| **is).count();
        // push, frame pointer, pop
        let mut frame = StackFrame { instructions: 3, bytes: 6, transfers: 2, words: kept + 2, moves: kept };
        let is_aligned = found.saved_pairs > 0 || found.slots > 0;
        // registers above r7 are saved apart, one more where a word is missing to eight bytes
        if kept > 3 || (kept == 3 && is_aligned) {
            frame.instructions += 2;
            frame.bytes += 8;
            frame.transfers += 2;
            frame.words = (kept + 3) / 2 * 2;
        } else if is_aligned {
            frame.words = (kept + 3) / 2 * 2;
        }
        if found.saved_pairs > 0 {
            frame.instructions += 2;
            frame.bytes += 8;
            frame.transfers += 2;
            frame.words += 2 * found.saved_pairs;
        }
        if found.slots > 0 {
            frame.instructions += 2;
            frame.bytes += 4;
        }
        // a word further off takes its address first, where it is stored and where it is loaded
        let far = 2 * found.slots.saturating_sub(NEAR_WORDS);
        frame.instructions += far;
        frame.bytes += 4 * far;
        frame
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::{GraphBuilder, Port, RuleSet, Sines};
    use straightline_core::Dd;

    const FLASH: ScheduleMachine = ScheduleMachine {
        registers: 32,
        accumulates: true,
        is_in_flash: true,
        sines_by_two: false,
        cycles: Some(CYCLES),
    };
    const CYCLES: CycleModel = CycleModel {
        float: 1.0,
        multiply_accumulate: 3.0,
        division: 14.0,
        square_root: 14.0,
        taken: 2.0,
        flash_bytes_per_cycle: 1.6,
    };

    fn inputs(count: usize) -> (GraphBuilder, Vec<NodeId>) {
        let mut b = GraphBuilder::new(RuleSet::all(), vec![Port::new("x", &[count])]);
        let x = (0..count).map(|k| b.insert(Op::Input(k as u32))).collect();
        (b, x)
    }

    fn finished(b: GraphBuilder, results: Vec<NodeId>) -> Graph {
        let port = Port::new("y", &[results.len()]);
        Graph { sines: Sines::Short, ..b.finish(vec![port], results) }
    }

    fn order(graph: &Graph) -> Vec<NodeId> {
        graph.ids().filter(|id| !graph.op(*id).is_leaf()).collect()
    }

    fn estimated(graph: &Graph, machine: ScheduleMachine) -> ProgramEstimate {
        estimate(graph, &order(graph), &machine)
    }

    #[test]
    fn a_sum_with_a_product_is_what_a_person_would_write() {
        let (mut b, x) = inputs(3);
        let product = b.insert(Op::mul(x[0], x[1]));
        let sum = b.insert(Op::add(x[2], product));
        let graph = finished(b, vec![sum]);
        // push, mov r7; three loads, vmla, store; pop
        let found = estimated(&graph, FLASH);
        assert_eq!((found.instructions, found.flash_bytes, found.stack_bytes, found.waiting), (8, 26, 8, 0));
        // 8, two more for the multiply-accumulate, a word each of three loads, a store and two times two, two for the return
        let in_memory = ScheduleMachine { is_in_flash: false, ..FLASH };
        assert_eq!(estimated(&graph, in_memory).cycles, 8 + 2 + 4 + 4 + 2);
        let apart = ScheduleMachine { accumulates: false, ..FLASH };
        assert_eq!(estimated(&graph, apart).instructions, 9);
    }

    #[test]
    fn the_register_of_a_sum_is_copied_if_its_term_is_needed_again() {
        let count = |is_needed_again: bool| {
            let (mut b, x) = inputs(4);
            let first = b.insert(Op::mul(x[0], x[1]));
            let product = b.insert(Op::mul(x[2], x[3]));
            let sum = b.insert(Op::add(first, product));
            let other = if is_needed_again { first } else { x[0] };
            let last = b.insert(Op::mul(x[0], other));
            estimated(&finished(b, vec![sum, last]), FLASH).instructions
        };
        // loads, operations, stores, and what stands around them
        assert_eq!((count(false), count(true)), (4 + 3 + 2 + 3, 4 + 4 + 2 + 3));
    }

    /// Products of neighbours, all made before the first of their sums.
    fn waiting(count: usize, constant: Option<f64>) -> Graph {
        let (mut b, x) = inputs(count + 1);
        let factor = |b: &mut GraphBuilder, k: usize| match constant {
            Some(c) => b.constant(Dd::from(c)),
            None => x[k + 1],
        };
        let products: Vec<NodeId> = (0..count)
            .map(|k| {
                let factor = factor(&mut b, k);
                b.insert(Op::mul(x[k], factor))
            })
            .collect();
        let squares: Vec<NodeId> = products.iter().map(|product| b.insert(Op::mul(*product, *product))).collect();
        finished(b, squares)
    }

    #[test]
    fn what_the_registers_do_not_hold_is_stored_once_and_loaded_once() {
        assert_eq!(estimated(&waiting(30, None), FLASH).waiting, 0);
        for count in [40, 60, 100] {
            let found = estimated(&waiting(count, None), FLASH);
            // as many products as there are registers stay, all but a few that inputs pass through
            let least = 2 * (count - 32);
            assert!((least..=least + 14).contains(&found.waiting), "{count}: {}", found.waiting);
            assert!(found.stack_bytes >= 4 * (count - 32));
        }
    }

    #[test]
    fn words_of_the_stack_out_of_reach_take_their_addresses_first() {
        let each = |few: usize, many: usize| {
            let [few_of, many_of] = [few, many].map(|count| estimated(&waiting(count, None), FLASH).instructions);
            (many_of - few_of) as f64 / (many - few) as f64
        };
        // where it is stored and where it is loaded; and jumps over constants
        let further = each(400, 480) - each(160, 240);
        assert!((1.9..2.2).contains(&further), "{further}");
    }

    #[test]
    fn a_constant_is_made_again_and_never_stored() {
        // the constant is needed at the beginning, and again when all registers have been taken
        let (mut b, x) = inputs(60);
        let c = b.constant(Dd::from(0.3));
        let first = b.insert(Op::mul(x[0], c));
        let others: Vec<NodeId> = (1..40).map(|k| b.insert(Op::mul(x[k], x[k + 1]))).collect();
        let mut sum = first;
        for other in &others {
            let product = b.insert(Op::mul(*other, sum));
            sum = b.insert(Op::add(product, *other));
        }
        let last = b.insert(Op::mul(sum, c));
        let graph = finished(b, vec![last]);
        let code = lowered(&graph, &order(&graph), &FLASH);
        let found = RegisterAllocation::of(&code.lines, code.ranges, 32);
        assert_eq!(found.constants, 2, "{found:?}");
    }

    #[test]
    fn what_a_call_leaves_alone_is_saved_and_what_it_does_not_waits() {
        let graph = |count: usize| {
            let (mut b, x) = inputs(count + 1);
            let products: Vec<NodeId> = (0..count).map(|k| b.insert(Op::mul(x[k], x[k + 1]))).collect();
            let pair = b.insert(Op::SinCos(x[0]));
            let sine = b.insert(Op::Sin(pair));
            let results = products.iter().map(|product| b.insert(Op::mul(*product, sine))).collect();
            finished(b, results)
        };
        let [few, many] = [8, 24].map(|count| estimated(&graph(count), FLASH));
        assert_eq!(few.waiting, 0);
        // even registers first: eight values lie in as many pairs; r4 for the results, r7 and the return address with a word to align; the kernel's own
        assert_eq!(few.stack_bytes, 8 * 8 + 4 * 4 + STACK_OF_KERNEL);
        assert!((16..=20).contains(&many.waiting), "{}", many.waiting);
        // the kernel is counted as often as it is called
        let alone = ScheduleMachine { is_in_flash: false, ..FLASH };
        assert!(estimated(&graph(8), alone).flash_bytes > few.flash_bytes + 100);
    }

    #[test]
    fn sines_that_stand_together_come_by_one_call_of_two() {
        let (mut b, x) = inputs(3);
        let mut results = Vec::new();
        for angle in x {
            let pair = b.insert(Op::SinCos(angle));
            results.extend([Op::Sin(pair), Op::Cos(pair)].map(|half| b.insert(half)));
        }
        let graph = finished(b, results);
        let by_two = ScheduleMachine { sines_by_two: true, ..FLASH };
        let [alone, together] = [FLASH, by_two].map(|machine| estimated(&graph, machine));
        // a call less, and the kernel of two in place of two kernels
        assert!(
            together.instructions < alone.instructions + Kernel::Two.figures()[0] - 2 * Kernel::One.figures()[0],
            "{together:?} {alone:?}"
        );
    }

    #[test]
    fn constants_that_an_instruction_holds_take_no_place_behind_it() {
        let bytes = |c: f64| estimated(&waiting(4, Some(c)), FLASH).flash_bytes;
        for c in [1.0, -0.5, 2.0, 31.0, 0.125, 1.9375] {
            assert_eq!(bytes(0.1) - bytes(c), 4, "{c}");
        }
        for c in [32.0, 0.0625, 1.03125, 1e-3] {
            assert_eq!(bytes(0.1), bytes(c), "{c}");
        }
    }
}
