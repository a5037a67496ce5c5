//! The yardstick: an error-state Kalman filter as a textbook writes it, every matrix whole.

use nalgebra::{SMatrix, SVector, Vector3};
use turncal::imu::PerSensor;
use turncal::navigation::{Block, ProcessNoise};

/// Navigation, both triads, the table's position, the initial attitude.
const STATES: usize = 9 + 24 + 3 + 3;
const VELOCITY: usize = 3;
const TABLE: usize = 33;

/// Mean and covariance of the errors.
pub struct DenseFilter {
    x: SVector<f64, STATES>,
    p: Box<SMatrix<f64, STATES, STATES>>,
    noise: PerSensor<ProcessNoise>,
}

impl DenseFilter {
    pub fn new(noise: PerSensor<ProcessNoise>) -> Self {
        Self {
            x: SVector::zeros(),
            p: Box::new(SMatrix::identity() * 1e-6),
            noise,
        }
    }

    /// `Φ P Φᵀ + Q`
    pub fn propagate(&mut self, block: &Block) {
        let mut phi = SMatrix::<f64, STATES, STATES>::identity();
        phi.fixed_view_mut::<9, 9>(0, 0)
            .copy_from(&block.navigation);
        phi.fixed_view_mut::<9, 12>(0, 9)
            .copy_from(&block.parameters.gyro);
        phi.fixed_view_mut::<9, 12>(0, 21)
            .copy_from(&block.parameters.accel);
        self.x = phi * self.x;
        *self.p = phi * *self.p * phi.transpose();
        let mut corner = self.p.fixed_view_mut::<9, 9>(0, 0);
        corner += block.noise.covariance(&self.noise);
    }

    /// Velocity zero and the table's attitude, each three scalars with these variances.
    pub fn observe(&mut self, velocity: Vector3<f64>, variances: [f64; 2]) {
        for axis in 0..3 {
            self.scalar(&[(VELOCITY + axis, 1.0)], velocity[axis], variances[0]);
        }
        for axis in 0..3 {
            self.scalar(&[(axis, 1.0), (TABLE + axis, -1.0)], 0.0, variances[1]);
        }
    }

    fn scalar(&mut self, h: &[(usize, f64)], residual: f64, variance: f64) {
        let mut ph = SVector::<f64, STATES>::zeros();
        for &(state, weight) in h {
            ph += self.p.column(state) * weight;
        }
        let sum = |v: &SVector<f64, STATES>| h.iter().map(|&(s, w)| w * v[s]).sum::<f64>();
        let gain = ph / (sum(&ph) + variance);
        self.x += gain * (residual - sum(&self.x));
        *self.p -= gain * ph.transpose();
    }

    /// Sum of all variances, so that nothing is left out as unused.
    pub fn trace(&self) -> f64 {
        self.p.trace() + self.x.norm()
    }
}
