//! Figures of errors over what is claimed of them.

use std::f64::consts::TAU;

use super::compared::journey_name;
use super::tables;
use super::tables::percent;
use crate::calibration::{Group, PARAMETERS};
use crate::report::prelude::*;
use crate::study::accuracy::{Position, Region};
use crate::study::{Accuracy, NavigationAccuracy};

/// Half the width of the axis of errors in σ, unless more than one in twenty lies beyond.
const REACH: f64 = 5.0;
const BEYOND: f64 = 0.05;
const BINS: usize = 24;
/// Points of a curve.
const CURVE: usize = 300;
/// Runs this many times above the upper end of the interval of NEES make its axis logarithmic.
const FAR_NEES: f64 = 4.0;
/// The least half width of the axes of positions, in σ.
const POSITION_REACH: f64 = 4.0;

/// Normalised errors of each group over the density that the claimed σ promise.
pub(super) fn errors(accuracy: &Accuracy) -> Plot {
    let panels = Group::all().map(|group| {
        let values = normalised(accuracy, group);
        let reach = reach(&values);
        let normal = |z: f64| (-0.5 * z * z).exp() / TAU.sqrt();
        let curve = (0..=CURVE).map(|k| reach * (2.0 * k as f64 / CURVE as f64 - 1.0));
        let tops = histogram(&values, reach);
        let highest = tops.iter().map(|top| top.1).fold(0.0, f64::max);
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
        let bars = Shape::Bars {
            tops,
            half: reach / BINS as f64,
            base: Some(0.0),
            filled: true,
        };
        let x = Axis::linear("error / σ").between(-reach, reach);
        let y = Axis::linear("").between(0.0, 1.08 * top);
        Panel::new(format!("{}: density", group.title()), x, y)
            .with(Series::new(bars).width(0.75))
            .with(Series::line(curve.map(|z| (z, normal(z)))).color(Color::Ink))
            .noted(notes)
    });
    Plot::new("errors.svg", "Errors over claimed σ", (3, 300), panels).caption(
        "Density of every parameter's error over the σ that the filter claims for it, all runs. Line: the standard \
         normal density, which it follows if the σ are true; RMS is then 1. Where the axis ends beyond ±5 they are \
         not, and the line is a spike at zero.",
    )
}

/// Errors over σ of the parameters of a group that have a σ.
fn normalised(accuracy: &Accuracy, group: Group) -> Vec<f64> {
    let filtered = accuracy.trials.iter().filter_map(|t| t.filtered.as_ref());
    filtered
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

/// Middles and densities of the bins of a histogram over ±`reach`, as a density of all values.
fn histogram(values: &[f64], reach: f64) -> Vec<Point> {
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
    bins.map(|(k, n)| ((k as f64 + 0.5) * width - reach, density(n)))
        .collect()
}

/// NEES/n of every run with the intervals of one run and of the average.
pub(super) fn nees(accuracy: &Accuracy) -> Plot {
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
        "Squared error over the claimed covariance, correlations included, one dot for each run; 1 on average if \
         the σ are true. Shaded: 95 % interval of one run; {} of {} runs lie outside.",
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

/// Position errors after each mission over the σ that were predicted of them.
pub(super) fn positions(accuracy: &Accuracy) -> Plot {
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
        "Horizontal position error of the EKF after 40 h over the σ predicted from its covariance, one dot for \
         each run, the same axes for all. Across: east over its σ; up: what north differs from that which east \
         lets expect, over the σ of that. So the ellipses of all runs are circles: solid 1σ, dashed 2.45σ. Where \
         the axes end far beyond ±4 the σ are too small, and the circles a speck in the middle.",
    )
}

fn of_mission(of: &NavigationAccuracy, cloud: Vec<Point>, reach: f64) -> Panel {
    let ellipses = Region::ALL.into_iter().filter_map(|region| match region {
        Region::Ellipse(sigmas) => Some(sigmas),
        Region::East | Region::North => None,
    });
    let circles = ellipses.enumerate().map(|(n, sigmas)| {
        let angles = (0..=CURVE).map(|k| TAU * k as f64 / CURVE as f64);
        let circle = angles.map(|angle| (sigmas * angle.cos(), sigmas * angle.sin()));
        let series = Series::line(circle).color(Color::Ink);
        if n == 0 { series } else { series.dashed() }
    });
    let mut notes = vec![format!("{} runs", count(cloud.len()))];
    for held in &of.containment {
        if let Region::Ellipse(sigmas) = held.region {
            let found = percent(held.within as f64 / held.runs as f64);
            let claimed = percent(held.region.probability());
            notes.push(format!("within {sigmas}σ: {found} %, claimed {claimed} %"));
        }
    }
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
                .1
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
