//! Findings in sentences for the customer. Each sentence states a fact about the results, without advice to the
//! laboratory.

use super::in_words;
use turncal::calibration::Finding;
use turncal::calibration::FindingKind as Kind;

/// One sentence per kind of finding; a kind that this version does not know is given by its code.
pub fn sentences(findings: &[Finding]) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for finding in findings {
        let kind = Kind::named(&finding.kind);
        let sentence = match kind {
            Some(kind) => with_parameters(kind.remark(), finding),
            None => format!("The evaluation has finding {}.", finding.code),
        };
        if !all.contains(&sentence) {
            all.push(sentence);
        }
    }
    all
}

/// The sentence, followed by the names of the parameters that the finding is about, if it lists them.
fn with_parameters(sentence: &str, finding: &Finding) -> String {
    let names = finding.figures["parameters"]
        .as_array()
        .into_iter()
        .flatten();
    let names: Vec<String> = names
        .filter_map(|name| Some(in_words(name.as_str()?)))
        .collect();
    if names.is_empty() {
        return sentence.to_owned();
    }
    format!("{} ({}).", sentence.trim_end_matches('.'), names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_has_a_sentence_without_options_or_backticks() {
        for kind in Kind::ALL {
            let sentence = kind.remark();
            assert!(
                sentence.ends_with('.') && !sentence.contains(['`', '[']),
                "{sentence}"
            );
            assert!(
                !sentence.contains("--") && !sentence.contains("turncal"),
                "{sentence}"
            );
        }
    }

    #[test]
    fn the_parameters_of_a_finding_are_named_in_words_and_a_sentence_comes_once() {
        let figures = serde_json::json!({ "parameters": ["gyro.scale.x"] });
        let of = |kind| Finding::new(kind, String::new(), figures.clone());
        let all = sentences(&[
            of(Kind::NotObserved),
            of(Kind::NotObserved),
            of(Kind::Rounded),
        ]);
        assert_eq!(all.len(), 2);
        assert!(
            all[0].ends_with("about some parameters (gyroscope scale factor x)."),
            "{all:?}"
        );
    }
}
