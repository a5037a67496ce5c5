//! Calibrations along the axes that their reader has, and what a reader leaves of their errors.

use nalgebra::{Matrix3, Vector3};

use super::source::{Document, Normalised, Source, yaml_list};
use crate::formats::axes::BodyAxes;
use crate::imu::{AxisOrder, PerSensor, Sensor, Term};
use crate::units::{ARCSEC, DEGREE, PPM, STANDARD_GRAVITY};

/// Both triads along other axes than right, front, up.
pub(super) struct Along {
    pub triads: PerSensor<Normalised>,
    /// What of specific force the gyros add to their rate.
    pub g_sensitivity: Matrix3<f64>,
    /// From these axes to right, front, up.
    order: AxisOrder,
}

impl Along {
    /// Along front, right, down, as autopilots have it.
    pub fn front_right_down(source: &Source) -> Self {
        Self::new(source, BodyAxes::Frd.order())
    }

    /// Along the axes of the run's log, else right, front, up.
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
        let of = |axes: BodyAxes| axes.order() == self.order;
        match (of(BodyAxes::Rfu), of(BodyAxes::Frd), of(BodyAxes::Flu)) {
            (true, ..) => "right, front, up",
            (_, true, _) => "front, right, down",
            (_, _, true) => "front, left, up",
            _ => "the axes of the log",
        }
    }

    /// The axis right, front or up that lies along one of these.
    pub fn axis_of_record(&self, axis: usize) -> usize {
        let of = self.order.source.iter().position(|&source| source == axis);
        of.unwrap_or(axis)
    }

    /// Says along which axes what follows is, `what` being what a reader does there, and what raw output is divided
    /// by before.
    pub fn introduce(&self, file: &mut Document, what: &str) {
        file.comment("");
        file.comment(&format!("{what} along {};", self.words()));
        let nominal = |sensor| self.triads.get(sensor).nominal.into();
        file.comment(&super::source::divide(&PerSensor::from_fn(nominal)));
    }
}

/// What a reader that makes `matrix (n − offset)` of a triad's output leaves of its input u: `errors u + constant`.
pub(super) struct Remainder {
    sensor: Sensor,
    errors: Matrix3<f64>,
    constant: Vector3<f64>,
}

impl Remainder {
    pub fn of(
        sensor: Sensor,
        triad: &Normalised,
        matrix: &Matrix3<f64>,
        offset: &Vector3<f64>,
    ) -> Self {
        Self {
            sensor,
            errors: matrix * triad.sensitivity - Matrix3::identity(),
            constant: matrix * (triad.bias - offset),
        }
    }

    /// The largest length of `errors u` for u of length one.
    fn largest(&self) -> f64 {
        self.errors.singular_values().max()
    }

    /// How much that is, in a sentence.
    pub fn words(&self) -> String {
        let scale = self.errors.diagonal().amax();
        let mut across = self.errors;
        across.fill_diagonal(0.0);
        let worst = self.largest();
        let (name, example) = match self.sensor {
            Sensor::Gyro => ("gyros", format!("{:.3} deg/s at 100 deg/s", 100.0 * worst)),
            Sensor::Accel => ("accelerometers", format!("{:.3} mg at 1 g", 1e3 * worst)),
        };
        let bias = match self.sensor {
            Sensor::Gyro => format!("{:.3} deg/h", self.constant.amax() / DEGREE * 3600.0),
            Sensor::Accel => format!("{:.3} mg", 1e3 * self.constant.amax() / STANDARD_GRAVITY),
        };
        format!(
            "{name}: what is left is up to {:.1} ppm of scale and {:.1} arcsec of misalignment, together {example} \
             in any direction, and {bias} of bias",
            scale / PPM,
            across.amax() / ARCSEC
        )
    }

    /// All figures, a line an axis: parts of u, and the constant in rad/s or m/s².
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
pub(super) fn upper(a: &Matrix3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
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
        let triad = Normalised {
            nominal: Vector3::repeat(1.0),
            sensitivity: Matrix3::identity() + errors,
            bias: Vector3::zeros(),
        };
        let zero = Vector3::zeros();
        let left = Remainder::of(Sensor::Accel, &triad, &Matrix3::identity(), &zero);
        let input = Vector3::repeat(1.0 / 3f64.sqrt());
        assert!(((errors * input).norm() - 1.732e-3).abs() < 1e-6);
        let words = left.words();
        assert!(
            words.contains("together 1.732 mg at 1 g in any direction"),
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
