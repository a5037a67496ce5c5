//! The figures.

use crate::calibration::report::Report;
use crate::prelude::*;
use turncal::calibration::{Epoch, Estimate, Innovation, Observation, Outcome};
use turncal::imu::{AXES, Sensor};
use turncal::recording::ImuSamples;

/// Innovations beyond this limit are drawn at the edge.
const EDGE: f64 = 6.0;
/// Maximum number of innovations drawn as dots; more are drawn as a line through the extremes.
const DOTS: usize = 150;
/// Weaker correlations are not printed, because they would hide the strong ones.
const WRITTEN: f64 = 0.2;
/// Half the side of a square that is too small to be seen.
const FAINT: f64 = 0.02;

impl Report<'_> {
    /// All figures for which there are data.
    pub fn figures(&self) -> Vec<Plot> {
        let mut plots = Vec::new();
        if let Some(outcome) = self.against_time() {
            plots.extend(self.innovations(outcome));
        }
        if self.outcome.is_none() || self.against_time().is_some() {
            plots.push(path(self));
        }
        plots.extend(self.estimate().and_then(correlation));
        plots
    }

    /// The filter result, if it has a single time axis; the result of several recordings has no single time axis.
    pub fn against_time(&self) -> Option<&Outcome> {
        self.outcome.filter(|outcome| outcome.alone.len() < 2)
    }

    fn time(&self) -> Axis {
        let (start, end) = self.time_span();
        Axis::linear("time, s").between(start, end)
    }

    /// σ of each parameter against time, with the largest true error if the truth is known.
    pub fn sigma(&self, outcome: &Outcome) -> Option<Plot> {
        let (history, form) = (&outcome.history, outcome.estimate.form());
        let truth = self.truth_vector();
        let panel = |group: Group| {
            let indices = group.estimated(&outcome.estimate);
            let line = |(n, &i): (usize, &usize)| {
                let points = history.iter();
                let points = points.map(|m| (m.time, m.sigma[i] / group.unit_value()));
                let name = format!("σ {}", axis_name(form, i));
                Series::line(points).nth(n).label(name)
            };
            let error = truth.map(|truth| {
                let of = |m: &Epoch| Some(group.spread(&(m.estimate - truth), &indices)?.0);
                let points = history.iter().filter_map(|m| Some((m.time, of(m)?)));
                let line = Series::line(points).color(Color::Ink);
                line.dashed().label("error")
            });
            let panel = Panel::new(group.titled(), self.time(), Axis::log(""))
                .shaded(self.dwells)
                .with_all(indices.iter().enumerate().map(line))
                .with_all(error);
            (!indices.is_empty()).then_some(panel)
        };
        let mut caption =
            "1σ of every parameter during the last pass, with one panel per group, on a logarithmic \
             scale. Grey: dwells; white: \
             turns. A flat line means that the parameter was not observed."
                .to_owned();
        if truth.is_some() {
            caption += " Dashed: largest true error in the group; at the end, this error should be within a few σ of \
            the lines.";
        }
        let (heading, panels) = ("Accuracy against time", Group::all().filter_map(panel));
        let plot = Plot::new("sigma.svg", heading, (3, 330), panels);
        (!history.is_empty()).then(|| plot.caption(caption))
    }

    /// Whitened innovations with their bounds: velocity above, table attitude below.
    fn innovations(&self, outcome: &Outcome) -> Option<Plot> {
        let of_kind = |kind| {
            let all = outcome.innovations.iter();
            all.filter(move |i| i.observation == kind)
        };
        let kinds = [
            Observation::Velocity,
            Observation::Table,
            Observation::Attitude,
        ];
        let kinds = kinds
            .into_iter()
            .filter(|kind| of_kind(*kind).next().is_some());
        let panel = |kind: Observation, direction: usize| {
            let point = |i: &Innovation| (i.time, i.whitened[direction].clamp(-EDGE, EDGE));
            let points: Vec<Point> = of_kind(kind).map(point).collect();
            let shown = if points.len() <= DOTS {
                Series::marks(Mark::Dot, points)
            } else {
                Series::line(self.interrupted_by_turns(&points))
            };
            let title = format!("{}, {}, σ", kind.name(), ["east", "north", "up"][direction]);
            let y = Axis::linear("").between(-EDGE, EDGE);
            Panel::new(title, self.time(), y)
                .shaded(self.dwells)
                .with(shown.width(1.0))
                .with_all([-3.0, -1.0, 1.0, 3.0].map(bound))
        };
        let panels = kinds.flat_map(|kind| [0, 1, 2].map(|direction| panel(kind, direction)));
        let panels: Vec<Panel> = panels.collect();
        let caption = format!(
            "Innovations of the last pass divided by their σ; they should look like white noise of unit variance. \
             Solid lines: ±1σ; dashed: ±3σ. Where data points are dense, only the extremes of each interval are \
             drawn. Points \
             at the edge: ±{EDGE}σ or more."
        );
        let drawn = !panels.is_empty();
        let plot = Plot::new("innovations.svg", "Innovations", (3, 270), panels);
        drawn.then(|| plot.caption(caption))
    }

    /// A line across a turn would suggest observations that do not exist.
    fn interrupted_by_turns(&self, points: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let dwell = |t: f64| self.dwells.partition_point(|dwell| dwell.end < t);
        let pieces = points.chunk_by(|a, b| dwell(a.0) == dwell(b.0));
        let pieces = pieces.flat_map(|piece| piece.iter().copied().chain([(f64::NAN, f64::NAN)]));
        pieces.collect()
    }
}

