//! Error terms in instrument files and in `run.toml`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::imu::{Term, TermVector};
use turncal_input::{Document, FileError, NonNegative};

/// 1σ of each parameter of an error term, whose mean is zero; 0 if the instrument is known not to have the term.
#[derive(Clone, Copy, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TermFile {
    /// 1σ of each parameter of the error term, around zero; 0 if the term is known to be absent
    pub sigma: NonNegative,
}

/// Returns the 1σ of the parameters of enabled error terms, in SI units (zero for the others), and the terms stated to
/// be absent.
pub fn stated_terms(
    document: Document,
    table: &str,
    terms: &BTreeMap<String, TermFile>,
) -> Result<(TermVector, Vec<Term>), FileError> {
    document.only(table, terms.keys(), &Term::NAMES)?;
    let mut sigma = TermVector::zeros();
    let mut absent = Vec::new();
    for term in Term::ALL {
        let Some(TermFile { sigma: stated }) = terms.get(term.name()) else {
            continue;
        };
        let unit = term.entry().unit.1;
        let most = (term.entry().largest / unit).round();
        if stated.0 > most {
            let path = format!("{table}.{}.sigma", term.name());
            let expected = format_args!("a number of at least zero and at most {most}");
            return Err(document.wrong(&path, expected, "Correct this value."));
        }
        if stated.0 == 0.0 {
            absent.push(term);
        }
        for parameter in term.parameters() {
            sigma[parameter] = stated.0 * unit;
        }
    }
    Ok((sigma, absent))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Deserialize)]
    struct File {
        terms: BTreeMap<String, TermFile>,
    }

    fn read(terms: &str) -> Result<(TermVector, Vec<Term>), FileError> {
        let text = format!("[terms]\n{terms}\n");
        let document = Document::of("mine.toml".as_ref(), &text);
        let File { terms } = document.fill(document.parse()?)?;
        stated_terms(document, "terms", &terms)
    }

    #[test]
    fn a_sigma_of_zero_states_that_a_term_is_absent() {
        let (sigma, absent) =
            read("time-offset = { sigma = 0 }\nsize-effect = { sigma = 2.0 }").unwrap();
        assert_eq!(absent, [Term::TimeOffset]);
        for (k, sigma) in sigma.iter().enumerate() {
            let is_on = Term::SizeEffect.parameters().contains(&k);
            assert_eq!(*sigma > 0.0, is_on, "{k}");
        }
        assert_eq!(read("").unwrap(), (TermVector::zeros(), Vec::new()));
    }

    #[test]
    fn a_sigma_below_zero_not_finite_or_too_large_is_refused() {
        for (value, says) in [
            ("-1", "a number of at least zero"),
            ("nan", "a finite number"),
            ("inf", "a finite number"),
            ("1e12", "a number of at least zero and at most 573"),
        ] {
            let error = read(&format!("time-offset = {{ sigma = {value} }}")).unwrap_err();
            let message = error.to_string();
            assert!(message.contains("terms.time-offset.sigma"), "{message}");
            assert!(message.contains(says), "{message}");
        }
    }
}
