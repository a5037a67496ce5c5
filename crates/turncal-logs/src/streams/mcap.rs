//! MCAP: messages of ROS 1 and 2, Protocol Buffers and JSON whose schemas are in the file.
//!
//! Source: mcap.dev, "MCAP Format Specification": magic bytes, then records with an opcode, an eight-byte length and
//! content; chunks contain compressed records.

use std::collections::BTreeMap;

use super::Log;
use super::bytes::{Broken, Input, Slice};
use super::messages::packed::unpack;
use super::messages::ros::Encoding;
use super::messages::{MessageLog, Messages, Reader, Topics, protobuf};

const MAGIC: u64 = 8;
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const DATA_END: u8 = 15;

pub fn open(mut input: Input) -> Result<Box<dyn Log>, Broken> {
    input.skip(MAGIC, "the first bytes")?;
    let messages = Mcap {
        input,
        schemas: BTreeMap::new(),
        chunk: Vec::new(),
        at: 0,
        record: Vec::new(),
        offset: 0,
        is_ended: false,
    };
    Ok(Box::new(MessageLog::new(messages, Topics::default())))
}

struct Schema {
    name: String,
    encoding: String,
    data: Vec<u8>,
}

struct Mcap {
    input: Input,
    schemas: BTreeMap<u16, Schema>,
    /// Records of the current chunk, and the position in it.
    chunk: Vec<u8>,
    at: usize,
    record: Vec<u8>,
    /// Offset of the record or of its chunk.
    offset: u64,
    is_ended: bool,
}

/// Bytes of a message before its data: channel, number, two times.
const BEFORE_DATA: usize = 22;

impl Messages for Mcap {
    fn advance(&mut self, topics: &mut Topics) -> Result<Option<(u32, u64)>, Broken> {
        while let Some(kind) = self.next_record()? {
            match kind {
                SCHEMA => self.schema()?,
                CHANNEL => self.channel(topics)?,
                MESSAGE => return self.message().map(Some),
                CHUNK => self.open_chunk()?,
                DATA_END => self.is_ended = true,
                _ => {}
            }
        }
        Ok(None)
    }

    fn data(&self) -> &[u8] {
        self.record.get(BEFORE_DATA..).unwrap_or_default()
    }

    fn offset(&self) -> u64 {
        self.offset
    }
}

impl Mcap {
    /// Reads the next record, from the chunk if one is open; returns its opcode, or `None` at the end of the data.
    fn next_record(&mut self) -> Result<Option<u8>, Broken> {
        if self.at < self.chunk.len() {
            let mut chunk = Slice::packed(&self.chunk[self.at..], self.offset);
            let kind = chunk.whole(1, "the type of a record")? as u8;
            let content = chunk.measured(8, "a record in a chunk")?;
            self.record.clear();
            self.record.extend_from_slice(content);
            self.at += chunk.position();
            if kind == CHUNK {
                return Err(Broken::new(
                    self.offset,
                    "a chunk inside a chunk",
                    "messages",
                ));
            }
            return Ok(Some(kind));
        }
        if self.is_ended {
            return Ok(None);
        }
        self.offset = self.input.offset();
        self.input
            .take(9, &mut self.record, "the type and length of a record")?;
        let mut head = Slice::new(&self.record, self.offset);
        let kind = head.whole(1, "the type of a record")? as u8;
        let length = head.whole(8, "the length of a record")?;
        if matches!(kind, SCHEMA | CHANNEL | MESSAGE | CHUNK) {
            self.input.take(length, &mut self.record, "a record")?;
        } else if (1..=DATA_END).contains(&kind) || kind >= 0x80 {
            self.input.skip(length, "a record")?;
        } else {
            return Err(Broken::new(
                self.offset,
                format_args!("a record of type {kind}"),
                "a record type of MCAP",
            ));
        }
        Ok(Some(kind))
    }

    fn open_chunk(&mut self) -> Result<(), Broken> {
        let mut record = Slice::new(&self.record, self.offset + 9);
        record.take(16, "the times of a chunk")?;
        let size = record.whole(8, "the size of a chunk")?;
        let sum = record.whole(4, "the checksum of a chunk")? as u32;
        let method = record.measured_text(4, "the compression of a chunk")?;
        let packed = record.measured(8, "a chunk")?;
        self.chunk = unpack(&method, packed, size, self.offset, &self.input)?;
        self.at = 0;
        let mut found = flate2::Crc::new();
        found.update(&self.chunk);
        // Zero means that there is no checksum.
        if sum != 0 && found.sum() != sum {
            self.chunk.clear();
            return Err(Broken::new(
                self.offset,
                format_args!("a chunk with the checksum {:08x}", found.sum()),
                format_args!("{sum:08x}"),
            ));
        }
        Ok(())
    }

    fn schema(&mut self) -> Result<(), Broken> {
        let mut record = Slice::packed(&self.record, self.offset);
        let number = record.whole(2, "a schema number")? as u16;
        let name = record.measured_text(4, "a schema name")?;
        let encoding = record.measured_text(4, "a schema encoding")?;
        let data = record.measured(4, "a schema")?.to_vec();
        let schema = Schema {
            name,
            encoding,
            data,
        };
        self.schemas.insert(number, schema);
        Ok(())
    }

    fn channel(&self, topics: &mut Topics) -> Result<(), Broken> {
        let mut record = Slice::packed(&self.record, self.offset);
        let number = record.whole(2, "a channel number")? as u16;
        let schema = record.whole(2, "a schema number")? as u16;
        let topic = record.measured_text(4, "a topic")?;
        let encoding = record.measured_text(4, "a message encoding")?;
        let reader = || match self.schemas.get(&schema) {
            Some(schema) => reader(&encoding, schema),
            None if encoding == "json" => Reader::Json(Vec::new()),
            None => Reader::Unknown(format!(
                "turncal cannot read messages of encoding `{encoding}` without a schema"
            )),
        };
        topics.add(number.into(), &topic, reader);
        Ok(())
    }

    /// Channel and time of a message.
    fn message(&self) -> Result<(u32, u64), Broken> {
        let mut record = Slice::packed(&self.record, self.offset);
        let channel = record.whole(2, "a channel number")? as u16;
        record.take(4, "a message number")?;
        let time = record.whole(8, "a time")?;
        record.take(8, "a time")?;
        Ok((channel.into(), time))
    }
}

fn reader(encoding: &str, schema: &Schema) -> Reader {
    let text = || String::from_utf8_lossy(&schema.data);
    match (encoding, &*schema.encoding) {
        ("cdr", "ros2msg") => Reader::of_ros(&schema.name, &text(), Encoding::Cdr),
        ("ros1", "ros1msg") => Reader::of_ros(&schema.name, &text(), Encoding::Ros1),
        ("json", _) => Reader::Json(Vec::new()),
        ("protobuf", "protobuf") => match protobuf::Message::parse(&schema.name, &schema.data) {
            Some(message) => Reader::Protobuf(message),
            None => Reader::Unknown("its descriptor is invalid".to_owned()),
        },
        (encoding, schema) => Reader::Unknown(format!(
            "turncal cannot read messages of encoding `{encoding}` with a schema of `{schema}`"
        )),
    }
}
