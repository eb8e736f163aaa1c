//! Folders of LeRobot go into `residuals` as any log does.

use crate::logged::logged;
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{DoubleType, FloatType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{Type, TypePtr};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::model::{load, ModelOptions};

const ROBOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../robots/descriptions/planar_2r.toml");

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("lerobot").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(folder.join("meta")).expect("a folder of the tests");
    fs::create_dir_all(folder.join("data/chunk-000")).expect("a folder of the tests");
    folder
}

fn primitive(name: &str, kind: Physical) -> TypePtr {
    Arc::new(Type::primitive_type_builder(name, kind).with_repetition(Repetition::OPTIONAL).build().expect("a type"))
}

/// name: list<double>.
fn list(name: &str) -> TypePtr {
    let group = |name: &str, repetition, fields, kind| {
        let group = Type::group_type_builder(name).with_repetition(repetition).with_fields(fields);
        Arc::new(group.with_logical_type(kind).build().expect("a type"))
    };
    let items = group("list", Repetition::REPEATED, vec![primitive("element", Physical::DOUBLE)], None);
    group(name, Repetition::OPTIONAL, vec![items], Some(LogicalType::List))
}

/// An episode of so many joints, as LeRobot writes it: lists per row, time in single precision.
fn episode(path: &Path, columns: &[(String, Vec<f64>)], joints: usize) {
    let fields = vec![
        list("observation.state"),
        list("observation.velocity"),
        list("observation.effort"),
        primitive("timestamp", Physical::FLOAT),
        primitive("episode_index", Physical::INT64),
    ];
    let schema = Arc::new(Type::group_type_builder("schema").with_fields(fields).build().expect("a schema"));
    let file = fs::File::create(path).expect("a file");
    let mut writer =
        SerializedFileWriter::new(file, schema, Arc::new(WriterProperties::builder().build())).expect("a file");
    let mut group = writer.next_row_group().expect("a group");
    let rows = columns[0].1.len();
    for prefix in ["q.", "qd.", "tau."] {
        let own: Vec<&Vec<f64>> = columns.iter().filter(|(name, _)| name.starts_with(prefix)).map(|(_, c)| c).collect();
        let numbers: Vec<f64> = (0..rows).flat_map(|i| own.iter().map(move |column| column[i])).collect();
        let repeated: Vec<i16> = (0..numbers.len()).map(|k| i16::from(k % joints != 0)).collect();
        let mut column = group.next_column().expect("a column").expect("one more");
        column
            .typed::<DoubleType>()
            .write_batch(&numbers, Some(&vec![3; numbers.len()]), Some(&repeated))
            .expect("written");
        column.close().expect("written");
    }
    let times: Vec<f32> = columns[0].1.iter().map(|t| (t - columns[0].1[0]) as f32).collect();
    let mut column = group.next_column().expect("a column").expect("one more");
    column.typed::<FloatType>().write_batch(&times, Some(&vec![1; rows]), None).expect("written");
    column.close().expect("written");
    let mut column = group.next_column().expect("a column").expect("one more");
    column.typed::<Int64Type>().write_batch(&vec![0; rows], Some(&vec![1; rows]), None).expect("written");
    column.close().expect("written");
    group.close().expect("written");
    writer.close().expect("written");
}

const INFO: &str = r#"{"codebase_version": "v3.0", "features": {"observation.state": {"dtype": "float32", "names": ["joint1.pos", "joint2.pos"]}}}"#;

fn residuals(folder: &Path) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_straightline"))
        .arg("residuals")
        .arg(ROBOT)
        .arg(folder)
        .output()
        .expect("it starts");
    let text = |bytes| String::from_utf8(bytes).expect("text");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn episodes_are_segments() {
    let folder = folder("two");
    fs::write(folder.join("meta/info.json"), INFO).expect("written");
    let source = Source::new(ROBOT, fs::read_to_string(ROBOT).expect("the robot file"));
    let model = load(&source, &ModelOptions::default()).0.expect("a robot").cast();
    for (k, from) in [0.0, 40.0].into_iter().enumerate() {
        // steps that single precision holds
        let times: Vec<f64> = (0..512).map(|i| from + f64::from(i) / 128.0).collect();
        let path = folder.join(format!("data/chunk-000/file-00{k}.parquet"));
        episode(&path, &logged(&model, &times), 2);
    }
    let (code, said, complaints) = residuals(&folder);
    assert_eq!(code, Some(0), "{complaints}");
    for part in ["1024 of 1024 rows, 128.0 Hz", "the clock jumps back 1 times", "joint2"] {
        assert!(said.contains(part), "{part}: {said}");
    }
}

#[test]
fn what_is_wrong_with_a_folder_is_said() {
    let empty = folder("empty");
    let (code, _, said) = residuals(&empty);
    assert!(code == Some(1) && said.contains("meta/info.json") && said.contains("a list of joints"), "{said}");
    fs::write(empty.join("meta/info.json"), INFO).expect("written");
    assert!(residuals(&empty).2.contains("no file in its folder `data` has rows"));
    fs::write(empty.join("data/a.parquet"), "no Parquet").expect("written");
    let (code, _, said) = residuals(&empty);
    assert!(code == Some(1) && said.contains("a.parquet"), "{said}");
    fs::write(empty.join("meta/info.json"), "{").expect("written");
    assert!(residuals(&empty).2.contains("meta/info.json"));
}
