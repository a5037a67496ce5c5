//! What the errors of several equations have in common: the mean noise of each dwell and move, and the
//! heading of each stretch.

use nalgebra::{DMatrix, Vector3};

use crate::calibration::problem::Problem;
use crate::imu::{Noise, PARAMETERS, Sensor, TriadVector};
use crate::run::{Dwell, Run};

/// Where each has its number: three for the accelerometers in a dwell, three for the gyros there, three for
/// the gyros over the move before it, then one for each heading.
#[derive(Debug, Clone, Copy)]
pub struct SharedNoise {
    /// Dwells of all stretches.
    pub dwells: usize,
}

impl SharedNoise {
    pub fn of(problem: &Problem) -> Self {
        Self {
            dwells: problem.dwells().count(),
        }
    }

    /// First number of a dwell's, of its place among those of all stretches.
    pub fn at_rest(self, sensor: Sensor, dwell: usize) -> usize {
        match sensor {
            Sensor::Accel => 3 * dwell,
            Sensor::Gyro => 3 * (self.dwells + dwell),
        }
    }

    /// First number of the move's that ends in a dwell.
    pub fn before(self, dwell: usize) -> usize {
        3 * (2 * self.dwells + dwell)
    }

    /// Number of the heading of a stretch.
    pub fn heading(self, stretch: usize) -> usize {
        9 * self.dwells + stretch
    }

    /// Their covariance. Over moves it is that of the bias alone: random walk is there what each equation
    /// has for itself.
    pub fn covariance(self, problem: &Problem, heading_sigma: &[f64]) -> DMatrix<f64> {
        let count = self.heading(problem.stretches().len());
        let mut covariance = DMatrix::zeros(count, count);
        for sensor in Sensor::ALL {
            let spans = self.spans(problem, sensor);
            for (i, one) in spans.iter().enumerate() {
                for other in &spans[..=i] {
                    let value = one.covariance(other);
                    for axis in 0..3 {
                        covariance[(one.number + axis, other.number + axis)] = value;
                        covariance[(other.number + axis, one.number + axis)] = value;
                    }
                }
            }
        }
        for (stretch, sigma) in heading_sigma.iter().enumerate() {
            let number = self.heading(stretch);
            covariance[(number, number)] = sigma.powi(2);
        }
        covariance
    }

    fn spans(self, problem: &Problem, sensor: Sensor) -> Vec<Span> {
        let mut spans = Vec::new();
        let mut dwell = 0;
        for stretch in problem.stretches() {
            let run: &Run = stretch.run;
            let noise = *run.instrument.noise.get(sensor);
            let bias = Noise {
                random_walk: 0.0,
                ..noise
            };
            let mut add = |number: usize, samples, variance: Option<f64>| {
                let section = Dwell {
                    samples,
                    position: None,
                };
                let times = section.times(run);
                spans.push(Span {
                    number,
                    recording: stretch.recording,
                    times,
                    variance: variance.unwrap_or_else(|| bias.covariance_of_means(times, times)),
                    bias,
                });
            };
            for (k, at_rest) in stretch.dwells.iter().enumerate() {
                let variance = at_rest.mean(sensor, run).variance;
                add(
                    self.at_rest(sensor, dwell),
                    at_rest.samples.clone(),
                    Some(variance),
                );
                if k > 0 && sensor == Sensor::Gyro {
                    let samples = stretch.dwells[k - 1].samples.end..at_rest.samples.start;
                    add(self.before(dwell), samples, None);
                }
                dwell += 1;
            }
        }
        spans
    }
}

/// A span of time with the mean noise of a triad over it.
struct Span {
    number: usize,
    recording: usize,
    times: [f64; 2],
    variance: f64,
    /// What lasts of the noise.
    bias: Noise,
}

impl Span {
    fn covariance(&self, other: &Self) -> f64 {
        if self.number == other.number {
            self.variance
        } else if self.recording == other.recording {
            self.bias.covariance_of_means(self.times, other.times)
        } else {
            0.0
        }
    }
}

/// How an equation follows three shared errors, from the first of their numbers on.
pub fn along(first: usize, parts: &Vector3<f64>) -> Vec<(usize, f64)> {
    (0..3).map(|axis| (first + axis, parts[axis])).collect()
}

/// How an equation of a triad's parameters follows its mean noise: as it does its biases.
pub fn of_biases(row: &TriadVector) -> Vector3<f64> {
    row.fixed_rows::<3>(PARAMETERS - 3).into_owned()
}
