//! Position errors at the end and against time.

use super::tables::{hours, method_name, situation_name};
use crate::imu::InstallationForm;
use crate::report::prelude::*;
use crate::study::Experiment;
use crate::study::experiment::{Estimator, Navigated, Worth};

/// Half the height of a box, in places of the axis.
const HALF: f64 = 0.2;
/// Below this nothing is worth a place on the axis of time, nmile.
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
        // The first method stands at the top.
        let methods: Vec<&Worth> = navigated.methods.iter().rev().collect();
        let names = methods
            .iter()
            .map(|worth| method_name(experiment, worth.method));
        let noise = navigated.noise.median;
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
         with its value: median; box: the middle half; line beyond: 95 % are below; dashed: median of what the \
         noise of the instrument alone makes.",
    )
}

fn boxed(place: f64, worth: &Worth) -> Vec<Series> {
    let (below, above) = (place - HALF, place + HALF);
    let at_end = &worth.at_end;
    let ((first, third), median, most) = (at_end.quartiles, at_end.median, at_end.below_95);
    let upright = |x: f64| Series::line([(x, below), (x, above)]);
    let thin = [
        upright(first),
        upright(third),
        upright(most),
        Series::line([(third, place), (most, place)]),
    ];
    let color = color(worth.method.estimator);
    let dots = worth.errors.iter().map(|&error| (error, place));
    let dots = Series::marks(Mark::Dot, dots).color(color).width(0.5);
    let edge = |y: f64| vec![(first, y), (third, y)];
    let mut all = vec![Series::band(edge(below), edge(above))];
    all.extend(thin.map(|line| line.color(color).width(1.0)));
    all.extend([
        dots,
        upright(median).color(Color::Ink).width(3.0),
        Series::words((median, place), Anchor::Above, three_digits(median)),
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
         what calibrated; solid: general form, dashed: six-angle, dotted: three-angle. The lines of general and \
         six-angle lie upon each other where both forms give the same.",
    )
}

/// Hours against nmile; the start, where there is no error, has no place on a logarithmic axis.
fn course(worth: &Worth) -> Vec<Point> {
    let points = worth.against_time.iter();
    let points = points.map(|&(time, median)| (time / HOUR, median));
    points.filter(|point| point.0 > 0.0).collect()
}
