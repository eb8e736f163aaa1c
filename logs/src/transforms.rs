//! `tf2_msgs/msg/TFMessage` of ROS 2: poses of frames.

use crate::cdr::{CdrReader, CdrWriter};
use crate::joint_state::{read_stamp, write_stamp};

/// The type of the message.
pub const TYPE: &str = "tf2_msgs/msg/TFMessage";

/// Its definition, and those of the messages that it is made of, as MCAP files carry it (`ros2msg`).
pub const SCHEMA: &str = "\
geometry_msgs/TransformStamped[] transforms
================================================================================
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
Transform transform
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Transform
Vector3 translation
Quaternion rotation
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
";

/// The pose of a frame in another at a time.
#[derive(Clone, Debug, PartialEq)]
pub struct StampedTransform<'a> {
    /// \[ns\]
    pub stamp: i64,
    /// The frame in which the pose is.
    pub parent: &'a str,
    /// The frame whose pose it is.
    pub child: &'a str,
    /// Its origin \[m\].
    pub translation: [f64; 3],
    /// Its axes: quaternion x, y, z, w.
    pub rotation: [f64; 4],
}

/// The poses of a message.
///
/// # Errors
/// What is wrong with its bytes.
pub fn read(bytes: &[u8]) -> Result<Vec<StampedTransform<'_>>, String> {
    let mut cdr = CdrReader::new(bytes)?;
    let count = cdr.u32()? as usize;
    // the least that one takes
    if count > bytes.len() / 72 {
        return Err(format!("{count} transforms in {} bytes", bytes.len()));
    }
    (0..count)
        .map(|_| {
            let stamp = read_stamp(&mut cdr)?;
            let (parent, child) = (cdr.string()?, cdr.string()?);
            let mut numbers = [0.0; 7];
            for x in &mut numbers {
                *x = cdr.double()?;
            }
            let [x, y, z, a, b, c, d] = numbers;
            Ok(StampedTransform { stamp, parent, child, translation: [x, y, z], rotation: [a, b, c, d] })
        })
        .collect()
}

/// The bytes of a message.
///
/// # Errors
/// Seconds that the message has no room for.
pub fn bytes(transforms: &[StampedTransform]) -> Result<Vec<u8>, String> {
    let mut cdr = CdrWriter::default();
    cdr.u32(transforms.len() as u32);
    for StampedTransform { stamp, parent, child, translation, rotation } in transforms {
        write_stamp(&mut cdr, *stamp)?;
        cdr.string(parent);
        cdr.string(child);
        translation.iter().chain(rotation).for_each(|x| cdr.double(*x));
    }
    Ok(cdr.finish())
}
