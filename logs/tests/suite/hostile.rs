//! Files that are damaged: an error or a log, never a panic, and no more memory than the file is worth.

use super::common::{recorded, Noise, Sent};
use mcap::Compression;
use straightline_logs::align::align;
use straightline_logs::demand::LogDemand;
use straightline_logs::joint_state::JointState;
use straightline_logs::{csv, mcap as file};

/// Some files, whole.
fn files() -> Vec<Vec<u8>> {
    let position: Vec<f64> = (0..3).map(|k| f64::from(k) * 0.3 - 0.2).collect();
    let messages: Vec<Sent> =
        (0..20).map(|i| Sent("/a", 1_000_000 * i, &["a", "b", "c"], [&position, &position, &position])).collect();
    [None, Some(Compression::Zstd), Some(Compression::Lz4)].map(|c| recorded(&messages, c)).to_vec()
}

/// A file with some bytes changed, cut out, doubled, or its end gone.
fn mutated(bytes: &[u8], noise: &mut Noise) -> Vec<u8> {
    let mut found = bytes.to_vec();
    for _ in 0..=noise.bits() % 3 {
        let at = noise.bits() as usize % found.len().max(1);
        match noise.bits() % 6 {
            0 => found.truncate(at),
            1 => found[at..].iter_mut().take(1).for_each(|b| *b ^= 1 << (noise.bits() % 8)),
            2 => found[at..].iter_mut().take(8).for_each(|b| *b = 0xff),
            3 => found[at..].iter_mut().take(4).for_each(|b| *b = noise.bits() as u8),
            4 => drop(found.drain(at..(at + noise.bits() as usize % 40).min(bytes.len().min(at + 1)).max(at)).count()),
            _ => {
                let more = found[at..].iter().take(30).copied().collect::<Vec<u8>>();
                found.splice(at..at, more);
            }
        }
        if found.is_empty() {
            break;
        }
    }
    found
}

#[test]
fn mutated_files_are_read_or_refused_with_a_place() {
    let (mut noise, mut refused) = (Noise(11), 0);
    for bytes in files() {
        for _ in 0..1500 {
            let seed = noise.0;
            match file::read(&mutated(&bytes, &mut noise), None) {
                Ok(log) => {
                    let joints: Vec<&str> = log.joints.iter().map(String::as_str).collect();
                    let _ = align(&log, &LogDemand::of_joints(&joints));
                }
                Err(error) => {
                    refused += 1;
                    assert!(!error.what.is_empty() && !error.help.is_empty(), "seed {seed}: {error:?}");
                }
            }
        }
    }
    assert!(refused > 1000, "{refused} of 4500 were refused: files are hardly mutated");
}

#[test]
fn every_file_that_is_cut_off_is_refused_with_the_byte() {
    for bytes in files() {
        for length in (0..bytes.len()).step_by(7) {
            let error = file::read(&bytes[..length], None).expect_err("it is cut off");
            assert!(error.place.contains("byte"), "{length} of {}: {error:?}", bytes.len());
        }
    }
}

#[test]
fn mutated_messages_and_random_bytes_are_read_or_refused() {
    let mut noise = Noise(5);
    let names = ["a", "b"].map(str::to_string);
    let whole = straightline_logs::joint_state::bytes(77, &names, [&[1.0, 2.0], &[3.0, 4.0], &[]]).expect("a message");
    for _ in 0..20_000 {
        let bytes = mutated(&whole, &mut noise);
        let mut message = JointState::default();
        if message.read(&bytes).is_ok() {
            assert!(message.names.len() * 4 <= bytes.len() && message.position.len() * 8 <= bytes.len());
        }
    }
    for length in 0..2000 {
        let bytes: Vec<u8> = (0..length).map(|_| noise.bits() as u8).collect();
        assert!(file::read(&bytes, None).is_err());
        let _ = JointState::default().read(&bytes);
        let _ = csv::read(&bytes);
    }
}

#[test]
fn names_that_no_two_messages_share_are_refused_before_memory_is() {
    let names: Vec<String> = (0..6000).map(|i| format!("joint{i}")).collect();
    let names: Vec<[&str; 1]> = names.iter().map(|name| [name.as_str()]).collect();
    let messages: Vec<Sent> = names.iter().map(|name| Sent("/a", 5, name, [&[1.0], &[], &[]])).collect();
    let error = file::read(&recorded(&messages, None), None).expect_err("it would take a square of numbers");
    assert!(error.what.contains("hardly any") && error.place.contains("message "), "{error:?}");
}
