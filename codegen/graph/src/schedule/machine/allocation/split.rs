//! Splitting a range around the uses that gain most by a register of their own (`RAGreedy::tryLocalSplit`).

use super::{is_kept, CopySide, LiveRange, RangeAccess, RangeStage, RegisterAllocation, APART, HYSTERESIS, LEEWAY};

impl RegisterAllocation {
    /// Splits a range around those of its uses that gain most by a register; whether that was possible.
    pub(super) fn split(&mut self, k: usize) -> bool {
        let range = &self.ranges[k];
        let uses: Vec<u32> = range.accesses.iter().map(|access| access.at).collect();
        if uses.len() <= 2 {
            return false;
        }
        let gaps = uses.len() - 1;
        let has_progress = range.stage >= RangeStage::SplitAgain;
        let mut best = (gaps, 0, 0.0f32);
        for register in self.order(k) {
            let weights = self.gap_weights(register, &uses);
            let (mut before, mut after) = (0, 1);
            let mut heaviest = weights[0];
            loop {
                let (is_before, is_after) = (before != 0, after != gaps);
                if !is_before && !is_after {
                    break;
                }
                let mut shrinks = true;
                let inside = usize::from(is_before) + after - before + usize::from(is_after);
                if (!has_progress || inside < gaps) && heaviest.is_finite() {
                    let length = (uses[after] - uses[before]) as f32 / APART as f32;
                    let around = f32::from(u8::from(is_before) + u8::from(is_after));
                    let weight = (inside + 1) as f32 / (length + around + LEEWAY);
                    if weight * HYSTERESIS >= heaviest {
                        shrinks = false;
                        if weight - heaviest > best.2 {
                            best = (before, after, HYSTERESIS * (weight - heaviest));
                        }
                    }
                }
                if shrinks {
                    before += 1;
                    if before < after {
                        if weights[before - 1] >= heaviest {
                            heaviest = weights[before..after].iter().copied().fold(0.0, f32::max);
                        }
                        continue;
                    }
                    heaviest = 0.0;
                }
                if after >= gaps {
                    break;
                }
                heaviest = heaviest.max(weights[after]);
                after += 1;
            }
        }
        let (before, after, _) = best;
        if before == gaps {
            return false;
        }
        self.cut(k, before, after);
        true
    }

    /// Of every gap between uses the weight that would lose this register.
    fn gap_weights(&self, register: u8, uses: &[u32]) -> Vec<f32> {
        let mut weights = vec![0.0f32; uses.len() - 1];
        let (start, end) = (uses[0], uses[uses.len() - 1]);
        // gaps that something from one place to another lies in
        let gaps = |from: u32, to: u32| {
            let first = uses.partition_point(|at| *at <= from).saturating_sub(1);
            first..uses.partition_point(|at| *at < to).min(uses.len() - 1)
        };
        for other in self.rivals(register, start, end) {
            let other = &self.ranges[other];
            gaps(other.start(), other.end).for_each(|gap| weights[gap] = weights[gap].max(other.weight));
        }
        let fixed = self.fixed[register as usize].iter().filter(|(from, to)| *to > start && *from < end);
        fixed.for_each(|(from, to)| weights[gaps(*from, *to)].fill(f32::INFINITY));
        if !is_kept(register, self.registers) {
            let calls = self.calls.iter().filter(|call| **call > start && **call < end);
            calls.for_each(|call| weights[gaps(*call, *call + 1)].fill(f32::INFINITY));
        }
        weights
    }

    /// Makes ranges of their own of the uses up to `before`, from there to `after`, and from there on.
    fn cut(&mut self, k: usize, before: usize, after: usize) {
        let range = self.ranges[k].clone();
        let gaps = range.accesses.len() - 1;
        let (is_before, is_after) = (before != 0, after != gaps);
        let inside = usize::from(is_before) + after - before + usize::from(is_after);
        let mut parts = [
            range.accesses[..before].to_vec(),
            range.accesses[before..=after].to_vec(),
            range.accesses[after + 1..].to_vec(),
        ];
        // the range itself is no more
        self.ranges[k].accesses.clear();
        let first = self.ranges.len();
        let middle = first + usize::from(is_before);
        let last = middle + 1;
        if is_before {
            let at = self.between(range.accesses[before - 1].at, range.accesses[before].at, true);
            let copy = self.copied(CopySide::Live(first), CopySide::Live(middle));
            parts[0].push(RangeAccess { at, reads: true, writes: false, of_copy: Some(copy) });
            parts[1].insert(0, RangeAccess { at, reads: false, writes: true, of_copy: Some(copy) });
        }
        if is_after {
            let at = self.between(range.accesses[after].at, range.accesses[after + 1].at, false);
            let copy = self.copied(CopySide::Live(middle), CopySide::Live(last));
            parts[1].push(RangeAccess { at, reads: true, writes: false, of_copy: Some(copy) });
            parts[2].insert(0, RangeAccess { at, reads: false, writes: true, of_copy: Some(copy) });
        }
        let places = [(first, is_before), (middle, true), (last, is_after)];
        let made: Vec<usize> = places.iter().filter(|(_, is_there)| *is_there).map(|(place, _)| *place).collect();
        for (accesses, (place, _)) in parts.into_iter().zip(places).filter(|(_, (_, is_there))| *is_there) {
            let of_part = LiveRange {
                end: accesses.last().expect("a part is used").at,
                accesses,
                stage: if place == middle && inside >= gaps { RangeStage::SplitAgain } else { RangeStage::Assign },
                register: None,
                cascade: 0,
                ..range.clone()
            };
            self.ranges.push(of_part);
            self.rename(place);
        }
        for place in made {
            self.weigh(place);
            self.enqueue(place);
        }
    }

    /// Copies of the program name the range that takes part in them.
    fn rename(&mut self, place: usize) {
        for access in &self.ranges[place].accesses {
            if let Some(copy) = access.of_copy {
                let copy = &mut self.copies[copy];
                if access.reads && !access.writes {
                    copy.from = CopySide::Live(place);
                } else {
                    copy.to = CopySide::Live(place);
                }
            }
        }
    }

    /// A place for an instruction right before the later one of two, or right behind the earlier one.
    pub(super) fn between(&self, first: u32, second: u32, late: bool) -> u32 {
        let far = (second - first).min(APART) / 2;
        if late {
            second - far
        } else {
            first + far
        }
    }
}
