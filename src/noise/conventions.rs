//! The conventions for noise figures, and their users.
//!
//! Each row of the table contains a unit, its value in SI units, and the factor between the figure and the strength of
//! the process. Densities are two-sided (IEEE Std 952): white noise of density N has `σ = N √rate` in samples at that
//! rate. Sources: Kalibr, *IMU Noise Model* (wiki); PSINS, `imuerrset`; KF-GINS, its configuration file.

use Scale::{Increments, Linear, Power, Samples};
use serde::Serialize;

use crate::imu::Sensor;
use crate::units::{
    ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, DEGREE, MICRO_G, MILLIGAL, STANDARD_GRAVITY,
};

/// Relation of a figure to the strength of a process in SI.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Scale {
    /// A multiple of this unit.
    Linear(f64),
    /// A square, with the unit of its root.
    Power(f64),
    /// 1σ of each rate sample, at a sample rate.
    Samples(f64),
    /// 1σ of each increment, at a sample rate.
    Increments(f64),
}

impl Scale {
    /// The strength in SI; `None` if it needs a rate that is not given.
    fn strength(self, value: f64, rate: Option<f64>) -> Option<f64> {
        Some(match self {
            Linear(unit) => value * unit,
            Power(unit) => value.sqrt() * unit,
            Samples(unit) => value * unit / rate?.sqrt(),
            Increments(unit) => value * unit * rate?.sqrt(),
        })
    }

    fn value(self, strength: f64, rate: Option<f64>) -> Option<f64> {
        Some(match self {
            Linear(unit) => strength / unit,
            Power(unit) => (strength / unit).powi(2),
            Samples(unit) => strength / unit * rate?.sqrt(),
            Increments(unit) => strength / unit / rate?.sqrt(),
        })
    }
}

/// A quantity described by noise figures.
#[derive(Debug, PartialEq)]
struct Quantity {
    sensor: Sensor,
    /// Name of the quantity, such as `angle random walk`.
    name: &'static str,
    conventions: &'static [Convention],
}

/// A unit of a quantity, and its users.
#[derive(Debug, PartialEq, Serialize)]
pub struct Convention {
    /// Symbol.
    pub unit: &'static str,
    #[serde(skip)]
    scale: Scale,
    /// Name and users. Program keys in backticks are also accepted as unit names.
    pub meaning: &'static str,
    /// Other spellings of the unit, normalised.
    #[serde(skip)]
    also: &'static [&'static str],
}

const fn row(
    unit: &'static str,
    scale: Scale,
    meaning: &'static str,
    also: &'static [&'static str],
) -> Convention {
    Convention {
        unit,
        scale,
        meaning,
        also,
    }
}

/// √3600: converts from the root of a second to that of an hour.
const SQRT_H: f64 = 60.0;
/// Floor of the Allan deviation of flicker noise, divided by its coefficient: √(2 ln 2 / π).
const FLOOR: f64 = 0.664_282;
/// 1σ of the Gauss–Markov process whose Allan deviation peaks (at 0.617 σ) at that floor, divided by the coefficient.
const MARKOV: f64 = FLOOR / 0.617_362;

