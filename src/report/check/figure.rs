//! The record: what the gyros and accelerometers say against time, with dwells, turns and faults.

use plotters::style::text_anchor::{HPos, VPos};

use super::super::axis::Axis;
use super::super::canvas::{Area, DrawError, INK, Pen, QUIET, envelope, write};
use super::super::panel::{Margins, Mark, Panel};
use super::super::{Figure, ReportError};
use super::CheckReport;
use super::words;
use crate::imu::{AXES, Sensor};
use crate::units::DEGREE;

const SIZE: (u32, u32) = (1200, 620);
const POINTS: usize = 2400;
const MARGINS: Margins = Margins {
    left: 56.0,
    right: 34.0,
};
/// Width of a letter of a label, in shown pixels.
const LETTER: f64 = 7.0;
/// Rows of labels above the curves, and their distance.
const ROWS: usize = 3;
const ROW: f64 = 15.0;

pub(super) fn figure(report: &CheckReport) -> Result<Figure, ReportError> {
    let mut caption = "Gyro rates and specific force along body axes by nominal scales, as they stand in the file. \
                       Grey: dwells, numbered as in the table and with the axis that is up; above the rates: turns, by \
                       axis and angle, or angle alone if about several axes, where there is \
                       room."
        .to_owned();
    if !report.run.recording.imu.faults.is_empty() {
        caption += " Crosses: faults of the log in the triad's samples, missing and duplicate rows in both.";
    }
    Figure::draw("record.svg", "Record", caption, SIZE, |area| {
        let (upper, lower) = area.split_vertically(area.dim_in_pixel().1 / 2);
        triad(report, &upper, Sensor::Gyro)?;
        triad(report, &lower, Sensor::Accel)
    })
}

fn triad(report: &CheckReport, area: &Area, sensor: Sensor) -> Result<(), DrawError> {
    let imu = &report.run.recording.imu;
    let (samples, unit, title) = match sensor {
        Sensor::Gyro => (&imu.gyro, DEGREE, "angular rate, °/s"),
        Sensor::Accel => (&imu.accel, 1.0, "specific force, m/s²"),
    };
    let line = |axis: usize| -> Vec<(f64, f64)> {
        let values = samples.iter().enumerate();
        let rate = |(k, sample): (usize, &nalgebra::Vector3<f64>)| {
            (
                imu.time(k) + 0.5 * imu.period,
                sample[axis] / imu.period / unit,
            )
        };
        envelope(&values.map(rate).collect::<Vec<_>>(), POINTS)
    };
    let lines = [0, 1, 2].map(line);
    let values = lines
        .iter()
        .flatten()
        .map(|point| point.1)
        .filter(|y| y.is_finite());
    let (low, high) = values.fold((0.0, 0.0), |(low, high): (f64, f64), y| {
        (low.min(y), high.max(y))
    });
    let span = (high - low).max(1e-9);
    let (start, end) = (imu.start(), imu.start() + imu.duration());
    let (bottom, top) = (low - 0.12 * span, high + 0.3 * span);
    let dwells: Vec<_> = report
        .survey
        .rests
        .iter()
        .map(|rest| rest.times(report.run))
        .map(|[from, to]| from..to)
        .collect();
    let axes = (Axis::linear(start, end), Axis::linear(bottom, top));
    let x_title = if sensor == Sensor::Accel {
        "time, s"
    } else {
        ""
    };
    let mut panel = Panel::new(area, title, MARGINS, axes, x_title, &dwells)?;
    for (axis, points) in lines.iter().enumerate() {
        // Dashes would be lost in noise.
        let pen = Pen::nth(axis, 1.0);
        panel.line(points, pen)?;
        if let Some(last) = points.last() {
            panel.label(last.1, AXES[axis], pen.color);
        }
    }
    let of_triad = imu
        .faults
        .iter()
        .filter(|fault| fault.axis.is_none_or(|(of, _)| of == sensor));
    let faults: Vec<(f64, f64)> = of_triad
        .map(|fault| (imu.time(fault.samples.start), low - 0.06 * span))
        .collect();
    panel.marks(&faults, Mark::Cross, Pen::solid(INK, 1.5))?;
    panel.finish()?;
    let labels: Vec<(f64, String)> = match sensor {
        Sensor::Gyro => turns(report),
        Sensor::Accel => positions(report),
    };
    let width = f64::from(SIZE.0) - MARGINS.left - MARGINS.right;
    let place = |time: f64| MARGINS.left + width * (time - start) / (end - start);
    let mut taken = [f64::NEG_INFINITY; ROWS];
    for (time, text) in labels {
        let half = 0.5 * LETTER * text.chars().count() as f64;
        let at = place(time).clamp(MARGINS.left + half, MARGINS.left + width - half);
        let Some(row) = (0..ROWS).find(|&row| taken[row] < at - half) else {
            continue;
        };
        taken[row] = at + half + LETTER;
        let color = if sensor == Sensor::Gyro { &INK } else { &QUIET };
        let center = (HPos::Center, VPos::Top);
        write(
            area,
            &text,
            (at, 29.0 + ROW * row as f64),
            center,
            color,
            0.85,
        )?;
    }
    Ok(())
}

fn turns(report: &CheckReport) -> Vec<(f64, String)> {
    let imu = &report.run.recording.imu;
    let middle =
        |samples: &std::ops::Range<usize>| 0.5 * (imu.time(samples.start) + imu.time(samples.end));
    let turns = report.survey.turns.iter();
    turns
        .map(|turn| (middle(&turn.samples), words::turn(turn)))
        .collect()
}

fn positions(report: &CheckReport) -> Vec<(f64, String)> {
    let rests = report.survey.rests.iter().enumerate();
    let label = |(k, rest): (usize, &crate::survey::Rest)| {
        let [from, to] = rest.times(report.run);
        let up = match rest.up.is_upright() {
            true => format!(" {}", words::way_up(rest.up.axis, rest.up.down)),
            false => String::new(),
        };
        (0.5 * (from + to), format!("{}{up}", k + 1))
    };
    rests.map(label).collect()
}
