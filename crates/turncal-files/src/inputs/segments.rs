//! The file of labelled sections.

use turncal::imu::AxisOrder;
use turncal::recording::{ImuSamples, LabelledMotion, Segment};
use turncal_input::FileError;
use turncal_logs::{DataFile, Source};

/// Reads the sections of a run with these samples, with stamps `lag` samples after their start; `notes` receives
/// remarks about the file.
pub fn read(
    file: &DataFile,
    imu: &ImuSamples,
    lag: f64,
    axes: AxisOrder,
    notes: &mut Vec<String>,
) -> Result<Vec<Segment>, FileError> {
    let mut csv = Source::of_file(file.clone()).open()?;
    let start_column = csv.column("start")?;
    let end_column = csv.column("end")?;
    let label_column = csv.column("label")?;
    let record = (imu.start(), imu.end());
    // Stamps may refer to either end of a sample, so borders can be off by one sample; they are also rounded.
    let slack = 1.5 * imu.period;
    // The first row at or after a time, with a tolerance because printed times are rounded.
    let row = |time: f64| {
        let row = (imu.edge(time) - lag - 0.01).ceil();
        (row.max(0.0) as usize).min(imu.len())
    };
    let mut segments = Vec::new();
    while csv.advance()? {
        let start = csv.number(start_column)?;
        let end = csv.number(end_column)?;
        let wrong = |found: &str, expected: String| {
            let found = format_args!("{found} from {start} s to {end} s");
            Err(csv.error_here(found, expected, "Correct or remove the row."))
        };
        if end <= start {
            return wrong("a segment", "an end later than the start".to_owned());
        }
        let (first, last) = record;
        if start < first - slack || end > last + slack {
            let expected = format!("times within the IMU log ({first} s to {last} s)");
            return wrong("a segment", expected);
        }
        if row(start) == row(end) {
            let period = imu.period;
            let expected = format!("a segment with several samples (sample period {period} s)");
            return wrong("no sample", expected);
        }
        let label = csv.text(label_column)?.into_owned();
        segments.push(Segment {
            start,
            end,
            samples: row(start)..row(end),
            motion: LabelledMotion::of_label(&label, axes),
            label,
        });
    }
    // A label without letters is not a label; this is reported elsewhere.
    notes.extend(csv.left_out());
    let cut_off = csv.cut_off("turncal used it");
    notes.extend(cut_off.filter(|_| label_column + 1 != csv.header().len()));
    Ok(segments)
}
