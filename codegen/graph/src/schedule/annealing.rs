//! An order for a machine whose registers are known, by simulated annealing.
//!
//! A step is drawn and put somewhere else between what it takes and what takes it. What is annealed is how many values are alive beyond the
//! registers, summed over the program: that changes in the window between the two places alone. Several searches are made; the last orders of each
//! are judged by what the model of the machine says that they cost ([`estimate`]), and the best one is kept, the one to begin with among them. Work
//! is bounded by the number of moves, random numbers and temperatures are integers, so that the result is the same everywhere.

use super::machine::{estimate, ProgramEstimate, ScheduleMachine};
use super::steps::{kept_by_calls, Steps};
use crate::expr::{Graph, NodeId};

/// Moves per step that a search tries, and in all.
const MOVES: (usize, usize) = (1000, 3_000_000);
/// Searches that are made, and moves in all of them. One alone is off by 1 to 2 % of instructions from another.
const SEARCHES: (usize, usize) = (4, 6_000_000);
/// Into how many stretches a search is cut, and behind how many of the last ones the order is judged.
const STRETCHES: (usize, usize) = (50, 20);
/// Steps of the orders that a search judges, in all: it judges fewer of a long program.
const JUDGED: usize = 60_000;
/// How far a step moves at once.
const FAR: usize = 48;
/// The temperature to begin with, in 1/256 of a value too many, at a chance of one half.
const HOT: i64 = 13 * 256;
/// Registers that constants and intermediate results pass through, left out of the sum.
const MOMENTS: usize = 3;

/// The order of which the model of the machine says that it costs least, if that is less than this one does.
pub(super) fn annealed(graph: &Graph, order: &[NodeId], machine: &ScheduleMachine) -> Option<Vec<NodeId>> {
    let judged = |order: &[NodeId]| estimate(graph, order, machine);
    let steps = Steps::new(graph, order, machine.sines_by_two);
    let start = steps.order(order);
    // text that keeps no order has a call per angle
    let mut first = estimate(graph, order, &ScheduleMachine { sines_by_two: false, ..*machine });
    let mut best = (OrderCost::of(&first, machine), None);
    if machine.sines_by_two {
        let together = steps.nodes(&start);
        let found = judged(&together);
        if OrderCost::of(&found, machine) < best.0 {
            (first, best) = (found, (OrderCost::of(&found, machine), Some(together)));
        }
    }
    if first.waiting == 0 {
        return best.1;
    }
    let judged_behind = STRETCHES.0 - (JUDGED / steps.steps.len()).clamp(1, STRETCHES.1);
    let moves = (MOVES.0 * steps.steps.len()).min(MOVES.1);
    for seed in 0..(SEARCHES.1 / moves.max(1)).clamp(1, SEARCHES.0) {
        let mut search = OrderSearch::new(&steps, start.clone(), machine.registers - MOMENTS, seed as u64);
        for stretch in 0..STRETCHES.0 {
            for k in 0..moves / STRETCHES.0 {
                let left = moves - (stretch * (moves / STRETCHES.0) + k);
                search.step(HOT * left as i64 / moves as i64);
            }
            if stretch >= judged_behind {
                let found = steps.nodes(&search.order);
                let cost = OrderCost::of(&judged(&found), machine);
                if cost < best.0 {
                    best = (cost, Some(found));
                }
            }
        }
    }
    best.1
}

/// What an order is judged by: cycles from memory that takes no time, from flash instructions, of which all take about as many bytes; then stack.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct OrderCost(usize, usize);

impl OrderCost {
    fn of(found: &ProgramEstimate, machine: &ScheduleMachine) -> OrderCost {
        let time = if machine.is_in_flash { found.instructions } else { found.cycles };
        OrderCost(time, found.stack_bytes)
    }
}

struct OrderSearch<'a> {
    steps: &'a Steps,
    registers: isize,
    order: Vec<usize>,
    position: Vec<usize>,
    /// How many values are alive behind each position.
    alive: Vec<isize>,
    /// The same between two places, were a step moved from the one to the other.
    window: Vec<isize>,
    /// Room for the positions behind the last other uses of what a step takes.
    ends: Vec<usize>,
    random: u64,
}

