//! Parquet files in and out of `straightline simulate` and `analyze`.

use parquet::basic::{Compression, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use straightline_cli::experiment::parquet::{bytes, read};
use straightline_simulation::table::DataTable;

const ROBOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/descriptions/planar_2r.toml");

fn scratch(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("parquet");
    fs::create_dir_all(&folder).expect("a folder of the tests");
    folder.join(name)
}

/// What is said on standard error; empty if the command succeeds.
fn straightline(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_straightline")).args(arguments).output().expect("it starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.success(), !said.contains("error"), "{arguments:?}\n{said}");
    said
}

#[test]
fn what_was_written_is_read_to_the_last_bit() {
    let names = ["t", "q.a", "an odd, \"name\""].map(str::to_string).to_vec();
    let number =
        |i: usize, k: usize| (i as f64 + 0.1).sqrt() * 10f64.powi(k as i32 * 40 - 60) * if k == 1 { -1.0 } else { 1.0 };
    let rows = (0..3000).map(|i| (0..3).map(|k| number(i, k)).collect()).collect();
    let (table, path) = (DataTable { names, rows }, scratch("bits.parquet"));
    fs::write(&path, bytes(&table).expect("it can be written")).expect("the file can be written");
    assert_eq!(read(&path).expect("it can be read"), table);
}

#[test]
fn a_run_in_parquet_is_the_run_in_csv_and_goes_back_into_an_analysis() {
    let path = |name: &str| scratch(name).display().to_string();
    let input = path("free.toml");
    fs::write(&input, "[start]\nq = [0.3, -0.2]\n[simulation]\nduration = 0.2\nstop_at_limits = false\n")
        .expect("written");
    let (csv, parquet) = (path("run.csv"), path("run.parquet"));
    for output in [&csv, &parquet] {
        assert_eq!(straightline(&["simulate", ROBOT, "--input", &input, "--output", output]), "");
    }
    let text = fs::read_to_string(&csv).expect("the rows");
    assert_eq!(read(Path::new(&parquet)).expect("the rows").csv(), text);
    let (from_csv, from_parquet, columns) = (path("a.csv"), path("b.csv"), path("b.parquet"));
    assert_eq!(straightline(&["analyze", ROBOT, "--motion", &csv, "--output", &from_csv]), "");
    for output in [&from_parquet, &columns] {
        assert_eq!(straightline(&["analyze", ROBOT, "--motion", &parquet, "--output", output]), "");
    }
    let text = fs::read_to_string(&from_csv).expect("the rows");
    assert_eq!(fs::read_to_string(&from_parquet).expect("the rows"), text);
    assert_eq!(read(Path::new(&columns)).expect("the rows").csv(), text);
}

/// A column as another program writes it: values, and which rows have one.
fn column<T: DataType>(
    group: &mut parquet::file::writer::SerializedRowGroupWriter<'_, Vec<u8>>,
    values: &[T::T],
    levels: &[i16],
) {
    let mut column = group.next_column().expect("a column").expect("one is left");
    column.typed::<T>().write_batch(values, Some(levels), None).expect("values of the type");
    column.close().expect("the column ends");
}

#[test]
fn files_of_other_programs_are_read_and_what_is_no_number_is_said() {
    let kinds = [
        ("t", Physical::DOUBLE),
        ("tau.joint1", Physical::FLOAT),
        ("tau.joint2", Physical::INT64),
        ("remark", Physical::BYTE_ARRAY),
    ];
    let file = |with_text: bool, levels: &[i16]| {
        let fields = kinds.iter().take(if with_text { 4 } else { 3 }).map(|(name, kind)| {
            let field = Type::primitive_type_builder(name, *kind).with_repetition(Repetition::OPTIONAL);
            Arc::new(field.build().expect("a column"))
        });
        let schema = Type::group_type_builder("schema").with_fields(fields.collect()).build().expect("a schema");
        let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
        let mut writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties)).expect("a file");
        for part in 0..2 {
            let mut group = writer.next_row_group().expect("a group of rows");
            let t = if part == 0 { [0.0, 0.1] } else { [0.2, 0.3] };
            column::<DoubleType>(&mut group, &t, &[1, 1]);
            let present = levels.iter().filter(|l| **l == 1).count();
            column::<FloatType>(&mut group, &[0.5, -0.25][..present], levels);
            column::<Int64Type>(&mut group, &[3, -4], &[1, 1]);
            if with_text {
                column::<ByteArrayType>(&mut group, &[ByteArray::from("a"), ByteArray::from("b")], &[1, 1]);
            }
            group.close().expect("the group ends");
        }
        writer.into_inner().expect("the file ends")
    };
    let path = scratch("foreign.parquet");
    fs::write(&path, file(false, &[1, 1])).expect("written");
    let found = read(&path).expect("it can be read");
    assert_eq!(found.names, ["t", "tau.joint1", "tau.joint2"]);
    assert_eq!(found.rows[..2], [vec![0.0, 0.5, 3.0], vec![0.1, -0.25, -4.0]]);
    assert_eq!(found.rows.len(), 4);
    let shown = path.display().to_string();
    assert_eq!(straightline(&["simulate", ROBOT, "--input", &shown]), "");
    for (bytes, words) in [
        (file(true, &[1, 1]), "column `remark` holds no numbers"),
        (file(false, &[1, 0]), "column `tau.joint1` has gaps: 1 numbers in 2 rows"),
        (b"t,tau.joint1\n0,1\n".to_vec(), "foreign.parquet: "),
    ] {
        fs::write(&path, bytes).expect("written");
        let said = straightline(&["simulate", ROBOT, "--input", &shown]);
        assert!(said.contains("error") && said.contains(words), "{said}");
    }
}
