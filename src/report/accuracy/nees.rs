//! NEES/n of every run with the intervals of one run and of the average.

use super::super::axis::Axis;
use super::super::canvas::{INK, Pen, QUIET};
use super::super::number::{count, interval, value};
use super::super::panel::{Margins, Mark, Panel};
use super::super::{Figure, ReportError};
use super::tables;
use crate::study::Accuracy;

/// Runs this many times above the upper end of the interval make the axis logarithmic.
const FAR: f64 = 4.0;

pub(super) fn figure(accuracy: &Accuracy) -> Result<Figure, ReportError> {
    let points = |converged: bool| -> Vec<(f64, f64)> {
        let trials = accuracy.trials.iter();
        trials
            .filter(|trial| trial.failure.is_none() == converged)
            .filter_map(|t| Some((t.run as f64, t.filtered.as_ref()?.nees?.mean)))
            .collect()
    };
    let (converged, failed) = (points(true), points(false));
    let one = accuracy.anees.map_or((1.0, 1.0), |a| a.interval_of_one);
    let all = || converged.iter().chain(&failed);
    let outside = all().filter(|p| !(one.0..=one.1).contains(&p.1)).count();
    let mut caption = format!(
        "Squared error over the claimed covariance, correlations included, one dot for each run; 1 on \
         average if the σ are true. Shaded: 95 % interval of one run; {} of {} runs lie outside.",
        count(outside),
        count(all().count())
    );
    if let Some(anees) = accuracy.anees {
        caption.push_str(&format!(
            " Line: the average over all runs, {}; dashed: its 95 % interval {}.",
            tables::mean(anees.mean, anees.interval_95),
            interval(anees.interval_95)
        ));
    }
    if !failed.is_empty() {
        caption.push_str(" Crosses: runs that did not converge.");
    }
    let most = all().map(|point| point.1).fold(one.1, f64::max);
    let far = most > FAR * one.1;
    let (y, kind) = if far {
        (
            Axis::log(all().map(|point| point.1).chain([one.0, one.1])),
            ", logarithmic",
        )
    } else {
        (Axis::linear(0.0, 1.08 * most), "")
    };
    let n = accuracy.anees.map_or(0, |anees| anees.directions);
    Figure::draw(
        "nees.svg",
        "NEES of every run",
        caption,
        (1200, 420),
        |area| {
            let (first, last) = (-0.5, accuracy.trials.len() as f64 - 0.5);
            let mut panel = Panel::new(
                area,
                &format!("NEES/n of each run, n = {n}{kind}"),
                Margins {
                    left: 52.0,
                    right: 132.0,
                },
                (Axis::linear(first, last), y),
                "run",
                &[],
            )?;
            let level = |y: f64| [(first, y), (last, y)];
            if let Some(anees) = accuracy.anees {
                panel.band(&level(one.0), &level(one.1))?;
                for (end, text) in [(one.0, "2.5 %"), (one.1, "97.5 %")] {
                    panel.label(end, format!("{text}: {}", value(end, 0.1)), QUIET);
                }
                let (low, high) = anees.interval_95;
                for end in [low, high] {
                    panel.line(&level(end), Pen::dashed(INK, 1.0))?;
                }
                panel.line(&level(anees.mean), Pen::solid(INK, 1.5))?;
                panel.label(
                    anees.mean,
                    format!("average {}", tables::mean(anees.mean, anees.interval_95)),
                    INK,
                );
            }
            panel.marks(&converged, Mark::Dot, Pen::nth(0, 1.75))?;
            panel.marks(&failed, Mark::Cross, Pen::nth(1, 1.75))?;
            panel.finish()
        },
    )
}
