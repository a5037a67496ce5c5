//! Status of a calibration in attained, as a screen that is redrawn or as lines.

use nalgebra::Vector3;

use super::check;
use super::prelude::*;
use crate::imu::AXES;
use crate::lot::{Specification, Verdict};
use crate::run::Run;
use crate::survey::{Attained, Move, Status, needed};

/// An upward direction counts as tried within this angle, rad.
const NEAR: f64 = 15.0 * DEGREE;
/// Minimum turn about a body axis that counts, rad.
const TURNED: f64 = 60.0 * DEGREE;
/// Maximum number of findings on a screen.
const SHOWN: usize = 3;

/// A move in words.
pub fn words(next: Move) -> String {
    let up = match next {
        Move::HalfTurn { axis, is_negative } => {
            let sign = if is_negative { "−" } else { "" };
            return format!(
                "turn it slowly by 180° about {sign}{} (right-handed)",
                AXES[axis]
            );
        }
        Move::Up(up) => up,
    };
    let axes = AXES.iter().zip(&up).filter(|(_, part)| **part != 0.0);
    let axes: Vec<String> = axes
        .map(|(axis, part)| format!("{}{axis}", if *part < 0.0 { "−" } else { "" }))
        .collect();
    match axes.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["x"] => "put it on its left side (x up)".to_owned(),
        ["−x"] => "put it on its right side (x down)".to_owned(),
        ["y"] => "stand it on its rear end (y up)".to_owned(),
        ["−y"] => "stand it on its front end (y down)".to_owned(),
        ["z"] => "lay it flat, top up (z up)".to_owned(),
        ["−z"] => "lay it flat, upside down (z down)".to_owned(),
        [_, _] => format!("hold it on an edge, {} both 45° up", axes.join(" and ")),
        _ => format!("hold it on a corner, {} equally far up", axes.join(", ")),
    }
}

/// The screen: at most 80 columns, the state first, the next move last.
pub fn screen(run: &Run, status: &Status, specification: Option<&Specification>) -> Vec<String> {
    let mut lines = vec![
        format!("{}; {}", so_far(status), moving(status)),
        String::new(),
    ];
    match &status.expected {
        Err(error) => lines.push(format!("no calibration yet: {error}")),
        Ok(attained) => lines.extend(groups(attained, specification)),
    }
    lines.push(String::new());
    lines.push(coverage(status));
    let findings = check::findings(run, &status.survey);
    let first = |finding: &String| {
        let sentence = finding.split_inclusive(". ").next().unwrap_or_default();
        format!("note: {}", sentence.trim_end())
    };
    lines.extend(findings.iter().take(SHOWN).map(first));
    lines.push(match status.next {
        Some(next) => format!("next: {}, then keep still for 5 s", words(next)),
        None => "σ are small enough to decide every limit of the specification".to_owned(),
    });
    lines
}

/// The state after a dwell in one line.
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
    if let Some((time, groups)) = of_dwell {
        let sigma = groups.iter().filter_map(|(group, sigma)| {
            let sigma = three_digits((*sigma)? / group.unit_value());
            Some(format!("{} {sigma} {}", group.short(), group.unit()))
        });
        line += &format!(
            "; {} s; 1σ {}",
            value(*time, 1.0),
            sigma.collect::<Vec<_>>().join(", ")
        );
    }
    Some(line)
}

fn so_far(status: &Status) -> String {
    let dwells = status.survey.rests.len();
    format!("{} s, {dwells} dwells", value(status.duration, 1.0))
}

fn moving(status: &Status) -> String {
    match status.still > 0.0 {
        true => format!("still for {} s", value(status.still, 1.0)),
        false => "moving".to_owned(),
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
            Group::of(check.limit.parameter) == *group && check.verdict != Verdict::Pass
        });
        let state = match (asked, open) {
            (None, _) => "",
            (Some(_), true) => "not yet",
            (Some(_), false) => "reached",
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
    let rows = last.into_iter().flat_map(|(_, groups)| groups).map(row);
    std::iter::once(heading.trim_end().to_owned())
        .chain(rows)
        .collect()
}

/// Axes that were up or down, and axes of turns.
fn coverage(status: &Status) -> String {
    let mark = |done: bool| if done { "●" } else { "○" };
    let rests = &status.survey.rests;
    let mut text = "up ".to_owned();
    for (axis, name) in AXES.into_iter().enumerate() {
        for (sign, part) in [("", 1.0), ("−", -1.0)] {
            let up = Vector3::ith(axis, part);
            let done = rests.iter().any(|rest| rest.force.angle(&up) < NEAR);
            text += &format!(" {sign}{name} {}", mark(done));
        }
    }
    text += "   turned about ";
    for (axis, name) in AXES.into_iter().enumerate() {
        let far = |turn: &crate::run::motion::Turn| turn.sum[axis].abs() > TURNED;
        text += &format!(" {name} {}", mark(status.survey.turns.iter().any(far)));
    }
    text
}

/// The state as data: σ of each group, unobserved parameters and the next move.
pub fn data(status: &Status) -> Value {
    let attained = status.expected.as_ref().ok();
    let last = attained.and_then(|attained| attained.history.last());
    let sigma = last.into_iter().flat_map(|(_, groups)| groups);
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
