//! What the calibrations of one run are worth: their navigation errors side by side, or where the truth is not
//! known their predicted σ alone.

use super::document::{Block, Document, Table};
use super::number::{self, three_digits};
use super::plot::{Axis, Panel, Plot, Point, Series};
use super::quantity::Quantity;
use crate::study::navigation::{NavigationStudyError, Outlook};

const HOUR: f64 = 3600.0;
/// Errors of two methods this many times apart share an axis that is logarithmic.
const APART: f64 = 20.0;
const HEADING: &str = "Navigation with this calibration";

/// The navigation errors that one method's calibration leads to, stationary and level at the run's site.
#[derive(Debug, Clone, PartialEq)]
pub struct Navigated {
    /// `EKF` or `closed form`.
    pub method: &'static str,
    /// The errors, as far as they are known.
    pub outlook: Vec<Outlook>,
}

/// Adds the table, and for a terminal its position error in a line.
pub(super) fn add(
    document: &mut Document,
    navigation: Result<&[Navigated], &NavigationStudyError>,
) {
    match navigation {
        Err(reason) => {
            let text = format!("Not navigated from the site of the run: {reason}.");
            document.page(Block::Text(HEADING.to_owned(), text));
        }
        Ok([]) => {}
        Ok(navigated) => {
            document.terminal(Block::Text(String::new(), line(navigated)));
            document.page(table(navigated));
        }
    }
}

fn is_known(navigated: &[Navigated]) -> bool {
    let mut moments = navigated.iter().flat_map(|of| &of.outlook);
    moments.any(|moment| moment.error.is_some())
}

/// Duration.
fn hours(navigated: &[Navigated]) -> f64 {
    let ends = navigated.iter().filter_map(|of| of.outlook.last());
    ends.map(|end| end.time / HOUR).fold(0.0, f64::max)
}

/// Error and its σ in the usual unit.
fn both(quantity: Quantity, moment: &Outlook) -> (Option<f64>, f64) {
    let error = moment.error.as_ref().map(|error| quantity.error(error));
    (error, quantity.of_sigma(&moment.sigma))
}

/// The position at the end in one line.
fn line(navigated: &[Navigated]) -> String {
    let [.., horizontal] = Quantity::ALL;
    let ends = navigated.iter().filter_map(|of| {
        let (error, sigma) = both(horizontal, of.outlook.last()?);
        let sigma = three_digits(sigma);
        Some(match error {
            Some(error) => format!("{} {} nmile (σ {sigma})", of.method, three_digits(error)),
            None => format!("{} σ {sigma} nmile", of.method),
        })
    });
    format!(
        "Position error after {} h of navigation, stationary and level: {}",
        number::value(hours(navigated), 10.0),
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
            "{} h stationary and level at the site of the run, heading North, from perfect alignment, height \
             held. σ: predicted from the covariance of the calibration by the linear error model; of horizontal \
             errors the root of the mean square.",
            number::value(hours(navigated), 10.0)
        ));
    table.note(match known {
        true => "Errors are computed minus true. Drift: position error at the end over the time.",
        false => "The truth is not known, so no error is shown.",
    })
}

fn row(navigated: &[Navigated], quantity: Quantity, of: Of) -> Vec<String> {
    let hours = hours(navigated);
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
                Of::Drift => (error.map(|x| x / hours), sigma.map(|x| x / hours)),
            }
        })
        .collect();
    let all = numbers.iter().flat_map(|&(error, sigma)| [error, sigma]);
    let largest = all.flatten().map(f64::abs).fold(0.0, f64::max);
    let (unit, scale) = quantity.readable_unit(largest);
    let (name, unit, scale) = match of {
        Of::End => (
            format!("{} at the end", quantity.name()),
            unit.to_owned(),
            scale,
        ),
        Of::Largest => (
            format!("{}, largest", quantity.name()),
            unit.to_owned(),
            scale,
        ),
        // In nautical miles others need no second look.
        Of::Drift => ("drift".to_owned(), format!("{}/h", quantity.unit()), 1.0),
    };
    let shown = |x: Option<f64>| number::or_dash(x, |x| three_digits(x * scale));
    let mut row = vec![name, unit];
    for (error, sigma) in numbers {
        row.extend(is_known(navigated).then(|| shown(error)));
        row.push(shown(sigma));
    }
    row
}

/// Position error east and north against time; none if nothing was navigated.
pub(super) fn figure(navigated: &[Navigated]) -> Option<Plot> {
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
    let panels = [Quantity::EAST, Quantity::NORTH].map(|quantity| panel(quantity, navigated));
    Some(Plot::new("navigation.svg", heading, (1, 250), panels).caption(caption))
}

fn panel(quantity: Quantity, navigated: &[Navigated]) -> Panel {
    let known = is_known(navigated);
    let points = |of: &Navigated, sign: f64, of_error: bool| -> Vec<Point> {
        let moments = of.outlook.iter();
        let points = moments.filter_map(|m| {
            let (error, sigma) = both(quantity, m);
            Some((m.time / HOUR, if of_error { error? } else { sign * sigma }))
        });
        points.collect()
    };
    let size = |line: &[Point]| line.iter().map(|p| p.1.abs()).fold(0.0, f64::max);
    let sizes = navigated.iter().map(|of| size(&points(of, 1.0, known)));
    let last = navigated.last();
    let sizes: Vec<f64> = sizes
        .chain(last.map(|of| size(&points(of, 1.0, false))))
        .collect();
    let largest = sizes.iter().copied().fold(0.0, f64::max);
    let smallest = sizes.iter().copied().fold(f64::INFINITY, f64::min);
    let (unit, scale) = quantity.readable_unit(largest);
    let scaled = |line: Vec<Point>| line.into_iter().map(|(t, y)| (t, y * scale)).collect();
    let reach = 1.08 * scale * if largest > 0.0 { largest } else { 1.0 };
    let (y, kind) = match smallest > 0.0 && largest > APART * smallest {
        true => (
            Axis::symlog(0.3 * smallest * scale),
            ", logarithmic to both sides",
        ),
        false => (Axis::linear(""), ""),
    };
    let title = format!("{}, {unit}{kind}", quantity.name());
    let mut panel = Panel::new(
        title,
        Axis::hours(hours(navigated)),
        y.between(-reach, reach),
    );
    if let Some(of) = last {
        let (lower, upper) = (
            scaled(points(of, -1.0, false)),
            scaled(points(of, 1.0, false)),
        );
        panel = panel.with(Series::band(lower, upper));
    }
    panel = panel.with(Series::zero());
    for (sign, name) in [(1.0, "+σ"), (-1.0, "−σ")] {
        let end = last.and_then(|of| points(of, sign, false).last().copied());
        let end = end.filter(|_| known).map_or(f64::NAN, |end| end.1 * scale);
        panel = panel.with(Series::name(end, name));
    }
    for of in navigated {
        let lines = match known {
            true => vec![points(of, 1.0, true)],
            false => vec![points(of, -1.0, false), points(of, 1.0, false)],
        };
        let name = if known {
            of.method.to_owned()
        } else {
            format!("σ of {}", of.method)
        };
        for (n, line) in lines.into_iter().enumerate() {
            let series = Series::line(scaled(line)).width(1.5);
            let series = if of.method == "EKF" {
                series
            } else {
                series.nth(1).dashed()
            };
            panel = panel.with(if n == 0 {
                series.label(name.clone())
            } else {
                series
            });
        }
    }
    panel
}
