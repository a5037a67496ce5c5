//! The path: where the body axes point and how fast the body turns.

use nalgebra::Matrix3;
use plotters::style::text_anchor::{HPos, VPos};

use super::axis::Axis;
use super::canvas::{Area, DrawError, Pen, QUIET, envelope, write};
use super::panel::{Margins, Panel};
use super::{Figure, Report, ReportError};
use crate::imu::AXES;
use crate::recording::{ImuSamples, TableLog};
use crate::units::DEGREE;

const POINTS: usize = 1200;
const HEIGHT: u32 = 240;
const MARGINS: Margins = Margins {
    left: 52.0,
    right: 50.0,
};
/// Nearer to the plumb line than this an axis has no azimuth worth drawing.
const STEEP: f64 = 80.0 * DEGREE;
/// Dwells beyond this number would not leave room for theirs.
const NUMBERED: usize = 60;

type Line = Vec<(f64, f64)>;

/// Elevation and azimuth of the body axes from the table, and body rates from the gyros.
pub(super) fn figure(report: &Report) -> Result<Figure, ReportError> {
    let table = report.table();
    let mut caption = String::from(
        "Rates are the raw gyro outputs about the body axes. Grey: dwells, \
         numbered where there is room.",
    );
    if table.is_some() {
        caption.insert_str(
            0,
            "Elevation of each body axis above the horizon and its azimuth clockwise from North, as \
             the turntable reads them. Unlike heading, pitch and roll these are never singular; an \
             axis has no azimuth while it is within 10° of the plumb line. ",
        );
    }
    let mut panels: Vec<(&str, Axis, [Vec<Line>; 3])> = Vec::new();
    if let Some(table) = table {
        panels.push((
            "elevation of the body axes, °",
            Axis::stepped(-95.0, 120.0, 45.0),
            [0, 1, 2].map(|axis| elevation(table, axis)),
        ));
        panels.push((
            "azimuth of the body axes, °",
            Axis::stepped(-190.0, 240.0, 90.0),
            [0, 1, 2].map(|axis| azimuth(table, axis)),
        ));
    }
    let rates = [0, 1, 2].map(|axis| rate(&report.run.recording.imu, axis));
    let (low, high) = rates
        .iter()
        .flatten()
        .flatten()
        .filter(|point| point.1.is_finite())
        .fold((0.0, 0.0), |(low, high): (f64, f64), point| {
            (low.min(point.1), high.max(point.1))
        });
    let span = high - low;
    let axis = Axis::linear(low - 0.05 * span, high + 0.15 * span);
    panels.push(("rate about the body axes, °/s", axis, rates));

    let size = (1200, HEIGHT * panels.len() as u32);
    Figure::draw("path.svg", "Path", caption, size, |area| {
        let areas = area.split_evenly((panels.len(), 1));
        for ((title, y, lines), area) in panels.into_iter().zip(areas) {
            draw_panel(report, &area, title, y, lines)?;
            number_dwells(report, &area)?;
        }
        Ok(())
    })
}

fn draw_panel(
    report: &Report,
    area: &Area,
    title: &str,
    y: Axis,
    lines: [Vec<Line>; 3],
) -> Result<(), DrawError> {
    let (start, end) = report.time_span();
    let x = Axis::linear(start, end);
    let mut panel = Panel::new(area, title, MARGINS, (x, y), "time, s", report.dwells)?;
    for (axis, pieces) in lines.into_iter().enumerate() {
        let pen = Pen::axis(axis);
        let count: usize = pieces.iter().map(Vec::len).sum();
        for piece in &pieces {
            let share = POINTS * piece.len() / count.max(1);
            panel.line(&envelope(piece, share), pen)?;
        }
        if let Some(last) = pieces.last().and_then(|piece| piece.last()) {
            panel.label(last.1, AXES[axis], pen.color);
        }
    }
    panel.finish()
}

