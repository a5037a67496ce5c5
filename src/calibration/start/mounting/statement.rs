//! Message about a wrong axis order, with the corrected line for `run.toml`.

use std::fmt;

use nalgebra::Matrix3;

use crate::attitude::log;
use crate::imu::{AXES, AxisOrder, PerSensor, Sensor};
use crate::recording::{FileColumn, NamedColumns};
use crate::run::Run;
use crate::units::DEGREE;

/// An axis order in `run.toml` that the motion contradicts.
#[derive(Debug, Clone, PartialEq)]
pub struct Mounting {
    /// The correct order of the outputs of each triad, along the right, front and up axes.
    pub orders: PerSensor<AxisOrder>,
    /// Short description of the source of the evidence.
    pub known_from: &'static str,
    /// Natural logarithm of the likelihood ratio in favour of this order.
    pub log_ratio: f64,
    /// The corrected line for `run.toml`.
    pub line: String,
    /// Lines for other axis orders that the recording cannot distinguish from this order.
    pub others: Vec<String>,
    /// Whether a latitude of opposite sign would explain the motion equally well.
    pub or_latitude: bool,
    /// Triads whose `[imu.prior]` contains values that differ between axes, or biases whose sign changes if a column is
    /// reversed.
    pub prior_differs: Vec<Sensor>,
}

impl fmt::Display for Mounting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the axes in run.toml are wrong: {} (e^{:.0} times more likely, from {}). In [imu] of run.toml, \
             write\n  {}",
            said(&self.orders),
            self.log_ratio,
            self.known_from,
            self.line
        )?;
        if !self.others.is_empty() {
            write!(
                f,
                "\nThis recording cannot distinguish these axes from\n  {}",
                self.others.join("\n  ")
            )?;
        }
        if self.or_latitude {
            f.write_str("\nA latitude of the opposite sign would explain the data equally well.")?;
        }
        for sensor in &self.prior_differs {
            write!(
                f,
                "\n[imu.prior.{}] refers to the columns in their new order and with their new signs. If scale and \
                 bias were given for the individual columns, rearrange them in the same way.",
                sensor.name()
            )?;
        }
        Ok(())
    }
}

/// The error in words.
fn said(orders: &PerSensor<AxisOrder>) -> String {
    let PerSensor { gyro, accel } = orders;
    if gyro == accel && gyro.is_rotation() {
        return format!(
            "both triads are rotated together by {}",
            turn(&gyro.matrix())
        );
    }
    if gyro == accel {
        return format!(
            "both triads are left-handed in the same way, {}",
            axes(Sensor::Gyro, gyro)
        );
    }
    let triads = Sensor::ALL.into_iter();
    let wrong = triads.filter(|&sensor| *orders.get(sensor) != AxisOrder::IDENTITY);
    let parts: Vec<String> = wrong
        .map(|sensor| of_triad(sensor, orders.get(sensor)))
        .collect();
    parts.join("; ")
}

/// Angle and axis of a rotation, such as `90° about z`.
fn turn(rotation: &Matrix3<f64>) -> String {
    let turn = log(rotation);
    let angle = turn.norm();
    let axis = turn / angle;
    let largest = axis.iamax();
    let positive = axis * axis[largest].signum();
    if positive[largest] > 0.999 {
        // Half a turn has no sign.
        let signed = if angle > 179.0 * DEGREE {
            angle
        } else {
            angle * axis[largest].signum()
        };
        return format!("{:.0}° about {}", signed / DEGREE, AXES[largest]);
    }
    let [x, y, z] = [axis.x, axis.y, axis.z];
    format!("{:.0}° about ({x:.2}, {y:.2}, {z:.2})", angle / DEGREE)
}

/// A description such as `gyro x is read as −y, gyro y is read as x (rotated by 90° about z)`.
fn of_triad(sensor: Sensor, order: &AxisOrder) -> String {
    let how = if order.is_rotation() {
        format!("rotated by {}", turn(&order.matrix()))
    } else {
        "left-handed".to_owned()
    };
    format!("{} ({how})", axes(sensor, order))
}

fn axes(sensor: Sensor, order: &AxisOrder) -> String {
    let name = sensor.name();
    let axes: Vec<String> = order
        .changed()
        .map(|axis| {
            let sign = if order.reversed[axis] { "−" } else { "" };
            let source = AXES[order.source[axis]];
            format!("{name} {} is read as {sign}{source}", AXES[axis])
        })
        .collect();
    axes.join(", ")
}

/// The line for `run.toml`, or the orders by name for a simulated run.
pub fn line(run: &Run, orders: &PerSensor<AxisOrder>) -> String {
    // A negative nominal scale already reverses the input.
    let as_columns = PerSensor::from_fn(|sensor| {
        let nominal = run.instrument.nominal.get(sensor).0;
        let mut order = *orders.get(sensor);
        for axis in 0..3 {
            order.reversed[axis] ^= nominal[axis] * nominal[order.source[axis]] < 0.0;
        }
        order
    });
    match &run.recording.imu.log {
        Some(log) => log.named.line(&as_columns),
        None => made().line(&as_columns),
    }
}

/// The columns of a run without a file.
fn made() -> NamedColumns {
    let of_triad = |sensor: Sensor| {
        AXES.map(|axis| FileColumn {
            name: format!("{}.{axis}", sensor.name()),
            reversed: false,
        })
    };
    NamedColumns {
        time: None,
        triads: PerSensor::from_fn(of_triad),
        temperature: None,
        axes: AxisOrder::IDENTITY,
    }
}

/// Triads whose prior must be rearranged together with the columns.
pub fn prior_differs(run: &Run, orders: &PerSensor<AxisOrder>) -> Vec<Sensor> {
    let differs = |&sensor: &Sensor| {
        let order = orders.get(sensor);
        let nominal = run.instrument.nominal.get(sensor).0.abs();
        let bias = run.instrument.prior.get(sensor).bias;
        let placed = |axis: usize| nominal[order.source[axis]] != nominal[axis];
        order.apply(&bias) != bias || (0..3).any(placed)
    };
    Sensor::ALL.into_iter().filter(differs).collect()
}
