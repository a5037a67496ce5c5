//! The tables, for terminal and page alike.

use super::super::blocks;
use super::super::further::{title, unit};
use super::super::number::{count, interval, minutes, ratio, three_digits, value};
use super::super::side_by_side::Table;
use super::merit::{Merit, journey_name, merits, region_name};
use super::verdict::white_within;
use crate::calibration::Nis;
use crate::study::accuracy::FurtherAccuracy;
use crate::study::{Accuracy, Ratio};

const NONE: &str = "–";
const AGAINST_BOUND: [&str; 7] = [
    "",
    "unit",
    "RMS error",
    "RMS σ",
    "RMS bound",
    "error/bound",
    "99 % interval",
];

pub(super) fn tables(accuracy: &Accuracy) -> Vec<Table> {
    let mut tables = vec![bound(accuracy), gain(accuracy), consistency(accuracy)];
    tables.extend(further(accuracy));
    tables.extend(blocks::tables(&accuracy.effects));
    tables.extend(containment(accuracy));
    tables
}

/// What ought to be one, with the digits that the width of its interval leaves meaning to.
pub(super) fn mean(mean: f64, (low, high): (f64, f64)) -> String {
    if mean < 10.0 {
        value(mean, 0.5 * (high - low))
    } else {
        three_digits(mean)
    }
}

/// A factor that ought to be one.
pub(super) fn factor(factor: f64) -> String {
    mean(factor, (0.99, 1.01))
}

fn ratio_cells(of: Option<&Ratio>) -> [String; 2] {
    of.map_or([NONE; 2].map(str::to_owned), ratio)
}

/// A row for each merit, a section for each triad and for navigation.
fn by_merit(accuracy: &Accuracy, cells: impl Fn(&Merit) -> Vec<String>) -> Vec<Vec<Vec<String>>> {
    let row = |of: &Merit| {
        let mut row = vec![of.title.clone(), of.unit.to_owned()];
        row.extend(cells(of));
        row
    };
    merits(accuracy)
        .chunk_by(|a, b| a.sensor == b.sensor)
        .map(|section| section.iter().map(row).collect())
        .collect()
}

/// RMS error, σ and bound in a unit, and the ratio of the first to the last.
fn against_bound(rms: [f64; 3], unit: f64, ratio: Option<&Ratio>) -> impl Iterator<Item = String> {
    let rms = rms.map(|rms| three_digits(rms / unit));
    rms.into_iter().chain(ratio_cells(ratio))
}

fn bound(accuracy: &Accuracy) -> Table {
    Table {
        title: "EKF against the Cramér–Rao bound",
        headings: AGAINST_BOUND.map(str::to_owned).to_vec(),
        sections: by_merit(accuracy, |of| {
            let figures = of.figures;
            let rms = [figures.filter, figures.claimed, figures.bound];
            against_bound(rms, of.unit_value, figures.ratio.as_ref()).collect()
        }),
        notes: [
            "RMS over all runs and the parameters of a group; σ: what the filter claims.",
            "Position: horizontal, after 40 h from perfect alignment; flight: the trajectory of that name.",
            "Bound: Bayesian, from a pass linearised at the truth. Interval: bootstrap over runs.",
        ]
        .map(str::to_owned)
        .to_vec(),
    }
}

/// Constants beside the parameters; none if no block of them was on.
fn further(accuracy: &Accuracy) -> Option<Table> {
    let row = |of: &FurtherAccuracy| {
        let (unit, in_si) = unit(of.block);
        [title(of.block).to_owned(), unit.to_owned()]
            .into_iter()
            .chain(against_bound(
                [of.filter, of.claimed, of.bound],
                in_si,
                of.ratio.as_ref(),
            ))
            .collect()
    };
    (!accuracy.further.is_empty()).then(|| Table {
        title: "Blocks of states beside K, E and D",
        headings: AGAINST_BOUND.map(str::to_owned).to_vec(),
        sections: vec![accuracy.further.iter().map(row).collect()],
        notes: vec!["RMS over all runs and the constants of a block.".to_owned()],
    })
}

