// The drives of an arm, of which a sketch has none: put your bus here.

use straightline_firmware_example::arm::{Measured, Panda};

/// What measures and what turns.
pub struct Drives;

impl Drives {
    /// Angles \[rad\] and speeds \[rad/s\].
    pub fn measured(&mut self) -> Measured {
        Measured { q: [0.0, -0.8, 0.0, -2.2, 0.0, 1.6, 0.8], qd: [0.0; Panda::NV] }
    }

    /// Torques \[N·m\].
    pub fn set(&mut self, _tau: &[f32; Panda::NV]) {}
}
