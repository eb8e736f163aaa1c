//! The command as people call it, over Parquet files.

use datafusion::arrow::array::{ArrayRef, Float64Builder, ListBuilder, RecordBatch, StringArray, UInt32Array};
use datafusion::arrow::datatypes::{Field, Schema};
use datafusion::parquet::arrow::ArrowWriter;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Arc;

fn robots() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../robots/descriptions")
}

/// Writes a log of the planar arm: its joints swing, and its drives give what the file's masses ask for at rest.
fn write_log(path: &Path, robot: &str, rows: usize) {
    let four = |x: f64| (x * 1e4).round() / 1e4;
    let mut lists = [0, 1, 2, 3].map(|_| ListBuilder::new(Float64Builder::new()));
    for row in 0..rows {
        let t = row as f64 / 100.0;
        let joint = |k: usize| {
            let w = 1.1 + 0.6 * k as f64;
            [0.7 * (w * t).sin(), 0.7 * w * (w * t).cos(), -0.7 * w * w * (w * t).sin(), 3.5 * (w * t).cos()].map(four)
        };
        for (k, list) in lists.iter_mut().enumerate() {
            list.append_value([Some(joint(0)[k]), Some(joint(1)[k])]);
        }
    }
    let mut columns: Vec<ArrayRef> =
        vec![Arc::new(StringArray::from(vec![robot; rows])), Arc::new(UInt32Array::from_iter_values(0..rows as u32))];
    columns.extend(lists.iter_mut().map(|list| Arc::new(list.finish()) as ArrayRef));
    let names = ["robot", "id", "q", "qd", "qdd", "effort"];
    let fields: Vec<Field> =
        names.iter().zip(&columns).map(|(name, column)| Field::new(*name, column.data_type().clone(), true)).collect();
    let table = RecordBatch::try_new(Arc::new(Schema::new(fields)), columns).unwrap();
    let mut writer = ArrowWriter::try_new(std::fs::File::create(path).unwrap(), table.schema(), None).unwrap();
    writer.write(&table).unwrap();
    writer.close().unwrap();
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    let robots = robots();
    let mut command = Command::new(env!("CARGO_BIN_EXE_straightline-query"));
    command.current_dir(folder).arg("--robots").arg(robots).args(arguments);
    command.output().expect("the command runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("text")
}

fn said(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    text(&output.stdout)
}

const TORQUES: &str =
    "SELECT robot, id, inverse_dynamics('planar2r.urdf', q, qd, qdd) AS tau FROM logs ORDER BY robot, id";

#[test]
fn a_query_over_files_prints_its_rows() {
    let folder = tempfile::tempdir().unwrap();
    write_log(&folder.path().join("monday.parquet"), "north", 150);
    write_log(&folder.path().join("tuesday.parquet"), "south", 250);
    let sql = "SELECT robot, count(*) AS n, round(max(abs(residual('planar2r.urdf', q, qd, qdd, effort)['joint2'])), 3) AS worst FROM logs GROUP BY robot ORDER BY robot";
    let table = said(folder.path(), &[sql, "monday.parquet", "tuesday.parquet"]);
    let lines: Vec<&str> = table.lines().collect();
    assert_eq!(lines.len(), 6, "{table}");
    assert!(lines[1].starts_with("| robot | n   | worst"), "{table}");
    assert!(lines[3].starts_with("| north | 150 |") && lines[4].starts_with("| south | 250 |"), "{table}");
}

#[test]
fn rows_are_the_same_for_any_partitions() {
    let folder = tempfile::tempdir().unwrap();
    write_log(&folder.path().join("a.parquet"), "north", 1500);
    write_log(&folder.path().join("b.parquet"), "south", 700);
    let arguments = |more: &[&'static str]| [more, &["--format", "csv", TORQUES, "a.parquet", "b.parquet"]].concat();
    let wanted = said(folder.path(), &arguments(&["--partitions", "1"]));
    assert_eq!(wanted.lines().count(), 2201);
    assert_eq!(wanted.lines().next(), Some("robot,id,tau.joint1,tau.joint2"));
    for more in [&["--partitions", "7"][..], &["--partitions", "2", "--batch", "100"], &["--batch", "1"]] {
        assert_eq!(said(folder.path(), &arguments(more)), wanted, "{more:?}");
    }
}

#[test]
fn rows_are_written_to_files_and_read_back() {
    let folder = tempfile::tempdir().unwrap();
    write_log(&folder.path().join("a.parquet"), "north", 40);
    for name in ["out.parquet", "out.csv", "out.json"] {
        assert_eq!(said(folder.path(), &["-o", name, TORQUES, "a.parquet"]), "");
    }
    let sum = |column: &str| format!("SELECT count(*) AS n, sum({column}) AS s FROM logs");
    let of_parquet = said(folder.path(), &["--format", "csv", &sum("tau['joint1']"), "out.parquet"]);
    let sql = format!("SELECT count(*) AS n, sum(tau['joint1']) AS s FROM ({TORQUES})");
    assert_eq!(of_parquet, said(folder.path(), &["--format", "csv", &sql, "a.parquet"]));
    let csv = std::fs::read_to_string(folder.path().join("out.csv")).unwrap();
    let json = std::fs::read_to_string(folder.path().join("out.json")).unwrap();
    assert_eq!((csv.lines().count(), json.lines().count()), (41, 40));
    assert!(json.starts_with("{\"robot\":\"north\",\"id\":0,\"tau\":{\"joint1\":"), "{json}");
    let wrong = run(folder.path(), &["-o", "out.xlsx", TORQUES, "a.parquet"]);
    assert_eq!(
        text(&wrong.stderr),
        "error: the name of out.xlsx does not say its form\nhelp: let it end in .parquet, .csv or .json\n"
    );
}

#[test]
fn further_tables_have_names() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("days")).unwrap();
    write_log(&folder.path().join("days/monday.parquet"), "north", 15);
    write_log(&folder.path().join("days/tuesday.parquet"), "south", 25);
    let sql = "SELECT count(*) AS n FROM days";
    assert_eq!(said(folder.path(), &["--format", "csv", "--table", "days=days", sql]), "n\n40\n");
}

