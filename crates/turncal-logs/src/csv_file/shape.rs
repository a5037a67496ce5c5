//! The shape of a line: its words and signs, with every number and time replaced by a mark.
//!
//! Lines whose shapes repeat form streams of samples. The text before a mark is the name of its value; a line with a
//! rare shape is a remark, a damaged row or the text of a starting device.

use std::collections::HashMap;
use std::ops::Range;

use super::lines::{Line, comment};

/// Stands for a number or time.
const MARK: u8 = 1;
/// Stands for a word of digits and letters, such as a status in hexadecimal digits.
const WORD: u8 = 2;
/// Minimum number of lines of a stream, and their minimum fraction of all lines; fewer lines count as rare.
const FEWEST: usize = 5;
pub const RARE: usize = 50;
/// Separates the values of a sample once words are removed.
pub const SEPARATOR: u8 = b'\t';
/// Longest name of a value.
const LONGEST_NAME: usize = 32;

/// A line, with the positions of its numbers, times and words of digits and letters.
struct Marked<'a> {
    text: &'a [u8],
    marks: Vec<Range<usize>>,
    shape: Vec<u8>,
}

impl<'a> Marked<'a> {
    fn of(text: &'a [u8], comma: bool) -> Self {
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

    fn values(&self) -> impl Iterator<Item = &'a [u8]> {
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

/// Length of a number at the beginning of a text. Letters after it end its field; otherwise, it is not a number.
fn number(text: &[u8], comma: bool) -> Option<usize> {
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

/// Length of a date, a time of day or both at the beginning of a text.
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

/// The last line that named the deeper lines below it, as in YAML.
#[derive(Debug, Default)]
struct Section {
    indent: usize,
    name: Vec<u8>,
}

impl Section {
    /// A line with the name of its section before its shape.
    fn marked<'a>(&mut self, line: &'a [u8], comma: bool) -> Marked<'a> {
        let mut marked = Marked::of(line, comma);
        let indent = line.len() - line.trim_ascii_start().len();
        if !marked.marks.is_empty() {
            if indent > self.indent {
                marked.shape.splice(0..0, self.name.iter().copied());
            }
        } else if let Some(name) = marked.shape.strip_suffix(b":") {
            self.indent = indent;
            self.name = [name, b" "].concat();
        }
        marked
    }
}

/// Successive lines of these shapes that form one sample.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stream {
    /// A word that distinguishes the stream from the other streams in the file.
    pub name: String,
    shapes: Vec<Vec<u8>>,
    /// Names of the values in a sample; a name is empty if no word precedes the value.
    pub names: Vec<String>,
    /// Units of the values in a sample; empty if not stated.
    pub units: Vec<String>,
}

/// The streams of a text whose rows contain words beside their numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Labelled {
    comma: bool,
    pub streams: Vec<Stream>,
    /// Shapes of lines without numbers that repeat.
    between: Vec<Vec<u8>>,
}

