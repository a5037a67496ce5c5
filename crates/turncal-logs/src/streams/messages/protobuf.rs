//! Protocol Buffers messages with descriptors: each number becomes a column named by its path.
//!
//! Source: protobuf.dev, "Encoding"; `google/protobuf/descriptor.proto`, whose messages are encoded like all others.

use crate::streams::Column;
use crate::streams::bytes::{Broken, Slice};

/// Maximum nesting depth of messages.
const DEEPEST: usize = 8;
/// Maximum number of fields that are examined: a type may contain itself several times.
const MOST_FIELDS: usize = 2048;
/// Maximum length of a set of descriptors, bytes; usually a few thousand.
const LONGEST: usize = 1 << 19;

/// Label of lists and maps in `FieldDescriptorProto`.
const REPEATED: u64 = 3;
/// Types of fields: strings, groups and bytes, then messages.
const NO_NUMBERS: [u64; 3] = [9, 10, 12];
const MESSAGE: u64 = 11;

/// A type of messages.
pub struct Message {
    fields: Vec<Field>,
    pub columns: Vec<Column>,
}

/// A field that leads to columns.
struct Field {
    number: u64,
    kind: Kind,
    /// The column of a number or time.
    column: usize,
}

enum Kind {
    /// Type, and the value of a field omitted from a message.
    Number(u64, f64),
    /// A time of seconds and nanoseconds.
    Time(Vec<Field>),
    Message(Vec<Field>),
}

impl Message {
    /// The descriptor of a type from a set of descriptors; `None` if a type is missing or malformed.
    pub fn parse(name: &str, set: &[u8]) -> Option<Self> {
        let mut parser = Parser {
            set: Some(set).filter(|set| set.len() <= LONGEST)?,
            columns: Vec::new(),
            count: 0,
        };
        let fields = parser.fields(name, "", 0)?;
        let columns = parser.columns;
        Some(Self { fields, columns })
    }

    /// The numbers of a message; NaN for missing submessages.
    pub fn values(&self, bytes: &[u8], offset: u64, row: &mut Vec<f64>) -> Result<(), Broken> {
        let begin = row.len();
        row.resize(begin + self.columns.len(), f64::NAN);
        fill(&self.fields, bytes, offset, &mut row[begin..])
    }
}

/// Enters the numbers of a message in their columns.
fn fill(fields: &[Field], bytes: &[u8], offset: u64, row: &mut [f64]) -> Result<(), Broken> {
    for field in fields {
        if let Kind::Number(_, default) = field.kind
            && row[field.column].is_nan()
        {
            row[field.column] = default;
        }
    }
    for value in Values(Slice::packed(bytes, offset)) {
        let value = value?;
        let place = fields.binary_search_by_key(&value.field, |field| field.number);
        let Some(field) = place.ok().and_then(|place| fields.get(place)) else {
            continue;
        };
        match &field.kind {
            Kind::Number(kind, _) => row[field.column] = value.number(*kind, offset)?,
            Kind::Time(parts) => {
                let mut time = [f64::NAN; 2];
                fill(parts, value.bytes(offset)?, offset, &mut time)?;
                row[field.column] = time[0] + 1e-9 * time[1];
            }
            Kind::Message(inner) => fill(inner, value.bytes(offset)?, offset, row)?,
        }
    }
    Ok(())
}

/// Descriptors while a type is built.
struct Parser<'a> {
    set: &'a [u8],
    columns: Vec<Column>,
    /// Number of fields so far.
    count: usize,
}

impl<'a> Parser<'a> {
    /// The fields of a type in the order of their numbers; lists, texts and bytes do not become columns.
    fn fields(&mut self, name: &str, prefix: &str, depth: usize) -> Option<Vec<Field>> {
        let mut declared = parts(self.find(name)?, 2)?;
        self.count += declared.len();
        declared.sort_by_key(|field| whole(field, 3));
        let mut fields = Vec::new();
        for field in declared {
            let (number, label, kind) = (whole(field, 3)?, whole(field, 4)?, whole(field, 5)?);
            if label == REPEATED || NO_NUMBERS.contains(&kind) {
                continue;
            }
            if self.count > MOST_FIELDS || depth > DEEPEST {
                break;
            }
            let name = format!("{prefix}{}", text(field, 1)?);
            let column = self.columns.len();
            let kind = match (kind, text(field, 6)?.trim_start_matches('.')) {
                (MESSAGE, "google.protobuf.Timestamp" | "google.protobuf.Duration") => {
                    self.columns.push(Column::new(name, "s"));
                    let part = |number: u64, kind: u64| Field {
                        number,
                        kind: Kind::Number(kind, 0.0),
                        column: number as usize - 1,
                    };
                    Kind::Time(vec![part(1, 3), part(2, 5)])
                }
                (MESSAGE, of) => Kind::Message(self.fields(of, &format!("{name}."), depth + 1)?),
                (kind, _) => {
                    self.columns.push(Column::new(name, ""));
                    Kind::Number(kind, text(field, 7)?.parse().unwrap_or_default())
                }
            };
            fields.push(Field {
                number,
                kind,
                column,
            });
        }
        Some(fields)
    }

