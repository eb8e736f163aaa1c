//! The table of bounds itself.

use straightline_generated_tests::bounds::ALL;

#[test]
fn what_was_found_is_within_every_bound() {
    for bound in ALL {
        assert!(0.0 < bound.found && bound.found <= bound.most, "{bound:?}");
        assert!(!bound.why.is_empty(), "{bound:?}");
    }
}
