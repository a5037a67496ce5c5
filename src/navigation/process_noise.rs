//! White process noise of the navigation errors over a block.

use nalgebra::{Matrix3, Vector3};

use super::errors::{ATTITUDE, ErrorMatrix, POSITION, Span, VELOCITY, blocks};
use crate::attitude::skew;
use crate::imu::PerSensor;

/// White noise of a triad as 1σ densities, equal on its three axes. The sources are independent, so their variances add
/// up.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ProcessNoise {
    /// Angle or velocity random walk, rad/√s or (m/s)/√s.
    pub random_walk: f64,
    /// Noise of moves that grows with the speed of the move: 1σ divided by the root of ∫|ω − ω_ie|² dt (gyros) or ∫|f +
    /// g|² dt (accelerometers), √s. Scale nonlinearity, bandwidth, timing and size effect grow in this way.
    pub by_motion: f64,
    /// Noise of moves that grows with the duration of the move, rad/√s or (m/s)/√s.
    pub by_duration: f64,
}

/// Inputs of the sources of [`ProcessNoise`] over a block.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseInputs {
    /// Earth rate in `n`, rad/s.
    pub earth_rate: Vector3<f64>,
    /// Short parts of the block, in sequence.
    pub parts: Vec<NoiseInput>,
}

impl NoiseInputs {
    /// Covariance that noise with these densities adds to the navigation errors at the end of the block. The covariance
    /// is linear in the squares of the densities.
    pub fn covariance(&self, noise: &PerSensor<ProcessNoise>) -> ErrorMatrix {
        let mut sum = ErrorMatrix::zeros();
        for (number, part) in self.parts.iter().enumerate() {
            // There is no covariance before the first part.
            if number > 0 {
                let over = part.span(&self.earth_rate);
                // Φ P Φᵀ of a symmetric P, first from one side, then from the other.
                for _ in 0..2 {
                    over.carry(&mut sum);
                    sum.transpose_mut();
                }
            }
            sum += part.covariance(noise);
        }
        sum
    }
}

/// Inputs of the sources of [`ProcessNoise`] over a short part of a block.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NoiseInput {
    /// Length in s.
    pub duration: f64,
    /// ∫f_n dt, m/s.
    pub force: Vector3<f64>,
    /// ∫|ω − ω_ie|² dt in rad²/s and ∫|f + g|² dt in m²/s³ if the block is part of a move, otherwise zero.
    pub motion: PerSensor<f64>,
    /// Length in s if the block is part of a move, otherwise zero.
    pub moving: f64,
    /// Covariance in `n` that interpolated samples, if any, add to the integral of each triad's input, rad² and
    /// (m/s)².
    pub bridged: Option<Box<PerSensor<Matrix3<f64>>>>,
}

impl NoiseInput {
    /// The part as an interval with this Earth rate in `n`, rad/s.
    pub fn span(&self, earth_rate: &Vector3<f64>) -> Span {
        Span {
            earth_turn: earth_rate * self.duration,
            force: self.force,
            duration: self.duration,
        }
    }

    /// Covariance that noise of these densities adds to the navigation errors. The covariance is linear in the squares
    /// of the densities.
    ///
    /// White noise through the chain attitude → velocity → position over the part, specific force constant
    /// in it (Brown and Hwang, *Introduction to Random Signals*, 4th ed., §5.3).
    fn covariance(&self, noise: &PerSensor<ProcessNoise>) -> ErrorMatrix {
        let t = self.duration;
        let PerSensor { gyro, accel } = PerSensor::from_fn(|sensor| {
            let noise = noise.get(sensor);
            let variance = noise.random_walk.powi(2) * t
                + noise.by_motion.powi(2) * self.motion.get(sensor)
                + noise.by_duration.powi(2) * self.moving;
            let white = Matrix3::from_diagonal_element(variance);
            match &self.bridged {
                Some(bridged) => white + bridged.get(sensor),
                None => white,
            }
        });
        let force = skew(self.force);
        let tilting = force * gyro;
        let both = tilting * force.transpose();
        let mut covariance: ErrorMatrix = blocks(&[
            (ATTITUDE, ATTITUDE, gyro),
            (VELOCITY, ATTITUDE, tilting / 2.0),
            (POSITION, ATTITUDE, tilting * (t / 6.0)),
            (VELOCITY, VELOCITY, accel + both / 3.0),
            (POSITION, VELOCITY, (accel / 2.0 + both / 8.0) * t),
            (POSITION, POSITION, (accel / 3.0 + both / 20.0) * t * t),
        ]);
        covariance.fill_upper_triangle_with_lower_triangle();
        covariance
    }
}