/// Every unit of every quantity. An ambiguous unit has the first possible meaning.
#[rustfmt::skip]
static QUANTITIES: [Quantity; 6] = [
    Quantity { sensor: Sensor::Gyro, name: "angle random walk", conventions: &[
        row("°/√h", Linear(DEG_PER_SQRT_H), "angle random walk: data sheets, turncal, PSINS `web`, KF-GINS `arw`",
            &["angle_random_walk_deg_per_sqrt_h"]),
        row("°/h/√Hz", Linear(DEG_PER_H), "rate noise density: data sheets of optical gyros", &[]),
        row("°/s/√Hz", Linear(DEGREE), "rate noise density: data sheets of MEMS gyros", &[]),
        row("m°/s/√Hz", Linear(1e-3 * DEGREE), "rate noise density (mdps/√Hz): data sheets of MEMS gyros", &[]),
        row("rad/s/√Hz", Linear(1.0), "rate noise density: Kalibr `gyroscope_noise_density`", &["rad/sqrts"]),
        row("″/√s", Linear(ARCSEC), "angle random walk over one second", &[]),
        row("rad²/s", Power(1.0), "power spectral density (rad/s)²/Hz, two-sided: Q of a Kalman filter, GTSAM",
            &["rad/s2/hz", "rad2/s2/hz"]),
        row("°²/h", Power(DEG_PER_SQRT_H), "angle variance over one hour", &[]),
        row("rad/s", Samples(1.0), "1σ of each rate sample", &[]),
        row("°/s", Samples(DEGREE), "1σ of each rate sample", &[]),
        row("°/h", Samples(DEG_PER_H), "1σ of each rate sample", &[]),
        row("rad", Increments(1.0), "1σ of each angle increment", &[]),
        row("″", Increments(ARCSEC), "1σ of each angle increment", &[]),
    ] },
    Quantity { sensor: Sensor::Accel, name: "velocity random walk", conventions: &[
        row("µg/√Hz", Linear(MICRO_G), "noise density: data sheets, turncal, PSINS `wdb`",
            &["velocity_random_walk_ug_per_sqrt_hz"]),
        row("mg/√Hz", Linear(1e3 * MICRO_G), "noise density: data sheets", &[]),
        row("m/s²/√Hz", Linear(1.0), "noise density: Kalibr `accelerometer_noise_density`; m/s/√s", &["m/s/sqrts"]),
        row("m/s/√h", Linear(1.0 / SQRT_H), "velocity random walk: data sheets, KF-GINS `vrw`", &[]),
        row("g/√Hz", Linear(STANDARD_GRAVITY), "noise density: data sheets", &[]),
        row("m²/s³", Power(1.0), "power spectral density (m/s²)²/Hz, two-sided: Q of a Kalman filter, GTSAM",
            &["m/s22/hz", "m2/s4/hz"]),
        row("m/s²", Samples(1.0), "1σ of each sample", &[]),
        row("mg", Samples(1e3 * MICRO_G), "1σ of each sample", &[]),
        row("µg", Samples(MICRO_G), "1σ of each sample", &[]),
        row("mGal", Samples(MILLIGAL), "1σ of each sample", &[]),
        row("m/s", Increments(1.0), "1σ of each velocity increment", &[]),
    ] },
    Quantity { sensor: Sensor::Gyro, name: "gyro rate random walk", conventions: &[
        row("°/h/√h", Linear(DEG_PER_H / SQRT_H), "rate random walk: IEEE Std 952", &["deg/h1.5", "deg/h3/2"]),
        row("°/h/√s", Linear(DEG_PER_H), "rate random walk over one second", &[]),
        row("rad/s²/√Hz", Linear(1.0), "Kalibr `gyroscope_random_walk`; rad/s/√s", &["rad/s/sqrts"]),
        row("°/s²/√Hz", Linear(DEGREE), "rate random walk in degrees: logs of MEMS gyros; °/s/√s", &["deg/s/sqrts"]),
        row("°/s/√h", Linear(DEGREE / SQRT_H), "rate random walk over one hour", &[]),
        row("rad²/s³", Power(1.0), "power spectral density of the bias rate: Q of a Kalman filter", &[]),
    ] },
    Quantity { sensor: Sensor::Accel, name: "accelerometer bias random walk", conventions: &[
        row("µg/√h", Linear(MICRO_G / SQRT_H), "acceleration random walk: IEEE Std 1293", &[]),
        row("µg/√s", Linear(MICRO_G), "acceleration random walk over one second", &[]),
        row("m/s³/√Hz", Linear(1.0), "Kalibr `accelerometer_random_walk`; m/s²/√s", &["m/s2/sqrts"]),
        row("m²/s⁵", Power(1.0), "power spectral density of the bias rate: Q of a Kalman filter", &[]),
    ] },
    Quantity { sensor: Sensor::Gyro, name: "gyro bias instability", conventions: &[
        row("°/h", Linear(DEG_PER_H), "coefficient B: IEEE Std 952, many data sheets", &[]),
        row("°/s", Linear(DEGREE), "coefficient B: data sheets of MEMS gyros", &[]),
        row("rad/s", Linear(1.0), "coefficient B", &[]),
        row("°/h floor", Linear(DEG_PER_H / FLOOR), "minimum of the Allan deviation, 0.664 B: other data sheets",
            &["floor_deg/h"]),
        row("°/h Gauss–Markov", Linear(DEG_PER_H / MARKOV), "1σ whose Allan deviation peaks at that minimum: \
            turncal `gyro_gauss_markov_sigma_deg_per_h`, KF-GINS `gbstd`", &[]),
        row("rad/s Gauss–Markov", Linear(1.0 / MARKOV), "the same 1σ in SI", &[]),
    ] },
    Quantity { sensor: Sensor::Accel, name: "accelerometer bias instability", conventions: &[
        row("µg", Linear(MICRO_G), "coefficient B: IEEE Std 1293, many data sheets", &[]),
        row("mg", Linear(1e3 * MICRO_G), "coefficient B: data sheets", &[]),
        row("m/s²", Linear(1.0), "coefficient B", &[]),
        row("µg floor", Linear(MICRO_G / FLOOR), "minimum of the Allan deviation, 0.664 B: other data sheets",
            &["floor_ug"]),
        row("µg Gauss–Markov", Linear(MICRO_G / MARKOV), "1σ whose Allan deviation peaks at that minimum: \
            turncal `accel_gauss_markov_sigma_ug`", &[]),
        row("mGal Gauss–Markov", Linear(MILLIGAL / MARKOV), "the same 1σ: KF-GINS `abstd`", &["mgal"]),
    ] },
];

