//! Accuracy against the closed form of the paper and the Cramér–Rao bound, on the demo scenario.
//!
//! `cargo bench --bench accuracy` prints the table. For more runs, other paths and forms there is
//! `turncal study accuracy`.

use turncal::imu::InstallationForm;
use turncal::simulation::Scenario;
use turncal::study::{AccuracyStudy, Study, UNWATCHED};
use turncal_report::{accuracy, terminal};

/// Enough for the root mean squares to be known within a few per cent.
const RUNS: u64 = 40;
/// Fixed before the first run was made.
const SEED: u64 = 4040;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let study = AccuracyStudy {
        scenario: Scenario::load("demo")?,
        form: InstallationForm::General,
        unmodelled: Vec::new(),
        auto_terms: true,
        noise: Default::default(),
        runs: RUNS,
        seed: SEED,
    };
    let document = accuracy::document(&study.run(UNWATCHED)?);
    print!("{}", terminal::text(&document, None));
    Ok(())
}
