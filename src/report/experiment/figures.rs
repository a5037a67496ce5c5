//! Position errors at the end, against time, and by group of parameters.

use super::tables::{estimator_name, hours, in_general, method_name, miles, nmile, situation_name};
use crate::calibration::Group;
use crate::imu::InstallationForm;
use crate::report::prelude::*;
use crate::study::Experiment;
use crate::study::experiment::{Estimator, Navigated, Situation, Worth};

/// Half the height of a box, in axis positions.
const HALF: f64 = 0.2;
/// Lower end of the error axis against time, nmile.
const LEAST: f64 = 0.01;

pub fn figures(experiment: &Experiment) -> [Plot; 3] {
    [
        distribution(experiment),
        against_time(experiment),
        budget(experiment),
    ]
}

/// The colour of an estimator, the same in every figure: orange, light blue, blue.
fn color(estimator: Estimator) -> Color {
    let place = Estimator::ALL.iter().position(|e| *e == estimator);
    Color::Nth([1, 3, 0][place.unwrap_or(0)])
}

fn distribution(experiment: &Experiment) -> Plot {
    let all = experiment.navigations.iter().flat_map(|n| &n.methods);
    let all: Vec<f64> = all
        .flat_map(|w| w.errors.iter().map(|&e| miles(e)))
        .collect();
    let panel = |navigated: &Navigated| {
        // The first method stands at the top.
        let methods: Vec<&Worth> = navigated.methods.iter().rev().collect();
        let names = methods
            .iter()
            .map(|worth| method_name(experiment, worth.method));
        let noise = miles(navigated.noise.median);
        let title = format!(
            "{}: position error, nmile",
            situation_name(navigated.situation)
        );
        let x = Axis::log("").including(all.iter().copied()).room(0.1, 0.1);
        Panel::new(title, x, Axis::places(names).room(0.0, 0.4))
            .with(
                Series::new(Shape::Upright(noise))
                    .color(Color::Quiet)
                    .dashed()
                    .width(1.25),
            )
            .with(Series::words(
                (noise, -0.5),
                Anchor::AboveLeft,
                "noise alone",
            ))
            .with_all(
                methods
                    .iter()
                    .enumerate()
                    .flat_map(|(k, worth)| boxed(k as f64, worth)),
            )
    };
    let panels = experiment.navigations.iter().map(panel);
    Plot::new("distribution.svg", "Position error at the end", (1, 330), panels).caption(
        "Horizontal position error at the end, logarithmic, the same axis for all. Dots: instruments; thick line \
         with value: median; box: middle half; whisker: 95 % of instruments are below its end; dashed: median error \
         due to instrument noise alone.",
    )
}

fn boxed(place: f64, worth: &Worth) -> Vec<Series> {
    let (below, above) = (place - HALF, place + HALF);
    let at_end = &worth.at_end;
    let [first, third] = [at_end.quartiles.0, at_end.quartiles.1].map(miles);
    let [median, most] = [at_end.median, at_end.below_95].map(miles);
    let upright = |x: f64| Series::line([(x, below), (x, above)]);
    let thin = [
        upright(first),
        upright(third),
        upright(most),
        Series::line([(third, place), (most, place)]),
    ];
    let color = color(worth.method.estimator);
    let dots = worth.errors.iter().map(|&error| (miles(error), place));
    let dots = Series::marks(Mark::Dot, dots).color(color).width(0.5);
    let edge = |y: f64| vec![(first, y), (third, y)];
    let mut all = vec![Series::band(edge(below), edge(above))];
    all.extend(thin.map(|line| line.color(color).width(1.0)));
    all.extend([
        dots,
        upright(median).color(Color::Ink).width(3.0),
        Series::words((median, place), Anchor::Above, nmile(at_end.median)),
    ]);
    all
}

