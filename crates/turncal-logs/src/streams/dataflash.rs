//! ArduPilot DataFlash logs.
//!
//! Messages start with the bytes A3 95 and their type; type 128 (`FMT`) defines the content of the others. `IMU`, `ACC`
//! and `GYR` are corrected with the parameters `INS_…` in `PARM` messages.
//!
//! Source: ArduPilot, `libraries/AP_Logger/LogStructure.h`.

use std::collections::BTreeMap;

use super::bytes::{Broken, Input, Kind, Slice};
use super::corrections::{Applied, Corrected, Undo};
use super::{Column, Log, Stream};
use turncal_input::{PerSensor, Sensor};

const BEGIN: [u8; 2] = [0xa3, 0x95];
const FMT: u8 = 0x80;
/// The column that distinguishes instances.
const INSTANCE: &str = "I";

pub fn open(input: Input) -> Result<Box<dyn Log>, Broken> {
    let mut formats = BTreeMap::new();
    formats.insert(
        FMT,
        Format::of(0, "FMT", 89, "BBnNZ", "Type,Length,Name,Format,Columns")?,
    );
    Ok(Box::new(DataFlash {
        input,
        formats,
        parameters: BTreeMap::new(),
        changes: 0,
        streams: Vec::new(),
        of_streams: BTreeMap::new(),
        undo: Vec::new(),
        message: Vec::new(),
        offset: 0,
        current: (FMT, 0),
    }))
}

struct DataFlash {
    input: Input,
    formats: BTreeMap<u8, Format>,
    parameters: BTreeMap<String, f64>,
    /// Number of parameter changes.
    changes: u64,
    streams: Vec<Stream>,
    /// Streams by type and instance.
    of_streams: BTreeMap<(u8, u8), usize>,
    undo: Vec<(Undo, u8)>,
    message: Vec<u8>,
    offset: u64,
    /// Type and stream of the message.
    current: (u8, usize),
}

struct Format {
    name: String,
    length: u64,
    columns: Vec<Column>,
    /// Offset, kind and factor of each number.
    places: Vec<(usize, Kind, f64)>,
    /// Offset of the instance.
    instance: Option<usize>,
}

impl Format {
    fn of(offset: u64, name: &str, length: u64, types: &str, labels: &str) -> Result<Self, Broken> {
        let mut format = Self {
            name: name.to_owned(),
            length,
            columns: Vec::new(),
            places: Vec::new(),
            instance: None,
        };
        let mut place = 3;
        for (letter, label) in types.chars().zip(labels.split(',')) {
            let (kind, factor) = match letter {
                'b' => (Kind::I8, 1.0),
                'B' | 'M' => (Kind::U8, 1.0),
                'h' => (Kind::I16, 1.0),
                'H' => (Kind::U16, 1.0),
                'i' => (Kind::I32, 1.0),
                'I' => (Kind::U32, 1.0),
                'q' => (Kind::I64, 1.0),
                'Q' => (Kind::U64, 1.0),
                'f' => (Kind::F32, 1.0),
                'd' => (Kind::F64, 1.0),
                'c' => (Kind::I16, 0.01),
                'C' => (Kind::U16, 0.01),
                'e' => (Kind::I32, 0.01),
                'E' => (Kind::U32, 0.01),
                'L' => (Kind::I32, 1e-7),
                other => {
                    place += match other {
                        'n' => 4,
                        'N' => 16,
                        'Z' | 'a' => 64,
                        'g' => 2,
                        _ => {
                            return Err(Broken::new(
                                offset,
                                format_args!("a field of type `{other}` in {name}"),
                                "a field type that the DataFlash format defines",
                            ));
                        }
                    };
                    continue;
                }
            };
            if label == INSTANCE && kind == Kind::U8 {
                format.instance = Some(place);
            }
            format.columns.push(Column::new(label, unit(label)));
            format.places.push((place, kind, factor));
            place += kind.size();
        }
        if place as u64 != length {
            return Err(Broken::new(
                offset,
                format_args!("{name} of {length} bytes"),
                format_args!("{place} bytes for its fields `{types}`"),
            ));
        }
        Ok(format)
    }

    /// Whether the message may belong to an instrument.
    fn is_inertial(&self) -> bool {
        let stem = self.name.trim_end_matches(|c: char| c.is_ascii_digit());
        ["IMU", "ACC", "GYR"].contains(&stem)
    }

    /// Corrections.
    fn undo(&self) -> Undo {
        let corrected = PerSensor::from_fn(|sensor| {
            let names = sensor.pick(["GyrX", "GyrY", "GyrZ"], ["AccX", "AccY", "AccZ"]);
            Corrected::rates(&self.columns, names).filter(|_| self.is_inertial())
        });
        Undo::new("ArduPilot", corrected)
    }
}

fn unit(label: &str) -> &'static str {
    match label {
        _ if label.ends_with("US") => "us",
        _ if label.starts_with("Gyr") => "rad/s",
        _ if label.starts_with("Acc") => "m/s^2",
        _ => "",
    }
}

impl Log for DataFlash {
    fn streams(&self) -> &[Stream] {
        &self.streams
    }

