//! What modules test of themselves. Tests stand in the modules, as functions (`mod tests`, feature `internals`): a unit test would be a second
//! build of the package.

use straightline_jit::internals;

#[test]
fn without_executable_pages_it_is_interpreted() {
    internals::engine::without_executable_pages_it_is_interpreted();
}

#[test]
fn numbers_begin_a_line() {
    internals::lines::numbers_begin_a_line();
}