impl<'a> OrderSearch<'a> {
    fn new(steps: &'a Steps, order: Vec<usize>, registers: usize, seed: u64) -> OrderSearch<'a> {
        let mut position = vec![0; order.len()];
        order.iter().enumerate().for_each(|(p, step)| position[*step] = p);
        let alive = alive(steps, &order);
        OrderSearch {
            steps,
            registers: registers as isize,
            order,
            position,
            alive,
            window: Vec::new(),
            ends: Vec::new(),
            random: 0x9E37_79B9_7F4A_7C15u64.wrapping_mul(2 * seed + 1),
        }
    }

    /// Tries one move at a temperature.
    fn step(&mut self, temperature: i64) {
        let count = self.order.len();
        let step = self.below(count);
        let from = self.position[step];
        let first = self.steps.before[step].iter().map(|before| self.position[*before] + 1).max().unwrap_or(0);
        let end = self.steps.behind[step].iter().map(|behind| self.position[*behind]).min().unwrap_or(count);
        let (first, end) = (first.max(from.saturating_sub(FAR)), end.min(from + FAR + 1));
        if end - first < 2 {
            return;
        }
        let to = first + self.below(end - first);
        if to == from {
            return;
        }
        let change = self.change(step, to);
        if change > 0 {
            // −log₂ of a random number between 0 and 1, about, in 1/256
            let random = self.next();
            let zeros = i64::from(random.leading_zeros());
            let fraction = ((random << (zeros + 1).min(63)) >> 56) as i64;
            if change * 65536 >= temperature * (256 * (zeros + 1) - fraction) {
                return;
            }
        }
        let low = from.min(to);
        match from < to {
            true => self.order[from..=to].rotate_left(1),
            false => self.order[to..=from].rotate_right(1),
        }
        for (p, alive) in (low..).zip(&self.window) {
            self.position[self.order[p]] = p;
            self.alive[p] = *alive;
        }
    }

    /// How much is added to the sum, were a step at this place; what is alive then is left in the window.
    fn change(&mut self, step: usize, to: usize) -> i64 {
        let (from, makes) = (self.position[step], self.steps.steps[step].makes.len() as isize);
        // of every value that it takes the position behind its last other use
        let mut ends = std::mem::take(&mut self.ends);
        ends.clear();
        for value in &self.steps.steps[step].values {
            let others = self.steps.users[*value].iter().filter(|user| **user != step);
            let end = others.map(|user| self.position[*user] + 1).max().unwrap_or(0);
            if end <= from.max(to + 1) {
                ends.push(end);
            }
        }
        // values of which nobody else has need behind this position
        let ended = |p: usize| ends.iter().filter(|end| **end <= p + 1).count() as isize;
        self.window.clear();
        let mut change = 0;
        if from < to {
            for p in from + 1..=to {
                self.window.push(self.alive[p] - makes + ended(p));
                change += self.cost(self.order[p], self.window[p - from - 1]);
            }
            self.window.push(self.alive[to]);
            change += self.cost(step, self.alive[to]);
        } else {
            let before = if to > 0 { self.alive[to - 1] } else { 0 };
            let gone = ends.iter().filter(|end| **end <= to).count() as isize;
            self.window.push(before + makes - gone);
            change += self.cost(step, self.window[0]);
            for p in to..from {
                self.window.push(self.alive[p] + makes - ended(p));
                change += self.cost(self.order[p], self.window[p - to + 1]);
            }
        }
        (from.min(to)..=from.max(to)).for_each(|p| change -= self.cost(self.order[p], self.alive[p]));
        self.ends = ends;
        change as i64
    }

    /// How many values are too many at a step, behind which so many are alive.
    fn cost(&self, step: usize, alive: isize) -> isize {
        let step = &self.steps.steps[step];
        let beyond = (alive - self.registers).max(0);
        if !step.is_call {
            return beyond;
        }
        let kept = kept_by_calls(self.registers as usize + MOMENTS - 1) as isize;
        beyond + 2 * (alive - step.makes.len() as isize - kept).max(0)
    }

    fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.next()) * count as u128) >> 64) as usize
    }

    /// xorshift64* (Vigna 2016).
    fn next(&mut self) -> u64 {
        self.random ^= self.random >> 12;
        self.random ^= self.random << 25;
        self.random ^= self.random >> 27;
        self.random.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }
}

