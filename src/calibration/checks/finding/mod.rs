//! Findings: facts that a calibration engineer must know before using the results.

pub mod kind;
pub mod verdict;

use std::fmt;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::imu::Sensor;
use kind::{Kind, Level};

/// Growth of σ that would change the decision of a user.
const MATTERS: f64 = 1.5;

/// A finding of a check: the problem, its meaning for the result and the remedy, with figures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// The code of the kind of finding, such as `W04`.
    #[serde(default)]
    pub code: String,
    /// The name of the kind of finding, such as `not-observed`.
    pub kind: String,
    /// Severity, if it differs from that of its kind.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    level: Option<Level>,
    /// Text.
    pub text: String,
    /// Figures by name.
    #[serde(default)]
    pub figures: Value,
}

impl Finding {
    /// A finding of this kind, with text and figures.
    pub fn new(kind: Kind, text: String, figures: Value) -> Self {
        Self {
            code: kind.code().to_owned(),
            kind: kind.name().to_owned(),
            level: None,
            text,
            figures,
        }
    }

    /// A finding about a fault that the file reader repaired, or about a statement without effect.
    pub fn of_recording(note: String) -> Self {
        let figures = serde_json::json!({ "note": note });
        Self::new(Kind::Recording, note, figures)
    }

    /// A finding about a statement that contradicts the recording.
    pub fn of_statement(doubt: String) -> Self {
        let figures = serde_json::json!({ "doubt": doubt });
        Self::new(Kind::StatementDoubted, doubt, figures)
    }

    /// The finding; if the σ include the effect and increased by less than half, it is reduced to a note.
    pub fn of_growth(self, growth: f64) -> Self {
        if growth < MATTERS {
            self.at(Level::Note)
        } else {
            self
        }
    }

    /// A copy whose severity differs from that of its kind.
    pub fn at(self, level: Level) -> Self {
        Self {
            level: Some(level),
            ..self
        }
    }

    /// Severity. Kinds from another version that this version does not know have the level `care`.
    pub fn level(&self) -> Level {
        let of_kind = || Kind::named(&self.kind).map_or(Level::Care, Kind::level);
        self.level.unwrap_or_else(of_kind)
    }

    /// Whether the finding is of this kind.
    pub fn is(&self, kind: Kind) -> bool {
        self.kind == kind.name()
    }

    /// The problem (first sentence of the text) and the remedy (last sentence).
    pub fn headline(&self) -> (&str, Option<&str>) {
        match self.text.split_once(". ") {
            Some((first, rest)) => (first, rest.rsplit(". ").next()),
            None => (&self.text, None),
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// Name of a triad at the start of a sentence.
pub fn triad_name(sensor: Sensor) -> &'static str {
    match sensor {
        Sensor::Gyro => "Gyro",
        Sensor::Accel => "Accelerometer",
    }
}

/// A phrase that states how much σ was widened: in percent below a factor of two, otherwise as a factor.
pub fn widened_by(growth: f64) -> String {
    if growth < 2.0 {
        format!("by up to {:.0} %", 100.0 * (growth - 1.0))
    } else {
        format!("up to {growth:.1} times")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_finding_is_a_kind_words_and_figures_in_json() {
        let finding = Finding::of_recording("a gap".to_owned());
        let json = serde_json::to_value(&finding).unwrap();
        assert_eq!(json["code"], "W01");
        assert_eq!(json["kind"], "recording");
        assert_eq!(json["text"], finding.to_string());
        assert_eq!(json["figures"]["note"], "a gap");
    }

    #[test]
    fn a_headline_is_what_is_wrong_and_what_to_do() {
        let of = |text: &str| Finding::of_recording(text.to_owned());
        let long = of("Noise is 0.5 too high. All σ include it. Run turncal allan.");
        assert_eq!(
            long.headline(),
            ("Noise is 0.5 too high", Some("Run turncal allan."))
        );
        assert_eq!(of("A gap.").headline(), ("A gap.", None));
        assert_eq!(Level::Note, long.level());
    }

    #[test]
    fn sigma_grow_by_percents_or_times() {
        assert_eq!(widened_by(1.124), "by up to 12 %");
        assert_eq!(widened_by(10.88), "up to 10.9 times");
    }
}
