//! Lists of every kind, nulls, and lists of another length.

use crate::helpers::{plain, session, to_bits};
use datafusion::arrow::array::{Array, ArrayRef, AsArray, Int32Array, ListArray, RecordBatch, StructArray};
use datafusion::arrow::buffer::{NullBuffer, OffsetBuffer};
use datafusion::arrow::compute::{cast, take_record_batch};
use datafusion::arrow::datatypes::{DataType, Field, Float64Type, Schema};
use std::sync::Arc;
use straightline_codegen::Function;
use straightline_fleet_testing::log::{lists, log, Log};
use straightline_fleet_testing::query::{bits, rows};

const SQL: &str = "SELECT id, inverse_dynamics('panda.urdf', q, qd, qdd) AS tau FROM logs ORDER BY id";

fn torques(log: &Log) -> Vec<Vec<u64>> {
    let [q, qd, qdd, _] = log.columns.each_ref().map(|column| &column[..]);
    to_bits(&plain("panda.urdf", Function::InverseDynamics, &[q, qd, qdd]))
}

#[test]
fn lists_of_every_kind_are_taken() {
    let log = log(7, 100);
    let field = |name: &str, kind: DataType| Arc::new(Field::new(name, kind, true));
    for kind in [
        DataType::new_list(DataType::Float64, true),
        DataType::LargeList(field("element", DataType::Float64)),
        DataType::FixedSizeList(field("item", DataType::Float64), 7),
        // as Parquet brings it back
        DataType::FixedSizeList(field("element", DataType::Float64), 7),
        DataType::ListView(field("item", DataType::Float64)),
    ] {
        let found = rows(&session(&log.batch(&kind), 2, 64), SQL).unwrap();
        assert_eq!(bits(&found, "tau"), torques(&log), "{kind}");
    }
}

#[test]
fn single_precision_is_widened_and_integers_are_taken() {
    let narrow = |x: f64| f64::from(x as f32);
    let log = log(7, 100);
    let narrowed =
        Log { joints: 7, first: 0, columns: log.columns.clone().map(|c| c.into_iter().map(narrow).collect()) };
    for kind in [DataType::Float32, DataType::Float16] {
        let kept: DataType = DataType::new_list(kind.clone(), true);
        let wanted = match kind {
            DataType::Float32 => torques(&narrowed),
            _ => {
                let table = log.batch(&kept);
                let wide = |name: &str| -> Vec<f64> {
                    let wide = cast(table.column_by_name(name).unwrap(), &lists()).unwrap();
                    wide.as_list::<i32>().values().as_primitive::<Float64Type>().values().to_vec()
                };
                torques(&Log { joints: 7, first: 0, columns: [wide("q"), wide("qd"), wide("qdd"), Vec::new()] })
            }
        };
        assert_eq!(bits(&rows(&session(&log.batch(&kept), 1, 64), SQL).unwrap(), "tau"), wanted, "{kind}");
    }
    let whole =
        Log { joints: 7, first: 0, columns: log.columns.clone().map(|c| c.into_iter().map(f64::round).collect()) };
    let table = whole.batch(&DataType::new_list(DataType::Int64, true));
    assert_eq!(bits(&rows(&session(&table, 1, 64), SQL).unwrap(), "tau"), torques(&whole));
}

#[test]
fn columns_per_joint_are_taken_as_a_list_or_as_a_struct() {
    let log = log(2, 50);
    let [q, qd, qdd, _] = log.columns.each_ref().map(|column| &column[..]);
    let wanted = to_bits(&plain("planar2r.urdf", Function::InverseDynamics, &[q, qd, qdd]));
    let context = session(&log.table(), 1, 8192);
    for q in ["make_array(q[1], q[2])", "named_struct('joint1', q[1], 'joint2', q[2])"] {
        let sql = format!("SELECT id, inverse_dynamics('planar2r.urdf', {q}, qd, qdd) AS tau FROM logs ORDER BY id");
        assert_eq!(bits(&rows(&context, &sql).unwrap(), "tau"), wanted, "{q}");
    }
    let sql =
        "SELECT inverse_dynamics('planar2r.urdf', named_struct('joint2', q[2], 'joint1', q[1]), qd, qdd) FROM logs";
    let wrong = rows(&context, sql).unwrap_err();
    assert_eq!(
        wrong,
        "Error during planning: `q` has the fields joint2, joint1\nhelp: `planar2r.urdf` has, in this order, joint1, joint2"
    );
}

