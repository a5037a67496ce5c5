//! The table as printed in the paper (Zhao, Jiang, Li 2016, Table 1), and its possible readings.

use nalgebra::Vector3;

use super::quantity::{ByQuantity, Moments};
use crate::calibration::{Position, six_position_triad};
use crate::imu::{InstallationForm, Sensor, Triad};

/// Number of samples behind each figure of the table.
pub const SAMPLES: usize = 50;
/// Length of the runs, h.
pub const HOURS: f64 = 40.0;
/// Latitude in degrees. The latitude, which the paper does not state, follows from its accelerometer rows, where
/// heading / roll = tan L = 1.0276.
pub const LATITUDE_DEG: f64 = 45.78;

/// One of the four columns of figures, mean and standard deviation, with its possible readings.
#[derive(Debug, PartialEq)]
pub struct Published {
    /// The triad with calibration errors; the other triad is ideal.
    pub sensor: Sensor,
    /// The simplified form used for calibration.
    pub form: InstallationForm,
    /// The figures in the paper for attitude, velocity and position.
    pub figures: [u8; 2],
    mean: ByQuantity<f64>,
    std: ByQuantity<f64>,
    /// The reading stated in the paper.
    pub stated: Reading,
    /// Other readings.
    pub others: &'static [Reading],
}

impl Published {
    /// Mean and standard deviation of each quantity in its unit.
    pub fn moments(&self) -> ByQuantity<Moments> {
        let of = |q: usize| Moments {
            mean: self.mean[q],
            std: self.std[q],
        };
        std::array::from_fn(of)
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

/// The table in the usual units of [`super::QUANTITIES`].
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

/// A possible reading of the paper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Description.
    pub name: &'static str,
    /// Treatment of the entries of `K C`.
    pub installation: Installation,
    /// Factor applied to the drawn misalignment angles.
    pub angles: f64,
    /// Length of the runs in h, if it differs from that of the study.
    pub hours: Option<f64>,
    /// Meaning of agreement with the paper's figures under this reading.
    pub kind: Kind,
}

/// Relation of a reading to the paper's text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The reading follows the text as written.
    Stated,
    /// The reading is that of a correct program with another assumption.
    Assumption,
    /// A mistake in a program.
    Slip,
}

/// Treatment of the ratios `R_mn = A_mn / A_mm` of `A = K C` from six positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Installation {
    /// The closed form of the misalignment form, which uses all six ratios or the half differences of the pairs.
    OfForm,
    /// Three angles from the entries above the diagonal.
    Upper,
    /// Three angles from the entries below the diagonal.
    Lower,
    /// Six angles, of which `E_zy` has the wrong sign.
    ZyNegated,
}

impl Reading {
    /// The drawn triad under this reading.
    pub(super) fn drawn(&self, triad: &Triad) -> Triad {
        Triad {
            angles: triad.angles * self.angles,
            ..*triad
        }
    }

    /// The closed form from six noise-free positions with inputs of this magnitude (rad/s or m/s²); `None`
    /// if they leave the triad undetermined.
    pub(super) fn calibrated(
        &self,
        truth: &Triad,
        form: InstallationForm,
        size: f64,
    ) -> Option<Triad> {
        let positions: Vec<Position> = [1.0, -1.0]
            .into_iter()
            .flat_map(|sign| (0..3).map(move |axis| (axis, sign * size)))
            .map(|(axis, along)| {
                let mut input = Vector3::zeros();
                input[axis] = along;
                Position {
                    input,
                    output: truth.output(&input),
                    variance: Vector3::zeros(),
                    weighted: Vector3::zeros(),
                }
            })
            .collect();
        let calibrated = |form| Some(six_position_triad(&positions, form)?.0);
        if self.installation == Installation::OfForm {
            return calibrated(form);
        }
        let mut six = calibrated(InstallationForm::SixAngle)?;
        let r = six.installation();
        let three = match self.installation {
            Installation::OfForm | Installation::ZyNegated => {
                let names = InstallationForm::SixAngle.angle_names().iter();
                for (angle, _) in six.angles.iter_mut().zip(names).filter(|a| *a.1 == (2, 1)) {
                    *angle = -*angle;
                }
                return Some(six);
            }
            Installation::Upper => [-r[(1, 2)], r[(0, 2)], -r[(0, 1)]],
            Installation::Lower => [r[(2, 1)], -r[(2, 0)], r[(1, 0)]],
        };
        let mut triad = Triad::ideal(InstallationForm::ThreeAngle);
        triad.scale = six.scale;
        triad.bias = six.bias;
        triad.angles.fixed_rows_mut::<3>(0).copy_from_slice(&three);
        Some(triad)
    }
}
