//! Structure of a text from its first lines: preamble, lines of names and units, and rows, possibly tagged.

use std::collections::{BTreeMap, BTreeSet};

use super::clock_text::ClockText;
use super::lines::{Line, Stop};
use super::row::{Malformed, Row};
use super::shape::{Added, Labelled, SEPARATOR, Sample, Stream};

/// Number of rows at the end of the first lines that define the row format.
const ROWS: usize = 64;
/// Minimum number of columns for a time and both triads.
const BOTH_TRIADS: usize = 7;
/// Maximum number of kinds of rows.
const MOST_TAGS: usize = 64;
/// The unit of a column of times as text.
const CLOCK: &str = "h:m:s";
/// Unit keys in camera logs (`.gcsv`): key, prefix of column names, unit.
const SCALES: [(&str, char, &str); 3] = [
    ("tscale", 't', "s"),
    ("gscale", 'g', "rad/s"),
    ("ascale", 'a', "g"),
];

/// Content of a text.
#[derive(Debug, Clone, PartialEq)]
pub struct Heading {
    pub delimiter: Delimiter,
    /// Whether each column holds numbers.
    pub numbers: Vec<bool>,
    /// Column names: `1`, `2`, … if the file has none.
    pub names: Vec<String>,
    /// Line of the names, or of the first row if there are no names.
    pub line: u64,
    /// Column units, if stated.
    pub units: Option<Vec<String>>,
    /// Columns read as clock times.
    pub clocks: Vec<Option<ClockText>>,
    /// Rate of the rows, Hz.
    pub rate: Option<f64>,
    /// Statements of the file that are ignored or interpreted.
    pub remarks: Vec<String>,
    /// Number of lines at the beginning that are not rows.
    pub above: usize,
    /// Number of rows among the first lines.
    pub rows: usize,
}

/// Rows of several kinds, identified by the word or number in one column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Tags {
    pub column: usize,
    pub names: Vec<String>,
}

/// The parsed first lines of a text.
pub struct Looks(Vec<Look>);

struct Look {
    number: u64,
    is_comment: bool,
    delimiter: Delimiter,
    text: String,
    fields: Result<Vec<String>, Malformed>,
}

impl Look {
    fn of(line: &Line) -> Self {
        // A mark with a separator behind it is the name of the first column.
        let is_inside = |of: &&[u8]| !matches!(of.first(), Some(b',' | b';' | b'\t'));
        let comment = line.comment().filter(is_inside);
        let text = text_of(comment.unwrap_or(&line.text));
        // Tabs may stand for fields without a value.
        let text = text.trim_matches(' ').to_owned();
        let delimiter = Delimiter::of_row(&text);
        Self {
            number: line.number,
            is_comment: line.comment().is_some(),
            delimiter,
            fields: delimiter.fields(&text),
            text,
        }
    }

    /// The fields if their number matches, with any delimiter; an empty field at the end is ignored.
    fn fields(&self, delimiter: Delimiter, count: usize) -> Option<Vec<String>> {
        let fits = |mut fields: Vec<String>| {
            if fields.len() == count + 1 {
                fields.pop_if(|last| last.is_empty());
            }
            (fields.len() == count).then_some(fields)
        };
        // The words of a sentence are not fields.
        let is_sentence = self.delimiter == Delimiter::Blanks;
        let own = || {
            self.fields
                .clone()
                .ok()
                .filter(|_| !is_sentence)
                .and_then(fits)
        };
        delimiter
            .fields(&self.text)
            .ok()
            .and_then(fits)
            .or_else(own)
    }

    /// A line with the same number of words, for names or units.
    fn words(&self, delimiter: Delimiter, count: usize) -> Option<Vec<String>> {
        let fields = self.fields(delimiter, count)?;
        let filled = fields.iter().filter(|field| !field.is_empty()).count();
        let are_words = 2 * filled >= count && !fields.iter().any(|field| is_number(field));
        are_words.then_some(fields)
    }

