//! Rows of numbers turned into columns by permutations of two registers, where a row is as long as one.

use super::transpose_numbers;
use crate::number::Number;
use std::any::TypeId;
use std::arch::x86_64::{
    __m512i, _mm512_loadu_pd, _mm512_loadu_ps, _mm512_permutex2var_pd, _mm512_permutex2var_ps, _mm512_storeu_pd,
    _mm512_storeu_ps,
};
use std::mem::transmute;

/// Writes the columns of rows. Not part of its caller, whose loops would be rewritten about it.
#[inline(never)]
#[target_feature(enable = "avx2,fma,avx512f,avx512vl,avx512dq")]
pub fn transpose<T: Number, const N: usize>(rows: &[[T; N]; N], columns: &mut [[T; N]; N]) {
    let number = TypeId::of::<T>();
    let (from, to): (*const [[T; N]; N], *mut [[T; N]; N]) = (rows, columns);
    if number == TypeId::of::<f64>() && N == 8 {
        // SAFETY: of one type, as the condition says, and borrowed for as long
        unsafe { transpose_8(&*from.cast(), &mut *to.cast()) }
    } else if number == TypeId::of::<f32>() && N == 16 {
        // SAFETY: as above
        unsafe { transpose_16(&*from.cast(), &mut *to.cast()) }
    } else {
        transpose_numbers(rows, columns);
    }
}

/// Blocks beside the diagonal change places, of half the rows, then of half of those, until they are single numbers.
macro_rules! transpositions {
    ($($name:ident, $n:literal: $($size:literal)*, $number:ty, $index:ty, $load:ident, $permute:ident, $store:ident;)*) => {$(
        #[inline]
        #[target_feature(enable = "avx2,fma,avx512f,avx512vl,avx512dq")]
        fn $name(rows: &[[$number; $n]; $n], columns: &mut [[$number; $n]; $n]) {
            // SAFETY: a register is as long as a row
            let load = |row: usize| unsafe { $load(rows[row].as_ptr()) };
            let mut registers = [load(0); $n];
            for (k, register) in registers.iter_mut().enumerate() {
                *register = load(k);
            }
            $({
                // numbers of the second register count from $n on
                const FROM: [[$index; $n]; 2] = {
                    let (mut from, mut k) = ([[0; $n]; 2], 0);
                    while k < $n {
                        let is_own = k & $size == 0;
                        from[0][k as usize] = if is_own { k } else { $n + k - $size };
                        from[1][k as usize] = if is_own { k + $size } else { $n + k };
                        k += 1;
                    }
                    from
                };
                // SAFETY: any bits are numbers, and a register is as long
                let [first, second] = unsafe { transmute::<[[$index; $n]; 2], [__m512i; 2]>(FROM) };
                for i in 0..$n {
                    if i & $size == 0 {
                        let (a, b) = (registers[i], registers[i + $size]);
                        registers[i] = $permute(a, first, b);
                        registers[i + $size] = $permute(a, second, b);
                    }
                }
            })*
            for (column, register) in columns.iter_mut().zip(registers) {
                // SAFETY: as above
                unsafe { $store(column.as_mut_ptr(), register) };
            }
        }
    )*};
}

transpositions! {
    transpose_8, 8: 4 2 1, f64, i64, _mm512_loadu_pd, _mm512_permutex2var_pd, _mm512_storeu_pd;
    transpose_16, 16: 8 4 2 1, f32, i32, _mm512_loadu_ps, _mm512_permutex2var_ps, _mm512_storeu_ps;
}
