//! The figures.

use std::f64::consts::TAU;

use crate::accuracy::tables;
use crate::accuracy::tables::{compared, journey_name};
use crate::prelude::*;
use turncal::calibration::{Group, PARAMETERS};
use turncal::study::accuracy::{Position, Region};
use turncal::study::{Accuracy, Figures, NavigationAccuracy, Ratio};

/// Minimum span of an axis of ratios, as a factor.
const NARROWEST: f64 = 1.08;
/// Margin at both ends of it, as a fraction of its length.
const FREE: f64 = 0.2;
pub fn figures(accuracy: &Accuracy) -> Vec<Plot> {
    let mut plots = vec![
        errors(accuracy),
        ratio(accuracy),
        nees(accuracy),
        gain(accuracy),
    ];
    plots.extend((!accuracy.navigation.is_empty()).then(|| positions(accuracy)));
    plots
}

/// RMS error over bound.
fn ratio(accuracy: &Accuracy) -> Plot {
    let panel = ratios(accuracy, "RMS error / RMS bound", &[("", |f| f.ratio)]);
    Plot::new("ratio.svg", "Error over bound", (1, 400), [panel]).caption(
        "RMS error of the EKF divided by the Cramér–Rao bound, for each parameter group and for the position after \
         40 h; bars: 99 % interval. A bar that crosses the line at 1 is consistent with an optimal filter.",
    )
}

/// Error of the closed form divided by that of the filter.
fn gain(accuracy: &Accuracy) -> Plot {
    let own = format!("closed form {}", minutes(accuracy.baseline.table_time));
    let mut all: Vec<(&str, OfFigures)> = vec![(&own, |f| f.gain)];
    let equal = accuracy
        .baseline
        .equal_time()
        .map(|time| format!("closed form {}", minutes(time)));
    all.extend(
        equal
            .iter()
            .map(|equal| (equal.as_str(), (|f| f.gain_in_equal_time) as OfFigures)),
    );
    let panel = ratios(
        accuracy,
        "RMS error of closed form / RMS error of EKF",
        &all,
    );
    Plot::new("gain.svg", "Gain over the closed form", (1, 460), [panel]).caption(format!(
        "RMS error of the closed form over that of the EKF in {}, with 99 % intervals. Above the line at 1 the EKF \
         is better, below the closed form.",
        minutes(accuracy.table_time),
    ))
}

type OfFigures = fn(&Figures) -> Option<Ratio>;

/// Ratios by name, each with its interval and, beyond the interval's end away from the line at 1, its value.
fn ratios(accuracy: &Accuracy, title: &str, all: &[(&str, OfFigures)]) -> Panel {
    let compared = compared(accuracy);
    let (mut low, mut high) = (1.0, 1.0);
    let mut series = vec![Series::level(1.0).width(1.5)];
    for (n, (name, of)) in all.iter().enumerate() {
        let mut marks = Vec::new();
        for (place, compared) in compared.iter().enumerate() {
            let ratio = of(compared.figures).filter(|ratio| ratio.value.is_finite());
            let Some(Ratio { value, interval }) = ratio else {
                continue;
            };
            let x = place as f64 + beside(n, all.len(), 0.68);
            let [text, _] = with_interval(value, interval);
            marks.push(((x, value), interval));
            series.push(match value >= 1.0 {
                true => Series::words((x, interval.1), Anchor::Above, text),
                false => Series::words((x, interval.0), Anchor::Below, text),
            });
            (low, high) = (f64::min(low, interval.0), f64::max(high, interval.1));
        }
        let mut marks = Series::whiskers(Mark::Dot, marks).nth(n).width(3.0);
        marks.key = Some((*name).to_owned()).filter(|name| !name.is_empty());
        series.push(marks);
    }
    let free = (high / low).max(NARROWEST).powf(FREE);
    let y = Axis::log("").between(low / free, high * free);
    let names = compared.into_iter().map(|of| of.title);
    Panel::new(format!("{title}, logarithmic"), Axis::places(names), y).with_all(series)
}

/// Half the width of the axis of errors, in σ.
const REACH: f64 = 5.0;
const BINS: usize = 24;
/// Points of a curve.
const CURVE: usize = 301;
/// Minimum half range of the position axes, in σ.
const POSITION_REACH: f64 = 4.0;

