//! Position errors at the end.

use super::tables::{method_name, situation_name};
use crate::prelude::*;
use turncal::study::Experiment;
use turncal::study::experiment::{Estimator, Navigated, Worth};

/// Figure with a panel for each situation and, in each panel, a column of errors for each method.
pub fn distribution(experiment: &Experiment) -> Plot {
    let all = experiment.navigations.iter().flat_map(|n| &n.methods);
    let all: Vec<f64> = all.flat_map(|w| w.errors.iter().copied()).collect();
    let panel = |navigated: &Navigated| {
        let methods = navigated.methods.iter();
        let x = Axis::places(methods.map(|worth| method_name(experiment, worth.method)));
        let situation = situation_name(navigated.situation);
        let y = Axis::log("").including(all.iter().copied()).room(0.1, 0.4);
        let noise = Series::level(navigated.noise.median).color(Color::Quiet);
        let methods = navigated.methods.iter().enumerate();
        Panel::new(format!("{situation}: position error, nmile"), x, y)
            .with(noise.dashed().label("noise alone"))
            .with_all(methods.flat_map(|(place, worth)| spread(place as f64, worth)))
    };
    let panels = experiment.navigations.iter().map(panel);
    Plot::new("distribution.svg", "Position error at the end", (1, 330), panels).caption(
        "Horizontal position error at the end of navigation, on a logarithmic scale that is the same for all \
         methods. Small dots: instruments; large dot with its value: median; thick line: the middle half; dashed: \
         median error caused by instrument noise alone.",
    )
}

/// The median on a line over the middle half, among the errors of all instruments.
fn spread(x: f64, worth: &Worth) -> [Series; 3] {
    let (quartiles, median) = (worth.at_end.quartiles, worth.at_end.median);
    let color = Color::Nth(match worth.method.estimator {
        Estimator::ClosedForm => 1,
        Estimator::Filter => 3,
        Estimator::LongFilter => 0,
    });
    let errors = worth.errors.iter().map(|&error| (x, error));
    let middle = Series::whiskers(Mark::Dot, [((x, median), quartiles)]);
    [
        Series::marks(Mark::Dot, errors).color(color).width(0.5),
        middle.color(color).width(3.0),
        Series::words(
            (x, worth.at_end.below_95),
            Anchor::Above,
            three_digits(median),
        ),
    ]
}
