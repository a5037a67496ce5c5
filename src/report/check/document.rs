//! The survey as one JSON document. Angles are in degrees, rates in deg/s, forces in m/s², times in s.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{CheckReport, words};
use crate::imu::{AXES, PerSensor, Sensor};
use crate::recording::{Fault, LabelledMotion};
use crate::survey::{LabelCheck, MethodOutlook, Rest, Turn, Verdict};
use crate::units::DEGREE;

#[derive(Serialize)]
struct Document<'a> {
    run: &'a str,
    samples: usize,
    sample_period_s: f64,
    rate_hz: f64,
    duration_s: f64,
    continuous: bool,
    table_readings: usize,
    unit: &'a PerSensor<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    log: Option<Log<'a>>,
    faults: Vec<FaultFacts<'a>>,
    fault_samples: BTreeMap<&'static str, usize>,
    standing_s: f64,
    longest_dwell_s: f64,
    dwells: Vec<Dwell>,
    turns: Vec<Motion>,
    /// Dwells with that axis within 10° of the plumb line.
    ways_up: BTreeMap<String, usize>,
    up_directions: usize,
    segments: Vec<Section<'a>>,
    methods: Vec<Method<'a>>,
    findings: Vec<String>,
}

#[derive(Serialize)]
struct Log<'a> {
    rows: usize,
    jitter_rms_s: f64,
    jitter_max_s: f64,
    columns: Vec<Column<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    temperature: Option<Temperature>,
}

#[derive(Serialize)]
struct Column<'a> {
    name: &'a str,
    sensor: &'static str,
    axis: char,
    smallest: f64,
    at_smallest: usize,
    largest: f64,
    at_largest: usize,
    /// In the file's unit.
    step: Option<f64>,
    /// rad/s or m/s².
    step_si: Option<f64>,
}

#[derive(Serialize)]
struct Temperature {
    smallest: f64,
    mean: f64,
    largest: f64,
}

#[derive(Serialize)]
struct FaultFacts<'a> {
    kind: &'static str,
    column: Option<&'a str>,
    line: u64,
    start_s: f64,
    samples: usize,
    bridged: bool,
}

#[derive(Serialize)]
struct Dwell {
    start_s: f64,
    end_s: f64,
    samples: usize,
    force_m_s2: f64,
    up: String,
    tilt_deg: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    off_table_deg: Option<f64>,
}

#[derive(Serialize)]
struct Motion {
    start_s: f64,
    end_s: f64,
    /// The dwell before it, counted from one.
    after_dwell: Option<usize>,
    /// The body axis that it is about, if it is about one.
    about: Option<char>,
    axis: [f64; 3],
    angle_deg: f64,
    fastest_deg_s: f64,
    off_gravity_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    off_table_deg: Option<f64>,
}

#[derive(Serialize)]
struct Section<'a> {
    label: &'a str,
    start_s: f64,
    end_s: f64,
    agrees: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    off_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    moving_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    angle_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    labelled_angle_deg: Option<f64>,
}

#[derive(Serialize)]
struct Method<'a> {
    method: &'static str,
    /// RMS 1σ by group, such as `gyro.scale_ppm`.
    #[serde(skip_serializing_if = "Option::is_none")]
    sigma: Option<BTreeMap<String, Option<f64>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    not_observed: Option<&'a [String]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    cannot: Option<&'a str>,
}

pub(super) fn document<'a>(report: &CheckReport<'a>) -> impl Serialize + use<'a> {
    let (run, survey) = (report.run, report.survey);
    let imu = &run.recording.imu;
    let mut fault_samples = BTreeMap::new();
    for fault in &imu.faults {
        *fault_samples.entry(fault.kind.name()).or_default() += fault.samples.len();
    }
    let ways = survey.ways_up();
    let ways = ways
        .into_iter()
        .enumerate()
        .map(|(way, rests)| (words::way_up(way / 2, way % 2 == 1), rests));
    Document {
        run: &run.recording.name,
        samples: imu.len(),
        sample_period_s: imu.period,
        rate_hz: imu.period.recip(),
        duration_s: imu.duration(),
        continuous: imu.continuous,
        table_readings: run.recording.table.as_ref().map_or(0, |table| table.time.len()),
        unit: &run.instrument.unit,
        log: log(report),
        faults: imu
            .faults
            .iter()
            .map(|fault| fault_facts(report, fault))
            .collect(),
        fault_samples,
        standing_s: survey.standing.total,
        longest_dwell_s: survey.standing.longest,
        dwells: survey
            .rests
            .iter()
            .map(|rest| dwell(report, rest))
            .collect(),
        turns: survey
            .turns
            .iter()
            .map(|turn| motion(report, turn))
            .collect(),
        ways_up: ways.collect(),
        up_directions: survey.directions,
        segments: survey.labels.iter().map(section).collect(),
        methods: survey.methods.iter().map(method).collect(),
        findings: words::findings(report),
    }
}

