//! The compiler for wasm32 in node, and what is needed for it.

use serde_json::Value;
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// This folder's workspace.
pub fn folder() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A program of the system.
pub fn program(names: &[&str]) -> Option<PathBuf> {
    let folders = std::env::var_os("PATH")?;
    std::env::split_paths(&folders)
        .flat_map(|folder| names.iter().map(move |name| folder.join(name)))
        .find(|p| p.is_file())
}

/// What `build` writes into `target`.
pub fn built(name: &str) -> Option<PathBuf> {
    Some(folder().join("target").join(name)).filter(|path| path.is_file())
}

/// Robot files of the repository by their names, in order.
pub fn robots() -> Vec<(String, String)> {
    let folder = folder().join("../robots/descriptions");
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut robots: Vec<_> = entries
        .map(|path| (path.file_name().unwrap().to_string_lossy().to_string(), fs::read_to_string(&path).unwrap()))
        .collect();
    robots.sort();
    robots
}

/// The text of a robot file of the repository.
pub fn robot(name: &str) -> String {
    robots().into_iter().find(|(known, _)| known == name).expect("it is there").1
}

/// The compiler for wasm32, in node, by the page's worker.
pub struct InNode {
    child: Child,
    requests: ChildStdin,
    answers: BufReader<ChildStdout>,
}

/// The compiler in node; `None`, and a word why, where something is missing.
pub fn in_node() -> Option<InNode> {
    let (Some(node), Some(module)) = (program(&["node"]), built("compiler.wasm")) else {
        eprintln!("skipped: node, or target/compiler.wasm, which `build` makes, is missing");
        return None;
    };
    let mut child = Command::new(node)
        .arg("--stack-size=4000")
        .arg(folder().join("tests/drive/compiler.js"))
        .arg(folder().join("page/worker.js"))
        .arg(module)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("node starts");
    let (requests, answers) = (child.stdin.take().unwrap(), BufReader::new(child.stdout.take().unwrap()));
    Some(InNode { child, requests, answers })
}

impl InNode {
    /// The answer, and the milliseconds until it.
    pub fn ask(&mut self, name: &str, request: &Value) -> (Value, f64) {
        writeln!(self.requests, "{}", serde_json::json!([name, request])).unwrap();
        let mut line = String::new();
        self.answers.read_line(&mut line).unwrap();
        let mut found: Value = serde_json::from_str(&line).unwrap_or_else(|why| panic!("{name}: {why}: {line}"));
        (found["answer"].take(), found["milliseconds"].as_f64().unwrap())
    }
}

impl Drop for InNode {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// What the native compiler answers.
pub fn natively(name: &str, request: &Value) -> Value {
    serde_json::from_slice(&straightline_playground::answer(name, request.to_string().as_bytes())).unwrap()
}
