//! The path: where the body axes point and how fast the body turns.

use nalgebra::Matrix3;

use super::report::Report;
use crate::attitude::matrix;
use crate::imu::AXES;
use crate::recording::{ImuSamples, TableLog};
use crate::report::prelude::*;
use crate::units::DEGREE;

/// Nearer to the plumb line than this an axis has no azimuth worth drawing.
const STEEP: f64 = 80.0 * DEGREE;
/// An azimuth may run so far past ±180° before it goes on at the other end, °.
const PAST: f64 = 190.0;

/// Elevation and azimuth of the body axes from the table, and body rates from the gyros.
pub(super) fn figure(report: &Report) -> Plot {
    let (start, end) = report.time_span();
    let numbers = || {
        let dwells = report.dwells.iter().enumerate();
        dwells.map(|(n, dwell)| (0.5 * (dwell.start + dwell.end), (n + 1).to_string()))
    };
    let panel = |title: &str, y: Axis, line: &dyn Fn(usize) -> Vec<Point>| {
        let lines = [0, 1, 2].map(|axis| Series::line(line(axis)).axis(axis).label(AXES[axis]));
        Panel::new(title, Axis::linear("time, s").between(start, end), y)
            .shaded(report.dwells)
            .tagged(1, numbers())
            .with_all(lines)
    };
    let table = report.table().filter(|table| !table.time.is_empty());
    let mut panels = Vec::new();
    let mut caption = String::new();
    if let Some(table) = table {
        let y = Axis::linear("").between(-95.0, 130.0).step(45.0);
        panels.push(panel("elevation of the body axes, °", y, &|axis| {
            elevation(table, axis)
        }));
        let y = Axis::linear("").between(-200.0, 260.0).step(90.0);
        panels.push(panel("azimuth of the body axes, °", y, &|axis| {
            azimuth(table, axis)
        }));
        caption += "Elevation of each body axis above the horizon and its azimuth clockwise from North, as the \
                    turntable reads them. Unlike heading, pitch and roll these are never singular; an axis has \
                    no azimuth while it is within 10° of the plumb line. ";
    }
    caption += "Rates are the raw gyro outputs about the body axes. Grey: dwells, numbered where there is room.";
    let y = Axis::linear("").including([0.0]).room(0.05, 0.16);
    panels.push(panel("rate about the body axes, °/s", y, &|axis| {
        rate(&report.run.recording.imu, axis)
    }));
    Plot::new("path.svg", "Path", (1, 240), panels).caption(caption)
}

/// Elevation of a body axis above the horizon in degrees.
fn elevation(table: &TableLog, axis: usize) -> Vec<Point> {
    let line = table.time.iter().zip(&table.attitude);
    line.map(|(&t, attitude)| (t, axis_elevation(&matrix(attitude), axis) / DEGREE))
        .collect()
}

/// Azimuth of a body axis clockwise from North in degrees, interrupted where it jumps and where it is steep.
fn azimuth(table: &TableLog, axis: usize) -> Vec<Point> {
    let gap = (f64::NAN, f64::NAN);
    let (mut last, mut line) = (f64::NAN, Vec::new());
    for (&t, attitude) in table.time.iter().zip(&table.attitude) {
        let c = matrix(attitude);
        if axis_elevation(&c, axis).abs() > STEEP {
            last = f64::NAN;
            line.push(gap);
            continue;
        }
        let angle = c[(0, axis)].atan2(c[(1, axis)]) / DEGREE;
        let near = [angle, angle - 360.0, angle + 360.0];
        let near = near.into_iter().filter(|a| a.abs() <= PAST);
        let next = near.min_by(|a, b| (a - last).abs().total_cmp(&(b - last).abs()));
        let next = next.filter(|_| last.is_finite()).unwrap_or(angle);
        if (next - last).abs() > 180.0 {
            line.push(gap);
        }
        line.push((t, next));
        last = next;
    }
    line
}

fn axis_elevation(c: &Matrix3<f64>, axis: usize) -> f64 {
    c[(2, axis)].clamp(-1.0, 1.0).asin()
}

/// Mean rate of each sample about a body axis in degrees a second.
fn rate(imu: &ImuSamples, axis: usize) -> Vec<Point> {
    let samples = imu.gyro.iter().enumerate();
    let rate = |(k, angle): (usize, nalgebra::Vector3<f64>)| {
        (
            imu.time(k) + 0.5 * imu.period,
            angle[axis] / imu.period / DEGREE,
        )
    };
    thinned(samples.map(rate))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::{from_pitch_roll_heading, quaternion};

    fn table(headings: impl Iterator<Item = f64>) -> TableLog {
        let attitude: Vec<_> = headings
            .map(|heading| quaternion(&from_pitch_roll_heading(0.0, 0.0, heading * DEGREE)))
            .collect();
        TableLog {
            time: (0..attitude.len()).map(|k| k as f64).collect(),
            attitude,
            axes: Vec::new(),
        }
    }

    #[test]
    fn a_full_turn_in_heading_is_drawn_without_a_jump() {
        let line = azimuth(&table((0..=36).map(|k| f64::from(k) * 10.0 + 5.0)), 1);
        let pieces: Vec<&[Point]> = line.split(|point| point.0.is_nan()).collect();
        assert_eq!(pieces.len(), 2);
        for piece in &pieces {
            assert!(piece.is_sorted_by(|a, b| b.1 - a.1 < 11.0 && b.1 > a.1));
        }
        let vertical = azimuth(&table((0..=36).map(f64::from)), 2);
        assert!(
            vertical.iter().all(|point| point.0.is_nan()),
            "a vertical axis has no azimuth"
        );
    }

    #[test]
    fn an_azimuth_that_trembles_about_south_stays_on_one_side() {
        let line = azimuth(&table((0..40).map(|k| 180.0 + f64::from(k % 2) - 0.5)), 1);
        assert!(
            line.windows(2)
                .all(|pair| (pair[1].1 - pair[0].1).abs() < 2.0),
            "{line:?}"
        );
    }

    #[test]
    fn the_front_axis_points_east_at_a_heading_of_ninety_degrees() {
        let table = table(std::iter::once(90.0));
        assert!((azimuth(&table, 1)[0].1 - 90.0).abs() < 1e-9);
        assert!(elevation(&table, 1)[0].1.abs() < 1e-9);
        assert!((elevation(&table, 2)[0].1 - 90.0).abs() < 1e-9);
    }
}