#[test]
fn what_is_wrong_is_said_once_without_the_names_of_rules() {
    let folder = tempfile::tempdir().unwrap();
    write_log(&folder.path().join("a.parquet"), "north", 4);
    std::fs::write(folder.path().join("arm.toml"), "[robot]\nname = 3\n").unwrap();
    for (sql, wanted) in [
        (
            "SELECT regressor_normal_equations('panda.urdf', q, qd, qdd, effort) FROM logs",
            "error: `q` has 2 numbers in row 0 of its batch, `panda.urdf` takes 7\nhelp: cardinality(q) = 7 selects the rows that are sound\n",
        ),
        ("SELECT nothing FROM logs", "error: Schema error: No field named nothing."),
    ] {
        let output = run(folder.path(), &[sql, "a.parquet"]);
        assert_eq!(output.status.code(), Some(1));
        assert!(text(&output.stderr).starts_with(wanted), "{}", text(&output.stderr));
    }
    let broken = Command::new(env!("CARGO_BIN_EXE_straightline-query"))
        .current_dir(folder.path())
        .args(["SELECT gravity_force('arm.toml', q) FROM logs", "a.parquet"])
        .output()
        .unwrap();
    let stderr = text(&broken.stderr);
    assert!(stderr.starts_with("error") && stderr.contains("--> arm.toml:2:"), "{stderr}");
}

/// A scheduler and an executor in threads of the test: where they listen.
#[cfg(feature = "cluster")]
fn cluster(folder: &Path) -> String {
    use std::net::{TcpListener, TcpStream};
    use std::time::{Duration, Instant};
    use straightline_cluster::{execute, schedule, ExecutorSettings, SchedulerSettings};

    let free = || TcpListener::bind("127.0.0.1:0").and_then(|socket| socket.local_addr()).expect("a free port").port();
    let [port, results, tasks] = [free(), free(), free()];
    let in_thread = |work: std::pin::Pin<Box<dyn std::future::Future<Output = ()> + Send>>, port: u16| {
        let runtime =
            tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().expect("threads");
        std::thread::spawn(move || runtime.block_on(work));
        let start = Instant::now();
        while TcpStream::connect(("127.0.0.1", port)).is_err() {
            assert!(start.elapsed() < Duration::from_secs(60), "nobody listens at port {port}");
            std::thread::sleep(Duration::from_millis(20));
        }
    };
    let settings = SchedulerSettings { address: ([127, 0, 0, 1], port).into(), patience: Duration::from_secs(60) };
    in_thread(Box::pin(async move { schedule(&settings).await.expect("a scheduler") }), port);
    let settings = ExecutorSettings {
        scheduler: ("127.0.0.1".to_string(), port),
        bind: "127.0.0.1".to_string(),
        host: None,
        ports: [results, tasks],
        tasks: 2,
        folder: Some(folder.to_path_buf()),
        heartbeat: Duration::from_secs(5),
    };
    in_thread(Box::pin(async move { execute(&settings).await.expect("an executor") }), results);
    format!("http://127.0.0.1:{port}")
}

#[cfg(feature = "cluster")]
#[test]
fn a_cluster_gives_the_rows_of_one_process() {
    let (folder, own) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    write_log(&folder.path().join("a.parquet"), "north", 1500);
    write_log(&folder.path().join("b.parquet"), "south", 700);
    // files count from where the executor runs
    let logs = ["a.parquet", "b.parquet"].map(|name| folder.path().join(name).display().to_string());
    let arguments = ["--format", "csv", TORQUES, &logs[0], &logs[1]];
    let wanted = said(folder.path(), &arguments);
    let url = cluster(own.path());
    assert_eq!(said(folder.path(), &[&["--scheduler", &url][..], &arguments].concat()), wanted);
    let wrong = run(folder.path(), &["--scheduler", "http://127.0.0.1:1", TORQUES, &logs[0]]);
    let stderr = text(&wrong.stderr);
    assert!(!wrong.status.success() && stderr.starts_with("error: "), "{stderr}");
    assert!(stderr.ends_with("once executors are there, the same query gives the same rows\n"), "{stderr}");
}
