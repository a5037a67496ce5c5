//! Allan deviation against cluster time, one panel per axis.

use super::quantity::{deviation_unit, quantity};
use crate::prelude::*;
use turncal::imu::{AXES, Noise, Sensor};
use turncal::noise::{AxisNoise, Found, NoiseAnalysis, Process};

/// A process is drawn where it contributes at least this fraction of the variance.
const SEEN: f64 = 0.02;
/// Points per decade of a drawn line.
const POINTS: f64 = 24.0;

pub fn figure(analysis: &NoiseAnalysis, sensor: Sensor) -> Plot {
    let file = format!("{}.svg", sensor.name());
    let heading = format!("{}: Allan deviation", capital(triad_name(sensor)));
    let triad = analysis.triads.get(sensor);
    let unit = deviation_unit(sensor).1;
    let all = triad.axes.iter().flat_map(|axis| &axis.curve.variance);
    let (low, high) = positive_range(all.map(|variance| variance.sqrt() / unit));
    let ends = (0.5 * low, 1.8 * high);
    let panels = triad.axes.iter().zip(AXES);
    let stated = analysis.stated.get(sensor).as_ref();
    let panels = panels.map(|(axis, letter)| panel(axis, letter, (sensor, stated), ends));
    Plot::new(&file, &heading, (3, 440), panels).caption(
        "Overlapping Allan deviation against cluster time, both on logarithmic scales that are the same for all three \
         axes. Dots with band: measured values with their 95 % interval; black: sum of the detected processes; \
         dashed: each detected process, with its coefficient; the random walk coefficient N is the value of its line \
         at 1 s. \
         Orange: noise stated for the instrument. Ring: lowest deviation.",
    )
}

fn panel(
    axis: &AxisNoise,
    letter: char,
    (sensor, stated): (Sensor, Option<&Noise>),
    (low, high): Point,
) -> Panel {
    let (symbol, unit, _) = deviation_unit(sensor);
    let shown = |variance: f64| variance.sqrt() / unit;
    let curve = &axis.curve;
    let title = format!("{} {letter}, {symbol}", sensor.name());
    let y = Axis::log("").between(low, high);
    let lowest = axis.minimum().filter(|_| !axis.is_constant);
    let lowest = lowest.map(|(tau, deviation)| (tau, deviation / unit));
    let words = lowest.map(|(tau, y)| {
        let (y, tau) = (three_digits(y), three_digits(tau));
        format!("lowest {y} {symbol} at {tau} s")
    });
    let found = axis.found().iter().map(|found| coefficient(found, sensor));
    let mut panel = Panel::new(title, Axis::log("cluster time τ, s"), y).noted(found.chain(words));
    if let Some(identified) = &axis.identified {
        let intervals = curve.tau.iter().enumerate().filter_map(|(point, &tau)| {
            let (least, most) = identified.interval(curve, point, 0.95)?;
            Some(((tau, shown(least)), (tau, shown(most))))
        });
        let (least, most) = intervals.unzip();
        panel = panel.with(Series::band(least, most));
        let taus = smooth(&curve.tau);
        for found in axis.found() {
            let part = |tau: f64| found.allan_variance(tau) / identified.allan_variance(tau);
            let line = taus.iter().filter(|&&tau| part(tau) > SEEN);
            let line = line.map(|&tau| (tau, shown(found.allan_variance(tau))));
            let line = line.filter(|(_, y)| (low..=high).contains(y));
            panel = panel.with(Series::line(line).color(Color::Quiet).dashed().width(1.25));
        }
        let sum = taus.iter();
        let sum = sum.map(|&tau| (tau, shown(identified.allan_variance(tau))));
        panel = panel.with(Series::line(sum).color(Color::Ink).width(1.0));
    }
    let stated = stated.map(|noise| {
        let line = smooth(&curve.tau).into_iter();
        let line = line.map(|tau| (tau, shown(noise.allan_variance(tau))));
        Series::line(line.filter(|(_, y)| (low..=high).contains(y)))
    });
    panel = panel.with_all(stated.map(|line| line.nth(1).label("stated")));
    let dots = curve.tau.iter().zip(&curve.variance);
    let dots = dots.map(|(&tau, &variance)| (tau, shown(variance)));
    panel = panel.with(Series::marks(Mark::Dot, dots.filter(|(_, y)| *y > 0.0)).width(1.25));
    panel.with_all(lowest.map(|at| Series::marks(Mark::Ring, [at]).color(Color::Ink)))
}

/// A coefficient with its unit, such as `N = 0.448 °/√h`.
fn coefficient(found: &Found, sensor: Sensor) -> String {
    let of = quantity(found.process, sensor);
    let strength = three_digits(found.strength / of.value);
    let mut text = format!("{} = {strength} {}", of.letter(), of.unit);
    if let Process::GaussMarkov { correlation_time } = found.process {
        text += &format!(", Gauss–Markov, {} s", three_digits(correlation_time));
    }
    text
}

/// Cluster times close enough for a smooth line.
pub fn smooth(taus: &[f64]) -> Vec<f64> {
    let (Some(first), Some(last)) = (taus.first(), taus.last()) else {
        return Vec::new();
    };
    let count = (POINTS * (last / first).log10()).ceil().max(1.0) as usize + 1;
    steps(first.ln(), last.ln(), count).map(f64::exp).collect()
}