/// A noise figure, converted to every convention.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Conversion {
    /// Name of the quantity.
    pub quantity: &'static str,
    /// Name of the triad of the quantity.
    pub sensor: &'static str,
    /// The figure, as it was interpreted.
    pub given: Figure,
    /// Sample rate in Hz.
    pub rate_hz: Option<f64>,
    /// The figure in every convention.
    pub figures: Vec<Figure>,
}

/// A noise figure, converted to one convention.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// Value in the unit of the convention.
    pub value: f64,
    /// The convention.
    #[serde(flatten)]
    pub convention: &'static Convention,
}

/// Errors for a figure that cannot be converted.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ConversionError {
    /// Unknown unit.
    #[error(
        "`{unit}` is not a known noise unit. Give one of these (also in the form deg/sqrt(h), ug/sqrt(Hz), m/s^2):
{}",
        known()
    )]
    Unknown {
        /// The unit, as given by the user.
        unit: String,
    },
    /// The figure is noise per sample, but no sample rate is given.
    #[error(
        "`{unit}` is noise per sample, which needs the sample rate: add --rate with the rate in Hz"
    )]
    NoRate {
        /// The unit, as given by the user.
        unit: String,
    },
}

/// Converts a figure into every convention of its quantity. With a sample rate in Hz, an ambiguous unit is interpreted
/// as noise per sample; without a sample rate, as a bias instability.
///
/// # Errors
/// Returns [`ConversionError`] if the unit is not known, or needs a rate.
pub fn convert(value: f64, unit: &str, rate: Option<f64>) -> Result<Conversion, ConversionError> {
    let wanted = normalised(unit);
    let matching = || all().filter(|(_, row)| row.names().any(|name| name == wanted));
    let usable = matching()
        .find_map(|(quantity, row)| Some((quantity, row, row.scale.strength(value, rate)?)));
    let Some((quantity, convention, strength)) = usable else {
        let unit = unit.to_owned();
        return Err(match matching().next() {
            Some(_) => ConversionError::NoRate { unit },
            None => ConversionError::Unknown { unit },
        });
    };
    let figure = |convention: &'static Convention| {
        let value = convention.scale.value(strength, rate)?;
        Some(Figure { value, convention })
    };
    Ok(Conversion {
        quantity: quantity.name,
        sensor: quantity.sensor.name(),
        given: Figure { value, convention },
        rate_hz: rate,
        figures: quantity.conventions.iter().filter_map(figure).collect(),
    })
}

fn all() -> impl Iterator<Item = (&'static Quantity, &'static Convention)> {
    let quantities = QUANTITIES.iter();
    quantities.flat_map(|quantity| quantity.conventions.iter().map(move |row| (quantity, row)))
}

