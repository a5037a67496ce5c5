//! Temperature dependence of a triad. Each parameter is a polynomial in temperature; biases may also depend on the
//! temperature rate.
//!
//! `θ(T) = θ + Σ_k c_k B_k`, with `B_k = P_k(τ(T)) − P_k(τ(T_ref))` for the orders k from one on, P Legendre, τ the
//! temperature scaled to [−1, 1] over the recorded range, and a last B equal to dT/dt over its largest recorded
//! magnitude. Thus θ is the parameter at a constant reference temperature, and each c is as large as its effect within
//! the range.

use nalgebra::{SMatrix, SVector};

use super::{PARAMETERS, PerSensor, Sensor, Triad};

/// Highest order of the polynomials.
pub const HIGHEST_ORDER: usize = 5;
/// Number of temperature functions: the orders from one on, then the rate.
pub const THERMAL_FUNCTIONS: usize = HIGHEST_ORDER + 1;
/// Index of the rate among the functions.
pub const RATE: usize = HIGHEST_ORDER;

/// Values of all functions at one time.
pub type ThermalValues = SVector<f64, THERMAL_FUNCTIONS>;
/// Coefficients of one triad: a row for each parameter, a column for each function.
pub type ThermalCoefficients = SMatrix<f64, PARAMETERS, THERMAL_FUNCTIONS>;
/// Values of all functions at one time, for the axes x, y and z of both triads.
pub type ThermalState = PerSensor<[ThermalValues; 3]>;

/// The temperature range in which the polynomials of a triad are valid.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ThermalRange {
    /// The lowest temperature, °C.
    #[serde(rename = "lowest_degc")]
    pub lowest: f64,
    /// The highest temperature, °C.
    #[serde(rename = "highest_degc")]
    pub highest: f64,
    /// Reference temperature of the parameters, °C.
    #[serde(rename = "reference_degc")]
    pub reference: f64,
    /// The largest magnitude of the temperature rate, K/s.
    #[serde(rename = "largest_rate_k_per_s")]
    pub largest_rate: f64,
}

impl ThermalRange {
    /// Minimum half span of a range, so that an empty range can be scaled, K.
    const LEAST: f64 = 0.5;

    /// The range scaled to [−1, 1].
    fn scaled(&self, temperature: f64) -> f64 {
        let middle = 0.5 * (self.lowest + self.highest);
        let half = (0.5 * (self.highest - self.lowest)).max(Self::LEAST);
        (temperature - middle) / half
    }

    /// All functions at a temperature in °C and its rate of change in K/s.
    pub fn values(&self, temperature: f64, rate: f64) -> ThermalValues {
        let here = legendre(self.scaled(temperature));
        let there = legendre(self.scaled(self.reference));
        let mut values = ThermalValues::zeros();
        for order in 1..=HIGHEST_ORDER {
            values[order - 1] = here[order] - there[order];
        }
        if self.largest_rate > 0.0 {
            values[RATE] = rate / self.largest_rate;
        }
        values
    }

    /// Whether a temperature lies within the range, with a tolerance for the noise of its sensor, K.
    pub fn contains(&self, temperature: f64, tolerance: f64) -> bool {
        (self.lowest - tolerance..=self.highest + tolerance).contains(&temperature)
    }
}

/// The functions of both triads at temperatures in °C that change at these rates in K/s.
pub fn thermal_state(
    ranges: &PerSensor<ThermalRange>,
    temperatures: &PerSensor<[f64; 3]>,
    rates: &PerSensor<[f64; 3]>,
) -> ThermalState {
    PerSensor::from_fn(|sensor| {
        let (t, rate) = (temperatures.get(sensor), rates.get(sensor));
        [0, 1, 2].map(|axis| ranges.get(sensor).values(t[axis], rate[axis]))
    })
}

/// The functions of both triads if all axes have the same temperature in °C and temperature rate in K/s.
pub fn thermal_state_everywhere(
    ranges: &PerSensor<ThermalRange>,
    temperature: f64,
    rate: f64,
) -> ThermalState {
    PerSensor::from_fn(|sensor| [ranges.get(sensor).values(temperature, rate); 3])
}

/// P₀ to the highest order (Bonnet's recursion).
fn legendre(x: f64) -> [f64; HIGHEST_ORDER + 1] {
    let mut p = [1.0; HIGHEST_ORDER + 1];
    p[1] = x;
    for k in 1..HIGHEST_ORDER {
        let n = k as f64;
        p[k + 1] = ((2.0 * n + 1.0) * x * p[k] - n * p[k - 1]) / (n + 1.0);
    }
    p
}

