//! Common input of all formats, and its description.

use nalgebra::{Matrix3, Vector3};

use super::document::{Document, yaml_list};
use crate::calibration::result::{Calibration, EQUATION, Method, TriadRecord};
use crate::calibration::{Correction, CorrectionError};
use crate::formats::unit_scale;
use crate::imu::{AxisOrder, GaussMarkov, Noise, PerSensor, Sensor, Term};
use crate::run::{Aiding, Run};
use crate::units::{ARCSEC, DEGREE, PPM, STANDARD_GRAVITY};

/// A calibration and, perhaps, a run of its instrument.
pub struct Source<'a> {
    pub record: &'a Calibration,
    pub run: Option<&'a Run>,
    pub correction: Correction,
}

/// A triad in rad/s or m/s²: `n = A u + b`, with `n = N / nominal`, along right, front, up.
pub struct Normalised {
    /// Divisor of the quantity of the file per second, axis by axis.
    pub nominal: Vector3<f64>,
    pub sensitivity: Matrix3<f64>,
    pub bias: Vector3<f64>,
}

impl<'a> Source<'a> {
    pub fn new(record: &'a Calibration, run: Option<&'a Run>) -> Result<Self, CorrectionError> {
        let correction = match run {
            Some(run) => Correction::for_run(record, run)?,
            None => Correction::of_record(record)?,
        };
        Ok(Self {
            record,
            run,
            correction,
        })
    }

    /// The unit of `N`. A count is that of a rate or, per second, of an increment; the record does not distinguish
    /// them.
    pub fn unit(&self, sensor: Sensor) -> String {
        match self.row_unit(sensor) {
            None => "an unnamed unit".to_owned(),
            Some(unit @ ("rad" | "deg" | "arcsec" | "m/s" | "g*s")) => format!("{unit}/s"),
            Some(unit) => unit.to_owned(),
        }
    }

    fn row_unit(&self, sensor: Sensor) -> Option<&str> {
        Some(self.record.unit.as_ref()?.get(sensor))
    }

    /// The unit of `u`.
    pub fn input(sensor: Sensor) -> &'static str {
        sensor.pick("rad/s", "m/s^2")
    }

    /// Instrument of the calibration, and definitions of `N` and `u`.
    pub fn about(&self) -> Vec<String> {
        let record = self.record;
        let mut lines = vec![format!(
            "IMU calibration, exported by turncal {}",
            env!("CARGO_PKG_VERSION")
        )];
        let method = match (record.method, record.aiding) {
            (Some(Method::Ekf), Some(Aiding::Table)) => {
                "Kalman filter, standstill and table attitude"
            }
            (Some(Method::Ekf), _) => "Kalman filter, standstill only",
            (Some(Method::SixPosition), _) => "closed form from static positions",
            (None, _) => "not stated",
        };
        lines.push(format!("method: {method}"));
        lines.extend(
            record
                .meta
                .iter()
                .map(|(name, value)| format!("{name}: {value}")),
        );
        if record.is_failed() {
            lines.push("WARNING: verdict FAILED: do not use these values".to_owned());
        }
        lines.extend(record.warnings.iter().map(|w| format!("warning: {w}")));
        lines.extend([
            String::new(),
            EQUATION.to_owned(),
            format!(
                "N: raw output per second, gyros in {}, accelerometers in {}; divide pulses or increments by the \
                 sample period and use rates unchanged",
                self.unit(Sensor::Gyro),
                self.unit(Sensor::Accel)
            ),
            format!(
                "u: angular rate in rad/s, specific force in m/s^2, along: {}",
                record.body_frame.words()
            ),
            self.axes(),
        ]);
        lines
    }

    /// What the axes of N and u are in the log.
    fn axes(&self) -> String {
        match &self.record.columns {
            Some(PerSensor { gyro, accel }) => format!(
                "axes x, y, z of N and u (right, front, up): columns {} and {} of the log",
                gyro.join(", "),
                accel.join(", ")
            ),
            None => "axes of N and u: right, front, up; (y, x, -z) converts a log along front, right, down and \
                     (y, -x, z) one along front, left, up"
                .to_owned(),
        }
    }

    /// σ of the parameters of a triad.
    pub fn sigma(&self, sensor: Sensor) -> Option<&TriadRecord> {
        let sigma = self.record.sigma.as_ref();
        sigma.map(|sigma| sigma.get(sensor))
    }

    /// Stated noise of the run.
    pub fn noise(&self, sensor: Sensor) -> Option<&Noise> {
        self.run.map(|run| run.instrument.noise.get(sensor))
    }

    /// Its bias variation.
    pub fn varying(&self, sensor: Sensor) -> Option<GaussMarkov> {
        self.noise(sensor)?.gauss_markov
    }

    /// Reason for a missing noise figure.
    pub fn no_noise(&self) -> &'static str {
        match self.run {
            Some(_) => "[imu.noise] in run.toml does not state it",
            None => "measure it with `turncal allan` or export with --run RUN.toml",
        }
    }

    /// A triad in rad/s or m/s². Without a run the nominal scale is that of the unit; for counts the
    /// calibrated scale factors, rounded to three digits.
    fn normalised(&self, sensor: Sensor) -> Normalised {
        let sensitivity = self.correction.sensitivity.get(sensor);
        let unit = self
            .row_unit(sensor)
            .and_then(|unit| unit_scale(sensor, unit));
        let nominal = match (self.run, unit) {
            (Some(run), _) => run.instrument.nominal.get(sensor).0,
            (None, Some(scale)) => Vector3::repeat(scale),
            (None, None) => Vector3::from_fn(|i, _| {
                let scale = sensitivity.row(i).norm().copysign(sensitivity[(i, i)]);
                format!("{scale:.2e}").parse().unwrap_or(scale)
            }),
        };
        Normalised {
            sensitivity: Matrix3::from_fn(|i, j| sensitivity[(i, j)] / nominal[i]),
            bias: self.correction.bias.get(sensor).component_div(&nominal),
            nominal,
        }
    }

    /// Parameters of error terms, one line each, in SI.
    pub fn term_lines(&self, has: impl Fn(Term) -> bool) -> Vec<String> {
        let line = |k: usize| {
            let term = Term::of(k).filter(|&term| has(term))?;
            let (name, value) = (Term::parameter_name(k)?, self.correction.terms[k]);
            Some(format!(
                "{name} = {value:e} {}, adds {}",
                term.entry().si_unit,
                term.entry().adds
            ))
        };
        self.correction.terms().filter_map(line).collect()
    }

    /// Note on omitted error terms, if any.
    pub fn terms_note(&self, held: impl Fn(Term) -> bool) -> Option<String> {
        let names: Vec<&str> = Term::ALL
            .into_iter()
            .filter(|&term| !held(term) && self.correction.has(term))
            .map(Term::name)
            .collect();
        (!names.is_empty()).then(|| {
            format!(
                "this format does not correct error terms ({}); `turncal apply` does",
                names.join(", ")
            )
        })
    }

    /// Raw outputs with calibrated values, one line each.
    pub fn test_vectors(&self) -> Vec<String> {
        let numbers = |values: &[f64; 6]| values.map(|v| format!("{v:e}")).join(", ");
        let vectors = self.record.test_vectors.iter();
        vectors
            .map(|v| format!("{} -> {}", numbers(&v.raw), numbers(&v.calibrated)))
            .collect()
    }
}

