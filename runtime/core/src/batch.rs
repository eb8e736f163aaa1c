//! Many states: a program of one state, run in lanes over slices.
//!
//! The file uses nothing of its crate, so that it can stand as a module in generated code. A batch is cut into blocks of as
//! many states as a vector register has lanes; the program's body stands in a loop over the lanes, which the compiler turns
//! into vector instructions. Lanes do not see each other, so every state gets the bits that it would get alone. The last
//! block is filled up with copies of the last state.
//!
//! Two layouts of `n` states of `w` numbers: structure of arrays, component `c` of state `s` at `[c * n + s]`, which needs no
//! shuffling and is the faster one; array of structures, at `[s * w + c]`.

/// A program over lanes: component `c` of state `lane` at `x[c][lane]`, the inputs one after the other, and likewise `y`.
pub trait Program<T, const IN: usize, const OUT: usize> {
    /// Runs it on `N` states. `FUSED`: a program that is made for it computes a·b + c in one rounding.
    fn run<const N: usize, const FUSED: bool>(&self, x: &[[T; N]; IN], y: &mut [[T; N]; OUT]);
}

/// What a machine can do beside computing.
pub trait Machine {
    /// Begins to read what stands there into the first-level cache, and does not wait for it; the place need not exist.
    fn prefetch<T>(place: *const T);
    /// As [`Machine::prefetch`], into the second-level cache.
    fn prefetch_far<T>(place: *const T);
}

/// A machine that is asked for nothing but computing.
#[derive(Clone, Copy, Debug)]
pub struct Plain;

impl Machine for Plain {
    #[inline(always)]
    fn prefetch<T>(_: *const T) {}
    #[inline(always)]
    fn prefetch_far<T>(_: *const T) {}
}

/// A batch that is ready to run.
pub trait Job {
    /// Runs it in blocks of `N` states; `FUSED` as in [`Program::run`].
    fn run<const N: usize, const FUSED: bool, M: Machine>(self);
}

/// A job that can be shared out.
pub trait Divisible: Job + Sized {
    /// Number of states.
    fn states(&self) -> usize;
    /// The first `k` states, and the others.
    fn split(self, k: usize) -> (Self, Self);
}

/// A slice that does not hold as many numbers as it should.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WrongLength {
    /// Name of the argument.
    pub argument: &'static str,
    /// States that were asked for.
    pub states: usize,
    /// Numbers of one state.
    pub width: usize,
    /// Numbers that are there.
    pub found: usize,
}

impl core::fmt::Display for WrongLength {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let WrongLength { argument, states, width, found } = self;
        write!(f, "`{argument}` has {found} numbers: {states} states of {width} are wanted")
    }
}

impl core::error::Error for WrongLength {}

/// That a slice holds `states` times `width` numbers.
///
/// # Errors
/// It does not.
#[inline]
pub fn check<T>(argument: &'static str, slice: &[T], states: usize, width: usize) -> Result<(), WrongLength> {
    match states.checked_mul(width) == Some(slice.len()) {
        true => Ok(()),
        false => Err(WrongLength { argument, states, width, found: slice.len() }),
    }
}

/// Lanes of a block of f64 for the instructions that this crate is compiled for.
pub const LANES_F64: usize = if cfg!(target_feature = "avx512f") { 8 } else { 4 };
/// Lanes of a block of f32 for the instructions that this crate is compiled for.
pub const LANES_F32: usize = 2 * LANES_F64;
/// Whether this crate is compiled for a machine with fused multiply-add.
pub const FUSED: bool = cfg!(any(target_feature = "fma", all(target_arch = "aarch64", target_feature = "neon")));

/// Runs a batch of f64 with the instructions that this crate is compiled for.
#[inline]
pub fn run_f64(job: impl Job) {
    job.run::<LANES_F64, FUSED, Plain>();
}

/// Runs a batch of f32 with the instructions that this crate is compiled for.
#[inline]
pub fn run_f32(job: impl Job) {
    job.run::<LANES_F32, FUSED, Plain>();
}

/// Bytes that memory hands over together.
const LINE: usize = 64;
/// A first-level cache holds what is read ahead of so many slices; of more of them, the second one does.
const NEAR: usize = 40;
/// So many lines ahead: by then they are there, and not yet gone.
const LINES_NEAR: usize = 2;
const LINES_FAR: usize = 16;

