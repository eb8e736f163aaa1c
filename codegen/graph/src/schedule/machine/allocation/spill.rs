//! Ranges that are left in memory (`InlineSpiller.cpp`).

use super::{CopySide, LiveRange, RangeAccess, RangeStage, RegisterAllocation, RegisterCopy, RegisterCopyState, APART};

impl RegisterAllocation {
    /// Leaves a range in memory, and with it those of the same value that have one use beside copies from and to it.
    pub(super) fn spill(&mut self, k: usize) {
        let mut all = vec![k];
        for side in self.partners(k) {
            if let CopySide::Live(other) = side {
                if self.is_snippet(other, k) {
                    all.push(other);
                }
            }
        }
        for range in all.clone() {
            self.free_register(range);
            let accesses = std::mem::take(&mut self.ranges[range].accesses);
            let value = self.ranges[range].value;
            for (n, access) in accesses.iter().enumerate() {
                let before = if n > 0 { accesses[n - 1].at } else { access.at.saturating_sub(APART) };
                match access.of_copy {
                    Some(copy) => self.spill_copy(copy, value, access, &all),
                    None => self.spill_access(value, access, before),
                }
            }
        }
    }

    fn is_snippet(&self, other: usize, of: usize) -> bool {
        let range = &self.ranges[other];
        let is_own = |access: &&RangeAccess| {
            access.of_copy.is_some_and(|copy| {
                let RegisterCopy { from, to, .. } = self.copies[copy];
                [from, to].contains(&CopySide::Live(of))
            })
        };
        range.value == self.ranges[of].value
            && range.stage != RangeStage::Done
            && range.accesses.len() - range.accesses.iter().filter(is_own).count() <= 1
    }

    /// What becomes of a copy one side of which is in memory.
    fn spill_copy(&mut self, copy: usize, value: usize, access: &RangeAccess, all: &[usize]) {
        let RegisterCopy { from, to, state } = self.copies[copy];
        let is_spilled = |side: CopySide| matches!(side, CopySide::Live(k) if all.contains(&k));
        if is_spilled(from) && is_spilled(to) {
            self.copies[copy].state = RegisterCopyState::Gone;
            return;
        }
        if access.reads {
            // a load into the other side
            self.copies[copy].state = RegisterCopyState::Load;
            self.load(value, access.at);
            return;
        }
        self.copies[copy].state = RegisterCopyState::Gone;
        if state == RegisterCopyState::Load {
            *(if self.is_constant[value] { &mut self.found.constants } else { &mut self.found.reloads }) -= 1;
            return;
        }
        if !self.is_constant[value] {
            self.store(value, access.at);
        }
        if matches!(from, CopySide::Live(k) if self.ranges[k].value == value) {
            self.is_copied_no_more(copy);
        }
    }

    fn spill_access(&mut self, value: usize, access: &RangeAccess, before: u32) {
        if access.writes && !access.reads && self.is_constant[value] {
            self.found.constants = self.found.constants.saturating_sub(1);
            return;
        }
        if access.reads {
            self.load(value, access.at);
            let at = self.between(before, access.at, true);
            self.add_tiny(value, vec![RangeAccess { at, reads: false, writes: true, of_copy: None }, *access]);
        } else {
            let at = access.at + APART / 2;
            self.add_tiny(value, vec![*access, RangeAccess { at, reads: true, writes: false, of_copy: None }]);
        }
        if access.writes {
            self.store(value, access.at);
        }
    }

    /// The range that a copy was made from ends earlier.
    fn is_copied_no_more(&mut self, copy: usize) {
        let CopySide::Live(from) = self.copies[copy].from else { return };
        let register = self.ranges[from].register;
        self.free_register(from);
        let range = &mut self.ranges[from];
        range.accesses.retain(|access| access.of_copy != Some(copy));
        let Some(end) = range.accesses.last().map(|access| access.at) else { return };
        range.end = end;
        self.weigh(from);
        if let Some(register) = register {
            self.assign(from, register);
        }
    }

    fn load(&mut self, value: usize, at: u32) {
        match self.is_constant[value] {
            true => self.found.constants += 1,
            false => self.found.reloads += 1,
        }
        if let Some((_, end)) = self.in_memory.get_mut(&value) {
            *end = at.max(*end);
        } else if !self.is_constant[value] {
            self.in_memory.insert(value, (at, at));
        }
    }

    /// What is computed is stored once.
    fn store(&mut self, value: usize, at: u32) {
        let version = self.versions[value].partition_point(|written| *written <= at);
        if self.is_stored.insert((value, version)) {
            self.found.stores += 1;
        }
        let (start, _) = self.in_memory.entry(value).or_insert((at, at));
        *start = at.min(*start);
    }

    fn add_tiny(&mut self, value: usize, accesses: Vec<RangeAccess>) {
        let k = self.ranges.len();
        let end = accesses[accesses.len() - 1].at;
        self.ranges.push(LiveRange {
            value,
            accesses,
            end,
            weight: f32::INFINITY,
            partners: Vec::new(),
            stage: RangeStage::Done,
            cascade: 0,
            register: None,
        });
        self.enqueue(k);
    }
}
