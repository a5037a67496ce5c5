//! What the calibrations of one run are worth: their navigation errors side by side, or where the truth is not
//! known their predicted σ alone.

use super::quantity::Quantity;
use crate::report::prelude::*;
use crate::study::navigation::{NavigationStudyError, Outlook};

const HEADING: &str = "Navigation with this calibration";

/// The navigation errors that one method's calibration leads to, stationary and level at the run's site.
#[derive(Debug, Clone, PartialEq)]
pub struct Navigated {
    /// `EKF` or `closed form`.
    pub method: &'static str,
    /// The errors, as far as they are known.
    pub outlook: Vec<Outlook>,
}

/// Adds the table.
pub fn add(document: &mut Document, navigation: Result<&[Navigated], &NavigationStudyError>) {
    match navigation {
        Err(reason) => {
            let text = format!("Not navigated from the site of the run: {reason}.");
            document.page(Block::Text(HEADING.to_owned(), text));
        }
        Ok([]) => {}
        Ok(navigated) => {
            document.page(table(navigated));
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

/// Error and its σ in the usual unit.
fn both(quantity: Quantity, moment: &Outlook) -> (Option<f64>, f64) {
    let error = moment.error.as_ref().map(|error| quantity.error(error));
    (error, quantity.of(&moment.sigma))
}

/// The position at the end in one line.
pub fn line(navigated: &[Navigated]) -> String {
    let [.., horizontal] = Quantity::ALL;
    let ends = navigated.iter().filter_map(|of| {
        let (error, sigma) = both(horizontal, of.outlook.last()?);
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

/// What a row shows.
#[derive(Clone, Copy)]
enum Of {
    /// The error at the end.
    End,
    /// The largest of all times.
    Largest,
    /// The error at the end over the time.
    Drift,
}

fn table(navigated: &[Navigated]) -> Table {
    let known = is_known(navigated);
    let mut columns = vec![String::new(), "unit".to_owned()];
    for of in navigated {
        columns.extend(known.then(|| format!("{}: error", of.method)));
        columns.push(format!("{}: σ", of.method));
    }
    let [pitch, roll, heading, _, _, _, east, north, horizontal] = Quantity::ALL;
    let mut position = [east, north, horizontal]
        .map(|of| row(navigated, of, Of::End))
        .to_vec();
    position.extend(known.then(|| row(navigated, horizontal, Of::Largest)));
    position.push(row(navigated, horizontal, Of::Drift));
    let attitude = [pitch, roll, heading].map(|angle| row(navigated, angle, Of::End));
    let table = Table::new(HEADING, columns)
        .section(position)
        .section(attitude)
        .note(format!(
            "{} stationary and level at the site of the run, heading North, from perfect alignment, height \
             held: as long as predicted errors stay small (1° and 1 % of the Earth's radius). σ: predicted from the covariance of the calibration by the linear error model; of horizontal \
             errors the root of the mean square.",
            long(navigated)
        ));
    table.note(match known {
        true => "Errors are computed minus true. Drift: position error at the end over the time.",
        false => "The truth is not known, so no error is shown.",
    })
}

fn row(navigated: &[Navigated], quantity: Quantity, of: Of) -> Vec<String> {
    let (unit_of_time, size_of_time) = clock(navigated);
    let time = duration(navigated) / size_of_time;
    let numbers: Vec<(Option<f64>, Option<f64>)> = navigated
        .iter()
        .map(|navigated| {
            let end = navigated.outlook.last().map(|end| both(quantity, end));
            let (error, sigma) = end.map_or((None, None), |(error, sigma)| (error, Some(sigma)));
            match of {
                Of::End => (error, sigma),
                Of::Largest => {
                    let errors = navigated.outlook.iter().filter_map(|m| both(quantity, m).0);
                    (errors.max_by(|a, b| a.abs().total_cmp(&b.abs())), None)
                }
                Of::Drift => (error.map(|x| x / time), sigma.map(|x| x / time)),
            }
        })
        .collect();
    let all = numbers.iter().flat_map(|&(error, sigma)| [error, sigma]);
    let largest = all.flatten().map(f64::abs).fold(0.0, f64::max);
    let (unit, scale) = quantity.readable_unit(largest);
    let (name, unit, scale) = match of {
        Of::End => (
            format!("{} at the end", quantity.name),
            unit.to_owned(),
            scale,
        ),
        Of::Largest => (
            format!("{}, largest", quantity.name),
            unit.to_owned(),
            scale,
        ),
        // In nautical miles an hour others need no second look.
        Of::Drift if unit_of_time == "h" => {
            ("drift".to_owned(), format!("{}/h", quantity.unit()), 1.0)
        }
        Of::Drift => ("drift".to_owned(), format!("{unit}/{unit_of_time}"), scale),
    };
    let shown = |x: Option<f64>| or_dash(x, |x| three_digits(x * scale));
    let mut row = vec![name, unit];
    for (error, sigma) in numbers {
        row.extend(is_known(navigated).then(|| shown(error)));
        row.push(shown(sigma));
    }
    row
}

/// Position error east and north against time; `None` if nothing was navigated.
pub fn figure(navigated: &[Navigated]) -> Option<Plot> {
    let last = navigated.last()?;
    let (heading, mut caption) = match is_known(navigated) {
        true => (
            "Position error in navigation",
            format!(
                "Computed minus true, by full navigation from perfect alignment, stationary and level, height \
                 held. Band: ±1σ of the {} predicted from its covariance.",
                last.method
            ),
        ),
        false => (
            "Predicted position error in navigation",
            "±1σ of the error predicted from the covariance of the calibration, from perfect alignment, \
             stationary and level, height held."
                .to_owned(),
        ),
    };
    if navigated.len() > 1 {
        caption += " Solid: EKF; dashed: closed form.";
    }
    let panels = [6, 7].map(|place| panel(Quantity::ALL[place], navigated));
    Some(Plot::new("navigation.svg", heading, (1, 250), panels).caption(caption))
}

fn panel(quantity: Quantity, navigated: &[Navigated]) -> Panel {
    let known = is_known(navigated);
    let (unit, second) = clock(navigated);
    let sigma = |of: &Navigated, sign: f64| -> Vec<Point> {
        let moments = of.outlook.iter();
        let points = moments.map(|m| (m.time / second, sign * both(quantity, m).1));
        points.collect()
    };
    let lines = navigated.iter().flat_map(|of| {
        let errors = of.outlook.iter();
        let errors = errors.filter_map(|m| Some((m.time / second, both(quantity, m).0?)));
        let lines = match known {
            true => vec![Series::line(errors).label(of.method)],
            false => {
                let name = format!("σ of {}", of.method);
                vec![
                    Series::line(sigma(of, 1.0)).label(name),
                    Series::line(sigma(of, -1.0)),
                ]
            }
        };
        let styled = |line: Series| match of.method {
            "EKF" => line,
            _ => line.nth(1).dashed(),
        };
        lines.into_iter().map(styled)
    });
    let band = navigated.last().map_or_else(Vec::new, |of| sigma(of, 1.0));
    let x = Axis::time(unit, duration(navigated) / second);
    quantity.panel(x, &band, lines.collect())
}
