//! A robot in the forms that are traced.

use crate::equations::base;
use crate::equations::reduce::{reduce, FreeTerms};
use crate::function::Function;
use crate::scene::Scene;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use straightline_core::model::Model;
use straightline_core::reduced::ReducedModel;
use straightline_core::spatial::Transform;
use straightline_core::Dd;

/// A robot in the forms that are traced.
#[derive(Clone, Debug)]
pub struct Robot {
    /// As the robot file has it, in canonical frames.
    pub model: Model<Dd>,
    /// For joint torques alone.
    pub reduced: ReducedModel<Dd>,
    /// For the mass matrix alone.
    pub composite: ReducedModel<Dd>,
    /// Pose of each body's frame of the reduced forms in its canonical one.
    pub reduced_frames: Vec<Transform<Dd>>,
    /// The choices of reduced forms that were found for it.
    pub found: Found,
}

impl Robot {
    /// All forms of a robot, the reduced ones as any robot takes them.
    pub fn new(model: Model<Dd>) -> Self {
        let (reduced, reduced_frames) = reduce(&model, &FreeTerms::plain(&model));
        Robot { model, composite: reduced.clone(), reduced, reduced_frames, found: Found::default() }
    }

    /// The same robot with its base parameters where one of these functions is about them and they are not known yet: in the frames of the plain reduced form.
    #[must_use]
    pub fn knowing_base_parameters(self, functions: &[Function], scene: &Scene) -> Self {
        let known = &self.model.base_parameters;
        let is_known = !known.of_forces.is_empty();
        if is_known || !functions.iter().any(|function| function.is_of_base_parameters()) {
            return self;
        }
        let found = base::find(&self.model, &self.reduced_frames, scene);
        Robot { model: Model { base_parameters: found, ..self.model }, ..self }
    }

    /// The same robot in other reduced forms, for torques and for the mass matrix.
    #[must_use]
    pub fn reduced_by(&self, torques: &FreeTerms, mass_matrix: &FreeTerms) -> Self {
        let (reduced, composite) = (reduce(&self.model, torques).0, reduce(&self.model, mass_matrix).0);
        Robot { reduced, composite, ..self.clone() }
    }
}

/// What was found for a robot, by function and scene: searched once, used by every function that shares it, on whatever thread.
#[derive(Clone, Debug, Default)]
pub struct Found(Arc<Mutex<Vec<(String, FoundForm)>>>);

/// Empty while whoever came first searches.
type FoundForm = Arc<OnceLock<FreeTerms>>;

impl Found {
    pub(crate) fn or_search(&self, key: String, search: impl FnOnce() -> FreeTerms) -> FreeTerms {
        let choice = {
            let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            let place = known.iter().position(|(k, _)| *k == key).unwrap_or_else(|| {
                known.push((key, Arc::default()));
                known.len() - 1
            });
            known[place].1.clone()
        };
        // who comes while it is searched waits for it
        choice.get_or_init(search).clone()
    }
}
