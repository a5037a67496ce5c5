//! The misalignment matrix `C` and its forms.

use nalgebra::{Matrix3, SMatrix, SVector};
use serde::{Deserialize, Serialize};

/// Largest number of misalignment angles in any form; in a form with fewer angles, the last ones are zero.
pub const ANGLES: usize = 6;

/// Definition of the misalignment matrix by six or three small angles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InstallationForm {
    /// Six direction cosines and rows of unit norm: `C_ii = √(1 − C_ij² − C_ik²)` (Eqs. 4 and 7)
    #[default]
    General,
    /// Six off-diagonal entries and a unit diagonal (Eq. 8)
    SixAngle,
    /// Identity plus a cross-product matrix of three angles `E_yz`, `E_xz`, `E_xy` (Eq. 10)
    ThreeAngle,
}

/// Off-diagonal positions in the order of the parameters.
const SIX: [(usize, usize); 6] = [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)];
/// `E_yz`, `E_xz`, `E_xy` are `e` in Eq. 10; the names give the pair of axes that they couple.
const THREE: [(usize, usize); 3] = [(1, 2), (0, 2), (0, 1)];

impl InstallationForm {
    /// All forms.
    pub const ALL: [Self; 3] = [Self::General, Self::SixAngle, Self::ThreeAngle];

    /// The name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::General => "general",
            Self::SixAngle => "six-angle",
            Self::ThreeAngle => "three-angle",
        }
    }

    /// Row and column in the name of each angle (`gyro.installation.xy` is row x, column y).
    pub fn angle_names(self) -> &'static [(usize, usize)] {
        match self {
            Self::General | Self::SixAngle => &SIX,
            Self::ThreeAngle => &THREE,
        }
    }

    /// Whether this form can represent every misalignment of the other form.
    pub fn holds(self, other: Self) -> bool {
        self == other || self != Self::ThreeAngle
    }

    /// Derivative of the off-diagonal entries of `C` (linear in the angles) with respect to one angle.
    fn slope(self, angle: usize) -> Matrix3<f64> {
        let (row, column) = self.angle_names()[angle];
        let mut slope = Matrix3::zeros();
        match self {
            Self::General | Self::SixAngle => slope[(row, column)] = 1.0,
            Self::ThreeAngle => {
                // [e×] has +e_x at (z, y), +e_y at (x, z), +e_z at (y, x).
                let (plus, minus) = [((2, 1), (1, 2)), ((0, 2), (2, 0)), ((1, 0), (0, 1))][angle];
                slope[plus] = 1.0;
                slope[minus] = -1.0;
            }
        }
        slope
    }

    /// The misalignment matrix of these angles (pure numbers, direction cosines or radians).
    pub fn matrix(self, angles: &SVector<f64, ANGLES>) -> Matrix3<f64> {
        let mut c = Matrix3::zeros();
        for angle in 0..self.angle_names().len() {
            c += self.slope(angle) * angles[angle];
        }
        for row in 0..3 {
            c[(row, row)] = match self {
                // Beyond a right angle, no row of unit norm exists; a filter step that large is rejected because of its
                // cost, not here.
                Self::General => (1.0 - c.row(row).norm_squared()).max(0.0).sqrt(),
                Self::SixAngle | Self::ThreeAngle => 1.0,
            };
        }
        c
    }

    /// `∂C/∂angle` for one angle of [`Self::angle_names`].
    pub fn derivative(self, angles: &SVector<f64, ANGLES>, angle: usize) -> Matrix3<f64> {
        let mut d = self.slope(angle);
        if self == Self::General {
            let (row, _) = self.angle_names()[angle];
            d[(row, row)] = -angles[angle] / self.matrix(angles)[(row, row)];
        }
        d
    }

    /// Splits a sensitivity matrix `A = K C` into scale factors and misalignment angles.
    ///
    /// The general and six-angle forms reproduce `A` exactly. The three-angle form takes `K_i = A_ii` and half the
    /// difference of the two entries of each pair; its error is half the sum of the two entries. In every form, the
    /// sign of a scale factor is that of its diagonal entry: an axis that senses opposite to its body axis has a
    /// negative scale factor.
    pub fn split(self, a: &Matrix3<f64>) -> (SVector<f64, 3>, SVector<f64, ANGLES>) {
        let scale = match self {
            Self::General => SVector::from_fn(|i, _| a.row(i).norm().copysign(a[(i, i)])),
            Self::SixAngle | Self::ThreeAngle => a.diagonal(),
        };
        let c = SMatrix::<f64, 3, 3>::from_fn(|i, j| a[(i, j)] / scale[i]);
        let mut angles = SVector::<f64, ANGLES>::zeros();
        for angle in 0..self.angle_names().len() {
            let slope = self.slope(angle);
            angles[angle] = slope.dot(&c) / slope.norm_squared();
        }
        (scale, angles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use nalgebra::Vector6;

    fn angles(form: InstallationForm) -> Vector6<f64> {
        let mut angles = Vector6::new(0.02, -0.03, 0.01, 0.04, -0.05, 0.06);
        for unused in form.angle_names().len()..ANGLES {
            angles[unused] = 0.0;
        }
        angles
    }

    #[test]
    fn general_rows_have_unit_norm() {
        let c = InstallationForm::General.matrix(&angles(InstallationForm::General));
        for row in c.row_iter() {
            assert_relative_eq!(row.norm(), 1.0, epsilon = 1e-15);
        }
    }

    #[test]
    fn three_angle_is_identity_plus_the_cross_product_matrix() {
        let e = angles(InstallationForm::ThreeAngle);
        let c = InstallationForm::ThreeAngle.matrix(&e);
        let expected =
            Matrix3::identity() + crate::attitude::skew(nalgebra::Vector3::new(e[0], e[1], e[2]));
        assert_relative_eq!(c, expected);
    }

    #[test]
    fn derivatives_match_finite_differences_in_every_form() {
        let step = 1e-6;
        for form in InstallationForm::ALL {
            let at = angles(form);
            for angle in 0..form.angle_names().len() {
                let mut plus = at;
                let mut minus = at;
                plus[angle] += step;
                minus[angle] -= step;
                let difference = (form.matrix(&plus) - form.matrix(&minus)) / (2.0 * step);
                assert_relative_eq!(form.derivative(&at, angle), difference, epsilon = 1e-9);
            }
        }
    }

    #[test]
    fn split_inverts_the_product_in_every_form() {
        for form in InstallationForm::ALL {
            let at = angles(form);
            // The second axis senses against its body axis.
            let k = Matrix3::from_diagonal(&nalgebra::Vector3::new(1.1, -0.9, 1.3));
            let (scale, found) = form.split(&(k * form.matrix(&at)));
            assert_relative_eq!(scale, k.diagonal(), epsilon = 1e-14);
            assert_relative_eq!(found, at, epsilon = 1e-14);
        }
    }
}