/// A batch in structure-of-arrays layout: a slice per component, each with as many numbers as there are states.
#[derive(Debug)]
pub struct Soa<'a, P, T, const IN: usize, const OUT: usize> {
    program: &'a P,
    states: usize,
    x: [&'a [T]; IN],
    y: [&'a mut [T]; OUT],
}

/// The batch of `states` states whose inputs and outputs have these slices, component `c` of state `s` at
/// `[c * states + s]`.
///
/// Slices that are too short count as empty: [`check`] first.
#[inline(always)]
pub fn soa<'a, P: Program<T, IN, OUT>, T, const IN: usize, const OUT: usize, const I: usize, const O: usize>(
    program: &'a P,
    states: usize,
    inputs: [&'a [T]; I],
    outputs: [&'a mut [T]; O],
) -> Soa<'a, P, T, IN, OUT> {
    let width = states.max(1);
    let mut x = inputs.into_iter().flat_map(|slice| slice.chunks_exact(width));
    let mut y = outputs.into_iter().flat_map(|slice| slice.chunks_exact_mut(width));
    Soa {
        program,
        states,
        x: core::array::from_fn(|_| x.next().unwrap_or_default()),
        y: core::array::from_fn(|_| y.next().unwrap_or_default()),
    }
}

impl<P: Program<T, IN, OUT>, T: Copy + Default, const IN: usize, const OUT: usize> Job for Soa<'_, P, T, IN, OUT> {
    #[inline(always)]
    fn run<const N: usize, const FUSED: bool, M: Machine>(self) {
        let Soa { program, states, x, mut y } = self;
        let mut block = [[T::default(); N]; IN];
        let mut result = [[T::default(); N]; OUT];
        let mut start = 0;
        while start < states {
            let there = N.min(states - start);
            // a machine foresees what is read next of a few slices; with more of them each block would wait for its numbers, so
            // they are asked for in advance, line by line
            let begins_line = start * size_of::<T>() % LINE < N * size_of::<T>();
            let next = |lines: usize| start + lines * LINE / size_of::<T>();
            if IN + OUT > NEAR {
                x.iter().for_each(|c| M::prefetch_far(c.as_ptr().wrapping_add(next(LINES_FAR))));
                y.iter().for_each(|c| M::prefetch_far(c.as_ptr().wrapping_add(next(LINES_FAR))));
            } else if begins_line {
                x.iter().for_each(|c| M::prefetch(c.as_ptr().wrapping_add(next(LINES_NEAR))));
                y.iter().for_each(|c| M::prefetch(c.as_ptr().wrapping_add(next(LINES_NEAR))));
            }
            for (lanes, component) in block.iter_mut().zip(&x) {
                let component = &component[start..start + there];
                match <&[T; N]>::try_from(component) {
                    Ok(whole) => *lanes = *whole,
                    Err(_) => *lanes = core::array::from_fn(|lane| component[lane.min(there - 1)]),
                }
            }
            program.run::<N, FUSED>(&block, &mut result);
            for (component, lanes) in y.iter_mut().zip(&result) {
                component[start..start + there].copy_from_slice(&lanes[..there]);
            }
            start += there;
        }
    }
}

impl<P: Program<T, IN, OUT>, T: Copy + Default, const IN: usize, const OUT: usize> Divisible
    for Soa<'_, P, T, IN, OUT>
{
    fn states(&self) -> usize {
        self.states
    }

    fn split(self, k: usize) -> (Self, Self) {
        let Soa { program, states, x, y } = self;
        let x_first = x.map(|component| &component[..k]);
        let x_second = x.map(|component| &component[k..]);
        let mut halves = y.map(|component| {
            let (first, second) = component.split_at_mut(k);
            (first, Some(second))
        });
        let y_second = core::array::from_fn(|c| halves[c].1.take().unwrap_or_default());
        let y_first = halves.map(|(first, _)| first);
        (
            Soa { program, states: k, x: x_first, y: y_first },
            Soa { program, states: states - k, x: x_second, y: y_second },
        )
    }
}

