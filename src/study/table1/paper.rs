//! The paper's table as printed (Zhao, Jiang, Li 2016, Table 1), and the readings of it.

use super::quantity::{ByQuantity, Quantity};
use super::reading::{Installation, Kind, Reading};
use super::response::Moments;
use crate::imu::{InstallationForm, Sensor};

/// Samples behind each figure of the table.
pub const SAMPLES: usize = 50;
/// Length of the runs, h.
pub const HOURS: f64 = 40.0;
/// Latitude in degrees. The paper does not state it: its accelerometer rows have heading / roll =
/// tan L = 1.0276.
pub const LATITUDE_DEG: f64 = 45.78;

/// One of the four columns of figures, mean and standard deviation, with the ways to read it.
#[derive(Debug, PartialEq)]
pub struct Published {
    /// Whose calibration errors navigation is given; the other triad is ideal.
    pub sensor: Sensor,
    /// The simplified model that the triad is calibrated by.
    pub form: InstallationForm,
    /// The paper's figures of attitude and of velocity and position.
    pub figures: [u8; 2],
    mean: ByQuantity<f64>,
    std: ByQuantity<f64>,
    /// As the paper states it.
    pub stated: Reading,
    /// Other ways to read it.
    pub others: &'static [Reading],
}

impl Published {
    /// Mean and standard deviation of a quantity, rad, m/s or m.
    pub fn moments(&self) -> ByQuantity<Moments> {
        Quantity::ALL.map(|quantity| Moments {
            mean: self.mean[quantity as usize] * quantity.unit_value(),
            std: self.std[quantity as usize] * quantity.unit_value(),
        })
    }
}

const STATED: Reading = Reading {
    name: "as stated",
    installation: Installation::OfForm,
    angles: 1.0,
    hours: None,
    kind: Kind::Stated,
};
const HALF: Reading = Reading {
    name: "as stated: half differences",
    ..STATED
};
const UPPER: Reading = Reading {
    name: "upper entry of each pair",
    installation: Installation::Upper,
    kind: Kind::Assumption,
    ..STATED
};
const LOWER: Reading = Reading {
    name: "lower entry of each pair",
    installation: Installation::Lower,
    kind: Kind::Assumption,
    ..STATED
};
const WIDE: Reading = Reading {
    name: "angles ±0.2°",
    angles: 2.0,
    kind: Kind::Assumption,
    ..STATED
};
const WIDE_AND_LONG: Reading = Reading {
    name: "angles ±0.2°, 48 h",
    hours: Some(48.0),
    ..WIDE
};
const SLIP: Reading = Reading {
    name: "E_zy of the wrong sign",
    installation: Installation::ZyNegated,
    kind: Kind::Slip,
    ..STATED
};
const LONG_SLIP: Reading = Reading {
    name: "E_zy of the wrong sign, 48 h",
    hours: Some(48.0),
    ..SLIP
};

/// The table in the units of [`Quantity::unit`].
pub static TABLE: [Published; 4] = [
    Published {
        sensor: Sensor::Gyro,
        form: InstallationForm::SixAngle,
        figures: [2, 3],
        mean: [3.22e-4, 2.87e-4, 6.964e-2, 0.5796, 26.24],
        std: [1.749e-4, 1.467e-4, 3.561e-2, 0.2964, 13.43],
        stated: STATED,
        others: &[SLIP, LONG_SLIP],
    },
    Published {
        sensor: Sensor::Gyro,
        form: InstallationForm::ThreeAngle,
        figures: [4, 5],
        mean: [5.493e-3, 5.377e-3, 0.1742, 1.477, 39.42],
        std: [2.755e-3, 2.792e-3, 0.152, 0.7513, 23.81],
        stated: HALF,
        others: &[WIDE, WIDE_AND_LONG, UPPER, LOWER],
    },
    Published {
        sensor: Sensor::Accel,
        form: InstallationForm::SixAngle,
        figures: [6, 7],
        mean: [5.532e-8, 5.524e-8, 5.679e-8, 4.472e-6, 3.894e-6],
        std: [1.457e-7, 1.453e-7, 1.494e-7, 1.177e-5, 1.025e-5],
        stated: STATED,
        others: &[],
    },
    Published {
        sensor: Sensor::Accel,
        form: InstallationForm::ThreeAngle,
        figures: [8, 9],
        mean: [7.505e-2, 7.953e-2, 8.171e-2, 6.559, 5.712],
        std: [4.197e-2, 4.932e-2, 5.069e-2, 3.591, 3.127],
        stated: HALF,
        others: &[UPPER, LOWER],
    },
];
