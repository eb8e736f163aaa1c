//! Rows of numbers turned into columns by permutations of two registers, where a row is as long as one.

use crate::number::Number;
use std::any::Any;
use std::arch::x86_64::{__m512, __m512d, _mm512_permutex2var_pd, _mm512_permutex2var_ps};
use std::mem::transmute;

/// The columns of rows as long as a register; none of others.
#[inline]
#[target_feature(enable = "avx2,fma,avx512f,avx512vl,avx512dq")]
pub fn transposed<T: Number, const N: usize>(rows: [[T; N]; N]) -> Option<[[T; N]; N]> {
    let any: &dyn Any = &rows;
    if let Some(rows) = any.downcast_ref() {
        return same_type(rows_of_8(*rows));
    }
    any.downcast_ref().and_then(|rows| same_type(rows_of_16(*rows)))
}

/// The value as one of the type that it has.
#[inline(always)]
fn same_type<A: Any, B: Any + Copy>(value: A) -> Option<B> {
    let any: &dyn Any = &value;
    any.downcast_ref().copied()
}

/// Blocks beside the diagonal change places, of half the rows, then of half of those, until they are single numbers.
macro_rules! rows_of {
    ($name:ident, $n:literal, $number:ty, $register:ty, $index:ty, $permute:ident) => {
        #[inline]
        #[target_feature(enable = "avx2,fma,avx512f,avx512vl,avx512dq")]
        fn $name(rows: [[$number; $n]; $n]) -> [[$number; $n]; $n] {
            // SAFETY: registers are as long as rows, and any bits are numbers
            let mut rows: [$register; $n] = unsafe { transmute(rows) };
            let mut size = $n / 2;
            while size > 0 {
                let (mut first, mut second) = ([0 as $index; $n], [0 as $index; $n]);
                for k in 0..$n {
                    let is_own = k & size == 0;
                    // numbers of the second register count from $n on
                    first[k] = (if is_own { k } else { $n + k - size }) as $index;
                    second[k] = (if is_own { k + size } else { $n + k }) as $index;
                }
                // SAFETY: as above
                let (first, second) = unsafe { (transmute(first), transmute(second)) };
                for i in (0..$n).filter(|i| i & size == 0) {
                    let (a, b) = (rows[i], rows[i + size]);
                    rows[i] = $permute(a, first, b);
                    rows[i + size] = $permute(a, second, b);
                }
                size /= 2;
            }
            // SAFETY: as above
            unsafe { transmute(rows) }
        }
    };
}

rows_of!(rows_of_8, 8, f64, __m512d, i64, _mm512_permutex2var_pd);
rows_of!(rows_of_16, 16, f32, __m512, i32, _mm512_permutex2var_ps);
