//! Messages of ROS by their definitions: ROS 1's serialisation, and CDR as ROS 2 has it.
//!
//! Numbers get a column each, named by their path: `angular_velocity.x`, `orientation_covariance[0]`; a time of
//! seconds and nanoseconds is one column in s. Texts and lists of any length are passed over.
//!
//! Source: wiki.ros.org/msg and wiki.ros.org/ROS/Technical Overview; ROS 2 design, "Interface definition"; OMG CDR
//! (CORBA 3.3, 9.3) with the encapsulation of RTPS 2.3, 10.

mod definition;

use crate::formats::streams::Column;
use crate::formats::streams::bytes::{Broken, Kind};
use definition::Parser;

/// Longer arrays of numbers are no columns.
const LONGEST: usize = 64;

/// How numbers follow one another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    Ros1,
    Cdr,
}

/// A type of messages.
pub struct Message {
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

impl Many {
    /// Whether numbers of it are columns.
    fn is_column(self) -> bool {
        match self {
            Self::One => true,
            Self::Fixed(size) => (1..=LONGEST).contains(&size),
            Self::Any => false,
        }
    }
}

impl Message {
    /// By the text of its definition, behind which are those of the types that it needs; what is wrong with it if
    /// it cannot be read.
    pub fn parse(name: &str, definition: &str, encoding: Encoding) -> Result<Self, String> {
        let mut parser = Parser::new(name, definition, encoding);
        let fields = parser.message()?;
        Ok(Self {
            fields,
            columns: parser.columns,
            encoding,
        })
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
                Many::Fixed(count) => (count, field.many.is_column()),
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
