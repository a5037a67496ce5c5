//! Protocol Buffers messages with descriptors: each number becomes a column named by its path.

use prost_reflect::{
    DescriptorPool, DynamicMessage, FieldDescriptor, Kind, MessageDescriptor, ReflectMessage, Value,
};

use crate::formats::streams::Column;
use crate::formats::streams::bytes::Broken;

/// Messages within messages.
const DEEPEST: usize = 8;
const MOST_COLUMNS: usize = 4096;

/// A type of messages.
pub struct Message {
    descriptor: MessageDescriptor,
    pub columns: Vec<Column>,
    /// The fields that lead to each column.
    paths: Vec<Vec<FieldDescriptor>>,
}

impl Message {
    /// From a set of descriptors; `None` if a type is missing.
    pub fn parse(name: &str, set: &[u8]) -> Option<Self> {
        let descriptor = DescriptorPool::decode(set)
            .ok()?
            .get_message_by_name(name)?;
        let mut message = Self {
            descriptor: descriptor.clone(),
            columns: Vec::new(),
            paths: Vec::new(),
        };
        message.add(&descriptor, "", &[]);
        Some(message)
    }

    /// Adds the numbers of a type; lists, texts and bytes do not become columns, and a type may contain itself.
    fn add(&mut self, of: &MessageDescriptor, prefix: &str, path: &[FieldDescriptor]) {
        for field in of
            .fields()
            .filter(|field| !field.is_list() && !field.is_map())
        {
            if self.columns.len() >= MOST_COLUMNS || path.len() > DEEPEST {
                return;
            }
            let name = format!("{prefix}{}", field.name());
            let path = [path, std::slice::from_ref(&field)].concat();
            let unit = match field.kind() {
                Kind::String | Kind::Bytes => continue,
                Kind::Message(inner) if is_time(&inner) => "s",
                Kind::Message(inner) => {
                    self.add(&inner, &format!("{name}."), &path);
                    continue;
                }
                _ => "",
            };
            self.columns.push(Column::new(name, unit));
            self.paths.push(path);
        }
    }

    /// The numbers of a message; NaN for missing submessages.
    pub fn values(&self, bytes: &[u8], offset: u64, row: &mut Vec<f64>) -> Result<(), Broken> {
        let message = DynamicMessage::decode(self.descriptor.clone(), bytes)
            .map_err(|error| Broken::new(offset, error, "a Protocol Buffers message"))?;
        let values = self.paths.iter().map(|path| number(&message, path));
        row.extend(values.map(|value| value.unwrap_or(f64::NAN)));
        Ok(())
    }
}

fn is_time(of: &MessageDescriptor) -> bool {
    matches!(
        of.full_name(),
        "google.protobuf.Timestamp" | "google.protobuf.Duration"
    )
}

/// The number at the end of a path.
fn number(message: &DynamicMessage, path: &[FieldDescriptor]) -> Option<f64> {
    let (first, rest) = path.split_first()?;
    Some(match &*message.get_field(first) {
        Value::Message(_) if !message.has_field(first) => return None,
        Value::Message(time) if is_time(&time.descriptor()) => {
            let part = |number| time.get_field_by_number(number);
            let seconds = part(1)?.as_i64()? as f64;
            seconds + 1e-9 * f64::from(part(2)?.as_i32()?)
        }
        Value::Message(inner) => return number(inner, rest),
        Value::Bool(flag) => f64::from(u8::from(*flag)),
        Value::I32(value) | Value::EnumNumber(value) => f64::from(*value),
        Value::I64(value) => *value as f64,
        Value::U32(value) => f64::from(*value),
        Value::U64(value) => *value as f64,
        Value::F32(value) => f64::from(*value),
        Value::F64(value) => *value,
        _ => return None,
    })
}
