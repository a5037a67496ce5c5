//! Position errors at the end and against time.

use super::tables::{hours, method_name, situation_name};
use crate::prelude::*;
use turncal::imu::InstallationForm;
use turncal::study::Experiment;
use turncal::study::experiment::{Estimator, Navigated, Worth};

/// Lower end of the error axis against time, nmile.
const LEAST: f64 = 0.01;

pub fn figures(experiment: &Experiment) -> [Plot; 2] {
    [distribution(experiment), against_time(experiment)]
}

/// The colour of an estimator, the same in every figure: orange, light blue, blue.
fn color(estimator: Estimator) -> Color {
    let place = Estimator::ALL.iter().position(|e| *e == estimator);
    Color::Nth([1, 3, 0][place.unwrap_or(0)])
}

fn distribution(experiment: &Experiment) -> Plot {
    let all = experiment.navigations.iter().flat_map(|n| &n.methods);
    let all: Vec<f64> = all.flat_map(|w| w.errors.iter().copied()).collect();
    let panel = |navigated: &Navigated| {
        let methods = navigated.methods.iter();
        let x = Axis::places(methods.map(|worth| method_name(experiment, worth.method)));
        let situation = situation_name(navigated.situation);
        let y = Axis::log("").including(all.iter().copied()).room(0.1, 0.4);
        let noise = Series::level(navigated.noise.median).color(Color::Quiet);
        let boxes = navigated.methods.iter().enumerate();
        Panel::new(format!("{situation}: position error, nmile"), x, y)
            .with(noise.dashed().label("noise alone"))
            .with_all(boxes.flat_map(|(place, worth)| boxed(place as f64, worth)))
    };
    let panels = experiment.navigations.iter().map(panel);
    Plot::new("distribution.svg", "Position error at the end", (1, 330), panels).caption(
        "Horizontal position error at the end, logarithmic, same axis for all. Small dots: instruments; large \
         dot with its value: median; box: the middle half; line: 95 % are below its end; dashed: median error \
         due to instrument noise alone.",
    )
}

fn boxed(x: f64, worth: &Worth) -> [Series; 4] {
    let at_end = &worth.at_end;
    let ((first, third), median, most) = (at_end.quartiles, at_end.median, at_end.below_95);
    let color = color(worth.method.estimator);
    let dots = worth.errors.iter().map(|&error| (x, error));
    [
        Series::bars(0.2, Fill::Pale, [(x, first, third)])
            .color(color)
            .width(1.0),
        Series::marks(Mark::Dot, dots).color(color).width(0.5),
        Series::whiskers(Mark::Dot, [((x, median), (median, most))])
            .color(color)
            .width(3.0),
        Series::words((x, most), Anchor::Above, three_digits(median)),
    ]
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
        Panel::new(title, Axis::time("h", hours(experiment)), y)
            .with_all(navigated.methods.iter().map(series))
    };
    let panels = experiment.navigations.iter().map(panel);
    Plot::new("time.svg", "Median position error against time", (1, 330), panels).caption(
        "Median over all instruments of the horizontal position error, logarithmic, same axes for all. Colour: \
         calibration method; solid: general form, dashed: six-angle, dotted: three-angle. The general and six-angle \
         lines coincide where both forms give the same result.",
    )
}

/// Hours against nmile, without the start, where the error is zero and the axis is logarithmic.
fn course(worth: &Worth) -> Vec<Point> {
    let points = worth.against_time.iter();
    let points = points.map(|&(time, median)| (time / HOUR, median));
    points.filter(|point| point.0 > 0.0).collect()
}
