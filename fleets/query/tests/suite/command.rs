//! The command as people call it, over Parquet files.

use datafusion::arrow::array::{ArrayRef, RecordBatch, StringArray};
use std::path::Path;
use std::process::{Command, Output};
use std::sync::Arc;
use straightline_fleet_testing::log::{log, write};
use straightline_fleet_testing::robots;

/// Writes a log of the planar arm, of a robot of that name.
fn write_log(path: &Path, robot: &str, rows: usize) {
    let table = log(2, rows).table();
    let names: ArrayRef = Arc::new(StringArray::from(vec![robot; rows]));
    let columns = std::iter::once(("robot", names));
    let schema = table.schema();
    let others = schema.fields().iter().map(|field| field.name().as_str()).zip(table.columns().iter().cloned());
    write(path, [RecordBatch::try_from_iter(columns.chain(others)).expect("columns of one length")]);
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_straightline-query"));
    command.current_dir(folder).arg("--robots").arg(robots()).args(arguments);
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
    assert!(stderr.starts_with("error[") && stderr.contains("--> arm.toml:2:"), "{stderr}");
}

#[test]
fn a_sweep_is_a_table_of_its_own() {
    let folder = tempfile::tempdir().unwrap();
    let experiment = robots().join("../experiments/panda_reach.toml");
    let sql = format!(
        "SELECT count(*) AS n, count(why) AS wrong FROM sweep('panda.urdf', '{}', 'panda_link7.mass=0.5:3', 20, 7)",
        experiment.display()
    );
    assert_eq!(said(folder.path(), &["--format", "csv", &sql]), "n,wrong\n20,0\n");
}

/// A scheduler and an executor in threads of the test: where they listen.
#[cfg(feature = "cluster")]
fn cluster(folder: &Path) -> String {
    use std::future::Future;
    use std::pin::Pin;
    use std::time::Duration;
    use straightline_cluster::{execute, schedule, ExecutorSettings, SchedulerSettings};
    use straightline_fleet_testing::processes::{free_port, wait_for};
    use straightline_fleet_testing::query::runtime;

    let [port, results, tasks] = [free_port(), free_port(), free_port()];
    let in_thread = |work: Pin<Box<dyn Future<Output = ()> + Send>>, port: u16| {
        std::thread::spawn(move || runtime().block_on(work));
        wait_for(port);
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