impl Labelled {
    /// The streams in these lines, if most rows have words next to their numbers.
    pub fn of<'a>(lines: impl Iterator<Item = &'a Line> + Clone) -> Option<Self> {
        let count = lines.clone().count();
        let comma = 2 * lines
            .clone()
            .filter(|line| has_decimal_comma(&line.text))
            .count()
            > count;
        let mut section = Section::default();
        let marked = lines.clone().map(|line| section.marked(&line.text, comma));
        let mut kinds: Vec<Kind> = Vec::new();
        let mut places = HashMap::new();
        // Indices of the kinds of all lines with numbers.
        let mut order = Vec::new();
        let mut between = HashMap::new();
        for line in marked {
            // An item of a list has no name.
            if line.marks.is_empty() || line.shape.starts_with(b"- ") {
                *between.entry(line.shape).or_insert(0) += 1;
                continue;
            }
            let place = *places.entry(line.shape.clone()).or_insert(kinds.len());
            if place == kinds.len() {
                kinds.push(Kind::of(&line));
            }
            kinds[place].add(&line);
            order.push(place);
        }
        let least = FEWEST.max(count / RARE);
        let is_stream = |place: &usize| kinds[*place].count >= least;
        let streams = kinds.iter().filter(|kind| kind.count >= least);
        let rows: usize = streams.clone().map(|kind| kind.count).sum();
        let is_of_table = |kind: &Kind| {
            let mut lines = lines.clone();
            lines.any(|line| names_fields(&line.text, &kind.shape))
        };
        let labelled = streams.clone();
        let labelled = labelled.filter(|kind| is_labelled(&kind.shape) && !is_of_table(kind));
        let of_labelled: usize = labelled.map(|kind| kind.count).sum();
        if 2 * of_labelled <= rows || 2 * rows <= order.len() {
            return None;
        }
        order.retain(is_stream);
        // Lines of which most have a time are separate samples.
        let timed = streams.clone().filter(|kind| kind.has_time()).count();
        let are_parts = timed < 2 || 2 * timed < streams.count();
        let kind = |place: &usize| &kinds[*place];
        let streams = cycle(&order).filter(|_| are_parts);
        let streams = streams.map(|places| vec![places.iter().map(kind).collect()]);
        let streams: Vec<Vec<&Kind>> = streams.unwrap_or_else(|| {
            let each = (0..kinds.len()).filter(is_stream);
            each.map(|place| vec![kind(&place)]).collect()
        });
        let mut streams: Vec<Stream> = streams.into_iter().map(Stream::new).collect();
        for k in 0..streams.len() {
            let is_used = streams
                .iter()
                .enumerate()
                .any(|(other, of)| other != k && of.name == streams[k].name);
            if streams[k].name.is_empty() || is_used {
                streams[k].name = format!("{}{}", streams[k].name, k + 1);
            }
        }
        between.retain(|_, count| *count >= least);
        Some(Self {
            comma,
            streams,
            between: between.into_keys().collect(),
        })
    }

    /// The stream of this name or, without a name, the one with the most values.
    pub fn stream(&self, name: Option<&str>) -> Option<&Stream> {
        match name {
            Some(name) => self.streams.iter().find(|stream| stream.name == name),
            None => self.streams.iter().max_by_key(|stream| stream.names.len()),
        }
    }

    /// Names of the streams, if there are several.
    pub fn names(&self) -> Vec<String> {
        let names = self.streams.iter().map(|stream| stream.name.clone());
        names.filter(|_| self.streams.len() > 1).collect()
    }

    /// Whether this is the shape of any stream, or of a line between the lines of streams.
    fn knows(&self, shape: &Vec<u8>) -> bool {
        let mut streams = self.streams.iter();
        streams.any(|stream| stream.shapes.contains(shape)) || self.between.contains(shape)
    }
}

/// Lines of one shape.
struct Kind {
    shape: Vec<u8>,
    count: usize,
    last: Vec<f64>,
    /// Whether each value has only increased.
    increases: Vec<bool>,
}

impl Kind {
    fn of(line: &Marked) -> Self {
        Self {
            shape: line.shape.clone(),
            count: 0,
            last: vec![f64::NEG_INFINITY; line.marks.len()],
            increases: vec![true; line.marks.len()],
        }
    }

    fn add(&mut self, line: &Marked) {
        self.count += 1;
        let last = self.last.iter_mut().zip(&mut self.increases);
        for ((last, increases), value) in last.zip(line.values()) {
            // A time of day counts as a time for any value.
            if value.contains(&b':') {
                continue;
            }
            let value = std::str::from_utf8(value)
                .ok()
                .and_then(|text| text.parse().ok());
            let value = value.unwrap_or(f64::NAN);
            *increases &= value > *last;
            *last = value;
        }
    }

    fn has_time(&self) -> bool {
        self.increases.contains(&true)
    }
}

