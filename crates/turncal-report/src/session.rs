//! Status of a calibration in progress, shown as a screen that is redrawn or as single lines.

use std::collections::BTreeSet;

use super::check;
use super::prelude::*;
use turncal::calibration::{Finding, Verdict};
use turncal::imu::AXES;
use turncal::lot;
use turncal::lot::Specification;
use turncal::run::Run;
use turncal::survey::{
    Attained, Attitude, InterimCalibration, Move, Reached, Status, nearest_attitude, needed,
};

/// Minimum turn about a body axis that counts, rad.
const TURNED: f64 = 60.0 * DEGREE;
/// Values of a magnetometer.
const MAGNETIC: [&str; 2] = ["mag matrix", "mag hard iron"];
/// Maximum number of findings on a screen.
const SHOWN: usize = 3;

/// A move in words.
pub fn words(next: Move) -> String {
    let up = match next {
        Move::HalfTurn { axis, is_negative } => {
            let sign = if is_negative { "−" } else { "" };
            return format!(
                "turn the sensor slowly by 180° about {sign}{} (right-handed)",
                AXES[axis]
            );
        }
        Move::Up(up) => up,
    };
    let axes = AXES.iter().zip(&up).filter(|(_, part)| **part != 0.0);
    let axes: Vec<String> = axes.map(|(axis, part)| signed_axis(*axis, *part)).collect();
    match axes.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["x"] => "put the sensor on its left side (x up)".to_owned(),
        ["−x"] => "put the sensor on its right side (x down)".to_owned(),
        ["y"] => "stand the sensor on its rear end (y up)".to_owned(),
        ["−y"] => "stand the sensor on its front end (y down)".to_owned(),
        ["z"] => "lay the sensor flat, top up (z up)".to_owned(),
        ["−z"] => "lay the sensor flat, upside down (z down)".to_owned(),
        [_, _] => format!(
            "hold the sensor on an edge, with {} both 45° up",
            axes.join(" and ")
        ),
        _ => format!(
            "hold the sensor on a corner, with {} equally far up",
            axes.join(", ")
        ),
    }
}

/// The reason for the recommended move, after its words, if it is the magnetometer.
pub fn reason(status: &Status) -> &'static str {
    if status.is_for_magnetometer {
        "; the magnetometer lacks this attitude"
    } else {
        ""
    }
}

/// The screen, with at most 80 columns; the state comes first and the next move last.
pub fn screen(run: &Run, status: &Status, specification: Option<&Specification>) -> Vec<String> {
    let mut lines = vec![so_far(status), String::new()];
    match &status.expected {
        Err(error) => lines.push(format!("no calibration yet: {error}")),
        Ok(attained) => {
            lines.extend(groups(attained, specification));
            lines.extend(magnetometer(run, attained.history.last()));
        }
    }
    lines.extend(status.calibrated.as_ref().map(calibrated));
    lines.push(String::new());
    lines.extend(coverage(status));
    lines.push(String::new());
    lines.extend(notes(run, status).into_iter().take(SHOWN));
    if let Ok(Some(left)) = status
        .expected
        .as_ref()
        .map(|of| of.time_left(specification))
    {
        lines.push(format!("about {} left", duration(left)));
    }
    lines.push(match status.next {
        Some(next) => format!(
            "next: {}, then keep still for 5 s{}",
            words(next),
            reason(status)
        ),
        None => {
            "the σ of the calibration are small enough to decide every limit of the specification"
                .to_owned()
        }
    });
    lines
}

/// One line with the state after a dwell.
pub fn line(status: &Status, dwell: usize) -> Option<String> {
    let rest = status.survey.rests.get(dwell)?;
    let up = check::way_up(rest.up.axis, rest.up.down);
    let mut line = format!(
        "dwell {}: {up}, tilt {}°",
        dwell + 1,
        three_digits(rest.up.tilt / DEGREE)
    );
    let Ok(attained) = &status.expected else {
        return Some(line + "; no calibration yet");
    };
    // The history may lack the first dwells, when no initial estimate exists yet.
    let behind = status.survey.rests.len() - dwell;
    let of_dwell = attained
        .history
        .len()
        .checked_sub(behind)
        .map(|k| &attained.history[k]);
    if let Some(reached) = of_dwell {
        let sigma = reached.sigma.iter().filter_map(|(group, sigma)| {
            let sigma = three_digits((*sigma)? / group.unit_value());
            Some(format!("{} {sigma} {}", group.short(), group.unit()))
        });
        let magnetic = reached.magnetic.iter().flatten().zip(MAGNETIC);
        let magnetic =
            magnetic.map(|((sigma, unit), name)| format!("{name} {} {unit}", three_digits(*sigma)));
        line += &format!(
            "; {} s; 1σ {}",
            value(reached.time, 1.0),
            sigma.chain(magnetic).collect::<Vec<_>>().join(", ")
        );
    }
    Some(line)
}

/// Duration, dwells and whether the sensor moves.
fn so_far(status: &Status) -> String {
    let [duration, still] = [status.duration, status.still].map(|time| value(time, 1.0));
    let dwells = several(status.survey.rests.len(), "dwell");
    if status.still > 0.0 {
        format!("{duration} s, {dwells}; still for {still} s")
    } else {
        format!("{duration} s, {dwells}; moving")
    }
}

