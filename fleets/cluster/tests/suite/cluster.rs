//! Rows of a cluster are those of one process, also when executors are lost.

use datafusion::arrow::array::{AsArray, RecordBatch};
use datafusion::arrow::compute::concat_batches;
use datafusion::arrow::datatypes::UInt32Type;
use datafusion::prelude::{SessionConfig, SessionContext};
use futures::StreamExt;
use std::path::{Path, PathBuf};
use std::time::Duration;
use straightline_cluster::register;
use straightline_fleet_testing::log::{log_at, write};
use straightline_fleet_testing::processes::{cluster, executor};
use straightline_fleet_testing::project;
use straightline_fleet_testing::query::{collected, read_logs, runtime};
use straightline_fleets::RobotFolder;

/// Files of a log, which are as many partitions.
const FILES: usize = 6;
/// A query ends within this time, or fails: then something hangs.
const LONGEST: Duration = Duration::from_secs(240);

/// Writes a log of the UR5.
fn write_logs(folder: &Path, rows: usize) -> PathBuf {
    let logs = folder.join("logs");
    std::fs::create_dir(&logs).unwrap();
    for k in 0..FILES {
        write(&logs.join(format!("hour{k}.parquet")), [log_at(100.0, 6, k * rows..(k + 1) * rows).table()]);
    }
    logs
}

async fn run(context: &SessionContext, logs: &Path, sql: &str) -> datafusion::error::Result<RecordBatch> {
    register(context, &RobotFolder::at(project()));
    read_logs(context, logs).await?;
    collected(context, sql).await
}

fn config() -> SessionConfig {
    // a task per file
    SessionConfig::new().with_target_partitions(FILES).set_bool("datafusion.optimizer.repartition_file_scans", false)
}

fn embedded(logs: &Path, sql: &str) -> RecordBatch {
    runtime().block_on(run(&SessionContext::new_with_config(config()), logs, sql)).unwrap()
}

/// By a cluster, while something happens to it.
fn distributed(url: &str, logs: &Path, sql: &str, meanwhile: impl FnOnce() + Send) -> Result<RecordBatch, String> {
    std::thread::scope(|scope| {
        let query = scope.spawn(|| {
            runtime().block_on(async {
                let context = straightline_cluster::session(url, config()).await.map_err(|wrong| wrong.to_string())?;
                let rows = tokio::time::timeout(LONGEST, run(&context, logs, sql)).await;
                rows.map_err(|_| format!("no answer after {LONGEST:?}"))?.map_err(|wrong| wrong.to_string())
            })
        });
        meanwhile();
        query.join().expect("queries do not panic")
    })
}

/// Bits of the rows, by their keys.
fn bits(table: &RecordBatch) -> Vec<(u32, Vec<u64>)> {
    let keys = table.column(0).as_primitive::<UInt32Type>().values().to_vec();
    keys.into_iter().zip(straightline_fleet_testing::query::bits(table, "r")).collect()
}

const SWEEP: &str = "SELECT * FROM sweep('descriptions/panda.urdf', 'experiments/panda_reach.toml', 'panda_link7.mass=0.5:3', 50, 7) ORDER BY sample";
const RESIDUALS: &str = "SELECT id, residual('descriptions/ur5.urdf', q, qd, qdd, effort) AS r FROM logs ORDER BY id";

#[test]
fn rows_are_those_of_one_process_for_any_number_of_executors() {
    let folder = tempfile::tempdir().unwrap();
    let logs = write_logs(folder.path(), 3000);
    let wanted = bits(&embedded(&logs, RESIDUALS));
    assert_eq!(wanted.len(), FILES * 3000);
    let equations =
        "SELECT regressor_normal_equations('descriptions/ur5.urdf', q, qd, qdd, effort) AS n FROM logs WHERE id % 10 = 0";
    let sums = embedded(&logs, equations);
    let sweep = embedded(&logs, SWEEP);
    assert_eq!(sweep.num_rows(), 50);
    for executors in [1, 2] {
        let cluster = cluster(executors, 1, 60, folder.path());
        assert_eq!(bits(&distributed(&cluster.url, &logs, RESIDUALS, || ()).unwrap()), wanted, "{executors} executors");
        let found = distributed(&cluster.url, &logs, equations, || ()).unwrap();
        assert_eq!(found.column(0), sums.column(0), "{executors} executors");
        assert_eq!(distributed(&cluster.url, &logs, SWEEP, || ()).unwrap(), sweep, "{executors} executors");
    }
}

#[test]
fn a_broken_robot_fails_before_any_task() {
    let folder = tempfile::tempdir().unwrap();
    let logs = write_logs(folder.path(), 5);
    // nobody would execute a task
    let cluster = cluster(0, 1, 60, folder.path());
    let sql = "SELECT gravity_force('ur7.urdf', q) FROM logs";
    let wrong = distributed(&cluster.url, &logs, sql, || ()).unwrap_err();
    assert!(wrong.contains("`ur7.urdf` cannot be read"), "{wrong}");
}

