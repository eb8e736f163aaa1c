//! Lanes and batches: every state gets, bit for bit, what the plain function gives it, whatever its neighbours are.

use straightline_generated_tests::compiled::lanes_panda as panda;
use straightline_generated_tests::compiled::lanes_payload as payload;
use straightline_generated_tests::compiled::lanes_solo12 as solo12;
use straightline_generated_tests::random::Random;

/// Numbers of states: none, one, less than a block of any machine, whole blocks, remainders, enough for several threads.
const STATES: [usize; 9] = [0, 1, 3, 4, 8, 16, 17, 100, 1031];

/// A generated function of one state, of flat inputs and outputs.
type One<T> = fn(&[Vec<T>], &mut [T]);
/// The same of a batch: the number of states, inputs, output.
type Batch<T> = fn(usize, &[Vec<T>], &mut [T]) -> Result<(), String>;

/// What a function takes and gives, and its forms.
struct Subject<T> {
    name: &'static str,
    inputs: Vec<usize>,
    output: usize,
    one: One<T>,
    soa: Vec<Batch<T>>,
    aos: Vec<Batch<T>>,
}

/// From rows of states to components: `[s * w + c]` to `[c * n + s]`.
fn transposed<T: Copy>(x: &[T], states: usize, width: usize) -> Vec<T> {
    (0..width).flat_map(|c| (0..states).map(move |s| x[s * width + c])).collect()
}

trait Scalar: Copy + PartialEq + std::fmt::Debug {
    fn from_f64(x: f64) -> Self;
    fn bits(self) -> u64;
}

impl Scalar for f64 {
    fn from_f64(x: f64) -> f64 {
        x
    }
    fn bits(self) -> u64 {
        self.to_bits()
    }
}

impl Scalar for f32 {
    fn from_f64(x: f64) -> f32 {
        x as f32
    }
    fn bits(self) -> u64 {
        self.to_bits().into()
    }
}

impl<T: Scalar> Subject<T> {
    fn agrees(&self) {
        let mut random = Random(11);
        for n in STATES {
            let inputs: Vec<Vec<T>> =
                self.inputs.iter().map(|w| random.list(n * w, 2.0).into_iter().map(T::from_f64).collect()).collect();
            let mut expected = vec![T::from_f64(0.0); n * self.output];
            for s in 0..n {
                let state: Vec<Vec<T>> =
                    inputs.iter().zip(&self.inputs).map(|(x, w)| x[s * w..(s + 1) * w].to_vec()).collect();
                (self.one)(&state, &mut expected[s * self.output..(s + 1) * self.output]);
            }
            let same = |what: &str, found: &[T], expected: &[T]| {
                let bits = |x: &[T]| x.iter().map(|x| x.bits()).collect::<Vec<_>>();
                assert_eq!(bits(found), bits(expected), "{} {what}, {n} states", self.name);
            };
            // what was there before must not show
            let fresh = || vec![T::from_f64(7.25); n * self.output];
            for run in &self.aos {
                let mut found = fresh();
                run(n, &inputs, &mut found).unwrap();
                same("array of structures", &found, &expected);
            }
            let components: Vec<Vec<T>> = inputs.iter().zip(&self.inputs).map(|(x, w)| transposed(x, n, *w)).collect();
            for run in &self.soa {
                let mut found = fresh();
                run(n, &components, &mut found).unwrap();
                same("structure of arrays", &found, &transposed(&expected, n, self.output));
            }
        }
    }

    fn refuses_wrong_lengths(&self, names: &[&str]) {
        let n = 5;
        for (wrong, name) in names.iter().enumerate() {
            for change in [-1, 1] {
                let length = |k: usize, w: usize| (n * w).saturating_add_signed(if k == wrong { change } else { 0 });
                let inputs: Vec<Vec<T>> =
                    self.inputs.iter().enumerate().map(|(k, w)| vec![T::from_f64(0.5); length(k, *w)]).collect();
                for run in self.soa.iter().chain(&self.aos) {
                    let mut output = vec![T::from_f64(7.25); length(self.inputs.len(), self.output)];
                    let message = run(n, &inputs, &mut output).unwrap_err();
                    assert!(message.contains(&format!("`{name}` has ")), "{message}");
                    assert!(message.contains("5 states of "), "{message}");
                    assert!(output.iter().all(|y| *y == T::from_f64(7.25)), "{}: written all the same", self.name);
                }
            }
        }
    }
}

