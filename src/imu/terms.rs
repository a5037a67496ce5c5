//! Error terms of an instrument, beside `K`, `E` and `D`: each changes what a triad takes for
//! its input, `N = K C (u + t(q)) + D`, by parameters `q` of its own.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::{AXES, Sensor};
use crate::attitude::exp;
use crate::units::{DEG_PER_H, MICRO_G, PPM, STANDARD_GRAVITY};

/// Number of parameters of all terms.
pub const TERM_PARAMETERS: usize = 22;
/// The parameters of all terms, in the order of [`Term::ALL`]; zero where a term is off.
pub type TermVector = SVector<f64, TERM_PARAMETERS>;
/// What each parameter adds to the input of a triad.
pub type TermResponse = SMatrix<f64, 3, TERM_PARAMETERS>;

/// An error term.
///
/// Source: IEEE Std 1293-2018, §5.3 (accelerometers: second order, asymmetry); IEEE Std 952-2020, §5
/// (gyros: acceleration sensitivity); Savage, *Strapdown Analytics*, 2nd ed., §8.1.4 (size effect,
/// time offset).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Term {
    /// Accelerometers add `q_i f_i²`; q in s²/m.
    AccelSecondOrder,
    /// Accelerometers add `q_i |f_i|`: another scale factor down than up.
    AccelAsymmetry,
    /// Accelerometers x and y stand away from z by r_x and r_y, in m along body axes: they add row i
    /// of `([ω̇×] + [ω×]²) r_i`. One lever arm common to all three cannot be told from rest.
    SizeEffect,
    /// Accelerometer samples are those of a time q later than the gyros', in s: where the body stays
    /// at its place and turns by θ in that time, they are `exp(−[θ×]) f`, or `f − q (ω − ω_ie) × f` to
    /// first order.
    TimeOffset,
    /// Gyros add `Q f`, Q row by row, in rad/s per m/s².
    GSensitivity,
}

/// How a body moves in a sample, along body axes.
#[derive(Debug, Clone, Copy)]
pub struct Sensed {
    /// Angular rate against inertial space, rad/s.
    pub rate: Vector3<f64>,
    /// Angular rate against the Earth, rad/s.
    pub rate_over_earth: Vector3<f64>,
    /// Angular acceleration, rad/s².
    pub angular_acceleration: Vector3<f64>,
    /// Specific force, m/s².
    pub force: Vector3<f64>,
}

impl Term {
    /// Every term, in the order of the parameters.
    pub const ALL: [Self; 5] = [
        Self::AccelSecondOrder,
        Self::AccelAsymmetry,
        Self::SizeEffect,
        Self::TimeOffset,
        Self::GSensitivity,
    ];

