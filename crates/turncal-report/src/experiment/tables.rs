//! The tables, the same for terminal and page.

use crate::prelude::*;
use turncal::calibration::Group;
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
    use Situation::{Aligned, Moving, SelfAligned};
    let with = |table: fn(&Experiment, &Navigated) -> Table, situation| {
        Some(table(experiment, navigated(experiment, situation)?))
    };
    let errors = experiment
        .navigations
        .iter()
        .map(|navigated| errors(experiment, navigated));
    let others = [
        with(paper, SelfAligned),
        with(budget, SelfAligned),
        with(paper, Aligned),
        with(budget, Moving),
    ];
    errors.chain(others.into_iter().flatten()).collect()
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
            "Over all instruments. Largest: maximum over all minutes. Closed form : EKF: ratio of the medians in the \
             same installation form (above 1, the EKF is better); intervals by bootstrap.",
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
    let table = Table::new(title, columns).section(general).sections(of_paper).note(
        "Position error at the end; the other triad is exact. Paper: one instrument on one table, closed form \
         (Zhao, Jiang, Li 2016, Figure 10), neither noise nor latitude stated.",
    );
    match hours(experiment) {
        PAPER_HOURS => table,
        hours => table.note(format!(
            "The paper navigates for {PAPER_HOURS} h, this study for {} h.",
            three_digits(hours)
        )),
    }
}

fn budget(experiment: &Experiment, navigated: &Navigated) -> Table {
    let worths = Estimator::ALL.into_iter().filter_map(|estimator| {
        let worth = in_general(navigated, estimator)?;
        Some((estimator_name(experiment, estimator), worth))
    });
    let worths: Vec<(String, &Worth)> = worths.collect();
    let mut columns = vec!["nmile, RMS".to_owned()];
    for (name, _) in &worths {
        columns.extend([format!("{name}: alone"), "share".to_owned()]);
    }
    let row = |(place, group): (usize, Group)| {
        let mut row = vec![group.title()];
        for (_, worth) in &worths {
            let part = worth.budget.parts.get(place);
            row.push(or_dash(part.map(|part| part.alone), three_digits));
            let share = part.map(|part| 100.0 * part.share);
            row.push(or_dash(share, |share| format!("{} %", value(share, 10.0))));
        }
        row
    };
    let total = |name: &str, of: &dyn Fn(&Worth) -> f64| {
        let mut row = vec![name.to_owned()];
        for (_, worth) in &worths {
            row.extend([three_digits(of(worth)), String::new()]);
        }
        row
    };
    let situation = situation_name(navigated.situation);
    Table::new(format!("Error budget, {situation}"), columns)
        .section(Group::all().enumerate().map(row))
        .section([
            total("all, claimed", &|w| w.budget.claimed),
            total("all, actual", &|w| w.budget.actual),
        ])
        .note(
            "General form, from the stated covariance averaged over all instruments. Alone: effect of the group by \
             itself. Share: part of the variance, with the covariance of two groups split equally; negative if a \
             group compensates another.",
        )
}

/// Hours of the paper's experiment.
pub const PAPER_HOURS: f64 = 40.0;

pub fn hours(experiment: &Experiment) -> f64 {
    f64::from(experiment.study.intervals) * INTERVAL / HOUR
}

/// Table time of an estimator, s.
pub fn table_time(experiment: &Experiment, estimator: Estimator) -> Option<f64> {
    let mut timed = Method::all().zip(&experiment.table_times);
    timed.find_map(|(method, time)| (method.estimator == estimator).then_some(*time))
}

/// Such as `EKF 10 min, six-angle`.
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

/// Such as `EKF 10 min`, to the minute; the facts give the exact value.
pub fn estimator_name(experiment: &Experiment, estimator: Estimator) -> String {
    let minutes = table_time(experiment, estimator).unwrap_or(f64::NAN) / 60.0;
    format!("{} {minutes:.0} min", method_kind(estimator))
}

pub fn situation_name(situation: Situation) -> &'static str {
    match situation {
        Situation::SelfAligned => "stationary, self-aligned",
        Situation::Aligned => "stationary, alignment given",
        Situation::Moving => "moving, alignment given",
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
