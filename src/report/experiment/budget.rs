//! Which group of parameters makes how much of the position error.

use plotters::style::text_anchor::{HPos, VPos};

use super::super::axis::Axis;
use super::super::canvas::{Area, DrawError, write};
use super::super::number::{sigma, three_digits};
use super::super::panel::{Margins, Panel};
use super::super::{Figure, ReportError};
use super::distribution::pen;
use super::{by_navigation, estimator_name, in_general, miles, situation_name};
use crate::calibration::Group;
use crate::study::Experiment;
use crate::study::experiment::{Estimator, Navigated, Situation, Worth};

/// Half the width of a bar, and from one to the next, in places of the axis.
const HALF: f64 = 0.12;
const APART: f64 = 0.28;
/// Where the names of the bars begin, and from one to the next, in shown pixels.
const LEGEND: f64 = 650.0;
const NAME: f64 = 180.0;

pub(super) fn figure(experiment: &Experiment) -> Result<Figure, ReportError> {
    let names: Vec<String> = Estimator::ALL
        .map(|estimator| estimator_name(experiment, estimator))
        .to_vec();
    let caption = format!(
        "Root mean square of the position error at the end that each group would make alone, and of all \
         together, from the claimed covariance in the general form, and of the errors there were; \
         logarithmic, the same axis for both. Bars from left to right: {}; one without a number is \
         less than the axis shows.",
        names.join(", ")
    );
    let shown: Vec<&Navigated> = experiment
        .navigations
        .iter()
        .filter(|n| n.situation != Situation::Aligned)
        .collect();
    let all = shown.iter().flat_map(|n| {
        let worths = Estimator::ALL.into_iter().filter_map(|e| in_general(n, e));
        worths.flat_map(heights)
    });
    let (low, high) = all
        .filter(|y| *y > 0.0)
        .fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), y| {
            (low.min(y), high.max(y))
        });
    // What is a thousandth of the whole is nothing.
    let y = Axis::log_between(low.max(1e-3 * high) * 0.7, 1.8 * high);
    let names = ("budget.svg", "Error budget");
    by_navigation(names, caption, shown, 360, |area, navigated| {
        panel(area, experiment, navigated, y.clone())
    })
}

/// Of each group alone, of all as claimed and as they were, nmile.
fn heights(worth: &Worth) -> Vec<f64> {
    let budget = &worth.budget;
    let alone = budget.parts.iter().map(|part| part.alone);
    alone
        .chain([budget.claimed, budget.actual])
        .map(miles)
        .collect()
}

fn panel(
    area: &Area,
    experiment: &Experiment,
    navigated: &Navigated,
    y: Axis,
) -> Result<(), DrawError> {
    let all = ["all, claimed", "all, actual"].map(str::to_owned);
    let x = Axis::places(Group::all().map(Group::title).chain(all));
    let foot = y.low();
    let mut panel = Panel::new(
        area,
        &format!(
            "{}: position error alone, RMS, nmile",
            situation_name(navigated.situation)
        ),
        Margins {
            left: 60.0,
            right: 24.0,
        },
        (x, y),
        "",
        &[],
    )?;
    for (n, estimator) in Estimator::ALL.into_iter().enumerate() {
        let Some(worth) = in_general(navigated, estimator) else {
            continue;
        };
        let name = format!("■ {}", estimator_name(experiment, estimator));
        let place = (LEGEND + NAME * n as f64, 6.0);
        let color = pen(estimator).color;
        write(area, &name, place, (HPos::Left, VPos::Top), &color, 1.0)?;
        for (place, height) in heights(worth).into_iter().enumerate() {
            let x = place as f64 + APART * (n as f64 - 1.0);
            let (left, right) = (x - HALF, x + HALF);
            let height_shown = height.max(foot);
            panel.band(
                &[(left, foot), (right, foot)],
                &[(left, height_shown), (right, height_shown)],
            )?;
            panel.line(
                &[
                    (left, foot),
                    (left, height_shown),
                    (right, height_shown),
                    (right, foot),
                ],
                pen(estimator),
            )?;
            if height < foot {
                continue;
            }
            // Three digits of a small number would not fit above its bar.
            let number = if height < 1.0 {
                sigma(height)
            } else {
                three_digits(height)
            };
            let above = (HPos::Center, VPos::Bottom);
            panel.text((x, height_shown), (0.0, -3.0), &number, above)?;
        }
    }
    panel.finish()
}
