//! MCAP files with ROS 2 messages: joint states in and out.
//!
//! Chunks may be compressed by lz4 or zstd. Read are messages in CDR (`ros2 bag` writes no other); JSON, Protobuf and ROS 1 are not.

use crate::failure::LogError;
use crate::joint_state::{self, JointState};
use crate::log::{JointLog, LogQuantity, LogRecorder, LogTopic};
use crate::odometry;
use crate::records::{damaged, for_each_record};
use crate::transforms::{self, StampedTransform};
use ::mcap::records::{MessageHeader, Record};
use ::mcap::{Compression, WriteOptions, Writer};
use std::collections::{BTreeMap, HashMap};
use std::io::Cursor;

/// The topic that logs are written to.
pub const TOPIC: &str = "/joint_states";
/// The topic of poses, by whose name programs find them.
pub const TRANSFORMS: &str = "/tf";

/// Poses of frames in one of them, row by row of a log.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoggedFrames {
    /// The frame in which the poses are.
    pub parent: String,
    /// The frames.
    pub children: Vec<String>,
    /// Per row and frame its origin \[m\] and its axes, as a quaternion x, y, z, w.
    pub poses: Vec<Vec<([f64; 3], [f64; 4])>>,
}

impl LoggedFrames {
    /// The same without a frame, such as the one in which the others are.
    #[must_use]
    pub fn without(mut self, name: &str) -> LoggedFrames {
        let kept: Vec<bool> = self.children.iter().map(|child| child != name).collect();
        for poses in &mut self.poses {
            let mut kept = kept.iter();
            poses.retain(|_| kept.next().is_none_or(|kept| *kept));
        }
        self.children.retain(|child| child != name);
        self
    }
}

/// A pose of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct LoggedPose {
    /// The topic that has it.
    pub topic: String,
    /// Time stamp \[ns\].
    pub stamp: i64,
    /// The frame in which the pose is.
    pub parent: String,
    /// The frame whose pose it is.
    pub child: String,
    /// Its origin \[m\].
    pub translation: [f64; 3],
    /// Its axes: quaternion x, y, z, w.
    pub rotation: [f64; 4],
    /// Linear \[m/s\] and angular velocity \[rad/s\] in its own axes, where the message has them.
    pub twist: Option<[f64; 6]>,
}

impl LoggedPose {
    fn of(topic: &str, pose: &StampedTransform, twist: Option<[f64; 6]>) -> LoggedPose {
        LoggedPose {
            topic: topic.to_string(),
            stamp: pose.stamp,
            parent: pose.parent.to_string(),
            child: pose.child.to_string(),
            translation: pose.translation,
            rotation: pose.rotation,
            twist,
        }
    }
}

/// The poses of a message of a kind that has some.
fn poses_of(kind: &str, topic: &str, data: &[u8]) -> Result<Vec<LoggedPose>, String> {
    match kind {
        odometry::TYPE => odometry::read(data).map(|found| vec![LoggedPose::of(topic, &found.pose, Some(found.twist))]),
        _ => Ok(transforms::read(data)?.iter().map(|pose| LoggedPose::of(topic, pose, None)).collect()),
    }
}

/// All poses of a file, in its order, of whatever topics have them: `tf2_msgs/msg/TFMessage` and `nav_msgs/msg/Odometry`.
///
/// # Errors
/// What is wrong with the bytes, and where.
pub fn frame_poses(bytes: &[u8]) -> Result<Vec<LoggedPose>, LogError> {
    let (mut schemas, mut channels, mut found) = (HashMap::new(), HashMap::new(), Vec::new());
    for_each_record(bytes, &mut |record, at| {
        match record {
            Record::Schema { header, .. } => _ = schemas.insert(header.id, header.name.clone()),
            Record::Channel(channel) => {
                let kind = schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                if [transforms::TYPE, odometry::TYPE].contains(&&kind[..]) && channel.message_encoding == "cdr" {
                    channels.insert(channel.id, (kind, channel.topic.clone()));
                }
            }
            Record::Message { header, data } => {
                let Some((kind, topic)) = channels.get(&header.channel_id) else { return Ok(()) };
                let help = format!("it is no {kind} in CDR, or damaged");
                let place = format!("a message of {topic} at byte {at} of the file");
                found.extend(poses_of(kind, topic, data).map_err(|what| LogError::new(place, what, help))?);
            }
            _ => {}
        }
        Ok(())
    })?;
    Ok(found)
}