fn against_time(experiment: &Experiment) -> Plot {
    let series = |worth: &Worth| {
        let dash = match worth.method.form {
            InstallationForm::General => Dash::Solid,
            InstallationForm::SixAngle => Dash::Dashed,
            InstallationForm::ThreeAngle => Dash::Dotted,
        };
        Series::line(course(worth))
            .color(color(worth.method.estimator))
            .dash(dash)
            .label(method_name(experiment, worth.method))
    };
    let all = experiment.navigations.iter().flat_map(|n| &n.methods);
    let all = all.flat_map(course).map(|point| point.1);
    let (low, high) = positive_range(all.filter(|y| *y > LEAST));
    let panel = |navigated: &Navigated| {
        let title = format!(
            "{}: median position error, nmile",
            situation_name(navigated.situation)
        );
        let y = Axis::log("").between(low, 1.3 * high);
        Panel::new(title, Axis::hours(hours(experiment)), y)
            .with_all(navigated.methods.iter().map(series))
    };
    let panels = experiment.navigations.iter().map(panel);
    Plot::new("time.svg", "Median position error against time", (1, 330), panels).caption(
        "Median over all instruments of the horizontal position error, logarithmic, the same axes for all. Colour: \
         calibration method; solid: general form, dashed: six-angle, dotted: three-angle. The general and six-angle \
         lines coincide where both forms give the same result.",
    )
}

/// Hours against nmile, without the start, where the error is zero and the axis is logarithmic.
fn course(worth: &Worth) -> Vec<Point> {
    let points = worth.against_time.iter();
    let points = points.map(|&(time, metres)| (time / HOUR, miles(metres)));
    points.filter(|point| point.0 > 0.0).collect()
}

/// Contribution of each parameter group to the position error.
fn budget(experiment: &Experiment) -> Plot {
    let names = Estimator::ALL.map(|estimator| estimator_name(experiment, estimator));
    let shown = experiment
        .navigations
        .iter()
        .filter(|n| n.situation != Situation::Aligned);
    let all = shown
        .clone()
        .flat_map(|n| Estimator::ALL.into_iter().filter_map(|e| in_general(n, e)));
    let (low, high) = positive_range(all.flat_map(heights));
    // What is a thousandth of the whole is nothing.
    let y = Axis::log("").between(low.max(1e-3 * high) * 0.7, 1.8 * high);
    let panel = |navigated: &Navigated| {
        let totals = ["all, claimed", "all, actual"].map(str::to_owned);
        let x = Axis::places(Group::all().map(Group::title).chain(totals));
        let title = format!(
            "{}: position error alone, RMS, nmile",
            situation_name(navigated.situation)
        );
        let bars = Estimator::ALL.into_iter().enumerate();
        let bars = bars.filter_map(|(n, estimator)| {
            let shift = beside(n, Estimator::ALL.len(), 0.84);
            let heights = heights(in_general(navigated, estimator)?);
            let tops = heights.into_iter().enumerate();
            let tops: Vec<Point> = tops.map(|(k, top)| (k as f64 + shift, top)).collect();
            let bars = tops.iter().map(|&(x, top)| (x, f64::NEG_INFINITY, top));
            let bars = Series::bars(0.12, Fill::Pale, bars).color(color(estimator));
            let worded = tops
                .into_iter()
                .filter(|top| top.1 >= 0.7 * low.max(1e-3 * high));
            let words: Vec<Series> = worded.map(height_in_words).collect();
            Some(std::iter::once(bars.key(names[n].clone())).chain(words))
        });
        Panel::new(title, x, y.clone()).with_all(bars.flatten())
    };
    Plot::new("budget.svg", "Error budget", (1, 360), shown.map(panel)).caption(format!(
        "RMS position error at the end due to each group alone and due to all together, predicted from the stated \
         covariance in the general form, and actual; logarithmic, same axis for both. Bars from left to right: {}; a \
         bar without a number is below the axis range.",
        names.join(", ")
    ))
}

/// The bar height, above the bar.
fn height_in_words(top: Point) -> Series {
    // Three digits of a small number would not fit above its bar.
    let number = if top.1 < 1.0 {
        sigma(top.1)
    } else {
        three_digits(top.1)
    };
    Series::words(top, Anchor::Above, number)
}

/// Each group alone, all together as stated, and actual, nmile.
fn heights(worth: &Worth) -> Vec<f64> {
    let budget = &worth.budget;
    let alone = budget.parts.iter().map(|part| part.alone);
    alone
        .chain([budget.claimed, budget.actual])
        .map(miles)
        .collect()
}
