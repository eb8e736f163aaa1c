//! Passes that are broken on purpose.

use crate::equations::Robot;
use std::cell::RefCell;
use straightline_graph::expr::Graph;

type Break = Box<dyn FnMut(&str, Graph) -> Graph>;
type SabotageForm = Box<dyn FnMut(Robot) -> Robot>;

thread_local! {
    static BREAK: RefCell<Option<Break>> = const { RefCell::new(None) };
    static FORM: RefCell<Option<SabotageForm>> = const { RefCell::new(None) };
}

/// Runs `work` while every chosen form of the robot goes through `broken`.
pub fn with_form<R>(broken: impl FnMut(Robot) -> Robot + 'static, work: impl FnOnce() -> R) -> R {
    FORM.set(Some(Box::new(broken)));
    let done = work();
    FORM.set(None);
    done
}

/// Whether anything is broken on this thread.
pub fn is_on() -> bool {
    BREAK.with_borrow(Option::is_some) || FORM.with_borrow(Option::is_some)
}

pub fn formed(robot: Robot) -> Robot {
    FORM.with_borrow_mut(|b| match b {
        Some(broken) => broken(robot),
        None => robot,
    })
}

/// Runs `work` while what every pass makes goes through `broken`, which is told the name of the pass.
pub fn with<R>(broken: impl FnMut(&str, Graph) -> Graph + 'static, work: impl FnOnce() -> R) -> R {
    BREAK.set(Some(Box::new(broken)));
    let done = work();
    BREAK.set(None);
    done
}

pub fn applied(pass: &str, graph: Graph) -> Graph {
    BREAK.with_borrow_mut(|b| match b {
        Some(broken) => broken(pass, graph),
        None => graph,
    })
}
