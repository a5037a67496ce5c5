//! Output of a gyro with the square of its rate: even in the rate, as an asymmetry is.

use super::asymmetry;
use super::entry::{Effect, REFERENCE_RATE, TermEntry, per_axis};
use crate::units::PPM;

pub const ENTRY: TermEntry = TermEntry {
    name: "gyro-second-order",
    title: "gyro second order",
    help: "Gyros: square of angular rate",
    adds: "q w^2 / r along its axis to w, r = 100 deg/s",
    unit: ("ppm at 100 °/s", PPM),
    parameters: per_axis!("gyro.second_order"),
    effect: Effect::Linear(|sensed, columns| {
        columns.set_diagonal(&sensed.rate.map(|w| w * (w / REFERENCE_RATE)));
    }),
    ..asymmetry::GYRO
};
