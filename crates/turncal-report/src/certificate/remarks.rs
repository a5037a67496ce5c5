//! Findings in sentences for the customer: a fact about the results, without advice to the laboratory.

use super::in_words;
use turncal::calibration::Finding;
use turncal::calibration::FindingKind::{self as Kind, *};

const SENTENCES: [(Kind, &str); 29] = [
    (
        Recording,
        "The record was repaired, or completed by assumptions, before the evaluation; U includes the effect.",
    ),
    (
        NotConverged,
        "The evaluation did not converge; the results must not be used.",
    ),
    (
        Unexplained,
        "The residuals of the evaluation are unexplained; the results must not be used.",
    ),
    (
        NotObserved,
        "The record adds little to what was assumed about some parameters; their U is large.",
    ),
    (
        CombinationsNotObserved,
        "Some parameters are determined only in combination with others; use them together with the covariance matrix.",
    ),
    (
        HeadingNotObserved,
        "The gyroscopes do not show north; U of the gyroscope biases includes the unknown part of Earth rate.",
    ),
    (
        NoiseLearnt,
        "The noise of the instrument was estimated from the record, because it exceeds the stated noise.",
    ),
    (
        ScatterAtRest,
        "The noise at standstill differs from the noise stated for the instrument.",
    ),
    (
        Inconsistent,
        "The residuals of the evaluation differ from those expected by more than chance explains.",
    ),
    (
        ErrorTermEstimated,
        "The results apply together with the error terms listed in this certificate.",
    ),
    (
        Settling,
        "The turntable settled for some seconds after its moves; U includes the effect.",
    ),
    (
        PositionWrong,
        "A reading of the turntable was in error and has practically no weight in the results.",
    ),
    (
        MoveWrong,
        "The rotation in a move was in error; the error was estimated with the results.",
    ),
    (
        BiasStep,
        "A bias changed during the calibration; the result is the mean before and after the change.",
    ),
    (
        EarthRateWrong,
        "The measured Earth rate differs from that at the stated latitude; the difference was estimated with the results.",
    ),
    (
        FarFromPrior,
        "Some parameters differ from the data sheet by much more than it allows.",
    ),
    (
        FormRejected,
        "The instrument has misalignments that the chosen model does not contain; U does not include them.",
    ),
    (
        Rounded,
        "The output of the instrument is rounded to steps larger than its noise; U includes the effect.",
    ),
    (
        EvenTermsInseparable,
        "The second-order term and the asymmetry of an accelerometer are determined only as a sum.",
    ),
    (
        TemperatureNotSeen,
        "The change of some parameters with temperature was not measured; the results apply at the temperature of the calibration.",
    ),
    (
        RecordingsDiffer,
        "The instrument changed between the recordings of the calibration; U includes the difference.",
    ),
    (
        LabelsContradicted,
        "The labels of some positions contradicted the data and were not used as stated.",
    ),
    (
        SectionsLost,
        "Some positions were not used, because data were missing.",
    ),
    (
        ResidualsLarge,
        "The residuals exceed those expected; U was widened in proportion.",
    ),
    (
        StatementDoubted,
        "Some statements about the record contradict its data.",
    ),
    (
        PriorContradicted,
        "A scale factor contradicts the stated one; the results must not be used.",
    ),
    (
        VelocityWrong,
        "The acceleration in a move was in error; the error was estimated with the results.",
    ),
    (
        Slipped,
        "The instrument slipped on the turntable; the misalignments apply to the mounting before the slip.",
    ),
    (
        TermNotShown,
        "U includes the usual size of error terms that the record does not show.",
    ),
];

/// A sentence per kind of finding; a kind that this version does not know is named by its code.
pub fn sentences(findings: &[Finding]) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for finding in findings {
        let kind = Kind::named(&finding.kind);
        let known = SENTENCES.iter().find(|(of, _)| Some(*of) == kind);
        let sentence = match known {
            Some((_, sentence)) => with_parameters(sentence, finding),
            None => format!("The evaluation has the finding {}.", finding.code),
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
            let found = SENTENCES.iter().filter(|(of, _)| of == kind);
            let sentences: Vec<&str> = found.map(|(_, sentence)| *sentence).collect();
            let [sentence] = sentences[..] else {
                panic!("{kind:?} has {} sentences", sentences.len());
            };
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
        let all = sentences(&[of(NotObserved), of(NotObserved), of(Rounded)]);
        assert_eq!(all.len(), 2);
        assert!(
            all[0].ends_with("U is large (gyroscope scale factor x)."),
            "{all:?}"
        );
    }
}
