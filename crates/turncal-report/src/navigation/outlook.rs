//! Navigation errors of one calibration or of several side by side (only their predicted σ if the truth is not known):
//! a table of all quantities at the end, and a panel for each quantity against time.

use crate::prelude::*;
use turncal::study::navigation::{MethodOutlook, NavigationStudyError, Outlook, Quantity};

const HEADING: &str = "Navigation with this calibration";

/// One mission, navigated with several calibrations.
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
pub fn add(document: &mut Document, navigation: Result<&[MethodOutlook], &NavigationStudyError>) {
    match navigation {
        Err(reason) => {
            let text = format!("Not navigated from the site of the run: {reason}.");
            document.page(Block::Text(HEADING.to_owned(), text));
        }
        Ok([]) => {}
        Ok(navigated @ [.., last]) => {
            let how = format!(
                "{} stationary and level at the site of the run, heading North, from perfect alignment, height \
                 fixed, for as long as predicted errors stay small (1° and 1 % of the Earth's radius).",
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

/// The position at the end in one line.
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

/// One quantity with one calibration: the largest error with its time, the error at the end, its σ, and the ratio of
/// error to σ.
struct Figures {
    largest: Option<Point>,
    at_end: Option<f64>,
    sigma: Option<f64>,
    ratio: Option<f64>,
}

impl Figures {
    fn of(quantity: Quantity, navigated: &MethodOutlook) -> Self {
        let moments = &navigated.outlook;
        let errors = moments
            .iter()
            .filter_map(|m| Some((m.time, quantity.error(m)?)));
        let at_end = moments.last().and_then(|end| quantity.error(end));
        let sigma = moments.last().and_then(|end| quantity.sigma(end));
        let sigma = sigma.filter(|sigma| *sigma > 0.0);
        let ratio = at_end.zip(sigma).filter(|_| quantity.is_component);
        Self {
            largest: errors.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())),
            at_end,
            sigma,
            ratio: ratio.map(|(error, sigma)| error / sigma),
        }
    }

    fn cells(&self, scale: f64, second: f64, known: bool) -> Vec<String> {
        let shown = |x: Option<f64>| or_dash(x, |x| three_digits(x * scale));
        if !known {
            return vec![shown(self.sigma)];
        }
        let (after, largest) = self.largest.unzip();
        vec![
            shown(largest),
            or_dash(after, |time| value(time / second, 1.0)),
            shown(self.at_end),
            shown(self.sigma),
            or_dash(self.ratio, |z| value(z, 1.0)),
        ]
    }
}

/// Every quantity at the end of navigation, and its maximum if errors are known.
pub fn table(heading: &str, navigated: &[MethodOutlook]) -> Table {
    let known = is_known(navigated);
    let (unit_of_time, second) = clock(navigated);
    let mut columns = cells!["", "unit"];
    for of in navigated {
        let name = match navigated {
            [_] => String::new(),
            _ => format!("{}: ", of.method),
        };
        let after = format!("after, {unit_of_time}");
        columns.extend(match known {
            true => cells![
                format!("{name}largest"),
                after,
                "at the end",
                "σ",
                "error/σ"
            ],
            false => cells![format!("{name}σ")],
        });
    }
    let row = |name: &str, unit: &str, scale: f64, all: &[Figures]| {
        let cells = all.iter().flat_map(|of| of.cells(scale, second, known));
        cells![name, unit].into_iter().chain(cells).collect()
    };
    let of = |quantity: Quantity| {
        let all = navigated.iter().map(|of| Figures::of(quantity, of));
        let all: Vec<Figures> = all.collect();
        let sizes = all
            .iter()
            .flat_map(|of| [of.largest.map(|of| of.1), of.sigma]);
        let size = sizes.flatten().map(f64::abs).fold(0.0, f64::max);
        (all, quantity.readable_unit(size))
    };
    let rows = Quantity::ALL.map(|quantity| {
        let (all, (unit, scale)) = of(quantity);
        row(quantity.name, unit, scale, &all)
    });
    let [.., horizontal] = Quantity::ALL;
    let (mut all, (unit, scale)) = of(horizontal);
    for of in &mut all {
        (of.largest, of.ratio) = (None, None);
    }
    let unit = format!("{unit}/{unit_of_time}");
    let drift = row("drift", &unit, scale * second / duration(navigated), &all);
    let what = match known {
        true => "Computed minus true. σ: of the error at the end, predicted",
        false => "The truth is not known, so no error is shown. σ: at the end, predicted",
    };
    Table::new(heading, columns)
        .sections(rows.chunks(3).map(<[_]>::to_vec))
        .section([drift])
        .note(format!(
            "{what} from the calibration's covariance by the linear error model; of horizontal errors the root of the \
             mean square. Drift: position at the end over the time."
        ))
}

/// Position error east and north against time.
fn figure(navigated: &[MethodOutlook], last: &str) -> Plot {
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
    let panels = Quantity::ALL[6..8].iter().map(|of| panel(*of, navigated));
    Plot::new("navigation.svg", heading, (1, 250), panels).caption(caption)
}

/// Errors against time in a readable unit, over the ±σ band of the last calibration; only ±σ if no error is known.
pub fn panel(quantity: Quantity, navigated: &[MethodOutlook]) -> Panel {
    let (unit_of_time, second) = clock(navigated);
    let time = Axis::time(unit_of_time, duration(navigated) / second);
    let curve = |moments: &[Outlook], of: &dyn Fn(&Outlook) -> Option<f64>| -> Vec<Point> {
        let points = moments.iter();
        let points = points.filter_map(|m| Some((m.time / second, of(m)?)));
        points.collect()
    };
    let mut lines = Vec::new();
    for MethodOutlook {
        method: name,
        outlook: moments,
    } in navigated
    {
        let name = *name;
        let errors = curve(moments, &|m| quantity.error(m));
        if !errors.is_empty() {
            lines.push((name, Some(name.to_owned()), errors));
            continue;
        }
        let upper = curve(moments, &|m| quantity.sigma(m));
        lines.push((name, Some(format!("σ of {name}")), upper));
        lines.push((name, None, curve(moments, &|m| Some(-quantity.sigma(m)?))));
    }
    let last = navigated.last().map_or(&[][..], |last| &last.outlook);
    let sigma = |sign: f64| curve(last, &|m| Some(sign * quantity.sigma(m)?));
    let size = |points: &[Point]| points.iter().map(|p| p.1.abs()).fold(0.0, f64::max);
    let sizes = lines.iter().map(|(.., points)| size(points));
    let sizes: Vec<f64> = sizes.chain([size(&sigma(1.0))]).collect();
    let (unit, scale) = quantity.readable_unit(sizes.iter().copied().fold(0.0, f64::max));
    let (y, kind) = Axis::about_zero(sizes.into_iter().map(|size| size * scale));
    let scaled = |points: Vec<Point>| -> Vec<Point> {
        points.into_iter().map(|(t, y)| (t, y * scale)).collect()
    };
    let lines = lines.into_iter().map(|(name, label, points)| {
        let mut line = Series::line(scaled(points));
        line.label = label;
        match name {
            "closed form" => line.nth(1).dashed(),
            _ => line,
        }
    });
    let lowest = if quantity.is_component { -1.0 } else { 0.0 };
    let [low, high] = [lowest, 1.0].map(|sign| scaled(sigma(sign)));
    let mut names = vec![(&high, "+σ")];
    names.extend(quantity.is_component.then_some((&low, "−σ")));
    let names = names.into_iter();
    let names = names.filter_map(|(edge, name)| Some(Series::name(edge.last()?.1, name)));
    let names: Vec<Series> = names.collect();
    Panel::new(format!("{}, {unit}{kind}", quantity.name), time, y)
        .with(Series::band(low, high))
        .with(Series::zero())
        .with_all(names)
        .with_all(lines)
}
