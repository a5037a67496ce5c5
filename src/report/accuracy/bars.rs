//! Ratios of each group and of navigation with their intervals: error over bound, and the gain over the closed form.

use plotters::style::text_anchor::{HPos, VPos};

use super::super::axis::Axis;
use super::super::canvas::{Area, DrawError, INK, Pen};
use super::super::number;
use super::super::panel::{Margins, Mark, Panel};
use super::super::{Figure, ReportError};
use super::merit::merits;
use crate::study::{Accuracy, Figures, Ratio};

const MARGINS: Margins = Margins {
    left: 56.0,
    right: 24.0,
};
/// A ratio beyond this or below its inverse makes the axis logarithmic.
const FAR: f64 = 2.0;
/// The narrowest axis about one.
const NEAR: f64 = 0.04;
/// Half the width of a bar, in places of the axis.
const HALF: f64 = 0.13;

/// RMS error over bound.
pub(super) fn ratio(accuracy: &Accuracy) -> Result<Figure, ReportError> {
    let ratios = of(accuracy, |f| f.ratio);
    let ends = || {
        ratios
            .iter()
            .flat_map(|(_, r)| [r.interval.0, r.interval.1])
    };
    let far = ends().any(|end| !(1.0 / FAR..=FAR).contains(&end));
    let (y, kind) = if far {
        (log_axis(ends()), ", logarithmic")
    } else {
        let half = ends().map(|end| (end - 1.0).abs()).fold(NEAR, f64::max);
        (Axis::linear(1.0 - 1.25 * half, 1.0 + 1.25 * half), "")
    };
    let caption = "RMS error of the EKF over the Cramér–Rao bound, of each group of parameters and of the \
                   position after 40 h; bars: its 99 % interval. A bar that crosses the line at 1 says that nothing shows the filter to be worse than \
                   the best there can be."
        .to_owned();
    let title = "Error over bound";
    Figure::draw("ratio.svg", title, caption, (1200, 400), |area| {
        let mut panel = by_merit(area, accuracy, &format!("RMS error / RMS bound{kind}"), y)?;
        for (place, ratio) in &ratios {
            whisker(&mut panel, *place, ratio)?;
            panel.marks(&[(*place, ratio.value)], Mark::Dot, Pen::nth(0, 3.0))?;
            value_above(&panel, *place, ratio)?;
        }
        panel.finish()
    })
}

/// Error of the closed form over that of the filter.
pub(super) fn gain(accuracy: &Accuracy) -> Result<Figure, ReportError> {
    let (own, equal) = (
        of(accuracy, |f| f.gain),
        of(accuracy, |f| f.gain_in_equal_time),
    );
    let ends = own.iter().chain(&equal).map(|(_, ratio)| ratio);
    let y = log_axis(ends.flat_map(|r| [r.interval.0, r.interval.1]));
    let mut caption = format!(
        "RMS error of the closed form over that of the EKF in {}, logarithmic, with 99 % intervals. \
         Above the line at 1 the EKF is better, below the closed form. Left, shaded: closed form in its \
         own {}.",
        number::minutes(accuracy.table_time),
        number::minutes(accuracy.baseline.table_time)
    );
    caption.push_str(&match accuracy.baseline.equal_time() {
        Some(time) => format!(" Right, open: closed form in {}.", number::minutes(time)),
        None => " Its positions cannot be had in the time of the EKF.".to_owned(),
    });
    let title = "Gain over the closed form";
    Figure::draw("gain.svg", title, caption, (1200, 460), |area| {
        let mut panel = by_merit(
            area,
            accuracy,
            "RMS error of closed form / RMS error of EKF",
            y,
        )?;
        for (ratios, offset, shaded) in [(&own, -0.17, true), (&equal, 0.17, false)] {
            for (place, ratio) in ratios {
                bar(&mut panel, *place + offset, ratio, shaded)?;
            }
        }
        panel.finish()
    })
}

/// Ratios with their place on the axis.
fn of(accuracy: &Accuracy, ratio: impl Fn(&Figures) -> Option<Ratio>) -> Vec<(f64, Ratio)> {
    merits(accuracy)
        .iter()
        .enumerate()
        .filter_map(|(place, merit)| Some((place as f64, ratio(merit.figures)?)))
        .filter(|(_, ratio)| ratio.value.is_finite())
        .collect()
}

/// Room for a text above and below all ends.
fn log_axis(ends: impl Iterator<Item = f64>) -> Axis {
    Axis::log(ends.flat_map(|end| [0.6 * end, 1.8 * end]).chain([1.0]))
}

/// A panel with a place for each merit and a line at 1.
fn by_merit<'a, 'b>(
    area: &'a Area<'b>,
    accuracy: &Accuracy,
    title: &str,
    y: Axis,
) -> Result<Panel<'a, 'b>, DrawError> {
    let places: Vec<String> = merits(accuracy).into_iter().map(|m| m.title).collect();
    let last = places.len() as f64 - 0.5;
    let x = Axis::places(places);
    let mut panel = Panel::new(area, title, MARGINS, (x, y), "", &[])?;
    panel.line(&[(-0.5, 1.0), (last, 1.0)], Pen::solid(INK, 1.5))?;
    Ok(panel)
}

fn whisker(panel: &mut Panel, x: f64, ratio: &Ratio) -> Result<(), DrawError> {
    let (low, high) = ratio.interval;
    let pen = Pen::solid(INK, 1.25);
    panel.line(&[(x, low), (x, high)], pen)?;
    for end in [low, high] {
        panel.line(&[(x - 0.03, end), (x + 0.03, end)], pen)?;
    }
    Ok(())
}

/// A bar from the line at 1 with its value beyond its interval.
fn bar(panel: &mut Panel, x: f64, ratio: &Ratio, shaded: bool) -> Result<(), DrawError> {
    let (left, right) = (x - HALF, x + HALF);
    let (foot, head) = (
        [(left, 1.0), (right, 1.0)],
        [(left, ratio.value), (right, ratio.value)],
    );
    if shaded {
        panel.band(&foot, &head)?;
    }
    panel.line(&[foot[0], head[0], head[1], foot[1]], Pen::nth(0, 1.25))?;
    whisker(panel, x, ratio)?;
    if ratio.value >= 1.0 {
        return value_above(panel, x, ratio);
    }
    let below = (HPos::Center, VPos::Top);
    panel.text(
        (x, ratio.interval.0),
        (0.0, 5.0),
        &number::ratio(ratio)[0],
        below,
    )
}

/// The value above its interval.
fn value_above(panel: &Panel, x: f64, ratio: &Ratio) -> Result<(), DrawError> {
    let above = (HPos::Center, VPos::Bottom);
    panel.text(
        (x, ratio.interval.1),
        (0.0, -5.0),
        &number::ratio(ratio)[0],
        above,
    )
}