/// A horizontal line at a given number of σ, dashed beyond 1σ.
fn bound(y: f64) -> Series {
    let sign = if y < 0.0 { '−' } else { '+' };
    let series = Series::level(y).label(format!("{sign}{}σ", y.abs()));
    if y.abs() > 1.0 {
        series.dashed()
    } else {
        series.color(Color::Quiet).width(1.0)
    }
}

/// Correlations of the estimated parameters; `None` if nothing was estimated.
fn correlation(estimate: &Estimate) -> Option<Plot> {
    let (indices, sigma) = (Vec::from_iter(estimate.estimated()), estimate.sigma());
    let names = || indices.iter().map(|&i| short_name(estimate.form(), i));
    let mut series = Vec::new();
    for (row, &i) in indices.iter().enumerate() {
        for (column, &j) in indices.iter().enumerate() {
            let r = estimate.covariance[(i, j)] / (sigma[i] * sigma[j]);
            // The first row is at the top.
            let (x, y) = (column as f64, (indices.len() - 1 - row) as f64);
            let half = 0.45 * r.abs().min(1.0);
            if row > column && half > FAINT {
                let square = Series::bars(half, [(x, y - half, y + half)]);
                series.push(square.nth(usize::from(r < 0.0)));
            } else if row < column && r.abs() >= WRITTEN {
                series.push(Series::words(
                    (x, y),
                    Anchor::Middle,
                    value(100.0 * r, 10.0),
                ));
            }
        }
    }
    let y = Axis::places(names().rev());
    let mut panel = Panel::new("", Axis::places(names()), y).with_all(series);
    panel.square = true;
    let plot = Plot::new("correlation.svg", "Correlations", (1, 860), [panel]).caption(format!(
        "Correlation of the estimated parameters. Below the diagonal, the side of each square grows with the \
         magnitude of the correlation; blue squares are positive, orange squares negative. If the figure is wide \
         enough, the coefficients with a magnitude of at least {WRITTEN} are given in hundredths above the \
         diagonal. If two parameters are strongly correlated, this path determines only their sum or difference."
    ));
    (!indices.is_empty()).then_some(plot)
}

/// Rates about the body axes.
fn path(report: &Report) -> Plot {
    let numbers = report.dwells.iter().enumerate();
    let numbers = numbers.map(|(n, dwell)| (0.5 * (dwell.start + dwell.end), (n + 1).to_string()));
    let imu = &report.run.recording.imu;
    let y = Axis::linear("").including([0.0]).room(0.05, 0.16);
    let panel = Panel::new("rate about the body axes, °/s", report.time(), y)
        .shaded(report.dwells)
        .tagged(numbers)
        .with_all(samples(imu, Sensor::Gyro, DEGREE));
    Plot::new("path.svg", "Path", (1, 310), [panel])
        .caption("Raw gyro output about the body axes. Grey: dwells, numbered where space permits.")
}

/// Mean over each sample of a triad along each body axis, in this unit per second.
pub fn samples(imu: &ImuSamples, sensor: Sensor, unit: f64) -> [Series; 3] {
    let of = match sensor {
        Sensor::Gyro => &imu.gyro,
        Sensor::Accel => &imu.accel,
    };
    let middle = |k: usize| imu.time(k) + 0.5 * imu.period;
    [0, 1, 2].map(|axis| {
        let points = (0..of.len()).zip(of.iter());
        let points = points.map(|(k, sample)| (middle(k), sample[axis] / imu.period / unit));
        Series::line(points).nth(axis).width(1.0).label(AXES[axis])
    })
}
