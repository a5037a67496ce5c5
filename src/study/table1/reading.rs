//! Ways to read the paper: how a sample is drawn, calibrated and navigated.

use nalgebra::Vector3;

use crate::calibration::{Position, six_position_triad};
use crate::imu::{InstallationForm, Triad};

/// A way to read the paper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// What it takes the paper to mean.
    pub name: &'static str,
    /// What becomes of the entries of `K C`.
    pub installation: Installation,
    /// The installation angles are this many times those drawn.
    pub angles: f64,
    /// Length of the runs in h, where it is not that of the study.
    pub hours: Option<f64>,
    /// What it would mean if this reading gave the paper's figures.
    pub kind: Kind,
}

/// How a reading stands to the paper's text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// What the text says.
    Stated,
    /// A correct program under another assumption.
    Assumption,
    /// A mistake in a program.
    Slip,
}

/// What becomes of the ratios `R_mn = A_mn / A_mm` of `A = K C` from six positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Installation {
    /// What the form's closed form makes of them: all six, or half differences of the pairs.
    OfForm,
    /// Three angles from the entries above the diagonal.
    Upper,
    /// Three angles from the entries below it.
    Lower,
    /// Six angles, `E_zy` with the wrong sign.
    ZyNegated,
}

impl Reading {
    /// The drawn triad as this reading has it.
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
