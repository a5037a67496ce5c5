//! The tables, which are the same on the terminal and on the page.

use crate::prelude::*;
use turncal::imu::{InstallationForm, Sensor};
use turncal::study::Experiment;
use turncal::study::experiment::{Estimator, Method, Navigated, Situation, Worth};
use turncal::study::navigation::INTERVAL;

/// Position errors in the paper due to one triad after 40 h, nmile (Zhao, Jiang, Li 2016, §3.3, Figure 10).
pub const PAPER: [(Sensor, InstallationForm, f64); 4] = [
    (Sensor::Gyro, InstallationForm::SixAngle, 6.10),
    (Sensor::Accel, InstallationForm::SixAngle, 4.16),
    (Sensor::Gyro, InstallationForm::ThreeAngle, 29.37),
    (Sensor::Accel, InstallationForm::ThreeAngle, 21.55),
];

pub fn tables(experiment: &Experiment) -> Vec<Table> {
    let all = &experiment.navigations;
    let errors = all.iter().map(|of| errors(experiment, of));
    let stationary = all.iter().filter(|of| of.situation != Situation::Moving);
    let paper = stationary.map(|of| paper(experiment, of));
    errors.chain(paper).collect()
}

fn errors(experiment: &Experiment, navigated: &Navigated) -> Table {
    let headings = columns(
        "nmile | median | 99 % interval | mean | 68 % below | 95 % below | largest, median | \
         largest, 95 % below | closed form : EKF | 99 % interval",
    );
    let headings: Vec<&str> = headings.collect();
    let row = |worth: &Worth| {
        let (at_end, largest) = (&worth.at_end, &worth.largest);
        let (low, high) = worth.median_interval;
        let mut row = cells![
            method_name(experiment, worth.method),
            three_digits(at_end.median),
            format!("{}…{}", three_digits(low), three_digits(high)),
        ];
        row.extend([at_end.mean, at_end.below_68, at_end.below_95].map(three_digits));
        row.extend([largest.median, largest.below_95].map(three_digits));
        let gain = worth
            .gain
            .map(|gain| with_interval(gain.value, gain.interval));
        row.extend(gain.unwrap_or([NONE; 2].map(str::to_owned)));
        row
    };
    let noise = &navigated.noise;
    let mut last = cells!["noise alone", three_digits(noise.median), NONE];
    last.extend([noise.mean, noise.below_68, noise.below_95].map(three_digits));
    last.resize(headings.len(), NONE.to_owned());
    let by_estimator = navigated.methods.chunks(InstallationForm::ALL.len());
    let situation = situation_name(navigated.situation);
    Table::new(format!("Position error at the end, {situation}"), headings)
        .sections(by_estimator.map(|of_estimator| of_estimator.iter().map(row)))
        .section([last])
        .note(
            "Over all instruments. Largest: maximum over time, from values at intervals of one minute. Closed form : EKF: ratio of the \
             medians in the same misalignment form (above 1, the EKF is better); intervals by bootstrap.",
        )
}

fn paper(experiment: &Experiment, navigated: &Navigated) -> Table {
    let mut columns = vec!["nmile".to_owned()];
    for estimator in Estimator::ALL {
        let name = estimator_name(experiment, estimator);
        columns.extend([format!("{name}: median"), "95 % below".to_owned()]);
    }
    columns.push("paper".to_owned());
    let row = |sensor: Sensor, form: InstallationForm, paper: Option<f64>| {
        let mut row = vec![format!("errors of {}s, {}", sensor.name(), form.name())];
        for estimator in Estimator::ALL {
            let method = Method { estimator, form };
            let worth = navigated.methods.iter().find(|w| w.method == method);
            let spread = worth.map(|worth| worth.by_one.get(sensor));
            row.push(or_dash(spread.map(|of| of.median), three_digits));
            row.push(or_dash(spread.map(|of| of.below_95), three_digits));
        }
        row.push(or_dash(paper, three_digits));
        row
    };
    let general = Sensor::ALL.map(|sensor| row(sensor, InstallationForm::General, None));
    let of_paper = PAPER.chunks(Sensor::ALL.len()).map(|pair| {
        pair.iter()
            .map(|&(sensor, form, paper)| row(sensor, form, Some(paper)))
    });
    let situation = situation_name(navigated.situation);
    let title = format!("Comparison with the paper: errors of one triad alone, {situation}");
    Table::new(title, columns).section(general).sections(of_paper).note(
        "Position error at the end if the other triad has no errors. Paper: after 40 h, for one instrument on one \
         table with the closed form (Zhao, Jiang, Li 2016, Figure 10); neither noise nor latitude is stated.",
    )
}

/// Duration of the navigation.
pub fn hours(experiment: &Experiment) -> f64 {
    f64::from(experiment.study.intervals) * INTERVAL / HOUR
}

/// Table time of an estimator, s.
pub fn table_time(experiment: &Experiment, estimator: Estimator) -> Option<f64> {
    let mut timed = Method::all().zip(&experiment.table_times);
    timed.find_map(|(method, time)| (method.estimator == estimator).then_some(*time))
}

/// Name of a method, such as `EKF 10 min, six-angle`.
pub fn method_name(experiment: &Experiment, method: Method) -> String {
    let estimator = estimator_name(experiment, method.estimator);
    format!("{estimator}, {}", method.form.name())
}

pub fn method_kind(estimator: Estimator) -> &'static str {
    match estimator {
        Estimator::ClosedForm => "closed form",
        Estimator::Filter | Estimator::LongFilter => "EKF",
    }
}

/// Name of an estimator with its table time to the minute, such as `EKF 10 min`; the facts give the exact time.
pub fn estimator_name(experiment: &Experiment, estimator: Estimator) -> String {
    let minutes = table_time(experiment, estimator).unwrap_or(f64::NAN) / 60.0;
    format!("{} {minutes:.0} min", method_kind(estimator))
}

pub fn situation_name(situation: Situation) -> &'static str {
    match situation {
        Situation::SelfAligned => "stationary, self-aligned",
        Situation::Aligned => "stationary, aligned",
        Situation::Moving => "moving, aligned",
    }
}

/// Error budget of a method in the general form.
pub fn in_general(navigated: &Navigated, estimator: Estimator) -> Option<&Worth> {
    let general = Method {
        estimator,
        form: InstallationForm::General,
    };
    navigated.methods.iter().find(|w| w.method == general)
}

pub fn navigated(experiment: &Experiment, situation: Situation) -> Option<&Navigated> {
    experiment
        .navigations
        .iter()
        .find(|n| n.situation == situation)
}
