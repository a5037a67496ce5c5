//! One triad: scale factors, misalignments and biases, and their prior.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::{ANGLES, AXES, InstallationForm, Sensor};

/// Number of parameters of a triad: three scale factors, up to six angles, three biases.
pub const PARAMETERS: usize = 3 + ANGLES + 3;
const SCALE: usize = 0;
pub const INSTALLATION: usize = 3;
const BIAS: usize = INSTALLATION + ANGLES;

/// A triad's parameters in their order: `K_x K_y K_z`, the angles of
/// [`InstallationForm::angle_names`], `D_x D_y D_z`.
pub type TriadVector = SVector<f64, PARAMETERS>;

/// The model `N = K C u + D` of one triad, with `N` divided by the nominal scale of its axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triad {
    /// Misalignment form: definition of `C` by the angles.
    pub form: InstallationForm,
    /// Diagonal of `K`, relative to the nominal scale.
    pub scale: Vector3<f64>,
    /// Misalignment angles, pure numbers; angles that the form does not have are zero.
    pub angles: SVector<f64, ANGLES>,
    /// `D` in rad/s or m/s².
    pub bias: Vector3<f64>,
}

impl Triad {
    /// The ideal triad: unit scale, aligned axes, no bias.
    pub fn ideal(form: InstallationForm) -> Self {
        Self {
            form,
            scale: Vector3::repeat(1.0),
            angles: SVector::zeros(),
            bias: Vector3::zeros(),
        }
    }

    /// The triad of this form whose sensitivity is nearest to `a = K C`, with this bias.
    pub fn from_sensitivity(form: InstallationForm, a: &Matrix3<f64>, bias: Vector3<f64>) -> Self {
        let (scale, angles) = form.split(a);
        Self {
            form,
            scale,
            angles,
            bias,
        }
    }

    /// The triad of another form whose sensitivity is nearest to that of this triad.
    pub fn in_form(&self, form: InstallationForm) -> Self {
        Self::from_sensitivity(form, &self.sensitivity(), self.bias)
    }

    /// The misalignment matrix `C`.
    pub fn installation(&self) -> Matrix3<f64> {
        self.form.matrix(&self.angles)
    }

    /// The sensitivity `A = K C`.
    pub fn sensitivity(&self) -> Matrix3<f64> {
        Matrix3::from_diagonal(&self.scale) * self.installation()
    }

    /// `A⁻¹`, which converts `N − D` to `u` (Eq. 11); `None` if `A` is singular.
    pub fn correction(&self) -> Option<Matrix3<f64>> {
        self.sensitivity().try_inverse()
    }

    /// The output per second, `N = K C u + D` (Eq. 6).
    pub fn output(&self, u: &Vector3<f64>) -> Vector3<f64> {
        self.sensitivity() * u + self.bias
    }

    /// `∂N/∂θ_p = W_p [u; 1]` for every parameter: `N` is linear in `[u; 1]`, so one 3×4 matrix contains the derivative
    /// for any input. The derivatives are zero for parameters that the form does not have.
    pub fn response(&self) -> [SMatrix<f64, 3, 4>; PARAMETERS] {
        let c = self.installation();
        let scale = Matrix3::from_diagonal(&self.scale);
        let mut response = [SMatrix::<f64, 3, 4>::zeros(); PARAMETERS];
        for axis in 0..3 {
            let mut of_scale = response[SCALE + axis].fixed_view_mut::<1, 3>(axis, 0);
            of_scale.copy_from(&c.row(axis));
            response[BIAS + axis][(axis, 3)] = 1.0;
        }
        for angle in 0..self.form.angle_names().len() {
            let mut of_angle = response[INSTALLATION + angle].fixed_columns_mut::<3>(0);
            of_angle.copy_from(&(scale * self.form.derivative(&self.angles, angle)));
        }
        response
    }

    /// The parameters as a vector.
    pub fn to_vector(&self) -> TriadVector {
        let parts = self.scale.iter().chain(&self.angles).chain(&self.bias);
        TriadVector::from_iterator(parts.copied())
    }

    /// The triad of a parameter vector.
    pub fn from_vector(form: InstallationForm, v: &TriadVector) -> Self {
        Self {
            form,
            scale: v.fixed_rows::<3>(SCALE).into_owned(),
            angles: v.fixed_rows::<ANGLES>(INSTALLATION).into_owned(),
            bias: v.fixed_rows::<3>(BIAS).into_owned(),
        }
    }

    /// Indices of the misalignment angles above the diagonal of `C`. In the accelerometer body frame, these angles of
    /// the accelerometers are zero.
    pub fn above_the_diagonal(form: InstallationForm) -> impl Iterator<Item = usize> {
        let angles = form.angle_names().iter().enumerate();
        angles
            .filter(|(_, (row, column))| column > row)
            .map(|(angle, _)| INSTALLATION + angle)
    }

    /// A copy without misalignment angles above the diagonal of `C`.
    pub fn along_body_axes(&self) -> Self {
        let mut v = self.to_vector();
        for angle in Self::above_the_diagonal(self.form) {
            v[angle] = 0.0;
        }
        Self::from_vector(self.form, &v)
    }

    /// Whether a form has this parameter.
    pub fn has_parameter(form: InstallationForm, parameter: usize) -> bool {
        Self::axis(form, parameter).is_some()
    }

    /// Kind of a parameter.
    pub fn kind(parameter: usize) -> ParameterKind {
        match parameter {
            SCALE..INSTALLATION => ParameterKind::Scale,
            INSTALLATION..BIAS => ParameterKind::Installation,
            _ => ParameterKind::Bias,
        }
    }

