//! What the mean of several axes shows, held to what each of them shows.

use super::super::process::Process;
use super::{Found, Identified, of_kind};

impl Identified {
    /// With every process that all axes show: its own figures where they lie within those of the axes, else
    /// the root of the axes' mean square. The mean has more to tell processes by, and a process that it alone
    /// finds takes from the others.
    pub(in crate::noise) fn within(mut self, axes: &[&Self]) -> Self {
        let found: Vec<&[Found]> = axes.iter().map(|axis| axis.found.as_slice()).collect();
        let for_filter: Vec<&[Found]> =
            axes.iter().map(|axis| axis.for_filter.as_slice()).collect();
        hold(&mut self.found, &found);
        hold(&mut self.for_filter, &for_filter);
        let found = &self.found;
        self.hidden
            .retain(|hidden| of_kind(found, hidden.process).is_none());
        self
    }
}

fn hold(own: &mut Vec<Found>, axes: &[&[Found]]) {
    let markov = Process::GaussMarkov {
        correlation_time: 1.0,
    };
    for process in Process::SLOPES.into_iter().chain([markov]) {
        let of_axes: Option<Vec<&Found>> = axes.iter().map(|of| of_kind(of, process)).collect();
        let of_axes = of_axes.unwrap_or_default();
        let Some(mean) = mean(&of_axes) else {
            continue;
        };
        let lies = |value: fn(&Found) -> f64, found: &Found| {
            let values = || of_axes.iter().map(|of| value(of));
            let least = values().fold(f64::INFINITY, f64::min);
            (least..=values().fold(0.0, f64::max)).contains(&value(found))
        };
        match own
            .iter_mut()
            .find(|found| found.process.same_kind(process))
        {
            Some(found) if lies(|of| of.strength, found) && lies(time, found) => {}
            Some(found) => *found = mean,
            None => own.push(mean),
        }
    }
}

fn time(found: &Found) -> f64 {
    match found.process {
        Process::GaussMarkov { correlation_time } => correlation_time,
        _ => 0.0,
    }
}

/// Root of the mean square of the strengths, geometric mean of the correlation times; axes are independent.
fn mean(axes: &[&Found]) -> Option<Found> {
    let first = axes.first()?;
    let count = axes.len() as f64;
    let strength = (axes.iter().map(|of| of.strength.powi(2)).sum::<f64>() / count).sqrt();
    let squares = axes.iter().map(|of| (of.strength * of.sigma).powi(2));
    let sigma = squares.sum::<f64>().sqrt() / (count * strength);
    let log_time = axes.iter().map(|of| time(of).ln()).sum::<f64>() / count;
    let of_times = axes.iter().map(|of| Some(of.sigma_log_time?.powi(2)));
    Some(Found {
        process: match first.process {
            Process::GaussMarkov { .. } => Process::GaussMarkov {
                correlation_time: log_time.exp(),
            },
            other => other,
        },
        strength,
        sigma,
        sigma_log_time: of_times.sum::<Option<f64>>().map(|sum| sum.sqrt() / count),
    })
}
