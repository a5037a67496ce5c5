//! Numbers and comments in the notation of a format.

use nalgebra::{Dim, Matrix, RawStorage};

/// Any text as a comment of one line; names and warnings come from files and may contain line breaks.
pub fn comment(mark: &str, line: &str) -> String {
    let breaks = |c: char| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}');
    let line = line.replace(breaks, " ");
    let line = line.trim_end();
    let blank = if line.is_empty() { "" } else { " " };
    // In C, a backslash at the end (or its trigraph ??/) would continue the comment on the next line.
    let end = if line.ends_with(['\\', '/']) { "." } else { "" };
    format!("{mark}{blank}{line}{end}\n")
}

/// Numbers with full precision.
pub fn numbers<'a>(values: impl IntoIterator<Item = &'a f64>) -> String {
    let values: Vec<String> = values.into_iter().map(|v| format!("{v:e}")).collect();
    values.join(", ")
}

/// A number in YAML 1.1 syntax, with a decimal point and a signed exponent.
pub fn number(value: f64) -> String {
    let text = format!("{:e}", value + 0.0);
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let point = if mantissa.contains('.') { "" } else { ".0" };
    let sign = if exponent.starts_with('-') { "" } else { "+" };
    format!("{mantissa}{point}e{sign}{exponent}")
}

/// Numbers as a YAML list.
pub fn list<'a>(values: impl IntoIterator<Item = &'a f64>) -> String {
    let values: Vec<String> = values.into_iter().map(|&v| number(v)).collect();
    format!("[{}]", values.join(", "))
}

/// A matrix as a YAML list of rows, one line each, indented by `indent`; for OpenCV, the indentation must be deeper
/// than that of the key.
pub fn rows<R: Dim, C: Dim>(
    indent: usize,
    matrix: &Matrix<f64, R, C, impl RawStorage<f64, R, C>>,
) -> String {
    let rows = matrix.row_iter();
    rows.map(|row| format!("\n{:indent$}- {}", "", list(row.iter())))
        .collect()
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
            assert_eq!(number(value), text);
        }
        for value in [std::f64::consts::PI, 1e-300 / 3.0, 2e300 / 7.0] {
            assert_eq!(number(value).parse(), Ok(value));
        }
    }
}
