//! Gyro bias proportional to the square of specific force along its axis, for example from a suspension or resonator
//! that yields under load.
//!
//! Source: IEEE Std 528-2019, acceleration-squared-sensitive drift rate (second power of one component). Products of
//! two components are not included. |f|² is not included either, because it is the same in every dwell on Earth and is
//! therefore part of the bias.

use super::entry::{PER_AXIS, REFERENCE_RATE, TermEntry};
use crate::imu::Sensor;
use crate::units::{DEG_PER_H, STANDARD_GRAVITY};

pub const ENTRY: TermEntry = TermEntry {
    name: "g2-sensitivity",
    title: "gyro g²-sensitivity",
    help: "Gyros: square of specific force",
    adds: "q f^2 along its axis to w",
    shown_by: "long dwells with each axis up, down and level",
    sensor: Sensor::Gyro,
    unit: ("°/h/g²", DEG_PER_H / (STANDARD_GRAVITY * STANDARD_GRAVITY)),
    si_unit: "(rad/s)/(m/s^2)^2",
    d_si_unit: "\\radian\\second\\tothe{3}\\metre\\tothe{-2}",
    // A wheel of mass M and angular momentum H on stiffnesses whose compliances differ by ΔC drifts by M² ΔC g² / H:
    // with 50 g, 0.1 kg m²/s and 2 % of 10⁻⁶ m/N this is 0.01 °/h. The usual σ is ten times this value.
    usual_sigma: 0.1,
    largest: REFERENCE_RATE / (STANDARD_GRAVITY * STANDARD_GRAVITY),
    parameters: ("gyro.g2_sensitivity", &PER_AXIS),
    response: |sensed, _, columns| columns.set_diagonal(&sensed.force.map(|f| f.powi(2))),
    added: None,
};