    fn field(&self, column: usize) -> Option<&str> {
        self.fields.as_ref().ok()?.get(column).map(String::as_str)
    }

    fn malformed(&self) -> Option<Stop> {
        let what = *self.fields.as_ref().err()?;
        Some(Stop::Malformed {
            line: self.number,
            what,
        })
    }
}

/// The shape that most rows have.
struct Shape {
    delimiter: Delimiter,
    /// Whether a column holds numbers.
    numbers: Vec<bool>,
}

impl Shape {
    /// The shape is taken from the last rows, because names may be among the first; a last column that is always empty
    /// must have a name.
    fn of(rows: &[&Look], all: &[Look]) -> Option<Self> {
        let rows = &rows[rows.len() - ROWS.min(rows.len().div_ceil(2))..];
        // The separator is common to the rows and separates numbers; a note may contain other separators.
        let mut shapes = BTreeMap::<_, (usize, usize)>::new();
        let own = rows.iter().map(|row| row.delimiter);
        let delimiters = own.chain([b',', b';', b'\t'].map(Delimiter::Byte));
        let delimiters: BTreeSet<Delimiter> = delimiters.collect();
        let pairs = delimiters.into_iter();
        for (delimiter, row) in pairs.flat_map(|of| rows.iter().map(move |row| (of, row))) {
            if let Ok(fields) = delimiter.fields(&row.text) {
                let (rows, numbers) = shapes.entry((delimiter, fields.len())).or_default();
                *rows += 1;
                *numbers += fields.iter().filter(|field| is_number(field)).count();
            }
        }
        let most = shapes
            .into_iter()
            .max_by_key(|((delimiter, columns), (rows, numbers))| {
                // Blanks may stand within a field, as in a date.
                let is_byte = *delimiter != Delimiter::Blanks;
                (*columns > 1, *rows, *numbers, is_byte)
            });
        let ((delimiter, mut columns), _) = most?;
        let rows = rows.iter().filter_map(|row| row.fields(delimiter, columns));
        let rows: Vec<Vec<String>> = rows.collect();
        let ends_empty = |fields: &Vec<String>| fields.last().is_some_and(String::is_empty);
        let mut names = all.iter().filter_map(|look| look.words(delimiter, columns));
        if columns > 1 && rows.iter().all(ends_empty) && names.all(|names| ends_empty(&names)) {
            columns -= 1;
        }
        let are_numbers = |column: usize| {
            let filled = rows
                .iter()
                .map(|row| &row[column])
                .filter(|field| !field.is_empty());
            let numbers = filled.clone().filter(|field| is_number(field)).count();
            numbers > 0 && 2 * numbers >= filled.count()
        };
        let numbers = (0..columns).map(are_numbers).collect();
        Some(Self { delimiter, numbers })
    }

    /// The fields of a line with numbers in the same columns as rows, and the same number of columns.
    fn row(&self, look: &Look) -> Option<Vec<String>> {
        let fields = look
            .fields(self.delimiter, self.numbers.len())
            .filter(|_| !look.is_comment)?;
        let mut numbers = fields
            .iter()
            .zip(&self.numbers)
            .filter(|(field, is_number)| **is_number && !field.is_empty());
        let has_some = numbers.clone().next().is_some();
        (has_some && numbers.all(|(field, _)| is_number(field))).then_some(fields)
    }
}

/// Names and units, and the number of lines that they occupy.
struct Named {
    names: Vec<String>,
    units: Option<Vec<String>>,
    line: u64,
    above: usize,
    /// Remark on a row above the others that is incomplete.
    cut: Option<String>,
}

