//! Error terms of an instrument, in addition to `K`, `E` and `D`. Each term adds `t(q)` to the input of a triad, `N = K
//! C (u + t(q)) + D`, with its own parameters `q`.
//!
//! A term consists of a [`TermEntry`] in a separate file and a line in the registry below. Options, files, simulation,
//! estimation, budget, report and exports read the entry.
//!
//! Source: IEEE Std 1293-2018, §5.3 (accelerometers: second and third order, cross coupling,
//! asymmetry); IEEE Std 952-2020, §5 (gyros: acceleration sensitivity, asymmetry and nonlinearity of the
//! scale factor); IEEE Std 528-2019 (gyros: acceleration-squared sensitivity); Savage, *Strapdown Analytics*, 2nd ed., §8.1.4 (size effect, time offset).

use nalgebra::{SMatrix, SVector, Vector3};
use serde::{Deserialize, Serialize};

use super::{Noise, PerSensor, Sensor};
use crate::units::{DEG_PER_SQRT_H, MICRO_G_PER_SQRT_HZ};

mod entry;

mod accel_cross_coupling;
mod accel_second_order;
mod accel_third_order;
mod asymmetry;
mod g2_sensitivity;
mod g_sensitivity;
mod gyro_nonlinearity;
mod gyro_second_order;
mod size_effect;
mod time_offset;

pub use entry::{REFERENCE_RATE, Sensed, TermEntry};