/// Normalised errors of each group, with the density implied by the stated σ.
pub fn errors(accuracy: &Accuracy) -> Plot {
    let panels = Group::all().map(|group| {
        let values = normalised(accuracy, group);
        let normal = |z: f64| (-0.5 * z * z).exp() / TAU.sqrt();
        let curve = steps(-REACH, REACH, CURVE);
        let bars = histogram(&values);
        let top = bars.iter().map(|bar| bar.2).fold(normal(0.0), f64::max);
        let mean_square = values.iter().map(|z| z * z).sum::<f64>() / values.len() as f64;
        let beyond = values.iter().filter(|z| z.abs() > REACH).count();
        let mut notes = vec![
            format!("{} values", count(values.len())),
            format!("RMS {}", tables::factor(mean_square.sqrt())),
        ];
        notes.extend((beyond > 0).then(|| format!("{} beyond ±{REACH}", count(beyond))));
        let x = Axis::linear("error / σ").between(-REACH, REACH);
        let y = Axis::linear("").between(0.0, 1.08 * top);
        Panel::new(format!("{}: density", group.title()), x, y)
            .with(Series::bars(REACH / BINS as f64, Fill::Pale, bars).width(0.75))
            .with(Series::line(curve.map(|z| (z, normal(z)))).color(Color::Ink))
            .noted(notes)
    });
    Plot::new("errors.svg", "Errors over claimed σ", (3, 300), panels).caption(
        "Density of parameter errors divided by the filter's σ, all runs. Line: standard normal density, \
         which the errors follow if the σ are correct; RMS is then 1.",
    )
}

/// Errors divided by σ for the parameters of a group that have a σ.
fn normalised(accuracy: &Accuracy, group: Group) -> Vec<f64> {
    accuracy
        .filtered()
        .flat_map(|f| (0..PARAMETERS).map(move |i| (i, f.error[i], f.sigma[i])))
        .filter(|&(i, _, sigma)| Group::of(i) == group && sigma > 0.0)
        .map(|(_, error, sigma)| error / sigma)
        .filter(|z| z.is_finite())
        .collect()
}

/// Middle, foot and density of the bins of a histogram, as a density of all values.
fn histogram(values: &[f64]) -> Vec<Upright> {
    let mut counts = [0usize; BINS];
    for z in values {
        let place = (z / REACH + 1.0) * 0.5 * BINS as f64;
        if let Some(bin) = counts.get_mut(place as usize).filter(|_| place >= 0.0) {
            *bin += 1;
        }
    }
    let width = 2.0 * REACH / BINS as f64;
    let density = |n: usize| n as f64 / (values.len().max(1) as f64 * width);
    let bins = counts.into_iter().enumerate();
    bins.map(|(k, n)| ((k as f64 + 0.5) * width - REACH, 0.0, density(n)))
        .collect()
}

/// NEES/n of every run with the intervals of one run and of the average.
pub fn nees(accuracy: &Accuracy) -> Plot {
    let points = |converged: bool| -> Vec<Point> {
        let trials = accuracy.trials.iter();
        let trials = trials.filter(|trial| trial.failure.is_none() == converged);
        let nees = trials.filter_map(|t| Some((t.run as f64, t.filtered.as_ref()?.nees?.mean)));
        nees.collect()
    };
    let (converged, failed) = (points(true), points(false));
    let all = || converged.iter().chain(&failed).map(|point| point.1);
    let one = accuracy.anees.map_or((1.0, 1.0), |a| a.interval_of_one);
    let outside = all().filter(|nees| !(one.0..=one.1).contains(nees)).count();
    let mut caption = format!(
        "Squared error normalised by the stated covariance (with correlations), one dot per run; the mean is 1 if \
         the σ are correct. Shaded: 95 % interval of one run; {} of {} runs lie outside.",
        count(outside),
        count(all().count())
    );
    let y = Axis::log("").including([one.0, one.1]);
    let (first, last) = (-0.5, accuracy.trials.len() as f64 - 0.5);
    let n = accuracy.anees.map_or(0, |anees| anees.directions);
    let x = Axis::linear("run").between(first, last);
    let mut panel = Panel::new(format!("NEES/n of each run, n = {n}, logarithmic"), x, y);
    if let Some(of) = accuracy.anees {
        let mean = tables::mean(of.mean, of.interval_95);
        caption += &format!(
            " Line: the average over all runs, {mean}; dashed: its 95 % interval {}.",
            interval(of.interval_95)
        );
        let level = |y: f64| vec![(first, y), (last, y)];
        let end = |(y, name)| Series::name(y, format!("{name}: {}", value(y, 0.1)));
        panel = panel
            .with(Series::band(level(one.0), level(one.1)))
            .with_all([(one.0, "2.5 %"), (one.1, "97.5 %")].map(end))
            .with(Series::level(of.interval_95.0).dashed().width(1.0))
            .with(Series::level(of.interval_95.1).dashed().width(1.0))
            .with(
                Series::level(of.mean)
                    .width(1.5)
                    .label(format!("average {mean}")),
            );
    }
    if !failed.is_empty() {
        caption += " Crosses: runs that did not converge.";
    }
    let panel = panel
        .with(Series::marks(Mark::Dot, converged).width(1.75))
        .with(Series::marks(Mark::Cross, failed).nth(1).width(1.75));
    Plot::new("nees.svg", "NEES of every run", (1, 420), [panel]).caption(caption)
}

