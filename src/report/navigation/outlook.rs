//! Navigation errors of the calibrations of one run, or only their predicted σ if the truth is unknown.

use super::quantity::Quantity;
use crate::report::prelude::*;
use crate::study::navigation::{NavigationStudyError, Outlook};

const HEADING: &str = "Navigation with this calibration";

/// Navigation errors with the calibration of one method, stationary and level at the site of the run.
#[derive(Debug, Clone, PartialEq)]
pub struct Navigated {
    /// `EKF` or `closed form`.
    pub method: &'static str,
    /// The errors, if known.
    pub outlook: Vec<Outlook>,
}

/// One way of navigating by several calibrations.
#[derive(Debug, Clone, PartialEq)]
pub struct Flown {
    /// Motion of the body, such as `stationary and level`.
    pub how: &'static str,
    /// Its conclusion, in a sentence.
    pub shows: &'static str,
    /// The final state with each calibration, in the order of the methods.
    pub ends: Vec<Outlook>,
}

/// Adds position errors at the end of each mission for each method, one row per mission.
pub fn add_missions(document: &mut Document, methods: &[String], missions: &[Flown]) {
    let [.., horizontal] = Quantity::ALL;
    let of_missions = missions.iter().flat_map(|flown| [flown.how, "σ"]);
    let columns = std::iter::once("").chain(of_missions);
    let rows = methods.iter().enumerate().map(|(n, method)| {
        let ends = missions.iter().filter_map(|flown| flown.ends.get(n));
        let figures = ends.flat_map(|end| {
            let [error, sigma] = [horizontal.error(end), horizontal.sigma(end)];
            [error, sigma].map(|figure| or_dash(figure, three_digits))
        });
        std::iter::once(method.clone()).chain(figures).collect()
    });
    let table = Table::new("Position error after 40 h of navigation, nmile", columns).section(rows);
    let shows = missions.iter().map(|flown| flown.shows);
    let table = shows.fold(table, Table::note);
    document.brief.insert(1, table.into());
}

/// Adds table and figure.
pub fn add(document: &mut Document, navigation: Result<&[Navigated], &NavigationStudyError>) {
    match navigation {
        Err(reason) => {
            let text = format!("Not navigated from the site of the run: {reason}.");
            document.page(Block::Text(HEADING.to_owned(), text));
        }
        Ok([]) => {}
        Ok(navigated @ [.., last]) => {
            document.page(table(navigated));
            document.page(figure(navigated, last.method));
        }
    }
}

fn is_known(navigated: &[Navigated]) -> bool {
    let mut moments = navigated.iter().flat_map(|of| &of.outlook);
    moments.any(|moment| moment.error.is_some())
}

/// Duration, s.
fn duration(navigated: &[Navigated]) -> f64 {
    let ends = navigated.iter().filter_map(|of| of.outlook.last());
    ends.map(|end| end.time).fold(0.0, f64::max)
}

/// The unit of time of the report: its symbol and its length in seconds.
fn clock(navigated: &[Navigated]) -> (&'static str, f64) {
    let units = [("h", 3600.0), ("min", 60.0)].into_iter();
    let mut fits = units.filter(|(_, size)| duration(navigated) >= *size);
    fits.next().unwrap_or(("s", 1.0))
}

/// Duration in words.
fn long(navigated: &[Navigated]) -> String {
    let (unit, size) = clock(navigated);
    format!("{} {unit}", value(duration(navigated) / size, 10.0))
}

/// The position at the end in one line.
pub fn line(navigated: &[Navigated]) -> String {
    let [.., horizontal] = Quantity::ALL;
    let ends = navigated.iter().filter_map(|of| {
        let end = of.outlook.last()?;
        let (error, sigma) = (horizontal.error(end), horizontal.sigma(end)?);
        let (unit, scale) = horizontal.readable_unit(error.unwrap_or(sigma).abs());
        let sigma = three_digits(sigma * scale);
        Some(match error {
            Some(error) => {
                let error = three_digits(error * scale);
                format!("{} {error} {unit} (σ {sigma})", of.method)
            }
            None => format!("{} σ {sigma} {unit}", of.method),
        })
    });
    format!(
        "position error after {}, stationary and level: {}",
        long(navigated),
        ends.collect::<Vec<_>>().join(", ")
    )
}

