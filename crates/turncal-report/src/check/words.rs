//! Findings about a run before calibration.

use crate::prelude::*;
use turncal::imu::{AXES, Sensor};
use turncal::run::motion::{LabelCheck, Turn};
use turncal::run::{LONG_ENOUGH, Run};
use turncal::survey::{APART, Survey};

/// Number of accelerometer parameters without a table, and of upward directions needed.
const DIRECTIONS: usize = 9;
/// Temperature span below which an instrument counts as soaked, K.
const SOAKED: f64 = 1.0;
const MICROSECOND: f64 = 1e-6;

/// A degree sign after a number.
pub fn degrees(angle: f64) -> String {
    value(angle / DEGREE, 1.0)
}

/// Direction of an axis, such as `x up`.
pub fn way_up(axis: usize, down: bool) -> String {
    format!("{} {}", AXES[axis], if down { "down" } else { "up" })
}

/// Axis and angle of a turn, such as `x +360.0°`; for a turn about several axes, only the angle.
pub fn turn(turn: &Turn) -> String {
    match turn.body_axis() {
        Some(axis) => format!("{} {}°", AXES[axis], signed(turn.angle)),
        None if turn.single => format!("{} {}°", direction(turn), signed(turn.angle)),
        None => format!("{}°", degrees(turn.angle.abs())),
    }
}

/// Components of the axis of a turn.
pub fn direction(turn: &Turn) -> String {
    let parts: Vec<String> = turn.axis.iter().map(|&part| value(part, 0.1)).collect();
    format!("({})", parts.join(", "))
}

pub fn signed(angle: f64) -> String {
    let plus = if angle > 0.0 { "+" } else { "" };
    format!("{plus}{}", degrees(angle))
}

/// A description of the log in one or two sentences.
pub fn log(run: &Run, survey: &Survey) -> String {
    let mut text = format!(
        "Stationary for {} s in total, at most {} s at a time; {}.",
        three_digits(survey.standing),
        three_digits(survey.longest),
        match (&run.recording.table, run.recording.segments.len()) {
            (Some(table), _) => format!("table log of {} readings", count(table.time.len())),
            (None, labels) => format!("no table log, {}", several(labels, "labelled section")),
        }
    );
    if let Some(log) = &run.recording.imu.log {
        text += &format!(
            " {} rows; the time stamps deviate from a uniform clock by {} µs RMS, and by {} µs at most.",
            count(log.rows),
            value(log.jitter_rms / MICROSECOND, 1.0),
            value(log.jitter_max / MICROSECOND, 1.0)
        );
        if let Some(temperature) = log.temperature {
            text += &format!(
                " Temperature column: {} to {} °C, mean {} °C.",
                three_digits(temperature.smallest),
                three_digits(temperature.largest),
                three_digits(temperature.mean)
            );
        }
        text += &warming(run);
    }
    if let Some(log) = &run.recording.magnetometer {
        let (values, unit) = (log.values().count(), &log.unit);
        text += &format!(" Magnetometer in {unit}: {} means of 0.1 s.", count(values));
    }
    text
}

/// Temperature rate of the instrument, and whether it has soaked.
fn warming(run: &Run) -> String {
    let imu = &run.recording.imu;
    let Some(temperature) = &imu.temperature else {
        return String::new();
    };
    let of = |sensor: Sensor| {
        let [lowest, highest] = temperature.range(sensor);
        let last = temperature.rate(imu.end()).get(sensor).map(f64::abs);
        let last = last.into_iter().fold(0.0, f64::max);
        (highest - lowest, temperature.largest_rate(sensor), last)
    };
    let (one, other) = (of(Sensor::Gyro), of(Sensor::Accel));
    let (span, largest, last) = (one.0.max(other.0), one.1.max(other.1), one.2.max(other.2));
    format!(
        " The temperature changes by {} K/min at most and {} K/min at the end: {}.",
        three_digits(largest * MINUTE),
        three_digits(last * MINUTE),
        if span < SOAKED {
            "soaked within 1 K"
        } else {
            "the instrument has not reached a constant temperature, so parameters may change during the recording \
             (see calibrate --temperature)"
        }
    )
}

/// Findings and recommended changes, one or two sentences each.
pub fn findings(run: &Run, survey: &Survey) -> Vec<String> {
    let mut findings = [&run.recording.doubts[..], &run.recording.notes].concat();
    findings.extend(of_survey(survey));
    findings.extend(of_methods(survey));
    findings
}

/// Findings about dwells, turns and labels.
pub fn of_survey(survey: &Survey) -> Vec<String> {
    let contradiction = survey.contradiction.iter();
    let mut findings: Vec<String> = contradiction
        .map(|of| capital(&of.to_string()))
        .chain(survey.labels.iter().filter_map(of_label))
        .collect();
    findings.extend(of_motion(survey));
    findings
}

/// Describes the disagreement between a label and the recording.
pub fn of_label(check: &LabelCheck) -> Option<String> {
    let said = check.disagreement.as_ref()?;
    let at = value(check.segment.start, 1.0);
    Some(format!(
        "Section `{}` at {at} s {said}.",
        check.segment.label
    ))
}

/// Missing positions and turns.
fn of_motion(survey: &Survey) -> Vec<String> {
    let mut findings = Vec::new();
    if survey.rests.len() < 2 {
        findings.push(format!(
            "The recording has fewer than two dwells. Keep the instrument stationary for {LONG_ENOUGH} s or more \
             between turns. If the instrument was stationary, check bias_sigma of the gyros and the noise in run.toml: \
             one of them is too small."
        ));
        return findings;
    }
    let ways = survey.ways_up().into_iter().enumerate();
    let missing = ways.filter(|(_, rests)| *rests == 0);
    let missing: Vec<String> = missing
        .map(|(way, _)| way_up(way / 2, way % 2 == 1))
        .collect();
    if !missing.is_empty() && survey.directions < DIRECTIONS {
        let positions = if missing.len() == 1 {
            "Missing position"
        } else {
            "Missing positions"
        };
        findings.push(format!(
            "{positions}: {}. Number of upward directions {}° or more apart: {}. Without a table, the nine accelerometer \
             parameters need all six positions, or {DIRECTIONS} such directions.",
            missing.join(", "),
            degrees(APART),
            survey.directions
        ));
    }
    findings
}

/// Parameters that no method could observe.
fn of_methods(survey: &Survey) -> Vec<String> {
    let methods = survey.methods.iter();
    let expected: Vec<_> = methods
        .filter_map(|(_, expected)| expected.as_ref().ok())
        .collect();
    let [first, others @ ..] = &expected[..] else {
        let text = "No method can calibrate this run; the table of methods gives the reasons.";
        return vec![text.to_owned()];
    };
    let by_none = |name: &&String| others.iter().all(|other| other.unobserved.contains(name));
    let always = first.unobserved.iter().filter(by_none);
    let always: Vec<&str> = always.map(String::as_str).collect();
    if always.is_empty() {
        Vec::new()
    } else {
        vec![format!(
            "With every method, the σ of {} would remain above half of the prior σ. Add positions and turns.",
            always.join(", ")
        )]
    }
}