impl Convention {
    /// Every accepted name, normalised.
    fn names(&self) -> impl Iterator<Item = String> {
        let keys = self.meaning.split('`').skip(1).step_by(2);
        let names = keys.chain(self.also.iter().copied()).map(str::to_owned);
        std::iter::once(normalised(self.unit)).chain(names)
    }
}

/// The canonical spelling of a unit; seconds in the denominator are combined into one power.
pub fn normalised(unit: &str) -> String {
    const SAME: &str = "µ=u μ=u °=deg º=deg ″=arcsec √=sqrt ²=2 ³=3 ⁵=5 ⁻=- ¹=1 –=- dps=deg/s";
    let text = unit.to_lowercase().replace(['^', '(', ')', ' '], "");
    let pairs = SAME.split(' ').filter_map(|pair| pair.split_once('='));
    let text = pairs.fold(text, |text, (from, to)| text.replace(from, to));
    let mut parts = text.split('/').map(part);
    let above = parts.next().unwrap_or_default();
    let (seconds, others): (Vec<_>, Vec<_>) =
        parts.partition(|part| power_of_seconds(part).is_some());
    let powers = seconds.iter().filter_map(|part| power_of_seconds(part));
    let power = powers.fold(0, u32::saturating_add);
    let seconds = match power {
        0 => String::new(),
        1 => "/s".to_owned(),
        _ => format!("/s{power}"),
    };
    let others = others.iter().map(|part| format!("/{part}"));
    above + &seconds + &others.collect::<String>()
}

fn power_of_seconds(part: &str) -> Option<u32> {
    match part.strip_prefix('s')? {
        "" => Some(1),
        power => power.parse().ok(),
    }
}

/// One part between slashes, with the canonical word for a time and its root.
fn part(part: &str) -> String {
    let base = part.strip_prefix("sqrt").or(part.strip_prefix("rt"));
    let root = if base.is_some() { "sqrt" } else { "" };
    let base = base.unwrap_or(part);
    let power = &base[base.trim_end_matches(|c: char| c.is_ascii_digit()).len()..];
    let base = match &base[..base.len() - power.len()] {
        "sec" | "secs" | "second" => "s",
        "hr" | "hour" => "h",
        base => base,
    };
    format!("{root}{base}{power}")
}

