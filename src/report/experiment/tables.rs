//! The tables, for terminal and page alike.

use super::super::number::{ratio, three_digits, value};
use super::super::side_by_side::Table;
use super::{PAPER_HOURS, estimator_name, hours, in_general, method_name, miles, navigated};
use crate::calibration::Group;
use crate::imu::{InstallationForm, Sensor};
use crate::study::Experiment;
use crate::study::experiment::{Estimator, Method, Navigated, Situation, Spread, Worth};

pub(super) const NONE: &str = "–";

/// The paper's position errors by one triad's errors after 40 h, nmile (Zhao, Jiang, Li 2016, §3.3,
/// Figure 10).
pub(super) const PAPER: [(Sensor, InstallationForm, f64); 4] = [
    (Sensor::Gyro, InstallationForm::SixAngle, 6.10),
    (Sensor::Accel, InstallationForm::SixAngle, 4.16),
    (Sensor::Gyro, InstallationForm::ThreeAngle, 29.37),
    (Sensor::Accel, InstallationForm::ThreeAngle, 21.55),
];

pub(super) fn tables(experiment: &Experiment) -> Vec<Table> {
    let mut tables: Vec<Table> = experiment
        .navigations
        .iter()
        .map(|navigated| errors(experiment, navigated))
        .collect();
    if let Some(standing) = navigated(experiment, Situation::SelfAligned) {
        tables.push(paper(
            experiment,
            standing,
            "Beside the paper: one triad's errors alone, aligned by itself",
        ));
        tables.push(budget(
            experiment,
            standing,
            "Error budget, standing, aligned by itself",
        ));
    }
    if let Some(standing) = navigated(experiment, Situation::Aligned) {
        tables.push(paper(
            experiment,
            standing,
            "Beside the paper: one triad's errors alone, alignment given",
        ));
    }
    if let Some(moving) = navigated(experiment, Situation::Moving) {
        tables.push(budget(experiment, moving, "Error budget, moving"));
    }
    tables
}

pub(super) fn nmile(metres: f64) -> String {
    three_digits(miles(metres))
}

/// An interval in nmile.
pub(super) fn nmile_interval((low, high): (f64, f64)) -> String {
    format!("{}…{}", nmile(low), nmile(high))
}

fn errors(experiment: &Experiment, navigated: &Navigated) -> Table {
    let headings = [
        "nmile",
        "median",
        "99 % interval",
        "mean",
        "68 % below",
        "95 % below",
        "largest,\nmedian",
        "largest,\n95 % below",
        "closed form\n: EKF",
        "99 % interval",
    ];
    let row = |worth: &Worth| {
        let mut row = vec![
            method_name(experiment, worth.method),
            nmile(worth.at_end.median),
            nmile_interval(worth.median_interval),
        ];
        let at_end = &worth.at_end;
        row.extend([at_end.mean, at_end.below_68, at_end.below_95].map(nmile));
        row.extend([worth.largest.median, worth.largest.below_95].map(nmile));
        row.extend(match &worth.gain {
            Some(gain) => ratio(gain),
            None => [NONE; 2].map(str::to_owned),
        });
        row
    };
    let forms = InstallationForm::ALL.len();
    let mut sections: Vec<Vec<Vec<String>>> = navigated
        .methods
        .chunks(forms)
        .map(|of_estimator| of_estimator.iter().map(row).collect())
        .collect();
    let noise = &navigated.noise;
    let mut last = vec![
        "noise alone".to_owned(),
        nmile(noise.median),
        NONE.to_owned(),
    ];
    last.extend([noise.mean, noise.below_68, noise.below_95].map(nmile));
    last.resize(headings.len(), NONE.to_owned());
    sections.push(vec![last]);
    Table {
        title: match navigated.situation {
            Situation::SelfAligned => "Position error at the end, standing, aligned by itself",
            Situation::Aligned => "Position error at the end, standing, alignment given",
            Situation::Moving => "Position error at the end, moving, alignment given",
        },
        headings: headings.map(str::to_owned).to_vec(),
        sections,
        notes: vec![
            "Over all instruments. Largest: of all minutes. Closed form : EKF: ratio of the medians in \
             the same installation form, above 1 where the EKF is better; intervals by bootstrap."
                .to_owned(),
        ],
    }
}

