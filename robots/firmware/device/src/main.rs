//! Both controllers for a second at 1 kHz, on whatever machine this is compiled for: what it prints is the same everywhere, to the bit.
//!
//! Every line is a name and a number: after each tenth of a second the hash of all torques so far, and at the end the last torques, as bits.
//! On a machine with an operating system it is an ordinary program; without one `startup` is all that stands around it. What
//! the sensors say comes from a small generator, so that nothing but the controllers computes with floats that could differ.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod startup;

use straightline_firmware_example::{arm, leg};

/// Steps of a millisecond.
const STEPS: u32 = 1000;

/// Prints a line.
#[cfg(not(target_os = "none"))]
fn say(name: &str, number: u32) {
    println!("{name} {number:08x}");
}
#[cfg(target_os = "none")]
use startup::say;

/// Numbers from −1 to 1, the same on all machines: multiples of 2^-23, made of integers.
struct Sensors(u64);

impl Sensors {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 40) as i32 - (1 << 23)) as f32 * (1.0 / 8_388_608.0)
    }

    /// Between these limits, and a tenth inside them.
    fn between<const N: usize>(&mut self, lower: [f32; N], upper: [f32; N]) -> [f32; N] {
        let mut x = lower;
        for (x, upper) in x.iter_mut().zip(upper) {
            let (middle, half) = (0.5 * (*x + upper), 0.45 * (upper - *x));
            *x = middle + half * self.next();
        }
        x
    }

    fn around<const N: usize>(&mut self, size: f32) -> [f32; N] {
        self.between([-size; N], [size; N])
    }
}

/// FNV-1a over bits.
fn hashed(hash: u32, bits: u32) -> u32 {
    bits.to_le_bytes().iter().fold(hash, |hash, byte| (hash ^ u32::from(*byte)).wrapping_mul(16_777_619))
}

/// The hash before anything.
const START: u32 = 0x811c_9dc5;

fn run_arm() {
    let gains = arm::Gains { stiffness: [400.0; 7], damping: [40.0; 7] };
    let (mut sensors, mut hash, mut tau) = (Sensors(1), START, [0.5; 7]);
    for step in 1..=STEPS {
        let q = sensors.between(arm::Panda::LOWER_LIMITS, arm::Panda::UPPER_LIMITS);
        let wanted = arm::Wanted { q, qd: sensors.around(2.0), qdd: sensors.around(5.0) };
        let mut measured = arm::Measured { q, qd: sensors.around(2.0) };
        measured.q[step as usize % 7] *= 0.9;
        let done = arm::control_step(&gains, &wanted, &measured, &mut tau);
        hash = tau.iter().fold(hashed(hash, u32::from(done.is_ok())), |hash, tau| hashed(hash, tau.to_bits()));
        if step % 100 == 0 {
            say("arm", hash);
        }
    }
    tau.iter().for_each(|tau| say("torque", tau.to_bits()));
}

fn run_legs() {
    let gains = leg::Gains { stiffness: [3.0; leg::JOINTS], damping: [0.1; leg::JOINTS] };
    let (mut sensors, mut hash, mut tau) = (Sensors(2), START, [0.5; leg::JOINTS]);
    for step in 1..=STEPS {
        let mut measured = leg::Measured { q: sensors.around(3.0), qd: sensors.around(2.0) };
        // turned about one axis by an angle whose half has the tangent 3/4
        let turned = [[0.6, 0.0, 0.0, 0.8], [0.0, 0.6, 0.0, 0.8], [0.0, 0.0, 0.6, 0.8]];
        measured.q[3..7].copy_from_slice(&turned[step as usize % 3]);
        let mut wanted = leg::Wanted { q: sensors.around(0.05), qd: sensors.around(2.0), qdd: sensors.around(5.0) };
        wanted.q.iter_mut().zip(&measured.q[7..]).for_each(|(wanted, q)| *wanted += q);
        let done = leg::control_step(&gains, &wanted, &measured, &mut tau);
        hash = tau.iter().fold(hashed(hash, u32::from(done.is_ok())), |hash, tau| hashed(hash, tau.to_bits()));
        if step % 100 == 0 {
            say("legs", hash);
        }
    }
    tau.iter().for_each(|tau| say("torque", tau.to_bits()));
}

/// All that there is to run.
fn run() {
    run_arm();
    run_legs();
}

#[cfg(not(target_os = "none"))]
fn main() {
    run();
}