/// A function over slices, of the inputs with these indices.
macro_rules! batch {
    ($run:path, $($k:literal)*) => {
        |n, x, y| $run(n, $(&x[$k],)* y).map_err(|wrong| wrong.to_string())
    };
}

/// A plain function of the inputs with these indices, its output's zero, and how that becomes flat.
macro_rules! one {
    ($run:path, $($k:literal)*, $zero:expr, $flat:expr) => {
        |x, y| {
            let mut out = $zero;
            $run($(x[$k].as_slice().try_into().expect("the width of the input"),)* &mut out);
            y.copy_from_slice(&$flat(&out));
        }
    };
}

fn solo12_inverse_dynamics() -> Subject<f64> {
    Subject {
        name: "inverse dynamics",
        inputs: vec![19, 18, 18],
        output: 18,
        one: one!(solo12::inverse_dynamics, 0 1 2, [0.0; 18], <[f64; 18]>::as_slice),
        soa: vec![
            batch!(solo12::inverse_dynamics_batch_soa, 0 1 2),
            batch!(solo12::inverse_dynamics_batch_soa_parallel, 0 1 2),
        ],
        aos: vec![
            batch!(solo12::inverse_dynamics_batch_aos, 0 1 2),
            batch!(solo12::inverse_dynamics_batch_aos_parallel, 0 1 2),
        ],
    }
}

fn panda_inverse_dynamics() -> Subject<f32> {
    Subject {
        name: "inverse dynamics in single precision",
        inputs: vec![7, 7, 7],
        output: 7,
        one: one!(panda::inverse_dynamics, 0 1 2, [0.0; 7], <[f32; 7]>::as_slice),
        soa: vec![batch!(panda::inverse_dynamics_batch_soa, 0 1 2)],
        aos: vec![batch!(panda::inverse_dynamics_batch_aos, 0 1 2)],
    }
}

/// One output of the derivatives of torques, the others aside.
macro_rules! panda_derivatives {
    ($name:literal, $kept:literal, $width:literal) => {
        Subject::<f32> {
            name: $name,
            inputs: vec![7, 7, 7],
            output: $width,
            one: |x, y| {
                let (mut k, mut d, mut h, mut tau) = ([[0.0; 7]; 7], [[0.0; 7]; 7], [[0.0; 7]; 7], [0.0; 7]);
                let [q, qd, qdd] = [0, 1, 2].map(|k| x[k].as_slice().try_into().expect("a number per joint"));
                panda::inverse_dynamics_derivatives(q, qd, qdd, &mut k, &mut d, &mut h, &mut tau);
                y.copy_from_slice([k.as_flattened(), d.as_flattened(), h.as_flattened(), &tau][$kept]);
            },
            soa: vec![batch_of_derivatives!(panda::inverse_dynamics_derivatives_batch_soa, $kept)],
            aos: vec![batch_of_derivatives!(panda::inverse_dynamics_derivatives_batch_aos, $kept)],
        }
    };
}

macro_rules! batch_of_derivatives {
    ($run:path, $kept:literal) => {
        |n, x, y| {
            let mut all = [49, 49, 49, 7].map(|width| vec![7.25; n * width]);
            let [k, d, h, tau] = &mut all;
            $run(n, &x[0], &x[1], &x[2], k, d, h, tau).map_err(|wrong| wrong.to_string())?;
            y.copy_from_slice(&all[$kept]);
            Ok(())
        }
    };
}

#[test]
fn a_batch_of_derivatives_gives_every_state_the_bits_that_it_gets_alone() {
    panda_derivatives!("∂τ/∂q", 0, 49).agrees();
    panda_derivatives!("∂τ/∂q̇", 1, 49).agrees();
    panda_derivatives!("H beside derivatives", 2, 49).agrees();
    panda_derivatives!("τ beside derivatives", 3, 7).agrees();
}

