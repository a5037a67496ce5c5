//! The log, dwells and turns, labels and methods as tables.

use super::words::{degrees, direction, of_label, signed, way_up};
use crate::prelude::*;
use turncal::calibration::Group;
use turncal::imu::{AXES, Sensor};
use turncal::recording::{ColumnFacts, Fault, LabelledMotion, Slower};
use turncal::run::Run;
use turncal::run::motion::{LabelCheck, Rest, Turn, Verdict};
use turncal::survey::Survey;

/// Largest number of faults listed one by one.
const LISTED: usize = 20;

pub fn log_columns(run: &Run) -> Table {
    let rows = columns_of_log(run).map(|(sensor, axis, column)| {
        let (unit, symbol) = match sensor {
            Sensor::Gyro => (DEG_PER_H, "°/h"),
            Sensor::Accel => (MICRO_G, "µg"),
        };
        let as_rate = |rate: f64| format!("{} {symbol}", three_digits(rate / unit));
        cells![
            column.name.as_str(),
            format!("{} {axis}", sensor.name()),
            exactly(column.smallest),
            count(column.at_smallest),
            exactly(column.largest),
            count(column.at_largest),
            run.instrument.unit.get(sensor).as_str(),
            or_dash(column.step, three_digits),
            or_dash(column.step_rate(run.recording.imu.period), as_rate),
        ]
    });
    Table::new(
        "Columns",
        columns(
            "column | body axis | smallest | count | largest | count | unit | step | step as rate",
        ),
    )
    .section(rows)
    .note("Body axes are right, front, up. Step: resolution of the log (all values are multiples of this step).")
}

/// Columns of the log with triad and axis.
pub fn columns_of_log(run: &Run) -> impl Iterator<Item = (Sensor, char, &ColumnFacts)> {
    let log = run.recording.imu.log.iter();
    log.flat_map(|log| {
        Sensor::ALL.into_iter().flat_map(|sensor| {
            let columns = log.columns.get(sensor).iter().zip(AXES);
            columns.map(move |(column, axis)| (sensor, axis, column))
        })
    })
}

/// A whole number unchanged, others to four digits.
fn exactly(x: f64) -> String {
    if x.fract() == 0.0 {
        whole(x)
    } else {
        value(x, x.abs() / 100.0)
    }
}

pub fn faults(run: &Run) -> Table {
    let imu = &run.recording.imu;
    let slower = imu.slower();
    let row = |what: &str, column: &str, (line, start): (u64, usize), samples, bridged: &str| {
        let at = value(imu.time(start), 0.1);
        cells![
            what,
            column,
            count(line as usize),
            at,
            count(samples),
            bridged
        ]
    };
    let of_fault = |fault: &Fault| {
        let column = column_of(run, fault).unwrap_or("rows");
        let bridged = if fault.bridged { "yes" } else { "no" };
        let (place, samples) = ((fault.line, fault.samples.start), fault.samples.len());
        row(fault.kind.name(), column, place, samples, bridged)
    };
    let of_part = |part: &Slower| {
        let bridged = match part.places - part.bridged {
            0 => "yes".to_owned(),
            _ => format!("{} of {}", count(part.bridged), count(part.places)),
        };
        let place = (part.line, part.samples.start);
        row("lower rate", "rows", place, part.missing(), &bridged)
    };
    let is_beside = |fault: &&Fault| !slower.iter().any(|part| part.holds(fault));
    let beside = || imu.faults.iter().filter(is_beside);
    let table = Table::new(
        "Faults",
        columns("what | column | line | at, s | samples | bridged"),
    )
    .section(slower.iter().map(of_part))
    .section(beside().take(LISTED).map(of_fault));
    match beside().count().saturating_sub(LISTED) {
        0 => table,
        more => table.note(format!("And {} more.", count(more))),
    }
}

/// The file column of a fault; `None` if whole rows are affected.
pub fn column_of<'r>(run: &'r Run, fault: &Fault) -> Option<&'r str> {
    let (sensor, axis) = fault.axis?;
    Some(&run.recording.imu.log.as_ref()?.columns.get(sensor)[axis].name)
}

