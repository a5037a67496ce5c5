//! The topics of a log. Each topic contains messages of one type with their log times.

pub mod json;
pub mod packed;
pub mod protobuf;
pub mod ros;

use std::collections::BTreeMap;

use super::bytes::Broken;
use super::{Column, Log, Stream};
use ros::Encoding;

/// A message format; each message has a topic number and a log time.
pub trait Messages {
    /// Advances to the next message and adds the topics described before it; returns number and time in ns, or `None`
    /// at the end of the file.
    fn advance(&mut self, topics: &mut Topics) -> Result<Option<(u32, u64)>, Broken>;

    /// The content of the message.
    fn data(&self) -> &[u8];

    /// Offset in the file.
    fn offset(&self) -> u64;
}

/// A log of messages, whose topics are its streams.
pub struct MessageLog<M> {
    messages: M,
    topics: Topics,
    /// Stream and time of the message.
    current: (usize, u64),
}

impl<M> MessageLog<M> {
    pub fn new(messages: M, topics: Topics) -> Self {
        Self {
            messages,
            topics,
            current: (0, 0),
        }
    }
}

impl<M: Messages> Log for MessageLog<M> {
    fn streams(&self) -> &[Stream] {
        &self.topics.streams
    }

    fn advance(&mut self) -> Result<Option<usize>, Broken> {
        let Some((number, time)) = self.messages.advance(&mut self.topics)? else {
            return Ok(None);
        };
        let (data, offset) = (self.messages.data(), self.messages.offset());
        let stream = self.topics.stream(number, data, offset)?;
        self.current = (stream, time);
        Ok(Some(stream))
    }

    fn values(&mut self, row: &mut Vec<f64>) -> Result<(), Broken> {
        let (stream, time) = self.current;
        let reader = &self.topics.readers[stream];
        reader.values(time, self.messages.data(), self.messages.offset(), row)
    }

    fn offset(&self) -> u64 {
        self.messages.offset()
    }
}

/// The topics of a log, by number.
#[derive(Default)]
pub struct Topics {
    streams: Vec<Stream>,
    readers: Vec<Reader>,
    of_number: BTreeMap<u32, usize>,
}

impl Topics {
    /// Adds a number for a topic. A topic may have several numbers, if a recorder restarts or several programs publish.
    pub fn add(&mut self, number: u32, topic: &str, reader: impl FnOnce() -> Reader) {
        if self.of_number.contains_key(&number) {
            return;
        }
        let known = self.streams.iter().position(|stream| stream.name == topic);
        let stream = known.unwrap_or_else(|| {
            let reader = reader();
            self.streams.push(reader.stream(topic));
            self.readers.push(reader);
            self.streams.len() - 1
        });
        self.of_number.insert(number, stream);
    }

    /// The stream of a message; its first message may define the columns.
    fn stream(&mut self, number: u32, data: &[u8], offset: u64) -> Result<usize, Broken> {
        let stream = self.of_number.get(&number).copied().ok_or_else(|| {
            let found = format_args!("a message on channel {number}");
            Broken::new(offset, found, "a channel described earlier in the file")
        })?;
        if let Reader::Json(columns) = &mut self.readers[stream]
            && columns.is_empty()
        {
            *columns = json::columns(data, offset)?;
            self.streams[stream] = self.readers[stream].stream(&self.streams[stream].name);
        }
        Ok(stream)
    }
}

/// The log-time column, in s.
const LOG_TIME: &str = "log_time";

/// Reader of the messages of a topic.
pub enum Reader {
    Ros(ros::Message),
    Protobuf(protobuf::Message),
    /// The first message defines the columns.
    Json(Vec<Column>),
    /// Only the message times are known, for this reason.
    Unknown(String),
}

impl Reader {
    /// Reader of ROS messages, from the text of their definition.
    pub fn of_ros(name: &str, definition: &str, encoding: Encoding) -> Self {
        match ros::Message::parse(name, definition, encoding) {
            Ok(message) => Self::Ros(message),
            Err(wrong) => Self::Unknown(format!(
                "turncal cannot read the message definition ({wrong})"
            )),
        }
    }

    /// The stream of a topic.
    fn stream(&self, topic: &str) -> Stream {
        let mut columns = vec![Column::new(LOG_TIME, "s")];
        let mut remarks = Vec::new();
        match self {
            Self::Ros(message) => columns.extend_from_slice(&message.columns),
            Self::Protobuf(message) => columns.extend_from_slice(&message.columns),
            Self::Json(known) => columns.extend_from_slice(known),
            Self::Unknown(why) => remarks.push(format!("`{topic}`: {why}")),
        }
        Stream {
            name: topic.to_owned(),
            columns,
            remarks,
            is_inertial: true,
            axes: None,
        }
    }

    /// The values of a message with this log time in ns.
    fn values(
        &self,
        time: u64,
        bytes: &[u8],
        offset: u64,
        row: &mut Vec<f64>,
    ) -> Result<(), Broken> {
        row.clear();
        row.push((time / 1_000_000_000) as f64 + 1e-9 * (time % 1_000_000_000) as f64);
        match self {
            Self::Ros(message) => message.values(bytes, offset, row),
            Self::Protobuf(message) => message.values(bytes, offset, row),
            Self::Json(columns) => json::values(columns, bytes, offset, row),
            Self::Unknown(_) => Ok(()),
        }
    }
}