/// Position errors after each mission, divided by their predicted σ.
pub fn positions(accuracy: &Accuracy) -> Plot {
    let clouds: Vec<Vec<Point>> = accuracy
        .navigation
        .iter()
        .map(|of| {
            let whitened = of.positions.iter().filter_map(Position::whitened);
            whitened.map(|z| (z.x, z.y)).collect()
        })
        .collect();
    let sizes = clouds.iter().flatten().flat_map(|p| [p.0.abs(), p.1.abs()]);
    let reach = sizes.fold(POSITION_REACH, |most, size| most.max(1.1 * size));
    let panels = accuracy.navigation.iter().zip(clouds);
    let panels = panels.map(|(of, cloud)| of_mission(of, cloud, reach));
    Plot::new("position.svg", "Position errors over predicted σ", (2, 570), panels).caption(
        "Horizontal position error of the EKF after 40 h, divided by the σ predicted from its covariance; one dot \
         per run, same axes for all. Horizontal axis: east error; vertical axis: north error given the east error. \
         The error ellipses of all runs thus become circles: solid 1σ, dashed 2.45σ. If the axes extend far beyond \
         ±4, the σ are too small and the circles shrink to a dot.",
    )
}

fn of_mission(of: &NavigationAccuracy, cloud: Vec<Point>, reach: f64) -> Panel {
    let ellipses = Region::ALL.into_iter().filter_map(|region| match region {
        Region::Ellipse(sigmas) => Some(sigmas),
        Region::East | Region::North => None,
    });
    let circles = ellipses.enumerate().map(|(n, sigmas)| {
        let angles = steps(0.0, TAU, CURVE);
        let circle = angles.map(|angle| (sigmas * angle.cos(), sigmas * angle.sin()));
        let series = Series::line(circle).color(Color::Ink);
        if n == 0 { series } else { series.dashed() }
    });
    let mut notes = vec![format!("{} runs", count(cloud.len()))];
    let ellipses = of.containment.iter();
    let ellipses = ellipses.filter(|held| matches!(held.region, Region::Ellipse(_)));
    notes.extend(ellipses.map(tables::held));
    let title = format!("{}: north given east, σ", journey_name(of.journey));
    let x = Axis::linear("east, σ").between(-reach, reach);
    let mut panel = Panel::new(title, x, Axis::linear("").between(-reach, reach))
        .with(Series::zero())
        .with(
            Series::new(Shape::Upright(0.0))
                .color(Color::Quiet)
                .width(0.75),
        )
        .with_all(circles)
        .with(Series::marks(Mark::Dot, cloud).width(1.0))
        .noted(notes);
    panel.square = true;
    panel
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_histogram_holds_each_value_once_in_its_own_bin() {
        let tops = histogram(&[-0.1, 0.1, 0.1, 7.0, -7.0]);
        let width = 10.0 / BINS as f64;
        let at = |z: f64| {
            tops.iter()
                .find(|top| (top.0 - z).abs() < 0.5 * width)
                .unwrap()
                .2
        };
        assert!((at(0.1) - 2.0 / (5.0 * width)).abs() < 1e-12);
        assert!((at(-0.1) - 1.0 / (5.0 * width)).abs() < 1e-12);
        assert_eq!(at(4.9), 0.0);
    }
}