/// Error and σ of one row by one calibration.
type Cells = [Option<f64>; 2];

fn table(navigated: &[Navigated]) -> Table {
    let known = is_known(navigated);
    let mut columns = vec![String::new(), "unit".to_owned()];
    for of in navigated {
        columns.extend(known.then(|| format!("{}: error", of.method)));
        columns.push(format!("{}: σ", of.method));
    }
    let row = |quantity: Quantity, name: &str, per: &str, of: &dyn Fn(&[Outlook]) -> Cells| {
        let cells: Vec<Cells> = navigated.iter().map(|n| of(&n.outlook)).collect();
        let sizes = cells.iter().flatten().flatten().map(|x| x.abs());
        let (unit, scale) = match per {
            // In nautical miles an hour others need no second look.
            "/h" => (quantity.unit(), 1.0),
            _ => quantity.readable_unit(sizes.fold(0.0, f64::max)),
        };
        let shown = |x: Option<f64>| or_dash(x, |x| three_digits(x * scale));
        let mut row = cells![name, format!("{unit}{per}")];
        for [error, sigma] in cells {
            row.extend(known.then(|| shown(error)));
            row.push(shown(sigma));
        }
        row
    };
    let at_end = |quantity: Quantity, of: &[Outlook]| match of.last() {
        Some(end) => [quantity.error(end), quantity.sigma(end)],
        None => [None; 2],
    };
    let end = |quantity: Quantity| {
        let name = format!("{} at the end", quantity.name);
        row(quantity, &name, "", &|of| at_end(quantity, of))
    };
    let [pitch, roll, heading, _, _, _, east, north, horizontal] = Quantity::ALL;
    let mut position = [east, north, horizontal].map(end).to_vec();
    let largest = |of: &[Outlook]| {
        let errors = of.iter().filter_map(|moment| horizontal.error(moment));
        [errors.reduce(f64::max), None]
    };
    let name = format!("{}, largest", horizontal.name);
    position.extend(known.then(|| row(horizontal, &name, "", &largest)));
    let (unit, second) = clock(navigated);
    let time = duration(navigated) / second;
    position.push(row(horizontal, "drift", &format!("/{unit}"), &|of| {
        at_end(horizontal, of).map(|x| Some(x? / time))
    }));
    Table::new(HEADING, columns)
        .section(position)
        .section([pitch, roll, heading].map(end))
        .note(format!(
            "{} stationary and level at the site of the run, heading North, from perfect alignment, with fixed \
             height, while predicted errors stay small (1° and 1 % of the Earth radius). σ: predicted from the \
             covariance of the calibration with the linear error model (RMS for horizontal errors).",
            long(navigated)
        ))
        .note(match known {
            true => "Errors are computed minus true. Drift: position error at the end divided by time.",
            false => "The truth is unknown, so errors are not shown.",
        })
}

/// Position error east and north against time.
fn figure(navigated: &[Navigated], last: &str) -> Plot {
    let (heading, mut caption) = match is_known(navigated) {
        true => (
            "Position error in navigation",
            format!(
                "Computed minus true, from full navigation with perfect alignment, stationary and level, with fixed \
                 height. Band: ±1σ of the {last} predicted from its covariance."
            ),
        ),
        false => (
            "Predicted position error in navigation",
            "±1σ of the error predicted from the covariance of the calibration, with perfect alignment, stationary \
             and level, with fixed height."
                .to_owned(),
        ),
    };
    if navigated.len() > 1 {
        caption += " Solid: EKF; dashed: closed form.";
    }
    let (unit, second) = clock(navigated);
    let all = navigated.iter().map(|of| (of.method, &of.outlook[..]));
    let all: Vec<(&str, &[Outlook])> = all.collect();
    let panels = [6, 7].map(|place| {
        let time = Axis::time(unit, duration(navigated) / second);
        Quantity::ALL[place].panel(time, second.recip(), &all)
    });
    Plot::new("navigation.svg", heading, (1, 250), panels).caption(caption)
}