/// How many values are alive behind each position.
fn alive(steps: &Steps, order: &[usize]) -> Vec<isize> {
    let mut last = vec![0; steps.users.len()];
    for (p, step) in order.iter().enumerate() {
        steps.steps[*step].values.iter().for_each(|value| last[*value] = p);
    }
    let mut alive = 0;
    let behind = order.iter().enumerate().map(|(p, step)| {
        let step = &steps.steps[*step];
        let ended = step.values.iter().filter(|value| last[**value] == p).count();
        alive += step.makes.len() as isize - ended as isize;
        alive
    });
    behind.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expr::{GraphBuilder, Op, Port, RuleSet, Sines};
    use crate::schedule::{calls_of_two, schedule, ScheduleLimits};

    fn machine(registers: usize) -> ScheduleMachine {
        ScheduleMachine { registers, accumulates: true, is_in_flash: true, sines_by_two: false, cycles: None }
    }

    /// Sums x₀ xₖ + s of neighbours, all made before the first is needed, each twice.
    fn waiting(count: usize) -> (Graph, Vec<NodeId>) {
        let mut b = GraphBuilder::new(RuleSet::all(), vec![Port::new("x", &[count + 2])]);
        let x: Vec<NodeId> = (0..count + 2).map(|k| b.insert(Op::Input(k as u32))).collect();
        let pair = b.add(Op::SinCos(x[1]));
        let (sine, cosine) = (b.add(Op::Sin(pair)), b.add(Op::Cos(pair)));
        let products: Vec<NodeId> = (0..count).map(|k| b.add(Op::mul(x[0], x[k + 2]))).collect();
        let waiting: Vec<NodeId> = products.iter().map(|product| b.add(Op::add(*product, sine))).collect();
        let mut results = Vec::new();
        for two in waiting.windows(2) {
            let turned = b.add(Op::mul(two[0], cosine));
            results.push(b.add(Op::add(turned, two[1])));
        }
        let graph = b.finish(vec![Port::new("y", &[count - 1])], results);
        let is_made = |id: &NodeId| !matches!(graph.op(*id), Op::Input(_) | Op::Constant(_));
        let written = graph.ids().filter(is_made).collect();
        (graph, written)
    }

    #[test]
    fn values_that_wait_are_made_when_they_are_needed_and_operands_come_first() {
        let (graph, written) = waiting(80);
        let waiting = |order: &[NodeId]| estimate(&graph, order, &machine(32)).waiting;
        let found = annealed(&graph, &written, &machine(32)).expect("80 values do not fit into 32 registers");
        assert!(waiting(&written) > 2 * 40, "{}", waiting(&written));
        assert!(waiting(&found) < waiting(&written) - 40, "{} of {}", waiting(&found), waiting(&written));
        let mut placed = vec![false; graph.ops.len()];
        for id in &found {
            let is_there = |a: NodeId| placed[a.index()] || matches!(graph.op(a), Op::Input(_) | Op::Constant(_));
            assert!(graph.op(*id).operands().all(is_there), "{id:?} comes before what it takes");
            assert!(!std::mem::replace(&mut placed[id.index()], true), "{id:?} comes twice");
        }
        assert_eq!(found.len(), written.len());
        assert_eq!(annealed(&graph, &written, &machine(32)), Some(found), "the same every time");
    }

    #[test]
    fn a_program_that_the_registers_hold_stays_as_it_is() {
        let (graph, written) = waiting(12);
        assert_eq!(annealed(&graph, &written, &machine(32)), None);
        assert!(annealed(&graph, &written, &machine(10)).is_some(), "and does not where they hold less");
    }

    /// Angles whose sines are needed one after the other stand together where a call takes two of them.
    #[test]
    fn calls_of_sines_are_joined_by_twos_where_the_machine_has_such_a_call() {
        let mut b = GraphBuilder::new(RuleSet::all(), vec![Port::new("x", &[5])]);
        let x: Vec<NodeId> = (0..5).map(|k| b.insert(Op::Input(k))).collect();
        let mut sum = x[0];
        for angle in &x {
            let pair = b.insert(Op::SinCos(*angle));
            let [sine, cosine] = [Op::Sin(pair), Op::Cos(pair)].map(|half| b.insert(half));
            let product = b.insert(Op::mul(sum, sine));
            sum = b.insert(Op::add(product, cosine));
        }
        let graph = Graph { sines: Sines::Short, ..b.finish(vec![Port::new("y", &[1])], vec![sum]) };
        let calls = |machine: &ScheduleMachine| {
            let made = schedule(&graph, ScheduleLimits::default(), Some(machine));
            let part = &made.parts[0];
            let by_two = calls_of_two(&graph, &part.nodes).into_iter().filter(|takes_next| *takes_next).count();
            (part.sines_by_two, by_two)
        };
        assert_eq!(calls(&machine(32)), (false, 0));
        assert_eq!(calls(&ScheduleMachine { sines_by_two: true, ..machine(32) }), (true, 2));
    }

    #[test]
    fn what_a_move_changes_is_what_counting_again_finds() {
        let (graph, written) = waiting(40);
        let steps = Steps::new(&graph, &written, false);
        let mut search = OrderSearch::new(&steps, steps.order(&written), 8, 0);
        let start = search.alive.clone();
        for k in 0..2000 {
            search.step(HOT);
            assert_eq!(search.alive, alive(&steps, &search.order), "after {k} moves");
        }
        assert_ne!(search.alive, start);
    }
}
