//! Units: names in `run.toml`, sizes, and spellings in files.

use Of::{Count, Field, Other, Rows, Time};
use Output::{Increment, Rate};
use Sensor::{Accel, Gyro};

use turncal::imu::{Output, Sensor};
use turncal::noise::normalised;
use turncal::recording::MAGNETIC_COUNT;
use turncal::units::{ARCSEC, DEG_PER_H, DEGREE, STANDARD_GRAVITY};

/// Quantities of a row.
pub const OUTPUTS: [Output; 3] = [Output::Pulse, Output::Increment, Output::Rate];

/// Quantity of a unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Of {
    /// Rows of a triad.
    Rows(Sensor, Output),
    /// A count, of any quantity.
    Count,
    Time,
    /// Magnetic flux density.
    Field,
    Other,
}

/// A unit: name, quantity, number per SI unit, and normalised spellings.
type Row = (&'static str, Of, f64, &'static [&'static str]);

#[rustfmt::skip]
const UNITS: [Row; 26] = [
    ("count", Count, f64::NAN, &["count", "counts", "lsb", "raw", "cnt"]),
    ("rad/s", Rows(Gyro, Rate), 1.0, &["rad/s", "rads-1", "rads", "radps", "rps", "radpersec"]),
    ("deg/s", Rows(Gyro, Rate), 1.0 / DEGREE, &["deg/s", "degs-1", "degs", "degps", "degpersec"]),
    ("deg/h", Rows(Gyro, Rate), 1.0 / DEG_PER_H, &["deg/h", "dph"]),
    ("mdps", Rows(Gyro, Rate), 1e3 / DEGREE, &["mdeg/s"]),
    ("m/s^2", Rows(Accel, Rate), 1.0, &["m/s2", "m/s/s", "ms-2", "mps2", "ms2"]),
    ("g", Rows(Accel, Rate), 1.0 / STANDARD_GRAVITY, &["g"]),
    ("mg", Rows(Accel, Rate), 1e3 / STANDARD_GRAVITY, &["mg"]),
    ("rad", Rows(Gyro, Increment), 1.0, &["rad"]),
    ("deg", Rows(Gyro, Increment), 1.0 / DEGREE, &["deg"]),
    ("arcsec", Rows(Gyro, Increment), 1.0 / ARCSEC, &["arcsec", "\""]),
    ("m/s", Rows(Accel, Increment), 1.0, &["m/s", "mps"]),
    ("g*s", Rows(Accel, Increment), 1.0 / STANDARD_GRAVITY, &["g*s", "gs"]),
    ("s", Time, 1.0, &["s", "sec", "secs", "seconds", "h:m:s"]),
    ("ms", Time, 1e3, &["ms", "msec", "msecs", "millis", "milliseconds"]),
    ("us", Time, 1e6, &["us", "usec", "usecs", "micros", "microseconds"]),
    ("ns", Time, 1e9, &["ns", "nsec", "nsecs", "nanos", "nanosec", "nanoseconds"]),
    ("degC", Other, 1.0, &["degc", "celsius"]),
    ("uT", Field, 1e6, &["ut", "microtesla"]),
    ("nT", Field, 1e9, &["nt", "nanotesla"]),
    ("mT", Field, 1e3, &["mt", "millitesla"]),
    ("T", Field, 1.0, &["tesla"]),
    ("G", Field, 1e4, &["gauss", "gs"]),
    ("mG", Field, 1e7, &["mgauss", "milligauss"]),
    ("hPa", Other, 1e-2, &["hpa", "mbar"]),
    ("Pa", Other, 1.0, &["pa"]),
];

/// File units that `run.toml` lacks, as multiples of its units.
const MULTIPLES: [(&str, f64, &[&str]); 8] = [
    ("m/s^2", 1e-2, &["cm/s2", "gal"]),
    ("m/s^2", 1e-3, &["mm/s2"]),
    ("rad/s", 1e-3, &["mrad/s"]),
    ("deg/s", 6.0, &["rpm"]),
    ("g", 1e-6, &["ug"]),
    ("s", 60.0, &["min", "minute", "minutes"]),
    ("s", 3600.0, &["hour", "hours"]),
    ("s", 86_400.0, &["day", "days"]),
];

/// Units of the rows of a triad: quantity of the file per second for one rad/s or m/s². A count does not imply a
/// nominal scale.
pub fn units(sensor: Sensor, output: Output) -> impl Iterator<Item = (&'static str, Option<f64>)> {
    let usable = move |row: &&Row| row.1 == Count || row.1 == Rows(sensor, output);
    let scaled = |&(word, of, per_si, _): &Row| (word, (of != Count).then_some(per_si));
    UNITS.iter().filter(usable).map(scaled)
}

/// Units of a magnetometer, with their number per tesla.
pub fn units_of_field() -> impl Iterator<Item = (&'static str, f64)> {
    let of_field = UNITS.iter().filter(|row| row.1 == Field);
    let scaled = of_field.map(|&(word, _, per_si, _)| (word, per_si));
    scaled.chain([("count", MAGNETIC_COUNT)])
}

/// Units of time in s.
pub fn units_of_time() -> impl Iterator<Item = (&'static str, f64)> {
    let of_time = UNITS.iter().filter(|row| row.1 == Time);
    of_time.map(|&(word, _, per_si, _)| (word, per_si.recip()))
}

/// The unit in a string: the name in `run.toml`, the multiple of this unit, and the quantity.
pub fn spelled(text: &str) -> Option<(&'static str, f64, Of)> {
    let text = normalised(text);
    let has = |spellings: &[&str]| spellings.contains(&text.as_str());
    let multiple = MULTIPLES.iter().find(|(.., spellings)| has(spellings));
    let is = |row: &&Row| multiple.map_or(has(row.3), |(word, ..)| row.0 == *word);
    let &(word, of, ..) = UNITS.iter().find(is)?;
    Some((word, multiple.map_or(1.0, |&(_, times, _)| times), of))
}

/// Nominal scale of a triad implied by a row unit: quantity of the file per second for one rad/s or m/s²; `None` for
/// counts and unknown units.
pub fn unit_scale(sensor: Sensor, unit: &str) -> Option<f64> {
    let mut all = OUTPUTS.iter().flat_map(|&output| units(sensor, output));
    all.find(|&(name, _)| name == unit)?.1
}
