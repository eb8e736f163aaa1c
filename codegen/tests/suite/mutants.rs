//! Passes that are broken on purpose; what is broken, and how, stands inside the compiler (`equivalence/mutants.rs`).

use straightline_codegen::internals;

#[test]
fn every_kind_of_program_goes_through_the_passes_that_are_broken() {
    internals::every_kind_of_program_goes_through_the_passes_that_are_broken();
}

#[test]
fn a_broken_pass_never_reaches_the_text() {
    internals::a_broken_pass_never_reaches_the_text();
}

#[test]
#[ignore = "slow proof: hundreds of mutants"]
fn slow_proof_hundreds_of_broken_passes_never_reach_the_text() {
    internals::broken_passes_never_reach_the_text(1);
}

/// `MUTANTS=30 cargo test --release -p straightline-codegen --test suite mutants:: -- --ignored --nocapture`
#[test]
#[ignore = "minutes: thousands of mutants"]
fn thousands_of_broken_passes_never_reach_the_text() {
    let count = std::env::var("MUTANTS").ok().and_then(|x| x.parse().ok());
    internals::broken_passes_never_reach_the_text(count.unwrap_or(20));
}

#[test]
fn robots_as_people_write_them_keep_their_cheapest_form() {
    internals::robots_as_people_write_them_keep_their_cheapest_form();
}

#[test]
fn a_wrong_form_of_the_robot_gives_way_to_a_plainer_one() {
    internals::a_wrong_form_of_the_robot_gives_way_to_a_plainer_one();
}
