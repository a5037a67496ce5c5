//! An export file under construction: comments, omissions, numbers.

use super::Exported;
use super::source::{Axes, Held, Remainder, Source};
use crate::imu::{PerSensor, Sensor, Term};

/// Omission of nearly every format.
pub const SIGMA: &str = "sigma and covariance of the parameters; they are in calibration.json";

pub const TEST_VECTORS: &str =
    "test vectors, raw -> calibrated, gyros x y z, accelerometers x y z:";

/// A file under construction.
pub struct Document {
    mark: &'static str,
    text: String,
    notes: Vec<String>,
}

impl Document {
    /// Starts with the lines common to all formats. `notes` names everything that this format cannot represent, except
    /// error terms: those for which `held` is false are added here.
    pub fn holding(
        source: &Source,
        mark: &'static str,
        notes: impl IntoIterator<Item = impl Into<String>>,
        held: fn(Term) -> bool,
    ) -> Self {
        let notes = notes.into_iter().map(Into::into);
        let mut document = Self::new(source, mark, notes.chain(source.terms_note(held)));
        for line in source.term_lines(|term| !held(term)) {
            document.comment(&line);
        }
        document
    }

    /// The same for a format without error terms.
    pub fn new(
        source: &Source,
        mark: &'static str,
        notes: impl IntoIterator<Item = impl Into<String>>,
    ) -> Self {
        let mut document = Self {
            mark,
            text: String::new(),
            notes: notes.into_iter().map(Into::into).collect(),
        };
        for line in source.about() {
            document.comment(&line);
        }
        for note in document.notes.clone() {
            document.comment(&format!("not included: {note}"));
        }
        document
    }

    /// Starts a file for a program that computes `matrix (n − offset)` for both triads, and states the residual error
    /// and other omissions.
    pub fn correcting(
        source: &Source,
        axes: &Axes,
        (mark, reads): (&'static str, &str),
        held: &PerSensor<Held>,
        notes: &[&str],
    ) -> Self {
        let left = Sensor::ALL.map(|sensor| Remainder::of(sensor, axes, held.get(sensor)));
        let left: Vec<Remainder> = left.into_iter().filter(|left| !left.is_none()).collect();
        let notes = notes.iter().copied().chain([SIGMA]).map(str::to_owned);
        let notes = left.iter().map(Remainder::words).chain(notes);
        let mut document = Self::holding(source, mark, notes, |_| false);
        axes.introduce(&mut document, reads);
        left.iter().for_each(|left| left.lines(&mut document));
        document
    }

    /// Starts a code file: it corrects K, E and D, and lists terms and test vectors in comments.
    pub fn of_code(source: &Source, mark: &'static str) -> Self {
        let mut document = Self::holding(source, mark, [SIGMA], |_| false);
        let vectors = source.test_vectors();
        if !vectors.is_empty() {
            document.comment("");
            document.comment(TEST_VECTORS);
            vectors.iter().for_each(|line| document.comment(line));
        }
        document
    }

    /// A one-line comment for any text, because names and warnings come from files.
    pub fn comment(&mut self, line: &str) {
        let breaks = |c: char| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}');
        let line = line.replace(breaks, " ");
        let line = line.trim_end();
        self.text += self.mark;
        if !line.is_empty() {
            self.text.push(' ');
            self.text += line;
        }
        // In C a backslash at the end, or its trigraph ??/, would take the next line in.
        if line.ends_with(['\\', '/']) {
            self.text.push('.');
        }
        self.text.push('\n');
    }

    pub fn line(&mut self, line: &str) {
        self.text += line;
        self.text.push('\n');
    }

    /// A line before all others.
    pub fn begin(&mut self, line: &str) {
        self.text.insert_str(0, &format!("{line}\n"));
    }

    /// Encloses the text so far in these comment delimiters.
    pub fn enclose(&mut self, open: &str, close: &str) {
        self.text = format!("{open}\n{}{close}\n", self.text.replace("--", "- -"));
    }

    pub fn finish(self) -> Exported {
        Exported {
            bytes: self.text.into_bytes(),
            notes: self.notes,
        }
    }
}

/// A number in YAML 1.1 syntax, with a decimal point and a signed exponent.
pub fn yaml_number(value: f64) -> String {
    let text = format!("{:e}", value + 0.0);
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let point = if mantissa.contains('.') { "" } else { ".0" };
    let sign = if exponent.starts_with('-') { "" } else { "+" };
    format!("{mantissa}{point}e{sign}{exponent}")
}

/// Three numbers as a YAML list.
pub fn yaml_list<'a>(values: impl IntoIterator<Item = &'a f64>) -> String {
    let values: Vec<String> = values.into_iter().map(|&v| yaml_number(v)).collect();
    format!("[{}]", values.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_floats_of_yaml_1_1_and_keep_every_bit() {
        for (value, text) in [
            (0.0, "0.0e+0"),
            (-0.0, "0.0e+0"),
            (2e6, "2.0e+6"),
            (-1.5e-7, "-1.5e-7"),
            (0.1, "1.0e-1"),
        ] {
            assert_eq!(yaml_number(value), text);
        }
        for value in [std::f64::consts::PI, 1e-300 / 3.0, 2e300 / 7.0] {
            assert_eq!(yaml_number(value).parse(), Ok(value));
        }
    }
}
