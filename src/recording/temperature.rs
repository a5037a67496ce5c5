//! Temperature of the instrument during a recording.

use nalgebra::{Matrix3, Vector3};

use crate::imu::{PerSensor, Sensor, ThermalRange};

/// Time between two knots, s.
pub const SPACING: f64 = 1.0;
/// Number of knots on each side used for value and slope at a knot: half a minute is below the thermal time
/// constants of cases, but averages the noise of a sensor.
const OVER: usize = 30;

/// Temperature as a function of time: one sensor for all axes, or several.
#[derive(Debug, Clone, PartialEq)]
pub struct Temperature {
    /// Time of the first knot, s.
    start: f64,
    channels: Vec<Channel>,
    /// The channel of each axis.
    of: PerSensor<[usize; 3]>,
}

/// One temperature sensor.
#[derive(Debug, Clone, PartialEq)]
struct Channel {
    /// Values at the knots, °C.
    values: Vec<f64>,
    /// Slopes at the knots, K/s.
    rates: Vec<f64>,
}

impl Temperature {
    /// Temperatures in °C from means over consecutive spans of [`SPACING`], the first of which is centred on `start`;
    /// `of` is the index of the sensor for each axis. `None` if there are no values, or if an axis has no sensor.
    pub fn new(start: f64, channels: Vec<Vec<f64>>, of: PerSensor<[usize; 3]>) -> Option<Self> {
        let has_values = |values: &Vec<f64>| !values.is_empty();
        let known = |&channel: &usize| channels.get(channel).is_some_and(has_values);
        let all = Sensor::ALL.into_iter();
        all.clone()
            .all(|sensor| of.get(sensor).iter().all(known))
            .then(|| Self {
                start,
                channels: channels.into_iter().map(Channel::new).collect(),
                of,
            })
    }

    /// A constant temperature, °C.
    pub fn constant(temperature: f64) -> Self {
        Self {
            start: 0.0,
            channels: vec![Channel::new(vec![temperature])],
            of: PerSensor::default(),
        }
    }

    /// Temperature of each axis at a time, °C; constant before the first knot and after the last.
    pub fn at(&self, time: f64) -> PerSensor<[f64; 3]> {
        self.of_axes(time, |channel| &channel.values)
    }

    /// Temperature rate of each axis at a time, K/s.
    pub fn rate(&self, time: f64) -> PerSensor<[f64; 3]> {
        self.of_axes(time, |channel| &channel.rates)
    }

    /// Temperature range of some recordings, whose middle is the reference temperature of the parameters.
    pub fn seen<'a>(all: impl Iterator<Item = &'a Self> + Clone) -> PerSensor<ThermalRange> {
        PerSensor::from_fn(|sensor| {
            let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
            let mut largest_rate = 0.0f64;
            for temperature in all.clone() {
                let [low, high] = temperature.range(sensor);
                (lowest, highest) = (lowest.min(low), highest.max(high));
                largest_rate = largest_rate.max(temperature.largest_rate(sensor));
            }
            ThermalRange {
                lowest,
                highest,
                reference: 0.5 * (lowest + highest),
                largest_rate,
            }
        })
    }

    /// The lowest and the highest temperature of the axes of a triad, °C.
    pub fn range(&self, sensor: Sensor) -> [f64; 2] {
        self.extremes(sensor, |channel| &channel.values)
    }

    /// The largest magnitude of the temperature rate on the axes of a triad, K/s.
    pub fn largest_rate(&self, sensor: Sensor) -> f64 {
        let [lowest, highest] = self.extremes(sensor, |channel| &channel.rates);
        highest.max(-lowest)
    }

    fn of_axes(&self, time: f64, series: impl Fn(&Channel) -> &Vec<f64>) -> PerSensor<[f64; 3]> {
        let at = (time - self.start) / SPACING;
        PerSensor::from_fn(|sensor| {
            self.of
                .get(sensor)
                .map(|channel| between(series(&self.channels[channel]), at))
        })
    }

    fn extremes(&self, sensor: Sensor, series: impl Fn(&Channel) -> &Vec<f64>) -> [f64; 2] {
        let channels = self.of.get(sensor).iter();
        let values = channels.flat_map(|&channel| series(&self.channels[channel]));
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &value| {
            [low.min(value), high.max(value)]
        })
    }
}

