//! Allan deviation at rest with the stated and the estimated noise, as a figure.

use super::report::Report;
use crate::allan::{deviation_unit, smooth};
use crate::prelude::*;
use turncal::imu::{AXES, Noise, Sensor};
use turncal::noise::curves_at_rest;

impl Report<'_> {
    /// The Allan deviation over the dwells, with a panel for each triad; `None` if the dwells are too short.
    pub fn noise(&self) -> Option<Plot> {
        let (run, outcome) = (self.run, self.outcome?);
        let dwells = run.dwells(self.aiding).into_iter();
        let dwells: Vec<_> = dwells.map(|dwell| dwell.samples).collect();
        let curves = curves_at_rest(&run.recording.imu, &dwells);
        let panel = |sensor: Sensor| {
            let (symbol, unit, _) = deviation_unit(sensor);
            let curves = curves.get(sensor);
            let point = |(&tau, &variance): (&f64, &f64)| (tau, variance.sqrt() / unit);
            let dots = curves
                .iter()
                .zip(AXES)
                .enumerate()
                .map(|(nth, (curve, axis))| {
                    let dots = curve.tau.iter().zip(&curve.variance).map(point);
                    let dots = Series::marks(Mark::Dot, dots.filter(|(_, y)| *y > 0.0));
                    dots.nth(nth).key(axis)
                });
            let line = |noise: &Noise| {
                let taus = smooth(&curves[0].tau).into_iter();
                Series::line(taus.map(|tau| (tau, noise.allan_variance(tau).sqrt() / unit)))
            };
            let is_stated = *run.instrument.noise_is_stated.get(sensor);
            let stated = is_stated.then(|| line(run.instrument.noise.get(sensor)));
            let used = outcome.noise.learnt || !is_stated;
            let used = used.then(|| line(outcome.model.noise.get(sensor)));
            let title = format!("{}, {symbol}", triad_name(sensor));
            Panel::new(title, Axis::log("cluster time τ, s"), Axis::log(""))
                .with_all(stated.map(|line| line.color(Color::Quiet).dashed().label("stated")))
                .with_all(used.map(|line| line.color(Color::Ink).label("estimated")))
                .with_all(dots)
        };
        let plot = Plot::new(
            "noise.svg",
            "Noise at rest",
            (2, 300),
            Sensor::ALL.map(panel),
        );
        (curves.gyro[0].tau.len() > 2).then(|| {
            plot.caption(
                "Overlapping Allan deviation of each axis against cluster time, averaged over the dwells. Black: \
                 noise that the calibration estimated. Dashed: noise stated for the instrument. Dots far above the \
                 lines indicate vibration or quantisation at short times, and a varying bias at long times.",
            )
        })
    }
}
