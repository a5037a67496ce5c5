//! The head of an array: a Python dictionary of its type, order and shape.

use super::super::arrays::{Array, columns};
use super::super::bytes::{Broken, Kind, Slice};
use super::LONGEST_HEADER;

/// Lists within lists: NumPy's types need three.
const DEEPEST: usize = 8;

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
        let mut parser = Parser { text: text.trim() };
        let head = parser
            .value(0)
            .ok_or_else(|| wrong("a Python dictionary"))?;
        let entry = |name: &str| match &head {
            Value::Dictionary(entries) => entries
                .iter()
                .find(|(key, _)| key == name)
                .map(|(_, value)| value),
            _ => None,
        };
        let (Some(descr), Some(Value::Flag(order)), Some(Value::List(shape))) =
            (entry("descr"), entry("fortran_order"), entry("shape"))
        else {
            return Err(wrong("`descr`, `fortran_order` and `shape`"));
        };
        let whole = |value: &Value| match value {
            Value::Whole(size) => Some(*size),
            _ => None,
        };
        let shape: Option<Vec<usize>> = shape.iter().map(whole).collect();
        let (fields, size) = fields(descr).ok_or_else(|| wrong("a type of numbers"))?;
        Ok(Self {
            fields,
            size,
            first_is_fastest: *order,
            shape: shape.ok_or_else(|| wrong("a shape of whole numbers"))?,
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
fn fields(descr: &Value) -> Option<(Vec<Field>, usize)> {
    match descr {
        Value::Text(text) => {
            // The unit of a time follows in brackets.
            let text = text.split_once('[').map_or(&**text, |(kind, _)| kind);
            let (kind, size) = item_kind(text)?;
            let field = Field {
                name: None,
                kind,
                place: 0,
                count: 1,
            };
            Some((vec![field], size.max(1)))
        }
        Value::List(list) => {
            let (mut fields, mut place) = (Vec::new(), 0usize);
            for entry in list {
                let Value::List(entry) = entry else {
                    return None;
                };
                let (Value::Text(name), Value::Text(kind)) = (entry.first()?, entry.get(1)?) else {
                    return None;
                };
                let kind = kind.split_once('[').map_or(&**kind, |(kind, _)| kind);
                let (kind, size) = item_kind(kind)?;
                let count = match entry.get(2) {
                    None => 1,
                    Some(Value::Whole(count)) => *count,
                    Some(Value::List(shape)) => {
                        shape.iter().try_fold(1usize, |all, size| match size {
                            Value::Whole(size) => all.checked_mul(*size),
                            _ => None,
                        })?
                    }
                    Some(_) => return None,
                };
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
        _ => None,
    }
}

/// What a head is made of.
enum Value {
    Text(String),
    Flag(bool),
    Whole(usize),
    /// Or a tuple.
    List(Vec<Value>),
    Dictionary(Vec<(String, Value)>),
}

struct Parser<'a> {
    text: &'a str,
}

impl Parser<'_> {
    fn next(&mut self, mark: char) -> bool {
        self.text = self.text.trim_start();
        match self.text.strip_prefix(mark) {
            Some(rest) => {
                self.text = rest;
                true
            }
            None => false,
        }
    }

    fn value(&mut self, depth: usize) -> Option<Value> {
        if depth > DEEPEST {
            return None;
        }
        self.text = self.text.trim_start();
        for (word, flag) in [("True", true), ("False", false)] {
            if let Some(rest) = self.text.strip_prefix(word) {
                self.text = rest;
                return Some(Value::Flag(flag));
            }
        }
        for (open, close) in [('[', ']'), ('(', ')')] {
            if self.next(open) {
                let mut list = Vec::new();
                while !self.next(close) {
                    list.push(self.value(depth + 1)?);
                    self.next(',');
                }
                return Some(Value::List(list));
            }
        }
        if self.next('{') {
            let mut entries = Vec::new();
            while !self.next('}') {
                let Value::Text(key) = self.value(depth + 1)? else {
                    return None;
                };
                if !self.next(':') {
                    return None;
                }
                entries.push((key, self.value(depth + 1)?));
                self.next(',');
            }
            return Some(Value::Dictionary(entries));
        }
        for quote in ['\'', '"'] {
            if self.next(quote) {
                let (text, rest) = self.text.split_once(quote)?;
                self.text = rest;
                return Some(Value::Text(text.to_owned()));
            }
        }
        let end = self.text.find(|c: char| !c.is_ascii_digit());
        let (number, rest) = self.text.split_at(end.unwrap_or(self.text.len()));
        self.text = rest.strip_prefix('L').unwrap_or(rest);
        number.parse().ok().map(Value::Whole)
    }
}