    /// The name that files and commands use.
    pub fn name(self) -> &'static str {
        match self {
            Self::AccelSecondOrder => "accel-second-order",
            Self::AccelAsymmetry => "accel-asymmetry",
            Self::SizeEffect => "size-effect",
            Self::TimeOffset => "time-offset",
            Self::GSensitivity => "g-sensitivity",
        }
    }

    /// The unit of its parameters in files and reports: its name, and its value in SI.
    pub fn unit(self) -> (&'static str, f64) {
        match self {
            Self::AccelSecondOrder => ("µg/g²", MICRO_G / STANDARD_GRAVITY.powi(2)),
            Self::AccelAsymmetry => ("ppm", PPM),
            Self::SizeEffect => ("mm", 1e-3),
            Self::TimeOffset => ("ms", 1e-3),
            Self::GSensitivity => ("°/h/g", DEG_PER_H / STANDARD_GRAVITY),
        }
    }

    /// 1σ of each of its parameters where nothing better is known, in SI: ten times what precise
    /// instruments have.
    pub fn usual_sigma(self) -> f64 {
        let in_unit = match self {
            Self::AccelSecondOrder => 100.0,
            Self::AccelAsymmetry => 100.0,
            Self::SizeEffect => 100.0,
            Self::TimeOffset => 10.0,
            Self::GSensitivity => 1.0,
        };
        in_unit * self.unit().1
    }

    /// Indices of its parameters.
    pub fn parameters(self) -> std::ops::Range<usize> {
        let size = |term| match term {
            Self::AccelSecondOrder | Self::AccelAsymmetry => 3,
            Self::SizeEffect => 6,
            Self::TimeOffset => 1,
            Self::GSensitivity => 9,
        };
        let before = Self::ALL.into_iter().take_while(|&term| term != self);
        let first = before.map(size).sum();
        first..first + size(self)
    }

    /// Whose input it changes.
    pub fn sensor(self) -> Sensor {
        match self {
            Self::GSensitivity => Sensor::Gyro,
            _ => Sensor::Accel,
        }
    }

    /// The term of a parameter.
    pub fn of(parameter: usize) -> Option<Self> {
        let has = |term: &Self| term.parameters().contains(&parameter);
        Self::ALL.into_iter().find(has)
    }

    /// The name of a parameter in files; `None` beyond the last.
    pub fn parameter_name(parameter: usize) -> Option<String> {
        let term = Self::of(parameter)?;
        let k = parameter - term.parameters().start;
        Some(match term {
            Self::AccelSecondOrder => format!("accel.second_order.{}", AXES[k]),
            Self::AccelAsymmetry => format!("accel.asymmetry.{}", AXES[k]),
            // Accelerometer, then component of its lever arm.
            Self::SizeEffect => format!("accel.lever_arm.{}{}", AXES[k / 3], AXES[k % 3]),
            Self::TimeOffset => "accel.time_offset".to_owned(),
            Self::GSensitivity => format!("gyro.g_sensitivity.{}{}", AXES[k / 3], AXES[k % 3]),
        })
    }
}

impl Sensed {
    /// `t(q)`: what terms with these parameters add to the input of a triad, rad/s or m/s².
    pub fn added(&self, sensor: Sensor, q: &TermVector) -> Vector3<f64> {
        let of = |term: Term| q.rows_range(term.parameters());
        let f = &self.force;
        match sensor {
            Sensor::Gyro => {
                let q = of(Term::GSensitivity);
                Vector3::from_fn(|row, _| {
                    (0..3).map(|column| q[3 * row + column] * f[column]).sum()
                })
            }
            Sensor::Accel => {
                let (second, asymmetry) = (of(Term::AccelSecondOrder), of(Term::AccelAsymmetry));
                let (arms, turning) = (of(Term::SizeEffect), self.of_lever_arm());
                let later = exp(-self.turn(of(Term::TimeOffset)[0])) * f - f;
                Vector3::from_fn(|axis, _| {
                    let arm = |component: usize| arms[3 * axis + component];
                    let of_arm = if axis < 2 {
                        (0..3).map(|c| turning[(axis, c)] * arm(c)).sum()
                    } else {
                        0.0
                    };
                    second[axis] * f[axis].powi(2) + asymmetry[axis] * f[axis].abs() + of_arm
                }) + later
            }
        }
    }

    /// `∂t/∂q` of one triad, in rad/s or m/s² by the unit of each parameter, where the parameters are
    /// these. Only that of the time offset depends on them.
    pub fn response(&self, sensor: Sensor, q: &TermVector) -> TermResponse {
        let mut response = TermResponse::zeros();
        let f = &self.force;
        match sensor {
            Sensor::Gyro => {
                let first = Term::GSensitivity.parameters().start;
                for row in 0..3 {
                    for column in 0..3 {
                        response[(row, first + 3 * row + column)] = f[column];
                    }
                }
            }
            Sensor::Accel => {
                let turning = self.of_lever_arm();
                for axis in 0..3 {
                    let at = |term: Term, k: usize| (axis, term.parameters().start + k);
                    response[at(Term::AccelSecondOrder, axis)] = f[axis] * f[axis];
                    response[at(Term::AccelAsymmetry, axis)] = f[axis].abs();
                    if axis < 2 {
                        for component in 0..3 {
                            response[at(Term::SizeEffect, 3 * axis + component)] =
                                turning[(axis, component)];
                        }
                    }
                }
                let offset = Term::TimeOffset.parameters().start;
                let rate = self.rate_over_earth + self.angular_acceleration * q[offset];
                response.column_mut(offset).copy_from(&-rate.cross(f));
            }
        }
        response
    }

