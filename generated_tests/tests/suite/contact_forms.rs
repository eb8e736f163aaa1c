//! Contact functions in all the forms that functions of a robot have: in any scalar, over lanes and batches, fused.

use straightline::Dd;
use straightline_generated_tests::compiled::{contact_planar2r, contact_planar2r_fused, contact_planar2r_generic};
use straightline_generated_tests::random::Random;

/// q, q̇, τ; pose, velocity and acceleration of the surface.
const INPUTS: [usize; 6] = [2, 2, 2, 12, 6, 6];
/// q̈, reaction, s̈, violation, pivot.
const OUTPUTS: [usize; 5] = [2, 1, 1, 1, 1];

/// A state of robot and surface, one input after the other.
#[derive(Clone)]
struct State([Vec<f64>; 6]);

impl State {
    fn new(random: &mut Random) -> State {
        let mut inputs = INPUTS.map(|n| random.list(n, 2.0));
        // origin, then the axes of a frame that is turned about y, x and z
        let [(sa, ca), (sb, cb), (sc, cc)] = [0.7, -0.4, 1.9].map(|a: f64| (a + random.between(0.0, 0.3)).sin_cos());
        let axes = [
            [ca * cc + sa * sb * sc, cb * sc, ca * sb * sc - sa * cc],
            [sa * sb * cc - ca * sc, cb * cc, sa * sc + ca * sb * cc],
            [sa * cb, -sb, ca * cb],
        ];
        inputs[3][3..].copy_from_slice(axes.as_flattened());
        State(inputs)
    }

    fn array<T: Copy, const N: usize>(&self, k: usize, of: impl Fn(f64) -> T) -> [T; N] {
        let values: Vec<T> = self.0[k].iter().map(|x| of(*x)).collect();
        values.try_into().ok().expect("as many as the function takes")
    }

    fn rows<T: Copy, const N: usize>(&self, k: usize, of: impl Fn(f64) -> T) -> [[T; 3]; N] {
        std::array::from_fn(|row| std::array::from_fn(|i| of(self.0[k][3 * row + i])))
    }
}

/// The results of a contact's forward dynamics, one after the other.
macro_rules! forward_dynamics {
    ($module:ident, $state:expr, $of:expr) => {{
        let (state, of) = (&$state, $of);
        let zero = of(0.0);
        let (mut qdd, mut f, mut sdd, mut violation, mut pivot) = ([zero; 2], [zero], [zero], [zero], [zero]);
        $module::contact::surface::forward_dynamics(
            &state.array(0, of),
            &state.array(1, of),
            &state.array(2, of),
            &state.rows(3, of),
            &state.rows(4, of),
            &state.rows(5, of),
            &mut qdd,
            &mut f,
            &mut sdd,
            &mut violation,
            &mut pivot,
        );
        [&qdd[..], &f, &sdd, &violation, &pivot].concat()
    }};
}

fn states(n: usize) -> Vec<State> {
    let mut random = Random(29);
    (0..n).map(|_| State::new(&mut random)).collect()
}

#[test]
fn generic_ones_give_the_bits_of_the_plain_ones_and_double_double_refines_them() {
    for state in states(200) {
        let plain = forward_dynamics!(contact_planar2r, state, |x: f64| x);
        let generic = forward_dynamics!(contact_planar2r_generic, state, |x: f64| x);
        assert_eq!(plain, generic);
        let wide = forward_dynamics!(contact_planar2r_generic, state, Dd::from);
        let scale = wide.iter().fold(1.0, |most: f64, x| most.max(x.to_f64().abs()));
        let worst = plain.iter().zip(&wide).map(|(x, y)| (Dd::from(*x) - *y).to_f64().abs()).fold(0.0, f64::max);
        // what is asked of contact: the pivot says how far a state is from redundant constraints
        let pivot = plain[5];
        assert!(worst > 0.0 && worst <= 1e-13 * scale / pivot, "{worst:e} of {scale:e}, pivot {pivot:e}");
    }
}

#[test]
fn the_generic_dispatch_calls_its_mode() {
    use contact_planar2r_generic::contact::{self, Mode, MOST_CONSTRAINED};
    let state = &states(1)[0];
    let of = |x: f64| x;
    let (mut qdd, mut force) = ([0.0; 2], [0.0; MOST_CONSTRAINED]);
    let arrays = (state.array(0, of), state.array(1, of), state.array(2, of));
    let (pose, velocity, acceleration) = (state.rows(3, of), state.rows(4, of), state.rows(5, of));
    let pivot = contact::forward_dynamics(
        Mode::Surface,
        &arrays.0,
        &arrays.1,
        &arrays.2,
        &pose,
        &velocity,
        &acceleration,
        &mut qdd,
        &mut force,
    );
    let expected = forward_dynamics!(contact_planar2r, state, of);
    assert_eq!((&qdd[..], force[0], pivot), (&expected[..2], expected[2], expected[5]));
}

