//! Names and units of the columns, from the lines above the rows.

use super::delimiter::{Delimiter, is_number};
use super::lines::Stop;
use super::look::{Layout, Looks};
use super::shape::Stream;
use super::tags::Tags;

/// Names and units, and the number of lines that they occupy.
pub struct Named {
    pub names: Vec<String>,
    pub units: Option<Vec<String>>,
    pub line: u64,
    pub above: usize,
    /// Remark on a row above the others that is incomplete.
    pub cut: Option<String>,
}

impl Looks {
    /// The names of values according to the words next to them, if there are any.
    pub fn of_labels(&self, labelled: Option<&Stream>, first: usize) -> Option<Named> {
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
    pub fn named(
        &self,
        layout: &Layout,
        first: usize,
        tag: Option<(&Tags, &str)>,
    ) -> Result<Named, Stop> {
        let Self(looks) = self;
        let words = |k: usize| looks[k].words(layout.delimiter, layout.numbers.len());
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
        let columns = layout.numbers.len();
        let is_longer = above.is_some_and(|look| {
            let filled = look.words(layout.delimiter, columns + 1);
            !look.is_comment && filled.is_some_and(|of| of.iter().all(|word| !word.is_empty()))
        });
        if is_longer && own.is_none() {
            return self.unnamed(layout, first, tag.is_some());
        }
        if own.is_none()
            && let Some(named) = tag.and_then(|(tags, tag)| self.listed(tags, tag, columns))
        {
            return Ok(named);
        }
        let Some(last) = own.or_else(|| (0..first).rfind(is_shared)) else {
            return self.unnamed(layout, first, tag.is_some());
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
    fn unnamed(&self, layout: &Layout, first: usize, is_tagged: bool) -> Result<Named, Stop> {
        let Self(looks) = self;
        let columns = layout.numbers.len();
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
        let fields = layout.delimiter.fields(&look.text).unwrap_or_default();
        let is_word = |field: &String| field.contains(char::is_alphanumeric) || field.is_empty();
        let is_near = fields.len() > 2
            && fields.iter().all(is_word)
            && (layout.delimiter != Delimiter::Blanks || fields.len().abs_diff(columns) < 2);
        let has_numbers = fields.iter().any(|field| is_number(field));
        Ok(match look.fields(layout.delimiter, columns) {
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