fn log<'a>(report: &CheckReport<'a>) -> Option<Log<'a>> {
    let log = report.run.recording.imu.log.as_ref()?;
    let columns = Sensor::ALL.into_iter().flat_map(|sensor| {
        let steps = report.survey.steps.get(sensor);
        log.columns.get(sensor).iter().zip(steps).zip(AXES).map(
            move |((column, &step_si), axis)| Column {
                name: &column.name,
                sensor: sensor.name(),
                axis,
                smallest: column.smallest,
                at_smallest: column.at_smallest,
                largest: column.largest,
                at_largest: column.at_largest,
                step: column.step,
                step_si,
            },
        )
    });
    Some(Log {
        rows: log.rows,
        jitter_rms_s: log.jitter_rms,
        jitter_max_s: log.jitter_max,
        columns: columns.collect(),
        temperature: log.temperature.map(|of| Temperature {
            smallest: of.smallest,
            mean: of.mean,
            largest: of.largest,
        }),
    })
}

fn fault_facts<'a>(report: &CheckReport<'a>, fault: &Fault) -> FaultFacts<'a> {
    let imu = &report.run.recording.imu;
    FaultFacts {
        kind: fault.kind.name(),
        column: fault.axis.and_then(|(sensor, axis)| {
            Some(imu.log.as_ref()?.columns.get(sensor)[axis].name.as_str())
        }),
        line: fault.line,
        start_s: imu.time(fault.samples.start),
        samples: fault.samples.len(),
        bridged: fault.bridged,
    }
}

fn dwell(report: &CheckReport, rest: &Rest) -> Dwell {
    let [start_s, end_s] = rest.times(report.run);
    Dwell {
        start_s,
        end_s,
        samples: rest.dwell.samples.len(),
        force_m_s2: rest.force.norm(),
        up: words::way_up(rest.up.axis, rest.up.down),
        tilt_deg: rest.up.tilt / DEGREE,
        off_table_deg: rest.off_table().map(|off| off / DEGREE),
    }
}

fn motion(report: &CheckReport, turn: &Turn) -> Motion {
    let (imu, rests) = (&report.run.recording.imu, &report.survey.rests);
    Motion {
        start_s: imu.time(turn.samples.start),
        end_s: imu.time(turn.samples.end),
        after_dwell: turn.from.map(|k| k + 1),
        about: turn.body_axis().map(|axis| AXES[axis]),
        axis: turn.axis.into(),
        angle_deg: turn.angle / DEGREE,
        fastest_deg_s: turn.fastest / DEGREE,
        off_gravity_deg: turn.off_gravity(rests).map(|off| off / DEGREE),
        off_table_deg: turn.off_table(rests).map(|off| off / DEGREE),
    }
}

fn section(check: &LabelCheck) -> Section<'_> {
    let (mut off, mut moving_s, mut found) = (None, None, None);
    match check.verdict {
        Verdict::Unknown => {}
        Verdict::Position { off: angle, moving } => {
            off = Some(angle);
            moving_s = Some(moving);
        }
        Verdict::Turn {
            angle,
            off: of_axis,
            ..
        } => {
            found = Some(angle);
            off = Some(of_axis);
        }
    }
    let labelled = match check.segment.motion {
        Some(LabelledMotion::Turns { angle, .. }) => Some(angle),
        _ => None,
    };
    Section {
        label: &check.segment.label,
        start_s: check.segment.start,
        end_s: check.segment.end,
        agrees: check.agrees(),
        off_deg: off.map(|off| off / DEGREE),
        moving_s,
        angle_deg: found.map(|angle| angle / DEGREE),
        labelled_angle_deg: labelled.map(|angle| angle / DEGREE),
    }
}

fn method(method: &MethodOutlook) -> Method<'_> {
    let expected = method.expected.as_ref();
    Method {
        method: method.path.words(),
        sigma: expected.ok().map(|expected| {
            let sigma = expected.sigma.iter();
            sigma
                .map(|&(group, sigma)| (group.key(), sigma.map(|s| s / group.unit_value())))
                .collect()
        }),
        not_observed: expected.ok().map(|expected| expected.unobserved.as_slice()),
        cannot: expected.err().map(String::as_str),
    }
}
