//! Everything whose error is compared, and how it is spoken of.

use crate::calibration::Nis;
use crate::imu::Sensor;
use crate::study::accuracy::{Journey, Region};
use crate::study::{Accuracy, Figures};
use crate::units::NAUTICAL_MILE;

/// 99 % of a normal distribution lie within this many σ.
const SIGMAS_99: f64 = 2.576;

/// Something whose error is compared, with how it is shown.
pub(super) struct Compared<'a> {
    pub(super) title: String,
    /// The triad; none of a position.
    pub(super) sensor: Option<Sensor>,
    /// Symbol of the unit.
    pub(super) unit: &'static str,
    /// The unit in SI.
    pub(super) unit_value: f64,
    pub(super) figures: &'a Figures,
}

/// The parameters group by group, then the position after each mission.
pub(super) fn compared(accuracy: &Accuracy) -> Vec<Compared<'_>> {
    let groups = accuracy.groups.iter().map(|of| Compared {
        title: of.group.title(),
        sensor: Some(of.group.sensor()),
        unit: of.group.unit(),
        unit_value: of.group.unit_value(),
        figures: &of.figures,
    });
    let positions = accuracy.navigation.iter().map(|of| Compared {
        title: format!("position, {}", journey_name(of.journey)),
        sensor: None,
        unit: "nmile",
        unit_value: NAUTICAL_MILE,
        figures: &of.figures,
    });
    groups.chain(positions).collect()
}

/// A mission in a word.
pub(super) fn journey_name(journey: Journey) -> &'static str {
    match journey {
        Journey::Standing => "stationary",
        Journey::Flight => "flight",
    }
}

/// A region in words.
pub(super) fn region_name(region: Region) -> String {
    match region {
        Region::East => "east within 1σ".to_owned(),
        Region::North => "north within 1σ".to_owned(),
        Region::Ellipse(sigmas) => format!("inside the {sigmas}σ ellipse"),
    }
}

/// What the lag-one correlation of white innovations stays within in 99 of 100 studies.
pub(super) fn white_within(nis: &Nis) -> f64 {
    SIGMAS_99 / (nis.count as f64).sqrt()
}
