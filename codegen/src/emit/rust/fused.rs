//! The functions that compute a·b + c in one rounding, sines and cosines among them.

use super::of_scalar;
use crate::emit::Style;

/// The module `fused` of a file whose functions are fused; with sines and cosines if there is a module `trig` beside it.
pub fn module(style: Style, with_kernel: bool) -> String {
    let kernel = if with_kernel { KERNEL } else { "" };
    let operation = if style.fused_by_caller { BY_CALLER } else { BY_STD };
    of_scalar(&[MODULE, operation, FMA, kernel, "}\n"].concat(), style.scalar)
}

const MODULE: &str = r#"
#[allow(unused_imports)]
use fused::{fma, fma_if, FUSED};
"#;

const BY_STD: &str = r#"
/// a·b + c in one rounding.
///
/// Only where the machine has it as an instruction, never by a call: the crate is compiled for one (`-C target-cpu`,
/// `-C target-feature=+fma`), or a batch has asked. Otherwise a·b is rounded, and the sum again.
#[allow(dead_code, unused_imports)]
mod fused {
    // the instruction is not to be had from `core`
    #[cfg(not(target_os = "none"))]
    extern crate std;

    /// Whether this crate is compiled for a machine with the instruction, and with `std`.
    pub const FUSED: bool =
        cfg!(all(not(target_os = "none"), any(target_feature = "fma", all(target_arch = "aarch64", target_feature = "neon"))));
    /// Whether it is one operation whatever the machine.
    const ALWAYS: bool = false;

    #[cfg(not(target_os = "none"))]
    #[inline(always)]
    fn mul_add(a: {t}, b: {t}, c: {t}) -> {t} {
        a.mul_add(b, c)
    }

    #[cfg(target_os = "none")]
    #[inline(always)]
    fn mul_add(a: {t}, b: {t}, c: {t}) -> {t} {
        a * b + c
    }
"#;

const BY_CALLER: &str = r#"
/// a·b + c in one rounding, by the function `mul_add_{t}(a, b, c)` of this crate: always, with the same bits on every machine.
#[allow(dead_code, unused_imports)]
mod fused {
    use crate::mul_add_{t} as mul_add;

    /// a·b + c is one operation.
    pub const FUSED: bool = true;
    /// Whether it is one operation whatever the machine.
    const ALWAYS: bool = true;
"#;

const FMA: &str = r#"
    #[inline(always)]
    pub fn fma(a: {t}, b: {t}, c: {t}) -> {t} {
        fma_if::<FUSED>(a, b, c)
    }

    #[inline(always)]
    pub fn fma_if<const FUSED: bool>(a: {t}, b: {t}, c: {t}) -> {t} {
        if FUSED || ALWAYS {
            mul_add(a, b, c)
        } else {
            a * b + c
        }
    }
"#;

const KERNEL: &str = r#"
    use super::trig;

    #[inline(always)]
    pub fn sin_cos_{t}(x: {t}) -> ({t}, {t}) {
        sin_cos_if_{t}::<FUSED>(x)
    }

    #[inline(always)]
    pub fn sin_cos_of_sum_{t}(x: [{t}; 2]) -> ({t}, {t}) {
        sin_cos_of_sum_if_{t}::<FUSED>(x)
    }

    #[inline(always)]
    pub fn sin_cos_if_{t}<const FUSED: bool>(x: {t}) -> ({t}, {t}) {
        if FUSED || ALWAYS {
            trig::sin_cos_fused_{t}(x, mul_add)
        } else {
            trig::sin_cos_{t}(x)
        }
    }

    #[inline(always)]
    pub fn sin_cos_of_sum_if_{t}<const FUSED: bool>(x: [{t}; 2]) -> ({t}, {t}) {
        if FUSED || ALWAYS {
            trig::sin_cos_of_sum_fused_{t}(x, mul_add)
        } else {
            trig::sin_cos_of_sum_{t}(x)
        }
    }

    #[inline(always)]
    pub fn sin_cos_lanes_{t}<const N: usize>(x: [{t}; N]) -> ([{t}; N], [{t}; N]) {
        if FUSED || ALWAYS {
            trig::sin_cos_lanes_fused_{t}(x, mul_add)
        } else {
            trig::sin_cos_lanes_{t}(x)
        }
    }

    #[inline(always)]
    pub fn sin_cos_lanes_of_sums_{t}<const N: usize>(x: [[{t}; 2]; N]) -> ([{t}; N], [{t}; N]) {
        if FUSED || ALWAYS {
            trig::sin_cos_lanes_of_sums_fused_{t}(x, mul_add)
        } else {
            trig::sin_cos_lanes_of_sums_{t}(x)
        }
    }
"#;
