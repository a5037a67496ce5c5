//! The head of an array: a Python dictionary of its type, order and shape.

use serde::Deserialize;

use super::super::arrays::{Array, columns};
use super::super::bytes::{Broken, Kind, Slice};
use super::LONGEST_HEADER;

pub(super) struct Header {
    /// Of each item of the array.
    fields: Vec<Field>,
    /// Bytes of an item.
    size: usize,
    first_is_fastest: bool,
    shape: Vec<usize>,
    /// Bytes before the first item.
    begin: usize,
}

/// A number, or an array of numbers, in each item.
struct Field {
    name: Option<String>,
    /// None where it is no number.
    kind: Option<(Kind, bool)>,
    place: usize,
    count: usize,
}

impl Header {
    pub fn read(bytes: &[u8], offset: u64) -> Result<Self, Broken> {
        // A member of an archive may be packed; a file by itself is not.
        let mut file = match offset {
            0 => Slice::new(bytes, 0),
            _ => Slice::packed(bytes, offset),
        };
        file.take(6, "an array's first bytes")?;
        let version = file.whole(1, "the version")?;
        file.take(1, "the version")?;
        let width = if version == 1 { 2 } else { 4 };
        let length = file.length(width, "the length of the head")?;
        let begins = file.offset();
        if length as u64 > LONGEST_HEADER {
            return Err(Broken::new(
                begins,
                format_args!("a head of {length} bytes"),
                "a short one",
            ));
        }
        let text = String::from_utf8_lossy(file.take(length, "the head")?);
        let wrong =
            |what: &str| Broken::new(begins, format_args!("the head `{}`", text.trim()), what);
        let head = format!("head = {}", as_toml(text.trim()));
        let Ok(Document { head }) = toml::from_str(&head) else {
            return Err(wrong(
                "a Python dictionary of `descr`, `fortran_order` and `shape`",
            ));
        };
        let (fields, size) = fields(&head.descr).ok_or_else(|| wrong("a type of numbers"))?;
        Ok(Self {
            fields,
            size,
            first_is_fastest: head.fortran_order,
            shape: head.shape,
            begin: file.position(),
        })
    }

    /// The columns of the array.
    pub fn arrays(&self, name: &str, bytes: &[u8], offset: u64) -> Result<Vec<Array>, Broken> {
        let data = bytes.get(self.begin..).unwrap_or_default();
        let all = self
            .shape
            .iter()
            .try_fold(1usize, |all, &size| all.checked_mul(size));
        let needed = all.and_then(|all| all.checked_mul(self.size));
        if needed.is_none_or(|needed| needed > data.len()) {
            return Err(Broken::new(
                offset,
                format_args!("{} bytes of the array `{name}`", data.len()),
                format_args!("items of {} bytes by its shape {:?}", self.size, self.shape),
            ));
        }
        let mut arrays = Vec::new();
        for field in &self.fields {
            let Some((kind, big_endian)) = field.kind else {
                continue;
            };
            for index in 0..field.count {
                let place = field.place + index * kind.size();
                let named = match (&field.name, field.count) {
                    (None, 1) => name.to_owned(),
                    (None, _) => format!("{name}[{index}]"),
                    (Some(field), 1) => field.clone(),
                    (Some(field), _) => format!("{field}[{index}]"),
                };
                let number = |item: usize| {
                    let at = item.checked_mul(self.size)?.checked_add(place)?;
                    kind.number(data.get(at..)?, big_endian)
                };
                let found = columns(&named, &self.shape, self.first_is_fastest, offset, number)?;
                arrays.extend(found);
            }
        }
        Ok(arrays)
    }
}

/// The kind of a number, whether it is big-endian, and its size in bytes; no kind for what is no number.
fn item_kind(text: &str) -> Option<(Option<(Kind, bool)>, usize)> {
    let (order, rest) = text.split_at_checked(1)?;
    let (letter, size) = rest.split_at_checked(1)?;
    let size: usize = size.parse().ok().filter(|&size| size < 1 << 20)?;
    let kind = match (letter, size) {
        ("f", 4) => Kind::F32,
        ("f", 8) => Kind::F64,
        ("i", 1) => Kind::I8,
        ("i", 2) => Kind::I16,
        ("i", 4) => Kind::I32,
        ("i" | "M" | "m", 8) => Kind::I64,
        ("u" | "b", 1) => Kind::U8,
        ("u", 2) => Kind::U16,
        ("u", 4) => Kind::U32,
        ("u", 8) => Kind::U64,
        // Text is of four bytes a letter.
        ("U", _) => return Some((None, 4 * size)),
        _ => return Some((None, size)),
    };
    Some((Some((kind, order == ">")), size))
}

/// The numbers of an item and its size in bytes.
fn fields(descr: &Descr) -> Option<(Vec<Field>, usize)> {
    // The unit of a time follows in brackets.
    let item = |text: &str| item_kind(text.split_once('[').map_or(text, |(kind, _)| kind));
    let list = match descr {
        Descr::One(text) => {
            let (kind, size) = item(text)?;
            let field = Field {
                name: None,
                kind,
                place: 0,
                count: 1,
            };
            return Some((vec![field], size.max(1)));
        }
        Descr::Fields(list) => list,
    };
    let (mut fields, mut place) = (Vec::new(), 0usize);
    for field in list {
        let (name, kind, shape) = match field {
            Named::Number(name, kind) => (name, kind, &[][..]),
            Named::Array(name, kind, shape) => (name, kind, &shape[..]),
        };
        let (kind, size) = item(kind)?;
        let mut sizes = shape.iter();
        let count = sizes.try_fold(1usize, |all, size| all.checked_mul(*size))?;
        fields.push(Field {
            name: Some(name.clone()),
            kind,
            place,
            count: if count > 64 { 0 } else { count },
        });
        place = place.checked_add(size.checked_mul(count)?)?;
    }
    Some((fields, place.max(1)))
}

/// A head by the name that makes it a TOML document.
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

/// A Python dictionary as TOML has it, which has other brackets, colons and words for truth.
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
