//! The report of what a run holds: its log, dwells and turns, labels, and what the methods could observe.

mod data;
mod figure;
mod tables;
mod words;

use super::document::Document;
use super::number::{count, three_digits, value};
use crate::run::Run;
use crate::survey::Survey;

/// What a run holds, to be shown.
#[derive(Debug, Clone, Copy)]
pub struct CheckReport<'a> {
    /// The run.
    pub run: &'a Run,
    /// What was found in it.
    pub survey: &'a Survey,
}

impl CheckReport<'_> {
    /// Everything that is said of the run.
    pub fn document(&self) -> Document {
        let imu = &self.run.imu;
        let mut document = Document::new(format!(
            "Check of {}: {} s, {} samples at {} Hz, {}, {}",
            self.run.name,
            value(imu.duration(), 10.0),
            count(imu.len()),
            three_digits(imu.period.recip()),
            several(self.survey.rests.len(), "dwell"),
            several(self.survey.turns.len(), "turn"),
        ));
        document.lead = vec![words::log(self)];
        document.warnings.heading = "What to look at".to_owned();
        document.warnings.items = words::findings(self);
        document.page(figure::figure(self));
        document.both(tables::columns(self));
        document.both(tables::faults(self));
        document.both(tables::dwells(self));
        document.both(tables::labels(self));
        document.both(tables::methods(self));
        document.data = data::data(self);
        document
    }
}

/// Such as `3 turns`.
fn several(count: usize, name: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {name}{plural}")
}

#[cfg(test)]
mod tests {
    use super::super::{svg, terminal};
    use super::*;
    use crate::simulation::Scenario;

    fn document(run: &Run) -> Document {
        let survey = Survey::of(run);
        CheckReport {
            run,
            survey: &survey,
        }
        .document()
    }

    #[test]
    fn a_sound_run_is_shown_with_nothing_to_change() {
        let run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
        let document = document(&run);
        assert!(
            document.warnings.items.is_empty(),
            "{:?}",
            document.warnings
        );
        insta::assert_snapshot!(terminal::text(&document, Some(120)));
        let drawn: Vec<String> = document
            .plots()
            .map(|plot| svg::draw(plot).unwrap())
            .collect();
        svg::assert_sound(&drawn);
        assert!(drawn[0].contains("angular rate") && drawn[0].contains("z up"));
    }

    #[test]
    fn gyros_of_the_wrong_sign_or_unit_are_found_by_table_and_gravity() {
        let mut run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
        for sample in &mut run.imu.gyro {
            sample.x = -sample.x;
        }
        let said = terminal::text(&document(&run), None);
        for said_so in ["the table's log", "gravity's direction"] {
            let expected = format!("Gyros and {said_so} do not turn alike");
            assert!(said.contains(&expected), "{said}");
        }
    }
}