    /// The descriptor of a type, from its full name.
    fn find(&self, name: &str) -> Option<&'a [u8]> {
        for file in parts(self.set, 1)? {
            let package = text(file, 2)?;
            let own = match package {
                "" => Some(name),
                _ => name
                    .strip_prefix(package)
                    .and_then(|own| own.strip_prefix('.')),
            };
            // Types of a file are in its field 4, types within types in field 3.
            let within = |(of, number): (&'a [u8], u64), word: &str| {
                let mut types = parts(of, number)?.into_iter();
                Some((types.find(|of| text(of, 1) == Some(word))?, 3))
            };
            let found = own.and_then(|own| own.split('.').try_fold((file, 4), within));
            if let Some((found, _)) = found {
                return Some(found);
            }
        }
        None
    }
}

/// The messages and strings in a field.
fn parts(bytes: &[u8], field: u64) -> Option<Vec<&[u8]>> {
    let mut all = values(bytes)?;
    all.retain(|value| value.field == field && value.way == 2);
    Some(all.into_iter().map(|value| value.bytes).collect())
}

/// The text in a field; empty if it is omitted.
fn text(bytes: &[u8], field: u64) -> Option<&str> {
    let last = parts(bytes, field)?.pop().unwrap_or_default();
    std::str::from_utf8(last).ok()
}

/// The whole number in a field; zero if it is omitted.
fn whole(bytes: &[u8], field: u64) -> Option<u64> {
    let all = values(bytes)?;
    let last = all.iter().rfind(|value| value.field == field);
    Some(last.map_or(0, |value| value.bits))
}

/// A value of a message.
struct Value<'a> {
    field: u64,
    /// Storage of the field: a number of variable length, eight bytes (1), bytes after their length, or four bytes (5).
    way: u64,
    bits: u64,
    bytes: &'a [u8],
}

impl<'a> Value<'a> {
    /// The number in a field of this type.
    fn number(&self, kind: u64, offset: u64) -> Result<f64, Broken> {
        let bits = self.bits;
        Ok(match (kind, self.way) {
            (1, 1) => f64::from_bits(bits),
            (2, 5) => f64::from(f32::from_bits(bits as u32)),
            (3, 0) | (16, 1) => bits as i64 as f64,
            (4, 0) | (6, 1) | (7, 5) => bits as f64,
            (5 | 14, 0) | (15, 5) => f64::from(bits as i32),
            (8, 0) => f64::from(u8::from(bits != 0)),
            (13, 0) => f64::from(bits as u32),
            (17, 0) => f64::from(signed(bits & 0xffff_ffff) as i32),
            (18, 0) => signed(bits) as f64,
            _ => return Err(self.wrong(offset)),
        })
    }

    fn bytes(&self, offset: u64) -> Result<&'a [u8], Broken> {
        let bytes = (self.way == 2).then_some(self.bytes);
        bytes.ok_or_else(|| self.wrong(offset))
    }

    fn wrong(&self, offset: u64) -> Broken {
        let (field, way) = (self.field, self.way);
        let found = format_args!("field {field} with wire type {way}");
        Broken::new(offset, found, "the wire type of its descriptor")
    }
}

/// Whole number with its sign in the last bit.
fn signed(value: u64) -> i64 {
    (value >> 1) as i64 ^ -((value & 1) as i64)
}

/// The values of a message in order, one at a time because they may not fit into memory.
struct Values<'a>(Slice<'a>);

/// All values of a descriptor.
fn values(bytes: &[u8]) -> Option<Vec<Value<'_>>> {
    Values(Slice::packed(bytes, 0))
        .collect::<Result<_, _>>()
        .ok()
}

impl<'a> Iterator for Values<'a> {
    type Item = Result<Value<'a>, Broken>;

    fn next(&mut self) -> Option<Self::Item> {
        (self.0.left() > 0).then(|| value(&mut self.0))
    }
}

fn value<'a>(bytes: &mut Slice<'a>) -> Result<Value<'a>, Broken> {
    let key = varint(bytes)?;
    let mut value = Value {
        field: key >> 3,
        way: key & 7,
        bits: 0,
        bytes: &[],
    };
    match value.way {
        0 => value.bits = varint(bytes)?,
        1 => value.bits = bytes.whole(8, "a number")?,
        5 => value.bits = bytes.whole(4, "a number")?,
        2 => {
            let length = usize::try_from(varint(bytes)?).unwrap_or(usize::MAX);
            value.bytes = bytes.take(length, "a field of a message")?;
        }
        way => {
            let found = format_args!("a field with wire type {way}");
            return Err(Broken::new(bytes.offset(), found, "wire type 0, 1, 2 or 5"));
        }
    }
    Ok(value)
}

