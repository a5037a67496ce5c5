//! Statistics of a log, computed while it is read.

use serde::Serialize;

use crate::imu::{AxisOrder, Output, PerSensor, Sensor};
use turncal_input::FileColumn;

/// Statistics of the instrument's file, in its own units.
#[derive(Debug, Clone, PartialEq)]
pub struct LogFacts {
    /// Rows in the file.
    pub rows: usize,
    /// Quantity of the samples.
    pub output: Output,
    /// RMS deviation of the time stamps from the uniform clock, s.
    pub jitter_rms: f64,
    /// The largest of these deviations, s.
    pub jitter_max: f64,
    /// Period of the time stamps relative to the stated period, minus one, if they contradict each other and
    /// the stamps were used.
    pub off_stated_period: Option<f64>,
    /// The columns of each triad along the body axes right, front and up, with values as in the file.
    pub columns: PerSensor<[ColumnFacts; 3]>,
    /// The columns as given in `run.toml`.
    pub named: NamedColumns,
    /// The temperature column, if there is one.
    pub temperature: Option<TemperatureFacts>,
}

/// The columns as given in `run.toml`.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedColumns {
    /// Time column, if there is one.
    pub time: Option<String>,
    /// Columns of both triads, along the axes of the file.
    pub triads: PerSensor<[FileColumn; 3]>,
    /// Temperature column, if there is one.
    pub temperature: Option<String>,
    /// Axis order from the axes of the file to right-front-up.
    pub axes: AxisOrder,
}

impl NamedColumns {
    /// The columns of both triads along the right, front and up axes of the body, with a minus sign if the sign is
    /// reversed; `None` if a triad was not recorded.
    pub fn along_body(&self) -> Option<PerSensor<[String; 3]>> {
        let of = |sensor: Sensor| {
            [0, 1, 2].map(|axis| {
                let FileColumn { name, reversed } =
                    &self.triads.get(sensor)[self.axes.source[axis]];
                let minus = *reversed != self.axes.reversed[axis];
                format!("{}{name}", if minus { "-" } else { "" })
            })
        };
        let is_named = |columns: &[FileColumn; 3]| columns.iter().all(|of| !of.name.is_empty());
        let both = is_named(&self.triads.gyro) && is_named(&self.triads.accel);
        both.then(|| PerSensor::from_fn(of))
    }

    /// The line of `run.toml` that reads the samples of each triad in another order, given along
    /// right-front-up.
    pub fn line(&self, orders: &PerSensor<AxisOrder>) -> String {
        let mut fields = Vec::new();
        let quoted = |name: &str| toml::Value::from(name).to_string();
        fields.extend(
            self.time
                .iter()
                .map(|name| format!("time = {}", quoted(name))),
        );
        for sensor in Sensor::ALL {
            let of_file = self
                .axes
                .inverse()
                .after(&orders.get(sensor).after(&self.axes));
            let columns = self.triads.get(sensor);
            let names = [0, 1, 2].map(|axis| {
                let FileColumn { name, reversed } = &columns[of_file.source[axis]];
                let minus = *reversed != of_file.reversed[axis];
                quoted(&format!("{}{name}", if minus { "-" } else { "" }))
            });
            fields.push(format!("{} = [{}]", sensor.name(), names.join(", ")));
        }
        let temperature = self.temperature.iter();
        fields.extend(temperature.map(|name| format!("temperature = {}", quoted(name))));
        format!("columns = {{ {} }}", fields.join(", "))
    }
}

/// One column of samples.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct ColumnFacts {
    /// Name in the file.
    pub name: String,
    /// The smallest value.
    pub smallest: f64,
    /// Number of rows with the smallest value.
    pub at_smallest: usize,
    /// The largest value.
    pub largest: f64,
    /// Number of rows with the largest value.
    pub at_largest: usize,
    /// The step of the grid on which all values lie, if there is one.
    pub step: Option<f64>,
    /// The angle or velocity that one unit of the column in a row represents, rad or m/s, from the nominal scale.
    #[serde(skip)]
    pub unit: f64,
}

/// A column of temperatures, °C.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TemperatureFacts {
    /// The smallest value.
    pub smallest: f64,
    /// The mean.
    pub mean: f64,
    /// The largest value.
    pub largest: f64,
}

impl ColumnFacts {
    /// Statistics of a column that is not empty.
    pub fn of(name: &str, values: &[f64], unit: f64) -> Self {
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let ends = values
            .iter()
            .fold(ends, |(low, high), &v| (low.min(v), high.max(v)));
        let count = |end: f64| values.iter().filter(|&&value| value == end).count();
        Self {
            name: name.to_owned(),
            smallest: ends.0,
            at_smallest: count(ends.0),
            largest: ends.1,
            at_largest: count(ends.1),
            step: grid_step(values),
            unit,
        }
    }

