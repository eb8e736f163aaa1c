//! `sensor_msgs/msg/JointState` of ROS 2.

use crate::cdr::{CdrReader, CdrWriter};

/// The type of the message.
pub const TYPE: &str = "sensor_msgs/msg/JointState";

/// Its definition, and those of the messages that it is made of, as MCAP files carry it (`ros2msg`).
pub const SCHEMA: &str = "\
std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
";

/// A message, in memory that the next one takes again.
#[derive(Clone, Debug, Default)]
pub struct JointState<'a> {
    /// Time stamp of its header \[ns\].
    pub stamp: i64,
    /// Names of the joints.
    pub names: Vec<&'a str>,
    /// Per joint its position \[rad or m\], or nothing.
    pub position: Vec<f64>,
    /// Per joint its velocity \[rad/s or m/s\], or nothing.
    pub velocity: Vec<f64>,
    /// Per joint its effort \[N·m or N\], or nothing.
    pub effort: Vec<f64>,
}

impl<'a> JointState<'a> {
    /// Reads a message.
    ///
    /// # Errors
    /// What is wrong with its bytes.
    pub fn read(&mut self, bytes: &'a [u8]) -> Result<(), String> {
        let mut cdr = CdrReader::new(bytes)?;
        self.stamp = read_stamp(&mut cdr)?;
        cdr.string()?;
        cdr.strings(&mut self.names)?;
        cdr.doubles(&mut self.position)?;
        cdr.doubles(&mut self.velocity)?;
        cdr.doubles(&mut self.effort)
    }
}

/// The time stamp of a header \[ns\].
pub(crate) fn read_stamp(cdr: &mut CdrReader) -> Result<i64, String> {
    let (seconds, nanoseconds) = (cdr.i32()?, cdr.u32()?);
    match nanoseconds < 1_000_000_000 {
        true => Ok(i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds)),
        false => Err(format!("a time stamp with {nanoseconds} ns beyond the second")),
    }
}

pub(crate) fn write_stamp(cdr: &mut CdrWriter, stamp: i64) -> Result<(), String> {
    let seconds = i32::try_from(stamp.div_euclid(1_000_000_000));
    cdr.i32(seconds.map_err(|_| format!("the time stamp {stamp} ns does not fit into a message of ROS"))?);
    cdr.u32(stamp.rem_euclid(1_000_000_000) as u32);
    Ok(())
}

/// The bytes of a message: its stamp \[ns\], names, and per quantity one number per name, or none.
///
/// # Errors
/// Seconds that the message has no room for.
pub fn bytes(stamp: i64, names: &[String], values: [&[f64]; 3]) -> Result<Vec<u8>, String> {
    let mut cdr = CdrWriter::default();
    write_stamp(&mut cdr, stamp)?;
    cdr.string("");
    cdr.u32(names.len() as u32);
    names.iter().for_each(|name| cdr.string(name));
    values.into_iter().for_each(|numbers| cdr.doubles(numbers.iter().copied()));
    Ok(cdr.finish())
}
