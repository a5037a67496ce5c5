//! Messages of ROS by their definitions: ROS 1's serialisation, and CDR as ROS 2 has it.
//!
//! Numbers get a column each, named by their path: `angular_velocity.x`, `orientation_covariance[0]`; a time of
//! seconds and nanoseconds is one column in s. Texts and lists of any length are passed over.
//!
//! Source: wiki.ros.org/msg and wiki.ros.org/ROS/Technical Overview; ROS 2 design, "Interface definition"; OMG CDR
//! (CORBA 3.3, 9.3) with the encapsulation of RTPS 2.3, 10.

use super::Column;
use super::bytes::{Broken, Kind};

/// Types within types.
const DEEPEST: usize = 16;
/// Longer arrays of numbers are no columns.
const LONGEST: usize = 64;
/// A message of more fields is none of an instrument.
const MOST_FIELDS: usize = 4096;

/// How numbers follow one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ros1,
    Cdr,
}

/// A type of messages.
pub(super) struct Message {
    fields: Vec<Field>,
    pub columns: Vec<Column>,
    encoding: Encoding,
}

struct Field {
    kind: FieldKind,
    many: Many,
}

enum FieldKind {
    Number(Kind),
    Text,
    /// Seconds and nanoseconds.
    Time(Kind),
    Message(Vec<Field>),
}

#[derive(Clone, Copy, PartialEq)]
enum Many {
    One,
    /// So many.
    Fixed(usize),
    /// As many as the message says.
    Any,
}

impl Message {
    /// By the text of its definition, behind which are those of the types that it needs; what is wrong with it if
    /// it cannot be read.
    pub fn parse(name: &str, definition: &str, encoding: Encoding) -> Result<Self, String> {
        let mut definitions = vec![(name.replace("/msg/", "/"), String::new())];
        for line in definition.lines() {
            if line.starts_with("====") {
                definitions.push(Default::default());
            } else if let Some(name) = line.strip_prefix("MSG:") {
                if let Some(last) = definitions.last_mut() {
                    last.0 = name.trim().replace("/msg/", "/");
                }
            } else if let Some((_, text)) = definitions.last_mut() {
                text.push_str(line);
                text.push('\n');
            }
        }
        let mut message = Self {
            fields: Vec::new(),
            columns: Vec::new(),
            encoding,
        };
        let mut count = 0;
        message.fields = message.of_type(&definitions, 0, "", true, 0, &mut count)?;
        Ok(message)
    }

    fn of_type(
        &mut self,
        all: &[(String, String)],
        place: usize,
        prefix: &str,
        is_column: bool,
        depth: usize,
        count: &mut usize,
    ) -> Result<Vec<Field>, String> {
        let (own, text) = &all[place];
        let package = own.split('/').next().unwrap_or_default();
        let mut fields = Vec::new();
        for line in text.lines() {
            let line = line.split('#').next().unwrap_or_default().trim();
            let mut words = line.split_whitespace();
            let (Some(kind), Some(name)) = (words.next(), words.next()) else {
                continue;
            };
            let constant =
                name.contains('=') || words.next().is_some_and(|next| next.starts_with('='));
            if constant {
                continue;
            }
            *count += 1;
            if *count > MOST_FIELDS || depth > DEEPEST {
                return Err(format!("more than {MOST_FIELDS} fields in `{own}`"));
            }
            let (kind, many) = match kind.split_once('[') {
                None => (kind, Many::One),
                Some((kind, size)) => match size.trim_end_matches(']') {
                    "" => (kind, Many::Any),
                    bounded if bounded.starts_with("<=") => (kind, Many::Any),
                    fixed => {
                        let size = fixed.parse().map_err(|_| format!("the field `{line}`"))?;
                        (kind, Many::Fixed(size))
                    }
                },
            };
            let path = format!("{prefix}{name}");
            let (repeat, is_column) = match many {
                Many::One => (None, is_column),
                Many::Fixed(size) => (Some(size), is_column && size <= LONGEST),
                Many::Any => (Some(0), false),
            };
            let field = self.field(all, package, kind, &path, repeat, is_column, depth, count)?;
            fields.push(Field { kind: field, many });
        }
        Ok(fields)
    }

    #[allow(clippy::too_many_arguments)]
    fn field(
        &mut self,
        all: &[(String, String)],
        package: &str,
        kind: &str,
        path: &str,
        repeat: Option<usize>,
        is_column: bool,
        depth: usize,
        count: &mut usize,
    ) -> Result<FieldKind, String> {
        let number = match kind {
            "bool" | "byte" | "char" | "uint8" => Some(Kind::U8),
            "int8" => Some(Kind::I8),
            "int16" => Some(Kind::I16),
            "uint16" => Some(Kind::U16),
            "int32" => Some(Kind::I32),
            "uint32" => Some(Kind::U32),
            "int64" => Some(Kind::I64),
            "uint64" => Some(Kind::U64),
            "float32" => Some(Kind::F32),
            "float64" => Some(Kind::F64),
            _ => None,
        };
        let mut add = |unit| {
            if !is_column {
                return;
            }
            match repeat {
                None => self.columns.push(Column::new(path, unit)),
                Some(size) => {
                    let names = (0..size).map(|k| Column::new(format!("{path}[{k}]"), unit));
                    self.columns.extend(names);
                }
            }
        };
        if let Some(kind) = number {
            add(unit(path));
            return Ok(FieldKind::Number(kind));
        }
        if kind == "string" || kind.starts_with("string<=") {
            return Ok(FieldKind::Text);
        }
        let time = match (kind, self.encoding) {
            ("time", Encoding::Ros1) => Some(Kind::U32),
            ("duration", Encoding::Ros1) => Some(Kind::I32),
            _ => None,
        };
        if let Some(seconds) = time {
            add("s");
            return Ok(FieldKind::Time(seconds));
        }
        let full = match (kind, kind.contains('/')) {
            ("Header", _) => "std_msgs/Header".to_owned(),
            (_, true) => kind.replace("/msg/", "/"),
            (_, false) => format!("{package}/{kind}"),
        };
        if matches!(
            &*full,
            "builtin_interfaces/Time" | "builtin_interfaces/Duration"
        ) {
            add("s");
            return Ok(FieldKind::Time(Kind::I32));
        }
        let place = all.iter().position(|(name, _)| *name == full);
        let place = place.ok_or_else(|| format!("no definition of `{full}`"))?;
        let before = self.columns.len();
        // A list of messages is one definition; its columns come once an item.
        let items = if is_column { repeat.unwrap_or(1) } else { 1 };
        let mut fields = Vec::new();
        for item in 0..items.max(1) {
            let prefix = match repeat {
                None => format!("{path}."),
                Some(_) => format!("{path}[{item}]."),
            };
            fields = self.of_type(all, place, &prefix, is_column, depth + 1, count)?;
        }
        if items == 0 {
            self.columns.truncate(before);
        }
        Ok(FieldKind::Message(fields))
    }

