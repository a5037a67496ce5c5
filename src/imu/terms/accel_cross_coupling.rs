//! Output of an accelerometer with the product of specific force along two axes.

use super::accel_second_order;
use super::entry::{Columns, Sensed, TermEntry};

/// The two components of specific force that are multiplied, in the order of the parameters.
const PRODUCTS: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

pub const ENTRY: TermEntry = TermEntry {
    name: "accel-cross-coupling",
    title: "accel cross coupling",
    help: "Accelerometers: products of specific force along two axes",
    adds: "q times the product of these two of f along its axis to f",
    // Accelerometer, then the components that are multiplied.
    parameters: (
        "accel.cross_coupling",
        &[
            ".x.xy", ".x.xz", ".x.yz", ".y.xy", ".y.xz", ".y.yz", ".z.xy", ".z.xz", ".z.yz",
        ],
    ),
    response,
    ..accel_second_order::ENTRY
};

fn response(sensed: &Sensed, _: &[f64], columns: &mut Columns) {
    for axis in 0..3 {
        for (k, &(one, other)) in PRODUCTS.iter().enumerate() {
            columns[(axis, 3 * axis + k)] = sensed.force[one] * sensed.force[other];
        }
    }
}
