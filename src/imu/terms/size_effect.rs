//! Size effect: accelerometers x and y are displaced from accelerometer z by lever arms r_x and r_y and therefore also
//! sense row i of `([ω̇×] + [ω×]²) r_i`. A lever arm common to all three accelerometers is not observable from dwells.

use super::entry::{Columns, REFERENCE_RATE, Sensed, TermEntry, set_rows};
use crate::imu::Sensor;
use crate::units::STANDARD_GRAVITY;

pub const ENTRY: TermEntry = TermEntry {
    name: "size-effect",
    title: "accel lever arm",
    help: "Accelerometers: lever arms between the three sensors",
    adds: "its row of ([w' x] + [w x]^2) r to f, r the lever arm",
    shown_by: "fast turns about each axis",
    sensor: Sensor::Accel,
    unit: ("mm", 1e-3),
    si_unit: "m",
    d_si_unit: "\\metre",
    usual_sigma: 100.0,
    largest: STANDARD_GRAVITY / (REFERENCE_RATE * REFERENCE_RATE),
    // Accelerometer, then component of its lever arm.
    parameters: (
        "accel.lever_arm",
        &[".xx", ".xy", ".xz", ".yx", ".yy", ".yz"],
    ),
    response,
    added: None,
};

fn response(sensed: &Sensed, _: &[f64], columns: &mut Columns) {
    let rate = sensed.rate.cross_matrix();
    let turning = sensed.angular_acceleration.cross_matrix() + rate * rate;
    set_rows(columns, |axis| turning.row(axis).into_owned());
}
