//! The survey as a set of named values. Angles are in degrees, rates in deg/s, forces in m/s², times in s.

use std::collections::BTreeMap;

use super::tables::{column_of, columns_of_log};
use super::words;
use crate::prelude::*;
use turncal::imu::{AXES, Sensor};
use turncal::recording::{Fault, LabelledMotion};
use turncal::run::Run;
use turncal::run::motion::{LabelCheck, Rest, Turn, Verdict};
use turncal::survey::{Expected, Path, Survey};

pub fn data(run: &Run, survey: &Survey) -> Value {
    let imu = &run.recording.imu;
    let mut fault_samples: BTreeMap<&str, usize> = BTreeMap::new();
    for fault in &imu.faults {
        *fault_samples.entry(fault.kind.name()).or_default() += fault.samples.len();
    }
    let ways = survey.ways_up().into_iter().enumerate();
    let ways = ways.map(|(way, rests)| (words::way_up(way / 2, way % 2 == 1), rests));
    let ways: BTreeMap<String, usize> = ways.collect();
    json!({
        "run": run.recording.name,
        "samples": imu.len(),
        "sample_period_s": imu.period,
        "rate_hz": imu.period.recip(),
        "duration_s": imu.duration(),
        "continuous": imu.continuous,
        "table_readings": run.recording.table.as_ref().map_or(0, |table| table.time.len()),
        "unit": run.instrument.unit,
        "log": log(run),
        "faults": imu.faults.iter().map(|of| fault(run, of)).collect::<Value>(),
        "fault_samples": fault_samples,
        "standing_s": survey.standing,
        "longest_dwell_s": survey.longest,
        "dwells": survey.rests.iter().map(|rest| dwell(run, rest)).collect::<Value>(),
        "turns": survey.turns.iter().map(|of| turn(run, of)).collect::<Value>(),
        "ways_up": ways,
        "up_directions": survey.directions,
        "segments": survey.labels.iter().map(section).collect::<Value>(),
        "methods": survey.methods.iter().map(method).collect::<Value>(),
        "findings": words::findings(run, survey),
    })
}

fn degrees(angle: f64) -> f64 {
    angle / DEGREE
}

fn log(run: &Run) -> Option<Value> {
    let log = run.recording.imu.log.as_ref()?;
    let columns = columns_of_log(run).map(|(sensor, axis, column)| {
        let step_si = column.step_rate(run.recording.imu.period);
        let further = json!({ "sensor": sensor.name(), "axis": axis, "step_si": step_si });
        joined(json!(column), further)
    });
    let temperature = log.temperature.as_ref().map(|of| {
        let recorded = run.recording.imu.temperature.as_ref();
        let rate = recorded.map(|of| {
            let rates = Sensor::ALL.map(|sensor| of.largest_rate(sensor));
            rates[0].max(rates[1])
        });
        joined(json!(of), json!({ "largest_rate_k_per_s": rate }))
    });
    Some(json!({
        "rows": log.rows,
        "jitter_rms_s": log.jitter_rms,
        "jitter_max_s": log.jitter_max,
        "columns": columns.collect::<Value>(),
        "temperature": temperature,
    }))
}

fn fault(run: &Run, fault: &Fault) -> Value {
    json!({
        "kind": fault.kind.name(),
        "column": column_of(run, fault),
        "line": fault.line,
        "start_s": run.recording.imu.time(fault.samples.start),
        "samples": fault.samples.len(),
        "bridged": fault.bridged,
    })
}

fn dwell(run: &Run, rest: &Rest) -> Value {
    let [start, end] = rest.dwell.times(run);
    json!({
        "start_s": start,
        "end_s": end,
        "samples": rest.dwell.samples.len(),
        "force_m_s2": rest.force.norm(),
        "up": words::way_up(rest.up.axis, rest.up.down),
        "tilt_deg": degrees(rest.up.tilt),
        "off_table_deg": rest.off_table().map(degrees),
    })
}

fn turn(run: &Run, turn: &Turn) -> Value {
    let imu = &run.recording.imu;
    json!({
        "start_s": imu.time(turn.samples.start),
        "end_s": imu.time(turn.samples.end),
        "after_dwell": turn.from.map(|k| k + 1),
        "about": turn.body_axis().map(|axis| AXES[axis]),
        "axis": <[f64; 3]>::from(turn.axis),
        "angle_deg": degrees(turn.angle),
        "fastest_deg_s": degrees(turn.fastest),
        "off_gravity_deg": turn.off_gravity.map(degrees),
        "off_table_deg": turn.off_table.map(degrees),
    })
}

fn section(check: &LabelCheck) -> Value {
    let (off, moving, found) = match check.verdict {
        Verdict::Unknown => (None, None, None),
        Verdict::Position { off, moving, .. } => (Some(off), Some(moving), None),
        Verdict::Turn { angle, off, .. } => (Some(off), None, Some(angle)),
    };
    let labelled = match check.segment.motion {
        Some(LabelledMotion::Turns { angle, .. }) => Some(angle),
        _ => None,
    };
    json!({
        "label": check.segment.label,
        "start_s": check.segment.start,
        "end_s": check.segment.end,
        "agrees": check.disagreement.is_none(),
        "off_deg": off.map(degrees),
        "moving_s": moving,
        "angle_deg": found.map(degrees),
        "labelled_angle_deg": labelled.map(degrees),
    })
}

/// RMS 1σ by group, or the reason why there is none.
fn method((path, expected): &(Path, Result<Expected, String>)) -> Value {
    let name = path.words();
    match expected {
        Ok(expected) => {
            let sigma = expected.sigma.iter();
            let sigma: Map<String, Value> = sigma
                .map(|(group, sigma)| (group.key(), sigma.map(|s| s / group.unit_value()).into()))
                .collect();
            json!({ "method": name, "sigma": sigma, "not_observed": expected.unobserved })
        }
        Err(reason) => json!({ "method": name, "cannot": reason }),
    }
}
