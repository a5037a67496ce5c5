use super::*;
use crate::simulation::Scenario;

#[test]
fn a_sound_run_is_shown_with_nothing_to_change() {
    let run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
    let survey = Survey::of(&run);
    let report = CheckReport {
        run: &run,
        survey: &survey,
    };
    let text = report.summary();
    assert!(!text.contains("What to look at"), "{text}");
    assert!(text.contains("18 dwells, 17 turns"), "{text}");
    let directory = tempfile::tempdir().unwrap();
    report.write(directory.path()).unwrap();
    let svg = std::fs::read_to_string(directory.path().join("record.svg")).unwrap();
    assert!(svg.contains("angular rate") && svg.contains("z up"));
}

#[test]
fn gyros_of_the_wrong_sign_or_unit_are_found_by_table_and_gravity() {
    let mut run = Scenario::load("demo").unwrap().simulate(1, 0).unwrap().run;
    for sample in &mut run.recording.imu.gyro {
        sample.x = -sample.x;
    }
    let survey = Survey::of(&run);
    let said = CheckReport {
        run: &run,
        survey: &survey,
    }
    .summary();
    assert!(
        said.contains("Gyros and the table's log do not turn alike"),
        "{said}"
    );
    assert!(
        said.contains("Gyros and gravity's direction do not turn alike"),
        "{said}"
    );
}
