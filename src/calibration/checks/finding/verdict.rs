//! Verdict on a calibration, from its findings or from a specification.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::Finding;
use super::kind::Level;

/// Whether a calibration may be used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Word {
    /// The calibration converged, the σ agree with the residuals, and all requested parameters are determined.
    #[serde(rename = "good")]
    Good,
    /// The values are usable, but a cause increased the σ, or the recording contradicts a statement; the reasons give
    /// details.
    #[serde(rename = "use with care")]
    UseWithCare,
    /// Some of the requested parameters are not determined; the others are usable.
    #[serde(rename = "partial")]
    Partial,
    /// Values must not be used.
    #[serde(rename = "failed")]
    Failed,
    /// Every limit of a specification is met.
    #[serde(rename = "pass")]
    Pass,
    /// No limit is certainly exceeded, but some may be exceeded.
    #[serde(rename = "undecided")]
    Undecided,
    /// A limit is exceeded.
    #[serde(rename = "fail")]
    Fail,
}

impl Word {
    /// The CSS class of the verdict on a page.
    pub fn class(self) -> &'static str {
        match self {
            Self::Good | Self::Pass => "good",
            Self::UseWithCare | Self::Partial | Self::Undecided => "care",
            Self::Failed | Self::Fail => "failed",
        }
    }
}

impl fmt::Display for Word {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Good => "GOOD",
            Self::UseWithCare => "USE WITH CARE",
            Self::Partial => "PARTIAL",
            Self::Failed => "FAILED",
            Self::Pass => "PASS",
            Self::Undecided => "UNDECIDED",
            Self::Fail => "FAIL",
        })
    }
}

/// A verdict, with the codes of the findings that lead to it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Verdict {
    /// The word.
    pub word: Word,
    /// Codes such as `W07`; the list is empty for a good result.
    pub reasons: Vec<String>,
}

impl Verdict {
    /// The verdict of the most severe finding.
    pub fn of(findings: &[Finding]) -> Self {
        let worst = findings.iter().map(Finding::level).min();
        let worst = worst.unwrap_or(Level::Note);
        let word = match worst {
            Level::Failed => Word::Failed,
            Level::Partial => Word::Partial,
            Level::Care => Word::UseWithCare,
            Level::Note => Word::Good,
        };
        let is_reason = |finding: &&Finding| finding.level() == worst && word != Word::Good;
        let mut reasons: Vec<String> = Vec::new();
        for finding in findings.iter().filter(is_reason) {
            if !reasons.contains(&finding.code) {
                reasons.push(finding.code.clone());
            }
        }
        Self { word, reasons }
    }
}

#[cfg(test)]
mod tests {
    use super::super::kind::Kind;
    use super::*;

    #[test]
    fn the_most_severe_findings_are_the_reasons() {
        let of = |kinds: &[Kind]| {
            let finding = |&kind: &Kind| Finding::new(kind, String::new(), serde_json::Value::Null);
            Verdict::of(&kinds.iter().map(finding).collect::<Vec<_>>())
        };
        assert_eq!(of(&[]).word, Word::Good);
        assert_eq!(of(&[Kind::Recording, Kind::TermNotShown]), of(&[]));
        let care = of(&[
            Kind::Recording,
            Kind::MoveWrong,
            Kind::Rounded,
            Kind::MoveWrong,
        ]);
        assert_eq!(
            (care.word, care.reasons.join(" ").as_str()),
            (Word::UseWithCare, "W17 W22")
        );
        let partial = of(&[Kind::Rounded, Kind::NotObserved]);
        assert_eq!(
            (partial.word, partial.reasons.join(" ").as_str()),
            (Word::Partial, "W04")
        );
        let failed = of(&[Kind::NotObserved, Kind::NotConverged]);
        assert_eq!(
            (failed.word, failed.reasons.join(" ").as_str()),
            (Word::Failed, "W02")
        );
        let json = serde_json::to_string(&care).unwrap();
        assert_eq!(json, r#"{"word":"use with care","reasons":["W17","W22"]}"#);
    }
}
