//! Navigation errors of one calibration or of several side by side (only their predicted σ if the truth is not known):
//! a table of all quantities at the end, and a panel for each quantity against time.

use crate::prelude::*;
use turncal::study::navigation::{MethodOutlook, NavigationStudyError, Outlook, Quantity};

const HEADING: &str = "Navigation with this calibration";

/// One mission, navigated with several calibrations.
#[derive(Debug, Clone, PartialEq)]
pub struct Flown {
    /// Motion of the body in words, such as `stationary and level`.
    pub how: &'static str,
    /// Conclusion, in a sentence.
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

/// Adds the table and the figure.
pub fn add(document: &mut Document, navigation: Result<&[MethodOutlook], &NavigationStudyError>) {
    match navigation {
        Err(reason) => {
            let text = format!("Not navigated from the site of the run: {reason}.");
            document.page(Block::Text(HEADING.to_owned(), text));
        }
        Ok([]) => {}
        Ok(navigated @ [.., last]) => {
            let how = format!(
                "{} stationary and level at the site of the run, heading North, from perfect alignment, with fixed \
                 height. The duration is limited so that the predicted errors stay small (below 1° and 1 % of the \
                 Earth's radius).",
                long(navigated)
            );
            document.page(table(HEADING, navigated).note(how));
            document.page(figure(navigated, last.method));
        }
    }
}

fn is_known(navigated: &[MethodOutlook]) -> bool {
    let mut moments = navigated.iter().flat_map(|of| &of.outlook);
    moments.any(|moment| moment.error.is_some())
}

/// Duration, s.
fn duration(navigated: &[MethodOutlook]) -> f64 {
    let ends = navigated.iter().filter_map(|of| of.outlook.last());
    ends.map(|end| end.time).fold(0.0, f64::max)
}

/// The unit of time of the report: its symbol and its length in seconds.
fn clock(navigated: &[MethodOutlook]) -> (&'static str, f64) {
    readable(&TIMES, duration(navigated))
}

/// Duration in words.
fn long(navigated: &[MethodOutlook]) -> String {
    let (unit, size) = clock(navigated);
    format!("{} {unit}", value(duration(navigated) / size, 10.0))
}

/// One line with the position error at the end.
pub fn line(navigated: &[MethodOutlook]) -> String {
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

/// Table of every quantity at the end of navigation, with its maximum if the errors are known.
pub fn table(heading: &str, navigated: &[MethodOutlook]) -> Table {
    let known = is_known(navigated);
    let (unit_of_time, second) = clock(navigated);
    let after = format!("after, {unit_of_time}");
    let mut columns = cells!["", "unit"];
    for of in navigated {
        let name = if navigated.len() > 1 {
            format!("{}: ", of.method)
        } else {
            String::new()
        };
        let first = if known { "largest" } else { "σ" };
        columns.push(format!("{name}{first}"));
        if known {
            columns.extend(cells![after.as_str(), "at the end", "σ", "error/σ"]);
        }
    }
    let row = |quantity: Quantity| {
        let (unit, scale) = quantity.readable_unit(greatest(quantity, navigated));
        let shown = |x: Option<f64>| or_dash(x, |x| three_digits(x * scale));
        let mut row = cells![quantity.name, unit];
        for MethodOutlook { outlook, .. } in navigated {
            let end = outlook.last();
            let sigma = end.and_then(|end| quantity.sigma(end));
            if known {
                let error = end.and_then(|end| quantity.error(end));
                let largest = largest(quantity, outlook);
                let after = largest.map(|(time, _)| time / second);
                let of_both = error.zip(sigma).filter(|_| quantity.is_component);
                let ratio = of_both.map(|(error, sigma)| error / sigma);
                row.push(shown(largest.map(|of| of.1)));
                row.push(or_dash(after, |time| value(time, 1.0)));
                row.extend([shown(error), shown(sigma)]);
                row.push(or_dash(ratio, |z| value(z, 1.0)));
            } else {
                row.push(shown(sigma));
            }
        }
        row
    };
    let what = if known {
        "Computed minus true values. σ: predicted 1σ of the error at the end,"
    } else {
        "The truth is not known, so no error is shown. σ: predicted 1σ of the error at the end,"
    };
    Table::new(heading, columns)
        .sections(Quantity::ALL.chunks(3).map(|of| of.iter().map(|&of| row(of))))
        .note(format!(
            "{what} from the covariance of the calibration with the linear error model; for horizontal errors, the \
             root mean square is given."
        ))
}

/// The largest error with its time.
fn largest(quantity: Quantity, moments: &[Outlook]) -> Option<Point> {
    let errors = moments.iter();
    let errors = errors.filter_map(|of| Some((of.time, quantity.error(of)?)));
    errors.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
}

/// Magnitude of the largest error and of the σ at the end, over all calibrations.
fn greatest(quantity: Quantity, navigated: &[MethodOutlook]) -> f64 {
    let sizes = navigated.iter().flat_map(|of| {
        let sigma = of.outlook.last().and_then(|end| quantity.sigma(end));
        [largest(quantity, &of.outlook).map(|of| of.1.abs()), sigma]
    });
    sizes.flatten().fold(0.0, f64::max)
}

/// Position error east and north against time.
fn figure(navigated: &[MethodOutlook], last: &str) -> Plot {
    let (heading, mut caption) = if is_known(navigated) {
        (
            "Position error in navigation",
            format!(
                "Computed minus true values, from full navigation with perfect alignment, stationary and level, with \
                 fixed height. Band: ±1σ of the errors of the {last}, predicted from its covariance."
            ),
        )
    } else {
        (
            "Predicted position error in navigation",
            "Predicted ±1σ of the position error, from the covariance of the calibration, for a stationary and level \
             instrument with perfect alignment and fixed height."
                .to_owned(),
        )
    };
    if navigated.len() > 1 {
        caption += " Solid: EKF; dashed: closed form.";
    }
    let panels = Quantity::ALL[6..8].iter().map(|of| panel(*of, navigated));
    Plot::new("navigation.svg", heading, (1, 250), panels).caption(caption)
}

/// Figure of the errors against time in a readable unit, drawn over the ±σ band of the last calibration; if no error is
/// known, the figure shows only σ.
pub fn panel(quantity: Quantity, navigated: &[MethodOutlook]) -> Panel {
    let (unit_of_time, second) = clock(navigated);
    let (unit, scale) = quantity.readable_unit(greatest(quantity, navigated));
    let curve = |moments: &[Outlook], of: &dyn Fn(&Outlook) -> Option<f64>| -> Vec<Point> {
        let points = moments.iter();
        let points = points.filter_map(|m| Some((m.time / second, of(m)? * scale)));
        points.collect()
    };
    let lines = navigated.iter().map(|of| {
        let errors = curve(&of.outlook, &|m| quantity.error(m));
        let line = if errors.is_empty() {
            let sigma = curve(&of.outlook, &|m| quantity.sigma(m));
            Series::line(sigma).label(format!("σ of {}", of.method))
        } else {
            Series::line(errors).label(of.method)
        };
        if of.method == "closed form" {
            line.nth(1).dashed()
        } else {
            line
        }
    });
    let last = navigated.last().map_or(&[][..], |last| &last.outlook);
    let lowest = if quantity.is_component { -1.0 } else { 0.0 };
    let [low, high] = [lowest, 1.0].map(|sign| curve(last, &|m| Some(sign * quantity.sigma(m)?)));
    let time = Axis::linear(&format!("time, {unit_of_time}"));
    let time = time.between(0.0, duration(navigated) / second);
    let y = Axis::linear("").including([0.0]).room(0.06, 0.06);
    Panel::new(format!("{}, {unit}", quantity.name), time, y)
        .with(Series::band(low, high))
        .with(Series::zero())
        .with_all(lines)
}
