//! Normalised errors of each group over the density that the claimed σ promise.

use std::f64::consts::TAU;

use plotters::style::text_anchor::{HPos, VPos};

use super::super::axis::Axis;
use super::super::canvas::{Area, DrawError, INK, Pen};
use super::super::number::count;
use super::super::panel::{Margins, Panel};
use super::super::{Figure, ReportError};
use super::tables;
use crate::calibration::Group;
use crate::calibration::PARAMETERS;
use crate::study::Accuracy;

/// Half the width of the axis in σ, unless more than one error in twenty lies beyond.
const REACH: f64 = 5.0;
const BEYOND: f64 = 0.05;
const BINS: usize = 24;
const CURVE: usize = 400;

pub(super) fn figure(accuracy: &Accuracy) -> Result<Figure, ReportError> {
    let caption = String::from(
        "Density of every parameter's error over the σ that the filter claims for it, all runs. Line: \
         the standard normal density, which it follows if the σ are true; RMS is then 1. Where \
         the axis ends beyond ±5 they are not, and the line is a spike at zero.",
    );
    Figure::draw(
        "errors.svg",
        "Errors over claimed σ",
        caption,
        (1200, 600),
        |area| {
            for (group, area) in Group::all().zip(area.split_evenly((2, 3))) {
                panel(&area, group, &normalised(accuracy, group))?;
            }
            Ok(())
        },
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

/// Corners of the steps of a histogram over ±`reach`, as a density of all values.
fn steps(values: &[f64], reach: f64) -> Vec<(f64, f64)> {
    let mut counts = [0usize; BINS];
    for z in values {
        let place = (z / reach + 1.0) * 0.5 * BINS as f64;
        if let Some(bin) = counts.get_mut(place as usize).filter(|_| place >= 0.0) {
            *bin += 1;
        }
    }
    let edge = |k: usize| reach * (2.0 * k as f64 / BINS as f64 - 1.0);
    let width = 2.0 * reach / BINS as f64;
    let density = |n: usize| n as f64 / (values.len().max(1) as f64 * width);
    let bins = counts.into_iter().enumerate();
    bins.flat_map(|(k, n)| [(edge(k), density(n)), (edge(k + 1), density(n))])
        .collect()
}

fn panel(area: &Area, group: Group, values: &[f64]) -> Result<(), DrawError> {
    let reach = reach(values);
    let steps = steps(values, reach);
    let normal = |z: f64| (-0.5 * z * z).exp() / TAU.sqrt();
    let highest = steps.iter().map(|step| step.1).fold(0.0, f64::max);
    // Errors far beyond their σ are lower than the curve by far: it leaves the panel then.
    let top = if reach > REACH {
        highest
    } else {
        highest.max(normal(0.0))
    };
    let mut panel = Panel::new(
        area,
        &format!("{}: density", group.title()),
        Margins {
            left: 60.0,
            right: 24.0,
        },
        (Axis::linear(-reach, reach), Axis::linear(0.0, 1.08 * top)),
        "error / σ",
        &[],
    )?;
    panel.band(&[(-reach, 0.0), (reach, 0.0)], &steps)?;
    panel.line(&steps, Pen::nth(0, 1.0))?;
    let curve: Vec<(f64, f64)> = (0..=CURVE)
        .map(|k| reach * (2.0 * k as f64 / CURVE as f64 - 1.0))
        .map(|z| (z, normal(z)))
        .collect();
    panel.line(&curve, Pen::solid(INK, 1.5))?;
    let mean_square = values.iter().map(|z| z * z).sum::<f64>() / values.len() as f64;
    let beyond = values.iter().filter(|z| z.abs() > reach).count();
    let mut notes = vec![
        format!("{} values", count(values.len())),
        format!("RMS {}", tables::factor(mean_square.sqrt())),
    ];
    if beyond > 0 {
        notes.push(format!("{} beyond ±{REACH}", count(beyond)));
    }
    for (line, note) in notes.iter().enumerate() {
        let below = (-6.0, 6.0 + 17.0 * line as f64);
        panel.text((reach, 1.08 * top), below, note, (HPos::Right, VPos::Top))?;
    }
    panel.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_histogram_holds_each_value_once_in_its_own_bin() {
        let steps = steps(&[-0.1, 0.1, 0.1, 7.0, -7.0], 5.0);
        let at = |z: f64| steps.iter().rev().find(|step| step.0 <= z).unwrap().1;
        let width = 10.0 / BINS as f64;
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
