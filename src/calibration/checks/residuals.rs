//! Least-squares residuals of dwells and moves, compared with the stated errors.

use serde_json::json;

use super::finding::widened_by;
use crate::calibration::{Finding, FindingKind as Kind};
use crate::statistics::{FALSE_ALARM, chi_square_limit};

/// Number of triads with tested residuals.
const TRIADS: f64 = 2.0;

/// Statistics of least-squares residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct Residuals {
    /// Sum of squared whitened residuals.
    pub chi_square: f64,
    /// Number of equations minus number of unknowns.
    pub degrees: usize,
    /// Start and end, s, of the dwell or move with the largest residuals.
    pub worst: [f64; 2],
}

impl Residuals {
    /// Factor by which all σ are widened (Birge ratio): √(χ²/ν), at least one.
    ///
    /// Source: Birge 1932, "The calculation of errors by the method of least squares", Physical Review 40.
    pub fn growth(&self) -> f64 {
        let ratio = self.chi_square / self.degrees as f64;
        ratio.sqrt().max(1.0)
    }

    /// Limit of χ² if the stated errors are correct.
    fn limit(&self) -> f64 {
        chi_square_limit(self.degrees as f64, FALSE_ALARM / TRIADS)
    }

    /// Whether the residuals are larger than can be explained by chance.
    pub fn are_large(&self) -> bool {
        self.chi_square > self.limit()
    }

    /// The finding on residuals of `gyro`, `accel` or `both triads` that are larger than can be explained by chance.
    pub fn finding(&self, of: &str) -> Option<Finding> {
        let Self {
            chi_square,
            degrees,
            worst: [begin, end],
        } = *self;
        let (limit, growth) = (self.limit(), self.growth());
        let text = format!(
            "The static fit of {of} is poor (χ² {chi_square:.0} with {degrees} degrees of freedom; limit {limit:.0}). \
             turncal widened the σ {}. The worst interval is {begin:.1}–{end:.1} s. Look there for a bump, a wrong \
             label or a wrong attitude; if you find none, check the noise figures in [imu.noise], the level and north \
             of the table in [turntable], and whether the sensor was really still.",
            widened_by(growth)
        );
        let figures = json!({
            "of": of, "chi_square": chi_square, "degrees": degrees, "limit": limit, "growth": growth,
            "worst": [[begin, end]]
        });
        let finding = || Finding::new(Kind::ResidualsLarge, text, figures).of_growth(growth);
        self.are_large().then(finding)
    }
}
