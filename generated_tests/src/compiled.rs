//! The compiled functions, callable by name.

use straightline_codegen::Function;

/// The functions of a robot as the build script compiled them.
#[derive(Clone, Copy, Debug)]
pub struct Compiled<T: 'static> {
    /// The robot's name.
    pub robot: &'static str,
    /// Whether only the exact rules were used.
    pub exact: bool,
    /// Name and function: groups of inputs to the output's scalars.
    pub functions: &'static [(&'static str, Call<T>)],
}

/// A compiled function over groups of inputs.
pub type Call<T> = fn(&[Vec<T>]) -> Vec<T>;

impl<T> Compiled<T> {
    /// Whether a function was compiled.
    pub fn has(&self, function: Function) -> bool {
        self.functions.iter().any(|(name, _)| *name == function.name())
    }

    /// Runs a function.
    pub fn call(&self, function: Function, inputs: &[Vec<T>]) -> Vec<T> {
        let found = self.functions.iter().find(|(name, _)| *name == function.name());
        let (_, call) = found.unwrap_or_else(|| panic!("{} of {} was not compiled", function.name(), self.robot));
        call(inputs)
    }
}

/// Everything that was compiled for f64 under all rules: one entry per robot of the data.
pub fn all_rules() -> impl Iterator<Item = &'static Compiled<f64>> {
    F64.iter().filter(|c| !c.exact)
}

/// The robot of that name, compiled for f64 under all rules.
pub fn robot(name: &str) -> &'static Compiled<f64> {
    all_rules().find(|c| c.robot == name).expect("every robot of the data is compiled")
}

/// Inputs as the array that a generated function takes.
fn array<T, const N: usize>(x: &[T]) -> &[T; N] {
    x.try_into().expect("as many inputs as the robot has coordinates")
}

/// Outputs as a list.
trait Flatten<T> {
    fn flatten(&self) -> Vec<T>;
}

macro_rules! flatten_scalar {
    ($t:ty) => {
        impl<const N: usize> Flatten<$t> for [$t; N] {
            fn flatten(&self) -> Vec<$t> {
                self.to_vec()
            }
        }
        impl<const N: usize, const M: usize> Flatten<$t> for [[$t; N]; M] {
            fn flatten(&self) -> Vec<$t> {
                self.concat()
            }
        }
        impl<const N: usize, const M: usize, const K: usize> Flatten<$t> for [[[$t; N]; M]; K] {
            fn flatten(&self) -> Vec<$t> {
                self.concat().concat()
            }
        }
    };
}
flatten_scalar!(f32);
flatten_scalar!(f64);

include!(concat!(env!("OUT_DIR"), "/compiled.rs"));
include!(concat!(env!("OUT_DIR"), "/joints.rs"));

macro_rules! modules {
    ($($(#[$doc:meta])* $name:ident;)*) => {$(
        $(#[$doc])*
        #[allow(clippy::all, dead_code)]
        pub mod $name {
            include!(concat!(env!("OUT_DIR"), "/", stringify!($name), ".rs"));
        }
    )*};
}

modules! {
    /// A floating quadruped in several parts, with the drivers of the package `straightline`.
    lanes_solo12;
    /// An arm in single precision that depends on `core` alone.
    lanes_panda;
    /// An arm with a load that is the same for all states of a batch.
    lanes_payload;
    /// A floating quadruped in several parts; its batches fuse where the machine can.
    fused_solo12;
    /// An arm in several parts.
    generic_panda;
    /// An arm with parallel joints, whose angles are added.
    generic_ur5;
    /// Four legs of three joints.
    limbs_hyq;
    /// Two legs of six joints on the pelvis, two arms of seven on the chest.
    limbs_humanoid;
    /// Four legs, in any scalar.
    limbs_generic;
    /// The planar2r in the contacts of the contact cases.
    contact_planar2r;
    /// The same in any scalar, with the drivers of the package `straightline`.
    contact_planar2r_generic;
    /// The same with products and sums fused, depending on `core` alone.
    contact_planar2r_fused;
    /// The chapter_cylindrical in the contacts of the contact cases.
    contact_chapter_cylindrical;
    /// The chapter_stanford in the contacts of the contact cases.
    contact_chapter_stanford;
    /// The chapter_6r in the contacts of the contact cases.
    contact_chapter_6r;
    /// The puma560 in the contacts of the contact cases.
    contact_puma560;
    /// The ur5 in the contacts of the contact cases.
    contact_ur5;
    /// The panda in the contacts of the contact cases.
    contact_panda;
}
