//! The numbers that programs compute with: a row of a table each.
//!
//! Another one is a row, with the type that computes in it: a [`Real`] with the constants and conversions that f32 has.

use straightline_core::magnitude::Magnitude;
use straightline_core::{short_sines, trig, Dd, Real};

/// Sines and cosines with an absolute error, for small angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShortSines {
    /// |computed − exact| is at most this.
    pub error: f64,
    /// For angles up to here \[rad\].
    pub domain: f64,
}

macro_rules! operators {
    ($($Op:ident $op:ident $by:tt),+) => {
        $(impl std::ops::$Op for EveryScalar {
            type Output = Self;
            fn $op(self, b: Self) -> Self {
                let a = self;
                every!(a b => a $by b)
            }
        })+
    };
}

/// Numbers by the types that compute in them. What these types say of themselves stands in no row.
macro_rules! numbers {
    (($d:tt) $($(#[$doc:meta])* $Name:ident($type:ty) {
        name: $name:literal, description: $description:literal, module: $module:literal, c_name: $c_name:literal,
        c_suffix: $c_suffix:literal, ptx_prefix: $ptx_prefix:literal,
        wider: $wider:expr, trig_ulps: $trig_ulps:literal, trig_domain: $trig_domain:expr, short_sines: $short:expr, ridge: $ridge:literal,
        code_bytes: $code_bytes:expr $(,)?
    })+) => {
        /// The scalar type of generated code.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
        pub enum Scalar {
            $($(#[$doc])* $Name,)+
        }

        const ROWS: &[NumberRow] = &[$(NumberRow {
            name: $name,
            description: $description,
            module: $module,
            c_name: $c_name,
            c_suffix: $c_suffix,
            ptx_prefix: $ptx_prefix,
            bytes: size_of::<$type>(),
            significand: <$type>::MANTISSA_DIGITS,
            epsilon: <$type>::EPSILON as f64,
            tiny: <$type>::MIN_POSITIVE as f64,
            largest: <$type>::MAX as f64,
            wider: $wider,
            trig_ulps: $trig_ulps,
            trig_domain: $trig_domain as f64,
            short_sines: $short,
            ridge: $ridge,
            code_bytes: $code_bytes,
            nearest: |x| <$type as Real>::constant(x).into(),
            rounded: |x| (x as $type).into(),
            next: |x| (x as $type).next_up().into(),
            literal: |x| format!("{:?}", x as $type),
            bits: |x| u64::from((x as $type).to_bits()),
            read: |text| text.parse::<$type>().ok().map(f64::from),
        }),+];

        /// A number in every scalar, and in double-double with its size: what is computed in all of them is compiled once.
        #[allow(non_snake_case)]
        #[derive(Clone, Copy, Debug)]
        pub struct EveryScalar {
            $($Name: $type,)+
            /// In double-double.
            pub wide: Magnitude,
        }

        impl EveryScalar {
            /// With another size.
            #[must_use]
            pub fn of_size(self, size: f64) -> Self {
                EveryScalar { wide: self.wide.of_size(size), ..self }
            }

            /// That number in double-double, zero in all scalars.
            pub fn wide_alone(value: Dd) -> Self {
                EveryScalar { wide: Magnitude::new(value), ..Self::zero() }
            }

            /// The number in a scalar.
            pub fn in_scalar(self, scalar: Scalar) -> f64 {
                match scalar {
                    $(Scalar::$Name => self.$Name.into(),)+
                }
            }
        }

        /// The same expression of numbers of these names in every scalar.
        macro_rules! every {
            ($d($d x:ident)+ => $d value:expr) => {
                EveryScalar {
                    $($Name: {
                        $d(let $d x = $d x.$Name;)+
                        $d value
                    },)+
                    wide: {
                        $d(let $d x = $d x.wide;)+
                        $d value
                    },
                }
            };
        }

        impl Real for EveryScalar {
            fn constant(value: Dd) -> Self {
                EveryScalar { $($Name: Real::constant(value),)+ wide: Real::constant(value) }
            }

            fn sin_cos(self) -> (Self, Self) {
                let x = self;
                // by name: machine numbers have a method of their own that is called so
                (every!(x => Real::sin_cos(x).0), every!(x => Real::sin_cos(x).1))
            }

            fn sin_cos_of_pair([sum, tail]: [Self; 2]) -> (Self, Self) {
                let sin = every!(sum tail => Real::sin_cos_of_pair([sum, tail]).0);
                (sin, every!(sum tail => Real::sin_cos_of_pair([sum, tail]).1))
            }

            fn sin_cos_of_sum(angles: &[Self]) -> (Self, Self) {
                $(#[allow(non_snake_case)]
                let $Name = <$type>::sin_cos_of_sum(&angles.iter().map(|x| x.$Name).collect::<Vec<_>>());)+
                let wide = Magnitude::sin_cos_of_sum(&angles.iter().map(|x| x.wide).collect::<Vec<_>>());
                (EveryScalar { $($Name: $Name.0,)+ wide: wide.0 }, EveryScalar { $($Name: $Name.1,)+ wide: wide.1 })
            }

            fn short_sin_cos_of_sum(angles: &[Self]) -> (Self, Self) {
                $(#[allow(non_snake_case)]
                let $Name = <$type>::short_sin_cos_of_sum(&angles.iter().map(|x| x.$Name).collect::<Vec<_>>());)+
                let wide = Magnitude::short_sin_cos_of_sum(&angles.iter().map(|x| x.wide).collect::<Vec<_>>());
                (EveryScalar { $($Name: $Name.0,)+ wide: wide.0 }, EveryScalar { $($Name: $Name.1,)+ wide: wide.1 })
            }

            fn sqrt(self) -> Self {
                let x = self;
                every!(x => Real::sqrt(x))
            }

            fn sign(self) -> Self {
                let x = self;
                every!(x => Real::sign(x))
            }
        }

        impl std::ops::Neg for EveryScalar {
            type Output = Self;
            fn neg(self) -> Self {
                let x = self;
                every!(x => -x)
            }
        }

        operators!(Add add +, Sub sub -, Mul mul *, Div div /);

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
        name: "f64", description: "double precision", module: "double", c_name: "double", c_suffix: "", ptx_prefix: "0d", wider: None,
        trig_ulps: 0.797, trig_domain: trig::DOMAIN_F64, short_sines: None, ridge: 1e-12, code_bytes: [11.3, 398.0, 551.0],
    }
    /// Single precision.
    F32(f32) {
        name: "f32", description: "single precision", module: "single", c_name: "float", c_suffix: "F", ptx_prefix: "0f",
        wider: Some(Scalar::F64),
        // 0.801, and the 2^-32 more of sums of far angles
        trig_ulps: 0.806, trig_domain: trig::DOMAIN_F32,
        short_sines: Some(ShortSines { error: short_sines::ERROR_F32, domain: short_sines::DOMAIN_F32 as f64 }), ridge: 1e-6, code_bytes: [10.6, 406.0, 414.0],
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
            bits: fn(f64) -> u64,
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
    /// What stands behind a constant of it in C.
    c_suffix: &'static str,
    /// What stands before the bits of a constant of it in PTX.
    ptx_prefix: &'static str,
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
    /// What is proven of its [short sines](straightline_core::short_sines), if it has any.
    short_sines: Option<ShortSines>,
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

    /// The bits of a number of it.
    pub fn bits(self, x: f64) -> u64 {
        (self.row().bits)(x)
    }

    /// The number that a literal stands for; none of what is no literal.
    pub fn read(self, text: &str) -> Option<f64> {
        (self.row().read)(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use straightline_core::random::Random;

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

    /// All that a scalar does.
    fn computed<T: Real>(a: Dd, b: Dd) -> Vec<T> {
        let [a, b] = [a, b].map(T::constant);
        let short = T::short_sin_cos_of_sum(&[b, a]);
        let pairs = [a.sin_cos(), T::sin_cos_of_sum(&[a, b]), T::sin_cos_of_pair([b, a]), short];
        let ([u, v], [w, x]) = T::sin_cos_lanes_of_pairs([[a, b], [b, a]]);
        let own = [a + b, a - b, a * b, a / b, -a, a.sqrt(), b.sqrt(), a.sign(), b.sign(), u, v, w, x];
        pairs.into_iter().flat_map(|(s, c)| [s, c]).chain(own).collect()
    }

    #[test]
    fn every_scalar_is_each_of_them() {
        let mut random = Random(3);
        for _ in 0..1000 {
            let [a, b] = [1.0, 40.0].map(|size| Dd::from(random.symmetric(size)) + Dd::from(random.symmetric(1e-17)));
            let every = computed::<EveryScalar>(a, b);
            let bits = |x: Vec<f64>| x.into_iter().map(f64::to_bits).collect::<Vec<u64>>();
            for scalar in Scalar::ALL.iter().copied() {
                let alone = in_scalar!(scalar, T => computed::<T>(a, b).into_iter().map(f64::from).collect());
                assert_eq!(bits(every.iter().map(|x| x.in_scalar(scalar)).collect()), bits(alone), "{scalar:?}");
            }
            for (every, wide) in every.into_iter().zip(computed::<Magnitude>(a, b)) {
                assert_eq!(format!("{:?}", every.wide), format!("{wide:?}"));
            }
        }
    }
}
