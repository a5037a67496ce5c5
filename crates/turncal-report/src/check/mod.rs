//! Report on the content of a run: log, dwells and turns, labels, and parameters observable by each method.

mod data;
mod figure;
mod tables;
mod words;

use crate::prelude::*;
use turncal::run::Run;
use turncal::survey::Survey;

pub use words::{findings, of_survey, way_up};

/// The complete report on a run.
pub fn document(run: &Run, survey: &Survey) -> Document {
    let imu = &run.recording.imu;
    let mut document = Document::new(format!(
        "Check of {}: {} s, {} samples at {} Hz, {}, {}",
        run.recording.name,
        value(imu.duration(), 10.0),
        count(imu.len()),
        three_digits(imu.period.recip()),
        several(survey.rests.len(), "dwell"),
        several(survey.turns.len(), "turn"),
    ));
    document.lead = vec![words::log(run, survey)];
    document.warnings.heading = "What to look at".to_owned();
    document.warnings.items = words::findings(run, survey);
    document.page(figure::figure(run, survey));
    document.both(tables::log_columns(run));
    document.both(tables::faults(run));
    document.both(tables::dwells(run, survey));
    document.both(tables::labels(survey));
    document.both(tables::methods(survey));
    document.data = data::data(run, survey);
    document
}

#[cfg(test)]
mod tests {
    use super::super::{svg, terminal};
    use super::*;
    use turncal::simulation::Scenario;

    fn checked(run: &Run) -> Document {
        document(run, &Survey::of(run))
    }

    #[test]
    fn a_sound_run_is_shown_with_nothing_to_change() {
        let run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
        let document = checked(&run);
        assert!(
            document.warnings.items.is_empty(),
            "{:?}",
            document.warnings
        );
        insta::assert_snapshot!(terminal::layout(&document, 120));
        let drawn = svg::drawn(document.plots());
        assert!(drawn[0].contains("angular rate") && drawn[0].contains("z up"));
    }

    #[test]
    fn gyros_of_the_wrong_sign_are_found_once() {
        let mut run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
        for sample in run.recording.imu.gyro.to_mut() {
            sample.x = -sample.x;
        }
        let said = checked(&run).warnings.items;
        assert!(
            said.len() == 1 && said[0].contains("left-handed"),
            "{said:?}"
        );
    }
}