/// Both triads along other axes than right, front, up.
pub struct Axes {
    pub triads: PerSensor<Normalised>,
    /// Gyro output per specific force.
    pub g_sensitivity: Matrix3<f64>,
    /// From these axes to right, front, up.
    order: AxisOrder,
}

impl Axes {
    /// Along front, right, down, as for autopilots.
    pub fn front_right_down(source: &Source) -> Self {
        Self::new(source, AxisOrder::FRONT_RIGHT_DOWN)
    }

    /// Along right, front, up.
    pub fn right_front_up(source: &Source) -> Self {
        Self::new(source, AxisOrder::IDENTITY)
    }

    /// Along the axes of the log of the run, otherwise right, front, up.
    pub fn log(source: &Source) -> Self {
        let log = source.run.and_then(|run| run.recording.imu.log.as_ref());
        Self::new(
            source,
            log.map_or(AxisOrder::IDENTITY, |log| log.named.axes),
        )
    }

    fn new(source: &Source, order: AxisOrder) -> Self {
        let turn = order.matrix();
        let turned = |matrix: Matrix3<f64>| turn.transpose() * matrix * turn;
        let q = Term::GSensitivity.parameters().start;
        let g_sensitivity = Matrix3::from_fn(|i, j| source.correction.terms[q + 3 * i + j]);
        Self {
            triads: PerSensor::from_fn(|sensor| {
                let triad = source.normalised(sensor);
                let mut nominal = triad.nominal;
                for (axis, &of) in order.source.iter().enumerate() {
                    nominal[of] = triad.nominal[axis];
                }
                Normalised {
                    nominal,
                    sensitivity: turned(triad.sensitivity),
                    bias: turn.transpose() * triad.bias,
                }
            }),
            g_sensitivity: turned(g_sensitivity),
            order,
        }
    }

    /// The axes in words.
    fn words(&self) -> &'static str {
        match self.order {
            AxisOrder::IDENTITY => "right, front, up",
            AxisOrder::FRONT_RIGHT_DOWN => "front, right, down",
            AxisOrder::FRONT_LEFT_UP => "front, left, up",
            _ => "the axes of the log",
        }
    }

    /// The axis (right, front or up) along one of these.
    pub fn axis_of_record(&self, axis: usize) -> usize {
        let of = self.order.source.iter().position(|&source| source == axis);
        of.unwrap_or(axis)
    }

    /// States the axes and direction (`what`) of the following values, and the divisor of raw output.
    pub fn introduce(&self, file: &mut Document, what: &str) {
        file.comment("");
        file.comment(&format!("{what} along {};", self.words()));
        let [gyro, accel] = Sensor::ALL.map(|sensor| yaml_list(&self.triads.get(sensor).nominal));
        file.comment(&format!(
            "to convert the raw output, divide gyros by {gyro} and accelerometers by {accel}"
        ));
    }
}

