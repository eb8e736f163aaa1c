//! What functions cost beside reading a log, and on one executor or two.
//!
//! `cargo run --release --all-features --example costs`, after a build of the whole workspace, on a machine that does nothing else: figures for `RECORD.md`.
//! Each figure is the best of several, as others disturb in one direction alone.

use datafusion::error::Result;
use datafusion::prelude::{SessionConfig, SessionContext};
use futures::StreamExt;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;
use straightline_fleet_testing::log::{log_at, write};
use straightline_fleet_testing::processes::cluster;
use straightline_fleet_testing::query::read_logs;
use straightline_fleet_testing::robots;
use straightline_fleets::{register, RobotFolder};

const JOINTS: usize = 7;
/// Rows of the log, and those that are written at once; and how many there are in a second.
const ROWS: usize = 1 << 20;
const GROUP: usize = 1 << 16;
const RATE: f64 = 1000.0;
/// Rows of it that normal equations are made of.
const ROWS_OF_EQUATIONS: usize = 50_000;
const EQUATIONS: &str = "SELECT regressor_normal_equations('panda.urdf', q, qd, qdd, effort) FROM logs";
/// Files of the log that executors share, and rows of each.
const PARTS: usize = 8;
const ROWS_OF_PART: usize = 20_000;
/// Each figure is the best of so many.
const TRIES: usize = 9;

async fn drained(context: &SessionContext, sql: &str) -> Result<usize> {
    let mut rows = context.sql(sql).await?.execute_stream().await?;
    let mut count = 0;
    while let Some(batch) = rows.next().await {
        count += black_box(batch?).num_rows();
    }
    Ok(count)
}

/// A session of one partition over a log.
async fn session(log: &Path) -> Result<SessionContext> {
    let context = SessionContext::new_with_config(SessionConfig::new().with_target_partitions(1));
    register(&context, &RobotFolder::at(robots()));
    read_logs(&context, log).await?;
    Ok(context)
}

/// The least times of queries \[s\], by turns, so that what disturbs disturbs all.
async fn least<const N: usize>(queries: [(&SessionContext, &str); N]) -> Result<[f64; N]> {
    let mut times = [f64::INFINITY; N];
    // the first turn compiles the robot
    for turn in 0..=TRIES {
        for ((context, sql), time) in queries.iter().zip(&mut times) {
            let start = Instant::now();
            drained(context, sql).await?;
            *time = if turn == 0 { f64::INFINITY } else { time.min(start.elapsed().as_secs_f64()) };
        }
    }
    Ok(times)
}

/// Reading a log, and reading it with a function.
async fn scans(log: &Path) -> Result<()> {
    println!("| columns that are read | scan, ns/state | function | scan + function, ns/state | ratio |\n|---|---|---|---|---|");
    let context = session(log).await?;
    for (columns, name, call) in [
        ("q", "gravity_force", "gravity_force('panda.urdf', q)"),
        ("q, qd, qdd", "inverse_dynamics", "inverse_dynamics('panda.urdf', q, qd, qdd)"),
        ("q, qd, qdd, effort", "residual", "residual('panda.urdf', q, qd, qdd, effort)"),
        ("q, qd, effort", "forward_dynamics", "forward_dynamics('panda.urdf', q, qd, effort)"),
    ] {
        let [scan, both] = [columns, call].map(|what| format!("SELECT {what} FROM logs"));
        let times = least([(&context, &scan), (&context, &both)]).await?;
        let [scan, both] = times.map(|time| 1e9 * time / ROWS as f64);
        println!("| {columns} | {scan:.0} | {name} | {both:.0} | {:.2} |", both / scan);
    }
    let some = format!("{EQUATIONS} WHERE id < {ROWS_OF_EQUATIONS}");
    let [time] = least([(&context, &some)]).await?;
    println!("\nregressor_normal_equations: {:.2} µs/state", 1e6 * time / ROWS_OF_EQUATIONS as f64);
    let bytes = std::fs::metadata(log)?.len();
    println!("the log: {ROWS} states, {:.0} bytes each of {} numbers", bytes as f64 / ROWS as f64, 4 * JOINTS);
    Ok(())
}

/// The same query, by one executor and by two, each of one task at once.
async fn executors(folder: &Path) -> Result<()> {
    let logs = folder.join("parts");
    std::fs::create_dir_all(&logs)?;
    for k in 0..PARTS {
        let rows = k * ROWS_OF_PART..(k + 1) * ROWS_OF_PART;
        write(&logs.join(format!("{k}.parquet")), [log_at(RATE, JOINTS, rows).table()]);
    }
    let config = SessionConfig::new().with_target_partitions(PARTS);
    // a task per file
    let config = config.set_bool("datafusion.optimizer.repartition_file_scans", false);
    let clusters = [1, 2].map(|count| cluster(count, 1, 60, &folder.join(format!("cluster{count}"))));
    let mut sessions = Vec::new();
    for cluster in &clusters {
        let context = straightline_cluster::session(&cluster.url, config.clone()).await?;
        register(&context, &RobotFolder::at(robots()));
        read_logs(&context, &logs).await?;
        sessions.push(context);
    }
    let [one, two] = least([(&sessions[0], EQUATIONS), (&sessions[1], EQUATIONS)]).await?;
    let states = PARTS * ROWS_OF_PART;
    println!(
        "\n{states} states of normal equations: {one:.2} s by one executor, {two:.2} s by two, {:.2} times as fast",
        one / two
    );
    Ok(())
}

fn main() -> Result<()> {
    let folder = std::env::temp_dir().join(format!("straightline-costs-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let log = folder.join("log.parquet");
    write(&log, (0..ROWS / GROUP).map(|k| log_at(RATE, JOINTS, k * GROUP..(k + 1) * GROUP).table()));
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let done = runtime.block_on(async {
        scans(&log).await?;
        executors(&folder).await
    });
    std::fs::remove_dir_all(&folder)?;
    done
}
