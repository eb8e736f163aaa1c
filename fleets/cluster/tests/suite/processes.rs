//! A scheduler and executors as processes of this machine.

use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A process that ends with the test.
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
fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").and_then(|socket| socket.local_addr()).expect("a free port").port()
}

fn wait_for(port: u16) {
    let start = Instant::now();
    while TcpStream::connect(("127.0.0.1", port)).is_err() {
        assert!(start.elapsed() < Duration::from_secs(60), "nobody listens at port {port}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// A scheduler with executors.
pub struct Cluster {
    pub url: String,
    pub port: u16,
    pub executors: Vec<Running>,
    _scheduler: Running,
}

/// Starts one, whose scheduler gives executors up after so many seconds.
pub fn cluster(executors: usize, tasks: usize, patience: u64, folder: &Path) -> Cluster {
    let port = free_port();
    let mut command = Command::new(env!("CARGO_BIN_EXE_straightline-scheduler"));
    command.args(["--bind", &format!("127.0.0.1:{port}"), "--patience", &patience.to_string()]);
    let scheduler = Running(command.stdout(Stdio::null()).spawn().expect("the scheduler starts"));
    wait_for(port);
    let started = (0..executors).map(|k| executor(port, tasks, &folder.join(format!("executor{k}"))));
    Cluster { url: format!("http://127.0.0.1:{port}"), port, executors: started.collect(), _scheduler: scheduler }
}

/// Starts one.
pub fn executor(scheduler: u16, tasks: usize, folder: &Path) -> Running {
    std::fs::create_dir_all(folder).expect("a folder for the executor");
    let (port, task_port) = (free_port(), free_port());
    let mut command = Command::new(env!("CARGO_BIN_EXE_straightline-executor"));
    command.args(["--scheduler", &format!("127.0.0.1:{scheduler}"), "--heartbeat", "1"]);
    command.args(["--port", &port.to_string(), "--task-port", &task_port.to_string(), "--tasks", &tasks.to_string()]);
    let running =
        Running(command.arg("--folder").arg(folder).stdout(Stdio::null()).spawn().expect("the executor starts"));
    wait_for(port);
    wait_for(task_port);
    running
}
