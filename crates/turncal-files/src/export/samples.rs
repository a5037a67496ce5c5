//! Calibrated samples as a CSV file.

use std::io::{self, Write};
use std::ops::Range;
use std::path::Path;

use rayon::prelude::*;

use crate::{write_rows, write_whole_with};
use turncal::calibration::Correction;
use turncal::recording::nanoseconds;
use turncal::run::Run;
use turncal_input::FileError;

/// Start and end of a sample, angular rate and specific force along right, front and up.
pub const HEADER: &str = "start_s,end_s,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,\
                          accel_y_m_s2,accel_z_m_s2";

/// Usual length of a row, bytes.
const ROW_LENGTH: usize = 176;
/// Rows that one task turns into text.
const ROWS: usize = 4096;
/// Tasks before their text is written.
const TASKS: usize = 64;

/// Writes one row per log row, with [`HEADER`] first; for a temperature-dependent calibration, `in_range` states
/// whether it is valid at the temperature of the row. A row contains means over its sample, so the output is a log with
/// `output = "rate"` in `rad/s` and `m/s^2`.
///
/// With `fill`, missing samples are also written, interpolated, with 1 in a last column `filled`.
pub fn sample_rows(
    file: &mut dyn Write,
    correction: &Correction,
    run: &Run,
    fill: bool,
) -> io::Result<()> {
    let in_range = if correction.changes() {
        ",in_range"
    } else {
        ""
    };
    let filled = if fill { ",filled" } else { "" };
    writeln!(file, "{HEADER}{in_range}{filled}")?;
    let (samples, lost) = (run.recording.imu.len(), run.recording.imu.lost());
    let parts: Vec<Range<usize>> = (0..samples)
        .step_by(ROWS)
        .map(|first| first..samples.min(first + ROWS))
        .collect();
    for parts in parts.chunks(TASKS) {
        let texts = parts
            .par_iter()
            .map(|part| rows(correction, run, part.clone(), &lost, fill));
        for text in texts.collect::<Vec<_>>() {
            file.write_all(&text)?;
        }
    }
    Ok(())
}

/// The rows of some samples.
fn rows(
    correction: &Correction,
    run: &Run,
    samples: Range<usize>,
    lost: &[Range<usize>],
    fill: bool,
) -> Vec<u8> {
    let mut text = Vec::with_capacity(samples.len() * ROW_LENGTH);
    let mut lost = lost[lost.partition_point(|lost| lost.end <= samples.start)..]
        .iter()
        .peekable();
    for (k, sample) in samples.clone().zip(correction.samples(run, samples)) {
        while lost.next_if(|lost| lost.end <= k).is_some() {}
        let is_lost = lost.peek().is_some_and(|lost| lost.contains(&k));
        if is_lost && !fill {
            continue;
        }
        push_plain(&mut text, nanoseconds(sample.start));
        text.push(b',');
        push_plain(&mut text, nanoseconds(sample.end));
        for &value in sample.rate.iter().chain(&sample.force) {
            text.push(b',');
            push_scientific(&mut text, value);
        }
        if correction.changes() {
            text.extend([b',', b'0' + u8::from(sample.in_range)]);
        }
        if fill {
            text.extend([b',', b'0' + u8::from(is_lost)]);
        }
        text.push(b'\n');
    }
    text
}

/// Appends a number without exponent, as `{}` writes it.
fn push_plain(text: &mut Vec<u8>, value: f64) {
    let mut buffer = zmij::Buffer::new();
    let digits = buffer.format(value);
    if digits.contains('e') {
        text.extend(value.to_string().bytes());
    } else {
        text.extend(digits.strip_suffix(".0").unwrap_or(digits).bytes());
    }
}

/// Appends a number with one digit before the point and an exponent, as `{:e}` writes it.
fn push_scientific(text: &mut Vec<u8>, value: f64) {
    let mut buffer = zmij::Buffer::new();
    let digits = buffer.format(value);
    let (sign, digits) = digits.split_at(usize::from(digits.starts_with('-')));
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let significant = fraction.trim_start_matches('0');
    let (digits, exponent) = match whole {
        _ if fraction.is_empty() || fraction.contains('e') => {
            text.extend(format!("{value:e}").bytes());
            return;
        }
        "0" if significant.is_empty() => ([whole, ""], 0),
        "0" => (
            [significant, ""],
            significant.len() as i32 - fraction.len() as i32 - 1,
        ),
        _ => ([whole, fraction], whole.len() as i32 - 1),
    };
    text.extend(sign.bytes());
    let start = text.len();
    text.extend(digits.into_iter().flat_map(str::bytes));
    while text.len() > start + 1 && text.ends_with(b"0") {
        text.pop();
    }
    if text.len() > start + 1 {
        text.insert(start + 1, b'.');
    }
    text.extend(format!("e{exponent}").bytes());
}

/// The same into a complete file, compressed if its name ends in `.gz`; an existing file is replaced only with `force`.
pub fn write_samples(
    path: &Path,
    correction: &Correction,
    run: &Run,
    fill: bool,
    force: bool,
) -> Result<(), FileError> {
    write_whole_with(path, force, |file| {
        write_rows(path, file, |rows| sample_rows(rows, correction, run, fill))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_rust_writes_them() {
        let mut bits = 1u64;
        let random = std::iter::repeat_with(|| {
            bits = bits
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            f64::from_bits(bits ^ bits >> 31)
        });
        let usual = (1..20_000).map(|k| f64::from(k).powi(3) * 1.1e-12);
        let whole = [
            0.0, 1.0, 10.0, 9.5, 12_300.0, 1e15, 1e16, 1e22, 1e23, 0.1, 1e-4, 1e-5, 1e-6, 5e-324,
        ];
        let special = [f64::NAN, f64::INFINITY, f64::MAX, f64::MIN_POSITIVE];
        for value in random.take(20_000).chain(usual).chain(whole).chain(special) {
            for value in [value, -value] {
                let mut text = Vec::new();
                push_scientific(&mut text, value);
                text.push(b' ');
                push_plain(&mut text, value);
                assert_eq!(
                    String::from_utf8(text).unwrap(),
                    format!("{value:e} {value}")
                );
            }
        }
    }
}