impl Looks {
    pub fn of<'a>(lines: impl Iterator<Item = &'a Line>) -> Self {
        Self(lines.map(Look::of).collect())
    }

    /// The samples of a labelled stream, and the other lines.
    pub fn of_stream<'a>(
        lines: impl Iterator<Item = &'a Line>,
        labelled: &Labelled,
        stream: &Stream,
    ) -> Self {
        let mut sample = Sample::default();
        let looks = lines.filter_map(|line| {
            let mut text = line.text.clone();
            match sample.add(labelled, stream, &mut text) {
                Added::Complete => {
                    let text = text_of(&text);
                    Some(Look {
                        number: line.number,
                        is_comment: false,
                        delimiter: Delimiter::Byte(SEPARATOR),
                        fields: Delimiter::Byte(SEPARATOR).fields(&text),
                        text,
                    })
                }
                Added::Part | Added::Other => None,
                Added::Nothing => Some(Look::of(line)),
            }
        });
        Self(looks.collect())
    }

    /// Heading of all rows, of the rows with a tag, or of the samples of a labelled stream; `None` for a file without
    /// rows.
    pub fn heading(
        &self,
        tag: Option<(&Tags, &str)>,
        labelled: Option<&Stream>,
    ) -> Result<Option<Heading>, Stop> {
        let is_of_tag =
            |look: &&Look| tag.is_none_or(|(tags, tag)| look.field(tags.column) == Some(tag));
        let rows: Vec<&Look> = self
            .0
            .iter()
            .filter(|look| !look.is_comment)
            .filter(is_of_tag)
            .collect();
        let Some(shape) = Shape::of(&rows, &self.0) else {
            return rows
                .iter()
                .find_map(|row| row.malformed())
                .map_or(Ok(None), Err);
        };
        let is_row = |look: &Look| is_of_tag(&look) && shape.row(look).is_some();
        let first = self.0.iter().position(is_row).unwrap_or(self.0.len());
        let Named {
            names,
            units,
            line,
            above,
            cut,
        } = self
            .of_labels(labelled, first)
            .map_or_else(|| self.named(&shape, first, tag), Ok)?;
        let above = if labelled.is_some() { 0 } else { above };
        let rows: Vec<Vec<String>> = rows.iter().filter_map(|row| shape.row(row)).collect();
        let clocks = clocks(&rows, shape.numbers.len());
        let says = self
            .0
            .iter()
            .enumerate()
            .filter(|(k, look)| look.is_comment || *k < above);
        let says: Vec<&str> = says.map(|(_, look)| look.text.as_str()).collect();
        let of_clocks = clocks.iter().zip(&names);
        let of_clocks = of_clocks.filter_map(|(clock, name)| clock.as_ref()?.remark(name));
        let remarks = of_clocks.chain(orientation(&says)).chain(cut).collect();
        Ok(Some(Heading {
            delimiter: shape.delimiter,
            numbers: shape.numbers,
            units: units_with(units, &names, &clocks, &says),
            names,
            line,
            clocks,
            rate: says
                .iter()
                .find_map(|remark| rate(remark).or(lone_rate(remark))),
            remarks,
            above,
            rows: rows.len(),
        }))
    }

    /// The names of values according to the words next to them, if there are any.
    fn of_labels(&self, labelled: Option<&Stream>, first: usize) -> Option<Named> {
        let stream = labelled.filter(|of| of.names.iter().any(|name| !name.is_empty()))?;
        let names = stream.names.iter().zip(1..);
        let own = |(name, k): (&String, usize)| match &**name {
            "" => k.to_string(),
            _ => name.clone(),
        };
        Some(Named {
            names: names.map(own).collect(),
            units: Some(stream.units.clone()),
            line: self.0.get(first).map_or(0, |look| look.number),
            above: 0,
            cut: None,
        })
    }

    /// The line of column names above this row, and its position.
    fn named(
        &self,
        shape: &Shape,
        first: usize,
        tag: Option<(&Tags, &str)>,
    ) -> Result<Named, Stop> {
        let Self(looks) = self;
        let words = |k: usize| looks[k].words(shape.delimiter, shape.numbers.len());
        let is = |k: &usize, fits: fn(&Tags, &str, &str) -> bool| {
            let of_tag =
                |words: Vec<String>| tag.map(|(tags, tag)| fits(tags, tag, &words[tags.column]));
            words(*k).and_then(of_tag)
        };
        let is_own = |k: &usize| is(k, |_, tag, word| tag == word) == Some(true);
        let own = tag.and_then(|_| (0..looks.len()).rfind(is_own));
        let is_shared = |k: &usize| {
            let is_other = is(k, |tags, _, word| {
                tags.names.iter().any(|name| name == word)
            });
            words(*k).is_some() && is_other != Some(true)
        };
        // The line immediately above the rows is the most likely heading, even if rows lack the field of a remark.
        let above = first.checked_sub(1).and_then(|above| looks.get(above));
        let columns = shape.numbers.len();
        let is_longer = above.is_some_and(|look| {
            let filled = look.words(shape.delimiter, columns + 1);
            !look.is_comment && filled.is_some_and(|of| of.iter().all(|word| !word.is_empty()))
        });
        if is_longer && own.is_none() {
            return self.unnamed(shape, first, tag.is_some());
        }
        if own.is_none()
            && let Some(named) = tag.and_then(|(tags, tag)| self.listed(tags, tag, columns))
        {
            return Ok(named);
        }
        let Some(last) = own.or_else(|| (0..first).rfind(is_shared)) else {
            return self.unnamed(shape, first, tag.is_some());
        };
        let is_comment = looks[last].is_comment;
        let goes_on =
            |k: &usize| own.is_none() && looks[*k].is_comment == is_comment && is_shared(k);
        let begin = (0..last).rev().take_while(goes_on).last().unwrap_or(last);
        let levels: Vec<Vec<String>> = (begin..=last).filter_map(words).collect();
        let (names, units) = names_and_units(&levels, is_comment);
        Ok(Named {
            names,
            units,
            line: looks[begin].number,
            above: if tag.is_some() { 0 } else { last + 1 },
            cut: None,
        })
    }

    /// The column names from a line that lists them behind the tag, as in logs that describe their own rows.
    fn listed(&self, tags: &Tags, tag: &str, columns: usize) -> Option<Named> {
        let is_word = |word: &String| word.starts_with(char::is_alphabetic);
        self.0.iter().find_map(|look| {
            let fields = look.fields.as_ref().ok()?;
            let behind = fields.iter().position(|field| field == tag)? + 1;
            let begin = (fields.len() + 1).checked_sub(columns)?;
            let words = fields.get(begin.max(behind)..)?;
            let is_list = tags.column == 0 && words.len() + 1 == columns;
            let are_names = is_list && behind > 1 && words.iter().all(is_word);
            are_names.then(|| Named {
                names: std::iter::once(tag)
                    .chain(words.iter().map(String::as_str))
                    .map(str::to_owned)
                    .collect(),
                units: None,
                line: look.number,
                above: 0,
                cut: None,
            })
        })
    }

    /// The column names if no line has as many words as rows have columns: numbers, unless the lines above are
    /// mismatched names or a mismatched row rather than a preamble.
    fn unnamed(&self, shape: &Shape, first: usize, is_tagged: bool) -> Result<Named, Stop> {
        let Self(looks) = self;
        let columns = shape.numbers.len();
        let numbered = |above: usize| Named {
            names: (1..=columns).map(|n| n.to_string()).collect(),
            units: None,
            line: looks.get(first).map_or(0, |look| look.number),
            above,
            cut: None,
        };
        let above = (0..first).rfind(|&k| !looks[k].is_comment && !is_tagged);
        let Some((above, look)) = above.map(|k| (k, &looks[k])) else {
            return Ok(numbered(first));
        };
        if let Some(stop) = look.malformed() {
            return Err(stop);
        }
        let fields = shape.delimiter.fields(&look.text).unwrap_or_default();
        let is_word = |field: &String| field.contains(char::is_alphanumeric) || field.is_empty();
        let is_near = fields.len() > 2
            && fields.iter().all(is_word)
            && (shape.delimiter != Delimiter::Blanks || fields.len().abs_diff(columns) < 2);
        let has_numbers = fields.iter().any(|field| is_number(field));
        Ok(match look.fields(shape.delimiter, columns) {
            None if !is_near => numbered(first),
            None if has_numbers => Named {
                cut: Some(format!(
                    "Line {} has {} fields, but the rows below it have {columns}. turncal omitted this line.",
                    look.number,
                    fields.len()
                )),
                ..numbered(first)
            },
            fitting => {
                let mut names = fitting.unwrap_or(fields);
                let is_longer = names.len() == columns + 1;
                let more = is_longer.then(|| names.pop()).flatten();
                Named {
                    names,
                    line: look.number,
                    cut: more.map(|more| {
                        format!(
                            "The rows have no field for the last name in line {}, `{more}`.",
                            look.number
                        )
                    }),
                    ..numbered(above + 1)
                }
            }
        })
    }

    /// Tags that distinguish several kinds of rows. Tags are words, or small numbers before a time, in rows that have
    /// different widths or too few columns for both triads.
    pub fn tags(&self) -> Option<Tags> {
        let rows = || {
            self.0
                .iter()
                .filter(|look| !look.is_comment)
                .filter_map(|look| look.fields.as_ref().ok())
        };
        (0..3).find_map(|column| {
            let mut kinds = BTreeMap::<&str, Vec<&Vec<String>>>::new();
            for row in rows() {
                let tag = row.get(column).map_or("", String::as_str);
                kinds.entry(tag).or_default().push(row);
            }
            kinds.retain(|_, rows| rows.len() > 1);
            let of_kinds: usize = kinds.values().map(Vec::len).sum();
            let is_word =
                |tag: &&str| tag.starts_with(|c: char| c.is_alphabetic()) && !is_number(tag);
            let is_digit = |tag: &&str| column == 0 && tag.len() == 1 && is_number(tag);
            let are_digits = kinds.keys().all(is_digit);
            let is_narrow = |rows: &Vec<&Vec<String>>| {
                rows[0].iter().filter(|field| is_number(field)).count()
                    < BOTH_TRIADS + usize::from(are_digits)
            };
            let width = kinds.values().next()?[0].len();
            let is_ragged = kinds.values().any(|rows| rows[0].len() != width);
            // Each kind has its own time; a label of a movement leaves the time of all rows as it is.
            let have_times = || {
                let all: Vec<_> = rows().filter(|row| row.len() == width).collect();
                !goes_on(&all) && kinds.values().all(|rows| goes_on(rows))
            };
            let are_kinds = (2..=MOST_TAGS).contains(&kinds.len())
                && 10 * of_kinds >= 9 * rows().count()
                && (kinds.keys().all(is_word)
                    || are_digits && kinds.values().all(|rows| goes_on(rows)))
                && (is_ragged || kinds.values().all(is_narrow) || have_times());
            are_kinds.then(|| Tags {
                column,
                names: kinds.into_keys().map(str::to_owned).collect(),
            })
        })
    }
}

