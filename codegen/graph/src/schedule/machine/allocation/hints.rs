//! Copies: ranges like the registers that they are copied from and to.

use super::{CopySide, RegisterAllocation, RegisterCopy, RegisterCopyState};

impl RegisterAllocation {
    pub(super) fn copied(&mut self, from: CopySide, to: CopySide) -> usize {
        self.copies.push(RegisterCopy { from, to, state: RegisterCopyState::Copy });
        self.copies.len() - 1
    }

    /// The other side of every copy from or to a range.
    fn copies_of(&self, k: usize) -> Vec<CopySide> {
        let copies = self.ranges[k].accesses.iter().filter_map(|access| access.of_copy);
        let copies = copies.map(|copy| self.copies[copy]).filter(|copy| copy.state == RegisterCopyState::Copy);
        copies.map(|copy| if copy.from == CopySide::Live(k) { copy.to } else { copy.from }).collect()
    }

    /// What a range is copied from or to: registers first, then the ranges with the most copies.
    pub(super) fn partners(&self, k: usize) -> Vec<CopySide> {
        let mut found: Vec<(CopySide, usize)> = Vec::new();
        for copy in self.ranges[k].accesses.iter().filter_map(|access| access.of_copy) {
            let RegisterCopy { from, to, state } = self.copies[copy];
            let other = if from == CopySide::Live(k) { to } else { from };
            if state == RegisterCopyState::Copy && other != CopySide::Live(k) {
                match found.iter_mut().find(|(side, _)| *side == other) {
                    Some((_, count)) => *count += 1,
                    None => found.push((other, 1)),
                }
            }
        }
        found.sort_by_key(|(side, count)| match side {
            CopySide::Register(register) => (0, std::cmp::Reverse(*count), usize::from(*register)),
            CopySide::Live(other) => (1, std::cmp::Reverse(*count), *other),
        });
        found.into_iter().map(|(side, _)| side).collect()
    }

    pub(super) fn register_of(&self, side: CopySide) -> Option<u8> {
        match side {
            CopySide::Live(k) => self.ranges[k].register,
            CopySide::Register(register) => Some(register),
        }
    }

    /// The register of the first partner, if it has one.
    pub(super) fn hint(&self, k: usize) -> Option<u8> {
        self.ranges[k].partners.first().and_then(|side| self.register_of(*side))
    }

    /// The registers of all partners.
    pub(super) fn hints(&self, k: usize) -> Vec<u8> {
        let mut hints = Vec::new();
        for register in self.ranges[k].partners.iter().filter_map(|side| self.register_of(*side)) {
            if !hints.contains(&register) {
                hints.push(register);
            }
        }
        hints
    }

    /// Gives the register of a range to those that it is copied from and to, and to theirs, where that leaves no more copies.
    pub(super) fn recolour(&mut self, k: usize) {
        let Some(register) = self.ranges[k].register else { return };
        let (mut seen, mut open) = (vec![k], vec![k]);
        while let Some(k) = open.pop() {
            let Some(current) = self.ranges[k].register else { continue };
            let range = &self.ranges[k];
            if current != register
                && (self.is_blocked(k, register) || self.rivals(register, range.start(), range.end).next().is_some())
            {
                continue;
            }
            let sides: Vec<CopySide> = self.copies_of(k);
            if current != register {
                let broken = |own: u8| sides.iter().filter(|side| self.register_of(**side) != Some(own)).count();
                if broken(current) < broken(register) {
                    continue;
                }
                self.free_register(k);
                self.assign(k, register);
            }
            for side in sides {
                if let CopySide::Live(other) = side {
                    if !seen.contains(&other) {
                        seen.push(other);
                        open.push(other);
                    }
                }
            }
        }
    }
}
