//! What functions cost beside reading a log, and on one executor or two.
//!
//! `cargo run --release --all-features --example costs`, after a build of the whole workspace, on a machine that does nothing else: figures for `RECORD.md`.
//! Each figure is the best of several, as others disturb in one direction alone.

use datafusion::arrow::array::{ArrayRef, Float64Builder, ListBuilder, RecordBatch, UInt32Array};
use datafusion::arrow::datatypes::{Field, Schema};
use datafusion::error::Result;
use datafusion::parquet::arrow::ArrowWriter;
use datafusion::prelude::{ParquetReadOptions, SessionConfig, SessionContext};
use futures::StreamExt;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};
use straightline_fleets::{register, RobotFolder};

const JOINTS: usize = 7;
/// Rows of the log.
const ROWS: usize = 1 << 20;
/// Files of the log that executors share, and rows of each.
const PARTS: usize = 8;
const ROWS_OF_PART: usize = 20_000;
/// Each figure is the best of so many.
const TRIES: usize = 9;

fn robots() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../robots/descriptions")
}

/// Rows of a log: q, q̇, q̈ and efforts, to four decimals.
fn table(first: usize, rows: usize) -> RecordBatch {
    let four = |x: f64| (x * 1e4).round() / 1e4;
    let mut lists = [0, 1, 2, 3].map(|_| ListBuilder::new(Float64Builder::new()));
    for row in first..first + rows {
        let t = row as f64 / 1000.0;
        let joints: Vec<[f64; 4]> = (0..JOINTS)
            .map(|k| {
                let w = 0.9 + 0.4 * k as f64;
                let (sine, cosine) = (w * t).sin_cos();
                [0.7 * sine, 0.7 * w * cosine, -0.7 * w * w * sine, 30.0 * cosine].map(four)
            })
            .collect();
        for (k, list) in lists.iter_mut().enumerate() {
            list.append_value(joints.iter().map(|joint| Some(joint[k])));
        }
    }
    let id = UInt32Array::from_iter_values(first as u32..(first + rows) as u32);
    let mut columns: Vec<ArrayRef> = vec![Arc::new(id)];
    columns.extend(lists.iter_mut().map(|list| Arc::new(list.finish()) as ArrayRef));
    let names = ["id", "q", "qd", "qdd", "effort"];
    let fields: Vec<Field> =
        names.iter().zip(&columns).map(|(name, column)| Field::new(*name, column.data_type().clone(), true)).collect();
    RecordBatch::try_new(Arc::new(Schema::new(fields)), columns).expect("columns of one length")
}

async fn drained(context: &SessionContext, sql: &str) -> Result<usize> {
    let mut rows = context.sql(sql).await?.execute_stream().await?;
    let mut count = 0;
    while let Some(batch) = rows.next().await {
        count += black_box(batch?).num_rows();
    }
    Ok(count)
}

/// Reading a log, and reading it with a function.
async fn scans(folder: &Path) -> Result<()> {
    println!("\n| columns that are read | scan, ns/state | function | scan + function, ns/state | ratio |\n|---|---|---|---|---|");
    let path = folder.join("log.parquet");
    let bytes = std::fs::metadata(&path)?.len();
    for (columns, name, call) in [
        ("q", "gravity_force", "gravity_force('panda.urdf', q)"),
        ("q, qd, qdd", "inverse_dynamics", "inverse_dynamics('panda.urdf', q, qd, qdd)"),
        ("q, qd, qdd, effort", "residual", "residual('panda.urdf', q, qd, qdd, effort)"),
        ("q, qd, effort", "forward_dynamics", "forward_dynamics('panda.urdf', q, qd, effort)"),
    ] {
        let context = SessionContext::new_with_config(SessionConfig::new().with_target_partitions(1));
        register(&context, &RobotFolder::at(robots()));
        let log = context.read_parquet(path.to_str().expect("a path of text"), ParquetReadOptions::default()).await?;
        context.register_table("logs", log.into_view())?;
        let mut times = [f64::INFINITY; 2];
        for _ in 0..=TRIES {
            for (what, time) in [columns, call].iter().zip(&mut times) {
                let start = Instant::now();
                assert_eq!(drained(&context, &format!("SELECT {what} FROM logs")).await?, ROWS);
                *time = time.min(start.elapsed().as_secs_f64());
            }
        }
        let [scan, both] = times.map(|time| 1e9 * time / ROWS as f64);
        println!("| {columns} | {scan:.0} | {name} | {both:.0} | {:.2} |", both / scan);
    }
    let equations = "SELECT regressor_normal_equations('panda.urdf', q, qd, qdd, effort) FROM logs WHERE id < 50000";
    let context = SessionContext::new_with_config(SessionConfig::new().with_target_partitions(1));
    register(&context, &RobotFolder::at(robots()));
    let log = context.read_parquet(path.to_str().expect("a path of text"), ParquetReadOptions::default()).await?;
    context.register_table("logs", log.into_view())?;
    drained(&context, equations).await?;
    let start = Instant::now();
    drained(&context, equations).await?;
    println!("\nregressor_normal_equations: {:.1} µs/state", 1e6 * start.elapsed().as_secs_f64() / 50_000.0);
    println!("the log: {ROWS} states, {:.0} bytes each of 28 numbers", bytes as f64 / ROWS as f64);
    Ok(())
}

