//! Messages of Protocol Buffers by their descriptors.
//!
//! Source: protobuf.dev, "Encoding", and `google/protobuf/descriptor.proto`.

use std::collections::BTreeMap;

use super::Column;
use super::bytes::{Broken, Kind};

/// Messages within messages.
const DEEPEST: usize = 8;
const MOST_COLUMNS: usize = 4096;

/// A type of messages.
pub(super) struct Message {
    root: Node,
    pub columns: Vec<Column>,
}

/// The fields of a message that are columns, by their numbers.
#[derive(Default)]
struct Node(BTreeMap<u64, Field>);

enum Field {
    Number {
        of: Scalar,
        column: usize,
    },
    Message(Node),
    /// `google.protobuf.Timestamp` and `Duration`.
    Time {
        column: usize,
    },
}

#[derive(Clone, Copy)]
enum Scalar {
    F64,
    F32,
    Fixed(Kind),
    /// A whole number with or without sign.
    Unsigned,
    Signed,
    /// With the sign in its last bit.
    Zigzag,
}

/// A field on the wire.
struct Wire<'a> {
    number: u64,
    value: u64,
    /// Of a field that has a length, and of fixed ones.
    bytes: &'a [u8],
}

struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn varint(&mut self) -> Option<u64> {
        let mut value = 0u64;
        for shift in 0..10 {
            let (&byte, rest) = self.0.split_first()?;
            self.0 = rest;
            value |= u64::from(byte & 0x7f).checked_shl(7 * shift)?;
            if byte < 0x80 {
                return Some(value);
            }
        }
        None
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (bytes, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(bytes)
    }

    /// The next field; none at the end, an error in what is no field.
    fn next(&mut self) -> Option<Result<Wire<'a>, ()>> {
        (!self.0.is_empty()).then(|| self.field().ok_or(()))
    }

    fn field(&mut self) -> Option<Wire<'a>> {
        let tag = self.varint()?;
        let (mut value, mut bytes): (u64, &[u8]) = (0, &[]);
        match tag & 7 {
            0 => value = self.varint()?,
            1 => bytes = self.take(8)?,
            2 => {
                let length = usize::try_from(self.varint()?).ok()?;
                bytes = self.take(length)?;
            }
            5 => bytes = self.take(4)?,
            _ => return None,
        }
        Some(Wire {
            number: tag >> 3,
            value,
            bytes,
        })
    }
}

/// A type as its descriptor has it.
#[derive(Default)]
struct Descriptor<'a> {
    fields: Vec<Described<'a>>,
}

#[derive(Default)]
struct Described<'a> {
    name: &'a str,
    number: u64,
    label: u64,
    kind: u64,
    type_name: &'a str,
}

impl Message {
    /// By a set of descriptors; none if they lack a type.
    pub fn parse(name: &str, set: &[u8]) -> Option<Self> {
        let mut types = BTreeMap::new();
        let mut files = Fields(set);
        while let Some(file) = files.next() {
            let file = file.ok()?;
            if file.number == 1 {
                let mut package = "";
                let mut fields = Fields(file.bytes);
                while let Some(field) = fields.next() {
                    let field = field.ok()?;
                    if field.number == 2 {
                        package = std::str::from_utf8(field.bytes).ok()?;
                    }
                }
                let prefix = if package.is_empty() {
                    String::new()
                } else {
                    format!(".{package}")
                };
                let mut fields = Fields(file.bytes);
                while let Some(field) = fields.next() {
                    let field = field.ok()?;
                    if field.number == 4 {
                        describe(field.bytes, &prefix, 0, &mut types)?;
                    }
                }
            }
        }
        let mut columns = Vec::new();
        let root = node(&types, &format!(".{name}"), "", 0, &mut columns)?;
        Some(Self { root, columns })
    }

    /// The numbers of a message; NaN in messages that it lacks.
    pub fn values(&self, bytes: &[u8], offset: u64, row: &mut Vec<f64>) -> Result<(), Broken> {
        let begin = row.len();
        row.resize(begin + self.columns.len(), f64::NAN);
        read(&self.root, bytes, &mut row[begin..]).ok_or_else(|| {
            Broken::new(
                offset,
                "a message that ends within a field",
                "one of Protocol Buffers",
            )
        })
    }
}