/// Every state of a batch has the bits that `one` gives it alone.
macro_rules! batches_agree {
    ($module:ident, $one:expr, [$($soa:ident),*], [$($aos:ident),*]) => {
        for n in [0, 1, 3, 8, 17, 100] {
            let states = states(n);
            let expected: Vec<Vec<f64>> = states.iter().map($one).collect();
            let rows = |k: usize| -> Vec<f64> { states.iter().flat_map(|s| s.0[k].iter().copied()).collect() };
            let columns = |k: usize| -> Vec<f64> {
                (0..INPUTS[k]).flat_map(|c| states.iter().map(move |s| s.0[k][c])).collect()
            };
            let fresh = || OUTPUTS.map(|m| vec![f64::NAN; m * n]);
            $({
                let (x, mut y) = ([0, 1, 2, 3, 4, 5].map(columns), fresh());
                let [a, b, c, d, e] = &mut y;
                let done = $module::contact::surface::$soa(n, &x[0], &x[1], &x[2], &x[3], &x[4], &x[5], a, b, c, d, e);
                done.expect("arrays of n states");
                for (s, expected) in expected.iter().enumerate() {
                    let found = OUTPUTS.iter().zip(&y).flat_map(|(m, y)| (0..*m).map(move |i| y[i * n + s]));
                    assert_eq!(found.collect::<Vec<f64>>(), *expected, "{} of {n}", stringify!($soa));
                }
            })*
            $({
                let (x, mut y) = ([0, 1, 2, 3, 4, 5].map(rows), fresh());
                let [a, b, c, d, e] = &mut y;
                let done = $module::contact::surface::$aos(n, &x[0], &x[1], &x[2], &x[3], &x[4], &x[5], a, b, c, d, e);
                done.expect("arrays of n states");
                for (s, expected) in expected.iter().enumerate() {
                    let found = OUTPUTS.iter().zip(&y).flat_map(|(m, y)| y[s * m..(s + 1) * m].iter().copied());
                    assert_eq!(found.collect::<Vec<f64>>(), *expected, "{} of {n}", stringify!($aos));
                }
            })*
        }
    };
}

#[test]
fn every_state_of_a_batch_has_the_bits_that_it_has_alone() {
    batches_agree!(
        contact_planar2r_generic,
        |s| forward_dynamics!(contact_planar2r, s, |x: f64| x),
        [forward_dynamics_batch_soa, forward_dynamics_batch_soa_parallel],
        [forward_dynamics_batch_aos, forward_dynamics_batch_aos_parallel]
    );
    batches_agree!(
        contact_planar2r_fused,
        |s| forward_dynamics!(contact_planar2r_fused, s, |x: f64| x),
        [forward_dynamics_batch_soa],
        [forward_dynamics_batch_aos]
    );
}

#[test]
fn a_batch_of_a_wrong_length_is_refused() {
    let mut y = OUTPUTS.map(|m| vec![0.0; 3 * m]);
    let [a, b, c, d, e] = &mut y;
    let x = INPUTS.map(|m| vec![0.5; 3 * m]);
    let done = contact_planar2r_fused::contact::surface::forward_dynamics_batch_aos(
        3,
        &x[0],
        &x[1],
        &x[2],
        &x[3][1..],
        &x[4],
        &x[5],
        a,
        b,
        c,
        d,
        e,
    );
    assert!(done.is_err());
    assert!(y.iter().flatten().all(|y| *y == 0.0));
}

#[test]
fn fused_ones_are_as_good_as_plain_ones() {
    for state in states(200) {
        let fused = forward_dynamics!(contact_planar2r_fused, state, |x: f64| x);
        let wide = forward_dynamics!(contact_planar2r_generic, state, Dd::from);
        let scale = wide.iter().fold(1.0, |most: f64, x| most.max(x.to_f64().abs()));
        let worst = fused.iter().zip(&wide).map(|(x, y)| (Dd::from(*x) - *y).to_f64().abs()).fold(0.0, f64::max);
        assert!(worst <= 1e-13 * scale / fused[5], "{worst:e} of {scale:e}");
    }
}
