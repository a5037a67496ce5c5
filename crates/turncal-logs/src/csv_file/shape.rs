//! The shape of a line: its words and punctuation, with every number and time replaced by a mark.
//!
//! Lines whose shapes repeat form streams of samples. The text before a mark is the name of its value; a line with a
//! rare shape is a remark, a damaged row or the start-up text of a device.

use std::collections::HashMap;

use super::labels::{Label, labels, named};
use super::lines::{Line, comment};
use super::marks::{Marked, has_mark, number};

/// Minimum number of lines of a stream, and their minimum fraction of all lines; fewer lines count as rare.
const FEWEST: usize = 5;
pub const RARE: usize = 50;
/// Separates the values of a sample once words are removed.
pub const SEPARATOR: u8 = b'\t';

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

/// The streams of a text file with rows that contain words next to their numbers.
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
        let Shapes {
            kinds,
            mut order,
            mut between,
        } = Shapes::of(lines.clone(), comma);
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

/// The shapes of lines.
struct Shapes {
    kinds: Vec<Kind>,
    /// Indices of the kinds of all lines with numbers.
    order: Vec<usize>,
    /// Number of lines of each shape that has no values.
    between: HashMap<Vec<u8>, usize>,
}

impl Shapes {
    fn of<'a>(lines: impl Iterator<Item = &'a Line>, comma: bool) -> Self {
        let (mut kinds, mut order) = (Vec::<Kind>::new(), Vec::new());
        let (mut places, mut between) = (HashMap::new(), HashMap::new());
        let mut section = Section::default();
        for line in lines {
            let line = section.marked(&line.text, comma);
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
        Self {
            kinds,
            order,
            between,
        }
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
        !field.is_empty() && Marked::of(field, true).marks.is_empty()
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
