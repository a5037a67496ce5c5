//! The log, dwells and turns, labels and methods as tables.

use super::super::number::{count, sigma, three_digits, value, whole};
use super::super::side_by_side::Table;
use super::CheckReport;
use super::words::{degrees, direction, of_label, signed, way_up};
use crate::calibration::Group;
use crate::imu::{AXES, Sensor};
use crate::recording::LabelledMotion;
use crate::survey::{Turn, Verdict};
use crate::units::{DEG_PER_H, DEGREE, MICRO_G, MILLI_G};

const NONE: &str = "–";
/// Faults beyond so many are not listed one by one.
const LISTED: usize = 20;

pub(super) fn all(report: &CheckReport) -> Vec<Table> {
    let mut tables = Vec::new();
    tables.extend(columns(report));
    tables.extend(faults(report));
    tables.extend(dwells(report));
    tables.extend(labels(report));
    tables.push(methods(report));
    tables
}

fn table(title: &'static str, headings: &[&str], rows: Vec<Vec<String>>, notes: &[&str]) -> Table {
    Table {
        title,
        headings: headings.iter().map(|&heading| heading.to_owned()).collect(),
        sections: vec![rows],
        notes: notes.iter().map(|&note| note.to_owned()).collect(),
    }
}

fn columns(report: &CheckReport) -> Option<Table> {
    let (run, log) = (report.run, report.run.recording.imu.log.as_ref()?);
    let rows = Sensor::ALL.into_iter().flat_map(|sensor| {
        let columns = log
            .columns
            .get(sensor)
            .iter()
            .zip(report.survey.steps.get(sensor));
        columns.zip(AXES).map(move |((column, &rate), axis)| {
            let (unit, symbol) = match sensor {
                Sensor::Gyro => (DEG_PER_H, "°/h"),
                Sensor::Accel => (MICRO_G, "µg"),
            };
            vec![
                column.name.clone(),
                format!("{} {axis}", sensor.name()),
                exactly(column.smallest),
                count(column.at_smallest),
                exactly(column.largest),
                count(column.at_largest),
                run.instrument.unit.get(sensor).clone(),
                column.step.map_or(NONE.to_owned(), three_digits),
                rate.map_or(NONE.to_owned(), |rate| {
                    format!("{} {symbol}", three_digits(rate / unit))
                }),
            ]
        })
    });
    Some(table(
        "Columns",
        &[
            "column",
            "body axis",
            "smallest",
            "times",
            "largest",
            "times",
            "unit",
            "step",
            "as a rate",
        ],
        rows.collect(),
        &["Body axes are right, front, up. Step: of the grid on which all values lie."],
    ))
}

/// A whole number as it is, others to four digits.
fn exactly(x: f64) -> String {
    if x.fract() == 0.0 {
        whole(x)
    } else {
        value(x, x.abs() / 100.0)
    }
}

fn faults(report: &CheckReport) -> Option<Table> {
    let imu = &report.run.recording.imu;
    let row = |fault: &crate::recording::Fault| {
        let column = fault.axis.and_then(|(sensor, axis)| {
            Some(imu.log.as_ref()?.columns.get(sensor)[axis].name.clone())
        });
        vec![
            fault.kind.name().to_owned(),
            column.unwrap_or_else(|| "rows".to_owned()),
            count(fault.line as usize),
            value(imu.time(fault.samples.start), 0.1),
            count(fault.samples.len()),
            if fault.bridged { "yes" } else { "no" }.to_owned(),
        ]
    };
    let mut notes = Vec::new();
    let more = format!(
        "And {} more.",
        count(imu.faults.len().saturating_sub(LISTED))
    );
    if imu.faults.len() > LISTED {
        notes.push(more.as_str());
    }
    (!imu.faults.is_empty()).then(|| {
        table(
            "Faults",
            &["what", "column", "line", "at, s", "samples", "bridged"],
            imu.faults.iter().take(LISTED).map(row).collect(),
            &notes,
        )
    })
}