impl Triad {
    /// The triad at these values of the temperature functions on its axes.
    pub fn warmed(&self, coefficients: &ThermalCoefficients, values: &[ThermalValues; 3]) -> Self {
        let mut v = self.to_vector();
        for (parameter, of) in coefficients.row_iter().enumerate() {
            // A parameter follows the temperature of the axis whose output it affects.
            if let Some(axis) = Self::axis(self.form, parameter) {
                v[parameter] += of.transpose().dot(&values[axis]);
            }
        }
        Self::from_vector(self.form, &v)
    }
}

/// The estimated temperature dependence of an instrument.
#[derive(Debug, Clone, PartialEq)]
pub struct ThermalModel {
    /// Temperature range of each triad's polynomials.
    pub range: PerSensor<ThermalRange>,
    /// Prior 1σ of every coefficient, whose prior mean is zero; 0 if the coefficient is off.
    pub sigma: PerSensor<ThermalCoefficients>,
}

impl ThermalModel {
    /// Triad, parameter and function of each enabled coefficient.
    pub fn on(&self) -> impl Iterator<Item = (Sensor, usize, usize)> + '_ {
        // Column by column.
        let of_triad = move |sensor| {
            let places =
                (0..PARAMETERS * THERMAL_FUNCTIONS).map(|k| (k % PARAMETERS, k / PARAMETERS));
            let on = places.filter(move |&place| self.sigma.get(sensor)[place] > 0.0);
            on.map(move |(parameter, function)| (sensor, parameter, function))
        };
        Sensor::ALL.into_iter().flat_map(of_triad)
    }
}

/// Converts a parameter's coefficients to those of powers of `T − reference` in K, from the first
/// power on.
pub fn powers(range: &ThermalRange, coefficients: &ThermalValues) -> [f64; HIGHEST_ORDER] {
    // Newton's divided differences at as many temperatures as there are coefficients, and the reference.
    const NODES: usize = HIGHEST_ORDER + 1;
    let span = (range.highest - range.lowest).max(1.0);
    let node = |k: usize| span * (k as f64) / HIGHEST_ORDER as f64;
    let last = node(HIGHEST_ORDER);
    let vandermonde =
        SMatrix::<f64, NODES, NODES>::from_fn(|row, column| (node(row) / last).powi(column as i32));
    let values = SVector::<f64, NODES>::from_fn(|row, _| {
        coefficients.dot(&range.values(range.reference + node(row), 0.0))
    });
    let scaled = vandermonde.lu().solve(&values).unwrap_or_default();
    std::array::from_fn(|k| scaled[k + 1] / last.powi(k as i32 + 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imu::InstallationForm;
    use approx::assert_relative_eq;

    const RANGE: ThermalRange = ThermalRange {
        lowest: -20.0,
        highest: 60.0,
        reference: 25.0,
        largest_rate: 0.02,
    };

    #[test]
    fn at_the_reference_a_parameter_is_itself_whatever_its_coefficients() {
        assert_eq!(RANGE.values(25.0, 0.0), ThermalValues::zeros());
        assert_relative_eq!(RANGE.values(25.0, -0.01)[RATE], -0.5);
    }

    #[test]
    fn any_polynomial_of_temperature_has_its_coefficients() {
        // Of 3 + 2 t − t³ with t in units of the range, by the values that Legendre's polynomials have.
        let cubic = |temperature: f64| {
            let t = (temperature - 20.0) / 40.0;
            3.0 + 2.0 * t - t.powi(3)
        };
        // t³ = (2 P₃ + 3 P₁) / 5
        let mut c = ThermalValues::zeros();
        c[0] = 2.0 - 0.6;
        c[2] = -0.4;
        for temperature in [-20.0, 0.0, 31.0, 60.0] {
            let change = c.dot(&RANGE.values(temperature, 0.0));
            assert_relative_eq!(change, cubic(temperature) - cubic(25.0), epsilon = 1e-12);
        }
        let powers = powers(&RANGE, &c);
        let by = 17.0;
        let sum: f64 = (1..).zip(powers).map(|(k, c)| c * f64::powi(by, k)).sum();
        assert_relative_eq!(sum, cubic(42.0) - cubic(25.0), epsilon = 1e-10);
    }

    #[test]
    fn a_parameter_follows_the_temperature_of_its_own_axis() {
        let form = InstallationForm::General;
        let mut coefficients = ThermalCoefficients::zeros();
        coefficients[(1, 0)] = 1e-3;
        coefficients[(PARAMETERS - 1, 1)] = 0.5;
        let values = [-20.0, 60.0, 25.0].map(|t| RANGE.values(t, 0.0));
        let warmed = Triad::ideal(form).warmed(&coefficients, &values);
        assert_relative_eq!(warmed.scale.y, 1.0 + 1e-3 * (1.0 - 0.125), epsilon = 1e-15);
        assert_eq!((warmed.scale.x, warmed.bias.z), (1.0, 0.0));
    }
}