/// A sample that is read line by line.
#[derive(Debug, Default)]
pub struct Sample {
    values: Vec<u8>,
    lines: usize,
    section: Section,
}

/// Contribution of a line to a sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Added {
    /// Its last values.
    Complete,
    /// Values before others.
    Part,
    /// The line belongs to another stream, or between the lines of streams.
    Other,
    /// The line has another shape and contributes no values.
    Nothing,
}

impl Sample {
    /// Adds the values of a line; once the sample is complete, they are replaced by the values of the sample. Samples
    /// with missing lines are left out.
    pub fn add(&mut self, labelled: &Labelled, stream: &Stream, line: &mut Vec<u8>) -> Added {
        let marked = self.section.marked(line, labelled.comma);
        let is = |part: usize| stream.shapes.get(part) == Some(&marked.shape);
        if labelled.between.contains(&marked.shape) {
            return Added::Other;
        }
        if !is(self.lines) {
            self.lines = 0;
            if !is(0) {
                let is_known = labelled.knows(&marked.shape);
                return if is_known {
                    Added::Other
                } else {
                    Added::Nothing
                };
            }
        }
        if self.lines == 0 {
            self.values.clear();
        }
        for value in marked.values() {
            if !self.values.is_empty() {
                self.values.push(SEPARATOR);
            }
            self.values.extend_from_slice(value);
        }
        self.lines += 1;
        if self.lines < stream.shapes.len() {
            return Added::Part;
        }
        self.lines = 0;
        line.clone_from(&self.values);
        Added::Complete
    }
}

/// Whether a number before a semicolon or tab has a comma.
fn has_decimal_comma(line: &[u8]) -> bool {
    let is_decimal = |field: &[u8]| {
        let field = field.trim_ascii();
        field.contains(&b',')
            && number(field, true) == Some(field.len())
            && number(field, false) != Some(field.len())
    };
    let between = |by: &'static [u8]| line.split(move |byte| by.contains(byte));
    let mut quoted = between(b"\"").skip(1).step_by(2);
    quoted.any(is_decimal)
        || line.iter().any(|byte| b";\t".contains(byte)) && between(b";\t").any(is_decimal)
}

/// Whether a field has words or signs next to its number, a row has words between its numbers, or the row begins like a
/// comment or a sentence of a receiver.
fn is_labelled(shape: &[u8]) -> bool {
    let separator = separator(shape);
    let is_mixed = |field: &[u8]| {
        let field = field.trim_ascii();
        let quoted = field
            .strip_prefix(b"\"")
            .and_then(|of| of.strip_suffix(b"\""));
        let bare = quoted.unwrap_or(field);
        bare.len() > 1 && has_mark(bare)
    };
    let by = separator.unwrap_or(b' ');
    let fields: Vec<&[u8]> = shape.split(|byte| *byte == by).collect();
    // Between blanks, a word belongs to the number after it if it is marked as a label, or if there is another word
    // before it.
    let first = fields.iter().position(|field| has_mark(field));
    let mut pairs = fields.windows(2).enumerate();
    let names_next = pairs.any(|(k, pair)| {
        let says_so = matches!(pair[0].last(), Some(b':' | b'='));
        let is_between = first.is_some_and(|first| k > first);
        let is_label = says_so || is_between && separator.is_none();
        !pair[0].is_empty() && !has_mark(pair[0]) && has_mark(pair[1]) && is_label
    });
    // A name before the numbers and a unit behind them.
    let mut ends = fields.iter().take(1).chain(fields.last());
    let is_enclosed = separator.is_none() && ends.all(|end| !has_mark(end));
    comment(shape).is_some()
        || shape.starts_with(b"$")
        || separator == Some(b'|')
        || fields.iter().any(|field| is_mixed(field))
        || names_next
        || is_enclosed
}

fn has_mark(field: &[u8]) -> bool {
    field.iter().any(|byte| matches!(*byte, MARK | WORD))
}

