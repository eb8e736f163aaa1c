//! Stress: where rounding errors grow, and where they must not.
//!
//! Twenty-four tests, after the list of what breaks dynamics codes (singular and stretched chains, light and heavy tips, huge
//! angles and speeds, subnormal numbers, a million steps ...). Every outcome is held against a bound; the bounds are two to ten
//! times what the full sizes gave, so that another compiler or processor does not trip them, and a lost digit does.
//!
//! The samples here are small. The full sizes, and the table in `record/`, are made by
//! `cargo test --release -p straightline-generated-tests --test suite stress::record -- --ignored --nocapture`.

mod angles;
mod chains;
mod contacts;
mod derivatives;
mod drives;
mod forms;
mod machines;
mod motion;
mod outcome;
mod precision;
mod robots;
mod round_trips;
mod search;
mod zero_inertia;

use outcome::{judge, Outcome, Size};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Mutex;

type Suite = fn(Size) -> Vec<Outcome>;

/// All tests that apply to what exists, in the order of the list.
const SUITES: [Suite; 23] = [
    round_trips::inverse_then_forward,
    round_trips::gravity_compensation,
    chains::uniform,
    chains::stretched_and_folded,
    chains::light_tips,
    chains::heavy_tips,
    zero_inertia::demands,
    chains::nearly_parallel_axes,
    angles::large_and_near_right_angles,
    angles::speeds,
    precision::single_against_double,
    motion::energy_and_momentum,
    motion::damping,
    contacts::redundant,
    contacts::next_to_singular,
    contacts::closed_loop,
    contacts::stacks,
    drives::motors_and_transmissions,
    forms::lanes,
    forms::any_scalar,
    derivatives::derivatives,
    search::worst_inverse_dynamics,
    search::random_arms,
];

/// Suites that run at the same time where the table is made.
const THREADS: usize = 4;

macro_rules! small {
    ($($(#[$doc:meta])* $name:ident = $suite:path;)*) => {
        $(
            $(#[$doc])*
            #[test]
            fn $name() {
                judge(&$suite(Size::Small));
            }
        )*
    };
}

small! {
    forward_after_inverse_dynamics_gives_the_accelerations_back = round_trips::inverse_then_forward;
    gravity_compensation_holds_every_robot_still = round_trips::gravity_compensation;
    articulated_bodies_keep_their_digits_on_long_chains = chains::uniform;
    stretched_and_folded_chains_cost_the_factorisation_digits_and_articulated_bodies_none = chains::stretched_and_folded;
    light_tips_cost_nothing = chains::light_tips;
    heavy_tips_cost_no_more_than_their_weight = chains::heavy_tips;
    joints_without_inertia_are_refused_and_rotors_heal_them = zero_inertia::demands;
    nearly_parallel_axes_cost_nothing = chains::nearly_parallel_axes;
    large_angles_and_right_angles_keep_their_digits = angles::large_and_near_right_angles;
    huge_and_tiny_speeds_keep_their_digits = angles::speeds;
    single_precision_loses_its_own_rounding_only = precision::single_against_double;
    energy_and_momentum_stay = motion::energy_and_momentum;
    stiff_dampers_never_add_energy = motion::damping;
    redundant_contacts_share_their_load = contacts::redundant;
    constraints_next_to_singular_have_finite_reactions = contacts::next_to_singular;
    closed_loops_stay_closed = contacts::closed_loop;
    stacks_carry_their_weight_whatever_the_ratio_of_masses = contacts::stacks;
    motors_and_transmissions_keep_their_digits = drives::motors_and_transmissions;
    lanes_and_batches_keep_the_bits_of_hard_states = forms::lanes;
    any_scalar_gives_its_own_digits = forms::any_scalar;
    derivatives_keep_their_digits = derivatives::derivatives;
    the_worst_inverse_dynamics_found_is_a_few_ulp = search::worst_inverse_dynamics;
    the_worst_inverse_dynamics_of_random_arms_stays_small = search::random_arms;
}

#[test]
fn instruction_sets_and_flushed_subnormals_change_nothing_that_matters() {
    judge(&machines::this_machine(Size::Small));
}

/// Needs a toolchain for the microcontroller; `STRAIGHTLINE_CORTEX_M` names its folder, see [`machines::microcontroller`].
#[test]
#[ignore = "needs a cross toolchain and an emulator"]
fn a_microcontroller_computes_the_same_bits() {
    let toolchain = std::env::var_os("STRAIGHTLINE_CORTEX_M").expect("STRAIGHTLINE_CORTEX_M names a folder");
    judge(&machines::microcontroller(std::path::Path::new(&toolchain)));
}

#[test]
#[ignore = "the full sizes: fifteen minutes of a core in release; writes the table to record/"]
fn record() {
    let start = std::time::Instant::now();
    let (outcomes, next) = (Mutex::new(Vec::new()), AtomicUsize::new(0));
    let toolchain = std::env::var_os("STRAIGHTLINE_CORTEX_M");
    std::thread::scope(|scope| {
        let work = || loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            // the longest first
            let new = match SUITES.iter().rev().nth(number) {
                Some(suite) => suite(Size::Full),
                None if number == SUITES.len() => machines::this_machine(Size::Full),
                None => break,
            };
            let mut outcomes = outcomes.lock().expect("no suite panics");
            outcomes.push((number, new));
            println!("{} suites after {:.0} s", outcomes.len(), start.elapsed().as_secs_f64());
        };
        (0..THREADS).for_each(|_| drop(scope.spawn(work)));
        if let Some(toolchain) = &toolchain {
            let new = machines::microcontroller(std::path::Path::new(toolchain));
            outcomes.lock().expect("no suite panics").push((SUITES.len() + 1, new));
        }
    });
    let mut outcomes = outcomes.into_inner().expect("no suite panics");
    outcomes.sort_by_key(|(number, _)| std::cmp::Reverse(*number));
    let mut outcomes: Vec<Outcome> = outcomes.into_iter().flat_map(|(_, new)| new).collect();
    outcome::write_record(&mut outcomes);
    judge(&outcomes);
}
