//! The records of an MCAP file, one after the other, with those inside of chunks in their places.
//!
//! A record is an opcode, a length of eight bytes, and its body. The walk holds every length against what is there; the library `mcap`, whose own
//! reader can overflow on damaged chunks, parses the bodies.

use crate::failure::LogError;
use ::mcap::records::{op, ChunkHeader, Record};
use ::mcap::MAGIC;
use std::io::Read;

/// Bytes of opcode and length.
const HEAD: usize = 9;
/// The longest chunk, unpacked \[bytes\].
const LONGEST_CHUNK: u64 = 1 << 28;
/// What is unpacked of a file, at most, per byte of it and beside that.
const MOST_UNPACKED: (u64, u64) = (1000, 1 << 26);

pub(crate) fn damaged(at: usize, what: &str) -> LogError {
    let help =
        "the file is no MCAP file, or cut off, or damaged: `mcap doctor` says more, `mcap recover` saves what it can";
    LogError::new(format!("byte {at}"), what, help)
}

/// Hands every record to `take`, with the byte at which it, or its chunk, begins.
///
/// # Errors
/// The file is damaged or cut off, or `take` says something.
pub(crate) fn for_each_record(
    bytes: &[u8],
    take: &mut dyn FnMut(&Record, usize) -> Result<(), LogError>,
) -> Result<(), LogError> {
    if !bytes.starts_with(MAGIC) {
        return Err(damaged(0, "the file does not begin as MCAP files do"));
    }
    let (mut at, mut unpacked) = (MAGIC.len(), 0);
    loop {
        let (opcode, body) = record(&bytes[at..]).map_err(|what| damaged(at, &what))?;
        let parsed = ::mcap::parse_record(opcode, body).map_err(|error| damaged(at, &error.to_string()))?;
        match &parsed {
            Record::Chunk { header, data } => {
                let whole = chunk(header, data).map_err(|what| damaged(at, &what))?;
                unpacked += whole.len() as u64;
                if unpacked > MOST_UNPACKED.0 * bytes.len() as u64 + MOST_UNPACKED.1 {
                    return Err(damaged(at, &format!("chunks unpack to {unpacked} bytes, far more than logs do")));
                }
                let mut inside = 0;
                while inside < whole.len() {
                    let in_chunk = |what: &str| damaged(at, &format!("byte {inside} of a chunk: {what}"));
                    let (opcode, body) = record(&whole[inside..]).map_err(|what| in_chunk(&what))?;
                    if opcode != op::CHUNK {
                        let parsed =
                            ::mcap::parse_record(opcode, body).map_err(|error| in_chunk(&error.to_string()))?;
                        take(&parsed, at)?;
                    }
                    inside += HEAD + body.len();
                }
            }
            other => take(other, at)?,
        }
        at += HEAD + body.len();
        if opcode == op::FOOTER {
            return match bytes[at..].starts_with(MAGIC) {
                true => Ok(()),
                false => Err(damaged(at, "the file does not end as MCAP files do")),
            };
        }
    }
}

/// The opcode and the body of the record at the front.
fn record(bytes: &[u8]) -> Result<(u8, &[u8]), String> {
    let Some((head, rest)) = bytes.split_at_checked(HEAD) else {
        return Err(format!("a record is cut off: {} bytes are left", bytes.len()));
    };
    let length = u64::from_le_bytes(head[1..].try_into().expect("eight bytes"));
    let body = usize::try_from(length).ok().and_then(|length| rest.get(..length));
    body.map(|body| (head[0], body))
        .ok_or_else(|| format!("a record of {length} bytes, of which {} are left", rest.len()))
}

/// What a chunk unpacks to.
fn chunk(header: &ChunkHeader, data: &[u8]) -> Result<Vec<u8>, String> {
    let wanted = header.uncompressed_size;
    if wanted > LONGEST_CHUNK {
        return Err(format!("a chunk of {wanted} bytes; {LONGEST_CHUNK} are read at most"));
    }
    let mut whole = Vec::new();
    let unpacked = match header.compression.as_str() {
        "" => data.take(wanted + 1).read_to_end(&mut whole),
        "zstd" => zstd::Decoder::new(data).and_then(|d| d.take(wanted + 1).read_to_end(&mut whole)),
        "lz4" => lz4::Decoder::new(data).and_then(|d| d.take(wanted + 1).read_to_end(&mut whole)),
        other => return Err(format!("a chunk is compressed by `{other}`; known are lz4 and zstd")),
    };
    unpacked.map_err(|error| format!("a chunk cannot be unpacked: {error}"))?;
    if whole.len() as u64 != wanted {
        return Err(format!("a chunk unpacks to other than the {wanted} bytes that it promises"));
    }
    // zero stands for none
    match header.uncompressed_crc {
        0 => Ok(whole),
        sum if sum == crc32fast::hash(&whole) => Ok(whole),
        _ => Err("the check sum of a chunk is wrong".to_string()),
    }
}