fn describe<'a>(
    bytes: &'a [u8],
    prefix: &str,
    depth: usize,
    types: &mut BTreeMap<String, Descriptor<'a>>,
) -> Option<()> {
    let mut descriptor = Descriptor::default();
    let (mut name, mut nested) = ("", Vec::new());
    let mut fields = Fields(bytes);
    while let Some(field) = fields.next() {
        let field = field.ok()?;
        match field.number {
            1 => name = std::str::from_utf8(field.bytes).ok()?,
            2 => {
                let mut described = Described::default();
                let mut inner = Fields(field.bytes);
                while let Some(entry) = inner.next() {
                    let entry = entry.ok()?;
                    match entry.number {
                        1 => described.name = std::str::from_utf8(entry.bytes).ok()?,
                        3 => described.number = entry.value,
                        4 => described.label = entry.value,
                        5 => described.kind = entry.value,
                        6 => described.type_name = std::str::from_utf8(entry.bytes).ok()?,
                        _ => {}
                    }
                }
                descriptor.fields.push(described);
            }
            3 => nested.push(field.bytes),
            _ => {}
        }
    }
    let full = format!("{prefix}.{name}");
    if depth < DEEPEST {
        for inner in nested {
            describe(inner, &full, depth + 1, types)?;
        }
    }
    types.insert(full, descriptor);
    Some(())
}

fn node(
    types: &BTreeMap<String, Descriptor>,
    name: &str,
    prefix: &str,
    depth: usize,
    columns: &mut Vec<Column>,
) -> Option<Node> {
    let mut node = Node::default();
    // A type may hold itself.
    if depth > DEEPEST {
        return Some(node);
    }
    const REPEATED: u64 = 3;
    for field in &types.get(name)?.fields {
        if field.label == REPEATED || columns.len() >= MOST_COLUMNS {
            continue;
        }
        let path = format!("{prefix}{}", field.name);
        let scalar = match field.kind {
            1 => Some(Scalar::F64),
            2 => Some(Scalar::F32),
            3 | 5 | 14 => Some(Scalar::Signed),
            4 | 8 | 13 => Some(Scalar::Unsigned),
            6 => Some(Scalar::Fixed(Kind::U64)),
            7 => Some(Scalar::Fixed(Kind::U32)),
            15 => Some(Scalar::Fixed(Kind::I32)),
            16 => Some(Scalar::Fixed(Kind::I64)),
            17 | 18 => Some(Scalar::Zigzag),
            _ => None,
        };
        const MESSAGE: u64 = 11;
        let of = match (scalar, field.type_name) {
            (Some(of), _) => {
                columns.push(Column::new(path, ""));
                Field::Number {
                    of,
                    column: columns.len() - 1,
                }
            }
            (None, ".google.protobuf.Timestamp" | ".google.protobuf.Duration") => {
                columns.push(Column::new(path, "s"));
                Field::Time {
                    column: columns.len() - 1,
                }
            }
            (None, inner) if field.kind == MESSAGE => {
                let inner = node_of(types, inner, &format!("{path}."), depth, columns);
                Field::Message(inner?)
            }
            _ => continue,
        };
        node.0.insert(field.number, of);
    }
    Some(node)
}

fn node_of(
    types: &BTreeMap<String, Descriptor>,
    name: &str,
    prefix: &str,
    depth: usize,
    columns: &mut Vec<Column>,
) -> Option<Node> {
    node(types, name, prefix, depth + 1, columns)
}

fn read(node: &Node, bytes: &[u8], row: &mut [f64]) -> Option<()> {
    // What is zero is left out on the wire.
    for field in node.0.values() {
        if let Field::Number { column, .. } = field {
            row[*column] = 0.0;
        }
    }
    let mut fields = Fields(bytes);
    while let Some(field) = fields.next() {
        let wire = field.ok()?;
        match node.0.get(&wire.number) {
            Some(Field::Number { of, column }) => row[*column] = of.number(&wire)?,
            Some(Field::Message(inner)) => read(inner, wire.bytes, row)?,
            Some(Field::Time { column }) => {
                let (mut seconds, mut nanoseconds) = (0.0, 0.0);
                let mut parts = Fields(wire.bytes);
                while let Some(part) = parts.next() {
                    let part = part.ok()?;
                    match part.number {
                        1 => seconds = part.value as i64 as f64,
                        2 => nanoseconds = part.value as i64 as f64,
                        _ => {}
                    }
                }
                row[*column] = seconds + 1e-9 * nanoseconds;
            }
            None => {}
        }
    }
    Some(())
}

impl Scalar {
    fn number(self, wire: &Wire) -> Option<f64> {
        match self {
            Self::F64 => Kind::F64.number(wire.bytes, false),
            Self::F32 => Kind::F32.number(wire.bytes, false),
            Self::Fixed(kind) => kind.number(wire.bytes, false),
            Self::Unsigned => Some(wire.value as f64),
            Self::Signed => Some(wire.value as i64 as f64),
            Self::Zigzag => Some(((wire.value >> 1) as i64 ^ -((wire.value & 1) as i64)) as f64),
        }
    }
}
