//! How navigation errors depend on the parameters of an instrument, along any motion.

use nalgebra::{SMatrix, Vector3};

use super::block::CorrectedResponse;
use super::error_model::{ErrorMatrix, ErrorModel, INPUTS, PARAMETERS, STATES, Sensitivity};
use super::stride::Instant;
use crate::imu::{PARAMETERS as PER_TRIAD, PerSensor, Sensor, Triad};

/// Rows of a matrix, one column a parameter: what is done to all parameters goes through memory without a stride.
type Rows<const R: usize, const N: usize = PARAMETERS> = [[f64; N]; R];

/// `∂ε/∂θ`, errors of the sensed rate and force by parameter errors δθ = true − estimated:
/// `(K̂Ĉ)⁻¹ ∂(K C u + D)/∂θ`, linear in `[u; 1]`.
#[derive(Debug, Clone)]
pub struct SensedErrors(PerSensor<[Rows<4, PER_TRIAD>; 3]>);

impl SensedErrors {
    /// Of these triads.
    ///
    /// # Errors
    /// A triad whose sensitivity is singular.
    pub fn new(triads: &PerSensor<Triad>) -> Result<Self, Sensor> {
        let of = |sensor: Sensor| {
            let triad = triads.get(sensor);
            let correction = triad.correction().ok_or(sensor)?;
            let response = CorrectedResponse::new(triad, &correction);
            let by = |row: usize, input: usize| response.0.each_ref().map(|w| w[(row, input)]);
            Ok([0, 1, 2].map(|row| [0, 1, 2, 3].map(|input| by(row, input))))
        };
        Ok(Self(PerSensor {
            gyro: of(Sensor::Gyro)?,
            accel: of(Sensor::Accel)?,
        }))
    }

    /// At an angular rate (rad/s) and specific force (m/s²) along body axes.
    pub fn at(
        &self,
        rate: &Vector3<f64>,
        force: &Vector3<f64>,
    ) -> SMatrix<f64, INPUTS, PARAMETERS> {
        let rows = self.rows(rate, force);
        SMatrix::from_fn(|row, column| rows[row][column])
    }

    #[inline]
    fn rows(&self, rate: &Vector3<f64>, force: &Vector3<f64>) -> Rows<INPUTS> {
        let mut sensed = [[0.0; PARAMETERS]; INPUTS];
        for (place, (sensor, u)) in Sensor::ALL.into_iter().zip([rate, force]).enumerate() {
            for (row, by) in self.0.get(sensor).iter().enumerate() {
                let sensed = &mut sensed[3 * place + row][PER_TRIAD * place..][..PER_TRIAD];
                for (k, sensed) in sensed.iter_mut().enumerate() {
                    *sensed = by[0][k] * u.x + by[1][k] * u.y + by[2][k] * u.z + by[3][k];
                }
            }
        }
        sensed
    }
}

/// The linear error model at one moment, height held: `ẋ = F x + G (∂ε/∂θ) θ`.
#[derive(Debug, Clone)]
pub struct Linearisation {
    dynamics: ErrorMatrix,
    forcing: Rows<STATES>,
}

impl Linearisation {
    /// About a true motion.
    pub fn about(at: &Instant, sensed: &SensedErrors) -> Self {
        let ErrorModel { dynamics, input } = at.linear_model();
        let mut forcing = [[0.0; PARAMETERS]; STATES];
        add_product::<INPUTS>(&mut forcing, &input, &sensed.rows(&at.rate, &at.force));
        Self { dynamics, forcing }
    }

    /// The same with what each parameter drives times a weight of its own.
    pub fn weighted(&self, weight: impl Fn(usize) -> f64) -> Self {
        let weights: [f64; PARAMETERS] = std::array::from_fn(weight);
        let mut weighted = self.clone();
        for row in &mut weighted.forcing {
            for (forcing, weight) in row.iter_mut().zip(&weights) {
                *forcing *= weight;
            }
        }
        weighted
    }

    #[inline]
    fn rate(&self, at: &Rows<STATES>) -> Rows<STATES> {
        let mut rate = self.forcing;
        add_product::<STATES>(&mut rate, &self.dynamics, at);
        rate
    }
}

impl Sensitivity<PARAMETERS> {
    /// Goes on by a step of so many seconds (Runge and Kutta, fourth order), linearised at start, middle and end.
    pub fn follow(&mut self, duration: f64, [start, middle, end]: [&Linearisation; 3]) {
        let h = duration;
        let before: Rows<STATES> = std::array::from_fn(|i| std::array::from_fn(|j| self.0[(i, j)]));
        let after = |rate: &Rows<STATES>, time: f64| {
            let mut after = before;
            add(&mut after, time, rate);
            after
        };
        let k1 = start.rate(&before);
        let k2 = middle.rate(&after(&k1, 0.5 * h));
        let k3 = middle.rate(&after(&k2, 0.5 * h));
        let k4 = end.rate(&after(&k3, h));
        let mut next = after(&k1, h / 6.0);
        add(&mut next, h / 3.0, &k2);
        add(&mut next, h / 3.0, &k3);
        add(&mut next, h / 6.0, &k4);
        self.0 = SMatrix::from_fn(|row, column| next[row][column]);
    }
}

#[inline]
fn add(sum: &mut Rows<STATES>, weight: f64, rows: &Rows<STATES>) {
    for (sum, row) in sum.iter_mut().zip(rows) {
        for k in 0..PARAMETERS {
            sum[k] += weight * row[k];
        }
    }
}

/// Most of an error model is zero.
#[inline]
fn add_product<const M: usize>(
    sum: &mut Rows<STATES>,
    sparse: &SMatrix<f64, STATES, M>,
    rows: &Rows<M>,
) {
    for i in 0..STATES {
        for j in 0..M {
            let weight = sparse[(i, j)];
            if weight != 0.0 {
                for k in 0..PARAMETERS {
                    sum[i][k] += weight * rows[j][k];
                }
            }
        }
    }
}