impl Channel {
    fn new(values: Vec<f64>) -> Self {
        let (values, rates) = (0..values.len()).map(|k| parabola(&values, k)).unzip();
        Self { values, rates }
    }
}

/// Value and slope per s, at a knot, of the parabola through the surrounding knots: linear interpolation would round
/// the corners of a ramp by hundredths of a kelvin.
fn parabola(values: &[f64], knot: usize) -> (f64, f64) {
    let over = knot.saturating_sub(OVER)..(knot + OVER + 1).min(values.len());
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for k in over.clone() {
        let from = (k as f64 - knot as f64) / OVER as f64;
        let row = Vector3::new(1.0, from, from * from);
        normal += row * row.transpose();
        right += row * (values[k] - values[knot]);
    }
    // Two values define a line, one value a constant.
    let degree = over.len().min(3);
    for k in degree..3 {
        normal.fill_row(k, 0.0);
        normal.fill_column(k, 0.0);
        normal[(k, k)] = 1.0;
        right[k] = 0.0;
    }
    let solved = normal.cholesky().map(|factor| factor.solve(&right));
    let of = solved.unwrap_or_default();
    (values[knot] + of[0], of[1] / (OVER as f64 * SPACING))
}

/// Linear interpolation between two knots; constant beyond the ends.
fn between(values: &[f64], at: f64) -> f64 {
    let last = values.len() - 1;
    let at = at.clamp(0.0, last as f64);
    let knot = (at as usize).min(last.saturating_sub(1));
    let next = (knot + 1).min(last);
    let part = at - knot as f64;
    values[knot] + (values[next] - values[knot]) * part
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn a_ramp_has_its_value_and_its_rate_everywhere_and_stays_beyond_its_ends() {
        let ramp = (0..600).map(|k| 20.0 + 0.01 * f64::from(k)).collect();
        let temperature = Temperature::new(5.0, vec![ramp], PerSensor::default()).unwrap();
        assert_relative_eq!(temperature.at(105.25).gyro[2], 21.0025, epsilon = 1e-12);
        assert_relative_eq!(temperature.rate(5.0).accel[0], 0.01, epsilon = 1e-12);
        assert_relative_eq!(temperature.at(-100.0).gyro[0], 20.0, epsilon = 1e-12);
        assert_relative_eq!(temperature.at(1e9).gyro[0], 25.99, epsilon = 1e-12);
        assert_relative_eq!(temperature.range(Sensor::Gyro)[0], 20.0, epsilon = 1e-12);
    }

    #[test]
    fn a_corner_of_a_ramp_is_followed_as_a_case_rounds_it() {
        // A chamber that begins to warm by 0.02 K/s, and a case behind it by two minutes.
        let case = |t: f64| match t - 600.0 {
            since if since > 0.0 => 0.02 * (since - 120.0 * (1.0 - (-since / 120.0).exp())),
            _ => 0.0,
        };
        let values: Vec<f64> = (0..1800).map(|k| case(f64::from(k))).collect();
        let temperature = Temperature::new(0.0, vec![values], PerSensor::default()).unwrap();
        for k in 640..1700 {
            let off = temperature.at(f64::from(k)).gyro[0] - case(f64::from(k));
            assert!(off.abs() < 1e-3, "{off} K at {k} s");
        }
    }

    #[test]
    fn each_axis_has_the_sensor_that_it_is_given() {
        let of = PerSensor {
            gyro: [0, 1, 0],
            accel: [1, 1, 1],
        };
        let channels = vec![vec![10.0, 12.0], vec![30.0, 30.0]];
        let temperature = Temperature::new(0.0, channels.clone(), of).unwrap();
        for (axis, expected) in [11.0, 30.0, 11.0].into_iter().enumerate() {
            assert_relative_eq!(temperature.at(0.5).gyro[axis], expected, epsilon = 1e-12);
        }
        // What does not change has no rate at all.
        assert_eq!(temperature.rate(0.5).accel, [0.0; 3]);
        let missing = PerSensor {
            gyro: [0, 1, 2],
            accel: [0; 3],
        };
        assert_eq!(Temperature::new(0.0, channels, missing), None);
    }
}