/// A batch in array-of-structures layout: per input and output a slice, and the numbers of one state.
#[derive(Debug)]
pub struct Aos<'a, P, T, const I: usize, const O: usize, const IN: usize, const OUT: usize> {
    program: &'a P,
    states: usize,
    inputs: [(&'a [T], usize); I],
    outputs: [(&'a mut [T], usize); O],
}

/// The batch of `states` states whose inputs and outputs have these slices, each with the width `w` of one state, component
/// `c` of state `s` at `[s * w + c]`. The widths are those of the program, and the slices are as long as they say: [`check`]
/// first.
#[inline(always)]
pub fn aos<'a, P: Program<T, IN, OUT>, T, const I: usize, const O: usize, const IN: usize, const OUT: usize>(
    program: &'a P,
    states: usize,
    inputs: [(&'a [T], usize); I],
    outputs: [(&'a mut [T], usize); O],
) -> Aos<'a, P, T, I, O, IN, OUT> {
    Aos { program, states, inputs, outputs }
}

impl<P, T, const I: usize, const O: usize, const IN: usize, const OUT: usize> Job for Aos<'_, P, T, I, O, IN, OUT>
where
    P: Program<T, IN, OUT>,
    T: Copy + Default,
{
    #[inline(always)]
    fn run<const N: usize, const FUSED: bool, M: Machine>(self) {
        let Aos { program, states, inputs, mut outputs } = self;
        let mut start = 0;
        while start < states {
            let there = N.min(states - start);
            let mut block = [[T::default(); N]; IN];
            let mut result = [[T::default(); N]; OUT];
            let mut rows = block.iter_mut();
            for (slice, width) in &inputs {
                let slice = &slice[start * width..(start + there) * width];
                for (c, lanes) in rows.by_ref().take(*width).enumerate() {
                    for (lane, x) in lanes.iter_mut().enumerate() {
                        *x = slice[lane.min(there - 1) * width + c];
                    }
                }
            }
            program.run::<N, FUSED>(&block, &mut result);
            let mut rows = result.iter();
            for (slice, width) in &mut outputs {
                let slice = &mut slice[start * *width..(start + there) * *width];
                for (c, lanes) in rows.by_ref().take(*width).enumerate() {
                    for (lane, y) in lanes[..there].iter().enumerate() {
                        slice[lane * *width + c] = *y;
                    }
                }
            }
            start += there;
        }
    }
}

impl<P, T, const I: usize, const O: usize, const IN: usize, const OUT: usize> Divisible for Aos<'_, P, T, I, O, IN, OUT>
where
    P: Program<T, IN, OUT>,
    T: Copy + Default,
{
    fn states(&self) -> usize {
        self.states
    }

    fn split(self, k: usize) -> (Self, Self) {
        let Aos { program, states, inputs, outputs } = self;
        let first = inputs.map(|(slice, width)| (&slice[..k * width], width));
        let second = inputs.map(|(slice, width)| (&slice[k * width..], width));
        let mut halves = outputs.map(|(slice, width)| {
            let (first, second) = slice.split_at_mut(k * width);
            (first, Some(second), width)
        });
        let y_second = core::array::from_fn(|o| (halves[o].1.take().unwrap_or_default(), halves[o].2));
        let y_first = halves.map(|(first, _, width)| (first, width));
        (
            Aos { program, states: k, inputs: first, outputs: y_first },
            Aos { program, states: states - k, inputs: second, outputs: y_second },
        )
    }
}

/// The first `W` components, which are taken off: one input of a program after the other.
///
/// # Panics
/// There are fewer; the widths of a program are constants, so that the check is gone after compilation.
#[inline(always)]
pub fn take<'a, T, const W: usize>(x: &mut &'a [T]) -> &'a [T; W] {
    let (first, rest) = x.split_first_chunk().expect("a program has as many components as its inputs");
    *x = rest;
    first
}

/// As [`take`], of outputs.
///
/// # Panics
/// As [`take`].
#[inline(always)]
pub fn take_mut<'a, T, const W: usize>(y: &mut &'a mut [T]) -> &'a mut [T; W] {
    let whole = core::mem::take(y);
    let (first, rest) = whole.split_first_chunk_mut().expect("a program has as many components as its outputs");
    *y = rest;
    first
}

/// Components in a row as `R` rows of `C`.
///
/// # Panics
/// W is not R times C; as in [`take`] the check is gone after compilation.
#[inline(always)]
pub fn rows<T, const W: usize, const R: usize, const C: usize>(x: &[T; W]) -> &[[T; C]; R] {
    x.as_chunks().0.try_into().expect("a shape has as many components as its port")
}

/// As [`rows`], of outputs.
///
/// # Panics
/// As [`rows`].
#[inline(always)]
pub fn rows_mut<T, const W: usize, const R: usize, const C: usize>(y: &mut [T; W]) -> &mut [[T; C]; R] {
    y.as_chunks_mut().0.try_into().expect("a shape has as many components as its port")
}
