//! What a user states of a log beside it.

use std::fmt::Write;

use super::text::line;

/// What a user states of a log that has no `run.toml`; what is not stated is found, or wide.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Stated {
    /// Rows a second.
    pub rate_hz: Option<f64>,
    /// Geodetic latitude, north positive.
    pub latitude_deg: Option<f64>,
    /// Height above the ellipsoid.
    pub height_m: Option<f64>,
    /// Gravity at the place.
    pub gravity_m_s2: Option<f64>,
    /// Units in the words of `run.toml`.
    pub gyro_unit: Option<String>,
    /// The same of the accelerometers.
    pub accel_unit: Option<String>,
}

impl Stated {
    /// `[site]`, with what is open as comments.
    pub(super) fn site(&self, text: &mut String) {
        text.push_str("\n# the place of the instrument; what is not stated is wide\n[site]\n");
        let fields = [
            (
                "latitude_deg",
                self.latitude_deg,
                "north positive; to 0.1° it is good enough",
            ),
            ("height_m", self.height_m, "above the ellipsoid"),
            (
                "gravity_m_s2",
                self.gravity_m_s2,
                "if it was measured; else normal gravity is taken",
            ),
        ];
        for (key, value, why) in fields {
            match value {
                Some(value) => line(text, key, &format!("{value:?}"), "as stated"),
                None => {
                    let _ = writeln!(text, "# {key} =  # {why}");
                }
            }
        }
    }
}
