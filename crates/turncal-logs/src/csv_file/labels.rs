//! Names and units of the values of a line, from the words next to them.

use super::marks::{MARK, WORD};

/// Longest name of a value.
const LONGEST_NAME: usize = 32;

/// Label of a value.
#[derive(Default)]
pub struct Label {
    /// Words before it, without signs at their ends.
    pub words: String,
    pub unit: String,
    /// Axis at the end of the words.
    pub axis: Option<char>,
    /// Whether the value only increases, as time stamps do.
    pub increases: bool,
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

/// The label of each value of a line.
pub fn labels(shape: &[u8]) -> Vec<Label> {
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

/// Names and units of values. An axis alone belongs to the words before the last one; words before three values name
/// their axes, after a time or not.
pub fn named(labels: &[Label]) -> Vec<(String, String)> {
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
