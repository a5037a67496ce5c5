//! The tables, which are the same on the terminal and on the page.

use crate::prelude::*;
use crate::terms::{title, unit};
use turncal::calibration::{ErrorTerm, Nis};
use turncal::imu::Sensor;
use turncal::study::accuracy::{Containment, Journey, Region};
use turncal::study::{Accuracy, Figures, Ratio};

const AGAINST_BOUND: &str = "| unit | RMS error | RMS σ | RMS bound | error/bound | 99 % interval";

/// A quantity with expected value one, with the digits that its interval allows.
pub fn mean(mean: f64, (low, high): (f64, f64)) -> String {
    if mean < 10.0 {
        value(mean, 0.5 * (high - low))
    } else {
        three_digits(mean)
    }
}

/// A factor with expected value one.
pub fn factor(factor: f64) -> String {
    mean(factor, (0.99, 1.01))
}

fn ratio_cells(of: Option<&Ratio>) -> [String; 2] {
    let cells = of.map(|of| with_interval(of.value, of.interval));
    cells.unwrap_or([NONE; 2].map(str::to_owned))
}

/// One row per item, with a section for each triad and one for navigation.
fn sections(
    accuracy: &Accuracy,
    cells: impl Fn(&Compared) -> Vec<String>,
) -> Vec<Vec<Vec<String>>> {
    let row = |of: &Compared| [cells![of.title.as_str(), of.unit], cells(of)].concat();
    compared(accuracy)
        .chunk_by(|a, b| a.sensor == b.sensor)
        .map(|section| section.iter().map(row).collect())
        .collect()
}

/// RMS error, σ and bound in a unit, and the ratio of error to bound.
fn against_bound(of: &Figures, unit: f64) -> Vec<String> {
    let rms = [of.filter, of.claimed, of.bound].map(|rms| three_digits(rms / unit));
    rms.into_iter()
        .chain(ratio_cells(of.ratio.as_ref()))
        .collect()
}

pub fn bound(accuracy: &Accuracy) -> Table {
    let cells = |of: &Compared| against_bound(of.figures, of.unit_value);
    Table::new("EKF against the Cramér–Rao bound", columns(AGAINST_BOUND))
        .sections(sections(accuracy, cells))
        .note("RMS over all runs and all parameters of a group. RMS σ: the σ computed by the filter.")
        .note("Position: horizontal error after 40 h of navigation from perfect alignment. Flight: the same quantity \
        along the trajectory flight.")
        .note("RMS bound: Bayesian Cramér–Rao bound, computed in a pass that is linearised at the truth. Interval: bootstrap over \
               runs.")
}

/// Table of the auxiliary parameters, term by term.
pub fn auxiliary(accuracy: &Accuracy) -> Table {
    let row = |(term, of): &(ErrorTerm, Figures)| {
        let (unit, in_si) = unit(*term);
        [cells![title(*term), unit], against_bound(of, in_si)].concat()
    };
    Table::new(
        "Error terms in addition to K, E and D",
        columns(AGAINST_BOUND),
    )
    .section(accuracy.error_terms.iter().map(row))
    .note("RMS over all runs and all parameters of a term.")
}

pub fn gain(accuracy: &Accuracy) -> Table {
    let baseline = &accuracy.baseline;
    let columns = cells![
        "",
        "unit",
        format!("EKF {}", minutes(accuracy.table_time)),
        format!("closed form {}", minutes(baseline.table_time)),
        "gain",
        "99 % interval",
        format!(
            "closed form {}",
            baseline.equal_time().map_or(NONE.to_owned(), minutes)
        ),
        "gain",
        "99 % interval",
    ];
    let cells = |of: &Compared| {
        let figures = of.figures;
        let shown = |rms: f64| three_digits(rms / of.unit_value);
        let mut row = vec![shown(figures.filter), or_dash(figures.closed_form, shown)];
        row.extend(ratio_cells(figures.gain.as_ref()));
        row.push(or_dash(figures.closed_form_in_equal_time, shown));
        row.extend(ratio_cells(figures.gain_in_equal_time.as_ref()));
        row
    };
    Table::new("EKF against the closed form, RMS error", columns)
        .sections(sections(accuracy, cells))
        .note("Gain: error of the closed form divided by error of the EKF; above 1, the EKF is better.")
}

pub fn consistency(accuracy: &Accuracy) -> Table {
    let directions = accuracy
        .filtered()
        .filter_map(|f| Some(f.nees?.count))
        .sum();
    let nees = accuracy.anees.map(|of| {
        cells![
            format!("NEES/{}", of.directions),
            mean(of.mean, of.interval_95),
            interval(of.interval_95),
            interval(of.interval_998),
            count(directions),
            NONE,
            NONE,
        ]
    });
    let nis = accuracy.nis().map(|(name, nis)| nis_row(name, nis));
    Table::new("Consistency", columns(
"| mean | 95 % interval | 99.8 % interval | numbers | lag-one correlation | 99 % if white",
))
        .section(nees.into_iter().chain(nis))
        .note("NEES/n: squared errors normalised by the stated covariance; NIS: squared innovations normalised by \
               their predicted covariance.")
        .note("Both are 1 if the σ are correct. The intervals follow from χ².")
}

fn nis_row(name: &str, nis: &Nis) -> Vec<String> {
    let white = white_within(nis);
    cells![
        format!("NIS {name}"),
        mean(nis.mean, nis.interval),
        NONE,
        interval(nis.interval),
        count(nis.count),
        value(nis.lag_one, white),
        format!("±{}", value(white, white)),
    ]
}

/// Actual and expected fraction of the errors that are within a region.
pub fn held(of: &Containment) -> String {
    let percent = |share: f64| value(100.0 * share, 1.0);
    let found = percent(of.within as f64 / of.runs as f64);
    let claimed = percent(of.region.probability());
    format!("{} {found} % (claimed {claimed} %)", region_name(of.region))
}

/// 99 % of a normal distribution lie within this many σ.
const SIGMAS_99: f64 = 2.576;

/// A compared error, with its presentation.
pub struct Compared<'a> {
    pub title: String,
    /// The triad; `None` for a position.
    pub sensor: Option<Sensor>,
    /// Symbol of the unit.
    pub unit: &'static str,
    /// The unit in SI.
    pub unit_value: f64,
    pub figures: &'a Figures,
}

/// The parameters group by group, then the position after each mission.
pub fn compared(accuracy: &Accuracy) -> Vec<Compared<'_>> {
    let groups = accuracy.groups.iter().map(|(group, figures)| Compared {
        title: group.title(),
        sensor: Some(group.sensor()),
        unit: group.unit(),
        unit_value: group.unit_value(),
        figures,
    });
    let positions = accuracy.navigation.iter().map(|of| Compared {
        title: format!("position, {}", journey_name(of.journey)),
        sensor: None,
        unit: "nmile",
        unit_value: NAUTICAL_MILE,
        figures: &of.figures,
    });
    groups.chain(positions).collect()
}

/// A mission in one word.
pub fn journey_name(journey: Journey) -> &'static str {
    match journey {
        Journey::Standing => "stationary",
        Journey::Flight => "flight",
    }
}

/// A region in words.
fn region_name(region: Region) -> String {
    match region {
        Region::East => "east within 1σ".to_owned(),
        Region::North => "north within 1σ".to_owned(),
        Region::Ellipse(sigmas) => format!("inside the {sigmas}σ ellipse"),
    }
}

/// 99 % limit of the lag-one correlation of white innovations.
pub fn white_within(nis: &Nis) -> f64 {
    SIGMAS_99 / (nis.count as f64).sqrt()
}