    /// The step as a rate, rad/s or m/s², of samples of this length, s.
    pub fn step_rate(&self, period: f64) -> Option<f64> {
        Some((self.step? * self.unit / period).abs())
    }
}

impl ColumnFacts {
    /// Combines the statistics with those of the following rows.
    pub fn and(self, later: &Self) -> Self {
        let smallest = self.smallest.min(later.smallest);
        let largest = self.largest.max(later.largest);
        let count = |of: [(f64, usize); 2], end: f64| {
            let at_end = of.into_iter().filter(|(value, _)| *value == end);
            at_end.map(|(_, count)| count).sum()
        };
        let at_smallest = [&self, later].map(|of| (of.smallest, of.at_smallest));
        let at_largest = [&self, later].map(|of| (of.largest, of.at_largest));
        let constant = |of: &Self| of.smallest == of.largest;
        let step = match (self.step, later.step) {
            (step, _) if constant(later) => step,
            (_, step) if constant(&self) => step,
            (Some(one), Some(other)) => {
                let (fine, coarse) = (one.min(other), one.max(other));
                let steps = coarse / fine;
                ((steps - steps.round()).abs() <= OFF_GRID).then_some(fine)
            }
            _ => None,
        };
        Self {
            at_smallest: count(at_smallest, smallest),
            at_largest: count(at_largest, largest),
            name: self.name,
            smallest,
            largest,
            step,
            unit: later.unit,
        }
    }
}

/// Values are on a grid if no difference of consecutive values deviates by more than this part of a step from a
/// multiple of the step.
const OFF_GRID: f64 = 0.05;
/// A range with more steps than this belongs to a floating-point number, not to a register.
const MOST_STEPS: f64 = 4_294_967_296.0;

fn grid_step(values: &[f64]) -> Option<f64> {
    if values.iter().all(|value| value.fract() == 0.0) {
        return Some(1.0);
    }
    let differences = || {
        let pairs = values.windows(2).map(|pair| (pair[1] - pair[0]).abs());
        pairs.filter(|&difference| difference > 0.0)
    };
    let mut step = differences().reduce(f64::min)?;
    let mut most = 1.0;
    for difference in differences() {
        let steps = (difference / step).round();
        if steps > MOST_STEPS || (difference / step - steps).abs() > OFF_GRID {
            return None;
        }
        // Printed values are rounded; a long difference gives the step more accurately.
        if steps > most {
            (step, most) = (difference / steps, steps);
        }
    }
    Some(step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_is_seen_through_rounded_digits() {
        let rounded = |value: f64| (value * 1e9).round() / 1e9;
        let value = |k: i32| rounded(f64::from(k * k % 201 - 100) / 16.384);
        let values: Vec<f64> = (0..1000).map(value).collect();
        let step = ColumnFacts::of("gx", &values, 1.0).step.unwrap();
        assert!((step * 16.384 - 1.0).abs() < 1e-6, "{step}");
    }

    #[test]
    fn a_number_of_all_digits_is_on_no_grid() {
        let values: Vec<f64> = (0..1000).map(|k| f64::from(k).sin()).collect();
        assert_eq!(ColumnFacts::of("gx", &values, 1.0).step, None);
    }

    #[test]
    fn columns_are_named_along_the_axes_of_the_file() {
        let column = |name: &str| FileColumn {
            name: name.to_owned(),
            reversed: name == "wz",
        };
        // Front, right, down.
        let named = NamedColumns {
            time: Some("t".to_owned()),
            triads: PerSensor {
                gyro: ["wx", "wy", "wz"].map(column),
                accel: ["fx", "fy", "fz"].map(column),
            },
            temperature: None,
            axes: AxisOrder {
                source: [1, 0, 2],
                reversed: [false, false, true],
            },
        };
        let as_it_is = named.line(&PerSensor {
            gyro: AxisOrder::IDENTITY,
            accel: AxisOrder::IDENTITY,
        });
        let expected =
            r#"columns = { time = "t", gyro = ["wx", "wy", "-wz"], accel = ["fx", "fy", "fz"] }"#;
        assert_eq!(as_it_is, expected);
        let along_body = named.along_body().unwrap();
        assert_eq!(along_body.gyro, ["wy", "wx", "wz"]);
        assert_eq!(along_body.accel, ["fy", "fx", "-fz"]);
        // Right is to be what comes in as up: y of the file is what it gives as −z.
        let turned = named.line(&PerSensor {
            gyro: AxisOrder {
                source: [2, 1, 0],
                reversed: [false; 3],
            },
            accel: AxisOrder::IDENTITY,
        });
        assert!(turned.contains(r#"gyro = ["wx", "wz", "-wy"]"#), "{turned}");
    }
}
