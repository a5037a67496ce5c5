//! Trends of values with the serial number or with time.

use statrs::distribution::{ContinuousCDF, StudentsT};
use toml::value::Datetime;

use super::unit::Unit;

/// Independent variable of a trend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Against {
    /// The last number in the serial number.
    Serial,
    /// The date, in days.
    Date,
}

/// A significant trend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trend {
    /// The independent variable.
    pub against: Against,
    /// Change per serial number, or per day.
    pub slope: f64,
    /// Its 1σ, from the scatter about the line.
    pub sigma: f64,
    /// p-value: probability of at least this change without a trend.
    pub p: f64,
}

impl Against {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Serial, Self::Date];

    /// Value of the independent variable for a unit; `None` if it is not stated.
    pub fn place(self, unit: &Unit) -> Option<f64> {
        match self {
            Self::Serial => serial_number(unit.meta.get("serial")?),
            Self::Date => days(unit.meta.get("date")?),
        }
    }
}

/// The last number in a serial, such as 42 of `FOG-A042`.
fn serial_number(serial: &str) -> Option<f64> {
    let mut runs = serial.rsplit(|c: char| !c.is_ascii_digit());
    runs.find(|run| !run.is_empty())?.parse().ok()
}

/// Days from 1970-01-01 to an ISO 8601 date, with the fraction of the day if it has a time.
fn days(date: &str) -> Option<f64> {
    const DAY: f64 = 86_400.0;
    let stamp: Datetime = date.trim().parse().ok()?;
    let date = stamp.date?;
    // Years begin in March, so that the leap day is the last (Hinnant, *chrono-Compatible Low-Level Date
    // Algorithms*).
    let (month, day) = (i64::from(date.month), i64::from(date.day));
    let year = i64::from(date.year) - i64::from(month <= 2);
    let leap_days = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    let whole = (365 * year + leap_days + of_year - 719_468) as f64;
    let part = stamp.time.map_or(0.0, |time| {
        let minutes = 60.0 * f64::from(time.hour) + f64::from(time.minute);
        (60.0 * minutes + f64::from(time.second.unwrap_or_default())) / DAY
    });
    Some(whole + part)
}

/// A weighted line through values `(place, value, weight)`; `None` if its slope is not significant.
pub fn trend(against: Against, points: &[(f64, f64, f64)], chance: f64) -> Option<Trend> {
    let freedom = points.len().checked_sub(2).filter(|n| *n >= 2)? as f64;
    let sum = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
        points
            .iter()
            .map(|(x, y, weight)| of(*x, *y) * weight)
            .sum()
    };
    let weights = sum(&|_, _| 1.0);
    let (centre, mean) = (sum(&|x, _| x) / weights, sum(&|_, y| y) / weights);
    let width = sum(&|x, _| (x - centre).powi(2));
    if width <= 0.0 {
        return None;
    }
    let slope = sum(&|x, y| (x - centre) * (y - mean)) / width;
    let squares = sum(&|x, y| (y - mean - slope * (x - centre)).powi(2));
    let sigma = (squares / freedom / width).sqrt();
    let student = StudentsT::new(0.0, 1.0, freedom).ok()?;
    let p = match sigma > 0.0 {
        true => 2.0 * student.sf((slope / sigma).abs()),
        false => 1.0,
    };
    (p < chance).then_some(Trend {
        against,
        slope,
        sigma,
        p,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn serials_and_dates_are_places() {
        assert_eq!(serial_number("FOG-2 A042"), Some(42.0));
        assert_eq!(serial_number("no number"), None);
        assert_eq!(days("1970-01-01"), Some(0.0));
        assert_eq!(days("2000-03-01"), Some(11_017.0));
        assert_eq!(days("2024-02-29 12:00:00"), Some(19_782.5));
        assert_eq!(days("March"), None);
    }

    #[test]
    fn a_line_has_the_slope_and_sigma_of_least_squares() {
        // Residuals ±1 about 2x: Σ(x − 1.5)² = 5, s² = 4/2.
        let points = [
            (0.0, 1.0, 1.0),
            (1.0, 1.0, 1.0),
            (2.0, 3.0, 1.0),
            (3.0, 7.0, 1.0),
        ];
        let found = trend(Against::Serial, &points, 1.0).unwrap();
        assert!((found.slope - 2.0).abs() < 1e-12, "{found:?}");
        assert!((found.sigma - (4.0f64 / 2.0 / 5.0).sqrt()).abs() < 1e-12);
        // Student's t of two degrees of freedom: p = 1 − t/√(2 + t²).
        let t = found.slope / found.sigma;
        assert!((found.p - (1.0 - t / (2.0 + t * t).sqrt())).abs() < 1e-9);
        assert_eq!(trend(Against::Serial, &points, 0.01), None);
        assert_eq!(trend(Against::Date, &[(0.0, 1.0, 1.0); 5], 1.0), None);
    }
}
