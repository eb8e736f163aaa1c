//! Registers of straight-line code as LLVM gives them: what moves, stores and loads a program takes beside its instructions.
//!
//! The allocator is LLVM's greedy one (`RegAllocGreedy.cpp`), of which a program without branches sees little: live ranges are local to one
//! block, and each is one interval.
//!
//! 1. Ranges longer than two register files are given registers first, the longest of them before the others; then all others in their order.
//! 2. A range takes the first register that is free, or one whose ranges all weigh less, which then lose it. The weight of a range is its uses and
//!    definitions over its length (and 25 instructions more), half of that for a constant.
//! 3. A range that finds none waits for all others, and is split then, around the uses that gain most by a register of their own.
//! 4. What cannot be split is left in memory: stored where it is made, loaded where it is needed; a constant is loaded each time.

mod hints;
mod spill;
mod split;

use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

/// Places between two instructions, for those that are put between them.
const APART: u32 = 1 << 10;
/// Instructions that are added to the length of each range.
const LEEWAY: f32 = 25.0;
/// How much better something has to be (LLVM's hysteresis).
const HYSTERESIS: f32 = 2007.0 / 2048.0;
/// How many ranges one may take a register from.
const MOST_EVICTED: usize = 10;

/// An instruction before registers are given.
#[derive(Clone, Debug, Default)]
pub(super) struct CodeLine {
    /// The ranges that it reads.
    pub reads: Vec<usize>,
    /// The range that it writes, which may be one that it reads: they have the same register then.
    pub writes: Option<usize>,
    /// What it is.
    pub kind: LineKind,
}

/// Instructions that the allocator tells apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum LineKind {
    /// Any other.
    #[default]
    Other,
    /// It makes a constant, which can be made again.
    Constant,
    /// A copy of a range into another.
    Copy,
    /// A copy into the register with this number, for a call.
    Argument(u8),
    /// A copy from the register with this number, behind a call.
    Answer(u8),
    /// A call, which takes so many arguments.
    Call(u8),
}

/// What the allocator adds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct AllocatedCode {
    /// Copies that are left.
    pub copies: usize,
    /// Loads from the stack.
    pub reloads: usize,
    /// Stores to the stack.
    pub stores: usize,
    /// Constants that are made, once or again.
    pub constants: usize,
    /// Words of stack.
    pub slots: usize,
    /// The highest register that a call has to keep and that is used, by pairs.
    pub saved_pairs: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum RangeStage {
    Assign,
    /// It found no register, and waits.
    Split,
    /// It was split into something as long.
    SplitAgain,
    /// It is as short as can be.
    Done,
}

#[derive(Clone, Copy, Debug)]
struct RangeAccess {
    at: u32,
    reads: bool,
    writes: bool,
    /// The copy that it belongs to: of another range of the same value.
    of_copy: Option<usize>,
}

/// A live range.
#[derive(Clone, Debug)]
struct LiveRange {
    /// The value of the program that it is a part of.
    value: usize,
    /// In their order.
    accesses: Vec<RangeAccess>,
    end: u32,
    weight: f32,
    /// What it was copied from or to when it was made: registers first, then the ranges with the most copies.
    partners: Vec<CopySide>,
    stage: RangeStage,
    cascade: u32,
    register: Option<u8>,
}

impl LiveRange {
    fn start(&self) -> u32 {
        self.accesses[0].at
    }

    fn instructions(&self) -> f32 {
        (self.end - self.start()) as f32 / APART as f32
    }
}

/// A range in a register.
#[derive(Clone, Copy, Debug)]
struct HeldRange {
    start: u32,
    end: u32,
    number: usize,
}

