//! Accelerometer output proportional to the product of specific force along two axes.

use nalgebra::RowVector3;

use super::accel_second_order;
use super::entry::{TermEntry, set_rows};

pub const ENTRY: TermEntry = TermEntry {
    name: "accel-cross-coupling",
    title: "accel cross coupling",
    help: "Accelerometers: products of the specific forces along two axes",
    adds: "q times the product of these two components of f is added to f along its axis",
    shown_by: "dwells with two axes 45° up",
    // Accelerometer, then the components that are multiplied.
    parameters: (
        "accel.cross_coupling",
        &[
            ".x.xy", ".x.xz", ".x.yz", ".y.xy", ".y.xz", ".y.yz", ".z.xy", ".z.xz", ".z.yz",
        ],
    ),
    response: |sensed, _, columns| {
        let f = sensed.force;
        set_rows(columns, |_| {
            RowVector3::new(f.x * f.y, f.x * f.z, f.y * f.z)
        });
    },
    ..accel_second_order::ENTRY
};
