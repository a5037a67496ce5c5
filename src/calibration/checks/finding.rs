//! What a calibration engineer must know before using the figures.

use std::fmt;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::imu::Sensor;

/// The kind of a finding after which values may not be used.
const UNEXPLAINED: &str = "unexplained";

/// What a check found: what is wrong, what it means for the result and what to do, with its figures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// What kind of finding, such as `not-observed`.
    pub kind: String,
    /// In words.
    pub text: String,
    /// Its figures by name.
    #[serde(default)]
    pub figures: Value,
}

impl Finding {
    /// Of a kind, in these words and with these figures.
    pub fn new(kind: &str, text: String, figures: Value) -> Self {
        let kind = kind.to_owned();
        Self {
            kind,
            text,
            figures,
        }
    }

    /// What the reader of the files found and mended, or what they state without effect.
    pub fn of_recording(note: String) -> Self {
        let figures = serde_json::json!({ "note": note });
        Self::new("recording", note, figures)
    }

    /// No noise explains what a calibration leaves, so that it is none.
    pub fn unexplained(text: String, figures: Value) -> Self {
        Self::new(UNEXPLAINED, text, figures)
    }

    /// Whether no noise explains what a calibration leaves, so that it is none.
    pub fn is_unexplained(&self) -> bool {
        self.kind == UNEXPLAINED
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// A triad at the beginning of a sentence.
pub fn triad_name(sensor: Sensor) -> &'static str {
    match sensor {
        Sensor::Gyro => "Gyro",
        Sensor::Accel => "Accelerometer",
    }
}

/// How much σ were widened: in percent below a factor of two, else as a factor.
pub fn widened_by(growth: f64) -> String {
    match growth < 2.0 {
        true => format!("by up to {:.0} %", 100.0 * (growth - 1.0)),
        false => format!("up to {growth:.1} times"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_is_a_kind_words_and_figures_in_json() {
        let finding = Finding::of_recording("a gap".to_owned());
        let json = serde_json::to_value(&finding).unwrap();
        assert_eq!(json["kind"], "recording");
        assert_eq!(json["text"], finding.to_string());
        assert_eq!(json["figures"]["note"], "a gap");
    }

    #[test]
    fn sigma_grow_by_percents_or_times() {
        assert_eq!(widened_by(1.124), "by up to 12 %");
        assert_eq!(widened_by(10.88), "up to 10.9 times");
    }
}
