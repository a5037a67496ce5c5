//! The figures.

use super::report::Report;
use super::{methods, path};
use crate::calibration::{Epoch, Estimate, Innovation, Nis, Observation, Outcome};
use crate::report::prelude::*;

/// Where the axis of estimates ends, in final σ: with the prior on it the end could not be read.
const EXTENT: f64 = 300.0;
/// Beyond this an innovation is drawn at the edge.
const EDGE: f64 = 6.0;
/// Up to this many innovations are drawn as dots, more as a line through the extremes.
const DOTS: usize = 150;
/// Weaker correlations are not written out: they would only hide the strong ones.
const WRITTEN: f64 = 0.2;

impl Report<'_> {
    /// Every figure that there is something to show in.
    pub(super) fn figures(&self) -> Vec<Plot> {
        let mut plots = Vec::new();
        plots.extend(match (self.truth_vector(), self.methods().as_slice()) {
            (Some(truth), methods @ [_, ..]) => Some(methods::errors(methods, &truth)),
            (None, &[(_, closed), (_, filter)]) => Some(methods::differences(closed, filter)),
            _ => None,
        });
        // Recordings have each their own time.
        let one = |outcome: &&Outcome| outcome.alone.len() < 2;
        if let Some(outcome) = self.outcome.filter(one) {
            plots.extend(self.sigma(outcome));
            plots.extend(self.estimates(outcome));
            plots.extend(self.innovations(outcome));
        }
        if self.outcome.as_ref().is_none_or(one) {
            plots.push(path::figure(self));
        }
        plots.extend(self.estimate().and_then(correlation));
        plots
    }

    fn time(&self) -> Axis {
        let (start, end) = self.time_span();
        Axis::linear("time, s").between(start, end)
    }

    /// σ of each parameter against time, with the largest true error where the truth is known.
    fn sigma(&self, outcome: &Outcome) -> Option<Plot> {
        let (history, form) = (&outcome.history, outcome.estimate.form());
        let truth = self.truth_vector();
        let panel = |group: Group| {
            let indices = group.estimated(&outcome.estimate);
            if indices.is_empty() {
                return Panel::blank(format!("{}: all fixed", group.title()));
            }
            let line = |(n, &i): (usize, &usize)| {
                let points = history
                    .iter()
                    .map(|m| (m.time, m.sigma[i] / group.unit_value()));
                Series::line(points)
                    .nth(n)
                    .label(format!("σ {}", axis_name(form, i)))
            };
            let error = truth.map(|truth| {
                let of = |m: &Epoch| Some(group.spread(&(m.estimate - truth), &indices)?.0);
                let points = history.iter().filter_map(|m| Some((m.time, of(m)?)));
                Series::line(points)
                    .color(Color::Ink)
                    .dashed()
                    .label("error")
            });
            Panel::new(group.titled(), self.time(), Axis::log(""))
                .shaded(self.dwells)
                .with_all(indices.iter().enumerate().map(line))
                .with_all(error)
        };
        let mut caption =
            "1σ of every parameter in the last pass, one panel for each group, logarithmic. Grey: \
                           dwells; white: turns. A line that stays level was not observed."
                .to_owned();
        if truth.is_some() {
            caption += " Dashed: the largest true error in the group; it should end within a few σ of the lines.";
        }
        let plot = Plot::new(
            "sigma.svg",
            "Accuracy against time",
            (3, 330),
            Group::all().map(panel),
        );
        (!history.is_empty()).then(|| plot.caption(caption))
    }

    /// Estimate minus truth, or minus the final estimate, within ±3σ: a small panel for each parameter.
    fn estimates(&self, outcome: &Outcome) -> Option<Plot> {
        let estimate = &outcome.estimate;
        let (reference, minus) = match self.truth_vector() {
            Some(truth) => (truth, "truth"),
            None => (estimate.vector(), "final value"),
        };
        let panel = |group: Group, index: usize| {
            let (unit, indices) = (group.unit_value(), group.estimated(estimate));
            let of = |history: &[Epoch], of: &dyn Fn(&Epoch) -> f64| {
                history
                    .iter()
                    .map(|m| (m.time, of(m) / unit))
                    .collect::<Vec<_>>()
            };
            let error = |m: &Epoch| m.estimate[index] - reference[index];
            let sigma = group
                .spread(&estimate.sigma(), &indices)
                .map_or(1.0, |x| x.1);
            let history = &outcome.history;
            let title = format!("{} {}", group.title(), axis_name(estimate.form(), index));
            let y = Axis::symlog(sigma).between(-EXTENT * sigma, EXTENT * sigma);
            Panel::new(format!("{title}, {}", group.unit()), self.time(), y)
                .shaded(self.dwells)
                .with(Series::band(
                    of(history, &|m| -3.0 * m.sigma[index]),
                    of(history, &|m| 3.0 * m.sigma[index]),
                ))
                .with(Series::zero())
                .with(
                    Series::line(of(history, &error))
                        .color(Color::Ink)
                        .width(1.75),
                )
        };
        let mut panels: Vec<Panel> = Vec::new();
        for group in Group::all() {
            let indices = group.estimated(estimate);
            panels.extend(indices.into_iter().map(|index| panel(group, index)));
            panels.resize(panels.len().next_multiple_of(3), Panel::blank(""));
        }
        let caption = format!(
            "Line: estimate as the instrument is turned, minus {minus}; band: its ±3σ. The vertical axis is linear \
             within the final σ of the group and logarithmic beyond, and ends at {EXTENT} times that σ; what lies \
             beyond is drawn at its edge. The line should stay in its band."
        );
        let drawn = !outcome.history.is_empty() && !panels.is_empty();
        let heading = "Estimates and their ±3σ bands";
        drawn.then(|| Plot::new("estimates.svg", heading, (3, 185), panels).caption(caption))
    }

    /// Whitened innovations with their bounds: velocity above, table attitude below.
    fn innovations(&self, outcome: &Outcome) -> Option<Plot> {
        let consistency = &outcome.consistency;
        let kinds = [
            ("velocity", Observation::Velocity, &consistency.velocity),
            ("table attitude", Observation::Table, &consistency.table),
            ("attitude", Observation::Attitude, &consistency.attitude),
        ];
        let of_kind = |kind| {
            outcome
                .innovations
                .iter()
                .filter(move |i| i.observation == kind)
        };
        let kinds = kinds
            .into_iter()
            .filter(|(_, kind, _)| of_kind(*kind).next().is_some());
        let kinds: Vec<(&str, Observation, &Nis)> = kinds.collect();
        let panel = |name: &str, kind: Observation, direction: usize| {
            let point = |i: &Innovation| (i.time, i.whitened[direction].clamp(-EDGE, EDGE));
            let of = |accepted| {
                of_kind(kind)
                    .filter(move |i| i.accepted == accepted)
                    .map(point)
            };
            let accepted: Vec<_> = of(true).collect();
            let shown = match accepted.len() <= DOTS {
                true => Series::marks(Mark::Dot, accepted),
                false => Series::line(self.interrupted_by_turns(&accepted)),
            };
            let title = format!("{name}, {}, σ", ["east", "north", "up"][direction]);
            Panel::new(
                title,
                self.time(),
                Axis::linear("").between(-EDGE, EDGE).step(2.0),
            )
            .shaded(self.dwells)
            .with(shown.width(1.0))
            .with_all([-3.0, -1.0, 1.0, 3.0].map(bound))
            .with(Series::marks(Mark::Cross, of(false)).nth(1))
        };
        let rows = kinds
            .iter()
            .flat_map(|&(name, kind, _)| [0, 1, 2].map(|d| panel(name, kind, d)));
        let caption = format!(
            "Innovations of the last pass in units of their own σ; they should look like white noise of unit \
             variance. Solid lines: ±1σ; dashed: ±3σ. Where they are many the line runs through the extremes of \
             each stretch. Crosses: rejected by the gate; at the edge: ±{EDGE}σ or more. {}",
            kinds
                .iter()
                .map(|(name, _, nis)| sentence(name, nis))
                .collect::<Vec<_>>()
                .join(" ")
        );
        let plot = Plot::new("innovations.svg", "Innovations", (3, 270), rows);
        (!kinds.is_empty()).then(|| plot.caption(caption))
    }

    /// A line across a turn would show what was not observed.
    fn interrupted_by_turns(&self, points: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let dwell = |t: f64| self.dwells.partition_point(|dwell| dwell.end < t);
        let pieces = points.chunk_by(|a, b| dwell(a.0) == dwell(b.0));
        let pieces = pieces.flat_map(|piece| piece.iter().copied().chain([(f64::NAN, f64::NAN)]));
        pieces.collect()
    }
}

