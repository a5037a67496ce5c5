//! Performs all runs of a study.

use std::ops::ControlFlow;
use std::path::Path;

use crate::arguments::Delivery;
use crate::terminal::Runs;
use turncal::study;
use turncal_report::Document;

/// Performs a whole study and delivers the document with its results.
pub fn carry_out<S: study::Study>(
    study: &S,
    delivery: &Delivery,
    inputs: &[&Path],
    document: fn(&S::Outcome) -> Document,
) -> anyhow::Result<()> {
    let begun = delivery.begin(inputs)?;
    let runs = Runs::new(study.runs());
    let outcome = study.run(&|| {
        runs.one_done();
        ControlFlow::Continue(())
    })?;
    drop(runs);
    begun.deliver(&document(&outcome))
}