    /// The numbers of a message whose bytes begin at this place of the file.
    pub fn values(&self, bytes: &[u8], offset: u64, row: &mut Vec<f64>) -> Result<(), Broken> {
        let mut reader = Reader {
            bytes,
            at: 0,
            begin: 0,
            offset,
            widest: 1,
            big_endian: false,
        };
        if self.encoding == Encoding::Cdr {
            reader.encapsulation()?;
        }
        reader.message(&self.fields, Some(row))
    }
}

/// REP 103: SI.
fn unit(path: &str) -> &'static str {
    let of = |start: &str| {
        path.strip_prefix(start)
            .is_some_and(|rest| rest.starts_with('.'))
    };
    if of("angular_velocity") || path.contains(".angular_velocity.") {
        "rad/s"
    } else if of("linear_acceleration") || path.contains(".linear_acceleration.") {
        "m/s^2"
    } else {
        ""
    }
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    /// From where on alignment counts.
    begin: usize,
    /// Of the message in the file.
    offset: u64,
    /// The widest alignment.
    widest: usize,
    big_endian: bool,
}

impl Reader<'_> {
    fn encapsulation(&mut self) -> Result<(), Broken> {
        let kind = self.bytes.get(1).copied();
        (self.big_endian, self.widest) = match kind {
            Some(0) => (true, 8),
            Some(1) => (false, 8),
            Some(6) => (true, 4),
            Some(7) => (false, 4),
            _ => {
                return Err(Broken::new(
                    self.offset,
                    format_args!("a message that begins with {:02x?}", self.bytes.get(..4)),
                    "the four bytes of CDR: 0, then 0, 1, 6 or 7",
                ));
            }
        };
        (self.at, self.begin) = (4, 4);
        Ok(())
    }

    fn number(&mut self, kind: Kind) -> Result<f64, Broken> {
        let width = kind.size().min(self.widest);
        let off = (self.at - self.begin) % width;
        if off > 0 {
            self.at += width - off;
        }
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        let number = kind
            .number(rest, self.big_endian)
            .ok_or_else(|| self.short())?;
        self.at += kind.size();
        Ok(number)
    }

    fn short(&self) -> Broken {
        Broken::new(
            self.offset,
            format_args!("a message of {} bytes", self.bytes.len()),
            "one as long as its definition says",
        )
    }

    fn length(&mut self) -> Result<usize, Broken> {
        self.number(Kind::U32).map(|length| length as usize)
    }

    fn pass(&mut self, bytes: usize) -> Result<(), Broken> {
        let end = self
            .at
            .checked_add(bytes)
            .filter(|&end| end <= self.bytes.len());
        self.at = end.ok_or_else(|| self.short())?;
        Ok(())
    }

    /// Reads all fields; numbers that are columns are added to the row.
    fn message(&mut self, fields: &[Field], mut row: Option<&mut Vec<f64>>) -> Result<(), Broken> {
        for field in fields {
            let (count, is_column) = match field.many {
                Many::One => (1, true),
                Many::Fixed(count) => (count, count <= LONGEST),
                Many::Any => (self.length()?, false),
            };
            let mut row = row.as_deref_mut().filter(|_| is_column);
            if let (FieldKind::Number(kind), None) = (&field.kind, &row)
                && count > 0
            {
                // All at once; the first aligns them.
                self.number(*kind)?;
                let rest = (count - 1)
                    .checked_mul(kind.size())
                    .ok_or_else(|| self.short())?;
                self.pass(rest)?;
                continue;
            }
            for _ in 0..count {
                let before = self.at;
                match &field.kind {
                    FieldKind::Number(kind) => {
                        let number = self.number(*kind)?;
                        row.iter_mut().for_each(|row| row.push(number));
                    }
                    FieldKind::Time(seconds) => {
                        let time = self.number(*seconds)? + 1e-9 * self.number(Kind::U32)?;
                        row.iter_mut().for_each(|row| row.push(time));
                    }
                    FieldKind::Text => {
                        let length = self.length()?;
                        self.pass(length)?;
                    }
                    FieldKind::Message(fields) => self.message(fields, row.as_deref_mut())?,
                }
                // Items of no bytes need not be counted out.
                if self.at == before {
                    break;
                }
            }
        }
        Ok(())
    }
}