/// Waits until somebody has written something below a folder.
fn wait_for_files(folder: &Path) {
    fn has_files(folder: &Path) -> bool {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        entries.map(|entry| entry.path()).any(|path| match path.is_dir() {
            true => has_files(&path),
            false => path.metadata().is_ok_and(|data| data.len() > 0),
        })
    }
    let start = std::time::Instant::now();
    while !has_files(folder) {
        assert!(start.elapsed() < Duration::from_secs(120), "nothing is written to {}", folder.display());
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Either the rows, or why there are none.
fn rows_or_reason(found: Result<RecordBatch, String>, wanted: &[(u32, Vec<u64>)]) {
    match found {
        Ok(found) => assert!(bits(&found) == wanted, "other rows after an executor was lost"),
        Err(why) => {
            println!("the query ended with: {why}");
            assert!(!why.contains("no answer"), "{why}");
            assert!(why.len() > 20, "it is not said why: {why}");
        }
    }
}

#[test]
fn an_executor_that_is_killed_while_it_computes_changes_no_row() {
    let folder = tempfile::tempdir().unwrap();
    let logs = write_logs(folder.path(), 30_000);
    let wanted = bits(&embedded(&logs, RESIDUALS));
    let mut cluster = cluster(2, 1, 4, folder.path());
    let mut lost = cluster.executors.remove(0);
    let own = folder.path().join("executor0");
    let start = std::time::Instant::now();
    let found = distributed(&cluster.url, &logs, RESIDUALS, || {
        wait_for_files(&own);
        lost.kill();
        println!("killed after {:?}", start.elapsed());
    });
    println!("ended after {:?}: {}", start.elapsed(), found.is_ok());
    rows_or_reason(found, &wanted);
    // nothing is lost: who is left has the same rows
    assert!(bits(&distributed(&cluster.url, &logs, RESIDUALS, || ()).unwrap()) == wanted);
}

#[test]
fn an_executor_that_is_killed_while_it_serves_results_changes_no_row() {
    let folder = tempfile::tempdir().unwrap();
    let logs = write_logs(folder.path(), 30_000);
    let sql = "SELECT id, residual('descriptions/ur5.urdf', q, qd, qdd, effort) AS r FROM logs";
    let sorted = |table: &RecordBatch| {
        let mut rows = bits(table);
        rows.sort_unstable();
        rows
    };
    let wanted = sorted(&embedded(&logs, sql));
    let mut cluster = cluster(2, 1, 4, folder.path());
    let mut lost = cluster.executors.remove(0);
    let found: datafusion::error::Result<RecordBatch> = runtime().block_on(async {
        let context = straightline_cluster::session(&cluster.url, config()).await?;
        register(&context, &RobotFolder::at(project()));
        read_logs(&context, &logs).await?;
        let mut rows = context.sql(sql).await?.execute_stream().await?;
        let mut batches = vec![rows.next().await.expect("rows")?];
        lost.kill();
        while let Some(batch) = tokio::time::timeout(LONGEST, rows.next()).await.expect("an answer") {
            batches.push(batch?);
        }
        Ok(concat_batches(&batches[0].schema(), &batches)?)
    });
    println!("ended: {}", found.is_ok());
    match found {
        Ok(found) => assert!(sorted(&found) == wanted, "other rows after an executor was lost"),
        Err(why) => rows_or_reason(Err(why.to_string()), &[]),
    }
    assert!(sorted(&distributed(&cluster.url, &logs, sql, || ()).unwrap()) == wanted);
}

#[test]
fn a_query_whose_executors_are_all_killed_says_so_and_the_next_has_its_rows() {
    let folder = tempfile::tempdir().unwrap();
    let logs = write_logs(folder.path(), 30_000);
    let wanted = bits(&embedded(&logs, RESIDUALS));
    let mut cluster = cluster(2, 1, 4, folder.path());
    let start = std::time::Instant::now();
    let url = cluster.url.clone();
    let executors = &mut cluster.executors;
    let found = distributed(&url, &logs, RESIDUALS, || {
        wait_for_files(&folder.path().join("executor0"));
        executors.iter_mut().for_each(|executor| executor.kill());
        println!("killed after {:?}", start.elapsed());
    });
    println!("ended after {:?}: {}", start.elapsed(), found.is_ok());
    rows_or_reason(found, &wanted);
    let again = executor(cluster.port, 1, &folder.path().join("executor2"));
    assert!(bits(&distributed(&url, &logs, RESIDUALS, || ()).unwrap()) == wanted);
    drop(again);
}