/// A copy between ranges of one value, or one of the program.
#[derive(Clone, Copy, Debug)]
struct RegisterCopy {
    from: CopySide,
    to: CopySide,
    state: RegisterCopyState,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum RegisterCopyState {
    /// A copy, if registers differ.
    Copy,
    /// A load.
    Load,
    Gone,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum CopySide {
    Live(usize),
    Register(u8),
}

/// The allocator.
pub(super) struct RegisterAllocation {
    registers: u8,
    ranges: Vec<LiveRange>,
    copies: Vec<RegisterCopy>,
    is_constant: Vec<bool>,
    /// Of every value where it is written.
    versions: Vec<Vec<u32>>,
    is_stored: BTreeSet<(usize, usize)>,
    /// From the first store to the last load of a value.
    in_memory: BTreeMap<usize, (u32, u32)>,
    broken_hints: Vec<usize>,
    /// Of every register its ranges, in order.
    held: Vec<Vec<HeldRange>>,
    /// Of every register where something else is in it, in order: from, to.
    fixed: Vec<Vec<(u32, u32)>>,
    calls: Vec<u32>,
    queue: BinaryHeap<(u32, std::cmp::Reverse<usize>)>,
    next_cascade: u32,
    length: u32,
    found: AllocatedCode,
}

/// Registers that a call leaves as they are: the upper half.
fn is_kept(register: u8, registers: u8) -> bool {
    register >= registers / 2
}

impl RegisterAllocation {
    /// What these instructions take in so many registers, with so many ranges.
    pub fn of(lines: &[CodeLine], ranges: usize, registers: usize) -> AllocatedCode {
        let mut allocation = RegisterAllocation::new(lines, ranges, registers as u8);
        allocation.run();
        allocation.counted()
    }

    fn new(lines: &[CodeLine], ranges: usize, registers: u8) -> RegisterAllocation {
        let range = |value| LiveRange {
            value,
            accesses: Vec::new(),
            end: 0,
            weight: 0.0,
            partners: Vec::new(),
            stage: RangeStage::Assign,
            cascade: 0,
            register: None,
        };
        let mut a = RegisterAllocation {
            registers,
            ranges: (0..ranges).map(range).collect(),
            copies: Vec::new(),
            is_constant: vec![false; ranges],
            versions: vec![Vec::new(); ranges],
            is_stored: BTreeSet::new(),
            in_memory: BTreeMap::new(),
            broken_hints: Vec::new(),
            held: vec![Vec::new(); registers as usize],
            fixed: vec![Vec::new(); registers as usize],
            calls: Vec::new(),
            queue: BinaryHeap::new(),
            next_cascade: 1,
            length: APART * (lines.len() as u32 + 2),
            found: AllocatedCode::default(),
        };
        a.read(lines);
        // what is computed in the register of a constant is none
        (0..ranges).for_each(|k| a.is_constant[k] &= a.versions[k].len() == 1);
        for k in 0..ranges {
            if !a.ranges[k].accesses.is_empty() {
                a.weigh(k);
                a.enqueue(k);
            }
        }
        a
    }

    /// What the lines read and write, and where calls and copies stand.
    fn read(&mut self, lines: &[CodeLine]) {
        let mut arguments = [0; 4];
        let mut answers = 0;
        for (k, line) in lines.iter().enumerate() {
            let at = APART * (k as u32 + 1);
            let mut of_copy = None;
            match line.kind {
                LineKind::Copy => {
                    let to = line.writes.expect("a copy writes");
                    of_copy = Some(self.copied(CopySide::Live(line.reads[0]), CopySide::Live(to)));
                }
                LineKind::Argument(register) => {
                    of_copy = Some(self.copied(CopySide::Live(line.reads[0]), CopySide::Register(register)));
                    arguments[register as usize] = at;
                }
                LineKind::Answer(register) => {
                    let to = line.writes.expect("an answer is taken");
                    of_copy = Some(self.copied(CopySide::Register(register), CopySide::Live(to)));
                    self.fixed[register as usize].push((answers, at));
                }
                LineKind::Call(count) => {
                    (0..count as usize).for_each(|n| self.fixed[n].push((arguments[n], at)));
                    self.calls.push(at);
                    answers = at;
                }
                LineKind::Constant => {
                    self.is_constant[line.writes.expect("a constant is written")] = true;
                    self.found.constants += 1;
                }
                LineKind::Other => {}
            }
            for (n, range) in line.reads.iter().enumerate() {
                if !line.reads[..n].contains(range) {
                    self.ranges[*range].accesses.push(RangeAccess { at, reads: true, writes: false, of_copy });
                    self.ranges[*range].end = at;
                }
            }
            if let Some(range) = line.writes {
                self.versions[range].push(at);
                match self.ranges[range].accesses.last_mut().filter(|access| access.at == at) {
                    Some(access) => access.writes = true,
                    None => self.ranges[range].accesses.push(RangeAccess { at, reads: false, writes: true, of_copy }),
                }
                self.ranges[range].end = at;
            }
        }
    }

    /// The spill weight: accesses over length; without end where nothing could stand between its accesses.
    fn weigh(&mut self, k: usize) {
        self.ranges[k].partners = self.partners(k);
        let range = &self.ranges[k];
        let instructions = range.instructions();
        let is_tiny = range.stage == RangeStage::Done || (instructions <= 1.0 && range.accesses.len() <= 2);
        let uses: usize = range.accesses.iter().map(|a| usize::from(a.reads) + usize::from(a.writes)).sum();
        let half = if self.is_constant[range.value] { 0.5 } else { 1.0 };
        let hinted = if range.accesses.iter().any(|a| a.of_copy.is_some()) { 1.01 } else { 1.0 };
        self.ranges[k].weight =
            if is_tiny { f32::INFINITY } else { uses as f32 * half * hinted / (instructions + LEEWAY) };
    }

    fn enqueue(&mut self, k: usize) {
        let range = &self.ranges[k];
        let length = range.end - range.start();
        let short = length / APART <= 2 * u32::from(self.registers);
        let priority = match range.stage {
            RangeStage::Split => length >> 10,
            RangeStage::Assign if short => (self.length - range.start()) >> 10 | 1 << 31,
            _ => length >> 10 | 1 << 29 | 1 << 31,
        };
        let hinted = u32::from(range.stage != RangeStage::Split && self.hint(k).is_some()) << 30;
        self.queue.push((priority | hinted, std::cmp::Reverse(k)));
    }

    fn run(&mut self) {
        while let Some((_, std::cmp::Reverse(k))) = self.queue.pop() {
            if self.ranges[k].register.is_some() || self.ranges[k].accesses.is_empty() {
                continue;
            }
            if let Some(register) = self.free(k) {
                let first = self.ranges[k].partners.first().copied();
                if matches!(first, Some(CopySide::Register(hint)) if hint != register) {
                    self.broken_hints.push(k);
                }
                self.assign(k, register);
                continue;
            }
            if self.ranges[k].stage != RangeStage::Split {
                if let Some(register) = self.cheapest(k) {
                    self.evict(k, register);
                    if self.ranges[k].partners.first().is_some_and(|side| *side != CopySide::Register(register)) {
                        self.broken_hints.push(k);
                    }
                    self.assign(k, register);
                    continue;
                }
                if self.ranges[k].stage < RangeStage::Split {
                    self.ranges[k].stage = RangeStage::Split;
                    self.enqueue(k);
                    continue;
                }
            }
            if self.ranges[k].stage == RangeStage::Done {
                // more values at once than registers: the model ends here, and counts what it can
                continue;
            }
            if !self.split(k) {
                self.spill(k);
            }
        }
        for k in std::mem::take(&mut self.broken_hints) {
            self.recolour(k);
        }
    }

    /// Registers in the order in which they are tried: those that calls use first, even ones first.
    fn order(&self, k: usize) -> impl Iterator<Item = u8> {
        let half = self.registers / 2;
        let of = move |low: u8| (low..low + half).step_by(2).chain((low + 1..low + half).step_by(2));
        let hints = self.hints(k);
        let others = of(0).chain(of(half));
        hints.clone().into_iter().chain(others.filter(move |register| !hints.contains(register)))
    }

    /// Whether a register holds something else than ranges while this one lives, or a call takes it.
    fn is_blocked(&self, k: usize, register: u8) -> bool {
        let (start, end) = (self.ranges[k].start(), self.ranges[k].end);
        if !is_kept(register, self.registers) {
            let next = self.calls.partition_point(|call| *call <= start);
            if self.calls.get(next).is_some_and(|call| *call < end) {
                return true;
            }
        }
        let fixed = &self.fixed[register as usize];
        let next = fixed.partition_point(|(_, to)| *to <= start);
        fixed.get(next).is_some_and(|(from, _)| *from < end)
    }

    /// The ranges in a register that live while another does.
    fn rivals(&self, register: u8, start: u32, end: u32) -> impl Iterator<Item = usize> + '_ {
        let held = &self.held[register as usize];
        let behind = held.partition_point(|range| range.start <= start);
        let first = behind - usize::from(behind > 0 && held[behind - 1].end > start);
        held[first..].iter().take_while(move |range| range.start < end.max(start + 1)).map(|range| range.number)
    }

    fn free(&self, k: usize) -> Option<u8> {
        let (start, end) = (self.ranges[k].start(), self.ranges[k].end);
        self.order(k)
            .find(|register| !self.is_blocked(k, *register) && self.rivals(*register, start, end).next().is_none())
    }

    fn assign(&mut self, k: usize, register: u8) {
        let (start, end) = (self.ranges[k].start(), self.ranges[k].end);
        let held = &mut self.held[register as usize];
        let place = held.partition_point(|range| range.start < start);
        held.insert(place, HeldRange { start, end, number: k });
        self.ranges[k].register = Some(register);
    }

    /// The register that costs least to take from lighter ranges.
    fn cheapest(&self, k: usize) -> Option<u8> {
        let range = &self.ranges[k];
        let (start, end) = (range.start(), range.end);
        let cascade = if range.cascade == 0 { self.next_cascade } else { range.cascade };
        let is_urgent = |other: &LiveRange| range.weight.is_infinite() && other.weight.is_finite();
        let mut best: Option<((u32, f32), u8)> = None;
        let hints = self.hints(k);
        for register in self.order(k).filter(|register| !self.is_blocked(k, *register)) {
            let (mut broken, mut heaviest) = (0, 0.0f32);
            let mut can = true;
            let is_hint = hints.contains(&register);
            for (n, other) in self.rivals(register, start, end).enumerate() {
                let breaks = self.hint(other).is_some_and(|hint| self.ranges[other].register == Some(hint));
                let other = &self.ranges[other];
                can &= n < MOST_EVICTED && other.stage != RangeStage::Done && cascade != other.cascade;
                if cascade < other.cascade {
                    can &= is_urgent(other);
                    broken += 10;
                }
                broken += u32::from(breaks);
                heaviest = heaviest.max(other.weight);
                let is_heavier = range.weight > other.weight || (is_hint && !breaks);
                can &= is_urgent(other) || is_heavier;
                if !can || best.is_some_and(|(least, _)| (broken, heaviest) >= least) {
                    can = false;
                    break;
                }
            }
            if can {
                best = Some(((broken, heaviest), register));
                if is_hint {
                    break;
                }
            }
        }
        best.map(|(_, register)| register)
    }

    fn evict(&mut self, k: usize, register: u8) {
        if self.ranges[k].cascade == 0 {
            self.ranges[k].cascade = self.next_cascade;
            self.next_cascade += 1;
        }
        let (start, end, cascade) = (self.ranges[k].start(), self.ranges[k].end, self.ranges[k].cascade);
        for other in self.rivals(register, start, end).collect::<Vec<_>>() {
            self.free_register(other);
            self.ranges[other].cascade = cascade;
            self.enqueue(other);
        }
    }

    fn free_register(&mut self, k: usize) {
        if let Some(register) = self.ranges[k].register.take() {
            self.held[register as usize].retain(|range| range.number != k);
        }
    }

    fn counted(mut self) -> AllocatedCode {
        let is_left = |copy: &&RegisterCopy| {
            copy.state == RegisterCopyState::Copy && self.register_of(copy.from) != self.register_of(copy.to)
        };
        let copies = self.copies.iter().filter(is_left);
        let copies = copies.count();
        self.found.copies = copies;
        let half = usize::from(self.registers / 2);
        let highest = (half..2 * half)
            .rev()
            .find(|register| self.ranges.iter().any(|range| range.register == Some(*register as u8)));
        self.found.saved_pairs = highest.map_or(0, |register| (register - half) / 2 + 1);
        let mut changes: Vec<(u32, i32)> =
            self.in_memory.values().flat_map(|(start, end)| [(*start, 1), (end + 1, -1)]).collect();
        changes.sort_unstable();
        let mut alive = 0;
        for (_, change) in changes {
            alive += change;
            self.found.slots = self.found.slots.max(alive as usize);
        }
        self.found
    }
}