/// Conversion of the text of each column to times.
fn clocks(rows: &[Vec<String>], columns: usize) -> Vec<Option<ClockText>> {
    let clock = |column: usize| {
        let texts = rows.iter().map(|row| row[column].as_str());
        let texts: Vec<&str> = texts.filter(|text| !text.is_empty()).collect();
        ClockText::of(&texts)
    };
    (0..columns).map(clock).collect()
}

/// Remark on an orientation stated in a preamble.
fn orientation(says: &[&str]) -> Option<String> {
    let letters = value(says, "orientation")?;
    Some(format!(
        "turncal did not apply the orientation {letters} that the file states; it used the columns unchanged."
    ))
}

/// Whether a column after the first increases in all rows.
fn goes_on(rows: &[&Vec<String>]) -> bool {
    (1..rows[0].len()).any(|column| {
        let number =
            |row: &&Vec<String>| row.get(column).and_then(|field| field.parse::<f64>().ok());
        let times: Option<Vec<f64>> = rows.iter().map(number).collect();
        times.is_some_and(|times| times.windows(2).all(|pair| pair[1] > pair[0]))
    })
}

/// Value of a key in a preamble line.
fn value<'a>(says: &[&'a str], key: &str) -> Option<&'a str> {
    says.iter().find_map(|line| {
        let (found, value) = line.split_once([',', ';', '=', ':', '\t'])?;
        (found.trim().eq_ignore_ascii_case(key)).then(|| value.trim())
    })
}

