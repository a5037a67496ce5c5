//! ROS messages with definitions: ROS 1 serialisation, and CDR as in ROS 2.
//!
//! Each number becomes a column named by its path: `angular_velocity.x`, `orientation_covariance[0]`; a time of seconds
//! and nanoseconds is one column in s. Strings and variable-length arrays are skipped.
//!
//! Source: wiki.ros.org/msg and wiki.ros.org/ROS/Technical Overview; ROS 2 design, "Interface definition"; OMG CDR
//! (CORBA 3.3, 9.3) with the encapsulation of RTPS 2.3, 10.

mod definition;

use crate::streams::Column;
use crate::streams::bytes::{Broken, Kind, Slice};
pub use definition::Encoding;
use definition::{Field, FieldKind, Many, Parser};

/// A type of messages.
pub struct Message {
    fields: Vec<Field>,
    pub columns: Vec<Column>,
    encoding: Encoding,
}

impl Message {
    /// The type from the text of its definition, followed by the definitions of the required types; an error message if
    /// invalid.
    pub fn parse(name: &str, definition: &str, encoding: Encoding) -> Result<Self, String> {
        let mut parser = Parser::new(name, definition, encoding);
        let fields = parser.message()?;
        Ok(Self {
            fields,
            columns: parser.columns,
            encoding,
        })
    }

    /// The numbers of a message whose bytes start at this offset of the file.
    pub fn values(&self, bytes: &[u8], offset: u64, row: &mut Vec<f64>) -> Result<(), Broken> {
        let mut reader = Reader {
            bytes: Slice::packed(bytes, offset),
            begin: 0,
            widest: 1,
        };
        if self.encoding == Encoding::Cdr {
            reader.encapsulation()?;
        }
        reader.message(&self.fields, Some(row))
    }
}

struct Reader<'a> {
    bytes: Slice<'a>,
    /// Origin of the alignment.
    begin: usize,
    /// Maximum alignment.
    widest: usize,
}

impl Reader<'_> {
    fn encapsulation(&mut self) -> Result<(), Broken> {
        let head = self.bytes.take(4, "a message header")?;
        (self.bytes.big_endian, self.widest) = match head[1] {
            0 => (true, 8),
            1 => (false, 8),
            6 => (true, 4),
            7 => (false, 4),
            _ => {
                return Err(Broken::new(
                    self.bytes.offset(),
                    format_args!("a message that starts with {head:02x?}"),
                    "a CDR header (0, then 0, 1, 6 or 7)",
                ));
            }
        };
        self.begin = 4;
        Ok(())
    }

    fn number(&mut self, kind: Kind) -> Result<f64, Broken> {
        let width = kind.size().min(self.widest);
        let off = (self.bytes.position() - self.begin) % width;
        if off > 0 {
            self.pass(width - off)?;
        }
        let bytes = self.bytes.take(kind.size(), "a number")?;
        let number = kind.number(bytes, self.bytes.big_endian);
        Ok(number.unwrap_or(f64::NAN))
    }

    fn length(&mut self) -> Result<usize, Broken> {
        self.number(Kind::U32).map(|length| length as usize)
    }

    fn pass(&mut self, bytes: usize) -> Result<(), Broken> {
        self.bytes
            .take(bytes, "a field of the message definition")
            .map(|_| ())
    }

    /// Reads all fields and adds column values to the row.
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
                // All items are read at once; the first one sets the alignment.
                self.number(*kind)?;
                self.pass((count - 1).saturating_mul(kind.size()))?;
                continue;
            }
            for _ in 0..count {
                let before = self.bytes.position();
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
                // Items without bytes need no loop.
                if self.bytes.position() == before {
                    break;
                }
            }
        }
        Ok(())
    }
}
