//! What has to be said of an analysis.

use super::quantity::quantity;
use crate::imu::{AXES, Sensor};
use crate::noise::{Hidden, Identified, NoiseAnalysis, Process, TriadNoise, of_kind};
use crate::report::prelude::*;

/// Random walks of the axes of a triad that differ by more than this factor are not alike.
const UNLIKE: f64 = 1.5;
/// Departures of the variance from all models that are not worth a word.
const SMALL: f64 = 0.02;

pub const INTERVALS: &str = "A deviation s with ν degrees of freedom lies with 95 % probability \
    between s √(ν/χ²₀.₉₇₅) and s √(ν/χ²₀.₀₂₅) (NIST SP 1065, 5.3).";

/// What is left out at the short end, in a sentence.
fn left_out(of: &Identified, taus: &[f64]) -> Option<String> {
    let from = taus.get(of.first).filter(|_| of.first > 0)?;
    Some(format!(
        "no process describes its deviations below {}: pulses coarser than the noise, or the bandwidth of the \
         sensor. Coefficients are of the longer cluster times.",
        duration(*from)
    ))
}

pub const METHOD: &str = "Overlapping Allan variance of the rate (NIST SP 1065, 5.2.4) at two \
    cluster times in an octave. Coefficients: generalised least squares of the variances as a sum of \
    processes (IEEE Std 952, annex C; El-Sheimy, Hou, Niu 2008), none of them negative, weighted by the \
    covariance that the points have under those very processes, from their generalised \
    autocovariances (Greenhall, Riley 2003), which also gives the equivalent degrees of freedom. Of all \
    combinations the most likely one is taken, where each process must raise twice the logarithm of the \
    likelihood by 9 (3σ), and a correlation time by 4 more. Short cluster \
    times at which no combination describes the deviations, where pulses coarser than the noise or the bandwidth of \
    the sensor show, are left out. Bias instability B is the coefficient of flicker noise, whose floor is 0.664 B.";

/// What forbids to trust the figures, or to use them without thought.
pub fn warnings(analysis: &NoiseAnalysis) -> Vec<String> {
    let mut warnings = Vec::new();
    if !analysis.stretch.stands {
        warnings.push(format!(
            "The instrument is not stationary all through {}: these are figures of its motion and its noise \
             together.",
            analysis.stretch.name
        ));
    }
    for &sensor in &analysis.sensors {
        let triad = analysis.triads.get(sensor);
        let name = sensor.name();
        for (axis, letter) in triad.axes.iter().zip(AXES) {
            match &axis.identified {
                None if axis.is_constant => warnings.push(format!(
                    "{name} {letter}: its samples vary by rounding only, so its noise is not observed."
                )),
                None => warnings.push(format!(
                    "{name} {letter}: no process describes its deviations."
                )),
                Some(of) if of.misfit > SMALL => warnings.push(format!(
                    "{name} {letter}: its deviations depart from every sum of processes by {} %, as \
                     vibration, filters, steps of temperature, or pulses coarser than the noise make \
                     them; σ allow for that.",
                    // Of a deviation, half as much as of a variance.
                    sigma(50.0 * of.misfit)
                )),
                Some(of) => {
                let left_out = left_out(of, &axis.curve.tau);
                warnings.extend(left_out.map(|text| format!("{name} {letter}: {text}")));
            }
            }
            if axis.knocks > 0 {
                warnings.push(format!(
                    "{name} {letter}: {} jump(s) from sample to sample of more than 8σ: knocks or faulty \
                     samples, which raise deviations. Choose a quieter stretch with --segment.",
                    count(axis.knocks)
                ));
            }
        }
        warnings.extend(ramp(triad, sensor));
        warnings.extend(unlike(triad, sensor));
    }
    warnings
}

fn ramp(triad: &TriadNoise, sensor: Sensor) -> Option<String> {
    let of = quantity(Process::RateRamp, sensor);
    let found = of_kind(triad.mean.found(), Process::RateRamp)?;
    Some(format!(
        "{}: a ramp of {} {} is no noise, and [imu.noise] has no place for it: let the instrument warm up \
         and hold its temperature.",
        sensor.name(),
        three_digits(found.strength / of.value),
        of.unit
    ))
}

fn unlike(triad: &TriadNoise, sensor: Sensor) -> Option<String> {
    let of = quantity(Process::RandomWalk, sensor);
    let walks: Vec<f64> = triad
        .axes
        .iter()
        .filter_map(|axis| Some(of_kind(axis.found(), Process::RandomWalk)?.strength / of.value))
        .collect();
    let least = walks.iter().copied().fold(f64::INFINITY, f64::min);
    let most = walks.iter().copied().fold(0.0, f64::max);
    (most > UNLIKE * least).then(|| {
        format!(
            "{}: the axes are not alike ({} from {} to {} {}); a run states one figure for all three, the \
             root of their mean square.",
            sensor.name(),
            of.name,
            three_digits(least),
            three_digits(most),
            of.unit
        )
    })
}

/// Of each slope that a triad does not show: what it is below, and how it could be seen.
pub fn advice(analysis: &NoiseAnalysis) -> Vec<String> {
    let mut sentences = Vec::new();
    for &sensor in &analysis.sensors {
        let mean = &analysis.triads.get(sensor).mean;
        let found = |process| of_kind(mean.found(), process).is_some();
        for &Hidden { process, limit } in mean.hidden() {
            let of = quantity(process, sensor);
            let longer = |factor: f64| duration(factor * analysis.duration());
            let how = match process {
                Process::Quantisation => {
                    "shows at short cluster times: a higher sample rate would show it, a longer record \
                     would not"
                        .to_owned()
                }
                Process::BiasInstability if found(Process::RateRandomWalk) => {
                    "lies hidden between random walk and rate random walk: a longer record would not \
                     show it"
                        .to_owned()
                }
                Process::BiasInstability | Process::RateRandomWalk if found(Process::RateRamp) => {
                    "lies hidden under the ramp: record after it has warmed up, at an even temperature"
                        .to_owned()
                }
                Process::RateRandomWalk => format!(
                    "half of that would show in a record twice as long, {}",
                    longer(2.0)
                ),
                _ => format!(
                    "half of that would show in a record four times as long, {}",
                    longer(4.0)
                ),
            };
            sentences.push(format!(
                "{} {}: below {} {}; {how}.",
                sensor.name(),
                of.name,
                sigma(limit / of.value),
                of.unit
            ));
        }
    }
    sentences
}

/// A time in a readable unit.
pub fn duration(seconds: f64) -> String {
    let (unit, size) = readable(&TIMES, seconds);
    format!("{} {unit}", three_digits(seconds / size))
}
