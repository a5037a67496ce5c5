//! The figures.

use std::f64::consts::TAU;

use crate::calibration::{Group, PARAMETERS};
use crate::report::accuracy::tables;
use crate::report::accuracy::tables::{compared, journey_name};
use crate::report::prelude::*;
use crate::study::accuracy::{Position, Region};
use crate::study::{Accuracy, Figures, GroupAccuracy, NavigationAccuracy, Ratio};

/// Smallest range of the axis around a ratio of one.
const NEAR: f64 = 0.04;
/// If a ratio exceeds this value or is below its inverse, its axis is logarithmic.
const FAR: f64 = 2.0;
/// Lines whose ends differ by less than this factor share one name.
const TOGETHER: f64 = 2.0;

pub fn figures(accuracy: &Accuracy) -> Vec<Plot> {
    let mut plots = vec![
        errors(accuracy),
        ratio(accuracy),
        nees(accuracy),
        gain(accuracy),
        against_time(accuracy),
    ];
    plots.extend((!accuracy.navigation.is_empty()).then(|| positions(accuracy)));
    plots
}

/// Ratios with their positions on the axis.
fn ratios(accuracy: &Accuracy, of: impl Fn(&Figures) -> Option<Ratio>) -> Vec<(f64, Ratio)> {
    let all = compared(accuracy).into_iter().enumerate();
    all.filter_map(|(place, compared)| Some((place as f64, of(compared.figures)?)))
        .filter(|(_, ratio)| ratio.value.is_finite())
        .collect()
}

/// A panel with a position for each compared item and a line at 1.
fn by_compared(accuracy: &Accuracy, title: String, y: Axis) -> Panel {
    let x = Axis::places(compared(accuracy).into_iter().map(|of| of.title));
    Panel::new(title, x, y).with(Series::level(1.0).width(1.5))
}

/// A mark at each ratio with its interval, and its value outside it, away from 1.
fn with_values(ratios: &[(f64, Ratio)], shift: f64) -> Vec<Series> {
    let at = |&(x, ratio): &(f64, Ratio)| ((x + shift, ratio.value), ratio.interval);
    let values = ratios.iter().map(|(x, ratio)| {
        let [text, _] = with_interval(ratio.value, ratio.interval);
        match ratio.value >= 1.0 {
            true => Series::words((x + shift, ratio.interval.1), Anchor::Above, text),
            false => Series::words((x + shift, ratio.interval.0), Anchor::Below, text),
        }
    });
    let marks = Series::whiskers(Mark::Dot, ratios.iter().map(at)).width(3.0);
    std::iter::once(marks).chain(values).collect()
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
    let panel = by_compared(accuracy, format!("RMS error / RMS bound{kind}"), y)
        .with_all(with_values(&ratios, 0.0));
    Plot::new("ratio.svg", "Error over bound", (1, 400), [panel]).caption(
        "RMS error of the EKF divided by the Cramér–Rao bound, for each parameter group and for the position after \
         40 h; bars: 99 % interval. A bar that crosses the line at 1 is consistent with an optimal filter.",
    )
}

/// Error of the closed form over that of the filter.
fn gain(accuracy: &Accuracy) -> Plot {
    let y = Axis::log("").including([1.0]).room(0.4, 0.8);
    let title = "RMS error of closed form / RMS error of EKF".to_owned();
    let mut panel = by_compared(accuracy, title, y);
    let equal: fn(&Figures) -> Option<Ratio> = |f| f.gain_in_equal_time;
    let own: fn(&Figures) -> Option<Ratio> = |f| f.gain;
    for (of, shift, fill) in [(own, -0.17, Fill::Pale), (equal, 0.17, Fill::Open)] {
        let ratios = ratios(accuracy, of);
        let bars = ratios
            .iter()
            .map(|(x, ratio)| (x + shift, 1.0, ratio.value));
        panel = panel
            .with(Series::bars(0.13, fill, bars).width(1.25))
            .with_all(with_values(&ratios, shift));
    }
    let equal = match accuracy.baseline.equal_time() {
        Some(time) => format!(" Right, open: closed form in {}.", minutes(time)),
        None => " Its positions do not fit into the time of the EKF.".to_owned(),
    };
    Plot::new("gain.svg", "Gain over the closed form", (1, 460), [panel]).caption(format!(
        "RMS error of the closed form divided by that of the EKF in {}, logarithmic, with 99 % intervals. Above the \
         line at 1 the EKF is better, below it the closed form is. Left, shaded: closed form in its own {}.{equal}",
        minutes(accuracy.table_time),
        minutes(accuracy.baseline.table_time)
    ))
}

