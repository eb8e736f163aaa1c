//! Torques that nobody told the model about, by generalized momentum: no acceleration is measured, no mass matrix inverted
//! (De Luca and Mattone 2003).
//!
//! p = H q̇ obeys ṗ = τ + Cᵀ q̇ − g + d, so that d̂ = k (p − p₀ − ∫ (τ + Cᵀ q̇ − g + d̂) dt) follows d with the time 1/k.

use crate::arm::panda;
use crate::{dot, Joints, NV};

/// The observer.
#[derive(Clone, Copy, Debug)]
pub struct Observer {
    /// k \[1/s\].
    pub gain: f64,
    /// What it knows of d \[N·m\].
    pub disturbance: Joints,
    /// p₀ and the integral \[kg·m²/s\]; none before the first step.
    integral: Option<Joints>,
}

impl Observer {
    /// That forgets with this rate \[1/s\].
    pub const fn new(gain: f64) -> Observer {
        Observer { gain, disturbance: [0.0; NV], integral: None }
    }

    /// A measured state, and the torques \[N·m\] that will act for the time h \[s\] from now on.
    pub fn step(&mut self, q: &Joints, qd: &Joints, tau: &Joints, h: f64) {
        let (mut mass, mut g, mut f) = ([[0.0; NV]; NV], [0.0; NV], [0.0; NV]);
        panda::mass_matrix_and_gravity_force(q, &mut mass, &mut g);
        panda::coriolis_transpose_force(q, qd, &mut f);
        let momentum: Joints = core::array::from_fn(|i| dot(&mass[i], qd));
        let integral = self.integral.get_or_insert(momentum);
        for i in 0..NV {
            self.disturbance[i] = self.gain * (momentum[i] - integral[i]);
            integral[i] += h * (tau[i] + f[i] - g[i] + self.disturbance[i]);
        }
    }
}
