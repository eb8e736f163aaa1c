//! `nav_msgs/msg/Odometry` of ROS 2: how a base moves. Its twist is in the axes of the frame that moves; covariances are not kept.

use crate::cdr::{CdrReader, CdrWriter};
use crate::joint_state::{read_stamp, write_stamp};
use crate::transforms::StampedTransform;

/// The type of the message.
pub const TYPE: &str = "nav_msgs/msg/Odometry";

/// Numbers of a covariance of six.
const COVARIANCE: usize = 36;

/// A message.
#[derive(Clone, Debug, PartialEq)]
pub struct Odometry<'a> {
    /// The pose.
    pub pose: StampedTransform<'a>,
    /// Linear \[m/s\] and angular velocity \[rad/s\], in the axes of the child.
    pub twist: [f64; 6],
}

/// Reads a message.
///
/// # Errors
/// What is wrong with its bytes.
pub fn read(bytes: &[u8]) -> Result<Odometry<'_>, String> {
    let mut cdr = CdrReader::new(bytes)?;
    let stamp = read_stamp(&mut cdr)?;
    let (parent, child) = (cdr.string()?, cdr.string()?);
    let mut numbers = [0.0; 7 + COVARIANCE + 6 + COVARIANCE];
    for x in &mut numbers {
        *x = cdr.double()?;
    }
    let [x, y, z, a, b, c, d, ..] = numbers;
    let pose = StampedTransform { stamp, parent, child, translation: [x, y, z], rotation: [a, b, c, d] };
    Ok(Odometry { pose, twist: std::array::from_fn(|k| numbers[7 + COVARIANCE + k]) })
}

/// The bytes of a message, with covariances of zero.
///
/// # Errors
/// Seconds that the message has no room for.
pub fn bytes(message: &Odometry) -> Result<Vec<u8>, String> {
    let Odometry { pose: StampedTransform { stamp, parent, child, translation, rotation }, twist } = message;
    let mut cdr = CdrWriter::default();
    write_stamp(&mut cdr, *stamp)?;
    cdr.string(parent);
    cdr.string(child);
    let covariance = [0.0; COVARIANCE];
    let numbers = [&translation[..], rotation, &covariance, twist, &covariance].concat();
    numbers.iter().for_each(|x| cdr.double(*x));
    Ok(cdr.finish())
}