fn paper(experiment: &Experiment, standing: &Navigated, title: &'static str) -> Table {
    let of = |estimator, form, sensor| {
        let method = Method { estimator, form };
        let worth = standing.methods.iter().find(|w| w.method == method);
        worth.map(|worth| *worth.by_one.get(sensor))
    };
    let mut headings = vec!["nmile".to_owned()];
    for estimator in Estimator::ALL {
        let name = estimator_name(experiment, estimator);
        headings.extend([format!("{name}\nmedian"), "\n95 % below".to_owned()]);
    }
    headings.push("paper".to_owned());
    let row = |sensor: Sensor, form: InstallationForm, paper: Option<f64>| {
        let mut row = vec![format!("errors of {}s, {}", sensor.name(), form.name())];
        for estimator in Estimator::ALL {
            row.extend(match of(estimator, form, sensor) {
                Some(Spread {
                    median, below_95, ..
                }) => [median, below_95].map(nmile),
                None => [NONE; 2].map(str::to_owned),
            });
        }
        row.push(paper.map_or(NONE.to_owned(), three_digits));
        row
    };
    let mut sections = vec![
        Sensor::ALL
            .map(|sensor| row(sensor, InstallationForm::General, None))
            .to_vec(),
    ];
    for pair in PAPER.chunks(Sensor::ALL.len()) {
        let rows = pair
            .iter()
            .map(|&(sensor, form, paper)| row(sensor, form, Some(paper)));
        sections.push(rows.collect());
    }
    let mut notes = vec![
        "Standing, position error at the end; the other triad is exact. Paper: one instrument on one \
         table, closed form (Zhao, Jiang, Li 2016, Figure 10), neither noise nor latitude stated."
            .to_owned(),
    ];
    if hours(experiment) != PAPER_HOURS {
        notes.push(format!(
            "The paper's are of {PAPER_HOURS} h, these of {} h.",
            three_digits(hours(experiment))
        ));
    }
    Table {
        title,
        headings,
        sections,
        notes,
    }
}

fn budget(experiment: &Experiment, navigated: &Navigated, title: &'static str) -> Table {
    let worths: Vec<(String, &Worth)> = Estimator::ALL
        .into_iter()
        .filter_map(|estimator| {
            let worth = in_general(navigated, estimator)?;
            Some((estimator_name(experiment, estimator), worth))
        })
        .collect();
    let mut headings = vec!["nmile, RMS".to_owned()];
    for (name, _) in &worths {
        headings.extend([format!("{name}\nalone"), "\nshare".to_owned()]);
    }
    let row = |place: usize, group: Group| {
        let mut row = vec![group.title()];
        for (_, worth) in &worths {
            row.extend(match worth.budget.parts.get(place) {
                Some(part) => [
                    nmile(part.alone),
                    format!("{} %", value(100.0 * part.share, 10.0)),
                ],
                None => [NONE; 2].map(str::to_owned),
            });
        }
        row
    };
    let total = |name: &str, of: &dyn Fn(&Worth) -> f64| {
        let mut row = vec![name.to_owned()];
        for (_, worth) in &worths {
            row.extend([nmile(of(worth)), String::new()]);
        }
        row
    };
    Table {
        title,
        headings,
        sections: vec![
            Group::all()
                .enumerate()
                .map(|(place, group)| row(place, group))
                .collect(),
            vec![
                total("all, claimed", &|w| w.budget.claimed),
                total("all, actual", &|w| w.budget.actual),
            ],
        ],
        notes: vec![
            "General form, from the claimed covariance averaged over all instruments. Alone: what the \
             group would make by itself. Share: of the variance, what two groups make together going \
             half to each; below zero where a group makes up for another."
                .to_owned(),
        ],
    }
}
