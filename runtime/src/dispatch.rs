//! Batches with the vector instructions of the machine, found out at run time.
//!
//! A function with `#[target_feature]` is compiled for instructions that the rest of the program may not use; a batch that
//! becomes part of it, because everything in it is `#[inline(always)]`, is compiled for them, too. Calling such a function is
//! `unsafe` for one reason: the machine must have the instructions. It is asked first. The instruction that begins to read
//! memory takes a pointer, which may be any.
#![allow(unsafe_code)] // the calls into functions for other instructions, and prefetching; nothing else here is unsafe

use crate::batch::{Job, Machine, Plain};

/// Lanes of a block of f64 for the instructions that this crate is compiled for.
const LANES_F64: usize = if cfg!(target_feature = "avx512f") { 8 } else { 4 };
/// Whether this crate is compiled for a machine with fused multiply-add.
const FUSED: bool = cfg!(any(target_feature = "fma", all(target_arch = "aarch64", target_feature = "neon")));

/// Runs a batch of f64 with the instructions of this machine.
pub fn run_f64(job: impl Job) {
    run::<8, 4, LANES_F64>(job);
}

/// Runs a batch of f32 with the instructions of this machine.
pub fn run_f32(job: impl Job) {
    run::<16, 8, { 2 * LANES_F64 }>(job);
}

fn run<const AVX512: usize, const AVX2: usize, const OTHER: usize>(job: impl Job) {
    #[cfg(target_arch = "x86_64")]
    {
        if std::is_x86_feature_detected!("avx512f")
            && std::is_x86_feature_detected!("avx512dq")
            && std::is_x86_feature_detected!("avx512bw")
            && std::is_x86_feature_detected!("avx512vl")
            && std::is_x86_feature_detected!("fma")
        {
            // SAFETY: the machine has the instructions
            return unsafe { avx512::<AVX512>(job) };
        }
        if std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma") {
            // SAFETY: the machine has the instructions
            return unsafe { avx2::<AVX2>(job) };
        }
    }
    job.run::<OTHER, FUSED, Plain>();
}

/// Reads ahead.
#[cfg(target_arch = "x86_64")]
struct X86;

#[cfg(target_arch = "x86_64")]
impl Machine for X86 {
    #[inline(always)]
    fn prefetch<T>(place: *const T) {
        use core::arch::x86_64::{_mm_prefetch, _MM_HINT_T0};
        // SAFETY: every x86-64 machine has the instruction, and no pointer makes it fail
        unsafe { _mm_prefetch::<_MM_HINT_T0>(place.cast()) }
    }

    #[inline(always)]
    fn prefetch_far<T>(place: *const T) {
        use core::arch::x86_64::{_mm_prefetch, _MM_HINT_T1};
        // SAFETY: as above
        unsafe { _mm_prefetch::<_MM_HINT_T1>(place.cast()) }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512bw,avx512vl,avx2,fma")]
fn avx512<const N: usize>(job: impl Job) {
    job.run::<N, true, X86>();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn avx2<const N: usize>(job: impl Job) {
    job.run::<N, true, X86>();
}
