//! The numbers that programs compute with: a row of a table each.
//!
//! Another one is a row, with the type that computes in it: a [`Real`] with the constants and conversions that f32 has.

use straightline_core::{trig, Dd, Real};

/// Numbers by the types that compute in them. What these types say of themselves stands in no row.
macro_rules! numbers {
    (($d:tt) $($(#[$doc:meta])* $Name:ident($type:ty) {
        name: $name:literal, description: $description:literal, module: $module:literal, c_name: $c_name:literal,
        wider: $wider:expr, trig_ulps: $trig_ulps:literal, trig_domain: $trig_domain:expr, ridge: $ridge:literal,
        code_bytes: $code_bytes:expr $(,)?
    })+) => {
        /// The scalar type of generated code.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Scalar {
            $($(#[$doc])* $Name,)+
        }

        const ROWS: &[NumberRow] = &[$(NumberRow {
            name: $name,
            description: $description,
            module: $module,
            c_name: $c_name,
            bytes: size_of::<$type>(),
            significand: <$type>::MANTISSA_DIGITS,
            epsilon: <$type>::EPSILON as f64,
            tiny: <$type>::MIN_POSITIVE as f64,
            largest: <$type>::MAX as f64,
            wider: $wider,
            trig_ulps: $trig_ulps,
            trig_domain: $trig_domain as f64,
            ridge: $ridge,
            code_bytes: $code_bytes,
            nearest: |x| <$type as Real>::constant(x).into(),
            rounded: |x| (x as $type).into(),
            next: |x| (x as $type).next_up().into(),
            literal: |x| format!("{:?}", x as $type),
            read: |text| text.parse::<$type>().ok().map(f64::from),
        }),+];

        impl Scalar {
            /// All of them.
            pub const ALL: &'static [Scalar] = &[$(Scalar::$Name),+];
        }

        /// An expression in the type that computes in a scalar: `in_scalar!(scalar, T => evaluate::<T>(..))`.
        #[macro_export]
        macro_rules! in_scalar {
            ($d scalar:expr, $d T:ident => $d expression:expr) => {
                match $d scalar {
                    // of f64 itself, conversions from and to f64 are none
                    $(#[allow(clippy::useless_conversion)]
                    $crate::Scalar::$Name => {
                        type $d T = $type;
                        $d expression
                    })+
                }
            };
        }
    };
}

numbers! { ($)
    /// Double precision.
    F64(f64) {
        name: "f64", description: "double precision", module: "double", c_name: "double", wider: None,
        trig_ulps: 0.797, trig_domain: trig::DOMAIN_F64, ridge: 1e-12, code_bytes: [11.3, 398.0, 551.0],
    }
    /// Single precision.
    F32(f32) {
        name: "f32", description: "single precision", module: "single", c_name: "float", wider: Some(Scalar::F64),
        // 0.801, and the 2^-32 more of sums of far angles
        trig_ulps: 0.806, trig_domain: trig::DOMAIN_F32, ridge: 1e-6, code_bytes: [10.6, 406.0, 414.0],
    }
}

/// The columns that a user of a format may ask for.
macro_rules! columns {
    ($($(#[$doc:meta])* $column:ident: $type:ty,)+) => {
        /// What is known of a number format. Numbers of it are held as the f64 that they are.
        struct NumberRow {
            $($column: $type,)+
            nearest: fn(Dd) -> f64,
            rounded: fn(f64) -> f64,
            next: fn(f64) -> f64,
            literal: fn(f64) -> String,
            read: fn(&str) -> Option<f64>,
        }

        impl Scalar {
            $($(#[$doc])*
            pub fn $column(self) -> $type {
                self.row().$column
            })+
        }
    };
}

columns! {
    /// What Rust and users call it.
    name: &'static str,
    /// What it is called in a sentence.
    description: &'static str,
    /// The module of a generated file that has the same items in this scalar.
    module: &'static str,
    /// What C calls it.
    c_name: &'static str,
    /// So many bytes one takes.
    bytes: usize,
    /// So many bits a significand has.
    significand: u32,
    /// The distance from one to the next number.
    epsilon: f64,
    /// The smallest normal number.
    tiny: f64,
    /// The largest finite number.
    largest: f64,
    /// The format in which programs in mixed precision compute what this one is too coarse for.
    wider: Option<Scalar>,
    /// The proven error of its sine and cosine \[ulp\]: see `trig.rs`.
    trig_ulps: f64,
    /// Sine and cosine answer up to here.
    trig_domain: f64,
    /// What is added to the diagonal of a matrix that may be singular, relative to it: far above rounding, far below what is meant.
    ridge: f64,
    /// Bytes of machine code on x86-64, as measured: of an operation, of a call for one sine and cosine, of one for several.
    code_bytes: [f64; 3],
}

impl Scalar {
    fn row(self) -> &'static NumberRow {
        &ROWS[self as usize]
    }

    /// Whether it has fewer bits than what files are read in and states are drawn in, f64.
    pub fn is_short(self) -> bool {
        self.significand() < f64::MANTISSA_DIGITS
    }

    /// The greatest relative error of a rounding: half of [`Scalar::epsilon`].
    pub fn unit(self) -> f64 {
        self.epsilon() / 2.0
    }

    /// The number nearest to a double-double.
    pub fn nearest(self, x: Dd) -> f64 {
        (self.row().nearest)(x)
    }

    /// The number nearest to an f64; infinite beyond the largest.
    pub fn rounded(self, x: f64) -> f64 {
        (self.row().rounded)(x)
    }

    /// The least number above this one.
    pub fn next_up(self, x: f64) -> f64 {
        (self.row().next)(x)
    }

    /// The shortest literal that reads back to the nearest number, which is finite.
    pub fn literal(self, x: f64) -> String {
        (self.row().literal)(x)
    }

    /// The number that a literal stands for; none of what is no literal.
    pub fn read(self, text: &str) -> Option<f64> {
        (self.row().read)(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_that_of_its_type() {
        assert_eq!([Scalar::F64, Scalar::F32].map(Scalar::bytes), [8, 4]);
        assert_eq!([Scalar::F64, Scalar::F32].map(Scalar::significand), [53, 24]);
        for scalar in Scalar::ALL.iter().copied() {
            let unit = scalar.unit();
            assert_eq!(scalar.rounded(1.0 + 0.9 * unit), 1.0, "{scalar:?}");
            assert_eq!(scalar.next_up(1.0), 1.0 + 2.0 * unit, "{scalar:?}");
            assert_eq!(scalar.nearest(Dd::new(1.0, 1.1 * unit)), 1.0 + 2.0 * unit, "{scalar:?}");
            assert_eq!(scalar.read(&scalar.literal(0.1)), Some(scalar.rounded(0.1)), "{scalar:?}");
            assert_eq!(scalar.read(scalar.name()), None);
            assert_eq!(scalar.name(), in_scalar!(scalar, T => std::any::type_name::<T>()));
        }
    }
}
