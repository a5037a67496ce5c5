//! The numbers, times and words of digits and letters in a line, and its shape: the line with a mark in place of each.

use std::ops::Range;

/// Stands for a number or time.
pub const MARK: u8 = 1;
/// Stands for a word of digits and letters, such as a status in hexadecimal digits.
pub const WORD: u8 = 2;

/// A line, with the positions of its numbers, times and words of digits and letters.
pub struct Marked<'a> {
    pub text: &'a [u8],
    pub marks: Vec<Range<usize>>,
    pub shape: Vec<u8>,
}

impl<'a> Marked<'a> {
    pub fn of(text: &'a [u8], comma: bool) -> Self {
        let whole = text.trim_ascii();
        let text = without_check_sum(whole);
        let (mut marks, mut shape, mut at) = (Vec::new(), Vec::new(), 0);
        let mut is_in_word = false;
        while at < text.len() {
            let rest = &text[at..];
            let found = if is_in_word {
                None
            } else {
                time(rest)
                    .or_else(|| number(rest, comma))
                    .map(|length| (length, MARK))
            };
            if let Some((length, mark)) = found.or_else(|| mixed(rest, is_in_word)) {
                marks.push(at..at + length);
                shape.push(mark);
                at += length;
                is_in_word = true;
                continue;
            }
            let byte = text[at];
            is_in_word = byte.is_ascii_alphanumeric() || byte == b'_' || byte >= 0x80;
            if byte.is_ascii_whitespace() {
                let blanks = rest.iter().take_while(|of| of.is_ascii_whitespace());
                let has_tab = blanks.clone().any(|of| *of == b'\t');
                shape.push(if has_tab { b'\t' } else { b' ' });
                at += blanks.count();
            } else {
                shape.push(byte);
                at += 1;
            }
        }
        if text.len() < whole.len() {
            shape.push(b'*');
        }
        Self { text, marks, shape }
    }

    pub fn values(&self) -> impl Iterator<Item = &'a [u8]> {
        self.marks.iter().map(|mark| &self.text[mark.clone()])
    }
}

/// The text without `*` and hexadecimal digits at its end.
fn without_check_sum(text: &[u8]) -> &[u8] {
    let end = text.iter().rposition(|byte| *byte == b'*');
    let sum = end.map(|end| (end, &text[end + 1..]));
    match sum {
        Some((end, sum))
            if (2..=8).contains(&sum.len()) && sum.iter().all(u8::is_ascii_hexdigit) =>
        {
            &text[..end]
        }
        _ => text,
    }
}

fn digits(text: &[u8]) -> usize {
    text.iter().take_while(|byte| byte.is_ascii_digit()).count()
}

/// Length of a number at the beginning of a string. Letters after it end its field; otherwise, it is not a number.
pub fn number(text: &[u8], comma: bool) -> Option<usize> {
    let mut at = usize::from(matches!(text.first(), Some(b'+' | b'-')));
    if let [a, b, c, rest @ ..] = &text[at..]
        && [a, b, c].map(u8::to_ascii_lowercase) == *b"nan"
        && !rest.first().is_some_and(u8::is_ascii_alphanumeric)
    {
        return Some(at + 3);
    }
    let whole = digits(&text[at..]);
    at += whole;
    let point = text
        .get(at)
        .filter(|byte| **byte == b'.' || comma && **byte == b',');
    let fraction = point.map_or(0, |_| digits(&text[at + 1..]));
    if whole + fraction == 0 {
        return None;
    }
    at += if fraction > 0 || point == Some(&b'.') {
        1 + fraction
    } else {
        0
    };
    if let Some(b'e' | b'E' | b'd' | b'D') = text.get(at) {
        let sign = usize::from(matches!(text.get(at + 1), Some(b'+' | b'-')));
        let exponent = digits(&text[at + 1 + sign..]);
        at += if exponent > 0 { 1 + sign + exponent } else { 0 };
    }
    let letters = text[at..]
        .iter()
        .take_while(|byte| byte.is_ascii_alphabetic())
        .count();
    let behind = text.get(at + letters);
    let ends =
        behind.is_none_or(|byte| !byte.is_ascii_alphanumeric() && !matches!(byte, b'_' | b'.'));
    ends.then_some(at)
}

