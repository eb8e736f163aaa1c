//! Reverse mode: numbers that remember how they were made, so that the derivatives of some results by all inputs follow in one sweep back.
//!
//! Any function over [`Real`] has its gradient this way, in about twice to four times its operations, however many inputs there are (Griewank and
//! Walther 2008, section 3.3). Over a scalar that writes equations down the sweep writes its own.
//!
//! ```
//! use straightline_core::reverse::Recording;
//! use straightline_core::Real;
//! let recording = Recording::new();
//! let [x, y] = [0.3, 2.0].map(|x| recording.variable(x));
//! let result = x.sin_cos().0 * y;
//! let slopes = recording.gradient(&[(result, 1.0)]);
//! assert_eq!([slopes.by(x), slopes.by(y)], [Real::sin_cos(0.3).1 * 2.0, Real::sin_cos(0.3).0]);
//! ```

use crate::dd::Dd;
use crate::operators::operators;
use crate::real::Real;
use alloc::vec;
use alloc::vec::Vec;
use core::cell::RefCell;

/// How a number was made: up to three numbers before it, with the slopes by them.
type RecordedStep<T> = [Option<(usize, T)>; 3];

/// What was computed, in order.
#[derive(Debug, Default)]
pub struct Recording<T> {
    steps: RefCell<Vec<RecordedStep<T>>>,
}

/// A number of a [`Recording`], or a constant.
#[derive(Clone, Copy, Debug)]
pub struct Recorded<'t, T> {
    /// Its value.
    pub value: T,
    place: Option<(&'t Recording<T>, usize)>,
}

/// The derivatives of a sum of results.
#[derive(Clone, Debug)]
pub struct Slopes<T> {
    by_place: Vec<Option<T>>,
}

impl<T: Real> Recording<T> {
    /// An empty one.
    pub fn new() -> Self {
        Recording { steps: RefCell::new(Vec::new()) }
    }

    /// A number that derivatives are taken by.
    pub fn variable(&self, value: T) -> Recorded<'_, T> {
        self.made(value, [None; 3])
    }

    fn made(&self, value: T, step: RecordedStep<T>) -> Recorded<'_, T> {
        let mut steps = self.steps.borrow_mut();
        steps.push(step);
        Recorded { value, place: Some((self, steps.len() - 1)) }
    }

    /// The derivatives of Σ λ r, of these results r with their λ.
    pub fn gradient(&self, results: &[(Recorded<'_, T>, T)]) -> Slopes<T> {
        let steps = self.steps.borrow();
        let mut by_place: Vec<Option<T>> = vec![None; steps.len()];
        let add = |to: &mut Option<T>, part: T| *to = Some(to.map_or(part, |sum| sum + part));
        for (result, seed) in results {
            if let Some((_, place)) = result.place {
                add(&mut by_place[place], *seed);
            }
        }
        for (place, step) in steps.iter().enumerate().rev() {
            let Some(own) = by_place[place] else { continue };
            for (before, slope) in step.iter().flatten() {
                add(&mut by_place[*before], own * *slope);
            }
        }
        Slopes { by_place }
    }
}

impl<T: Real> Slopes<T> {
    /// The derivative by a variable; zero where nothing depends on it.
    pub fn by(&self, variable: Recorded<'_, T>) -> T {
        variable.place.and_then(|(_, place)| self.by_place[place]).unwrap_or_else(T::zero)
    }
}

impl<'t, T: Real> Recorded<'t, T> {
    /// A number that depends on nothing.
    pub fn fixed(value: T) -> Self {
        Recorded { value, place: None }
    }

    /// f of one number.
    fn chain(self, value: T, slope: T) -> Self {
        match self.place {
            Some((recording, place)) => recording.made(value, [Some((place, slope)), None, None]),
            None => Recorded::fixed(value),
        }
    }

    /// f of two numbers.
    fn zip(self, b: Self, value: T, slopes: [T; 2]) -> Self {
        Recorded::of(value, [(self, slopes[0]), (b, slopes[1])])
    }

    /// f of some numbers, with its slopes by them.
    fn of<const N: usize>(value: T, made_of: [(Self, T); N]) -> Self {
        let mut step = [None; 3];
        for (before, (number, slope)) in step.iter_mut().zip(&made_of) {
            *before = number.place.map(|(_, place)| (place, *slope));
        }
        match made_of.iter().find_map(|(number, _)| number.place) {
            Some((recording, _)) => recording.made(value, step),
            None => Recorded::fixed(value),
        }
    }
}

operators! { ['t, T: Real] Recorded<'t, T>:
    Add add |a, b| a.zip(b, a.value + b.value, [T::one(), T::one()]);
    Sub sub |a, b| a.zip(b, a.value - b.value, [T::one(), -T::one()]);
    Mul mul |a, b| a.zip(b, a.value * b.value, [b.value, a.value]);
    // a/b moves by (δa − (a/b) δb)/b
    Div div |a, b| {
        let value = a.value / b.value;
        a.zip(b, value, [T::one() / b.value, -(value / b.value)])
    };
    Neg neg |a| a.chain(-a.value, -T::one());
}

impl<T: Real> Real for Recorded<'_, T> {
    fn constant(value: Dd) -> Self {
        Recorded::fixed(T::constant(value))
    }

    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (self.chain(sin, cos), self.chain(cos, -sin))
    }

    /// Of the values as their scalar has it: one that writes equations down has an operation for it.
    fn sin_cos_of_sum(angles: &[Self]) -> (Self, Self) {
        let values: Vec<T> = angles.iter().map(|angle| angle.value).collect();
        let (sin, cos) = T::sin_cos_of_sum(&values);
        // for its derivatives
        let sum = angles[1..].iter().fold(angles[0], |sum, angle| sum.zip(*angle, sum.value, [T::one(), T::one()]));
        (sum.chain(sin, cos), sum.chain(cos, -sin))
    }

    fn turning(self) -> Option<Self> {
        Some(Recorded { value: self.value.turning().unwrap_or_else(T::zero), ..self })
    }

    /// With (X, Y) = R (x, y) the slopes by the angle are −Y and X.
    fn turned_about([x, y]: [Self; 2], (sin, cos): (Self, Self), turning: Option<Self>) -> [Self; 2] {
        let Some(turning) = turning else { return [x * cos - y * sin, y * cos + x * sin] };
        let (s, c) = (sin.value, cos.value);
        let [x_turned, y_turned] = T::turned_about([x.value, y.value], (s, c), Some(turning.value));
        [
            Recorded::of(x_turned, [(x, c), (y, -s), (turning, -y_turned)]),
            Recorded::of(y_turned, [(y, c), (x, s), (turning, x_turned)]),
        ]
    }

    /// At zero the slope is infinite.
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, T::one() / (root + root))
    }

    /// The slope is zero, also at the jump.
    fn sign(self) -> Self {
        Recorded::fixed(self.value.sign())
    }

    fn named(self, name: &'static str, index: usize, component: &'static str) -> Self {
        Recorded { value: self.value.named(name, index, component), ..self }
    }

    fn section(phase: &'static str, body: Option<usize>) {
        T::section(phase, body);
    }
}
