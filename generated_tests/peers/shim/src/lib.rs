//! Exported dynamics of one robot behind the C functions that the peers' harness calls.
//!
//! The harness wants matrices by columns, as `scene.toml` asks for them, and an orientation before a position: the pose of the one
//! frame is put into that order here.
#![allow(clippy::missing_safety_doc)] // all of them: the pointers lead to arrays of the harness's sizes, outputs apart

#[cfg(not(feature = "avx2"))]
mod dispatch;
#[cfg(not(feature = "avx2"))]
use dynamics::batch;
#[allow(dead_code, unused_imports)] // constants and functions that the harness does not ask for
mod dynamics;

/// Batches with 256-bit instructions on any machine that has them.
#[cfg(feature = "avx2")]
mod dispatch {
    use crate::dynamics::batch::{Job, Machine};
    use core::arch::x86_64::{_mm_prefetch, _MM_HINT_T0, _MM_HINT_T1};

    struct X86;

    impl Machine for X86 {
        #[inline(always)]
        fn prefetch<T>(place: *const T) {
            unsafe { _mm_prefetch::<_MM_HINT_T0>(place.cast()) }
        }

        #[inline(always)]
        fn prefetch_far<T>(place: *const T) {
            unsafe { _mm_prefetch::<_MM_HINT_T1>(place.cast()) }
        }
    }

    pub fn run_f64(job: impl Job) {
        job.run::<4, { cfg!(target_feature = "fma") }, X86>();
    }

    pub fn run_f32(job: impl Job) {
        job.run::<8, { cfg!(target_feature = "fma") }, X86>();
    }
}

use core::ffi::c_int;
use dynamics::{NQ, NV};

/// The functions that the harness calls.
#[cfg(not(any(feature = "single", feature = "derivatives")))]
mod calls {
    use super::*;
    use core::ffi::c_long;
    use core::slice::{from_raw_parts, from_raw_parts_mut};

    type Q = [f64; NQ];
    type V = [f64; NV];

    #[no_mangle]
    pub unsafe extern "C" fn rbd_id(q: &Q, v: &V, a: &V, tau: &mut V) {
        dynamics::inverse_dynamics(q, v, a, tau);
    }

    #[no_mangle]
    pub unsafe extern "C" fn rbd_nle(q: &Q, v: &V, h: &mut V) {
        dynamics::bias_force(q, v, h);
    }

    #[no_mangle]
    pub unsafe extern "C" fn rbd_crba(q: &Q, h: &mut [V; NV]) {
        dynamics::mass_matrix(q, h);
    }

    #[no_mangle]
    pub unsafe extern "C" fn rbd_aba(q: &Q, v: &V, tau: &V, a: &mut V) {
        dynamics::forward_dynamics(q, v, tau, a);
    }

    #[no_mangle]
    pub unsafe extern "C" fn rbd_fkjac(q: &Q, t: &mut [f64; 12], j: &mut [[[f64; 6]; NV]; 1]) {
        let mut x = [[0.0; 12]; 1];
        dynamics::kinematics_and_jacobian(q, &mut x, j);
        let [[px, py, pz, xx, xy, xz, yx, yy, yz, zx, zy, zz]] = x;
        *t = [xx, yx, zx, xy, yy, zy, xz, yz, zz, px, py, pz];
    }

    macro_rules! batch {
        ($name:ident, $function:ident) => {
            #[no_mangle]
            pub unsafe extern "C" fn $name(n: c_long, q: *const f64, v: *const f64, x: *const f64, y: *mut f64) {
                let n = n as usize;
                let (q, v, x) = (from_raw_parts(q, n * NQ), from_raw_parts(v, n * NV), from_raw_parts(x, n * NV));
                dynamics::$function(n, q, v, x, from_raw_parts_mut(y, n * NV)).expect("the slices hold n states");
            }
        };
    }
    batch!(rbd_id_batch_soa, inverse_dynamics_batch_soa);
    batch!(rbd_id_batch_aos, inverse_dynamics_batch_aos);
    batch!(rbd_aba_batch_soa, forward_dynamics_batch_soa);
    batch!(rbd_aba_batch_aos, forward_dynamics_batch_aos);
}

