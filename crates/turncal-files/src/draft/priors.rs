//! The prior in a draft: scale and bias are estimated from the recording, and the other values are typical of
//! instruments with similar noise.

use nalgebra::Vector3;

use super::{Draft, Stated};
use crate::instrument::{USUAL_BIAS, USUAL_INSTALLATION, USUAL_SCALE};
use crate::schema::PriorFile;
use crate::schema::page::Remarks;
use turncal::imu::{Instrument, PerSensor, Prior, Sensor};
use turncal::number::rounded;
use turncal::units::{ARCSEC, DEG_PER_SQRT_H, DEGREE, MICRO_G_PER_SQRT_HZ, PPM};
use turncal_input::{Finite, OneOrThree};

/// Typical prior of a class of instruments, 1σ.
struct Class {
    name: &'static str,
    /// Gyro white noise below which an instrument belongs to this class, rad/√s.
    angle_random_walk: f64,
    /// Accelerometer white noise below which an instrument belongs to this class, (m/s)/√s.
    velocity_random_walk: f64,
    scale_ppm: f64,
    installation: f64,
    /// 1σ of the gyro bias, rad/s.
    gyro_bias: f64,
    /// 1σ of the accelerometer bias, m/s².
    accel_bias: f64,
}

/// Largest bias of an instrument of a class, in σ of that class.
const BEYOND: f64 = 3.0;

#[rustfmt::skip]
const CLASSES: [Class; 3] = [
    Class {
        name: "a navigation-grade",
        angle_random_walk: 0.01 * DEG_PER_SQRT_H, velocity_random_walk: 20.0 * MICRO_G_PER_SQRT_HZ,
        scale_ppm: 7_000.0, installation: 600.0 * ARCSEC, gyro_bias: 0.03 * DEGREE, accel_bias: 0.05,
    },
    Class {
        name: "a tactical-grade",
        angle_random_walk: 0.1 * DEG_PER_SQRT_H, velocity_random_walk: 60.0 * MICRO_G_PER_SQRT_HZ,
        scale_ppm: 10_000.0, installation: 3_600.0 * ARCSEC, gyro_bias: 0.2 * DEGREE, accel_bias: 0.2,
    },
    Class {
        name: "a MEMS",
        angle_random_walk: f64::INFINITY, velocity_random_walk: f64::INFINITY,
        scale_ppm: USUAL_SCALE / PPM, installation: USUAL_INSTALLATION, gyro_bias: USUAL_BIAS.gyro,
        accel_bias: USUAL_BIAS.accel,
    },
];

impl Class {
    /// Class according to the white noise of the gyros, otherwise of the accelerometers.
    fn of(walk: impl Fn(Sensor) -> Option<f64>) -> &'static Self {
        let is_of = |class: &&Class| match (walk(Sensor::Gyro), walk(Sensor::Accel)) {
            (Some(walk), _) => walk < class.angle_random_walk,
            (None, Some(walk)) => walk < class.velocity_random_walk,
            (None, None) => class.angle_random_walk.is_infinite(),
        };
        let [.., widest] = &CLASSES;
        CLASSES.iter().find(is_of).unwrap_or(widest)
    }

    fn bias(&self, sensor: Sensor) -> f64 {
        sensor.pick(self.gyro_bias, self.accel_bias)
    }
}

impl Stated {
    /// An instrument whose outputs are in rad/s and m/s², if its noise is stated.
    pub fn instrument(&self) -> Option<Instrument> {
        let noise = self.noise?;
        let class = Class::of(|sensor| Some(noise.get(sensor).random_walk));
        let stated = self.tolerances.as_ref();
        let scale = |of_it| stated.map_or(class.scale_ppm * PPM, |of| *of.scale.get(of_it));
        let bias = |of_it| stated.map_or(class.bias(of_it), |of| *of.bias.get(of_it));
        let prior = |sensor: Sensor| Prior {
            scale_sigma: Vector3::repeat(scale(sensor)),
            installation_sigma: Vector3::repeat(class.installation),
            bias: Vector3::zeros(),
            bias_sigma: Vector3::repeat(bias(sensor)),
        };
        Some(Instrument::new(PerSensor::from_fn(prior), noise))
    }
}