/// Length of a date, a time of day or both at the beginning of a string.
fn time(text: &[u8]) -> Option<usize> {
    let mut at = date(text);
    if at > 0 && matches!(text.get(at), Some(b' ' | b'T' | b'_')) && clock(&text[at + 1..]) > 0 {
        at += 1;
    }
    let clock = clock(&text[at..]);
    if clock == 0 {
        return (at > 0).then_some(at);
    }
    at += clock;
    let half = text.get(at + 1..at + 3).map(<[u8]>::to_ascii_lowercase);
    if text.get(at) == Some(&b' ') && half.is_some_and(|half| half == b"am" || half == b"pm") {
        at += 3;
    }
    Some(at)
}

/// Length of a date such as `2021-03-04`, `20210304T` or `07/01/2021`; zero if there is none.
fn date(text: &[u8]) -> usize {
    let first = digits(text);
    if first == 8 && text.get(8) == Some(&b'T') {
        return 8;
    }
    let Some(&sign @ (b'-' | b'/' | b'.')) = text.get(first) else {
        return 0;
    };
    let rest = &text[first + 1..];
    let second = match rest
        .iter()
        .take_while(|byte| byte.is_ascii_alphabetic())
        .count()
    {
        0 => digits(rest),
        letters => letters,
    };
    let third = rest.get(second + 1..).map_or(0, digits);
    let lengths = (first, second, third);
    let is_date = matches!(lengths, (4, 1..=3, 1..=2) | (1..=2, 1..=3, 4));
    let ends = !rest
        .get(second + 1 + third)
        .is_some_and(|byte| byte.is_ascii_digit() || *byte == b'.');
    if is_date && rest.get(second) == Some(&sign) && ends {
        first + 1 + second + 1 + third
    } else {
        0
    }
}

/// Length of a time of day with its zone; zero if there is none.
fn clock(text: &[u8]) -> usize {
    let mut at = digits(text);
    if !(1..=2).contains(&at) {
        return 0;
    }
    let mut parts = 1;
    while parts < 3 && text.get(at) == Some(&b':') && digits(&text[at + 1..]) == 2 {
        (at, parts) = (at + 3, parts + 1);
    }
    if parts == 1 || text.get(at).is_some_and(u8::is_ascii_digit) {
        return 0;
    }
    if parts == 3 && matches!(text.get(at), Some(b'.' | b',' | b':')) {
        let fraction = digits(&text[at + 1..]);
        at += if fraction > 0 { 1 + fraction } else { 0 };
    }
    match text.get(at) {
        Some(b'Z') => at + 1,
        Some(b'+' | b'-') if text.get(at + 3) == Some(&b':') => at + 6.min(text.len() - at),
        _ => at,
    }
}

/// Length of a word that mixes digits and letters, like a hexadecimal number.
fn mixed(text: &[u8], is_in_word: bool) -> Option<(usize, u8)> {
    let word = |with: &[u8]| {
        let is_part = |byte: &&u8| byte.is_ascii_alphanumeric() || with.contains(byte);
        &text[..text.iter().take_while(is_part).count()]
    };
    let with_points = word(b".");
    let has_points = with_points.iter().filter(|byte| **byte == b'.').count() > 1;
    let word = if has_points { with_points } else { word(b"") };
    let is_mixed = has_points || word.iter().any(u8::is_ascii_alphabetic);
    let is_word = word.first().is_some_and(u8::is_ascii_digit) && is_mixed;
    (!is_in_word && is_word).then_some((word.len(), WORD))
}

pub fn has_mark(field: &[u8]) -> bool {
    field.iter().any(|byte| matches!(*byte, MARK | WORD))
}
