//! The texts of robots, and of what else a query names: read where it is planned, carried in the plan, so that whoever executes it needs no file.

use crate::failure;
use datafusion::arrow::datatypes::DataType;
use datafusion::error::Result;
use datafusion::scalar::ScalarValue;
use sha2::{Digest, Sha256};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// What the bytes of a text in a plan begin with.
const MARK: &[u8] = b"straightline robot 1\n";
/// What stands between the name of a file and its hash.
const HASH: &str = "#sha256:";
/// Bytes of a hash.
const HASH_BYTES: usize = 32;
/// How long an address may take to answer, from the first byte to the last.
const PATIENCE: Duration = Duration::from_secs(30);
/// Bytes of a robot file from an address at most.
const MOST_BYTES: u64 = 64 << 20;

/// The text of a robot file.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct RobotText {
    /// The name by which the query has it, which says the format.
    pub name: String,
    /// SHA-256 of the bytes.
    pub hash: [u8; HASH_BYTES],
    /// The bytes of the file.
    pub bytes: Vec<u8>,
}

/// The folder that names of robots count from; without one no robot is read, as on executors.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct RobotFolder(Option<PathBuf>);

impl RobotFolder {
    /// That folder.
    pub fn at(path: impl Into<PathBuf>) -> RobotFolder {
        RobotFolder(Some(path.into()))
    }

    /// None: robots come in plans.
    pub fn none() -> RobotFolder {
        RobotFolder(None)
    }

    /// What a literal says.
    fn place<'a>(&self, literal: &'a str) -> Result<NamedPlace<'a>> {
        let (name, hash) = literal.rsplit_once(HASH).map_or((literal, None), |(name, hash)| (name, Some(hash)));
        let Some(folder) = &self.0 else { return Err(failure::unread(name)) };
        if let Some(hash) = hash {
            let is_hash = hash.len() == 2 * HASH_BYTES && hash.bytes().all(|b| b.is_ascii_hexdigit());
            if !is_hash {
                return Err(failure::no_hash(name, hash));
            }
        }
        let place = match name.split_once("://") {
            None => RobotPlace::File(folder.join(name)),
            Some(("file", path)) => RobotPlace::File(folder.join(path)),
            Some(("http" | "https", _)) if hash.is_some() => RobotPlace::Address,
            Some(("http" | "https", _)) => return Err(failure::address_without_hash(name)),
            Some((scheme, _)) => return Err(failure::not_a_file(name, scheme)),
        };
        Ok(NamedPlace { name, place, hash })
    }

    /// Reads what a literal says: `panda.urdf`, `file:///robots/panda.urdf`, each with `#sha256:…` behind it or not, or `https://host/panda.urdf` with it.
    ///
    /// # Errors
    /// It cannot be read, is another one than the hash says, or there is no folder.
    pub fn read(&self, literal: &str) -> Result<RobotText> {
        let NamedPlace { name, place, hash } = self.place(literal)?;
        let bytes = match place {
            RobotPlace::File(file) => std::fs::read(&file).map_err(|why| failure::unreadable(name, &file, &why)),
            RobotPlace::Address => fetched(name).map_err(|why| failure::unreachable(name, &why)),
        }?;
        let text = RobotText::new(name, bytes);
        let found = hexadecimal(&text.hash);
        match hash.map(str::to_ascii_lowercase) {
            Some(wanted) if wanted != found => Err(failure::other_hash(name, &wanted, &found)),
            _ => Ok(text),
        }
    }

    /// The file that a literal names, if it names one.
    pub fn file(&self, literal: &str) -> Option<PathBuf> {
        match self.place(literal).ok()?.place {
            RobotPlace::File(file) => Some(file),
            RobotPlace::Address => None,
        }
    }
}

/// What a literal names.
struct NamedPlace<'a> {
    /// Without the hash.
    name: &'a str,
    place: RobotPlace,
    hash: Option<&'a str>,
}

enum RobotPlace {
    File(PathBuf),
    /// The name is where it is fetched from.
    Address,
}

/// What an address answers.
fn fetched(address: &str) -> std::result::Result<Vec<u8>, ureq::Error> {
    let agent = ureq::Agent::config_builder().timeout_global(Some(PATIENCE)).build().new_agent();
    agent.get(address).call()?.body_mut().with_config().limit(MOST_BYTES).read_to_vec()
}

impl RobotText {
    /// Of a file's bytes.
    pub fn new(name: &str, bytes: Vec<u8>) -> RobotText {
        RobotText { name: name.to_string(), hash: Sha256::digest(&bytes).into(), bytes }
    }

    /// What a plan carries: a dictionary of one value, so that a batch of rows has the text once.
    pub fn literal(&self) -> ScalarValue {
        let length = u32::try_from(self.name.len()).expect("names of files are short").to_le_bytes();
        let bytes = [MARK, &self.hash, &length, self.name.as_bytes(), &self.bytes].concat();
        ScalarValue::Dictionary(Box::new(DataType::Int32), Box::new(ScalarValue::Binary(Some(bytes))))
    }
}

/// A text in a plan, not copied.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CarriedText<'a> {
    /// As of [`RobotText`].
    pub name: &'a str,
    /// As of [`RobotText`].
    pub hash: &'a [u8; HASH_BYTES],
    /// As of [`RobotText`].
    pub bytes: &'a [u8],
}

impl<'a> CarriedText<'a> {
    /// Of a literal of a plan, if it is one.
    pub fn of(literal: &'a ScalarValue) -> Option<CarriedText<'a>> {
        let ScalarValue::Dictionary(_, value) = literal else { return None };
        let ScalarValue::Binary(Some(bytes)) = &**value else { return None };
        let (hash, rest) = bytes.strip_prefix(MARK)?.split_first_chunk()?;
        let (length, rest) = rest.split_first_chunk()?;
        let (name, bytes) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
        Some(CarriedText { name: std::str::from_utf8(name).ok()?, hash, bytes })
    }
}

/// Whether an argument of this type can be a robot.
pub fn can_be_robot(kind: &DataType) -> bool {
    let is_carried = |value: &DataType| *value == DataType::Binary;
    match kind {
        DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => true,
        DataType::Dictionary(_, value) => is_carried(value),
        _ => false,
    }
}

/// Digits of a hash.
pub fn hexadecimal(hash: &[u8]) -> String {
    hash.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// When a file was changed last, and how long it is.
pub fn stamp(file: &Path) -> Option<(std::time::SystemTime, u64)> {
    let data = std::fs::metadata(file).ok()?;
    Some((data.modified().ok()?, data.len()))
}
