//! Text that describes an analysis.

use super::quantity::quantity;
use crate::prelude::*;
use turncal::imu::{AXES, Sensor};
use turncal::noise::{Hidden, Identified, NoiseAnalysis, Process, TriadNoise, of_kind};

/// Random walks of the axes of a triad count as different beyond this ratio.
const UNLIKE: f64 = 1.5;
/// Deviations of the variance from all models below this fraction are not reported.
const SMALL: f64 = 0.02;

/// Excluded short cluster times, in a sentence.
fn left_out(of: &Identified, taus: &[f64]) -> Option<String> {
    let from = taus.get(of.first).filter(|_| of.first > 0)?;
    Some(format!(
        "no process fits its deviations at cluster times below {}, because the pulses are coarser than the noise or \
         the bandwidth of the sensor is limited. turncal computed the coefficients from the longer cluster times.",
        duration(*from)
    ))
}

pub const METHOD: &str = "Overlapping Allan variance of the rate (NIST SP 1065, 5.2.4) at two cluster times per \
                          octave. Coefficients: non-negative generalised least-squares fit of a sum of processes to \
                          the variances (IEEE Std 952, annex C; El-Sheimy, Hou, Niu 2008). The weights are derived \
                          from the covariance of the points under these processes, computed from their generalised \
                          autocovariances (Greenhall, Riley 2003), which also give the equivalent degrees of freedom. \
                          turncal selects the most likely combination; each process must raise twice the \
                          log-likelihood by 9 (3σ), and a correlation time by a further 4. Short cluster times are \
                          excluded if no combination fits them because of coarse pulses or a limited sensor \
                          bandwidth. The bias instability B is the coefficient of flicker noise, whose floor is 0.664 \
                          B.";

/// Warnings about the figures.
pub fn warnings(analysis: &NoiseAnalysis) -> Vec<String> {
    let mut warnings = Vec::new();
    if !analysis.stretch.stands {
        warnings.push(format!(
            "The instrument is not stationary throughout {}, so the figures include the effect of motion in addition \
             to noise.",
            analysis.stretch.name
        ));
    }
    for &sensor in &analysis.sensors {
        let triad = analysis.triads.get(sensor);
        let name = sensor.name();
        for (axis, letter) in triad.axes.iter().zip(AXES) {
            match &axis.identified {
                None if axis.is_constant => warnings.push(format!(
                    "{name} {letter}: the samples of this axis vary only by rounding, so its noise cannot be \
                     determined."
                )),
                None => warnings.push(format!(
                    "{name} {letter}: no process fits the deviations of this axis."
                )),
                Some(of) if of.misfit > SMALL => warnings.push(format!(
                    "{name} {letter}: the deviations of this axis differ by {} % from any sum of processes; the σ \
                     include this misfit. Possible causes are vibration, filters, temperature steps, or pulses coarser than the \
                     noise.",
                    // The relative error of a deviation is half of that of a variance.
                    sigma(50.0 * of.misfit)
                )),
                Some(of) => {
                let left_out = left_out(of, &axis.curve.tau);
                warnings.extend(left_out.map(|text| format!("{name} {letter}: {text}")));
            }
            }
            if axis.knocks > 0 {
                warnings.push(format!(
                    "{name} {letter}: {} of more than 8σ between samples, caused by knocks or faulty samples, \
                     increased the deviations. Choose a quieter segment.",
                    several(axis.knocks, "jump")
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
        "{}: the output drifts by {} {}. This is drift, not noise, and does not belong in [imu.noise]. Let the instrument warm \
         up and keep its temperature constant.",
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
            "{}: the axes differ ({} from {} to {} {}). run.toml takes one value for all three, their RMS.",
            sensor.name(),
            of.name,
            three_digits(least),
            three_digits(most),
            of.unit
        )
    })
}

/// For each slope of a triad that was not detected: its upper limit, and how to measure it.
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
                    "a higher sample rate would reveal this process, but a longer recording would not"
                        .to_owned()
                }
                Process::BiasInstability if found(Process::RateRandomWalk) => {
                    "random walk and rate random walk hide this process, so a longer recording would not reveal it"
                        .to_owned()
                }
                Process::BiasInstability | Process::RateRandomWalk if found(Process::RateRamp) => {
                    "the ramp hides this process, so record again after warm-up at a constant temperature"
                        .to_owned()
                }
                Process::RateRandomWalk => format!(
                    "a recording twice as long ({}) could reveal a process half as strong as this limit",
                    longer(2.0)
                ),
                _ => format!(
                    "a recording four times as long ({}) could reveal a process half as strong as this limit",
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
