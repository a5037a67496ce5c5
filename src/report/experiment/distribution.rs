//! How the position error at the end is distributed over the instruments.

use plotters::style::text_anchor::{HPos, VPos};

use super::super::axis::Axis;
use super::super::canvas::{Area, DrawError, INK, Pen, QUIET};
use super::super::panel::{Margins, Mark, Panel};
use super::super::{Figure, ReportError};
use super::tables::nmile;
use super::{by_navigation, method_name, miles, situation_name};
use crate::study::Experiment;
use crate::study::experiment::{Estimator, Navigated, Worth};

/// Half the height of a box, in places of the axis.
const HALF: f64 = 0.2;

pub(super) fn figure(experiment: &Experiment) -> Result<Figure, ReportError> {
    let caption = String::from(
        "Horizontal position error at the end, logarithmic, the same axis for all. Dots: instruments; \
         thick line with its value: median; box: the middle half; line beyond: 95 % are below; \
         dashed: median of what the noise of the instrument alone makes.",
    );
    let all: Vec<f64> = experiment
        .navigations
        .iter()
        .flat_map(|n| n.methods.iter().flat_map(|w| w.errors.iter().copied()))
        .map(miles)
        .filter(|x| *x > 0.0)
        .collect();
    let low = all.iter().copied().fold(f64::INFINITY, f64::min);
    let high = all.iter().copied().fold(0.0, f64::max);
    let x = Axis::log_between(0.8 * low, 1.25 * high);
    let names = ("distribution.svg", "Position error at the end");
    by_navigation(
        names,
        caption,
        &experiment.navigations,
        330,
        |area, navigated| panel(area, experiment, navigated, x.clone()),
    )
}

fn panel(
    area: &Area,
    experiment: &Experiment,
    navigated: &Navigated,
    x: Axis,
) -> Result<(), DrawError> {
    // The first method stands at the top.
    let methods: Vec<&Worth> = navigated.methods.iter().rev().collect();
    let names = methods.iter().map(|w| method_name(experiment, w.method));
    let y = Axis::places(names);
    let top = y.high();
    let mut panel = Panel::new(
        area,
        &format!(
            "{}: position error, nmile",
            situation_name(navigated.situation)
        ),
        Margins {
            left: 225.0,
            right: 70.0,
        },
        (x, y),
        "",
        &[],
    )?;
    let noise = miles(navigated.noise.median);
    panel.line(&[(noise, -0.5), (noise, top)], Pen::dashed(QUIET, 1.25))?;
    let left_of_it = (HPos::Right, VPos::Bottom);
    panel.text((noise, -0.5), (-4.0, -3.0), "noise alone", left_of_it)?;
    for (place, worth) in methods.iter().enumerate() {
        boxed(&mut panel, place as f64, worth)?;
    }
    panel.finish()
}

fn boxed(panel: &mut Panel, place: f64, worth: &Worth) -> Result<(), DrawError> {
    let pen = pen(worth.method.estimator);
    let (below, above) = (place - HALF, place + HALF);
    let (first, third) = worth.at_end.quartiles;
    let (first, third) = (miles(first), miles(third));
    let (median, most) = (miles(worth.at_end.median), miles(worth.at_end.below_95));
    panel.band(
        &[(first, below), (third, below)],
        &[(first, above), (third, above)],
    )?;
    for at in [first, third, most] {
        panel.line(&[(at, below), (at, above)], Pen::solid(pen.color, 1.0))?;
    }
    panel.line(&[(third, place), (most, place)], Pen::solid(pen.color, 1.0))?;
    let dots: Vec<(f64, f64)> = worth.errors.iter().map(|&e| (miles(e), place)).collect();
    panel.marks(&dots, Mark::Dot, Pen::solid(pen.color, 0.5))?;
    panel.line(&[(median, below), (median, above)], Pen::solid(INK, 3.0))?;
    panel.text(
        (miles(worth.at_end.median), place),
        (0.0, -8.0),
        &nmile(worth.at_end.median),
        (HPos::Center, VPos::Bottom),
    )
}

/// The pen of an estimator, the same in every figure.
pub(super) fn pen(estimator: Estimator) -> Pen {
    let place = Estimator::ALL.iter().position(|e| *e == estimator);
    // Orange, light blue, blue.
    Pen::nth([1, 3, 0][place.unwrap_or(0)], 1.5)
}
