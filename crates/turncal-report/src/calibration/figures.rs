//! The figures.

use nalgebra::Matrix3;

use crate::calibration::report::Report;
use crate::prelude::*;
use turncal::attitude::matrix;
use turncal::calibration::{Epoch, Estimate, Innovation, Observation, Outcome, ParameterVector};
use turncal::imu::{AXES, Sensor};
use turncal::recording::{ImuSamples, TableLog};

/// End of the axis of estimates, in final σ; with the prior included, the final values would be unreadable.
const EXTENT: f64 = 300.0;
/// Beyond this an innovation is drawn at the edge.
const EDGE: f64 = 6.0;
/// Up to this many innovations are drawn as dots, more as a line through the extremes.
const DOTS: usize = 150;
/// Weaker correlations are not printed, because they would hide the strong ones.
const WRITTEN: f64 = 0.2;
/// Half the side of a square that is too small to be seen.
const FAINT: f64 = 0.02;

impl Report<'_> {
    /// All figures with data.
    pub fn figures(&self) -> Vec<Plot> {
        let mut plots = Vec::new();
        plots.extend(match (self.truth_vector(), self.methods().as_slice()) {
            (Some(truth), methods @ [_, ..]) => Some(errors(methods, &truth)),
            _ => None,
        });
        if let Some(outcome) = self.against_time() {
            plots.extend(self.estimates(outcome));
            plots.extend(self.innovations(outcome));
        }
        if self.outcome.is_none() || self.against_time().is_some() {
            plots.push(path(self));
        }
        plots.extend(self.estimate().and_then(correlation));
        plots
    }

    /// The filter result if it has a single time axis, which several recordings do not.
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
            if indices.is_empty() {
                return Panel::blank(format!("{}: all fixed", group.title()));
            }
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
            Panel::new(group.titled(), self.time(), Axis::log(""))
                .shaded(self.dwells)
                .with_all(indices.iter().enumerate().map(line))
                .with_all(error)
        };
        let mut caption =
            "1σ of every parameter during the last pass, one panel per group, logarithmic. Grey: dwells; white: \
             turns. A flat line means the parameter was not observed."
                .to_owned();
        if truth.is_some() {
            caption += " Dashed: the largest true error in the group; it should end within a few σ of the lines.";
        }
        let (heading, panels) = ("Accuracy against time", Group::all().map(panel));
        let plot = Plot::new("sigma.svg", heading, (3, 330), panels);
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
            let unit = group.unit_value();
            let of = |of: &dyn Fn(&Epoch) -> f64| -> Vec<Point> {
                let history = outcome.history.iter();
                history.map(|m| (m.time, of(m) / unit)).collect()
            };
            let error = |m: &Epoch| m.estimate[index] - reference[index];
            let [low, high] = [-3.0, 3.0].map(|factor| of(&|m| factor * m.sigma[index]));
            let sigma = group.rms(&estimate.sigma(), estimate).unwrap_or(1.0);
            let title = format!("{} {}", group.title(), axis_name(estimate.form(), index));
            let y = Axis::symlog(sigma).between(-EXTENT * sigma, EXTENT * sigma);
            Panel::new(format!("{title}, {}", group.unit()), self.time(), y)
                .shaded(self.dwells)
                .with(Series::band(low, high))
                .with(Series::zero())
                .with(Series::line(of(&error)).color(Color::Ink).width(1.75))
        };
        let mut panels: Vec<Panel> = Vec::new();
        for group in Group::all() {
            let indices = group.estimated(estimate);
            panels.extend(indices.into_iter().map(|index| panel(group, index)));
            panels.resize(panels.len().next_multiple_of(3), Panel::blank(""));
        }
        let caption = format!(
            "Line: estimate over time, minus {minus}; band: its ±3σ. The vertical axis is linear within the final σ \
             of the group, logarithmic beyond, and ends at {EXTENT} times that σ; larger values are drawn at the \
             edge. The line should stay in its band."
        );
        let drawn = !outcome.history.is_empty() && !panels.is_empty();
        let heading = "Estimates and their ±3σ bands";
        drawn.then(|| Plot::new("estimates.svg", heading, (3, 185), panels).caption(caption))
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
            let of = |accepted| {
                let those = of_kind(kind).filter(move |i| i.accepted == accepted);
                those.map(point)
            };
            let accepted: Vec<_> = of(true).collect();
            let shown = match accepted.len() <= DOTS {
                true => Series::marks(Mark::Dot, accepted),
                false => Series::line(self.interrupted_by_turns(&accepted)),
            };
            let title = format!("{}, {}, σ", kind.name(), ["east", "north", "up"][direction]);
            let y = Axis::linear("").between(-EDGE, EDGE).step(2.0);
            Panel::new(title, self.time(), y)
                .shaded(self.dwells)
                .with(shown.width(1.0))
                .with_all([-3.0, -1.0, 1.0, 3.0].map(bound))
                .with(Series::marks(Mark::Cross, of(false)).nth(1))
        };
        let panels = kinds.flat_map(|kind| [0, 1, 2].map(|direction| panel(kind, direction)));
        let panels: Vec<Panel> = panels.collect();
        let caption = format!(
            "Innovations of the last pass divided by their σ; they should look like white noise of unit variance. \
             Solid lines: ±1σ; dashed: ±3σ. Dense data are drawn as the extremes of each interval. \
             Crosses: rejected by the gate; at the edge: ±{EDGE}σ or more."
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
            // The first row is the uppermost.
            let (x, y) = (column as f64, (indices.len() - 1 - row) as f64);
            let half = 0.45 * r.abs().min(1.0);
            if row > column && half > FAINT {
                let square = Series::bars(half, Fill::Solid, [(x, y - half, y + half)]);
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
    let plot = Plot::new("correlation.svg", "Correlations", (1, 1000), [panel]).caption(format!(
        "Correlation of the estimated parameters. Below the diagonal the side of a square grows with the magnitude; \
         blue squares are positive, orange ones negative. Above the diagonal, the coefficient is given in hundredths \
         if its magnitude is at least {WRITTEN}. Strongly correlated parameters were observed by this path as a sum or \
         difference rather than each alone."
    ));
    (!indices.is_empty()).then_some(plot)
}

/// Magnitude of the error of each parameter for each method, with its stated σ.
fn errors(methods: &[(&str, &Estimate)], truth: &ParameterVector) -> Plot {
    let form = methods[0].1.form();
    let panel = |group: Group| {
        let mut indices = group.parameters(form);
        indices.retain(|&i| methods.iter().any(|(_, m)| m.covariance[(i, i)] > 0.0));
        if indices.is_empty() {
            return Panel::blank(format!("{}: all fixed", group.title()));
        }
        let series = methods.iter().enumerate().map(|(n, (name, estimate))| {
            let unit = group.unit_value();
            let (error, sigma) = (estimate.vector() - truth, estimate.sigma() / unit);
            let offset = beside(n, methods.len(), 0.52);
            let points = indices.iter().enumerate().map(|(k, &i)| {
                let at = (k as f64 + offset, error[i].abs() / unit);
                (at, (0.0, sigma[i]))
            });
            let (mark, color) = method_mark(name);
            let marks = Series::whiskers(mark, points).color(color);
            marks.width(2.0).key(*name)
        });
        let x = Axis::places(indices.iter().map(|&i| axis_name(form, i)));
        Panel::new(group.titled(), x, Axis::log("")).with_all(series)
    };
    let mut caption = "Magnitude of the true error of each parameter, logarithmic. The whisker ends at the stated \
        1σ; about two marks in three should be below its top."
        .to_owned();
    if methods.len() == 2 {
        caption += " Open rings: closed form; filled dots: EKF.";
    }
    let heading = "Errors against the truth";
    Plot::new("comparison.svg", heading, (3, 300), Group::all().map(panel)).caption(caption)
}

/// Mark and colour of a method, the same in every figure.
fn method_mark(name: &str) -> (Mark, Color) {
    match name {
        "EKF" => (Mark::Dot, Color::Nth(0)),
        _ => (Mark::Ring, Color::Nth(1)),
    }
}

/// Closer to the vertical than this, the azimuth of an axis is not drawn.
const STEEP: f64 = 80.0 * DEGREE;
/// Azimuth up to which a curve may exceed ±180° before it wraps, °.
const PAST: f64 = 190.0;

/// Elevation and azimuth of the body axes from the table, and body rates from the gyros.
fn path(report: &Report) -> Plot {
    let (start, end) = report.time_span();
    let numbers = || {
        let dwells = report.dwells.iter().enumerate();
        dwells.map(|(n, dwell)| (0.5 * (dwell.start + dwell.end), (n + 1).to_string()))
    };
    let panel = |title: &str, y: Axis, line: &dyn Fn(usize) -> Series| {
        let lines = [0, 1, 2].map(|axis| line(axis).axis(axis).label(AXES[axis]));
        Panel::new(title, Axis::linear("time, s").between(start, end), y)
            .shaded(report.dwells)
            .tagged(1, numbers())
            .with_all(lines)
    };
    let table = report.table().filter(|table| !table.time.is_empty());
    let mut panels = Vec::new();
    let mut caption = String::new();
    if let Some(table) = table {
        let y = Axis::linear("").between(-95.0, 130.0).step(45.0);
        panels.push(panel("elevation of the body axes, °", y, &|axis| {
            elevation(table, axis)
        }));
        let y = Axis::linear("").between(-200.0, 260.0).step(90.0);
        panels.push(panel("azimuth of the body axes, °", y, &|axis| {
            azimuth(table, axis)
        }));
        caption += "Elevation of each body axis above the horizon and azimuth clockwise from North, from the \
            turntable readings. Unlike heading, pitch and roll these have no singularity; azimuth is not drawn \
            within 10° of the vertical. ";
    }
    caption +=
        "Rates: raw gyro output about the body axes. Grey: dwells, numbered where space permits.";
    let y = Axis::linear("").including([0.0]).room(0.05, 0.16);
    panels.push(panel("rate about the body axes, °/s", y, &|axis| {
        samples(&report.run.recording.imu, Sensor::Gyro, axis, DEGREE)
    }));
    Plot::new("path.svg", "Path", (1, 240), panels).caption(caption)
}

/// Elevation of a body axis above the horizon in degrees.
fn elevation(table: &TableLog, axis: usize) -> Series {
    let line = table.time.iter().zip(&table.attitude);
    Series::line(line.map(|(&t, attitude)| (t, axis_elevation(&matrix(attitude), axis) / DEGREE)))
}

/// Azimuth of a body axis clockwise from North in degrees, interrupted at jumps and near the vertical.
fn azimuth(table: &TableLog, axis: usize) -> Series {
    let gap = (f64::NAN, f64::NAN);
    let (mut last, mut line) = (f64::NAN, Vec::new());
    for (&t, attitude) in table.time.iter().zip(&table.attitude) {
        let c = matrix(attitude);
        if axis_elevation(&c, axis).abs() > STEEP {
            last = f64::NAN;
            line.push(gap);
            continue;
        }
        let angle = c[(0, axis)].atan2(c[(1, axis)]) / DEGREE;
        let near = [angle, angle - 360.0, angle + 360.0];
        let near = near.into_iter().filter(|a| a.abs() <= PAST);
        let next = near.min_by(|a, b| (a - last).abs().total_cmp(&(b - last).abs()));
        let next = next.filter(|_| last.is_finite()).unwrap_or(angle);
        if (next - last).abs() > 180.0 {
            line.push(gap);
        }
        line.push((t, next));
        last = next;
    }
    Series::line(line)
}

fn axis_elevation(c: &Matrix3<f64>, axis: usize) -> f64 {
    c[(2, axis)].clamp(-1.0, 1.0).asin()
}

/// Mean of each sample of a triad along a body axis, in a unit per second.
pub fn samples(imu: &ImuSamples, sensor: Sensor, axis: usize, unit: f64) -> Series {
    let of = match sensor {
        Sensor::Gyro => &imu.gyro,
        Sensor::Accel => &imu.accel,
    };
    let middle = |k: usize| imu.time(k) + 0.5 * imu.period;
    let points = (0..of.len()).zip(of.iter());
    Series::line(points.map(|(k, sample)| (middle(k), sample[axis] / imu.period / unit)))
}
