//! PX4 ULog.
//!
//! Source: PX4 User Guide, "ULog File Format": a header of 16 bytes, then messages, each with its size in two
//! bytes, its kind in one and its content.

mod corrections;
mod layout;

use std::collections::{BTreeMap, HashMap};

use super::bytes::{Broken, Input, Slice};
use super::corrections::Undo;
use super::{Log, Stream};
use corrections::Parameters;
use layout::Layout;
use turncal_input::{PerSensor, Sensor};

const HEADER: u64 = 16;
/// The only known incompatible flag: appended data.
const APPENDED: u8 = 1;

/// Topics of unfiltered instrument output.
const INERTIAL: [&str; 4] = [
    "sensor_accel",
    "sensor_gyro",
    "vehicle_imu",
    "sensor_combined",
];

pub fn open(mut input: Input) -> Result<Box<dyn Log>, Broken> {
    input.skip(HEADER, "the header")?;
    let mut ahead = Ulog::begin(input, PerSensor::default());
    let selected = ahead.first_selected();
    let mut input = ahead.input;
    input.go_to(HEADER)?;
    Ok(Box::new(Ulog::begin(input, selected)))
}

struct Ulog {
    input: Input,
    /// Fields of each named format, as written.
    formats: BTreeMap<String, String>,
    parameters: Parameters,
    /// Whether PX4 wrote the log, with axes front, right, down.
    is_px4: bool,
    streams: Vec<Stream>,
    /// Topics by the number in data messages.
    topics: HashMap<u16, Topic>,
    /// Offset of data appended after a possibly truncated message.
    appended: Vec<u64>,
    message: Vec<u8>,
    offset: u64,
    /// The topic of the message.
    current: Option<u16>,
}

struct Topic {
    stream: usize,
    layout: Layout,
    undo: Undo,
    /// Columns of the selected devices.
    selects: PerSensor<Option<usize>>,
}

impl Log for Ulog {
    fn streams(&self) -> &[Stream] {
        &self.streams
    }

    fn advance(&mut self) -> Result<Option<usize>, Broken> {
        while let Some(kind) = self.next_message()? {
            match kind {
                b'B' => self.flags()?,
                b'F' => self.format()?,
                b'P' => {
                    let mut content = Slice::new(&self.message, self.offset + 3);
                    self.parameters.take(&mut content)?;
                }
                b'I' => self.information(),
                b'A' => self.subscribe()?,
                b'D' => {
                    let number = self.content().whole(
                        2,
                        "a topic \
                        number",
                    )? as u16;
                    if let Some(topic) = self.topics.get(&number) {
                        let data = self.message.get(2..).unwrap_or_default();
                        for sensor in Sensor::ALL {
                            let place = topic.selects.get(sensor);
                            if let Some(device) =
                                place.and_then(|place| topic.layout.value(data, place))
                            {
                                self.parameters.select(sensor, device);
                            }
                        }
                        self.current = Some(number);
                        return Ok(Some(topic.stream));
                    }
                    return Err(Broken::new(
                        self.offset,
                        format_args!("data for topic {number}"),
                        "a topic subscribed before its data",
                    ));
                }
                // Other information about the log, text messages, marks and lost data.
                b'M' | b'Q' | b'R' | b'L' | b'C' | b'S' | b'O' => {}
                other => {
                    return Err(Broken::new(
                        self.offset,
                        format_args!("a message of type {other}"),
                        "a message type of ULog",
                    ));
                }
            }
        }
        Ok(None)
    }

    fn values(&mut self, row: &mut Vec<f64>) -> Result<(), Broken> {
        let topic = self.current.and_then(|number| self.topics.get_mut(&number));
        let Some(topic) = topic else {
            return Ok(());
        };
        let data = self.message.get(2..).unwrap_or_default();
        topic.layout.values(data, self.offset + 5, row)?;
        let parameters = &self.parameters;
        let is_news = topic.undo.undo(row, parameters.changes, |sensor, device| {
            parameters.applied(sensor, device)
        });
        if is_news {
            self.streams[topic.stream].remarks = topic.undo.remarks();
        }
        Ok(())
    }

    fn offset(&self) -> u64 {
        self.offset
    }
}

