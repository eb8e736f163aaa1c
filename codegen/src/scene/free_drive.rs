//! Numbers of a drive that stay inputs: what functions take in their place, and how that follows from them.
//!
//! Functions take the numbers of the built drive ([`Drive`]): rigid stages folded into the shafts, ratios over all stages, shares of the
//! joints' forces. Of these they take those that depend on what is free; a constructor derives them once.

use super::Parameter;
use crate::description::drives::{DriveNumber, WrittenDrive};
use crate::model::drives::{derived, entries};
use straightline_core::drive::Drive;
use straightline_core::model::Model;
use straightline_core::{Dd, Real};

/// A drive of a model, and which of its numbers are free.
pub struct FreeDrive<'a> {
    form: &'a WrittenDrive,
    /// The free numbers, with what they are in the file.
    pub numbers: Vec<DriveNumber>,
    model: &'a Model<Dd>,
    /// Which of the model's drives it is.
    index: usize,
}

impl<'a> FreeDrive<'a> {
    /// What a parameter makes free; `None` if it belongs to no drive, or to none that the model still has.
    ///
    /// # Panics
    /// If the scene was not told of the drives, by [`Scene::knowing`](super::Scene::knowing).
    pub fn new(parameter: &'a Parameter, model: &'a Model<Dd>) -> Option<FreeDrive<'a>> {
        let Parameter::Drive { drive, numbers, form, .. } = parameter else { return None };
        let index = model.drives.iter().position(|d| d.name == *drive)?;
        let form = form.as_deref().expect("the scene knows the drives of the robot file");
        let all = form.numbers();
        let named = |name: &String| all.iter().find(|n| n.name == *name).cloned();
        Some(FreeDrive { form, numbers: numbers.iter().filter_map(named).collect(), model, index })
    }

    fn built(&self) -> &Drive<Dd> {
        &self.model.drives[self.index]
    }

    /// The drive with these values of the free numbers.
    pub fn derived<T: Real>(&self, values: &[T]) -> Drive<T> {
        derived(&self.form.with(&self.numbers, values), self.form, (self.built(), self.model))
    }

    /// What the robot file calls the drive.
    pub fn name(&self) -> &str {
        &self.built().name
    }

    /// Values near those of the file, all of which may be; `unit` gives numbers between 0 and 1.
    pub fn random(&self, mut unit: impl FnMut() -> f64) -> Vec<f64> {
        let near = |n: &DriveNumber| match n.value {
            0.0 => 1e-3 * unit(),
            // no more than an efficiency may be
            x => x * (0.7 + 0.3 * unit()),
        };
        self.numbers.iter().map(near).collect()
    }

    /// The values of the file.
    pub fn nominal(&self) -> Vec<Dd> {
        self.numbers.iter().map(|n| Dd::from(n.value)).collect()
    }

    /// Which entries of the drive depend on free numbers.
    fn is_free(&self) -> Vec<bool> {
        let changed =
            |(k, x): (usize, Dd)| if x == Dd::ZERO { Dd::ONE } else { x * Dd::from(1.25 + 0.0625 * k as f64) };
        let other: Vec<Dd> = self.nominal().into_iter().enumerate().map(changed).collect();
        let [nominal, other] = [self.nominal(), other].map(|values| entries(&self.derived(&values)));
        nominal.iter().zip(&other).map(|(a, b)| a != b).collect()
    }

    /// How many scalars functions take.
    pub fn scalars(&self) -> usize {
        self.is_free().into_iter().filter(|free| *free).count()
    }

    /// The scalars that functions take, for these values of the free numbers.
    pub fn values<T: Real>(&self, values: &[T]) -> Vec<T> {
        let all = entries(&self.derived(values)).into_iter().zip(self.is_free());
        all.filter(|(_, free)| *free).map(|(x, _)| x).collect()
    }

    /// Puts what functions take into their place.
    pub fn put<T: Real>(&self, model: &mut Model<T>, scalars: &[T]) {
        let (mut scalars, mut free) = (scalars.iter(), self.is_free().into_iter());
        let mut next = |x: T| match free.next() {
            Some(true) => *scalars.next().expect("as many as are free"),
            _ => x,
        };
        model.drives[self.index] = model.drives[self.index].map(&mut next);
    }

    /// The drive over which functions run at these values of the free numbers, in the scalars that they take.
    pub fn bound<T: Real>(&self, values: &[T]) -> Drive<T> {
        let mut model = self.model.map(T::constant);
        self.put(&mut model, &self.values(values));
        model.drives.swap_remove(self.index)
    }
}