fn gain(accuracy: &Accuracy) -> Table {
    let baseline = &accuracy.baseline;
    let equal = baseline.equal_time().map_or(NONE.to_owned(), minutes);
    let own = minutes(baseline.table_time);
    let headings = vec![
        String::new(),
        "unit".to_owned(),
        format!("EKF\n{}", minutes(accuracy.table_time)),
        format!("closed form\n{own}"),
        "gain".to_owned(),
        "99 % interval".to_owned(),
        format!("closed form\n{equal}"),
        "gain".to_owned(),
        "99 % interval".to_owned(),
    ];
    Table {
        title: "EKF against the closed form, RMS error",
        headings,
        sections: by_merit(accuracy, |of| {
            let figures = of.figures;
            let shown = |rms: f64| three_digits(rms / of.unit_value);
            let some = |rms: Option<f64>| rms.map_or(NONE.to_owned(), shown);
            let mut row = vec![shown(figures.filter), some(figures.closed_form)];
            row.extend(ratio_cells(figures.gain.as_ref()));
            row.push(some(figures.closed_form_in_equal_time));
            row.extend(ratio_cells(figures.gain_in_equal_time.as_ref()));
            row
        }),
        notes: vec![
            "Gain: error of the closed form over error of the EKF, above 1 where the EKF is better."
                .to_owned(),
        ],
    }
}

fn consistency(accuracy: &Accuracy) -> Table {
    let headings = [
        "",
        "mean",
        "95 % interval",
        "99.8 % interval",
        "numbers",
        "lag-one\ncorrelation",
        "99 % if\nwhite",
    ];
    let mut rows = Vec::new();
    rows.extend(accuracy.anees.map(|anees| {
        [
            format!("NEES/{}", anees.directions),
            mean(anees.mean, anees.interval_95),
            interval(anees.interval_95),
            interval(anees.interval_998),
            count(nees_numbers(accuracy)),
            NONE.to_owned(),
            NONE.to_owned(),
        ]
        .to_vec()
    }));
    for (name, nis) in [
        ("NIS zero velocity", &accuracy.velocity),
        ("NIS table attitude", &accuracy.table),
    ] {
        if nis.count > 0 {
            rows.push(nis_row(name, nis));
        }
    }
    Table {
        title: "Consistency",
        headings: headings.map(str::to_owned).to_vec(),
        sections: vec![rows],
        notes: [
            "NEES/n: squared errors over the claimed covariance; NIS: squared innovations over theirs.",
            "Both are one if σ are true; the intervals are χ².",
        ]
        .map(str::to_owned)
        .to_vec(),
    }
}

/// Whether position errors lie within their predicted σ; none if nothing was navigated.
fn containment(accuracy: &Accuracy) -> Option<Table> {
    let headings = [
        "",
        "runs",
        "within",
        "claimed",
        "99 % interval",
        "as claimed",
    ];
    let sections: Vec<Vec<Vec<String>>> = accuracy
        .navigation
        .iter()
        .filter(|of| !of.containment.is_empty())
        .map(|of| {
            let rows = of.containment.iter();
            rows.map(|held| {
                let share = |hits: usize| percent(hits as f64 / held.runs as f64);
                let (low, high) = held.interval;
                vec![
                    format!("{}: {}", journey_name(of.journey), region_name(held.region)),
                    count(held.runs),
                    format!("{} %", share(held.within)),
                    format!("{} %", percent(held.region.probability())),
                    format!("{}…{} %", share(low), share(high)),
                    if held.as_claimed() { "yes" } else { "NO" }.to_owned(),
                ]
            })
            .collect()
        })
        .collect();
    (!sections.is_empty()).then(|| Table {
        title: "Position error after 40 h within its predicted σ",
        headings: headings.map(str::to_owned).to_vec(),
        sections,
        notes: [
            "σ and ellipses: predicted from the covariance that the filter claims, by the linear error \
             model.",
            "Interval: binomial, of the share of the runs if the covariance is true.",
        ]
        .map(str::to_owned)
        .to_vec(),
    })
}

/// A share in per cent.
pub(super) fn percent(share: f64) -> String {
    value(100.0 * share, 1.0)
}

/// Number of independent directions in all runs.
fn nees_numbers(accuracy: &Accuracy) -> usize {
    let filtered = accuracy.trials.iter().filter_map(|t| t.filtered.as_ref());
    filtered.filter_map(|f| Some(f.nees?.count)).sum()
}

fn nis_row(name: &str, nis: &Nis) -> Vec<String> {
    let white = white_within(nis);
    vec![
        name.to_owned(),
        mean(nis.mean, nis.interval),
        NONE.to_owned(),
        interval(nis.interval),
        count(nis.count),
        value(nis.lag_one, white),
        format!("±{}", value(white, white)),
    ]
}
