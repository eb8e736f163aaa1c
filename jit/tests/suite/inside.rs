//! What a module tests of itself. The test stands in the module, as a function (`mod tests`, feature `internals`): a unit test would be a second
//! build of the package.

use straightline_jit::internals;

#[test]
fn without_executable_pages_it_is_interpreted() {
    internals::engine::without_executable_pages_it_is_interpreted();
}