fn dwells(report: &CheckReport) -> Option<Table> {
    let (run, survey) = (report.run, report.survey);
    let gravity = run.site.gravity;
    let after = |k: usize| survey.turns.iter().find(|turn| turn.from == Some(k));
    let row = |(k, rest): (usize, &crate::survey::Rest)| {
        let [begin, end] = rest.times(run);
        let mut row = vec![
            (k + 1).to_string(),
            value(begin, 1.0),
            value(end, 1.0),
            three_digits(end - begin),
            value((rest.force.norm() - gravity) / MILLI_G, 1.0),
            way_up(rest.up.axis, rest.up.down),
            degrees(rest.up.tilt),
        ];
        row.extend(after(k).map_or([NONE; 4].map(str::to_owned), |turn| moved(turn, survey)));
        row
    };
    let rows: Vec<Vec<String>> = survey.rests.iter().enumerate().map(row).collect();
    (!rows.is_empty()).then(|| {
        table(
            "Dwells, and the turns after them",
            &[
                "", "from, s", "to, s", "for, s", "|f| − g, mg", "up", "tilt, °", "then about", "by, °", "at, °/s",
                "off gravity, °",
            ],
            rows,
            &[
                "By nominal scales and prior biases. Tilt: of that axis against the plumb line. By: right-handed, the \
                 gyros' output at the dwell before taken as zero; at: the fastest. Off gravity: between up as the \
                 gyros carry it to the next dwell and as the accelerometers see it there.",
            ],
        )
    })
}

fn moved(turn: &Turn, survey: &crate::survey::Survey) -> [String; 4] {
    let about = match turn.body_axis() {
        Some(axis) => AXES[axis].to_string(),
        None if turn.single => direction(turn),
        None => "several".to_owned(),
    };
    [
        about,
        match turn.single {
            true => signed(turn.angle),
            false => degrees(turn.angle.abs()),
        },
        value(turn.fastest / DEGREE, 1.0),
        turn.off_gravity(&survey.rests)
            .map_or(NONE.to_owned(), degrees),
    ]
}

fn labels(report: &CheckReport) -> Option<Table> {
    let checks = &report.survey.labels;
    let rows = checks.iter().map(|check| {
        let found = match (&check.verdict, check.segment.motion) {
            (Verdict::Unknown, _) => NONE.to_owned(),
            (Verdict::Position { off, moving }, _) => match *moving > 0.0 {
                true => format!(
                    "{}° off, moves for {} s",
                    degrees(*off),
                    value(*moving, 1.0)
                ),
                false => format!("stands, {}° off", degrees(*off)),
            },
            (Verdict::Turn { angle, off, .. }, Some(LabelledMotion::Turns { .. })) => {
                format!(
                    "turns by {}°, its axis {}° off",
                    signed(*angle),
                    degrees(*off)
                )
            }
            (Verdict::Turn { .. }, _) => NONE.to_owned(),
        };
        vec![
            check.segment.label.clone(),
            value(check.segment.start, 1.0),
            value(check.segment.end, 1.0),
            found,
            if of_label(check).is_none() {
                "yes"
            } else {
                "no"
            }
            .to_owned(),
        ]
    });
    (!checks.is_empty()).then(|| {
        table(
            "Labelled sections",
            &["label", "from, s", "to, s", "found", "agrees"],
            rows.collect(),
            &[],
        )
    })
}

fn methods(report: &CheckReport) -> Table {
    let mut headings = vec![String::new()];
    headings.extend(Group::all().map(|group| format!("{}, {}", group.short(), group.unit())));
    let mut notes = vec![
        "RMS 1σ to be expected in the general form, from the prior's own σ on, linearised where the filter would begin; \
         the closed form's from its equations. Auxiliary terms are not in it."
            .to_owned(),
    ];
    let mut rows = Vec::new();
    for method in &report.survey.methods {
        let words = method.path.words();
        let mut row = vec![words.to_owned()];
        match &method.expected {
            Ok(expected) => {
                let shown = |&(group, mean): &(Group, Option<f64>)| {
                    mean.map_or(NONE.to_owned(), |mean| sigma(mean / group.unit_value()))
                };
                row.extend(expected.sigma.iter().map(shown));
                if !expected.unobserved.is_empty() {
                    let names = expected.unobserved.join(", ");
                    notes.push(format!("{words} would leave these above half the σ that [imu.prior] states: {names}."));
                }
            }
            Err(reason) => {
                row.extend([NONE; 6].map(str::to_owned));
                notes.push(format!("{words} cannot: {reason}."));
            }
        }
        rows.push(row);
    }
    Table {
        title: "What each method could see, 1σ",
        headings,
        sections: vec![rows],
        notes,
    }
}
