//! Types of run-time parameters, checked when they are made: the ten inertial parameters of a body, numbers of a drive.

use super::{number, of_scalar, routine};
use crate::description::drives::DriveNumber;
use crate::emit::module::{ParameterOf, ParameterType};
use crate::emit::Style;
use crate::identifier::doc;
use crate::program::written::DriveNumbers;
use straightline_graph::Scalar;

/// The types of run-time parameters, with what they share.
pub(super) fn types(parameters: &[ParameterType], style: Style) -> String {
    let is_of_drive = |p: &ParameterType| matches!(p.of, ParameterOf::Drive(..));
    let mut out = String::new();
    if parameters.iter().any(|p| !is_of_drive(p)) {
        out.push_str(&of_scalar(CHECK, style.scalar));
    }
    if parameters.iter().any(is_of_drive) {
        out.push_str(&of_scalar(CHECK_DRIVE, style.scalar));
    }
    for parameter in parameters {
        out.push_str(&match &parameter.of {
            ParameterOf::Body(frame) => body(parameter, frame, style.scalar),
            ParameterOf::Drive(name, numbers) => drive(parameter, name, numbers, style.scalar),
        });
        out.push_str(&routine(&parameter.constructor));
    }
    out
}

/// What all bodies of a file share: the error type and the check.
const CHECK: &str = "
/// Why inertial parameters cannot belong to a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unphysical {
    /// A number is not finite.
    NotFinite,
    /// The mass is negative.
    NegativeMass,
    /// There is inertia, and no mass to have it.
    InertiaWithoutMass,
    /// The inertia about the centre of mass belongs to no distribution of mass: a principal moment is negative, or exceeds the
    /// sum of the other two.
    Inertia,
}

impl core::fmt::Display for Unphysical {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Unphysical::NotFinite => \"an inertial parameter is not finite\",
            Unphysical::NegativeMass => \"a mass is negative\",
            Unphysical::InertiaWithoutMass => \"a body without mass has inertia\",
            Unphysical::Inertia => \"a principal moment of inertia is negative or exceeds the sum of the other two\",
        })
    }
}

/// A body is possible if its mass is not negative and its second moment ½ tr(J) 1 − J about the centre of mass has no negative
/// eigenvalue; a rounding error of the trace is forgiven.
fn check_inertia(mass: {t}, com: &[{t}; 3], inertia: &[{t}; 6]) -> Result<(), Unphysical> {
    let [jxx, jxy, jxz, jyy, jyz, jzz] = *inertia;
    if ![mass, com[0], com[1], com[2], jxx, jxy, jxz, jyy, jyz, jzz].iter().all(|x| x.is_finite()) {
        return Err(Unphysical::NotFinite);
    }
    if mass < 0.0 {
        return Err(Unphysical::NegativeMass);
    }
    if mass == 0.0 && inertia.iter().any(|x| *x != 0.0) {
        return Err(Unphysical::InertiaWithoutMass);
    }
    let half = 0.5 * (jxx + jyy + jzz);
    let slack = 16.0 * {t}::EPSILON * half;
    let (a, b, c) = (half - jxx + slack, half - jyy + slack, half - jzz + slack);
    let (d, e, f) = (-jxy, -jxz, -jyz);
    let minors = [a * b - d * d, a * c - e * e, b * c - f * f];
    let determinant = a * minors[2] - d * (d * c - f * e) + e * (d * f - b * e);
    let possible = a >= 0.0 && b >= 0.0 && c >= 0.0 && minors.iter().all(|m| *m >= 0.0);
    if possible && determinant >= -slack * half * half {
        Ok(())
    } else {
        Err(Unphysical::Inertia)
    }
}
";