/// Units from a line of units, from clocks and from the scales stated in a preamble.
fn units_with(
    units: Option<Vec<String>>,
    names: &[String],
    clocks: &[Option<ClockText>],
    says: &[&str],
) -> Option<Vec<String>> {
    let is_said = units.is_some();
    let mut all = units.unwrap_or_else(|| vec![String::new(); names.len()]);
    for ((unit, clock), name) in all.iter_mut().zip(clocks).zip(names) {
        let begins = |(_, letter, _): &&(_, char, _)| name.starts_with(*letter);
        if clock.is_some() {
            CLOCK.clone_into(unit);
        } else if let Some((key, _, of)) = SCALES.iter().find(begins)
            && let Some(scale) = value(says, key)
        {
            *unit = format!("{scale} {of}");
        }
    }
    let has_some = all.iter().any(|unit| !unit.is_empty());
    (is_said || has_some).then_some(all)
}

/// The names in as many lines as needed to distinguish the columns, and the units in the next.
fn names_and_units(levels: &[Vec<String>], is_comment: bool) -> (Vec<String>, Option<Vec<String>>) {
    let levels = match levels {
        // Other comments may have as many words.
        [.., names, units] if is_comment && are_distinct(names) && !are_distinct(units) => {
            &levels[levels.len() - 2..]
        }
        _ if is_comment => &levels[levels.len() - 1..],
        _ => levels,
    };
    let says_something = |level: &&Vec<String>| level.iter().any(|name| *name != level[0]);
    for count in 1..=levels.len() {
        let of = levels[..count].iter().filter(says_something);
        let name = |column: usize| {
            let parts: Vec<&str> = of.clone().map(|level| level[column].as_str()).collect();
            parts.join(" ").trim().to_owned()
        };
        let names: Vec<String> = (0..levels[0].len()).map(name).collect();
        if are_distinct(&names) && names.iter().any(|name| !name.is_empty()) {
            return (names, levels.get(count).cloned());
        }
    }
    (levels[0].clone(), levels.get(1).cloned())
}