/// RMS error of both methods against table time.
fn against_time(accuracy: &Accuracy) -> Plot {
    let panels = accuracy.groups.iter().map(of_group_against_time);
    Plot::new("time.svg", "Accuracy against table time", (3, 340), panels).caption(
        "RMS error over all runs during the last pass, one panel per group, both axes logarithmic. \
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
    let mut bound = Series::line(bound).color(Color::Ink).dashed().width(1.25);
    bound.label = of_bound.map(str::to_owned);
    let rings = Series::marks(Mark::Ring, closed.clone()).nth(1).width(1.25);
    let title = of.group.titled();
    Panel::new(title, Axis::log("table time, min"), Axis::log(""))
        .with(Series::line(filter).width(1.75).label(of_filter))
        .with(bound)
        .with(Series::line(closed).nth(1).width(1.0))
        .with(rings.label("closed form"))
}

/// Half the range of the axis of errors in σ, unless more than one in twenty lies outside.
const REACH: f64 = 5.0;
const BEYOND: f64 = 0.05;
const BINS: usize = 24;
/// Points of a curve.
const CURVE: usize = 301;
/// If a run exceeds the upper end of the NEES interval by this factor, the axis is logarithmic.
const FAR_NEES: f64 = 4.0;
/// Minimum half range of the position axes, in σ.
const POSITION_REACH: f64 = 4.0;

/// Normalised errors of each group, with the density implied by the stated σ.
pub fn errors(accuracy: &Accuracy) -> Plot {
    let panels = Group::all().map(|group| {
        let values = normalised(accuracy, group);
        let reach = reach(&values);
        let normal = |z: f64| (-0.5 * z * z).exp() / TAU.sqrt();
        let curve = steps(-reach, reach, CURVE);
        let bars = histogram(&values, reach);
        let highest = bars.iter().map(|bar| bar.2).fold(0.0, f64::max);
        // Errors far beyond their σ are lower than the curve by far: it leaves the panel then.
        let top = if reach > REACH {
            highest
        } else {
            highest.max(normal(0.0))
        };
        let mean_square = values.iter().map(|z| z * z).sum::<f64>() / values.len() as f64;
        let beyond = values.iter().filter(|z| z.abs() > reach).count();
        let mut notes = vec![
            format!("{} values", count(values.len())),
            format!("RMS {}", tables::factor(mean_square.sqrt())),
        ];
        notes.extend((beyond > 0).then(|| format!("{} beyond ±{REACH}", count(beyond))));
        let x = Axis::linear("error / σ").between(-reach, reach);
        let y = Axis::linear("").between(0.0, 1.08 * top);
        Panel::new(format!("{}: density", group.title()), x, y)
            .with(Series::bars(reach / BINS as f64, Fill::Pale, bars).width(0.75))
            .with(Series::line(curve.map(|z| (z, normal(z)))).color(Color::Ink))
            .noted(notes)
    });
    Plot::new("errors.svg", "Errors over claimed σ", (3, 300), panels).caption(
        "Density of parameter errors divided by the filter's σ, all runs. Line: standard normal density, which \
         applies if the σ are correct (RMS 1). If the axis extends beyond ±5, the σ are too small and the line is a \
         spike at zero.",
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

fn reach(values: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = values.iter().map(|z| z.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let last = (sizes.len() as f64 * (1.0 - BEYOND)) as usize;
    match (sizes.get(last), sizes.last()) {
        (Some(&most), Some(&all)) if most > REACH => all,
        _ => REACH,
    }
}

/// Middle, foot and density of the bins of a histogram over ±`reach`, as a density of all values.
fn histogram(values: &[f64], reach: f64) -> Vec<Upright> {
    let mut counts = [0usize; BINS];
    for z in values {
        let place = (z / reach + 1.0) * 0.5 * BINS as f64;
        if let Some(bin) = counts.get_mut(place as usize).filter(|_| place >= 0.0) {
            *bin += 1;
        }
    }
    let width = 2.0 * reach / BINS as f64;
    let density = |n: usize| n as f64 / (values.len().max(1) as f64 * width);
    let bins = counts.into_iter().enumerate();
    bins.map(|(k, n)| ((k as f64 + 0.5) * width - reach, 0.0, density(n)))
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
    let most = all().fold(one.1, f64::max);
    let (y, kind) = match most > FAR_NEES * one.1 {
        true => (Axis::log("").including([one.0, one.1]), ", logarithmic"),
        false => (Axis::linear("").between(0.0, 1.08 * most), ""),
    };
    let (first, last) = (-0.5, accuracy.trials.len() as f64 - 0.5);
    let n = accuracy.anees.map_or(0, |anees| anees.directions);
    let x = Axis::linear("run").between(first, last);
    let mut panel = Panel::new(format!("NEES/n of each run, n = {n}{kind}"), x, y);
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
    panel.notes_left = true;
    panel.square = true;
    panel
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_histogram_holds_each_value_once_in_its_own_bin() {
        let tops = histogram(&[-0.1, 0.1, 0.1, 7.0, -7.0], 5.0);
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

    #[test]
    fn an_axis_widens_only_for_errors_that_no_normal_density_has() {
        let mut values = vec![0.5; 99];
        values.push(40.0);
        assert_eq!(reach(&values), REACH);
        values.extend([30.0; 10]);
        assert_eq!(reach(&values), 40.0);
        assert_eq!(reach(&[]), REACH);
    }
}