/// A process that ends with this one.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        drop(self.0.kill());
        drop(self.0.wait());
    }
}

fn started(name: &str, arguments: &[String]) -> Result<Running> {
    let own = std::env::current_exe()?;
    // examples lie in a folder of their own beside the commands
    let folder = own.parent().and_then(Path::parent).expect("examples lie in a folder");
    Ok(Running(Command::new(folder.join(name)).args(arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn()?))
}

fn free_port() -> Result<u16> {
    Ok(std::net::TcpListener::bind("127.0.0.1:0")?.local_addr()?.port())
}

async fn listening(port: u16) {
    while std::net::TcpStream::connect(("127.0.0.1", port)).is_err() {
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
}

/// The same query, by one executor and by two, each of one task at once.
async fn executors(folder: &Path) -> Result<()> {
    let logs = folder.join("parts");
    std::fs::create_dir_all(&logs)?;
    for k in 0..PARTS {
        let rows = table(k * ROWS_OF_PART, ROWS_OF_PART);
        let mut writer =
            ArrowWriter::try_new(std::fs::File::create(logs.join(format!("{k}.parquet")))?, rows.schema(), None)?;
        writer.write(&rows)?;
        writer.close()?;
    }
    let sql = "SELECT regressor_normal_equations('panda.urdf', q, qd, qdd, effort) FROM logs";
    let mut times = Vec::new();
    for count in [1, 2] {
        let port = free_port()?;
        let _scheduler = started("straightline-scheduler", &["--bind".to_string(), format!("127.0.0.1:{port}")])?;
        listening(port).await;
        let mut executors = Vec::new();
        for k in 0..count {
            let ports = [free_port()?, free_port()?];
            let arguments = format!(
                "--scheduler 127.0.0.1:{port} --tasks 1 --port {} --task-port {} --folder {}",
                ports[0],
                ports[1],
                folder.join(format!("executor{k}")).display()
            );
            std::fs::create_dir_all(folder.join(format!("executor{k}")))?;
            executors
                .push(started("straightline-executor", &arguments.split(' ').map(str::to_string).collect::<Vec<_>>())?);
            listening(ports[0]).await;
        }
        let config = SessionConfig::new().with_target_partitions(PARTS);
        let context = straightline_cluster::session(&format!("http://127.0.0.1:{port}"), config).await?;
        register(&context, &RobotFolder::at(robots()));
        let parts = context.read_parquet(logs.to_str().expect("a path of text"), ParquetReadOptions::default()).await?;
        context.register_table("logs", parts.into_view())?;
        let mut time = f64::INFINITY;
        for _ in 0..3 {
            let start = Instant::now();
            drained(&context, sql).await?;
            time = time.min(start.elapsed().as_secs_f64());
        }
        times.push(time);
    }
    println!(
        "\n{} states of normal equations: {:.2} s by one executor, {:.2} s by two, {:.2} times as fast",
        PARTS * ROWS_OF_PART,
        times[0],
        times[1],
        times[0] / times[1]
    );
    Ok(())
}

fn main() -> Result<()> {
    let folder = std::env::temp_dir().join(format!("straightline-costs-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let file = std::fs::File::create(folder.join("log.parquet"))?;
    let mut writer = ArrowWriter::try_new(file, table(0, 1).schema(), None)?;
    for first in (0..ROWS).step_by(1 << 16) {
        writer.write(&table(first, 1 << 16))?;
    }
    writer.close()?;
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let done = runtime.block_on(async {
        scans(&folder).await?;
        executors(&folder).await
    });
    std::fs::remove_dir_all(&folder)?;
    done
}