/// A channel of the file.
#[derive(Debug)]
struct LogChannel {
    topic: LogTopic,
    encoding: String,
}

impl LogChannel {
    fn is_readable(&self) -> bool {
        self.topic.kind == joint_state::TYPE && self.encoding == "cdr"
    }

    fn shown(&self) -> String {
        let LogTopic { name, kind, messages } = &self.topic;
        format!("{name} ({kind}, {}, {messages} messages)", self.encoding)
    }
}

/// What a pass through the file finds.
#[derive(Debug, Default)]
struct McapPass {
    schemas: HashMap<u16, String>,
    channels: HashMap<u16, LogChannel>,
    recorder: LogRecorder,
    /// The topic that was asked for.
    asked: Option<String>,
    /// The topic that is read: that one, or the first with joint states.
    topic: Option<String>,
}

/// The joint states of a file: of the topic, or of the only one that has some.
///
/// # Errors
/// What is wrong with the bytes, and where; no topic, or several of them, have joint states.
pub fn read(bytes: &[u8], topic: Option<&str>) -> Result<JointLog, LogError> {
    let mut pass =
        McapPass { asked: topic.map(str::to_string), topic: topic.map(str::to_string), ..McapPass::default() };
    for_each_record(bytes, &mut |record, at| pass.take(record, at))?;
    pass.finish()
}

impl McapPass {
    fn take(&mut self, record: &Record, at: usize) -> Result<(), LogError> {
        match record {
            Record::Schema { header, .. } => {
                self.schemas.insert(header.id, header.name.clone());
            }
            // the summary names them once more
            Record::Channel(channel) if !self.channels.contains_key(&channel.id) => {
                let kind = self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
                let topic = LogTopic { name: channel.topic.clone(), kind, messages: 0 };
                let encoding = channel.message_encoding.clone();
                self.channels.insert(channel.id, LogChannel { topic, encoding });
            }
            Record::Message { header, data } => self.message(header, data, at)?,
            _ => {}
        }
        Ok(())
    }

    fn message(&mut self, header: &MessageHeader, data: &[u8], at: usize) -> Result<(), LogError> {
        let Some(channel) = self.channels.get_mut(&header.channel_id) else {
            let what = format!("a message of channel {}, which is not declared", header.channel_id);
            return Err(damaged(at, &what));
        };
        channel.topic.messages += 1;
        if !channel.is_readable() {
            return Ok(());
        }
        let LogTopic { name, messages, .. } = &channel.topic;
        match &self.topic {
            // where none was asked for, the end says that there are several
            Some(topic) if topic != name => return Ok(()),
            Some(_) => {}
            None => self.topic = Some(name.clone()),
        }
        let place = || format!("message {messages} of {name} (at byte {at} of the file)");
        let unread =
            |what: String| LogError::new(place(), what, format!("it is no {} in CDR, or damaged", joint_state::TYPE));
        let mut message = JointState::default();
        message.read(data).map_err(unread)?;
        let is_unstamped = message.stamp == 0 && header.log_time != 0;
        let stamp = if is_unstamped { i64::try_from(header.log_time).unwrap_or(i64::MAX) } else { message.stamp };
        let values = [&message.position[..], &message.velocity, &message.effort, &[]];
        let help = "a message has one position, velocity and effort per name, or none of that kind";
        self.recorder.push(stamp, &message.names, values).map_err(|what| LogError::new(place(), what, help))?;
        if is_unstamped {
            self.recorder.is_unstamped();
        }
        Ok(())
    }

