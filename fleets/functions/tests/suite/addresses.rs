//! Robots that are fetched while a query is planned.

use crate::helpers::session;
use datafusion::arrow::array::RecordBatch;
use std::io::{Read, Write};
use std::net::TcpListener;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Arc;
use straightline_fleet_testing::log::log;
use straightline_fleet_testing::query::runtime;
use straightline_fleet_testing::robot_text;
use straightline_fleets::written_hash;

/// A server on this machine that has some robots, and how often it was asked; its address.
fn server() -> (String, Arc<AtomicUsize>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = format!("http://{}", listener.local_addr().expect("its address"));
    let asked = Arc::new(AtomicUsize::new(0));
    let count = asked.clone();
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.expect("a connection");
            let mut request = Vec::new();
            let mut byte = [0];
            while !request.ends_with(b"\r\n\r\n") && stream.read(&mut byte).is_ok_and(|n| n == 1) {
                request.push(byte[0]);
            }
            let request = String::from_utf8_lossy(&request).into_owned();
            // a server that begins to work at the third question
            let is_busy = count.fetch_add(1, Ordering::SeqCst) < 2;
            let (status, body) = match request.split(' ').nth(1) {
                Some("/late.urdf") if is_busy => ("503 Service Unavailable", "later".to_string()),
                Some("/late.urdf" | "/panda.urdf") => ("200 OK", robot_text("panda.urdf")),
                Some("/broken.urdf") => ("200 OK", "<robot".to_string()),
                _ => ("404 Not Found", "no such robot".to_string()),
            };
            let head = format!("HTTP/1.1 {status}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n", body.len());
            let _ = stream.write_all(&[head.as_bytes(), body.as_bytes()].concat());
        }
    });
    (address, asked)
}

/// What the function gives for the rows of a log, as text, or the complaint.
fn rows(robot: &str) -> Result<String, String> {
    let context = session(&log(7, 3).table(), 1, 8192);
    let sql = format!("SELECT gravity_force('{robot}', q) FROM logs");
    let found = async { context.sql(&sql).await?.collect().await };
    let columns = |batches: Vec<RecordBatch>| batches.iter().map(|batch| format!("{:?}", batch.columns())).collect();
    runtime().block_on(found).map(columns).map_err(|wrong| wrong.to_string())
}

#[test]
fn a_robot_with_an_address_and_a_hash_is_fetched() {
    let (address, asked) = server();
    let hash = written_hash(robot_text("panda.urdf").as_bytes());
    let of_file = rows("panda.urdf").expect("the file");
    let fetched = rows(&format!("{address}/panda.urdf#{hash}")).expect("the address");
    assert_eq!(fetched, of_file);
    let once = asked.load(Ordering::SeqCst);
    rows(&format!("{address}/panda.urdf#{hash}")).expect("the address");
    assert_eq!(asked.load(Ordering::SeqCst), once, "what is known is not fetched again");
}

#[test]
fn what_cannot_be_fetched_is_said_and_asked_for_again() {
    let (address, _) = server();
    let hash = written_hash(robot_text("panda.urdf").as_bytes());
    let other = written_hash(robot_text("ur5.urdf").as_bytes());
    for (robot, parts) in [
        (format!("{address}/panda.urdf"), &["has no hash", "help: write `#sha256:`"][..]),
        (format!("{address}/none.urdf#{hash}"), &["cannot be fetched: ", "404", "within 30 s"]),
        (format!("{address}/panda.urdf#{other}"), &["is another file", &hash]),
        ("http://127.0.0.1:1/panda.urdf#".to_string() + &hash, &["cannot be fetched: ", "refused"]),
    ] {
        let said = rows(&robot).unwrap_err();
        assert!(parts.iter().all(|part| said.contains(part)), "{robot}: {said}");
    }
    let (address, _) = server();
    let late = format!("{address}/late.urdf#{hash}");
    let said = [0, 1, 2].map(|_| rows(&late));
    assert!(said[0].is_err() && said[2].is_ok(), "{said:?}");
    let broken = format!("{address}/broken.urdf#{}", written_hash(b"<robot"));
    let said = rows(&broken).unwrap_err();
    assert!(said.contains("broken.urdf:1"), "{said}");
}