/// Whether each word names one column; units of two columns are often equal.
fn are_distinct(names: &[String]) -> bool {
    let mut sorted: Vec<&str> = names.iter().map(String::as_str).collect();
    sorted.retain(|name| !name.is_empty());
    sorted.sort_unstable();
    sorted.windows(2).all(|pair| pair[0] != pair[1])
}

/// The rate in Hz from a line such as `Update Rate: 100.0Hz` or `sampling rate,100`.
fn rate(remark: &str) -> Option<f64> {
    let remark = remark.to_lowercase();
    let key = || remark.strip_prefix("fs").map(|rest| ("sample", rest));
    let named = remark.split_once("rate").or(remark.split_once("freq"));
    let (before, rest) = named.or_else(key)?;
    let begin = rest.find(|c: char| c.is_ascii_digit())?;
    let number = &rest[begin..];
    let end = number.find(|c: char| !c.is_ascii_digit() && c != '.');
    let (number, unit) = number.split_at(end.unwrap_or(number.len()));
    let unit = unit.trim_matches(|c: char| !c.is_alphanumeric());
    let is_of_rows = || {
        ["sampl", "output", "update", "data"]
            .iter()
            .any(|word| before.contains(word))
    };
    let in_hertz =
        unit.starts_with("hz") || rest[..begin].contains("hz") || unit.is_empty() && is_of_rows();
    let rate = number.parse().ok().filter(|rate| *rate > 0.0);
    rate.filter(|_| in_hertz)
}

