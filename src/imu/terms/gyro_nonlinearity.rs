//! Dependence of a gyro's scale factor on the magnitude of the rate, by terms of second and third order that are odd in
//! the rate.

use super::entry::{Columns, REFERENCE_RATE, Sensed, TermEntry};
use super::gyro_second_order;

pub const ENTRY: TermEntry = TermEntry {
    name: "gyro-nonlinearity",
    title: "gyro nonlinearity",
    help: "Gyros: scale factor that changes with the magnitude of the angular rate",
    adds: "q |w| w / r (odd quadratic), q w^3 / r^2 (third order) along its axis to w, r = 100 deg/s",
    shown_by: "turns about each axis at three rates",
    parameters: (
        "gyro",
        &[
            ".odd_quadratic.x",
            ".odd_quadratic.y",
            ".odd_quadratic.z",
            ".third_order.x",
            ".third_order.y",
            ".third_order.z",
        ],
    ),
    response,
    ..gyro_second_order::ENTRY
};

fn response(sensed: &Sensed, _: &[f64], columns: &mut Columns) {
    for (axis, &w) in sensed.rate.iter().enumerate() {
        let relative = w / REFERENCE_RATE;
        columns[(axis, axis)] = w * relative.abs();
        columns[(axis, 3 + axis)] = w * relative * relative;
    }
}