/// The type of a body on a frame.
fn body(parameter: &ParameterType, frame: &str, scalar: Scalar) -> String {
    let ParameterType { name: type_name, input: name, scalars, .. } = parameter;
    let t = scalar.name();
    let frame = doc(frame);
    format!(
        "
/// A body on `{frame}`, as the functions take it: made outside the control loop, checked once.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub struct {type_name}([{t}; {scalars}]);

impl {type_name} {{
    /// No mass at all.
    pub const NONE: {type_name} = {type_name}([0.0; {scalars}]);

    /// A body of this mass \\[kg\\], with its centre of mass \\[m\\] in the frame `{frame}` and this inertia about the centre of mass
    /// in the frame's axes: xx, xy, xz, yy, yz, zz \\[kg·m²\\].
    ///
    /// # Errors
    /// No body has such parameters.
    pub fn new(mass: {t}, com: [{t}; 3], inertia: [{t}; 6]) -> Result<{type_name}, Unphysical> {{
        check_inertia(mass, &com, &inertia)?;
        let mut parameters = [mass; {scalars}];
        {name}_parameters(&[mass], &com, &inertia, &mut parameters);
        Ok({type_name}(parameters))
    }}
}}

"
    )
}

/// What all drives of a file share: the error type and the check.
const CHECK_DRIVE: &str = "
/// Why numbers cannot be those of a drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OutOfRange {
    /// The number.
    pub number: &'static str,
    /// What it must be.
    pub must: &'static str,
}

impl core::fmt::Display for OutOfRange {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, \"`{}` must be {}\", self.number, self.must)
    }
}

/// A number of a drive is finite and in its range.
fn check_number(number: &'static str, x: {t}, holds: bool, must: &'static str) -> Result<(), OutOfRange> {
    match (x.is_finite(), holds) {
        (true, true) => Ok(()),
        (true, false) => Err(OutOfRange { number, must }),
        (false, _) => Err(OutOfRange { number, must: \"finite\" }),
    }
}
";

/// The types of a drive and of its numbers.
fn drive(parameter: &ParameterType, drive: &str, numbers: &DriveNumbers, scalar: Scalar) -> String {
    let ParameterType { name: type_name, input: name, scalars, .. } = parameter;
    let t = scalar.name();
    let of_numbers = format!("{type_name}Numbers");
    let fields = |text: &dyn Fn(&DriveNumber) -> String| numbers.numbers.iter().map(text).collect::<String>();
    let list = |items: Vec<String>| items.join(", ");
    let declared = fields(&|n| format!("    /// {}.\n    pub {}: {t},\n", n.quantity.meaning, n.name));
    let values = list(numbers.numbers.iter().map(|n| format!("{}: {}", n.name, number(n.value, scalar))).collect());
    let nominal = list(numbers.nominal.iter().map(|x| number(scalar.nearest(*x), scalar)).collect());
    let checks = fields(&|n| {
        let (name, must) = (&n.name, n.quantity.at_run_time);
        let comparisons = must.comparisons().iter().map(|(how, with)| format!("numbers.{name} {how} {with:?}"));
        let condition = comparisons.collect::<Vec<_>>().join(" && ");
        format!("        check_number({name:?}, numbers.{name}, {condition}, {:?})?;\n", must.words().0)
    });
    let given = list(numbers.numbers.iter().map(|n| format!("numbers.{}", n.name)).collect());
    let drive = doc(drive);
    let first = &numbers.numbers[0].name;
    format!(
        "
/// Numbers of the drive `{drive}`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct {of_numbers} {{
{declared}}}

impl {of_numbers} {{
    /// Those of the robot file.
    pub const NOMINAL: {of_numbers} = {of_numbers} {{ {values} }};
}}

impl Default for {of_numbers} {{
    fn default() -> {of_numbers} {{
        {of_numbers}::NOMINAL
    }}
}}

/// The drive `{drive}`, as the functions take it: made outside the control loop, checked once.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub struct {type_name}([{t}; {scalars}]);

impl {type_name} {{
    /// With the numbers of the robot file.
    pub const NOMINAL: {type_name} = {type_name}([{nominal}]);

    /// With these numbers; the others are those of the robot file.
    ///
    /// # Errors
    /// No drive has such numbers, or what follows from them is not finite.
    pub fn new(numbers: {of_numbers}) -> Result<{type_name}, OutOfRange> {{
{checks}        let mut parameters = [numbers.{first}; {scalars}];
        {name}_parameters(&[{given}], &mut parameters);
        check_number(\"numbers\", 0.0, parameters.iter().all(|x| x.is_finite()), \"of such sizes that what follows from them is finite\")?;
        Ok({type_name}(parameters))
    }}
}}

impl Default for {type_name} {{
    fn default() -> {type_name} {{
        {type_name}::NOMINAL
    }}
}}

"
    )
}