/// All units, one line per quantity.
pub fn known() -> String {
    let unit = |row: &Convention| match row.scale.strength(1.0, None) {
        Some(_) => row.unit.to_owned(),
        None => format!("{} (with --rate)", row.unit),
    };
    let line = |quantity: &Quantity| {
        let units: Vec<String> = quantity.conventions.iter().map(unit).collect();
        format!("  {}: {}", quantity.name, units.join(", "))
    };
    QUANTITIES.each_ref().map(line).join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(conversion: &Conversion, unit: &str) -> f64 {
        let mut figures = conversion.figures.iter();
        let figure = figures.find(|figure| figure.convention.unit == unit);
        figure.unwrap_or_else(|| panic!("no {unit}")).value
    }

    fn assert_close(found: f64, expected: f64) {
        assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
    }

    #[test]
    fn the_angle_random_walk_of_a_mems_gyro_in_every_convention() {
        // 0.3 °/√h: × 60 in an hour's root of seconds, π/180 a degree.
        for (figure, unit) in [
            (0.3, "deg/sqrt(hr)"),
            (0.3, "°/√h"),
            (18.0, "°/h/√Hz"),
            (0.005, "dps/sqrt(Hz)"),
            (8.726_646e-5, "rad/s/sqrt(Hz)"),
            (7.615_435e-9, "(rad/s)^2/Hz"),
            (0.3, "arw"),
            (8.726_646e-5, "gyroscope_noise_density"),
            (8.726_646e-4, "rad/s"),
            (0.05, "deg/s"),
            (8.726_646e-6, "rad"),
            (1.8, "arcsec"),
        ] {
            let conversion = convert(figure, unit, Some(100.0)).unwrap();
            for (expected, unit) in [
                (0.3, "°/√h"),
                (18.0, "°/h/√Hz"),
                (0.005, "°/s/√Hz"),
                (8.726_646e-5, "rad/s/√Hz"),
                (7.615_435e-9, "rad²/s"),
                (0.05, "°/s"),
                (8.726_646e-4, "rad/s"),
                (1.8, "″"),
            ] {
                assert_close(value(&conversion, unit), expected);
            }
        }
    }

    #[test]
    fn the_velocity_random_walk_of_a_mems_accelerometer_in_every_convention() {
        // 100 µg/√Hz = 9.80665e-4 m/s²/√Hz; 60 times that in m/s/√h; squared in m²/s³.
        for (figure, unit) in [
            (100.0, "ug/sqrt(Hz)"),
            (0.058_839_9, "m/s/√h"),
            (9.617_038e-7, "m^2/s^3"),
            (9.806_65e-4, "accelerometer_noise_density"),
            (0.058_839_9, "vrw"),
            (100.0, "wdb"),
            (9.806_65e-3, "m/s^2"),
            (9.806_65e-5, "m/s"),
            (1.0, "mg"),
        ] {
            let conversion = convert(figure, unit, Some(100.0)).unwrap();
            for (expected, unit) in [
                (100.0, "µg/√Hz"),
                (0.1, "mg/√Hz"),
                (9.806_65e-4, "m/s²/√Hz"),
                (0.058_839_9, "m/s/√h"),
                (9.617_038e-7, "m²/s³"),
                (9.806_65e-5, "m/s"),
            ] {
                assert_close(value(&conversion, unit), expected);
            }
        }
    }

    #[test]
    fn a_rate_random_walk_and_a_bias_instability_are_no_white_noise() {
        // 1 °/h/√h = 4.848137e-6 / 60 rad/s²/√Hz.
        let walk = convert(1.0, "deg/h/sqrt(h)", None).unwrap();
        assert_close(value(&walk, "rad/s²/√Hz"), 8.080_228e-8);
        let walk = convert(1e-4, "accelerometer_random_walk", None).unwrap();
        assert_close(value(&walk, "µg/√h"), 1e-4 * 60.0 / 9.806_65e-6);
        let floor = convert(1.0, "deg/h", None).unwrap();
        assert_eq!(floor.quantity, "gyro bias instability");
        assert_close(value(&floor, "rad/s"), 4.848_137e-6);
        let samples = convert(1.0, "deg/h", Some(100.0)).unwrap();
        assert_eq!(samples.quantity, "angle random walk");
        assert_close(value(&samples, "°/h/√Hz"), 0.1);
    }

    #[test]
    fn every_unit_is_understood_as_it_is_shown_and_gives_itself_back() {
        for quantity in &QUANTITIES {
            for convention in quantity.conventions {
                let conversion = convert(3.0, convention.unit, Some(50.0)).unwrap();
                assert_close(value(&conversion, conversion.given.convention.unit), 3.0);
            }
        }
    }

    #[test]
    fn spellings_of_time_and_its_root_are_one_unit() {
        for (figure, unit, expected, si) in [
            (0.0135, "deg/sec/sqrt(Hz)", 2.356_194e-4, "rad/s/√Hz"),
            (0.001_947_4, "deg/s/s/sqrt(Hz)", 3.398_854e-5, "rad/s²/√Hz"),
            (2.509e-4, "m/s^2/s/sqrt(Hz)", 2.509e-4, "m/s³/√Hz"),
            (3.8, "mdps/rtHz", 6.632_251e-5, "rad/s/√Hz"),
            (0.06, "m/sec/√hr", 1e-3, "m/s²/√Hz"),
            (1.0, "m/(sec^2)/rt(Hz)", 1.0, "m/s²/√Hz"),
        ] {
            let conversion = convert(figure, unit, None).unwrap_or_else(|error| panic!("{error}"));
            assert_close(value(&conversion, si), expected);
        }
    }

    #[test]
    fn an_unknown_unit_is_answered_with_the_known_ones() {
        let error = convert(1.0, "deg/sqrt(Hs)", None).unwrap_err().to_string();
        assert!(
            error.contains("`deg/sqrt(Hs)`") && error.contains("µg/√Hz"),
            "{error}"
        );
        let error = convert(1.0, "rad", None).unwrap_err().to_string();
        assert!(error.contains("--rate"), "{error}");
    }
}