/// A level of so many σ, dashed beyond one.
fn bound(y: f64) -> Series {
    let sign = if y < 0.0 { '−' } else { '+' };
    let series = Series::level(y).label(format!("{sign}{}σ", y.abs()));
    if y.abs() > 1.0 {
        series.dashed()
    } else {
        series.color(Color::Quiet).width(1.0)
    }
}

fn sentence(name: &str, nis: &Nis) -> String {
    let [mean, low, high] = [nis.mean, nis.interval.0, nis.interval.1].map(|x| value(x, 0.01));
    let scalars = count(nis.count);
    format!("NIS of {name} {mean} (95 % interval {low}–{high}, {scalars} scalars).")
}

/// Correlations of the estimated parameters; none if nothing was estimated.
fn correlation(estimate: &Estimate) -> Option<Plot> {
    let indices: Vec<usize> = estimate.estimated().collect();
    let sigma = estimate.sigma();
    let row = |&i: &usize| {
        let of = |&j: &usize| estimate.covariance[(i, j)] / (sigma[i] * sigma[j]);
        indices.iter().map(of).collect()
    };
    let new_group = |&n: &usize| Group::of(indices[n - 1]) != Group::of(indices[n]);
    let matrix = Matrix {
        names: indices
            .iter()
            .map(|&i| short_name(estimate.form(), i))
            .collect(),
        groups: (1..indices.len()).filter(new_group).collect(),
        values: indices.iter().map(row).collect(),
        written: WRITTEN,
    };
    (!indices.is_empty()).then(|| {
        Plot::matrix("correlation.svg", "Correlations", matrix).caption(format!(
            "Correlation of the estimated parameters. Below the diagonal the side of a square grows with the \
             magnitude; filled squares are positive, open ones negative. Above it stands the coefficient in \
             hundredths where its magnitude is at least {WRITTEN}. Strongly correlated parameters were observed \
             by this path as a sum or difference rather than each alone."
        ))
    })
}
