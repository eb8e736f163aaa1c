/// Degrees of freedom.
pub const N: usize = 7;
/// Instants along the motion.
pub const SAMPLES: usize = 101;
/// How long it takes \[s\].
pub const DURATION: f64 = 1.6;
const FROM: [f64; N] = [-1.2, -0.9, 0.6, -2.6, -0.7, 1.1, 0.3];
const TO: [f64; N] = [1.1, 0.8, -0.5, -1.1, 0.9, 2.9, -1.6];

/// Time, q, q̇ and q̈ of an instant of a quintic from rest to rest: q = FROM + (TO − FROM) (10 x³ − 15 x⁴ + 6 x⁵), x = t / DURATION.
pub fn motion(sample: usize) -> (f64, [[f64; N]; 3]) {
    let x = sample as f64 / (SAMPLES - 1) as f64;
    let s = x * x * x * (10.0 + x * (-15.0 + x * 6.0));
    let sd = x * x * (30.0 + x * (-60.0 + x * 30.0)) / DURATION;
    let sdd = x * (60.0 + x * (-180.0 + x * 120.0)) / (DURATION * DURATION);
    let along = |start: bool, rate: f64| std::array::from_fn(|i| f64::from(start) * FROM[i] + rate * (TO[i] - FROM[i]));
    (x * DURATION, [along(true, s), along(false, sd), along(false, sdd)])
}
