//! A scheduler and executors as processes of this machine.

use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A process that ends with its owner.
#[derive(Debug)]
pub struct Running(Child);

impl Running {
    /// At once, as when a machine loses power.
    pub fn kill(&mut self) {
        // it may have ended by itself
        drop(self.0.kill());
        self.0.wait().expect("a process of ours");
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.kill();
    }
}

/// A port that is free now.
pub fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").and_then(|socket| socket.local_addr()).expect("a free port").port()
}

/// Waits until somebody listens.
pub fn wait_for(port: u16) {
    let start = Instant::now();
    while TcpStream::connect(("127.0.0.1", port)).is_err() {
        assert!(start.elapsed() < Duration::from_secs(60), "nobody listens at port {port}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A command of the workspace: tests and examples lie in a folder beside the commands.
fn command(name: &str) -> Command {
    let own = std::env::current_exe().expect("the path of this program");
    let folder = own.parent().and_then(Path::parent).expect("a folder of what is built");
    let program = folder.join(name);
    assert!(program.exists(), "{} is not built: cargo build --workspace --all-features", program.display());
    Command::new(program)
}

fn started(mut command: Command) -> Running {
    Running(command.stdout(Stdio::null()).spawn().expect("the command starts"))
}

/// A scheduler with executors.
#[derive(Debug)]
pub struct Cluster {
    /// Where queries go.
    pub url: String,
    /// The port of the scheduler.
    pub port: u16,
    /// In the order of their folders, `executor0`, …
    pub executors: Vec<Running>,
    _scheduler: Running,
}

/// Starts one, whose scheduler gives executors up after so many seconds.
pub fn cluster(executors: usize, tasks: usize, patience: u64, folder: &Path) -> Cluster {
    let port = free_port();
    let mut command = command("straightline-scheduler");
    command.args(["--bind", &format!("127.0.0.1:{port}"), "--patience", &patience.to_string()]);
    let scheduler = started(command);
    wait_for(port);
    let own = |k: usize| -> PathBuf { folder.join(format!("executor{k}")) };
    let started = (0..executors).map(|k| executor(port, tasks, &own(k)));
    Cluster { url: format!("http://127.0.0.1:{port}"), port, executors: started.collect(), _scheduler: scheduler }
}

/// Starts one.
pub fn executor(scheduler: u16, tasks: usize, folder: &Path) -> Running {
    std::fs::create_dir_all(folder).expect("a folder for the executor");
    let (port, task_port) = (free_port(), free_port());
    let mut command = command("straightline-executor");
    command.args(["--scheduler", &format!("127.0.0.1:{scheduler}"), "--heartbeat", "1"]);
    command.args(["--port", &port.to_string(), "--task-port", &task_port.to_string(), "--tasks", &tasks.to_string()]);
    command.arg("--folder").arg(folder);
    let running = started(command);
    wait_for(port);
    wait_for(task_port);
    running
}