/// Correction of the output n of a triad by a program: `matrix (n − offset)`.
pub struct Held {
    pub matrix: Matrix3<f64>,
    pub offset: Vector3<f64>,
}

impl Held {
    /// The offset alone.
    pub fn offset(offset: Vector3<f64>) -> Self {
        Self {
            matrix: Matrix3::identity(),
            offset,
        }
    }

    /// The complete correction of a triad; an exportable calibration has an inverse.
    pub fn all(triad: &Normalised) -> Self {
        let inverse = triad.sensitivity.try_inverse();
        Self {
            matrix: inverse.unwrap_or_else(Matrix3::identity),
            offset: triad.bias,
        }
    }

    /// The matrix row by row.
    pub fn rows(&self) -> Vec<f64> {
        self.matrix.transpose().iter().copied().collect()
    }
}

/// Residual error, as a function of the input u, of a program that computes `matrix (n − offset)`: `errors u +
/// constant`.
pub struct Remainder {
    sensor: Sensor,
    errors: Matrix3<f64>,
    constant: Vector3<f64>,
}

impl Remainder {
    pub fn of(sensor: Sensor, axes: &Axes, held: &Held) -> Self {
        let triad = axes.triads.get(sensor);
        Self {
            sensor,
            errors: held.matrix * triad.sensitivity - Matrix3::identity(),
            constant: held.matrix * (triad.bias - held.offset),
        }
    }

    /// Whether it is only rounding.
    pub fn is_none(&self) -> bool {
        self.errors.amax() < 1e-12 && self.constant.amax() < 1e-12
    }

    /// The largest length of `errors u` for u of length one.
    fn largest(&self) -> f64 {
        self.errors.singular_values().max()
    }

    /// Its size, in a sentence.
    pub fn words(&self) -> String {
        let scale = self.errors.diagonal().amax();
        let mut across = self.errors;
        across.fill_diagonal(0.0);
        let worst = self.largest();
        let (name, example) = self.sensor.pick(
            ("gyros", format!("{:.3} deg/s at 100 deg/s", 100.0 * worst)),
            ("accelerometers", format!("{:.3} mg at 1 g", 1e3 * worst)),
        );
        let bias = self.sensor.pick(
            format!("{:.3} deg/h", self.constant.amax() / DEGREE * 3600.0),
            format!("{:.3} mg", 1e3 * self.constant.amax() / STANDARD_GRAVITY),
        );
        format!(
            "{name}: the residual error is up to {:.1} ppm in scale and {:.1} arcsec in misalignment ({example} in \
             any direction combined), and {bias} in bias",
            scale / PPM,
            across.amax() / ARCSEC
        )
    }

    /// All figures, one line per axis: fractions of u, and the constant in rad/s or m/s².
    pub fn lines(&self, file: &mut Document) {
        for (axis, name) in ["x", "y", "z"].iter().enumerate() {
            let row: Vector3<f64> = self.errors.row(axis).transpose();
            let constant = [self.constant[axis]];
            file.comment(&format!(
                "left, {} {name}: {} of u and {}",
                self.sensor.name(),
                yaml_list(&row),
                yaml_list(&constant)
            ));
        }
    }
}

/// The rotation R and the upper triangular U with positive diagonal of `A = U R`.
pub fn upper(a: &Matrix3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
    let reverse = Matrix3::new(0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0);
    let reversed = reverse * a * reverse;
    let rotation = crate::calibration::result::frame::accelerometer_frame(&reversed);
    let rotation = reverse * rotation * reverse;
    let mut upper = a * rotation.transpose();
    // Below the diagonal there is only rounding.
    upper.fill_lower_triangle(0.0, 1);
    (upper, rotation)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_is_as_long_as_the_longest_error_vector_of_any_input() {
        // Each row is 1e-3 long, yet along (1, 1, 1)/√3 all three err by it at once.
        let errors = Matrix3::repeat(1e-3 / 3f64.sqrt());
        let left = Remainder {
            sensor: Sensor::Accel,
            errors,
            constant: Vector3::zeros(),
        };
        let input = Vector3::repeat(1.0 / 3f64.sqrt());
        assert!(((errors * input).norm() - 1.732e-3).abs() < 1e-6);
        let words = left.words();
        assert!(
            words.contains("1.732 mg at 1 g in any direction"),
            "{words}"
        );
    }

    #[test]
    fn a_matrix_is_its_upper_triangle_times_a_rotation() {
        let a = Matrix3::new(1.1, 0.2, -0.3, 0.1, 0.9, 0.05, -0.2, 0.3, 1.2);
        let (u, r) = upper(&a);
        assert!((u * r - a).amax() < 1e-14);
        assert!((r * r.transpose() - Matrix3::identity()).amax() < 1e-14);
        assert!(r.determinant() > 0.0 && u.diagonal().min() > 0.0);
        assert_eq!([u[(1, 0)], u[(2, 0)], u[(2, 1)]], [0.0; 3]);
    }
}