/// The derivatives that the harness calls. H and its inverse stay here: of the latter it takes a look.
#[cfg(all(feature = "derivatives", not(feature = "single")))]
mod derivative_calls {
    use super::*;
    use std::cell::UnsafeCell;

    type Q = [f64; NQ];
    type V = [f64; NV];
    type Square = [V; NV];

    thread_local! {
        static SQUARE: UnsafeCell<Square> = const { UnsafeCell::new([[0.0; NV]; NV]) };
    }

    #[no_mangle]
    pub unsafe extern "C" fn rbd_id_deriv(q: &Q, v: &V, a: &V, by_q: &mut Square, by_v: &mut Square) {
        SQUARE.with(|h| dynamics::inverse_dynamics_derivatives(q, v, a, by_q, by_v, unsafe { &mut *h.get() }));
    }

    #[no_mangle]
    pub unsafe extern "C" fn rbd_fd_deriv(q: &Q, v: &V, tau: &V, by_q: &mut Square, by_v: &mut Square) {
        SQUARE.with(|h| dynamics::forward_dynamics_derivatives(q, v, tau, by_q, by_v, unsafe { &mut *h.get() }));
    }

    /// H⁻¹ of the last call; all else is where the arguments say.
    #[no_mangle]
    pub extern "C" fn peer_result(function: c_int, result: c_int) -> *const f64 {
        match (function, result) {
            (6, 2) => SQUARE.with(|h| h.get().cast_const().cast()),
            _ => core::ptr::null(),
        }
    }

    #[cfg(not(feature = "calls"))]
    mod batches {
        use super::*;
        use core::ffi::c_long;
        use core::slice::{from_raw_parts, from_raw_parts_mut};
        use std::cell::RefCell;

        thread_local! {
            static SQUARES: RefCell<Vec<f64>> = const { RefCell::new(Vec::new()) };
        }

        macro_rules! batch {
            ($name:ident, $function:ident) => {
                #[no_mangle]
                pub unsafe extern "C" fn $name(n: c_long, q: *const f64, v: *const f64, x: *const f64, y: *mut f64) {
                    let n = n as usize;
                    let (q, v, x) = (from_raw_parts(q, n * NQ), from_raw_parts(v, n * NV), from_raw_parts(x, n * NV));
                    let (by_q, by_v) = from_raw_parts_mut(y, 2 * n * NV * NV).split_at_mut(n * NV * NV);
                    SQUARES.with_borrow_mut(|h| {
                        h.resize(n * NV * NV, 0.0);
                        dynamics::$function(n, q, v, x, by_q, by_v, h).expect("the slices hold n states");
                    });
                }
            };
        }
        batch!(rbd_id_deriv_batch_soa, inverse_dynamics_derivatives_batch_soa);
        batch!(rbd_fd_deriv_batch_soa, forward_dynamics_derivatives_batch_soa);