/// σ of each group, and the σ that the specification requires.
fn groups(attained: &Attained, specification: Option<&Specification>) -> Vec<String> {
    let row = |(group, sigma): &(Group, Option<f64>)| {
        let shown = |sigma: f64| {
            format!(
                "{} {}",
                three_digits(sigma / group.unit_value()),
                group.unit()
            )
        };
        let asked = specification.and_then(|of| needed(of, *group));
        let open = attained.checks.iter().any(|check| {
            Group::of(check.limit.parameter) == *group && check.verdict != lot::Verdict::Pass
        });
        let state = match (asked, open) {
            (None, _) => "",
            (Some(_), true) => "not yet",
            (Some(_), false) => "predicted",
        };
        let row = format!(
            "{:<24}{:>14}{:>14}  {state}",
            group.title(),
            or_dash(*sigma, shown),
            asked.map_or(String::new(), shown)
        );
        row.trim_end().to_owned()
    };
    let asked = if specification.is_some() {
        "required"
    } else {
        ""
    };
    let heading = format!("{:<24}{:>14}{asked:>14}", "", "expected 1σ");
    let last = attained.history.last();
    let rows = last.into_iter().flat_map(|last| &last.sigma).map(row);
    std::iter::once(heading.trim_end().to_owned())
        .chain(rows)
        .collect()
}

/// σ of the magnetometer, if the rows have one.
fn magnetometer(run: &Run, last: Option<&Reached>) -> Vec<String> {
    let row = |(name, (sigma, unit)): (&str, &(f64, String))| {
        format!(
            "{name:<24}{:>14}",
            format!("{} {unit}", three_digits(*sigma))
        )
    };
    match last.and_then(|last| last.magnetic.as_ref()) {
        Some(of) => MAGNETIC.into_iter().zip(of).map(row).collect(),
        None if run.recording.magnetometer.is_some() => {
            vec!["mag: not determined yet".to_owned()]
        }
        None => Vec::new(),
    }
}

/// The last calibration in one line.
fn calibrated(last: &InterimCalibration) -> String {
    let Verdict { word, reasons } = &last.verdict;
    let codes = if reasons.is_empty() {
        String::new()
    } else {
        format!(" ({})", reasons.join(", "))
    };
    let time = value(last.duration, 1.0);
    format!("calibration of the first {time} s: {word}{codes}")
}

/// The first sentence of each finding, with the findings about the rows first and then those that restrict the use of
/// the last calibration.
pub fn notes(run: &Run, status: &Status) -> Vec<String> {
    let mut findings = run.recording.doubts.clone();
    findings.extend(check::of_survey(&status.survey));
    if let Some(last) = &status.calibrated {
        let is_reason = |of: &&Finding| last.verdict.reasons.contains(&of.code);
        let reasons = last.findings.iter().filter(is_reason);
        findings.extend(reasons.map(|of| format!("{}: {}", of.code, of.text)));
    }
    let first = |finding: &String| {
        let sentence = finding.split_inclusive(". ").next().unwrap_or_default();
        format!("note: {}", sentence.trim_end())
    };
    findings.iter().map(first).collect()
}

/// Upward directions seen from above the sensor, in three layers of nine directions (z up, level, down); then the turns
/// both ways about each axis.
fn coverage(status: &Status) -> Vec<String> {
    let mark = |done: bool| if done { '●' } else { '○' };
    let rests = status.survey.rests.iter();
    let tried: BTreeSet<Attitude> = rests.map(|rest| nearest_attitude(&rest.force)).collect();
    let layer = |y, z| {
        let cell = |x| match [x, y, z] {
            [0, 0, 0] => ' ',
            of => mark(tried.contains(&of)),
        };
        format!("{} {} {}", cell(-1), cell(0), cell(1))
    };
    let row = |(y, name): (i8, &str)| {
        format!(
            "{name:<8}{}    {}    {}",
            layer(y, 1),
            layer(y, 0),
            layer(y, -1)
        )
    };
    let mut lines = vec!["up      z up     level    z down".to_owned()];
    lines.extend([(1, "y up"), (0, "level"), (-1, "y down")].map(row));
    let turned = AXES.iter().enumerate().map(|(axis, name)| {
        let by = |sign: f64| {
            let mut turns = status.survey.turns.iter();
            mark(turns.any(|turn| sign * turn.sum[axis] > TURNED))
        };
        format!("{name} {} −{name} {}", by(1.0), by(-1.0))
    });
    lines.push(format!(
        "turned  {}",
        turned.collect::<Vec<_>>().join("   ")
    ));
    lines
}

/// The state as data: the σ of each group, the parameters that are not observed, and the next move.
pub fn data(status: &Status) -> Value {
    let attained = status.expected.as_ref().ok();
    let last = attained.and_then(|attained| attained.history.last());
    let sigma = last.into_iter().flat_map(|last| &last.sigma);
    let sigma =
        sigma.map(|(group, sigma)| (group.key(), sigma.map(|s| s / group.unit_value()).into()));
    json!({
        "duration_s": status.duration,
        "dwells": status.survey.rests.len(),
        "still_s": status.still,
        "sigma": sigma.collect::<Map<_, _>>(),
        "not_observed": attained.map(|attained| &attained.unobserved),
        "next": status.next.map(words),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_move_is_told_in_words_of_its_own() {
        let mut all: Vec<String> = Move::all().map(words).collect();
        assert_eq!(all.len(), 32);
        assert!(all[..6].iter().all(|words| words.contains("put")
            || words.contains("lay")
            || words.contains("stand")));
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), 32);
        assert!(all.iter().all(|words| words.chars().count() < 60));
    }
}
