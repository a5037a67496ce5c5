//! Allowed ranges of argument values.

use std::time::Duration;

use turncal::earth::{GRAVITIES, HEIGHTS};
use turncal::study::navigation::INTERVAL;
use turncal::study::{Shard, ShardError};

const HOUR: f64 = 3600.0;

/// A part i/M of a job.
pub fn shard(text: &str) -> Result<Shard, String> {
    text.parse().map_err(|error: ShardError| error.to_string())
}

/// A number within these limits.
pub fn number(text: &str, low: f64, high: f64) -> Result<f64, String> {
    between(text, low, high).ok_or_else(|| format!("expected a number from {low} to {high}"))
}

fn between(text: &str, low: f64, high: f64) -> Option<f64> {
    let value: f64 = text.trim().parse().ok()?;
    (low..=high).contains(&value).then_some(value)
}

/// A finite number above zero.
pub fn positive(text: &str) -> Result<f64, String> {
    between(text, f64::MIN_POSITIVE, f64::MAX)
        .ok_or_else(|| "expected a number above zero".to_owned())
}

/// A duration in seconds, from 0.1 s to one day.
pub fn seconds(text: &str) -> Result<Duration, String> {
    Ok(Duration::from_secs_f64(number(text, 0.1, 86_400.0)?))
}

/// Degrees, north positive.
pub fn latitude(text: &str) -> Result<f64, String> {
    number(text, -90.0, 90.0)
}

/// Height above the ellipsoid, m.
pub fn height(text: &str) -> Result<f64, String> {
    number(text, *HEIGHTS.start(), *HEIGHTS.end())
}

/// Gravity in m/s².
pub fn gravity(text: &str) -> Result<f64, String> {
    number(text, *GRAVITIES.start(), *GRAVITIES.end())
}

/// Navigation time, h.
pub fn hours(text: &str) -> Result<f64, String> {
    between(text, INTERVAL / HOUR, 1000.0)
        .ok_or_else(|| "expected a number of hours from 0.0167 (one minute) to 1000".to_owned())
}

/// Random seed.
pub fn seed(text: &str) -> Result<u64, String> {
    text.parse()
        .map_err(|_| format!("expected a whole number from 0 to {}", u64::MAX))
}

/// Number of runs, instruments or samples of a study; a scatter needs two.
pub fn at_least_two(text: &str) -> Result<u64, String> {
    const MOST: u64 = 1_000_000;
    match text.parse() {
        Ok(count @ 2..=MOST) => Ok(count),
        _ => Err(format!("expected a whole number from 2 to {MOST}")),
    }
}
