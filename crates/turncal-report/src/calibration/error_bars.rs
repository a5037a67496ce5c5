//! K, E and D with their uncertainty, prior and specification, as a figure.

use super::report::Report;
use crate::prelude::*;
use turncal::calibration::{Estimate, ParameterVector, to_vector};

/// Half the width of a prior or limit.
const HALF: f64 = 0.35;
/// Half length of an error bar, in standard deviations.
const SIGMAS: f64 = 2.0;

impl Report<'_> {
    /// Every value with an error bar of ±2σ, drawn over its prior and between its limits.
    pub fn error_bars(&self, estimate: &Estimate) -> Plot {
        let prior = self.outcome.map(|outcome| {
            let mean = self.run.instrument.prior_mean(estimate.form());
            (to_vector(&mean), outcome.prior_sigma)
        });
        let panels =
            Group::all().filter_map(|group| self.of_group(group, estimate, prior.as_ref()));
        let mut caption =
            "Each parameter with an error bar of ±2σ (hidden by the dot if the parameter is well \
        determined); scale factors are shown as deviations from nominal. Bands: prior mean ±1σ."
                .to_owned();
        if self.specification.is_some() {
            caption += " Dashed: limits of the specification. The error bar of a prior may extend beyond the axes.";
        }
        let heading = "Values with their uncertainty";
        Plot::new("values.svg", heading, (3, 270), panels).caption(caption)
    }

    fn of_group(
        &self,
        group: Group,
        estimate: &Estimate,
        prior: Option<&(ParameterVector, ParameterVector)>,
    ) -> Option<Panel> {
        let indices = group.estimated(estimate);
        let (values, sigma, unit) = (estimate.vector(), estimate.sigma(), group.unit_value());
        let places = || indices.iter().enumerate();
        let across = |n: usize, y: f64| [-HALF, HALF].map(|side| (n as f64 + side, y)).to_vec();
        let bands = prior.into_iter().flat_map(|(mean, sigma)| {
            places().map(move |(n, &i)| {
                let (mean, sigma) = (group.shown(mean[i]), sigma[i] / unit);
                let band = Series::band(across(n, mean - sigma), across(n, mean + sigma));
                if n == 0 {
                    band.key("prior ±1σ")
                } else {
                    band
                }
            })
        });
        let limits = self.specification.into_iter().flat_map(|of| &of.limits);
        let limits = limits.filter_map(|limit| {
            let n = indices.iter().position(|&i| i == limit.parameter)?;
            let ends = [limit.nominal - limit.within, limit.nominal + limit.within];
            Some((n, ends.map(|end| group.shown(end))))
        });
        let limits: Vec<(usize, [f64; 2])> = limits.collect();
        let lines = limits.iter().flat_map(|&(n, ends)| {
            let line = move |end: f64| Series::line(across(n, end)).color(Color::Ink).dashed();
            ends.map(line)
        });
        let bars = places().map(|(n, &i)| {
            let (value, bar) = (group.shown(values[i]), SIGMAS * sigma[i] / unit);
            (n as f64, value, bar)
        });
        let bars: Vec<(f64, f64, f64)> = bars.collect();
        let names = indices.iter().map(|&i| axis_name(estimate.form(), i));
        let mut y = Axis::linear("").including([0.0]).room(0.08, 0.08);
        if !limits.is_empty() {
            // Next to limits, a wide prior would hide whether they are met.
            let ends = bars
                .iter()
                .flat_map(|(_, value, bar)| [value - bar, value + bar]);
            let ends = ends.chain(limits.iter().flat_map(|(_, ends)| *ends));
            let scale = y.scale(ends);
            y = y.between(scale.low, scale.high).room(0.0, 0.0);
        }
        let panel = Panel::new(group.titled(), Axis::places(names), y)
            .with_all(bands)
            .with(Series::zero())
            .with_all(lines)
            .with(Series::measured(Mark::Dot, bars).width(2.0).key("±2σ"));
        (!indices.is_empty()).then_some(panel)
    }
}
