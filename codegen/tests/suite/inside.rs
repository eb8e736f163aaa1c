//! What modules of the compiler test of themselves. Those tests stand in the modules, as functions (`mod tests`, feature `internals`): unit tests
//! would be a second build of the compiler.

use std::fs;
use std::path::Path;
use straightline_codegen::internals;

macro_rules! inside {
    ($($module:ident: $($test:ident),+;)+) => {
        $(mod $module {
            $(#[test]
            fn $test() {
                super::internals::$module::$test();
            })+
        })+
    };
}

inside! {
    choices:
        every_word_means_what_it_says,
        an_unknown_word_is_answered_with_the_known_ones,
        a_word_that_is_nearly_known_or_known_elsewhere_is_answered_with_the_one_that_is_meant,
        the_documents_say_proven_of_bounds_and_tested_of_tests;
    description_angle:
        special_angles_have_names,
        table_of_special_angles_agrees_with_the_series,
        right_angles_are_exact_in_every_unit,
        tolerance_zero_takes_radians_literally,
        an_angle_beyond_the_tolerance_is_literal_and_within_it_exact,
        the_angle_of_a_point_is_the_nearest_and_needs_no_library;
    description_geometry: canonical_frames_are_rotations_with_z_along_the_axis, principal_moments_of_a_turned_tensor;
    description_write_rotations: rotations_come_back, right_angles_stay_exact;
    diagnostic_codes: every_code_that_is_said_is_listed_with_its_severity, every_code_has_a_sentence;
    diagnostic_levels:
        the_last_level_counts_and_a_code_before_all_warnings,
        levels_of_nothing_and_of_errors_are_refused,
        every_front_writes_options_its_own_way;
    emit_c99_kernel: a_text_gets_the_sections_that_it_uses_and_no_others;
    emit_c99: what_people_call_things_stays_in_its_comment_and_its_literal;
    emit_rust: a_number_is_a_literal_or_a_constant_of_its_type;
    emit_rust_stubs:
        names_are_found_in_text_that_no_reader_takes,
        without_a_scene_the_functions_are_those_that_are_asked_for;
    function_aliases: functions_are_found_by_what_they_are_called_elsewhere;
    function_quantity: every_quantity_is_found_by_its_name;
    identifier:
        a_name_becomes_an_identifier_whatever_it_is_made_of,
        every_name_is_a_prefix_and_every_prefix_makes_a_package,
        no_reserved_word_is_left_as_an_identifier,
        a_name_cannot_leave_the_comment_it_stands_in;
    options_stable: the_text_is_as_it_was, every_number_and_word_of_a_scene_counts;
    output:
        a_file_is_replaced_whole_and_left_alone_when_it_is_the_same,
        a_file_that_cannot_be_written_leaves_nothing_behind,
        a_package_is_replaced_and_everything_else_stays,
        a_package_that_cannot_be_written_leaves_the_old_one,
        a_list_that_leads_elsewhere_removes_nothing,
        an_input_is_never_written_over,
        a_directory_that_is_not_ours_is_left_alone;
    readback_c99_around: literals_are_read_as_c_reads_them, lines_are_those_with_code;
    readback_c99_tokens: tokens_are_those_of_c;
    readback_packages: every_kind_of_package_has_one_reader;
    readback_tokens: numbers_fields_and_ranges_are_told_apart, what_is_no_text_of_ours_is_refused;
    report_errors: bounds_are_rounded_up;
}

/// The compiler itself does without a reader of Rust.
#[test]
fn a_literal_reads_back_to_the_text() {
    let read = |literal: &str| syn::parse_str::<syn::LitStr>(literal).expect("a literal").value();
    internals::identifier::a_literal_reads_back_to_the_text(read);
}

/// The names of functions of `mod tests` in a folder's files.
fn written(folder: &Path, found: &mut Vec<String>) {
    for entry in fs::read_dir(folder).expect("the folder can be read") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            written(&path, found);
        } else if let Some((_, tests)) = fs::read_to_string(&path).expect("a file").split_once("\npub mod tests {\n") {
            let names = tests.split("\n    pub fn ").skip(1);
            found.extend(names.map(|rest| rest.split('(').next().expect("a name").to_string()));
        }
    }
}

#[test]
fn every_test_inside_is_run_by_its_suite() {
    for (package, least) in [("codegen", 40), ("simulation", 20), ("jit", 1)] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(package);
        let mut found = Vec::new();
        written(&folder.join("src"), &mut found);
        assert!(found.len() >= least, "{package}: {found:?}");
        let suite = fs::read_to_string(folder.join("tests/suite/inside.rs")).expect("the suite runs them");
        let is_run = |name: &String| suite.split(|c: char| !c.is_alphanumeric() && c != '_').any(|word| word == name);
        let forgotten: Vec<_> = found.iter().filter(|name| !is_run(name)).collect();
        assert!(forgotten.is_empty(), "{package}: {forgotten:?} run in no suite");
    }
}