/// A number alone in its line above the rows, if it can be a rate in Hz.
fn lone_rate(remark: &str) -> Option<f64> {
    let rate = remark.parse().ok()?;
    (5.0..=5000.0).contains(&rate).then_some(rate)
}

/// A text in UTF-8, otherwise in Latin 1 (the first 256 characters of Unicode).
fn text_of(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&byte| char::from(byte)).collect(),
    }
}

/// Whether a field is a number, with a point or a comma.
fn is_number(field: &str) -> bool {
    // A comma after the last digit separates fields.
    !field.ends_with(',') && (field.parse::<f64>().is_ok() || other_number(field).is_some())
}

/// A number with a decimal comma, or with an exponent as in Fortran.
pub fn other_number(text: &str) -> Option<f64> {
    let is_digit = |c: char| c.is_ascii_digit() || "+-.,dDeE".contains(c);
    let has_digit = text.contains(|c: char| c.is_ascii_digit());
    (has_digit && text.chars().all(is_digit)).then_some(())?;
    let text = text.replacen(',', ".", 1).replacen(['d', 'D'], "e", 1);
    text.parse().ok()
}

/// Field separator of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Delimiter {
    /// A single byte.
    Byte(u8),
    /// Fields are separated by any number of spaces and tabs.
    Blanks,
}

impl Delimiter {
    /// The separator used in a first row.
    pub fn of_row(row: &str) -> Self {
        let blanks = Self::Blanks.fields(row).unwrap_or_default();
        if blanks.len() > 1 && blanks.iter().all(|field| is_number(field)) {
            return if row.contains('\t') && !row.contains(' ') {
                Self::Byte(b'\t')
            } else {
                Self::Blanks
            };
        }
        // A comma followed by a tab counts as a comma.
        let parts = |byte: &u8| match Self::Byte(*byte).fields(row) {
            _ if !row.as_bytes().contains(byte) => false,
            Ok(fields) => {
                fields.iter().filter(|field| !field.is_empty()).count() > 1
                    && !(*byte == b'\t' && fields.iter().any(|f| f.ends_with(',')))
            }
            // The code that reads the row with this separator reports the fault.
            Err(_) => true,
        };
        let byte = [b';', b'\t', b','].into_iter().find(parts);
        // A single column has no delimiter.
        byte.map_or(
            match blanks.len() {
                0 | 1 => Self::Byte(b','),
                _ => Self::Blanks,
            },
            Self::Byte,
        )
    }

    /// The byte that separates fields in the returned lines.
    pub fn byte(self) -> u8 {
        match self {
            Self::Byte(byte) => byte,
            Self::Blanks => b' ',
        }
    }

    /// Whether a comma can be part of a number.
    pub fn leaves_commas(self) -> bool {
        self.byte() != b','
    }

    /// Reduces the delimiters between two fields to one.
    pub fn tidy(self, line: &mut Vec<u8>) {
        if self == Self::Blanks {
            collapse_blanks(line);
        }
    }

    /// The fields of one row, without quotes and blanks around them.
    fn fields(self, line: &str) -> Result<Vec<String>, Malformed> {
        let mut text = line.as_bytes().to_vec();
        self.tidy(&mut text);
        let name = |field: &[u8]| {
            let text = String::from_utf8_lossy(field);
            text.trim().trim_matches('"').trim().to_owned()
        };
        let mut row = Row::new(self.byte());
        row.split(&text)?;
        Ok(row.fields().map(name).collect())
    }
}

/// Replaces runs of blanks outside quotes by one space and trims the ends.
fn collapse_blanks(line: &mut Vec<u8>) {
    let (mut quoted, mut kept, mut pending) = (false, 0, false);
    for at in 0..line.len() {
        let byte = line[at];
        if !quoted && byte.is_ascii_whitespace() {
            pending = kept > 0;
            continue;
        }
        quoted ^= byte == b'"';
        if pending {
            line[kept] = b' ';
            kept += 1;
            pending = false;
        }
        line[kept] = byte;
        kept += 1;
    }
    line.truncate(kept);
}
