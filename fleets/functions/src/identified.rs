//! Base parameters of normal equations: `identified_parameters(regressor_normal_equations(…))`.
//!
//! The augmented matrix \[Y τ\]ᵀ\[Y τ\] is factored into RᵀR in double-double; R has what the rows had, and goes through the orthogonal fit of `straightline-logs`, which
//! pivots, and says what the data cannot tell.

use crate::failure;
use crate::normal_equations::{fields, in_triangle};
use datafusion::arrow::array::{
    Array, AsArray, Float64Builder, ListBuilder, StringBuilder, StructArray, StructBuilder,
};
use datafusion::arrow::datatypes::{DataType, Field, Fields, Float64Type, UInt64Type};
use datafusion::error::Result;
use datafusion::logical_expr::{ColumnarValue, ScalarFunctionArgs, ScalarUDFImpl, Signature, Volatility};
use std::sync::Arc;
use straightline_core::Dd;
use straightline_logs::fit::{Fitted, LeastSquares};

const NAME: &str = "identified_parameters";
/// A pivot that is less than this part of its column is rounding: entries of the matrix are rounded products, off by 2⁻⁵³ each.
const LEAST_PIVOT: f64 = 1e-14;

/// The function, which gives a list of structs: the base parameter, its value by the robot file, the value that was identified, and its standard
/// error, as if what is left were white and of one size on all joints; the latter two null where the data cannot tell.
#[derive(Debug, PartialEq, Eq, Hash)]
pub struct IdentifiedParameters {
    signature: Signature,
}

impl Default for IdentifiedParameters {
    fn default() -> IdentifiedParameters {
        IdentifiedParameters { signature: Signature::user_defined(Volatility::Immutable) }
    }
}

/// Sums of one group.
struct NormalEquations<'a> {
    equations: u64,
    gram: &'a [f64],
    moments: &'a [f64],
    square: f64,
}

/// The fields of a parameter.
fn of_parameter() -> Fields {
    let number = |name| Field::new(name, DataType::Float64, true);
    vec![Field::new("parameter", DataType::Utf8, true), number("nominal"), number("value"), number("error")].into()
}

fn item() -> Field {
    Field::new_list_field(DataType::Struct(of_parameter()), true)
}

impl NormalEquations<'_> {
    /// Rows of R, each with its right-hand side: as many equations as columns, and one that has what is left.
    fn triangle(&self) -> Vec<Vec<f64>> {
        let n = self.moments.len();
        let entry = |i: usize, k: usize| match (i == n, k == n) {
            (true, true) => self.square,
            (false, true) => self.moments[i],
            _ => self.gram[in_triangle(n, i, k)],
        };
        let mut r: Vec<Vec<Dd>> = Vec::with_capacity(n + 1);
        for i in 0..=n {
            // r_ii² = a_ii − Σ r_ki²;  r_ij = (a_ij − Σ r_ki r_kj) / r_ii
            let left = |k: usize| r.iter().fold(Dd::new(entry(i, k), 0.0), |sum, row| sum - row[i] * row[k]);
            let pivot = left(i);
            let is_rounding = pivot.to_f64() <= LEAST_PIVOT * entry(i, i);
            let root = pivot.sqrt();
            let of = |k: usize| if k < i || is_rounding { Dd::new(0.0, 0.0) } else { left(k) / root };
            let row = (0..=n).map(of).collect();
            r.push(row);
        }
        r.iter().map(|row| row.iter().map(|x| x.to_f64()).collect()).collect()
    }

    fn fitted(&self) -> Fitted {
        let n = self.moments.len();
        let mut fit = LeastSquares::new(n);
        let triangle = self.triangle();
        triangle.iter().for_each(|row| fit.push(&row[..n], row[n]));
        let mut found = fit.finish(None);
        // the fit knows of the triangle's rows; what is left is that of all
        let left = found.rms.powi(2) * found.rows as f64;
        let freedom = (self.equations as f64 - (n - found.untold.len()) as f64).max(1.0);
        let factor = (left / freedom / found.variance).sqrt();
        found.errors.iter_mut().for_each(|error| *error *= factor);
        found
    }
}

impl ScalarUDFImpl for IdentifiedParameters {
    fn name(&self) -> &str {
        NAME
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn coerce_types(&self, given: &[DataType]) -> Result<Vec<DataType>> {
        let is_ours = |kind: &DataType| matches!(kind, DataType::Struct(found) if *found == fields());
        match given {
            [kind] if is_ours(kind) => Ok(vec![kind.clone()]),
            [kind] => Err(failure::no_equations(kind)),
            _ => Err(failure::no_equations(&format!("{} arguments", given.len()))),
        }
    }

    fn return_type(&self, _: &[DataType]) -> Result<DataType> {
        Ok(DataType::List(Arc::new(item())))
    }

    fn invoke_with_args(&self, args: ScalarFunctionArgs) -> Result<ColumnarValue> {
        let given = args.args[0].to_array(args.number_rows)?;
        let given: &StructArray = given.as_struct();
        let list = |k: usize, row: usize| given.column(k).as_list::<i32>().value(row);
        let mut lists = ListBuilder::new(StructBuilder::from_fields(of_parameter(), 0)).with_field(item());
        for row in 0..given.len() {
            if given.is_null(row) {
                lists.append(false);
                continue;
            }
            let [names, nominal, gram, moments] = [2, 3, 4, 5].map(|k| list(k, row));
            let equations = given.column(1).as_primitive::<UInt64Type>().value(row);
            let fitted = NormalEquations {
                equations,
                gram: gram.as_primitive::<Float64Type>().values(),
                moments: moments.as_primitive::<Float64Type>().values(),
                square: given.column(6).as_primitive::<Float64Type>().value(row),
            }
            .fitted();
            let (names, nominal) = (names.as_string::<i32>(), nominal.as_primitive::<Float64Type>());
            let of_structs = lists.values();
            for (k, name) in names.iter().enumerate() {
                let is_told = !fitted.untold.contains(&k);
                of_structs.field_builder::<StringBuilder>(0).expect("a name").append_option(name);
                let told = |x: f64| is_told.then_some(x);
                let numbers = [Some(nominal.value(k)), told(fitted.coefficients[k]), told(fitted.errors[k])];
                for (at, x) in numbers.into_iter().enumerate() {
                    of_structs.field_builder::<Float64Builder>(at + 1).expect("a number").append_option(x);
                }
                of_structs.append(true);
            }
            lists.append(true);
        }
        Ok(ColumnarValue::Array(Arc::new(lists.finish())))
    }
}