/// The log with null lists, null numbers in lists, and null lists that hide numbers.
fn with_nulls(log: &Log) -> RecordBatch {
    let table = log.table();
    let rows = table.num_rows();
    let is_there = |row: usize| !row.is_multiple_of(5);
    let with = |column: &ArrayRef, nulls: NullBuffer| -> ArrayRef {
        let list = column.as_list::<i32>();
        let DataType::List(field) = list.data_type() else { panic!("a list") };
        Arc::new(ListArray::new(field.clone(), list.offsets().clone(), list.values().clone(), Some(nulls)))
    };
    let hidden = with(table.column(1), (0..rows).map(is_there).collect());
    // as they are read from files: without numbers
    let order = (0..rows as i32).map(|row| (row % 7 != 3).then_some(row));
    let absent = take_record_batch(&table, &Int32Array::from_iter(order)).unwrap().column(2).clone();
    let list = table.column(3).as_list::<i32>();
    let holes: NullBuffer = (0..rows * 7).map(|k| k % (7 * 11) != 40).collect();
    let numbers = list.values().as_primitive::<Float64Type>().clone();
    let numbers = datafusion::arrow::array::Float64Array::new(numbers.values().clone(), Some(holes));
    let holes = ListArray::new(
        Arc::new(Field::new_list_field(DataType::Float64, true)),
        OffsetBuffer::from_lengths(std::iter::repeat_n(7, rows)),
        Arc::new(numbers),
        None,
    );
    let columns = vec![table.column(0).clone(), hidden, absent, Arc::new(holes), table.column(4).clone()];
    RecordBatch::try_new(Arc::new(Schema::new(table.schema().fields().clone())), columns).unwrap()
}

#[test]
fn a_row_without_a_state_has_no_result_and_the_others_keep_their_bits() {
    let log = log(7, 231);
    let wanted = torques(&log);
    for batch in [1, 100, 8192] {
        let found = rows(&session(&with_nulls(&log), 2, batch), SQL).unwrap();
        let tau: &StructArray = found.column_by_name("tau").unwrap().as_struct();
        for (row, own) in bits(&found, "tau").iter().enumerate() {
            let is_null = row % 5 == 0 || row % 7 == 3 || row % 11 == 5;
            assert_eq!(tau.is_null(row), is_null, "row {row}");
            assert_eq!(tau.column(4).is_null(row), is_null, "row {row}");
            assert!(is_null || *own == wanted[row], "row {row}");
        }
    }
    let context = session(&log.table(), 1, 8192);
    let found = rows(&context, "SELECT inverse_dynamics('panda.urdf', NULL, qd, qdd) AS tau FROM logs").unwrap();
    assert_eq!(found.column(0).null_count(), 231);
}

#[test]
fn a_list_of_another_length_is_told_with_its_row() {
    let context = session(&log(7, 10).table(), 1, 8192);
    let sql = "SELECT inverse_dynamics('panda.urdf', CASE WHEN id = 4 THEN array_slice(q, 1, 6) ELSE q END, qd, qdd) FROM logs";
    assert_eq!(
        rows(&context, sql).unwrap_err(),
        "Execution error: `q` has 6 numbers in row 4 of its batch, `panda.urdf` takes 7\n\
         help: cardinality(q) = 7 selects the rows that are sound"
    );
}
