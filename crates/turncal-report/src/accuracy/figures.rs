//! Ratios of RMS errors with their intervals: error divided by bound, and closed form divided by filter.

use crate::accuracy::tables::compared;
use crate::prelude::*;
use turncal::study::{Accuracy, Figures, Ratio};

/// Minimum span of the axis, as a factor.
const NARROWEST: f64 = 1.08;
/// Margin at both ends of the axis, as a fraction of its length.
const FREE: f64 = 0.2;

/// A ratio for a quantity, if the study has it.
type OfFigures = fn(&Figures) -> Option<Ratio>;

/// The error divided by the bound, and the error of the closed form divided by that of the filter.
pub fn figures(accuracy: &Accuracy) -> [Plot; 2] {
    let bound = [(String::new(), (|f| f.ratio) as OfFigures)];
    let bound = ratios(accuracy, "RMS error / RMS bound", &bound);
    let filter = minutes(accuracy.table_time);
    let closed_form = |time: f64| format!("closed form {}", minutes(time));
    let baseline = &accuracy.baseline;
    let mut gains = vec![(closed_form(baseline.table_time), (|f| f.gain) as OfFigures)];
    gains.extend(
        baseline
            .equal_time()
            .map(|time| (closed_form(time), (|f| f.gain_in_equal_time) as OfFigures)),
    );
    let gain = ratios(
        accuracy,
        "RMS error of the closed form / RMS error of the EKF",
        &gains,
    );
    [
        Plot::new("ratio.svg", "Error over bound", (1, 400), [bound]).caption(
            "RMS error of the EKF divided by the Cramér–Rao bound, for each parameter group and for the position \
             after 40 h; the bars show 99 % intervals. If a bar crosses the line at 1, the group is consistent with \
             an optimal filter.",
        ),
        Plot::new("gain.svg", "Gain over the closed form", (1, 460), [gain]).caption(format!(
            "RMS error of the closed form divided by the RMS error of the EKF in {filter}, with 99 % intervals. Above \
             the line at 1, the EKF is better; below the line, the closed form is better.",
        )),
    ]
}

/// Ratios by name, each with its interval and its value, printed at the end of the interval that is farther from the
/// line at 1.
fn ratios(accuracy: &Accuracy, title: &str, all: &[(String, OfFigures)]) -> Panel {
    let compared = compared(accuracy);
    let (mut low, mut high) = (1.0, 1.0);
    let mut series = vec![Series::level(1.0).width(1.5)];
    for (n, (name, of)) in all.iter().enumerate() {
        let mut marks = Vec::new();
        for (place, compared) in compared.iter().enumerate() {
            let ratio = of(compared.figures).filter(|ratio| ratio.value.is_finite());
            let Some(Ratio { value, interval }) = ratio else {
                continue;
            };
            let x = place as f64 + beside(n, all.len(), 0.68);
            let [text, _] = with_interval(value, interval);
            marks.push(((x, value), interval));
            series.push(if value >= 1.0 {
                Series::words((x, interval.1), Anchor::Above, text)
            } else {
                Series::words((x, interval.0), Anchor::Below, text)
            });
            (low, high) = (f64::min(low, interval.0), f64::max(high, interval.1));
        }
        let mut marks = Series::whiskers(Mark::Dot, marks).nth(n).width(3.0);
        marks.key = Some(name.clone()).filter(|name| !name.is_empty());
        series.push(marks);
    }
    let free = (high / low).max(NARROWEST).powf(FREE);
    let y = Axis::log("").between(low / free, high * free);
    let names = compared.into_iter().map(|of| of.title);
    Panel::new(format!("{title}, logarithmic"), Axis::places(names), y).with_all(series)
}
