//! The survey as named values. Angles are in degrees, rates in deg/s, forces in m/s², times in s.

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
    let mut data = json!({
        "run": run.recording.name,
        "samples": imu.len(),
        "sample_period_s": imu.period,
        "rate_hz": imu.period.recip(),
        "duration_s": imu.duration(),
        "continuous": imu.continuous,
        "table_readings": run.recording.table.as_ref().map_or(0, |table| table.time.len()),
        "unit": run.instrument.unit,
    });
    if let Some(log) = log(run) {
        data["log"] = log;
    }
    data["faults"] = imu.faults.iter().map(|of| fault(run, of)).collect();
    data["fault_samples"] = json!(fault_samples);
    data["standing_s"] = survey.standing.into();
    data["longest_dwell_s"] = survey.longest.into();
    data["dwells"] = survey.rests.iter().map(|rest| dwell(run, rest)).collect();
    data["turns"] = survey.turns.iter().map(|of| turn(run, of)).collect();
    data["ways_up"] = json!(ways);
    data["up_directions"] = survey.directions.into();
    data["segments"] = survey.labels.iter().map(section).collect();
    data["methods"] = survey.methods.iter().map(method).collect();
    data["findings"] = words::findings(run, survey).into();
    data
}

/// Adds an optional number.
fn put(data: &mut Value, key: &str, value: Option<impl Into<Value>>) {
    if let Some(value) = value {
        data[key] = value.into();
    }
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
    let mut data = json!({
        "rows": log.rows,
        "jitter_rms_s": log.jitter_rms,
        "jitter_max_s": log.jitter_max,
        "columns": columns.collect::<Value>(),
    });
    if let Some(of) = &log.temperature {
        data["temperature"] = json!(of);
        if let Some(temperature) = &run.recording.imu.temperature {
            let rates = Sensor::ALL.map(|sensor| temperature.largest_rate(sensor));
            data["temperature"]["largest_rate_k_per_s"] = json!(rates[0].max(rates[1]));
        }
    }
    Some(data)
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
    let mut data = json!({
        "start_s": start,
        "end_s": end,
        "samples": rest.dwell.samples.len(),
        "force_m_s2": rest.force.norm(),
        "up": words::way_up(rest.up.axis, rest.up.down),
        "tilt_deg": degrees(rest.up.tilt),
    });
    put(&mut data, "off_table_deg", rest.off_table().map(degrees));
    data
}

fn turn(run: &Run, turn: &Turn) -> Value {
    let imu = &run.recording.imu;
    let mut data = json!({
        "start_s": imu.time(turn.samples.start),
        "end_s": imu.time(turn.samples.end),
        "after_dwell": turn.from.map(|k| k + 1),
        "about": turn.body_axis().map(|axis| AXES[axis]),
        "axis": <[f64; 3]>::from(turn.axis),
        "angle_deg": degrees(turn.angle),
        "fastest_deg_s": degrees(turn.fastest),
        "off_gravity_deg": turn.off_gravity.map(degrees),
    });
    put(&mut data, "off_table_deg", turn.off_table.map(degrees));
    data
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
    let mut data = json!({
        "label": check.segment.label,
        "start_s": check.segment.start,
        "end_s": check.segment.end,
        "agrees": check.disagreement.is_none(),
    });
    put(&mut data, "off_deg", off.map(degrees));
    put(&mut data, "moving_s", moving);
    put(&mut data, "angle_deg", found.map(degrees));
    put(&mut data, "labelled_angle_deg", labelled.map(degrees));
    data
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
