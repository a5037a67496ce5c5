//! The conventions in which noise figures are stated, and who uses which.
//!
//! One table of units drives every conversion: each says what one of it is in SI. Densities are
//! two-sided (IEEE Std 952): white noise of density N has `σ = N √rate` in samples at that rate.
//! Sources: Kalibr, *IMU Noise Model* (wiki); PSINS, `imuerrset`; KF-GINS, its configuration file.

mod table;

use crate::imu::Sensor;

use table::QUANTITIES;

/// How a figure follows from the strength of a process in SI.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Scale {
    /// As so many of this unit.
    Linear(f64),
    /// As the square, with the unit of its root.
    Power(f64),
    /// As 1σ of each sample of a rate, at a sample rate.
    Samples(f64),
    /// As 1σ of each increment, at a sample rate.
    Increments(f64),
}

impl Scale {
    fn needs_rate(self) -> bool {
        matches!(self, Self::Samples(_) | Self::Increments(_))
    }

    /// The strength in SI; none without a rate that is needed.
    fn strength(self, value: f64, rate: Option<f64>) -> Option<f64> {
        Some(match self {
            Self::Linear(unit) => value * unit,
            Self::Power(unit) => value.sqrt() * unit,
            Self::Samples(unit) => value * unit / rate?.sqrt(),
            Self::Increments(unit) => value * unit * rate?.sqrt(),
        })
    }

    fn value(self, strength: f64, rate: Option<f64>) -> Option<f64> {
        Some(match self {
            Self::Linear(unit) => strength / unit,
            Self::Power(unit) => (strength / unit).powi(2),
            Self::Samples(unit) => strength / unit * rate?.sqrt(),
            Self::Increments(unit) => strength / unit / rate?.sqrt(),
        })
    }
}

/// A quantity that noise figures state.
struct Quantity {
    sensor: Sensor,
    name: &'static str,
    conventions: &'static [Convention],
}

/// A unit of a quantity, and who uses it.
struct Convention {
    unit: &'static str,
    scale: Scale,
    /// What it is called, and by whom.
    meaning: &'static str,
    /// Other names for it, normalised.
    also: &'static [&'static str],
}

/// A noise figure in every convention.
#[derive(Debug, Clone, PartialEq)]
pub struct Conversion {
    /// Of which triad.
    pub sensor: Sensor,
    /// What the figure states, such as `angle random walk`.
    pub quantity: &'static str,
    /// The figure as it was taken.
    pub given: Line,
    /// Sample rate in Hz.
    pub rate: Option<f64>,
    /// The same in every convention.
    pub lines: Vec<Line>,
}

/// A noise figure in one convention.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// How many.
    pub value: f64,
    /// Of what.
    pub unit: &'static str,
    /// What it is called, and by whom.
    pub meaning: &'static str,
}

/// A figure that could not be converted.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ConversionError {
    /// No such unit.
    #[error(
        "`{unit}` is no unit of noise that is known.{} Known are, also as deg/sqrt(h), ug/sqrt(Hz), m/s^2 \
         and the like:
{}",
        hint(unit),
        known()
    )]
    Unknown {
        /// As given.
        unit: String,
    },
    /// A figure for each sample says nothing without their rate.
    #[error(
        "`{unit}` is the noise of each sample and says nothing without the sample rate: add --rate with \
         the rate in Hz"
    )]
    NoRate {
        /// As given.
        unit: String,
    },
}

/// Converts a figure into every convention of its quantity. With a sample rate in Hz a unit that means
/// both is taken as the noise of each sample, without as a bias instability.
///
/// # Errors
/// [`ConversionError`] if the unit is not known, or needs a rate.
pub fn convert(value: f64, unit: &str, rate: Option<f64>) -> Result<Conversion, ConversionError> {
    let wanted = normalised(unit);
    let matching = || {
        QUANTITIES.iter().flat_map(|quantity| {
            let all = quantity.conventions.iter();
            all.filter(|convention| convention.names().any(|name| name == wanted))
                .map(move |convention| (quantity, convention))
        })
    };
    let usable = matching().find_map(|(quantity, convention)| {
        let strength = convention.scale.strength(value, rate)?;
        Some((quantity, convention, strength))
    });
    let Some((quantity, convention, strength)) = usable else {
        let unit = unit.to_owned();
        return Err(match matching().next() {
            Some(_) => ConversionError::NoRate { unit },
            None => ConversionError::Unknown { unit },
        });
    };
    let line = |value, convention: &Convention| Line {
        value,
        unit: convention.unit,
        meaning: convention.meaning,
    };
    Ok(Conversion {
        sensor: quantity.sensor,
        quantity: quantity.name,
        given: line(value, convention),
        rate,
        lines: quantity
            .conventions
            .iter()
            .filter_map(|c| Some(line(c.scale.value(strength, rate)?, c)))
            .collect(),
    })
}

impl Convention {
    fn names(&self) -> impl Iterator<Item = String> {
        let also = self.also.iter().map(|name| (*name).to_owned());
        std::iter::once(normalised(self.unit)).chain(also)
    }
}

/// A unit in the one way that all its ways of writing come down to.
fn normalised(unit: &str) -> String {
    const SAME: [(&str, &str); 15] = [
        ("µ", "u"),
        ("μ", "u"),
        ("°", "deg"),
        ("″", "arcsec"),
        ("√", "sqrt"),
        ("²", "2"),
        ("³", "3"),
        ("⁵", "5"),
        ("–", "-"),
        ("^", ""),
        ("(", ""),
        (")", ""),
        (" ", ""),
        ("dps", "deg/s"),
        ("hr", "h"),
    ];
    let mut text = unit.to_lowercase();
    for (from, to) in SAME {
        text = text.replace(from, to);
    }
    text
}

fn hint(unit: &str) -> String {
    let wanted = normalised(unit);
    let all = QUANTITIES.iter().flat_map(|quantity| quantity.conventions);
    let likeness = |convention: &Convention| {
        let names = convention.names();
        names
            .map(|name| strsim::normalized_damerau_levenshtein(&wanted, &name))
            .fold(0.0, f64::max)
    };
    let nearest = all
        .map(|convention| (likeness(convention), convention.unit))
        .filter(|(likeness, _)| *likeness >= 0.6)
        .max_by(|a, b| a.0.total_cmp(&b.0));
    nearest.map_or_else(String::new, |(_, unit)| format!(" Did you mean `{unit}`?"))
}

/// All units, a line for each quantity.
pub fn known() -> String {
    let lines = QUANTITIES.iter().map(|quantity| {
        let mut units: Vec<String> = Vec::new();
        for convention in quantity.conventions {
            let rate = if convention.scale.needs_rate() {
                " (with --rate)"
            } else {
                ""
            };
            let unit = format!("{}{rate}", convention.unit);
            if !units.contains(&unit) {
                units.push(unit);
            }
        }
        format!("  {}: {}", quantity.name, units.join(", "))
    });
    lines.collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(conversion: &Conversion, unit: &str) -> f64 {
        let line = conversion.lines.iter().find(|line| line.unit == unit);
        line.unwrap_or_else(|| panic!("no {unit}")).value
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
                assert_close(value(&conversion, conversion.given.unit), 3.0);
            }
        }
    }

    #[test]
    fn an_unknown_unit_is_answered_with_the_known_ones() {
        let error = convert(1.0, "deg/sqrt(Hs)", None).unwrap_err().to_string();
        assert!(
            error.contains("Did you mean") && error.contains("µg/√Hz"),
            "{error}"
        );
        let error = convert(1.0, "rad", None).unwrap_err().to_string();
        assert!(error.contains("--rate"), "{error}");
    }
}
