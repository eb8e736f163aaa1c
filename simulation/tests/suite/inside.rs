//! What modules of the package test of themselves. Those tests stand in the modules, as functions (`mod tests`, feature `internals`): unit tests
//! would be a second build of it.

use straightline_simulation::internals;

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
    advice: digits_are_rounded_away_from_one;
    gains_linear: the_exponential_of_a_turn_is_a_rotation;
    gains_margins:
        at_its_margin_of_gain_a_loop_of_many_joints_has_an_eigenvalue_of_one,
        the_spectral_radius_is_the_greatest_modulus_of_the_eigenvalues;
    motion:
        splines_go_through_their_points_and_are_smooth,
        velocities_and_accelerations_are_derivatives,
        a_trapezoid_is_as_fast_as_its_slowest_joint_and_no_faster,
        what_is_beyond_measure_is_no_motion,
        what_is_no_motion_is_said;
    ode:
        steps_grow_with_the_tolerance_as_the_order_says,
        the_implicit_method_takes_stiff_systems_of_any_size_in_few_steps,
        what_leaves_the_finite_numbers_is_named;
    optimize:
        slopes_are_those_of_differences,
        it_goes_down_into_a_valley_and_to_the_end_of_a_range,
        what_has_no_finite_cost_has_no_optimum;
    panel:
        the_axis_ends_where_the_run_ends_and_says_where,
        marks_next_to_each_other_have_different_numbers,
        a_peak_of_one_sample_among_many_is_seen,
        limits_far_beyond_the_lines_do_not_flatten_them,
        nothing_and_constants_can_be_drawn;
    plot: axes_end_where_the_run_ends_and_names_stand_beside_them;
    quadrature: cubics_on_even_pieces_and_lines_on_all_others_are_exact;
}