impl Draft {
    /// The prior of a triad: stated by the user, from a data sheet, or typical of its class.
    pub fn prior(&self, sensor: Sensor, remarks: &mut Remarks) -> PriorFile {
        let class = Class::of(|sensor| self.white_noise(sensor));
        let unit = self.quantities.units.get(sensor);
        let stated = self.stated.tolerances.as_ref();
        let scale_sigma = stated.map_or(class.scale_ppm, |of| of.scale.get(sensor) / PPM);
        let bias_sigma = stated.map_or(class.bias(sensor), |of| *of.bias.get(sensor));
        let from = match stated {
            Some(of) => format!("from the data sheet of {}", of.of),
            None => {
                let class = class.name;
                format!("typical value for {class} instrument; compare it with the data sheet")
            }
        };
        let table = format!("imu.prior.{}", sensor.name());
        let remark = format_args!("{from}; N = scale * installation * u + bias");
        remarks.before(&table, remark);
        let path = format!("{table}.scale");
        if let Some(scale) = &unit.scale {
            remarks.reason(&path, &scale.why);
        } else if unit.word.is_none_or(|word| word == "count") {
            remarks.open(&path, open_scale(sensor));
        }
        let off = unit.scale.as_ref().map_or(0.0, |scale| 1e6 * scale.off);
        let scale_sigma = rounded(scale_sigma, 7).max(rounded(off, 4));
        let one = |value: f64| Some(OneOrThree::One(Finite(value)));
        let (bias, bias_sigma) = self.bias(sensor, bias_sigma, &table, remarks);
        PriorFile {
            scale: unit
                .scale
                .as_ref()
                .and_then(|scale| one(rounded(scale.value, 7))),
            scale_sigma_ppm: one(scale_sigma),
            installation_sigma_arcsec: one(class.installation / ARCSEC),
            bias: bias.map(|bias| bias.map(|value| rounded(value, 7)).into()),
            bias_sigma: bias_sigma.and_then(one),
        }
    }

    /// Bias and its σ, in the quantity of the file per second.
    fn bias(
        &self,
        sensor: Sensor,
        usual: f64,
        table: &str,
        remarks: &mut Remarks,
    ) -> (Option<Vector3<f64>>, Option<f64>) {
        let per_second = self.quantities.per_second(self.clock.period.unwrap_or(1.0));
        let usual = self.quantities.scale(sensor).map(|scale| usual * scale);
        let motion = self.motion.as_ref().filter(|_| sensor == Sensor::Gyro);
        let rest = motion.map_or_else(Vector3::zeros, |motion| motion.rest * per_second);
        let beyond = usual.map_or(f64::INFINITY, |usual| BEYOND * usual);
        let is_own = self.quantities.is_count(sensor) && rest.amax() > beyond;
        let (zero, off, why) = if is_own {
            (rest, 0.0, "mean output at rest")
        } else {
            let why = "the output of an unsigned register at zero input";
            (Vector3::zeros(), rest.amax(), why)
        };
        remarks.reason(&format!("{table}.bias"), why);
        let unit = match per_second {
            1.0 => "in the unit of the file",
            _ => "in the unit of the file, per second",
        };
        remarks.reason(&format!("{table}.bias_sigma"), unit);
        let bias = zero.add_scalar(per_second * self.offset.get(sensor));
        let sigma = usual.map(|usual| rounded(usual.max(2.0 * off), 4));
        (Some(bias).filter(|bias| *bias != Vector3::zeros()), sigma)
    }
}

/// Meaning of a scale factor that the log does not show.
fn open_scale(sensor: Sensor) -> &'static str {
    sensor.pick(
        "counts per rad/s from the data sheet: 57.29578 times the counts per deg/s, which are often 131, 65.5, 32.8 \
         or 16.4; turncal could not estimate this value from the change of gravity direction",
        "counts per m/s² from the data sheet: counts per g divided by 9.80665; turncal could not estimate this value \
         from gravity at rest",
    )
}