    fn advance(&mut self) -> Result<Option<usize>, Broken> {
        loop {
            self.offset = self.input.offset();
            if self.input.left() == 0 {
                return Ok(None);
            }
            self.input.take(3, &mut self.message, "a message header")?;
            let Some(&[first, second, kind]) = self.message.first_chunk() else {
                return Ok(None);
            };
            if [first, second] != BEGIN {
                return Err(Broken::new(
                    self.offset,
                    format_args!("the bytes {first:02x} {second:02x}"),
                    "the bytes a3 95 that start a message",
                ));
            }
            let Some(format) = self.formats.get(&kind) else {
                return Err(Broken::new(
                    self.offset,
                    format_args!("a message of type {kind}"),
                    "a type defined by an earlier FMT message",
                ));
            };
            self.input.go_to(self.offset)?;
            self.input
                .take(format.length, &mut self.message, "a message")?;
            if kind == FMT {
                self.format()?;
                continue;
            }
            if format.name == "PARM" {
                self.parameter()?;
                continue;
            }
            let stream = self.stream(kind);
            self.current = (kind, stream);
            return Ok(Some(stream));
        }
    }

    fn values(&mut self, row: &mut Vec<f64>) -> Result<(), Broken> {
        row.clear();
        let (kind, stream) = self.current;
        let Some(format) = self.formats.get(&kind) else {
            return Ok(());
        };
        for &(place, kind, factor) in &format.places {
            let bytes = self.message.get(place..).unwrap_or_default();
            row.push(kind.number(bytes, false).unwrap_or(f64::NAN) * factor);
        }
        let (undo, instance) = &mut self.undo[stream];
        let (parameters, instance) = (&self.parameters, *instance);
        let is_news = undo.undo(row, self.changes, |sensor, _| {
            applied(parameters, sensor, instance)
        });
        if is_news {
            self.streams[stream].remarks = undo.remarks();
        }
        Ok(())
    }

    fn offset(&self) -> u64 {
        self.offset
    }
}

impl DataFlash {
    fn format(&mut self) -> Result<(), Broken> {
        let mut content = Slice::new(&self.message, self.offset);
        content.take(3, "a message header")?;
        let kind = content.whole(1, "a type")? as u8;
        let length = content.whole(1, "a length")?;
        let name = content.text(4, "a name")?;
        let types = content.text(16, "field types")?;
        let labels = content.text(64, "field names")?;
        if kind != FMT {
            let format = Format::of(self.offset, &name, length, &types, &labels)?;
            self.formats.insert(kind, format);
        }
        Ok(())
    }

    fn parameter(&mut self) -> Result<(), Broken> {
        // TimeUS, Name, Value; older logs have no time.
        let length = self.message.len();
        let name_at = if length < 3 + 8 + 16 + 4 { 3 } else { 11 };
        let mut content = Slice::new(&self.message, self.offset);
        content.take(name_at, "a time")?;
        let name = content.text(16, "a parameter name")?;
        let value = Kind::F32.number(content.take(4, "a parameter value")?, false);
        self.parameters.insert(name, value.unwrap_or(f64::NAN));
        self.changes += 1;
        Ok(())
    }

    /// The stream of the message.
    fn stream(&mut self, kind: u8) -> usize {
        let format = &self.formats[&kind];
        let instance = format
            .instance
            .and_then(|place| self.message.get(place))
            .copied();
        let key = (kind, instance.unwrap_or(0));
        if let Some(&stream) = self.of_streams.get(&key) {
            return stream;
        }
        let stem = format.name.trim_end_matches(|c: char| c.is_ascii_digit());
        // In older logs without an instance column, the second instance has another name.
        let number = format.name[stem.len()..]
            .parse()
            .unwrap_or(1u8)
            .saturating_sub(1);
        let stream = self.streams.len();
        self.undo.push((format.undo(), instance.unwrap_or(number)));
        self.streams.push(Stream {
            name: match instance {
                Some(instance) => format!("{}[{instance}]", format.name),
                None => format.name.clone(),
            },
            columns: format.columns.clone(),
            remarks: Vec::new(),
            is_inertial: format.is_inertial(),
            // A log with such parameters is from an autopilot, with axes front, right, down.
            axes: (!self.parameters.is_empty()).then_some("frd"),
        });
        self.of_streams.insert(key, stream);
        stream
    }
}

/// Corrections from the ArduPilot parameters of an instance, from 0.
fn applied(parameters: &BTreeMap<String, f64>, sensor: Sensor, instance: u8) -> Option<Applied> {
    let kind = sensor.pick("GYR", "ACC");
    // A damaged log may have an instance 255.
    let number = u16::from(instance) + 1;
    let stem = match (number, sensor) {
        (1, Sensor::Gyro) => "INS_GYR".to_owned(),
        (1, Sensor::Accel) => "INS_ACC".to_owned(),
        (2 | 3, _) => format!("INS_{kind}{number}"),
        _ => format!("INS{number}_{kind}"),
    };
    let axes = |what: &str| {
        let of = |axis: &str| parameters.get(&format!("{stem}{what}_{axis}")).copied();
        match ["X", "Y", "Z"].map(of) {
            [Some(x), Some(y), Some(z)] => Some([x, y, z]),
            _ => None,
        }
    };
    let offset = axes("OFFS")?;
    let scale = sensor.pick(None, axes("SCAL"));
    let is_on = |name: &str| parameters.get(name).is_some_and(|&value| value != 0.0);
    Some(Applied {
        name: sensor.pick(format!("{stem}OFFS"), format!("{stem}OFFS and {stem}SCAL")),
        offset,
        // Zero means that the scale was never calibrated.
        scale: scale
            .filter(|scale| scale.iter().all(|&s| s != 0.0))
            .unwrap_or([1.0; 3]),
        is_more: is_on("AHRS_ORIENTATION") || is_on(&format!("INS_TCAL{number}_ENABLE")),
    })
}