    /// The axis whose output depends on this parameter; `None` if the form does not have the parameter.
    pub fn axis(form: InstallationForm, parameter: usize) -> Option<usize> {
        match Self::kind(parameter) {
            ParameterKind::Scale => Some(parameter - SCALE),
            ParameterKind::Installation => {
                let angle = form.angle_names().get(parameter - INSTALLATION);
                angle.map(|&(row, _)| row)
            }
            ParameterKind::Bias => Some(parameter - BIAS),
        }
    }

    /// The name of a parameter in files, such as `gyro.installation.xy`; `None` if the form (or every form) lacks it.
    pub fn parameter_name(
        sensor: Sensor,
        form: InstallationForm,
        parameter: usize,
    ) -> Option<String> {
        let (sensor, axis) = (sensor.name(), AXES.get(Self::axis(form, parameter)?)?);
        Some(match Self::kind(parameter) {
            ParameterKind::Scale => format!("{sensor}.scale.{axis}"),
            ParameterKind::Installation => {
                let (_, column) = form.angle_names()[parameter - INSTALLATION];
                format!("{sensor}.installation.{axis}{}", AXES[column])
            }
            ParameterKind::Bias => format!("{sensor}.bias.{axis}"),
        })
    }
}

/// The three kinds of parameter, each with its own unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ParameterKind {
    /// Scale factor, relative.
    Scale,
    /// Misalignment angle, radians.
    Installation,
    /// Bias, rad/s or m/s².
    Bias,
}

impl ParameterKind {
    /// All kinds, in the order of the parameters.
    pub const ALL: [Self; 3] = [Self::Scale, Self::Installation, Self::Bias];
}

/// Prior knowledge of a triad, in the model's normalised units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// 1σ of each scale factor, relative; its mean is the nominal scale.
    pub scale_sigma: Vector3<f64>,
    /// 1σ of every misalignment angle of each row, radians; the mean is zero.
    pub installation_sigma: Vector3<f64>,
    /// Mean of the biases, rad/s or m/s².
    pub bias: Vector3<f64>,
    /// 1σ of each bias, rad/s or m/s².
    pub bias_sigma: Vector3<f64>,
}

impl Prior {
    /// The mean as a triad.
    pub fn mean(&self, form: InstallationForm) -> Triad {
        Triad {
            bias: self.bias,
            ..Triad::ideal(form)
        }
    }

    /// 1σ of each parameter; zero for parameters that the form does not have.
    pub fn sigma(&self, form: InstallationForm) -> TriadVector {
        TriadVector::from_fn(|parameter, _| {
            let of_axes = match Triad::kind(parameter) {
                ParameterKind::Scale => self.scale_sigma,
                ParameterKind::Installation => self.installation_sigma,
                ParameterKind::Bias => self.bias_sigma,
            };
            Triad::axis(form, parameter).map_or(0.0, |axis| of_axes[axis])
        })
    }
}

/// The nominal scale of a triad: the file's quantity per second for one rad/s or one m/s², axis by axis. There is no
/// other conversion between the numbers in a file and the normalised model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nominal(pub Vector3<f64>);

impl Nominal {
    /// `K C` of a normalised triad, in the file's quantity per second.
    pub fn sensitivity(&self, triad: &Triad) -> Matrix3<f64> {
        Matrix3::from_diagonal(&self.0) * triad.sensitivity()
    }

    /// The factor that converts a normalised parameter to the file's quantity: the nominal scale for scale factors and
    /// biases, one for angles.
    pub fn factor(&self, parameter: usize) -> f64 {
        match Triad::kind(parameter) {
            ParameterKind::Scale => self.0[parameter - SCALE],
            ParameterKind::Installation => 1.0,
            ParameterKind::Bias => self.0[parameter - BIAS],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn triad(form: InstallationForm) -> Triad {
        let mut v = TriadVector::from_fn(|i, _| 0.01 * (i as f64 + 1.0) * (-1f64).powi(i as i32));
        v.fixed_rows_mut::<3>(SCALE).add_scalar_mut(1.0);
        for parameter in 0..PARAMETERS {
            if !Triad::has_parameter(form, parameter) {
                v[parameter] = 0.0;
            }
        }
        Triad::from_vector(form, &v)
    }

    #[test]
    fn response_is_the_derivative_of_the_output_in_every_form() {
        let u = Vector3::new(0.3, -1.2, 9.7);
        let basis = u.push(1.0);
        let step = 1e-6;
        for form in InstallationForm::ALL {
            let at = triad(form);
            let response = at.response();
            for parameter in (0..PARAMETERS).filter(|&p| Triad::has_parameter(form, p)) {
                let shifted = |by: f64| {
                    let mut v = at.to_vector();
                    v[parameter] += by;
                    Triad::from_vector(form, &v).output(&u)
                };
                let difference = (shifted(step) - shifted(-step)) / (2.0 * step);
                assert_relative_eq!(response[parameter] * basis, difference, epsilon = 1e-8);
            }
        }
    }

    #[test]
    fn names_follow_the_contract() {
        use InstallationForm::*;
        let name = |form, p| Triad::parameter_name(Sensor::Gyro, form, p);
        assert_eq!(name(General, 0).as_deref(), Some("gyro.scale.x"));
        assert_eq!(name(General, 3).as_deref(), Some("gyro.installation.xy"));
        assert_eq!(name(ThreeAngle, 3).as_deref(), Some("gyro.installation.yz"));
        assert_eq!(name(ThreeAngle, 6), None);
        assert_eq!(name(SixAngle, 11).as_deref(), Some("gyro.bias.z"));
    }
}
