//! How far results may be off: what the tests of this package ask, in one table, with the worst that they find and the reason.
//!
//! What is not here is asked elsewhere for a reason: stress tests stand beside their bounds, as each is a case of its own; error bounds of the
//! compiler are proven (`certify`); and a bound that depends on the case (condition numbers, least pivots) is where that is known.
//!
//! `BOUNDS=1 cargo test -p straightline-generated-tests --test suite -- --nocapture | grep ^bound` prints what is found.

use std::sync::atomic::{AtomicU64, Ordering};

/// A row of the table.
#[derive(Debug)]
pub struct Bound {
    /// Of what, over which scale, in which numbers.
    pub of: &'static str,
    /// What is allowed.
    pub most: f64,
    /// The worst that tests found.
    pub found: f64,
    /// Why so much.
    pub why: &'static str,
    /// The bits of the worst so far in this process.
    worst: AtomicU64,
}

impl Bound {
    /// Whether a result may be off by so much. What is no number may not.
    pub fn allows(&self, error: f64) -> bool {
        // of numbers that are not negative the bits are in order
        if error > 0.0 && self.worst.fetch_max(error.to_bits(), Ordering::Relaxed) < error.to_bits() && print() {
            println!("\nbound {:8.1e} of {:8.1e}: {}", error, self.most, self.of);
        }
        error <= self.most
    }
}

fn print() -> bool {
    std::env::var_os("BOUNDS").is_some()
}

macro_rules! bounds {
    ($($name:ident: $of:literal, $most:literal, found $found:literal, $why:literal;)*) => {
        $(
            #[doc = concat!($of, ": ", $why, ".")]
            pub static $name: Bound =
                Bound { of: $of, most: $most, found: $found, why: $why, worst: AtomicU64::new(0) };
        )*
        /// All rows.
        pub static ALL: &[&Bound] = &[$(&$name),*];
    };
}

bounds! {
    // f64 against a truth in double-double
    CLOSED_FORM: "closed forms, over the sum of the moduli of their terms, f64", 2e-15, found 2.7e-16, "a few roundings of a body or two";
    FUNCTION: "functions of the robots of the data, over the natural scale, f64", 1e-14, found 3.1e-15,
        "some hundred roundings; or 20 times what Pinocchio loses there, if that is more";
    IDENTITY: "two ways to one number, over the sum of the moduli of its terms, f64", 1e-13, found 9.8e-16,
        "both sides are rounded, and scales are those of whole vectors";
    SOLVED_IDENTITY: "H (FD(ID(q̈)) − q̈), over the terms of H q̈, f64", 1e-12, found 4.7e-16, "as identities, after a factorisation of H";
    ORTHOGONAL: "R Rᵀ − 1 and handedness, f64", 1e-14, found 1.3e-15, "products of a dozen rotations";
    MOVED: "torques of a robot that is turned, or cut and welded, over the greatest, double-double of f64 numbers", 1e-15, found 6.2e-17,
        "the numbers of the other file are rounded to f64";
    LOCKED: "locked robots against the whole one held, over the greatest, f64", 2e-14, found 1.1e-15,
        "as functions, and scales of single results may be smaller";
    FUSED: "batches with fused multiply-add, over the greatest, f64", 1e-13, found 7.2e-16, "forward dynamics of a quadruped at random states";
    COUNTED: "inverse dynamics with the fewest operations, over the rms torque of the joint, f64", 5e-15, found 3.1e-15,
        "torques whose weights cancel count as large as they are elsewhere";
    CONTACT: "contact, impact and environment, over the scale of the case, f64", 1e-12, found 8.1e-13,
        "H and the constraints are solved with, at condition numbers of some thousands";
    DRIVE: "functions of drives, over the scale of the case, f64", 1e-12, found 9.8e-15,
        "masses, motors and springs of very different size are solved with";
    MOTION_DERIVATIVE: "derivatives of motion by dual numbers and by complex steps, over the greatest, f64", 1e-11, found 4.2e-16,
        "roundings through the condition number of H, some hundreds, in two other orders";
    TORQUE_DERIVATIVE: "∂τ/∂q̈ against H, in kg m², f64", 1e-14, found 8.9e-16, "two programs for one number of a few kg m²: some tens of roundings";
    GRAVITY_SYMMETRY: "asymmetry of ∂g/∂q, in N m, f64", 1e-12, found 3.6e-15, "torques near 100 N m";
    // what is not rounding: both sides in double-double, whose unit is 1.2e-32
    DATA: "equations against the data, over the natural scale, double-double", 1e-23, found 4.9e-25,
        "the data have 25 digits, and an output may be 1000 times smaller than its scale";
    RANDOM_ROBOT: "equations of random robots against the second author, over the natural scale, double-double", 1e-26, found 3.3e-31,
        "inertias of a hundred links are solved with, and both sides lose digits";
    CONTACT_DATA: "both authors against the cases of contact, over the scale of the case, double-double", 1e-22, found 4.8e-25,
        "the data have 25 digits; H of their stretched robots costs some of double-double's 31";
    CONTACT_AUTHORS: "functional coordinates of two authors, over the robot's reach, double-double", 1e-24, found 3.3e-30,
        "a random robot's H may have a condition number of 1e4";
    DRIVE_AUTHORS: "functions of drives against the chapter's equations, over the greatest, double-double", 1e-24, found 6.0e-29,
        "masses, motors and springs of very different size are solved with";
}

/// Rounding of functions of random robots, over the natural scale, in f64: as of the robots of the data ([`FUNCTION`]), and a rounding more
/// for every joint on the way to the tip.
pub fn of_random_robot(joints: usize) -> f64 {
    FUNCTION.most + 2e-16 * joints as f64
}
