//! The programs of all functions, on all processors. Every function is optimised by itself; what several need, the choice of a reduced form, is
//! searched by whoever comes first while the others wait ([`Found`](crate::equations::robot::Found)), so that it does not matter who takes which.

use crate::equations::Robot;
use crate::function::Function;
use crate::options::Options;
use crate::program::equivalence::Disagreement;
use crate::program::stored::{accepted, ProgramStore};
use crate::program::{checked, TracedProgram};
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Of a thread: what recurses over a program of some ten thousand operations has to have room.
const STACK: usize = 16 << 20;

/// What programs are looked up in, and the key of a function's program.
pub(super) struct Stored<'a> {
    pub store: &'a dyn ProgramStore,
    pub key: &'a (dyn Fn(Function) -> u64 + Sync),
}

/// One per function, in their order.
///
/// # Errors
/// Of the first function of which no form agrees with its plain equations, what was wrong.
pub(super) fn programs(
    robot: &Robot,
    frames: &[String],
    functions: &[Function],
    options: &Options,
    stored: &Stored<'_>,
) -> Result<Vec<TracedProgram>, Disagreement> {
    let made_or_found = |function: Function| {
        if !stored.store.keeps() {
            return checked(robot, frames, function, options);
        }
        let key = (stored.key)(function);
        let found = stored.store.find(key).and_then(|graph| accepted(robot, frames, function, options, graph));
        if let Some(found) = found {
            return Ok(found);
        }
        let made = checked(robot, frames, function, options)?;
        // what is plainer than it should be is said each time
        if made.plainer.is_none() {
            stored.store.keep(key, &made.graph);
        }
        Ok(made)
    };
    let next = AtomicUsize::new(0);
    let work = || {
        let mut made = Vec::new();
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(function) = functions.get(at) else { return made };
            made.push((at, made_or_found(*function)));
        }
    };
    let mut made = std::thread::scope(|scope| {
        let thread = || std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, work).ok();
        let others: Vec<_> = (1..processors().min(functions.len())).map_while(|_| thread()).collect();
        let mut all = work();
        others.into_iter().for_each(|other| all.extend(other.join().unwrap_or_else(|panic| resume_unwind(panic))));
        all
    });
    made.sort_by_key(|(at, _)| *at);
    made.into_iter().map(|(_, program)| program).collect()
}

fn processors() -> usize {
    // what tests break on purpose is broken on their own thread alone
    #[cfg(feature = "internals")]
    if crate::program::equivalence::sabotage::is_on() {
        return 1;
    }
    std::thread::available_parallelism().map_or(1, usize::from)
}