/// The separator of most numbers; `None` for blanks.
fn separator(shape: &[u8]) -> Option<u8> {
    let parted = |by: &u8| {
        let fields = shape.split(|byte| byte == by);
        fields.filter(|field| has_mark(field)).count()
    };
    let separators = [b'|', b',', b'\t', b';'].into_iter();
    separators
        .filter(|byte| shape.contains(byte))
        .max_by_key(parted)
}

/// Whether a line has a word for each field of rows of this shape, which are then those of a table.
fn names_fields(line: &[u8], shape: &[u8]) -> bool {
    let Some(by) = separator(shape) else {
        return false;
    };
    let fields = |text: &[u8]| {
        let end = text
            .iter()
            .rposition(|byte| *byte != by && !byte.is_ascii_whitespace());
        text[..end.map_or(0, |end| end + 1)]
            .split(|byte| *byte == by)
            .count()
    };
    let is_word = |field: &[u8]| {
        let field = field.trim_ascii();
        !field.is_empty() && number(field, true) != Some(field.len())
    };
    let count = fields(line);
    count == fields(shape) && line.split(|byte| *byte == by).take(count).all(is_word)
}

/// The kinds of lines, if all of them follow each other in turn.
fn cycle(order: &[usize]) -> Option<Vec<usize>> {
    let mut period: Vec<usize> = Vec::new();
    for place in order {
        if period.contains(place) {
            break;
        }
        period.push(*place);
    }
    // Lines may be lost, or the log may begin within a sample.
    let next = |place: &usize| {
        let at = period.iter().position(|of| of == place)?;
        period.get((at + 1) % period.len())
    };
    let follows = order
        .windows(2)
        .filter(|pair| next(&pair[0]) == Some(&pair[1]))
        .count();
    (period.len() > 1 && 10 * follows >= 9 * (order.len() - 1)).then(|| {
        let first = *period.iter().min().unwrap_or(&0);
        let begin = period.iter().position(|place| *place == first).unwrap_or(0);
        period.rotate_left(begin);
        period
    })
}

/// Label of a value.
#[derive(Default)]
struct Label {
    /// Words before it, without signs at their ends.
    words: String,
    unit: String,
    /// Axis at the end of the words.
    axis: Option<char>,
    /// Whether the value only increases, as a time does.
    increases: bool,
}

impl Stream {
    fn new(kinds: Vec<&Kind>) -> Self {
        let labels: Vec<Label> = kinds.iter().flat_map(|kind| kind.labels()).collect();
        let first = labels.iter().find(|label| !label.words.is_empty());
        let name = first
            .and_then(|label| label.words.split(' ').next())
            .unwrap_or_default();
        let (names, units) = named(&labels).into_iter().unzip();
        Self {
            name: name.to_owned(),
            shapes: kinds.iter().map(|kind| kind.shape.clone()).collect(),
            names,
            units,
        }
    }
}

impl Kind {
    /// The label of each value.
    fn labels(&self) -> Vec<Label> {
        let increases = self.increases.iter().zip(labels(&self.shape));
        let with = increases.map(|(increases, label)| Label {
            increases: *increases,
            ..label
        });
        with.collect()
    }
}

/// The label of each value of a line.
fn labels(shape: &[u8]) -> Vec<Label> {
    let text = String::from_utf8_lossy(shape);
    let pieces: Vec<&str> = text.split([char::from(MARK), char::from(WORD)]).collect();
    let is_separator = |c: char| matches!(c, ',' | ';' | '|' | '\t');
    let mut labels: Vec<Label> = Vec::new();
    for (k, piece) in pieces.iter().enumerate() {
        let is_last = k + 1 == pieces.len();
        let glued = piece
            .find(|c: char| !c.is_alphabetic() && c != '°')
            .unwrap_or(piece.len());
        // Words up to a separator belong to the preceding value; so do letters without a blank.
        let end = match piece.find(is_separator) {
            Some(end) => end,
            None if is_last => piece.len(),
            None => glued,
        };
        let (unit, words) = piece.split_at(if k == 0 { 0 } else { end });
        if let Some(before) = labels.last_mut()
            && before.unit.is_empty()
        {
            unit.trim().clone_into(&mut before.unit);
        }
        if !is_last {
            labels.push(Label::of(words));
        }
    }
    labels
}