        /// Blocks of eight states, one after the other.
        macro_rules! blocks {
            ($name:ident, $function:ident) => {
                #[no_mangle]
                pub unsafe extern "C" fn $name(n: c_long, q: *const f64, v: *const f64, x: *const f64, y: *mut f64) {
                    type Lanes<const K: usize> = [[f64; 8]; K];
                    type Squares = [[[f64; 8]; NV]; NV];
                    let blocks = n as usize / 8;
                    let q: &[Lanes<NQ>] = from_raw_parts(q.cast(), blocks);
                    let (v, x): (&[Lanes<NV>], &[Lanes<NV>]) =
                        (from_raw_parts(v.cast(), blocks), from_raw_parts(x.cast(), blocks));
                    let y: &mut [[Squares; 2]] = from_raw_parts_mut(y.cast(), blocks);
                    SQUARES.with_borrow_mut(|h| {
                        h.resize(n as usize * NV * NV, 0.0);
                        let h: &mut [Squares] = from_raw_parts_mut(h.as_mut_ptr().cast(), blocks);
                        for (k, (y, h)) in y.iter_mut().zip(h).enumerate() {
                            let [by_q, by_v] = y;
                            dynamics::$function(&q[k], &v[k], &x[k], by_q, by_v, h);
                        }
                    });
                }
            };
        }
        blocks!(rbd_id_deriv_batch_blocks, inverse_dynamics_derivatives_lanes);
        blocks!(rbd_fd_deriv_batch_blocks, forward_dynamics_derivatives_lanes);
    }
}

/// Batches that `single.py` runs.
#[cfg(not(feature = "calls"))]
mod batches {
    use super::*;
    use core::ffi::c_long;

    #[cfg(not(feature = "single"))]
    type Number = f64;
    #[cfg(feature = "single")]
    type Number = f32;

    /// Random states, structure of arrays, and room for results.
    pub struct Batch {
        states: usize,
        inputs: [&'static mut [Number]; 3],
        results: [&'static mut [Number]; RESULTS],
    }

    /// Blocks of results, and numbers of each.
    #[cfg(not(feature = "derivatives"))]
    const RESULTS: usize = 1;
    #[cfg(feature = "derivatives")]
    const RESULTS: usize = 3;
    const LENGTH: usize = if RESULTS == 1 { NV } else { NV * NV };

    /// Numbers that begin where a line of a cache does, as those of the harness do; they are never freed.
    fn aligned(numbers: impl ExactSizeIterator<Item = Number>) -> &'static mut [Number] {
        const LINE: usize = 64 / size_of::<Number>();
        let count = numbers.len();
        let mut room: Vec<Number> = Vec::with_capacity(count + LINE);
        let first = room.as_ptr().align_offset(64);
        room.resize(first, 0.0);
        room.extend(numbers);
        &mut room.leak()[first..]
    }

    /// A batch for [`batch_run`], which is never freed.
    #[no_mangle]
    pub extern "C" fn batch_of(states: c_long) -> *mut Batch {
        let states = states as usize;
        let mut seed = 1_u32;
        let mut random = |width: usize| {
            let mut next = || {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (seed as f32 / u32::MAX as f32 * 2.0 - 1.0) as Number
            };
            aligned((0..states * width).map(|_| next()))
        };
        let inputs = [random(NQ), random(NV), random(NV)];
        let results = [(); RESULTS].map(|()| aligned((0..states * LENGTH).map(|_| 0.0)));
        Box::into_raw(Box::new(Batch { states, inputs, results }))
    }

    /// Inverse dynamics (0) or forward dynamics (1) of the batch, or their derivatives; its first result.
    #[no_mangle]
    pub unsafe extern "C" fn batch_run(batch: &mut Batch, function: c_int) -> f64 {
        let Batch { states, inputs: [q, v, x], results } = batch;
        #[cfg(not(feature = "derivatives"))]
        let [first] = results;
        #[cfg(not(feature = "derivatives"))]
        let done = match function {
            0 => dynamics::inverse_dynamics_batch_soa(*states, q, v, x, first),
            _ => dynamics::forward_dynamics_batch_soa(*states, q, v, x, first),
        };
        #[cfg(feature = "derivatives")]
        let [first, by_v, h] = results;
        #[cfg(feature = "derivatives")]
        let done = match function {
            0 => dynamics::inverse_dynamics_derivatives_batch_soa(*states, q, v, x, first, by_v, h),
            _ => dynamics::forward_dynamics_derivatives_batch_soa(*states, q, v, x, first, by_v, h),
        };
        done.expect("the slices hold so many states");
        first[0] as f64
    }
}
