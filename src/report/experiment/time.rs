//! The median position error of every method against time.

use super::super::axis::Axis;
use super::super::canvas::{Area, DrawError, Pen};
use super::super::panel::{Margins, Panel};
use super::super::{Figure, ReportError};
use super::distribution::pen;
use super::{HOUR, by_navigation, hours, method_name, miles, situation_name};
use crate::imu::InstallationForm;
use crate::study::Experiment;
use crate::study::experiment::{Navigated, Worth};

/// Below this nothing is worth a place on the axis, nmile.
const LEAST: f64 = 0.01;

pub(super) fn figure(experiment: &Experiment) -> Result<Figure, ReportError> {
    let caption = String::from(
        "Median over all instruments of the horizontal position error, logarithmic, the same axes for \
         all. Colour: what calibrated; solid: general form, dashed: six-angle, dotted: three-angle. \
         The lines of general and six-angle lie upon each other where both forms give the same.",
    );
    let ends = experiment.navigations.iter().flat_map(|n| &n.methods);
    let points = ends.flat_map(line).map(|p| p.1).filter(|y| *y > LEAST);
    let y = Axis::log(points);
    let names = ("time.svg", "Median position error against time");
    by_navigation(
        names,
        caption,
        &experiment.navigations,
        330,
        |area, navigated| panel(area, experiment, navigated, y.clone()),
    )
}

/// Hours against nmile; the start, where there is no error, has no place on a logarithmic axis.
fn line(worth: &Worth) -> Vec<(f64, f64)> {
    let points = worth.against_time.iter();
    points
        .map(|&(time, metres)| (time / HOUR, miles(metres)))
        .filter(|point| point.0 > 0.0)
        .collect()
}

fn panel(
    area: &Area,
    experiment: &Experiment,
    navigated: &Navigated,
    y: Axis,
) -> Result<(), DrawError> {
    let mut panel = Panel::new(
        area,
        &format!(
            "{}: median position error, nmile",
            situation_name(navigated.situation)
        ),
        Margins {
            left: 60.0,
            right: 250.0,
        },
        (Axis::linear(0.0, hours(experiment)), y),
        "time, h",
        &[],
    )?;
    for worth in &navigated.methods {
        let pen = Pen {
            dash: match worth.method.form {
                InstallationForm::General => None,
                InstallationForm::SixAngle => Some((6.0, 4.0)),
                InstallationForm::ThreeAngle => Some((2.0, 2.0)),
            },
            ..pen(worth.method.estimator)
        };
        let line = line(worth);
        panel.line(&line, pen)?;
        if let Some(&(_, last)) = line.last() {
            panel.label(last, method_name(experiment, worth.method), pen.color);
        }
    }
    panel.finish()
}
