//! Findings on labelled sections.

use serde_json::{Value, json};

use crate::calibration::{Finding, FindingKind as Kind};
use crate::run::motion::LabelCheck;

/// The finding on sections whose labels are contradicted by the recording, if there are any.
pub fn contradicted(contradicted: &[LabelCheck]) -> Option<Finding> {
    let each: Vec<String> = contradicted.iter().map(LabelCheck::to_string).collect();
    let text = format!(
        "The labels contradict the recording. Section {}.",
        each.join("; section ")
    );
    let figure = |check: &LabelCheck| {
        json!({
            "label": check.segment.label,
            "start": check.segment.start,
            "said": check.disagreement,
            "used": check.as_labelled.is_some(),
        })
    };
    let figures = json!({ "contradicted": contradicted.iter().map(figure).collect::<Value>() });
    (!contradicted.is_empty()).then(|| Finding::new(Kind::LabelsContradicted, text, figures))
}

/// The finding on labelled sections with missing rows, if there are any.
pub fn lost(labels: &[String]) -> Option<Finding> {
    let text = format!(
        "Some rows of a labelled section are missing from the log, so turncal skipped section {}. Record this section \
         again, or remove its label from [segments].",
        labels.join(", ")
    );
    let figures = json!({ "labels": labels });
    (!labels.is_empty()).then(|| Finding::new(Kind::SectionsLost, text, figures))
}