impl Ulog {
    /// Starts at the first message, with these selected devices.
    fn begin(input: Input, selected: PerSensor<Option<f64>>) -> Self {
        Self {
            input,
            formats: BTreeMap::new(),
            parameters: Parameters::of(selected),
            is_px4: false,
            streams: Vec::new(),
            topics: HashMap::new(),
            appended: Vec::new(),
            message: Vec::new(),
            offset: HEADER,
            current: None,
        }
    }

    /// The devices selected at the start of the log: samples of other devices may precede the message that selects
    /// them. Damage is reported later, when the messages are read.
    fn first_selected(&mut self) -> PerSensor<Option<f64>> {
        while !self.parameters.have_selected() && matches!(self.advance(), Ok(Some(_))) {}
        self.parameters.selected
    }

    fn content(&self) -> Slice<'_> {
        Slice::new(&self.message, self.offset + 3)
    }

    /// Reads the next message; its kind, or none at the end.
    fn next_message(&mut self) -> Result<Option<u8>, Broken> {
        self.offset = self.input.offset();
        if self.input.left() == 0 {
            return Ok(None);
        }
        self.input
            .take(3, &mut self.message, "the size and type of a message")?;
        let mut head = Slice::new(&self.message, self.offset);
        let size = head.whole(2, "a message size")?;
        let kind = head.whole(1, "a message type")? as u8;
        let end = self.offset + 3 + size;
        // A message cut off by the appended data has no end.
        let cut = self
            .appended
            .iter()
            .copied()
            .find(|&at| self.offset < at && end > at);
        if let Some(at) = cut {
            self.input.go_to(at)?;
            return self.next_message();
        }
        self.input.take(size, &mut self.message, "a message")?;
        Ok(Some(kind))
    }

    fn flags(&mut self) -> Result<(), Broken> {
        let mut content = self.content();
        content.take(8, "compatible flags")?;
        let flags = content.take(8, "incompatible flags")?;
        let unknown = flags[0] & !APPENDED != 0 || flags[1..].iter().any(|&flag| flag != 0);
        if unknown {
            return Err(Broken::new(
                self.offset,
                "a flag of a later format version",
                "a format version that turncal supports",
            ));
        }
        let mut offsets = Vec::new();
        for _ in 0..3 {
            let offset = content.whole(8, "the offset of appended data")?;
            if offset > self.offset {
                offsets.push(offset);
            }
        }
        offsets.sort_unstable();
        self.appended = offsets;
        Ok(())
    }

    /// Information about the log, mostly unused.
    fn information(&mut self) {
        let mut content = self.content();
        let length = content.length(1, "the length of a name").unwrap_or(0);
        let key = content.text(length, "a name").unwrap_or_default();
        let left = content.left();
        let value = content.text(left, "a value").unwrap_or_default();
        self.is_px4 |= key.ends_with(" sys_name") && value == "PX4";
    }

    fn format(&mut self) -> Result<(), Broken> {
        let mut content = self.content();
        let length = content.left();
        let text = content.text(length, "a format")?;
        let Some((name, fields)) = text.split_once(':') else {
            return Err(Broken::new(
                self.offset,
                format_args!("the format `{text}`"),
                "`name:type field;…`",
            ));
        };
        self.formats.insert(name.to_owned(), fields.to_owned());
        Ok(())
    }

    fn subscribe(&mut self) -> Result<(), Broken> {
        let mut content = self.content();
        let instance = content.whole(1, "an instance")?;
        let number = content.whole(2, "a topic number")? as u16;
        let length = content.left();
        let name = content.text(length, "a topic name")?;
        let layout = Layout::of(&name, &self.formats)
            .map_err(|(found, expected)| Broken::new(self.offset, found, expected))?;
        let undo = corrections::of_topic(&name, &layout.columns);
        let selects = corrections::selects(&name, &layout.columns);
        let stream = self.streams.len();
        self.streams.push(Stream {
            name: format!("{name}[{instance}]"),
            columns: layout.columns.clone(),
            remarks: Vec::new(),
            is_inertial: INERTIAL.contains(&&*name),
            axes: self.is_px4.then_some("frd"),
        });
        let topic = Topic {
            stream,
            layout,
            undo,
            selects,
        };
        self.topics.insert(number, topic);
        Ok(())
    }
}
