//! One sample of a sweep per row: what the table function `sweep` is made of.

use crate::failure;
use crate::prepared::{PreparedSweep, SampleFigures};
use datafusion::arrow::array::{ArrayRef, AsArray, Float64Array, Int64Array, StringArray, StructArray};
use datafusion::arrow::compute::cast;
use datafusion::arrow::datatypes::{DataType, Field, FieldRef, Fields, Int64Type};
use datafusion::common::exec_err;
use datafusion::error::{DataFusionError, Result};
use datafusion::logical_expr::{
    ColumnarValue, ReturnFieldArgs, ScalarFunctionArgs, ScalarUDFImpl, Signature, Volatility,
};
use datafusion::scalar::ScalarValue;
use std::sync::{Arc, LazyLock};
use straightline_fleets::bounded::BoundedMap;
use straightline_fleets::text::CarriedText;

/// Sweeps that a process keeps at most.
const MOST_SWEEPS: usize = 64;
/// Arguments before the sample.
const LITERALS: usize = 4;

type Prepared = std::result::Result<Arc<PreparedSweep>, Arc<DataFusionError>>;
/// Name and hash of robot and experiment, and the ranges.
type Key = ([(String, [u8; 32]); 2], String);
static SWEEPS: LazyLock<BoundedMap<Key, Prepared>> = LazyLock::new(|| BoundedMap::new(MOST_SWEEPS));

/// `sweep_sample(robot, experiment, ranges, seed, sample)`, whose first four arguments are literals, the texts of files the first two.
#[derive(Debug, PartialEq, Eq, Hash)]
pub struct SweepSample {
    signature: Signature,
}

impl Default for SweepSample {
    fn default() -> SweepSample {
        SweepSample { signature: Signature::any(LITERALS + 1, Volatility::Immutable) }
    }
}

/// A sweep of these literals, made once in a process.
///
/// # Errors
/// What is wrong with them.
pub fn prepared(robot: CarriedText<'_>, experiment: CarriedText<'_>, ranges: &str) -> Result<Arc<PreparedSweep>> {
    let key = ([robot, experiment].map(|text| (text.name.to_string(), *text.hash)), ranges.to_string());
    let make = || PreparedSweep::new(robot, experiment, ranges).map(Arc::new).map_err(Arc::new);
    SWEEPS.get_or_make(key, make).map_err(|wrong| match &*wrong {
        DataFusionError::Plan(text) => DataFusionError::Plan(text.clone()),
        _ => DataFusionError::Shared(wrong),
    })
}

/// The sweep and the seed of a call.
fn called(literals: &[Option<&ScalarValue>]) -> Result<(Arc<PreparedSweep>, u64)> {
    let [Some(robot), Some(experiment), Some(ranges), Some(ScalarValue::UInt64(Some(seed)))] = literals[..LITERALS]
    else {
        return Err(failure::other_plan());
    };
    match (CarriedText::of(robot), CarriedText::of(experiment), ranges.try_as_str().flatten()) {
        (Some(robot), Some(experiment), Some(ranges)) => Ok((prepared(robot, experiment, ranges)?, *seed)),
        _ => Err(failure::other_plan()),
    }
}

fn of_joints(sweep: &PreparedSweep) -> Fields {
    sweep.joints.iter().map(|joint| Field::new(joint, DataType::Float64, true)).collect()
}

/// What a sample has: the numbers that were drawn, energy that the drives give and take \[J\], limits that are exceeded, greatest and effective efforts per
/// joint \[N·m or N\], and why there are none, if so.
pub fn fields(sweep: &PreparedSweep) -> Fields {
    let number = |name: &str| Field::new(name, DataType::Float64, true);
    let drawn = sweep.ranges.list.iter().map(|range| number(&range.path));
    let joints = DataType::Struct(of_joints(sweep));
    let figures = [
        number("given"),
        number("taken"),
        Field::new("exceeded", DataType::Int64, true),
        Field::new("peak", joints.clone(), true),
        Field::new("rms", joints, true),
        Field::new("why", DataType::Utf8, true),
    ];
    drawn.chain(figures).collect()
}

impl ScalarUDFImpl for SweepSample {
    fn name(&self) -> &str {
        "sweep_sample"
    }

    fn signature(&self) -> &Signature {
        &self.signature
    }

    fn return_type(&self, _: &[DataType]) -> Result<DataType> {
        exec_err!("the type of `sweep_sample` follows from its literals")
    }

    fn return_field_from_args(&self, args: ReturnFieldArgs<'_>) -> Result<FieldRef> {
        let (sweep, _) = called(args.scalar_arguments)?;
        Ok(Arc::new(Field::new(self.name(), DataType::Struct(fields(&sweep)), true)))
    }

    fn invoke_with_args(&self, args: ScalarFunctionArgs) -> Result<ColumnarValue> {
        let literals = args.args[..LITERALS].iter().map(|value| match value {
            ColumnarValue::Scalar(literal) => Some(literal),
            ColumnarValue::Array(_) => None,
        });
        let literals: Vec<Option<&ScalarValue>> = literals.collect();
        let (sweep, seed) = called(&literals)?;
        let samples = cast(&args.args[LITERALS].to_array(args.number_rows)?, &DataType::Int64)?;
        let samples = samples.as_primitive::<Int64Type>().values().iter();
        let drawn: Vec<Vec<f64>> = samples.map(|sample| sweep.ranges.drawn(seed, *sample as u64)).collect();
        let found: Vec<_> = drawn.iter().map(|values| sweep.figures(values)).collect();
        let sound: Vec<Option<&SampleFigures>> = found.iter().map(|figures| figures.as_ref().ok()).collect();
        let numbers = |of: &dyn Fn(&SampleFigures) -> f64| -> ArrayRef {
            Arc::new(sound.iter().map(|figures| figures.map(of)).collect::<Float64Array>())
        };
        let per_joint = |what: usize| -> Result<ArrayRef> {
            let columns =
                (0..sweep.joints.len()).map(|joint| numbers(&|figures| figures.efforts[joint][what])).collect();
            Ok(Arc::new(StructArray::try_new_with_length(of_joints(&sweep), columns, None, args.number_rows)?))
        };
        let exceeded: Int64Array = sound.iter().map(|figures| figures.map(|figures| figures.exceeded as i64)).collect();
        let why: StringArray = found.iter().map(|figures| figures.as_ref().err()).collect();
        let mut columns: Vec<ArrayRef> = (0..sweep.ranges.list.len())
            .map(|k| Arc::new(drawn.iter().map(|values| Some(values[k])).collect::<Float64Array>()) as ArrayRef)
            .collect();
        columns.extend([numbers(&|figures| figures.energy[0]), numbers(&|figures| figures.energy[1])]);
        columns.extend([Arc::new(exceeded) as ArrayRef, per_joint(0)?, per_joint(1)?, Arc::new(why)]);
        let found = StructArray::try_new_with_length(fields(&sweep), columns, None, args.number_rows)?;
        Ok(ColumnarValue::Array(Arc::new(found)))
    }
}
