//! The figures.

use super::compared::compared;
use super::normalised;
use crate::report::prelude::*;
use crate::study::{Accuracy, Figures, GroupAccuracy, Ratio};

/// The narrowest axis about a ratio of one.
const NEAR: f64 = 0.04;
/// A ratio beyond this or below its inverse makes its axis logarithmic.
const FAR: f64 = 2.0;
/// Lines that end nearer than this factor have one name.
const TOGETHER: f64 = 2.0;
const MINUTE: f64 = 60.0;

pub(super) fn figures(accuracy: &Accuracy) -> Vec<Plot> {
    let mut plots = vec![
        normalised::errors(accuracy),
        ratio(accuracy),
        normalised::nees(accuracy),
        gain(accuracy),
        against_time(accuracy),
    ];
    plots.extend((!accuracy.navigation.is_empty()).then(|| normalised::positions(accuracy)));
    plots
}

/// Ratios with their place on the axis.
fn ratios(accuracy: &Accuracy, of: impl Fn(&Figures) -> Option<Ratio>) -> Vec<(f64, Ratio)> {
    let all = compared(accuracy).into_iter().enumerate();
    all.filter_map(|(place, compared)| Some((place as f64, of(compared.figures)?)))
        .filter(|(_, ratio)| ratio.value.is_finite())
        .collect()
}

/// A panel with a place for each that is compared and a line at 1.
fn by_compared(accuracy: &Accuracy, title: String, y: Axis) -> Panel {
    let x = Axis::places(compared(accuracy).into_iter().map(|of| of.title));
    Panel::new(title, x, y).with(Series::level(1.0).width(1.5))
}

fn whiskers(ratios: &[(f64, Ratio)], shift: f64) -> Series {
    let of = ratios
        .iter()
        .map(|(x, ratio)| (x + shift, ratio.interval.0, ratio.interval.1));
    Series::new(Shape::Intervals(of.collect()))
        .color(Color::Ink)
        .width(1.25)
}

/// The value beyond its interval, away from 1.
fn words(x: f64, ratio: &Ratio) -> Series {
    let [text, _] = with_interval(ratio.value, ratio.interval);
    match ratio.value >= 1.0 {
        true => Series::words((x, ratio.interval.1), (0.0, -5.0), Anchor::Above, text),
        false => Series::words((x, ratio.interval.0), (0.0, 5.0), Anchor::Below, text),
    }
}

/// RMS error over bound.
fn ratio(accuracy: &Accuracy) -> Plot {
    let ratios = ratios(accuracy, |f| f.ratio);
    let ends = || {
        ratios
            .iter()
            .flat_map(|(_, r)| [r.interval.0, r.interval.1])
    };
    let half = ends().map(|end| (end - 1.0).abs()).fold(NEAR, f64::max);
    let (y, kind) = match ends().any(|end| !(1.0 / FAR..=FAR).contains(&end)) {
        true => (
            Axis::log("").including([1.0]).room(0.4, 0.8),
            ", logarithmic",
        ),
        false => (
            Axis::linear("").between(1.0 - 1.3 * half, 1.0 + 1.3 * half),
            "",
        ),
    };
    let marks = ratios.iter().map(|(x, ratio)| (*x, ratio.value));
    let panel = by_compared(accuracy, format!("RMS error / RMS bound{kind}"), y)
        .with(whiskers(&ratios, 0.0))
        .with(Series::marks(Mark::Dot, marks).width(3.0))
        .with_all(ratios.iter().map(|(x, ratio)| words(*x, ratio)));
    Plot::new("ratio.svg", "Error over bound", (1, 400), [panel]).caption(
        "RMS error of the EKF over the Cramér–Rao bound, of each group of parameters and of the position after 40 \
         h; bars: its 99 % interval. A bar that crosses the line at 1 says that nothing shows the filter to be \
         worse than the best there can be.",
    )
}

/// Error of the closed form over that of the filter.
fn gain(accuracy: &Accuracy) -> Plot {
    let y = Axis::log("").including([1.0]).room(0.4, 0.8);
    let title = "RMS error of closed form / RMS error of EKF".to_owned();
    let mut panel = by_compared(accuracy, title, y);
    let equal: fn(&Figures) -> Option<Ratio> = |f| f.gain_in_equal_time;
    for (of, shift, filled) in [
        ((|f| f.gain) as fn(&Figures) -> _, -0.17, true),
        (equal, 0.17, false),
    ] {
        let ratios = ratios(accuracy, of);
        let bars = Shape::Bars {
            tops: ratios
                .iter()
                .map(|(x, ratio)| (x + shift, ratio.value))
                .collect(),
            half: 0.13,
            base: Some(1.0),
            filled,
        };
        panel = panel
            .with(Series::new(bars).width(1.25))
            .with(whiskers(&ratios, shift))
            .with_all(ratios.iter().map(|(x, ratio)| words(x + shift, ratio)));
    }
    let equal = match accuracy.baseline.equal_time() {
        Some(time) => format!(" Right, open: closed form in {}.", minutes(time)),
        None => " Its positions cannot be had in the time of the EKF.".to_owned(),
    };
    Plot::new("gain.svg", "Gain over the closed form", (1, 460), [panel]).caption(format!(
        "RMS error of the closed form over that of the EKF in {}, logarithmic, with 99 % intervals. Above the line \
         at 1 the EKF is better, below the closed form. Left, shaded: closed form in its own {}.{equal}",
        minutes(accuracy.table_time),
        minutes(accuracy.baseline.table_time)
    ))
}

/// RMS error of both methods against table time.
fn against_time(accuracy: &Accuracy) -> Plot {
    let panels = accuracy.groups.iter().map(of_group_against_time);
    Plot::new("time.svg", "Accuracy against table time", (3, 340), panels).caption(
        "RMS error over all runs at that time of the last pass, one panel for each group, both axes logarithmic. \
         Solid: EKF; dashed: its Cramér–Rao bound; rings: closed form with shorter dwells at all of its \
         positions.",
    )
}

fn of_group_against_time(of: &GroupAccuracy) -> Panel {
    let unit = of.group.unit_value();
    let line = |points: &mut dyn Iterator<Item = Point>| -> Vec<Point> {
        let points = points.map(|(time, rms)| (time / MINUTE, rms / unit));
        points.filter(|(_, rms)| rms.is_finite()).collect()
    };
    let filter = line(&mut of.filter_against_time.iter().map(|p| (p.0, p.1)));
    let bound = line(&mut of.filter_against_time.iter().map(|p| (p.0, p.2)));
    let closed = line(&mut of.closed_form_against_time.iter().copied());
    let ends = filter.last().zip(bound.last());
    let together = ends.is_some_and(|(a, b)| (a.1 / b.1).ln().abs() < TOGETHER.ln());
    let (of_filter, of_bound) = match together {
        true => ("EKF, bound", None),
        false => ("EKF", Some("bound")),
    };
    let named = |series: Series, name: Option<&str>| match name {
        Some(name) => series.label(name),
        None => series,
    };
    let title = of.group.titled();
    Panel::new(title, Axis::log("table time, min"), Axis::log(""))
        .with(named(Series::line(filter).width(1.75), Some(of_filter)))
        .with(named(
            Series::line(bound).color(Color::Ink).dashed().width(1.25),
            of_bound,
        ))
        .with(Series::line(closed.clone()).nth(1).width(1.0))
        .with(named(
            Series::marks(Mark::Ring, closed).nth(1).width(1.25),
            Some("closed form"),
        ))
}
