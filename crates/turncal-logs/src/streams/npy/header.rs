//! The header of an array: a Python dictionary with type, order and shape.

use std::io::Read;

use serde::Deserialize;

use super::super::arrays::Field;
use super::super::bytes::{Broken, Kind, Slice};

/// Maximum header length.
const LONGEST_HEADER: u64 = 1 << 20;

/// Maximum length of an array within an item that becomes columns.
const MOST_NUMBERS: usize = 64;

pub struct Header {
    /// The numbers in each item of the array, and its size in bytes.
    pub fields: Vec<Field>,
    pub size: usize,
    /// Names of non-numeric fields.
    left_out: Vec<String>,
    pub first_is_fastest: bool,
    pub shape: Vec<usize>,
    /// Bytes before the first item.
    pub begin: u64,
}

impl Header {
    pub fn read(file: &mut dyn Read, name: &str, offset: u64) -> Result<Self, Broken> {
        let mut take = |count: u64, what: &str| {
            let mut bytes = Vec::new();
            match file.take(count).read_to_end(&mut bytes) {
                Ok(read) if read as u64 == count => Ok(bytes),
                Ok(read) => Err(Broken::new(
                    offset,
                    format_args!("only {read} bytes before the end of the array"),
                    format_args!("{count} bytes for {what}"),
                )),
                Err(error) => Err(Broken::new(offset, error, what)),
            }
        };
        let first = take(8, "the first bytes of an array")?;
        let width = if first[6] == 1 { 2 } else { 4 };
        let length = take(width, "the length of the header")?;
        let length = Slice::new(&length, offset).whole(width as usize, "a length")?;
        if length > LONGEST_HEADER {
            let found = format_args!("a header of {length} bytes");
            return Err(Broken::new(offset, found, "a shorter header"));
        }
        let bytes = take(length, "the header")?;
        let text = String::from_utf8_lossy(&bytes);
        let wrong =
            |what: &str| Broken::new(offset, format_args!("the header `{}`", text.trim()), what);
        let head = format!("head = {}", as_toml(text.trim()));
        let Ok(Document { head }) = toml::from_str(&head) else {
            return Err(wrong(
                "a Python dictionary of `descr`, `fortran_order` and `shape`",
            ));
        };
        let mut header = Self {
            fields: Vec::new(),
            size: 0,
            left_out: Vec::new(),
            first_is_fastest: head.fortran_order,
            shape: head.shape,
            begin: 8 + width + length,
        };
        let described = header.describe(name, &head.descr);
        described.ok_or_else(|| wrong("a numeric type"))?;
        Ok(header)
    }

    /// Remark on omitted non-numeric fields.
    pub fn left_out(&self) -> Option<String> {
        let are = match self.left_out.len() {
            0 => return None,
            1 => "contains text and was",
            _ => "contain text and were",
        };
        Some(format!("{} {are} ignored.", self.left_out.join(", ")))
    }

    fn describe(&mut self, name: &str, items: &Descr) -> Option<()> {
        match items {
            Descr::One(kind) => self.add(name, kind, &[])?,
            Descr::Fields(fields) => {
                for field in fields {
                    match field {
                        Named::Number(name, kind) => self.add(name, kind, &[])?,
                        Named::Array(name, kind, shape) => self.add(name, kind, shape)?,
                    }
                }
            }
        }
        self.size = self.size.max(1);
        Some(())
    }

    /// Adds a number, or an array of numbers, in each item.
    fn add(&mut self, name: &str, kind: &str, shape: &[usize]) -> Option<()> {
        // The unit of a time follows in brackets.
        let (kind, size) = item_kind(kind.split_once('[').map_or(kind, |(kind, _)| kind))?;
        let mut sizes = shape.iter();
        let count = sizes.try_fold(1usize, |all, size| all.checked_mul(*size))?;
        let end = self.size.checked_add(size.checked_mul(count)?)?;
        match kind {
            None => self.left_out.push(format!("`{name}`")),
            Some((kind, big_endian)) if count <= MOST_NUMBERS => {
                self.fields.extend((0..count).map(|index| Field {
                    name: match count {
                        1 => name.to_owned(),
                        _ => format!("{name}[{index}]"),
                    },
                    kind,
                    big_endian,
                    place: self.size + index * size,
                }));
            }
            Some(_) => {}
        }
        self.size = end;
        Some(())
    }
}

/// Kind of a number (`None` if not numeric), byte order, and size in bytes.
fn item_kind(text: &str) -> Option<(Option<(Kind, bool)>, usize)> {
    let (order, rest) = text.split_at_checked(1)?;
    let (letter, size) = rest.split_at_checked(1)?;
    let size: usize = size.parse().ok().filter(|&size| size < 1 << 20)?;
    let kind = match (letter, size) {
        ("f", 4) => Kind::F32,
        ("f", 8) => Kind::F64,
        ("M" | "m", 8) => Kind::I64,
        ("b", 1) => Kind::U8,
        // Text has four bytes per character.
        ("U", _) => return Some((None, 4 * size)),
        _ => match Kind::whole_number(letter == "i", size) {
            Some(kind) if matches!(letter, "i" | "u") => kind,
            _ => return Some((None, size)),
        },
    };
    Some((Some((kind, order == ">")), size))
}

/// A header with the name that makes it a TOML document.
#[derive(Deserialize)]
struct Document {
    head: Head,
}

#[derive(Deserialize)]
struct Head {
    descr: Descr,
    fortran_order: bool,
    shape: Vec<usize>,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Descr {
    One(String),
    Fields(Vec<Named>),
}

/// Name and type of a field, and its shape.
#[derive(Deserialize)]
#[serde(untagged)]
enum Named {
    Number(String, String),
    Array(String, String, Vec<usize>),
}

/// Converts a Python dictionary to TOML; the two differ in brackets, colons and booleans.
fn as_toml(text: &str) -> String {
    let mut quote = None;
    let outside = |c: char| match c {
        '(' => '[',
        ')' => ']',
        ':' => '=',
        other => other.to_ascii_lowercase(),
    };
    let letter = |c: char| {
        match quote {
            Some(open) if open == c => quote = None,
            None if matches!(c, '\'' | '"') => quote = Some(c),
            _ => (),
        }
        if quote.is_some() { c } else { outside(c) }
    };
    text.chars().map(letter).collect()
}