fn number_dwells(report: &Report, area: &Area) -> Result<(), DrawError> {
    if report.dwells.len() > NUMBERED {
        return Ok(());
    }
    let (start, end) = report.time_span();
    let width = f64::from(area.dim_in_pixel().0) / f64::from(super::canvas::px(1.0));
    let width = width - MARGINS.left - MARGINS.right;
    for (n, dwell) in report.dwells.iter().enumerate() {
        let middle = (0.5 * (dwell.start + dwell.end) - start) / (end - start);
        if (0.0..=1.0).contains(&middle) {
            let place = (MARGINS.left + width * middle, 28.0);
            let number = (n + 1).to_string();
            write(area, &number, place, (HPos::Center, VPos::Top), &QUIET, 0.8)?;
        }
    }
    Ok(())
}

/// Elevation of a body axis above the horizon in degrees.
fn elevation(table: &TableLog, axis: usize) -> Vec<Line> {
    let line = table.time.iter().zip(&table.attitude);
    vec![
        line.map(|(&t, c)| (t, axis_elevation(c, axis) / DEGREE))
            .collect(),
    ]
}

/// Azimuth of a body axis clockwise from North in degrees, in pieces between jumps and steep parts.
fn azimuth(table: &TableLog, axis: usize) -> Vec<Line> {
    let line: Vec<_> = table
        .time
        .iter()
        .zip(&table.attitude)
        .map(|(&t, c)| {
            let steep = axis_elevation(c, axis).abs() > STEEP;
            (t, c[(0, axis)].atan2(c[(1, axis)]) / DEGREE, steep)
        })
        .collect();
    line.chunk_by(|a, b| a.2 == b.2 && (a.1 - b.1).abs() < 180.0)
        .filter(|piece| !piece[0].2)
        .map(|piece| piece.iter().map(|&(t, angle, _)| (t, angle)).collect())
        .collect()
}

fn axis_elevation(c: &Matrix3<f64>, axis: usize) -> f64 {
    c[(2, axis)].clamp(-1.0, 1.0).asin()
}

/// Mean rate of each sample about a body axis in degrees a second.
fn rate(imu: &ImuSamples, axis: usize) -> Vec<Line> {
    let samples = imu.gyro.iter().enumerate();
    vec![
        samples
            .map(|(k, angle)| {
                (
                    imu.time(k) + 0.5 * imu.period,
                    angle[axis] / imu.period / DEGREE,
                )
            })
            .collect(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::from_pitch_roll_heading;

    fn table(headings: impl Iterator<Item = f64>) -> TableLog {
        let attitude: Vec<_> = headings
            .map(|heading| from_pitch_roll_heading(0.0, 0.0, heading * DEGREE))
            .collect();
        TableLog {
            time: (0..attitude.len()).map(|k| k as f64).collect(),
            attitude,
            position_sigma: 0.0,
            reading_sigma: 0.0,
            geometry: Default::default(),
            tilts: Vec::new(),
        }
    }

    #[test]
    fn a_full_turn_in_heading_is_drawn_without_a_jump() {
        let table = table((0..=36).map(|k| f64::from(k) * 10.0 + 5.0));
        let pieces = azimuth(&table, 1);
        assert_eq!(pieces.len(), 2);
        for piece in &pieces {
            assert!(piece.is_sorted_by(|a, b| b.1 - a.1 < 11.0 && b.1 > a.1));
        }
        assert!(
            azimuth(&table, 2).is_empty(),
            "a vertical axis has no azimuth"
        );
    }

    #[test]
    fn the_front_axis_points_east_at_a_heading_of_ninety_degrees() {
        let table = table(std::iter::once(90.0));
        assert!((azimuth(&table, 1)[0][0].1 - 90.0).abs() < 1e-9);
        assert!(elevation(&table, 1)[0][0].1.abs() < 1e-9);
        assert!((elevation(&table, 2)[0][0].1 - 90.0).abs() < 1e-9);
    }
}
