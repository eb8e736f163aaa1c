//! The robot as a system of first order: state (q, q̇), and beside it the work of drives and the losses.
//!
//! The state vector is \[q | q̇ | W | L\]: W the work of the generalized forces that are given, L what friction has turned into
//! heat \[J\], so that kinetic and potential energy − W + L is constant, which measures a simulation. States of drives have their
//! place between q̇ and W.

use straightline_core::algorithms::{forward_dynamics_aba, kinetic_energy, potential_energy};
use straightline_core::model::{Coulomb, JointKind, Model};

/// A robot that is simulated.
#[derive(Clone, Debug)]
pub struct Plant {
    /// The robot.
    pub model: Model<f64>,
}

impl Plant {
    /// From a model. Coulomb friction that jumps with the sign of q̇ is taken as smooth with this speed w \[rad/s or m/s\]: no
    /// equation of motion is left at rest otherwise.
    pub fn new(mut model: Model<f64>, coulomb_speed: f64) -> Plant {
        for body in &mut model.bodies {
            if let Coulomb::Sign(force) = body.effects.coulomb {
                body.effects.coulomb = match force == 0.0 {
                    true => Coulomb::Off,
                    false => Coulomb::Smooth { force, speed: coulomb_speed },
                };
            }
        }
        Plant { model }
    }

    /// Number of states.
    pub fn states(&self) -> usize {
        self.model.nq() + self.model.nv() + 2
    }

    /// The state vector of a configuration and a velocity.
    pub fn state(&self, q: &[f64], qd: &[f64]) -> Vec<f64> {
        [q, qd, &[0.0, 0.0]].concat()
    }

    /// q, q̇, work and losses of a state.
    pub fn split<'a>(&self, state: &'a [f64]) -> (&'a [f64], &'a [f64], f64, f64) {
        let (q, rest) = state.split_at(self.model.nq());
        let (qd, energies) = rest.split_at(self.model.nv());
        (q, qd, energies[0], energies[1])
    }

    /// Kinetic and potential energy \[J\], those of rotors and springs with them.
    pub fn energy(&self, q: &[f64], qd: &[f64]) -> f64 {
        kinetic_energy(&self.model, q, qd) + potential_energy(&self.model, q)
    }

    /// Power that friction turns into heat \[W\]: Σ (d q̇ + f(q̇)) q̇.
    pub fn losses(&self, qd: &[f64]) -> f64 {
        let joints = self.model.bodies.iter().filter(|b| b.joint.kind != JointKind::Floating);
        let loss = |(v, e): (f64, &straightline_core::model::JointEffects<f64>)| {
            let coulomb = match e.coulomb {
                Coulomb::Off => 0.0,
                Coulomb::Sign(force) => force * v.abs(),
                Coulomb::Smooth { force, speed } => force * v * v / (v * v + speed * speed).sqrt(),
            };
            e.damping * v * v + coulomb
        };
        joints.map(|b| loss((qd[b.joint.iv], &b.effects))).sum()
    }

    /// The time derivative of the state under generalized forces `tau`.
    pub fn rate(&self, state: &[f64], tau: &[f64], rate: &mut [f64]) {
        let (nq, nv) = (self.model.nq(), self.model.nv());
        let (q, qd, ..) = self.split(state);
        let q = unit_quaternions(&self.model, q);
        let qdd = forward_dynamics_aba(&self.model, &q, qd, tau);
        rate[..nq].copy_from_slice(&self.configuration_rate(&q, qd));
        rate[nq..nq + nv].copy_from_slice(&qdd);
        rate[nq + nv] = tau.iter().zip(qd).map(|(tau, qd)| tau * qd).sum();
        rate[nq + nv + 1] = self.losses(qd);
    }

    /// dq/dt: q̇ of joints; of a floating base R v and ½ quaternion ∘ ω.
    pub(crate) fn configuration_rate(&self, q: &[f64], qd: &[f64]) -> Vec<f64> {
        let mut rate = vec![0.0; self.model.nq()];
        for joint in self.model.bodies.iter().map(|b| &b.joint) {
            let (iq, iv) = (joint.iq, joint.iv);
            if joint.kind != JointKind::Floating {
                rate[iq] = qd[iv];
                continue;
            }
            let (v, w) = ([qd[iv], qd[iv + 1], qd[iv + 2]], [qd[iv + 3], qd[iv + 4], qd[iv + 5]]);
            let [x, y, z, s] = [q[iq + 3], q[iq + 4], q[iq + 5], q[iq + 6]];
            // R v = v + 2 s (u × v) + 2 u × (u × v)
            let u = [x, y, z];
            let c = cross(u, v);
            let cc = cross(u, c);
            for k in 0..3 {
                rate[iq + k] = v[k] + 2.0 * (s * c[k] + cc[k]);
            }
            let turned = cross(u, w);
            for k in 0..3 {
                rate[iq + 3 + k] = 0.5 * (s * w[k] + turned[k]);
            }
            rate[iq + 6] = -0.5 * (x * w[0] + y * w[1] + z * w[2]);
        }
        rate
    }

    /// The state with quaternions of length one.
    pub fn normalised(&self, state: &[f64]) -> Vec<f64> {
        let nq = self.model.nq();
        [&unit_quaternions(&self.model, &state[..nq]), &state[nq..]].concat()
    }
}

/// q with quaternions of length one.
fn unit_quaternions(model: &Model<f64>, q: &[f64]) -> Vec<f64> {
    let mut q = q.to_vec();
    for joint in model.bodies.iter().map(|b| &b.joint).filter(|j| j.kind == JointKind::Floating) {
        let quaternion = &mut q[joint.iq + 3..joint.iq + 7];
        let norm = quaternion.iter().map(|x| x * x).sum::<f64>().sqrt();
        quaternion.iter_mut().for_each(|x| *x /= norm);
    }
    q
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