    fn finish(self) -> Result<JointLog, LogError> {
        let McapPass { channels, recorder, asked, .. } = self;
        let mut channels: Vec<LogChannel> = channels.into_values().collect();
        channels.sort_by(|a, b| a.topic.name.cmp(&b.topic.name));
        let is_readable = |c: &&LogChannel| c.is_readable() && c.topic.messages > 0;
        let is_wanted = |c: &&LogChannel| asked.as_ref().is_none_or(|name| *name == c.topic.name);
        let mut names: Vec<&str> =
            channels.iter().filter(is_readable).filter(is_wanted).map(|c| &c.topic.name[..]).collect();
        // a topic may have a channel per publisher
        names.dedup();
        let listed =
            |of: &mut dyn Iterator<Item = &LogChannel>| of.map(LogChannel::shown).collect::<Vec<_>>().join(", ");
        match names[..] {
            [name] => {
                let name = name.to_string();
                let others = channels.into_iter().map(|c| c.topic).filter(|t| t.name != name).collect();
                Ok(recorder.finish(others))
            }
            [] => {
                let what = match &asked {
                    Some(topic) => format!("topic `{topic}` has no {} in CDR", joint_state::TYPE),
                    None => format!("no topic has a {} in CDR", joint_state::TYPE),
                };
                let help = match listed(&mut channels.iter()) {
                    all if all.is_empty() => "the file has no topics".to_string(),
                    all => format!("the topics are {all}"),
                };
                Err(LogError::new("", what, help))
            }
            _ => {
                let help = format!("name one of them: {}", listed(&mut channels.iter().filter(is_readable)));
                Err(LogError::new("", format!("{} topics have joint states", names.len()), help))
            }
        }
    }
}

/// A log as MCAP: joint states with all that the log has of position, velocity and effort, one message per time stamp, in chunks that zstd compresses.
///
/// # Errors
/// Time stamps that ROS has no room for, or what the library says.
pub fn bytes(log: &JointLog, topic: &str) -> Result<Vec<u8>, LogError> {
    bytes_with(log, topic, &LoggedFrames::default())
}

/// The same with poses of frames, on the topic `/tf`.
///
/// # Errors
/// As [`bytes`].
pub fn bytes_with(log: &JointLog, topic: &str, frames: &LoggedFrames) -> Result<Vec<u8>, LogError> {
    let unwritten = |error: ::mcap::McapError| LogError::new("", format!("MCAP cannot be written: {error}"), "");
    let options = WriteOptions::new().compression(Some(Compression::Zstd)).profile("ros2").library("straightline");
    let mut writer = Writer::with_options(Cursor::new(Vec::new()), options).map_err(unwritten)?;
    let schema = writer.add_schema(joint_state::TYPE, "ros2msg", joint_state::SCHEMA.as_bytes()).map_err(unwritten)?;
    let channel_id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).map_err(unwritten)?;
    let of_frames = match frames.poses.is_empty() {
        true => None,
        false => {
            let schema =
                writer.add_schema(transforms::TYPE, "ros2msg", transforms::SCHEMA.as_bytes()).map_err(unwritten)?;
            Some(writer.add_channel(schema, TRANSFORMS, "cdr", &BTreeMap::new()).map_err(unwritten)?)
        }
    };
    let mut row = [const { Vec::new() }; 3];
    for (i, t) in log.times.iter().enumerate() {
        let stamp = log.start.saturating_add((t * 1e9).round() as i64);
        for (quantity, row) in LogQuantity::ALL.into_iter().zip(&mut row) {
            row.clear();
            let columns = &log.columns[quantity as usize];
            if columns.iter().any(|column| !column.is_empty()) {
                row.extend((0..log.joints.len()).map(|k| log.column(quantity, k).get(i).copied().unwrap_or(f64::NAN)));
            }
        }
        let place = || format!("row {}", i + 1);
        let help = "the columns `t` of logs are seconds";
        let stamped = |what: String| LogError::new(place(), what, help);
        let data = joint_state::bytes(stamp, &log.joints, [&row[0], &row[1], &row[2]]).map_err(stamped)?;
        let time = u64::try_from(stamp).map_err(|_| stamped(format!("the time stamp {stamp} ns is negative")))?;
        let header = MessageHeader { channel_id, sequence: i as u32, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, &data).map_err(unwritten)?;
        if let (Some(channel_id), Some(poses)) = (of_frames, frames.poses.get(i)) {
            let named = frames.children.iter().zip(poses);
            let stamped = named.map(|(child, (translation, rotation))| StampedTransform {
                stamp,
                parent: &frames.parent,
                child,
                translation: *translation,
                rotation: *rotation,
            });
            let data =
                transforms::bytes(&stamped.collect::<Vec<_>>()).map_err(|what| LogError::new(place(), what, help))?;
            writer.write_to_known_channel(&MessageHeader { channel_id, ..header }, &data).map_err(unwritten)?;
        }
    }
    writer.finish().map_err(unwritten)?;
    Ok(writer.into_inner().into_inner())
}