impl Label {
    fn of(words: &str) -> Self {
        let mut words = words.to_owned();
        let mut unit = String::new();
        for [open, close] in [['[', ']'], ['(', ')']] {
            if let Some((before, rest)) = words.split_once(open)
                && let Some((inner, behind)) = rest.split_once(close)
                && inner.chars().any(char::is_alphabetic)
            {
                inner.trim().clone_into(&mut unit);
                words = format!("{before} {behind}");
            }
        }
        let is_part = |c: char| c.is_alphanumeric() || c == '_';
        let tokens: Vec<&str> = words
            .split(|c: char| !is_part(c))
            .filter(|of| !of.is_empty())
            .collect();
        let axis = tokens.last().and_then(|last| axis(last));
        let mut words = tokens.join(" ");
        if let Some((cut, _)) = words.char_indices().rev().nth(LONGEST_NAME - 1) {
            words.drain(..cut);
        }
        Self {
            words,
            unit,
            axis,
            increases: false,
        }
    }
}

/// The axis denoted by a word.
fn axis(word: &str) -> Option<char> {
    let mut letters = word.chars();
    letters
        .next()
        .filter(|letter| "xyzXYZ".contains(*letter) && letters.next().is_none())
}

/// Names and units of values. An axis alone belongs to the words before the last one; words before three values name
/// their axes, after a time or not.
fn named(labels: &[Label]) -> Vec<(String, String)> {
    let mut named = Vec::new();
    let mut group = Label::default();
    let mut rest = labels;
    while let Some((label, behind)) = rest.split_first() {
        let run = 1 + (behind.iter().take_while(|of| of.words.is_empty())).count();
        let (values, others) = rest.split_at(run);
        rest = others;
        let is_axis = label.axis.is_some() && label.words.len() == 1;
        if let Some(axis) = label.axis.filter(|_| !is_axis) {
            let words = label.words.trim_end_matches(axis).trim().to_owned();
            let unit = label.unit.clone();
            group = Label {
                words,
                unit,
                ..Label::default()
            };
        }
        let times = usize::from(label.increases && run > 1);
        named.extend(match run - times {
            1 if times == 0 && is_axis && !group.words.is_empty() => {
                vec![label.called(format!("{} {}", group.words, label.words), &group)]
            }
            3 if label.axis.is_none() && !label.words.is_empty() => {
                let axes = values[times..].iter().zip(['x', 'y', 'z']);
                let axes =
                    axes.map(|(of, axis)| of.called(format!("{} {axis}", label.words), label));
                let time = values[..times]
                    .iter()
                    .map(|of| of.called(String::new(), of));
                time.chain(axes).collect()
            }
            _ if run == 1 => vec![label.called(label.words.clone(), label)],
            // The words of a longer row name the row.
            _ => values
                .iter()
                .map(|of| of.called(String::new(), of))
                .collect(),
        });
    }
    distinct(named)
}

impl Label {
    /// The value with this name; if it has no unit, with the unit of another label.
    fn called(&self, name: String, other: &Self) -> (String, String) {
        let own = Some(&self.unit).filter(|unit| !unit.is_empty());
        (name, own.unwrap_or(&other.unit).clone())
    }
}

/// Names made unique.
fn distinct(mut named: Vec<(String, String)>) -> Vec<(String, String)> {
    let all = named.clone();
    for (k, (name, _)) in named.iter_mut().enumerate() {
        let mut others = all.iter().enumerate().filter(|(other, _)| *other != k);
        if !name.is_empty() && others.any(|(_, of)| of.0 == *name) {
            *name = format!("{name} {}", k + 1);
        }
    }
    named
}
