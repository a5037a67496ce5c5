//! Error terms of an instrument, beside `K`, `E` and `D`: each changes what a triad takes for
//! its input, `N = K C (u + t(q)) + D`, by parameters `q` of its own.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use serde::{Deserialize, Serialize};

use super::{AXES, Sensor};
use crate::attitude::exp;
use crate::units::{DEG_PER_H, DEGREE, MICRO_G, PPM, STANDARD_GRAVITY};

/// Number of parameters of all terms.
pub const TERM_PARAMETERS: usize = 46;
/// The parameters of all terms, in the order of [`Term::ALL`]; zero where a term is off.
pub type TermVector = SVector<f64, TERM_PARAMETERS>;
/// What each parameter adds to the input of a triad.
pub type TermResponse = SMatrix<f64, 3, TERM_PARAMETERS>;

/// Rate at which nonlinearity of the gyros is stated, 100 °/s, in rad/s.
pub const REFERENCE_RATE: f64 = 100.0 * DEGREE;

/// An error term.
///
/// Source: IEEE Std 1293-2018, §5.3 (accelerometers: second and third order, cross coupling,
/// asymmetry); IEEE Std 952-2020, §5 (gyros: acceleration sensitivity, asymmetry and nonlinearity of the
/// scale factor); Savage, *Strapdown Analytics*, 2nd ed., §8.1.4 (size effect,
/// time offset).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
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
    /// Gyros add `q_i |ω_i|`: another scale factor in one sense of turn than in the other.
    GyroAsymmetry,
    /// Gyros add `q_i ω_i² / ω_r`, which is even in the rate; ω_r is [`REFERENCE_RATE`].
    GyroSecondOrder,
    /// Gyros add `q_i |ω_i| ω_i / ω_r + c_i ω_i³ / ω_r²`, which are odd in the rate: the scale factor
    /// changes with its magnitude. Three q, then three c.
    GyroNonlinearity,
    /// Accelerometers add `q_i f_i³`; q in s⁴/m².
    AccelThirdOrder,
    /// Accelerometers add `q_i1 f_x f_y + q_i2 f_x f_z + q_i3 f_y f_z`; q in s²/m.
    AccelCrossCoupling,
}

/// Products of two components of specific force, in the order of the parameters of
/// [`Term::AccelCrossCoupling`].
const PRODUCTS: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

/// Index of the first parameter of each term.
const FIRST: [usize; Term::ALL.len()] = {
    let mut first = [0; Term::ALL.len()];
    let mut k = 1;
    while k < first.len() {
        first[k] = first[k - 1] + Term::ALL[k - 1].size();
        k += 1;
    }
    first
};

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
    pub const ALL: [Self; 10] = [
        Self::AccelSecondOrder,
        Self::AccelAsymmetry,
        Self::SizeEffect,
        Self::TimeOffset,
        Self::GSensitivity,
        Self::GyroAsymmetry,
        Self::GyroSecondOrder,
        Self::GyroNonlinearity,
        Self::AccelThirdOrder,
        Self::AccelCrossCoupling,
    ];

    /// The name that files and commands use.
    pub fn name(self) -> &'static str {
        match self {
            Self::AccelSecondOrder => "accel-second-order",
            Self::AccelAsymmetry => "accel-asymmetry",
            Self::SizeEffect => "size-effect",
            Self::TimeOffset => "time-offset",
            Self::GSensitivity => "g-sensitivity",
            Self::GyroAsymmetry => "gyro-asymmetry",
            Self::GyroSecondOrder => "gyro-second-order",
            Self::GyroNonlinearity => "gyro-nonlinearity",
            Self::AccelThirdOrder => "accel-third-order",
            Self::AccelCrossCoupling => "accel-cross-coupling",
        }
    }

    /// The unit of its parameters in files and reports: its name, and its value in SI.
    pub fn unit(self) -> (&'static str, f64) {
        match self {
            Self::AccelSecondOrder | Self::AccelCrossCoupling => {
                ("µg/g²", MICRO_G / STANDARD_GRAVITY.powi(2))
            }
            Self::AccelThirdOrder => ("µg/g³", MICRO_G / STANDARD_GRAVITY.powi(3)),
            Self::AccelAsymmetry | Self::GyroAsymmetry => ("ppm", PPM),
            Self::GyroSecondOrder | Self::GyroNonlinearity => ("ppm at 100 °/s", PPM),
            Self::SizeEffect => ("mm", 1e-3),
            Self::TimeOffset => ("ms", 1e-3),
            Self::GSensitivity => ("°/h/g", DEG_PER_H / STANDARD_GRAVITY),
        }
    }

    /// What a parameter q adds to specific force f or angular rate w.
    pub fn adds(self) -> &'static str {
        match self {
            Self::AccelSecondOrder => "q f^2 along its axis to f",
            Self::AccelAsymmetry => "q |f| along its axis to f",
            Self::SizeEffect => "its row of ([w' x] + [w x]^2) r to f, r the lever arm",
            Self::TimeOffset => "-q w x f to f, accelerometers sampled later",
            Self::GSensitivity => "Q f to w, this the row and column of Q",
            Self::GyroAsymmetry => "q |w| along its axis to w",
            Self::GyroSecondOrder => "q w^2 / r along its axis to w, r = 100 deg/s",
            Self::GyroNonlinearity => {
                "q |w| w / r (odd quadratic), q w^3 / r^2 (third order) along its axis to w, r = 100 \
                 deg/s"
            }
            Self::AccelThirdOrder => "q f^3 along its axis to f",
            Self::AccelCrossCoupling => "q times the product of these two of f along its axis to f",
        }
    }

    /// 1σ of each of its parameters where nothing better is known, in SI: ten times what precise
    /// instruments have.
    pub fn usual_sigma(self) -> f64 {
        let in_unit = match self {
            Self::AccelSecondOrder => 100.0,
            Self::AccelAsymmetry => 100.0,
            Self::AccelThirdOrder | Self::AccelCrossCoupling => 100.0,
            Self::GyroAsymmetry | Self::GyroSecondOrder | Self::GyroNonlinearity => 100.0,
            Self::SizeEffect => 100.0,
            Self::TimeOffset => 10.0,
            Self::GSensitivity => 1.0,
        };
        in_unit * self.unit().1
    }

    /// A parameter beyond this makes of gravity, or of a turn at [`REFERENCE_RATE`], as much again, as no
    /// instrument does, in SI.
    pub fn largest(self) -> f64 {
        match self {
            Self::AccelSecondOrder | Self::AccelCrossCoupling => STANDARD_GRAVITY.recip(),
            Self::AccelThirdOrder => STANDARD_GRAVITY.powi(-2),
            Self::AccelAsymmetry
            | Self::GyroAsymmetry
            | Self::GyroSecondOrder
            | Self::GyroNonlinearity => 1.0,
            Self::SizeEffect => STANDARD_GRAVITY / REFERENCE_RATE.powi(2),
            Self::TimeOffset => REFERENCE_RATE.recip(),
            Self::GSensitivity => REFERENCE_RATE / STANDARD_GRAVITY,
        }
    }

    /// Indices of its parameters.
    pub const fn parameters(self) -> std::ops::Range<usize> {
        let first = FIRST[self as usize];
        first..first + self.size()
    }

    const fn size(self) -> usize {
        match self {
            Self::AccelSecondOrder | Self::AccelAsymmetry | Self::AccelThirdOrder => 3,
            Self::GyroAsymmetry | Self::GyroSecondOrder => 3,
            Self::SizeEffect | Self::GyroNonlinearity => 6,
            Self::TimeOffset => 1,
            Self::GSensitivity | Self::AccelCrossCoupling => 9,
        }
    }

    /// Whose input it changes.
    pub fn sensor(self) -> Sensor {
        match self {
            Self::GSensitivity
            | Self::GyroAsymmetry
            | Self::GyroSecondOrder
            | Self::GyroNonlinearity => Sensor::Gyro,
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
            Self::GyroAsymmetry => format!("gyro.asymmetry.{}", AXES[k]),
            Self::GyroSecondOrder => format!("gyro.second_order.{}", AXES[k]),
            Self::GyroNonlinearity => {
                let kind = ["odd_quadratic", "third_order"][k / 3];
                format!("gyro.{kind}.{}", AXES[k % 3])
            }
            Self::AccelThirdOrder => format!("accel.third_order.{}", AXES[k]),
            // Accelerometer, then the components of specific force that are multiplied.
            Self::AccelCrossCoupling => {
                let (one, other) = PRODUCTS[k % 3];
                let product = [AXES[one], AXES[other]].map(String::from).concat();
                format!("accel.cross_coupling.{}.{product}", AXES[k / 3])
            }
        })
    }
}

