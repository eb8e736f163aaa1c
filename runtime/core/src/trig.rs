//! sin and cos (placeholder bodies: being written).
/// `(sin x, cos x)`.
pub fn sin_cos_f64(x: f64) -> (f64, f64) {
    let (s, c) = crate::Dd::from(x).sin_cos();
    (s.to_f64(), c.to_f64())
}
/// `(sin x, cos x)`.
pub fn sin_cos_f32(x: f32) -> (f32, f32) {
    let (s, c) = sin_cos_f64(x as f64);
    (s as f32, c as f32)
}
/// Square root.
pub fn sqrt_f64(x: f64) -> f64 {
    crate::Dd::from(x).sqrt().to_f64()
}
/// Square root.
pub fn sqrt_f32(x: f32) -> f32 {
    sqrt_f64(x as f64) as f32
}