/// Declares [`Term`] with one line per term, in the order of the parameters.
macro_rules! registry {
    ($($(#[$doc:meta])* $term:ident: $entry:path,)*) => {
        /// An error term.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
        pub enum Term {
            $($(#[$doc])* $term,)*
        }

        impl Term {
            /// Every term, in the order of the parameters.
            pub const ALL: [Self; [$(stringify!($term)),*].len()] = [$(Self::$term),*];

            /// Names of the terms, in the same order.
            pub const NAMES: [&'static str; Self::ALL.len()] = [$($entry.name),*];

            /// Names, units and effect of the term.
            pub const fn entry(self) -> &'static TermEntry {
                match self {
                    $(Self::$term => &$entry,)*
                }
            }
        }
    };
}

// The order is that of the states and of existing files, so a new term must be last.
registry! {
    /// Accelerometers add `q_i f_i²`; q in s²/m.
    AccelSecondOrder: accel_second_order::ENTRY,
    /// Accelerometers add `q_i |f_i|`: the scale factor differs between positive and negative specific force.
    AccelAsymmetry: asymmetry::ACCEL,
    /// Accelerometers x and y are displaced from z by lever arms in m along body axes.
    SizeEffect: size_effect::ENTRY,
    /// Accelerometer samples refer to a time q later than gyro samples, in s.
    TimeOffset: time_offset::ENTRY,
    /// Gyros add `Q f`, Q row by row, in rad/s per m/s².
    GSensitivity: g_sensitivity::ENTRY,
    /// Gyros add `q_i |ω_i|`: the scale factor differs between the two senses of rotation.
    GyroAsymmetry: asymmetry::GYRO,
    /// Gyros add `q_i ω_i² / ω_r`, which is even in the rate; ω_r is [`REFERENCE_RATE`].
    GyroSecondOrder: gyro_second_order::ENTRY,
    /// Gyros add `q_i |ω_i| ω_i / ω_r + c_i ω_i³ / ω_r²`, which are odd in the rate. Three q, then three c.
    GyroNonlinearity: gyro_nonlinearity::ENTRY,
    /// Accelerometers add `q_i f_i³`; q in s⁴/m².
    AccelThirdOrder: accel_third_order::ENTRY,
    /// Accelerometers add `q_i1 f_x f_y + q_i2 f_x f_z + q_i3 f_y f_z`; q in s²/m.
    AccelCrossCoupling: accel_cross_coupling::ENTRY,
    /// Gyros add `q_i f_i²`, in rad/s per (m/s²)².
    G2Sensitivity: g2_sensitivity::ENTRY,
}

/// White noise of precise instruments (ring laser, quartz pendulum): rad/√s and (m/s)/√s.
const PRECISE: PerSensor<f64> = PerSensor {
    gyro: 0.003 * DEG_PER_SQRT_H,
    accel: 10.0 * MICRO_G_PER_SQRT_HZ,
};

/// Index of the first parameter of each term, and the number of all.
const FIRST: [usize; Term::ALL.len() + 1] = {
    let mut first = [0; Term::ALL.len() + 1];
    let mut k = 0;
    while k < Term::ALL.len() {
        first[k + 1] = first[k] + Term::ALL[k].entry().parameters.1.len();
        k += 1;
    }
    first
};

/// Number of parameters of all terms.
pub const TERM_PARAMETERS: usize = FIRST[Term::ALL.len()];
/// The parameters of all terms, in the order of [`Term::ALL`]; zero where a term is off.
pub type TermVector = SVector<f64, TERM_PARAMETERS>;
/// Effect of each parameter on the input of a triad.
pub type TermResponse = SMatrix<f64, 3, TERM_PARAMETERS>;

impl Term {
    /// Name in files and commands.
    pub fn name(self) -> &'static str {
        self.entry().name
    }

    /// The terms of a triad.
    fn of_sensor(sensor: Sensor) -> impl Iterator<Item = Self> {
        let all = Self::ALL.into_iter();
        all.filter(move |term| term.entry().sensor == sensor)
    }

    /// Default 1σ of each parameter of the term, in SI: ten times the value of precise instruments.
    pub fn usual_sigma(self) -> f64 {
        let entry = self.entry();
        entry.usual_sigma * entry.unit.1
    }

    /// Usual size of each parameter in an instrument with this noise, in SI units. This is the size in precise
    /// instruments times the ratio of the white noise of the triad to that of precise instruments. Lever arms and
    /// delays do not depend on the class of instrument.
    pub fn usual_size(self, noise: &PerSensor<Noise>) -> f64 {
        let precise = 0.1 * self.usual_sigma();
        if matches!(self, Self::SizeEffect | Self::TimeOffset) {
            return precise;
        }
        let sensor = self.entry().sensor;
        precise * (noise.get(sensor).random_walk / PRECISE.get(sensor)).max(1.0)
    }

    /// Indices of the parameters of the term.
    pub const fn parameters(self) -> std::ops::Range<usize> {
        FIRST[self as usize]..FIRST[self as usize + 1]
    }

    /// The term to which a parameter belongs.
    pub fn of(parameter: usize) -> Option<Self> {
        let has = |term: &Self| term.parameters().contains(&parameter);
        Self::ALL.into_iter().find(has)
    }

    /// The name of a parameter in files; `None` beyond the last.
    pub fn parameter_name(parameter: usize) -> Option<String> {
        let term = Self::of(parameter)?;
        let (stem, ends) = term.entry().parameters;
        let end = ends[parameter - term.parameters().start];
        Some(format!("{stem}{end}"))
    }

    /// The parameter with this name in files.
    pub fn parameter_named(name: &str) -> Option<usize> {
        (0..TERM_PARAMETERS).find(|&k| Self::parameter_name(k).as_deref() == Some(name))
    }
}

impl Sensed {
    /// `t(q)`, which the terms with these parameters add to the input of a triad, rad/s or m/s².
    pub fn added(&self, sensor: Sensor, q: &TermVector) -> Vector3<f64> {
        let mut linear = self.response(sensor, q);
        let mut others = Vector3::zeros();
        for term in Term::of_sensor(sensor) {
            if let Some(added) = term.entry().added {
                linear.columns_range_mut(term.parameters()).fill(0.0);
                others += added(self, &q.as_slice()[term.parameters()]);
            }
        }
        linear * q + others
    }

    /// `∂t/∂q` of one triad at these parameters, in rad/s or m/s² per unit of each parameter.
    pub fn response(&self, sensor: Sensor, q: &TermVector) -> TermResponse {
        let mut response = TermResponse::zeros();
        for term in Term::of_sensor(sensor) {
            let own = term.parameters();
            let columns = &mut response.columns_mut(own.start, own.len());
            (term.entry().response)(self, &q.as_slice()[own], columns);
        }
        response
    }
}

#[cfg(test)]
mod tests;