pub fn dwells(run: &Run, survey: &Survey) -> Table {
    let after = |k: usize| survey.turns.iter().find(|turn| turn.from == Some(k));
    let row = |(k, rest): (usize, &Rest)| {
        let [begin, end] = rest.dwell.times(run);
        let mut row = cells![
            (k + 1).to_string(),
            value(begin, 1.0),
            value(end, 1.0),
            three_digits(end - begin),
            value((rest.force.norm() - run.site.gravity) / MILLI_G, 1.0),
            way_up(rest.up.axis, rest.up.down),
            degrees(rest.up.tilt),
        ];
        row.extend(after(k).map_or([NONE; 4].map(str::to_owned), moved));
        row
    };
    #[rustfmt::skip]
    let headings = [
        "", "from, s", "to, s", "for, s", "|f| − g, mg", "up", "tilt, °", "then about", "by, °", "at, °/s",
        "off gravity, °",
    ];
    Table::new("Dwells, and the turns after them", headings)
        .section(survey.rests.iter().enumerate().map(row))
        .note(
            "The angles are computed with nominal scales and prior biases. Tilt: angle between the upward axis and the \
             vertical. By: right-handed angle of the turn, relative to the gyro output in the previous \
             dwell. At: maximum rate. \
             Off gravity: angle between the vertical that the gyros carried over to the next dwell and the vertical \
             that the accelerometers measured there.",
        )
}

fn moved(turn: &Turn) -> [String; 4] {
    let about = match turn.body_axis() {
        Some(axis) => AXES[axis].to_string(),
        None if turn.single => direction(turn),
        None => "several".to_owned(),
    };
    let by = if turn.single {
        signed(turn.angle)
    } else {
        degrees(turn.angle.abs())
    };
    let off = or_dash(turn.off_gravity, degrees);
    [about, by, value(turn.fastest / DEGREE, 1.0), off]
}

pub fn labels(survey: &Survey) -> Table {
    let row = |check: &LabelCheck| {
        let found = match (check.verdict, check.segment.motion) {
            (Verdict::Position { off, moving, .. }, _) if moving > 0.0 => {
                let (off, moving) = (degrees(off), value(moving, 1.0));
                format!("{off}° off, moves for {moving} s")
            }
            (Verdict::Position { off, .. }, _) => format!("stationary, {}° off", degrees(off)),
            (Verdict::Turn { angle, off, .. }, Some(LabelledMotion::Turns { .. })) => {
                let (angle, off) = (signed(angle), degrees(off));
                format!("turns by {angle}°, about an axis that is {off}° off")
            }
            (Verdict::Unknown | Verdict::Turn { .. }, _) => NONE.to_owned(),
        };
        cells![
            check.segment.label.as_str(),
            value(check.segment.start, 1.0),
            value(check.segment.end, 1.0),
            found,
            of_label(check).map_or("yes", |_| "no"),
        ]
    };
    Table::new(
        "Labelled sections",
        columns("label | from, s | to, s | found | agrees"),
    )
    .section(survey.labels.iter().map(row))
}

pub fn methods(survey: &Survey) -> Table {
    let heading = "What each method could observe, 1σ";
    let mut table = Table::new(heading, group_columns("")).note(
        "Predicted 1σ in the general form (RMS per group), from the prior σ and a linearisation at the starting point \
         of the filter; for the closed form, from its equations. The prediction includes neither the noise of hand \
         motion nor the error terms.",
    );
    let mut rows = Vec::new();
    for (path, expected) in &survey.methods {
        let words = path.words();
        let mut row = cells![words];
        match expected {
            Ok(expected) => {
                let shown = |&(group, mean): &(Group, Option<f64>)| {
                    or_dash(mean, |mean| sigma(mean / group.unit_value()))
                };
                row.extend(expected.sigma.iter().map(shown));
                if !expected.unobserved.is_empty() {
                    let names = expected.unobserved.join(", ");
                    table = table.note(format!(
                        "{words} would leave the σ of these parameters above half of the prior σ in [imu.prior]: \
                         {names}."
                    ));
                }
            }
            Err(reason) => {
                row.extend([NONE; 6].map(str::to_owned));
                table = table.note(format!("{words} cannot: {reason}."));
            }
        }
        rows.push(row);
    }
    table.section(rows)
}
