//! What the calibrations of one run are worth: their navigation errors side by side, or where the truth
//! is not known their predicted σ alone.

use maud::{Markup, html};

use super::super::axis::Axis;
use super::super::canvas::{Area, DrawError, Pen, QUIET, envelope};
use super::super::panel::{Margins, Panel};
use super::super::{Figure, Navigated, ReportError, number, tables};
use super::figures::time;
use super::quantity::Quantity;
use super::{HOUR, NONE};
use crate::study::navigation::{NavigationStudyError, Outlook};

/// Points of a line.
const POINTS: usize = 800;
/// Errors of two methods this many times apart share an axis that is logarithmic.
const APART: f64 = 20.0;

/// Position error east and north against time; none if nothing was navigated.
pub(in crate::report) fn figure(navigated: &[Navigated]) -> Result<Option<Figure>, ReportError> {
    let Some(last) = navigated.last() else {
        return Ok(None);
    };
    let known = is_known(navigated);
    let mut caption = if known {
        format!(
            "Computed less true, by full navigation from perfect alignment, standing level, height held. \
             Band: ±1σ of the {} predicted from its covariance.",
            last.method
        )
    } else {
        "±1σ of the error predicted from the covariance of the calibration, from perfect alignment, \
         standing level, height held."
            .to_owned()
    };
    if navigated.len() > 1 {
        caption.push_str(" Solid: EKF; dashed: closed form.");
    }
    let title = if known {
        "Position error in navigation"
    } else {
        "Predicted position error in navigation"
    };
    Figure::draw("navigation.svg", title, caption, (1200, 500), |area| {
        let quantities = [Quantity::EAST, Quantity::NORTH];
        for (quantity, area) in quantities.into_iter().zip(area.split_evenly((2, 1))) {
            panel(&area, quantity, navigated)?;
        }
        Ok(())
    })
    .map(Some)
}

fn is_known(navigated: &[Navigated]) -> bool {
    let mut moments = navigated.iter().flat_map(|of| &of.outlook);
    moments.any(|moment| moment.error.is_some())
}

type Line = Vec<(f64, f64)>;

/// Errors of each method, or its σ to both sides where they are not known.
fn lines(of: &Navigated, quantity: Quantity) -> Vec<Line> {
    let line = |value: &dyn Fn(&Outlook) -> Option<f64>| -> Line {
        let moments = of.outlook.iter();
        moments
            .filter_map(|m| Some((m.time / HOUR, value(m)?)))
            .collect()
    };
    let error = line(&|m| m.error.as_ref().map(|error| quantity.error(error)));
    if !error.is_empty() {
        return vec![error];
    }
    let both = [-1.0, 1.0];
    both.map(|sign| line(&|m| Some(sign * quantity.of_sigma(&m.sigma))))
        .to_vec()
}

fn panel(area: &Area, quantity: Quantity, navigated: &[Navigated]) -> Result<(), DrawError> {
    let mut drawn: Vec<(&str, Vec<Line>)> = navigated
        .iter()
        .map(|of| (of.method, lines(of, quantity)))
        .collect();
    let mut band: Line = navigated.last().map_or_else(Line::new, |of| {
        let thinned = of.outlook.len().div_ceil(POINTS).max(1);
        let moments = of.outlook.iter().step_by(thinned);
        moments
            .map(|m| (m.time / HOUR, quantity.of_sigma(&m.sigma)))
            .collect()
    });
    let size = |line: &Line| line.iter().map(|p| p.1.abs()).fold(0.0, f64::max);
    let largest_of = |lines: &[Line]| lines.iter().map(size).fold(0.0, f64::max);
    let extent = drawn
        .iter()
        .map(|(_, lines)| largest_of(lines))
        .fold(size(&band), f64::max);
    let (unit, scale) = quantity.readable_unit(extent);
    let points = drawn
        .iter_mut()
        .flat_map(|(_, lines)| lines.iter_mut().flatten());
    for point in points.chain(&mut band) {
        point.1 *= scale;
    }
    let hours = band.last().map_or(0.0, |end| end.0);
    let smallest = drawn
        .iter()
        .map(|(_, lines)| largest_of(lines))
        .chain([size(&band)])
        .fold(f64::INFINITY, f64::min);
    let extent = 1.08 * extent * scale;
    let (y, kind) = if smallest > 0.0 && extent > APART * smallest {
        (
            Axis::symlog(0.3 * smallest, extent),
            ", logarithmic to both sides",
        )
    } else {
        let reach = if extent > 0.0 { extent } else { 1.0 };
        (Axis::linear(-reach, reach), "")
    };
    let mut panel = Panel::new(
        area,
        &format!("{}, {unit}{kind}", quantity.name()),
        Margins {
            left: 60.0,
            right: 124.0,
        },
        (time(hours), y),
        "time, h",
        &[],
    )?;
    let lower: Line = band.iter().map(|&(t, s)| (t, -s)).collect();
    panel.band(&lower, &band)?;
    panel.line(&[(0.0, 0.0), (hours, 0.0)], Pen::solid(QUIET, 0.75))?;
    let known = is_known(navigated);
    if known {
        for end in [lower.last(), band.last()].into_iter().flatten() {
            panel.label(end.1, if end.1 < 0.0 { "−σ" } else { "+σ" }, QUIET);
        }
    }
    for (name, lines) in &drawn {
        let pen = match *name {
            "EKF" => Pen::nth(0, 1.5),
            _ => Pen::dashed(Pen::nth(1, 1.5).color, 1.5),
        };
        for line in lines {
            panel.line(&envelope(line, POINTS), pen)?;
        }
        if let Some(end) = lines.last().and_then(|line| line.last()) {
            let name = if known {
                (*name).to_owned()
            } else {
                format!("σ of {name}")
            };
            panel.label(end.1, name, pen.color);
        }
    }
    panel.finish()
}

