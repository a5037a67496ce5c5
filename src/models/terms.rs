//! Error terms in instrument files and in `run.toml`.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::imu::{Term, TermVector};
use turncal_input::{Document, FileError, Positive};

/// 1σ of each parameter of an error term, around zero.
#[derive(Clone, Copy, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TermFile {
    /// 1σ of each parameter of the error term, around zero
    pub sigma: Positive,
}

/// 1σ of the parameters of enabled error terms, in SI; zero for the others.
pub fn term_sigma(
    document: Document,
    table: &str,
    terms: &BTreeMap<String, TermFile>,
) -> Result<TermVector, FileError> {
    document.only(table, terms.keys(), &Term::NAMES)?;
    let mut sigma = TermVector::zeros();
    for term in Term::ALL {
        let Some(TermFile { sigma: stated }) = terms.get(term.name()) else {
            continue;
        };
        let unit = term.entry().unit.1;
        let most = (term.entry().largest / unit).round();
        if stated.0 > most {
            let path = format!("{table}.{}.sigma", term.name());
            let expected = format_args!("a number above zero and at most {most}");
            return Err(document.wrong(&path, expected, "Correct this value."));
        }
        for parameter in term.parameters() {
            sigma[parameter] = stated.0 * unit;
        }
    }
    Ok(sigma)
}