#[test]
fn a_batch_gives_every_state_the_bits_that_it_gets_alone() {
    solo12_inverse_dynamics().agrees();
    panda_inverse_dynamics().agrees();
    let forward_dynamics = Subject {
        name: "forward dynamics",
        one: one!(solo12::forward_dynamics, 0 1 2, [0.0; 18], <[f64; 18]>::as_slice),
        soa: vec![
            batch!(solo12::forward_dynamics_batch_soa, 0 1 2),
            batch!(solo12::forward_dynamics_batch_soa_parallel, 0 1 2),
        ],
        aos: vec![
            batch!(solo12::forward_dynamics_batch_aos, 0 1 2),
            batch!(solo12::forward_dynamics_batch_aos_parallel, 0 1 2),
        ],
        ..solo12_inverse_dynamics()
    };
    forward_dynamics.agrees();
    let mass_matrix: Subject<f64> = Subject {
        name: "mass matrix",
        inputs: vec![19],
        output: 18 * 18,
        one: one!(solo12::mass_matrix, 0, [[0.0; 18]; 18], <[[f64; 18]]>::as_flattened),
        soa: vec![batch!(solo12::mass_matrix_batch_soa, 0), batch!(solo12::mass_matrix_batch_soa_parallel, 0)],
        aos: vec![batch!(solo12::mass_matrix_batch_aos, 0), batch!(solo12::mass_matrix_batch_aos_parallel, 0)],
    };
    mass_matrix.agrees();
    let jacobian: Subject<f64> = Subject {
        name: "Jacobians",
        inputs: vec![19],
        output: 2 * 6 * 18,
        one: one!(solo12::jacobian, 0, [[[0.0; 18]; 6]; 2], |j: &[[[f64; 18]; 6]; 2]| j.concat().concat()),
        soa: vec![batch!(solo12::jacobian_batch_soa, 0), batch!(solo12::jacobian_batch_soa_parallel, 0)],
        aos: vec![batch!(solo12::jacobian_batch_aos, 0), batch!(solo12::jacobian_batch_aos_parallel, 0)],
    };
    jacobian.agrees();
}

#[test]
fn a_slice_of_the_wrong_length_is_named_and_nothing_is_written() {
    solo12_inverse_dynamics().refuses_wrong_lengths(&["q", "qd", "qdd", "tau"]);
    panda_inverse_dynamics().refuses_wrong_lengths(&["q", "qd", "qdd", "tau"]);
}

#[test]
fn so_many_states_that_no_slice_can_hold_them_are_refused() {
    let wrong = panda::inverse_dynamics_batch_soa(usize::MAX / 2, &[], &[], &[], &mut []).unwrap_err();
    assert_eq!((wrong.argument, wrong.width, wrong.found), ("q", 7, 0));
}

#[test]
fn any_number_of_lanes_will_do() {
    fn lanes<const N: usize>() {
        let mut random = Random(12);
        let mut draw = |w: usize| -> Vec<[f64; N]> {
            (0..w).map(|_| random.list(N, 2.0).try_into().expect("as many as asked for")).collect()
        };
        let q: [[f64; N]; 19] = draw(19).try_into().unwrap();
        let qd: [[f64; N]; 18] = draw(18).try_into().unwrap();
        let mut h = [[[7.25; N]; 18]; 18];
        solo12::mass_matrix_lanes(&q, &mut h);
        let mut tau = [[7.25; N]; 18];
        solo12::inverse_dynamics_lanes(&q, &qd, &qd, &mut tau);
        for lane in 0..N {
            let (q, qd) = (q.map(|c| c[lane]), qd.map(|c| c[lane]));
            let (mut h_alone, mut tau_alone) = ([[0.0; 18]; 18], [0.0; 18]);
            solo12::mass_matrix(&q, &mut h_alone);
            solo12::inverse_dynamics(&q, &qd, &qd, &mut tau_alone);
            assert_eq!(h.map(|row| row.map(|c| c[lane])), h_alone);
            assert_eq!(tau.map(|c| c[lane]), tau_alone);
        }
    }
    lanes::<1>();
    lanes::<3>();
    lanes::<8>();
    lanes::<0>();
}

#[test]
fn a_load_serves_all_states_of_a_batch() {
    let load = payload::Load::new(1.5, [0.01, -0.02, 0.1], [0.004, 0.0, 0.0, 0.005, 0.0, 0.003]).unwrap();
    let (n, mut random) = (21, Random(13));
    let [q, qd, qdd] = [(); 3].map(|()| random.list(n * 7, 2.0));
    let mut found = vec![0.0; n * 7];
    payload::inverse_dynamics_batch_aos(n, &q, &qd, &qdd, &load, &mut found).unwrap();
    let states = q.as_chunks().0.iter().zip(qd.as_chunks().0).zip(qdd.as_chunks().0).zip(found.chunks(7));
    for (((q, qd), qdd), found) in states {
        let mut alone = [0.0; 7];
        payload::inverse_dynamics(q, qd, qdd, &load, &mut alone);
        assert_eq!(found, alone);
    }
}
