//! White noise that drives the navigation errors over a block.

use nalgebra::{Matrix3, Vector3};

use super::block::BlockMatrix;
use super::transition::{Errors, Transition};
use crate::attitude::skew;
use crate::imu::PerSensor;

/// White noise of a triad as 1σ densities, alike on its three axes. Each of its sources is independent of
/// the others, so their variances add.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ProcessNoise {
    /// Angle or velocity random walk, rad/√s or (m/s)/√s.
    pub random_walk: f64,
    /// Of moves, by how fast they are: over the root of ∫|ω − ω_ie|² dt (gyros) or ∫|f + g|² dt
    /// (accelerometers), √s. Scale nonlinearity, bandwidth, timing and size effect grow so.
    pub by_motion: f64,
    /// Of moves, by how long they take, rad/√s or (m/s)/√s.
    pub by_duration: f64,
}

/// What the sources of [`ProcessNoise`] act on over a block: on one short part of it after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseInputs {
    earth_rate: Vector3<f64>,
    parts: Vec<NoiseInput>,
}

impl NoiseInputs {
    /// Of no time, on an Earth of this rate in `n`, rad/s.
    pub fn new(earth_rate: Vector3<f64>) -> Self {
        Self {
            earth_rate,
            parts: Vec::new(),
        }
    }

    /// Goes on over another part.
    pub fn push(&mut self, part: NoiseInput) {
        self.parts.push(part);
    }

    /// The same parts in as little memory as they take.
    pub(super) fn shrunk(mut self) -> Self {
        self.parts.shrink_to_fit();
        self
    }

    /// The same over a block at rest of the same length in which interpolated samples add this covariance.
    pub(super) fn bridging(&self, bridged: PerSensor<Matrix3<f64>>) -> Self {
        let of_part = |part: &NoiseInput| NoiseInput::bridging(part.duration, part.force, bridged);
        Self {
            earth_rate: self.earth_rate,
            parts: self.parts.iter().take(1).map(of_part).collect(),
        }
    }

    /// One part after the other.
    pub fn parts(&self) -> &[NoiseInput] {
        &self.parts
    }

    /// Covariance that noise of these densities adds to the navigation errors at the end. Linear in the
    /// squares of the densities.
    pub fn covariance(&self, noise: &PerSensor<ProcessNoise>) -> BlockMatrix {
        let mut sum = Errors::default();
        for (number, part) in self.parts.iter().enumerate() {
            let over = part.transition(&self.earth_rate);
            // Φ P Φᵀ, no P before the first part.
            if number > 0 {
                over.carry(&mut sum);
                over.carry_causes(&mut sum);
            }
            sum.add(&part.covariance(noise));
        }
        BlockMatrix::from_fn(|row, column| sum.component(row, column))
    }
}

/// What the sources of [`ProcessNoise`] act on over a short part of a block.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseInput {
    /// Length in s.
    pub duration: f64,
    /// Mean specific force in `n`, m/s².
    force: Vector3<f64>,
    /// ∫|ω − ω_ie|² dt in rad²/s and ∫|f + g|² dt in m²/s³ where the block is of a move, else zero.
    pub motion: PerSensor<f64>,
    /// Length in s where the block is of a move, else zero.
    pub moving: f64,
    /// Covariance in `n` that interpolated samples add to the integral of each triad's input, rad² and
    /// (m/s)², where there are any.
    bridged: Option<Box<PerSensor<Matrix3<f64>>>>,
}

impl NoiseInput {
    /// Of a block at rest of some length in s, with this mean specific force in m/s² and covariance that
    /// interpolated samples add.
    pub fn bridging(duration: f64, force: Vector3<f64>, bridged: PerSensor<Matrix3<f64>>) -> Self {
        Self {
            duration,
            force,
            motion: PerSensor::default(),
            moving: 0.0,
            bridged: (bridged != PerSensor::default()).then(|| Box::new(bridged)),
        }
    }

    /// How navigation errors go on over this part.
    fn transition(&self, earth_rate: &Vector3<f64>) -> Transition {
        Transition {
            earth_turn: earth_rate * self.duration,
            force: self.force * self.duration,
            duration: self.duration,
        }
    }

    /// Covariance that noise of these densities adds to the navigation errors. Linear in the squares of
    /// the densities.
    ///
    /// White noise through the chain attitude → velocity → position over the block, with the mean
    /// specific force (Brown and Hwang, *Introduction to Random Signals*, 4th ed., §5.3).
    pub fn covariance(&self, noise: &PerSensor<ProcessNoise>) -> BlockMatrix {
        let t = self.duration;
        let mut covariance = BlockMatrix::zeros();
        if t == 0.0 {
            return covariance;
        }
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
        let mut set = |row: usize, column: usize, m: Matrix3<f64>| {
            covariance
                .fixed_view_mut::<3, 3>(3 * row, 3 * column)
                .copy_from(&m);
            if row != column {
                covariance
                    .fixed_view_mut::<3, 3>(3 * column, 3 * row)
                    .copy_from(&m.transpose());
            }
        };
        let t2 = t * t;
        set(0, 0, gyro);
        set(1, 0, tilting * (t / 2.0));
        set(2, 0, tilting * (t2 / 6.0));
        set(1, 1, accel + both * (t2 / 3.0));
        set(2, 1, accel * (t / 2.0) + both * (t2 * t / 8.0));
        set(2, 2, accel * (t2 / 3.0) + both * (t2 * t2 / 20.0));
        covariance
    }
}
