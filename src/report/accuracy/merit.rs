//! Everything whose error is compared, in one order: the parameters group by group, then the position
//! after each mission.

use crate::imu::Sensor;
use crate::study::accuracy::{Journey, Region};
use crate::study::{Accuracy, Figures};
use crate::units::NAUTICAL_MILE;

/// One of them, with how it is shown.
pub(super) struct Merit<'a> {
    pub(super) title: String,
    /// The triad; none of a position.
    pub(super) sensor: Option<Sensor>,
    /// Symbol of the unit.
    pub(super) unit: &'static str,
    /// Its size in SI.
    pub(super) unit_value: f64,
    pub(super) figures: &'a Figures,
}

pub(super) fn merits(accuracy: &Accuracy) -> Vec<Merit<'_>> {
    let groups = accuracy.groups.iter().map(|of| Merit {
        title: of.group.title(),
        sensor: Some(of.group.sensor()),
        unit: of.group.unit(),
        unit_value: of.group.unit_value(),
        figures: &of.figures,
    });
    let positions = accuracy.navigation.iter().map(|of| Merit {
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
        Journey::Standing => "standing",
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
