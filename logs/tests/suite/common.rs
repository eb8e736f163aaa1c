//! Logs and files that tests stand on.

use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions, Writer};
use std::collections::BTreeMap;
use std::io::Cursor;
use straightline_logs::joint_state;

/// Numbers that look like noise: SplitMix64, uniform in ±1.
pub struct Noise(pub u64);

impl Noise {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn uniform(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Uniform from 0 to 1.
    pub fn positive(&mut self) -> f64 {
        0.5 * (self.uniform() + 1.0)
    }

    /// Of a normal distribution with variance 1, as sums of twelve are.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.positive()).sum::<f64>() - 6.0
    }
}

/// A message for the file of a test: topic, stamp of the header \[ns\], names, position, velocity, effort.
pub struct Sent<'a>(pub &'a str, pub i64, pub &'a [&'a str], pub [&'a [f64]; 3]);

/// An MCAP file as another program would write it.
pub fn recorded(messages: &[Sent], compression: Option<Compression>) -> Vec<u8> {
    let options = WriteOptions::new().compression(compression).profile("ros2");
    let mut writer = Writer::with_options(Cursor::new(Vec::new()), options).expect("a file");
    let schema = writer.add_schema(joint_state::TYPE, "ros2msg", joint_state::SCHEMA.as_bytes()).expect("a schema");
    let other = writer.add_schema("std_msgs/msg/String", "ros2msg", b"string data\n").expect("a schema");
    let rosout = writer.add_channel(other, "/remarks", "cdr", &BTreeMap::new()).expect("a channel");
    for (i, Sent(topic, stamp, names, values)) in messages.iter().enumerate() {
        let channel_id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).expect("a channel");
        let names: Vec<String> = names.iter().map(ToString::to_string).collect();
        let data = joint_state::bytes(*stamp, &names, *values).expect("a message");
        let header = MessageHeader { channel_id, sequence: i as u32, log_time: 7_000 + i as u64, publish_time: 0 };
        writer.write_to_known_channel(&header, &data).expect("written");
        let header = MessageHeader { channel_id: rosout, ..header };
        writer.write_to_known_channel(&header, &[0, 1, 0, 0, 2, 0, 0, 0, b'a', 0]).expect("written");
    }
    writer.finish().expect("the file ends");
    writer.into_inner().into_inner()
}