/// The section of the page.
pub(in crate::report) fn section(
    navigation: Result<&[Navigated], &NavigationStudyError>,
) -> Markup {
    html! {
        @match navigation {
            Ok([]) => {}
            Err(reason) => section {
                h2 { "What it is worth in navigation" }
                p.note { "Not navigated from the site of the run: " (reason) "." }
            }
            Ok(navigated) => section {
                h2 { "What it is worth in navigation" }
                (table(navigated))
                p.note {
                    (number::value(hours(navigated), 10.0))
                    " h standing level at the site of the run, heading North, from perfect alignment, \
                    height held. σ: predicted from the covariance of the calibration by the linear error \
                    model; of horizontal errors the root of the mean square. "
                    @if is_known(navigated) {
                        "Errors are computed less true. Drift: position error at the end over the time."
                    } @else {
                        "The truth is not known, so no error is shown."
                    }
                }
            }
        }
    }
}

/// Duration.
fn hours(navigated: &[Navigated]) -> f64 {
    let ends = navigated.iter().filter_map(|of| of.outlook.last());
    ends.map(|end| end.time / HOUR).fold(0.0, f64::max)
}

/// What a row shows.
#[derive(Clone, Copy)]
enum Of {
    /// The error at the end.
    End,
    /// The largest of all moments.
    Largest,
    /// The error at the end over the time.
    Drift,
}

fn table(navigated: &[Navigated]) -> Markup {
    let known = is_known(navigated);
    let mut headings = vec![String::new(), "unit".to_owned()];
    for of in navigated {
        if known {
            headings.extend([format!("{}: error", of.method), format!("{}: σ", of.method)]);
        } else {
            headings.push(format!("{}: σ", of.method));
        }
    }
    let [pitch, roll, heading, _, _, _, east, north, horizontal] = Quantity::ALL;
    let mut position = vec![
        row(navigated, east, Of::End),
        row(navigated, north, Of::End),
        row(navigated, horizontal, Of::End),
    ];
    if known {
        position.push(row(navigated, horizontal, Of::Largest));
    }
    position.push(row(navigated, horizontal, Of::Drift));
    let attitude = [pitch, roll, heading].map(|angle| row(navigated, angle, Of::End));
    tables::table(&headings, [position, attitude.to_vec()])
}

fn row(navigated: &[Navigated], quantity: Quantity, of: Of) -> Vec<String> {
    let hours = hours(navigated);
    let numbers: Vec<(Option<f64>, Option<f64>)> = navigated
        .iter()
        .map(|navigated| {
            let error = |m: &Outlook| m.error.as_ref().map(|error| quantity.error(error));
            let end = navigated.outlook.last();
            let (error_at_end, sigma_at_end) = (
                end.and_then(error),
                end.map(|m| quantity.of_sigma(&m.sigma)),
            );
            match of {
                Of::End => (error_at_end, sigma_at_end),
                Of::Largest => {
                    let errors = navigated.outlook.iter().filter_map(error);
                    (errors.max_by(|a, b| a.abs().total_cmp(&b.abs())), None)
                }
                Of::Drift => (
                    error_at_end.map(|x| x / hours),
                    sigma_at_end.map(|x| x / hours),
                ),
            }
        })
        .collect();
    let all = numbers.iter().flat_map(|&(error, sigma)| [error, sigma]);
    let largest = all.flatten().map(f64::abs).fold(0.0, f64::max);
    let (unit, scale) = match of {
        // Beside the drift in nautical miles others would need a second look.
        Of::Drift => (quantity.unit(), 1.0),
        Of::End | Of::Largest => quantity.readable_unit(largest),
    };
    let (name, unit) = match of {
        Of::End => (format!("{} at the end", quantity.name()), unit.to_owned()),
        Of::Largest => (format!("{}, largest", quantity.name()), unit.to_owned()),
        Of::Drift => ("drift".to_owned(), format!("{unit}/h")),
    };
    let shown = |x: Option<f64>| x.map_or(NONE.to_owned(), |x| number::three_digits(x * scale));
    let mut row = vec![name, unit];
    for (error, sigma) in numbers {
        if is_known(navigated) {
            row.push(shown(error));
        }
        row.push(shown(sigma));
    }
    row
}

/// The position at the end in one line; none if nothing was navigated.
pub(in crate::report) fn line(navigated: &[Navigated]) -> Option<String> {
    let [.., horizontal] = Quantity::ALL;
    let ends = navigated.iter().filter_map(|of| {
        let end = of.outlook.last()?;
        let sigma = number::three_digits(horizontal.of_sigma(&end.sigma));
        let text = match &end.error {
            Some(error) => {
                let error = number::three_digits(horizontal.error(error));
                format!("{} {error} nmile (σ {sigma})", of.method)
            }
            None => format!("{} σ {sigma} nmile", of.method),
        };
        Some(text)
    });
    let ends: Vec<String> = ends.collect();
    (!ends.is_empty()).then(|| {
        format!(
            "Position error after {} h of navigation standing level: {}",
            number::value(hours(navigated), 10.0),
            ends.join(", ")
        )
    })
}
