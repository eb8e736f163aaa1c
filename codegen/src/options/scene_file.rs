//! A scene file in the place of options.

use crate::function::Function;
use crate::options::Options;
use crate::scene::{Base, SceneFile};

impl SceneFile {
    /// These options with what the file says in their place, and with its scene. Where neither names functions, a base that
    /// moves as it is told has all but forward dynamics.
    pub fn into_options(self, mut options: Options) -> Options {
        if let Some(functions) = self.functions {
            options.functions = functions;
        } else if self.scene.base == Base::Moving && options.functions.iter().copied().eq(Function::all()) {
            options.functions.retain(|f| *f != Function::ForwardDynamics);
        }
        if let [first, others @ ..] = &self.scalars[..] {
            (options.scalar, options.also) = (*first, others.to_vec());
        }
        options.model.angle_tolerance = self.angle_tolerance.unwrap_or(options.model.angle_tolerance);
        options.limbs = self.limbs.unwrap_or(options.limbs);
        options.certify = self.certify.or(options.certify);
        let own = std::mem::replace(&mut options.reporting.levels, self.levels);
        options.reporting.levels.extend(&own);
        options.scene = self.scene;
        options
    }
}
