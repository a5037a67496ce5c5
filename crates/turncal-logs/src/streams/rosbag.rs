//! ROS 1 bags, version 2.0.
//!
//! Source: wiki.ros.org/Bags/Format/2.0: a version line, then records with a header (fields `name=value`) and data;
//! chunks contain compressed connections and messages.

use super::Log;
use super::bytes::{Broken, Input, Slice};
use super::messages::packed::unpack;
use super::messages::ros::Encoding;
use super::messages::{MessageLog, Messages, Reader, Topics};

const FIRST_LINE: u64 = 13;
const MESSAGE: u8 = 2;
const CHUNK: u8 = 5;
const CONNECTION: u8 = 7;

pub fn open(mut input: Input) -> Result<Box<dyn Log>, Broken> {
    input.skip(FIRST_LINE, "the first line")?;
    let messages = Bag {
        input,
        chunk: Vec::new(),
        at: 0,
        head: Vec::new(),
        data: Vec::new(),
        offset: 0,
    };
    Ok(Box::new(MessageLog::new(messages, Topics::default())))
}

struct Bag {
    input: Input,
    /// Records of the current chunk, and the position in it.
    chunk: Vec<u8>,
    at: usize,
    head: Vec<u8>,
    data: Vec<u8>,
    /// Offset of the record or of its chunk.
    offset: u64,
}

impl Messages for Bag {
    fn advance(&mut self, topics: &mut Topics) -> Result<Option<(u32, u64)>, Broken> {
        while self.next_record()? {
            let head = Head::of(&self.head, self.offset)?;
            let kind = head.field("op").and_then(|op| op.first()).copied();
            match kind {
                Some(MESSAGE) => {
                    let connection = head.whole("conn", 4)? as u32;
                    let time = head.whole("time", 8)?;
                    let (seconds, nanoseconds) = (time & 0xffff_ffff, time >> 32);
                    return Ok(Some((connection, seconds * 1_000_000_000 + nanoseconds)));
                }
                Some(CHUNK) => {
                    let size = head.whole("size", 4)?;
                    let method = head.field("compression").unwrap_or_default();
                    let method = String::from_utf8_lossy(method);
                    self.chunk = unpack(&method, &self.data, size, self.offset, &self.input)?;
                    self.at = 0;
                }
                Some(CONNECTION) => self.connection(topics)?,
                Some(_) => {}
                None => {
                    return Err(Broken::new(
                        self.offset,
                        "a record without `op`",
                        "its record type",
                    ));
                }
            }
        }
        Ok(None)
    }

    fn data(&self) -> &[u8] {
        &self.data
    }

    fn offset(&self) -> u64 {
        self.offset
    }
}

impl Bag {
    /// Reads the next record, from the chunk if one is open; false at the end.
    fn next_record(&mut self) -> Result<bool, Broken> {
        if self.at < self.chunk.len() {
            let mut chunk = Slice::packed(&self.chunk[self.at..], self.offset);
            for part in [&mut self.head, &mut self.data] {
                part.clear();
                part.extend_from_slice(chunk.measured(4, "a record in a chunk")?);
            }
            self.at += chunk.position();
            if Head::of(&self.head, self.offset)?.field("op") == Some(&[CHUNK]) {
                return Err(Broken::new(
                    self.offset,
                    "a chunk inside a chunk",
                    "messages",
                ));
            }
            return Ok(true);
        }
        self.offset = self.input.offset();
        if self.input.left() == 0 {
            return Ok(false);
        }
        for part in [&mut self.head, &mut self.data] {
            self.input.take(4, part, "a length")?;
            let length = Slice::new(part, self.offset).whole(4, "a length")?;
            self.input.take(length, part, "a record")?;
        }
        Ok(true)
    }

    fn connection(&self, topics: &mut Topics) -> Result<(), Broken> {
        let head = Head::of(&self.head, self.offset)?;
        let number = head.whole("conn", 4)? as u32;
        let text =
            |bytes: Option<&[u8]>| String::from_utf8_lossy(bytes.unwrap_or_default()).into_owned();
        let topic = text(head.field("topic"));
        let described = Head::of(&self.data, self.offset)?;
        let (kind, definition) = (
            described.field("type"),
            described.field("message_definition"),
        );
        let reader = || Reader::of_ros(&text(kind), &text(definition), Encoding::Ros1);
        topics.add(number, &topic, reader);
        Ok(())
    }
}

/// Fields by name.
struct Head<'a> {
    fields: Vec<(&'a [u8], &'a [u8])>,
    offset: u64,
}

impl<'a> Head<'a> {
    fn of(bytes: &'a [u8], offset: u64) -> Result<Self, Broken> {
        let mut slice = Slice::packed(bytes, offset);
        let mut fields = Vec::new();
        while slice.left() > 0 {
            let field = slice.measured(4, "a field")?;
            let equals = field.iter().position(|&byte| byte == b'=');
            let Some(equals) = equals else {
                return Err(Broken::new(offset, "a field without `=`", "`name=value`"));
            };
            fields.push((&field[..equals], &field[equals + 1..]));
        }
        Ok(Self { fields, offset })
    }

    fn field(&self, name: &str) -> Option<&'a [u8]> {
        let found = self
            .fields
            .iter()
            .find(|(known, _)| *known == name.as_bytes());
        found.map(|&(_, value)| value)
    }

    fn whole(&self, name: &str, size: usize) -> Result<u64, Broken> {
        let field = self.field(name).filter(|field| field.len() == size);
        let field = field.ok_or_else(|| {
            Broken::new(
                self.offset,
                format_args!("no `{name}` of {size} bytes"),
                "this field",
            )
        })?;
        Slice::new(field, self.offset).whole(size, name)
    }
}
