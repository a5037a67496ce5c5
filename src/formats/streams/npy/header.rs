//! The head of an array: a Python dictionary of its type, order and shape.

use std::io::Read;

use serde::Deserialize;

use super::super::arrays::{Array, Field, Open};
use super::super::bytes::{Broken, Kind, Slice};
use super::LONGEST_HEADER;

pub struct Header {
    /// Of each item of the array.
    fields: Vec<Numbers>,
    /// Bytes of an item.
    size: usize,
    first_is_fastest: bool,
    shape: Vec<usize>,
    /// Bytes before the first item.
    pub begin: u64,
}

/// A number, or an array of numbers, in each item.
struct Numbers {
    name: Option<String>,
    /// None where it is no number.
    kind: Option<(Kind, bool)>,
    place: usize,
    count: usize,
}

impl Header {
    pub fn read(file: &mut dyn Read, offset: u64) -> Result<Self, Broken> {
        let mut take = |count: u64, what: &str| {
            let mut bytes = Vec::new();
            match file.take(count).read_to_end(&mut bytes) {
                Ok(read) if read as u64 == count => Ok(bytes),
                Ok(read) => Err(Broken::new(
                    offset,
                    format_args!("{read} bytes to the end of an array"),
                    format_args!("{count} bytes of {what}"),
                )),
                Err(error) => Err(Broken::new(offset, error, what)),
            }
        };
        let first = take(8, "an array's first bytes")?;
        let width = if first[6] == 1 { 2 } else { 4 };
        let length = take(width, "the length of the head")?;
        let length = Slice::new(&length, offset).whole(width as usize, "a length")?;
        if length > LONGEST_HEADER {
            let found = format_args!("a head of {length} bytes");
            return Err(Broken::new(offset, found, "a short one"));
        }
        let bytes = take(length, "the head")?;
        let text = String::from_utf8_lossy(&bytes);
        let wrong =
            |what: &str| Broken::new(offset, format_args!("the head `{}`", text.trim()), what);
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
            begin: 8 + width + length,
        })
    }

    /// The array of numbers that is read by `open`.
    pub fn array(self, name: &str, open: Open, offset: u64) -> Array {
        let fields = self.fields.iter().filter_map(|field| {
            let (kind, big_endian) = field.kind?;
            let own = field.name.as_deref().unwrap_or(name);
            Some((0..field.count).map(move |index| Field {
                name: match field.count {
                    1 => own.to_owned(),
                    _ => format!("{own}[{index}]"),
                },
                kind,
                big_endian,
                place: field.place + index * kind.size(),
            }))
        });
        Array {
            fields: fields.flatten().collect(),
            shape: self.shape,
            first_is_fastest: self.first_is_fastest,
            size: self.size,
            open,
            offset,
        }
    }

    /// What is no number and is left out, in a sentence.
    pub fn left_out(&self, name: &str) -> Option<String> {
        let no_numbers = self.fields.iter().filter(|field| field.kind.is_none());
        let names = no_numbers.map(|field| format!("`{}`", field.name.as_deref().unwrap_or(name)));
        let names: Vec<String> = names.collect();
        let are = match names.len() {
            0 => return None,
            1 => "holds text and is",
            _ => "hold text and are",
        };
        Some(format!("{} {are} left out.", names.join(", ")))
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
        ("M" | "m", 8) => Kind::I64,
        ("b", 1) => Kind::U8,
        // Text is of four bytes a letter.
        ("U", _) => return Some((None, 4 * size)),
        _ => match Kind::whole_number(letter == "i", size) {
            Some(kind) if matches!(letter, "i" | "u") => kind,
            _ => return Some((None, size)),
        },
    };
    Some((Some((kind, order == ">")), size))
}

/// The numbers of an item and its size in bytes.
fn fields(descr: &Descr) -> Option<(Vec<Numbers>, usize)> {
    // The unit of a time follows in brackets.
    let item = |text: &str| item_kind(text.split_once('[').map_or(text, |(kind, _)| kind));
    let list = match descr {
        Descr::One(text) => {
            let (kind, size) = item(text)?;
            let field = Numbers {
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
        fields.push(Numbers {
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
