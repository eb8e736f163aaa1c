//! The numbers that programs compute with.

/// The scalar type of generated code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Scalar {
    /// Double precision.
    F64,
    /// Single precision.
    F32,
}

impl Scalar {
    /// Its Rust name.
    pub fn name(self) -> &'static str {
        match self {
            Scalar::F64 => "f64",
            Scalar::F32 => "f32",
        }
    }

    /// The module of a generated file that has the same items in this scalar.
    pub fn module(self) -> &'static str {
        match self {
            Scalar::F64 => "double",
            Scalar::F32 => "single",
        }
    }

    /// Its size in bytes.
    pub fn bytes(self) -> usize {
        match self {
            Scalar::F64 => 8,
            Scalar::F32 => 4,
        }
    }

    /// The distance from one to the next number.
    pub fn epsilon(self) -> f64 {
        match self {
            Scalar::F64 => f64::EPSILON,
            Scalar::F32 => f64::from(f32::EPSILON),
        }
    }
}
