//! The report of a study of accuracy.

mod compared;
mod data;
mod facts;
mod figures;
mod normalised;
mod tables;
#[cfg(test)]
mod tests;
mod verdict;

use super::effects;
use crate::report::prelude::*;
use crate::study::Accuracy;

/// Everything that is said of the study.
pub fn document(accuracy: &Accuracy) -> Document {
    let mut document = Document::new(format!(
        "Accuracy of the filter over {} simulated runs of {}",
        count(accuracy.trials.len()),
        accuracy.study.scenario.name
    ));
    document.conclusions.heading = "What holds".to_owned();
    document.warnings.heading = "To be noted".to_owned();
    verdict::say(&mut document, accuracy);
    document.both(facts::facts(accuracy));
    document.both(tables::bound(accuracy));
    document.both(tables::gain(accuracy));
    document.both(tables::consistency(accuracy));
    document.both(tables::auxiliary(accuracy));
    document.both(effects::costs(&accuracy.effects));
    document.both(effects::explained(&accuracy.effects));
    document.both(tables::containment(accuracy));
    for plot in figures::figures(accuracy) {
        document.page(plot);
    }
    document.data = data::data(accuracy);
    document
}
