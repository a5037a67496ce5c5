//! The recording: gyro and accelerometer output against time, with dwells, turns and faults.

use super::super::calibration::figures::samples;
use super::words;
use crate::prelude::*;
use turncal::imu::Sensor;
use turncal::run::Run;
use turncal::run::motion::{Rest, Turn};
use turncal::survey::Survey;

pub fn figure(run: &Run, survey: &Survey) -> Plot {
    let mut caption = "Gyro rates and specific force along the body axes, computed from the log with nominal scales. \
                       Grey: dwells, with number and upward axis. The labels above the rates give the axis and angle \
                       of each turn (for turns about several axes, only the angle), where space permits."
        .to_owned();
    if !run.recording.imu.faults.is_empty() {
        caption += " Crosses: log faults in the samples of this triad; missing and duplicate rows are marked for both \
        triads.";
    }
    let panels = Sensor::ALL.map(|sensor| panel(run, survey, sensor));
    Plot::new("record.svg", "Recording", (1, 310), panels).caption(caption)
}

fn panel(run: &Run, survey: &Survey, sensor: Sensor) -> Panel {
    let imu = &run.recording.imu;
    let (unit, title) = match sensor {
        Sensor::Gyro => (DEGREE, "angular rate, °/s"),
        Sensor::Accel => (1.0, "specific force, m/s²"),
    };
    let rests = survey.rests.iter();
    let dwells: Vec<_> = rests
        .map(|rest| rest.dwell.times(run))
        .map(|[from, to]| from..to)
        .collect();
    let tags: Vec<(f64, String)> = match sensor {
        Sensor::Gyro => survey.turns.iter().map(|turn| of_turn(run, turn)).collect(),
        Sensor::Accel => {
            let rests = survey.rests.iter().enumerate();
            rests.map(|(k, rest)| of_dwell(run, k, rest)).collect()
        }
    };
    let faults = imu.faults.iter();
    let faults = faults.filter(|fault| fault.axis.is_none_or(|(of, _)| of == sensor));
    let x = Axis::linear("time, s").between(imu.start(), imu.end());
    let y = Axis::linear("").including([0.0]).room(0.1, 0.3);
    let lines = samples(imu, sensor, unit);
    let corners = lines.iter().flat_map(|line| line.shape.corners());
    let foot = corners.map(|corner| corner.1).fold(0.0, f64::min);
    let crosses = faults.map(|fault| (imu.time(fault.samples.start), foot));
    Panel::new(title, x, y)
        .shaded(&dwells)
        .tagged(tags)
        .with_all(lines)
        .with(Series::marks(Mark::Cross, crosses).color(Color::Ink))
}

fn of_turn(run: &Run, turn: &Turn) -> (f64, String) {
    let imu = &run.recording.imu;
    let (start, end) = (imu.time(turn.samples.start), imu.time(turn.samples.end));
    (0.5 * (start + end), words::turn(turn))
}

fn of_dwell(run: &Run, k: usize, rest: &Rest) -> (f64, String) {
    let [from, to] = rest.dwell.times(run);
    let mut text = (k + 1).to_string();
    if rest.up.is_upright() {
        text += &format!(" {}", words::way_up(rest.up.axis, rest.up.down));
    }
    (0.5 * (from + to), text)
}