impl Sensed {
    /// `t(q)`: what terms with these parameters add to the input of a triad, rad/s or m/s².
    pub fn added(&self, sensor: Sensor, q: &TermVector) -> Vector3<f64> {
        // All but the time offset are linear in their parameters.
        let linear = self.linear_response(sensor) * q;
        match sensor {
            Sensor::Gyro => linear,
            Sensor::Accel => {
                let offset = q[Term::TimeOffset.parameters().start];
                linear + exp(-self.turn(offset)) * self.force - self.force
            }
        }
    }

    /// `∂t/∂q` of one triad, in rad/s or m/s² by the unit of each parameter, where the parameters are
    /// these. Only that of the time offset depends on them.
    pub fn response(&self, sensor: Sensor, q: &TermVector) -> TermResponse {
        let mut response = self.linear_response(sensor);
        if sensor == Sensor::Accel {
            let offset = Term::TimeOffset.parameters().start;
            let rate = self.rate_over_earth + self.angular_acceleration * q[offset];
            response
                .column_mut(offset)
                .copy_from(&-rate.cross(&self.force));
        }
        response
    }

    /// `∂t/∂q` of one triad for all terms but the time offset.
    fn linear_response(&self, sensor: Sensor) -> TermResponse {
        let mut response = TermResponse::zeros();
        let (f, rate) = (&self.force, &self.rate);
        let turning = self.of_lever_arm();
        for axis in 0..3 {
            let mut set = |term: Term, k: usize, value: f64| {
                response[(axis, term.parameters().start + k)] = value;
            };
            match sensor {
                Sensor::Gyro => {
                    for column in 0..3 {
                        set(Term::GSensitivity, 3 * axis + column, f[column]);
                    }
                    let (w, relative) = (rate[axis], rate[axis] / REFERENCE_RATE);
                    set(Term::GyroAsymmetry, axis, w.abs());
                    set(Term::GyroSecondOrder, axis, w * relative);
                    set(Term::GyroNonlinearity, axis, w * relative.abs());
                    set(Term::GyroNonlinearity, 3 + axis, w * relative * relative);
                }
                Sensor::Accel => {
                    set(Term::AccelSecondOrder, axis, f[axis].powi(2));
                    set(Term::AccelAsymmetry, axis, f[axis].abs());
                    set(Term::AccelThirdOrder, axis, f[axis].powi(3));
                    for (k, &(one, other)) in PRODUCTS.iter().enumerate() {
                        set(Term::AccelCrossCoupling, 3 * axis + k, f[one] * f[other]);
                    }
                    if axis < 2 {
                        for component in 0..3 {
                            let value = turning[(axis, component)];
                            set(Term::SizeEffect, 3 * axis + component, value);
                        }
                    }
                }
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
mod tests;
