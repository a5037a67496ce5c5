//! Files that a user may edit: instruments, installations, tables, paths, scenarios and trajectories in TOML.
//!
//! The files of the `models/` folder are embedded. An existing file takes precedence over an embedded name, on the
//! command line and in the scenario of a user; embedded scenarios use only embedded models.

mod by_hand;
mod catalogue;
mod instrument;
mod machine;
mod source;
mod terms;
mod thermal;
mod trajectory;

use std::path::Path;

use crate::lot::Specification;

pub use by_hand::path_by_hand;
pub use catalogue::Embedded;
pub use instrument::{InstallationModel, Instrument, Spread, Tolerances, Variation};
pub use machine::{path, turntable};
pub use source::{ModelError, Place, Room, Text, inconsistent, names, text};
pub use terms::{TermFile, stated_terms};
pub use thermal::ThermalVariation;
pub use trajectory::trajectory;

/// Finds and reads a specification.
///
/// # Errors
/// Returns an error if there is no specification of this name, or it is malformed.
pub fn specification(name_or_path: &Path) -> Result<Specification, ModelError> {
    let text = text(
        Room::Specification,
        &name_or_path.to_string_lossy(),
        &Place::CommandLine,
    )?;
    Ok(Specification::of_text(Path::new(&text.file), &text.text)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(room: Room, content: &str) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("mine.toml");
        std::fs::write(&path, content).unwrap();
        let path = path.to_str().unwrap();
        let place = &Place::CommandLine;
        let site = crate::earth::Site::with_normal_gravity(0.6, 0.0, 0.0);
        let error = match room {
            Room::Imu => Instrument::load(path, place).unwrap_err(),
            Room::Installation => InstallationModel::load(path, place).unwrap_err(),
            Room::Turntable => turntable(path, place).unwrap_err(),
            Room::Path => machine::path(path, place, &site).unwrap_err(),
            Room::Campaign => crate::simulation::SimulatedCampaign::load(path).unwrap_err(),
            Room::Scenario => crate::simulation::Scenario::load(path).unwrap_err(),
            Room::Trajectory => trajectory(path, place).unwrap_err(),
            Room::Specification => specification(Path::new(path)).unwrap_err(),
        };
        let message = error.to_string();
        assert!(message.contains("mine.toml"), "{message}");
        message
    }

    #[test]
    fn a_file_that_is_no_toml_is_named_by_line_and_column_however_long_the_line() {
        let said = message(Room::Imu, &format!("a = 1\n{}\n", "x".repeat(100_000)));
        assert!(said.contains(", line 2, column "), "{said}");
        assert!(said.len() < 1000, "{}", said.len());
    }

    #[test]
    fn an_unknown_name_lists_what_exists_and_the_nearest() {
        let error = text(Room::Imu, "navigaton-fog", &Place::Embedded).unwrap_err();
        let message = error.to_string();
        assert!(
            message.contains("did you mean \"navigation-fog\""),
            "{message}"
        );
        assert!(message.contains("ring-laser"), "{message}");
    }

    #[test]
    fn a_file_wins_over_an_embedded_name_but_not_for_an_embedded_scenario() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(
            folder.path().join("general"),
            "form = \"six-angle\"\nangles_deg = { sigma = 1 }",
        )
        .unwrap();
        let here = Place::File(folder.path().join("scenario.toml"));
        let form = |place: &Place| InstallationModel::load("general", place).unwrap().form;
        assert_eq!(form(&here), crate::imu::InstallationForm::SixAngle);
        assert_eq!(
            form(&Place::Embedded),
            crate::imu::InstallationForm::General
        );
    }

    #[test]
    fn a_wrong_value_or_field_is_named_with_its_line_and_what_was_expected() {
        for (room, content, says) in [
            (
                Room::Installation,
                "form = \"general\"\nangles_deg = { sigma = -1.0 }",
                ["line 2", "sigma = -1.0, expected a number above zero"],
            ),
            (
                Room::Installation,
                "form = \"general\"\nangles_deg = { mean = 1.0 }",
                ["line 2", "either uniform"],
            ),
            (
                Room::Installation,
                "form = \"general\"\nangle_deg = { sigma = 1.0 }",
                ["line 2", "expected one of `form`, `angles_deg`"],
            ),
            (
                Room::Imu,
                "[gyro]\npulse_arcsec = \"fine\"",
                ["line 2", "expected a finite number"],
            ),
            (
                Room::Turntable,
                "[[axis]]\nname = \"outer\"\ndirection = [0, 0, 0]",
                ["line 3", "not all zero"],
            ),
            (Room::Turntable, "axis = []", ["without axes", "[[axis]]"]),
            (
                Room::Path,
                "first_dwell_s = nan",
                ["line 1", "first_dwell_s = nan"],
            ),
            (Room::Path, "first_dwell_s = 1", ["[axes]", "[body]"]),
            (
                Room::Scenario,
                "seed = 1\n[site]\nlatitude_deg = 91.0",
                ["line 3", "latitude from -90 to 90"],
            ),
            (
                Room::Trajectory,
                "[[segment]]\nturn = 90.0",
                ["line 2", "expected one of `duration_s`"],
            ),
        ] {
            let message = message(room, content);
            for said in says {
                assert!(message.contains(said), "{said} in {message}");
            }
        }
    }
}