    /// The rotation vector of the body's turn over the Earth in a time from now, rad.
    fn turn(&self, time: f64) -> Vector3<f64> {
        self.rate_over_earth * time + self.angular_acceleration * (0.5 * time * time)
    }

    /// `[ω̇×] + [ω×]²`.
    fn of_lever_arm(&self) -> Matrix3<f64> {
        let rate = self.rate.cross_matrix();
        self.angular_acceleration.cross_matrix() + rate * rate
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With nothing special about it.
    fn any() -> Sensed {
        Sensed {
            rate: Vector3::new(0.1, -0.2, 0.3),
            rate_over_earth: Vector3::new(0.3, -0.2, 0.1),
            angular_acceleration: Vector3::new(1.0, 2.0, 3.0),
            force: Vector3::new(4.0, -5.0, 6.0),
        }
    }

    #[test]
    fn every_parameter_has_a_term_a_name_and_a_triad_that_responds() {
        let sensed = any();
        let mut names: Vec<String> = (0..TERM_PARAMETERS)
            .map_while(Term::parameter_name)
            .collect();
        names.sort();
        names.dedup();
        assert_eq!(names.len(), TERM_PARAMETERS);
        assert_eq!(Term::parameter_name(TERM_PARAMETERS), None);
        let q = TermVector::zeros();
        for parameter in 0..TERM_PARAMETERS {
            let sensor = Term::of(parameter).unwrap().sensor();
            for of in Sensor::ALL {
                let responds = sensed.response(of, &q).column(parameter).norm() > 0.0;
                assert_eq!(responds, of == sensor, "{parameter}");
            }
        }
    }

    #[test]
    fn an_accelerometer_on_an_arm_senses_centripetal_and_tangential_acceleration() {
        // 2 rad/s about z, faster by 3 rad/s², accelerometer x at 0.1 m along x and 0.2 m along y.
        let sensed = Sensed {
            rate: Vector3::new(0.0, 0.0, 2.0),
            rate_over_earth: Vector3::new(0.0, 0.0, 2.0),
            angular_acceleration: Vector3::new(0.0, 0.0, 3.0),
            force: Vector3::new(1.0, 0.0, 0.0),
        };
        let mut q = TermVector::zeros();
        q[Term::SizeEffect.parameters().start] = 0.1;
        q[Term::SizeEffect.parameters().start + 1] = 0.2;
        let added = sensed.added(Sensor::Accel, &q);
        // −ω² x − ω̇ y along x, nothing along y for the accelerometer x.
        assert!((added - Vector3::new(-4.0 * 0.1 - 3.0 * 0.2, 0.0, 0.0)).norm() < 1e-15);
    }

    #[test]
    fn samples_of_a_later_time_sense_gravity_turned_more() {
        let rate = Vector3::new(0.0, 0.4, 0.0);
        let up = |t: f64| crate::attitude::exp(-rate * t) * Vector3::new(0.0, 0.0, 9.8);
        let sensed = Sensed {
            rate,
            rate_over_earth: rate,
            angular_acceleration: Vector3::zeros(),
            force: up(1.0),
        };
        let offset = 0.02;
        let mut q = TermVector::zeros();
        q[Term::TimeOffset.parameters().start] = offset;
        let added = sensed.added(Sensor::Accel, &q);
        assert!((up(1.0 + offset) - up(1.0) - added).norm() < 1e-13);
    }

    #[test]
    fn the_response_is_the_derivative_of_what_is_added() {
        let sensed = any();
        let q = TermVector::from_fn(|k, _| 1e-3 * (k as f64 - 7.0));
        for sensor in Sensor::ALL {
            let response = sensed.response(sensor, &q);
            for k in 0..TERM_PARAMETERS {
                let mut step = TermVector::zeros();
                step[k] = 1e-5;
                let difference =
                    sensed.added(sensor, &(q + step)) - sensed.added(sensor, &(q - step));
                // The offset turns its own response by q ω, which is left out.
                let off = (response.column(k) - difference / 2e-5).norm();
                assert!(off < 1e-2, "{k}: {off}");
            }
        }
    }
}