/// A number of variable length: seven bits per byte, least significant first.
fn varint(bytes: &mut Slice) -> Result<u64, Broken> {
    let mut value = 0;
    for shift in (0..u64::BITS).step_by(7) {
        let next = bytes.whole(1, "a number")?;
        value |= (next & 0x7f) << shift;
        if next < 0x80 {
            return Ok(value);
        }
    }
    let offset = bytes.offset();
    Err(Broken::new(
        offset,
        "a number without end",
        "at most ten bytes",
    ))
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// A field with a length of two bytes.
    fn field(number: u8, content: &[u8]) -> Vec<u8> {
        let length = [content.len() as u8 | 0x80, (content.len() >> 7) as u8];
        [&[number << 3 | 2], &length[..], content].concat()
    }

    fn declared(name: &str, number: u8, kind: u8, type_name: &str) -> Vec<u8> {
        let numbers = [3 << 3, number, 4 << 3, 1, 5 << 3, kind];
        let texts = [field(1, name.as_bytes()), field(6, type_name.as_bytes())];
        field(2, &[&numbers[..], &texts.concat()].concat())
    }

    /// A file of the type `T` with these fields and a type within it.
    fn set(fields: &[Vec<u8>]) -> Vec<u8> {
        let inner = [field(1, b"In"), declared("u", 3, 13, "")].concat();
        let of_type = [field(1, b"T"), fields.concat(), field(3, &inner)].concat();
        field(1, &[field(2, b"lab"), field(4, &of_type)].concat())
    }

    fn names(message: &Message) -> Vec<&str> {
        message.columns.iter().map(|of| &*of.name).collect()
    }

    #[test]
    fn numbers_of_all_types_are_read_and_omitted_ones_are_zero_in_a_message_that_is_there() {
        let fields = [
            declared("far", 9, 11, ".lab.T.In"),
            declared("z", 1, 17, ""),
            declared("i", 2, 5, ""),
            declared("f", 3, 2, ""),
            declared("d", 4, 1, ""),
            declared("s", 5, 9, ""),
            declared("near", 6, 11, ".lab.T.In"),
            declared("h", 7, 15, ""),
            declared("b", 8, 8, ""),
        ];
        let message = Message::parse("lab.T", &set(&fields)).unwrap();
        assert_eq!(
            names(&message),
            ["z", "i", "f", "d", "near.u", "h", "b", "far.u"]
        );
        let mut bytes = vec![1 << 3, 3, 2 << 3];
        // −1 takes ten bytes.
        bytes.extend([0xff; 9]);
        bytes.extend([1, 3 << 3 | 5]);
        bytes.extend(0.5f32.to_le_bytes());
        bytes.extend(field(5, b"text"));
        bytes.extend(field(6, &[]));
        bytes.push(7 << 3 | 5);
        bytes.extend((-7i32).to_le_bytes());
        // A field of a later version.
        bytes.extend(field(15, b"new"));
        let mut row = vec![1.0];
        message.values(&bytes, 0, &mut row).unwrap();
        assert_eq!(row[..8], [1.0, -2.0, -1.0, 0.5, 0.0, 0.0, -7.0, 0.0]);
        assert!(row[8].is_nan() && row.len() == 9);
        let broken = message.values(&[1 << 3 | 5, 0, 0, 0, 0], 40, &mut row);
        assert_eq!(broken.unwrap_err().found, "field 1 with wire type 5");
    }

    #[test]
    fn a_type_that_contains_itself_many_times_ends() {
        let fields: Vec<_> = (1..10).map(|k| declared("own", k, 11, ".lab.T")).collect();
        let message = Message::parse("lab.T", &set(&fields)).unwrap();
        assert!(message.columns.is_empty());
        let deep = Message::parse(
            "lab.T",
            &set(&[declared("n", 1, 11, ".lab.T"), declared("v", 2, 1, "")]),
        );
        assert_eq!(deep.unwrap().columns.len(), DEEPEST + 1);
        assert!(Message::parse("lab.U", &set(&fields)).is_none());
    }

    #[test]
    fn damaged_descriptors_and_messages_end() {
        let fields = [
            declared("n", 1, 11, ".lab.T"),
            declared("v", 2, 1, ""),
            declared("w", 3, 17, ""),
        ];
        let (good, mut rng) = (set(&fields), ChaCha8Rng::seed_from_u64(1));
        let mut message = vec![2 << 3 | 1];
        message.extend(1.5f64.to_le_bytes());
        let message = [field(1, &message), message.clone(), vec![3 << 3, 5]].concat();
        let spoilt = |bytes: &[u8], rng: &mut ChaCha8Rng| {
            let mut bytes = bytes.to_vec();
            for _ in 0..rng.random_range(1..4) {
                let place = rng.random_range(0..bytes.len());
                bytes[place] = rng.random();
            }
            if rng.random_range(0..8) == 0 {
                bytes.truncate(rng.random_range(1..=bytes.len()));
            }
            bytes
        };
        let mut read = 0;
        for _ in 0..20_000 {
            if let Some(parsed) = Message::parse("lab.T", &spoilt(&good, &mut rng)) {
                let mut row = Vec::new();
                read += usize::from(
                    parsed
                        .values(&spoilt(&message, &mut rng), 0, &mut row)
                        .is_ok(),
                );
                assert_eq!(row.len(), parsed.columns.len());
            }
        }
        assert!(read > 100, "{read}");
    }
}
