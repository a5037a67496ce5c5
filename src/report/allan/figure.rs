//! Allan deviation against cluster time, a panel for each axis.

use plotters::style::text_anchor::{HPos, VPos};

use super::super::axis::Axis;
use super::super::canvas::{Area, DrawError, INK, Pen, QUIET};
use super::super::number::three_digits;
use super::super::panel::{Margins, Mark, Panel};
use super::super::{Figure, ReportError};
use super::quantity::{deviation_unit, quantity};
use crate::imu::{AXES, Sensor};
use crate::noise::{AxisNoise, Found, NoiseAnalysis};

/// A process is drawn where it makes at least this part of the variance.
const SEEN: f64 = 0.02;
/// Points in a decade of a drawn line.
const POINTS: f64 = 24.0;
/// Decades beyond which only whole ones have ticks.
const MANY_DECADES: f64 = 3.0;

pub(super) fn figure(analysis: &NoiseAnalysis, sensor: Sensor) -> Result<Figure, ReportError> {
    let (file, title) = match sensor {
        Sensor::Gyro => ("gyro.svg", "Gyros: Allan deviation"),
        Sensor::Accel => ("accel.svg", "Accelerometers: Allan deviation"),
    };
    let caption = "Overlapping Allan deviation against cluster time, both logarithmic, the same axes for \
                   all three. Dots: as measured, with the 95 % interval as a band; black: the sum of what \
                   was found; dashed: each process found, with its slope and coefficient. Where no dashed \
                   line is, no slope was found."
        .to_owned();
    let unit = deviation_unit(sensor).1;
    let triad = analysis.triads.get(sensor);
    let all = triad.axes.iter().flat_map(|axis| &axis.curve.variance);
    let (low, high) = all
        .map(|v| v.sqrt() / unit)
        .filter(|y| y.is_finite() && *y > 0.0)
        .fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), y| {
            (low.min(y), high.max(y))
        });
    let (low, high) = (0.5 * low, 1.8 * high);
    let y = if (high / low).log10() > MANY_DECADES {
        Axis::log([low, high].into_iter())
    } else {
        Axis::log_between(low, high)
    };
    Figure::draw(file, title, caption, (1200, 440), |area| {
        for ((axis, letter), area) in triad.axes.iter().zip(AXES).zip(area.split_evenly((1, 3))) {
            let title = format!("{} {letter}, {}", sensor.name(), deviation_unit(sensor).0);
            panel(&area, &title, axis, sensor, y.clone())?;
        }
        Ok(())
    })
}

fn panel(
    area: &Area,
    title: &str,
    axis: &AxisNoise,
    sensor: Sensor,
    y: Axis,
) -> Result<(), DrawError> {
    let unit = deviation_unit(sensor).1;
    let shown = |variance: f64| variance.sqrt() / unit;
    let curve = &axis.curve;
    let (low, high) = (y.low(), y.high());
    let margins = Margins {
        left: 56.0,
        right: 28.0,
    };
    let x = Axis::log(curve.tau.iter().copied());
    let mut panel = Panel::new(area, title, margins, (x, y), "cluster time τ, s", &[])?;
    let within = |variance: f64| shown(variance).clamp(low, high);
    if let Some(identified) = &axis.identified {
        let intervals = curve.tau.iter().enumerate().filter_map(|(point, &tau)| {
            let (least, most) = identified.interval(curve, point, 0.95)?;
            Some(((tau, within(least)), (tau, within(most))))
        });
        let (least, most): (Vec<_>, Vec<_>) = intervals.unzip();
        panel.band(&least, &most)?;
        let taus = fine(&curve.tau);
        for found in axis.found() {
            let seen =
                |tau: &f64| found.allan_variance(*tau) > SEEN * identified.allan_variance(*tau);
            let line: Vec<(f64, f64)> = taus
                .iter()
                .filter(|tau| seen(tau))
                .map(|&tau| (tau, shown(found.allan_variance(tau))))
                .filter(|(_, y)| (low..=high).contains(y))
                .collect();
            panel.line(&line, Pen::dashed(QUIET, 1.25))?;
        }
        let sum = taus
            .iter()
            .map(|&tau| (tau, shown(identified.allan_variance(tau))));
        panel.line(&sum.collect::<Vec<_>>(), Pen::solid(INK, 1.0))?;
    }
    let dots = curve
        .tau
        .iter()
        .zip(&curve.variance)
        .map(|(&t, &v)| (t, shown(v)));
    let dots: Vec<(f64, f64)> = dots.filter(|(_, y)| *y > 0.0).collect();
    panel.marks(&dots, Mark::Dot, Pen::solid(Pen::nth(0, 1.0).color, 1.25))?;
    // Beside the title there is room for every coefficient, and no line.
    for (place, found) in axis.found().iter().enumerate() {
        let (x, y) = (curve.tau.last().copied().unwrap_or(1.0), high);
        let down = 6.0 + 17.0 * place as f64;
        let right = (HPos::Right, VPos::Top);
        panel.text((x, y), (0.0, down), &coefficient(found, sensor), right)?;
    }
    panel.finish()
}

/// Such as `N 0.448 °/√h, slope −½`.
fn coefficient(found: &Found, sensor: Sensor) -> String {
    use crate::noise::Process;
    let of = quantity(found.process, sensor);
    let slope = match found.process {
        Process::Quantisation => "slope −1".to_owned(),
        Process::RandomWalk => "slope −½".to_owned(),
        Process::BiasInstability => "slope 0".to_owned(),
        Process::RateRandomWalk => "slope +½".to_owned(),
        Process::RateRamp => "slope +1".to_owned(),
        Process::GaussMarkov { correlation_time } => {
            format!("Gauss–Markov, {} s", three_digits(correlation_time))
        }
    };
    let strength = three_digits(found.strength / of.value);
    format!("{} = {strength} {}, {slope}", of.letter, of.unit)
}

/// Cluster times close enough for a smooth line.
fn fine(taus: &[f64]) -> Vec<f64> {
    let (Some(first), Some(last)) = (taus.first(), taus.last()) else {
        return Vec::new();
    };
    let steps = (POINTS * (last / first).log10()).ceil().max(1.0) as i32;
    (0..=steps)
        .map(|step| first * (last / first).powf(f64::from(step) / f64::from(steps)))
        .collect()
}
